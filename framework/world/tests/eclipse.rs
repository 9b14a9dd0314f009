//! Shadow and pressure: golden numbers, edges, limits.

use crate::support::*;
use linkwork_world::eclipse::*;
use linkwork_world::planet::AU;
use linkwork_world::spatial::{Quat, Vec3};
use std::f64::consts::PI;

const SUN: Vec3 = Vec3::new(149.6e9, 0.0, 0.0);
const R: f64 = 6378137.0;
const R_SUN: f64 = 6.957e8;

fn seen(x: f64, y: f64, z: f64) -> f64 {
    visible_fraction(&Vec3::new(x, y, z), &SUN, R, R_SUN)
}

/// Reference data quick_golden.json, eclipse_conical.
#[test]
fn shadow_gives_the_golden_numbers() {
    near(seen(-7e6, 6.37e6, 0.0), 0.33741836, 5e-9, "(−7e6, 6.37e6, 0)");
    near(seen(-7e6, 6.4e6, 0.0), 0.88826676, 5e-9, "(−7e6, 6.4e6, 0)");
    near(seen(-4.2e7, 6.3e6, 0.0), 0.24942541, 5e-9, "(−4.2e7, 6.3e6, 0)");
    let Some(golden) = golden() else { return };
    let cases = golden["eclipse_conical"]["cases"].as_array().unwrap();
    assert_eq!(cases.len(), 6);
    for case in cases {
        let r = vec3(&case["r_m"]);
        // The reference computes angles with arc cosines, with an error of some 1e-10.
        near(seen(r.x, r.y, r.z), number(&case["visible_fraction"]), 1e-9, &format!("{r:?}"));
    }
}

/// From sunlight to umbra and back ν decreases and increases continuously between 1 and 0; the edge functions have the right signs.
#[test]
fn the_penumbra_is_smooth_and_its_edges_are_told() {
    let mut last = 1.0;
    let mut crossed = [false; 2];
    for k in 0..=4000 {
        let r = Vec3::new(-7e6, 6.45e6 - 50.0 * f64::from(k), 0.0);
        let d = Discs::seen(&r, &SUN, R, R_SUN);
        let v = d.visible_fraction();
        assert!(v <= last && last - v < 2e-3, "{v} after {last}");
        assert_eq!(v == 1.0, d.penumbra_edge() >= 0.0);
        assert_eq!(v == 0.0, d.umbra_edge() <= 0.0);
        crossed[0] |= v < 1.0;
        crossed[1] |= v == 0.0;
        last = v;
    }
    assert_eq!(crossed, [true, true]);
}

/// Beyond the tip of the umbra, 1.38e9 m, the eclipse is annular.
#[test]
fn far_behind_there_is_a_ring() {
    let r = Vec3::new(-3e9, 0.0, 0.0);
    let d = Discs::seen(&r, &SUN, R, R_SUN);
    let expected = 1.0 - (d.body / d.sun).powi(2);
    near(d.visible_fraction(), expected, 1e-15, "ring");
    assert!(expected > 0.5 && expected < 1.0);
    assert!(seen(-1.3e9, 0.0, 0.0) == 0.0 && seen(-1.5e9, 0.0, 0.0) > 0.0);
    assert_eq!(seen(7e6, 0.0, 0.0), 1.0);
    assert_eq!(seen(-1e3, 0.0, 0.0), 0.0, "inside the planet, night side");
}

/// Computes the overlap of two discs by counting points of a fine grid.
#[test]
fn the_overlap_is_an_area() {
    for (a, b, c) in [(0.00465, 0.004, 0.006), (0.00465, 0.5, 0.502), (1.0, 1.5, 1.2)] {
        let d = Discs { sun: a, body: b, separation: c };
        let n = 1500;
        let (mut all, mut free) = (0, 0);
        for i in 0..n {
            for j in 0..n {
                let x = a * (2.0 * (f64::from(i) + 0.5) / f64::from(n) - 1.0);
                let y = a * (2.0 * (f64::from(j) + 0.5) / f64::from(n) - 1.0);
                if x * x + y * y < a * a {
                    all += 1;
                    free += i32::from((x - c) * (x - c) + y * y > b * b);
                }
            }
        }
        near(d.visible_fraction(), f64::from(free) / f64::from(all), 1e-3, "area");
    }
}

/// Reference data quick_golden.json, srp_plate.
#[test]
fn sunlight_presses_as_golden() {
    let n = Vec3::new(0.4f64.cos(), 0.4f64.sin(), 0.0);
    let f = plate(PRESSURE_AU, 4.0, &n, &Vec3::x(), 0.3, 0.2);
    near3(&f, &Vec3::new(-2.2374781585018852e-5, -4.48781253029662e-6, 0.0), 1e-19, "plate");
    assert_eq!(plate(1.0, 4.0, &-n, &Vec3::x(), 0.3, 0.2), Vec3::zeros());
    // A mirror reflects all light, and a black plate absorbs it.
    let mirror = plate(1.0, 2.0, &Vec3::x(), &Vec3::x(), 1.0, 0.0);
    near3(&mirror, &Vec3::new(-4.0, 0.0, 0.0), 1e-15, "mirror");
    let black = plate(1.0, 2.0, &n, &Vec3::x(), 0.0, 0.0);
    near3(&black, &(Vec3::x() * (-2.0 * 0.4f64.cos())), 1e-15, "black");
    let a = cannonball(&Vec3::new(0.0, AU / 2.0, 0.0), 0.02, 1.3, 0.5);
    near3(&a, &Vec3::new(0.0, -4.0 * 4.56e-6 * 0.02 * 1.3 * 0.5, 0.0), 1e-20, "ball");
    near(pressure(2.0 * AU), PRESSURE_AU / 4.0, 1e-20, "inverse square");
}

/// A Lambertian sphere from far away, in closed form: e = (2/3) a (R/r)² (sin α + (π − α) cos α)/π at the phase angle α.
#[test]
fn from_afar_a_planet_shines_by_its_phase() {
    let r = Vec3::new(1.2e12, -0.5e12, 0.7e12);
    let axis = r.cross(&Vec3::z()).normalize();
    for alpha in [0.0, 0.4, 1.1, PI / 2.0, 2.3, PI] {
        let sun = Quat::from_scaled_axis(axis * alpha) * r.normalize();
        let e = planet_light(&r, &sun, R, 0.3, 0.0);
        let phase = (f64::sin(alpha) + (PI - alpha) * f64::cos(alpha)) / PI;
        let wanted = 0.2 * (R / r.norm()).powi(2);
        near(e.norm(), wanted * phase, 2e-3 * wanted, &format!("{alpha}"));
        if alpha < 2.0 {
            near(e.normalize().dot(&r.normalize()), 1.0, 1e-4, "away from the planet");
        }
    }
}

/// Heat is uniform over the disc: its vector is emissivity/4 (R/r)² at any height. At low altitude at noon the ground is a bright plane that fills
/// half of the sky: e → albedo.
#[test]
fn heat_and_noon_have_closed_forms() {
    for h in [1e3, 4e5, 2e7] {
        let r = Vec3::new(0.3, -0.8, 0.52).normalize() * (R + h);
        let e = planet_light(&r, &Vec3::y(), R, 0.0, 0.7);
        near(e.norm(), 0.175 * (R / (R + h)).powi(2), 1e-9, "heat");
        near(e.normalize().dot(&r.normalize()), 1.0, 1e-12, "upwards");
    }
    let noon = planet_light(&(Vec3::x() * (R + 10.0)), &Vec3::x(), R, 0.4, 0.0);
    near(noon.x, 0.4, 2e-3, "noon");
    near(noon.y.hypot(noon.z), 0.0, 1e-12, "noon, sideways");
    // At midnight near the ground the light is zero, and inside the planet, too.
    near(
        planet_light(&(Vec3::x() * -(R + 1e5)), &Vec3::x(), R, 0.4, 0.0).norm(),
        0.0,
        0.0,
        "night",
    );
    near(planet_light(&(Vec3::x() * 1e6), &Vec3::x(), R, 0.4, 1.0).norm(), 0.0, 0.0, "inside");
}

/// Compares the sum over rings with a fine sum over the ground, at a height where neither closed form is valid.
#[test]
fn light_is_that_of_the_ground_piece_by_piece() {
    let (r, sun) = (Vec3::new(5.1e6, -4.2e6, 3.3e6), Vec3::new(0.9, 0.1, -0.5).normalize());
    let mut sum = Vec3::zeros();
    let n = 600;
    for i in 0..n {
        let z = -1.0 + (2.0 * f64::from(i) + 1.0) / f64::from(n);
        for k in 0..n {
            let (s, c) = (std::f64::consts::TAU * (f64::from(k) + 0.5) / f64::from(n)).sin_cos();
            let rho = (1.0 - z * z).sqrt();
            let normal = Vec3::new(rho * c, rho * s, z);
            let way = r - normal * R;
            let (d, cos) = (way.norm(), normal.dot(&way) / way.norm());
            if cos > 0.0 {
                let area = 4.0 * PI * R * R / f64::from(n * n);
                let light = 0.3 * normal.dot(&sun).max(0.0) + 0.25 * 0.6;
                sum += way * (light * cos * area / (PI * d * d * d));
            }
        }
    }
    near3(&planet_light(&r, &sun, R, 0.3, 0.6), &sum, 1e-3 * sum.norm(), "light");
}
