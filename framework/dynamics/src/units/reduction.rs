//! The closures of an aggregate at a state, and the member rates that they leave independent.
//!
//! g(β̇) = Γ β̇ + bias = 0 is solved by Gauss–Jordan elimination with complete pivoting over free members:
//! ```text
//! [Γ | −bias], each row divided by its largest number
//! pivot (i, d):  row i ← row i / Γ_id,   other rows ← row − Γ_·d row i
//! β̇_d = −Σ Γ_ij β̇_j + right-hand side_i             j independent
//! ```
//! The independent rates are chosen again at every state. Near a singularity of one choice another one is used, and the result depends only on the
//! state.

use super::aggregate::Embedded;
use super::sweep::nan_max;
use super::{Aggregate, Units, UnitsWork};
use crate::work::Work;
use linkwork_multibody::{ConstraintId, LoopMotion};
use wide::f64x4;

/// Rows, scaled to one, whose pivot is below this count as redundant.
pub(crate) const REDUNDANT: f64 = 1e-9;

impl Embedded {
    /// Returns the amount by which a row contradicts the others, if it was redundant at the last reduction.
    pub(super) fn implied(&self, row: usize) -> Option<f64> {
        let wide = self.X.len().isqrt() + 1;
        let pivot = self.pivots.iter().any(|(i, _)| *i == row);
        (!pivot).then(|| self.gamma[row * wide + wide - 1].abs())
    }
}

impl Units {
    /// Computes Γ | −bias of an aggregate.
    pub(super) fn closures(
        &self,
        agg: &Aggregate,
        w: &Work<f64>,
        uw: &UnitsWork,
        motions: &[LoopMotion],
        m: &mut Embedded,
    ) {
        let wide = agg.dofs.len() + 1;
        let (out, size) = (&mut m.original, &mut m.size);
        out.fill(0.0);
        size.fill(0.0);
        let mut row = 0;
        for c in &agg.constraints {
            match c {
                ConstraintId::Coupling(i) => {
                    for (slot, v, factor) in &self.couplings[*i as usize] {
                        let place = self.member[*slot as usize] as usize;
                        let from = &agg.dofs[agg.first[place] as usize..];
                        let at = from.iter().position(|d| d == v).unwrap_or(0);
                        out[row * wide + agg.first[place] as usize + at] = *factor;
                    }
                    row += 1;
                }
                ConstraintId::Loop(i) => {
                    let closure = &self.closures[*i as usize];
                    let ends = closure.ends(&w.kin, &uw.r, &self.root);
                    for block in &closure.blocks {
                        let rows = block.rows(&ends, motions);
                        for n in 0..rows.n {
                            out[(row + n) * wide + wide - 1] = -rows.bias[n];
                        }
                        for (end, sign) in [(0, -1.0), (1, 1.0)] {
                            let mut slot = closure.slots[end];
                            let arm = uw.r[slot as usize] + ends.arms[end];
                            let about = rows.wrench.to_parent(arm.block());
                            let square = about.dot(&about);
                            while slot != agg.parent {
                                let place = self.member[slot as usize] as usize;
                                let first = agg.first[place] as usize;
                                let last =
                                    agg.first.get(place + 1).map_or(wide - 1, |f| *f as usize);
                                for j in first..last {
                                    let S = &uw.S[agg.dofs[j] as usize];
                                    let bound = square * f64x4::splat(S.dot(S));
                                    let through = S.block().dot(&about);
                                    for n in 0..rows.n {
                                        let bound = bound.as_array()[n];
                                        size[row + n] = nan_max(size[row + n], bound);
                                        out[(row + n) * wide + j] += sign * through.as_array()[n];
                                    }
                                }
                                slot =
                                    agg.inner[place].map_or(agg.parent, |p| agg.links[p as usize]);
                            }
                        }
                        row += rows.n;
                    }
                }
            }
        }
    }

    /// Computes X and x from Γ; `prescribed[j]` contains the given rate of member dof j.
    #[inline(never)]
    pub(super) fn reduce(
        &self,
        agg: &Aggregate,
        free: impl Fn(usize) -> Option<f64>,
        m: &mut Embedded,
    ) {
        let (size, rows) = (agg.dofs.len(), agg.rows);
        let wide = size + 1;
        m.gamma.copy_from_slice(&m.original);
        m.pivots.clear();
        let (used_rows, used_columns) = m.used.split_at_mut(rows);
        used_rows.fill(false);
        for (j, used) in used_columns.iter_mut().enumerate() {
            *used = false;
            if let Some(given) = free(j) {
                *used = true;
                for row in m.gamma.chunks_exact_mut(wide) {
                    row[size] -= row[j] * given;
                    row[j] = 0.0;
                }
            }
        }
        let bounds = m.size.iter().zip(&mut m.part);
        for (row, (bound, part)) in m.gamma.chunks_exact_mut(wide).zip(bounds) {
            let greatest = row[..size].iter().fold(0.0, |a, x| nan_max(a, x.abs()));
            // If the terms of a row cancel, for example because links are in line, its largest entry is far below the
            // bound. Couplings do not have a bound.
            *part = if *bound > 0.0 { greatest / bound.sqrt() } else { 1.0 };
            if greatest <= REDUNDANT * bound.sqrt() {
                row[..size].fill(0.0);
            } else {
                row.iter_mut().for_each(|x| *x /= greatest);
            }
        }
        m.weakest = 1.0;
        loop {
            let mut best = (REDUNDANT, usize::MAX, 0);
            for (i, row) in m.gamma.chunks_exact(wide).enumerate() {
                if used_rows[i] {
                    continue;
                }
                for (j, (x, used)) in row.iter().zip(used_columns.iter()).enumerate() {
                    if x.abs() > best.0 && !used {
                        best = (x.abs(), i, j);
                    }
                }
            }
            let (pivot, i, j) = best;
            if i == usize::MAX {
                break;
            }
            m.weakest = m.weakest.min(pivot * m.part[i]);
            (used_rows[i], used_columns[j]) = (true, true);
            m.pivots.push((i, j));
            let inverse = 1.0 / m.gamma[i * wide + j];
            m.gamma[i * wide..(i + 1) * wide].iter_mut().for_each(|x| *x *= inverse);
            let (before, rest) = m.gamma.split_at_mut(i * wide);
            let (pivot, after) = rest.split_at_mut(wide);
            for row in before.chunks_exact_mut(wide).chain(after.chunks_exact_mut(wide)) {
                let factor = row[j];
                if factor != 0.0 {
                    row.iter_mut().zip(pivot.iter()).for_each(|(x, p)| *x -= factor * p);
                }
            }
        }
        let left = (0..rows).filter(|i| !used_rows[*i]).map(|i| m.gamma[i * wide + size].abs());
        m.inconsistency = left.fold(0.0, nan_max);
        m.X.fill(0.0);
        m.x.fill(0.0);
        m.n = 0;
        for j in 0..size {
            if !used_columns[j] {
                m.X[j * size + m.n] = 1.0;
                for (i, d) in &m.pivots {
                    m.X[d * size + m.n] = -m.gamma[i * wide + j];
                }
                m.n += 1;
            } else if let Some(given) = free(j) {
                m.x[j] = given;
            }
        }
        for (i, d) in &m.pivots {
            m.x[*d] = m.gamma[i * wide + size];
        }
    }
}
