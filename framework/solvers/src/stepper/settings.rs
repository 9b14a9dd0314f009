//! Settings of contact steps, and what a step reports.

use crate::constrained::SolverError;
use crate::contact::{ContactError, Measure, Method, Settings};
use linkwork_spatial::Vec3;
use thiserror::Error;

/// What limits of hinges do.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum JointLimits {
    /// They stop the coordinate, without bouncing.
    #[default]
    Stop,
    /// Nothing.
    Ignore,
}

/// How contact is treated.
#[derive(Clone, Debug, PartialEq)]
pub struct ContactSettings {
    /// Gaps up to this are looked at, m; of what moves, up to as much more as it covers in a step.
    pub margin: f64,
    /// Penetration that is left alone, m: it keeps resting contacts in touch.
    pub slop: f64,
    /// Part of the penetration beyond it that is worked off in a step.
    pub correction: f64,
    /// Greatest speed of that, m/s.
    pub push_max: f64,
    /// Contacts that approach more slowly than this do not bounce, m/s.
    pub bounce_min: f64,
    /// Whether limits of hinges hold.
    pub limits: JointLimits,
    /// Dry friction of hinges: place in β, force (N m or N).
    pub dry: Vec<(usize, f64)>,
    /// The complementarity solver's. Its tolerance is a part of the largest velocity of any row, or of
    /// 0.01 of what forces alone would give it in the step when that is more.
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

/// Impulse of a contact of the last step: where the next search begins. Part of a run's state.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Impulse {
    /// The colliders.
    pub pair: (u32, u32),
    /// The point within the pair.
    pub feature: u64,
    /// On the second body, N s, world axes.
    pub impulse: Vec3,
}

/// What a step was like.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StepReport {
    /// Contact points looked at.
    pub contacts: usize,
    /// Rows of the problem.
    pub rows: usize,
    /// Constraint islands: parts of the mechanism that rows do not connect.
    pub islands: usize,
    /// Impacts with restitution: instants of the step at which contacts closed.
    pub impacts: usize,
    /// Deepest penetration at the start of the step, m.
    pub penetration: f64,
    /// The method whose answer was taken; of several islands, of the one that took most iterations.
    pub method: Method,
    /// Its sweeps, linear systems or pivots.
    pub iterations: u32,
    /// How far the impulses are from a solution: the worst of the islands.
    pub measure: Measure,
    /// Whether that is within the tolerance in every island.
    pub converged: bool,
}

/// Why a step was not made.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum StepError {
    /// Of the mechanism.
    #[error(transparent)]
    Solver(#[from] SolverError),
    /// Of the contact problem.
    #[error(transparent)]
    Contact(#[from] ContactError),
}
