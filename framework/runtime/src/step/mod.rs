//! A run: its state and the functions that advance it.
//!
//! ```text
//! at a row:       operations due, in one topological order → updates due (all see the same signals)
//! between rows:   the integrator steps; each stage evaluates the continuous operations
//! at an event:    handler of the fired guard → dependent operations → guards again, until none fires
//! ```
//! Between calls the state is always "after the work of an instant", so the results do not depend on how a run is divided into calls.
mod bad;
mod begin;
mod evaluate;
mod events;
mod integrate;
mod linear;
mod linearise;
mod moves;
mod notices;
mod observe;
mod observed;
mod operation;
mod pinned;
mod pins;
mod profile;
mod reports;
mod sampled;
mod settle;
pub(crate) mod simulation;
mod startup_warnings;
pub(crate) mod state;
mod stiffness;
mod stopped;
mod turning;
pub(crate) mod variables;

use crate::plan::compiled::blocks_of;
pub use observed::ObserverRequest;
pub use profile::{Profile, Spent};
pub use reports::{MoveReport, Notice};
pub use settle::{SettleGroup, settle};
pub use simulation::{Observer, RunError, Simulation, Stop, Stretch, VariableError};
use simulation::{Work, initial, show};
pub use state::{GuardState, State};
pub use variables::Change;

use crate::author::block::{Block, EvalTime, Evaluation};
use crate::author::time::{IntoSeconds, Seconds};
use crate::plan::compiled::{FieldPlan, Fires, Plan};
use crate::plan::condition::{Condition, Times};
use crate::plan::program::Program;
use reports::Notices;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use stopped::Stopped;

impl Simulation {
    /// Returns the current data of the field at a path; `None` if the phase has no such field or its data have another type. While the result is
    /// kept, the field copies its data to change them.
    pub fn seen<D: crate::author::field::Shows>(
        &self,
        path: &str,
    ) -> Option<Arc<crate::author::field::FieldSample<D>>> {
        let field = self.plan.fields.iter().find(|f| self.plan.block_path(f.block) == path)?;
        self.shown(field.block)?.downcast().ok()
    }

    /// Returns the current ground overlay of the part at a path; `None` if the phase has no such part or the part has no overlay.
    pub fn overlay(&self, path: &str) -> Option<crate::SharedOverlay> {
        let block = self.plan.parts.iter().position(|part| part.path == path)?;
        self.blocks.get(block)?.overlay()
    }

    /// Returns the ground overlay of a part, by its index in the plan.
    pub(crate) fn overlay_of(&self, block: u32) -> Option<crate::SharedOverlay> {
        self.blocks.get(block as usize)?.overlay()
    }

    /// Returns the data of a field, by its index in the plan.
    pub(crate) fn shown(&self, block: u32) -> Option<crate::author::shown::SharedField> {
        self.blocks.get(block as usize)?.shown()
    }

    /// Starts another evaluation at this instant.
    fn next(&mut self, evaluation: Evaluation) -> EvalTime {
        self.work.number += 1;
        let (t, tick) = (self.time(), self.state.tick);
        let (dt, number) = (self.plan.step.seconds(), self.work.number);
        EvalTime { t, dt, tick, evaluation, span: None, number }
    }

    /// Returns the plan of the current phase.
    pub fn plan(&self) -> &Arc<Plan> {
        &self.plan
    }
    /// Returns the program: all phases.
    pub fn program(&self) -> &Arc<Program> {
        &self.program
    }
    /// Returns the name of the current phase.
    pub fn phase(&self) -> &str {
        &self.program.phases[self.state.phase as usize].name
    }
    /// Returns the state.
    pub fn state(&self) -> &State {
        &self.state
    }
    /// Returns the simulated time (s).
    pub fn time(&self) -> f64 {
        self.plan.base.times(self.state.tick) + self.state.since
    }

    fn updates(&mut self, plan: &Plan, now: &EvalTime) -> Result<(), Stopped> {
        let work = &plan.works[plan.table[self.state.row as usize].work as usize];
        let State { x, d, sig, pins, guards, .. } = &mut self.state;
        let pins = pins.as_deref();
        for &k in &work.updates {
            let outcome = self.blocks[k as usize].update(now, x, d, sig);
            outcome.map_err(|failure| Stopped { block: k, failure })?;
        }
        for &k in &work.fields {
            let FieldPlan { block, readers } = &plan.fields[k as usize];
            // Readers release the data so that the field can change them in place.
            readers.iter().for_each(|&r| self.blocks[r as usize].see(None));
            let outcome = self.blocks[*block as usize].update(now, x, d, sig);
            show(&mut self.blocks, &plan.fields[k as usize]);
            outcome.map_err(|failure| Stopped { block: *block, failure })?;
        }
        if let Some(pins) = pins {
            pins.discrete(d);
        }
        if work.refresh {
            let lanes = (&x[..], &mut d[..], &mut sig[..]);
            let (ops, guards) = (&plan.continuous_ops, (&guards[..], &mut self.work.middle[..]));
            evaluate::run_all_now(&mut self.blocks, plan, ops, now, lanes, pins, guards)?;
        }
        Ok(())
    }

    /// Updates states that are constant within a step, at the instant `now` whose operations have been evaluated, and evaluates operations again if
    /// they depend on the changes. Returns the last evaluation.
    #[inline]
    fn rearrange(&mut self, plan: &Plan, now: EvalTime) -> Result<EvalTime, Stopped> {
        if plan.rearranged.is_empty() {
            return Ok(now);
        }
        let State { x, d, pins, .. } = &mut self.state;
        let (blocks, pins) = (&mut self.blocks, pins.as_deref());
        if !evaluate::rearrange(blocks, plan, &now, (x, d), pins)? {
            return Ok(now);
        }
        let now = self.next(Evaluation::Tick);
        let State { x, d, sig, pins, guards, .. } = &mut self.state;
        let lanes = (&x[..], &mut d[..], &mut sig[..]);
        let (ops, guards) = (&plan.continuous_ops, (&guards[..], &mut self.work.middle[..]));
        evaluate::run_all_now(&mut self.blocks, plan, ops, &now, lanes, pins.as_deref(), guards)?;
        Ok(now)
    }

    /// Advances to the next row of the table, through all events before and at it.
    ///
    /// # Errors
    /// Returns the first bad variable if a state is not finite or has diverged, or the error of a part or a service.
    pub fn step(&mut self) -> Result<(), RunError> {
        let from = self.state.tick;
        // An event may move the run to another plan.
        while let Stop::Watched(_) = self.step_watched()? {
            if self.state.tick != from && self.state.since == 0.0 && !self.is_due() {
                break;
            }
        }
        Ok(())
    }

    /// Advances to the next row, through all events before and at it, or to an earlier instant at which a watched condition becomes true or the run
    /// is interrupted.
    ///
    /// # Errors
    /// As [`Simulation::step`].
    pub fn step_watched(&mut self) -> Result<Stop, RunError> {
        let plan = self.plan.clone();
        self.go_to_row(&plan)
    }

    /// Advances to the next row or event. Events of one instant come one at a time; the run may be saved
    /// after each.
    ///
    /// # Errors
    /// As [`Simulation::step`].
    pub fn step_event(&mut self) -> Result<Stop, RunError> {
        let plan = self.plan.clone();
        self.go_to_stop(&plan)
    }

    #[inline]
    fn go_to_row(&mut self, plan: &Plan) -> Result<Stop, RunError> {
        if plan.guards.is_empty() {
            return self.go_to_stop(plan);
        }
        let from = self.state.tick;
        let mut stop = self.go_to_stop(plan)?;
        // Fire the events before the next row and at it. Stop at that row when none of its events is pending.
        loop {
            if matches!(stop, Stop::Watched(_) | Stop::Interrupted) {
                return Ok(stop);
            }
            if self.state.tick != from && self.state.since == 0.0 && !self.is_due() {
                return Ok(Stop::Row);
            }
            // An event may have moved the run to another plan.
            stop = self.step_event()?;
        }
    }

    #[inline]
    fn go_to_stop(&mut self, plan: &Plan) -> Result<Stop, RunError> {
        if let Some(error) = &self.broken {
            return Err(RunError::clone(error));
        }
        if !plan.guards.is_empty() && self.is_due() {
            return self.fire_and_check();
        }
        self.covered(plan)?;
        match self.integrate(plan)? {
            Stop::Event => return self.fire_and_check(),
            Stop::Interrupted => return Ok(Stop::Interrupted),
            Stop::Row | Stop::Watched(_) => {}
        }
        self.row(plan).map_err(|stopped| self.stopped(stopped))?;
        self.check()?;
        if !plan.asked.is_empty() {
            self.places(plan)?;
        }
        Ok(Stop::Row)
    }

    fn fire_and_check(&mut self) -> Result<Stop, RunError> {
        let watched = self.fire().map_err(|stopped| self.stopped(stopped))?;
        self.check()?;
        Ok(watched.map_or(Stop::Event, Stop::Watched))
    }

    /// Checks that every service covers the time until the next row.
    #[inline]
    fn covered(&self, plan: &Plan) -> Result<(), RunError> {
        let next = self.state.tick + plan.table[self.state.row as usize].gap;
        match plan.services.failure(plan.base.times(next)) {
            Some((path, told)) => Err(self.untold(path, told)),
            None => Ok(()),
        }
    }

    /// Checks before a run until `t` (s) that every service that exists in all phases covers that time.
    ///
    /// # Errors
    /// Returns the error of the first service that does not.
    pub fn answers_until(&self, t: f64) -> Result<(), RunError> {
        let mut phases = self.program.phases.iter().map(|phase| &phase.plan.services);
        let found = phases.next().and_then(|services| services.failure(t));
        match found.filter(|(path, _)| phases.all(|services| services.is_troubled(path, t))) {
            Some((path, told)) => {
                let mut error = self.untold(path, told);
                error.message.insert_str(0, "the run cannot reach its end: ");
                Err(error)
            }
            None => Ok(()),
        }
    }

    /// Does the work of the next row.
    #[inline]
    fn row(&mut self, plan: &Plan) -> Result<(), Stopped> {
        let row = &plan.table[self.state.row as usize];
        self.state.tick += row.gap;
        self.state.row += 1;
        (self.state.since, self.state.micro) = (0.0, 0);
        if self.state.row as usize == plan.table.len() {
            self.state.row = 0;
        }
        let now = self.next(Evaluation::Tick);
        let work = &plan.works[plan.table[self.state.row as usize].work as usize];
        let State { x, d, sig, pins, guards, .. } = &mut self.state;
        let lanes = (&x[..], &mut d[..], &mut sig[..]);
        let (pins, guards) = (pins.as_deref(), (&guards[..], &mut self.work.middle[..]));
        evaluate::run_all_now(&mut self.blocks, plan, &work.ops, &now, lanes, pins, guards)?;
        let now = self.rearrange(plan, now)?;
        self.updates(plan, &now)?;
        if plan.guards.is_empty() { Ok(()) } else { self.look(plan) }
    }

    /// Checks that all values are finite, no state has diverged and every service answered. Every step ends with this check; call it before the first
    /// step to find errors of the initial state.
    ///
    /// # Errors
    /// Returns the error of a part that failed at tick 0 or cannot start here, of a service that could not answer, or the first bad variable.
    pub fn check(&self) -> Result<(), RunError> {
        if let Some(error) = &self.broken {
            return Err(RunError::clone(error));
        }
        if let Some((path, told)) = self.plan.services.failure(self.time()) {
            return Err(self.untold(path, told));
        }
        if self.is_bad() { Err(self.first_bad()) } else { Ok(()) }
    }

    /// Runs to the first row at or after `t`, in seconds (`10.0`), as a text (`"2 min"`) or as [`Seconds`]. The states are equal
    /// however a run is divided into calls.
    ///
    /// # Errors
    /// The errors of [`Simulation::step`], with the state of the instant at which it failed; a `t` that is not a time.
    pub fn run_until(&mut self, t: impl IntoSeconds) -> Result<(), RunError> {
        let t = self.end(t)?;
        self.run_to(t)
    }

    /// Runs as [`Simulation::run_until`], and calls `at_row` at the present row and at every row that follows: to read
    /// variables, to set inputs, or to end the run with an error.
    ///
    /// # Errors
    /// The errors of [`Simulation::run_until`], and errors that `at_row` returns.
    pub fn run_with(
        &mut self,
        t: impl IntoSeconds,
        mut at_row: impl FnMut(&mut Simulation) -> Result<(), RunError>,
    ) -> Result<(), RunError> {
        let t = self.end(t)?;
        at_row(self)?;
        while self.before(t) {
            if self.step_watched()? == Stop::Interrupted {
                return Ok(());
            }
            at_row(self)?;
        }
        self.run_to(t)
    }

    /// Converts the time at which a run is to end.
    fn end(&self, t: impl IntoSeconds) -> Result<Seconds, RunError> {
        t.into_seconds().map_err(|message| {
            let (time, path) = (self.time(), String::new());
            let help = Some("give seconds, or a text such as \"2 min\"".to_string());
            RunError { time, path, message, help }
        })
    }

    /// The loop of [`Simulation::run_until`], compiled once.
    fn run_to(&mut self, t: Seconds) -> Result<(), RunError> {
        let mut plan = self.plan.clone();
        while self.before(t) {
            if self.go_to_row(&plan)? == Stop::Interrupted {
                return Ok(());
            }
            if !Arc::ptr_eq(&plan, &self.plan) {
                plan = self.plan.clone();
            }
        }
        // Finish the events of the last row if the run was saved between them.
        while self.state.since == 0.0 && self.is_due() {
            self.step_event()?;
        }
        Ok(())
    }

    /// Returns whether a watched condition is true at the current row, by its index in [`crate::PhaseSpec::watches`].
    pub fn watched(&self, which: u32) -> bool {
        let fires = Fires::Watch { which };
        let guards = self.plan.guards.iter().zip(&self.state.guards);
        guards.into_iter().any(|(guard, state)| guard.fires == fires && state.value >= 0.0)
    }

    /// Returns whether the run is at a row of the table with no pending event.
    pub fn at_row(&self) -> bool {
        self.state.since == 0.0 && !self.is_due()
    }

    /// Returns the time (s) from now to the next row.
    pub fn time_to_row(&self) -> f64 {
        let gap = self.plan.table[self.state.row as usize].gap;
        self.plan.base.times(gap) - self.state.since
    }

    /// Returns whether a condition over the variables of the program is currently true.
    pub fn holds(&self, condition: &Condition) -> bool {
        let time = self.time();
        let times = Times { time, phase: time - self.state.began() };
        condition.holds(times, |place| self.value(place))
    }

    /// True while the present tick is before `t`. A tick within a billionth of `t` and within a thousandth of a tick counts as being at `t`, because
    /// a floating-point sum such as `time + 0.02` is not an exact multiple of the tick.
    pub fn before(&self, t: Seconds) -> bool {
        let base = self.plan.base;
        // Compare integers: the unit is one second divided by both denominators.
        let tick = u128::from(base.num) * u128::from(t.den);
        let (now, goal) =
            (u128::from(self.state.tick) * tick, u128::from(t.num) * u128::from(base.den));
        goal.saturating_sub(now) > (goal / 1_000_000_000).min(tick / 1000)
    }

    /// Returns the error of a service that could not answer.
    #[cold]
    fn untold(&self, path: &str, told: crate::BuildError) -> RunError {
        let message = format!("`{path}`: {}", told.message);
        RunError { time: self.time(), path: path.into(), message, help: told.help }
    }

    /// Returns the error of a block.
    #[cold]
    fn stopped(&self, stopped: Stopped) -> RunError {
        // The cause of a part's failure may be a service that could not answer.
        if let Some((path, told)) = self.plan.services.failure(self.time()) {
            return self.untold(path, told);
        }
        let Stopped { block, failure } = stopped;
        let path = self.plan.block_path(block).to_string();
        let message = format!("`{path}`: {}", failure.message);
        RunError { time: self.time(), path, message, help: failure.help }
    }

    /// Evaluates everything but sampled operations at this instant, after the state was changed.
    fn refresh(&mut self) -> Result<(), Stopped> {
        let plan = self.plan.clone();
        let now = self.next(Evaluation::Tick);
        let State { x, d, sig, pins, guards, .. } = &mut self.state;
        let lanes = (&x[..], &mut d[..], &mut sig[..]);
        let (pins, guards) = (pins.as_deref(), (&guards[..], &mut self.work.middle[..]));
        let ops = &plan.continuous_ops;
        evaluate::run_all_now(&mut self.blocks, &plan, ops, &now, lanes, pins, guards)?;
        if self.broken.is_some() {
            self.judge();
        }
        Ok(())
    }

    /// Returns the transitions since the last call, at most the latest 256: time (s), description, and report of the carried state.
    pub fn take_moves(&mut self) -> Vec<(f64, String, MoveReport)> {
        std::mem::take(&mut self.moved)
    }

    /// Returns an independent copy of the run; plan and program are shared.
    pub fn fork(&self) -> Simulation {
        let mut work = Work::new(&self.plan);
        work.number = self.work.number + 1;
        Simulation {
            program: self.program.clone(),
            plan: self.plan.clone(),
            state: self.state.clone(),
            blocks: self.blocks.iter().map(|b| b.fork()).collect(),
            work,
            moved: Vec::new(),
            notices: Notices::default(),
            broken: self.broken.clone(),
            profile: None,
            observed: None,
            interrupt: None,
        }
    }

    /// Sets a flag that stops an advance between two steps of the integrator, before the next row, because a row of an hour may take a million steps.
    /// [`Simulation::step_watched`] then returns [`Stop::Interrupted`]; the run may be saved there, and continues with the next step. If a part has
    /// its own stepping method (contact), which advances from row to row, the run stops at the row.
    pub fn interrupt_by(&mut self, flag: Arc<AtomicBool>) {
        self.interrupt = Some(flag);
    }

    pub(super) fn is_interrupted(&self) -> bool {
        self.interrupt.as_ref().is_some_and(|flag| flag.load(Ordering::Relaxed))
    }

    /// Invalidates all caches after the state was replaced.
    pub(crate) fn replaced(&mut self) {
        self.work.number += 1;
        for field in &self.plan.fields {
            show(&mut self.blocks, field);
        }
    }

    /// Enters a phase with new blocks, for a state that is set from outside.
    pub(crate) fn enter(&mut self, phase: u32) {
        if phase != self.state.phase {
            self.plan = self.program.phases[phase as usize].plan.clone();
            self.blocks = self.new_blocks(&self.plan);
            let entered = std::mem::take(&mut self.state.entered);
            self.state = State { phase, entered, ..initial(&self.plan) };
            let number = self.work.number + 1;
            self.work = Work { number, ..Work::new(&self.plan) };
        }
    }
}

impl Simulation {
    /// Measures the time of every operation of every part from now on. This slows down the run but does not change its results. Forks of the run are
    /// not profiled.
    pub fn profile(&mut self) -> Profile {
        if self.profile.is_none() {
            let profile = Profile::default();
            let blocks = std::mem::take(&mut self.blocks);
            self.blocks = profile.around(&self.plan, blocks);
            self.profile = Some(profile);
        }
        self.profile.clone().unwrap_or_default()
    }

    /// Creates new blocks for this run in another phase or program.
    pub(super) fn new_blocks(&self, plan: &Plan) -> Vec<Box<dyn Block>> {
        match &self.profile {
            Some(profile) => profile.blocks(plan),
            None => blocks_of(plan),
        }
    }
}
