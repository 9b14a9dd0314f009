//! Taps: rows of chosen variables, copied at their own periods to a consumer in its own thread.
//!
//! A tap reads the state and never writes it (law 6). The ring is bounded, so nothing grows
//! (law 12). What a slow consumer costs is said where the tap is started: a log makes the run
//! wait and loses nothing; a viewer makes it wait a little in all, and then loses rows, which are
//! counted.
use crate::field::Shown;
use crate::plan::{FieldPlan, Place, Plan};
use crate::schedule::Schedule;
use crate::step::Simulation;
use crate::time::Seconds;
use std::sync::mpsc::{
    Receiver, RecvTimeoutError, SyncSender, TryRecvError, TrySendError, sync_channel,
};
use std::time::Duration;

/// One row.
#[derive(Clone, Debug, Default)]
pub struct TapRow {
    /// Index of the group.
    pub group: u32,
    /// Phase of the program.
    pub phase: u32,
    /// Simulated time (s).
    pub t: f64,
    /// Simulated time (ns), exact for bases that are whole nanoseconds.
    pub ns: u64,
    /// Values, as the group lists them.
    pub values: Vec<f64>,
    /// What the group's fields show, those that the phase has.
    pub shown: Vec<Option<Shown>>,
}

/// What is done to a variable from outside of the simulation.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Change {
    /// It is set, once.
    Set,
    /// It is pinned: it keeps the value.
    Pin,
    /// It is unpinned.
    Unpin,
}

/// A variable that was set, pinned or unpinned from outside of the simulation.
#[derive(Clone, Debug, PartialEq)]
pub struct SetRow {
    /// Tick of the common base.
    pub tick: u64,
    /// Simulated time (ns).
    pub ns: u64,
    /// The variable.
    pub path: String,
    /// What was done to it.
    pub change: Change,
    /// Its new value (SI); when it was unpinned, the value that it has then.
    pub value: f64,
}

/// Variables that are read together.
#[derive(Clone, Debug, Default)]
pub struct Group {
    /// Period of the rows; a row is taken at the first tick at or after each multiple.
    pub period: Seconds,
    /// What is read.
    pub places: Vec<Place>,
    /// Continuous lanes that are read after that, for each phase: the coordinates of its mechanism.
    pub coordinates: Vec<std::ops::Range<usize>>,
    /// Paths of the fields whose data go along. As long as a row is with its consumer, a field that changes is copied.
    pub shown: Vec<String>,
}

/// What a tap feeds, in its own thread.
pub trait Consumer: Send {
    /// Takes a row.
    ///
    /// # Errors
    /// A message; the tap ends, the run is told at its next sample.
    fn row(&mut self, row: &TapRow) -> Result<(), String>;
    /// Somebody set, pinned or unpinned a variable, at the tick whose rows come next.
    ///
    /// # Errors
    /// A message; the tap ends.
    fn set(&mut self, _set: &SetRow) -> Result<(), String> {
        Ok(())
    }
    /// Brings the rows so far to where a killed process leaves them ([`Tap::flush`]).
    ///
    /// # Errors
    /// A message; the tap ends.
    fn flush(&mut self) -> Result<(), String> {
        Ok(())
    }
    /// After the last row, also after a failed one.
    ///
    /// # Errors
    /// A message.
    fn finish(&mut self) -> Result<(), String>;
}

/// What happens to rows that the consumer is too slow for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Overflow {
    /// The run waits: every row arrives.
    Wait,
    /// The run waits two seconds in all, for as long as the consumer takes nothing; then rows are
    /// dropped and counted.
    Drop,
}

/// A wait for a consumer that may drop rows, and how many of them there are in a run.
const PATIENCE: (Duration, u32) = (Duration::from_millis(10), 200);

/// For each phase the blocks of these fields.
fn fields(sim: &Simulation, shown: &[String]) -> Vec<Vec<Option<u32>>> {
    let of = |plan: &Plan| {
        let block = |path: &String| {
            let is = |f: &&FieldPlan| plan.parts[f.block as usize].path == *path;
            plan.fields.iter().find(is).map(|f| f.block)
        };
        shown.iter().map(block).collect()
    };
    sim.program().phases.iter().map(|phase| of(&phase.plan)).collect()
}

enum Message {
    Row(TapRow),
    Set(SetRow),
    /// The answer goes back.
    Flush(SyncSender<Result<(), String>>),
}

/// A running tap.
pub struct Tap {
    groups: Vec<(Group, Schedule)>,
    /// For each group and phase the blocks of its fields.
    fields: Vec<Vec<Vec<Option<u32>>>>,
    full: Option<SyncSender<Message>>,
    empty: Receiver<TapRow>,
    done: Receiver<Result<(), String>>,
    overflow: Overflow,
    /// Waits left.
    patience: u32,
    dropped: u64,
}

impl Tap {
    /// Starts the consumer's thread; the run waits for it when it is slow. Rows begin at the
    /// present tick when the run is at its start, and after it when the run was resumed (that row
    /// is in the earlier log).
    ///
    /// # Errors
    /// When the thread cannot be started.
    pub fn start(
        sim: &Simulation,
        groups: Vec<Group>,
        depth: usize,
        consumer: Box<dyn Consumer>,
    ) -> std::io::Result<Tap> {
        Self::with(sim, groups, depth, Overflow::Wait, consumer)
    }

    /// The same, and what to do when the consumer is slow.
    ///
    /// # Errors
    /// When the thread cannot be started.
    pub fn with(
        sim: &Simulation,
        groups: Vec<Group>,
        depth: usize,
        overflow: Overflow,
        consumer: Box<dyn Consumer>,
    ) -> std::io::Result<Tap> {
        let lanes = |g: &Group| g.coordinates.iter().map(ExactSizeIterator::len).max().unwrap_or(0);
        let width = groups.iter().map(|g| g.places.len() + lanes(g)).max().unwrap_or(0);
        let (full, rows) = sync_channel::<Message>(depth);
        let (back, empty) = sync_channel::<TapRow>(depth);
        for _ in 0..depth {
            // Fits: the channel holds `depth`.
            let _ =
                back.try_send(TapRow { values: Vec::with_capacity(width), ..TapRow::default() });
        }
        let (end, done) = sync_channel(1);
        std::thread::Builder::new().name("tap".into()).spawn(move || {
            // Nobody may be waiting any more: then nobody wants to know.
            let _ = end.send(consume(consumer, &rows, &back));
        })?;
        let (start, base) = (sim.state().tick, sim.plan().base);
        let first = |period| match start {
            0 => Schedule::from(0, base, period),
            _ => Schedule::after(start, base, period),
        };
        let groups: Vec<(Group, Schedule)> = groups
            .into_iter()
            .map(|g| {
                let schedule = first(g.period);
                (g, schedule)
            })
            .collect();
        let fields = groups.iter().map(|(g, _)| fields(sim, &g.shown)).collect();
        let patience = PATIENCE.1;
        Ok(Tap { groups, fields, full: Some(full), empty, done, overflow, patience, dropped: 0 })
    }

    /// Copies the rows that are due.
    ///
    /// # Errors
    /// The consumer's message, once it has failed.
    pub fn sample(&mut self, sim: &Simulation) -> Result<(), String> {
        let tick = sim.state().tick;
        for k in 0..self.groups.len() {
            if !self.groups[k].1.is_due(tick) {
                continue;
            }
            let Some(mut row) = self.room()? else { continue };
            let base = sim.plan().base;
            row.group = k as u32;
            row.t = base.times(tick);
            row.ns = nanoseconds(tick, base);
            row.values.clear();
            row.phase = sim.state().phase;
            let group = &self.groups[k].0;
            row.values.extend(group.places.iter().map(|p| sim.value(*p)));
            if let Some(lanes) = group.coordinates.get(row.phase as usize) {
                row.values.extend_from_slice(&sim.state().x[lanes.clone()]);
            }
            row.shown.clear();
            if let Some(fields) = self.fields[k].get(row.phase as usize) {
                row.shown.extend(fields.iter().map(|f| f.and_then(|block| sim.shown(block))));
            }
            let Some(full) = &self.full else { return self.end() };
            // There is room: as many rows go round as the channel holds. Only a flush can be
            // in the way, and none is when rows may be dropped.
            let sent = match self.overflow {
                Overflow::Wait => full.send(Message::Row(row)).is_ok(),
                Overflow::Drop => match full.try_send(Message::Row(row)) {
                    Ok(()) => true,
                    Err(TrySendError::Full(_)) => {
                        self.dropped += 1;
                        true
                    }
                    Err(TrySendError::Disconnected(_)) => false,
                },
            };
            if !sent {
                return self.end();
            }
        }
        Ok(())
    }

    /// An empty row; `None` when this one is dropped.
    fn room(&mut self) -> Result<Option<TapRow>, String> {
        if self.overflow == Overflow::Wait {
            return match self.empty.recv() {
                Ok(row) => Ok(Some(row)),
                Err(_) => self.end().map(|()| None),
            };
        }
        loop {
            match self.empty.try_recv() {
                Ok(row) => return Ok(Some(row)),
                Err(TryRecvError::Disconnected) => return self.end().map(|()| None),
                Err(TryRecvError::Empty) if self.patience == 0 => {
                    self.dropped += 1;
                    return Ok(None);
                }
                Err(TryRecvError::Empty) => match self.empty.recv_timeout(PATIENCE.0) {
                    Ok(row) => return Ok(Some(row)),
                    Err(RecvTimeoutError::Timeout) => self.patience -= 1,
                    Err(RecvTimeoutError::Disconnected) => return self.end().map(|()| None),
                },
            }
        }
    }

    /// Tells the consumer that a variable was changed at the present tick, before its rows. Not told to a consumer that
    /// may lose rows. A consumer that has failed says so at the next sample.
    pub fn set(&mut self, sim: &Simulation, path: &str, change: Change, value: f64) {
        if let (Overflow::Wait, Some(full)) = (self.overflow, &self.full) {
            let (tick, base) = (sim.state().tick, sim.plan().base);
            let (ns, path) = (nanoseconds(tick, base), path.to_string());
            let set = SetRow { tick, ns, path, change, value };
            let _ = full.send(Message::Set(set));
        }
    }

    /// Waits until the consumer has brought all rows so far to where a killed process leaves
    /// them. Nothing happens when rows may be dropped: nobody counts on such a consumer.
    ///
    /// # Errors
    /// The consumer's message.
    pub fn flush(&mut self) -> Result<(), String> {
        if self.overflow == Overflow::Drop {
            return Ok(());
        }
        let (answer, answered) = sync_channel(1);
        let sent = self.full.as_ref().is_some_and(|f| f.send(Message::Flush(answer)).is_ok());
        match sent.then(|| answered.recv()) {
            Some(Ok(Ok(()))) => Ok(()),
            // The thread has ended, or does so now: with the message that matters.
            _ => self.end(),
        }
    }

    /// How many rows the consumer did not take.
    pub fn dropped(&self) -> u64 {
        self.dropped
    }

    /// Waits for the consumer to take the last row and finish.
    ///
    /// # Errors
    /// The consumer's message.
    pub fn finish(mut self) -> Result<(), String> {
        self.end()
    }

    /// The same, but no longer than this; then the consumer is left to itself.
    ///
    /// # Errors
    /// The consumer's message, or that it did not finish.
    pub fn finish_within(mut self, patience: Duration) -> Result<(), String> {
        self.full = None;
        match self.done.recv_timeout(patience) {
            Ok(result) => result,
            Err(RecvTimeoutError::Disconnected) => Err(PANICKED.into()),
            Err(RecvTimeoutError::Timeout) => {
                self.overflow = Overflow::Drop; // Nobody waits for it when it is dropped.
                Err(format!("it did not take its last rows within {} s", patience.as_secs_f64()))
            }
        }
    }

    fn end(&mut self) -> Result<(), String> {
        match self.full.take() {
            None => Err("the tap has ended".into()),
            Some(full) => {
                drop(full);
                self.done.recv().unwrap_or_else(|_| Err(PANICKED.into()))
            }
        }
    }
}

const PANICKED: &str = "the consumer of the tap panicked";

fn consume(
    mut consumer: Box<dyn Consumer>,
    rows: &Receiver<Message>,
    back: &SyncSender<TapRow>,
) -> Result<(), String> {
    let mut result = Ok(());
    while let Ok(message) = rows.recv() {
        match message {
            Message::Row(row) => {
                result = consumer.row(&row);
                if result.is_ok() {
                    let _ = back.try_send(row);
                }
            }
            Message::Set(set) => result = consumer.set(&set),
            Message::Flush(answer) => {
                result = consumer.flush();
                let _ = answer.send(result.clone());
            }
        }
        if result.is_err() {
            break;
        }
    }
    // The first failure is the one that matters.
    let finished = consumer.finish();
    result.and(finished)
}

impl Drop for Tap {
    fn drop(&mut self) {
        if self.overflow == Overflow::Wait {
            let _ = self.end();
        }
    }
}

fn nanoseconds(tick: u64, base: Seconds) -> u64 {
    let n = u128::from(tick) * u128::from(base.num) * 1_000_000_000;
    u64::try_from(n / u128::from(base.den)).unwrap_or(u64::MAX)
}
