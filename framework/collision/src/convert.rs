//! Conversion between our vectors and parry's (glam). Only this file uses both.

use linkwork_multibody::spatial::{Mat3, Vec3};
use parry3d_f64::bounding_volume::Aabb;
use parry3d_f64::math::Vector;

/// Converts to parry.
#[inline(always)]
pub(crate) fn to_parry(v: &Vec3) -> Vector {
    Vector::new(v.x, v.y, v.z)
}

/// Converts from parry.
#[inline(always)]
pub(crate) fn from_parry(v: Vector) -> Vec3 {
    Vec3::new(v.x, v.y, v.z)
}

/// Returns an axis-aligned box for parry's trees.
pub(crate) fn bounds(lo: &Vec3, hi: &Vec3) -> Aabb {
    Aabb::new(to_parry(lo), to_parry(hi))
}

/// Returns component-wise absolute values.
pub(crate) fn magnitudes(m: &Mat3) -> Mat3 {
    m.map(f64::abs)
}
