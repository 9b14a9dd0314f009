//! Forward dynamics over units: one gather sweep and one scatter sweep, between which row forces can be added.
//!
//! A link is eliminated dof by dof, an aggregate (see `aggregate.rs`) as a whole; with e = D^{−1/2} ε:
//! ```text
//! gather   ε = T − S · z,   G = P S D⁻¹,   z⁺ = z + G ε,   P⁺ = P − G (P S)ᵀ
//! rows     y = Eᵀ λ                                     forces of constraints, see `rows.rs`
//! scatter  β̇ = D⁻¹ ε + D^{−1/2} y − G · α⁺,   α = α⁺ + S β̇
//! ```
//! Articulated-body inertias are about each link's own origin; S, G and α are about the origin of the root of the units, so that only inertias must
//! be shifted.

use super::{Aggregate, Unit, Units, floating};
use crate::articulated::{Spatial, column};
use crate::error::DynamicsError;
use crate::flexible::Step;
use crate::forward::rigid;
use crate::kinematics::check;
use crate::linear::{M3, S3, V3, V6};
use crate::tree::{Kind, Link, Tree};
use crate::work::{Kin, Work, Workspace};
use linkwork_multibody::{Coordinate, LoopMotion};

/// Work memory of [`Units`]; create it once.
#[derive(Clone, Debug)]
pub struct UnitsWork {
    /// Vector from the origin of the root of the units to each link's.
    pub(crate) r: Vec<V3<f64>>,
    /// Inertia that outboard units propagate to each slot, about its origin; zero if there are none.
    pub(crate) inertia: Vec<Spatial<f64>>,
    pub(crate) z: Vec<V6<f64>>,
    /// H* of each β, about the root's origin.
    pub(crate) S: Vec<V6<f64>>,
    /// For each independent rate: G (free; K for a floating root), and P S for prescribed dofs, about the root's origin.
    pub(crate) G: Vec<V6<f64>>,
    pub(crate) U: Vec<V6<f64>>,
    pub(crate) D_inv: Vec<f64>,
    /// √D⁻¹.
    pub(crate) s: Vec<f64>,
    /// ε; S · z at prescribed dofs.
    pub(crate) eps: Vec<f64>,
    /// Given accelerations of prescribed dofs.
    pub(crate) given: Vec<f64>,
    /// D^{−1/2} ε.
    pub(crate) e: Vec<f64>,
    /// Σ |S|² D⁻¹ of a link's dofs (about the root's origin), Σ |H|² of a member's columns: by slot.
    pub(crate) reach: Vec<f64>,
    /// Acceleration less bias about the root's origin, by slot.
    pub(crate) alpha: Vec<V6<f64>>,
    /// Data of aggregates: see `aggregate.rs`.
    pub(crate) embedded: Vec<super::aggregate::Embedded>,
}

impl UnitsWork {
    /// Creates the memory for these units; use it only with them.
    #[must_use]
    pub fn new(tree: &Tree, units: &Units) -> Self {
        let (n, nv, nw) = (tree.slots(), tree.nv(), units.independent);
        Self {
            r: vec![V3::default(); n],
            inertia: vec![Spatial::default(); n],
            z: vec![V6::default(); n],
            S: vec![V6::default(); nv],
            G: vec![V6::default(); nw],
            U: vec![V6::default(); nw],
            D_inv: vec![0.0; nw],
            s: vec![0.0; nw],
            eps: vec![0.0; nw],
            given: vec![0.0; nw],
            e: vec![0.0; nw],
            reach: vec![0.0; n],
            alpha: vec![V6::default(); n],
            embedded: units.aggregates.iter().map(super::aggregate::Embedded::new).collect(),
        }
    }

    /// Propagates inertia and force to a slot, about its origin.
    #[inline(always)]
    pub(super) fn pass(&mut self, slot: usize, P: &Spatial<f64>, z: V6<f64>, writes: bool) {
        if writes {
            (self.inertia[slot], self.z[slot]) = (*P, z);
        } else {
            self.inertia[slot].add(P);
            self.z[slot] = self.z[slot] + z;
        }
    }

    /// Returns the amount by which the closures of aggregates contradict each other at the last gather, in the units of their rows scaled to one (rad
    /// or m, per s²). It is at round-off level if they are consistent.
    #[must_use]
    pub fn inconsistency(&self) -> f64 {
        self.embedded.iter().map(|e| e.inconsistency).fold(0.0, nan_max)
    }

    /// Returns how independent the rows of embedded constraints are at the last reduction: the smallest pivot, relative to the terms of its row. It
    /// vanishes where the rank drops, as in a parallelogram whose links are in line. Rows that are redundant everywhere are ignored.
    #[must_use]
    pub fn weakest(&self) -> f64 {
        self.embedded.iter().map(|e| e.weakest).fold(1.0, f64::min)
    }

    /// Returns the number of independent rates of each aggregate, as its closures leave them.
    pub fn mobility(&self) -> impl Iterator<Item = usize> + '_ {
        self.embedded.iter().map(|e| e.n)
    }
}

/// Returns the larger value, or NaN if one is NaN.
pub(crate) fn nan_max(a: f64, b: f64) -> f64 {
    if a >= b || a.is_nan() { a } else { b }
}

impl Units {
    /// Performs the gather sweep (tips to base) at the state of the last [`kinematics`](crate::kinematics()), with the external forces and gravity of
    /// the workspace. `tau` and `vdot` as in [`forward_dynamics_given_kinematics`](crate::forward_dynamics_given_kinematics()): forces of free
    /// coordinates, accelerations of prescribed ones. `motions` are those of prescribed subhinges of loops
    /// ([`Multibody::motions`](linkwork_multibody::Multibody::motions)).
    ///
    /// # Errors
    /// [`DynamicsError::Singular`] if something free moves no inertia.
    pub fn gather(
        &self,
        tree: &Tree,
        ws: &mut Workspace,
        uw: &mut UnitsWork,
        tau: &[f64],
        vdot: &[f64],
        motions: &[LoopMotion],
    ) -> Result<(), DynamicsError> {
        check(motions.len(), tree.multibody().motions(), "motions");
        let w = &ws.work;
        self.places(tree, w, uw);
        for (u, unit) in self.units.iter().enumerate().rev() {
            let first = self.first[u] as usize;
            match unit {
                Unit::Link(k) if floating::floats(&tree.links[*k as usize]) => {
                    let k = *k as usize;
                    floating::eliminate(&tree.links[k], k, first, w, uw, tau)
                        .ok_or_else(|| tree.singular(k))?;
                }
                Unit::Link(k) => {
                    let k = *k as usize;
                    let link = &tree.links[k];
                    let (P, z) = match link.kind {
                        Kind::Pin => pin(link, k, first, w, uw, tau, vdot),
                        _ => hinge(link, k, first, w, uw, tau, vdot),
                    }
                    .ok_or_else(|| tree.singular(k))?;
                    if link.parent != 0 {
                        let (p, l) = (link.parent as usize, w.kin[k + 1].l);
                        uw.pass(p, &P.shifted(l), z.to_parent(l), self.writes[u]);
                    }
                }
                Unit::Aggregate(i) => {
                    let agg: &Aggregate = &self.aggregates[*i as usize];
                    self.eliminate(tree, w, uw, (u, *i as usize), first, tau, vdot, motions)
                        .ok_or_else(|| {
                            let v = agg.dofs.first().copied().unwrap_or(0);
                            tree.singular_at(agg.links[0] as usize, v as usize)
                        })?;
                }
            }
        }
        for (((s, e), D_inv), eps) in uw.s.iter_mut().zip(&mut uw.e).zip(&uw.D_inv).zip(&uw.eps) {
            *s = D_inv.sqrt();
            *e = *s * eps;
        }
        Ok(())
    }

    /// Computes positions and axes of all links.
    pub(super) fn places(&self, tree: &Tree, w: &Work<f64>, uw: &mut UnitsWork) {
        let Some(flex) = tree.flexible.as_deref() else {
            (0..tree.links.len()).for_each(|k| self.place_link(tree, k, w, uw));
            return;
        };
        for step in &flex.order {
            match *step {
                Step::Link(k) => self.place_link(tree, k, w, uw),
                Step::Set(i) => {
                    let set = &flex.sets[i];
                    for slot in (set.first..set.end).map(|s| flex.slot(s)) {
                        self.place(slot, set.base as usize, w, uw);
                    }
                }
            }
        }
    }

    /// Computes position and axes of a link.
    #[inline(always)]
    fn place_link(&self, tree: &Tree, k: usize, w: &Work<f64>, uw: &mut UnitsWork) {
        let (link, slot) = (&tree.links[k], k + 1);
        let r = self.place(slot, link.parent as usize, w, uw);
        let v = link.v as usize;
        for (j, S) in uw.S[v..v + link.kind.nv()].iter_mut().enumerate() {
            let own = axis(link.kind, link.pitch, &w.kin[slot], j);
            *S = V6 { n: own.n, f: r.cross_add(own.n, own.f) };
        }
    }

    /// Computes the position of a slot relative to the origin of its root.
    #[inline(always)]
    fn place(&self, slot: usize, parent: usize, w: &Work<f64>, uw: &mut UnitsWork) -> V3<f64> {
        let r = match (parent, self.root[slot] as usize) {
            (0, root) if root == slot => V3::default(),
            (0, root) => w.kin[slot].p - w.kin[root].p,
            (p, _) => uw.r[p] + w.kin[slot].l,
        };
        uw.r[slot] = r;
        r
    }

    /// Performs the scatter sweep (base to tips) after [`Units::gather`]: accelerations of free coordinates into `vdot`, forces of prescribed ones
    /// into `tau` (for links of aggregates see [`Units::constraint_forces`]). `y` is Eᵀλ of the rows' forces, one number per independent rate in the
    /// order of [`RowSet`](super::RowSet); empty for none.
    pub fn scatter(
        &self,
        tree: &Tree,
        ws: &mut Workspace,
        uw: &mut UnitsWork,
        y: &[f64],
        tau: &mut [f64],
        vdot: &mut [f64],
    ) {
        let last = self.independent.wrapping_sub(1);
        let pull = |w: usize| if y.is_empty() { 0.0 } else { y[last - w] };
        let acc = &mut ws.work.acc;
        for (u, unit) in self.units.iter().enumerate() {
            let first = self.first[u] as usize;
            match unit {
                Unit::Link(k) if floating::floats(&tree.links[*k as usize]) => {
                    let slot = *k as usize + 1;
                    let v = tree.links[*k as usize].v as usize;
                    let (K, S, eps) = (&uw.G[first..], &uw.S[v..], &uw.eps);
                    let x = |j: usize| eps[first + j] + pull(first + j);
                    let a = floating::moved(K, S, x, &mut vdot[v..v + floating::RATES]);
                    uw.alpha[slot] = a;
                    acc[slot] = a;
                }
                Unit::Link(k) => {
                    let link = &tree.links[*k as usize];
                    let slot = *k as usize + 1;
                    let mut a = uw.alpha[link.parent as usize];
                    let v = link.v as usize;
                    if link.parent == 0 {
                        a = V6::default();
                    }
                    for j in 0..link.kind.nv() {
                        let (i, w) = (v + j, first + j);
                        if link.coordinate == Coordinate::Free {
                            let x = uw.eps[w] * uw.D_inv[w] + uw.s[w] * pull(w);
                            vdot[i] = uw.G[w].dot_from(&a, x);
                            a = uw.S[i].scale_add(vdot[i], a);
                        } else {
                            a = uw.S[i].scale_add(vdot[i], a);
                            tau[i] = uw.U[w].dot(&a) + uw.eps[w] + link.armature * vdot[i];
                        }
                    }
                    uw.alpha[slot] = a;
                    acc[slot] = a.to_child(uw.r[slot]);
                }
                Unit::Aggregate(i) => {
                    self.spread(*i as usize, first, uw, acc, &pull, vdot);
                }
            }
        }
    }

    /// Computes changes of β from impulses only: M⁻¹Jᵀλ over the embedded constraints, from `y` = Eᵀλ. Prescribed coordinates get zero. Call
    /// [`Units::gather`] first.
    pub fn impulse(&self, tree: &Tree, uw: &mut UnitsWork, y: &[f64], dv: &mut [f64]) {
        let last = self.independent.wrapping_sub(1);
        for (u, unit) in self.units.iter().enumerate() {
            let first = self.first[u] as usize;
            match unit {
                Unit::Link(k) if floating::floats(&tree.links[*k as usize]) => {
                    let v = tree.links[*k as usize].v as usize;
                    let (K, S) = (&uw.G[first..], &uw.S[v..]);
                    let x = |j: usize| y[last - (first + j)];
                    let a = floating::moved(K, S, x, &mut dv[v..v + floating::RATES]);
                    uw.alpha[*k as usize + 1] = a;
                }
                Unit::Link(k) => {
                    let link = &tree.links[*k as usize];
                    let v = link.v as usize;
                    let mut a = match link.parent {
                        0 => V6::default(),
                        p => uw.alpha[p as usize],
                    };
                    for j in 0..link.kind.nv() {
                        let (i, w) = (v + j, first + j);
                        // √D⁻¹ and G are zero at prescribed dofs.
                        dv[i] = uw.G[w].dot_from(&a, uw.s[w] * y[last - w]);
                        a = uw.S[i].scale_add(dv[i], a);
                    }
                    uw.alpha[*k as usize + 1] = a;
                }
                Unit::Aggregate(i) => self.spread_impulse(*i as usize, first, uw, y, dv),
            }
        }
    }
}

/// Returns a column of H* about the link's own origin.
#[inline(always)]
pub(crate) fn axis(kind: Kind, pitch: f64, kin: &Kin<f64>, j: usize) -> V6<f64> {
    let (R, o) = (&kin.R, V3::default());
    match (kind, j) {
        (Kind::Pin, _) => V6 { n: R.z, f: o },
        (Kind::Slider, _) => V6 { n: o, f: R.z },
        (Kind::Screw, _) => V6 { n: R.z, f: R.z.scale(pitch) },
        (_, 0) => V6 { n: R.x, f: o },
        (_, 1) => V6 { n: R.y, f: o },
        (_, 2) => V6 { n: R.z, f: o },
        (_, 3) => V6 { n: o, f: R.x },
        (_, 4) => V6 { n: o, f: R.y },
        _ => V6 { n: o, f: R.z },
    }
}

/// Returns inertia and force of a link with everything that hangs on it, about its own origin.
#[inline(always)]
pub(crate) fn loaded(
    link: &Link,
    k: usize,
    w: &Work<f64>,
    uw: &UnitsWork,
) -> (Spatial<f64>, V6<f64>) {
    let (J, h, z) = rigid(link, &w.kin[k + 1], &w.f_ext[k + 1], w.gravity);
    let mut P = Spatial { I: J, H: M3::skew(h), M: S3::diagonal(link.m) };
    P.add(&uw.inertia[k + 1]);
    (P, z + uw.z[k + 1])
}

/// [`eliminate`] for a pin, the most frequent hinge.
#[inline(always)]
fn pin(
    link: &Link,
    k: usize,
    first: usize,
    w: &Work<f64>,
    uw: &mut UnitsWork,
    tau: &[f64],
    vdot: &[f64],
) -> Option<(Spatial<f64>, V6<f64>)> {
    eliminate((link, Kind::Pin), k, first, w, uw, tau, vdot)
}

/// [`eliminate`] for any hinge.
#[inline(never)]
fn hinge(
    link: &Link,
    k: usize,
    first: usize,
    w: &Work<f64>,
    uw: &mut UnitsWork,
    tau: &[f64],
    vdot: &[f64],
) -> Option<(Spatial<f64>, V6<f64>)> {
    eliminate((link, link.kind), k, first, w, uw, tau, vdot)
}

/// Eliminates the dofs of a link: P⁺ and z⁺ about its own origin; `None` if it moves no inertia.
#[inline(always)]
fn eliminate(
    (link, kind): (&Link, Kind),
    k: usize,
    first: usize,
    w: &Work<f64>,
    uw: &mut UnitsWork,
    tau: &[f64],
    vdot: &[f64],
) -> Option<(Spatial<f64>, V6<f64>)> {
    let (kin, r) = (&w.kin[k + 1], uw.r[k + 1]);
    let (mut P, mut z) = loaded(link, k, w, uw);
    let v = link.v as usize;
    let mut reach = 0.0;
    for j in (0..kind.nv()).rev() {
        let (i, at) = (v + j, first + j);
        let (U, D) = column(kind, link.pitch, kin, &P, j);
        let Sz = axis(kind, link.pitch, kin, j).dot(&z);
        if link.coordinate == Coordinate::Prescribed {
            uw.U[at] = U.to_parent(r);
            (uw.eps[at], uw.given[at], uw.D_inv[at]) = (Sz, vdot[i], 0.0);
            z = U.scale_add(vdot[i], z);
            continue;
        }
        let D = D + link.armature;
        if !(D > 0.0) {
            return None;
        }
        let (D_inv, eps) = (1.0 / D, tau[i] - Sz);
        let G = U.scaled(D_inv);
        (uw.eps[at], uw.D_inv[at], uw.G[at]) = (eps, D_inv, G.to_parent(r));
        reach += uw.S[i].dot(&uw.S[i]) * D_inv;
        if link.parent != 0 || j > 0 {
            z = G.scale_add(eps, z);
            P.downdate(G, U);
        }
    }
    uw.reach[k + 1] = reach;
    Some((P, z))
}
