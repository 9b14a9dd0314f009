//! Data of a run.
use super::linear::Linear;
use super::observed::Columns;
use super::profile::Profile;
use super::reports::{MoveReport, Notices};
use super::state::{GuardState, State};
use super::turning;
use crate::author::block::Block;
use crate::plan::compiled::{FieldPlan, Plan};
use crate::plan::condition::Times;
use crate::plan::program::Program;
use linkwork_integrate::{Integrator, Method};
use std::any::Any;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

/// Error that stops a run. The state is the one before the failed instant, or the one of the bad row.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error(
    "t = {time} s: {message}{}",
    .help.as_ref().map_or_else(String::new, |help| format!("\n  help: {help}"))
)]
pub struct RunError {
    /// Simulated time (s).
    pub time: f64,
    /// Path of the part or variable.
    pub path: String,
    /// Error message.
    pub message: String,
    /// Remedy.
    pub help: Option<String>,
}

/// Error: a variable cannot be read or set.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("{message}\n  help: {help}")]
pub struct VariableError {
    /// Error message.
    pub message: String,
    /// Remedy.
    pub help: String,
}

/// Position of a run after [`Simulation::step_event`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Stop {
    /// At a row of the table, after its work.
    Row,
    /// At an event, after the handler of one part or transition.
    Event,
    /// At the instant at which a watched condition became true: its index in [`crate::PhaseSpec::watches`].
    Watched(u32),
    /// Between two rows, because of [`Simulation::interrupt_by`].
    Interrupted,
}

/// A run of a program.
pub struct Simulation {
    pub(super) program: Arc<Program>,
    pub(super) plan: Arc<Plan>,
    pub(crate) state: State,
    pub(crate) blocks: Vec<Box<dyn Block>>,
    pub(super) work: Work,
    /// Transitions since the last query: time (s), description, and report of the carried state.
    pub(super) moved: Vec<(f64, String, MoveReport)>,
    /// Notices of parts and services.
    pub(super) notices: Notices,
    /// Error of the work of tick 0, or of a part that cannot start here.
    pub(super) broken: Option<Box<RunError>>,
    /// Profile, if requested.
    pub(super) profile: Option<Profile>,
    /// Observed variables, if any.
    pub(super) observed: Option<Box<Observed>>,
    /// Flag that stops the run between two steps.
    pub(super) interrupt: Option<Arc<AtomicBool>>,
}

/// Storage that is allocated once for a plan. No result depends on its contents after a step, so checkpoints do not contain it.
pub(crate) struct Work {
    /// Counts evaluations.
    pub(super) number: u64,
    pub(super) xdot: Vec<f64>,
    pub(super) integrator: Integrator,
    /// For methods that need derivatives with respect to the state.
    pub(super) linear: Option<Box<Linear>>,
    /// A state within a step.
    pub(super) inside: Vec<f64>,
    /// For freely rotating bodies: the state at the start of a step, and that of a stage in body axes.
    pub(super) start: Vec<f64>,
    pub(super) stage: Vec<f64>,
    /// The state at the start of a step that may have to be repeated.
    pub(super) before: State,
    pub(super) stores: Vec<Option<Box<dyn std::any::Any + Send>>>,
    /// Last step of blocks with their own stepping method: time after the tick at its start, and length (s).
    pub(super) advanced: (f64, f64),
    /// Guards at the end of a step, and within.
    pub(super) end: Vec<f64>,
    pub(super) middle: Vec<f64>,
    /// Guards of a part that fire, with their directions.
    pub(super) ways: Vec<i8>,
    /// Number of successive steps and events of which none advanced the run by a billionth of a row.
    pub(super) tiny: u32,
    /// The guard that fired last.
    pub(super) last: Option<u32>,
    /// Marks the entries of `Plan::asked` that have nothing more to report.
    pub(super) silent: Vec<bool>,
}

impl Work {
    pub(crate) fn new(plan: &Plan) -> Work {
        let (n, guards) = (plan.sizes.x, plan.guards.len());
        Work {
            number: 0,
            xdot: vec![0.0; n],
            integrator: Integrator::new(plan.integration.method, n),
            linear: (matches!(plan.integration.method, Method::Rosenbrock(_))
                && Linear::size(plan) <= Linear::SIZE_MAX)
                .then(|| Box::new(Linear::new(plan))),
            inside: vec![0.0; n],
            start: vec![0.0; if turning::of(plan).is_empty() { 0 } else { n }],
            stage: vec![0.0; if turning::of(plan).is_empty() { 0 } else { n }],
            before: State::default(),
            stores: plan.steps.iter().map(|_| None).collect(),
            advanced: (0.0, 0.0),
            end: vec![0.0; guards],
            middle: vec![0.0; guards],
            ways: vec![0; plan.guarded.iter().map(|g| g.count as usize).max().unwrap_or(0)],
            tiny: 0,
            last: None,
            silent: vec![false; plan.asked.len()],
        }
    }
}

/// Passes a field to its readers.
pub(crate) fn show(blocks: &mut [Box<dyn Block>], field: &FieldPlan) {
    let shown = blocks[field.block as usize].shown();
    field.readers.iter().for_each(|&r| blocks[r as usize].see(shown.as_ref()));
}

/// Creates the state of a plan before the first evaluation.
pub(crate) fn initial(plan: &Plan) -> State {
    let mut state = State {
        tick: plan.table.first().map_or(0, |r| r.at),
        x: vec![0.0; plan.sizes.x],
        d: vec![0.0; plan.sizes.d],
        sig: vec![0.0; plan.sizes.sig],
        guards: vec![GuardState::default(); plan.guards.len()],
        entered: vec![0.0],
        ..State::default()
    };
    for part in &plan.parts {
        let (w, n) = (&part.wiring, part.lanes());
        part.prototype.initial(&mut state.x[w.x..w.x + n.x], &mut state.d[w.d..w.d + n.d]);
    }
    if let Some(rest) = &plan.rest {
        state.x.copy_from_slice(&rest.x);
    }
    for &(lane, value) in &plan.constants {
        state.sig[lane as usize] = value;
    }
    state
}

/// Purpose of a state within a step.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum Purpose {
    /// Evaluation of the guards.
    Look,
    /// Evaluation of the guards at the end of a step that ends there.
    Again,
    /// The run continues from this state.
    Event,
}

/// The observer of a run, its columns in each phase, and the values that it is given.
pub(super) struct Observed {
    pub(super) phases: Vec<Columns>,
    pub(super) observer: Box<dyn Observer>,
    pub(super) start: Vec<f64>,
    pub(super) end: Vec<f64>,
    pub(super) inner: Vec<f64>,
    /// The values that the integrator used last in a fixed step.
    pub(super) used: Vec<f64>,
    /// The signals as they were before anything was evaluated.
    pub(super) signals: Vec<f64>,
    pub(super) disturbed: bool,
}

/// Receives values of chosen variables over time ([`Simulation::observe`]).
pub trait Observer: Any + Send {
    /// Receives the values at an instant after its work: once for a row, and again when a run continues after a change. A variable
    /// that does not exist in the phase is NaN.
    fn instant(&mut self, t: Times, values: &[f64]);
    /// Receives the values over a stretch of time without a jump.
    fn stretch(&mut self, over: &mut Stretch<'_>);
    /// Learns that a state was set from outside, or that variables were pinned or unpinned.
    fn changed(&mut self) {}
}

/// A stretch of time without a jump.
pub struct Stretch<'a> {
    pub(super) sim: &'a mut Simulation,
    pub(super) plan: &'a Plan,
    pub(super) columns: &'a Columns,
    pub(super) start: &'a [f64],
    pub(super) end: &'a [f64],
    pub(super) inner: &'a mut Vec<f64>,
    pub(super) used: &'a [f64],
    pub(super) signals: &'a mut Vec<f64>,
    pub(super) disturbed: &'a mut bool,
    /// The values of variables that are observed sparingly are evaluated, too.
    pub(super) all: bool,
    /// True if it ends at a row with the work of sampled parts.
    pub(super) sampled: bool,
    /// Length of the step to which it belongs, and of the stretch (s).
    pub(super) step: f64,
    pub(super) length: f64,
    pub(super) purpose: Purpose,
}
