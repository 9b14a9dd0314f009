//! Tests of the crate from outside: one program, with a module for each subject.
#![allow(clippy::unwrap_used)]

#[path = "../../../tests/common/misfit.rs"]
mod misfit;
mod schema;
