//! Ellipsoids as colliders: closed forms of rolling, and the height at rest.
use crate::common;
use linkwork_runtime::{Seconds, Simulation};

const G: f64 = 9.81;
const GRAVITY: &str = r#"parts: { "Gravity": (model: "environment.uniform_gravity", params: { "acceleration": [0, 0, -9.81] }) }"#;

fn egg(radii: [f64; 3], initial: &str, contact: &str, step: &str) -> Simulation {
    let text = format!(
        r#"Simulation(bodies: {{ "egg": (parent: "world", hinge: Free, mass: 2, inertia: Ellipsoid({radii:?}), initial: ({initial}),
            shapes: [(shape: Ellipsoid({radii:?}), collide: true, name: "s")]) }},
            colliders: {{ "floor": (on: "world", shape: HalfSpace) }}, contact: ({contact}), {GRAVITY}, step: "{step}", until: "20 s")"#
    );
    common::scene(&text, &[]).unwrap_or_else(|e| panic!("{e}"))
}

fn until(sim: &mut Simulation, ms: u64) {
    sim.run_until(Seconds { num: ms, den: 1000 }).unwrap();
}

/// Small rolling about the shortest axis c, in the plane of the axis a. The contact point moves by ρ θ with the radius of curvature ρ = a²/c, so the
/// potential is m g (ρ − c) θ²/2, and the body rotates about the contact point: ω² = m g (a²/c − c) / (m (a² + c²)/5 + m c²).
#[test]
fn an_ellipsoid_rocks_with_the_frequency_of_its_curvature() {
    let radii = [0.3, 0.2, 0.1];
    let c = radii[2];
    for (k, axis) in [(0, [0.0, 1.0, 0.0]), (1, [1.0, 0.0, 0.0])] {
        let a = radii[k];
        let omega = (G * (a * a / c - c) / ((a * a + c * c) / 5.0 + c * c)).sqrt();
        let start = 0.01;
        // This is the exact height of the centre above the lowest point.
        let (sin, cos) = f64::sin_cos(start);
        let height = (a * a * sin * sin + c * c * cos * cos).sqrt();
        let initial =
            format!("position: [0, 0, {height}], rotation: (axis: {axis:?}, angle: {start})");
        let mut sim = egg(radii, &initial, "friction: 1", "0.2 ms");
        // The tilt passes zero once in each half period.
        let part = ["egg.rotation.y", "egg.rotation.x"][k];
        let (mut before, mut zeros) = (sim.get(part).unwrap(), Vec::new());
        for ms in 1..=3000 {
            until(&mut sim, ms);
            let now = sim.get(part).unwrap();
            if before * now < 0.0 {
                zeros.push((ms as f64 - now / (now - before)) * 1e-3);
            }
            before = now;
        }
        let half = (zeros[zeros.len() - 1] - zeros[0]) / (zeros.len() - 1) as f64;
        let found = std::f64::consts::PI / half;
        println!("axis {k}: {found:.5} rad/s, closed form {omega:.5}, {} zeros", zeros.len());
        assert!(zeros.len() > 5 && (found / omega - 1.0).abs() < 2e-3, "{found} {omega}");
    }
}

/// Dropped in any attitude, with rolling friction, it comes to rest on the end of its shortest axis, with the centre at half of its length.
#[test]
fn an_ellipsoid_comes_to_rest_on_its_shortest_axis() {
    for rpy in [[0.4, 1.1, 0.3], [1.5, 0.2, 2.0], [0.0, 1.5, 0.0]] {
        let initial = format!("position: [0, 0, 0.35], rotation: (rpy: {rpy:?})");
        let mut sim = egg(
            [0.3, 0.2, 0.1],
            &initial,
            r#"friction: 0.8, rolling_friction: "4 mm", spinning_friction: "4 mm""#,
            "1 ms",
        );
        until(&mut sim, 20_000);
        let [z, v] = ["egg.position.z", "egg.velocity.z"].map(|n| sim.get(n).unwrap());
        println!("{rpy:?}: {z}");
        // Rolling friction holds the body where the restoring moment m g (ρ − c) θ is below 4 mm times m g; its centre is then less than 0.1 mm
        // higher (ρ = b²/c).
        assert!((z - 0.1).abs() < 2e-4 && v.abs() < 1e-3, "{rpy:?}: {z} {v}");
    }
}

/// A heavy ellipsoid of revolution that spins about its axis of symmetry on a smooth floor keeps its spin, energy and momentum.
#[test]
fn a_frictionless_ellipsoid_keeps_its_energy() {
    let radii = [0.2, 0.2, 0.3];
    let (a2, c2, m) = (0.04_f64, 0.09_f64, 2.0);
    let tilt = 0.5_f64;
    let height = (a2 * tilt.sin().powi(2) + c2 * tilt.cos().powi(2)).sqrt();
    let initial = format!(
        "position: [0, 0, {height}], rotation: (axis: [1, 0, 0], angle: {tilt}), angular: [0, 0, 20]"
    );
    let mut sim = egg(radii, &initial, "friction: 0", "0.1 ms");
    let energy = |sim: &Simulation| {
        let v = |n: &str| sim.get(&format!("egg.{n}")).unwrap();
        let w = ["x", "y", "z"].map(|c| v(&format!("angular.{c}")));
        let i = [m * (a2 + c2) / 5.0, m * (a2 + c2) / 5.0, m * 2.0 * a2 / 5.0];
        let turn: f64 = (0..3).map(|k| 0.5 * i[k] * w[k] * w[k]).sum();
        let speed: f64 = ["x", "y", "z"].map(|c| v(&format!("velocity.{c}")).powi(2)).iter().sum();
        turn + 0.5 * m * speed + m * G * v("position.z")
    };
    let start = energy(&sim);
    let mut worst: f64 = 0.0;
    for k in 1..=200 {
        until(&mut sim, 10 * k);
        worst = worst.max((energy(&sim) / start - 1.0).abs());
        let spin = sim.get("egg.angular.z").unwrap();
        assert!((spin - 20.0).abs() < 0.02, "{spin}");
    }
    println!("energy within {worst:.1e}");
    assert!(worst < 5e-3, "{worst}");
}
