//! A mechanism by columns: each degree of freedom as if it were a separate link.
//!
//! Matrices have a column for each degree of freedom, and everything that is not recursive can be computed for a block of columns at once. Therefore
//! the constants are stored by component, and a link with several dofs is a chain of dofs at one point, of which the last carries the inertia. Let a
//! be the axis of a dof in its link's axes (angular, linear), and r the position of the link's origin relative to the reference point:
//! ```text
//! S = [σ; r × σ + R a_v],  σ = R a_ω            a column of H*
//! ```

use crate::lane::Lane;
use crate::linear::{M3, S3, V3, V6};
use crate::tree::{Kind, Link};
use crate::work::Kin;
use linkwork_multibody::Coordinate;
use std::ops::Range;

/// Maximum width of a block.
pub(crate) const WIDEST: usize = 4;

/// One constant of [`WIDEST`] dofs.
type Wide = [f64; WIDEST];

/// The constants of [`WIDEST`] dofs.
#[derive(Clone, Debug, Default)]
pub(crate) struct Block {
    needs: Needs,
    angular: [Wide; 3],
    linear: [Wide; 3],
    m: Wide,
    h: [Wide; 3],
    /// xx, xy, xz, yy, yz, zz.
    J: [Wide; 6],
}

/// Features that the computation of a block of columns needs.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Needs {
    /// Some dof is not a pin.
    pub other_axes: bool,
    /// Some dof carries mass.
    pub inertia: bool,
    /// Some inertia has an xy term.
    pub xy: bool,
}

/// Constants by dof, padded to whole blocks.
#[derive(Clone, Debug, Default)]
pub(crate) struct Dofs {
    /// Slot of the link.
    pub link: Vec<u32>,
    /// Index of the dof inboard plus one; 0 at the base.
    pub parent: Vec<u32>,
    /// Index after the last dof outboard.
    pub end: Vec<u32>,
    pub armature: Vec<f64>,
    /// Its acceleration is prescribed.
    pub prescribed: Vec<bool>,
    /// True if no sibling follows, so the dof may reuse the memory of the data that its parent passes outward.
    pub last_child: Vec<bool>,
    /// Index of that memory: 0 at the base.
    pub level: Vec<u32>,
    /// Most pairs of dofs are related, so matrices are mirrored as a whole.
    pub dense: bool,
    /// Maximal runs of dofs that have at most one child each; they are swept together.
    pub runs: Vec<Range<usize>>,
    /// For each block of columns: the related rows, inboard and outboard, as runs.
    pub meets: Vec<Vec<Range<usize>>>,
    /// Mask of the last block outboard of each dof: one for columns outboard, zero otherwise.
    keep: Vec<Wide>,
    blocks: Vec<Block>,
}

impl Dofs {
    pub fn new(links: &[Link], nv: usize) -> Self {
        let padded = nv.next_multiple_of(WIDEST);
        let mut d = Self {
            link: vec![0; padded],
            parent: vec![0; padded],
            end: vec![0; padded],
            armature: vec![0.0; padded],
            prescribed: vec![false; padded],
            last_child: vec![true; padded],
            level: vec![0; padded],
            keep: vec![[1.0; WIDEST]; padded],
            dense: true,
            runs: Vec::new(),
            meets: Vec::new(),
            blocks: vec![Block::default(); padded / WIDEST],
        };
        // Each entry is the last dof of a slot, plus one.
        let mut last = vec![0; links.len() + 1];
        for (k, link) in links.iter().enumerate() {
            let (v, n) = (link.v as usize, link.kind.nv());
            for j in 0..n {
                let i = v + j;
                d.link[i] = k as u32 + 1;
                d.parent[i] = if j > 0 { i as u32 } else { last[link.parent as usize] };
                d.end[i] = link.v_end;
                d.armature[i] = link.armature;
                d.prescribed[i] = link.coordinate == Coordinate::Prescribed;
                d.last_child[i] = j > 0 || link.gathers_first;
                if d.parent[i] > 0 {
                    let parent = d.level[d.parent[i] as usize - 1];
                    d.level[i] = parent + u32::from(!d.last_child[i]);
                }
                let end = link.v_end as usize;
                for (lane, keep) in d.keep[i].iter_mut().enumerate() {
                    *keep = f64::from((end - 1) / WIDEST * WIDEST + lane < end);
                }
                let (b, lane) = (&mut d.blocks[i / WIDEST], i % WIDEST);
                b.needs.other_axes |= link.kind != Kind::Pin;
                match link.kind {
                    Kind::Pin => b.angular[2][lane] = 1.0,
                    Kind::Slider => b.linear[2][lane] = 1.0,
                    Kind::Screw => (b.angular[2][lane], b.linear[2][lane]) = (1.0, link.pitch),
                    Kind::Ball | Kind::Free if j < 3 => b.angular[j][lane] = 1.0,
                    Kind::Ball | Kind::Free => b.linear[j - 3][lane] = 1.0,
                }
            }
            let i = v + n - 1;
            d.blocks[i / WIDEST].needs.inertia = true;
            d.blocks[i / WIDEST].needs.xy |= link.J.xy != 0.0;
            d.put_inertia(link);
            last[k + 1] = (i + 1) as u32;
        }
        d.follow(nv);
        // Padding uses the last link, without mass and without an axis.
        let fill = d.link.get(nv.wrapping_sub(1)).copied().unwrap_or(0);
        d.link[nv..].fill(fill);
        d
    }

    /// Sets the inertia of a link. From then on its block always computes xy terms, so that equal inertias give bit-identical results, regardless of
    /// earlier values.
    pub fn set_inertia(&mut self, link: &Link) {
        let i = link.v as usize + link.kind.nv() - 1;
        if let Some(block) = self.blocks.get_mut(i / WIDEST) {
            block.needs.xy = true;
            self.put_inertia(link);
        }
    }

    fn put_inertia(&mut self, link: &Link) {
        let i = link.v as usize + link.kind.nv() - 1;
        let (b, lane, J) = (&mut self.blocks[i / WIDEST], i % WIDEST, &link.J);
        b.m[lane] = link.m;
        let h = [link.h.x, link.h.y, link.h.z];
        b.h.iter_mut().zip(h).for_each(|(to, x)| to[lane] = x);
        let J = [J.xx, J.xy, J.xz, J.yy, J.yz, J.zz];
        b.J.iter_mut().zip(J).for_each(|(to, x)| to[lane] = x);
    }

    /// Returns the part that the units of a tree with flexible bodies need; nothing here follows the structure of the tree. The link of a modal dof
    /// is the first station of its body.
    pub fn flat(links: &[Link], modal: &[(Range<usize>, u32)], nv: usize) -> Self {
        let padded = nv.next_multiple_of(WIDEST);
        let mut d = Self {
            link: vec![0; padded],
            armature: vec![0.0; padded],
            prescribed: vec![false; padded],
            ..Self::default()
        };
        for (k, link) in links.iter().enumerate() {
            let places = link.v as usize..link.v as usize + link.kind.nv();
            d.link[places.clone()].fill(k as u32 + 1);
            d.armature[places.clone()].fill(link.armature);
            d.prescribed[places].fill(link.coordinate == Coordinate::Prescribed);
        }
        for (places, slot) in modal {
            d.link[places.clone()].fill(*slot);
        }
        d
    }

    /// Determines the runs, and which rows are related to which columns.
    fn follow(&mut self, nv: usize) {
        let mut children = vec![0; nv];
        for p in self.parent[..nv].iter().filter(|p| **p > 0) {
            children[*p as usize - 1] += 1;
        }
        for i in 0..nv {
            match self.runs.last_mut() {
                Some(run) if self.parent[i] as usize == i && i > 0 && children[i - 1] == 1 => {
                    run.end = i + 1;
                }
                _ => self.runs.push(i..i + 1),
            }
        }
        let pairs: usize = (0..nv).map(|i| self.end[i] as usize - i - 1).sum();
        self.dense = 3 * pairs > nv * nv.saturating_sub(1);
        // Each block meets the dofs outboard of its own dofs and, inboard, runs of dofs up to the point where they
        // branch off, so no dof is visited twice for a block.
        let mut run_of = vec![0; nv];
        for (k, run) in self.runs.iter().enumerate() {
            run_of[run.clone()].fill(k);
        }
        let mut met: Vec<Range<usize>> = Vec::new();
        for start in (0..nv).step_by(WIDEST) {
            met.clear();
            for c in start..(start + WIDEST).min(nv) {
                met.push(c..self.end[c] as usize);
                let mut inboard = self.parent[c] as usize;
                // The dofs inboard of a dof of this block are already included.
                while inboard > 0 && inboard <= start {
                    let first = self.runs[run_of[inboard - 1]].start;
                    met.push(first..inboard);
                    inboard = self.parent[first] as usize;
                }
            }
            met.sort_by_key(|r| r.start);
            let mut runs: Vec<Range<usize>> = Vec::new();
            for r in &met {
                match runs.last_mut() {
                    Some(run) if r.start <= run.end => run.end = run.end.max(r.end),
                    _ => runs.push(r.clone()),
                }
            }
            self.meets.push(runs);
        }
    }

    /// Returns the number of memories for data that are passed outward, one for each level.
    pub fn levels(&self) -> usize {
        self.level.iter().max().map_or(0, |l| *l as usize + 1)
    }

    /// Returns ones and zeros that select the dofs outboard of dof `i` in the last block of its row.
    #[inline(always)]
    pub fn keep<L: Lane>(&self, i: usize) -> L::Block {
        if L::PACK == 1 { L::splat(1.0).block() } else { L::constants(&self.keep[i], 0) }
    }

    /// Returns the constants of the columns from `at` on.
    #[inline(always)]
    pub fn block(&self, at: usize) -> &Block {
        &self.blocks[at / WIDEST]
    }

    /// Gathers one vector of the links of a block of dofs.
    #[inline(always)]
    pub fn of_links<L: Lane, T>(
        &self,
        all: &[T],
        at: usize,
        part: impl Fn(&T) -> &V3<L>,
    ) -> V3<L::Block> {
        let link = &self.link[at..at + L::PACK];
        let x = |i: usize| part(&all[link[i] as usize]);
        V3::new(L::collect(|i| x(i).x), L::collect(|i| x(i).y), L::collect(|i| x(i).z))
    }

    /// Gathers the rotations of the links of a block of dofs.
    #[inline(always)]
    pub fn rotations<L: Lane>(&self, kin: &[Kin<L>], at: usize) -> M3<L::Block> {
        M3 {
            x: self.of_links(kin, at, |k| &k.R.x),
            y: self.of_links(kin, at, |k| &k.R.y),
            z: self.of_links(kin, at, |k| &k.R.z),
        }
    }
}

#[inline(always)]
fn three<L: Lane>(x: &[Wide; 3], at: usize) -> V3<L::Block> {
    V3::new(L::constants(&x[0], at), L::constants(&x[1], at), L::constants(&x[2], at))
}

impl Block {
    /// Returns mass, first moment and inertia of the links about their origins, world axes; `None` if no dof here carries mass. `at` is the first
    /// dof.
    #[inline(always)]
    pub fn inertia<L: Lane>(
        &self,
        at: usize,
        R: &M3<L::Block>,
    ) -> Option<(L::Block, V3<L::Block>, S3<L::Block>)> {
        if !self.needs.inertia {
            return None;
        }
        let J = |c: usize| L::constants(&self.J[c], at);
        let local = S3 { xx: J(0), xy: J(1), xz: J(2), yy: J(3), yz: J(4), zz: J(5) };
        let mut world = local.rotate_xy_free(R);
        if self.needs.xy {
            world = world.add_sym_outer(R.x.scale(local.xy), R.y);
        }
        Some((L::constants(&self.m, at), R.mul(three::<L>(&self.h, at)), world))
    }

    /// Computes a block of columns of H* from the links' rotations and positions `r`.
    #[inline(always)]
    pub fn axes<L: Lane>(&self, at: usize, R: &M3<L::Block>, r: V3<L::Block>) -> V6<L::Block> {
        if !self.needs.other_axes {
            return V6 { n: R.z, f: r.cross(R.z) };
        }
        let n = R.mul(three::<L>(&self.angular, at));
        V6 { n, f: r.cross_add(n, R.mul(three::<L>(&self.linear, at))) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Forests of dofs in depth-first order, from a chain to all dofs on the base.
    #[test]
    fn a_block_meets_what_is_inboard_and_outboard_of_its_dofs() {
        let mut seed = 7_u64;
        let mut draw = |below: usize| {
            seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
            (seed >> 33) as usize % below
        };
        for case in 0..200 {
            let nv = 1 + draw(40);
            let mut dofs = Dofs::default();
            // The path contains the dofs inboard of the last one, with the base at the bottom.
            let mut path = vec![0_u32];
            for i in 0..nv {
                let up = if case % 4 == 0 { 0 } else { draw(path.len().min(1 + case % 4)) };
                path.truncate(path.len() - up);
                dofs.parent.push(*path.last().unwrap_or(&0));
                path.push(i as u32 + 1);
            }
            let mut end: Vec<usize> = (1..=nv).collect();
            for i in (0..nv).rev() {
                if let Some(p) = (dofs.parent[i] as usize).checked_sub(1) {
                    end[p] = end[p].max(end[i]);
                }
            }
            dofs.end = end.iter().map(|e| *e as u32).collect();
            dofs.follow(nv);
            let inboard = |mut of: usize, i: usize| {
                while of > i {
                    let Some(p) = (dofs.parent[of] as usize).checked_sub(1) else { return false };
                    of = p;
                }
                of == i
            };
            for (k, runs) in dofs.meets.iter().enumerate() {
                let block = k * WIDEST..((k + 1) * WIDEST).min(nv);
                let meets = |i: usize| block.clone().any(|c| inboard(c, i) || inboard(i, c));
                let wanted: Vec<usize> = (0..nv).filter(|i| meets(*i)).collect();
                let got: Vec<usize> = runs.iter().cloned().flatten().collect();
                assert_eq!(got, wanted, "case {case}, block {k}: {:?}", dofs.parent);
                let apart = runs.windows(2).all(|r| r[0].end < r[1].start);
                assert!(apart, "case {case}, block {k}: {runs:?}");
            }
        }
    }
}
