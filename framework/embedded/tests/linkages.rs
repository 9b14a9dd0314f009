//! Objects with joints: trimmers of the reference, a chain of three links. Compares with the same mechanism in which the object is part of the robot.

use crate::support;

use linkwork_embedded::dynamics::{Tree, Workspace, inverse_dynamics, mass_matrix};
use linkwork_embedded::multibody::{BodySpec, Builder, Hinge, Limits, Multibody};
use linkwork_embedded::spatial::{MassProperties, Mat3, Pose, Vec3};
use linkwork_embedded::*;
use std::sync::Arc;
use support::*;

/// An arm of four joints with two hands at its end, welded to each other.
fn arm(rng: &mut Rng) -> Builder {
    let mut b = Builder::new();
    let mut parent = "world";
    for (k, name) in ["a1", "a2", "a3", "hand"].into_iter().enumerate() {
        let hinge =
            if k == 2 { Hinge::slider(Vec3::x()) } else { Hinge::pin(Vec3::ith(k % 3, 1.0)) };
        let hinge = hinge.limits(Limits::position(-2.0, 2.0));
        let body = BodySpec::new(name, parent).hinge(hinge).hinge_in_parent(place(rng));
        b.body(body.mass(mass(rng, 2.0)));
        parent = name;
    }
    b
}

/// Bodies on an object: a pin, a slider on it and a screw on that, and a body welded to the pin's body.
fn links(rng: &mut Rng, root: &str) -> Vec<BodySpec> {
    let one = |name: &str, parent: &str, hinge: Hinge, rng: &mut Rng| {
        let body = BodySpec::new(name, parent).hinge(hinge).hinge_in_parent(place(rng));
        body.hinge_in_body(place(rng)).mass(mass(rng, 0.4))
    };
    vec![
        one("blade", root, Hinge::pin(Vec3::new(0.6, 0.0, 0.8)), rng),
        one("slide", "blade", Hinge::slider(Vec3::y()), rng),
        one("ring", "slide", Hinge::screw(Vec3::z(), 0.02), rng),
        one("cap", "blade", Hinge::locked(), rng),
    ]
}

/// The model with a separate object, and the mechanism with the object welded to the hand at `X`.
fn both(X: Pose) -> (Arc<RobotModel>, Multibody) {
    let mut rng = Rng(4);
    let mechanism = arm(&mut rng);
    let root = mass(&mut rng, 0.7);
    let bodies = links(&mut rng, "tool");
    let mut whole = mechanism.clone();
    whole.body(BodySpec::new("tool", "hand").hinge_in_parent(X).mass(root));
    let mut linkages = Builder::new();
    for b in bodies {
        whole.body(b.clone());
        linkages.body(b);
    }
    let spec = ModelSpec {
        mechanism,
        linkages,
        objects: vec![
            ObjectSpec { name: "brick".into(), mass: mass(&mut rng, 0.5) },
            ObjectSpec { name: "tool".into(), mass: root },
        ],
        parts: vec![PartSpec::chain("arm", "world", "hand")],
        ..ModelSpec::default()
    };
    (RobotModel::new(&spec).unwrap(), whole.build().unwrap())
}

/// For each dof of the whole mechanism, the index in the robot, or after those in the object's joints.
fn order(model: &RobotModel, whole: &Multibody) -> Vec<usize> {
    let tool = model.object("tool").unwrap();
    let own = model.object_multibody(tool).unwrap();
    let mut out = vec![usize::MAX; whole.nv()];
    for b in whole.bodies().iter().filter(|b| !b.v().is_empty()) {
        let at = match model.multibody().body(b.name()) {
            Some(id) => model.multibody().get(id).v().start,
            None => model.nv() + own.get(own.body(b.name()).unwrap()).v().start - 6,
        };
        out[b.v().start] = at;
    }
    out
}

#[test]
fn forces_are_those_of_the_whole() {
    let mut rng = Rng(9);
    let X = place(&mut rng);
    let (model, whole) = both(X);
    let order = order(&model, &whole);
    let (arm, tool) = (model.part("arm").unwrap(), model.object("tool").unwrap());
    let (tree, mut robot) = (Tree::new(&whole), Robot::new(&model));
    let (nv, n) = (model.nv(), 3);
    let mut worst = 0.0_f64;
    for k in 0..20 {
        let mut numbers = |_| (0..nv + n).map(|_| rng.within(-1.0, 1.0)).collect::<Vec<f64>>();
        let [q, v, vdot] = [0, 1, 2].map(&mut numbers);
        // Each dof has one coordinate in q here.
        let merged = |x: &[f64]| order.iter().map(|i| x[*i]).collect::<Vec<f64>>();
        robot.set_q(&q[..nv]).unwrap();
        robot.set_object_q(tool, &q[nv..]).unwrap();
        if k == 0 {
            robot.grasp(arm, tool, Grasp::At(X)).unwrap();
        }
        let mut ws = Workspace::new(&tree);
        ws.apply_uniform_gravity(Vec3::new(0.0, 0.0, -9.81));
        let mut theirs = vec![0.0; nv + n];
        inverse_dynamics(&tree, &mut ws, &merged(&q), &merged(&v), &merged(&vdot), &mut theirs);
        let (mut tau, mut forces) = (vec![0.0; nv], vec![0.0; n]);
        let (rv, ra) = ((&v[..nv], &vdot[..nv]), (&v[nv..], &vdot[nv..]));
        robot.feed_forward_with_object(rv, tool, ra, &[], &mut tau, &mut forces).unwrap();
        worst = worst.max(difference(&merged(&[&tau[..], &forces].concat()), &theirs));
        // If the joints of the object are at rest, the other calls give the same result.
        let still = [&v[..nv], &[0.0; 3]].concat();
        let rest = [&vdot[..nv], &[0.0; 3]].concat();
        inverse_dynamics(&tree, &mut ws, &merged(&q), &merged(&still), &merged(&rest), &mut theirs);
        robot.feed_forward(&v[..nv], &vdot[..nv], &[], &mut tau).unwrap();
        let bare = |x: &[f64]| {
            let arm = order.iter().zip(x).filter(|(i, _)| **i < nv);
            arm.map(|(_, x)| *x).collect::<Vec<f64>>()
        };
        let wanted = order.iter().filter(|i| **i < nv).map(|i| tau[*i]).collect::<Vec<f64>>();
        worst = worst.max(difference(&wanted, &bare(&theirs)));
        let mut M = vec![0.0; (nv + n) * (nv + n)];
        robot.mass_matrix_with_object(tool, &mut M).unwrap();
        let mut whole_M = M.clone();
        mass_matrix(&tree, &mut ws, &mut whole_M);
        let size = nv + n;
        for i in 0..size {
            for j in 0..size {
                let ours = M[order[i] * size + order[j]];
                worst = worst.max((ours - whole_M[i * size + j]).abs());
            }
        }
        // Compare the poses of all bodies.
        for b in whole.bodies().iter() {
            if let Some(id) = model.object_body(tool, b.name()) {
                let X = ws.body_pose(&tree, whole.body(b.name()).unwrap());
                let (p, R) = apart(&robot.object_body_pose(tool, id).unwrap(), &X);
                worst = worst.max(p).max(R);
            }
        }
    }
    println!("within {worst:.1e}");
    assert!(worst < 1e-7, "{worst:e}");
}

#[test]
fn a_thousand_grasps_leave_no_trace() {
    let mut rng = Rng(2);
    let (model, _) = both(Pose::identity());
    let (arm, tool) = (model.part("arm").unwrap(), model.object("tool").unwrap());
    let brick = model.object("brick").unwrap();
    let mut robot = Robot::new(&model);
    let fresh = robot.clone();
    robot.grasp(arm, brick, Grasp::At(Pose::translation(0.1, 0.0, 0.0))).unwrap();
    let mut with_brick = robot.clone();
    let blade = model.object_body(tool, "blade").unwrap();
    let counted = allocation_counter::measure(|| {
        for _ in 0..1000 {
            let X = place(&mut rng);
            robot.grasp(arm, tool, Grasp::At(X)).unwrap();
            robot.set_object_q(tool, &[rng.within(-1.0, 1.0), 0.1, -0.3]).unwrap();
            let (mut tau, mut forces, mut M) = ([0.0; 4], [0.0; 3], [0.0; 49]);
            let moving = (&[0.1; 4][..], &[0.2; 4][..]);
            let own = (&[0.3; 3][..], &[0.4; 3][..]);
            robot.feed_forward_with_object(moving, tool, own, &[], &mut tau, &mut forces).unwrap();
            robot.mass_matrix_with_object(tool, &mut M).unwrap();
            robot.collides(&[0.1; 4]).unwrap();
            robot.object_body_pose(tool, blade).unwrap();
            robot.ungrasp(tool).unwrap();
            robot
                .feed_forward_with_object(moving, tool, own, &[], &mut tau, &mut forces)
                .unwrap_err();
        }
    });
    assert_eq!(counted.count_total, 0, "{counted:?}");
    let bits = |robot: &mut Robot| {
        let mut M = [0.0; 16];
        let mut tau = [0.0; 4];
        robot.set_q(&[0.3, -0.4, 0.2, 0.7]).unwrap();
        robot.mass_matrix(&mut M).unwrap();
        robot.feed_forward(&[0.1; 4], &[0.2; 4], &[], &mut tau).unwrap();
        [&M[..], &tau].concat().iter().map(|x| x.to_bits()).collect::<Vec<_>>()
    };
    assert_eq!(bits(&mut robot), bits(&mut with_brick));
    robot.ungrasp(brick).unwrap();
    assert_eq!(bits(&mut robot), bits(&mut fresh.clone()));
    // The joints and the pose of the object stay as they were set.
    assert_eq!(robot.object_q(tool).unwrap()[1..], [0.1, -0.3]);
    assert_eq!(robot.object_q(brick).unwrap(), [0.0; 0]);
}

/// Trimmers of the reference: forces at the arms and at the pin, open and closed.
#[test]
fn trimmers_weigh_what_the_reference_says() {
    let Some(json) = reference("robodarts/tasks.json") else { return };
    let task = &json["tasks"]["cut_wire"];
    let (bodies, expect) = (&task["bodies"], &task["expect"]);
    let of = |b: &serde_json::Value| {
        let J = Mat3::from_diagonal(&Vec3::from_column_slice(&numbers(&b["I"])));
        MassProperties::new(
            b["mass"].as_f64().unwrap(),
            Vec3::from_column_slice(&numbers(&b["com"])),
            J,
        )
    };
    let d = formats::read_file(support::file("robodarts/dual_ur5.urdf"), &options()).unwrap();
    let srdf = formats::read_srdf(DUAL, &formats::ReadOptions::default()).unwrap();
    let mut spec = ModelSpec::from_description(&d).unwrap().groups(&srdf, &d).unwrap();
    spec.objects.push(ObjectSpec { name: "handle_a".into(), mass: of(&bodies["handle_a"]) });
    let pin = &bodies["pin"];
    let p = numbers(&pin["origin_in_a"]);
    let limits = numbers(&pin["limits"]);
    let hinge = Hinge::pin(Vec3::from_column_slice(&numbers(&pin["axis"])))
        .limits(Limits::position(limits[0], limits[1]));
    let handle = BodySpec::new("handle_b", "handle_a").hinge(hinge);
    let handle = handle.hinge_in_parent(Pose::translation(p[0], p[1], p[2]));
    spec.linkages.body(handle.mass(of(&bodies["handle_b"])));
    let model = RobotModel::new(&spec).unwrap();
    let places = places(&model, &names(&task["dof"]));
    let (left, tool) = (model.part("left").unwrap(), model.object("handle_a").unwrap());
    let mut robot = Robot::new(&model);
    robot.set_q(&to_q(&model, &places, &numbers(&expect["q"]))).unwrap();
    let bare = robot.center_of_mass();
    robot.grasp(left, tool, Grasp::At(pose(&numbers(&pin["a_in_tip"])))).unwrap();
    // Place the tool over the wire with open jaws, and compare its centre of mass.
    robot.set_object_q(tool, &[0.5]).unwrap();
    let whole = robot.center_of_mass();
    let own = (whole.1 * whole.0 - bare.1 * bare.0) / (whole.0 - bare.0);
    let tip = robot.tip_pose(left).unwrap();
    let com = Vec3::from_column_slice(&numbers(&expect["com_of_trimmers_in_tip_open"]));
    assert!((tip.inverse().transform_point(&own) - com).norm() < 1e-10);
    let lever = expect["blade_lever"].as_f64().unwrap();
    let jaw = tip.transform_point(&Vec3::new(p[0], p[1], p[2] + lever));
    let there = Vec3::from_column_slice(&numbers(&expect["jaw_at"]));
    assert!((jaw - there).norm() < 1e-9, "{jaw} {there}");
    // An object's joints may be set beyond their limits, because they may be estimates.
    let handle = model.object_body(tool, "handle_b").unwrap();
    let [beyond, shut] = [limits[1] + 0.05, 0.0].map(|angle| {
        robot.set_object_q(tool, &[angle]).unwrap();
        assert_eq!(robot.object_q(tool).unwrap(), [angle]);
        robot.object_body_pose(tool, handle).unwrap()
    });
    let opened = (shut.rotation.inverse() * beyond.rotation).scaled_axis();
    assert!((opened - Vec3::y() * 0.95).norm() < 1e-12, "{opened}");
    // The force of the fingers on the handle is internal to the hand. It acts on the pin, and through the pin on the
    // blade.
    let number = |k: &str| expect[k].as_f64().unwrap();
    robot.set_object_q(tool, &[0.0]).unwrap();
    let X_b = robot.object_body_pose(tool, handle).unwrap();
    let mut J = [0.0; 6];
    robot.object_jacobian(tool, handle, &mut J).unwrap();
    let [w, v] = [0, 3].map(|k| Vec3::new(J[k], J[k + 1], J[k + 2]));
    // Compute the moment about the pin of a force perpendicular to the handle at this distance.
    let at_pin = |z: f64, force: f64| {
        let r = X_b.rotation * Vec3::new(0.0, 0.0, z);
        (v + w.cross(&r)).dot(&(X_b.rotation * Vec3::x() * force))
    };
    let grip = at_pin(-number("handle_lever"), -number("grip_force"));
    assert!((grip - number("pin_torque_of_grip")).abs() < 1e-12, "{grip}");
    let blade = at_pin(lever, number("force_at_blade"));
    assert!((blade - grip).abs() < 1e-10, "{blade}");
    // The finger presses on the handle and back on the hand at the same point, so the arm torques are zero.
    let [mut gripping, mut still] = [vec![0.0; model.nv()], vec![0.0; model.nv()]];
    let on_handle = X_b.transform_point(&Vec3::new(0.0, 0.0, -number("handle_lever")));
    let p = robot.tip_pose(left).unwrap().inverse().transform_point(&on_handle);
    let force = X_b.rotation * Vec3::x() * number("grip_force");
    let pushes = [-force, force].map(|f| Push::new(left, Vec3::zeros(), f).at(p));
    robot.held_still(&pushes, &mut gripping).unwrap();
    robot.gravity_forces(&mut still).unwrap();
    assert_eq!(gripping, still, "exactly nothing");
    let gravity = Vec3::new(0.0, 0.0, -9.81);
    robot.set_gravity(Vec3::zeros()).unwrap();
    robot.held_still(&pushes, &mut gripping).unwrap();
    assert!(gripping.iter().all(|t| *t == 0.0), "{gripping:?}");
    robot.held_still(&pushes[..1], &mut gripping).unwrap();
    assert!(gripping.iter().any(|t| t.abs() > 1.0), "one of both is felt: {gripping:?}");
    robot.set_gravity(gravity).unwrap();
    robot.set_object_q(tool, &[0.5]).unwrap();
    let nv = model.nv();
    let dofs = nv + robot.object_q(tool).unwrap().len();
    assert_eq!(dofs as u64, expect["dof_after_grasp"].as_u64().unwrap());
    for (opening, key) in [(0.5, "open"), (0.0, "closed")] {
        robot.set_object_q(tool, &[opening]).unwrap();
        let (mut tau, mut at_pin, rest) = (vec![0.0; nv], [0.0], vec![0.0; nv]);
        let own = (&[0.0][..], &[0.0][..]);
        robot
            .feed_forward_with_object((&rest, &rest), tool, own, &[], &mut tau, &mut at_pin)
            .unwrap();
        let theirs = to_v(&model, &places, &numbers(&expect[format!("gravity_{key}")]));
        let most = theirs.iter().fold(0.0, |m: f64, x| m.max(x.abs()));
        let off = difference(&tau, &theirs) / most;
        assert!(off < 1e-8, "{key}: {off:e}");
        let pin = expect[format!("pin_gravity_{key}")].as_f64().unwrap();
        assert!((at_pin[0] - pin).abs() < 1e-8 * pin.abs(), "{key}: {} {pin}", at_pin[0]);
        // `gravity_forces` gives the same result.
        let mut still = vec![0.0; nv];
        robot.gravity_forces(&mut still).unwrap();
        assert_eq!(still, tau);
    }
}

/// A hand with pliers: the jaw ignores only the hand, its end hits the forearm; all pairs are checked again after release.
#[test]
fn filters_follow_and_bodies_collide_where_they_are() {
    let mut mechanism = Builder::new();
    let limits = Limits::position(-3.0, 3.0);
    let at = |x: f64| Pose::translation(x, 0.0, 0.0);
    for (name, parent, x) in
        [("upper", "world", 0.0), ("fore", "upper", 0.5), ("hand", "fore", 0.5)]
    {
        let hinge = Hinge::pin(Vec3::z()).limits(limits);
        mechanism.body(BodySpec::new(name, parent).hinge(hinge).hinge_in_parent(at(x)));
    }
    let mut linkages = Builder::new();
    let jaw = BodySpec::new("jaw", "pliers").hinge(Hinge::pin(Vec3::z()));
    linkages.body(jaw.hinge_in_parent(at(0.2)));
    let end = BodySpec::new("end", "jaw").hinge(Hinge::pin(Vec3::z()));
    linkages.body(end.hinge_in_parent(at(0.2)));
    let ball = |name: &str, body: &str, x: f64| {
        ColliderSpec::new(name, body, Shape::Sphere { radius: 0.03 }).at(at(x))
    };
    let unit = MassProperties::new(0.1, Vec3::zeros(), Mat3::identity() * 1e-3);
    let spec = ModelSpec {
        mechanism,
        linkages,
        objects: vec![
            ObjectSpec { name: "pliers".into(), mass: unit },
            ObjectSpec { name: "bolt".into(), mass: unit },
        ],
        parts: vec![PartSpec::chain("arm", "world", "hand")],
        colliders: vec![
            ball("upper", "upper", 0.25),
            ball("fore", "fore", 0.25),
            ball("hand", "hand", 0.05),
            ball("pliers", "pliers", 0.1),
            ball("jaw", "jaw", 0.1),
            ball("end", "end", 0.1),
            ball("bolt", "bolt", 0.0),
            ball("wall", "world", -5.0),
        ],
        ..ModelSpec::default()
    };
    let model = RobotModel::new(&spec).unwrap();
    let (arm, pliers) = (model.part("arm").unwrap(), model.object("pliers").unwrap());
    let bolt = model.object("bolt").unwrap();
    let id = |n: &str| model.collider(n).unwrap();
    let met = |robot: &Robot, name: &str| -> Vec<String> {
        let others = model.colliders().filter(|(i, _)| robot.looks_at(id(name), *i).unwrap());
        others.map(|(_, n)| n.to_owned()).collect()
    };
    let mut robot = Robot::new(&model);
    robot.put(bolt, at(4.0)).unwrap();
    let free = robot.clone();
    let all = ["pliers", "jaw", "end", "bolt"];
    let before = all.map(|n| met(&robot, n));
    assert_eq!(before[1], ["bolt", "fore", "hand", "upper", "wall"]);
    assert_eq!(before[2], ["bolt", "fore", "hand", "pliers", "upper", "wall"]);
    robot.grasp(arm, pliers, Grasp::At(at(0.1))).unwrap();
    assert_eq!(met(&robot, "pliers"), ["bolt", "end", "upper", "wall"]);
    assert_eq!(met(&robot, "jaw"), ["bolt", "fore", "upper", "wall"]);
    assert_eq!(met(&robot, "end"), before[2]);
    robot.grasp(arm, bolt, Grasp::At(at(0.5))).unwrap();
    assert_eq!(met(&robot, "bolt"), ["end", "upper", "wall"]);
    robot.ungrasp(bolt).unwrap();
    robot.put(bolt, at(4.0)).unwrap();
    // The end is where geometry predicts it: the hand is at 1 m, the pliers at 1.1, the jaw at 1.3
    // and the end at 1.5.
    let q = [0.0; 3];
    let far = robot.distance(&q, id("end"), id("wall")).unwrap().unwrap();
    assert!((far.distance - (6.6 - 0.06)).abs() < 1e-12, "{far:?}");
    assert!(!robot.collides(&q).unwrap());
    // The linkage is folded back twice: 1.3 − 0.2 − 0.1 = 1.0. The sphere of the hand is at 1.05.
    robot.set_object_q(pliers, &[3.1, 0.0]).unwrap();
    let hit = robot.first_hit(&q).unwrap();
    assert_eq!(
        hit,
        Some((id("end"), id("hand"))),
        "at {:?}",
        robot.distance(&q, id("end"), id("hand"))
    );
    // Along a path, the linkage moves with the hand, with its joints at rest. The end hits a bolt next to the arm's
    // swing.
    robot.set_object_q(pliers, &[0.0, 0.0]).unwrap();
    robot.put(bolt, Pose::translation(0.0, 1.6, 0.0)).unwrap();
    let path = robot.path_free(&[0.0; 3], &[3.0, 0.0, 0.0], 1e-3).unwrap();
    let Path::Hit { at: part, pair } = path else { panic!("{path:?}") };
    assert_eq!(pair, (id("bolt"), id("end")));
    assert!((3.0 * part - 1.57).abs() < 0.1, "{part}");
    robot.put(bolt, Pose::translation(0.0, 1.7, 0.0)).unwrap();
    assert_eq!(robot.path_free(&[0.0; 3], &[3.0, 0.0, 0.0], 1e-3).unwrap(), Path::Free);
    // Only the hand rotates, so the distance of the end from the hand matters.
    let (sin, cos) = 0.15_f64.sin_cos();
    robot.put(bolt, Pose::translation(1.0 + 0.6 * cos, 0.6 * sin, 0.0)).unwrap();
    let path = robot.path_free(&[0.0; 3], &[0.0, 0.0, 2.0], 1e-3).unwrap();
    assert!(matches!(path, Path::Hit { .. }), "{path:?}");
    robot.ungrasp(pliers).unwrap();
    assert_eq!(all.map(|n| met(&robot, n)), before);
    assert_eq!(all.map(|n| met(&free, n)), before, "another instance has noticed nothing");
    // After the release, the bodies of the linkage stay in the world and follow no arm.
    let there = robot.object_body_pose(pliers, model.object_body(pliers, "end").unwrap()).unwrap();
    robot.set_q(&[1.0; 3]).unwrap();
    assert_eq!(
        robot.object_body_pose(pliers, model.object_body(pliers, "end").unwrap()).unwrap(),
        there
    );
}

/// Two instances of one model in two threads give results bit-identical with those of a single thread.
#[test]
fn instances_in_threads_know_nothing_of_each_other() {
    let (model, _) = both(Pose::identity());
    let work = |seed: u64| {
        let mut rng = Rng(seed);
        let mut robot = Robot::new(&model);
        let (arm, tool) = (model.part("arm").unwrap(), model.object("tool").unwrap());
        let brick = model.object("brick").unwrap();
        let mut bits = Vec::new();
        for k in 0..500 {
            let held = if (k + seed).is_multiple_of(3) { brick } else { tool };
            robot.set_q(&[(); 4].map(|()| rng.within(-1.0, 1.0))).unwrap();
            robot.set_object_q(tool, &[(); 3].map(|()| rng.within(-1.0, 1.0))).unwrap();
            robot.grasp(arm, held, Grasp::At(place(&mut rng))).unwrap();
            let (mut tau, mut M) = ([0.0; 4], [0.0; 16]);
            robot.feed_forward(&[0.1; 4], &[0.2; 4], &[], &mut tau).unwrap();
            robot.mass_matrix(&mut M).unwrap();
            robot.ungrasp(held).unwrap();
            bits.extend(tau.iter().chain(&M).map(|x| x.to_bits()));
        }
        bits
    };
    let alone = [1, 2].map(work);
    let together =
        std::thread::scope(|s| [1, 2].map(|k| s.spawn(move || work(k))).map(|t| t.join().unwrap()));
    assert_eq!(alone, together);
    assert_ne!(alone[0], alone[1]);
}

#[test]
fn mistakes_are_refused() {
    let (model, _) = both(Pose::identity());
    let mut robot = Robot::new(&model);
    let [tool, brick] = ["tool", "brick"].map(|o| model.object(o).unwrap());
    let none =
        |e: Result<(), RobotError>| assert!(matches!(e, Err(RobotError::NoJoints { .. })), "{e:?}");
    none(robot.set_object_q(brick, &[]));
    none(robot.mass_matrix_with_object(brick, &mut []));
    assert!(matches!(
        robot.set_object_q(tool, &[0.0; 2]),
        Err(RobotError::Length { wanted: 3, .. })
    ));
    assert!(matches!(
        robot.set_object_q(tool, &[0.0, 0.0, f64::NAN]),
        Err(RobotError::NotFinite { .. })
    ));
    assert!(matches!(
        robot.mass_matrix_with_object(tool, &mut [0.0; 49]),
        Err(RobotError::NotHeld { .. })
    ));
    assert!(matches!(
        robot.mass_matrix_with_object(tool, &mut [0.0; 48]),
        Err(RobotError::Length { wanted: 49, .. })
    ));
    let said = |change: &dyn Fn(&mut ModelSpec)| {
        let mut spec = ModelSpec {
            objects: vec![ObjectSpec { name: "tool".into(), mass: mass(&mut Rng(1), 1.0) }],
            ..ModelSpec::default()
        };
        change(&mut spec);
        RobotModel::new(&spec).unwrap_err().to_string()
    };
    let orphan = said(&|s| {
        s.linkages.body(BodySpec::new("jaw", "tol").hinge(Hinge::pin(Vec3::z())));
    });
    assert!(
        orphan.contains("`jaw`") && orphan.contains("`tol`") && orphan.contains("tool"),
        "{orphan}"
    );
    let twice = said(&|s| {
        s.linkages.body(BodySpec::new("tool", "tool").hinge(Hinge::pin(Vec3::z())));
    });
    assert!(twice.contains("tool"), "{twice}");
}
