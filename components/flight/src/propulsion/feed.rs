//! Ends of propellant lines besides tanks and engines: `flight.ideal_feed`, propellant without a tank; `flight.drain`, a commanded outflow.
//! ```text
//! ideal feed    always available, of no body's mass;   drawn = ∫ Σ ṁ dt
//! drain         ṁ as commanded while there is propellant
//! ```
//! The outflow of a drain leaves at the velocity of the body and gives no thrust.
use linkwork_runtime::prelude::*;

/// Drawn flow.
#[derive(Ports, Clone, Copy, Debug)]
pub struct IdealFeedIn {
    /// Connection for engines.
    #[port(connector)]
    pub outlet: MassFlows,
}

/// Connection to the propellant, and the amount drawn.
#[derive(Ports, Clone, Copy, Debug)]
pub struct IdealFeedOut {
    /// Connection for engines.
    #[port(connector)]
    pub outlet: Propellant,
    /// Propellant drawn since the start.
    #[port("kg")]
    pub drawn: f64,
}

/// Drawn propellant.
#[derive(State, Clone, Copy, Debug)]
pub struct Delivered {
    /// Propellant drawn since the start.
    #[port("kg")]
    pub drawn: f64,
}

/// Propellant without a tank.
pub struct IdealFeed;

/// Ideal feed: unlimited propellant without mass in any body; measures the amount drawn.
#[model("flight.ideal_feed")]
impl Model for IdealFeed {
    type Inputs = IdealFeedIn;
    type Outputs = IdealFeedOut;
    type State = Delivered;
    fn build(_: ()) -> Result<Self, BuildError> {
        Ok(IdealFeed)
    }
    fn outputs(&self, x: &Delivered) -> IdealFeedOut {
        IdealFeedOut { outlet: Propellant { available: true }, drawn: x.drawn }
    }
    fn derivatives(&self, u: &IdealFeedIn) -> Delivered {
        Delivered { drawn: u.outlet.flow }
    }
}

/// Command and tank.
#[derive(Ports, Clone, Copy, Debug)]
pub struct DrainIn {
    /// Commanded outflow; negative: inflow, for example when a tank is filled.
    #[port("kg/s")]
    pub flow: f64,
    /// Connection to the drained tank.
    #[port(connector)]
    pub tank: Propellant,
}

/// Outflow.
#[derive(Ports, Clone, Copy, Debug)]
pub struct DrainOut {
    /// Connection to the drained tank.
    #[port(connector)]
    pub tank: MassFlow,
}

/// A commanded outflow.
pub struct Drain;

/// A commanded outflow of a tank that gives no thrust: ballast, a vent, a leak; negative: a tank is filled.
#[model("flight.drain")]
impl Model for Drain {
    type FeedthroughInputs = DrainIn;
    type FeedthroughOutputs = DrainOut;
    fn build(_: ()) -> Result<Self, BuildError> {
        Ok(Drain)
    }
    fn feedthrough(&self, u: &DrainIn) -> DrainOut {
        let flows = u.tank.available || u.flow < 0.0;
        DrainOut { tank: MassFlow { flow: if flows { u.flow } else { 0.0 } } }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_ideal_feed_gives_and_counts_what_is_drawn() {
        let x = Delivered { drawn: 3.0 };
        let y = IdealFeed.outputs(&x);
        assert!(y.outlet.available && y.drawn == 3.0);
        let u = IdealFeedIn { outlet: MassFlows { flow: 0.7 } };
        assert_eq!(IdealFeed.derivatives(&u).drawn, 0.7);
    }

    #[test]
    fn a_drain_takes_what_there_is_and_fills_what_is_empty() {
        let flow = |flow: f64, available: bool| {
            let u = DrainIn { flow, tank: Propellant { available } };
            Drain.feedthrough(&u).tank.flow
        };
        assert_eq!((flow(0.5, true), flow(0.5, false)), (0.5, 0.0));
        assert_eq!((flow(-0.5, true), flow(-0.5, false)), (-0.5, -0.5));
    }
}
