//! Shadow and pressure: golden numbers, edges, limits.
#![allow(non_snake_case, clippy::unwrap_used)]

mod support;

use linkwork_world::eclipse::*;
use linkwork_world::planet::AU;
use linkwork_world::spatial::Vec3;
use support::*;

const SUN: Vec3 = Vec3::new(149.6e9, 0.0, 0.0);
const R: f64 = 6378137.0;
const R_SUN: f64 = 6.957e8;

fn seen(x: f64, y: f64, z: f64) -> f64 {
    visible_fraction(&Vec3::new(x, y, z), &SUN, R, R_SUN)
}

/// EDL.md j; quick_golden.json, eclipse_conical.
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
        // The reference takes angles from arc cosines, which cost it some 1e-10.
        near(seen(r.x, r.y, r.z), number(&case["visible_fraction"]), 1e-9, &format!("{r:?}"));
    }
}

/// From light to umbra and back ν falls and rises without steps, from 1 to 0; the edges have the signs.
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

/// Beyond the tip of the umbra, 1.38e9 m, there is a ring around the planet.
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

/// The overlap of two discs by counting a fine grid of points.
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

/// EDL.md j; quick_golden.json, srp_plate.
#[test]
fn sunlight_presses_as_golden() {
    let n = Vec3::new(0.4f64.cos(), 0.4f64.sin(), 0.0);
    let f = plate(PRESSURE_AU, 4.0, &n, &Vec3::x(), 0.3, 0.2);
    near3(&f, &Vec3::new(-2.2374781585018852e-5, -4.48781253029662e-6, 0.0), 1e-19, "plate");
    assert_eq!(plate(1.0, 4.0, &-n, &Vec3::x(), 0.3, 0.2), Vec3::zeros());
    // A mirror turns all of the light, a black plate stops it.
    let mirror = plate(1.0, 2.0, &Vec3::x(), &Vec3::x(), 1.0, 0.0);
    near3(&mirror, &Vec3::new(-4.0, 0.0, 0.0), 1e-15, "mirror");
    let black = plate(1.0, 2.0, &n, &Vec3::x(), 0.0, 0.0);
    near3(&black, &(Vec3::x() * (-2.0 * 0.4f64.cos())), 1e-15, "black");
    let a = cannonball(&Vec3::new(0.0, AU / 2.0, 0.0), 0.02, 1.3, 0.5);
    near3(&a, &Vec3::new(0.0, -4.0 * 4.56e-6 * 0.02 * 1.3 * 0.5, 0.0), 1e-20, "ball");
    near(pressure(2.0 * AU), PRESSURE_AU / 4.0, 1e-20, "inverse square");
}
