//! Sampled states: zero-order hold, unit delay, differentiator, running statistics.
//! ```text
//! hold y_k = u_k between samples     delay y_k = u_(k−1)     differentiator y_k = (u_k − u_(k−1))/Δt
//! statistics (Welford): mean' = mean + (u − mean)/n,  rms² = Σ u²/n
//! ```

use crate::ports::{Input, One, Output};
use linkwork_runtime::prelude::*;

/// The model has no parameters.
#[derive(Params, Clone, Debug)]
pub struct SampledParams {}

/// A hold.
pub struct Hold {}

/// Zero-order hold: takes its input at its own samples and keeps it between them.
#[model("basics.hold")]
impl Model for Hold {
    type Params = SampledParams;
    type FeedthroughInputs = Input;
    type FeedthroughOutputs = Output;
    fn build(_: SampledParams) -> Result<Self, BuildError> {
        Ok(Hold {})
    }
    fn feedthrough(&self, u: &Input) -> Output {
        Output { y: u.u }
    }
    fn update(&self) {}
}

/// First output.
#[derive(Params, Clone, Debug)]
pub struct DelayParams {
    /// Output before the first sample.
    #[param(unit = "*", default = 0.0)]
    pub start: f64,
}

/// A delay.
pub struct Delay {
    p: DelayParams,
}

/// Unit delay: the input at the previous sample. Breaks algebraic loops.
#[model("basics.delay")]
impl Model for Delay {
    type Params = DelayParams;
    type Inputs = Input;
    type Outputs = Output;
    type DiscreteState = One;
    fn init_d(&self) -> One {
        One { x: self.p.start }
    }
    fn outputs(&self, d: &One) -> Output {
        Output { y: d.x }
    }
    fn update(&self, u: &Input) -> One {
        One { x: u.u }
    }
}

/// Last input.
#[derive(State, Clone, Copy, Debug)]
pub struct Last {
    /// Last input.
    #[port("*")]
    pub u: f64,
    /// An input has been sampled.
    #[port("1")]
    pub started: bool,
}

/// A differentiator.
pub struct Differentiator {}

/// Difference of the last two samples divided by the sample period; 0 at the first sample.
#[model("basics.differentiator")]
impl Model for Differentiator {
    type Params = SampledParams;
    type FeedthroughInputs = Input;
    type FeedthroughOutputs = Output;
    type DiscreteState = Last;
    fn build(_: SampledParams) -> Result<Self, BuildError> {
        Ok(Differentiator {})
    }
    fn feedthrough(&self, clock: &Clock, d: &Last, u: &Input) -> Output {
        Output { y: if d.started && clock.dt > 0.0 { (u.u - d.u) / clock.dt } else { 0.0 } }
    }
    fn update(&self, u: &Input) -> Last {
        Last { u: u.u, started: true }
    }
}

/// Statistics so far.
#[derive(State, Clone, Copy, Debug)]
pub struct Tally {
    /// Samples.
    #[port("1")]
    pub count: f64,
    /// Smallest.
    #[port("*")]
    pub min: f64,
    /// Largest.
    #[port("*")]
    pub max: f64,
    /// Mean.
    #[port("*")]
    pub mean: f64,
    /// Mean of the squares.
    #[port("1")]
    pub square: f64,
}

/// Statistics.
#[derive(Ports, Clone, Copy, Debug)]
pub struct StatisticsOut {
    /// Samples.
    #[port("1")]
    pub count: f64,
    /// Smallest sample.
    #[port("*")]
    pub min: f64,
    /// Largest sample.
    #[port("*")]
    pub max: f64,
    /// Mean.
    #[port("*")]
    pub mean: f64,
    /// Root mean square.
    #[port("*")]
    pub rms: f64,
}

/// Running statistics.
pub struct Statistics {}

/// Running minimum, maximum, mean and RMS of the samples so far; all 0 before the first.
#[model("basics.statistics")]
impl Model for Statistics {
    type Params = SampledParams;
    type Inputs = Input;
    type Outputs = StatisticsOut;
    type DiscreteState = Tally;
    fn build(_: SampledParams) -> Result<Self, BuildError> {
        Ok(Statistics {})
    }
    fn outputs(&self, d: &Tally) -> StatisticsOut {
        StatisticsOut {
            count: d.count,
            min: d.min,
            max: d.max,
            mean: d.mean,
            rms: d.square.max(0.0).sqrt(),
        }
    }
    fn update(&self, d: &Tally, u: &Input) -> Tally {
        let (u, count) = (u.u, d.count + 1.0);
        let first = d.count == 0.0;
        Tally {
            count,
            min: if first { u } else { d.min.min(u) },
            max: if first { u } else { d.max.max(u) },
            mean: d.mean + (u - d.mean) / count,
            square: d.square + (u * u - d.square) / count,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn samples() {
        let c = Clock::at(0.0, 0.5, 0);
        let d = Delay { p: DelayParams { start: 4.0 } };
        assert_eq!(d.outputs(&d.init_d()).y, 4.0);
        assert_eq!(d.update(&Input { u: 2.0 }).x, 2.0);
        let y = |d: Last| Differentiator {}.feedthrough(&c, &d, &Input { u: 3.0 }).y;
        assert_eq!((y(Last { u: 1.0, started: true }), y(Last::zero())), (4.0, 0.0));
        assert_eq!(Hold {}.feedthrough(&Input { u: 3.0 }).y, 3.0);
    }

    #[test]
    fn statistics_of_a_short_series() {
        let mut d = Tally::zero();
        for u in [3.0, -1.0, 4.0, 2.0] {
            d = Statistics {}.update(&d, &Input { u });
        }
        let y = Statistics {}.outputs(&d);
        assert_eq!((y.count, y.min, y.max, y.mean), (4.0, -1.0, 4.0, 2.0));
        assert!((y.rms - 7.5f64.sqrt()).abs() < 1e-12);
    }
}
