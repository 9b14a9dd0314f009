//! `power.battery`: open-circuit voltage curve, internal resistance, counted charge, and switching when it is empty or full.
//! ```text
//! i  = i_loads + i_sources        net current, negative charges
//! i* = i, but: min(i, 0) while empty, max(i, 0) while full          the current that passes
//! q̇  = −i*/(3600 C), charging −η i*/(3600 C)      q: state of charge, C: capacity in A h
//! V_cells = V_oc(q) − R i_f       i̇_f = (i* − i_f)/T: the terminal follows the load with the lag T
//! V  = V_cells, 0 while empty     at `terminal`, where loads are connected; V_cells at `charger`
//! Q  = R i_f² + (1 − η) V_oc max(−i*, 0)
//! ```
//! The lag makes the voltage a function of state, so that loads whose current depends on it form no algebraic loop. The lag stores ½ R T i_f², like
//! an inductance R T; with this energy and the energy ∫ V_oc dq of the cells, V_cells i* + Q + d/dt(stored) = 0.
//!
//! When q falls below `charge_min`, the battery is *empty*: it opens its contactor to the loads, and its voltage there is 0.
//! Sources that are connected to `charger` still charge it. When q has risen by `restart`, it closes the contactor again.
//! When q reaches 1, it is *full* and is not charged until q has fallen by `recharge`. All four are events.

use linkwork_runtime::prelude::*;

/// Capacity, curve and resistance.
#[derive(Params, Clone, Debug)]
pub struct BatteryParams {
    /// Capacity, A h.
    #[param(range = 1e-6..)]
    pub capacity_ah: f64,
    /// State of charge at the start.
    #[param(default = 1.0, range = 0.0..=1.0)]
    pub charge: f64,
    /// Open-circuit voltage against the state of charge: rows of (charge, V), increasing. Default: eight Li-ion cells.
    #[param(unit = "1, V", default = vec![[0.0, 24.0], [0.1, 26.4], [0.2, 27.6], [0.4, 28.8], [0.6, 29.8], [0.8, 31.2], [0.9, 32.2], [1.0, 33.2]])]
    pub curve: Vec<[f64; 2]>,
    /// Internal resistance.
    #[param(unit = "ohm", default = 0.05, range = 0.0..)]
    pub resistance: f64,
    /// Lag of the terminal voltage.
    #[param(unit = "s", default = 0.05, range = 1e-4..)]
    pub lag: f64,
    /// Fraction of the charging current that is stored.
    #[param(default = 0.98, range = 0.0..=1.0)]
    pub charge_efficiency: f64,
    /// State of charge at which it is empty and opens its contactor to the loads.
    #[param(default = 0.0, range = 0.0..=1.0)]
    pub charge_min: f64,
    /// Rise of the state of charge above `charge_min` at which the contactor closes again.
    #[param(default = 0.05, range = 1e-6..=1.0)]
    pub restart: f64,
    /// Fall of the state of charge of a full battery at which charging starts again.
    #[param(default = 0.005, range = 1e-6..=1.0)]
    pub recharge: f64,
}

/// Loads and sources.
#[derive(Ports, Clone, Copy, Debug)]
pub struct BatteryIn {
    /// Connection for loads.
    #[port(connector)]
    pub terminal: Currents,
    /// Connection for sources; their current is negative.
    #[port(connector)]
    pub charger: Currents,
}

/// Terminal.
#[derive(Ports, Clone, Copy, Debug)]
pub struct BatteryOut {
    /// Connection for loads: 0 V while the battery is empty.
    #[port(connector)]
    pub terminal: Voltage,
    /// Connection for sources: the voltage of the cells.
    #[port(connector)]
    pub charger: Voltage,
    /// State of charge, 0 to 1.
    #[port("1")]
    pub charge: f64,
    /// Current drawn (with the lag).
    #[port("A")]
    pub current: f64,
    /// The battery is empty and has disconnected its loads until it has been charged by `restart`.
    #[port("1")]
    pub empty: bool,
    /// It supplies its loads: the negation of `empty`.
    #[port("1")]
    pub supplies: bool,
    /// The battery is full and accepts no more charge.
    #[port("1")]
    pub full: bool,
    /// Stored energy: ∫ V_oc dq, and the energy of the lag.
    #[port("J", stored)]
    pub energy: f64,
    /// Charge that it holds.
    #[port("C", stored)]
    pub held: f64,
}

/// Power flows of the battery.
#[derive(Ports, Clone, Copy, Debug)]
pub struct BatteryFlows {
    /// Outlet of its heat, for the port of a thermal node. If it is not connected, the heat goes to the surroundings.
    #[port(connector)]
    pub case: HeatFlow,
    /// Power that sources offer and a full battery does not accept.
    #[port("W", lost)]
    pub shed: f64,
    /// Current that is not stored: charging losses, and current that a full battery does not accept.
    #[port("A", lost)]
    pub lost: f64,
}

/// Charge and current.
#[derive(State, Clone, Copy, Debug)]
pub struct BatteryState {
    /// State of charge.
    #[port("1")]
    pub charge: f64,
    /// Current with the lag.
    #[port("A")]
    pub current: f64,
}

/// Flags for the empty and the full battery.
#[derive(State, Clone, Copy, Debug, PartialEq)]
pub struct Contactors {
    /// The battery is empty.
    #[port("1")]
    pub empty: bool,
    /// The battery is full.
    #[port("1")]
    pub full: bool,
    /// Number of times that it has become empty.
    #[port("1")]
    pub flat: f64,
}

/// The four thresholds.
#[derive(Ports, Clone, Copy, Debug)]
pub struct ChargeGuards {
    /// Charge minus the charge at which it is empty.
    #[port("1", falling)]
    pub above_min: f64,
    /// Charge above the restart threshold.
    #[port("1", rising)]
    pub above_restart: f64,
    /// Charge minus the charge at which it is full.
    #[port("1", rising)]
    pub above_full: f64,
    /// Charge minus the charge at which it charges again.
    #[port("1", falling)]
    pub above_recharge: f64,
}

/// A battery.
pub struct Battery {
    p: BatteryParams,
}

/// Returns the value at `x` of a table (x, y) with increasing x, constant beyond its ends.
pub fn table(rows: &[[f64; 2]], x: f64) -> f64 {
    let i = rows.partition_point(|r| r[0] <= x);
    match (i.checked_sub(1).and_then(|k| rows.get(k)), rows.get(i)) {
        (Some(a), Some(b)) => a[1] + (x - a[0]) / (b[0] - a[0]) * (b[1] - a[1]),
        (Some(a), None) => a[1],
        (None, Some(b)) => b[1],
        (None, None) => 0.0,
    }
}

/// Integral of [`table`] from 0 to `x`.
fn area(rows: &[[f64; 2]], x: f64) -> f64 {
    let (Some(first), Some(last)) = (rows.first(), rows.last()) else { return 0.0 };
    let mut sum = first[1] * x.min(first[0]) + last[1] * (x - last[0]).max(0.0);
    for (a, b) in rows.iter().zip(&rows[1..]) {
        if x > a[0] {
            let end = x.min(b[0]);
            sum += (end - a[0]) * (a[1] + 0.5 * (end - a[0]) / (b[0] - a[0]) * (b[1] - a[1]));
        }
    }
    sum
}

impl Battery {
    /// Voltage of the cells behind the contactor.
    fn cells(&self, x: &BatteryState) -> f64 {
        table(&self.p.curve, x.charge) - self.p.resistance * x.current
    }

    /// Energy in it, J.
    fn energy(&self, x: &BatteryState) -> f64 {
        let p = &self.p;
        3600.0 * p.capacity_ah * area(&p.curve, x.charge)
            + 0.5 * p.resistance * p.lag * x.current * x.current
    }

    /// Returns the net current that loads and sources request, and the part of it that flows.
    fn currents(&self, d: &Contactors, u: &BatteryIn) -> [f64; 2] {
        // An empty battery has opened the contactor to its loads.
        let loads = if d.empty { 0.0 } else { u.terminal.current };
        let asked = loads + u.charger.current;
        let passes = match (d.empty && asked > 0.0) || (d.full && asked < 0.0) {
            true => 0.0,
            false => asked,
        };
        [asked, passes]
    }
}

/// Battery with an open-circuit voltage curve, internal resistance, counted charge and heat; empty and full are events.
#[model("power.battery")]
impl Model for Battery {
    type Params = BatteryParams;
    type FeedthroughInputs = BatteryIn;
    type Outputs = BatteryOut;
    type FeedthroughOutputs = BatteryFlows;
    type State = BatteryState;
    type DiscreteState = Contactors;
    type Guards = ChargeGuards;
    fn build(p: BatteryParams) -> Result<Self, BuildError> {
        if p.curve.len() < 2 || p.curve.windows(2).any(|w| w[0][0] >= w[1][0] || w[0][1] > w[1][1])
        {
            return Err(BuildError::new(
                "the curve needs at least two rows with increasing charge, and the voltage must not decrease",
            )
            .help("sort the rows (charge, V) by charge")
            .at("curve"));
        }
        if let Some([charge, volts]) =
            p.curve.iter().find(|r| !(0.0..=1.0).contains(&r[0]) || !(r[1] >= 0.0))
        {
            let fact = format!("the curve has {volts} V at a state of charge of {charge}");
            let help = "write states of charge from 0 to 1, and voltages that are not negative";
            return Err(BuildError::new(fact).help(help).at("curve"));
        }
        Ok(Battery { p })
    }
    fn init_x(&self) -> BatteryState {
        BatteryState { charge: self.p.charge, current: 0.0 }
    }
    fn init_d(&self) -> Contactors {
        let p = &self.p;
        let empty = p.charge <= p.charge_min;
        Contactors { empty, full: p.charge >= 1.0, flat: f64::from(u8::from(empty)) }
    }
    fn outputs(&self, x: &BatteryState, d: &Contactors) -> BatteryOut {
        BatteryOut {
            terminal: Voltage { voltage: if d.empty { 0.0 } else { self.cells(x) } },
            charger: Voltage { voltage: self.cells(x) },
            charge: x.charge,
            current: x.current,
            empty: d.empty,
            supplies: !d.empty,
            full: d.full,
            energy: self.energy(x),
            held: 3600.0 * self.p.capacity_ah * x.charge,
        }
    }
    fn feedthrough(&self, x: &BatteryState, d: &Contactors, u: &BatteryIn) -> BatteryFlows {
        let p = &self.p;
        let [asked, passes] = self.currents(d, u);
        let beside = (asked - passes) * self.cells(x);
        let lost = (1.0 - p.charge_efficiency) * table(&p.curve, x.charge) * (-passes).max(0.0);
        BatteryFlows {
            case: HeatFlow { heat: p.resistance * x.current * x.current + lost },
            shed: (-beside).max(0.0),
            lost: (1.0 - p.charge_efficiency) * (-passes).max(0.0) + (passes - asked),
        }
    }
    fn derivatives(&self, x: &BatteryState, d: &Contactors, u: &BatteryIn) -> BatteryState {
        let p = &self.p;
        let [_, current] = self.currents(d, u);
        let stored = if current < 0.0 { p.charge_efficiency * current } else { current };
        BatteryState {
            charge: -stored / (3600.0 * p.capacity_ah),
            current: (current - x.current) / p.lag,
        }
    }
    fn guards(&self, x: &BatteryState) -> ChargeGuards {
        let p = &self.p;
        ChargeGuards {
            above_min: x.charge - p.charge_min,
            above_restart: x.charge - p.charge_min - p.restart,
            above_full: x.charge - 1.0,
            above_recharge: x.charge - 1.0 + p.recharge,
        }
    }
    fn handle_event(
        &self,
        fired: Fired<'_>,
        x: &BatteryState,
        d: &Contactors,
    ) -> (BatteryState, Contactors) {
        let mut d = *d;
        if fired.fell(0) {
            d.flat += f64::from(u8::from(!d.empty));
            d.empty = true;
        } else if fired.rose(1) {
            d.empty = false;
        }
        if fired.rose(2) {
            d.full = true;
        } else if fired.fell(3) {
            d.full = false;
        }
        (*x, d)
    }
    fn startup_warnings(&self) -> Vec<BuildError> {
        let p = &self.p;
        if p.charge_min + p.restart < 1.0 {
            return Vec::new();
        }
        let fact = format!(
            "the battery would reconnect (close its contactor) at a state of charge of {}, which it never reaches",
            p.charge_min + p.restart
        );
        let help = "the sum of `charge_min` and `restart` must be less than 1";
        vec![BuildError::new(fact).help(help).at("restart")]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn battery() -> Battery {
        Battery::build(BatteryParams {
            capacity_ah: 10.0,
            charge: 0.8,
            curve: vec![[0.0, 20.0], [0.5, 28.0], [1.0, 32.0]],
            resistance: 0.1,
            lag: 0.05,
            charge_efficiency: 0.9,
            charge_min: 0.1,
            restart: 0.05,
            recharge: 0.01,
        })
        .unwrap()
    }

    /// Performs Euler steps with events at their ends from a state; returns the state, the energy supplied at the terminals, the heat, and the energy
    /// that was not accepted (J).
    fn run(
        b: &Battery,
        start: (BatteryState, Contactors),
        u: BatteryIn,
        seconds: f64,
    ) -> ((BatteryState, Contactors), [f64; 3]) {
        let dt = 0.01;
        let ((mut x, mut d), mut books) = (start, [0.0; 3]);
        for _ in 0..(seconds / dt) as usize {
            let flows = b.feedthrough(&x, &d, &u);
            let given = -b.currents(&d, &u)[1] * b.cells(&x);
            for (sum, power) in books.iter_mut().zip([given, flows.case.heat, flows.shed]) {
                *sum += dt * power;
            }
            let before = b.guards(&x);
            let rate = b.derivatives(&x, &d, &u);
            x.charge += dt * rate.charge;
            x.current += dt * rate.current;
            let after = b.guards(&x);
            let rises = |g: [f64; 2]| g[0] < 0.0 && g[1] >= 0.0;
            let crossed = [
                rises([-before.above_min, -after.above_min]),
                rises([before.above_restart, after.above_restart]),
                rises([before.above_full, after.above_full]),
                rises([-before.above_recharge, -after.above_recharge]),
            ];
            for (which, _) in crossed.iter().enumerate().filter(|c| *c.1) {
                let which =
                    if which % 3 == 0 { Fired::falling(which) } else { Fired::rising(which) };
                (x, d) = b.handle_event(which, &x, &d);
            }
        }
        ((x, d), books)
    }

    fn start(b: &Battery) -> (BatteryState, Contactors) {
        (b.init_x(), b.init_d())
    }

    fn volts(b: &Battery, (x, d): &(BatteryState, Contactors)) -> f64 {
        b.outputs(x, d).terminal.voltage
    }

    fn load(load: f64) -> BatteryIn {
        BatteryIn {
            terminal: Currents { current: load.max(0.0) },
            charger: Currents { current: load.min(0.0) },
        }
    }

    #[test]
    fn curves_of_negative_voltages_and_charges_in_percent_are_refused() {
        let of = |curve: Vec<[f64; 2]>| Battery::build(BatteryParams { curve, ..battery().p });
        assert!(of(vec![[0.0, 0.0], [1.0, 30.0]]).is_ok());
        for (curve, fact) in [
            (vec![[0.0, -20.0], [1.0, 30.0]], "-20 V at a state of charge of 0"),
            (vec![[0.0, 20.0], [100.0, 30.0]], "30 V at a state of charge of 100"),
            (vec![[0.0, 20.0], [0.0, 30.0]], "increasing charge"),
        ] {
            let e = of(curve).err().unwrap();
            assert!(e.message.contains(fact) && e.param.as_deref() == Some("curve"), "{e:?}");
        }
    }

    #[test]
    fn five_amperes_for_an_hour_take_half_of_ten_ampere_hours() {
        let b = battery();
        let (end, _) = run(&b, start(&b), load(5.0), 3600.0);
        assert!((end.0.charge - 0.3).abs() < 1e-9, "{end:?}");
        // The voltage is V_oc(0.3) = 24.8 V, less 0.1 Ω · 5 A.
        assert!((volts(&b, &end) - 24.3).abs() < 1e-6, "{end:?}");
    }

    #[test]
    fn charging_is_less_than_perfect_and_ends_when_it_is_full() {
        let b = battery();
        let (end, _) = run(&b, start(&b), load(-1.0), 3600.0);
        assert!((end.0.charge - 0.89).abs() < 1e-9 && !end.1.full);
        let (full, books) = run(&b, start(&b), load(-10.0), 3600.0);
        assert!(full.1.full && (full.0.charge - 1.0).abs() < 1e-5, "{full:?}");
        // The battery was full after 0.2 · 10 A h/(0.9 · 10 A); later charging current did not
        // pass.
        let late = 3600.0 - 800.0;
        assert!((books[2] / (late * 10.0 * 32.0) - 1.0).abs() < 1e-3, "{books:?}");
        // A full battery discharges at once, and charges again after it has lost a hundredth.
        let (less, _) = run(&b, full, load(10.0), 20.0);
        assert!(less.1.full && less.0.charge < full.0.charge - 0.005);
        let (less, _) = run(&b, less, load(10.0), 20.0);
        assert!(!less.1.full);
    }

    #[test]
    fn a_flat_battery_cuts_its_loads_off_until_it_has_charge_again() {
        let b = battery();
        let (flat, books) = run(&b, start(&b), load(20.0), 3600.0);
        assert!(flat.1.empty && flat.1.flat == 1.0 && volts(&b, &flat) == 0.0, "{flat:?}");
        assert!((flat.0.charge - 0.1).abs() < 1e-5 && flat.0.current.abs() < 1e-9, "{flat:?}");
        // Seven tenths of 10 A h at 20 A last 1260 s; later no current passes the contactor, although the load
        // continues to draw.
        let given = -1260.0 * 20.0 * 25.0;
        assert!((books[0] / given - 1.0).abs() < 0.1 && books[2] == 0.0, "{books:?}");
        // A charger that exceeds the load charges the battery until the contactor closes.
        let (less, _) = run(&b, flat, load(-1.0), 1800.0);
        assert!(less.1.empty && less.0.charge > flat.0.charge);
        let (back, _) = run(&b, less, load(-1.0), 600.0);
        assert!(!back.1.empty && volts(&b, &back) > 20.0 && back.1.flat == 1.0);
        // A battery that starts below its threshold starts empty.
        let p = BatteryParams { charge: 0.1, ..battery().p };
        assert!(Battery { p }.init_d().empty);
    }

    #[test]
    fn what_is_put_in_is_stored_or_heat() {
        let b = battery();
        // The stored energy is ∫ V_oc dq from 0.8, by trapezoids of the upper part of the curve,
        // and the energy of the lag.
        let stored = |x: &BatteryState| {
            let oc = |q: f64| table(&b.p.curve, q);
            let q = x.charge - 0.8;
            36_000.0 * q * 0.5 * (oc(0.8) + oc(x.charge)) + 0.5 * 0.1 * 0.05 * x.current.powi(2)
        };
        for u in [
            load(4.0),
            load(-4.0),
            BatteryIn { terminal: Currents { current: 1.0 }, charger: Currents { current: -7.0 } },
        ] {
            let ((x, _), books) = run(&b, start(&b), u, 300.0);
            let error = books[0] - books[1] - stored(&x);
            let counted = b.energy(&x) - b.energy(&b.init_x());
            assert!((counted - stored(&x)).abs() < 1e-6 * books[0].abs(), "{counted}");
            // The error comes from Euler's steps. Measured: 0.1 J of 30 kJ.
            assert!(
                error.abs() < 1e-5 * books[0].abs() && books[1] > 0.0,
                "{u:?} {error} {books:?}"
            );
        }
    }

    #[test]
    fn a_falling_curve_is_refused() {
        let p = BatteryParams { curve: vec![[0.0, 20.0], [0.0, 21.0]], ..battery().p };
        assert_eq!(Battery::build(p).err().unwrap().param.as_deref(), Some("curve"));
    }
}
