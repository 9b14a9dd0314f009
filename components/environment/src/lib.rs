//! Component library: environment.
pub mod math;
