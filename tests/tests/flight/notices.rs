//! Warnings of a run that continues: commands without effect, air beyond its data, a foot outside the map, separation of bodies that are already
//! apart.
use crate::common::{get, scene, seconds};
use linkwork_runtime::Simulation;

/// Returns time, message and remedy of the warnings since the last call.
fn told(sim: &mut Simulation) -> Vec<(f64, String)> {
    let one = |(t, fault): linkwork_runtime::Notice| {
        (t, format!("{} | {}", fault.message, fault.help.unwrap_or_default()))
    };
    sim.take_notices().into_iter().map(one).collect()
}

fn has(told: &[(f64, String)], time: f64, parts: &[&str]) {
    assert_eq!(told.len(), 1, "{told:?}");
    assert!((told[0].0 - time).abs() < 1e-3, "{told:?}");
    for part in parts {
        assert!(told[0].1.contains(part), "{part}: {told:?}");
    }
}

/// The command is a sine: it rises through ½ at 5/6 s, and every ten seconds after that.
#[test]
fn a_canopy_that_is_commanded_again_tells_so_once_and_stays_open() {
    let text = r#"Simulation(
    bodies: { "pack": (parent: "world", hinge: Free, mass: 100, inertia: [10, 10, 10], initial: (position: [0, 0, 9000], velocity: [0, 0, -100])) },
    parts: {
        "Gravity": (model: "environment.uniform_gravity", params: { "acceleration": [0, 0, -3.7] }),
        "Air": (model: "environment.exponential_atmosphere", params: { "density": 0.020, "scale_height": 11100, "temperature": 210, "gas_constant": 191.8, "heat_ratio": 1.33, "heating_constant": 1.9027e-4 }),
        "Command": (model: "basics.sine", params: { "amplitude": 1, "frequency": 0.1 }),
        "Canopy": (model: "flight.canopy", params: { "diameter": 10, "drag_coefficient": 0.67, "filling_time": 1 }, bind: { "canopy": "node:pack" }),
    },
    wires: ["Command.y -> Canopy.deploy"],
    step: "10 ms", integrator: "rk4", until: "40 s",
)"#;
    let mut sim = scene(text, &[]).unwrap();
    sim.run_until(seconds(10.0)).unwrap();
    assert_eq!(sim.get("Canopy.share").unwrap(), 1.0);
    assert!(told(&mut sim).is_empty(), "the command that opens it is no second one");
    sim.run_until(seconds(40.0)).unwrap();
    assert_eq!(sim.get("Canopy.share").unwrap(), 1.0);
    let at = 10.0 + 10.0 / 12.0;
    let words = [
        "`Canopy`: it is commanded to open at 10.8333",
        "has been open since 0.8333",
        "| the command has no effect: command it once",
    ];
    has(&told(&mut sim), at, &words);
    assert!(told(&mut sim).is_empty());
}

/// Faster than the last Mach number of its table when it opens: reported at that instant.
#[test]
fn a_canopy_beyond_its_table_tells_so_or_stops_the_run() {
    let text = |outside: &str| {
        format!(
            r#"Simulation(
    bodies: {{ "pack": (parent: "world", hinge: Free, mass: 1000, inertia: [10, 10, 10], initial: (position: [0, 0, 9000], velocity: [0, 900, 0])) }},
    parts: {{
        "Gravity": (model: "environment.uniform_gravity", params: {{ "acceleration": [0, 0, -3.72076] }}),
        "Air": (model: "environment.exponential_atmosphere", params: {{ "temperature": 210, "density": 0.020, "scale_height": 11100, "gas_constant": 191.8, "heat_ratio": 1.33, "heating_constant": 1.9027e-4 }}),
        "Canopy": (model: "flight.canopy", params: {{ "diameter": 10, "drag_coefficient": 0.67, "start": "2.005 s", "filling_time": 1, "outside": {outside} }}, bind: {{ "canopy": "node:pack" }}),
    }},
    step: "10 ms", integrator: "rk4", until: "10 s",
)"#
        )
    };
    let mut sim = scene(&text("clamp"), &[]).unwrap();
    sim.run_until(seconds(10.0)).unwrap();
    has(&told(&mut sim), 2.005, &["`Canopy`: Mach 3.88", "which end at 2.6", "`outside: stop`"]);
    assert_eq!(sim.get("Canopy.state.outside").unwrap(), 1.0);
    let mut sim = scene(&text("stop"), &[]).unwrap();
    let e = sim.run_until(seconds(10.0)).unwrap_err();
    assert!((e.time - 2.005).abs() < 1e-9 && e.path == "Canopy", "{e}");
    assert!(e.message.contains("`Canopy`: Mach 3.88") && e.message.contains("end at 2.6"), "{e}");
    assert!(e.help.unwrap().contains("extend the rows") && told(&mut sim).is_empty());
}

/// A satellite leaves the standard atmosphere at 1000 km at 28.4 s. This is reported at the next sample.
#[test]
fn air_beyond_its_data_is_told_once_or_stops_the_run() {
    let text = |outside: &str| {
        format!(
            r#"Simulation(
    bodies: {{ "craft": (parent: "world", hinge: Free, mass: 100, inertia: [10, 10, 10], initial: (position: [7350000, 0, 0], velocity: [1000, 7000, 0])) }},
    world: (body: "earth"),
    parts: {{
        "Gravity": (model: "environment.point_mass_gravity"),
        "Air": (model: "environment.us76", params: {{ {outside} }}),
        "Drag": (model: "flight.drag", params: {{ "coefficient": 2, "area": 1, "heating_constant": 0 }}, bind: {{ "body": "node:craft" }}),
        "Other": (model: "flight.drag", params: {{ "coefficient": 2, "area": 1, "heating_constant": 0 }}, bind: {{ "body": "node:craft" }}),
    }},
    step: "1 s", integrator: "rk4", until: "100 s",
)"#
        )
    };
    for outside in ["", "\"outside\": clamp"] {
        let mut sim = scene(&text(outside), &[]).unwrap();
        sim.run_until(seconds(20.0)).unwrap();
        assert!(told(&mut sim).is_empty());
        sim.run_until(seconds(100.0)).unwrap();
        let all = told(&mut sim);
        has(
            &all,
            29.0,
            &[
                "`Air`: its data extend from -5 to 1000 km, not to 1000.",
                "requested by `Drag`",
                "`outside`",
            ],
        );
    }
    // The user expects with `continue` that the run does not stop, so no message is printed.
    let mut sim = scene(&text("\"outside\": continue"), &[]).unwrap();
    sim.run_until(seconds(100.0)).unwrap();
    assert!(told(&mut sim).is_empty());
    let mut sim = scene(&text("\"outside\": stop"), &[]).unwrap();
    let e = sim.run_until(seconds(100.0)).unwrap_err();
    assert!(e.time == 29.0 && e.path == "Air" && e.help.is_some(), "{e}");
    assert!(e.to_string().contains("not to 1000.") && get(&sim, "craft.position").norm() < 7.4e6);
}

/// A lander that comes down at the edge of its map: a foot is lower than the nearest edge, which is at 0.
#[test]
fn a_foot_beside_the_map_is_told() {
    let text = |x: f64| {
        format!(
            r#"Simulation(
    bodies: {{ "lander": (
        parent: "world", hinge: Free, mass: 100, inertia: [50, 50, 50], initial: (position: [{x}, 0, 3], velocity: [0, 0, -1]),
        nodes: {{ "one": (position: [2, 0, -1]), "two": (position: [-2, 1, -1]), "three": (position: [-2, -1, -1]) }},
    ) }},
    parts: {{
        "Gravity": (model: "environment.uniform_gravity", params: {{ "acceleration": [0, 0, -1.6] }}),
        "Ground": (model: "environment.flat", params: {{ "size": 100, "soil": {{ "kind": "lunar" }} }}),
        "One": (model: "flight.crushable_leg", params: {{ "stages": [(stroke: 0.3, force: 400)], "stiffness": 1e5, "damping": 500 }}, bind: {{ "foot": "node:lander/one" }}),
        "Two": (model: "flight.crushable_leg", params: {{ "stages": [(stroke: 0.3, force: 400)], "stiffness": 1e5, "damping": 500 }}, bind: {{ "foot": "node:lander/two" }}),
        "Three": (model: "flight.crushable_leg", params: {{ "stages": [(stroke: 0.3, force: 400)], "stiffness": 1e5, "damping": 500 }}, bind: {{ "foot": "node:lander/three" }}),
    }},
    step: "1 ms", integrator: "rk4", until: "2 s",
)"#
        )
    };
    let mut sim = scene(&text(40.0), &[]).unwrap();
    sim.run_until(seconds(2.0)).unwrap();
    assert!(told(&mut sim).is_empty() && sim.get("One.crushed").unwrap() > 0.0);
    // One foot is beyond 50 m. It falls below the height of the edge at 2 = t + 0.8 t².
    let mut sim = scene(&text(49.0), &[]).unwrap();
    // Later the lander tips over its other feet, back onto the map.
    sim.run_until(seconds(1.3)).unwrap();
    let at = (-1.0 + 7.4f64.sqrt()) / 1.6;
    has(
        &told(&mut sim),
        at,
        &[
            "`Ground`: the map extends from (-50.0, -50.0) to (50.0, 50.0) m",
            "no ground at (51.0, ",
            "requested by `One`",
            "make the map larger",
        ],
    );
    assert!(sim.get("One.crushed").unwrap() == 0.0 && sim.get("Two.crushed").unwrap() > 0.0);
}

/// A phase whose spring finds its bodies already apart reports this at its start; if they are together, nothing is reported.
#[test]
fn a_separation_of_what_is_gone_is_told() {
    let text = |speed: f64| {
        format!(
            r#"Simulation(
    bodies: {{
        "bus": (parent: "world", hinge: Free, mass: 100, inertia: [10, 10, 10], initial: {{}}),
        "probe": (parent: "world", hinge: Free, mass: 10, inertia: [1, 1, 1], initial: (velocity: [{speed}, 0, 0])),
    }},
    start: "coast",
    phases: {{
        "coast": (to: {{ "apart": "time > 2 s" }}),
        "apart": (parts: {{
            "Spring": (model: "flight.separation_spring", params: {{ "stiffness": 100, "stroke": 0.1 }}, bind: {{ "a": "node:bus", "b": "node:probe" }}),
            "Kick": (model: "flight.kickoff_spring", params: {{ "stiffness": 100, "length": 0.2 }}, bind: {{ "a": "node:bus", "b": "node:probe" }}),
        }}),
    }},
    gravity: "none", step: "100 ms", integrator: "rk4", until: "5 s",
)"#
        )
    };
    let run = |speed: f64| {
        let mut sim = scene(&text(speed), &[]).unwrap();
        sim.run_until(seconds(5.0)).unwrap();
        assert_eq!(sim.phase(), "apart");
        told(&mut sim)
    };
    assert!(run(0.02).is_empty());
    let all = run(0.5);
    assert_eq!(all.len(), 2, "{all:?}");
    for (name, words) in [
        ("`Kick`: its ends start 1.000", "its free length is 0.2 m"),
        ("`Spring`: its nodes start 1.000", "its stroke is 0.1 m"),
    ] {
        let one = all.iter().find(|(_, text)| text.contains(name)).unwrap();
        assert!(
            (one.0 - 2.0).abs() < 1e-6 && one.1.contains(words) && one.1.contains("never pushes"),
            "{one:?}"
        );
    }
}
