//! `sims/sol`: a sol of a rover, with the numbers of its README.
use linkwork_runtime::Simulation;

use crate::common;
use common::seconds;

/// Length of an hour of local solar time, s.
const HOUR: f64 = 88_775.244 / 24.0;
const SOL: f64 = 88_775.0;

fn get(sim: &Simulation, name: &str) -> f64 {
    sim.get(name).unwrap_or_else(|e| panic!("{e}"))
}

fn sol(set: &[&str]) -> Simulation {
    common::repository("sol/sim.ron", set).unwrap_or_else(|e| panic!("{e}"))
}

fn close(what: &str, got: f64, wanted: f64, tolerance: f64) {
    println!("{what}: {got:.4}");
    assert!((got - wanted).abs() <= tolerance, "{what}: {got} instead of {wanted}");
}

/// Position of the chassis, and its joints.
fn stance(sim: &Simulation) -> Vec<f64> {
    let chassis = "Rover.Hardware.Chassis/chassis";
    let place =
        ["position.x", "position.y", "position.z", "rotation.x", "rotation.y", "rotation.z"];
    let joints = ["rocker_left", "rocker_right", "bogie_left", "bogie_right"];
    (place.iter().map(|lane| format!("{chassis}.{lane}")))
        .chain(joints.iter().map(|j| format!("Rover.Hardware.Chassis/{j}.angle")))
        .map(|name| get(sim, &name))
        .collect()
}

#[test]
fn a_sol_has_the_metrics_that_its_page_says() {
    let mut sim = sol(&[]);
    let (mut phase, mut changes, mut held) = (sim.phase().to_string(), Vec::new(), stance(&sim));
    let [mut charge, mut electronics, mut battery] = [[f64::INFINITY, f64::NEG_INFINITY]; 3];
    while sim.time() < SOL {
        sim.step_event().unwrap_or_else(|e| panic!("{e}"));
        if sim.phase() != phase {
            phase = sim.phase().to_string();
            changes.push((phase.clone(), sim.time()));
            held = stance(&sim);
        }
        if phase != "drive" {
            // The rover keeps its pose, up to round-off.
            let moved = stance(&sim).iter().zip(&held).map(|(a, b)| (a - b).abs()).sum::<f64>();
            assert!(moved < 1e-9, "{moved} at {} s", sim.time());
        }
        for (ends, name) in [
            (&mut charge, "Power.Battery.charge"),
            (&mut electronics, "Thermal.Box.temperature"),
            (&mut battery, "Thermal.Pack.temperature"),
        ] {
            let value = get(&sim, name);
            *ends = [ends[0].min(value), ends[1].max(value)];
        }
    }
    println!("{changes:?}");
    // The drive begins at the first sample after 10.75 h, and the command is output one sample
    // later.
    assert_eq!(changes.len(), 2);
    assert_eq!((changes[0].0.as_str(), changes[1].0.as_str()), ("drive", "afternoon"));
    close("begins to drive, h", changes[0].1 / HOUR, 10.75, 20.0 / HOUR);
    close("drives for, s", changes[1].1 - changes[0].1, 90.0, 20.0);
    close("distance, m", get(&sim, "Way.length"), 14.16, 0.1);
    let (energy, way) = (get(&sim, "EnergyOfDrive.energy"), get(&sim, "Way.length"));
    close("energy per metre, J/m", get(&sim, "EnergyPerMetre.y"), energy / way, 1e-9);
    close("energy per metre, J/m", energy / way, 463.0, 15.0);
    close("energy from the array, Wh", get(&sim, "EnergyIn.energy") / 3600.0, 986.5, 5.0);
    close("energy of the heaters, Wh", get(&sim, "EnergyOfHeaters.energy") / 3600.0, 141.0, 3.0);
    close("least charge, %", 100.0 * charge[0], 62.9, 0.3);
    close("greatest charge, %", 100.0 * charge[1], 94.4, 0.3);
    close("charge at the end, %", 100.0 * get(&sim, "Power.Battery.charge"), 84.3, 0.3);
    // The thermostats determine the lowest temperatures.
    close("coldest electronics, °C", electronics[0] - 273.15, -30.0, 0.01);
    close("warmest electronics, °C", electronics[1] - 273.15, -7.3, 0.3);
    close("coldest battery, °C", battery[0] - 273.15, -20.0, 0.01);
    assert_eq!((get(&sim, "Plan.done"), get(&sim, "Plan.failures")), (1.0, 0.0));
    assert_eq!(
        (get(&sim, "Power.Battery.state.flat"), get(&sim, "Power.Radio.state.count")),
        (0.0, 0.0)
    );
}

#[test]
fn without_shadow_the_array_gives_what_the_sun_of_the_textbook_says() {
    // Rays with a length of a millimetre hit nothing.
    let mut sim = sol(&["Power.Sunlit.range=0.001", "Power.Dust.settling=0"]);
    let mut rise = f64::NAN;
    // The loop ends at the planned drive.
    while sim.time() < 39_600.0 {
        sim.step_event().unwrap_or_else(|e| panic!("{e}"));
        if rise.is_nan() && get(&sim, "Clock.day") > 0.5 {
            rise = sim.time();
        }
    }
    // At L_s = 347.5° the declination is −5.35° and the distance 1.5263 AU. The hour angle of
    // sunrise follows from cos H = −tan φ tan δ.
    let (lat, dec) = ((-1.95_f64).to_radians(), (-5.35_f64).to_radians());
    let dawn = 12.0 - (-lat.tan() * dec.tan()).acos().to_degrees() / 15.0;
    close("sunrise, h", rise / HOUR, dawn, 30.0 / HOUR);
    let power = |t: f64| {
        let hour = (t / HOUR - 12.0) / 12.0 * std::f64::consts::PI;
        let z = lat.sin() * dec.sin() + lat.cos() * dec.cos() * hour.cos();
        if z <= 0.0 {
            return 0.0;
        }
        let slant = 0.9 / z.max(1e-3);
        1361.0 / 1.5263_f64.powi(2) * z / (1.0 + 0.16 * slant) * 0.27 * 1.95 * 0.5
    };
    let energy: f64 = (0..3960).map(|k| power(10.0 * f64::from(k) + 5.0) * 10.0).sum();
    // The panel is almost level: the ground tilts it by less than two degrees.
    close(
        "energy by then, Wh",
        get(&sim, "EnergyIn.energy") / 3600.0,
        energy / 3600.0,
        0.02 * energy / 3600.0,
    );
}

#[test]
fn short_of_charge_it_stays_where_it_is_and_does_the_rest() {
    let mut sim = sol(&["charge=0.3"]);
    sim.run_until(seconds(15.6 * HOUR)).unwrap_or_else(|e| panic!("{e}"));
    assert_eq!((sim.phase(), get(&sim, "Way.length")), ("morning", 0.0));
    assert_eq!((get(&sim, "Plan.failures"), get(&sim, "Plan.failed_step")), (1.0, 4.0));
    assert_eq!((get(&sim, "Plan.running.talk"), get(&sim, "Power.Radio.running")), (1.0, 1.0));
}
