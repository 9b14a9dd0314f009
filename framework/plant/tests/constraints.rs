//! Loops, couplings and contact inside a simulation: order, drift, same bits, mistakes.
use crate::common::*;
use linkwork_collision::{ColliderSpec, Colliders, Material, Rules, Shape};
use linkwork_multibody::{BodySpec, Builder, Coordinate, Hinge, LoopClosure, Multibody};
use linkwork_plant::*;
use linkwork_runtime::*;
use linkwork_solvers::{ConstraintMethod, ContactSettings};
use linkwork_spatial::{MassProperties, Mat3, Pose, Vec3};
use std::sync::Arc;

fn gravity() -> PartSpec {
    let mut g = part("world.gravity", "t.gravity", &[], None);
    let number = |x: f64| Value::Number(x).into();
    let down = Value::List(vec![number(0.0), number(0.0), number(-9.81)]);
    g.params = Value::Map(vec![("g".into(), down.into())]).into();
    g
}

/// A four-bar of unequal bars in the xz plane, its coupler closed by a pin, and how it starts.
fn four_bar(driven: bool) -> (Multibody, Vec<f64>) {
    let mut b = Builder::new();
    let bar = |l: f64| {
        let J = Mat3::from_diagonal(&Vec3::new(1e-3, l * l / 12.0, l * l / 12.0));
        MassProperties::new(1.0, Vec3::new(l / 2.0, 0.0, 0.0), J)
    };
    let pin = || Hinge::pin(Vec3::y());
    b.body(BodySpec::new("crank", "world").hinge(pin()).mass(bar(0.4)));
    b.body(
        BodySpec::new("coupler", "crank")
            .hinge_in_parent(Pose::translation(0.4, 0.0, 0.0))
            .hinge(pin())
            .mass(bar(1.0)),
    );
    b.body(
        BodySpec::new("rocker", "world")
            .hinge_in_parent(Pose::translation(1.0, 0.0, 0.0))
            .hinge(pin())
            .mass(bar(0.8)),
    );
    let mut hinge = pin();
    if driven {
        hinge.subhinges[0].coordinate = Coordinate::Prescribed;
    }
    b.loop_closure(LoopClosure {
        name: "joint".into(),
        body_a: "rocker".into(),
        frame_a: Pose::translation(0.8, 0.0, 0.0),
        body_b: "coupler".into(),
        frame_b: Pose::translation(1.0, 0.0, 0.0),
        hinge,
    });
    (b.build().unwrap(), START.to_vec())
}

/// Roughly: the start is closed by `compile`.
const START: [f64; 3] = [-1.2, 0.5, -1.8];

/// The start with a turning crank, closed: coordinates and rates.
fn closed() -> (Vec<f64>, Vec<f64>) {
    let (mbs, q) = four_bar(false);
    let mut s = spec(vec![gravity()], &[]);
    s.set_mechanism(MechanismSpec::new("Linkage", Arc::new(mbs), q, vec![2.0, 0.0, 0.0]));
    let x = Simulation::new(plan(&s)).state().x.clone();
    (x[..3].to_vec(), x[3..].to_vec())
}

fn linkage(constraint_method: ConstraintMethod, integrator: Integrator, step: f64) -> Spec {
    let (mbs, (q, v)) = (four_bar(false).0, closed());
    let mut s = spec(vec![gravity()], &[]);
    let mut m = MechanismSpec::new("Linkage", Arc::new(mbs), q, v);
    m.constraint_methods.insert("joint".into(), constraint_method);
    s.set_mechanism(m);
    s.integrator = integrator;
    s.step = seconds(step);
    s
}

const BOTH: [ConstraintMethod; 2] = [ConstraintMethod::Augment, ConstraintMethod::Embed];

#[test]
fn loops_keep_the_order_and_do_not_drift() {
    for constraint_method in BOTH {
        let end = |integrator, step| {
            let mut sim = Simulation::new(plan(&linkage(constraint_method, integrator, step)));
            sim.run_until(seconds(1.0)).unwrap();
            assert!(sim.get("Linkage.joint.error").unwrap() < 1e-11);
            sim.state().x.clone()
        };
        let reference = end(Integrator::Rk4, 0.0005);
        for (integrator, steps, want) in [
            (Integrator::Rk4, [0.004, 0.002], 4.0),
            (Integrator::SemiImplicitEuler, [0.001, 0.0005], 1.0),
        ] {
            let e = steps.map(|h| {
                let x = end(integrator, h);
                x.iter().zip(&reference).map(|(a, b)| (a - b).powi(2)).sum::<f64>().sqrt()
            });
            let order = (e[0] / e[1]).log2();
            // Measured orders: 4.6 and 1.0.
            assert!(
                (order - want).abs() < 0.7,
                "{constraint_method:?} {integrator:?}: {order} {e:?}"
            );
        }
    }
}

#[test]
fn forces_of_loops_are_variables() {
    let force = |constraint_method| {
        let mut sim = Simulation::new(plan(&linkage(constraint_method, Integrator::Rk4, 0.001)));
        sim.run_until(seconds(0.3)).unwrap();
        (0..3).map(|i| sim.get(&format!("Linkage.joint.force[{i}]")).unwrap()).collect::<Vec<_>>()
    };
    let (a, b) = (force(ConstraintMethod::Augment), force(ConstraintMethod::Embed));
    // Compare only components in the plane, because the force across the plane belongs to a
    // redundant row and is not unique.
    let plane = |f: &[f64]| [f[0], f[2]];
    let scale = plane(&a).iter().fold(0.0_f64, |m, x| m.max(x.abs()));
    assert!(scale > 1.0, "{a:?}");
    for (x, y) in plane(&a).iter().zip(plane(&b)) {
        assert!((x - y).abs() < 1e-6 * scale, "{a:?} {b:?}");
    }
}

#[test]
fn loops_that_cannot_close_are_refused() {
    let mut s = linkage(ConstraintMethod::Auto, Integrator::Rk4, 0.001);
    let (mbs, q) = four_bar(false);
    let mut b = Builder::from(&mbs);
    b.loops_mut()[0].frame_a = Pose::translation(3.0, 0.0, 0.0);
    let m = s.mechanism_mut().unwrap();
    *m = MechanismSpec::new("Linkage", Arc::new(b.build().unwrap()), q, vec![0.0; 3]);
    let text = faults(&s);
    assert!(text.contains("does not close: an error of"), "{text}");
    assert!(text.contains("help: start nearer"), "{text}");
}

/// A prescribed pin in the loop turns at the rate that it was given.
#[test]
fn loop_motions_are_states() {
    let (mbs, q) = four_bar(true);
    let mut s = spec(vec![gravity()], &[]);
    let mut m = MechanismSpec::new("Linkage", Arc::new(mbs), q, vec![0.0; 3]);
    // Use the angle of the closed configuration, so that the loop closes at the start.
    let x = closed().0;
    let angle = x[0] + x[1] - x[2];
    m.motions[0].position = angle;
    m.motions[0].rate = 0.5;
    m.q.clone_from(&x);
    s.set_mechanism(m);
    s.step = seconds(0.001);
    let mut sim = Simulation::new(plan(&s));
    sim.run_until(seconds(0.4)).unwrap();
    let now = sim.state().x.clone();
    assert!((sim.get("Linkage.joint.position").unwrap() - angle - 0.2).abs() < 1e-12);
    assert!((now[0] + now[1] - now[2] - angle - 0.2).abs() < 1e-9);
    assert!(sim.get("Linkage.joint.error").unwrap() < 1e-11);
}

/// A tumbling box above a floor, with a bouncing ball and a stop in a hinge.
fn box_on_floor() -> Spec {
    let mut b = Builder::new();
    let J = Mat3::identity() * 0.01;
    b.body(BodySpec::new("box", "world").hinge(Hinge::free()).mass(MassProperties::new(
        1.0,
        Vec3::zeros(),
        J,
    )));
    b.body(
        BodySpec::new("flap", "box")
            .hinge_in_parent(Pose::translation(0.1, 0.0, 0.1))
            .hinge(Hinge::pin(Vec3::y()).limits(linkwork_multibody::Limits::position(-0.5, 0.5)))
            .mass(MassProperties::new(0.2, Vec3::new(0.05, 0.0, 0.05), J * 0.1)),
    );
    let mbs = b.build().unwrap();
    let half = Vec3::new(0.1, 0.15, 0.1);
    let floor = ColliderSpec::new("floor", "world", Shape::HalfSpace);
    let mut shape = ColliderSpec::new("box", "box", Shape::Box { half });
    shape.material = Material { friction: 0.4, restitution: 0.3 };
    let colliders = Colliders::new(vec![floor, shape], Rules::default(), &mbs).unwrap();
    let mut q = mbs.neutral_q();
    q[2] = 0.5;
    let mut v = vec![0.0; mbs.nv()];
    v[..6].copy_from_slice(&[1.0, 2.0, -0.5, 0.4, 0.2, 0.0]);
    let mut s = spec(vec![gravity()], &[]);
    let mut m = MechanismSpec::new("Bodies", Arc::new(mbs), q, v);
    let mut settings = ContactSettings::default();
    settings.solver.tolerance = 5e-7;
    m.contact = Some(ContactSpec { colliders: Arc::new(colliders), settings });
    s.set_mechanism(m);
    s.step = seconds(0.001);
    s
}

#[test]
fn contact_rests_and_says_how_well() {
    let mut sim = Simulation::new(plan(&box_on_floor()));
    let mut impacts = 0.0;
    for k in 1..=3000 {
        sim.run_until(seconds(f64::from(k) * 1e-3)).unwrap();
        impacts += sim.get("Bodies.contact.impacts").unwrap();
        assert!(sim.get("flap.angle").unwrap().abs() < 0.51);
    }
    let x = &sim.state().x;
    assert!(impacts > 2.0, "{impacts}");
    assert!(x[8..].iter().all(|v| v.abs() < 1e-6), "still moving: {x:?}");
    assert!(sim.get("Bodies.contact.points").unwrap() >= 4.0);
    assert!(sim.get("Bodies.contact.penetration").unwrap() < 1e-3);
    assert!(sim.get("Bodies.contact.residual").unwrap() < 1e-6);
}

#[test]
fn contact_keeps_its_bits() {
    let plan = plan(&box_on_floor());
    let mut whole = Simulation::new(plan.clone());
    whole.run_until(seconds(1.5)).unwrap();
    let mut half = Simulation::new(plan.clone());
    half.run_until(seconds(0.731)).unwrap();
    let saved = half.checkpoint("").unwrap();
    assert_eq!(saved.stores.len(), 1);
    let mut snapshot = Snapshot::default();
    half.save_into(&mut snapshot);
    let mut restored = Simulation::new(plan.clone());
    restored.run_until(seconds(0.2)).unwrap();
    restored.restore(&saved).unwrap();
    let mut loaded = Simulation::new(plan);
    loaded.load_from(&snapshot).unwrap();
    let mut forked = half.fork();
    for sim in [&mut restored, &mut loaded, &mut forked, &mut half] {
        sim.run_until(seconds(1.5)).unwrap();
        assert_eq!(sim.hash(), whole.hash());
    }
}

/// What a machine with contact shows is pinned for its readers, and cuts leave no trace; what it moves by its own steps
/// is refused, as are coordinates of loops.
#[test]
fn pins_hold_beside_contact_and_not_inside_loops() {
    let begin = || {
        let mut sim = Simulation::new(plan(&box_on_floor()));
        sim.pin("Bodies.contact.points", -1.0).unwrap();
        sim
    };
    let mut whole = begin();
    for k in 1..=500 {
        whole.run_until(seconds(f64::from(k) * 1e-3)).unwrap();
        assert_eq!(whole.get("Bodies.contact.points").unwrap(), -1.0, "step {k}");
    }
    let mut half = begin();
    half.run_until(seconds(0.231)).unwrap();
    let mut rest = Simulation::new(half.plan().clone());
    rest.restore(&half.checkpoint("").unwrap()).unwrap();
    rest.run_until(seconds(0.5)).unwrap();
    assert_eq!(rest.hash(), whole.hash());
    for path in ["box.rotation.y", "box.velocity.x", "flap.angle", "flap.rate"] {
        let e = rest.pin(path, 0.0).unwrap_err();
        assert!(e.message.contains("integrates its own states"), "{e}");
    }
    for constraint_method in BOTH {
        let mut sim = Simulation::new(plan(&linkage(constraint_method, Integrator::Rk4, 1e-3)));
        let coordinate = sim.plan().lanes.iter().find(|(_, v)| v.place == Place::X(0));
        let path = coordinate.unwrap().0.clone();
        let e = sim.pin(&path, 1.0).unwrap_err();
        assert!(e.message.contains("couples it to other numbers"), "{constraint_method:?}: {e}");
    }
}

/// With contact, loops report their mean forces over a step, which tend to those of smooth dynamics.
#[test]
fn loops_report_their_forces_beside_contact() {
    let force = |constraint_method, contact: bool| {
        let mut s = linkage(constraint_method, Integrator::Rk4, 1e-4);
        let m = s.mechanism_mut().unwrap();
        let none = Colliders::new(Vec::new(), Rules::default(), &m.multibody).unwrap();
        m.contact = contact.then(|| ContactSpec {
            colliders: Arc::new(none),
            settings: ContactSettings::default(),
        });
        let mut sim = Simulation::new(plan(&s));
        sim.run_until(seconds(0.3)).unwrap();
        assert!(sim.get("Linkage.joint.error").unwrap() < 1e-11);
        ["force[0]", "force[2]"].map(|f| sim.get(&format!("Linkage.joint.{f}")).unwrap())
    };
    for constraint_method in BOTH {
        let (smooth, stepped) = (force(constraint_method, false), force(constraint_method, true));
        for (a, b) in smooth.iter().zip(&stepped) {
            // Measured: the states differ by up to 2e-3 at this step.
            assert!(
                (a - b).abs() < 1e-2 * (1.0 + a.abs()),
                "{constraint_method:?} {smooth:?} {stepped:?}"
            );
        }
    }
}

/// A four-bar on a free frame: the frame is pinned and the loop stays closed; what the loop holds together is refused,
/// however it is solved and wherever the machine stands.
#[test]
fn what_a_loop_holds_together_is_told_by_the_structure() {
    let machine = |constraint_method| {
        let (small, q) = four_bar(false);
        let mut b = Builder::new();
        let J = Mat3::from_diagonal(&Vec3::new(0.5, 0.7, 0.6));
        let frame = BodySpec::new("frame", "world").hinge(Hinge::free());
        b.body(frame.mass(MassProperties::new(5.0, Vec3::zeros(), J)));
        for body in small.body_ids() {
            let mut spec = small.spec(body);
            if spec.parent == "world" {
                spec.parent = "frame".into();
            }
            b.body(spec);
        }
        b.body(
            BodySpec::new("lone", "frame")
                .hinge(Hinge::slider(Vec3::z()))
                .mass(MassProperties::new(0.3, Vec3::zeros(), J)),
        );
        b.loop_closure(small.loops()[0].closure.clone());
        let mbs = b.build().unwrap();
        let mut start = mbs.neutral_q();
        for (body, angle) in ["crank", "coupler", "rocker"].iter().zip(q) {
            start[mbs.get(mbs.body(body).unwrap()).q().start] = angle;
        }
        let mut v = vec![0.0; mbs.nv()];
        // Set all three rates, because the choice of dependent coordinates is not known here.
        for body in ["crank", "coupler", "rocker"] {
            v[mbs.hinge(body).unwrap().start] = 1.0;
        }
        let mut m = MechanismSpec::new("Linkage", Arc::new(mbs), start, v);
        m.constraint_methods.insert("joint".into(), constraint_method);
        let mut s = spec(vec![gravity()], &[]);
        s.set_mechanism(m);
        s.step = seconds(0.001);
        s
    };
    for constraint_method in BOTH {
        let mut sim = Simulation::new(plan(&machine(constraint_method)));
        let states: Vec<String> = (sim.plan().lanes.iter())
            .filter(|(_, v)| matches!(v.place, Place::X(_)))
            .map(|(path, _)| path.clone())
            .collect();
        let refused: Vec<&String> =
            (states.iter()).filter(|path| sim.fork().pin(path, 0.25).is_err()).collect();
        assert_eq!(
            refused,
            [
                "coupler.angle",
                "coupler.rate",
                "crank.angle",
                "crank.rate",
                "frame.rotation.w",
                "frame.rotation.x",
                "frame.rotation.y",
                "frame.rotation.z",
                "rocker.angle",
                "rocker.rate",
            ],
            "{constraint_method:?}"
        );
        let [height, angle] = ["frame.position.z", "crank.angle"].map(|p| sim.get(p).unwrap());
        for path in ["frame.position.z", "frame.velocity.z", "frame.angular.y", "lone.displacement"]
        {
            sim.pin(path, sim.get(path).unwrap()).unwrap();
        }
        sim.run_until(seconds(0.5)).unwrap();
        assert!(sim.get("Linkage.joint.error").unwrap() < 1e-11, "{constraint_method:?}");
        assert!((sim.get("crank.angle").unwrap() - angle).abs() > 0.01, "{constraint_method:?}");
        assert_eq!(sim.get("frame.position.z").unwrap(), height);
    }
}
