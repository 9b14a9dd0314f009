//! One instance of a robot: its configuration, what its hands hold, and the memory of every call.

mod kinematics;
mod prefer;
mod reach;

pub use prefer::{Best, Prefer};
pub use reach::{Answer, Effort, Goal, Outcome};

use crate::error::RobotError;
use crate::model::RobotModel;
use linkwork_dynamics::{InverseKinematics, Tree, Workspace};
use std::sync::Arc;

/// Memory for one chain.
#[derive(Clone, Debug)]
struct ChainMemory {
    ws: Workspace,
    carrier: Option<Workspace>,
    q: Vec<f64>,
    carrier_q: Vec<f64>,
    J: Vec<f64>,
    ik: InverseKinematics,
    /// The best of several solutions, and what a unit of each coordinate counts.
    best: Vec<f64>,
    scale: Vec<f64>,
    /// True while `ws` is of the robot's q.
    fresh: bool,
}

/// One instance of a [`RobotModel`]. `Send`; a clone is an instance of its own.
#[derive(Clone, Debug)]
pub struct Robot {
    model: Arc<RobotModel>,
    q: Vec<f64>,
    /// The mechanism with the inertia of what is held.
    tree: Tree,
    ws: Workspace,
    /// True while `ws` has the poses of `q`.
    fresh: bool,
    chains: Vec<Option<ChainMemory>>,
}

impl Robot {
    /// An instance at the neutral configuration, with all memory that any call takes.
    #[must_use]
    pub fn new(model: &Arc<RobotModel>) -> Self {
        let chains = model.parts.iter().map(|p| {
            p.chain.as_ref().map(|c| ChainMemory {
                ws: Workspace::new(&c.tree),
                carrier: c.carrier.as_ref().map(|c| Workspace::new(&c.tree)),
                q: vec![0.0; c.q.len()],
                carrier_q: vec![0.0; c.carrier.as_ref().map_or(0, |c| c.q.len())],
                J: vec![0.0; 6 * c.v.len()],
                ik: reach::memory(c),
                best: vec![0.0; c.q.len()],
                scale: vec![0.0; c.v.len()],
                fresh: false,
            })
        });
        let tree = model.tree.clone();
        Self {
            q: model.multibody().neutral_q(),
            ws: Workspace::new(&tree),
            chains: chains.collect(),
            fresh: false,
            tree,
            model: model.clone(),
        }
    }

    /// The model.
    #[must_use]
    pub fn model(&self) -> &Arc<RobotModel> {
        &self.model
    }

    /// The configuration (nq).
    #[must_use]
    pub fn q(&self) -> &[f64] {
        &self.q
    }

    /// Another configuration (nq), within limits or not.
    ///
    /// # Errors
    /// [`RobotError::Length`], [`RobotError::NotFinite`]; then nothing has changed.
    pub fn set_q(&mut self, q: &[f64]) -> Result<(), RobotError> {
        numbers("q", q, self.q.len())?;
        self.q.copy_from_slice(q);
        self.fresh = false;
        self.chains.iter_mut().flatten().for_each(|c| c.fresh = false);
        Ok(())
    }

    /// The nearest to `q` (nq) that is within all limits, in place.
    ///
    /// # Errors
    /// [`RobotError::Length`], [`RobotError::NotFinite`].
    pub fn clamp(&self, q: &mut [f64]) -> Result<(), RobotError> {
        numbers("q", q, self.q.len())?;
        for (at, limits) in self.model.limits.iter().flatten() {
            q[*at] = q[*at].clamp(limits.lower, limits.upper);
        }
        Ok(())
    }
}

/// Refuses a wrong length, NaN and infinities.
pub(crate) fn numbers(what: &'static str, x: &[f64], wanted: usize) -> Result<(), RobotError> {
    if x.len() != wanted {
        return Err(RobotError::Length { what, got: x.len(), wanted });
    }
    match x.iter().position(|x| !x.is_finite()) {
        Some(index) => Err(RobotError::NotFinite { what, index, value: x[index] }),
        None => Ok(()),
    }
}
