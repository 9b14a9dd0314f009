//! `flight.blow_down`: a tank that its own gas empties, and pressure that falls as it does.
//! ```text
//! V = V₀ + (m₀ − m)/ρ          gas over the propellant         p = p₀ (V₀/V)^γ
//! throttle = (p/p₀)^n          what it does to engines: thrust over that at the start
//! ```
//! γ 1: slow, the walls keep the gas warm; 1.4 (nitrogen), 1.67 (helium): fast. The propellant comes from a
//! `flight.propellant_tank`, the throttle goes to its engines.

use linkwork_runtime::prelude::*;

/// Gas and propellant.
#[derive(Params, Clone, Debug)]
pub struct BlowDownParams {
    /// Pressure at the start.
    #[param(unit = "Pa", range = 0.0..)]
    pub pressure: f64,
    /// Volume of the gas at the start.
    #[param(unit = "m^3", range = 1e-9..)]
    pub ullage: f64,
    /// Propellant at the start.
    #[param(unit = "kg", range = 0.0..)]
    pub propellant: f64,
    /// Density of the propellant.
    #[param(unit = "kg/m^3", default = 1000.0, range = 1e-3..)]
    pub density: f64,
    /// Exponent of the gas γ.
    #[param(default = 1.0, range = 1.0..=2.0)]
    pub exponent: f64,
    /// Exponent n of thrust over pressure.
    #[param(default = 1.0, range = 0.0..=2.0)]
    pub thrust_exponent: f64,
}

/// What is left.
#[derive(Ports, Clone, Copy, Debug)]
pub struct BlowDownIn {
    /// Propellant that is left.
    #[port("kg")]
    pub propellant: f64,
}

/// Pressure and what it does.
#[derive(Ports, Clone, Copy, Debug)]
pub struct BlowDownOut {
    /// Pressure of the gas.
    #[port("Pa")]
    pub pressure: f64,
    /// Thrust over that at the start.
    #[port("1")]
    pub throttle: f64,
}

/// A tank that blows down.
pub struct BlowDown {
    p: BlowDownParams,
}

/// Pressure of a tank that blows down, and the throttle that it means for engines.
#[model("flight.blow_down")]
impl Model for BlowDown {
    type Params = BlowDownParams;
    type Ud = BlowDownIn;
    type Yd = BlowDownOut;
    fn direct(&self, _: &Clock, _: &(), _: &(), u: &BlowDownIn) -> BlowDownOut {
        let p = &self.p;
        let gone = (p.propellant - u.propellant).max(0.0);
        let ratio = (p.ullage / (p.ullage + gone / p.density)).powf(p.exponent);
        BlowDownOut { pressure: p.pressure * ratio, throttle: ratio.powf(p.thrust_exponent) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pressure_times_volume_to_the_gamma_stays() {
        let p = BlowDownParams {
            pressure: 2e6,
            ullage: 0.05,
            propellant: 150.0,
            density: 1000.0,
            exponent: 1.4,
            thrust_exponent: 0.9,
        };
        let m = BlowDown { p };
        let at = |left: f64| {
            m.direct(&Clock::at(0.0, 0.1, 0), &(), &(), &BlowDownIn { propellant: left }, &())
        };
        assert_eq!((at(150.0).pressure, at(150.0).throttle), (2e6, 1.0));
        for left in [120.0, 60.0, 0.0] {
            let y = at(left);
            let volume: f64 = 0.05 + (150.0 - left) / 1000.0;
            let kept = y.pressure * volume.powf(1.4) / (2e6 * 0.05f64.powf(1.4));
            assert!((kept - 1.0).abs() < 1e-13);
            assert!((y.throttle - (y.pressure / 2e6).powf(0.9)).abs() < 1e-14);
        }
    }
}
