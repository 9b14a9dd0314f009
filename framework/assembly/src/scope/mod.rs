//! Parameters: their values in a scope, and arithmetic with them.
mod expression;
pub(crate) mod parameters;
