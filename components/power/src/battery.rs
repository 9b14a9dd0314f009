//! `power.battery`: open-circuit voltage curve, internal resistance, counted charge.
//! ```text
//! q̇ = −i/(3600 C)                 q: state of charge, i: current drawn, C: capacity in A h
//! V = V_oc(q) − R i_f              i̇_f = (i − i_f)/T: the terminal follows the load with the lag T
//! ```
//! The lag makes the voltage a function of state, so that loads whose current depends on it form no algebraic loop.

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
    /// Open-circuit voltage against the state of charge: rows of (charge, V), rising; unwritten: eight Li-ion cells.
    #[param(default = vec![[0.0, 24.0], [0.1, 26.4], [0.2, 27.6], [0.4, 28.8], [0.6, 29.8], [0.8, 31.2], [0.9, 32.2], [1.0, 33.2]])]
    pub curve: Vec<[f64; 2]>,
    /// Internal resistance.
    #[param(unit = "ohm", default = 0.05, range = 0.0..)]
    pub resistance: f64,
    /// Lag of the terminal voltage.
    #[param(unit = "s", default = 0.05, range = 1e-4..)]
    pub lag: f64,
    /// Share of the charging current that is stored.
    #[param(default = 0.98, range = 0.0..=1.0)]
    pub charge_efficiency: f64,
}

/// Loads and sources.
#[derive(Ports, Clone, Copy, Debug)]
pub struct BatteryIn {
    /// Current drawn; negative charges.
    #[port("A", sum)]
    pub load: f64,
    /// Power drawn; negative charges.
    #[port("W", sum)]
    pub power: f64,
}

/// Terminal.
#[derive(Ports, Clone, Copy, Debug)]
pub struct BatteryOut {
    /// Terminal voltage.
    #[port("V")]
    pub volts: f64,
    /// State of charge, 0 to 1.
    #[port("1")]
    pub charge: f64,
    /// Current drawn (with the lag).
    #[port("A")]
    pub current: f64,
    /// Nothing is left.
    #[port("1")]
    pub empty: bool,
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

/// A battery.
pub struct Battery {
    p: BatteryParams,
}

/// Value at `x` of a table of rising (x, y), constant beyond its ends.
pub fn table(rows: &[[f64; 2]], x: f64) -> f64 {
    let i = rows.partition_point(|r| r[0] <= x);
    match (i.checked_sub(1).and_then(|k| rows.get(k)), rows.get(i)) {
        (Some(a), Some(b)) => a[1] + (x - a[0]) / (b[0] - a[0]) * (b[1] - a[1]),
        (Some(a), None) => a[1],
        (None, Some(b)) => b[1],
        (None, None) => 0.0,
    }
}

impl Battery {
    fn volts(&self, x: &BatteryState) -> f64 {
        table(&self.p.curve, x.charge) - self.p.resistance * x.current
    }
}

/// Battery with an open-circuit voltage curve, internal resistance and counted charge.
#[model("power.battery")]
impl Model for Battery {
    type Params = BatteryParams;
    type U = BatteryIn;
    type Ym = BatteryOut;
    type X = BatteryState;
    fn build(p: BatteryParams) -> Result<Self, BuildError> {
        if p.curve.len() < 2 || p.curve.windows(2).any(|w| w[0][0] >= w[1][0] || w[0][1] > w[1][1])
        {
            return Err(BuildError::new(
                "the curve needs two or more rows, rising in both columns",
            )
            .at("curve"));
        }
        Ok(Battery { p })
    }
    fn init_x(&self) -> BatteryState {
        BatteryState { charge: self.p.charge, current: 0.0 }
    }
    fn moore(&self, _: &Clock, x: &BatteryState, _: &()) -> BatteryOut {
        BatteryOut {
            volts: self.volts(x),
            charge: x.charge,
            current: x.current,
            empty: x.charge <= 0.0,
        }
    }
    fn deriv(&self, _: &Clock, x: &BatteryState, _: &(), u: &BatteryIn) -> BatteryState {
        let p = &self.p;
        let current = u.load + u.power / self.volts(x).max(1e-3);
        let stored = if current < 0.0 { p.charge_efficiency * current } else { current };
        let mut rate = -stored / (3600.0 * p.capacity_ah);
        if (x.charge >= 1.0 && rate > 0.0) || (x.charge <= 0.0 && rate < 0.0) {
            rate = 0.0;
        }
        BatteryState { charge: rate, current: (current - x.current) / p.lag }
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
        })
        .unwrap()
    }

    fn run(b: &Battery, u: BatteryIn, seconds: f64) -> BatteryState {
        let (dt, mut x) = (0.01, b.init_x());
        for _ in 0..(seconds / dt) as usize {
            let d = b.deriv(&Clock::at(0.0, dt, 0), &x, &(), &u, &(), &(), &());
            x.charge += dt * d.charge;
            x.current += dt * d.current;
        }
        x
    }

    #[test]
    fn five_amperes_for_an_hour_take_half_of_ten_ampere_hours() {
        let b = battery();
        let x = run(&b, BatteryIn { load: 5.0, power: 0.0 }, 3600.0);
        assert!((x.charge - 0.3).abs() < 1e-9, "{x:?}");
        let y = b.moore(&Clock::at(0.0, 0.01, 0), &x, &(), &());
        // V_oc(0.3) = 24.8 V, less 0.1 Ω · 5 A.
        assert!((y.volts - 24.3).abs() < 1e-6, "{y:?}");
    }

    #[test]
    fn charging_is_less_than_perfect_and_stops_when_full() {
        let x = run(&battery(), BatteryIn { load: -1.0, power: 0.0 }, 3600.0);
        assert!((x.charge - 0.89).abs() < 1e-9);
        assert!(
            (run(&battery(), BatteryIn { load: -10.0, power: 0.0 }, 3600.0).charge - 1.0).abs()
                < 1e-4
        );
        let x = run(&battery(), BatteryIn { load: 20.0, power: 0.0 }, 3600.0);
        assert!(x.charge.abs() < 1e-4, "{x:?}");
    }

    #[test]
    fn a_power_load_draws_the_current_of_its_voltage() {
        let b = battery();
        let x = run(&b, BatteryIn { load: 0.0, power: 60.0 }, 5.0);
        let y = b.moore(&Clock::at(0.0, 0.01, 0), &x, &(), &());
        assert!((y.volts * y.current - 60.0).abs() < 0.01, "{y:?}");
    }

    #[test]
    fn a_falling_curve_is_refused() {
        let p = BatteryParams { curve: vec![[0.0, 20.0], [0.0, 21.0]], ..battery().p };
        assert_eq!(Battery::build(p).err().unwrap().param.as_deref(), Some("curve"));
    }
}
