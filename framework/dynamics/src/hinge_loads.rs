//! Loads that hinges transmit: one sweep of inverse dynamics at accelerations that are known.
//!
//! ```text
//! f(k) = Σ_j φ(k,j) f(j) + M(k) (α + A) + b(k) − f_ext(k)     wrench on link k through its hinge
//! ```
//! Forces that act on bodies outboard of the hinge beside those of the workspace (contacts, loops) have to be added to the
//! external forces between [`HingeLoads::begin`] and [`HingeLoads::find`], which restores them. A coupling acts within
//! hinges, so it is part of their loads without being added.

use crate::inverse::inverse_dynamics_given_kinematics;
use crate::linear::V6;
use crate::query::{v3, vec3};
use crate::tree::Tree;
use crate::work::Workspace;
use linkwork_multibody::BodyId;
use linkwork_spatial::Force;

/// Memory for the loads of the hinges of one tree. Nothing is allocated after [`HingeLoads::new`].
#[derive(Clone, Debug)]
pub struct HingeLoads {
    f_ext: Vec<V6<f64>>,
    acc: Vec<V6<f64>>,
    force: Vec<V6<f64>>,
    tau: Vec<f64>,
}

impl HingeLoads {
    /// For a tree.
    #[must_use]
    pub fn new(tree: &Tree) -> Self {
        let none = vec![V6::default(); tree.slots()];
        Self { f_ext: none.clone(), acc: none.clone(), force: none, tau: vec![0.0; tree.nv()] }
    }

    /// Keeps the external forces and accelerations of a workspace at the state whose loads are computed.
    pub fn begin(&mut self, ws: &Workspace) {
        self.f_ext.copy_from_slice(&ws.work.f_ext);
        self.acc.copy_from_slice(&ws.work.acc);
    }

    /// Finds the loads at the last [`kinematics`](crate::kinematics()) with the external forces that the workspace has now and the
    /// accelerations `vdot` (nv); then puts those of [`HingeLoads::begin`] back. About 110 multiply-adds a one-dof link.
    pub fn find(&mut self, tree: &Tree, ws: &mut Workspace, vdot: &[f64]) {
        inverse_dynamics_given_kinematics(tree, ws, vdot, &mut self.tau);
        self.force.copy_from_slice(&ws.work.force);
        ws.work.f_ext.copy_from_slice(&self.f_ext);
        ws.work.acc.copy_from_slice(&self.acc);
    }

    /// Generalised forces at the hinges (nv; N m or N): all that drives a coordinate, its armature's share included. At prescribed
    /// coordinates it is what their motion takes.
    #[must_use]
    pub fn efforts(&self) -> &[f64] {
        &self.tau
    }

    /// Moment (N m) and force (N) on a body through its hinge, about the origin and in the axes of the hinge's frame on the body
    /// (J of `X_BJ`), of a body that has a hinge with coordinates; `ws` has to be at the state of [`HingeLoads::find`].
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
