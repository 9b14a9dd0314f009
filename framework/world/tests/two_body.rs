//! Two bodies: external trajectories, elements, conservation; Clohessy–Wiltshire.

use crate::support::*;
use linkwork_world::orbit::*;
use linkwork_world::planet::{OrbitalAxes, PointMotion, orbital_frame};
use linkwork_world::spatial::Vec3;
use std::f64::consts::{PI, TAU};

const MU: f64 = 3.986004418e14;

fn state(r: &[f64], v: &[f64]) -> PointMotion {
    PointMotion { position: Vec3::from_column_slice(r), velocity: Vec3::from_column_slice(v) }
}

/// JEOD's run 2: 8 h of two bodies.
#[test]
fn jeod_run_2() {
    let Some(text) = reference("orbit/jeod_run2.json") else { return };
    let all: serde_json::Value = serde_json::from_str(&text).unwrap();
    let orbit = &all["run"]["scenario"]["orbit"];
    let start = PointMotion { position: vec3(&orbit["pos_m"]), velocity: vec3(&orbit["vel_mps"]) };
    let end = &all["run"]["final_state"];
    let out = propagate(number(&all["mu_m3s2"]), &start, number(&end["t"])).unwrap();
    near3(&out.position, &vec3(&end["pos_m"]), 2e-5, "position after 8 h");
    near3(&out.velocity, &vec3(&end["vel_mps"]), 2e-8, "velocity after 8 h");
}

/// Open Space Toolkit 001-a: within 0.05 m of Orekit for a day.
#[test]
fn orekit_for_a_day() {
    let Some(text) = reference("orbit/ostk-001-a-orekit.csv") else { return };
    let rows: Vec<Vec<f64>> = text
        .lines()
        .skip(1)
        .map(|l| l.split(',').map(|x| x.trim_start_matches('+').parse().unwrap()).collect())
        .collect();
    assert!(rows.len() > 700);
    let start = state(&rows[0][1..4], &rows[0][4..7]);
    let mut worst: f64 = 0.0;
    for row in &rows {
        // The scenario was computed with the μ of EGM96.
        let out = propagate(3.986004415e14, &start, row[0]).unwrap();
        let error = (out.position - Vec3::from_column_slice(&row[1..4])).norm();
        assert!(error.is_finite());
        worst = worst.max(error);
    }
    println!("{worst} m from Orekit in a day");
    assert!(worst < 0.05, "{worst} m");
}

/// All conics: energy, angular momentum and Runge's vector are conserved, propagation is reversible, and two steps equal one.
#[test]
fn every_conic_keeps_what_two_bodies_keep() {
    let mut random = Random(11);
    for k in 0..400 {
        let distance = random.between(7e6, 2.1e7);
        let r = random.on_sphere(distance);
        let escape = (2.0 * MU / r.norm()).sqrt();
        let speed = match k % 4 {
            0 => random.between(0.3, 0.99) * escape,
            1 => escape * (0.5f64).sqrt(),
            2 => escape,
            _ => random.between(1.01, 3.0) * escape,
        };
        let start = PointMotion { position: r, velocity: random.on_sphere(speed) };
        let dt = random.between(-2e5, 2e5);
        let out = propagate(MU, &start, dt).unwrap();
        let keeps = |s: &PointMotion| {
            let (r, v) = (s.position, s.velocity);
            let h = r.cross(&v);
            (v.norm_squared() / 2.0 - MU / r.norm(), h, v.cross(&h) / MU - r / r.norm())
        };
        let ((E0, h0, e0), (E1, h1, e1)) = (keeps(&start), keeps(&out));
        // At the far end of a narrow ellipse or a fast hyperbola, round-off is amplified. Measured:
        // 1e-10.
        near(E1, E0, 1e-9 * MU / r.norm(), &format!("energy, {k}"));
        near3(&h1, &h0, 1e-9 * h0.norm(), &format!("angular momentum, {k}"));
        near3(&e1, &e0, 1e-9, &format!("Runge's vector, {k}"));
        let back = propagate(MU, &out, -dt).unwrap();
        let size = r.norm() + out.position.norm();
        near3(&back.position, &r, 1e-8 * size, &format!("way back, {k}"));
        let half = propagate(MU, &propagate(MU, &start, dt * 0.3).unwrap(), dt * 0.7).unwrap();
        near3(&half.position, &out.position, 1e-8 * size, &format!("two steps, {k}"));
    }
}

/// Short times: the acceleration, by differences, is −μ r/r³. Long times: whole revolutions change nothing.
#[test]
fn it_is_newtons_equation() {
    for speed in [5e3, 7.8e3, 1.1e4, 1.5e4] {
        let start = state(&[7e6, -2e6, 1e6], &[0.1 * speed, 0.9 * speed, 0.3 * speed]);
        let at = |t: f64| propagate(MU, &start, t).unwrap();
        let (t, h) = (777.0, 2.0);
        let s = at(t);
        let v = (at(t + h).position - at(t - h).position) / (2.0 * h);
        near3(&v, &s.velocity, 2e-5 * speed, "velocity");
        let a = (at(t + h).velocity - at(t - h).velocity) / (2.0 * h);
        let r = s.position;
        near3(&a, &(r * (-MU / r.norm().powi(3))), 1e-4, "acceleration");
    }
    let start = state(&[7e6, -2e6, 1e6], &[500.0, 6000.0, 4000.0]);
    let period = Elements::of(MU, &start).unwrap().period(MU);
    let out = propagate(MU, &start, 10_000.0 * period).unwrap();
    near3(&out.position, &start.position, 1e-3, "ten thousand turns");
}

#[test]
fn elements_and_back() {
    let mut random = Random(12);
    for k in 0..500 {
        let e = [0.0, 0.3, 0.9, 1.0, 2.5][k % 5];
        let limit = if e >= 1.0 { (-1.0f64 / e).acos() - 0.1 } else { PI };
        let anomaly = random.between(-limit, limit);
        let elements = Elements {
            semi_latus_rectum: random.between(7e6, 4e7),
            eccentricity: e,
            inclination: [0.0, PI, 0.7, PI / 2.0][(k / 5) % 4],
            ascending_node: random.between(0.0, TAU),
            pericentre: random.between(0.0, TAU),
            anomaly,
        };
        let s = elements.state(MU);
        let found = Elements::of(MU, &s).unwrap();
        let back = found.state(MU);
        near3(&back.position, &s.position, 1e-13 * s.position.norm() * 10.0, "position");
        near3(&back.velocity, &s.velocity, 1e-12 * s.velocity.norm(), "velocity");
        relative(found.semi_latus_rectum, elements.semi_latus_rectum, 1e-13, "p");
        near(found.eccentricity, e, 1e-14 * 100.0, "e");
        near(found.inclination, elements.inclination, 1e-7, "i");
        if e > 0.0 && (k / 5) % 4 >= 2 {
            let same = |a: f64, b: f64| ((a - b).rem_euclid(TAU) + PI).rem_euclid(TAU) - PI;
            near(same(found.ascending_node, elements.ascending_node), 0.0, 1e-12, "Ω");
            near(same(found.pericentre, elements.pericentre), 0.0, 1e-12, "ω");
            near(same(found.anomaly, anomaly), 0.0, 1e-12, "ν");
        }
    }
    // Example 2-5 of Vallado: r (6524.834, 6862.875, 6448.296) km, v (4.901327, 5.533756, −1.976341)
    // km/s:
    // p 11067.790 km, e 0.832853, i 87.870°, Ω 227.898°, ω 53.38°, ν 92.335°.
    let s = state(&[6524834.0, 6862875.0, 6448296.0], &[4901.327, 5533.756, -1976.341]);
    let e = Elements::of(3.986004418e14, &s).unwrap();
    near(e.semi_latus_rectum, 11_067_790.0, 20.0, "p");
    near(e.eccentricity, 0.832853, 1e-6, "e");
    near(e.inclination.to_degrees(), 87.870, 1e-3, "i");
    near(e.ascending_node.to_degrees(), 227.898, 1e-3, "Ω");
    near(e.pericentre.to_degrees(), 53.38, 1e-2, "ω");
    near(e.anomaly.to_degrees(), 92.335, 1e-3, "ν");
    let again =
        Elements::with_axis(e.semi_major_axis(), e.eccentricity, 0.1, 0.2, 0.3, 0.4).unwrap();
    relative(again.semi_latus_rectum, e.semi_latus_rectum, 1e-13, "a and p");
}

#[test]
fn wrong_orbits_are_refused() {
    let s = state(&[7e6, 0.0, 0.0], &[0.0, 7e3, 0.0]);
    let fault = |r: Result<PointMotion, linkwork_world::WorldError>| r.unwrap_err().to_string();
    assert!(fault(propagate(-1.0, &s, 1.0)).contains("mu"));
    assert!(fault(propagate(MU, &s, f64::NAN)).contains("time"));
    assert!(fault(propagate(MU, &state(&[0.0; 3], &[1.0, 0.0, 0.0]), 1.0)).contains("distance"));
    assert!(
        fault(propagate(MU, &state(&[7e6, 0.0, 0.0], &[f64::NAN, 0.0, 0.0]), 1.0))
            .contains("speed")
    );
    let line = state(&[7e6, 0.0, 0.0], &[1e3, 0.0, 0.0]);
    assert!(Elements::of(MU, &line).unwrap_err().to_string().contains("no orbital plane"));
    assert!(Elements::with_axis(7e6, 1.2, 0.0, 0.0, 0.0, 0.0).is_err());
    assert!(
        Elements::with_axis(-7e6, 0.2, 0.0, 0.0, 0.0, 0.0)
            .unwrap_err()
            .to_string()
            .contains("ellipse")
    );
    assert!(ClohessyWiltshire::new(MU, 0.0).unwrap_err().to_string().contains("radius"));
}

/// Reference data quick_golden.json, cw.
#[test]
fn clohessy_wiltshire_gives_the_golden_numbers() {
    let cw = ClohessyWiltshire::new(3.986004418e14, 7e6).unwrap();
    near(cw.rate(), 0.001078007612872506, 1e-18, "n");
    let start =
        Relative { position: Vec3::new(100.0, -300.0, 50.0), velocity: Vec3::new(0.1, -0.2, 0.05) };
    let out = cw.after(&start, 1800.0);
    near3(&out.position, &Vec3::new(89.774895, -769.311562, 25.186559), 6e-7, "position");
    near3(&out.velocity, &Vec3::new(-0.107551, -0.177955, -0.068323), 6e-7, "velocity");
    let Some(golden) = golden() else { return };
    for row in golden["cw"]["t_x_y_z_vx_vy_vz"].as_array().unwrap() {
        let row = numbers(row);
        let out = cw.after(&start, row[0]);
        near3(&out.position, &Vec3::from_column_slice(&row[1..4]), 1e-11, "position");
        near3(&out.velocity, &Vec3::from_column_slice(&row[4..7]), 1e-14, "velocity");
    }
    // Check the equations of motion: compare Ẋ of the closed form with finite differences.
    let (t, h) = (700.0, 0.5);
    let rate = (cw.after(&start, t + h).velocity - cw.after(&start, t - h).velocity) / (2.0 * h);
    near3(&rate, &cw.acceleration(&cw.after(&start, t)), 1e-10, "equations");
}

/// `formation_cw.json`: the linear and the true relative motion, and a rendezvous with two impulses.
#[test]
fn formation_against_two_bodies() {
    let Some(text) = reference("flight/formation_cw.json") else { return };
    let all: serde_json::Value = serde_json::from_str(&text).unwrap();
    let n = |key: &str| number(&all["inputs"][key]);
    let (mu, a, i) = (n("mu"), n("chief_radius"), n("inclination_rad"));
    let cw = ClohessyWiltshire::new(mu, a).unwrap();
    near(cw.rate(), n("n"), 1e-18, "n");
    let x0 = numbers(&all["inputs"]["x0"]);
    let start = state(&x0[..3], &x0[3..]);
    let relative0 = Relative { position: start.position, velocity: start.velocity };
    let chief0 = Elements::with_axis(a, 0.0, i, 0.0, 0.0, 0.0).unwrap().state(mu);
    let frame = |c: &PointMotion| {
        let pull = c.position * (-mu / c.position.norm().powi(3));
        orbital_frame(OrbitalAxes::Rtn, &c.position, &c.velocity, &pull).unwrap()
    };
    let deputy0 = frame(&chief0).to_outer(&start);
    let inertial = all["deputy_inertial"].as_array().unwrap();
    for (k, row) in all["rows"].as_array().unwrap().iter().enumerate() {
        let row = numbers(row);
        let t = row[0];
        let linear = cw.after(&relative0, t);
        near3(&linear.position, &Vec3::from_column_slice(&row[1..4]), 1e-9, "linear");
        near3(&linear.velocity, &Vec3::from_column_slice(&row[4..7]), 1e-12, "linear velocity");
        let (chief, deputy) =
            (propagate(mu, &chief0, t).unwrap(), propagate(mu, &deputy0, t).unwrap());
        let truth = frame(&chief).to_inner(&deputy);
        // The reference is accurate to 1.4e-5 m.
        near3(&truth.position, &Vec3::from_column_slice(&row[7..10]), 5e-5, "true");
        near3(&truth.velocity, &Vec3::from_column_slice(&row[10..13]), 5e-8, "true velocity");
        let place = numbers(&inertial[k]);
        near3(&deputy.position, &Vec3::from_column_slice(&place[1..4]), 5e-5, "inertial");
    }
    let meet = &all["rendezvous"];
    let time = number(&meet["transfer_time"]);
    let v = cw.velocity_to_reach(&start.position, &Vec3::zeros(), time).unwrap();
    near3(&(v - start.velocity), &vec3(&meet["dv1"]), 1e-12, "first impulse");
    let arrival = cw.after(&Relative { position: start.position, velocity: v }, time);
    near3(&arrival.position, &Vec3::zeros(), 1e-9, "it is there");
    near3(&-arrival.velocity, &vec3(&meet["dv2"]), 1e-12, "second impulse");
    assert!(cw.velocity_to_reach(&start.position, &Vec3::zeros(), 0.0).is_err());
    let half = PI / cw.rate();
    assert!(
        cw.velocity_to_reach(&start.position, &Vec3::zeros(), half)
            .unwrap_err()
            .to_string()
            .contains("half a period")
    );
}
