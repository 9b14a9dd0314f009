//! Coefficients, one file for each method, each with its source; held by the order conditions in `tests/order_conditions.rs`.
pub mod bogacki_shampine;
pub mod dormand_prince;
pub mod euler;
mod interpolation;
pub mod rk4;
pub mod rodas4p;
pub mod verner87;
