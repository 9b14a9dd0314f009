//! `sensors.encoder`: counts of a shaft encoder.
//! ```text
//! count = floor(ticks · gear · q/2π),   angle = 2π count/(ticks · gear),   rate = Δangle/Δt
//! ```
//! The first sample assumes that the shaft has turned at its present rate for one sample, so that its rate is as correct as that of all others.

use linkwork_runtime::prelude::*;
use std::f64::consts::TAU;

/// Resolution.
#[derive(Params, Clone, Debug)]
pub struct EncoderParams {
    /// Ticks per turn of the encoder.
    #[param(default = 1024.0, range = 1.0..)]
    pub ticks: f64,
    /// Turns of the encoder per turn of the shaft.
    #[param(default = 1.0, range = 1e-6..)]
    pub gear: f64,
}

/// The shaft.
#[derive(Ports, Clone, Copy, Debug)]
pub struct EncoderIn {
    /// The shaft.
    #[port("rad", bind = "shaft")]
    pub shaft: HingeState,
}

/// Readings.
#[derive(Ports, Clone, Copy, Debug)]
pub struct EncoderOut {
    /// Counts since zero.
    #[port("1")]
    pub count: f64,
    /// Angle of the counts.
    #[port("rad")]
    pub angle: f64,
    /// Difference of angles over the last sample.
    #[port("rad/s")]
    pub rate: f64,
}

/// Last count.
#[derive(State, Clone, Copy, Debug)]
pub struct EncoderState {
    /// Angle of the last count.
    #[port("rad")]
    pub angle: f64,
    /// A count has been taken.
    #[port("1")]
    pub started: bool,
}

/// A shaft encoder.
pub struct Encoder {
    p: EncoderParams,
}

impl Encoder {
    fn count(&self, angle: f64) -> f64 {
        (angle / TAU * self.p.ticks * self.p.gear).floor()
    }
}

/// Shaft encoder: whole ticks, and the rate as their difference over a sample.
#[model("sensors.encoder")]
impl Model for Encoder {
    type Params = EncoderParams;
    type FeedthroughInputs = EncoderIn;
    type FeedthroughOutputs = EncoderOut;
    type DiscreteState = EncoderState;
    fn feedthrough(&self, clock: &Clock, d: &EncoderState, u: &EncoderIn) -> EncoderOut {
        let count = self.count(u.shaft.angle);
        let tick = TAU / (self.p.ticks * self.p.gear);
        let before = match d.started {
            true => d.angle,
            false => self.count(u.shaft.angle - u.shaft.rate * clock.dt) * tick,
        };
        let rate = if clock.dt > 0.0 { (count * tick - before) / clock.dt } else { 0.0 };
        EncoderOut { count, angle: count * tick, rate }
    }
    fn update(&self, u: &EncoderIn) -> EncoderState {
        let angle = self.count(u.shaft.angle) * (TAU / (self.p.ticks * self.p.gear));
        EncoderState { angle, started: true }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ticks_are_whole_and_the_rate_is_right_on_average() {
        let e = Encoder { p: EncoderParams { ticks: 100.0, gear: 2.0 } };
        let mut d = EncoderState::zero();
        let (mut sum, dt) = (0.0, 0.02);
        for n in 0..=1000 {
            let shaft = HingeState { angle: -0.5 * dt * n as f64, rate: -0.5 };
            let c = Clock::at(0.0, dt, n);
            let u = EncoderIn { shaft };
            let y = e.feedthrough(&c, &d, &u);
            assert_eq!(y.count.fract(), 0.0);
            assert!((y.angle - shaft.angle).abs() <= TAU / 200.0 + 1e-12);
            // The rate is quantised to one tick per sample in every sample, also in the first one.
            assert!((y.rate + 0.5).abs() <= TAU / 200.0 / dt + 1e-12, "{n}: {}", y.rate);
            sum += y.rate;
            d = e.update(&u);
        }
        assert!((sum / 1001.0 + 0.5).abs() < 2e-3, "{}", sum / 1001.0);
    }
}
