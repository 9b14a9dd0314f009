//! A complete rover on ground that deforms node by node: weight, rest on a slope, ruts of the preceding wheels, checkpoints, mirror symmetry.
use linkwork_plant::PlanExt;
use linkwork_runtime::Simulation;

use crate::common;

const GRAVITY: f64 = 3.72076;

/// The rover on a slope (deg), nose uphill, that drives to waypoints.
fn rover(slope: f64, waypoints: &str, set: &[&str]) -> Simulation {
    let text = format!(
        r#"Simulation(
    parts: {{ "Rover": (assembly: "rovers/rocker_bogie.ron", params: {{
        "world": "worlds/slope.ron", "waypoints": {waypoints}, "contact": "mobility.wheel_scm",
        "world_params": {{ "slope": "{slope} deg", "ruts": "scm" }},
    }}) }},
    step: "1 ms", integrator: "semi_implicit_euler", until: "100 s", seed: 1,
    place: (
        body: "Rover.Hardware.Chassis/chassis", at: [0, 0], heading: "0 rad",
        wheels: ["Rover.Hardware.Wheels.*/wheel"], radius: "0.25 m",
        joints: ["Rover.Hardware.Chassis/rocker_*", "Rover.Hardware.Chassis/bogie_*"],
    ),
)"#
    );
    common::scene(&text, set).unwrap_or_else(|e| panic!("{e}"))
}

fn until(sim: &mut Simulation, t: f64) {
    sim.run_until(common::seconds(t)).unwrap();
}

fn wheel(sim: &Simulation, k: usize, port: &str) -> f64 {
    sim.get(&format!("Rover.Hardware.Wheels.Wheel{k}.SurfaceContact.{port}")).unwrap()
}

fn chassis(sim: &Simulation) -> [f64; 3] {
    ["x", "y", "z"]
        .map(|a| sim.get(&format!("Rover.Hardware.Chassis/chassis.position.{a}")).unwrap())
}

fn apart(a: [f64; 3], b: [f64; 3]) -> f64 {
    a.iter().zip(b).map(|(a, b)| (a - b) * (a - b)).sum::<f64>().sqrt()
}

#[test]
fn it_weighs_what_it_weighs_and_does_not_creep() {
    for slope in [0.0, 10.0, 20.0] {
        let mut sim = rover(slope, "[[0, 0]]", &[]);
        until(&mut sim, 8.0);
        let a = chassis(&sim);
        until(&mut sim, 12.0);
        let creep = apart(a, chassis(&sim)) / 4.0;
        let load: f64 = (1..=6).map(|k| wheel(&sim, k, "contact_force.z")).sum();
        let mass = sim.plan().mechanism().unwrap().multibody.total_mass();
        println!(
            "slope {slope}°: creep {creep:.3e} m/s, load off by {:e}",
            load / (mass * GRAVITY) - 1.0
        );
        assert!(creep < 1e-5, "slope {slope}: {creep} m/s");
        assert!((load / (mass * GRAVITY) - 1.0).abs() < 1e-3, "slope {slope}: {load}");
    }
}

#[test]
fn on_its_way_it_carries_its_weight_and_each_pass_deepens_the_rut_by_less() {
    let mut sim = rover(0.0, "[[30, 0]]", &[]);
    until(&mut sim, 10.0);
    let (mut load, mut sunk, mut n) = (0.0, [0.0; 6], 0.0);
    while sim.time() < 14.0 {
        let next = sim.time() + 0.02;
        until(&mut sim, next);
        n += 1.0;
        for (k, sunk) in sunk.iter_mut().enumerate() {
            load += wheel(&sim, k + 1, "contact_force.z");
            *sunk += wheel(&sim, k + 1, "sinkage");
        }
    }
    let mass = sim.plan().mechanism().unwrap().multibody.total_mass();
    let off = load / n / (mass * GRAVITY) - 1.0;
    println!("mean load off by {off:.2e}; mean sinkage {:.1?} mm", sunk.map(|s| 1e3 * s / n));
    assert!(off.abs() < 0.01, "{off}");
    assert!(chassis(&sim)[0] > 1.5);
    // The sinkages are below the original surface: on fresh ground, in the ruts of the front wheels over two thirds of
    // the width, and in the ruts of both.
    for k in [0, 1] {
        let [first, second, third] = [sunk[k], sunk[k + 2], sunk[k + 4]];
        assert!(second > first && third - second < 0.5 * (second - first), "{sunk:?}");
        assert!(second < 1.7 * first, "{sunk:?}");
    }
}

#[test]
fn split_equals_straight() {
    let mut straight = rover(0.0, "[[30, 0]]", &[]);
    until(&mut straight, 4.0);
    let mut sim = rover(0.0, "[[30, 0]]", &[]);
    for k in 1..=4 {
        until(&mut sim, f64::from(k));
        let saved = sim.checkpoint("").unwrap();
        // The following steps of the other run do not affect this one.
        let mut other = sim.fork();
        until(&mut other, f64::from(k) + 0.5);
        sim = rover(0.0, "[[30, 0]]", &[]);
        sim.restore(&saved).unwrap();
    }
    assert_eq!(sim.state(), straight.state());
    assert_eq!(sim.hash(), straight.hash());
}

#[test]
fn without_ground_that_deforms_it_is_told() {
    let mut sim = rover(0.0, "[[0, 0]]", &["Rover.Environment.ruts=off"]);
    let told = sim.startup_warnings();
    assert!(told.iter().any(|w| w.message.contains("mobility.scm_ground")), "{told:?}");
}
