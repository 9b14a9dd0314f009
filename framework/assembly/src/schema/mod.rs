//! Records of the file format and their typed values: each kind of value is read, written and described in one place.
pub(crate) mod describe;
pub(crate) mod kind;
pub(crate) mod pose;
pub(crate) mod read;
pub(crate) mod record;

pub use describe::{Field, Parameters, Schema, document, plain};
