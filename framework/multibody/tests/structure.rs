//! Structure: canonical order, queries, and errors of invalid descriptions.

use linkwork_multibody::spatial::{MassProperties, Mat3, Pose, Quat, Vec3};
use linkwork_multibody::{
    BodySpec, Builder, Coordinate, Coupling, Friction, Hinge, HingeCoordinate, Limits, LoopClosure,
    MechanismFault, Stop, Subgraph, SubgraphError, Subhinge, SubhingeKind,
};

fn rover() -> Vec<BodySpec> {
    vec![
        BodySpec::new("chassis", "world").hinge(Hinge::free()),
        BodySpec::new("rocker_r", "chassis").hinge(Hinge::pin(Vec3::y() * 2.0)),
        BodySpec::new("rocker_l", "chassis").hinge(Hinge::pin(Vec3::y())),
        BodySpec::new("wheel_r", "rocker_r").hinge(Hinge::universal(Vec3::z(), Vec3::y())),
        BodySpec::new("wheel_l", "rocker_l").hinge(Hinge::pin(Vec3::y()).prescribed()),
        BodySpec::new("mast", "chassis").hinge(Hinge::ball()),
        BodySpec::new("box", "mast"),
        BodySpec::new("beacon", "world"),
    ]
}

fn build(order: &[usize]) -> linkwork_multibody::Multibody {
    let (parts, mut b) = (rover(), Builder::new());
    b.node("imu", "chassis", Pose::translation(0.1, 0.0, 0.0));
    for &i in order {
        b.body(parts[i].clone());
    }
    b.node("axle", "wheel_l", Pose::identity());
    b.build().unwrap()
}

#[test]
fn any_order_of_adding_gives_identical_arrays() {
    let first = build(&[0, 1, 2, 3, 4, 5, 6, 7]);
    assert_eq!(first, build(&[7, 6, 5, 4, 3, 2, 1, 0]));
    assert_eq!(first, build(&[4, 1, 7, 0, 3, 6, 2, 5]));
    let names: Vec<_> = first.bodies().iter().map(|b| b.name()).collect();
    assert_eq!(
        names,
        ["beacon", "chassis", "mast", "box", "rocker_l", "wheel_l", "rocker_r", "wheel_r"]
    );
}

#[test]
fn places_in_q_and_v_and_paths() {
    let m = build(&[0, 1, 2, 3, 4, 5, 6, 7]);
    assert_eq!((m.nq(), m.nv()), (7 + 4 + 1 + 1 + 1 + 2, 6 + 3 + 1 + 1 + 1 + 2));
    assert_eq!(m.hinge("chassis"), Some(0..6));
    assert_eq!(m.hinge("mast"), Some(6..9));
    assert_eq!(m.hinge("wheel_r"), Some(12..14));
    assert_eq!(m.hinge("nothing"), None);
    let wheel = m.get(m.body("wheel_r").unwrap());
    assert_eq!((wheel.q(), wheel.v()), (14..16, 12..14));
    assert_eq!(wheel.subhinges()[1].v, 13..14);
    assert_eq!(m.neutral_q()[6], 1.0);
    assert_eq!(m.neutral_q()[10], 1.0);
    let mut mask = vec![false; m.nv()];
    mask[10] = true;
    assert_eq!(m.prescribed(), mask);
    let axis = m.get(m.body("rocker_r").unwrap()).subhinges()[0].subhinge.kind.axis().unwrap();
    assert_eq!(axis, Vec3::y(), "axes are normalised");

    let id = |n: &str| m.body(n).unwrap();
    let path: Vec<_> = m.ancestors(id("wheel_l")).map(|b| m.get(b).name()).collect();
    assert_eq!(path, ["wheel_l", "rocker_l", "chassis"]);
    assert!(m.on_path(id("chassis"), id("wheel_l")) && m.on_path(id("mast"), id("mast")));
    assert!(!m.on_path(id("rocker_r"), id("wheel_l")) && !m.on_path(id("wheel_l"), id("chassis")));
    let subtree: Vec<_> = m.subtree(id("rocker_r")).map(|b| m.get(b).name()).collect();
    assert_eq!(subtree, ["rocker_r", "wheel_r"]);
    assert_eq!(m.get_node(m.node("axle").unwrap()).body(), id("wheel_l"));
}

#[test]
fn integrate_and_difference_are_inverse_and_agree_with_qdot() {
    let m = build(&[0, 1, 2, 3, 4, 5, 6, 7]);
    for seed in 0..20 {
        let (q, dv) = (m.random_q(seed), m.random_v(seed));
        assert!(q.iter().chain(&dv).all(|x| x.abs() > 1e-3), "no zeros");
        let (mut to, mut back) = (q.clone(), dv.clone());
        m.integrate(&q, &dv, &mut to);
        m.difference(&q, &to, &mut back);
        for (a, b) in back.iter().zip(&dv) {
            assert!((a - b).abs() < 1e-13, "seed {seed}: {back:?} is not {dv:?}");
        }
        let h = 1e-6;
        let step = |s: f64| {
            let dv: Vec<f64> = dv.iter().map(|x| s * h * x).collect();
            let mut to = q.clone();
            m.integrate(&q, &dv, &mut to);
            to
        };
        let (minus, plus, mut qdot) = (step(-1.0), step(1.0), q.clone());
        m.qdot(&q, &dv, &mut qdot);
        for i in 0..q.len() {
            let slope = (plus[i] - minus[i]) / (2.0 * h);
            assert!((slope - qdot[i]).abs() < 1e-9, "seed {seed}, lane {i}: {slope} {}", qdot[i]);
        }
        // Small motions are also recovered to round-off. This tests the series of the SE(3)
        // exponential.
        let small: Vec<f64> = dv.iter().map(|x| 1e-3 * x).collect();
        m.integrate(&q, &small, &mut to);
        m.difference(&q, &to, &mut back);
        assert!(back.iter().zip(&small).all(|(a, b)| (a - b).abs() < 1e-15), "seed {seed}");
    }
    let mut q = m.neutral_q();
    q[6] = 0.5;
    q[7..11].fill(0.0);
    m.normalize(&mut q);
    assert_eq!(q, m.neutral_q());
}

#[test]
fn all_faults_are_reported_together_with_the_remedy() {
    let mut b = Builder::new();
    let heavy =
        MassProperties::new(1.0, Vec3::zeros(), Mat3::from_diagonal(&Vec3::new(0.1, 0.1, 0.5)));
    b.body(BodySpec::new("chassis", "world"));
    b.body(BodySpec::new("wheel", "chasis").mass(heavy));
    b.body(BodySpec::new("twin", "chassis")).body(BodySpec::new("twin", "chassis"));
    b.body(BodySpec::new("a", "c")).body(BodySpec::new("b", "a")).body(BodySpec::new("c", "b"));
    b.body(BodySpec::new("arm", "chassis").hinge(Hinge::pin(Vec3::zeros())));
    b.body(BodySpec::new("leg", "chassis").hinge(Hinge::free().armature(1.0)));
    b.body(BodySpec::new("world", "chassis"));
    b.body(
        BodySpec::new("lost", "chassis")
            .hinge_in_parent(Pose::new(Quat::identity(), Vec3::new(f64::NAN, 0.0, 0.0))),
    );
    b.body(BodySpec::new("nut", "chassis").hinge(Hinge::screw(Vec3::x(), f64::INFINITY)));
    b.node("imu", "chasis", Pose::identity());
    let error = b.build().unwrap_err();
    let text = error.to_string();
    for part in [
        "body `wheel`: no parent `chasis`\n  help: did you mean `chassis`?",
        "body `wheel`: largest principal moment 0.5",
        "body `twin` is defined 2 times",
        "bodies form a cycle: a -> c -> b -> a",
        "body `arm`, subhinge 0: axis has no direction",
        "body `leg`, subhinge 0: armature 1",
        "body name `world` is not usable",
        "body `lost`, hinge frame in the parent: a number is NaN",
        "body `nut`, subhinge 0, pitch",
        "node `imu`: no body `chasis`\n  help: did you mean `chassis`?",
    ] {
        assert!(text.contains(part), "{part:?} is missing from\n{text}");
    }
    assert_eq!(error.faults.len(), 10, "{text}");
    assert!(matches!(&error.faults[0], MechanismFault::Duplicate { what: "body", count: 2, .. }));
}

#[test]
fn prescription_is_per_subhinge() {
    let mut chain = Hinge::planar();
    chain.subhinges[2].coordinate = Coordinate::Prescribed;
    chain.subhinges.push(Subhinge::from(SubhingeKind::Locked));
    let mut b = Builder::new();
    b.body(BodySpec::new("puck", "world").hinge(chain));
    let m = b.build().unwrap();
    assert_eq!(m.prescribed(), [false, false, true]);
    let all = m.clone().with_coordinate(m.body("puck").unwrap(), Coordinate::Prescribed);
    assert_eq!(all.prescribed(), [true; 3]);
}

#[test]
fn a_mechanism_taken_apart_builds_again_the_same() {
    let m = build(&[0, 1, 2, 3, 4, 5, 6, 7]);
    assert_eq!(Builder::from(&m).build().unwrap(), m);
}

#[test]
fn a_subgraph_keeps_names_and_knows_its_places() {
    let m = build(&[0, 1, 2, 3, 4, 5, 6, 7]);
    let id = |n: &str| m.body(n).unwrap();
    let arm = m.subtree_graph(id("rocker_l"));
    assert_eq!(arm.base, Some(id("chassis")));
    assert_eq!(arm.bodies, [id("rocker_l"), id("wheel_l")]);
    assert_eq!((arm.q.clone(), arm.v.clone()), (vec![11, 12], vec![9, 10]));
    assert_eq!(arm.multibody.nodes().len(), 1);
    assert!(arm.multibody.get(arm.multibody.body("wheel_l").unwrap()).parent().is_some());
    let both = m.subgraph(&[id("rocker_l"), id("mast"), id("mast")]).unwrap();
    assert_eq!((both.base, both.multibody.nv()), (Some(id("chassis")), 4));
    let path = m.path_graph(id("wheel_r"));
    assert_eq!((path.base, path.multibody.nv()), (None, 9));
    assert_eq!(m.subgraph(&[]), Err(SubgraphError::Empty));
    let error = m.subgraph(&[id("wheel_l"), id("wheel_r")]).unwrap_err().to_string();
    assert!(error.contains("rocker_l, rocker_r") && error.contains("help"), "{error}");
    let mut whole = vec![0.0; m.nq()];
    let part = Subgraph::gather(&both.q, &m.random_q(3));
    Subgraph::scatter(&both.q, &part, &mut whole);
    assert_eq!(Subgraph::gather(&both.q, &whole), part);
}

#[test]
fn gears_and_limits_are_checked() {
    let mass = MassProperties::new(1.0, Vec3::x(), Mat3::identity());
    let fault = |hinge: Hinge| {
        let mut b = Builder::new();
        b.body(BodySpec::new("a", "world").hinge(hinge).mass(mass));
        b.build().map(|_| ()).map_err(|e| e.faults)
    };
    let pin = || Hinge::pin(Vec3::x());
    assert!(fault(pin().gear(-50.0).armature(1e-4).limits(Limits::position(-1.0, 2.0))).is_ok());
    for gear in [0.0, f64::NAN, f64::INFINITY] {
        assert!(matches!(
            fault(pin().gear(gear)).unwrap_err()[..],
            [MechanismFault::BadGear { .. }]
        ));
    }
    for bad in [
        pin().limits(Limits::position(1.0, -1.0)),
        pin().limits(Limits::position(f64::NAN, 1.0)),
        pin().limits(Limits { effort: -1.0, ..Limits::NONE }),
        Hinge::ball().limits(Limits::position(-1.0, 1.0)),
    ] {
        assert!(matches!(fault(bad).unwrap_err()[..], [MechanismFault::BadLimits { .. }]));
    }
    let s = pin().gear(-50.0).armature(1e-4).subhinges[0];
    assert!((s.reflected_inertia() - 0.25).abs() < 1e-15);
}

#[test]
fn damping_friction_and_stops_that_cannot_be_are_refused() {
    let built = |hinge: Hinge| {
        let mut b = Builder::new();
        b.body(BodySpec::new("arm", "world").hinge(hinge));
        b.build().map(|m| m.get(m.body("arm").unwrap()).subhinges()[0].subhinge)
    };
    let pin = || Hinge::pin(Vec3::y());
    let soft = |stiffness, damping| Stop::Soft { stiffness, damping };
    let friction = |force, rate| Friction { force, rate };
    let kept = built(pin().damping(0.7).friction(friction(0.2, 0.01)).stop(soft(30.0, 0.0)));
    let kept = kept.unwrap();
    assert_eq!((kept.damping, kept.friction), (0.7, friction(0.2, 0.01)));
    assert_eq!(kept.stop, soft(30.0, 0.0));
    assert!(built(Hinge::ball().damping(0.7)).is_ok());
    assert!(built(Hinge::ball().stop(soft(1.0, 1.0))).is_ok());
    let bad = [
        (pin().damping(-0.1), "damping -0.1"),
        (pin().damping(f64::NAN), "damping NaN"),
        (pin().damping(f64::INFINITY), "damping inf"),
        (Hinge::free().damping(0.1), "damping 0.1"),
        (pin().friction(friction(-1.0, 0.0)), "friction"),
        (pin().friction(friction(1.0, f64::NAN)), "friction"),
        (Hinge::ball().friction(friction(1.0, 0.1)), "friction"),
        (pin().stop(soft(0.0, 1.0)), "stop"),
        (pin().stop(soft(1.0, -1.0)), "stop"),
    ];
    for (hinge, fact) in bad {
        let error = built(hinge.clone()).unwrap_err().to_string();
        let wanted = format!("body `arm`, subhinge 0: {fact}");
        assert!(error.contains(&wanted) && error.contains("help: "), "{hinge:?}: {error}");
    }
    let mut b = Builder::new();
    b.body(BodySpec::new("arm", "world").hinge(pin()));
    b.loop_closure(LoopClosure {
        name: "l".into(),
        body_a: "arm".into(),
        frame_a: Pose::identity(),
        body_b: "world".into(),
        frame_b: Pose::identity(),
        hinge: pin().damping(0.1),
    });
    let error = b.build().unwrap_err().to_string();
    assert!(error.contains("loop `l`, subhinge 0: damping"), "{error}");
}

/// Checks the elements of q and of β that a rotation, a coupling or a loop ties to others, by the names of their bodies.
#[test]
fn what_is_held_together_is_told() {
    let mut b = Builder::new();
    for spec in rover() {
        b.body(spec);
    }
    let at = |body: &str| HingeCoordinate { body: body.into(), subhinge: 0 };
    b.coupling(Coupling::differential("differential", at("rocker_r"), at("rocker_l")));
    // The path leads from wheel to wheel over the rockers. wheel_l is prescribed and therefore independent.
    b.loop_closure(LoopClosure {
        name: "axle".into(),
        body_a: "wheel_r".into(),
        frame_a: Pose::identity(),
        body_b: "wheel_l".into(),
        frame_b: Pose::identity(),
        hinge: Hinge::ball(),
    });
    let m = b.build().unwrap();
    let (q, v) = m.held_together();
    let held = |body: &str| {
        let body = m.get(m.body(body).unwrap());
        (q[body.q()].to_vec(), v[body.v()].to_vec())
    };
    let (yes, no) = (true, false);
    assert_eq!(held("chassis"), (vec![no, no, no, yes, yes, yes, yes], vec![no; 6]));
    assert_eq!(held("mast"), (vec![yes; 4], vec![no; 3]));
    for rocker in ["rocker_l", "rocker_r"] {
        assert_eq!(held(rocker), (vec![yes], vec![yes]), "{rocker}");
    }
    assert_eq!(held("wheel_r"), (vec![yes; 2], vec![yes; 2]));
    assert_eq!(held("wheel_l"), (vec![no], vec![no]));
}
