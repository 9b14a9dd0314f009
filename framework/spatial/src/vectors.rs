//! Motion and force vectors, and the shift operators φ and φ* on them.

use crate::{Quat, Vec3};
use serde::{Deserialize, Serialize};
use std::ops::{Add, AddAssign, Mul, Neg, Sub, SubAssign};

/// A spatial motion vector: velocity (rad/s, m/s) or acceleration (rad/s², m/s²) of a frame.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Motion {
    /// Angular part, rad/s or rad/s².
    pub angular: Vec3,
    /// Linear part: of the frame's origin, m/s or m/s².
    pub linear: Vec3,
}

/// A spatial force vector: a wrench (N m, N) or a momentum (kg m²/s, kg m/s) about a point.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Force {
    /// Moment about the reference point, N m (angular momentum, kg m²/s).
    pub moment: Vec3,
    /// Force, N (linear momentum, kg m/s).
    pub force: Vec3,
}

impl Motion {
    /// Returns a motion from its parts, both in the same axes.
    #[inline(always)]
    #[must_use]
    pub fn new(angular: Vec3, linear: Vec3) -> Self {
        Self { angular, linear }
    }

    /// Returns zero motion.
    #[must_use]
    pub fn zero() -> Self {
        Self::default()
    }

    /// Computes φ*(p,k) V: the same rigid motion at a point displaced by `l` (same axes, m).
    #[inline(always)]
    #[must_use]
    pub fn shift_to_child(&self, l: &Vec3) -> Self {
        Self { angular: self.angular, linear: self.linear + self.angular.cross(l) }
    }

    /// Rotates both parts by `R_AB`: coordinates in B to coordinates in A.
    #[inline(always)]
    #[must_use]
    pub fn rotate(&self, R_AB: &Quat) -> Self {
        Self { angular: R_AB * self.angular, linear: R_AB * self.linear }
    }

    /// Returns the power of a force at this velocity, W; both about the same point and in the same axes.
    #[inline(always)]
    #[must_use]
    pub fn dot(&self, f: &Force) -> f64 {
        self.angular.dot(&f.moment) + self.linear.dot(&f.force)
    }
}

impl Force {
    /// Returns a force from its parts, both in the same axes.
    #[inline(always)]
    #[must_use]
    pub fn new(moment: Vec3, force: Vec3) -> Self {
        Self { moment, force }
    }

    /// Returns zero force.
    #[must_use]
    pub fn zero() -> Self {
        Self::default()
    }

    /// Computes φ(p,k) f: the same wrench about the parent's origin, with `l` (m, same axes) from parent to child.
    #[inline(always)]
    #[must_use]
    pub fn shift_to_parent(&self, l: &Vec3) -> Self {
        Self { moment: self.moment + l.cross(&self.force), force: self.force }
    }

    /// Rotates both parts by `R_AB`: coordinates in B to coordinates in A.
    #[inline(always)]
    #[must_use]
    pub fn rotate(&self, R_AB: &Quat) -> Self {
        Self { moment: R_AB * self.moment, force: R_AB * self.force }
    }
}

macro_rules! pairwise {
    ($T:ident, $a:ident, $b:ident) => {
        impl Add for $T {
            type Output = Self;
            #[inline(always)]
            fn add(self, o: Self) -> Self {
                Self { $a: self.$a + o.$a, $b: self.$b + o.$b }
            }
        }
        impl Sub for $T {
            type Output = Self;
            #[inline(always)]
            fn sub(self, o: Self) -> Self {
                Self { $a: self.$a - o.$a, $b: self.$b - o.$b }
            }
        }
        impl Neg for $T {
            type Output = Self;
            #[inline(always)]
            fn neg(self) -> Self {
                Self { $a: -self.$a, $b: -self.$b }
            }
        }
        impl Mul<f64> for $T {
            type Output = Self;
            #[inline(always)]
            fn mul(self, s: f64) -> Self {
                Self { $a: self.$a * s, $b: self.$b * s }
            }
        }
        impl AddAssign for $T {
            #[inline(always)]
            fn add_assign(&mut self, o: Self) {
                *self = *self + o;
            }
        }
        impl SubAssign for $T {
            #[inline(always)]
            fn sub_assign(&mut self, o: Self) {
                *self = *self - o;
            }
        }
    };
}
pairwise!(Motion, angular, linear);
pairwise!(Force, moment, force);
