//! Errors of frames.

use thiserror::Error;

/// Reason why a frame operation failed.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum FramesError {
    /// No frame, body, node, pair or mechanism with this name or index.
    #[error("no {what} `{name}`\n  help: {help}")]
    Unknown {
        /// "frame", "body", "node", "pair" or "mechanism".
        what: &'static str,
        /// The name or the index.
        name: String,
        /// The existing names.
        help: String,
    },
    /// A flexible body, whose frames move with its modes.
    #[error(
        "mechanism `{mechanism}`: body `{body}` is flexible, but frames support only rigid bodies\n  help: remove \
        its modes, or compute the poses of its nodes with the workspace"
    )]
    Flexible {
        /// The mechanism.
        mechanism: String,
        /// Its first flexible body.
        body: String,
    },
    /// A frame with this name exists already.
    #[error("there is already a frame `{name}`\n  help: use another name")]
    Duplicate {
        /// The name.
        name: String,
    },
    /// A frame cannot be attached to a frame that hangs on it.
    #[error(
        "frame `{frame}` cannot be attached to {on}, which is attached to it\n  help: attach it to another frame"
    )]
    Cycle {
        /// The frame.
        frame: String,
        /// The intended parent.
        on: String,
    },
    /// Only frames that were added by name can be moved or attached elsewhere.
    #[error("{frame} is not {want}\n  help: {help}")]
    Kind {
        /// The frame.
        frame: String,
        /// Required kind: "a moving frame", "a frame that was added by name".
        want: &'static str,
        /// The remedy.
        help: &'static str,
    },
    /// A state of the wrong length.
    #[error(
        "mechanism `{mechanism}`: `{what}` has {got} numbers, expected {want}\n  help: use the order of its `Multibody`"
    )]
    Length {
        /// The mechanism.
        mechanism: String,
        /// q, v or vdot.
        what: &'static str,
        /// Its length.
        got: usize,
        /// The length it should have.
        want: usize,
    },
    /// NaN or infinity, or a quaternion that is not of unit length.
    #[error(
        "{place}: a number is NaN or infinite, or a quaternion is not of unit length\n  help: give \
         finite numbers and unit quaternions"
    )]
    NotFinite {
        /// Location.
        place: String,
    },
}
