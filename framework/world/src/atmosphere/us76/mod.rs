//! US Standard Atmosphere 1976, −5 to 1000 km.
//!
//! A closed form is used below 86 km geometric altitude. Above, the diffusion equations of the species are integrated once and tabulated as cubics of
//! ln ρ and ln p in each kilometre.
//! NOAA-S/T 76-1562, *U.S. Standard Atmosphere, 1976*.

mod lower;
mod upper;

use super::gas::Air;

/// The Earth's radius of the geopotential, m.
const R0: f64 = 6_356_766.0;
/// R*, J/(kmol K); M₀, kg/kmol; g₀, m/s²; γ.
const R_STAR: f64 = 8314.32;
const M0: f64 = 28.9644;
const G0: f64 = 9.80665;
const GAMMA: f64 = 1.4;
/// Altitude from which the upper part applies, m.
const SEAM: f64 = 86_000.0;

/// Returns H = r₀ z/(r₀ + z), m: the geopotential altitude of a geometric one, r₀ = 6356766 m.
#[must_use]
pub fn geopotential_altitude(z: f64) -> f64 {
    R0 * z / (R0 + z)
}

/// Returns z = r₀ H/(r₀ − H), m.
#[must_use]
pub fn geometric_altitude(H: f64) -> f64 {
    R0 * H / (R0 - H)
}

/// The standard atmosphere, ready for evaluation.
#[derive(Clone, Debug)]
pub struct Us76 {
    lower: lower::Layers,
    upper: upper::Profile,
    /// Ratio of the pressure at the seam to that of the standard.
    above: f64,
}

impl Default for Us76 {
    fn default() -> Self {
        Self::new()
    }
}

impl Us76 {
    /// Integrates the upper part: takes 3 ms and 60 kB.
    #[must_use]
    pub fn new() -> Self {
        Self::with_offset(0.0)
    }

    /// Creates the atmosphere of a hot or cold day. `offset` (K) is added to the temperature up to 71 km geopotential altitude and fades to zero at
    /// 86 km. The pressure at sea level is standard, and the air is in hydrostatic balance. Above 86 km, pressure and density are multiplied by one
    /// factor.
    #[must_use]
    pub fn with_offset(offset: f64) -> Self {
        let lower = lower::Layers::new(offset);
        let above = lower.at(SEAM).pressure / lower::Layers::new(0.0).at(SEAM).pressure;
        Self { lower, upper: upper::Profile::new(), above }
    }

    /// Returns the air at the geometric altitude `z` (m). Below −5 km the lowest layer continues; above 1000 km density and pressure continue with
    /// the slope of the last kilometre. The speed of sound above 86 km is √(1.4 p/ρ), which the standard does not define.
    #[must_use]
    pub fn at(&self, z: f64) -> Air {
        if z < SEAM {
            return self.lower.at(z);
        }
        let air = self.upper.at(z);
        Air { density: air.density * self.above, pressure: air.pressure * self.above, ..air }
    }
}
