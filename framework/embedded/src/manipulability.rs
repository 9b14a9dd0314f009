//! Manipulability of a chain: measure, gradient and ellipsoids.
//!
//! J contains the selected rows; angular rows are multiplied by a length L, so that all are in m/s (L = 1 m leaves the numbers of the Jacobian
//! unchanged). u is a unit direction.
//! ```text
//! w = √det(J Jᵀ)                                           fewer columns than rows: √det(Jᵀ J)
//! ∂w/∂q_k = w tr(J⁺ ∂J/∂q_k) = w Σ_j y_j · ∂J_j/∂q_k       y = (J⁺)ᵀ
//! ∂J_j/∂q_k = [ω_k × ω_j; ω_k × v_j]                       k inboard of j, or of the same subhinge
//!           = [0;         ω_j × v_k]                       k outboard of j
//! velocity along u for |q̇| = 1: (uᵀ (J Jᵀ)⁻¹ u)^−½         force along u for |τ| = 1: (uᵀ J Jᵀ u)^−½
//! ```

use linkwork_spatial::Vec3;
use linkwork_spatial::nalgebra::{Cholesky, Matrix6, Vector6};

/// Selected rows of the Jacobian.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Rows {
    /// All six rows; angular rows are multiplied by a length.
    All {
        /// The length, m.
        length: f64,
    },
    /// The three linear rows.
    Linear,
    /// The three angular rows.
    Angular,
}

/// Manipulability of a tip at one configuration.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Manipulability {
    /// The measure: product of the singular values; 0 at a singular configuration.
    pub w: f64,
    /// Singular values, largest first; three for three rows (the rest are zero). A value below 1e-7 of the largest is at round-off level and is
    /// returned as zero.
    pub singular_values: [f64; 6],
    /// Directions of the half axes in the same order: columns over the selected rows (angular first if there are six).
    pub axes: Matrix6<f64>,
    rows: usize,
    A: Matrix6<f64>,
}

impl Manipulability {
    /// Evaluates a Jacobian with `n` columns (6 × n, row after row). Fills `gradient` (n) if it is given; the gradient is set to zero where the
    /// measure is zero, because it does not exist there. `first` contains for each column the first column of the same subhinge.
    pub(crate) fn new(
        J: &[f64],
        first: &[usize],
        rows: Rows,
        gradient: Option<&mut [f64]>,
    ) -> Self {
        let n = first.len();
        let (from, count, length) = match rows {
            Rows::All { length } => (0, 6, length),
            Rows::Angular => (0, 3, 1.0),
            Rows::Linear => (3, 3, 1.0),
        };
        let column = |j: usize| {
            let mut c = Vector6::zeros();
            for r in 0..count {
                let scale = if count == 6 && r < 3 { length } else { 1.0 };
                c[r] = scale * J[(from + r) * n + j];
            }
            c
        };
        let mut A = Matrix6::zeros();
        for j in 0..n {
            let c = column(j);
            A += c * c.transpose();
        }
        let (singular_values, axes) = spectrum(&A, count);
        let w = singular_values[..count.min(n)].iter().product();
        let it = Self { w, singular_values, axes, rows: count, A };
        if let Some(gradient) = gradient {
            it.gradient(J, first, (from, length), &column, gradient);
        }
        it
    }

    /// Returns the largest speed of the tip along a direction (over the selected rows; its length has no effect) for rates with |q̇| = 1; 0 along a
    /// direction in which it cannot move.
    #[must_use]
    pub fn velocity(&self, direction: &[f64]) -> f64 {
        let Some(u) = self.unit(direction) else { return 0.0 };
        let mut sum = 0.0;
        for i in 0..self.rows {
            let part = self.axes.column(i).dot(&u);
            if part != 0.0 {
                sum += (part / self.singular_values[i]).powi(2);
            }
        }
        if sum.is_finite() { sum.sqrt().recip() } else { 0.0 }
    }

    /// Returns the largest force of the tip along a direction for joint forces with |τ| = 1; infinite along a direction in which the structure itself
    /// carries the force.
    #[must_use]
    pub fn force(&self, direction: &[f64]) -> f64 {
        let Some(u) = self.unit(direction) else { return 0.0 };
        u.dot(&(self.A * u)).max(0.0).sqrt().recip()
    }

    fn unit(&self, direction: &[f64]) -> Option<Vector6<f64>> {
        let mut u = Vector6::zeros();
        let count = self.rows.min(direction.len());
        u.as_mut_slice()[..count].copy_from_slice(&direction[..count]);
        let norm = u.norm();
        (direction.len() == self.rows && norm > 0.0 && norm.is_finite()).then(|| u / norm)
    }

    /// Computes the gradient; the documentation of this file has the equations. O(n²).
    fn gradient(
        &self,
        J: &[f64],
        first: &[usize],
        (from, length): (usize, f64),
        column: &impl Fn(usize) -> Vector6<f64>,
        out: &mut [f64],
    ) {
        let n = first.len();
        out.fill(0.0);
        let rank = self.rows.min(n);
        if self.w == 0.0 {
            return;
        }
        // Compute (J Jᵀ)⁺ on the range of J, which has dimension `rank`.
        let mut pseudo = Matrix6::zeros();
        match Cholesky::new(padded(&self.A, self.rows)).filter(|_| rank == self.rows) {
            Some(c) => pseudo = c.inverse(),
            None => {
                for i in 0..rank {
                    let u = self.axes.column(i);
                    pseudo += u * u.transpose() / self.singular_values[i].powi(2);
                }
            }
        }
        let part = |j: usize, at: usize| {
            Vec3::new(J[at * n + j], J[(at + 1) * n + j], J[(at + 2) * n + j])
        };
        for j in 0..n {
            let y = pseudo * column(j);
            let (y_angular, y_linear) = match (self.rows, from) {
                (6, _) => (y.fixed_rows::<3>(0) * length, y.fixed_rows::<3>(3).into()),
                (_, 0) => (y.fixed_rows::<3>(0).into(), Vec3::zeros()),
                _ => (Vec3::zeros(), y.fixed_rows::<3>(0).into()),
            };
            let (w_j, v_j) = (part(j, 0), part(j, 3));
            for k in 0..n {
                let (w_k, v_k) = (part(k, 0), part(k, 3));
                out[k] += if k <= j || first[k] == first[j] {
                    y_angular.dot(&w_k.cross(&w_j)) + y_linear.dot(&w_k.cross(&v_j))
                } else {
                    y_linear.dot(&w_j.cross(&v_k))
                };
            }
        }
        out.iter_mut().for_each(|x| *x *= self.w);
    }
}

/// Returns a copy with ones on the diagonal below the selected rows.
fn padded(A: &Matrix6<f64>, count: usize) -> Matrix6<f64> {
    let mut out = *A;
    for i in count..6 {
        out[(i, i)] = 1.0;
    }
    out
}

/// Returns the singular values of J, largest first, and their directions.
fn spectrum(A: &Matrix6<f64>, count: usize) -> ([f64; 6], Matrix6<f64>) {
    // The eigenvalue iteration does not end for NaN.
    if A.iter().any(|a| !a.is_finite()) {
        return ([f64::NAN; 6], Matrix6::repeat(f64::NAN));
    }
    let mut order: [usize; 6] = [0, 1, 2, 3, 4, 5];
    let (mut values, mut axes) = ([0.0; 6], Matrix6::zeros());
    let mut put = |values_at: &dyn Fn(usize) -> f64, vector: &dyn Fn(usize, usize) -> f64| {
        order[..count].sort_by(|a, b| values_at(*b).total_cmp(&values_at(*a)));
        let least = 1e-14 * values_at(order[0]);
        for (i, at) in order[..count].iter().enumerate() {
            let square = values_at(*at);
            values[i] = if square > least { square.sqrt() } else { 0.0 };
            for r in 0..count {
                axes[(r, i)] = vector(r, *at);
            }
        }
    };
    if count == 3 {
        let e = A.fixed_view::<3, 3>(0, 0).into_owned().symmetric_eigen();
        put(&|i| e.eigenvalues[i], &|r, i| e.eigenvectors[(r, i)]);
    } else {
        let e = A.symmetric_eigen();
        put(&|i| e.eigenvalues[i], &|r, i| e.eigenvectors[(r, i)]);
    }
    (values, axes)
}
