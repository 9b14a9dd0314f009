//! A low orbit with all forces combined, compared with `flight/orbit_full_force.json`.

use crate::support::*;
use linkwork_world::atmosphere::Exponential;
use linkwork_world::eclipse::{cannonball, visible_fraction};
use linkwork_world::ephemeris::{moon, sun};
use linkwork_world::gravity::{Format, Harmonics, Keep, read, third_body};
use linkwork_world::orbit::TwoLine;
use linkwork_world::planet::rotation::{Earth, EarthParameters, FixedRate};
use linkwork_world::planet::{Epoch, Rotation};
use linkwork_world::spatial::{Mat3, Vec3};
use serde_json::Value;

struct Case {
    field: Harmonics,
    rotation: Rotation,
    air: Exponential,
    sc: Value,
    inputs: Value,
    /// Sun and Moon relative to the Earth.
    bodies: Box<dyn Fn(f64) -> (Vec3, Vec3)>,
}

/// Gravity, Sun, Moon, radiation pressure, drag.
fn forces(c: &Case, t: f64, r: &Vec3, v: &Vec3) -> ([Vec3; 5], f64) {
    let n = |key: &str| number(&c.inputs[key]);
    let sc = |key: &str| number(&c.sc[key]);
    let spin = c.rotation.at(t);
    let gravity = spin.R_IP * c.field.acceleration(&(spin.R_IP.inverse() * r));
    let (sun, moon) = (c.bodies)(t);
    let light = visible_fraction(r, &sun, n("R_earth_shadow"), n("R_sun"));
    let srp = cannonball(&(sun - r), sc("A_srp") / sc("mass"), sc("Cr"), light);
    // The air rotates about the pole. The reference neglects precession.
    let pole = spin.R_IP * Vec3::z();
    let wind = (pole * n("omega")).cross(r);
    let u = v - wind;
    let rho = c.air.density(r.norm() - n("R_drag"));
    let drag = u * (-0.5 * rho * u.norm() * sc("Cd") * sc("A_drag") / sc("mass"));
    let parts =
        [gravity, third_body(n("mu_sun"), r, &sun), third_body(n("mu_moon"), r, &moon), srp, drag];
    (parts, light)
}

fn load() -> Option<(Value, Value, Harmonics)> {
    let all: Value = serde_json::from_str(&reference("flight/orbit_full_force.json")?).unwrap();
    let text = reference("gravity/basilisk_GGM03S.txt")?;
    let field = read(Format::Basilisk, "GGM03S", &text, Keep::Degree(20)).unwrap();
    Some((all["inputs"].clone(), all, Harmonics::new(&field)))
}

fn case(
    inputs: &Value,
    field: &Harmonics,
    rotation: Rotation,
    bodies: Box<dyn Fn(f64) -> (Vec3, Vec3)>,
) -> Case {
    let a = &inputs["atmosphere"];
    let air = Exponential::new(number(&a["rho0"]), number(&a["h0"]), number(&a["H"])).unwrap();
    Case {
        field: field.clone(),
        rotation,
        air,
        sc: inputs["sc"].clone(),
        inputs: inputs.clone(),
        bodies,
    }
}

fn check(c: &Case, variant: &Value, tolerances: [f64; 5]) {
    let rows: Vec<Vec<f64>> =
        variant["t_rx_ry_rz_vx_vy_vz"].as_array().unwrap().iter().map(numbers).collect();
    let start = &rows[0];
    let (r, v) = (Vec3::from_column_slice(&start[1..4]), Vec3::from_column_slice(&start[4..7]));
    let R: Mat3 = *c.rotation.at(0.0).R_IP.inverse().to_rotation_matrix().matrix();
    near33(&R, &mat3(&variant["R_eci_to_ecef_at_t0"]), 2e-14, "rotation");
    let (parts, light) = forces(c, 0.0, &r, &v);
    near(light, number(&variant["accelerations_at_t0"]["sunlit_fraction"]), 0.0, "light");
    for (k, name) in ["gravity", "sun", "moon", "srp", "drag"].into_iter().enumerate() {
        let golden = vec3(&variant["accelerations_at_t0"][name]);
        near3(&parts[k], &golden, tolerances[k] * golden.norm(), name);
    }
    // Integrate six hours with Runge–Kutta 4 and steps of 5 s, and compare the sunlight at the
    // outputs.
    let lit = numbers(&variant["sunlit_fraction_at_outputs"]);
    let f = |t: f64, r: &Vec3, v: &Vec3| forces(c, t, r, v).0.iter().sum::<Vec3>();
    let (mut r, mut v, h) = (r, v, 5.0);
    let mut worst: f64 = 0.0;
    for (k, row) in rows.iter().enumerate() {
        if k > 0 {
            let from = rows[k - 1][0];
            for i in 0..((row[0] - from) / h).round() as usize {
                let t = from + i as f64 * h;
                (r, v) = rk4(f, t, (r, v), h);
            }
        }
        near(forces(c, row[0], &r, &v).1, lit[k], 1e-6, "light");
        let error = (r - Vec3::from_column_slice(&row[1..4])).norm();
        assert!(error.is_finite());
        worst = worst.max(error);
    }
    assert_eq!(rows.last().unwrap()[0], 21600.0);
    println!("{} m after six hours at worst", worst);
    assert!(worst < 0.05, "{worst} m");
}

/// Variant A: all in closed form. Accelerations agree to the reference's round-off.
#[test]
fn with_a_simple_earth_sun_and_moon() {
    let Some((inputs, all, field)) = load() else { return };
    let variant = &all["variant_A"];
    let (sp, mp) = (variant["sun_params"].clone(), variant["moon_params"].clone());
    let bodies = move |t: f64| {
        let n = |v: &Value, key: &str| number(&v[key]);
        let l = n(&sp, "l0").to_radians() + n(&sp, "n") * t;
        let e = n(&sp, "e").to_radians();
        let sun = Vec3::new(l.cos(), l.sin() * e.cos(), l.sin() * e.sin()) * n(&sp, "dist");
        let u = n(&mp, "u0").to_radians() + n(&mp, "n") * t;
        let (i, o) = (n(&mp, "inc").to_radians(), n(&mp, "raan").to_radians());
        let p = Vec3::new(u.cos(), u.sin() * i.cos(), u.sin() * i.sin());
        let moon = Vec3::new(o.cos() * p.x - o.sin() * p.y, o.sin() * p.x + o.cos() * p.y, p.z);
        (sun, moon * n(&mp, "dist"))
    };
    near3(&bodies(0.0).0, &vec3(&variant["sun_at_t0"]), 1e-4, "Sun");
    near3(&bodies(0.0).1, &vec3(&variant["moon_at_t0"]), 1e-6, "Moon");
    let turn = FixedRate::about_z(number(&inputs["theta0"]), number(&inputs["omega"])).unwrap();
    let c = case(&inputs, &field, Rotation::Fixed(turn), Box::new(bodies));
    check(&c, variant, [1e-14; 5]);
}

/// Requirement: over 17480 s at 7000 km, 20 × 20, steps of 10 s have the same accuracy about a rotating planet as about a fixed one, because the
/// rotation is evaluated at every stage: 0.05 m.
#[test]
fn a_turning_planet_costs_no_accuracy() {
    let Some((_, _, field)) = load() else { return };
    let end = |rotation: &Rotation, h: f64| {
        let f = |t: f64, r: &Vec3, _: &Vec3| {
            let R = rotation.at(t).R_IP;
            R * field.acceleration(&(R.inverse() * r))
        };
        let (mut r, mut v) = (Vec3::new(7e6, 0.0, 0.0), Vec3::new(0.0, 4500.0, 6051.0));
        for k in 0..(17480.0 / h) as usize {
            let t = k as f64 * h;
            (r, v) = rk4(f, t, (r, v), h);
        }
        r
    };
    let turning = Rotation::Fixed(FixedRate::about_z(0.3, 7.292115e-5).unwrap());
    let places: Vec<Vec3> = [Rotation::none(), turning]
        .iter()
        .map(|rotation| {
            let (coarse, fine) = (end(rotation, 10.0), end(rotation, 2.0));
            let error = (coarse - fine).norm();
            println!("{error} m with steps of 10 s");
            assert!(error < 0.05, "{error} m");
            fine
        })
        .collect();
    assert!((places[0] - places[1]).norm() > 100.0, "rotation matters");
}

/// Variant B: IAU 2006/2000A, Sun and Moon from SOFA.
#[test]
fn with_the_real_earth_sun_and_moon() {
    let Some((inputs, all, field)) = load() else { return };
    let variant = &all["variant_B"];
    let epoch = Epoch::parse("2012-08-06 00:00:00 UTC").unwrap();
    let p = EarthParameters { dut1: number(&variant["dut1"]), ..EarthParameters::default() };
    let earth = Earth::new(&epoch, p, 21600.0).unwrap();
    // The reference evaluates the series with TT instead of TDB. In the difference of 1.6 ms, the Sun moves 50 m
    // and the Moon 2 m.
    let tdb = epoch.tdb_days();
    near3(&sun(tdb).unwrap().position, &vec3(&variant["sun_at_t0"]), 60.0, "Sun of TDB");
    near3(&moon(tdb).position, &vec3(&variant["moon_at_t0"]), 2.0, "Moon of TDB");
    let bodies = move |t: f64| {
        let (day, fraction) = epoch.plus(t).tt();
        let now = (day - 2_451_545.0, fraction);
        (sun(now).unwrap().position, moon(now).position)
    };
    near3(&bodies(0.0).0, &vec3(&variant["sun_at_t0"]), 1e-4, "Sun of TT");
    near3(&bodies(0.0).1, &vec3(&variant["moon_at_t0"]), 1e-6, "Moon of TT");
    let c = case(&inputs, &field, Rotation::Earth(Box::new(earth)), Box::new(bodies));
    check(&c, variant, [1e-13, 1e-13, 1e-13, 1e-13, 1e-13]);
}

/// Test satellite 5 of Vallado, Crawford, Hujsak and Kelso, *Revisiting Spacetrack Report #3* (AIAA 2006-6753), 0 and 360 min after its epoch.
#[test]
fn two_line_elements_move_as_the_published_table_says() {
    let text = "1 00005U 58002B   00179.78495062  .00000023  00000-0  28098-4 0  4753\n2 00005  34.2682 348.7242 1859667 331.7664  19.3264 10.82419157413667\n";
    let all = TwoLine::read("vanguard.tle", text).unwrap();
    let [satellite] = all.as_slice() else { panic!("{}", all.len()) };
    assert_eq!((satellite.number, satellite.called().as_str()), (5, "satellite 5"));
    for (minutes, r, v) in [
        (
            0.0,
            [7_022.465_292_66, -1_400.082_967_55, 0.039_951_55],
            [1.893_841_015, 6.405_893_759, 4.534_807_250],
        ),
        (
            360.0,
            [-7_154.031_202_02, -3_783.176_825_04, -3_536.194_122_94],
            [4.741_887_409, -4.151_817_765, -2.093_935_425],
        ),
    ] {
        let state = satellite.state(&satellite.epoch.plus(minutes * 60.0)).unwrap();
        // The microseconds of the printed epoch correspond to 5 mm of the path.
        assert!((state.position / 1e3 - Vec3::from(r)).norm() < 1e-5, "{}", state.position);
        assert!((state.velocity / 1e3 - Vec3::from(v)).norm() < 1e-8, "{}", state.velocity);
    }
}
