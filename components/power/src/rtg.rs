//! `power.rtg`: a radioisotope thermoelectric generator.
//! ```text
//! P_thermal = P₀ 2^(−(age + t)/T½)           P_el = η e^(−k (age + t)) P_thermal          Q = P_thermal − P_el, all where nothing is connected
//! ```
//! Fuel decays with the half-life of its isotope, and thermocouples degrade: η is their efficiency when new and k its rate of decay. The efficiency
//! is for nominal hot and cold temperatures; it does not depend on the temperature of the fins.

use linkwork_runtime::prelude::*;

/// Half-life of plutonium-238: 87.7 years of 365.25 days, s.
pub const PU238_HALF_LIFE: f64 = 87.7 * 365.25 * 86_400.0;

/// Fuel and thermocouples.
#[derive(Params, Clone, Debug)]
pub struct RtgParams {
    /// Thermal power of new fuel.
    #[param(unit = "W", range = 0.0..)]
    pub thermal_power: f64,
    /// Age of the fuel at the start.
    #[param(unit = "s", default = 0.0, range = 0.0..)]
    pub age: f64,
    /// Half-life of the fuel. Default: plutonium-238, 87.7 years.
    #[param(unit = "s", default = PU238_HALF_LIFE, range = 1.0..)]
    pub half_life: f64,
    /// Efficiency η of new thermocouples.
    #[param(default = 0.055, range = 0.0..=1.0)]
    pub efficiency: f64,
    /// Decay rate k of the efficiency.
    #[param(unit = "1/s", default = 0.0, range = 0.0..)]
    pub wear: f64,
}

/// Power and heat.
#[derive(Ports, Clone, Copy, Debug)]
pub struct RtgOut {
    /// Thermal power of the fuel.
    #[port("W", gained)]
    pub thermal: f64,
    /// Electrical power.
    #[port("W")]
    pub power: f64,
}

/// Voltage of the electrical output.
#[derive(Ports, Clone, Copy, Debug)]
pub struct RtgIn {
    /// Electrical output, for a battery's `charger`, which takes all of the power.
    #[port(connector)]
    pub output: OpenVoltage,
}

/// Current of the electrical output.
#[derive(Ports, Clone, Copy, Debug)]
pub struct RtgFeed {
    /// Electrical output, for a battery's `charger`, which takes all of the power.
    #[port(connector)]
    pub output: Current,
    /// Outlet of its waste heat, for the port of a thermal node. All of the thermal power is waste heat if `output` has no voltage.
    #[port(connector)]
    pub case: HeatFlow,
}

/// A radioisotope generator.
pub struct Rtg {
    p: RtgParams,
}

impl Rtg {
    /// Returns thermal and electrical power, W.
    fn powers(&self, c: &Clock) -> [f64; 2] {
        let p = &self.p;
        let age = p.age + c.t;
        let thermal = p.thermal_power * (-age / p.half_life).exp2();
        [thermal, p.efficiency * (-p.wear * age).exp() * thermal]
    }
}

/// Radioisotope thermoelectric generator: decaying fuel, degrading thermocouples, waste heat.
#[model("power.rtg")]
impl Model for Rtg {
    type Params = RtgParams;
    type FeedthroughInputs = RtgIn;
    type Outputs = RtgOut;
    type FeedthroughOutputs = RtgFeed;
    fn outputs(&self, clock: &Clock) -> RtgOut {
        let [thermal, power] = self.powers(clock);
        RtgOut { thermal, power }
    }
    fn feedthrough(&self, clock: &Clock, u: &RtgIn) -> RtgFeed {
        let [thermal, power] = self.powers(clock);
        let output = u.output.current_of(-power);
        let case = HeatFlow { heat: thermal + output.current * u.output.voltage };
        RtgFeed { output, case }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const YEAR: f64 = 365.25 * 86_400.0;

    fn at(p: &RtgParams, t: f64) -> RtgOut {
        Rtg { p: p.clone() }.outputs(&Clock::at(t, 1.0, 0))
    }

    fn params() -> RtgParams {
        RtgParams {
            thermal_power: 2000.0,
            age: 0.0,
            half_life: PU238_HALF_LIFE,
            efficiency: 0.055,
            wear: 0.0,
        }
    }

    #[test]
    fn half_is_left_after_the_half_life_and_age_counts_as_time() {
        let p = params();
        let y = at(&p, 87.7 * YEAR);
        assert!((y.thermal - 1000.0).abs() < 1e-9 && (y.power - 55.0).abs() < 1e-10, "{y:?}");
        let old = RtgParams { age: 14.0 * YEAR, ..p.clone() };
        assert_eq!(at(&old, 3.0 * YEAR).thermal, at(&p, 17.0 * YEAR).thermal);
        // In a year 0.787 % of plutonium-238 decays.
        assert!((1.0 - at(&p, YEAR).thermal / 2000.0 - 0.00787).abs() < 5e-6);
    }

    #[test]
    fn what_is_not_electricity_is_heat() {
        let p = RtgParams { wear: 0.035 / YEAR, age: 2.0 * YEAR, ..params() };
        for t in [0.0, 0.3 * YEAR, 20.0 * YEAR] {
            let y = at(&p, t);
            let u = RtgIn { output: OpenVoltage { voltage: 28.0 } };
            let feed = Rtg { p: p.clone() }.feedthrough(&Clock::at(t, 1.0, 0), &u);
            assert!((feed.output.current * 28.0 + y.power).abs() < 1e-12);
            assert!((feed.case.heat + y.power - y.thermal).abs() < 1e-9);
            // Power that no load takes stays as heat.
            let u = RtgIn { output: OpenVoltage { voltage: 0.0 } };
            let open = Rtg { p: p.clone() }.feedthrough(&Clock::at(t, 1.0, 0), &u);
            assert_eq!((open.output.current, open.case.heat), (0.0, y.thermal));
            let worn = 0.055 * f64::exp(-0.035 * (2.0 + t / YEAR));
            assert!((y.power / y.thermal / worn - 1.0).abs() < 1e-12, "{y:?}");
        }
    }
}
