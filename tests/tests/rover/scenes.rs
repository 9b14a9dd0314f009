//! The simulations of the rover agree with their READMEs: a step, slopes of soft soil, two rovers.
use linkwork_runtime::Simulation;

use crate::common;

fn get(sim: &Simulation, name: &str) -> f64 {
    sim.get(name).unwrap_or_else(|e| panic!("{e}"))
}

fn until(sim: &mut Simulation, t: f64) {
    sim.run_until(common::seconds(t)).unwrap();
}

/// Position of the chassis: x, z.
fn place(sim: &Simulation) -> [f64; 2] {
    ["x", "z"].map(|a| get(sim, &format!("Rover.Hardware.Chassis/chassis.position.{a}")))
}

/// Runs `sims/step_climb` with further settings until it has arrived, or for this time (s).
fn climb(set: &[&str], longest: f64) -> [f64; 2] {
    let mut sim = common::repository("step_climb/sim.ron", set).unwrap_or_else(|e| panic!("{e}"));
    let done = sim.variable("Rover.NavigationSoftware.Follower.done").unwrap().place;
    while sim.value(done) < 0.5 && sim.time() < longest {
        let next = sim.time() + 1.0;
        until(&mut sim, next);
    }
    println!("{set:?}: at {:.3?} after {:.0} s", place(&sim), sim.time());
    place(&sim)
}

#[test]
fn with_friction_enough_it_climbs_a_step_as_high_as_a_wheels_radius_and_without_it_stalls() {
    let [x, z] = climb(&[], 90.0);
    assert!(x > 4.0 && (z - 1.0).abs() < 0.01, "({x}, {z})");
    // The rover stops at the step with rotating wheels if friction is less than the front wheels need.
    let [x, z] = climb(&["friction=0.6"], 40.0);
    assert!(x < 0.7 && z < 0.85, "({x}, {z})");
}

#[test]
fn slip_rises_with_the_slope_until_it_stalls() {
    let slip = |slope: f64| {
        let set = format!("slope={slope} deg");
        let mut sim = common::repository("slope_slip/sim.ron", &[&set]).unwrap();
        let wheels = |sim: &Simulation| get(sim, "Rover.LocomotionSoftware.Odometry.path");
        until(&mut sim, 10.0);
        let before = (wheels(&sim), place(&sim));
        until(&mut sim, 20.0);
        let at = place(&sim);
        let way = (at[0] - before.1[0]) / slope.to_radians().cos();
        let slip = 1.0 - way / (wheels(&sim) - before.0);
        let sunk = get(&sim, "Rover.Hardware.Wheels.Wheel5.SurfaceContact.sinkage");
        println!("{slope} deg: slip {slip:.3}, {:.1} mm deep", 1e3 * sunk);
        (slip, sunk)
    };
    let all = [0.0, 5.0, 10.0, 15.0, 20.0, 25.0].map(slip);
    assert!(all.windows(2).all(|w| w[1].0 > w[0].0 && w[1].1 > w[0].1 * 0.95), "{all:?}");
    assert!(all[0].0.abs() < 0.1 && all[5].0 > 0.95, "{all:?}");
    // The soil is tuned so that one wheel slips by 43 % at 15 degrees and 76 % at 20 degrees, as on a single-wheel rig on Earth.
    assert!((all[3].0 - 0.43).abs() < 0.08 && (all[4].0 - 0.76).abs() < 0.08, "{all:?}");
    assert!(all[5].1 > 1.2 * all[0].1, "slip sinks them: {all:?}");
}

#[test]
fn a_dune_that_stops_it_is_crossed_at_an_angle() {
    // Half of the time-out is enough.
    let mut sim = common::repository("dunes/sim.ron", &["patience=45 s"]).unwrap();
    let plan =
        |sim: &Simulation, what: &str| get(sim, &format!("Rover.NavigationSoftware.Plan.{what}"));
    let slip = |sim: &Simulation| get(sim, "Rover.Hardware.Wheels.Wheel5.SurfaceContact.slip");
    until(&mut sim, 44.0);
    assert_eq!(plan(&sim, "running.straight"), 1.0);
    assert!(place(&sim)[0] < 3.0 && slip(&sim) > 0.85, "{:?}, slip {}", place(&sim), slip(&sim));
    let (mut most, mut highest) = (0.0_f64, 0.0_f64);
    while plan(&sim, "done") < 0.5 && sim.time() < 300.0 {
        let next = sim.time() + 1.0;
        until(&mut sim, next);
        highest = highest.max(place(&sim)[1]);
        if plan(&sim, "running.at_an_angle") > 0.5 {
            most = most.max(slip(&sim));
        }
    }
    assert!(place(&sim)[0] > 9.7 && plan(&sim, "failures") == 1.0, "{:?}", place(&sim));
    // The rover crosses the crest, which is 1.6 m high, and does not drive around it.
    assert!(highest > 2.1, "{highest}");
    assert!(most < 0.8, "{most}");
}

#[test]
fn one_rover_pushes_another() {
    let mut sim = common::repository("two_rovers/sim.ron", &[]).unwrap_or_else(|e| panic!("{e}"));
    let x = |sim: &Simulation, who: &str| {
        get(sim, &format!("{who}.Hardware.Chassis/chassis.position.x"))
    };
    let sunk = |sim: &Simulation, who: &str| {
        (1..=6)
            .map(|k| get(sim, &format!("{who}.Hardware.Wheels.Wheel{k}.SurfaceContact.sinkage")))
            .fold(0.0, f64::max)
    };
    until(&mut sim, 0.1);
    // Both are placed and settled in the same way: neither sinks into the soil while the other
    // comes to rest.
    let start = [sunk(&sim, "Pusher"), sunk(&sim, "Ahead")];
    assert!(start.iter().all(|s| *s < 0.03), "{start:?} m deep at the start");
    until(&mut sim, 5.0);
    let (pusher, ahead) = (x(&sim, "Pusher"), x(&sim, "Ahead"));
    // The rover ahead stands until the other arrives.
    assert!((ahead - 4.2).abs() < 0.02 && pusher > 0.2, "{pusher} {ahead}");
    assert_eq!(get(&sim, "bar.contact_force.x"), 0.0);
    until(&mut sim, 35.0);
    let (pusher, ahead) = (x(&sim, "Pusher"), x(&sim, "Ahead"));
    let push = -get(&sim, "bar.contact_force.x");
    let back = get(&sim, "Ahead.Hardware.Chassis/chassis.contact_force.x");
    println!("at {pusher:.3} and {ahead:.3} m, pushing with {push:.1} N");
    assert!(ahead > 5.2 && (ahead - pusher - 3.04).abs() < 0.01, "{pusher} {ahead}");
    assert!(push > 20.0 && (push - back).abs() < 1e-6 * push, "{push} {back}");
    // The rovers drive one behind the other on the same ground: the wheels of the second run in the
    // ruts of the first.
    println!(
        "wheels {:.1} and {:.1} mm deep",
        1e3 * sunk(&sim, "Pusher"),
        1e3 * sunk(&sim, "Ahead")
    );
}
