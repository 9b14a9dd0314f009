//! Analytic derivatives of inverse and forward dynamics.
//!
//! All quantities are about the root's origin O, in world axes. v and a are the velocity and spatial acceleration of a link at O (a includes gravity
//! as −g at the base), λ is the link inboard, and S is fixed in its own link:
//! ```text
//! Ψ̇ = v_λ × S,  Ψ̈ = a_λ × S + v_λ × Ψ̇,  W = Ψ̇ + v × S
//! p = C v,  f = C a + v ×* p − f_ext                      summed outboard, as are C and B
//! 2B = [2B₁₁, 0; −2 F~, 0],  B₁₁ = −ω~ E − h~ u~          F: force part of p, E = ½ tr(J) 1 − J
//! u_j = C S_j,   t_j = 2 B* S_j = [2 (B₁₁* σ_j + F × s_j); 0]
//! ∂τ_j/∂q_i = t_j · Ψ̇_i + u_j · Ψ̈_i                       i inboard of j, or j itself
//! ∂τ_i/∂q_j = S_i · (2B Ψ̇_j + C Ψ̈_j + S_j ×* f)           without the last term on one link
//! ∂τ_j/∂β_i = t_j · S_i + u_j · W_i
//! ∂τ_i/∂β_j = S_i · (2B S_j + C W_j)
//! ```
//! The form is that of Singh, Russell and Wensing (2022). Writing it out at one point shows that 2B has only twelve numbers, and that they can be
//! summed over bodies.
//!
//! Derivatives with respect to q are along β, that is, of the configuration moved by [`integrate`](linkwork_multibody::Multibody::integrate). The
//! matrices are therefore square for balls and free hinges, too. External wrenches are fixed in their bodies.

use crate::columns::{Columns, Summed, blocks, store, sum_inward};
use crate::composite::{each_axis, roots};
use crate::kinematics::check;
use crate::lane::Lane;
use crate::linear::{M3, S3, V3, V6};
use crate::tree::Tree;
use crate::work::{Composite, Work, Workspace};
use std::ops::Sub;

/// Memory for the derivatives of one mechanism; create it once.
#[derive(Clone, Debug)]
pub struct Derivatives<L: Lane = f64> {
    /// Motion of each link about its root; 0 is the base.
    motion: Vec<Moving<L>>,
    outboard: Vec<Outboard<L::Block>>,
    psi: Columns<L>,
    psi_dot: Columns<L>,
    W: Columns<L>,
    /// Columns that are multiplied with S_i from outboard, for q and β.
    by_q: Columns<L>,
    by_v: Columns<L>,
    u: Columns<L>,
    t: Vec<V3<L::Block>>,
    /// Row i: ∂τ_j/∂q_i and ∂τ_j/∂β_i for j outboard.
    lower: Vec<[L::Block; 2]>,
    /// Row i: ∂τ_i/∂q, then ∂τ_i/∂β, in whole blocks.
    pub(crate) rows: Vec<L::Block>,
    /// Memory for the forward derivatives.
    pub(crate) bias: Vec<L>,
    pub(crate) column: Vec<[L::Block; 2]>,
    pub(crate) sweep: Vec<[V6<L::Block>; 2]>,
}

/// Velocity and spatial acceleration of a link and of the link inboard, and the external force.
#[derive(Clone, Copy, Debug, Default)]
struct Moving<L> {
    v: V6<L>,
    a: V6<L>,
    v_inboard: V6<L>,
    a_inboard: V6<L>,
    f_ext: V6<L>,
}

/// Quantities that are summed outboard of a dof.
#[derive(Clone, Copy, Debug, Default)]
struct Outboard<B> {
    C: Composite<B>,
    B: M3<B>,
    F: V3<B>,
    f: V6<B>,
}

impl<L: Lane> Derivatives<L> {
    /// Creates the memory for `tree`; O(nv²) numbers.
    #[must_use]
    pub fn new(tree: &Tree) -> Self {
        let (n, links) = (tree.nv(), tree.links.len() + 1);
        let width = n.div_ceil(L::PACK);
        let columns = Columns::new(n);
        Self {
            motion: vec![Moving::default(); links],
            outboard: vec![Outboard::default(); width],
            psi: columns.clone(),
            psi_dot: columns.clone(),
            W: columns.clone(),
            by_q: columns.clone(),
            by_v: columns.clone(),
            u: columns,
            t: vec![V3::default(); width],
            lower: vec![Default::default(); n * width],
            rows: vec![L::Block::default(); 2 * n * width],
            bias: vec![L::default(); n],
            column: vec![Default::default(); n],
            sweep: vec![Default::default(); tree.dofs.levels()],
        }
    }

    /// Computes `rows` from the state in `w`, for which `roots` must have been computed.
    pub(crate) fn run(&mut self, tree: &Tree, w: &mut Work<L>, v: &[L], vdot: &[L]) {
        self.motions(tree, w, v, vdot);
        self.each(tree, w);
        sum_inward::<L, _, 28>(&tree.dofs, &mut self.outboard, tree.nv());
        self.products(w);
        for i in 0..tree.nv() {
            self.meet(tree, w, i);
        }
        self.within_links(tree, w);
        self.transpose(tree);
    }

    /// Computes v and a of every link.
    fn motions(&mut self, tree: &Tree, w: &Work<L>, v: &[L], vdot: &[L]) {
        for (k, link) in tree.links.iter().enumerate() {
            let (v_inboard, a_inboard) = match link.parent {
                0 => at_root(w, k + 1),
                p => (self.motion[p as usize].v, self.motion[p as usize].a),
            };
            let mut i = link.v as usize;
            let (mut relative, mut given) = (V6::default(), V6::default());
            each_axis(link, &w.kin[k + 1], w.r[k + 1], |S| {
                relative = S.scale_add(v[i], relative);
                given = S.scale_add(vdot[i], given);
                i += 1;
            });
            self.motion[k + 1] = Moving {
                v: v_inboard + relative,
                a: a_inboard + given + v_inboard.cross_motion(relative),
                v_inboard,
                a_inboard,
                f_ext: w.f_ext[k + 1].to_parent(w.r[k + 1]),
            };
        }
    }

    /// Computes S, Ψ̇, Ψ̈ and W of every dof, and C, B, F and f of each link alone, by block of dofs.
    fn each(&mut self, tree: &Tree, w: &mut Work<L>) {
        for (b, out) in self.outboard.iter_mut().enumerate() {
            let at = b * L::PACK;
            let (dofs, block) = (&tree.dofs, tree.dofs.block(at));
            let R = dofs.rotations(&w.kin, at);
            let r = dofs.of_links(&w.r, at, |r| r);
            let pair = |part: fn(&Moving<L>) -> &V6<L>| V6 {
                n: dofs.of_links(&self.motion, at, |m| &part(m).n),
                f: dofs.of_links(&self.motion, at, |m| &part(m).f),
            };
            let (v, v0, a0) = (pair(|m| &m.v), pair(|m| &m.v_inboard), pair(|m| &m.a_inboard));
            let S = block.axes::<L>(at, &R, r);
            let psi = v0.cross_motion(S);
            w.S.blocks[b] = S;
            self.psi.blocks[b] = psi;
            self.psi_dot.blocks[b] = a0.cross_motion(S) + v0.cross_motion(psi);
            self.W.blocks[b] = psi + v.cross_motion(S);
            let Some((m, h, J)) = block.inertia::<L>(at, &R) else {
                *out = Outboard::default();
                continue;
            };
            let C = Composite { m, h, J }.shifted(r);
            let (a, ext) = (pair(|m| &m.a), pair(|m| &m.f_ext));
            let p = C.apply(v);
            let f = C.apply(a) + v.cross_force(p);
            // If a link has several dofs, the values of its last dof overwrite the values of the others.
            *out = Outboard { C, B: coriolis(&C, v), F: p.f, f: f - ext };
        }
    }

    /// Computes the columns that are multiplied with the rows.
    fn products(&mut self, w: &Work<L>) {
        for (b, out) in self.outboard.iter().enumerate() {
            let (S, psi) = (w.S.blocks[b], self.psi.blocks[b]);
            let two = |x: V3<L::Block>| x + x;
            let twice_B = |x: V3<L::Block>| V6 { n: two(out.B.mul(x)), f: two(x.cross(out.F)) };
            self.by_q.blocks[b] =
                twice_B(psi.n) + out.C.apply(self.psi_dot.blocks[b]) + S.cross_force(out.f);
            self.by_v.blocks[b] = twice_B(S.n) + out.C.apply(self.W.blocks[b]);
            self.u.blocks[b] = out.C.apply(S);
            self.t[b] = two(out.F.cross_add(S.f, out.B.tmul(S.n)));
        }
    }

    /// Multiplies row i with the columns of the dofs outboard.
    #[inline(always)]
    fn meet(&mut self, tree: &Tree, w: &Work<L>, i: usize) {
        let (S, psi) = (w.S.get(i).block(), self.psi.get(i).n.block());
        let (psi_dot, W) = (self.psi_dot.get(i).block(), self.W.get(i).block());
        let width = tree.nv().div_ceil(L::PACK);
        let range = blocks::<L>(&(i..tree.dofs.end[i] as usize));
        let keep = tree.dofs.keep::<L>(i);
        let (q, v) = self.rows[2 * i * width..2 * (i + 1) * width].split_at_mut(width);
        q[range.end..].fill(Default::default());
        v[range.end..].fill(Default::default());
        let rows = q[range.clone()].iter_mut().zip(&mut v[range.clone()]);
        let lower = &mut self.lower[i * width..][range.clone()];
        let (by_q, by_v) = (&self.by_q.blocks[range.clone()], &self.by_v.blocks[range.clone()]);
        let (u, t) = (&self.u.blocks[range.clone()], &self.t[range]);
        let columns = by_q.iter().zip(by_v).zip(u.iter().zip(t));
        for (((q, v), lower), ((by_q, by_v), (u, t))) in rows.zip(lower).zip(columns) {
            (*q, *v) = (S.dot(by_q), S.dot(by_v));
            let dot =
                |a: V3<L::Block>, rest: L::Block| t.x.fma(a.x, t.y.fma(a.y, t.z.fma(a.z, rest)));
            *lower = [dot(psi, u.dot(&psi_dot)), dot(S.n, u.dot(&W))];
        }
        let end = (tree.dofs.end[i] as usize).div_ceil(L::PACK) - 1;
        (q[end], v[end]) = (q[end] * keep, v[end] * keep);
    }

    /// The axes of one link rotate together, so its force term is removed.
    fn within_links(&mut self, tree: &Tree, w: &Work<L>) {
        let width = tree.nv().div_ceil(L::PACK);
        for link in tree.links.iter().filter(|l| l.kind.nv() > 1) {
            let (first, n) = (link.v as usize, link.kind.nv());
            let last = first + n - 1;
            let f = self.outboard[last / L::PACK].f.lane::<L>(last % L::PACK);
            for i in first..last {
                for j in i + 1..=last {
                    let x = w.S.get(i).dot(&w.S.get(j).cross_force(f));
                    let to = &mut self.rows[2 * i * width + j / L::PACK];
                    let value = L::get(to, j % L::PACK) - x;
                    L::set(to, j % L::PACK, value);
                }
            }
        }
    }

    /// Transposes the entries below the diagonal into their rows; zero for unrelated dofs.
    fn transpose(&mut self, tree: &Tree) {
        let width = tree.nv().div_ceil(L::PACK);
        let zero = L::default();
        for j in 0..tree.nv() {
            let row = 2 * j * width;
            let whole = j / L::PACK;
            self.rows[row..row + whole].fill(Default::default());
            self.rows[row + width..row + width + whole].fill(Default::default());
            for i in whole * L::PACK..j {
                L::set(&mut self.rows[row + whole], i % L::PACK, zero);
                L::set(&mut self.rows[row + width + whole], i % L::PACK, zero);
            }
            let mut i = tree.dofs.parent[j];
            while i > 0 {
                let at = i as usize - 1;
                let [q, v] = &self.lower[at * width + j / L::PACK];
                let (q, v) = (L::get(q, j % L::PACK), L::get(v, j % L::PACK));
                L::set(&mut self.rows[row + at / L::PACK], at % L::PACK, q);
                L::set(&mut self.rows[row + width + at / L::PACK], at % L::PACK, v);
                i = tree.dofs.parent[at];
            }
        }
    }

    /// Returns the force that dof i carries: of everything outboard, about the root.
    pub(crate) fn force(&self, i: usize) -> V6<L> {
        self.outboard[i / L::PACK].f.lane(i % L::PACK)
    }

    /// Copies the rows into two dense matrices.
    pub(crate) fn copy(&self, n: usize, dq: &mut [L], dv: &mut [L]) {
        if n == 0 {
            return;
        }
        let width = n.div_ceil(L::PACK);
        let rows = self.rows.chunks_exact(2 * width);
        for ((row, q), v) in rows.zip(dq.chunks_exact_mut(n)).zip(dv.chunks_exact_mut(n)) {
            for b in 0..width {
                store(q, b, row[b]);
                store(v, b, row[width + b]);
            }
        }
    }
}

impl Derivatives {
    /// Computes ∂τ/∂q and ∂τ/∂β of [`inverse_dynamics`](crate::inverse_dynamics) (nv × nv each, row after row: row τ, column coordinate) at the state
    /// of the last [`kinematics`](crate::kinematics()) with the rates `v`, for accelerations `vdot`, with the external wrenches and uniform gravity
    /// of the workspace. ∂τ/∂β̇ is the mass matrix. About 30 multiply-adds for each pair of coordinates of which one is inboard of the other.
    ///
    /// # Panics
    /// If a body is flexible; use [`Tree::check_rigid`] to check.
    pub fn inverse_dynamics(
        &mut self,
        tree: &Tree,
        ws: &mut Workspace,
        v: &[f64],
        vdot: &[f64],
        dtau_dq: &mut [f64],
        dtau_dv: &mut [f64],
    ) {
        tree.assert_rigid("derivatives");
        let n = tree.nv();
        check(v.len(), n, "v");
        check(vdot.len(), n, "vdot");
        check(dtau_dq.len(), n * n, "dtau_dq");
        check(dtau_dv.len(), n * n, "dtau_dv");
        let w = &mut ws.work;
        roots(&tree.links, &w.kin, &mut w.r);
        self.run(tree, w, v, vdot);
        self.copy(n, dtau_dq, dtau_dv);
    }
}

/// Returns velocity and spatial acceleration of the base at the origin of a root, including gravity.
#[inline(always)]
fn at_root<L: Lane>(w: &Work<L>, slot: usize) -> (V6<L>, V6<L>) {
    let (base, l) = (&w.kin[0], w.kin[slot].l);
    let V = base.V.to_child(l);
    // Convert the classical acceleration at the base's origin to the spatial one by subtracting ω × v, then shift to the root's origin.
    let a = base.A.f - w.gravity - base.V.n.cross(base.V.f);
    (V, V6 { n: base.A.n, f: base.A.n.cross_add(l, a) })
}

/// Returns B₁₁ of a body about O at velocity v.
#[inline(always)]
fn coriolis<B: Lane>(C: &Composite<B>, v: V6<B>) -> M3<B> {
    let S3 { xx, xy, xz, yy, yz, zz } = C.J;
    let half = B::splat(0.5) * (xx + yy + zz);
    let minus_E = S3 { xx: xx - half, xy, xz, yy: yy - half, yz, zz: zz - half }.columns();
    let (o, i) = (B::splat(0.0), B::splat(1.0));
    let column = |E: V3<B>, e: V3<B>| v.n.cross(E) - C.h.cross(v.f.cross(e));
    M3 {
        x: column(minus_E.x, V3::new(i, o, o)),
        y: column(minus_E.y, V3::new(o, i, o)),
        z: column(minus_E.z, V3::new(o, o, i)),
    }
}

impl<L: Lane> Sub for V6<L> {
    type Output = Self;
    #[inline(always)]
    fn sub(self, b: Self) -> Self {
        Self { n: self.n - b.n, f: self.f - b.f }
    }
}

impl<L: Lane> V6<L> {
    /// Returns v × m, the rate of change of a motion vector that is fixed in a body moving with v.
    #[inline(always)]
    fn cross_motion(self, m: Self) -> Self {
        Self { n: self.n.cross(m.n), f: self.n.cross_add(m.f, self.f.cross(m.n)) }
    }
    /// Returns v ×* f, the rate of change of a force vector that is fixed in a body moving with v.
    #[inline(always)]
    fn cross_force(self, f: Self) -> Self {
        Self { n: self.n.cross_add(f.n, self.f.cross(f.f)), f: self.n.cross(f.f) }
    }
}

impl<B: Lane> Summed<B, 28> for Outboard<B> {
    #[inline(always)]
    fn numbers(&self) -> [&B; 28] {
        let Composite { m, h, J } = &self.C;
        let (B, F, n, f) = (&self.B, &self.F, &self.f.n, &self.f.f);
        [
            m, &h.x, &h.y, &h.z, &J.xx, &J.xy, &J.xz, &J.yy, &J.yz, &J.zz, &B.x.x, &B.x.y, &B.x.z,
            &B.y.x, &B.y.y, &B.y.z, &B.z.x, &B.z.y, &B.z.z, &F.x, &F.y, &F.z, &n.x, &n.y, &n.z,
            &f.x, &f.y, &f.z,
        ]
    }

    #[inline(always)]
    fn numbers_mut(&mut self) -> [&mut B; 28] {
        let Composite { m, h, J } = &mut self.C;
        let (B, F, n, f) = (&mut self.B, &mut self.F, &mut self.f.n, &mut self.f.f);
        [
            m, &mut h.x, &mut h.y, &mut h.z, &mut J.xx, &mut J.xy, &mut J.xz, &mut J.yy, &mut J.yz,
            &mut J.zz, &mut B.x.x, &mut B.x.y, &mut B.x.z, &mut B.y.x, &mut B.y.y, &mut B.y.z,
            &mut B.z.x, &mut B.z.y, &mut B.z.z, &mut F.x, &mut F.y, &mut F.z, &mut n.x, &mut n.y,
            &mut n.z, &mut f.x, &mut f.y, &mut f.z,
        ]
    }
}
