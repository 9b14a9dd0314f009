//! Signals of time: constant, sine, step, ramp.
//! ```text
//! sine y = offset + A sin(2π f t + φ)     pieces end at 2π f t + φ = k π/2
//! step y = before, then after from t₀ on     ramp y = start + slope (t − t₀)₊
//! ```
//! The jump of a step and the corner of a ramp are events: every integrator ends a step there and begins a new one after it. So are the
//! zeros and extremes of a sine: between two of them it only rises or only falls, so that thresholds are found and integrals are right although
//! the samples are far apart.

use crate::ports::Output;
use linkwork_runtime::prelude::*;
use std::f64::consts::{FRAC_PI_2, TAU};

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

/// Quarter period of a sine, between a zero and an extreme.
#[derive(State, Clone, Copy, Debug)]
pub struct Quarter {
    /// Its number k: it ends at the angle k π/2.
    #[port("1")]
    pub quarter: f64,
}

/// The next zero or extreme of a sine.
#[derive(Ports, Clone, Copy, Debug)]
pub struct QuarterEnd {
    /// Time since then.
    #[port("s", rising)]
    pub since: f64,
}

impl Sine {
    /// Returns the angle at which the time is zero, for an angle that increases with time.
    fn start(&self) -> f64 {
        if self.p.frequency < 0.0 { -self.p.phase } else { self.p.phase }
    }

    /// Returns the number of the quarter period at a time (s).
    fn quarter(&self, t: f64) -> f64 {
        let angle = TAU * self.p.frequency.abs() * t + self.start();
        (angle / FRAC_PI_2).floor() + 1.0
    }

    /// Returns the time (s) at which a quarter period ends; `None` for a constant.
    fn end(&self, quarter: f64) -> Option<f64> {
        let rate = TAU * self.p.frequency.abs();
        (rate > 0.0 && self.p.amplitude != 0.0).then(|| (quarter * FRAC_PI_2 - self.start()) / rate)
    }
}

/// Sine of time. Its zeros and extremes are events, so that pulses that depend on it are not lost between samples.
#[model("basics.sine")]
impl Model for Sine {
    const MODES: bool = true;
    type Params = SineParams;
    type FeedthroughOutputs = Output;
    type DiscreteState = Quarter;
    type Guards = QuarterEnd;
    fn feedthrough(&self, clock: &Clock) -> Output {
        let p = &self.p;
        let angle = TAU * p.frequency * clock.t + p.phase;
        Output { y: p.offset + p.amplitude * angle.sin() }
    }
    fn mode(&self, clock: &Clock) -> Quarter {
        Quarter { quarter: self.quarter(clock.t) }
    }
    fn guards(&self, clock: &Clock, d: &Quarter) -> QuarterEnd {
        QuarterEnd { since: self.end(d.quarter).map_or(-1.0, |end| clock.t - end) }
    }
    fn handle_event(&self, clock: &Clock, d: &Quarter) -> ((), Quarter) {
        // The angle at the end itself may belong to either quarter, because of round-off.
        ((), Quarter { quarter: self.quarter(clock.t).max(d.quarter + 1.0) })
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
        // Zeros and extremes of 0.5 Hz are at multiples of 0.5 s.
        let quarter = s.mode(&at(0.6)).quarter;
        assert_eq!((s.mode(&at(0.4)).quarter, quarter), (1.0, 2.0));
        assert!((s.guards(&at(0.6), &Quarter { quarter }).since + 0.4).abs() < 1e-12);
        assert_eq!(s.handle_event(&at(1.0 - 1e-15), &Quarter { quarter }).1.quarter, 3.0);
        let back = Sine { p: SineParams { frequency: -0.5, phase: 0.4, ..s.p.clone() } };
        let end = back.end(back.quarter(7.0)).unwrap();
        let y = back.feedthrough(&at(end)).y - 1.0;
        assert!(end > 7.0 && end <= 7.5 && (y * (y.abs() - 2.0)).abs() < 1e-12, "{end} {y}");
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
