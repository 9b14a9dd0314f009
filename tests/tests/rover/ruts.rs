//! Ruts under a complete rover: wheels that use them, their state in checkpoints and forks, and a run without them.
use linkwork_runtime::{Seconds, Simulation};

use crate::common;

/// A rover that drives straight ahead on level lunar soil.
fn driving(ruts: &str) -> Simulation {
    let text = format!(
        r#"Simulation(
    parts: {{ "Rover": (assembly: "rovers/rocker_bogie.ron", params: {{
        "world": "worlds/slope.ron", "waypoints": [[30, 0]], "contact": "mobility.wheel_soil",
        "world_params": {{ "ruts": "{ruts}" }},
    }}) }},
    step: "1 ms", integrator: "semi_implicit_euler", until: "100 s", seed: 1,
    place: (
        body: "Rover.Hardware.Chassis/chassis", at: [0, 0], heading: "0 rad",
        wheels: ["Rover.Hardware.Wheels.*/wheel"], radius: "0.25 m",
        joints: ["Rover.Hardware.Chassis/rocker_*", "Rover.Hardware.Chassis/bogie_*"],
    ),
)"#
    );
    common::scene(&text, &[]).unwrap_or_else(|e| panic!("{e}"))
}

fn run(sim: &mut Simulation, tenths: u64) {
    sim.run_until(Seconds { num: tenths, den: 10 }).unwrap();
}

fn wheel(sim: &Simulation, k: usize, port: &str) -> f64 {
    sim.get(&format!("Rover.Hardware.Wheels.Wheel{k}.SurfaceContact.{port}")).unwrap()
}

#[test]
fn wheels_behind_run_in_the_ruts_of_those_before() {
    let mut sim = driving("on");
    let mut fresh = driving("off");
    run(&mut sim, 160);
    run(&mut fresh, 160);
    for k in 1..=6 {
        println!(
            "wheel {k}: sinkage {:.2} mm in a rut of {:.2} mm; {:.2} mm on fresh ground",
            1e3 * wheel(&sim, k, "sinkage"),
            1e3 * wheel(&sim, k, "rut"),
            1e3 * wheel(&fresh, k, "sinkage"),
        );
        assert_eq!(wheel(&fresh, k, "rut"), 0.0);
    }
    // The front wheels drive on fresh ground and leave the ruts in which the rear wheels run, because both have the
    // same track, 1.06 m from the middle. The middle wheels, 0.13 m farther out, run with two thirds of their width in
    // it.
    for k in [1, 2] {
        assert!(wheel(&sim, k, "rut") < 1e-6);
        let (front, rear) = (wheel(&sim, k, "sinkage"), wheel(&sim, k + 4, "rut"));
        assert!(rear > 0.5 * front, "rut {rear} m behind {front} m");
        let middle = wheel(&sim, k + 2, "rut");
        assert!(middle > 0.2 * front && middle < rear, "{middle} {rear}");
        let own = wheel(&sim, k + 4, "sinkage") - rear;
        assert!(own > 0.0 && own < 0.6 * wheel(&fresh, k + 4, "sinkage"), "{own}");
    }
}

#[test]
fn split_equals_straight_with_ruts() {
    let mut straight = driving("on");
    run(&mut straight, 120);
    let mut sim = driving("on");
    for k in 1..=6 {
        run(&mut sim, 20 * k);
        let saved = sim.checkpoint("").unwrap();
        // The following steps of the original do not affect the fork.
        let mut other = sim.fork();
        run(&mut other, 20 * k + 10);
        sim = driving("on");
        sim.restore(&saved).unwrap();
    }
    assert!(wheel(&straight, 5, "rut") > 0.001);
    assert_eq!(sim.state(), straight.state());
    assert_eq!(sim.hash(), straight.hash());
}

#[test]
fn a_word_that_is_neither_on_nor_off_is_told() {
    let told = common::traverse(&["Rover.Environment.ruts=onn"]).err().unwrap();
    assert!(told.contains("no assembly file `parts/ruts_onn.ron`"), "{told}");
}
