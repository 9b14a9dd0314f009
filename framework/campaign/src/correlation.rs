//! Correlated draws: a correlation matrix as its lower Cholesky factor, `R = L Lᵀ`.
//!
//! Independent standard normal numbers z become `L z`, whose correlations are R. Each number is then mapped by the quantile function of its own
//! distribution (a Gaussian copula). For normal values, the correlations are exactly R; for other distributions, R is the correlation of the
//! underlying normal numbers. Sums are computed in a fixed order, so results are bit-identical on all machines.

/// A matrix is not a correlation matrix.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum CorrelationError {
    /// Not n × n.
    #[error(
        "the matrix has {rows} rows, and row {row} has {columns} entries, for {n} names\n  help: write one row and one column for each name"
    )]
    Shape {
        /// Number of names.
        n: usize,
        /// Number of rows.
        rows: usize,
        /// The first row with a wrong number of entries.
        row: usize,
        /// Its number of entries.
        columns: usize,
    },
    /// An invalid entry.
    #[error("entry ({row}, {column}) is {value}\n  help: {help}")]
    Entry {
        /// Row, from 1.
        row: usize,
        /// Column, from 1.
        column: usize,
        /// The value.
        value: f64,
        /// The rule that it violates.
        help: &'static str,
    },
    /// Not positive semi-definite.
    #[error(
        "the matrix is not positive semi-definite: given the names before it, name {row} would have the variance {variance:.3e}\n  help: no values can have these correlations; make the entries of row {row} smaller"
    )]
    Indefinite {
        /// Row, from 1.
        row: usize,
        /// Remaining variance of the name, of 1.
        variance: f64,
    },
}

/// Tolerance for entries that are written with twelve digits.
const ROUND: f64 = 1e-10;

/// Returns the lower factor of a correlation matrix, which may be singular. Cost: n³/6.
///
/// # Errors
/// [`CorrelationError`] with the first invalid entry.
pub fn factor(matrix: &[Vec<f64>], n: usize) -> Result<Vec<Vec<f64>>, CorrelationError> {
    let rows = matrix.len();
    if rows != n {
        let columns = matrix.first().map_or(0, Vec::len);
        return Err(CorrelationError::Shape { n, rows, row: 1, columns });
    }
    if let Some(k) = matrix.iter().position(|row| row.len() != n) {
        return Err(CorrelationError::Shape { n, rows, row: k + 1, columns: matrix[k].len() });
    }
    for (i, row) in matrix.iter().enumerate() {
        for (j, &value) in row.iter().enumerate() {
            let wrong = if i == j && value != 1.0 {
                Some("entries on the diagonal must be 1")
            } else if !(value.abs() <= 1.0) {
                Some("a correlation must be between -1 and 1")
            } else if value != matrix[j][i] {
                Some("the matrix must be symmetric: write the same number in both entries")
            } else {
                None
            };
            if let Some(help) = wrong {
                return Err(CorrelationError::Entry { row: i + 1, column: j + 1, value, help });
            }
        }
    }
    let mut l = vec![vec![0.0; n]; n];
    for i in 0..n {
        for j in 0..i {
            let rest = matrix[i][j] - dot(&l[i][..j], &l[j][..j]);
            if l[j][j] > 0.0 {
                l[i][j] = rest / l[j][j];
            } else if rest.abs() > ROUND.sqrt() {
                // Name j is a linear combination of the names before it, but name i is correlated with those names in a
                // way that contradicts its correlation with j.
                return Err(CorrelationError::Indefinite { row: i + 1, variance: -rest.abs() });
            }
        }
        let variance = matrix[i][i] - dot(&l[i][..i], &l[i][..i]);
        if variance < -ROUND {
            return Err(CorrelationError::Indefinite { row: i + 1, variance });
        }
        // A remaining variance at round-off level is zero: the name is a linear combination of the names before it.
        l[i][i] = if variance > ROUND { variance.sqrt() } else { 0.0 };
    }
    Ok(l)
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).fold(0.0, |sum, (x, y)| sum + x * y)
}

/// Computes L z.
pub fn correlated(l: &[Vec<f64>], z: &[f64]) -> Vec<f64> {
    l.iter().map(|row| dot(row, z)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn rows(matrix: &[&[f64]]) -> Vec<Vec<f64>> {
        matrix.iter().map(|r| r.to_vec()).collect()
    }

    #[test]
    fn the_factor_times_itself_is_the_matrix() {
        let full = rows(&[&[1.0, 0.6, -0.3], &[0.6, 1.0, 0.2], &[-0.3, 0.2, 1.0]]);
        let singular = rows(&[&[1.0, 1.0, 0.5], &[1.0, 1.0, 0.5], &[0.5, 0.5, 1.0]]);
        for m in [full, singular] {
            let l = factor(&m, 3).unwrap();
            for i in 0..3 {
                for j in 0..3 {
                    let product = dot(&l[i], &l[j]);
                    assert!((product - m[i][j]).abs() < 1e-14, "({i}, {j}): {product}");
                    assert!(j <= i || l[i][j] == 0.0);
                }
            }
        }
    }

    #[test]
    fn two_names_by_hand() {
        let l = factor(&rows(&[&[1.0, 0.6], &[0.6, 1.0]]), 2).unwrap();
        let y = correlated(&l, &[1.0, -2.0]);
        assert!((y[0] - 1.0).abs() < 1e-15 && (y[1] - (0.6 - 2.0 * 0.8)).abs() < 1e-15, "{y:?}");
    }

    #[test]
    fn what_is_no_matrix_of_correlations_is_refused() {
        let shape = factor(&rows(&[&[1.0, 0.5]]), 2).unwrap_err();
        assert!(matches!(shape, CorrelationError::Shape { n: 2, rows: 1, .. }), "{shape}");
        let ragged = factor(&rows(&[&[1.0, 0.5], &[0.5]]), 2).unwrap_err();
        assert!(matches!(ragged, CorrelationError::Shape { row: 2, columns: 1, .. }), "{ragged}");
        for (m, at) in [
            (rows(&[&[1.0, 0.5], &[0.4, 1.0]]), (1, 2)),
            (rows(&[&[1.0, 1.5], &[1.5, 1.0]]), (1, 2)),
            (rows(&[&[1.0, f64::NAN], &[f64::NAN, 1.0]]), (1, 2)),
            (rows(&[&[1.0, 0.0], &[0.0, 2.0]]), (2, 2)),
        ] {
            let e = factor(&m, 2).unwrap_err();
            let CorrelationError::Entry { row, column, .. } = e else { panic!("{e}") };
            assert_eq!((row, column), at);
        }
        // a nearly equals b, and b nearly equals c, but c is nearly the opposite of a.
        let m = rows(&[&[1.0, 0.9, -0.9], &[0.9, 1.0, 0.9], &[-0.9, 0.9, 1.0]]);
        let e = factor(&m, 3).unwrap_err();
        assert!(matches!(e, CorrelationError::Indefinite { row: 3, .. }), "{e}");
        // This contradiction is exact: the first parameter determines the second.
        let m = rows(&[&[1.0, 1.0, 0.5], &[1.0, 1.0, -0.5], &[0.5, -0.5, 1.0]]);
        let e = factor(&m, 3).unwrap_err();
        assert!(matches!(e, CorrelationError::Indefinite { row: 3, .. }), "{e}");
    }
}
