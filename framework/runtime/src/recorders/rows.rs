//! Samples of a recorder group: when they are due, and which of them are sent to the consumer.
//!
//! ```text
//! due             the first tick at or after each multiple of the period
//! around events   of these, from `before` ahead of the instant at which a condition becomes true to `after` behind it; rows of the last `before` wait
//! in a ring buffer
//! on change       of these, rows with a value that differs from the last sent row
//! ```
//! A condition is evaluated at every tick, independent of the rate of rows. It is an event where it is true and was false at the previous tick, and
//! at the start of a run if it is true there, but not where a log begins later. A condition on a variable that the phase does not have is false.
use crate::author::noise;
use crate::author::overlay::SharedOverlay;
use crate::author::shown::SharedField;
use crate::author::time::{Seconds, nanoseconds};
use crate::author::variable::Place;
use crate::plan::compiled::Plan;
use crate::plan::condition::Condition;
use crate::recorders::schedule::Schedule;
use crate::step::simulation::Simulation;
use serde::{Deserialize, Serialize};
use std::collections::VecDeque;

/// One row.
#[derive(Clone, Debug, Default)]
pub struct Sample {
    /// Index of the group.
    pub group: u32,
    /// Phase of the program.
    pub phase: u32,
    /// Tick of the common base.
    pub tick: u64,
    /// Simulated time (s).
    pub t: f64,
    /// Simulated time (ns), exact for bases that are whole nanoseconds.
    pub ns: u64,
    /// Values, as the group lists them.
    pub values: Vec<f64>,
    /// Data of the group's fields; `None` for fields that the phase does not have.
    pub shown: Vec<Option<SharedField>>,
    /// Ground overlays of the group's parts; `None` for parts that the phase does not have.
    pub overlays: Vec<Option<SharedOverlay>>,
}

impl Sample {
    /// Releases data shared with parts: while a row holds them, a part must copy its data to change them.
    pub(crate) fn let_go(&mut self) {
        self.shown.clear();
        self.overlays.clear();
    }
}

/// Time windows around the instants at which a condition becomes true.
#[derive(Clone, Debug, PartialEq)]
pub struct Around {
    /// Condition over the variables of a program.
    pub when: Condition,
    /// Duration of the window before the event.
    pub before: Seconds,
    /// Duration of the window after the event.
    pub after: Seconds,
}

impl Around {
    /// Maximum number of bytes of rows that wait for an event; they are part of checkpoints.
    pub const HELD_MAX: u128 = 16 << 20;

    /// Returns the maximum number of bytes of waiting rows with `columns` columns.
    pub fn held(&self, period: Seconds, columns: usize) -> u128 {
        let row = std::mem::size_of::<Sample>() + 8 * columns;
        self.rows(period).saturating_mul(row as u128)
    }

    /// Checks that the waiting rows do not exceed [`Around::HELD_MAX`].
    ///
    /// # Errors
    /// Returns the message and the remedy.
    pub fn check(&self, period: Seconds, columns: usize) -> Result<(), (String, String)> {
        let (held, mib) = (self.held(period, columns), |n: u128| n as f64 / f64::from(1 << 20));
        if held <= Self::HELD_MAX {
            return Ok(());
        }
        let fact = format!(
            "{:.1} MiB of rows would be kept in memory for `{}`, but the limit is {} MiB",
            mib(held),
            self.when.text,
            mib(Self::HELD_MAX)
        );
        let most = Self::HELD_MAX as f64 / held as f64 * self.before.seconds();
        let help =
            format!("use a shorter `before` (below {most:.3} s), a lower rate, or fewer channels");
        Err((fact, help))
    }

    /// Returns the number of rows in `before`.
    fn rows(&self, period: Seconds) -> u128 {
        let n = u128::from(self.before.num) * u128::from(period.den);
        let d = u128::from(self.before.den) * u128::from(period.num);
        n / d.max(1) + 2
    }
}

/// Logging rule: variables, and which of their rows are written.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Rule {
    /// Paths of the variables.
    pub paths: Vec<String>,
    /// Period of the rows.
    pub period: Seconds,
    /// Only rows with a changed value.
    pub on_change: bool,
    /// Only rows around events.
    pub around: Option<Around>,
}

/// Variables that are sampled together.
#[derive(Clone, Debug, Default)]
pub struct Group {
    /// Period of the rows; a row is taken at the first tick at or after each multiple.
    pub period: Seconds,
    /// Places of the variables.
    pub places: Vec<Place>,
    /// For each phase, the slots of continuous states that follow: the coordinates of its mechanism.
    pub coordinates: Vec<std::ops::Range<usize>>,
    /// Paths of the fields whose data are included. While a consumer holds a row, a field copies its data to change them.
    pub shown: Vec<String>,
    /// Paths of the parts whose overlays are included.
    pub overlays: Vec<String>,
    /// Only rows with a value that is not bit-identical to the last sent row (NaN equals NaN). The first row is always sent.
    pub on_change: bool,
    /// Only rows around events.
    pub around: Option<Around>,
}

impl Group {
    /// Returns the maximum number of values of a row.
    pub(crate) fn width(&self) -> usize {
        let lanes = self.coordinates.iter().map(ExactSizeIterator::len).max().unwrap_or(0);
        self.places.len() + lanes
    }
}

/// Receiver of rows.
pub trait Sink {
    /// Returns an empty row, or `None` if this row is to be dropped.
    ///
    /// # Errors
    /// Returns a message; no further rows are accepted.
    fn room(&mut self) -> Result<Option<Sample>, String>;
    /// Accepts a filled row that [`Sink::room`] returned.
    ///
    /// # Errors
    /// Returns a message; no further rows are accepted.
    fn send(&mut self, row: Sample) -> Result<(), String>;
}

/// The rows of one group in a run.
pub struct Rows {
    group: Group,
    /// Hash of the group.
    of: u64,
    number: u32,
    schedule: Schedule,
    /// For each phase, the blocks of the fields.
    fields: Vec<Vec<Option<u32>>>,
    /// For each phase, the blocks of the parts with overlays.
    overlays: Vec<Vec<Option<u32>>>,
    /// The tick that was sampled last.
    seen: Option<u64>,
    /// Values of the last sent row, if they are compared.
    last: Option<Vec<f64>>,
    window: Option<Window>,
}

/// The current window, and the rows that wait for the next.
struct Window {
    /// Duration before an event, in ticks.
    before: u64,
    after: u64,
    /// Whether the condition held at the last tick.
    held: bool,
    /// Whether the condition was ever true.
    met: bool,
    /// Last tick of the current window.
    until: Option<u64>,
    ring: VecDeque<Sample>,
    spare: Vec<Sample>,
}

/// History that decides about future rows; part of checkpoints.
#[derive(Serialize, Deserialize)]
pub(crate) struct RowHistory {
    /// Hash of the group.
    pub of: u64,
    seen: Option<u64>,
    /// Bits.
    last: Option<Vec<u64>>,
    held: bool,
    met: bool,
    until: Option<u64>,
    /// Waiting rows: tick, phase, number of values; followed by all values as bytes.
    ring: Vec<(u64, u32, u32)>,
    #[serde(with = "crate::checkpoint::file::serde_bytes_vec")]
    values: Vec<u8>,
}

impl Rows {
    /// Starts at the current tick at the start of a run, and after it if the run was resumed, because that row is in the earlier log.
    ///
    /// # Errors
    /// Returns an error if more than [`Around::HELD_MAX`] would wait for an event.
    pub fn new(sim: &Simulation, number: u32, group: Group) -> Result<Rows, String> {
        let (start, base) = (sim.state().tick, sim.plan().base);
        let schedule = match start {
            0 => Schedule::from(0, base, group.period),
            _ => Schedule::after(start, base, group.period),
        };
        Self::with(sim, number, group, schedule)
    }

    /// Starts at the current tick, at any time.
    ///
    /// # Errors
    /// As [`Rows::new`].
    pub fn from_now(sim: &Simulation, number: u32, group: Group) -> Result<Rows, String> {
        let schedule = Schedule::from(sim.state().tick, sim.plan().base, group.period);
        Self::with(sim, number, group, schedule)
    }

    fn with(
        sim: &Simulation,
        number: u32,
        group: Group,
        schedule: Schedule,
    ) -> Result<Rows, String> {
        let base = sim.plan().base;
        let width = group.width();
        let window = match &group.around {
            None => None,
            Some(around) => {
                let fits = around.check(group.period, width);
                fits.map_err(|(fact, help)| format!("{fact}\n  help: {help}"))?;
                let row = || Sample { values: Vec::with_capacity(width), ..Sample::default() };
                let spare: Vec<Sample> =
                    std::iter::repeat_with(row).take(around.rows(group.period) as usize).collect();
                Some(Window {
                    before: base.ticks_in(around.before),
                    after: base.ticks_in(around.after),
                    // A condition that is true where a log begins is an event only at the start of a run.
                    held: sim.state().tick > 0 && holds(around, sim),
                    met: false,
                    until: None,
                    ring: VecDeque::with_capacity(spare.len()),
                    spare,
                })
            }
        };
        let (fields, overlays) = (blocks(sim, &group.shown), blocks(sim, &group.overlays));
        let of = noise::hash(format!("{group:?}").bytes());
        let (seen, last) = (None, None);
        Ok(Rows { group, of, number, schedule, fields, overlays, seen, last, window })
    }

    /// Sends the rows of the current tick. A second call at the same tick sends nothing.
    ///
    /// # Errors
    /// Returns the errors of `out`.
    #[inline]
    pub fn sample(&mut self, sim: &Simulation, out: &mut impl Sink) -> Result<(), String> {
        let tick = sim.state().tick;
        self.seen = Some(tick);
        if self.window.is_some() {
            return self.sample_around(sim, tick, out);
        }
        if !self.schedule.is_due(tick) || !self.changed(sim) {
            return Ok(());
        }
        let Some(mut row) = out.room()? else { return Ok(()) };
        self.fill(sim, &mut row);
        self.went(&row);
        out.send(row)
    }

    fn sample_around(
        &mut self,
        sim: &Simulation,
        tick: u64,
        out: &mut impl Sink,
    ) -> Result<(), String> {
        let (Some(around), Some(mut window)) = (&self.group.around, self.window.take()) else {
            return Ok(());
        };
        let held = holds(around, sim);
        let before = std::mem::replace(&mut window.held, held);
        let mut done = Ok(());
        if held && !before {
            window.met = true;
            window.until = Some(tick.saturating_add(window.after));
            window.forget(tick.saturating_sub(window.before));
            while let Some(row) = window.ring.pop_front().filter(|_| done.is_ok()) {
                done = self.give(row, &mut window.spare, out);
            }
        }
        if done.is_ok() && self.schedule.is_due(tick) {
            window.forget(tick.saturating_sub(window.before));
            // The ring buffer has room for all rows within `before`.
            let mut row = window.spare.pop().unwrap_or_default();
            self.fill(sim, &mut row);
            if window.until.is_some_and(|until| tick <= until) {
                done = self.give(row, &mut window.spare, out);
            } else {
                window.ring.push_back(row);
            }
        }
        self.window = Some(window);
        done
    }

    /// Sends a row of the window, unless it equals the last one.
    fn give(
        &mut self,
        mut row: Sample,
        spare: &mut Vec<Sample>,
        out: &mut impl Sink,
    ) -> Result<(), String> {
        let same = self.last.as_ref().is_some_and(|last| same(last, &row.values));
        let mut done = Ok(());
        if !same && let Some(mut room) = out.room()? {
            std::mem::swap(&mut room, &mut row);
            self.went(&room);
            done = out.send(room);
        }
        row.let_go();
        spare.push(row);
        done
    }

    /// Returns whether a row at the current tick would differ from the last one.
    fn changed(&self, sim: &Simulation) -> bool {
        let Some(last) = &self.last else { return true };
        let mut now = self.values(sim);
        !(last.iter().all(|a| now.next().is_some_and(|b| one(*a, b))) && now.next().is_none())
    }

    fn went(&mut self, row: &Sample) {
        if self.group.on_change {
            let last = self.last.get_or_insert_default();
            last.clear();
            last.extend_from_slice(&row.values);
        }
    }

    #[inline]
    fn values<'a>(&'a self, sim: &'a Simulation) -> impl Iterator<Item = f64> + 'a {
        let lanes = self.group.coordinates.get(sim.state().phase as usize);
        let lanes = lanes.map_or(&[][..], |lanes| &sim.state().x[lanes.clone()]);
        self.group.places.iter().map(|p| sim.value(*p)).chain(lanes.iter().copied())
    }

    #[inline]
    fn fill(&self, sim: &Simulation, row: &mut Sample) {
        let (tick, base) = (sim.state().tick, sim.plan().base);
        (row.group, row.phase, row.tick) = (self.number, sim.state().phase, tick);
        (row.t, row.ns) = (base.times(tick), nanoseconds(tick, base));
        row.values.clear();
        row.values.extend(self.group.places.iter().map(|p| sim.value(*p)));
        if let Some(lanes) = self.group.coordinates.get(row.phase as usize) {
            row.values.extend_from_slice(&sim.state().x[lanes.clone()]);
        }
        row.let_go();
        if let Some(fields) = self.fields.get(row.phase as usize) {
            row.shown.extend(fields.iter().map(|f| f.and_then(|block| sim.shown(block))));
        }
        if let Some(parts) = self.overlays.get(row.phase as usize) {
            row.overlays.extend(parts.iter().map(|p| p.and_then(|block| sim.overlay_of(block))));
        }
    }

    /// Returns the condition if it has never been true.
    pub fn unmet(&self) -> Option<&str> {
        let around = self.group.around.as_ref()?;
        self.window.as_ref().is_some_and(|w| !w.met).then_some(&*around.when.text)
    }

    pub(crate) fn keep(&self) -> RowHistory {
        let w = self.window.as_ref();
        let ring = || w.into_iter().flat_map(|w| &w.ring);
        RowHistory {
            of: self.of,
            seen: self.seen,
            last: self.last.as_ref().map(|l| l.iter().map(|x| x.to_bits()).collect()),
            held: w.is_some_and(|w| w.held),
            met: w.is_some_and(|w| w.met),
            until: w.and_then(|w| w.until),
            ring: ring().map(|r| (r.tick, r.phase, r.values.len() as u32)).collect(),
            values: ring().flat_map(|r| &r.values).flat_map(|x| x.to_le_bytes()).collect(),
        }
    }

    /// Continues from a checkpoint at the tick of `sim`. The row of that tick is sent if the run that wrote the checkpoint had not sent it.
    pub(crate) fn take(&mut self, kept: &[RowHistory], sim: &Simulation) -> Result<(), String> {
        let Some(kept) = kept.iter().find(|k| k.of == self.of) else {
            let remembers = self.group.on_change || self.window.is_some();
            return if remembers { Err("it was recorded with other rules".into()) } else { Ok(()) };
        };
        let (width, now, base) = (self.group.width(), sim.state().tick, sim.plan().base);
        let fits = |n: usize| n == width || (!self.group.coordinates.is_empty() && n <= width);
        let numbers: u128 = kept.ring.iter().map(|r| u128::from(r.2)).sum();
        let ordered = kept.ring.is_sorted_by(|a, b| a.0 < b.0);
        let good = kept.last.as_ref().is_none_or(|l| self.group.on_change && fits(l.len()))
            && kept.ring.len() <= self.window.as_ref().map_or(0, |w| w.spare.len())
            && kept.ring.iter().all(|r| fits(r.2 as usize) && r.0 <= now)
            && ordered
            && kept.values.len() as u128 == 8 * numbers
            && kept.seen.is_none_or(|seen| seen <= now);
        if !good {
            return Err("it does not match its own rules".into());
        }
        if kept.seen != Some(now) {
            self.schedule = Schedule::from(now, base, self.group.period);
        }
        self.last = kept.last.as_ref().map(|l| l.iter().map(|b| f64::from_bits(*b)).collect());
        let Some(window) = &mut self.window else { return Ok(()) };
        (window.held, window.met, window.until) = (kept.held, kept.met, kept.until);
        let mut values = kept.values.as_chunks::<8>().0.iter().map(|b| f64::from_le_bytes(*b));
        for &(tick, phase, n) in &kept.ring {
            let mut row = window.spare.pop().unwrap_or_default();
            (row.group, row.phase, row.tick) = (self.number, phase, tick);
            (row.t, row.ns) = (base.times(tick), nanoseconds(tick, base));
            row.values.clear();
            row.values.extend(values.by_ref().take(n as usize));
            window.ring.push_back(row);
        }
        Ok(())
    }
}

impl Window {
    /// Discards rows before a tick.
    fn forget(&mut self, tick: u64) {
        while self.ring.front().is_some_and(|row| row.tick < tick) {
            self.spare.extend(self.ring.pop_front());
        }
    }
}

fn holds(around: &Around, sim: &Simulation) -> bool {
    sim.holds(&around.when)
}

fn one(a: f64, b: f64) -> bool {
    a.to_bits() == b.to_bits() || (a.is_nan() && b.is_nan())
}

fn same(a: &[f64], b: &[f64]) -> bool {
    a.len() == b.len() && a.iter().zip(b).all(|(a, b)| one(*a, *b))
}

/// Returns the blocks of these parts for each phase.
fn blocks(sim: &Simulation, paths: &[String]) -> Vec<Vec<Option<u32>>> {
    let of = |plan: &Plan| {
        let block = |path: &String| {
            let place = plan.parts.iter().position(|part| part.path == *path);
            place.map(|k| k as u32)
        };
        paths.iter().map(block).collect()
    };
    sim.program().phases.iter().map(|phase| of(&phase.plan)).collect()
}
