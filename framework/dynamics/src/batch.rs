//! Many states of one mechanism side by side: structure of arrays over a lane.
//!
//! Lane j of every number belongs to state j. Eight lanes pay up to about 20 bodies, four beyond.

use crate::error::DynamicsError;
use crate::kinematics::{check, sweep};
use crate::lane::Lane;
use crate::linear::V3;
use crate::tree::Tree;
use crate::work::Work;
use crate::{composite, forward, inverse};
use linkwork_spatial::Vec3;

/// Working memory for `L::WIDTH` states at once. Same algorithms, same conventions as the
/// functions on a [`Workspace`](crate::Workspace).
#[derive(Clone, Debug)]
pub struct Batch<L> {
    work: Work<L>,
}

impl<L: Lane> Batch<L> {
    /// Memory for `tree`; it must be used with no other.
    #[must_use]
    pub fn new(tree: &Tree) -> Self {
        Self { work: Work::new(tree) }
    }

    /// Sets the acceleration of free fall (m/s², world axes) for every body and state.
    pub fn set_uniform_gravity(&mut self, g: Vec3) {
        self.work.gravity = V3::splat(&V3 { x: g.x, y: g.y, z: g.z });
    }

    /// As [`kinematics`](crate::kinematics()).
    pub fn kinematics(&mut self, tree: &Tree, q: &[L], v: &[L]) {
        check(q.len(), tree.nq(), "q");
        check(v.len(), tree.nv(), "v");
        sweep::<L, true>(&tree.links, &mut self.work.kin, q, v);
    }

    /// As [`poses`](crate::poses).
    pub fn poses(&mut self, tree: &Tree, q: &[L]) {
        check(q.len(), tree.nq(), "q");
        sweep::<L, false>(&tree.links, &mut self.work.kin, q, &[]);
    }

    /// As [`forward_dynamics`](crate::forward_dynamics).
    ///
    /// # Errors
    /// [`DynamicsError::Singular`] if any state is.
    pub fn forward_dynamics(
        &mut self,
        tree: &Tree,
        q: &[L],
        v: &[L],
        tau: &mut [L],
        vdot: &mut [L],
    ) -> Result<(), DynamicsError> {
        check(tau.len(), tree.nv(), "tau");
        check(vdot.len(), tree.nv(), "vdot");
        self.kinematics(tree, q, v);
        forward::run(tree, &mut self.work, tau, vdot)
    }

    /// As [`inverse_dynamics`](crate::inverse_dynamics).
    pub fn inverse_dynamics(&mut self, tree: &Tree, q: &[L], v: &[L], vdot: &[L], tau: &mut [L]) {
        check(tau.len(), tree.nv(), "tau");
        check(vdot.len(), tree.nv(), "vdot");
        self.kinematics(tree, q, v);
        inverse::run(&tree.links, &mut self.work, vdot, tau);
    }

    /// As [`mass_matrix`](crate::mass_matrix), at the last kinematics or poses.
    pub fn mass_matrix(&mut self, tree: &Tree, out: &mut [L]) {
        check(out.len(), tree.nv() * tree.nv(), "mass matrix");
        composite::matrix(&tree.links, &mut self.work, tree.nv(), out);
    }
}
