//! Distributions of one value by their quantile functions: a draw is `quantile(u)` for a uniform number u in (0, 1).
//!
//! All sampling methods use this map from (0, 1) to values: independent numbers, Latin hypercubes and Sobol sequences differ only in their `u`. With
//! the standard normal distribution function Φ:
//! ```text
//! Uniform           a + (b − a) u
//! Normal            μ + σ z                    z = Φ⁻¹(u)
//! TruncatedNormal   μ + σ Φ⁻¹(Φ(α) + u (Φ(β) − Φ(α)))    α = (a − μ)/σ, β = (b − μ)/σ
//! LogNormal         m exp(s z)                 m is the median, s the deviation of the logarithm
//! Choice            the first whose cumulative weight is above u
//! ```
//! Φ and its inverse are those of `statrs`.
use linkwork_runtime::Value;
use statrs::distribution::{ContinuousCDF, Normal};

/// A distribution. Numbers are in its unit.
#[derive(Clone, Debug, PartialEq)]
pub enum Distribution {
    /// Uniform between two bounds.
    Uniform {
        /// Lower bound.
        from: f64,
        /// Upper bound.
        to: f64,
    },
    /// Gaussian.
    Normal {
        /// μ.
        mean: f64,
        /// σ, above zero.
        deviation: f64,
    },
    /// Gaussian, truncated to an interval.
    TruncatedNormal {
        /// μ of the Gaussian before truncation.
        mean: f64,
        /// σ of the Gaussian before truncation.
        deviation: f64,
        /// Lower bound, may be −∞.
        from: f64,
        /// Upper bound, may be ∞.
        to: f64,
    },
    /// Log-normal: the logarithm is Gaussian.
    LogNormal {
        /// exp of the mean of the logarithm.
        median: f64,
        /// Standard deviation of the natural logarithm.
        sigma: f64,
    },
    /// One of several values: numbers, names, files.
    Choice {
        /// The values.
        of: Vec<Value>,
        /// Their probabilities, which sum to 1.
        weights: Vec<f64>,
    },
}

/// Smallest uniform number: half of the distance between two of them.
const LEAST: f64 = 0.5 / (1u64 << 53) as f64;

fn standard() -> Normal {
    Normal::standard()
}

/// Returns Φ(z).
pub(crate) fn phi(z: f64) -> f64 {
    standard().cdf(z)
}

/// Returns Φ⁻¹(u) for u in \[0, 1\]; finite at the ends.
pub(crate) fn deviate(u: f64) -> f64 {
    standard().inverse_cdf(u.clamp(LEAST, 1.0 - f64::EPSILON / 2.0))
}

impl Distribution {
    /// Smallest probability of the interval of a truncated normal distribution. Below it, round-off in Φ dominates.
    pub const LEAST_SUPPORT: f64 = 1e-12;

    /// Returns whether all of its values are numbers.
    pub fn is_number(&self) -> bool {
        match self {
            Distribution::Choice { of, .. } => of.iter().all(|v| matches!(v, Value::Number(_))),
            _ => true,
        }
    }

    /// Returns the probability of the Gaussian between two bounds (in standard deviations from the mean).
    pub fn between(alpha: f64, beta: f64) -> f64 {
        // Above the mean, use the upper tail, where Φ keeps its precision.
        if alpha > 0.0 { phi(-alpha) - phi(-beta) } else { phi(beta) - phi(alpha) }
    }

    /// Returns whether its values are numbers that can be correlated and ranked.
    pub fn is_continuous(&self) -> bool {
        !matches!(self, Distribution::Choice { .. })
    }

    /// Returns the value below which the fraction `u` of all values lies.
    pub fn quantile(&self, u: f64) -> Value {
        match self {
            Distribution::Choice { of, weights } => {
                let mut sum = 0.0;
                let k = weights.iter().position(|w| {
                    sum += w;
                    u < sum
                });
                // Round-off may leave the last sum below 1.
                let last = weights.iter().rposition(|w| *w > 0.0).unwrap_or(0);
                of[k.unwrap_or(last)].clone()
            }
            _ => Value::Number(self.number(u, deviate(u))),
        }
    }

    /// Returns the quantile at `z = Φ⁻¹(u)`, for correlated values.
    pub fn at_deviate(&self, z: f64) -> Value {
        match self {
            Distribution::Choice { .. } => self.quantile(phi(z)),
            _ => Value::Number(self.number(phi(z), z)),
        }
    }

    fn number(&self, u: f64, z: f64) -> f64 {
        match *self {
            Distribution::Uniform { from, to } => from + (to - from) * u,
            Distribution::Normal { mean, deviation } => mean + deviation * z,
            Distribution::TruncatedNormal { mean, deviation, from, to } => {
                let (alpha, beta) = ((from - mean) / deviation, (to - mean) / deviation);
                let z = if alpha > 0.0 {
                    let (low, high) = (phi(-beta), phi(-alpha));
                    -deviate(low + (1.0 - u) * (high - low))
                } else {
                    let (low, high) = (phi(alpha), phi(beta));
                    deviate(low + u * (high - low))
                };
                (mean + deviation * z).clamp(from, to)
            }
            Distribution::LogNormal { median, sigma } => median * (sigma * z).exp(),
            // A choice cannot be correlated, so this case does not occur.
            Distribution::Choice { .. } => f64::NAN,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn number(d: &Distribution, u: f64) -> f64 {
        match d.quantile(u) {
            Value::Number(x) => x,
            other => panic!("{other}"),
        }
    }

    /// Returns mean and variance by the midpoint rule over u, which is exact up to its error for these distributions.
    fn moments(d: &Distribution) -> (f64, f64) {
        let n = 400_000;
        let (mut sum, mut square) = (0.0, 0.0);
        for k in 0..n {
            let x = number(d, (f64::from(k) + 0.5) / f64::from(n));
            sum += x;
            square += x * x;
        }
        let mean = sum / f64::from(n);
        (mean, square / f64::from(n) - mean * mean)
    }

    fn near(a: f64, b: f64, tolerance: f64) {
        assert!((a - b).abs() <= tolerance, "{a} against {b}");
    }

    /// Quantiles of the standard normal distribution as tabulated (NIST Handbook, 1.3.6.7.1, and 2.5 % by 1.959964).
    #[test]
    fn normal_quantiles_are_those_of_the_tables() {
        let d = Distribution::Normal { mean: 10.0, deviation: 2.0 };
        for (u, z) in [(0.5, 0.0), (0.975, 1.959_963_984_540_054), (0.841_344_746_068_543, 1.0)] {
            near(number(&d, u), 10.0 + 2.0 * z, 1e-11);
            near(number(&d, 1.0 - u), 10.0 - 2.0 * z, 1e-11);
        }
        for u in [0.0, 1.0] {
            assert!(number(&d, u).is_finite(), "an end of the interval is at infinity");
        }
    }

    #[test]
    fn moments_are_those_of_the_closed_forms() {
        let (m, v) = moments(&Distribution::Uniform { from: -1.0, to: 3.0 });
        near(m, 1.0, 1e-9);
        near(v, 16.0 / 12.0, 1e-9);
        let (m, v) = moments(&Distribution::Normal { mean: 2.0, deviation: 0.5 });
        near(m, 2.0, 1e-9);
        near(v, 0.25, 1e-4);
        let (m, v) = moments(&Distribution::LogNormal { median: 2.0, sigma: 0.25 });
        let s2 = 0.25f64 * 0.25;
        let mean = 2.0 * (s2 / 2.0).exp();
        near(m, mean, 1e-5);
        near(v, mean * mean * (s2.exp() - 1.0), 1e-4);
        // Truncated at the mean, the distribution is half-normal.
        let d = Distribution::TruncatedNormal {
            mean: 1.0,
            deviation: 2.0,
            from: 1.0,
            to: f64::INFINITY,
        };
        let (m, v) = moments(&d);
        near(m, 1.0 + 2.0 * (2.0 / std::f64::consts::PI).sqrt(), 1e-4);
        near(v, 4.0 * (1.0 - 2.0 / std::f64::consts::PI), 1e-3);
    }

    #[test]
    fn what_is_truncated_far_from_the_mean_keeps_its_digits_on_both_sides() {
        let up = Distribution::TruncatedNormal { mean: 0.0, deviation: 1.0, from: 6.0, to: 6.5 };
        let down =
            Distribution::TruncatedNormal { mean: 0.0, deviation: 1.0, from: -6.5, to: -6.0 };
        for k in 0..=100 {
            let u = f64::from(k) / 100.0;
            let (a, b) = (number(&up, u), number(&down, 1.0 - u));
            assert!((6.0..=6.5).contains(&a), "{a}");
            near(a, -b, 1e-12);
            // Half of the values above 6 are above 6.11: the tail is not flat.
            let share = (phi(-6.0) - phi(-a)) / (phi(-6.0) - phi(-6.5));
            near(share, u, 1e-9);
        }
        near(Distribution::between(6.0, 6.5), Distribution::between(-6.5, -6.0), 1e-24);
    }

    #[test]
    fn choices_come_as_often_as_their_weights_say() {
        let of = ["a", "b", "c"].map(|s| Value::Text(s.into())).to_vec();
        let d = Distribution::Choice { of, weights: vec![0.25, 0.0, 0.75] };
        let count = |name: &str| {
            let u = |k: i32| f64::from(k) / 1000.0;
            (0..1000).filter(|k| d.quantile(u(*k)) == Value::Text(name.into())).count()
        };
        assert_eq!((count("a"), count("b"), count("c")), (250, 0, 750));
        assert_eq!(d.quantile(1.0), Value::Text("c".into()));
    }
}
