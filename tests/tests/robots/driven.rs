//! Ball hinges driven by ports (`actuators.ball_drive`), and surfaces whose velocity a port drives (`actuators.belt`): closed forms, MuJoCo, and
//! errors.
use super::loads::{GRAVITY, near, sim, three, until};
use crate::common;
use linkwork_runtime::Simulation;

const SUPPLY: &str = r#""Supply": (model: "power.ideal_supply", params: { "voltage": 24 }), "Zero": (model: "basics.constant", params: { "value": 0 })"#;

/// A body on a ball at its centre of mass, rotated by `angle` about an axis, with a drive of these parameters.
fn turned(axis: usize, angle: f64, params: &str, more: &str) -> Simulation {
    let mut q = [0.0, 0.0, 0.0, (0.5 * angle).cos()];
    q[axis] = (0.5 * angle).sin();
    sim(&format!(
        r#"Simulation(bodies: {{
            "b": (parent: "world", hinge: Ball, mass: 1, inertia: [0.2, 0.3, 0.4], initial: (rotation: (quat: {q:?}))) }},
            gravity: "none",
            parts: {{ {SUPPLY},
                "Drive": (model: "actuators.ball_drive", params: {{ {params} }}, bind: {{ "ball": "hinge:b" }}) }},
            connect: [("Drive.supply", "Supply.terminal")], wires: ["Zero.y -> Drive.torque.x"], {more})"#
    ))
}

fn angle_about(sim: &Simulation, axis: usize) -> f64 {
    let part = ["x", "y", "z"][axis];
    let (s, c) = (sim.get(&format!("b.rotation.{part}")), sim.get("b.rotation.w"));
    2.0 * s.unwrap().atan2(c.unwrap())
}

/// About a principal axis θ(t) = θ₀ e^(−δt) (cos ωt + δ/ω sin ωt), δ = d/2I, ω = √(k/I − δ²), at any amplitude below π.
#[test]
fn a_driven_ball_swings_as_a_spherical_spring_and_damper() {
    let (k, inertia): (f64, [f64; 3]) = (5.0, [0.2, 0.3, 0.4]);
    for (damping, more, tolerance) in [
        (0.0, r#"integrator: "rk4", step: "5 ms""#, 1e-6),
        (0.1, r#"integrator: "dormand_prince_54", step: "0.1 s""#, 1e-5),
        (0.1, r#"integrator: "rodas4p", step: "0.1 s""#, 1e-4),
        (0.1, r#"contact: (), step: "0.1 ms""#, 2e-3),
    ] {
        for axis in 0..3 {
            let params = format!("\"stiffness\": {k}, \"damping\": {damping}");
            let mut sim = turned(axis, 2.5, &params, more);
            let delta = 0.5 * damping / inertia[axis];
            let omega = (k / inertia[axis] - delta * delta).sqrt();
            for t in [0.3, 1.0, 2.0] {
                until(&mut sim, t);
                let want = 2.5
                    * (-delta * t).exp()
                    * ((omega * t).cos() + delta / omega * (omega * t).sin());
                near(angle_about(&sim, axis), want, tolerance);
            }
        }
    }
}

/// At its torque limit the drive rotates the body with the acceleration τ_max/I; without a supply the body is free.
#[test]
fn a_driven_ball_keeps_to_its_greatest_torque() {
    let more = r#"integrator: "rk4", step: "1 ms""#;
    let mut limited = turned(1, 2.0, r#""stiffness": 1000, "torque_max": 0.6"#, more);
    until(&mut limited, 0.5);
    near(angle_about(&limited, 1), 2.0 - 0.5 * 0.6 / 0.3 * 0.25, 1e-9);
    near(limited.get("Drive.size").unwrap(), 0.6, 1e-12);
    near(limited.get("Drive.power").unwrap(), 0.6 * 0.6 / 0.3 * 0.5, 1e-9);
    near(limited.get("Drive.supply.current").unwrap(), 0.3 * 2.0 / 24.0, 0.3);
}

/// Position actuators and motors about the three axes of a ball joint in MuJoCo 4.0.0 (RK4, steps of 0.1 ms; steps of 1 ms agree
/// within 2e-8).
#[test]
fn a_driven_ball_moves_as_in_mujoco() {
    let mut sim = sim(&format!(
        r#"Simulation(bodies: {{
            "b": (parent: "world", hinge: Ball, mass: 2, com: [0.1, -0.05, 0.3], inertia: [0.03, 0.05, 0.04], initial: (rotation: (quat: [0.2, -0.4, 0.4, 0.8]), angular: [0.5, -1.2, 2.0])) }},
            parts: {{ {GRAVITY}, {SUPPLY},
                "X": (model: "basics.constant", params: {{ "value": 0.5 }}),
                "Y": (model: "basics.constant", params: {{ "value": -1.0 }}),
                "Z": (model: "basics.constant", params: {{ "value": 0.8 }}),
                "Drive": (model: "actuators.ball_drive", params: {{ "stiffness": 30, "damping": 0.4 }}, bind: {{ "ball": "hinge:b" }}) }},
            connect: [("Drive.supply", "Supply.terminal")],
            wires: ["X.y -> Drive.torque.x", "Y.y -> Drive.torque.y", "Z.y -> Drive.torque.z"],
            integrator: "rk4", step: "1 ms")"#
    ));
    until(&mut sim, 1.0);
    let rotation = ["x", "y", "z", "w"].map(|c| sim.get(&format!("b.rotation.{c}")).unwrap());
    for (y, want) in
        rotation.into_iter().zip([-0.0109108722, 0.1638224182, 0.0462360917, 0.9853453161])
    {
        near(y, want, 1e-8);
    }
    for (y, want) in
        three(&sim, "b.angular").into_iter().zip([1.0401080297, -0.2912071909, -0.3790620879])
    {
        near(y, want, 1e-7);
    }
}

/// Commanded rotation and rate come from connections: with damping the body comes to rest at the target rotation of 1 rad about x.
#[test]
fn a_driven_ball_goes_to_its_target() {
    let mut sim = sim(&format!(
        r#"Simulation(bodies: {{
            "arm": (parent: "world", hinge: Pin([0, 0, 1]), mass: 5, inertia: [1, 1, 1]),
            "b": (parent: "arm", at: (position: [1, 0, 0]), hinge: Ball, mass: 1, inertia: [0.2, 0.3, 0.4]) }},
            gravity: "none",
            parts: {{ {SUPPLY},
                "S": (model: "basics.constant", params: {{ "value": {} }}),
                "C": (model: "basics.constant", params: {{ "value": {} }}),
                "Drive": (model: "actuators.ball_drive", params: {{ "stiffness": 20, "damping": 4 }}, bind: {{ "ball": "hinge:b" }}) }},
            connect: [("Drive.supply", "Supply.terminal")],
            wires: ["S.y -> Drive.rotation.x", "Zero.y -> Drive.rotation.y", "Zero.y -> Drive.rotation.z", "C.y -> Drive.rotation.w"],
            integrator: "rk4", step: "1 ms")"#,
        3.0 * 0.5_f64.sin(),
        3.0 * 0.5_f64.cos(),
    ));
    until(&mut sim, 8.0);
    near(angle_about(&sim, 0), 1.0, 1e-9);
    near(sim.get("Drive.error").unwrap(), 0.0, 1e-9);
    // Internal torques do not change the angular momentum of the mechanism.
    near(sim.get("arm.rate").unwrap(), 0.0, 1e-9);
}

/// A box of 1 kg on a belt with speed a t; `contact` is the contact field of the simulation.
fn on_belt(acceleration: f64, contact: &str) -> Simulation {
    sim(&format!(
        r#"Simulation(bodies: {{
            "belt": (parent: "world", hinge: Locked, mass: 10, inertia: [1, 1, 1], shapes: [(shape: Box([40, 0.5, 0.1]), collide: (friction: 0.5), name: "top")]),
            "box": (parent: "world", hinge: Free, mass: 1, inertia: Box([0.1, 0.1, 0.1]), initial: (position: [0, 0, 0.1]), shapes: [(shape: Box([0.1, 0.1, 0.1]), collide: (friction: 0.5), name: "s")]) }},
            contact: ({contact}),
            parts: {{ {GRAVITY},
                "Speed": (model: "basics.ramp", params: {{ "time": 0, "start": 0, "slope": {acceleration} }}),
                "Belt": (model: "actuators.belt", params: {{ "direction": [2, 0, 0] }}, bind: {{ "belt": "node:belt" }}) }},
            wires: ["Speed.y -> Belt.speed"], step: "1 ms")"#
    ))
}

/// A belt that accelerates by more than μ g leaves the box behind, whose speed is μ g t; one that accelerates less takes it along.
#[test]
fn a_belt_carries_a_box_by_friction() {
    let compliant =
        "compliant: (stiffness: 1e4, damping: 5, bristle_stiffness: 2e4, bristle_damping: 50)";
    for (contact, tolerance) in [("", 1e-2), (compliant, 1.5e-2)] {
        let mut slips = on_belt(8.0, contact);
        let mut follows = on_belt(3.0, contact);
        for t in [0.5, 1.0] {
            until(&mut slips, t);
            near(slips.get("box.velocity.x").unwrap(), 0.5 * 9.81 * t, tolerance);
            near(slips.get("box.contact_force.x").unwrap(), 0.5 * 9.81, 2e-2);
            until(&mut follows, t);
            near(follows.get("box.velocity.x").unwrap(), 3.0 * t, tolerance);
            near(follows.get("box.contact_force.x").unwrap(), 3.0, 2e-2);
        }
    }
}

/// Meaningless input is rejected with the remedy.
#[test]
fn senseless_drives_of_balls_and_belts_are_refused() {
    let scene = |hinge: &str, shape: &str, part: &str, wire: &str| {
        let supply = if part.contains("belt") { "" } else { r#"("P.supply", "Supply.terminal")"# };
        format!(
            r#"Simulation(bodies: {{
                "b": (parent: "world", hinge: {hinge}, mass: 1, inertia: [1, 1, 1], shapes: [{shape}]),
                "c": (parent: "world", hinge: Free, mass: 1, inertia: [1, 1, 1], shapes: [(shape: Sphere(1), collide: true, name: "s")], initial: (position: [0, 0, 5])) }},
                contact: (), gravity: "none",
                parts: {{ {SUPPLY}, "P": ({part}) }}, wires: ["Zero.y -> P.{wire}"], connect: [{supply}])"#
        )
    };
    let ball = r#"model: "actuators.ball_drive", bind: { "ball": "hinge:b" }"#;
    let servo = r#"model: "actuators.position_servo", params: { "stiffness": 1, "damping": 1 }, bind: { "shaft": "hinge:b" }"#;
    let belt = r#"model: "actuators.belt", params: { "direction": [1, 0, 0] }, bind: { "belt": "node:b" }"#;
    let nowhere = belt.replace("[1, 0, 0]", "[0, 0, 0]");
    let negative = format!(r#"{ball}, params: {{ "damping": -1 }}"#);
    let moving = r#"(shape: Box([1, 1, 1]), collide: (surface_velocity: [1, 0, 0]), name: "s")"#;
    for (hinge, shape, part, wire, wanted) in [
        ("Pin([0, 0, 1])", "", ball, "torque.x", "the hinge of `b` has 0 balls, not 1"),
        ("Ball", "", servo, "angle", "for its ball, use a model for balls"),
        ("Locked", "", belt, "speed", "`b` has no collision shape"),
        ("Locked", moving, belt, "speed", "has a constant `surface_velocity`"),
        ("Locked", moving, nowhere.as_str(), "speed", "must be finite and not zero"),
        ("Ball", "", negative.as_str(), "torque.x", "damping"),
    ] {
        let told = common::scene(&scene(hinge, shape, part, wire), &[]).err().unwrap_or_default();
        assert!(told.contains(wanted), "{wanted}: {told}");
    }
}
