//! Two craft in one orbit: `sims/formation` and `sims/docking`.
#![allow(clippy::unwrap_used, non_snake_case)]
use linkwork_runtime::Simulation;
use linkwork_spatial::Vec3;

#[path = "../common/mod.rs"]
mod common;
use common::{get, repository, rotation, seconds, velocity};

/// Position and velocity of a craft from another, in the other's axes: radial, along the motion, normal.
fn beside(sim: &Simulation, chief: &str, deputy: &str) -> (Vec3, Vec3) {
    let place = |body: &str| get(sim, &format!("{body}.position"));
    let (r, v) = (place(chief), velocity(sim, chief));
    let (x, z) = (r.normalize(), r.cross(&v).normalize());
    let y = z.cross(&x);
    let n = r.cross(&v).norm() / r.norm_squared();
    let along = |w: Vec3| Vec3::new(x.dot(&w), y.dot(&w), z.dot(&w));
    let p = along(place(deputy) - r);
    (p, along(velocity(sim, deputy) - v) - Vec3::z().cross(&p) * n)
}

#[test]
fn a_deputy_comes_to_its_place_and_is_held_there() {
    let mut sim = repository("formation/sim.ron", &[]).unwrap();
    let (start, drift) = beside(&sim, "chief", "deputy");
    // As the file says in words: 200 m above, 1500 m behind, 80 m to the side.
    assert!((start - Vec3::new(200.0, -1500.0, 80.0)).norm() < 1e-6, "{start}");
    assert!((drift - Vec3::new(0.15, -0.5, -0.1)).norm() < 1e-6, "{drift}");
    sim.run_until(seconds(1944.0)).unwrap();
    let place = Vec3::new(0.0, -300.0, 0.0);
    let taken = sim.get("Transfer.dv").unwrap();
    let (there, _) = beside(&sim, "chief", "deputy");
    println!("{} m off, {taken} m/s", (there - place).norm());
    // Nothing is done in the last minute, and nothing under 2 cm/s.
    assert!((there - place).norm() < 3.0 && (taken - 1.04).abs() < 0.02, "{there} {taken}");
    sim.run_until(seconds(6000.0)).unwrap();
    let spent = sim.get("Spent.y").unwrap();
    let mut worst = 0.0_f64;
    while sim.before(seconds(12_000.0)) {
        sim.step_event().unwrap();
        let (r, _) = beside(&sim, "chief", "deputy");
        let off = (r - place).norm();
        worst = if off <= worst { worst } else { off };
    }
    let (first, then) = (spent, sim.get("Spent.y").unwrap() - spent);
    println!("held within {worst} m, {first} m/s for the arrival, {then} m/s for 6000 s");
    assert!(worst < 0.15 && (0.02..0.06).contains(&(then / 2.0)) || worst < 0.15 && then < 0.3);
}

#[test]
fn a_chaser_is_captured_and_what_it_brings_is_booked() {
    let mut sim = repository("docking/sim.ron", &[]).unwrap();
    let contact = Vec3::new(0.0, -2.5, 0.0);
    let (start, drift) = beside(&sim, "target", "chaser");
    assert!((start + Vec3::y() * 150.0).norm() < 1e-6 && drift.norm() < 1e-9, "{start} {drift}");
    let mut before = None;
    while sim.phase() == "approach" {
        before = Some((
            beside(&sim, "target", "chaser"),
            velocity(&sim, "target"),
            velocity(&sim, "chaser"),
        ));
        sim.step_event().unwrap();
    }
    let t = sim.time();
    // From 0.8 m/s at 75 m on: ρ = (ρ₁ + v/k) e^(−kt) − v/k, to 1 cm.
    let down = ((75.0_f64 + 5.0) / (0.01 + 5.0)).ln() / 0.01;
    println!("captured at {t} s, of it {down} s on the slope");
    assert!(sim.phase() == "captured" && (t - 377.78).abs() < 0.05);
    let ((r, v), target, chaser) = before.unwrap();
    assert!((r - contact).norm() < 0.1 && (v - Vec3::y() * 0.05).norm() < 2e-3, "{r} {v}");
    // The last row is less than a step before: what changes the velocity of the target is the impact.
    let m = (2000.0, 500.0 + sim.get("Tank.propellant").unwrap());
    let share = m.1 / (m.0 + m.1);
    let jump = velocity(&sim, "target") - target;
    let wanted = (chaser - target) * share;
    println!("target changes by {jump}, its share is {wanted}");
    let report = sim.take_moves();
    assert!(report.iter().any(|(_, _, r)| r.notes.iter().any(|n| n.contains("momentum"))));
    let held = get(&sim, "chaser.position");
    sim.run_until(seconds(1200.0)).unwrap();
    assert!(
        (get(&sim, "chaser.position") - held).norm() < 1e-9 && (held - contact).norm() < 0.0101
    );
    assert!(rotation(&sim, "chaser").angle() < 1e-6);
}

#[test]
fn too_fast_near_the_target_it_backs_away() {
    let mut sim = repository("docking/sim.ron", &["slope=0.05"]).unwrap();
    while sim.phase() == "approach" {
        sim.step_event().unwrap();
    }
    let t = sim.time();
    assert_eq!(sim.phase(), "abort");
    assert!((beside(&sim, "target", "chaser").0.norm() - 22.5).abs() < 0.01);
    let mut nearest = f64::INFINITY;
    while sim.before(seconds(1200.0)) {
        sim.step_event().unwrap();
        nearest = nearest.min(beside(&sim, "target", "chaser").0.norm());
    }
    let (end, rest) = beside(&sim, "target", "chaser");
    println!("abort at {t} s, nearest {nearest} m, at the end {end}");
    assert!(nearest > 15.0 && (end + Vec3::y() * 200.0).norm() < 0.01 && rest.norm() < 1e-4);
}
