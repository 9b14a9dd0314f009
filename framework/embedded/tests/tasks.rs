//! The tasks of the reference, as far as they concern kinematics, loads and forces of an embedded model.

use crate::support::*;
use linkwork_embedded::multibody::{BodySpec, Hinge, Limits};
use linkwork_embedded::spatial::{Force, MassProperties, Mat3, Motion, Pose, Vec3};
use linkwork_embedded::*;
use serde_json::Value;
use std::sync::Arc;

/// One task: its expected values and its robot.
struct Task {
    json: Value,
    model: Arc<RobotModel>,
    places: Vec<(usize, usize)>,
}

impl Task {
    /// Creates the task's robot, with its objects and everything attached to them.
    fn new(name: &str, change: impl Fn(&Value, &mut ModelSpec)) -> Option<Self> {
        let json = reference("robodarts/tasks.json")?["tasks"][name].clone();
        let at = format!("robodarts/{}", json["robot"].as_str()?);
        let d = formats::read_file(file(&at), &options()).unwrap();
        let mut spec = ModelSpec::from_description(&d).unwrap();
        if json["robot"] == "mobile_iiwa.urdf" {
            // The base moves, so the arm's chain starts at the world.
            spec.parts = vec![PartSpec::chain("arm", "world", "tcp")];
        } else {
            let srdf = formats::read_srdf(DUAL, &formats::ReadOptions::default()).unwrap();
            spec = spec.groups(&srdf, &d).unwrap();
        }
        change(&json["bodies"], &mut spec);
        let model = RobotModel::new(&spec).unwrap();
        let places = places(&model, &names(&json["dof"]));
        Some(Self { json, model, places })
    }

    fn expect(&self, key: &str) -> &Value {
        let found = &self.json["expect"][key];
        assert!(!found.is_null(), "{key}");
        found
    }

    fn q(&self, key: &str) -> Vec<f64> {
        to_q(&self.model, &self.places, &numbers(self.expect(key)))
    }

    /// Compares forces with the expected ones, relative to the largest.
    fn forces(&self, key: &str, tau: &[f64]) {
        let theirs = to_v(&self.model, &self.places, &numbers(self.expect(key)));
        let most = theirs.iter().fold(1.0, |m: f64, x| m.max(x.abs()));
        let off = difference(tau, &theirs) / most;
        assert!(off < 1e-8, "{key}: {off:e}");
    }

    fn number(&self, key: &str) -> f64 {
        self.expect(key).as_f64().unwrap()
    }

    /// Compares a number with the expected one, relative to it.
    fn near(&self, key: &str, ours: f64) {
        let theirs = self.number(key);
        assert!((ours - theirs).abs() < 1e-8 * theirs.abs(), "{key}: {ours} {theirs}");
    }
}

fn object(name: &str, mass: f64, com: &[f64], inertia: &[f64]) -> ObjectSpec {
    let I = Mat3::from_diagonal(&Vec3::from_column_slice(inertia));
    ObjectSpec {
        name: name.into(),
        mass: MassProperties::new(mass, Vec3::from_column_slice(com), I),
    }
}

fn mass(body: &Value) -> f64 {
    body["mass"].as_f64().unwrap()
}

/// Checks that inverse kinematics reaches a goal within 1e-9, starting 0.3 (rad, m) away in each coordinate of the part.
fn meets(robot: &mut Robot, part: Part, X: &Pose, near: &[f64]) {
    let mut q = near.to_vec();
    let model = robot.model().clone();
    let dofs = model.dofs(part).unwrap();
    for (_, s) in model.multibody().subhinges().filter(|(_, s)| dofs.contains(&s.v.start)) {
        let up = q[s.q.start] + 0.3 <= s.subhinge.limits.upper;
        q[s.q.start] += if up { 0.3 } else { -0.3 };
    }
    let effort = Effort { tolerances: [4e-10; 2], ..Effort::default() };
    let answer =
        robot.inverse_kinematics(part, &Goal::pose(*X), Frame::World, &effort, &mut q).unwrap();
    assert_eq!(answer.outcome, Outcome::Met);
    let before = robot.q().to_vec();
    robot.set_q(&q).unwrap();
    let (p, R) = apart(&robot.tip_pose(part).unwrap(), X);
    assert!(p < 1e-9 && R < 1e-9, "{p:e} {R:e}");
    robot.set_q(&before).unwrap();
}

/// Returns velocities of a point of an object's body, for a unit rate of each of its joints: [ω; v].
fn columns(robot: &mut Robot, object: Object, body: &str, p: &Vec3) -> Vec<[Vec3; 2]> {
    let body = robot.model().object_body(object, body).unwrap();
    let n = robot.object_q(object).unwrap().len();
    let mut J = vec![0.0; 6 * n];
    robot.object_jacobian(object, body, &mut J).unwrap();
    let r = p - robot.object_body_pose(object, body).unwrap().position;
    let column = |i: usize| {
        let of = |row: usize| Vec3::new(J[row * n + i], J[(row + 1) * n + i], J[(row + 2) * n + i]);
        [of(0), of(3) + of(0).cross(&r)]
    };
    (0..n).map(column).collect()
}

/// Returns the index of an object's joint among its degrees of freedom.
fn joint(model: &RobotModel, object: Object, body: &str) -> usize {
    let multibody = model.object_multibody(object).unwrap();
    multibody.get(multibody.body(body).unwrap()).v().start - 6
}

/// A body with joints that is fixed in the world. The objects on it get their mass from the task.
fn stand(name: &str) -> ObjectSpec {
    object(name, 10.0, &[0.0; 3], &[0.1; 3])
}

fn vec3(v: &Value) -> Vec3 {
    Vec3::from_column_slice(&numbers(v))
}

#[test]
fn drill_hole() {
    let Some(task) = Task::new("drill_hole", |b, spec| {
        let list = |v: &Value| numbers(v);
        let (d, battery) = (&b["driver"], &b["battery"]);
        spec.objects = vec![
            object("driver", mass(d), &list(&d["com"]), &list(&d["I"])),
            object("battery", mass(battery), &list(&battery["com"]), &list(&battery["I"])),
        ];
    }) else {
        return;
    };
    let bodies = &task.json["bodies"];
    let at = |v: &Value| pose(&numbers(v));
    let [X_driver, X_battery, X_estimate] = [
        at(&bodies["driver"]["pose_in_tip"]),
        at(&bodies["battery"]["pose_in_driver"]),
        at(task.expect("estimator_pose_in_tip")),
    ];
    let model = task.model.clone();
    let [driver, battery] = ["driver", "battery"].map(|o| model.object(o).unwrap());
    let left = model.part("left").unwrap();
    let mut robot = Robot::new(&model);
    let untouched = robot.clone();
    robot.set_q(&task.q("q")).unwrap();
    let mut tau = vec![0.0; model.nv()];
    robot.gravity_forces(&mut tau).unwrap();
    task.forces("gravity_bare", &tau);
    let bare = tau.clone();
    robot.grasp(left, driver, Grasp::At(X_driver)).unwrap();
    robot.gravity_forces(&mut tau).unwrap();
    task.forces("gravity_driver", &tau);
    robot.attach(battery, driver, None, Grasp::At(X_battery)).unwrap();
    robot.gravity_forces(&mut tau).unwrap();
    task.forces("gravity_driver_and_battery", &tau);
    // Thrust along the bit and the reaction torque act at the tip of the bit.
    let p_bit = X_driver
        .transform_point(&Vec3::from_column_slice(&numbers(&bodies["driver"]["bit_in_driver"])));
    let X = robot.tip_pose(left).unwrap();
    let bit = X.transform_point(&p_bit);
    assert!(difference(bit.as_slice(), &numbers(task.expect("bit_at"))) < 1e-9);
    let w = numbers(task.expect("wrench_applied_at_bit"));
    let (moment, force) = (Vec3::from_column_slice(&w[..3]), Vec3::from_column_slice(&w[3..]));
    let axis = X.rotation * Vec3::z();
    assert!((force - axis * task.number("thrust")).norm() < 1e-8);
    robot.held_still(&[Push::new(left, moment, force).at(p_bit)], &mut tau).unwrap();
    task.forces("feed_forward_drilling", &tau);
    // The estimator moves the driver in the hand, and with it the battery.
    robot.update_grasp(left, driver, X_estimate).unwrap();
    robot.gravity_forces(&mut tau).unwrap();
    task.forces("gravity_after_estimate", &tau);
    robot.detach(battery).unwrap();
    robot.ungrasp(driver).unwrap();
    robot.gravity_forces(&mut tau).unwrap();
    assert_eq!(tau, bare, "bit for bit");
    let mut untouched = untouched;
    untouched.set_q(&task.q("q")).unwrap();
    untouched.gravity_forces(&mut tau).unwrap();
    assert_eq!(tau, bare, "another instance has noticed nothing");
    // Compare the manipulability of the tip along the bit without rotation, and the force
    // capability along it.
    let m = robot.manipulability(left, Rows::All { length: 1.0 }, None).unwrap();
    let along = [0.0, 0.0, 0.0, axis.x, axis.y, axis.z];
    task.near("velocity_manipulability_along_bit", m.velocity(&along));
    task.near("force_manipulability_along_bit", m.force(&along));
    // The hole acts on the chuck with the full reaction torque, against the rotation of the bit.
    assert!((moment + axis * task.number("reaction_torque")).norm() < 1e-8, "{moment}");
}

#[test]
fn change_tyre() {
    let Some(task) = Task::new("change_tyre", |b, spec| {
        let tyre = object("tyre", mass(&b["tyre"]), &[0.0; 3], &numbers(&b["tyre"]["inertia"]));
        spec.objects = vec![tyre, stand("axle")];
        // The hub rotates on the axle; its studs are on a circle, the first at the bottom.
        let nuts = &b["nuts"];
        let hinge = Hinge::pin(Vec3::z());
        let steel = MassProperties::new(4.0, Vec3::zeros(), Mat3::identity() * 0.01);
        spec.linkages.body(BodySpec::new("hub", "axle").hinge(hinge).mass(steel));
        let r = nuts["circle_radius"].as_f64().unwrap();
        for k in 0..nuts["count"].as_u64().unwrap() {
            let turn = Vec3::z() * (std::f64::consts::TAU * k as f64 / 5.0);
            let at = Pose::new(spatial::Quat::from_scaled_axis(turn), Vec3::zeros());
            let stud = at * Pose::translation(r, 0.0, 0.0);
            spec.linkages.body(BodySpec::new(format!("stud {k}"), "hub").hinge_in_parent(stud));
            spec.objects.push(object(&format!("nut {k}"), mass(nuts), &[0.0; 3], &[1e-6; 3]));
        }
    }) else {
        return;
    };
    let tyre_body = &task.json["bodies"]["tyre"];
    let X =
        ["left_tip_in_tyre", "right_tip_in_tyre"].map(|k| pose(&numbers(&tyre_body[k])).inverse());
    let model = task.model.clone();
    let [left, right] = ["left", "right"].map(|p| model.part(p).unwrap());
    let tyre = model.object("tyre").unwrap();
    let mut robot = Robot::new(&model);
    let q = task.q("q");
    robot.set_q(&q).unwrap();
    let mut tau = vec![0.0; model.nv()];
    robot.gravity_forces(&mut tau).unwrap();
    let bare = tau.clone();
    let X_tyre = pose(&numbers(task.expect("tyre_pose")));
    for (part, X) in [left, right].into_iter().zip(&X) {
        meets(&mut robot, part, &(X_tyre * X.inverse()), &q);
    }
    robot.grasp(left, tyre, Grasp::At(X[0])).unwrap();
    robot.grasp(right, tyre, Grasp::At(X[1])).unwrap();
    let (p, R) = apart(&robot.object_pose(tyre).unwrap(), &X_tyre);
    assert!(p < 1e-9 && R < 1e-10, "{p:e} {R:e}");
    robot.gravity_forces(&mut tau).unwrap();
    task.forces("gravity_all_on_left", &tau);
    let effort = |v: usize| {
        let of =
            |s: &multibody::SubhingeRange| s.v.contains(&v).then_some(s.subhinge.limits.effort);
        model.multibody().subhinges().find_map(|(_, s)| of(s)).unwrap()
    };
    let arms: Vec<usize> =
        [left, right].iter().flat_map(|p| model.dofs(*p).unwrap()).copied().collect();
    let share = |tau: &[f64]| arms.iter().map(|v| tau[*v].abs() / effort(*v)).fold(0.0, f64::max);
    task.near("largest_share_all_on_left", share(&tau));
    let found = robot.balance(tyre, Balance::Effort, &mut tau).unwrap();
    task.forces("balanced_by_effort", &tau);
    task.near("largest_share_balanced", found.largest_share);
    assert!((share(&tau) - found.largest_share).abs() < 1e-12);
    // The grasp of the second hand adds six constraint rows.
    let count = |key: &str| task.expect(key).as_u64().unwrap() as usize;
    let closure = robot.closure(Closing::Hands(tyre)).unwrap();
    let theirs = ["closure_rows", "closure_rank", "arms_mobility"].map(count);
    assert_eq!([closure.rows, closure.rank, closure.mobility], theirs);
    // Find the least squeeze of a friction grip. Start from hands that carry half of the weight each and do not
    // press.
    let force = task.number("least_squeeze_force_per_hand");
    let half = Force::new(Vec3::zeros(), Vec3::z() * (0.5 * mass(tyre_body) * 9.81));
    let towards = |from: Part, to: Part, robot: &mut Robot| {
        let [a, b] = [from, to].map(|p| robot.tip_pose(p).unwrap());
        a.rotation.inverse() * (b.position - a.position)
    };
    let lines = [towards(left, right, &mut robot), towards(right, left, &mut robot)];
    let coefficient = task.number("friction");
    let friction =
        |most: f64| lines.map(|normal| Friction { normal, coefficient, radius: 0.02, most });
    let held = robot.grip(tyre, &[half; 2], &friction(f64::INFINITY)).unwrap();
    assert_eq!(held.shortfall, 0.0);
    let tips = [left, right].map(|p| robot.tip_pose(p).unwrap());
    for (w, (line, tip)) in held.wrenches.iter().zip(lines.iter().zip(&tips)) {
        let press = w.force.dot(&(tip.rotation * line).normalize());
        assert!((press / force - 1.0).abs() < 1e-5, "{press} {force}");
    }
    // Hands whose force is limited to a newton less cannot hold the tyre.
    let weak = robot.grip(tyre, &[half; 2], &friction(force - 1.0)).unwrap();
    assert!(weak.shortfall > 0.1, "{weak:?}");
    // A feasible grip is returned unchanged, so the least force lies between two values that differ by a fraction
    // of 2e-8.
    for (share, holds) in [(1.0 + 1e-8, true), (1.0 - 1e-8, false)] {
        let mut given = [half; 2];
        for (w, (line, tip)) in given.iter_mut().zip(lines.iter().zip(&tips)) {
            w.force += (tip.rotation * line).normalize() * (force * share);
        }
        let told = robot.grip(tyre, &given, &friction(f64::INFINITY)).unwrap();
        assert_eq!(told.wrenches == given, holds, "{share}: {told:?}");
        assert_eq!(told.shortfall, 0.0);
    }
    let mut squeeze = vec![0.0; model.nv()];
    let wrenches = robot.squeeze(tyre, force, &mut squeeze).unwrap();
    task.forces("squeeze_torques", &squeeze);
    let weights = HandWeights { hands: [1.0, 1.0], moment: 100.0 };
    let told = robot.split_hand_wrenches(tyre, &wrenches, &weights).unwrap();
    let norm = |w: &Force| w.force.norm() + w.moment.norm();
    assert!(norm(&told.net) < 1e-9 && told.moving.iter().all(|w| norm(w) < 1e-9));
    robot.ungrasp(tyre).unwrap();
    robot.gravity_forces(&mut tau).unwrap();
    task.forces("gravity_after_mounting", &tau);
    assert_eq!(tau, bare, "bit for bit");
    // Mount the tyre: put the hub, with the studs around its axis, into the world.
    let axle = model.object("axle").unwrap();
    let hub = pose(&numbers(&task.json["bodies"]["hub"]["pose"]));
    robot.put(axle, hub).unwrap();
    // Attach the tyre to the hub at the place where both hands released it.
    let on_hub = model.object_body(axle, "hub").unwrap();
    robot.attach(tyre, axle, Some(on_hub), Grasp::Here).unwrap();
    let X = robot.mount(tyre).unwrap().unwrap().pose;
    let (p, R) = apart(&X, &Pose::identity());
    assert!(p < 1e-12 && R < 1e-10, "{p:e} {R:e}");
    let (p, R) = apart(&robot.object_pose(tyre).unwrap(), &X_tyre);
    assert!(p < 1e-12 && R < 1e-10, "{p:e} {R:e}");
    let theirs = task.expect("nut_positions").as_array().unwrap();
    let nuts: Vec<Object> =
        (0..theirs.len()).map(|k| model.object(&format!("nut {k}")).unwrap()).collect();
    assert_eq!(theirs.len() as u64, task.json["bodies"]["nuts"]["count"].as_u64().unwrap());
    for ((k, p), &nut) in theirs.iter().enumerate().zip(&nuts) {
        let stud = model.object_body(axle, &format!("stud {k}")).unwrap();
        let there = robot.object_body_pose(axle, stud).unwrap();
        // The hand brings the nut to the stud and releases it there.
        let tip = robot.tip_pose(left).unwrap();
        robot.grasp(left, nut, Grasp::At(tip.inverse() * there)).unwrap();
        robot.ungrasp(nut).unwrap();
        robot.attach(nut, axle, Some(on_hub), Grasp::Here).unwrap();
        let ours = robot.object_pose(nut).unwrap().position;
        assert!((ours - vec3(p)).norm() < 1e-12, "{k}: {ours}");
    }
    robot.gravity_forces(&mut tau).unwrap();
    assert_eq!(tau, bare, "bit for bit: nothing is held any more");
    // Tyre and nuts rotate with the hub, against the friction of its pin: 0.4 N m.
    let on: Vec<(Object, Pose)> =
        (nuts.iter().chain([&tyre])).map(|o| (*o, robot.object_pose(*o).unwrap())).collect();
    let angle = 0.7;
    robot.set_object_q(axle, &[angle]).unwrap();
    let axis = hub.rotation * Vec3::z();
    let turn = Pose::translation(hub.position.x, hub.position.y, hub.position.z)
        * Pose::new(spatial::Quat::from_scaled_axis(axis * angle), Vec3::zeros())
        * Pose::translation(-hub.position.x, -hub.position.y, -hub.position.z);
    for (object, X) in on {
        let (p, R) = apart(&robot.object_pose(object).unwrap(), &(turn * X));
        assert!(p < 1e-12 && R < 1e-7, "{p:e} {R:e}");
    }
    let mut J = [0.0; 6];
    robot.object_jacobian(axle, on_hub, &mut J).unwrap();
    let words = task.json["bodies"]["hub"]["joint_after_mounting"].as_str().unwrap();
    let friction: f64 = words.split_whitespace().rev().nth(2).unwrap().parse().unwrap();
    let moment = axis * friction;
    let felt = Vec3::new(J[0], J[1], J[2]).dot(&moment);
    assert!((felt - 0.4).abs() < 1e-12, "{felt}");
}

#[test]
fn hang_up_phone() {
    let Some(task) = Task::new("hang_up_phone", |b, spec| {
        let h = &b["handset"];
        spec.objects = vec![object("handset", mass(h), &[0.0; 3], &numbers(&h["inertia"]))];
    }) else {
        return;
    };
    let model = task.model.clone();
    let (left, handset) = (model.part("left").unwrap(), model.object("handset").unwrap());
    let X = pose(&numbers(&task.json["bodies"]["handset"]["pose_in_tip"]));
    let mut robot = Robot::new(&model);
    let mut tau = vec![0.0; model.nv()];
    robot.set_q(&task.q("q_up")).unwrap();
    robot.grasp(left, handset, Grasp::At(X)).unwrap();
    robot.gravity_forces(&mut tau).unwrap();
    task.forces("gravity_held", &tau);
    robot.set_q(&task.q("q_on")).unwrap();
    let there = robot.object_pose(handset).unwrap();
    robot.ungrasp(handset).unwrap();
    robot.set_q(&task.q("q_up")).unwrap();
    assert_eq!(robot.object_pose(handset).unwrap(), there, "it stays on the cradle");
    robot.set_q(&task.q("q_on")).unwrap();
    robot.gravity_forces(&mut tau).unwrap();
    task.forces("gravity_after", &tau);
}

#[test]
fn key_and_door() {
    let Some(task) = Task::new("key_and_door", |b, spec| {
        let (m, h) = (mass(&b["key"]), numbers(&b["key"]["half"]));
        let side = |i: usize, j: usize| m / 3.0 * (h[i] * h[i] + h[j] * h[j]);
        let key = object("key", m, &[0.0; 3], &[side(1, 2), side(0, 2), side(0, 1)]);
        spec.objects = vec![key, stand("frame")];
        let (door, lock) = (&b["door"], &b["lock"]);
        let limits = |v: &Value| {
            let l = numbers(&v["limits"]);
            Limits::position(l[0], l[1])
        };
        let hinge = |v: &Value| Hinge::pin(vec3(&v["axis"])).limits(limits(v));
        let h = numbers(&door["half"]);
        let side = |i: usize, j: usize| mass(door) / 3.0 * (h[i] * h[i] + h[j] * h[j]);
        let moments = Vec3::new(side(1, 2), side(0, 2), side(0, 1));
        let com = vec3(&door["com_in_hinge"]);
        let leaf = MassProperties::new(mass(door), com, Mat3::from_diagonal(&moments));
        spec.linkages.body(BodySpec::new("door", "frame").hinge(hinge(door)).mass(leaf));
        let plug = MassProperties::new(0.2, Vec3::zeros(), Mat3::identity() * 1e-4);
        let plug = BodySpec::new("lock", "door").hinge(hinge(lock)).mass(plug);
        let at = vec3(&lock["origin_in_door"]);
        spec.linkages.body(plug.hinge_in_parent(Pose::translation(at.x, at.y, at.z)));
    }) else {
        return;
    };
    let model = task.model.clone();
    let [key, frame] = ["key", "frame"].map(|o| model.object(o).unwrap());
    let arm = model.part("arm").unwrap();
    let X = pose(&numbers(&task.json["bodies"]["key"]["pose_in_tip"]));
    let bodies = &task.json["bodies"];
    let mut robot = Robot::new(&model);
    let mut tau = vec![0.0; model.nv()];
    let origin = vec3(&bodies["door"]["origin"]);
    robot.put(frame, Pose::translation(origin.x, origin.y, origin.z)).unwrap();
    let at = |k: &str| pose(&numbers(task.expect(k)));
    for (pose, q) in
        [("grasp_pose", "q_grasp"), ("turned_pose", "q_turned"), ("opened_pose", "q_opened")]
    {
        robot.set_q(&task.q(q)).unwrap();
        let (p, R) = apart(&robot.tip_pose(arm).unwrap(), &at(pose));
        assert!(p < 1e-10 && R < 1e-10, "{pose}: {p:e} {R:e}");
        meets(&mut robot, arm, &at(pose), &task.q("q_grasp"));
    }
    robot.set_q(&task.q("q_grasp")).unwrap();
    robot.grasp(arm, key, Grasp::At(X)).unwrap();
    // The key in the lock adds six rows: the lock rotates, and so does the door after it is
    // unlocked.
    let lock = model.object_body(frame, "lock").unwrap();
    let [at_door, at_lock] = ["door", "lock"].map(|b| joint(&model, frame, b));
    let kept = [0, 1].map(|k| k == at_lock);
    for (free, key) in
        [(kept, "mobility_with_key_in_lock_door_kept"), ([true; 2], "mobility_with_door_free")]
    {
        let onto = Closing::Onto { hand: arm, object: frame, body: lock, free: &free };
        let closure = robot.closure(onto).unwrap();
        let mobility = task.expect(key).as_u64().unwrap() as usize;
        assert_eq!(closure, ClosureRank { rows: 6, rank: 6, mobility }, "{key}");
    }
    // The loop stays closed: the key keeps its pose in the lock, rotated and with the door opened.
    let in_lock = |robot: &mut Robot| {
        let X_lock = robot.object_body_pose(frame, lock).unwrap();
        X_lock.inverse() * robot.object_pose(key).unwrap()
    };
    let as_put = in_lock(&mut robot);
    let most = numbers(&bodies["lock"]["limits"])[1];
    let mut theta = [0.0; 2];
    theta[at_lock] = most;
    for (q, door) in [("q_turned", 0.0), ("q_opened", -30.0_f64.to_radians())] {
        theta[at_door] = door;
        robot.set_q(&task.q(q)).unwrap();
        robot.set_object_q(frame, &theta).unwrap();
        let (p, R) = apart(&in_lock(&mut robot), &as_put);
        assert!(p < 1e-10 && R < 1e-10, "{q}: {p:e} {R:e}");
    }
    // A moment about the axis of the lock balances its friction while it rotates.
    theta[at_door] = 0.0;
    robot.set_q(&task.q("q_turned")).unwrap();
    robot.set_object_q(frame, &theta).unwrap();
    let tip = robot.tip_pose(arm).unwrap().position;
    let friction = bodies["lock"]["friction_torque"].as_f64().unwrap();
    let w = columns(&mut robot, frame, "lock", &tip)[at_lock][0];
    let turn = Push::new(arm, w * (friction / w.norm_squared()), Vec3::zeros());
    robot.held_still(&[turn], &mut tau).unwrap();
    task.forces("feed_forward_turning", &tau);
    // Compute the forces of the door closer and of friction while the door opens, and the least force at the tip, which
    // is perpendicular to the line to the pin.
    theta[at_door] = -30.0_f64.to_radians();
    robot.set_q(&task.q("q_opened")).unwrap();
    robot.set_object_q(frame, &theta).unwrap();
    let tip = robot.tip_pose(arm).unwrap().position;
    let v = columns(&mut robot, frame, "lock", &tip)[at_door][1];
    let closer = bodies["door"]["closer_plus_friction_torque"].as_f64().unwrap();
    let force = -v * (closer / v.norm_squared());
    let golden = vec3(task.expect("force_on_key"));
    assert!((force - golden).norm() < 1e-8 * golden.norm(), "{force} {golden}");
    task.near("force_norm", force.norm());
    robot.held_still(&[Push::new(arm, Vec3::zeros(), force)], &mut tau).unwrap();
    task.forces("feed_forward_opening", &tau);
    // The key stays in the lock after the hand has released it, so the arm has no load.
    robot.ungrasp(key).unwrap();
    robot.gravity_forces(&mut tau).unwrap();
    task.forces("after_ungrasp_gravity", &tau);
    let mut bare = Robot::new(&model);
    bare.set_q(&task.q("q_opened")).unwrap();
    let mut theirs = vec![0.0; model.nv()];
    bare.gravity_forces(&mut theirs).unwrap();
    assert_eq!(tau, theirs, "bit for bit");
    // After it is attached to the lock, the key stays in the lock for all poses of arm, door and
    // lock.
    robot.attach(key, frame, Some(lock), Grasp::Here).unwrap();
    robot.set_q(&task.q("q_grasp")).unwrap();
    robot.set_object_q(frame, &[0.0; 2]).unwrap();
    let (p, R) = apart(&in_lock(&mut robot), &as_put);
    assert!(p < 1e-9 && R < 1e-10, "{p:e} {R:e}");
}

#[test]
fn push_button() {
    let Some(task) = Task::new("push_button", |b, spec| {
        spec.objects = vec![stand("panel")];
        let (button, axis) = (&b["button"], vec3(&b["button"]["axis"]));
        let limits = numbers(&button["limits"]);
        let hinge = Hinge::slider(axis).limits(Limits::position(limits[0], limits[1]));
        let cap = MassProperties::new(mass(button), Vec3::zeros(), Mat3::identity() * 1e-6);
        spec.linkages.body(BodySpec::new("button", "panel").hinge(hinge).mass(cap));
    }) else {
        return;
    };
    let model = task.model.clone();
    let (left, panel) = (model.part("left").unwrap(), model.object("panel").unwrap());
    let button = model.object_body(panel, "button").unwrap();
    let b = &task.json["bodies"]["button"];
    let mut robot = Robot::new(&model);
    let face = vec3(&b["face"]);
    robot.put(panel, Pose::translation(face.x, face.y, face.z)).unwrap();
    let at = |k: &str| pose(&numbers(task.expect(k)));
    for (pose, q) in [("touch_pose", "q_touch"), ("press_pose", "q_press")] {
        robot.set_q(&task.q(q)).unwrap();
        let (p, R) = apart(&robot.tip_pose(left).unwrap(), &at(pose));
        assert!(p < 1e-10 && R < 1e-10, "{pose}: {p:e} {R:e}");
        meets(&mut robot, left, &at(pose), &task.q("q_touch"));
    }
    let of = |k: &str| b[k].as_f64().unwrap();
    // The button moves along with the tip on its face. Compute its depth, and the force of its spring with friction
    // while it is pressed.
    let axis = vec3(&b["axis"]);
    let pressed = |x: f64, robot: &mut Robot| {
        let mut q = task.q("q_touch");
        let to = Pose::new(at("touch_pose").rotation, face + axis * x);
        let effort = Effort { tolerances: [1e-12; 2], ..Effort::default() };
        let answer =
            robot.inverse_kinematics(left, &Goal::pose(to), Frame::World, &effort, &mut q).unwrap();
        assert_eq!(answer.outcome, Outcome::Met);
        robot.set_q(&q).unwrap();
        let tip = robot.tip_pose(left).unwrap().position;
        let v = columns(robot, panel, "button", &tip)[0][1];
        let in_by = v.dot(&(tip - face)) / v.norm_squared();
        robot.set_object_q(panel, &[in_by]).unwrap();
        let there = robot.object_body_pose(panel, button).unwrap().position;
        assert!((there - tip).norm() < 1e-11, "{there} {tip}");
        (of("preload") + of("stiffness") * in_by, v / v.norm_squared())
    };
    let (click, _) = pressed(of("click"), &mut robot);
    task.near("force_at_click", click);
    let (spring, along) = pressed(of("travel"), &mut robot);
    let stop = spring + of("friction");
    task.near("force_at_stop", stop);
    robot.set_q(&task.q("q_press")).unwrap();
    let mut tau = vec![0.0; model.nv()];
    robot.held_still(&[Push::new(left, Vec3::zeros(), along * stop)], &mut tau).unwrap();
    task.forces("feed_forward_press", &tau);
    // Press 2 mm further with the smallest step of the joints.
    robot.set_q(&task.q("q_touch")).unwrap();
    let mut v = vec![0.0; model.nv()];
    let step = Motion::new(Vec3::zeros(), axis * 0.002);
    let missing = robot.rates(left, &step, &mut v).unwrap();
    assert!(missing.position < 1e-12 && missing.orientation < 1e-12);
    let golden = numbers(&task.expect("joint_step_for_2mm_on")["dq"]);
    let ours: Vec<f64> = model.dofs(left).unwrap().iter().map(|i| v[*i]).collect();
    let most = golden.iter().fold(0.0, |m: f64, x| m.max(x.abs()));
    assert!(difference(&ours, &golden) < 1e-8 * most, "{ours:?}");
}
