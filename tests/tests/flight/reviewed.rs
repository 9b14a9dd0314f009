//! Faults in flight models that reviews found, tested in simulations (`tests/hunt/reviews.md`).
use crate::common::{metrics_of, scene, seconds};

/// Mass (kg), length (m), stiffness (N/m) and damping (N s/m) of a load on a line, and the force (N) that pulls it at a time (s).
const LOAD: (f64, f64, f64, f64) = (2.0, 1.0, 100.0, 200.0);
fn pull(t: f64) -> f64 {
    if (2.0..2.05).contains(&t) { -50.0 } else { 50.0 }
}

/// Integrates distance and speed of the load to a time (s) by the equation T = max(0, k δ + c δ̇) where δ > 0, with RK4 steps of 10 µs.
fn by_the_law(end: f64) -> [f64; 2] {
    let (m, length, k, c) = LOAD;
    let rate = |t: f64, [x, v]: [f64; 2]| {
        let tension = if x > length { (k * (x - length) + c * v).max(0.0) } else { 0.0 };
        [v, (pull(t) - tension) / m]
    };
    let h = 1e-5;
    let mut y = [length, 0.0];
    for n in 0..(end / h).round() as u32 {
        // The instant is slightly inside a step, so that each stage uses the force of this step.
        let t = f64::from(n) * h + 1e-9;
        let at = |a: [f64; 2], b: [f64; 2], s: f64| [a[0] + s * b[0], a[1] + s * b[1]];
        let a = rate(t, y);
        let b = rate(t, at(y, a, 0.5 * h));
        let d = rate(t, at(y, b, 0.5 * h));
        let e = rate(t, at(y, d, h));
        y = std::array::from_fn(|i| y[i] + h / 6.0 * (a[i] + 2.0 * (b[i] + d[i]) + e[i]));
    }
    y
}

/// A stretched line goes slack if its ends approach each other quickly, since its damper would push. If the load is pulled away again before the line
/// gets shorter than its natural length, the line must hold it. It used to stay slack, and the load flew off. A line that started exactly at its
/// natural length, as this one does, never became taut.
#[test]
fn a_line_that_went_slack_while_it_was_stretched_holds_again() {
    let lines = [
        r#""Line": (model: "flight.line", params: { "length": 1, "stiffness": 100, "damping": 200 }, bind: { "a": "node:post", "b": "node:load" })"#,
        r#""Line": (model: "flight.riser", params: { "length": 0.5, "stiffness": 100, "damping": 200, "legs": [(at: [0, 0, 0], length: 0.5)] }, bind: { "body": "node:post", "canopy": "node:load" })"#,
    ];
    for line in lines {
        let text = format!(
            r#"Simulation(
                bodies: {{
                    "post": (parent: "world"),
                    "load": (parent: "world", hinge: Slider([1, 0, 0]), mass: 2, inertia: [1, 1, 1], initial: (position: 1)),
                }},
                gravity: "none",
                parts: {{
                    {line},
                    "Pull": (model: "flight.body_load", params: {{ "rows": [(time: 0, force: [50, 0, 0]), (time: 2, force: [-50, 0, 0]), (time: 2.05, force: [50, 0, 0])] }}, bind: {{ "body": "node:load" }}),
                }},
                step: "1 ms", integrator: "rk4", until: "10 s",
            )"#
        );
        let mut sim = scene(&text, &[]).unwrap_or_else(|e| panic!("{e}"));
        for t in [1.9, 2.1, 2.5, 4.0, 10.0] {
            sim.run_until(seconds(t)).unwrap();
            let [x, v] = by_the_law(t);
            let of = |name: &str| sim.get(&format!("Line.{name}")).unwrap();
            let (place, speed) = (LOAD.1 + of("extension"), of("rate"));
            // Measured: 2e-5 m and 2e-4 m/s, which is the error of the fixed step of the reference
            // integration.
            assert!((place - x).abs() < 2e-4, "{line} at {t}: {place} {x}");
            assert!((speed - v).abs() < 2e-3, "{line} at {t}: {speed} {v}");
        }
        // A tension of T = 50 N gives δ = 0.5 m.
        assert!((sim.get("Line.extension").unwrap() - 0.5).abs() < 0.02);
    }
}

/// The flow is outside the tables from the start to the end, and the output must state it. It used to do so only after the flow had entered them.
#[test]
fn a_flow_that_begins_outside_its_tables_has_been_outside() {
    let text = |start: f64| {
        format!(
            r#"Simulation(
                bodies: {{ "capsule": (parent: "world", hinge: Free, mass: 1000, inertia: [10, 10, 10], initial: (position: [0, 0, 9000], velocity: [{start:?}, 0, 0])) }},
                parts: {{
                    "Gravity": (model: "environment.uniform_gravity", params: {{ "acceleration": [0, 0, -3.7] }}),
                    "Air": (model: "environment.exponential_atmosphere", params: {{ "density": 0.020, "scale_height": 11100, "temperature": 210, "gas_constant": 191.8, "heat_ratio": 1.33, "heating_constant": 1.9027e-4 }}),
                    "Point": (model: "flight.entry_aerodynamics", params: {{ "area": 1, "drag": [[2, 1], [9, 1]], "lift_to_drag": [[2, 0], [9, 0]] }}, bind: {{ "body": "node:capsule" }}),
                    "Shell": (model: "flight.sphere_cone", params: {{ "half_angle": "70 deg", "bluntness": 0.5, "base_radius": 0.5, "gamma": 1.33 }}, bind: {{ "body": "node:capsule" }}),
                    "Tables": (model: "flight.axisymmetric_aerodynamics", params: {{ "area": 1, "length": 1, "angles": [0, 3], "machs": [2, 9], "axial": [[1, 1], [-1, -1]], "normal": [[0, 0], [0.2, 0.2]], "pitch": [[0, 0], [0, 0]] }}, bind: {{ "body": "node:capsule" }}),
                }},
                step: "10 ms", integrator: "rk4", until: "1 s",
            )"#
        )
    };
    // The speed of sound is 231.5 m/s, so the Mach numbers are about 0.4 and 5.
    for (speed, outside) in [(100.0, 1.0), (1157.0, 0.0)] {
        let mut sim = scene(&text(speed), &[]).unwrap_or_else(|e| panic!("{e}"));
        sim.run_until(seconds(1.0)).unwrap();
        for part in ["Point", "Shell", "Tables"] {
            let found = sim.get(&format!("{part}.outside")).unwrap();
            assert_eq!(found, outside, "{part} at {speed} m/s");
        }
    }
}

/// A condition on the apocentre does not hold on a hyperbola, and holds once the apocentre of an ellipse has decreased to it.
#[test]
fn a_run_ends_when_the_apocentre_has_come_down() {
    // The speed 11.2 km/s gives a hyperbola here: v² = 2 μ/r holds at 10.845 km/s.
    let y = metrics_of(
        r#"Simulation(
            world: (body: "earth"),
            bodies: { "craft": (parent: "world", hinge: Free, mass: 1000, inertia: [10, 10, 10], initial: (position: [6778137, 0, 0], velocity: [0, 11200, 0])) },
            parts: {
                "Gravity": (model: "environment.point_mass_gravity"),
                "Orbit": (model: "flight.orbit", bind: { "body": "node:craft" }),
                "Brake": (model: "flight.gravity_turn", params: { "thrust": 3000 }, bind: { "body": "node:craft" }),
                "Air": (model: "environment.us76"),
                "BackX": (model: "basics.gain", params: { "k": -1 }), "BackY": (model: "basics.gain", params: { "k": -1 }),
                "Engine": (model: "flight.vector_thrust", params: { "specific_impulse": 1e9 }, bind: { "body": "node:craft" }),
                "Feed": (model: "flight.ideal_feed"),
            },
            wires: ["Brake.force.x -> BackX.u", "Brake.force.y -> BackY.u", "BackX.y -> Engine.command.x", "BackY.y -> Engine.command.y", "Brake.force.z -> Engine.command.z"],
            connect: [("Engine.propellant", "Feed.outlet")],
            step: "1 s", integrator: "dormand_prince_54", until: "3000 s", stop_when: "Orbit.apocentre < 20000 km",
            metrics: { "first": (of: "Orbit.apocentre", at: "time >= 0 s", unit: "m"), "last": (of: "Orbit.apocentre", unit: "m") },
        )"#,
    )
    .unwrap_or_else(|e| panic!("{e}"));
    assert!(y["first"] > 1e29 && (y["last"] - 2e7).abs() < 1.0, "{y:?}");
}
