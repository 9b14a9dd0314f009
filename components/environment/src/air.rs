//! Exponential atmosphere.
//! ```text
//! ρ = ρ₀ e^(−(h − h₀)/H)      p = ρ R_s T      a = √(γ R_s T)      T = g H/R_s when it is not given
//! ```
//! The model is isothermal; it is valid for a range of one or two scale heights, and useful for closed-form checks.

use linkwork_spatial::Vec3;

/// Constants of the atmosphere.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Exponential {
    /// h₀, m.
    pub reference_height: f64,
    /// Density at h₀, kg/m³.
    pub density: f64,
    /// Scale height, m.
    pub scale_height: f64,
    /// Temperature, K.
    pub temperature: f64,
    /// Specific gas constant, J/(kg K).
    pub gas_constant: f64,
    /// Ratio of specific heats.
    pub heat_ratio: f64,
    /// Steady wind, W, m/s.
    pub wind: Vec3,
}

/// The state of the air at a point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AirState {
    /// Density, kg/m³.
    pub density: f64,
    /// Pressure, Pa.
    pub pressure: f64,
    /// Temperature, K.
    pub temperature: f64,
    /// Speed of sound, m/s.
    pub speed_of_sound: f64,
}

impl Exponential {
    /// The air at a height (m).
    pub fn at(&self, height: f64) -> AirState {
        let density = self.density * (-(height - self.reference_height) / self.scale_height).exp();
        let rt = self.gas_constant * self.temperature;
        AirState {
            density,
            pressure: density * rt,
            temperature: self.temperature,
            speed_of_sound: (self.heat_ratio * rt).sqrt(),
        }
    }
}

/// Acceleration (m/s²) of a point mass `mu` (m³/s²) at the origin on a point `p` (m); zero at the centre.
pub fn point_mass(mu: f64, p: Vec3) -> Vec3 {
    let r = p.norm();
    if r > 0.0 { p * (-mu / (r * r * r)) } else { Vec3::zeros() }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn mars() -> Exponential {
        Exponential {
            reference_height: 0.0,
            density: 0.020,
            scale_height: 11_100.0,
            temperature: 210.0,
            gas_constant: 191.8,
            heat_ratio: 1.33,
            wind: Vec3::zeros(),
        }
    }

    #[test]
    fn density_falls_by_e_in_a_scale_height() {
        let at = |h: f64| mars().at(h);
        assert!((at(0.0).density - 0.020).abs() < 1e-12);
        assert!((at(11_100.0).density / at(0.0).density - (-1f64).exp()).abs() < 1e-9);
        assert!((at(0.0).speed_of_sound - 231.45).abs() < 0.1);
        assert!((at(0.0).pressure - 805.56).abs() < 0.01);
    }

    #[test]
    fn the_density_is_that_of_the_reference_height() {
        let a = Exponential { reference_height: 5e3, ..mars() };
        assert!((a.at(5e3 + 11_100.0).density - 0.020 / 1f64.exp()).abs() < 1e-12);
    }

    #[test]
    fn point_mass_is_the_gradient_of_its_potential_and_right_on_mars() {
        let mu = 4.282_837_521_4e13;
        let g = point_mass(mu, Vec3::new(3_396_190.0, 0.0, 0.0));
        assert!((g.x + 3.7132).abs() < 1e-3 && g.y == 0.0, "{g}");
        let p = Vec3::new(2.1e6, -1.7e6, 3.3e6);
        let u = |p: Vec3| -mu / p.norm();
        for k in 0..3 {
            let mut e = Vec3::zeros();
            e[k] = 10.0;
            let slope = (u(p + e) - u(p - e)) / 20.0;
            assert!((point_mass(mu, p)[k] + slope).abs() < 1e-7);
        }
        assert_eq!(point_mass(mu, Vec3::zeros()), Vec3::zeros());
    }
}
