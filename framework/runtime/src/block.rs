//! A model erased to what the scheduler calls: operations on flat lanes, with the wiring inside.
use crate::model::{Description, Model};
use crate::ports::Lanes;
use crate::time::Clock;
use crate::value::Value;
use smallvec::SmallVec;
use std::sync::Arc;

/// What an evaluation is for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Evaluation {
    /// The work of a tick: what is only to be seen is computed too.
    Tick,
    /// A stage of the integrator.
    Stage,
}

/// The time of an evaluation.
#[derive(Clone, Copy, Debug)]
pub struct Now {
    /// Simulated time (s) of this evaluation.
    pub t: f64,
    /// Integration step (s).
    pub dt: f64,
    /// Tick of the common base.
    pub tick: u64,
    /// What it is for.
    pub evaluation: Evaluation,
}

/// Indices of the lanes that feed an input struct, in lane order.
pub type Indices = SmallVec<[u32; 8]>;

/// Where a block finds and puts its lanes.
#[derive(Clone, Debug, Default)]
pub struct Wiring {
    /// Signal lane of each lane of U.
    pub u: Indices,
    /// Signal lane of each lane of Ud.
    pub ud: Indices,
    /// First signal lane of Ym.
    pub ym: usize,
    /// First signal lane of Yd.
    pub yd: usize,
    /// First lane of X.
    pub x: usize,
    /// First lane of D.
    pub d: usize,
    /// Sample period in ticks; 0: continuous.
    pub period: u64,
    /// First sample's tick.
    pub offset: u64,
    /// Sample period (s).
    pub period_s: f64,
    /// Key of the noise.
    pub key: u64,
}

/// A wired model that a run owns. Parameters are shared; only the store is its own.
pub trait Block: Send {
    /// Outputs from state.
    fn moore(&mut self, now: &Now, x: &[f64], d: &[f64], sig: &mut [f64]);
    /// Outputs with feedthrough.
    fn direct(&mut self, now: &Now, x: &[f64], d: &[f64], sig: &mut [f64]);
    /// Derivatives.
    fn deriv(&mut self, now: &Now, x: &[f64], d: &[f64], sig: &[f64], xdot: &mut [f64]);
    /// Next discrete state, in place: other blocks read signals, never `d`.
    fn update(&mut self, now: &Now, x: &[f64], d: &mut [f64], sig: &[f64]);
    /// After a step of an integrator that works on lanes: unit quaternions again.
    fn normalize(&mut self, _x: &mut [f64]) {}
    /// Positions to h later with the velocities in `x`, for semi-implicit Euler. False: none.
    fn advance_positions(&mut self, _x: &mut [f64], _h: f64) -> bool {
        false
    }
    /// A step of `h` s by a method of its own, before the other states are integrated.
    fn advance(&mut self, _x: &mut [f64], _sig: &mut [f64], _h: f64) {}
    /// What went wrong when a value became NaN.
    fn fault(&self) -> Option<&str> {
        None
    }
    /// The lanes that `advance_positions` moves.
    fn position_lanes(&self) -> std::ops::Range<usize> {
        0..0
    }
    /// The store as bytes; empty when the model has none.
    fn save_store(&self) -> Result<Vec<u8>, String>;
    /// Takes the store back.
    fn load_store(&mut self, bytes: &[u8]) -> Result<(), String>;
    /// A copy with its own store, for a fork of the run.
    fn fork(&self) -> Box<dyn Block>;
}

/// A built model, not yet wired.
pub trait Prototype: Send + Sync {
    /// What is known of it.
    fn description(&self) -> &Description;
    /// Its parameters, resolved.
    fn params(&self) -> &Value;
    /// State at the start: X and D lanes.
    fn initial(&self, x: &mut [f64], d: &mut [f64]);
    /// True when it has a store.
    fn stored(&self) -> bool;
    /// Wires it.
    fn block(&self, wiring: Wiring) -> Box<dyn Block>;
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
    fn block(&self, w: Wiring) -> Box<dyn Block> {
        let store = self.model.init_store();
        Box::new(Wired { model: self.model.clone(), w, store, none: M::Yd::zero() })
    }
}

struct Wired<M: Model> {
    model: Arc<M>,
    w: Wiring,
    store: M::Store,
    /// What a `deriv` is given that does not ask for outputs.
    none: M::Yd,
}

impl<M: Model> Wired<M> {
    #[inline(always)]
    fn clock(&self, now: &Now) -> Clock {
        let since = now.tick.saturating_sub(self.w.offset);
        match since.checked_div(self.w.period) {
            None => Clock { t: now.t, dt: now.dt, n: 0, key: self.w.key },
            Some(n) => Clock { t: now.t, dt: self.w.period_s, n, key: self.w.key },
        }
    }
    #[inline(always)]
    fn x(&self, x: &[f64]) -> M::X {
        if M::X::N == 0 { M::X::get(&[]) } else { M::X::get(&x[self.w.x..]) }
    }
    #[inline(always)]
    fn d(&self, d: &[f64]) -> M::D {
        if M::D::N == 0 { M::D::get(&[]) } else { M::D::get(&d[self.w.d..]) }
    }
}

impl<M: Model> Block for Wired<M> {
    fn moore(&mut self, now: &Now, x: &[f64], d: &[f64], sig: &mut [f64]) {
        let (c, x, d) = (self.clock(now), self.x(x), self.d(d));
        self.model.moore(&c, &x, &d, &self.store).put(&mut sig[self.w.ym..]);
    }
    fn direct(&mut self, now: &Now, x: &[f64], d: &[f64], sig: &mut [f64]) {
        let (c, x, d) = (self.clock(now), self.x(x), self.d(d));
        let ud = M::Ud::gather(sig, &self.w.ud);
        self.model.direct(&c, &x, &d, &ud, &self.store).put(&mut sig[self.w.yd..]);
    }
    fn deriv(&mut self, now: &Now, x: &[f64], d: &[f64], sig: &[f64], xdot: &mut [f64]) {
        let (c, x, d) = (self.clock(now), self.x(x), self.d(d));
        let (u, ud) = (M::U::gather(sig, &self.w.u), M::Ud::gather(sig, &self.w.ud));
        let rate = if M::FUNCTIONS.deriv_outputs {
            let yd = M::Yd::get(&sig[self.w.yd..]);
            self.model.deriv(&c, &x, &d, &u, &ud, &self.store, &yd)
        } else {
            self.model.deriv(&c, &x, &d, &u, &ud, &self.store, &self.none)
        };
        rate.put(&mut xdot[self.w.x..]);
    }
    fn update(&mut self, now: &Now, x: &[f64], d: &mut [f64], sig: &[f64]) {
        let (c, x, old) = (self.clock(now), self.x(x), self.d(d));
        let (u, ud) = (M::U::gather(sig, &self.w.u), M::Ud::gather(sig, &self.w.ud));
        let new = self.model.update(&c, &x, &old, &u, &ud, &mut self.store);
        if M::D::N > 0 {
            new.put(&mut d[self.w.d..]);
        }
    }
    fn save_store(&self) -> Result<Vec<u8>, String> {
        if std::mem::size_of::<M::Store>() == 0 {
            return Ok(Vec::new());
        }
        rmp_serde::to_vec_named(&self.store).map_err(|e| e.to_string())
    }
    fn load_store(&mut self, bytes: &[u8]) -> Result<(), String> {
        if std::mem::size_of::<M::Store>() > 0 {
            self.store = rmp_serde::from_slice(bytes).map_err(|e| e.to_string())?;
        }
        Ok(())
    }
    fn fork(&self) -> Box<dyn Block> {
        let (model, w, store) = (self.model.clone(), self.w.clone(), self.store.clone());
        Box::new(Wired::<M> { model, w, store, none: M::Yd::zero() })
    }
}
