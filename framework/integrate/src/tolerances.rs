//! Tolerances of each lane, and the error norm.
use crate::errors::Setup;

/// Absolute and relative tolerance of each lane.
///
/// ```text
/// qᵢ = |errorᵢ| / (absᵢ + relᵢ max(|x₀ᵢ|, |x₁ᵢ|))
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct Tolerances {
    abs: Vec<f64>,
    rel: Vec<f64>,
    /// Number of lanes that count: those with a finite absolute tolerance.
    counted: f64,
}

/// Norm that combines the qᵢ of all lanes. A step is accepted if the norm is at most 1.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Norm {
    /// √(mean of qᵢ²) over the lanes that count.
    #[default]
    Rms,
    /// The largest qᵢ: keeps every lane within its tolerance, however many other lanes are at rest.
    Max,
}

impl Tolerances {
    /// Creates tolerances from one absolute (in the lane's unit; infinity excludes the lane) and one relative tolerance for each lane.
    ///
    /// # Errors
    /// [`Setup::Lengths`], [`Setup::Absolute`], [`Setup::Relative`].
    pub fn new(abs: Vec<f64>, rel: Vec<f64>) -> Result<Self, Setup> {
        if abs.len() != rel.len() {
            return Err(Setup::Lengths { abs: abs.len(), rel: rel.len() });
        }
        let failing = |values: &[f64], good: fn(f64) -> bool| -> Vec<usize> {
            values.iter().enumerate().filter(|(_, v)| !good(**v)).map(|(i, _)| i).collect()
        };
        let lanes = failing(&abs, |v| v > 0.0);
        if !lanes.is_empty() {
            return Err(Setup::Absolute { lanes });
        }
        let lanes = failing(&rel, |v| v >= 0.0 && v.is_finite());
        if !lanes.is_empty() {
            return Err(Setup::Relative { lanes });
        }
        let counted = abs.iter().filter(|v| v.is_finite()).count().max(1) as f64;
        Ok(Tolerances { abs, rel, counted })
    }

    /// Creates the same tolerances for all of n lanes.
    ///
    /// # Errors
    /// As [`Tolerances::new`].
    pub fn uniform(n: usize, abs: f64, rel: f64) -> Result<Self, Setup> {
        Tolerances::new(vec![abs; n], vec![rel; n])
    }

    /// Returns the number of lanes.
    pub fn lanes(&self) -> usize {
        self.abs.len()
    }

    /// Returns the size of each lane at which the absolute tolerance equals the relative one, at most `most`. Smaller values of the lane do not
    /// matter.
    pub(crate) fn sizes(&self, most: f64) -> Vec<f64> {
        let size = |(abs, rel): (&f64, &f64)| (abs / rel.max(1e-6)).min(most);
        self.abs.iter().zip(&self.rel).map(size).collect()
    }

    /// Returns qᵢ.
    #[inline]
    fn ratio(&self, i: usize, error: f64, x0: f64, x1: f64) -> f64 {
        error.abs() / (self.abs[i] + self.rel[i] * x0.abs().max(x1.abs()))
    }

    /// Returns the norm of an error; NaN if any lane is NaN.
    pub(crate) fn norm(&self, norm: Norm, error: &[f64], x0: &[f64], x1: &[f64]) -> f64 {
        let lanes = error.iter().zip(x0).zip(x1).enumerate();
        let ratios = lanes.map(|(i, ((e, x0), x1))| self.ratio(i, *e, *x0, *x1));
        match norm {
            Norm::Rms => (ratios.map(|q| q * q).sum::<f64>() / self.counted).sqrt(),
            // NaN is kept once it occurs.
            Norm::Max => ratios.fold(0.0, |max, q| if q > max || q.is_nan() { q } else { max }),
        }
    }

    /// Returns the lane with the largest qᵢ, and its value. The first NaN counts as the largest.
    pub(crate) fn worst(&self, error: &[f64], x0: &[f64], x1: &[f64]) -> (usize, f64) {
        let mut worst = (0, 0.0);
        for i in 0..error.len() {
            let q = self.ratio(i, error[i], x0[i], x1[i]);
            if q.is_nan() {
                return (i, q);
            }
            if q > worst.1 {
                worst = (i, q);
            }
        }
        worst
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The norm is NaN if any lane is NaN.
    #[test]
    fn nan_is_the_largest_error() {
        let tolerances = Tolerances::uniform(3, 1.0, 0.5).unwrap();
        for norm in [Norm::Rms, Norm::Max] {
            for lane in 0..3 {
                let mut error = [0.0, 3.0, 0.1];
                assert!(tolerances.norm(norm, &error, &[0.0; 3], &[0.0; 3]).is_finite());
                error[lane] = f64::NAN;
                let q = tolerances.norm(norm, &error, &[0.0; 3], &[0.0; 3]);
                assert!(q.is_nan(), "{norm:?} lane {lane}: {q}");
                assert_eq!(tolerances.worst(&error, &[0.0; 3], &[0.0; 3]).0, lane);
            }
        }
        let zero = tolerances.norm(Norm::Max, &[0.0, 0.0, f64::NAN], &[0.0; 3], &[0.0; 3]);
        assert!(zero.is_nan());
    }
}
