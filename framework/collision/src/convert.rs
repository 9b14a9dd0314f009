//! Between our vectors and parry's (glam): the only place where both are known.

use linkwork_multibody::spatial::{Mat3, Vec3};
use parry3d_f64::bounding_volume::Aabb;
use parry3d_f64::math::Vector;

/// To parry.
#[inline(always)]
pub(crate) fn to_parry(v: &Vec3) -> Vector {
    Vector::new(v.x, v.y, v.z)
}

/// From parry.
#[inline(always)]
pub(crate) fn from_parry(v: Vector) -> Vec3 {
    Vec3::new(v.x, v.y, v.z)
}

/// A box in space, for parry's trees.
pub(crate) fn bounds(lo: &Vec3, hi: &Vec3) -> Aabb {
    Aabb::new(to_parry(lo), to_parry(hi))
}

/// Component-wise absolute values.
pub(crate) fn magnitudes(m: &Mat3) -> Mat3 {
    m.map(f64::abs)
}
