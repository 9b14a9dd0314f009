//! Toy models and a short way to write specifications.
#![allow(dead_code, clippy::unwrap_used)]
use linkwork_runtime::*;
use linkwork_spatial::Vec3;
use linkwork_surroundings::prelude::*;
use std::sync::Arc;

/// A number.
#[derive(Ports, Clone, Copy, Debug)]
pub struct One {
    /// The number.
    #[port("1")]
    pub y: f64,
}
/// A number, optional.
#[derive(Ports, Clone, Copy, Debug)]
pub struct U {
    /// The number.
    #[port("1", default = 1.0)]
    pub u: f64,
}
/// A required number.
#[derive(Ports, Clone, Copy, Debug)]
pub struct Required {
    /// The number.
    #[port("1")]
    pub u: f64,
}
/// A sum.
#[derive(Ports, Clone, Copy, Debug)]
pub struct Many {
    /// The numbers.
    #[port("1", sum)]
    pub u: f64,
}
/// A factor.
#[derive(Params, Clone, Debug)]
pub struct Factor {
    /// The factor.
    #[param(default = 1.0)]
    pub k: f64,
}
/// A state.
#[derive(State, Clone, Copy, Debug)]
pub struct X {
    /// The state.
    #[port("1")]
    pub x: f64,
}
/// A count.
#[derive(State, Clone, Copy, Debug)]
pub struct Count {
    /// Held value.
    #[port("1")]
    pub held: f64,
    /// Updates.
    #[port("1")]
    pub updates: f64,
}

macro_rules! with_factor { ($($n:ident),*) => {$(pub struct $n { p: Factor })*}; }
with_factor!(Gain, Integral, Hold, Noise, Volts, Recall, Bounce, Adder, Cosine, Square, Sampled);

/// y = k u.
#[model("t.gain")]
impl Model for Gain {
    type Params = Factor;
    type FeedthroughInputs = U;
    type FeedthroughOutputs = One;
    fn feedthrough(&self, u: &U) -> One {
        One { y: self.p.k * u.u }
    }
}
/// y = k Σ u.
#[model("t.adder")]
impl Model for Adder {
    type Params = Factor;
    type FeedthroughInputs = Many;
    type FeedthroughOutputs = One;
    fn feedthrough(&self, u: &Many) -> One {
        One { y: self.p.k * u.u }
    }
}
/// ẋ = k u, y = x.
#[model("t.integrator")]
impl Model for Integral {
    type Params = Factor;
    type Inputs = U;
    type Outputs = One;
    type State = X;
    fn outputs(&self, x: &X) -> One {
        One { y: x.x }
    }
    fn derivatives(&self, u: &U) -> X {
        X { x: self.p.k * u.u }
    }
}
/// Holds u of the sample before.
#[model("t.hold")]
impl Model for Hold {
    type Params = Factor;
    type Inputs = U;
    type Outputs = One;
    type DiscreteState = Count;
    fn outputs(&self, d: &Count) -> One {
        One { y: d.held }
    }
    fn update(&self, d: &Count, u: &U) -> Count {
        Count { held: u.u, updates: d.updates + 1.0 }
    }
}
/// White noise.
#[model("t.noise")]
impl Model for Noise {
    type Params = Factor;
    type FeedthroughOutputs = One;
    fn feedthrough(&self, clock: &Clock) -> One {
        One { y: self.p.k * clock.normal(0) }
    }
}
/// Volts.
#[derive(Ports, Clone, Copy, Debug)]
pub struct V {
    /// The voltage.
    #[port("V")]
    pub volts: f64,
}
/// Wants a voltage.
#[model("t.volts")]
impl Model for Volts {
    type Params = Factor;
    type FeedthroughInputs = V;
    type FeedthroughOutputs = One;
    fn feedthrough(&self, u: &V) -> One {
        One { y: self.p.k * u.volts }
    }
}
/// Remembers all it saw in a store.
#[model("t.recall")]
impl Model for Recall {
    type Params = Factor;
    type Inputs = U;
    type Outputs = One;
    type Store = Vec<f64>;
    fn outputs(&self, store: &[f64]) -> One {
        One { y: store.iter().sum() }
    }
    fn update(&self, u: &U, store: &mut Vec<f64>) {
        store.push(u.u);
    }
}
/// ẋ = u², runs away.
#[model("t.bounce")]
impl Model for Bounce {
    type Params = Factor;
    type Inputs = Required;
    type Outputs = One;
    type State = X;
    fn init_x(&self) -> X {
        X { x: self.p.k }
    }
    fn outputs(&self, x: &X) -> One {
        One { y: x.x }
    }
    fn derivatives(&self, u: &Required) -> X {
        X { x: u.u * u.u }
    }
}
/// A torque on a hinge from its state: τ = −k q − rate.
#[derive(Ports, Clone, Copy, Debug)]
pub struct Shaft {
    /// The hinge.
    #[port(bind = "shaft")]
    pub shaft: HingeState,
}
/// Torque.
#[derive(Ports, Clone, Copy, Debug)]
pub struct Torque {
    /// The torque.
    #[port(bind = "shaft")]
    pub torque: HingeTorque,
}
pub struct Spring {
    p: Factor,
}
/// A spring on a hinge.
#[model("t.spring")]
impl Model for Spring {
    type Params = Factor;
    type FeedthroughInputs = Shaft;
    type FeedthroughOutputs = Torque;
    fn feedthrough(&self, u: &Shaft) -> Torque {
        Torque { torque: HingeTorque(-self.p.k * u.shaft.angle) }
    }
}
/// y = cos k u.
#[model("t.cosine")]
impl Model for Cosine {
    type Params = Factor;
    type FeedthroughInputs = U;
    type FeedthroughOutputs = One;
    fn feedthrough(&self, u: &U) -> One {
        One { y: (self.p.k * u.u).cos() }
    }
}
/// y = u² + k: for k = 1 never u.
#[model("t.square")]
impl Model for Square {
    type Params = Factor;
    type FeedthroughInputs = U;
    type FeedthroughOutputs = One;
    fn feedthrough(&self, u: &U) -> One {
        One { y: u.u * u.u + self.p.k }
    }
}
/// y = k u, at its samples.
#[model("t.sampled")]
impl Model for Sampled {
    type Params = Factor;
    type FeedthroughInputs = U;
    type FeedthroughOutputs = One;
    fn feedthrough(&self, clock: &Clock, u: &U) -> One {
        One { y: self.p.k * u.u + 0.0 * clock.t }
    }
}
/// Gravity.
#[derive(Params, Clone, Debug)]
pub struct GravityParams {
    /// Acceleration.
    #[param(unit = "m/s^2")]
    pub g: Vec3,
}
pub struct Uniform(Vec3);
impl linkwork_surroundings::Gravity for Uniform {
    fn acceleration(&self, _: f64, _: Vec3) -> Vec3 {
        self.0
    }
    fn uniform(&self) -> Option<Vec3> {
        Some(self.0)
    }
}
/// Uniform gravity.
#[service("t.gravity", Gravity)]
impl Service for Uniform {
    type Params = GravityParams;
    fn build(p: GravityParams, _: &Files) -> Result<Self, BuildError> {
        Ok(Uniform(p.g))
    }
}

pub fn catalogue() -> Catalogue {
    Catalogue::new([entries()])
}

pub fn entries() -> Vec<Entry> {
    vec![
        Entry::model::<Gain>(),
        Entry::model::<Adder>(),
        Entry::model::<Integral>(),
        Entry::model::<Hold>(),
        Entry::model::<Noise>(),
        Entry::model::<Volts>(),
        Entry::model::<Recall>(),
        Entry::model::<Bounce>(),
        Entry::model::<Spring>(),
        Entry::model::<Cosine>(),
        Entry::model::<Square>(),
        Entry::model::<Sampled>(),
        Entry::service::<Uniform>(),
    ]
}

pub fn part(path: &str, model: &str, params: &[(&str, f64)], rate: Option<&str>) -> PartSpec {
    let map = params.iter().map(|(k, v)| (k.to_string(), Value::Number(*v).into())).collect();
    PartSpec {
        path: path.into(),
        model: model.into(),
        model_origin: Origin::NONE,
        params: Value::Map(map).into(),
        rate: rate.map(|r| Seconds::period(&Value::Text(r.into())).unwrap()),
        rate_origin: Origin::NONE,
        offset: Seconds::ZERO,
        origin: Origin::NONE,
        folder: None,
    }
}

pub fn wire(text: &str) -> WireSpec {
    let (from, to) = text.split_once(" -> ").unwrap();
    let end = |s: &str| {
        let (part, port) = s.rsplit_once('.').unwrap();
        PortRef { part: part.into(), port: port.into(), index: None }
    };
    WireSpec {
        from: end(from),
        to: end(to),
        timing: Default::default(),
        text: text.into(),
        origin: Origin::NONE,
    }
}

pub fn spec(parts: Vec<PartSpec>, wires: &[&str]) -> Spec {
    Spec { parts, wires: wires.iter().map(|w| wire(w)).collect(), seed: 5, ..Spec::default() }
}

pub fn plan(spec: &Spec) -> Arc<Plan> {
    Arc::new(compile(spec, &catalogue(), &Files::default()).unwrap_or_else(|e| panic!("{e}")))
}

pub fn faults(spec: &Spec) -> String {
    match compile(spec, &catalogue(), &Files::default()) {
        Ok(_) => panic!("compiled, but should not"),
        Err(faults) => faults.to_string(),
    }
}

pub fn seconds(x: f64) -> Seconds {
    Seconds::from_decimal(x).unwrap()
}
