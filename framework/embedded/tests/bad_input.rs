//! Invalid input returns an error with its type and a remedy. If a best approximation exists, it is returned as well.

use linkwork_embedded::multibody::{BodySpec, Builder, Hinge, Limits};
use linkwork_embedded::spatial::{Force, MassProperties, Mat3, Pose, Vec3};
use linkwork_embedded::*;
use std::sync::Arc;

fn body(name: &str, parent: &str, hinge: Hinge, at: [f64; 3]) -> BodySpec {
    let mass = MassProperties::new(1.0, Vec3::new(0.1, 0.0, 0.0), Mat3::identity() * 0.01);
    let at = Pose::translation(at[0], at[1], at[2]);
    BodySpec::new(name, parent)
        .hinge(hinge.limits(Limits { effort: 20.0, ..Limits::position(-2.0, 2.0) }))
        .hinge_in_parent(at)
        .mass(mass)
}

/// Two parallel arms of three joints, a plate that each may hold, and a table below.
fn spec() -> ModelSpec {
    let mut mechanism = Builder::new();
    for (side, y) in [("left", 0.3), ("right", -0.3)] {
        let [a, b, c] = ["upper", "fore", "hand"].map(|n| format!("{side} {n}"));
        mechanism.body(body(&a, "world", Hinge::pin(Vec3::y()), [0.0, y, 0.0]));
        mechanism.body(body(&b, &a, Hinge::pin(Vec3::y()), [0.4, 0.0, 0.0]));
        mechanism.body(body(&c, &b, Hinge::pin(Vec3::z()), [0.4, 0.0, 0.0]));
    }
    let ball = |body: &str| ColliderSpec::new(body, body, Shape::Sphere { radius: 0.05 });
    let mut colliders: Vec<ColliderSpec> =
        ["left upper", "left hand", "right hand", "plate"].map(ball).to_vec();
    let half = Vec3::new(1.0, 1.0, 0.01);
    colliders.push(
        ColliderSpec::new("table", "world", Shape::Box { half })
            .at(Pose::translation(0.0, 0.0, -1.2)),
    );
    let mass = MassProperties::new(300.0, Vec3::zeros(), Mat3::identity());
    ModelSpec {
        mechanism,
        parts: vec![
            PartSpec::chain("left", "world", "left hand"),
            PartSpec::chain("right", "world", "right hand"),
            PartSpec::bodies("hands", &["left hand", "right hand"]),
        ],
        objects: vec![ObjectSpec { name: "plate".into(), mass }],
        colliders,
        ..ModelSpec::default()
    }
}

fn model() -> Arc<RobotModel> {
    RobotModel::new(&spec()).unwrap()
}

/// Every error has a remedy.
#[track_caller]
fn told<T: std::fmt::Debug>(asked: Result<T, RobotError>) -> RobotError {
    let e = asked.unwrap_err();
    assert!(e.to_string().contains("help: "), "{e}");
    e
}

#[test]
fn names_that_nothing_has_and_parts_without_a_tip() {
    let mut wrong = spec();
    wrong.parts.push(PartSpec::chain("third", "world", "left hnad"));
    let e = RobotModel::new(&wrong).err().unwrap();
    let [ModelFault::Unknown { name, help, .. }] = &e.faults[..] else { panic!("{e}") };
    assert!(name == "left hnad" && help.contains("left hand"), "{e}");
    let model = model();
    assert!(model.part("lfet").is_none() && model.object("plat").is_none());
    let other =
        RobotModel::new(&ModelSpec { parts: spec().parts[..1].to_vec(), ..spec() }).unwrap();
    let [right, hands] = ["right", "hands"].map(|p| model.part(p).unwrap());
    assert_eq!(told(Robot::new(&other).tip_pose(right)), RobotError::ForeignHandle);
    let plate = model.object("plate").unwrap();
    let mut robot = Robot::new(&model);
    let no_chain = RobotError::NotAChain { part: 2 };
    assert_eq!(told(robot.tip_pose(hands)), no_chain);
    assert_eq!(told(robot.grasp(hands, plate, Grasp::Here)), no_chain);
    let goal = Goal::position(Vec3::x());
    let mut q = [0.0; 6];
    let effort = Effort::default();
    assert_eq!(
        told(robot.inverse_kinematics(hands, &goal, Frame::World, &effort, &mut q)),
        no_chain
    );
}

#[test]
fn objects_held_twice_empty_hands_and_loops_that_do_not_close() {
    let model = model();
    let [left, right] = ["left", "right"].map(|p| model.part(p).unwrap());
    let plate = model.object("plate").unwrap();
    let mut robot = Robot::new(&model);
    let mut tau = [0.0; 6];
    assert_eq!(told(robot.release(left, plate)), RobotError::NotHeld { object: 0 });
    robot.grasp(left, plate, Grasp::At(Pose::identity())).unwrap();
    let before = robot.hold(plate).unwrap();
    assert_eq!(told(robot.grasp(left, plate, Grasp::Here)), RobotError::Held { object: 0 });
    assert_eq!(told(robot.release(right, plate)), RobotError::EmptyHand { part: 1 });
    assert_eq!(told(robot.squeeze(plate, 1.0, &mut tau)), RobotError::EmptyHand { part: 0 });
    assert_eq!(told(robot.closure(Closing::Hands(plate))), RobotError::EmptyHand { part: 0 });
    // The hands are 0.6 m apart.
    let open = told(robot.grasp(right, plate, Grasp::At(Pose::identity())));
    let RobotError::LoopOpen { part: 1, position, orientation } = open else { panic!("{open}") };
    assert!((position - 0.6).abs() < 1e-12 && orientation < 1e-12, "{open}");
    assert_eq!(robot.hold(plate).unwrap(), before, "nothing has changed");
}

#[test]
fn padding_with_which_all_touch_always() {
    let model = model();
    let mut robot = Robot::new(&model);
    let [hand, upper, table] =
        ["left hand", "left upper", "table"].map(|c| model.collider(c).unwrap());
    let q = [0.3, 0.2, 0.1, -0.3, 0.2, 0.0];
    assert!(!robot.collides(&q).unwrap());
    let all = |robot: &mut Robot| {
        let mut near = Vec::new();
        robot.distances(&q, f64::INFINITY, &mut near).unwrap();
        near
    };
    let before = all(&mut robot);
    // The links are 0.4 m long, and the two balls have a radius of 50 mm, so hand and upper arm are
    // never more than 0.9 m apart.
    let e = told(robot.pad(hand, 0.91));
    let RobotError::NeverFree { a, b, padding, most } = e else { panic!("{e}") };
    let pair = [hand.index(), upper.index()];
    assert!(pair.contains(&a) && pair.contains(&b) && padding == 0.91, "{e}");
    assert!((most - 0.9).abs() < 1e-12, "{most}");
    assert_eq!(all(&mut robot), before, "nothing has changed");
    // Slightly less padding is accepted, because the links are long enough to separate the colliders. More padding is
    // accepted if the pairs need not be free.
    robot.pad(hand, 0.89).unwrap();
    robot.pad(hand, 0.0).unwrap();
    for other in ["left upper", "right hand", "table", "plate"] {
        robot.look_at(hand, model.collider(other).unwrap(), Some(false)).unwrap();
    }
    robot.pad(hand, 30.0).unwrap();
    robot.pad(hand, 0.0).unwrap();
    // The paddings of both colliders add up, including the padding of the model.
    robot.look_at(hand, upper, None).unwrap();
    robot.pad(upper, 0.5).unwrap();
    assert!(matches!(told(robot.pad(hand, 0.41)), RobotError::NeverFree { .. }));
    assert!(matches!(told(robot.pad(table, 40.0)), RobotError::NeverFree { .. }));
    assert!(matches!(told(robot.pad(table, f64::NAN)), RobotError::OutOfRange { .. }));
    let mut wrong = spec();
    wrong.colliders[1].padding = 1.0;
    let e = RobotModel::new(&wrong).err().unwrap();
    let [ModelFault::Padding { name, other, .. }] = &e.faults[..] else { panic!("{e}") };
    assert_eq!([name.as_str(), other], ["left hand", "left upper"]);
    assert!(e.to_string().contains("help: reduce the padding"), "{e}");
}

#[test]
fn targets_that_are_no_numbers_and_starts_outside_of_limits() {
    let model = model();
    let left = model.part("left").unwrap();
    let mut robot = Robot::new(&model);
    let effort = Effort::default();
    let mut q = [0.1; 6];
    for goal in [
        Goal::position(Vec3::new(0.3, f64::NAN, 0.0)),
        Goal::pose(Pose::translation(f64::INFINITY, 0.0, 0.0)),
    ] {
        let e = told(robot.inverse_kinematics(left, &goal, Frame::World, &effort, &mut q));
        assert!(matches!(e, RobotError::NotFinite { .. }), "{e}");
    }
    assert_eq!(q, [0.1; 6]);
    q[1] = 2.5;
    let goal = Goal::position(Vec3::new(0.3, 0.3, 0.1));
    let e = told(robot.inverse_kinematics(left, &goal, Frame::World, &effort, &mut q));
    assert!(
        matches!(e, RobotError::OutsideLimits { dof: 1, value, lower, upper } if value == 2.5 && lower == -2.0 && upper == 2.0),
        "{e}"
    );
    // Follow the remedy.
    robot.clamp(&mut q).unwrap();
    robot.inverse_kinematics(left, &goal, Frame::World, &effort, &mut q).unwrap();
    assert!(matches!(told(robot.set_q(&[f64::NAN; 6])), RobotError::NotFinite { index: 0, .. }));
}

/// Loads that no joint can carry, and grips that friction cannot hold: the result states the shortfall and returns the best approximation.
#[test]
fn what_is_not_feasible_comes_with_the_best_that_is() {
    let model = model();
    let [left, right] = ["left", "right"].map(|p| model.part(p).unwrap());
    let plate = model.object("plate").unwrap();
    let mut robot = Robot::new(&model);
    robot.set_q(&[0.5, -1.2, 0.0, 0.5, -1.2, 0.0]).unwrap();
    robot.grasp(left, plate, Grasp::At(Pose::identity())).unwrap();
    robot.grasp(right, plate, Grasp::Here).unwrap();
    let mut alone = [0.0; 6];
    robot.gravity_forces(&mut alone).unwrap();
    let mut tau = alone;
    let shared = robot.balance(plate, Balance::Effort, &mut tau).unwrap();
    // A load of 300 kg needs far more than the joints' 20 N m, but far less with two hands than
    // with one.
    let share = |tau: &[f64; 6]| tau.iter().map(|t| t.abs() / 20.0).fold(0.0, f64::max);
    assert!(shared.largest_share > 10.0 && share(&alone) > shared.largest_share, "{shared:?}");
    assert!((share(&tau) - shared.largest_share).abs() < 1e-12 * shared.largest_share);
    // Palms that press with at most 10 N cannot hold the plate by friction.
    let half = Force::new(Vec3::zeros(), Vec3::z() * (150.0 * 9.81));
    let friction = [1.0, -1.0].map(|y| Friction {
        normal: Vec3::y() * -y,
        coefficient: 0.5,
        radius: 0.05,
        most: 10.0,
    });
    let held = robot.grip(plate, &[half; 2], &friction).unwrap();
    assert!(held.shortfall > 100.0, "{held:?}");
    let net = held.wrenches[0].force + held.wrenches[1].force;
    assert!((net - 2.0 * half.force).norm() < 1e-6 * net.norm(), "{net}");
    let strong =
        friction.map(|f| Friction { most: 10.0 + 1.01 * held.shortfall, coefficient: 50.0, ..f });
    assert!(robot.grip(plate, &[half; 2], &strong).unwrap().shortfall < held.shortfall);
}

/// All zeros is a valid configuration of an arm, but not of a floating body, because its quaternion has length zero. Before this check, poses were
/// NaN and collisions were never found.
#[test]
fn a_quaternion_of_zeros_is_rejected_wherever_a_configuration_is_read() {
    let mut mechanism = Builder::new();
    let mass = || MassProperties::new(1.0, Vec3::zeros(), Mat3::identity());
    mechanism.body(BodySpec::new("base", "world").hinge(Hinge::free()).mass(mass()));
    mechanism.body(body("link", "base", Hinge::pin(Vec3::y()), [0.0; 3]));
    let ball =
        |name: &str, body: &str, radius| ColliderSpec::new(name, body, Shape::Sphere { radius });
    let spec = ModelSpec {
        mechanism,
        parts: vec![PartSpec::chain("arm", "base", "link")],
        colliders: vec![ball("link", "link", 0.1), ball("rock", "world", 1.0)],
        ..ModelSpec::default()
    };
    let model = RobotModel::new(&spec).unwrap();
    let mut robot = Robot::new(&model);
    let (zeros, mut good) = ([0.0; 8], [0.0; 8]);
    good[6] = 1.0;
    let none = |index| RobotError::ZeroQuaternion { what: "q", index };
    assert!(robot.collides(&good).unwrap());
    assert_eq!(robot.collides(&zeros).unwrap_err(), none(3));
    assert_eq!(robot.set_q(&zeros).unwrap_err(), none(3));
    let (mut out, table) = ([false; 2], [good, zeros].concat());
    let of_all = RobotError::ZeroQuaternion { what: "q of all", index: 11 };
    assert_eq!(robot.collides_all(&table, &mut out).unwrap_err(), of_all);
    assert_eq!(out, [false; 2]);
    assert!(none(3).to_string().contains("give x y z w, with w = 1"));
}
