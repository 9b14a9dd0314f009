//! Tests of complete mechanisms and simulations: one program, with a folder for each field.
#![allow(non_snake_case, clippy::unwrap_used)]

#[path = "../common/mod.rs"]
mod common;
mod conformance;
mod flight;
mod fmi;
mod hunt;
mod robots;
mod rover;
mod runtime;
