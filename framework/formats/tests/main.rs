//! Tests of the crate from outside: one program, with a module for each subject.
#![allow(non_snake_case, clippy::unwrap_used)]

mod attach;
mod cases;
mod daveml;
mod devices;
mod export;
mod fuzz;
mod growth;
mod height_fields;
mod heights;
mod heights_written;
mod mesh_files;
mod mjcf;
#[path = "support/raster.rs"]
mod raster;
mod robots;
mod sdf;
#[path = "../../../tests/common/splitmix.rs"]
mod splitmix;
mod srdf;
mod urdf;
