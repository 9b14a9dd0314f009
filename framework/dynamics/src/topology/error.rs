//! Errors of edits of a mechanism.

use crate::error::DynamicsError;
use linkwork_multibody::BuildError;
use thiserror::Error;

/// Reason why an edit failed; the mechanism has not changed.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum TopologyError {
    /// No body with this name.
    #[error("{action}: no body `{name}`\n  help: {help}")]
    Unknown {
        /// The operation.
        action: &'static str,
        /// The name.
        name: String,
        /// The remedy.
        help: &'static str,
    },
    /// Names that already exist.
    #[error("{action}: these names already exist: {}\n  help: give another prefix, or other names", names.join(", "))]
    NameClash {
        /// The operation.
        action: &'static str,
        /// Bodies and nodes.
        names: Vec<String>,
    },
    /// A flexible body: other bodies hang on its stations, and its mass moves with its modes.
    #[error(
        "body `{body}` is flexible, but only the topology of rigid mechanisms can be edited\n  help: remove its modes"
    )]
    Flexible {
        /// The body.
        body: String,
    },
    /// A body cannot hang on itself or on a body that hangs on it.
    #[error(
        "body `{body}` cannot be attached to `{onto}`, which is outboard of it\n  help: attach it elsewhere, or \
         reroot the tree first"
    )]
    OwnSubtree {
        /// The body.
        body: String,
        /// The intended parent.
        onto: String,
    },
    /// A state of the wrong length.
    #[error(
        "{place}: `{what}` has {got} numbers, expected {want}\n  help: use the order of the hinge, or of the `Multibody`"
    )]
    Length {
        /// Owner of the state.
        place: String,
        /// q or v.
        what: &'static str,
        /// Its length.
        got: usize,
        /// The required length.
        want: usize,
    },
    /// A number that is NaN or infinite.
    #[error("{place}: a number is NaN or infinite\n  help: give finite numbers")]
    NotFinite {
        /// Location.
        place: String,
    },
    /// The hinge cannot reach the pose of the body.
    #[error(
        "body `{body}` cannot be attached where it is: the nearest that the hinge reaches is \
         {distance} m and {angle} rad away\n  help: move the body, the hinge frames, or use \
         `Placement::Here`"
    )]
    Unreachable {
        /// The body.
        body: String,
        /// Residual distance, m.
        distance: f64,
        /// Residual angle, rad.
        angle: f64,
    },
    /// The root of a body's tree is not free.
    #[error(
        "the tree of `{body}` cannot be rerooted: its root `{root}` does not have a free hinge\n  help: detach `{root}` first, or attach `{body}` with its subtree only"
    )]
    NotFree {
        /// The body.
        body: String,
        /// The root of its tree.
        root: String,
    },
    /// Loops or couplings prevent the operation.
    #[error(
        "{action}: body `{body}` is in a mechanism with {constraint}\n  help: remove it first, or transfer the state \
        to the new mechanism with `carry`, which satisfies its loops and couplings"
    )]
    Constrained {
        /// The operation.
        action: &'static str,
        /// The body.
        body: String,
        /// Description of the loop or coupling.
        constraint: String,
    },
    /// The new mechanism is not valid.
    #[error("{0}")]
    Build(#[from] BuildError),
    /// The velocities after the impact cannot be computed.
    #[error("{0}")]
    Dynamics(#[from] DynamicsError),
}
