//! Objects with joints, such as pliers, a drawer or a door. Grasping and releasing them works as for rigid objects, without rebuilding the model.
//!
//! ```text
//! M_T  = M_T⁰ + φ(T,O) M_O(θ) φ*(T,O)         in the hand's tree: all bodies of the object, locked at its θ
//! τ    = τ_locked + J_Tᵀ φ(T,O) (f − f_locked) f: force of the object's root with θ̇, θ̈; f_locked: with θ at rest
//! τ_θ  = H_θ f                                 forces at the object's joints
//! M    = [M_locked, J_Tᵀ φ(T,O) F; ·, M_θ]     F: force of the root for a unit of θ̈
//! ```
//! The object's bodies are a separate tree whose base moves with the hand. The robot's tree never changes, so results after a release are
//! bit-identical to results before the grasp. Joints whose θ̇ is not given do not move.

use super::{Push, Robot, numbers};
use crate::error::RobotError;
use crate::linkage::{Linkage, ROOT_Q, ROOT_V};
use crate::model::{Object, RobotModel};
use linkwork_dynamics::{
    Tree, Workspace, inverse_dynamics, mass_matrix, node_jacobian_transpose_product, poses,
};
use linkwork_multibody::BodyId;
use linkwork_spatial::{Force, Motion, Pose, RigidInertia, Vec3};

/// Memory of one object with joints.
#[derive(Clone, Debug)]
pub(super) struct Memory {
    /// Tree of the object's bodies, with the inertia of objects that are attached to them.
    pub tree: Tree,
    pub ws: Workspace,
    /// Coordinates of the root, which do not change, and θ.
    pub q: Vec<f64>,
    v: Vec<f64>,
    vdot: Vec<f64>,
    tau: Vec<f64>,
    rest: Vec<f64>,
    M: Vec<f64>,
    /// Jacobian of one of its bodies (6 × nv).
    pub J: Vec<f64>,
    /// Inertia of all bodies at θ, including attached objects, about the object's origin in its axes.
    pub inertia: RigidInertia,
    /// Distance of each body's origin from the object's origin, m.
    pub far: Vec<f64>,
}

impl Memory {
    pub fn new(linkage: &Linkage) -> Self {
        let (tree, nv) = (&linkage.tree, linkage.tree.nv());
        let mut new = Self {
            tree: tree.clone(),
            ws: Workspace::new(tree),
            q: linkage.multibody().neutral_q(),
            v: vec![0.0; nv],
            vdot: vec![0.0; nv],
            tau: vec![0.0; nv],
            rest: vec![0.0; nv],
            M: vec![0.0; nv * nv],
            J: vec![0.0; 6 * nv],
            inertia: RigidInertia::zero(),
            far: vec![0.0; linkage.multibody().bodies().len()],
        };
        new.look();
        new
    }

    /// Updates all data that depend on θ.
    pub(super) fn look(&mut self) {
        self.ws.set_base(&Pose::identity(), &Motion::zero(), &Motion::zero());
        poses(&self.tree, &mut self.ws, &self.q);
        self.inertia = RigidInertia::zero();
        for (id, far) in self.tree.multibody().body_ids().zip(&mut self.far) {
            let X = self.ws.body_pose(&self.tree, id);
            let own = *self.tree.multibody().get(id).inertia();
            self.inertia += own.rotate(&X.rotation).shift_to_parent(&X.position);
            *far = X.position.norm();
        }
    }
}

/// Pose and motion of an object, the base of its bodies.
struct Base {
    pose: Pose,
    velocity: Motion,
    acceleration: Motion,
}

impl Robot {
    pub(super) fn linkages(model: &RobotModel) -> Vec<Option<Memory>> {
        model.linkages.iter().map(|l| l.as_ref().map(Memory::new)).collect()
    }

    fn linkage(&self, object: Object) -> Result<&Linkage, RobotError> {
        let found = self.model.linkages.get(object.index()).ok_or(RobotError::ForeignHandle)?;
        found.as_ref().ok_or(RobotError::NoJoints { object: object.index() })
    }

    /// Returns the coordinates of an object's joints (nq of the object), which are initially neutral. Empty for a rigid object.
    ///
    /// # Errors
    /// [`RobotError::ForeignHandle`].
    pub fn object_q(&self, object: Object) -> Result<&[f64], RobotError> {
        let found = self.linkages.get(object.index()).ok_or(RobotError::ForeignHandle)?;
        Ok(found.as_ref().map_or(&[], |m| &m.q[ROOT_Q..]))
    }

    /// Sets the coordinates of an object's joints, whether it is held or not; limits are not checked. Updates the load of the hand that carries it.
    /// O(bodies of the object).
    ///
    /// # Errors
    /// [`RobotError::ForeignHandle`], [`RobotError::NoJoints`], [`RobotError::Length`], [`RobotError::NotFinite`]. After an error no coordinate has
    /// changed.
    pub fn set_object_q(&mut self, object: Object, q: &[f64]) -> Result<(), RobotError> {
        let wanted = self.linkage(object)?.tree.nq() - ROOT_Q;
        numbers("q of an object", q, wanted)?;
        if let Some(memory) = &mut self.linkages[object.index()] {
            memory.q[ROOT_Q..].copy_from_slice(q);
        }
        self.reload(Some(object.index()))
    }

    /// Returns `X_WB`, the pose of a body of an object ([`RobotModel::object_body`]).
    ///
    /// # Errors
    /// [`RobotError::ForeignHandle`], [`RobotError::NoJoints`].
    pub fn object_body_pose(&mut self, object: Object, body: BodyId) -> Result<Pose, RobotError> {
        if body.index() >= self.linkage(object)?.multibody().bodies().len() {
            return Err(RobotError::ForeignHandle);
        }
        let X_WO = self.object_pose(object)?;
        let Some(memory) = &mut self.linkages[object.index()] else {
            return Err(RobotError::NoJoints { object: object.index() });
        };
        memory.ws.set_base(&X_WO, &Motion::zero(), &Motion::zero());
        poses(&memory.tree, &mut memory.ws, &memory.q);
        Ok(memory.ws.body_pose(&memory.tree, body))
    }

    /// Like [`feed_forward`](Self::feed_forward), while the joints of a held object move with `rates` and `accelerations` (nv of the object). Writes
    /// the forces at these joints to `forces`. `tau` (nv) is the same as if the object were part of the robot. Joints of other objects do not move.
    /// # Errors
    /// [`RobotError::ForeignHandle`], [`RobotError::NoJoints`], [`RobotError::NotHeld`], [`RobotError::Length`], [`RobotError::NotFinite`],
    /// [`RobotError::NotAChain`]; then no output is written.
    pub fn feed_forward_with_object(
        &mut self,
        (v, vdot): (&[f64], &[f64]),
        object: Object,
        (rates, accelerations): (&[f64], &[f64]),
        pushes: &[Push],
        tau: &mut [f64],
        forces: &mut [f64],
    ) -> Result<(), RobotError> {
        let n = self.linkage(object)?.tree.nv() - ROOT_V;
        numbers("rates", rates, n)?;
        numbers("accelerations", accelerations, n)?;
        length("forces", forces.len(), n)?;
        let Some(hold) = self.hold(object)? else {
            return Err(RobotError::NotHeld { object: object.index() });
        };
        self.feed_forward(v, vdot, pushes, tau)?;
        let (part, X_TO) = hold.hand;
        let base = self.base_of(self.model.tip(part)?, &X_TO);
        let Some(m) = &mut self.linkages[object.index()] else {
            return Err(RobotError::NoJoints { object: object.index() });
        };
        m.ws.set_base(&base.pose, &base.velocity, &base.acceleration);
        m.ws.clear_forces();
        m.ws.apply_uniform_gravity(self.gravity);
        let root = |tau: &[f64]| [0, 3].map(|k| Vec3::new(tau[k], tau[k + 1], tau[k + 2]));
        inverse_dynamics(&m.tree, &mut m.ws, &m.q, &m.rest, &m.rest, &mut m.tau);
        let locked = root(&m.tau);
        m.v[ROOT_V..].copy_from_slice(rates);
        m.vdot[ROOT_V..].copy_from_slice(accelerations);
        inverse_dynamics(&m.tree, &mut m.ws, &m.q, &m.v, &m.vdot, &mut m.tau);
        let moving = root(&m.tau);
        forces.copy_from_slice(&m.tau[ROOT_V..]);
        let more = [0, 1].map(|k| base.pose.rotation * (moving[k] - locked[k]));
        let wrench = Force::new(more[0], more[1]);
        self.add_at_tip(part, &X_TO, &wrench, tau)
    }

    /// Writes the mass matrix M ((nv + n)², row after row) of the robot and, in the last n rows and columns, the joints of an object that it holds.
    /// Joints of other objects do not move.
    ///
    /// # Errors
    /// [`RobotError::ForeignHandle`], [`RobotError::NoJoints`], [`RobotError::NotHeld`], [`RobotError::Length`].
    pub fn mass_matrix_with_object(
        &mut self,
        object: Object,
        M: &mut [f64],
    ) -> Result<(), RobotError> {
        let (nv, own) = (self.tree.nv(), self.linkage(object)?.tree.nv());
        let n = own - ROOT_V;
        length("M", M.len(), (nv + n) * (nv + n))?;
        let Some(hold) = self.hold(object)? else {
            return Err(RobotError::NotHeld { object: object.index() });
        };
        self.mass_matrix(&mut M[..nv * nv])?;
        // Spread the rows to the new width, from the last row to the first, in place.
        let width = nv + n;
        for row in (0..nv).rev() {
            M.copy_within(row * nv..(row + 1) * nv, row * width);
        }
        let X_WO = self.object_pose(object)?;
        let Some(m) = &mut self.linkages[object.index()] else {
            return Err(RobotError::NoJoints { object: object.index() });
        };
        m.ws.set_base(&X_WO, &Motion::zero(), &Motion::zero());
        poses(&m.tree, &mut m.ws, &m.q);
        mass_matrix(&m.tree, &mut m.ws, &mut m.M);
        let (part, X_TO) = hold.hand;
        let tip = self.model.tip(part)?;
        for j in 0..n {
            let (Some(m), column) = (&self.linkages[object.index()], ROOT_V + j) else { continue };
            for i in 0..n {
                M[(nv + i) * width + nv + j] = m.M[(ROOT_V + i) * own + column];
            }
            let at = |k: usize| m.M[k * own + column];
            let [moment, force] =
                [0, 3].map(|k| X_WO.rotation * Vec3::new(at(k), at(k + 1), at(k + 2)));
            let arm = self.ws.node_rotation(&self.tree, tip) * X_TO.position;
            let on_tip = Force::new(moment, force).shift_to_parent(&arm);
            node_jacobian_transpose_product(&self.tree, &self.ws, tip, &on_tip, &mut self.room);
            for (i, x) in self.room.iter().enumerate() {
                M[i * width + nv + j] = *x;
                M[(nv + j) * width + i] = *x;
            }
        }
        Ok(())
    }

    /// Returns pose and motion of an object in a hand, after forces were computed.
    fn base_of(&self, tip: linkwork_multibody::NodeId, X_TO: &Pose) -> Base {
        let pose = self.ws.node_pose(&self.tree, tip);
        let r = pose.rotation * X_TO.position;
        let (V, A) =
            (self.ws.node_velocity(&self.tree, tip), self.ws.node_acceleration(&self.tree, tip));
        let turn = V.angular.cross(&r);
        Base {
            pose: pose * *X_TO,
            velocity: Motion::new(V.angular, V.linear + turn),
            acceleration: Motion::new(
                A.angular,
                A.linear + A.angular.cross(&r) + V.angular.cross(&turn),
            ),
        }
    }

    /// Adds Jᵀ f to `tau` for a wrench f (world axes) on the origin of an object in a hand.
    fn add_at_tip(
        &mut self,
        part: crate::part::Part,
        X_TO: &Pose,
        wrench: &Force,
        tau: &mut [f64],
    ) -> Result<(), RobotError> {
        let tip = self.model.tip(part)?;
        let arm = self.ws.node_rotation(&self.tree, tip) * X_TO.position;
        let on_tip = wrench.shift_to_parent(&arm);
        node_jacobian_transpose_product(&self.tree, &self.ws, tip, &on_tip, &mut self.room);
        tau.iter_mut().zip(&self.room).for_each(|(t, x)| *t += x);
        Ok(())
    }
}

fn length(what: &'static str, got: usize, wanted: usize) -> Result<(), RobotError> {
    if got == wanted { Ok(()) } else { Err(RobotError::Length { what, got, wanted }) }
}
