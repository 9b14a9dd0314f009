//! `power.heater`: an electrical heater with a thermostat.
//! ```text
//! on where T ≤ `on_below`, off where T ≥ `on_below` + `band`, between them as it was
//! P = power while it is on, enabled and supplied (V ≥ `volts_min`), else 0;   i = P/V
//! ```
//! Switching is an event, located on the dense output of the integrator. A run that starts outside the two thresholds needs no event: below it heats,
//! above it does not. The thermostat continues to switch while the heater is disabled or has no supply; heating resumes when both are available.

use linkwork_runtime::prelude::*;

/// Power and thresholds.
#[derive(Params, Clone, Debug)]
pub struct HeaterParams {
    /// Power while it heats.
    #[param(unit = "W", range = 0.0..)]
    pub power: f64,
    /// The heater switches on when the temperature is at or below this.
    #[param(unit = "K", range = 0.0..)]
    pub on_below: f64,
    /// The heater switches off when the temperature has risen by this above `on_below`.
    #[param(unit = "K", default = 5.0, range = 1e-3..)]
    pub band: f64,
    /// Supply voltage below which the heater is off. Above it, a converter keeps the power constant.
    #[param(unit = "V", default = 1.0, range = 1e-3..)]
    pub volts_min: f64,
    /// Whether the heater is on at the start, if the temperature is between the thresholds.
    #[param(default = false)]
    pub start: bool,
}

/// Temperature and switches.
#[derive(Ports, Clone, Copy, Debug)]
pub struct HeaterIn {
    /// The thermal node that it heats and whose temperature its thermostat reads.
    #[port(connector)]
    pub node: Temperature,
    /// Command: heating is permitted.
    #[port("1", default = true)]
    pub enable: bool,
    /// Supply.
    #[port(connector)]
    pub supply: Voltage,
}

/// Heat and load.
#[derive(Ports, Clone, Copy, Debug)]
pub struct HeaterOut {
    /// Heat flow to the node.
    #[port(connector)]
    pub node: HeatFlow,
    /// Electrical power drawn; equal to the heat flow.
    #[port("W")]
    pub power: f64,
    /// Supply.
    #[port(connector)]
    pub supply: Current,
    /// The heater is heating.
    #[port("1")]
    pub on: bool,
}

/// The thermostat.
#[derive(State, Clone, Copy, Debug, PartialEq)]
pub struct Thermostat {
    /// The contact is closed.
    #[port("1")]
    pub closed: bool,
    /// A threshold has been crossed since the start.
    #[port("1")]
    pub crossed: bool,
    /// Number of threshold crossings.
    #[port("1")]
    pub switchings: f64,
}

/// The thresholds.
#[derive(Ports, Clone, Copy, Debug)]
pub struct ThermostatGuards {
    /// Temperature above the lower threshold.
    #[port("K", falling)]
    pub above_on: f64,
    /// Temperature above the upper threshold.
    #[port("K", rising)]
    pub above_off: f64,
}

/// A heater.
pub struct Heater {
    p: HeaterParams,
}

/// Electrical heater with a thermostat: two thresholds, whose crossings are events.
#[model("power.heater")]
impl Model for Heater {
    type Params = HeaterParams;
    type FeedthroughInputs = HeaterIn;
    type FeedthroughOutputs = HeaterOut;
    type DiscreteState = Thermostat;
    type Guards = ThermostatGuards;
    fn init_d(&self) -> Thermostat {
        Thermostat { closed: self.p.start, crossed: false, switchings: 0.0 }
    }
    fn feedthrough(&self, d: &Thermostat, u: &HeaterIn) -> HeaterOut {
        let p = &self.p;
        let closed = if d.crossed || (0.0..=p.band).contains(&(u.node.temperature - p.on_below)) {
            d.closed
        } else {
            u.node.temperature < p.on_below
        };
        let on = closed && u.enable && u.supply.voltage >= p.volts_min;
        let power = if on { p.power } else { 0.0 };
        HeaterOut { node: HeatFlow { heat: power }, power, supply: u.supply.current_of(power), on }
    }
    fn guards(&self, u: &HeaterIn) -> ThermostatGuards {
        ThermostatGuards {
            above_on: u.node.temperature - self.p.on_below,
            above_off: u.node.temperature - self.p.on_below - self.p.band,
        }
    }
    /// At and below the lower threshold the contact is closed; at and above the upper one it is open.
    fn handle_event(&self, fired: Fired<'_>, d: &Thermostat) -> ((), Thermostat) {
        let closed = fired.fell(0) || (d.closed && !fired.rose(1));
        let switchings = d.switchings + f64::from(u8::from(closed != d.closed));
        ((), Thermostat { closed, crossed: true, switchings })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SUPPLY: Voltage = Voltage { voltage: 24.0 };

    fn heater(start: bool) -> Heater {
        Heater {
            p: HeaterParams { power: 12.0, on_below: 253.0, band: 5.0, volts_min: 20.0, start },
        }
    }

    fn on(h: &Heater, d: &Thermostat, temperature: f64) -> bool {
        let u = HeaterIn { node: Temperature { temperature }, enable: true, supply: SUPPLY };
        let y = h.feedthrough(d, &u);
        assert_eq!((y.node.heat, y.power), (if y.on { 12.0 } else { 0.0 }, y.node.heat));
        assert_eq!(y.supply.current * 24.0, y.power);
        y.on
    }

    fn fire(h: &Heater, d: &Thermostat, which: usize) -> Thermostat {
        let which = if which == 0 { Fired::falling(0) } else { Fired::rising(1) };
        h.handle_event(which, d).1
    }

    #[test]
    fn a_start_outside_the_thresholds_needs_no_event() {
        for start in [false, true] {
            let h = heater(start);
            let d = h.init_d();
            assert!(on(&h, &d, 200.0) && !on(&h, &d, 300.0));
            assert_eq!(on(&h, &d, 255.0), start);
        }
        // A heater that starts between its thresholds keeps heating up to the upper one.
        let h = heater(false);
        let d = fire(&h, &h.init_d(), 0);
        assert!(d.closed && on(&h, &d, 255.0));
        let d = fire(&h, &d, 1);
        assert!(!d.closed && !on(&h, &d, 255.0) && d.switchings == 2.0, "{d:?}");
        // A crossing without a change does not count as switching.
        assert_eq!(fire(&h, &d, 1), d);
    }

    #[test]
    fn guards_stand_at_the_thresholds() {
        let h = heater(false);
        let u = |temperature| HeaterIn {
            node: Temperature { temperature },
            enable: true,
            supply: SUPPLY,
        };
        let g = h.guards(&u(254.5));
        assert_eq!((g.above_on, g.above_off), (1.5, -3.5));
    }

    #[test]
    fn it_heats_only_enabled_and_supplied() {
        let h = heater(true);
        for (enable, voltage) in [(true, 19.0), (false, 24.0), (true, 0.0)] {
            let u = HeaterIn {
                node: Temperature { temperature: 200.0 },
                enable,
                supply: Voltage { voltage },
            };
            let y = h.feedthrough(&h.init_d(), &u);
            assert!(!y.on && y.power == 0.0 && y.node.heat == 0.0 && y.supply.current == 0.0);
        }
    }
}
