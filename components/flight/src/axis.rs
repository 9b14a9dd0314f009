//! Directions that are parameters.

use linkwork_runtime::prelude::*;

/// Returns the parameter `axis` as a unit vector; `example` is a valid value for the message.
///
/// # Errors
/// The vector has length zero.
pub(crate) fn unit(axis: Vec3, example: &str) -> Result<Vec3, BuildError> {
    let length = axis.norm();
    if !(length > 1e-9) {
        return Err(BuildError::new("the axis has no length")
            .help(format!("write a direction, e.g. axis: {example}"))
            .at("axis"));
    }
    Ok(axis / length)
}
