//! Controllers that start with a coordinate outside its limits: it returns, or an error states the fault.

use crate::support::{Rng, difference};
use linkwork_embedded::multibody::{BodySpec, Builder, Hinge, Limits};
use linkwork_embedded::spatial::{MassProperties, Mat3, Motion, Pose, Vec3};
use linkwork_embedded::*;
use std::sync::Arc;

/// Half of the range of each pin, rad.
const MOST: f64 = 1.5;

/// Six pins without symmetry, each with a rate limit.
fn arm() -> Arc<RobotModel> {
    let (mut mechanism, mut rng) = (Builder::new(), Rng(23));
    for k in 0..6 {
        let axis = [Vec3::z(), Vec3::y(), Vec3::x()][k % 3];
        let tilt = Vec3::from_fn(|_, _| rng.within(-0.2, 0.2));
        let limits = Limits { rate: 2.0, effort: 80.0, ..Limits::position(-MOST, MOST) };
        let inertia = Mat3::from_diagonal(&Vec3::new(0.02, 0.025, 0.015));
        let mass = MassProperties::new(1.2, Vec3::new(0.01, -0.02, 0.1), inertia);
        let parent = if k == 0 { "world".to_owned() } else { format!("l{}", k - 1) };
        let hinge = Hinge::pin((axis + tilt).normalize()).limits(limits);
        let body = BodySpec::new(format!("l{k}"), parent).hinge(hinge).mass(mass);
        mechanism.body(body.hinge_in_parent(Pose::translation(0.03, -0.01, 0.2)));
    }
    let parts = vec![PartSpec::chain("arm", "world", "l5")];
    RobotModel::new(&ModelSpec { mechanism, parts, ..ModelSpec::default() }).unwrap()
}

/// Two coordinates beyond their upper and lower limits, the others inside.
const OUTSIDE: [f64; 6] = [1.7, 0.4, -1.9, 0.8, -0.3, 0.5];

/// Rates bring them back within their limits while a tip is pulled: coordinates inside never leave, and those that returned stay.
#[test]
fn rates_from_outside_the_limits_lead_back_inside() {
    let model = arm();
    let part = model.part("arm").unwrap();
    let mut robot = Robot::new(&model);
    let mut control = RateControl::new(&robot, 2, 0);
    let (guards, dt) = (Guards { horizon: 0.05, manipulable: &[] }, 0.01);
    for pull in [Vec3::new(0.3, 0.2, -0.4), Vec3::new(-0.4, 0.1, 0.2)] {
        let (mut q, mut v, mut left) = (OUTSIDE, [0.0; 6], [0.0; 2]);
        for step in 0..300 {
            robot.set_q(&q).unwrap();
            let tip =
                Aim::Tip { part, motion: Motion::new(Vec3::zeros(), pull), rows: Rows::Linear };
            // The task would drive both farther out.
            let out = [1.0, 0.0, -1.0, 0.0, 0.0, 0.0];
            let objectives = [Objective::new(0, Aim::Posture(&out)), Objective::new(1, tip)];
            control.solve(&mut robot, &objectives, &guards, &mut v, &mut left).unwrap();
            let beyond = |q: f64| (q.abs() - MOST).max(0.0);
            for (q, v) in q.iter_mut().zip(&v) {
                let next = *q + dt * v;
                assert!(v.abs() <= 2.0 + 1e-9, "{step}: {v}");
                let farther = beyond(next) - beyond(*q);
                assert!(farther <= 1e-9, "{step}: from {q} to {next}");
                // The coordinate returns at its full rate, or such that it is inside after the
                // horizon.
                let asked = (beyond(*q) / guards.horizon).min(2.0) * dt;
                assert!(-farther >= asked - 1e-9, "{step}: from {q} to {next}");
                *q = next;
            }
        }
        // The distance outside of the limits decreases by a fifth per step, so it has vanished
        // after 300 steps.
        assert!(q.iter().all(|q| q.abs() <= MOST + 1e-9), "{q:?}");
    }
}

/// Forces do not depend on coordinate limits: outside they are exact as inside, and a task towards the limits leads back.
#[test]
fn forces_from_outside_the_limits_lead_back_inside() {
    let model = arm();
    let mut robot = Robot::new(&model);
    let mut body = WholeBody::new(&robot, 0, 1);
    let effort = vec![80.0; 6];
    let (mut q, mut v, dt) = (OUTSIDE, [0.0; 6], 2e-3);
    for step in 0..2000 {
        robot.set_q(&q).unwrap();
        // The commanded acceleration is critically damped and leads to the nearest point slightly
        // inside.
        let back: Vec<f64> =
            (q.iter().zip(&v)).map(|(q, v)| 25.0 * (q.clamp(-1.4, 1.4) - q) - 10.0 * v).collect();
        let objective = [Objective::new(0, Aim::Posture(&back))];
        let (mut tau, mut vdot) = ([0.0; 6], [0.0; 6]);
        let out = (&mut tau[..], &mut vdot[..], &mut [][..]);
        let told = body.solve(&mut robot, &v, &[], &objective, &effort, out).unwrap();
        assert_eq!(told.unbalanced, 0.0, "{step}");
        assert!(told.shortfall < 1e-9 && difference(&vdot, &back) < 1e-6, "{step} {told:?}");
        // Inverse dynamics, which is independent of the search, needs the same forces.
        let mut exact = [0.0; 6];
        robot.feed_forward(&v, &vdot, &[], &mut exact).unwrap();
        assert!(difference(&exact, &tau) < 1e-8, "{step}");
        for i in 0..6 {
            v[i] += dt * vdot[i];
            q[i] += dt * v[i];
        }
    }
    assert!(q.iter().all(|q| q.abs() < 1.4 + 1e-3), "{q:?}");
    assert!(v.iter().all(|v| v.abs() < 1e-3), "{v:?}");
}
