//! Orbits and falls against trajectories that others computed: JEOD, Orekit, NASA's check cases.
use linkwork_environment::gravity::{FieldFormat, HarmonicsParams, SphericalHarmonics, Third};
use linkwork_environment::planet::{Centre, PlanetParams, Turning};
use linkwork_runtime::prelude::{Gravity, Service};
use linkwork_runtime::{Files, Simulation};
use linkwork_spatial::{Quat, Vec3};
use linkwork_world::atmosphere::Us76;
use linkwork_world::gravity::zonal;
use linkwork_world::planet::{Ellipsoid, Geodetic, PointMotion, apparent_acceleration};
use serde_json::Value;

use crate::common;
use common::{Worst, reference_text, seconds};

const FOOT: f64 = 0.3048;
const SLUG: f64 = 14.593_902_937_206_364;
/// The rate of the simulators: 1528.10982905 ft/s over 20955646.325 ft.
const EARTH_RATE: f64 = 7.292_115e-5;

/// Motion of a free body: position, rotation, velocity and angular velocity in W.
struct Body {
    position: Vec3,
    R_WB: Quat,
    velocity: Vec3,
    /// Body axes, rad/s.
    angular: Vec3,
}

fn body(sim: &Simulation, path: &str) -> Body {
    let get = |name: &str| sim.get(&format!("{path}.{name}")).unwrap();
    let vec = |name: &str| Vec3::from(["x", "y", "z"].map(|c| get(&format!("{name}.{c}"))));
    let [x, y, z, w] = ["x", "y", "z", "w"].map(|c| get(&format!("rotation.{c}")));
    let R_WB = Quat::from_quaternion(linkwork_spatial::nalgebra::Quaternion::new(w, x, y, z));
    // The rates of a free hinge are in body axes.
    Body {
        position: vec("position"),
        R_WB,
        velocity: R_WB * vec("velocity"),
        angular: vec("angular"),
    }
}

fn vec3(v: &Value) -> Vec3 {
    Vec3::from_fn(|k, _| v[k].as_f64().unwrap())
}

const TWO_BODIES: [&str; 3] = ["gravity=Environment.PointMass", "drag_area=0", "third_bodies=[]"];

#[test]
fn jeod_run_2_with_attitude() {
    let Some(text) = reference_text("orbit/jeod_run2.json") else { return };
    let all: Value = serde_json::from_str(&text).unwrap();
    let (start, end) = (&all["run"]["scenario"]["orbit"], &all["run"]["final_state"]);
    let mut sim = common::repository("earth_orbit/sim.ron", &TWO_BODIES).unwrap();
    let b = body(&sim, "craft");
    // The file of the repository is this scenario.
    assert!((b.position - vec3(&start["pos_m"])).norm() < 1e-9);
    assert!((b.velocity - vec3(&start["vel_mps"])).norm() < 1e-11);
    assert!((b.angular - vec3(&all["initial_omega_run2"])).norm() < 1e-15);
    sim.run_until(seconds(28_800.0)).unwrap();
    let b = body(&sim, "craft");
    // JEOD's own steps; an independent DOP853 is 1.1e-5 m and 1.4e-11° from it; so is this.
    Worst((b.position - vec3(&end["pos_m"])).norm()).below(2e-5, "position after 8 h, m");
    Worst((b.velocity - vec3(&end["vel_mps"])).norm()).below(2e-8, "velocity after 8 h, m/s");
    let rate = (b.angular - vec3(&end["omega_body_rad_s"])).norm();
    Worst(rate).below(1e-12, "angular velocity after 8 h, rad/s");
    let rows = &end["T_inertial_to_body"];
    let mut turned = Worst(0.0);
    for k in 0..3 {
        // Rows of T are the body's axes in inertial ones.
        let axis = b.R_WB * Vec3::from_fn(|i, _| f64::from(u8::from(i == k)));
        turned.take((axis - vec3(&rows[k])).norm().to_degrees());
    }
    turned.below(1e-9, "attitude after 8 h, deg");
}

#[test]
fn orekit_for_a_day() {
    let Some(text) = reference_text("orbit/ostk-001-a-orekit.csv") else { return };
    let rows: Vec<Vec<f64>> = text
        .lines()
        .skip(1)
        .map(|l| l.split(',').map(|x| x.trim_start_matches('+').parse().unwrap()).collect())
        .collect();
    assert!(rows.len() > 700);
    let list = |x: &[f64]| format!("[{:e}, {:e}, {:e}]", x[0], x[1], x[2]);
    let (p, v) = (list(&rows[0][1..4]), list(&rows[0][4..7]));
    let (position, velocity) = (format!("position={p}"), format!("velocity={v}"));
    let set = [TWO_BODIES.as_slice(), &[&position, &velocity]].concat();
    let mut sim = common::repository("earth_orbit/sim.ron", &set).unwrap();
    let mut worst = Worst(0.0);
    for row in &rows {
        sim.run_until(seconds(row[0].round())).unwrap();
        worst.take((body(&sim, "craft").position - Vec3::from_column_slice(&row[1..4])).norm());
    }
    worst.below(0.05, "from Orekit over a day, m");
}

/// What each force of `sims/earth_orbit` does in 8 h, and that RK4 finds the same.
#[test]
fn each_force_moves_the_craft_as_far_as_it_should() {
    let end = |set: &[&str]| {
        let mut sim = common::repository("earth_orbit/sim.ron", set).unwrap();
        sim.run_until(seconds(28_800.0)).unwrap();
        let b = body(&sim, "craft");
        (b.position, sim.get("Drag.drag").unwrap(), sim.get("Drag.density").unwrap())
    };
    let (all, drag, density) = end(&[]);
    println!("after 8 h at {all:?} m, drag {drag} N, density {density:e} kg/m³");
    assert!((1e-13..1e-11).contains(&density) && drag > 0.0);
    for (what, set, range) in [
        ("Sun and Moon", ["third_bodies=[]"].as_slice(), 0.1..100.0),
        ("drag", &["drag_area=0"], 10.0..5000.0),
        ("degrees 9 to 20", &["degree=8"], 10.0..5000.0),
        ("J3 and beyond", &["gravity=Environment.Oblate"], 100.0..50_000.0),
        ("all but the point mass", &["gravity=Environment.PointMass"], 1e5..1e7),
        (
            "precession and nutation",
            &["planet=(turns: \"fixed\", angle: 1.021547605, epoch: \"2007-11-20 00:00:00 UTC\")"],
            100.0..50_000.0,
        ),
        (
            "0.1 s of UT1",
            &["planet=(turns: \"iau\", dut1: -0.1, epoch: \"2007-11-20 00:00:00 UTC\")"],
            1e-3..20.0,
        ),
    ] {
        let moved = (end(set).0 - all).norm();
        println!("{what}: {moved:.3} m");
        assert!(range.contains(&moved), "{what}: {moved} m, expected {range:?}");
    }
    let rk4 = ["integrator=rk4", "accuracy=fixed", "step=5 s"];
    Worst((end(&rk4).0 - all).norm()).below(0.02, "RK4 at 5 s, all forces, m");
}

/// Position (m) at 17480 s of a circular orbit of 7000 km in a field of 20 × 20.
fn after_three_turns(turns: &str, integrator: &[&str]) -> Vec3 {
    let turns = format!("planet=(turns: \"{turns}\", epoch: \"2007-11-20 00:00:00 UTC\")");
    let mut set = vec!["drag_area=0", "third_bodies=[]", "position=[7e6, 0, 0]", &turns];
    // Rates of a free body are in its own axes: one that turns would cost RK4 twice the error.
    set.extend(["velocity=[0, 5335.865450622126, 5335.865450622126]", "angular=[0, 0, 0]"]);
    set.extend(integrator);
    let mut sim = common::repository("earth_orbit/sim.ron", &set).unwrap();
    sim.run_until(seconds(17_480.0)).unwrap();
    body(&sim, "craft").position
}

/// The rotation is evaluated at every stage: a turning planet costs RK4 no accuracy.
#[test]
fn rk4_at_ten_seconds_around_a_turning_planet() {
    let rk4 = ["integrator=rk4", "accuracy=fixed", "step=10 s"];
    let mut errors = [0.0; 3];
    let mut ends = [Vec3::zeros(); 3];
    for (k, turns) in ["still", "fixed", "iau"].into_iter().enumerate() {
        let converged = after_three_turns(turns, &["step=10 s"]);
        errors[k] = (after_three_turns(turns, &rk4) - converged).norm();
        ends[k] = converged;
        Worst(errors[k]).below(0.05, &format!("RK4 at 10 s, planet {turns}, m"));
    }
    // The turning matters, by kilometres; it adds nothing to the error.
    assert!((ends[0] - ends[1]).norm() > 1e3 && (ends[1] - ends[2]).norm() > 1.0, "{ends:?}");
    assert!(
        errors[1] < 1.5 * errors[0] + 0.005 && errors[2] < 1.5 * errors[0] + 0.005,
        "{errors:?}"
    );
}

/// Each acceleration of `flight/orbit_full_force.json`, computed there in Python with ERFA: the field of
/// 20 × 20 on two Earths, the Sun's and the Moon's tides.
#[test]
fn accelerations_of_the_full_force_model() {
    let Some(text) = reference_text("flight/orbit_full_force.json") else { return };
    let all: Value = serde_json::from_str(&text).unwrap();
    let r = vec3(&all["inputs"]["r0"]);
    let files = Files::of(vec![linkwork_tests::root().join("sims/earth_orbit")]);
    let relative = |found: Vec3, variant: &str, name: &str| {
        let want = vec3(&all[variant]["accelerations_at_t0"][name]);
        (found - want).norm() / want.norm()
    };
    let params = |planet: PlanetParams, third_bodies: Vec<Third>| HarmonicsParams {
        file: "ggm03s_20.txt".into(),
        format: FieldFormat::Basilisk,
        degree: 20,
        order: None,
        planet,
        third_bodies,
        love: 0.0,
    };
    let own = PlanetParams::of(Centre::Earth);
    let a = PlanetParams { rate: Some(7.292115e-5), angle: 1.1, ..own.clone() };
    let a = SphericalHarmonics::build(params(a, vec![]), &files).unwrap();
    Worst(relative(a.field(0.0, r), "variant_A", "gravity")).below(1e-12, "A, field, relative");
    let epoch = Some("2012-08-06 00:00:00 UTC".to_string());
    let b = PlanetParams { turns: Turning::Iau, epoch, dut1: 0.4078, ..own };
    let b = SphericalHarmonics::build(params(b, vec![Third::Sun, Third::Moon]), &files).unwrap();
    Worst(relative(b.field(0.0, r), "variant_B", "gravity")).below(1e-12, "B, field, relative");
    let thirds: Vec<Vec3> = b.thirds(0.0, r).collect();
    // DE440's μ of the Sun is 1.7e-10 from the file's. The file takes TT for TDB, 1.6 ms apart: the Moon
    // moves 1.6 m in that, 4e-9 of its distance.
    Worst(relative(thirds[0], "variant_B", "sun")).below(1e-9, "B, Sun, relative");
    Worst(relative(thirds[1], "variant_B", "moon")).below(1e-8, "B, Moon, relative");
    let sum = b.field(0.0, r) + thirds[0] + thirds[1];
    assert!((b.acceleration(0.0, r) - sum).norm() < 1e-14);
}

/// Six hours of all forces, against an independent DOP853 of the same model (right to 1.8 mm).
#[test]
fn full_force_for_six_hours() {
    let Some(text) = reference_text("flight/orbit_full_force.json") else { return };
    let all: Value = serde_json::from_str(&text).unwrap();
    let b = &all["variant_B"];
    let lit: Vec<f64> = b["sunlit_fraction_at_outputs"]
        .as_array()
        .unwrap()
        .iter()
        .map(|x| x.as_f64().unwrap())
        .collect();
    let mut sim = common::repository("earth_orbit/full_force.ron", &[]).unwrap();
    let (mut position, mut velocity) = (Worst(0.0), Worst(0.0));
    let rows = b["t_rx_ry_rz_vx_vy_vz"].as_array().unwrap();
    assert!(rows.len() == 13 && lit.len() == 13);
    for (row, lit) in rows.iter().zip(&lit) {
        sim.run_until(seconds(row[0].as_f64().unwrap())).unwrap();
        let now = body(&sim, "craft");
        let want = |from: usize| Vec3::from_fn(|k, _| row[from + k].as_f64().unwrap());
        position.take((now.position - want(1)).norm());
        velocity.take((now.velocity - want(4)).norm());
        assert!(
            (sim.get("Light.visible").unwrap() - lit).abs() < 1e-6,
            "light at {} s",
            sim.time()
        );
    }
    position.below(0.05, "all forces, position over 6 h, m");
    velocity.below(5e-5, "all forces, velocity over 6 h, m/s");
}

/// Rows of a check case, by column.
struct Case {
    heads: Vec<String>,
    rows: Vec<Vec<f64>>,
}

impl Case {
    fn read(path: &str) -> Option<Case> {
        let text = reference_text(path)?;
        let mut lines = text.lines();
        let heads = lines.next().unwrap().split(',').map(|h| h.trim().to_string()).collect();
        let row = |l: &str| l.split(',').map(|x| x.trim().parse().unwrap()).collect();
        Some(Case { heads, rows: lines.map(row).collect() })
    }
    fn get(&self, row: usize, name: &str) -> f64 {
        self.rows[row][self.heads.iter().position(|h| h == name).unwrap()]
    }
    fn vec(&self, row: usize, name: &str, ends: [&str; 3]) -> Vec3 {
        Vec3::from(ends.map(|e| self.get(row, &format!("{name}_{e}"))))
    }
}

/// Roll, pitch, yaw (rad) of the body from north-east-down at its place; the Earth has turned for t.
fn euler(b: &Body, t: f64) -> (Geodetic, Vec3) {
    let turn =
        Quat::from_axis_angle(&linkwork_spatial::nalgebra::Vector3::z_axis(), EARTH_RATE * t);
    let place = Ellipsoid::wgs84().geodetic(&(turn.inverse() * b.position)).unwrap();
    let R_BE = (turn * place.east_north_up()).inverse() * b.R_WB;
    let [x, y, z] = [Vec3::x(), Vec3::y(), Vec3::z()].map(|axis| {
        let e = R_BE * axis;
        Vec3::new(e.y, e.x, -e.z)
    });
    // Columns are the body's axes in north-east-down; yaw, pitch, roll in turn.
    let (roll, pitch, yaw) = (y.z.atan2(z.z), (-x.z).asin(), x.y.atan2(x.x));
    (place, Vec3::new(roll, pitch, yaw))
}

/// A difference of angles, deg.
fn degrees_apart(a: f64, b: f64) -> f64 {
    ((a - b + 180.0).rem_euclid(360.0) - 180.0).abs()
}

/// Runs a case beside simulators 04 and 05; of two, the median is the mean.
fn check_case(number: u8, name: &str, path: &str) {
    let folder = format!("nesc/Atmos_0{number}_{name}/Atmos_0{number}_sim");
    let Some(a) = Case::read(&format!("{folder}_04.csv")) else { return };
    let Some(b) = Case::read(&format!("{folder}_05_10hz.csv")) else { return };
    assert!(a.rows.len() == 301 && b.rows.len() == 301);
    let mut sim = common::repository(&format!("nesc/case_0{number}.ron"), &[]).unwrap();
    let xyz = ["X", "Y", "Z"];
    let rpy = ["Roll", "Pitch", "Yaw"];
    let [mut p, mut v, mut e, mut w, mut h] = [Worst(0.0); 5];
    for k in 0..301 {
        let t = a.get(k, "time");
        // Simulator 05 prints some of its times a microsecond off: 0.0015 ft of the way.
        assert!((t - b.get(k, "time")).abs() < 2e-6);
        sim.run_until(seconds(t)).unwrap();
        let mid = |name: &str, ends| (a.vec(k, name, ends) + b.vec(k, name, ends)) * 0.5;
        let now = body(&sim, path);
        p.take((now.position / FOOT - mid("eiPosition_ft", xyz)).norm());
        v.take((now.velocity / FOOT - mid("eiVelocity_ft_s", xyz)).norm());
        let rate = now.angular * 1f64.to_degrees() - mid("bodyAngularRateWrtEi_deg_s", rpy);
        w.take(rate.norm());
        let (place, angles) = euler(&now, t);
        let altitude = 0.5 * (a.get(k, "altitudeMsl_ft") + b.get(k, "altitudeMsl_ft"));
        h.take((place.altitude / FOOT - altitude).abs());
        for (i, angle) in rpy.iter().enumerate() {
            let name = format!("eulerAngle_deg_{angle}");
            let (x, y) = (a.get(k, &name), b.get(k, &name));
            let middle = y + ((x - y + 180.0).rem_euclid(360.0) - 180.0) * 0.5;
            e.take(degrees_apart(angles[i].to_degrees(), middle));
        }
    }
    // FLIGHT.md: 0.02 ft, 0.002 ft/s, 1e-3°.
    p.below(0.02, &format!("case {number}, position, ft"));
    h.below(0.02, &format!("case {number}, altitude, ft"));
    v.below(0.002, &format!("case {number}, velocity, ft/s"));
    e.below(1e-3, &format!("case {number}, Euler angles, deg"));
    w.below(1e-3, &format!("case {number}, inertial body rates, deg/s"));
}

#[test]
fn nesc_1_a_sphere_without_drag() {
    check_case(1, "DroppedSphere", "Cannonball/body");
}

#[test]
fn nesc_2_a_tumbling_brick() {
    check_case(2, "TumblingBrickNoDamping", "brick");
}

#[test]
fn nesc_6_a_sphere_with_drag() {
    check_case(6, "DroppedSphereEllipsoidalNoWind", "Cannonball/body");
}

/// The same fall in axes that turn with the Earth, written here by hand: position (m, W) and velocity over
/// the ground (m/s, east-north-up at the place) at 30 s in a wind to the east of `wind(h)`, h in m.
fn fall_seen_from_the_ground(wind: impl Fn(f64) -> f64) -> (Vec3, Vec3) {
    let (earth, air, omega) = (Ellipsoid::wgs84(), Us76::new(), Vec3::z() * EARTH_RATE);
    let area = 0.1963495 * FOOT * FOOT;
    let a = |r: Vec3, v: Vec3| {
        let place = earth.geodetic(&r).unwrap();
        let through = v - place.east_north_up() * Vec3::x() * wind(place.altitude);
        let density = air.at(place.altitude).density;
        let drag = through * (-0.5 * density * through.norm() * 0.1 * area / SLUG);
        let point = PointMotion { position: r, velocity: v };
        let pull = zonal(3.986004418e14, 6_378_137.0, &[1.08262982e-3], &r);
        pull + drag + apparent_acceleration(&omega, &point)
    };
    let (mut r, mut v, h) = (Vec3::x() * (6_378_137.0 + 30_000.0 * FOOT), Vec3::zeros(), 0.01);
    for _ in 0..3000 {
        let a1 = a(r, v);
        let (r2, v2) = (r + v * (h / 2.0), v + a1 * (h / 2.0));
        let a2 = a(r2, v2);
        let (r3, v3) = (r + v2 * (h / 2.0), v + a2 * (h / 2.0));
        let a3 = a(r3, v3);
        let (r4, v4) = (r + v3 * h, v + a3 * h);
        let a4 = a(r4, v4);
        r += (v + (v2 + v3) * 2.0 + v4) * (h / 6.0);
        v += (a1 + (a2 + a3) * 2.0 + a4) * (h / 6.0);
    }
    let turn =
        Quat::from_axis_angle(&linkwork_spatial::nalgebra::Vector3::z_axis(), EARTH_RATE * 30.0);
    let place = earth.geodetic(&r).unwrap();
    (turn * r, place.east_north_up().inverse() * v)
}

/// No trajectories of cases 7 and 8 are at hand: the fall is computed a second time, in turning axes.
#[test]
fn nesc_7_and_8_a_wind_from_the_west_carries_to_the_east() {
    let mut drift = Vec::new();
    for (number, per_second, ground) in [(6, 0.0, 0.0), (7, 0.0, 20.0), (8, 0.003, -20.0)] {
        let mut sim = common::repository(&format!("nesc/case_0{number}.ron"), &[]).unwrap();
        sim.run_until(seconds(30.0)).unwrap();
        let (want, over_ground) =
            fall_seen_from_the_ground(|h| (per_second * h / FOOT + ground) * FOOT);
        let found = body(&sim, "Cannonball/body").position;
        let what = format!("case {number}, position in inertial and in turning axes, m");
        Worst((found - want).norm()).below(1e-6, &what);
        drift.push(over_ground.x);
    }
    println!("velocity to the east at 30 s in cases 6, 7, 8: {drift:?} m/s");
    assert!(drift[1] > drift[0] + 0.5 && drift[2] > drift[1] + 0.5, "{drift:?}");
}
