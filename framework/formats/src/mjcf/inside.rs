//! Data of the bodies around an element.
use crate::xml::Element;
use linkwork_spatial::Pose;

/// An element inside a body, with the frames that contain it.
pub(super) struct Inside<'e> {
    pub e: &'e Element,
    /// Pose of the frames in the body.
    pub pose: Pose,
    pub class: &'e str,
}
