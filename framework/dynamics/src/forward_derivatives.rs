//! Derivatives of forward dynamics.
//!
//! ```text
//! ∂β̇/∂q = −M⁻¹ ∂τ/∂q,   ∂β̇/∂β = −M⁻¹ ∂τ/∂β,   ∂β̇/∂τ = M⁻¹        at β̇ = forward dynamics
//! ```
//! Small matrices are multiplied; for large ones M⁻¹ is applied by its two sweeps, which take 24
//! multiply-adds a number whatever nv, on a few blocks of columns at a time so that what goes along
//! the tree stays in the nearest cache.

use crate::derivatives::Derivatives;
use crate::error::DynamicsError;
use crate::forward;
use crate::inverse_mass;
use crate::kinematics::check;
use crate::lane::Lane;
use crate::linear::V6;
use crate::tree::Tree;
use crate::work::{Work, Workspace};

/// Blocks of columns that go along the tree together.
pub(crate) const CHUNK: usize = 8;

/// Up to this many coordinates the product is dense.
const DENSE: usize = 24;

impl Derivatives {
    /// ∂β̇/∂q, ∂β̇/∂β and ∂β̇/∂τ (nv × nv each, row after row) of
    /// [`forward_dynamics`](crate::forward_dynamics) at the state of the last
    /// [`kinematics`](crate::kinematics()), whose rates are `v`. `tau` and `vdot` are read and
    /// written as there. Rows of prescribed coordinates are zero: their accelerations are given.
    ///
    /// # Errors
    /// [`DynamicsError::Singular`] if a free subhinge has nothing to move.
    pub fn forward_dynamics(
        &mut self,
        tree: &Tree,
        ws: &mut Workspace,
        v: &[f64],
        tau: &mut [f64],
        vdot: &mut [f64],
        out: ForwardDerivatives<'_>,
    ) -> Result<(), DynamicsError> {
        check(v.len(), tree.nv(), "v");
        check(tau.len(), tree.nv(), "tau");
        check(vdot.len(), tree.nv(), "vdot");
        self.forward(tree, &mut ws.work, v, tau, vdot, out)
    }
}

/// Where the derivatives of forward dynamics go: nv × nv each, row after row.
#[derive(Debug)]
pub struct ForwardDerivatives<'a, L = f64> {
    /// ∂β̇/∂q, along β.
    pub dvdot_dq: &'a mut [L],
    /// ∂β̇/∂β.
    pub dvdot_dv: &'a mut [L],
    /// ∂β̇/∂τ = M⁻¹.
    pub dvdot_dtau: &'a mut [L],
}

impl<L: Lane> Derivatives<L> {
    pub(crate) fn forward(
        &mut self,
        tree: &Tree,
        w: &mut Work<L>,
        v: &[L],
        tau: &mut [L],
        vdot: &mut [L],
        out: ForwardDerivatives<'_, L>,
    ) -> Result<(), DynamicsError> {
        let n = tree.nv();
        check(out.dvdot_dq.len(), n * n, "dvdot_dq");
        check(out.dvdot_dv.len(), n * n, "dvdot_dv");
        check(out.dvdot_dtau.len(), n * n, "dvdot_dtau");
        forward::run(tree, w, tau, vdot)?;
        self.run(tree, w, v, vdot);
        inverse_mass::matrix(tree, w, out.dvdot_dtau)?;
        if n <= DENSE {
            self.multiply(n, out.dvdot_dtau)
        } else {
            self.sweep(tree, w)
        }
        self.copy(n, out.dvdot_dq, out.dvdot_dv);
        Ok(())
    }

    /// rows ← −M⁻¹ rows, densely.
    fn multiply(&mut self, n: usize, inverse: &[L]) {
        if n == 0 {
            return;
        }
        let width = 2 * n.div_ceil(L::PACK);
        let mut column = [L::Block::default(); DENSE];
        for b in 0..width {
            for (k, x) in column[..n].iter_mut().enumerate() {
                *x = self.rows[k * width + b];
            }
            for (i, inverse) in inverse.chunks_exact(n).enumerate() {
                let mut sum = L::Block::default();
                for (m, x) in inverse.iter().zip(&column[..n]) {
                    sum = m.block().fnma(*x, sum);
                }
                self.rows[i * width + b] = sum;
            }
        }
    }

    /// rows ← −M⁻¹ rows by sweeps.
    fn sweep(&mut self, tree: &Tree, w: &Work<L>) {
        let width = 2 * tree.nv().div_ceil(L::PACK);
        for start in (0..width).step_by(CHUNK) {
            let end = (start + CHUNK).min(width);
            self.gather(tree, w, width, start..end);
            self.scatter(tree, w, width, start..end);
        }
    }

    /// rows ← D⁻¹ [1 − HψK] rows, for some blocks of columns.
    fn gather(&mut self, tree: &Tree, w: &Work<L>, width: usize, range: std::ops::Range<usize>) {
        let (dofs, n) = (&tree.dofs, range.len());
        for i in (0..tree.nv()).rev() {
            let level = dofs.level[i] as usize;
            let (inboard, here) = self.sweep.split_at_mut(level * CHUNK);
            let z = &mut here[..n];
            if dofs.end[i] as usize == i + 1 {
                z.fill(V6::default());
            }
            let (S, G, D_inv) = (w.S.get(i).block(), w.G.get(i).block(), w.D_inv[i].block());
            for (x, z) in self.rows[i * width..][range.clone()].iter_mut().zip(z.iter_mut()) {
                let eps = *x - S.dot(z);
                *x = eps * D_inv;
                *z = G.scale_add(eps, *z);
            }
            if !dofs.last_child[i] && dofs.parent[i] > 0 {
                let to = &mut inboard[dofs.level[dofs.parent[i] as usize - 1] as usize * CHUNK..];
                for (to, z) in to.iter_mut().zip(z) {
                    *to = *to + *z;
                }
            }
        }
    }

    /// rows ← −[1 − HψK]* rows.
    fn scatter(&mut self, tree: &Tree, w: &Work<L>, width: usize, range: std::ops::Range<usize>) {
        let (dofs, n) = (&tree.dofs, range.len());
        for i in 0..tree.nv() {
            let level = dofs.level[i] as usize;
            let (inboard, here) = self.sweep.split_at_mut(level * CHUNK);
            let a = &mut here[..n];
            if dofs.parent[i] == 0 {
                a.fill(V6::default());
            } else if !dofs.last_child[i] {
                let from = dofs.level[dofs.parent[i] as usize - 1] as usize * CHUNK;
                a.copy_from_slice(&inboard[from..from + n]);
            }
            let (S, G) = (w.S.get(i).block(), w.G.get(i).block());
            for (x, a) in self.rows[i * width..][range.clone()].iter_mut().zip(a) {
                let acc = *x - G.dot(a);
                *x = -acc;
                *a = S.scale_add(acc, *a);
            }
        }
    }
}
