//! Recorders: rows of chosen variables, their schedule, and their delivery to a consumer.
pub(crate) mod recorder;
pub(crate) mod rows;
pub(crate) mod schedule;
