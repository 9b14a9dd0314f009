//! Classical orbital elements, with the semi-latus rectum as size, because every conic has one.

use crate::error::{WorldError, number};
use crate::planet::PointMotion;
use linkwork_spatial::{Quat, Vec3, nalgebra};
use std::f64::consts::TAU;

/// An orbit and a position on it. On a circle the argument of the pericentre is 0 and the anomaly is measured from the node; in the equatorial plane
/// the node is at x.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Elements {
    /// p = a(1 − e²), m.
    pub semi_latus_rectum: f64,
    /// e; 1 is a parabola.
    pub eccentricity: f64,
    /// i, 0 … π, rad.
    pub inclination: f64,
    /// Ω, rad.
    pub ascending_node: f64,
    /// ω, rad.
    pub pericentre: f64,
    /// ν, the true anomaly, rad.
    pub anomaly: f64,
}

/// Eccentricity below which an orbit counts as circular, and inclination below which it counts as equatorial.
const FLAT: f64 = 1e-11;

impl Elements {
    /// Creates elements from the semi-major axis (m) instead of p.
    ///
    /// # Errors
    /// e is not in 0 … 1 for a positive a, or not above 1 for a negative a.
    pub fn with_axis(
        a: f64,
        eccentricity: f64,
        inclination: f64,
        ascending_node: f64,
        pericentre: f64,
        anomaly: f64,
    ) -> Result<Self, WorldError> {
        let help = "an ellipse has a > 0 and e < 1, a hyperbola a < 0 and e > 1";
        let fits = |e: f64| e >= 0.0 && a.is_finite() && a * (1.0 - e * e) > 0.0;
        number("eccentricity", eccentricity, fits, help)?;
        let semi_latus_rectum = a * (1.0 - eccentricity * eccentricity);
        Ok(Self {
            semi_latus_rectum,
            eccentricity,
            inclination,
            ascending_node,
            pericentre,
            anomaly,
        })
    }

    /// Returns a, m; negative for a hyperbola, infinite for a parabola.
    #[must_use]
    pub fn semi_major_axis(&self) -> f64 {
        self.semi_latus_rectum / (1.0 - self.eccentricity * self.eccentricity)
    }

    /// Returns the orbital period about μ (m³/s²), s; NaN unless the orbit is an ellipse.
    #[must_use]
    pub fn period(&self, mu: f64) -> f64 {
        let a = self.semi_major_axis();
        TAU * (a * a * a / mu).sqrt()
    }

    /// Returns position (m) and velocity (m/s) about μ (m³/s²).
    /// ```text
    /// R = R_z(Ω) R_x(i) R_z(ω),  p_perifocal = p/(1 + e cos ν) (cos ν, sin ν, 0)
    /// v_perifocal = √(μ/p) (−sin ν, e + cos ν, 0)
    /// ```
    #[must_use]
    pub fn state(&self, mu: f64) -> PointMotion {
        let about = |axis, angle| Quat::from_axis_angle(&axis, angle);
        let (x, z) = (nalgebra::Vector3::x_axis(), nalgebra::Vector3::z_axis());
        let R =
            about(z, self.ascending_node) * about(x, self.inclination) * about(z, self.pericentre);
        let (sin, cos) = self.anomaly.sin_cos();
        let e = self.eccentricity;
        let r = self.semi_latus_rectum / (1.0 + e * cos);
        let speed = (mu / self.semi_latus_rectum).sqrt();
        PointMotion {
            position: R * Vec3::new(r * cos, r * sin, 0.0),
            velocity: R * Vec3::new(-speed * sin, speed * (e + cos), 0.0),
        }
    }

    /// Computes the elements from position (m) and velocity (m/s) about μ (m³/s²).
    ///
    /// # Errors
    /// Position and velocity do not span a plane.
    pub fn of(mu: f64, state: &PointMotion) -> Result<Self, WorldError> {
        number("mu, m³/s²", mu, |x| x > 0.0, "a gravitational parameter is above 0")?;
        let (r, v) = (state.position, state.velocity);
        let h = r.cross(&v);
        if !(h.norm() > 1e-12 * r.norm() * v.norm()) {
            return Err(WorldError::NoPlane { position: r.into(), velocity: v.into() });
        }
        let w = h.normalize();
        let e = v.cross(&h) / mu - r / r.norm();
        let eccentricity = e.norm();
        let node = Vec3::z().cross(&h);
        let node = if node.norm() > FLAT * h.norm() { node.normalize() } else { Vec3::x() };
        let start = if eccentricity > FLAT { e / eccentricity } else { node };
        // This is the angle from a to b about w.
        let turn = |a: &Vec3, b: &Vec3| w.dot(&a.cross(b)).atan2(a.dot(b)).rem_euclid(TAU);
        Ok(Self {
            semi_latus_rectum: h.norm_squared() / mu,
            eccentricity,
            inclination: h.x.hypot(h.y).atan2(h.z),
            ascending_node: node.y.atan2(node.x).rem_euclid(TAU),
            pericentre: turn(&node, &start),
            anomaly: turn(&start, &r),
        })
    }
}
