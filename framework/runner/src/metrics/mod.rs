//! The metrics of a simulation: numbers that summarize a run, computed during the run with constant memory.
//!
//! Metrics observe the run ([`Observer`]). They use variables as functions of time, not only samples: a mean does not depend on the length of the
//! steps, and an extreme value between two ticks is found. Metrics of the same variable share its statistics.
mod quantiles;
mod statistics;

use crate::balance::{Balance, Saved};
use crate::conditions::condition;
use linkwork_assembly::form::{Metric, MetricOf, Take};
use linkwork_runtime::{
    Condition, Fault, Observer, ObserverRequest, Place, Plan, PortKind, Simulation, Stretch, Times,
    Unit,
};
use serde::{Deserialize, Serialize};
use statistics::{Span, Statistics, Wants, crossing};

/// A metric: its name and its displayed unit.
#[derive(Clone, Debug)]
pub struct Tracked {
    /// Name.
    pub name: String,
    /// Unit shown.
    pub unit: String,
    take: Take,
    shown_in: Unit,
    of: Of,
}

/// The series or the first value of a metric, by its index in [`Metrics`].
#[derive(Clone, Copy, Debug)]
enum Of {
    Series(usize),
    First(usize),
}

/// A variable or a condition over time.
#[derive(Clone, Debug)]
struct Series {
    /// The text in the file: its key in checkpoints.
    key: String,
    source: Source,
    wants: Wants,
    statistics: Statistics,
}

#[derive(Clone, Debug)]
enum Source {
    /// The column of a number.
    Number(usize),
    /// The column of a truth value.
    Truth(usize),
    /// 1 while the condition holds, otherwise 0; also 0 in a phase that lacks one of its variables.
    Condition(Over),
}

/// A condition over columns.
#[derive(Clone, Debug)]
struct Over {
    condition: Condition,
    /// Place and column of each of its variables.
    columns: Vec<(Place, usize)>,
}

impl Over {
    /// Not negative where the condition holds.
    fn value(&self, t: Times, values: &[f64]) -> f64 {
        let value = self.condition.margin(t, |place| {
            let column = self.columns.iter().find(|(own, _)| *own == place);
            column.map_or(f64::NAN, |(_, column)| values[*column])
        });
        if value.is_nan() { -1.0 } else { value }
    }
}

/// The value of a variable at the first instant at which a condition holds.
#[derive(Clone, Debug)]
struct First {
    key: String,
    column: usize,
    when: Over,
    /// Instant and value.
    found: Option<(f64, f64)>,
    /// Instant and value, if the condition becomes true at the end of an interval: the work of that instant may still change the value.
    at_end: Option<(f64, f64)>,
}

/// A condition that becomes true within this time (s) before the end of an interval, or before a row, becomes true at the end or at the row.
pub(crate) const INSTANT: f64 = 1e-9;

/// The state of all metrics in a checkpoint, by the keys of their series.
#[derive(Serialize, Deserialize)]
struct SavedMetrics {
    series: Vec<(String, Statistics)>,
    firsts: Vec<(String, Option<(f64, f64)>)>,
    balance: Option<Saved>,
}

/// All metrics of a run.
#[derive(Clone, Debug, Default)]
pub struct Metrics {
    /// The metrics, sorted by name.
    pub list: Vec<Tracked>,
    places: Vec<Place>,
    series: Vec<Series>,
    firsts: Vec<First>,
    memo: Memo,
    /// The balances of the run, if enabled.
    pub balance: Option<Balance>,
}

/// Cache of values inside an interval that several metrics use.
#[derive(Clone, Debug, Default)]
struct Memo {
    known: [bool; PARTS.len()],
    values: Vec<f64>,
}

/// The positions in the interval whose values are cached.
const PARTS: [f64; 3] = [0.5, 0.25, 0.75];

impl Memo {
    /// Returns the value of a column at a position in the interval.
    fn at(&mut self, over: &mut Stretch<'_>, part: f64, column: usize) -> Option<f64> {
        let Some(k) = PARTS.iter().position(|p| *p == part) else {
            return over.at(part).map(|values| values[column]);
        };
        let n = over.start().len();
        let own = k * n..(k + 1) * n;
        if !self.known[k] {
            self.values.get_mut(own.clone())?.copy_from_slice(over.at(part)?);
            self.known[k] = true;
        }
        self.values.get(own).map(|values| values[column])
    }
}

impl Metrics {
    /// Creates the metrics of a file.
    ///
    /// # Errors
    /// Variables that do not exist, units of another quantity, conditions with syntax errors.
    pub fn new(plan: &Plan, metrics: &[Metric]) -> Result<Metrics, Vec<Fault>> {
        let (mut all, mut faults) = (Metrics::default(), Vec::new());
        for metric in metrics {
            if let Err(fault) = all.add(plan, metric) {
                faults.push(fault);
            }
        }
        if faults.is_empty() { Ok(all) } else { Err(faults) }
    }

    fn column(&mut self, place: Place) -> usize {
        let known = self.places.iter().position(|p| *p == place);
        known.unwrap_or_else(|| {
            self.places.push(place);
            self.places.len() - 1
        })
    }

    fn over(&mut self, condition: Condition) -> Over {
        let mut columns: Vec<(Place, usize)> = Vec::new();
        for place in condition.places() {
            if !columns.iter().any(|c| c.0 == place) {
                columns.push((place, self.column(place)));
            }
        }
        Over { condition, columns }
    }

    fn add(&mut self, plan: &Plan, f: &Metric) -> Result<(), Fault> {
        let what = format!("metric `{}`", f.name);
        let at = f.at.as_ref().map(|at| condition(plan, at, &what)).transpose()?;
        let (source, key, own) = match &f.of {
            MetricOf::Condition(when) => {
                let condition = condition(plan, when, &what)?;
                let key = format!("when {}", condition.text);
                (Source::Condition(self.over(condition)), key, Unit::ONE)
            }
            MetricOf::Variable(of) => {
                let v = plan.variable(&of.text).map_err(|e| {
                    Fault::new(of.origin, format!("{what}: {}", e.message)).help(e.help)
                })?;
                let own = Unit::parse(&v.unit).unwrap_or(Unit::ONE);
                let column = self.column(v.place);
                let source = match v.kind {
                    PortKind::Bool => Source::Truth(column),
                    _ => Source::Number(column),
                };
                (source, format!("of {}", of.text), own)
            }
        };
        let (unit, shown_in) = shown(plan, f, own, &what)?;
        let of = match (at, &source) {
            (Some(at), Source::Number(column) | Source::Truth(column)) => {
                let (key, column) = (format!("{key} at {}", at.text), *column);
                let when = self.over(at);
                self.firsts.push(First { key, column, when, found: None, at_end: None });
                Of::First(self.firsts.len() - 1)
            }
            _ => Of::Series(self.series(&key, source, wants(f.take))),
        };
        let (name, take) = (f.name.clone(), f.take);
        self.list.push(Tracked { name, unit, take, shown_in, of });
        Ok(())
    }

    /// Returns the place of the series of a variable or condition. Metrics that need the same statistics of it share the series, and
    /// only these, so that the result of a metric does not depend on the other metrics.
    fn series(&mut self, of: &str, source: Source, wants: Wants) -> usize {
        let key = format!("{wants:?} {of}");
        let known = self.series.iter().position(|s| s.key == key);
        known.unwrap_or_else(|| {
            self.series.push(Series { key, source, wants, statistics: Statistics::new(wants) });
            self.series.len() - 1
        })
    }

    /// Observes a run from its present instant on. Afterwards, [`Metrics::of`] returns the metrics.
    pub fn observe(mut self, sim: &mut Simulation) {
        if self.list.is_empty() && self.balance.is_none() {
            return;
        }
        let mut wanted =
            ObserverRequest { places: self.places.clone(), ..ObserverRequest::default() };
        if let Some(balance) = &mut self.balance {
            balance.want(&mut wanted);
        }
        self.memo.values = vec![f64::NAN; PARTS.len() * wanted.width()];
        sim.observe(&wanted, Box::new(self));
    }

    /// Returns the metrics that observe a run.
    pub fn of(sim: &Simulation) -> Option<&Metrics> {
        sim.observer()
    }

    /// Returns their state, for a checkpoint.
    ///
    /// # Errors
    /// A message, if the state cannot be serialized.
    pub fn save(&self) -> Result<Vec<u8>, String> {
        let kept = SavedMetrics {
            series: self.series.iter().map(|s| (s.key.clone(), s.statistics.clone())).collect(),
            firsts: self.firsts.iter().map(|f| (f.key.clone(), f.found)).collect(),
            balance: self.balance.as_ref().map(Balance::save),
        };
        rmp_serde::to_vec_named(&kept).map_err(|e| format!("the metrics: {e}"))
    }

    /// Restores the metrics of variables and conditions that the checkpoint contains. Other metrics begin at its instant.
    ///
    /// # Errors
    /// The saved state cannot be read.
    pub fn restore(&mut self, saved: &[u8]) -> Result<(), String> {
        let kept: SavedMetrics = rmp_serde::from_slice(saved)
            .map_err(|e| format!("the metrics of the checkpoint cannot be read: {e}"))?;
        for (key, mut statistics) in kept.series {
            if let Some(own) = self.series.iter_mut().find(|s| s.key == key) {
                statistics.make_room();
                own.statistics = statistics;
            }
        }
        if let (Some(own), Some(saved)) = (&mut self.balance, kept.balance) {
            own.restore(saved);
        }
        for (key, found) in kept.firsts {
            if let Some(own) = self.firsts.iter_mut().find(|f| f.key == key) {
                own.found = found;
            }
        }
        Ok(())
    }

    /// Returns name, value and unit of each metric. The value is NaN if the variable never existed or the condition never held.
    pub fn results(&self) -> impl Iterator<Item = (&str, f64, &str)> {
        self.list.iter().map(|f| {
            let value = match f.of {
                Of::First(k) => self.firsts[k].found.map_or(f64::NAN, |(_, y)| f.point(y)),
                Of::Series(k) => f.value(&self.series[k]),
            };
            (f.name.as_str(), value, f.unit.as_str())
        })
    }
}

impl Tracked {
    /// Converts a value of the variable to its displayed unit.
    fn point(&self, y: f64) -> f64 {
        (y - self.shown_in.offset) / self.shown_in.scale
    }

    /// Returns the metric. Differences and deviations do not have an offset: a range of 10 K is one of 10 degC.
    fn value(&self, of: &Series) -> f64 {
        let (s, scale) = (&of.statistics, self.shown_in.scale);
        if s.last.is_nan() && s.time == 0.0 {
            return f64::NAN;
        }
        match self.take {
            Take::Last => self.point(s.last),
            Take::Min => self.point(s.min.0),
            Take::Max => self.point(s.max.0),
            Take::MaxAbs => self.point(s.min.0).abs().max(self.point(s.max.0).abs()),
            Take::Range => (s.max.0 - s.min.0) / scale,
            Take::Mean => self.point(s.mean()),
            Take::Rms => (s.variance() / (scale * scale) + self.point(s.mean()).powi(2)).sqrt(),
            Take::Std => s.variance().sqrt() / scale,
            Take::Percentile(percent) => {
                let ends = (s.min.0, s.max.0);
                let found = s.quantiles.as_ref().and_then(|q| q.at(percent / 100.0, ends));
                self.point(found.unwrap_or(s.last))
            }
            Take::TimeOfMin => self.point(s.min.1),
            Take::TimeOfMax => self.point(s.max.1),
            Take::TimeOfMaxAbs => {
                let of = if s.max.0 >= -s.min.0 { s.max } else { s.min };
                self.point(of.1)
            }
        }
    }
}

/// Returns the unit as text and as parsed. Instants are shown in a unit of time.
fn shown(plan: &Plan, f: &Metric, own: Unit, what: &str) -> Result<(String, Unit), Fault> {
    let instant = matches!(f.take, Take::TimeOfMin | Take::TimeOfMax | Take::TimeOfMaxAbs);
    let (of, text) = match &f.of {
        MetricOf::Condition(_) => ("it", ""),
        MetricOf::Variable(of) => {
            (of.text.as_str(), plan.variables.get(&of.text).map_or("", |v| &*v.unit))
        }
    };
    let (own, text) = match instant {
        true => (Unit::parse("s").unwrap_or(Unit::ONE), "s"),
        false => (own, text),
    };
    let unit = f.unit.as_ref().map_or(text, |u| u.text.as_str()).to_string();
    let origin = f.unit.as_ref().map_or(f.origin, |u| u.origin);
    let parsed = if unit.is_empty() { Ok(Unit::ONE) } else { Unit::parse(&unit) };
    match parsed {
        Ok(u) if u.same_quantity(&own) => Ok((unit, u)),
        Ok(_) if instant => Err(Fault::new(
            origin,
            format!("{what}: an instant needs a unit of time, but {unit} is not one"),
        )
        .help("write s, min, h or day, or omit `unit`")),
        Ok(_) => Err(Fault::new(
            origin,
            format!("{what}: `{of}` is in {text}, which is a different quantity than {unit}"),
        )
        .help("choose a unit of the same quantity")),
        Err(e) => Err(Fault::new(origin, format!("{what}: {e}"))),
    }
}

fn wants(take: Take) -> Wants {
    match take {
        Take::Last => Wants::Last,
        Take::Mean | Take::Rms | Take::Std => Wants::Moments,
        Take::Percentile(_) => Wants::Quantiles,
        Take::Min | Take::Max | Take::MaxAbs | Take::Range => Wants::Extremes,
        Take::TimeOfMin | Take::TimeOfMax | Take::TimeOfMaxAbs => Wants::Extremes,
    }
}

impl Observer for Metrics {
    fn instant(&mut self, t: Times, values: &[f64]) {
        if let Some(balance) = &mut self.balance {
            balance.instant(t.time, values);
        }
        for Series { source, statistics, .. } in &mut self.series {
            let y = match source {
                Source::Number(column) | Source::Truth(column) => values[*column],
                Source::Condition(over) => truth(over.value(t, values)),
            };
            if !y.is_nan() {
                statistics.instant(t.time, y);
            }
        }
        for first in &mut self.firsts {
            first.instant(t, values);
        }
    }

    fn changed(&mut self) {
        if let Some(balance) = &mut self.balance {
            balance.changed();
        }
    }

    fn stretch(&mut self, over: &mut Stretch<'_>) {
        if let Some(balance) = &mut self.balance {
            balance.stretch(over);
        }
        self.memo.known = [false; PARTS.len()];
        for series in &mut self.series {
            if series.wants != Wants::Last {
                series.stretch(over, &mut self.memo);
            }
        }
        for first in &mut self.firsts {
            first.instant(over.times(over.begin()), over.start());
            if first.found.is_none() {
                first.stretch(over);
            }
        }
    }
}

/// Returns whether a condition with this margin holds.
fn holds(margin: f64) -> bool {
    margin >= 0.0
}

fn truth(margin: f64) -> f64 {
    f64::from(u8::from(holds(margin)))
}

impl Series {
    fn stretch(&mut self, over: &mut Stretch<'_>, memo: &mut Memo) {
        let (begin, length) = (over.begin(), over.length());
        match &self.source {
            Source::Number(column) => {
                let (start, end) = (over.start()[*column], over.end()[*column]);
                if start.is_nan() {
                    return;
                }
                if over.is_held(*column) || !end.is_finite() {
                    return self.statistics.held(begin, length, start);
                }
                // A pulse that is shorter than the step is not visible at its ends.
                let wide = over.is_wide() || over.average(*column).is_some();
                let span = Span { begin, length, start, end, wide };
                let mut inside = |part: f64| memo.at(over, part, *column);
                self.statistics.smooth(span, self.wants, &mut inside);
            }
            Source::Truth(column) => {
                let of = |_: Times, values: &[f64]| values[*column] - 0.5;
                if !over.start()[*column].is_nan() {
                    shares(&mut self.statistics, over, &of);
                }
            }
            Source::Condition(condition) => {
                shares(&mut self.statistics, over, &|t, values| condition.value(t, values));
            }
        }
    }
}

/// A function of time and columns that is not negative where a condition holds.
type Holds<'a> = dyn Fn(Times, &[f64]) -> f64 + 'a;

/// Returns the parts of an interval in which the condition holds, and in which it does not.
fn shares(statistics: &mut Statistics, over: &mut Stretch<'_>, of: &Holds<'_>) {
    let (begin, length) = (over.begin(), over.length());
    let mut from = (0.0, of(over.times(begin), over.start()));
    let end = (1.0, of(over.times(begin + length), over.end()));
    // The condition may change twice between the two ends.
    let middle = if over.is_wide() { at(over, 0.5, of) } else { None };
    for to in middle.map(|y| (0.5, y)).into_iter().chain([end]) {
        let split = split(over, from, to, of);
        statistics.held(begin + from.0 * length, (split - from.0) * length, truth(from.1));
        statistics.held(begin + split * length, (to.0 - split) * length, truth(to.1));
        from = to;
    }
}

fn at(over: &mut Stretch<'_>, part: f64, of: &Holds<'_>) -> Option<f64> {
    let t = over.times(over.begin() + part * over.length());
    over.at(part).map(|values| of(t, values))
}

/// Returns where the condition changes between two positions in an interval, or the second position if it does not.
fn split(over: &mut Stretch<'_>, from: (f64, f64), to: (f64, f64), of: &Holds<'_>) -> f64 {
    if holds(from.1) == holds(to.1) {
        return to.0;
    }
    let width = to.0 - from.0;
    let mut inside = |part: f64| at(over, from.0 + part * width, of);
    from.0 + width * crossing(from.1, to.1, &mut inside)
}

impl First {
    /// Processes the values right after the work of an instant.
    fn instant(&mut self, t: Times, values: &[f64]) {
        if self.found.is_some() {
            return;
        }
        let y = values[self.column];
        self.found = match holds(self.when.value(t, values)) && !y.is_nan() {
            true => Some((t.time, y)),
            // The condition held at the end of the interval, and the work of this instant has ended it.
            false => self.at_end,
        };
        self.at_end = None;
    }

    fn stretch(&mut self, over: &mut Stretch<'_>) {
        let (begin, length, column) = (over.begin(), over.length(), self.column);
        let when = |t: Times, values: &[f64]| self.when.value(t, values);
        let mut from = (0.0, when(over.times(begin), over.start()));
        let end = (1.0, when(over.times(begin + length), over.end()));
        let middle = if over.is_wide() { at(over, 0.5, &when) } else { None };
        for to in middle.map(|y| (0.5, y)).into_iter().chain([end]) {
            if holds(to.1) && !holds(from.1) {
                let part = split(over, from, to, &when);
                let inside = over.at(part).map(|values| values[column]);
                let y = inside.unwrap_or(over.end()[column]);
                if !y.is_nan() {
                    let found = Some((begin + part * length, y));
                    match (1.0 - part) * length > INSTANT {
                        true => self.found = found,
                        false => self.at_end = found,
                    }
                    return;
                }
            }
            from = to;
        }
    }
}
