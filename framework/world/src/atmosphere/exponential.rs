//! ρ = ρ₀ e^(−(h − h₀)/H): one scale height.

use crate::error::{WorldError, number};

/// An isothermal atmosphere.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Exponential {
    density: f64,
    altitude: f64,
    scale_height: f64,
}

impl Exponential {
    /// Creates the model from ρ₀ (kg/m³) at altitude h₀ (m) and the scale height H (m).
    ///
    /// # Errors
    /// ρ₀ is negative, H is not above zero, or a number is not finite.
    pub fn new(density: f64, altitude: f64, scale_height: f64) -> Result<Self, WorldError> {
        number("density, kg/m³", density, |x| x >= 0.0, "a density of at least 0")?;
        number("altitude of that density, m", altitude, |_| true, "a finite altitude")?;
        number("scale height, m", scale_height, |x| x > 0.0, "a length above 0")?;
        Ok(Self { density, altitude, scale_height })
    }

    /// Returns ρ at altitude `h` (m), kg/m³.
    #[must_use]
    pub fn density(&self, h: f64) -> f64 {
        self.density * ((self.altitude - h) / self.scale_height).exp()
    }
}
