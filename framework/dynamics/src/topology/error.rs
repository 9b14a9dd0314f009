//! What can be wrong with an edit of a mechanism.

use crate::error::DynamicsError;
use linkwork_multibody::BuildError;
use thiserror::Error;

/// Why an edit was refused; the mechanism is as it was.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum TopologyError {
    /// No body of that name.
    #[error("{action}: no body `{name}`\n  help: {help}")]
    Unknown {
        /// What was to be done.
        action: &'static str,
        /// The name.
        name: String,
        /// What to do.
        help: &'static str,
    },
    /// Names that exist already.
    #[error("{action}: these names exist: {}\n  help: give another prefix, or other names", names.join(", "))]
    NameClash {
        /// What was to be done.
        action: &'static str,
        /// Bodies and nodes.
        names: Vec<String>,
    },
    /// A flexible body: what hangs on it hangs on its stations, and its mass moves with its modes.
    #[error(
        "body `{body}` is flexible, and topology is edited of rigid mechanisms only\n  help: leave its modes out"
    )]
    Flexible {
        /// The body.
        body: String,
    },
    /// A body cannot hang on itself or on what hangs on it.
    #[error(
        "body `{body}` cannot hang on `{onto}`: that hangs on it\n  help: attach it elsewhere, or \
         reroot the tree first"
    )]
    OwnSubtree {
        /// The body.
        body: String,
        /// What it should hang on.
        onto: String,
    },
    /// A state of the wrong length.
    #[error(
        "{place}: `{what}` has {got} numbers, not {want}\n  help: the order is that of the hinge, or of the `Multibody`"
    )]
    Length {
        /// Whose.
        place: String,
        /// q or v.
        what: &'static str,
        /// Its length.
        got: usize,
        /// The length it should have.
        want: usize,
    },
    /// A NaN or infinity.
    #[error("{place}: a number is NaN or infinite\n  help: give finite numbers")]
    NotFinite {
        /// Where.
        place: String,
    },
    /// The hinge does not bring the body where it is.
    #[error(
        "body `{body}` cannot be attached where it is: the nearest that the hinge reaches is \
         {distance} m and {angle} rad away\n  help: move the body, the hinge frames, or use \
         `Placement::Here`"
    )]
    Unreachable {
        /// The body.
        body: String,
        /// What is left of the way, m.
        distance: f64,
        /// What is left of the turn, rad.
        angle: f64,
    },
    /// The tree of a body does not float.
    #[error(
        "the tree of `{body}` cannot be turned round: its root `{root}` does not hang on a free \
         hinge\n  help: detach `{root}` first, or attach `{body}` with its subtree only"
    )]
    NotFree {
        /// The body.
        body: String,
        /// The root of its tree.
        root: String,
    },
    /// Loops or couplings stand in the way.
    #[error(
        "{action}: body `{body}` is in a mechanism with {constraint}\n  help: take that out first, or go over to \
         the new mechanism by `carry`, which puts the state onto its loops and couplings"
    )]
    Constrained {
        /// What was to be done.
        action: &'static str,
        /// The body.
        body: String,
        /// A loop or coupling, in words.
        constraint: String,
    },
    /// The new mechanism is not sound.
    #[error("{0}")]
    Build(#[from] BuildError),
    /// The velocities after the impact cannot be found.
    #[error("{0}")]
    Dynamics(#[from] DynamicsError),
}
