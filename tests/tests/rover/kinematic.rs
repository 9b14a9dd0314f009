//! Mechanisms that move by kinematics: a rover that rolls over the same ground to the same positions as with forces, bit-identical after
//! interruptions, with wheel loads; errors.
use linkwork_runtime::{Seconds, Simulation};

use crate::common;

const ROVER: &str = r#"Simulation(
    params: { "motion": (default: "kinematics") },
    parts: { "Rover": (assembly: "rovers/rocker_bogie.ron", params: {
        "motion": "$motion", "imu_rate": 50,
        "waypoints": [[-8, -18], [-1, -12]], "start": [-16, -20, 0.35],
        "world_params": { "seed": 7, "clear": [[-16, -20, 3], [-8, -18, 2], [-1, -12, 2]] } } ) },
    step: "20 ms", until: "200 s", seed: 42,
    place: (body: "Rover.Hardware.Chassis/chassis", at: [-16, -20], heading: "0.35 rad", radius: "0.25 m",
        wheels: ["Rover.Hardware.Wheels.*/wheel"],
        joints: ["Rover.Hardware.Chassis/rocker_*", "Rover.Hardware.Chassis/bogie_*"],
        motion: "$motion"))"#;

fn run(sim: &mut Simulation, t: f64) {
    sim.run_until(Seconds::from_decimal(t).unwrap()).unwrap();
}

fn numbers(sim: &Simulation, stem: &str) -> Vec<f64> {
    let get = |k: usize| sim.get(&stem.replace('#', &k.to_string())).unwrap();
    (1..=6).map(get).collect()
}

fn place(sim: &Simulation) -> [f64; 3] {
    ["x", "y", "z"]
        .map(|c| sim.get(&format!("Rover.Hardware.Chassis/chassis.position.{c}")).unwrap())
}

const LOAD: &str = "Rover.Hardware.Wheels.Wheel#.SurfaceContact.normal_force";

#[test]
fn it_drives_where_the_rover_with_forces_drives() {
    let mut rolls = common::scene(ROVER, &[]).unwrap();
    let mut forces = common::scene(ROVER, &["motion=dynamics", "step=2ms"]).unwrap();
    for t in [10.0, 25.0, 40.0] {
        run(&mut rolls, t);
        run(&mut forces, t);
        let (a, b) = (place(&rolls), place(&forces));
        let apart = (a[0] - b[0]).hypot(a[1] - b[1]);
        println!("{t} s: {apart:.4} m apart, {:.4} m in height", a[2] - b[2]);
        // Wheels with forces slip by some per cent, and compress their springs by 1.5 mm.
        assert!(apart < 0.02 * 0.25 * t + 0.02, "{t}: {apart}");
    }
    let angles = |sim: &Simulation| {
        ["rocker_left", "bogie_left", "bogie_right"]
            .map(|b| sim.get(&format!("Rover.Hardware.Chassis/{b}.angle")).unwrap())
    };
    println!("{:?} {:?}", angles(&rolls), angles(&forces));
    let gap = rolls.get("Mechanism.rolling.gap").unwrap();
    assert!(gap < 1e-6, "{gap}");
}

/// On level ground, where friction has no influence; `framework/solvers/tests/rolling.rs` tests slopes.
#[test]
fn at_rest_wheels_carry_what_they_carry_by_forces() {
    let world = r#""world": "worlds/slope.ron", "world_params": { "slope": 0 } } )"#;
    let (head, tail) = ROVER.split_once("\"world_params\"").unwrap();
    let text = format!("{head}{world}{}", &tail[tail.find(" )").unwrap() + 2..]);
    let loads = |set: &[&str]| {
        let set: Vec<&str> = [set, &["place.at=[0.5, 0.2]", "place.heading=0.7"]].concat();
        let mut sim = common::scene(&text, &set).unwrap();
        run(&mut sim, 0.02);
        numbers(&sim, LOAD)
    };
    let (a, b) = (loads(&[]), loads(&["motion=dynamics", "step=1ms"]));
    println!("{a:.1?}\n{b:.1?}");
    for (a, b) in a.iter().zip(&b) {
        // Springs under the wheels pitch the body a little: measured 1.3 %.
        assert!((a - b).abs() < 0.02 * b, "{a} {b}");
    }
}

#[test]
fn cuts_leave_no_trace_and_it_stands_still_when_it_is_told() {
    let mut straight = common::scene(ROVER, &[]).unwrap();
    run(&mut straight, 12.0);
    let mut cut = common::scene(ROVER, &[]).unwrap();
    for t in [0.02, 1.3, 4.0, 7.54] {
        run(&mut cut, t);
        let bytes = cut.checkpoint("").unwrap();
        cut = common::scene(ROVER, &[]).unwrap();
        cut.restore(&bytes).unwrap();
    }
    run(&mut cut, 12.0);
    assert_eq!(straight.hash(), cut.hash());
    // The rover does not creep without remaining waypoints.
    let mut parked =
        common::scene(ROVER, &["Rover.speed=0.001", "Rover.waypoints=[[-16, -20]]"]).unwrap();
    run(&mut parked, 1.0);
    let before = place(&parked);
    run(&mut parked, 20.0);
    assert_eq!(before, place(&parked));
}

/// A rover of another class on the level: name, radius of its wheels (m), waypoints.
fn level(name: &str, radius: f64, waypoints: &str) -> String {
    format!(
        r#"Simulation(
    params: {{ "motion": (default: "kinematics") }},
    parts: {{ "Rover": (assembly: "rovers/{name}.ron", params: {{
        "motion": "$motion", "imu_rate": 50, "waypoints": {waypoints}, "world": "worlds/slope.ron", "world_params": {{ "slope": 0 }},
    }}) }},
    step: "20 ms", until: "1000 s", seed: 1,
    place: (body: "Rover.Hardware.Chassis/chassis", at: [0, 0], radius: {radius}, wheels: ["Rover.Hardware.Wheels.*/wheel"],
        joints: ["Rover.Hardware.Chassis/rocker_*", "Rover.Hardware.Chassis/bogie_*"], motion: "$motion"))"#
    )
}

#[test]
fn other_classes_roll_where_they_drive_by_forces() {
    let classes = [
        ("mer", 0.13, "[[2, 0.6], [3.2, -0.4]]", 0.04),
        ("sojourner", 0.065, "[[0.8, 0.24], [1.28, -0.16]]", 0.01),
    ];
    for (name, radius, waypoints, speed) in classes {
        let text = level(name, radius, waypoints);
        let mut rolls = common::scene(&text, &[]).unwrap_or_else(|e| panic!("{e}"));
        let by_forces = ["motion=dynamics", "step=1ms", "integrator=semi_implicit_euler"];
        let mut forces = common::scene(&text, &by_forces).unwrap_or_else(|e| panic!("{e}"));
        for t in [20.0, 60.0] {
            run(&mut rolls, t);
            run(&mut forces, t);
            let (a, b) = (place(&rolls), place(&forces));
            let (apart, higher) = ((a[0] - b[0]).hypot(a[1] - b[1]), a[2] - b[2]);
            println!("{name} at {t} s: {a:.3?}; {apart:.4} m apart, {higher:.4} m in height");
            assert!(apart < 0.02 * speed * t + 0.02 && higher.abs() < 0.005, "{apart} {higher}");
        }
        let way = place(&rolls)[0].hypot(place(&rolls)[1]);
        assert!(way > 0.8 * speed * 60.0, "{name}: {way} m");
    }
}

#[test]
fn other_classes_roll_over_rocks_to_their_last_waypoint() {
    for name in ["mer", "sojourner"] {
        let set = [
            "Rover.motion=kinematics",
            "place.motion=kinematics",
            "step=20ms",
            "Rover.imu_rate=50",
        ];
        let file = format!("rovers/{name}.ron");
        let mut sim = common::repository(&file, &set).unwrap_or_else(|e| panic!("{e}"));
        let get = |sim: &Simulation, name: &str| sim.get(name).unwrap_or_else(|e| panic!("{e}"));
        let mut highest = 0.0_f64;
        while get(&sim, "Rover.NavigationSoftware.Follower.done") < 0.5 {
            let next = sim.time() + 1.0;
            run(&mut sim, next);
            assert!(next < 400.0, "{name}: {:?}", place(&sim));
            let gap = get(&sim, "Mechanism.rolling.gap");
            assert!(gap < 1e-6, "{name} at {next} s: {gap} m");
            highest = highest.max(get(&sim, "Rover.Hardware.Sensors.Pose.tilt"));
        }
        println!("{name}: {:.3?} after {} s, tilted by {highest:.3} rad", place(&sim), sim.time());
        assert!(highest > 0.01, "{name}: it met no rock");
    }
}

#[test]
fn two_steps_agree() {
    let mut ends = ["20ms", "10ms"].map(|step| {
        let mut sim = common::scene(ROVER, &[&format!("step={step}")]).unwrap();
        run(&mut sim, 40.0);
        place(&sim)
    });
    let [a, b] = &mut ends;
    let apart = (a[0] - b[0]).hypot(a[1] - b[1]);
    println!("{apart:e} m apart after 10 m");
    assert!(apart < 0.01, "{apart}");
}

#[test]
fn what_cannot_roll_is_refused_with_place_and_remedy() {
    let told = |set: &[&str]| common::scene(ROVER, set).err().unwrap();
    // The mechanism uses forces, its placement kinematics, which is an error.
    let text = ROVER.replace("\"motion\": \"$motion\", \"imu_rate\"", "\"imu_rate\"");
    let e = common::scene(&text, &[]).err().unwrap();
    assert!(
        e.contains("is undetermined without forces") && e.contains("prescribe its motion"),
        "{e}"
    );
    let e = told(&["Rover.differential=spring"]);
    assert!(e.contains("6 wheels and 0 couplings do not determine"), "{e}");
    let e = told(&["place.motion=kinematic"]);
    assert!(e.contains("kinematics"), "{e}");
    // The rover stops at the edge of the map, and reports the position.
    let edge = &[
        "Rover.waypoints=[[-80, -20]]",
        "Rover.start=[-46, -20, 3.14]",
        "place.at=[-46, -20]",
        "place.heading=3.14",
    ];
    let mut sim = common::scene(ROVER, edge).unwrap();
    let e = sim.run_until(Seconds::from_decimal(60.0).unwrap()).unwrap_err().to_string();
    assert!(e.contains("there is no ground under") && e.contains("at (-49."), "{e}");
}

#[test]
fn a_part_that_reads_what_nothing_touches_is_refused() {
    let text = r#"Simulation(
        bodies: { "hub": (parent: "world", hinge: Free, mass: 1, inertia: Sphere(0.1)) },
        parts: {
            "Gravity": (model: "environment.uniform_gravity", params: { "acceleration": [0, 0, -9.81] }),
            "Ground": (model: "environment.flat", params: { "soil": { "kind": "lunar" } }),
            "Wheel": (model: "mobility.wheel_rolling", params: { "radius": 0.1, "width": 0.1 }, bind: { "hub": "node:hub" }),
        },
        until: "1 s")"#;
    let e = common::scene(text, &[]).err().unwrap();
    assert!(
        e.contains("`Wheel`: binding `hub`: `hub` cannot touch anything")
            && e.contains("give it a shape with `collide: true`"),
        "{e}"
    );
}
