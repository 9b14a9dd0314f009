//! Tests of the public interface: one program, with a module for each subject.
#![allow(non_snake_case, clippy::unwrap_used)]

mod closed_forms;
mod ground;
mod lenses;
mod sensors;
