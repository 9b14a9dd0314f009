//! Small dense systems within an aggregate: elimination, Cholesky factorization, substitution.

use crate::linear::V6;

/// Solves n equations in place, each row with its right-hand side; the solution replaces the right-hand sides.
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

/// Element type of forward substitution: numbers, or spatial vectors.
pub(crate) trait Entry: Copy {
    /// Returns `self − a b`.
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

/// Computes the lower Cholesky factor in place, with inverted diagonal; returns false if the matrix is not positive definite.
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

/// Computes x ← L⁻¹ x, which is also x* ← x* L⁻* for a row.
pub(crate) fn substitute<T: Entry>(L: &[f64], stride: usize, x: &mut [T]) {
    for j in 0..x.len() {
        let mut sum = x[j];
        for k in 0..j {
            sum = sum.minus(L[j * stride + k], x[k]);
        }
        x[j] = sum.times(L[j * stride + j]);
    }
}
