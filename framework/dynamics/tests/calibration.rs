//! Calibration: identifiable parameters, inertial parameters, frames.

use linkwork_dynamics::calibration::*;
use linkwork_dynamics::multibody::{BodySpec, Builder, Hinge, Multibody};
use linkwork_dynamics::spatial::nalgebra::DMatrix;
use linkwork_dynamics::spatial::{MassProperties, Mat3, Pose, Quat, Vec3};
use linkwork_dynamics::*;

use crate::support::splitmix;

struct Rng(u64);

impl Rng {
    fn within(&mut self, low: f64, high: f64) -> f64 {
        let unit = (splitmix::splitmix(&mut self.0) >> 11) as f64 / (1u64 << 53) as f64;
        low + (high - low) * unit
    }
    fn vec3(&mut self, size: f64) -> Vec3 {
        Vec3::from_fn(|_, _| self.within(-size, size))
    }
    /// Returns a random number with mean 0 and variance 1, as a sum of twelve numbers.
    fn normal(&mut self) -> f64 {
        (0..12).map(|_| self.within(0.0, 1.0)).sum::<f64>() - 6.0
    }
}

fn gravity() -> Vec3 {
    Vec3::new(0.0, 0.0, -9.81)
}

fn mass(rng: &mut Rng) -> MassProperties {
    let d = Vec3::new(0.011, 0.013, 0.017) * rng.within(0.8, 1.3);
    let turn = Quat::from_scaled_axis(rng.vec3(1.0)).to_rotation_matrix();
    let inertia = turn * Mat3::from_diagonal(&d) * turn.inverse();
    MassProperties::new(rng.within(0.8, 2.5), rng.vec3(0.1), inertia)
}

/// A chain of hinges without symmetry; `slider` is the index of one sliding hinge.
fn chain(n: usize, slider: Option<usize>, seed: u64) -> Builder {
    let mut rng = Rng(seed);
    let mut builder = Builder::new();
    for k in 0..n {
        let parent = if k == 0 { "world".to_owned() } else { format!("l{}", k - 1) };
        let axis = rng.vec3(1.0).normalize();
        let hinge =
            if slider == Some(k) { Hinge::slider(axis) } else { Hinge::pin(axis).armature(0.03) };
        let at = Pose::new(Quat::from_scaled_axis(rng.vec3(0.8)), rng.vec3(0.3));
        builder.body(
            BodySpec::new(format!("l{k}"), parent)
                .hinge(hinge)
                .mass(mass(&mut rng))
                .hinge_in_parent(at),
        );
    }
    let tip = Pose::new(Quat::from_scaled_axis(rng.vec3(0.5)), rng.vec3(0.2));
    builder.node("tip", format!("l{}", n - 1), tip);
    builder
}

/// The same frames with other masses.
fn other_masses(builder: &Builder, seed: u64) -> Multibody {
    let (mut builder, mut rng) = (builder.clone(), Rng(seed));
    builder.bodies_mut().iter_mut().for_each(|b| b.mass = mass(&mut rng));
    builder.build().unwrap()
}

fn parameters(mbs: &Multibody) -> Vec<f64> {
    mbs.bodies().iter().flat_map(|b| inertial_parameters(b.inertia())).collect()
}

/// Returns states with the forces from inverse dynamics of the true mechanism.
fn states(mbs: &Multibody, from: u64, count: u64) -> Vec<[Vec<f64>; 4]> {
    let tree = Tree::new(mbs);
    let mut ws = Workspace::new(&tree);
    ws.apply_uniform_gravity(gravity());
    (from..from + count)
        .map(|k| {
            let (q, v, a) = (mbs.random_q(3 * k), mbs.random_v(3 * k + 1), mbs.random_v(3 * k + 2));
            let mut tau = vec![0.0; mbs.nv()];
            inverse_dynamics(&tree, &mut ws, &q, &v, &a, &mut tau);
            [q, v, a, tau]
        })
        .collect()
}

/// A pendulum about y identifies its moment about the axis and two first moments, each independently, and nothing else.
#[test]
fn a_pendulum_tells_three_numbers() {
    let mut builder = Builder::new();
    builder
        .body(BodySpec::new("bob", "world").hinge(Hinge::pin(Vec3::y())).mass(mass(&mut Rng(1))));
    let mbs = builder.build().unwrap();
    let W = structural_regressor(&Tree::new(&mbs), gravity(), 1).unwrap();
    let told = Identifiable::of(&W, 1e-8);
    // The order of the parameters is m, hx, hy, hz, Ixx, Ixy, Ixz, Iyy, Iyz, Izz.
    assert_eq!(told.base, [1, 3, 7]);
    assert_eq!(told.alone(), [1, 3, 7]);
    assert_eq!(told.without_influence(), [0, 2, 4, 5, 6, 8, 9]);
    // Only the moment is identifiable without gravity.
    let W = structural_regressor(&Tree::new(&mbs), Vec3::zeros(), 1).unwrap();
    assert_eq!(Identifiable::of(&W, 1e-8).base, [7]);
}

/// Two links in a plane, computed by hand: I₁ + m₂ l², h₁ₓ + m₂ l, h₁z; I₂, h₂ₓ, h₂z. In the order of columns, m₂ is not a base parameter.
#[test]
fn a_double_pendulum_tells_six_combinations() {
    let (mut builder, mut rng, l) = (Builder::new(), Rng(2), 0.7);
    builder.body(BodySpec::new("a", "world").hinge(Hinge::pin(Vec3::y())).mass(mass(&mut rng)));
    let second = BodySpec::new("b", "a").hinge(Hinge::pin(Vec3::y())).mass(mass(&mut rng));
    builder.body(second.hinge_in_parent(Pose::translation(l, 0.0, 0.0)));
    let W = structural_regressor(&Tree::new(&builder.build().unwrap()), gravity(), 1).unwrap();
    let told = Identifiable::of(&W, 1e-8);
    assert_eq!(told.base, [1, 3, 7, 11, 13, 17]);
    let C = &told.combinations;
    assert!((C[(0, 10)] - l).abs() < 1e-9, "h₁ₓ + l m₂");
    assert!((C[(2, 10)] - l * l).abs() < 1e-9, "I₁ + l² m₂");
    assert_eq!(told.alone(), [3, 11, 13, 17]);
    assert!(W.clone().svd(false, false).rank(1e-8 * W.norm()) == 6);
}

/// Exact data of a mechanism with other masses: the fit predicts its forces at any other state, finds its base parameters and leaves its armature
/// unchanged.
#[test]
fn exact_data_give_the_forces_of_any_other_motion() {
    for (n, slider, seed) in [(3, None, 5), (4, Some(1), 6), (6, None, 7)] {
        let builder = chain(n, slider, seed);
        let (nominal, real) = (builder.build().unwrap(), other_masses(&builder, 100 + seed));
        let tree = Tree::new(&nominal);
        let mut data = InertialData::new(&tree, gravity()).unwrap();
        for [q, v, a, tau] in states(&real, 0, 80) {
            data.add(&q, &v, &a, &tau).unwrap();
        }
        let found = data.fit(1e-8).unwrap();
        let structural = structural_regressor(&tree, gravity(), 9).unwrap();
        assert_eq!(found.fit.identifiable.rank(), Identifiable::of(&structural, 1e-8).rank());
        let true_base = &found.fit.identifiable.combinations
            * DMatrix::from_column_slice(10 * n, 1, &parameters(&real));
        for (k, base) in found.fit.base.iter().enumerate() {
            assert!((base - true_base[k]).abs() < 1e-8, "{n} {k}: {base} {}", true_base[k]);
        }
        // The individual parameters differ from the real ones but give the same forces.
        let mut ws = Workspace::new(&tree);
        ws.apply_uniform_gravity(gravity());
        let mut Y = vec![0.0; n * 10 * n];
        let (mut tau, nominal_p) = (vec![0.0; n], parameters(&nominal));
        for [q, v, a, measured] in states(&real, 1000, 10) {
            inverse_dynamics(&tree, &mut ws, &q, &v, &a, &mut tau);
            regressor(&tree, &ws, &mut Y);
            for (i, row) in Y.chunks_exact(10 * n).enumerate() {
                let change: f64 = (row.iter().zip(&found.fit.parameters).zip(&nominal_p))
                    .map(|((y, p), p0)| y * (p - p0))
                    .sum();
                assert!((tau[i] + change - measured[i]).abs() < 1e-8, "{n} dof {i}");
            }
        }
        // The solution nearest to the prior leaves unidentifiable parameters unchanged.
        for j in found.fit.identifiable.without_influence() {
            assert!((found.fit.parameters[j] - nominal_p[j]).abs() < 1e-12);
        }
        // Data from the nominal mechanism do not change any parameter.
        let mut data = InertialData::new(&tree, gravity()).unwrap();
        for [q, v, a, tau] in states(&nominal, 0, 80) {
            data.add(&q, &v, &a, &tau).unwrap();
        }
        let same = data.fit(1e-8).unwrap();
        let off = same.fit.parameters.iter().zip(&nominal_p).map(|(a, b)| (a - b).abs());
        assert!(off.fold(0.0_f64, |m, x| if x.is_nan() { f64::INFINITY } else { m.max(x) }) < 1e-9);
        assert!(same.unphysical(&tree).is_empty());
    }
}

/// With noise of known size, the errors of base parameters agree with their standard deviations.
#[test]
fn deviations_are_those_of_the_errors() {
    let builder = chain(3, None, 11);
    let real = other_masses(&builder, 12);
    let nominal = builder.build().unwrap();
    let tree = Tree::new(&nominal);
    let (sigma, mut rng, mut squares, mut count) = (0.02, Rng(13), 0.0, 0);
    for trial in 0..30 {
        let mut data = InertialData::new(&tree, gravity()).unwrap();
        for [q, v, a, mut tau] in states(&real, 200 * trial, 60) {
            tau.iter_mut().for_each(|t| *t += sigma * rng.normal());
            data.add(&q, &v, &a, &tau).unwrap();
        }
        let fit = data.fit(1e-6).unwrap().fit;
        assert!((fit.residual / sigma - 1.0).abs() < 0.25, "{}", fit.residual);
        let real =
            &fit.identifiable.combinations * DMatrix::from_column_slice(30, 1, &parameters(&real));
        for (k, (base, deviation)) in fit.base.iter().zip(&fit.deviations).enumerate() {
            let error = (base - real[k]) / deviation;
            assert!(error.abs() < 5.5, "{trial} {k}: {error}");
            (squares, count) = (squares + error * error, count + 1);
        }
    }
    let mean = (squares / f64::from(count)).sqrt();
    println!("errors are {mean:.3} of their deviations, {count} numbers");
    assert!((mean - 1.0).abs() < 0.12, "{mean}");
}

/// Frames off by millimetres and tenths of degrees.
fn bent(builder: &Builder, seed: u64) -> Builder {
    let (mut bent, mut rng) = (builder.clone(), Rng(seed));
    let mut error = || Pose::new(Quat::from_scaled_axis(rng.vec3(0.02)), rng.vec3(0.005));
    bent.bodies_mut().iter_mut().for_each(|b| b.hinge_in_parent = b.hinge_in_parent * error());
    bent.nodes_mut().iter_mut().for_each(|n| n.pose = n.pose * error());
    bent
}

fn places(mbs: &Multibody, from: u64, count: u64, attitude: bool) -> Vec<Placed> {
    let tip = mbs.get_node(mbs.node("tip").unwrap());
    (from..from + count)
        .map(|k| {
            let q = mbs.random_q(k);
            let X = mbs.body_poses(&q)[tip.body().index()] * tip.pose();
            Placed { q, position: X.position, attitude: attitude.then_some(X.rotation) }
        })
        .collect()
}

/// Whole poses identify 4 numbers for each pin, 2 for each slider, plus 6 (as Everett and Hollerbach count); positions identify 3 fewer. The
/// corrected mechanism agrees with the real one at configurations that were not measured.
/// real one is at configurations that were not measured.
#[test]
fn frames_are_found_from_places_of_the_tip() {
    for (n, slider, seed) in [(3, None, 21), (4, Some(2), 22), (6, None, 23), (7, None, 24)] {
        let builder = chain(n, slider, seed);
        let (nominal, real) =
            (builder.build().unwrap(), bent(&builder, 50 + seed).build().unwrap());
        let (pins, sliders) = (n - usize::from(slider.is_some()), usize::from(slider.is_some()));
        for attitude in [true, false] {
            let tip = nominal.node("tip").unwrap();
            let measured = places(&real, 0, 60, attitude);
            let found = calibrate_kinematics(&nominal, tip, &measured, 0.5, 1e-7).unwrap();
            let all = 4 * pins + 2 * sliders + if attitude { 6 } else { 3 };
            assert_eq!(found.identifiable.rank(), all, "{n} {attitude}");
            assert!(
                found.residuals[0] > 1e-3 && found.residuals[1] < 1e-10,
                "{:?}",
                found.residuals
            );
            let corrected = found.mechanism.build().unwrap();
            let there = places(&corrected, 500, 20, true);
            for (a, b) in there.iter().zip(places(&real, 500, 20, true)) {
                assert!((a.position - b.position).norm() < 1e-9, "{n} {attitude}");
                let turn = a.attitude.unwrap().angle_to(&b.attitude.unwrap());
                assert!(!attitude || turn < 1e-9, "{turn}");
            }
            assert_eq!(found.corrections.len(), n + 1);
            assert!(
                found.corrections[n].0.is_none() && found.corrections[0].0.as_deref() == Some("l0")
            );
            println!(
                "{n} hinges, poses {attitude}: rank {all}, condition {:.0}",
                found.identifiable.condition
            );
        }
    }
}

#[test]
fn what_cannot_be_told_or_is_no_number_is_refused() {
    let builder = chain(2, None, 31);
    let mbs = builder.build().unwrap();
    let tree = Tree::new(&mbs);
    let mut data = InertialData::new(&tree, gravity()).unwrap();
    let bad = [f64::NAN, 0.0];
    let two = [0.1, 0.2];
    assert!(data.add(&two, &two, &two, &bad).unwrap_err().to_string().contains("NaN"));
    assert!(data.add(&two, &two[1..], &two, &two).unwrap_err().to_string().contains("`v` has 1"));
    data.add(&two, &two, &two, &two).unwrap();
    let told = data.fit(1e-8).unwrap_err();
    assert_eq!(told, CalibrationError::TooFew { rows: 2, rank: 2 });
    let tip = mbs.node("tip").unwrap();
    let mut few = places(&mbs, 0, 1, true);
    let told = calibrate_kinematics(&mbs, tip, &few, 1.0, 1e-8).unwrap_err();
    assert!(told.to_string().contains("not enough"), "{told}");
    few[0].position.x = f64::INFINITY;
    let told = calibrate_kinematics(&mbs, tip, &few, 1.0, 1e-8).unwrap_err();
    assert!(told.to_string().contains("inf"), "{told}");
    few[0].q.pop();
    let told = calibrate_kinematics(&mbs, tip, &few, 1.0, 1e-8).unwrap_err();
    assert!(told.to_string().contains("`q` has 1"), "{told}");
    let W = DMatrix::from_row_slice(3, 1, &[1.0, f64::NAN, 2.0]);
    assert!(fit(&W, &[0.0; 3], &[0.0], 1e-8).is_err());
    assert!(fit(&W, &[0.0; 2], &[0.0], 1e-8).unwrap_err().to_string().contains("`y` has 2"));
}

/// With fixed mechanisms or empty ones, no parameter is identifiable, and nothing panics.
#[test]
fn mechanisms_that_tell_nothing_answer() {
    let mut welded = Builder::new();
    welded.body(BodySpec::new("post", "world").mass(mass(&mut Rng(1))));
    for (builder, parameters) in [(Builder::new(), 0), (welded, 10)] {
        let tree = Tree::new(&builder.build().unwrap());
        let W = structural_regressor(&tree, gravity(), 1).unwrap();
        let told = Identifiable::of(&W, 1e-8);
        assert_eq!((told.rank(), told.without_influence().len()), (0, parameters));
        let mut data = InertialData::new(&tree, gravity()).unwrap();
        data.add(&[], &[], &[], &[]).unwrap();
        assert_eq!(data.fit(1e-8).unwrap_err(), CalibrationError::TooFew { rows: 0, rank: 0 });
    }
    let found = fit(&DMatrix::zeros(3, 2), &[1.0, 1.0, 1.0], &[4.0, 5.0], 1e-8).unwrap();
    assert_eq!((found.parameters, found.residual), (vec![4.0, 5.0], 1.0));
}
