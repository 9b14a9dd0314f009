//! Signals of time: constant, sine, step, ramp.
//! ```text
//! sine y = offset + A sin(2π f t + φ)     extremes at 2π f t + φ = π/2 + k π
//! step y = before, then after from t₀ on     ramp y = start + slope (t − t₀)₊
//! ```
//! The jump of a step and the corner of a ramp are events: every integrator ends a step there and begins a new one after it. So are the extremes of a
//! sine: between two of them it only rises or only falls, so that thresholds are found and integrals are right although the samples are far apart.

use crate::ports::Output;
use linkwork_runtime::prelude::*;
use std::f64::consts::{PI, TAU};

/// A value.
#[derive(Params, Clone, Debug)]
pub struct ConstantParams {
    /// Value.
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
    #[param(default = 1.0)]
    pub amplitude: f64,
    /// Frequency.
    #[param(unit = "Hz", default = 1.0)]
    pub frequency: f64,
    /// Phase.
    #[param(unit = "rad", default = 0.0)]
    pub phase: f64,
    /// Offset.
    #[param(default = 0.0)]
    pub offset: f64,
}

/// A sine.
pub struct Sine {
    p: SineParams,
}

/// Half period of a sine between two of its extremes.
#[derive(State, Clone, Copy, Debug)]
pub struct Half {
    /// Its number k: it ends at the angle π/2 + k π.
    #[port("1")]
    pub half: f64,
}

/// The next extreme of a sine.
#[derive(Ports, Clone, Copy, Debug)]
pub struct NextExtreme {
    /// Time since then.
    #[port("s", rising)]
    pub since: f64,
}

impl Sine {
    /// Returns the angle at which the time is zero, for an angle that increases with time.
    fn start(&self) -> f64 {
        if self.p.frequency < 0.0 { -self.p.phase } else { self.p.phase }
    }

    /// Returns the number of the half period at a time (s).
    fn half(&self, t: f64) -> f64 {
        let angle = TAU * self.p.frequency.abs() * t + self.start();
        (angle / PI - 0.5).floor() + 1.0
    }

    /// Returns the time (s) at which a half period ends; `None` for a constant.
    fn end(&self, half: f64) -> Option<f64> {
        let rate = TAU * self.p.frequency.abs();
        (rate > 0.0 && self.p.amplitude != 0.0).then(|| ((half + 0.5) * PI - self.start()) / rate)
    }
}

/// Sine of time. Its extremes are events, so that pulses that depend on it are not lost between samples.
#[model("basics.sine")]
impl Model for Sine {
    const MODES: bool = true;
    type Params = SineParams;
    type FeedthroughOutputs = Output;
    type DiscreteState = Half;
    type Guards = NextExtreme;
    fn feedthrough(&self, clock: &Clock) -> Output {
        let p = &self.p;
        let angle = TAU * p.frequency * clock.t + p.phase;
        Output { y: p.offset + p.amplitude * angle.sin() }
    }
    fn mode(&self, clock: &Clock) -> Half {
        Half { half: self.half(clock.t) }
    }
    fn guards(&self, clock: &Clock, d: &Half) -> NextExtreme {
        NextExtreme { since: self.end(d.half).map_or(-1.0, |end| clock.t - end) }
    }
    fn handle_event(&self, clock: &Clock, d: &Half) -> ((), Half) {
        // The angle of the extreme itself may belong to either half, because of round-off.
        ((), Half { half: self.half(clock.t).max(d.half + 1.0) })
    }
}

/// Step.
#[derive(Params, Clone, Debug)]
pub struct StepParams {
    /// Time of the step.
    #[param(unit = "s", default = 0.0)]
    pub time: f64,
    /// Value before.
    #[param(default = 0.0)]
    pub before: f64,
    /// Value after.
    #[param(default = 1.0)]
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
    #[param(default = 0.0)]
    pub start: f64,
    /// Growth in a second.
    #[param(default = 1.0)]
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
        // The maxima and minima of 0.5 Hz are at 0.5, 1.5, 2.5 s.
        let half = s.mode(&at(0.6)).half;
        assert_eq!((s.mode(&at(0.4)).half, half), (0.0, 1.0));
        assert!((s.guards(&at(0.6), &Half { half }).since + 0.9).abs() < 1e-12);
        assert_eq!(s.handle_event(&at(1.5 - 1e-15), &Half { half }).1.half, 2.0);
        let back = Sine { p: SineParams { frequency: -0.5, phase: 0.4, ..s.p.clone() } };
        let end = back.end(back.half(7.0)).unwrap();
        let slope = |t: f64| back.feedthrough(&at(t + 1e-6)).y - back.feedthrough(&at(t - 1e-6)).y;
        assert!(end > 7.0 && end <= 8.0 && slope(end).abs() < 1e-11, "{end}");
        let still = Sine { p: SineParams { frequency: 0.0, ..s.p.clone() } };
        assert_eq!(still.guards(&at(3.0), &still.mode(&at(3.0))).since, -1.0);
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
