//! The time loop, and what is due at a tick: calls, rows, checkpoints, the end.
use crate::metrics::Metrics;
use crate::pace::{Pace, Realtime, SystemClock, WallClock};
use crate::saves::{Extra, Saves};
use linkwork_runtime::{
    Change, Checkpoint, Recorder, RunError, Schedule, Seconds, Simulation, Stop as Step,
};
use std::collections::BTreeMap;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

/// Asks a run to stop at its next tick; may be set from a signal handler or another thread.
#[derive(Clone, Debug, Default)]
pub struct Stop(Arc<AtomicBool>);

impl Stop {
    /// The run is to stop. True when it was asked before.
    pub fn set(&self) -> bool {
        self.0.swap(true, Ordering::SeqCst)
    }
    /// The flag itself, for a simulation that looks at it between two rows.
    fn flag(&self) -> Arc<AtomicBool> {
        self.0.clone()
    }
    /// Whether the run is to stop.
    pub fn is_set(&self) -> bool {
        self.0.load(Ordering::Relaxed)
    }
}

/// When to stop.
#[derive(Clone, Copy, Debug, Default)]
pub struct Goal {
    /// At the first tick at or after this time.
    pub until: Option<Seconds>,
    /// After so many steps.
    pub steps: Option<u64>,
    /// After this number of rows and events. Each event of a part or phase counts.
    pub events: Option<u64>,
    /// At the instant from which this condition holds, by its place among those that the run watches.
    pub stop_when: Option<u32>,
}

/// What a program takes in passing, in the thread of the run.
pub trait Watch: Send {
    /// The state after the work of a tick, before the rows of the recorders. Called once for a tick,
    /// and again for the tick at which a run goes on after a pause or a change; and at the instant between ticks at which
    /// `stop_when` ends the run.
    fn tick(&mut self, sim: &Simulation);

    /// What a checkpoint of this tick carries along, by name.
    ///
    /// # Errors
    /// A message: the checkpoint cannot be written.
    fn carry(&self, _extra: &mut BTreeMap<String, Vec<u8>>) -> Result<(), String> {
        Ok(())
    }
}

/// What a run owes to a recorder.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Need {
    /// A log: without it the run is not worth going on.
    Must,
    /// A recording: it is waited for, and when it fails the run goes on without it.
    Should,
    /// A viewer: it is hardly waited for, and when it fails the run goes on without it.
    May,
}

/// Why a run came to its end.
#[derive(Clone, Debug, PartialEq)]
pub enum Ended {
    /// The time given by `until`, or the number of steps.
    Goal,
    /// The condition given by `stop_when` holds.
    StopWhen,
    /// It was asked to stop.
    Stopped,
    /// The state left the numbers, in a step.
    Failed(RunError),
    /// The state is no number from the start, or a service cannot answer until the end.
    Bad(RunError),
    /// A recorder that the run needs has failed.
    Recorder(String),
}

/// Why [`Runner::go`] came back.
#[derive(Clone, Debug, PartialEq)]
pub enum Pause {
    /// The run is at its end.
    Ended(Ended),
    /// Calls are due, by the number that [`Runner::call`] gave: make them, then go on.
    Calls(Vec<usize>),
    /// The steps asked for are done.
    Chunk,
}

/// How a recorder ended.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct RecorderEnd {
    /// As given to [`Runner::add_recorder`].
    pub name: String,
    /// What the run owed it.
    pub need: Need,
    /// Rows that it did not take.
    pub dropped: u64,
    /// Its message, or nothing.
    pub result: Result<(), String>,
    /// Conditions of its rows that did not come to hold.
    pub unmet: Vec<String>,
}

struct Feed {
    name: String,
    need: Need,
    recorder: Recorder,
    /// Why it could not be flushed, which is why it ends.
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

/// What a checkpoint of the present tick carries along, by name: that of the watcher, and what recorders that the run cannot
/// do without have to remember, under [`recorder_entry`].
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

/// The name under which a checkpoint carries the metrics.
const FIGURES: &str = "metrics";

/// The name under which a checkpoint carries what a recorder has to remember, for [`Recorder::resume`].
pub fn recorder_entry(name: &str) -> String {
    format!("recorder.{name}")
}

/// How long a viewer may take for its last rows.
const LAST_ROWS: Duration = Duration::from_secs(3);

/// A simulation under way.
pub struct Runner<W> {
    sim: Simulation,
    /// What the program takes in passing.
    pub watch: W,
    feeds: Vec<Feed>,
    ended: Vec<RecorderEnd>,
    calls: Vec<Schedule>,
    saves: Option<Saves>,
    pace: Option<Pace>,
    stop: Stop,
    /// The tick that the watcher and the saves have seen, and the time after it (s).
    seen: Option<(u64, f64)>,
    checked: bool,
}

impl<W: Watch> Runner<W> {
    /// From where the simulation stands.
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

    /// Takes metrics from the present instant on; those that the checkpoint `begins` carries continue from where they stood.
    ///
    /// # Errors
    /// What of the checkpoint cannot be read; metrics then begin anew.
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

    /// The metrics, when there are any.
    pub fn metrics(&self) -> Option<&Metrics> {
        Metrics::of(&self.sim)
    }

    /// The simulation.
    pub fn sim(&self) -> &Simulation {
        &self.sim
    }

    /// The simulation, to be changed between two calls of [`Runner::go`].
    pub fn sim_mut(&mut self) -> &mut Simulation {
        self.checked = false;
        &mut self.sim
    }

    /// Tells the recorders of a variable that was changed from outside at the present tick.
    pub(crate) fn tell_taps(&mut self, path: &str, change: Change, value: f64) {
        for feed in &mut self.feeds {
            feed.recorder.set(&self.sim, path, change, value);
        }
    }

    /// Transitions between phases since this was asked last: time (s), what, and what went over.
    pub fn new_moves(&mut self) -> Vec<(f64, String, linkwork_runtime::MoveReport)> {
        self.sim.take_moves()
    }

    /// What parts and services told since this was asked last: time (s), and what.
    pub fn new_notices(&mut self) -> Vec<linkwork_runtime::Notice> {
        self.sim.take_notices()
    }

    /// The watcher sees the present tick again: it has something new to take.
    pub fn see_again(&mut self) {
        self.seen = None;
    }

    /// What a checkpoint of the present tick carries along, by name.
    ///
    /// # Errors
    /// A message: the checkpoint cannot be written.
    pub fn carried(&self) -> Result<Extra, String> {
        carried(&self.sim, &self.watch, &self.feeds)
    }

    /// Feeds a recorder from the present tick on.
    pub fn add_recorder(&mut self, name: impl Into<String>, need: Need, recorder: Recorder) {
        self.feeds.push(Feed { name: name.into(), need, recorder, failed: None });
    }

    /// Whether a recorder of this name is fed.
    pub fn has_tap(&self, name: &str) -> bool {
        self.feeds.iter().any(|f| f.name == name)
    }

    /// Something that the program does at the first tick at or after each multiple of a period,
    /// from the present tick on. Gives its number, counted from 0.
    pub fn call(&mut self, period: Seconds) -> usize {
        self.calls.push(Schedule::from(self.sim.state().tick, self.sim.plan().base, period));
        self.calls.len() - 1
    }

    /// Forgets all calls.
    pub fn clear_calls(&mut self) {
        self.calls.clear();
    }

    /// Writes checkpoints.
    pub fn save_with(&mut self, saves: Saves) {
        self.saves = Some(saves);
    }

    /// Where checkpoints go and how they fared.
    pub fn saves(&self) -> Option<&Saves> {
        self.saves.as_ref()
    }

    /// The checkpoints that could not be written since this was asked last.
    pub fn new_save_failures(&mut self) -> Vec<String> {
        self.saves.as_mut().map_or_else(Vec::new, |s| std::mem::take(&mut s.failures))
    }

    /// Not faster than `factor` simulated seconds in a second of the wall clock, from now on.
    pub fn pace(&mut self, factor: f64) {
        self.pace_by(Box::new(SystemClock::start()), factor);
    }

    /// The same by another clock.
    pub fn pace_by(&mut self, clock: Box<dyn WallClock>, factor: f64) {
        self.pace = Some(Pace::new(clock, self.sim.time(), factor));
    }

    /// When it is paced: how that went so far.
    pub fn realtime(&self) -> Option<Realtime> {
        self.pace.as_ref().map(Pace::report)
    }

    /// When it is paced: from now on again, because the run stood still.
    pub fn pace_again(&mut self) {
        if let Some(pace) = &mut self.pace {
            pace.again(self.sim.time());
        }
    }

    /// Asks this run to stop.
    pub fn stop(&self) -> Stop {
        self.stop.clone()
    }

    /// Takes `steps` steps, or fewer when something comes in between.
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
                        return self.at_tick(goal).unwrap_or(Pause::Ended(Ended::StopWhen));
                    }
                    Ok(_) if goal.events.is_some() => break,
                    // Seen at the row that follows.
                    Ok(Step::Watched(_)) if !self.sim.at_row() => {}
                    Ok(_) => break,
                }
            }
            goal.steps = goal.steps.map(|n| n - 1);
            goal.events = goal.events.map(|n| n - 1);
        }
        Pause::Chunk
    }

    /// What is due at the present tick.
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
        // A step checks itself: this finds what is bad from the start.
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

    /// Takes the rows that are due. A recorder that the run can do without is let go when it fails.
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

    /// Brings the rows so far to where a killed process leaves them.
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

    /// Writes a checkpoint of the present tick under this name, whatever the policy says.
    pub fn save(&mut self, name: &str) {
        // The rows before it are on the disk before a checkpoint names its instant. A log that fails says so at its end.
        for feed in self.feeds.iter_mut().filter(|feed| feed.need == Need::Must) {
            feed.failed = feed.recorder.flush().err().or(feed.failed.take());
        }
        if let Some(saves) = &mut self.saves {
            saves.write(&self.sim, carried(&self.sim, &self.watch, &self.feeds), name);
        }
    }

    /// Writes the state that was kept last, as after a failed step: for a program that caught a panic in [`Runner::go`],
    /// after which the present state is worth nothing.
    pub fn save_before_failure(&mut self) {
        if let Some(saves) = &mut self.saves {
            saves.before_failure();
        }
    }

    /// Recorders that have ended since this was asked last, those that failed on the way.
    pub fn ended_taps(&mut self) -> Vec<RecorderEnd> {
        std::mem::take(&mut self.ended)
    }

    /// Finishes one recorder, if there is one of this name.
    ///
    /// # Errors
    /// Its message.
    pub fn finish_tap(&mut self, name: &str) -> Result<(), String> {
        match self.feeds.iter().position(|f| f.name == name) {
            Some(k) => self.feeds.remove(k).recorder.finish(),
            None => Ok(()),
        }
    }

    /// Finishes all recorders: logs are waited for, viewers for a few seconds.
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
