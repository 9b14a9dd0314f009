//! Models that change at events: a ball that bounces, a relay with hysteresis.
//! ```text
//! ball    ḣ = v, v̇ = −g;  where h ≤ 0 and v ≤ 0:  v⁺ = −e v⁻
//! relay   1 where u ≥ on, 0 where u ≤ off, in between as it was
//! ```
//! The instants are located on the dense output of the integrator, not at the next step. The guards of both are levels: a ball that starts on the
//! floor rests there, and a relay whose input starts above `on` is on.

use crate::ports::{Input, Output};
use linkwork_runtime::prelude::*;

/// A ball over a floor.
#[derive(Params, Clone, Debug)]
pub struct BallParams {
    /// Height at the start.
    #[param(unit = "m", range = 0.0..)]
    pub height: f64,
    /// Ratio of the speed after an impact to the speed before it.
    #[param(default = 0.8, range = 0.0..=1.0)]
    pub restitution: f64,
    /// Gravity.
    #[param(unit = "m/s^2", range = 0.0..)]
    pub gravity: f64,
    /// Impact speed below which the ball stops, because otherwise the bounces would never end.
    #[param(unit = "m/s", default = 1e-3, range = 1e-9..)]
    pub speed_min: f64,
}

/// Motion of the ball.
#[derive(Ports, Clone, Copy, Debug)]
pub struct Fall {
    /// Height of its lowest point above the floor.
    #[port("m")]
    pub height: f64,
    /// Speed upwards.
    #[port("m/s")]
    pub speed: f64,
}

/// Counters of impacts.
#[derive(Ports, Clone, Copy, Debug)]
pub struct Impacts {
    /// Impacts so far.
    #[port("1")]
    pub impacts: f64,
    /// Time of the last impact.
    #[port("s")]
    pub last_impact: f64,
    /// The ball lies still.
    #[port]
    pub rests: bool,
}

/// Motion and impacts.
#[derive(Ports, Clone, Copy, Debug)]
pub struct BallOut {
    /// Height of its lowest point above the floor.
    #[port("m")]
    pub height: f64,
    /// Speed upwards.
    #[port("m/s")]
    pub speed: f64,
    /// Impacts so far.
    #[port("1")]
    pub impacts: f64,
    /// Time of the last one.
    #[port("s")]
    pub last_impact: f64,
}

/// The floor.
#[derive(Ports, Clone, Copy, Debug)]
pub struct Floor {
    /// Gap to the floor.
    #[port("m", falling)]
    pub gap: f64,
}

/// A ball.
pub struct BouncingBall {
    p: BallParams,
}

/// A ball that falls and bounces: the smallest model with an event.
#[model("basics.bouncing_ball")]
impl Model for BouncingBall {
    type Params = BallParams;
    type Outputs = BallOut;
    type State = Fall;
    type DiscreteState = Impacts;
    type Guards = Floor;
    fn init_x(&self) -> Fall {
        Fall { height: self.p.height, speed: 0.0 }
    }
    fn outputs(&self, x: &Fall, d: &Impacts) -> BallOut {
        let Fall { height, speed } = *x;
        BallOut { height, speed, impacts: d.impacts, last_impact: d.last_impact }
    }
    fn derivatives(&self, x: &Fall, d: &Impacts) -> Fall {
        if d.rests {
            return Fall { height: 0.0, speed: 0.0 };
        }
        Fall { height: x.speed, speed: -self.p.gravity }
    }
    fn guards(&self, x: &Fall) -> Floor {
        Floor { gap: x.height }
    }
    fn handle_event(&self, clock: &Clock, x: &Fall, d: &Impacts) -> (Fall, Impacts) {
        // The ball has just bounced and moves upwards.
        if x.speed > 0.0 {
            return (*x, *d);
        }
        let speed = -self.p.restitution * x.speed;
        let rests = speed < self.p.speed_min;
        let after = Fall { height: 0.0, speed: if rests { 0.0 } else { speed } };
        (after, Impacts { impacts: d.impacts + 1.0, last_impact: clock.t, rests })
    }
}

/// Two thresholds.
#[derive(Params, Clone, Debug)]
pub struct RelayParams {
    /// Input at and above which the relay is on.
    #[param(unit = "*")]
    pub on: f64,
    /// Input at and below which the relay is off; if it equals `on`, the relay is on there.
    #[param(unit = "*")]
    pub off: f64,
    /// The relay is on at the start.
    #[param(default = false)]
    pub start: bool,
}

/// State of the relay.
#[derive(State, Clone, Copy, Debug)]
pub struct Switched {
    /// The relay is on.
    #[port]
    pub on: bool,
}

/// The thresholds.
#[derive(Ports, Clone, Copy, Debug)]
pub struct Thresholds {
    /// Input minus the upper threshold.
    #[port("1", rising)]
    pub above_on: f64,
    /// Input minus the lower threshold.
    #[port("1", falling)]
    pub above_off: f64,
}

/// A relay.
pub struct Relay {
    p: RelayParams,
}

/// A relay with hysteresis: a thermostat, a pressure switch.
#[model("basics.relay")]
impl Model for Relay {
    type Params = RelayParams;
    type Inputs = Input;
    type Outputs = Output;
    type DiscreteState = Switched;
    type Guards = Thresholds;
    fn build(p: RelayParams) -> Result<Self, BuildError> {
        if p.off > p.on {
            return Err(BuildError::new(format!(
                "`off` is {}, which is above `on` = {}",
                p.off, p.on
            ))
            .help("`off` must not exceed `on`")
            .at("off"));
        }
        Ok(Relay { p })
    }
    fn init_d(&self) -> Switched {
        Switched { on: self.p.start }
    }
    fn outputs(&self, d: &Switched) -> Output {
        Output { y: f64::from(u8::from(d.on)) }
    }
    fn guards(&self, u: &Input) -> Thresholds {
        Thresholds { above_on: u.u - self.p.on, above_off: u.u - self.p.off }
    }
    fn handle_event(&self, fired: Fired<'_>, d: &Switched) -> ((), Switched) {
        ((), Switched { on: fired.rose(0) || (d.on && !fired.fell(1)) })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_impact_turns_the_speed_and_a_slow_one_stops_the_ball() {
        let p = BallParams { height: 1.0, restitution: 0.5, gravity: 9.8, speed_min: 1e-3 };
        let ball = BouncingBall { p };
        let clock = Clock { t: 2.5, dt: 0.1, n: 0, key: 0, sampled: false, span: None };
        let before = Impacts { impacts: 3.0, last_impact: 0.0, rests: false };
        let fall = |speed| Fall { height: -1e-13, speed };
        let (x, d) = ball.handle_event(&clock, &fall(-4.0), &before);
        assert_eq!((x.height, x.speed), (0.0, 2.0));
        assert_eq!((d.impacts, d.last_impact, d.rests), (4.0, 2.5, false));
        let (x, d) = ball.handle_event(&clock, &fall(-1e-3), &before);
        assert_eq!((x.speed, d.rests), (0.0, true));
    }

    #[test]
    fn a_relay_whose_thresholds_are_crossed_is_refused() {
        let wrong = Relay::build(RelayParams { on: 1.0, off: 2.0, start: false });
        assert!(wrong.is_err_and(|e| e.param.as_deref() == Some("off")));
    }
}
