//! Perfect gases, Mach number and dynamic pressure.

/// State of the air at a point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Air {
    /// ρ, kg/m³.
    pub density: f64,
    /// Kinetic temperature, K.
    pub temperature: f64,
    /// p, Pa.
    pub pressure: f64,
    /// Speed of sound, m/s. It is meaningless where the mean free path is metres long.
    pub sound_speed: f64,
}

/// A perfect gas.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Gas {
    /// Specific gas constant R, J/(kg K).
    pub constant: f64,
    /// Ratio of specific heats γ.
    pub gamma: f64,
}

impl Gas {
    /// Dry air of the US Standard Atmosphere 1976: R = 8314.32/28.9644, γ = 1.4.
    pub const EARTH: Self = Self { constant: 8314.32 / 28.9644, gamma: 1.4 };
    /// The air of Mars: R 188.92, γ 1.29. The true γ varies from 1.33 in the cold to 1.2 behind shocks.
    pub const MARS: Self = Self { constant: 188.92, gamma: 1.29 };

    /// Returns √(γ R T), m/s, at a temperature in K.
    #[must_use]
    pub fn sound_speed(&self, temperature: f64) -> f64 {
        (self.gamma * self.constant * temperature).sqrt()
    }

    /// Returns the air with this density (kg/m³) and temperature (K): p = ρ R T.
    #[must_use]
    pub fn air(&self, density: f64, temperature: f64) -> Air {
        Air {
            density,
            temperature,
            pressure: density * self.constant * temperature,
            sound_speed: self.sound_speed(temperature),
        }
    }
}

/// Returns the Mach number: speed relative to the air (m/s) divided by the speed of sound.
#[must_use]
pub fn mach(speed: f64, air: &Air) -> f64 {
    speed / air.sound_speed
}

/// Returns ½ ρ v², Pa; `speed` is relative to the air, m/s.
#[must_use]
pub fn dynamic_pressure(speed: f64, air: &Air) -> f64 {
    0.5 * air.density * speed * speed
}
