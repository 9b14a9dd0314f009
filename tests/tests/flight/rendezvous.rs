//! Two spacecraft in one orbit: `sims/formation` and `sims/docking`.
use linkwork_runtime::Simulation;
use linkwork_spatial::Vec3;
use linkwork_world::orbit::propagate;
use linkwork_world::planet::PointMotion;

use crate::common::{get, repository, rotation, seconds, velocity};

/// μ of the Earth, m³/s², as in the files.
const MU: f64 = 3.986_004_418e14;

/// Returns position and velocity of a spacecraft relative to another, in the other's axes: radial, along the motion, normal.
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
    // The file describes the start: 200 m above, 1500 m behind, 80 m to the side.
    assert!((start - Vec3::new(200.0, -1500.0, 80.0)).norm() < 1e-6, "{start}");
    assert!((drift - Vec3::new(0.15, -0.5, -0.1)).norm() < 1e-6, "{drift}");
    sim.run_until(seconds(1944.0)).unwrap();
    let place = Vec3::new(0.0, -300.0, 0.0);
    let taken = sim.get("Transfer.dv").unwrap();
    let (there, _) = beside(&sim, "chief", "deputy");
    println!("{} m off, {taken} m/s", (there - place).norm());
    // The engine gives no pulses in the last minute, and none below 2 cm/s.
    assert!(
        ((there - place).norm() - 0.096).abs() < 5e-4 && (taken - 1.040).abs() < 2e-3,
        "{there} {taken}"
    );
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
    assert!((worst - 0.095).abs() < 5e-3, "{worst}");
    assert!((first - 1.295).abs() < 2e-3 && (then - 7.8e-3).abs() < 2e-4, "{first} {then}");
}

#[test]
fn a_chaser_is_captured_and_what_it_brings_is_booked() {
    let mut sim = repository("docking/sim.ron", &[]).unwrap();
    let contact = Vec3::new(0.0, -2.5, 0.0);
    let (start, drift) = beside(&sim, "target", "chaser");
    assert!((start + Vec3::y() * 150.0).norm() < 1e-6 && drift.norm() < 1e-9, "{start} {drift}");
    let (mut before, mut turned, mut spent) = (None, 0.0_f64, (0.0, 0.0));
    while sim.phase() == "approach" {
        let place = get(&sim, "target.position");
        let falls = PointMotion { position: place, velocity: velocity(&sim, "target") };
        spent = (sim.get("Spent.y").unwrap(), sim.get("Guidance.across").unwrap());
        before = Some((sim.time(), beside(&sim, "target", "chaser"), falls));
        sim.step_event().unwrap();
        if let Ok(e) = sim.get("Pointing.error") {
            turned = turned.max(e);
        }
    }
    let t = sim.time();
    // From 75 m on, at 0.8 m/s, the distance is ρ = (ρ₁ + v/k) e^(−kt) − v/k, until it is 1 cm.
    let down = ((75.0_f64 + 5.0) / (0.01 + 5.0)).ln() / 0.01;
    // Before that the chaser flies 72.5 m at 0.8 m/s. It first accelerates for 30 s with 10 N over 9 m, and gains the
    // last 0.2 m/s with a time constant of 10 s.
    let before_slope = 30.0 + (72.5 - 9.0 + 0.2 * 10.0) / 0.8;
    println!("captured at {t} s; {before_slope} s and {down} s by the closed form");
    assert!((t - before_slope - down).abs() < 0.5);
    assert!(sim.phase() == "captured" && (t - 389.26).abs() < 0.05);
    // The jets control its attitude with pulses of 1 N s.
    println!("{spent:?} m/s spent, across");
    assert!((spent.0 - 1.892).abs() < 5e-3 && (spent.1 - 6.96e-3).abs() < 5e-5, "{spent:?}");
    println!("turned by {} deg at most", turned.to_degrees());
    assert!((turned.to_degrees() - 0.514).abs() < 5e-3, "{turned}");
    let (row, (r, v), before_target) = before.unwrap();
    assert!((r - contact).norm() < 0.1 && (v - Vec3::y() * 0.05).norm() < 2e-3, "{r} {v}");
    // The target is in free fall until the capture; its velocity change is its share of the impact.
    let fallen = propagate(MU, &before_target, t - row).unwrap().velocity;
    let jump = velocity(&sim, "target") - fallen;
    let (brought, met) = (500.0, 2000.0);
    let wanted = v.norm() * brought / (met + brought);
    let ahead = rotation(&sim, "target") * v.normalize();
    println!("the target gains {} m/s, its share is {wanted} m/s", jump.norm());
    // Between the last sample and the capture a jet may add a pulse of 2 mm/s.
    assert!((jump - ahead * wanted).norm() < 0.05 * wanted, "{jump} {ahead}");
    let report = sim.take_moves();
    assert!(report.iter().any(|(_, _, r)| r.notes.iter().any(|n| n.contains("momentum"))));
    let held = get(&sim, "chaser.position");
    sim.run_until(seconds(1200.0)).unwrap();
    assert!(
        (get(&sim, "chaser.position") - held).norm() < 1e-9 && (held - contact).norm() < 0.0101
    );
    assert!(rotation(&sim, "chaser").angle() < 1f64.to_radians());
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
    assert!((t - 180.86).abs() < 0.05 && (nearest - 6.17).abs() < 0.05);
    // Single pulses of 2 mm/s keep the chaser there.
    assert!((end + Vec3::y() * 200.0).norm() < 0.05 && rest.norm() < 4e-3, "{end} {rest}");
}

/// The last metres and their effect on the target: the plumes of the braking jets transfer their impulse to it; then latches, springs and dampers
/// absorb the relative energy of two bodies of 500 kg and 2 t, and they are locked without an impact.
#[test]
fn plumes_push_the_target_and_a_soft_capture_takes_what_is_left() {
    let mut sim = repository("docking/soft_capture.ron", &[]).unwrap();
    let place = get(&sim, "target.position");
    let free = PointMotion { position: place, velocity: velocity(&sim, "target") };
    // The forces are radial and along-track, N, at an instant; the impulses are from stop to stop.
    let along = |sim: &Simulation| {
        let load = get(sim, "Plume1.load.force") + get(sim, "Plume2.load.force");
        let (x, v) = (get(sim, "target.position").normalize(), velocity(sim, "target"));
        let y = x.cross(&v).normalize().cross(&x);
        [x.dot(&load), y.dot(&load)]
    };
    let (mut last, mut pulses) = ((0.0, [0.0; 2]), Vec::new());
    let (mut blown, mut most, mut before) = (0.0, 0.0_f64, None);
    while sim.phase() == "approach" {
        blown = sim.get("PlumeImpulse.y").unwrap();
        let now = (sim.time(), along(&sim));
        let pulse = [0, 1].map(|k| 0.5 * (now.1[k] + last.1[k]) * (now.0 - last.0) / 2000.0);
        pulses.push((now.0, pulse));
        last = now;
        most = most.max(sim.get("PlumeForce.y").unwrap());
        let of_target = (get(&sim, "target.position"), velocity(&sim, "target"));
        before = Some((sim.time(), beside(&sim, "target", "chaser"), of_target));
        sim.step_event().unwrap();
    }
    let (row, (r, v), (place_of_target, target)) = before.unwrap();
    let fallen = propagate(MU, &free, row).unwrap();
    // By the Clohessy–Wiltshire equations a body that is pushed along the motion drifts up and
    // falls back.
    let n = (MU / free.position.norm().powi(3)).sqrt();
    let up = fallen.position.normalize();
    let normal = fallen.position.cross(&fallen.velocity).normalize();
    let off = place_of_target - fallen.position;
    let turning = target - fallen.velocity - normal.cross(&off) * n;
    let pushed = turning.dot(&normal.cross(&up));
    let drift = |(t, [x, y]): &(f64, [f64; 2])| {
        let (sine, cosine) = (n * (row - t)).sin_cos();
        y * (4.0 * cosine - 3.0) - 2.0 * sine * x
    };
    let by_pulses: f64 = pulses.iter().map(drift).sum();
    println!(
        "{row} s: at {r:?}, {v:?}; plumes {blown} N s, {most} N: target pushed by {pushed} m/s"
    );
    println!("{by_pulses} m/s by the pulses");
    assert!((pushed / by_pulses - 1.0).abs() < 1e-3, "{pushed} {by_pulses}");
    assert!(most > 0.1 && most < 10.0, "two jets of 5 N at most: {most}");
    assert_eq!(sim.phase(), "soft_capture");
    // The springs' length equals the distance of the ports when the latches catch, so their initial energy is absorbed, too.
    let port = |sim: &Simulation, body: &str, y: f64| {
        get(sim, &format!("{body}.position")) + rotation(sim, body) * Vec3::new(0.0, y, 0.0)
    };
    let apart = |sim: &Simulation| {
        rotation(sim, "target").inverse() * (port(sim, "chaser", 1.0) - port(sim, "target", -1.5))
    };
    assert!((apart(&sim).norm() - 0.02).abs() < 1e-9, "{}", apart(&sim));
    // The energy includes the springs, the motion about the common centre, and the
    // rotation.
    let energy = |sim: &Simulation| {
        let turn = rotation(sim, "target").angle_to(&rotation(sim, "chaser"));
        let place = apart(sim);
        let springs = Vec3::new(200.0, 400.0, 200.0).component_mul(&place).dot(&place);
        let bodies = [
            ("target", 2000.0, Vec3::new(1800.0, 1500.0, 2200.0)),
            ("chaser", 500.0, Vec3::new(180.0, 150.0, 190.0)),
        ];
        let turning = bodies.map(|(body, _, inertia)| {
            let w = get(sim, &format!("{body}.angular"));
            inertia.component_mul(&w).dot(&w)
        });
        // The reduced mass is 400 kg.
        let met = velocity(sim, "chaser") - velocity(sim, "target");
        0.5 * (springs + 400.0 * met.norm_squared() + turning.iter().sum::<f64>())
            + 30.0 * turn * turn
    };
    let (_, met) = beside(&sim, "target", "chaser");
    let brought = energy(&sim);
    let (mut force, mut taken, mut left) = (0.0_f64, 0.0, brought);
    while sim.phase() == "soft_capture" {
        (taken, left) = (sim.get("Capture.taken").unwrap(), energy(&sim));
        force = force.max(sim.get("Capture.force").unwrap());
        sim.step_event().unwrap();
    }
    let (t, given) = (sim.time(), brought - left);
    println!("{force} N, {taken} J of {given} J, locked at {t} s, {}", sim.phase());
    assert!((taken / given - 1.0).abs() < 5e-3, "{taken} {given}");
    // The bound is the force of springs of 200 and 400 N/m over 2 cm, and of the dampers at the
    // remaining speed.
    assert!(force > 2.0 && force < 8.0 + 560.0 * met.norm(), "{force}");
    let moves = sim.take_moves();
    let books = moves.iter().flat_map(|m| &m.2.notes).find(|n| n.contains("energy")).unwrap();
    println!("{books}");
    sim.run_until(seconds(500.0)).unwrap();
    assert_eq!(sim.phase(), "docked");
    let held = get(&sim, "chaser.position");
    assert!((held - Vec3::new(0.0, -2.5, 0.0)).norm() < 0.02, "{held}");
}
