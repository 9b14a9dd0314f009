//! Checkpoints: in memory for forks and rejected steps, in a file for a later process.
pub(crate) mod file;
pub(crate) mod state;
