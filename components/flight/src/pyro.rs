//! `flight.pyro`: pyrotechnic device that separates two bodies by an impulse.
//! ```text
//! F(t) = J π/(2 τ) sin(π (t − t₀)/τ)  for t₀ ≤ t ≤ t₀ + τ:  ∫ F dt = J           n: the axis, fixed in a
//! on b: F n at b          on a: −F n at b as well
//! J = `impulse` (1 + `impulse_sigma` w₁)   t₀ = time of the command + `delay` + `delay_sigma` |w₂|          w: N(0, 1) by the run's seed
//! ```
//! Both forces act along one line, so momentum and angular momentum of the pair are conserved. Several devices with individual scatter cause a
//! tip-off rate of the separated body: Δω = J⁻¹ Σ r_k × ΔJ_k n. The connection of the bodies must be released by a phase. Beginning and end of the
//! pulse are events.

use linkwork_runtime::prelude::*;
use std::f64::consts::PI;

/// Parameters of a pyrotechnic device.
#[derive(Params, Clone, Debug)]
pub struct PyroParams {
    /// Impulse J.
    #[param(unit = "N s", range = 0.0..)]
    pub impulse: f64,
    /// Duration τ of the pulse.
    #[param(unit = "s", default = 0.01, range = 1e-6..)]
    pub duration: f64,
    /// Direction from a to b, in the axes of node a.
    #[param(default = Vec3::x())]
    pub axis: Vec3,
    /// Delay from the command to the beginning of the pulse.
    #[param(unit = "s", default = 0.0, range = 0.0..)]
    pub delay: f64,
    /// Relative standard deviation of the impulse.
    #[param(default = 0.0, range = 0.0..=0.3)]
    pub impulse_sigma: f64,
    /// Standard deviation of an additional delay, which is never negative.
    #[param(unit = "s", default = 0.0, range = 0.0..)]
    pub delay_sigma: f64,
    /// Time of the command after the part exists (0: when its phase begins); default: when `fire` is at ½ or above, also at the start.
    #[param(unit = "s", range = 0.0..)]
    pub after: Option<f64>,
}

/// Nodes of the two bodies, and the command.
#[derive(Ports, Clone, Copy, Debug)]
pub struct PyroIn {
    /// Node on the body that stays behind.
    #[port(bind = "a")]
    pub a: NodeState,
    /// Node on the body that is pushed.
    #[port(bind = "b")]
    pub b: NodeState,
    /// Fires the device when it is at ½ or above; not used with `after`.
    #[port("1", default = 0.0)]
    pub fire: f64,
}

/// Forces and state.
#[derive(Ports, Clone, Copy, Debug)]
pub struct PyroOut {
    /// Load on a.
    #[port(bind = "a")]
    pub on_a: Wrench,
    /// Load on b.
    #[port(bind = "b")]
    pub on_b: Wrench,
    /// Force along the axis.
    #[port("N")]
    pub force: f64,
    /// The device has been fired.
    #[port]
    pub spent: bool,
}

/// Age of the part.
#[derive(State, Clone, Copy, Debug)]
pub struct Waited {
    /// Time since the part exists.
    #[port("s")]
    pub time: f64,
}

/// State of the device.
#[derive(State, Clone, Copy, Debug)]
pub struct Charge {
    /// 0 waiting, 1 commanded, 2 pulse, 3 spent.
    #[port("1")]
    pub stage: f64,
    /// Time at which the pulse begins.
    #[port("s")]
    pub begins: f64,
    /// Impulse of the pulse.
    #[port("N s")]
    pub impulse: f64,
}

/// Guards of the device.
#[derive(Ports, Clone, Copy, Debug)]
pub struct NextStage {
    /// Time since the pulse begins or ends, or command minus ½.
    #[port("*", rising)]
    pub since: f64,
    /// Command minus ½, for a command to a device that has already fired.
    #[port("1", rising)]
    pub command: f64,
}

/// Indices of the guards in [`NextStage`].
const STAGE: usize = 0;
const COMMAND: usize = 1;

/// A pyrotechnic device.
pub struct Pyro {
    p: PyroParams,
}

/// Pyrotechnic device that separates two bodies by an impulse, with scatter of impulse and delay.
#[model("flight.pyro")]
impl Model for Pyro {
    const AVERAGES: bool = true;
    type Params = PyroParams;
    type FeedthroughInputs = PyroIn;
    type FeedthroughOutputs = PyroOut;
    type State = Waited;
    type DiscreteState = Charge;
    type Guards = NextStage;
    fn without_effect(&self, wired: IsWired<'_>) -> Judged {
        let never = "`after` is not written, so the device never fires";
        let idle = self.p.after.is_none().then(|| unwired(wired, "fire", never));
        vec![(Judge::Input("fire"), idle.flatten())]
    }
    fn build(mut p: PyroParams) -> Result<Self, BuildError> {
        p.axis = crate::axis::unit(p.axis, "[1, 0, 0]")?;
        Ok(Pyro { p })
    }
    fn feedthrough(&self, clock: &Clock, d: &Charge, u: &PyroIn) -> PyroOut {
        let tau = self.p.duration;
        let force = if d.stage == 2.0 {
            let share = |t: f64| ((t - d.begins) / tau).clamp(0.0, 1.0);
            let given = |t: f64| -0.5 * d.impulse * (PI * share(t)).cos();
            match clock.span {
                Some([a, b]) if b > a => (given(b) - given(a)) / (b - a),
                _ => 0.5 * d.impulse * PI / tau * (PI * share(clock.t)).sin(),
            }
        } else {
            0.0
        };
        let push = u.a.rotation * self.p.axis * force;
        let arm = u.b.position - u.a.position;
        PyroOut {
            on_a: Wrench { moment: -arm.cross(&push), force: -push },
            on_b: Wrench { moment: Vec3::zeros(), force: push },
            force,
            spent: d.stage == 3.0,
        }
    }
    fn derivatives(&self) -> Waited {
        Waited { time: 1.0 }
    }
    fn guards(&self, clock: &Clock, x: &Waited, d: &Charge, u: &PyroIn) -> NextStage {
        let since = match d.stage {
            0.0 => self.p.after.map_or(u.fire - 0.5, |after| x.time - after),
            1.0 => clock.t - d.begins,
            2.0 => clock.t - (d.begins + self.p.duration),
            _ => -1.0,
        };
        NextStage { since, command: u.fire - 0.5 }
    }
    fn handle_event(
        &self,
        clock: &Clock,
        fired: Fired<'_>,
        x: &Waited,
        d: &Charge,
    ) -> (Waited, Charge) {
        let p = &self.p;
        if !fired.rose(STAGE) {
            return (*x, *d);
        }
        if d.stage > 0.0 {
            return (*x, Charge { stage: d.stage + 1.0, ..*d });
        }
        let late = p.delay + p.delay_sigma * clock.normal(1).abs();
        let impulse = p.impulse * (1.0 + p.impulse_sigma * clock.normal(0)).max(0.0);
        let stage = if late > 0.0 { 1.0 } else { 2.0 };
        (*x, Charge { stage, begins: clock.t + late, impulse })
    }
    fn runtime_warning(&self, clock: &Clock, fired: Fired<'_>, d: &Charge) -> Option<BuildError> {
        if !fired.rose(COMMAND) {
            return None;
        }
        let t = clock.t;
        if let Some(after) = self.p.after {
            let fact = format!(
                "it is commanded to fire at {t:.6} s, but `after` already fires it {after} s after the start of its phase"
            );
            let help = "the command has no effect: remove `after`, or the wire to `fire`";
            return Some(BuildError::new(fact).help(help).at("after"));
        }
        (d.stage == 3.0).then(|| {
            let fact = format!(
                "it is commanded to fire at {t:.6} s, but it has already fired at {:.6} s",
                d.begins
            );
            BuildError::new(fact)
                .help("a pyrotechnic device fires only once; add another part for a second one")
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn pyro(scatter: f64, delay: f64) -> Pyro {
        Pyro::build(PyroParams {
            impulse: 12.0,
            duration: 0.02,
            axis: Vec3::new(0.0, 0.0, 3.0),
            delay,
            impulse_sigma: scatter,
            delay_sigma: 0.0,
            after: None,
        })
        .unwrap()
    }

    fn input(fire: f64) -> PyroIn {
        let a = NodeState { position: Vec3::new(1.0, 2.0, 3.0), ..NodeState::identity() };
        let b = NodeState { position: Vec3::new(1.1, 2.0, 3.4), ..a };
        PyroIn { a, b, fire }
    }

    #[test]
    fn it_gives_its_impulse_once_along_one_line() {
        let m = pyro(0.0, 0.5);
        let (x, mut d) = (Waited::zero(), Charge::zero());
        let guard = |t: f64, d: &Charge, fire: f64| {
            m.guards(&Clock::at(t, 0.1, 0), &x, d, &input(fire)).since
        };
        assert!(guard(1.0, &d, 0.0) < 0.0 && guard(1.0, &d, 1.0) > 0.0);
        let fire = |t: f64, d: &Charge| {
            m.handle_event(&Clock::at(t, 0.1, 0), Fired::rising(STAGE), &x, d).1
        };
        d = fire(1.0, &d);
        assert_eq!((d.stage, d.begins), (1.0, 1.5));
        assert!(guard(1.4, &d, 1.0) < 0.0 && guard(1.51, &d, 1.0) > 0.0);
        d = fire(1.5, &d);
        let force = |t: f64, d: &Charge| m.feedthrough(&Clock::at(t, 0.1, 0), d, &input(1.0));
        // Integrate by Simpson's rule.
        let n = 200;
        let sum: f64 = (0..=n)
            .map(|k| {
                let weight = if k == 0 || k == n { 1.0 } else { [2.0, 4.0][k % 2] };
                weight * force(1.5 + 0.02 * k as f64 / n as f64, &d).force
            })
            .sum();
        assert!((sum * 0.02 / n as f64 / 3.0 - 12.0).abs() < 1e-8, "{sum}");
        let (u, y) = (input(1.0), force(1.507, &d));
        assert_eq!(y.on_a.force + y.on_b.force, Vec3::zeros());
        let about = |s: &NodeState, w: &Wrench| w.moment + s.position.cross(&w.force);
        let total = about(&u.a, &y.on_a) + about(&u.b, &y.on_b);
        assert!(y.force > 100.0 && total.norm() < 1e-9, "{total}");
        d = fire(1.52, &d);
        assert!(force(1.53, &d).spent && force(1.53, &d).force == 0.0);
        // A second command has no effect and causes a warning.
        assert!(guard(2.0, &d, 0.0) < 0.0 && guard(2.0, &d, 1.0) < 0.0);
        let c = Clock::at(2.0, 0.1, 0);
        let after = m.handle_event(&c, Fired::rising(COMMAND), &x, &d).1;
        assert_eq!((after.stage, after.begins), (3.0, 1.5));
        let told = m.runtime_warning(&c, Fired::rising(COMMAND), &d).unwrap();
        assert!(told.message.contains("already fired at 1.5"), "{told}");
        assert!(m.runtime_warning(&c, Fired::rising(STAGE), &d).is_none());
    }

    #[test]
    fn it_scatters_by_seed() {
        let m = pyro(0.05, 0.0);
        let drawn = |key: u64| {
            let c = Clock { t: 1.0, dt: 0.0, n: 0, key, sampled: false, span: None };
            m.handle_event(&c, Fired::rising(STAGE), &Waited::zero(), &Charge::zero()).1.impulse
        };
        let all: Vec<f64> = (0..4000).map(drawn).collect();
        let mean = all.iter().sum::<f64>() / 4000.0;
        let spread = (all.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / 4000.0).sqrt();
        assert!((mean - 12.0).abs() < 0.04 && (spread - 0.6).abs() < 0.03, "{mean} {spread}");
        assert_eq!(drawn(7), drawn(7));
    }

    #[test]
    fn a_command_that_is_on_from_the_start_fires() {
        let (c, d) = (Clock::at(0.0, 0.1, 0), Charge::zero());
        let since = |fire| pyro(0.0, 0.0).guards(&c, &Waited::zero(), &d, &input(fire)).since;
        assert!(since(1.0) >= 0.0 && since(0.5) >= 0.0 && since(0.0) < 0.0);
    }
}
