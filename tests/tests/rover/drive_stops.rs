//! Conditions that stop a rover's drive: a stalled wheel, slipping wheels; and the recovery of a plan.
use linkwork_runtime::Simulation;

use crate::common;

const MONITOR: &str = "Rover.LocomotionSoftware.Monitor";
const PLAN: &str = "Rover.NavigationSoftware.Plan";

/// The rover of Curiosity's class 1 m in front of a wall that it is commanded to drive through. When the wall stops it, it backs out.
fn before_a_wall(params: &str) -> Simulation {
    let text = format!(
        r#"Simulation(
    parts: {{ "Rover": (assembly: "rovers/rocker_bogie.ron", params: {{
        "world": "worlds/slope.ron", "waypoints": [], "navigation": "plan", {params}
        "plan": [
            (name: "drive", set: {{ "speed": 0.2 }}, until: "stalled > 0.5 or slipping > 0.5", time_out: "30 s", then: {{ "speed": 0 }}),
            (name: "stand", duration: "3 s"),
            (name: "back_out", set: {{ "speed": -0.15, "clear": true }}, duration: "6 s", then: {{ "speed": 0, "clear": false }}),
            (name: "look", duration: "2 s"),
        ],
    }}) }},
    bodies: {{
        "wall": (
            parent: "world", at: (position: [2.45, 0, 0.5]),
            shapes: [(shape: Box([0.2, 4, 1]), collide: (friction: 0.1), name: "wall")],
        ),
    }},
    step: "1 ms", integrator: "semi_implicit_euler", until: "100 s", seed: 1,
    place: (
        body: "Rover.Hardware.Chassis/chassis", at: [0, 0], wheels: ["Rover.Hardware.Wheels.*/wheel"], radius: "0.25 m",
        joints: ["Rover.Hardware.Chassis/rocker_*", "Rover.Hardware.Chassis/bogie_*"],
    ),
)"#
    );
    common::scene(&text, &[]).unwrap_or_else(|e| panic!("{e}"))
}

fn get(sim: &Simulation, name: &str) -> f64 {
    sim.get(name).unwrap_or_else(|e| panic!("{e}"))
}

fn until(sim: &mut Simulation, t: f64) {
    sim.run_until(common::seconds(t)).unwrap();
}

fn x(sim: &Simulation) -> f64 {
    get(sim, "Rover.Hardware.Chassis/chassis.position.x")
}

/// Runs until the plan starts this step, at most 40 s more. Returns the time.
fn reach(sim: &mut Simulation, step: &str) -> f64 {
    let last = sim.time() + 40.0;
    while get(sim, &format!("{PLAN}.running.{step}")) < 0.5 && sim.time() < last {
        let next = sim.time() + 0.1;
        until(sim, next);
    }
    sim.time()
}

/// It stands, and backs out, because of the condition that stopped it.
fn stands_and_backs_out(sim: &mut Simulation) {
    assert_eq!(get(sim, &format!("{PLAN}.failures")), 0.0);
    let t = sim.time();
    until(sim, t + 2.5);
    let [speed, brake] = ["speed", "wheels[3].drive.brake"].map(|p| {
        get(
            sim,
            &format!(
                "Rover.LocomotionSoftware.{}{p}",
                if p == "speed" { "Odometry." } else { "Ackermann." }
            ),
        )
    });
    assert!(speed.abs() < 1e-3 && brake == 1.0, "{speed} m/s, brake {brake}");
    let stood = x(sim);
    reach(sim, "look");
    println!("stood at {stood:.3} m, backed out to {:.3} m", x(sim));
    assert!(x(sim) < stood - 0.5, "{stood} m, then {} m", x(sim));
    let t = sim.time();
    until(sim, t + 1.5);
    for stop in ["stalled", "slipping"] {
        assert_eq!(get(sim, &format!("{MONITOR}.{stop}")), 0.0, "{stop}");
    }
}

#[test]
fn weak_drives_stall_before_a_wall_and_stop() {
    let mut sim = before_a_wall(r#""wheel_torque": 60, "stall_torque": 45, "slip_max": 0.6,"#);
    let t = reach(&mut sim, "stand");
    let [stalled, wheel, slip] =
        ["stalled", "wheel", "slip"].map(|p| get(&sim, &format!("{MONITOR}.{p}")));
    println!(
        "after {t:.1} s at {:.3} m: stalled {stalled}, wheel {wheel}, slip {slip:.3}",
        x(&sim)
    );
    assert!(stalled == 1.0 && (1.0..=6.0).contains(&wheel), "stalled {stalled}, wheel {wheel}");
    stands_and_backs_out(&mut sim);
}

#[test]
fn strong_drives_slip_before_a_wall_and_stop() {
    let mut sim = before_a_wall(r#""stall_torque": 170, "slip_max": 0.6,"#);
    let t = reach(&mut sim, "stand");
    let [slipping, slip, stalled] =
        ["slipping", "slip", "stalled"].map(|p| get(&sim, &format!("{MONITOR}.{p}")));
    println!("after {t:.1} s at {:.3} m: slipping {slipping}, slip {slip:.3}", x(&sim));
    assert!(slipping == 1.0 && slip > 0.6 && stalled == 0.0, "{slipping}, {slip}, {stalled}");
    stands_and_backs_out(&mut sim);
}

#[test]
fn without_limits_it_pushes_on() {
    let mut sim = before_a_wall("");
    reach(&mut sim, "stand");
    // The step of the plan timed out.
    assert_eq!(get(&sim, &format!("{PLAN}.failures")), 1.0);
    assert!(sim.time() > 30.0 && get(&sim, &format!("{MONITOR}.slip")) > 0.6);
}
