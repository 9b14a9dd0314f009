//! Models whose ports follow from their parameters: n wheels, n tanks, a table of thrusters. They read and write slices in the
//! order of their ports.
use crate::author::block::{
    Block, EvalTime, Outcome, Prototype, Wiring, copy_store, read_store, store_bytes,
};
use crate::author::error::BuildError;
use crate::author::model::{Description, Fired, Functions, Store, lanes};
use crate::author::params::Params;
use crate::author::ports::{PortSpec, Text};
use crate::author::setting::{IsWired, Judged};
use crate::author::shown::SharedField;
use crate::author::time::Clock;
use crate::author::value::Value;
use std::any::Any;
use std::sync::Arc;

/// The ports of one instance.
#[derive(Clone, Debug, Default)]
pub struct SizedPorts {
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
    /// It is sampled: `update` runs at the part's own ticks.
    pub sampled: bool,
}

/// A model whose ports follow from its parameters. Its functions are those of [`Model`](crate::Model), with slices in the order of
/// the ports; a function is called when the ports that it writes exist. `#[model("library.name")]` above the `impl` completes
/// it: each function names, in any order, the arguments that it reads.
#[allow(unused_variables)]
pub trait SizedModel: Sized + Send + Sync + 'static {
    /// Name in the catalogue.
    const NAME: &'static str;
    /// Documentation.
    const DOC: &'static str;
    /// Parameters; constant during a run.
    type Params: Params;
    /// Large discrete state.
    type Store: Store;

    /// Returns the ports that follow from parameters. It is called before the model is built, to check wires.
    fn ports(p: &Self::Params) -> SizedPorts;
    /// Makes the model.
    ///
    /// # Errors
    /// The reason for which no model can be built from these parameters.
    fn build(p: Self::Params) -> Result<Self, BuildError>;
    /// Returns the parameters and inputs whose effect depends on other parameters, services or wires, each with the reason for which it has no
    /// effect, or `None` if it acts. A written parameter, a wire, or a forgotten command without an effect in all phases causes a warning. State
    /// conditions on parameters of the same struct by `#[param(needs = "..")]` instead.
    fn without_effect(&self, _wired: IsWired<'_>) -> Judged {
        Judged::new()
    }
    /// Writes the initial states; both slices come as zeros.
    fn initial(&self, x: &mut [f64], d: &mut [f64]) {}
    /// Returns the initial store.
    fn initial_store(&self) -> Self::Store {
        Self::Store::default()
    }
    /// Writes the outputs that follow from the state to `y`.
    fn outputs(&self, clock: &Clock, x: &[f64], d: &[f64], store: &Self::Store, y: &mut [f64]) {}
    /// Writes the outputs that depend on inputs of the same instant to `y`. `u`: the feedthrough inputs.
    fn feedthrough(
        &self,
        clock: &Clock,
        x: &[f64],
        d: &[f64],
        u: &[f64],
        store: &Self::Store,
        y: &mut [f64],
    ) {
    }
    /// Writes the derivative of the continuous state to `rates`. `u`: the inputs, then the feedthrough inputs; in the functions
    /// below, too.
    fn derivatives(
        &self,
        clock: &Clock,
        x: &[f64],
        d: &[f64],
        u: &[f64],
        store: &Self::Store,
        rates: &mut [f64],
    ) {
    }
    /// Advances the discrete state by one sample.
    fn update(&self, clock: &Clock, x: &[f64], d: &mut [f64], u: &[f64], store: &mut Self::Store) {}
    /// Writes the values of the guards.
    fn guards(
        &self,
        clock: &Clock,
        x: &[f64],
        d: &[f64],
        u: &[f64],
        store: &Self::Store,
        values: &mut [f64],
    ) {
    }
    /// Changes the states after an event: called once for all guards that are due at one instant.
    fn handle_event(
        &self,
        clock: &Clock,
        fired: Fired<'_>,
        x: &mut [f64],
        d: &mut [f64],
        u: &[f64],
        store: &mut Self::Store,
    ) {
    }
}

/// Returns the description of the instance with these parameters.
pub(crate) fn describe<M: SizedModel>(p: &M::Params) -> Description {
    let ports = M::ports(p);
    Description {
        name: M::NAME.into(),
        doc: M::DOC.into(),
        functions: Functions {
            outputs: !ports.outputs.is_empty(),
            feedthrough: !ports.feedthrough_outputs.is_empty(),
            derivatives: !ports.continuous.is_empty(),
            update: ports.sampled,
            guards: !ports.guards.is_empty(),
            outputs_timed: true,
            feedthrough_timed: true,
            ..Functions::default()
        },
        params: M::Params::specs(),
        inputs: ports.inputs,
        feedthrough_inputs: ports.feedthrough_inputs,
        outputs: ports.outputs,
        feedthrough_outputs: ports.feedthrough_outputs,
        continuous: ports.continuous,
        discrete: ports.discrete,
        guards: ports.guards,
        positions: 0..0,
        turning: Vec::new(),
        reads: M::Store::READS.map(Text::from),
        shows: None,
        imprint: Vec::new(),
        inertial: false,
    }
}

/// [`Prototype`] of a sized model.
pub(crate) struct BuiltSized<M: SizedModel> {
    pub model: Arc<M>,
    pub params: Value,
    pub description: Arc<Description>,
}

impl<M: SizedModel> Prototype for BuiltSized<M> {
    fn description(&self) -> &Description {
        &self.description
    }
    fn params(&self) -> &Value {
        &self.params
    }
    fn initial(&self, x: &mut [f64], d: &mut [f64]) {
        x.fill(0.0);
        d.fill(0.0);
        self.model.initial(x, d);
    }
    fn stored(&self) -> bool {
        std::mem::size_of::<M::Store>() > 0
    }
    fn without_effect(&self, wired: IsWired<'_>) -> Judged {
        self.model.without_effect(wired)
    }
    fn block(&self, w: Wiring) -> Box<dyn Block> {
        let d = &self.description;
        Box::new(WiredSized {
            sizes: [
                lanes(&d.continuous),
                lanes(&d.discrete),
                lanes(&d.outputs),
                lanes(&d.feedthrough_outputs),
            ],
            u: vec![0.0; w.u.len() + w.ud.len()],
            store: self.model.initial_store(),
            model: self.model.clone(),
            w,
        })
    }
}

struct WiredSized<M: SizedModel> {
    model: Arc<M>,
    w: Wiring,
    store: M::Store,
    /// Lanes of the continuous state, the discrete state, outputs and feedthrough outputs.
    sizes: [usize; 4],
    /// Inputs, gathered.
    u: Vec<f64>,
}

impl<M: SizedModel> WiredSized<M> {
    fn gather(&mut self, sig: &[f64]) {
        for (u, lane) in self.u.iter_mut().zip(self.w.u.iter().chain(&self.w.ud)) {
            *u = sig[*lane as usize];
        }
    }
    fn x<'a>(&self, x: &'a [f64]) -> &'a [f64] {
        &x[self.w.x..self.w.x + self.sizes[0]]
    }
    fn d<'a>(&self, d: &'a [f64]) -> &'a [f64] {
        &d[self.w.d..self.w.d + self.sizes[1]]
    }
}

impl<M: SizedModel> Block for WiredSized<M> {
    fn outputs(&mut self, now: &EvalTime, x: &[f64], d: &[f64], sig: &mut [f64]) -> Outcome {
        let (c, x, d) = (self.w.clock(now), self.x(x), self.d(d));
        let y = &mut sig[self.w.ym..self.w.ym + self.sizes[2]];
        self.model.outputs(&c, x, d, &self.store, y);
        Ok(())
    }
    fn feedthrough(&mut self, now: &EvalTime, x: &[f64], d: &[f64], sig: &mut [f64]) -> Outcome {
        self.gather(sig);
        let (c, x, d) = (self.w.clock(now), self.x(x), self.d(d));
        let y = &mut sig[self.w.yd..self.w.yd + self.sizes[3]];
        self.model.feedthrough(&c, x, d, &self.u[self.w.u.len()..], &self.store, y);
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
        self.gather(sig);
        let (c, x, d) = (self.w.clock(now), self.x(x), self.d(d));
        let rates = &mut xdot[self.w.x..self.w.x + self.sizes[0]];
        self.model.derivatives(&c, x, d, &self.u, &self.store, rates);
        Ok(())
    }
    fn update(&mut self, now: &EvalTime, x: &[f64], d: &mut [f64], sig: &[f64]) -> Outcome {
        self.gather(sig);
        let (c, x) = (self.w.clock(now), self.x(x));
        let d = &mut d[self.w.d..self.w.d + self.sizes[1]];
        self.model.update(&c, x, d, &self.u, &mut self.store);
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
        self.gather(sig);
        let (c, x, d) = (self.w.clock(now), self.x(x), self.d(d));
        self.model.guards(&c, x, d, &self.u, &self.store, values);
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
        self.gather(sig);
        let c = self.w.clock(now);
        let x = &mut x[self.w.x..self.w.x + self.sizes[0]];
        let d = &mut d[self.w.d..self.w.d + self.sizes[1]];
        self.model.handle_event(&c, which, x, d, &self.u, &mut self.store);
        Ok(())
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
        Box::new(WiredSized::<M> {
            model: self.model.clone(),
            w: self.w.clone(),
            store: self.store.clone(),
            sizes: self.sizes,
            u: self.u.clone(),
        })
    }
}
