//! The time loop, and what is due at a tick: calls, samples, checkpoints, the end.
use crate::metrics::{INSTANT, Metrics};
use crate::pace::{Pace, Realtime, SystemClock, WallClock};
use crate::saves::{Extra, Saves};
use crate::stop::Stop;
use linkwork_runtime::{
    Change, Checkpoint, Recorder, RunError, Schedule, Seconds, Simulation, Stop as Step,
};
use std::collections::BTreeMap;
use std::time::Duration;

/// Conditions at which a run stops.
#[derive(Clone, Copy, Debug, Default)]
pub struct Goal {
    /// At the first tick at or after this time.
    pub until: Option<Seconds>,
    /// After this number of steps.
    pub steps: Option<u64>,
    /// After this number of ticks and events. Each event of a part or phase counts.
    pub events: Option<u64>,
    /// When this condition becomes true, by its index among the watched conditions.
    pub stop_when: Option<u32>,
}

/// A program's callback, in the thread of the run.
pub trait Watch: Send {
    /// Called with the state after the work of a tick, before the samples of the recorders: once per tick, again for the tick at which a run
    /// continues after a pause or a change, and at the instant between ticks at which `stop_when` ends the run.
    fn tick(&mut self, sim: &Simulation);

    /// Returns additional content for a checkpoint of this tick, by name.
    ///
    /// # Errors
    /// A message: the checkpoint cannot be written.
    fn carry(&self, _extra: &mut BTreeMap<String, Vec<u8>>) -> Result<(), String> {
        Ok(())
    }
}

/// Importance of a recorder.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Need {
    /// A log: if it fails, the run ends.
    Must,
    /// A recording: the run waits for it, and continues without it if it fails.
    Should,
    /// A viewer: the run hardly waits for it, and continues without it if it fails.
    May,
}

/// Reason for the end of a run.
#[derive(Clone, Debug, PartialEq)]
pub enum Ended {
    /// The time given by `until`, or the number of steps.
    Goal,
    /// The condition given by `stop_when` holds.
    StopWhen,
    /// A stop was requested.
    Stopped,
    /// The state diverged in a step.
    Failed(RunError),
    /// The state is not finite at the start, or a service does not cover the time to the end.
    Bad(RunError),
    /// A recorder that the run needs failed.
    Recorder(String),
}

/// Reason for which [`Runner::go`] returned.
#[derive(Clone, Debug, PartialEq)]
pub enum Pause {
    /// The run has ended.
    Ended(Ended),
    /// Calls are due, by the number that [`Runner::call`] returned. Make them, then continue.
    Calls(Vec<usize>),
    /// The requested steps are done.
    Chunk,
}

/// Result of a recorder.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct RecorderEnd {
    /// Its name in [`Runner::add_recorder`].
    pub name: String,
    /// Its importance.
    pub need: Need,
    /// Number of samples that it lost.
    pub dropped: u64,
    /// Its error message, if it failed.
    pub result: Result<(), String>,
    /// Conditions of its rules that never became true.
    pub unmet: Vec<String>,
}

struct Feed {
    name: String,
    need: Need,
    recorder: Recorder,
    /// Reason for which it could not be flushed and therefore ends.
    failed: Option<String>,
}

impl Feed {
    fn end(self, end: impl FnOnce(Recorder) -> Result<(), String>) -> RecorderEnd {
        let Feed { name, need, recorder, failed } = self;
        let (dropped, unmet) = (recorder.dropped(), recorder.unmet());
        let ended = end(recorder);
        RecorderEnd { name, need, dropped, result: failed.map_or(ended, Err), unmet }
    }
}

/// Returns additional content for a checkpoint of the present tick, by name: that of the watcher, and the state of the recorders that the run needs,
/// under [`recorder_entry`].
fn carried<W: Watch>(sim: &Simulation, watch: &W, feeds: &[Feed]) -> Result<Extra, String> {
    let mut extra = Extra::new();
    watch.carry(&mut extra)?;
    if let Some(metrics) = Metrics::of(sim) {
        extra.insert(FIGURES.into(), metrics.save()?);
    }
    for feed in feeds.iter().filter(|feed| feed.need == Need::Must) {
        extra.insert(recorder_entry(&feed.name), feed.recorder.carry()?);
    }
    Ok(extra)
}

/// Name of the metrics in a checkpoint.
const FIGURES: &str = "metrics";

/// Returns the name of a recorder's state in a checkpoint, for [`Recorder::resume`].
pub fn recorder_entry(name: &str) -> String {
    format!("recorder.{name}")
}

/// Largest number of events at that instant.
const EVENTS_MAX: u32 = 1000;

/// Longest time to wait for the last samples of a viewer.
const LAST_ROWS: Duration = Duration::from_secs(3);

/// A running simulation.
pub struct Runner<W> {
    sim: Simulation,
    /// The program's callback.
    pub watch: W,
    feeds: Vec<Feed>,
    ended: Vec<RecorderEnd>,
    calls: Vec<Schedule>,
    saves: Option<Saves>,
    pace: Option<Pace>,
    stop: Stop,
    /// The tick that the watcher and the checkpoints have processed, and the time after it (s).
    seen: Option<(u64, f64)>,
    checked: bool,
}

impl<W: Watch> Runner<W> {
    /// Creates a run from the present state of the simulation.
    pub fn new(sim: Simulation, watch: W) -> Self {
        Runner {
            sim,
            watch,
            feeds: Vec::new(),
            ended: Vec::new(),
            calls: Vec::new(),
            saves: None,
            pace: None,
            stop: Stop::default(),
            seen: None,
            checked: false,
        }
    }

    /// Computes metrics from the present instant on. Metrics in the checkpoint `begins` continue from its state.
    ///
    /// # Errors
    /// The part of the checkpoint that cannot be read; these metrics start again.
    pub fn metric(
        &mut self,
        mut metrics: Metrics,
        begins: Option<&Checkpoint>,
    ) -> Result<(), String> {
        let saved = begins.and_then(|c| c.extra.get(FIGURES));
        let restored = saved.map_or(Ok(()), |saved| metrics.restore(saved));
        metrics.observe(&mut self.sim);
        restored
    }

    /// Returns the metrics, if there are any.
    pub fn metrics(&self) -> Option<&Metrics> {
        Metrics::of(&self.sim)
    }

    /// Returns the simulation.
    pub fn sim(&self) -> &Simulation {
        &self.sim
    }

    /// Returns the simulation for changes between two calls of [`Runner::go`].
    pub fn sim_mut(&mut self) -> &mut Simulation {
        self.checked = false;
        &mut self.sim
    }

    /// Informs the recorders of a variable that was changed from outside at the present tick.
    pub(crate) fn tell_taps(&mut self, path: &str, change: Change, value: f64) {
        for feed in &mut self.feeds {
            feed.recorder.set(&self.sim, path, change, value);
        }
    }

    /// Returns the phase transitions since the last call: time (s), name, and what was transferred.
    pub fn new_moves(&mut self) -> Vec<(f64, String, linkwork_runtime::MoveReport)> {
        self.sim.take_moves()
    }

    /// Returns the notices of parts and services since the last call: time (s), and content.
    pub fn new_notices(&mut self) -> Vec<linkwork_runtime::Notice> {
        self.sim.take_notices()
    }

    /// Lets the watcher process the present tick again, because it has new tasks.
    pub fn see_again(&mut self) {
        self.seen = None;
    }

    /// Returns additional content for a checkpoint of the present tick, by name.
    ///
    /// # Errors
    /// A message: the checkpoint cannot be written.
    pub fn carried(&self) -> Result<Extra, String> {
        carried(&self.sim, &self.watch, &self.feeds)
    }

    /// Adds a recorder from the present tick on.
    pub fn add_recorder(&mut self, name: impl Into<String>, need: Need, recorder: Recorder) {
        self.feeds.push(Feed { name: name.into(), need, recorder, failed: None });
    }

    /// Returns whether a recorder with this name is active.
    pub fn has_tap(&self, name: &str) -> bool {
        self.feeds.iter().any(|f| f.name == name)
    }

    /// Adds a periodic call: it is due at the first tick at or after each multiple of a period, from the present tick on. Returns its number, counted
    /// from 0.
    pub fn call(&mut self, period: Seconds) -> usize {
        self.calls.push(Schedule::from(self.sim.state().tick, self.sim.plan().base, period));
        self.calls.len() - 1
    }

    /// Removes all calls.
    pub fn clear_calls(&mut self) {
        self.calls.clear();
    }

    /// Enables checkpoints.
    pub fn save_with(&mut self, saves: Saves) {
        self.saves = Some(saves);
    }

    /// Returns the settings and results of the checkpoints.
    pub fn saves(&self) -> Option<&Saves> {
        self.saves.as_ref()
    }

    /// Returns the errors of checkpoints since the last call.
    pub fn new_save_failures(&mut self) -> Vec<String> {
        self.saves.as_mut().map_or_else(Vec::new, |s| std::mem::take(&mut s.failures))
    }

    /// Limits the run to `factor` simulated seconds per second of the wall clock, from now on.
    pub fn pace(&mut self, factor: f64) {
        self.pace_by(Box::new(SystemClock::start()), factor);
    }

    /// Like [`Runner::pace`], with another clock.
    pub fn pace_by(&mut self, clock: Box<dyn WallClock>, factor: f64) {
        self.pace = Some(Pace::new(clock, self.sim.time(), factor));
    }

    /// Returns the report of the pacing so far, if the run is paced.
    pub fn realtime(&self) -> Option<Realtime> {
        self.pace.as_ref().map(Pace::report)
    }

    /// Restarts the pacing after a pause, if the run is paced.
    pub fn pace_again(&mut self) {
        if let Some(pace) = &mut self.pace {
            pace.again(self.sim.time());
        }
    }

    /// Returns the stop flag of this run.
    pub fn stop(&self) -> Stop {
        self.stop.clone()
    }

    /// Makes `steps` steps, or fewer if something else is due.
    pub fn go(&mut self, goal: &mut Goal, steps: u64) -> Pause {
        self.sim.interrupt_by(self.stop.flag());
        for _ in 0..steps {
            if let Some(pause) = self.at_tick(goal) {
                return pause;
            }
            loop {
                let step = match goal.events {
                    None => self.sim.step_watched(),
                    Some(_) => self.sim.step_event(),
                };
                match step {
                    Err(e) => {
                        if let Some(saves) = &mut self.saves {
                            saves.before_failure();
                        }
                        return Pause::Ended(Ended::Failed(e));
                    }
                    Ok(Step::Watched(which)) if goal.stop_when == Some(which) => {
                        if let Err(e) = self.finish_instant() {
                            return Pause::Ended(Ended::Failed(e));
                        }
                        return self.at_tick(goal).unwrap_or(Pause::Ended(Ended::StopWhen));
                    }
                    Ok(_) if goal.events.is_some() => break,
                    // A condition between two rows is handled at the next tick.
                    Ok(Step::Watched(_)) if !self.sim.at_row() => {}
                    Ok(_) => break,
                }
            }
            goal.steps = goal.steps.map(|n| n - 1);
            goal.events = goal.events.map(|n| n - 1);
        }
        Pause::Chunk
    }

    /// Processes the work of the row if a run stops at its instant: sampled parts that are due there have the values of this instant.
    fn finish_instant(&mut self) -> Result<(), RunError> {
        for _ in 0..EVENTS_MAX {
            if self.sim.at_row() || self.sim.time_to_row() > INSTANT {
                break;
            }
            self.sim.step_watched()?;
        }
        Ok(())
    }

    /// Processes what is due at the present tick.
    #[inline]
    fn at_tick(&mut self, goal: &Goal) -> Option<Pause> {
        let tick = self.sim.state().tick;
        if !self.calls.is_empty() {
            let due = |(k, s): (usize, &mut Schedule)| s.is_due(tick).then_some(k);
            let calls: Vec<usize> = self.calls.iter_mut().enumerate().filter_map(due).collect();
            if !calls.is_empty() {
                return Some(Pause::Calls(calls));
            }
        }
        let now = (tick, self.sim.state().since);
        let fresh = self.seen.replace(now) != Some(now);
        if fresh {
            self.sim.observe_now();
            self.watch.tick(&self.sim);
        }
        if let Err(e) = self.rows() {
            return Some(Pause::Ended(Ended::Recorder(e)));
        }
        // A step checks its result; this check finds errors in the initial state.
        if !self.checked {
            let whole = goal.until.filter(|_| goal.stop_when.is_none() && goal.steps.is_none());
            let lasts = whole.map_or(Ok(()), |until| self.sim.answers_until(until.seconds()));
            if let Err(e) = self.sim.check().and(lasts) {
                return Some(Pause::Ended(Ended::Bad(e)));
            }
            self.checked = true;
        }
        if fresh && self.saves.as_mut().is_some_and(|s| s.is_due(tick)) {
            if let Err(e) = self.flush() {
                return Some(Pause::Ended(Ended::Recorder(e)));
            }
            if let Some(saves) = &mut self.saves {
                saves.periodic(&self.sim, || carried(&self.sim, &self.watch, &self.feeds));
            }
        }
        if let Some(end) = self.end(goal) {
            return Some(Pause::Ended(end));
        }
        if let Some(saves) = &mut self.saves {
            saves.keep(&self.sim, || carried(&self.sim, &self.watch, &self.feeds));
        }
        if let Some(pace) = &mut self.pace {
            pace.wait(self.sim.time(), &self.stop);
        }
        None
    }

    fn end(&self, goal: &Goal) -> Option<Ended> {
        if goal.stop_when.is_some_and(|which| self.sim.watched(which)) {
            return Some(Ended::StopWhen);
        }
        let late = goal.until.is_some_and(|t| !self.sim.before(t));
        if late || goal.steps == Some(0) || goal.events == Some(0) {
            return Some(Ended::Goal);
        }
        self.stop.is_set().then_some(Ended::Stopped)
    }

    /// Takes the samples that are due. A recorder that the run does not need is removed if it fails.
    fn rows(&mut self) -> Result<(), String> {
        let mut k = 0;
        while let Some(feed) = self.feeds.get_mut(k) {
            match (feed.recorder.sample(&self.sim), feed.need) {
                (Ok(()), _) => k += 1,
                (Err(e), Need::Must) => {
                    self.feeds.remove(k);
                    return Err(e);
                }
                (Err(e), Need::Should | Need::May) => {
                    let feed = self.feeds.remove(k);
                    self.ended.push(feed.end(|_| Err(e)));
                }
            }
        }
        Ok(())
    }

    /// Writes the samples so far to where they survive a killed process.
    fn flush(&mut self) -> Result<(), String> {
        let mut k = 0;
        while let Some(feed) = self.feeds.get_mut(k) {
            match (feed.recorder.flush(), feed.need) {
                (Err(e), Need::Must) => {
                    self.feeds.remove(k);
                    return Err(e);
                }
                (Err(e), Need::Should | Need::May) => {
                    let feed = self.feeds.remove(k);
                    self.ended.push(feed.end(|_| Err(e)));
                }
                (Ok(()), _) => k += 1,
            }
        }
        Ok(())
    }

    /// Writes a checkpoint of the present tick with this name, independent of the policy.
    pub fn save(&mut self, name: &str) {
        // Write earlier samples to the disk before a checkpoint refers to their instant. A log that fails reports this
        // at its end.
        for feed in self.feeds.iter_mut().filter(|feed| feed.need == Need::Must) {
            feed.failed = feed.recorder.flush().err().or(feed.failed.take());
        }
        if let Some(saves) = &mut self.saves {
            saves.write(&self.sim, carried(&self.sim, &self.watch, &self.feeds), name);
        }
    }

    /// Writes the last kept state, as after a failed step, for a program that caught a panic in [`Runner::go`]; the present state is then not usable.
    pub fn save_before_failure(&mut self) {
        if let Some(saves) = &mut self.saves {
            saves.before_failure();
        }
    }

    /// Returns the recorders that have failed since the last call.
    pub fn ended_taps(&mut self) -> Vec<RecorderEnd> {
        std::mem::take(&mut self.ended)
    }

    /// Finishes the recorder with this name, if there is one.
    ///
    /// # Errors
    /// The message of the recorder.
    pub fn finish_tap(&mut self, name: &str) -> Result<(), String> {
        match self.feeds.iter().position(|f| f.name == name) {
            Some(k) => self.feeds.remove(k).recorder.finish(),
            None => Ok(()),
        }
    }

    /// Finishes all recorders: the run waits for logs, and for viewers up to a few seconds.
    pub fn finish_taps(&mut self) -> Vec<RecorderEnd> {
        for feed in self.feeds.drain(..) {
            let patient = feed.need != Need::May;
            let end = |recorder: Recorder| {
                if patient { recorder.finish() } else { recorder.finish_within(LAST_ROWS) }
            };
            self.ended.push(feed.end(end));
        }
        self.ended_taps()
    }
}
