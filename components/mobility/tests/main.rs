//! What the crate promises, seen from outside: one program, a module for each subject.

mod on_the_runtime;
mod rocker_bogie;
