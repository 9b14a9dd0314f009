//! Joints that mimic others and loops of the mechanism under inverse kinematics.

use crate::together::{inside, tips};
use linkwork_embedded::multibody::{BodySpec, Builder, Hinge, Limits};
use linkwork_embedded::spatial::{Pose, Vec3};
use linkwork_embedded::*;

/// An arm whose last pin mimics two others, so that its hand stays level, on a rotating base, next to an independent arm; and a four-bar lever.
const LEVEL: &str = r#"<robot name="level"><link name="floor"/>{links}
  <joint name="turn" type="revolute"><parent link="floor"/><child link="turner"/><axis xyz="0 0 1"/>{limit}</joint>
  <joint name="lift" type="revolute"><parent link="turner"/><child link="upper"/><axis xyz="0 1 0"/>{limit}</joint>
  <joint name="bend" type="revolute"><parent link="upper"/><child link="lower"/><origin xyz="0.5 0 0"/><axis xyz="0 1 0"/>{limit}</joint>
  <joint name="wrist" type="revolute"><parent link="lower"/><child link="hand"/><origin xyz="0.4 0 0"/><axis xyz="0 1 0"/>{limit}
    <mimic joint="bend" multiplier="-1" offset="0.2"/></joint>
  <joint name="other" type="revolute"><parent link="turner"/><child link="arm"/><origin xyz="0 0.3 0"/><axis xyz="0 1 0"/>{limit}</joint>
  <joint name="fore" type="revolute"><parent link="arm"/><child link="tool"/><origin xyz="0.3 0 0"/><axis xyz="0 1 0"/>{limit}</joint>
</robot>"#;

fn level() -> formats::Description {
    let names = ["turner", "upper", "lower", "hand", "arm", "tool"];
    let link = |n: &&str| {
        format!(
            "<link name='{n}'><inertial><mass value='1'/><inertia ixx='0.1' iyy='0.1' izz='0.1' ixy='0' \
             ixz='0' iyz='0'/></inertial></link>"
        )
    };
    let links: String = names.iter().map(link).collect();
    let limit = "<limit lower='-2' upper='2' effort='9' velocity='1'/>";
    let text = LEVEL.replace("{links}", &links).replace("{limit}", limit);
    let options = formats::ReadOptions { root: formats::Root::Fixed, ..Default::default() };
    formats::read_text(&text, &options).unwrap()
}

#[test]
fn joints_that_mimic_others_stay_coupled() {
    let d = level();
    let refused = ModelSpec::from_description(&d).unwrap_err().to_string();
    assert!(refused.contains("coupling"), "{refused}");
    let mut spec = ModelSpec::with_closures(&d);
    spec.parts.push(PartSpec::chain("arm", "floor", "hand"));
    spec.parts.push(PartSpec::chain("other", "turner", "tool"));
    let strict = ModelSpec { closures: Closures::Refused, ..spec.clone() };
    assert!(RobotModel::new(&strict).unwrap_err().to_string().contains("Closures::Kept"));
    let model = RobotModel::new(&spec).unwrap();
    let [arm, other] = ["arm", "other"].map(|p| model.part(p).unwrap());
    let mut robot = Robot::new(&model);
    let mut search = WholeBodyIk::new(&robot, 2);
    let at = |joint: &str| model.coordinate(joint).unwrap().0;
    let [bend, wrist] = [at("bend"), at("wrist")];
    let coupled = |q: &[f64]| (q[wrist] + q[bend] - 0.2).abs();
    for seed in 0..20 {
        let mut there = inside(&model, seed);
        there[wrist] = 0.2 - there[bend];
        let X = tips(&mut robot, &there, &[arm, other]);
        let goals = [
            TipGoal::new(arm, Goal::position(X[0].position)),
            TipGoal::new(other, Goal::position(X[1].position)),
        ];
        let mut q = inside(&model, 50 + seed);
        let answer = search.solve(&robot, &goals, &Effort::default(), &mut q).unwrap();
        assert_eq!(answer.outcome, Outcome::Met, "{seed}");
        assert!(coupled(&q) <= 1.1e-9, "{:e}", coupled(&q));
        for (Y, X) in tips(&mut robot, &q, &[arm, other]).iter().zip(&X) {
            assert!((Y.position - X.position).norm() <= 1.1e-9);
        }
        assert_eq!(search.closures().next().unwrap().0, Closure::Coupling { index: 0 });
        // The goal is out of reach. The nearest solution satisfies the coupling.
        let far = [TipGoal::new(arm, Goal::position(Vec3::new(2.0, 0.3, 0.4)))];
        let answer = search.solve(&robot, &far, &Effort::default(), &mut q).unwrap();
        assert!(answer.outcome == Outcome::Nearest && coupled(&q) <= 1.1e-9);
        // Fully stretched, the hand is 0.9 m from the axis of the base.
        assert!((answer.residual.position - (Vec3::new(2.0, 0.3, 0.4).norm() - 0.9)).abs() < 1e-9);
    }
    // Moving the arm alone would violate the coupling. The other arm moves alone, with the same bits as in
    // a robot without couplings.
    let mut q = model.multibody().neutral_q();
    q[wrist] = 0.2;
    let goal = Goal::position(Vec3::new(0.3, 0.3, -0.2));
    let told =
        robot.inverse_kinematics(arm, &goal, Frame::World, &Effort::default(), &mut q).unwrap_err();
    let opens = |what| RobotError::OpensClosure { what, closure: Closure::Coupling { index: 0 } };
    assert_eq!(told, opens("inverse kinematics of one chain"));
    assert!(
        told.to_string().contains("inverse kinematics of one chain does not support coupling 0")
    );
    let mut free = ModelSpec { closures: Closures::Refused, ..spec.clone() };
    free.mechanism.couplings_mut().clear();
    let free = RobotModel::new(&free).unwrap();
    let (mut alone, mut same) = (q.clone(), q.clone());
    let a = robot
        .inverse_kinematics(other, &goal, Frame::World, &Effort::default(), &mut alone)
        .unwrap();
    let part = free.part("other").unwrap();
    let mut tree = Robot::new(&free);
    let b =
        tree.inverse_kinematics(part, &goal, Frame::World, &Effort::default(), &mut same).unwrap();
    assert_eq!((a, &alone), (b, &same));
    // Other calls that would violate the coupling return an error. Kinematics and forces are computed
    // for the tree.
    let nv = model.nv();
    let zero = vec![0.0; nv];
    let twist = spatial::Motion::zero();
    assert_eq!(
        robot.rates(arm, &twist, &mut zero.clone()).unwrap_err(),
        opens("joint rates for one tip")
    );
    assert_eq!(Planner::new(&robot, arm, 50).unwrap_err(), opens("path planning"));
    assert!(Planner::new(&robot, other, 50).is_ok());
    assert_eq!(TaskSpace::new(&robot, &[arm]).unwrap_err(), opens("operational space"));
    let mut timing = Timing::new(&robot, 2, 40).unwrap();
    let (mut from, mut to) = (vec![0.0; model.nq()], vec![0.1; model.nq()]);
    (from[wrist], to[wrist]) = (0.2, 0.1);
    let quick = MotionLimits::of(&model).acceleration(1.0).any_effort();
    let path = [from.clone(), to.clone()].concat();
    assert!(matches!(timing.plan(&mut robot, &path, &quick, 0.0), Ok(Timed::Found { .. })));
    to[wrist] = 0.2;
    let path = [from, to].concat();
    assert_eq!(timing.plan(&mut robot, &path, &quick, 0.0).unwrap_err(), opens("a straight path"));
    let mut control = RateControl::new(&robot, 1, 0);
    let guards = Guards { horizon: 0.1, manipulable: &[] };
    let objective = [Objective::new(0, Aim::Posture(&zero))];
    let told = control.solve(&mut robot, &objective, &guards, &mut zero.clone(), &mut [0.0]);
    assert_eq!(told.unwrap_err(), opens("rate control"));
    let mut body = WholeBody::new(&robot, 0, 1);
    let out = (&mut zero.clone()[..], &mut zero.clone()[..], &mut [][..]);
    let told = body.solve(&mut robot, &zero, &[], &objective, &zero, out);
    assert_eq!(told.unwrap_err(), opens("whole-body control"));
    let mut memory = Predictor::new(&robot);
    let (mut p, mut v, mut P) = (q.clone(), zero.clone(), vec![0.0; 4 * nv * nv]);
    let state = dynamics::StateEstimate { q: &mut p, v: &mut v, covariance: &mut P };
    let told = robot.predict(&mut memory, state, &zero, &[], 1e-3);
    assert_eq!(told.unwrap_err(), opens("prediction"));
    let mut transfer = Transfer::new(&robot);
    let still = MotionState { q: &q, v: &zero, vdot: &zero };
    let limits = MotionLimits::of(&model).acceleration(1.0).jerk(1.0);
    assert_eq!(
        transfer.plan(&still, &still, &limits).unwrap_err(),
        opens("a jerk-limited transfer")
    );
    let mut next = q.clone();
    (next[bend], next[wrist]) = (0.5, -0.3);
    assert_eq!(robot.path_free(&q, &next, 1e-3).unwrap(), Path::Free);
    next[wrist] = 0.0;
    assert_eq!(robot.path_free(&q, &next, 1e-3).unwrap_err(), opens("a straight path"));
    let (mut tau, mut other_tau) = (zero.clone(), zero.clone());
    robot.set_q(&q).unwrap();
    tree.set_q(&q).unwrap();
    robot.gravity_forces(&mut tau).unwrap();
    tree.gravity_forces(&mut other_tau).unwrap();
    assert_eq!(tau, other_tau);
}

/// Pinocchio 4.1 (`buildModelFromXML` with `mimic=True`): generalized gravity of `bend` at this configuration, and its inertia, both with the wrist
/// that follows it.
#[test]
fn timed_paths_count_the_forces_of_mimic_joints_at_the_joints_that_they_follow() {
    let (gravity, inertia) = (-3.845_781_251_449_033, 0.26);
    let model = RobotModel::new(&ModelSpec::with_closures(&level())).unwrap();
    let mut robot = Robot::new(&model);
    let at = |joint: &str| model.coordinate(joint).unwrap();
    let (bend, wrist) = (at("bend"), at("wrist"));
    let mut from = vec![0.0; model.nq()];
    for (joint, x) in [
        ("turn", 0.1),
        ("lift", 0.3),
        ("bend", -0.5),
        ("wrist", 0.7),
        ("other", 0.2),
        ("fore", 0.4),
    ] {
        from[at(joint).0] = x;
    }
    let mut limits = MotionLimits::of(&model).any_effort();
    limits.rate.fill(f64::INFINITY);
    // A joint that follows another one needs no motor.
    limits.effort[wrist.1] = 1e-3;
    limits.effort[bend.1] = 9.0;
    let mut timing = Timing::new(&robot, 2, 4000).unwrap();
    let mut to = from.clone();
    (to[bend.0], to[wrist.0]) = (0.3, -0.1);
    let told = timing.plan(&mut robot, &[from.clone(), to].concat(), &limits, 0.0).unwrap();
    let Timed::Found { duration } = told else { panic!("{told:?}") };
    let (mut q, mut v, mut vdot) = (from.clone(), vec![0.0; model.nv()], vec![0.0; model.nv()]);
    timing.at(0.0, &mut q, &mut v, &mut vdot).unwrap();
    let want = (9.0 - gravity) / inertia;
    assert!((vdot[bend.1] / want - 1.0).abs() < 1e-3, "{} {want}", vdot[bend.1]);
    for k in 0..=20 {
        timing.at(duration * f64::from(k) / 20.0, &mut q, &mut v, &mut vdot).unwrap();
        assert!((q[bend.0] + q[wrist.0] - 0.2).abs() < 1e-12, "{q:?}");
        assert!(
            (v[bend.1] + v[wrist.1]).abs() < 1e-12 && (vdot[bend.1] + vdot[wrist.1]).abs() < 1e-9
        );
    }
    // Holding needs the whole gravity, also while another joint moves.
    let mut to = from.clone();
    to[at("turn").0] = 0.5;
    limits.effort[bend.1] = 0.5 * gravity.abs();
    limits.acceleration.fill(1.0);
    let told = timing.plan(&mut robot, &[from, to].concat(), &limits, 0.0).unwrap();
    let Timed::Infeasible { share, .. } = told else { panic!("{told:?}") };
    assert!((share - 2.0).abs() < 1e-6, "{share}");
}

#[test]
fn loops_of_the_mechanism_stay_closed() {
    let mut m = Builder::new();
    let pin = || Hinge::pin(Vec3::y()).limits(Limits::position(-2.8, 2.8));
    let x = |d: f64| Pose::translation(d, 0.0, 0.0);
    m.body(BodySpec::new("waist", "world").hinge(Hinge::pin(Vec3::z())));
    m.body(BodySpec::new("crank", "waist").hinge(pin()));
    m.body(BodySpec::new("coupler", "crank").hinge_in_parent(x(0.3)).hinge(pin()));
    m.body(BodySpec::new("rocker", "waist").hinge_in_parent(x(0.7)).hinge(pin()));
    m.body(BodySpec::new("finger", "coupler").hinge_in_parent(x(0.9)));
    m.loop_closure(multibody::LoopClosure {
        name: "knee".into(),
        body_a: "coupler".into(),
        frame_a: x(0.8),
        body_b: "rocker".into(),
        frame_b: x(0.6),
        hinge: Hinge::pin(Vec3::y()),
    });
    let parts = vec![
        PartSpec::chain("lever", "waist", "finger"),
        PartSpec::chain("turn", "world", "waist"),
    ];
    let spec = ModelSpec { mechanism: m, parts, closures: Closures::Kept, ..ModelSpec::default() };
    let model = RobotModel::new(&spec).unwrap();
    let [lever, turn] = ["lever", "turn"].map(|p| model.part(p).unwrap());
    let mut robot = Robot::new(&model);
    let mut search = WholeBodyIk::new(&robot, 1);
    let body = |n: &str| model.multibody().body(n).unwrap();
    let gap = |robot: &mut Robot, q: &[f64]| {
        robot.set_q(q).unwrap();
        let ends = [("coupler", 0.8), ("rocker", 0.6)];
        let [a, b] = ends.map(|(n, d)| robot.body_pose(body(n)).transform_point(&(Vec3::x() * d)));
        (a - b).norm()
    };
    let mut met = 0;
    for seed in 0..20 {
        let mut there = inside(&model, seed);
        search.solve(&robot, &[], &Effort::default(), &mut there).unwrap();
        assert!(gap(&mut robot, &there) <= 1.1e-9);
        let X = tips(&mut robot, &there, &[lever])[0];
        let mut q = inside(&model, 70 + seed);
        let goal = [TipGoal::new(lever, Goal::position(X.position))];
        let answer = search.solve(&robot, &goal, &Effort::default(), &mut q).unwrap();
        met += usize::from(answer.outcome == Outcome::Met);
        assert!(gap(&mut robot, &q) <= 1.1e-9);
        let Y = tips(&mut robot, &q, &[lever])[0];
        assert!(((Y.position - X.position).norm() - answer.residual.position).abs() < 1e-12);
    }
    assert!(met >= 18, "{met}");
    let mut q = model.multibody().neutral_q();
    let goal = Goal::position(Vec3::new(0.5, 0.1, 0.2));
    let told = robot
        .inverse_kinematics(lever, &goal, Frame::World, &Effort::default(), &mut q)
        .unwrap_err();
    let closure = Closure::Loop { index: 0 };
    assert_eq!(told, RobotError::OpensClosure { what: "inverse kinematics of one chain", closure });
    // The base carries the whole loop, so it can move alone, and its straight path is free.
    let ahead = Goal::pointing(Pointing::along(Vec3::x(), Vec3::new(0.6, 0.8, 0.0)));
    assert_eq!(
        robot
            .inverse_kinematics(turn, &ahead, Frame::World, &Effort::default(), &mut q)
            .unwrap()
            .outcome,
        Outcome::Met
    );
    let still = model.multibody().neutral_q();
    assert_eq!(robot.path_free(&still, &q, 1e-3).unwrap(), Path::Free);
    let mut open = q.clone();
    open[model.multibody().hinge("rocker").unwrap().start] = 0.3;
    assert!(matches!(robot.path_free(&q, &open, 1e-3), Err(RobotError::OpensClosure { .. })));
    // A loop with a prescribed motion is rejected.
    let mut moved = spec.clone();
    moved.mechanism.loops_mut()[0].hinge = Hinge::pin(Vec3::y()).prescribed();
    let told = RobotModel::new(&moved).unwrap_err().to_string();
    assert!(told.contains("the motion across loop `knee`"), "{told}");
}
