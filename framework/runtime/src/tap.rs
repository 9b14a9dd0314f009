//! Taps: rows of chosen variables, copied at their own periods to a consumer in its own thread.
//!
//! A tap reads the state and never writes it (law 6). The ring is bounded: a slow consumer makes
//! the run wait; nothing is dropped, nothing grows (law 12).
use crate::plan::Place;
use crate::step::Simulation;
use crate::time::Seconds;
use std::sync::mpsc::{Receiver, SyncSender, sync_channel};
use std::thread::JoinHandle;

/// One row.
#[derive(Clone, Debug, Default)]
pub struct Row {
    /// Index of the group.
    pub group: u32,
    /// Simulated time (s).
    pub t: f64,
    /// Simulated time (ns), exact for bases that are whole nanoseconds.
    pub ns: u64,
    /// Values, as the group lists them.
    pub values: Vec<f64>,
}

/// Variables that are read together.
#[derive(Clone, Debug)]
pub struct Group {
    /// Period of the rows; a row is taken at the first tick at or after each multiple.
    pub period: Seconds,
    /// What is read.
    pub places: Vec<Place>,
}

/// What a tap feeds, in its own thread.
pub trait Consumer: Send {
    /// Takes a row.
    ///
    /// # Errors
    /// A message; the tap ends, the run is told at its next sample.
    fn row(&mut self, row: &Row) -> Result<(), String>;
    /// After the last row, also after a failed one.
    ///
    /// # Errors
    /// A message.
    fn finish(&mut self) -> Result<(), String>;
}

/// A running tap.
pub struct Tap {
    groups: Vec<(Group, u64)>,
    full: Option<SyncSender<Row>>,
    empty: Receiver<Row>,
    thread: Option<JoinHandle<Result<(), String>>>,
}

impl Tap {
    /// Starts the consumer's thread. Rows begin at the present tick when the run is at its start,
    /// and after it when the run was resumed (that row is in the earlier log).
    ///
    /// # Errors
    /// When the thread cannot be started.
    pub fn start(
        sim: &Simulation,
        groups: Vec<Group>,
        depth: usize,
        mut consumer: Box<dyn Consumer>,
    ) -> std::io::Result<Tap> {
        let width = groups.iter().map(|g| g.places.len()).max().unwrap_or(0);
        let (full, rows) = sync_channel::<Row>(depth);
        let (back, empty) = sync_channel::<Row>(depth);
        for _ in 0..depth {
            // Fits: the channel holds `depth`.
            let _ = back.try_send(Row { values: Vec::with_capacity(width), ..Row::default() });
        }
        let thread = std::thread::Builder::new().name("tap".into()).spawn(move || {
            let mut result = Ok(());
            while let Ok(row) = rows.recv() {
                result = consumer.row(&row);
                if result.is_err() {
                    break;
                }
                let _ = back.try_send(row);
            }
            // The first failure is the one that matters.
            let finished = consumer.finish();
            result.and(finished)
        })?;
        let start = sim.state().tick;
        let base = sim.plan().base;
        let groups = groups
            .into_iter()
            .map(|g| {
                let next = if start == 0 { 0 } else { passed(start, base, g.period) + 1 };
                (g, next)
            })
            .collect();
        Ok(Tap { groups, full: Some(full), empty, thread: Some(thread) })
    }

    /// Copies the rows that are due.
    ///
    /// # Errors
    /// The consumer's message, once it has failed.
    pub fn sample(&mut self, sim: &Simulation) -> Result<(), String> {
        let (tick, base) = (sim.state().tick, sim.plan().base);
        for k in 0..self.groups.len() {
            let (group, next) = &mut self.groups[k];
            let due = u128::from(tick) * u128::from(base.num) * u128::from(group.period.den)
                >= u128::from(*next) * u128::from(group.period.num) * u128::from(base.den);
            if !due {
                continue;
            }
            *next = passed(tick, base, group.period) + 1;
            let Some(full) = &self.full else { return Err("the tap has ended".into()) };
            let Ok(mut row) = self.empty.recv() else { return self.end() };
            row.group = k as u32;
            row.t = base.times(tick);
            row.ns = nanoseconds(tick, base);
            row.values.clear();
            row.values.extend(group.places.iter().map(|p| sim.value(*p)));
            if full.send(row).is_err() {
                return self.end();
            }
        }
        Ok(())
    }

    /// Waits for the consumer to take the last row and finish.
    ///
    /// # Errors
    /// The consumer's message.
    pub fn finish(mut self) -> Result<(), String> {
        self.end()
    }

    fn end(&mut self) -> Result<(), String> {
        self.full = None;
        match self.thread.take().map(JoinHandle::join) {
            None => Err("the tap has ended".into()),
            Some(Ok(result)) => result,
            Some(Err(_)) => Err("the consumer of the tap panicked".into()),
        }
    }
}

impl Drop for Tap {
    fn drop(&mut self) {
        if self.thread.is_some() {
            let _ = self.end();
        }
    }
}

/// How many whole periods fit into `tick` ticks.
fn passed(tick: u64, base: Seconds, period: Seconds) -> u64 {
    let n = u128::from(tick) * u128::from(base.num) * u128::from(period.den);
    let d = u128::from(base.den) * u128::from(period.num);
    u64::try_from(n / d.max(1)).unwrap_or(u64::MAX - 1)
}

fn nanoseconds(tick: u64, base: Seconds) -> u64 {
    let n = u128::from(tick) * u128::from(base.num) * 1_000_000_000;
    u64::try_from(n / u128::from(base.den)).unwrap_or(u64::MAX)
}
