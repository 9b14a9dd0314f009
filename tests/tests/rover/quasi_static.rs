//! Quasi-static mechanisms: a rover that slips and sinks as with forces, bit-identical after interruptions; errors.
use linkwork_runtime::{Seconds, Simulation};

use crate::common;

fn run(sim: &mut Simulation, t: f64) {
    sim.run_until(Seconds::from_decimal(t).unwrap()).unwrap();
}

const QUASI_STATIC: [&str; 3] = ["motion=quasi_static", "step=20ms", "imu_rate=50Hz"];

fn scene(name: &str, set: &[&str]) -> Simulation {
    common::repository(&format!("{name}/sim.ron"), set).unwrap_or_else(|e| panic!("{e}"))
}

fn wheels(sim: &Simulation, what: &str) -> Vec<f64> {
    let of = |k| sim.get(&format!("Rover.Hardware.Wheels.Wheel{k}.SurfaceContact.{what}")).unwrap();
    (1..=6).map(of).collect()
}

fn place(sim: &Simulation) -> [f64; 3] {
    ["x", "y", "z"]
        .map(|c| sim.get(&format!("Rover.Hardware.Chassis/chassis.position.{c}")).unwrap())
}

/// Up a slope of soft soil it slips, sinks and loads its wheels as the rover with forces does.
#[test]
fn up_a_slope_it_slips_as_by_forces() {
    for slope in ["0 deg", "10 deg", "18 deg"] {
        let set = format!("slope={slope}");
        let mut forces = scene("slope_slip", &[&set, "step=2ms"]);
        let mut quasi = scene("slope_slip", &[&[&set[..]][..], &QUASI_STATIC].concat());
        let way = |sim: &mut Simulation| {
            run(sim, 8.0);
            let from = place(sim);
            run(sim, 16.0);
            (place(sim)[0] - from[0]).hypot(place(sim)[2] - from[2])
        };
        let (a, b) = (way(&mut forces), way(&mut quasi));
        println!("{slope}: {a:.4} m by forces, {b:.4} m");
        assert!((a - b).abs() < 0.02 * 0.8, "{slope}: {a} {b}");
        for (what, bound) in [("slip", 0.03), ("sinkage", 1.5e-3), ("normal_force", 12.0)] {
            let (a, b) = (wheels(&forces, what), wheels(&quasi, what));
            println!("  {what}: {a:.4?} {b:.4?}");
            for (a, b) in a.iter().zip(&b) {
                assert!((a - b).abs() < bound, "{slope} {what}: {a} {b}");
            }
        }
    }
}

/// In its own ruts: the bogies' wheels run in the tracks of the front wheels.
#[test]
fn in_ruts_it_slips_and_sinks_as_by_forces() {
    let ruts = ["slope=12 deg", "Rover.Environment.ruts=on"];
    let mut forces = scene("slope_slip", &[&ruts[..], &["step=2ms"]].concat());
    let mut quasi = scene("slope_slip", &[&ruts[..], &QUASI_STATIC].concat());
    run(&mut forces, 28.0);
    run(&mut quasi, 28.0);
    for (what, bound) in [("slip", 0.01), ("sinkage", 0.5e-3), ("rut", 0.5e-3)] {
        let (a, b) = (wheels(&forces, what), wheels(&quasi, what));
        println!("{what}: {a:.4?} {b:.4?}");
        for (a, b) in a.iter().zip(&b) {
            assert!((a - b).abs() < bound, "{what}: {a} {b}");
        }
    }
    // On fresh ground the slip of this wheel is 0.31.
    assert!(wheels(&quasi, "slip")[0] > 0.34 && wheels(&quasi, "rut")[4] > 5e-3);
}

/// Across a hillside it slides down as with forces.
#[test]
fn across_a_slope_it_crabs_downhill_as_by_forces() {
    let across = [
        "slope=12 deg",
        "place.heading=90 deg",
        "Rover.waypoints=[[0, 100]]",
        "Rover.start=[0, 0, 1.5707963]",
    ];
    let mut forces = scene("slope_slip", &[&across[..], &["step=2ms"]].concat());
    let mut quasi = scene("slope_slip", &[&across[..], &QUASI_STATIC].concat());
    run(&mut forces, 10.0);
    run(&mut quasi, 10.0);
    let (a, b) = (place(&forces), place(&quasi));
    println!("{a:.4?} {b:.4?}");
    assert!(a[0] < -0.02, "{a:?}");
    assert!((a[0] - b[0]).abs() < 0.25 * a[0].abs() && (a[1] - b[1]).abs() < 0.03, "{a:?} {b:?}");
}

/// On rigid ground it follows the rover with forces. Its wheels, at exact rates, work against each other up to the friction limit where motors would
/// yield, so it moves 2.5 % less.
#[test]
fn on_rigid_ground_it_drives_where_the_rover_with_forces_drives() {
    let mut forces = scene("rover_traverse", &["step=2ms"]);
    let mut quasi = scene("rover_traverse", &QUASI_STATIC);
    for t in [10.0, 30.0] {
        run(&mut forces, t);
        run(&mut quasi, t);
        let (a, b) = (place(&forces), place(&quasi));
        let apart = (a[0] - b[0]).hypot(a[1] - b[1]);
        println!("{t} s: {apart:.4} m apart, {:.4} m in height", a[2] - b[2]);
        assert!(apart < 0.03 * 0.25 * t + 0.03 && (a[2] - b[2]).abs() < 5e-3, "{a:?} {b:?}");
    }
    assert!(quasi.get("Mechanism.rolling.gap").unwrap() < 1e-6);
}

#[test]
fn cuts_leave_no_trace_with_ruts_and_a_parked_one_stays() {
    let set = [&QUASI_STATIC[..], &["Rover.Environment.ruts=on", "slope=8 deg"]].concat();
    let mut straight = scene("slope_slip", &set);
    run(&mut straight, 20.0);
    let mut cut = scene("slope_slip", &set);
    for t in [0.02, 1.3, 14.54] {
        run(&mut cut, t);
        let bytes = cut.checkpoint("").unwrap();
        cut = scene("slope_slip", &set);
        cut.restore(&bytes).unwrap();
    }
    run(&mut cut, 20.0);
    assert_eq!(straight.hash(), cut.hash());
    // The bogies' wheels run in the ruts of the front wheels.
    let ruts = wheels(&straight, "rut");
    println!("{ruts:?}");
    assert!(ruts[0] == 0.0 && ruts[2] > 2e-3 && ruts[3] > 2e-3, "{ruts:?}");
    let parked = [&QUASI_STATIC[..], &["slope=15 deg", "Rover.waypoints=[[0, 0]]"]].concat();
    let mut parked = scene("slope_slip", &parked);
    run(&mut parked, 2.0);
    let before = place(&parked);
    run(&mut parked, 22.0);
    let creep = (0..3).map(|k| (place(&parked)[k] - before[k]).abs()).fold(0.0, f64::max) / 20.0;
    println!("creep {creep:e} m/s");
    // The bound is a hundredth of the tolerance for soil.
    assert!(creep < 1e-7, "{creep}");
}

#[test]
fn what_cannot_be_is_told() {
    let told = |set: &[&str]| common::repository("slope_slip/sim.ron", set).err().unwrap();
    // The mechanism and its placement contradict each other.
    let e = told(&["motion=kinematics", "step=20ms", "imu_rate=50Hz", "place.motion=quasi_static"]);
    assert!(
        e.contains("no model computes its traction") && e.contains("wheel_soil_quasi_static"),
        "{e}"
    );
    let e = told(&["motion=quasi_static", "step=20ms", "imu_rate=50Hz", "place.motion=kinematics"]);
    assert!(e.contains("has a model for wheels of quasi-static machines"), "{e}");
    // This contact model does not have a quasi-static form.
    let e = told(&[
        "motion=quasi_static",
        "step=20ms",
        "imu_rate=50Hz",
        "Rover.contact=mobility.wheel_scm",
    ]);
    assert!(e.contains("wheel_scm_quasi_static"), "{e}");
    // The slope is too steep for the soil: the run ends and reports the reason.
    let mut sim = scene("slope_slip", &[&QUASI_STATIC[..], &["slope=33 deg"]].concat());
    let e = sim.run_until(Seconds::from_decimal(40.0).unwrap()).unwrap_err().to_string();
    assert!(e.contains("the traction of its wheels is not sufficient"), "{e}");
}
