//! Rolling vehicles: statics of a rocker-bogie compared with a published table, circles compared with closed forms, symmetry, edges of the ground,
//! errors.

use linkwork_dynamics::multibody::{
    BodyId, BodySpec, Builder, Coupling, Hinge, HingeCoordinate, Multibody, Term,
};
use linkwork_dynamics::spatial::{MassProperties, Mat3, Pose, Quat, Vec3};
use linkwork_dynamics::{Tree, Workspace, body_jacobian, inverse_dynamics, kinematics, poses};
use linkwork_solvers::{Rolling, RollingError, RollingReport, Traction, Vehicle, footing};

const RADIUS: f64 = 0.25;
const WHEELS: [&str; 6] = ["lf", "rf", "lm", "rm", "lr", "rr"];
/// Positions of the six wheels of a published Curiosity model, x forward, y left (m).
const PLACES: [[f64; 2]; 6] = [
    [1.095, 1.063],
    [1.095, -1.063],
    [-0.089, 1.194],
    [-0.089, -1.194],
    [-1.163, 1.063],
    [-1.163, -1.063],
];
/// Heights of chassis and hubs over the ground, of pivots of rockers and bogies (m).
const CHASSIS: f64 = 0.75;
const ROCKER: [f64; 3] = [0.214, 0.604, 0.8754];
const BOGIE: [f64; 3] = [-0.54, 0.845, 0.6443];

fn mass(m: f64, inertia: f64) -> MassProperties {
    MassProperties::new(m, Vec3::zeros(), Mat3::identity() * inertia)
}

fn pin(name: &str, parent: &str, at: [f64; 3], on: [f64; 3]) -> BodySpec {
    let at = Pose::translation(at[0] - on[0], at[1] - on[1], at[2] - on[2]);
    BodySpec::new(name, parent)
        .hinge_in_parent(at)
        .hinge(Hinge::pin(Vec3::y()))
        .mass(mass(1e-12, 1e-12))
}

fn coordinate(body: &str) -> HingeCoordinate {
    HingeCoordinate { body: body.into(), subhinge: 0 }
}

/// Six wheels on rockers and bogies, whose masses are negligible compared with the chassis.
fn rover() -> Multibody {
    let mut b = Builder::new();
    b.body(BodySpec::new("chassis", "world").hinge(Hinge::free()).mass(mass(900.0, 200.0)));
    let chassis = [0.0, 0.0, CHASSIS];
    for (side, sign) in [("l", 1.0), ("r", -1.0)] {
        let rocker = [ROCKER[0], sign * ROCKER[1], ROCKER[2]];
        let bogie = [BOGIE[0], sign * BOGIE[1], BOGIE[2]];
        b.body(pin(&format!("rocker_{side}"), "chassis", rocker, chassis));
        b.body(pin(&format!("bogie_{side}"), &format!("rocker_{side}"), bogie, rocker));
        for (k, name) in WHEELS.iter().enumerate().filter(|(_, n)| n.starts_with(side)) {
            let hub = [PLACES[k][0], PLACES[k][1], RADIUS];
            let (carrier, on) = match k < 2 {
                true => (format!("rocker_{side}"), rocker),
                false => (format!("bogie_{side}"), bogie),
            };
            // The middle wheels do not steer.
            let mut wheel = pin(name, &carrier, hub, on);
            if !(2..4).contains(&k) {
                let yoke = format!("yoke_{name}");
                let steer = pin(&yoke, &carrier, hub, on).hinge(Hinge::pin(Vec3::z()).prescribed());
                b.body(steer);
                wheel = pin(name, &yoke, hub, hub);
            }
            b.body(wheel.hinge(Hinge::pin(Vec3::y()).prescribed()));
        }
    }
    let terms =
        ["rocker_l", "rocker_r"].map(|body| Term { coordinate: coordinate(body), factor: 1.0 });
    b.coupling(Coupling::linear("differential", terms.to_vec(), 0.0));
    b.build().unwrap()
}

struct Drive {
    mb: Multibody,
    tree: Tree,
    ws: Workspace,
    rolling: Rolling,
    q: Vec<f64>,
    v: Vec<f64>,
    report: RollingReport,
    gravity: Vec3,
    /// Traction of each wheel; empty for pure rolling.
    tractions: Vec<Traction>,
}

fn vehicle(mb: &Multibody, wheels: &[&str], joints: &[&str]) -> Vehicle {
    let id = |n: &&str| mb.body(n).unwrap();
    Vehicle {
        root: mb.body("chassis").unwrap(),
        wheels: wheels.iter().map(|w| (id(w), RADIUS)).collect(),
        joints: joints.iter().map(id).collect(),
    }
}

const JOINTS: [&str; 4] = ["rocker_l", "rocker_r", "bogie_l", "bogie_r"];
const GRAVITY: Vec3 = Vec3::new(0.0, 0.0, -3.71);

impl Drive {
    fn new(mb: Multibody, wheels: &[&str], joints: &[&str]) -> Self {
        let tree = Tree::new(&mb);
        let rolling = Rolling::new(&tree, &[vehicle(&mb, wheels, joints)]).unwrap();
        let (nq, nv) = (mb.nq(), mb.nv());
        let ws = Workspace::new(&tree);
        let mut q = vec![0.0; nq];
        mb.normalize(&mut q);
        let report = RollingReport::default();
        let (v, tractions) = (vec![0.0; nv], Vec::new());
        Drive { mb, tree, ws, rolling, q, v, report, gravity: GRAVITY, tractions }
    }

    /// A rover at a position and heading.
    fn rover(at: [f64; 2], heading: f64) -> Self {
        let mut d = Drive::new(rover(), &WHEELS, &JOINTS);
        let rotation = Quat::from_axis_angle(&Vec3::z_axis(), heading);
        let root = d.mb.get(d.mb.body("chassis").unwrap()).q();
        d.q[root.start..root.start + 3].copy_from_slice(&[at[0], at[1], CHASSIS]);
        d.q[root.start + 3..root.end].copy_from_slice(rotation.coords.as_slice());
        d
    }

    fn lane(&self, body: &str) -> usize {
        self.mb.get(self.mb.body(body).unwrap()).v().start
    }

    fn angle(&mut self, body: &str) -> &mut f64 {
        let at = self.mb.get(self.mb.body(body).unwrap()).q().start;
        &mut self.q[at]
    }

    fn pose(&mut self, body: &str) -> Pose {
        kinematics(&self.tree, &mut self.ws, &self.q, &self.v);
        self.ws.body_pose(&self.tree, self.mb.body(body).unwrap())
    }

    fn settle(
        &mut self,
        ground: &mut impl FnMut(f64, f64) -> Option<(f64, Vec3)>,
    ) -> RollingReport {
        self.rolling.settle(&self.tree, &mut self.ws, ground, &mut self.q).unwrap()
    }

    fn step(
        &mut self,
        h: f64,
        ground: &mut impl FnMut(f64, f64) -> Option<(f64, Vec3)>,
    ) -> Result<(), RollingError> {
        let (hold, zeros) = (self.hold(), vec![0.0; self.mb.nv()]);
        let state = (&mut self.q[..], &mut self.v[..], &zeros[..]);
        self.report = self.rolling.step(
            &self.tree,
            &mut self.ws,
            ground,
            h,
            state,
            (&hold, &Vec3::z()),
            &self.tractions,
        )?;
        Ok(())
    }

    /// Returns the generalised forces that keep it at rest.
    fn hold(&mut self) -> Vec<f64> {
        let zeros = vec![0.0; self.mb.nv()];
        let mut hold = zeros.clone();
        self.ws.clear_forces();
        self.ws.apply_uniform_gravity(self.gravity);
        inverse_dynamics(&self.tree, &mut self.ws, &self.q, &zeros, &zeros, &mut hold);
        hold
    }

    fn load(&self, wheel: &str) -> f64 {
        let id: BodyId = self.mb.body(wheel).unwrap();
        self.rolling.loads().iter().find(|l| l.body == id).unwrap().force.z
    }
}

fn plane(slope: f64) -> impl FnMut(f64, f64) -> Option<(f64, Vec3)> {
    let (s, c) = slope.sin_cos();
    move |x, _| Some((x * s / c, Vec3::new(-s, 0.0, c)))
}

/// Smooth hills of some decimetres.
fn hills(x: f64, y: f64) -> (f64, Vec3) {
    let height = 0.25 * (0.9 * x + 0.3).sin() * (0.7 * y).cos() + 0.08 * (2.3 * y + 0.4 * x).sin();
    let dx = 0.225 * (0.9 * x + 0.3).cos() * (0.7 * y).cos() + 0.032 * (2.3 * y + 0.4 * x).cos();
    let dy = -0.175 * (0.9 * x + 0.3).sin() * (0.7 * y).sin() + 0.184 * (2.3 * y + 0.4 * x).cos();
    (height, Vec3::new(-dx, -dy, 1.0).normalize())
}

/// Loads of a rocker-bogie on slopes, computed by hand for proportional traction (planar statics, only the mass of the chassis, its centre 0.75 m
/// over the ground): slope (deg, uphill positive), normal forces of front, middle and rear pair as fractions of the weight.
const STATICS: [(f64, [f64; 3]); 7] = [
    (0.0, [0.3303, 0.3885, 0.2812]),
    (10.0, [0.2936, 0.3278, 0.3634]),
    (20.0, [0.2521, 0.2487, 0.4389]),
    (30.0, [0.2067, 0.1541, 0.5052]),
    (-10.0, [0.3616, 0.4274, 0.1958]),
    (-20.0, [0.3881, 0.4404, 0.1112]),
    (-30.0, [0.4121, 0.4205, 0.0334]),
];

#[test]
fn loads_on_slopes_are_those_of_statics() {
    for (slope, shares) in STATICS {
        let mut d = Drive::rover([3.0, -2.0], 0.0);
        let mut ground = plane(slope.to_radians());
        d.settle(&mut ground);
        d.step(0.02, &mut ground).unwrap();
        let weight = 900.0 * 3.71;
        let mut sum = 0.0;
        for (pair, share) in WHEELS.chunks(2).zip(shares) {
            let normal: f64 =
                pair.iter().map(|w| d.load(w)).sum::<f64>() * slope.to_radians().cos();
            // The shares in the table have four digits.
            assert!((normal / weight - share).abs() < 6e-5, "{slope} {pair:?} {}", normal / weight);
            assert!((d.load(pair[0]) - d.load(pair[1])).abs() < 1e-8 * weight);
            sum += normal;
        }
        assert!((sum / weight - slope.to_radians().cos()).abs() < 1e-9);
        assert!(d.report.gap < 1e-9, "{slope} {}", d.report.gap);
    }
}

/// Sets steering and wheel rates for a circle of radius `r` (m), to the left, at the speed `u` (m/s) of the centre.
fn on_a_circle(d: &mut Drive, r: f64, u: f64) {
    for (k, name) in WHEELS.iter().enumerate() {
        let [x, y] = PLACES[k];
        let (ahead, side) = (r - y, x);
        let steer = if (2..4).contains(&k) { 0.0 } else { (side / ahead).atan() };
        if steer != 0.0 {
            *d.angle(&format!("yoke_{name}")) = steer;
        }
        let lane = d.lane(name);
        d.v[lane] = u / r * ahead.hypot(side) / RADIUS;
    }
}

#[test]
fn it_drives_the_circle_of_its_steering() {
    // The middle wheels are at −0.089 m and do not steer, so they slide slightly: the result is the least squares circle.
    let mut d = Drive::rover([0.0, 0.0], 0.0);
    let mut ground = plane(0.0);
    on_a_circle(&mut d, 6.0, 0.2);
    d.settle(&mut ground);
    for _ in 0..1500 {
        d.step(0.02, &mut ground).unwrap();
    }
    // The rover drives 6 m on a circle of 6 m radius, which is 1 rad.
    let p = d.pose("chassis").position;
    let heading = d.pose("chassis").rotation.euler_angles().2;
    assert!((heading - 1.0).abs() < 2e-3, "{heading}");
    let closed = Vec3::new(6.0 * 1.0_f64.sin(), 6.0 * (1.0 - 1.0_f64.cos()), CHASSIS);
    assert!((p - closed).norm() < 0.03, "{p:?}");
    assert!(d.report.slide > 1e-5 && d.report.slide < 5e-3, "{}", d.report.slide);
    // Halving the step changes nothing, because a constant twist is followed exactly.
    let mut fine = Drive::rover([0.0, 0.0], 0.0);
    on_a_circle(&mut fine, 6.0, 0.2);
    fine.settle(&mut ground);
    for _ in 0..3000 {
        fine.step(0.01, &mut ground).unwrap();
    }
    assert!((fine.pose("chassis").position - p).norm() < 1e-9);
}

#[test]
fn straight_on_a_slope_it_goes_as_far_as_its_wheels_turn() {
    let slope = 17_f64.to_radians();
    let mut d = Drive::rover([-1.0, 0.5], 0.0);
    let mut ground = plane(slope);
    d.settle(&mut ground);
    let from = d.pose("chassis").position;
    for name in WHEELS {
        let lane = d.lane(name);
        d.v[lane] = 0.8;
    }
    for _ in 0..500 {
        d.step(0.02, &mut ground).unwrap();
    }
    let way = d.pose("chassis").position - from;
    // The chassis does not rotate, so the wheels roll as far as they rotate relative to it: 10 s at 0.2 m/s. Measured
    // error: 1.2e-9 m.
    assert!((way.norm() - 2.0).abs() < 5e-9, "{}", way.norm());
    assert!((way.z - way.norm() * slope.sin()).abs() < 5e-9 && way.y.abs() < 1e-9);
    // The slide is not zero because of the residual of the search for the footing.
    assert!(d.report.slide < 1e-8, "{}", d.report.slide);
}

#[test]
fn on_hills_wheels_stay_on_the_ground_and_loads_carry_the_weight() {
    let mut d = Drive::rover([0.0, 0.0], 0.6);
    let mut ground = |x: f64, y: f64| Some(hills(x, y));
    on_a_circle(&mut d, 8.0, 0.2);
    d.settle(&mut ground);
    let mut worst = 0.0_f64;
    for _ in 0..2000 {
        d.step(0.02, &mut ground).unwrap();
        worst = worst.max(d.report.gap);
        let sum: f64 = WHEELS.iter().map(|w| d.load(w)).sum();
        assert!((sum - 900.0 * 3.71).abs() < 1e-6 * sum, "{sum}");
    }
    assert!(worst < 1e-8, "{worst}");
    // The differential carries the load difference of the two sides.
    assert!(d.rolling.coupling_forces()[0].abs() > 1.0);
    let (l, r) = (*d.angle("rocker_l"), *d.angle("rocker_r"));
    assert!((l + r).abs() < 1e-10 && l.abs() > 1e-3, "{l} {r}");
}

/// Hills with stones: crests of 6 mm, 20 cm apart, sharper than a wheel.
fn stones(x: f64, y: f64) -> (f64, Vec3) {
    let (height, normal) = hills(x, y);
    let (a, b, size) = (31.0 * x + 5.0 * y, 27.0 * y - 9.0 * x, 0.006);
    let dx = -normal.x / normal.z + size * (31.0 * a.cos() * b.cos() + 9.0 * a.sin() * b.sin());
    let dy = -normal.y / normal.z + size * (5.0 * a.cos() * b.cos() - 27.0 * a.sin() * b.sin());
    (height + size * a.sin() * b.cos(), Vec3::new(-dx, -dy, 1.0).normalize())
}

/// If a rim is near the ground in several places, none of them penetrates, at a bounded cost.
#[test]
fn on_stones_no_part_of_a_rim_is_in_the_ground() {
    let looked = std::cell::Cell::new(0_u32);
    let mut ground = |x: f64, y: f64| {
        looked.set(looked.get() + 1);
        Some(stones(x, y))
    };
    let mut d = Drive::rover([0.0, 0.0], 0.6);
    on_a_circle(&mut d, 8.0, 0.2);
    d.settle(&mut ground);
    looked.set(0);
    let (steps, mut deepest, mut worst) = (1000, 0.0_f64, 0.0_f64);
    for step in 0..steps {
        d.step(0.02, &mut ground).unwrap();
        worst = worst.max(d.report.gap);
        if step % 10 > 0 {
            continue;
        }
        for wheel in WHEELS {
            let pose = d.pose(wheel);
            let axle = pose.rotation * Vec3::y();
            let down = -(Vec3::z() - axle * axle.z).normalize();
            // Check the lower part of the rim in steps of 0.2°.
            for k in -300..=300 {
                let angle = f64::from(k) * 0.2_f64.to_radians();
                let p =
                    pose.position + (down * angle.cos() + down.cross(&axle) * angle.sin()) * RADIUS;
                let (height, normal) = stones(p.x, p.y);
                deepest = deepest.max((height - p.z) * normal.z);
            }
        }
    }
    let each = f64::from(looked.get()) / f64::from(steps) / 6.0;
    assert!(deepest < 1e-9 && worst < 1e-4, "in the ground {deepest}, off it {worst}");
    assert!(each < 40.0, "{each} points of the ground for a wheel and step");
}

/// Rates are the derivatives of positions: compares with the difference of two settled poses over a short step.
#[test]
fn rates_are_derivatives_of_positions() {
    let mut d = Drive::rover([0.3, -0.2], 0.6);
    let mut ground = |x: f64, y: f64| Some(hills(x, y));
    on_a_circle(&mut d, 8.0, 0.2);
    d.settle(&mut ground);
    for _ in 0..200 {
        d.step(0.02, &mut ground).unwrap();
    }
    let before = d.q.clone();
    let h = 1e-5;
    d.step(h, &mut ground).unwrap();
    let mut dv = vec![0.0; d.mb.nv()];
    d.mb.difference(&before, &d.q, &mut dv);
    for (lane, (difference, rate)) in dv.iter().zip(&d.v).enumerate() {
        assert!((difference / h - rate).abs() < 2e-5, "lane {lane}: {} {rate}", difference / h);
    }
}

#[test]
fn mirrored_it_drives_the_mirrored_path() {
    let run = |sign: f64| {
        let mut d = Drive::rover([0.0, 0.0], sign * 0.6);
        let mut ground = |x: f64, y: f64| {
            let (h, n) = hills(x, sign * y);
            Some((h, Vec3::new(n.x, sign * n.y, n.z)))
        };
        on_a_circle(&mut d, sign * 8.0, sign * 0.2);
        for name in WHEELS {
            let lane = d.lane(name);
            d.v[lane] = d.v[lane].abs();
        }
        d.settle(&mut ground);
        for _ in 0..1000 {
            d.step(0.02, &mut ground).unwrap();
        }
        d.pose("chassis").position
    };
    let (left, right) = (run(1.0), run(-1.0));
    assert!((left - Vec3::new(right.x, -right.y, right.z)).norm() < 1e-9, "{left:?} {right:?}");
    assert!(left.y.abs() > 0.5);
}

/// Four wheels on a rigid body.
fn cart() -> Multibody {
    let mut b = Builder::new();
    b.body(BodySpec::new("chassis", "world").hinge(Hinge::free()).mass(mass(50.0, 5.0)));
    for (name, [x, y]) in
        WHEELS[..4].iter().zip([[0.4, 0.3], [0.4, -0.3], [-0.4, 0.3], [-0.4, -0.3]])
    {
        let wheel = pin(name, "chassis", [x, y, RADIUS], [0.0, 0.0, 0.5]);
        b.body(wheel.hinge(Hinge::pin(Vec3::y()).prescribed()));
    }
    b.build().unwrap()
}

#[test]
fn four_wheels_on_a_rigid_body_stand_on_those_that_touch() {
    let mut d = Drive::new(cart(), &WHEELS[..4], &[]);
    let mut ground = |x: f64, y: f64| Some(hills(x, y));
    d.settle(&mut ground);
    for (k, name) in WHEELS[..4].iter().enumerate() {
        let lane = d.lane(name);
        d.v[lane] = if k % 2 == 0 { 0.5 } else { 1.0 };
    }
    for _ in 0..500 {
        d.step(0.02, &mut ground).unwrap();
        let mut lowest = f64::INFINITY;
        for name in &WHEELS[..4] {
            let pose = d.pose(name);
            let foot = linkwork_solvers::footing(&mut ground, &pose, RADIUS).unwrap();
            lowest = lowest.min(foot.gap);
        }
        assert!(lowest.abs() < 1e-6, "{lowest}");
    }
    // Skid steering rotates it to the left, and its wheels slide.
    assert!(d.report.slide > 0.01 && d.pose("chassis").rotation.euler_angles().2 > 0.3);
}

#[test]
fn with_traction_all_forces_balance_on_hills() {
    let mut d = Drive::rover([0.0, 0.0], 0.6);
    let mut ground = |x: f64, y: f64| Some(hills(x, y));
    on_a_circle(&mut d, 8.0, 0.2);
    d.settle(&mut ground);
    // Every wheel has a separate traction, in every direction.
    let traction = |k: usize| {
        let k = k as f64;
        let force = Vec3::new(20.0 - 9.0 * k, 5.0 * k - 12.0, 2.0);
        let resistance = [2e4 + 7e3 * k, 5e4 - 6e3 * k];
        let moment = Vec3::new(3.0 * k - 7.0, 40.0 - 9.0 * k, 5.0);
        let limit = [1e3, 300.0];
        Traction { force, moment, resistance, limit, sinkage: 0.01 + 0.003 * k }
    };
    d.tractions = (0..6).map(traction).collect();
    for step in 0..300 {
        let hold = d.hold();
        poses(&d.tree, &mut d.ws, &d.q);
        let jacobians: Vec<Vec<f64>> = WHEELS
            .iter()
            .map(|w| {
                let mut j = vec![0.0; 6 * d.mb.nv()];
                body_jacobian(&d.tree, &d.ws, d.mb.body(w).unwrap(), &mut j);
                j
            })
            .collect();
        let hubs: Vec<Vec3> = WHEELS
            .iter()
            .map(|w| d.ws.body_pose(&d.tree, d.mb.body(w).unwrap()).position)
            .collect();
        d.step(0.02, &mut ground).unwrap();
        let (nv, coupling) = (d.mb.nv(), d.rolling.coupling_forces()[0]);
        let joined = ["rocker_l", "rocker_r"].map(|b| d.lane(b));
        let free = JOINTS.map(|b| d.lane(b));
        for lane in (0..6).chain(free) {
            let mut sum = if joined.contains(&lane) { coupling } else { 0.0 };
            let wheels = jacobians.iter().zip(&hubs).zip(d.rolling.loads()).zip(&d.tractions);
            for (((jacobian, hub), load), traction) in wheels {
                let moment = (load.point - hub).cross(&load.force) + traction.moment;
                for k in 0..3 {
                    sum += jacobian[k * nv + lane] * moment[k];
                    sum += jacobian[(3 + k) * nv + lane] * load.force[k];
                }
            }
            // The tolerance compares with the weight of 3339 N.
            assert!((sum - hold[lane]).abs() < 1e-6, "{step} lane {lane}: {sum} {}", hold[lane]);
        }
        // The first step sinks the rover into the ground.
        assert!(d.report.gap < 1e-8, "{}", d.report.gap);
    }
    // The depth of each wheel agrees with the sinkage of its traction.
    for (k, name) in WHEELS.iter().enumerate() {
        let pose = d.pose(name);
        let gap = footing(&mut ground, &pose, RADIUS).unwrap().gap;
        assert!((gap + d.tractions[k].sinkage).abs() < 1e-8, "{name} {gap}");
    }
}

#[test]
fn up_a_slope_it_slips_by_what_its_weight_asks() {
    let slope = 12_f64.to_radians();
    let mut d = Drive::rover([-1.0, 0.5], 0.0);
    let mut ground = plane(slope);
    d.settle(&mut ground);
    let resistance = [6e3, 9e3];
    d.tractions = vec![Traction { resistance, limit: [1e9; 2], ..Traction::default() }; 6];
    let from = d.pose("chassis").position;
    for name in WHEELS {
        let lane = d.lane(name);
        d.v[lane] = 0.8;
    }
    for _ in 0..100 {
        d.step(0.02, &mut ground).unwrap();
    }
    let way = (d.pose("chassis").position - from).norm();
    let slip = 900.0 * 3.71 * slope.sin() / (6.0 * resistance[0]);
    assert!((way - 2.0 * (0.2 - slip)).abs() < 5e-9, "{way} {slip}");
    // Across the slope, the weight moves the rover sideways and rotates it, because the wheels are not centred about
    // its centre of mass.
    let mut d = Drive::rover([0.0, 0.0], std::f64::consts::FRAC_PI_2);
    d.settle(&mut ground);
    d.tractions = vec![Traction { resistance, limit: [1e9; 2], ..Traction::default() }; 6];
    let from = d.pose("chassis").position;
    d.step(0.02, &mut ground).unwrap();
    let way = d.pose("chassis").position - from;
    let [mut first, mut second] = [0.0; 2];
    for [x, y] in PLACES {
        first += resistance[1] * x;
        second += resistance[1] * x * x + resistance[0] * y * y;
    }
    let pulls = 900.0 * 3.71 * slope.sin();
    let slides = 0.02 * pulls / (6.0 * resistance[1] - first * first / second);
    assert!((way.norm() - slides).abs() < 1e-9 && way.x < 0.0, "{way:?} {slides}");
}

#[test]
fn alike_resistance_without_weight_is_the_least_sliding() {
    let mut ends = [
        Vec::new(),
        vec![Traction { resistance: [3.0; 2], limit: [1e9; 2], ..Traction::default() }; 6],
    ]
    .map(|tractions| {
        let mut d = Drive::rover([0.0, 0.0], 0.6);
        let mut ground = |x: f64, y: f64| Some(hills(x, y));
        on_a_circle(&mut d, 5.0, 0.2);
        d.settle(&mut ground);
        (d.gravity, d.tractions) = (Vec3::zeros(), tractions);
        for _ in 0..50 {
            d.step(0.02, &mut ground).unwrap();
        }
        d.q
    })
    .into_iter();
    let (rolls, balances) = (ends.next().unwrap(), ends.next().unwrap());
    for (a, b) in rolls.iter().zip(&balances) {
        assert!((a - b).abs() < 1e-10, "{a} {b}");
    }
}

#[test]
fn what_the_ground_does_not_hold_is_refused() {
    let mut d = Drive::rover([-1.0, 0.5], 0.0);
    let mut ground = plane(20_f64.to_radians());
    d.settle(&mut ground);
    d.tractions =
        vec![Traction { resistance: [1e6; 2], limit: [150.0; 2], ..Traction::default() }; 6];
    let told = d.step(0.02, &mut ground).unwrap_err();
    assert!(
        matches!(&told, RollingError::Slides { root, speed } if root == "chassis" && *speed > 1.0)
    );
    assert!(told.to_string().contains("the traction of its wheels is not sufficient"), "{told}");
}

#[test]
fn nothing_is_allocated_by_a_step() {
    let mut d = Drive::rover([0.0, 0.0], 0.6);
    let mut ground = |x: f64, y: f64| Some(hills(x, y));
    on_a_circle(&mut d, 8.0, 0.2);
    d.settle(&mut ground);
    let (zeros, hold) = (vec![0.0; d.mb.nv()], vec![0.0; d.mb.nv()]);
    let count = allocation_counter::measure(|| {
        for _ in 0..10 {
            let state = (&mut d.q[..], &mut d.v[..], &zeros[..]);
            let up = Vec3::z();
            d.rolling
                .step(&d.tree, &mut d.ws, &mut ground, 0.02, state, (&hold, &up), &d.tractions)
                .unwrap();
        }
    });
    assert_eq!(count.count_total, 0);
}

#[test]
fn what_cannot_roll_is_refused() {
    let told = |mb: &Multibody, v: Vehicle| {
        Rolling::new(&Tree::new(mb), &[v]).map(|_| ()).unwrap_err().to_string()
    };
    let mb = rover();
    let good = vehicle(&mb, &WHEELS, &JOINTS);
    let few = told(&mb, vehicle(&mb, &WHEELS[..5], &JOINTS));
    assert!(few.contains("5 wheels and 1 couplings do not determine"), "{few}");
    let left = told(&mb, vehicle(&mb, &WHEELS, &JOINTS[..3]));
    assert!(left.contains("the motion of the hinge of `bogie_r` is undetermined"), "{left}");
    let root = told(&mb, Vehicle { root: mb.body("rocker_l").unwrap(), ..good.clone() });
    assert!(root.contains("`rocker_l` has no free hinge"), "{root}");
    let joint = told(&mb, vehicle(&mb, &WHEELS, &["rocker_l", "rocker_r", "bogie_l", "lm"]));
    assert!(joint.contains("the hinge of `lm` cannot adapt"), "{joint}");
    // Outside of the map, the error names the wheel and the position. A hole under one wheel gives
    // the same error.
    let mut d = Drive::rover([0.0, 0.0], 0.0);
    let mut edge = |x: f64, _: f64| (x < 1.2).then_some((0.0, Vec3::z()));
    let e = d.rolling.settle(&d.tree, &mut d.ws, &mut edge, &mut d.q).unwrap_err();
    assert!(matches!(&e, RollingError::NoGround { wheel, .. } if wheel == "lf"), "{e}");
}
