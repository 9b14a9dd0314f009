//! The mechanism inside a simulation: order of the integrators, same bits, mistakes in bindings.
use crate::common::*;
use linkwork_multibody::{BodySpec, Builder, Coordinate, Hinge};
use linkwork_plant::*;
use linkwork_runtime::*;
use linkwork_spatial::nalgebra::Matrix3;
use linkwork_spatial::{MassProperties, Vec3};
use std::sync::Arc;

/// A swinging arm with a spring, carrying a ball-hinged weight: every kind of coordinate.
fn swing(integrator: Integrator, step: f64) -> Spec {
    let (multibody, q, v) = swinging_arm();
    let mut s = spec(
        vec![
            part("world.gravity", "t.gravity", &[], None),
            part("spring", "t.spring", &[("k", 3.0)], None),
        ],
        &[],
    );
    s.parts[0].params = Value::Map(vec![(
        "g".into(),
        Value::List(vec![
            Value::Number(0.0).into(),
            Value::Number(0.0).into(),
            Value::Number(-3.71).into(),
        ])
        .into(),
    )])
    .into();
    s.binds.push(BindSpec {
        part: "spring".into(),
        bind: "shaft".into(),
        target: BindTarget::Hinge { body: "arm".into(), index: 0 },
        origin: Origin::NONE,
    });
    s.set_mechanism(MechanismSpec::new("Mechanism", multibody, q, v));
    s.integrator = integrator;
    s.step = seconds(step);
    s
}

fn final_x(integrator: Integrator, step: f64) -> Vec<f64> {
    let mut sim = Simulation::new(plan(&swing(integrator, step)));
    sim.run_until(seconds(2.0)).unwrap();
    sim.state().x.clone()
}

fn distance(a: &[f64], b: &[f64]) -> f64 {
    let d = a.iter().zip(b).map(|(a, b)| (a - b).powi(2)).sum::<f64>().sqrt();
    assert!(d.is_finite());
    d
}

#[test]
fn each_integrator_has_its_order_on_the_whole_system() {
    let reference = final_x(Integrator::Verner, 0.005);
    for (integrator, steps, expected) in [
        (Integrator::Rk4, [0.02, 0.01], 4.0),
        (Integrator::SemiImplicitEuler, [0.001, 0.000_5], 1.0),
        (Integrator::BogackiShampine, [0.02, 0.01], 3.0),
        (Integrator::DormandPrince, [0.04, 0.02], 5.0),
        (Integrator::Verner, [0.1, 0.05], 8.0),
        (Integrator::Rodas, [0.02, 0.01], 4.0),
    ] {
        // `accuracy: None` takes one step from row to row, so the step size is the one in the file.
        let e = steps.map(|h| distance(&final_x(integrator, h), &reference));
        let order = (e[0] / e[1]).log2();
        println!("{integrator:?}: order {order:.3}, errors {e:?}");
        assert!((order - expected).abs() < 0.5, "{integrator:?}: order {order}, errors {e:?}");
    }
}

#[test]
fn checkpoints_and_chunks_keep_the_bits_of_the_mechanism() {
    for integrator in [Integrator::Rk4, Integrator::SemiImplicitEuler] {
        let plan = plan(&swing(integrator, 0.001));
        let mut whole = Simulation::new(plan.clone());
        whole.run_until(seconds(2.0)).unwrap();
        let mut half = Simulation::new(plan.clone());
        half.run_until(seconds(0.731)).unwrap();
        let saved = half.checkpoint("").unwrap();
        let mut restored = Simulation::new(plan);
        restored.run_until(seconds(0.2)).unwrap();
        restored.restore(&saved).unwrap();
        let mut forked = half.fork();
        for sim in [&mut restored, &mut forked, &mut half] {
            sim.run_until(seconds(2.0)).unwrap();
            assert_eq!(sim.hash(), whole.hash());
        }
    }
}

#[test]
fn coordinates_are_variables_named_by_their_body() {
    let mut sim = Simulation::new(plan(&swing(Integrator::Rk4, 0.001)));
    assert_eq!(sim.get("arm.angle").unwrap(), 0.8);
    assert_eq!(sim.get("arm.rate").unwrap(), 0.3);
    assert_eq!(sim.get("weight.rotation.w").unwrap(), 1.0);
    sim.set("arm.angle", -0.2).unwrap();
    assert_eq!(sim.get("spring.torque").unwrap(), 0.6000000000000001);
}

#[test]
fn bindings_that_match_nothing_are_refused() {
    let mut s = swing(Integrator::Rk4, 0.001);
    s.binds[0].target = BindTarget::Hinge { body: "arn".into(), index: 0 };
    assert!(faults(&s).contains("there is no body `arn`\n  help: did you mean `arm`?"));
    s.binds[0].target = BindTarget::Hinge { body: "weight".into(), index: 0 };
    assert!(faults(&s).contains("the hinge of `weight` has 0 one-dof coordinates, not 1"));
    s.binds[0].target = BindTarget::Node("arm/tip".into());
    assert!(faults(&s).contains("binding `shaft` is served by a hinge"));
    s.binds[0].bind = "shaftt".into();
    assert!(faults(&s).contains("has no binding `shaftt`\n  help: did you mean `shaft`?"));
}

#[test]
fn what_is_probably_not_meant_is_a_warning() {
    let free = |gravity: Option<&str>, parts: Vec<PartSpec>| {
        let mut b = Builder::new();
        let solid = MassProperties::new(1.3, Vec3::zeros(), Matrix3::identity());
        b.body(BodySpec::new("rock", "world").hinge(Hinge::free()).mass(solid));
        let multibody = Arc::new(b.build().unwrap());
        let (q, v) = (multibody.neutral_q(), vec![0.0; 6]);
        let mut s = spec(parts, &[]);
        s.set_mechanism(MechanismSpec {
            gravity: gravity.map(Into::into),
            ..MechanismSpec::new("Mechanism", multibody, q, v)
        });
        plan(&s).warnings.iter().map(|w| format!("{} {:?}", w.message, w.help)).collect::<Vec<_>>()
    };
    let [told] = &free(None, vec![])[..] else { panic!("one warning") };
    assert!(told.contains("`rock` is free") && told.contains("gravity: \\\"none\\\""), "{told}");
    assert!(free(Some("none"), vec![]).is_empty());
    // A motion for a free hinge is an error; a torque on a prescribed hinge is a warning.
    let mut s = swing(Integrator::Rk4, 0.001);
    let m = s.mechanism_mut().unwrap();
    let arm = m.multibody.body("arm").unwrap();
    let held = (*m.multibody).clone().with_coordinate(arm, Coordinate::Prescribed);
    m.multibody = Arc::new(held);
    let warnings: Vec<String> = plan(&s).warnings.iter().map(|w| w.message.clone()).collect();
    assert!(warnings.iter().any(|w| w.contains("`hinge arm` is prescribed")), "{warnings:?}");
}

/// Semi-implicit Euler knows that the velocity of a free body has axes that turn.
#[test]
fn what_tumbles_flies_straight_with_semi_implicit_euler() {
    let mut b = Builder::new();
    let inertia = Matrix3::from_diagonal(&Vec3::new(0.1, 0.3, 0.2));
    b.body(BodySpec::new("stone", "world").hinge(Hinge::free()).mass(MassProperties::new(
        2.0,
        Vec3::zeros(),
        inertia,
    )));
    let multibody = Arc::new(b.build().unwrap());
    let q = multibody.neutral_q();
    let v = vec![3.0, 20.0, -5.0, 1.0, 2.0, 3.0];
    let mechanism = MechanismSpec::new("Mechanism", multibody, q, v);
    let spec = Spec {
        host: Some(Box::new(mechanism)),
        integrator: Integrator::SemiImplicitEuler,
        step: Seconds::new(1, 1000).unwrap(),
        ..Spec::default()
    };
    let plan = Arc::new(compile(&spec, &catalogue(), &Files::default()).unwrap());
    let mut sim = Simulation::new(plan);
    sim.run_until(Seconds::new(2, 1).unwrap()).unwrap();
    for (axis, want) in [("x", 2.0), ("y", 4.0), ("z", 6.0)] {
        let at = sim.get(&format!("stone.position.{axis}")).unwrap();
        // Measured: 11 mm of 7.5 m, because ω changes within a step. With v + h (a − ω × v) alone, the
        // error is several metres.
        assert!((at - want).abs() < 2e-2, "{axis}: {at}, not {want}");
    }
}

/// It is made when somebody asks first: neither how a machine is put down before, nor a run, leaves a trace in it.
#[test]
fn the_hash_of_a_plan_is_the_same_whenever_it_is_asked() {
    let swinging = || plan(&swing(Integrator::Rk4, 0.01));
    let early = swinging();
    let hash = early.hash();
    let mut late = swinging();
    Arc::get_mut(&mut late).unwrap().mechanism_mut().unwrap().q[0] += 0.1;
    let mut sim = Simulation::new(late.clone());
    sim.run_until(seconds(0.1)).unwrap();
    assert_eq!(sim.program().hash(), hash);
    assert_eq!((early.hash(), late.hash()), (hash, hash));
    assert_ne!(plan(&swing(Integrator::Rk4, 0.02)).hash(), hash);
}

/// So many pendulums, each with two springs, and two models that are wired to each other.
fn pendulums(count: usize) -> Spec {
    let mut b = Builder::new();
    let inertia = Matrix3::from_diagonal(&Vec3::new(0.11, 0.23, 0.19));
    let (mut parts, mut wires, mut binds) = (Vec::new(), Vec::new(), Vec::new());
    for k in 1000..1000 + count {
        let mass = MassProperties::new(1.3, [0.1, 0.02, -0.6].into(), inertia);
        b.body(BodySpec::new(format!("b{k}"), "world").hinge(Hinge::pin(Vec3::y())).mass(mass));
        for spring in ["left", "right"] {
            let path = format!("b{k}.{spring}");
            parts.push(part(&path, "t.spring", &[("k", 3.0)], None));
            binds.push(BindSpec {
                part: path,
                bind: "shaft".into(),
                target: BindTarget::Hinge { body: format!("b{k}"), index: 0 },
                origin: Origin::NONE,
            });
        }
        parts.push(part(&format!("b{k}.gain"), "t.gain", &[], None));
        parts.push(part(&format!("b{k}.sum"), "t.integrator", &[], None));
        wires.push(wire(&format!("b{k}.gain.y -> b{k}.sum.u")));
        wires.push(wire(&format!("b{k}.sum.y -> b{k}.gain.u")));
    }
    let multibody = Arc::new(b.build().unwrap());
    let (q, v) = (multibody.neutral_q(), vec![0.0; multibody.nv()]);
    let mut s = Spec { parts, wires, binds, ..spec(Vec::new(), &[]) };
    let mut mechanism = MechanismSpec::new("Mechanism", multibody, q, v);
    mechanism.gravity = Some("none".into());
    s.set_mechanism(mechanism);
    s
}

/// What is looked for one by one through all ports of a mechanism, or gathered anew for each wire, is quadratic in memory that
/// is asked for, too. What is compared and not kept is seen by `tests/benches/space.rs` alone.
#[test]
fn the_work_of_compiling_grows_with_the_number_of_parts_and_no_faster() {
    let catalogue = catalogue();
    let asked = |count: usize| {
        let (spec, files) = (pendulums(count), Files::default());
        let info = allocation_counter::measure(|| {
            compile(&spec, &catalogue, &files).unwrap();
        });
        [info.count_total, info.bytes_total].map(|n| n as f64 / count as f64)
    };
    let (few, many) = (asked(100), asked(1600));
    println!("allocations and bytes a pendulum: {few:?} of 100, {many:?} of 1600");
    // Allow some growth per pendulum: vectors double their capacity, and leaves of B-trees may be half full.
    assert!(many[0] < 1.1 * few[0], "{few:?}, {many:?}");
    assert!(many[1] < 1.3 * few[1], "{few:?}, {many:?}");
}
