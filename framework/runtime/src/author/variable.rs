//! Variables: named numbers of a simulation, and where they are stored.
use crate::author::ports::{PortKind, Text};
use std::sync::Arc;

/// Location of a variable.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Place {
    /// Continuous state lane.
    X(u32),
    /// Discrete state lane.
    D(u32),
    /// Signal lane.
    Signal(u32),
    /// A variable of a program with several phases; each phase has it in another lane or lacks it.
    Channel(u32),
    /// When a phase of the program began last (s); NaN before it has begun.
    Phase(u32),
}

/// Role of a variable.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Role {
    /// Output of a model.
    Output,
    /// Input that is driven by a wire.
    Input,
    /// Input without a wire: may be set.
    Free,
    /// State of a model or of the mechanism.
    State,
}

/// A variable: one lane with a path.
#[derive(Clone, Debug)]
pub struct Variable {
    /// Location of the variable.
    pub place: Place,
    /// Role of the variable.
    pub role: Role,
    /// Unit as written in the source.
    pub unit: Text,
    /// Meaning.
    pub doc: Text,
    /// Number or truth value.
    pub kind: PortKind,
    /// Path of the part that owns it.
    pub part: Arc<str>,
}
