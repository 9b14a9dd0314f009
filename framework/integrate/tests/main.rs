//! Tests of the public interface: one program, with a module for each subject.
#![allow(clippy::unwrap_used)]

mod allocation;
mod common;
mod convergence;
mod dense;
mod drivers;
mod events;
mod order_conditions;
mod references;
