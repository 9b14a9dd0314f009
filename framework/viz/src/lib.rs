//! The Rerun scene, stream and blueprint. Entity paths are the assembly paths.
//!
//! The viewer reads rows of a tap; it never changes the run.
mod layout;
mod scene;
mod terrain;
mod viewer;

pub use scene::{Arrow, Form, Marker, Panel, Scene, Shape};
pub use viewer::{Sink, Viewer, VizError};
