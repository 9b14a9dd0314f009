//! Operational-space compliance: accelerations of nodes for unit wrenches on nodes.
//!
//! ```text
//! Λ⁻¹ = B* Ω B,   Ω = ψ* H* D⁻¹ H ψ
//! ```
//! It is evaluated from the middle: for each node the six columns Hψ B of unit wrenches propagate from the node to the base, and two nodes are
//! combined on the part of the path that they share:
//! ```text
//! ε_i = S_i · z,   z⁺ = z − G ε_i                 along the path of a node
//! Λ⁻¹(x, y) = Σ ε_i(x) D_i⁻¹ ε_i(y)               over dofs inboard of both
//! ```
//! A prescribed dof has D⁻¹ = 0 and G = 0, which is correct. Cost: the articulated-body inertias, and for each node twelve multiply-adds by six for
//! each dof of its path.

use crate::articulated::factor;
use crate::error::DynamicsError;
use crate::kinematics::check;
use crate::lane::Lane;
use crate::linear::{V3, V6};
use crate::query::v3;
use crate::tree::Tree;
use crate::work::{Work, Workspace};
use linkwork_multibody::NodeId;

/// The compliance of a set of nodes: created once, evaluated at any configuration.
#[derive(Clone, Debug)]
pub struct Compliance<L: Lane = f64> {
    nodes: Vec<NodeId>,
    /// Dofs from each node to the base, one node after another.
    path: Vec<u32>,
    /// Start of each node's path, and the end of the last one.
    start: Vec<usize>,
    /// ε of each dof of each path: six numbers in whole blocks.
    eps: Vec<L::Block>,
}

/// Returns the number of blocks for the six columns of a node.
const fn blocks<L: Lane>() -> usize {
    6_usize.div_ceil(L::PACK)
}

impl<L: Lane> Compliance<L> {
    /// Creates the compliance of these nodes of `tree`, in this order; a node may occur twice. O(nodes × depth).
    #[must_use]
    pub fn new(tree: &Tree, nodes: &[NodeId]) -> Self {
        let (mut path, mut start) = (Vec::new(), vec![0]);
        for n in nodes {
            // Trees with flexible bodies have no such path and do not need one.
            let slot = tree.node(*n).slot as usize;
            let mut slot = if tree.is_flexible() { 0 } else { slot };
            while slot != 0 {
                let link = &tree.links[slot - 1];
                path.extend((link.v..link.v + link.kind.nv() as u32).rev());
                slot = link.parent as usize;
            }
            start.push(path.len());
        }
        let eps = vec![L::Block::default(); path.len() * blocks::<L>()];
        Self { nodes: nodes.to_vec(), path, start, eps }
    }

    /// Returns the number of rows of the matrix: six per node.
    #[must_use]
    pub fn size(&self) -> usize {
        6 * self.nodes.len()
    }

    pub(crate) fn nodes(&self) -> &[NodeId] {
        &self.nodes
    }

    pub(crate) fn run(
        &mut self,
        tree: &Tree,
        w: &mut Work<L>,
        out: &mut [L],
    ) -> Result<(), DynamicsError> {
        factor(tree, w)?;
        for n in 0..self.nodes.len() {
            self.unit_wrenches(tree, w, n);
        }
        let size = self.size();
        for x in 0..self.nodes.len() {
            for y in 0..=x {
                self.meet(w, (x, y), out, size);
            }
        }
        Ok(())
    }

    /// Computes ε of the six unit wrenches on a node, about its origin, world axes.
    fn unit_wrenches(&mut self, tree: &Tree, w: &Work<L>, n: usize) {
        let at = tree.node(self.nodes[n]);
        let slot = at.slot as usize;
        let p = w.kin[slot].R.mul_add(V3::splat(&v3(&at.p)), w.r[slot]);
        let (o, i) = (L::default(), L::splat(1.0));
        let unit = |c: usize| {
            let e = [V3::new(i, o, o), V3::new(o, i, o), V3::new(o, o, i)][c % 3];
            if c < 3 { V6 { n: e, f: V3::default() } } else { V6 { n: p.cross(e), f: e } }
        };
        let mut z = [V6::<L::Block>::default(); 6];
        for c in 0..6 {
            let unit = unit(c);
            let to = &mut z[c / L::PACK];
            for (to, x) in [
                (&mut to.n.x, unit.n.x),
                (&mut to.n.y, unit.n.y),
                (&mut to.n.z, unit.n.z),
                (&mut to.f.x, unit.f.x),
                (&mut to.f.y, unit.f.y),
                (&mut to.f.z, unit.f.z),
            ] {
                L::set(to, c % L::PACK, x);
            }
        }
        let z = &mut z[..blocks::<L>()];
        let range = self.start[n]..self.start[n + 1];
        let eps = self.eps[range.start * blocks::<L>()..].chunks_exact_mut(blocks::<L>());
        for (i, eps) in self.path[range].iter().zip(eps) {
            let (S, G) = w.sweeps[*i as usize];
            let (S, G) = (S.block(), G.block());
            for (z, eps) in z.iter_mut().zip(eps) {
                *eps = S.dot(z);
                *z = G.scale_add(-*eps, *z);
            }
        }
    }

    /// Computes the six by six block of nodes x and y, and its mirror image.
    fn meet(&self, w: &Work<L>, (x, y): (usize, usize), out: &mut [L], size: usize) {
        let (px, py) = (self.path(x), self.path(y));
        let mut sum = [[L::Block::default(); 6]; 6];
        // Sum from the base outward along the common part of both paths.
        let common = px.iter().rev().zip(py.iter().rev()).take_while(|(a, b)| a == b).count();
        for back in 1..=common {
            let i = px[px.len() - back] as usize;
            let (ex, ey) = (self.eps(x, px.len() - back), self.eps(y, py.len() - back));
            for (a, row) in sum.iter_mut().enumerate() {
                let s = (L::get(&ex[a / L::PACK], a % L::PACK) * w.D_inv[i]).block();
                for (to, e) in row.iter_mut().zip(ey) {
                    *to = s.fma(*e, *to);
                }
            }
        }
        for (a, row) in sum.iter().enumerate() {
            for b in 0..6 {
                let value = L::get(&row[b / L::PACK], b % L::PACK);
                out[(6 * x + a) * size + 6 * y + b] = value;
                out[(6 * y + b) * size + 6 * x + a] = value;
            }
        }
    }

    fn path(&self, n: usize) -> &[u32] {
        &self.path[self.start[n]..self.start[n + 1]]
    }

    fn eps(&self, n: usize, place: usize) -> &[L::Block] {
        let at = (self.start[n] + place) * blocks::<L>();
        &self.eps[at..at + blocks::<L>()]
    }
}

impl Compliance {
    /// Computes Λ⁻¹ (size × size, row after row, symmetric): the acceleration [α; a] of each node, world axes at its origin, for unit wrenches
    /// [moment; force] on each node, at the last [`kinematics`](crate::kinematics()) or [`poses`](crate::poses). Prescribed coordinates do not
    /// accelerate.
    ///
    /// # Errors
    /// [`DynamicsError::Singular`] if a free subhinge moves no inertia.
    pub fn compute(
        &mut self,
        tree: &Tree,
        ws: &mut Workspace,
        out: &mut [f64],
    ) -> Result<(), DynamicsError> {
        check(out.len(), self.size() * self.size(), "compliance");
        if let Some(flex) = tree.flexible.as_deref() {
            return crate::flexible::compliance(tree, flex, ws, &self.nodes, out);
        }
        self.run(tree, &mut ws.work, out)
    }
}
