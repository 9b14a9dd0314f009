//! Tests of the crate from outside: one program, with a module for each subject.
#![allow(clippy::disallowed_methods, clippy::unwrap_used)]

mod bad_input;
mod book;
mod campaign;
mod common;
mod entry;
mod fork;
mod ground;
mod inspect;
mod keeps;
mod live;
mod log_rows;
mod make;
mod replay;
mod requirements;
mod rovers;
mod run_time;
mod same_bits;
#[path = "../../../tests/common/splitmix.rs"]
mod splitmix;
mod tables;
mod telemetry;
mod terrain;
mod trust;
mod viewer;
mod wheel_test;
