//! Forward dynamics of a tree with flexible bodies, by the mass matrix.
//!
//! ```text
//! M_ff β̇_f = T_f − (inverse dynamics with β̇_f = 0)_f            f: free degrees of freedom
//! ```
//! Cholesky, in place: O(nv³).

use super::{Flexible, columns, inverse_dynamics, mass_matrix};
use crate::error::DynamicsError;
use crate::query::v3;
use crate::tree::Tree;
use crate::work::Work;
use linkwork_multibody::NodeId;

/// As the rigid one: T at free coordinates and β̇ at prescribed ones are read, the others written.
pub(crate) fn forward_dynamics(
    tree: &Tree,
    flex: &Flexible,
    w: &mut Work<f64>,
    tau: &mut [f64],
    vdot: &mut [f64],
) -> Result<(), DynamicsError> {
    let (mut x, mut trial) = (std::mem::take(&mut w.bend.x), std::mem::take(&mut w.bend.zero));
    for (i, (trial, vdot)) in trial.iter_mut().zip(&*vdot).enumerate() {
        *trial = if flex.prescribed[i] { *vdot } else { 0.0 };
    }
    inverse_dynamics(tree, flex, w, &trial, &mut x);
    for (i, x) in x.iter_mut().enumerate() {
        *x = if flex.prescribed[i] { 0.0 } else { tau[i] - *x };
    }
    let done = apply_inverse_mass(tree, flex, w, &mut x);
    for (i, x) in x.iter().enumerate().filter(|(i, _)| !flex.prescribed[*i]) {
        vdot[i] = *x;
    }
    // Forces of prescribed coordinates, and every acceleration for whoever asks.
    inverse_dynamics(tree, flex, w, vdot, &mut trial);
    for (i, found) in trial.iter().enumerate().filter(|(i, _)| flex.prescribed[*i]) {
        tau[i] = *found;
    }
    (w.bend.x, w.bend.zero) = (x, trial);
    done
}

/// `x` becomes M⁻¹ x over the free degrees of freedom; zero at prescribed ones.
pub(crate) fn apply_inverse_mass(
    tree: &Tree,
    flex: &Flexible,
    w: &mut Work<f64>,
    x: &mut [f64],
) -> Result<(), DynamicsError> {
    let mut M = std::mem::take(&mut w.bend.M);
    let done = factor(tree, flex, w, &mut M);
    if done.is_ok() {
        solve(&M, tree.nv(), &flex.prescribed, x);
    }
    w.bend.M = M;
    done
}

/// M⁻¹, nv × nv.
pub(crate) fn inverse_mass_matrix(
    tree: &Tree,
    flex: &Flexible,
    w: &mut Work<f64>,
    out: &mut [f64],
) -> Result<(), DynamicsError> {
    let nv = tree.nv();
    let mut M = std::mem::take(&mut w.bend.M);
    let done = factor(tree, flex, w, &mut M);
    if done.is_ok() {
        for (i, row) in out.chunks_exact_mut(nv).enumerate() {
            row.fill(0.0);
            row[i] = 1.0;
            solve(&M, nv, &flex.prescribed, row);
        }
    }
    w.bend.M = M;
    done
}

/// J M⁻¹ Jᵀ of some nodes: accelerations for unit wrenches, in their order.
pub(crate) fn compliance(
    tree: &Tree,
    flex: &Flexible,
    w: &mut Work<f64>,
    nodes: &[NodeId],
    out: &mut [f64],
) -> Result<(), DynamicsError> {
    let size = 6 * nodes.len();
    let (mut M, mut x) = (std::mem::take(&mut w.bend.M), std::mem::take(&mut w.bend.x));
    let done = factor(tree, flex, w, &mut M);
    if done.is_ok() {
        for (column, node) in nodes.iter().enumerate() {
            for c in 0..6 {
                x.fill(0.0);
                each_row(tree, flex, w, *node, |i, J| x[i] = J[c]);
                solve(&M, tree.nv(), &flex.prescribed, &mut x);
                for (row, node) in nodes.iter().enumerate() {
                    let mut a = [0.0; 6];
                    each_row(tree, flex, w, *node, |i, J| {
                        a.iter_mut().zip(J).for_each(|(a, J)| *a += J * x[i]);
                    });
                    for (r, a) in a.iter().enumerate() {
                        out[(6 * row + r) * size + 6 * column + c] = *a;
                    }
                }
            }
        }
    }
    (w.bend.M, w.bend.x) = (M, x);
    done
}

/// The six rows of a node's Jacobian, dof by dof.
fn each_row(
    tree: &Tree,
    flex: &Flexible,
    w: &Work<f64>,
    node: NodeId,
    mut each: impl FnMut(usize, [f64; 6]),
) {
    let at = tree.node(node);
    let slot = at.slot as usize;
    let d = w.kin[slot].R.mul(v3(&at.p));
    columns(tree, flex, w, slot, d, |i, J, _, _| {
        each(i, [J.n.x, J.n.y, J.n.z, J.f.x, J.f.y, J.f.z]);
    });
}

/// The lower triangle of M becomes L, M = L Lᵀ, with rows and columns of prescribed dofs as of the unit matrix.
fn factor(
    tree: &Tree,
    flex: &Flexible,
    w: &mut Work<f64>,
    M: &mut [f64],
) -> Result<(), DynamicsError> {
    let n = tree.nv();
    mass_matrix(tree, flex, w, M);
    for i in (0..n).filter(|i| flex.prescribed[*i]) {
        M[i * n..(i + 1) * n].fill(0.0);
        (0..n).for_each(|j| M[j * n + i] = 0.0);
        M[i * n + i] = 1.0;
    }
    for i in 0..n {
        let whole = M[i * n + i];
        for j in 0..=i {
            let (above, row) = M.split_at(i * n);
            let other = if j < i { &above[j * n..j * n + n] } else { &row[..n] };
            let sum: f64 = row[..j].iter().zip(other).map(|(a, b)| a * b).sum();
            let x = M[i * n + j] - sum;
            if i > j {
                M[i * n + j] = x / M[j * n + j];
            } else if x > 1e-13 * whole {
                M[i * n + i] = x.sqrt();
            } else {
                return Err(singular(tree, flex, i));
            }
        }
    }
    Ok(())
}

/// L Lᵀ x = b, in place.
fn solve(L: &[f64], n: usize, prescribed: &[bool], x: &mut [f64]) {
    for i in (0..n).filter(|i| prescribed[*i]) {
        x[i] = 0.0;
    }
    for i in 0..n {
        let sum: f64 = L[i * n..i * n + i].iter().zip(&*x).map(|(a, b)| a * b).sum();
        x[i] = (x[i] - sum) / L[i * n + i];
    }
    for i in (0..n).rev() {
        x[i] /= L[i * n + i];
        for j in 0..i {
            x[j] -= L[i * n + j] * x[i];
        }
    }
}

/// What is said of a degree of freedom with nothing to move.
#[cold]
fn singular(tree: &Tree, flex: &Flexible, i: usize) -> DynamicsError {
    let link = |k: usize| {
        let v = tree.links[k].v as usize;
        (v..v + tree.links[k].kind.nv()).contains(&i)
    };
    match (0..tree.links.len()).find(|k| link(*k)) {
        Some(k) => tree.singular(k),
        None => {
            let set = flex.sets.iter().find(|s| (s.v..s.v + s.n).contains(&i));
            let body = set.map_or("", |s| tree.multibody.bodies()[s.body as usize].name());
            DynamicsError::Singular { body: body.to_owned(), v: i }
        }
    }
}
