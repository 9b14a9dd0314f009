//! Small dense systems within an aggregate: elimination, Cholesky's factor, substitution.

use crate::linear::V6;

/// Solves n equations in place, each row with its right side; the answer replaces the right sides.
pub(crate) fn eliminate_dense(a: &mut [f64], n: usize) {
    let wide = n + 1;
    for k in 0..n {
        let pivot = (k..n).max_by(|i, j| a[i * wide + k].abs().total_cmp(&a[j * wide + k].abs()));
        let pivot = pivot.unwrap_or(k);
        for c in 0..wide {
            a.swap(k * wide + c, pivot * wide + c);
        }
        let inverse = 1.0 / a[k * wide + k];
        for c in k..wide {
            a[k * wide + c] *= inverse;
        }
        for i in (0..n).filter(|i| *i != k) {
            let factor = a[i * wide + k];
            for c in k..wide {
                a[i * wide + c] -= factor * a[k * wide + c];
            }
        }
    }
}

/// What forward substitution works on: numbers, or spatial vectors.
pub(crate) trait Entry: Copy {
    /// `self − a b`.
    fn minus(self, a: f64, b: Self) -> Self;
    fn times(self, a: f64) -> Self;
}

impl Entry for f64 {
    #[inline(always)]
    fn minus(self, a: f64, b: Self) -> Self {
        self - a * b
    }
    #[inline(always)]
    fn times(self, a: f64) -> Self {
        self * a
    }
}

impl Entry for V6<f64> {
    #[inline(always)]
    fn minus(self, a: f64, b: Self) -> Self {
        b.scale_add(-a, self)
    }
    #[inline(always)]
    fn times(self, a: f64) -> Self {
        self.scaled(a)
    }
}

/// Lower Cholesky factor in place, its diagonal inverted; false if the matrix is not positive
/// definite.
pub(crate) fn cholesky(D: &mut [f64], stride: usize, n: usize) -> bool {
    for j in 0..n {
        for i in j..n {
            let mut sum = D[i * stride + j];
            for k in 0..j {
                sum -= D[i * stride + k] * D[j * stride + k];
            }
            if i == j {
                if !(sum > 0.0) {
                    return false;
                }
                D[j * stride + j] = 1.0 / sum.sqrt();
            } else {
                D[i * stride + j] = sum * D[j * stride + j];
            }
        }
    }
    true
}

/// x ← L⁻¹ x, which is also a row x* ← x* L⁻*.
pub(crate) fn substitute<T: Entry>(L: &[f64], stride: usize, x: &mut [T]) {
    for j in 0..x.len() {
        let mut sum = x[j];
        for k in 0..j {
            sum = sum.minus(L[j * stride + k], x[k]);
        }
        x[j] = sum.times(L[j * stride + j]);
    }
}
