//! Spatial algebra: motion, force, phi, rotation, rigid and articulated inertia.
pub use nalgebra;
/// A vector in three dimensions.
pub type Vec3 = nalgebra::Vector3<f64>;
/// A unit quaternion.
pub type Quat = nalgebra::UnitQuaternion<f64>;
