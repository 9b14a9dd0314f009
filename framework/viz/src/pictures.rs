//! What the cameras of a simulation see: their images, and where they were taken.
use crate::eye::Base;
use crate::shapes::{entity, f3};
use linkwork_render::{Image, Lens, Picture};
use linkwork_runtime::{Program, Seen, Shown, Shows};
use re_sdk::{AsComponents, EntityPath};
use re_sdk_types::archetypes::{self, Pinhole, Transform3D};
use re_sdk_types::components::ViewCoordinates;
use re_sdk_types::datatypes::Quaternion;

/// An entity with what is sent of it.
pub(crate) type Sent = (EntityPath, Box<dyn AsComponents + Send>);

/// Length of the pyramid that stands for a camera, m.
const PYRAMID: f32 = 0.3;

/// A camera of the simulation.
pub(crate) struct Eye {
    /// Path of its part.
    pub path: String,
    /// The picture that was sent last.
    number: u64,
}

/// Paths of the cameras of all phases.
pub(crate) fn cameras(program: &Program) -> Vec<String> {
    let mut all: Vec<String> = (program.phases.iter())
        .flat_map(|phase| phase.plan.fields_of(Picture::KIND).map(String::from))
        .collect();
    all.sort();
    all.dedup();
    all
}

/// Where a camera's pictures are.
pub(crate) fn place(path: &str) -> EntityPath {
    entity(&format!("cameras/{path}"))
}

/// Where its images are.
pub(crate) fn image(path: &str) -> EntityPath {
    place(path).join(&entity("image"))
}

impl Eye {
    /// A camera at a path.
    pub fn new(path: String) -> Self {
        Self { path, number: 0 }
    }

    /// What is new in what it shows, told in a base: it goes with that until the next picture.
    pub fn look(&mut self, shown: &Shown, base: &Base) -> Vec<Sent> {
        let Some(Seen { data: picture, .. }) = shown.downcast_ref::<Seen<Picture>>() else {
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

/// An image in 8 bits.
fn shown_image(image: &Image) -> archetypes::Image {
    let bytes: Vec<u8> = image.data.iter().map(|v| (v >> (image.bits.max(8) - 8)) as u8).collect();
    let size = [image.width as u32, image.height as u32];
    match image.channels {
        3 => archetypes::Image::from_rgb24(bytes, size),
        _ => archetypes::Image::from_l8(bytes, size),
    }
}
