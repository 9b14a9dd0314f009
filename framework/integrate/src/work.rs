//! Workspace of a step, allocated once.

/// The vectors of a step, n lanes each except `k`.
#[derive(Clone, Debug)]
pub(crate) struct Work {
    /// State at the start.
    pub x0: Vec<f64>,
    /// State at the end.
    pub x1: Vec<f64>,
    /// State of a stage; unused between attempts.
    pub stage: Vec<f64>,
    /// Stages one after the other; the first is f at the start for explicit methods.
    pub k: Vec<f64>,
    /// Error estimate; otherwise unused.
    pub error: Vec<f64>,
    /// Difference between x₁ and the interpolant: round-off and projection.
    pub defect: Vec<f64>,
}

impl Work {
    /// Allocates for n lanes and this number of stages, including those of dense output.
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

/// Result of an attempted step.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Attempt {
    /// x₁ is finite.
    Finite,
    /// A stage or x₁ is not finite; this is the first such lane.
    Bad { lane: usize },
}

impl Attempt {
    /// Finds the first lane that is not finite.
    pub fn bad(x: &[f64]) -> Self {
        Attempt::Bad { lane: crate::combine::first_bad(x).unwrap_or(0) }
    }
}
