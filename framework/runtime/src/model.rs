//! A model: pure functions of plain data. What depends on what is read from their signatures.
use crate::field::{BINDING, Shown};
use crate::overlay::SharedOverlay;
use crate::params::{ParamSpec, Params};
use crate::ports::{Lanes, PortSpec, Text};
use crate::time::Clock;
use serde::{Serialize, de::DeserializeOwned};

/// Which functions a model has, and which of them look at the clock.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Functions {
    /// Outputs from state only.
    pub moore: bool,
    /// Outputs with feedthrough.
    pub direct: bool,
    /// Derivatives of the continuous state.
    pub deriv: bool,
    /// Discrete update at the part's own ticks.
    pub update: bool,
    /// `moore` reads the clock.
    pub moore_timed: bool,
    /// `direct` reads the clock.
    pub direct_timed: bool,
    /// `deriv` reads the model's own direct outputs of the same evaluation.
    pub deriv_outputs: bool,
    /// `direct` uses what `moore` found in the same evaluation.
    pub direct_after_moore: bool,
    /// Numbers that are events where they reach zero.
    pub guards: bool,
    /// Its guards keep steps off the jumps and corners of its outputs ([`Model::MODES`]).
    pub modes: bool,
    /// Its outputs are averages over a step of a fixed method ([`Model::AVERAGES`]).
    pub averages: bool,
    /// Its continuous state advances by a method of its own, from row to row.
    pub steps: bool,
    /// It shows something on the ground.
    pub overlay: bool,
}

/// A model cannot be built from these parameters; or what a part or a service says of a run, when it begins or in the middle of it.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("{message}")]
pub struct BuildError {
    /// What is wrong.
    pub message: String,
    /// What to do about it.
    pub help: Option<String>,
    /// The parameter at fault, when it is one.
    pub param: Option<String>,
    /// Said of a run: it stops there. Else it is told once, and the run goes on.
    pub stops: bool,
}

impl BuildError {
    /// With a message.
    pub fn new(message: impl Into<String>) -> Self {
        BuildError { message: message.into(), help: None, param: None, stops: false }
    }
    /// What an error of another crate says.
    pub fn of(error: &dyn std::fmt::Display) -> Self {
        let (message, help) = crate::value::told(error);
        BuildError { message, help, param: None, stops: false }
    }
    /// With a remedy.
    pub fn help(mut self, help: impl Into<String>) -> Self {
        self.help = Some(help.into());
        self
    }
    /// At a parameter.
    pub fn at(mut self, param: impl Into<String>) -> Self {
        self.param = Some(param.into());
        self
    }
    /// Said of a run: whether it stops there.
    pub fn stopping(mut self, stops: bool) -> Self {
        self.stops = stops;
        self
    }
}

/// Large mutable data of a model: saved with the state, changed only in `update`. A type becomes one by
/// `impl Store for T {}`; one with a [`View`](crate::View) of a field in it says so.
pub trait Store: Serialize + DeserializeOwned + Clone + Default + Send + Sync + 'static {
    /// Kind of field that the view in it sees.
    const READS: Option<&'static str> = None;
    /// Hands the field to the view in it, or takes it away.
    fn see(&mut self, _shown: Option<&Shown>) {}
}
impl Store for () {}
impl<T: Serialize + DeserializeOwned + Clone + Send + Sync + 'static> Store for Vec<T> {}

/// A model. Write the functions it has; `#[model("library.name")]` fills in the rest.
///
/// ```text
/// y_k   = moore(x_k, d_k), direct(x_k, d_k, ud_k)
/// ẋ     = deriv(x, d, u, ud, yd)          at every stage of the integrator; yd: of the same evaluation
/// d_k+1 = update(x_k, d_k, u_k, ud_k)     at the part's own ticks
/// g     = guards(x, d, u, ud)             where one reaches zero is located, then
/// x, d  = fired(which, x, d, u, ud)       at that instant, once for all guards that are due
/// d     = mode(x, d, ud)                  at rows and events, before `direct`; not within a step
/// ```
/// A guard with a direction is a level: where it has reached zero at the start of the run, or of the phase that brings the part,
/// `fired` is called there, before the first row is logged. So `fired` decides from the present values, and takes [`Fired`] for the side of what is exactly at zero.
#[allow(unused_variables)]
pub trait Model: Sized + Send + Sync + 'static {
    /// Name in the catalogue.
    const NAME: &'static str;
    /// Documentation.
    const DOC: &'static str;
    /// Functions it has.
    const FUNCTIONS: Functions;
    /// It takes W for inertial axes: it is refused where W is a [`Site`](crate::Site) of a planet.
    const INERTIAL: bool = false;
    /// Its outputs have jumps or corners, and its discrete state says which smooth piece holds. Within a step the piece stays, also
    /// beyond its end; a guard ends the step there and `fired` changes the piece. [`Model::mode`] gives the piece at rows and
    /// events. Where its outputs change at rows and events only ([`Clock::sampled`]) its guards are not watched, and `mode` alone gives the piece.
    const MODES: bool = false;
    /// It pushes shorter than a step may be. Where [`Clock::span`] gives a step of a fixed method, its outputs are averages over
    /// that step, so that the step has the whole impulse. Adaptive methods follow the outputs themselves.
    const AVERAGES: bool = false;
    /// Parameters; constant during a run.
    type Params: Params;
    /// Inputs that outputs do not see at once.
    type U: Lanes;
    /// Inputs that `direct` may see.
    type Ud: Lanes;
    /// Outputs from state only.
    type Ym: Lanes;
    /// Outputs with feedthrough.
    type Yd: Lanes;
    /// Continuous state.
    type X: Lanes;
    /// Discrete state.
    type D: Lanes;
    /// Large discrete state.
    type Store: Store;
    /// Guards: numbers that are events where they reach zero.
    type G: Lanes;

    /// Makes the model.
    fn build(p: Self::Params) -> Result<Self, BuildError>;
    /// Outputs that another part has to take up, each with what is lost where none does: a warning of the plan.
    fn must_be_read(&self) -> Vec<(&'static str, BuildError)> {
        Vec::new()
    }
    /// Inputs with a default that with these parameters have to be wired all the same, each with the reason: the default would decide a result.
    fn must_be_wired(&self) -> Vec<(&'static str, BuildError)> {
        Vec::new()
    }
    /// Continuous state at the start.
    fn init_x(&self) -> Self::X {
        Self::X::zero()
    }
    /// Discrete state at the start.
    fn init_d(&self) -> Self::D {
        Self::D::zero()
    }
    /// Store at the start.
    fn init_store(&self) -> Self::Store {
        Self::Store::default()
    }
    /// Outputs from state only.
    fn moore(&self, c: &Clock, x: &Self::X, d: &Self::D, store: &Self::Store) -> Self::Ym {
        Self::Ym::zero()
    }
    /// Outputs with feedthrough.
    fn direct(
        &self,
        c: &Clock,
        x: &Self::X,
        d: &Self::D,
        ud: &Self::Ud,
        store: &Self::Store,
    ) -> Self::Yd {
        Self::Yd::zero()
    }
    /// Derivative of the continuous state. `yd` is what `direct` gave in the same evaluation, when the
    /// function names that argument (else zeros): what both need is computed once.
    fn deriv(
        &self,
        c: &Clock,
        x: &Self::X,
        d: &Self::D,
        u: &Self::U,
        ud: &Self::Ud,
        store: &Self::Store,
        yd: &Self::Yd,
    ) -> Self::X {
        Self::X::zero()
    }
    /// The next discrete state.
    fn update(
        &self,
        c: &Clock,
        x: &Self::X,
        d: &Self::D,
        u: &Self::U,
        ud: &Self::Ud,
        store: &mut Self::Store,
    ) -> Self::D {
        Self::D::zero()
    }
    /// Numbers that are events where they reach zero: continuous between events.
    fn guards(
        &self,
        c: &Clock,
        x: &Self::X,
        d: &Self::D,
        u: &Self::U,
        ud: &Self::Ud,
        store: &Self::Store,
    ) -> Self::G {
        Self::G::zero()
    }
    /// The discrete state that follows from the present levels, for a model with [`Model::MODES`]: the piece that holds. It is not asked
    /// while a guard of the part is due, nor at the instant at which one has fired as long as it stands at its zero but for round-off:
    /// [`Model::fired`] decides there.
    fn mode(
        &self,
        c: &Clock,
        x: &Self::X,
        d: &Self::D,
        ud: &Self::Ud,
        store: &Self::Store,
    ) -> Self::D {
        let mut lanes = vec![0.0; Self::D::N];
        d.put(&mut lanes);
        Self::D::get(&lanes)
    }
    /// State after guards reached zero; `which` says which of them, by their places among the lanes of `G`, and which way they
    /// went. Called once for all that are due at one instant. Outputs and inputs are those just before the event.
    fn fired(
        &self,
        c: &Clock,
        which: Fired<'_>,
        x: &Self::X,
        d: &Self::D,
        u: &Self::U,
        ud: &Self::Ud,
        store: &mut Self::Store,
    ) -> (Self::X, Self::D) {
        let mut lanes = vec![0.0; Self::X::N + Self::D::N];
        let (a, b) = lanes.split_at_mut(Self::X::N);
        x.put(a);
        d.put(b);
        (Self::X::get(a), Self::D::get(b))
    }
    /// What is allowed and probably not meant, seen at the start of a run, or of the phase that brings the part: each a fact with its
    /// remedy. One that [stops](BuildError::stops) refuses the start: it is asked of parts with guards.
    fn remarks(
        &self,
        c: &Clock,
        x: &Self::X,
        d: &Self::D,
        u: &Self::U,
        ud: &Self::Ud,
        store: &Self::Store,
    ) -> Vec<BuildError> {
        Vec::new()
    }
    /// Returns a warning when a guard is due, before [`Model::fired`]: allowed and probably not meant. Called for each guard
    /// separately, so that one guard of `which` is due. The warning is given once in a run for each guard, and the run goes on; or it [stops](BuildError::stops) the run at that instant. What `direct` and `deriv`
    /// give beyond the guard are still numbers: steps are tried there before the guard is located.
    fn tells(
        &self,
        c: &Clock,
        which: Fired<'_>,
        x: &Self::X,
        d: &Self::D,
        u: &Self::U,
        ud: &Self::Ud,
        store: &Self::Store,
    ) -> Option<BuildError> {
        None
    }
    /// What it shows on the ground, for viewers and logs: a copy of what is to be drawn, cheap since it is made while the run waits.
    fn overlay(&self, store: &Self::Store) -> Option<SharedOverlay> {
        None
    }
}

/// The guards of one part that are due at one instant, by their places among the lanes of `G`.
#[derive(Clone, Copy, Debug)]
pub struct Fired<'a>(&'a [i8]);

impl<'a> Fired<'a> {
    /// Takes one number for each guard: 1 where it rose to zero or beyond, −1 where it fell to zero or beyond, 0 where it is not due.
    pub fn new(ways: &'a [i8]) -> Fired<'a> {
        Fired(ways)
    }
    /// One guard that rose, of at most eight: for a test of a model.
    pub fn rising(which: usize) -> Fired<'static> {
        const ONE: [i8; 15] = [0, 0, 0, 0, 0, 0, 0, 1, 0, 0, 0, 0, 0, 0, 0];
        Fired(&ONE[7 - which..])
    }
    /// One guard that fell, of at most eight: for a test of a model.
    pub fn falling(which: usize) -> Fired<'static> {
        const ONE: [i8; 15] = [0, 0, 0, 0, 0, 0, 0, -1, 0, 0, 0, 0, 0, 0, 0];
        Fired(&ONE[7 - which..])
    }
    /// Whether this guard is due.
    pub fn is_due(self, which: usize) -> bool {
        self.0.get(which).is_some_and(|way| *way != 0)
    }
    /// Whether this guard is due and came from below zero.
    pub fn rose(self, which: usize) -> bool {
        self.0.get(which).is_some_and(|way| *way > 0)
    }
    /// Whether this guard is due and came from above zero.
    pub fn fell(self, which: usize) -> bool {
        self.0.get(which).is_some_and(|way| *way < 0)
    }
}

/// Lanes of a body that turns freely: an explicit method steps its linear velocity in axes that do not turn.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Turning {
    /// First lane of its quaternion [x y z w], of body axes in those of its parent.
    pub attitude: usize,
    /// First lane of [ω; v]: angular (rad/s) and linear velocity (m/s) relative to its parent, body axes.
    pub velocity: usize,
}

/// What is known of a model or service: of its type before it is built, of the instance after.
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
    /// Inputs without feedthrough (U).
    pub inputs: Vec<PortSpec>,
    /// Inputs with feedthrough (Ud).
    pub direct_inputs: Vec<PortSpec>,
    /// Outputs from state (Ym).
    pub moore_outputs: Vec<PortSpec>,
    /// Outputs with feedthrough (Yd).
    pub direct_outputs: Vec<PortSpec>,
    /// Continuous state.
    pub continuous: Vec<PortSpec>,
    /// Discrete state.
    pub discrete: Vec<PortSpec>,
    /// Guards.
    pub guards: Vec<PortSpec>,
    /// Lanes of the continuous state that the block itself brings onto their manifold after a step,
    /// and moves along their velocities in semi-implicit Euler.
    pub positions: std::ops::Range<usize>,
    /// Velocities among its continuous states in axes that turn with a body.
    pub turning: Vec<Turning>,
    /// Name of the kind of field that it reads.
    pub reads: Option<Text>,
    /// Of a field: the kind of what it shows.
    pub shows: Option<Text>,
    /// Of a field: the ports of what one part does to it.
    pub imprint: Vec<PortSpec>,
    /// It takes W for inertial axes: see [`Model::INERTIAL`].
    pub inertial: bool,
}

impl Description {
    /// Of a model type.
    pub fn of<M: Model>() -> Self {
        Description {
            name: M::NAME.into(),
            doc: M::DOC.into(),
            functions: Functions { modes: M::MODES, averages: M::AVERAGES, ..M::FUNCTIONS },
            params: M::Params::specs(),
            inputs: M::U::specs(),
            direct_inputs: M::Ud::specs(),
            moore_outputs: M::Ym::specs(),
            direct_outputs: M::Yd::specs(),
            continuous: M::X::specs(),
            discrete: M::D::specs(),
            guards: M::G::specs(),
            positions: 0..0,
            turning: Vec::new(),
            reads: M::Store::READS.map(Text::from),
            shows: None,
            imprint: Vec::new(),
            inertial: M::INERTIAL,
        }
    }
    /// All inputs, U first.
    pub fn all_inputs(&self) -> impl Iterator<Item = &PortSpec> {
        self.inputs.iter().chain(&self.direct_inputs)
    }
    /// All outputs, Ym first.
    pub fn all_outputs(&self) -> impl Iterator<Item = &PortSpec> {
        self.moore_outputs.iter().chain(&self.direct_outputs)
    }
    /// The names that `bind` may use, each once.
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

/// Lanes of some ports.
pub(crate) fn lanes(ports: &[PortSpec]) -> usize {
    ports.iter().map(|p| p.lanes).sum()
}
