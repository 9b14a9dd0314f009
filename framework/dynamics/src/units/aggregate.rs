//! An aggregate: the links of loops, eliminated as one unit (constraint embedding).
//!
//! With the independent rates that the closures of all its loops leave (`reduction.rs`):
//! ```text
//! β̇ = X β̇_r + x                                     X: unit rows at independent rates
//! H(k) = φ* H(p) + S X,   A(k) = φ* A(p) + S x        6 × n columns of each member
//! 𝓓 = Σ H* P H,   F = Σ φ P H,   ε = X* (T − armature x) − Σ H* (z + P A)
//! ```
//! Then, with the Cholesky factor 𝓓 = L L*, everything is expressed in terms of L* β̇_r:
//! ```text
//! X ← X L⁻*, H ← H L⁻*, F ← F L⁻*, ε ← L⁻¹ ε          so that 𝓓 = 1
//! P⁺ = Σ φ P φ* − F F*,   z⁺ = Σ φ (z + P A) + F ε
//! β̇_r = ε + y − F* α,   β̇ = X β̇_r + x,   α(k) = φ* α + H β̇_r + A
//! ```
//! Source: Jain, *Robot and Multibody Dynamics*, constraint embedding.

use super::dense::{cholesky, substitute};
use super::sweep::{axis, loaded, nan_max};
use super::{Aggregate, Units, UnitsWork};
use crate::articulated::Spatial;
use crate::linear::V6;
use crate::tree::Tree;
use crate::work::Work;
use linkwork_multibody::LoopMotion;

/// Data of an aggregate at a state.
#[derive(Clone, Debug, Default)]
pub(crate) struct Embedded {
    /// Number of independent rates.
    pub n: usize,
    /// Γ and right-hand side, reduced; `size + 1` numbers per row.
    pub gamma: Vec<f64>,
    /// Γ and right-hand side before the reduction.
    pub original: Vec<f64>,
    /// Row and column of each pivot.
    pub pivots: Vec<(usize, usize)>,
    /// X: one row per member dof, `size` numbers per row.
    pub X: Vec<f64>,
    pub x: Vec<f64>,
    /// 𝓓, then its Cholesky factor.
    pub D: Vec<f64>,
    /// Columns of each member about its own origin, `size` per member.
    pub H: Vec<V6<f64>>,
    /// Acceleration of each member due to x, about its own origin.
    pub A: Vec<V6<f64>>,
    /// Inertia and force of each member with everything that hangs on it.
    pub P: Vec<Spatial<f64>>,
    pub z: Vec<V6<f64>>,
    /// T of each member dof.
    pub tau: Vec<f64>,
    pub column: Vec<V6<f64>>,
    /// Γ* on the pivots and its right-hand side.
    pub square: Vec<f64>,
    pub lambda: Vec<f64>,
    pub force: Vec<V6<f64>>,
    /// L* β̇_r of the last scatter.
    pub rates: Vec<f64>,
    pub used: Vec<bool>,
    /// The largest |X|² of any member dof.
    pub reach: f64,
    /// The largest |S|² |w|² of each row; much smaller values are round-off.
    pub size: Vec<f64>,
    /// The largest number of each row at the last reduction, relative to that bound.
    pub part: Vec<f64>,
    pub inconsistency: f64,
    /// The smallest pivot of the last reduction, relative to the bound of its row; 1 without rows.
    pub weakest: f64,
}

impl Embedded {
    pub fn new(a: &Aggregate) -> Self {
        let (size, links) = (a.dofs.len(), a.links.len());
        Self {
            n: 0,
            gamma: vec![0.0; a.rows * (size + 1)],
            original: vec![0.0; a.rows * (size + 1)],
            pivots: Vec::with_capacity(a.rows),
            X: vec![0.0; size * size],
            x: vec![0.0; size],
            D: vec![0.0; size * size],
            H: vec![V6::default(); links * size],
            A: vec![V6::default(); links],
            P: vec![Spatial::default(); links],
            z: vec![V6::default(); links],
            tau: vec![0.0; size],
            column: vec![V6::default(); size],
            square: vec![0.0; a.rows.min(size) * (a.rows.min(size) + 1)],
            lambda: vec![0.0; a.rows],
            force: vec![V6::default(); links],
            rates: vec![0.0; size],
            used: vec![false; a.rows + size],
            size: vec![0.0; a.rows],
            part: vec![1.0; a.rows],
            reach: 0.0,
            inconsistency: 0.0,
            weakest: 1.0,
        }
    }
}

impl Spatial<f64> {
    /// Returns P V.
    #[inline(always)]
    pub fn apply(&self, V: &V6<f64>) -> V6<f64> {
        V6 { n: self.H.mul_add(V.f, self.I.mul(V.n)), f: self.H.tmul(V.n) + self.M.mul(V.f) }
    }
}

impl Units {
    /// Eliminates an aggregate and propagates it inward; `None` if something moves no inertia.
    pub(super) fn eliminate(
        &self,
        tree: &Tree,
        w: &Work<f64>,
        uw: &mut UnitsWork,
        (unit, which): (usize, usize),
        first: usize,
        tau: &[f64],
        vdot: &[f64],
        motions: &[LoopMotion],
    ) -> Option<()> {
        let mut all = std::mem::take(&mut uw.embedded);
        let m = &mut all[which];
        let moves = self.embed(tree, w, uw, m, (unit, which), first, tau, vdot, motions);
        uw.embedded = all;
        moves
    }

    #[inline(never)]
    fn embed(
        &self,
        tree: &Tree,
        w: &Work<f64>,
        uw: &mut UnitsWork,
        m: &mut Embedded,
        (unit, which): (usize, usize),
        first: usize,
        tau: &[f64],
        vdot: &[f64],
        motions: &[LoopMotion],
    ) -> Option<()> {
        let agg = &self.aggregates[which];
        let size = agg.dofs.len();
        self.closures(agg, w, uw, motions, m);
        let prescribed = |j: usize| {
            let v = agg.dofs[j] as usize;
            tree.dofs.prescribed[v].then(|| vdot[v])
        };
        self.reduce(agg, prescribed, m);
        let n = m.n;
        self.columns(agg, tree, w, m);
        let (base, arm) = match agg.parent {
            0 => (0, uw.r[agg.links[0] as usize]),
            p => (p as usize, uw.r[p as usize]),
        };
        let (mut P_sum, mut z_sum) = (Spatial::default(), V6::default());
        m.D.fill(0.0);
        m.column[..n].fill(V6::default());
        uw.eps[first..first + size].fill(0.0);
        for (place, slot) in agg.links.iter().enumerate() {
            let (P, z) = match tree.flexible.as_deref() {
                Some(flex) if *slot as usize > tree.links.len() => {
                    flex.loaded(*slot as usize, w, uw)
                }
                _ => {
                    let k = *slot as usize - 1;
                    loaded(&tree.links[k], k, w, uw)
                }
            };
            let z = z + P.apply(&m.A[place]);
            (m.P[place], m.z[place]) = (P, z);
            let l = uw.r[*slot as usize] - arm;
            P_sum.add(&P.shifted(l));
            z_sum = z_sum + z.to_parent(l);
            let H = &m.H[place * size..place * size + n];
            for (j, Hj) in H.iter().enumerate() {
                let PH = P.apply(Hj);
                m.column[j] = m.column[j] + PH.to_parent(l);
                for (i, Hi) in H[..=j].iter().enumerate() {
                    m.D[j * size + i] += Hi.dot(&PH);
                }
                uw.eps[first + j] -= Hj.dot(&z);
            }
        }
        let eps = &mut uw.eps[first..first + size];
        for (d, v) in agg.dofs.iter().enumerate() {
            let elastic = w.bend.elastic.get(*v as usize).copied().unwrap_or(0.0);
            let (armature, T) = (tree.dofs.armature[*v as usize], tau[*v as usize] - elastic);
            // T is unknown at prescribed members.
            m.tau[d] = if tree.dofs.prescribed[*v as usize] { 0.0 } else { T };
            let T = T - armature * m.x[d];
            let row = &m.X[d * size..d * size + n];
            for (j, Xj) in row.iter().enumerate() {
                eps[j] += Xj * T;
                for (i, Xi) in row[..=j].iter().enumerate() {
                    m.D[j * size + i] += armature * Xi * Xj;
                }
            }
        }
        if !cholesky(&mut m.D, size, n) {
            return None;
        }
        substitute(&m.D, size, &mut m.column[..n]);
        for (H, slot) in m.H.chunks_exact_mut(size.max(1)).zip(&agg.links) {
            substitute(&m.D, size, &mut H[..n]);
            uw.reach[*slot as usize] = H[..n].iter().map(|H| H.dot(H)).sum();
        }
        m.reach = 0.0;
        for X in m.X.chunks_exact_mut(size.max(1)) {
            substitute(&m.D, size, &mut X[..n]);
            m.reach = nan_max(m.reach, X[..n].iter().map(|x| x * x).sum());
        }
        substitute(&m.D, size, &mut eps[..n]);
        for j in 0..n {
            P_sum.downdate(m.column[j], m.column[j]);
            z_sum = m.column[j].scale_add(eps[j], z_sum);
        }
        for j in 0..size {
            let on = j < n;
            uw.D_inv[first + j] = f64::from(u8::from(on));
            uw.G[first + j] = if on { m.column[j].to_parent(arm) } else { V6::default() };
        }
        if base != 0 {
            uw.pass(base, &P_sum, z_sum, self.writes[unit]);
        }
        Some(())
    }

    /// Computes H and A of every member.
    #[inline(never)]
    fn columns(&self, agg: &Aggregate, tree: &Tree, w: &Work<f64>, m: &mut Embedded) {
        let (size, n) = (agg.dofs.len(), m.n);
        if let Some(flex) = tree.flexible.as_deref()
            && agg.links[0] as usize > tree.links.len()
        {
            // All modes are free for stations, and X is the unit matrix.
            for (place, slot) in agg.links.iter().enumerate() {
                let at = flex.station(*slot as usize).map_or(0, |s| flex.stations[s].column);
                m.H[place * size..(place + 1) * size].copy_from_slice(&w.bend.S[at..at + size]);
                m.A[place] = V6::default();
            }
            return;
        }
        for (place, slot) in agg.links.iter().enumerate() {
            let (link, kin) = (&tree.links[*slot as usize - 1], &w.kin[*slot as usize]);
            let (done, rest) = m.H.split_at_mut(place * size);
            let H = &mut rest[..n];
            let mut A = V6::default();
            match agg.inner[place] {
                None => H.fill(V6::default()),
                Some(p) => {
                    let p = p as usize;
                    for (to, from) in H.iter_mut().zip(&done[p * size..]) {
                        *to = from.to_child(kin.l);
                    }
                    A = m.A[p].to_child(kin.l);
                }
            }
            let first = agg.first[place] as usize;
            for j in 0..link.kind.nv() {
                let (S, d) = (axis(link.kind, link.pitch, kin, j), first + j);
                for (to, X) in H.iter_mut().zip(&m.X[d * size..]) {
                    if *X != 0.0 {
                        *to = S.scale_add(*X, *to);
                    }
                }
                A = S.scale_add(m.x[d], A);
            }
            m.A[place] = A;
        }
    }

    /// Performs the scatter sweep (base to tips) through an aggregate: accelerations from forces.
    pub(super) fn spread(
        &self,
        which: usize,
        first: usize,
        uw: &mut UnitsWork,
        acc: &mut [V6<f64>],
        pull: &impl Fn(usize) -> f64,
        vdot: &mut [f64],
    ) {
        let m = &mut uw.embedded[which];
        for (j, rate) in m.rates[..m.n].iter_mut().enumerate() {
            *rate = uw.eps[first + j] + pull(first + j);
        }
        self.carry(which, first, uw, Carried::Motion, vdot, |slot, own| acc[slot] = own);
    }

    /// Computes changes of rates from impulses only.
    pub(super) fn spread_impulse(
        &self,
        which: usize,
        first: usize,
        uw: &mut UnitsWork,
        y: &[f64],
        dv: &mut [f64],
    ) {
        let (m, last) = (&mut uw.embedded[which], self.independent - 1);
        for (j, rate) in m.rates[..m.n].iter_mut().enumerate() {
            *rate = y[last - (first + j)];
        }
        self.carry(which, first, uw, Carried::Impulse, dv, |_, _| {});
    }

    /// Converts the driving terms of the independent rates (in `rates`) to the rates of all members, in `out`, and the motion of each member about
    /// its own origin, in `own`.
    fn carry(
        &self,
        which: usize,
        first: usize,
        uw: &mut UnitsWork,
        carried: Carried,
        out: &mut [f64],
        mut own: impl FnMut(usize, V6<f64>),
    ) {
        let agg = &self.aggregates[which];
        let (m, size) = (&mut uw.embedded[which], agg.dofs.len());
        let a = match agg.parent {
            0 => V6::default(),
            p => uw.alpha[p as usize],
        };
        let (n, moves) = (m.n, carried == Carried::Motion);
        for (rate, G) in m.rates[..n].iter_mut().zip(&uw.G[first..]) {
            *rate = G.dot_from(&a, *rate);
        }
        for (d, v) in agg.dofs.iter().enumerate() {
            let X = &m.X[d * size..d * size + n];
            let x = if moves { m.x[d] } else { 0.0 };
            out[*v as usize] = m.rates[..n].iter().zip(X).fold(x, |s, (r, x)| s + r * x);
        }
        for (place, slot) in agg.links.iter().enumerate() {
            let slot = *slot as usize;
            let mut A = a.to_child(uw.r[slot]);
            if moves {
                A = A + m.A[place];
            }
            for (H, rate) in m.H[place * size..].iter().zip(&m.rates[..n]) {
                A = H.scale_add(*rate, A);
            }
            own(slot, A);
            uw.alpha[slot] = A.to_child(-uw.r[slot]);
        }
    }
}

/// Quantity that propagates outward through an aggregate.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Carried {
    /// Accelerations, including those that the closures require.
    Motion,
    /// Changes of rates, to which the closures do not contribute.
    Impulse,
}
