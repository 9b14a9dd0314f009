//! Identities of the spatial operators, and errors of impossible inertias.
#![allow(non_snake_case, clippy::unwrap_used)]

use linkwork_spatial::{
    Force, InertiaCheck, InertiaFault, MassProperties, Mat3, Motion, Pose, Quat, RigidInertia,
    Vec3, quat,
};

fn v(k: f64) -> Vec3 {
    Vec3::new(0.3 + k, -0.7 * k - 0.2, 0.5 - 1.1 * k)
}

fn body() -> MassProperties {
    let R = Quat::from_scaled_axis(v(0.4)).to_rotation_matrix().into_inner();
    let I = R * Mat3::from_diagonal(&Vec3::new(0.3, 0.4, 0.6)) * R.transpose();
    MassProperties::new(1.7, v(0.9), (I + I.transpose()) * 0.5)
}

fn close(a: &Mat3, b: &Mat3) {
    assert!((a - b).abs().max() < 1e-14 * b.abs().max().max(1.0), "{a} is not {b}");
}

#[test]
fn phi_and_its_transpose_keep_power() {
    let (V, f, l) = (Motion::new(v(1.0), v(2.0)), Force::new(v(3.0), v(-1.0)), v(0.6));
    let parent = V.dot(&f.shift_to_parent(&l));
    let child = V.shift_to_child(&l).dot(&f);
    assert!((parent - child).abs() < 1e-13);
    let R = Quat::from_scaled_axis(v(0.2));
    assert!((V.rotate(&R).dot(&f.rotate(&R)) - V.dot(&f)).abs() < 1e-13);
}

#[test]
fn poses_compose_and_invert() {
    let (A, B) = (
        Pose::new(Quat::from_scaled_axis(v(0.1)), v(1.0)),
        Pose::new(Quat::from_scaled_axis(v(0.8)), v(2.0)),
    );
    let p = v(-0.4);
    let both = (A * B).transform_point(&p);
    assert!((both - A.transform_point(&B.transform_point(&p))).norm() < 1e-14);
    assert!((A.inverse().transform_point(&A.transform_point(&p)) - p).norm() < 1e-14);
}

#[test]
fn shifting_an_inertia_is_phi_m_phi_transposed() {
    let (I, l) = (body().validate().unwrap(), v(0.7));
    let V = Motion::new(v(0.5), v(-0.8));
    let want = I.apply(&V.shift_to_child(&l)).shift_to_parent(&l);
    let got = I.shift_to_parent(&l).apply(&V);
    assert!((got.moment - want.moment).norm() < 1e-13 && (got.force - want.force).norm() < 1e-13);
    // The inertia about the centre of mass does not change.
    close(&I.shift_to_parent(&l).inertia_com(), &body().inertia_com);
    assert!((I.com() - body().com).norm() < 1e-15);
    let R = Quat::from_scaled_axis(v(0.3));
    let turned = I.rotate(&R).apply(&V.rotate(&R));
    assert!((turned.moment - I.apply(&V).rotate(&R).moment).norm() < 1e-13);
}

#[test]
fn two_halves_of_a_rod_make_the_rod() {
    // Thin rods of length 1 and mass m have m/12 about the transverse axes. Joined end to end, they
    // have (2m) 2²/12.
    let half = Mat3::from_diagonal(&Vec3::new(0.0, 1.0 / 12.0, 1.0 / 12.0));
    let part = |x: f64| RigidInertia::new(1.0, Vec3::x() * x, half).unwrap();
    let rod = part(0.5) + part(-0.5);
    close(&rod.inertia_com(), &Mat3::from_diagonal(&Vec3::new(0.0, 8.0 / 12.0, 8.0 / 12.0)));
}

#[test]
fn impossible_bodies_are_refused_with_the_size_of_the_fault() {
    let faults = |m: MassProperties| m.validate().unwrap_err().faults;
    let I = |x, y, z| Mat3::from_diagonal(&Vec3::new(x, y, z));
    let with = |mass: f64, I: Mat3| MassProperties::new(mass, v(0.1), I);
    assert_eq!(faults(with(-2.0, I(1.0, 1.0, 1.0))), [InertiaFault::NegativeMass(-2.0)]);
    assert_eq!(faults(with(0.0, I(1.0, 1.0, 2.0))), [InertiaFault::MasslessButInertia(2.0)]);
    assert_eq!(faults(with(f64::NAN, I(1.0, 1.0, 2.0))), [InertiaFault::NotFinite]);
    // These numbers are finite, but their sums overflow.
    assert_eq!(faults(with(1.0, I(1e308, 1e308, 1e308))), [InertiaFault::NotFinite]);
    let far = MassProperties::new(1.0, v(1e200), I(1.0, 1.0, 1.0));
    assert_eq!(faults(far), [InertiaFault::NotFinite]);
    let mut skewed = I(1.0, 1.0, 1.0);
    skewed[(0, 1)] = 0.25;
    assert_eq!(faults(with(1.0, skewed)), [InertiaFault::NotSymmetric(0.25)]);
    assert_eq!(faults(with(1.0, I(-0.5, 1.0, 1.0))), [InertiaFault::NegativePrincipalMoment(-0.5)]);
    let triangle = faults(with(1.0, I(0.1, 0.2, 0.5)));
    let [InertiaFault::Triangle { excess, .. }] = triangle[..] else { panic!("{triangle:?}") };
    assert!((excess - 0.2).abs() < 1e-15);
    let text = with(1.0, I(0.1, 0.2, 0.5)).validate().unwrap_err().to_string();
    assert!(text.contains("exceeds the sum") && text.contains("armature"), "{text}");
    // Several faults are reported at once.
    assert_eq!(faults(with(-1.0, I(-1.0, 1.0, 1.0))).len(), 2);
    // A published wheel that includes the inertia of its rotor is accepted with this check, and so
    // is a massless body.
    with(1.0, I(0.1, 0.2, 0.5)).with_check(InertiaCheck::PositiveMoments).validate().unwrap();
    MassProperties::massless().validate().unwrap();
    // A flat plate is at the limit of the triangle inequality, and valid.
    with(1.0, I(0.1, 0.2, 0.3)).validate().unwrap();
}

#[test]
fn a_matrix_gives_its_rotation_and_nan_gives_nan() {
    // Test each branch of the closed form: the trace, and each diagonal element as the largest.
    let axes = [Vec3::x(), Vec3::y(), Vec3::z(), v(0.4)];
    for turn in axes.iter().flat_map(|a| [0.0, 0.3, -2.0, 3.1, 3.2].map(|angle| a * angle)) {
        let R = Quat::from_scaled_axis(turn);
        let again = quat(&R.to_rotation_matrix().into_inner());
        let off =
            (again.to_rotation_matrix().into_inner() - R.to_rotation_matrix().into_inner()).norm();
        assert!(off < 2e-15 && (again.norm() - 1.0).abs() < 1e-15, "{turn}: {off:e}");
    }
    for k in 0..9 {
        let mut R = Mat3::identity();
        R[k] = f64::NAN;
        assert!(quat(&R).coords.iter().any(|x| x.is_nan()), "{k}");
    }
    assert!(quat(&Mat3::from_element(f64::NAN)).coords.iter().all(|x| x.is_nan()));
}
