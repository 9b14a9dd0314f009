//! Tests of the public interface: one program, with a module for each subject.
// Benches use one of the two `support` modules; each has its own random numbers.
#![allow(clippy::duplicate_mod, non_snake_case, clippy::unwrap_used)]

mod allocations;
mod benchmark_problems;
mod compliant;
mod contact_accuracy;
mod contact_agreement;
mod contact_analytic;
mod contact_refusals;
mod contact_scenes;
mod curved_couplings;
#[path = "../../dynamics/tests/support/mod.rs"]
mod dynamics_support;
mod flexible_loops;
mod fully_augmented;
mod heaps;
mod iftomm;
mod impacts;
mod islands;
mod loops;
mod mechanisms;
mod planar_rover;
mod refusals;
mod resistance;
mod rolling;
mod scene;
mod support;
mod wheels_on_a_step;
