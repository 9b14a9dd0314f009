//! Models whose ports follow from their parameters: n wheels, n tanks, a table of thrusters. Lanes are
//! slices in the order of the ports; the scheduler sees the same block as of any other model.
use crate::block::{Block, Now, Outcome, Prototype, Wiring, copy_into, read_store, store_bytes};
use crate::field::Shown;
use crate::model::{BuildError, Description, Fired, Functions, Store, lanes};
use crate::params::Params;
use crate::ports::{PortSpec, Text};
use crate::time::Clock;
use crate::value::Value;
use std::any::Any;
use std::sync::Arc;

/// The ports of one instance.
#[derive(Clone, Debug, Default)]
pub struct SizedPorts {
    /// Inputs without feedthrough.
    pub inputs: Vec<PortSpec>,
    /// Inputs that `direct` may see.
    pub direct_inputs: Vec<PortSpec>,
    /// Outputs from state.
    pub moore_outputs: Vec<PortSpec>,
    /// Outputs with feedthrough.
    pub direct_outputs: Vec<PortSpec>,
    /// Continuous state.
    pub continuous: Vec<PortSpec>,
    /// Discrete state.
    pub discrete: Vec<PortSpec>,
    /// Guards.
    pub guards: Vec<PortSpec>,
    /// It is sampled: `update` runs at the part's own ticks.
    pub sampled: bool,
}

/// A model whose ports follow from its parameters. As [`Model`](crate::Model), over slices: a function is
/// called when the ports that it writes exist.
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

    /// The ports that follow from parameters; asked before the model is built, to check wires.
    fn ports(p: &Self::Params) -> SizedPorts;
    /// Makes the model.
    ///
    /// # Errors
    /// Why these parameters make none.
    fn build(p: Self::Params) -> Result<Self, BuildError>;
    /// State at the start; lanes come as zeros.
    fn initial(&self, x: &mut [f64], d: &mut [f64]) {}
    /// Store at the start.
    fn initial_store(&self) -> Self::Store {
        Self::Store::default()
    }
    /// Outputs from state.
    fn moore(&self, c: &Clock, x: &[f64], d: &[f64], store: &Self::Store, y: &mut [f64]) {}
    /// Outputs with feedthrough.
    fn direct(
        &self,
        c: &Clock,
        x: &[f64],
        d: &[f64],
        u_direct: &[f64],
        store: &Self::Store,
        y: &mut [f64],
    ) {
    }
    /// Derivatives; `u`: inputs, then those that `direct` sees.
    fn deriv(&self, c: &Clock, x: &[f64], d: &[f64], u: &[f64], s: &Self::Store, xdot: &mut [f64]) {
    }
    /// The next discrete state, in place.
    fn update(&self, c: &Clock, x: &[f64], d: &mut [f64], u: &[f64], store: &mut Self::Store) {}
    /// Values of the guards.
    fn guards(&self, c: &Clock, x: &[f64], d: &[f64], u: &[f64], s: &Self::Store, g: &mut [f64]) {}
    /// State after guards reached zero, in place: called once for all that are due at one instant.
    fn fired(
        &self,
        c: &Clock,
        which: Fired<'_>,
        x: &mut [f64],
        d: &mut [f64],
        u: &[f64],
        store: &mut Self::Store,
    ) {
    }
}

/// What is known of the instance with these parameters.
pub(crate) fn describe<M: SizedModel>(p: &M::Params) -> Description {
    let ports = M::ports(p);
    Description {
        name: M::NAME.into(),
        doc: M::DOC.into(),
        functions: Functions {
            moore: !ports.moore_outputs.is_empty(),
            direct: !ports.direct_outputs.is_empty(),
            deriv: !ports.continuous.is_empty(),
            update: ports.sampled,
            guards: !ports.guards.is_empty(),
            moore_timed: true,
            direct_timed: true,
            ..Functions::default()
        },
        params: M::Params::specs(),
        inputs: ports.inputs,
        direct_inputs: ports.direct_inputs,
        moore_outputs: ports.moore_outputs,
        direct_outputs: ports.direct_outputs,
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
    fn block(&self, w: Wiring) -> Box<dyn Block> {
        let d = &self.description;
        Box::new(WiredSized {
            sizes: [
                lanes(&d.continuous),
                lanes(&d.discrete),
                lanes(&d.moore_outputs),
                lanes(&d.direct_outputs),
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
    /// Lanes of X, D, Ym, Yd.
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
    fn moore(&mut self, now: &Now, x: &[f64], d: &[f64], sig: &mut [f64]) -> Outcome {
        let (c, x, d) = (self.w.clock(now), self.x(x), self.d(d));
        let y = &mut sig[self.w.ym..self.w.ym + self.sizes[2]];
        self.model.moore(&c, x, d, &self.store, y);
        Ok(())
    }
    fn direct(&mut self, now: &Now, x: &[f64], d: &[f64], sig: &mut [f64]) -> Outcome {
        self.gather(sig);
        let (c, x, d) = (self.w.clock(now), self.x(x), self.d(d));
        let y = &mut sig[self.w.yd..self.w.yd + self.sizes[3]];
        self.model.direct(&c, x, d, &self.u[self.w.u.len()..], &self.store, y);
        Ok(())
    }
    fn deriv(&mut self, now: &Now, x: &[f64], d: &[f64], sig: &[f64], xdot: &mut [f64]) -> Outcome {
        self.gather(sig);
        let (c, x, d) = (self.w.clock(now), self.x(x), self.d(d));
        let rates = &mut xdot[self.w.x..self.w.x + self.sizes[0]];
        self.model.deriv(&c, x, d, &self.u, &self.store, rates);
        Ok(())
    }
    fn update(&mut self, now: &Now, x: &[f64], d: &mut [f64], sig: &[f64]) -> Outcome {
        self.gather(sig);
        let (c, x) = (self.w.clock(now), self.x(x));
        let d = &mut d[self.w.d..self.w.d + self.sizes[1]];
        self.model.update(&c, x, d, &self.u, &mut self.store);
        Ok(())
    }
    fn guards(
        &mut self,
        now: &Now,
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
    fn fired(
        &mut self,
        now: &Now,
        which: Fired<'_>,
        x: &mut [f64],
        d: &mut [f64],
        sig: &[f64],
    ) -> Outcome {
        self.gather(sig);
        let c = self.w.clock(now);
        let x = &mut x[self.w.x..self.w.x + self.sizes[0]];
        let d = &mut d[self.w.d..self.w.d + self.sizes[1]];
        self.model.fired(&c, which, x, d, &self.u, &mut self.store);
        Ok(())
    }
    fn see(&mut self, shown: Option<&Shown>) {
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
            copy_into(&self.store, into);
        }
    }
    fn take_store(&mut self, from: &dyn Any) {
        if let Some(store) = from.downcast_ref::<M::Store>() {
            self.store.clone_from(store);
            // What it saw belongs to the run that the store comes from.
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
