//! Images of the cameras of a simulation, and the poses from which they were taken.
use crate::eye::Base;
use crate::shapes::{entity, f3};
use linkwork_render::{Image, Lens, Picture};
use linkwork_runtime::{FieldSample, Program, SharedField, Shows};
use re_sdk::{AsComponents, EntityPath};
use re_sdk_types::archetypes::{self, Pinhole, Transform3D};
use re_sdk_types::components::ViewCoordinates;
use re_sdk_types::datatypes::Quaternion;

/// An entity and the data that are sent for it.
pub(crate) type Sent = (EntityPath, Box<dyn AsComponents + Send>);

/// Length of the pyramid that represents a camera, m.
const PYRAMID: f32 = 0.3;

/// A camera of the simulation.
pub(crate) struct Eye {
    /// Path of its part.
    pub path: String,
    /// Number of the last image that was sent.
    number: u64,
}

/// Returns the paths of the cameras of all phases.
pub(crate) fn cameras(program: &Program) -> Vec<String> {
    let mut all: Vec<String> = (program.phases.iter())
        .flat_map(|phase| phase.plan.fields_of(Picture::KIND).map(String::from))
        .collect();
    all.sort();
    all.dedup();
    all
}

/// Returns the entity of a camera's pose.
pub(crate) fn place(path: &str) -> EntityPath {
    entity(&format!("cameras/{path}"))
}

/// Returns the entity of a camera's images.
pub(crate) fn image(path: &str) -> EntityPath {
    place(path).join(&entity("image"))
}

impl Eye {
    /// Creates a camera with this path.
    pub fn new(path: String) -> Self {
        Self { path, number: 0 }
    }

    /// Returns the new image of a camera, with its pose expressed in a base. The pose moves with the base until the next image.
    pub fn look(&mut self, shown: &SharedField, base: &Base) -> Vec<Sent> {
        let Some(FieldSample { data: picture, .. }) = shown.downcast_ref::<FieldSample<Picture>>()
        else {
            return Vec::new();
        };
        if picture.number == self.number || picture.image.data.is_empty() {
            return Vec::new();
        }
        self.number = picture.number;
        let at = place(&self.path);
        let told = base.pose(&picture.pose);
        let q = told.rotation;
        let turn = Quaternion::from_xyzw([q.i as f32, q.j as f32, q.k as f32, q.w as f32]);
        let mut pose = Transform3D::from_translation_rotation(f3(&told.position), turn);
        if let Base::Eye(_) = base {
            pose = pose.with_parent_frame(base.frame());
        }
        let mut out: Vec<Sent> = vec![(at.clone(), Box::new(pose))];
        if let Lens::Brown(lens) = &picture.lens {
            let size = [picture.width as f32, picture.height as f32];
            let focal = lens.focal.map(|f| f as f32);
            let mut pinhole = Pinhole::from_focal_length_and_resolution(focal, size)
                .with_camera_xyz(ViewCoordinates::RDF)
                .with_image_plane_distance(PYRAMID);
            if let Base::Eye(_) = base {
                pinhole = pinhole.with_parent_frame(base.frame());
            }
            out.push((at.clone(), Box::new(pinhole)));
        }
        out.push((image(&self.path), Box::new(shown_image(&picture.image))));
        out
    }
}

/// Converts an image to 8 bits.
fn shown_image(image: &Image) -> archetypes::Image {
    let bytes: Vec<u8> = image.data.iter().map(|v| (v >> (image.bits.max(8) - 8)) as u8).collect();
    let size = [image.width as u32, image.height as u32];
    match image.channels {
        3 => archetypes::Image::from_rgb24(bytes, size),
        _ => archetypes::Image::from_l8(bytes, size),
    }
}
