//! A simulation under way: the runner's loop, with logs in memory and functions of Python.
//!
//! The loop is `linkwork_runner`'s, as on the command line; here are only what it feeds and calls.
use crate::log::Filling;
use linkwork_runner::{Ended, Goal, Pause, Runner, Watch};
use linkwork_runtime::{RunError, Schedule, Simulation};
use pyo3::prelude::*;

/// Steps between two looks at Ctrl-C and at other threads.
const CHUNK: u64 = 256;

/// The tap of the recording.
pub const RECORDING: &str = "recording";

/// Logs in memory, each at its own times; `None`: every step.
#[derive(Default)]
pub struct Logs {
    list: Vec<(Option<Schedule>, Filling)>,
    /// The tick whose rows have been taken.
    taken: Option<u64>,
}

impl Watch for Logs {
    fn tick(&mut self, sim: &Simulation) {
        let tick = sim.state().tick;
        let first = self.taken.replace(tick) != Some(tick);
        for (schedule, log) in &mut self.list {
            if schedule.as_mut().map_or(first, |s| s.is_due(tick)) {
                log.sample(sim);
            }
        }
    }
}

/// What changes in a run.
pub struct Running {
    runner: Runner<Logs>,
    /// Functions, by the number of their call.
    pub calls: Vec<Py<PyAny>>,
}

/// Why `go` came back.
pub enum Stopped {
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
        Self { runner: Runner::new(sim, Logs::default()), calls: Vec::new() }
    }

    /// The simulation.
    pub fn sim(&self) -> &Simulation {
        self.runner.sim()
    }

    /// The simulation, to be changed.
    pub fn sim_mut(&mut self) -> &mut Simulation {
        self.runner.sim_mut()
    }

    /// The runner, for its taps and calls.
    pub fn runner(&mut self) -> &mut Runner<Logs> {
        &mut self.runner
    }

    /// Fills a log from the present tick on.
    pub fn log(&mut self, schedule: Option<Schedule>, filling: Filling) {
        let logs = &mut self.runner.watch;
        logs.list.push((schedule, filling));
        logs.taken = None;
        self.runner.see_again();
    }

    /// Steps until something has to be done outside. Touches nothing of Python.
    pub fn go(&mut self, goal: &mut Goal) -> Stopped {
        match self.runner.go(goal, CHUNK) {
            Pause::Chunk => Stopped::Chunk,
            Pause::Calls(due) => Stopped::Calls(due),
            Pause::Ended(Ended::Failed(e) | Ended::Bad(e)) => Stopped::Failed(e),
            Pause::Ended(Ended::Tap(e)) => Stopped::Recording(e),
            Pause::Ended(Ended::Goal | Ended::StopWhen | Ended::Stopped) => Stopped::Done,
        }
    }
}
