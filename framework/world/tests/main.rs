//! Tests of the public interface: one program, with a module for each subject.
#![allow(non_snake_case, clippy::unwrap_used)]

mod atmosphere;
mod eclipse;
mod ephemeris;
mod frames;
mod gravity;
mod gravity_files;
#[path = "../../../tests/common/kernel.rs"]
mod kernel;
mod kernels;
mod magnetic;
mod messages;
mod nesc;
mod orbit;
mod orientation_kernels;
mod planet;
mod polyhedron;
mod support;
mod text_forms;
mod two_body;
