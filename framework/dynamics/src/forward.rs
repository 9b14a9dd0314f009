//! Mixed forward dynamics with articulated bodies: one gather sweep, one scatter sweep.
//!
//! From tips to base. The bias acceleration A of [`kinematics`](mod@crate::kinematics) is included in the rigid force, so that no term P a appears:
//! ```text
//! P(k) = M(k) + Σ_j φ(k,j) P⁺(j) φ*(k,j)
//! z(k) = M(k) A(k) + b(k) − f_ext(k) + Σ_j φ(k,j) z⁺(j)
//! free        U = P H*, D = H U + armature, G = U D⁻¹, ε = T − H z, ν = D⁻¹ ε
//!             P⁺ = P − G Uᵀ,  z⁺ = z + U ν
//! prescribed  P⁺ = P,         z⁺ = z + U β̇
//! ```
//! Base to tips, α less bias:
//! ```text
//! α⁺(k) = φ*(p,k) α(p)
//! free        β̇ = ν − Gᵀ α⁺
//! prescribed  T = H (P α + z) + armature β̇
//! α(k) = α⁺ + H* β̇
//! ```
//! Source: Jain, *Robot and Multibody Dynamics* (mixed dynamics); ALGORITHMS 1.2.

use crate::articulated::Spatial;
use crate::composite::world_inertia;
use crate::compound::Compound;
use crate::error::DynamicsError;
use crate::kinematics::{check, kinematics};
use crate::lane::Lane;
use crate::linear::{M3, S3, V3, V6};
use crate::tree::{Kind, Link, Tree};
use crate::work::{Art, Kin, Multi, One, Work, Workspace};
use linkwork_multibody::Coordinate;
use std::ops::{Deref, DerefMut};

/// Calls [`kinematics`], then [`forward_dynamics_given_kinematics`]. External forces in the workspace must have been added for the same `q`.
///
/// # Errors
/// [`DynamicsError::Singular`].
pub fn forward_dynamics(
    tree: &Tree,
    ws: &mut Workspace,
    q: &[f64],
    v: &[f64],
    tau: &mut [f64],
    vdot: &mut [f64],
) -> Result<(), DynamicsError> {
    kinematics(tree, ws, q, v);
    forward_dynamics_given_kinematics(tree, ws, tau, vdot)
}

/// Computes accelerations from forces at the state of the last [`kinematics`], with the external forces and gravity of the workspace.
///
/// `tau` and `vdot` (nv each) are both read and written. At free coordinates `tau` is read and `vdot` written; at prescribed ones `vdot` is read and
/// `tau` written. Units follow the subhinge: N m and rad/s², or N and m/s². About 255 multiply-adds per one-dof link.
///
/// # Errors
/// [`DynamicsError::Singular`] if a free subhinge moves no inertia; `tau` and `vdot` are then undefined.
pub fn forward_dynamics_given_kinematics(
    tree: &Tree,
    ws: &mut Workspace,
    tau: &mut [f64],
    vdot: &mut [f64],
) -> Result<(), DynamicsError> {
    check(tau.len(), tree.nv(), "tau");
    check(vdot.len(), tree.nv(), "vdot");
    match tree.flexible.as_deref() {
        None => run(tree, &mut ws.work, tau, vdot),
        Some(_) => crate::flexible::forward_dynamics(tree, ws, tau, vdot),
    }
}

pub(crate) fn run<L: Lane>(
    tree: &Tree,
    work: &mut Work<L>,
    tau: &mut [L],
    vdot: &mut [L],
) -> Result<(), DynamicsError> {
    if tree.apart {
        apart(tree, work, tau, vdot);
        return Ok(());
    }
    if let Some(k) = gather(tree, work, tau, vdot) {
        return Err(tree.singular(k));
    }
    scatter(&tree.links, work, tau, vdot);
    Ok(())
}

/// Returns M and M A + b − f_ext of the rigid link alone, with gravity g as a force at its centre of mass.
#[inline(always)]
pub(crate) fn rigid<L: Lane>(
    link: &Link,
    kin: &Kin<L>,
    f_ext: &V6<L>,
    g: V3<L>,
) -> (S3<L>, V3<L>, V6<L>) {
    let (m, (J, h)) = (L::splat(link.m), world_inertia(link, kin));
    (J, h, rigid_mass(m, h, J, kin, f_ext, g))
}

/// Returns M A + b − f_ext of a mass with its inertia and first moment in world axes.
#[inline(always)]
pub(crate) fn rigid_mass<L: Lane>(
    m: L,
    h: V3<L>,
    J: S3<L>,
    kin: &Kin<L>,
    f_ext: &V6<L>,
    g: V3<L>,
) -> V6<L> {
    let (w, a) = (kin.V.n, kin.A.f - g);
    let n = w.cross_add(J.mul(w), h.cross_add(a, J.mul(kin.A.n) - f_ext.n));
    let f = w.cross_add(w.cross(h), kin.A.n.cross_add(h, a.scale(m) - f_ext.f));
    V6 { n, f }
}

/// Returns the outermost link whose free hinge moves no inertia.
fn gather<L: Lane>(tree: &Tree, w: &mut Work<L>, tau: &[L], vdot: &mut [L]) -> Option<usize> {
    let links = &tree.links[..];
    let n = links.len();
    let (kin, f_ext, g) = (&w.kin[..n + 1], &w.f_ext[..n + 1], w.gravity);
    let (art, one) = (&mut w.art[..n + 1], &mut w.one[..n + 1]);
    for k in (0..n).rev() {
        let (link, kin) = (&links[k], &kin[k + 1]);
        if link.lone {
            let i = link.v as usize;
            let (whole, T) = (tree.compounds.get(k + 1), &tau[i..i + 6]);
            w.acc[k + 1] = lone(whole, kin, &f_ext[k + 1], g, T, &mut vdot[i..i + 6]);
            continue;
        }
        let (J, h, z) = rigid(link, kin, &f_ext[k + 1], g);
        let P = Spatial { I: J, H: M3::skew(h), M: S3::diagonal(L::splat(link.m)) };
        let mut P = Art { P, z };
        if !link.leaf {
            P.add(&art[k + 1]);
        }
        let i = link.v as usize;
        let ok = match link.kind {
            Kind::Pin => {
                let U = V6 { n: P.I.mul(kin.R.z), f: P.H.tmul(kin.R.z) };
                let (D, Hz) = (kin.R.z.dot(U.n), kin.R.z.dot(P.z.n));
                eliminate(link, &mut P, U, D, Hz, tau[i], vdot[i], &mut one[k + 1])
            }
            Kind::Slider => {
                let U = V6 { n: P.H.mul(kin.R.z), f: P.M.mul(kin.R.z) };
                let (D, Hz) = (kin.R.z.dot(U.f), kin.R.z.dot(P.z.f));
                eliminate(link, &mut P, U, D, Hz, tau[i], vdot[i], &mut one[k + 1])
            }
            Kind::Screw => {
                let (h, sh) = (kin.R.z, kin.R.z.scale(L::splat(link.pitch)));
                let U =
                    V6 { n: P.H.mul_add(sh, P.I.mul(h)), f: V3::tmul_add(&P.H, h, P.M.mul(sh)) };
                let D = h.dot(U.n) + sh.dot(U.f);
                let Hz = h.dot(P.z.n) + sh.dot(P.z.f);
                eliminate(link, &mut P, U, D, Hz, tau[i], vdot[i], &mut one[k + 1])
            }
            Kind::Ball => {
                let out = &mut w.multi[link.multi as usize];
                ball(link, kin, &mut P, &tau[i..i + 3], &vdot[i..i + 3], out)
            }
            Kind::Free => {
                let out = &mut w.multi[link.multi as usize];
                free(link, kin, &mut P, &tau[i..i + 6], &vdot[i..i + 6], out)
            }
        };
        if !ok {
            return Some(k);
        }
        if link.parent != 0 {
            let S = P.shifted(kin.l);
            let parent = &mut art[link.parent as usize];
            if link.gathers_first {
                *parent = S;
            } else {
                parent.add(&S);
            }
        }
    }
    None
}

/// Eliminates a one-dof hinge: P becomes P⁺, z becomes z⁺.
#[inline(always)]
fn eliminate<L: Lane>(
    link: &Link,
    P: &mut Art<L>,
    U: V6<L>,
    D: L,
    Hz: L,
    T: L,
    beta_dot: L,
    out: &mut One<L>,
) -> bool {
    if link.coordinate == Coordinate::Prescribed {
        P.z = V6 { n: U.n.scale_add(beta_dot, P.z.n), f: U.f.scale_add(beta_dot, P.z.f) };
        *out = One { G: U, nu: Hz };
        return true;
    }
    let D = D + L::splat(link.armature);
    let D_inv = L::splat(1.0) / D;
    let G = V6 { n: U.n.scale(D_inv), f: U.f.scale(D_inv) };
    let eps = T - Hz;
    *out = One { G, nu: eps * D_inv };
    if link.parent != 0 {
        P.z = V6 { n: G.n.scale_add(eps, P.z.n), f: G.f.scale_add(eps, P.z.f) };
        P.downdate(G, U);
    }
    D.all_positive()
}

/// Eliminates a ball hinge: H* = [R; 0], so D is the block I itself, in world axes.
fn ball<L: Lane>(
    link: &Link,
    kin: &Kin<L>,
    P: &mut Art<L>,
    tau: &[L],
    vdot: &[L],
    out: &mut Multi<L>,
) -> bool {
    if link.coordinate == Coordinate::Prescribed {
        out.P = *P;
        let x = kin.R.mul(V3::read(vdot));
        P.z = V6 { n: P.z.n + P.I.mul(x), f: V3::tmul_add(&P.H, x, P.z.f) };
        return true;
    }
    let (D_inv, ok) = P.I.add(&S3::diagonal(L::splat(link.armature))).inverse();
    let nu = D_inv.mul(kin.R.mul(V3::read(tau)) - P.z.n);
    let I = P.I.columns();
    let D_inv = D_inv.columns();
    let (Gn, Gf) = (D_inv.mat(&I), D_inv.mat(&P.H));
    *out = Multi { Gn, Gf, nu: V6 { n: nu, f: V3::default() }, P: out.P };
    P.z = V6 { n: P.z.n + I.mul(nu), f: V3::tmul_add(&P.H, nu, P.z.f) };
    P.M = P.M.sub_product(&P.H.transpose(), &Gf);
    P.H = P.H.sub(&I.mat(&Gf));
    P.I = P.I.sub_product(&I, &Gn);
    ok
}

/// Eliminates a free hinge: H* = diag(R, R), so D is P itself, P⁺ = 0, and only T acts on the parent.
fn free<L: Lane>(
    link: &Link,
    kin: &Kin<L>,
    P: &mut Art<L>,
    tau: &[L],
    vdot: &[L],
    out: &mut Multi<L>,
) -> bool {
    if link.coordinate == Coordinate::Prescribed {
        out.P = *P;
        let (x, y) = (kin.R.mul(V3::read(vdot)), kin.R.mul(V3::read(&vdot[3..])));
        P.z.n = P.H.mul_add(y, P.z.n + P.I.mul(x));
        P.z.f = V3::tmul_add(&P.H, x, P.z.f + P.M.mul(y));
        return true;
    }
    let T = V6 { n: kin.R.mul(V3::read(tau)), f: kin.R.mul(V3::read(&tau[3..])) };
    let (rn, rf) = (T.n - P.z.n, T.f - P.z.f);
    // Use the Schur complement of the translational block: S = I − H M⁻¹ Hᵀ.
    let (M_inv, ok_M) = P.M.inverse();
    let HM = P.H.mat(&M_inv.columns());
    let (S_inv, ok_S) = P.I.sub_product(&HM, &P.H.transpose()).inverse();
    let n = S_inv.mul(rn - HM.mul(rf));
    let f = M_inv.mul(rf - P.H.tmul(n));
    out.nu = V6 { n, f };
    *P = Art { z: T, ..Art::default() };
    ok_M && ok_S
}

/// Computes a mechanism that consists only of isolated free bodies.
fn apart<L: Lane>(tree: &Tree, w: &mut Work<L>, tau: &[L], vdot: &mut [L]) {
    let n = tree.links.len();
    let bodies = &tree.compounds.all()[..n];
    let (kin, f_ext, acc) = (&w.kin[1..=n], &w.f_ext[1..=n], &mut w.acc[1..=n]);
    for k in 0..n {
        let i = tree.links[k].v as usize;
        let (T, vdot) = (&tau[i..i + 6], &mut vdot[i..i + 6]);
        acc[k] = lone(&bodies[k], &kin[k], &f_ext[k], w.gravity, T, vdot);
    }
}

/// Computes an isolated free body in its own axes about its centre of mass c, where its inertia is constant:
/// ```text
/// ω̇ = J_c⁻¹ (n_c − ω × J_c ω),   v̇ = f/m + g − ω̇ × c − ω × (ω × c)
/// ```
/// Subtracts the bias A, which is [0; ω × v] in a world at rest. Returns the result in world axes; in the body's axes it is β̇.
#[inline(always)]
fn lone<L: Lane>(
    body: &Compound,
    kin: &Kin<L>,
    f_ext: &V6<L>,
    g: V3<L>,
    tau: &[L],
    vdot: &mut [L],
) -> V6<L> {
    let (R, c) = (&kin.R, V3::splat(&body.com));
    let w = R.tmul(kin.V.n);
    let f = V3::tmul_add(R, f_ext.f, V3::read(&tau[3..]));
    let n = V3::tmul_add(R, f_ext.n, V3::read(tau)) - c.cross(f);
    let Jw = S3::splat(&body.J).mul(w);
    let n = S3::splat(&body.J_inv).mul(n - w.cross(Jw));
    let centre = w.cross_add(w.cross(c), n.cross(c));
    let f = f.scale_add(L::splat(body.m_inv), R.tmul(g - kin.A.f) - centre);
    let n = n - R.tmul(kin.A.n);
    n.write(vdot);
    f.write(&mut vdot[3..]);
    V6 { n: R.mul(n), f: R.mul(f) }
}

fn scatter<L: Lane>(links: &[Link], w: &mut Work<L>, tau: &mut [L], vdot: &mut [L]) {
    let n = links.len();
    let (kin, one, acc) = (&w.kin[..n + 1], &w.one[..n + 1], &mut w.acc[..n + 1]);
    for (k, link) in links.iter().enumerate() {
        if link.lone {
            continue;
        }
        let (kin, one) = (&kin[k + 1], &one[k + 1]);
        let mut a = acc[link.parent as usize].to_child(kin.l);
        let i = link.v as usize;
        match link.kind {
            Kind::Pin | Kind::Slider | Kind::Screw => {
                let free = link.coordinate == Coordinate::Free;
                let x = if free { one.nu - (one.G.n.dot(a.n) + one.G.f.dot(a.f)) } else { vdot[i] };
                match link.kind {
                    Kind::Pin => a.n = kin.R.z.scale_add(x, a.n),
                    Kind::Slider => a.f = kin.R.z.scale_add(x, a.f),
                    _ => {
                        a.n = kin.R.z.scale_add(x, a.n);
                        a.f = kin.R.z.scale_add(x * L::splat(link.pitch), a.f);
                    }
                }
                if free {
                    vdot[i] = x;
                } else {
                    let U = one.G;
                    let inertial = U.n.dot(a.n) + U.f.dot(a.f);
                    tau[i] = one.nu + L::splat(link.armature).fma(x, inertial);
                }
            }
            Kind::Ball | Kind::Free => {
                several(link, kin, &w.multi[link.multi as usize], &mut a, tau, vdot);
            }
        }
        acc[k + 1] = a;
    }
}

/// Performs the scatter step at a ball or free hinge.
fn several<L: Lane>(
    link: &Link,
    kin: &Kin<L>,
    work: &Multi<L>,
    a: &mut V6<L>,
    tau: &mut [L],
    vdot: &mut [L],
) {
    let ball = link.kind == Kind::Ball;
    let i = link.v as usize;
    let (tau, vdot) = (&mut tau[i..], &mut vdot[i..]);
    if link.coordinate == Coordinate::Free {
        if ball {
            let x = work.nu.n - work.Gn.mul(a.n) - work.Gf.mul(a.f);
            kin.R.tmul(x).write(vdot);
            a.n = a.n + x;
        } else {
            kin.R.tmul(work.nu.n - a.n).write(vdot);
            kin.R.tmul(work.nu.f - a.f).write(&mut vdot[3..]);
            *a = work.nu;
        }
        return;
    }
    let rate = V3::read(vdot);
    a.n = kin.R.mul_add(rate, a.n);
    if !ball {
        a.f = kin.R.mul_add(V3::read(&vdot[3..]), a.f);
    }
    let P = &work.P;
    let n = P.H.mul_add(a.f, P.z.n + P.I.mul(a.n));
    rate.scale_add(L::splat(link.armature), kin.R.tmul(n)).write(tau);
    if !ball {
        let f = V3::tmul_add(&P.H, a.n, P.z.f + P.M.mul(a.f));
        kin.R.tmul(f).write(&mut tau[3..]);
    }
}

impl<L: Lane> Art<L> {
    #[inline(always)]
    fn add(&mut self, b: &Self) {
        self.P.add(&b.P);
        self.z = self.z + b.z;
    }

    /// Returns φ P φ* and φ z, with `l` from the parent's origin.
    #[inline(always)]
    fn shifted(&self, l: V3<L>) -> Self {
        Self { P: self.P.shifted(l), z: self.z.to_parent(l) }
    }
}

impl<L> Deref for Art<L> {
    type Target = Spatial<L>;
    #[inline(always)]
    fn deref(&self) -> &Spatial<L> {
        &self.P
    }
}

impl<L> DerefMut for Art<L> {
    #[inline(always)]
    fn deref_mut(&mut self) -> &mut Spatial<L> {
        &mut self.P
    }
}
