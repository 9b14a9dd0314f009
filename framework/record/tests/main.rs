//! What the crate promises, seen from outside: one program, a module for each subject.
#![allow(clippy::unwrap_used)]

mod export;
mod names;
