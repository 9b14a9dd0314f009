//! Tests of the crate from outside: one program, with a module for each subject.
#![allow(non_snake_case, clippy::unwrap_used)]

mod bodies;
mod builder;
mod common;
mod connectors;
mod constraints;
mod contact;
mod damage;
mod files;
mod format;
mod fuzz;
mod groups;
mod idle;
mod imports;
mod joints;
mod load;
mod machine;
mod order;
mod refusals;
#[path = "../../../tests/common/splitmix.rs"]
mod splitmix;
mod stowed;
mod variants;
