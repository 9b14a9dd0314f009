//! The two mathematical types of this crate.

/// A vector of three components.
pub type Vec3 = nalgebra::Vector3<f64>;
/// A rotation.
pub type Quat = nalgebra::UnitQuaternion<f64>;
