//! Recorders: rows of chosen variables, copied at their own periods to a consumer in its own thread.
//!
//! A recorder reads the state and never writes it (rule 6 of ARCHITECTURE.md). The ring is bounded, so nothing grows
//! (rule 12 of ARCHITECTURE.md). The caller that starts a recorder chooses what happens with a slow consumer: a log makes the run wait and loses
//! nothing; a viewer makes it wait for a limited total time and then loses rows, which are counted.
use crate::author::time::nanoseconds;
use crate::recorders::rows::{Group, RowHistory, Rows, Sample, Sink};
use crate::step::simulation::Simulation;
use crate::step::variables::Change;
use std::sync::mpsc::{
    Receiver, RecvTimeoutError, SyncSender, TryRecvError, TrySendError, sync_channel,
};
use std::time::Duration;

/// Record of a variable that was set, pinned or unpinned from outside the simulation.
#[derive(Clone, Debug, PartialEq)]
pub struct SetRow {
    /// Tick of the common base.
    pub tick: u64,
    /// Simulated time (ns).
    pub ns: u64,
    /// The variable.
    pub path: String,
    /// Kind of change.
    pub change: Change,
    /// New value (SI); after unpinning, the value at that instant.
    pub value: f64,
}

/// Consumer of a recorder, in its own thread.
pub trait Consumer: Send {
    /// Takes a row.
    ///
    /// # Errors
    /// Returns a message; the recorder ends, and the run receives the error at its next sample.
    fn row(&mut self, row: &Sample) -> Result<(), String>;
    /// Receives a change of a variable at the tick whose rows come next.
    ///
    /// # Errors
    /// Returns a message; the recorder ends.
    fn set(&mut self, _set: &SetRow) -> Result<(), String> {
        Ok(())
    }
    /// Writes all rows so far to storage that survives a killed process ([`Recorder::flush`]).
    ///
    /// # Errors
    /// Returns a message; the recorder ends.
    fn flush(&mut self) -> Result<(), String> {
        Ok(())
    }
    /// Finishes after the last row, also after a failed one.
    ///
    /// # Errors
    /// Returns a message.
    fn finish(&mut self) -> Result<(), String>;
}

/// Behaviour when the consumer is too slow.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Overflow {
    /// The run waits: every row arrives.
    Wait,
    /// The run waits at most two seconds in total while the consumer takes nothing; then rows are dropped and counted.
    Drop,
}

/// Duration of one wait for a consumer that may drop rows, and the maximum number of waits in a run.
const PATIENCE: (Duration, u32) = (Duration::from_millis(10), 200);

enum Message {
    Row(Sample),
    Set(SetRow),
    /// Flush; the result is sent back.
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
    /// Remaining waits.
    patience: u32,
    dropped: u64,
    /// Process of the consumer's thread.
    process: u32,
}

impl Recorder {
    /// Starts the consumer's thread; the run waits if the consumer is slow. Rows begin at the current tick at the start of a run, and after it if the
    /// run was resumed (that row is in the earlier log).
    ///
    /// # Errors
    /// Returns an error if the thread cannot be started, or if more rows than permitted would wait for an event.
    pub fn start(
        sim: &Simulation,
        groups: Vec<Group>,
        depth: usize,
        consumer: Box<dyn Consumer>,
    ) -> std::io::Result<Recorder> {
        Self::with(sim, groups, depth, Overflow::Wait, consumer)
    }

    /// Like [`Recorder::start`], with the behaviour for a slow consumer.
    ///
    /// # Errors
    /// Returns an error if the thread cannot be started, or if more rows than permitted would wait for an event.
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
            // This cannot block, because the channel holds `depth` rows.
            let _ =
                back.try_send(Sample { values: Vec::with_capacity(width), ..Sample::default() });
        }
        let (end, done) = sync_channel(1);
        std::thread::Builder::new().name("recorder".into()).spawn(move || {
            // The receiver may be gone; then the result is not needed.
            let _ = end.send(consume(consumer, &rows, &back));
        })?;
        let patience = PATIENCE.1;
        let full = Some(full);
        let process = std::process::id();
        let channel = Channel { full, empty, done, overflow, patience, dropped: 0, process };
        Ok(Recorder { groups, channel })
    }

    /// Copies the rows that are due to the consumer.
    ///
    /// # Errors
    /// Returns the consumer's message after it has failed.
    pub fn sample(&mut self, sim: &Simulation) -> Result<(), String> {
        let channel = &mut self.channel;
        self.groups.iter_mut().try_for_each(|rows| rows.sample(sim, channel))
    }

    /// Returns the history that decides about future rows, for a checkpoint of the current tick. [`Recorder::resume`] with it yields the same rows as
    /// this recorder.
    ///
    /// # Errors
    /// Returns a message if serialization fails.
    pub fn carry(&self) -> Result<Vec<u8>, String> {
        let kept: Vec<RowHistory> = self.groups.iter().map(Rows::keep).collect();
        rmp_serde::to_vec(&kept).map_err(|e| format!("the buffered rows cannot be stored: {e}"))
    }

    /// Continues from the recorder of an earlier run, from which `sim` was resumed and which had these groups and possibly others.
    ///
    /// # Errors
    /// Returns a message if the history does not fit a group; its rows then begin after the current tick.
    pub fn resume(&mut self, carried: &[u8], sim: &Simulation) -> Result<(), String> {
        let bad = |e: String| format!("the recorded rows in the checkpoint: {e}");
        let kept: Vec<RowHistory> =
            rmp_serde::from_slice(carried).map_err(|e| bad(e.to_string()))?;
        self.groups.iter_mut().try_for_each(|rows| rows.take(&kept, sim)).map_err(bad)
    }

    /// Returns the conditions that have never been true, of groups that record only around events.
    pub fn unmet(&self) -> Vec<String> {
        self.groups.iter().filter_map(Rows::unmet).map(String::from).collect()
    }

    /// Sends a change of a variable at the current tick to the consumer, before the rows of that tick. A consumer that may lose rows does not receive
    /// it. A failed consumer reports its error at the next sample.
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

    /// Waits until the consumer has written all rows so far to storage that survives a killed process. Does nothing for a consumer that may lose
    /// rows.
    ///
    /// # Errors
    /// Returns the consumer's message.
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
            // The thread has ended or is ending, so return its error.
            _ => self.channel.end(),
        }
    }

    /// Returns the number of dropped rows.
    pub fn dropped(&self) -> u64 {
        self.channel.dropped
    }

    /// Waits until the consumer has taken the last row and finished.
    ///
    /// # Errors
    /// Returns the consumer's message.
    pub fn finish(mut self) -> Result<(), String> {
        self.channel.end()
    }

    /// Like [`Recorder::finish`], but waits at most `patience`; then the consumer thread is abandoned.
    ///
    /// # Errors
    /// Returns the consumer's message, or an error if it did not finish in time.
    pub fn finish_within(mut self, patience: Duration) -> Result<(), String> {
        self.channel.full = None;
        match self.channel.done.recv_timeout(patience) {
            Ok(result) => result,
            Err(RecvTimeoutError::Disconnected) => Err(PANICKED.into()),
            Err(RecvTimeoutError::Timeout) => {
                self.channel.overflow = Overflow::Drop; // Dropping the recorder then does not wait.
                Err(format!("it did not receive its last rows within {} s", patience.as_secs_f64()))
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
        // The channel has room, because the number of circulating rows equals its capacity. Only a flush could occupy it, and flushes do not occur if
        // rows may be dropped.
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
    /// Returns whether this process was forked from the process of the consumer's thread; then no thread takes rows here.
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

const ELSEWHERE: &str = "this process was forked after its log was opened, but the thread that writes the log exists only in the parent\n  \
     help: open logs in the child, or start processes with `spawn`";

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
    // Report the first failure.
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
