//! Tolerances of each lane, and the number that they make of an error.
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
    /// Lanes that count: absolute tolerance finite.
    counted: f64,
}

/// How the qᵢ of all lanes become one number; a step is accepted when it is at most 1.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Norm {
    /// √(mean of qᵢ²) over the lanes that count.
    #[default]
    Rms,
    /// The largest qᵢ: no lane above its tolerance, however many others are still.
    Max,
}

impl Tolerances {
    /// One absolute (in the lane's unit; infinity leaves the lane out) and one relative tolerance
    /// for each lane.
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

    /// The same for all of n lanes.
    ///
    /// # Errors
    /// As [`Tolerances::new`].
    pub fn uniform(n: usize, abs: f64, rel: f64) -> Result<Self, Setup> {
        Tolerances::new(vec![abs; n], vec![rel; n])
    }

    /// Number of lanes.
    pub fn lanes(&self) -> usize {
        self.abs.len()
    }

    /// Where the absolute tolerance takes over from the relative one, which is how small a lane
    /// matters; at most `most`.
    pub(crate) fn sizes(&self, most: f64) -> Vec<f64> {
        let size = |(abs, rel): (&f64, &f64)| (abs / rel.max(1e-6)).min(most);
        self.abs.iter().zip(&self.rel).map(size).collect()
    }

    /// qᵢ.
    #[inline]
    fn ratio(&self, i: usize, error: f64, x0: f64, x1: f64) -> f64 {
        error.abs() / (self.abs[i] + self.rel[i] * x0.abs().max(x1.abs()))
    }

    /// The norm of an error; NaN when a lane is.
    pub(crate) fn norm(&self, norm: Norm, error: &[f64], x0: &[f64], x1: &[f64]) -> f64 {
        let lanes = error.iter().zip(x0).zip(x1).enumerate();
        let ratios = lanes.map(|(i, ((e, x0), x1))| self.ratio(i, *e, *x0, *x1));
        match norm {
            Norm::Rms => (ratios.map(|q| q * q).sum::<f64>() / self.counted).sqrt(),
            // NaN stays once it is there.
            Norm::Max => ratios.fold(0.0, |max, q| if q > max || q.is_nan() { q } else { max }),
        }
    }

    /// The lane with the largest qᵢ, and it; the first NaN is the largest of all.
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

    /// NaN in any lane is the norm, whatever the other lanes are.
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
