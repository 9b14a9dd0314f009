//! Compliant contact: elastic bounces conserve energy, damped ones lose it as in Hunt and Crossley's law, bristles hold parked bodies and let pushed
//! ones slide.

use crate::scene::{Run, Scene, solid_ball, solid_box, turned};
use linkwork_collision::{Colliders, Material, Resistance, Shape};
use linkwork_dynamics::spatial::{Pose, Vec3};
use linkwork_dynamics::{forward_dynamics_given_kinematics, kinematics};
use linkwork_integrate::{Field, Integrator, Method};
use linkwork_solvers::{CompliantContact, CompliantSettings};
use std::sync::Arc;

struct Smooth {
    run: Run,
    contact: CompliantContact,
    x: Vec<f64>,
    rk4: Integrator,
}

impl Smooth {
    fn new(scene: &Scene, settings: CompliantSettings) -> Self {
        let run = scene.run();
        let colliders = Arc::new(
            Colliders::new(scene.colliders.clone(), scene.rules.clone(), &run.mbs).unwrap(),
        );
        let (states, table) = CompliantContact::states(&colliders, &settings.into());
        assert_eq!(table, 0);
        let x: Vec<f64> =
            run.q.iter().chain(&run.v).copied().chain(std::iter::repeat_n(0.0, states)).collect();
        let contact = CompliantContact::new(colliders, settings).unwrap();
        let rk4 = Integrator::new(Method::by_name("rk4").unwrap(), x.len());
        Self { rk4, run, contact, x }
    }

    fn step(&mut self, h: f64) {
        let Self { run, contact, x, rk4 } = self;
        let (nq, nv) = (run.mbs.nq(), run.mbs.nv());
        let f = |_: f64, x: &[f64], xdot: &mut [f64]| {
            let (q, rest) = x.split_at(nq);
            let (v, bristles) = rest.split_at(nv);
            kinematics(&run.tree, &mut run.ws, q, v);
            run.ws.clear_forces();
            run.ws.apply_uniform_gravity(run.gravity);
            let (qdot, rest) = xdot.split_at_mut(nq);
            let (vdot, rates) = rest.split_at_mut(nv);
            contact.apply(&run.tree, &mut run.ws, (bristles, &[]), rates);
            let mut tau = vec![0.0; nv];
            forward_dynamics_given_kinematics(&run.tree, &mut run.ws, &mut tau, vdot).unwrap();
            run.mbs.qdot(q, v, qdot);
        };
        rk4.step_fixed(&mut Field(f), 0.0, h, x, None).unwrap();
        run.mbs.normalize(&mut x[..nq]);
        run.q.copy_from_slice(&x[..nq]);
        run.v.copy_from_slice(&x[nq..nq + nv]);
    }
}

fn ball(height: f64, friction: f64) -> Scene {
    let mut s = Scene::default();
    let material = Material { friction, restitution: 0.0 };
    s.ground(material);
    let at = Pose::translation(0.1, 0.2, 0.1 + height);
    s.body("ball", solid_ball(1.0, 0.1), Shape::Sphere { radius: 0.1 }, material, at, [0.0; 6]);
    s
}

/// Without damping and friction a ball returns to its height at every bounce.
#[test]
fn elastic_bounces_keep_energy() {
    let settings = CompliantSettings {
        stiffness: 1e6,
        exponent: 1.5,
        damping: 0.0,
        ..CompliantSettings::default()
    };
    let mut s = Smooth::new(&ball(0.2, 0.0), settings);
    let (mut last, mut peaks) = (0.0, Vec::new());
    for _ in 0..20_000 {
        s.step(1e-4);
        let up = s.run.v[5];
        if last > 0.0 && up <= 0.0 {
            peaks.push(s.run.q[2] - 0.1);
        }
        last = up;
    }
    assert!(peaks.len() >= 4, "{peaks:?}");
    // Measured: 2.5e-6 m after four bounces.
    assert!(peaks.iter().all(|p| (p - 0.2).abs() < 1e-5), "{peaks:?}");
}

/// For small d v the ball loses ⅔ d v of its speed (p = 1.5).
#[test]
fn damping_gives_restitution() {
    let d = 0.1;
    let settings = CompliantSettings {
        stiffness: 1e6,
        exponent: 1.5,
        damping: d,
        ..CompliantSettings::default()
    };
    let mut s = Smooth::new(&ball(0.05, 0.0), settings);
    let v0 = (2.0 * 9.81 * 0.05_f64).sqrt();
    let mut speed: f64 = 0.0;
    for _ in 0..2500 {
        s.step(1e-4);
        speed = speed.max(s.run.v[5]);
    }
    let (e, want) = (speed / v0, 1.0 - 2.0 / 3.0 * d * v0);
    assert!((e - want).abs() < 0.01, "{e} {want}");
}

/// A parked box on a slope does not creep.
#[test]
fn bristles_hold() {
    let half = Vec3::new(0.2, 0.1, 0.05);
    for angle in [0.1, 0.3] {
        let rough = Material { friction: 0.6, restitution: 0.0 };
        let gravity = turned(Vec3::y(), -angle) * Vec3::new(0.0, 0.0, -9.81);
        let mut s = Scene { gravity, ..Scene::default() };
        s.ground(rough);
        let at = Pose::translation(0.0, 0.0, half.z);
        s.body("box", solid_box(2.0, half), Shape::Box { half }, rough, at, [0.0; 6]);
        let settings =
            CompliantSettings { bristle_damping: 400.0, damping: 10.0, ..Default::default() };
        let mut s = Smooth::new(&s, settings);
        for _ in 0..6000 {
            s.step(5e-4);
        }
        let x = s.run.q[0];
        let speed = s.run.v.iter().fold(0.0_f64, |m, v| m.max(v.abs()));
        assert!(speed < 1e-9, "creeps at {speed:e}");
        let bend = 2.0 * 9.81 * f64::sin(angle) / settings.bristle_stiffness;
        // Bristles slip slightly before the weight loads them.
        assert!(x.abs() < 2.0 * bend, "{x} {bend}");
    }
}

/// A sliding box stops after v²/2μg, and a spinning one stops too.
#[test]
fn bristles_slide_and_spin() {
    let half = Vec3::new(0.2, 0.2, 0.05);
    let rough = Material { friction: 0.3, restitution: 0.0 };
    let rates = |k: usize, x: f64| {
        let mut r = [0.0; 6];
        r[k] = x;
        r
    };
    let start = |rates| {
        let mut s = Scene::default();
        s.ground(rough);
        let at = Pose::translation(0.0, 0.0, half.z - 5e-5);
        s.body("box", solid_box(2.0, half), Shape::Box { half }, rough, at, rates);
        Smooth::new(&s, CompliantSettings { damping: 5.0, ..Default::default() })
    };
    let mut s = start(rates(3, 2.0));
    (0..5000).for_each(|_| s.step(2e-4));
    let want = 4.0 / (2.0 * 0.3 * 9.81);
    assert!((s.run.q[0] - want).abs() < 0.01 * want, "{} {want}", s.run.q[0]);
    let mut s = start(rates(2, 3.0));
    (0..4000).for_each(|_| s.step(2e-4));
    assert!(s.run.v.iter().all(|v| v.abs() < 1e-6), "{:?}", s.run.v);
}

/// Rolling and spinning friction as in the impulse-based solver: 5/7 g μ_r / r, and I ω / (μ_s m g).
#[test]
fn a_ball_rolls_and_spins_to_rest() {
    let (mu, r, g) = (0.004, 0.1, 9.81);
    let start = |resistance, rates: [f64; 6]| {
        let mut s = ball(-2e-5, 0.8);
        s.colliders[0].resistance = resistance;
        s.start[0].2 = rates;
        Smooth::new(&s, CompliantSettings { stiffness: 5e5, damping: 5.0, ..Default::default() })
    };
    let mut s = start(Resistance { rolling: mu, spinning: 0.0 }, [0.0, 5.0, 0.0, 0.5, 0.0, 0.0]);
    (0..5000).for_each(|_| s.step(2e-4));
    let w = Vec3::new(s.run.v[0], s.run.v[1], s.run.v[2]).norm();
    let want = (0.5 - 5.0 / 7.0 * g * mu / r) / r;
    assert!((w - want).abs() < 0.01 * want, "{w} {want}");
    (0..6000).for_each(|_| s.step(2e-4));
    let w = Vec3::new(s.run.v[0], s.run.v[1], s.run.v[2]).norm();
    assert!(w < 1e-3, "{w}");
    let mut s = start(Resistance { rolling: 0.0, spinning: mu }, [0.0, 0.0, 9.0, 0.0, 0.0, 0.0]);
    (0..1000).for_each(|_| s.step(2e-4));
    // The radius of the contact, 1 mm, adds a resistance of 0.8 · 1 mm · N.
    let want = 9.0 - 0.2 * (mu + 0.8e-3) * g / (0.4 * r * r);
    assert!((s.run.v[2] - want).abs() < 0.05, "{} {want}", s.run.v[2]);
}

/// A box on a belt slides for v / (μ g), then moves with it.
#[test]
fn a_belt_carries_a_box() {
    let (half, rough) = (Vec3::new(0.2, 0.2, 0.05), Material { friction: 0.4, restitution: 0.0 });
    let mut s = Scene::default();
    s.ground(rough);
    s.colliders[0].surface_velocity = Vec3::new(0.0, 1.2, 0.0);
    let at = Pose::translation(0.0, 0.0, half.z - 5e-5);
    s.body("box", solid_box(2.0, half), Shape::Box { half }, rough, at, [0.0; 6]);
    let mut s = Smooth::new(&s, CompliantSettings { damping: 5.0, ..Default::default() });
    (0..1000).for_each(|_| s.step(2e-4));
    assert!((s.run.v[4] - 0.4 * 9.81 * 0.2).abs() < 0.02, "{:?}", s.run.v);
    (0..2000).for_each(|_| s.step(2e-4));
    assert!((s.run.v[4] - 1.2).abs() < 1e-3, "{:?}", s.run.v);
}

#[test]
fn senseless_constants_are_refused() {
    let bad = CompliantSettings { exponent: 0.5, ..Default::default() };
    let text = bad.check().unwrap_err().to_string();
    assert!(text.contains("`exponent` is 0.5") && text.contains("help: "), "{text}");
    assert!(CompliantSettings { stiffness: f64::NAN, ..Default::default() }.check().is_err());
}
