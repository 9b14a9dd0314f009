//! Cameras and lidar on the CPU: ray casting of shapes and terrain, lenses, detectors, stereo.
//!
//! A [`Scene`] contains ground ([`HeightMap`]), objects (the common [`Shape`](linkwork_collision::Shape) type) and [`Light`]. A [`Camera`] renders it
//! from a pose to a [`Frame`] (depth, range, normals, masks, radiance), which a [`Detector`] converts to an [`Image`]. All are pure functions:
//! results are bit-identical for any number of threads.
//!
//! ```text
//! shapes and their rays     linkwork_collision::Target     height_map.rs   terrain
//! scene objects             scene.rs                       beam.rs         bounds of a tile of pixels
//! light and albedo          light.rs                       lens.rs         pixels and rays
//! frames                    camera.rs                      detector.rs     electrons and numbers
//! files                     picture.rs     lidar.rs        beams and echoes
//! depth from two images     stereo.rs     sight.rs         last image of a simulated camera
//! bodies of a simulation    surroundings.rs
//! ```
//! Not simulated: light that surfaces reflect onto each other, soft shadows, glare, motion blur, rolling shutters, defocus.
//!
//! ```
//! use linkwork_render::*;
//! use linkwork_render::collision::Shape;
//! use linkwork_render::spatial::{Pose, Vec3};
//!
//! # fn main() -> Result<(), RenderError> {
//! let mut scene = Scene::new(Light::default());
//! let ball = scene.add("ball", &Shape::Sphere { radius: 1.0 }, Look::plain([0.5; 3]), Pose::translation(0.0, 0.0, 5.0))?;
//! scene.settle();
//! let camera = Camera::new(Lens::Brown(Brown::ideal(65, 49, 1.0)), 65, 49, 1)?;
//! let frame = camera.look(&scene, &Pose::identity(), Want::Geometry, 2)?;
//! let middle = 24 * 65 + 32;
//! assert_eq!(frame.objects[middle], ball.in_mask());
//! assert!((frame.depth[middle] - 4.0).abs() < 1e-12);
//! # Ok(())
//! # }
//! ```
#![allow(non_snake_case)]

mod beam;
mod camera;
mod detector;
mod error;
mod height_map;
mod lens;
pub mod lidar;
mod light;
mod picture;
mod scene;
mod sight;
pub mod stereo;
mod surroundings;

pub use camera::{Camera, Frame, Want};
pub use detector::{Channels, Detector, Image, Noise};
pub use error::RenderError;
pub use height_map::HeightMap;
pub use lens::{Brown, Cahv, Cahvor, Cahvore, Lens, LensRay};
pub use light::{Light, Look, Rgb};
pub use linkwork_collision as collision;
pub use linkwork_spatial as spatial;
pub use linkwork_surroundings::Surface;
pub use scene::{FAR, Form, GROUND, Hit, ObjectId, Scene};
pub use sight::{Picture, shape_of};
pub use surroundings::Surroundings;
