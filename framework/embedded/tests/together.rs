//! Whole-body inverse kinematics: several tips, a shared waist, tips relative to tips, objects in two hands. Compares with the dynamics layer and
//! forward kinematics.

use crate::support::*;
use linkwork_embedded::dynamics::{InverseKinematics, Target, Tree};
use linkwork_embedded::multibody::{BodySpec, Builder, Hinge, Limits};
use linkwork_embedded::spatial::{MassProperties, Mat3, Pose, Quat, Vec3};
use linkwork_embedded::*;
use std::sync::Arc;

/// A waist of two pins, an arm of six on each side, a head on a pin; a box and a bar.
fn torso() -> Arc<RobotModel> {
    let mut m = Builder::new();
    let pin = |axis: Vec3, most: f64| Hinge::pin(axis).limits(Limits::position(-most, most));
    let (x, y, z) = (Vec3::x(), Vec3::y(), Vec3::z());
    let up = |h| Pose::translation(0.0, 0.0, h);
    m.body(BodySpec::new("waist", "world").hinge_in_parent(up(0.8)).hinge(pin(z, 1.2)));
    m.body(BodySpec::new("chest", "waist").hinge_in_parent(up(0.2)).hinge(pin(y, 0.8)));
    for (side, s) in [("left", 1.0), ("right", -1.0)] {
        let mut parent = "chest".to_owned();
        for (k, axis) in [z, y, y, x, y, x].into_iter().enumerate() {
            let at = match k {
                0 => Pose::translation(0.05, 0.25 * s, 0.35),
                2 => Pose::translation(0.31, 0.02, 0.0),
                3 => Pose::translation(0.27, -0.01, 0.03),
                _ => Pose::translation(0.06, 0.0, 0.0),
            };
            let body = format!("{side}{k}");
            m.body(BodySpec::new(&body, &parent).hinge_in_parent(at).hinge(pin(axis, 2.6)));
            parent = body;
        }
    }
    m.body(BodySpec::new("head", "chest").hinge_in_parent(up(0.5)).hinge(pin(y, 1.0)));
    let parts = ["left", "right"].map(|p| PartSpec::chain(p, "chest", &format!("{p}5")));
    let mut parts = parts.to_vec();
    parts.extend([
        PartSpec::chain("trunk", "world", "chest"),
        PartSpec::chain("neck", "chest", "head"),
    ]);
    parts.push(PartSpec::bodies("ends", &["left5", "right5"]));
    let mass = MassProperties::new(2.0, Vec3::zeros(), Mat3::identity() * 0.01);
    let objects = ["box", "bar"].map(|name| ObjectSpec { name: name.into(), mass }).to_vec();
    RobotModel::new(&ModelSpec { mechanism: m, parts, objects, ..ModelSpec::default() }).unwrap()
}

fn clamp(model: &RobotModel, q: &mut [f64]) {
    for (_, s) in model.multibody().subhinges() {
        let l = s.subhinge.limits;
        q[s.q.start] = q[s.q.start].clamp(l.lower, l.upper);
    }
}

fn within(model: &RobotModel, q: &[f64]) -> bool {
    let mut clamped = q.to_vec();
    clamp(model, &mut clamped);
    clamped == q
}

pub fn inside(model: &RobotModel, seed: u64) -> Vec<f64> {
    let mut q = model.multibody().random_q(seed);
    clamp(model, &mut q);
    q.iter().map(|x| 0.9 * x).collect()
}

pub fn tips(robot: &mut Robot, q: &[f64], parts: &[Part]) -> Vec<Pose> {
    robot.set_q(q).unwrap();
    parts.iter().map(|p| robot.tip_pose(*p).unwrap()).collect()
}

#[test]
fn two_arms_with_one_waist_reach_two_poses_as_the_floor_below_does() {
    let model = torso();
    let [left, right] = ["left", "right"].map(|p| model.part(p).unwrap());
    let mut robot = Robot::new(&model);
    let mut search = WholeBodyIk::new(&robot, 2);
    // Compare with the solver of `linkwork_dynamics` for the same mechanism, whose tips are nodes.
    let mbs = model.multibody();
    let tree = Tree::new(mbs);
    let nodes = ["tip of part left", "tip of part right"].map(|n| mbs.node(n).unwrap());
    let mut moved = 0;
    for seed in 0..40 {
        let X = tips(&mut robot, &inside(&model, seed), &[left, right]);
        let start = inside(&model, 1000 + seed);
        let goals = [TipGoal::new(left, Goal::pose(X[0])), TipGoal::new(right, Goal::pose(X[1]))];
        let mut q = start.clone();
        let answer = search.solve(&robot, &goals, &Effort::default(), &mut q).unwrap();
        assert_eq!(answer.outcome, Outcome::Met, "{seed}");
        for (Y, X) in tips(&mut robot, &q, &[left, right]).iter().zip(&X) {
            let (p, R) = apart(Y, X);
            assert!(p <= 2e-9 && R <= 2e-9, "{seed}: {p:e} {R:e}");
        }
        assert!(within(&model, &q));
        moved += usize::from(
            (q[mbs.hinge("waist").unwrap().start] - start[mbs.hinge("waist").unwrap().start]).abs()
                > 1e-3,
        );
        let targets = [0, 1].map(|i| Target::new(nodes[i], Goal::pose(X[i])));
        let mut ik = InverseKinematics::new(&tree);
        let mut same = start.clone();
        let found = ik.solve(&tree, &targets, &mut same).unwrap();
        assert_eq!((&q, answer.kinematics), (&same, found.kinematics));
    }
    assert!(moved >= 35, "{moved}");
}

#[test]
fn a_hand_is_moved_as_the_other_sees_it() {
    let model = torso();
    let [left, right, neck] = ["left", "right", "neck"].map(|p| model.part(p).unwrap());
    let mut robot = Robot::new(&model);
    let mut search = WholeBodyIk::new(&robot, 3);
    let waist: Vec<usize> = model.dofs(model.part("trunk").unwrap()).unwrap().to_vec();
    for seed in 0..20 {
        let X = tips(&mut robot, &inside(&model, seed), &[left, right]);
        let apart_wanted = X[0].inverse() * X[1];
        let goals = [
            TipGoal::new(right, Goal::pose(apart_wanted)).seen_from(Frame::Tip(left)),
            TipGoal::new(left, Goal::position(X[0].position)),
            // The head looks at the right hand, which moves.
            TipGoal::new(neck, Goal::pointing(Pointing::at(Vec3::x(), Vec3::zeros()).within(0.6)))
                .seen_from(Frame::Tip(right)),
        ];
        let mut q = inside(&model, 500 + seed);
        let answer = search.solve(&robot, &goals[..2], &Effort::default(), &mut q).unwrap();
        assert_eq!(answer.outcome, Outcome::Met, "{seed}");
        let Y = tips(&mut robot, &q, &[left, right]);
        let (p, R) = apart(&(Y[0].inverse() * Y[1]), &apart_wanted);
        assert!(p <= 2e-9 && R <= 2e-9, "{p:e} {R:e}");
        assert!((Y[0].position - X[0].position).norm() <= 2e-9);
        // The third goal is for the head, which may not reach it.
        let answer = search.solve(&robot, &goals, &Effort::default(), &mut q).unwrap();
        let Y = tips(&mut robot, &q, &[left, right, neck]);
        let look = (Y[1].position - Y[2].position).normalize();
        let off = (Y[2].rotation * Vec3::x()).angle(&look);
        let short = search.residuals()[2].orientation;
        assert!((short - (off - 0.6).max(0.0)).abs() < 1e-7, "{short} {off}");
        assert_eq!(
            answer.outcome == Outcome::Met,
            search.residuals().iter().all(|r| r.position <= 1e-9 && r.orientation <= 1e-9)
        );
    }
    // Degrees of freedom that are kept do not move. A goal relative to the base of the part moves
    // with that base.
    search.keep(&waist).unwrap();
    let start = inside(&model, 3);
    robot.set_q(&start).unwrap();
    let X = robot.tip_pose(left).unwrap();
    let base = robot.base_pose(left).unwrap().inverse() * X;
    let near = Goal::pose(Pose::new(base.rotation, base.position * 0.98));
    let mut q = start.clone();
    let goal = [TipGoal::new(left, near).seen_from(Frame::Base)];
    assert_eq!(
        search.solve(&robot, &goal, &Effort::default(), &mut q).unwrap().outcome,
        Outcome::Met
    );
    assert!(waist.iter().all(|d| q[*d] == start[*d]));
    let right_arm = model.dofs(right).unwrap();
    assert!(right_arm.iter().all(|d| q[*d] == start[*d]), "nothing asked it to move");
    // The inverse kinematics of the chain alone must reach the same goal.
    let mut alone = start.clone();
    robot.inverse_kinematics(left, &near, Frame::Base, &Effort::default(), &mut alone).unwrap();
    robot.set_q(&alone).unwrap();
    let (p, R) = apart(
        &(robot.base_pose(left).unwrap().inverse() * robot.tip_pose(left).unwrap()),
        &near_pose(&near),
    );
    assert!(p <= 2e-9 && R <= 2e-9);
    // The chain alone also reaches a goal relative to a hand at rest.
    let seen = tips(&mut robot, &start, &[right])[0].inverse() * X;
    let mut alone = start.iter().map(|x| x * 0.97).collect::<Vec<f64>>();
    for d in waist.iter().chain(right_arm) {
        alone[*d] = start[*d];
    }
    let (goal, frame, effort) = (Goal::pose(seen), Frame::Tip(right), Effort::default());
    let answer = robot.inverse_kinematics(left, &goal, frame, &effort, &mut alone);
    assert_eq!(answer.unwrap().outcome, Outcome::Met);
    let (p, R) = apart(&tips(&mut robot, &alone, &[left])[0], &X);
    assert!(p <= 2e-9 && R <= 2e-9);
}

fn near_pose(goal: &Goal) -> Pose {
    Pose::new(goal.orientation.unwrap(), goal.position.unwrap())
}

/// Both hands on a box, and the pose of the right hand in the left.
fn held(model: &Arc<RobotModel>) -> (Robot, Pose) {
    let [left, right] = ["left", "right"].map(|p| model.part(p).unwrap());
    let mut robot = Robot::new(model);
    let mut search = WholeBodyIk::new(&robot, 2);
    let turn = |a: f64| Quat::from_scaled_axis(Vec3::z() * a);
    let at = |y: f64, a: f64| Goal::pose(Pose::new(turn(a), Vec3::new(0.5, y, 1.25)));
    let goals = [TipGoal::new(left, at(0.15, -1.0)), TipGoal::new(right, at(-0.15, 1.0))];
    let mut q = model.multibody().neutral_q();
    let answer = search.solve(&robot, &goals, &Effort::default(), &mut q).unwrap();
    assert_eq!(answer.outcome, Outcome::Met);
    robot.set_q(&q).unwrap();
    let object = model.object("box").unwrap();
    robot.put(object, Pose::translation(0.52, 0.0, 1.25)).unwrap();
    robot.grasp(left, object, Grasp::Here).unwrap();
    robot.grasp(right, object, Grasp::Here).unwrap();
    let X = tips(&mut robot, &q, &[left, right]);
    let between = X[0].inverse() * X[1];
    (robot, between)
}

#[test]
fn what_two_hands_hold_stays_held() {
    let model = torso();
    let [left, right] = ["left", "right"].map(|p| model.part(p).unwrap());
    let (mut robot, between) = held(&model);
    let mut search = WholeBodyIk::new(&robot, 2);
    let home = robot.q().to_vec();
    let X = robot.tip_pose(left).unwrap();
    let (mut met, mut nearest) = (0, 0);
    for k in 0..24 {
        let a = f64::from(k) * 0.26;
        // Every third goal is out of reach.
        let far = if k % 3 == 2 { 1.6 } else { 0.08 };
        let shift = Vec3::new(far * a.cos(), far * a.sin(), 0.3 * far);
        let goal = Goal::pose(Pose::new(X.rotation, X.position + shift));
        let mut q = if k % 2 == 0 { home.clone() } else { inside(&model, k as u64) };
        let goals = [TipGoal::new(left, goal)];
        let answer = search.solve(&robot, &goals, &Effort::default(), &mut q).unwrap();
        let own = robot.q().to_vec();
        let Y = tips(&mut robot, &q, &[left, right]);
        let (p, R) = apart(&(Y[0].inverse() * Y[1]), &between);
        assert!(p <= 2e-9 && R <= 2e-9, "{k}: {p:e} {R:e}");
        assert!(within(&model, &q));
        let (p, R) = apart(&Y[0], &near_pose(&goal));
        match answer.outcome {
            Outcome::Met => {
                met += 1;
                assert!(p <= 2e-9 && R <= 2e-9);
            }
            _ => {
                nearest += 1;
                assert!((p - answer.residual.position).abs() < 1e-12);
                // The result is a minimum among closed configurations: a small motion that keeps both hands closed does
                // not come nearer.
                let cost = |q: &[f64], robot: &mut Robot| {
                    let (p, R) = apart(&tips(robot, q, &[left])[0], &near_pose(&goal));
                    p * p + R * R
                };
                let least = cost(&q, &mut robot);
                let mut closer = search.clone();
                for seed in 0..20 {
                    let mut other: Vec<f64> = q
                        .iter()
                        .zip(model.multibody().random_v(seed))
                        .map(|(q, v)| q + 1e-2 * v)
                        .collect();
                    clamp(&model, &mut other);
                    robot.set_q(&own).unwrap();
                    closer.solve(&robot, &[], &Effort::default(), &mut other).unwrap();
                    let there = cost(&other, &mut robot);
                    assert!(there >= least - 1e-9, "{k}, {seed}: {there} {least}");
                }
            }
        }
        assert_eq!(search.closures().next().unwrap().0, Closure::Hands { object: 0 });
        robot.set_q(&own).unwrap();
    }
    println!("{met} met, {nearest} nearest");
    assert!(met >= 12 && nearest >= 8, "{met} {nearest}");
    // An estimator changes the grasp, and the search uses the new one.
    let object = model.object("box").unwrap();
    let hold = robot.hold(object).unwrap().unwrap();
    robot.set_q(&home).unwrap();
    robot.update_grasp(left, object, hold.hand.1 * Pose::translation(0.01, 0.0, 0.0)).unwrap();
    robot.release(right, object).unwrap();
    let mut q = home.clone();
    search.solve(&robot, &[TipGoal::new(left, Goal::pose(X))], &Effort::default(), &mut q).unwrap();
    assert_eq!(search.closures().count(), 0, "one hand holds nothing closed");
}

#[test]
fn a_grasp_that_cannot_close_is_told_with_the_least_gap() {
    let model = torso();
    let [left, right] = ["left", "right"].map(|p| model.part(p).unwrap());
    let (mut robot, grasp) = held(&model);
    let mut q = robot.q().to_vec();
    let mut search = WholeBodyIk::new(&robot, 1);
    let all: Vec<usize> = (0..model.nv()).collect();
    search.keep(&all).unwrap();
    let wrist = *model.dofs(right).unwrap().last().unwrap();
    search.release(&[wrist]).unwrap();
    // The left arm is elsewhere, and only the wrist may rotate, so the gap cannot be closed.
    let shoulder = model.dofs(left).unwrap()[0];
    q[shoulder] += 0.2;
    let before = q.clone();
    let error = search.solve(&robot, &[], &Effort::default(), &mut q).unwrap_err();
    let RobotError::DoesNotClose { closure, position, orientation } = error else {
        panic!("{error}")
    };
    assert_eq!(closure, Closure::Hands { object: 0 });
    assert!(error.to_string().starts_with("the grasp of object 0 by two hands cannot be closed"));
    let X = tips(&mut robot, &q, &[left, right]);
    let (p, R) = apart(&(X[0].inverse() * X[1]), &grasp);
    assert!(
        (p - position).abs() < 1e-9 && (R - orientation).abs() < 1e-7,
        "{p} {position} {R} {orientation}"
    );
    // Compare with the minimum over the angle of the wrist.
    let off = |x: f64, robot: &mut Robot| {
        let mut q = before.clone();
        q[wrist] = x;
        let X = tips(robot, &q, &[left, right]);
        let (p, R) = apart(&(X[0].inverse() * X[1]), &grasp);
        p * p + R * R
    };
    let got = off(q[wrist], &mut robot);
    let least =
        (-2600..=2600).map(|k| off(f64::from(k) * 1e-3, &mut robot)).fold(f64::INFINITY, f64::min);
    assert!(got <= least + 1e-12, "{got} {least}");
    assert!(p > 0.05, "{p}");
}

#[test]
fn the_same_whatever_was_before_and_in_portions() {
    let model = torso();
    let [left, right] = ["left", "right"].map(|p| model.part(p).unwrap());
    let (robot, _) = held(&model);
    let goals = |k: u32| {
        let p = Vec3::new(0.5 + 0.9 * f64::from(k % 2), 0.1 * f64::from(k), 1.2);
        [TipGoal::new(left, Goal::position(p))]
    };
    let mut used = WholeBodyIk::new(&robot, 1);
    for k in 0..4 {
        let mut a = inside(&model, k.into());
        let (mut b, mut c) = (a.clone(), a.clone());
        let once = used.solve(&robot, &goals(k), &Effort::default(), &mut a).unwrap();
        let mut fresh = WholeBodyIk::new(&robot, 1);
        fresh.begin(&robot, &goals(k), &Effort::default(), &b).unwrap();
        let mut whole = robot.clone();
        loop {
            let answer = fresh.resume(3, &mut b).unwrap();
            // Make other calls between portions. A clone continues like the original.
            whole.tip_pose(right).unwrap();
            fresh = fresh.clone();
            if answer.outcome != Outcome::Unfinished {
                assert_eq!(answer, once);
                break;
            }
        }
        let again = used.clone().solve(&robot, &goals(k), &Effort::default(), &mut c).unwrap();
        assert_eq!((&a, &a, once), (&b, &c, again));
    }
}

#[test]
fn the_best_of_what_is_met_is_the_same_along_the_null_space() {
    let model = torso();
    let [left, right] = ["left", "right"].map(|p| model.part(p).unwrap());
    let (mut robot, between) = held(&model);
    let mut search = WholeBodyIk::new(&robot, 1);
    let X = robot.tip_pose(left).unwrap();
    let goals = [TipGoal::new(left, Goal::position(X.position + Vec3::new(0.03, 0.02, 0.04)))];
    let home = robot.q().to_vec();
    let cost = |q: &[f64]| -> f64 {
        let subhinges = model.multibody().subhinges();
        let each = subhinges.map(|(_, s)| {
            let l = s.subhinge.limits;
            0.5 * ((q[s.q.start] - 0.5 * (l.lower + l.upper)) / (l.upper - l.lower)).powi(2)
        });
        each.sum()
    };
    let mut plain = home.clone();
    search.solve(&robot, &goals, &Effort::default(), &mut plain).unwrap();
    let mut last = f64::INFINITY;
    for starts in [1, 6] {
        let mut q = home.clone();
        let prefer = Prefer::centred().starts(starts);
        let best = search.best(&mut robot, &goals, &prefer, &Effort::default(), &mut q).unwrap();
        assert_eq!(best.outcome, Outcome::Met);
        assert!((best.cost - cost(&q)).abs() < 1e-12 && best.cost <= last);
        assert!(best.cost < 0.9 * cost(&plain), "{} {}", best.cost, cost(&plain));
        let own = robot.q().to_vec();
        let Y = tips(&mut robot, &q, &[left, right]);
        let (p, R) = apart(&(Y[0].inverse() * Y[1]), &between);
        assert!(p <= 2e-9 && R <= 2e-9 && within(&model, &q), "{p:e} {R:e}");
        assert!((Y[0].position - near(&goals[0])).norm() <= 2e-9);
        robot.set_q(&own).unwrap();
        last = best.cost;
    }
    // This objective prefers configurations that are farther from singularities of the chain.
    let w = |robot: &mut Robot, q: &[f64]| {
        robot.set_q(q).unwrap();
        robot.manipulability(left, Rows::All { length: 1.0 }, None).unwrap().w
    };
    let mut q = home.clone();
    let best = search
        .best(&mut robot, &goals, &Prefer::manipulable(), &Effort::default(), &mut q)
        .unwrap();
    let (before, after) = (w(&mut robot, &plain), w(&mut robot, &q));
    assert!((best.cost + after.ln()).abs() < 1e-9 && after > 1.1 * before, "{before} {after}");
}

fn near(goal: &TipGoal) -> Vec3 {
    goal.goal.position.unwrap()
}

#[test]
fn mistakes_are_refused_and_q_is_left_alone() {
    let model = torso();
    let [left, ends] = ["left", "ends"].map(|p| model.part(p).unwrap());
    let robot = Robot::new(&model);
    let mut search = WholeBodyIk::new(&robot, 1);
    let ok = TipGoal::new(left, Goal::position(Vec3::new(0.5, 0.2, 1.2)));
    let home = model.multibody().neutral_q();
    let mut q = home.clone();
    let normal = Effort::default();
    assert!(matches!(search.resume(5, &mut q), Err(RobotError::NoSearch { .. })));
    let mut refuse = |goals: &[TipGoal], start: &[f64]| {
        let mut q = start.to_vec();
        let e = search.solve(&robot, goals, &normal, &mut q).unwrap_err();
        assert!(start.iter().zip(&q).all(|(a, b)| a.to_bits() == b.to_bits()));
        e
    };
    let room = refuse(&[ok, ok], &home);
    assert_eq!(room, RobotError::NoRoom { what: "goals", wanted: 2, room: 1 });
    let itself = refuse(&[ok.seen_from(Frame::Tip(left))], &home).to_string();
    assert!(itself.contains("tip relative to itself"), "{itself}");
    assert!(matches!(refuse(&[TipGoal { part: ends, ..ok }], &home), RobotError::NotAChain { .. }));
    assert!(matches!(
        refuse(&[ok.seen_from(Frame::Tip(ends))], &home),
        RobotError::NotAChain { .. }
    ));
    let nothing = TipGoal { goal: Goal::NOTHING, ..ok };
    assert!(matches!(refuse(&[nothing], &home), RobotError::OutOfRange { .. }));
    let mut outside = home.clone();
    outside[2] = 3.0;
    assert!(matches!(refuse(&[ok], &outside), RobotError::OutsideLimits { value: 3.0, .. }));
    assert!(matches!(refuse(&[ok], &home[1..]), RobotError::Length { .. }));
    outside[2] = f64::NAN;
    assert!(matches!(refuse(&[ok], &outside), RobotError::NotFinite { index: 2, .. }));
    let other = Robot::new(&torso());
    assert!(matches!(search.begin(&other, &[ok], &normal, &home), Err(RobotError::ForeignHandle)));
    assert!(search.keep(&[99]).unwrap_err().to_string().contains("below nv"));
    let loose = Effort { tolerances: [0.0, 1e-9], ..normal };
    assert!(search.solve(&robot, &[], &loose, &mut q).is_err());
    let mut robot = robot;
    let none = Prefer { centred: 0.0, ..Prefer::centred() };
    assert!(search.best(&mut robot, &[ok], &none, &normal, &mut q).is_err());
    // A single chain cannot have a goal relative to a frame that moves with the chain.
    let trunk = model.part("trunk").unwrap();
    let told =
        robot.inverse_kinematics(trunk, &ok.goal, Frame::Tip(left), &normal, &mut q).unwrap_err();
    assert!(told.to_string().contains("moves with the chain"), "{told}");
}

/// Efforts of all sizes, tolerances that cannot be met, goals within and out of reach, for one chain and for the whole robot: the number of steps
/// never exceeds the stated maximum.
#[test]
fn no_search_takes_more_steps_than_the_worst_case() {
    let model = torso();
    let [left, right] = ["left", "right"].map(|p| model.part(p).unwrap());
    let (mut robot, _) = held(&model);
    let free = Robot::new(&model);
    let mut search = WholeBodyIk::new(&robot, 2);
    let mut share = [0.0_f64; 2];
    for k in 0..48 {
        let tolerances = [[1e-9; 2], [1e-3; 2], [1e-15; 2], [1e-300; 2]][k % 4];
        let [steps, restarts] = [[1, 0], [3, 2], [100, 1], [0, 0], [20, 9]][k % 5];
        let effort = Effort { tolerances, steps, restarts, kinematics: usize::MAX };
        let X = tips(&mut robot.clone(), &inside(&model, k as u64), &[left, right]);
        let far = if k % 3 == 0 { 2.0 } else { 0.0 };
        let at = Pose::new(X[0].rotation, X[0].position + Vec3::x() * far);
        let goal = Goal::pose(at).weights(1.0, 0.2);
        let start = inside(&model, 100 + k as u64);
        let mut q = start.clone();
        let answer = robot.inverse_kinematics(left, &goal, Frame::World, &effort, &mut q).unwrap();
        let most = effort.worst_case_steps(&goal);
        assert!(answer.kinematics <= most, "{k}: {} of {most}", answer.kinematics);
        share[0] = share[0].max(answer.kinematics as f64 / most as f64);
        // Search with the whole robot, with empty hands and with the box.
        let goals = [TipGoal::new(left, goal), TipGoal::new(right, Goal::pose(X[1]))];
        for (robot, goals) in [(&free, &goals[..]), (&robot, &goals[..1])] {
            let mut q = start.clone();
            search.begin(robot, goals, &effort, &q).unwrap();
            let (mut took, most) = (0, search.worst_case_steps(goals, &effort));
            while let Ok(Answer { outcome: Outcome::Unfinished, .. }) = search.resume(1, &mut q) {
                took += 1;
                assert!(took <= most, "{k}: {most}");
            }
            share[1] = share[1].max(f64::from(took as u32) / most as f64);
        }
    }
    println!("shares of the worst case: {share:?}");
    assert!(share[0] > 0.1, "a bound that says something: {share:?}");
    // Huge numbers must not overflow.
    let endless = Effort { steps: usize::MAX, restarts: usize::MAX, ..Effort::default() };
    assert_eq!(endless.worst_case_steps(&Goal::position(Vec3::x())), usize::MAX);
    let default = Effort::default().worst_case_steps(&Goal::pose(Pose::identity()));
    assert!(default < 30_000, "{default}");
}
