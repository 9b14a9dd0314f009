//! Composite bodies: the mass matrix.
//!
//! ```text
//! C(k) = M(k) + Σ_j C(j)                           all about the root's origin: nothing is shifted
//! F(k) = C(k) H*(k)
//! M_ik = H(i) F(k)                                 for i on the path from k to the root
//! ```
//! The root's origin is that of the link that hangs on the base: near the machine wherever the
//! machine is, and one point for all its links, so that a row meets its columns without a shift.

use crate::columns::{Columns, blocks, mirror, store};
use crate::kinematics::check;
use crate::lane::Lane;
use crate::linear::{S3, V3, V6};
use crate::tree::{Kind, Link, Tree};
use crate::work::{Composite, Kin, Work, Workspace};

/// The mass matrix (nv × nv, row after row, symmetric) at the last
/// [`kinematics`](crate::kinematics()) or [`poses`](crate::poses), armature included. Composite
/// rigid bodies: about 85 multiply-adds a link, and six an entry of the upper triangle that is not
/// zero.
pub fn mass_matrix(tree: &Tree, ws: &mut Workspace, out: &mut [f64]) {
    check(out.len(), tree.nv() * tree.nv(), "mass matrix");
    matrix(&tree.links, &mut ws.work, tree.nv(), out);
}

/// Inertia and first moment of a link about its own origin, world axes.
#[inline(always)]
pub(crate) fn world_inertia<L: Lane>(link: &Link, kin: &Kin<L>) -> (S3<L>, V3<L>) {
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

    /// φ C φ*, `l` from the new origin to the present one; g = h + ½ m l:
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
    pub fn apply(&self, V: V6<L>) -> V6<L> {
        V6 {
            n: self.h.cross_add(V.f, self.J.mul(V.n)),
            f: V.n.cross_add(self.h, V.f.scale(self.m)),
        }
    }
}

/// Root's origin to each link's, world axes.
#[inline(always)]
pub(crate) fn roots<L: Lane>(links: &[Link], kin: &[Kin<L>], r: &mut [V3<L>]) {
    let n = links.len();
    let (kin, r) = (&kin[..n + 1], &mut r[..n + 1]);
    for (k, link) in links.iter().enumerate() {
        r[k + 1] = match link.parent {
            0 => V3::default(),
            p => r[p as usize] + kin[k + 1].l,
        };
    }
}

/// Column `j` of H* of a link, about the point from which the link's origin lies at `r`.
#[inline(always)]
pub(crate) fn axis<L: Lane>(link: &Link, kin: &Kin<L>, r: V3<L>, j: usize) -> V6<L> {
    let R = &kin.R;
    match link.kind {
        Kind::Pin => V6 { n: R.z, f: r.cross(R.z) },
        Kind::Slider => V6 { n: V3::default(), f: R.z },
        Kind::Screw => V6 { n: R.z, f: r.cross_add(R.z, R.z.scale(L::splat(link.pitch))) },
        Kind::Ball | Kind::Free => {
            let c = [R.x, R.y, R.z][j % 3];
            if j < 3 { V6 { n: c, f: r.cross(c) } } else { V6 { n: V3::default(), f: c } }
        }
    }
}

/// Composite inertias about the roots' origins, and their columns C H*.
pub(crate) fn composites<L: Lane>(links: &[Link], w: &mut Work<L>) {
    roots(links, &w.kin, &mut w.r);
    let n = links.len();
    let (kin, r, composite) = (&w.kin[..n + 1], &w.r[..n + 1], &mut w.composite[..n + 1]);
    for (k, link) in links.iter().enumerate().rev() {
        let (here, r) = (&kin[k + 1], r[k + 1]);
        let (J, h) = world_inertia(link, here);
        let mut C = Composite { m: L::splat(link.m), h, J }.shifted(r);
        if !link.leaf {
            C.add(&composite[k + 1]);
            composite[k + 1] = C;
        }
        if link.parent != 0 {
            let parent = &mut composite[link.parent as usize];
            if link.gathers_first {
                *parent = C;
            } else {
                parent.add(&C);
            }
        }
        let i = link.v as usize;
        if link.kind == Kind::Pin {
            // As below, with what is known beforehand.
            w.columns.set(i, C.apply(axis(link, here, r, 0)));
        } else {
            for j in 0..link.kind.nv() {
                w.columns.set(i + j, C.apply(axis(link, here, r, j)));
            }
        }
    }
}

pub(crate) fn matrix<L: Lane>(links: &[Link], w: &mut Work<L>, nv: usize, out: &mut [L]) {
    composites(links, w);
    let n = links.len();
    let (kin, r) = (&w.kin[..n + 1], &w.r[..n + 1]);
    for (k, link) in links.iter().enumerate() {
        let (i, end) = (link.v as usize, link.v_end as usize);
        for j in 0..link.kind.nv() {
            let row = &mut out[(i + j) * nv..(i + j + 1) * nv];
            row_product(&w.columns, axis(link, &kin[k + 1], r[k + 1], j), i + j, end, row);
            row[end..].fill(L::splat(0.0));
            row[i + j] = row[i + j] + L::splat(link.armature);
        }
    }
    mirror(nv, out);
}

/// `out[j] = S · F_j` for `j` in `start..end`; some places before and after are overwritten.
#[inline(always)]
fn row_product<L: Lane>(F: &Columns<L>, S: V6<L>, start: usize, end: usize, out: &mut [L]) {
    let S = S.block();
    let range = blocks::<L>(&(start..end));
    for (b, F) in range.clone().zip(&F.blocks[range]) {
        store(out, b, S.dot(F));
    }
}
