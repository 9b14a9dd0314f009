//! Texts, the located values in them, and what is said about them.
pub(crate) mod files;
pub(crate) mod parse;
#[cfg(test)]
mod parse_tests;
pub(crate) mod parsed;
pub(crate) mod patterns;
pub(crate) mod print;
mod reader;
pub(crate) mod report;
pub(crate) mod scalar;
pub(crate) mod show;
pub(crate) mod value;
