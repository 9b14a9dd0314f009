//! Small dense eigenvalue problems at set-up: K x = ω² M x for the lowest ω; Gauss points.

use linkwork_spatial::nalgebra::{Cholesky, DMatrix, DVector, SymmetricEigen};

/// Returns the lowest `count` solutions of K x = ω² M x in increasing order, with x of unit modal mass: (ω², x). Solves M x = λ (K + σ M) x, so that
/// the lowest ones are the most accurate and K may be singular. `None` if K + σ M has no Cholesky factor, or fewer solutions exist.
pub(super) fn lowest(
    K: &DMatrix<f64>,
    M: &DMatrix<f64>,
    sigma: f64,
    count: usize,
) -> Option<Vec<(f64, DVector<f64>)>> {
    let L = Cholesky::new(K + M * sigma)?.l();
    let half = L.solve_lower_triangular(M)?;
    let A = L.solve_lower_triangular(&half.transpose())?;
    let eigen = SymmetricEigen::new((&A + A.transpose()) * 0.5);
    let mut order: Vec<usize> = (0..eigen.eigenvalues.len()).collect();
    order.sort_by(|a, b| eigen.eigenvalues[*b].total_cmp(&eigen.eigenvalues[*a]));
    let found: Option<Vec<_>> = order
        .into_iter()
        .take(count)
        .map(|i| {
            let lambda = eigen.eigenvalues[i];
            let x = L.tr_solve_lower_triangular(&eigen.eigenvectors.column(i).into_owned())?;
            (lambda > 0.0).then(|| (1.0 / lambda - sigma, x / lambda.sqrt()))
        })
        .collect();
    found.filter(|f| f.len() == count)
}

/// Returns the smallest eigenvalue of a symmetric matrix (row by row) and its eigenvector; `None` for 0 × 0.
pub(super) fn least(A: &[f64], n: usize) -> Option<(f64, DVector<f64>)> {
    if n == 0 {
        return None;
    }
    let eigen = SymmetricEigen::new(DMatrix::from_row_slice(n, n, A));
    let i = (0..n).min_by(|a, b| eigen.eigenvalues[*a].total_cmp(&eigen.eigenvalues[*b]))?;
    Some((eigen.eigenvalues[i], eigen.eigenvectors.column(i).into_owned()))
}

/// Returns Gauss–Legendre points and weights on 0 … 1, exact for polynomials of degree 2n − 1. Newton's method finds the roots of P_n from cos π(i −
/// ¼)/(n + ½).
pub(super) fn gauss(n: usize) -> Vec<(f64, f64)> {
    (1..=n)
        .map(|i| {
            let mut x = -(std::f64::consts::PI * (i as f64 - 0.25) / (n as f64 + 0.5)).cos();
            let mut slope = 1.0;
            for _ in 0..20 {
                let (p, below) = legendre(n, x);
                slope = n as f64 * (x * p - below) / (x * x - 1.0);
                x -= p / slope;
            }
            (0.5 * (1.0 + x), 1.0 / ((1.0 - x * x) * slope * slope))
        })
        .collect()
}

/// Returns P_n and P_{n−1} at x.
fn legendre(n: usize, x: f64) -> (f64, f64) {
    let (mut below, mut p) = (0.0, 1.0);
    for k in 0..n {
        let k = k as f64;
        (below, p) = (p, ((2.0 * k + 1.0) * x * p - k * below) / (k + 1.0));
    }
    (p, below)
}

#[cfg(test)]
mod tests {
    use super::gauss;

    #[test]
    fn gauss_points_integrate_polynomials() {
        for n in [1, 2, 5, 16, 31] {
            for degree in [0, 1, 2 * n - 1] {
                let sum: f64 = gauss(n).iter().map(|(x, w)| w * x.powi(degree as i32)).sum();
                let want = 1.0 / (degree as f64 + 1.0);
                assert!((sum - want).abs() < 1e-14, "{n} points, degree {degree}: {sum}");
            }
        }
        // Two points do not integrate degree 2n exactly.
        let sum: f64 = gauss(2).iter().map(|(x, w)| w * x.powi(4)).sum();
        assert!((sum - 0.2).abs() > 1e-3);
    }
}
