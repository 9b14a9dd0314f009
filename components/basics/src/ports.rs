//! Ports that many basic models share. Numbers without unit: convert at the ends where a unit matters.

use linkwork_runtime::prelude::*;

/// One input.
#[derive(Ports, Clone, Copy, Debug)]
pub struct Input {
    /// Input.
    #[port("1")]
    pub u: f64,
}

/// Any number of inputs, summed.
#[derive(Ports, Clone, Copy, Debug)]
pub struct Inputs {
    /// Inputs, summed.
    #[port("1", sum)]
    pub u: f64,
}

/// Two inputs.
#[derive(Ports, Clone, Copy, Debug)]
pub struct Pair {
    /// First input.
    #[port("1")]
    pub a: f64,
    /// Second input.
    #[port("1")]
    pub b: f64,
}

/// One output.
#[derive(Ports, Clone, Copy, Debug)]
pub struct Output {
    /// Output.
    #[port("1")]
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
    #[port("1")]
    pub x: f64,
}
