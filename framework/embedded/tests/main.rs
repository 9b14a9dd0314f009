//! What the crate promises, seen from outside: one program, a module for each subject.
#![allow(non_snake_case, clippy::unwrap_used)]

mod allocation;
mod bad_input;
mod closed_form;
mod collide;
mod control;
mod force;
mod golden;
mod grip;
mod kinematics;
mod linkages;
mod long_chains;
mod mounts;
mod obstacles;
mod priorities;
mod reach;
mod reference_states;
mod steps;
mod support;
mod tasks;
mod timing;
mod together;
mod transfer;
mod ways;
mod whole_body;
