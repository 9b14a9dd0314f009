//! Signals of time: constant, sine, step, ramp.
//! ```text
//! sine y = offset + A sin(2π f t + φ)     step y = before, then after from t₀ on     ramp y = start + slope (t − t₀)₊
//! ```

use crate::ports::Output;
use linkwork_runtime::prelude::*;

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
    type Yd = Output;
    fn direct(&self, _: &Clock, _: &(), _: &(), _: &()) -> Output {
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

/// Sine of time.
#[model("basics.sine")]
impl Model for Sine {
    type Params = SineParams;
    type Yd = Output;
    fn direct(&self, c: &Clock, _: &(), _: &(), _: &()) -> Output {
        let p = &self.p;
        let angle = std::f64::consts::TAU * p.frequency * c.t + p.phase;
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
    #[param(default = 0.0)]
    pub before: f64,
    /// Value after.
    #[param(default = 1.0)]
    pub after: f64,
}

/// A step.
pub struct Step {
    p: StepParams,
}

/// One value before a time, another from it on.
#[model("basics.step")]
impl Model for Step {
    type Params = StepParams;
    type Yd = Output;
    fn direct(&self, c: &Clock, _: &(), _: &(), _: &()) -> Output {
        Output { y: if c.t < self.p.time { self.p.before } else { self.p.after } }
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

/// Constant, then growing evenly.
#[model("basics.ramp")]
impl Model for Ramp {
    type Params = RampParams;
    type Yd = Output;
    fn direct(&self, c: &Clock, _: &(), _: &(), _: &()) -> Output {
        Output { y: self.p.start + self.p.slope * (c.t - self.p.time).max(0.0) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn signals_of_time() {
        let at = |t: f64| Clock::at(t, 0.1, 0);
        let s = Sine { p: SineParams { amplitude: 2.0, frequency: 0.5, phase: 0.0, offset: 1.0 } };
        assert!((s.direct(&at(0.5), &(), &(), &(), &()).y - 3.0).abs() < 1e-12);
        let s = Step { p: StepParams { time: 1.0, before: -1.0, after: 4.0 } };
        assert_eq!([0.9, 1.0].map(|t| s.direct(&at(t), &(), &(), &(), &()).y), [-1.0, 4.0]);
        let r = Ramp { p: RampParams { time: 1.0, start: 2.0, slope: 3.0 } };
        assert_eq!([0.0, 3.0].map(|t| r.direct(&at(t), &(), &(), &(), &()).y), [2.0, 8.0]);
        let k = Constant { p: ConstantParams { value: 7.0 } };
        assert_eq!(k.direct(&at(0.0), &(), &(), &(), &()).y, 7.0);
    }
}
