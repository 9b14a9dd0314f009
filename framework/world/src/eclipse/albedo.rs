//! Radiation pressure of a planet's reflected sunlight (albedo) and thermal emission.

use linkwork_spatial::Vec3;
use linkwork_spatial::nalgebra::Unit;
use std::f64::consts::PI;

/// Rings of the planet's disc over which light is summed: Gauss–Legendre nodes and weights on −1 … 1.
const RINGS: [(f64, f64); 8] = [
    (-0.960_289_856_497_536_3, 0.101_228_536_290_376_3),
    (-0.796_666_477_413_626_7, 0.222_381_034_453_374_5),
    (-0.525_532_409_916_329, 0.313_706_645_877_887_3),
    (-0.183_434_642_495_649_8, 0.362_683_783_378_362),
    (0.183_434_642_495_649_8, 0.362_683_783_378_362),
    (0.525_532_409_916_329, 0.313_706_645_877_887_3),
    (0.796_666_477_413_626_7, 0.222_381_034_453_374_5),
    (0.960_289_856_497_536_3, 0.101_228_536_290_376_3),
];
/// Number of sectors of a ring.
const SECTORS: usize = 24;

/// Returns the light of a planet at `r` (m, from its centre) as a vector along the direction of propagation. Multiplied by the solar radiation
/// pressure at the planet (N/m²), it gives the pressure on an absorbing surface.
/// ```text
/// e = ∫ (albedo max(0, n · ŝ) + emissivity/4) û dΩ/π       n: normal of the ground that is seen along −û
/// ```
/// The integral is over the solid angle Ω of the planet, a sphere of radius `radius` (m) with Lambertian reflection; `to_sun` is the unit vector ŝ.
/// The ground reflects the fraction `albedo` of the light that falls on it, and emits the fraction `emissivity` of the mean absorbed light as uniform
/// heat: 1 − albedo in balance. The heat alone gives (R/r)² emissivity/4. The sum over 8 rings and 24 sectors is accurate to 2e-3 of the largest
/// value because of the terminator, and to 1e-9 if no terminator is visible. Zero inside the planet.
#[must_use]
pub fn planet_light(r: &Vec3, to_sun: &Vec3, radius: f64, albedo: f64, emissivity: f64) -> Vec3 {
    let distance = r.norm();
    let ratio = radius / distance;
    if !(ratio < 1.0) || (albedo == 0.0 && emissivity == 0.0) {
        return Vec3::zeros();
    }
    let up = r / distance;
    // Place the sectors symmetrically about the direction of the Sun, so that the sum has the
    // symmetry of the integrand.
    let side = to_sun - up * up.dot(to_sun);
    let x =
        Unit::try_new(side, 1e-12).unwrap_or_else(|| Unit::new_normalize(up.cross(&least(&up))));
    let y = up.cross(&x);
    let mut sum = Vec3::zeros();
    for (node, weight) in RINGS {
        // sin ψ = (R/r) sin χ, where ψ is the angle from the vertical at the spacecraft and χ the
        // angle from the normal at the ground.
        let chi = 0.25 * PI * (1.0 + node);
        let (sin, cos) = chi.sin_cos();
        let sin_psi = ratio * sin;
        let cos_psi = (1.0 - sin_psi * sin_psi).sqrt();
        let solid = ratio * ratio * sin * cos / cos_psi
            * (0.25 * PI * weight)
            * (2.0 * PI / SECTORS as f64);
        // The angle at the planet's centre is between the ground point and the spacecraft's
        // vertical.
        let (sin_theta, cos_theta) = (chi - sin_psi.asin()).sin_cos();
        for k in 0..SECTORS {
            let (s, c) = ((k as f64 + 0.5) * 2.0 * PI / SECTORS as f64).sin_cos();
            let across = *x * c + y * s;
            let normal = up * cos_theta + across * sin_theta;
            let light = albedo * normal.dot(to_sun).max(0.0) + 0.25 * emissivity;
            sum += (up * cos_psi - across * sin_psi) * (light * solid / PI);
        }
    }
    sum
}

/// Returns the axis farthest from a direction.
fn least(v: &Vec3) -> Vec3 {
    if v.x.abs() < 0.6 { Vec3::x() } else { Vec3::y() }
}
