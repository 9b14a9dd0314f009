//! `flight.thruster`: a small engine that is switched on and off, with dead time and ramps.
//! ```text
//! command > ½ at t     → valve opens at t + t_d,on      command < ½ → closes at t + t_d,off
//! a = a₁ + (a₀ − a₁) e^(−(t − t₀)/τ)                     share of the thrust: a₁ = 1, τ = τ_up while open,
//!                                                         a₁ = 0, τ = τ_down while closed; a₀ at t₀, the valve's last change
//! F = max(0, a T − p A_e) z at the node (z: against the jet);   ṁ = a T/(I_sp g₀)
//! ```
//! T is the thrust in vacuum; the ambient pressure p acts on the exit A_e of the nozzle while it has a jet that fills it.
//! The ramps are closed forms and not states, so they need no short steps of an integrator.
//! A pulse of width w gives the impulse T (w + (τ_down − τ_up)(1 − e^(−w/τ_up))), w counted at the valve.
//! One opening and one closing may be under way at a time: a second command of the same kind within the
//! dead time is taken for the first. Commands and the valve's changes are events.

use crate::engine::nozzle_thrust;
use linkwork_runtime::prelude::*;

/// Standard gravity, m/s².
const G0: f64 = 9.80665;

/// A thruster.
#[derive(Params, Clone, Debug)]
pub struct ThrusterParams {
    /// Thrust in vacuum.
    #[param(unit = "N", range = 0.0..)]
    pub thrust: f64,
    /// Specific impulse.
    #[param(unit = "s", default = 220.0, range = 1e-3..)]
    pub specific_impulse: f64,
    /// Dead time from the command to open until the valve opens.
    #[param(unit = "s", default = 0.0, range = 0.0..)]
    pub dead_time: f64,
    /// Dead time from the command to close; default: equal to `dead_time`.
    #[param(unit = "s", range = 0.0..)]
    pub dead_time_off: Option<f64>,
    /// Time constant of the rise.
    #[param(unit = "s", default = 0.005, range = 1e-6..)]
    pub rise: f64,
    /// Time constant of the fall; default: equal to `rise`.
    #[param(unit = "s", range = 1e-6..)]
    pub fall: Option<f64>,
    /// Area of the nozzle's exit, on which the ambient pressure acts.
    #[param(unit = "m^2", default = 0.0, range = 0.0..)]
    pub exit_area: f64,
}

/// Node and command.
#[derive(Ports, Clone, Copy, Debug)]
pub struct ThrusterIn {
    /// The nozzle; z is against the jet.
    #[port(bind = "nozzle")]
    pub nozzle: NodeState,
    /// Command: the thruster is on above ½.
    #[port("1", default = 0.0)]
    pub command: f64,
    /// Connection to the source of the propellant.
    #[port(connector)]
    pub propellant: Propellant,
    /// Ambient pressure.
    #[port("Pa", default = 0.0)]
    pub pressure: f64,
}

/// Load and flow.
#[derive(Ports, Clone, Copy, Debug)]
pub struct ThrusterOut {
    /// Load on the body.
    #[port(bind = "nozzle")]
    pub load: Wrench,
    /// Thrust.
    #[port("N")]
    pub force: f64,
    /// Propellant that it takes.
    #[port(connector)]
    pub propellant: MassFlow,
}

/// Record of the firings.
#[derive(Ports, Clone, Copy, Debug)]
pub struct FiringRecord {
    /// Impulse so far, as in vacuum.
    #[port("N s")]
    pub impulse: f64,
    /// Number of openings of the valve.
    #[port("1")]
    pub pulses: f64,
}

/// The valve.
#[derive(State, Clone, Copy, Debug)]
pub struct Valve {
    /// The valve is open.
    #[port]
    pub open: bool,
    /// Time at which the valve opens; 1e30: no opening is under way.
    #[port("s")]
    pub opens: f64,
    /// Time at which the valve closes; 1e30: no closing is under way.
    #[port("s")]
    pub closes: f64,
    /// Number of openings.
    #[port("1")]
    pub pulses: f64,
    /// Time of the last change of valve or supply.
    #[port("s")]
    pub since: f64,
    /// Fraction of the thrust at that time.
    #[port("1")]
    pub share: f64,
    /// Impulse until that time.
    #[port("N s")]
    pub impulse: f64,
    /// Propellant was available at that time.
    #[port]
    pub fed: bool,
}

/// Guards of valve and supply.
#[derive(Ports, Clone, Copy, Debug)]
pub struct Switching {
    /// Command minus ½, to open. A command of exactly ½ opens it.
    #[port("1", rising)]
    pub on: f64,
    /// Command minus ½, to close.
    #[port("1", falling)]
    pub off: f64,
    /// Time since the valve opens; negative before.
    #[port("s", rising)]
    pub opens: f64,
    /// Time since the valve closes; negative before.
    #[port("s", rising)]
    pub closes: f64,
    /// Positive with propellant, negative without.
    #[port("1")]
    pub supply: f64,
}

/// Indices of the guards in [`Switching`].
const ON: usize = 0;
const OFF: usize = 1;
const OPENS: usize = 2;
const CLOSES: usize = 3;

/// Time that is never reached: no change is under way.
const NEVER: f64 = 1e30;

/// A thruster.
pub struct Thruster {
    p: ThrusterParams,
}

impl Thruster {
    /// Fraction of the thrust, and impulse (N s), at a time (s).
    fn now(&self, t: f64, d: &Valve) -> (f64, f64) {
        let (end, tau) = match d.open {
            true => (1.0, self.p.rise),
            false => (0.0, self.p.fall.unwrap_or(self.p.rise)),
        };
        let (length, off) = (t - d.since, d.share - end);
        // Compute 1 − e^(−length/τ) without cancellation just after the valve has changed.
        let gone = -(-length / tau).exp_m1();
        let given = if d.fed { self.p.thrust * (end * length + off * tau * gone) } else { 0.0 };
        (end + off * (1.0 - gone), d.impulse + given)
    }

    /// Mean force (N) from a to b (s) against the force `back` (N) of the ambient pressure on the nozzle; only times at which the jet is stronger
    /// count. Within a step the fraction only increases or only decreases.
    fn mean(&self, [a, b]: [f64; 2], d: &Valve, back: f64) -> f64 {
        let impulse = |from: f64, to: f64| self.now(to, d).1 - self.now(from, d).1;
        let over = |t: f64| self.now(t, d).0 * self.p.thrust - back;
        let (from, to) = match (over(a) >= 0.0, over(b) >= 0.0) {
            (true, true) => (a, b),
            (false, false) => return 0.0,
            (above, _) => {
                let (end, tau) = match d.open {
                    true => (1.0, self.p.rise),
                    false => (0.0, self.p.fall.unwrap_or(self.p.rise)),
                };
                // Time at which the thrust equals `back`.
                let rest = (back / self.p.thrust - end) / (d.share - end);
                let at = (d.since - tau * rest.ln()).clamp(a, b);
                if above { (a, at) } else { (at, b) }
            }
        };
        (impulse(from, to) - back * (to - from)) / (b - a)
    }
}

/// A thruster that is switched, with dead time and first-order ramps.
#[model("flight.thruster")]
impl Model for Thruster {
    const AVERAGES: bool = true;
    type Params = ThrusterParams;
    type FeedthroughInputs = ThrusterIn;
    type Outputs = FiringRecord;
    type FeedthroughOutputs = ThrusterOut;
    type DiscreteState = Valve;
    type Guards = Switching;
    fn without_effect(&self, wired: IsWired<'_>) -> Judged {
        vec![(Judge::Input("command"), unwired(wired, "command", "the thruster never fires"))]
    }
    fn init_d(&self) -> Valve {
        Valve {
            open: false,
            opens: NEVER,
            closes: NEVER,
            pulses: 0.0,
            since: 0.0,
            share: 0.0,
            impulse: 0.0,
            fed: true,
        }
    }
    fn must_be_wired(&self) -> Vec<(&'static str, BuildError)> {
        crate::engine::needs_pressure(self.p.exit_area)
    }
    fn outputs(&self, clock: &Clock, d: &Valve) -> FiringRecord {
        FiringRecord { impulse: self.now(clock.t, d).1, pulses: d.pulses }
    }
    fn feedthrough(&self, clock: &Clock, d: &Valve, u: &ThrusterIn) -> ThrusterOut {
        let back = u.pressure * self.p.exit_area;
        let (vacuum, force) = match clock.span {
            _ if !u.propellant.available => (0.0, 0.0),
            // Within a step, valve and supply do not change, because events end a step.
            Some([a, b]) if b > a => {
                let vacuum = (self.now(b, d).1 - self.now(a, d).1) / (b - a);
                (vacuum, if back == 0.0 { vacuum } else { self.mean([a, b], d, back) })
            }
            _ => {
                let vacuum = self.now(clock.t, d).0 * self.p.thrust;
                (vacuum, nozzle_thrust(vacuum, u.pressure, self.p.exit_area))
            }
        };
        ThrusterOut {
            load: Wrench { moment: Vec3::zeros(), force: u.nozzle.rotation * Vec3::z() * force },
            force,
            propellant: MassFlow { flow: vacuum / (self.p.specific_impulse * G0) },
        }
    }
    fn guards(&self, clock: &Clock, d: &Valve, u: &ThrusterIn) -> Switching {
        // Return any negative number before the event, because a difference from 1e30 s would lose
        // the digits of t.
        let since = |t: f64| if t < NEVER { clock.t - t } else { -1.0 };
        let over = u.command - 0.5;
        Switching {
            on: over,
            off: over,
            opens: since(d.opens),
            closes: since(d.closes),
            supply: if u.propellant.available { 1.0 } else { -1.0 },
        }
    }
    fn handle_event(
        &self,
        clock: &Clock,
        fired: Fired<'_>,
        d: &Valve,
        u: &ThrusterIn,
    ) -> ((), Valve) {
        let p = &self.p;
        let (on, off) = (p.dead_time, p.dead_time_off.unwrap_or(p.dead_time));
        let (share, impulse) = self.now(clock.t, d);
        let mut d = Valve { since: clock.t, share, impulse, fed: u.propellant.available, ..*d };
        // The valve moves first, because a command of the same instant acts on the valve as it is then.
        if fired.rose(OPENS) {
            (d.open, d.opens, d.pulses) = (true, NEVER, d.pulses + 1.0);
        }
        if fired.rose(CLOSES) {
            (d.open, d.closes) = (false, NEVER);
        }
        // Skip a change that would occur after the next change in the other direction.
        let (to_open, to_close) = (d.opens < NEVER, d.closes < NEVER);
        if fired.rose(ON) {
            match () {
                () if to_close && d.closes >= clock.t + on => d.closes = NEVER,
                () if (d.open && !to_close) || to_open => {}
                () if on > 0.0 => d.opens = clock.t + on,
                () => (d.open, d.pulses) = (true, d.pulses + 1.0),
            }
        } else if fired.fell(OFF) {
            match () {
                () if to_open && d.opens >= clock.t + off => d.opens = NEVER,
                () if (!d.open && !to_open) || to_close => {}
                () if off > 0.0 => d.closes = clock.t + off,
                () => d.open = false,
            }
        }
        ((), d)
    }
}

/// Impulse (N s) of a pulse of width `w` (s) at the valve.
pub fn pulse_impulse(thrust: f64, w: f64, rise: f64, fall: f64) -> f64 {
    thrust * (w + (fall - rise) * (1.0 - (-w / rise).exp()))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn thruster() -> Thruster {
        Thruster {
            p: ThrusterParams {
                thrust: 22.0,
                specific_impulse: 220.0,
                dead_time: 0.01,
                dead_time_off: Some(0.008),
                rise: 0.006,
                fall: Some(0.011),
                exit_area: 0.0,
            },
        }
    }

    #[test]
    fn the_valve_follows_the_command_after_its_dead_time() {
        let m = thruster();
        let u = |command: f64| ThrusterIn {
            nozzle: NodeState::identity(),
            command,
            propellant: Propellant { available: true },
            pressure: 0.0,
        };
        // The command may be exactly ½ at the instant of the guard: the guard's index determines the direction.
        let edge = u(0.5);
        let at = |t: f64| Clock::at(t, 0.001, 0);
        let fire = |t: f64, which: usize, d: &Valve| m.handle_event(&at(t), one(which), d, &edge).1;
        let d = fire(1.0, 0, &m.init_d());
        assert!(!d.open && (d.opens - 1.01).abs() < 1e-15 && d.closes == NEVER);
        // A pulse shorter than the dead time is delayed but complete.
        let d = fire(1.005, 1, &d);
        assert!((d.closes - 1.013).abs() < 1e-15 && !d.open);
        let g = m.guards(&at(1.011), &d, &u(0.0));
        assert!(g.opens > 0.0 && g.closes < 0.0 && g.on < 0.0 && g.off < 0.0);
        let d = fire(1.01, 2, &d);
        assert!(d.open && d.opens == NEVER && d.pulses == 1.0);
        assert!(!fire(1.013, 3, &d).open);
    }

    /// Returns a guard in the direction in which it is due.
    fn one(which: usize) -> Fired<'static> {
        if which == OFF { Fired::falling(which) } else { Fired::rising(which) }
    }

    /// The integrals of force and flow equal the impulse of the output and the closed form of ȧ = (1 − a)/τ. The force ends when the
    /// propellant ends, and continues from the present share when propellant comes back.
    #[test]
    fn a_pulse_has_the_impulse_of_its_closed_form() {
        let m = thruster();
        let u = ThrusterIn {
            nozzle: NodeState::identity(),
            command: 1.0,
            propellant: Propellant { available: true },
            pressure: 0.0,
        };
        let at = |t: f64| Clock::at(t, 0.001, 0);
        for w in [0.003, 0.02, 0.1] {
            let (h, mut sum, mut flow) = (1e-6, 0.0, 0.0);
            let fire =
                |t: f64, which: usize, d: &Valve| m.handle_event(&at(t), one(which), d, &u).1;
            let opened = fire(1.0, 2, &m.init_d());
            let closed = fire(1.0 + w, 3, &opened);
            for k in 0..300_000 {
                let t = 1.0 + (f64::from(k) + 0.5) * h;
                let d = if t < 1.0 + w { &opened } else { &closed };
                let y = m.feedthrough(&at(t), d, &u);
                (sum, flow) = (sum + y.force * h, flow + y.propellant.flow * h);
                // Compare ȧ with a finite difference.
                if k % 10_000 == 5000 {
                    let a = |t: f64| m.now(t, d).0;
                    let want = if d.open { (1.0 - a(t)) / 0.006 } else { -a(t) / 0.011 };
                    assert!(((a(t + 1e-7) - a(t - 1e-7)) / 2e-7 - want).abs() < 1e-4, "{t}");
                }
            }
            let want = pulse_impulse(22.0, w, 0.006, 0.011);
            assert!((sum / want - 1.0).abs() < 1e-6, "{w}: {sum} {want}");
            assert!((flow * 220.0 * G0 / want - 1.0).abs() < 1e-6);
            let told = m.outputs(&at(1.3), &closed).impulse;
            assert!((told - sum).abs() < 1e-6 * want, "{told} {sum}");
        }
        // The supply fails 20 ms after the valve has opened, and returns later.
        let dry = ThrusterIn { propellant: Propellant { available: false }, ..u };
        let d = m.handle_event(&at(1.0), one(2), &m.init_d(), &u).1;
        let before = m.outputs(&at(1.02), &d).impulse;
        let d = m.handle_event(&at(1.02), one(4), &d, &dry).1;
        let y = m.feedthrough(&at(1.03), &d, &dry);
        assert_eq!((y.force, y.propellant.flow), (0.0, 0.0));
        assert_eq!(m.outputs(&at(1.5), &d).impulse, before);
        let d = m.handle_event(&at(1.5), one(4), &d, &u).1;
        let after = m.outputs(&at(1.6), &d).impulse - before;
        assert!((after - 2.2).abs() < 1e-9, "{after}");
        let [on, off] = [u, dry].map(|u| m.guards(&at(1.0), &d, &u).supply);
        assert!(on > 0.0 && off < 0.0);
    }

    /// An ambient pressure of 1 kPa on 5 cm² reduces the thrust by 0.5 N while the jet is stronger than that; with a closed valve there is no force.
    #[test]
    fn ambient_pressure_takes_from_the_jet_and_from_nothing_else() {
        let m = Thruster { p: ThrusterParams { exit_area: 5e-4, ..thruster().p } };
        let u = ThrusterIn {
            nozzle: NodeState::identity(),
            command: 1.0,
            propellant: Propellant { available: true },
            pressure: 1e3,
        };
        let at = |t: f64| Clock::at(t, 0.001, 0);
        let fire = |t: f64, which: usize, d: &Valve| m.handle_event(&at(t), one(which), d, &u).1;
        let off = m.feedthrough(&at(3.0), &m.init_d(), &u);
        assert_eq!((off.load, off.force, off.propellant.flow), (Wrench::zero(), 0.0, 0.0));
        let opened = fire(1.0, 2, &m.init_d());
        let closed = fire(1.02, 3, &opened);
        let full = m.feedthrough(&at(2.0), &opened, &u);
        assert!(
            (full.force - 21.5).abs() < 1e-12
                && (full.propellant.flow * 220.0 * G0 - 22.0).abs() < 1e-9
        );
        // The mean over a long step equals the mean of many short ones. Within the step, the jet becomes stronger or
        // weaker than the ambient pressure.
        for (d, from, to) in [(&opened, 1.0, 1.02), (&closed, 1.02, 1.2)] {
            let (n, mut sum) = (200_000, 0.0);
            for k in 0..n {
                let t = from + (f64::from(k) + 0.5) * (to - from) / f64::from(n);
                sum += m.feedthrough(&at(t), d, &u).force / f64::from(n);
            }
            let step = Clock { span: Some([from, to]), ..at(from) };
            let mean = m.feedthrough(&step, d, &u).force;
            assert!((mean - sum).abs() < 1e-5 * sum, "{mean} {sum}");
        }
    }

    #[test]
    fn a_close_that_overtakes_an_opening_cancels_it() {
        let times = |on: f64, off: f64| {
            let p = thruster().p;
            Thruster { p: ThrusterParams { dead_time: on, dead_time_off: Some(off), ..p } }
        };
        let t = times(0.02, 0.005);
        let at = |time: f64| Clock::at(time, 1e-3, 0);
        let with = |command: f64| ThrusterIn {
            command,
            propellant: Propellant { available: true },
            pressure: 0.0,
            nozzle: NodeState::identity(),
        };
        let (_, d) = t.handle_event(&at(0.0), one(0), &t.init_d(), &with(1.0));
        assert_eq!(d.opens, 0.02);
        let (_, d) = t.handle_event(&at(0.01), one(1), &d, &with(0.0));
        assert!(!d.open && d.opens == NEVER && d.closes == NEVER, "{d:?}");
        // In the reverse case the valve stays open.
        let open = Valve { open: true, pulses: 1.0, ..t.init_d() };
        let t = times(0.005, 0.02);
        let (_, d) = t.handle_event(&at(1.0), one(1), &open, &with(0.0));
        let (_, d) = t.handle_event(&at(1.01), one(0), &d, &with(1.0));
        assert!(d.open && d.closes == NEVER && d.opens == NEVER, "{d:?}");
    }
}
