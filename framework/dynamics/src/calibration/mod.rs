//! Calibration: which parameters of a mechanism the measurements identify, and their values.
//!
//! ```text
//! y = W π + noise            W: rows of measurements, columns of parameters
//! W = W_b C                  W_b: columns that are linearly independent of the columns before them;  C = [1 K], in the order of the columns
//! β = C π                    base parameters: all that y identifies of π
//! β̂ = argmin |W_b β − y|     covariance: σ² (W_bᵀ W_b)⁻¹,  σ² = |W_b β̂ − y|²/(rows − rank)
//! π̂ = π₀ + Cᵀ (C Cᵀ)⁻¹ (β̂ − C π₀)       among all parameters that explain y equally well, the nearest to a prior π₀
//! ```
//! Base parameters follow Gautier, Journal of Robotic Systems 8 (1991), "Numerical calculation of the base inertial parameters of robots". Every call
//! allocates, so do not use this in a simulation loop.

mod inertial;
mod kinematic;

pub use inertial::{InertialData, InertialFit, structural_regressor};
pub use kinematic::{KinematicFit, Placed, calibrate_kinematics};

use linkwork_spatial::nalgebra::{DMatrix, DVector};
use thiserror::Error;

/// Reason why a calibration failed.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum CalibrationError {
    /// Inconsistent lengths.
    #[error("`{what}` has {got} numbers, expected {want}\n  help: give {want}")]
    Length {
        /// The argument.
        what: &'static str,
        /// Its length.
        got: usize,
        /// Required length.
        want: usize,
    },
    /// A number that is NaN or infinite.
    #[error("number {place} of `{what}` is {value}\n  help: give finite numbers")]
    NotFinite {
        /// The argument.
        what: &'static str,
        /// Index in it.
        place: usize,
        /// The value.
        value: f64,
    },
    /// Fewer measurements than identifiable parameters.
    #[error(
        "{rows} measured numbers are not enough for {rank} parameters\n  help: measure more states"
    )]
    TooFew {
        /// Number of rows.
        rows: usize,
        /// Rank.
        rank: usize,
    },
    /// A name that does not exist, or a mechanism that is not supported.
    #[error("{0}")]
    Mechanism(String),
    /// The iteration of a kinematic calibration did not converge.
    #[error(
        "after {steps} steps the frames still change by {change:.1e}\n  help: check units, quaternions and the node; give better first frames"
    )]
    Diverged {
        /// Number of steps.
        steps: usize,
        /// Change of the last step, m and rad.
        change: f64,
    },
}

/// Parameters that measurements identify.
#[derive(Clone, Debug, PartialEq)]
pub struct Identifiable {
    /// Columns that are linearly independent of the columns before them, in order; their number is the rank.
    pub base: Vec<usize>,
    /// C (rank × parameters): each base parameter as a combination of parameters, with coefficient 1 for its own.
    pub combinations: DMatrix<f64>,
    /// Ratio of the largest to the smallest singular value of the base columns, each scaled to length 1. Above about 1e3, noise strongly affects the
    /// result.
    pub condition: f64,
}

impl Identifiable {
    /// Analyses W (rows × parameters). A column counts as dependent when its component orthogonal to the columns before it is below `tolerance` times
    /// its length.
    #[must_use]
    pub fn of(W: &DMatrix<f64>, tolerance: f64) -> Self {
        let (rows, n) = W.shape();
        let mut base = Vec::new();
        let (mut Q, mut R): (Vec<DVector<f64>>, Vec<Vec<f64>>) = (Vec::new(), Vec::new());
        let mut K: Vec<Option<Vec<f64>>> = Vec::with_capacity(n);
        let greatest = W.column_iter().map(|c| c.norm()).fold(0.0, f64::max);
        for j in 0..n {
            let own = W.column(j);
            let mut left = DVector::from_iterator(rows, own.iter().copied());
            let mut along = vec![0.0; Q.len()];
            for _ in 0..2 {
                for (k, q) in Q.iter().enumerate() {
                    let a = q.dot(&left);
                    along[k] += a;
                    left.axpy(-a, q, 1.0);
                }
            }
            let length = left.norm();
            // A column that is negligible compared with the others contains only round-off.
            if length > tolerance * own.norm() && own.norm() > 1e-13 * greatest {
                base.push(j);
                along.push(length);
                R.push(along);
                Q.push(left / length);
                K.push(None);
            } else {
                K.push(Some(along));
            }
        }
        let rank = base.len();
        let mut combinations = DMatrix::zeros(rank, n);
        for (i, j) in base.iter().enumerate() {
            combinations[(i, *j)] = 1.0;
        }
        for (j, along) in K.into_iter().enumerate() {
            let Some(mut x) = along else { continue };
            // Solve R x = Qᵀ w.
            for i in (0..x.len()).rev() {
                let more: f64 = (i + 1..x.len()).map(|k| R[k][i] * x[k]).sum();
                x[i] = (x[i] - more) / R[i][i];
            }
            // Coefficients at round-off level of the column, or of the other columns, are set to zero.
            let least = (1e-9 * W.column(j).norm()).max(1e-13 * greatest);
            for (i, x) in x.into_iter().enumerate() {
                if x.abs() * W.column(base[i]).norm() > least {
                    combinations[(i, j)] = x;
                }
            }
        }
        let scaled = DMatrix::from_fn(rows, rank, |i, k| {
            let column = W.column(base[k]);
            column[i] / column.norm()
        });
        let condition = match rank {
            0 => 1.0,
            _ => {
                let singular = scaled.singular_values();
                singular.max() / singular.min()
            }
        };
        Self { base, combinations, condition }
    }

    /// Returns the number of identifiable combinations.
    #[must_use]
    pub fn rank(&self) -> usize {
        self.base.len()
    }

    /// Returns the parameters that have no influence on the measurements.
    #[must_use]
    pub fn without_influence(&self) -> Vec<usize> {
        let n = self.combinations.ncols();
        (0..n).filter(|j| self.combinations.column(*j).iter().all(|x| *x == 0.0)).collect()
    }

    /// Returns the parameters that are identified individually, not only in combination with others.
    #[must_use]
    pub fn alone(&self) -> Vec<usize> {
        let others = |i: usize| self.combinations.row(i).iter().filter(|x| **x != 0.0).count();
        self.base.iter().enumerate().filter(|(i, _)| others(*i) == 1).map(|(_, j)| *j).collect()
    }
}

/// Parameters that explain the measurements.
#[derive(Clone, Debug, PartialEq)]
pub struct Fit {
    /// The identifiable parameters.
    pub identifiable: Identifiable,
    /// β̂ (rank).
    pub base: Vec<f64>,
    /// Standard deviations of β̂, computed from the residual.
    pub deviations: Vec<f64>,
    /// π̂: among the parameters that explain the measurements equally well, the nearest to the prior.
    pub parameters: Vec<f64>,
    /// RMS of the residuals W π̂ − y.
    pub residual: f64,
}

/// Fits parameters: W (rows × parameters), y (rows), a prior π₀ (parameters), and the `tolerance` of [`Identifiable::of`]. The caller must scale rows
/// with different units or precision.
///
/// # Errors
/// [`CalibrationError`] for wrong lengths, NaN, and when the number of rows does not exceed their rank.
pub fn fit(
    W: &DMatrix<f64>,
    y: &[f64],
    prior: &[f64],
    tolerance: f64,
) -> Result<Fit, CalibrationError> {
    length("y", y, W.nrows())?;
    length("prior", prior, W.ncols())?;
    if let Some(place) = W.iter().position(|x| !x.is_finite()) {
        return Err(CalibrationError::NotFinite { what: "W", place, value: W[place] });
    }
    let identifiable = Identifiable::of(W, tolerance);
    let (rows, rank) = (W.nrows(), identifiable.rank());
    if rows <= rank {
        return Err(CalibrationError::TooFew { rows, rank });
    }
    if rank == 0 {
        // Nothing is identifiable.
        let square: f64 = y.iter().map(|y| y * y).sum();
        let residual = (square / rows as f64).sqrt();
        let (base, deviations) = (Vec::new(), Vec::new());
        let parameters = prior.to_vec();
        return Ok(Fit { identifiable, base, deviations, parameters, residual });
    }
    let C = &identifiable.combinations;
    let prior = DVector::from_column_slice(prior);
    let begin = C * &prior;
    let own = DMatrix::from_fn(rows, rank, |i, k| W[(i, identifiable.base[k])]);
    // Solve for the change from the prior, with columns scaled to length 1.
    let norms: Vec<f64> = own.column_iter().map(|c| c.norm()).collect();
    let scaled = DMatrix::from_fn(rows, rank, |i, k| own[(i, k)] / norms[k]);
    let y = DVector::from_column_slice(y);
    let qr = scaled.qr();
    let (Q, R) = (qr.q(), qr.r());
    let mut change = Q.transpose() * (&y - &own * &begin);
    // The columns are independent, so the diagonal of R has no zero.
    let solved = R.solve_upper_triangular_mut(&mut change);
    debug_assert!(solved, "independent columns");
    change.iter_mut().zip(&norms).for_each(|(x, n)| *x /= n);
    let base = &begin + &change;
    let residual = (&own * &base - &y).norm();
    let sigma = residual / ((rows - rank) as f64).sqrt();
    let mut inverse = DMatrix::identity(rank, rank);
    R.solve_upper_triangular_mut(&mut inverse);
    let deviations = inverse.row_iter().zip(&norms).map(|(r, n)| sigma * r.norm() / n).collect();
    // Apply Cᵀ (C Cᵀ)⁻¹ with the factors of Cᵀ = Q R: Q R⁻ᵀ.
    let qr = C.transpose().qr();
    let mut along = change;
    let solved = qr.r().tr_solve_upper_triangular_mut(&mut along);
    debug_assert!(solved, "every base parameter has a column of its own");
    let parameters = &prior + qr.q() * along;
    Ok(Fit {
        base: base.as_slice().to_vec(),
        deviations,
        parameters: parameters.as_slice().to_vec(),
        residual: residual / (rows as f64).sqrt(),
        identifiable,
    })
}

/// Checks the number of values and rejects NaN and infinity.
fn length(what: &'static str, x: &[f64], want: usize) -> Result<(), CalibrationError> {
    if x.len() != want {
        return Err(CalibrationError::Length { what, got: x.len(), want });
    }
    match x.iter().position(|x| !x.is_finite()) {
        Some(place) => Err(CalibrationError::NotFinite { what, place, value: x[place] }),
        None => Ok(()),
    }
}
