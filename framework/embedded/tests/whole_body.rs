//! Forces of a whole robot with contacts, and the support polygon.

use crate::support::{Rng, difference};
use linkwork_embedded::multibody::{BodySpec, Builder, Hinge};
use linkwork_embedded::spatial::{Force, MassProperties, Mat3, Motion, Pose, Vec3};
use linkwork_embedded::*;
use std::sync::Arc;

const LEGS: [(&str, f64, f64); 4] =
    [("lf", 0.31, 0.14), ("rf", 0.29, -0.15), ("lh", -0.3, 0.15), ("rh", -0.28, -0.13)];
/// Points of the feet in the axes of the shanks.
const FOOT: [f64; 3] = [0.01, 0.0, -0.28];

/// A floating trunk and four legs of three hinges each, without symmetry.
fn quadruped() -> Arc<RobotModel> {
    let mut mechanism = Builder::new();
    let solid = |mass: f64, com: Vec3, size: f64| {
        let d = Vec3::new(1.0, 1.3, 1.7) * (mass * size * size / 6.0);
        MassProperties::new(mass, com, Mat3::from_diagonal(&d))
    };
    let trunk = solid(12.0, Vec3::new(0.02, -0.01, 0.03), 0.5);
    mechanism.body(BodySpec::new("trunk", "world").hinge(Hinge::free()).mass(trunk));
    let mut parts = Vec::new();
    for (leg, x, y) in LEGS {
        let [hip, thigh, shank] = ["hip", "thigh", "shank"].map(|p| format!("{leg}_{p}"));
        let at = Pose::translation(x, y, 0.0);
        let mass = solid(0.8, Vec3::new(0.0, 0.02, 0.0), 0.1);
        let body = BodySpec::new(&hip, "trunk").hinge(Hinge::pin(Vec3::x())).mass(mass);
        mechanism.body(body.hinge_in_parent(at));
        let mass = solid(1.1, Vec3::new(0.0, 0.01, -0.12), 0.2);
        let body = BodySpec::new(&thigh, &hip).hinge(Hinge::pin(Vec3::y())).mass(mass);
        mechanism.body(body.hinge_in_parent(Pose::translation(0.0, y.signum() * 0.06, 0.0)));
        let mass = solid(0.4, Vec3::new(0.01, 0.0, -0.1), 0.2);
        let body = BodySpec::new(&shank, &thigh).hinge(Hinge::pin(Vec3::y())).mass(mass);
        mechanism.body(body.hinge_in_parent(Pose::translation(0.0, 0.0, -0.27)));
        parts.push(PartSpec::chain(leg, "trunk", &shank));
    }
    RobotModel::new(&ModelSpec { mechanism, parts, ..ModelSpec::default() }).unwrap()
}

/// Indices in β of the trunk (which is not actuated), and efforts of all.
fn efforts(model: &RobotModel, most: f64) -> (std::ops::Range<usize>, Vec<f64>) {
    let trunk = model.multibody().body("trunk").unwrap();
    let (_, s) = model.multibody().subhinges().find(|(b, _)| *b == trunk).unwrap();
    let mut effort = vec![most; model.nv()];
    effort[s.v.clone()].fill(0.0);
    (s.v.clone(), effort)
}

/// Bent knees, and a slightly tilted trunk.
fn crouched(model: &RobotModel) -> Vec<f64> {
    let mut q = model.multibody().neutral_q();
    for (_, s) in model.multibody().subhinges().filter(|(_, s)| s.v.len() == 1) {
        let name = s.q.start;
        q[name] = 0.05 * (name as f64).sin();
    }
    for (leg, _, _) in LEGS {
        let at = |part: &str| {
            let body = model.multibody().body(&format!("{leg}_{part}")).unwrap();
            model.multibody().get(body).q().start
        };
        (q[at("thigh")], q[at("shank")]) = (0.7, -1.35);
    }
    q
}

fn touches(model: &RobotModel, friction: f64) -> Vec<Touch> {
    let at = Vec3::from(FOOT);
    let touch = |leg: &str| Touch {
        part: model.part(leg).unwrap(),
        at,
        normal: Vec3::z(),
        friction,
        most: f64::INFINITY,
    };
    LEGS.iter().map(|l| touch(l.0)).collect()
}

struct Found {
    told: Balanced,
    tau: Vec<f64>,
    vdot: Vec<f64>,
    forces: Vec<Vec3>,
}

fn solve(
    robot: &mut Robot,
    v: &[f64],
    touches: &[Touch],
    objectives: &[Objective<'_>],
    effort: &[f64],
) -> Found {
    let nv = v.len();
    let mut whole = WholeBody::new(robot, 4, 4);
    let (mut tau, mut vdot) = (vec![0.0; nv], vec![0.0; nv]);
    let mut forces = vec![Vec3::zeros(); touches.len()];
    let out = (&mut tau[..], &mut vdot[..], &mut forces[..]);
    let told = whole.solve(robot, v, touches, objectives, effort, out).unwrap();
    Found { told, tau, vdot, forces }
}

/// Checks the equations of motion with inverse dynamics, which is independent of the search: it gives the same joint forces.
fn keeps_the_equations(robot: &mut Robot, v: &[f64], touches: &[Touch], found: &Found) -> f64 {
    let pushes: Vec<Push> = (touches.iter().zip(&found.forces))
        .map(|(t, f)| Push::new(t.part, Vec3::zeros(), -*f).at(t.at))
        .collect();
    let mut tau = vec![0.0; v.len()];
    robot.feed_forward(v, &found.vdot, &pushes, &mut tau).unwrap();
    difference(&tau, &found.tau)
}

/// Second difference of a point along the motion: its acceleration.
fn acceleration(
    robot: &mut Robot,
    q: &[f64],
    v: &[f64],
    vdot: &[f64],
    point: impl Fn(&mut Robot) -> Vec3,
) -> Vec3 {
    let h = 1e-4;
    let mut at = |t: f64| {
        // β of a free hinge is in rotating axes, so take half a step with the rates at its middle.
        let d: Vec<f64> = v.iter().zip(vdot).map(|(v, a)| t * v + 0.5 * t * t * a).collect();
        let mut to = q.to_vec();
        robot.model().clone().multibody().integrate(q, &d, &mut to);
        robot.set_q(&to).unwrap();
        point(robot)
    };
    let (a, b, c) = (at(-h), at(0.0), at(h));
    robot.set_q(q).unwrap();
    (a + c - b * 2.0) / (h * h)
}

#[test]
fn a_standing_robot_carries_its_weight() {
    let model = quadruped();
    let mut robot = Robot::new(&model);
    robot.set_q(&crouched(&model)).unwrap();
    let (trunk, effort) = efforts(&model, 200.0);
    let (v, still, touches) = (vec![0.0; model.nv()], vec![0.0; model.nv()], touches(&model, 0.6));
    let objectives = [Objective::new(0, Aim::Posture(&still))];
    let found = solve(&mut robot, &v, &touches, &objectives, &effort);
    assert!(found.told.unbalanced < 1e-8 && found.told.slipping < 1e-8, "{:?}", found.told);
    assert_eq!(found.told.shortfall, 0.0);
    let weight = robot.center_of_mass().0 * 9.81;
    let sum: Vec3 = found.forces.iter().sum();
    assert!((sum - Vec3::z() * weight).norm() < 1e-7 * weight, "{sum}");
    assert!(difference(&found.vdot, &still) < 1e-7);
    assert!(found.tau[trunk].iter().all(|t| *t == 0.0));
    assert!(keeps_the_equations(&mut robot, &v, &touches, &found) < 1e-7);
}

/// In motion: contacts stay in place and the centre of mass accelerates as requested, by second differences of positions; forces are within their
/// pyramids.
#[test]
fn contacts_hold_while_it_moves_and_wishes_come_in_order() {
    let model = quadruped();
    let mut robot = Robot::new(&model);
    let (nv, q, mut rng) = (model.nv(), crouched(&model), Rng(21));
    robot.set_q(&q).unwrap();
    let (_, effort) = efforts(&model, 300.0);
    let touches = touches(&model, 0.7);
    // Project random rates onto rates at which the feet are at rest.
    let mut problem = Priorities::new(nv, 12, 0);
    problem.begin();
    let (mut A, mut J) = (Vec::new(), vec![0.0; 6 * nv]);
    for t in &touches {
        robot.whole_jacobian(t.part, &mut J).unwrap();
        let arm = robot.tip_pose(t.part).unwrap().rotation * t.at;
        for i in 0..3 {
            A.extend((0..nv).map(|j| {
                let w = Vec3::new(J[j], J[nv + j], J[2 * nv + j]);
                J[nv * (3 + i) + j] + w.cross(&arm)[i]
            }));
        }
    }
    problem.level(&A, &[0.0; 12]).unwrap();
    let wished: Vec<f64> = (0..nv).map(|_| rng.within(-1.0, 1.0)).collect();
    let mut eye = vec![0.0; nv * nv];
    (0..nv).for_each(|i| eye[i * nv + i] = 1.0);
    let mut room = Priorities::new(nv, nv, 0);
    room.begin();
    room.level(&A, &[0.0; 12]).unwrap();
    room.level(&eye, &wished).unwrap();
    let v = room.x().to_vec();
    assert!(v.iter().map(|x| x * x).sum::<f64>() > 1.0);

    let asked = Vec3::new(0.8, -0.5, 0.6);
    let posture: Vec<f64> = (0..nv).map(|_| rng.within(-3.0, 3.0)).collect();
    let objectives =
        [Objective::new(1, Aim::Posture(&posture)), Objective::new(0, Aim::Center(asked))];
    let found = solve(&mut robot, &v, &touches, &objectives, &effort);
    assert!(found.told.unbalanced < 1e-7 && found.told.slipping < 1e-6, "{:?}", found.told);
    assert!(keeps_the_equations(&mut robot, &v, &touches, &found) < 1e-6);
    let c = acceleration(&mut robot, &q, &v, &found.vdot, |r| r.center_of_mass().1);
    assert!((c - asked).norm() < 1e-5, "{c}");
    for t in &touches {
        let a = acceleration(&mut robot, &q, &v, &found.vdot, |r| {
            r.tip_pose(t.part).unwrap().transform_point(&t.at)
        });
        assert!(a.norm() < 1e-5, "{a}");
    }
    for f in &found.forces {
        assert!(f.x.hypot(f.y) <= 0.7 * f.z + 1e-9, "{f}");
    }
    // If the priorities are reversed, the posture is nearer and the centre of mass misses its goal.
    let turned = [Objective::new(0, Aim::Posture(&posture)), Objective::new(1, Aim::Center(asked))];
    let other = solve(&mut robot, &v, &touches, &turned, &effort);
    let far = |f: &Found| f.vdot.iter().zip(&posture).map(|(a, b)| (a - b).powi(2)).sum::<f64>();
    assert!(far(&other) < 0.99 * far(&found));
    let c = acceleration(&mut robot, &q, &v, &other.vdot, |r| r.center_of_mass().1);
    assert!((c - asked).norm() > 0.1);
    // Check the acceleration of a tip by second differences, too. Its foot is off the ground.
    let part = touches[1].part;
    let motion = Motion::new(Vec3::new(0.5, -1.0, 2.0), Vec3::new(1.0, 0.3, 2.0));
    let objectives = [Objective::new(0, Aim::Tip { part, motion, rows: Rows::Linear })];
    let three = [touches[0], touches[2], touches[3]];
    let found = solve(&mut robot, &v, &three, &objectives, &effort);
    let a = acceleration(&mut robot, &q, &v, &found.vdot, |r| r.tip_pose(part).unwrap().position);
    assert!((a - motion.linear).norm() < 1e-5, "{a}");
}

/// The result respects friction: the centre of mass accelerates as far as the pyramid allows.
#[test]
fn friction_bounds_what_is_asked() {
    let model = quadruped();
    let mut robot = Robot::new(&model);
    robot.set_q(&crouched(&model)).unwrap();
    let (_, effort) = efforts(&model, f64::INFINITY);
    let (v, touches) = (vec![0.0; model.nv()], touches(&model, 0.4));
    let objectives = [
        Objective::new(0, Aim::Center(Vec3::new(0.0, 0.0, 0.0))).weight(1.0),
        Objective::new(1, Aim::Center(Vec3::new(9.0, 0.0, 0.0))),
    ];
    let still = solve(&mut robot, &v, &touches, &objectives, &effort);
    let sum: Vec3 = still.forces.iter().sum();
    assert!(sum.x.abs() < 1e-6, "the level before holds: {sum}");
    let found = solve(&mut robot, &v, &touches, &objectives[1..], &effort);
    let sum: Vec3 = found.forces.iter().sum();
    let mut edge = 0.0_f64;
    for f in &found.forces {
        assert!(f.x.abs() + f.y.abs() <= 0.4 * f.z + 1e-7, "{f}");
        edge = edge.max((f.x.abs() + f.y.abs()) / (0.4 * f.z));
    }
    assert!(sum.x > 0.3 * sum.z && edge > 1.0 - 1e-6, "{sum} {edge}");
    assert!(keeps_the_equations(&mut robot, &v, &touches, &found) < 1e-6);
}

/// Joints that are too weak, and one foot that cannot carry the whole robot: reported, with the best possible result.
#[test]
fn what_cannot_be_is_told() {
    let model = quadruped();
    let mut robot = Robot::new(&model);
    robot.set_q(&crouched(&model)).unwrap();
    let (v, still, all) = (vec![0.0; model.nv()], vec![0.0; model.nv()], touches(&model, 0.6));
    let objectives = [Objective::new(0, Aim::Posture(&still))];
    let (_, weak) = efforts(&model, 2.0);
    // With contacts only, the rest of the robot may fall, and the task is satisfied. If a task also keeps the trunk in
    // place, the joints saturate.
    let found = solve(&mut robot, &v, &all, &objectives, &weak);
    let most = |f: &Found, e: &[f64]| {
        f.tau.iter().zip(e).filter(|x| *x.1 > 0.0).map(|(t, e)| t.abs() / e).fold(0.0, f64::max)
    };
    assert!(most(&found, &weak) <= 1.0 + found.told.shortfall + 1e-9);
    assert!(keeps_the_equations(&mut robot, &v, &all, &found) < 1e-6);
    assert!(difference(&found.vdot, &still) > 0.1, "2 N m do not carry it");
    // The trunk falls with at most 1 N on each foot, as its acceleration shows.
    let soft: Vec<Touch> = all.iter().map(|t| Touch { most: 1.0, ..*t }).collect();
    let (_, strong) = efforts(&model, 500.0);
    let found = solve(&mut robot, &v, &soft, &objectives, &strong);
    let greatest = found.forces.iter().map(|f| f.z).fold(0.0, f64::max);
    assert!(greatest <= (1.0 + found.told.shortfall) * (1.0 + 1e-9), "{greatest} {:?}", found.told);
    // A trunk on a free hinge without feet on the ground falls freely.
    let none = solve(&mut robot, &v, &[], &[], &strong);
    assert!(none.told.unbalanced < 1e-8);
    let c = acceleration(&mut robot, &crouched(&model), &v, &none.vdot, |r| r.center_of_mass().1);
    assert!((c - Vec3::z() * -9.81).norm() < 1e-5, "{c}");
    // Two contacts of one foot are consistent, because the foot is a rigid body. A contact whose normal points down
    // cannot support the robot.
    let bad = [Touch { normal: Vec3::z() * 2.0, ..all[0] }];
    let mut whole = WholeBody::new(&robot, 1, 1);
    let nv = model.nv();
    let (mut tau, mut vdot, mut f) = (vec![0.0; nv], vec![0.0; nv], [Vec3::zeros()]);
    let mut say = |v: &[f64], t: &[Touch], w: &[Objective<'_>], e: &[f64]| {
        let out = (&mut tau[..], &mut vdot[..], &mut f[..t.len().min(1)]);
        whole.solve(&mut robot, v, t, w, e, out).unwrap_err().to_string()
    };
    assert!(say(&v, &bad, &[], &strong).contains("unit vector"));
    assert!(say(&v, &[Touch { friction: 0.0, ..all[0] }], &[], &strong).contains("friction"));
    assert!(say(&v, &[Touch { most: -1.0, ..all[0] }], &[], &strong).contains("force"));
    assert!(say(&v, &all, &[], &strong).contains("reserved"));
    assert!(say(&v[1..], &[], &[], &strong).contains("numbers"));
    assert!(say(&v, &[], &[], &strong[1..]).contains("numbers"));
    let nan = Objective::new(0, Aim::Center(Vec3::repeat(f64::NAN)));
    assert!(say(&v, &[], &[nan], &strong).contains("NaN"));
    assert!(say(&v, &[], &[objectives[0].weight(0.0)], &strong).contains("weight"));
    let mut negative = strong.clone();
    negative[9] = -1.0;
    assert!(say(&v, &[], &[], &negative).contains("effort"));
}

#[test]
fn the_same_bits_without_allocation() {
    let model = quadruped();
    let mut robot = Robot::new(&model);
    robot.set_q(&crouched(&model)).unwrap();
    let (_, effort) = efforts(&model, 60.0);
    let (v, touches) = (model.multibody().random_v(4), touches(&model, 0.5));
    let still = vec![0.0; model.nv()];
    let objectives = [
        Objective::new(0, Aim::Center(Vec3::new(0.3, 0.0, 0.1))),
        Objective::new(3, Aim::Posture(&still)).weight(0.1),
    ];
    let mut whole = WholeBody::new(&robot, 4, 4);
    let mut kept = [vec![0.0; model.nv()], vec![0.0; model.nv()]];
    let (mut vdot, mut forces) = (still.clone(), vec![Vec3::zeros(); 4]);
    let mut control = RateControl::new(&robot, 2, 1);
    let mut residuals = [0.0; 2];
    let guards = Guards { horizon: 0.1, manipulable: &[(touches[0].part, 1e-3)] };
    let counted = allocation_counter::measure(|| {
        for tau in &mut kept {
            let out = (&mut tau[..], &mut vdot[..], &mut forces[..]);
            whole.solve(&mut robot, &v, &touches, &objectives, &effort, out).unwrap();
            control.solve(&mut robot, &objectives, &guards, &mut vdot, &mut residuals).unwrap();
        }
    });
    assert_eq!(counted.count_total, 0, "{counted:?}");
    assert_eq!(kept[0], kept[1]);
    let f = Force::new(Vec3::zeros(), forces[0]);
    assert!(f.force.norm() > 0.0);
}

/// Corners computed by hand, a circle, lines and points; the margin by brute force.
#[test]
fn the_support_polygon_holds_all_points() {
    let mut hull = [[0.0; 2]; 200];
    let mut points = [[0.0, 0.0], [2.0, 0.1], [1.0, 0.5], [1.9, 1.2], [0.1, 1.0], [1.0, 0.05]];
    let n = support_polygon(&mut points, &mut hull);
    assert_eq!(hull[..n], [[0.0, 0.0], [2.0, 0.1], [1.9, 1.2], [0.1, 1.0]]);
    // Test a unit square with a point 0.2 inside an edge, and with a point outside of a corner.
    let square = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]];
    assert!((support_margin(&square, [0.5, 0.2]) - 0.2).abs() < 1e-15);
    assert!((support_margin(&square, [1.3, 1.4]) + 0.5).abs() < 1e-15);
    let mut rng = Rng(8);
    for _ in 0..50 {
        let mut points: Vec<[f64; 2]> =
            (0..60).map(|_| [rng.within(-1.0, 1.0), rng.within(-0.5, 0.7)]).collect();
        let n = support_polygon(&mut points, &mut hull);
        let polygon = &hull[..n];
        assert!(points.iter().all(|p| support_margin(polygon, *p) > -1e-12));
        let p = [rng.within(-0.3, 0.3), rng.within(-0.2, 0.2)];
        // Compare with the support function of the points, evaluated in directions all around.
        let margin = (0..20_000)
            .map(|k| {
                let (s, c) = (f64::from(k) * std::f64::consts::TAU / 20_000.0).sin_cos();
                let far = points.iter().map(|x| c * x[0] + s * x[1]).fold(f64::MIN, f64::max);
                far - c * p[0] - s * p[1]
            })
            .fold(f64::INFINITY, f64::min);
        assert!((support_margin(polygon, p) - margin).abs() < 1e-4);
    }
    let mut line = [[0.0, 0.0], [2.0, 2.0], [1.0, 1.0], [0.0, 0.0]];
    let n = support_polygon(&mut line, &mut hull);
    assert_eq!(hull[..n], [[0.0, 0.0], [2.0, 2.0]]);
    assert!((support_margin(&hull[..n], [1.0, 1.0])).abs() < 1e-15);
    assert!((support_margin(&hull[..n], [1.0, 0.0]) + 0.5_f64.sqrt()).abs() < 1e-15);
    let mut same = [[0.3, 0.4]; 3];
    assert_eq!(support_polygon(&mut same, &mut hull), 1);
    assert!((support_margin(&hull[..1], [0.0, 0.0]) + 0.5).abs() < 1e-15);
    assert_eq!(support_polygon(&mut [[f64::NAN, 0.0]], &mut hull), 0);
    assert_eq!(support_margin(&[], [0.0, 0.0]), f64::NEG_INFINITY);
}
