//! `sims/lunar_landing`: down to the turning Moon, and standing there.
#![allow(clippy::unwrap_used)]

#[path = "../common/mod.rs"]
mod common;
use common::{get, repository, rotation, seconds};

/// Of the Moon: m³/s², rad/s (IAU 2009), m at the site; the site's latitude, rad.
const MU: f64 = 4.9028e12;
const RATE: f64 = 2.661_699_5e-6;
const RADIUS: f64 = 1_735_400.0;
const LATITUDE: f64 = 0.352_382;

#[test]
fn a_lander_comes_down_on_the_moon_and_stays() {
    let mut sim = repository("lunar_landing/sim.ron", &[]).unwrap();
    let mut told = Vec::new();
    let (mut thrust, mut force, mut phase) = (0.0_f64, 0.0_f64, String::new());
    while sim.before(seconds(700.0)) {
        sim.step_event().unwrap();
        thrust = thrust.max(sim.get("Engine.thrust").unwrap_or(0.0));
        force = force.max(sim.get("Leg1.force").unwrap_or(0.0));
        if sim.phase() != phase {
            phase = sim.phase().to_string();
            let row = (sim.get("Ground.height").unwrap(), sim.get("Ground.speed").unwrap());
            println!("{phase:<10} {:8.2} s {:10.2} m {:9.3} m/s", sim.time(), row.0, row.1);
            told.push((phase.clone(), sim.time(), row.0, row.1));
        }
    }
    // (phase, s, m, m/s) as the README tells.
    let want = [
        ("braking", 0.0, 15_000.0, 1670.0),
        ("approach", 438.0, 2406.0, 136.8),
        ("vertical", 556.0, 33.2, 1.72),
        ("drop", 576.2, 2.6, 1.495),
        ("standing", 600.0, 1.23, 0.0),
    ];
    assert_eq!(told.len(), want.len(), "{told:?}");
    for ((phase, t, height, speed), w) in told.iter().zip(want) {
        assert_eq!(phase, w.0);
        assert!((t - w.1).abs() < 0.1, "{phase}: {t} s");
        assert!((height - w.2).abs() < 1e-3 * w.2 + 0.01, "{phase}: {height} m");
        assert!((speed - w.3).abs() < 1e-3 * w.3 + 5e-3, "{phase}: {speed} m/s");
    }
    let place = get(&sim, "lander.position");
    let left = sim.get("Tank.propellant").unwrap();
    println!("at {place}, {left} kg left, thrust {thrust} N, a leg {force} N");
    assert!(place.xy().norm() < 0.03 && (left - 341.6).abs() < 1.0);
    assert!((thrust / 11.0e3 - 1.0).abs() < 0.01 && (force / 10.0e3 - 1.0).abs() < 0.01);
    // What the honeycomb took is the energy of the fall from 1.2 m at 1.5 m/s, and of the way down in it.
    let (mass, g) = (1450.0 + left, MU / RADIUS.powi(2) - (RATE * LATITUDE.cos()).powi(2) * RADIUS);
    let crushed = |k: u32| sim.get(&format!("Leg{k}.crushed")).unwrap();
    let taken: f64 = (1..=4).map(|k| sim.get(&format!("Leg{k}.taken")).unwrap()).sum();
    let deep = (1..=4).map(crushed).sum::<f64>() / 4.0;
    let fallen = 0.5 * mass * told[3].3.powi(2) + mass * g * (1.2 + deep);
    println!("honeycomb {deep} m, {taken} J of {fallen} J");
    // The rest went into the damping of the struts.
    assert!((0.85..1.0).contains(&(taken / fallen)) && (crushed(1) - 0.17).abs() < 0.01);
    sim.run_until(seconds(800.0)).unwrap();
    let drift = (get(&sim, "lander.position") - place).norm() / 100.0;
    let carried: f64 = (1..=4).map(|k| sim.get(&format!("Leg{k}.force")).unwrap()).sum();
    println!("drift {drift:e} m/s, carried {carried} N of {}", mass * g);
    // Measured 4e-8 m/s: the smooth friction of the feet against the part of the weight along the ground.
    assert!(drift < 1e-6 && (carried / (mass * g) - 1.0).abs() < 1e-4);
    assert!(rotation(&sim, "lander").angle() < 0.01);
}
