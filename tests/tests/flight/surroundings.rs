//! The environment of a spacecraft, in simulations compared with closed forms.
use linkwork_spatial::Vec3;

use crate::common;
use common::{get, rotation, seconds};

/// A dumbbell in the plane of a circular orbit: with φ = 2 θ, θ from the vertical, φ″ = −k sin φ, k = 3 n² (Ix − Iz)/Iy,
/// exactly. The period is 4 K(sin φ₀/2)/√k, and K = π/(2 agm(1, cos φ₀/2)).
#[test]
fn a_long_craft_librates_about_the_vertical_with_the_period_of_the_closed_form() {
    let (mu, r, lean) = (3.986_004_418e14_f64, 7e6_f64, 0.3_f64);
    let n = (mu / r.powi(3)).sqrt();
    let k = 3.0 * n * n * 80.0 / 110.0;
    let (mut a, mut g) = (1.0_f64, lean.cos());
    for _ in 0..6 {
        (a, g) = (0.5 * (a + g), (a * g).sqrt());
    }
    let period = 4.0 * std::f64::consts::FRAC_PI_2 / (a * k.sqrt());
    // A run can stop only at samples: each quarter period has two hundred of them.
    let step = (0.25e9 * period / 200.0).round() * 1e-9;
    let text = format!(
        r#"Simulation(
        bodies: {{ "craft": (parent: "world", hinge: Free, mass: "100 kg", inertia: [100, 110, 20],
            initial: (position: [{r:?}, 0, 0], velocity: [0, 0, {:?}], rotation: (axis: [0, 1, 0], angle: {:?}), angular: [0, {n:?}, 0])) }},
        world: (body: "earth", mu: {mu:?}),
        parts: {{
            "Gravity": (model: "environment.point_mass_gravity"),
            "Gradient": (model: "flight.gravity_gradient", params: {{ "inertia": [100, 110, 20] }}, bind: {{ "body": "node:craft" }}),
        }},
        gravity: "Gravity", step: "{step:.9} s", integrator: "dormand_prince_54",
        accuracy: (relative: 1e-12, absolute: 1e-12), until: "10000 s")"#,
        -n * r,
        std::f64::consts::FRAC_PI_2 + lean,
    );
    let mut sim = common::scene(&text, &[]).unwrap();
    for (quarter, want) in [(1, 0.0), (2, -lean), (3, 0.0), (4, lean)] {
        sim.run_until(seconds((200.0 * f64::from(quarter) - 0.5) * step)).unwrap();
        assert!((sim.time() - 0.25 * period * f64::from(quarter)).abs() < 1e-6);
        let up = get(&sim, "craft.position").normalize();
        let axis = rotation(&sim, "craft") * Vec3::z();
        let angle = up.cross(&axis).y.atan2(up.dot(&axis));
        println!(
            "{quarter}/4 of {period:.3} s: {angle:.3e} rad, {:.1e} from the closed form",
            angle - want
        );
        assert!((angle - want).abs() < 1e-7, "{angle} {want}");
    }
}

/// IGRF-14 at (60° N, 30° W, 500 km) on 2025-01-01 (ppigrf: north 11941.127, east −2695.961, down 40152.011 nT), for a spacecraft in
/// inertial axes and from a site there; also compared with a dipole.
#[test]
fn a_craft_is_in_the_reference_field_alike_in_inertial_axes_and_from_a_site() {
    use linkwork_world::planet::{Ellipsoid, Geodetic};
    let want = Vec3::new(-2695.961, 11941.127, -40152.011) * 1e-9;
    let place = Geodetic::from_degrees(60.0, -30.0, 5e5);
    let (r, east_north_up) = (Ellipsoid::wgs84().position(&place), place.east_north_up());
    let scene = |position: Vec3, world: &str, field: &str| {
        let text = format!(
            r#"Simulation(
            bodies: {{ "craft": (parent: "world", hinge: Free, mass: "9 kg", inertia: [1, 1, 1],
                initial: (position: [{:?}, {:?}, {:?}], rotation: (rpy: [0.3, -0.2, 0.9]))) }},
            world: (body: "earth", turns: fixed, angle: 0, epoch: "2025-01-01 00:00:00 UTC", {world}),
            parts: {{
                "Gravity": (model: "environment.zonal_gravity", params: {{ "j2": 1.08262982e-3 }}),
                "Field": (model: "flight.magnetic_field", params: {{ {field} }}, bind: {{ "body": "node:craft" }}),
            }},
            gravity: "Gravity", step: "1 s", until: "10 s")"#,
            position.x, position.y, position.z,
        );
        let sim = common::scene(&text, &[]).unwrap();
        (get(&sim, "Field.field"), rotation(&sim, "craft") * get(&sim, "Field.in_body"))
    };
    let igrf = r#""degree": 13"#;
    let (field, turned) = scene(r, "", igrf);
    assert!((east_north_up.inverse() * field - want).norm() < 2e-11, "{field}");
    assert!((turned - field).norm() < 1e-18);
    let site = r#"site: (latitude: "60 deg", longitude: "-30 deg", height: 5e5)"#;
    let (from_site, _) = scene(Vec3::zeros(), site, igrf);
    assert!((from_site - want).norm() < 2e-11, "{from_site}");
    let (dipole, _) = scene(r, "", "");
    let off = (dipole - field).norm();
    println!("a dipole is off by {:.0} nT of {:.0}", off * 1e9, field.norm() * 1e9);
    assert!(off > 1e-6 && off < 1e-5);
}
