//! Queries of the workspace for bodies and nodes. All results are in world axes.

use crate::linear::{M3, V3, V6};
use crate::tree::{OnLink, Tree, m3};
use crate::work::Workspace;
use linkwork_multibody::{BodyId, NodeId};
use linkwork_spatial::{Force, Mat3, Motion, Pose, Vec3, quat};

impl Workspace {
    /// Returns `X_WB`, the pose of a body. Call [`kinematics`](crate::kinematics()) first.
    #[must_use]
    pub fn body_pose(&self, tree: &Tree, body: BodyId) -> Pose {
        self.pose(tree.body(body))
    }

    /// Returns `X_WN`, the pose of a node. Call [`kinematics`](crate::kinematics()) first.
    #[must_use]
    pub fn node_pose(&self, tree: &Tree, node: NodeId) -> Pose {
        self.pose(tree.node(node))
    }

    /// Returns `R_WB` of a body as a matrix, which costs less than the pose.
    #[must_use]
    pub fn body_rotation(&self, tree: &Tree, body: BodyId) -> Mat3 {
        let at = tree.body(body);
        mat3(&self.work.kin[at.slot as usize].R) * at.R
    }

    /// Returns `R_WN` of a node as a matrix, which costs less than the pose.
    #[must_use]
    pub fn node_rotation(&self, tree: &Tree, node: NodeId) -> Mat3 {
        let at = tree.node(node);
        mat3(&self.work.kin[at.slot as usize].R) * at.R
    }

    /// Returns `R_WB` of a body as a matrix, and the position of its origin, m, which costs less than the pose.
    #[must_use]
    pub fn body_frame(&self, tree: &Tree, body: BodyId) -> (Mat3, Vec3) {
        self.frame(tree.body(body))
    }

    /// Returns `R_WN` of a node as a matrix, and the position of its origin, m, which costs less than the pose.
    #[must_use]
    pub fn node_frame(&self, tree: &Tree, node: NodeId) -> (Mat3, Vec3) {
        self.frame(tree.node(node))
    }

    /// Returns the velocity of a body at its origin, world axes. Call [`kinematics`](crate::kinematics()) first.
    #[must_use]
    pub fn body_velocity(&self, tree: &Tree, body: BodyId) -> Motion {
        self.velocity(tree.body(body))
    }

    /// Returns the velocity of a node at its origin, world axes. Call [`kinematics`](crate::kinematics()) first.
    #[must_use]
    pub fn node_velocity(&self, tree: &Tree, node: NodeId) -> Motion {
        self.velocity(tree.node(node))
    }

    /// Returns the pose `X_WB` and the velocity of a body at its origin, world axes, which costs less than two calls.
    #[must_use]
    pub fn body_state(&self, tree: &Tree, body: BodyId) -> (Pose, Motion) {
        self.state(tree.body(body))
    }

    /// Returns the pose `X_WN` and the velocity of a node at its origin, world axes, which costs less than two calls.
    #[must_use]
    pub fn node_state(&self, tree: &Tree, node: NodeId) -> (Pose, Motion) {
        self.state(tree.node(node))
    }

    /// Returns the acceleration of a body: angular (rad/s²), and d²/dt² of its origin's position (m/s²); world axes. Gravity is not part of it: the
    /// acceleration of a body at rest is zero. Call forward or inverse dynamics first.
    #[must_use]
    pub fn body_acceleration(&self, tree: &Tree, body: BodyId) -> Motion {
        self.acceleration(tree.body(body))
    }

    /// Returns the acceleration of a node: like [`Workspace::body_acceleration`], at the node's origin.
    #[must_use]
    pub fn node_acceleration(&self, tree: &Tree, node: NodeId) -> Motion {
        self.acceleration(tree.node(node))
    }

    /// Returns the sum of the external wrenches on a body and on everything welded to it: moment about the body's origin (N m) and force (N), world
    /// axes. Gravity of [`Workspace::apply_uniform_gravity`] is not included. Zero for bodies that are welded to the world, and for flexible bodies.
    #[must_use]
    pub fn external_wrench(&self, tree: &Tree, body: BodyId) -> Force {
        let at = tree.body(body);
        let slot = at.slot as usize;
        if slot == 0 || slot > tree.links.len() {
            return Force::new(Vec3::zeros(), Vec3::zeros());
        }
        let (w, kin) = (&self.work.f_ext[slot], &self.work.kin[slot]);
        let (moment, force) = (vec3(&w.n), vec3(&w.f));
        let arm = vec3(&kin.R.mul(v3(&at.p)));
        Force::new(moment - arm.cross(&force), force)
    }

    /// Returns the uniform acceleration of gravity that was added (m/s², world axes).
    #[must_use]
    pub fn uniform_gravity(&self) -> Vec3 {
        vec3(&self.work.gravity)
    }

    /// Returns the acceleration that a node would have with every β̇ = 0, which is J̇β of its Jacobian. World axes, classical acceleration. Call
    /// [`kinematics`](crate::kinematics()) first.
    #[must_use]
    pub fn node_bias_acceleration(&self, tree: &Tree, node: NodeId) -> Motion {
        let at = tree.node(node);
        self.point_acceleration(at, self.work.kin[at.slot as usize].A)
    }

    /// Returns the centre of mass of one body in the world, m (its origin if it has no mass).
    #[must_use]
    pub fn body_com(&self, tree: &Tree, body: BodyId) -> Vec3 {
        if let Some(flex) = tree.flexible.as_deref() {
            let c = crate::flexible::body_com(tree, flex, self, body);
            return self.body_pose(tree, body).position + c;
        }
        self.rigid_point(tree, body, &tree.multibody().get(body).inertia().com())
    }

    /// Returns the position of a point of a rigid body (m, world) from its position on the body (m).
    pub(crate) fn rigid_point(&self, tree: &Tree, body: BodyId, p: &Vec3) -> Vec3 {
        let at = tree.body(body);
        let c = at.p + at.R * p;
        let kin = &self.work.kin[at.slot as usize];
        vec3(&kin.R.mul_add(v3(&c), kin.p))
    }

    pub(crate) fn frame(&self, at: &OnLink) -> (Mat3, Vec3) {
        let kin = &self.work.kin[at.slot as usize];
        (mat3(&kin.R) * at.R, vec3(&kin.R.mul_add(v3(&at.p), kin.p)))
    }

    fn pose(&self, at: &OnLink) -> Pose {
        let (R, p) = self.frame(at);
        Pose::new(quat(&R), p)
    }

    #[inline(always)]
    fn state(&self, at: &OnLink) -> (Pose, Motion) {
        let kin = &self.work.kin[at.slot as usize];
        let r = kin.R.mul(v3(&at.p));
        let V = kin.V.to_child(r);
        let R = kin.R.mat(&m3(&at.R));
        let pose = Pose::new(quat(&mat3(&R)), vec3(&(kin.p + r)));
        (pose, Motion::new(vec3(&V.n), vec3(&V.f)))
    }

    fn velocity(&self, at: &OnLink) -> Motion {
        let kin = &self.work.kin[at.slot as usize];
        let V = kin.V.to_child(kin.R.mul(v3(&at.p)));
        Motion::new(vec3(&V.n), vec3(&V.f))
    }

    fn acceleration(&self, at: &OnLink) -> Motion {
        let slot = at.slot as usize;
        self.point_acceleration(at, self.work.kin[slot].A + self.work.acc[slot])
    }

    /// Computes a + α × r + ω × (ω × r).
    fn point_acceleration(&self, at: &OnLink, A: V6<f64>) -> Motion {
        let kin = &self.work.kin[at.slot as usize];
        let r = kin.R.mul(v3(&at.p));
        let A = A.to_child(r);
        Motion::new(vec3(&A.n), vec3(&kin.V.n.cross_add(kin.V.n.cross(r), A.f)))
    }
}

pub(crate) fn vec3(v: &V3<f64>) -> Vec3 {
    Vec3::new(v.x, v.y, v.z)
}

pub(crate) fn v3(v: &Vec3) -> V3<f64> {
    V3 { x: v.x, y: v.y, z: v.z }
}

pub(crate) fn mat3(m: &M3<f64>) -> Mat3 {
    Mat3::from_columns(&[vec3(&m.x), vec3(&m.y), vec3(&m.z)])
}
