//! `actuators.strut` between two free bodies: closed forms of the two-body oscillator, momentum, energy.

use crate::common;

use linkwork_runtime::{Seconds, Simulation};

/// Two balls in weightlessness, joined at their centres (or at points off them) by a strut of 2 m.
fn balls(damping: f64, beside: f64, apart: f64) -> Simulation {
    let text = format!(
        r#"Simulation(
            bodies: {{
                "left": (parent: "world", hinge: Free, mass: 2, inertia: Sphere(0.3), nodes: {{ "end": (position: [0, {beside}, 0]) }},
                    initial: (position: [1, 0, 0], velocity: [0.1, 0.2, -0.1])),
                "right": (parent: "world", hinge: Free, mass: 3, inertia: Sphere(0.3), nodes: {{ "end": (position: [0, {beside}, 0]) }},
                    initial: (position: [{}, 0, 0], velocity: [0.1, 0.2, -0.1])),
            }},
            parts: {{ "Strut": (model: "actuators.strut", params: {{ "stiffness": 120, "damping": {damping:?}, "rest": 2 }}, bind: {{ "a": "node:left/end", "b": "node:right/end" }}) }},
            gravity: "none", integrator: "verner_87", accuracy: (relative: 1e-12, absolute: 1e-12), step: "10 ms", until: "2 s")"#,
        1.0 + apart
    );
    common::scene(&text, &[]).unwrap_or_else(|e| panic!("{e}"))
}

fn vector(sim: &Simulation, name: &str) -> [f64; 3] {
    ["x", "y", "z"].map(|k| sim.get(&format!("{name}.{k}")).unwrap())
}

#[test]
fn two_balls_swing_as_the_closed_form_says() {
    // With the reduced mass 2·3/5 the deflection is δ(t) = δ₀ e^(−σt) (cos ωt + σ/ω sin ωt).
    let reduced = 2.0 * 3.0 / 5.0;
    for damping in [0.0, 4.0] {
        let mut sim = balls(damping, 0.0, 2.5);
        let sigma = damping / (2.0 * reduced);
        let omega = (120.0f64 / reduced - sigma * sigma).sqrt();
        for k in 1..=20u32 {
            sim.run_until(Seconds { num: u64::from(k), den: 10 }).unwrap();
            let t = 0.1 * f64::from(k);
            let (s, c) = (omega * t).sin_cos();
            let want = 2.0 + 0.5 * (-sigma * t).exp() * (c + sigma / omega * s);
            let length = sim.get("Strut.length").unwrap();
            assert!((length - want).abs() < 1e-9, "{damping} {t}: {length} {want}");
            // The common centre of the balls moves as without a strut.
            let (a, b) = (vector(&sim, "left.position"), vector(&sim, "right.position"));
            let center: Vec<f64> = a.iter().zip(&b).map(|(a, b)| 0.4 * a + 0.6 * b).collect();
            let begin = [1.0 + 0.6 * 2.5, 0.0, 0.0];
            for (i, v) in [0.1, 0.2, -0.1].into_iter().enumerate() {
                assert!((center[i] - begin[i] - v * t).abs() < 1e-10);
            }
        }
    }
}

/// Attached off the centres it rotates both balls: without damping the energy is conserved.
#[test]
fn energy_stays_without_damping_and_falls_with_it() {
    let energy = |sim: &Simulation| {
        let of = |body: &str, mass: f64| {
            let square = |name: &str| -> f64 {
                vector(sim, &format!("{body}.{name}")).iter().map(|x| x * x).sum()
            };
            0.5 * mass * (square("velocity") + 0.4 * 0.09 * square("angular"))
        };
        let stretch = sim.get("Strut.length").unwrap() - 2.0;
        of("left", 2.0) + of("right", 3.0) + 0.5 * 120.0 * stretch * stretch
    };
    for (damping, lost) in [(0.0, 0.0), (4.0, 1.0)] {
        let mut sim = balls(damping, 0.2, 1.6);
        let begin = energy(&sim);
        sim.run_until(Seconds { num: 2, den: 1 }).unwrap();
        let end = energy(&sim);
        match lost > 0.0 {
            true => assert!(end < begin - lost, "{begin} {end}"),
            false => assert!((end - begin).abs() < 1e-9, "{begin} {end}"),
        }
    }
}
