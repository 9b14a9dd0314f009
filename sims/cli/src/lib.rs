//! What the command line does, as functions: loading, running with taps, inspecting, comparing.
pub mod check;
pub mod diff;
pub mod figures;
pub mod inspect;
pub mod load;
pub mod run;
pub mod scene;
pub mod summary;

/// Exit codes.
pub mod exit {
    /// All is well.
    pub const OK: u8 = 0;
    /// The run failed, or two files differ.
    pub const FAILED: u8 = 1;
    /// The input is wrong: nothing was written.
    pub const INPUT: u8 = 2;
    /// Stopped by Ctrl-C, with a checkpoint.
    pub const STOPPED: u8 = 130;
}
