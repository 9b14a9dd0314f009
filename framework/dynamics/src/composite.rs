//! Composite rigid bodies: the mass matrix.
//!
//! ```text
//! C(k) = M(k) + Σ_j C(j)                           all about the root's origin, so no shifts are needed
//! F = C S                                          S: a column of H*
//! M_ij = S_i · F_j                                 for j outboard of i
//! ```
//! The root's origin is the origin of the link that hangs on the base. It is near the machine wherever the machine is, and it is one point for all
//! links of the root, so that a row and a column can be multiplied without a shift.

use crate::columns::{Summed, sum_inward};
use crate::kinematics::check;
use crate::lane::Lane;
use crate::linear::{S3, V3, V6};
use crate::tree::{Kind, Link, Tree};
use crate::work::{Composite, Kin, Work, Workspace};

/// Computes the mass matrix (nv × nv, row after row, symmetric) at the last [`kinematics`](crate::kinematics()) or [`poses`](crate::poses), including
/// armature. Composite rigid-body algorithm: about 85 multiply-adds per link, and six per nonzero entry of the upper triangle.
pub fn mass_matrix(tree: &Tree, ws: &mut Workspace, out: &mut [f64]) {
    check(out.len(), tree.nv() * tree.nv(), "mass matrix");
    match tree.flexible.as_deref() {
        None => matrix(tree, &mut ws.work, out),
        Some(flex) => crate::flexible::mass_matrix(tree, flex, &mut ws.work, out),
    }
}

/// Returns inertia and first moment of a link about its own origin, world axes. A link with one dof has no J_xy, unless its inertia was changed.
#[inline(always)]
pub(crate) fn world_inertia<L: Lane>(link: &Link, kin: &Kin<L>) -> (S3<L>, V3<L>) {
    let J = S3::splat(&link.J);
    let J = match link.kind {
        Kind::Pin | Kind::Slider | Kind::Screw if link.J.xy == 0.0 => J.rotate_xy_free(&kin.R),
        _ => J.rotate(&kin.R),
    };
    (J, kin.R.mul(V3::splat(&link.h)))
}

impl<L: Lane> Composite<L> {
    /// Returns φ C φ*, with `l` from the new origin to the present one; g = h + ½ m l:
    /// ```text
    /// h' = h + m l,   J' = J + 2 (l·g) 1 − g lᵀ − l gᵀ
    /// ```
    #[inline(always)]
    pub fn shifted(&self, l: V3<L>) -> Self {
        let g = l.scale_add(self.m * L::splat(0.5), self.h);
        let d = l.dot(g);
        Self {
            m: self.m,
            h: l.scale_add(self.m, self.h),
            J: self.J.add(&S3::diagonal(d + d)).add_sym_outer(-g, l),
        }
    }

    /// Returns C V.
    #[inline(always)]
    pub fn apply(&self, V: V6<L>) -> V6<L> {
        V6 {
            n: self.h.cross_add(V.f, self.J.mul(V.n)),
            f: V.n.cross_add(self.h, V.f.scale(self.m)),
        }
    }
}

/// Computes the vectors from the root's origin to each link's, world axes.
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

/// Calls a function for the columns of H* of a link in order, about the point from which the link's origin lies at `r`.
#[inline(always)]
pub(crate) fn each_axis<L: Lane>(
    link: &Link,
    kin: &Kin<L>,
    r: V3<L>,
    mut column: impl FnMut(V6<L>),
) {
    let (R, o) = (&kin.R, V3::default());
    match link.kind {
        Kind::Pin => column(V6 { n: R.z, f: r.cross(R.z) }),
        Kind::Slider => column(V6 { n: o, f: R.z }),
        Kind::Screw => {
            column(V6 { n: R.z, f: r.cross_add(R.z, R.z.scale(L::splat(link.pitch))) });
        }
        Kind::Ball | Kind::Free => {
            for c in [R.x, R.y, R.z] {
                column(V6 { n: c, f: r.cross(c) });
            }
            if link.kind == Kind::Free {
                for c in [R.x, R.y, R.z] {
                    column(V6 { n: o, f: c });
                }
            }
        }
    }
}

/// Computes composite inertias about the roots' origins by dof, the axes S, and the columns F = C S.
pub(crate) fn composites<L: Lane>(tree: &Tree, w: &mut Work<L>) {
    roots(&tree.links, &w.kin, &mut w.r);
    let dofs = &tree.dofs;
    for (b, C) in w.composite.iter_mut().enumerate() {
        let at = b * L::PACK;
        let (block, r) = (dofs.block(at), dofs.of_links(&w.r, at, |r| r));
        let R = dofs.rotations(&w.kin, at);
        let S = block.axes::<L>(at, &R, r);
        for (i, (to, _)) in w.sweeps[at..].iter_mut().take(L::PACK).enumerate() {
            *to = S.lane(i);
        }
        w.S.blocks[b] = S;
        *C = match block.inertia::<L>(at, &R) {
            Some((m, h, J)) => Composite { m, h, J }.shifted(r),
            None => Composite::default(),
        };
    }
    sum_inward::<L, _, 10>(dofs, &mut w.composite, tree.nv());
    for ((C, S), F) in w.composite.iter().zip(&w.S.blocks).zip(&mut w.F.blocks) {
        *F = C.apply(*S);
    }
}

impl<B: Lane> Summed<B, 10> for Composite<B> {
    #[inline(always)]
    fn numbers(&self) -> [&B; 10] {
        let Self { m, h, J } = self;
        [m, &h.x, &h.y, &h.z, &J.xx, &J.xy, &J.xz, &J.yy, &J.yz, &J.zz]
    }
    #[inline(always)]
    fn numbers_mut(&mut self) -> [&mut B; 10] {
        let Self { m, h, J } = self;
        [
            m, &mut h.x, &mut h.y, &mut h.z, &mut J.xx, &mut J.xy, &mut J.xz, &mut J.yy, &mut J.yz,
            &mut J.zz,
        ]
    }
}

pub(crate) fn matrix<L: Lane>(tree: &Tree, w: &mut Work<L>, out: &mut [L]) {
    composites(tree, w);
    let (dofs, n) = (&tree.dofs, tree.nv());
    if !dofs.dense {
        out.fill(L::default());
    }
    for (i, (S, _)) in w.sweeps.iter().enumerate() {
        let (end, S, row) = (dofs.end[i] as usize, S.block(), &mut out[i * n..(i + 1) * n]);
        let first = i / L::PACK;
        let F = &w.F.blocks[first..end.div_ceil(L::PACK)];
        let (places, rest) =
            row[first * L::PACK..].split_at_mut(F.len().min(n / L::PACK - first) * L::PACK);
        for (F, to) in F.iter().zip(places.chunks_exact_mut(L::PACK)) {
            L::store(S.dot(F), to);
        }
        // The number of columns need not be a multiple of the block size, so the last block is
        // stored one by one.
        if let (Some(F), false) = (F.get(places.len() / L::PACK), rest.is_empty()) {
            let x = S.dot(F);
            for (j, to) in rest.iter_mut().enumerate() {
                *to = L::get(&x, j);
            }
        }
        row[i] = row[i] + L::splat(dofs.armature[i]);
        row[end..].fill(L::default());
        if !dofs.dense {
            row[first * L::PACK..i].fill(L::default());
        }
    }
    if dofs.dense { L::mirror(n, out) } else { mirror_related(&dofs.end[..n], out) }
}

/// Copies the entries outboard of each dof to below the diagonal; used when there are few of them.
fn mirror_related<L: Lane>(end: &[u32], out: &mut [L]) {
    let n = end.len();
    for (i, end) in end.iter().enumerate() {
        for j in i + 1..*end as usize {
            out[j * n + i] = out[i * n + j];
        }
    }
}
