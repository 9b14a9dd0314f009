//! Spatial algebra: motion, force, phi, pose and rigid inertia; the only crate that depends on nalgebra directly.
//!
//! Spatial vectors are pairs, angular part first (Jain). Motion and force are different types,
//! so a force cannot be propagated as if it were a velocity:
//! ```text
//! φ (child → parent)   force:   n' = n + l × f,   f' = f          Force::shift_to_parent
//! φ*(parent → child)   motion:  ω' = ω,  v' = v + ω × l           Motion::shift_to_child
//! ```
//! `l` is the vector from the parent's origin to the child's, in the axes of both.
//! Everything is SI: m, kg, s, rad, N, N m.
//! ```
//! use linkwork_spatial::{Force, Motion, Vec3};
//!
//! let l = Vec3::new(2.0, 0.0, 0.0);
//! let push = Force::new(Vec3::zeros(), Vec3::new(0.0, 3.0, 0.0)); // at the child's origin
//! let turn = Motion::new(Vec3::new(0.0, 0.0, 0.5), Vec3::zeros()); // of the parent
//! assert_eq!(push.shift_to_parent(&l).moment, Vec3::new(0.0, 0.0, 6.0));
//! assert_eq!(turn.shift_to_child(&l).linear, Vec3::new(0.0, 1.0, 0.0));
//! // Power is the same on both sides.
//! assert_eq!(turn.dot(&push.shift_to_parent(&l)), turn.shift_to_child(&l).dot(&push));
//! ```

#![allow(non_snake_case)]

mod inertia;
mod pose;
mod vectors;

pub use inertia::{InertiaCheck, InertiaError, InertiaFault, MassProperties, RigidInertia};
pub use nalgebra;
pub use pose::Pose;
pub use vectors::{Force, Motion};

/// A vector in three dimensions, f64.
pub type Vec3 = nalgebra::Vector3<f64>;
/// A 3 × 3 matrix, f64.
pub type Mat3 = nalgebra::Matrix3<f64>;
/// A rotation as a unit quaternion; `R_AB` takes coordinates in B to coordinates in A.
pub type Quat = nalgebra::UnitQuaternion<f64>;

/// Returns the rotation of an orthonormal, right-handed matrix, without checking it. It is a closed form, so NaN gives NaN. nalgebra's own
/// `from_matrix` iterates to find the nearest rotation, and never ends for NaN.
#[inline]
#[must_use]
pub fn quat(R: &Mat3) -> Quat {
    Quat::from_rotation_matrix(&nalgebra::Rotation3::from_matrix_unchecked(*R))
}

/// Returns the moment J(r)⁻ᵀ g of a potential U(r) of a rotation vector r (rad, shorter than π) with gradient g = ∂U/∂r. The power of this moment at
/// the angular velocity ω is U̇, since ṙ = J(r)⁻¹ ω. All vectors are in the axes relative to which r rotates. The gradient equals the moment only
/// where it is parallel to r; with stiffnesses that differ by axis, using it directly would create energy.
/// ```text
/// J(r)⁻ᵀ = 1 + [r]×/2 + (1 − (θ/2) cot(θ/2)) [r]×²/θ²,  θ = |r|
/// ```
#[must_use]
pub fn moment_of_gradient(r: &Vec3, gradient: &Vec3) -> Vec3 {
    let theta2 = r.norm_squared();
    let theta = theta2.sqrt();
    // The factor is (1 − (θ/2) cot(θ/2)) / θ², computed from its series near zero.
    let c = if theta < 1e-3 {
        1.0 / 12.0 + theta2 / 720.0
    } else {
        (1.0 - 0.5 * theta / (0.5 * theta).tan()) / theta2
    };
    gradient + r.cross(gradient) * 0.5 + r.cross(&r.cross(gradient)) * c
}

/// Rotates a vector by a quaternion [x y z w] of any length, without a square root. A zero quaternion leaves the vector unchanged.
#[inline(always)]
#[must_use]
pub fn turned(q: &[f64; 4], a: &Vec3) -> Vec3 {
    let (u, w) = (Vec3::new(q[0], q[1], q[2]), q[3]);
    let length = u.norm_squared() + w * w;
    let double = if length > 0.0 { 2.0 / length } else { 0.0 };
    let t = u.cross(a) * double;
    a + t * w + u.cross(&t)
}

/// Returns the cross-product matrix: `skew(a) * b = a × b`.
#[inline(always)]
#[must_use]
pub fn skew(a: &Vec3) -> Mat3 {
    a.cross_matrix()
}
