//! The simulation's own figures: taken in passing, in fixed memory.
use crate::prepare::condition;
use linkwork_assembly::{Figure, FigureOf, Take};
use linkwork_runtime::{Condition, Fault, Place, Plan, Simulation, Unit};
use serde::{Deserialize, Serialize};

/// A running figure.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Running {
    /// Samples.
    n: f64,
    sum: f64,
    square: f64,
    min: f64,
    max: f64,
    last: f64,
}

impl Default for Running {
    fn default() -> Self {
        let (min, max) = (f64::INFINITY, f64::NEG_INFINITY);
        Running { n: 0.0, sum: 0.0, square: 0.0, min, max, last: 0.0 }
    }
}

impl Running {
    fn add(&mut self, y: f64) {
        self.n += 1.0;
        self.sum += y;
        self.square += y * y;
        self.min = self.min.min(y);
        self.max = self.max.max(y);
        self.last = y;
    }
    /// NaN of nothing: a figure of a phase that never came.
    fn take(&self, take: Take) -> f64 {
        match take {
            _ if self.n == 0.0 => f64::NAN,
            Take::Last => self.last,
            Take::Min => self.min,
            Take::Max => self.max,
            Take::Mean => self.sum / self.n,
            Take::Rms => (self.square / self.n).sqrt(),
        }
    }
}

/// One figure: what is read, how it is shown.
pub struct Tracked {
    /// Name.
    pub name: String,
    /// Unit shown.
    pub unit: String,
    source: Source,
    /// Where its one number is taken.
    at: Option<Condition>,
    take: Take,
    unit_read: Unit,
}

/// Where a figure's numbers come from.
enum Source {
    Variable(Place),
    /// 1 while it holds, 0 while it does not, nor where the phase has not all of its variables.
    Condition(Condition),
}

impl Source {
    /// `None`: this phase has no such variable.
    #[inline]
    fn value(&self, sim: &Simulation) -> Option<f64> {
        match self {
            Source::Variable(place) => Some(sim.value(*place)).filter(|y| !y.is_nan()),
            Source::Condition(c) => Some(f64::from(u8::from(sim.holds(c)))),
        }
    }
}

/// What of the past a checkpoint carries.
#[derive(Serialize, Deserialize)]
struct Kept {
    /// The tick that was taken last, and the time after it (s): that of the checkpoint, or one before it when it was asked for
    /// ahead of the watcher.
    taken: Option<(u64, f64)>,
    running: Vec<Running>,
}

/// All figures of a run.
#[derive(Default)]
pub struct Figures {
    /// What they are.
    pub list: Vec<Tracked>,
    /// Where they stand.
    pub running: Vec<Running>,
    /// The tick that was taken last, and the time after it (s).
    taken: Option<(u64, f64)>,
}

impl Figures {
    /// From the file; faults name the variable that is not there, or a unit that does not fit.
    pub fn new(plan: &Plan, figures: &[Figure]) -> Result<Figures, Vec<Fault>> {
        let (mut list, mut faults) = (Vec::new(), Vec::new());
        for f in figures {
            let what = format!("figure `{}`", f.name);
            let at = match f.at.as_ref().map(|at| condition(plan, at, &what)).transpose() {
                Ok(at) => at,
                Err(fault) => {
                    faults.push(fault);
                    continue;
                }
            };
            let of = match &f.of {
                FigureOf::Variable(of) => of,
                FigureOf::Condition(when) => {
                    match condition(plan, when, &what) {
                        Ok(c) => list.push(Tracked {
                            name: f.name.clone(),
                            unit: String::new(),
                            source: Source::Condition(c),
                            at,
                            take: f.take,
                            unit_read: Unit::ONE,
                        }),
                        Err(fault) => faults.push(fault),
                    }
                    continue;
                }
            };
            let v = match plan.variable(&of.text) {
                Ok(v) => v,
                Err(e) => {
                    faults.push(
                        Fault::new(of.origin, format!("figure `{}`: {}", f.name, e.message))
                            .help(e.help),
                    );
                    continue;
                }
            };
            let unit = f.unit.as_ref().map_or_else(|| v.unit.to_string(), |u| u.text.clone());
            let parsed = if unit.is_empty() { Ok(Unit::ONE) } else { Unit::parse(&unit) };
            let own = Unit::parse(&v.unit).unwrap_or(Unit::ONE);
            match parsed {
                Ok(u) if u.same_quantity(&own) => {
                    list.push(Tracked {
                        name: f.name.clone(),
                        unit,
                        source: Source::Variable(v.place),
                        at,
                        take: f.take,
                        unit_read: u,
                    });
                }
                Ok(_) => faults.push(
                    Fault::new(
                        f.origin,
                        format!(
                            "figure `{}`: `{}` is in {}, which is no {unit}",
                            f.name, of.text, v.unit
                        ),
                    )
                    .help("choose a unit of the same quantity"),
                ),
                Err(e) => faults.push(Fault::new(f.origin, e.to_string())),
            }
        }
        if !faults.is_empty() {
            return Err(faults);
        }
        let running = vec![Running::default(); list.len()];
        Ok(Figures { list, running, taken: None })
    }

    /// Takes the values of this tick, unless they are taken already.
    #[inline]
    pub fn sample(&mut self, sim: &Simulation) {
        let now = (sim.state().tick, sim.state().since);
        if self.taken.replace(now) == Some(now) {
            return;
        }
        for (f, r) in self.list.iter().zip(&mut self.running) {
            if let Some(at) = &f.at
                && (r.n > 0.0 || !sim.holds(at))
            {
                continue;
            }
            if let Some(value) = f.source.value(sim) {
                r.add(value);
            }
        }
    }

    /// Where they stand, for a checkpoint.
    ///
    /// # Errors
    /// A message, when they cannot be written down.
    pub fn save(&self) -> Result<Vec<u8>, String> {
        let kept = Kept { taken: self.taken, running: self.running.clone() };
        rmp_serde::to_vec_named(&kept).map_err(|e| format!("the figures: {e}"))
    }

    /// Goes on where a checkpoint stood, whose tick `sim` has: that tick is taken again only when the run that wrote it
    /// had not taken it yet. Figures of another simulation are left alone.
    pub fn restore(&mut self, saved: &[u8], sim: &Simulation) {
        let (n, now) = (self.running.len(), (sim.state().tick, sim.state().since));
        let kept: Option<Kept> = rmp_serde::from_slice(saved).ok();
        let fits = |k: &Kept| k.running.len() == n && k.taken.is_none_or(|taken| taken <= now);
        if let Some(kept) = kept.filter(fits) {
            (self.taken, self.running) = (kept.taken, kept.running);
        }
    }

    /// Name, value and unit of each.
    pub fn results(&self) -> impl Iterator<Item = (&str, f64, &str)> {
        self.list.iter().zip(&self.running).map(|(f, r)| {
            let value = (r.take(f.take) - f.unit_read.offset) / f.unit_read.scale;
            (f.name.as_str(), value, f.unit.as_str())
        })
    }
}
