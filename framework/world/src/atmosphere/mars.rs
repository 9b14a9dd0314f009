//! A simple model of the air of Mars, for first estimates.

use super::gas::{Air, Gas};

/// Returns the air by the model of NASA Glenn's educational pages, after Mars Global Surveyor, `h` m above the areoid:
/// ```text
/// p = 699 e^(−0.00009 h) Pa
/// T = −31 − 0.000998 h °C below 7000 m, −23.4 − 0.00222 h °C above;   ρ = p/(192.1 T)
/// ```
/// The gas constant of 192.1 J/(kg K) belongs to the fit. The linear temperature is limited to 110 K, which it reaches at 63 km: above that the model
/// is meaningless, and above 30 km it is far from reality.
#[must_use]
pub fn mars_simple(h: f64) -> Air {
    let celsius = if h < 7000.0 { -31.0 - 0.000998 * h } else { -23.4 - 0.00222 * h };
    let temperature = (celsius + 273.1).max(110.0);
    let pressure = 699.0 * (-0.00009 * h).exp();
    let gas = Gas { constant: 192.1, gamma: Gas::MARS.gamma };
    Air {
        density: pressure / (gas.constant * temperature),
        temperature,
        pressure,
        sound_speed: gas.sound_speed(temperature),
    }
}
