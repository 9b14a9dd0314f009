//! Bindings of parts to the machine.
use crate::author::value::Origin;

/// Prefix of the name of a binding whose name contains its target: `node:/Rover/Mast`.
pub const TO_NODE: &str = "node:/";

/// A binding of a part to a node or a hinge coordinate of the mechanism.
#[derive(Clone, Debug)]
pub struct BindSpec {
    /// Path of the part.
    pub part: String,
    /// Name of the binding, as in `#[port(bind = "..")]`.
    pub bind: String,
    /// The target.
    pub target: BindTarget,
    /// Position in the file.
    pub origin: Origin,
}

/// Target of a binding.
#[derive(Clone, Debug, PartialEq)]
pub enum BindTarget {
    /// A node of the mechanism by its full name, or a body (its hinge-side origin).
    Node(String),
    /// The one-dof hinge of a body, by the body's full name; `index` chooses the coordinate when it has several.
    Hinge {
        /// Body.
        body: String,
        /// Coordinate, from 0.
        index: usize,
    },
    /// A prescribed subhinge of a loop, by the loop's name; `index` chooses among several.
    Loop {
        /// The loop.
        name: String,
        /// Index of the prescribed subhinge, from 0.
        index: usize,
    },
    /// A field: the path of its part, or the end of this path relative to an assembly around the part that binds.
    Field(String),
}
