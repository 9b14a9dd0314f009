//! The inverse of the mass matrix, and its product with vectors.
//!
//! ```text
//! M⁻¹ = [1 − HψK]* D⁻¹ [1 − HψK]
//! ```
//! Both factors are sweeps of [`articulated`](crate::articulated) over columns of unit forces, a
//! block of columns at once. Tips to base a column only exists inboard of its own dof; base to
//! tips only the upper triangle is followed.

use crate::articulated::{factor, solve};
use crate::columns::{blocks, load, store};
use crate::error::DynamicsError;
use crate::kinematics::check;
use crate::lane::Lane;
use crate::tree::Tree;
use crate::work::{Work, Workspace};

/// M⁻¹ (nv × nv, row after row, symmetric) at the last [`kinematics`](crate::kinematics()) or
/// [`poses`](crate::poses), armature included: accelerations of the free coordinates for unit
/// forces. Rows and columns of prescribed coordinates are zero, and their accelerations count as
/// zero. About 24 multiply-adds an entry of the upper triangle.
///
/// # Errors
/// [`DynamicsError::Singular`] if a free subhinge has nothing to move.
pub fn inverse_mass_matrix(
    tree: &Tree,
    ws: &mut Workspace,
    out: &mut [f64],
) -> Result<(), DynamicsError> {
    check(out.len(), tree.nv() * tree.nv(), "inverse mass matrix");
    matrix(tree, &mut ws.work, out)
}

/// `x` (nv) becomes M⁻¹ x, as [`inverse_mass_matrix`] defines it, in O(nv).
///
/// # Errors
/// [`DynamicsError::Singular`] if a free subhinge has nothing to move.
pub fn apply_inverse_mass(
    tree: &Tree,
    ws: &mut Workspace,
    x: &mut [f64],
) -> Result<(), DynamicsError> {
    check(x.len(), tree.nv(), "x");
    factor(tree, &mut ws.work)?;
    solve(tree, &mut ws.work, x);
    Ok(())
}

pub(crate) fn matrix<L: Lane>(
    tree: &Tree,
    w: &mut Work<L>,
    out: &mut [L],
) -> Result<(), DynamicsError> {
    factor(tree, w)?;
    let n = tree.nv();
    if n > 0 {
        gather(tree, w, out);
        scatter(tree, w, out);
        L::mirror(n, out);
    }
    Ok(())
}

/// Row i of D⁻¹ [1 − HψK], for the columns outboard of i.
fn gather<L: Lane>(tree: &Tree, w: &mut Work<L>, out: &mut [L]) {
    let dofs = &tree.dofs;
    w.F.clear();
    for (i, row) in out.chunks_exact_mut(tree.nv()).enumerate().rev() {
        let (S, G, D_inv) = (w.S.get(i).block(), w.G.get(i).block(), w.D_inv[i].block());
        let range = blocks::<L>(&(i..dofs.end[i] as usize));
        let last = range.end - 1;
        for (b, F) in range.clone().zip(&mut w.F.blocks[range]) {
            let mut eps = -S.dot(F);
            if b == i / L::PACK {
                let one = L::get(&eps, i % L::PACK) + L::splat(1.0);
                L::set(&mut eps, i % L::PACK, one);
            }
            if b == last {
                eps = eps * dofs.keep::<L>(i);
            }
            store(row, b, eps * D_inv);
            *F = G.scale_add(eps, *F);
        }
    }
}

/// Row i of M⁻¹ from i on.
fn scatter<L: Lane>(tree: &Tree, w: &mut Work<L>, out: &mut [L]) {
    let (dofs, n) = (&tree.dofs, tree.nv());
    let width = n.div_ceil(L::PACK);
    for (i, row) in out.chunks_exact_mut(n).enumerate() {
        let (first, own) = (i / L::PACK, dofs.end[i] as usize);
        let (S, G) = (w.S.get(i).block(), w.G.get(i).block());
        let leaf = own == i + 1;
        if dofs.parent[i] == 0 {
            row[own..].fill(L::default());
            for (b, A) in (first..width).zip(&mut w.outward[first..width]) {
                *A = if leaf { *A } else { S.scaled(load(row, b)) };
            }
            continue;
        }
        let (inboard, here) = (dofs.level[dofs.parent[i] as usize - 1], dofs.level[i]);
        let (a, b) = w.outward.split_at_mut(here as usize * width);
        let own_blocks = own.div_ceil(L::PACK);
        let mut each = |b: usize, from: &crate::linear::V6<L::Block>| {
            let nu = if b < own_blocks { load(row, b) } else { L::Block::default() };
            let x = nu - G.dot(from);
            store(row, b, x);
            S.scale_add(x, *from)
        };
        if inboard == here {
            for (j, A) in b[first..width].iter_mut().enumerate() {
                let outboard = each(first + j, A);
                if !leaf {
                    *A = outboard;
                }
            }
        } else {
            let from = &a[inboard as usize * width..][first..width];
            for (j, (A, from)) in b[first..width].iter_mut().zip(from).enumerate() {
                *A = each(first + j, from);
            }
        }
    }
}
