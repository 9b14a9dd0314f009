//! A running simulation: the loop of the runner, with logs in memory and Python callbacks.
//!
//! The loop is that of `linkwork_runner`, which the command line uses, too. This module contains only its data and callbacks.
use crate::log::Filling;
use linkwork_runner::{Ended, Goal, Need, Pause, Runner, Watch, recorder_entry};
use linkwork_runtime::{Change, Checkpoint, Recorder, RunError, Simulation};
use pyo3::prelude::*;

/// Number of steps between two checks for Ctrl-C and other threads.
const CHUNK: u64 = 256;

/// Name of the recorder that writes the recording.
pub const RECORDING: &str = "recording";

/// Logs in memory, each with its own sample times.
#[derive(Default)]
pub struct Logs {
    list: Vec<Filling>,
}

impl Watch for Logs {
    fn tick(&mut self, sim: &Simulation) {
        self.list.iter_mut().for_each(|log| log.sample(sim));
    }
}

/// The mutable state of a run.
pub struct Running {
    runner: Runner<Logs>,
    /// From the checkpoint from which the run was resumed: the tick, and the state of the recording that was active then.
    remembered: Option<(u64, Vec<u8>)>,
    /// Callbacks, by the number of their call.
    pub calls: Vec<Py<PyAny>>,
}

/// Reason for which `go` returned.
pub enum Stopped {
    /// The goal is reached.
    Done,
    /// Functions are due: indices of `calls`.
    Calls(Vec<usize>),
    /// `CHUNK` steps were made.
    Chunk,
    /// The state diverged.
    Failed(RunError),
    /// The recording failed.
    Recording(String),
}

impl Running {
    /// Creates a run at its start.
    pub fn new(sim: Simulation) -> Self {
        Self { runner: Runner::new(sim, Logs::default()), remembered: None, calls: Vec::new() }
    }

    /// Returns the simulation.
    pub fn sim(&self) -> &Simulation {
        self.runner.sim()
    }

    /// Returns the simulation for changes.
    pub fn sim_mut(&mut self) -> &mut Simulation {
        self.runner.sim_mut()
    }

    /// Returns the runner, for its recorders and callbacks.
    pub fn runner(&mut self) -> &mut Runner<Logs> {
        &mut self.runner
    }

    /// Stores the state of the recording that was active when the checkpoint was saved.
    pub fn remember(&mut self, checkpoint: &Checkpoint) {
        let carried = checkpoint.extra.get(&recorder_entry(RECORDING)).cloned();
        self.remembered = carried.map(|carried| (checkpoint.tick, carried));
    }

    /// Adds a recorder from the present tick on. It records the pinned variables. If the run was resumed, and the recorder has the same rules as the
    /// recording that was active at the checkpoint, it continues that recording.
    pub fn record(&mut self, mut recorder: Recorder) {
        let sim = self.runner.sim();
        let pins: Vec<(String, f64)> = sim.pins().map(|(p, y)| (p.to_string(), y)).collect();
        for (path, value) in &pins {
            recorder.set(sim, path, Change::Pin, *value);
        }
        if let Some((tick, carried)) = &self.remembered
            && *tick == sim.state().tick
        {
            // A recording with other rules cannot be continued; the new one begins without its state.
            let _ = recorder.resume(carried, sim);
        }
        self.runner.add_recorder(RECORDING, Need::Must, recorder);
    }

    /// Adds a log from the present tick on.
    pub fn log(&mut self, filling: Filling) {
        self.runner.watch.list.push(filling);
        self.runner.see_again();
    }

    /// Steps until the caller has to act. Does not use Python objects.
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
