//! Coefficients, one file per method, each with its source. `tests/order_conditions.rs` checks the order conditions.
pub mod bogacki_shampine;
pub mod dormand_prince;
pub mod euler;
mod interpolation;
pub mod rk4;
pub mod rodas4p;
pub mod verner87;
