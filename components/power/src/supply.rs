//! Supplies for parts whose real supply is not simulated: `power.ideal_supply`, a constant voltage; `power.programmable_supply`, a commanded one;
//! `power.source`, a commanded power.
//! ```text
//! ideal supply    V constant, whatever current is drawn;   Ė = V i
//! source          i = −P/V into the bus that it is connected to
//! ```
use linkwork_runtime::prelude::*;

/// Voltage.
#[derive(Params, Clone, Debug)]
pub struct IdealSupplyParams {
    /// Voltage.
    #[param(unit = "V", range = 1e-3..)]
    pub voltage: f64,
}

/// Current drawn from the supply.
#[derive(Ports, Clone, Copy, Debug)]
pub struct IdealSupplyIn {
    /// Connection for loads.
    #[port(connector)]
    pub terminal: Currents,
}

/// Voltage.
#[derive(Ports, Clone, Copy, Debug)]
pub struct IdealSupplyOut {
    /// Connection for loads.
    #[port(connector)]
    pub terminal: Voltage,
    /// Energy supplied since the start.
    #[port("J")]
    pub energy: f64,
}

/// Power of the supply.
#[derive(Ports, Clone, Copy, Debug)]
pub struct IdealSupplyFlow {
    /// Current given.
    #[port("A")]
    pub current: f64,
    /// Power supplied; negative: fed back.
    #[port("W")]
    pub power: f64,
}

/// Energy given.
#[derive(State, Clone, Copy, Debug)]
pub struct IdealSupplyState {
    /// Energy given.
    #[port("J")]
    pub energy: f64,
}

/// A constant voltage.
pub struct IdealSupply {
    p: IdealSupplyParams,
}

/// Ideal supply: a constant voltage, independent of the current; integrates the supplied energy.
#[model("power.ideal_supply")]
impl Model for IdealSupply {
    type Params = IdealSupplyParams;
    type FeedthroughInputs = IdealSupplyIn;
    type Outputs = IdealSupplyOut;
    type FeedthroughOutputs = IdealSupplyFlow;
    type State = IdealSupplyState;
    fn outputs(&self, x: &IdealSupplyState) -> IdealSupplyOut {
        IdealSupplyOut { terminal: Voltage { voltage: self.p.voltage }, energy: x.energy }
    }
    fn feedthrough(&self, u: &IdealSupplyIn) -> IdealSupplyFlow {
        let current = u.terminal.current;
        IdealSupplyFlow { current, power: self.p.voltage * current }
    }
    fn derivatives(&self, u: &IdealSupplyIn) -> IdealSupplyState {
        IdealSupplyState { energy: self.p.voltage * u.terminal.current }
    }
}

/// Commanded voltage.
#[derive(Ports, Clone, Copy, Debug)]
pub struct ProgrammableIn {
    /// Commanded voltage; values below 0 count as 0.
    #[port("V")]
    pub volts: f64,
}

/// Voltage.
#[derive(Ports, Clone, Copy, Debug)]
pub struct ProgrammableOut {
    /// Connection for loads.
    #[port(connector)]
    pub terminal: Voltage,
}

/// A commanded voltage.
pub struct ProgrammableSupply;

/// Programmable supply: a commanded voltage, independent of the current, like a laboratory supply.
#[model("power.programmable_supply")]
impl Model for ProgrammableSupply {
    // The voltage does not follow from the currents: they are inputs without feedthrough.
    type Inputs = IdealSupplyIn;
    type FeedthroughInputs = ProgrammableIn;
    type FeedthroughOutputs = ProgrammableOut;
    type State = IdealSupplyState;
    fn build(_: ()) -> Result<Self, BuildError> {
        Ok(ProgrammableSupply)
    }
    fn feedthrough(&self, ud: &ProgrammableIn) -> ProgrammableOut {
        ProgrammableOut { terminal: Voltage { voltage: ud.volts.max(0.0) } }
    }
    fn derivatives(&self, u: &IdealSupplyIn, ud: &ProgrammableIn) -> IdealSupplyState {
        IdealSupplyState { energy: ud.volts.max(0.0) * u.terminal.current }
    }
}

/// Command and bus.
#[derive(Ports, Clone, Copy, Debug)]
pub struct SourceIn {
    /// Power to feed in.
    #[port("W", default = 0.0)]
    pub power: f64,
    /// Connection to the `charger` of a battery, or to a terminal.
    #[port(connector)]
    pub output: Voltage,
}

/// Current fed in.
#[derive(Ports, Clone, Copy, Debug)]
pub struct SourceOut {
    /// Connection to the `charger` of a battery, or to a terminal.
    #[port(connector)]
    pub output: Current,
    /// Power fed in: zero without a voltage.
    #[port("W")]
    pub fed: f64,
}

/// A source of a commanded power.
pub struct Source;

/// Feeds a commanded power into a bus, as a charger does.
#[model("power.source")]
impl Model for Source {
    type FeedthroughInputs = SourceIn;
    type FeedthroughOutputs = SourceOut;
    fn build(_: ()) -> Result<Self, BuildError> {
        Ok(Source)
    }
    fn feedthrough(&self, u: &SourceIn) -> SourceOut {
        let output = u.output.current_of(-u.power);
        SourceOut { output, fed: -output.current * u.output.voltage }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_ideal_supply_gives_and_counts_what_is_drawn() {
        let s = IdealSupply { p: IdealSupplyParams { voltage: 28.0 } };
        let x = IdealSupplyState { energy: 5.0 };
        let y = s.outputs(&x);
        assert_eq!((y.terminal.voltage, y.energy), (28.0, 5.0));
        for current in [3.0, -2.0] {
            let u = IdealSupplyIn { terminal: Currents { current } };
            let flow = s.feedthrough(&u);
            assert_eq!((flow.current, flow.power), (current, 28.0 * current));
            assert_eq!(s.derivatives(&u).energy, flow.power);
        }
    }

    #[test]
    fn a_source_feeds_its_power_at_any_voltage_and_none_without() {
        let fed = |voltage: f64| {
            let u = SourceIn { power: 40.0, output: Voltage { voltage } };
            Source.feedthrough(&u)
        };
        for voltage in [20.0, 33.0] {
            let y = fed(voltage);
            assert!(
                (y.output.current * voltage + 40.0).abs() < 1e-12 && (y.fed - 40.0).abs() < 1e-12
            );
        }
        assert_eq!((fed(0.0).output.current, fed(0.0).fed), (0.0, 0.0));
    }
}
