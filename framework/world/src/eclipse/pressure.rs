//! Solar radiation pressure.

use crate::planet::AU;
use linkwork_spatial::Vec3;

/// Solar radiation pressure at one astronomical unit on an absorbing surface, N/m².
pub const PRESSURE_AU: f64 = 4.56e-6;

/// Returns P (AU/d)², N/m², at `d` (m) from the Sun.
#[must_use]
pub fn pressure(d: f64) -> f64 {
    PRESSURE_AU * (AU / d) * (AU / d)
}

/// Returns the acceleration of a sphere, m/s², away from the Sun. `to_sun` points from the satellite to the Sun, m; `area_over_mass` m²/kg;
/// `reflectivity` C_r, 1 (black) to 2 (mirror); `visible` from [`super::visible_fraction`].
#[must_use]
pub fn cannonball(to_sun: &Vec3, area_over_mass: f64, reflectivity: f64, visible: f64) -> Vec3 {
    let d = to_sun.norm();
    to_sun * (-visible * pressure(d) * reflectivity * area_over_mass / d)
}

/// Returns the force on one side of a flat plate, N; zero if its normal points away from the Sun.
///
/// `pressure`: N/m², including shadow. `to_sun` and `normal`: unit vectors. ρ_s and ρ_d: fractions of the light that are reflected specularly and
/// diffusely; the rest is absorbed.
/// ```text
/// F = −P A cos θ [(1 − ρ_s) ŝ + 2 (ρ_s cos θ + ρ_d/3) n̂]
/// ```
/// Montenbruck & Gill, *Satellite Orbits*, section 3.4, with Lambertian reflection.
#[must_use]
pub fn plate(
    pressure: f64,
    area: f64,
    normal: &Vec3,
    to_sun: &Vec3,
    specular: f64,
    diffuse: f64,
) -> Vec3 {
    let cos = normal.dot(to_sun);
    if cos <= 0.0 {
        return Vec3::zeros();
    }
    let along = to_sun * (1.0 - specular) + normal * (2.0 * (specular * cos + diffuse / 3.0));
    along * (-pressure * area * cos)
}
