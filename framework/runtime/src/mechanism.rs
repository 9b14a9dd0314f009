//! The mechanism as one model with two operations: kinematics (from state) and dynamics (from forces).
//!
//! ```text
//! moore:  q, v → poses and velocities of the bound nodes, hinge states
//! direct: Σ wrenches, Σ torques, gravity → accelerations         (mixed articulated-body forward dynamics)
//! deriv:  q̇ = N(q) v,  v̇ from direct
//! ```
use crate::block::{Block, Now};
use crate::services::Gravity;
use linkwork_dynamics::{Tree, Workspace};
use linkwork_multibody::{Multibody, NodeId};
use linkwork_spatial::{Force, Vec3};
use std::sync::Arc;

/// Where the mechanism finds and puts its lanes.
#[derive(Clone, Default)]
pub struct MechanismWiring {
    /// First lane of q in x (v follows).
    pub x: usize,
    /// Node, first signal lane of its NodeState.
    pub states: Vec<(NodeId, u32)>,
    /// (q index, v index, first signal lane of the HingeState).
    pub hinges: Vec<(u32, u32, u32)>,
    /// Node, first signal lane of its NodeAccel.
    pub accels: Vec<(NodeId, u32)>,
    /// Node, signal lanes of the wrench on it.
    pub wrenches: Vec<(NodeId, [u32; 6])>,
    /// v index, signal lane of the torque on it.
    pub torques: Vec<(u32, u32)>,
    /// v index, signal lane of its prescribed acceleration.
    pub motions: Vec<(u32, u32)>,
}

/// The constant part.
pub struct MechanismPlan {
    /// Path as a part.
    pub path: String,
    /// Structure.
    pub multibody: Arc<Multibody>,
    /// Kernels' constants.
    pub tree: Arc<Tree>,
    /// Gravity field.
    pub gravity: Option<Arc<dyn Gravity>>,
    /// Coordinates at the start.
    pub q: Vec<f64>,
    /// Velocities at the start.
    pub v: Vec<f64>,
    /// Lanes.
    pub wiring: MechanismWiring,
}

impl MechanismPlan {
    /// A block with its own workspace.
    pub fn block(self: &Arc<Self>) -> Box<dyn Block> {
        let (nq, nv) = (self.multibody.nq(), self.multibody.nv());
        Box::new(MechanismBlock {
            plan: self.clone(),
            ws: Workspace::new(&self.tree),
            tau: vec![0.0; nv],
            vdot: vec![0.0; nv],
            given: vec![0.0; nv],
            scratch_q: vec![0.0; nq],
            scratch_v: vec![0.0; nv],
        })
    }
}

struct MechanismBlock {
    plan: Arc<MechanismPlan>,
    ws: Workspace,
    tau: Vec<f64>,
    vdot: Vec<f64>,
    given: Vec<f64>,
    scratch_q: Vec<f64>,
    scratch_v: Vec<f64>,
}

#[inline(always)]
fn put3(sig: &mut [f64], at: usize, v: &Vec3) {
    sig[at..at + 3].copy_from_slice(&[v.x, v.y, v.z]);
}
