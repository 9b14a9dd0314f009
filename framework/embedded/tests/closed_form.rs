//! All solutions of arms with a closed form: complete, exact, within limits; errors.

use crate::support::*;
use linkwork_embedded::multibody::{BodySpec, Builder, Hinge, Limits};
use linkwork_embedded::spatial::{Pose, Quat, Vec3};
use linkwork_embedded::*;
use std::f64::consts::{FRAC_PI_2, PI};
use std::sync::Arc;

/// An arm of hinges given by axis and point at zero angles, and by its tip in that configuration.
fn arm(axes: &[(Vec3, Vec3)], tip: Vec3, limits: Limits) -> Arc<RobotModel> {
    let mut b = Builder::new();
    let (mut parent, mut last) = ("world".to_owned(), Vec3::zeros());
    for (i, (h, p)) in axes.iter().enumerate() {
        let name = format!("link{i}");
        let hinge = Hinge::pin(h.normalize()).limits(limits);
        let at = p - last;
        let spec =
            BodySpec::new(&name, &parent).hinge_in_parent(Pose::translation(at.x, at.y, at.z));
        b.body(spec.hinge(hinge));
        (parent, last) = (name, *p);
    }
    let at = tip - last;
    b.body(BodySpec::new("tool", &parent).hinge_in_parent(Pose::translation(at.x, at.y, at.z)));
    let parts = vec![PartSpec::chain("arm", "world", "tool")];
    RobotModel::new(&ModelSpec { mechanism: b, parts, ..ModelSpec::default() }).unwrap()
}

fn v(x: f64, y: f64, z: f64) -> Vec3 {
    Vec3::new(x, y, z)
}

const TURN: Limits = Limits { lower: -PI, upper: PI, ..Limits::NONE };

/// One arm for each kind, and each kind reversed. Dimensions: PUMA 560 (Corke, Armstrong 1994), KUKA-like with an offset at the shoulder, Franka
/// Panda without its last hinge. The others are arbitrary, so that they have only the special geometry of their kind.
fn kinds() -> Vec<(&'static str, &'static str, Arc<RobotModel>)> {
    let wrist = |w: Vec3| [(v(1.0, 0.2, 0.3), w), (v(0.1, 1.0, -0.2), w), (v(0.7, 0.1, 0.8), w)];
    let odd = [(v(0.1, 0.2, 1.0), v(0.0, 0.0, 0.1)), (v(0.9, 0.3, 0.1), v(0.1, 0.2, 0.4))];
    let third = (v(0.5, -0.6, 0.7), v(0.3, 0.1, 0.9));
    let with =
        |first: [(Vec3, Vec3); 3]| [first.to_vec(), wrist(v(0.8, 0.3, 0.7)).to_vec()].concat();
    let back = |axes: Vec<(Vec3, Vec3)>| axes.into_iter().rev().collect::<Vec<_>>();
    let meet12 = with([odd[0], (odd[1].0, odd[0].1), third]);
    let meet23 = with([odd[0], odd[1], (third.0, odd[1].1)]);
    let parallel12 = with([odd[0], (odd[0].0, odd[1].1), third]);
    let parallel23 = with([odd[0], odd[1], (odd[1].0 * -1.0, third.1)]);
    let three = vec![
        odd[0],
        odd[1],
        (odd[1].0, third.1),
        (odd[1].0 * -1.0, v(0.6, 0.2, 1.1)),
        (third.0, v(0.8, 0.4, 1.0)),
        (v(0.2, 1.0, 0.4), v(0.8, 0.4, 1.0)),
    ];
    let puma = vec![
        (Vec3::z(), Vec3::zeros()),
        (Vec3::y(), v(0.0, 0.0, 0.0)),
        (Vec3::y(), v(0.4318, 0.15005, 0.0)),
        (Vec3::z(), v(0.4521, 0.15005, 0.4318)),
        (Vec3::y(), v(0.4521, 0.15005, 0.4318)),
        (Vec3::z(), v(0.4521, 0.15005, 0.4318)),
    ];
    let kuka = vec![
        (-Vec3::z(), v(0.0, 0.0, 0.45)),
        (Vec3::y(), v(0.15, 0.0, 0.45)),
        (Vec3::y(), v(0.76, 0.0, 0.45)),
        (-Vec3::x(), v(1.42, 0.0, 0.47)),
        (Vec3::y(), v(1.42, 0.0, 0.47)),
        (-Vec3::x(), v(1.42, 0.0, 0.47)),
    ];
    let tip = v(0.9, 0.5, 0.6);
    let (last, first) = ("last three", "first three");
    [
        ("meet 1 2", last, meet12.clone()),
        ("meet 2 3", last, meet23.clone()),
        ("parallel 1 2", last, parallel12.clone()),
        ("parallel 2 3", last, parallel23.clone()),
        ("three parallel", "second, third", three.clone()),
        ("meet 1 2, back", first, back(meet12)),
        ("meet 2 3, back", first, back(meet23)),
        ("parallel 1 2, back", first, back(parallel12)),
        ("parallel 2 3, back", first, back(parallel23)),
        ("three parallel, back", "third, fourth", back(three)),
        ("PUMA 560", last, puma),
        ("KUKA", last, kuka),
    ]
    .map(|(name, geometry, axes)| (name, geometry, arm(&axes, tip, TURN)))
    .to_vec()
}

/// Seven hinges of a Franka Panda (from its maker's table of Denavit-Hartenberg parameters), zero angles.
fn panda() -> Arc<RobotModel> {
    let axes = [
        (Vec3::z(), v(0.0, 0.0, 0.333)),
        (Vec3::y(), v(0.0, 0.0, 0.333)),
        (Vec3::z(), v(0.0, 0.0, 0.649)),
        (-Vec3::y(), v(0.0825, 0.0, 0.649)),
        (Vec3::z(), v(0.0, 0.0, 1.033)),
        (-Vec3::y(), v(0.0, 0.0, 1.033)),
        (-Vec3::z(), v(0.088, 0.0, 1.033)),
    ];
    arm(&axes, v(0.088, 0.0, 0.926), TURN)
}

struct Case {
    model: Arc<RobotModel>,
    robot: Robot,
    closed: ClosedForm,
    part: Part,
}

impl Case {
    fn new(model: Arc<RobotModel>, held: Option<usize>) -> Case {
        let part = model.part("arm").unwrap();
        let closed = model.closed_form(part, held).unwrap_or_else(|e| panic!("{e}"));
        Case { robot: Robot::new(&model), model, closed, part }
    }

    fn all(&mut self, X: &Pose, q: &[f64]) -> Vec<Vec<f64>> {
        let mut out = vec![f64::NAN; q.len() * ClosedForm::MOST];
        let n = self
            .robot
            .inverse_kinematics_all(&self.closed, &Goal::pose(*X), Frame::World, q, &mut out)
            .unwrap();
        out.chunks(q.len()).take(n).map(<[f64]>::to_vec).collect()
    }

    /// Computes the tip from the poses of the bodies, independently of the solver.
    fn tip(&self, q: &[f64]) -> Pose {
        let all = self.model.multibody().body_poses(q);
        all[self.model.bodies(self.part).unwrap().last().unwrap().index()]
    }
}

/// Returns the largest difference of angles, modulo whole turns.
fn turned_apart(a: &[f64], b: &[f64]) -> f64 {
    let d = a.iter().zip(b).map(|(a, b)| {
        let turns = (a - b) / (2.0 * PI);
        (turns - turns.round()).abs() * 2.0 * PI
    });
    d.fold(0.0, f64::max)
}

#[test]
fn every_kind_finds_the_angles_that_made_the_pose_and_nothing_that_does_not_meet_it() {
    for (name, geometry, model) in kinds() {
        let mut case = Case::new(model, None);
        assert!(case.closed.geometry().contains(geometry), "{name}: {}", case.closed.geometry());
        assert_eq!(case.closed.held(), None);
        let mut rng = Rng(7);
        let mut most = 0;
        for _ in 0..200 {
            let q: Vec<f64> = (0..6).map(|_| rng.within(-PI, PI)).collect();
            let X = case.tip(&q);
            let near: Vec<f64> = (0..6).map(|_| rng.within(-PI, PI)).collect();
            let found = case.all(&X, &near);
            let own = found.iter().map(|f| turned_apart(f, &q)).fold(f64::INFINITY, f64::min);
            assert!(own < 1e-6, "{name}: {q:?} is not among {found:?}");
            for f in &found {
                let (p, R) = apart(&case.tip(f), &X);
                assert!(p < 2e-9 && R < 2e-9, "{name} {p:e} {R:e}");
                assert!(f.iter().all(|x| x.abs() <= PI));
            }
            for (i, f) in found.iter().enumerate() {
                assert!(found[..i].iter().all(|g| turned_apart(f, g) > 1e-6), "{name}: twice");
            }
            let far = |f: &[f64]| difference_squared(f, &near);
            assert!(found.is_sorted_by(|a, b| far(a) <= far(b)), "{name}: nearest first");
            most = most.max(found.len());
        }
        assert!(most == 8 || name.contains("12") && most == 4, "{name}: at most {most}");
    }
}

fn difference_squared(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| (a - b).powi(2)).sum()
}

/// The search does not use closed forms. Every result from many starts is one of the closed-form solutions, and every solution is found.
#[test]
fn a_search_from_many_starts_finds_the_same_set() {
    for (name, _, model) in kinds() {
        let mut case = Case::new(model, None);
        let mut rng = Rng(23);
        for _ in 0..2 {
            let q: Vec<f64> = (0..6).map(|_| rng.within(-PI, PI)).collect();
            let X = case.tip(&q);
            let found = case.all(&X, &q);
            let mut seen = vec![0; found.len()];
            for _ in 0..400 {
                let mut start: Vec<f64> = (0..6).map(|_| rng.within(-PI, PI)).collect();
                let (goal, effort) = (Goal::pose(X), Effort::one_start());
                let answer = case
                    .robot
                    .inverse_kinematics(case.part, &goal, Frame::World, &effort, &mut start)
                    .unwrap();
                if answer.outcome != Outcome::Met {
                    continue;
                }
                let at = found.iter().position(|f| turned_apart(f, &start) < 1e-5);
                seen[at.unwrap_or_else(|| panic!("{name}: {start:?} is not among {found:?}"))] += 1;
            }
            let missed = seen.iter().filter(|n| **n == 0).count();
            assert!(missed == 0, "{name}: the search never found {missed} of {}", seen.len());
        }
    }
}

#[test]
fn arms_of_the_reference_are_solved_at_every_pose_of_theirs() {
    for (name, held, eight) in [("ur5", None, true), ("iiwa7", Some(2), false)] {
        let Some(json) = reference(&format!("robodarts/ik_{name}.json")) else { return };
        let [base, tip] = ["base", "tip"].map(|k| json[k].as_str().unwrap());
        let parts = [PartSpec::chain("arm", base, tip)];
        let model = robot(&format!("robots/{name}.urdf"), &parts, vec![]);
        let mut case = Case::new(model, None);
        assert_eq!(case.closed.held(), held);
        let n = case.model.nq();
        let (mut count, mut total) = (0, 0);
        for row in json["far"].as_array().unwrap() {
            let q = &numbers(row)[..n];
            let X = case.tip(q);
            let found = case.all(&X, q);
            let own = found.first().map_or(f64::INFINITY, |f| difference(f, q));
            assert!(own < 1e-6, "{name}: {q:?} is not the first of {found:?}");
            for f in &found {
                let (p, R) = apart(&case.tip(f), &X);
                assert!(p < 2e-9 && R < 2e-9, "{name} {p:e} {R:e}");
                assert!(held.is_none_or(|k| f[k] == q[k]));
            }
            count += 1;
            total += found.len();
        }
        println!("{name}: {total} solutions of {count} poses");
        // A UR5 has four or eight solutions, because its hinges rotate by two full turns. The limits of the iiwa leave
        // fewer.
        assert!(count >= 200 && (!eight || total >= 4 * count), "{name}: {total} of {count}");
    }
}

#[test]
fn seven_hinges_with_one_held_at_its_value() {
    let model = panda();
    let dofs = model.dofs(model.part("arm").unwrap()).unwrap().to_vec();
    // By default the last hinge keeps its value. The other six hinges have a shoulder whose axes meet in a point, and
    // axes 5 and 6 meet.
    let mut case = Case::new(model.clone(), None);
    assert_eq!(case.closed.held(), Some(dofs[6]));
    let mut rng = Rng(5);
    for _ in 0..200 {
        let q: Vec<f64> = (0..7).map(|_| rng.within(-PI, PI)).collect();
        let X = case.tip(&q);
        let found = case.all(&X, &q);
        assert!(found.iter().any(|f| difference(f, &q) < 1e-6), "{q:?}: {found:?}");
        for f in &found {
            let (p, R) = apart(&case.tip(f), &X);
            assert!(p < 2e-9 && R < 2e-9 && f[6] == q[6], "{p:e} {R:e}");
        }
    }
    let e = model.closed_form(case.part, Some(dofs[0])).unwrap_err();
    assert!(e.to_string().contains("do not intersect, and are not parallel"), "{e}");
    assert!(matches!(model.closed_form(case.part, Some(99)), Err(RobotError::NoClosedForm { .. })));
}

/// Shoulder above the first axis, elbow straight, wrist straight: an angle that does not influence the pose stays unchanged.
#[test]
fn singular_poses_are_met_and_free_angles_stay() {
    let (_, _, model) = kinds().into_iter().find(|k| k.0 == "PUMA 560").unwrap();
    let mut case = Case::new(model, None);
    let straight_elbow = 0.4318f64.atan2(0.0203);
    for q in [
        [0.3, -0.4, 0.9, 0.7, 0.0, 0.2],
        [0.3, -0.4, straight_elbow, 0.7, 0.5, 0.2],
        [0.0, 0.0, 0.0, 0.0, 0.0, 0.0],
        [0.3, FRAC_PI_2, 0.0, 0.7, PI, 0.2],
    ] {
        let X = case.tip(&q);
        let found = case.all(&X, &q);
        let own = found.iter().map(|f| turned_apart(f, &q)).fold(f64::INFINITY, f64::min);
        assert!(own < 1e-6, "{q:?} is not among {found:?}");
        for f in &found {
            let (p, R) = apart(&case.tip(f), &X);
            assert!(p < 2e-9 && R < 2e-9, "{p:e} {R:e}");
        }
    }
}

#[test]
fn limits_choose_the_copy_that_lies_within_and_near() {
    let axes = |limits| {
        let w = v(0.8, 0.0, 0.3);
        let axes = [
            (Vec3::z(), Vec3::zeros()),
            (Vec3::y(), v(0.0, 0.0, 0.3)),
            (Vec3::y(), v(0.4, 0.0, 0.3)),
            (Vec3::x(), w),
            (Vec3::y(), w),
            (Vec3::x(), w),
        ];
        arm(&axes, v(0.9, 0.0, 0.3), limits)
    };
    let q = [0.4, -0.7, 1.1, 0.3, 0.8, -0.5];
    let mut wide = Case::new(axes(Limits::position(-10.0, 10.0)), None);
    let X = wide.tip(&q);
    let near: Vec<f64> = q.iter().map(|x| x + 2.0 * PI).collect();
    assert!(difference(&wide.all(&X, &near)[0], &near) < 1e-9);
    assert!(difference(&wide.all(&X, &q)[0], &q) < 1e-9);
    // The solution is a full turn outside of the limits; the same angle within the limits is
    // returned.
    let mut narrow = Case::new(axes(Limits::position(-1.2, 1.2)), None);
    let within = narrow.all(&X, &q);
    assert_eq!(within.len(), 1);
    assert!(difference(&within[0], &q) < 1e-9);
    let mut none = Case::new(axes(Limits::position(-0.2, 0.2)), None);
    assert_eq!(none.all(&X, &[0.0; 6]).len(), 0);
    // Without limits, there are eight solutions.
    let mut free = Case::new(axes(Limits::NONE), None);
    assert_eq!(free.all(&X, &q).len(), 8);
    // The pose is out of reach.
    assert_eq!(free.all(&Pose::translation(3.0, 0.0, 0.0), &q).len(), 0);
}

/// The base has moved; the goal is given in the world, or in the base.
#[test]
fn what_carries_the_arm_counts() {
    let mut b = Builder::new();
    b.body(BodySpec::new("cart", "world").hinge(Hinge::planar()));
    let w = v(0.8, 0.0, 0.3);
    let mut parent = "cart".to_owned();
    let mut last = Vec3::zeros();
    let axes = [Vec3::z(), Vec3::y(), Vec3::y(), Vec3::x(), Vec3::y(), Vec3::x()];
    let points = [Vec3::zeros(), v(0.0, 0.0, 0.3), v(0.4, 0.0, 0.3), w, w, w];
    for (i, (h, p)) in axes.iter().zip(points).enumerate() {
        let name = format!("link{i}");
        let at = p - last;
        let spec =
            BodySpec::new(&name, &parent).hinge_in_parent(Pose::translation(at.x, at.y, at.z));
        b.body(spec.hinge(Hinge::pin(*h)));
        (parent, last) = (name, p);
    }
    let parts = vec![PartSpec::chain("arm", "cart", "link5")];
    let spec = ModelSpec { mechanism: b, parts, ..ModelSpec::default() };
    let mut case = Case::new(RobotModel::new(&spec).unwrap(), None);
    let mut q = case.model.multibody().neutral_q();
    let n = q.len();
    q[..3].copy_from_slice(&[1.2, 0.4, -0.7]);
    q[n - 6..].copy_from_slice(&[0.4, -0.7, 1.1, 0.3, 0.8, -0.5]);
    let X = case.tip(&q);
    let found = case.all(&X, &q);
    assert!(found.len() == 8 && difference(&found[0], &q) < 1e-9);
    assert!(found.iter().all(|f| f[..3] == q[..3]));
    case.robot.set_q(&q).unwrap();
    let in_base = case.robot.base_pose(case.part).unwrap().inverse() * X;
    let mut out = vec![0.0; n];
    let goal = Goal::pose(in_base);
    let e = case
        .robot
        .inverse_kinematics_all(&case.closed, &goal, Frame::Base, &q, &mut out)
        .unwrap_err();
    assert!(matches!(e, RobotError::NoRoom { wanted: 8, room: 1, .. }), "{e}");
    assert!(difference(&out, &q) < 1e-9, "the nearest is there all the same");
}

#[test]
fn what_has_no_closed_form_and_what_is_no_goal_is_refused() {
    let odd = |i: usize| {
        let s = i as f64;
        (v(s.sin(), (2.0 * s).cos(), 0.5), v(0.1 * s, (3.0 * s).sin(), 0.2 * s))
    };
    let axes: Vec<_> = (0..8).map(odd).collect();
    for (n, why) in
        [(6, "do not intersect"), (7, "do not intersect"), (5, "six nor seven"), (8, "six nor")]
    {
        let model = arm(&axes[..n], v(1.0, 1.0, 1.0), TURN);
        let e = model.closed_form(model.part("arm").unwrap(), None).unwrap_err();
        assert!(
            e.to_string().contains(why) && e.to_string().contains("`inverse_kinematics`"),
            "{e}"
        );
    }
    let mut b = Builder::new();
    b.body(BodySpec::new("a", "world").hinge(Hinge::ball()));
    for (name, parent) in [("b", "a"), ("c", "b"), ("d", "c")] {
        b.body(BodySpec::new(name, parent).hinge(Hinge::slider(Vec3::x())));
    }
    let parts = vec![PartSpec::chain("arm", "world", "d")];
    let model =
        RobotModel::new(&ModelSpec { mechanism: b, parts, ..ModelSpec::default() }).unwrap();
    let e = model.closed_form(model.part("arm").unwrap(), None).unwrap_err();
    assert!(e.to_string().contains("more than one degree of freedom"), "{e}");

    let (_, _, model) = kinds().remove(0);
    let mut case = Case::new(model, None);
    let (mut out, q) = ([0.0; 48], [0.1; 6]);
    let mut refuse = |goal: Goal, q: &[f64]| {
        case.robot
            .inverse_kinematics_all(&case.closed, &goal, Frame::World, q, &mut out)
            .unwrap_err()
    };
    let pose = Pose::new(Quat::identity(), v(0.1, 0.2, 0.3));
    assert!(matches!(refuse(Goal::position(v(0.1, 0.2, 0.3)), &q), RobotError::OutOfRange { .. }));
    assert!(matches!(refuse(Goal::pose(pose), &q[1..]), RobotError::Length { .. }));
    assert!(matches!(refuse(Goal::pose(pose), &[f64::NAN; 6]), RobotError::NotFinite { .. }));
    let nowhere = Goal::position(v(f64::NAN, 0.0, 0.0));
    assert!(matches!(refuse(nowhere, &q), RobotError::NotFinite { .. }));
    let mut seven = Case::new(panda(), None);
    let (goal, mut out) = (Goal::pose(pose), [0.0; 56]);
    let outside = [0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 4.0];
    let e = seven
        .robot
        .inverse_kinematics_all(&seven.closed, &goal, Frame::World, &outside, &mut out)
        .unwrap_err();
    assert!(matches!(e, RobotError::OutsideLimits { value: 4.0, .. }), "{e}");
    // The closed form of another robot is rejected.
    let e = seven
        .robot
        .inverse_kinematics_all(&case.closed, &goal, Frame::World, &[0.0; 7], &mut out)
        .unwrap_err();
    assert!(matches!(e, RobotError::ForeignHandle), "{e}");
}
