//! Tests of the public interface: one program, with a module for each subject.
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
