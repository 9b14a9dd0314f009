//! Solid tides of degree 2: the deformation of a body by Sun and moons.
//!
//! The model has one real Love number k₂: no phase lag, no frequency dependence. For the Earth this is the first step of IERS Conventions 2010
//! section 6.2, with an error of about 10 % of the full tide.

use crate::error::WorldError;
use crate::gravity::Coefficients;
use linkwork_spatial::{Mat3, Vec3};

/// A body that raises a tide.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TideRaiser {
    /// Gravitational parameter, m³/s².
    pub mu: f64,
    /// Position from the centre of the tidal body, m, in the axes of the result.
    pub position: Vec3,
}

/// Returns the acceleration at `p` (m) due to the tide that `raiser` raises on a body of radius `radius` (m), m/s².
/// ```text
/// V = k₂ μⱼ R⁵/(rⱼ³ r³) P₂(cos ψ),   cos ψ = r̂·r̂ⱼ
/// a = k₂ μⱼ R⁵/(2 rⱼ³ r⁴) [(3 − 15 cos²ψ) r̂ + 6 cos ψ r̂ⱼ]
/// ```
/// Montenbruck & Gill, *Satellite Orbits*, section 3.7.
#[must_use]
pub fn solid_tide(k2: f64, radius: f64, raiser: &TideRaiser, p: &Vec3) -> Vec3 {
    let (r, rj) = (p.norm(), raiser.position.norm());
    let (n, nj) = (p / r, raiser.position / rj);
    let c = n.dot(&nj);
    let x = radius / rj;
    let y = radius / r;
    // The factor is R⁵/(rⱼ³ r⁴) = (R/rⱼ)³ (R/r)⁴ / R².
    let k = k2 * raiser.mu * x * x * x * y * y * y * y / (2.0 * radius * radius);
    (n * (3.0 - 15.0 * c * c) + nj * (6.0 * c)) * k
}

/// Returns ∂a/∂p of [`solid_tide`], 1/s²; symmetric, with zero trace.
/// ```text
/// ∂a/∂p = k₂ μⱼ R⁵/(2 rⱼ³ r⁵) [(3 − 15 c²) 1 − (15 − 105 c²) r̂ r̂ᵀ − 30 c (r̂ r̂ⱼᵀ + r̂ⱼ r̂ᵀ) + 6 r̂ⱼ r̂ⱼᵀ],   c = cos ψ
/// ```
#[must_use]
pub fn solid_tide_gradient(k2: f64, radius: f64, raiser: &TideRaiser, p: &Vec3) -> Mat3 {
    let (r, rj) = (p.norm(), raiser.position.norm());
    let (n, nj) = (p / r, raiser.position / rj);
    let c = n.dot(&nj);
    let (x, y) = (radius / rj, radius / r);
    let k = k2 * raiser.mu * x.powi(3) * y.powi(4) / (2.0 * radius * radius) / r;
    let mixed = n * nj.transpose() + nj * n.transpose();
    (Mat3::identity() * (3.0 - 15.0 * c * c)
        - n * n.transpose() * (15.0 - 105.0 * c * c)
        - mixed * (30.0 * c)
        + nj * nj.transpose() * 6.0)
        * k
}

/// Adds the same tide to `field` as an increase of the normalised coefficients of degree 2, in body-fixed axes. Positions of the raisers are in the
/// axes of the field.
/// ```text
/// ΔC̄₂ₘ − i ΔS̄₂ₘ = k₂/5 Σⱼ (μⱼ/μ) (R/rⱼ)³ P̄₂ₘ(sin φⱼ) e^(−i m λⱼ)
/// ```
/// IERS Conventions 2010, eq. 6.6.
///
/// # Errors
/// A field with degree or order below 2.
pub fn solid_tide_coefficients(
    k2: f64,
    raisers: &[TideRaiser],
    field: &mut Coefficients,
) -> Result<(), WorldError> {
    for raiser in raisers {
        let r = raiser.position.norm();
        let n = raiser.position / r;
        let k = k2 / 5.0 * (raiser.mu / field.mu) * (field.radius / r).powi(3);
        // The terms are P̄₂ₘ e^(imλ), with the factor cosᵐφ inside (s + it)ᵐ.
        let (root5, root15) = (5.0_f64.sqrt(), 15.0_f64.sqrt());
        let terms = [
            (root5 * 0.5 * (3.0 * n.z * n.z - 1.0), 0.0),
            (root15 * n.z * n.x, root15 * n.z * n.y),
            (root15 * 0.5 * (n.x * n.x - n.y * n.y), root15 * n.x * n.y),
        ];
        for (m, (c, s)) in terms.into_iter().enumerate() {
            let (c0, s0) = field.get(2, m);
            field.set(2, m, c0 + k * c, s0 + k * s)?;
        }
    }
    Ok(())
}
