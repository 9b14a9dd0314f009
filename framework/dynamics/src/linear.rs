//! Small vectors and matrices of lanes: three numbers, nine, and six for a symmetric matrix.

use crate::lane::Lane;
use std::ops::{Add, Neg, Sub};

/// A vector.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct V3<L> {
    pub x: L,
    pub y: L,
    pub z: L,
}

/// A matrix, stored by columns.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct M3<L> {
    pub x: V3<L>,
    pub y: V3<L>,
    pub z: V3<L>,
}

/// A symmetric matrix.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct S3<L> {
    pub xx: L,
    pub xy: L,
    pub xz: L,
    pub yy: L,
    pub yz: L,
    pub zz: L,
}

/// A spatial pair: angular part or moment, then linear part or force.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct V6<L> {
    pub n: V3<L>,
    pub f: V3<L>,
}

impl<L: Lane> V3<L> {
    #[inline(always)]
    pub fn new(x: L, y: L, z: L) -> Self {
        Self { x, y, z }
    }
    #[inline(always)]
    pub fn splat(v: &V3<f64>) -> Self {
        Self::new(L::splat(v.x), L::splat(v.y), L::splat(v.z))
    }
    #[inline(always)]
    pub fn read(s: &[L]) -> Self {
        Self::new(s[0], s[1], s[2])
    }
    #[inline(always)]
    pub fn write(self, s: &mut [L]) {
        s[0] = self.x;
        s[1] = self.y;
        s[2] = self.z;
    }
    #[inline(always)]
    pub fn dot(self, b: Self) -> L {
        self.x.fma(b.x, self.y.fma(b.y, self.z * b.z))
    }
    #[inline(always)]
    pub fn cross(self, b: Self) -> Self {
        Self::new(
            self.y.fms(b.z, self.z * b.y),
            self.z.fms(b.x, self.x * b.z),
            self.x.fms(b.y, self.y * b.x),
        )
    }
    /// `self × b + c`.
    #[inline(always)]
    pub fn cross_add(self, b: Self, c: Self) -> Self {
        Self::new(
            self.y.fma(b.z, self.z.fnma(b.y, c.x)),
            self.z.fma(b.x, self.x.fnma(b.z, c.y)),
            self.x.fma(b.y, self.y.fnma(b.x, c.z)),
        )
    }
    #[inline(always)]
    pub fn scale(self, s: L) -> Self {
        Self::new(self.x * s, self.y * s, self.z * s)
    }
    /// `self * s + b`.
    #[inline(always)]
    pub fn scale_add(self, s: L, b: Self) -> Self {
        Self::new(self.x.fma(s, b.x), self.y.fma(s, b.y), self.z.fma(s, b.z))
    }
    /// `b - self * s`.
    #[inline(always)]
    pub fn scale_sub(self, s: L, b: Self) -> Self {
        Self::new(self.x.fnma(s, b.x), self.y.fnma(s, b.y), self.z.fnma(s, b.z))
    }
    /// `Aᵀ v + b`.
    #[inline(always)]
    pub fn tmul_add(A: &M3<L>, v: Self, b: Self) -> Self {
        A.tmul(v) + b
    }
}

impl<L: Lane> Add for V3<L> {
    type Output = Self;
    #[inline(always)]
    fn add(self, b: Self) -> Self {
        Self::new(self.x + b.x, self.y + b.y, self.z + b.z)
    }
}

impl<L: Lane> Sub for V3<L> {
    type Output = Self;
    #[inline(always)]
    fn sub(self, b: Self) -> Self {
        Self::new(self.x - b.x, self.y - b.y, self.z - b.z)
    }
}

impl<L: Lane> Neg for V3<L> {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        Self::new(-self.x, -self.y, -self.z)
    }
}

impl<L: Lane> M3<L> {
    #[inline(always)]
    pub fn splat(m: &M3<f64>) -> Self {
        Self { x: V3::splat(&m.x), y: V3::splat(&m.y), z: V3::splat(&m.z) }
    }
    #[inline(always)]
    pub fn identity() -> Self {
        let (o, i) = (L::splat(0.0), L::splat(1.0));
        Self { x: V3::new(i, o, o), y: V3::new(o, i, o), z: V3::new(o, o, i) }
    }
    /// `self * v`.
    #[inline(always)]
    pub fn mul(&self, v: V3<L>) -> V3<L> {
        self.x.scale_add(v.x, self.y.scale_add(v.y, self.z.scale(v.z)))
    }
    /// `self * v + b`.
    #[inline(always)]
    pub fn mul_add(&self, v: V3<L>, b: V3<L>) -> V3<L> {
        self.x.scale_add(v.x, self.y.scale_add(v.y, self.z.scale_add(v.z, b)))
    }
    /// `selfᵀ * v`.
    #[inline(always)]
    pub fn tmul(&self, v: V3<L>) -> V3<L> {
        V3::new(self.x.dot(v), self.y.dot(v), self.z.dot(v))
    }
    /// `self * b`.
    #[inline(always)]
    pub fn mat(&self, b: &Self) -> Self {
        Self { x: self.mul(b.x), y: self.mul(b.y), z: self.mul(b.z) }
    }
    #[inline(always)]
    pub fn transpose(&self) -> Self {
        Self {
            x: V3::new(self.x.x, self.y.x, self.z.x),
            y: V3::new(self.x.y, self.y.y, self.z.y),
            z: V3::new(self.x.z, self.y.z, self.z.z),
        }
    }
    #[inline(always)]
    pub fn add(&self, b: &Self) -> Self {
        Self { x: self.x + b.x, y: self.y + b.y, z: self.z + b.z }
    }
    #[inline(always)]
    pub fn sub(&self, b: &Self) -> Self {
        Self { x: self.x - b.x, y: self.y - b.y, z: self.z - b.z }
    }
    /// The cross-product matrix `a~`.
    #[inline(always)]
    pub fn skew(a: V3<L>) -> Self {
        let o = L::splat(0.0);
        Self { x: V3::new(o, a.z, -a.y), y: V3::new(-a.z, o, a.x), z: V3::new(a.y, -a.x, o) }
    }
    /// Returns the rotation matrix of a quaternion [x y z w] of any length except zero.
    #[inline(always)]
    pub fn from_quat(q: &[L]) -> Self {
        let (x, y, z, w) = (q[0], q[1], q[2], q[3]);
        let one = L::splat(1.0);
        let s = L::splat(2.0) / x.fma(x, y.fma(y, z.fma(z, w * w)));
        let (sx, sy, sz) = (x * s, y * s, z * s);
        let (xx, xy, xz, yy, yz, zz) = (sx * x, sx * y, sx * z, sy * y, sy * z, sz * z);
        let (wx, wy, wz) = (sx * w, sy * w, sz * w);
        Self {
            x: V3::new(one - yy - zz, xy + wz, xz - wy),
            y: V3::new(xy - wz, one - xx - zz, yz + wx),
            z: V3::new(xz + wy, yz - wx, one - xx - yy),
        }
    }
}

impl<L: Lane> S3<L> {
    #[inline(always)]
    pub fn splat(m: &S3<f64>) -> Self {
        Self {
            xx: L::splat(m.xx),
            xy: L::splat(m.xy),
            xz: L::splat(m.xz),
            yy: L::splat(m.yy),
            yz: L::splat(m.yz),
            zz: L::splat(m.zz),
        }
    }
    #[inline(always)]
    pub fn diagonal(d: L) -> Self {
        let o = L::splat(0.0);
        Self { xx: d, xy: o, xz: o, yy: d, yz: o, zz: d }
    }
    #[inline(always)]
    pub fn mul(&self, v: V3<L>) -> V3<L> {
        V3::new(
            self.xx.fma(v.x, self.xy.fma(v.y, self.xz * v.z)),
            self.xy.fma(v.x, self.yy.fma(v.y, self.yz * v.z)),
            self.xz.fma(v.x, self.yz.fma(v.y, self.zz * v.z)),
        )
    }
    #[inline(always)]
    pub fn columns(&self) -> M3<L> {
        M3 {
            x: V3::new(self.xx, self.xy, self.xz),
            y: V3::new(self.xy, self.yy, self.yz),
            z: V3::new(self.xz, self.yz, self.zz),
        }
    }
    #[inline(always)]
    pub fn add(&self, b: &Self) -> Self {
        Self {
            xx: self.xx + b.xx,
            xy: self.xy + b.xy,
            xz: self.xz + b.xz,
            yy: self.yy + b.yy,
            yz: self.yz + b.yz,
            zz: self.zz + b.zz,
        }
    }
    /// `self − a bᵀ`, for a pair whose outer product is symmetric.
    #[inline(always)]
    pub fn sub_outer(&self, a: V3<L>, b: V3<L>) -> Self {
        Self {
            xx: a.x.fnma(b.x, self.xx),
            xy: a.x.fnma(b.y, self.xy),
            xz: a.x.fnma(b.z, self.xz),
            yy: a.y.fnma(b.y, self.yy),
            yz: a.y.fnma(b.z, self.yz),
            zz: a.z.fnma(b.z, self.zz),
        }
    }
    /// `self − A B` for matrices whose product is symmetric.
    #[inline(always)]
    pub fn sub_product(&self, A: &M3<L>, B: &M3<L>) -> Self {
        let (c, d, e) = (A.mul(B.x), A.mul(B.y), A.mul(B.z));
        Self {
            xx: self.xx - c.x,
            xy: self.xy - d.x,
            xz: self.xz - e.x,
            yy: self.yy - d.y,
            yz: self.yz - e.y,
            zz: self.zz - e.z,
        }
    }
    /// `self + a bᵀ + b aᵀ`.
    #[inline(always)]
    pub fn add_sym_outer(&self, a: V3<L>, b: V3<L>) -> Self {
        let b2 = b + b;
        Self {
            xx: a.x.fma(b2.x, self.xx),
            xy: a.x.fma(b.y, b.x.fma(a.y, self.xy)),
            xz: a.x.fma(b.z, b.x.fma(a.z, self.xz)),
            yy: a.y.fma(b2.y, self.yy),
            yz: a.y.fma(b.z, b.y.fma(a.z, self.yz)),
            zz: a.z.fma(b2.z, self.zz),
        }
    }
    /// `R self Rᵀ`.
    #[inline(always)]
    pub fn rotate(&self, R: &M3<L>) -> Self {
        let T = R.mat(&self.columns());
        let (a, b, c) = (T.x, T.y, T.z);
        // The product is (R S) Rᵀ = Σ_j T_j R_jᵀ.
        let (x, y, z) = (R.x, R.y, R.z);
        Self {
            xx: a.x.fma(x.x, b.x.fma(y.x, c.x * z.x)),
            xy: a.x.fma(x.y, b.x.fma(y.y, c.x * z.y)),
            xz: a.x.fma(x.z, b.x.fma(y.z, c.x * z.z)),
            yy: a.y.fma(x.y, b.y.fma(y.y, c.y * z.y)),
            yz: a.y.fma(x.z, b.y.fma(y.z, c.y * z.z)),
            zz: a.z.fma(x.z, b.z.fma(y.z, c.z * z.z)),
        }
    }
    /// Returns `R self Rᵀ` for a matrix whose xy entry is zero, with 15 fewer multiplications:
    /// ```text
    /// J_W = J_xx 1 + (J_yy − J_xx) y yᵀ + z uᵀ + u zᵀ,  u = J_xz x + J_yz y + ½ (J_zz − J_xx) z
    /// ```
    #[inline(always)]
    pub fn rotate_xy_free(&self, R: &M3<L>) -> Self {
        let half = L::splat(0.5) * (self.zz - self.xx);
        let u = R.x.scale_add(self.xz, R.y.scale_add(self.yz, R.z.scale(half)));
        let y = R.y.scale(self.xx - self.yy);
        S3::diagonal(self.xx).sub_outer(y, R.y).add_sym_outer(R.z, u)
    }
    /// Returns the inverse of a positive definite matrix, and whether the matrix is positive definite.
    #[inline(always)]
    pub fn inverse(&self) -> (Self, bool) {
        let cx = self.yy.fms(self.zz, self.yz * self.yz);
        let cy = self.xz.fms(self.yz, self.xy * self.zz);
        let cz = self.xy.fms(self.yz, self.xz * self.yy);
        let det = self.xx.fma(cx, self.xy.fma(cy, self.xz * cz));
        let minor = self.xx.fms(self.yy, self.xy * self.xy);
        let ok = self.xx.all_positive() && minor.all_positive() && det.all_positive();
        let d = L::splat(1.0) / det;
        let inverse = Self {
            xx: cx * d,
            xy: cy * d,
            xz: cz * d,
            yy: self.xx.fms(self.zz, self.xz * self.xz) * d,
            yz: self.xz.fms(self.xy, self.xx * self.yz) * d,
            zz: minor * d,
        };
        (inverse, ok)
    }
}

impl<L: Lane> V6<L> {
    /// Applies φ*: the motion at a point displaced by `l`.
    #[inline(always)]
    pub fn to_child(self, l: V3<L>) -> Self {
        Self { n: self.n, f: self.n.cross_add(l, self.f) }
    }
    /// Applies φ: the force about a point from which the present point lies at `l`.
    #[inline(always)]
    pub fn to_parent(self, l: V3<L>) -> Self {
        Self { n: l.cross_add(self.f, self.n), f: self.f }
    }
}

impl<L: Lane> Add for V6<L> {
    type Output = Self;
    #[inline(always)]
    fn add(self, b: Self) -> Self {
        Self { n: self.n + b.n, f: self.f + b.f }
    }
}
