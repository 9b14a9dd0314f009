//! What the command line does, as functions: loading, running with taps, inspecting, comparing.
use std::fmt::Arguments;
use std::io::Write;

/// Prints a line to standard output; ends in silence when the reader has gone (`linkwork list | head`).
macro_rules! say {
    ($($t:tt)*) => { $crate::say_text(format_args!("{}\n", format_args!($($t)*))) };
}

/// Prints text to standard output, as [`say!`].
pub(crate) fn say_text(text: Arguments<'_>) {
    if std::io::stdout().write_fmt(text).is_err() {
        std::process::exit(i32::from(exit::OK));
    }
}

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
