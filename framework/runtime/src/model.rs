//! A model: pure functions of plain data. What depends on what is read from their signatures.
use crate::params::{ParamSpec, Params};
use crate::ports::{Lanes, PortSpec};
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
}

/// A model cannot be built from these parameters.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("{message}")]
pub struct BuildError {
    /// What is wrong.
    pub message: String,
    /// What to do about it.
    pub help: Option<String>,
    /// The parameter at fault, when it is one.
    pub param: Option<String>,
}

impl BuildError {
    /// With a message.
    pub fn new(message: impl Into<String>) -> Self {
        BuildError { message: message.into(), help: None, param: None }
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
}

/// Large mutable data of a model: saved with the state, changed only in `update`.
pub trait Store: Serialize + DeserializeOwned + Clone + Default + Send + Sync + 'static {}
impl<T: Serialize + DeserializeOwned + Clone + Default + Send + Sync + 'static> Store for T {}

/// A model. Write the functions it has; `#[model("library.name")]` fills in the rest.
///
/// ```text
/// y_k   = moore(x_k, d_k), direct(x_k, d_k, ud_k)
/// ẋ     = deriv(x, d, u, ud, yd)          at every stage of the integrator; yd: of the same evaluation
/// d_k+1 = update(x_k, d_k, u_k, ud_k)     at the part's own ticks
/// ```
#[allow(unused_variables)]
pub trait Model: Sized + Send + Sync + 'static {
    /// Name in the catalogue.
    const NAME: &'static str;
    /// Documentation.
    const DOC: &'static str;
    /// Functions it has.
    const FUNCTIONS: Functions;
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

    /// Makes the model.
    fn build(p: Self::Params) -> Result<Self, BuildError>;
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
}

/// What is known of a model or service without building it.
#[derive(Clone, Debug)]
pub struct Description {
    /// Name in the catalogue.
    pub name: &'static str,
    /// Documentation.
    pub doc: &'static str,
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
}

impl Description {
    /// Of a model type.
    pub fn of<M: Model>() -> Self {
        Description {
            name: M::NAME,
            doc: M::DOC,
            functions: M::FUNCTIONS,
            params: M::Params::specs(),
            inputs: M::U::specs(),
            direct_inputs: M::Ud::specs(),
            moore_outputs: M::Ym::specs(),
            direct_outputs: M::Yd::specs(),
            continuous: M::X::specs(),
            discrete: M::D::specs(),
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
    pub fn bindings(&self) -> Vec<&'static str> {
        let mut names = Vec::new();
        for bind in self.all_inputs().chain(self.all_outputs()).filter_map(|p| p.bind) {
            if !names.contains(&bind) {
                names.push(bind);
            }
        }
        names
    }
}
