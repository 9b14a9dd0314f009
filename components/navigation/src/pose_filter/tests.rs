//! Errors have the covariance that the filter says, on drives that are made up with the noise that it believes.
use super::*;
use linkwork_runtime::noise;
use linkwork_spatial::nalgebra::SMatrix;

const DT: f64 = 0.1;
const G: f64 = 3.72;

fn instruments() -> Instruments {
    let pitch = Quat::from_scaled_axis(Vec3::y() * 0.6);
    // The mount looks along x, so the lens has the axes right, down, ahead.
    let lens = Quat::from_basis_unchecked(&[-Vec3::y(), -Vec3::z(), Vec3::x()]);
    Instruments {
        gyro: 3e-4,
        gyro_walk: 1e-6,
        wheels: Vec3::new(0.03, 0.02, 0.05),
        slip: [0.1, 30.0],
        level: 0.01,
        sun: 0.02,
        reach: 1.2,
        height: 0.75,
        eye: Pose::new(pitch * lens, Vec3::new(0.9, 0.2, 1.4)),
        gate: 1e9,
        // The planet rotates about fifty times as fast as Mars, so that its rotation has an effect
        // within minutes.
        turning: Vec3::new(2e-3, -1e-3, 2.5e-3),
    }
}

fn start() -> Start {
    Start { position: 0.02, tilt: 0.02, heading: 0.02, bias: 2e-5, scale: 0.01 }
}

/// Standard deviations of a camera's motion, m and rad.
const SEEN: [f64; 6] = [0.003, 0.002, 0.004, 1e-3, 1.5e-3, 1e-3];

/// Which instruments a drive has beside wheels and gyroscopes.
#[derive(Clone, Copy)]
struct With {
    camera: bool,
    level: bool,
    sun: bool,
}

struct Drive {
    filter: PoseFilter,
    truth: Pose,
    slip: f64,
    way: f64,
}

/// A drive of a time in which everything is drawn from what the filter believes.
fn drive(trial: u64, seconds: f64, with: With) -> Drive {
    let (i, s) = (instruments(), start());
    let draw = |n: u64, lane: u32| noise::normal(trial + 1000, n, lane);
    let three = |n: u64, lane: u32| Vec3::new(draw(n, lane), draw(n, lane + 1), draw(n, lane + 2));
    // The initial error is drawn from the deviations of the start.
    let believed =
        Pose::new(Quat::from_scaled_axis(Vec3::new(0.03, -0.05, 0.4)), Vec3::new(1.0, -2.0, 0.3));
    let off = three(0, 0).component_mul(&Vec3::new(s.tilt, s.tilt, s.heading));
    let mut truth = Pose::new(
        Quat::from_scaled_axis(off) * believed.rotation,
        believed.position + three(0, 3) * s.position,
    );
    let mut bias = three(0, 6) * s.bias;
    let mut slip = draw(0, 9) * i.slip[0];
    let scale = draw(0, 10) * s.scale;
    let mut filter = PoseFilter::new(believed, &s, i.slip[0]);
    let (mut before, mut way) = (truth, 0.0);
    let sun = Vec3::new(0.5, -0.4, 0.7).normalize();
    let keep = (-DT / i.slip[1]).exp();
    for n in 1..=(seconds / DT).round() as u64 {
        let t = n as f64 * DT;
        let w = Vec3::new(0.05 * (0.9 * t).sin(), 0.06 * (0.7 * t).cos(), 0.08 * (0.11 * t).sin());
        let speed = if t % 40.0 < 32.0 { 0.25 } else { 0.0 };
        let felt = w + truth.rotation.inverse() * i.turning;
        let gyro = felt + bias + three(n, 0) * i.gyro;
        let rates = Rates { gyro, speed, change: Vec3::zeros() };
        filter.go(&i, &rates, DT);
        // The true pose follows the same equations as the filter.
        let body = Vec3::new((1.0 - slip) * speed, 0.0, 0.0) + w.cross(&Vec3::z()) * i.height;
        let grown = (speed.abs() + i.reach * w.norm()) * DT;
        let half = truth.rotation * Quat::from_scaled_axis(w * (0.5 * DT));
        truth.position +=
            half * body * DT + truth.rotation * three(n, 3).component_mul(&i.wheels) * grown.sqrt();
        truth.rotation *= Quat::from_scaled_axis(w * DT);
        bias += three(n, 6) * (i.gyro_walk * DT.sqrt());
        slip = keep * slip + draw(n, 9) * i.slip[0] * (1.0 - keep * keep).sqrt();
        way += speed * DT;
        if n % 10 != 0 {
            continue;
        }
        if with.level {
            let off = Vec3::new(draw(n, 10), draw(n, 11), 0.0) * i.level;
            let force = truth.rotation.inverse() * (Vec3::z() * G);
            filter.level(&i, &(filter.pose.rotation * force + off * G));
        }
        if with.sun {
            let off = three(n, 13) * i.sun;
            let seen = truth.rotation.inverse() * (sun + off.cross(&sun));
            filter.sun(&i, &seen, &sun);
        }
        if with.camera {
            let X = (before * i.eye).inverse() * (truth * i.eye);
            let e = [0, 1, 2, 3, 4, 5].map(|k| SEEN[k] * draw(n, 16 + k as u32));
            let turn = Quat::from_scaled_axis(Vec3::new(e[3], e[4], e[5]));
            let t = X.position * (1.0 + scale) + Vec3::new(e[0], e[1], e[2]);
            let variance = Vector6::from_fn(|k, _| SEEN[k] * SEEN[k]);
            let covariance = Matrix6::from_diagonal(&variance);
            let X_01 = Pose::new(turn * X.rotation, t);
            let motion = Motion { X_01, covariance, agree: 40, matches: 50 };
            assert!(filter.see(&i, &motion));
            filter.remember();
            before = truth;
        }
    }
    Drive { filter, truth, slip, way }
}

/// δp, θ of a drive's end.
fn error(d: &Drive) -> Vector6<f64> {
    let p = d.truth.position - d.filter.pose.position;
    let q = (d.truth.rotation * d.filter.pose.rotation.inverse()).scaled_axis();
    Vector6::new(p.x, p.y, p.z, q.x, q.y, q.z)
}

#[test]
fn errors_have_the_covariance_that_it_says_with_every_set_of_instruments() {
    const TRIALS: u32 = 60;
    for (with, name) in [
        (With { camera: false, level: false, sun: false }, "wheels and gyroscopes"),
        (With { camera: false, level: true, sun: true }, "with accelerometers and Sun"),
        (With { camera: true, level: false, sun: false }, "with a camera"),
        (With { camera: true, level: true, sun: true }, "with all"),
    ] {
        let (mut all, mut slip, mut square) = (0.0, 0.0, 0.0);
        for trial in 0..TRIALS {
            let d = drive(u64::from(trial), 200.0, with);
            let part = SMatrix::<f64, 6, 6>::from_fn(|a, b| d.filter.covariance[a][b]);
            let e = error(&d);
            all += e.dot(&(part.try_inverse().unwrap() * e));
            slip += (d.slip - d.filter.slip).powi(2) / d.filter.covariance[S][S];
            square += e.fixed_rows::<3>(0).norm_squared();
            assert!(d.way > 35.0);
        }
        let n = f64::from(TRIALS);
        let off = (square / n).sqrt();
        println!("{name}: NEES {:.2} of 6, slip {:.2} of 1, {off:.3} m", all / n, slip / n);
        // The means of 60 drives have standard deviations of √(12/60) = 0.45 and √(2/60) = 0.18.
        assert!((all / n - 6.0).abs() < 1.4 && (slip / n - 1.0).abs() < 0.55, "{name}");
    }
}

#[test]
fn a_camera_makes_the_drift_smaller_and_tells_slip() {
    let bare = With { camera: false, level: true, sun: true };
    let mut mean = [0.0, 0.0];
    for (k, with) in [bare, With { camera: true, ..bare }].into_iter().enumerate() {
        for trial in 0..20 {
            let d = drive(trial, 100.0, with);
            mean[k] += error(&d).fixed_rows::<3>(0).norm() / 20.0;
            let sigma = d.filter.covariance[S][S].sqrt();
            assert!(if with.camera { sigma < 0.06 } else { sigma > 0.099 }, "{sigma}");
        }
    }
    println!("drift {:.3} m without a camera, {:.3} m with", mean[0], mean[1]);
    assert!(4.0 * mean[1] < mean[0]);
}

#[test]
fn a_motion_that_cannot_be_is_left_out_and_changes_nothing() {
    let i = Instruments { gate: 40.0, ..instruments() };
    let mut filter = PoseFilter::new(Pose::identity(), &start(), i.slip[0]);
    (0..10).for_each(|_| filter.go(&i, &Rates { speed: 0.25, ..Rates::default() }, DT));
    let kept = filter;
    let variance = Vector6::from_fn(|k, _| SEEN[k] * SEEN[k]);
    let covariance = Matrix6::from_diagonal(&variance);
    let motion = |X_01| Motion { X_01, covariance, agree: 40, matches: 50 };
    assert!(!filter.see(&i, &motion(Pose::translation(0.0, 0.0, 3.0))));
    assert_eq!(filter, kept);
    assert!(filter.see(&i, &motion(filter.expected(&i))));
    // The estimate does not change, and its covariance decreases.
    assert!((filter.pose.position - kept.pose.position).norm() < 1e-12);
    assert!(filter.covariance[P][P] < 0.1 * kept.covariance[P][P] + 4.1e-4);
    let none = Matrix6::zeros();
    assert!(!filter.see(&i, &Motion { covariance: none, ..motion(Pose::identity()) }));
}
