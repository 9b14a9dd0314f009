//! Dynamic viscosity of gases.

/// Sutherland's law (1893) for gases at low pressure:
/// ```text
/// μ = b T^1.5/(T + S)
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sutherland {
    /// b, kg/(m s √K).
    pub factor: f64,
    /// S, K.
    pub constant: f64,
}

impl Sutherland {
    /// Dry air of the US Standard Atmosphere 1976, equation 51 (b 1.458e-6, S 110.4), valid below 86 km.
    pub const EARTH: Self = Self { factor: 1.458e-6, constant: 110.4 };
    /// Carbon dioxide, which is 95 % of the air of Mars: S 240 (Crane, *Flow of Fluids*, Technical Paper 410, page A-5), b from 14.8 µPa s at 293.15
    /// K.
    pub const CARBON_DIOXIDE: Self = Self { factor: 1.572e-6, constant: 240.0 };

    /// Creates the law from the `viscosity` (Pa s) at one `temperature` (K), and Sutherland's `constant` S (K).
    #[must_use]
    pub fn through(viscosity: f64, temperature: f64, constant: f64) -> Self {
        Self { factor: viscosity * (temperature + constant) / temperature.powf(1.5), constant }
    }

    /// Returns μ, Pa s, at a temperature in K.
    #[must_use]
    pub fn at(&self, temperature: f64) -> f64 {
        self.factor * temperature * temperature.sqrt() / (temperature + self.constant)
    }
}
