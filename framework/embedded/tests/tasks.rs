//! The tasks of the reference, as far as they are kinematics, loads and forces of an embedded model.

use crate::support::*;
use linkwork_embedded::spatial::{Force, MassProperties, Mat3, Motion, Pose, Vec3};
use linkwork_embedded::*;
use serde_json::Value;
use std::sync::Arc;

/// One task: what it says, and the robot for it.
struct Task {
    json: Value,
    model: Arc<RobotModel>,
    places: Vec<(usize, usize)>,
}

impl Task {
    fn new(name: &str, objects: impl Fn(&Value) -> Vec<ObjectSpec>) -> Option<Self> {
        let json = reference("robodarts/tasks.json")?["tasks"][name].clone();
        let objects = objects(&json["bodies"]);
        let model = if json["robot"] == "mobile_iiwa.urdf" {
            // The base counts: the arm's chain begins at the world.
            let parts = [PartSpec::chain("arm", "world", "tcp")];
            robot("robodarts/mobile_iiwa.urdf", &parts, objects)
        } else {
            dual(objects)?
        };
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

    /// Forces against the expectation, relative to the greatest of them.
    fn forces(&self, key: &str, tau: &[f64]) {
        let theirs = to_v(&self.model, &self.places, &numbers(self.expect(key)));
        let most = theirs.iter().fold(1.0, |m: f64, x| m.max(x.abs()));
        let off = difference(tau, &theirs) / most;
        assert!(off < 1e-8, "{key}: {off:e}");
    }

    fn number(&self, key: &str) -> f64 {
        self.expect(key).as_f64().unwrap()
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

/// A goal is met from a start by our own inverse kinematics, within 1e-9.
fn meets(robot: &mut Robot, part: Part, X: &Pose, start: &[f64]) {
    let mut q = start.to_vec();
    let answer =
        robot.reach(part, &Goal::pose(*X), Frame::World, &Effort::default(), &mut q).unwrap();
    assert_eq!(answer.outcome, Outcome::Met);
    let before = robot.q().to_vec();
    robot.set_q(&q).unwrap();
    let (p, R) = apart(&robot.tip_pose(part).unwrap(), X);
    assert!(p < 2e-9 && R < 2e-8, "{p:e} {R:e}");
    robot.set_q(&before).unwrap();
}

/// Columns of a tip's Jacobian about a point that moves with it.
fn columns(robot: &mut Robot, part: Part, about: &Vec3) -> Vec<[f64; 6]> {
    let nv = robot.model().nv();
    let mut J = vec![0.0; 6 * nv];
    robot.whole_jacobian(part, &mut J).unwrap();
    let r = about - robot.tip_pose(part).unwrap().position;
    let column = |i: usize| {
        let of =
            |row: usize| Vec3::new(J[row * nv + i], J[(row + 1) * nv + i], J[(row + 2) * nv + i]);
        let (w, v) = (of(0), of(3));
        let v = v + w.cross(&r);
        [w.x, w.y, w.z, v.x, v.y, v.z]
    };
    (0..nv).map(column).collect()
}

/// Degrees of freedom that are left to as many columns of closed loops, and the rank of their rows.
fn mobility(columns: &[[f64; 6]]) -> (usize, usize) {
    let J = spatial::nalgebra::DMatrix::from_fn(6, columns.len(), |i, j| columns[j][i]);
    let rank = J.rank(1e-6);
    (columns.len() - rank, rank)
}

#[test]
fn drill_hole() {
    let Some(task) = Task::new("drill_hole", |b| {
        let list = |v: &Value| numbers(v);
        let (d, battery) = (&b["driver"], &b["battery"]);
        vec![
            object("driver", mass(d), &list(&d["com"]), &list(&d["I"])),
            object("battery", mass(battery), &list(&battery["com"]), &list(&battery["I"])),
        ]
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
    robot.grasp(left, battery, Grasp::At(X_driver * X_battery)).unwrap();
    robot.gravity_forces(&mut tau).unwrap();
    task.forces("gravity_driver_and_battery", &tau);
    // Thrust along the bit and the reaction, at the bit's point.
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
    // The estimator moves the driver in the hand, and the battery with it.
    robot.update_grasp(left, driver, X_estimate).unwrap();
    robot.update_grasp(left, battery, X_estimate * X_battery).unwrap();
    robot.gravity_forces(&mut tau).unwrap();
    task.forces("gravity_after_estimate", &tau);
    robot.ungrasp(battery).unwrap();
    robot.ungrasp(driver).unwrap();
    robot.gravity_forces(&mut tau).unwrap();
    assert_eq!(tau, bare, "bit for bit");
    let mut untouched = untouched;
    untouched.set_q(&task.q("q")).unwrap();
    untouched.gravity_forces(&mut tau).unwrap();
    assert_eq!(tau, bare, "another instance has noticed nothing");
    // How well the tip moves along the bit without turning, and pushes along it.
    let m = robot.manipulability(left, Rows::All { length: 1.0 }, None).unwrap();
    let along = [0.0, 0.0, 0.0, axis.x, axis.y, axis.z];
    assert!((m.velocity(&along) - task.number("velocity_manipulability_along_bit")).abs() < 1e-8);
    assert!((m.force(&along) - task.number("force_manipulability_along_bit")).abs() < 1e-8);
}

#[test]
fn change_tyre() {
    let Some(task) = Task::new("change_tyre", |b| {
        vec![object("tyre", mass(&b["tyre"]), &[0.0; 3], &numbers(&b["tyre"]["inertia"]))]
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
    assert!(p < 1e-9 && R < 1e-7);
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
    assert!((share(&tau) - task.number("largest_share_all_on_left")).abs() < 1e-8);
    let found = robot.balance(tyre, Balance::Effort, &mut tau).unwrap();
    task.forces("balanced_by_effort", &tau);
    assert!((found.largest_share - task.number("largest_share_balanced")).abs() < 1e-8);
    assert!((share(&tau) - found.largest_share).abs() < 1e-12);
    // The second hand closes six rows.
    let tip = X_tyre.position;
    let [a, b] = [left, right].map(|p| columns(&mut robot, p, &tip));
    let loops: Vec<_> =
        arms.iter().map(|i| [0, 1, 2, 3, 4, 5].map(|k| a[*i][k] - b[*i][k])).collect();
    let count = |key: &str| task.expect(key).as_u64().unwrap() as usize;
    assert_eq!(mobility(&loops), (count("arms_mobility"), count("closure_rank")));
    assert_eq!(count("closure_rows"), 6);
    // Least squeeze of a friction grip: both hands carry half of the weight at μ.
    let force = mass(tyre_body) * 9.81 / 2.0 / task.number("friction");
    assert!((force - task.number("least_squeeze_force_per_hand")).abs() < 1e-9);
    let mut squeeze = vec![0.0; model.nv()];
    let wrenches = robot.squeeze(tyre, force, &mut squeeze).unwrap();
    task.forces("squeeze_torques", &squeeze);
    let weights = HandWeights { hands: [1.0, 1.0], moment: 100.0 };
    let told = robot.move_squeeze(tyre, &wrenches, &weights).unwrap();
    let norm = |w: &Force| w.force.norm() + w.moment.norm();
    assert!(norm(&told.net) < 1e-9 && told.moving.iter().all(|w| norm(w) < 1e-9));
    robot.ungrasp(tyre).unwrap();
    robot.gravity_forces(&mut tau).unwrap();
    task.forces("gravity_after_mounting", &tau);
    assert_eq!(tau, bare, "bit for bit");
    // Nuts on a circle about the hub's axis, the first below.
    let hub = pose(&numbers(&task.json["bodies"]["hub"]["pose"]));
    let nuts = &task.json["bodies"]["nuts"];
    let r = nuts["circle_radius"].as_f64().unwrap();
    let theirs = task.expect("nut_positions").as_array().unwrap();
    assert_eq!(theirs.len() as u64, nuts["count"].as_u64().unwrap());
    for (k, p) in theirs.iter().enumerate() {
        let (sin, cos) = (std::f64::consts::TAU * k as f64 / 5.0).sin_cos();
        let ours = hub.transform_point(&Vec3::new(r * cos, r * sin, 0.0));
        assert!((ours - Vec3::from_column_slice(&numbers(p))).norm() < 1e-12, "{k}: {ours}");
    }
}

#[test]
fn hang_up_phone() {
    let Some(task) = Task::new("hang_up_phone", |b| {
        vec![object("handset", mass(&b["handset"]), &[0.0; 3], &numbers(&b["handset"]["inertia"]))]
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
    let Some(task) = Task::new("key_and_door", |b| {
        let (m, h) = (mass(&b["key"]), numbers(&b["key"]["half"]));
        let side = |i: usize, j: usize| m / 3.0 * (h[i] * h[i] + h[j] * h[j]);
        vec![object("key", m, &[0.0; 3], &[side(1, 2), side(0, 2), side(0, 1)])]
    }) else {
        return;
    };
    let model = task.model.clone();
    let (arm, key) = (model.part("arm").unwrap(), model.object("key").unwrap());
    let X = pose(&numbers(&task.json["bodies"]["key"]["pose_in_tip"]));
    let mut robot = Robot::new(&model);
    let mut tau = vec![0.0; model.nv()];
    let at = |k: &str| pose(&numbers(task.expect(k)));
    for (pose, q) in
        [("grasp_pose", "q_grasp"), ("turned_pose", "q_turned"), ("opened_pose", "q_opened")]
    {
        robot.set_q(&task.q(q)).unwrap();
        let (p, R) = apart(&robot.tip_pose(arm).unwrap(), &at(pose));
        assert!(p < 1e-8 && R < 1e-7, "{pose}: {p:e} {R:e}");
        meets(&mut robot, arm, &at(pose), &task.q("q_grasp"));
    }
    robot.grasp(arm, key, Grasp::At(X)).unwrap();
    // The key in the lock closes six rows: lock and door turn about their pins.
    robot.set_q(&task.q("q_grasp")).unwrap();
    let about = robot.tip_pose(arm).unwrap().position;
    let mut loops: Vec<_> = columns(&mut robot, arm, &about);
    let dofs: Vec<usize> =
        names(&task.json["arm"]).iter().map(|j| model.coordinate(j).unwrap().1).collect();
    loops = dofs.iter().map(|i| loops[*i]).collect();
    let bodies = &task.json["bodies"];
    let vec3 = |v: &Value| Vec3::from_column_slice(&numbers(v));
    let origin = vec3(&bodies["door"]["origin"]);
    let lock_at = origin + vec3(&bodies["lock"]["origin_in_door"]);
    for (body, at, key) in [
        ("lock", lock_at, "mobility_with_key_in_lock_door_kept"),
        ("door", origin, "mobility_with_door_free"),
    ] {
        let axis = vec3(&bodies[body]["axis"]);
        let v = axis.cross(&(about - at));
        loops.push([axis.x, axis.y, axis.z, v.x, v.y, v.z].map(|x| -x));
        assert_eq!(mobility(&loops).0 as u64, task.expect(key).as_u64().unwrap(), "{key}");
    }
    // The lock's friction while turning about x; the closer and friction of the door while opening.
    robot.set_q(&task.q("q_turned")).unwrap();
    let lock = task.json["bodies"]["lock"]["friction_torque"].as_f64().unwrap();
    let turn = Push::new(arm, Vec3::new(lock, 0.0, 0.0), Vec3::zeros());
    robot.held_still(&[turn], &mut tau).unwrap();
    task.forces("feed_forward_turning", &tau);
    robot.set_q(&task.q("q_opened")).unwrap();
    let force = Vec3::from_column_slice(&numbers(task.expect("force_on_key")));
    assert!((force.norm() - task.number("force_norm")).abs() < 1e-9);
    robot.held_still(&[Push::new(arm, Vec3::zeros(), force)], &mut tau).unwrap();
    task.forces("feed_forward_opening", &tau);
    robot.ungrasp(key).unwrap();
    robot.gravity_forces(&mut tau).unwrap();
    task.forces("after_ungrasp_gravity", &tau);
}

#[test]
fn push_button() {
    let Some(task) = Task::new("push_button", |_| vec![]) else { return };
    let model = task.model.clone();
    let left = model.part("left").unwrap();
    let mut robot = Robot::new(&model);
    let at = |k: &str| pose(&numbers(task.expect(k)));
    for (pose, q) in [("touch_pose", "q_touch"), ("press_pose", "q_press")] {
        robot.set_q(&task.q(q)).unwrap();
        let (p, R) = apart(&robot.tip_pose(left).unwrap(), &at(pose));
        assert!(p < 1e-8 && R < 1e-7, "{pose}: {p:e} {R:e}");
        meets(&mut robot, left, &at(pose), &task.q("q_touch"));
    }
    let b = &task.json["bodies"]["button"];
    let of = |k: &str| b[k].as_f64().unwrap();
    let force = |x: f64| of("preload") + of("stiffness") * x + of("friction");
    assert!(
        (of("preload") + of("stiffness") * of("click") - task.number("force_at_click")).abs()
            < 1e-9
    );
    let stop = force(of("travel"));
    assert!((stop - task.number("force_at_stop")).abs() < 1e-9);
    robot.set_q(&task.q("q_press")).unwrap();
    let axis = Vec3::from_column_slice(&numbers(&b["axis"]));
    let mut tau = vec![0.0; model.nv()];
    robot.held_still(&[Push::new(left, Vec3::zeros(), axis * stop)], &mut tau).unwrap();
    task.forces("feed_forward_press", &tau);
    // 2 mm on: the least step of the joints.
    robot.set_q(&task.q("q_touch")).unwrap();
    let mut v = vec![0.0; model.nv()];
    let step = Motion::new(Vec3::zeros(), axis * 0.002);
    let missing = robot.rates(left, &step, &mut v).unwrap();
    assert!(missing.position < 1e-12 && missing.orientation < 1e-12);
    let golden = numbers(&task.expect("joint_step_for_2mm_on")["dq"]);
    let ours: Vec<f64> = model.dofs(left).unwrap().iter().map(|i| v[*i]).collect();
    assert!(difference(&ours, &golden) < 1e-9, "{ours:?}");
}
