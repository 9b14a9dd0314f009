//! Localization of a rover with wheels, inertial unit, Sun and visual odometry, in `sims/rover_navigation`.
use linkwork_runtime::Simulation;
use linkwork_spatial::nalgebra::{Matrix3, Vector3};

use crate::common;

const ESTIMATOR: &str = "Rover.Localisation.PoseEstimator";
const VISUAL: &str = "localisation=visual";
const KINEMATICS: [&str; 3] = ["motion=kinematics", "step=20ms", "imu_rate=50Hz"];

fn rover(set: &[&str]) -> Simulation {
    common::repository("rover_navigation/sim.ron", set).unwrap_or_else(|e| panic!("{e}"))
}

fn run(sim: &mut Simulation, seconds: f64) {
    sim.run_until(common::seconds(seconds)).unwrap();
}

/// Errors of an estimate: x, y (m), heading (rad); and their squared norm in units of its covariance.
struct Off {
    error: Vector3<f64>,
    nees: f64,
}

fn off(sim: &Simulation) -> Off {
    let get = |port: &str| sim.get(&format!("{ESTIMATOR}.{port}")).unwrap();
    let truth = |port: &str| sim.get(&format!("Rover.Hardware.Sensors.Pose.{port}")).unwrap();
    let e = ["x", "y", "heading"].map(|port| truth(port) - get(port));
    let turn = std::f64::consts::TAU;
    let error = Vector3::new(e[0], e[1], e[2] - turn * (e[2] / turn).round());
    let [sx, sy, sh] = ["x", "y", "z"].map(|c| get(&format!("deviation.{c}")));
    let [xy, xh, yh] = ["x", "y", "z"].map(|c| get(&format!("covariance.{c}")));
    let P = Matrix3::new(sx * sx, xy, xh, xy, sy * sy, yh, xh, yh, sh * sh);
    Off { error, nees: error.dot(&(P.try_inverse().unwrap() * error)) }
}

/// Duration of the drive: 40 s, or `LINKWORK_SECONDS`.
fn length() -> u32 {
    std::env::var("LINKWORK_SECONDS").map_or(40, |n| n.parse().unwrap())
}

/// With forces, so that its wheels slip and scrub: checks the numbers of the README.
#[test]
fn it_knows_where_it_is_and_how_well() {
    let mut sim = rover(&[VISUAL]);
    let get = |sim: &Simulation, port: &str| sim.get(&format!("Rover.{port}")).unwrap();
    let (mut worst, mut way) = (0.0_f64, 0.0);
    for k in 1..=length() / 10 {
        run(&mut sim, f64::from(10 * k));
        let at = off(&sim);
        let estimator = |port: &str| sim.get(&format!("{ESTIMATOR}.{port}")).unwrap();
        let [dx, dy] = ["x", "y"].map(|c| {
            get(&sim, &format!("Hardware.Sensors.Pose.{c}"))
                - get(&sim, &format!("LocomotionSoftware.Odometry.{c}"))
        });
        way = get(&sim, "LocomotionSoftware.Odometry.path");
        println!(
            "{} s, {way:.1} m: off {:.3} m (wheels and gyro alone {:.3} m), {:.2} mrad; NEES {:.1} of 3; {} motions, {} lost, {} matches; status {}",
            10 * k,
            at.error.xy().norm(),
            dx.hypot(dy),
            1e3 * at.error.z,
            at.nees,
            estimator("motions"),
            estimator("lost"),
            estimator("matches"),
            get(&sim, "NavigationSoftware.AutoNav.status"),
        );
        // The bound is the 99.9 % quantile of χ² with three degrees of freedom.
        assert!(at.nees < 16.3, "{} s: NEES {}", 10 * k, at.nees);
        let off = at.error.xy().norm();
        worst = if off <= worst { worst } else { off };
        if get(&sim, "NavigationSoftware.AutoNav.ended") > 0.5 {
            break;
        }
    }
    let get = |port: &str| sim.get(&format!("{ESTIMATOR}.{port}")).unwrap();
    assert!(way > 0.1 * f64::from(length()).min(400.0) - 1.0, "{way}");
    // The first image does not give motion; the last may still be in processing.
    let pictures = get("motions") + get("lost");
    assert!(get("motions") > 0.9 * pictures && pictures >= 37.0, "{pictures}");
    assert!(worst < 0.05 + 0.01 * way, "{worst} m off after {way} m");
}

#[test]
fn without_its_camera_it_is_further_off_and_says_so() {
    let blind = format!("{ESTIMATOR}.gate=1");
    let mode = [&KINEMATICS[..], &[VISUAL, "Rover.Localisation.Pair.reach=0.1"]].concat();
    let (mut with, mut without) = (rover(&[&KINEMATICS[..], &[VISUAL]].concat()), rover(&mode));
    // The camera takes one image per second.
    let t = linkwork_tests::size(15.0, 30.0);
    run(&mut with, t);
    run(&mut without, t);
    let get = |sim: &Simulation, port: &str| sim.get(&format!("{ESTIMATOR}.{port}")).unwrap();
    assert_eq!(get(&without, "motions"), 0.0);
    assert!(get(&without, "lost") > 0.8 * t && get(&with, "motions") > 0.8 * t);
    let sigma = |sim| get(sim, "deviation.x").hypot(get(sim, "deviation.y"));
    println!("{} m with, {} m without", sigma(&with), sigma(&without));
    assert!(sigma(&without) > 2.0 * sigma(&with) && off(&without).nees < 16.3);
    // Inconsistent matches are rejected.
    let mut gated = rover(&[&KINEMATICS[..], &[VISUAL, &blind]].concat());
    run(&mut gated, t);
    assert!(get(&gated, "lost") > get(&with, "lost") + t / 6.0);
}

#[test]
fn it_begins_where_it_is_told_and_maps_from_there() {
    // The map is shifted by an error of two metres, and the goal is reached relative to the rover's estimate.
    let moved = format!("{ESTIMATOR}.start=[-38, 1, 0]");
    let mut sim = rover(&[&KINEMATICS[..], &[VISUAL, &moved]].concat());
    run(&mut sim, 12.0);
    let at = off(&sim);
    assert!((at.error.x + 2.0).abs() < 0.1 && (at.error.y + 1.0).abs() < 0.1, "{}", at.error);
    let distance = sim.get("Rover.NavigationSoftware.AutoNav.distance").unwrap();
    let [x, y] = ["x", "y"].map(|c| sim.get(&format!("{ESTIMATOR}.{c}")).unwrap());
    assert!((distance - (x - 40.0).hypot(y)).abs() < 0.1, "{distance} {x} {y}");
}

#[test]
fn split_equals_straight_with_pictures_and_filter() {
    let mode = [&KINEMATICS[..], &[VISUAL]].concat();
    let mut straight = rover(&mode);
    run(&mut straight, 6.0);
    let mut sim = rover(&mode);
    for t in [0.02, 1.0, 1.02, 2.5, 4.0] {
        run(&mut sim, t);
        let saved = sim.checkpoint("").unwrap();
        let mut other = sim.fork();
        run(&mut other, t + 1.1);
        sim = rover(&mode);
        sim.restore(&saved).unwrap();
    }
    run(&mut sim, 6.0);
    assert!(sim.get(&format!("{ESTIMATOR}.motions")).unwrap() >= 4.0);
    assert_eq!(sim.state(), straight.state());
    assert_eq!(sim.hash(), straight.hash());
}

#[test]
fn what_cannot_be_is_refused() {
    let walk = format!("{ESTIMATOR}.wheel_walk=[0, 0.1, 0.1]");
    let start = format!("{ESTIMATOR}.start_heading=0");
    for (set, fact) in [
        (&["localisation=guess"][..], "localisation_guess.ron"),
        (&[VISUAL, &walk], "`wheel_walk` is [0"),
        (&[VISUAL, &start], "start_heading"),
        // Only `navigation.autonav` reads its estimate.
        (&[VISUAL, "Rover.navigation=waypoints"], "AutoNav"),
    ] {
        let told = common::repository("rover_navigation/sim.ron", set).err().unwrap();
        assert!(told.contains(fact), "{set:?}: {told}");
    }
}
