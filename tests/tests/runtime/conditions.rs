//! Consistent semantics of conditions and guards: equality, levels at the start, several guards at one instant, the end of a run within a step. The
//! cases are public bug reports of other tools, tried on this one.
use crate::common::metrics_of;
use std::collections::BTreeMap;

fn metrics(text: &str) -> BTreeMap<String, f64> {
    metrics_of(text).unwrap_or_else(|e| panic!("{e}"))
}

fn close(metrics: &BTreeMap<String, f64>, name: &str, want: f64, within: f64) {
    let y = metrics[name];
    assert!((y - want).abs() <= within, "{name}: {y}, not {want}");
}

/// OpenModelica #13680: a threshold that is reached exactly. A valve closes in one second to exactly 0 and stays closed.
#[test]
fn a_condition_holds_with_equality() {
    let y = metrics(
        r#"Simulation(
            parts: {
                "Clock": (model: "basics.ramp", params: { "slope": 1 }),
                "Valve": (model: "basics.lookup", params: { "table": [[0, 1], [1, 0], [2, 0]] }),
                "Rise": (model: "basics.lookup", params: { "table": [[0, 0], [1, 0.25], [2, 0.25]] }),
                "Count": (model: "basics.statistics", rate: "10 Hz"),
            },
            wires: ["Clock.y -> Valve.u", "Clock.y -> Rise.u", "Clock.y -> Count.u"],
            step: "10 ms", until: "2 s",
            metrics: {
                "shut": (when: "Valve.y <= 0", take: "last"),
                "full": (when: "Rise.y >= 0.25", take: "last"),
                "when shut": (of: "Clock.y", at: "Valve.y <= 0"),
                "when five": (of: "Clock.y", at: "Count.count >= 5"),
                "phase": (of: "Phases.shut", take: "last"),
                "since": (when: "phase_time >= 1 s", take: "last"),
            },
            start: "open",
            phases: { "open": (to: { "shut": "Valve.y <= 0" }), "shut": () },
        )"#,
    );
    close(&y, "shut", 1.0, 0.0);
    close(&y, "full", 1.0, 0.0);
    close(&y, "when shut", 1.0, 1e-12);
    // The fifth count is at 0.4 s, and the output shows it from the next sample on.
    close(&y, "when five", 0.5, 1e-9);
    close(&y, "phase", 1.0, 2e-12);
    close(&y, "since", 1.0, 0.0);
}

/// Simulink's relay and Modelica's hysteresis use the level at the start, with `>=` (Drake #9707, OpenModelica #13680).
#[test]
fn a_relay_that_starts_above_its_threshold_is_on_and_one_that_rests_at_it() {
    let y = metrics(
        r#"Simulation(
            parts: {
                "High": (model: "basics.constant", params: { "value": 1 }),
                "Low": (model: "basics.constant", params: { "value": 0 }),
                "Clock": (model: "basics.ramp", params: { "slope": 1 }),
                "Rise": (model: "basics.lookup", params: { "table": [[0, 0], [1, 0.25], [2, 0.25]] }),
                "A": (model: "basics.relay", params: { "on": 0.25, "off": 0.1 }),
                "B": (model: "basics.relay", params: { "on": 0.25, "off": 0.1 }),
                "C": (model: "basics.relay", params: { "on": 0.25, "off": 0.1, "start": true }),
            },
            wires: ["Clock.y -> Rise.u", "High.y -> A.u", "Rise.y -> B.u", "Low.y -> C.u"],
            step: "10 ms", until: "2 s",
            metrics: { "A": (of: "A.y", take: "last"), "B": (of: "B.y", take: "last"), "C": (of: "C.y", take: "last") },
        )"#,
    );
    assert_eq!([y["A"], y["B"], y["C"]], [1.0, 1.0, 0.0]);
}

#[test]
fn a_ball_that_starts_on_the_floor_lies_there() {
    for params in [r#""height": 0"#, r#""height": 1, "restitution": 0.2"#] {
        for (method, step) in [("rk4", "10 ms"), ("dormand_prince_54", "1 s")] {
            let y = metrics(&format!(
                r#"Simulation(
                    parts: {{ "Ball": (model: "basics.bouncing_ball", params: {{ "gravity": 9.80665, {params} }}) }},
                    step: "{step}", integrator: "{method}", until: "3 s",
                    metrics: {{ "height": (of: "Ball.height", take: "last") }},
                )"#
            ));
            close(&y, "height", 0.0, 1e-9);
        }
    }
}

/// A sensor jumps from 320 K to 250 K: both thresholds are passed at one instant, and the heater is on from then on.
#[test]
fn a_thermostat_that_is_passed_at_once_heats() {
    let y = metrics(
        r#"Simulation(
            parts: {
                "T": (model: "basics.step", params: { "time": 5, "before": 320, "after": 250 }),
                "H": (model: "basics.hold", rate: "1 s"),
                "Supply": (model: "power.ideal_supply", params: { "voltage": 28 }),
                "Box": (model: "power.thermal_boundary"),
                "Heater": (model: "power.heater", params: { "power": 10, "on_below": 270, "band": 5 }),
            },
            wires: ["T.y -> H.u", "H.y -> Box.temperature"],
            connect: [("Heater.supply", "Supply.terminal"), ("Heater.node", "Box.port")],
            step: "100 ms", until: "20 s",
            metrics: { "on": (of: "Heater.on", take: "last"), "heat": (of: "Heater.node.heat", take: "last") },
        )"#,
    );
    assert_eq!((y["on"], y["heat"]), (1.0, 10.0));
}

/// A step at 0.55 s, or at a sample (OMSimulator #668, #1609): RK4 gave 0.483 and 0.517.
#[test]
fn a_step_is_integrated_exactly() {
    for (time, want) in [(0.55, 0.45), (0.5, 0.5)] {
        let y = metrics(&format!(
            r#"Simulation(
                parts: {{ "Step": (model: "basics.step", params: {{ "time": {time}, "after": 1 }}), "I": (model: "basics.integrator") }},
                wires: ["Step.y -> I.u"], step: "0.1 s", until: "1 s",
                metrics: {{ "integral": (of: "I.y", take: "last") }},
            )"#
        ));
        close(&y, "integral", want, 1e-11);
    }
}

/// nyx #377, #381: a low lunar orbit reaches the surface between two samples of a minute, and the run ends there.
#[test]
fn stop_when_ends_the_run_within_the_step() {
    for (stop, wires) in [
        ("Down.y", r#""Orbit.height -> Depth.u", "Depth.y -> Down.u""#),
        ("Orbit.height <= 0 m", r#""Orbit.height -> Depth.u", "Depth.y -> Down.u""#),
    ] {
        let y = metrics(&format!(
            r#"Simulation(
                bodies: {{ "craft": (parent: "world", hinge: Free, mass: 100, inertia: Sphere(0.5), initial: (position: [1837400, 0, 0], velocity: [0, 0, 1500])) }},
                world: (body: "moon", mu: 4.9028e12, radius: 1737400),
                parts: {{
                    "G": (model: "environment.point_mass_gravity"),
                    "Orbit": (model: "flight.orbit", bind: {{ "body": "node:craft" }}),
                    "Down": (model: "basics.relay", params: {{ "on": 0, "off": -1000 }}),
                    "Depth": (model: "basics.gain", params: {{ "k": -1 }}),
                }},
                wires: [{wires}], stop_when: "{stop}",
                step: "60 s", integrator: "dormand_prince_54", accuracy: (relative: 1e-11, absolute: 1e-6), until: "2 h",
                metrics: {{ "height": (of: "Orbit.height", take: "last", unit: "m") }},
            )"#
        ));
        close(&y, "height", 0.0, 1e-3);
    }
}

/// A burn of 400 N for 20 s at 5000 s on 1000 kg (RocketPy #411, OpenRocket #2432): with samples of an hour it was lost.
#[test]
fn a_burn_between_two_rows_is_not_lost() {
    for throttle in [
        r#""Clock": (model: "basics.ramp", params: { "slope": 1 }),
           "Throttle": (model: "basics.lookup", params: { "table": [[0, 0], [5000, 0], [5000.001, 1], [5020, 1], [5020.001, 0], [9000, 0]] }),"#,
        r#""On": (model: "basics.step", params: { "time": 5000 }),
           "Off": (model: "basics.step", params: { "time": 5020, "after": -1 }),
           "Throttle": (model: "basics.sum"),"#,
    ] {
        let wires = match throttle.contains("Clock") {
            true => r#""Clock.y -> Throttle.u","#,
            false => r#""On.y -> Throttle.u", "Off.y -> Throttle.u","#,
        };
        for row in ["1 s", "60 s", "600 s", "3600 s"] {
            let y = metrics(&format!(
                r#"Simulation(
                    bodies: {{ "craft": (parent: "world", hinge: Free, mass: 1000, inertia: Sphere(0.5)) }},
                    parts: {{ {throttle}
                        "Feed": (model: "flight.ideal_feed"),
                        "Engine": (model: "flight.engine", params: {{ "thrust": 400, "specific_impulse": 300 }}, bind: {{ "nozzle": "node:craft" }}) }},
                    wires: [{wires} "Throttle.y -> Engine.throttle"], connect: [("Engine.propellant", "Feed.outlet")], gravity: "none",
                    step: "{row}", integrator: "dormand_prince_54", until: "7200 s",
                    metrics: {{ "speed": (of: "craft.velocity.z", take: "last") }},
                )"#
            ));
            close(&y, "speed", 8.0, 1e-6);
        }
    }
}

/// A wheel at its speed limit with friction, and an engine that a controller throttles below its minimum: jumps in a feedback loop. One second of
/// simulation took minutes.
/// second of simulation took minutes.
#[test]
fn jumps_in_a_feedback_have_two_thresholds() {
    for (body, friction, method) in [("Locked", 0.0, "rk4"), ("Free", 1e-4, "dormand_prince_54")] {
        let y = metrics(&format!(
            r#"Simulation(
                bodies: {{ "b": (parent: "world", hinge: {body}, mass: 100, inertia: [10, 10, 10]) }},
                parts: {{
                    "T": (model: "basics.constant", params: {{ "value": 0.1 }}),
                    "W": (model: "flight.reaction_wheel", params: {{ "inertia": 0.01, "speed_max": 95, "torque_max": 0.1, "viscous": {friction} }}, bind: {{ "wheel": "node:b" }}),
                    "S": (model: "power.ideal_supply", params: {{ "voltage": 28 }}),
                }},
                connect: [("W.supply", "S.terminal")],
                wires: ["T.y -> W.torque"], gravity: "none", step: "1 s", integrator: "{method}", until: "15 s",
                metrics: {{ "speed": (of: "W.speed", take: "max"), "last": (of: "W.speed", take: "last") }},
            )"#
        ));
        close(&y, "speed", 95.0, 0.1);
        close(&y, "last", 95.0, 0.1);
    }
    let y = metrics(
        r#"Simulation(
            bodies: { "c": (parent: "world", hinge: Slider([0, 0, 1]), mass: 1000, inertia: [100, 100, 100], initial: (position: 10, rate: 0)) },
            parts: {
                "G": (model: "environment.uniform_gravity", params: { "acceleration": [0, 0, -1.62] }),
                "M": (model: "sensors.motion", bind: { "mount": "node:c" }),
                "V": (model: "basics.gain", params: { "k": -0.5, "offset": 0.5 }),
                "Feed": (model: "flight.ideal_feed"),
                "E": (model: "flight.engine", params: { "thrust": 3240, "specific_impulse": 300, "throttle_min": 0.6 }, bind: { "nozzle": "node:c" }),
            },
            wires: ["M.velocity.z -> V.u", "V.y -> E.throttle"], connect: [("E.propellant", "Feed.outlet")],
            step: "1 s", integrator: "dormand_prince_54", until: "5 s",
            metrics: { "speed": (of: "M.velocity.z", take: "last") },
        )"#,
    );
    // The final speed is between those at which the throttle is 0.6 and 0.98 · 0.6.
    close(&y, "speed", -0.19, 0.02);
}

/// A canopy whose `deploy` is 1 in the phase that adds it opens at once.
#[test]
fn a_canopy_that_is_commanded_when_it_appears_opens() {
    let y = metrics(
        r#"Simulation(
            bodies: { "c": (parent: "world", hinge: Free, mass: 100, inertia: [10, 10, 10], initial: (position: [0, 0, 1000], velocity: [0, 0, -50])) },
            world: (body: "earth", site: (latitude: 0, longitude: 0, turning: false)),
            parts: {
                "G": (model: "environment.uniform_gravity", params: { "acceleration": [0, 0, -9.81] }),
                "Air": (model: "environment.exponential_atmosphere", params: { "density": 1.2, "scale_height": 8000, "temperature": 288, "gas_constant": 287.05, "heat_ratio": 1.4 }),
                "One": (model: "basics.constant", params: { "value": 1 }),
            },
            step: "10 ms", until: "10 s", start: "falls",
            phases: {
                "falls": (to: { "opens": "time >= 1 s" }),
                "opens": (
                    parts: { "Canopy": (model: "flight.canopy", params: { "diameter": 10, "drag_coefficient": 0.8, "filling_time": 1, "stages": [()] }, bind: { "canopy": "node:c" }) },
                    wires: ["One.y -> Canopy.deploy"],
                ),
            },
            metrics: { "share": (of: "Canopy.share", take: "last") },
        )"#,
    );
    close(&y, "share", 1.0, 0.0);
}

/// After its arrival a guidance commands zero; the last force used to be held for ever.
#[test]
fn a_powered_descent_ends_at_its_arrival() {
    let y = metrics(
        r#"Simulation(
            bodies: { "c": (parent: "world", hinge: Free, mass: 1000, inertia: [100, 100, 100], initial: (position: [100, 0, 500], velocity: [-5, 0, -30])) },
            parts: {
                "G": (model: "environment.uniform_gravity", params: { "acceleration": [0, 0, -1.62] }),
                "M": (model: "basics.constant", params: { "value": 1000 }),
                "D": (model: "flight.powered_descent", params: { "thrust_max": 20000, "arrival": 20, "position": [0, 0, 1], "law": "linear" }, bind: { "body": "node:c" }, rate: "10 Hz"),
                "Feed": (model: "flight.ideal_feed"),
                "V": (model: "flight.vector_thrust", params: { "specific_impulse": 300 }, bind: { "body": "node:c" }),
            },
            wires: ["M.y -> D.mass", "D.force -> V.command"], connect: [("V.propellant", "Feed.outlet")],
            step: "10 ms", until: "25 s",
            metrics: { "at the end": (of: "c.position.z", at: "time >= 20 s"), "thrust": (of: "V.thrust", take: "last") },
        )"#,
    );
    close(&y, "at the end", 1.0, 0.1);
    close(&y, "thrust", 0.0, 1e-9);
}
