//! Recorders: rows of chosen variables, copied at their own periods to a consumer in its own thread.
//!
//! A recorder reads the state and never writes it (rule 6 of ARCHITECTURE.md). The ring is bounded, so nothing grows
//! (rule 12 of ARCHITECTURE.md). What a slow consumer costs is said where the recorder is started: a log makes the run
//! wait and loses nothing; a viewer makes it wait a little in all, and then loses rows, which are
//! counted.
use crate::rows::{Group, Kept, Rows, Sample, Sink};
use crate::step::Simulation;
use crate::time::nanoseconds;
use std::sync::mpsc::{
    Receiver, RecvTimeoutError, SyncSender, TryRecvError, TrySendError, sync_channel,
};
use std::time::Duration;

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

/// What a recorder feeds, in its own thread.
pub trait Consumer: Send {
    /// Takes a row.
    ///
    /// # Errors
    /// A message; the recorder ends, the run is told at its next sample.
    fn row(&mut self, row: &Sample) -> Result<(), String>;
    /// Somebody set, pinned or unpinned a variable, at the tick whose rows come next.
    ///
    /// # Errors
    /// A message; the recorder ends.
    fn set(&mut self, _set: &SetRow) -> Result<(), String> {
        Ok(())
    }
    /// Brings the rows so far to where a killed process leaves them ([`Recorder::flush`]).
    ///
    /// # Errors
    /// A message; the recorder ends.
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

enum Message {
    Row(Sample),
    Set(SetRow),
    /// The answer goes back.
    Flush(SyncSender<Result<(), String>>),
}

/// A running recorder.
pub struct Recorder {
    groups: Vec<Rows>,
    channel: Channel,
}

/// To the consumer and back.
struct Channel {
    full: Option<SyncSender<Message>>,
    empty: Receiver<Sample>,
    done: Receiver<Result<(), String>>,
    overflow: Overflow,
    /// Waits left.
    patience: u32,
    dropped: u64,
    /// The process in which the consumer's thread is.
    process: u32,
}

impl Recorder {
    /// Starts the consumer's thread; the run waits for it when it is slow. Rows begin at the
    /// present tick when the run is at its start, and after it when the run was resumed (that row
    /// is in the earlier log).
    ///
    /// # Errors
    /// When the thread cannot be started; when more rows would wait for an event than may.
    pub fn start(
        sim: &Simulation,
        groups: Vec<Group>,
        depth: usize,
        consumer: Box<dyn Consumer>,
    ) -> std::io::Result<Recorder> {
        Self::with(sim, groups, depth, Overflow::Wait, consumer)
    }

    /// The same, and what to do when the consumer is slow.
    ///
    /// # Errors
    /// When the thread cannot be started; when more rows would wait for an event than may.
    pub fn with(
        sim: &Simulation,
        groups: Vec<Group>,
        depth: usize,
        overflow: Overflow,
        consumer: Box<dyn Consumer>,
    ) -> std::io::Result<Recorder> {
        let width = groups.iter().map(Group::width).max().unwrap_or(0);
        let groups: Result<Vec<Rows>, String> =
            groups.into_iter().zip(0..).map(|(g, k)| Rows::new(sim, k, g)).collect();
        let groups =
            groups.map_err(|e| std::io::Error::new(std::io::ErrorKind::InvalidInput, e))?;
        let (full, rows) = sync_channel::<Message>(depth);
        let (back, empty) = sync_channel::<Sample>(depth);
        for _ in 0..depth {
            // Fits: the channel holds `depth`.
            let _ =
                back.try_send(Sample { values: Vec::with_capacity(width), ..Sample::default() });
        }
        let (end, done) = sync_channel(1);
        std::thread::Builder::new().name("recorder".into()).spawn(move || {
            // Nobody may be waiting any more: then nobody wants to know.
            let _ = end.send(consume(consumer, &rows, &back));
        })?;
        let patience = PATIENCE.1;
        let full = Some(full);
        let process = std::process::id();
        let channel = Channel { full, empty, done, overflow, patience, dropped: 0, process };
        Ok(Recorder { groups, channel })
    }

    /// Copies the rows that are due.
    ///
    /// # Errors
    /// The consumer's message, once it has failed.
    pub fn sample(&mut self, sim: &Simulation) -> Result<(), String> {
        let channel = &mut self.channel;
        self.groups.iter_mut().try_for_each(|rows| rows.sample(sim, channel))
    }

    /// What decides about rows to come, for a checkpoint of the present tick: [`Recorder::resume`] with it gives the rows that
    /// this recorder would have given.
    ///
    /// # Errors
    /// A message, when it cannot be written down.
    pub fn carry(&self) -> Result<Vec<u8>, String> {
        let kept: Vec<Kept> = self.groups.iter().map(Rows::keep).collect();
        rmp_serde::to_vec(&kept).map_err(|e| format!("the rows that wait: {e}"))
    }

    /// Goes on where the recorder of an earlier run stood, of which `sim` was resumed and which had these groups, and perhaps others.
    ///
    /// # Errors
    /// A message, when a group remembers rows that it lacks; those then begin after the present tick.
    pub fn resume(&mut self, carried: &[u8], sim: &Simulation) -> Result<(), String> {
        let bad = |e: String| format!("what the checkpoint remembers of the rows before it: {e}");
        let kept: Vec<Kept> = rmp_serde::from_slice(carried).map_err(|e| bad(e.to_string()))?;
        self.groups.iter_mut().try_for_each(|rows| rows.take(&kept, sim)).map_err(bad)
    }

    /// The conditions that have not come to hold so far, of groups that have rows around events alone.
    pub fn unmet(&self) -> Vec<String> {
        self.groups.iter().filter_map(Rows::unmet).map(String::from).collect()
    }

    /// Tells the consumer that a variable was changed at the present tick, before its rows. Not told to a consumer that
    /// may lose rows. A consumer that has failed says so at the next sample.
    pub fn set(&mut self, sim: &Simulation, path: &str, change: Change, value: f64) {
        let here = !self.channel.is_elsewhere();
        if let (Overflow::Wait, Some(full), true) =
            (self.channel.overflow, &self.channel.full, here)
        {
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
        if self.channel.overflow == Overflow::Drop {
            return Ok(());
        }
        if self.channel.is_elsewhere() {
            return self.channel.end();
        }
        let (answer, answered) = sync_channel(1);
        let sent =
            self.channel.full.as_ref().is_some_and(|f| f.send(Message::Flush(answer)).is_ok());
        match sent.then(|| answered.recv()) {
            Some(Ok(Ok(()))) => Ok(()),
            // The thread has ended, or does so now: with the message that matters.
            _ => self.channel.end(),
        }
    }

    /// How many rows the consumer did not take.
    pub fn dropped(&self) -> u64 {
        self.channel.dropped
    }

    /// Waits for the consumer to take the last row and finish.
    ///
    /// # Errors
    /// The consumer's message.
    pub fn finish(mut self) -> Result<(), String> {
        self.channel.end()
    }

    /// The same, but no longer than this; then the consumer is left to itself.
    ///
    /// # Errors
    /// The consumer's message, or that it did not finish.
    pub fn finish_within(mut self, patience: Duration) -> Result<(), String> {
        self.channel.full = None;
        match self.channel.done.recv_timeout(patience) {
            Ok(result) => result,
            Err(RecvTimeoutError::Disconnected) => Err(PANICKED.into()),
            Err(RecvTimeoutError::Timeout) => {
                self.channel.overflow = Overflow::Drop; // Nobody waits for it when it is dropped.
                Err(format!("it did not take its last rows within {} s", patience.as_secs_f64()))
            }
        }
    }
}

impl Sink for Channel {
    fn room(&mut self) -> Result<Option<Sample>, String> {
        if self.overflow == Overflow::Wait {
            return match self.empty.try_recv() {
                Ok(row) => Ok(Some(row)),
                Err(TryRecvError::Empty) if self.is_elsewhere() => Err(ELSEWHERE.into()),
                Err(TryRecvError::Empty) => match self.empty.recv() {
                    Ok(row) => Ok(Some(row)),
                    Err(_) => self.end().map(|()| None),
                },
                Err(TryRecvError::Disconnected) => self.end().map(|()| None),
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

    fn send(&mut self, row: Sample) -> Result<(), String> {
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
        if sent { Ok(()) } else { self.end() }
    }
}

impl Channel {
    /// Whether this process was forked from that of the consumer's thread: nobody takes rows here.
    fn is_elsewhere(&self) -> bool {
        std::process::id() != self.process
    }

    fn end(&mut self) -> Result<(), String> {
        if self.is_elsewhere() {
            self.full = None;
            return Err(ELSEWHERE.into());
        }
        match self.full.take() {
            None => Err("the recorder has ended".into()),
            Some(full) => {
                drop(full);
                self.done.recv().unwrap_or_else(|_| Err(PANICKED.into()))
            }
        }
    }
}

const ELSEWHERE: &str = "this process was forked after its log was begun, and the thread that writes it is in the parent\n  \
     help: begin logs in the child, or start processes by `spawn`";

const PANICKED: &str = "the consumer of the recorder panicked";

fn consume(
    mut consumer: Box<dyn Consumer>,
    rows: &Receiver<Message>,
    back: &SyncSender<Sample>,
) -> Result<(), String> {
    let mut result = Ok(());
    while let Ok(message) = rows.recv() {
        match message {
            Message::Row(mut row) => {
                result = consumer.row(&row);
                if result.is_ok() {
                    row.let_go();
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

impl Drop for Recorder {
    fn drop(&mut self) {
        if self.channel.overflow == Overflow::Wait {
            let _ = self.channel.end();
        }
    }
}
