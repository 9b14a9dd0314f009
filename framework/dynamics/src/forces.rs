//! External forces: wrenches on nodes, forces at centres of mass, gravity.
//!
//! Forces are kept in world axes about each link's own origin, so distances from the world's
//! origin never enter. Add them after [`kinematics`](crate::kinematics()) of the same state.

use crate::linear::{V3, V6};
use crate::tree::{OnLink, Tree};
use crate::work::Workspace;
use linkwork_multibody::{BodyId, NodeId};
use linkwork_spatial::{Force, Vec3};

impl Workspace {
    /// Forgets all external forces and gravity.
    pub fn clear_forces(&mut self) {
        self.work.clear_forces();
    }

    /// Adds a wrench on a node: moment about the node's origin (N m) and force (N), world axes.
    pub fn add_wrench_at_node(&mut self, tree: &Tree, node: NodeId, wrench: Force) {
        self.add(tree.node(node), &Vec3::zeros(), wrench);
    }

    /// Adds a wrench on a body: moment about its origin (N m) and force (N), world axes.
    pub fn add_wrench_at_body(&mut self, tree: &Tree, body: BodyId, wrench: Force) {
        self.add(tree.body(body), &Vec3::zeros(), wrench);
    }

    /// Adds a force (N, world axes) through the centre of mass of a body. On a flexible body it acts on the body frame:
    /// it does not bend it.
    pub fn add_force_at_com(&mut self, tree: &Tree, body: BodyId, force: Vec3) {
        let com = match tree.flexible.as_deref() {
            None => tree.multibody().get(body).inertia().com(),
            Some(flex) => {
                let c = crate::flexible::body_com(tree, flex, self, body);
                self.body_rotation(tree, body).transpose() * c
            }
        };
        self.add(tree.body(body), &com, Force::new(Vec3::zeros(), force));
    }

    /// Gravity that depends on place: `field` gives the acceleration of free fall (m/s², world
    /// axes) at the centre of mass of each body that has mass (m, world axes), and at each station of a flexible one.
    pub fn apply_gravity(&mut self, tree: &Tree, field: &mut impl FnMut(&Vec3) -> Vec3) {
        for id in tree.multibody().body_ids() {
            let inertia = tree.multibody().get(id).inertia();
            let at = tree.body(id);
            if inertia.mass() > 0.0 && at.slot != 0 {
                let g = field(&self.rigid_com(tree, id));
                let f = Force::new(Vec3::zeros(), g * inertia.mass());
                self.add(at, &inertia.com(), f);
            }
        }
        if let Some(flex) = tree.flexible.as_deref() {
            crate::flexible::apply_gravity(flex, &mut self.work, field);
        }
    }

    /// Adds the same acceleration of free fall (m/s², world axes) for every body: free of cost.
    pub fn apply_uniform_gravity(&mut self, g: Vec3) {
        self.work.gravity = self.work.gravity + V3 { x: g.x, y: g.y, z: g.z };
    }

    /// A force through the point `offset` of a frame on a link (frame axes), with a moment.
    fn add(&mut self, at: &OnLink, offset: &Vec3, wrench: Force) {
        let slot = at.slot as usize;
        let r = at.p + at.R * offset;
        let r = self.work.kin[slot].R.mul(V3 { x: r.x, y: r.y, z: r.z });
        let (n, f) = (&wrench.moment, &wrench.force);
        let w = V6 { n: V3 { x: n.x, y: n.y, z: n.z }, f: V3 { x: f.x, y: f.y, z: f.z } };
        self.work.f_ext[slot] = self.work.f_ext[slot] + w.to_parent(r);
    }
}
