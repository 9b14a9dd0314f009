//! The last image of a simulated camera for its readers, and the shapes of bodies for rendering.

use crate::detector::Image;
use crate::error::RenderError;
use crate::lens::Lens;
use linkwork_collision::{Shape, VisualShape};
use linkwork_runtime::Shows;
use linkwork_spatial::{Pose, Vec3};
use serde::{Deserialize, Serialize};
use std::path::Path;

/// The last image of a camera. Arrays are row by row from the top, with one entry per pixel.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Picture {
    /// Number of images taken so far; 0: none yet, and all arrays are empty.
    pub number: u64,
    /// Simulated time of the exposure, s.
    pub time: f64,
    /// Pose of the camera, X_WC: x to the right, y down, z along the optical axis.
    pub pose: Pose,
    /// Its lens.
    pub lens: Lens,
    /// Number of columns.
    pub width: usize,
    /// Number of rows.
    pub height: usize,
    /// Distance along the ray of each pixel, m; NaN without a measurement.
    pub range: Vec<f32>,
    /// Object numbers, as in [`Frame::objects`](crate::Frame::objects); empty for a camera without masks.
    pub objects: Vec<u16>,
    /// The image.
    pub image: Image,
}

impl Shows for Picture {
    const KIND: &'static str = "pictures";
}

impl Picture {
    /// Returns the points in W of the pixels that have a range, row by row.
    pub fn points(&self) -> impl Iterator<Item = Vec3> + '_ {
        self.points_from(self.pose)
    }

    /// Like [`points`](Self::points), for an assumed pose X_WC of the camera.
    pub fn points_from(&self, X_WC: Pose) -> impl Iterator<Item = Vec3> + '_ {
        self.range.iter().enumerate().filter(|(_, range)| range.is_finite()).filter_map(
            move |(k, range)| {
                let pixel = [(k % self.width) as f64, (k / self.width) as f64];
                let ray = self.lens.ray(pixel)?;
                let p_C = ray.origin + ray.direction * f64::from(*range);
                Some(X_WC.transform_point(&p_C))
            },
        )
    }
}

/// Returns the geometry of a visual, with meshes read from their files.
///
/// # Errors
/// A mesh that cannot be read, with its file.
pub fn shape_of(seen: &VisualShape) -> Result<Shape, RenderError> {
    match seen {
        VisualShape::Shape(shape) => Ok(shape.clone()),
        VisualShape::File { file, scale } => {
            let fault = |fact: String| RenderError::File { file: file.clone(), fact };
            let corners = linkwork_formats::mesh_corners(Path::new(file)).map_err(fault)?;
            let vertices = corners.iter().map(|p| p.component_mul(scale)).collect();
            let count = corners.len() as u32 / 3;
            let triangles = (0..count).map(|t| [3 * t, 3 * t + 1, 3 * t + 2]).collect();
            Ok(Shape::Mesh { vertices, triangles })
        }
    }
}
