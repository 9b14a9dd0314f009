//! Signals of time: constant, sine, step, ramp.
//! ```text
//! sine y = offset + A sin(2π f t + φ)     step y = before, then after from t₀ on     ramp y = start + slope (t − t₀)₊
//! ```
//! The jump of a step and the corner of a ramp are events: every integrator ends a step there and begins a new one after it.

use crate::ports::Output;
use linkwork_runtime::prelude::*;

/// A value.
#[derive(Params, Clone, Debug)]
pub struct ConstantParams {
    /// Value.
    #[param(unit = "*")]
    pub value: f64,
}

/// A constant.
pub struct Constant {
    p: ConstantParams,
}

/// A number that never changes.
#[model("basics.constant")]
impl Model for Constant {
    type Params = ConstantParams;
    type FeedthroughOutputs = Output;
    fn feedthrough(&self) -> Output {
        Output { y: self.p.value }
    }
}

/// Sine.
#[derive(Params, Clone, Debug)]
pub struct SineParams {
    /// Amplitude.
    #[param(unit = "*", default = 1.0)]
    pub amplitude: f64,
    /// Frequency.
    #[param(unit = "Hz", default = 1.0)]
    pub frequency: f64,
    /// Phase.
    #[param(unit = "rad", default = 0.0)]
    pub phase: f64,
    /// Offset.
    #[param(unit = "*", default = 0.0)]
    pub offset: f64,
}

/// A sine.
pub struct Sine {
    p: SineParams,
}

/// Sine of time.
#[model("basics.sine")]
impl Model for Sine {
    type Params = SineParams;
    type FeedthroughOutputs = Output;
    fn feedthrough(&self, clock: &Clock) -> Output {
        let p = &self.p;
        let angle = std::f64::consts::TAU * p.frequency * clock.t + p.phase;
        Output { y: p.offset + p.amplitude * angle.sin() }
    }
}

/// Step.
#[derive(Params, Clone, Debug)]
pub struct StepParams {
    /// Time of the step.
    #[param(unit = "s", default = 0.0)]
    pub time: f64,
    /// Value before.
    #[param(unit = "*", default = 0.0)]
    pub before: f64,
    /// Value after.
    #[param(unit = "*", default = 1.0)]
    pub after: f64,
}

/// State of a source that changes at a time.
#[derive(State, Clone, Copy, Debug)]
pub struct Begun {
    /// The time has been reached.
    #[port]
    pub begun: bool,
}

/// The time of a source.
#[derive(Ports, Clone, Copy, Debug)]
pub struct Begins {
    /// Time since then.
    #[port("s", rising)]
    pub since: f64,
}

impl Begun {
    fn at(c: &Clock, time: f64) -> Begun {
        Begun { begun: c.t >= time }
    }
}

/// A step.
pub struct Step {
    p: StepParams,
}

/// One value before a given time and another from that time on. The jump is an event.
#[model("basics.step")]
impl Model for Step {
    const MODES: bool = true;
    type Params = StepParams;
    type FeedthroughOutputs = Output;
    type DiscreteState = Begun;
    type Guards = Begins;
    fn feedthrough(&self, clock: &Clock, d: &Begun) -> Output {
        // Use the clock as an argument, because otherwise the output would count as constant in time.
        let _ = clock;
        Output { y: if d.begun { self.p.after } else { self.p.before } }
    }
    fn mode(&self, clock: &Clock) -> Begun {
        Begun::at(clock, self.p.time)
    }
    fn guards(&self, clock: &Clock) -> Begins {
        Begins { since: clock.t - self.p.time }
    }
    fn handle_event(&self) -> ((), Begun) {
        ((), Begun { begun: true })
    }
}

/// Ramp.
#[derive(Params, Clone, Debug)]
pub struct RampParams {
    /// Time at which the ramp starts.
    #[param(unit = "s", default = 0.0)]
    pub time: f64,
    /// Value before.
    #[param(unit = "*", default = 0.0)]
    pub start: f64,
    /// Growth in a second.
    #[param(unit = "*", default = 1.0)]
    pub slope: f64,
}

/// A ramp.
pub struct Ramp {
    p: RampParams,
}

/// Constant, then growing linearly; the corner is an event.
#[model("basics.ramp")]
impl Model for Ramp {
    const MODES: bool = true;
    type Params = RampParams;
    type FeedthroughOutputs = Output;
    type DiscreteState = Begun;
    type Guards = Begins;
    fn feedthrough(&self, clock: &Clock, d: &Begun) -> Output {
        let p = &self.p;
        let grown = if d.begun { p.slope * (clock.t - p.time) } else { 0.0 };
        Output { y: p.start + grown }
    }
    fn mode(&self, clock: &Clock) -> Begun {
        Begun::at(clock, self.p.time)
    }
    fn guards(&self, clock: &Clock) -> Begins {
        Begins { since: clock.t - self.p.time }
    }
    fn handle_event(&self) -> ((), Begun) {
        ((), Begun { begun: true })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn signals_of_time() {
        let at = |t: f64| Clock::at(t, 0.1, 0);
        let s = Sine { p: SineParams { amplitude: 2.0, frequency: 0.5, phase: 0.0, offset: 1.0 } };
        assert!((s.feedthrough(&at(0.5)).y - 3.0).abs() < 1e-12);
        let s = Step { p: StepParams { time: 1.0, before: -1.0, after: 4.0 } };
        let mode = |t: f64| s.mode(&at(t));
        let y = |t: f64| s.feedthrough(&at(t), &mode(t)).y;
        assert_eq!([0.9, 1.0, 2.0].map(y), [-1.0, 4.0, 4.0]);
        let r = Ramp { p: RampParams { time: 1.0, start: 2.0, slope: 3.0 } };
        let y = |t: f64| r.feedthrough(&at(t), &mode(t)).y;
        assert_eq!([0.0, 3.0].map(y), [2.0, 8.0]);
        // The piece does not change within a step.
        let before = Begun { begun: false };
        assert_eq!(s.feedthrough(&at(1.4), &before).y, -1.0);
        assert_eq!(s.guards(&at(0.75)).since, -0.25);
        let k = Constant { p: ConstantParams { value: 7.0 } };
        assert_eq!(k.feedthrough().y, 7.0);
    }
}
