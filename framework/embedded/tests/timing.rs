//! Time parameterization of paths: closed forms, limits that hold and are used everywhere, infeasible paths.

use crate::support::*;
use linkwork_embedded::multibody::{BodySpec, Builder, Hinge, Limits};
use linkwork_embedded::spatial::{MassProperties, Mat3, Pose, Vec3};
use linkwork_embedded::*;
use std::sync::Arc;

const MASS: f64 = 2.0;

/// A slider along an axis, 2 kg.
fn slider(axis: Vec3) -> Arc<RobotModel> {
    let mut mechanism = Builder::new();
    let mass = MassProperties::new(MASS, Vec3::zeros(), Mat3::identity());
    mechanism.body(BodySpec::new("cart", "world").hinge(Hinge::slider(axis)).mass(mass));
    RobotModel::new(&ModelSpec { mechanism, ..ModelSpec::default() }).unwrap()
}

/// Three links without simplifying symmetry, with limits of their rates and torques.
fn arm() -> Arc<RobotModel> {
    let mut mechanism = Builder::new();
    let mut colliders = Vec::new();
    let axes = [Vec3::new(0.0, -1.0, 0.1), Vec3::new(0.05, -1.0, 0.0), Vec3::new(0.3, -0.2, 1.0)];
    let names = ["world", "upper", "lower", "hand"];
    for (k, axis) in axes.into_iter().enumerate() {
        let inertia = Mat3::from_diagonal(&Vec3::new(0.011, 0.037, 0.041));
        let mass =
            MassProperties::new(2.3 - 0.4 * k as f64, Vec3::new(0.21, 0.013, -0.02), inertia);
        let limits = Limits::position(-3.0, 3.0);
        let limits = Limits { rate: 2.0 + 0.3 * k as f64, effort: [60.0, 25.0, 8.0][k], ..limits };
        let at = if k == 0 { Pose::identity() } else { Pose::translation(0.4, 0.01, 0.0) };
        let body = BodySpec::new(names[k + 1], names[k])
            .hinge(Hinge::pin(axis.normalize()).limits(limits));
        mechanism.body(body.mass(mass).hinge_in_parent(at));
        let rod = Shape::Box { half: Vec3::new(0.18, 0.02, 0.02) };
        let rod = ColliderSpec::new(names[k + 1], names[k + 1], rod);
        colliders.push(rod.at(Pose::translation(0.2, 0.0, 0.0)));
    }
    let wall = Shape::Box { half: Vec3::new(0.05, 0.5, 0.05) };
    colliders.push(ColliderSpec::new("wall", "world", wall).at(Pose::translation(0.9, 0.0, -0.35)));
    let parts = vec![PartSpec::chain("arm", "world", "hand")];
    let mass = MassProperties::new(1.5, Vec3::new(0.01, 0.02, 0.0), Mat3::identity() * 0.01);
    let objects = vec![ObjectSpec { name: "cup".into(), mass }];
    let spec = ModelSpec { mechanism, colliders, parts, objects, ..ModelSpec::default() };
    RobotModel::new(&spec).unwrap()
}

fn limits(model: &RobotModel, rate: f64, acceleration: f64, effort: f64) -> MotionLimits {
    let mut limits = MotionLimits::of(model).acceleration(acceleration);
    limits.rate.fill(rate);
    limits.effort.fill(effort);
    limits
}

fn duration(timed: Timed) -> f64 {
    match timed {
        Timed::Found { duration } => duration,
        Timed::Infeasible { .. } => panic!("{timed:?}"),
    }
}

/// Bang-bang, a trapezoid, and a lift whose two accelerations differ by gravity.
#[test]
fn a_slider_takes_the_time_of_the_closed_forms() {
    let none = f64::INFINITY;
    let (flat, up) = (slider(Vec3::x()), slider(Vec3::z()));
    let plan = |model: &Arc<RobotModel>, way: &[f64], limits: &MotionLimits| {
        let mut robot = Robot::new(model);
        let mut timing = Timing::new(&robot, 4, 400).unwrap();
        duration(timing.plan(&mut robot, way, limits, 0.0).unwrap())
    };
    let near = |ours: f64, known: f64| assert!((ours / known - 1.0).abs() < 1e-9, "{ours} {known}");
    let (d, a, v) = (1.5, 3.0_f64, 1.1);
    near(plan(&flat, &[0.2, 0.2 + d], &limits(&flat, none, a, none)), 2.0 * (d / a).sqrt());
    near(plan(&flat, &[0.2, 0.2 - d], &limits(&flat, none, none, a * MASS)), 2.0 * (d / a).sqrt());
    // The ramps end between two grid points, so the motion is slightly slower than the optimum.
    let trapezoid = plan(&flat, &[0.2, 0.2 + d], &limits(&flat, v, a, none));
    assert!((0.0..1e-4).contains(&(trapezoid / (d / v + v / a) - 1.0)), "{trapezoid}");
    let force = 25.0;
    let (rise, fall) = (force / MASS - 9.81, force / MASS + 9.81);
    let known = (2.0 * d * (1.0 / rise + 1.0 / fall)).sqrt();
    let lift = plan(&up, &[0.0, d], &limits(&up, none, none, force));
    assert!((0.0..1e-4).contains(&(lift / known - 1.0)), "{lift} {known}");
    // The duration with a stop at each corner is the sum of the durations of the pieces.
    let there = plan(&flat, &[0.0, 1.0, 0.4], &limits(&flat, none, a, none));
    let known = 2.0 * (1.0 / a).sqrt() + 2.0 * (0.6 / a).sqrt();
    assert!((0.0..1e-5).contains(&(there / known - 1.0)), "{there} {known}");
    assert_eq!(plan(&flat, &[0.3, 0.3], &limits(&flat, v, a, none)), 0.0);
}

/// Returns the largest ratio to a limit along a timed path at evenly spaced times, the number of times at which all ratios are below 0.99, and the
/// error of q compared with its integrated rates.
fn shares(
    robot: &mut Robot,
    timing: &mut Timing,
    limits: &MotionLimits,
    times: usize,
) -> (f64, f64, f64) {
    let nv = limits.rate.len();
    let (mut q, mut v, mut a) = (vec![0.0; nv], vec![0.0; nv], vec![0.0; nv]);
    let (mut after, mut before) = (q.clone(), q.clone());
    let mut tau = vec![0.0; nv];
    let (mut most, mut slack, mut off) = (0.0_f64, 0, 0.0_f64);
    let (end, h) = (timing.duration(), 1e-6);
    for k in 1..times {
        let t = end * k as f64 / times as f64;
        let (mut x, mut y) = (vec![0.0; nv], vec![0.0; nv]);
        timing.at(t - h, &mut before, &mut x, &mut y).unwrap();
        timing.at(t + h, &mut after, &mut x, &mut y).unwrap();
        timing.at(t, &mut q, &mut v, &mut a).unwrap();
        robot.set_q(&q).unwrap();
        robot.feed_forward(&v, &a, &[], &mut tau).unwrap();
        let mut here = 0.0_f64;
        for j in 0..nv {
            for share in
                [v[j] / limits.rate[j], a[j] / limits.acceleration[j], tau[j] / limits.effort[j]]
            {
                assert!(share.is_finite());
                here = here.max(share.abs());
            }
            off = off.max(((after[j] - before[j]) / (2.0 * h) - v[j]).abs());
        }
        most = most.max(here);
        slack += usize::from(here < 0.99);
    }
    (most, slack as f64 / times as f64, off)
}

const WAY: [[f64; 3]; 4] = [[0.1, 0.3, -0.4], [0.9, -0.5, 0.3], [1.2, 0.4, 1.1], [0.2, 1.2, 0.7]];

/// Every limit holds at ten thousand times between grid points, and at each of them one limit is almost reached, so a faster path is hardly possible.
#[test]
fn limits_hold_everywhere_and_one_of_them_is_always_reached() {
    let model = arm();
    let way = WAY.concat();
    for (round, held) in [(0.0, false), (0.1, false), (0.1, true)] {
        let mut robot = Robot::new(&model);
        if held {
            let cup = model.object("cup").unwrap();
            robot.grasp(model.part("arm").unwrap(), cup, Grasp::Here).unwrap();
        }
        let mut timing = Timing::new(&robot, 4, 600).unwrap();
        let limits = MotionLimits::of(&model).acceleration(30.0);
        let took = duration(timing.plan(&mut robot, &way, &limits, round).unwrap());
        let (most, slack, off) = shares(&mut robot, &mut timing, &limits, 10_007);
        println!(
            "round {round} held {held}: {took:.4} s, at most {most}, slack at {slack:.4} of the times, rates off by {off:.1e}"
        );
        assert!(most <= 1.0 + 1e-9, "{most}");
        // The slack is largest where one limit takes over from another within a section. Measured: at most
        // 0.006.
        assert!(slack < 0.01, "{slack}");
        assert!(off < 1e-4, "{off}");
    }
}

/// With more sections the time approaches the minimum from above; narrower limits take longer; acceleration and rate limits times k² and k take 1/k
/// of the time.
#[test]
fn times_scale_as_they_must() {
    let model = arm();
    let mut robot = Robot::new(&model);
    let way = WAY.concat();
    let free = MotionLimits::of(&model).acceleration(20.0).any_effort();
    let mut plan = |limits: &MotionLimits, sections: usize| {
        let mut timing = Timing::new(&robot, 4, sections).unwrap();
        duration(timing.plan(&mut robot, &way, limits, 0.2).unwrap())
    };
    let mut slow = free.clone();
    slow.rate.iter_mut().for_each(|x| *x /= 3.0);
    slow.acceleration.iter_mut().for_each(|x| *x /= 9.0);
    let (one, three) = (plan(&free, 300), plan(&slow, 300));
    assert!((three / (3.0 * one) - 1.0).abs() < 1e-6, "{one} {three}");
    let mut with_effort = MotionLimits::of(&model).acceleration(20.0);
    with_effort.effort.iter_mut().for_each(|x| *x *= 0.5);
    let times = [75, 150, 300, 600, 1200].map(|n| plan(&with_effort, n));
    println!("{times:?}");
    assert!(times[4] > one, "forces are limits, too");
    // The duration is too long by an error that is proportional to the length of a section, so
    // successive differences halve.
    let steps: Vec<f64> = times.windows(2).map(|t| t[0] - t[1]).collect();
    assert!(
        steps[3] > 0.0 && steps[3] < 0.65 * steps[2] && steps[2] < 0.65 * steps[1],
        "{steps:?}"
    );
    assert!(times[3] / times[4] < 1.004);
}

/// A rounded corner stays within its distance of the path, has continuous rates, and is reported free as samples confirm.
#[test]
fn rounded_corners_stay_near_and_are_proven_free() {
    let model = arm();
    let mut robot = Robot::new(&model);
    let way = WAY.concat();
    let limits = MotionLimits::of(&model).acceleration(20.0).any_effort();
    let (mut q, mut v, mut a) = ([0.0; 3], [0.0; 3], [0.0; 3]);
    let distance = |q: &[f64]| {
        let to = |p: &[[f64; 3]]| {
            let [a, b] = [0, 1].map(|k| Vec3::from(p[k]));
            let (q, d) = (Vec3::from_column_slice(q), b - a);
            let s = ((q - a).dot(&d) / d.norm_squared()).clamp(0.0, 1.0);
            (q - a - d * s).norm()
        };
        WAY.windows(2).map(to).fold(f64::INFINITY, f64::min)
    };
    let mut last = f64::INFINITY;
    for round in [0.01, 0.05, 0.2] {
        let mut timing = Timing::new(&robot, 4, 300).unwrap();
        let took = duration(timing.plan(&mut robot, &way, &limits, round).unwrap());
        assert!(took < last, "{took} {last}");
        last = took;
        let (mut far, mut before) = (0.0_f64, [0.0; 3]);
        for k in 0..=20_000 {
            timing.at(took * f64::from(k) / 20_000.0, &mut q, &mut v, &mut a).unwrap();
            far = far.max(distance(&q));
            let jump = difference(&v, &before);
            assert!(jump < 25.0 * took / 20_000.0 + 1e-9, "{k}: {jump}");
            before = v;
        }
        assert!(
            far <= round * (1.0 + 1e-9) && (far > 0.5 * round || round == 0.2),
            "{far} {round}"
        );
        let told = timing.free(&mut robot, 1e-3).unwrap();
        let mut hit = false;
        for k in 0..=4000 {
            timing.place(f64::from(k) / 4000.0, &mut q).unwrap();
            hit |= robot.collides(&q).unwrap();
        }
        assert_eq!(told == Path::Free, !hit, "{round}: {told:?}");
        if let Path::Hit { at, pair } = told {
            timing.place(at, &mut q).unwrap();
            assert_eq!(robot.first_hit(&q).unwrap(), Some(pair));
        }
        println!("round {round}: {took:.4} s, {told:?}");
    }
}

/// A load that a joint cannot lift: the result gives the position and the factor by which limits fall short, and planning with limits enlarged by
/// this factor succeeds.
#[test]
fn what_is_impossible_is_told_with_what_would_do() {
    let model = slider(Vec3::z());
    let mut robot = Robot::new(&model);
    let mut timing = Timing::new(&robot, 2, 100).unwrap();
    let weak = limits(&model, 1.0, 10.0, 0.8 * MASS * 9.81);
    let told = timing.plan(&mut robot, &[0.0, 1.0], &weak, 0.0).unwrap();
    let Timed::Infeasible { part, share } = told else { panic!("{told:?}") };
    // The motion ends at rest, but the load must still be supported there.
    assert!(part > 0.98 && (share - 1.25).abs() < 1e-9, "{part} {share}");
    assert_eq!(timing.duration(), 0.0);

    let model = arm();
    let mut robot = Robot::new(&model);
    let mut timing = Timing::new(&robot, 4, 300).unwrap();
    let mut weak = MotionLimits::of(&model).acceleration(30.0);
    weak.effort = vec![6.0, 5.0, 2.0];
    let told = timing.plan(&mut robot, &WAY.concat(), &weak, 0.0).unwrap();
    let Timed::Infeasible { part, share } = told else { panic!("{told:?}") };
    let (mut q, mut tau) = (vec![0.0; 3], vec![0.0; 3]);
    timing.place(part, &mut q).unwrap();
    robot.set_q(&q).unwrap();
    robot.gravity_forces(&mut tau).unwrap();
    assert!(tau.iter().zip(&weak.effort).any(|(t, e)| t.abs() > *e), "{tau:?} at {part}");
    for (more, possible) in [(1.0 - 1e-6, false), (1.0 + 1e-3, true)] {
        let mut other = weak.clone();
        other.effort.iter_mut().chain(&mut other.acceleration).for_each(|x| *x *= share * more);
        let told = timing.plan(&mut robot, &WAY.concat(), &other, 0.0).unwrap();
        assert_eq!(matches!(told, Timed::Found { .. }), possible, "{share} {more}: {told:?}");
    }
}

#[test]
fn the_same_bits_no_allocation_and_no_trace() {
    let model = arm();
    let mut robot = Robot::new(&model);
    let own = [0.7, -0.2, 0.5];
    robot.set_q(&own).unwrap();
    let mut timing = Timing::new(&robot, 4, 200).unwrap();
    let limits = MotionLimits::of(&model).acceleration(15.0);
    let mut weak = limits.clone();
    weak.effort.fill(1.0);
    let way = WAY.concat();
    let back: Vec<f64> = WAY.iter().rev().flatten().copied().collect();
    let (mut q, mut v, mut a) = ([0.0; 3], [0.0; 3], [0.0; 3]);
    let (mut tip, mut durations) = (robot.tip_pose(model.part("arm").unwrap()).unwrap(), [0.0; 2]);
    let counted = allocation_counter::measure(|| {
        for took in &mut durations {
            *took = duration(timing.plan(&mut robot, &way, &limits, 0.1).unwrap());
            timing.at(0.3 * *took, &mut q, &mut v, &mut a).unwrap();
            timing.free(&mut robot, 1e-3).unwrap();
            timing.plan(&mut robot, &back, &limits, 0.0).unwrap();
            timing.plan(&mut robot, &back, &weak, 0.0).unwrap();
            timing.plan(&mut robot, &back, &limits, -1.0).unwrap_err();
            timing.place(0.5, &mut q).unwrap();
        }
        tip = robot.tip_pose(model.part("arm").unwrap()).unwrap();
    });
    assert_eq!(counted.count_total, 0, "{counted:?}");
    assert_eq!(durations[0], durations[1]);
    assert_eq!(robot.q(), own);
    let mut fresh = Robot::new(&model);
    fresh.set_q(&own).unwrap();
    assert_eq!(tip, fresh.tip_pose(model.part("arm").unwrap()).unwrap());
    // Another instance with other memory gives the same result.
    let mut other = Timing::new(&fresh, 4, 200).unwrap();
    assert_eq!(duration(other.plan(&mut fresh, &way, &limits, 0.1).unwrap()), durations[0]);
}

#[test]
fn bad_input_is_refused() {
    let model = arm();
    let mut robot = Robot::new(&model);
    assert!(Timing::new(&robot, 1, 100).unwrap_err().to_string().contains("two"));
    assert!(Timing::new(&robot, 4, 10).unwrap_err().to_string().contains("eight"));
    let mut timing = Timing::new(&robot, 3, 100).unwrap();
    let (mut q, mut v, mut a) = ([0.0; 3], [0.0; 3], [0.0; 3]);
    assert!(matches!(timing.at(0.0, &mut q, &mut v, &mut a), Err(RobotError::NoSearch { .. })));
    let good = MotionLimits::of(&model).acceleration(10.0);
    let two = [0.0, 0.0, 0.0, 0.5, 0.5, 0.5];
    let mut say = |way: &[f64], limits: &MotionLimits, round: f64| {
        timing.plan(&mut robot, way, limits, round).unwrap_err().to_string()
    };
    assert!(say(&two[..5], &good, 0.0).contains("numbers"));
    assert!(say(&[], &good, 0.0).contains("numbers"));
    assert!(say(&WAY.concat(), &good, 0.0).contains("reserved"));
    assert!(say(&[0.0, 0.0, 0.0, f64::NAN, 0.5, 0.5], &good, 0.0).contains("NaN"));
    assert!(say(&two, &good, -0.1).contains("round"));
    let mut bad = good.clone();
    bad.rate[1] = 0.0;
    assert!(say(&two, &bad, 0.0).contains("must be positive"));
    bad.rate[1] = f64::NAN;
    assert!(say(&two, &bad, 0.0).contains("must be positive"));
    bad.rate.pop();
    assert!(say(&two, &bad, 0.0).contains("numbers"));
    let free = MotionLimits::of(&model);
    let none = MotionLimits { rate: free.jerk.clone(), effort: free.jerk.clone(), ..free };
    assert!(say(&two, &none, 0.0).contains("speed"));
    // The coordinates of a floating body do not change.
    let mut mechanism = Builder::new();
    let mass = MassProperties::new(1.0, Vec3::zeros(), Mat3::identity());
    mechanism.body(BodySpec::new("b", "world").hinge(Hinge::free()).mass(mass));
    let floating = RobotModel::new(&ModelSpec { mechanism, ..ModelSpec::default() }).unwrap();
    let mut robot = Robot::new(&floating);
    let mut timing = Timing::new(&robot, 2, 100).unwrap();
    let mut way = [floating.multibody().neutral_q(), floating.multibody().neutral_q()].concat();
    let limits = MotionLimits::of(&floating);
    assert_eq!(duration(timing.plan(&mut robot, &way, &limits, 0.0).unwrap()), 0.0);
    way[7 + 4] = 0.5;
    let told = timing.plan(&mut robot, &way, &limits, 0.0).unwrap_err().to_string();
    assert!(told.contains("free hinge"), "{told}");
    let mut foreign = Robot::new(&model);
    let told = timing.plan(&mut foreign, &two, &good, 0.0);
    assert_eq!(told, Err(RobotError::ForeignHandle));
}
