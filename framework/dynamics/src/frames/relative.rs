//! Motion of a frame relative to another, accumulated along a path.
//!
//! Motion of B relative to A is what an observer fixed in A measures: rates of change of coordinates in A. Outward step, C to D when C relative to A
//! is known (r = R_AC p_CD):
//! ```text
//! ω' = ω + R ω_CD
//! v' = v + ω × r + R v_CD
//! α' = α + R α_CD + ω × R ω_CD
//! a' = a + α × r + ω × (ω × r) + 2 ω × R v_CD + R a_CD
//! ```
//! B relative to A when both are known relative to C (d = p_CB − p_CA, ḋ and d̈ likewise, ω = ω_A):
//! ```text
//! ω_AB = Rᵀ (ω_B − ω)                        v_AB = Rᵀ (ḋ − ω × d)
//! α_AB = Rᵀ (α_B − α − ω × ω_B)              a_AB = Rᵀ (d̈ − α × d − 2 ω × ḋ + ω × (ω × d))
//! ```

use linkwork_spatial::{Motion, Pose, Vec3};

/// A frame relative to the beginning of its path.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct RelativeFrame {
    pub X: Pose,
    /// Vector from the previous frame on the path, in the axes of the beginning.
    pub r: Vec3,
    pub V: Motion,
    pub A: Motion,
}

impl RelativeFrame {
    /// Computes the pose of the next frame outward.
    pub fn pose(&self, X: &Pose, next: &mut RelativeFrame) {
        next.r = self.X.rotation * X.position;
        next.X = Pose::new(self.X.rotation * X.rotation, self.X.position + next.r);
    }

    /// Computes its velocity; poses are known.
    pub fn velocity(&self, V: &Motion, next: &mut RelativeFrame) {
        let (w, R) = (self.V.angular, &self.X.rotation);
        next.V.angular = w + R * V.angular;
        next.V.linear = self.V.linear + w.cross(&next.r) + R * V.linear;
    }

    /// Computes its acceleration; poses and velocities are known, `V` and `A` are those of the edge.
    pub fn acceleration(&self, V: &Motion, A: &Motion, next: &mut RelativeFrame) {
        let (w, R) = (self.V.angular, &self.X.rotation);
        next.A.angular = self.A.angular + R * A.angular + w.cross(&(R * V.angular));
        next.A.linear = self.A.linear
            + self.A.angular.cross(&next.r)
            + w.cross(&(w.cross(&next.r) + R * V.linear * 2.0))
            + R * A.linear;
    }
}

/// Returns `X_AB`.
pub(super) fn pose(a: &RelativeFrame, b: &RelativeFrame) -> Pose {
    let back = a.X.rotation.inverse();
    Pose::new(back * b.X.rotation, back * (b.X.position - a.X.position))
}

/// Returns the velocity of B relative to A, axes of A.
pub(super) fn velocity(a: &RelativeFrame, b: &RelativeFrame) -> Motion {
    let (w, d) = (a.V.angular, b.X.position - a.X.position);
    let linear = b.V.linear - a.V.linear - w.cross(&d);
    Motion::new(b.V.angular - w, linear).rotate(&a.X.rotation.inverse())
}

/// Returns the acceleration of B relative to A, axes of A.
pub(super) fn acceleration(a: &RelativeFrame, b: &RelativeFrame) -> Motion {
    let (w, d) = (a.V.angular, b.X.position - a.X.position);
    let d_dot = b.V.linear - a.V.linear;
    let angular = b.A.angular - a.A.angular - w.cross(&b.V.angular);
    let linear =
        b.A.linear - a.A.linear - a.A.angular.cross(&d) + w.cross(&(w.cross(&d) - d_dot * 2.0));
    Motion::new(angular, linear).rotate(&a.X.rotation.inverse())
}
