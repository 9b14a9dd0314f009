//! Limits of ball hinges.
//!
//! ```text
//! q     rotation of the body's side of the hinge in the parent's side; ω: its rate in the axes of the body's side
//! angle   θ = 2 atan2(|v|, w)               θ̇ = n · ω                        n: axis of the whole rotation
//! cone    cos φ = z_p · z                   φ̇ = (z_p × z) · ω / sin φ        z_p: z of the parent's side
//! twist   ψ = 2 atan2(q_z, q_w)             ψ̇ = (z_p + z) · ω / (1 + cos φ)
//! ```
//! The rotation is a twist about z, then a swing that takes z of the parent's side to z of the body's side.

use linkwork_spatial::Vec3;
use serde::{Deserialize, Serialize};

/// Limits of a ball hinge, rad; ∞ means not limited.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct BallLimits {
    /// Largest angle of the whole rotation.
    pub angle: f64,
    /// Largest angle between the z axes of the two sides of the hinge.
    pub cone: f64,
    /// Largest rotation about z, in either direction.
    pub twist: f64,
}

impl Default for BallLimits {
    fn default() -> Self {
        Self::NONE
    }
}

/// Sine or length below which a direction is undefined.
const FLAT: f64 = 1e-9;

impl BallLimits {
    /// No limit.
    pub const NONE: Self = Self { angle: f64::INFINITY, cone: f64::INFINITY, twist: f64::INFINITY };

    /// Returns whether every limit is above 0 and none is NaN.
    #[must_use]
    pub fn is_valid(&self) -> bool {
        self.angle > 0.0 && self.cone > 0.0 && self.twist > 0.0
    }

    /// Returns the margin to each limit at the quaternion `q` (x, y, z, w), rad, and the direction d that gives its rate d · ω, with ω in the axes of
    /// the body's side. `None` if the limit or the direction does not exist.
    #[must_use]
    pub fn left(&self, q: &[f64]) -> [Option<(f64, Vec3)>; 3] {
        let sign = if q[3] < 0.0 { -1.0 } else { 1.0 };
        let (v, w) = (Vec3::new(q[0], q[1], q[2]) * sign, q[3] * sign);
        let z = Vec3::z();
        // Rᵀ z is the z axis of the parent's side in the axes of the body's side.
        let up = Vec3::new(
            2.0 * (v.x * v.z - w * v.y),
            2.0 * (v.y * v.z + w * v.x),
            w * w + v.z * v.z - v.x * v.x - v.y * v.y,
        );
        let length = v.norm();
        let angle = (self.angle.is_finite() && length > FLAT)
            .then(|| (self.angle - 2.0 * length.atan2(w), v / -length));
        let across = up.cross(&z);
        let cone = (self.cone.is_finite() && across.norm() > FLAT).then(|| {
            let tilt = across.norm().atan2(up.z);
            (self.cone - tilt, across / -across.norm())
        });
        let twist = (self.twist.is_finite() && 1.0 + up.z > FLAT).then(|| {
            let turn = 2.0 * v.z.atan2(w);
            (self.twist - turn.abs(), (up + z) * (-turn.signum() / (1.0 + up.z)))
        });
        [angle, cone, twist]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use linkwork_spatial::Quat;

    /// The directions are the gradients of the angles. Compares them with central differences at rotations in all directions.
    #[test]
    fn directions_are_gradients() {
        let limits = BallLimits { angle: 3.0, cone: 2.5, twist: 3.0 };
        let h = 1e-6;
        for k in 0..200 {
            let s = |j: u32| (f64::from(k * 3 + j) * 1.37).sin();
            let R = Quat::from_scaled_axis(Vec3::new(s(0), s(1), s(2)) * 1.5);
            let numbers = |R: &Quat| [R.i, R.j, R.k, R.w];
            let found = limits.left(&numbers(&R));
            for axis in 0..3 {
                let mut w = Vec3::zeros();
                w[axis] = h;
                let at = |sign: f64| limits.left(&numbers(&(R * Quat::from_scaled_axis(w * sign))));
                let (up, down) = (at(1.0), at(-1.0));
                for i in 0..3 {
                    let (gap, direction) = found[i].unwrap();
                    let slope = (up[i].unwrap().0 - down[i].unwrap().0) / (2.0 * h);
                    assert!((direction[axis] - slope).abs() < 1e-6, "{k} {axis} {i} {gap}");
                }
            }
        }
    }
}
