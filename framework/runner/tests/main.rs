//! Tests of the crate from outside: one program, with a module for each subject.
#![allow(clippy::disallowed_methods, clippy::unwrap_used)]

mod pace;
mod recording;
mod runner;
