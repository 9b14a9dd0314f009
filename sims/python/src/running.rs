//! A simulation under way: steps, with what is due at each tick before it.
//!
//! ```text
//! at each tick:   callbacks due → rows of logs and recordings due → the next step
//! ```
//! Rows thus show what a callback has set. Between two calls of a run the state is always "after
//! the work of a tick", so neither callbacks nor logs nor the cuts of a run leave a trace in it.
use crate::log::{Filling, Schedule};
use linkwork_runtime::{Place, RunError, Seconds, Simulation, Tap};
use pyo3::prelude::*;

/// Steps between two looks at Ctrl-C and at other threads.
const CHUNK: u64 = 256;

/// What changes in a run.
pub struct Running {
    /// The simulation.
    pub sim: Simulation,
    /// Logs in memory, each at its own times; `None`: every step.
    pub logs: Vec<(Option<Schedule>, Filling)>,
    /// The recording into a file.
    pub tap: Option<Tap>,
    /// Functions, each at its own times.
    pub calls: Vec<(Schedule, Py<PyAny>)>,
    /// The tick whose rows have been taken.
    sampled: Option<u64>,
}

/// When to stop.
#[derive(Clone, Copy, Default)]
pub struct Goal {
    /// At the first tick at or after this time.
    pub until: Option<Seconds>,
    /// After so many steps.
    pub steps: Option<u64>,
    /// When this variable is true.
    pub stop_when: Option<Place>,
}

/// Why `go` came back.
pub enum Pause {
    /// The goal is reached.
    Done,
    /// Functions are due: indices of `calls`.
    Calls(Vec<usize>),
    /// A while has passed.
    Chunk,
    /// The state is no number any more.
    Failed(RunError),
    /// The recording failed.
    Recording(String),
}

impl Running {
    /// At its start.
    pub fn new(sim: Simulation) -> Self {
        Self { sim, logs: Vec::new(), tap: None, calls: Vec::new(), sampled: None }
    }

    /// Forgets which rows were taken: a log was added.
    pub fn sample_again(&mut self) {
        self.sampled = None;
    }

    /// Steps until something has to be done outside. Touches nothing of Python.
    pub fn go(&mut self, goal: &mut Goal) -> Pause {
        for _ in 0..CHUNK {
            let sim = &self.sim;
            let due = |(k, c): (usize, &mut (Schedule, Py<PyAny>))| c.0.is_due(sim).then_some(k);
            let calls: Vec<usize> = self.calls.iter_mut().enumerate().filter_map(due).collect();
            if !calls.is_empty() {
                return Pause::Calls(calls);
            }
            if let Err(e) = self.sample() {
                self.tap = None;
                return Pause::Recording(e);
            }
            let late = goal.until.is_some_and(|t| !self.sim.before(t));
            if late
                || goal.steps == Some(0)
                || goal.stop_when.is_some_and(|p| self.sim.value(p) > 0.5)
            {
                return Pause::Done;
            }
            if let Err(e) = self.sim.step() {
                return Pause::Failed(e);
            }
            goal.steps = goal.steps.map(|n| n - 1);
        }
        Pause::Chunk
    }

    /// Takes the rows that are due.
    fn sample(&mut self) -> Result<(), String> {
        let tick = self.sim.state().tick;
        let first = self.sampled.replace(tick) != Some(tick);
        for (schedule, log) in &mut self.logs {
            let due = schedule.as_mut().map_or(first, |s| s.is_due(&self.sim));
            if due {
                log.sample(&self.sim);
            }
        }
        self.tap.as_mut().map_or(Ok(()), |tap| tap.sample(&self.sim))
    }
}
