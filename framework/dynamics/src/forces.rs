//! External forces: wrenches on nodes, forces at centres of mass, gravity, and Coriolis forces of rotating axes.
//!
//! Forces are stored in world axes about each link's own origin, so distances from the world's origin do not matter. Add them after
//! [`kinematics`](crate::kinematics()) for the same state.

use crate::compound::NEAR;
use crate::linear::{V3, V6};
use crate::query::{v3, vec3};
use crate::tree::{OnLink, Tree};
use crate::work::Workspace;
use linkwork_multibody::{BodyId, NodeId};
use linkwork_spatial::{Force, Motion, RigidInertia, Vec3};

impl Workspace {
    /// Removes all external forces and gravity.
    pub fn clear_forces(&mut self) {
        self.work.clear_forces();
    }

    /// Adds a wrench on a node: moment about the node's origin (N m) and force (N), world axes.
    pub fn add_wrench_at_node(&mut self, tree: &Tree, node: NodeId, wrench: Force) {
        let at = tree.node(node);
        self.add(at, &at.p, wrench);
    }

    /// Adds a wrench on a body: moment about its origin (N m) and force (N), world axes.
    pub fn add_wrench_at_body(&mut self, tree: &Tree, body: BodyId, wrench: Force) {
        let at = tree.body(body);
        self.add(at, &at.p, wrench);
    }

    /// Adds a force (N, world axes) through the centre of mass of a body. On a flexible body it acts on the body frame and does not bend the body.
    pub fn add_force_at_com(&mut self, tree: &Tree, body: BodyId, force: Vec3) {
        let com = match tree.flexible.as_deref() {
            None => tree.multibody().get(body).inertia().com(),
            Some(flex) => {
                let c = crate::flexible::body_com(tree, flex, self, body);
                self.body_rotation(tree, body).transpose() * c
            }
        };
        self.add_at(tree.body(body), &com, Force::new(Vec3::zeros(), force));
    }

    /// Adds position-dependent gravity: `field` returns the acceleration of gravity (m/s², world axes) at the centre of mass of each body with mass
    /// (m, world axes), and at each station of a flexible body.
    pub fn apply_gravity(&mut self, tree: &Tree, field: &mut impl FnMut(&Vec3) -> Vec3) {
        self.apply_smooth_gravity(tree, &|_| 0.0, field);
    }

    /// Like [`apply_gravity`](Self::apply_gravity), for a smooth field: `scale` returns the distance (m) over which the field changes by about its
    /// own magnitude at a position, or 0 if that is unknown. If more than four bodies are locked together and lie within 3e-5 of that distance, the
    /// field is evaluated at only four points that have their mass, centre and second moments. The total force has a relative error of 3e-14, the
    /// gravity-gradient moment one of 3e-5. The cost is then O(links) instead of O(bodies).
    pub fn apply_smooth_gravity(
        &mut self,
        tree: &Tree,
        scale: &impl Fn(&Vec3) -> f64,
        field: &mut impl FnMut(&Vec3) -> Vec3,
    ) {
        for (k, link) in tree.links.iter().enumerate() {
            let (slot, whole) = (k + 1, tree.compounds.get(k + 1));
            let kin = &self.work.kin[slot];
            if whole.reach.is_finite() && whole.reach < NEAR * scale(&vec3(&kin.p)) {
                let mut sum = V6::default();
                for p in &whole.points {
                    let r = kin.R.mul(*p);
                    let g = field(&vec3(&(kin.p + r)));
                    let f = V6 { n: V3::default(), f: v3(&(g * (0.25 * link.m))) };
                    sum = sum + f.to_parent(r);
                }
                self.work.f_ext[slot] = self.work.f_ext[slot] + sum;
            } else if whole.single {
                let r = kin.R.mul(whole.com);
                let g = field(&vec3(&(kin.p + r)));
                let f = V6 { n: V3::default(), f: v3(&g).scale(link.m) };
                self.work.f_ext[slot] = self.work.f_ext[slot] + f.to_parent(r);
            } else {
                for id in tree.compounds.bodies(slot) {
                    self.pull(tree, id, field);
                }
            }
        }
        if let Some(flex) = tree.flexible.as_deref() {
            for id in tree.bodies_on_stations() {
                self.pull(tree, id, field);
            }
            crate::flexible::apply_gravity(flex, &mut self.work, field);
        }
    }

    /// Applies gravity to one body.
    fn pull(&mut self, tree: &Tree, id: BodyId, field: &mut impl FnMut(&Vec3) -> Vec3) {
        let inertia = tree.multibody().get(id).inertia();
        if inertia.mass() > 0.0 {
            let com = inertia.com();
            let g = field(&self.rigid_point(tree, id, &com));
            let f = Force::new(Vec3::zeros(), g * inertia.mass());
            self.add_at(tree.body(id), &com, f);
        }
    }

    /// Adds Coriolis forces on every body when the world's axes rotate at `omega` (rad/s, world axes, constant) in inertial space. Call
    /// [`kinematics`](crate::kinematics()) first. The centrifugal force depends on position and belongs to the gravity field, except for the moment
    /// −ω × I ω due to the extent of a body, which is added here.
    /// ```text
    /// force at the centre of mass    −2 m ω × v
    /// moment about it                −2 ∫ r × (ω × (u × r)) dm − ∫ r × (ω × (ω × r)) dm
    ///                              = 2 u × S ω − ω × I ω          S = ½ tr(I) 1 − I,  u: spin of the body
    /// ```
    /// Links are treated as bodies. I in the last term is the sum of the bodies' own inertias, because the field includes the effect of the distances
    /// between them. Stations of flexible bodies are treated in the same way, with their own mass and inertia. O(links).
    pub fn apply_coriolis(&mut self, tree: &Tree, omega: &Vec3) {
        let turning = v3(omega);
        for (k, link) in tree.links.iter().enumerate().filter(|(_, l)| l.m > 0.0) {
            let (kin, whole) = (&self.work.kin[k + 1], tree.compounds.get(k + 1));
            let (w, u) = (kin.R.tmul(turning), kin.R.tmul(kin.V.n));
            let S_w = w.scale(0.5 * (whole.J.xx + whole.J.yy + whole.J.zz)) - whole.J.mul(w);
            let moment = u.cross(S_w).scale(2.0) - w.cross(whole.K.mul(w));
            let c = kin.R.mul(whole.com);
            let v = kin.V.n.cross_add(c, kin.V.f);
            let f = V6 { n: kin.R.mul(moment), f: turning.cross(v).scale(-2.0 * link.m) };
            self.work.f_ext[k + 1] = self.work.f_ext[k + 1] + f.to_parent(c);
        }
        let Some(flex) = tree.flexible.as_deref() else { return };
        for id in tree.bodies_on_stations() {
            let inertia = tree.multibody().get(id).inertia();
            if inertia.mass() > 0.0 {
                let inertia_W = inertia.rotate_by(&self.body_rotation(tree, id));
                let wrench = coriolis(&inertia_W, &self.body_velocity(tree, id), omega);
                self.add_at(tree.body(id), &inertia.com(), wrench);
            }
        }
        crate::flexible::apply_coriolis(flex, &mut self.work, omega);
    }

    /// Adds a uniform acceleration of gravity (m/s², world axes) for all bodies. It has no computational cost.
    pub fn apply_uniform_gravity(&mut self, g: Vec3) {
        self.work.gravity = self.work.gravity + V3 { x: g.x, y: g.y, z: g.z };
    }

    /// Returns the power of all external forces that were added (W), without uniform gravity. Call [`kinematics`](crate::kinematics()) for the same
    /// state first. Forces on the modes of flexible bodies are not included.
    #[must_use]
    pub fn external_power(&self) -> f64 {
        let links = self.work.kin.iter().zip(&self.work.f_ext).skip(1);
        links.map(|(kin, f)| kin.V.n.dot(f.n) + kin.V.f.dot(f.f)).sum()
    }

    /// Adds a wrench at the point `offset` of a frame on a link (frame axes).
    fn add_at(&mut self, at: &OnLink, offset: &Vec3, wrench: Force) {
        self.add(at, &(at.p + at.R * offset), wrench);
    }

    /// Adds a wrench at a point of the link (link axes).
    #[inline]
    fn add(&mut self, at: &OnLink, point: &Vec3, wrench: Force) {
        let slot = at.slot as usize;
        let r = self.work.kin[slot].R.mul(v3(point));
        let w = V6 { n: v3(&wrench.moment), f: v3(&wrench.force) };
        self.work.f_ext[slot] = self.work.f_ext[slot] + w.to_parent(r);
    }
}

/// Returns the Coriolis force (N) at the centre of mass of a body and its moment about that point (N m), world axes. The inertia is about the body's
/// origin and the velocity is that of the origin, both in world axes.
pub(crate) fn coriolis(inertia: &RigidInertia, V: &Motion, omega: &Vec3) -> Force {
    let v = V.linear + V.angular.cross(&inertia.com());
    let I = inertia.inertia_com();
    let S_omega = omega * (0.5 * I.trace()) - I * omega;
    let moment = V.angular.cross(&S_omega) * 2.0 - omega.cross(&(I * omega));
    Force::new(moment, omega.cross(&v) * (-2.0 * inertia.mass()))
}
