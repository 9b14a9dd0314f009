//! Control of chains: rates by priority within limits, impedance; momentum and composite inertias including held objects.

use crate::support::{Rng, difference};
use linkwork_embedded::multibody::{BodySpec, Builder, Hinge, Limits};
use linkwork_embedded::spatial::{Force, MassProperties, Mat3, Motion, Pose, Quat, Vec3};
use linkwork_embedded::*;
use std::sync::Arc;

/// Seven hinges without symmetry on a rotating base, and a cup.
fn arm() -> Arc<RobotModel> {
    let (mut mechanism, mut rng) = (Builder::new(), Rng(17));
    for k in 0..7 {
        let axis = [Vec3::z(), Vec3::y(), Vec3::x()][k % 3];
        let tilt = Vec3::from_fn(|_, _| rng.within(-0.2, 0.2));
        let limits = Limits { rate: 3.0, effort: 50.0, ..Limits::position(-2.5, 2.5) };
        let inertia = Mat3::from_diagonal(&Vec3::new(0.012, 0.017, 0.015));
        let mass = MassProperties::new(1.5 - 0.1 * k as f64, Vec3::new(0.01, 0.02, 0.1), inertia);
        let parent = if k == 0 { "world".to_owned() } else { format!("l{}", k - 1) };
        let hinge = Hinge::pin((axis + tilt).normalize()).limits(limits);
        let body = BodySpec::new(format!("l{k}"), parent).hinge(hinge).mass(mass);
        mechanism.body(body.hinge_in_parent(Pose::translation(0.02, -0.01, 0.2)));
    }
    let parts =
        vec![PartSpec::chain("arm", "world", "l6"), PartSpec::chain("elbow", "world", "l3")];
    let mass = MassProperties::new(0.8, Vec3::new(0.03, 0.02, 0.1), Mat3::identity() * 0.004);
    let objects = vec![ObjectSpec { name: "cup".into(), mass }];
    RobotModel::new(&ModelSpec { mechanism, parts, objects, ..ModelSpec::default() }).unwrap()
}

const Q: [f64; 7] = [0.3, -0.6, 0.8, 1.1, -0.4, 0.7, 0.2];
const NO_GUARD: Guards<'static> = Guards { horizon: 0.1, manipulable: &[] };

fn tip(part: Part, motion: Motion, rows: Rows) -> Aim<'static> {
    Aim::Tip { part, motion, rows }
}

fn twist_of(robot: &mut Robot, part: Part, v: &[f64]) -> [f64; 6] {
    let nv = v.len();
    let mut J = vec![0.0; 6 * nv];
    robot.whole_jacobian(part, &mut J).unwrap();
    std::array::from_fn(|i| (0..nv).map(|j| J[nv * i + j] * v[j]).sum())
}

#[test]
fn a_tip_moves_as_asked_and_what_is_left_moves_the_elbow() {
    let model = arm();
    let (arm, elbow) = (model.part("arm").unwrap(), model.part("elbow").unwrap());
    let mut robot = Robot::new(&model);
    robot.set_q(&Q).unwrap();
    let mut control = RateControl::new(&robot, 3, 1);
    let motion = Motion::new(Vec3::new(0.1, -0.2, 0.15), Vec3::new(0.05, 0.1, -0.08));
    let (mut v, mut left) = ([0.0; 7], [0.0; 3]);
    let first = Objective::new(0, tip(arm, motion, Rows::All { length: 1.0 }));
    control.solve(&mut robot, &[first], &NO_GUARD, &mut v, &mut left).unwrap();
    let asked = [0.1, -0.2, 0.15, 0.05, 0.1, -0.08];
    assert!(difference(&twist_of(&mut robot, arm, &v), &asked) < 1e-9 && left[0] < 1e-9);
    // A single task within the limits gives the minimum-norm rates, which another solver computes.
    let mut least = [0.0; 7];
    robot.rates(arm, &motion, &mut least).unwrap();
    assert!(difference(&v, &least) < 1e-6, "{v:?} {least:?}");
    // The elbow moves along as far as the tip allows.
    let up = Motion::new(Vec3::zeros(), Vec3::new(0.0, 0.0, 0.03));
    let second = Objective::new(5, tip(elbow, up, Rows::Linear));
    control.solve(&mut robot, &[second, first], &NO_GUARD, &mut v, &mut left).unwrap();
    assert!(difference(&twist_of(&mut robot, arm, &v), &asked) < 1e-8);
    let before = twist_of(&mut robot, elbow, &least);
    let after = twist_of(&mut robot, elbow, &v);
    let off = |x: &[f64; 6]| x[3].hypot(x[4]).hypot(x[5] - 0.03);
    assert!(off(&after) < off(&before) - 1e-5 && (left[1] - off(&after)).abs() < 1e-9);
    // In the other order, the elbow gets its full task.
    let [first, second] = [Objective { level: 9, ..first }, second];
    control.solve(&mut robot, &[first, second], &NO_GUARD, &mut v, &mut left).unwrap();
    assert!(off(&twist_of(&mut robot, elbow, &v)) < 1e-9);
}

/// A tip is pulled away for four seconds: all coordinates stay within their limits, rates within theirs, and the guarded manipulability above its
/// minimum. Without the guards both are violated.
#[test]
fn limits_and_singular_configurations_are_kept_away_from() {
    let model = arm();
    let part = model.part("arm").unwrap();
    let mut robot = Robot::new(&model);
    robot.set_q(&Q).unwrap();
    let begin = robot.manipulability(part, Rows::All { length: 1.0 }, None).unwrap().w;
    let (least, dt) = (0.5 * begin, 0.01);
    let mut drive = |guarded: bool, direction: Vec3| {
        robot.set_q(&Q).unwrap();
        let mut control = RateControl::new(&robot, 1, 1);
        let guard = [(part, least)];
        let manipulable: &[(Part, f64)] = if guarded { &guard } else { &[] };
        let guards = Guards { horizon: 0.05, manipulable };
        let (mut v, mut left, mut q) = ([0.0; 7], [0.0; 1], Q);
        let (mut w, mut far, mut fast) = (f64::INFINITY, 0.0_f64, 0.0_f64);
        for _ in 0..400 {
            let motion = Motion::new(Vec3::zeros(), direction);
            let objective = Objective::new(0, tip(part, motion, Rows::Linear));
            control.solve(&mut robot, &[objective], &guards, &mut v, &mut left).unwrap();
            q.iter_mut().zip(&v).for_each(|(q, v)| *q += dt * v);
            robot.set_q(&q).unwrap();
            w = w.min(robot.manipulability(part, Rows::All { length: 1.0 }, None).unwrap().w);
            far = q.iter().fold(far, |m, x| m.max(x.abs()));
            fast = v.iter().fold(fast, |m, x| m.max(x.abs()));
        }
        (w, far, fast)
    };
    let mut fell = 0;
    for direction in
        [Vec3::new(0.3, 0.3, 0.6), Vec3::new(-0.5, 0.2, -0.3), Vec3::new(0.0, 0.9, 0.1)]
    {
        let (w, far, fast) = drive(true, direction);
        assert!(far <= 2.5 + 1e-9 && fast <= 3.0 + 1e-9, "{far} {fast}");
        assert!(w > 0.95 * least, "{w}");
        let (bare, far, _) = drive(false, direction);
        assert!(far <= 2.5 + 1e-9);
        fell += usize::from(bare < 0.5 * least);
        println!("w {w:.4} guarded, {bare:.5} not");
    }
    assert!(fell > 0, "no drive needs the guard");
}

#[test]
fn bad_guards_and_wishes_are_refused() {
    let model = arm();
    let part = model.part("arm").unwrap();
    let mut robot = Robot::new(&model);
    let mut control = RateControl::new(&robot, 1, 1);
    let (mut v, mut left) = ([0.0; 7], [0.0; 1]);
    let objective = Objective::new(0, tip(part, Motion::zero(), Rows::Linear));
    let mut say = |robot: &mut Robot, w: &[Objective<'_>], g: &Guards<'_>, left: &mut [f64]| {
        control.solve(robot, w, g, &mut v, left).unwrap_err().to_string()
    };
    let zero = Guards { horizon: 0.0, ..NO_GUARD };
    assert!(say(&mut robot, &[objective], &zero, &mut left).contains("horizon"));
    assert!(say(&mut robot, &[objective, objective], &NO_GUARD, &mut left).contains("reserved"));
    assert!(say(&mut robot, &[objective], &NO_GUARD, &mut []).contains("residuals"));
    let bad = Objective::new(0, tip(part, Motion::zero(), Rows::All { length: 0.0 }));
    assert!(say(&mut robot, &[bad], &NO_GUARD, &mut left).contains("length"));
    let many = [(part, 0.1), (part, 0.1)];
    let two = Guards { manipulable: &many, ..NO_GUARD };
    assert!(say(&mut robot, &[objective], &two, &mut left).contains("reserved"));
    let nan = [(part, f64::NAN)];
    assert!(
        say(&mut robot, &[objective], &Guards { manipulable: &nan, ..NO_GUARD }, &mut left)
            .contains("NaN")
    );
    // A coordinate outside its limits returns, independent of the task.
    let mut q = Q;
    q[2] = 2.7;
    robot.set_q(&q).unwrap();
    let far = Objective::new(0, Aim::Posture(&[1.0; 7]));
    control.solve(&mut robot, &[far], &NO_GUARD, &mut v, &mut left).unwrap();
    assert!((v[2] + 2.0).abs() < 1e-9, "{v:?}: −0.2/0.1 s");
    // At any distance, it returns at its full rate; below the limits as above.
    for (q2, back) in [(2.9, -3.0), (40.0, -3.0), (-40.0, 3.0)] {
        q[2] = q2;
        robot.set_q(&q).unwrap();
        control.solve(&mut robot, &[far], &NO_GUARD, &mut v, &mut left).unwrap();
        assert!((v[2] - back).abs() < 1e-9, "{v:?}: {back} rad/s from {q2}");
    }
}

/// Impedance at the tip: at rest only the spring forces, whose work equals the change of the spring's energy; the tip accelerates by Λ⁻¹ (K e + D ė).
#[test]
fn a_tip_is_the_spring_that_it_was_told_to_be() {
    let model = arm();
    let (part, nv) = (model.part("arm").unwrap(), model.nv());
    let mut robot = Robot::new(&model);
    robot.set_q(&Q).unwrap();
    robot.grasp(part, model.object("cup").unwrap(), Grasp::Here).unwrap();
    let mut space = TaskSpace::new(&robot, &[part]).unwrap();
    let X = robot.tip_pose(part).unwrap();
    let away = Pose::new(
        Quat::from_scaled_axis(Vec3::new(0.1, -0.05, 0.2)) * X.rotation,
        X.position + Vec3::new(0.02, -0.03, 0.01),
    );
    let mut spring = Impedance::at(away, [20.0, 400.0], [0.05, 2.0]);
    assert!(
        (spring.damping[0] - 2.0).abs() < 1e-12
            && (spring.damping[5] - 3200f64.sqrt()).abs() < 1e-9
    );
    spring.stiffness = [20.0, 15.0, 25.0, 400.0, 300.0, 500.0];
    let (mut tau, mut g, rest) = (vec![0.0; nv], vec![0.0; nv], vec![0.0; nv]);
    let mut at_rest = |robot: &mut Robot, spring: &Impedance| {
        // At rest, J̇ v and the inertia have no influence if the tip does not accelerate, so the forces balance an
        // external wrench K e.
        space.impedance(robot, &rest, &[*spring], None, &mut tau).unwrap();
        tau.clone()
    };
    let told = at_rest(&mut robot, &spring);
    robot.gravity_forces(&mut g).unwrap();
    let turn = (away.rotation * X.rotation.inverse()).scaled_axis();
    let shift = away.position - X.position;
    let K = spring.stiffness;
    let moment = Vec3::new(K[0] * turn.x, K[1] * turn.y, K[2] * turn.z);
    let force = Vec3::new(K[3] * shift.x, K[4] * shift.y, K[5] * shift.z);
    let mut pushed = vec![0.0; nv];
    robot.held_still(&[Push::new(part, moment, force)], &mut pushed).unwrap();
    assert!(difference(&told, &pushed) < 1e-9, "τ = g + Jᵀ K e");
    // The translational force is minus the gradient of the energy.
    let soft = Impedance { stiffness: [0.0, 0.0, 0.0, 400.0, 300.0, 500.0], ..spring };
    let told = at_rest(&mut robot, &soft);
    let energy = |robot: &mut Robot, q: &[f64]| {
        robot.set_q(q).unwrap();
        let e = away.position - robot.tip_pose(part).unwrap().position;
        0.5 * (400.0 * e.x * e.x + 300.0 * e.y * e.y + 500.0 * e.z * e.z)
    };
    for j in 0..nv {
        let (mut a, mut b) = (Q, Q);
        (a[j], b[j]) = (Q[j] - 1e-6, Q[j] + 1e-6);
        let slope = (energy(&mut robot, &b) - energy(&mut robot, &a)) / 2e-6;
        assert!((told[j] - g[j] + slope).abs() < 1e-5, "{j}: {} {slope}", told[j] - g[j]);
    }
    // With these forces in motion, M v̇ + C + g = τ accelerates the tip by Λ⁻¹ (K e + D ė).
    robot.set_q(&Q).unwrap();
    let v = [0.3, -0.2, 0.5, 0.1, -0.4, 0.2, 0.6];
    space.impedance(&mut robot, &v, &[spring], None, &mut tau).unwrap();
    let (mut bias, mut tips) = (vec![0.0; nv], [Motion::zero()]);
    robot.bias(&v, &[part], &mut bias, &mut tips).unwrap();
    let mut M = vec![0.0; nv * nv];
    robot.mass_matrix(&mut M).unwrap();
    let mut exact = Priorities::new(nv, nv, 0);
    exact.begin();
    let right: Vec<f64> = tau.iter().zip(&bias).map(|(t, h)| t - h).collect();
    exact.level(&M, &right).unwrap();
    let moved = twist_of(&mut robot, part, exact.x());
    let rate = twist_of(&mut robot, part, &v);
    let bias = [tips[0].angular, tips[0].linear].map(|x| [x.x, x.y, x.z]).concat();
    let e = [turn.x, turn.y, turn.z, shift.x, shift.y, shift.z];
    let felt: Vec<f64> =
        (0..6).map(|k| spring.stiffness[k] * e[k] - spring.damping[k] * rate[k]).collect();
    let compliance = space.compliance(&mut robot).unwrap().to_vec();
    for k in 0..6 {
        let known: f64 = (0..6).map(|j| compliance[6 * k + j] * felt[j]).sum();
        assert!((moved[k] + bias[k] - known).abs() < 1e-8 * (1.0 + known.abs()), "{k}");
    }
    let bad = Impedance { stiffness: [-1.0; 6], ..spring };
    let told = space.impedance(&mut robot, &v, &[bad], None, &mut tau).unwrap_err().to_string();
    assert!(told.contains("stiffness"), "{told}");
    assert!(matches!(
        space.impedance(&mut robot, &v, &[], None, &mut tau),
        Err(RobotError::Length { .. })
    ));
}

/// Momentum equals the matrix times rates, and the mass times the velocity of the centre of mass. The composite inertia of all bodies equals the mass
/// matrix at the root.
#[test]
fn momentum_and_composites_count_what_is_held() {
    let model = arm();
    let (part, nv) = (model.part("arm").unwrap(), model.nv());
    let mut robot = Robot::new(&model);
    robot.set_q(&Q).unwrap();
    let v = [0.3, -0.2, 0.5, 0.1, -0.4, 0.2, 0.6];
    let bare = robot.momentum(&v).unwrap();
    let body = model.multibody().body("l2").unwrap();
    let alone = robot.composite_inertia(body);
    robot.grasp(part, model.object("cup").unwrap(), Grasp::Here).unwrap();
    let h = robot.momentum(&v).unwrap();
    assert!((h.force - bare.force).norm() > 0.01);
    let mut A = vec![0.0; 6 * nv];
    robot.centroidal_matrix(&mut A).unwrap();
    let of = |h: &Force| [h.moment.x, h.moment.y, h.moment.z, h.force.x, h.force.y, h.force.z];
    let by: Vec<f64> =
        A.chunks_exact(nv).map(|r| r.iter().zip(&v).map(|(a, b)| a * b).sum()).collect();
    assert!(difference(&by, &of(&h)) < 1e-12);
    let (mass, mut places) = (robot.center_of_mass().0, [Vec3::zeros(); 2]);
    for (side, at) in [-1e-6, 1e-6].into_iter().zip(&mut places) {
        let q: Vec<f64> = Q.iter().zip(&v).map(|(q, v)| q + side * v).collect();
        robot.set_q(&q).unwrap();
        *at = robot.center_of_mass().1;
    }
    robot.set_q(&Q).unwrap();
    assert!(((places[1] - places[0]) * (mass / 2e-6) - h.force).norm() < 1e-7);
    let whole = robot.composite_inertia(body);
    assert!((whole.mass() - alone.mass() - 0.8).abs() < 1e-12);
    // Only the hinge of l2 rotates, so ½ aᵀ I a equals ½ M₂₂.
    let mut M = vec![0.0; nv * nv];
    robot.mass_matrix(&mut M).unwrap();
    let part = model.part("elbow").unwrap();
    let at = model.multibody().get(body);
    let dof = model.multibody().subhinges().find(|(b, _)| *b == body).unwrap().1.v.start;
    let mut J = vec![0.0; 6 * nv];
    robot.whole_jacobian(part, &mut J).unwrap();
    let axis = Vec3::new(J[dof], J[nv + dof], J[2 * nv + dof]);
    assert!(at.hinge_in_body().position.norm() == 0.0, "its origin is on its axis");
    assert!((axis.dot(&(whole.inertia() * axis)) - M[dof * nv + dof]).abs() < 1e-12);
}
