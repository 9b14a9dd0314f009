//! Frames that move: where B is in A and how it moves there; points from one to the other and back.
//!
//! ```text
//! p_A = p_AB + R_AB p_B                       p_B = R_ABᵀ (p_A − p_AB)
//! v_A = v_AB + R_AB v_B + ω_AB × R_AB p_B     v_B = R_ABᵀ (v_A − v_AB − ω_AB × (p_A − p_AB))
//! ```
//! A point is best kept in the frame that it belongs to: seconds after a landing a rock is where it was in
//! its site to the last digit, while in inertial axes it has moved by kilometres. A conversion over 3.4e6 m
//! is right to 1e-9 m, the spacing of f64 there.

use linkwork_spatial::{Motion, Pose, Vec3};

/// Motion of frame B seen from frame A.
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
    /// From the frame's origin, m.
    pub position: Vec3,
    /// Relative to the frame, m/s.
    pub velocity: Vec3,
}

impl FrameMotion {
    /// B is A.
    #[must_use]
    pub fn identity() -> Self {
        Self::fixed(Pose::identity())
    }

    /// B does not move in A.
    #[must_use]
    pub fn fixed(pose: Pose) -> Self {
        Self { pose, velocity: Motion::new(Vec3::zeros(), Vec3::zeros()) }
    }

    /// A point given in B, seen from A.
    #[must_use]
    pub fn to_outer(&self, point: &PointMotion) -> PointMotion {
        let p = self.pose.rotation * point.position;
        let v = self.pose.rotation * point.velocity;
        PointMotion {
            position: self.pose.position + p,
            velocity: self.velocity.linear + v + self.velocity.angular.cross(&p),
        }
    }

    /// A point given in A, seen from B.
    #[must_use]
    pub fn to_inner(&self, point: &PointMotion) -> PointMotion {
        let p = point.position - self.pose.position;
        let v = point.velocity - self.velocity.linear - self.velocity.angular.cross(&p);
        let R = self.pose.rotation.inverse();
        PointMotion { position: R * p, velocity: R * v }
    }

    /// `AC` from `AB` (self) and `BC`.
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

    /// `BA` from `AB`.
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

/// What is added to a true acceleration to have the one seen in axes that turn with constant ω (rad/s)
/// about their origin: −2 ω × v − ω × (ω × p), m/s²; all in the turning axes. The minus signs: the axes run
/// ahead, so what keeps its inertial velocity falls behind.
#[must_use]
pub fn apparent_acceleration(omega: &Vec3, point: &PointMotion) -> Vec3 {
    omega.cross(&(point.velocity * -2.0 - omega.cross(&point.position)))
}
