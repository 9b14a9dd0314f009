//! Component library: mobility.
pub mod math;
pub mod quadrature;
pub mod rigid_contact;
pub mod soil;
pub mod soil_contact;
pub mod terramechanics;
pub mod wheel_geometry;
