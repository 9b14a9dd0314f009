//! What the crate promises, seen from outside: one program, a module for each subject.
#![allow(non_snake_case, clippy::unwrap_used)]

mod allocation;
mod analytic;
mod calibration;
mod closed_forms;
mod closures;
mod compound;
mod conservation;
mod derivatives;
mod ensemble;
mod flexible;
mod flexible_motion;
mod frames;
mod identities;
mod inverse_kinematics;
mod operational;
mod operators;
mod pointing;
mod prediction;
mod reference;
mod refusal;
mod rocky8;
mod rows;
mod support;
mod topology;
mod topology_constraints;
