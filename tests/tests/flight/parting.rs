//! Separation and docking as complete simulations: tip-off by pyrotechnic devices, momentum and energy of a soft capture.
use crate::common::{get, rotation, scene, seconds, velocity};
use linkwork_runtime::Simulation;
use linkwork_spatial::{Mat3, Vec3};

/// Returns momentum, and angular momentum about the origin of W, of free bodies with principal inertias about their origins.
fn momentum(sim: &Simulation, bodies: &[(&str, f64, Vec3)]) -> (Vec3, Vec3) {
    let (mut linear, mut angular) = (Vec3::zeros(), Vec3::zeros());
    for (body, mass, inertia) in bodies {
        let (p, v, R) =
            (get(sim, &format!("{body}.position")), velocity(sim, body), rotation(sim, body));
        linear += v * *mass;
        let own = Mat3::from_diagonal(inertia) * get(sim, &format!("{body}.angular"));
        angular += p.cross(&(v * *mass)) + R * own;
    }
    (linear, angular)
}

/// Two devices with 4 and 3 N s at ±0.2 m push 10 kg from 30 kg: speed and tip-off by the sums of impulses.
#[test]
fn unequal_devices_tip_off_what_they_push() {
    let text = r#"Simulation(
        bodies: {
            "stage": (parent: "world", hinge: Free, mass: 30, inertia: [0.9, 0.8, 0.7], nodes: { "l": (position: [0, -0.2, 0.2]), "r": (position: [0, 0.2, 0.2]) }),
            "load": (parent: "world", hinge: Free, mass: 10, inertia: [0.3, 0.35, 0.4], initial: (position: [0, 0, 0.4]),
                nodes: { "l": (position: [0, -0.2, -0.2]), "r": (position: [0, 0.2, -0.2]) }),
        },
        gravity: "none",
        parts: {
            "L": (model: "flight.pyro", params: { "impulse": 4, "duration": "1 ms", "axis": [0, 0, 1], "after": 0 }, bind: { "a": "node:stage/l", "b": "node:load/l" }),
            "R": (model: "flight.pyro", params: { "impulse": 3, "duration": "1 ms", "axis": [0, 0, 1], "after": 0, "delay": "2 ms" }, bind: { "a": "node:stage/r", "b": "node:load/r" }),
        },
        step: "1 ms", integrator: "dormand_prince_54", accuracy: (relative: 1e-12, absolute: 1e-12), until: "10 ms",
    )"#;
    let bodies =
        [("stage", 30.0, Vec3::new(0.9, 0.8, 0.7)), ("load", 10.0, Vec3::new(0.3, 0.35, 0.4))];
    let mut sim = scene(text, &[]).unwrap();
    let before = momentum(&sim, &bodies);
    sim.run_until(seconds(0.01)).unwrap();
    let after = momentum(&sim, &bodies);
    assert!((after.0 - before.0).norm() < 1e-12 && (after.1 - before.1).norm() < 1e-12);
    // The angular impulse r × J about the load's centre is −0.2 · 4 + 0.2 · 3 N m s about x, except for the rotation of
    // both bodies by 5 mrad in 3 ms, with arms of 0.2 m.
    let (v, w) = (velocity(&sim, "load").z, get(&sim, "load.angular").x);
    println!("{v} m/s, {w} rad/s");
    assert!((v - 0.7).abs() < 1e-5, "{v}");
    assert!((w + 0.2 / 0.3).abs() < 0.02, "{w}");
    assert_eq!(sim.get("L.spent").unwrap(), 1.0);
    assert_eq!(sim.get("R.spent").unwrap(), 1.0);
}

/// A chaser of 500 kg drifts into a target's port at 5 cm/s, offset and rotated: latches catch, dampers bring it to rest, and the pair continues with
/// its momentum. The lost energy equals that absorbed by the dampers.
#[test]
fn a_soft_capture_keeps_the_momentum_and_takes_the_energy() {
    let text = r#"Simulation(
        bodies: {
            "target": (parent: "world", hinge: Free, mass: 2000, inertia: [1800, 1500, 2200], nodes: { "port": (position: [0, -1.5, 0]) }),
            "chaser": (parent: "world", hinge: Free, mass: 500, inertia: [180, 150, 190],
                initial: (position: [0.01, -2.7, -0.02], velocity: [0.004, 0.05, 0.002], rotation: (rpy: [0.02, -0.01, 0.03]), angular: [0.001, -0.002, 0.001]),
                nodes: { "port": (position: [0, 1, 0]) }),
        },
        gravity: "none",
        parts: {
            "Capture": (
                model: "flight.capture",
                params: { "radius": "0.1 m", "stiffness": [200, 400, 200], "damping": [300, 400, 300], "turn_stiffness": [60, 60, 60], "turn_damping": [120, 120, 120] },
                bind: { "a": "node:target/port", "b": "node:chaser/port" },
            ),
        },
        step: "50 ms", integrator: "dormand_prince_54", accuracy: (relative: 1e-12, absolute: 1e-12), until: "120 s",
    )"#;
    let bodies = [
        ("target", 2000.0, Vec3::new(1800.0, 1500.0, 2200.0)),
        ("chaser", 500.0, Vec3::new(180.0, 150.0, 190.0)),
    ];
    let energy = |sim: &Simulation| {
        let of = |(body, mass, inertia): &(&str, f64, Vec3)| {
            let w = get(sim, &format!("{body}.angular"));
            0.5 * mass * velocity(sim, body).norm_squared()
                + 0.5 * inertia.component_mul(&w).dot(&w)
        };
        bodies.iter().map(of).sum::<f64>()
    };
    let mut sim = scene(text, &[]).unwrap();
    let (before, had) = (momentum(&sim, &bodies), energy(&sim));
    sim.run_until(seconds(1.0)).unwrap();
    assert_eq!((sim.get("Capture.caught").unwrap(), sim.get("Capture.force").unwrap()), (0.0, 0.0));
    while sim.get("Capture.caught").unwrap() == 0.0 {
        sim.step_event().unwrap();
    }
    // The springs' length equals the distance of the ports when the latches catch, so their initial energy is absorbed, too.
    let port = |body: &str, y: f64| {
        get(&sim, &format!("{body}.position")) + rotation(&sim, body) * Vec3::new(0.0, y, 0.0)
    };
    let place = rotation(&sim, "target").inverse() * (port("chaser", 1.0) - port("target", -1.5));
    let turn = rotation(&sim, "target").angle_to(&rotation(&sim, "chaser"));
    let held =
        0.5 * Vec3::new(200.0, 400.0, 200.0).component_mul(&place).dot(&place) + 30.0 * turn * turn;
    assert!((place.norm() - 0.1).abs() < 1e-9 && held > 1.0, "{place} {held}");
    let mut most = 0.0_f64;
    for k in 2..=120 {
        sim.run_until(seconds(f64::from(k))).unwrap();
        most = most.max(sim.get("Capture.force").unwrap());
    }
    let (after, has) = (momentum(&sim, &bodies), energy(&sim));
    let taken = sim.get("Capture.taken").unwrap();
    let lost = had - has + held;
    println!("{most} N, {taken} J of {lost}");
    assert!((after.0 - before.0).norm() < 1e-9 && (after.1 - before.1).norm() < 1e-9);
    assert!(most > 1.0 && most < 40.0, "{most}");
    assert_eq!(sim.get("Capture.settled").unwrap(), 1.0);
    assert!((taken / lost - 1.0).abs() < 1e-3, "{taken} J, {lost} J");
    let (a, b) = (velocity(&sim, "chaser").y, velocity(&sim, "target").y);
    assert!((a - 0.01).abs() < 1e-3 && (b - 0.01).abs() < 1e-3, "{a} {b}");
}
