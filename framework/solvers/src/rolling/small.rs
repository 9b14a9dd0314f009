//! Small symmetric systems in preallocated memory.

/// A symmetric positive matrix, A = C Cᵀ.
#[derive(Clone, Debug)]
pub struct Symmetric {
    n: usize,
    factor: Vec<f64>,
}

/// Added to the diagonal, relative to its mean, so that undetermined unknowns stay unchanged.
const LEAST: f64 = 1e-13;

impl Symmetric {
    /// Allocates an n × n matrix.
    pub fn new(n: usize) -> Self {
        Symmetric { n, factor: vec![0.0; n * n] }
    }

    /// Factors MᵀM of some columns of a matrix with `width` columns, by rows.
    pub fn of_columns(&mut self, rows: &[f64], width: usize, columns: std::ops::Range<usize>) {
        let (n, first) = (self.n, columns.start);
        self.factor.fill(0.0);
        for row in rows.chunks_exact(width) {
            for i in 0..n {
                let a = row[first + i];
                if a == 0.0 {
                    continue;
                }
                for j in 0..=i {
                    self.factor[i * n + j] += a * row[first + j];
                }
            }
        }
        let trace: f64 = (0..n).map(|i| self.factor[i * (n + 1)]).sum();
        let least = LEAST * trace / n as f64 + f64::MIN_POSITIVE;
        for i in 0..n {
            for j in 0..=i {
                let mut sum = self.factor[i * n + j];
                for k in 0..j {
                    sum -= self.factor[i * n + k] * self.factor[j * n + k];
                }
                self.factor[i * n + j] = match i == j {
                    true => (sum + least).max(least).sqrt(),
                    false => sum / self.factor[j * (n + 1)],
                };
            }
        }
    }

    /// Computes A⁻¹ b, in place.
    pub fn solve(&self, b: &mut [f64]) {
        let (n, c) = (self.n, &self.factor);
        for i in 0..n {
            let known: f64 = (0..i).map(|k| c[i * n + k] * b[k]).sum();
            b[i] = (b[i] - known) / c[i * (n + 1)];
        }
        for i in (0..n).rev() {
            let known: f64 = (i + 1..n).map(|k| c[k * n + i] * b[k]).sum();
            b[i] = (b[i] - known) / c[i * (n + 1)];
        }
    }
}
