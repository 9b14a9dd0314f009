//! A rover with an empty battery does not move.
use crate::common;
use linkwork_runtime::Simulation;

const CHASSIS: &str = "Rover.Hardware.Chassis/chassis";

/// A rover of Curiosity's class that is commanded to drive straight over level ground, with a given battery charge and no light.
fn rover(motion: &str, charge: f64) -> Simulation {
    let text = format!(
        r#"Simulation(
    parts: {{ "Rover": (assembly: "rovers/rocker_bogie.ron", params: {{
        "world": "worlds/slope.ron", "motion": "{motion}", "waypoints": [], "navigation": "plan",
        "plan": [(name: "drive", set: {{ "speed": 0.05 }}, duration: "1 h")],
    }}) }},
    step: "2 ms", integrator: "semi_implicit_euler", until: "100 s", seed: 1,
    place: (
        motion: "{motion}", body: "{CHASSIS}", at: [0, 0], wheels: ["Rover.Hardware.Wheels.*/wheel"], radius: "0.25 m",
        joints: ["Rover.Hardware.Chassis/rocker_*", "Rover.Hardware.Chassis/bogie_*"],
    ),
)"#
    );
    let charge = format!("Rover.Hardware.Power.Battery.charge={charge}");
    let dark = "Rover.Hardware.Power.SolarPanel.area=0";
    common::scene(&text, &[&charge, dark]).unwrap_or_else(|e| panic!("{e}"))
}

fn way(sim: &mut Simulation, t: f64) -> f64 {
    let x = |sim: &Simulation| sim.get(&format!("{CHASSIS}.position.x")).unwrap();
    let start = x(sim);
    sim.run_until(common::seconds(t)).unwrap();
    x(sim) - start
}

/// With an empty battery it used to drive bit-identical with a full one, because its motors got their voltage from a constant.
#[test]
fn a_rover_without_a_volt_stands() {
    for motion in ["dynamics", "kinematics"] {
        let (full, empty) =
            (way(&mut rover(motion, 0.7), 20.0), way(&mut rover(motion, 0.0), 20.0));
        assert!(full > 0.6, "{motion}: {full} m with a charged battery");
        assert!(empty.abs() < 0.03, "{motion}: {empty} m with an empty battery");
    }
}

/// A battery that becomes empty during the drive stops the rover there.
#[test]
fn a_rover_stops_where_its_battery_runs_flat() {
    // The battery has 2.9 A s of 40 A h, and the rover draws 4 W at 28 V.
    let mut sim = rover("dynamics", 2e-5);
    let flat = "Rover.Hardware.Power.Battery.empty";
    while sim.get(flat).unwrap() < 0.5 {
        assert!(sim.time() < 90.0, "it has not run flat");
        let next = sim.time() + 1.0;
        sim.run_until(common::seconds(next)).unwrap();
    }
    assert!(sim.time() > 5.0, "it drives at first: {} s", sim.time());
    // The rover stops within two seconds.
    let next = sim.time() + 2.0;
    sim.run_until(common::seconds(next)).unwrap();
    let end = sim.time() + 5.0;
    let rest = way(&mut sim, end);
    assert!(rest.abs() < 0.01, "{rest} m in 5 s without power");
}
