//! Closed loops: every constraint method compared with every other, with force balance, and with finite differences.

use crate::dynamics_support::{Rng, close};
use crate::mechanisms::{Case, SHAPES, case, looped};
use linkwork_dynamics::multibody::{
    Anchor, BodySpec, Builder, ConstraintId, Coordinate, Coupling, Hinge, HingeCoordinate, Loop,
    LoopClosure, LoopMotion, LoopRow,
};
use linkwork_dynamics::spatial::{Force, Pose, Vec3};
use linkwork_dynamics::units::{RowSet, Units, UnitsWork};
use linkwork_dynamics::{Tree, Workspace, inverse_dynamics, kinematics};
use linkwork_solvers::{ConstrainedSolver, ConstraintMethod, Projector, Report};

/// Solves forward dynamics; returns the accelerations, the forces (computed at prescribed coordinates), the solver and its report.
fn solve(
    c: &Case,
    constraint_method: impl Fn(ConstraintId) -> ConstraintMethod,
) -> (Vec<f64>, Vec<f64>, ConstrainedSolver, Report) {
    let (mut ws, mut tau, mut vdot) = (c.ws.clone(), c.tau.clone(), c.vdot.clone());
    let mut solver = ConstrainedSolver::new(&c.tree, constraint_method);
    let report = solver
        .forward_given_kinematics(&c.tree, &mut ws, (&c.q, &c.v), &[], &mut tau, &mut vdot)
        .unwrap();
    (vdot, tau, solver, report)
}

fn both(id: ConstraintId) -> ConstraintMethod {
    match id {
        ConstraintId::Loop(i) if i % 2 == 0 => ConstraintMethod::Embed,
        _ => ConstraintMethod::Augment,
    }
}

type Choice = fn(ConstraintId) -> ConstraintMethod;

const TREATMENTS: [(&str, Choice); 3] = [
    ("augmented", |_| ConstraintMethod::Augment),
    ("embedded", |_| ConstraintMethod::Embed),
    ("both", both),
];

#[test]
fn constraint_methods_agree() {
    let mut compared = 0;
    for seed in 0..60 {
        let c = case(seed, SHAPES[seed as usize % 3], 1 + seed as usize % 3);
        let (a, tau_a, _, report) = solve(&c, |_| ConstraintMethod::Augment);
        if report.contradiction > 1e-9 {
            continue; // over-constrained: no motion satisfies it
        }
        let what = |t: &str| format!("seed {seed}: {t}");
        let (b, tau_b, ..) = solve(&c, |_| ConstraintMethod::Embed);
        close(&b, &a, 1e-9, &what("embedded"));
        let (m, tau_m, ..) = solve(&c, both);
        close(&m, &a, 1e-9, &what("both"));
        let (n, ..) = solve(&c, |_| ConstraintMethod::Auto);
        close(&n, &a, 1e-9, &what("by rule"));
        if report.rank == report.rows {
            // If no row is redundant, the forces are unique.
            close(&tau_b, &tau_a, 1e-8, &what("prescribed forces, embedded"));
            close(&tau_m, &tau_a, 1e-8, &what("prescribed forces, both"));
        }
        compared += 1;
    }
    assert!(compared > 40, "only {compared} mechanisms could be compared");
}

/// Constraint forces applied as wrenches on bodies balance the inverse dynamics of the tree.
#[test]
fn forces_balance() {
    for seed in 0..40 {
        let c = case(seed, SHAPES[seed as usize % 3], 1 + seed as usize % 2);
        for (name, t) in TREATMENTS {
            let (vdot, tau, mut solver, report) = solve(&c, t);
            if report.contradiction > 1e-9 {
                continue;
            }
            let (mut ws, mut want) = (c.ws.clone(), tau.clone());
            for id in c.mbs.constraints() {
                let lambda = solver.forces(&c.tree, id);
                match id {
                    ConstraintId::Coupling(i) => {
                        for (_, v, f) in &c.mbs.couplings()[i as usize].terms {
                            want[*v] += f * lambda[0];
                        }
                    }
                    ConstraintId::Loop(i) => {
                        apply_loop(&c, &c.mbs.loops()[i as usize], lambda, &mut ws);
                    }
                }
            }
            let mut got = vec![0.0; c.mbs.nv()];
            // The workspace still contains the forces that were added at this state.
            inverse_dynamics(&c.tree, &mut ws, &c.q, &c.v, &vdot, &mut got);
            close(&got, &want, 1e-9, &format!("seed {seed}, {name}"));
        }
    }
}

fn apply_loop(c: &Case, l: &Loop, lambda: &[f64], ws: &mut Workspace) {
    let pose =
        |a: &Anchor| a.body.map_or_else(Pose::identity, |b| c.ws.body_pose(&c.tree, b)) * a.pose;
    let (A, B) = (pose(&l.a), pose(&l.b));
    let w = wrench(l, &A, &B, lambda);
    for (body, sign) in [(l.a.body, -1.0), (l.b.body, 1.0)] {
        let Some(body) = body else { continue };
        let arm = B.position - c.ws.body_pose(&c.tree, body).position;
        let moment = w.moment + arm.cross(&w.force);
        ws.add_wrench_at_body(&c.tree, body, Force::new(moment * sign, w.force * sign));
    }
}

/// Returns Σ λ times each row's wrench about B's origin, from the rows' definitions.
fn wrench(l: &Loop, A: &Pose, B: &Pose, lambda: &[f64]) -> Force {
    let mut out = Force::new(Vec3::zeros(), Vec3::zeros());
    for (row, x) in l.rows.iter().zip(lambda) {
        match row {
            LoopRow::Slide { axis, .. } => out.force += A.rotation * axis * *x,
            LoopRow::Across { a, b, .. } => {
                out.moment += (B.rotation * b).cross(&(A.rotation * a)) * *x;
            }
            LoopRow::Turn { axis, .. } => out.moment += A.rotation * axis * *x,
            LoopRow::Screw { axis, pitch, .. } => {
                out.force += A.rotation * axis * *x;
                out.moment -= A.rotation * axis * (pitch * *x);
            }
        }
    }
    out
}

/// A row's rate is the derivative of its error; its bias plus the effect of the forces is the derivative of its rate.
#[test]
fn rows_are_derivatives() {
    for seed in 0..30 {
        let c = case(seed, SHAPES[seed as usize % 2], 2);
        let units = Units::new(&c.tree, |_| ConstraintMethod::Augment);
        let mut uw = UnitsWork::new(&c.tree, &units);
        let (mut tau, mut vdot) = (c.tau.clone(), vec![0.0; c.mbs.nv()]);
        let mut ws = c.ws.clone();
        units.gather(&c.tree, &mut ws, &mut uw, &tau, &vdot, &[]).unwrap();
        let rows_of = |ws: &Workspace, uw: &UnitsWork, q: &[f64], v: &[f64]| {
            let mut rows = RowSet::default();
            rows.clear();
            for id in c.mbs.constraints() {
                rows.add_constraint(&c.tree, &units, ws, uw, id, &[], (q, v));
            }
            rows.groups().to_vec()
        };
        let now = rows_of(&ws, &uw, &c.q, &c.v);
        units.scatter(&c.tree, &mut ws, &mut uw, &[], &mut tau, &mut vdot);
        let mut at = |h: f64| {
            let moved = |x: f64| c.v.iter().zip(&vdot).map(move |(v, a)| x * v + 0.5 * x * x * a);
            let dv: Vec<f64> = moved(h).collect();
            let v: Vec<f64> = c.v.iter().zip(&vdot).map(|(v, a)| v + h * a).collect();
            let mut q = c.q.clone();
            c.mbs.integrate(&c.q, &dv, &mut q);
            kinematics(&c.tree, &mut ws, &q, &v);
            let zeros = vec![0.0; c.mbs.nv()];
            units.gather(&c.tree, &mut ws, &mut uw, &zeros, &zeros, &[]).unwrap();
            rows_of(&ws, &uw, &q, &v)
        };
        let h = 1e-5;
        let (plus, minus) = (at(h), at(-h));
        for ((now, p), m) in now.iter().zip(&plus).zip(&minus) {
            for i in 0..now.n {
                let rate = (p.error[i] - m.error[i]) / (2.0 * h);
                let second = (p.rate[i] - m.rate[i]) / (2.0 * h);
                let want = now.free[i] + now.bias[i];
                let scale = 1.0 + want.abs();
                assert!(now.error[i].abs() < 1e-12, "seed {seed}: error {}", now.error[i]);
                assert!((rate - now.rate[i]).abs() < 1e-6 * scale, "seed {seed}: rate");
                assert!((second - want).abs() < 1e-6 * scale, "seed {seed}: {second} {want}");
            }
        }
    }
}

/// Loops stay closed: the error after a small step of second order is of third order.
#[test]
fn motion_stays_on_the_constraints() {
    let mut seen = 0;
    for seed in 0..20 {
        let c = case(seed, SHAPES[seed as usize % 2], 2);
        let (vdot, _, _, report) = solve(&c, |_| ConstraintMethod::Embed);
        if report.contradiction > 1e-9 {
            continue;
        }
        let error = |h: f64| {
            let dv: Vec<f64> =
                c.v.iter().zip(&vdot).map(|(v, a)| h * v + 0.5 * h * h * a).collect();
            let mut q = c.q.clone();
            c.mbs.integrate(&c.q, &dv, &mut q);
            let mut solver = ConstrainedSolver::new(&c.tree, |_| ConstraintMethod::Augment);
            let mut p = Projector::new(&c.tree);
            p.tolerance = f64::MAX;
            let mut ws = Workspace::new(&c.tree);
            p.positions(&c.tree, &mut ws, &mut solver, &[], &mut q).unwrap().error
        };
        let (coarse, fine) = (error(2e-4), error(1e-4));
        let order = (coarse / fine).log2();
        assert!(order > 2.7 || fine < 1e-11, "seed {seed}: order {order}, {coarse:e} {fine:e}");
        seen += 1;
    }
    assert!(seen > 10);
}

/// Rates are projected onto the constraints with each method, including rows on members of embedded loops.
#[test]
fn rates_are_closed() {
    for seed in 0..40 {
        let mut c = case(seed, SHAPES[seed as usize % 2], 3);
        let (.., report) = solve(&c, |_| ConstraintMethod::Augment);
        if report.contradiction > 1e-9 {
            continue;
        }
        for (name, t) in TREATMENTS {
            let mut solver = ConstrainedSolver::new(&c.tree, t);
            let mut v = c.mbs.random_v(seed ^ 31);
            let (tree, q) = (&c.tree, &c.q);
            let mut p = Projector::new(tree);
            let before = p.rates(tree, &mut c.ws, &mut solver, &[], q, &mut v).unwrap();
            assert!(before > 1e-3, "seed {seed}, {name}");
            let left = Projector::new(tree).rates(
                tree,
                &mut c.ws,
                &mut ConstrainedSolver::new(tree, |_| ConstraintMethod::Augment),
                &[],
                q,
                &mut v,
            );
            let left = left.unwrap();
            assert!(left < 1e-10 * (1.0 + before), "seed {seed}, {name}: {left:e}");
        }
    }
}

/// From an open start, every method finds a closed configuration, with second-order convergence.
#[test]
fn open_loops_are_closed() {
    let mut closed = 0;
    for seed in 0..40 {
        let (mbs, q0) = looped(seed, SHAPES[seed as usize % 2], 2);
        let tree = Tree::new(&mbs);
        let dv: Vec<f64> = Rng(seed ^ 99).vec(mbs.nv()).iter().map(|x| 0.02 * x).collect();
        for t in [ConstraintMethod::Augment, ConstraintMethod::Embed, ConstraintMethod::Auto] {
            let mut q = q0.clone();
            mbs.integrate(&q0, &dv, &mut q);
            let mut ws = Workspace::new(&tree);
            let mut solver = ConstrainedSolver::new(&tree, |_| t);
            let mut p = Projector::new(&tree);
            if let Ok(done) = p.positions(&tree, &mut ws, &mut solver, &[], &mut q) {
                assert!(done.before > 1e-5 && done.steps <= 12, "seed {seed} {t:?}: {done:?}");
                closed += 1;
            }
        }
    }
    assert!(closed > 100, "{closed} of 120 closed");
}

/// A prescribed slider in a loop drives it: the other end follows u(t).
#[test]
fn prescribed_loop_hinges_drive() {
    let mut r = Rng(4);
    let mut b = Builder::new();
    for (i, parent) in ["world", "a0", "a1"].iter().enumerate() {
        b.body(
            BodySpec::new(format!("a{i}"), *parent)
                .hinge(Hinge::pin(Vec3::y()))
                .hinge_in_parent(Pose::translation(0.4 + 0.1 * i as f64, 0.0, 0.1))
                .mass(r.mass()),
        );
    }
    let mut hinge = Hinge::planar();
    hinge.subhinges[0].coordinate = Coordinate::Prescribed;
    b.loop_closure(LoopClosure {
        name: "drive".into(),
        body_a: "world".into(),
        // The x and y axes of the frame, in the plane of the mechanism, are the world's x and −z.
        frame_a: Pose::rotation(linkwork_dynamics::spatial::Quat::from_axis_angle(
            &Vec3::x_axis(),
            -std::f64::consts::FRAC_PI_2,
        )),
        body_b: "a2".into(),
        frame_b: Pose::new(
            linkwork_dynamics::spatial::Quat::from_axis_angle(
                &Vec3::x_axis(),
                -std::f64::consts::FRAC_PI_2,
            ),
            Vec3::new(0.3, 0.0, -0.2),
        ),
        hinge,
    });
    let mbs = b.build().unwrap();
    assert_eq!(mbs.motions(), 1);
    let tree = Tree::new(&mbs);
    let mut ws = Workspace::new(&tree);
    let drive = LoopMotion { position: 1.05, rate: 0.3, acceleration: -0.7 };
    let mut answers = Vec::new();
    for t in [ConstraintMethod::Augment, ConstraintMethod::Embed] {
        let mut solver = ConstrainedSolver::new(&tree, |_| t);
        let mut p = Projector::new(&tree);
        let (mut q, mut v) = (vec![0.6, 0.5, 0.4], vec![0.2, 0.1, -0.3]);
        let mut closer = ConstrainedSolver::new(&tree, |_| ConstraintMethod::Augment);
        p.positions(&tree, &mut ws, &mut closer, &[drive], &mut q).unwrap();
        p.rates(&tree, &mut ws, &mut closer, &[drive], &q, &mut v).unwrap();
        let (mut tau, mut vdot) = (vec![0.1, 0.2, -0.1], vec![0.0; 3]);
        solver.forward(&tree, &mut ws, (&q, &v), &[drive], &mut tau, &mut vdot).unwrap();
        let end = mbs.body("a2").unwrap();
        let (X, V) = (ws.body_pose(&tree, end), ws.body_velocity(&tree, end));
        let A = ws.body_acceleration(&tree, end);
        let arm = X.rotation * Vec3::new(0.3, 0.0, -0.2);
        let a = A.linear + A.angular.cross(&arm) + V.angular.cross(&V.angular.cross(&arm));
        assert!((X.position.x + arm.x - 1.05).abs() < 1e-12);
        assert!(((V.linear + V.angular.cross(&arm)).x - 0.3).abs() < 1e-12);
        assert!((a.x + 0.7).abs() < 1e-11, "{t:?} {a}");
        answers.push(vdot);
    }
    close(&answers[0], &answers[1], 1e-10, "both constraint_methods");
}

/// A loop that closes by an inelastic impact: rates jump onto the constraints, and the energy lost equals the energy of the jump (Carnot).
#[test]
fn loops_close_by_inelastic_impacts() {
    let mut lost = 0.0_f64;
    for seed in 0..30 {
        let (mbs, q) = looped(seed, SHAPES[seed as usize % 2], 1 + seed as usize % 2);
        let tree = Tree::new(&mbs);
        let mut ws = Workspace::new(&tree);
        let before = mbs.random_v(seed);
        let energy = |ws: &mut Workspace, v: &[f64]| {
            kinematics(&tree, ws, &q, v);
            linkwork_dynamics::kinetic_energy(&tree, ws, v)
        };
        let mut after = before.clone();
        let mut solver = ConstrainedSolver::new(&tree, |_| ConstraintMethod::Augment);
        let mut projector = Projector::new(&tree);
        let speed = projector.rates(&tree, &mut ws, &mut solver, &[], &q, &mut after).unwrap();
        let again = projector.rates(&tree, &mut ws, &mut solver, &[], &q, &mut after).unwrap();
        assert!(speed > 1e-2 && again < 1e-9 * (1.0 + speed), "seed {seed}: {speed} {again}");
        let jump: Vec<f64> = before.iter().zip(&after).map(|(b, a)| b - a).collect();
        let (T0, T1, T) =
            (energy(&mut ws, &before), energy(&mut ws, &after), energy(&mut ws, &jump));
        assert!((T0 - T1 - T).abs() < 1e-9 * T0, "seed {seed}: {T0} {T1} {T}");
        lost = lost.max(T / T0);
    }
    assert!(lost > 0.1, "{lost}");
}

/// A solver whose embedded loop had another mobility gives results bit-identical with a new one: cranks and coupler in one line have two independent
/// rates, otherwise one. A coupling through the loop is a row, and so are the entries that it shares with itself.
#[test]
fn mobility_may_change_from_state_to_state() {
    let mut b = Builder::new();
    let mut r = Rng(5);
    let places = [("crank", "world", 0.0), ("coupler", "crank", 0.5), ("rocker", "world", 1.0)];
    for (name, parent, x) in places.into_iter().chain([("bob", "coupler", 0.3)]) {
        let at = Pose::translation(x, 0.0, 0.0);
        let body = BodySpec::new(name, parent).hinge_in_parent(at).hinge(Hinge::pin(Vec3::y()));
        b.body(body.mass(r.mass()));
    }
    b.loop_closure(LoopClosure {
        name: "loop".into(),
        body_a: "coupler".into(),
        frame_a: Pose::translation(1.0, 0.0, 0.0),
        body_b: "rocker".into(),
        frame_b: Pose::translation(0.5, 0.0, 0.0),
        hinge: Hinge::ball(),
    });
    let at = |body: &str| HingeCoordinate { body: body.into(), subhinge: 0 };
    b.coupling(Coupling::mimic("gear", at("bob"), at("crank"), 0.7, 0.0));
    let mbs = b.build().unwrap();
    let tree = Tree::new(&mbs);
    let choice = |c: ConstraintId| match c {
        ConstraintId::Loop(_) => ConstraintMethod::Embed,
        ConstraintId::Coupling(_) => ConstraintMethod::Augment,
    };
    let q = |angle: f64| {
        let angles = [("crank", angle), ("coupler", -angle), ("rocker", angle)];
        let mut q = mbs.neutral_q();
        for (name, x) in angles.into_iter().chain([("bob", 0.7 * angle)]) {
            q[mbs.bodies()[mbs.body(name).unwrap().index()].q().start] = x;
        }
        q
    };
    let run = |solver: &mut ConstrainedSolver, angle: f64| {
        let (mut ws, v) = (Workspace::new(&tree), vec![0.0; mbs.nv()]);
        let (mut tau, mut vdot) = (Rng(9).vec(mbs.nv()), v.clone());
        let state = (&q(angle)[..], &v[..]);
        solver.forward(&tree, &mut ws, state, &[], &mut tau, &mut vdot).unwrap();
        let units = Units::new(&tree, choice);
        let mut uw = UnitsWork::new(&tree, &units);
        units.gather(&tree, &mut ws, &mut uw, &tau, &vdot, &[]).unwrap();
        (vdot, uw.mobility().collect::<Vec<usize>>())
    };
    let mut old = ConstrainedSolver::new(&tree, choice);
    for (angle, mobility) in [(0.6, 1), (0.0, 2), (-0.4, 1)] {
        let (got, n) = run(&mut old, angle);
        assert_eq!(n, [mobility], "at {angle}");
        let (want, _) = run(&mut ConstrainedSolver::new(&tree, choice), angle);
        assert!(want.iter().all(|x| x.is_finite()));
        assert_eq!(got, want, "at {angle}");
    }
}
