//! `flight.solid_motor`: a solid rocket motor whose thrust follows a curve after ignition.
//! ```text
//! T = max(0, T_curve(t − t₀) − p A_e)  while it burns        ṁ = T_curve/(I_sp g₀)
//! burnt so far   ∫ T_curve dt/(I_sp g₀)
//! ```
//! For steps of fixed methods T is the mean of max(0, …) over the step.
//! It burns to the end of its curve, whatever the command is. Ignition, every row of the curve and the end
//! are events. Wire its flow to a `flight.drain` of a `flight.propellant_tank`, or to another part that represents its mass.

use crate::table::Curve;
use linkwork_runtime::prelude::*;

/// Standard gravity, m/s².
const G0: f64 = 9.80665;

/// A motor.
#[derive(Params, Clone, Debug)]
pub struct SolidMotorParams {
    /// Rows (time since ignition in s, thrust in vacuum in N), from time 0.
    #[param(unit = "s, N")]
    pub curve: Vec<[f64; 2]>,
    /// Specific impulse in vacuum.
    #[param(unit = "s", range = 1e-3..)]
    pub specific_impulse: f64,
    /// Area of the nozzle's exit, on which the ambient pressure acts.
    #[param(unit = "m^2", default = 0.0, range = 0.0..)]
    pub exit_area: f64,
    /// Time of ignition; default: when the input `ignite` is at ½ or above, also at the start.
    #[param(unit = "s")]
    pub start: Option<f64>,
}

/// Node, command and air.
#[derive(Ports, Clone, Copy, Debug)]
pub struct MotorIn {
    /// The nozzle; z is opposite to the jet.
    #[port(bind = "nozzle")]
    pub nozzle: NodeState,
    /// Ignition command: the motor ignites at ½ or above, unless `start` is written.
    #[port("1", default = 0.0)]
    pub ignite: f64,
    /// Ambient pressure.
    #[port("Pa", default = 0.0)]
    pub pressure: f64,
}

/// Load and flow.
#[derive(Ports, Clone, Copy, Debug)]
pub struct MotorOut {
    /// Load on the body.
    #[port(bind = "nozzle")]
    pub load: Wrench,
    /// Thrust.
    #[port("N")]
    pub thrust: f64,
    /// Mass flow of the propellant.
    #[port("kg/s")]
    pub flow: f64,
    /// Propellant burnt so far.
    #[port("kg")]
    pub burnt: f64,
}

/// Progress of the burn.
#[derive(State, Clone, Copy, Debug)]
pub struct Burn {
    /// Rows of the curve that have been passed; 0: not lit.
    #[port("1")]
    pub rows: f64,
    /// Time of ignition.
    #[port("s")]
    pub lit: f64,
}

/// The next row.
#[derive(Ports, Clone, Copy, Debug)]
pub struct NextRow {
    /// Time since the next row of the curve, or command minus ½.
    #[port("*", rising)]
    pub since: f64,
}

/// Returns the mean of max(0, y) for a y that changes linearly from `a` to `b`. NaN stays NaN.
fn mean_above(a: f64, b: f64) -> f64 {
    match () {
        () if a <= 0.0 && b <= 0.0 => 0.0,
        () if a >= 0.0 && b >= 0.0 => 0.5 * (a + b),
        () => {
            let above = if a > b { a } else { b };
            0.5 * above * above / (a - b).abs()
        }
    }
}

/// A solid motor.
pub struct SolidMotor {
    p: SolidMotorParams,
    curve: Curve,
}

/// A solid rocket motor with a thrust curve.
#[model("flight.solid_motor")]
impl Model for SolidMotor {
    const AVERAGES: bool = true;
    type Params = SolidMotorParams;
    type FeedthroughInputs = MotorIn;
    type FeedthroughOutputs = MotorOut;
    type DiscreteState = Burn;
    type Guards = NextRow;
    fn without_effect(&self, wired: IsWired<'_>) -> Judged {
        let never = "`start` is not written, so the motor never ignites";
        let late = self.p.start.filter(|_| wired("ignite")).map(|_| {
            BuildError::new("`start` determines the ignition")
                .help("remove `start`, or the wire to `ignite`")
        });
        let idle = if self.p.start.is_none() { unwired(wired, "ignite", never) } else { late };
        vec![(Judge::Input("ignite"), idle)]
    }
    fn build(p: SolidMotorParams) -> Result<Self, BuildError> {
        let curve = Curve::new(&p.curve, "curve")?;
        let wrong = |fact: &str, help: &str| Err(BuildError::new(fact).help(help).at("curve"));
        if p.curve[0][0] != 0.0 || p.curve.len() < 2 {
            return wrong(
                "the curve must begin at ignition (t = 0) and have at least two rows",
                "write [0, …] as the first row, and at least one more",
            );
        }
        if p.curve.iter().any(|r| !(r[1] >= 0.0)) {
            return wrong("a thrust is negative", "write values of 0 or more");
        }
        Ok(SolidMotor { p, curve })
    }
    fn must_be_wired(&self) -> Vec<(&'static str, BuildError)> {
        crate::engine::needs_pressure(self.p.exit_area)
    }
    fn must_be_read(&self) -> Vec<(&'static str, BuildError)> {
        let fact = "no part takes the flow, so the mass of its body stays constant during the burn";
        let help =
            "wire `flow` to a `flight.drain` that is connected to a `flight.propellant_tank`";
        vec![("flow", BuildError::new(fact).help(help))]
    }
    fn feedthrough(&self, clock: &Clock, d: &Burn, u: &MotorIn) -> MotorOut {
        let p = &self.p;
        let total = self.curve.integral(self.curve.ends()[1]) / (p.specific_impulse * G0);
        let over = d.rows as usize >= p.curve.len();
        if d.rows < 0.5 || over {
            let burnt = if over { total } else { 0.0 };
            return MotorOut { load: Wrench::zero(), thrust: 0.0, flow: 0.0, burnt };
        }
        let since = (clock.t - d.lit).max(0.0);
        let back = u.pressure * p.exit_area;
        let (vacuum, thrust) = match clock.span.map(|span| span.map(|t| (t - d.lit).max(0.0))) {
            Some([a, b]) if b > a => {
                let mean = (self.curve.integral(b) - self.curve.integral(a)) / (b - a);
                // Steps end at the rows of the curve, so the curve is straight from a to b.
                (mean, mean_above(self.curve.at(a) - back, self.curve.at(b) - back))
            }
            _ => {
                let vacuum = self.curve.at(since);
                (vacuum, mean_above(vacuum - back, vacuum - back))
            }
        };
        let force = u.nozzle.rotation * Vec3::z() * thrust;
        MotorOut {
            load: Wrench { moment: Vec3::zeros(), force },
            thrust,
            flow: vacuum / (p.specific_impulse * G0),
            burnt: self.curve.integral(since) / (p.specific_impulse * G0),
        }
    }
    fn guards(&self, clock: &Clock, d: &Burn, u: &MotorIn) -> NextRow {
        let since = if d.rows < 0.5 {
            self.p.start.map_or(u.ignite - 0.5, |start| clock.t - start)
        } else {
            self.p.curve.get(d.rows as usize).map_or(-1.0, |row| clock.t - d.lit - row[0])
        };
        NextRow { since }
    }
    fn handle_event(&self, clock: &Clock, d: &Burn) -> ((), Burn) {
        // The motor is lit at `start` within the round-off of the event, or at once if the part is
        // added later.
        let at = self.p.start.filter(|start| clock.t - start < 1e-6).unwrap_or(clock.t);
        let lit = if d.rows < 0.5 { at } else { d.lit };
        ((), Burn { rows: d.rows + 1.0, lit })
    }
    fn startup_warnings(&self, clock: &Clock, d: &Burn) -> Vec<BuildError> {
        let waits = d.rows < 0.5;
        let fact = match self.p.start {
            Some(s) if waits && s < clock.t - 1e-6 => {
                format!(
                    "its ignition is at {s} s, but the motor exists only from {:.6} s on: it is lit at once",
                    clock.t
                )
            }
            _ => return Vec::new(),
        };
        let help = "write a later `start`, or 0 if it is lit at the start of the run";
        vec![BuildError::new(fact).help(help).at("start")]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_burns_its_curve_and_no_more() {
        let p = SolidMotorParams {
            curve: vec![[0.0, 0.0], [0.5, 1000.0], [3.5, 800.0], [4.0, 0.0]],
            specific_impulse: 250.0,
            exit_area: 0.01,
            start: None,
        };
        let m = SolidMotor::build(p.clone()).unwrap();
        let u = |ignite: f64| MotorIn { nozzle: NodeState::identity(), ignite, pressure: 5e3 };
        let at = |t: f64| Clock::at(t, 0.001, 0);
        let (mut d, mut flow, h) = (Burn { rows: 0.0, lit: 0.0 }, 0.0, 1e-3);
        assert!(m.guards(&at(1.0), &d, &u(0.0)).since < 0.0);
        for k in 0..8000 {
            let t = 1.0 + f64::from(k) * h;
            while m.guards(&at(t), &d, &u(1.0)).since >= -1e-9 {
                d = m.handle_event(&at(t), &d).1;
            }
            flow += m.feedthrough(&at(t + 0.5 * h), &d, &u(1.0)).flow * h;
        }
        let total = (250.0 + 2700.0 + 200.0) / (250.0 * G0);
        assert!((flow / total - 1.0).abs() < 1e-6, "{flow} {total}");
        let end = m.feedthrough(&at(9.0), &d, &u(1.0));
        assert!(end.thrust == 0.0 && (end.burnt / total - 1.0).abs() < 1e-14);
        let middle = m.feedthrough(&at(3.0), &Burn { rows: 2.0, lit: 1.0 }, &u(0.0));
        assert!((middle.thrust - (900.0 - 50.0)).abs() < 1e-12);
        // At the start of the curve, the ambient pressure exceeds the pressure of the jet.
        let begins = m.feedthrough(&at(1.001), &Burn { rows: 1.0, lit: 1.0 }, &u(0.0));
        assert_eq!(begins.thrust, 0.0);
        // Take a step of 0.2 s from ignition. From 0.025 s on, the thrust exceeds the 50 N of the ambient pressure. The
        // mean must not be 200 N minus 50 N.
        let begins = Burn { rows: 1.0, lit: 1.0 };
        let span = Clock { span: Some([1.0, 1.2]), ..at(1.0) };
        let mean = m.feedthrough(&span, &begins, &u(0.0));
        assert!((mean.thrust - 0.5 * 350.0 * 0.175 / 0.2).abs() < 1e-9, "{}", mean.thrust);
        assert!((mean.flow * 250.0 * G0 - 200.0).abs() < 1e-9);
        for curve in [vec![[0.1, 1.0], [1.0, 1.0]], vec![[0.0, 1.0]], vec![[0.0, 1.0], [1.0, -1.0]]]
        {
            let e = SolidMotor::build(SolidMotorParams { curve, ..p.clone() }).err().unwrap();
            assert!(e.param.as_deref() == Some("curve") && e.help.is_some());
        }
    }
}
