//! The inverse of the mass matrix, and its product with vectors.
//!
//! ```text
//! M⁻¹ = [1 − HψK]* D⁻¹ [1 − HψK]
//! ```
//! Both factors are sweeps of [`articulated`](crate::articulated) over columns of unit forces, one block of columns at a time. In the sweep from tips
//! to base a column is nonzero only inboard of its own dof; in the sweep from base to tips only the upper triangle is computed.

use crate::articulated::{factor, solve};
use crate::columns::{blocks, load, store};
use crate::error::DynamicsError;
use crate::kinematics::check;
use crate::lane::Lane;
use crate::linear::{V3, V6};
use crate::tree::Tree;
use crate::work::{Work, Workspace};

/// Computes M⁻¹ (nv × nv, row after row, symmetric) at the last [`kinematics`](crate::kinematics()) or [`poses`](crate::poses), including armature:
/// accelerations of the free coordinates for unit forces. Rows and columns of prescribed coordinates are zero, because their accelerations count as
/// zero. About 24 multiply-adds per entry of the upper triangle.
///
/// # Errors
/// [`DynamicsError::Singular`] if a free subhinge moves no inertia.
pub fn inverse_mass_matrix(
    tree: &Tree,
    ws: &mut Workspace,
    out: &mut [f64],
) -> Result<(), DynamicsError> {
    check(out.len(), tree.nv() * tree.nv(), "inverse mass matrix");
    match tree.flexible.as_deref() {
        None => matrix(tree, &mut ws.work, out),
        Some(_) => crate::flexible::inverse_mass_matrix(tree, ws, out),
    }
}

/// Replaces `x` (nv) by M⁻¹ x, with M⁻¹ as in [`inverse_mass_matrix`], in O(nv).
///
/// # Errors
/// [`DynamicsError::Singular`] if a free subhinge moves no inertia.
pub fn apply_inverse_mass(
    tree: &Tree,
    ws: &mut Workspace,
    x: &mut [f64],
) -> Result<(), DynamicsError> {
    check(x.len(), tree.nv(), "x");
    if tree.is_flexible() {
        return crate::flexible::apply_inverse_mass(tree, ws, x);
    }
    factor(tree, &mut ws.work)?;
    solve(tree, &mut ws.work, x);
    Ok(())
}

/// Computes the diagonal of M⁻¹ (nv), as in [`inverse_mass_matrix`], in O(nv) for rigid bodies: the acceleration of each free coordinate for a unit
/// force on it.
///
/// ```text
/// (M⁻¹)ᵢᵢ = Dᵢ⁻¹ + Gᵢ* Υₚ Gᵢ,    Υᵢ = (1 − Sᵢ Gᵢ*) Υₚ (1 − Gᵢ Sᵢ*) + Sᵢ Dᵢ⁻¹ Sᵢ*,    p: the dof inboard of i
/// ```
///
/// # Errors
/// [`DynamicsError::Singular`] if a free subhinge moves no inertia.
pub fn inverse_mass_diagonal(
    tree: &Tree,
    ws: &mut Workspace,
    out: &mut [f64],
) -> Result<(), DynamicsError> {
    check(out.len(), tree.nv(), "diagonal of the inverse mass matrix");
    if tree.is_flexible() {
        let mut unit = vec![0.0; tree.nv()];
        for (i, diagonal) in out.iter_mut().enumerate() {
            unit.fill(0.0);
            unit[i] = 1.0;
            crate::flexible::apply_inverse_mass(tree, ws, &mut unit)?;
            *diagonal = unit[i];
        }
        return Ok(());
    }
    let w = &mut ws.work;
    factor(tree, w)?;
    // Represent Υ of each link by the motions for six unit wrenches; the roots do not move.
    let mut of_links: Vec<[V6<f64>; 6]> = vec![[V6::default(); 6]; tree.links.len() + 1];
    for (k, link) in tree.links.iter().enumerate() {
        let mut columns = of_links[link.parent as usize];
        let first = link.v as usize;
        for i in first..first + link.kind.nv() {
            let ((S, G), D_inv) = (w.sweeps[i], w.D_inv[i]);
            // Compute Υ G; Υ is symmetric.
            let along = columns.map(|c| c.n.dot(G.n) + c.f.dot(G.f));
            let compliance = sum(along.iter().zip(numbers(G)).map(|(a, g)| a * g)) + D_inv;
            out[i] = if D_inv == 0.0 { 0.0 } else { compliance };
            // The update is Υ − S (Υ G)* − (Υ G) S* + S (G* Υ G + D⁻¹) S*.
            let (s, moved) = (numbers(S), vector(along));
            for ((column, s), a) in columns.iter_mut().zip(s).zip(along) {
                let by = compliance * s - a;
                *column = V6 {
                    n: S.n.scale_add(by, column.n) - moved.n.scale(s),
                    f: S.f.scale_add(by, column.f) - moved.f.scale(s),
                };
            }
        }
        of_links[k + 1] = columns;
    }
    Ok(())
}

fn sum(terms: impl Iterator<Item = f64>) -> f64 {
    terms.fold(0.0, |sum, term| sum + term)
}

/// Returns the six numbers of a spatial vector.
fn numbers(v: V6<f64>) -> [f64; 6] {
    [v.n.x, v.n.y, v.n.z, v.f.x, v.f.y, v.f.z]
}

fn vector(x: [f64; 6]) -> V6<f64> {
    V6 { n: V3::new(x[0], x[1], x[2]), f: V3::new(x[3], x[4], x[5]) }
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

/// Computes rows of D⁻¹ [1 − HψK] for the columns outboard of their dofs. Along a chain of dofs without branches, a block of columns stays in
/// registers.
fn gather<L: Lane>(tree: &Tree, w: &mut Work<L>, out: &mut [L]) {
    let (dofs, n) = (&tree.dofs, tree.nv());
    let one = L::splat(1.0).block();
    w.F.clear();
    for run in dofs.runs.iter().rev() {
        let range = blocks::<L>(&(run.start..dofs.end[run.start] as usize));
        let last = range.end - 1;
        for (b, stored) in range.clone().zip(&mut w.F.blocks[range]) {
            // Exclude columns of other branches.
            let keep = if b == last { dofs.keep::<L>(run.start) } else { one };
            let mut F = stored.scaled(keep);
            let others = stored.scaled(one - keep);
            let sweeps = w.sweeps[run.clone()].iter().zip(&w.D_inv[run.clone()]);
            // A column is nonzero only for the dofs inboard of its dof.
            let active = run.len().min((b + 1) * L::PACK - run.start);
            for (i, ((S, G), D_inv)) in run.clone().zip(sweeps).take(active).rev() {
                let unit = if b == i / L::PACK { L::unit(i) } else { L::Block::default() };
                let eps = S.block().dot_from(&F, unit);
                store(&mut out[i * n..(i + 1) * n], b, eps * D_inv.block());
                F = G.block().scale_add(eps, F);
            }
            *stored = F + others;
        }
    }
}

/// Computes rows of M⁻¹ from the diagonal on, along the same runs.
fn scatter<L: Lane>(tree: &Tree, w: &mut Work<L>, out: &mut [L]) {
    let (dofs, n) = (&tree.dofs, tree.nv());
    let width = n.div_ceil(L::PACK);
    for run in &dofs.runs {
        let (first, own) = (run.start / L::PACK, dofs.end[run.start] as usize);
        let inboard = match dofs.parent[run.start] {
            0 => None,
            p => Some(dofs.level[p as usize - 1] as usize),
        };
        let here = dofs.level[run.start] as usize;
        // A run at the end of a branch has no outboard dofs.
        let leaf = own == run.end;
        for i in run.clone() {
            out[i * n + own..(i + 1) * n].fill(L::default());
        }
        if inboard.is_none() && leaf && run.len() == 1 {
            continue;
        }
        for b in first..width {
            let mut A = inboard.map_or_else(V6::default, |l| w.outward[l * width + b]);
            let rows = out[run.start * n..run.end * n].chunks_exact_mut(n);
            let active = run.len().min((b + 1) * L::PACK - run.start);
            for ((S, G), row) in w.sweeps[run.clone()].iter().zip(rows).take(active) {
                let x = G.block().dot_from(&A, load(row, b));
                store(row, b, x);
                A = S.block().scale_add(x, A);
            }
            if !leaf {
                w.outward[here * width + b] = A;
            }
        }
    }
}
