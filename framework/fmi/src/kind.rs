//! Kinds of units.

/// Interface of a unit.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Kind {
    /// With its own solver.
    CoSimulation,
    /// As equations that Linkwork integrates.
    ModelExchange,
}
