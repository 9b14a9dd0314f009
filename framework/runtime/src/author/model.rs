//! Models: pure functions of plain data. The arguments that they name decide the order of evaluation.
use crate::author::error::BuildError;
use crate::author::overlay::SharedOverlay;
use crate::author::params::{ParamSpec, Params};
use crate::author::ports::{Lanes, PortSpec, Text};
use crate::author::setting::{IsWired, Judged};
use crate::author::shown::{BINDING, SharedField};
use crate::author::time::Clock;
use serde::{Serialize, de::DeserializeOwned};

/// Functions that a model has, and the arguments that decide the order of evaluation.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Functions {
    /// The model has outputs that follow from its state.
    pub outputs: bool,
    /// The model has outputs that follow from inputs of the same instant.
    pub feedthrough: bool,
    /// The model has derivatives of a continuous state.
    pub derivatives: bool,
    /// The model updates a discrete state at the sample times of the part.
    pub update: bool,
    /// `outputs` reads the clock.
    pub outputs_timed: bool,
    /// `feedthrough` reads the clock.
    pub feedthrough_timed: bool,
    /// `derivatives` reads the feedthrough outputs of the same evaluation.
    pub derivatives_read_outputs: bool,
    /// `feedthrough` uses results of `outputs` of the same evaluation.
    pub feedthrough_after_outputs: bool,
    /// The model has guards: functions whose zero crossings are events.
    pub guards: bool,
    /// Its guards end a step at the jumps and corners of its outputs ([`Model::MODES`]).
    pub modes: bool,
    /// Its outputs are averages over a step of a fixed-step method ([`Model::AVERAGES`]).
    pub averages: bool,
    /// The model integrates its continuous state itself, with a custom method.
    pub steps: bool,
    /// The model has a ground overlay.
    pub overlay: bool,
}

/// Large mutable data of a model: saved with the state, changed only in `update`. A type becomes a store by `impl Store for T {}`; a type that
/// contains a [`View`](crate::View) of a field must declare it in this `impl`.
pub trait Store: Serialize + DeserializeOwned + Clone + Default + Send + Sync + 'static {
    /// Kind of field that the contained view reads.
    const READS: Option<&'static str> = None;
    /// Passes the field to the contained view; `None` removes it.
    fn see(&mut self, _shown: Option<&SharedField>) {}
}
impl Store for () {}
impl<T: Serialize + DeserializeOwned + Clone + Send + Sync + 'static> Store for Vec<T> {}

/// A model: functions of its state and inputs. `#[model("library.name")]` above the `impl` completes it.
///
/// Write the functions that the model needs. Each takes `&self` and, in any order, those arguments that it reads; the names of the
/// arguments decide what they receive:
///
/// | argument | type | content |
/// |---|---|---|
/// | `clock` | `&Clock` | time, step or sample period, noise |
/// | `x` | `&Self::State` | continuous state |
/// | `d` | `&Self::DiscreteState` | discrete state |
/// | `u` | `&Self::Inputs` | inputs; `&Self::FeedthroughInputs` in a model that has no other inputs |
/// | `ud` | `&Self::FeedthroughInputs` | inputs that feedthrough outputs depend on, in a model that has both kinds |
/// | `y` | `&Self::FeedthroughOutputs` | in `derivatives`: the feedthrough outputs of the same evaluation |
/// | `store` | `&Self::Store` | large discrete state; `&mut` in `update` and `handle_event` |
/// | `fired` | `Fired` | in `handle_event` and `runtime_warning`: the guards that have reached zero |
///
/// ```text
/// y    = outputs(x, d), feedthrough(x, d, ud)
/// ẋ    = derivatives(x, d, u, ud, y)        at every stage of the integrator
/// d⁺   = update(x, d, u, ud)                at the sample times of the part
/// g    = guards(x, d, u, ud)                zero crossings are located within a step, then
/// x, d = handle_event(fired, x, d, u, ud)   at that instant, once for all guards that are due
/// d    = mode(x, d, ud)                     at samples and events before `feedthrough`, not within a step
/// ```
/// A guard with a direction is a level: if it has reached zero at the start of the run, or of the phase that adds the part, `handle_event` is called
/// before the first sample is logged. `handle_event` therefore decides from the present values and uses [`Fired`] only where a value is exactly at
/// zero.
#[allow(unused_variables)]
pub trait Model: Sized + Send + Sync + 'static {
    /// Name in the catalogue.
    const NAME: &'static str;
    /// Documentation.
    const DOC: &'static str;
    /// Functions that the model has.
    const FUNCTIONS: Functions;
    /// The model assumes that the axes of the world frame W are inertial; it is rejected if W rotates with a planet.
    const INERTIAL: bool = false;
    /// Its outputs have jumps or corners, and its discrete state selects the present smooth piece. Within a step the
    /// piece is kept, also beyond its end; a guard ends the step there and `handle_event` changes the piece. [`Model::mode`] returns
    /// the piece at samples and events. If the outputs change at samples and events only ([`Clock::sampled`]), the guards are not evaluated, and
    /// `mode` alone selects the piece.
    const MODES: bool = false;
    /// It makes pulses that may be shorter than a step. If [`Clock::span`] is the step of a fixed-step method, its outputs are averages over that
    /// step, so that the step delivers the whole impulse. Adaptive methods resolve the pulse itself.
    const AVERAGES: bool = false;
    /// Parameters; constant during a run.
    type Params: Params;
    /// Inputs that no output depends on at the same instant.
    type Inputs: Lanes;
    /// Inputs that feedthrough outputs depend on.
    type FeedthroughInputs: Lanes;
    /// Outputs that follow from the state.
    type Outputs: Lanes;
    /// Outputs that depend on inputs of the same instant.
    type FeedthroughOutputs: Lanes;
    /// Continuous state.
    type State: Lanes;
    /// Discrete state.
    type DiscreteState: Lanes;
    /// Large discrete state.
    type Store: Store;
    /// Guards: functions whose zero crossings are events.
    type Guards: Lanes;

    /// Creates the model.
    fn build(p: Self::Params) -> Result<Self, BuildError>;
    /// Returns the outputs that another part must read, each with a warning that says what is lost otherwise.
    fn must_be_read(&self) -> Vec<(&'static str, BuildError)> {
        Vec::new()
    }
    /// Returns the inputs that have a default but must be wired with these parameters, because the default would decide a result;
    /// each with the reason.
    fn must_be_wired(&self) -> Vec<(&'static str, BuildError)> {
        Vec::new()
    }
    /// Returns the parameters and inputs whose effect depends on other parameters, services or wires, each with the reason for which it has no
    /// effect, or `None` if it acts. A written parameter, a wire, or a forgotten command without an effect in all phases causes a warning. State
    /// conditions on parameters of the same struct by `#[param(needs = "..")]` instead.
    fn without_effect(&self, _wired: IsWired<'_>) -> Judged {
        Judged::new()
    }
    /// Returns the initial continuous state.
    fn init_x(&self) -> Self::State {
        Self::State::zero()
    }
    /// Returns the initial discrete state.
    fn init_d(&self) -> Self::DiscreteState {
        Self::DiscreteState::zero()
    }
    /// Returns the initial store.
    fn init_store(&self) -> Self::Store {
        Self::Store::default()
    }
    /// Returns the outputs that follow from the state.
    fn outputs(
        &self,
        clock: &Clock,
        x: &Self::State,
        d: &Self::DiscreteState,
        store: &Self::Store,
    ) -> Self::Outputs {
        Self::Outputs::zero()
    }
    /// Returns the outputs that depend on inputs of the same instant.
    fn feedthrough(
        &self,
        clock: &Clock,
        x: &Self::State,
        d: &Self::DiscreteState,
        ud: &Self::FeedthroughInputs,
        store: &Self::Store,
    ) -> Self::FeedthroughOutputs {
        Self::FeedthroughOutputs::zero()
    }
    /// Returns the derivative of the continuous state. A function that names `y` receives the feedthrough outputs of the same
    /// evaluation, so that terms that both need are computed once; otherwise `y` is zero.
    fn derivatives(
        &self,
        clock: &Clock,
        x: &Self::State,
        d: &Self::DiscreteState,
        u: &Self::Inputs,
        ud: &Self::FeedthroughInputs,
        store: &Self::Store,
        y: &Self::FeedthroughOutputs,
    ) -> Self::State {
        Self::State::zero()
    }
    /// Returns the next discrete state.
    fn update(
        &self,
        clock: &Clock,
        x: &Self::State,
        d: &Self::DiscreteState,
        u: &Self::Inputs,
        ud: &Self::FeedthroughInputs,
        store: &mut Self::Store,
    ) -> Self::DiscreteState {
        Self::DiscreteState::zero()
    }
    /// Returns the values of the guards: functions, continuous between events, whose zero crossings are events.
    fn guards(
        &self,
        clock: &Clock,
        x: &Self::State,
        d: &Self::DiscreteState,
        u: &Self::Inputs,
        ud: &Self::FeedthroughInputs,
        store: &Self::Store,
    ) -> Self::Guards {
        Self::Guards::zero()
    }
    /// Returns the smooth piece that holds at the present values, for a model with [`Model::MODES`]. It is not called while a guard
    /// of the part is due, nor at the instant of its event while the guard is zero within round-off, because [`Model::handle_event`] decides there.
    fn mode(
        &self,
        clock: &Clock,
        x: &Self::State,
        d: &Self::DiscreteState,
        ud: &Self::FeedthroughInputs,
        store: &Self::Store,
    ) -> Self::DiscreteState {
        let mut lanes = vec![0.0; Self::DiscreteState::N];
        d.put(&mut lanes);
        Self::DiscreteState::get(&lanes)
    }
    /// Returns the states after an event. `fired` contains the guards that reached zero, by their indices in `Guards`, with their directions. It is
    /// called once for all guards that are due at one instant. Inputs are those just before the event.
    fn handle_event(
        &self,
        clock: &Clock,
        fired: Fired<'_>,
        x: &Self::State,
        d: &Self::DiscreteState,
        u: &Self::Inputs,
        ud: &Self::FeedthroughInputs,
        store: &mut Self::Store,
    ) -> (Self::State, Self::DiscreteState) {
        let mut lanes = vec![0.0; Self::State::N + Self::DiscreteState::N];
        let (a, b) = lanes.split_at_mut(Self::State::N);
        x.put(a);
        d.put(b);
        (Self::State::get(a), Self::DiscreteState::get(b))
    }
    /// Returns warnings about a start that is allowed but probably a mistake, each with its remedy. It is called at the start of a
    /// run, or of the phase that adds the part. A warning of a part with guards that [stops](BuildError::stops) rejects the start.
    fn startup_warnings(
        &self,
        clock: &Clock,
        x: &Self::State,
        d: &Self::DiscreteState,
        u: &Self::Inputs,
        ud: &Self::FeedthroughInputs,
        store: &Self::Store,
    ) -> Vec<BuildError> {
        Vec::new()
    }
    /// Returns a warning about a guard that is due, before [`Model::handle_event`]. It is called for each guard separately, so that
    /// exactly one guard of `fired` is due. Each guard warns once in a run, and the run continues, unless the warning
    /// [stops](BuildError::stops) it at that instant. `feedthrough` and `derivatives` must return finite numbers beyond the guard,
    /// because the integrator evaluates them there before the zero crossing is located.
    fn runtime_warning(
        &self,
        clock: &Clock,
        fired: Fired<'_>,
        x: &Self::State,
        d: &Self::DiscreteState,
        u: &Self::Inputs,
        ud: &Self::FeedthroughInputs,
        store: &Self::Store,
    ) -> Option<BuildError> {
        None
    }
    /// Returns what it draws on the ground, for viewers and logs. The copy must be cheap, because the run waits for it.
    fn overlay(&self, store: &Self::Store) -> Option<SharedOverlay> {
        None
    }
}

/// The guards of one part that are due at one instant, by their indices in [`Model::Guards`].
#[derive(Clone, Copy, Debug)]
pub struct Fired<'a>(&'a [i8]);

impl<'a> Fired<'a> {
    /// Takes one number for each guard: 1 if it rose to zero or beyond, −1 if it fell to zero or beyond, 0 if it is not due.
    pub fn new(ways: &'a [i8]) -> Fired<'a> {
        Fired(ways)
    }
    /// Creates a set with one guard that rose, of at most eight, for a test of a model.
    pub fn rising(which: usize) -> Fired<'static> {
        const ONE: [i8; 15] = [0, 0, 0, 0, 0, 0, 0, 1, 0, 0, 0, 0, 0, 0, 0];
        Fired(&ONE[7 - which..])
    }
    /// Creates a set with one guard that fell, of at most eight, for a test of a model.
    pub fn falling(which: usize) -> Fired<'static> {
        const ONE: [i8; 15] = [0, 0, 0, 0, 0, 0, 0, -1, 0, 0, 0, 0, 0, 0, 0];
        Fired(&ONE[7 - which..])
    }
    /// Returns whether this guard is due.
    pub fn is_due(self, which: usize) -> bool {
        self.0.get(which).is_some_and(|way| *way != 0)
    }
    /// Returns whether this guard is due and came from below zero.
    pub fn rose(self, which: usize) -> bool {
        self.0.get(which).is_some_and(|way| *way > 0)
    }
    /// Returns whether this guard is due and came from above zero.
    pub fn fell(self, which: usize) -> bool {
        self.0.get(which).is_some_and(|way| *way < 0)
    }
}

/// State slots of a freely rotating body: explicit methods integrate its linear velocity in non-rotating axes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Turning {
    /// First slot of its quaternion [x y z w], body axes to parent axes.
    pub attitude: usize,
    /// First slot of [ω; v]: angular (rad/s) and linear velocity (m/s) relative to its parent, body axes.
    pub velocity: usize,
}

/// Description of a model or service: before it is built that of the type, afterwards that of the instance.
#[derive(Clone, Debug, Default)]
pub struct Description {
    /// Name in the catalogue.
    pub name: Text,
    /// Documentation.
    pub doc: Text,
    /// Functions.
    pub functions: Functions,
    /// Parameters.
    pub params: Vec<ParamSpec>,
    /// Inputs that no output depends on at the same instant.
    pub inputs: Vec<PortSpec>,
    /// Inputs that feedthrough outputs depend on.
    pub feedthrough_inputs: Vec<PortSpec>,
    /// Outputs that follow from the state.
    pub outputs: Vec<PortSpec>,
    /// Outputs that depend on inputs of the same instant.
    pub feedthrough_outputs: Vec<PortSpec>,
    /// Continuous state.
    pub continuous: Vec<PortSpec>,
    /// Discrete state.
    pub discrete: Vec<PortSpec>,
    /// Guards.
    pub guards: Vec<PortSpec>,
    /// Continuous states that the block itself projects onto their manifold after a step, and that semi-implicit Euler advances by their velocities.
    pub positions: std::ops::Range<usize>,
    /// Velocities among its continuous states that are in rotating body axes.
    pub turning: Vec<Turning>,
    /// Kind of the field that the model reads.
    pub reads: Option<Text>,
    /// For a field: kind of its data.
    pub shows: Option<Text>,
    /// For a field: ports of the imprint of one part.
    pub imprint: Vec<PortSpec>,
    /// True if it assumes inertial axes of W; see [`Model::INERTIAL`].
    pub inertial: bool,
}

impl Description {
    /// Creates the description of a model type.
    pub fn of<M: Model>() -> Self {
        Description {
            name: M::NAME.into(),
            doc: M::DOC.into(),
            functions: Functions { modes: M::MODES, averages: M::AVERAGES, ..M::FUNCTIONS },
            params: M::Params::specs(),
            inputs: M::Inputs::specs(),
            feedthrough_inputs: M::FeedthroughInputs::specs(),
            outputs: M::Outputs::specs(),
            feedthrough_outputs: M::FeedthroughOutputs::specs(),
            continuous: M::State::specs(),
            discrete: M::DiscreteState::specs(),
            guards: M::Guards::specs(),
            positions: 0..0,
            turning: Vec::new(),
            reads: M::Store::READS.map(Text::from),
            shows: None,
            imprint: Vec::new(),
            inertial: M::INERTIAL,
        }
    }
    /// Returns the description of an instance that acts on a slider.
    pub(crate) fn on_slider(&self) -> Self {
        let mut all = self.clone();
        let groups = [
            &mut all.inputs,
            &mut all.feedthrough_inputs,
            &mut all.outputs,
            &mut all.feedthrough_outputs,
            &mut all.continuous,
            &mut all.discrete,
            &mut all.guards,
        ];
        groups.into_iter().flatten().for_each(PortSpec::slide);
        all
    }
    /// Returns all inputs; inputs without feedthrough come first.
    pub fn all_inputs(&self) -> impl Iterator<Item = &PortSpec> {
        self.inputs.iter().chain(&self.feedthrough_inputs)
    }
    /// Returns all outputs; outputs of the state come first.
    pub fn all_outputs(&self) -> impl Iterator<Item = &PortSpec> {
        self.outputs.iter().chain(&self.feedthrough_outputs)
    }
    /// Returns the names that `bind` may use, each once.
    pub fn bindings(&self) -> Vec<&str> {
        let mut names: Vec<&str> = Vec::new();
        for bind in self.all_inputs().chain(self.all_outputs()).filter_map(|p| p.bind.as_deref()) {
            if !names.contains(&bind) {
                names.push(bind);
            }
        }
        if self.reads.is_some() && !names.contains(&BINDING) {
            names.push(BINDING);
        }
        names
    }
}

/// Returns the total number of values of some ports.
pub(crate) fn lanes(ports: &[PortSpec]) -> usize {
    ports.iter().map(|p| p.lanes).sum()
}
