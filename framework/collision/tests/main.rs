//! What the crate promises, seen from outside: one program, a module for each subject.
#![allow(non_snake_case, clippy::unwrap_used)]

mod covered;
mod discs;
mod ellipsoids;
mod manifolds;
mod pairs;
mod pieces;
mod probe;
mod refusals;
mod scenes;
mod support;
