//! Inverse kinematics: robots reach feasible goals, limits hold, loops close, errors state the reason.

use crate::support::{Rng, Shape, random_tree, robot};
use linkwork_dynamics::multibody::{
    BodySpec, Builder, Coordinate, Hinge, Limits, Multibody, NodeId,
};
use linkwork_dynamics::spatial::nalgebra::{DMatrix, DVector};
use linkwork_dynamics::spatial::{Motion, Pose, Quat, Vec3};
use linkwork_dynamics::*;
use std::f64::consts::PI;

fn pose_of(tree: &Tree, q: &[f64], node: NodeId) -> Pose {
    let mut ws = Workspace::new(tree);
    poses(tree, &mut ws, q);
    ws.node_pose(tree, node)
}

/// Returns the robot with limits on every one-dof coordinate.
fn limited(mbs: &Multibody, limits: Limits) -> Multibody {
    let mut b = Builder::from(mbs);
    for s in b.bodies_mut().iter_mut().flat_map(|b| &mut b.hinge.subhinges) {
        if s.kind.nv() == 1 {
            s.limits = limits;
        }
    }
    b.build().unwrap()
}

/// Returns q moved by up to `size` in every coordinate, clamped to ± `limit`.
fn moved(mbs: &Multibody, q: &[f64], size: f64, limit: f64, r: &mut Rng) -> Vec<f64> {
    let dv: Vec<f64> = r.vec(mbs.nv()).iter().map(|x| x * size).collect();
    let mut out = q.to_vec();
    mbs.integrate(q, &dv, &mut out);
    for (_, s) in mbs.subhinges().filter(|(_, s)| s.v.len() == 1) {
        out[s.q.start] = out[s.q.start].clamp(-limit, limit);
    }
    out
}

#[test]
fn reference_robots_reach_what_can_be_reached_within_limits() {
    for name in ["ur5", "iiwa7", "solo12_ff"] {
        let Some(robot) = robot(name) else { return };
        let mbs = limited(robot.tree.multibody(), Limits::position(-2.6, 2.6));
        let tree = Tree::new(&mbs);
        let mut ik = InverseKinematics::new(&tree);
        let (mut steps, mut restarts, mut worst) = (0, 0, 0.0_f64);
        for seed in 0..60 {
            let mut r = Rng(seed);
            let goal = moved(&mbs, &mbs.neutral_q(), 2.5, 2.6, &mut r);
            // One foot has a position target and one a pose target; an arm has one tool.
            let targets: Vec<Target> = mbs
                .node_ids()
                .enumerate()
                .map(|(i, n)| {
                    let X = pose_of(&tree, &goal, n);
                    if i == 0 {
                        Target::new(n, Goal::pose(X))
                    } else {
                        Target::new(n, Goal::position(X.position))
                    }
                })
                .collect();
            let mut q = moved(&mbs, &goal, 0.5, 2.6, &mut r);
            let found =
                ik.solve(&tree, &targets, &mut q).unwrap_or_else(|e| panic!("{name} {seed}: {e}"));
            steps += found.iterations;
            restarts += found.restarts;
            for t in &targets {
                let X = pose_of(&tree, &q, t.node);
                let off = (X.position - t.goal.position.unwrap()).norm();
                let turn = t.goal.orientation.map_or(0.0, |R| R.angle_to(&X.rotation));
                assert!(off <= 1e-9 && turn <= 2e-8, "{name} {seed}: {off:e} m, {turn:e} rad");
                worst = worst.max(off);
            }
            for (_, s) in mbs.subhinges().filter(|(_, s)| s.v.len() == 1) {
                assert!(q[s.q.start].abs() <= 2.6, "{name} {seed}: limits");
            }
        }
        println!(
            "{name}: {} steps and {} restarts a solution, within {worst:e} m",
            f64::from(steps as u32) / 60.0,
            f64::from(restarts as u32) / 60.0
        );
    }
}

#[test]
fn starts_anywhere_lead_there_almost_always() {
    // Measured: half of the single starts end in a corner of the limits. With 64 additional starts,
    // 899 of 900 searches succeeded.
    for name in ["ur5", "iiwa7", "solo12_ff"] {
        let Some(robot) = robot(name) else { return };
        let mbs = limited(robot.tree.multibody(), Limits::position(-2.6, 2.6));
        let tree = Tree::new(&mbs);
        let mut ik = InverseKinematics::new(&tree);
        let mut failures = 0;
        for seed in 0..60 {
            let mut r = Rng(seed);
            let goal = moved(&mbs, &mbs.neutral_q(), 2.5, 2.6, &mut r);
            let node = mbs.node_ids().next().unwrap();
            let target = Target::new(node, Goal::pose(pose_of(&tree, &goal, node)));
            let mut q = moved(&mbs, &goal, 3.0, 2.6, &mut r);
            match ik.solve(&tree, &[target], &mut q) {
                Ok(_) => {
                    let X = pose_of(&tree, &q, node);
                    assert!((X.position - target.goal.position.unwrap()).norm() <= 1e-9);
                }
                Err(InverseKinematicsError::Unreachable { .. }) => failures += 1,
                Err(other) => panic!("{name} {seed}: {other}"),
            }
        }
        assert!(failures <= 1, "{name}: {failures} of 60 not reached");
    }
}

/// Two links of lengths a and b in the plane, with a node at the tip; the second pin is limited.
fn planar(a: f64, b: f64, elbow: Limits) -> (Multibody, NodeId) {
    let mut m = Builder::new();
    let mut r = Rng(1);
    m.body(BodySpec::new("upper", "world").hinge(Hinge::pin(Vec3::z())).mass(r.mass()));
    m.body(
        BodySpec::new("lower", "upper")
            .hinge_in_parent(Pose::translation(a, 0.0, 0.0))
            .hinge(Hinge::pin(Vec3::z()).limits(elbow))
            .mass(r.mass()),
    );
    m.node("tip", "lower", Pose::translation(b, 0.0, 0.0));
    m.node("shoulder", "upper", Pose::identity());
    let mbs = m.build().unwrap();
    let tip = mbs.node("tip").unwrap();
    (mbs, tip)
}

#[test]
fn a_planar_arm_has_its_closed_form() {
    let (a, b) = (0.7, 0.45);
    for (elbow, sign) in [(Limits::position(0.0, PI), 1.0), (Limits::position(-PI, 0.0), -1.0)] {
        let (mbs, tip) = planar(a, b, elbow);
        let tree = Tree::new(&mbs);
        let mut ik = InverseKinematics::new(&tree);
        let mut r = Rng(4);
        for _ in 0..40 {
            let (radius, angle) = (0.3 + 0.8 * r.signed().abs(), 3.0 * r.signed());
            let p = Vec3::new(radius * angle.cos(), radius * angle.sin(), 0.0);
            let mut q = vec![angle, sign * 1.0];
            ik.solve(&tree, &[Target::new(tip, Goal::position(p))], &mut q).unwrap();
            let cos = (radius * radius - a * a - b * b) / (2.0 * a * b);
            let q2 = sign * cos.acos();
            let q1 = angle - (b * q2.sin()).atan2(a + b * q2.cos());
            assert!((q[1] - q2).abs() <= 1e-7, "{q:?} {q2}");
            let turn = (q[0] - q1).rem_euclid(2.0 * PI);
            assert!(turn.min(2.0 * PI - turn) <= 1e-7, "{q:?} {q1}");
        }
    }
}

#[test]
fn out_of_reach_says_how_far_and_gives_the_nearest() {
    let (mbs, tip) = planar(0.7, 0.45, Limits::position(0.3, 2.0));
    let tree = Tree::new(&mbs);
    let mut ik = InverseKinematics::new(&tree);
    let mut q = vec![0.1, 1.0];
    let goal = Vec3::new(0.0, 3.0, 0.0);
    let error = ik.solve(&tree, &[Target::new(tip, Goal::position(goal))], &mut q).unwrap_err();
    let InverseKinematicsError::Unreachable { nearest, .. } = &error else { panic!("{error}") };
    // The elbow is as straight as its limit permits, and the tip points at the goal.
    let reach = (0.7_f64.powi(2) + 0.45_f64.powi(2) + 2.0 * 0.7 * 0.45 * 0.3_f64.cos()).sqrt();
    assert!((nearest.residuals[0].position - (3.0 - reach)).abs() < 1e-7, "{error}");
    assert_eq!((nearest.at_limit.as_slice(), nearest.q[1]), (&[1][..], 0.3));
    assert!((pose_of(&tree, &nearest.q, tip).position.normalize() - Vec3::y()).norm() < 1e-6);
    assert_eq!(q, nearest.q);
    let text = error.to_string();
    assert!(text.contains("node `tip` is 1.8") && text.contains(" m from its target"), "{text}");
    assert!(text.contains("body `lower`, coordinate 1, is at its limit"), "{text}");
    assert_eq!(ik.residuals(), nearest.residuals);
    assert_eq!(ik.at_limit(&q).collect::<Vec<_>>(), [1]);
    // A goal outside of the plane and rotated leaves a distance and an angle, so the error states
    // both units.
    let X = Pose::new(Quat::from_scaled_axis(Vec3::x()), Vec3::new(0.5, 0.5, 0.2));
    let text = ik.solve(&tree, &[Target::new(tip, Goal::pose(X))], &mut q).unwrap_err().to_string();
    assert!(text.contains(" m and ") && text.contains(" rad from its target"), "{text}");
}

/// A four-bar: crank a, coupler b, follower c, ground d. The ends of coupler and follower must coincide.
#[test]
fn a_four_bar_closes_as_its_closed_form_says() {
    let (a, b, c, d) = (0.3, 0.8, 0.6, 0.7);
    let mut m = Builder::new();
    let (mut r, pin) = (Rng(2), || Hinge::pin(Vec3::z()));
    m.body(BodySpec::new("crank", "world").hinge(pin().prescribed()).mass(r.mass()));
    let at = |x| Pose::translation(x, 0.0, 0.0);
    m.body(BodySpec::new("coupler", "crank").hinge_in_parent(at(a)).hinge(pin()).mass(r.mass()));
    m.body(BodySpec::new("follower", "world").hinge_in_parent(at(d)).hinge(pin()).mass(r.mass()));
    m.node("end", "coupler", at(b));
    m.node("joint", "follower", at(c));
    let mbs = m.build().unwrap();
    let tree = Tree::new(&mbs);
    let (end, joint) = (mbs.node("end").unwrap(), mbs.node("joint").unwrap());
    let closed = Target::new(end, Goal::position(Vec3::zeros())).relative_to(joint);
    let mut ik = InverseKinematics::new(&tree);
    let at = |name: &str| mbs.get(mbs.body(name).unwrap()).q().start;
    let (crank, coupler, follower) = (at("crank"), at("coupler"), at("follower"));
    ik.effort.position_tolerance = 1e-13;
    // This is the open branch: the joint is left of the line from the crank's end to the ground.
    let mut q = mbs.neutral_q();
    (q[coupler], q[follower]) = (0.5, 1.5);
    for i in 0..72 {
        q[crank] = 0.2 + f64::from(i) * PI / 36.0;
        let theta = q[crank];
        ik.solve(&tree, &[closed], &mut q).unwrap();
        assert_eq!(q[crank], theta, "prescribed coordinates stay");
        // Freudenstein's equation uses e, the vector from the crank's end to the ground pivot.
        let e = Vec3::new(d - a * theta.cos(), -a * theta.sin(), 0.0);
        let l = e.norm();
        let beta = e.y.atan2(e.x) + ((b * b + l * l - c * c) / (2.0 * b * l)).acos();
        let p = Vec3::new(a * theta.cos() + b * beta.cos(), a * theta.sin() + b * beta.sin(), 0.0);
        let X = pose_of(&tree, &q, joint);
        assert!((X.position - p).norm() <= 1e-8, "crank at {theta}: {:?} {p:?}", X.position);
        // Compare the rates that keep the loop closed with finite differences.
        let mut v = vec![0.0; 3];
        let v_of = |name: &str| mbs.get(mbs.body(name).unwrap()).v().start;
        v[v_of("crank")] = 0.7;
        let still = RateTarget::new(end, Motion::zero()).relative_to(joint).weights(1.0, 0.0);
        let missing = ik.rates(&tree, &[still], &q, &mut v).unwrap()[0].position;
        assert!(missing <= 1e-12, "{missing:e}");
        let h = 1e-6;
        let mut next = q.clone();
        next[crank] += 0.7 * h;
        ik.solve(&tree, &[closed], &mut next).unwrap();
        let rate = (next[follower] - q[follower]) / h;
        assert!((rate - v[v_of("follower")]).abs() <= 1e-5, "{rate} {}", v[v_of("follower")]);
    }
}

#[test]
fn random_trees_meet_poses_relative_to_each_other_with_coordinates_kept() {
    for seed in 0..30 {
        let mbs = random_tree(
            seed,
            Shape {
                bodies: 8,
                floating: seed.is_multiple_of(2),
                prescribed: true,
                armature: false,
            },
        );
        let tree = Tree::new(&mbs);
        let mut ik = InverseKinematics::new(&tree);
        let mut r = Rng(seed + 1);
        let goal = mbs.random_q(seed);
        let (a, b) = (mbs.node("n01").unwrap(), mbs.node("n07").unwrap());
        let X = pose_of(&tree, &goal, a).inverse() * pose_of(&tree, &goal, b);
        let targets = [
            Target::new(b, Goal::pose(X).weights(2.0, 0.7)).relative_to(a),
            Target::new(
                mbs.node("n04").unwrap(),
                Goal::orientation(pose_of(&tree, &goal, mbs.node("n04").unwrap()).rotation),
            ),
        ];
        // All kept coordinates already have their required values.
        let kept = mbs.get(mbs.body("b03").unwrap()).v();
        ik.keep(kept.clone());
        let mask = mbs.prescribed();
        let dv: Vec<f64> = (0..mbs.nv())
            .map(|i| if mask[i] || kept.contains(&i) { 0.0 } else { 0.3 * r.signed() })
            .collect();
        let mut q = goal.clone();
        mbs.integrate(&goal, &dv, &mut q);
        let start = q.clone();
        ik.solve(&tree, &targets, &mut q).unwrap_or_else(|e| panic!("seed {seed}: {e}"));
        let Y = pose_of(&tree, &q, a).inverse() * pose_of(&tree, &q, b);
        assert!(
            (X.position - Y.position).norm() <= 1e-9 && X.rotation.angle_to(&Y.rotation) < 3e-8
        );
        for (body, s) in mbs.subhinges() {
            let held =
                s.subhinge.coordinate == Coordinate::Prescribed || mbs.get(body).name() == "b03";
            if held && s.v.len() == 1 {
                assert_eq!(q[s.q.start], start[s.q.start], "seed {seed}");
            }
        }
    }
}

#[test]
fn rates_are_least_squares_of_least_norm_within_limits() {
    let mut compared = 0;
    for seed in 0..300 {
        let mbs = random_tree(
            seed,
            Shape {
                bodies: 7,
                floating: seed.is_multiple_of(2),
                prescribed: false,
                armature: false,
            },
        );
        let tree = Tree::new(&mbs);
        let (nv, node) = (mbs.nv(), mbs.node("n06").unwrap());
        let (q, mut r) = (mbs.random_q(seed), Rng(seed));
        let V = Motion::new(r.vec3(), r.vec3());
        let mut ik = InverseKinematics::new(&tree);
        let mut v = vec![9.0; nv];
        let missing = ik.rates(&tree, &[RateTarget::new(node, V)], &q, &mut v).unwrap()[0];
        let mut ws = Workspace::new(&tree);
        kinematics(&tree, &mut ws, &q, &v);
        let got = ws.node_velocity(&tree, node);
        assert!(((got.linear - V.linear).norm() - missing.position).abs() <= 1e-12);
        assert!(((got.angular - V.angular).norm() - missing.orientation).abs() <= 1e-12);
        // Compare with a dense pseudo-inverse.
        let mut J = vec![0.0; 6 * nv];
        node_jacobian(&tree, &ws, node, &mut J);
        let J = DMatrix::from_row_slice(6, nv, &J);
        let b = DVector::from_iterator(6, V.angular.iter().chain(V.linear.iter()).copied());
        // The gradient vanishes, and v is J^T y for some y: the minimum-norm minimiser.
        let eigen = (&J * J.transpose()).symmetric_eigen();
        let most = eigen.eigenvalues.max();
        let small = |x: &f64| *x > 1e-14 * most && *x < 1e-5 * most;
        if eigen.eigenvalues.iter().any(small) {
            continue;
        }
        compared += 1;
        let x = DVector::from_column_slice(&v);
        let gradient = J.transpose() * (&b - &J * &x);
        assert!(gradient.norm() <= 1e-10 * most, "seed {seed}: {:e}", gradient.norm());
        let inverse = eigen.eigenvalues.map(|l| if l > 1e-14 * most { 1.0 / l } else { 0.0 });
        let U = &eigen.eigenvectors;
        let y = U * DMatrix::from_diagonal(&inverse) * U.transpose() * (&J * &x);
        let beside = (&x - J.transpose() * y).norm();
        // JᵀJ + δ 1 has a round-off error of 1e-8 in directions that do not move the node.
        assert!(beside <= 1e-7 * (1.0 + x.norm()), "seed {seed}: {beside:e}");

        // No feasible neighbour is better if rates are limited.
        let tight = Limits { rate: 0.2, ..Limits::position(-1.0, 1.0) };
        let mbs = limited(&mbs, tight);
        let tree = Tree::new(&mbs);
        let mut q = q.clone();
        let pins: Vec<_> = mbs.subhinges().filter(|(_, s)| s.v.len() == 1).collect();
        if let Some((_, s)) = pins.first() {
            q[s.q.start] = 1.0;
        }
        let mut ik = InverseKinematics::new(&tree);
        ik.rates(&tree, &[RateTarget::new(node, V)], &q, &mut v).unwrap();
        for (i, (_, s)) in pins.iter().enumerate() {
            let x = v[s.v.start];
            assert!(x.abs() <= 0.2 && (i > 0 || x <= 0.0), "seed {seed}: {x}");
        }
        poses(&tree, &mut ws, &q);
        let mut J = vec![0.0; 6 * nv];
        node_jacobian(&tree, &ws, node, &mut J);
        let J = DMatrix::from_row_slice(6, nv, &J);
        let error = |v: &[f64]| (&b - &J * DVector::from_column_slice(v)).norm_squared();
        let now = error(&v);
        for j in 0..40 {
            let d = Rng(j).vec(nv);
            let mut other: Vec<f64> = v.iter().zip(&d).map(|(v, d)| v + 1e-3 * d).collect();
            for (i, (_, s)) in pins.iter().enumerate() {
                let high = if i == 0 { 0.0 } else { 0.2 };
                other[s.v.start] = other[s.v.start].clamp(-0.2, high);
            }
            let gain = now - error(&other);
            assert!(gain <= 1e-9, "seed {seed}: better rates exist, by {gain:e}");
        }
    }
    assert!(compared > 200, "{compared} seeds were compared");
}

#[test]
fn nothing_is_allocated_after_the_first_solve() {
    let (mbs, tip) = planar(0.7, 0.45, Limits::position(-2.5, 2.5));
    let tree = Tree::new(&mbs);
    let mut ik = InverseKinematics::new(&tree);
    let mut q = vec![0.1, 0.5];
    let goal = |x: f64| [Target::new(tip, Goal::position(Vec3::new(x, 0.4, 0.0)))];
    ik.solve(&tree, &goal(0.3), &mut q).unwrap();
    let counted = allocation_counter::measure(|| {
        for i in 0..10 {
            ik.solve(&tree, &goal(0.3 + 0.04 * f64::from(i)), &mut q).unwrap();
        }
    });
    assert_eq!(counted.count_total, 0);
}

#[test]
fn mistakes_are_refused() {
    let (mbs, tip) = planar(0.7, 0.45, Limits::NONE);
    let tree = Tree::new(&mbs);
    let mut ik = InverseKinematics::new(&tree);
    let start = vec![0.1, 0.5];
    let mut q = start.clone();
    let p = Vec3::new(0.5, 0.2, 0.0);
    let mut refused = |target: Target| ik.solve(&tree, &[target], &mut q).unwrap_err();
    let error = refused(Target::new(tip, Goal::position(Vec3::new(f64::NAN, 0.0, 0.0))));
    assert!(error.to_string().starts_with("target 0 (node `tip`) is NaN"), "{error}");
    let nan = Quat::new_unchecked(spatial::nalgebra::Quaternion::new(f64::NAN, 0.0, 0.0, 1.0));
    let error = refused(Target::new(tip, Goal::orientation(nan)));
    assert!(matches!(error, InverseKinematicsError::BadNumber { .. }));
    for weight in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        let error = refused(Target::new(tip, Goal::position(p).weights(weight, 1.0)));
        assert!(error.to_string().contains("a weight of target 0"), "{error}");
    }
    let nothing = Target::new(tip, Goal::NOTHING);
    assert!(matches!(refused(nothing), InverseKinematicsError::Empty { target: 0, .. }));
    let itself = Target::new(tip, Goal::position(p)).relative_to(tip);
    assert!(matches!(refused(itself), InverseKinematicsError::Empty { .. }));
    assert_eq!(q, start, "a refused target moves nothing");
    let mut bad = vec![0.0, f64::INFINITY];
    let error = ik.solve(&tree, &[Target::new(tip, Goal::position(p))], &mut bad).unwrap_err();
    assert!(error.to_string().starts_with("q[1] of the start is inf"), "{error}");
    let mut v = vec![0.0, f64::NAN];
    let still = RateTarget::new(tip, Motion::zero());
    assert!(ik.rates(&tree, &[still], &q, &mut v).is_err());
    let mut v = vec![0.0; 2];
    assert!(ik.rates(&tree, &[still.weights(-1.0, 1.0)], &q, &mut v).is_err());
    let fast = RateTarget::new(tip, Motion::new(Vec3::zeros(), Vec3::x() * f64::NAN));
    assert!(ik.rates(&tree, &[fast], &q, &mut v).is_err());
    // If no coordinate may move, the result reports that the goal is not reached.
    ik.keep(0..2);
    let error = ik.solve(&tree, &[Target::new(tip, Goal::position(p))], &mut q).unwrap_err();
    assert!(matches!(error, InverseKinematicsError::Unreachable { .. }));
    assert_eq!(q, start);
    ik.release(0..2);
    ik.solve(&tree, &[Target::new(tip, Goal::position(p))], &mut q).unwrap();
}

#[test]
#[should_panic(expected = "`q` has 1 numbers, the mechanism has 2")]
fn a_start_of_the_wrong_length_is_refused() {
    let (mbs, tip) = planar(0.7, 0.45, Limits::NONE);
    let tree = Tree::new(&mbs);
    let target = Target::new(tip, Goal::position(Vec3::x()));
    let _ = InverseKinematics::new(&tree).solve(&tree, &[target], &mut [0.0]);
}

#[test]
fn a_search_in_portions_is_the_search_and_rates_do_not_disturb_it() {
    for seed in 0..12 {
        let mbs = random_tree(
            seed,
            Shape { bodies: 8, floating: seed % 2 == 0, prescribed: false, armature: false },
        );
        let tree = Tree::new(&mbs);
        let (a, b) = (mbs.node("n02").unwrap(), mbs.node("n07").unwrap());
        let goal = mbs.random_q(seed + 7);
        let targets = [
            Target::new(b, Goal::pose(pose_of(&tree, &goal, b))),
            Target::new(a, Goal::position(pose_of(&tree, &goal, a).position)),
        ];
        let (mut whole, mut cut) = (InverseKinematics::new(&tree), InverseKinematics::new(&tree));
        (whole.effort.restarts, cut.effort.restarts) = (4, 4);
        let mut q = mbs.random_q(seed);
        let mut p = q.clone();
        whole.begin(&tree, &targets, &q).unwrap();
        let once = whole.advance(&tree, usize::MAX, &mut q);
        cut.begin(&tree, &targets, &p).unwrap();
        let mut v = vec![0.0; mbs.nv()];
        let mut progress = cut.advance(&tree, 2, &mut p);
        while let inverse_kinematics::Progress::Unfinished(_) = progress {
            let still = RateTarget::new(a, Motion::zero());
            cut.rates(&tree, &[still, still, still], &mbs.random_q(1), &mut v).unwrap();
            progress = cut.advance(&tree, 2, &mut p);
        }
        assert_eq!((once, q), (progress, p), "seed {seed}");
        assert_eq!(whole.residuals(), cut.residuals());
    }
}

#[test]
fn improvements_stay_on_the_targets_and_end_at_a_minimum() {
    let mut compared = 0;
    for seed in 0..40 {
        let mbs = random_tree(
            seed,
            Shape { bodies: 9, floating: seed % 2 == 0, prescribed: false, armature: false },
        );
        let tree = Tree::new(&mbs);
        let node = mbs.node("n08").unwrap();
        let q0 = mbs.random_q(seed);
        let target = Target::new(node, Goal::pose(pose_of(&tree, &q0, node)));
        let mut ik = InverseKinematics::new(&tree);
        ik.begin(&tree, &[target], &q0).unwrap();
        // Minimise half the squared distance to another configuration, on the manifold of the
        // targets.
        let far = mbs.random_q(seed + 100);
        let nv = mbs.nv();
        let mut objective = |q: &[f64], g: &mut [f64]| {
            let cost = |q: &[f64]| {
                let mut d = vec![0.0; nv];
                mbs.difference(&far, q, &mut d);
                0.5 * d.iter().map(|d| d * d).sum::<f64>()
            };
            let mut moved = q.to_vec();
            for i in 0..nv {
                let mut side = |h: f64| {
                    let mut step = vec![0.0; nv];
                    step[i] = h;
                    mbs.integrate(q, &step, &mut moved);
                    cost(&moved)
                };
                g[i] = (side(1e-6) - side(-1e-6)) / 2e-6;
            }
            cost(q)
        };
        let mut q = q0.clone();
        let mut g = vec![0.0; nv];
        let before = objective(&q, &mut g);
        let improved = ik.improve(&tree, &mut objective, &vec![1.0; nv], 3000, &mut q);
        let after = objective(&q, &mut g);
        assert!((improved.cost - after).abs() < 1e-12 && after <= before, "seed {seed}");
        let X = pose_of(&tree, &q, node);
        assert!((X.position - target.goal.position.unwrap()).norm() <= 1e-9, "seed {seed}");
        // The remaining gradient is in the row space of J.
        let mut ws = Workspace::new(&tree);
        poses(&tree, &mut ws, &q);
        let mut J = vec![0.0; 6 * nv];
        node_jacobian(&tree, &ws, node, &mut J);
        let J = DMatrix::from_row_slice(6, nv, &J);
        let values = J.clone().svd(false, false).singular_values;
        if values.min() < 1e-2 * values.max() {
            continue;
        }
        let g = DVector::from_column_slice(&g);
        let Some(JJ) = (&J * J.transpose()).cholesky() else { continue };
        compared += 1;
        let beside = &g - J.transpose() * JJ.solve(&(&J * &g));
        assert!(beside.norm() < 1e-4 * (1.0 + before), "seed {seed}: {:e}", beside.norm());
    }
    assert!(compared >= 10, "{compared} seeds were compared");
}

/// The error after one step is of third order in the initial distance: half the distance leaves an eighth. Gauss–Newton steps would leave a quarter.
#[test]
fn a_step_to_poses_in_the_world_is_of_third_order() {
    let turns = [
        Hinge::pin(Vec3::z()),
        Hinge::pin(Vec3::y()),
        Hinge::slider(Vec3::x()),
        Hinge::pin(Vec3::x()),
        Hinge::pin(Vec3::y()),
        Hinge::pin(Vec3::z()),
    ];
    let (mut b, mut r) = (Builder::new(), Rng(1));
    for (k, hinge) in turns.into_iter().enumerate() {
        let parent = if k == 0 { "world".to_string() } else { format!("b{}", k - 1) };
        let at = Pose::new(
            Quat::from_euler_angles(0.3 * k as f64, 0.2, -0.4),
            Vec3::new(0.3, -0.1, 0.2),
        );
        let body = BodySpec::new(format!("b{k}"), parent).hinge_in_parent(at);
        b.body(body.hinge(hinge).mass(r.mass()));
    }
    b.node("elbow", "b2", Pose::translation(0.1, 0.2, 0.3));
    b.node("tip", "b5", Pose::translation(0.2, 0.1, 0.4));
    let mbs = b.build().unwrap();
    let tree = Tree::new(&mbs);
    let [elbow, tip] = ["elbow", "tip"].map(|n| mbs.node(n).unwrap());
    let start = [0.3, -0.4, 0.2, 0.5, 0.7, -0.6];
    let way = [1.0, -0.7, 0.4, 0.8, -0.9, 0.6];
    let left = |targets: &dyn Fn(&[f64]) -> Vec<Target>, part: f64| {
        let goal: Vec<f64> = start.iter().zip(way).map(|(q, w)| q + part * w).collect();
        let mut ik = InverseKinematics::new(&tree);
        let mut q = start.to_vec();
        ik.begin(&tree, &targets(&goal), &q).unwrap();
        // The first call evaluates the start, and the second takes one step.
        ik.advance(&tree, 2, &mut q);
        let squares = ik.residuals().iter().map(|r| r.position.powi(2) + r.orientation.powi(2));
        squares.sum::<f64>().sqrt()
    };
    let pose = |q: &[f64]| vec![Target::new(tip, Goal::pose(pose_of(&tree, q, tip)))];
    let weighed =
        |q: &[f64]| vec![Target::new(tip, Goal::pose(pose_of(&tree, q, tip)).weights(3.0, 0.5))];
    let two = |q: &[f64]| {
        let [a, b] = [elbow, tip].map(|n| pose_of(&tree, q, n));
        vec![
            Target::new(elbow, Goal::position(a.position)),
            Target::new(tip, Goal::orientation(b.rotation)),
        ]
    };
    for (what, targets) in [
        ("pose", &pose as &dyn Fn(&[f64]) -> Vec<Target>),
        ("weighed", &weighed),
        ("two targets", &two),
    ] {
        let sizes = [0.04, 0.02, 0.01].map(|part| left(targets, part));
        let orders = [sizes[0] / sizes[1], sizes[1] / sizes[2]].map(f64::log2);
        println!("{what}: {sizes:?} left, orders {orders:?}");
        assert!((orders[1] - 3.0).abs() < 0.2, "{what}: {sizes:?}, {orders:?}");
    }
}
