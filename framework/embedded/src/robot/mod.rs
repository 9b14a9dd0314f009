//! One instance of a robot: its configuration, the objects in its hands, and the memory of all functions.

mod closure;
mod collide;
mod dual;
mod force;
mod grip;
mod hold;
mod inverse_kinematics;
mod kinematics;
mod linkage;
mod many;
mod mass;
mod mount;
mod objective;
mod obstacles;
mod planner;
mod predict;
mod prefer;
mod rate_control;
mod task;
mod timing;
mod transfer;
mod whole_body;
mod whole_body_ik;

pub use closure::{Closing, ClosureRank};
pub use collide::{Path, PathProgress};
pub use dual::{Balance, HandWeights, HandWrenches, Shared};
pub use force::Push;
pub use grip::{Friction, Gripped};
pub use hold::{Grasp, Hold};
pub use inverse_kinematics::{Answer, Effort, Frame, Outcome};
pub use many::collides_all;
pub use mount::Mount;
pub use objective::{Aim, Objective};
pub use planner::{PlanOutcome, Planner, Search};
pub use predict::Predictor;
pub use prefer::{Best, Prefer};
pub use rate_control::{Guards, RateControl};
pub use task::{Impedance, TaskSpace};
pub use timing::{MotionLimits, Timed, Timing};
pub use transfer::{MotionState, Transfer, Transferred};
pub use whole_body::{Balanced, Touch, WholeBody};
pub use whole_body_ik::{TipGoal, WholeBodyIk};

use crate::error::RobotError;
use crate::model::RobotModel;
use crate::part::Part;
use linkwork_dynamics::{InverseKinematics, Tree, Workspace};
use linkwork_spatial::nalgebra::Vector6;
use linkwork_spatial::{Pose, RigidInertia, Vec3};
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
    /// Best of several solutions, and the scale of each coordinate.
    best: Vec<f64>,
    scale: Vec<f64>,
    /// True while `ws` contains the poses of the robot's q.
    fresh: bool,
    /// True after a search was begun.
    searching: bool,
}

/// One instance of a [`RobotModel`]. It is `Send`; a clone is an independent instance.
#[derive(Debug)]
pub struct Robot {
    model: Arc<RobotModel>,
    q: Vec<f64>,
    /// The mechanism, with the inertia of held objects.
    tree: Tree,
    ws: Workspace,
    /// True while `ws` has the poses of `q`.
    fresh: bool,
    chains: Vec<Option<ChainMemory>>,
    gravity: Vec3,
    /// For each object, the hands that hold it, and its pose when no hand holds it.
    holds: Vec<Option<Hold>>,
    objects: Vec<Pose>,
    /// Attachment of each object, and its inertia including objects that are attached to it.
    mounts: Vec<Option<Mount>>,
    loads: Vec<RigidInertia>,
    /// All objects; each comes after the object that it is attached to.
    order: Vec<u32>,
    /// For each object with joints, their coordinates and memory.
    linkages: Vec<Option<linkage::Memory>>,
    /// Zero rates, forces of one tip, a Jacobian of one tip, columns of a closed loop.
    rest: Vec<f64>,
    room: Vec<f64>,
    jacobian: Vec<f64>,
    columns: Vec<Vector6<f64>>,
    collide: collide::Memory,
}

impl Clone for Robot {
    /// Creates an independent instance that already has all of its memory, so that no later call allocates.
    fn clone(&self) -> Self {
        let mut new = Self {
            model: self.model.clone(),
            q: self.q.clone(),
            tree: self.tree.clone(),
            ws: self.ws.clone(),
            fresh: self.fresh,
            chains: self.chains.clone(),
            gravity: self.gravity,
            holds: self.holds.clone(),
            objects: self.objects.clone(),
            mounts: self.mounts.clone(),
            loads: self.loads.clone(),
            order: self.order.clone(),
            linkages: self.linkages.clone(),
            rest: self.rest.clone(),
            room: self.room.clone(),
            jacobian: self.jacobian.clone(),
            columns: self.columns.clone(),
            collide: self.collide.fork(&self.model),
        };
        new.chains.iter_mut().flatten().for_each(|c| c.ik.reserve(1));
        new.own_tree();
        new
    }
}

impl Robot {
    /// Creates an instance at the neutral configuration and allocates the memory of all functions.
    #[must_use]
    pub fn new(model: &Arc<RobotModel>) -> Self {
        let chains = model.parts.iter().map(|p| {
            p.chain.as_ref().map(|c| ChainMemory {
                ws: Workspace::new(&c.tree),
                carrier: c.carrier.as_ref().map(|c| Workspace::new(&c.tree)),
                q: vec![0.0; c.q.len()],
                carrier_q: vec![0.0; c.carrier.as_ref().map_or(0, |c| c.q.len())],
                J: vec![0.0; 6 * c.v.len()],
                ik: inverse_kinematics::memory(c),
                best: vec![0.0; c.q.len()],
                scale: vec![0.0; c.v.len()],
                fresh: false,
                searching: false,
            })
        });
        let (tree, nv) = (model.tree.clone(), model.nv());
        let mut new = Self {
            q: model.multibody().neutral_q(),
            ws: Workspace::new(&tree),
            chains: chains.collect(),
            fresh: false,
            tree,
            gravity: Vec3::new(0.0, 0.0, -9.81),
            holds: vec![None; model.objects.len()],
            objects: vec![Pose::identity(); model.objects.len()],
            mounts: vec![None; model.objects.len()],
            loads: vec![RigidInertia::zero(); model.objects.len()],
            order: (0..model.objects.len() as u32).collect(),
            linkages: Self::linkages(model),
            rest: vec![0.0; nv],
            room: vec![0.0; nv],
            jacobian: vec![0.0; 6 * nv],
            columns: vec![Vector6::zeros(); nv],
            collide: collide::Memory::new(model),
            model: model.clone(),
        };
        new.own_tree();
        new
    }

    /// Detaches the memory of the mechanism and of objects with joints from the model's shared data, and computes all inertias with
    /// [`load`](Self::load) and [`carry`](Self::carry), so that they do not depend on earlier grasps.
    fn own_tree(&mut self) {
        // Process each object after the objects that are attached to it.
        for i in (0..self.order.len()).rev() {
            self.load(self.order[i] as usize);
        }
        for i in 0..self.model.parts.len() {
            if self.model.parts[i].chain.is_some() {
                let done = self.carry(Part(i as u32));
                debug_assert!(done.is_ok());
            }
        }
    }

    /// Returns the model.
    #[must_use]
    pub fn model(&self) -> &Arc<RobotModel> {
        &self.model
    }

    /// Returns the configuration (nq).
    #[must_use]
    pub fn q(&self) -> &[f64] {
        &self.q
    }

    /// Sets the configuration (nq). Limits are not checked.
    ///
    /// # Errors
    /// [`RobotError::Length`], [`RobotError::NotFinite`], [`RobotError::ZeroQuaternion`]. After an error nothing has changed.
    pub fn set_q(&mut self, q: &[f64]) -> Result<(), RobotError> {
        self.model.configurations("q", q, 1)?;
        self.q.copy_from_slice(q);
        self.fresh = false;
        self.chains.iter_mut().flatten().for_each(|c| c.fresh = false);
        Ok(())
    }

    /// Moves `q` (nq) to the nearest configuration within all limits, in place.
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

/// Checks the number of values and rejects NaN and infinity.
pub(crate) fn numbers(what: &'static str, x: &[f64], wanted: usize) -> Result<(), RobotError> {
    if x.len() != wanted {
        return Err(RobotError::Length { what, got: x.len(), wanted });
    }
    match x.iter().position(|x| !x.is_finite()) {
        Some(index) => Err(RobotError::NotFinite { what, index, value: x[index] }),
        None => Ok(()),
    }
}
