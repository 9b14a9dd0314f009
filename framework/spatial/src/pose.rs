//! The pose of one frame in another.

use crate::{Quat, Vec3};
use serde::{Deserialize, Serialize};
use std::ops::Mul;

/// `X_AB`: pose of frame B in frame A. `p_AP = X_AB.transform_point(p_BP)`.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Pose {
    /// `R_AB`: coordinates in B to coordinates in A.
    pub rotation: Quat,
    /// `p_AB`: A's origin to B's origin, in A, m.
    pub position: Vec3,
}

impl Default for Pose {
    fn default() -> Self {
        Self::identity()
    }
}

impl From<Vec3> for Pose {
    /// The pose without rotation at this position.
    fn from(position: Vec3) -> Self {
        Pose::new(Quat::identity(), position)
    }
}
impl From<[f64; 3]> for Pose {
    /// The pose without rotation at this position.
    fn from(position: [f64; 3]) -> Self {
        Pose::from(Vec3::from(position))
    }
}

impl Pose {
    /// Returns the identity.
    #[must_use]
    pub fn identity() -> Self {
        Self { rotation: Quat::identity(), position: Vec3::zeros() }
    }

    /// Returns a pose from its parts.
    #[inline(always)]
    #[must_use]
    pub fn new(rotation: Quat, position: Vec3) -> Self {
        Self { rotation, position }
    }

    /// Returns a translation, m.
    #[must_use]
    pub fn translation(x: f64, y: f64, z: f64) -> Self {
        Self { rotation: Quat::identity(), position: Vec3::new(x, y, z) }
    }

    /// Returns a rotation.
    #[must_use]
    pub fn rotation(rotation: Quat) -> Self {
        Self { rotation, position: Vec3::zeros() }
    }

    /// Returns `X_BA` from `X_AB`.
    #[must_use]
    pub fn inverse(&self) -> Self {
        let rotation = self.rotation.inverse();
        Self { rotation, position: -(rotation * self.position) }
    }

    /// Transforms a point from B to A, m.
    #[inline(always)]
    #[must_use]
    pub fn transform_point(&self, p_BP: &Vec3) -> Vec3 {
        self.rotation * p_BP + self.position
    }

    /// Rotates a free vector from B to A.
    #[inline(always)]
    #[must_use]
    pub fn transform_vector(&self, v_B: &Vec3) -> Vec3 {
        self.rotation * v_B
    }

    /// Returns whether every number is finite.
    #[must_use]
    pub fn is_finite(&self) -> bool {
        self.position.iter().chain(self.rotation.coords.iter()).all(|x| x.is_finite())
    }
}

impl Mul for Pose {
    type Output = Pose;
    /// Returns `X_AC = X_AB * X_BC`.
    #[inline(always)]
    fn mul(self, o: Pose) -> Pose {
        Pose {
            rotation: self.rotation * o.rotation,
            position: self.rotation * o.position + self.position,
        }
    }
}
