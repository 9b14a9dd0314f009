//! `flight.solid_motor`: a solid rocket motor whose thrust follows a curve after ignition.
//! ```text
//! T = max(0, T_curve(t − t₀) − p A_e)  while it burns        ṁ = T_curve/(I_sp g₀)
//! ```
//! In steps of fixed methods, T and ṁ are means over the step.
//! A command does not stop the motor. It burns to the end of its curve, or until its grain is used up: a `flight.propellant_tank` that is connected to
//! `propellant`. A grain that is used up before the end of the curve causes a warning. A motor that has gone out never burns again, also if its tank is filled.
//! Ignition, every row of the curve and the end are events.

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
    /// Connection to the grain: a tank, or `flight.ideal_feed`.
    #[port(connector)]
    pub propellant: Propellant,
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
    /// Propellant that it takes.
    #[port(connector)]
    pub propellant: MassFlow,
}

/// Progress of the burn.
#[derive(State, Clone, Copy, Debug)]
pub struct Burn {
    /// Rows of the curve that have been passed; 0: not lit; all rows: the motor has gone out.
    #[port("1")]
    pub rows: f64,
    /// Time of ignition.
    #[port("s")]
    pub lit: f64,
}

/// The next row, and the end of the grain.
#[derive(Ports, Clone, Copy, Debug)]
pub struct NextRow {
    /// Time since the next row of the curve, or command minus ½.
    #[port("*", rising)]
    pub since: f64,
    /// Positive if the motor burns but its grain is used up.
    #[port("1", rising)]
    pub starved: f64,
}

/// Index of a guard in [`NextRow`].
const STARVED: usize = 1;

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

impl SolidMotor {
    /// Mass (kg) that the curve burns from one time since ignition (s) to another.
    fn mass(&self, [from, to]: [f64; 2]) -> f64 {
        (self.curve.integral(to) - self.curve.integral(from)) / (self.p.specific_impulse * G0)
    }

    /// Returns whether the motor burns.
    fn burns(&self, d: &Burn) -> bool {
        d.rows > 0.5 && (d.rows as usize) < self.p.curve.len()
    }
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
    fn feedthrough(&self, clock: &Clock, d: &Burn, u: &MotorIn) -> MotorOut {
        let p = &self.p;
        if !self.burns(d) || !u.propellant.available {
            let propellant = MassFlow { flow: 0.0 };
            return MotorOut { load: Wrench::zero(), thrust: 0.0, propellant };
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
            propellant: MassFlow { flow: vacuum / (p.specific_impulse * G0) },
        }
    }
    fn guards(&self, clock: &Clock, d: &Burn, u: &MotorIn) -> NextRow {
        let since = if d.rows < 0.5 {
            self.p.start.map_or(u.ignite - 0.5, |start| clock.t - start)
        } else {
            self.p.curve.get(d.rows as usize).map_or(-1.0, |row| clock.t - d.lit - row[0])
        };
        let starved = self.burns(d) && !u.propellant.available;
        NextRow { since, starved: if starved { 1.0 } else { -1.0 } }
    }
    fn handle_event(&self, clock: &Clock, fired: Fired<'_>, d: &Burn) -> ((), Burn) {
        if fired.rose(STARVED) {
            return ((), Burn { rows: self.p.curve.len() as f64, ..*d });
        }
        // The motor is lit at `start` within the round-off of the event, or at once if the part is
        // added later.
        let at = self.p.start.filter(|start| clock.t - start < 1e-6).unwrap_or(clock.t);
        let lit = if d.rows < 0.5 { at } else { d.lit };
        ((), Burn { rows: d.rows + 1.0, lit })
    }
    fn runtime_warning(&self, clock: &Clock, fired: Fired<'_>, d: &Burn) -> Option<BuildError> {
        let end = self.curve.ends()[1];
        let (left, all) = (self.mass([clock.t - d.lit, end]), self.mass([0.0, end]));
        // A grain may have the mass of the curve, rounded to a few digits.
        if !fired.rose(STARVED) || left < 1e-4 * all {
            return None;
        }
        let fact = format!(
            "the grain is used up {:.3} s after ignition, but the curve burns for {end:.3} s and needs {all:.6} kg: the motor has gone out",
            clock.t - d.lit
        );
        let help =
            format!("write {left:.6} kg more propellant in the tank, or a curve that burns less");
        Some(BuildError::new(fact).help(help))
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

    fn params() -> SolidMotorParams {
        SolidMotorParams {
            curve: vec![[0.0, 0.0], [0.5, 1000.0], [3.5, 800.0], [4.0, 0.0]],
            specific_impulse: 250.0,
            exit_area: 0.01,
            start: None,
        }
    }

    /// A motor whose grain is used up goes out, and a tank that is filled later does not light it again.
    #[test]
    fn a_grain_that_is_used_up_ends_the_burn() {
        let m = SolidMotor::build(params()).unwrap();
        let u = |available: bool| MotorIn {
            nozzle: NodeState::identity(),
            ignite: 1.0,
            propellant: Propellant { available },
            pressure: 0.0,
        };
        let (at, burns) = (Clock::at(3.0, 0.001, 0), Burn { rows: 2.0, lit: 1.0 });
        assert!(m.guards(&at, &burns, &u(true)).starved < 0.0);
        // A motor that is not lit yet does not need its grain.
        assert!(m.guards(&at, &Burn { rows: 0.0, lit: 0.0 }, &u(false)).starved < 0.0);
        assert!(m.guards(&at, &burns, &u(false)).starved > 0.0);
        let y = m.feedthrough(&at, &burns, &u(false));
        assert!(y.thrust == 0.0 && y.propellant.flow == 0.0 && y.load == Wrench::zero());
        let told = m.runtime_warning(&at, Fired::rising(STARVED), &burns).unwrap();
        assert!(told.message.contains("2.000 s after ignition"), "{told:?}");
        assert!(m.runtime_warning(&at, Fired::rising(0), &burns).is_none());
        let out = m.handle_event(&at, Fired::rising(STARVED), &burns).1;
        assert!(m.guards(&at, &out, &u(false)).starved < 0.0 && !m.burns(&out));
        assert_eq!(m.feedthrough(&at, &out, &u(true)).thrust, 0.0);
    }

    #[test]
    fn it_burns_its_curve_and_no_more() {
        let p = params();
        let m = SolidMotor::build(p.clone()).unwrap();
        let u = |ignite: f64| MotorIn {
            nozzle: NodeState::identity(),
            ignite,
            propellant: Propellant { available: true },
            pressure: 5e3,
        };
        let at = |t: f64| Clock::at(t, 0.001, 0);
        let (mut d, mut flow, h) = (Burn { rows: 0.0, lit: 0.0 }, 0.0, 1e-3);
        assert!(m.guards(&at(1.0), &d, &u(0.0)).since < 0.0);
        for k in 0..8000 {
            let t = 1.0 + f64::from(k) * h;
            while m.guards(&at(t), &d, &u(1.0)).since >= -1e-9 {
                d = m.handle_event(&at(t), Fired::rising(0), &d).1;
            }
            flow += m.feedthrough(&at(t + 0.5 * h), &d, &u(1.0)).propellant.flow * h;
        }
        let total = (250.0 + 2700.0 + 200.0) / (250.0 * G0);
        assert!((flow / total - 1.0).abs() < 1e-6, "{flow} {total}");
        let end = m.feedthrough(&at(9.0), &d, &u(1.0));
        assert!(end.thrust == 0.0 && end.propellant.flow == 0.0);
        assert!((m.mass([0.0, 9.0]) / total - 1.0).abs() < 1e-14);
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
        assert!((mean.propellant.flow * 250.0 * G0 - 200.0).abs() < 1e-9);
        for curve in [vec![[0.1, 1.0], [1.0, 1.0]], vec![[0.0, 1.0]], vec![[0.0, 1.0], [1.0, -1.0]]]
        {
            let e = SolidMotor::build(SolidMotorParams { curve, ..p.clone() }).err().unwrap();
            assert!(e.param.as_deref() == Some("curve") && e.help.is_some());
        }
    }
}
