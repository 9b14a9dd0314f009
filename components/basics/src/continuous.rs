//! Continuous states: integrator, first-order lag, energy meter, path length.
//! ```text
//! integrator ẋ = k u     lag ẋ = (u − x)/T     energy Ė = P     path ṡ = |v|
//! ```

use crate::ports::{Input, One, Output};
use linkwork_runtime::prelude::*;

/// Factor and start.
#[derive(Params, Clone, Debug)]
pub struct IntegratorParams {
    /// Factor.
    #[param(unit = "*", default = 1.0)]
    pub k: f64,
    /// Value at the start.
    #[param(unit = "*", default = 0.0)]
    pub start: f64,
}

/// An integrator.
pub struct Integrator {
    p: IntegratorParams,
}

/// Integral of its input over time.
#[model("basics.integrator")]
impl Model for Integrator {
    type Params = IntegratorParams;
    type Inputs = Input;
    type Outputs = Output;
    type State = One;
    fn init_x(&self) -> One {
        One { x: self.p.start }
    }
    fn outputs(&self, x: &One) -> Output {
        Output { y: x.x }
    }
    fn derivatives(&self, u: &Input) -> One {
        One { x: self.p.k * u.u }
    }
}

/// Time constant and start.
#[derive(Params, Clone, Debug)]
pub struct LagParams {
    /// Time constant.
    #[param(unit = "s", range = 1e-9..)]
    pub time_constant: f64,
    /// Value at the start.
    #[param(unit = "*", default = 0.0)]
    pub start: f64,
}

/// A first-order lag.
pub struct Lag {
    p: LagParams,
}

/// First-order lag: the output follows the input with a time constant.
#[model("basics.lag")]
impl Model for Lag {
    type Params = LagParams;
    type Inputs = Input;
    type Outputs = Output;
    type State = One;
    fn init_x(&self) -> One {
        One { x: self.p.start }
    }
    fn outputs(&self, x: &One) -> Output {
        Output { y: x.x }
    }
    fn derivatives(&self, x: &One, u: &Input) -> One {
        One { x: (u.u - x.x) / self.p.time_constant }
    }
}

/// The model has no parameters.
#[derive(Params, Clone, Debug)]
pub struct MeterParams {}

/// Powers.
#[derive(Ports, Clone, Copy, Debug)]
pub struct EnergyIn {
    /// Powers, summed.
    #[port("W", sum)]
    pub power: f64,
}

/// Energy.
#[derive(Ports, Clone, Copy, Debug)]
pub struct EnergyOut {
    /// Energy since the start.
    #[port("J")]
    pub energy: f64,
}

/// Energy so far.
#[derive(State, Clone, Copy, Debug)]
pub struct EnergyState {
    /// Energy.
    #[port("J")]
    pub energy: f64,
}

/// An energy meter.
pub struct EnergyMeter {}

/// Energy: the integral of any number of powers.
#[model("basics.energy_meter")]
impl Model for EnergyMeter {
    type Params = MeterParams;
    type Inputs = EnergyIn;
    type Outputs = EnergyOut;
    type State = EnergyState;
    fn build(_: MeterParams) -> Result<Self, BuildError> {
        Ok(EnergyMeter {})
    }
    fn outputs(&self, x: &EnergyState) -> EnergyOut {
        EnergyOut { energy: x.energy }
    }
    fn derivatives(&self, u: &EnergyIn) -> EnergyState {
        EnergyState { energy: u.power }
    }
}

/// A node.
#[derive(Ports, Clone, Copy, Debug)]
pub struct PathIn {
    /// The node whose path is measured.
    #[port(bind = "node")]
    pub node: NodeState,
}

/// Length.
#[derive(Ports, Clone, Copy, Debug)]
pub struct PathOut {
    /// Length of the path since the start.
    #[port("m")]
    pub length: f64,
}

/// Length so far.
#[derive(State, Clone, Copy, Debug)]
pub struct PathState {
    /// Length.
    #[port("m")]
    pub length: f64,
}

/// A path meter.
pub struct PathMeter {}

/// Length of the path of a node.
#[model("basics.path_length")]
impl Model for PathMeter {
    type Params = MeterParams;
    type Inputs = PathIn;
    type Outputs = PathOut;
    type State = PathState;
    fn build(_: MeterParams) -> Result<Self, BuildError> {
        Ok(PathMeter {})
    }
    fn outputs(&self, x: &PathState) -> PathOut {
        PathOut { length: x.length }
    }
    fn derivatives(&self, u: &PathIn) -> PathState {
        PathState { length: u.node.velocity.norm() }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rates() {
        let i = Integrator { p: IntegratorParams { k: 2.0, start: 5.0 } };
        assert_eq!(i.init_x().x, 5.0);
        assert_eq!(i.derivatives(&Input { u: 3.0 }).x, 6.0);
        let l = Lag { p: LagParams { time_constant: 0.5, start: 1.0 } };
        assert_eq!(l.derivatives(&l.init_x(), &Input { u: 3.0 }).x, 4.0);
        let e = EnergyState { energy: 9.0 };
        assert_eq!(EnergyMeter {}.derivatives(&EnergyIn { power: 4.0 }).energy, 4.0);
        assert_eq!(EnergyMeter {}.outputs(&e).energy, 9.0);
        let node = NodeState { velocity: Vec3::new(3.0, 0.0, 4.0), ..NodeState::identity() };
        assert_eq!(PathMeter {}.derivatives(&PathIn { node }).length, 5.0);
    }
}
