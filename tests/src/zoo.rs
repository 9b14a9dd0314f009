//! A medium system that uses every container of a state: three sample rates (one with an offset),
//! continuous states, a store, noise, reductions, a node wrench, hinge torques, and a mechanism
//! with pin, ball and free hinges under gravity.
use linkwork_multibody::{BodySpec, Builder, Hinge};
use linkwork_plant::MechanismSpec;
use linkwork_runtime::*;
use linkwork_spatial::{MassProperties, Mat3, Pose};
use linkwork_surroundings::prelude::*;
use serde::{Deserialize, Serialize};
use std::sync::Arc;

/// A factor.
#[derive(Params, Clone, Debug)]
pub struct Factor {
    /// The factor.
    #[param(default = 1.0, range = -100.0..=100.0)]
    pub k: f64,
}
/// One number in.
#[derive(Ports, Clone, Copy, Debug)]
pub struct In {
    /// The number.
    #[port("1", default = 0.5)]
    pub u: f64,
}
/// Many numbers in.
#[derive(Ports, Clone, Copy, Debug)]
pub struct Many {
    /// The numbers.
    #[port("1", sum)]
    pub u: f64,
}
/// One number out.
#[derive(Ports, Clone, Copy, Debug)]
pub struct Out {
    /// The number.
    #[port("1")]
    pub y: f64,
}
/// One number kept.
#[derive(State, Clone, Copy, Debug)]
pub struct One {
    /// The number.
    #[port("1")]
    pub x: f64,
}
/// A hinge.
#[derive(Ports, Clone, Copy, Debug)]
pub struct Shaft {
    /// The hinge.
    #[port(bind = "shaft")]
    pub shaft: HingeState,
    /// Wanted angle.
    #[port("1", default = 0.0)]
    pub wanted: f64,
}
/// Torque on a hinge.
#[derive(Ports, Clone, Copy, Debug)]
pub struct Torque {
    /// The torque.
    #[port(bind = "shaft")]
    pub torque: HingeTorque,
}
/// A node and a throttle.
#[derive(Ports, Clone, Copy, Debug)]
pub struct Mount {
    /// The node.
    #[port(bind = "mount")]
    pub mount: NodeState,
    /// Throttle.
    #[port("1", default = 0.0)]
    pub throttle: f64,
}
/// Force on a node.
#[derive(Ports, Clone, Copy, Debug)]
pub struct Push {
    /// The force.
    #[port(bind = "mount")]
    pub wrench: Wrench,
}
/// Specific force.
#[derive(Ports, Clone, Copy, Debug)]
pub struct Feel {
    /// Acceleration of the node.
    #[port(bind = "mount")]
    pub accel: NodeAccel,
}

macro_rules! with_factor { ($($(#[$doc:meta])* $n:ident),*) => {$($(#[$doc])* pub struct $n { p: Factor })*}; }
with_factor!(
    /// y = k Σ u.
    Sum,
    /// Lag.
    Lag,
    /// Sample and hold.
    Hold,
    /// Noise.
    Noise,
    /// Mean of the last samples.
    Mean,
    /// Spring.
    Spring,
    /// Thruster with drag.
    Thruster,
    /// Accelerometer.
    Accelerometer
);

/// y = k Σ u.
#[model("zoo.sum")]
impl Model for Sum {
    type Params = Factor;
    type FeedthroughInputs = Many;
    type FeedthroughOutputs = Out;
    fn feedthrough(&self, u: &Many) -> Out {
        Out { y: self.p.k * u.u }
    }
}
/// ẋ = k u − x.
#[model("zoo.lag")]
impl Model for Lag {
    type Params = Factor;
    type Inputs = In;
    type Outputs = Out;
    type State = One;
    fn outputs(&self, x: &One) -> Out {
        Out { y: x.x }
    }
    fn derivatives(&self, x: &One, u: &In) -> One {
        One { x: self.p.k * u.u - x.x }
    }
}
/// Holds k u of the sample before.
#[model("zoo.hold")]
impl Model for Hold {
    type Params = Factor;
    type Inputs = In;
    type Outputs = Out;
    type DiscreteState = One;
    fn outputs(&self, d: &One) -> Out {
        Out { y: d.x }
    }
    fn update(&self, u: &In) -> One {
        One { x: self.p.k * u.u }
    }
}
/// White noise, sampled.
#[model("zoo.noise")]
impl Model for Noise {
    type Params = Factor;
    type FeedthroughOutputs = Out;
    fn feedthrough(&self, clock: &Clock) -> Out {
        Out { y: self.p.k * clock.normal(0) }
    }
}
/// The last eight samples.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub struct Ring {
    samples: Vec<f64>,
    next: usize,
}
impl Store for Ring {}
/// Mean of the last eight samples, times k.
#[model("zoo.mean")]
impl Model for Mean {
    type Params = Factor;
    type Inputs = In;
    type Outputs = Out;
    type Store = Ring;
    fn init_store(&self) -> Ring {
        Ring { samples: vec![0.0; 8], next: 0 }
    }
    fn outputs(&self, store: &Ring) -> Out {
        Out { y: self.p.k * store.samples.iter().sum::<f64>() / 8.0 }
    }
    fn update(&self, u: &In, store: &mut Ring) {
        store.samples[store.next] = u.u;
        store.next = (store.next + 1) % store.samples.len();
    }
}
/// τ = −k (q − wanted) − 0.1 q̇.
#[model("zoo.spring")]
impl Model for Spring {
    type Params = Factor;
    type FeedthroughInputs = Shaft;
    type FeedthroughOutputs = Torque;
    fn feedthrough(&self, u: &Shaft) -> Torque {
        let torque = -self.p.k * (u.shaft.angle - u.wanted) - 0.1 * u.shaft.rate;
        Torque { torque: HingeTorque(torque) }
    }
}
/// A force along the node's z, and drag.
#[model("zoo.thruster")]
impl Model for Thruster {
    type Params = Factor;
    type FeedthroughInputs = Mount;
    type FeedthroughOutputs = Push;
    fn feedthrough(&self, u: &Mount) -> Push {
        let thrust = u.mount.rotation * Vec3::z() * (self.p.k * (1.0 + u.throttle));
        let drag = -u.mount.velocity * (0.05 * u.mount.velocity.norm());
        Push { wrench: Wrench { moment: -u.mount.angular * 0.02, force: thrust + drag } }
    }
}
/// k times the length of the node's acceleration.
#[model("zoo.accelerometer")]
impl Model for Accelerometer {
    type Params = Factor;
    type FeedthroughInputs = Feel;
    type FeedthroughOutputs = Out;
    fn feedthrough(&self, u: &Feel) -> Out {
        Out { y: self.p.k * u.accel.linear.norm() }
    }
}
/// Acceleration.
#[derive(Params, Clone, Debug)]
pub struct FieldParams {
    /// Downwards, W.
    #[param(unit = "m/s^2", default = 3.71, range = 0.0..)]
    pub g: f64,
}
/// Gravity that is weaker higher up.
pub struct Field(f64);
impl Gravity for Field {
    fn acceleration(&self, _: f64, p: Vec3) -> Vec3 {
        Vec3::new(0.0, 0.0, -self.0 * (1.0 - 1e-3 * p.z))
    }
}
/// Gravity that is weaker higher up.
#[service("zoo.gravity", Gravity)]
impl Service for Field {
    type Params = FieldParams;
    fn build(p: FieldParams, _: &Files) -> Result<Self, BuildError> {
        Ok(Field(p.g))
    }
}

/// The toy models.
pub fn catalogue() -> Catalogue {
    Catalogue::new([vec![
        Entry::model::<Sum>(),
        Entry::model::<Lag>(),
        Entry::model::<Hold>(),
        Entry::model::<Noise>(),
        Entry::model::<Mean>(),
        Entry::model::<Spring>(),
        Entry::model::<Thruster>(),
        Entry::model::<Accelerometer>(),
        Entry::service::<Field>(),
    ]])
}

fn seconds(num: u64, den: u64) -> Seconds {
    Seconds { num, den }
}

/// A part with one parameter `k`.
pub fn part(path: &str, model: &str, k: Option<f64>, rate: Option<Seconds>) -> PartSpec {
    let params = k.map(|k| ("k".to_string(), Value::Number(k).into()));
    PartSpec {
        path: path.into(),
        model: model.into(),
        model_origin: Origin::NONE,
        params: Value::Map(params.into_iter().collect()).into(),
        rate,
        rate_origin: Origin::NONE,
        offset: Seconds::ZERO,
        origin: Origin::NONE,
        folder: None,
    }
}

/// A wire between two paths of ports.
pub fn wire(from: &str, to: &str) -> WireSpec {
    let end = |s: &str| {
        let (part, port) = s.rsplit_once('.').unwrap_or(("", s));
        PortRef { part: part.into(), port: port.into(), index: None }
    };
    WireSpec {
        from: end(from),
        to: end(to),
        timing: Default::default(),
        text: format!("{from} -> {to}"),
        origin: Origin::NONE,
    }
}

fn mechanism() -> MechanismSpec {
    let solid = |m: f64, c: [f64; 3], i: [f64; 3]| {
        MassProperties::new(m, c.into(), Mat3::from_diagonal(&Vec3::from(i)))
    };
    let mut b = Builder::new();
    b.body(BodySpec::new("base", "world").hinge(Hinge::free()).mass(solid(
        5.0,
        [0.02, -0.01, 0.03],
        [0.3, 0.4, 0.5],
    )));
    b.body(
        BodySpec::new("arm", "base")
            .hinge_in_parent(Pose::translation(0.2, 0.1, -0.1))
            .hinge(Hinge::pin(Vec3::new(0.1, 1.0, 0.2)).armature(0.01))
            .mass(solid(1.3, [0.1, 0.02, -0.4], [0.11, 0.13, 0.09])),
    );
    b.body(
        BodySpec::new("weight", "arm")
            .hinge_in_parent(Pose::translation(0.0, 0.0, -0.8))
            .hinge(Hinge::ball())
            .mass(solid(0.7, [0.05, -0.1, -0.2], [0.05, 0.06, 0.07])),
    );
    b.node("base/engine", "base", Pose::translation(0.0, 0.05, -0.2));
    b.node("arm/tip", "arm", Pose::translation(0.0, 0.0, -0.8));
    let multibody = Arc::new(b.build().unwrap_or_else(|e| panic!("{e}")));
    let (q, v) = (multibody.random_q(11), multibody.random_v(12));
    MechanismSpec::new("mechanism", multibody, q, v)
}

/// The system. Steps of 2 ms; rates of 1/50, 1/30 (offset 1/90) and 1/8 s.
pub fn system(integrator: Integrator, seed: u64) -> Spec {
    let bind = |part: &str, bind: &str, target: BindTarget| BindSpec {
        part: part.into(),
        bind: bind.into(),
        target,
        origin: Origin::NONE,
    };
    let mut parts = vec![
        part("world.gravity", "zoo.gravity", None, None),
        part("a.noise", "zoo.noise", Some(0.3), Some(seconds(1, 50))),
        part("a.sum", "zoo.sum", Some(0.7), None),
        part("b.lag", "zoo.lag", Some(0.9), None),
        part("b.slow", "zoo.lag", Some(-0.4), None),
        part("c.hold", "zoo.hold", Some(1.1), Some(seconds(1, 30))),
        part("c.mean", "zoo.mean", Some(0.8), Some(seconds(1, 8))),
        part("d.spring", "zoo.spring", Some(3.0), None),
        part("d.engine", "zoo.thruster", Some(12.0), None),
        part("d.feel", "zoo.accelerometer", Some(0.02), Some(seconds(1, 50))),
    ];
    parts[5].offset = seconds(1, 90);
    Spec {
        parts,
        wires: vec![
            wire("a.noise.y", "a.sum.u"),
            wire("b.slow.y", "a.sum.u"),
            wire("c.mean.y", "a.sum.u"),
            wire("d.feel.y", "a.sum.u"),
            wire("a.sum.y", "b.lag.u"),
            wire("b.lag.y", "b.slow.u"),
            wire("b.lag.y", "c.hold.u"),
            wire("c.hold.y", "c.mean.u"),
            wire("c.hold.y", "d.spring.wanted"),
            wire("b.slow.y", "d.engine.throttle"),
        ],
        binds: vec![
            bind("d.spring", "shaft", BindTarget::Hinge { body: "arm".into(), index: 0 }),
            bind("d.engine", "mount", BindTarget::Node("base/engine".into())),
            bind("d.feel", "mount", BindTarget::Node("arm/tip".into())),
        ],
        host: Some(Box::new(mechanism())),
        accuracy: None,
        step: seconds(1, 500),
        integrator,
        seed,
    }
}

/// A specification, compiled with the toy models.
///
/// # Panics
/// When it does not compile, with all the faults.
pub fn plan(spec: &Spec) -> Arc<Plan> {
    match compile(spec, &catalogue(), &Files::default()) {
        Ok(plan) => Arc::new(plan),
        Err(faults) => panic!("{faults}"),
    }
}
