//! `sims/capsule_landing`: a capsule lands on ground with parachutes that open in stages and airbags with vents.

use crate::common::{get, repository, seconds};
use linkwork_runtime::Simulation;

/// Mass of the cabin; mass of the main parachutes, kg.
const CABIN: f64 = 5600.0;
const MAIN: f64 = 410.0;

/// Start of a phase: its name, s, height of the centre of mass (m).
type Told = Vec<(String, f64, f64)>;

/// Results of a landing.
#[derive(Default, Debug)]
struct Landing {
    told: Told,
    /// Largest tension of the drogue's riser and of the main parachutes' riser, N.
    pulls: [f64; 2],
    /// Largest force of the ground, N, and its integral over time, N s.
    force: f64,
    impulse: f64,
    /// Downward velocity at the first touch, and when the base touches, m/s; 0: never.
    touch: f64,
    base: f64,
    /// Largest upward velocity after the first touch, m/s.
    up: f64,
}

fn number(sim: &Simulation, name: &str) -> f64 {
    sim.get(name).unwrap_or(0.0)
}

/// Runs the landing, and continues for `after` s.
fn land(sim: &mut Simulation, after: f64) -> Landing {
    let mut l = Landing::default();
    let (mut last, mut end) = ((0.0, 0.0), f64::INFINITY);
    while sim.time() < end {
        sim.step_event().unwrap();
        let (t, load) = (sim.time(), number(sim, "Load.y"));
        if l.told.last().is_none_or(|told| told.0 != sim.phase()) {
            l.told.push((sim.phase().to_string(), t, get(sim, "capsule.position").z));
            println!("{:?}", l.told[l.told.len() - 1]);
        }
        for (pull, name) in l.pulls.iter_mut().zip(["DrogueRiser.tension", "MainRiser.tension"]) {
            *pull = pull.max(number(sim, name));
        }
        // The integral uses the trapezoidal rule.
        l.impulse += 0.5 * (t - last.0) * (load + last.1);
        l.force = l.force.max(load);
        last = (t, load);
        let down = -get(sim, "capsule.velocity").z;
        if load > 2e4 && l.touch == 0.0 {
            (l.touch, end) = (down, t + after);
        }
        if number(sim, "Base.y") > 1e3 && l.base == 0.0 {
            l.base = down;
        }
        if l.touch > 0.0 {
            l.up = l.up.max(-down);
        }
    }
    println!("{l:?}");
    l
}

#[test]
fn a_capsule_comes_down_on_its_airbags() {
    let mut sim = repository("capsule_landing/sim.ron", &[]).unwrap();
    let l = land(&mut sim, 7.0);
    // The rows are phase, s and m, as in the README.
    let want = [
        ("fall", 0.02, 7497.2),
        ("mortar", 0.5, 7430.0),
        ("drogue", 1.21, 7330.5),
        ("pull_out", 76.77, 2500.0),
        ("mains", 82.04, 2161.9),
        ("shield_off", 157.49, 900.0),
        ("bags", 190.86, 576.9),
        ("touchdown", 255.48, 5.0),
        ("down", 255.79, 2.1),
    ];
    assert_eq!(l.told.len(), want.len());
    for ((name, t, height), (phase, at, wanted)) in l.told.iter().zip(want) {
        assert_eq!(name, phase);
        assert!(
            (t - at).abs() < 0.02 && (height - wanted).abs() < 2.0,
            "{phase}: {t} s, {height} m"
        );
    }
    for (found, kn) in l.pulls.into_iter().chain([l.force]).zip([105.5, 115.0, 457.4]) {
        assert!((found / 1e3 / kn - 1.0).abs() < 0.01, "{found} N for {kn} kN");
    }
    assert!((l.touch - 8.69).abs() < 0.02 && (l.base - 3.39).abs() < 0.05, "{l:?}");
    // The capsule does not bounce up, and stands on its base.
    let tilt = number(&sim, "Upright.tilt").to_degrees();
    assert!(l.up < 1.5 && tilt < 3.0, "{} m/s, {tilt} deg", l.up);
    assert!(get(&sim, "capsule.velocity").norm() < 1e-3);
    // The impulse of the ground equals the cabin's momentum plus its weight over time.
    let weight = CABIN * 9.79 * 7.0;
    let share = l.impulse / (CABIN * l.touch + weight);
    assert!((share - 1.0).abs() < 0.015, "{share}");
}

/// In still air its parachutes determine the descent rate. Airbags without venting throw it back with the impact speed, and it falls over.
#[test]
fn without_vents_it_bounces() {
    let set = ["wind=0", "wind_20ft=0", "Gusts.sigma_high=0", "vent=1e7"];
    let mut sim = repository("capsule_landing/sim.ron", &set).unwrap();
    while sim.phase() != "touchdown" {
        sim.step_event().unwrap();
    }
    // The parachutes carry the whole vehicle: the weight equals their drag plus the small drag of the
    // cabin.
    let density = 2.0 * number(&sim, "Main.drag")
        / (number(&sim, "Main.drag_area") * number(&sim, "Main.airspeed").powi(2));
    assert!((density / 1.0824 - 1.0).abs() < 1e-3, "{density} kg/m3: of US76 at 1271 m");
    let area = number(&sim, "Main.drag_area") + 0.95 * 15.9;
    let sink = (2.0 * (CABIN + MAIN) * 9.79 / (density * area)).sqrt();
    let down = -get(&sim, "capsule.velocity").z;
    assert!((down / sink - 1.0).abs() < 0.01, "{down} m/s for {sink}");
    let l = land(&mut sim, 1.0);
    // Without vents the gas acts as a spring; the only losses are the parachutes' pull, which ends at the touch, and
    // the air's drag.
    assert!((l.up / l.touch - 1.0).abs() < 0.03, "{l:?}");
    assert!(l.force > 9e5, "{l:?}");
    sim.run_until(seconds(sim.time().ceil() as u64 as f64 + 9.0)).unwrap();
    let tilt = number(&sim, "Upright.tilt").to_degrees();
    assert!(tilt > 60.0, "{tilt} deg");
}
