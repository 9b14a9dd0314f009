//! Component library: environment.
pub mod air;
pub mod dem;
pub mod generator;
pub mod height_field;
pub mod mars_sun;
pub mod random;
