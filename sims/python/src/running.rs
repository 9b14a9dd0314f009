//! A simulation under way: the runner's loop, with logs in memory and functions of Python.
//!
//! The loop is `linkwork_runner`'s, as on the command line; here are only what it feeds and calls.
use crate::log::Filling;
use linkwork_runner::{Ended, Goal, Need, Pause, Runner, Watch, recorder_entry};
use linkwork_runtime::{Change, Checkpoint, Recorder, RunError, Simulation};
use pyo3::prelude::*;

/// Steps between two looks at Ctrl-C and at other threads.
const CHUNK: u64 = 256;

/// The recorder of the recording.
pub const RECORDING: &str = "recording";

/// Logs in memory, each at its own times.
#[derive(Default)]
pub struct Logs {
    list: Vec<Filling>,
}

impl Watch for Logs {
    fn tick(&mut self, sim: &Simulation) {
        self.list.iter_mut().for_each(|log| log.sample(sim));
    }
}

/// What changes in a run.
pub struct Running {
    runner: Runner<Logs>,
    /// Of the checkpoint from which it was resumed: the tick, and what the recording then under way has to remember.
    remembered: Option<(u64, Vec<u8>)>,
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
        Self { runner: Runner::new(sim, Logs::default()), remembered: None, calls: Vec::new() }
    }

    /// The simulation.
    pub fn sim(&self) -> &Simulation {
        self.runner.sim()
    }

    /// The simulation, to be changed.
    pub fn sim_mut(&mut self) -> &mut Simulation {
        self.runner.sim_mut()
    }

    /// The runner, for its recorders and calls.
    pub fn runner(&mut self) -> &mut Runner<Logs> {
        &mut self.runner
    }

    /// Keeps what a checkpoint carries of the recording that was under way.
    pub fn remember(&mut self, checkpoint: &Checkpoint) {
        let carried = checkpoint.extra.get(&recorder_entry(RECORDING)).cloned();
        self.remembered = carried.map(|carried| (checkpoint.tick, carried));
    }

    /// Feeds a recording from the present tick on, told of what is pinned; where the run was resumed it goes on with what the one of before
    /// remembered, when it has its rules.
    pub fn record(&mut self, mut recorder: Recorder) {
        let sim = self.runner.sim();
        let pins: Vec<(String, f64)> = sim.pins().map(|(p, y)| (p.to_string(), y)).collect();
        for (path, value) in &pins {
            recorder.set(sim, path, Change::Pin, *value);
        }
        if let Some((tick, carried)) = &self.remembered
            && *tick == sim.state().tick
        {
            // Of other rules there is nothing to go on with.
            let _ = recorder.resume(carried, sim);
        }
        self.runner.add_recorder(RECORDING, Need::Must, recorder);
    }

    /// Fills a log from the present tick on.
    pub fn log(&mut self, filling: Filling) {
        self.runner.watch.list.push(filling);
        self.runner.see_again();
    }

    /// Steps until something has to be done outside. Touches nothing of Python.
    pub fn go(&mut self, goal: &mut Goal) -> Stopped {
        match self.runner.go(goal, CHUNK) {
            Pause::Chunk => Stopped::Chunk,
            Pause::Calls(due) => Stopped::Calls(due),
            Pause::Ended(Ended::Failed(e) | Ended::Bad(e)) => Stopped::Failed(e),
            Pause::Ended(Ended::Recorder(e)) => Stopped::Recording(e),
            Pause::Ended(Ended::Goal | Ended::StopWhen | Ended::Stopped) => Stopped::Done,
        }
    }
}
