//! Blocks: operations on flat arrays that the scheduler calls, including their wiring. Models, the mechanism, contact and FMI units are all
//! blocks; the scheduler handles no other kind.
use crate::author::account::OwnAccounts;
use crate::author::error::BuildError;
use crate::author::jacobian::{Jacobian, Operation};
use crate::author::model::{Description, Fired, Model, Store};
use crate::author::overlay::SharedOverlay;
use crate::author::ports::{Lanes, Text};
use crate::author::setting::{IsWired, Judged};
use crate::author::shown::SharedField;
use crate::author::time::Clock;
use crate::author::value::Value;
use smallvec::SmallVec;
use std::any::Any;
use std::sync::Arc;

/// Purpose of an evaluation.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Evaluation {
    /// Evaluation at a tick or an event: outputs that are only displayed are also computed.
    Tick,
    /// A stage of the integrator.
    Stage,
}

/// The time of an evaluation.
#[derive(Clone, Copy, Debug)]
pub struct EvalTime {
    /// Simulated time (s) of this evaluation.
    pub t: f64,
    /// Integration step (s).
    pub dt: f64,
    /// Tick of the common base.
    pub tick: u64,
    /// Purpose of the evaluation.
    pub evaluation: Evaluation,
    /// Start and end (s) of the enclosing step of a fixed-step method.
    pub span: Option<[f64; 2]>,
    /// Number of this evaluation. All operations of one evaluation see the same state, so a block may cache results that depend only on the state as
    /// long as the number is the same, and must discard them otherwise. Inputs may differ within an evaluation, as in an algebraic loop.
    pub number: u64,
}

/// Error of an operation.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Failure {
    /// Error message.
    pub message: String,
    /// Remedy.
    pub help: Option<String>,
}

impl Failure {
    /// Creates a failure from the text of an error.
    pub fn of(error: &dyn std::fmt::Display) -> Box<Failure> {
        let (message, help) = crate::author::value::told(error);
        Box::new(Failure { message, help })
    }
}

/// Result of an operation of a block.
pub type Outcome = Result<(), Box<Failure>>;

/// Indices of the signals that feed an input struct, in order.
pub type Indices = SmallVec<[u32; 8]>;

/// Wiring of a block: positions of its signals and states.
#[derive(Clone, Debug, Default)]
pub struct Wiring {
    /// Signal slot of each input value.
    pub u: Indices,
    /// Signal slot of each feedthrough input value.
    pub ud: Indices,
    /// First signal slot of the outputs.
    pub ym: usize,
    /// First signal slot of the feedthrough outputs.
    pub yd: usize,
    /// First slot of the continuous state.
    pub x: usize,
    /// First slot of the discrete state.
    pub d: usize,
    /// Sample period in ticks; 0: continuous.
    pub period: u64,
    /// First sample's tick.
    pub offset: u64,
    /// Sample period (s).
    pub period_s: f64,
    /// Key of the noise.
    pub key: u64,
    /// The modes of the part are not monitored: its outputs change only at rows and events.
    pub held: bool,
}

/// A wired model that a run owns. Parameters are shared between runs; the store is not. Every operation is a function of its arguments and the store;
/// anything else in a block is scratch memory.
pub trait Block: Send {
    /// Computes the outputs that depend on state only.
    fn outputs(&mut self, now: &EvalTime, x: &[f64], d: &[f64], sig: &mut [f64]) -> Outcome;
    /// Computes the feedthrough outputs.
    fn feedthrough(&mut self, now: &EvalTime, x: &[f64], d: &[f64], sig: &mut [f64]) -> Outcome;
    /// Computes the derivatives of the continuous state.
    fn derivatives(
        &mut self,
        now: &EvalTime,
        x: &[f64],
        d: &[f64],
        sig: &[f64],
        xdot: &mut [f64],
    ) -> Outcome;
    /// Fills the columns of the Jacobian `out` of an operation at (x, d, sig) for which the block has analytic derivatives; finite differences fill
    /// the others. Called only by stiff methods.
    fn jacobian(
        &mut self,
        _operation: Operation,
        _now: &EvalTime,
        _at: (&[f64], &[f64], &[f64]),
        _out: &mut Jacobian,
    ) -> Outcome {
        Ok(())
    }
    /// Computes the next discrete state in place, which is safe because other blocks read signals, never `d`.
    fn update(&mut self, now: &EvalTime, x: &[f64], d: &mut [f64], sig: &[f64]) -> Outcome;
    /// Computes the values of the guards.
    fn guards(
        &mut self,
        _now: &EvalTime,
        _x: &[f64],
        _d: &[f64],
        _sig: &[f64],
        _values: &mut [f64],
    ) -> Outcome {
        Ok(())
    }
    /// Computes the discrete state that follows from the present levels, in place: [`Model::mode`].
    fn mode(&mut self, _now: &EvalTime, _x: &[f64], _d: &mut [f64], _sig: &[f64]) -> Outcome {
        Ok(())
    }
    /// Computes the state after guards reached zero.
    fn handle_event(
        &mut self,
        _now: &EvalTime,
        _which: Fired<'_>,
        _x: &mut [f64],
        _d: &mut [f64],
        _sig: &[f64],
    ) -> Outcome {
        Ok(())
    }
    /// Returns warnings about settings that are allowed but probably not intended, at the start of a run.
    fn startup_warnings(
        &mut self,
        _now: &EvalTime,
        _x: &[f64],
        _d: &[f64],
        _sig: &[f64],
    ) -> Vec<BuildError> {
        Vec::new()
    }
    /// Returns a warning about a guard that is due, before it fires; it may stop the run. Exactly one guard of `which` is due.
    fn runtime_warning(
        &mut self,
        _now: &EvalTime,
        _which: Fired<'_>,
        _x: &[f64],
        _d: &[f64],
        _sig: &[f64],
    ) -> Option<BuildError> {
        None
    }
    /// Removes from a small change of the state the part that [`Block::project`] would remove.
    fn project_change(&mut self, _x: &[f64], _change: &mut [f64]) -> Outcome {
        Ok(())
    }
    /// Projects the state back onto its manifold after a step of an integrator (unit quaternions, closed loops).
    fn project(&mut self, _x: &mut [f64]) -> Outcome {
        Ok(())
    }
    /// Updates states that are constant within a step. It is called at a state from which the run continues: at a row, an event, or the end of a
    /// step. The operations have been evaluated at this state if `now` is their evaluation. Returns whether it changed a state that they depend on.
    /// Called only if [`Prototype::rearranges`].
    ///
    /// # Errors
    /// The run cannot continue from this state.
    fn rearrange(
        &mut self,
        _now: &EvalTime,
        _x: &mut [f64],
        _d: &mut [f64],
    ) -> Result<bool, Box<Failure>> {
        Ok(false)
    }
    /// Semi-implicit Euler: Advances [`Description::positions`] by `h` s along the velocities in `x`.
    fn retract(&mut self, _x: &mut [f64], _h: f64) -> Outcome {
        Ok(())
    }
    /// Performs a step of `h` s by the block's own method, before the other states are integrated. This function writes the outputs that no operation
    /// writes.
    fn advance(&mut self, _now: &EvalTime, _h: f64, _x: &mut [f64], _sig: &mut [f64]) -> Outcome {
        Ok(())
    }
    /// Writes the values of [`Prototype::accounts`] at the state of the last evaluation.
    fn accounts(&mut self, _now: &EvalTime, _x: &[f64], _sig: &[f64], _out: &mut [f64]) {}
    /// Returns a warning about the last step of [`Block::advance`]; each block warns once in a run.
    fn warns(&mut self) -> Option<BuildError> {
        None
    }
    /// For a field: returns the field with its data for its readers.
    fn shown(&self) -> Option<SharedField> {
        None
    }
    /// Returns the ground overlay of the part.
    fn overlay(&self) -> Option<SharedOverlay> {
        None
    }
    /// Receives the field that the part reads; `None` releases it.
    fn see(&mut self, _shown: Option<&SharedField>) {}
    /// Returns the store as bytes; empty if the model has none.
    ///
    /// # Errors
    /// The reason for which the store cannot be saved.
    fn save_store(&self) -> Result<Vec<u8>, String>;
    /// Takes the store back.
    ///
    /// # Errors
    /// The reason for which the bytes are not a store of this model.
    fn load_store(&mut self, bytes: &[u8]) -> Result<(), String>;
    /// Copies the store; reuses the contents of `into` if they have the same type.
    fn copy_store(&self, _into: &mut Option<Box<dyn Any + Send>>) {}
    /// Takes a copy back.
    fn take_store(&mut self, _from: &dyn Any) {}
    /// Returns a copy with its own store, for a fork of the run. If [`Prototype::can_save`] returns an error, every operation of the copy returns
    /// this error.
    fn fork(&self) -> Box<dyn Block>;
}

/// Copies a store into the slot of [`Block::copy_store`]. Allocates memory only if the slot holds no store of this type yet.
pub fn copy_store<T: Clone + Send + 'static>(store: &T, into: &mut Option<Box<dyn Any + Send>>) {
    match into.as_mut().and_then(|slot| slot.downcast_mut::<T>()) {
        Some(old) => old.clone_from(store),
        None => *into = Some(Box::new(store.clone())),
    }
}

/// Returns a store as bytes; empty for a model without a store.
pub(crate) fn store_bytes<T: Store>(store: &T) -> Result<Vec<u8>, String> {
    if std::mem::size_of::<T>() == 0 {
        return Ok(Vec::new());
    }
    rmp_serde::to_vec_named(store).map_err(|e| e.to_string())
}

/// A store from its bytes.
pub(crate) fn read_store<T: Store>(store: &mut T, bytes: &[u8]) -> Result<(), String> {
    if std::mem::size_of::<T>() > 0 {
        *store = rmp_serde::from_slice(bytes).map_err(|e| e.to_string())?;
    }
    Ok(())
}

/// A built model, not yet wired.
pub trait Prototype: Any + Send + Sync {
    /// Returns the description of the part.
    fn description(&self) -> &Description;
    /// Returns its resolved parameters.
    fn params(&self) -> &Value;
    /// State at the start: X and D lanes.
    fn initial(&self, x: &mut [f64], d: &mut [f64]);
    /// True if the model has a store.
    fn stored(&self) -> bool;
    /// Checks whether the store of the block can be saved and copied.
    ///
    /// # Errors
    /// The reason for which it cannot; checkpoints, forks and snapshots then return an error with the path of the part.
    fn can_save(&self) -> Result<(), String> {
        Ok(())
    }
    /// For a field: receives the parts that write to it, in path order; its inputs follow from them.
    fn written_by(&mut self, _writers: &[&str]) {}
    /// Whether its block changes states between steps: [`Block::rearrange`].
    fn rearranges(&self) -> bool {
        false
    }
    /// Outputs that another part must read, each with a warning that says what is lost otherwise.
    fn must_be_read(&self) -> Vec<(&'static str, BuildError)> {
        Vec::new()
    }
    /// Inputs that must be wired although they have a default, each with the reason.
    fn must_be_wired(&self) -> Vec<(&'static str, BuildError)> {
        Vec::new()
    }
    /// Parameters and inputs that may have no effect: [`Model::without_effect`].
    fn without_effect(&self, _wired: IsWired<'_>) -> Judged {
        Judged::new()
    }
    /// Accounts that the block adds to the balances besides its ports.
    fn accounts(&self) -> OwnAccounts {
        OwnAccounts::default()
    }
    /// Wires it.
    fn block(&self, wiring: Wiring) -> Box<dyn Block>;
    /// Names of its states and outputs, if they differ from `<path>.<port>`.
    fn names(&self, _wiring: &Wiring) -> Option<Vec<Named>> {
        None
    }
    /// One flag for each of its continuous states: true if the state is coupled to others by the projection onto the manifold, as the components of a
    /// quaternion are. Empty: none is.
    fn held_together(&self) -> Vec<bool> {
        Vec::new()
    }
    /// Its continuous states that are rates of hinges driven by parts.
    fn driven_rates(&self) -> Vec<usize> {
        Vec::new()
    }
    /// Completes the part when all wires are correct.
    ///
    /// # Errors
    /// The fault because of which the part cannot start.
    fn settle(&mut self, _wiring: &Wiring) -> Result<(), crate::author::value::Fault> {
        Ok(())
    }
    /// Data that distinguish it from parts with the same parameters, for the hash of the plan.
    fn fingerprint(&self) -> String {
        String::new()
    }
    /// Computes the state of this part when a run moves from another plan, in which `old` has the same path. `to` (its lanes of x and d) holds the
    /// initial state.
    ///
    /// # Errors
    /// The reason for which the state cannot be carried over.
    fn carry(
        &self,
        old: &dyn Prototype,
        from: OldState<'_>,
        to: (&mut [f64], &mut [f64]),
    ) -> Result<Carried, Box<Failure>> {
        let (a, b) = (old.description(), self.description());
        let same = |a: &[crate::PortSpec], b: &[crate::PortSpec]| {
            a.len() == b.len()
                && a.iter().zip(b).all(|(a, b)| (&a.name, a.lanes) == (&b.name, b.lanes))
        };
        if a.name != b.name
            || !same(&a.continuous, &b.continuous)
            || !same(&a.discrete, &b.discrete)
        {
            return Ok(Carried::New);
        }
        to.0.copy_from_slice(from.x);
        to.1.copy_from_slice(from.d);
        Ok(Carried::Whole)
    }
}

/// The state of a part in the plan that a run leaves.
#[derive(Clone, Copy, Debug)]
pub struct OldState<'a> {
    /// Its continuous lanes.
    pub x: &'a [f64],
    /// Its discrete lanes.
    pub d: &'a [f64],
    /// All signals of the old plan.
    pub sig: &'a [f64],
}

/// Part of the state that a move between plans carried over.
#[derive(Clone, Debug, PartialEq)]
pub enum Carried {
    /// Nothing was carried over; the part starts anew.
    New,
    /// All, the store too.
    Whole,
    /// The state by the part's own rules, without a store; the texts go into the report.
    State(Vec<String>),
}

/// A variable with a name that the block chooses itself.
pub struct Named {
    /// Whole path.
    pub path: String,
    /// Location of the variable.
    pub place: crate::author::variable::Place,
    /// Role of the variable.
    pub role: crate::author::variable::Role,
    /// Unit.
    pub unit: Text,
    /// Meaning.
    pub doc: Text,
    /// Path of the part or body that it belongs to.
    pub part: Arc<str>,
}

/// [`Prototype`] of a model type.
pub(crate) struct Built<M: Model> {
    pub model: Arc<M>,
    pub params: Value,
    pub description: Arc<Description>,
}

impl<M: Model> Prototype for Built<M> {
    fn description(&self) -> &Description {
        &self.description
    }
    fn params(&self) -> &Value {
        &self.params
    }
    fn initial(&self, x: &mut [f64], d: &mut [f64]) {
        self.model.init_x().put(x);
        self.model.init_d().put(d);
    }
    fn stored(&self) -> bool {
        std::mem::size_of::<M::Store>() > 0
    }
    fn must_be_read(&self) -> Vec<(&'static str, BuildError)> {
        self.model.must_be_read()
    }
    fn must_be_wired(&self) -> Vec<(&'static str, BuildError)> {
        self.model.must_be_wired()
    }
    fn without_effect(&self, wired: IsWired<'_>) -> Judged {
        self.model.without_effect(wired)
    }
    fn block(&self, w: Wiring) -> Box<dyn Block> {
        let store = self.model.init_store();
        Box::new(Wired { model: self.model.clone(), w, store, none: M::FeedthroughOutputs::zero() })
    }
}

struct Wired<M: Model> {
    model: Arc<M>,
    w: Wiring,
    store: M::Store,
    /// Zeros, passed as the argument `y` of `derivatives` if the model does not use that argument.
    none: M::FeedthroughOutputs,
}

impl Wiring {
    /// Returns the clock of a model with this wiring.
    #[inline(always)]
    pub fn clock(&self, now: &EvalTime) -> Clock {
        let since = now.tick.saturating_sub(self.offset);
        match since.checked_div(self.period) {
            None => Clock {
                t: now.t,
                dt: now.dt,
                n: 0,
                key: self.key,
                sampled: self.held,
                span: now.span,
            },
            Some(n) => {
                Clock { t: now.t, dt: self.period_s, n, key: self.key, sampled: true, span: None }
            }
        }
    }
}

impl<M: Model> Wired<M> {
    #[inline(always)]
    fn x(&self, x: &[f64]) -> M::State {
        if M::State::N == 0 { M::State::get(&[]) } else { M::State::get(&x[self.w.x..]) }
    }
    #[inline(always)]
    fn d(&self, d: &[f64]) -> M::DiscreteState {
        if M::DiscreteState::N == 0 {
            M::DiscreteState::get(&[])
        } else {
            M::DiscreteState::get(&d[self.w.d..])
        }
    }
    #[inline(always)]
    fn inputs(&self, sig: &[f64]) -> (M::Inputs, M::FeedthroughInputs) {
        (M::Inputs::gather(sig, &self.w.u), M::FeedthroughInputs::gather(sig, &self.w.ud))
    }
}

impl<M: Model> Block for Wired<M> {
    fn outputs(&mut self, now: &EvalTime, x: &[f64], d: &[f64], sig: &mut [f64]) -> Outcome {
        let (c, x, d) = (self.w.clock(now), self.x(x), self.d(d));
        self.model.outputs(&c, &x, &d, &self.store).put(&mut sig[self.w.ym..]);
        Ok(())
    }
    fn feedthrough(&mut self, now: &EvalTime, x: &[f64], d: &[f64], sig: &mut [f64]) -> Outcome {
        let (c, x, d) = (self.w.clock(now), self.x(x), self.d(d));
        let ud = M::FeedthroughInputs::gather(sig, &self.w.ud);
        self.model.feedthrough(&c, &x, &d, &ud, &self.store).put(&mut sig[self.w.yd..]);
        Ok(())
    }
    fn derivatives(
        &mut self,
        now: &EvalTime,
        x: &[f64],
        d: &[f64],
        sig: &[f64],
        xdot: &mut [f64],
    ) -> Outcome {
        let (c, x, d) = (self.w.clock(now), self.x(x), self.d(d));
        let (u, ud) = self.inputs(sig);
        let rate = if M::FUNCTIONS.derivatives_read_outputs {
            let yd = M::FeedthroughOutputs::get(&sig[self.w.yd..]);
            self.model.derivatives(&c, &x, &d, &u, &ud, &self.store, &yd)
        } else {
            self.model.derivatives(&c, &x, &d, &u, &ud, &self.store, &self.none)
        };
        rate.put(&mut xdot[self.w.x..]);
        Ok(())
    }
    fn update(&mut self, now: &EvalTime, x: &[f64], d: &mut [f64], sig: &[f64]) -> Outcome {
        let (c, x, old) = (self.w.clock(now), self.x(x), self.d(d));
        let (u, ud) = self.inputs(sig);
        let new = self.model.update(&c, &x, &old, &u, &ud, &mut self.store);
        if M::DiscreteState::N > 0 {
            new.put(&mut d[self.w.d..]);
        }
        Ok(())
    }
    fn guards(
        &mut self,
        now: &EvalTime,
        x: &[f64],
        d: &[f64],
        sig: &[f64],
        values: &mut [f64],
    ) -> Outcome {
        let (c, x, d) = (self.w.clock(now), self.x(x), self.d(d));
        let (u, ud) = self.inputs(sig);
        self.model.guards(&c, &x, &d, &u, &ud, &self.store).put(values);
        Ok(())
    }
    fn mode(&mut self, now: &EvalTime, x: &[f64], d: &mut [f64], sig: &[f64]) -> Outcome {
        let (c, x, old) = (self.w.clock(now), self.x(x), self.d(d));
        let ud = M::FeedthroughInputs::gather(sig, &self.w.ud);
        let new = self.model.mode(&c, &x, &old, &ud, &self.store);
        if M::DiscreteState::N > 0 {
            new.put(&mut d[self.w.d..]);
        }
        Ok(())
    }
    fn handle_event(
        &mut self,
        now: &EvalTime,
        which: Fired<'_>,
        x: &mut [f64],
        d: &mut [f64],
        sig: &[f64],
    ) -> Outcome {
        let (c, old_x, old_d) = (self.w.clock(now), self.x(x), self.d(d));
        let (u, ud) = self.inputs(sig);
        let (x1, d1) = self.model.handle_event(&c, which, &old_x, &old_d, &u, &ud, &mut self.store);
        if M::State::N > 0 {
            x1.put(&mut x[self.w.x..]);
        }
        if M::DiscreteState::N > 0 {
            d1.put(&mut d[self.w.d..]);
        }
        Ok(())
    }
    fn startup_warnings(
        &mut self,
        now: &EvalTime,
        x: &[f64],
        d: &[f64],
        sig: &[f64],
    ) -> Vec<BuildError> {
        let (c, x, d) = (self.w.clock(now), self.x(x), self.d(d));
        let (u, ud) = self.inputs(sig);
        self.model.startup_warnings(&c, &x, &d, &u, &ud, &self.store)
    }
    fn runtime_warning(
        &mut self,
        now: &EvalTime,
        which: Fired<'_>,
        x: &[f64],
        d: &[f64],
        sig: &[f64],
    ) -> Option<BuildError> {
        let (c, x, d) = (self.w.clock(now), self.x(x), self.d(d));
        let (u, ud) = self.inputs(sig);
        self.model.runtime_warning(&c, which, &x, &d, &u, &ud, &self.store)
    }
    fn overlay(&self) -> Option<SharedOverlay> {
        self.model.overlay(&self.store)
    }
    fn see(&mut self, shown: Option<&SharedField>) {
        self.store.see(shown);
    }
    fn save_store(&self) -> Result<Vec<u8>, String> {
        store_bytes(&self.store)
    }
    fn load_store(&mut self, bytes: &[u8]) -> Result<(), String> {
        read_store(&mut self.store, bytes)
    }
    fn copy_store(&self, into: &mut Option<Box<dyn Any + Send>>) {
        if std::mem::size_of::<M::Store>() > 0 {
            copy_store(&self.store, into);
        }
    }
    fn take_store(&mut self, from: &dyn Any) {
        if let Some(store) = from.downcast_ref::<M::Store>() {
            self.store.clone_from(store);
            // The observed values belong to the run from which the store comes.
            self.store.see(None);
        }
    }
    fn fork(&self) -> Box<dyn Block> {
        let (model, w, store) = (self.model.clone(), self.w.clone(), self.store.clone());
        Box::new(Wired::<M> { model, w, store, none: M::FeedthroughOutputs::zero() })
    }
}
