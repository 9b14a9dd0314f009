//! Tests of the public interface: one program, with a module for each subject.
#![allow(non_snake_case, clippy::unwrap_used)]

mod c_bad_input;
mod c_closed_form;
mod c_examples;
mod c_hands;
mod c_interface;
mod c_linkages;
mod c_many;
mod c_mechanism;
mod c_memory;
mod c_motions;
mod c_numbers;
mod c_obstacles;
mod c_tasks;
mod c_together;
mod cpp_calls;
mod support;
