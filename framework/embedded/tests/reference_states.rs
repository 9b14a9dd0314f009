//! Compares whole robots at random states with the reference: mass, centre, inertia, limits, torques of a wrench, trimmers in a hand; and the
//! remaining freedom of two hands on a beam.

use crate::support::*;
use linkwork_embedded::multibody::{BodySpec, Hinge};
use linkwork_embedded::spatial::nalgebra::DMatrix;
use linkwork_embedded::spatial::{Force, MassProperties, Mat3, Pose, Vec3};
use linkwork_embedded::*;
use serde_json::Value;
use std::sync::Arc;

fn vec3(v: &Value) -> Vec3 {
    Vec3::from_column_slice(&numbers(v))
}

fn mass_of(v: &Value) -> MassProperties {
    let inertia = Mat3::from_diagonal(&vec3(&v["I"]));
    MassProperties::new(v["mass"].as_f64().unwrap(), vec3(&v["com"]), inertia)
}

/// Both robots of the reference with the trimmers as an object, the name of the arm that carries loads, and the expected values.
fn robots() -> Vec<(Arc<RobotModel>, &'static str, Value)> {
    let Some(dual) = reference("robodarts/dual_ur5_kinematics.json") else { return Vec::new() };
    let mobile = reference("robodarts/mobile_iiwa_kinematics.json").unwrap();
    let cases = [("dual_ur5", "left", dual), ("mobile_iiwa", "arm", mobile)];
    let made = cases.map(|(name, hand, json)| {
        let path = file(&format!("robodarts/{name}.urdf"));
        let d = formats::read_file(path, &options()).unwrap();
        let mut spec = ModelSpec::from_description(&d).unwrap();
        for (arm, part) in json["parts"].as_object().unwrap() {
            let [base, tip] = ["base", "tip"].map(|k| part[k].as_str().unwrap());
            spec.parts.push(PartSpec::chain(arm, base, tip));
        }
        let t = &json["trimmers"];
        spec.objects.push(ObjectSpec { name: "a".into(), mass: mass_of(&t["a"]) });
        let p = vec3(&t["pin_in_a"]);
        let pin = BodySpec::new("b", "a").hinge(Hinge::pin(vec3(&t["pin_axis"])));
        let pin = pin.hinge_in_parent(Pose::translation(p.x, p.y, p.z));
        spec.linkages.body(pin.mass(mass_of(&t["b"])));
        (RobotModel::new(&spec).unwrap(), hand, json)
    });
    made.into()
}

/// Mass, centre and inertia about it of all moving bodies: the composite bodies of the first moving bodies, added up.
fn whole(model: &RobotModel, robot: &mut Robot) -> (f64, Vec3, Mat3) {
    let mbs = model.multibody();
    let carried = |id: multibody::BodyId| {
        let mut at = mbs.get(id).parent();
        while let Some(up) = at {
            if !mbs.get(up).v().is_empty() {
                return true;
            }
            at = mbs.get(up).parent();
        }
        false
    };
    let (mut mass, mut h, mut about) = (0.0, Vec3::zeros(), Mat3::zeros());
    for b in mbs.bodies().iter().filter(|b| !b.v().is_empty()) {
        let id = mbs.body(b.name()).unwrap();
        if carried(id) {
            continue;
        }
        let I = robot.composite_inertia(id);
        let p = robot.body_pose(id).position;
        // Shift the inertia from the body's origin to the origin of the world.
        let cross = |x: &Vec3| x.cross_matrix();
        about += I.inertia()
            - cross(&p) * cross(&I.h())
            - cross(&I.h()) * cross(&p)
            - cross(&p) * cross(&p) * I.mass();
        mass += I.mass();
        h += I.h() + p * I.mass();
    }
    let com = h / mass;
    let c = com.cross_matrix();
    (mass, com, about + c * c * mass)
}

#[test]
fn mass_center_inertia_and_torques_are_those_of_the_reference() {
    for (model, _, json) in robots() {
        let at = places(&model, &names(&json["dof"]));
        let mut robot = Robot::new(&model);
        let mut worst = [0.0_f64; 4];
        for state in json["states"].as_array().unwrap() {
            robot.set_q(&to_q(&model, &at, &numbers(&state["q"]))).unwrap();
            let (mass, com, inertia) = whole(&model, &mut robot);
            let told = robot.center_of_mass();
            let there = vec3(&state["com"]);
            worst[0] = worst[0].max((mass - state["mass"].as_f64().unwrap()).abs());
            worst[0] = worst[0].max((told.0 - mass).abs());
            worst[1] = worst[1].max((com - there).norm()).max((told.1 - there).norm());
            let theirs = rows(&state["inertia_about_com"]);
            let mut theirs = Mat3::from_row_slice(&theirs);
            if let Some(link) = model.multibody().body("lbr_iiwa_link_0") {
                // The file gives this link an inertia and zero mass. The reference includes the inertia; Linkwork
                // leaves it out and reports this.
                let R = robot.body_pose(link).rotation.to_rotation_matrix().into_inner();
                let own = Mat3::from_diagonal(&Vec3::new(0.05, 0.06, 0.03));
                theirs -= R * own * R.transpose();
            }
            worst[2] = worst[2].max((inertia - theirs).norm());
            let (mut still, mut pushing) = (vec![0.0; model.nv()], vec![0.0; model.nv()]);
            robot.gravity_forces(&mut still).unwrap();
            for (arm, expected) in state["arms"].as_object().unwrap() {
                let Some(golden) = expected.get("force_to_torque") else { continue };
                let part = model.part(arm).unwrap();
                let w = numbers(&golden["wrench"]);
                let (moment, force) =
                    (Vec3::from_column_slice(&w[..3]), Vec3::from_column_slice(&w[3..]));
                robot.held_still(&[Push::new(part, moment, force)], &mut pushing).unwrap();
                let added: Vec<f64> = pushing.iter().zip(&still).map(|(a, b)| a - b).collect();
                let theirs = to_v(&model, &at, &numbers(&golden["tau"]));
                let size = theirs.iter().fold(1.0, |m: f64, x| m.max(x.abs()));
                worst[3] = worst[3].max(difference(&added, &theirs) / size);
            }
        }
        println!("mass, centre, inertia, torques of a wrench within {worst:?}");
        assert!(worst[0] < 1e-10 && worst[1] < 1e-10, "{worst:?}");
        // The torques of the reference have a relative accuracy of 1e-9.
        assert!(worst[2] < 1e-10 && worst[3] < 1e-9, "{worst:?}");
    }
}

/// Degrees of freedom, and total mass including fixed bodies: as in the reference's table, to its digits, and as the sum of the file's own numbers.
#[test]
fn whole_robots_have_their_nominal_masses() {
    let nominal = [("dual_ur5", 18, 106.988), ("mobile_iiwa", 12, 138.5)];
    for ((model, ..), (name, dof, mass)) in robots().iter().zip(nominal) {
        let (mbs, text) = (model.multibody(), file(&format!("robodarts/{name}.urdf")));
        assert_eq!((mbs.nq(), mbs.nv()), (dof, dof));
        let ours = mbs.total_mass();
        assert!((ours - mass).abs() <= 0.5e-3, "{name}: {ours}");
        let text = std::fs::read_to_string(text).unwrap();
        let each = text.split("<mass value=\"").skip(1);
        let sum: f64 = each.map(|t| t.split('"').next().unwrap().parse::<f64>().unwrap()).sum();
        assert!((ours - sum).abs() < 1e-10, "{name}: {ours} {sum}");
    }
}

#[test]
fn limits_are_those_of_the_reference() {
    for (model, _, json) in robots() {
        let mbs = model.multibody();
        let at = places(&model, &names(&json["dof"]));
        let (lower, upper) = (numbers(&json["lower"]), numbers(&json["upper"]));
        for (k, (_, v)) in at.iter().enumerate() {
            let (_, s) = mbs.subhinges().find(|(_, s)| s.v.contains(v)).unwrap();
            let limits = &s.subhinge.limits;
            // A joint without limits has no limits in the reference, either, or limits that all its states
            // satisfy.
            if limits.lower.is_finite() {
                assert_eq!((limits.lower, limits.upper), (lower[k], upper[k]), "{k}");
            }
        }
    }
}

#[test]
fn trimmers_in_a_hand_weigh_what_the_reference_says() {
    for (model, hand, json) in robots() {
        let at = places(&model, &names(&json["dof"]));
        let (part, tool) = (model.part(hand).unwrap(), model.object("a").unwrap());
        let other = model.object_body(tool, "b").unwrap();
        let X = pose(&numbers(&json["trimmers"]["pose_of_a_in_tip"]));
        let mut robot = Robot::new(&model);
        let nv = model.nv();
        let (mut worst, rest) = ([0.0_f64; 3], vec![0.0; nv]);
        for state in json["states"].as_array().unwrap() {
            robot.set_q(&to_q(&model, &at, &numbers(&state["q"]))).unwrap();
            robot.grasp(part, tool, Grasp::At(X)).unwrap();
            robot.set_object_q(tool, &[state["trimmers_angle"].as_f64().unwrap()]).unwrap();
            let (mut tau, mut pin) = (vec![0.0; nv], [0.0]);
            let own = (&[0.0][..], &[0.0][..]);
            robot
                .feed_forward_with_object((&rest, &rest), tool, own, &[], &mut tau, &mut pin)
                .unwrap();
            let theirs = to_v(&model, &at, &numbers(&state["gravity_trimmers"]));
            let size = theirs.iter().fold(1.0, |m: f64, x| m.max(x.abs()));
            worst[0] = worst[0].max(difference(&tau, &theirs) / size);
            worst[1] =
                worst[1].max((pin[0] - state["trimmers_pin_torque"].as_f64().unwrap()).abs());
            let there = pose(&numbers(&state["trimmers_b_pose"]));
            let (p, R) = apart(&robot.object_body_pose(tool, other).unwrap(), &there);
            worst[2] = worst[2].max(p).max(R);
            robot.ungrasp(tool).unwrap();
        }
        println!("{hand}: forces, pin, place of the other handle within {worst:?}");
        assert!(worst[0] < 1e-9 && worst[1] < 1e-9 && worst[2] < 1e-10, "{worst:?}");
    }
}

/// Two fingers that press the handles with equal and opposite forces cause exactly zero arm torques, because the forces cancel in the sum.
#[test]
fn what_a_grip_presses_is_not_felt_by_the_arm() {
    let Some((model, hand, json)) = robots().into_iter().next() else { return };
    let at = places(&model, &names(&json["dof"]));
    let mut robot = Robot::new(&model);
    let part = model.part(hand).unwrap();
    let (mut still, mut gripping) = (vec![0.0; model.nv()], vec![0.0; model.nv()]);
    for state in json["states"].as_array().unwrap() {
        robot.set_q(&to_q(&model, &at, &numbers(&state["q"]))).unwrap();
        robot.gravity_forces(&mut still).unwrap();
        let press = |sign: f64| Push {
            part,
            wrench: Force::new(Vec3::zeros(), Vec3::new(7.3, 55.1, -3.7) * sign),
            at: Vec3::new(0.013, -0.007, 0.09),
        };
        robot.held_still(&[press(1.0), press(-1.0)], &mut gripping).unwrap();
        assert_eq!(still, gripping);
        // A single finger causes arm torques.
        robot.held_still(&[press(1.0)], &mut gripping).unwrap();
        assert!(difference(&still, &gripping) > 1.0);
    }
}

#[test]
fn two_hands_on_a_beam_leave_what_the_reference_says() {
    let Some(json) = reference("robodarts/dual_ur5_beam.json") else { return };
    let model = dual(vec![]).unwrap();
    let at = places(&model, &names(&json["dof"]));
    let hands = ["left", "right"].map(|p| model.part(p).unwrap());
    let mut robot = Robot::new(&model);
    let nv = model.nv();
    let arms: Vec<usize> = hands.iter().flat_map(|h| model.dofs(*h).unwrap().to_vec()).collect();
    let mut tau = vec![0.0; nv];
    for case in json["cases"].as_array().unwrap() {
        robot.set_q(&to_q(&model, &at, &numbers(&case["q"]))).unwrap();
        robot.gravity_forces(&mut tau).unwrap();
        let theirs = to_v(&model, &at, &numbers(&case["gravity_robot_alone"]));
        let size = theirs.iter().fold(1.0, |m: f64, x| m.max(x.abs()));
        assert!(difference(&tau, &theirs) < 1e-9 * size);
        // The rows of the closure are the motion of the right hand relative to the beam in the left hand, at the
        // right tip.
        let mut J = [vec![0.0; 6 * nv], vec![0.0; 6 * nv]];
        for (h, J) in hands.iter().zip(&mut J) {
            robot.whole_jacobian(*h, J).unwrap();
        }
        let [left, right] = hands.map(|h| robot.tip_pose(h).unwrap().position);
        let d = right - left;
        let moved = |J: &[f64], v: usize| {
            let [w, l] =
                [0, 3].map(|r| Vec3::new(J[r * nv + v], J[(r + 1) * nv + v], J[(r + 2) * nv + v]));
            let l = l + w.cross(&d);
            [w.x, w.y, w.z, l.x, l.y, l.z]
        };
        let C = DMatrix::from_fn(6, arms.len(), |r, k| {
            moved(&J[0], arms[k])[r] - J[1][r * nv + arms[k]]
        });
        let values = C.singular_values();
        let least = values.min();
        let golden = case["closure_smallest_singular_value"].as_f64().unwrap();
        println!("{least} {golden}");
        assert!((least - golden).abs() < 1e-10, "{least} {golden}");
        let rank = values.iter().filter(|s| **s > 1e-9 * values.max()).count() as u64;
        assert_eq!(Some(rank), case["closure_rank"].as_u64());
        assert_eq!(Some(arms.len() as u64 - rank), case["mobility_of_arms"].as_u64());
    }
}
