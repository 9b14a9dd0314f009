//! Moving frames: pose and motion of B in A, and conversion of points between the two.
//!
//! ```text
//! p_A = p_AB + R_AB p_B                       p_B = R_ABᵀ (p_A − p_AB)
//! v_A = v_AB + R_AB v_B + ω_AB × R_AB p_B     v_B = R_ABᵀ (v_A − v_AB − ω_AB × (p_A − p_AB))
//! ```
//! Keep a point in the frame to which it belongs. A rock's position in its landing site stays bit-identical, while in inertial axes it moves by
//! kilometres within seconds. A conversion over 3.4e6 m is accurate to 1e-9 m, the spacing of f64 at that size.

use linkwork_spatial::{Motion, Pose, Vec3};

/// Motion of frame B relative to frame A.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FrameMotion {
    /// `X_AB`.
    pub pose: Pose,
    /// ω_AB and the velocity of B's origin, relative to A and in A's axes; rad/s, m/s.
    pub velocity: Motion,
}

/// Position and velocity of a point in a frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PointMotion {
    /// Position from the frame's origin, m.
    pub position: Vec3,
    /// Velocity relative to the frame, m/s.
    pub velocity: Vec3,
}

impl FrameMotion {
    /// Returns the motion of a frame B that equals A.
    #[must_use]
    pub fn identity() -> Self {
        Self::fixed(Pose::identity())
    }

    /// Returns the motion of a frame B at rest in A.
    #[must_use]
    pub fn fixed(pose: Pose) -> Self {
        Self { pose, velocity: Motion::new(Vec3::zeros(), Vec3::zeros()) }
    }

    /// Converts a point from B to A.
    #[must_use]
    pub fn to_outer(&self, point: &PointMotion) -> PointMotion {
        let p = self.pose.rotation * point.position;
        let v = self.pose.rotation * point.velocity;
        PointMotion {
            position: self.pose.position + p,
            velocity: self.velocity.linear + v + self.velocity.angular.cross(&p),
        }
    }

    /// Converts a point from A to B.
    #[must_use]
    pub fn to_inner(&self, point: &PointMotion) -> PointMotion {
        let p = point.position - self.pose.position;
        let v = point.velocity - self.velocity.linear - self.velocity.angular.cross(&p);
        let R = self.pose.rotation.inverse();
        PointMotion { position: R * p, velocity: R * v }
    }

    /// Returns `AC` from `AB` (self) and `BC`.
    #[must_use]
    pub fn then(&self, bc: &Self) -> Self {
        let origin = PointMotion { position: bc.pose.position, velocity: bc.velocity.linear };
        let origin = self.to_outer(&origin);
        let R = self.pose.rotation;
        Self {
            pose: Pose::new(R * bc.pose.rotation, origin.position),
            velocity: Motion::new(self.velocity.angular + R * bc.velocity.angular, origin.velocity),
        }
    }

    /// Returns `BA` from `AB`.
    #[must_use]
    pub fn inverse(&self) -> Self {
        let zero = PointMotion { position: Vec3::zeros(), velocity: Vec3::zeros() };
        let origin = self.to_inner(&zero);
        let R = self.pose.rotation.inverse();
        Self {
            pose: Pose::new(R, origin.position),
            velocity: Motion::new(-(R * self.velocity.angular), origin.velocity),
        }
    }
}

/// Returns the apparent acceleration in axes that rotate at constant ω (rad/s) about their origin: −2 ω × v − ω × (ω × p), m/s², all in the rotating
/// axes. Add it to the true acceleration. The signs are negative because a point with constant inertial velocity falls behind the rotating axes.
#[must_use]
pub fn apparent_acceleration(omega: &Vec3, point: &PointMotion) -> Vec3 {
    omega.cross(&(point.velocity * -2.0 - omega.cross(&point.position)))
}
