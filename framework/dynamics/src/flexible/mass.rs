//! Mass matrix, centroidal momentum matrix and Jacobian of the centre of mass, including modes.
//!
//! Composite bodies are about each slot's own origin. The force F of a degree of freedom propagates inward and is multiplied with the columns along
//! the path:
//! ```text
//! C(k) = M(k) + Σ_j φ C(j) φ*                   stations count as children of their link
//! hinge of link k        F = C(k) S
//! mode j of link b       F = Σ_s φ(b,s) C(s) Ψ_j(s),   M_ij = Σ_s Ψ_i(s)·C(s) Ψ_j(s)
//! ```

use super::inverse::armature;
use super::jacobian::columns;
use super::{Flexible, Set, Step};
use crate::composite::each_axis;
use crate::linear::{V3, V6};
use crate::tree::Tree;
use crate::work::{Composite, Work};

/// Computes the mass matrix, nv × nv.
pub(crate) fn mass_matrix(tree: &Tree, flex: &Flexible, w: &mut Work<f64>, out: &mut [f64]) {
    let nv = tree.nv();
    out.fill(0.0);
    composites(tree, flex, w);
    for set in &flex.sets {
        own_block(flex, set, w, nv, out);
        for j in 0..set.n {
            let F = w.bend.F[set.v + j];
            meet(tree, flex, w, set.base as usize, F, |i, x| put(out, nv, i, set.v + j, x));
        }
    }
    for (k, link) in tree.links.iter().enumerate() {
        let v = link.v as usize;
        for j in v..v + link.kind.nv() {
            let F = w.bend.F[j];
            meet(tree, flex, w, k + 1, F, |i, x| put(out, nv, i, j, x));
        }
    }
    armature(tree, |i, a| out[i * nv + i] += a);
}

fn put(out: &mut [f64], nv: usize, i: usize, j: usize, x: f64) {
    out[i * nv + j] = x;
    out[j * nv + i] = x;
}

/// Computes the forces of a wrench about the origin of a slot at every degree of freedom inboard.
fn meet(
    tree: &Tree,
    flex: &Flexible,
    w: &Work<f64>,
    slot: usize,
    F: V6<f64>,
    mut each: impl FnMut(usize, f64),
) {
    columns(tree, flex, w, slot, V3::default(), |i, J, _, _| each(i, J.dot(&F)));
}

/// Computes Σ_s Ψ_i·C Ψ_j of one body.
fn own_block(flex: &Flexible, set: &Set, w: &Work<f64>, nv: usize, out: &mut [f64]) {
    for s in set.first..set.end {
        let (C, column) = (&w.bend.composite[flex.slot(s)], flex.stations[s].column);
        let S = &w.bend.S[column..column + set.n];
        for j in 0..set.n {
            let F = C.apply(S[j]);
            for i in 0..=j {
                out[(set.v + i) * nv + set.v + j] += S[i].dot(&F);
            }
        }
    }
    for j in 0..set.n {
        for i in 0..j {
            let x = out[(set.v + i) * nv + set.v + j];
            out[(set.v + j) * nv + set.v + i] = x;
        }
    }
}

/// Computes the composite inertia of each slot, and F of each degree of freedom about the origin of its link (for modes, of the set's link).
pub(super) fn composites(tree: &Tree, flex: &Flexible, w: &mut Work<f64>) {
    w.bend.composite[0] = Composite::default();
    for slot in 1..tree.slots() {
        let (m, h, J) = tree.world_mass(flex, &w.kin, slot);
        w.bend.composite[slot] = Composite { m, h, J };
    }
    for step in flex.order.iter().rev() {
        match *step {
            Step::Link(k) => {
                let (link, kin, C) = (&tree.links[k], &w.kin[k + 1], w.bend.composite[k + 1]);
                let mut i = link.v as usize;
                each_axis(link, kin, V3::default(), |S| {
                    w.bend.F[i] = C.apply(S);
                    i += 1;
                });
                add(&mut w.bend.composite[link.parent as usize], &C.shifted(kin.l));
            }
            Step::Set(i) => {
                let set = &flex.sets[i];
                w.bend.F[set.v..set.v + set.n].fill(V6::default());
                for s in set.first..set.end {
                    let (slot, column) = (flex.slot(s), flex.stations[s].column);
                    let (C, l) = (w.bend.composite[slot], w.kin[slot].l);
                    for j in 0..set.n {
                        let F = C.apply(w.bend.S[column + j]).to_parent(l);
                        w.bend.F[set.v + j] = w.bend.F[set.v + j] + F;
                    }
                    add(&mut w.bend.composite[set.base as usize], &C.shifted(l));
                }
            }
        }
    }
}

fn add(to: &mut Composite<f64>, C: &Composite<f64>) {
    *to = Composite { m: to.m + C.m, h: to.h + C.h, J: to.J.add(&C.J) };
}

/// Computes the momentum for a unit of each rate, about `center` (relative to the origin of slot 1), world axes.
fn momenta(
    tree: &Tree,
    flex: &Flexible,
    w: &mut Work<f64>,
    center: V3<f64>,
    mut each: impl FnMut(usize, V6<f64>),
) {
    composites(tree, flex, w);
    let Some(first) = w.kin.get(1) else { return };
    let mut shifted = |slot: usize, places: std::ops::Range<usize>| {
        let l = (w.kin[slot].p - first.p) - center;
        places.for_each(|i| each(i, w.bend.F[i].to_parent(l)));
    };
    for (k, link) in tree.links.iter().enumerate() {
        let v = link.v as usize;
        shifted(k + 1, v..v + link.kind.nv());
    }
    for set in &flex.sets {
        shifted(set.base as usize, set.v..set.v + set.n);
    }
}

/// Computes the centroidal momentum matrix, 6 × nv.
pub(crate) fn centroidal_matrix(tree: &Tree, flex: &Flexible, w: &mut Work<f64>, out: &mut [f64]) {
    let nv = tree.nv();
    let (m, h) = super::mass_moments(tree, flex, w);
    let center = if m > 0.0 { h.scale(1.0 / m) } else { h };
    momenta(tree, flex, w, center, |i, F| {
        for (row, x) in [F.n.x, F.n.y, F.n.z, F.f.x, F.f.y, F.f.z].into_iter().enumerate() {
            out[row * nv + i] = x;
        }
    });
}

/// Computes the Jacobian of the centre of mass, 3 × nv.
pub(crate) fn com_jacobian(tree: &Tree, flex: &Flexible, w: &mut Work<f64>, out: &mut [f64]) {
    let (nv, m) = (tree.nv(), tree.total_mass());
    let s = if m > 0.0 { 1.0 / m } else { 0.0 };
    momenta(tree, flex, w, V3::default(), |i, F| {
        (out[i], out[nv + i], out[2 * nv + i]) = (s * F.f.x, s * F.f.y, s * F.f.z);
    });
}
