//! NASA's check case 6 (NESC, TM-2015-218675): a sphere dropped from 30000 ft on a rotating ellipsoid, with drag. Compares the combination of
//! gravity, ellipsoid, rotation and US76 with two of NASA's simulators.

use crate::support::*;
use linkwork_world::atmosphere::{Us76, mach};
use linkwork_world::gravity::zonal;
use linkwork_world::planet::rotation::FixedRate;
use linkwork_world::planet::{Ellipsoid, PointMotion, Rotation};
use linkwork_world::spatial::Vec3;

const FOOT: f64 = 0.3048;
const SLUG: f64 = 14.593902937206364;
const MU: f64 = 3.986004418e14;
const J2: f64 = 1.08262982e-3;

/// Columns of a trajectory by name.
fn table(text: &str) -> (Vec<&str>, Vec<Vec<f64>>) {
    let mut lines = text.lines();
    let heads = lines.next().unwrap().split(',').map(str::trim).collect();
    let rows = lines.map(|l| l.split(',').map(|x| x.trim().parse().unwrap()).collect()).collect();
    (heads, rows)
}

#[test]
fn a_sphere_dropped_on_the_ellipsoid() {
    let folder = "nesc/Atmos_06_DroppedSphereEllipsoidalNoWind";
    let Some(text) = reference(&format!("{folder}/Atmos_06_sim_04.csv")) else { return };
    let (heads, rows) = table(&text);
    let column = |name: &str| heads.iter().position(|h| *h == name).unwrap();
    let vector = |row: &[f64], name: &str| {
        Vec3::from_fn(|k, _| row[column(&format!("{name}_{}", ["X", "Y", "Z"][k]))])
    };
    // The workbook uses this rate of rotation, which differs from the usual one.
    let turn = FixedRate::about_z(0.0, 0.004178073_f64.to_radians()).unwrap();
    let rotation = Rotation::Fixed(turn);
    let (earth, air) = (Ellipsoid::wgs84(), Us76::new());
    let area = 0.1963495 * FOOT * FOOT;
    let at = |t: f64, r: &Vec3, v: &Vec3| {
        let spin = rotation.at(t);
        let p = spin.R_IP.inverse() * r;
        let gravity = spin.R_IP * zonal(MU, 6378137.0, &[J2], &p);
        let place = earth.geodetic(&p).unwrap();
        let air = air.at(place.altitude);
        let relative = v - spin.omega_I.cross(r);
        let drag = relative * (-0.5 * air.density * relative.norm() * area * 0.1 / SLUG);
        (gravity, drag, air, place, relative)
    };
    let a = |t: f64, r: &Vec3, v: &Vec3| {
        let (gravity, drag, ..) = at(t, r, v);
        gravity + drag
    };
    let start = rows.first().unwrap();
    let mut s = PointMotion {
        position: vector(start, "eiPosition_ft") * FOOT,
        velocity: vector(start, "eiVelocity_ft_s") * FOOT,
    };
    let mut t = 0.0;
    for row in &rows {
        while t < row[0] - 1e-6 {
            let h = 0.1_f64.min(row[0] - t);
            (s.position, s.velocity) = rk4(a, t, (s.position, s.velocity), h);
            t += h;
        }
        let (gravity, _, air, place, relative_wind) = at(t, &s.position, &s.velocity);
        let what = |name: &str| format!("{name} at {t} s");
        // The tolerances are 0.02 ft, 0.002 ft/s and 1e-3 degrees.
        let (p, v) = (vector(row, "eiPosition_ft"), vector(row, "eiVelocity_ft_s"));
        near3(&(s.position / FOOT), &p, 0.02, &what("position"));
        near3(&(s.velocity / FOOT), &v, 0.002, &what("velocity"));
        near(place.altitude / FOOT, row[column("altitudeMsl_ft")], 0.02, &what("altitude"));
        near(place.latitude.to_degrees(), row[column("latitude_deg")], 1e-6, &what("latitude"));
        near(place.longitude.to_degrees(), row[column("longitude_deg")], 1e-6, &what("longitude"));
        let g = gravity.norm() / FOOT;
        relative(g, row[column("localGravity_ft_s2")], 1e-6, &what("gravity"));
        // Simulator 04 uses a table of the atmosphere, with errors of some 1e-5 in temperature, pressure and
        // speed of sound.
        let t_rankine = air.temperature * 1.8;
        relative(t_rankine, row[column("ambientTemperature_dgR")], 2e-5, &what("T"));
        relative(air.sound_speed / FOOT, row[column("speedOfSound_ft_s")], 2e-5, &what("a"));
        relative(
            air.density / (SLUG / FOOT.powi(3)),
            row[column("airDensity_slug_ft3")],
            5e-5,
            &what("ρ"),
        );
        near(mach(relative_wind.norm(), &air), row[column("mach")], 2e-5, &what("M"));
    }
    assert!(rows.len() > 10 && t > 29.9, "{} rows to {t} s", rows.len());
}
