//! `power.load`: an electrical load that is off, on standby or on, and browns out if its voltage is too low.
//! ```text
//! P₀ = level · power_on, or power_standby, or 0
//! power      i = P₀/V                a regulated converter: current rises as voltage falls
//! current    i = P₀/V_rated
//! resistance i = P₀ V/V_rated²       a heater, a lamp
//! P = V i,  Q = P · heat_share
//! ```
//! When V falls through `volts_min` the load browns out: it draws no current until V rises through `volts_min` + `margin`, and then follows its
//! commands again. Both are events. If a run starts below `volts_min`, the load is browned out at the start.

use linkwork_runtime::prelude::*;

/// Dependence of the current on the voltage.
#[derive(Params, Clone, Copy, Debug, PartialEq, Eq)]
pub enum Law {
    /// Constant power.
    Power,
    /// Constant current.
    Current,
    /// Current proportional to the voltage.
    Resistance,
}

/// Power in each state, and voltages.
#[derive(Params, Clone, Debug)]
pub struct LoadParams {
    /// Power when on.
    #[param(unit = "W", range = 0.0..)]
    pub power_on: f64,
    /// Power on standby.
    #[param(unit = "W", default = 0.0, range = 0.0..)]
    pub power_standby: f64,
    /// Dependence of the current on the voltage.
    #[param(default = Law::Power)]
    pub law: Law,
    /// Voltage at which the load draws these powers; with `law: power` it draws them at any voltage.
    #[param(unit = "V", default = 28.0, range = 0.1.., needs = "law != power")]
    pub volts_rated: f64,
    /// Voltage below which the load browns out.
    #[param(unit = "V", default = 22.0, range = 0.1..)]
    pub volts_min: f64,
    /// Rise of the voltage above `volts_min` at which the load restarts.
    #[param(unit = "V", default = 1.0, range = 1e-3..)]
    pub margin: f64,
    /// Fraction of the power that becomes heat in the load; a radio transmits the rest.
    #[param(default = 1.0, range = 0.0..=1.0)]
    pub heat_share: f64,
}

/// Commands and voltage.
#[derive(Ports, Clone, Copy, Debug)]
pub struct LoadIn {
    /// Supply.
    #[port(connector)]
    pub supply: Voltage,
    /// Command: on. Takes precedence over `standby`.
    #[port("1", default = false)]
    pub on: bool,
    /// Command: standby.
    #[port("1", default = false)]
    pub standby: bool,
    /// Fraction of `power_on` that the load draws when on; limited to 0 … 1.
    #[port("1", default = 1.0)]
    pub level: f64,
}

/// Power, heat and status.
#[derive(Ports, Clone, Copy, Debug)]
pub struct LoadOut {
    /// Supply.
    #[port(connector)]
    pub supply: Current,
    /// Power taken.
    #[port("W")]
    pub power: f64,
    /// Outlet of its heat, for the port of a thermal node. If it is not connected, the heat goes to the surroundings.
    #[port(connector)]
    pub case: HeatFlow,
    /// Power that leaves the load in another form, such as the radio waves of a transmitter.
    #[port("W", lost)]
    pub sent: f64,
    /// The load is on and supplied.
    #[port("1")]
    pub running: bool,
    /// The load has browned out.
    #[port("1")]
    pub browned_out: bool,
}

/// Brown-outs.
#[derive(State, Clone, Copy, Debug, PartialEq)]
pub struct BrownOut {
    /// The load has browned out.
    #[port("1")]
    pub out: bool,
    /// A threshold has been crossed since the start.
    #[port("1")]
    pub crossed: bool,
    /// Number of brown-outs.
    #[port("1")]
    pub count: f64,
}

/// Distances from the two voltage thresholds.
#[derive(Ports, Clone, Copy, Debug)]
pub struct LoadGuards {
    /// Voltage above `volts_min`.
    #[port("V", falling)]
    pub above_min: f64,
    /// Voltage above the restart voltage.
    #[port("V", rising)]
    pub above_restart: f64,
}

/// A load.
pub struct Load {
    p: LoadParams,
}

/// Electrical load: off, on standby, or on at a level. It browns out below a voltage, which is an event.
#[model("power.load")]
impl Model for Load {
    type Params = LoadParams;
    type FeedthroughInputs = LoadIn;
    type FeedthroughOutputs = LoadOut;
    type DiscreteState = BrownOut;
    type Guards = LoadGuards;
    fn without_effect(&self, wired: IsWired<'_>) -> Judged {
        let never = "the load never draws it";
        let level = (wired("level") && !wired("on")).then(|| {
            BuildError::new("no wire leads to `on`, and a load that is off has no level")
                .help("wire `on`, or set it from a program")
        });
        vec![
            (Judge::Param("power_on"), unwired(wired, "on", never)),
            (Judge::Param("power_standby"), unwired(wired, "standby", never)),
            (Judge::Input("level"), level),
        ]
    }
    fn feedthrough(&self, d: &BrownOut, u: &LoadIn) -> LoadOut {
        let p = &self.p;
        let browned_out = d.out || (!d.crossed && u.supply.voltage < p.volts_min);
        let wanted = match (u.on, u.standby) {
            (true, _) => p.power_on * u.level.clamp(0.0, 1.0),
            (false, true) => p.power_standby,
            (false, false) => 0.0,
        };
        let current = match p.law {
            _ if browned_out => 0.0,
            // At the event the voltage may drop to zero because the supply was cut off; the limit avoids a division by zero.
            Law::Power => wanted / u.supply.voltage.max(p.volts_min),
            Law::Current => wanted / p.volts_rated,
            Law::Resistance => wanted * u.supply.voltage / (p.volts_rated * p.volts_rated),
        };
        let power = current * u.supply.voltage;
        LoadOut {
            supply: Current { current },
            power,
            case: HeatFlow { heat: power * p.heat_share },
            sent: power * (1.0 - p.heat_share),
            running: u.on && !browned_out,
            browned_out,
        }
    }
    fn guards(&self, u: &LoadIn) -> LoadGuards {
        LoadGuards {
            above_min: u.supply.voltage - self.p.volts_min,
            above_restart: u.supply.voltage - self.p.volts_min - self.p.margin,
        }
    }
    /// The load is browned out at `volts_min` and below it, and runs again at the restart voltage and above it.
    fn handle_event(&self, fired: Fired<'_>, d: &BrownOut) -> ((), BrownOut) {
        let out = fired.fell(0) || (d.out && !fired.rose(1));
        let count = d.count + f64::from(u8::from(out && !d.out));
        ((), BrownOut { out, crossed: true, count })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn load(law: Law) -> Load {
        let p = LoadParams {
            power_on: 56.0,
            power_standby: 7.0,
            law,
            volts_rated: 28.0,
            volts_min: 21.0,
            margin: 3.0,
            heat_share: 0.75,
        };
        Load { p }
    }

    const FINE: BrownOut = BrownOut { out: false, crossed: true, count: 0.0 };

    fn at(l: &Load, d: &BrownOut, u: LoadIn) -> LoadOut {
        l.feedthrough(d, &u)
    }

    fn on(volts: f64) -> LoadIn {
        LoadIn { supply: Voltage { voltage: volts }, on: true, standby: false, level: 1.0 }
    }

    #[test]
    fn each_law_takes_the_rated_power_at_the_rated_voltage() {
        for (law, share) in [(Law::Power, 1.0), (Law::Current, 0.875), (Law::Resistance, 0.765625)]
        {
            let l = load(law);
            let y = at(&l, &FINE, on(28.0));
            assert!(
                (y.power - 56.0).abs() < 1e-12 && (y.supply.current - 2.0).abs() < 1e-12,
                "{y:?}"
            );
            // A voltage of 24.5 V is 7/8 of the rated voltage.
            let y = at(&l, &FINE, on(24.5));
            assert!((y.power - 56.0 * share).abs() < 1e-12, "{law:?} {y:?}");
            assert!(
                (y.power - 24.5 * y.supply.current).abs() < 1e-12 && y.case.heat == 0.75 * y.power
            );
        }
    }

    #[test]
    fn it_is_off_on_standby_on_or_at_a_level() {
        let l = load(Law::Power);
        let power = |on: bool, standby: bool, level: f64| {
            let y = at(&l, &FINE, LoadIn { supply: Voltage { voltage: 28.0 }, on, standby, level });
            assert_eq!(y.running, on);
            y.power
        };
        assert_eq!(power(false, false, 1.0), 0.0);
        assert_eq!((power(false, true, 0.5), power(true, true, 1.0)), (7.0, 56.0));
        assert_eq!((power(true, false, 0.25), power(true, false, 3.0)), (14.0, 56.0));
        assert_eq!(power(true, false, -1.0), 0.0);
    }

    #[test]
    fn it_browns_out_and_starts_again_with_room_between() {
        let l = load(Law::Power);
        let fire = |d: &BrownOut, which: usize| {
            let which = if which == 0 { Fired::falling(0) } else { Fired::rising(1) };
            l.handle_event(which, d).1
        };
        let out = fire(&FINE, 0);
        assert!(out.out && out.count == 1.0);
        let y = at(&l, &out, on(23.0));
        assert!(y.browned_out && !y.running && y.supply.current == 0.0 && y.case.heat == 0.0);
        // A second drop before the restart does not count.
        assert_eq!(fire(&out, 0), out);
        let again = fire(&out, 1);
        assert!(at(&l, &again, on(24.0)).running && again.count == 1.0);
        // A load that starts below the minimum voltage is off without an event, and stays off up to the restart
        // voltage.
        let start = BrownOut { out: false, crossed: false, count: 0.0 };
        assert!(at(&l, &start, on(20.0)).browned_out && !at(&l, &start, on(22.0)).browned_out);
        assert!(at(&l, &fire(&start, 0), on(22.0)).browned_out);
        let g = l.guards(&on(22.0));
        assert_eq!((g.above_min, g.above_restart), (1.0, -2.0));
    }
}
