//! Tests of the controller of two arms: statics of what both hold, closed loop of both hands apart, refusals.
use super::*;
use crate::arm::{InertiaCheck, Load, RobotFile};
use crate::dual_moves::{DualMove, HandMotion};
use linkwork_embedded::Robot;
use linkwork_spatial::nalgebra::{DMatrix, DVector};

const SIDE: [f64; 5] = [-0.23, 0.02, 1.43, 0.12, -1.57];
const LOAD: f64 = 9.0;

fn urdf() -> String {
    let file = concat!(env!("CARGO_MANIFEST_DIR"), "/../../assemblies/arms/dual_six_axis.urdf");
    std::fs::read_to_string(file).unwrap()
}

fn ready() -> Vec<f64> {
    let arm = |last: f64| SIDE.into_iter().chain([last]);
    arm(-1.8).chain(arm(1.34)).collect()
}

fn still(name: &str, duration: f64) -> DualMove {
    let (left, right, both) = (None, None, None);
    let (name, frame) = (name.into(), crate::moves::Written::Base);
    DualMove { name, duration, left, right, both, frame, squeeze: 0.0, arrive: true }
}

fn way() -> HandMotion {
    HandMotion {
        position: None,
        rpy: None,
        turn: None,
        axis_point: Vec3::zeros(),
        axis: Vec3::z(),
        force: Vec3::zeros(),
        moment: Vec3::zeros(),
        stiffness: None,
        touch: None,
        holds: None,
        grip: false,
    }
}

fn hold(duration: f64, squeeze: f64) -> DualMove {
    let both = Some(HandMotion { holds: Some("beam".into()), ..way() });
    DualMove { both, squeeze, ..still("hold", duration) }
}

fn params(moves: Vec<DualMove>) -> DualArmParams {
    let load = |name: &str, mass: f64| Load {
        name: name.into(),
        mass,
        com: Vec3::new(0.02, 0.05, -0.03),
        inertia: Vec3::new(0.3, 0.02, 0.3),
    };
    DualArmParams {
        robot: RobotFile::new("dual_six_axis.urdf", &urdf()),
        inertia_check: InertiaCheck::Warn,
        base: "world".into(),
        left_tip: "left_tool".into(),
        right_tip: "right_tool".into(),
        left_tool: Vec3::new(0.0, 0.0, 0.1),
        right_tool: Vec3::new(0.0, 0.0, 0.1),
        armature: [0.6, 0.6, 0.6, 0.1, 0.1, 0.1].repeat(2),
        moves,
        loads: vec![load("beam", LOAD), load("cup", 0.5)],
        work_position: Vec3::zeros(),
        work_rpy: Vec3::zeros(),
        work_noise: 0.0,
        gravity: Some(Vec3::new(0.0, 0.0, -9.80665)),
        field: None,
        bandwidth: 30.0,
        friction: 0.6,
        margin: 1.3,
        squeeze_max: 300.0,
        tolerance: 1e-3,
        tolerance_angle: 5e-3,
        patience: 1.0,
        ready: ready(),
    }
}

struct Plant {
    c: DualArmController,
    d: Vec<f64>,
    q: Vec<f64>,
    v: Vec<f64>,
    y: Vec<f64>,
    n: u64,
}

impl Plant {
    fn new(p: DualArmParams) -> Self {
        let c = DualArmController::build(p).map_err(|e| e.message).unwrap();
        let mut d = vec![0.0; <DualProgress as Lanes>::N];
        c.initial(&mut [], &mut d);
        let y = vec![0.0; 12 + <DualArmOut as Lanes>::N];
        Plant { c, d, q: ready(), v: vec![0.0; 12], y, n: 0 }
    }

    fn out(&self) -> DualArmOut {
        DualArmOut::get(&self.y[12..])
    }

    /// By place in β, of values hand by hand.
    fn placed(&self, x: &[f64]) -> Vec<f64> {
        let mut out = vec![0.0; 12];
        self.c.arm.dofs.iter().zip(x).for_each(|(k, x)| out[*k] = *x);
        out
    }

    fn bare(&self) -> Robot {
        let mut robot = Robot::new(&self.c.arm.model);
        robot.set_gravity(self.c.p.gravity.unwrap()).unwrap();
        robot.set_q(&self.placed(&self.q)).unwrap();
        robot
    }

    /// One sample of 2 ms of arms that hold nothing, in steps of 0.5 ms; `stuck`: they do not move.
    fn sample(&mut self, stuck: bool) {
        let c = Clock::at(0.002 * self.n as f64, 0.002, self.n);
        let u: Vec<f64> = self.q.iter().zip(&self.v).flat_map(|(q, v)| [*q, *v]).collect();
        self.c.feedthrough(&self.d, &u, &mut self.y);
        let mut d = self.d.clone();
        self.c.update(&c, &mut d, &u);
        self.d = d;
        self.n += 1;
        for _ in 0..if stuck { 0 } else { 4 } {
            let mut robot = self.bare();
            let (mut M, mut bias) = (vec![0.0; 144], vec![0.0; 12]);
            robot.mass_matrix(&mut M).unwrap();
            robot.feed_forward(&self.placed(&self.v), &[0.0; 12], &[], &mut bias).unwrap();
            let tau = self.placed(&self.y[..12]);
            let right = DVector::from_fn(12, |k, _| tau[k] - bias[k]);
            let a = DMatrix::from_row_slice(12, 12, &M).cholesky().unwrap().solve(&right);
            for (at, k) in self.c.arm.dofs.clone().into_iter().enumerate() {
                self.v[at] += 5e-4 * a[k];
                self.q[at] += 5e-4 * self.v[at];
            }
        }
    }
}

/// What each hand does to what it holds, from the joint torques alone: τ = g + Jᵀ f; and where the tips are.
fn wrenches(plant: &Plant) -> ([Vector6<f64>; 2], [Vec3; 2]) {
    let mut robot = plant.bare();
    let mut g = vec![0.0; 12];
    robot.gravity_forces(&mut g).unwrap();
    let tau = plant.placed(&plant.y[..12]);
    let both = [0, 1].map(|hand| {
        let part = plant.c.arm.chains[hand];
        let own = plant.c.arm.model.dofs(part).unwrap();
        let mut J = [0.0; 36];
        robot.jacobian(part, &mut J).unwrap();
        let JT = Matrix6::from_row_slice(&J).transpose();
        let more = Vector6::from_fn(|k, _| tau[own[k]] - g[own[k]]);
        (JT.lu().solve(&more).unwrap(), robot.tip_pose(part).unwrap().position)
    });
    (both.map(|b| b.0), both.map(|b| b.1))
}

/// Held still, both hands together carry the load's weight about any point; what they press with beside that is as friction needs, and
/// the shares of the joints are smaller than of one hand alone.
#[test]
fn two_hands_carry_what_they_hold_and_press_as_friction_needs() {
    for (squeeze, friction) in [(0.0, 0.6), (0.0, 0.5), (120.0, 0.6)] {
        let mut plant = Plant::new(DualArmParams { friction, ..params(vec![hold(1.0, squeeze)]) });
        plant.sample(true);
        plant.sample(true);
        let out = plant.out();
        let (f, p) = wrenches(&plant);
        let at =
            |k: usize| (Vec3::new(f[k][0], f[k][1], f[k][2]), Vec3::new(f[k][3], f[k][4], f[k][5]));
        let [l, r] = [at(0), at(1)];
        let weight = Vec3::new(0.0, 0.0, 9.80665 * LOAD);
        let com = 0.5 * (p[0] + p[1]) + Vec3::new(0.02, 0.05, -0.03);
        let moment = l.0 + r.0 + (p[0] - com).cross(&l.1) + (p[1] - com).cross(&r.1);
        assert!((l.1 + r.1 - weight).norm() < 1e-8, "{} {}", l.1, r.1);
        assert!(moment.norm() < 1e-8, "{moment}");
        let n = (p[1] - p[0]).normalize();
        let press = [l.1.dot(&n), -r.1.dot(&n)];
        let across = [l.1 - n * press[0], r.1 + n * press[1]].map(|t| t.norm());
        let needs = [0, 1].map(|k| across[k] / press[k]);
        println!("{squeeze} {friction}: press {press:?}, across {across:?}, {out:?}");
        assert!((needs[0].max(needs[1]) - out.friction).abs() < 1e-9, "{needs:?}");
        assert!(out.squeeze >= squeeze - 1e-9 && !out.slipping && !out.limited && !out.singular);
        // The margin is exact if no other grip force is commanded.
        let kept = friction / out.friction;
        assert!(kept > 1.3 - 1e-9, "{kept}");
        assert!(squeeze > 0.0 || kept < 1.3 + 1e-9, "{kept}");
    }
    // The required grip force exceeds `squeeze_max`.
    let mut p = params(vec![hold(1.0, 0.0)]);
    (p.friction, p.squeeze_max) = (0.3, 20.0);
    let mut plant = Plant::new(p);
    plant.sample(true);
    assert!(plant.out().slipping && plant.out().squeeze == 20.0);
}

/// Each hand follows its own way; joints of the other hand do not change it.
#[test]
fn hands_go_their_own_ways_apart() {
    let tip = |plant: &Plant, hand: usize| {
        let part = plant.c.arm.chains[hand];
        plant.bare().tip_pose(part).unwrap().position
    };
    let start = Plant::new(params(vec![still("a", 1.0)]));
    let ends = [Vec3::new(-0.05, 0.1, 0.1), Vec3::new(0.05, -0.05, -0.1)];
    let to = [0, 1].map(|k| tip(&start, k) + ends[k]);
    let ways = to.map(|p| Some(HandMotion { position: Some(p), ..way() }));
    let [left, right] = ways;
    let mut plant = Plant::new(params(vec![DualMove { left, right, ..still("apart", 0.6) }]));
    let mut worst = 0.0_f64;
    for _ in 0..600 {
        plant.sample(false);
        worst = worst.max(plant.out().error);
    }
    let out = plant.out();
    assert!(out.done && !out.failed && !out.singular && worst < 5e-3, "{worst} {out:?}");
    for k in 0..2 {
        assert!((tip(&plant, k) - to[k]).norm() < 2e-5, "{}", tip(&plant, k) - to[k]);
    }
    assert!((out.tip_left - tip(&plant, 0)).norm() < 1e-5 && out.share > 0.1 && out.squeeze == 0.0);
}

#[test]
fn joints_that_are_no_numbers_give_torques_that_are_none() {
    let plant = Plant::new(params(vec![hold(1.0, 0.0)]));
    let mut u = [0.1; 24];
    u[3] = f64::NAN;
    let mut y = plant.y.clone();
    plant.c.feedthrough(&plant.d, &u, &mut y);
    assert!(y.iter().all(|y| y.is_nan()));
    // With straight arms, the configuration is singular, but all torques are finite.
    let u = [0.0; 24];
    plant.c.feedthrough(&plant.d, &u, &mut y);
    assert!(DualArmOut::get(&y[12..]).singular && y.iter().all(|y| y.is_finite()));
}

#[test]
fn what_two_arms_cannot_do_is_refused_before_the_run() {
    let refused = |p: DualArmParams, phrases: &[&str]| {
        let e = DualArmController::build(p).err().map(|e| e.message).unwrap();
        assert!(phrases.iter().all(|w| e.contains(w)), "{phrases:?} not in {e}");
    };
    let one = |m: DualMove| params(vec![m]);
    let far = Some(HandMotion { position: Some(Vec3::new(2.0, 0.0, 0.3)), ..way() });
    refused(one(DualMove { right: far.clone(), ..still("far", 1.0) }), &["far", "out of reach"]);
    let apart = Some(HandMotion {
        position: Some(Vec3::new(0.5, 1.0, 0.3)),
        holds: Some("beam".into()),
        ..way()
    });
    refused(one(DualMove { both: apart, ..still("aside", 1.0) }), &["aside", "out of reach"]);
    refused(one(DualMove { left: far, ..hold(1.0, 0.0) }), &["`both` excludes `left` and `right`"]);
    refused(one(DualMove { both: Some(way()), ..still("a", 1.0) }), &["`both` has no load"]);
    refused(
        one(DualMove { squeeze: 3.0, ..still("a", 1.0) }),
        &["`squeeze` needs a load in both hands"],
    );
    let brik = Some(HandMotion { holds: Some("brik".into()), ..way() });
    refused(one(DualMove { left: brik, ..still("a", 1.0) }), &["brik", "not a load"]);
    let cup = Some(HandMotion { holds: Some("cup".into()), ..way() });
    let twice = DualMove { left: cup.clone(), right: cup, ..still("a", 1.0) };
    refused(one(twice), &["same load"]);
    refused(params(Vec::new()), &["`moves` is empty"]);
    let fast = Some(HandMotion { position: Some(Vec3::new(0.3, 0.35, 0.3)), ..way() });
    refused(one(DualMove { left: fast, ..still("fast", 0.02) }), &["fast", "limit"]);
    let mut p = one(still("a", 1.0));
    p.ready.pop();
    refused(p, &["11 positions for 12 joints"]);
    let mut p = one(still("a", 1.0));
    p.armature.pop();
    refused(p, &["11 numbers for 12 joints"]);
    let mut p = one(still("a", 1.0));
    p.right_tip = "left_tool".into();
    refused(p, &["carries both hands"]);
    let mut p = one(still("a", 1.0));
    p.right_tip = "right_tol".into();
    refused(p, &["right_tol", "right_tool"]);
    let mut p = one(still("a", 1.0));
    p.robot = RobotFile::new("weak.urdf", &urdf().replacen("effort=\"28\"", "effort=\"0\"", 1));
    refused(p, &["no effort limit"]);
}
