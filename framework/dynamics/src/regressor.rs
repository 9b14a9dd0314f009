//! Regressor of inverse dynamics: τ is linear in the bodies' inertial parameters.
//!
//! ```text
//! τ = Y(q, β, β̇) π + armature β̇,    π of a body: m, h_x h_y h_z, I_xx I_xy I_xz I_yy I_yz I_zz
//! ```
//! h = m c and I are about the body's origin in body axes (I_xy = −∫xy dm). With α, ω, and a the
//! acceleration of the origin less gravity, all in body axes, the wrench of a body about its origin
//! is
//! ```text
//! F = m a + α × h + ω × (ω × h)
//! N = h × a + I α + ω × I ω
//! ```
//! Each of the ten columns is propagated to the dofs inboard.

use crate::kinematics::check;
use crate::linear::{V3, V6};
use crate::query::{v3, vec3};
use crate::tree::Tree;
use crate::work::Workspace;
use linkwork_spatial::{Mat3, RigidInertia, Vec3};

/// Number of inertial parameters of a body.
pub const PARAMETERS: usize = 10;

/// Returns the parameters π of one body: m, h (3), I about the body's origin (xx, xy, xz, yy, yz, zz).
#[must_use]
pub fn inertial_parameters(inertia: &RigidInertia) -> [f64; PARAMETERS] {
    let (h, I) = (inertia.h(), inertia.inertia());
    [
        inertia.mass(),
        h.x,
        h.y,
        h.z,
        I[(0, 0)],
        I[(0, 1)],
        I[(0, 2)],
        I[(1, 1)],
        I[(1, 2)],
        I[(2, 2)],
    ]
}

/// Computes Y (nv × 10 · bodies, row after row; bodies in canonical order) at the state and accelerations of the last
/// [`inverse_dynamics`](crate::inverse_dynamics) or [`forward_dynamics`](crate::forward_dynamics), with the uniform gravity of the workspace. Other
/// external wrenches are not included. O(bodies × depth).
///
/// # Panics
/// If a body is flexible; use [`Tree::check_rigid`] to check.
pub fn regressor(tree: &Tree, ws: &Workspace, out: &mut [f64]) {
    tree.assert_rigid("regressor");
    let bodies = tree.multibody().bodies().len();
    let width = PARAMETERS * bodies;
    check(out.len(), tree.nv() * width, "regressor");
    out.fill(0.0);
    for (b, id) in tree.multibody().body_ids().enumerate() {
        let at = tree.body(id);
        if at.slot == 0 {
            continue;
        }
        let R = ws.body_rotation(tree, id);
        let (V, A) = (ws.body_velocity(tree, id), ws.body_acceleration(tree, id));
        let local = |v: Vec3| R.transpose() * v;
        let a = local(A.linear - vec3(&ws.work.gravity));
        let columns = wrenches(&local(V.angular), &local(A.angular), &a);
        let arm = ws.work.kin[at.slot as usize].R.mul(v3(&at.p));
        for (c, (n, f)) in columns.iter().enumerate() {
            let wrench = V6 { n: v3(&(R * n)), f: v3(&(R * f)) }.to_parent(arm);
            inward(tree, ws, at.slot as usize, wrench, |i, tau| {
                out[i * width + PARAMETERS * b + c] = tau;
            });
        }
    }
}

/// Returns moment and force about the body's origin for a unit of each parameter, body axes.
fn wrenches(w: &Vec3, alpha: &Vec3, a: &Vec3) -> [(Vec3, Vec3); PARAMETERS] {
    let mut out = [(Vec3::zeros(), Vec3::zeros()); PARAMETERS];
    out[0].1 = *a;
    for k in 0..3 {
        let h = Vec3::from_fn(|i, _| f64::from(u8::from(i == k)));
        out[1 + k] = (h.cross(a), alpha.cross(&h) + w.cross(&w.cross(&h)));
    }
    let entries = [(0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2)];
    for (k, (i, j)) in entries.into_iter().enumerate() {
        let mut I = Mat3::zeros();
        (I[(i, j)], I[(j, i)]) = (1.0, 1.0);
        out[4 + k].0 = I * alpha + w.cross(&(I * w));
    }
    out
}

/// Computes the generalized force of a wrench about a link's origin at each dof inboard.
fn inward(
    tree: &Tree,
    ws: &Workspace,
    mut slot: usize,
    mut f: V6<f64>,
    mut each: impl FnMut(usize, f64),
) {
    while slot != 0 {
        let (link, kin) = (&tree.links[slot - 1], &ws.work.kin[slot]);
        let mut i = link.v as usize;
        crate::composite::each_axis(link, kin, V3::default(), |S| {
            each(i, S.dot(&f));
            i += 1;
        });
        f = f.to_parent(kin.l);
        slot = link.parent as usize;
    }
}
