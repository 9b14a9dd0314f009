//! House rules that a machine can check. Each check takes plain data and returns its findings.

pub mod docs;
pub mod layers;
pub mod manifest;
pub mod sources;
pub mod words;
