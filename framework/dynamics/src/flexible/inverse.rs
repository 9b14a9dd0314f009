//! Inverse dynamics of a tree with flexible bodies.
//!
//! ```text
//! station s of link b      α(s) = φ*(b,s) α(b) + Ψ η̈
//!                          T(η) = Σ_s Ψ*(s) f(s) + K η + C η̇          f(b) += Σ_s φ(b,s) f(s)
//! ```
//! Links, and the force of each mass, are treated as in `inverse.rs`.

use super::{Flexible, Step};
use crate::error::DynamicsError;
use crate::linear::{M3, S3, V3, V6};
use crate::tree::{Kind, Tree};
use crate::work::{Kin, Work};

/// Computes T for given accelerations; leaves accelerations less bias, and forces, in the workspace.
pub(crate) fn inverse_dynamics(
    tree: &Tree,
    flex: &Flexible,
    w: &mut Work<f64>,
    vdot: &[f64],
    tau: &mut [f64],
) {
    accelerations(tree, flex, w, vdot);
    w.force[0] = V6::default();
    for slot in 1..tree.slots() {
        let (m, h, J) = tree.mass_at(flex, slot);
        w.force[slot] = mass_force(w, slot, m, h, J);
    }
    gather(tree, flex, w, tau);
    armature(tree, |i, a| tau[i] += a * vdot[i]);
    for set in &flex.sets {
        for i in set.v..set.v + set.n {
            tau[i] += w.bend.elastic[i];
        }
    }
}

/// Computes accelerations less bias of all slots.
pub(super) fn accelerations(tree: &Tree, flex: &Flexible, w: &mut Work<f64>, vdot: &[f64]) {
    for step in &flex.order {
        match *step {
            Step::Link(k) => {
                let (link, kin) = (&tree.links[k], &w.kin[k + 1]);
                let mut a = w.acc[link.parent as usize].to_child(kin.l);
                let mut i = link.v as usize;
                crate::composite::each_axis(link, kin, V3::default(), |S| {
                    a = S.scale_add(vdot[i], a);
                    i += 1;
                });
                w.acc[k + 1] = a;
            }
            Step::Set(i) => {
                let set = &flex.sets[i];
                let base = w.acc[set.base as usize];
                for s in set.first..set.end {
                    let (slot, column) = (flex.slot(s), flex.stations[s].column);
                    let mut a = base.to_child(w.kin[slot].l);
                    for j in 0..set.n {
                        a = w.bend.S[column + j].scale_add(vdot[set.v + j], a);
                    }
                    w.acc[slot] = a;
                }
            }
        }
    }
}

/// Returns the inertial force of a mass less gravity and external forces, about the slot's origin.
fn mass_force(w: &Work<f64>, slot: usize, m: f64, h: V3<f64>, J: S3<f64>) -> V6<f64> {
    let (kin, acc, ext) = (&w.kin[slot], &w.acc[slot], &w.f_ext[slot]);
    let h = kin.R.mul(h);
    let (alpha, lin) = (acc.n + kin.A.n, acc.f + kin.A.f - w.gravity);
    let (wl, al) = (kin.R.tmul(kin.V.n), kin.R.tmul(alpha));
    let body = wl.cross_add(J.mul(wl), J.mul(al));
    V6 {
        n: kin.R.mul_add(body, h.cross_add(lin, -ext.n)),
        f: kin.V.n.cross_add(kin.V.n.cross(h), alpha.cross_add(h, lin.scale(m) - ext.f)),
    }
}

/// Gathers the forces of all slots at the hinges and modes.
pub(super) fn gather(tree: &Tree, flex: &Flexible, w: &mut Work<f64>, tau: &mut [f64]) {
    for step in flex.order.iter().rev() {
        match *step {
            Step::Link(k) => {
                let (link, kin, f) = (&tree.links[k], &w.kin[k + 1], w.force[k + 1]);
                let mut i = link.v as usize;
                crate::composite::each_axis(link, kin, V3::default(), |S| {
                    tau[i] = S.dot(&f);
                    i += 1;
                });
                let p = link.parent as usize;
                w.force[p] = w.force[p] + f.to_parent(kin.l);
            }
            Step::Set(i) => {
                let set = &flex.sets[i];
                tau[set.v..set.v + set.n].fill(0.0);
                for s in set.first..set.end {
                    let (slot, column) = (flex.slot(s), flex.stations[s].column);
                    let f = w.force[slot];
                    for j in 0..set.n {
                        tau[set.v + j] += w.bend.S[column + j].dot(&f);
                    }
                    let base = set.base as usize;
                    w.force[base] = w.force[base] + f.to_parent(w.kin[slot].l);
                }
            }
        }
    }
}

impl Tree {
    /// Returns mass, first moment and inertia of a slot about its origin, in its axes.
    pub(crate) fn mass_at(&self, flex: &Flexible, slot: usize) -> (f64, V3<f64>, S3<f64>) {
        match flex.station(slot) {
            Some(s) => {
                let s = &flex.stations[s];
                (s.m, s.h, s.J)
            }
            None => {
                let link = &self.links[slot - 1];
                (link.m, link.h, link.J)
            }
        }
    }

    /// Returns links and sets of modes, parents first.
    pub(crate) fn steps(&self) -> impl Iterator<Item = Step> + '_ {
        let flex = self.flexible.as_deref();
        let links = if flex.is_none() { self.links.len() } else { 0 };
        flex.into_iter().flat_map(|f| f.order.iter().copied()).chain((0..links).map(Step::Link))
    }

    /// Returns the slot inboard of a slot, in any tree.
    pub(crate) fn inboard_of(&self, slot: usize) -> usize {
        match self.flexible.as_deref() {
            Some(flex) => self.inboard(flex, slot),
            None => self.links[slot - 1].parent as usize,
        }
    }

    /// Returns the body to whose hinge or station a slot belongs.
    pub(crate) fn body_of(&self, slot: usize) -> usize {
        let station = self.flexible.as_deref().and_then(|f| Some((f, f.station(slot)?)));
        match station {
            Some((f, s)) => f.sets[f.stations[s].set as usize].body as usize,
            None => self.links[slot - 1].body as usize,
        }
    }

    /// Returns the error for a slot that moves no inertia.
    #[cold]
    pub(crate) fn singular_at(&self, slot: usize, v: usize) -> DynamicsError {
        let body = self.multibody.bodies()[self.body_of(slot)].name().to_owned();
        DynamicsError::Singular { body, v }
    }

    /// Returns the slot inboard of the slot of a link or station; 0 is the world.
    pub(crate) fn inboard(&self, flex: &Flexible, slot: usize) -> usize {
        match flex.station(slot) {
            Some(s) => flex.sets[flex.stations[s].set as usize].base as usize,
            None => self.links[slot - 1].parent as usize,
        }
    }

    /// Returns mass, first moment and inertia of a slot about its origin, world axes.
    pub(crate) fn world_mass(
        &self,
        flex: &Flexible,
        kin: &[Kin<f64>],
        slot: usize,
    ) -> (f64, V3<f64>, S3<f64>) {
        let (m, h, J) = self.mass_at(flex, slot);
        let R: &M3<f64> = &kin[slot].R;
        (m, R.mul(h), J.rotate(R))
    }
}

/// Calls a function for each degree of freedom of a link with armature.
pub(super) fn armature(tree: &Tree, mut each: impl FnMut(usize, f64)) {
    for link in &tree.links {
        if link.armature > 0.0 && link.kind != Kind::Free {
            let at = link.v as usize;
            (at..at + link.kind.nv()).for_each(|i| each(i, link.armature));
        }
    }
}
