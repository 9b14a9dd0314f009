//! Composite bodies: mass matrix, momentum, energy, centre of mass, subtree inertia.
//!
//! ```text
//! C(k) = M(k) + Σ_j φ(k,j) C(j) φ*(k,j)
//! M_ik = H(i) φ(i,k) C(k) H*(k)     for i on the path from k to the base
//! ```
//! The columns C H* are shifted inward together, link by link: independent of each other, so the
//! processor overlaps them, and stored by component, so the compiler vectorises them.

use crate::kinematics::check;
use crate::lane::Lane;
use crate::linear::{S3, V3, V6};
use crate::query::{mat3, v3, vec3};
use crate::tree::{Kind, Link, Tree};
use crate::work::{Columns, Composite, Kin, Work, Workspace};
use linkwork_multibody::BodyId;
use linkwork_spatial::{Force, RigidInertia, Vec3};

/// The mass matrix (nv × nv, row after row, symmetric) at the last
/// [`kinematics`](crate::kinematics()) or [`poses`](crate::poses), armature included. Composite rigid bodies: O(nv × depth).
pub fn mass_matrix(tree: &Tree, ws: &mut Workspace, out: &mut [f64]) {
    check(out.len(), tree.nv() * tree.nv(), "mass matrix");
    matrix(&tree.links, &mut ws.work, tree.nv(), out);
}

/// Momentum about the centre of mass of all moving bodies: angular (kg m²/s) in `moment`, linear
/// (kg m/s) in `force`; world axes. After [`kinematics`](crate::kinematics()). Rotor spin relative to its
/// body (armature) is not part of it.
#[must_use]
pub fn momentum(tree: &Tree, ws: &Workspace) -> Force {
    let Some(first) = ws.work.kin.get(1) else { return Force::zero() };
    // Everything relative to the first link, so that distance from the world's origin cancels.
    let origin = vec3(&first.p);
    let mut total = Force::zero();
    let mut moment = Vec3::zeros();
    for (link, kin) in tree.links.iter().zip(&ws.work.kin[1..]) {
        let (J, h) = world_inertia(link, kin);
        let (w, v) = (kin.V.n, kin.V.f);
        let f = w.cross_add(h, v.scale(link.m));
        let n = h.cross_add(v, J.mul(w));
        let r = vec3(&kin.p) - origin;
        total += Force::new(vec3(&n), vec3(&f)).shift_to_parent(&r);
        moment += r * link.m + vec3(&h);
    }
    let mass = tree.total_mass();
    let c = if mass > 0.0 { moment / mass } else { Vec3::zeros() };
    total.shift_to_parent(&-c)
}

/// Kinetic energy, J, rotors (½ armature β²) included: ½ βᵀ M β. `v` as given to
/// [`kinematics`](crate::kinematics()).
#[must_use]
pub fn kinetic_energy(tree: &Tree, ws: &Workspace, v: &[f64]) -> f64 {
    check(v.len(), tree.nv(), "v");
    let mut twice = 0.0;
    for (link, kin) in tree.links.iter().zip(&ws.work.kin[1..]) {
        let (J, h) = world_inertia(link, kin);
        let (w, u) = (kin.V.n, kin.V.f);
        twice += w.dot(J.mul(w)) + link.m * u.dot(u) + 2.0 * u.dot(w.cross(h));
        if link.armature > 0.0 {
            let i = link.v as usize;
            let n = if link.kind == Kind::Ball { 3 } else { 1 };
            twice += v[i..i + n].iter().map(|b| link.armature * b * b).sum::<f64>();
        }
    }
    0.5 * twice
}

/// Centre of mass of all moving bodies in the world, m.
#[must_use]
pub fn center_of_mass(tree: &Tree, ws: &Workspace) -> Vec3 {
    let Some(first) = ws.work.kin.get(1) else { return Vec3::zeros() };
    let origin = vec3(&first.p);
    let mut moment = Vec3::zeros();
    for (link, kin) in tree.links.iter().zip(&ws.work.kin[1..]) {
        moment += (vec3(&kin.p) - origin) * link.m + vec3(&kin.R.mul(link.h));
    }
    if tree.total_mass() > 0.0 { origin + moment / tree.total_mass() } else { origin }
}

/// Velocity of that centre of mass, m/s, world axes.
#[must_use]
pub fn com_velocity(tree: &Tree, ws: &Workspace) -> Vec3 {
    let mass = tree.total_mass();
    if mass > 0.0 { momentum(tree, ws).force / mass } else { Vec3::zeros() }
}

/// Acceleration of that centre of mass, m/s², world axes. After forward or inverse dynamics.
#[must_use]
pub fn com_acceleration(tree: &Tree, ws: &Workspace) -> Vec3 {
    let mut sum = Vec3::zeros();
    for (link, (kin, acc)) in tree.links.iter().zip(ws.work.kin.iter().zip(&ws.work.acc).skip(1)) {
        let (A, w, h) = (kin.A + *acc, kin.V.n, kin.R.mul(link.h));
        sum += vec3(&w.cross_add(w.cross(h), A.n.cross_add(h, A.f.scale(link.m))));
    }
    if tree.total_mass() > 0.0 { sum / tree.total_mass() } else { sum }
}

/// Inertia of a body and everything outboard of it at the present configuration, as one rigid
/// body: about the body's origin, world axes. O(bodies outboard).
#[must_use]
pub fn subtree_inertia(tree: &Tree, ws: &Workspace, body: BodyId) -> RigidInertia {
    let position = |b: BodyId| {
        let at = tree.body(b);
        let kin = &ws.work.kin[at.slot as usize];
        (vec3(&kin.p), vec3(&kin.R.mul(v3(&at.p))), mat3(&kin.R) * at.R)
    };
    let (p0, r0, _) = position(body);
    let mut sum = RigidInertia::zero();
    for b in tree.multibody().subtree(body) {
        let (p, r, R) = position(b);
        let I = tree.multibody().get(b).inertia().rotate_by(&R);
        sum += I.shift_to_parent(&((p - p0) + (r - r0)));
    }
    sum
}

#[inline(always)]
fn world_inertia<L: Lane>(link: &Link, kin: &Kin<L>) -> (S3<L>, V3<L>) {
    let J = S3::splat(&link.J);
    let J = match link.kind {
        Kind::Pin | Kind::Slider | Kind::Screw => J.rotate_xy_free(&kin.R),
        Kind::Ball | Kind::Free => J.rotate(&kin.R),
    };
    (J, kin.R.mul(V3::splat(&link.h)))
}

impl<L: Lane> Composite<L> {
    #[inline(always)]
    fn add(&mut self, b: &Self) {
        self.m = self.m + b.m;
        self.h = self.h + b.h;
        self.J = self.J.add(&b.J);
    }

    /// φ C φ*, `l` from the parent's origin; g = h + ½ m l:
    /// ```text
    /// h' = h + m l,   J' = J + 2 (l·g) 1 − g lᵀ − l gᵀ
    /// ```
    #[inline(always)]
    fn shifted(&self, l: V3<L>) -> Self {
        let g = l.scale_add(self.m * L::splat(0.5), self.h);
        let d = l.dot(g);
        Self {
            m: self.m,
            h: l.scale_add(self.m, self.h),
            J: self.J.add(&S3::diagonal(d + d)).add_sym_outer(-g, l),
        }
    }

    /// C V.
    #[inline(always)]
    fn apply(&self, V: V6<L>) -> V6<L> {
        V6 {
            n: self.h.cross_add(V.f, self.J.mul(V.n)),
            f: V.n.cross_add(self.h, V.f.scale(self.m)),
        }
    }
}

pub(crate) fn matrix<L: Lane>(links: &[Link], w: &mut Work<L>, nv: usize, out: &mut [L]) {
    let n = links.len();
    let (kin, composite) = (&w.kin[..n + 1], &mut w.composite[..n + 1]);
    let columns = &mut w.columns;
    for (k, link) in links.iter().enumerate().rev() {
        let here = &kin[k + 1];
        let (J, h) = world_inertia(link, here);
        let mut C = Composite { m: L::splat(link.m), h, J };
        if !link.leaf {
            C.add(&composite[k + 1]);
        }
        if link.parent != 0 {
            let S = C.shifted(here.l);
            let parent = &mut composite[link.parent as usize];
            if link.gathers_first {
                *parent = S;
            } else {
                parent.add(&S);
            }
        }
        let o = V3::default();
        let (i, R) = (link.v as usize, &here.R);
        let mut own = |j: usize, V: V6<L>| columns.set(i + j, C.apply(V));
        match link.kind {
            Kind::Pin => own(0, V6 { n: R.z, f: o }),
            Kind::Slider => own(0, V6 { n: o, f: R.z }),
            Kind::Screw => own(0, V6 { n: R.z, f: R.z.scale(L::splat(link.pitch)) }),
            Kind::Ball | Kind::Free => {
                for (j, c) in [R.x, R.y, R.z].into_iter().enumerate() {
                    own(j, V6 { n: c, f: o });
                    if link.kind == Kind::Free {
                        own(j + 3, V6 { n: o, f: c });
                    }
                }
            }
        }
        let end = link.v_end as usize;
        let mut row = |j: usize, n: V3<L>, f: Option<V3<L>>| {
            let r = &mut out[(i + j) * nv..(i + j + 1) * nv];
            columns.dot(n, f, &mut r[i..end], i);
            r[end..].fill(L::splat(0.0));
            r[i + j] = r[i + j] + L::splat(link.armature);
        };
        match link.kind {
            Kind::Pin => row(0, R.z, None),
            Kind::Slider => row(0, o, Some(R.z)),
            Kind::Screw => row(0, R.z, Some(R.z.scale(L::splat(link.pitch)))),
            Kind::Ball | Kind::Free => {
                for (j, c) in [R.x, R.y, R.z].into_iter().enumerate() {
                    row(j, c, None);
                    if link.kind == Kind::Free {
                        row(j + 3, o, Some(c));
                    }
                }
            }
        }
        if link.parent != 0 {
            columns.shift(here.l, i, end);
        }
    }
    for i in 1..nv {
        for j in 0..i {
            out[i * nv + j] = out[j * nv + i];
        }
    }
}

impl<L: Lane> Columns<L> {
    #[inline(always)]
    fn set(&mut self, j: usize, F: V6<L>) {
        for (a, x) in self.n.iter_mut().zip([F.n.x, F.n.y, F.n.z]) {
            a[j] = x;
        }
        for (a, x) in self.f.iter_mut().zip([F.f.x, F.f.y, F.f.z]) {
            a[j] = x;
        }
    }

    /// `out[j] = n · n_j + f · f_j` for the columns from `start` on.
    #[inline(always)]
    fn dot(&self, n: V3<L>, f: Option<V3<L>>, out: &mut [L], start: usize) {
        let end = start + out.len();
        let part = |a: &[Vec<L>; 3], v: V3<L>, out: &mut [L], add: bool| {
            let (x, y, z) = (&a[0][start..end], &a[1][start..end], &a[2][start..end]);
            for ((o, x), (y, z)) in out.iter_mut().zip(x).zip(y.iter().zip(z)) {
                let d = v.x.fma(*x, v.y.fma(*y, v.z * *z));
                *o = if add { *o + d } else { d };
            }
        };
        part(&self.n, n, out, false);
        if let Some(f) = f {
            part(&self.f, f, out, true);
        }
    }

    /// φ on columns `start..end`: to the origin from which the present one lies at `l`.
    #[inline(always)]
    fn shift(&mut self, l: V3<L>, start: usize, end: usize) {
        let [nx, ny, nz] = &mut self.n;
        let (nx, ny, nz) = (&mut nx[start..end], &mut ny[start..end], &mut nz[start..end]);
        let [fx, fy, fz] = &self.f;
        let (fx, fy, fz) = (&fx[start..end], &fy[start..end], &fz[start..end]);
        let n = nx.iter_mut().zip(ny).zip(nz);
        for (((nx, ny), nz), ((fx, fy), fz)) in n.zip(fx.iter().zip(fy).zip(fz)) {
            let m = l.cross_add(V3::new(*fx, *fy, *fz), V3::new(*nx, *ny, *nz));
            (*nx, *ny, *nz) = (m.x, m.y, m.z);
        }
    }
}
