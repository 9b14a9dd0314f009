//! `flight.blow_down`: a tank that its own gas empties, and pressure that falls as it does.
//! ```text
//! V = V₀ + (U₀ − U)            gas over the propellant; U: volume of the propellant, U₀ at the start
//! p = p₀ (V₀/V)^γ
//! throttle = (p/p₀)^n          effect on engines: thrust relative to the thrust at the start
//! ```
//! γ 1: slow, the walls keep the gas warm; 1.4 (nitrogen), 1.67 (helium): fast. The volume of the propellant comes from the
//! `flight.propellant_tank` that the gas empties, also at the start of the run or of the phase that adds this part: `pressure` and `ullage` are the
//! values at that instant. Wire the throttle to the engines of the tank.

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
    /// Exponent of the gas γ.
    #[param(default = 1.0, range = 1.0..=2.0)]
    pub exponent: f64,
    /// Exponent n of the thrust as a function of pressure.
    #[param(default = 1.0, range = 0.0..=2.0)]
    pub thrust_exponent: f64,
}

/// Remaining propellant.
#[derive(Ports, Clone, Copy, Debug)]
pub struct BlowDownIn {
    /// Volume of the remaining propellant: `volume` of its tank.
    #[port("m^3")]
    pub volume: f64,
}

/// Pressure and its effect on the thrust.
#[derive(Ports, Clone, Copy, Debug)]
pub struct BlowDownOut {
    /// Pressure of the gas.
    #[port("Pa")]
    pub pressure: f64,
    /// Ratio of the thrust to that at the start.
    #[port("1")]
    pub throttle: f64,
}

/// Propellant volume at the start.
#[derive(State, Clone, Copy, Debug)]
pub struct Filled {
    /// Volume of the propellant when the part began.
    #[port("m^3")]
    pub volume: f64,
    /// The part has begun.
    #[port]
    pub begun: bool,
}

/// Guard of the least gas volume.
#[derive(Ports, Clone, Copy, Debug)]
pub struct Squeezed {
    /// Volume of the propellant minus the volume at which only a thousandth of the gas volume remains.
    #[port("m^3", rising)]
    pub full: f64,
}

/// Least volume of the gas as a fraction of the volume at the start.
const LEAST: f64 = 1e-3;

/// A tank that blows down.
pub struct BlowDown {
    p: BlowDownParams,
}

/// Pressure of a tank that blows down, and the throttle of engines that corresponds to it.
#[model("flight.blow_down")]
impl Model for BlowDown {
    const MODES: bool = true;
    type Params = BlowDownParams;
    type FeedthroughInputs = BlowDownIn;
    type FeedthroughOutputs = BlowDownOut;
    type DiscreteState = Filled;
    type Guards = Squeezed;
    fn mode(&self, d: &Filled, u: &BlowDownIn) -> Filled {
        if d.begun { *d } else { Filled { volume: u.volume, begun: true } }
    }
    fn feedthrough(&self, d: &Filled, u: &BlowDownIn) -> BlowDownOut {
        let p = &self.p;
        // A trial step may continue past the end of the gas.
        let (gas, least) = (p.ullage + (d.volume - u.volume), LEAST * p.ullage);
        let gas = if gas < least { least } else { gas };
        let ratio = (p.ullage / gas).powf(p.exponent);
        BlowDownOut { pressure: p.pressure * ratio, throttle: ratio.powf(p.thrust_exponent) }
    }
    fn guards(&self, d: &Filled, u: &BlowDownIn) -> Squeezed {
        let room = (1.0 - LEAST) * self.p.ullage;
        Squeezed { full: if d.begun { u.volume - d.volume - room } else { -1.0 } }
    }
    fn handle_event(&self, d: &Filled) -> ((), Filled) {
        ((), *d)
    }
    fn runtime_warning(&self, d: &Filled) -> Option<BuildError> {
        let fact = format!(
            "the tank contains more than its volume, which is {} m³ of propellant and {} m³ of gas at the start",
            d.volume, self.p.ullage
        );
        let help = "write a larger `ullage`, or end the flow into the tank earlier";
        Some(BuildError::new(fact).help(help).at("ullage").stopping(true))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pressure_times_volume_to_the_gamma_stays() {
        let p = BlowDownParams { pressure: 2e6, ullage: 0.05, exponent: 1.4, thrust_exponent: 0.9 };
        let m = BlowDown { p };
        let full = BlowDownIn { volume: 0.15 };
        let d = m.mode(&m.init_d(), &full);
        assert_eq!(m.mode(&d, &BlowDownIn { volume: 0.1 }).volume, 0.15);
        let at = |left: f64| m.feedthrough(&d, &BlowDownIn { volume: left });
        assert_eq!((at(0.15).pressure, at(0.15).throttle), (2e6, 1.0));
        let full = |volume: f64| m.guards(&d, &BlowDownIn { volume }).full;
        assert!(full(0.1999) < 0.0 && full(0.2) > 0.0);
        // The law also holds if the tank is filled again.
        for left in [0.12, 0.06, 0.0, 0.17] {
            let y = at(left);
            let volume: f64 = 0.05 + 0.15 - left;
            let kept = y.pressure * volume.powf(1.4) / (2e6 * 0.05f64.powf(1.4));
            assert!((kept - 1.0).abs() < 1e-12, "{kept}");
            assert!((y.throttle - (y.pressure / 2e6).powf(0.9)).abs() < 1e-14);
        }
    }
}
