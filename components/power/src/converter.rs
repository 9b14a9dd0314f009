//! `power.converter`: a regulated supply from another bus, for example of an instrument, or of a vehicle that is supplied from outside.
//! ```text
//! V_out = voltage while it is on                 P_out = V_out i_out
//! P_in  = P_out/η, or η P_out where power comes back         i_in = P_in/V_in          Q = P_in − P_out
//! off where V_in ≤ volts_min; on again where V_in ≥ volts_min + margin: events
//! ```
use linkwork_runtime::prelude::*;

/// Voltages and losses.
#[derive(Params, Clone, Debug)]
pub struct ConverterParams {
    /// Voltage of its output.
    #[param(unit = "V", range = 1e-3..)]
    pub voltage: f64,
    /// Efficiency of the converter.
    #[param(default = 1.0, range = 0.01..=1.0)]
    pub efficiency: f64,
    /// Voltage of its input at which it switches off.
    #[param(unit = "V", default = 1.0, range = 1e-3..)]
    pub volts_min: f64,
    /// Rise of the voltage above `volts_min` at which the converter switches on again.
    #[param(unit = "V", default = 1.0, range = 1e-3..)]
    pub margin: f64,
}

/// Input and output of the converter.
#[derive(Ports, Clone, Copy, Debug)]
pub struct ConverterIn {
    /// The bus that feeds it.
    #[port(connector)]
    pub input: Voltage,
    /// Connection for loads.
    #[port(connector)]
    pub output: Currents,
}

/// Regulated voltage.
#[derive(Ports, Clone, Copy, Debug)]
pub struct ConverterOut {
    /// Connection for loads: 0 V while the converter is off.
    #[port(connector)]
    pub output: Voltage,
    /// The converter is on.
    #[port("1")]
    pub on: bool,
}

/// Input power and heat of the converter.
#[derive(Ports, Clone, Copy, Debug)]
pub struct ConverterFlow {
    /// The bus that feeds it.
    #[port(connector)]
    pub input: Current,
    /// Power taken from the input bus; negative: fed back.
    #[port("W")]
    pub power: f64,
    /// Outlet of its heat, for the port of a thermal node. If it is not connected, the heat goes to the surroundings.
    #[port(connector)]
    pub case: HeatFlow,
}

/// State of the converter.
#[derive(State, Clone, Copy, Debug, PartialEq)]
pub struct Switch {
    /// The converter is off.
    #[port("1")]
    pub off: bool,
}

/// The two voltages.
#[derive(Ports, Clone, Copy, Debug)]
pub struct ConverterGuards {
    /// Input voltage minus the least one.
    #[port("V", falling)]
    pub above_min: f64,
    /// Input voltage minus the restart voltage.
    #[port("V", rising)]
    pub above_restart: f64,
}

/// A converter.
pub struct Converter {
    p: ConverterParams,
}

/// Converter: a regulated voltage from another bus, with losses; off while the input is too low, an event.
#[model("power.converter")]
impl Model for Converter {
    type Params = ConverterParams;
    type FeedthroughInputs = ConverterIn;
    type Outputs = ConverterOut;
    type FeedthroughOutputs = ConverterFlow;
    type DiscreteState = Switch;
    type Guards = ConverterGuards;
    fn outputs(&self, d: &Switch) -> ConverterOut {
        let voltage = if d.off { 0.0 } else { self.p.voltage };
        ConverterOut { output: Voltage { voltage }, on: !d.off }
    }
    fn feedthrough(&self, d: &Switch, u: &ConverterIn) -> ConverterFlow {
        let p = &self.p;
        let given =
            if d.off || u.input.voltage <= 0.0 { 0.0 } else { p.voltage * u.output.current };
        let power = if given > 0.0 { given / p.efficiency } else { given * p.efficiency };
        let case = HeatFlow { heat: power - given };
        ConverterFlow { input: u.input.current_of(power), power, case }
    }
    fn guards(&self, u: &ConverterIn) -> ConverterGuards {
        let above_min = u.input.voltage - self.p.volts_min;
        ConverterGuards { above_min, above_restart: above_min - self.p.margin }
    }
    fn handle_event(&self, fired: Fired<'_>, d: &Switch) -> ((), Switch) {
        ((), Switch { off: fired.fell(0) || (d.off && !fired.rose(1)) })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn converter() -> Converter {
        Converter {
            p: ConverterParams { voltage: 12.0, efficiency: 0.8, volts_min: 20.0, margin: 2.0 },
        }
    }

    fn flow(off: bool, voltage: f64, current: f64) -> ConverterFlow {
        let u = ConverterIn { input: Voltage { voltage }, output: Currents { current } };
        converter().feedthrough(&Switch { off }, &u)
    }

    #[test]
    fn losses_are_paid_in_both_directions() {
        // A load of 2 A at 12 V takes 24 W, for which the converter takes 30 W; of 24 W that come
        // back it feeds back 19.2 W.
        let y = flow(false, 30.0, 2.0);
        assert!(
            (y.power - 30.0).abs() < 1e-12
                && (y.input.current - 1.0).abs() < 1e-12
                && (y.case.heat - 6.0).abs() < 1e-12
        );
        let y = flow(false, 30.0, -2.0);
        assert!((y.power + 19.2).abs() < 1e-12 && (y.case.heat - 4.8).abs() < 1e-12, "{y:?}");
        let off = flow(true, 30.0, 2.0);
        assert_eq!((off.power, off.input.current, off.case.heat), (0.0, 0.0, 0.0));
        assert_eq!(flow(false, 0.0, 2.0).input.current, 0.0);
    }

    #[test]
    fn it_is_off_below_its_least_input_until_there_is_a_margin() {
        let m = converter();
        let u = ConverterIn { input: Voltage { voltage: 20.0 }, output: Currents { current: 0.0 } };
        let g = m.guards(&u);
        assert_eq!((g.above_min, g.above_restart), (0.0, -2.0));
        let after = |off: bool, which| m.handle_event(which, &Switch { off }).1.off;
        assert!(
            after(false, Fired::falling(0))
                && !after(true, Fired::rising(1))
                && !after(false, Fired::rising(1))
        );
        assert_eq!(m.outputs(&Switch { off: true }).output.voltage, 0.0);
        assert_eq!(m.outputs(&Switch { off: false }).output.voltage, 12.0);
    }
}
