//! What the crate promises, seen from outside: one program, a module for each subject.
#![allow(non_snake_case, clippy::unwrap_used)]

mod common;
mod constraints;
mod coupling;
mod joints;
mod mechanism;
