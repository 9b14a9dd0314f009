//! Generalized forces through factored units: M⁻¹ x without accelerations.
//!
//! ```text
//! ε = x − S · z,   z⁺ = z + G ε                    inward
//! aggregates: ε = X* x − Σ H* z                     their members' z about their own origins
//! y = D^{−1/2} ε                                    [`Units::impulse`] of it is M⁻¹ x
//! ```

use super::rows::WIDTH;
use super::{Unit, Units, UnitsWork, floating};
use crate::linear::{V3, V6};
use crate::tree::Tree;
use crate::work::Workspace;
use linkwork_multibody::LoopMotion;
use wide::f64x4;

impl Units {
    /// Adds the forces λ of a loop's rows (N or N m, one per row) to the external forces of the workspace: along each row's wrench on body B and
    /// against it on body A, at the state of the last [`Units::gather`]. `which` is the loop's index in
    /// [`Multibody::loops`](linkwork_multibody::Multibody::loops).
    pub fn add_loop_forces(
        &self,
        ws: &mut Workspace,
        uw: &UnitsWork,
        which: usize,
        lambda: &[f64],
        motions: &[LoopMotion],
    ) {
        let closure = &self.closures[which];
        let ends = closure.ends(&ws.work.kin, &uw.r, &self.root);
        let mut at = 0;
        for block in &closure.blocks {
            let rows = block.rows(&ends, motions);
            let mut x = [0.0; WIDTH];
            x[..rows.n].copy_from_slice(&lambda[at..at + rows.n]);
            at += rows.n;
            let x = f64x4::new(x);
            let sum = |a: &V3<f64x4>| {
                V3::new((a.x * x).reduce_add(), (a.y * x).reduce_add(), (a.z * x).reduce_add())
            };
            let on_b = V6 { n: sum(&rows.wrench.n), f: sum(&rows.wrench.f) };
            let on_a = V6 { n: -on_b.n, f: -on_b.f };
            for ((slot, arm), wrench) in closure.slots.iter().zip(ends.arms).zip([on_a, on_b]) {
                if *slot != 0 {
                    let to = &mut ws.work.f_ext[*slot as usize];
                    *to = *to + wrench.to_parent(arm);
                }
            }
        }
    }

    /// Computes the effect of forces x (nv) at the independent rates, `y` in the order of [`RowSet`](super::RowSet). The length of the difference of
    /// two such y is the length of the difference of their forces in the metric of M⁻¹. Call [`Units::gather`] first; afterwards its result can be
    /// used only for products.
    pub fn pull_forces(&self, tree: &Tree, uw: &mut UnitsWork, x: &[f64], y: &mut [f64]) {
        let last = self.independent.wrapping_sub(1);
        uw.z.fill(V6::default());
        for (u, unit) in self.units.iter().enumerate().rev() {
            let first = self.first[u] as usize;
            let z = match unit {
                Unit::Link(k) if floating::floats(&tree.links[*k as usize]) => {
                    let v = tree.links[*k as usize].v as usize;
                    let f = floating::driven(&uw.S[v..], &x[v..], &uw.z[*k as usize + 1]);
                    for (j, e) in floating::pulled(&uw.G[first..], &f).into_iter().enumerate() {
                        y[last - (first + j)] = e;
                    }
                    continue;
                }
                Unit::Link(k) => {
                    let link = &tree.links[*k as usize];
                    let mut z = uw.z[*k as usize + 1];
                    for j in (0..link.kind.nv()).rev() {
                        let (i, w) = (link.v as usize + j, first + j);
                        // G and s are zero at prescribed dofs.
                        let eps = x[i] - uw.S[i].dot(&z);
                        y[last - w] = uw.s[w] * eps;
                        z = uw.G[w].scale_add(eps, z);
                    }
                    z
                }
                Unit::Aggregate(i) => self.pull_aggregate(*i as usize, first, uw, x, y),
            };
            let parent = self.parent_slot(tree, u) as usize;
            uw.z[parent] = uw.z[parent] + z;
        }
    }

    /// Does the same through an aggregate; returns z about the root's origin.
    fn pull_aggregate(
        &self,
        which: usize,
        first: usize,
        uw: &mut UnitsWork,
        x: &[f64],
        y: &mut [f64],
    ) -> V6<f64> {
        let (agg, m) = (&self.aggregates[which], &uw.embedded[which]);
        let (size, last) = (agg.dofs.len(), self.independent.wrapping_sub(1));
        let mut sum = V6::default();
        for j in 0..size {
            y[last - (first + j)] = 0.0;
        }
        for (place, slot) in agg.links.iter().enumerate() {
            let slot = *slot as usize;
            let own = uw.z[slot].to_parent(-uw.r[slot]);
            sum = sum + uw.z[slot];
            for j in 0..m.n {
                y[last - (first + j)] -= m.H[place * size + j].dot(&own);
            }
        }
        for (d, v) in agg.dofs.iter().enumerate() {
            for j in 0..m.n {
                y[last - (first + j)] += m.X[d * size + j] * x[*v as usize];
            }
        }
        for j in 0..m.n {
            sum = uw.G[first + j].scale_add(y[last - (first + j)], sum);
        }
        sum
    }
}
