//! Loads that hinges transmit: one sweep of inverse dynamics at known accelerations.
//!
//! ```text
//! f(k) = Σ_j φ(k,j) f(j) + M(k) (α + A) + b(k) − f_ext(k)     wrench on link k through its hinge
//! ```
//! Forces on bodies outboard of the hinge that are not in the workspace (contacts, loops) must be added to the external forces between
//! [`HingeLoads::begin`] and [`HingeLoads::find`], which restores the external forces. A coupling acts within hinges, so it is included in their
//! loads without being added.

use crate::inverse::inverse_dynamics_given_kinematics;
use crate::linear::V6;
use crate::query::{v3, vec3};
use crate::tree::Tree;
use crate::work::Workspace;
use linkwork_multibody::BodyId;
use linkwork_spatial::Force;

/// Memory for the loads of the hinges of one tree. No function allocates after [`HingeLoads::new`].
#[derive(Clone, Debug)]
pub struct HingeLoads {
    f_ext: Vec<V6<f64>>,
    acc: Vec<V6<f64>>,
    force: Vec<V6<f64>>,
    tau: Vec<f64>,
}

impl HingeLoads {
    /// Creates the memory for a tree.
    #[must_use]
    pub fn new(tree: &Tree) -> Self {
        let none = vec![V6::default(); tree.slots()];
        Self { f_ext: none.clone(), acc: none.clone(), force: none, tau: vec![0.0; tree.nv()] }
    }

    /// Stores the external forces and accelerations of a workspace at the state for which loads are computed.
    pub fn begin(&mut self, ws: &Workspace) {
        self.f_ext.copy_from_slice(&ws.work.f_ext);
        self.acc.copy_from_slice(&ws.work.acc);
    }

    /// Computes the loads at the last [`kinematics`](crate::kinematics()) with the current external forces of the workspace and the accelerations
    /// `vdot` (nv); then restores those of [`HingeLoads::begin`]. About 110 multiply-adds per one-dof link.
    pub fn find(&mut self, tree: &Tree, ws: &mut Workspace, vdot: &[f64]) {
        inverse_dynamics_given_kinematics(tree, ws, vdot, &mut self.tau);
        self.force.copy_from_slice(&ws.work.force);
        ws.work.f_ext.copy_from_slice(&self.f_ext);
        ws.work.acc.copy_from_slice(&self.acc);
    }

    /// Returns the generalized forces at the hinges (nv; N m or N): everything that drives a coordinate, including the part of its armature. At
    /// prescribed coordinates they are the forces that their motion requires.
    #[must_use]
    pub fn efforts(&self) -> &[f64] {
        &self.tau
    }

    /// Returns the moment (N m) and force (N) on a body through its hinge, about the origin and in the axes of the hinge's frame on the body (J of
    /// `X_BJ`). The body must have a hinge with coordinates, and `ws` must be at the state of [`HingeLoads::find`].
    #[must_use]
    pub fn load(&self, tree: &Tree, ws: &Workspace, body: BodyId) -> Force {
        let at = tree.body(body);
        let frame = tree.multibody().get(body).hinge_in_body();
        let (R, _) = ws.body_frame(tree, body);
        let f = self.force[at.slot as usize];
        let arm = vec3(&ws.work.kin[at.slot as usize].R.mul(v3(&at.p))) + R * frame.position;
        let (moment, force) = (vec3(&f.n), vec3(&f.f));
        let axes = (R * frame.rotation.to_rotation_matrix().matrix()).transpose();
        Force::new(axes * (moment - arm.cross(&force)), axes * force)
    }
}
