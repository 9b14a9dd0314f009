//! Sampled PID controllers of a hinge: `control.rate_controller` and `control.position_controller`.
//! ```text
//! u = sat(k_f r + k_p e + I − k_d Δy/Δt)        e = r − y
//! I' = I + k_i e Δt     unless u is at its limit and e would push it further
//! ```
//! The derivative acts on the measurement, so a step of the command does not cause a peak of the output.

use linkwork_runtime::prelude::*;

/// Gains in units of output per unit of the controlled quantity.
#[derive(Params, Clone, Debug)]
pub struct PidParams {
    /// Proportional gain.
    pub kp: f64,
    /// Integral gain, 1/s.
    #[param(default = 0.0)]
    pub ki: f64,
    /// Derivative gain, s.
    #[param(default = 0.0)]
    pub kd: f64,
    /// Feed-forward of the command.
    #[param(default = 0.0)]
    pub feed_forward: f64,
    /// Greatest output.
    #[param(range = 0.0..)]
    pub limit: f64,
}

/// Integral and last measurement.
#[derive(State, Clone, Copy, Debug)]
pub struct PidState {
    /// Integral part of the output.
    #[port("V")]
    pub integral: f64,
    /// Last measurement.
    #[port("*")]
    pub last: f64,
    /// Output.
    #[port("V")]
    pub output: f64,
    /// A measurement has been seen.
    #[port("1")]
    pub started: bool,
}

/// Performs one step of the controller for the command `r` and the measurement `y` over `dt` (s).
pub fn step(p: &PidParams, d: &PidState, r: f64, y: f64, dt: f64) -> PidState {
    let error = r - y;
    let slope = if d.started && dt > 0.0 { (y - d.last) / dt } else { 0.0 };
    let integral = d.integral + p.ki * error * dt;
    let free = p.feed_forward * r + p.kp * error + integral - p.kd * slope;
    let output = free.clamp(-p.limit, p.limit);
    let pushes = (free - output) * error * p.ki > 0.0;
    let integral = if pushes { d.integral } else { integral };
    PidState { integral, last: y, output, started: true }
}

/// Voltage.
#[derive(Ports, Clone, Copy, Debug)]
pub struct PidOut {
    /// Voltage for the motor.
    #[port("V")]
    pub volts: f64,
}

/// Wanted and measured rate.
#[derive(Ports, Clone, Copy, Debug)]
pub struct RateIn {
    /// Wanted rate.
    #[port("rad/s", default = 0.0)]
    pub target: f64,
    /// Measured rate.
    #[port("rad/s")]
    pub rate: f64,
}

/// A rate controller.
pub struct RateController {
    p: PidParams,
}

/// Sampled PID of a shaft's rate with saturation and anti-windup; its output is a voltage.
#[model("control.rate_controller")]
impl Model for RateController {
    type Params = PidParams;
    type Inputs = RateIn;
    type Outputs = PidOut;
    type DiscreteState = PidState;
    fn outputs(&self, d: &PidState) -> PidOut {
        PidOut { volts: d.output }
    }
    fn update(&self, clock: &Clock, d: &PidState, u: &RateIn) -> PidState {
        step(&self.p, d, u.target, u.rate, clock.dt)
    }
}

/// Wanted and measured angle.
#[derive(Ports, Clone, Copy, Debug)]
pub struct PositionIn {
    /// Wanted angle.
    #[port("rad", default = 0.0)]
    pub target: f64,
    /// Measured angle.
    #[port("rad")]
    pub angle: f64,
}

/// A position controller.
pub struct PositionController {
    p: PidParams,
}

/// Sampled PID of a shaft's angle with saturation and anti-windup; its output is a voltage.
#[model("control.position_controller")]
impl Model for PositionController {
    type Params = PidParams;
    type Inputs = PositionIn;
    type Outputs = PidOut;
    type DiscreteState = PidState;
    fn outputs(&self, d: &PidState) -> PidOut {
        PidOut { volts: d.output }
    }
    fn update(&self, clock: &Clock, d: &PidState, u: &PositionIn) -> PidState {
        step(&self.p, d, u.target, u.angle, clock.dt)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn gains() -> PidParams {
        PidParams { kp: 2.0, ki: 4.0, kd: 0.0, feed_forward: 0.0, limit: 10.0 }
    }

    /// ẏ = −y + u + load: it settles at the command in spite of the load.
    fn settle(p: &PidParams, r: f64, load: f64, seconds: f64) -> (f64, f64) {
        let (mut y, mut d, dt, mut peak) = (0.0, PidState::zero(), 0.01, 0.0_f64);
        for _ in 0..(seconds / dt) as usize {
            d = step(p, &d, r, y, dt);
            y += dt * (-y + d.output + load);
            peak = peak.max(y);
        }
        (y, peak)
    }

    #[test]
    fn integral_removes_the_steady_error() {
        assert!((settle(&gains(), 3.0, -1.0, 20.0).0 - 3.0).abs() < 1e-6);
        let p = PidParams { ki: 0.0, ..gains() };
        assert!((settle(&p, 3.0, 0.0, 20.0).0 - 2.0).abs() < 1e-6);
    }

    #[test]
    fn output_is_limited_and_the_integral_does_not_wind_up() {
        // The command cannot be reached at first, because the output is limited.
        let p = PidParams { limit: 4.0, ..gains() };
        let (y, peak) = settle(&p, 3.5, 0.0, 30.0);
        assert!((y - 3.5).abs() < 1e-3 && peak < 3.7, "{y} {peak}");
        let mut d = PidState::zero();
        for _ in 0..1000 {
            d = step(&p, &d, 100.0, 0.0, 0.01);
        }
        assert!(d.output == 4.0 && d.integral == 0.0);
    }

    #[test]
    fn a_step_of_the_command_does_not_kick_the_derivative() {
        let p = PidParams { kd: 1.0, ki: 0.0, ..gains() };
        let d = step(&p, &PidState::zero(), 0.0, 0.0, 0.01);
        assert_eq!(step(&p, &d, 1.0, 0.0, 0.01).output, 2.0);
        assert!((step(&p, &d, 0.0, 0.01, 0.01).output + 1.02).abs() < 1e-12);
    }
}
