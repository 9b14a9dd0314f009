//! The fully augmented solver compared with every constraint method of the constrained one: accelerations and constraint forces of random mechanisms.

use crate::dynamics_support::{Rng, Shape, close, random_tree};
use crate::mechanisms::{Case, SHAPES, case, driven};
use linkwork_dynamics::multibody::{
    BodySpec, Builder, ConstraintId, Coupling, Hinge, HingeCoordinate, LoopClosure, Multibody,
};
use linkwork_dynamics::spatial::{Force, MassProperties, Mat3, Pose, Vec3};
use linkwork_dynamics::{Tree, Workspace, forward_dynamics, kinematics};
use linkwork_solvers::{
    ConstrainedSolver, ConstraintMethod, FullyAugmentedError, FullyAugmentedSolver, Report,
    Stabilisation,
};

/// Accelerations, prescribed forces, forces of constraints, report.
type Answer = (Vec<f64>, Vec<f64>, Vec<f64>, Report);

fn constrained(c: &Case, constraint_method: impl Fn(ConstraintId) -> ConstraintMethod) -> Answer {
    let (mut ws, mut tau, mut vdot) = (c.ws.clone(), c.tau.clone(), c.vdot.clone());
    let mut s = ConstrainedSolver::new(&c.tree, constraint_method);
    let state = (&c.q[..], &c.v[..]);
    let report = s
        .forward_given_kinematics(&c.tree, &mut ws, state, &c.motions, &mut tau, &mut vdot)
        .unwrap();
    let forces = c.mbs.constraints().flat_map(|id| s.forces(&c.tree, id).to_vec()).collect();
    (vdot, tau, forces, report)
}

fn fully_augmented(c: &Case) -> Answer {
    let (mut tau, mut vdot) = (c.tau.clone(), c.vdot.clone());
    let mut s = FullyAugmentedSolver::new(&c.tree).unwrap();
    let state = (&c.q[..], &c.v[..]);
    let report =
        s.forward_given_kinematics(&c.tree, &c.ws, state, &c.motions, &mut tau, &mut vdot).unwrap();
    let forces = c.mbs.constraints().flat_map(|id| s.forces(&c.tree, id).to_vec()).collect();
    (vdot, tau, forces, report)
}

fn both(id: ConstraintId) -> ConstraintMethod {
    match id {
        ConstraintId::Loop(i) if i % 2 == 0 => ConstraintMethod::Embed,
        _ => ConstraintMethod::Augment,
    }
}

/// Compares to 1e-9 of the largest entry, or of 1 if loops permit no motion.
#[track_caller]
fn near(a: &[f64], b: &[f64], what: &str) {
    let scale = b.iter().fold(1.0_f64, |s, x| s.max(x.abs()));
    for (x, y) in a.iter().zip(b) {
        assert!((x - y).abs() <= 1e-9 * scale, "{what}:\n  {a:?}\n  {b:?}");
    }
}

/// Compares every constraint method with the fully augmented form. Returns the number of comparable cases.
fn compare(make: fn(u64, Shape, usize) -> Case, seeds: u64) -> (usize, usize) {
    let (mut compared, mut forces_compared) = (0, 0);
    for seed in 0..seeds {
        let c = make(seed, SHAPES[seed as usize % 3], 1 + seed as usize % 3);
        let (a, tau, forces, report) = fully_augmented(&c);
        let (ta, tau_ta, forces_ta, ta_report) = constrained(&c, |_| ConstraintMethod::Augment);
        if ta_report.contradiction > 1e-9 {
            assert!(report.contradiction > 1e-9, "seed {seed}: {report:?} {ta_report:?}");
            continue;
        }
        let lost = |r: &Report| r.rows - r.rank;
        assert_eq!(lost(&report), lost(&ta_report), "seed {seed}");
        let others = [
            ("augmented", (ta, tau_ta, forces_ta, ta_report)),
            ("embedded", constrained(&c, |_| ConstraintMethod::Embed)),
            ("both", constrained(&c, both)),
        ];
        for (name, (b, tau_b, forces_b, _)) in others {
            let what = |part: &str| format!("seed {seed}: {part}, {name}");
            near(&b, &a, &what("accelerations"));
            if lost(&ta_report) == 0 {
                close(&tau_b, &tau, 1e-9, &what("prescribed forces"));
                close(&forces_b, &forces, 1e-9, &what("constraint forces"));
                forces_compared += 1;
            }
        }
        compared += 1;
    }
    (compared, forces_compared)
}

#[test]
fn every_solver_agrees() {
    let (compared, forces) = compare(case, 90);
    assert!(compared > 60 && forces > 100, "only {compared}, {forces}");
}

#[test]
fn every_solver_agrees_with_driven_loops() {
    let (compared, forces) = compare(driven, 90);
    assert!(compared > 40 && forces > 100, "only {compared}, {forces}");
}

/// Rates that violate the constraints, so that every term of the rows' second derivatives matters.
#[test]
fn states_off_the_constraints_agree() {
    let mut compared = 0;
    for seed in 0..60 {
        let mut c = driven(seed, SHAPES[seed as usize % 2], 1);
        c.v = c.mbs.random_v(seed ^ 5);
        kinematics(&c.tree, &mut c.ws, &c.q, &c.v);
        c.ws.apply_uniform_gravity(Vec3::new(0.1, 0.2, -9.8));
        let (a, _, forces, report) = fully_augmented(&c);
        let (b, _, forces_b, _) = constrained(&c, |_| ConstraintMethod::Augment);
        if report.rank < report.rows {
            continue;
        }
        assert!(report.rate > 1e-3, "seed {seed}: {report:?}");
        near(&a, &b, &format!("seed {seed}: accelerations"));
        close(&forces, &forces_b, 1e-9, &format!("seed {seed}: forces"));
        compared += 1;
    }
    assert!(compared > 30, "only {compared}");
}

/// Without loops: compares with the articulated-body algorithm, including prescribed hinges and rotors.
#[test]
fn trees_agree_with_the_sweeps() {
    for seed in 0..40 {
        let shape = SHAPES[seed as usize % 3];
        let mbs = random_tree(seed, Shape { bodies: 30, ..shape });
        let tree = Tree::new(&mbs);
        let mut ws = Workspace::new(&tree);
        let (q, v, mut r) = (mbs.random_q(seed), mbs.random_v(seed), Rng(seed ^ 3));
        let (tau0, vdot0) = (r.vec(mbs.nv()), r.vec(mbs.nv()));
        kinematics(&tree, &mut ws, &q, &v);
        ws.apply_uniform_gravity(r.vec3() * 5.0);
        for n in mbs.node_ids() {
            ws.add_wrench_at_node(&tree, n, Force::new(r.vec3(), r.vec3()));
        }
        let mut solver = FullyAugmentedSolver::new(&tree).unwrap();
        let (mut tau, mut vdot) = (tau0.clone(), vdot0.clone());
        let state = (&q[..], &v[..]);
        let report =
            solver.forward_given_kinematics(&tree, &ws, state, &[], &mut tau, &mut vdot).unwrap();
        assert_eq!(report.rank, report.rows, "seed {seed}");
        let (blocks, factor) = solver.fill();
        assert!(blocks > 10 && blocks == factor, "seed {seed}: {blocks} {factor}");
        let (mut tau_want, mut vdot_want) = (tau0, vdot0);
        // The workspace keeps its forces when kinematics are computed again for the same state.
        forward_dynamics(&tree, &mut ws, &q, &v, &mut tau_want, &mut vdot_want).unwrap();
        close(&vdot, &vdot_want, 1e-9, &format!("seed {seed}: accelerations"));
        close(&tau, &tau_want, 1e-9, &format!("seed {seed}: prescribed forces"));
        for b in mbs.body_ids() {
            let com = mbs.get(b).inertia().com();
            let welded = mbs.bodies().iter().any(|c| c.v().is_empty() && c.parent() == Some(b));
            if welded || mbs.get(b).v().is_empty() {
                continue;
            }
            let (A, w) = (ws.body_acceleration(&tree, b), ws.body_velocity(&tree, b).angular);
            let arm = ws.body_pose(&tree, b).rotation * com;
            let a = A.linear + A.angular.cross(&arm) + w.cross(&w.cross(&arm));
            let got = solver.acceleration(b);
            let scale = 1.0 + a.norm() + A.angular.norm();
            assert!((got.linear - a).norm() < 1e-9 * scale, "seed {seed}");
            assert!((got.angular - A.angular).norm() < 1e-9 * scale, "seed {seed}");
        }
    }
}

/// Chains with a rotor on every other subhinge: torques of the others load the rotors.
#[test]
fn rotors_beside_plain_coordinates() {
    for seed in 0..20 {
        let mut b = Builder::from(&random_tree(seed, SHAPES[0]));
        for body in b.bodies_mut() {
            body.hinge.subhinges.iter_mut().skip(1).step_by(2).for_each(|s| s.armature = 0.0);
        }
        let mbs = b.build().unwrap();
        let tree = Tree::new(&mbs);
        let mut ws = Workspace::new(&tree);
        let (q, v, mut r) = (mbs.random_q(seed), mbs.random_v(seed), Rng(seed ^ 9));
        let tau0: Vec<f64> = r.vec(mbs.nv()).iter().map(|x| 10.0 * x).collect();
        let (mut tau, mut vdot, mut want) = (tau0, vec![0.0; mbs.nv()], vec![0.0; mbs.nv()]);
        let mut solver = FullyAugmentedSolver::new(&tree).unwrap();
        solver.forward(&tree, &mut ws, (&q, &v), &[], &mut tau, &mut vdot).unwrap();
        forward_dynamics(&tree, &mut ws, &q, &v, &mut tau, &mut want).unwrap();
        near(&vdot, &want, &format!("seed {seed}"));
    }
}

/// Baumgarte's terms agree, on loops and couplings.
#[test]
fn stabilised_alike() {
    for seed in [2, 3, 7] {
        let mut c = case(seed, SHAPES[1], 1);
        let dv: Vec<f64> = Rng(seed).vec(c.mbs.nv()).iter().map(|x| 1e-3 * x).collect();
        let q = c.q.clone();
        c.mbs.integrate(&q, &dv, &mut c.q);
        kinematics(&c.tree, &mut c.ws, &c.q, &c.v);
        let (mut tau, mut vdot) = (c.tau.clone(), c.vdot.clone());
        let held = Stabilisation::Baumgarte { frequency: 31.0, damping: 0.7 };
        let mut fa = FullyAugmentedSolver::new(&c.tree).unwrap();
        fa.stabilisation = held;
        let state = (&c.q[..], &c.v[..]);
        let a =
            fa.forward_given_kinematics(&c.tree, &c.ws, state, &[], &mut tau, &mut vdot).unwrap();
        let mut ta = ConstrainedSolver::new(&c.tree, |_| ConstraintMethod::Augment);
        ta.stabilisation = held;
        let (mut tau, mut want) = (c.tau.clone(), c.vdot.clone());
        let b = ta.forward_given_kinematics(&c.tree, &mut c.ws, state, &[], &mut tau, &mut want);
        let b = b.unwrap();
        close(&vdot, &want, 1e-9, &format!("seed {seed}"));
        assert!(a.error > 1e-5 && (a.error - b.error).abs() < 1e-13, "{a:?} {b:?}");
        assert!((a.rate - b.rate).abs() < 1e-12 * (1.0 + a.rate), "{a:?} {b:?}");
    }
}

fn four_bar(closing: Hinge) -> Multibody {
    let mut b = Builder::new();
    let parents = ["world", "l0", "l1"];
    for (i, parent) in parents.into_iter().enumerate() {
        let at = Pose::translation(if i == 0 { 0.0 } else { 1.0 }, 0.0, 0.0);
        let mass = MassProperties::new(1.0, Vec3::new(0.5, 0.0, 0.0), Mat3::identity() * 0.1);
        b.body(
            BodySpec::new(format!("l{i}"), parent)
                .hinge_in_parent(at)
                .hinge(Hinge::pin(Vec3::z()))
                .mass(mass),
        );
    }
    b.loop_closure(LoopClosure {
        name: "close".into(),
        body_a: "world".into(),
        frame_a: Pose::translation(1.0, 0.0, 0.0),
        body_b: "l2".into(),
        frame_b: Pose::translation(1.0, 0.0, 0.0),
        hinge: closing,
    });
    b.build().unwrap()
}

/// A planar four-bar linkage closed by a spatial pin: three of five rows are redundant, and the accelerations agree with the closure in the plane.
#[test]
fn repeated_rows_are_named_and_harmless() {
    let half = std::f64::consts::FRAC_PI_2;
    let (q, v) = ([half + 0.2, -half - 0.2, -half + 0.2], [0.3, -0.3, 0.3]);
    let mut answers = Vec::new();
    for (hinge, lost) in [
        (Hinge::pin(Vec3::z()), 3),
        (
            Hinge::chain([
                linkwork_dynamics::multibody::SubhingeKind::Slider { axis: Vec3::z() },
                linkwork_dynamics::multibody::SubhingeKind::Ball,
            ]),
            0,
        ),
    ] {
        let mbs = four_bar(hinge);
        let tree = Tree::new(&mbs);
        let mut ws = Workspace::new(&tree);
        kinematics(&tree, &mut ws, &q, &v);
        ws.apply_uniform_gravity(Vec3::new(0.0, -9.81, 0.0));
        let mut s = FullyAugmentedSolver::new(&tree).unwrap();
        let (mut tau, mut vdot) = ([0.1, 0.2, -0.3], [0.0; 3]);
        let report =
            s.forward_given_kinematics(&tree, &ws, (&q, &v), &[], &mut tau, &mut vdot).unwrap();
        assert_eq!(report.rows - report.rank, lost);
        assert!(report.contradiction < 1e-12, "{report:?}");
        let named: Vec<_> = s.redundant(&tree).iter().map(|r| (r.constraint, r.rows)).collect();
        let want: &[_] = if lost == 0 { &[] } else { &[(ConstraintId::Loop(0), 3)] };
        assert_eq!(named, want);
        answers.push(vdot);
    }
    close(&answers[0], &answers[1], 1e-12, "both closures");
    assert!(answers[0][0].abs() > 0.1);
}

#[test]
fn bodies_without_inertia_are_refused() {
    let mut b = Builder::new();
    let solid = MassProperties::new(1.0, Vec3::x(), Mat3::identity());
    b.body(BodySpec::new("base", "world").hinge(Hinge::pin(Vec3::z())).mass(solid));
    b.body(BodySpec::new("frame", "base").hinge_in_parent(Pose::translation(1.0, 0.0, 0.0)));
    b.body(BodySpec::new("bob", "frame").hinge(Hinge::pin(Vec3::z())).mass(MassProperties::new(
        2.0,
        Vec3::y(),
        Mat3::zeros(),
    )));
    let tree = Tree::new(&b.build().unwrap());
    let error = FullyAugmentedSolver::new(&tree).unwrap_err();
    assert_eq!(error, FullyAugmentedError::Inertia { body: "bob".into() });
    assert!(error.to_string().contains("`bob`") && error.to_string().contains("help:"), "{error}");
}

/// A gear between two hinges of one body's chain, one of them with a rotor: θ₀ = 3 θ₁.
#[test]
fn a_gear_within_one_hinge() {
    let mut b = Builder::new();
    let mut r = Rng(8);
    let mut hinge = Hinge::cylindrical(Vec3::z());
    hinge.subhinges[1].armature = 0.3;
    b.body(BodySpec::new("nut", "world").hinge(hinge).mass(r.mass()));
    let at = |subhinge| HingeCoordinate { body: "nut".into(), subhinge };
    b.coupling(Coupling::mimic("thread", at(0), at(1), 3.0, 0.0));
    let mbs = b.build().unwrap();
    let tree = Tree::new(&mbs);
    let mut ws = Workspace::new(&tree);
    let (q, v) = ([0.6, 0.2], [-1.5, -0.5]);
    kinematics(&tree, &mut ws, &q, &v);
    ws.apply_uniform_gravity(Vec3::new(1.0, 0.0, -9.81));
    let mut fa = FullyAugmentedSolver::new(&tree).unwrap();
    let mut ta = ConstrainedSolver::new(&tree, |_| ConstraintMethod::Augment);
    let (mut t, mut a) = ([0.3, 0.4], [0.0; 2]);
    fa.forward_given_kinematics(&tree, &ws, (&q, &v), &[], &mut t, &mut a).unwrap();
    let mut b = [0.0; 2];
    ta.forward_given_kinematics(&tree, &mut ws, (&q, &v), &[], &mut t, &mut b).unwrap();
    close(&a, &b, 1e-12, "accelerations");
    assert!((a[0] - 3.0 * a[1]).abs() < 1e-12 && a[1].abs() > 0.1);
    let id = ConstraintId::Coupling(0);
    close(fa.forces(&tree, id), ta.forces(&tree, id), 1e-11, "force");
}

#[test]
fn nothing_is_allocated() {
    let c = case(5, SHAPES[2], 3);
    let mut s = FullyAugmentedSolver::new(&c.tree).unwrap();
    let (mut tau, mut vdot) = (c.tau.clone(), c.vdot.clone());
    let info = allocation_counter::measure(|| {
        s.forward_given_kinematics(&c.tree, &c.ws, (&c.q, &c.v), &c.motions, &mut tau, &mut vdot)
            .unwrap();
    });
    assert_eq!(info.count_total, 0);
}
