//! Memory layout of the factor E for sweeps: y in vectors of four degrees of freedom, and for each group the vectors it touches with its rows.
//!
//! ```text
//! group   vectors of y it meets: k₁ … k_n;    n × rows vectors of E, 0 where it has no entry
//! E_g y = Σ row · y_k,   y_k += Σ λ row       2 × rows × n multiplications of vectors
//! ```
//! A free body touches two vectors, a chain a quarter of its degrees of freedom. Many contacts between free bodies are solved in batches of four
//! instead (lanes/mod.rs), and then every cluster of degrees of freedom has separate vectors.

use super::lanes::{Change, Colours, Lanes, NONE};
use super::local::Block;
use super::problem::Problem;
use wide::f64x4;

/// E and y of a problem; reuses its memory.
#[derive(Clone, Debug, Default)]
pub(crate) struct Layout {
    /// Groups that are solved one by one, with their local solutions.
    groups: Vec<Region>,
    blocks: Vec<Block>,
    /// Groups that are solved in batches.
    pub lanes: Lanes,
    colours: Colours,
    /// First vector of y of each cluster, if there are batches, and the index in y of each degree of freedom.
    vector: Vec<u32>,
    place: Vec<u32>,
    /// Scale of the compliance of each group: trace of W divided by the number of rows.
    pub scales: Vec<f64>,
    at: Vec<u32>,
    e: Vec<f64x4>,
    /// Eᵀ λ.
    pub y: Vec<f64x4>,
    dofs: usize,
}

/// Ranges of a group's vectors.
#[derive(Clone, Copy, Debug)]
struct Region {
    group: usize,
    at: usize,
    n: usize,
    e: usize,
    rows: usize,
}

/// A group's rows.
#[derive(Clone, Copy)]
pub(crate) struct Rows<'a> {
    at: &'a [u32],
    e: &'a [f64x4],
    rows: usize,
}

impl Layout {
    /// Builds the layout of a problem. O(entries).
    pub fn set(&mut self, problem: &Problem) {
        self.groups.clear();
        self.blocks.clear();
        self.at.clear();
        self.e.clear();
        self.scales.clear();
        self.scales.resize(problem.groups(), 0.0);
        self.dofs = problem.factor.dofs;
        self.place.clear();
        if self.colours.set(problem) {
            let vectors = self.pad();
            self.clear_y(vectors + 2);
            let of = |c: u32| if c == NONE { vectors } else { self.vector[c as usize] };
            self.lanes.set(problem, &self.colours, of, &mut self.scales);
            for i in 0..self.colours.singles.len() {
                self.add(problem, self.colours.singles[i] as usize);
            }
        } else {
            self.lanes.clear();
            self.clear_y(self.dofs.div_ceil(4) as u32);
            self.place.extend(0..self.dofs as u32);
            for g in 0..problem.groups() {
                self.add(problem, g);
            }
        }
    }

    fn clear_y(&mut self, vectors: u32) {
        self.y.clear();
        self.y.resize(vectors as usize, f64x4::splat(0.0));
    }

    /// Gives each cluster separate vectors. Returns their number.
    fn pad(&mut self) -> u32 {
        let mut end = 0;
        self.vector.clear();
        for size in self.colours.sizes() {
            self.vector.push(end);
            self.place.extend(4 * end..4 * end + size);
            end += size.div_ceil(4);
        }
        end
    }

    /// Adds a group that is solved on its own.
    fn add(&mut self, problem: &Problem, g: usize) {
        let (dof, e) = problem.entries(g);
        let rows = problem.cones[g].rows();
        let region = Region { group: g, at: self.at.len(), n: 0, e: self.e.len(), rows };
        let (mut k, mut lanes) = (u32::MAX, [[0.0; 4]; 4]);
        for (d, e) in dof.iter().zip(e) {
            let d = self.place[*d as usize];
            if d / 4 != k {
                self.close(k, &lanes, rows);
                (k, lanes) = (d / 4, [[0.0; 4]; 4]);
            }
            lanes[(d % 4) as usize] = *e;
        }
        self.close(k, &lanes, rows);
        self.groups.push(Region { n: self.at.len() - region.at, ..region });
        let block = Block::new(problem, g, self.rows(self.groups.len() - 1).compliance());
        self.scales[g] = block.scale;
        self.blocks.push(block);
    }

    /// Returns false if a compliance overflows or is NaN.
    pub fn is_finite(&self) -> bool {
        self.blocks.iter().fold(true, |fine, b| fine & b.is_finite()) & self.lanes.is_finite()
    }

    /// Adds a vector of a group: its four degrees of freedom by rows.
    #[inline(always)]
    fn close(&mut self, k: u32, lanes: &[[f64; 4]; 4], rows: usize) {
        if k != u32::MAX {
            self.at.push(k);
            let e = f64x4::transpose(lanes.map(f64x4::new));
            if rows == 3 {
                self.e.extend_from_slice(&[e[0], e[1], e[2]]);
            } else {
                self.e.extend_from_slice(&e[..rows]);
            }
        }
    }

    /// Allocates for the given numbers of groups, entries and degrees of freedom.
    pub fn reserve(&mut self, groups: usize, entries: usize, dofs: usize) {
        super::room(&mut self.groups, groups);
        super::room(&mut self.blocks, groups);
        super::room(&mut self.scales, groups);
        super::room(&mut self.at, entries);
        super::room(&mut self.e, 4 * entries);
        super::room(&mut self.place, dofs);
        super::room(&mut self.vector, dofs);
        // A cluster of one degree of freedom has a separate vector, and batches need two vectors that stay 0.
        super::room(&mut self.y, dofs + 2);
        self.lanes.reserve(groups);
        self.colours.reserve(groups, dofs);
    }

    fn rows(&self, i: usize) -> Rows<'_> {
        let Region { at, n, e, rows, .. } = self.groups[i];
        Rows { at: &self.at[at..at + n], e: &self.e[e..e + n * rows], rows }
    }

    /// Returns the groups that are solved one by one.
    pub fn singles(&self) -> impl Iterator<Item = usize> {
        self.groups.iter().map(|p| p.group)
    }

    /// Calls `f` with each group that is solved on its own, its block, its rows and y. Changes of y by `f` are kept.
    #[inline(always)]
    pub fn each(&mut self, mut f: impl FnMut(usize, &mut Block, Rows<'_>, &mut [f64x4])) {
        for (p, block) in self.groups.iter().zip(&mut self.blocks) {
            let (at, e) = (&self.at[p.at..p.at + p.n], &self.e[p.e..p.e + p.n * p.rows]);
            f(p.group, block, Rows { at, e, rows: p.rows }, &mut self.y);
        }
    }

    /// Sweeps over the batches (see [`Lanes::sweep`]).
    pub fn sweep_lanes(&mut self, relaxation: f64, quiet: f64, change: &mut Change) -> bool {
        self.lanes.sweep(relaxation, quiet, &mut self.y, change)
    }

    /// Computes y = Eᵀ λ.
    pub fn pull(&mut self, lambda: &[[f64; 4]]) {
        self.y.fill(f64x4::splat(0.0));
        self.lanes.pull(lambda, &mut self.y);
        self.each(|g, _, rows, y| {
            if lambda[g] != [0.0; 4] {
                rows.spread(f64x4::new(lambda[g]), y);
            }
        });
    }

    /// Returns y by degrees of freedom.
    pub fn pulled(&self) -> impl Iterator<Item = f64> {
        self.place.iter().map(|d| self.y[*d as usize / 4].as_array()[*d as usize % 4])
    }
}

impl Rows<'_> {
    /// Computes E_g y.
    #[inline(always)]
    pub fn gathered(&self, y: &[f64x4]) -> f64x4 {
        let mut sum = [f64x4::splat(0.0); 4];
        if self.rows == 3 {
            // Contacts with friction have three independent chains of operations.
            for (k, e) in self.at.iter().zip(self.e.as_chunks::<3>().0) {
                let y = y[*k as usize];
                sum[0] = e[0].mul_add(y, sum[0]);
                sum[1] = e[1].mul_add(y, sum[1]);
                sum[2] = e[2].mul_add(y, sum[2]);
            }
        } else {
            for (k, e) in self.at.iter().zip(self.e.chunks_exact(self.rows)) {
                for (sum, e) in sum.iter_mut().zip(e) {
                    *sum = e.mul_add(y[*k as usize], *sum);
                }
            }
        }
        total(sum)
    }

    /// Computes y += E_gᵀ λ.
    #[inline(always)]
    pub fn spread(&self, lambda: f64x4, y: &mut [f64x4]) {
        let l = lambda.to_array().map(f64x4::splat);
        if self.rows == 3 {
            for (k, e) in self.at.iter().zip(self.e.as_chunks::<3>().0) {
                let y = &mut y[*k as usize];
                *y = e[2].mul_add(l[2], e[1].mul_add(l[1], e[0].mul_add(l[0], *y)));
            }
        } else {
            for (k, e) in self.at.iter().zip(self.e.chunks_exact(self.rows)) {
                let y = &mut y[*k as usize];
                *y = e.iter().zip(l).fold(*y, |y, (e, l)| e.mul_add(l, y));
            }
        }
    }

    /// Computes E_g E_gᵀ.
    #[inline(always)]
    fn compliance(&self) -> [[f64; 4]; 4] {
        let zero = f64x4::splat(0.0);
        if self.rows == 3 {
            let mut w = [zero; 6];
            for e in self.e.as_chunks::<3>().0 {
                w[0] = e[0].mul_add(e[0], w[0]);
                w[1] = e[0].mul_add(e[1], w[1]);
                w[2] = e[0].mul_add(e[2], w[2]);
                w[3] = e[1].mul_add(e[1], w[3]);
                w[4] = e[1].mul_add(e[2], w[4]);
                w[5] = e[2].mul_add(e[2], w[5]);
            }
            let [a, b, c, d] = total([w[0], w[1], w[2], w[3]]).to_array();
            let [f, g, ..] = total([w[4], w[5], zero, zero]).to_array();
            return [[a, b, c, 0.0], [b, d, f, 0.0], [c, f, g, 0.0], [0.0; 4]];
        }
        let mut W = [[zero; 4]; 4];
        for e in self.e.chunks_exact(self.rows) {
            for i in 0..self.rows {
                for j in 0..self.rows {
                    W[i][j] = e[i].mul_add(e[j], W[i][j]);
                }
            }
        }
        W.map(|row| total(row).to_array())
    }
}

/// Returns the sum of each vector's lanes.
#[inline(always)]
fn total(x: [f64x4; 4]) -> f64x4 {
    let [a, b, c, d] = f64x4::transpose(x);
    (a + b) + (c + d)
}

#[cfg(test)]
mod tests {
    use super::super::problem::Factor;
    use super::super::samples::{CONES, number};
    use super::*;

    /// Groups of one to four rows on 0 to 9 degrees of freedom: E y, Eᵀ λ and E Eᵀ agree with the entries.
    #[test]
    fn the_layout_multiplies_as_the_entries_do() {
        let (dofs, mut seed) = (11, 3);
        let lists: [&[u32]; 6] =
            [&[0, 2, 3], &[0, 2, 3], &[], &[1, 4, 5, 6], &[0, 1, 2, 3, 5, 7, 8, 9, 10], &[10]];
        let (mut cones, mut start, mut dof, mut e) = (vec![], vec![0], vec![], vec![]);
        for (list, cone) in lists.iter().flat_map(|l| CONES.iter().map(move |c| (l, c))) {
            cones.push(*cone);
            for d in *list {
                dof.push(*d);
                let mut row = [0.0; 4];
                row[..cone.rows()].fill_with(|| number(&mut seed));
                e.push(row);
            }
            start.push(dof.len() as u32);
        }
        let b = vec![[0.0; 4]; cones.len()];
        let factor = Factor { start: &start, dof: &dof, e: &e, dofs };
        let problem = Problem::new(factor, &cones, &b, &[]).expect("a good problem");
        let mut layout = Layout::default();
        layout.set(&problem);
        let lambda: Vec<[f64; 4]> = (cones.iter())
            .map(|c| {
                let mut l = [0.0; 4];
                l[..c.rows()].fill_with(|| number(&mut seed));
                l
            })
            .collect();
        layout.pull(&lambda);
        let mut y = vec![0.0; dofs];
        (0..cones.len()).for_each(|g| problem.scatter(g, &lambda[g], &mut y));
        let near = |a: &[f64], b: &[f64]| {
            assert!(a.len() == b.len(), "{a:?} {b:?}");
            assert!(a.iter().zip(b).all(|(a, b)| (a - b).abs() < 1e-13), "{a:?} {b:?}");
        };
        let pulled = |l: &Layout| l.pulled().collect::<Vec<f64>>();
        near(&pulled(&layout), &y);
        let mut seen = 0;
        layout.each(|g, _, rows, now| {
            assert_eq!(g, seen);
            seen += 1;
            near(&rows.gathered(now).to_array(), &problem.gathered(g, &y));
        });
        assert_eq!(seen, cones.len());
        layout.each(|g, _, rows, _| {
            let W = rows.compliance();
            for i in 0..4 {
                let row: [f64; 4] =
                    std::array::from_fn(|j| problem.entries(g).1.iter().map(|e| e[i] * e[j]).sum());
                near(&W[i], &row);
            }
        });
        // Each group uses the y that the previous group changed.
        layout.each(|g, _, rows, y| rows.spread(f64x4::new(lambda[g]), y));
        near(&pulled(&layout), &y.iter().map(|y| 2.0 * y).collect::<Vec<f64>>());
    }
}
