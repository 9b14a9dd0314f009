//! `sims/arm_placement`: an arm on a rover presses an instrument on a rock with the commanded force.
use linkwork_runtime::Simulation;

use crate::common;

fn get(sim: &Simulation, name: &str) -> f64 {
    sim.get(name).unwrap_or_else(|e| panic!("{e}"))
}

fn step(sim: &mut Simulation) {
    let next = sim.time() + 0.05;
    sim.run_until(common::seconds(next)).unwrap();
}

/// Load of all wheels along the vertical, N.
fn carried(sim: &Simulation) -> f64 {
    let load = |k| format!("Rover.Hardware.Wheels.Wheel{k}.SurfaceContact.contact_force.z");
    (1..=6).map(|k| get(sim, &load(k))).sum()
}

/// Weight of rover, bracket, arm (of its URDF file) and instrument, N.
const WEIGHT: f64 = (899.0 + 1.0 + 21.1 + 0.6) * 3.72076;

/// Means over the last two seconds of pressing: the force on the instrument, and the load of all wheels; N.
fn pressed(set: &[&str]) -> [f64; 2] {
    let mut sim =
        common::repository("arm_placement/sim.ron", set).unwrap_or_else(|e| panic!("{e}"));
    let force = |sim: &Simulation| get(sim, "instrument.contact_force.z");
    let (mut rows, mut began) = (Vec::new(), None);
    while get(&sim, "Arm.Controller.done") < 0.5 && sim.time() < 30.0 {
        step(&mut sim);
        if get(&sim, "Arm.Controller.index") == 2.0 {
            let began = *began.get_or_insert(sim.time());
            if sim.time() > began + 2.8 {
                rows.push([force(&sim), carried(&sim)]);
            }
        }
    }
    assert_eq!(get(&sim, "Arm.Controller.failed"), 0.0, "{set:?}: {} s", sim.time());
    assert_eq!((get(&sim, "Arm.Controller.done"), force(&sim)), (1.0, 0.0), "{set:?}");
    assert!(rows.len() > 30, "{} rows", rows.len());
    let mean = |k: usize| rows.iter().map(|r| r[k]).sum::<f64>() / rows.len() as f64;
    println!("{set:?}: {:.3} N on the rock, {:.3} N on the wheels", mean(0), mean(1));
    [mean(0), mean(1)]
}

#[test]
fn the_instrument_is_pressed_with_the_force_that_is_told_wherever_the_rock_is() {
    for (set, wanted) in [
        (&[][..], 20.0),
        (&["force=35 N", "error=[0.01, -0.01, 0.02]"], 35.0),
        (&["force=8 N", "error=[0, 0, -0.02]", "rock=[1.45, -0.15, 0.35]"], 8.0),
        (&["ground=mobility.wheel_soil"], 20.0),
    ] {
        let [force, wheels] = pressed(set);
        assert!((force / wanted - 1.0).abs() < 0.02, "{set:?}: {force} N, not {wanted} N");
        // The wheels do not carry the part carried by the rock.
        let off = wheels + force - WEIGHT;
        assert!(off.abs() < 0.5, "{set:?}: {off} N more than the weight");
    }
}
