//! Tests of the standing controller: what it sees, what its feet do, refusals.
use super::*;
use crate::arm::{InertiaCheck, RobotFile};

const LEGS: usize = 4;
const WEIGHT: f64 = 2.6 * 9.80665;

fn urdf() -> String {
    let file = concat!(env!("CARGO_MANIFEST_DIR"), "/../../assemblies/legs/quadruped.urdf");
    std::fs::read_to_string(file).unwrap()
}

fn params() -> StandingParams {
    StandingParams {
        robot: RobotFile::new("quadruped.urdf", &urdf()),
        inertia_check: InertiaCheck::Warn,
        trunk: "trunk".into(),
        trunk_mass: None,
        feet: ["lf_foot", "rf_foot", "rh_foot", "lh_foot"].map(String::from).to_vec(),
        armature: vec![1e-3; 12],
        height: 0.22,
        rise: 1.0,
        sway: Vec3::new(0.0, 0.03, 0.01),
        sway_period: 1.5,
        sway_from: 4.0,
        friction: 0.6,
        force_max: 100.0,
        bandwidth: 12.0,
        gravity: Some(Vec3::new(0.0, 0.0, -9.80665)),
        field: None,
    }
}

fn build(p: StandingParams) -> Result<StandingController, String> {
    StandingController::build(p).map_err(|e| e.message)
}

/// Joints of a stance that nothing about is symmetric, leg by leg.
const STANCE: [f64; 12] = [0.05, 0.7, -1.5, -0.08, 0.8, -1.4, 0.1, 0.65, -1.45, -0.03, 0.75, -1.55];

fn input(q: &[f64], v: &[f64], R: Quat, w: Vec3) -> Vec<f64> {
    let mut u: Vec<f64> = q.iter().zip(v).flat_map(|(q, v)| [*q, *v]).collect();
    let at = u.len();
    u.resize(at + <TrunkIn as Lanes>::N, 0.0);
    TrunkIn { rotation: R, angular: w }.put(&mut u[at..]);
    u
}

fn outputs(c: &StandingController, d: &Stand, u: &[f64]) -> (Vec<f64>, StandingOut) {
    let mut lanes = vec![0.0; <Stand as Lanes>::N];
    d.put(&mut lanes);
    let mut y = vec![0.0; 12 + <StandingOut as Lanes>::N];
    c.feedthrough(&lanes, u, &mut y);
    (y[..12].to_vec(), StandingOut::get(&y[12..]))
}

/// Forces of the feet from torques that hold the machine still: τ = g − Jᵀ f, leg by leg; and where the feet and the centre of mass are.
fn forces(c: &StandingController, u: &[f64], tau: &[f64]) -> ([Vec3; LEGS], StanceEstimate) {
    let mut m = c.take().unwrap();
    let seen = c.see(&mut m, u).unwrap();
    let n = m.v.len();
    let mut g = vec![0.0; n];
    m.robot.gravity_forces(&mut g).unwrap();
    let f = std::array::from_fn(|k| {
        let leg = &c.legs[k];
        let JT = Matrix3::from_fn(|i, j| m.J[k][(3 + j) * n + leg.dofs[i]]);
        let right = Vec3::from_fn(|i, _| g[leg.dofs[i]] - tau[3 * k + i]);
        JT.lu().solve(&right).unwrap()
    });
    (f, seen)
}

/// At rest where it is to be, the feet carry the weight, with no moment about the centre of mass, within their pyramids; what the bounded
/// minimum leaves (ε) is below a thousandth of it (measured 2e-5). Tilted, they turn it back.
#[test]
fn feet_carry_the_weight() {
    let c = build(params()).unwrap();
    let u = input(&STANCE, &[0.0; 12], Quat::identity(), Vec3::zeros());
    let mut m = c.take().unwrap();
    let start = c.see(&mut m, &u).unwrap().com;
    let d = Stand { begun: true, elapsed: 0.0, heading: 0.0, start };
    let (tau, out) = outputs(&c, &d, &u);
    let (f, seen) = forces(&c, &u, &tau);
    let sum: Vec3 = f.iter().sum();
    let about: Vec3 = (0..LEGS).map(|k| (seen.feet[k] - seen.com).cross(&f[k])).sum();
    println!("{f:?} {sum} {about} {out:?}");
    assert!((sum - Vec3::z() * WEIGHT).norm() < 1e-3 * WEIGHT, "{sum}");
    assert!(about.norm() < 1e-3 * WEIGHT * 0.2, "{about}");
    assert!((out.lack - (sum - Vec3::z() * WEIGHT).norm()).abs() < 1e-6, "{} {sum}", out.lack);
    let needs = f.iter().map(|f| f.xy().norm() / f.z).fold(0.0, f64::max);
    assert!((needs - out.friction).abs() < 1e-6 && needs < 0.6, "{needs} {}", out.friction);
    let least = f.iter().map(|f| f.z).fold(f64::INFINITY, f64::min);
    assert!((least - out.press).abs() < 1e-6 && least > 0.0 && out.inside > 0.08, "{out:?}");
    assert!(out.error < 1e-12 && out.error_angle < 1e-12 && !out.stands && !out.singular);
    // The trunk is tilted by 5° about x, and the moment restores it.
    let u = input(&STANCE, &[0.0; 12], Quat::from_euler_angles(0.087, 0.0, 0.0), Vec3::zeros());
    let (tau, _) = outputs(&c, &Stand { start: c.see(&mut m, &u).unwrap().com, ..d }, &u);
    let (f, seen) = forces(&c, &u, &tau);
    let about: Vec3 = (0..LEGS).map(|k| (seen.feet[k] - seen.com).cross(&f[k])).sum();
    assert!(about.x < -0.02, "{about}");
}

/// From joints, attitude and turn rate alone it knows how its centre of mass moves while its feet stand: the derivative of where it is.
#[test]
fn it_sees_how_it_moves_over_standing_feet() {
    let c = build(params()).unwrap();
    let R = Quat::from_euler_angles(0.1, -0.15, 0.4);
    let (w, drift) = (Vec3::new(0.3, -0.2, 0.5), Vec3::new(0.1, 0.25, -0.15));
    // Compute the rates of the joints for which the feet are at rest while the trunk moves.
    let still = input(&STANCE, &[0.0; 12], R, w);
    let mut m = c.take().unwrap();
    let here = c.see(&mut m, &still).unwrap();
    let n = m.v.len();
    let (iv, own) = (c.trunk.1, R.inverse() * drift);
    m.v.fill(0.0);
    m.v[iv..iv + 6].copy_from_slice(&[w.x, w.y, w.z, own.x, own.y, own.z]);
    let mut rates = [0.0; 12];
    for k in 0..LEGS {
        let J = Matrix3::from_fn(|i, j| m.J[k][(3 + i) * n + c.legs[k].dofs[j]]);
        let x = J.lu().solve(&-linear(&m.J[k], &m.v)).unwrap();
        rates[3 * k..3 * k + 3].copy_from_slice(x.as_slice());
    }
    let h = 1e-4;
    let at = |t: f64| {
        let q: Vec<f64> = STANCE.iter().zip(rates).map(|(q, v)| q + t * v).collect();
        let R = R * Quat::from_scaled_axis(w * t);
        let mut m = c.take().unwrap();
        c.see(&mut m, &input(&q, &rates, R, w)).unwrap()
    };
    let now = at(0.0);
    let rate = (at(h).com - at(-h).com) / (2.0 * h);
    println!("{} {rate}", now.velocity);
    assert!((now.velocity - rate).norm() < 1e-6, "{} {rate}", now.velocity);
    assert!((now.com - here.com).norm() < 1e-12 && now.velocity.norm() > 0.1);
    let middle: Vec3 = now.feet[..LEGS].iter().sum();
    assert!(middle.norm() < 1e-12, "the middle of the feet is the origin");
}

/// What it asks of the machine: feet that rest, a trunk that turns back, and a centre of mass that accelerates as its error says (four
/// corrections leave a thousandth).
#[test]
fn accelerations_are_those_that_errors_ask_for() {
    let c = build(params()).unwrap();
    let R = Quat::from_euler_angles(0.1, -0.08, 0.0);
    let u = input(&STANCE, &[0.0; 12], R, Vec3::zeros());
    let mut m = c.take().unwrap();
    let seen = c.see(&mut m, &u).unwrap();
    let e = Vec3::new(0.01, -0.006, 0.008);
    let d = Stand { begun: true, elapsed: 0.0, heading: 0.0, start: seen.com + e };
    c.torques(&d, &mut m, &seen).unwrap();
    for k in 0..LEGS {
        let rate = linear(&m.J[k], &m.vdot) + m.bias[k].linear;
        assert!(rate.norm() < 1e-9, "{rate}");
    }
    let w2 = 144.0;
    let turn = short(R.inverse());
    let alpha = R * Vec3::new(m.vdot[c.trunk.1], m.vdot[c.trunk.1 + 1], m.vdot[c.trunk.1 + 2]);
    assert!((alpha - w2 * turn).norm() < 1e-9, "{alpha}");
    // With zero rates, compute J_c v̇ by differences.
    let h = 1e-5;
    let mut at = |h: f64| {
        let step: Vec<f64> = m.vdot.iter().map(|a| h * a).collect();
        let mut q = m.q.clone();
        c.model.multibody().integrate(&m.q, &step, &mut q);
        m.robot.set_q(&q).unwrap();
        m.robot.center_of_mass().1
    };
    let a = (at(h) - at(-h)) / (2.0 * h);
    println!("{a} {}", w2 * e);
    assert!((a - w2 * e).norm() < 2e-3, "{a}");
}

/// Forces stay in their pyramids, whatever is wanted, and what is lacking is told.
#[test]
fn feet_do_not_pull_nor_push_beyond_friction() {
    let c = build(StandingParams { friction: 0.3, ..params() }).unwrap();
    let u = input(&STANCE, &[0.0; 12], Quat::identity(), Vec3::zeros());
    let mut m = c.take().unwrap();
    let com = c.see(&mut m, &u).unwrap().com;
    for beside in [Vec3::new(0.0, 0.1, 0.0), Vec3::new(-0.2, 0.05, 0.0), Vec3::new(0.0, 0.0, 0.3)] {
        let d = Stand { begun: true, elapsed: 0.0, heading: 0.0, start: com - beside };
        let (_, out) = outputs(&c, &d, &u);
        println!("{beside} {out:?}");
        assert!(out.friction <= 0.3 + 1e-9 && out.press >= 0.0 && out.lack > 1.0, "{out:?}");
    }
}

#[test]
fn it_rises_smoothly_and_then_sways() {
    let c = build(params()).unwrap();
    let start = Vec3::new(-0.02, 0.01, 0.1);
    let at = |t: f64| c.wanted(&Stand { begun: true, elapsed: t, heading: 0.3, start });
    assert!((at(0.0)[0] - start).norm() < 1e-12);
    assert!((at(2.0)[0] - Vec3::z() * 0.22).norm() < 1e-12);
    let h = 1e-5;
    for t in [0.3, 0.8, 3.0, 4.2, 5.0, 5.4, 6.1, 9.0] {
        let (a, b, now) = (at(t - h), at(t + h), at(t));
        assert!(((b[0] - a[0]) / (2.0 * h) - now[1]).norm() < 1e-6, "{t}");
        assert!(((b[1] - a[1]) / (2.0 * h) - now[2]).norm() < 1e-6, "{t}");
    }
    // A quarter of a period after the start of the sway, the trunk is displaced across the heading.
    let side = at(4.0 + 10.25 * 1.5)[0] - Vec3::z() * 0.22;
    let wanted = Quat::from_axis_angle(&Vec3::z_axis(), 0.3) * Vec3::new(0.0, 0.03, 0.01);
    assert!((side - wanted).norm() < 1e-9, "{side}");
}

#[test]
fn the_distance_to_the_edge_of_a_polygon() {
    let square = [[1.0, 1.0], [-1.0, 1.0], [-1.0, -1.0], [1.0, -1.0]];
    let mut corners = square.map(|[x, y]| Vec3::new(x, y, 0.3));
    for _ in 0..2 {
        assert!((inside(&corners, &Vec3::new(0.2, -0.7, 9.0)) - 0.3).abs() < 1e-12);
        assert!((inside(&corners, &Vec3::new(1.5, 0.0, 0.0)) + 0.5).abs() < 1e-12);
        corners.reverse();
    }
}

#[test]
fn outstretched_legs_and_numbers_that_are_none() {
    let c = build(params()).unwrap();
    let d = Stand { begun: true, elapsed: 0.0, heading: 0.0, start: Vec3::zeros() };
    let mut rates = [0.0; 12];
    rates[1] = 0.5;
    let straight = [0.0, 0.3, 0.0].repeat(4);
    let (tau, out) = outputs(&c, &d, &input(&straight, &rates, Quat::identity(), Vec3::zeros()));
    assert!(out.singular && tau.iter().all(|t| t.is_finite()) && tau[1] < 0.0, "damped");
    rates[1] = f64::NAN;
    let (tau, _) = outputs(&c, &d, &input(&STANCE, &rates, Quat::identity(), Vec3::zeros()));
    assert!(tau.iter().all(|t| t.is_nan()));
}

#[test]
fn what_is_no_legged_machine_is_refused() {
    let refused = |p: StandingParams, phrases: &[&str]| {
        let e = build(p).err().unwrap();
        assert!(phrases.iter().all(|w| e.contains(w)), "{phrases:?} not in {e}");
    };
    let mut p = StandingParams { armature: Vec::new(), ..params() };
    p.feet.pop();
    refused(p, &["18 degrees of freedom", "3 legs"]);
    let mut p = params();
    p.feet.truncate(2);
    refused(p, &["2 feet"]);
    let mut p = params();
    p.feet[1] = "rf_fot".into();
    refused(p, &["rf_fot", "rf_foot"]);
    let mut p = params();
    p.feet[1] = "rf_upper".into();
    refused(p, &["rf_upper", "2 joints"]);
    let mut p = params();
    p.feet[1] = "lf_foot".into();
    refused(p, &["degrees of freedom"]);
    let mut p = params();
    p.armature.pop();
    refused(p, &["11 numbers for 12 joints"]);
    let mut p = params();
    p.armature[3] = -1.0;
    refused(p, &["-1 kg m²"]);
    let mut p = params();
    p.trunk = "lf_hip".into();
    refused(p, &[""]);
    let mut p = params();
    p.robot = RobotFile::new("dog.urdf", "<robot name='x'/>");
    refused(p, &[""]);
}
