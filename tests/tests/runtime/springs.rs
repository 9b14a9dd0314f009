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

/// Returns the message of a body on a hinge with a part.
fn refusal(hinge: &str, model: &str, params: &str, more: &str) -> String {
    let text = format!(
        r#"Simulation(
            bodies: {{ "b": (parent: "world", hinge: {hinge}, mass: 1, inertia: [1, 1, 1]) }}, gravity: "none",
            parts: {{ "P": (model: "{model}", {more} bind: {{ "shaft": "hinge:b" }}, params: {{ {params} }}), SUPPLY }},
            step: "1 ms", until: "1 s",
        )"#
    );
    let supplied = !(model.starts_with("sensors")
        || ["actuators.spring_damper", "actuators.soft_stop"].contains(&model));
    let supply = match supplied {
        true => {
            r#""Supply": (model: "power.ideal_supply", params: { "voltage": 24 }) }, connect: [("P.supply", "Supply.terminal")]"#
        }
        false => "}",
    };
    let text = text.replace("SUPPLY }", supply);
    common::program_of(&text).err().unwrap_or_default()
}

/// Parameters of models on hinges: model, parameter, value on a pin, value on a slider.
const OF_HINGES: &[(&str, &str, &str, &str)] = &[
    ("actuators.spring_damper", "stiffness", "1 N m/deg", "1 kN/m"),
    ("actuators.spring_damper", "damping", "1 N m s/rad", "1 N s/m"),
    ("actuators.soft_stop", "stiffness", "1 N m/rad", "1 N/m"),
    ("actuators.soft_stop", "dissipation", "1 s/rad", "1 s/m"),
    ("actuators.torque_drive", "torque_max", "1 N m", "1 N"),
    ("actuators.rate_servo", "gain", "1 N m s/rad", "1 N s/m"),
    ("actuators.position_servo", "stiffness", "1 N m/rad", "1 N/mm"),
    ("actuators.dc_motor", "coulomb", "1 N m", "1 N"),
    ("actuators.angle_follower", "rate_max", "10 deg/s", "10 mm/s"),
    ("actuators.rate_follower", "acceleration_max", "1 rad/s^2", "1 m/s^2"),
    ("sensors.potentiometer", "upper", "90 deg", "10 cm"),
];

/// webots PR 5704, godot PR 96523, gazebo-classic #2296: the stiffness of a slider is in N/m and that of a hinge in N m/rad. Before, models had the
/// units of hinges on sliders, too.
#[test]
fn parameters_of_parts_on_sliders_have_the_units_of_lengths() {
    for (model, param, pin, slider) in OF_HINGES {
        let sampled = if model.starts_with("sensors") { r#"rate: "100 Hz","# } else { "" };
        let prescribed = if model.ends_with("follower") { ", prescribed: true" } else { "" };
        let rest = match *model {
            "actuators.soft_stop" => r#""lower": -1, "upper": 1,"#,
            "actuators.position_servo" => r#""damping": 1,"#,
            "actuators.dc_motor" => r#""resistance": 1, "torque_constant": 1,"#,
            "sensors.potentiometer" => r#""lower": -1,"#,
            _ => "",
        };
        let said = |kind: &str, value: &str| {
            let hinge = format!("{kind}(axis: [0, 0, 1]{prescribed})");
            refusal(&hinge, model, &format!(r#"{rest} "{param}": "{value}""#), sampled)
        };
        for (kind, value) in [("Pin", pin), ("Slider", slider)] {
            assert_eq!(said(kind, value), "", "{model} {param}");
        }
        for (kind, value) in [("Pin", slider), ("Slider", pin)] {
            let e = said(kind, value);
            assert!(e.contains(&format!("`P.{param}`: `{value}` is in")), "{model}: {e}");
            assert_eq!(e.contains("acts on a slider"), kind == "Slider", "{e}");
        }
    }
    let e = refusal("Slider([0, 0, 1])", "sensors.encoder", "", r#"rate: "100 Hz","#);
    assert!(e.contains("is for coordinates in rad, but this is a slider"), "{e}");
}
