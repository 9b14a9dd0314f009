//! `manipulation.finger`: a finger that closes the handle of a tool while the gripper command is closed.
//! ```text
//! Ḟ = (F_grip − F)/T,   F_grip: `force` while `grip`, else 0
//! τ = −F ℓ                            on the pin of the handle, which opens with a growing angle
//! ```
//! The finger and the pin belong to one hand: the finger's force is internal to the hand, and the arm does not feel it.

use linkwork_runtime::prelude::*;

/// A finger on a handle.
#[derive(Params, Clone, Debug)]
pub struct FingerParams {
    /// Force when it is closed.
    #[param(unit = "N", range = 0.0..)]
    pub force: f64,
    /// From the pin to where it presses.
    #[param(unit = "m", range = 0.0..)]
    pub lever: f64,
    /// Time constant with which the force builds up and decays.
    #[param(unit = "s", default = 0.1, range = 1e-6..)]
    pub time_constant: f64,
}

/// Command of the finger.
#[derive(Ports, Clone, Copy, Debug)]
pub struct FingerIn {
    /// The gripper is to be closed.
    #[port("1")]
    pub grip: bool,
}

/// Torque and state of the finger.
#[derive(Ports, Clone, Copy, Debug)]
pub struct FingerOut {
    /// Torque on the handle's pin.
    #[port(bind = "handle")]
    pub torque: HingeTorque,
    /// Force on the handle.
    #[port("N")]
    pub force: f64,
}

/// State.
#[derive(State, Clone, Copy, Debug)]
pub struct FingerState {
    /// Force on the handle.
    #[port("N")]
    pub force: f64,
}

/// A finger.
pub struct Finger {
    p: FingerParams,
}

/// A finger that closes a tool's handle with a force when the gripper is commanded to close.
#[model("manipulation.finger")]
impl Model for Finger {
    type Params = FingerParams;
    type Inputs = FingerIn;
    type Outputs = FingerOut;
    type State = FingerState;
    fn outputs(&self, x: &FingerState) -> FingerOut {
        FingerOut { torque: HingeTorque(-x.force * self.p.lever), force: x.force }
    }
    fn derivatives(&self, x: &FingerState, u: &FingerIn) -> FingerState {
        let wanted = if u.grip { self.p.force } else { 0.0 };
        FingerState { force: (wanted - x.force) / self.p.time_constant }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Closed it tends to its force, open to none, each with its time constant; the torque closes.
    #[test]
    fn its_force_comes_and_goes() {
        let m = Finger { p: FingerParams { force: 60.0, lever: 0.11, time_constant: 0.1 } };
        let mut x = FingerState { force: 0.0 };
        let mut run = |grip: bool, seconds: f64| {
            for _ in 0..(seconds / 1e-5).round() as u64 {
                let rate = m.derivatives(&x, &FingerIn { grip }).force;
                x.force += 1e-5 * rate;
            }
            m.outputs(&x)
        };
        let y = run(true, 0.1);
        assert!((y.force - 60.0 * (1.0 - (-1.0_f64).exp())).abs() < 0.01, "{y:?}");
        assert!((y.torque.0 + y.force * 0.11).abs() < 1e-12);
        let y = run(false, 0.2);
        let left = 60.0 * (1.0 - (-1.0_f64).exp()) * (-2.0_f64).exp();
        assert!((y.force - left).abs() < 0.01, "{y:?}");
    }
}
