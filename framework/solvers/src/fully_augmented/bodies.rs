//! Free rigid bodies: welded bodies as one group, its inertia, its state in the world.
//!
//! ```text
//! J ω̇ = n − ω × J ω,     m c̈ = f + m g          about the centre of mass c
//! M⁻¹ = diag(J⁻¹, 1/m)
//! ```

use super::FullyAugmentedError;
use linkwork_dynamics::{Tree, Workspace};
use linkwork_multibody::{BodyId, Multibody, SubhingeKind};
use linkwork_spatial::nalgebra::Vector6;
use linkwork_spatial::{Mat3, RigidInertia, Vec3};

type V6 = Vector6<f64>;

pub(super) fn join(n: &Vec3, f: &Vec3) -> V6 {
    V6::new(n.x, n.y, n.z, f.x, f.y, f.z)
}

/// A moving body and the bodies welded to it.
#[derive(Clone, Debug)]
pub(super) struct Group {
    /// The moving body.
    pub lead: BodyId,
    inertia: RigidInertia,
    /// Inertia about the centre of mass, in the axes of the lead.
    J: Mat3,
    J_inv: Mat3,
}

/// Position and motion of a group, world axes.
#[derive(Clone, Debug)]
pub(super) struct State {
    /// Centre of mass.
    pub c: Vec3,
    pub w: Vec3,
    J_inv: Mat3,
    m_inv: f64,
    /// M⁻¹ times all applied forces and −ω × J ω.
    pub free: V6,
}

impl Default for State {
    /// Returns the state of the world, which does not move.
    fn default() -> Self {
        let zero = Vec3::zeros();
        Self { c: zero, w: zero, J_inv: Mat3::zeros(), m_inv: 0.0, free: V6::zeros() }
    }
}

impl State {
    /// Computes M⁻¹ times a wrench about the centre of mass.
    pub fn accelerate(&self, w: &V6) -> V6 {
        let (n, f) = halves(w);
        join(&(self.J_inv * n), &(f * self.m_inv))
    }

    /// Computes φ* A: the acceleration of a point at `to` that moves with the group, except ω × (ω × r).
    pub fn carried(&self, A: &V6, to: &Vec3) -> V6 {
        let (alpha, a) = halves(A);
        join(&alpha, &(a + alpha.cross(&(to - self.c))))
    }

    /// Computes φ w: a wrench at `from`, shifted to the centre of mass.
    pub fn gathered(&self, w: &V6, from: &Vec3) -> V6 {
        let (n, f) = halves(w);
        join(&(n + (from - self.c).cross(&f)), &f)
    }
}

pub(super) fn halves(w: &V6) -> (Vec3, Vec3) {
    (Vec3::new(w[0], w[1], w[2]), Vec3::new(w[3], w[4], w[5]))
}

/// Returns the groups of a mechanism, and the group of each body (`None`: the world).
pub(super) fn groups(
    mbs: &Multibody,
) -> Result<(Vec<Group>, Vec<Option<usize>>), FullyAugmentedError> {
    let poses = mbs.body_poses(&mbs.neutral_q());
    let (mut out, mut of): (Vec<Group>, Vec<Option<usize>>) = (Vec::new(), Vec::new());
    for id in mbs.body_ids() {
        let body = mbs.get(id);
        if body.modes().is_some() {
            return Err(FullyAugmentedError::Flexible { body: body.name().to_owned() });
        }
        let welded = body.subhinges().iter().all(|s| s.subhinge.kind == SubhingeKind::Locked);
        let at = match (welded, body.parent()) {
            (true, parent) => parent.and_then(|p| of[p.index()]),
            (false, _) => {
                let (J, J_inv) = (Mat3::zeros(), Mat3::zeros());
                out.push(Group { lead: id, inertia: RigidInertia::zero(), J, J_inv });
                Some(out.len() - 1)
            }
        };
        of.push(at);
        if let Some(at) = at {
            let group = &mut out[at];
            let X = poses[group.lead.index()].inverse() * poses[id.index()];
            group.inertia += body.inertia().rotate(&X.rotation).shift_to_parent(&X.position);
        }
    }
    for g in &mut out {
        g.J = g.inertia.inertia_com();
        let regular = g.inertia.mass() > 0.0 && g.J.iter().all(|x| x.is_finite()) && {
            let moments = g.J.symmetric_eigenvalues();
            moments.min() > 1e-12 * moments.max()
        };
        match g.J.try_inverse().filter(|_| regular) {
            Some(inverse) => g.J_inv = inverse,
            None => {
                let body = mbs.get(g.lead).name().to_owned();
                return Err(FullyAugmentedError::Inertia { body });
            }
        }
    }
    Ok((out, of))
}

impl Group {
    /// Computes the state at the last kinematics, with the forces of the workspace.
    pub fn state(&self, tree: &Tree, ws: &Workspace) -> State {
        let R = ws.body_rotation(tree, self.lead);
        let arm = R * self.inertia.com();
        let w = ws.body_velocity(tree, self.lead).angular;
        let external = ws.external_wrench(tree, self.lead);
        let J = R * self.J * R.transpose();
        let n = external.moment - arm.cross(&external.force) - w.cross(&(J * w));
        let f = external.force;
        let mut out = State {
            c: ws.body_pose(tree, self.lead).position + arm,
            w,
            J_inv: R * self.J_inv * R.transpose(),
            m_inv: 1.0 / self.inertia.mass(),
            free: V6::zeros(),
        };
        out.free = out.accelerate(&join(&n, &f)) + join(&Vec3::zeros(), &ws.uniform_gravity());
        out
    }
}
