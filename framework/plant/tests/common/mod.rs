//! Models on hinges and nodes, and a short way to write specifications.
#![allow(dead_code, clippy::unwrap_used)]
#[path = "../../../runtime/tests/common/mod.rs"]
mod toys;
use linkwork_multibody::{BodySpec, Builder, Hinge, Multibody};
use linkwork_runtime::prelude::*;
use linkwork_runtime::*;
use linkwork_spatial::nalgebra::Matrix3;
use linkwork_spatial::{MassProperties, Pose, Vec3};
use std::sync::Arc;
pub use toys::*;

/// A node's acceleration.
#[derive(Ports, Clone, Copy, Debug)]
pub struct Accelerated {
    /// The node.
    #[port(bind = "body")]
    pub body: NodeAccel,
}
pub struct Felt {
    p: Factor,
}
/// k times the acceleration of a node along x.
#[model("t.felt")]
impl Model for Felt {
    type Params = Factor;
    type FeedthroughInputs = Accelerated;
    type FeedthroughOutputs = One;
    fn feedthrough(&self, u: &Accelerated) -> One {
        One { y: self.p.k * u.body.linear.x }
    }
}
/// A force on a node.
#[derive(Ports, Clone, Copy, Debug)]
pub struct Pushed {
    /// The force.
    #[port(bind = "body")]
    pub load: Wrench,
}
pub struct Push {
    p: Factor,
}
/// A force of k u along x.
#[model("t.push")]
impl Model for Push {
    type Params = Factor;
    type FeedthroughInputs = U;
    type FeedthroughOutputs = Pushed;
    fn feedthrough(&self, u: &U) -> Pushed {
        Pushed { load: Wrench { force: Vec3::x() * (self.p.k * u.u), moment: Vec3::zeros() } }
    }
}
pub fn catalogue() -> Catalogue {
    let own = vec![Entry::model::<Felt>(), Entry::model::<Push>()];
    Catalogue::new([toys::entries(), own])
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

/// An arm on a pin, carrying a weight on a ball hinge, and how it starts: every kind of coordinate.
pub fn swinging_arm() -> (Arc<Multibody>, Vec<f64>, Vec<f64>) {
    let mut b = Builder::new();
    let solid = |m: f64, c: [f64; 3]| {
        MassProperties::new(m, c.into(), Matrix3::from_diagonal(&Vec3::new(0.11, 0.23, 0.19)))
    };
    b.body(
        BodySpec::new("arm", "world")
            .hinge(Hinge::pin(Vec3::new(0.0, 1.0, 0.0)))
            .mass(solid(1.3, [0.1, 0.02, -0.6])),
    );
    b.body(
        BodySpec::new("weight", "arm")
            .hinge_in_parent(Pose::translation(0.0, 0.0, -1.0))
            .hinge(Hinge::ball())
            .mass(solid(0.7, [0.05, -0.1, -0.3])),
    );
    b.node("arm/tip", "arm", Pose::translation(0.0, 0.0, -1.0));
    let multibody = Arc::new(b.build().unwrap());
    let mut q = multibody.neutral_q();
    q[0] = 0.8;
    (multibody, q, vec![0.3, 1.0, -0.7, 0.4])
}
