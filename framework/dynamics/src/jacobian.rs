//! Node Jacobians: the matrix, its rate, and its products with rates and wrenches.
//!
//! For each degree of freedom i on the path from the base to the node: d is the vector from its link's origin to the node's, c its axis in world
//! axes:
//! ```text
//! rotation  J_i = [c; c × d]    J̇_i = [ω × c; (ω × c) × d + c × ḋ]     ω of the link, ḋ = v_N − v
//! sliding   J_i = [0; c]        J̇_i = [0; ω × c]
//! screw     both, the second times the pitch
//! ```
//! All vectors are relative to the root's origin, so the distance from the world's origin does not matter.

use crate::composite::each_axis;
use crate::flexible;
use crate::kinematics::{check, path_poses, poses};
use crate::lane::Lane;
use crate::linear::{V3, V6};
use crate::query::{v3, vec3};
use crate::tree::{OnLink, Tree};
use crate::work::{Work, Workspace};
use linkwork_multibody::{BodyId, NodeId};
use linkwork_spatial::{Force, Motion};

/// Computes the Jacobian of a node (6 × nv, row after row), which maps rates to its velocity [ω; v] at its origin in world axes. Call
/// [`kinematics`](crate::kinematics()) or [`poses`](crate::poses) first. O(nv).
pub fn node_jacobian(tree: &Tree, ws: &Workspace, node: NodeId, out: &mut [f64]) {
    check(out.len(), 6 * tree.nv(), "Jacobian");
    frame_jacobian(tree, ws, tree.node(node), out);
}

/// Like [`node_jacobian`], for any frame on a link.
pub(crate) fn frame_jacobian(tree: &Tree, ws: &Workspace, at: &OnLink, out: &mut [f64]) {
    let nv = tree.nv();
    out.fill(0.0);
    match tree.flexible {
        None => columns(tree, &ws.work, at, |i, J, _| put(out, nv, i, J)),
        Some(_) => each_column(tree, &ws.work, at, |i, J| put(out, nv, i, J)),
    }
}

/// Like [`node_jacobian`], for a body's own origin.
pub fn body_jacobian(tree: &Tree, ws: &Workspace, body: BodyId, out: &mut [f64]) {
    check(out.len(), 6 * tree.nv(), "Jacobian");
    out.fill(0.0);
    let nv = tree.nv();
    each_column(tree, &ws.work, tree.body(body), |i, J| put(out, nv, i, J));
}

/// Visits each nonzero entry of a node's Jacobian with its index, for any tree.
pub(crate) fn each_entry(
    tree: &Tree,
    w: &Work<f64>,
    node: NodeId,
    mut each: impl FnMut(usize, f64),
) {
    each_column(tree, w, tree.node(node), |i, J| {
        for (row, x) in [J.n.x, J.n.y, J.n.z, J.f.x, J.f.y, J.f.z].into_iter().enumerate() {
            each(row * tree.nv() + i, x);
        }
    });
}

pub(crate) fn matrix<L: Lane>(tree: &Tree, w: &Work<L>, node: NodeId, out: &mut [L]) {
    let nv = tree.nv();
    out.fill(L::default());
    columns(tree, w, tree.node(node), |i, J, _| put(out, nv, i, J));
}

/// Returns a frame's slot, and the vector from the slot's origin to it.
fn arm(w: &Work<f64>, at: &OnLink) -> (usize, V3<f64>) {
    let slot = at.slot as usize;
    (slot, w.kin[slot].R.mul(v3(&at.p)))
}

/// Visits each column of a frame's Jacobian, for any tree.
#[inline(always)]
fn each_column(tree: &Tree, w: &Work<f64>, at: &OnLink, mut each: impl FnMut(usize, V6<f64>)) {
    match tree.flexible.as_deref() {
        None => columns(tree, w, at, |i, J, _| each(i, J)),
        Some(flex) => {
            let (slot, d) = arm(w, at);
            flexible::columns(tree, flex, w, slot, d, |i, J, _, _| each(i, J));
        }
    }
}

/// Like [`node_jacobian`], from `q` (nq): computes only the links between the base and the node, so the other poses in the workspace are not updated.
/// O(path).
pub fn node_jacobian_at(tree: &Tree, ws: &mut Workspace, q: &[f64], node: NodeId, out: &mut [f64]) {
    check(q.len(), tree.nq(), "q");
    if tree.is_flexible() {
        // Compute all poses, because stations move together.
        poses(tree, ws, q);
    }
    path_poses(tree, &mut ws.work, q, node);
    node_jacobian(tree, ws, node, out);
}

/// Computes the rate of the Jacobian (6 × nv), d/dt of [`node_jacobian`]. Call [`kinematics`](crate::kinematics()) first. O(nv).
pub fn node_jacobian_rate(tree: &Tree, ws: &Workspace, node: NodeId, out: &mut [f64]) {
    let nv = tree.nv();
    check(out.len(), 6 * nv, "Jacobian rate");
    out.fill(0.0);
    if let Some(flex) = tree.flexible.as_deref() {
        let (slot, d) = arm(&ws.work, tree.node(node));
        flexible::jacobian_rate(tree, flex, &ws.work, slot, d, |i, J| put(out, nv, i, J));
        return;
    }
    let at = tree.node(node);
    let kin = &ws.work.kin[at.slot as usize];
    let v = kin.V.to_child(kin.R.mul(v3(&at.p))).f;
    columns(tree, &ws.work, at, |i, J, (slot, d)| {
        let V = ws.work.kin[slot].V;
        let (c, advance) = (V.n.cross(J.n), J.f - J.n.cross(d));
        let rate = V6 { n: c, f: J.n.cross_add(v - V.f, c.cross_add(d, V.n.cross(advance))) };
        put(out, nv, i, rate);
    });
}

/// Returns J v for any rates (nv): the velocity that the node would have, world axes. O(path).
#[must_use]
pub fn node_jacobian_product(tree: &Tree, ws: &Workspace, node: NodeId, v: &[f64]) -> Motion {
    check(v.len(), tree.nv(), "v");
    let mut sum = V6::default();
    each_column(tree, &ws.work, tree.node(node), |i, J| sum = J.scale_add(v[i], sum));
    Motion::new(vec3(&sum.n), vec3(&sum.f))
}

/// Computes Jᵀ f, the generalized forces (nv) equivalent to a wrench on a node (moment about its origin, force; world axes). O(nv).
pub fn node_jacobian_transpose_product(
    tree: &Tree,
    ws: &Workspace,
    node: NodeId,
    wrench: &Force,
    tau: &mut [f64],
) {
    check(tau.len(), tree.nv(), "tau");
    tau.fill(0.0);
    let f = V6 { n: v3(&wrench.moment), f: v3(&wrench.force) };
    each_column(tree, &ws.work, tree.node(node), |i, J| tau[i] = J.dot(&f));
}

#[inline(always)]
fn put<L: Lane>(out: &mut [L], nv: usize, i: usize, J: V6<L>) {
    for (row, x) in [J.n.x, J.n.y, J.n.z, J.f.x, J.f.y, J.f.z].into_iter().enumerate() {
        out[row * nv + i] = x;
    }
}

/// Visits each column of the Jacobian of a frame, from the tip: dof, column, and (slot of its link, vector d).
#[inline(always)]
fn columns<L: Lane>(
    tree: &Tree,
    w: &Work<L>,
    at: &OnLink,
    mut each: impl FnMut(usize, V6<L>, (usize, V3<L>)),
) {
    let mut slot = at.slot as usize;
    let mut d = w.kin[slot].R.mul(V3::splat(&v3(&at.p)));
    while slot != 0 {
        let (link, kin) = (&tree.links[slot - 1], &w.kin[slot]);
        let mut i = link.v as usize;
        // Relative to the node, the link's origin lies at −d.
        each_axis(link, kin, -d, |J| {
            each(i, J, (slot, d));
            i += 1;
        });
        d = d + kin.l;
        slot = link.parent as usize;
    }
}
