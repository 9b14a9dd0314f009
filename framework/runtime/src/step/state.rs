//! All data that change in a run, except the stores of models.
use super::pinned::Pins;
use linkwork_integrate::Memory;
use std::sync::Arc;

/// State of a guard between two evaluations.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct GuardState {
    /// Its value at this instant.
    pub value: f64,
    /// Its change over the last step.
    pub change: f64,
    /// Distance from zero that still counts as round-off at the instant of its event: its change in 2 ns.
    pub slack: f64,
    /// The last known side: −1 below, 1 above; 0 after it has fired, until the end of the next step.
    pub side: i8,
    /// Direction of a due guard: 1 if it rose to zero or beyond, −1 if it fell; 0 if it is not due.
    pub due: i8,
}

impl GuardState {
    /// Returns whether the guard is due.
    pub fn is_due(&self) -> bool {
        self.due != 0
    }
}

/// All that changes in a run, but for the models' stores.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct State {
    /// Tick of the common base.
    pub tick: u64,
    /// Row of the table whose work was done last.
    pub row: u32,
    /// Time after the tick (s): 0 at rows, positive at an event between rows.
    pub since: f64,
    /// Number of events that have fired at this instant.
    pub micro: u32,
    /// Index of the phase of the program.
    pub phase: u32,
    /// Lists when each phase of the program began last (s); infinite before it has begun.
    pub entered: Vec<f64>,
    /// State of the integrator from step to step.
    pub memory: Memory,
    /// Continuous lanes.
    pub x: Vec<f64>,
    /// Discrete lanes.
    pub d: Vec<f64>,
    /// Signal lanes (sampled outputs are held here).
    pub sig: Vec<f64>,
    /// Guards, in the order of the plan.
    pub guards: Vec<GuardState>,
    /// The pins, in the lanes of the present phase; `None` if nothing is pinned.
    pub(crate) pins: Option<Arc<Pins>>,
}

impl State {
    /// Returns when the present phase began (s).
    pub fn began(&self) -> f64 {
        self.entered.get(self.phase as usize).copied().unwrap_or(0.0)
    }

    /// Copies without allocating when the lengths are equal.
    pub fn copy_from(&mut self, other: &State) {
        let State { tick, row, since, micro, phase, memory, .. } = other;
        let State { entered, x, d, sig, guards, pins, .. } = other;
        (self.tick, self.row, self.since, self.micro) = (*tick, *row, *since, *micro);
        (self.phase, self.memory) = (*phase, *memory);
        self.entered.clone_from(entered);
        self.x.clone_from(x);
        self.d.clone_from(d);
        self.sig.clone_from(sig);
        self.guards.clone_from(guards);
        self.pins.clone_from(pins);
    }
}
