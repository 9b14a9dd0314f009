//! Collision-free paths, their timing, transfers, distances and shapes through the C interface: results bit-identical with Rust, errors as codes.
//! Calls allocate only where the documentation says so.

use crate::support::*;
use linkwork_embedded::*;
use linkwork_robot::*;
use std::ptr::{null, null_mut};

/// The left arm on the other side of the post.
fn far() -> [f64; 13] {
    let mut q = Q;
    q[1] = -0.6;
    q
}

fn path(p: &LwPath) -> (LwPathOutcome, u64, LwPair) {
    (p.outcome, p.at.to_bits(), p.pair)
}

#[test]
fn paths_are_swept() {
    let mut two = Two::new();
    let goal = far();
    // SAFETY: valid handles of the library, arrays of the lengths given; the same applies in all
    // tests below.
    unsafe {
        let r = two.r;
        let mut told = std::mem::zeroed::<LwPath>();
        let (a, o) = (Q.as_ptr(), &raw mut told);
        let (mut outcomes, mut most) = (Vec::new(), 0);
        let near: [f64; 13] = std::array::from_fn(|k| Q[k] + if k == 12 { 0.2 } else { 0.0 });
        // Find the end of a path whose long pieces cannot be proven free.
        let mut undecided = |q: &[f64; 13]| {
            matches!(two.robot.path_free(&Q, q, 0.9).unwrap(), Path::Undecided { .. })
        };
        let mut toward = (1..60).map(|k| {
            let mut q = Q;
            q[1] -= 0.01 * k as f64;
            q
        });
        let hair = toward.find(|q| undecided(q)).unwrap();
        for (q, least) in [(goal, 1e-3), (near, 1e-3), (hair, 0.9), (hair, 1e-3)] {
            settled(|| lw_robot_path_free(r, a, q.as_ptr(), 13, least, usize::MAX, o));
            let rust = two.robot.path_free(&Q, &q, least).unwrap();
            assert_eq!(path(&told), path(&Some(rust).into()));
            outcomes.push(told.outcome);
            // Check the path in portions of one piece.
            let whole = told;
            quiet(|| lw_robot_path_free(r, a, q.as_ptr(), 13, least, 1, o));
            let mut portions = 1;
            loop {
                if told.outcome != LwPathOutcome::Unfinished {
                    break;
                }
                quiet(|| lw_robot_path_free_on(r, 1, o));
                portions += 1;
            }
            assert_eq!(path(&told), path(&whole));
            most = most.max(portions);
        }
        use LwPathOutcome::{Free, Hit, Undecided};
        assert_eq!(outcomes, [Hit, Free, Undecided, Free]);
        assert!(most > 1, "{most}");
        two.refused(lw_robot_path_free_on(r, 1, o), LwStatus::NoSearch, "lw_robot_path_free");
        let ask = |b: *const f64, n, least, o| lw_robot_path_free(r, a, b, n, least, usize::MAX, o);
        let nan = [f64::NAN; 13];
        two.refused(ask(a, 12, 1e-3, o), LwStatus::Length, "`qa`");
        two.refused(ask(a, 13, 0.0, o), LwStatus::OutOfRange, "least");
        two.refused(ask(nan.as_ptr(), 13, 1e-3, o), LwStatus::NotFinite, "`qb`");
        all_null(&[
            ask(null(), 13, 1e-3, o),
            ask(a, 13, 1e-3, null_mut()),
            lw_robot_path_free(r, null(), a, 13, 1e-3, 1, o),
            lw_robot_path_free(null_mut(), a, a, 13, 1e-3, 1, o),
            lw_robot_path_free_on(r, 1, null_mut()),
            lw_robot_path_free_on(null_mut(), 1, o),
        ]);
    }
}

#[test]
fn ways_and_their_times() {
    let mut two = Two::new();
    let goal = far();
    let mut planner = Planner::new(&two.robot, two.left, 400).unwrap();
    let search = Search { seed: 7, step: 0.4, least: 1e-2 };
    let how = LwSearch { seed: 7, step: 0.4, least: 1e-2 };
    // SAFETY: as above.
    unsafe {
        let r = two.r;
        let (mut p, mut none) = (null_mut(), null_mut());
        assert_eq!(lw_planner_new(r, LEFT, 400, &mut p), LwStatus::Ok);
        let mut told = std::mem::zeroed::<LwPlan>();
        let (a, b, o) = (Q.as_ptr(), goal.as_ptr(), &raw mut told);
        settled(|| lw_planner_plan(r, p, a, b, 13, &how, usize::MAX, o));
        assert_eq!(planner.plan(&mut two.robot, &Q, &goal, &search).unwrap(), PlanOutcome::Found);
        assert_eq!((told.outcome, told.rows), (LwPlanOutcome::Found, planner.path().len()));
        assert!(told.rows > 2, "not straight on");
        let wanted: Vec<f64> = planner.path().flatten().copied().collect();
        let mut way = vec![0.0; 13 * told.rows];
        quiet(|| lw_planner_path(r, p, way.as_mut_ptr(), 13 * told.rows));
        same(&way, &wanted);
        // Plan in portions, and with the default settings.
        quiet(|| lw_planner_plan(r, p, a, b, 13, &how, 0, o));
        assert_eq!((told.outcome, told.rows), (LwPlanOutcome::Unfinished, 0));
        loop {
            if told.outcome != LwPlanOutcome::Unfinished {
                break;
            }
            quiet(|| lw_planner_resume(r, p, 1, o));
        }
        quiet(|| lw_planner_path(r, p, way.as_mut_ptr(), 13 * told.rows));
        same(&way, &wanted);
        settled(|| lw_planner_plan(r, p, a, b, 13, null(), usize::MAX, o));
        let default = planner.plan(&mut two.robot, &Q, &goal, &Search::default()).unwrap();
        assert_eq!((default, told.rows), (PlanOutcome::Found, planner.path().len()));
        let n = 13 * told.rows;
        let mut other = vec![0.0; n];
        quiet(|| lw_planner_path(r, p, other.as_mut_ptr(), n));
        same(&other, &planner.path().flatten().copied().collect::<Vec<_>>());
        // At one end, the arm is in the post.
        let mut blocked = Q;
        two.robot.set_q(&Q).unwrap();
        let PlanOutcome::BlockedGoal { pair } = (0..60)
            .map(|k| {
                blocked[1] = Q[1] - 0.02 * k as f64;
                planner.plan(&mut two.robot, &Q, &blocked, &search).unwrap()
            })
            .find(|w| matches!(w, PlanOutcome::BlockedGoal { .. }))
            .unwrap()
        else {
            unreachable!()
        };
        settled(|| lw_planner_plan(r, p, a, blocked.as_ptr(), 13, &how, usize::MAX, o));
        assert_eq!((told.outcome, told.pair), (LwPlanOutcome::BlockedGoal, pair.into()));
        settled(|| lw_planner_plan(r, p, blocked.as_ptr(), a, 13, &how, usize::MAX, o));
        assert_eq!((told.outcome, told.pair), (LwPlanOutcome::BlockedStart, pair.into()));

        let ask = |b: &[f64], how: *const LwSearch, o| {
            lw_planner_plan(r, p, a, b.as_ptr(), b.len(), how, 9, o)
        };
        two.refused(ask(&goal[1..], &how, o), LwStatus::Length, "`start`");
        two.refused(ask(&[f64::NAN; 13], &how, o), LwStatus::NotFinite, "`goal`");
        two.refused(ask(&[0.0; 13], &how, o), LwStatus::OutOfRange, "does not belong to the part");
        let mut beyond = goal;
        beyond[1] = 3.0;
        two.refused(ask(&beyond, &how, o), LwStatus::OutsideLimits, "coordinate 1");
        two.refused(ask(&goal, &LwSearch { step: 0.0, ..how }, o), LwStatus::OutOfRange, "step");
        let w = way.as_mut_ptr();
        two.refused(lw_planner_path(r, p, w, 13), LwStatus::Length, "`path`");
        two.refused(lw_planner_new(r, LEFT, 1, &mut none), LwStatus::OutOfRange, "room");
        two.refused(
            lw_planner_new(r, LEFT, usize::MAX, &mut none),
            LwStatus::OutOfRange,
            "1048576",
        );
        two.refused(lw_planner_new(r, 9, 10, &mut none), LwStatus::Foreign, "");
        all_null(&[
            lw_planner_new(r, LEFT, 10, null_mut()),
            lw_planner_new(null_mut(), LEFT, 10, &mut none),
            lw_planner_plan(r, null_mut(), a, b, 13, &how, 9, o),
            lw_planner_plan(r, p, null(), b, 13, &how, 9, o),
            lw_planner_plan(r, p, a, null(), 13, &how, 9, o),
            ask(&goal, &how, null_mut()),
            lw_planner_resume(r, null_mut(), 1, o),
            lw_planner_resume(r, p, 1, null_mut()),
            lw_planner_resume(null_mut(), p, 1, o),
            lw_planner_path(r, null_mut(), w, 13),
            lw_planner_path(null_mut(), p, w, 13),
        ]);
        lw_planner_free(p);
        lw_planner_free(null_mut());
        timed(&mut two, &wanted);
    }
}

/// Checks the timing of a path.
unsafe fn timed(two: &mut Two, way: &[f64]) {
    let (rows, n) = (way.len() / 13, way.len());
    let mut timing = Timing::new(&two.robot, rows, 40 * rows).unwrap();
    let own = MotionLimits::of(&two.model).acceleration(3.0);
    let bent = [3.0; 13];
    let limits = LwMotionLimits {
        rate: null(),
        acceleration: bent.as_ptr(),
        jerk: null(),
        effort: null(),
        n: 13,
    };
    // SAFETY: as above.
    unsafe {
        let r = two.r;
        let (mut t, mut none) = (null_mut(), null_mut());
        assert_eq!(lw_timing_new(r, rows, 40 * rows, &mut t), LwStatus::Ok);
        let (mut told, mut path_told) =
            (std::mem::zeroed::<LwTimed>(), std::mem::zeroed::<LwPath>());
        let (mut q, mut v, mut vdot) = ([0.0; 13], [0.0; 13], [0.0; 13]);
        let (a, b, c) = (q.as_mut_ptr(), v.as_mut_ptr(), vdot.as_mut_ptr());
        let (w, o, l) = (way.as_ptr(), &raw mut told, &raw const limits);
        let early = lw_timing_at(r, t, 0.1, a, 13, b, c, 13);
        two.refused(early, LwStatus::NoSearch, "lw_timing_plan");
        for round in [0.0, 0.02] {
            quiet(|| lw_timing_plan(r, t, w, n, l, round, o));
            let rust = timing.plan(&mut two.robot, way, &own, round).unwrap();
            let Timed::Found { duration } = rust else { panic!("{rust:?}") };
            assert!(told.found);
            same(&[told.duration], &[duration]);
            let (mut x, mut y, mut z) = ([0.0; 13], [0.0; 13], [0.0; 13]);
            for k in 1..10 {
                let time = 0.1 * k as f64 * duration;
                quiet(|| lw_timing_at(r, t, time, a, 13, b, c, 13));
                timing.at(time, &mut x, &mut y, &mut z).unwrap();
                same(&q, &x);
                same(&v, &y);
                same(&vdot, &z);
            }
            quiet(|| lw_timing_place(r, t, 0.37, a, 13));
            timing.place(0.37, &mut x).unwrap();
            same(&q, &x);
            settled(|| lw_timing_path_free(r, t, 1e-2, &mut path_told));
            let rust = timing.free(&mut two.robot, 1e-2).unwrap();
            assert_eq!(path(&path_told), path(&Some(rust).into()));
            assert_ne!(path_told.outcome, LwPathOutcome::Unfinished);
        }
        // Effort limits that cannot support the arms give a result.
        let weak = [1.0; 13];
        let none_hold = LwMotionLimits { effort: weak.as_ptr(), ..limits };
        quiet(|| lw_timing_plan(r, t, w, n, &none_hold, 0.0, o));
        let mut weaker = own.clone();
        weaker.effort.fill(1.0);
        let rust = timing.plan(&mut two.robot, way, &weaker, 0.0).unwrap();
        let Timed::Infeasible { part, share } = rust else { panic!("{rust:?}") };
        assert!(!told.found && told.duration == 0.0);
        assert_eq!(bits(&[told.part, told.share]), bits(&[part, share]));
        // Use only the limits of the model.
        quiet(|| lw_timing_plan(r, t, w, n, null(), 0.0, o));
        let rust = timing.plan(&mut two.robot, way, &MotionLimits::of(&two.model), 0.0).unwrap();
        assert_eq!(rust, Timed::Found { duration: told.duration });

        let kept = (q, v, vdot);
        let ask = |n, l, round, o| lw_timing_plan(r, t, w, n, l, round, o);
        two.refused(ask(n - 1, l, 0.0, o), LwStatus::Length, "`path`");
        two.refused(ask(0, l, 0.0, o), LwStatus::Length, "`path`");
        two.refused(ask(n, l, -1.0, o), LwStatus::OutOfRange, "round");
        two.refused(
            ask(n, &LwMotionLimits { n: 12, ..limits }, 0.0, o),
            LwStatus::Length,
            "`acceleration`",
        );
        let zero = [0.0; 13];
        let lost = LwMotionLimits { rate: zero.as_ptr(), ..limits };
        two.refused(ask(n, &lost, 0.0, o), LwStatus::OutOfRange, "rate");
        two.refused(lw_timing_at(r, t, f64::NAN, a, 13, b, c, 13), LwStatus::NotFinite, "time");
        two.refused(lw_timing_at(r, t, 0.1, a, 13, b, c, 12), LwStatus::Length, "`v`");
        two.refused(lw_timing_at(r, t, 0.1, a, 13, b, b, 13), LwStatus::Overlap, "`v` and `vdot`");
        two.refused(lw_timing_place(r, t, 0.5, a, 12), LwStatus::Length, "`q`");
        two.refused(lw_timing_path_free(r, t, 0.0, &mut path_told), LwStatus::OutOfRange, "least");
        two.refused(lw_timing_new(r, 1, 99, &mut none), LwStatus::OutOfRange, "configurations");
        two.refused(lw_timing_new(r, 2, usize::MAX, &mut none), LwStatus::OutOfRange, "`sections`");
        let x = null_mut();
        all_null(&[
            lw_timing_new(r, 2, 99, null_mut()),
            lw_timing_new(null_mut(), 2, 99, &mut none),
            lw_timing_plan(r, null_mut(), w, n, l, 0.0, o),
            lw_timing_plan(r, t, null(), n, l, 0.0, o),
            ask(n, l, 0.0, null_mut()),
            lw_timing_at(r, null_mut(), 0.1, a, 13, b, c, 13),
            lw_timing_at(r, t, 0.1, x, 13, b, c, 13),
            lw_timing_at(r, t, 0.1, a, 13, x, c, 13),
            lw_timing_at(r, t, 0.1, a, 13, b, x, 13),
            lw_timing_place(r, t, 0.5, x, 13),
            lw_timing_place(r, null_mut(), 0.5, a, 13),
            lw_timing_path_free(r, t, 1e-2, null_mut()),
            lw_timing_path_free(r, null_mut(), 1e-2, &mut path_told),
        ]);
        assert_eq!((q, v, vdot), kept, "nothing was written");
        lw_timing_free(t);
        lw_timing_free(null_mut());
    }
}

#[test]
fn transfers_within_limits_of_jerk() {
    let two = Two::new();
    let mut transfer = Transfer::new(&two.robot);
    let own = MotionLimits::of(&two.model).acceleration(4.0).jerk(30.0);
    let (bent, sudden, rest) = ([4.0; 13], [30.0; 13], [0.0; 13]);
    let limits = LwMotionLimits {
        rate: null(),
        acceleration: bent.as_ptr(),
        jerk: sudden.as_ptr(),
        effort: null(),
        n: 13,
    };
    let goal = far();
    let state = |q: &[f64], v: *const f64, vdot: *const f64| LwMotionState {
        q: q.as_ptr(),
        nq: q.len(),
        v,
        vdot,
        nv: 13,
    };
    let from = state(&Q, V.as_ptr(), VDOT.as_ptr());
    let to = state(&goal, null(), null());
    // SAFETY: as above.
    unsafe {
        let r = two.r;
        let (mut t, mut none) = (null_mut(), null_mut());
        assert_eq!(lw_transfer_new(r, &mut t), LwStatus::Ok);
        let mut told = std::mem::zeroed::<LwTransferred>();
        let (mut q, mut v, mut vdot) = ([0.0; 13], [0.0; 13], [0.0; 13]);
        let (a, b, c) = (q.as_mut_ptr(), v.as_mut_ptr(), vdot.as_mut_ptr());
        let (l, o) = (&raw const limits, &raw mut told);
        let early = lw_transfer_at(r, t, 0.1, a, 13, b, c, 13);
        two.refused(early, LwStatus::NoSearch, "lw_transfer_plan");
        quiet(|| lw_transfer_plan(r, t, &from, &to, l, o));
        let begin = MotionState { q: &Q, v: &V, vdot: &VDOT };
        let end = MotionState { q: &goal, v: &rest, vdot: &rest };
        let rust = transfer.plan(&begin, &end, &own).unwrap();
        assert_eq!(rust, Transferred::Found { duration: told.duration });
        assert!(told.within_limits && told.duration > 0.5);
        let (mut x, mut y, mut z) = ([0.0; 13], [0.0; 13], [0.0; 13]);
        for k in 0..11 {
            let time = 0.1 * k as f64 * told.duration;
            quiet(|| lw_transfer_at(r, t, time, a, 13, b, c, 13));
            transfer.at(time, &mut x, &mut y, &mut z).unwrap();
            same(&q, &x);
            assert_eq!((bits(&v), bits(&vdot)), (bits(&y), bits(&z)));
            assert!(k == 10 || y.iter().any(|x| *x != 0.0));
        }
        // The coordinate is too fast to stay within its limits.
        let (mut edge, mut fast) = (Q, rest);
        (edge[4], fast[4]) = (2.55, 1.9);
        quiet(|| lw_transfer_plan(r, t, &state(&edge, fast.as_ptr(), null()), &to, l, o));
        let begin = MotionState { q: &edge, v: &fast, vdot: &rest };
        let rust = transfer.plan(&begin, &end, &own).unwrap();
        let Transferred::LeavesLimits { dof, value, duration } = rust else { panic!("{rust:?}") };
        assert_eq!((told.dof, told.within_limits), (dof, false));
        same(&[told.value, told.duration], &[value, duration]);

        let kept = (q, v, vdot);
        let ask = |from: LwMotionState, l| lw_transfer_plan(r, t, &from, &to, l, o);
        two.refused(ask(state(&Q[1..], null(), null()), l), LwStatus::Length, "`q`");
        two.refused(ask(LwMotionState { nv: 12, ..from }, l), LwStatus::Length, "`v`");
        two.refused(ask(state(&[f64::NAN; 13], null(), null()), l), LwStatus::NotFinite, "`q`");
        // The model does not have limits of acceleration and jerk.
        two.refused(ask(from, null()), LwStatus::OutOfRange, "of a moving coordinate");
        let zero = LwMotionLimits { jerk: rest.as_ptr(), ..limits };
        two.refused(ask(from, &zero), LwStatus::OutOfRange, "jerk");
        // Limits of the previous call are not kept.
        let smooth = LwMotionLimits { jerk: null(), ..limits };
        two.refused(ask(from, &smooth), LwStatus::OutOfRange, "jerk limit of a moving coordinate");
        let at = |time, n| lw_transfer_at(r, t, time, a, 13, b, c, n);
        two.refused(at(f64::INFINITY, 13), LwStatus::NotFinite, "time");
        two.refused(at(0.1, 12), LwStatus::Length, "`v`");
        let over = lw_transfer_at(r, t, 0.1, a, 13, b, a, 13);
        two.refused(over, LwStatus::Overlap, "`q` and `vdot`");
        let x = null_mut();
        all_null(&[
            lw_transfer_new(r, null_mut()),
            lw_transfer_new(null_mut(), &mut none),
            lw_transfer_plan(r, null_mut(), &from, &to, l, o),
            lw_transfer_plan(r, t, null(), &to, l, o),
            lw_transfer_plan(r, t, &from, null(), l, o),
            lw_transfer_plan(r, t, &from, &to, l, null_mut()),
            ask(LwMotionState { q: null(), ..from }, l),
            lw_transfer_at(r, null_mut(), 0.1, a, 13, b, c, 13),
            lw_transfer_at(r, t, 0.1, x, 13, b, c, 13),
            lw_transfer_at(r, t, 0.1, a, 13, x, c, 13),
            lw_transfer_at(r, t, 0.1, a, 13, b, x, 13),
        ]);
        assert_eq!((q, v, vdot), kept, "nothing was written");
        lw_transfer_free(t);
        lw_transfer_free(null_mut());
    }
}

/// Returns a Rust distance in its C form.
fn near(c: &Closest) -> LwClosest {
    LwClosest {
        distance: c.distance.distance,
        point_a: c.distance.point_a.into(),
        point_b: c.distance.point_b.into(),
        a: c.a.index() as u32,
        b: c.b.index() as u32,
        found: true,
    }
}

#[test]
fn distances_and_shapes() {
    let mut two = Two::new();
    let id = |name: &str| two.model.collider(name).unwrap();
    let [palm, other, post, map] = ["left_palm", "right_palm", "post", "map"].map(id);
    let place = |id: ColliderId| id.index() as u32;
    // SAFETY: as above.
    unsafe {
        let r = two.r;
        let none = std::mem::zeroed::<LwClosest>();
        let (mut all, mut count, mut one) = (vec![none; 40], 99, none);
        let (x, o, n) = (all.as_mut_ptr(), &raw mut one, &raw mut count);
        let (mut pairs, mut rust, mut hits) = (vec![LwPair { a: 9, b: 9 }; 40], vec![], vec![]);
        let p = pairs.as_mut_ptr();
        let mut seen = Vec::new();
        // The arm hits the post in the second configuration. Distances of coarse shapes are
        // smaller.
        let mut beside = Q;
        beside[1] = -0.2;
        for (code, detail) in [(LW_DETAIL_FINE, Detail::Fine), (LW_DETAIL_COARSE, Detail::Coarse)] {
            quiet(|| lw_robot_set_detail(r, code));
            two.robot.set_detail(detail);
            for q in [Q, beside] {
                let a = q.as_ptr();
                assert_eq!(lw_robot_distances(r, a, 13, 0.6, x, 40, n), LwStatus::Ok);
                two.robot.distances(&q, 0.6, &mut rust).unwrap();
                assert!(count > 2 && count == rust.len(), "{count}");
                rust.iter().zip(&all).for_each(|(rust, c)| assert_eq!(near(rust), *c));
                assert_eq!(lw_robot_distance(r, a, 13, place(palm), place(other), o), LwStatus::Ok);
                let d = two.robot.distance(&q, palm, other).unwrap().unwrap();
                assert_eq!(one, near(&Closest { a: palm, b: other, distance: d }));
                seen.push(one.distance.to_bits());
                assert_eq!(lw_robot_hits(r, a, 13, p, 40, n), LwStatus::Ok);
                two.robot.hits(&q, &mut hits).unwrap();
                assert_eq!(count, hits.len());
                hits.iter().zip(&pairs).for_each(|(rust, c)| assert_eq!(LwPair::from(*rust), *c));
                // After the first call, further ones do not allocate.
                quiet(|| lw_robot_hits(r, a, 13, p, 40, n));
            }
        }
        assert!(!hits.is_empty(), "nothing touches");
        // An empty map has no distance; a hidden collider still has one.
        let to = |id| lw_robot_distance(r, Q.as_ptr(), 13, place(palm), place(id), o);
        assert_eq!((to(map), (*o).found), (LwStatus::Ok, false));
        assert_eq!(lw_robot_hide(r, place(post)), LwStatus::Ok);
        assert_eq!((to(post), (*o).found), (LwStatus::Ok, true));
        assert_eq!(lw_robot_show(r, place(post)), LwStatus::Ok);
        seen.sort_unstable();
        seen.dedup();
        assert_eq!(seen.len(), 4, "each shape counts");
        // If the memory is too small, the call returns the required size and writes nothing else.
        let (q, wanted) = (beside.as_ptr(), hits.len());
        let kept = pairs.clone();
        two.refused(lw_robot_hits(r, q, 13, p, wanted - 1, n), LwStatus::NoRoom, "pairs");
        assert_eq!((count, &pairs), (wanted, &kept));
        two.refused(lw_robot_distances(r, q, 13, 9.0, x, 1, n), LwStatus::NoRoom, "pairs");
        assert!(count > 2);
        let many = count;
        assert_eq!(lw_robot_distances(r, q, 13, 9.0, x, many, n), LwStatus::Ok);
        // Read the checked pairs, and the setting of the pair of post and hand.
        let mut looks = false;
        quiet(|| lw_robot_looks_at(r, place(palm), place(post), &mut looks));
        assert_eq!(looks, two.robot.looks_at(palm, post).unwrap());
        assert!(looks);
        assert_eq!(lw_robot_allow(r, place(palm), place(post)), LwStatus::Ok);
        quiet(|| lw_robot_looks_at(r, place(palm), place(post), &mut looks));
        assert!(!looks);
        // Read and write a voxel map cell by cell.
        let (cells, mut full, mut number) = ([[1_u32, 2, 3], [0, 0, 1]], false, 9);
        assert_eq!(lw_robot_set_cells(r, place(map), cells.as_ptr().cast(), 2), LwStatus::Ok);
        quiet(|| lw_robot_cell(r, place(map), cells[0].as_ptr(), &mut full));
        quiet(|| lw_robot_count(r, place(map), &mut number));
        assert_eq!((full, number), (true, 2));
        quiet(|| lw_robot_cell(r, place(map), [3, 2, 1].as_ptr(), &mut full));
        assert!(!full);

        let m = place(map);
        let f = &raw mut full;
        two.refused(lw_robot_cell(r, m, [4, 0, 0].as_ptr(), f), LwStatus::OutOfRange, "");
        two.refused(lw_robot_cell(r, place(post), [0, 0, 0].as_ptr(), f), LwStatus::Foreign, "");
        two.refused(lw_robot_count(r, place(post), &mut number), LwStatus::Foreign, "");
        two.refused(lw_robot_set_detail(r, 2), LwStatus::OutOfRange, "LW_DETAIL_");
        two.refused(lw_robot_distance(r, q, 13, 0, 99, o), LwStatus::Foreign, "");
        two.refused(lw_robot_distance(r, q, 12, 0, 1, o), LwStatus::Length, "`q`");
        two.refused(
            lw_robot_distances(r, q, 13, f64::NAN, x, 40, n),
            LwStatus::OutOfRange,
            "limit",
        );
        two.refused(
            lw_robot_hits(r, [f64::NAN; 13].as_ptr(), 13, p, 40, n),
            LwStatus::NotFinite,
            "`q`",
        );
        all_null(&[
            lw_robot_distance(r, null(), 13, 0, 1, o),
            lw_robot_distance(r, q, 13, 0, 1, null_mut()),
            lw_robot_distances(r, null(), 13, 1.0, x, 40, n),
            lw_robot_distances(r, q, 13, 1.0, null_mut(), 40, n),
            lw_robot_distances(r, q, 13, 1.0, x, 40, null_mut()),
            lw_robot_hits(r, null(), 13, p, 40, n),
            lw_robot_hits(r, q, 13, null_mut(), 40, n),
            lw_robot_hits(r, q, 13, p, 40, null_mut()),
            lw_robot_set_detail(null_mut(), 0),
            lw_robot_looks_at(r, 0, 1, null_mut()),
            lw_robot_looks_at(null_mut(), 0, 1, f),
            lw_robot_cell(r, m, null(), f),
            lw_robot_cell(r, m, cells[0].as_ptr(), null_mut()),
            lw_robot_count(r, m, null_mut()),
            lw_robot_count(null_mut(), m, &mut number),
        ]);
    }
}

/// Errors of shapes with many points, when given or when the model is built.
#[test]
fn shapes_that_are_none_are_refused() {
    const BOX: LwShape = LwShape { kind: LW_SHAPE_BOX, size: [1.0; 3] };
    let (corners, world) = (CORNERS.as_ptr().cast::<f64>(), c"world".as_ptr());
    let name = c"shape".as_ptr();
    let triangles = TRIANGLES.as_ptr().cast::<u32>();
    let heights = [0.0; 4];
    let (z, square) = (heights.as_ptr(), [1.0, 1.0]);
    // SAFETY: as above.
    unsafe {
        let mut b = null_mut();
        assert_eq!(lw_builder_new(&mut b), LwStatus::Ok);
        let none = null::<LwPose>();
        let s = square.as_ptr();
        all_null(&[
            lw_builder_hull(b, null(), world, none, corners, 4),
            lw_builder_hull(b, name, null(), none, corners, 4),
            lw_builder_hull(b, name, world, none, null(), 4),
            lw_builder_hull(null_mut(), name, world, none, corners, 4),
            lw_builder_mesh(b, name, world, none, null(), 4, triangles, 4),
            lw_builder_mesh(b, name, world, none, corners, 4, null(), 4),
            lw_builder_mesh(null_mut(), name, world, none, corners, 4, triangles, 4),
            lw_builder_height_field(b, name, world, none, 2, 2, null(), z, 4),
            lw_builder_height_field(b, name, world, none, 2, 2, s, null(), 4),
            lw_builder_height_field(null_mut(), name, world, none, 2, 2, s, z, 4),
            lw_builder_coarse(b, null(), &BOX),
            lw_builder_coarse(b, name, null()),
            lw_builder_coarse(null_mut(), name, &BOX),
            lw_builder_coarse_hull(b, null(), corners, 4),
            lw_builder_coarse_hull(b, name, null(), 4),
            lw_builder_coarse_hull(null_mut(), name, corners, 4),
        ]);
        let field = lw_builder_height_field(b, name, world, none, 2, 3, s, z, 4);
        assert_eq!(field, LwStatus::Length);
        let field = lw_builder_height_field(b, name, world, none, usize::MAX, 3, s, z, 4);
        assert_eq!(field, LwStatus::Length);
        assert_eq!(lw_builder_coarse(b, name, &BOX), LwStatus::Unknown);
        let text = |b: *mut LwBuilder| {
            let mut text = [0; 2048];
            let told = lw_builder_message(b, text.as_mut_ptr(), text.len(), null_mut());
            assert_eq!(told, LwStatus::Ok);
            std::ffi::CStr::from_ptr(text.as_ptr()).to_str().unwrap().to_owned()
        };
        assert!(text(b).contains("no collider `shape`"), "{}", text(b));
        assert_eq!(lw_builder_coarse_hull(b, name, corners, 4), LwStatus::Unknown);
        lw_builder_free(b);
        // Building the model reports these mistakes.
        let (flat, wrong) = ([[0.0; 3]; 4], [[0_u32, 1, 9]]);
        for (k, needle) in
            ["lie in one plane", "refers to vertex 9, but there are 4", "at least 2 by 2"]
                .iter()
                .enumerate()
        {
            let (mut b, mut m) = (null_mut(), null_mut());
            assert_eq!(lw_builder_new(&mut b), LwStatus::Ok);
            let robot = c"<robot name='r'><link name='base'/></robot>".as_ptr();
            assert_eq!(lw_builder_robot_text(b, robot, 0, 0), LwStatus::Ok);
            let given = match k {
                0 => lw_builder_hull(b, name, world, none, flat.as_ptr().cast(), 4),
                1 => lw_builder_mesh(b, name, world, none, corners, 4, wrong.as_ptr().cast(), 1),
                _ => lw_builder_height_field(b, name, world, none, 4, 1, s, z, 4),
            };
            assert_eq!(given, LwStatus::Ok);
            assert_eq!(lw_builder_model(b, &mut m), LwStatus::Model);
            assert!(text(b).contains(needle), "{}", text(b));
            lw_builder_free(b);
        }
    }
}
