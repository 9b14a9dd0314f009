//! Dipole field: the part of degree 1.

use linkwork_spatial::Vec3;

/// Returns B (T) at `p` (m, the body's axes) of the dipole `m` = (g₁₁, h₁₁, g₁₀) (T). The coefficients are for the reference radius `radius` (m); for
/// the Earth use [`RADIUS`](super::RADIUS). On the ground of the Earth it differs from the whole field by some ten per cent.
#[must_use]
pub fn dipole(m: &Vec3, radius: f64, p: &Vec3) -> Vec3 {
    let r = p.norm();
    let n = p / r;
    (n * (3.0 * m.dot(&n)) - m) * (radius / r).powi(3)
}
