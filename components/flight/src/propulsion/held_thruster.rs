//! `flight.held_thruster`: a switched thruster whose pulse is averaged over the sample of the part that switches it.
//! ```text
//! F = s (T − p A_e) z at the node, not below 0     s: share of the sample for which the valve is open, held over the sample; z: against the jet
//! I = ∫ s T dt,   ṁ = s T/(I_sp g₀)                a pulse of width w in samples of Δ: s = w/Δ, I = T w
//! ```
//! T is the thrust in vacuum, p the ambient pressure on the exit A_e of the nozzle.
//! This is the impulse of a pulse of `flight.thruster` with two equal ramps and two equal dead times; the force comes earlier than that of the
//! pulse, by the dead time and the time constant of the ramps. A sample begins and ends at rows, so there are no events and no ramps that an
//! integrator has to resolve. Use it for campaigns in which a sample is short compared with the rotation of the vehicle. Ports are those of
//! `flight.thruster` without `pulses`. A command of 0 or 1, as `control.jet_selection` gives it, stands for a whole sample.

use super::thruster::{ThrusterIn, ThrusterOut};
use crate::engine::nozzle_thrust;
use linkwork_runtime::prelude::*;

/// Standard gravity, m/s².
const G0: f64 = 9.80665;

/// A thruster.
#[derive(Params, Clone, Debug)]
pub struct HeldThrusterParams {
    /// Thrust in vacuum.
    #[param(unit = "N", range = 0.0..)]
    pub thrust: f64,
    /// Specific impulse.
    #[param(unit = "s", default = 220.0, range = 1e-3..)]
    pub specific_impulse: f64,
    /// Area of the nozzle's exit, on which the ambient pressure acts.
    #[param(unit = "m^2", default = 0.0, range = 0.0..)]
    pub exit_area: f64,
}

/// Accumulated impulse.
#[derive(State, Clone, Copy, Debug)]
pub struct ImpulseState {
    /// Impulse so far.
    #[port("N s")]
    pub done: f64,
}

/// Accumulated impulse.
#[derive(Ports, Clone, Copy, Debug)]
pub struct ImpulseOut {
    /// Impulse so far, as it would be in vacuum.
    #[port("N s")]
    pub impulse: f64,
}

/// A thruster with held pulses.
pub struct HeldThruster {
    p: HeldThrusterParams,
}

impl HeldThruster {
    /// Fraction of the sample during which the thruster is on.
    fn share(u: &ThrusterIn) -> f64 {
        if u.propellant.available { u.command.clamp(0.0, 1.0) } else { 0.0 }
    }
}

/// A switched thruster with its mean force over each sample of its command, without events.
#[model("flight.held_thruster")]
impl Model for HeldThruster {
    type Params = HeldThrusterParams;
    type FeedthroughInputs = ThrusterIn;
    type Outputs = ImpulseOut;
    type FeedthroughOutputs = ThrusterOut;
    type State = ImpulseState;
    fn without_effect(&self, wired: IsWired<'_>) -> Judged {
        vec![(Judge::Input("command"), unwired(wired, "command", "the thruster never fires"))]
    }
    fn must_be_wired(&self) -> Vec<(&'static str, BuildError)> {
        crate::engine::needs_pressure(self.p.exit_area)
    }
    fn outputs(&self, x: &ImpulseState) -> ImpulseOut {
        ImpulseOut { impulse: x.done }
    }
    fn feedthrough(&self, u: &ThrusterIn) -> ThrusterOut {
        let share = Self::share(u);
        let force = share * nozzle_thrust(self.p.thrust, u.pressure, self.p.exit_area);
        ThrusterOut {
            load: Wrench { moment: Vec3::zeros(), force: u.nozzle.rotation * Vec3::z() * force },
            force,
            propellant: MassFlow { flow: share * self.p.thrust / (self.p.specific_impulse * G0) },
        }
    }
    fn derivatives(&self, u: &ThrusterIn) -> ImpulseState {
        ImpulseState { done: Self::share(u) * self.p.thrust }
    }
}

#[cfg(test)]
mod tests {
    use super::super::thruster::pulse_impulse;
    use super::*;

    #[test]
    fn its_impulse_is_that_of_the_pulse() {
        let held = |exit_area: f64| {
            let p = HeldThrusterParams { thrust: 22.0, specific_impulse: 220.0, exit_area };
            HeldThruster { p }
        };
        let m = held(0.0);
        let rotation = Quat::from_scaled_axis(Vec3::new(0.4, -0.7, 1.1));
        let nozzle = NodeState { rotation, ..NodeState::identity() };
        let sample = 0.1;
        for width in [0.0, 0.003, 0.02, 0.1] {
            let u = ThrusterIn {
                nozzle,
                command: width / sample,
                propellant: Propellant { available: true },
                pressure: 1e3,
            };
            let want = pulse_impulse(22.0, width, 0.006, 0.006);
            let y = m.feedthrough(&u);
            let given = m.derivatives(&u).done * sample;
            assert!((given - want).abs() <= 1e-15 && (y.force * sample - want).abs() <= 1e-15);
            assert!((y.propellant.flow * sample * 220.0 * G0 - want).abs() <= 1e-15);
            assert!((y.load.force - rotation * Vec3::z() * y.force).norm() < 1e-14);
            // Force and flow are zero without propellant.
            let u = ThrusterIn { propellant: Propellant { available: false }, ..u };
            let y = m.feedthrough(&u);
            let dx = m.derivatives(&u);
            assert_eq!(
                (y.force, y.propellant.flow, y.load, dx.done),
                (0.0, 0.0, Wrench::zero(), 0.0)
            );
        }
        let over = ThrusterIn {
            nozzle,
            command: 1.5,
            propellant: Propellant { available: true },
            pressure: 1e3,
        };
        assert_eq!(m.feedthrough(&over).force, 22.0);
        // On 5 cm², 1 kPa reduces the force by 0.5 N while the valve is open, and has no effect
        // while it is closed.
        let half = held(5e-4).feedthrough(&ThrusterIn { command: 0.5, ..over });
        assert!(
            (half.force - 10.75).abs() < 1e-12
                && (half.propellant.flow * 220.0 * G0 - 11.0).abs() < 1e-9
        );
        let off = held(5e-4).feedthrough(&ThrusterIn { command: 0.0, ..over });
        assert_eq!((off.force, off.load), (0.0, Wrench::zero()));
        assert_eq!(m.outputs(&ImpulseState { done: 3.5 }).impulse, 3.5);
    }
}
