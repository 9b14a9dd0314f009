//! What the command line does, as functions: loading, running with taps, inspecting, comparing.
//!
//! The run itself is `linkwork_runner`; this crate gives it options, files, a progress bar and
//! words. [`program::Program`] is all of it over a library of models.
#[macro_use]
pub mod voice;

pub mod attach;
mod behaviour;
pub mod campaign;
pub mod check;
pub mod diff;
pub mod doctor;
pub mod export;
pub mod fork;
pub mod graph;
pub mod inspect;
pub mod load;
pub mod make;
pub mod options;
pub mod pages;
pub mod picture;
mod profile;
pub mod program;
pub mod replay;
pub mod run;
pub mod scene;
pub mod summary;
mod taps;
pub mod view;
pub mod wheel_test;

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
