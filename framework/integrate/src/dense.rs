//! Dense output: the solution within the last step.
//!
//! ```text
//! x(t + θh) = x₀ + h Σ bᵢ(θ) kᵢ + β(θ) defect      θ in [0, 1]
//! defect    = x₁ − (x₀ + h Σ bᵢ(1) kᵢ)             rounding, and what the projection moved
//! β         = θ² (3 − 2θ), or θ for methods of order 1
//! ```
//! A projection moves x by no more than the step's own error, so the defect does not reduce the order. It makes both ends bit-identical with x₀ and
//! x₁, and neighbouring steps continuous.
use crate::combine::{Stages, WIDTH_MAX, lane, sum};
use crate::work::Work;

/// Highest degree of an interpolant.
const DEGREE_MAX: usize = 7;

/// bᵢ(θ) = Σₚ βᵢₚ C(P,p) θᵖ (1−θ)^(P−p) of the stages that contribute.
#[derive(Clone, Debug)]
pub(crate) struct Polynomials {
    /// Stages.
    pub stages: Vec<usize>,
    /// Their βᵢₚ, P values for each stage.
    beta: Vec<f64>,
    /// C(P,p), p from 1 to P.
    binomials: Vec<f64>,
}

impl Polynomials {
    /// Removes stages that do not contribute.
    pub fn new<'a>(rows: impl Iterator<Item = &'a [f64]>) -> Self {
        let kept: Vec<_> = rows.enumerate().filter(|(_, row)| !row.is_empty()).collect();
        let degree = kept.first().map_or(0, |(_, row)| row.len());
        assert!(kept.len() <= WIDTH_MAX && degree <= DEGREE_MAX, "an interpolant too large");
        assert!(kept.iter().all(|(_, row)| row.len() == degree), "degrees differ");
        let binomial = |p: usize| (0..p).fold(1.0, |c, i| c * (degree - i) as f64 / (i + 1) as f64);
        Polynomials {
            stages: kept.iter().map(|(stage, _)| *stage).collect(),
            beta: kept.iter().flat_map(|(_, row)| row.iter().copied()).collect(),
            binomials: (1..=degree).map(binomial).collect(),
        }
    }

    /// Returns bᵢ(θ) of each stage in `stages`.
    pub fn weights(&self, theta: f64) -> [f64; WIDTH_MAX] {
        let degree = self.binomials.len();
        let mut weights = [0.0; WIDTH_MAX];
        let mut basis = [0.0; DEGREE_MAX];
        let basis = &mut basis[..degree];
        let mut power = theta;
        for (b, binomial) in basis.iter_mut().zip(&self.binomials) {
            *b = binomial * power;
            power *= theta;
        }
        power = 1.0 - theta;
        for b in basis.iter_mut().rev().skip(1) {
            *b *= power;
            power *= 1.0 - theta;
        }
        if degree > 0 {
            for (w, beta) in weights.iter_mut().zip(self.beta.chunks_exact(degree)) {
                *w = beta.iter().zip(&*basis).map(|(beta, b)| beta * b).sum();
            }
        }
        weights
    }
}

/// The solution within the last accepted step, borrowed from the integrator.
#[derive(Clone, Copy, Debug)]
pub struct Dense<'a> {
    pub(crate) work: &'a Work,
    pub(crate) polynomials: &'a Polynomials,
    /// h for Runge–Kutta, 1 for Rosenbrock.
    pub(crate) scale: f64,
    pub(crate) t: f64,
    pub(crate) h: f64,
    pub(crate) straight: bool,
}

impl Dense<'_> {
    /// Returns the time at the start of the step, s.
    pub fn t(&self) -> f64 {
        self.t
    }

    /// Returns the length of the step, s.
    pub fn h(&self) -> f64 {
        self.h
    }

    /// Computes the state at t + θh, θ in [0, 1]. At the ends it is bit-identical with x₀ and x₁. It is not projected.
    ///
    /// # Panics
    /// If θ is outside [0, 1], or the length of `out` is not n.
    pub fn at(&self, theta: f64, out: &mut [f64]) {
        check(theta);
        let Work { x0, x1, k, defect, .. } = self.work;
        assert_eq!(out.len(), x0.len(), "lanes of the output and of the state");
        if theta == 0.0 {
            return out.copy_from_slice(x0);
        }
        if theta == 1.0 {
            return out.copy_from_slice(x1);
        }
        let weights = self.polynomials.weights(theta);
        let stages = &self.polynomials.stages;
        sum(out, x0, self.scale, &weights[..stages.len()], stages, Stages::new(k, x0.len()));
        let blend = self.blend(theta);
        for (o, d) in out.iter_mut().zip(defect) {
            *o += blend * d;
        }
    }

    /// Returns one lane at t + θh, bit-identical with [`Dense::at`].
    ///
    /// # Panics
    /// If θ is outside [0, 1], or the lane does not exist.
    pub fn lane(&self, theta: f64, i: usize) -> f64 {
        check(theta);
        let Work { x0, x1, k, defect, .. } = self.work;
        if theta == 0.0 {
            return x0[i];
        }
        if theta == 1.0 {
            return x1[i];
        }
        let weights = self.polynomials.weights(theta);
        let stages = &self.polynomials.stages;
        let value = lane(x0[i], self.scale, &weights[..stages.len()], stages, k, x0.len(), i);
        value + self.blend(theta) * defect[i]
    }

    /// Returns β(θ).
    fn blend(&self, theta: f64) -> f64 {
        if self.straight { theta } else { theta * theta * (3.0 - 2.0 * theta) }
    }
}

fn check(theta: f64) {
    assert!((0.0..=1.0).contains(&theta), "theta = {theta} is outside the step, 0 to 1");
}
