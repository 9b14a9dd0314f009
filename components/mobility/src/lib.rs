//! Component library: mobility.
pub mod math;
pub mod quadrature;
pub mod soil;
pub mod terramechanics;
pub mod wheel_geometry;
