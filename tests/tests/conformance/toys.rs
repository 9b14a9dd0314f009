//! Models that break one rule each: every check must see its own.
use linkwork_runtime::prelude::*;
use serde::{Deserialize, Serialize};
use std::sync::atomic::{AtomicU64, Ordering};

/// A number in.
#[derive(Ports, Clone, Copy, Debug)]
pub struct In {
    /// The number.
    #[port("1")]
    pub u: f64,
}
/// A number out.
#[derive(Ports, Clone, Copy, Debug)]
pub struct Out {
    /// The number.
    #[port("1")]
    pub y: f64,
}
/// A number out, under the input's name and without a unit.
#[derive(Ports, Clone, Copy, Debug)]
pub struct Clash {
    /// .
    #[port]
    pub u: f64,
    /// A unit that nobody knows.
    #[port("furlong")]
    pub far: f64,
}
/// A required number with a range.
#[derive(Params, Clone, Debug)]
pub struct Ranged {
    /// A number.
    #[param(unit = "m", range = 2.0..=4.0)]
    pub k: f64,
    /// Inner.
    pub inner: Inner,
}
/// Nested.
#[derive(Params, Clone, Debug)]
pub struct Inner {
    /// Whole.
    #[param(default = 3, range = 1.0..9.0)]
    pub n: u32,
    /// Two numbers.
    #[param(default = [1.0, 1.0], range = 0.0..)]
    pub pair: [f64; 2],
}

/// Right in every way.
pub struct Good {
    p: Ranged,
}
/// A good model.
#[model("toy.good")]
impl Model for Good {
    type Params = Ranged;
    type FeedthroughInputs = In;
    type FeedthroughOutputs = Out;
    fn feedthrough(&self, clock: &Clock, u: &In) -> Out {
        let scale = self.p.k + self.p.inner.pair[0] * f64::from(self.p.inner.n);
        Out { y: scale * u.u + clock.t }
    }
}

/// Counts its calls behind a shared reference.
pub struct Impure {
    calls: AtomicU64,
}
/// Not pure.
#[model("toy.impure")]
impl Model for Impure {
    type FeedthroughOutputs = Out;
    fn build(_: ()) -> Result<Self, BuildError> {
        Ok(Impure { calls: AtomicU64::new(0) })
    }
    fn feedthrough(&self) -> Out {
        Out { y: self.calls.fetch_add(1, Ordering::Relaxed) as f64 }
    }
}

/// A store that does not save all it holds.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub struct Leaky {
    kept: f64,
    #[serde(skip)]
    lost: f64,
}
impl Store for Leaky {}
/// Forgets.
pub struct Forgetful {}
/// Forgets a field of its store.
#[model("toy.forgetful")]
impl Model for Forgetful {
    type Inputs = In;
    type Outputs = Out;
    type Store = Leaky;
    fn outputs(&self, store: &Leaky) -> Out {
        Out { y: store.kept + store.lost }
    }
    fn update(&self, u: &In, store: &mut Leaky) {
        store.kept += u.u;
        store.lost += 1.0;
    }
}

/// Allocates.
pub struct Greedy {}
/// Makes a list at every call.
#[model("toy.greedy")]
impl Model for Greedy {
    type FeedthroughInputs = In;
    type FeedthroughOutputs = Out;
    fn feedthrough(&self, u: &In) -> Out {
        Out { y: std::hint::black_box(vec![u.u; 3]).iter().sum() }
    }
}

/// Badly labelled, and divides by zero.
pub struct Sloppy {}
/// .
#[model("toy.sloppy")]
impl Model for Sloppy {
    type FeedthroughInputs = In;
    type FeedthroughOutputs = Clash;
    fn feedthrough(&self, u: &In) -> Clash {
        Clash { u: u.u, far: (-1.0 - u.u.abs()).sqrt() }
    }
}

/// Refuses what its range allows.
pub struct Fussy {
    p: Ranged,
}
/// Refuses the end of its range.
#[model("toy.fussy")]
impl Model for Fussy {
    type Params = Ranged;
    type FeedthroughOutputs = Out;
    fn build(p: Ranged) -> Result<Self, BuildError> {
        if p.k >= 4.0 { Err(BuildError::new("too far").at("k")) } else { Ok(Fussy { p }) }
    }
    fn feedthrough(&self) -> Out {
        Out { y: self.p.k }
    }
}
