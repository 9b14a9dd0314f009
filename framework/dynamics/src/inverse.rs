//! Inverse dynamics (Newton–Euler): one scatter of accelerations, one gather of forces.
//!
//! ```text
//! α(k) = φ*(p,k) α(p) + H*(k) β̇(k)             less bias, which kinematics has computed
//! f(k) = Σ_j φ(k,j) f(j) + M(k) (α + A) + b(k) − f_ext(k)
//! T(k) = H(k) f(k) + armature β̇
//! ```

use crate::kinematics::{check, kinematics};
use crate::lane::Lane;
use crate::linear::{S3, V3, V6};
use crate::tree::{Kind, Link, Tree};
use crate::work::{Work, Workspace};

/// Calls [`kinematics`], then [`inverse_dynamics_given_kinematics`]. External forces in the workspace must have been added for the same `q`.
pub fn inverse_dynamics(
    tree: &Tree,
    ws: &mut Workspace,
    q: &[f64],
    v: &[f64],
    vdot: &[f64],
    tau: &mut [f64],
) {
    kinematics(tree, ws, q, v);
    inverse_dynamics_given_kinematics(tree, ws, vdot, tau);
}

/// Computes forces `tau` (nv) that produce the accelerations `vdot` (nv) at the state of the last [`kinematics`], with the external forces and
/// gravity of the workspace, for prescribed and free coordinates alike. Springs and dampers of modes are internal: `tau` of a modal coordinate is the
/// external force. About 110 multiply-adds per one-dof link.
pub fn inverse_dynamics_given_kinematics(
    tree: &Tree,
    ws: &mut Workspace,
    vdot: &[f64],
    tau: &mut [f64],
) {
    check(vdot.len(), tree.nv(), "vdot");
    check(tau.len(), tree.nv(), "tau");
    match tree.flexible.as_deref() {
        None => run(&tree.links, &mut ws.work, vdot, tau),
        Some(flex) => crate::flexible::inverse_dynamics(tree, flex, &mut ws.work, vdot, tau),
    }
}

pub(crate) fn run<L: Lane>(links: &[Link], w: &mut Work<L>, vdot: &[L], tau: &mut [L]) {
    let n = links.len();
    let (kin, acc, force) = (&w.kin[..n + 1], &mut w.acc[..n + 1], &mut w.force[..n + 1]);
    for (k, link) in links.iter().enumerate() {
        let kin = &kin[k + 1];
        let mut a = acc[link.parent as usize].to_child(kin.l);
        let x = &vdot[link.v as usize..];
        match link.kind {
            Kind::Pin => a.n = kin.R.z.scale_add(x[0], a.n),
            Kind::Slider => a.f = kin.R.z.scale_add(x[0], a.f),
            Kind::Screw => {
                a.n = kin.R.z.scale_add(x[0], a.n);
                a.f = kin.R.z.scale_add(x[0] * L::splat(link.pitch), a.f);
            }
            Kind::Ball => a.n = kin.R.mul_add(V3::read(x), a.n),
            Kind::Free => {
                a.n = kin.R.mul_add(V3::read(x), a.n);
                a.f = kin.R.mul_add(V3::read(&x[3..]), a.f);
            }
        }
        acc[k + 1] = a;
        let (m, J, h) = (L::splat(link.m), S3::splat(&link.J), kin.R.mul(V3::splat(&link.h)));
        let (alpha, lin) = (a.n + kin.A.n, a.f + kin.A.f - w.gravity);
        // Compute the moment in the axes of the body, because this needs the fewest operations.
        let (wl, al) = (kin.R.tmul(kin.V.n), kin.R.tmul(alpha));
        let body = wl.cross_add(J.mul(wl), J.mul(al));
        let ext = &w.f_ext[k + 1];
        force[k + 1] = V6 {
            n: kin.R.mul_add(body, h.cross_add(lin, -ext.n)),
            f: kin.V.n.cross_add(kin.V.n.cross(h), alpha.cross_add(h, lin.scale(m) - ext.f)),
        };
    }
    for (k, link) in links.iter().enumerate().rev() {
        let kin = &kin[k + 1];
        let f = force[k + 1];
        let (i, arm) = (link.v as usize, L::splat(link.armature));
        match link.kind {
            Kind::Pin => tau[i] = arm.fma(vdot[i], kin.R.z.dot(f.n)),
            Kind::Slider => tau[i] = arm.fma(vdot[i], kin.R.z.dot(f.f)),
            Kind::Screw => {
                let linear = kin.R.z.dot(f.f) * L::splat(link.pitch);
                tau[i] = arm.fma(vdot[i], kin.R.z.dot(f.n) + linear);
            }
            Kind::Ball => {
                V3::read(&vdot[i..]).scale_add(arm, kin.R.tmul(f.n)).write(&mut tau[i..]);
            }
            Kind::Free => {
                kin.R.tmul(f.n).write(&mut tau[i..]);
                kin.R.tmul(f.f).write(&mut tau[i + 3..]);
            }
        }
        if link.parent != 0 {
            let p = &mut force[link.parent as usize];
            *p = *p + f.to_parent(kin.l);
        }
    }
}
