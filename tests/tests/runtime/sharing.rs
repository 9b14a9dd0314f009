//! Wheels with torque sharing: on hard ground they work less against each other, and the rover reaches the same position.
use linkwork_runtime::Simulation;

use crate::common;

fn get(sim: &Simulation, name: &str) -> f64 {
    sim.get(name).unwrap()
}

/// Returns the mean power that wheels transfer to each other (W), and the final position (m), from 5 to 30 s of `sims/rover_traverse`.
fn fought(droop: &str) -> (f64, [f64; 2]) {
    let mut sim = common::traverse(&[&format!("Rover.droop={droop}")]).unwrap();
    sim.run_until(common::seconds(5.0)).unwrap();
    let (mut lost, mut n) = (0.0, 0.0);
    for k in 0..1250 {
        sim.run_until(common::seconds(5.0 + 0.02 * f64::from(k + 1))).unwrap();
        let powers = (1..=6).map(|k| {
            let wheel = format!("Rover.Hardware.Wheels.Wheel{k}");
            get(&sim, &format!("{wheel}.Motor.shaft_torque"))
                * get(&sim, &format!("{wheel}.Encoder.rate"))
        });
        let (sum, both) = powers.fold((0.0, 0.0), |(s, b), p| (s + p, b + f64::abs(p)));
        lost += 0.5 * (both - f64::abs(sum));
        n += 1.0;
    }
    let place =
        ["x", "y"].map(|a| get(&sim, &format!("Rover.Hardware.Chassis/chassis.position.{a}")));
    (lost / n, place)
}

#[test]
fn wheels_with_droop_work_less_against_each_other() {
    let (exact, there) = fought("0");
    let (shared, here) = fought("0.002");
    let apart = (there[0] - here[0]).hypot(there[1] - here[1]);
    println!(
        "{exact:.1} W against each other at exact rates, {shared:.1} W with droop; {apart:.3} m apart"
    );
    assert!(exact > 5.0 && shared < 0.6 * exact, "{exact} {shared}");
    assert!(apart < 0.1, "{there:?} {here:?}");
}
