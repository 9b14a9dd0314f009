//! Storage of a step, made once.

/// The vectors of a step, each of n lanes but for `k`.
#[derive(Clone, Debug)]
pub(crate) struct Work {
    /// State at the start.
    pub x0: Vec<f64>,
    /// State at the end.
    pub x1: Vec<f64>,
    /// State of a stage; spare between attempts.
    pub stage: Vec<f64>,
    /// Stages one after the other; the first is f at the start for explicit methods.
    pub k: Vec<f64>,
    /// Error estimate; spare otherwise.
    pub error: Vec<f64>,
    /// What the interpolant misses x₁ by: rounding and projection.
    pub defect: Vec<f64>,
}

impl Work {
    /// For n lanes and so many stages, those of the dense output included.
    pub fn new(n: usize, stages: usize) -> Self {
        let lanes = || vec![0.0; n];
        Work {
            x0: lanes(),
            x1: lanes(),
            stage: lanes(),
            k: vec![0.0; n * stages],
            error: lanes(),
            defect: lanes(),
        }
    }
}

/// What came of an attempt at a step.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Attempt {
    /// x₁ is finite.
    Finite,
    /// A stage or x₁ is not, first in this lane.
    Bad { lane: usize },
}

impl Attempt {
    /// The first lane that is not finite.
    pub fn bad(x: &[f64]) -> Self {
        Attempt::Bad { lane: crate::combine::first_bad(x).unwrap_or(0) }
    }
}
