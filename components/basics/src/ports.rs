//! Ports that many basic models share. They accept any unit (`*`): the quantity of a constant or a gain follows from its wires, in SI.

use linkwork_runtime::prelude::*;

/// One input.
#[derive(Ports, Clone, Copy, Debug)]
pub struct Input {
    /// Input.
    #[port("*")]
    pub u: f64,
}

/// Any number of inputs, summed.
#[derive(Ports, Clone, Copy, Debug)]
pub struct Inputs {
    /// Inputs, summed.
    #[port("*", sum)]
    pub u: f64,
}

/// Two inputs.
#[derive(Ports, Clone, Copy, Debug)]
pub struct Pair {
    /// First input.
    #[port("*")]
    pub a: f64,
    /// Second input.
    #[port("*")]
    pub b: f64,
}

/// One output.
#[derive(Ports, Clone, Copy, Debug)]
pub struct Output {
    /// Output.
    #[port("*")]
    pub y: f64,
}

/// A truth value.
#[derive(Ports, Clone, Copy, Debug)]
pub struct Truth {
    /// Output.
    #[port("1")]
    pub y: bool,
}

/// One state.
#[derive(State, Clone, Copy, Debug)]
pub struct One {
    /// State.
    #[port("*")]
    pub x: f64,
}
