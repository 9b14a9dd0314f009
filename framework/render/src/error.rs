//! Errors of scenes, cameras and lidars, with fact and remedy.

use linkwork_collision::ShapeFault;
use linkwork_collision::relief::GridFault;
use linkwork_spatial::Vec3;
use thiserror::Error;

/// Reason why something cannot be rendered.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum RenderError {
    /// An invalid grid of heights.
    #[error(transparent)]
    Surface(#[from] GridFault),
    /// A number outside its permitted range.
    #[error("{what} is {value}\n  help: {help}")]
    Number {
        /// Name of the number.
        what: &'static str,
        /// Its value.
        value: f64,
        /// Permitted range.
        help: &'static str,
    },
    /// A pose with a NaN, an infinity, or a rotation that is not of unit length.
    #[error("the pose of `{what}` is invalid\n  help: give finite numbers and a unit quaternion")]
    Pose {
        /// The object or camera.
        what: String,
    },
    /// An invalid shape.
    #[error("object `{object}`: {fault}")]
    Shape {
        /// The object.
        object: String,
        /// The first fault of the shape.
        fault: ShapeFault,
    },
    /// More objects than a mask can number.
    #[error(
        "object `{object}` exceeds the limit of {max} objects in a mask\n  help: remove some objects"
    )]
    Objects {
        /// The object.
        object: String,
        /// Maximum number of objects in a scene.
        max: usize,
    },
    /// Objects were added or moved, but the scene was not settled.
    #[error(
        "the scene has objects that were added or moved\n  help: call `settle` after the last change"
    )]
    Unsettled,
    /// An image without pixels.
    #[error("an image of {width} by {height} pixels is empty\n  help: use at least 1 by 1")]
    Empty {
        /// Number of columns.
        width: usize,
        /// Number of rows.
        height: usize,
    },
    /// An image that would take too much memory.
    #[error("{width} by {height} pixels with {samples} by {samples} rays each are {} million rays\n  help: the limit is {} million: use a smaller image or fewer rays per pixel", rays / 1_000_000, max / 1_000_000)]
    TooLarge {
        /// Number of columns.
        width: usize,
        /// Number of rows.
        height: usize,
        /// Rays along an edge of a pixel.
        samples: usize,
        /// Total number of rays.
        rays: u128,
        /// The limit.
        max: u128,
    },
    /// Vectors of a camera model that do not define an image.
    #[error("the camera model is invalid: {fact}\n  help: {help}")]
    Lens {
        /// The fault.
        fact: String,
        /// The remedy.
        help: &'static str,
    },
    /// Two images that do not form a stereo pair.
    #[error(
        "the images are not a stereo pair: {fact}\n  help: take both with the same lens and size, from positions next to each other"
    )]
    Pair {
        /// The difference.
        fact: String,
    },
    /// A file that cannot be written.
    #[error("`{file}`: {fact}")]
    File {
        /// Its path.
        file: String,
        /// The error of the operating system.
        fact: String,
    },
}

/// Returns `Ok` when the value is finite and passes a test.
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

/// Checks that a direction is a unit vector.
pub(crate) fn check_direction(what: &'static str, v: &Vec3) -> Result<(), RenderError> {
    number(what, v.norm(), |n| (n - 1.0).abs() < 1e-6, "it must be a unit vector")
}
