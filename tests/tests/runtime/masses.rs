//! Masses that change during the run: closed forms, comparison with the same mass in the file, phases, and bit-identical continuation.
use linkwork_assembly::{Options, load_text};
use linkwork_runtime::{Files, Program, Role, Seconds, Simulation};
use linkwork_spatial::Vec3;
use std::sync::Arc;

use crate::common;

fn seconds(x: f64) -> Seconds {
    Seconds::from_decimal(x).unwrap()
}

fn program(text: &str) -> Arc<Program> {
    let catalogue = common::catalogue();
    let loaded = load_text("sim.ron", text, &Options::new(&catalogue));
    let loaded = loaded.unwrap_or_else(|f| panic!("{}", f.render(false)));
    let program = loaded.compile(&catalogue, &Files::default());
    Arc::new(program.unwrap_or_else(|f| panic!("{:?}", f.0)))
}

fn get(sim: &Simulation, path: &str) -> f64 {
    sim.get(path).unwrap()
}

const TIGHT: &str = "step: \"10 ms\", integrator: \"dormand_prince_54\", \
                     accuracy: (relative: 1e-13, absolute: 1e-13), until: \"1 s\"";

const ROCKET_PARTS: &str = r#"
    "Full": (model: "basics.constant", params: { "value": 1.0 }),
    "Tank": (model: "flight.propellant_tank", params: { "propellant": 800, "radius": 0.4 }, bind: { "bottom": "node:rocket/tank" }),
    "Engine": (model: "flight.engine", params: { "thrust": "50 kN", "specific_impulse": 310, "flow_path": [0, 0, -1.5] }, bind: { "nozzle": "node:rocket/nozzle" }),
"#;
const ROCKET_WIRES: &str =
    r#"wires: ["Full.y -> Engine.throttle"], connect: [("Engine.propellant", "Tank.outlet")]"#;

fn rocket(spin: &str, more: &str) -> String {
    format!(
        r#"Simulation(
        bodies: {{
            "rocket": (parent: "world", hinge: Free, mass: 200, inertia: [50, 50, 20], initial: (angular: [{spin}]),
                nodes: {{ "tank": (position: [0, 0, 0.5]), "nozzle": (position: [0, 0, -1]) }}),
            "payload": (parent: "rocket", at: (position: [0, 0, 2]), mass: 100, inertia: [9, 8, 7], com: [0, 0.02, 0.3]),
        }},
        parts: {{ {ROCKET_PARTS} }}, {ROCKET_WIRES}, gravity: "none", {TIGHT}, {more})"#
    )
}

/// Tsiolkovsky: Δv = I_sp g₀ ln(m₀/m₁); and the distance until the tank is empty as its integral.
#[test]
fn a_rocket_reaches_the_speed_that_tsiolkovsky_says() {
    // The off-axis payload would rotate the rocket, so it is moved to the axis.
    let text = rocket("0, 0, 0", "").replace("com: [0, 0.02, 0.3]", "com: [0, 0, 0.3]");
    let mut sim = Simulation::of(program(&text));
    let (c, m0, m1) = (310.0 * 9.80665, 1100.0_f64, 300.0_f64);
    let flow = 50e3 / c;
    let burn = 800.0 / flow;
    sim.run_until(seconds(60.0)).unwrap();
    let dv = c * (m0 / m1).ln();
    let v = get(&sim, "rocket.velocity.z");
    assert!((v / dv - 1.0).abs() < 1e-11, "{v} {dv}");
    assert_eq!(get(&sim, "Tank.propellant"), 0.0);
    let h = c * burn - c * (m1 / flow) * (m0 / m1).ln() + dv * (60.0 - burn);
    let z = get(&sim, "rocket.position.z");
    assert!((z / h - 1.0).abs() < 1e-11, "{z} {h}");
}

/// Propellant flows from the centre of mass to the nozzle at a distance l, and the body's inertia stays: I ω̇ = −ṁ l² ω about the transverse axis.
#[test]
fn jet_damping_follows_its_closed_form() {
    let text = format!(
        r#"Simulation(
        bodies: {{ "rocket": (parent: "world", hinge: Free, mass: 200, inertia: [50, 50, 20], initial: (angular: [0.2, 0, 0]),
            nodes: {{ "tank": (position: [0, 0, 0]), "nozzle": (position: [0, 0, -1.5]) }}) }},
        parts: {{
            "Full": (model: "basics.constant", params: {{ "value": 1.0 }}),
            "Tank": (model: "flight.propellant_tank", params: {{ "propellant": 500, "radius": "10 um", "density": 1e20 }}, bind: {{ "bottom": "node:rocket/tank" }}),
            "Engine": (model: "flight.engine", params: {{ "thrust": "5 kN", "specific_impulse": 200, "flow_path": [0, 0, -1.5] }}, bind: {{ "nozzle": "node:rocket/nozzle" }}),
        }},
        {ROCKET_WIRES}, gravity: "none", {TIGHT})"#
    );
    let mut sim = Simulation::of(program(&text));
    sim.run_until(seconds(20.0)).unwrap();
    let flow = 5e3 / (200.0 * 9.80665);
    let want = 0.2 * (-flow * 1.5 * 1.5 * 20.0 / 50.0_f64).exp();
    let omega = get(&sim, "rocket.angular.x");
    // The propellant is 16 nm high, so it is not exactly a point (measured 1.6e-8).
    assert!((omega / want - 1.0).abs() < 1e-7, "{omega} {want}");
    assert!(get(&sim, "Tank.propellant") > 400.0 && want < 0.1);
}

/// A tank that is never drained gives the same mechanism as one with that mass in the file: on a chain with a loop, and in contact, for all kernels.
#[test]
fn mass_from_a_wire_is_mass_from_the_file() {
    // The tank is a cylinder of 3 kg in a rotated frame on the second link.
    let bodies = |tank: &str, parts: &str, more: &str| {
        format!(
            r#"Simulation(
            bodies: {{
                "a": (parent: "world", hinge: Pin([0, 1, 0]), mass: 2, inertia: [0.1, 0.2, 0.1], com: [0.3, 0, 0], initial: (angle: "20 deg", approximate: true)),
                "b": (parent: "a", at: (position: [0.6, 0, 0]), hinge: Ball, mass: 1, inertia: [0.02, 0.03, 0.04], com: [0.1, 0.1, 0], initial: (angular: [1, 2, 3], approximate: true),
                    nodes: {{ "tank": (position: [0.1, -0.2, 0.05], rotation: (rpy: [0.3, -0.5, 0.9])) }}),
                {tank}
            }},
            parts: {{ "G": (model: "environment.uniform_gravity", params: {{ "acceleration": [0, 0, -9.81] }}), {parts} }}, {more} {TIGHT})"#
        )
    };
    let level = 3.0 / (1000.0 * std::f64::consts::PI * 0.01);
    let ix = 3.0 * (3.0 * 0.01 + level * level) / 12.0;
    let welded = format!(
        r#""tank": (parent: "b/tank", mass: 3, com: [0, 0, {}], inertia: [{ix}, {ix}, {}]),"#,
        0.5 * level,
        0.5 * 3.0 * 0.01
    );
    let part = r#""Tank": (model: "flight.propellant_tank", params: { "propellant": 3, "radius": 0.1 }, bind: { "bottom": "node:b/tank" }),"#;
    for (more, bound) in [
        ("", 1e-10),
        // The cases are a loop, embedded and as rows, and contact with the floor.
        (
            r#"loops: { "l": (a: "b", at_a: (position: [0.4, 0, 0]), b: "world", at_b: (position: [0.8, 0, -0.4]), hinge: Ball, solve: Augment) },"#,
            1e-9,
        ),
        (
            r#"loops: { "l": (a: "b", at_a: (position: [0.4, 0, 0]), b: "world", at_b: (position: [0.8, 0, -0.4]), hinge: Ball, solve: Embed) },"#,
            1e-9,
        ),
        (
            r#"colliders: { "floor": (on: "world", at: (position: [0, 0, -0.6]), shape: HalfSpace), "tip": (on: "b", at: (position: [0.3, 0, 0]), shape: Sphere(0.1)) }, contact: (tolerance: 1e-12),"#,
            1e-6,
        ),
    ] {
        let mut wired = Simulation::of(program(&bodies("", part, more)));
        let mut filed = Simulation::of(program(&bodies(&welded, "", more)));
        // The start is projected onto the loop with the masses of the file, which gives different coordinates otherwise.
        for (path, variable) in &*filed.plan().variables.clone() {
            if variable.role == Role::State && path.starts_with(['a', 'b']) {
                wired.set(path, get(&filed, path)).unwrap();
            }
        }
        for sim in [&mut wired, &mut filed] {
            sim.run_until(seconds(1.0)).unwrap();
        }
        for path in ["a.angle", "a.rate", "b.angular.x", "b.angular.y", "b.angular.z"] {
            let (p, q) = (get(&wired, path), get(&filed, path));
            assert!((p - q).abs() < bound, "{more} {path}: {p} {q}");
        }
        // The mass has a significant effect.
        let mut empty = Simulation::of(program(&bodies("", "", more)));
        empty.run_until(seconds(1.0)).unwrap();
        let differs = |c: &str| (get(&empty, c) - get(&filed, c)).abs() > 1e-3;
        assert!(["b.angular.x", "b.angular.y", "b.angular.z"].into_iter().any(differs), "{more}");
    }
}

/// The payload separates from a rocket that has burnt half of its propellant, and a hinge catches it later: momentum is balanced with the momentary
/// masses, and results after interruptions are bit-identical.
#[test]
fn a_transition_knows_the_mass_of_the_moment_and_leaves_no_trace() {
    let phases = r#"start: "boost", phases: {
        "boost": (to: { "coast": "Tank.propellant < 400 kg" }),
        "coast": (bodies: { "payload": (parent: "world", at: (position: [0, 0, 0]), hinge: Free) },
                  to: { "caught": "Tank.propellant < 399 kg" }),
        "caught": (bodies: { "payload": (parent: "rocket", at: (position: [0, 0, 2]), hinge: Slider([0, 0, 1])) }),
    }"#;
    let program =
        program(&rocket("0, 0, 0", phases).replace("com: [0, 0.02, 0.3]", "com: [0, 0, 0.3]"));
    let mut straight = Simulation::of(program.clone());
    straight.run_until(seconds(40.0)).unwrap();
    assert_eq!(straight.phase(), "caught");
    let moves = straight.take_moves();
    // The note has the form `momentum (x, y, z) N s, unchanged; angular momentum …`.
    let along_z = |k: usize| -> f64 {
        let note = moves[k].2.notes.iter().find(|n| n.starts_with("momentum")).unwrap();
        println!("{} {note}", moves[k].1);
        assert!(note.contains(") N s, unchanged; "), "{note}");
        let inside = note.split('(').nth(1).unwrap().split(')').next().unwrap();
        inside.split(',').nth(2).unwrap().trim().parse().unwrap()
    };
    let c = 310.0 * 9.80665;
    // At the first transition 1100 kg have become 700 kg, all at one speed. The report has six digits.
    let p = 700.0 * c * (1100.0_f64 / 700.0).ln();
    assert!((along_z(0) / p - 1.0).abs() < 5e-6, "{} {p}", along_z(0));
    assert!(along_z(1) > 0.0);
    let mut sim = Simulation::of(program.clone());
    let mut n = 0;
    while sim.before(seconds(40.0)) {
        sim.step_event().unwrap();
        n += 1;
        if n % 37 == 0 {
            let bytes = sim.checkpoint("").unwrap();
            sim = Simulation::of(program.clone());
            sim.restore(&bytes).unwrap();
        } else if n % 23 == 0 {
            sim = sim.fork();
        }
    }
    assert_eq!(sim.state(), straight.state());
}

/// An impossible mass stops the run with the body, the fact and the remedy.
#[test]
fn impossible_masses_stop_the_run_in_order() {
    let text = rocket("0, 0, 0", "")
        .replace("wires: [", "wires: [\"Minus.y -> Filling.flow\", ")
        .replace("\"Tank.outlet\")", "\"Tank.outlet\", \"Filling.tank\")")
        .replace(
            "parts: {",
            "parts: { \"Filling\": (model: \"flight.drain\"), \"Minus\": (model: \"basics.constant\", params: { \"value\": -1e308 }),",
        );
    let mut sim = Simulation::of(program(&text));
    let error = sim.run_until(seconds(60.0)).unwrap_err().to_string();
    assert!(error.contains("Tank") || error.contains("rocket"), "{error}");
    assert!(error.contains("help:"), "{error}");
}

/// A vehicle far from the origin of W with an arm, a tank that empties and a separate second body: mass, centre and inertia computed by hand.
#[test]
fn the_mass_of_a_vehicle_is_that_of_all_its_bodies_and_tanks() {
    let text = r#"Simulation(
    bodies: {
        "hub": (parent: "world", hinge: Free, mass: 10, com: [0, 0, 0.5], inertia: [1, 2, 3], initial: (position: [7e6, 0, 0], rotation: (rpy: [0.3, -0.5, 1])), nodes: { "n": (position: [0, 0, 0.5]), "bottom": (position: [1, 0, 0]) }),
        "arm": (parent: "hub", at: (position: [0, 2, 0.5]), hinge: Pin([1, 0, 0]), initial: (angle: "90 deg"), mass: 4, com: [0, 1, 0], inertia: [0.4, 0.01, 0.4]),
        "other": (parent: "world", hinge: Free, mass: 50, inertia: Sphere(1), initial: (position: [7e6, 9, 0])),
    },
    gravity: "none",
    parts: {
        "Tank": (model: "flight.propellant_tank", params: { "propellant": 6, "radius": "10 cm", "density": 1000 }, bind: { "bottom": "node:hub/bottom" }),
        "Flow": (model: "basics.constant", params: { "value": 0.5 }),
        "Drain": (model: "flight.drain"),
        "Mass": (model: "sensors.mass_properties", bind: { "node": "node:hub/n" }),
    },
    wires: ["Flow.y -> Drain.flow"], connect: [("Drain.tank", "Tank.outlet")],
    step: "0.1 s", until: "20 s",
)"#;
    let mut sim = Simulation::of(program(text));
    for t in [0.0, 4.0, 20.0] {
        sim.run_until(seconds(t)).unwrap();
        let m = (6.0 - 0.5 * t).max(0.0);
        let level = m / (1000.0 * std::f64::consts::PI * 0.01);
        // The arm points along z of the hub.
        let all = [
            (10.0, Vec3::zeros(), Vec3::new(1.0, 2.0, 3.0)),
            (4.0, Vec3::new(0.0, 2.0, 1.0), Vec3::new(0.4, 0.4, 0.01)),
            (m, Vec3::new(1.0, 0.0, 0.5 * level - 0.5), {
                let across = m * (3.0 * 0.01 + level * level) / 12.0;
                Vec3::new(across, across, 0.5 * m * 0.01)
            }),
        ];
        let mass: f64 = all.iter().map(|(m, ..)| m).sum();
        let centre: Vec3 = all.iter().map(|(m, p, _)| p * *m).sum::<Vec3>() / mass;
        let about = all.iter().map(|(m, p, own)| {
            let d = p - centre;
            own + Vec3::new(d.y * d.y + d.z * d.z, d.x * d.x + d.z * d.z, d.x * d.x + d.y * d.y)
                * *m
        });
        let inertia: Vec3 = about.sum();
        let xy: f64 = all.iter().map(|(m, p, _)| -m * (p - centre).x * (p - centre).y).sum();
        let three = |name: &str| {
            Vec3::from(["x", "y", "z"].map(|c| get(&sim, &format!("Mass.{name}.{c}"))))
        };
        assert!((get(&sim, "Mass.mass") - mass).abs() < 1e-9, "{t}");
        assert!((three("centre") - centre).norm() < 1e-8, "{t}: {} {centre}", three("centre"));
        assert!((three("inertia") - inertia).norm() < 1e-7, "{t}: {} {inertia}", three("inertia"));
        assert!((get(&sim, "Mass.products.x") - xy).abs() < 1e-7, "{t}: {xy}");
    }
}
