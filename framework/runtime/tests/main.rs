//! What the crate promises, seen from outside: one program, a module for each subject.
#![allow(non_snake_case, clippy::unwrap_used)]

mod algebraic;
mod common;
mod events;
mod fields;
mod instants;
mod model_macro;
mod outputs_in_derivatives;
mod pins;
mod recorder;
mod run;
mod service_kinds;
mod shared;
mod sized;
mod stepper;
mod stops;
