//! Directions that are parameters.

use linkwork_runtime::prelude::*;

/// The parameter `axis` as a unit vector; `example`: what may be written.
///
/// # Errors
/// It has no length.
pub(crate) fn unit(axis: Vec3, example: &str) -> Result<Vec3, BuildError> {
    let length = axis.norm();
    if !(length > 1e-9) {
        return Err(BuildError::new("the axis has no length")
            .help(format!("write a direction, e.g. axis: {example}"))
            .at("axis"));
    }
    Ok(axis / length)
}
