//! NASA's check cases without a published trajectory (3, 4, 5, 7 to 10), compared once per second with a second integration written here: the fall in
//! Earth-fixed axes with RK4, the brick's attitude by Euler's equations, the sphere's in closed form. Gravity, height over the ellipsoid and the
//! troposphere of US76 are also implemented here.
use linkwork_runtime::Simulation;
use linkwork_spatial::nalgebra::{Quaternion, Vector3};
use linkwork_spatial::{Quat, Vec3};

use crate::common;
use common::{Worst, get, rotation, seconds, velocity};

const FOOT: f64 = 0.3048;
const SLUG: f64 = 14.593_902_937_206_364;
const SLUG_FOOT2: f64 = SLUG * FOOT * FOOT;
const MU: f64 = 3.986004418e14;
/// NESC_Initial_Conditions_Atmos.csv: 0.004178073 deg/s.
const EARTH_RATE: f64 = 7.292_113_023_867_704e-5;

/// Earth model of the cases.
struct Earth {
    radius: f64,
    flattening: f64,
    j2: f64,
    rate: f64,
    /// Wind to the east (m/s) relative to the ground: at height 0, and increase per metre.
    wind: (f64, f64),
}

impl Earth {
    fn wgs84() -> Earth {
        Earth {
            radius: 6_378_137.0,
            flattening: 1.0 / 298.257_223_563,
            j2: 1.082_629_82e-3,
            rate: EARTH_RATE,
            wind: (0.0, 0.0),
        }
    }
    fn round(rate: f64) -> Earth {
        let radius = 20_902_255.199 * FOOT;
        Earth { radius, flattening: 0.0, j2: 0.0, rate, wind: (0.0, 0.0) }
    }
    /// Returns the height along the normal of the ellipsoid, m: φ by fixed-point iteration of tan φ = (z + e² N sin φ)/p.
    fn height(&self, r: &Vec3) -> f64 {
        let e2 = self.flattening * (2.0 - self.flattening);
        let p = r.x.hypot(r.y);
        let mut phi = r.z.atan2(p * (1.0 - e2));
        for _ in 0..8 {
            let n = self.radius / (1.0 - e2 * phi.sin().powi(2)).sqrt();
            phi = (r.z + e2 * n * phi.sin()).atan2(p);
        }
        let (sin, cos) = phi.sin_cos();
        p * cos + r.z * sin - self.radius * (1.0 - e2 * sin * sin).sqrt()
    }
    /// Returns −μ r/r³ plus J2.
    fn gravity(&self, r: &Vec3) -> Vec3 {
        let d = r.norm();
        let (s, k) = ((r.z / d).powi(2), 1.5 * self.j2 * (self.radius / d).powi(2));
        let pull = Vec3::new(
            1.0 - k * (5.0 * s - 1.0),
            1.0 - k * (5.0 * s - 1.0),
            1.0 - k * (5.0 * s - 3.0),
        );
        pull.component_mul(r) * (-MU / d.powi(3))
    }
    /// −2 ω × v − ω × (ω × r), ω along z.
    fn apparent(&self, r: &Vec3, v: &Vec3) -> Vec3 {
        let w = self.rate;
        Vec3::new(2.0 * w * v.y + w * w * r.x, -2.0 * w * v.x + w * w * r.y, 0.0)
    }
    /// Density of US76 below 11 km: T = 288.15 − 6.5 H/km, H = r₀ h/(r₀ + h), p = p₀ (T/T₀)^{g₀ M/(R L)}.
    fn density(&self, height: f64) -> f64 {
        assert!(height < 11_000.0, "{height} m is above the troposphere");
        let potential = 6_356_766.0 * height / (6_356_766.0 + height);
        let t = 288.15 - 6.5e-3 * potential;
        let power = 9.80665 * 28.9644e-3 / (8.31432 * 6.5e-3);
        101_325.0 * (t / 288.15).powf(power) * 28.9644e-3 / (8.31432 * t)
    }
    fn turned(&self, t: f64) -> Quat {
        Quat::from_axis_angle(&Vector3::z_axis(), self.rate * t)
    }
    /// Converts position r and velocity v in the Earth's axes at t to W.
    fn inertial(&self, t: f64, r: &Vec3, v: &Vec3) -> (Vec3, Vec3) {
        let turn = self.turned(t);
        (turn * r, turn * (v + Vec3::z().cross(r) * self.rate))
    }
}

/// Makes a step of RK4.
fn rk4<const N: usize>(y: [f64; N], h: f64, f: impl Fn(&[f64; N]) -> [f64; N]) -> [f64; N] {
    let along = |k: &[f64; N], c: f64| -> [f64; N] { std::array::from_fn(|i| y[i] + c * h * k[i]) };
    let a = f(&y);
    let b = f(&along(&a, 0.5));
    let c = f(&along(&b, 0.5));
    let d = f(&along(&c, 1.0));
    std::array::from_fn(|i| y[i] + h / 6.0 * (a[i] + 2.0 * (b[i] + c[i]) + d[i]))
}

/// Returns position and velocity in W, once per second, of the cannonball that leaves `r` with `v` relative to the ground, both in the Earth's axes,
/// which initially coincide with W.
fn cannonball(earth: &Earth, r: Vec3, v: Vec3) -> Vec<(Vec3, Vec3)> {
    let area = 0.1963495 * FOOT * FOOT;
    let slope = |y: &[f64; 6]| {
        let (r, v) = (Vec3::new(y[0], y[1], y[2]), Vec3::new(y[3], y[4], y[5]));
        let height = earth.height(&r);
        let east = Vec3::new(-r.y, r.x, 0.0) / r.x.hypot(r.y);
        let through = v - east * (earth.wind.0 + earth.wind.1 * height);
        let drag = through * (-0.5 * earth.density(height) * through.norm() * 0.1 * area / SLUG);
        let a = earth.gravity(&r) + drag + earth.apparent(&r, &v);
        [v.x, v.y, v.z, a.x, a.y, a.z]
    };
    let mut y = [r.x, r.y, r.z, v.x, v.y, v.z];
    let mut along = vec![earth.inertial(0.0, &r, &v)];
    for k in 1..=30 {
        for _ in 0..200 {
            y = rk4(y, 0.005, slope);
        }
        let (r, v) = (Vec3::new(y[0], y[1], y[2]), Vec3::new(y[3], y[4], y[5]));
        along.push(earth.inertial(f64::from(k), &r, &v));
    }
    along
}

/// Compares the simulation with the second integration every second. Returns the height (m) and the velocity over the ground (m/s: to the east, and
/// along the Earth's axis) of the *simulation* at the end.
fn compare(
    number: u8,
    earth: &Earth,
    r: Vec3,
    ground: Vec3,
    (start, rates): (Quat, Vec3),
) -> (f64, Vec3) {
    let mut sim = common::repository(&format!("nesc/case_{number:02}.ron"), &[]).unwrap();
    let body = "Cannonball/body";
    let [mut p, mut v, mut q, mut w] = [Worst(0.0); 4];
    for (k, (want_r, want_v)) in cannonball(earth, r, ground).into_iter().enumerate() {
        let t = k as f64;
        sim.run_until(seconds(t)).unwrap();
        p.take((get(&sim, &format!("{body}.position")) - want_r).norm());
        v.take((velocity(&sim, body) - want_v).norm());
        // A sphere keeps its inertial rates: it rotates about an axis that is fixed in it.
        let want_q = start * Quat::from_scaled_axis(rates * t);
        q.take(rotation(&sim, body).angle_to(&want_q).to_degrees());
        w.take((get(&sim, &format!("{body}.angular")) - rates).norm());
    }
    p.below(1e-6, &format!("case {number}, position, m"));
    v.below(1e-7, &format!("case {number}, velocity, m/s"));
    q.below(1e-9, &format!("case {number}, attitude, deg"));
    w.below(1e-14, &format!("case {number}, inertial body rates, rad/s"));
    let back = earth.turned(30.0).inverse();
    let r = back * get(&sim, &format!("{body}.position"));
    let v = back * velocity(&sim, body) - Vec3::z().cross(&r) * earth.rate;
    let east = Vec3::new(-r.y, r.x, 0.0) / r.x.hypot(r.y);
    (earth.height(&r), Vec3::new(east.dot(&v), v.z, 0.0))
}

/// Body axes are north, east, down at the initial position.
fn north_east_down() -> Quat {
    Quat::from_axis_angle(&Vector3::y_axis(), -std::f64::consts::FRAC_PI_2)
}

/// The fall from 30000 ft without air: ½ g t², with g between 9.76 and 9.83 m/s² on both Earths, minus the effect of rotation.
fn fell(number: u8, height: f64) {
    let fall = 30_000.0 * FOOT - height;
    println!("case {number}: fell {fall:.1} m");
    assert!((3000.0..0.5 * 9.83 * 900.0).contains(&fall), "case {number} fell {fall} m");
}

#[test]
fn nesc_4_and_5_over_a_round_earth() {
    let rates = Vec3::new(10.0, 20.0, 30.0).map(f64::to_radians);
    for (number, rate) in [(4, 0.0), (5, EARTH_RATE)] {
        let earth = Earth::round(rate);
        let r = Vec3::x() * (earth.radius + 30_000.0 * FOOT);
        let (height, over_ground) =
            compare(number, &earth, r, Vec3::zeros(), (north_east_down(), rates));
        fell(number, height);
        // The eastward velocity over the ground is only due to the rotation of the Earth.
        assert!((over_ground.x.abs() > 0.1) == (number == 5), "case {number}: {over_ground} m/s");
    }
}

/// Wind "from the west" blows to the east. `sims/nesc/README.md` states the velocities over the ground.
#[test]
fn nesc_7_and_8_a_wind_from_the_west_carries_to_the_east() {
    for (number, wind, east) in
        [(6, (0.0, 0.0), 0.56), (7, (20.0 * FOOT, 0.0), 1.44), (8, (-20.0 * FOOT, 0.003), 2.66)]
    {
        let earth = Earth { wind, ..Earth::wgs84() };
        let r = Vec3::x() * (earth.radius + 30_000.0 * FOOT);
        let still = (north_east_down(), Vec3::zeros());
        let (height, over_ground) = compare(number, &earth, r, Vec3::zeros(), still);
        fell(number, height);
        assert!((over_ground.x - east).abs() < 0.005, "case {number}: {over_ground} m/s");
    }
}

#[test]
fn nesc_9_and_10_shot_to_the_east_and_to_the_north() {
    let (earth, speed) = (Earth::wgs84(), 1000.0 * FOOT);
    let (r, ned) = (Vec3::x() * earth.radius, north_east_down());
    let yaw = Quat::from_axis_angle(&Vector3::z_axis(), std::f64::consts::FRAC_PI_2);
    let east = (Vec3::x() + Vec3::y()) * speed;
    let (up_9, v_9) = compare(9, &earth, r, east, (ned * yaw, -Vec3::y() * earth.rate));
    let north = (Vec3::x() + Vec3::z()) * speed;
    let (up_10, v_10) = compare(10, &earth, r, north, (ned, Vec3::x() * earth.rate));
    println!("cases 9, 10: {up_9:.1}, {up_10:.1} m high, {v_9:?}, {v_10:?} m/s");
    // The shot to the east is higher, because the Earth's rotation helps (Eötvös): 2 ω v = 0.044 m/s² for 30 s, which
    // is 20 m by ½ a t².
    assert!((3000.0..4748.0).contains(&up_10) && (10.0..20.0).contains(&(up_9 - up_10)));
    assert!(v_9.x > 180.0 && v_9.y.abs() < 1e-9 && v_10.y > 180.0 && v_10.x.abs() < 2.0);
}

/// State of the brick: position, velocity and attitude in W, rates in its own axes.
struct Brick {
    position: Vec3,
    velocity: Vec3,
    attitude: Quat,
    rates: Vec3,
}

/// Returns the falling brick once per second, with damping (C_lp, C_mq, C_nr, 1/rad) of ω − `air_rate`; RK4 with 1 ms, accurate to 1e-10 deg.
fn brick(earth: &Earth, air_rate: Vec3, damping: f64) -> Vec<Brick> {
    let inertia = Vec3::new(0.00189422, 0.006211019, 0.007194665) * SLUG_FOOT2;
    let (area, span, chord) = (0.22222 * FOOT * FOOT, 0.33333 * FOOT, 0.66667 * FOOT);
    let arms = Vec3::new(span, chord, span);
    let quat = |y: &[f64; 13]| Quat::from_quaternion(Quaternion::new(y[9], y[6], y[7], y[8]));
    let slope = |y: &[f64; 13]| {
        // The translation is in Earth-fixed axes, the attitude in inertial ones.
        let (r, v) = (Vec3::new(y[0], y[1], y[2]), Vec3::new(y[3], y[4], y[5]));
        let (q, w) = (quat(y), Vec3::new(y[10], y[11], y[12]));
        let a = earth.gravity(&r) + earth.apparent(&r, &v);
        let against = w - q.inverse() * air_rate;
        // The coefficient is C = C_q rate L/(2V), with V ≥ 0.5 ft/s.
        let speed = v.norm();
        let pressure = 0.5 * earth.density(earth.height(&r)) * speed * speed * area;
        let lengths = arms.component_mul(&arms) / (2.0 * speed.max(0.5 * FOOT));
        let moment = against.component_mul(&lengths) * (damping * pressure);
        let alpha = (moment - w.cross(&inertia.component_mul(&w))).component_div(&inertia);
        let dq = q.quaternion() * Quaternion::from_imag(w) * 0.5;
        [v.x, v.y, v.z, a.x, a.y, a.z, dq.i, dq.j, dq.k, dq.w, alpha.x, alpha.y, alpha.z]
    };
    let h = earth.radius + 30_000.0 * FOOT;
    let start = north_east_down();
    let w = Vec3::new(10.0, 20.0, 30.0).map(f64::to_radians);
    let mut y = [h, 0.0, 0.0, 0.0, 0.0, 0.0, start.i, start.j, start.k, start.w, w.x, w.y, w.z];
    let mut along = Vec::new();
    for k in 0..=30 {
        let (r, v) = (Vec3::new(y[0], y[1], y[2]), Vec3::new(y[3], y[4], y[5]));
        let (position, velocity) = earth.inertial(f64::from(k), &r, &v);
        let rates = Vec3::new(y[10], y[11], y[12]);
        along.push(Brick { position, velocity, attitude: quat(&y), rates });
        for _ in 0..1000 {
            y = rk4(y, 1e-3, slope);
        }
    }
    along
}

/// Compares the simulation with the second integration every second. The requirement is 1e-6 deg for case 2; the best agreement of JSBSim is 4e-4
/// deg.
fn beside(what: &str, sim: &mut Simulation, along: &[Brick]) {
    let [mut p, mut v, mut q, mut w] = [Worst(0.0); 4];
    for (k, want) in along.iter().enumerate() {
        sim.run_until(seconds(k as f64)).unwrap();
        p.take((get(sim, "brick.position") - want.position).norm());
        v.take((velocity(sim, "brick") - want.velocity).norm());
        q.take(rotation(sim, "brick").angle_to(&want.attitude).to_degrees());
        w.take((get(sim, "brick.angular") - want.rates).norm().to_degrees());
    }
    p.below(1e-6, &format!("{what}, position, m"));
    v.below(1e-7, &format!("{what}, velocity, m/s"));
    q.below(1e-6, &format!("{what}, attitude, deg"));
    w.below(1e-7, &format!("{what}, inertial body rates, deg/s"));
}

#[test]
fn nesc_2_a_tumbling_brick_beside_the_converged_attitude() {
    let mut sim = common::repository("nesc/case_02.ron", &[]).unwrap();
    beside("case 2", &mut sim, &brick(&Earth::wgs84(), Vec3::zeros(), 0.0));
}

/// Both conventions: damping of the rates relative to the rotating Earth, and of inertial rates.
#[test]
fn nesc_3_a_tumbling_brick_with_damping() {
    let mut ends = Vec::new();
    let turning = format!("air_rate=[0, 0, {EARTH_RATE:?}]");
    // In the file the damping is relative to the rotating air.
    for (air_rate, set) in [
        (EARTH_RATE, vec![]),
        (EARTH_RATE, vec![turning.as_str()]),
        (0.0, vec!["air_rate=[0, 0, 0]"]),
    ] {
        let mut sim = common::repository("nesc/case_03.ron", &set).unwrap();
        let want = brick(&Earth::wgs84(), Vec3::z() * air_rate, -1.0);
        beside(&format!("case 3, {set:?}"), &mut sim, &want);
        // Damping has reduced the rate of 37 deg/s.
        let rate = get(&sim, "brick.angular").norm().to_degrees();
        assert!(rate < 0.9 * 37.0, "{rate} deg/s");
        ends.push(rotation(&sim, "brick"));
    }
    // The two damping conventions differ by 0.099° as one rotation. This explains why simulators 05 and 04 of NASA differ by 0.09° in Euler angles.
    let apart = ends[0].angle_to(&ends[2]).to_degrees();
    println!("the two conventions: {apart:.4} deg");
    assert!((apart - 0.099).abs() < 0.0005, "{apart}");
}

/// The initial states of all ten files agree with the workbook: position, velocity, attitude and inertial rates, computed from its columns. Its
/// altitude of the bricks is 0; they are dropped from 30000 ft, as in the trajectory of case 2 that came with it.
#[test]
fn initial_states_are_those_of_the_workbook() {
    let name = "nesc/NESC_Initial_Conditions_Atmos.csv";
    let Some(text) = common::reference_text(name) else { return };
    let rows: Vec<Vec<&str>> = text.lines().map(|l| l.split(',').collect()).collect();
    // The result is in the first row with this label at or below the row with that heading, in the column of the case:
    // four columns of labels precede case 1.
    let cell = |heading: &str, label: &str, case: usize| -> f64 {
        let from = rows.iter().position(|r| r[0].starts_with(heading)).unwrap();
        let row = rows[from..].iter().find(|r| r[1] == label).unwrap();
        row[3 + case].parse().unwrap_or_else(|_| panic!("{heading}, {label}: {}", row[3 + case]))
    };
    for case in 1..=10 {
        let brick = case == 2 || case == 3;
        let body = if brick { "brick" } else { "Cannonball/body" };
        let sim = common::repository(&format!("nesc/case_{case:02}.ron"), &[]).unwrap();
        // The row in rad/s is below the row in deg/s, which has fewer digits.
        let rate = rows.iter().filter(|r| r[1] == "Earth rotation rate").nth(1).unwrap()[3 + case];
        let rate: f64 = rate.parse().unwrap();
        let of = |label: &str| cell("ECEF Geodetic", label, case);
        assert!(of("Latitude") == 0.0 && of("Longitude") == 0.0, "case {case}");
        let height = if brick { 30_000.0 } else { of("Altitude MSL") };
        // In feet its WGS 84 is 0.204 m larger than the defining 6378137 m, which the simulators use.
        let radius = match cell("Re", "Equatorial radius", case) {
            20_925_646.995_08 => 6_378_137.0,
            round => round * FOOT,
        };
        let r = Vec3::x() * (radius + height * FOOT);
        let found = get(&sim, &format!("{body}.position"));
        assert!((found - r).norm() < 1e-6, "case {case}: {found} {r}");
        // The velocity over the ground is given as north, east, down; W is up, east, north there.
        let [north, east, down] = ["Vnorth", "Veast", "Vdown"].map(of);
        let v = Vec3::new(-down, east, north) * FOOT + Vec3::y() * (rate * r.x);
        let found = velocity(&sim, body);
        assert!((found - v).norm() < 1e-9, "case {case}: {found} {v}");
        let [roll, pitch, yaw] =
            ["roll", "pitch", "yaw"].map(|a| of(&format!("Euler {a} angle")).to_radians());
        let attitude = north_east_down() * Quat::from_euler_angles(roll, pitch, yaw);
        let off = rotation(&sim, body).angle_to(&attitude);
        assert!(off < 1e-7, "case {case}: {off:e} rad");
        let rates = ["Roll rate", "Pitch rate", "Yaw rate"]
            .map(|label| cell("Inertial rotation components in body", label, case).to_radians());
        let found = get(&sim, &format!("{body}.angular"));
        assert!((found - Vec3::from(rates)).norm() < 1e-12, "case {case}: {found}");
    }
}
