//! Settings and reports of contact steps.

use crate::constrained::SolverError;
use crate::contact::{ContactError, Measure, Method, Settings};
use linkwork_spatial::Vec3;
use thiserror::Error;

/// Behaviour of hinge limits.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum JointLimits {
    /// Stop the coordinate, without bouncing.
    #[default]
    Stop,
    /// Ignore the limits.
    Ignore,
}

/// Settings of contact.
#[derive(Clone, Debug, PartialEq)]
pub struct ContactSettings {
    /// Gaps up to this are included, m; between moving bodies, also larger gaps by the distance that they cover in a step.
    pub margin: f64,
    /// Penetration that is left alone, m. It keeps resting contacts closed.
    pub slop: f64,
    /// Fraction of the penetration beyond `slop` that is removed in a step.
    pub correction: f64,
    /// Largest speed of this correction, m/s.
    pub push_max: f64,
    /// Contacts that approach more slowly than this do not bounce, m/s.
    pub bounce_min: f64,
    /// Behaviour of hinge limits.
    pub limits: JointLimits,
    /// Dry friction of hinges: index in β, force (N m or N).
    pub dry: Vec<(usize, f64)>,
    /// Settings of the complementarity solver. Its tolerance is relative to the largest velocity of any row, or to 0.01 of the velocity that forces
    /// alone would cause in the step, if that is larger.
    pub solver: Settings,
}

impl Default for ContactSettings {
    fn default() -> Self {
        Self {
            margin: 1e-3,
            slop: 1e-4,
            correction: 0.2,
            push_max: 1.0,
            bounce_min: 0.01,
            limits: JointLimits::Stop,
            dry: Vec::new(),
            solver: Settings { tolerance: 1e-3, least: 1, ..Settings::default() },
        }
    }
}

/// Impulse of a contact of the last step, from which the next search starts. Part of a run's state.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Impulse {
    /// The colliders.
    pub pair: (u32, u32),
    /// The point within the pair.
    pub feature: u64,
    /// Impulse on the second body, N s, world axes.
    pub impulse: Vec3,
}

/// Report of a step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StepReport {
    /// Number of contact points included.
    pub contacts: usize,
    /// Number of rows of the problem.
    pub rows: usize,
    /// Number of constraint islands: parts of the mechanism that rows do not connect.
    pub islands: usize,
    /// Number of impacts with restitution: instants of the step at which contacts closed.
    pub impacts: usize,
    /// Deepest penetration at the start of the step, m.
    pub penetration: f64,
    /// The method whose result was returned; of several islands, that with the most iterations.
    pub method: Method,
    /// Number of its sweeps, linear systems or pivots.
    pub iterations: u32,
    /// Distance of the impulses from a solution: the worst island.
    pub measure: Measure,
    /// Whether this is within the tolerance in every island.
    pub converged: bool,
}

/// Reason why a step failed.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum StepError {
    /// Error of the mechanism.
    #[error(transparent)]
    Solver(#[from] SolverError),
    /// Error of the contact problem.
    #[error(transparent)]
    Contact(#[from] ContactError),
}
