//! Texts, their values with positions, and formatting of faults.
pub(crate) mod files;
pub(crate) mod parse;
pub(crate) mod parsed;
pub(crate) mod patterns;
pub(crate) mod pieces;
pub(crate) mod print;
pub(crate) mod quick;
#[cfg(test)]
mod quick_tests;
pub(crate) mod report;
pub(crate) mod show;
pub(crate) mod value;
