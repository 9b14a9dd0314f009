//! A rover that finds out where it is: wheels, inertial unit, Sun and visual odometry, in `sims/rover_navigation`.
#![allow(clippy::unwrap_used, non_snake_case)]
use linkwork_runtime::Simulation;
use linkwork_spatial::nalgebra::{Matrix3, Vector3};

#[path = "../common/mod.rs"]
mod common;

const ESTIMATOR: &str = "Rover.Localisation.PoseEstimator";
const VISUAL: &str = "localisation=visual";
const KINEMATICS: [&str; 3] = ["motion=kinematics", "step=20ms", "imu_rate=50Hz"];

fn rover(set: &[&str]) -> Simulation {
    common::repository("rover_navigation/sim.ron", set).unwrap_or_else(|e| panic!("{e}"))
}

fn run(sim: &mut Simulation, seconds: f64) {
    sim.run_until(common::seconds(seconds)).unwrap();
}

/// How far off an estimate is: x, y (m), heading (rad); and that squared in units of its covariance.
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

/// So long the drive takes: 100 s, or as many as `LINKWORK_SECONDS` says.
fn length() -> u32 {
    std::env::var("LINKWORK_SECONDS").map_or(100, |n| n.parse().unwrap())
}

#[test]
fn it_knows_where_it_is_better_than_its_wheels_do() {
    let mut sim = rover(&[&KINEMATICS[..], &[VISUAL]].concat());
    let get = |sim: &Simulation, path: &str| sim.get(path).unwrap();
    let mut worst = 0.0_f64;
    for k in 1..=length() / 10 {
        run(&mut sim, f64::from(10 * k));
        let at = off(&sim);
        let port = |port: &str| get(&sim, &format!("{ESTIMATOR}.{port}"));
        let [dx, dy] = ["x", "y"].map(|c| {
            get(&sim, &format!("Rover.Hardware.Sensors.Pose.{c}"))
                - get(&sim, &format!("Rover.LocomotionSoftware.Odometry.{c}"))
        });
        println!(
            "{} s: off {:.3} {:.3} m, {:.2} mrad, sigma {:.3} {:.3} m {:.2} mrad, NEES {:.1}; wheels {:.3} m; slip {:.3}, motions {}, lost {}, matches {}; way {:.1}; status {}",
            10 * k,
            at.error.x,
            at.error.y,
            1e3 * at.error.z,
            port("deviation.x"),
            port("deviation.y"),
            1e3 * port("deviation.z"),
            at.nees,
            dx.hypot(dy),
            port("slip"),
            port("motions"),
            port("lost"),
            port("matches"),
            get(&sim, "Rover.LocomotionSoftware.Odometry.path"),
            get(&sim, "Rover.NavigationSoftware.AutoNav.status"),
        );
        let off = at.error.xy().norm();
        worst = if off <= worst { worst } else { off };
    }
    assert!(worst < 1.0);
}
