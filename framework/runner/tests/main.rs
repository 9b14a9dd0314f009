//! What the crate promises, seen from outside: one program, a module for each subject.
#![allow(clippy::disallowed_methods, clippy::unwrap_used)]

mod pace;
mod recording;
mod runner;
