//! Tests of the controller, most of them in closed loop with an arm of the same description.
use super::*;
use crate::moves::Written;
use linkwork_runtime::Params as _;

fn arm() -> String {
    let file = concat!(env!("CARGO_MANIFEST_DIR"), "/../../assemblies/arms/six_axis.urdf");
    std::fs::read_to_string(file).unwrap()
}
const READY: [f64; 6] = [0.03, 0.0, 1.4, 0.17, -1.57, -1.54];

fn stay(name: &str, duration: f64) -> Move {
    Move { frame: Written::Base, ..Move::stay(name, duration) }
}

fn params(moves: Vec<Move>) -> ArmParams {
    ArmParams {
        robot: RobotFile::new("six_axis.urdf", &arm()),
        inertia_check: InertiaCheck::Warn,
        base: "world".into(),
        tip: "tool".into(),
        tool: Vec3::zeros(),
        armature: vec![0.6, 0.6, 0.6, 0.1, 0.1, 0.1],
        moves,
        loads: vec![Load {
            name: "brick".into(),
            mass: 2.0,
            com: Vec3::new(0.0, 0.0, 0.1),
            inertia: Vec3::new(0.01, 0.01, 0.005),
        }],
        work_position: Vec3::zeros(),
        work_rpy: Vec3::zeros(),
        work_noise: 0.0,
        gravity: Some(Vec3::new(0.0, 0.0, -9.80665)),
        field: None,
        bandwidth: 30.0,
        tolerance: 1e-3,
        tolerance_angle: 5e-3,
        patience: 1.0,
        ready: READY.to_vec(),
    }
}

fn build(p: ArmParams) -> Result<ArmController, String> {
    ArmController::build(p).map_err(|e| e.message)
}

/// The arm itself, in closed loop: M v̇ = τ − C v − g − Jᵀ f by the mass matrix, steps of 0.5 ms (midpoint).
struct Plant {
    c: ArmController,
    d: Vec<f64>,
    q: Vec<f64>,
    v: Vec<f64>,
    load: Option<usize>,
    /// Force on the tip, for a pose and a velocity of its origin.
    wall: fn(Vec3, Vec3) -> Vec3,
    n: u64,
    y: Vec<f64>,
}

impl Plant {
    fn new(moves: Vec<Move>, load: Option<usize>, wall: fn(Vec3, Vec3) -> Vec3) -> Self {
        let c = build(params(moves)).unwrap();
        let mut d = vec![0.0; <Progress as Lanes>::N];
        c.initial(&mut [], &mut d);
        let y = vec![0.0; 6 + <ArmOut as Lanes>::N];
        Plant { c, d, q: READY.to_vec(), v: vec![0.0; 6], load, wall, n: 0, y }
    }

    fn out(&self) -> ArmOut {
        ArmOut::get(&self.y[6..])
    }

    fn tip(&self) -> Pose {
        let mut robot = linkwork_embedded::Robot::new(&self.c.arm.model);
        robot.set_q(&self.q).unwrap();
        robot.tip_pose(self.c.arm.chains[0]).unwrap()
    }

    fn acceleration(&self, q: &[f64], v: &[f64], tau: &[f64]) -> Vec<f64> {
        let joints: Vec<f64> = q.iter().zip(v).flat_map(|(q, v)| [*q, *v]).collect();
        let held = [self.load.map(|k| (k, Pose::identity())), None];
        let mut m = self.c.arm.at(&joints, held).unwrap();
        let (mut bias, mut M) = ([0.0; 6], [0.0; 36]);
        m.robot.feed_forward(v, &[0.0; 6], &[], &mut bias).unwrap();
        m.robot.mass_matrix(&mut M).unwrap();
        m.robot.jacobian(self.c.arm.chains[0], &mut m.J[0]).unwrap();
        let p = m.robot.tip_pose(self.c.arm.chains[0]).unwrap().position;
        let rate = |row: usize| (0..6).map(|k| m.J[0][6 * row + k] * v[k]).sum::<f64>();
        let f = (self.wall)(p, Vec3::new(rate(3), rate(4), rate(5)));
        let M = linkwork_spatial::nalgebra::SMatrix::<f64, 6, 6>::from_row_slice(&M);
        let right = linkwork_spatial::nalgebra::SVector::<f64, 6>::from_fn(|k, _| {
            tau[k] - bias[k] + (0..3).map(|i| m.J[0][6 * (3 + i) + k] * f[i]).sum::<f64>()
        });
        let a = M.cholesky().unwrap().solve(&right);
        self.c.arm.give_back(m);
        a.iter().copied().collect()
    }

    /// One sample of 2 ms.
    fn sample(&mut self) {
        let c = Clock::at(0.002 * self.n as f64, 0.002, self.n);
        let u: Vec<f64> = self.q.iter().zip(&self.v).flat_map(|(q, v)| [*q, *v]).collect();
        self.c.feedthrough(&self.d, &u, &mut self.y);
        let mut d = self.d.clone();
        self.c.update(&c, &mut d, &u);
        let tau = self.y[..6].to_vec();
        let h = 0.0005;
        for _ in 0..4 {
            let a = self.acceleration(&self.q, &self.v, &tau);
            let q: Vec<f64> = (0..6).map(|k| self.q[k] + 0.5 * h * self.v[k]).collect();
            let v: Vec<f64> = (0..6).map(|k| self.v[k] + 0.5 * h * a[k]).collect();
            let a = self.acceleration(&q, &v, &tau);
            for k in 0..6 {
                self.q[k] += h * v[k];
                self.v[k] += h * a[k];
            }
        }
        self.d = d;
        self.n += 1;
    }

    fn run(&mut self, seconds: f64) {
        (0..(seconds / 0.002).round() as u64).for_each(|_| self.sample());
    }
}

fn free(_: Vec3, _: Vec3) -> Vec3 {
    Vec3::zeros()
}

#[test]
fn it_follows_a_line_and_an_arc_closely_and_ends_there() {
    let end = Vec3::new(0.45, 0.25, 0.35);
    let line = Move { position: Some(end), rpy: Some(Vec3::new(2.6, 0.2, 0.4)), ..stay("a", 2.0) };
    let axis_point = Vec3::new(0.6, 0.25, 0.0);
    let arc = Move { turn: Some(0.5), axis_point, ..stay("b", 1.0) };
    let mut plant = Plant::new(vec![line, arc], None, free);
    let mut worst = 0.0_f64;
    for _ in 0..1100 {
        plant.sample();
        worst = worst.max(plant.out().error);
    }
    // The remaining error comes from torques that are held over samples of 2 ms: it decreases with the sample time.
    assert!(worst < 2e-3, "{worst}");
    assert!(plant.out().index == 1.0 && !plant.out().done);
    plant.run(1.5);
    let out = plant.out();
    assert!(out.done && !out.failed && !out.limited && !out.singular);
    assert!(out.error < 1e-5 && out.error_angle < 1e-5, "{} {}", out.error, out.error_angle);
    let wanted = axis_point + Quat::from_scaled_axis(Vec3::z() * 0.5) * (end - axis_point);
    assert!((plant.tip().position - wanted).norm() < 2e-5);
    assert!((out.tip - plant.tip().position).norm() < 2e-5);
}

/// A hand that knows its load holds it where it is; one that does not sinks under it by m g/(M ω²) along z.
#[test]
fn it_carries_what_it_knows_to_hold() {
    let holding = Move { holds: Some("brick".into()), ..stay("carry", 0.5) };
    let mut knows = Plant::new(vec![holding], Some(0), free);
    knows.run(1.0);
    assert!(knows.out().done && knows.out().error < 1e-7, "{}", knows.out().error);
    let mut not = Plant::new(vec![Move { arrive: false, ..stay("carry", 0.5) }], Some(0), free);
    not.run(1.0);
    assert!(not.out().error > 1e-3, "{}", not.out().error);
}

/// A spring of 2 kN/m with the force f in z: x = f/k when nothing else acts, and at a wall of stiffness k_w the force
/// that closes the way of both springs.
#[test]
fn a_compliant_tip_gives_way_as_its_spring() {
    let soft = Some([2000.0, 200.0]);
    let pushed =
        Move { force: Vec3::z() * 10.0, stiffness: soft, arrive: false, ..stay("push", 2.0) };
    let mut plant = Plant::new(vec![pushed], None, free);
    let before = plant.tip().position;
    plant.run(3.0);
    let way = plant.tip().position - before;
    assert!((way - Vec3::z() * 5e-3).norm() < 1e-5, "{way}");
    assert!(plant.out().push < 1e-2, "the spring balances the force: {}", plant.out().push);
}

/// A wall 20 mm under the tip, stiffness 50 kN/m.
fn floor(p: Vec3, v: Vec3) -> Vec3 {
    let depth = FLOOR - p.z;
    if depth > 0.0 { Vec3::z() * (5e4 * depth - 200.0 * v.z).max(0.0) } else { Vec3::zeros() }
}
const FLOOR: f64 = 0.30;

#[test]
fn a_touch_ends_a_move_and_the_next_begins_there() {
    let soft = Some([2000.0, 200.0]);
    let over = Vec3::new(0.45, 0.1, FLOOR + 0.02);
    let down = Vec3::new(0.45, 0.1, FLOOR - 0.05);
    let rpy = Some(Vec3::new(std::f64::consts::PI, 0.0, 0.0));
    let mut plant = Plant::new(
        vec![
            Move { position: Some(over), rpy, ..stay("over it", 2.0) },
            Move { position: Some(down), stiffness: soft, touch: Some(5.0), ..stay("feel", 4.0) },
            Move { force: Vec3::z() * -20.0, stiffness: soft, arrive: false, ..stay("press", 1.0) },
        ],
        None,
        floor,
    );
    while plant.out().index < 2.0 {
        plant.sample();
        assert!(plant.n < 3000, "it felt nothing");
    }
    let felt = plant.out();
    assert!((plant.tip().position.z - FLOOR).abs() < 2e-3, "{}", plant.tip().position);
    plant.run(2.0);
    assert!(plant.out().done);
    // The force is the spring force at the contact plus 20 N.
    let force = floor(plant.tip().position, Vec3::zeros()).z;
    assert!((force - plant.out().push).abs() < 0.3, "{force} {}", plant.out().push);
    assert!(force > 20.0 && force < 26.0, "{force} {felt:?}");
}

/// Fed with 10 N against a damper alone, it goes to the depth that it was told, and the next move begins there.
#[test]
fn what_is_fed_goes_to_its_depth_and_stands_there() {
    let soft = Some([2000.0, 200.0]);
    let n = Vec3::new(0.0, 0.6, 0.8);
    let fed = Move {
        force: n * 10.0,
        stiffness: soft,
        feed: Some(n),
        depth: Some(0.03),
        ..stay("feed", 5.0)
    };
    let mut plant = Plant::new(vec![fed, stay("stand", 0.5)], None, free);
    let before = plant.tip().position;
    plant.run(2.5);
    let out = plant.out();
    assert!(out.done && out.error < 1e-5, "{out:?}");
    let way = plant.tip().position - before;
    assert!((way.dot(&n) - 0.03).abs() < 1e-3, "{way}");
    assert!((way - n * way.dot(&n)).norm() < 1e-3, "{way}");
}

#[test]
fn what_does_not_arrive_fails_and_says_so() {
    let soft = Some([2000.0, 200.0]);
    let rpy = Some(Vec3::new(std::f64::consts::PI, 0.0, 0.0));
    let down = Vec3::new(0.45, 0.1, FLOOR - 0.05);
    let blocked = Move { position: Some(down), rpy, stiffness: soft, ..stay("down", 2.0) };
    let mut plant = Plant::new(vec![blocked, stay("never", 1.0)], None, floor);
    plant.run(2.9);
    assert!(!plant.out().failed);
    plant.run(0.5);
    assert!(plant.out().failed && !plant.out().done && plant.out().index == 0.0);
}

/// A move that is to feel something, or to come to a depth, and does not, fails, whether it is to arrive or not.
#[test]
fn a_touch_that_is_not_felt_and_a_depth_that_is_not_reached_fail() {
    let soft = Some([2000.0, 200.0]);
    let up = Vec3::new(0.45, 0.1, FLOOR + 0.05);
    let rpy = Some(Vec3::new(std::f64::consts::PI, 0.0, 0.0));
    let feel = Move {
        position: Some(up),
        rpy,
        stiffness: soft,
        touch: Some(50.0),
        arrive: false,
        ..stay("feel", 2.0)
    };
    let n = Vec3::z();
    let fed = Move {
        stiffness: soft,
        feed: Some(n),
        depth: Some(0.03),
        arrive: false,
        ..stay("feed without a force", 2.0)
    };
    for first in [feel, fed] {
        let name = first.name.clone();
        let mut plant = Plant::new(vec![first, stay("never", 1.0)], None, free);
        plant.run(2.9);
        assert!(!plant.out().failed && plant.out().index == 0.0, "{name}");
        plant.run(0.5);
        assert!(plant.out().failed && !plant.out().done && plant.out().index == 0.0, "{name}");
    }
}

/// Each move goes to where the work is seen when it begins: spread as told about where it is believed to be, and the same in each run.
#[test]
fn the_work_is_looked_at_when_a_move_begins() {
    let place = Vec3::new(0.45, 0.1, 0.35);
    let to = |name: &str| Move {
        position: Some(Vec3::zeros()),
        frame: Written::Work,
        arrive: false,
        ..stay(name, 0.05)
    };
    let moves: Vec<Move> = (0..100).map(|_| to("there")).collect();
    let run = || {
        let p = ArmParams { work_position: place, work_noise: 1e-3, ..params(moves.clone()) };
        let c = build(ArmParams { ready: Vec::new(), ..p }).unwrap();
        let mut d = vec![0.0; <Progress as Lanes>::N];
        c.initial(&mut [], &mut d);
        let mut ends = Vec::new();
        let u: Vec<f64> = READY.iter().flat_map(|q| [*q, 0.0]).collect();
        for n in 0..10_000 {
            let clock = Clock::at(0.002 * n as f64, 0.002, n);
            let before = Progress::get(&d);
            // The arm does not move: moves that need not arrive continue nevertheless.
            c.update(&clock, &mut d, &u);
            let now = Progress::get(&d);
            if now.index > before.index {
                ends.push(now.position - place);
            }
        }
        ends
    };
    let ends = run();
    assert!(ends.len() >= 90, "{}", ends.len());
    let of = |k: usize| {
        let all = ends.iter().map(|e| e[k]);
        (all.clone().sum::<f64>() / ends.len() as f64, {
            (all.map(|x| x * x).sum::<f64>() / ends.len() as f64).sqrt()
        })
    };
    for k in 0..3 {
        let (mean, spread) = of(k);
        assert!(mean.abs() < 4e-4 && (spread - 1e-3).abs() < 3e-4, "{k}: {mean} {spread}");
    }
    assert_eq!(ends, run());
}

/// Moments that no body has are read with a warning that names link and number; refused on request.
#[test]
fn moments_that_no_body_has_are_a_warning_or_refused() {
    let (own, wrong) = (r#"iyy="0.147" izz="0.0151""#, r#"iyy="0.147" izz="0.9""#);
    let text = arm().replace(own, wrong);
    assert_ne!(text, arm());
    let told = |text: &str| {
        let robot = RobotFile::new("six_axis.urdf", text);
        let p = ArmParams { robot, ..params(vec![stay("a", 1.0)]) };
        let services = linkwork_runtime::Services::default();
        let mut cx = linkwork_runtime::ReadCx::new("Arm", &services);
        let read = ArmParams::read_map(&p.show_map().into(), &mut cx).unwrap();
        assert!(cx.faults.is_empty(), "{:?}", cx.faults);
        (read, cx.warnings)
    };
    assert!(told(&arm()).1.is_empty());
    let (p, warnings) = told(&text);
    let [warning] = &warnings[..] else { panic!("{warnings:?}") };
    let words = ["`Arm.robot`", "six_axis.urdf", "upper_arm", "0.9"];
    assert!(words.iter().all(|w| warning.message.contains(w)), "{}", warning.message);
    assert!(warning.help.as_ref().is_some_and(|h| h.contains("inertia_check: Physical")));
    let mut plant =
        Plant { c: build(p.clone()).unwrap(), ..Plant::new(vec![stay("a", 1.0)], None, free) };
    plant.run(0.1);
    assert!(plant.out().error < 1.0);
    let e = build(ArmParams { inertia_check: InertiaCheck::Physical, ..p }).err().unwrap();
    assert!(e.contains("upper_arm"), "{e}");
}

#[test]
fn outstretched_it_holds_itself_and_says_that_it_is_singular() {
    let c = build(ArmParams { ready: Vec::new(), ..params(vec![stay("stay", 1.0)]) }).unwrap();
    let mut d = vec![0.0; <Progress as Lanes>::N];
    c.initial(&mut [], &mut d);
    let mut y = vec![0.0; 6 + <ArmOut as Lanes>::N];
    let mut u = [0.0; 12];
    u[1] = 0.5;
    c.feedthrough(&d, &u, &mut y);
    let out = ArmOut::get(&y[6..]);
    assert!(out.singular && y.iter().all(|y| y.is_finite()));
    assert!(y[0] < 0.0, "damped");
    u[3] = f64::NAN;
    c.feedthrough(&d, &u, &mut y);
    assert!(y[0].is_nan(), "joints that are no numbers give torques that are none");
}

#[test]
fn what_cannot_be_done_is_refused_before_the_run() {
    let refused = |p: ArmParams, phrases: &[&str]| {
        let e = build(p).err().unwrap();
        assert!(phrases.iter().all(|w| e.contains(w)), "{phrases:?} not in {e}");
    };
    let far = Move { position: Some(Vec3::new(2.0, 0.0, 0.3)), ..stay("far away", 1.0) };
    refused(params(vec![far]), &["far away", "out of reach", "2.0000"]);
    // Both ends are within reach, but between them the wrist is straight and cannot follow the path.
    let over = Vec3::new(0.5, -0.25, 0.45);
    let rpy = Some(Vec3::new(std::f64::consts::PI, 0.0, 0.0));
    let mut p = params(vec![Move { position: Some(over), rpy, ..stay("through the wrist", 2.0) }]);
    p.tool = Vec3::new(0.0, 0.0, 0.11);
    p.ready = [-30.0_f64, 0.0, 100.0, -10.0, 90.0, 0.0].map(f64::to_radians).to_vec();
    refused(p, &["through the wrist", "cannot be followed"]);
    refused(params(Vec::new()), &["`moves` is empty"]);
    let other = Move { holds: Some("brik".into()), ..stay("carry", 1.0) };
    refused(params(vec![other]), &["carry", "brik"]);
    let mut p = params(vec![stay("a", 1.0)]);
    p.tip = "tol".into();
    refused(p, &["tol", "tool"]);
    let mut p = params(vec![stay("a", 1.0)]);
    p.tip = "wrist_1".into();
    p.armature.clear();
    refused(p, &["4 of the robot's 6 joints"]);
    let mut p = params(vec![stay("a", 1.0)]);
    p.ready.pop();
    refused(p, &["5 positions for 6 joints"]);
    let mut p = params(vec![stay("a", 1.0)]);
    p.armature.pop();
    refused(p, &["5 numbers for 6 joints"]);
    let mut p = params(vec![stay("a", 1.0)]);
    p.loads[0].mass = f64::NAN;
    refused(p, &["brick"]);
    let mut p = params(vec![stay("a", 1.0)]);
    p.robot = RobotFile::new("arm.urdf", "<robot name='x'/>");
    refused(p, &[""]);
}
