//! What can be wrong with frames.

use thiserror::Error;

/// Why a frame cannot be had or set.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum FramesError {
    /// No frame, body, node, pair or mechanism of that name or place.
    #[error("no {what} `{name}`\n  help: {help}")]
    Unknown {
        /// "frame", "body", "node", "pair" or "mechanism".
        what: &'static str,
        /// The name, or the place.
        name: String,
        /// What there is.
        help: String,
    },
    /// A flexible body, whose frames move with its modes.
    #[error(
        "mechanism `{mechanism}`: body `{body}` is flexible, and frames follow rigid bodies only\n  help: leave its \
         modes out, or ask the workspace for poses of its nodes"
    )]
    Flexible {
        /// The mechanism.
        mechanism: String,
        /// Its first flexible body.
        body: String,
    },
    /// A second frame of one name.
    #[error("frame `{name}` exists\n  help: give each frame its own name")]
    Duplicate {
        /// The name.
        name: String,
    },
    /// A frame cannot hang on what hangs on it.
    #[error("frame `{frame}` cannot be fixed on {on}: that hangs on it\n  help: fix it elsewhere")]
    Cycle {
        /// The frame.
        frame: String,
        /// What it should be fixed on.
        on: String,
    },
    /// Only frames of one's own can be moved or fixed elsewhere.
    #[error("{frame} is not {want}\n  help: {help}")]
    Kind {
        /// The frame.
        frame: String,
        /// "a moving frame", "a frame that was added by name".
        want: &'static str,
        /// What to do instead.
        help: &'static str,
    },
    /// A state of the wrong length.
    #[error(
        "mechanism `{mechanism}`: `{what}` has {got} numbers, not {want}\n  help: the order is that of its `Multibody`"
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
    /// A NaN or infinity, or a quaternion that is no rotation.
    #[error(
        "{place}: a number is NaN or infinite, or a quaternion is not of unit length\n  help: give \
         finite numbers and unit quaternions"
    )]
    NotFinite {
        /// Where.
        place: String,
    },
}
