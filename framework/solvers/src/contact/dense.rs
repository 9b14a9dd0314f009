//! Small dense linear algebra with fixed loops, so that results are bit-identical on any processor: pseudo-inverse of up to four rows, LU with row
//! exchanges, Cholesky with pivots.

/// Pivots below this, relative to the largest diagonal entry, count as 0.
const RANK: f64 = 1e-12;

/// Computes the pseudo-inverse of the leading `rows` × `rows` block of a symmetric W, in columns of four, with Jacobi rotations. Eigenvalues below
/// 1e-12 of the largest count as 0.
pub(crate) fn pseudo_inverse(W: &[[f64; 4]; 4], rows: usize) -> [[f64; 4]; 4] {
    let (mut A, mut V) = (*W, [[0.0; 4]; 4]);
    for k in 0..4 {
        V[k][k] = 1.0;
    }
    for _ in 0..12 {
        for i in 0..rows {
            for j in i + 1..rows {
                rotate(&mut A, &mut V, i, j, rows);
            }
        }
    }
    let largest = (0..rows).fold(0.0f64, |m, k| m.max(A[k][k]));
    let mut out = [[0.0; 4]; 4];
    for k in (0..rows).filter(|&k| A[k][k] > RANK * largest) {
        for i in 0..rows {
            for j in 0..rows {
                out[i][j] += V[k][i] * V[k][j] / A[k][k];
            }
        }
    }
    out
}

/// Applies one Jacobi rotation that makes A_ij zero. Row k of V is the k-th eigenvector.
fn rotate(A: &mut [[f64; 4]; 4], V: &mut [[f64; 4]; 4], i: usize, j: usize, rows: usize) {
    if A[i][j] == 0.0 {
        return;
    }
    let theta = 0.5 * (A[j][j] - A[i][i]) / A[i][j];
    let t = theta.signum() / (theta.abs() + theta.hypot(1.0));
    let c = 1.0 / t.hypot(1.0);
    let s = t * c;
    for k in 0..rows {
        let (x, y) = (A[k][i], A[k][j]);
        (A[k][i], A[k][j]) = (c * x - s * y, s * x + c * y);
    }
    for k in 0..rows {
        let (x, y) = (A[i][k], A[j][k]);
        (A[i][k], A[j][k]) = (c * x - s * y, s * x + c * y);
        let (x, y) = (V[i][k], V[j][k]);
        (V[i][k], V[j][k]) = (c * x - s * y, s * x + c * y);
    }
    (A[i][j], A[j][i]) = (0.0, 0.0);
}

/// Solves A x = b in place, with A n × n row by row, overwritten. Returns false if A is singular to working precision. Exchanges rows. Skips zeros to
/// the right of a row's last entry and below a column's: 2/3 n³ operations for a full A, 2 n × band² for a banded one. `extent` is workspace, n
/// pairs.
pub(crate) fn solve_lu(A: &mut [f64], n: usize, x: &mut [f64], extent: &mut [[usize; 2]]) -> bool {
    if n == 0 {
        return true;
    }
    let extent = &mut extent[..n];
    extents(A, n, extent);
    for k in 0..n {
        // Only rows k + 1 .. low may have an entry in column k.
        let (low, mut p) = (extent[k][1].max(k + 1), k);
        for i in k + 1..low {
            if A[i * n + k].abs() > A[p * n + k].abs() {
                p = i;
            }
        }
        let pivot = A[p * n + k];
        if !(pivot.abs() > 1e-300) || !pivot.is_finite() {
            return false;
        }
        let widest = extent[k][0].max(extent[p][0]);
        if p != k {
            let (above, below) = A.split_at_mut(p * n);
            above[k * n + k..(k + 1) * n].swap_with_slice(&mut below[k..n]);
            x.swap(p, k);
            (extent[k][0], extent[p][0]) = (extent[p][0], extent[k][0]);
        }
        for e in &mut extent[k + 1..widest.max(k + 1)] {
            e[1] = e[1].max(low);
        }
        let (top, rest) = A.split_at_mut((k + 1) * n);
        let (end, xk) = (extent[k][0], x[k]);
        let row = &top[k * n + k + 1..k * n + end];
        for (i, other) in rest.chunks_exact_mut(n).take(low - k - 1).enumerate() {
            let f = other[k] / pivot;
            if f == 0.0 {
                continue;
            }
            for (a, b) in other[k + 1..end].iter_mut().zip(row) {
                *a = super::problem::fma(-f, *b, *a);
            }
            let at = k + 1 + i;
            extent[at][0] = extent[at][0].max(end);
            x[at] -= f * xk;
        }
    }
    for k in (0..n).rev() {
        let row = &A[k * n + k..k * n + extent[k][0]];
        let sum: f64 = row[1..].iter().zip(&x[k + 1..]).map(|(a, x)| a * x).sum();
        x[k] = (x[k] - sum) / row[0];
    }
    true
}

/// Computes, for each k, one past the last entry of row k, and one past the last entry of column k.
fn extents(A: &[f64], n: usize, extent: &mut [[usize; 2]]) {
    extent.fill([0, 0]);
    for (i, row) in A.chunks_exact(n.max(1)).enumerate() {
        for (j, a) in row.iter().enumerate() {
            if *a != 0.0 {
                extent[i][0] = j + 1;
                extent[j][1] = i + 1;
            }
        }
    }
}

/// Computes the pivoted Cholesky factor of a symmetric positive semidefinite A, n × n row by row, in its lower triangle, with rows in the order of
/// `order`. Returns the rank.
pub(crate) fn pivoted_cholesky(A: &mut [f64], n: usize, order: &mut [usize]) -> usize {
    for (k, o) in order.iter_mut().enumerate() {
        *o = k;
    }
    let largest = (0..n).fold(0.0f64, |m, k| m.max(A[k * n + k]));
    for k in 0..n {
        let mut p = k;
        for i in k + 1..n {
            if A[i * n + i] > A[p * n + p] {
                p = i;
            }
        }
        if !(A[p * n + p] > RANK * largest) {
            return k;
        }
        if p != k {
            order.swap(p, k);
            exchange(A, n, p, k);
        }
        let d = A[k * n + k].sqrt();
        A[k * n + k] = d;
        for i in k + 1..n {
            A[i * n + k] /= d;
        }
        for i in k + 1..n {
            let f = A[i * n + k];
            for j in k + 1..=i {
                A[i * n + j] -= f * A[j * n + k];
            }
        }
    }
    n
}

/// Exchanges rows and columns p > k. Columns before k are finished rows of the factor, and only the lower triangle is used.
fn exchange(A: &mut [f64], n: usize, p: usize, k: usize) {
    for j in 0..k {
        A.swap(p * n + j, k * n + j);
    }
    A.swap(p * n + p, k * n + k);
    for j in k + 1..p {
        A.swap(j * n + k, p * n + j);
    }
    for i in p + 1..n {
        A.swap(i * n + k, i * n + p);
    }
}

/// Solves L Lᵀ x = b in place for the leading `rank` rows of a factor of `pivoted_cholesky` with rows of n; x is in the order of the pivots.
pub(crate) fn solve_cholesky(L: &[f64], n: usize, rank: usize, x: &mut [f64]) {
    for i in 0..rank {
        let sum: f64 = L[i * n..i * n + i].iter().zip(&x[..i]).map(|(l, x)| l * x).sum();
        x[i] = (x[i] - sum) / L[i * n + i];
    }
    for i in (0..rank).rev() {
        let sum: f64 = (i + 1..rank).map(|j| L[j * n + i] * x[j]).sum();
        x[i] = (x[i] - sum) / L[i * n + i];
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn number(seed: &mut u64) -> f64 {
        *seed = seed.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        (*seed >> 11) as f64 / (1u64 << 52) as f64 - 1.0
    }

    /// Full, banded and scattered matrices with a diagonal that needs row exchanges.
    #[test]
    fn lu_solves_whatever_the_pattern() {
        let mut seed = 3;
        for k in 0..200 {
            let (n, density) = (k % 17, [1.0, 0.3, 0.15][k % 3]);
            let mut A = vec![0.0; n * n];
            for i in 0..n {
                for j in 0..n {
                    let near = k % 2 == 0 && i.abs_diff(j) <= 2;
                    if near || number(&mut seed).abs() < density {
                        A[i * n + j] = number(&mut seed);
                    }
                }
                A[i * n + (i + k) % n] += 3.0;
            }
            let x: Vec<f64> = (0..n).map(|_| number(&mut seed)).collect();
            let mut b: Vec<f64> =
                (0..n).map(|i| (0..n).map(|j| A[i * n + j] * x[j]).sum()).collect();
            if !solve_lu(&mut A, n, &mut b, &mut vec![[0; 2]; n]) {
                continue;
            }
            for (x, b) in x.iter().zip(&b) {
                // Measured: 4.2e-15.
                assert!((x - b).abs() < 1e-12, "{k}: {x} {b}");
            }
        }
        assert!(!solve_lu(&mut [1.0, 2.0, 2.0, 4.0], 2, &mut [1.0, 1.0], &mut [[0; 2]; 2]));
    }

    /// W W⁺ W = W, and W⁺ has the rank of W.
    #[test]
    fn pseudo_inverse_of_full_and_deficient_blocks() {
        let mut seed = 9;
        for k in 0..60 {
            let (rows, rank) = (1 + k % 4, 1 + k % 3);
            let mut W = [[0.0; 4]; 4];
            for _ in 0..rank {
                let e: Vec<f64> = (0..rows).map(|_| number(&mut seed)).collect();
                (0..rows).for_each(|i| (0..rows).for_each(|j| W[i][j] += e[i] * e[j]));
            }
            let P = pseudo_inverse(&W, rows);
            let product = |A: &[[f64; 4]; 4], B: &[[f64; 4]; 4]| {
                let mut C = [[0.0; 4]; 4];
                for i in 0..4 {
                    for j in 0..4 {
                        C[i][j] = (0..4).map(|l| A[i][l] * B[l][j]).sum();
                    }
                }
                C
            };
            let (again, size) = (product(&product(&W, &P), &W), W[0][0]);
            for (a, w) in again.iter().flatten().zip(W.iter().flatten()) {
                assert!((a - w).abs() < 1e-9, "{k} {a} {w} {size}");
            }
        }
    }

    #[test]
    fn pivoted_cholesky_finds_the_rank_and_solves() {
        let mut seed = 21;
        for k in 0..60 {
            let (n, rank) = (2 + k % 9, 1 + k % 5);
            let E: Vec<f64> = (0..n * rank).map(|_| number(&mut seed)).collect();
            let mut A = vec![0.0; n * n];
            for i in 0..n {
                for j in 0..n {
                    A[i * n + j] = (0..rank).map(|l| E[i * rank + l] * E[j * rank + l]).sum();
                }
            }
            let (W, mut order) = (A.clone(), vec![0; n]);
            let found = pivoted_cholesky(&mut A, n, &mut order);
            assert_eq!(found, rank.min(n), "{k}");
            let mut x: Vec<f64> = (0..found).map(|_| number(&mut seed)).collect();
            let b = x.clone();
            solve_cholesky(&A, n, found, &mut x);
            for i in 0..found {
                let sum: f64 = (0..found).map(|j| W[order[i] * n + order[j]] * x[j]).sum();
                assert!((sum - b[i]).abs() < 1e-6, "{k}: {sum} {}", b[i]);
            }
        }
    }
}
