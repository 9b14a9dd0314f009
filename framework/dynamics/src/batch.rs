//! Many states of one mechanism side by side: structure of arrays in SIMD lanes.
//!
//! Lane j of every number belongs to state j. Eight lanes are faster for up to about 20 bodies, four lanes for more.

use crate::composite::roots;
use crate::error::DynamicsError;
use crate::flexible::Lanes;
use crate::kinematics::{check, path_poses, sweep};
use crate::lane::Lane;
use crate::linear::{V3, V6};
use crate::query::v3;
use crate::tree::Tree;
use crate::work::{Work, Workspace};
use crate::{Compliance, Derivatives, ForwardDerivatives};
use crate::{centroidal, composite, forward, inverse, inverse_mass, jacobian};
use linkwork_multibody::NodeId;
use linkwork_spatial::{Force, Vec3};

/// Work memory for `L::WIDTH` states at once. Algorithms and conventions are those of the functions on a [`Workspace`](crate::Workspace). The states
/// of a mechanism with flexible bodies are computed one after another.
#[derive(Clone, Debug)]
pub struct Batch<L: Lane> {
    work: Work<L>,
    /// Separate workspaces for the states of a mechanism with flexible bodies.
    lanes: Option<Box<Lanes>>,
}

impl<L: Lane> Batch<L> {
    /// Creates the memory for `tree`; use it only with this tree.
    #[must_use]
    pub fn new(tree: &Tree) -> Self {
        Self { work: Work::new(tree), lanes: Lanes::new::<L>(tree) }
    }

    /// Sets the acceleration of gravity (m/s², world axes) for all bodies and states.
    pub fn set_uniform_gravity(&mut self, g: Vec3) {
        if let Some(lanes) = &mut self.lanes {
            lanes.each.iter_mut().for_each(|ws| ws.work.gravity = v3(&g));
        }
        self.work.gravity = V3::splat(&V3 { x: g.x, y: g.y, z: g.z });
    }

    /// Removes all external forces and gravity.
    pub fn clear_forces(&mut self) {
        if let Some(lanes) = &mut self.lanes {
            lanes.each.iter_mut().for_each(Workspace::clear_forces);
        }
        self.work.clear_forces();
    }

    /// Adds a wrench on a node in each state: moment about the node's origin (N m), force (N), world axes, x y z. Call [`Batch::kinematics`] for the
    /// same states first.
    pub fn add_wrench_at_node(&mut self, tree: &Tree, node: NodeId, moment: [L; 3], force: [L; 3]) {
        if let Some(lanes) = &mut self.lanes {
            for (l, ws) in lanes.each.iter_mut().enumerate() {
                let of = |v: &[L; 3]| Vec3::new(v[0].state(l), v[1].state(l), v[2].state(l));
                ws.add_wrench_at_node(tree, node, Force::new(of(&moment), of(&force)));
            }
            return;
        }
        let slot = tree.node(node).slot as usize;
        let r = self.arm(tree, node);
        let wrench = V6 { n: V3::read(&moment), f: V3::read(&force) };
        self.work.f_ext[slot] = self.work.f_ext[slot] + wrench.to_parent(r);
    }

    /// Returns the position of a node in the world in each state, m.
    #[must_use]
    pub fn node_position(&self, tree: &Tree, node: NodeId) -> [L; 3] {
        if let Some(lanes) = &self.lanes {
            return lanes.three(|ws| ws.node_pose(tree, node).position);
        }
        let p = self.work.kin[tree.node(node).slot as usize].p + self.arm(tree, node);
        [p.x, p.y, p.z]
    }

    /// Returns the velocity of a node's origin in each state: angular (rad/s), linear (m/s), world axes.
    #[must_use]
    pub fn node_velocity(&self, tree: &Tree, node: NodeId) -> ([L; 3], [L; 3]) {
        if let Some(lanes) = &self.lanes {
            let V = |ws: &Workspace| ws.node_velocity(tree, node);
            return (lanes.three(|ws| V(ws).angular), lanes.three(|ws| V(ws).linear));
        }
        let V = self.work.kin[tree.node(node).slot as usize].V.to_child(self.arm(tree, node));
        ([V.n.x, V.n.y, V.n.z], [V.f.x, V.f.y, V.f.z])
    }

    /// Returns the vector from the link's origin to the node's, world axes.
    fn arm(&self, tree: &Tree, node: NodeId) -> V3<L> {
        let at = tree.node(node);
        self.work.kin[at.slot as usize].R.mul(V3::splat(&v3(&at.p)))
    }

    /// Like [`kinematics`](crate::kinematics()).
    pub fn kinematics(&mut self, tree: &Tree, q: &[L], v: &[L]) {
        check(q.len(), tree.nq(), "q");
        check(v.len(), tree.nv(), "v");
        match &mut self.lanes {
            None => sweep::<L, true>(tree, &mut self.work, q, v),
            Some(l) => l.always([q, v], [], |ws, [q, v], []| crate::kinematics(tree, ws, q, v)),
        }
    }

    /// Like [`poses`](crate::poses).
    pub fn poses(&mut self, tree: &Tree, q: &[L]) {
        check(q.len(), tree.nq(), "q");
        match &mut self.lanes {
            None => sweep::<L, false>(tree, &mut self.work, q, &[]),
            Some(l) => l.always([q], [], |ws, [q], []| crate::poses(tree, ws, q)),
        }
    }

    /// Like [`forward_dynamics`](crate::forward_dynamics).
    ///
    /// # Errors
    /// [`DynamicsError::Singular`] if the dynamics of any state is singular.
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
        self.forward_dynamics_given_kinematics(tree, tau, vdot)
    }

    /// Like [`forward_dynamics_given_kinematics`](crate::forward_dynamics_given_kinematics).
    ///
    /// # Errors
    /// [`DynamicsError::Singular`] if the dynamics of any state is singular.
    pub fn forward_dynamics_given_kinematics(
        &mut self,
        tree: &Tree,
        tau: &mut [L],
        vdot: &mut [L],
    ) -> Result<(), DynamicsError> {
        check(tau.len(), tree.nv(), "tau");
        check(vdot.len(), tree.nv(), "vdot");
        match &mut self.lanes {
            None => forward::run(tree, &mut self.work, tau, vdot),
            Some(l) => l.run([], [tau, vdot], |ws, [], [tau, vdot]| {
                crate::forward_dynamics_given_kinematics(tree, ws, tau, vdot)
            }),
        }
    }

    /// Like [`inverse_dynamics`](crate::inverse_dynamics).
    pub fn inverse_dynamics(&mut self, tree: &Tree, q: &[L], v: &[L], vdot: &[L], tau: &mut [L]) {
        check(tau.len(), tree.nv(), "tau");
        check(vdot.len(), tree.nv(), "vdot");
        self.kinematics(tree, q, v);
        match &mut self.lanes {
            None => inverse::run(&tree.links, &mut self.work, vdot, tau),
            Some(l) => l.always([vdot], [tau], |ws, [vdot], [tau]| {
                crate::inverse_dynamics_given_kinematics(tree, ws, vdot, tau);
            }),
        }
    }

    /// Like [`mass_matrix`](crate::mass_matrix), at the last kinematics or poses.
    pub fn mass_matrix(&mut self, tree: &Tree, out: &mut [L]) {
        check(out.len(), tree.nv() * tree.nv(), "mass matrix");
        match &mut self.lanes {
            None => composite::matrix(tree, &mut self.work, out),
            Some(l) => l.always([], [out], |ws, [], [out]| crate::mass_matrix(tree, ws, out)),
        }
    }

    /// Like [`inverse_mass_matrix`](crate::inverse_mass_matrix), at the last kinematics or poses.
    ///
    /// # Errors
    /// [`DynamicsError::Singular`] if the dynamics of any state is singular.
    pub fn inverse_mass_matrix(&mut self, tree: &Tree, out: &mut [L]) -> Result<(), DynamicsError> {
        check(out.len(), tree.nv() * tree.nv(), "inverse mass matrix");
        match &mut self.lanes {
            None => inverse_mass::matrix(tree, &mut self.work, out),
            Some(l) => l.run([], [out], |ws, [], [out]| crate::inverse_mass_matrix(tree, ws, out)),
        }
    }

    /// Like [`node_jacobian`](crate::node_jacobian), at the last kinematics or poses.
    pub fn node_jacobian(&self, tree: &Tree, node: NodeId, out: &mut [L]) {
        check(out.len(), 6 * tree.nv(), "Jacobian");
        let Some(lanes) = &self.lanes else {
            return jacobian::matrix(tree, &self.work, node, out);
        };
        out.fill(L::default());
        for (l, ws) in lanes.each.iter().enumerate() {
            jacobian::each_entry(tree, &ws.work, node, |at, x| {
                out[at] = L::gather(|i| if i == l { x } else { out[at].state(i) });
            });
        }
    }

    /// Like [`node_jacobian_at`](crate::node_jacobian_at): computes only the links inboard of the node.
    pub fn node_jacobian_at(&mut self, tree: &Tree, q: &[L], node: NodeId, out: &mut [L]) {
        check(q.len(), tree.nq(), "q");
        if self.lanes.is_some() {
            self.poses(tree, q);
        }
        path_poses(tree, &mut self.work, q, node);
        self.node_jacobian(tree, node, out);
    }

    /// Like [`centroidal_matrix`](crate::centroidal_matrix), at the last kinematics or poses.
    pub fn centroidal_matrix(&mut self, tree: &Tree, out: &mut [L]) {
        check(out.len(), 6 * tree.nv(), "centroidal matrix");
        match &mut self.lanes {
            None => centroidal::matrix(tree, &mut self.work, out),
            Some(l) => l.always([], [out], |ws, [], [out]| crate::centroidal_matrix(tree, ws, out)),
        }
    }
}

impl<L: Lane> Compliance<L> {
    /// Like [`Compliance::compute`], for the states of a batch.
    ///
    /// # Errors
    /// [`DynamicsError::Singular`] if the dynamics of any state is singular.
    pub fn compute_batch(
        &mut self,
        tree: &Tree,
        batch: &mut Batch<L>,
        out: &mut [L],
    ) -> Result<(), DynamicsError> {
        check(out.len(), self.size() * self.size(), "compliance");
        match (&mut batch.lanes, tree.flexible.as_deref()) {
            (Some(l), Some(flex)) => l.run([], [out], |ws, [], [out]| {
                crate::flexible::compliance(tree, flex, ws, self.nodes(), out)
            }),
            _ => self.run(tree, &mut batch.work, out),
        }
    }
}

impl<L: Lane> Derivatives<L> {
    /// Like [`Derivatives::inverse_dynamics`], for the states of a batch.
    ///
    /// # Panics
    /// If a body is flexible; use [`Tree::check_rigid`] to check.
    pub fn inverse_dynamics_batch(
        &mut self,
        tree: &Tree,
        batch: &mut Batch<L>,
        v: &[L],
        vdot: &[L],
        dtau_dq: &mut [L],
        dtau_dv: &mut [L],
    ) {
        tree.assert_rigid("derivatives");
        let n = tree.nv();
        check(v.len(), n, "v");
        check(vdot.len(), n, "vdot");
        check(dtau_dq.len(), n * n, "dtau_dq");
        check(dtau_dv.len(), n * n, "dtau_dv");
        let w = &mut batch.work;
        roots(&tree.links, &w.kin, &mut w.r);
        self.run(tree, w, v, vdot);
        self.copy(n, dtau_dq, dtau_dv);
    }

    /// Like [`Derivatives::forward_dynamics`], for the states of a batch.
    ///
    /// # Errors
    /// [`DynamicsError::Singular`] if the dynamics of any state is singular.
    pub fn forward_dynamics_batch(
        &mut self,
        tree: &Tree,
        batch: &mut Batch<L>,
        v: &[L],
        tau: &mut [L],
        vdot: &mut [L],
        out: ForwardDerivatives<'_, L>,
    ) -> Result<(), DynamicsError> {
        check(v.len(), tree.nv(), "v");
        check(tau.len(), tree.nv(), "tau");
        check(vdot.len(), tree.nv(), "vdot");
        self.forward(tree, &mut batch.work, v, tau, vdot, out)
    }
}
