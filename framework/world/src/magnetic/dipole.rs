//! The part of degree 1.

use super::RADIUS;
use linkwork_spatial::Vec3;

/// B at `p` (m, the Earth's axes), T, of the dipole `m` = (g₁₁, h₁₁, g₁₀), T. Some ten per cent from the
/// whole field at the ground.
#[must_use]
pub fn dipole(m: &Vec3, p: &Vec3) -> Vec3 {
    let r = p.norm();
    let n = p / r;
    (n * (3.0 * m.dot(&n)) - m) * (RADIUS / r).powi(3)
}
