//! Perturbation of a satellite by a third body, relative to its planet, without cancellation.

use super::point_mass_gradient;
use linkwork_spatial::{Mat3, Vec3};

/// Returns the acceleration of a satellite relative to the planet due to a third body, m/s²; any inertial axes.
///
/// `r` points from the planet to the satellite, `s` from the planet to the third body, both m. The simple difference of two accelerations loses a
/// factor |s|/|r| of precision; Battin's form (*An Introduction to the Mathematics and Methods of Astrodynamics*) keeps full precision:
/// ```text
/// q = r·(r − 2s)/s²,   f = q (3 + 3q + q²)/(1 + (1 + q)^1.5)
/// a = −μ₃/|r − s|³ (r + f s)
/// ```
#[must_use]
pub fn third_body(mu: f64, r: &Vec3, s: &Vec3) -> Vec3 {
    let q = r.dot(&(r - s * 2.0)) / s.norm_squared();
    let k = 1.0 + q;
    let f = q * (3.0 + 3.0 * q + q * q) / (1.0 + k * k.sqrt());
    let d2 = (r - s).norm_squared();
    (r + s * f) * (-mu / (d2 * d2.sqrt()))
}

/// Returns ∂a/∂r of [`third_body`], 1/s²: μ₃ (3 d dᵀ/|d|² − 1)/|d|³, d = r − s. The planet's own acceleration does not depend on r.
#[must_use]
pub fn third_body_gradient(mu: f64, r: &Vec3, s: &Vec3) -> Mat3 {
    point_mass_gradient(mu, &(r - s))
}

/// Returns the acceleration of the planet itself due to the third body, m/s²: μ₃ s/|s|³. Use it in equations with another origin than the planet.
#[must_use]
pub fn indirect(mu: f64, s: &Vec3) -> Vec3 {
    let s2 = s.norm_squared();
    s * (mu / (s2 * s2.sqrt()))
}
