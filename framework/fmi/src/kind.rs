//! Kinds of units.

/// Interface of a unit.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Kind {
    /// Co-simulation: the unit has its own solver.
    CoSimulation,
    /// Model exchange: the unit supplies equations that Linkwork integrates.
    ModelExchange,
}
