//! Parameters: their values in force, and arithmetic with them.
mod expression;
pub(crate) mod parameters;
