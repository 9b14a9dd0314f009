//! Constraints of aggregates: their forces, errors, redundant rows, and the corrections that close them.
//!
//! ```text
//! P α + z = T + Γ* λ                         balance of member dofs: λ on the pivots of Γ
//! Γ_d Δ = −d,  Γ_d Δβ = −ḋ                   corrections of dependent members only
//! ```

use super::closure::BlockRows;
use super::dense::eliminate_dense;
use super::sweep::nan_max;
use super::{Units, UnitsWork};
use crate::linear::V6;
use crate::tree::Tree;
use crate::work::Workspace;
use linkwork_multibody::{ConstraintId, LoopMotion};

impl Units {
    /// Computes the forces of the embedded constraints after [`Units::scatter`](Units::scatter), and passes each with the numbers of its rows (N or N
    /// m; a row acts along its wrench on body B). Of redundant rows only the first carries force. Forces of prescribed members are written to `tau`.
    ///
    /// They follow from the balance of each member dof, P α + z = T + Γ* λ.
    pub fn constraint_forces(
        &self,
        tree: &Tree,
        uw: &mut UnitsWork,
        vdot: &[f64],
        tau: &mut [f64],
        mut out: impl FnMut(ConstraintId, &[f64]),
    ) {
        for (agg, m) in self.aggregates.iter().zip(&mut uw.embedded) {
            if agg.constraints.is_empty() {
                continue;
            }
            let (wide, r) = (agg.dofs.len() + 1, m.pivots.len());
            // Compute the force on each member and everything outboard of it; then add T + Γ* λ to the array of
            // rates.
            for (place, slot) in agg.links.iter().enumerate() {
                let own = uw.alpha[*slot as usize].to_child(uw.r[*slot as usize]);
                m.force[place] = m.P[place].apply(&(own + minus(m.A[place]))) + m.z[place];
            }
            for place in (0..agg.links.len()).rev() {
                let slot = agg.links[place] as usize;
                let first = agg.first[place] as usize;
                let link = &tree.links[slot - 1];
                for j in 0..link.kind.nv() {
                    let (d, S) = (first + j, &uw.S[link.v as usize + j]);
                    let about = m.force[place].to_parent(uw.r[slot]);
                    let armature = link.armature * vdot[agg.dofs[d] as usize];
                    m.rates[d] = S.dot(&about) + armature;
                }
                if let Some(p) = agg.inner[place] {
                    let l = uw.r[slot] - uw.r[agg.links[p as usize] as usize];
                    let inner = m.force[place].to_parent(l);
                    m.force[p as usize] = m.force[p as usize] + inner;
                }
            }
            for (a, (_, d)) in m.pivots.iter().enumerate() {
                for (b, (i, _)) in m.pivots.iter().enumerate() {
                    m.square[a * (r + 1) + b] = m.original[i * wide + d];
                }
                m.square[a * (r + 1) + r] = m.rates[*d] - m.tau[*d];
            }
            eliminate_dense(&mut m.square, r);
            m.lambda.fill(0.0);
            for (a, (i, _)) in m.pivots.iter().enumerate() {
                m.lambda[*i] = m.square[a * (r + 1) + r];
            }
            for (d, v) in agg.dofs.iter().enumerate() {
                if tree.dofs.prescribed[*v as usize] {
                    let pull = (0..agg.rows).map(|i| m.original[i * wide + d] * m.lambda[i]);
                    tau[*v as usize] = m.rates[d] - m.tau[d] - pull.sum::<f64>();
                }
            }
            let mut row = 0;
            for c in &agg.constraints {
                let n = tree.multibody().rows(*c);
                out(*c, &m.lambda[row..row + n]);
                row += n;
            }
        }
    }

    /// Computes corrections of the members' coordinates (as small changes `dv` along β) that close every aggregate to first order and do not change
    /// the independent ones. Returns the largest error before, rad or m. With `rates`, the errors are those of rates, and `dv` corrects β.
    pub fn close(
        &self,
        tree: &Tree,
        ws: &Workspace,
        uw: &mut UnitsWork,
        motions: &[LoopMotion],
        (q, v): (&[f64], &[f64]),
        level: Level,
        dv: &mut [f64],
    ) -> f64 {
        let w = &ws.work;
        self.places(tree, w, uw);
        let mut worst = 0.0;
        for (which, agg) in self.aggregates.iter().enumerate() {
            if agg.constraints.is_empty() {
                continue;
            }
            let mut all = std::mem::take(&mut uw.embedded);
            let m = &mut all[which];
            self.closures(agg, w, uw, motions, m);
            let wide = agg.dofs.len() + 1;
            let mut row = 0;
            for c in &agg.constraints {
                let mut put = |n: usize, x: f64| {
                    worst = nan_max(worst, x.abs());
                    m.original[(row + n) * wide + wide - 1] = -x;
                };
                match c {
                    ConstraintId::Loop(i) => {
                        let closure = &self.closures[*i as usize];
                        let ends = closure.ends(&w.kin, &uw.r, &self.root);
                        let mut at = 0;
                        for block in &closure.blocks {
                            let rows = block.rows(&ends, motions);
                            let lack = if level == Level::Rate { rows.rate } else { rows.error };
                            lack[..rows.n].iter().enumerate().for_each(|(n, x)| put(at + n, *x));
                            at += rows.n;
                        }
                    }
                    ConstraintId::Coupling(i) => {
                        let c = &tree.multibody().couplings()[*i as usize];
                        put(0, if level == Level::Rate { c.rate(q, v) } else { c.error(q) });
                    }
                }
                row += tree.multibody().rows(*c);
            }
            let still = |j: usize| tree.dofs.prescribed[agg.dofs[j] as usize].then_some(0.0);
            self.reduce(agg, still, m);
            for (d, x) in agg.dofs.iter().zip(&m.x) {
                dv[*d as usize] = *x;
            }
            uw.embedded = all;
        }
        worst
    }
}

impl Units {
    /// Calls `f` with d (rad or m) and ḋ of each row of a loop in turn, at the kinematics of `ws`.
    pub fn loop_errors(
        &self,
        tree: &Tree,
        ws: &Workspace,
        uw: &mut UnitsWork,
        which: usize,
        motions: &[LoopMotion],
        mut f: impl FnMut(f64, f64),
    ) {
        self.places(tree, &ws.work, uw);
        let closure = &self.closures[which];
        let ends = closure.ends(&ws.work.kin, &uw.r, &self.root);
        for block in &closure.blocks {
            let rows = block.rows(&ends, motions);
            (0..rows.n).for_each(|k| f(rows.error[k], rows.rate[k]));
        }
    }

    /// Returns the largest |d| of a constraint's rows, rad or m, at the kinematics of `ws` and the positions of the last gather in `uw`.
    pub fn error(
        &self,
        tree: &Tree,
        ws: &Workspace,
        uw: &UnitsWork,
        constraint: ConstraintId,
        motions: &[LoopMotion],
        q: &[f64],
    ) -> f64 {
        match constraint {
            ConstraintId::Loop(i) => {
                let closure = &self.closures[i as usize];
                let ends = closure.ends(&ws.work.kin, &uw.r, &self.root);
                let greatest = |worst, rows: BlockRows| {
                    rows.error[..rows.n].iter().fold(worst, |a, x| nan_max(a, x.abs()))
                };
                let blocks = closure.blocks.iter().map(|block| block.rows(&ends, motions));
                blocks.fold(0.0, greatest)
            }
            ConstraintId::Coupling(i) => tree.multibody().couplings()[i as usize].error(q).abs(),
        }
    }
}

impl Units {
    /// Calls `f` for each row of an embedded constraint that was redundant at the last gather, with the amount by which it contradicts the other rows
    /// (as in [`UnitsWork::inconsistency`]).
    pub fn implied(&self, tree: &Tree, uw: &UnitsWork, mut f: impl FnMut(ConstraintId, f64)) {
        for (agg, m) in self.aggregates.iter().zip(&uw.embedded) {
            let mut row = 0;
            for c in &agg.constraints {
                for _ in 0..tree.multibody().rows(*c) {
                    m.implied(row).into_iter().for_each(|by| f(*c, by));
                    row += 1;
                }
            }
        }
    }
}

/// Selects coordinates or rates.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Level {
    /// q.
    Position,
    /// β.
    Rate,
}

fn minus(a: V6<f64>) -> V6<f64> {
    V6 { n: -a.n, f: -a.f }
}
