//! The rover's path does not depend on the step size.
use linkwork_runtime::Seconds;

use crate::common;

#[test]
fn steps_of_half_a_millisecond_to_two_drive_the_same_50_m() {
    let run = |step: &str| {
        let set = [
            format!("step={step}"),
            "Rover.speed=0.4".into(),
            "Rover.Environment.spacing=0.1".into(),
        ];
        let mut sim = common::traverse(&set.each_ref().map(String::as_str)).unwrap();
        let path = sim.variable("Rover.LocomotionSoftware.Odometry.path").unwrap().place;
        // The run continues in whole seconds until the odometry reports arrival.
        while sim.value(path) < 50.0 {
            let next = sim.time() as u64 + 1;
            assert!(next < 200, "step {step}: {} m in 200 s", sim.value(path));
            sim.run_until(Seconds { num: next, den: 1 }).unwrap();
        }
        (sim.time(), common::get(&sim, "Rover.Hardware.Chassis/chassis.position"))
    };
    let [half, one, two] = ["0.5 ms", "1 ms", "2 ms"].map(run);
    println!("{half:?}\n{one:?}\n{two:?}");
    for (time, at) in [one, two] {
        let apart = (at - half.1).norm();
        // Measured: less than 0.1 mm.
        assert!(time == half.0 && apart < 0.5, "{apart} m apart at {time} s");
    }
}
