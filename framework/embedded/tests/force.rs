//! Held objects, feed-forward, two hands on one object, operational space: compared with the reference and checked by identities.

use crate::support::*;
use linkwork_embedded::dynamics::{
    Tree, Workspace, forward_dynamics, inverse_dynamics, mass_matrix, poses,
};
use linkwork_embedded::multibody::{BodySpec, Builder};
use linkwork_embedded::spatial::{Force, MassProperties, Mat3, Pose, Vec3};
use linkwork_embedded::*;
use serde_json::Value;
use std::sync::Arc;

fn object(name: &str, mass: f64, com: Vec3, inertia: Mat3) -> ObjectSpec {
    ObjectSpec { name: name.into(), mass: MassProperties::new(mass, com, inertia) }
}

fn diagonal(v: &Value) -> Mat3 {
    Mat3::from_diagonal(&Vec3::from_column_slice(&numbers(v)))
}

fn vec3(v: &Value) -> Vec3 {
    Vec3::from_column_slice(&numbers(v))
}

/// Returns the difference relative to the largest expected number.
fn relative(ours: &[f64], theirs: &[f64]) -> f64 {
    difference(ours, theirs) / theirs.iter().fold(1.0, |m: f64, x| m.max(x.abs()))
}

fn wrench(x: &[f64]) -> Force {
    Force::new(Vec3::from_column_slice(&x[..3]), Vec3::from_column_slice(&x[3..6]))
}

fn numbers_of(f: &Force) -> Vec<f64> {
    f.moment.iter().chain(f.force.iter()).copied().collect()
}

#[test]
fn gravity_with_a_load_is_that_of_the_reference() {
    let Some(json) = reference("robodarts/dual_ur5_kinematics.json") else { return };
    let mobile = reference("robodarts/mobile_iiwa_kinematics.json").unwrap();
    let load = |json: &Value| {
        let l = &json["rigid_load"];
        let I = rows(&l["inertia_about_com"]);
        let inertia = Mat3::from_row_slice(&I);
        (
            object("load", l["mass"].as_f64().unwrap(), vec3(&l["com"]), inertia),
            pose(&numbers(&l["pose_in_tip"])),
        )
    };
    let arm = [PartSpec::chain("arm", "lbr_iiwa_link_0", "tcp")];
    for (json, hand) in [(&json, "left"), (&mobile, "arm")] {
        let (spec, X) = load(json);
        let model = if hand == "left" {
            dual(vec![spec]).unwrap()
        } else {
            robot("robodarts/mobile_iiwa.urdf", &arm, vec![spec])
        };
        let at = places(&model, &names(&json["dof"]));
        let (part, load) = (model.part(hand).unwrap(), model.object("load").unwrap());
        let mut robot = Robot::new(&model);
        let (mut tau, mut worst) = (vec![0.0; model.nv()], 0.0_f64);
        for state in json["states"].as_array().unwrap() {
            robot.set_q(&to_q(&model, &at, &numbers(&state["q"]))).unwrap();
            let expect = |k: &str| to_v(&model, &at, &numbers(&state[k]));
            robot.gravity_forces(&mut tau).unwrap();
            worst = worst.max(relative(&tau, &expect("gravity")));
            robot.grasp(part, load, Grasp::At(X)).unwrap();
            robot.gravity_forces(&mut tau).unwrap();
            worst = worst.max(relative(&tau, &expect("gravity_rigid_load")));
            robot.ungrasp(load).unwrap();
        }
        println!("{hand}: gravity bare and loaded within {worst:.1e}");
        assert!(worst < 1e-9, "{worst}");
    }
}

#[test]
fn golden_numbers_of_a_load_and_of_the_operational_space() {
    if reference("robodarts/ik_ur5.json").is_none() {
        return;
    }
    let load = object("load", 2.0, Vec3::new(0.0, 0.0, 0.1), Mat3::zeros());
    let model =
        robot("robots/ur5.urdf", &[PartSpec::chain("arm", "base_link", "ee_link")], vec![load]);
    let (arm, load) = (model.part("arm").unwrap(), model.object("load").unwrap());
    let mut robot = Robot::new(&model);
    robot.set_q(&[0.3, -1.2, 1.5, -0.9, 0.7, 0.2]).unwrap();
    let mut tau = [0.0; 6];
    robot.gravity_forces(&mut tau).unwrap();
    let bare = [0.0, -30.83968653, -15.08184583, -0.09851218, 0.0, 0.0];
    assert!(difference(&tau, &bare) < 1e-8, "{tau:?}");
    let mut space = TaskSpace::new(&robot, &[arm]).unwrap();
    let mut inertia = [0.0; 36];
    space.inertia(&mut robot, &mut inertia).unwrap();
    let ours: Vec<f64> = (0..6).map(|i| inertia[7 * i]).collect();
    let golden = [0.511457246, 0.141938120, 0.312721746, 8.397181069, 6.005531216, 4.399759207];
    assert!(difference(&ours, &golden) < 1e-8, "{ours:?}");
    let a = [0.0, 0.0, 0.0, 1.0, 0.0, 0.0];
    space.forces(&mut robot, &[0.0; 6], &a, None, &mut tau).unwrap();
    let golden = [-1.620217664, -27.639440246, -15.545728324, -0.188196279, 0.0, 0.0];
    assert!(difference(&tau, &golden) < 1e-8, "{tau:?}");
    robot.grasp(arm, load, Grasp::At(Pose::identity())).unwrap();
    robot.gravity_forces(&mut tau).unwrap();
    let loaded = [0.0, -43.96021717, -25.18085633, -2.84530561, 0.83912629, -0.50871720];
    assert!(difference(&tau, &loaded) < 1e-8, "{tau:?}");
}

/// The dual robot with a beam-like load welded to the left hand in the mechanism itself.
fn welded(load: &ObjectSpec, X: Pose) -> (Arc<RobotModel>, Tree) {
    let model = dual(vec![load.clone()]).unwrap();
    let mut b = Builder::from(model.multibody());
    b.body(BodySpec::new("load", "left_tcp").hinge_in_parent(X).mass(load.mass));
    let tree = Tree::new(&b.build().unwrap());
    (model, tree)
}

#[test]
fn a_held_object_moves_as_if_it_were_welded_on() {
    if reference("robodarts/ik_ur5.json").is_none() {
        return;
    }
    let I = Mat3::new(0.02, 0.003, -0.001, 0.003, 0.05, 0.002, -0.001, 0.002, 0.04);
    let load = object("load", 3.0, Vec3::new(0.05, -0.02, 0.1), I);
    let X = Pose::new(
        spatial::Quat::from_scaled_axis(Vec3::new(0.4, -0.7, 0.2)),
        Vec3::new(0.1, 0.02, 0.07),
    );
    let (model, tree) = welded(&load, X);
    let (left, load) = (model.part("left").unwrap(), model.object("load").unwrap());
    let mut robot = Robot::new(&model);
    let mbs = tree.multibody().clone();
    let mut ws = Workspace::new(&tree);
    let nv = model.nv();
    let (mut ours, mut theirs, mut M) = (vec![0.0; nv], vec![0.0; nv], vec![0.0; nv * nv]);
    let mut space = TaskSpace::new(&robot, &[left]).unwrap();
    for seed in 0..10 {
        let (q, v, vdot) = (mbs.random_q(seed), mbs.random_v(seed), mbs.random_v(seed + 50));
        robot.set_q(&q).unwrap();
        robot.grasp(left, load, Grasp::At(X)).unwrap();
        robot.feed_forward(&v, &vdot, &[], &mut ours).unwrap();
        ws.clear_forces();
        ws.apply_uniform_gravity(Vec3::new(0.0, 0.0, -9.81));
        inverse_dynamics(&tree, &mut ws, &q, &v, &vdot, &mut theirs);
        assert!(relative(&ours, &theirs) < 1e-12, "{}", relative(&ours, &theirs));
        // The object must be at its pose in the hand.
        let body = mbs.body("load").unwrap();
        let (p, R) = apart(&robot.object_pose(load).unwrap(), &ws.body_pose(&tree, body));
        assert!(p < 1e-12 && R < 1e-10);
        // Compare the compliance of the tip with dense algebra on the welded mechanism's mass matrix.
        poses(&tree, &mut ws, &q);
        mass_matrix(&tree, &mut ws, &mut M);
        let mut held = vec![0.0; nv * nv];
        robot.mass_matrix(&mut held).unwrap();
        assert!(relative(&held, &M) < 1e-12, "{}", relative(&held, &M));
        let (mass, center) = robot.center_of_mass();
        assert!((mass - tree.total_mass()).abs() < 1e-12 * mass);
        assert!((center - dynamics::center_of_mass(&tree, &ws)).norm() < 1e-12);
        let wrong = robot.mass_matrix(&mut held[1..]).unwrap_err();
        let numbers = (nv * nv - 1, nv * nv);
        assert_eq!(wrong, RobotError::Length { what: "M", got: numbers.0, wanted: numbers.1 });
        let tip = model.multibody().node("tip of part left").unwrap();
        let name = model.multibody().get_node(tip).name().to_owned();
        let mut J = vec![0.0; 6 * nv];
        dynamics::node_jacobian(&tree, &ws, mbs.node(&name).unwrap(), &mut J);
        let J = spatial::nalgebra::DMatrix::from_row_slice(6, nv, &J);
        let M = spatial::nalgebra::DMatrix::from_row_slice(nv, nv, &M);
        let dense = &J * M.cholesky().unwrap().solve(&J.transpose());
        let compliance = space.compliance(&mut robot).unwrap();
        let off = difference(compliance, dense.transpose().as_slice());
        assert!(off < 1e-9 * dense.amax(), "{off:e}");
        robot.ungrasp(load).unwrap();
    }
}

#[test]
fn pushes_are_what_the_joints_feel() {
    let Some(model) = dual(vec![]) else { return };
    let left = model.part("left").unwrap();
    let mut robot = Robot::new(&model);
    robot.set_q(&model.multibody().random_q(5)).unwrap();
    let nv = model.nv();
    let (mut J, mut bare, mut pushed) = (vec![0.0; 6 * nv], vec![0.0; nv], vec![0.0; nv]);
    robot.whole_jacobian(left, &mut J).unwrap();
    robot.gravity_forces(&mut bare).unwrap();
    let at = Vec3::new(0.02, -0.05, 0.2);
    let push = Push::new(left, Vec3::new(1.0, 2.0, 3.0), Vec3::new(10.0, -20.0, 30.0)).at(at);
    robot.held_still(&[push], &mut pushed).unwrap();
    // For each dof, compute the power of the force on the motion of its point.
    let arm = robot.tip_pose(left).unwrap().rotation * at;
    for i in 0..nv {
        let w = Vec3::new(J[i], J[nv + i], J[2 * nv + i]);
        let v = Vec3::new(J[3 * nv + i], J[4 * nv + i], J[5 * nv + i]) + w.cross(&arm);
        let power = push.wrench.moment.dot(&w) + push.wrench.force.dot(&v);
        assert!((pushed[i] - bare[i] - power).abs() < 1e-11, "{i}");
    }
}

/// J̇ v is the rate of change of a tip's velocity at constant rates; C + g are the corresponding forces. Tested on a floating robot.
#[test]
fn a_bias_is_the_acceleration_at_rates_that_stay() {
    let mut b = Builder::new();
    let mass = |m: f64| {
        MassProperties::new(
            m,
            Vec3::new(0.1, -0.2, 0.15),
            Mat3::from_diagonal(&Vec3::new(0.3, 0.4, 0.5)),
        )
    };
    let at =
        |x: f64| Pose::new(spatial::Quat::from_euler_angles(x, 0.3, -x), Vec3::new(0.2, x, 0.4));
    b.body(BodySpec::new("trunk", "world").hinge(multibody::Hinge::free()).mass(mass(3.0)));
    let pins = [("hip", "trunk", 0.3), ("knee", "hip", -0.5), ("other", "trunk", 0.8)];
    for (name, parent, x) in pins {
        let pin = multibody::Hinge::pin(Vec3::new(0.4, 1.0, x));
        b.body(BodySpec::new(name, parent).hinge_in_parent(at(x)).hinge(pin).mass(mass(1.0)));
    }
    let parts =
        vec![PartSpec::chain("leg", "trunk", "knee"), PartSpec::chain("arm", "trunk", "other")];
    let model =
        RobotModel::new(&ModelSpec { mechanism: b, parts, ..ModelSpec::default() }).unwrap();
    let tips = ["leg", "arm"].map(|n| model.part(n).unwrap());
    let (mut robot, n) = (Robot::new(&model), model.nv());
    for seed in 0..5 {
        let (q, v) = (model.multibody().random_q(seed), model.multibody().random_v(seed));
        robot.set_q(&q).unwrap();
        let (mut tau, mut still) = (vec![0.0; n], vec![0.0; n]);
        let mut bias = [spatial::Motion::zero(); 2];
        robot.bias(&v, &tips, &mut tau, &mut bias).unwrap();
        robot.feed_forward(&v, &vec![0.0; n], &[], &mut still).unwrap();
        assert_eq!(tau, still);
        let mut velocity = |h: f64, tip: Part| {
            let (mut there, mut J) = (q.clone(), vec![0.0; 6 * n]);
            let step: Vec<f64> = v.iter().map(|v| h * v).collect();
            model.multibody().integrate(&q, &step, &mut there);
            robot.set_q(&there).unwrap();
            robot.whole_jacobian(tip, &mut J).unwrap();
            J.chunks(n)
                .map(|row| row.iter().zip(&v).map(|(j, v)| j * v).sum::<f64>())
                .collect::<Vec<_>>()
        };
        for (tip, bias) in tips.into_iter().zip(bias) {
            let (a, b) = (velocity(-1e-5, tip), velocity(1e-5, tip));
            let rate: Vec<f64> = a.iter().zip(&b).map(|(a, b)| (b - a) / 2e-5).collect();
            let ours: Vec<f64> = bias.angular.iter().chain(bias.linear.iter()).copied().collect();
            assert!(difference(&ours, &rate) < 1e-8, "{seed} {ours:?} {rate:?}");
        }
    }
    let mut none = [spatial::Motion::zero(); 1];
    let lengths = robot.bias(&vec![0.0; n], &tips, &mut vec![0.0; n], &mut none);
    assert!(matches!(lengths, Err(RobotError::Length { what: "tips", got: 1, wanted: 2 })));
}

/// The two-armed robot with the beam, and the poses of the beam in both hands.
fn beam(json: &Value) -> (Arc<RobotModel>, [Pose; 2]) {
    let b = &json["beam"];
    let spec = object(
        "beam",
        b["mass"].as_f64().unwrap(),
        Vec3::zeros(),
        diagonal(&b["inertia_diagonal"]),
    );
    let X = ["left_tip_in_beam", "right_tip_in_beam"].map(|k| pose(&numbers(&b[k])).inverse());
    (dual(vec![spec]).unwrap(), X)
}

#[test]
fn two_hands_share_squeeze_and_are_told_apart_as_the_reference_says() {
    let Some(json) = reference("robodarts/dual_ur5_beam.json") else { return };
    let (model, X) = beam(&json);
    let at = places(&model, &names(&json["dof"]));
    let hands = ["left", "right"].map(|p| model.part(p).unwrap());
    let beam = model.object("beam").unwrap();
    let mut worst = [0.0_f64; 6];
    for case in json["cases"].as_array().unwrap() {
        let q = to_q(&model, &at, &numbers(&case["q"]));
        let expect = |v: &Value| to_v(&model, &at, &numbers(v));
        let mut shared = Vec::new();
        for order in [[0, 1], [1, 0]] {
            let mut robot = Robot::new(&model);
            robot.set_q(&q).unwrap();
            for i in order {
                robot.grasp(hands[i], beam, Grasp::At(X[i])).unwrap();
            }
            let (p, R) =
                apart(&robot.object_pose(beam).unwrap(), &pose(&numbers(&case["beam_pose"])));
            assert!(p < 1e-9 && R < 1e-10, "{p:e} {R:e}");
            let mut tau = vec![0.0; model.nv()];
            robot.gravity_forces(&mut tau).unwrap();
            let key = ["gravity_beam_on_left", "gravity_beam_on_right"][order[0]];
            worst[0] = worst[0].max(relative(&tau, &expect(&case[key])));
            let alone = tau.clone();
            for (name, kind) in [("equal", Balance::Equal), ("by_effort", Balance::Effort)] {
                let golden = &case["balance"][name];
                tau.copy_from_slice(&alone);
                let found = robot.balance(beam, kind, &mut tau).unwrap();
                worst[1] = worst[1].max(relative(&tau, &expect(&golden["tau"])));
                let second = ["wrench_left_tip_on_beam", "wrench_right_tip_on_beam"][order[1]];
                worst[2] =
                    worst[2].max(relative(&numbers_of(&found.second), &numbers(&golden[second])));
                let cost = golden["cost"].as_f64().unwrap();
                assert!((found.cost - cost).abs() < 1e-9 * cost, "{} {cost}", found.cost);
                assert!(
                    found.largest_share >= case["balance"]["least_largest_share"].as_f64().unwrap()
                );
                shared.push(tau.clone());
            }
            if order == [1, 0] {
                continue;
            }
            let mut squeeze = vec![0.0; model.nv()];
            let wrenches = robot.squeeze(beam, 20.0, &mut squeeze).unwrap();
            let ours: Vec<f64> = wrenches.iter().flat_map(numbers_of).collect();
            worst[3] = worst[3].max(relative(&ours, &numbers(&case["squeeze_20N"]["wrenches"])));
            worst[3] = worst[3].max(relative(&squeeze, &expect(&case["squeeze_20N"]["tau"])));
            let given = numbers(&case["given_wrenches"]);
            let given = [wrench(&given[..6]), wrench(&given[6..])];
            for golden in case["move_squeeze"].as_array().unwrap() {
                let hands = numbers(&golden["weights"]);
                let moment = golden["moment_weight_per_force_weight"].as_f64().unwrap();
                let weights = HandWeights { hands: [hands[0], hands[1]], moment };
                let told = robot.split_hand_wrenches(beam, &given, &weights).unwrap();
                let flat = |w: &[Force; 2]| w.iter().flat_map(numbers_of).collect::<Vec<f64>>();
                worst[4] = worst[4].max(relative(&flat(&told.moving), &numbers(&golden["move"])));
                worst[4] =
                    worst[4].max(relative(&flat(&told.squeezing), &numbers(&golden["squeeze"])));
                worst[4] = worst[4].max(relative(&numbers_of(&told.net), &numbers(&golden["net"])));
            }
        }
        // The result does not depend on which hand took it first.
        for (a, b) in [(0, 2), (1, 3)] {
            worst[5] = worst[5].max(relative(&shared[a], &shared[b]));
        }
    }
    println!("gravity, balance, wrench, squeeze, move/squeeze, order: {worst:?}");
    assert!(worst.iter().all(|w| *w < 1e-9), "{worst:?}");
}

#[test]
fn both_hands_have_their_operational_space_and_tasks_their_forces() {
    let Some(json) = reference("robodarts/dual_ur5_beam.json") else { return };
    let model = dual(vec![]).unwrap();
    let at = places(&model, &names(&json["dof"]));
    let hands = ["left", "right"].map(|p| model.part(p).unwrap());
    let mut robot = Robot::new(&model);
    let (mut both, mut one) =
        (TaskSpace::new(&robot, &hands).unwrap(), TaskSpace::new(&robot, &hands[..1]).unwrap());
    let (nv, mut worst) = (model.nv(), 0.0_f64);
    let tree = Tree::new(model.multibody());
    let mut ws = Workspace::new(&tree);
    for case in json["cases"].as_array().unwrap() {
        let q = to_q(&model, &at, &numbers(&case["q"]));
        robot.set_q(&q).unwrap();
        let golden = &case["osim"];
        worst =
            worst.max(relative(both.compliance(&mut robot).unwrap(), &rows(&golden["compliance"])));
        let mut L = [0.0; 144];
        both.inertia(&mut robot, &mut L).unwrap();
        worst = worst.max(relative(&L, &rows(&golden["lambda_"])));
        let mut L = [0.0; 36];
        one.inertia(&mut robot, &mut L).unwrap();
        worst = worst.max(relative(&L, &rows(&golden["lambda_left_alone"])));
        let golden = &case["task_control"];
        let (mut tau, a) = (vec![0.0; nv], numbers(&golden["acceleration"]));
        one.forces(&mut robot, &vec![0.0; nv], &a, None, &mut tau).unwrap();
        worst = worst.max(relative(&tau, &to_v(&model, &at, &numbers(&golden["tau"]))));
        // At rest, these forces cause the acceleration of the reference.
        let mut vdot = vec![0.0; nv];
        ws.clear_forces();
        ws.apply_uniform_gravity(Vec3::new(0.0, 0.0, -9.81));
        tau = to_v(&model, &at, &numbers(&golden["tau"]));
        forward_dynamics(&tree, &mut ws, &q, &vec![0.0; nv], &mut tau, &mut vdot).unwrap();
        worst = worst.max(relative(&vdot, &to_v(&model, &at, &numbers(&golden["vdot"]))));
        // In motion, with a null-space task that must not influence the tip, forward dynamics gives the acceleration.
        let (v, rest) = (model.multibody().random_v(3), model.multibody().random_v(4));
        one.forces(&mut robot, &v, &a, Some(&rest), &mut tau).unwrap();
        ws.clear_forces();
        ws.apply_uniform_gravity(Vec3::new(0.0, 0.0, -9.81));
        forward_dynamics(&tree, &mut ws, &q, &v, &mut tau, &mut vdot).unwrap();
        let tip = model.multibody().node("tip of part left").unwrap();
        let got = ws.node_acceleration(&tree, tip);
        let got: Vec<f64> = got.angular.iter().chain(got.linear.iter()).copied().collect();
        assert!(difference(&got, &a) < 1e-9, "{got:?}");
    }
    println!("operational space within {worst:.1e}");
    assert!(worst < 1e-9, "{worst}");
}

#[test]
fn a_thousand_grasps_leave_every_bit_as_it_was() {
    let Some(json) = reference("robodarts/dual_ur5_beam.json") else { return };
    let Some(shapes) = reference("robodarts/dual_ur5_collisions.json") else { return };
    let (_, X) = beam(&json);
    let half = Vec3::new(0.02, 0.3, 0.02);
    let skin = vec![ColliderSpec::new("wood", "beam", Shape::Box { half })];
    let parts = ["left", "right"]
        .map(|side| PartSpec::chain(side, &format!("{side}_base_link"), &format!("{side}_tcp")));
    let load = object("beam", 8.0, Vec3::new(0.0, 0.1, 0.0), Mat3::identity() * 0.1);
    let model = robot_in("robodarts/dual_ur5.urdf", &shapes, &parts, vec![load], skin);
    let hands = ["left", "right"].map(|p| model.part(p).unwrap());
    let beam = model.object("beam").unwrap();
    let at = places(&model, &names(&json["dof"]));
    let q = to_q(&model, &at, &numbers(&json["cases"][0]["q"]));
    let mut robot = Robot::new(&model);
    // Set padding, and allow contacts in addition to the rules.
    let id = |name: &str| model.collider(name).unwrap();
    let [wood, palm, table] = ["wood", "left_hand", "table"].map(id);
    for (which, padding) in [(wood, 0.004), (palm, 0.01)] {
        robot.pad(which, padding).unwrap();
    }
    robot.look_at(wood, table, Some(false)).unwrap();
    robot.look_at(palm, table, Some(false)).unwrap();
    let before_set = robot.clone();
    robot.set_q(&q).unwrap();
    let ids: Vec<ColliderId> = model.colliders().map(|c| c.0).collect();
    let all = |robot: &mut Robot| {
        let mut out = vec![0.0; model.nv()];
        robot.gravity_forces(&mut out).unwrap();
        let mut space = TaskSpace::new(robot, &hands).unwrap();
        out.extend_from_slice(space.compliance(robot).unwrap());
        // Record which pairs collide, and the distances of all pairs including padding.
        for a in &ids {
            for b in ids.iter().filter(|b| *b > a) {
                out.push(f64::from(u8::from(robot.looks_at(*a, *b).unwrap())));
                let d = robot.distance(&q, *a, *b).unwrap().unwrap();
                out.push(d.distance);
                out.extend(d.point_a.iter().chain(d.point_b.iter()));
            }
        }
        let mut hits = Vec::new();
        robot.hits(&q, &mut hits).unwrap();
        out.extend(hits.iter().flat_map(|h| [h.0, h.1]).map(|i| i.index() as f64));
        let mut near = Vec::new();
        robot.distances(&q, f64::INFINITY, &mut near).unwrap();
        out.extend(near.iter().map(|c| c.distance.distance));
        out.iter().map(|x| x.to_bits()).collect::<Vec<u64>>()
    };
    let before = all(&mut robot);
    let there = robot.object_pose(beam).unwrap();
    let mut rng = Rng(3);
    for k in 0..1000 {
        let grip = Pose::translation(rng.within(-0.1, 0.1), rng.within(-0.1, 0.1), 0.1);
        let hand = hands[k % 2];
        robot.grasp(hand, beam, Grasp::At(grip)).unwrap();
        if k % 3 == 0 {
            robot.grasp(hands[1 - k % 2], beam, Grasp::Here).unwrap();
            robot.release(hand, beam).unwrap();
        }
        if k % 100 == 0 {
            assert_ne!(all(&mut robot), before);
            let hand = robot.hold(beam).unwrap().unwrap().hand.0;
            robot.update_grasp(hand, beam, X[0]).unwrap();
        }
        let there = robot.object_pose(beam).unwrap();
        robot.ungrasp(beam).unwrap();
        assert_eq!(robot.object_pose(beam).unwrap(), there, "it stays in the world");
    }
    // The object stays in the world where it was released. When the hand takes it back, everything
    // is as before.
    robot.put(beam, there).unwrap();
    assert_eq!(all(&mut robot), before);
    // Neither an earlier instance nor a new one from the model is affected.
    let mut old = before_set;
    old.set_q(&q).unwrap();
    assert_eq!(all(&mut old), before);
    let mut new = Robot::new(&model);
    assert_ne!(all(&mut new), before, "padding and what may touch count");
    for (which, padding) in [(wood, 0.004), (palm, 0.01)] {
        new.pad(which, padding).unwrap();
    }
    new.look_at(wood, table, Some(false)).unwrap();
    new.look_at(palm, table, Some(false)).unwrap();
    new.set_q(&q).unwrap();
    assert_eq!(all(&mut new), before);
}

#[test]
fn hands_refuse_what_cannot_be() {
    let Some(json) = reference("robodarts/dual_ur5_beam.json") else { return };
    let (model, X) = beam(&json);
    let [left, right, gripper] = ["left", "right", "left_gripper"].map(|p| model.part(p).unwrap());
    let beam = model.object("beam").unwrap();
    let mut robot = Robot::new(&model);
    let mut tau = vec![0.0; model.nv()];
    let held_by_none = RobotError::NotHeld { object: 0 };
    assert_eq!(robot.ungrasp(beam), Err(held_by_none));
    assert_eq!(robot.balance(beam, Balance::Equal, &mut tau), Err(held_by_none));
    assert_eq!(robot.grasp(gripper, beam, Grasp::Here), Err(RobotError::NotAChain { part: 3 }));
    robot.grasp(left, beam, Grasp::At(X[0])).unwrap();
    assert_eq!(robot.grasp(left, beam, Grasp::Here), Err(RobotError::Held { object: 0 }));
    let open = robot.grasp(right, beam, Grasp::At(X[1])).unwrap_err();
    assert!(matches!(open, RobotError::LoopOpen { part: 1, .. }), "{open}");
    assert!(open.to_string().contains("help: move it there first"));
    assert_eq!(robot.squeeze(beam, 20.0, &mut tau), Err(RobotError::EmptyHand { part: 0 }));
    assert_eq!(robot.update_grasp(right, beam, X[1]), Err(RobotError::EmptyHand { part: 1 }));
    assert_eq!(robot.release(right, beam), Err(RobotError::EmptyHand { part: 1 }));
    assert_eq!(robot.put(beam, Pose::identity()), Err(RobotError::Held { object: 0 }));
    let nan = Pose::translation(f64::NAN, 0.0, 0.0);
    assert!(matches!(robot.update_grasp(left, beam, nan), Err(RobotError::NotFinite { .. })));
    robot.grasp(right, beam, Grasp::Here).unwrap();
    assert_eq!(robot.grasp(right, beam, Grasp::Here), Err(RobotError::Held { object: 0 }));
    tau[3] = f64::NAN;
    let nan = robot.balance(beam, Balance::Equal, &mut tau).unwrap_err();
    assert!(matches!(nan, RobotError::NotFinite { index: 3, .. }));
    // A neck of two joints does not have inertia in six directions.
    robot.ungrasp(beam).unwrap();
    let neck = model.part("neck").unwrap();
    let mut space = TaskSpace::new(&robot, &[neck]).unwrap();
    let singular = space.inertia(&mut robot, &mut [0.0; 36]).unwrap_err();
    assert!(matches!(singular, RobotError::Singular { .. }), "{singular}");
    let other = dual(vec![]).unwrap();
    assert_eq!(Robot::new(&other).object_pose(beam), Err(RobotError::ForeignHandle));
}

#[test]
fn a_prediction_knows_what_is_held_and_leaves_the_robot_where_it_is() {
    let beam = object("beam", 6.0, Vec3::new(0.0, 0.1, 0.2), Mat3::identity() * 0.05);
    let Some(model) = dual(vec![beam]) else { return };
    let (left, beam) = (model.part("left").unwrap(), model.object("beam").unwrap());
    let mut robot = Robot::new(&model);
    let (nv, q) = (model.nv(), model.multibody().random_q(3));
    robot.set_q(&q).unwrap();
    let mut predictor = Predictor::new(&robot);
    let (tau, density) = (model.multibody().random_v(8), vec![0.5; nv]);
    let mut go = |robot: &mut Robot, step: f64| {
        let (mut at, mut v) = (q.clone(), model.multibody().random_v(4));
        let mut P = vec![0.0; 4 * nv * nv];
        (0..2 * nv).for_each(|i| P[i * 2 * nv + i] = 1e-6);
        let state = StateEstimate { q: &mut at, v: &mut v, covariance: &mut P };
        robot.predict(&mut predictor, state, &tau, &density, step).unwrap();
        (at, v, P)
    };
    let empty = go(&mut robot, 1e-3);
    robot.grasp(left, beam, Grasp::Here).unwrap();
    let held = go(&mut robot, 1e-3);
    assert_eq!(robot.q(), q);
    assert!(difference(&empty.1, &held.1) > 1e-4, "what is held weighs something");
    // The acceleration of a short step needs the forces that drove it: inverse dynamics includes the same load.
    let (start, mut forces) = (model.multibody().random_v(4), vec![0.0; nv]);
    let short = go(&mut robot, 1e-6);
    let a: Vec<f64> = short.1.iter().zip(&start).map(|(b, a)| (b - a) / 1e-6).collect();
    robot.feed_forward(&start, &a, &[], &mut forces).unwrap();
    assert!(relative(&forces, &tau) < 2e-3, "{}", relative(&forces, &tau));
    robot.ungrasp(beam).unwrap();
    assert_eq!(go(&mut robot, 1e-3), empty);
    // An error does not change anything.
    let (mut at, mut v, mut P) = (q.clone(), vec![0.0; nv], vec![0.0; 4 * nv * nv]);
    let bad = vec![-1.0; nv];
    for (density, step) in [(&bad, 1e-3), (&density, -1.0), (&density, f64::NAN)] {
        let state = StateEstimate { q: &mut at, v: &mut v, covariance: &mut P };
        let told = robot.predict(&mut predictor, state, &tau, density, step).unwrap_err();
        assert!(matches!(told, RobotError::OutOfRange { .. }), "{told}");
    }
    assert!(at == q && v.iter().chain(&P).all(|x| *x == 0.0));
}
