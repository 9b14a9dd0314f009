//! Tips of a robot with two arms through the C interface: manipulability, rates, parts of a pose as goals, operational space, tasks by priority.
//! Results are bit-identical with Rust, calls do not allocate, and errors are codes.

use crate::support::*;
use linkwork_embedded::spatial::{Pose, Vec3};
use linkwork_embedded::*;
use linkwork_robot::*;
use std::ptr::{null, null_mut};

const TWIST: [f64; 6] = [0.1, -0.2, 0.3, 0.05, 0.15, -0.1];
const NOWHERE: LwGoal = LwGoal {
    pose: LwPose { position: [0.0; 3], quaternion: [0.0, 0.0, 0.0, 1.0] },
    weights: [1.0; 2],
    parts: 0,
    direction: [0.0; 3],
    axis: [0.0; 3],
    towards: [0.0; 3],
    within: 0.0,
};
const NO_OBJECTIVE: LwObjective = LwObjective {
    kind: LW_OBJECTIVE_TIP,
    level: 0,
    weight: 1.0,
    motion: [0.0; 6],
    length: 1.0,
    part: LEFT,
    rows: LW_ROWS_ALL,
    posture: null(),
    posture_count: 0,
};

#[test]
fn manipulability_and_rates() {
    let mut two = Two::new();
    // SAFETY: valid handles of the library, arrays of the lengths given; the same applies in all tests below.
    unsafe {
        let mut told = std::mem::zeroed::<LwManipulability>();
        let (mut mine, mut theirs) = ([9.0; 6], [9.0; 6]);
        let kinds = [
            (LW_ROWS_ALL, Rows::All { length: 0.4 }),
            (LW_ROWS_LINEAR, Rows::Linear),
            (LW_ROWS_ANGULAR, Rows::Angular),
        ];
        let g = mine.as_mut_ptr();
        for (code, rows) in kinds {
            quiet(|| lw_robot_manipulability(two.r, RIGHT, code, 0.4, &mut told, g, 6));
            let rust = two.robot.manipulability(two.right, rows, Some(&mut theirs)).unwrap();
            same(&[told.w], &[rust.w]);
            same(&told.singular_values, &rust.singular_values);
            // The arrays are column-major, so compare with the transpose.
            same(&told.axes, rust.axes.transpose().as_slice());
            same(&mine, &theirs);
            quiet(|| lw_robot_manipulability(two.r, RIGHT, code, 0.4, &mut told, null_mut(), 0));
            same(&[told.w], &[rust.w]);
            if let Rows::All { .. } = rows {
                // Check the documented formulas of the ellipsoids.
                let u = [0.3, 0.1, -0.2, 0.5, 0.6, -0.4];
                let length: f64 = u.iter().map(|x| x * x).sum::<f64>().sqrt();
                let along = |k: usize| -> f64 {
                    (0..6).map(|i| told.axes[6 * i + k] * u[i] / length).sum()
                };
                let square = |x: f64| x * x;
                let s = told.singular_values;
                let speed: f64 = (0..6).map(|k| square(along(k) / s[k])).sum();
                assert!((speed.sqrt().recip() / rust.velocity(&u) - 1.0).abs() < 1e-12);
                let force: f64 = (0..6).map(|k| square(along(k) * s[k])).sum();
                assert!((force.sqrt().recip() / rust.force(&u) - 1.0).abs() < 1e-12);
            }
        }
        let ask = |part, rows, length, out, g, n| {
            lw_robot_manipulability(two.r, part, rows, length, out, g, n)
        };
        let out = &raw mut told;
        two.refused(ask(RIGHT, 3, 1.0, out, g, 6), LwStatus::OutOfRange, "LW_ROWS_");
        two.refused(ask(RIGHT, 0, 0.0, out, g, 6), LwStatus::OutOfRange, "length");
        two.refused(ask(RIGHT, 0, f64::NAN, out, g, 6), LwStatus::OutOfRange, "length");
        two.refused(ask(RIGHT, 0, 1.0, out, g, 5), LwStatus::Length, "`gradient`");
        two.refused(ask(7, 0, 1.0, out, g, 6), LwStatus::Foreign, "");
        all_null(&[
            ask(RIGHT, 0, 1.0, null_mut(), g, 6),
            ask(RIGHT, 0, 1.0, out, null_mut(), 6),
            lw_robot_manipulability(null_mut(), 0, 0, 1.0, out, g, 6),
        ]);

        let mut base = NOWHERE.pose;
        quiet(|| lw_robot_base_pose(two.r, LEFT, &mut base));
        same_pose(&base, &two.robot.base_pose(two.left).unwrap());

        let (mut v, mut residual) = (V, [9.0; 2]);
        let p = v.as_mut_ptr();
        // The twist is faster than the limits allow.
        for fast in [1.0, 40.0] {
            let twist = TWIST.map(|x| fast * x);
            quiet(|| lw_robot_rates(two.r, LEFT, twist.as_ptr(), p, 13, residual.as_mut_ptr()));
            let mut rust = V;
            let left = two.robot.rates(two.left, &six(&twist), &mut rust).unwrap();
            same(&v, &rust);
            assert_eq!(bits(&residual), bits(&[left.orientation, left.position]));
            v = V;
        }
        assert!(residual[0] > 0.1 && residual[1] > 0.1, "{residual:?}");
        let twist = TWIST.as_ptr();
        quiet(|| lw_robot_rates(two.r, LEFT, twist, p, 13, null_mut()));
        let ask =
            |twist: *const f64, p, n, residual| lw_robot_rates(two.r, LEFT, twist, p, n, residual);
        let nan = [f64::NAN; 6];
        let kept = v;
        two.refused(ask(nan.as_ptr(), p, 13, null_mut()), LwStatus::NotFinite, "`twist`");
        two.refused(ask(twist, p, 12, null_mut()), LwStatus::Length, "`v`");
        let odd = p.cast::<u8>().add(1).cast::<f64>();
        two.refused(ask(twist, odd, 13, null_mut()), LwStatus::Misaligned, "`v`");
        two.refused(ask(twist, p, 13, odd), LwStatus::Misaligned, "`residual`");
        all_null(&[
            ask(null(), p, 13, null_mut()),
            ask(twist, null_mut(), 13, null_mut()),
            lw_robot_rates(null_mut(), LEFT, twist, p, 13, null_mut()),
            lw_robot_base_pose(two.r, LEFT, null_mut()),
            lw_robot_base_pose(null_mut(), LEFT, &mut base),
        ]);
        assert_eq!(v, kept, "nothing was written");
    }
}

/// Each part of a pose as a goal, with its goal in Rust.
fn goals() -> Vec<(LwGoal, Goal, Frame)> {
    let X = turned();
    let (place, towards) = (LW_GOAL_POSITION, [0.5, 0.2, -0.9]);
    let length = f64::sqrt(towards.iter().map(|x| x * x).sum());
    let n = towards.map(|x| x / length);
    let (z, point) = ([0.0, 0.0, 1.0], [0.9, 0.4, 0.2]);
    let pose = LwPose::from(X);
    let at = LwGoal { pose, parts: place, direction: n, axis: z, towards: n, ..NOWHERE };
    let spot = Goal::position(X.position);
    let along = Pointing::along(z.into(), n.into());
    let looks = Pointing::at(z.into(), point.into());
    let weights = [2.0, 0.5];
    vec![
        (
            LwGoal { parts: place | LW_GOAL_PLANE, ..at },
            spot.place(Place::Plane(n.into())),
            Frame::World,
        ),
        (
            LwGoal { parts: place | LW_GOAL_LINE, ..at },
            spot.place(Place::Line(n.into())),
            Frame::World,
        ),
        (LwGoal { parts: place | LW_GOAL_AXIS, ..at }, spot.and_pointing(along), Frame::World),
        (
            LwGoal { parts: place | LW_GOAL_AXIS, within: 0.3, weights, ..at },
            Goal { weights, ..spot.and_pointing(along.within(0.3)) },
            Frame::World,
        ),
        (
            LwGoal { parts: place | LW_GOAL_LOOK_AT, towards: point, ..at },
            spot.and_pointing(looks),
            Frame::World,
        ),
        (
            LwGoal { parts: LW_GOAL_LOOK_AT | LW_GOAL_IN_BASE, towards: point, ..at },
            Goal::pointing(looks),
            Frame::Base,
        ),
    ]
}

#[test]
fn parts_of_a_pose_and_preferences() {
    let mut two = Two::new();
    // SAFETY: as above.
    unsafe {
        let mut answer = std::mem::zeroed::<LwAnswer>();
        let mut best = std::mem::zeroed::<LwBest>();
        let mut ends = Vec::new();
        let effort = LwEffort { tolerances: [1e-9; 2], steps: 100, restarts: 8, kinematics: 9000 };
        let own = Effort { tolerances: [1e-9; 2], steps: 100, restarts: 8, kinematics: 9000 };
        let (likes, prefer) = likes(3);
        for (goal, rust, frame) in goals() {
            let (mut q, mut theirs) = (Q, Q);
            quiet(|| {
                lw_robot_inverse_kinematics(
                    two.r,
                    LEFT,
                    &goal,
                    &effort,
                    q.as_mut_ptr(),
                    13,
                    &mut answer,
                )
            });
            let told =
                two.robot.inverse_kinematics(two.left, &rust, frame, &own, &mut theirs).unwrap();
            assert_eq!(answer, LwAnswer::from(told));
            assert_eq!(answer.outcome, LwOutcome::Met, "{goal:?}");
            same(&q, &theirs);
            ends.push(bits(&q));
            let (mut q, mut theirs) = (Q, Q);
            let p = q.as_mut_ptr();
            quiet(|| {
                lw_robot_inverse_kinematics_best(
                    two.r, LEFT, &goal, &likes, &effort, p, 13, &mut best,
                )
            });
            let told = two
                .robot
                .inverse_kinematics_best(two.left, &rust, frame, &prefer, &own, &mut theirs)
                .unwrap();
            same(&q, &theirs);
            same(&[best.cost], &[told.cost]);
            let counts = (best.solutions, best.kinematics, best.outcome);
            assert_eq!(counts, (told.solutions, told.kinematics, told.outcome.into()));
            assert!(best.solutions > 1, "{best:?}");
        }
        ends.sort();
        ends.dedup();
        assert_eq!(ends.len(), 6, "every part of a pose counts");

        let (all, mut q) = (goals(), Q);
        let [plane, axis, look] = [0, 2, 4].map(|k| all[k].0);
        let bad = |g: LwGoal, needle| two.refused(ask_of(&two, &g), LwStatus::OutOfRange, needle);
        bad(LwGoal { parts: 128, ..plane }, "LW_GOAL_");
        bad(LwGoal { parts: plane.parts | LW_GOAL_LINE, ..plane }, "a plane or a line");
        bad(LwGoal { parts: LW_GOAL_PLANE | LW_GOAL_AXIS, ..plane }, "LW_GOAL_POSITION");
        bad(LwGoal { parts: axis.parts | LW_GOAL_LOOK_AT, ..axis }, "a direction or a point");
        bad(LwGoal { parts: axis.parts | LW_GOAL_ORIENTATION, ..axis }, "every axis");
        bad(LwGoal { direction: [0.0; 3], ..plane }, "length 1");
        bad(LwGoal { axis: [0.0, 0.0, 2.0], ..axis }, "length 1");
        bad(LwGoal { towards: [0.0; 3], ..axis }, "length 1");
        bad(LwGoal { within: 4.0, ..axis }, "angle of a cone");
        bad(LwGoal { within: f64::NAN, ..axis }, "angle of a cone");
        let nan = [f64::NAN; 3];
        two.refused(
            ask_of(&two, &LwGoal { direction: nan, ..plane }),
            LwStatus::NotFinite,
            "`direction`",
        );
        two.refused(
            ask_of(&two, &LwGoal { towards: nan, ..look }),
            LwStatus::NotFinite,
            "`towards`",
        );
        two.refused(ask_of(&two, &LwGoal { axis: nan, ..look }), LwStatus::NotFinite, "`axis`");
        assert_eq!(ask_of(&two, &LwGoal { direction: nan, ..look }), LwStatus::Ok, "not read");

        let mut like = |likes: LwPrefer| {
            let p = q.as_mut_ptr();
            lw_robot_inverse_kinematics_best(two.r, LEFT, &axis, &likes, null(), p, 13, &mut best)
        };
        two.refused(like(LwPrefer { centred: -1.0, ..likes }), LwStatus::OutOfRange, "weights");
        let none = LwPrefer { centred: 0.0, near: 0.0, manipulable: 0.0, ..likes };
        two.refused(like(none), LwStatus::OutOfRange, "weights");
        two.refused(like(LwPrefer { length: 0.0, ..likes }), LwStatus::OutOfRange, "length");
        let p = q.as_mut_ptr();
        let (r, b) = (two.r, &raw mut best);
        all_null(&[
            lw_robot_inverse_kinematics_best(r, LEFT, null(), &likes, null(), p, 13, b),
            lw_robot_inverse_kinematics_best(r, LEFT, &axis, null(), null(), p, 13, b),
            lw_robot_inverse_kinematics_best(r, LEFT, &axis, &likes, null(), null_mut(), 13, b),
            lw_robot_inverse_kinematics_best(r, LEFT, &axis, &likes, null(), p, 13, null_mut()),
            lw_robot_inverse_kinematics_best(null_mut(), LEFT, &axis, &likes, null(), p, 13, b),
        ]);
        assert_eq!(q, Q, "nothing was written");
    }
}

/// Inverse kinematics with separate memory.
fn ask_of(two: &Two, goal: &LwGoal) -> LwStatus {
    let mut q = Q;
    // SAFETY: as above.
    unsafe {
        let mut answer = std::mem::zeroed::<LwAnswer>();
        lw_robot_inverse_kinematics(two.r, LEFT, goal, null(), q.as_mut_ptr(), 13, &mut answer)
    }
}

#[test]
fn operational_space() {
    let mut two = Two::new();
    two.robot.grasp(two.left, two.beam, Grasp::At(Pose::translation(0.1, 0.0, 0.05))).unwrap();
    let in_hand = LwPose { position: [0.1, 0.0, 0.05], quaternion: [0.0, 0.0, 0.0, 1.0] };
    let mut rust = TaskSpace::new(&two.robot, &[two.right, two.left]).unwrap();
    let a = [TWIST, TWIST.map(|x| 1.0 - x)].concat();
    let spring = |X: Pose, k: f64| Impedance {
        pose: X,
        twist: six(&TWIST),
        acceleration: six(&TWIST.map(|x| 2.0 * x)),
        stiffness: [1.0, 2.0, 3.0, 40.0, 50.0, 60.0].map(|x| k * x),
        damping: [0.1, 0.2, 0.3, 4.0, 5.0, 6.0],
    };
    let springs = [spring(given(turned()), 1.0), spring(Pose::identity(), 2.0)];
    let poses = [turned(), Pose::identity()];
    let in_c = [0, 1].map(|k: usize| (poses[k], springs[k])).map(|(X, s)| LwImpedance {
        pose: X.into(),
        twist: TWIST,
        acceleration: TWIST.map(|x| 2.0 * x),
        stiffness: s.stiffness,
        damping: s.damping,
    });
    // SAFETY: as above.
    unsafe {
        let r = two.r;
        assert_eq!(lw_robot_grasp(r, LEFT, BEAM, &in_hand), LwStatus::Ok);
        let mut s = null_mut();
        assert_eq!(lw_task_space_new(r, [RIGHT, LEFT].as_ptr(), 2, &mut s), LwStatus::Ok);
        let (mut mine, mut theirs) = (vec![0.0; 144], vec![0.0; 144]);
        let p = mine.as_mut_ptr();
        quiet(|| lw_task_space_compliance(r, s, p, 144));
        same(&mine, rust.compliance(&mut two.robot).unwrap());
        quiet(|| lw_task_space_inertia(r, s, p, 144));
        rust.inertia(&mut two.robot, &mut theirs).unwrap();
        same(&mine, &theirs);
        let (mut tau, mut wanted) = ([0.0; 13], [0.0; 13]);
        let (t, v, x) = (tau.as_mut_ptr(), V.as_ptr(), a.as_ptr());
        for rest in [None, Some(&VDOT[..])] {
            let p = rest.map_or(null(), |r| r.as_ptr());
            quiet(|| lw_task_space_forces(r, s, v, 13, x, 12, p, t));
            rust.forces(&mut two.robot, &V, &a, rest, &mut wanted).unwrap();
            same(&tau, &wanted);
            quiet(|| lw_task_space_impedance(r, s, v, 13, in_c.as_ptr(), 2, p, t));
            rust.impedance(&mut two.robot, &V, &springs, rest, &mut wanted).unwrap();
            same(&tau, &wanted);
        }
        let kept = tau;
        let forces = |n, rows, t| lw_task_space_forces(r, s, v, n, x, rows, null(), t);
        two.refused(forces(13, 11, t), LwStatus::Length, "`a` has 11 numbers, expected 12");
        two.refused(forces(12, 12, t), LwStatus::Length, "`v`");
        two.refused(forces(13, 12, x.cast_mut()), LwStatus::Overlap, "`a` and `tau`");
        two.refused(forces(13, 12, v.cast_mut().add(1)), LwStatus::Overlap, "`v` and `tau`");
        let over = lw_task_space_forces(r, s, v, 13, x, 12, t, t);
        two.refused(over, LwStatus::Overlap, "`rest` and `tau`");
        let nan = [f64::NAN; 13];
        let lost = lw_task_space_forces(r, s, nan.as_ptr(), 13, x, 12, null(), t);
        two.refused(lost, LwStatus::NotFinite, "`v`");
        two.refused(lw_task_space_inertia(r, s, p, 143), LwStatus::Length, "`out`");
        let soft =
            |k: LwImpedance, n| lw_task_space_impedance(r, s, v, 13, [k, k].as_ptr(), n, null(), t);
        two.refused(soft(in_c[0], 1), LwStatus::Length, "`springs`");
        two.refused(
            soft(LwImpedance { stiffness: [-1.0; 6], ..in_c[0] }, 2),
            LwStatus::OutOfRange,
            "stiffness",
        );
        two.refused(
            soft(LwImpedance { damping: [f64::NAN; 6], ..in_c[0] }, 2),
            LwStatus::NotFinite,
            "damping",
        );
        two.refused(
            soft(LwImpedance { twist: [f64::NAN; 6], ..in_c[0] }, 2),
            LwStatus::NotFinite,
            "`twist`",
        );
        two.refused(lw_task_space_new(r, [9].as_ptr(), 1, &mut s), LwStatus::Foreign, "");
        two.refused(lw_task_space_new(r, null(), 0, &mut s), LwStatus::Length, "`parts`");
        let w = in_c.as_ptr();
        all_null(&[
            lw_task_space_new(r, null(), 1, &mut s),
            lw_task_space_new(r, [0].as_ptr(), 1, null_mut()),
            lw_task_space_new(null_mut(), [0].as_ptr(), 1, &mut s),
            lw_task_space_compliance(r, null_mut(), p, 144),
            lw_task_space_compliance(r, s, null_mut(), 144),
            lw_task_space_compliance(null_mut(), s, p, 144),
            lw_task_space_inertia(r, null_mut(), p, 144),
            lw_task_space_inertia(r, s, null_mut(), 144),
            lw_task_space_inertia(null_mut(), s, p, 144),
            lw_task_space_forces(r, null_mut(), v, 13, x, 12, null(), t),
            lw_task_space_forces(r, s, null(), 13, x, 12, null(), t),
            lw_task_space_forces(r, s, v, 13, null(), 12, null(), t),
            lw_task_space_forces(r, s, v, 13, x, 12, null(), null_mut()),
            lw_task_space_impedance(r, null_mut(), v, 13, w, 2, null(), t),
            lw_task_space_impedance(r, s, null(), 13, w, 2, null(), t),
            lw_task_space_impedance(r, s, v, 13, null(), 2, null(), t),
            lw_task_space_impedance(r, s, v, 13, w, 2, null(), null_mut()),
        ]);
        // A robot of another model is rejected, even if the models are equal.
        let other = Two::new();
        other.refused(lw_task_space_inertia(other.r, s, p, 144), LwStatus::Foreign, "");
        // A clone belongs to the same model.
        let mut twin = null_mut();
        assert_eq!(lw_robot_clone(r, &mut twin), LwStatus::Ok);
        assert_eq!(lw_task_space_inertia(twin, s, p, 144), LwStatus::Ok);
        same(&mine, &theirs);
        assert_eq!(tau, kept, "nothing was written");
        lw_robot_free(twin);
        lw_task_space_free(s);
        lw_task_space_free(null_mut());
    }
}

/// A tip that is named twice cannot move independently, so it does not have a task inertia.
#[test]
fn tips_that_cannot_move_independently_are_told() {
    let two = Two::new();
    // SAFETY: as above.
    unsafe {
        let (mut s, mut out) = (null_mut(), [0.0; 144]);
        assert_eq!(lw_task_space_new(two.r, [LEFT, LEFT].as_ptr(), 2, &mut s), LwStatus::Ok);
        let told = lw_task_space_inertia(two.r, s, out.as_mut_ptr(), 144);
        two.refused(told, LwStatus::Singular, "cannot move independently");
        lw_task_space_free(s);
    }
}

#[test]
fn rates_for_wishes_within_guards() {
    let mut two = Two::new();
    let (still, mut posture) = ([0.0; 13], [0.0; 13]);
    posture[2] = 0.3;
    let tip = |rows| Aim::Tip { part: two.left, motion: six(&TWIST), rows };
    let rust = [
        Objective::new(4, Aim::Posture(&posture)).weight(0.5),
        Objective::new(1, tip(Rows::All { length: 0.3 })),
        Objective::new(2, Aim::Center(Vec3::new(0.02, 0.01, -0.03))),
    ];
    let motion = [9.0, 9.0, 9.0, 0.02, 0.01, -0.03];
    let objectives = [
        LwObjective {
            kind: LW_OBJECTIVE_POSTURE,
            level: 4,
            weight: 0.5,
            posture: posture.as_ptr(),
            posture_count: 13,
            ..NO_OBJECTIVE
        },
        LwObjective { level: 1, motion: TWIST, length: 0.3, ..NO_OBJECTIVE },
        LwObjective { kind: LW_OBJECTIVE_CENTER, level: 2, motion, ..NO_OBJECTIVE },
    ];
    let w = two.robot.manipulability(two.right, Rows::All { length: 1.0 }, None).unwrap().w;
    let guards = Guards { horizon: 0.05, manipulable: &[(two.right, 1.01 * w)] };
    let guard = LwGuard { least: 1.01 * w, part: RIGHT };
    let mut control = RateControl::new(&two.robot, 3, 1);
    // SAFETY: as above.
    unsafe {
        let r = two.r;
        let (mut c, mut none) = (null_mut(), null_mut());
        assert_eq!(lw_rate_control_new(r, 3, 1, &mut c), LwStatus::Ok);
        let (mut v, mut wanted) = ([0.0; 13], still);
        let (mut left, mut theirs) = ([0.0; 3], [0.0; 3]);
        let (p, l, x) = (v.as_mut_ptr(), left.as_mut_ptr(), objectives.as_ptr());
        quiet(|| lw_rate_control_solve(r, c, x, 3, 0.05, &guard, 1, p, 13, l, 3));
        control.solve(&mut two.robot, &rust, &guards, &mut wanted, &mut theirs).unwrap();
        same(&v, &wanted);
        same(&left, &theirs);
        // Solve with fewer tasks, no limits, and no optional outputs.
        quiet(|| lw_rate_control_solve(r, c, x, 2, 0.05, null(), 0, p, 13, null_mut(), 0));
        let free = Guards { horizon: 0.05, manipulable: &[] };
        control.solve(&mut two.robot, &rust[..2], &free, &mut wanted, &mut theirs).unwrap();
        same(&v, &wanted);
        let kept = v;
        let ask = |w: &[LwObjective], horizon, g: &[LwGuard], n, levels| {
            let (g, count) = (g.as_ptr(), g.len());
            lw_rate_control_solve(r, c, w.as_ptr(), w.len(), horizon, g, count, p, n, l, levels)
        };
        let with = |w: LwObjective| ask(&[w], 0.05, &[], 13, 1);
        two.refused(ask(&objectives, 0.05, &[guard], 13, 2), LwStatus::Length, "`residuals`");
        two.refused(ask(&objectives, 0.05, &[guard], 12, 3), LwStatus::Length, "`v`");
        two.refused(ask(&objectives, 0.0, &[guard], 13, 3), LwStatus::OutOfRange, "horizon");
        two.refused(ask(&objectives, f64::NAN, &[guard], 13, 3), LwStatus::NotFinite, "horizon");
        two.refused(ask(&[NO_OBJECTIVE; 4], 0.05, &[], 13, 1), LwStatus::NoRoom, "4 objectives");
        two.refused(ask(&objectives, 0.05, &[guard; 2], 13, 3), LwStatus::NoRoom, "2 guards");
        let lost = LwGuard { least: f64::NAN, ..guard };
        two.refused(ask(&objectives, 0.05, &[lost], 13, 3), LwStatus::NotFinite, "`least`");
        let lost = LwGuard { part: 9, ..guard };
        two.refused(ask(&objectives, 0.05, &[lost], 13, 3), LwStatus::Foreign, "");
        two.refused(
            with(LwObjective { kind: 3, ..NO_OBJECTIVE }),
            LwStatus::OutOfRange,
            "LW_OBJECTIVE_",
        );
        two.refused(
            with(LwObjective { rows: 3, ..NO_OBJECTIVE }),
            LwStatus::OutOfRange,
            "LW_ROWS_",
        );
        two.refused(with(LwObjective { part: 3, ..NO_OBJECTIVE }), LwStatus::Foreign, "");
        two.refused(
            with(LwObjective { weight: 0.0, ..NO_OBJECTIVE }),
            LwStatus::OutOfRange,
            "weight",
        );
        two.refused(
            with(LwObjective { length: 0.0, ..NO_OBJECTIVE }),
            LwStatus::OutOfRange,
            "length",
        );
        two.refused(
            with(LwObjective { motion: [f64::NAN; 6], ..NO_OBJECTIVE }),
            LwStatus::NotFinite,
            "`motion`",
        );
        let posture =
            |posture, posture_count| LwObjective { posture, posture_count, ..objectives[0] };
        two.refused(with(posture(V.as_ptr(), 12)), LwStatus::Length, "`posture`");
        two.refused(with(posture(p, 13)), LwStatus::Overlap, "`posture` and `v`");
        let over = lw_rate_control_solve(r, c, x, 3, 0.05, &guard, 1, p, 13, p.add(12), 3);
        two.refused(over, LwStatus::Overlap, "`v` and `residuals`");
        two.refused(
            lw_rate_control_new(r, usize::MAX, 1, &mut none),
            LwStatus::OutOfRange,
            "`objectives`",
        );
        two.refused(
            lw_rate_control_new(r, 1, usize::MAX, &mut none),
            LwStatus::OutOfRange,
            "`guards`",
        );
        all_null(&[
            lw_rate_control_new(r, 1, 1, null_mut()),
            lw_rate_control_new(null_mut(), 1, 1, &mut none),
            with(posture(null(), 13)),
            lw_rate_control_solve(r, null_mut(), x, 3, 0.05, &guard, 1, p, 13, l, 3),
            lw_rate_control_solve(r, c, null(), 3, 0.05, &guard, 1, p, 13, l, 3),
            lw_rate_control_solve(r, c, x, 3, 0.05, null(), 1, p, 13, l, 3),
            lw_rate_control_solve(r, c, x, 3, 0.05, &guard, 1, null_mut(), 13, l, 3),
            lw_rate_control_solve(r, c, x, 3, 0.05, &guard, 1, p, 13, null_mut(), 3),
            lw_rate_control_solve(null_mut(), c, x, 3, 0.05, &guard, 1, p, 13, l, 3),
        ]);
        assert_eq!(v, kept, "nothing was written");
        // The coordinate is so far outside of its limits that its rate cannot bring it back.
        let mut far = Q;
        far[3] = 9.0;
        two.go(&far);
        quiet(|| lw_rate_control_solve(r, c, x, 2, 0.05, null(), 0, p, 13, null_mut(), 0));
        assert!(v[3] < -1.9, "it comes back as fast as it may: {}", v[3]);
        lw_rate_control_free(c);
        lw_rate_control_free(null_mut());
    }
}

#[test]
fn forces_for_wishes_with_contacts() {
    let mut two = Two::new();
    let touch = Touch {
        part: two.right,
        at: Vec3::new(0.05, 0.0, 0.01),
        normal: Vec3::z(),
        friction: 0.6,
        most: 200.0,
    };
    let (at, normal) = ([0.05, 0.0, 0.01], [0.0, 0.0, 1.0]);
    let in_c = LwTouch { at, normal, friction: 0.6, most: 200.0, part: RIGHT };
    let effort = [80.0; 13];
    let motion = six(&TWIST);
    let rust = [
        Objective::new(0, Aim::Tip { part: two.left, motion, rows: Rows::Linear }),
        Objective::new(1, Aim::Posture(&VDOT)),
    ];
    let objectives = [
        LwObjective { motion: TWIST, rows: LW_ROWS_LINEAR, ..NO_OBJECTIVE },
        LwObjective {
            kind: LW_OBJECTIVE_POSTURE,
            level: 1,
            posture: VDOT.as_ptr(),
            posture_count: 13,
            ..NO_OBJECTIVE
        },
    ];
    let mut whole = WholeBody::new(&two.robot, 1, 2);
    // SAFETY: as above.
    unsafe {
        let r = two.r;
        let (mut b, mut none) = (null_mut(), null_mut());
        let mut told = std::mem::zeroed::<LwBalanced>();
        assert_eq!(lw_whole_body_new(r, 1, 2, &mut b), LwStatus::Ok);
        let (mut tau, mut vdot, mut f) = ([0.0; 13], [0.0; 13], [0.0; 3]);
        let (t, a, p, o) = (tau.as_mut_ptr(), vdot.as_mut_ptr(), f.as_mut_ptr(), &raw mut told);
        let (v, e, w) = (V.as_ptr(), effort.as_ptr(), objectives.as_ptr());
        quiet(|| lw_whole_body_solve(r, b, v, e, 13, &in_c, 1, w, 2, t, a, p, o));
        let (mut wanted, mut moves, mut pressed) = ([0.0; 13], [0.0; 13], [Vec3::zeros()]);
        let out = (&mut wanted[..], &mut moves[..], &mut pressed[..]);
        let rust = whole.solve(&mut two.robot, &V, &[touch], &rust, &effort, out).unwrap();
        same(&tau, &wanted);
        same(&vdot, &moves);
        same(&f, pressed[0].as_slice());
        let all = [told.unbalanced, told.slipping, told.shortfall];
        assert_eq!(bits(&all), bits(&[rust.unbalanced, rust.slipping, rust.shortfall]));
        let kept = (tau, vdot, f);
        let ask = |touches: &[LwTouch], e: &[f64]| {
            let (x, count) = (touches.as_ptr(), touches.len());
            lw_whole_body_solve(r, b, v, e.as_ptr(), e.len(), x, count, w, 2, t, a, p, o)
        };
        let with = |touch: LwTouch| ask(&[touch], &effort);
        two.refused(ask(&[in_c; 2], &effort), LwStatus::NoRoom, "2 touches");
        two.refused(ask(&[in_c], &effort[1..]), LwStatus::Length, "`v`");
        two.refused(ask(&[in_c], &[-1.0; 13]), LwStatus::OutOfRange, "effort");
        two.refused(ask(&[in_c], &[f64::NAN; 13]), LwStatus::OutOfRange, "effort");
        two.refused(
            with(LwTouch { normal: [0.0, 0.0, 2.0], ..in_c }),
            LwStatus::OutOfRange,
            "normal",
        );
        two.refused(with(LwTouch { at: [f64::NAN; 3], ..in_c }), LwStatus::NotFinite, "`at`");
        two.refused(with(LwTouch { friction: 0.0, ..in_c }), LwStatus::OutOfRange, "friction");
        two.refused(with(LwTouch { most: 0.0, ..in_c }), LwStatus::OutOfRange, "largest force");
        two.refused(with(LwTouch { part: 5, ..in_c }), LwStatus::Foreign, "");
        let over = lw_whole_body_solve(r, b, v, e, 13, &in_c, 1, w, 2, t, t, p, o);
        two.refused(over, LwStatus::Overlap, "`tau` and `vdot`");
        let over = lw_whole_body_solve(r, b, v, e, 13, &in_c, 1, w, 2, t, a, e.cast_mut(), o);
        two.refused(over, LwStatus::Overlap, "`effort` and `forces`");
        two.refused(
            lw_whole_body_new(r, usize::MAX, 1, &mut none),
            LwStatus::OutOfRange,
            "`touches`",
        );
        let n = null_mut();
        all_null(&[
            lw_whole_body_new(r, 1, 1, null_mut()),
            lw_whole_body_new(null_mut(), 1, 1, &mut none),
            lw_whole_body_solve(r, null_mut(), v, e, 13, &in_c, 1, w, 2, t, a, p, o),
            lw_whole_body_solve(r, b, null(), e, 13, &in_c, 1, w, 2, t, a, p, o),
            lw_whole_body_solve(r, b, v, null(), 13, &in_c, 1, w, 2, t, a, p, o),
            lw_whole_body_solve(r, b, v, e, 13, null(), 1, w, 2, t, a, p, o),
            lw_whole_body_solve(r, b, v, e, 13, &in_c, 1, null(), 2, t, a, p, o),
            lw_whole_body_solve(r, b, v, e, 13, &in_c, 1, w, 2, n, a, p, o),
            lw_whole_body_solve(r, b, v, e, 13, &in_c, 1, w, 2, t, n, p, o),
            lw_whole_body_solve(r, b, v, e, 13, &in_c, 1, w, 2, t, a, n, o),
            lw_whole_body_solve(r, b, v, e, 13, &in_c, 1, w, 2, t, a, p, null_mut()),
            lw_whole_body_solve(null_mut(), b, v, e, 13, &in_c, 1, w, 2, t, a, p, o),
        ]);
        assert_eq!((tau, vdot, f), kept, "nothing was written");
        lw_whole_body_free(b);
        lw_whole_body_free(null_mut());
    }
}

#[test]
fn feet_and_the_centre_of_mass() {
    let points: [[f64; 2]; 6] =
        [[0.1, 0.2], [1.0, -0.3], [0.4, 0.3], [0.9, 1.1], [f64::NAN, 0.0], [-0.2, 0.8]];
    let (mut rust, mut corners) = (points, [[9.0; 2]; 7]);
    let wanted = support_polygon(&mut rust, &mut corners);
    assert!(wanted == 4);
    let (mut mine, mut hull, mut count, mut margin) = (points, [[0.0; 2]; 7], 9, 9.0);
    let (a, b) = (mine.as_mut_ptr().cast::<f64>(), hull.as_mut_ptr().cast::<f64>());
    // SAFETY: as above.
    unsafe {
        quiet(|| lw_support_polygon(a, 6, b, 7, &mut count));
        assert_eq!(count, wanted);
        same(&hull[..count].concat(), &corners[..wanted].concat());
        for p in [[0.4, 0.4], [2.0, 0.1]] {
            quiet(|| lw_support_margin(b, count, p.as_ptr(), &mut margin));
            same(&[margin], &[support_margin(&corners[..wanted], p)]);
        }
        assert!(margin < -0.9);
        let (c, m, p) = (&raw mut count, &raw mut margin, [0.0, 0.0]);
        let p = p.as_ptr();
        assert_eq!(lw_support_polygon(a, 6, b, 6, c), LwStatus::NoRoom);
        assert_eq!(lw_support_polygon(a, 6, a.add(11), 7, c), LwStatus::Overlap);
        assert_eq!(lw_support_margin(b, 4, [f64::NAN; 2].as_ptr(), m), LwStatus::NotFinite);
        quiet(|| lw_support_margin(null(), 0, p, m));
        assert_eq!(*m, f64::NEG_INFINITY);
        all_null(&[
            lw_support_polygon(null_mut(), 6, b, 7, c),
            lw_support_polygon(a, 6, null_mut(), 7, c),
            lw_support_polygon(a, 6, b, 7, null_mut()),
            lw_support_margin(null(), 4, p, m),
            lw_support_margin(b, 4, null(), m),
            lw_support_margin(b, 4, p, null_mut()),
        ]);
    }
}
