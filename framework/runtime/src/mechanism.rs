//! The mechanism as one model with two operations: kinematics (from state) and dynamics (from forces).
//!
//! ```text
//! moore:  q, v → poses and velocities of the bound nodes, hinge states
//! direct: Σ wrenches, Σ torques, gravity → accelerations         (mixed articulated-body forward dynamics)
//! deriv:  q̇ = N(q) v,  v̇ from direct
//! ```
use crate::block::{Block, Now};
use crate::ports::{Lane, NodeState};
use crate::services::Gravity;
use crate::value::{Fault, Origin};
use linkwork_dynamics::{
    DynamicsError, Tree, Workspace, forward_dynamics_given_kinematics, kinematics,
};
use linkwork_multibody::{BodyId, Multibody, NodeId};
use linkwork_spatial::{Force, Vec3};
use std::sync::Arc;

/// A frame that carries ports: a node, or a body's own origin.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Frame {
    /// A named node.
    Node(NodeId),
    /// A body's origin.
    Body(BodyId),
}

/// Where the mechanism finds and puts its lanes.
#[derive(Clone, Default)]
pub struct MechanismWiring {
    /// First lane of q in x (v follows).
    pub x: usize,
    /// Frame, first signal lane of its NodeState.
    pub states: Vec<(Frame, u32)>,
    /// (q index, v index, first signal lane of the HingeState).
    pub hinges: Vec<(u32, u32, u32)>,
    /// Frame, first signal lane of its NodeAccel.
    pub accels: Vec<(Frame, u32)>,
    /// Frame, signal lanes of the wrench on it.
    pub wrenches: Vec<(Frame, [u32; 6])>,
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
    /// The field, when it is the same everywhere.
    pub uniform: Option<Vec3>,
    /// Coordinates at the start.
    pub q: Vec<f64>,
    /// Velocities at the start.
    pub v: Vec<f64>,
    /// Lanes.
    pub wiring: MechanismWiring,
}

impl MechanismPlan {
    /// Whether every free hinge has something to move, at the start.
    ///
    /// # Errors
    /// The hinge that has not, without a place.
    pub(crate) fn moves(&self) -> Result<(), Fault> {
        let mut ws = Workspace::new(&self.tree);
        kinematics(&self.tree, &mut ws, &self.q, &self.v);
        let (mut tau, mut vdot) = (vec![0.0; self.v.len()], vec![0.0; self.v.len()]);
        match forward_dynamics_given_kinematics(&self.tree, &mut ws, &mut tau, &mut vdot) {
            Ok(()) => Ok(()),
            Err(DynamicsError::Singular { body, .. }) => Err(Fault::new(
                Origin::NONE,
                format!("body `{body}`: its hinge has nothing to accelerate: no mass or inertia moves with it"),
            )
            .help("give it, or a body that it carries, a mass and an inertia, or its hinge an armature, or prescribe the hinge")),
            Err(e @ DynamicsError::Flexible { .. }) => {
                let text = e.to_string();
                let (fact, help) = text.split_once("\n  help: ").unwrap_or((&text, ""));
                Err(Fault::new(Origin::NONE, fact).help(help))
            }
        }
    }

    /// A block with its own workspace.
    pub fn block(self: &Arc<Self>) -> Box<dyn Block> {
        let (nq, nv) = (self.multibody.nq(), self.multibody.nv());
        Box::new(MechanismBlock {
            plan: self.clone(),
            ws: Workspace::new(&self.tree),
            tau: vec![0.0; nv],
            vdot: vec![0.0; nv],
            given: vec![0.0; nv],
            q_next: vec![0.0; nq],
            dv: vec![0.0; nv],
        })
    }
}

struct MechanismBlock {
    plan: Arc<MechanismPlan>,
    ws: Workspace,
    tau: Vec<f64>,
    vdot: Vec<f64>,
    given: Vec<f64>,
    q_next: Vec<f64>,
    dv: Vec<f64>,
}

#[inline(always)]
fn put3(sig: &mut [f64], at: usize, v: &Vec3) {
    sig[at..at + 3].copy_from_slice(&[v.x, v.y, v.z]);
}

impl MechanismBlock {
    fn split<'x>(&self, x: &'x [f64]) -> (&'x [f64], &'x [f64]) {
        let (nq, nv) = (self.plan.multibody.nq(), self.plan.multibody.nv());
        let at = self.plan.wiring.x;
        (&x[at..at + nq], &x[at + nq..at + nq + nv])
    }

    fn forces(&mut self, t: f64, sig: &[f64]) {
        let plan = &*self.plan;
        let ws = &mut self.ws;
        ws.clear_forces();
        match (&plan.gravity, plan.uniform) {
            (_, Some(g)) => ws.apply_uniform_gravity(g),
            (Some(field), None) => {
                ws.apply_gravity(&plan.tree, &mut |p| field.acceleration(t, *p));
            }
            (None, None) => {}
        }
        for (frame, lanes) in &plan.wiring.wrenches {
            let f: [f64; 6] = std::array::from_fn(|k| sig[lanes[k] as usize]);
            let wrench = Force::new(Vec3::new(f[0], f[1], f[2]), Vec3::new(f[3], f[4], f[5]));
            match frame {
                Frame::Node(n) => ws.add_wrench_at_node(&plan.tree, *n, wrench),
                Frame::Body(b) => ws.add_wrench_at_body(&plan.tree, *b, wrench),
            }
        }
    }
}

impl Block for MechanismBlock {
    fn moore(&mut self, _: &Now, x: &[f64], _: &[f64], sig: &mut [f64]) {
        let (q, v) = self.split(x);
        let plan = &*self.plan;
        kinematics(&plan.tree, &mut self.ws, q, v);
        for (frame, lane) in &plan.wiring.states {
            let (pose, velocity) = match frame {
                Frame::Node(n) => {
                    (self.ws.node_pose(&plan.tree, *n), self.ws.node_velocity(&plan.tree, *n))
                }
                Frame::Body(b) => {
                    (self.ws.body_pose(&plan.tree, *b), self.ws.body_velocity(&plan.tree, *b))
                }
            };
            NodeState {
                position: pose.position,
                rotation: pose.rotation,
                angular: velocity.angular,
                velocity: velocity.linear,
            }
            .put(&mut sig[*lane as usize..]);
        }
        for &(iq, iv, lane) in &plan.wiring.hinges {
            sig[lane as usize] = q[iq as usize];
            sig[lane as usize + 1] = v[iv as usize];
        }
    }

    fn direct(&mut self, now: &Now, _: &[f64], _: &[f64], sig: &mut [f64]) {
        self.forces(now.t, sig);
        let plan = &*self.plan;
        self.tau.fill(0.0);
        self.vdot.copy_from_slice(&self.given);
        for &(v, lane) in &plan.wiring.torques {
            self.tau[v as usize] = sig[lane as usize];
        }
        for &(v, lane) in &plan.wiring.motions {
            self.vdot[v as usize] = sig[lane as usize];
        }
        if forward_dynamics_given_kinematics(
            &plan.tree,
            &mut self.ws,
            &mut self.tau,
            &mut self.vdot,
        )
        .is_err()
        {
            // Reported by the run as the first bad variable.
            self.vdot.fill(f64::NAN);
        }
        for (frame, lane) in &plan.wiring.accels {
            let a = match frame {
                Frame::Node(n) => self.ws.node_acceleration(&plan.tree, *n),
                Frame::Body(b) => self.ws.body_acceleration(&plan.tree, *b),
            };
            put3(sig, *lane as usize, &a.angular);
            put3(sig, *lane as usize + 3, &a.linear);
        }
    }

    fn deriv(&mut self, _: &Now, x: &[f64], _: &[f64], _: &[f64], xdot: &mut [f64]) {
        let (q, v) = self.split(x);
        let (at, nq) = (self.plan.wiring.x, q.len());
        self.plan.multibody.qdot(q, v, &mut xdot[at..at + nq]);
        xdot[at + nq..at + nq + v.len()].copy_from_slice(&self.vdot);
    }

    fn update(&mut self, _: &Now, _: &[f64], _: &mut [f64], _: &[f64]) {}

    fn normalize(&mut self, x: &mut [f64]) {
        let at = self.plan.wiring.x;
        self.plan.multibody.normalize(&mut x[at..at + self.plan.multibody.nq()]);
    }

    fn advance_positions(&mut self, x: &mut [f64], h: f64) -> bool {
        let (q, v) = self.split(x);
        for (dv, v) in self.dv.iter_mut().zip(v) {
            *dv = h * v;
        }
        self.plan.multibody.integrate(q, &self.dv, &mut self.q_next);
        let at = self.plan.wiring.x;
        x[at..at + self.q_next.len()].copy_from_slice(&self.q_next);
        true
    }

    fn position_lanes(&self) -> std::ops::Range<usize> {
        let at = self.plan.wiring.x;
        at..at + self.plan.multibody.nq()
    }

    fn save_store(&self) -> Result<Vec<u8>, String> {
        Ok(Vec::new())
    }
    fn load_store(&mut self, _: &[u8]) -> Result<(), String> {
        Ok(())
    }
    fn fork(&self) -> Box<dyn Block> {
        self.plan.block()
    }
}
