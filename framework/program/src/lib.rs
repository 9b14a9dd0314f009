//! The command line for a model library. [`Program`] contains the name of the program, its models and its additional commands. The functions of this
//! crate implement the commands: loading, running with recorders, inspecting, comparing.
//!
//! `linkwork_runner` executes the runs; this crate adds options, files, a progress bar and messages. It does not contain models: `sims/cli` builds the
//! program `linkwork` from it, and your own model library builds its program in the same way.
#[macro_use]
pub mod voice;

mod attach;
mod begin;
mod behaviour;
mod campaign;
mod check;
mod compare_runs;
mod diff;
mod doctor;
mod edge;
mod export;
mod fork;
mod graph;
mod inspect;
mod load;
mod make;
mod options;
mod pages;
mod picture;
mod profile;
mod program;
mod recorders;
mod replay;
mod run;
mod scene;
mod strands;
mod summary;
#[cfg(feature = "viewer")]
mod telemetry;
mod view;

/// For the arguments of a [`Tool`].
pub use clap;
pub use program::{Program, Tool};

/// Exit codes.
pub mod exit {
    /// All is well.
    pub const OK: u8 = 0;
    /// The run failed, a file could not be written, or two files differ.
    pub const FAILED: u8 = 1;
    /// The input is wrong; no file was written.
    pub const INPUT: u8 = 2;
    /// Stopped by Ctrl-C, with a checkpoint.
    pub const STOPPED: u8 = 130;
}
