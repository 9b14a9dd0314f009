//! What a scene, a camera or a lidar refuses: the fact and the remedy.

use linkwork_collision::ShapeFault;
use linkwork_collision::relief::GridFault;
use thiserror::Error;

/// Why something cannot be rendered.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum RenderError {
    /// A grid of heights that is none.
    #[error(transparent)]
    Surface(#[from] GridFault),
    /// A number that makes no sense.
    #[error("{what} is {value}\n  help: {help}")]
    Number {
        /// Which number.
        what: &'static str,
        /// Its value.
        value: f64,
        /// What it must be.
        help: &'static str,
    },
    /// A pose with a NaN, an infinity, or a rotation that is not of unit length.
    #[error(
        "the pose of `{what}` is not a pose\n  help: give finite numbers and a unit quaternion"
    )]
    Pose {
        /// Whose.
        what: String,
    },
    /// A shape that cannot be.
    #[error("object `{object}`: {fault}")]
    Shape {
        /// The object.
        object: String,
        /// The first of its faults.
        fault: ShapeFault,
    },
    /// More objects than a mask has numbers for.
    #[error(
        "object `{object}` is one too many: a mask has numbers for {max} objects\n  help: leave some out"
    )]
    Objects {
        /// The object.
        object: String,
        /// How many a scene may have.
        max: usize,
    },
    /// Objects were added or moved, and the scene was not told that this was all.
    #[error(
        "the scene has objects that were added or moved\n  help: call `settle` when all are where they belong"
    )]
    Unsettled,
    /// An image without pixels.
    #[error("an image of {width} by {height} pixels is empty\n  help: write at least 1 by 1")]
    Empty {
        /// Pixels in a row.
        width: usize,
        /// Rows.
        height: usize,
    },
    /// An image that would take too much memory.
    #[error("{width} by {height} pixels with {samples} by {samples} rays each are {} million rays\n  help: at most {} million: take a smaller image or fewer rays a pixel", rays / 1_000_000, max / 1_000_000)]
    TooLarge {
        /// Pixels in a row.
        width: usize,
        /// Rows.
        height: usize,
        /// Rays along an edge of a pixel.
        samples: usize,
        /// All rays.
        rays: u128,
        /// The limit.
        max: u128,
    },
    /// Vectors of a camera model that do not span an image.
    #[error("the camera model has no image: {fact}\n  help: {help}")]
    Lens {
        /// What is wrong.
        fact: String,
        /// What to do.
        help: &'static str,
    },
    /// Two images that are no stereo pair.
    #[error(
        "the images are no stereo pair: {fact}\n  help: take both with the same lens and size, one beside the other"
    )]
    Pair {
        /// What does not fit.
        fact: String,
    },
    /// A file that cannot be written.
    #[error("`{file}`: {fact}")]
    File {
        /// Its path.
        file: String,
        /// What the system says.
        fact: String,
    },
}

/// `Ok` when the value is finite and passes a test.
pub(crate) fn number(
    what: &'static str,
    value: f64,
    good: impl Fn(f64) -> bool,
    help: &'static str,
) -> Result<(), RenderError> {
    match value.is_finite() && good(value) {
        true => Ok(()),
        false => Err(RenderError::Number { what, value, help }),
    }
}
