//! Inverse kinematics of mechanisms with closures: their own loops and couplings, and given closures, stay closed; infeasible goals are reported.

use crate::support::Rng;
use linkwork_dynamics::inverse_kinematics::{Closure, Place, Pointing, Progress};
use linkwork_dynamics::multibody::{
    BodySpec, Builder, ConstraintId, Coupling, Hinge, HingeCoordinate, Limits, LoopClosure,
    LoopMotion, Multibody,
};
use linkwork_dynamics::spatial::{MassProperties, Mat3, Motion, Pose, Quat, Vec3};
use linkwork_dynamics::units::{ConstraintMethod, Units, UnitsWork};
use linkwork_dynamics::*;
use std::f64::consts::PI;

const LINKS: [f64; 4] = [0.3, 0.8, 0.6, 0.7];

fn at(x: f64) -> Pose {
    Pose::translation(x, 0.0, 0.0)
}

fn mass() -> MassProperties {
    MassProperties::new(1.0, Vec3::zeros(), Mat3::identity() * 0.01)
}

/// Crank a, coupler b, follower c, ground d, closed by a loop of the mechanism; a point on the coupler.
fn four_bar([a, b, c, d]: [f64; 4], crank: Hinge) -> Multibody {
    let (mut m, pin) = (Builder::new(), || Hinge::pin(Vec3::z()));
    m.body(BodySpec::new("crank", "world").hinge(crank).mass(mass()));
    m.body(BodySpec::new("coupler", "crank").hinge_in_parent(at(a)).hinge(pin()).mass(mass()));
    m.body(BodySpec::new("follower", "world").hinge_in_parent(at(d)).hinge(pin()).mass(mass()));
    m.node("point", "coupler", Pose::translation(0.5 * b, 0.2, 0.0));
    m.loop_closure(closure("bar", ("coupler", at(b)), ("follower", at(c)), pin()));
    m.build().unwrap()
}

fn closure(name: &str, a: (&str, Pose), b: (&str, Pose), hinge: Hinge) -> LoopClosure {
    let [body_a, body_b] = [a.0, b.0].map(str::to_owned);
    LoopClosure { name: name.into(), body_a, frame_a: a.1, body_b, frame_b: b.1, hinge }
}

/// Returns the coupler's point on one branch (±1), from Freudenstein's closed form.
fn point([a, b, c, d]: [f64; 4], theta: f64, branch: f64) -> Vec3 {
    let e = Vec3::new(d - a * theta.cos(), -a * theta.sin(), 0.0);
    let l = e.norm();
    let beta = e.y.atan2(e.x) + branch * ((b * b + l * l - c * c) / (2.0 * b * l)).acos();
    let R = Quat::from_scaled_axis(Vec3::z() * beta);
    Vec3::new(a * theta.cos(), a * theta.sin(), 0.0) + R * Vec3::new(0.5 * b, 0.2, 0.0)
}

/// Returns the largest error of all constraints, from the dynamics kernels, rad or m.
fn errors(tree: &Tree, q: &[f64], motions: &[LoopMotion]) -> f64 {
    let (units, mut ws) = (Units::new(tree, |_| ConstraintMethod::Augment), Workspace::new(tree));
    let mut uw = UnitsWork::new(tree, &units);
    kinematics(tree, &mut ws, q, &vec![0.0; tree.nv()]);
    let mut most = 0.0_f64;
    for (i, _) in tree.multibody().loops().iter().enumerate() {
        units.loop_errors(tree, &ws, &mut uw, i, motions, |d, _| most = most.max(d.abs()));
    }
    for c in tree.multibody().constraints() {
        let error = units.error(tree, &ws, &uw, c, motions, q);
        most = if error.is_nan() { error } else { most.max(error) };
    }
    most
}

fn node_at(tree: &Tree, q: &[f64], node: &str) -> Vec3 {
    let mut ws = Workspace::new(tree);
    poses(tree, &mut ws, q);
    ws.node_pose(tree, tree.multibody().node(node).unwrap()).position
}

#[test]
fn a_point_of_a_four_bar_is_reached_with_its_loop_closed() {
    let mbs = four_bar(LINKS, Hinge::pin(Vec3::z()));
    let (tree, node) = (Tree::new(&mbs), mbs.node("point").unwrap());
    let mut ik = InverseKinematics::new(&tree);
    for i in 0..40 {
        let theta = 0.1 + 0.15 * f64::from(i);
        let goal = point(LINKS, theta, if i % 2 == 0 { 1.0 } else { -1.0 });
        // Start from any configuration, whether the loop is closed or not.
        let mut q = mbs.random_q(i as u64);
        ik.solve(&tree, &[Target::new(node, Goal::position(goal))], &mut q).unwrap();
        assert!((node_at(&tree, &q, "point") - goal).norm() <= 1.1e-9);
        assert!(errors(&tree, &q, &[]) <= 1.1e-9, "{i}: {:e}", errors(&tree, &q, &[]));
        let all: Vec<_> = ik.closures().collect();
        assert!(all.len() == 1 && all[0].0 == Closure::Constraint(ConstraintId::Loop(0)));
        assert!(all[0].1.position <= 1e-9 && ik.open().is_none());
    }
}

/// Returns the smallest distance over all crank angles and both branches, from the closed form, refined three times.
fn least_distance(links: [f64; 4], goal: &Vec3) -> f64 {
    let far = |t: f64, branch: f64| (point(links, t, branch) - goal).norm();
    let mut best = f64::INFINITY;
    for branch in [1.0, -1.0] {
        let (mut middle, mut width) = (0.0, PI);
        for _ in 0..12 {
            let tried = (-400..=400).map(|k| middle + width * f64::from(k) / 400.0);
            middle = tried.min_by(|a, b| far(*a, branch).total_cmp(&far(*b, branch))).unwrap();
            width /= 100.0;
            best = f64::min(best, far(middle, branch));
        }
    }
    best
}

#[test]
fn what_is_out_of_reach_is_answered_with_the_nearest_that_is_closed() {
    let mbs = four_bar(LINKS, Hinge::pin(Vec3::z()));
    let (tree, node) = (Tree::new(&mbs), mbs.node("point").unwrap());
    let mut ik = InverseKinematics::new(&tree);
    let mut most = 0;
    for i in 0..24 {
        let turn = 0.26 * f64::from(i);
        let goal = Vec3::new(0.3 + 3.0 * turn.cos(), 0.2 + 2.0 * turn.sin(), 0.1);
        let mut q = mbs.random_q(i as u64);
        ik.begin(&tree, &[Target::new(node, Goal::position(goal))], &q).unwrap();
        let Progress::Nearest(found) = ik.advance(&tree, usize::MAX, &mut q) else { panic!("{i}") };
        assert!(errors(&tree, &q, &[]) <= 1.1e-9, "{i}: {:e}", errors(&tree, &q, &[]));
        let (got, least) =
            ((node_at(&tree, &q, "point") - goal).norm(), least_distance(LINKS, &goal));
        assert!((got - ik.residuals()[0].position).abs() < 1e-12);
        assert!((got - least).abs() <= 1e-9, "{i}: {got} {least}");
        most = most.max(found.kinematics);
    }
    println!("{most} evaluations at most");
}

#[test]
fn a_loop_that_cannot_close_is_an_error_with_the_least_gap() {
    let links = [0.3, 0.4, 0.2, 1.1];
    let mbs = four_bar(links, Hinge::pin(Vec3::z()));
    let (tree, node) = (Tree::new(&mbs), mbs.node("point").unwrap());
    let mut ik = InverseKinematics::new(&tree);
    let target = Target::new(node, Goal::position(Vec3::new(0.4, 0.1, 0.0)));
    let mut q = mbs.random_q(3);
    let error = ik.solve(&tree, &[target], &mut q).unwrap_err();
    let InverseKinematicsError::Open { closure, residual, nearest, .. } = &error else {
        panic!("{error}")
    };
    assert_eq!(closure, "loop `bar`");
    // All links are in line.
    assert!((residual.position - 0.2).abs() < 1e-9, "{residual:?}");
    assert_eq!((&nearest.q, ik.open().unwrap().1), (&q, *residual));
    assert!(error.to_string().starts_with("loop `bar` does not close"), "{error}");
    // The crank is limited to one angle and the coupler is kept, so the loop cannot close.
    let mbs = four_bar(LINKS, Hinge::pin(Vec3::z()).limits(Limits::position(0.5, 0.5)));
    let tree = Tree::new(&mbs);
    let mut ik = InverseKinematics::new(&tree);
    let coupler = mbs.get(mbs.body("coupler").unwrap()).v();
    ik.keep(coupler);
    let mut q = vec![0.5, 2.0, 1.0];
    let error = ik.solve(&tree, &[], &mut q).unwrap_err();
    assert!(matches!(error, InverseKinematicsError::Open { .. }), "{error}");
}

/// Two chains of six pins from the world, and a loop of each kind of hinge between their ends.
#[test]
fn loops_of_all_hinges_close_and_not_the_wrong_way_round() {
    let (x, y, z) = (Vec3::x(), Vec3::y(), Vec3::z());
    let n = Vec3::new(0.3, -0.4, 0.866).normalize();
    let hinges = [
        ("weld", Hinge::locked(), vec![]),
        ("pin", Hinge::pin(n), vec![]),
        ("slider", Hinge::slider(n), vec![]),
        ("ball", Hinge::ball(), vec![]),
        ("universal", Hinge::universal(x, Vec3::new(0.6, 0.8, 0.0)), vec![]),
        ("cylindrical", Hinge::cylindrical(n), vec![]),
        ("planar", Hinge::planar(), vec![]),
        ("gimbal", Hinge::gimbal(), vec![]),
        ("screw", Hinge::screw(n, 0.1), vec![]),
        ("given pin", Hinge::pin(n).prescribed(), vec![0.7]),
        ("given slider", Hinge::slider(y).prescribed(), vec![-0.15]),
    ];
    for (name, hinge, given) in hinges {
        let mut m = Builder::new();
        for side in ["l", "r"] {
            let mut parent = "world".to_owned();
            for (k, axis) in [z, y, y, x, y, x].into_iter().enumerate() {
                let at = match (k, side) {
                    (0, "l") => Pose::translation(0.0, 0.3, 0.0),
                    (0, _) => Pose::translation(0.0, -0.3, 0.0),
                    (1..4, _) => Pose::translation(0.1, 0.02, 0.3),
                    _ => Pose::translation(0.0, 0.03, 0.08),
                };
                let body = format!("{side}{k}");
                let hinge = Hinge::pin(axis).limits(Limits::position(-2.9, 2.9));
                let spec = BodySpec::new(&body, &parent).hinge_in_parent(at);
                m.body(spec.hinge(hinge).mass(mass()));
                parent = body;
            }
        }
        let mut r = Rng(5);
        m.loop_closure(closure(name, ("l5", r.pose()), ("r5", r.pose()), hinge));
        m.node("left", "l5", Pose::identity());
        let mbs = m.build().unwrap();
        let (tree, left) = (Tree::new(&mbs), mbs.node("left").unwrap());
        let mut ik = InverseKinematics::new(&tree);
        ik.set_loop_motions(&tree, &given);
        let motions: Vec<LoopMotion> =
            given.iter().map(|u| LoopMotion { position: *u, ..LoopMotion::default() }).collect();
        let (mut met, mut steps) = (0, 0);
        for seed in 0..20 {
            let mut q: Vec<f64> = mbs.random_q(seed).iter().map(|x| x.clamp(-2.8, 2.8)).collect();
            let place = Target::new(left, Goal::position(Vec3::new(0.35, 0.0, 0.75)));
            let found = ik.solve(&tree, &[place], &mut q);
            let Ok(found) = found else { continue };
            let error = errors(&tree, &q, &motions);
            assert!(error <= 3e-9, "{name}, {seed}: {error:e}");
            // Check the orientation of the frames directly: the loop must not be closed the wrong
            // way round.
            let mut ws = Workspace::new(&tree);
            poses(&tree, &mut ws, &q);
            let l = &mbs.loops()[0];
            let [A, B] = [&l.a, &l.b].map(|e| ws.body_pose(&tree, e.body.unwrap()) * e.pose);
            let R = (A.rotation.inverse() * B.rotation).to_rotation_matrix().into_inner();
            let turned = match name {
                "weld" | "slider" | "given slider" => (R - Mat3::identity()).norm(),
                "pin" | "cylindrical" | "screw" | "given pin" => (R * n - n).norm(),
                "planar" => (R * z - z).norm(),
                _ => 0.0,
            };
            assert!(turned < 3e-8, "{name}: {turned:e}");
            if name == "given pin" {
                let turn = Quat::from_scaled_axis(n * 0.7).to_rotation_matrix().into_inner();
                assert!((R - turn).norm() < 1e-8);
            }
            (met, steps) = (met + 1, steps + found.iterations);
            // The Jacobian belongs to the errors, so convergence near the solution is quadratic.
            let mut next: Vec<f64> =
                q.iter().zip(mbs.random_v(seed)).map(|(q, v)| q + 1e-3 * v).collect();
            if next.iter().all(|x| x.abs() < 2.9) {
                let found = ik.solve(&tree, &[], &mut next).unwrap();
                assert!((1..=3).contains(&found.iterations), "{name}: {found:?}");
            }
        }
        println!("{name}: {met} of 20, {steps} steps");
        assert!(met >= 17, "{name}: {met} of 20");
    }
}

fn coordinate(body: &str) -> HingeCoordinate {
    HingeCoordinate { body: body.into(), subhinge: 0 }
}

/// A planar arm of three pins whose last two mimic the first: the tip moves on a curve.
#[test]
fn couplings_hold_and_the_nearest_keeps_them() {
    let mut m = Builder::new();
    let mut parent = "world".to_owned();
    for (k, l) in [0.0, 0.5, 0.4].into_iter().enumerate() {
        let body = format!("b{k}");
        let limits = Limits::position(-2.0, 2.0);
        let spec = BodySpec::new(&body, &parent).hinge_in_parent(at(l)).mass(mass());
        m.body(spec.hinge(Hinge::pin(Vec3::z()).limits(limits)));
        parent = body;
    }
    m.node("tip", "b2", at(0.3));
    m.coupling(Coupling::mimic("one", coordinate("b1"), coordinate("b0"), 0.8, 0.1));
    m.coupling(Coupling::mimic("two", coordinate("b2"), coordinate("b0"), -1.2, 0.0));
    let mbs = m.build().unwrap();
    let (tree, tip) = (Tree::new(&mbs), mbs.node("tip").unwrap());
    let place = |b: &str| mbs.get(mbs.body(b).unwrap()).q().start;
    let of = |x: f64| {
        let mut q = vec![0.0; 3];
        for (b, u) in [("b0", x), ("b1", 0.8 * x + 0.1), ("b2", -1.2 * x)] {
            q[place(b)] = u;
        }
        q
    };
    let mut ik = InverseKinematics::new(&tree);
    for k in -10_i32..=10 {
        let want = of(0.14 * f64::from(k));
        let mut q = mbs.random_q(k.unsigned_abs().into());
        let goal = Goal::position(node_at(&tree, &want, "tip"));
        ik.solve(&tree, &[Target::new(tip, goal)], &mut q).unwrap();
        assert!(errors(&tree, &q, &[]) <= 1.1e-9);
        assert!((node_at(&tree, &q, "tip") - goal.position.unwrap()).norm() < 1.1e-9);
    }
    // The goal is out of reach, so the result is the point of the curve that is nearest to it.
    let goal = Vec3::new(1.0, 1.5, 0.0);
    let mut q = vec![0.0; 3];
    ik.solve(&tree, &[Target::new(tip, Goal::position(goal))], &mut q).unwrap_err();
    assert!(errors(&tree, &q, &[]) <= 1.1e-9);
    let far = |x: f64| (node_at(&tree, &of(x), "tip") - goal).norm();
    let (mut middle, mut width) = (0.0, 2.0 / 1.2);
    for _ in 0..8 {
        let tried = (-100..=100).map(|k| middle + width * f64::from(k) / 100.0);
        middle = tried
            .filter(|x| x.abs() <= 2.0 / 1.2 && (0.8 * x + 0.1).abs() <= 2.0)
            .min_by(|a, b| far(*a).total_cmp(&far(*b)))
            .unwrap();
        width /= 20.0;
    }
    let got = (node_at(&tree, &q, "tip") - goal).norm();
    assert!((got - far(middle)).abs() < 1e-9, "{got} {}", far(middle));
    // If two couplings contradict each other, the error names one of them.
    m.coupling(Coupling::mimic("wrong", coordinate("b1"), coordinate("b0"), 0.8, 0.5));
    let mbs = m.build().unwrap();
    let tree = Tree::new(&mbs);
    let error = InverseKinematics::new(&tree).solve(&tree, &[], &mut [0.0; 3]).unwrap_err();
    let InverseKinematicsError::Open { closure, residual, .. } = error else { panic!("{error}") };
    assert!(["coupling `one`", "coupling `wrong`"].contains(&closure.as_str()), "{closure}");
    // The contradiction of 0.4 is divided equally between the two couplings.
    assert!((residual.orientation - 0.2).abs() < 1e-6, "{residual:?}");
}

/// Given closures behave like loops of the mechanism, and other targets are reached in addition.
#[test]
fn given_closures_are_kept_before_targets() {
    let mut m = Builder::new();
    for (side, y) in [("l", 0.2), ("r", -0.2)] {
        let mut parent = "world".to_owned();
        for (k, axis) in [Vec3::z(), Vec3::y(), Vec3::y(), Vec3::x(), Vec3::y(), Vec3::x()]
            .into_iter()
            .enumerate()
        {
            let body = format!("{side}{k}");
            let at = if k == 0 {
                Pose::translation(0.0, y, 0.0)
            } else {
                Pose::translation(0.1, 0.0, 0.2)
            };
            let spec = BodySpec::new(&body, &parent).hinge_in_parent(at).mass(mass());
            m.body(spec.hinge(Hinge::pin(axis).limits(Limits::position(-2.9, 2.9))));
            parent = body;
        }
    }
    m.node("left", "l5", at(0.05));
    m.node("right", "r5", at(0.05));
    let mbs = m.build().unwrap();
    let (tree, [left, right]) = (Tree::new(&mbs), ["left", "right"].map(|n| mbs.node(n).unwrap()));
    // Choose a feasible configuration: the arms are bent towards each other.
    let place = |b: &str| mbs.get(mbs.body(b).unwrap()).q().start;
    let mut hands = vec![0.0; mbs.nq()];
    for (side, s) in [("l", 1.0), ("r", -1.0)] {
        let bent = [-0.3 * s, 0.4, 0.5, 0.2 * s, 0.4, 0.1];
        for (k, x) in bent.into_iter().enumerate() {
            hands[place(&format!("{side}{k}"))] = x;
        }
    }
    let mut ws = Workspace::new(&tree);
    poses(&tree, &mut ws, &hands);
    let [X_l, X_r] = [left, right].map(|n| ws.node_pose(&tree, n));
    let grasp = X_l.inverse() * X_r;
    let closed = Target::new(right, Goal::pose(grasp)).relative_to(left);
    let mut ik = InverseKinematics::new(&tree);
    let apart = |q: &[f64]| {
        let mut ws = Workspace::new(&tree);
        poses(&tree, &mut ws, q);
        let X = ws.node_pose(&tree, left).inverse() * ws.node_pose(&tree, right);
        (X.position - grasp.position).norm().max(X.rotation.angle_to(&grasp.rotation))
    };
    let (mut met, mut nearest) = (0, 0);
    for seed in 0..12 {
        // Every third goal is too far away.
        let far = if seed % 3 == 0 { 3.0 } else { 0.0 };
        let near = Vec3::new(far - 0.03, 0.0, 0.02);
        let goal = Goal::position(X_l.position + near)
            .place(Place::Line(Vec3::y()))
            .and_pointing(Pointing::along(Vec3::x(), X_l.rotation * Vec3::x()).within(0.1));
        let mut q: Vec<f64> = mbs.random_q(seed).iter().map(|x| x.clamp(-2.8, 2.8)).collect();
        ik.begin_closed(&tree, &[Target::new(left, goal)], &[closed], &q).unwrap();
        match ik.advance(&tree, usize::MAX, &mut q) {
            Progress::Met(_) => met += 1,
            Progress::Nearest(_) => nearest += 1,
            other => panic!("{seed}: {other:?}"),
        }
        assert!(apart(&q) < 3e-8, "{seed}: {:e}", apart(&q));
        let (which, r) = ik.closures().next().unwrap();
        assert!(which == Closure::Given(0) && r.position <= 1e-9 && r.orientation <= 1e-9);
    }
    assert_eq!((met, nearest), (8, 4));
    // With this number of restarts reserved, the search allocates nothing, including rounds and errors of closures. The
    // same applies to a search in portions.
    let mut q = vec![0.1; mbs.nq()];
    let targets = [Target::new(left, Goal::position(Vec3::new(3.0, 0.0, 0.4)))];
    ik.effort.restarts = 3;
    ik.begin_closed(&tree, &targets, &[closed], &q).unwrap();
    let once = ik.advance(&tree, usize::MAX, &mut q);
    let (mut again, mut p) = (InverseKinematics::new(&tree), vec![0.1; mbs.nq()]);
    again.effort.restarts = 3;
    again.reserve(2);
    let mut v = vec![0.0; mbs.nv()];
    let counted = allocation_counter::measure(|| {
        again.begin_closed(&tree, &targets, &[closed], &p).unwrap();
        while let Progress::Unfinished(_) = again.advance(&tree, 7, &mut p) {
            again.rates(&tree, &[RateTarget::new(left, Motion::zero())], &q, &mut v).unwrap();
        }
    });
    assert_eq!(counted.count_total, 0);
    assert_eq!(
        (once, q, ik.residuals()),
        (again.advance(&tree, 0, &mut p), p.clone(), again.residuals())
    );
    // Errors of closures are defined like errors of targets.
    let nothing = Target::new(right, Goal::NOTHING);
    let told = ik.begin_closed(&tree, &targets, &[nothing], &p).unwrap_err().to_string();
    assert!(told.starts_with("closure 0: neither"), "{told}");
}

#[test]
fn rates_keep_loops_closed() {
    let mbs = four_bar(LINKS, Hinge::pin(Vec3::z()));
    let (tree, node) = (Tree::new(&mbs), mbs.node("point").unwrap());
    let mut ik = InverseKinematics::new(&tree);
    for i in 0..20 {
        let theta = 0.3 * f64::from(i);
        let mut q = mbs.neutral_q();
        let goal = Goal::position(point(LINKS, theta, 1.0));
        ik.effort.position_tolerance = 1e-12;
        ik.solve(&tree, &[Target::new(node, goal)], &mut q).unwrap();
        // The point can only move along its curve, so the best velocity is the component along it.
        let h = 1e-6;
        let along = (point(LINKS, theta + h, 1.0) - point(LINKS, theta - h, 1.0)) / (2.0 * h);
        let want = Vec3::new(0.3, -0.2, 0.0);
        let target = RateTarget::new(node, Motion::new(Vec3::zeros(), want)).weights(1.0, 0.0);
        let mut v = vec![0.0; 3];
        let left = ik.rates(&tree, &[target], &q, &mut v).unwrap()[0].position;
        let best = along * (along.dot(&want) / along.norm_squared());
        let crank = v[mbs.get(mbs.body("crank").unwrap()).v().start];
        assert!((crank - along.dot(&want) / along.norm_squared()).abs() < 1e-6, "{i}: {crank}");
        assert!((left - (want - best).norm()).abs() < 1e-7);
        let mut next = q.clone();
        let dv: Vec<f64> = v.iter().map(|v| v * 1e-5).collect();
        mbs.integrate(&q, &dv, &mut next);
        assert!(errors(&tree, &next, &[]) < 1e-9, "{:e}", errors(&tree, &next, &[]));
    }
    // A prescribed crank moves the others; a blocked one stops them.
    let mbs = four_bar(LINKS, Hinge::pin(Vec3::z()).prescribed());
    let tree = Tree::new(&mbs);
    let mut ik = InverseKinematics::new(&tree);
    let (mut q, mut v) = (vec![0.6, 0.5, 1.5], vec![0.0; 3]);
    ik.solve(&tree, &[], &mut q).unwrap();
    let crank = mbs.get(mbs.body("crank").unwrap()).v();
    v[crank.start] = 0.8;
    ik.rates(&tree, &[], &q, &mut v).unwrap();
    let mut next = q.clone();
    let dv: Vec<f64> = v.iter().map(|v| v * 1e-5).collect();
    mbs.integrate(&q, &dv, &mut next);
    assert!(v[crank.start] == 0.8 && errors(&tree, &next, &[]) < 1e-9);
    ik.keep(0..3);
    let mut stuck = vec![0.0; 3];
    stuck[crank.start] = 0.8;
    let error = ik.rates(&tree, &[], &q, &mut stuck).map(|_| ()).unwrap_err();
    assert!(error.to_string().starts_with("loop `bar` opens at"), "{error}");
}
