//! A command line over a library of models: [`Program`] is its name, its models and tools of its own; what the commands
//! do stands here as functions: loading, running with recorders, inspecting, comparing.
//!
//! The run itself is `linkwork_runner`; this crate gives it options, files, a progress bar and words. It knows no models:
//! `linkwork` is made of it in `sims/cli`, and the program of a library of one's own in the same way.
#[macro_use]
pub mod voice;

mod attach;
mod begin;
mod behaviour;
mod campaign;
mod check;
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
    /// The run failed, something could not be written, or two files differ.
    pub const FAILED: u8 = 1;
    /// The input is wrong: nothing was written.
    pub const INPUT: u8 = 2;
    /// Stopped by Ctrl-C, with a checkpoint.
    pub const STOPPED: u8 = 130;
}
