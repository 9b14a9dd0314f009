//! Derivatives of forward dynamics.
//!
//! ```text
//! ∂β̇/∂q = −M⁻¹ ∂τ/∂q,   ∂β̇/∂β = −M⁻¹ ∂τ/∂β,   ∂β̇/∂τ = M⁻¹        at β̇ = forward dynamics
//! ```
//! The acceleration is M⁻¹ times the difference of the given forces and those for β̇ = 0. A block of columns of ∂τ is nonzero only in the rows
//! inboard and outboard of it. If these are few, they are multiplied with columns of M⁻¹. Otherwise M⁻¹ is applied by its two sweeps, which take 24
//! multiply-adds per number for any nv.

use crate::derivatives::Derivatives;
use crate::dofs::WIDEST;
use crate::error::DynamicsError;
use crate::kinematics::check;
use crate::lane::Lane;
use crate::tree::Tree;
use crate::work::{Work, Workspace};
use crate::{articulated, inverse, inverse_mass};

/// Average number of rows per block up to which columns of M⁻¹ are faster than sweeps.
const FEW: usize = 24;

impl Derivatives {
    /// Computes ∂β̇/∂q, ∂β̇/∂β and ∂β̇/∂τ (nv × nv each, row after row) of [`forward_dynamics`](crate::forward_dynamics) at the state of the last
    /// [`kinematics`](crate::kinematics()) with the rates `v`. `tau` and `vdot` are read and written as in that function. Rows of prescribed
    /// coordinates are zero, because their accelerations are given.
    ///
    /// # Errors
    /// [`DynamicsError::Singular`] if a free subhinge moves no inertia; [`DynamicsError::Flexible`].
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

/// Output matrices of the derivatives of forward dynamics: nv × nv each, row after row.
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
        tree.check_rigid("derivatives")?;
        let n = tree.nv();
        check(out.dvdot_dq.len(), n * n, "dvdot_dq");
        check(out.dvdot_dv.len(), n * n, "dvdot_dv");
        check(out.dvdot_dtau.len(), n * n, "dvdot_dtau");
        inverse_mass::matrix(tree, w, out.dvdot_dtau)?;
        self.accelerations(tree, w, tau, vdot);
        self.run(tree, w, v, vdot);
        self.prescribed_forces(tree, w, tau, vdot);
        let meets = &tree.dofs.meets;
        let rows: usize = meets.iter().flatten().map(std::ops::Range::len).sum();
        if rows <= FEW * meets.len() {
            self.multiply(tree, out.dvdot_dtau);
        } else {
            self.sweep(tree, w);
        }
        self.copy(n, out.dvdot_dq, out.dvdot_dv);
        Ok(())
    }

    /// Computes β̇ at free coordinates with the articulated-body inertias of the last factorization.
    fn accelerations(&mut self, tree: &Tree, w: &mut Work<L>, tau: &[L], vdot: &mut [L]) {
        let fixed = &tree.dofs.prescribed;
        for (x, _) in vdot.iter_mut().zip(fixed).filter(|(_, fixed)| !**fixed) {
            *x = L::default();
        }
        let mut rest = std::mem::take(&mut self.bias);
        inverse::run(&tree.links, w, vdot, &mut rest);
        for (rest, tau) in rest.iter_mut().zip(tau) {
            *rest = *tau - *rest;
        }
        articulated::solve(tree, w, &mut rest);
        for ((x, rest), _) in vdot.iter_mut().zip(&rest).zip(fixed).filter(|(_, fixed)| !**fixed) {
            *x = *rest;
        }
        self.bias = rest;
    }

    /// Computes τ at prescribed coordinates from the forces summed for the derivatives.
    fn prescribed_forces(&self, tree: &Tree, w: &Work<L>, tau: &mut [L], vdot: &[L]) {
        let dofs = &tree.dofs;
        for i in (0..tree.nv()).filter(|i| dofs.prescribed[*i]) {
            let f = self.force(i);
            tau[i] = L::splat(dofs.armature[i]).fma(vdot[i], w.S.get(i).dot(&f));
        }
    }

    /// Computes rows ← −M⁻¹ rows for a block of columns, four rows of M⁻¹ at a time.
    fn multiply(&mut self, tree: &Tree, inverse: &[L]) {
        let n = tree.nv();
        let width = n.div_ceil(L::PACK);
        for b in 0..width {
            let runs = &tree.dofs.meets[b * L::PACK / WIDEST];
            for k in runs.iter().cloned().flatten() {
                let row = &self.rows[2 * k * width..];
                self.column[k] = [row[b], row[width + b]];
            }
            for i in (0..n).step_by(4) {
                // Rows beyond the last one repeat the last one.
                let at = |r: usize| (i + r).min(n - 1);
                let row = |r: usize| &inverse[at(r) * n..][..n];
                let four = [row(0), row(1), row(2), row(3)];
                let mut sum = [[L::Block::default(); 2]; 4];
                for run in runs {
                    let m = four.map(|row| &row[run.clone()]);
                    let column = &self.column[run.clone()];
                    let m = m[0].iter().zip(m[1]).zip(m[2].iter().zip(m[3]));
                    for ([q, v], ((a, b), (c, d))) in column.iter().zip(m) {
                        for (sum, m) in sum.iter_mut().zip([a, b, c, d]) {
                            let m = m.block();
                            *sum = [m.fnma(*q, sum[0]), m.fnma(*v, sum[1])];
                        }
                    }
                }
                for (r, [q, v]) in sum.into_iter().enumerate() {
                    let row = &mut self.rows[2 * at(r) * width..];
                    (row[b], row[width + b]) = (q, v);
                }
            }
        }
    }

    /// Computes rows ← −M⁻¹ rows by sweeps, for ∂τ/∂q and ∂τ/∂β together, along the runs of the tree.
    fn sweep(&mut self, tree: &Tree, w: &Work<L>) {
        for b in 0..tree.nv().div_ceil(L::PACK) {
            self.gather(tree, w, b);
            self.scatter(tree, w, b);
        }
    }

    /// Computes rows ← D⁻¹ [1 − HψK] rows, for block `b` of both.
    fn gather(&mut self, tree: &Tree, w: &Work<L>, b: usize) {
        let dofs = &tree.dofs;
        let width = tree.nv().div_ceil(L::PACK);
        for run in dofs.runs.iter().rev() {
            let level = dofs.level[run.start] as usize;
            let leaf = dofs.end[run.start] as usize == run.end;
            let [mut y, mut z] = if leaf { Default::default() } else { self.sweep[level] };
            let rows =
                self.rows[2 * run.start * width..2 * run.end * width].chunks_exact_mut(2 * width);
            let sweeps = w.sweeps[run.clone()].iter().zip(&w.D_inv[run.clone()]);
            for (row, ((S, G), D_inv)) in rows.zip(sweeps).rev() {
                let (S, G, D_inv) = (S.block(), G.block(), D_inv.block());
                let (q, v) = (S.dot_from(&y, row[b]), S.dot_from(&z, row[width + b]));
                (row[b], row[width + b]) = (q * D_inv, v * D_inv);
                (y, z) = (G.scale_add(q, y), G.scale_add(v, z));
            }
            match dofs.parent[run.start] {
                0 => {}
                _ if dofs.last_child[run.start] => self.sweep[level] = [y, z],
                p => {
                    let [to_y, to_z] = &mut self.sweep[dofs.level[p as usize - 1] as usize];
                    (*to_y, *to_z) = (*to_y + y, *to_z + z);
                }
            }
        }
    }

    /// Computes rows ← −[1 − HψK]* rows, for block `b` of both.
    fn scatter(&mut self, tree: &Tree, w: &Work<L>, b: usize) {
        let dofs = &tree.dofs;
        let width = tree.nv().div_ceil(L::PACK);
        for run in &dofs.runs {
            let [mut y, mut z] = match dofs.parent[run.start] {
                0 => Default::default(),
                p => self.sweep[dofs.level[p as usize - 1] as usize],
            };
            let rows =
                self.rows[2 * run.start * width..2 * run.end * width].chunks_exact_mut(2 * width);
            for (row, (S, G)) in rows.zip(&w.sweeps[run.clone()]) {
                let (S, G) = (S.block(), G.block());
                let (q, v) = (G.dot_from(&y, row[b]), G.dot_from(&z, row[width + b]));
                (row[b], row[width + b]) = (-q, -v);
                (y, z) = (S.scale_add(q, y), S.scale_add(v, z));
            }
            self.sweep[dofs.level[run.start] as usize] = [y, z];
        }
    }
}
