//! Hinge loads, forces between pairs of bodies, resistance to rolling and spinning, and belts, as in users' files, read by metrics, logs and
//! connections. The cases: reactions (drake #11723, #292, #12769; bullet3 #406, #2966; box2d.c #160), rolling friction and belts (nphysics #204;
//! cannon.js #256; dart #473; bullet3 #4188; gz-physics #569).
use crate::common;
use linkwork_runtime::{Seconds, Simulation};

pub(super) fn sim(text: &str) -> Simulation {
    common::scene(text, &[]).unwrap_or_else(|e| panic!("{e}"))
}

pub(super) const GRAVITY: &str = r#""Gravity": (model: "environment.uniform_gravity", params: { "acceleration": [0, 0, -9.81] })"#;

pub(super) fn until(sim: &mut Simulation, t: f64) {
    sim.run_until(Seconds::from_decimal(t).unwrap()).unwrap();
}

pub(super) fn three(sim: &Simulation, stem: &str) -> [f64; 3] {
    ["x", "y", "z"].map(|c| sim.get(&format!("{stem}.{c}")).unwrap())
}

#[track_caller]
pub(super) fn near(a: f64, b: f64, tolerance: f64) {
    assert!((a - b).abs() <= tolerance, "{a} is not {b} within {tolerance}");
}

/// A pendulum released at 90 degrees, with variants of its pin and of the simulation.
fn pendulum(more: &str) -> String {
    format!(
        r#"Simulation(bodies: {{
            "bob": (parent: "world", hinge: Pin([0, 1, 0]), reaction: true, initial: (angle: "90 deg"), mass: 2, com: [0, 0, -1], inertia: [1e-9, 1e-9, 1e-9]) }},
            parts: {{ {GRAVITY} }}, step: "1 ms", until: "1 s", {more})"#
    )
}

/// The force in the pin is m g cos φ + m ω² l along the rod, 3 m g = 58.86 N at the bottom; across it m g sin φ − m l φ̈ = 0.
#[test]
fn the_pin_of_a_pendulum_carries_three_times_its_weight() {
    let contact = "contact: ()";
    for (more, tolerance) in [("", 1e-5), ("integrator: \"verner_87\"", 1e-6), (contact, 0.3)] {
        let mut sim = sim(&pendulum(more));
        let mut most: f64 = 0.0;
        for k in 1..1000 {
            until(&mut sim, f64::from(k) / 1000.0);
            let [x, y, z] = three(&sim, "bob.reaction_force");
            let (angle, rate) = (sim.get("bob.angle").unwrap(), sim.get("bob.rate").unwrap());
            near(z, 2.0 * 9.81 * angle.cos() + 2.0 * rate * rate, tolerance);
            near(x, 0.0, tolerance);
            near(y, 0.0, 1e-9);
            near(sim.get("bob.effort").unwrap(), 0.0, 1e-6);
            most = most.max(z);
        }
        near(most, 58.86, 2.0 * tolerance);
    }
}

/// Metrics find the largest force inside steps, also with samples of 50 ms.
#[test]
fn metrics_and_conditions_see_reactions_inside_steps() {
    let metrics = r#"step: "50 ms", integrator: "verner_87",
        metrics: { "pull": (of: "bob.reaction_force.z", take: "max"), "angle": (of: "bob.angle", at: "bob.reaction_force.z > 40 N") }"#;
    let text = pendulum(metrics).replacen("step: \"1 ms\", ", "", 1);
    let found = common::metrics_of(&text).unwrap_or_else(|e| panic!("{e}"));
    near(found["pull"], 58.86, 1e-4);
    // The angle follows from 3 m g cos φ = 40.
    near(found["angle"], (40.0_f64 / 58.86).acos(), 1e-4);
}

/// The same pin as a loop of a free body: the free hinge has zero load, and a welded sensor at the world carries the load of the loop.
#[test]
fn loops_carry_what_hinges_do_not() {
    for solve in ["Embed", "Augment"] {
        let text = format!(
            r#"Simulation(bodies: {{
                "post": (parent: "world", reaction: true, mass: 5, com: [0.3, 0, 0], inertia: [0.1, 0.1, 0.1]),
                "bob": (parent: "world", hinge: Free, reaction: true, initial: (rotation: (rpy: [0, "90 deg", 0])), mass: 2, com: [0, 0, -1], inertia: [1e-3, 1e-3, 1e-3]) }},
                loops: {{ "pin": (a: "post", b: "bob", hinge: Pin([0, 1, 0]), solve: {solve}) }},
                parts: {{ {GRAVITY} }}, step: "1 ms", until: "1 s")"#
        );
        let mut sim = sim(&text);
        for k in 1..40 {
            until(&mut sim, f64::from(k) * 0.02);
            let free = [three(&sim, "bob.reaction_force"), three(&sim, "bob.reaction_moment")];
            assert!(free.concat().iter().all(|x| x.abs() < 1e-8), "{solve}: {free:?}");
            let [x, _, z] = three(&sim, "post.reaction_force");
            let pin = [0, 1, 2].map(|i| sim.get(&format!("Mechanism.pin.force[{i}]")).unwrap());
            let size = pin.iter().map(|f| f * f).sum::<f64>().sqrt();
            // The post carries its weight and the pull of the bob.
            near((x * x + (z - 5.0 * 9.81).powi(2)).sqrt(), size, 1e-8);
        }
    }
}

/// A locked hinge measures the load of its bodies without adding coordinates: the motion is bit-identical with and without the measurement.
#[test]
fn a_locked_hinge_reports_its_load_and_changes_nothing() {
    let text = |reaction: &str| {
        format!(
            r#"Simulation(bodies: {{
                "wall": (parent: "world", {reaction} mass: 3, com: [0.4, 0, 0], inertia: [0.1, 0.1, 0.1]),
                "beam": (parent: "wall", at: (position: [0.8, 0, 0]), {reaction} mass: 2, com: [0.4, 0, 0], inertia: [0.1, 0.1, 0.1]) }},
                parts: {{ {GRAVITY} }}, step: "1 ms", until: "1 s")"#
        )
    };
    let mut with = sim(&text("reaction: true,"));
    until(&mut with, 0.01);
    near(three(&with, "wall.reaction_force")[2], 5.0 * 9.81, 1e-12);
    near(three(&with, "wall.reaction_moment")[1], -9.81 * (3.0 * 0.4 + 2.0 * 1.2), 1e-12);
    near(three(&with, "beam.reaction_moment")[1], -9.81 * 2.0 * 0.4, 1e-12);
    assert!(with.get("wall.angle").is_err() && with.get("wall.effort").is_err());
    // If the file does not request the reaction, the remedy names the field.
    let without = sim(&text(""));
    let told = without.get("wall.reaction_force.z").unwrap_err();
    assert!(told.help.contains("`reaction: true`"), "{told:?}");
}

/// A crank that follows a profile: its effort equals inverse dynamics, m r² α + m g r cos φ.
#[test]
fn a_prescribed_crank_reports_the_torque_that_it_takes() {
    let text = format!(
        r#"Simulation(bodies: {{
            "crank": (parent: "world", hinge: Pin(axis: [0, -1, 0], prescribed: true), reaction: true, mass: 2, com: [0.5, 0, 0], inertia: [1e-12, 1e-12, 1e-12]) }},
            parts: {{ {GRAVITY},
                "Motion": (model: "basics.hinge_trajectory", params: {{ "profile": [[0, "2 rad/s^2"], [5, 2]], "gives": "acceleration", "between": "hold" }}, bind: {{ "hinge": "hinge:crank" }}) }},
            step: "1 ms", until: "1 s")"#
    );
    let mut sim = sim(&text);
    for k in 1..20 {
        until(&mut sim, f64::from(k) * 0.04);
        let angle = sim.get("crank.angle").unwrap();
        let want = 2.0 * 0.25 * 2.0 + 2.0 * 9.81 * 0.5 * angle.cos();
        near(sim.get("crank.effort").unwrap(), want, 1e-9);
    }
}

/// A box that leans on two others: the force on it is the sum of those of its pairs, and the forces of a pair are opposite.
#[test]
fn pairs_of_bodies_share_the_contact_force_of_each() {
    for contact in ["", "compliant: true, "] {
        let text = format!(
            r#"Simulation(bodies: {{
                "low": (parent: "world", hinge: Free, mass: 2, inertia: Box([0.4, 0.4, 0.2]), initial: (position: [0, 0, 0.1]), shapes: [(shape: Box([0.4, 0.4, 0.2]), collide: true, name: "s")]),
                "top": (parent: "world", hinge: Free, mass: 3, inertia: Box([0.2, 0.2, 0.2]), initial: (position: [0.05, 0, 0.3]), shapes: [(shape: Box([0.2, 0.2, 0.2]), collide: true, name: "s")]) }},
                colliders: {{ "floor": (on: "world", shape: HalfSpace) }},
                contact: ({contact}pair_forces: [["low", "top"], ["top", "low"], ["low", "world"]]),
                parts: {{ {GRAVITY} }}, step: "1 ms", until: "2 s")"#
        );
        let mut sim = sim(&text);
        until(&mut sim, 1.5);
        let [on_low, on_top, ground, all] = [
            "low.contact_with.top.force",
            "top.contact_with.low.force",
            "low.contact_with.world.force",
            "low.contact_force",
        ]
        .map(|stem| three(&sim, stem));
        near(on_top[2], 3.0 * 9.81, 0.3);
        near(ground[2], 5.0 * 9.81, 0.5);
        for i in 0..3 {
            near(on_low[i], -on_top[i], 1e-12);
            near(all[i], on_low[i] + ground[i], 1e-9);
        }
        near(three(&sim, "top.contact_with.low.point")[2], 0.2, 2e-3);
    }
}

/// The cases of cannon.js and bullet users: a rolling and a spinning ball come to rest, and a belt carries a box.
#[test]
fn rolling_and_spinning_friction_and_belts_are_fields() {
    let text = format!(
        r#"Simulation(bodies: {{
            "roll": (parent: "world", hinge: Free, mass: 5, inertia: Sphere(0.1), initial: (position: [0, 0, 0.1], velocity: [1, 0, 0], angular: [0, 10, 0]), shapes: [(shape: Sphere(0.1), collide: (friction: 0.5, rolling_friction: "1 mm"), name: "s")]),
            "spin": (parent: "world", hinge: Free, mass: 5, inertia: Sphere(0.1), initial: (position: [0, 2, 0.1], angular: [0, 0, 30]), shapes: [(shape: Sphere(0.1), collide: (material: "rubber"), name: "s")]),
            "box": (parent: "world", hinge: Free, mass: 1, inertia: Box([0.1, 0.1, 0.1]), initial: (position: [0, 4, 0.15]), shapes: [(shape: Box([0.1, 0.1, 0.1]), collide: (friction: 0.5), name: "s")]) }},
            colliders: {{
                "floor": (on: "world", shape: HalfSpace, friction: 0.5, material: "wood"),
                "belt": (on: "world", at: (position: [0, 4, 0.05]), shape: Box([9, 0.5, 0.1]), friction: 0.5, surface_velocity: ["1.5 m/s", 0, 0]) }},
            contact: (pairs: [(a: "rubber", b: "wood", spinning_friction: "1 cm")]),
            parts: {{ {GRAVITY} }}, step: "1 ms", until: "2 s")"#
    );
    let mut sim = sim(&text);
    until(&mut sim, 0.5);
    near(sim.get("box.velocity.x").unwrap(), 1.5, 1e-3);
    until(&mut sim, 1.0);
    let w = ["x", "y", "z"].map(|c| sim.get(&format!("roll.angular.{c}")).unwrap());
    let w = w.iter().map(|x| x * x).sum::<f64>().sqrt();
    near(w, 10.0 - 5.0 / 7.0 * 9.81 * 1e-3 / 0.01, 2e-3);
    let stop = 0.4 * 0.01 * 30.0 / (0.01 * 9.81);
    near(sim.get("spin.angular.z").unwrap(), 30.0 * (1.0 - 1.0 / stop), 1e-2);
    until(&mut sim, 1.5);
    near(sim.get("spin.angular.z").unwrap(), 0.0, 1e-9);
}

/// Meaningless input is rejected with its location.
#[test]
fn senseless_loads_and_pairs_are_refused() {
    let scene = |contact: &str, body: &str| {
        format!(
            r#"Simulation(bodies: {{
                "a": (parent: "world", hinge: Free, mass: 1, inertia: Sphere(0.1), shapes: [(shape: Sphere(0.1), collide: true, name: "s")]),
                "b": (parent: "world", hinge: Pin([0, 1, 0]), mass: 1, inertia: Sphere(0.1), {body}) }},
                contact: ({contact}), parts: {{ {GRAVITY} }})"#
        )
    };
    for (contact, body, wanted) in [
        (r#"pair_forces: [["a", "b"]]"#, "", "`b` does not have collision shapes"),
        (r#"pair_forces: [["world", "a"]]"#, "", "`world` is not a body"),
        (r#"pair_forces: [["a", "a"]]"#, "", "are the same body"),
        (r#"pair_forces: [["a"]]"#, "", "list of pairs"),
        ("rolling_friction: -1", "", "`rolling_friction` is -1"),
        ("spinning_friction: \"1 deg\"", "", "unit"),
        ("", "reaction: 3", "reaction"),
    ] {
        let told = common::scene(&scene(contact, body), &[]).err().unwrap_or_default();
        assert!(told.contains(wanted), "{contact} {body}: {told}");
    }
}
