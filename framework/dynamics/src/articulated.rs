//! Articulated-body inertias without forces, used for M⁻¹, compliance and derivatives.
//!
//! The recursion proceeds from tips to base. Each degree of freedom is treated as a separate link; a link with several is a chain at one point, which
//! gives the same result:
//! ```text
//! P(k) = M(k) + Σ_j φ(k,j) P⁺(j) φ*(k,j)                  about each link's own origin
//! free        U = P S, D = S · U + armature, G = U D⁻¹, P⁺ = P − G Uᵀ
//! prescribed  G = 0, D⁻¹ := 0, P⁺ = P
//! ```
//! With G about the root's origin, products with ψ need no shifts:
//! ```text
//! ε_i = T_i − S_i · z,   z⁺ = z + G ε_i                   tips to base
//! β̇_i = D⁻¹ ε_i − G_i · α⁺,   α = α⁺ + S_i β̇_i           base to tips
//! ```

use crate::composite::roots;
use crate::error::DynamicsError;
use crate::lane::Lane;
use crate::linear::{M3, S3, V3, V6};
use crate::tree::{Kind, Tree};
use crate::work::{Kin, Work};
use linkwork_multibody::Coordinate;

/// A symmetric spatial inertia [[I, H], [Hᵀ, M]].
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Spatial<L> {
    pub I: S3<L>,
    pub H: M3<L>,
    pub M: S3<L>,
}

impl<L: Lane> Spatial<L> {
    #[inline(always)]
    pub fn add(&mut self, b: &Self) {
        self.I = self.I.add(&b.I);
        self.H = self.H.add(&b.H);
        self.M = self.M.add(&b.M);
    }

    /// Returns φ P φ*, with `l` from the parent's origin:
    /// ```text
    /// H' = H + l~ M,   I' = I + l~ Gᵀ + (l~ Gᵀ)ᵀ  with G = H + ½ l~ M
    /// ```
    #[inline(always)]
    pub fn shifted(&self, l: V3<L>) -> Self {
        let M = self.M.columns();
        let lM = M3 { x: l.cross(M.x), y: l.cross(M.y), z: l.cross(M.z) };
        let half = L::splat(0.5);
        let G = M3 {
            x: lM.x.scale_add(half, self.H.x),
            y: lM.y.scale_add(half, self.H.y),
            z: lM.z.scale_add(half, self.H.z),
        };
        let G = G.transpose();
        let (a, b, c) = (l.cross(G.x), l.cross(G.y), l.cross(G.z));
        let I = &self.I;
        Self {
            I: S3 {
                xx: I.xx + (a.x + a.x),
                xy: I.xy + (a.y + b.x),
                xz: I.xz + (a.z + c.x),
                yy: I.yy + (b.y + b.y),
                yz: I.yz + (b.z + c.y),
                zz: I.zz + (c.z + c.z),
            },
            H: self.H.add(&lM),
            M: self.M,
        }
    }

    /// Computes P − G Uᵀ, where G is a multiple of U.
    #[inline(always)]
    pub fn downdate(&mut self, G: V6<L>, U: V6<L>) {
        self.I = self.I.sub_outer(G.n, U.n);
        self.M = self.M.sub_outer(G.f, U.f);
        self.H = M3 {
            x: G.n.scale_sub(U.f.x, self.H.x),
            y: G.n.scale_sub(U.f.y, self.H.y),
            z: G.n.scale_sub(U.f.z, self.H.z),
        };
    }
}

/// Computes `sweeps` (S and G about the roots' origins) and `D_inv` at the poses in `w`.
pub(crate) fn factor<L: Lane>(tree: &Tree, w: &mut Work<L>) -> Result<(), DynamicsError> {
    roots(&tree.links, &w.kin, &mut w.r);
    inertias(tree, w);
    match gather(tree, w) {
        Some(k) => Err(tree.singular(k)),
        None => Ok(()),
    }
}

/// Computes S, and writes the inertia of each link about its own origin to `composite`, by block of dofs.
fn inertias<L: Lane>(tree: &Tree, w: &mut Work<L>) {
    for (b, C) in w.composite.iter_mut().enumerate() {
        let at = b * L::PACK;
        let (block, r) = (tree.dofs.block(at), tree.dofs.of_links(&w.r, at, |r| r));
        let R = tree.dofs.rotations(&w.kin, at);
        let S = block.axes::<L>(at, &R, r);
        for (i, (to, _)) in w.sweeps[at..].iter_mut().take(L::PACK).enumerate() {
            *to = S.lane(i);
        }
        if let Some((m, h, J)) = block.inertia::<L>(at, &R) {
            (C.m, C.h, C.J) = (m, h, J);
        }
    }
}

/// Returns the outermost link whose free hinge moves no inertia.
fn gather<L: Lane>(tree: &Tree, w: &mut Work<L>) -> Option<usize> {
    for (k, link) in tree.links.iter().enumerate().rev() {
        let (kin, r) = (&w.kin[k + 1], w.r[k + 1]);
        let (i, n) = (link.v as usize, link.kind.nv());
        let (C, j) = (&w.composite[(i + n - 1) / L::PACK], (i + n - 1) % L::PACK);
        let get = |x: &L::Block| L::get(x, j);
        let h = V3::new(get(&C.h.x), get(&C.h.y), get(&C.h.z));
        let J = &C.J;
        let J = S3 {
            xx: get(&J.xx),
            xy: get(&J.xy),
            xz: get(&J.xz),
            yy: get(&J.yy),
            yz: get(&J.yz),
            zz: get(&J.zz),
        };
        let mut P = Spatial { I: J, H: M3::skew(h), M: S3::diagonal(L::splat(link.m)) };
        if !link.leaf {
            P.add(&w.inertia[k + 1]);
        }
        if link.coordinate == Coordinate::Free {
            for j in (0..n).rev() {
                let (U, D) = column(link.kind, link.pitch, kin, &P, j);
                let D = D + L::splat(link.armature);
                if !D.all_positive() {
                    return Some(k);
                }
                let D_inv = L::splat(1.0) / D;
                let G = V6 { n: U.n.scale(D_inv), f: U.f.scale(D_inv) };
                w.D_inv[i + j] = D_inv;
                w.sweeps[i + j].1 = G.to_parent(r);
                if link.parent != 0 || j > 0 {
                    P.downdate(G, U);
                }
            }
        }
        if link.parent != 0 {
            let P = P.shifted(kin.l);
            let parent = &mut w.inertia[link.parent as usize];
            if link.gathers_first {
                *parent = P;
            } else {
                parent.add(&P);
            }
        }
    }
    None
}

/// Returns P S and S · P S for dof `j` of a link.
#[inline(always)]
pub(crate) fn column<L: Lane>(
    kind: Kind,
    pitch: f64,
    kin: &Kin<L>,
    P: &Spatial<L>,
    j: usize,
) -> (V6<L>, L) {
    let (R, z) = (&kin.R, kin.R.z);
    let turn = |c: V3<L>| {
        let U = V6 { n: P.I.mul(c), f: P.H.tmul(c) };
        (U, c.dot(U.n))
    };
    let slide = |c: V3<L>| {
        let U = V6 { n: P.H.mul(c), f: P.M.mul(c) };
        (U, c.dot(U.f))
    };
    match (kind, j) {
        (Kind::Pin, _) => turn(z),
        (Kind::Slider, _) => slide(z),
        (Kind::Screw, _) => {
            let s = z.scale(L::splat(pitch));
            let U = V6 { n: P.H.mul_add(s, P.I.mul(z)), f: P.H.tmul(z) + P.M.mul(s) };
            (U, z.dot(U.n) + s.dot(U.f))
        }
        (_, 0) => turn(R.x),
        (_, 1) => turn(R.y),
        (_, 2) => turn(R.z),
        (_, 3) => slide(R.x),
        (_, 4) => slide(R.y),
        _ => slide(R.z),
    }
}

/// Replaces `x` (nv) by M⁻¹ x over the free coordinates; zero at prescribed ones. Call [`factor`] first.
pub(crate) fn solve<L: Lane>(tree: &Tree, w: &mut Work<L>, x: &mut [L]) {
    let dofs = &tree.dofs;
    for run in dofs.runs.iter().rev() {
        // Load the sum that the outboard branches have accumulated, if there are any.
        let level = dofs.level[run.start] as usize;
        let leaf = dofs.end[run.start] as usize == run.end;
        let mut z = if leaf { V6::default() } else { w.sweep[level] };
        for i in run.clone().rev() {
            let (S, G) = &w.sweeps[i];
            let eps = S.dot_from(&z, x[i]);
            x[i] = eps * w.D_inv[i];
            z = G.scale_add(eps, z);
        }
        match dofs.parent[run.start] {
            0 => {}
            _ if dofs.last_child[run.start] => w.sweep[level] = z,
            p => {
                let to = &mut w.sweep[dofs.level[p as usize - 1] as usize];
                *to = *to + z;
            }
        }
    }
    for run in &dofs.runs {
        let mut a = match dofs.parent[run.start] {
            0 => V6::default(),
            p => w.sweep[dofs.level[p as usize - 1] as usize],
        };
        for i in run.clone() {
            let (S, G) = &w.sweeps[i];
            // G and D⁻¹ are zero at prescribed dofs.
            x[i] = G.dot_from(&a, x[i]);
            a = S.scale_add(x[i], a);
        }
        w.sweep[dofs.level[run.start] as usize] = a;
    }
}
