//! Springs of hinges and `actuators.spring_damper` have one law: both follow the closed form of a damped oscillation.
use crate::common;
use linkwork_runtime::{Seconds, Simulation};
use std::sync::Arc;

const STIFFNESS: f64 = 12.0;
const DAMPING: f64 = 0.7;
const REST: f64 = 0.3;
const INERTIA: f64 = 1.5;

/// Returns coordinate and rate after 1.7 s of a body that starts 0.5 from the rest position.
fn state(hinge: &str, spring: &str, part: &str) -> [f64; 2] {
    let text = format!(
        r#"Simulation(
            bodies: {{ "b": (parent: "world", hinge: {hinge}([0, 1, 0]), {spring} mass: {INERTIA}, inertia: [9, {INERTIA}, 9], initial: ({}: 0.8)) }},
            gravity: "none", parts: {{ {part} }}, step: "1 ms", integrator: "rk4", until: "2 s",
        )"#,
        if hinge == "Pin" { "angle" } else { "position" }
    );
    let (program, _) = common::program_of(&text).unwrap_or_else(|e| panic!("{e}"));
    let mut sim = Simulation::of(Arc::new(program));
    sim.run_until(Seconds::from_decimal(1.7).unwrap()).unwrap();
    let names = if hinge == "Pin" { ["b.angle", "b.rate"] } else { ["b.displacement", "b.speed"] };
    names.map(|name| sim.get(name).unwrap_or_else(|e| panic!("{name}: {e}")))
}

#[test]
fn a_spring_of_a_hinge_and_a_spring_damper_oscillate_as_the_closed_form() {
    // The equation is I ẍ + d ẋ + k x = 0, with a start at x = 0.5 at rest.
    let (decay, t) = (DAMPING / (2.0 * INERTIA), 1.7);
    let omega = (STIFFNESS / INERTIA - decay * decay).sqrt();
    let (sin, cos) = (omega * t).sin_cos();
    let x = 0.5 * (-decay * t).exp() * (cos + decay / omega * sin);
    let rate = -0.5 * (-decay * t).exp() * (STIFFNESS / INERTIA) / omega * sin;
    let own = format!("spring: (stiffness: {STIFFNESS}, rest: {REST}), damping: {DAMPING},");
    let part = format!(
        r#""S": (model: "actuators.spring_damper", bind: {{ "shaft": "hinge:b" }}, params: {{ "stiffness": {STIFFNESS}, "rest": {REST}, "damping": {DAMPING} }}),"#
    );
    for hinge in ["Pin", "Slider"] {
        let [of_hinge, of_part] = [state(hinge, &own, ""), state(hinge, "", &part)];
        // The error of RK4 with 1 ms is at most 2e-12.
        assert!((of_hinge[0] - REST - x).abs() < 1e-11, "{hinge}: {of_hinge:?} {x}");
        assert!((of_hinge[1] - rate).abs() < 1e-11, "{hinge}: {of_hinge:?} {rate}");
        let apart = |k: usize| (of_hinge[k] - of_part[k]).abs();
        assert!(apart(0) < 1e-13 && apart(1) < 1e-13, "{hinge}: {of_hinge:?} {of_part:?}");
    }
}
