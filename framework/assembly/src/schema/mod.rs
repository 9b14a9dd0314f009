//! Typed values out of located ones.
pub(crate) mod pose;
pub(crate) mod read;
