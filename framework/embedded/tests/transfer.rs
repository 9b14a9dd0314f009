//! Motions between two states with limits of rate, acceleration and jerk.

use crate::support::*;
use linkwork_embedded::multibody::{BodySpec, Builder, Hinge, Limits};
use linkwork_embedded::spatial::{MassProperties, Mat3, Vec3};
use linkwork_embedded::*;
use std::sync::Arc;

/// Parallel sliders with these position limits.
fn sliders(n: usize, limit: f64) -> Arc<RobotModel> {
    let mut mechanism = Builder::new();
    let mass = MassProperties::new(1.0, Vec3::zeros(), Mat3::identity());
    for k in 0..n {
        let hinge = Hinge::slider(Vec3::x()).limits(Limits::position(-limit, limit));
        mechanism.body(BodySpec::new(format!("s{k}"), "world").hinge(hinge).mass(mass));
    }
    RobotModel::new(&ModelSpec { mechanism, ..ModelSpec::default() }).unwrap()
}

fn limits(model: &RobotModel, rate: f64, acceleration: f64, jerk: f64) -> MotionLimits {
    let mut limits = MotionLimits::of(model).acceleration(acceleration).jerk(jerk);
    limits.rate.fill(rate);
    limits
}

fn duration(told: Transferred) -> f64 {
    match told {
        Transferred::Found { duration } => duration,
        Transferred::LeavesLimits { .. } => panic!("{told:?}"),
    }
}

/// The double-S profile of a move from rest to rest, computed by hand.
fn double_s(d: f64, v: f64, a: f64, j: f64) -> f64 {
    // Reduce the limits of acceleration and rate to the values that are reached.
    let a = if v * j < a * a { (v * j).sqrt() } else { a };
    let ramp = v / a + a / j;
    if d >= v * ramp {
        return d / v + ramp;
    }
    // The motion does not reach its rate limit. It reaches the acceleration limit if the distance
    // is long enough.
    if d >= 2.0 * a * a * a / (j * j) {
        return a / j + ((a / j) * (a / j) + 4.0 * d / a).sqrt();
    }
    4.0 * (d / (2.0 * j)).cbrt()
}

#[test]
fn from_rest_to_rest_it_is_the_double_s() {
    let model = sliders(1, 1e3);
    let mut transfer = Transfer::new(&Robot::new(&model));
    let rest = [0.0];
    let mut kinds = [0; 3];
    for (d, v, a, j) in
        [(10.0, 1.3, 2.0, 7.0), (2.0, 5.0, 1.0, 4.0), (0.01, 5.0, 3.0, 2.0), (4.0, 1.0, 9.0, 2.5)]
    {
        let known = double_s(d, v, a, j);
        for side in [-1.0, 1.0] {
            let from = MotionState { q: &[0.3], v: &rest, vdot: &rest };
            let to = MotionState { q: &[0.3 + side * d], v: &rest, vdot: &rest };
            let took = duration(transfer.plan(&from, &to, &limits(&model, v, a, j)).unwrap());
            assert!((took / known - 1.0).abs() < 1e-9, "{d} {v} {a} {j}: {took} {known}");
        }
        kinds[usize::from(d < v * (v / a + a / j)) + usize::from(d < 2.0 * a.powi(3) / (j * j))] +=
            1;
    }
    assert!(kinds.iter().all(|k| *k > 0), "{kinds:?}");
}

/// Three thousand random pairs of states: both ends reached, cubics without jumps, limits satisfied, all coordinates synchronized.
#[test]
fn between_random_states_limits_are_kept_and_ends_are_met() {
    const N: usize = 3;
    let model = sliders(N, 1e6);
    let mut transfer = Transfer::new(&Robot::new(&model));
    let mut random = Rng(11);
    let (mut most, mut met, mut jumps, mut slowest) = ([0.0_f64; 3], 0.0_f64, 0.0_f64, 0);
    for case in 0..3000 {
        let mut limits = limits(&model, 1.0, 1.0, 1.0);
        for k in 0..N {
            limits.rate[k] = random.within(0.3, 3.0);
            limits.acceleration[k] = random.within(0.3, 5.0);
            limits.jerk[k] = random.within(0.5, 20.0);
        }
        let mut state = |inside: f64| {
            let q: Vec<f64> = (0..N).map(|_| random.within(-4.0, 4.0)).collect();
            let a: Vec<f64> = (0..N)
                .map(|k| inside * limits.acceleration[k] * random.within(-1.0, 1.0))
                .collect();
            // Reduce the rate so that the acceleration can still be brought to zero.
            let v: Vec<f64> = (0..N)
                .map(|k| {
                    let room = limits.rate[k] - a[k] * a[k] / (2.0 * limits.jerk[k]);
                    inside * room.max(0.0) * random.within(-1.0, 1.0)
                })
                .collect();
            let fits = (0..N).all(|k| a[k] * a[k] / (2.0 * limits.jerk[k]) < limits.rate[k]);
            (q, v, a, fits)
        };
        let (a, b) = (state(0.9), state(if case % 3 == 0 { 0.0 } else { 0.9 }));
        if !a.3 || !b.3 {
            continue;
        }
        let from = MotionState { q: &a.0, v: &a.1, vdot: &a.2 };
        let to = MotionState { q: &b.0, v: &b.1, vdot: &b.2 };
        let told = transfer.plan(&from, &to, &limits);
        let took = duration(told.unwrap_or_else(|e| panic!("case {case}: {e}")));
        let (mut q, mut v, mut w) = ([0.0; N], [0.0; N], [0.0; N]);
        let mut last = ([0.0; N], [0.0; N], [0.0; N]);
        const TIMES: usize = 211;
        for t in 0..=TIMES {
            let time = took * t as f64 / TIMES as f64;
            transfer.at(time, &mut q, &mut v, &mut w).unwrap();
            if t == 0 {
                let off = difference(&q, &a.0) + difference(&v, &a.1) + difference(&w, &a.2);
                met = met.max(off);
            } else {
                let h = took / TIMES as f64;
                for k in 0..N {
                    // The mean rate between two rows must equal the mean of their rates, within the
                    // effect of the jerk.
                    let mean = (q[k] - last.0[k]) / h - 0.5 * (v[k] + last.1[k]);
                    jumps = jumps.max(mean.abs() / (limits.jerk[k] * h * h / 4.0 + 1e-7));
                    let jerk = (w[k] - last.2[k]) / h / limits.jerk[k];
                    most[2] = most[2].max(jerk.abs());
                    most[1] = most[1].max(w[k].abs() / limits.acceleration[k]);
                    most[0] = most[0].max(v[k].abs() / limits.rate[k]);
                }
            }
            last = (q, v, w);
        }
        met = met.max(difference(&q, &b.0) + difference(&v, &b.1) + difference(&w, &b.2));
        slowest += 1;
    }
    println!("{slowest} cases: shares {most:?}, ends off by {met:.1e}, jumps {jumps:.2}");
    assert!(slowest > 2000);
    assert!(most.iter().all(|x| *x < 1.0 + 1e-6), "{most:?}");
    assert!(met < 1e-6, "{met}");
    assert!(jumps <= 1.0, "{jumps}");
}

/// Coordinates outside their limits at the start come inside, and stay there.
#[test]
fn a_start_outside_limits_is_brought_inside() {
    let model = sliders(1, 1e3);
    let mut transfer = Transfer::new(&Robot::new(&model));
    let limits = limits(&model, 1.0, 2.0, 5.0);
    let from = MotionState { q: &[0.0], v: &[3.0], vdot: &[-4.0] };
    let to = MotionState { q: &[5.0], v: &[0.0], vdot: &[0.0] };
    let took = duration(transfer.plan(&from, &to, &limits).unwrap());
    let (mut q, mut v, mut a) = ([0.0], [0.0], [0.0]);
    let mut inside = false;
    for k in 0..=1000 {
        transfer.at(took * f64::from(k) / 1000.0, &mut q, &mut v, &mut a).unwrap();
        let now = v[0].abs() <= 1.0 + 1e-9 && a[0].abs() <= 2.0 + 1e-9;
        assert!(now || !inside, "{k}: {v:?} {a:?}");
        inside = now;
    }
    assert!(inside && (q[0] - 5.0).abs() < 1e-9);
}

#[test]
fn one_that_swings_too_far_is_told_and_bad_input_is_refused() {
    let model = sliders(2, 1.0);
    let robot = Robot::new(&model);
    let mut transfer = Transfer::new(&robot);
    let good = limits(&model, 2.0, 2.0, 5.0);
    let zero = [0.0; 2];
    // The joint can come to rest only 1 m further on or more.
    let from = MotionState { q: &[0.5, 0.0], v: &[1.9, 0.0], vdot: &zero };
    let to = MotionState { q: &[0.6, 0.0], v: &zero, vdot: &zero };
    let told = transfer.plan(&from, &to, &good).unwrap();
    let Transferred::LeavesLimits { dof: 0, value, .. } = told else { panic!("{told:?}") };
    let (mut q, mut v, mut a) = ([0.0; 2], [0.0; 2], [0.0; 2]);
    let mut far = 0.0_f64;
    for k in 0..=5000 {
        let t = transfer.duration() * f64::from(k) / 5000.0;
        transfer.at(t, &mut q, &mut v, &mut a).unwrap();
        far = far.max(q[0]);
    }
    assert!(value > 1.0 && (far - value).abs() < 1e-5, "{far} {value}");
    let rest = MotionState { q: &[0.5, 0.5], v: &zero, vdot: &zero };
    let mut say = |to: &MotionState<'_>, limits: &MotionLimits| {
        transfer.plan(&rest, to, limits).unwrap_err().to_string()
    };
    assert!(say(&MotionState { q: &[0.1], ..rest }, &good).contains("numbers"));
    assert!(say(&MotionState { q: &[0.1, f64::NAN], ..rest }, &good).contains("NaN"));
    assert!(say(&MotionState { v: &[3.0, 0.0], ..rest }, &good).contains("rate at the end"));
    assert!(
        say(&MotionState { vdot: &[3.0, 0.0], ..rest }, &good).contains("acceleration at the end")
    );
    let tight = MotionState { v: &[1.9, 0.0], vdot: &[-1.9, 0.0], ..rest };
    assert!(say(&tight, &good).contains("rate at the end"));
    let endless = MotionLimits::of(&model);
    assert!(say(&MotionState { q: &[0.1, 0.5], ..rest }, &endless).contains("a moving coordinate"));
    let mut none = good.clone();
    none.jerk[0] = 0.0;
    assert!(say(&tight, &none).contains("must be positive"));
    // Coordinates that do not move do not need limits or time.
    assert_eq!(duration(transfer.plan(&rest, &rest, &endless).unwrap()), 0.0);
}

#[test]
fn the_same_bits_without_allocation() {
    let model = sliders(3, 1e3);
    let mut transfer = Transfer::new(&Robot::new(&model));
    let limits = limits(&model, 1.0, 2.0, 9.0);
    let a = MotionState { q: &[0.0, 1.0, -2.0], v: &[0.2, -0.4, 0.0], vdot: &[0.0, 0.5, 0.1] };
    let b = MotionState { q: &[2.0, 0.7, 1.0], v: &[0.0, 0.1, -0.3], vdot: &[0.2, 0.0, 0.0] };
    // The first call may allocate.
    duration(transfer.plan(&a, &b, &limits).unwrap());
    let (mut q, mut v, mut w) = ([0.0; 3], [0.0; 3], [0.0; 3]);
    let mut kept = Vec::with_capacity(20);
    let counted = allocation_counter::measure(|| {
        for _ in 0..2 {
            let took = duration(transfer.plan(&a, &b, &limits).unwrap());
            transfer.at(0.4 * took, &mut q, &mut v, &mut w).unwrap();
            kept.extend([took, q[0], q[1], v[2], w[1]]);
            transfer.plan(&b, &a, &limits).unwrap();
            transfer.plan(&MotionState { v: &[f64::NAN; 3], ..a }, &b, &limits).unwrap_err();
        }
    });
    assert_eq!(counted.count_total, 0, "{counted:?}");
    assert_eq!(kept[..5], kept[5..]);
}
