//! The mechanism with functions of the runtime: algebraic loops through accelerations, pins of coordinates.
use crate::common::*;
use linkwork_multibody::{BodySpec, Builder, Hinge};
use linkwork_plant::*;
use linkwork_runtime::*;
use linkwork_spatial::nalgebra::Matrix3;
use linkwork_spatial::{MassProperties, Vec3};
use std::sync::Arc;

fn solved(text: &str) -> WireSpec {
    WireSpec { timing: WireTiming::Solved { tolerance: 1e-12 }, ..wire(text) }
}

#[test]
fn a_force_against_acceleration_is_added_mass() {
    // A force of 3 N pushes a body of 2 kg through a fluid with an added mass of 5 kg. Fixed-point
    // iteration would diverge.
    let mut b = Builder::new();
    b.body(
        BodySpec::new("body", "world").hinge(Hinge::slider(Vec3::x())).mass(MassProperties::new(
            2.0,
            Vec3::zeros(),
            Matrix3::identity(),
        )),
    );
    let multibody = Arc::new(b.build().unwrap());
    let mut s = spec(
        vec![
            part("felt", "t.felt", &[], None),
            part("one", "t.integrator", &[("k", 0.0)], None),
            part("fluid", "t.push", &[("k", -5.0)], None),
            part("drive", "t.push", &[("k", 3.0)], None),
        ],
        &[],
    );
    s.wires.push(solved("felt.y -> fluid.u"));
    for name in ["felt", "fluid", "drive"] {
        s.binds.push(BindSpec {
            part: name.into(),
            bind: "body".into(),
            target: BindTarget::Node("body".into()),
            origin: Origin::NONE,
        });
    }
    s.set_mechanism(MechanismSpec::new("Mechanism", multibody, vec![0.0], vec![0.0]));
    let mut sim = Simulation::new(plan(&s));
    sim.run_until(seconds(2.0)).unwrap();
    assert!((sim.get("felt.y").unwrap() - 3.0 / 7.0).abs() < 1e-11);
    assert!((sim.get("body.speed").unwrap() - 6.0 / 7.0).abs() < 1e-11);
}

/// An arm on a pin with a weight on a ball hinge.
fn arm(method: Integrator) -> Spec {
    let (multibody, q, v) = swinging_arm();
    let mut s = spec(vec![], &[]);
    s.set_mechanism(MechanismSpec::new("Mechanism", multibody, q, v));
    s.integrator = method;
    s
}

#[test]
fn hinges_are_pinned_and_rotations_are_not() {
    for (_, method) in Integrator::ALL {
        let mut sim = Simulation::new(plan(&arm(method)));
        for path in ["weight.rotation.x", "weight.rotation.w"] {
            let e = sim.pin(path, 0.5).unwrap_err();
            assert!(e.message.contains("couples it to other numbers"), "{e}");
        }
        // The rate is pinned, and the angle increases with it.
        sim.pin("arm.rate", 0.5).unwrap();
        sim.run_until(seconds(1.0)).unwrap();
        assert!((sim.get("arm.angle").unwrap() - 1.3).abs() < 1e-9, "{method:?}");
        assert_eq!(sim.get("arm.rate").unwrap(), 0.5);
        let angle = sim.get("arm.angle").unwrap();
        sim.pin("arm.angle", angle).unwrap();
        sim.run_until(seconds(2.0)).unwrap();
        assert_eq!(sim.get("arm.angle").unwrap().to_bits(), angle.to_bits(), "{method:?}");
        // The mechanism integrates the pinned acceleration.
        sim.unpin("arm.rate").unwrap();
        sim.unpin("arm.angle").unwrap();
        sim.pin("arm.acceleration", -1.0).unwrap();
        sim.run_until(seconds(2.5)).unwrap();
        assert!((sim.get("arm.rate").unwrap() - 0.0).abs() < 1e-9, "{method:?}");
    }
}
