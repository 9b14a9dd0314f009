//! Scalar type of the kernels: one state (`f64`) or a structure-of-arrays batch (`f64x4`, `f64x8`).

use std::ops::{Add, Div, Mul, Neg, Sub};
use wide::{f64x4, f64x8};

/// One number, or several in SIMD lanes.
pub trait Lane:
    Copy
    + Default
    + std::fmt::Debug
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Div<Output = Self>
    + Neg<Output = Self>
    + Send
    + Sync
    + 'static
{
    /// Number of states in one value.
    const WIDTH: usize;
    /// Returns a value with the same number in every lane.
    fn splat(x: f64) -> Self;
    /// Returns `self * a + b`, fused if the target supports it.
    fn fma(self, a: Self, b: Self) -> Self;
    /// Returns `self * a - b`, fused if the target supports it.
    fn fms(self, a: Self, b: Self) -> Self;
    /// Returns `b - self * a`, fused if the target supports it.
    fn fnma(self, a: Self, b: Self) -> Self;
    /// Returns the value with the number `x(i)` for state `i`.
    fn gather(x: impl Fn(usize) -> f64) -> Self;
    /// Returns the number of state `i`.
    fn state(&self, i: usize) -> f64;
    /// Returns sine and cosine; argument in rad.
    fn sin_cos(self) -> (Self, Self);
    /// Returns true when every lane is above zero (and therefore not NaN).
    fn all_positive(self) -> bool;

    /// [`Lane::PACK`] numbers of one row of a matrix, on which one instruction operates.
    type Block: Lane;
    /// Number of numbers in a block: four for `f64`, one where a value already holds several states.
    const PACK: usize;
    /// Returns a block with the same number everywhere.
    fn block(self) -> Self::Block;
    /// Returns number `i` of a block.
    fn get(block: &Self::Block, i: usize) -> Self;
    /// Writes number `i` of a block.
    fn set(block: &mut Self::Block, i: usize, x: Self);
    /// Loads the first [`Lane::PACK`] numbers of a slice.
    fn load(from: &[Self]) -> Self::Block;
    /// Writes a block to the first [`Lane::PACK`] entries of a slice.
    fn store(block: Self::Block, to: &mut [Self]);
    /// Returns a block of `x(0)`, `x(1)`, ….
    fn collect(x: impl Fn(usize) -> Self) -> Self::Block;
    /// Returns the constants of a block of columns that starts at column `at`, from those of four columns.
    fn constants(from: &[f64; 4], at: usize) -> Self::Block;
    /// Returns a block with one at the position of column `i`, zero elsewhere.
    #[inline(always)]
    fn unit(i: usize) -> Self::Block {
        const UNITS: [[f64; 4]; 4] = [
            [1.0, 0.0, 0.0, 0.0],
            [0.0, 1.0, 0.0, 0.0],
            [0.0, 0.0, 1.0, 0.0],
            [0.0, 0.0, 0.0, 1.0],
        ];
        if Self::PACK == 1 { Self::splat(1.0).block() } else { Self::constants(&UNITS[i % 4], 0) }
    }
    /// Copies the upper triangle of an n × n matrix onto the lower one.
    fn mirror(n: usize, a: &mut [Self]);
}

/// Performs [`Lane::mirror`] entry by entry, for the rows from `start` on.
#[inline(always)]
fn mirror_rows<T: Copy>(n: usize, start: usize, a: &mut [T]) {
    for i in start..n {
        for j in 0..i {
            a[i * n + j] = a[j * n + i];
        }
    }
}

impl Lane for f64 {
    const WIDTH: usize = 1;
    #[inline(always)]
    fn splat(x: f64) -> Self {
        x
    }
    #[inline(always)]
    fn fma(self, a: Self, b: Self) -> Self {
        if cfg!(target_feature = "fma") { self.mul_add(a, b) } else { self * a + b }
    }
    #[inline(always)]
    fn fms(self, a: Self, b: Self) -> Self {
        if cfg!(target_feature = "fma") { self.mul_add(a, -b) } else { self * a - b }
    }
    #[inline(always)]
    fn fnma(self, a: Self, b: Self) -> Self {
        if cfg!(target_feature = "fma") { (-self).mul_add(a, b) } else { b - self * a }
    }
    #[inline(always)]
    fn gather(x: impl Fn(usize) -> f64) -> Self {
        x(0)
    }
    #[inline(always)]
    fn state(&self, _: usize) -> f64 {
        *self
    }
    #[inline(always)]
    fn sin_cos(self) -> (Self, Self) {
        // The comparison is false for NaN.
        if self.abs() < REDUCIBLE { sin_cos_reduced(self) } else { f64::sin_cos(self) }
    }
    #[inline(always)]
    fn all_positive(self) -> bool {
        self > 0.0
    }

    type Block = f64x4;
    const PACK: usize = 4;
    #[inline(always)]
    fn block(self) -> f64x4 {
        f64x4::splat(self)
    }
    #[inline(always)]
    fn get(block: &f64x4, i: usize) -> f64 {
        block.as_array()[i]
    }
    #[inline(always)]
    fn set(block: &mut f64x4, i: usize, x: f64) {
        block.as_mut_array()[i] = x;
    }
    #[inline(always)]
    fn load(from: &[f64]) -> f64x4 {
        f64x4::new([from[0], from[1], from[2], from[3]])
    }
    #[inline(always)]
    fn store(block: f64x4, to: &mut [f64]) {
        to[..4].copy_from_slice(block.as_array());
    }
    #[inline(always)]
    fn collect(x: impl Fn(usize) -> f64) -> f64x4 {
        f64x4::new([x(0), x(1), x(2), x(3)])
    }
    #[inline(always)]
    fn constants(from: &[f64; 4], _: usize) -> f64x4 {
        f64x4::new(*from)
    }
    /// Processes tiles of four by four.
    #[inline]
    fn mirror(n: usize, a: &mut [f64]) {
        let whole = n - n % 4;
        for i in (0..whole).step_by(4) {
            for j in (0..i).step_by(4) {
                let row = |k: usize| Self::load(&a[(j + k) * n + i..]);
                let tile = f64x4::transpose([row(0), row(1), row(2), row(3)]);
                for (k, t) in tile.into_iter().enumerate() {
                    Self::store(t, &mut a[(i + k) * n + j..]);
                }
            }
            for k in 1..4 {
                for j in 0..k {
                    a[(i + k) * n + i + j] = a[(i + j) * n + i + k];
                }
            }
        }
        mirror_rows(n, whole, a);
    }
}

macro_rules! wide_lane {
    ($T:ident, $n:literal) => {
        impl Lane for $T {
            const WIDTH: usize = $n;
            #[inline(always)]
            fn splat(x: f64) -> Self {
                $T::splat(x)
            }
            #[inline(always)]
            fn fma(self, a: Self, b: Self) -> Self {
                self.mul_add(a, b)
            }
            #[inline(always)]
            fn fms(self, a: Self, b: Self) -> Self {
                self.mul_sub(a, b)
            }
            #[inline(always)]
            fn fnma(self, a: Self, b: Self) -> Self {
                self.mul_neg_add(a, b)
            }
            #[inline(always)]
            fn gather(x: impl Fn(usize) -> f64) -> Self {
                $T::new(std::array::from_fn(x))
            }
            #[inline(always)]
            fn state(&self, i: usize) -> f64 {
                self.as_array()[i]
            }
            #[inline(always)]
            fn sin_cos(self) -> (Self, Self) {
                if self.as_array().iter().all(|x| x.abs() < REDUCIBLE) {
                    return sin_cos_reduced(self);
                }
                let (mut s, mut c) = (self.to_array(), self.to_array());
                for (s, c) in s.iter_mut().zip(&mut c) {
                    (*s, *c) = Lane::sin_cos(*s);
                }
                ($T::new(s), $T::new(c))
            }
            #[inline(always)]
            fn all_positive(self) -> bool {
                self.to_array().iter().all(|x| *x > 0.0)
            }

            type Block = $T;
            const PACK: usize = 1;
            #[inline(always)]
            fn block(self) -> $T {
                self
            }
            #[inline(always)]
            fn get(block: &$T, _: usize) -> $T {
                *block
            }
            #[inline(always)]
            fn set(block: &mut $T, _: usize, x: $T) {
                *block = x;
            }
            #[inline(always)]
            fn load(from: &[$T]) -> $T {
                from[0]
            }
            #[inline(always)]
            fn store(block: $T, to: &mut [$T]) {
                to[0] = block;
            }
            #[inline(always)]
            fn collect(x: impl Fn(usize) -> $T) -> $T {
                x(0)
            }
            #[inline(always)]
            fn constants(from: &[f64; 4], at: usize) -> $T {
                $T::splat(from[at % 4])
            }
            #[inline]
            fn mirror(n: usize, a: &mut [$T]) {
                mirror_rows(n, 1, a);
            }
        }
    };
}
wide_lane!(f64x4, 4);
wide_lane!(f64x8, 8);

/// Above this value the reduction below loses accuracy, and the standard library is used, rad.
const REDUCIBLE: f64 = 1e5;

/// Computes sine and cosine for |x| < [`REDUCIBLE`] with arithmetic only, so that every lane has the same bits as a single number. The test states
/// the largest difference from the standard library. Reduction by π/2 in three parts (Cody and Waite), then the minimax polynomials of fdlibm (Sun,
/// 1993) on ±π/4.
#[inline(always)]
fn sin_cos_reduced<L: Lane>(x: L) -> (L, L) {
    // Adding 1.5·2⁵² rounds to an integer.
    let magic = L::splat(6_755_399_441_055_744.0);
    let c = L::splat;
    let n = x * c(std::f64::consts::FRAC_2_PI) + magic - magic;
    let y = n.fnma(c(1.570_796_326_734_125_6), x);
    let y = n.fnma(c(6.077_100_506_303_966e-11), y);
    let y = n.fnma(c(2.022_266_248_795_950_6e-21), y);
    let z = y * y;
    let s = z.fma(c(1.589_690_995_211_55e-10), c(-2.505_076_025_340_686_3e-8));
    let s = z.fma(s, c(2.755_731_370_707_006_8e-6));
    let s = z.fma(s, c(-1.984_126_982_985_795e-4));
    let s = z.fma(s, c(8.333_333_333_322_49e-3));
    let s = z.fma(s, c(-1.666_666_666_666_663_2e-1));
    let s = (y * z).fma(s, y);
    let k = z.fma(c(-1.135_964_755_778_819_5e-11), c(2.087_572_321_298_175e-9));
    let k = z.fma(k, c(-2.755_731_435_139_066_3e-7));
    let k = z.fma(k, c(2.480_158_728_947_673e-5));
    let k = z.fma(k, c(-1.388_888_888_887_411e-3));
    let k = z.fma(k, c(4.166_666_666_666_66e-2));
    let k = (z * z).fma(k, z.fnma(c(0.5), c(1.0)));
    // The quarter turns modulo four are in {−2 … 2}: sin = a s + b cos, cos = a cos − b s, where a is 1 at 0 and −1 at
    // ±2, b is ±1 at ±1, and the products are exact.
    let r = (n * c(0.25) + magic - magic).fnma(c(4.0), n);
    let w = r * r;
    let odd = w.fnma(w, w * c(4.0)) * c(1.0 / 3.0);
    let a = w.fnma(c(0.5), c(1.0)) * (c(1.0) - odd);
    let b = r * odd;
    (a.fma(s, b * k), a.fms(k, b * s))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sine_and_cosine_match_the_standard_library() {
        let mut worst = 0.0_f64;
        for i in -200_000..200_000 {
            let x = f64::from(i) * 0.123_456_789e-1 + f64::from(i % 7) * 1e-9;
            let (s, c) = Lane::sin_cos(x);
            let e = (s - x.sin()).abs().max((c - x.cos()).abs());
            assert!(e.is_finite());
            worst = worst.max(e);
        }
        // The measured value is 2.2e-16.
        assert!(worst < 4e-16, "{worst:e}");
        for x in [1e5, -3e7, 1e300] {
            assert_eq!(Lane::sin_cos(x), x.sin_cos());
        }
        assert!(Lane::sin_cos(f64::NAN).0.is_nan());
        assert_eq!(Lane::sin_cos(0.0), (0.0, 1.0));
    }

    #[test]
    fn wide_lanes_have_the_bits_of_one_number() {
        for i in 0..1000 {
            let x = f64::from(i) * 0.037 - 18.0;
            let (s, c) = Lane::sin_cos(f64x4::new([x, -x, 3.0 * x, x + 1e5 * f64::from(i / 900)]));
            for (l, x) in [x, -x, 3.0 * x, x + 1e5 * f64::from(i / 900)].into_iter().enumerate() {
                assert_eq!((s.to_array()[l], c.to_array()[l]), Lane::sin_cos(x), "{x}");
            }
        }
        assert!(Lane::sin_cos(f64x4::splat(f64::NAN)).0.to_array()[2].is_nan());
    }
}
