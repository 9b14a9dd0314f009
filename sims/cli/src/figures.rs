//! The simulation's own figures and the curves of its plots: taken in passing, in fixed memory.
use linkwork_assembly::{Figure, Take};
use linkwork_runtime::{Place, Plan, Simulation, Unit};
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
    fn take(&self, take: Take) -> f64 {
        match take {
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
    place: Place,
    take: Take,
    unit_read: Unit,
}

/// All figures of a run.
#[derive(Default)]
pub struct Figures {
    /// What they are.
    pub list: Vec<Tracked>,
    /// Where they stand.
    pub running: Vec<Running>,
}

impl Figures {
    /// From the file; faults name the variable that is not there, or a unit that does not fit.
    pub fn new(plan: &Plan, figures: &[Figure]) -> Result<Figures, Vec<linkwork_runtime::Fault>> {
        let (mut list, mut faults) = (Vec::new(), Vec::new());
        for f in figures {
            let v = match plan.variable(&f.of.text) {
                Ok(v) => v,
                Err(e) => {
                    faults.push(
                        linkwork_runtime::Fault::new(
                            f.of.origin,
                            format!("figure `{}`: {}", f.name, e.message),
                        )
                        .help(e.help),
                    );
                    continue;
                }
            };
            let unit = f.unit.as_ref().map_or(v.unit.clone(), |u| u.text.clone());
            let parsed = if unit.is_empty() { Ok(Unit::ONE) } else { Unit::parse(&unit) };
            let own = Unit::parse(&v.unit).unwrap_or(Unit::ONE);
            match parsed {
                Ok(u) if u.same_quantity(&own) => {
                    list.push(Tracked {
                        name: f.name.clone(),
                        unit,
                        place: v.place,
                        take: f.take,
                        unit_read: u,
                    });
                }
                Ok(_) => faults.push(
                    linkwork_runtime::Fault::new(
                        f.origin,
                        format!(
                            "figure `{}`: `{}` is in {}, which is no {unit}",
                            f.name, f.of.text, v.unit
                        ),
                    )
                    .help("choose a unit of the same quantity"),
                ),
                Err(e) => faults.push(linkwork_runtime::Fault::new(f.origin, e.to_string())),
            }
        }
        if !faults.is_empty() {
            return Err(faults);
        }
        let running = vec![Running::default(); list.len()];
        Ok(Figures { list, running })
    }

    /// Takes the present values.
    #[inline]
    pub fn sample(&mut self, sim: &Simulation) {
        for (f, r) in self.list.iter().zip(&mut self.running) {
            r.add(sim.value(f.place));
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

/// Points of a curve, thinned to a fixed number however long the run.
#[derive(Clone, Debug, Default)]
pub struct Thinned {
    /// Points kept.
    pub points: Vec<(f64, f64)>,
    every: u64,
    seen: u64,
}

impl Thinned {
    const MOST: usize = 4096;

    /// Room for all points it will ever keep.
    pub fn new() -> Self {
        Thinned { points: Vec::with_capacity(Self::MOST), every: 1, seen: 0 }
    }

    /// Takes a point, or passes it over.
    pub fn add(&mut self, x: f64, y: f64) {
        if self.seen.is_multiple_of(self.every) {
            if self.points.len() == Self::MOST {
                let mut k = 0;
                self.points.retain(|_| {
                    k += 1;
                    k % 2 == 1
                });
                self.every *= 2;
            }
            if self.seen.is_multiple_of(self.every) {
                self.points.push((x, y));
            }
        }
        self.seen += 1;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn thinning_keeps_memory_and_the_shape() {
        let mut t = Thinned::new();
        for k in 0..1_000_000 {
            t.add(f64::from(k), f64::from(k) * 2.0);
        }
        assert!(t.points.len() <= 4096 && t.points.len() > 2000);
        assert_eq!(t.points.capacity(), 4096);
        let gaps: Vec<f64> = t.points.windows(2).map(|w| w[1].0 - w[0].0).collect();
        assert!(gaps.iter().all(|g| *g == gaps[0]), "evenly spaced");
    }
}
