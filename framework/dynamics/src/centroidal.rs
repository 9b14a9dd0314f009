//! Momentum as a function of rates: the centroidal momentum matrix, its bias, and the Jacobian of the centre of mass.
//!
//! ```text
//! A_i = φ(c, root) C(i) S_i       h = A β: momentum about the centre of mass c
//! ```

use crate::columns::store;
use crate::composite::{composites, world_inertia};
use crate::kinematics::check;
use crate::lane::Lane;
use crate::linear::{V3, V6};
use crate::momentum::center_from_root;
use crate::query::vec3;
use crate::tree::Tree;
use crate::work::{Work, Workspace};
use linkwork_spatial::Force;

/// Computes the centroidal momentum matrix (6 × nv, row after row). It maps rates to the momentum about the centre of mass of all moving bodies,
/// angular (kg m²/s), then linear (kg m/s), world axes. The spin of rotors (armature) is not included. Call [`kinematics`](crate::kinematics()) or
/// [`poses`](crate::poses) first.
pub fn centroidal_matrix(tree: &Tree, ws: &mut Workspace, out: &mut [f64]) {
    check(out.len(), 6 * tree.nv(), "centroidal matrix");
    match tree.flexible.as_deref() {
        None => matrix(tree, &mut ws.work, out),
        Some(flex) => crate::flexible::centroidal_matrix(tree, flex, &mut ws.work, out),
    }
}

pub(crate) fn matrix<L: Lane>(tree: &Tree, w: &mut Work<L>, out: &mut [L]) {
    let nv = tree.nv();
    composites(tree, w);
    let c = center_from_root(tree, w);
    for (b, F) in w.F.blocks.iter().enumerate() {
        let at = b * L::PACK;
        // Vector from the first root's origin to the origin of the root that carries the link.
        let links = &tree.dofs.link[at..at + L::PACK];
        let root = |i: usize| w.kin[tree.links[links[i] as usize - 1].root as usize].p - w.kin[1].p;
        let l = if tree.one_root {
            -c.block()
        } else {
            let l = |i: usize| root(i) - c;
            V3::new(L::collect(|i| l(i).x), L::collect(|i| l(i).y), L::collect(|i| l(i).z))
        };
        let A = F.to_parent(l);
        let rows = out.chunks_exact_mut(nv);
        for (row, x) in rows.zip([A.n.x, A.n.y, A.n.z, A.f.x, A.f.y, A.f.z]) {
            store(row, b, x);
        }
    }
}

/// Computes the Jacobian of the centre of mass (3 × nv, row after row), which maps rates to its velocity, world axes. Call
/// [`kinematics`](crate::kinematics()) or [`poses`](crate::poses) first. Zero without mass.
pub fn com_jacobian(tree: &Tree, ws: &mut Workspace, out: &mut [f64]) {
    let nv = tree.nv();
    check(out.len(), 3 * nv, "Jacobian of the centre of mass");
    if let Some(flex) = tree.flexible.as_deref() {
        return crate::flexible::com_jacobian(tree, flex, &mut ws.work, out);
    }
    composites(tree, &mut ws.work);
    let m = tree.total_mass();
    let s = if m > 0.0 { 1.0 / m } else { 0.0 };
    for i in 0..nv {
        let f = ws.work.F.get(i).f;
        (out[i], out[nv + i], out[2 * nv + i]) = (s * f.x, s * f.y, s * f.z);
    }
}

/// Returns Ȧ β, the rate of change of momentum about the centre of mass with β̇ = 0, as the external wrench that would cause it: moment (N m) and
/// force (N), world axes. Call [`kinematics`](crate::kinematics()) first.
#[must_use]
pub fn centroidal_bias(tree: &Tree, ws: &Workspace) -> Force {
    let mut total: V6<f64> = V6::default();
    let c = center_from_root(tree, &ws.work);
    if let Some(flex) = tree.flexible.as_deref() {
        return crate::flexible::bias(tree, flex, &ws.work, c);
    }
    let Some(first) = ws.work.kin.get(1) else { return Force::zero() };
    for (link, kin) in tree.links.iter().zip(&ws.work.kin[1..]) {
        let (J, h) = world_inertia(link, kin);
        let (w, A) = (kin.V.n, kin.A);
        let n = w.cross_add(J.mul(w), h.cross_add(A.f, J.mul(A.n)));
        let f = w.cross_add(w.cross(h), A.n.cross_add(h, A.f.scale(link.m)));
        total = total + V6 { n, f }.to_parent(kin.p - first.p - c);
    }
    Force::new(vec3(&total.n), vec3(&total.f))
}
