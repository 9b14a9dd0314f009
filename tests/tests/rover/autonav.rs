//! Autonomous navigation of a rover with its full dynamics: `sims/rover_navigation`.
use linkwork_runtime::{Seconds, Simulation};

use crate::common;

const NAV: &str = "Rover.NavigationSoftware.AutoNav";

fn rover(set: &[&str]) -> Simulation {
    common::repository("rover_navigation/sim.ron", set).unwrap_or_else(|e| panic!("{e}"))
}

fn run(sim: &mut Simulation, seconds: u64) {
    sim.run_until(Seconds { num: seconds, den: 1 }).unwrap();
}

fn get(sim: &Simulation, port: &str) -> f64 {
    sim.get(&format!("{NAV}.{port}")).unwrap()
}

#[test]
fn it_drives_by_what_it_sees() {
    let mut sim = rover(&[]);
    run(&mut sim, 60);
    // The camera takes one image per second, which is processed from the next sample on.
    assert_eq!(get(&sim, "pictures"), 60.0);
    assert!(get(&sim, "mapped") > 150.0, "{}", get(&sim, "mapped"));
    assert_eq!(get(&sim, "status"), 1.0);
    // The distance at the start is 80 m, and the rover drives at 0.25 m/s on ground that is almost
    // free.
    let left = get(&sim, "distance");
    assert!(left < 70.0, "{left}");
}

/// With kinematics, among many rocks: perception keeps it off rocks that are too high; if it takes all ground as safe, it drives over one.
#[test]
fn what_it_came_over_is_told() {
    const MODE: [&str; 5] =
        ["motion=kinematics", "step=20ms", "imu_rate=50Hz", "rock_cover=0.12", "field=4"];
    let truth = |sim: &Simulation, port: &str| sim.get(&format!("Truth.{port}")).unwrap();
    let mut sees = rover(&MODE);
    run(&mut sees, 110);
    assert_eq!(truth(&sees, "Body.touched"), 0.0);
    // The rover has driven over some rocks: Golombek's distribution has one on each few square
    // metres.
    assert!(truth(&sees, "Body.highest") > 0.1);
    let blind = ["step=5", "roughness=5", "slope=1.5"].map(|p| format!("{NAV}.{p}"));
    let mut drives = rover(&[&MODE[..], &blind.each_ref().map(String::as_str)[..]].concat());
    run(&mut drives, 110);
    assert!(truth(&drives, "Body.touched") >= 1.0);
    assert!(truth(&drives, "Wheels.highest") > 0.4);
    assert!(truth(&drives, "Body.highest") >= truth(&drives, "Wheels.highest"));
}

#[test]
fn without_sight_it_stands() {
    // The rover does not see the ground, because all ranges are beyond the limit of the camera.
    let mut sim = rover(&["Rover.NavigationSoftware.Camera.reach=0.1"]);
    run(&mut sim, 30);
    assert_eq!(get(&sim, "mapped"), 0.0);
    let left = get(&sim, "distance");
    // Unseen ground is avoided: the rover leaves the free area around its start by at most one arc.
    assert!(left > 75.0, "{left}");
}

#[test]
fn split_equals_straight_with_map_and_plan() {
    let mut straight = rover(&[]);
    run(&mut straight, 14);
    let mut sim = rover(&[]);
    for k in [1, 5, 6, 11] {
        run(&mut sim, k);
        let saved = sim.checkpoint("").unwrap();
        let mut other = sim.fork();
        run(&mut other, k + 2);
        sim = rover(&[]);
        sim.restore(&saved).unwrap();
    }
    run(&mut sim, 14);
    assert!(get(&sim, "mapped") > 50.0);
    assert_eq!(sim.state(), straight.state());
    assert_eq!(sim.hash(), straight.hash());
}

#[test]
fn goals_are_visited_in_turn() {
    let mut sim = rover(&["Rover.waypoints=[[-38, 0], [-36, 0.5]]"]);
    run(&mut sim, 40);
    assert_eq!([get(&sim, "goal"), get(&sim, "done"), get(&sim, "stopped")], [2.0, 1.0, 0.0]);
    assert_eq!([get(&sim, "speed"), get(&sim, "turn_rate")], [0.0; 2]);
}

#[test]
fn what_cannot_be_is_refused() {
    for (set, fact) in [
        ("Rover.waypoints=[]", "`goals` is empty"),
        ("Rover.NavigationSoftware.AutoNav.cell=0.01", "0.03 ..= 1"),
        ("Rover.NavigationSoftware.AutoNav.keep_out=[[0, 0, -1]]", "is not a disc"),
        ("Rover.navigation=blind", "navigation_blind.ron"),
        ("Rover.NavigationSoftware.AutoNav.keep_in=[3, 0, 1, 1]", "is not a rectangle"),
        ("Truth.Body.rectangles=[]", "0 rectangles"),
    ] {
        let told = common::repository("rover_navigation/sim.ron", &[set]).err().unwrap();
        assert!(told.contains(fact), "{set}: {told}");
    }
}
