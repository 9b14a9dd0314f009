//! Linearized motion near a circular orbit: Clohessy & Wiltshire, *J. Aerospace Sciences* 27 (1960).
//!
//! The chief's axes rotate with its orbit: x radially outwards, y along the motion, z along the normal of the orbit (`OrbitalAxes::Rtn`). Velocities
//! are relative to these axes. s = sin nt, c = cos nt:
//! ```text
//! ẍ = 3n²x + 2nẏ + a_x,  ÿ = −2nẋ + a_y,  z̈ = −n²z + a_z
//! x = (4 − 3c) x₀ + s/n ẋ₀ + 2(1 − c)/n ẏ₀
//! y = 6(s − nt) x₀ + y₀ − 2(1 − c)/n ẋ₀ + (4s − 3nt)/n ẏ₀
//! z = c z₀ + s/n ż₀
//! ```
//! Errors are of second order in distance divided by radius: half a metre after a quarter of an orbit at a distance of 1.5 km in low orbit.

use crate::error::{WorldError, number};
use linkwork_spatial::{Mat3, Vec3};

/// The chief's orbit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ClohessyWiltshire {
    rate: f64,
}

/// Position and velocity of the deputy in the chief's rotating axes, m and m/s.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Relative {
    /// Position relative to the chief.
    pub position: Vec3,
    /// Velocity relative to the rotating axes.
    pub velocity: Vec3,
}

impl ClohessyWiltshire {
    /// Creates a chief on a circle of `radius` (m) about μ (m³/s²): n = √(μ/r³).
    ///
    /// # Errors
    /// μ or the radius is not above zero.
    pub fn new(mu: f64, radius: f64) -> Result<Self, WorldError> {
        number("mu, m³/s²", mu, |x| x > 0.0, "a gravitational parameter is above 0")?;
        number("radius of the orbit, m", radius, |x| x > 0.0, "a radius above 0")?;
        Ok(Self { rate: (mu / (radius * radius * radius)).sqrt() })
    }

    /// Returns n, rad/s.
    #[must_use]
    pub fn rate(&self) -> f64 {
        self.rate
    }

    /// Returns the four blocks of the state transition over `t` (s): from position and from velocity to position, then to velocity.
    #[must_use]
    pub fn transition(&self, t: f64) -> [[Mat3; 2]; 2] {
        let n = self.rate;
        let (s, c) = (n * t).sin_cos();
        // This computes 1 − cos without cancellation.
        let half = (0.5 * n * t).sin();
        let k = 2.0 * half * half;
        let rr = Mat3::new(1.0 + 3.0 * k, 0.0, 0.0, 6.0 * (s - n * t), 1.0, 0.0, 0.0, 0.0, c);
        let rv = Mat3::new(s, 2.0 * k, 0.0, -2.0 * k, 4.0 * s - 3.0 * n * t, 0.0, 0.0, 0.0, s) / n;
        let vr = Mat3::new(3.0 * s, 0.0, 0.0, -6.0 * k, 0.0, 0.0, 0.0, 0.0, -s) * n;
        let vv = Mat3::new(c, 2.0 * s, 0.0, -2.0 * s, 4.0 * c - 3.0, 0.0, 0.0, 0.0, c);
        [[rr, rv], [vr, vv]]
    }

    /// Returns the state `t` (s) later, without thrust.
    #[must_use]
    pub fn after(&self, state: &Relative, t: f64) -> Relative {
        let [[rr, rv], [vr, vv]] = self.transition(t);
        Relative {
            position: rr * state.position + rv * state.velocity,
            velocity: vr * state.position + vv * state.velocity,
        }
    }

    /// Returns the acceleration in the rotating axes without thrust, m/s².
    #[must_use]
    pub fn acceleration(&self, state: &Relative) -> Vec3 {
        let (n, p, v) = (self.rate, &state.position, &state.velocity);
        Vec3::new(3.0 * n * n * p.x + 2.0 * n * v.y, -2.0 * n * v.x, -n * n * p.z)
    }

    /// Returns the velocity with which the deputy must leave `from` to be at `to` after `t` (s).
    ///
    /// # Errors
    /// A time at which some positions cannot be reached: zero, and whole and half orbital periods.
    pub fn velocity_to_reach(&self, from: &Vec3, to: &Vec3, t: f64) -> Result<Vec3, WorldError> {
        let [[rr, rv], _] = self.transition(t);
        let help = "it must differ from 0 and from multiples of half a period";
        let error = WorldError::Number { what: "time of transfer, s", value: t, help };
        let scaled = rv * self.rate;
        if !(scaled.determinant().abs() > 1e-9) {
            return Err(error);
        }
        let inverse = scaled.try_inverse().ok_or(error)?;
        Ok(inverse * (to - rr * from) * self.rate)
    }
}
