//! Mechanisms from files of other programs as assemblies.
pub(crate) mod companion;
pub(crate) mod convert;
pub(crate) mod devices;
pub(crate) mod import;

pub use companion::apply_companion;
pub use convert::Converted;
pub use import::{Import, read_machine};
pub use linkwork_formats::{MESH_FILES, mesh_corners, mesh_corners_of};
