//! Block-sparse LU factorization of 1 + Eᵀ H E, for systems with many degrees of freedom.
//!
//! ```text
//! cluster    neighbouring degrees of freedom that every group touches all or none of: the six of a free body
//! pattern    two clusters meet when a group touches both; a group's clusters are a clique
//! order      least number of neighbours first, those that elimination joins counted; ties by number
//! in order k:    D_k⁻¹ by exchanges of rows,   L_ik = A_ik D_k⁻¹,   A_ij −= L_ik A_kj      i, j meet k and come later
//! ```
//! H of a sliding contact is not symmetric, but the pattern is. Rows are exchanged only within a block. A block that cannot be inverted stops the
//! factorization, and the line search detects a poor step. Blocks store their rows in vectors of four, padded with zeros. The pattern covers all
//! groups and is computed once for a problem; it has O(Σ n_k²) blocks, where n_k is the number of later neighbours of k.

use super::problem::{Problem, fma};
use std::cmp::Reverse;
use std::collections::BinaryHeap;
use wide::f64x4;

/// Marks a missing cluster.
const NONE: u32 = u32::MAX;

/// Pattern and factors; reuses its memory.
#[derive(Clone, Debug, Default)]
pub(crate) struct Sparse {
    /// First degree of freedom of each cluster, and number of its degrees of freedom.
    first: Vec<u32>,
    size: Vec<u32>,
    /// Cluster of each degree of freedom.
    cluster: Vec<u32>,
    cut: Vec<bool>,
    touched: Vec<bool>,
    /// One bit for each pair of clusters.
    meets: Vec<u64>,
    words: usize,
    queue: BinaryHeap<Reverse<(u32, u32)>>,
    /// Cluster at each position in the order, and position of each cluster.
    order: Vec<u32>,
    place: Vec<u32>,
    /// Later neighbours of each position, as positions, ascending.
    begin: Vec<u32>,
    later: Vec<u32>,
    /// Blocks: index of each diagonal block, and of the blocks above and below for each neighbour.
    diagonal: Vec<u32>,
    upper: Vec<u32>,
    lower: Vec<u32>,
    a: Vec<f64x4>,
    /// Vectors of each position in a solution.
    at: Vec<u32>,
    x: Vec<f64x4>,
    square: Vec<f64>,
    product: Vec<f64x4>,
    /// Clusters and rows of the current group: across four degrees of freedom, by rows.
    places: Vec<(u32, u32)>,
    across: Vec<[f64x4; 4]>,
}

impl Sparse {
    /// Finds clusters, elimination order and indices of the blocks.
    pub fn prepare(&mut self, problem: &Problem) {
        self.clusters(problem);
        self.pattern(problem);
        self.eliminate();
        self.lay_out();
    }

    fn clusters(&mut self, problem: &Problem) {
        let n = problem.factor.dofs;
        self.cut.clear();
        self.cut.resize(n + 1, false);
        self.touched.clear();
        self.touched.resize(n, false);
        for g in 0..problem.groups() {
            let (dof, _) = problem.entries(g);
            let mut before = NONE;
            for &d in dof {
                self.touched[d as usize] = true;
                if before == NONE || d != before + 1 {
                    self.cut[d as usize] = true;
                    if before != NONE {
                        self.cut[before as usize + 1] = true;
                    }
                }
                before = d;
            }
            if before != NONE {
                self.cut[before as usize + 1] = true;
            }
        }
        self.first.clear();
        self.size.clear();
        self.cluster.clear();
        self.cluster.resize(n, NONE);
        for d in 0..n {
            if !self.touched[d] {
                continue;
            }
            if self.cut[d] {
                self.first.push(d as u32);
                self.size.push(0);
            }
            let c = self.first.len() - 1;
            self.cluster[d] = c as u32;
            self.size[c] += 1;
        }
    }

    fn pattern(&mut self, problem: &Problem) {
        let n = self.first.len();
        self.words = n.div_ceil(64);
        self.meets.clear();
        self.meets.resize(n * self.words, 0);
        for g in 0..problem.groups() {
            let (dof, _) = problem.entries(g);
            self.places.clear();
            let mut k = 0;
            while k < dof.len() {
                let c = self.cluster[dof[k] as usize];
                self.places.push((c, 0));
                k += self.size[c as usize] as usize;
            }
            for &(a, _) in &self.places {
                let row = &mut self.meets[a as usize * self.words..(a as usize + 1) * self.words];
                for &(b, _) in &self.places {
                    row[b as usize / 64] |= 1 << (b % 64);
                }
            }
        }
    }

    fn degree(&self, c: usize) -> u32 {
        let row = &self.meets[c * self.words..(c + 1) * self.words];
        row.iter().map(|w| w.count_ones()).sum()
    }

    /// Computes the elimination order, and each cluster's later neighbours as clusters.
    fn eliminate(&mut self) {
        let n = self.first.len();
        self.queue.clear();
        for c in 0..n {
            self.queue.push(Reverse((self.degree(c), c as u32)));
        }
        self.place.clear();
        self.place.resize(n, NONE);
        self.order.clear();
        self.begin.clear();
        self.begin.push(0);
        self.later.clear();
        while let Some(Reverse((degree, c))) = self.queue.pop() {
            let k = c as usize;
            if self.place[k] != NONE || degree != self.degree(k) {
                continue;
            }
            self.place[k] = self.order.len() as u32;
            self.order.push(c);
            let from = self.later.len();
            self.meets[k * self.words + k / 64] &= !(1 << (k % 64));
            for word in 0..self.words {
                let mut bits = self.meets[k * self.words + word];
                while bits != 0 {
                    self.later.push(64 * word as u32 + bits.trailing_zeros());
                    bits &= bits - 1;
                }
            }
            for i in from..self.later.len() {
                let j = self.later[i] as usize;
                for word in 0..self.words {
                    let bits = self.meets[k * self.words + word];
                    self.meets[j * self.words + word] |= bits;
                }
                self.meets[j * self.words + k / 64] &= !(1 << (k % 64));
                let degree = self.degree(j);
                self.queue.push(Reverse((degree, j as u32)));
            }
            self.begin.push(self.later.len() as u32);
        }
    }

    /// Computes neighbours as positions, and the index of each block.
    fn lay_out(&mut self) {
        let n = self.order.len();
        let vectors = |size: u32| size.div_ceil(4);
        self.diagonal.clear();
        self.upper.clear();
        self.lower.clear();
        self.at.clear();
        let (mut end, mut x) = (0, 0);
        for k in 0..n {
            let range = self.begin[k] as usize..self.begin[k + 1] as usize;
            for i in range.clone() {
                self.later[i] = self.place[self.later[i] as usize];
            }
            self.later[range.clone()].sort_unstable();
            let own = self.size[self.order[k] as usize];
            self.diagonal.push(end);
            end += own * vectors(own);
            self.at.push(x);
            x += vectors(own);
            for i in range {
                let other = self.size[self.order[self.later[i] as usize] as usize];
                self.upper.push(end);
                end += own * vectors(other);
                self.lower.push(end);
                end += other * vectors(own);
            }
        }
        self.a.resize(end as usize, f64x4::splat(0.0));
        self.x.resize(x as usize, f64x4::splat(0.0));
    }

    fn size_at(&self, place: usize) -> usize {
        self.size[self.order[place] as usize] as usize
    }

    /// Sets the matrix to the identity.
    pub fn clear(&mut self) {
        self.a.fill(f64x4::splat(0.0));
        for k in 0..self.order.len() {
            let size = self.size_at(k);
            for r in 0..size {
                let at = self.diagonal[k] as usize + r * size.div_ceil(4) + r / 4;
                self.a[at].as_mut_array()[r % 4] = 1.0;
            }
        }
    }

    /// Adds Eᵀ H E of a group.
    pub fn add(&mut self, problem: &Problem, g: usize, H: &[[f64; 4]; 4]) {
        let (dof, e) = problem.entries(g);
        self.places.clear();
        self.across.clear();
        let mut k = 0;
        while k < dof.len() {
            let c = self.cluster[dof[k] as usize] as usize;
            let size = self.size[c] as usize;
            self.places.push((self.place[c], k as u32));
            for four in e[k..k + size].chunks(4) {
                let mut rows = [f64x4::splat(0.0); 4];
                four.iter().zip(&mut rows).for_each(|(e, row)| *row = f64x4::new(*e));
                self.across.push(f64x4::transpose(rows));
            }
            k += size;
        }
        let H = H.map(f64x4::new);
        let (mut right_from, rows) = (0, problem.cones[g].rows());
        for right in 0..self.places.len() {
            let (pr, _) = self.places[right];
            let vectors = self.size_at(pr as usize).div_ceil(4);
            for left in 0..self.places.len() {
                let (pl, at) = self.places[left];
                let block = self.block(pl, pr) as usize;
                for r in 0..self.size_at(pl as usize) {
                    let e = &e[at as usize + r];
                    // This is row r of Eᵀ H.
                    let row = (1..rows).fold(H[0] * f64x4::splat(e[0]), |sum, i| {
                        H[i].mul_add(f64x4::splat(e[i]), sum)
                    });
                    let row = row.to_array().map(f64x4::splat);
                    for v in 0..vectors {
                        let across = &self.across[right_from + v];
                        let to = &mut self.a[block + r * vectors + v];
                        *to = (0..rows).fold(*to, |sum, k| row[k].mul_add(across[k], sum));
                    }
                }
            }
            right_from += vectors;
        }
    }

    /// Returns the index of the block at the positions of a row and a column.
    fn block(&self, row: u32, column: u32) -> u32 {
        if row == column {
            return self.diagonal[row as usize];
        }
        let k = row.min(column) as usize;
        let range = self.begin[k] as usize..self.begin[k + 1] as usize;
        let i = range.start + self.later[range].partition_point(|p| *p < row.max(column));
        if row < column { self.upper[i] } else { self.lower[i] }
    }

    /// Factors in place. Returns false if a block cannot be inverted.
    pub fn factor(&mut self) -> bool {
        for k in 0..self.order.len() {
            let size = self.size_at(k);
            if !self.invert(k, size) {
                return false;
            }
            let range = self.begin[k] as usize..self.begin[k + 1] as usize;
            for i in range.clone() {
                self.times_inverse(k, i, size);
            }
            for i in range.clone() {
                let p = self.later[i] as usize;
                let rows = self.size_at(p);
                let (diagonal, mut q) = (self.diagonal[p], self.begin[p] as usize);
                self.subtract(diagonal, rows, i, i, (size, rows));
                for j in i + 1..range.end {
                    let other = self.later[j];
                    while self.later[q] != other {
                        q += 1;
                    }
                    let columns = self.size_at(other as usize);
                    self.subtract(self.upper[q], rows, i, j, (size, columns));
                    self.subtract(self.lower[q], columns, j, i, (size, rows));
                }
            }
        }
        true
    }

    /// Computes A −= L U: `rows` of the lower block `i`, through `size`, times `columns` of the upper block `j`.
    #[inline(always)]
    fn subtract(
        &mut self,
        to: u32,
        rows: usize,
        i: usize,
        j: usize,
        (size, columns): (usize, usize),
    ) {
        let (through, vectors) = (size.div_ceil(4), columns.div_ceil(4));
        let (to, left, right) = (to as usize, self.lower[i] as usize, self.upper[j] as usize);
        // Blocks of later positions are stored after blocks of earlier ones.
        let (done, rest) = self.a.split_at_mut(to);
        let target = &mut rest[..rows * vectors];
        let (left, right) =
            (&done[left..left + rows * through], &done[right..right + size * vectors]);
        if (size, vectors) == (6, 2) {
            six(target, left, right);
        } else {
            general(target, left, right, (size, through, vectors));
        }
    }

    /// Replaces D by D⁻¹.
    fn invert(&mut self, k: usize, size: usize) -> bool {
        let (vectors, at) = (size.div_ceil(4), self.diagonal[k] as usize);
        let wide = 2 * size;
        self.square.clear();
        self.square.resize(size * wide, 0.0);
        for r in 0..size {
            for c in 0..size {
                self.square[r * wide + c] = self.a[at + r * vectors + c / 4].as_array()[c % 4];
            }
            self.square[r * wide + size + r] = 1.0;
        }
        if !inverted(&mut self.square, size) {
            return false;
        }
        for r in 0..size {
            for c in 0..size {
                let to = self.a[at + r * vectors + c / 4].as_mut_array();
                to[c % 4] = self.square[r * wide + size + c];
            }
        }
        true
    }

    /// Multiplies the lower block `i` of position k by D_k⁻¹.
    fn times_inverse(&mut self, k: usize, i: usize, size: usize) {
        let vectors = size.div_ceil(4);
        let (rows, at) = (self.size_at(self.later[i] as usize), self.lower[i] as usize);
        self.product.clear();
        self.product.resize(rows * vectors, f64x4::splat(0.0));
        let inverse = self.diagonal[k] as usize;
        let inverse = &self.a[inverse..inverse + size * vectors];
        let block = &self.a[at..at + rows * vectors];
        general(&mut self.product, block, inverse, (size, vectors, vectors));
        for (to, x) in self.a[at..at + rows * vectors].iter_mut().zip(&self.product) {
            *to = -*x;
        }
    }

    /// Solves x ← A⁻¹ x by degrees of freedom. Degrees of freedom that no group touches stay unchanged.
    pub fn solve(&mut self, x: &mut [f64]) {
        let n = self.order.len();
        for k in 0..n {
            let (from, size) = (self.first[self.order[k] as usize] as usize, self.size_at(k));
            let to = &mut self.x[self.at[k] as usize..];
            for (to, four) in to.iter_mut().zip(x[from..from + size].chunks(4)) {
                let mut lanes = [0.0; 4];
                lanes[..four.len()].copy_from_slice(four);
                *to = f64x4::new(lanes);
            }
        }
        for k in 0..n {
            let (at, vectors) = (self.at[k] as usize, self.size_at(k).div_ceil(4));
            for i in self.begin[k] as usize..self.begin[k + 1] as usize {
                let p = self.later[i] as usize;
                self.less(
                    self.at[p] as usize,
                    self.size_at(p),
                    self.lower[i] as usize,
                    (at, vectors),
                );
            }
        }
        for k in (0..n).rev() {
            let (at, size) = (self.at[k] as usize, self.size_at(k));
            let vectors = size.div_ceil(4);
            for i in self.begin[k] as usize..self.begin[k + 1] as usize {
                let p = self.later[i] as usize;
                let other = (self.at[p] as usize, self.size_at(p).div_ceil(4));
                self.less(at, size, self.upper[i] as usize, other);
            }
            let inverse = self.diagonal[k] as usize;
            self.product.clear();
            self.product.resize(vectors, f64x4::splat(0.0));
            for r in 0..size {
                let row = &self.a[inverse + r * vectors..inverse + (r + 1) * vectors];
                let sum = dot(row, &self.x[at..at + vectors]);
                self.product[r / 4].as_mut_array()[r % 4] = sum;
            }
            self.x[at..at + vectors].copy_from_slice(&self.product);
        }
        for k in 0..n {
            let (from, size) = (self.first[self.order[k] as usize] as usize, self.size_at(k));
            let from_x = &self.x[self.at[k] as usize..];
            for (four, x) in x[from..from + size].chunks_mut(4).zip(from_x) {
                four.copy_from_slice(&x.as_array()[..four.len()]);
            }
        }
    }

    /// Subtracts block · x at `from` from x at `to`.
    #[inline(always)]
    fn less(&mut self, to: usize, rows: usize, block: usize, (from, vectors): (usize, usize)) {
        for r in 0..rows {
            let row = &self.a[block + r * vectors..block + (r + 1) * vectors];
            let sum = dot(row, &self.x[from..from + vectors]);
            self.x[to + r / 4].as_mut_array()[r % 4] -= sum;
        }
    }
}

#[inline(always)]
fn dot(a: &[f64x4], b: &[f64x4]) -> f64 {
    let zero = f64x4::splat(0.0);
    a.iter().zip(b).fold(zero, |sum, (a, b)| a.mul_add(*b, sum)).reduce_add()
}

/// Subtracts left · right from `target`. A row of `left` has six numbers in two vectors, a row of `right` two vectors.
#[inline(always)]
fn six(target: &mut [f64x4], left: &[f64x4], right: &[f64x4]) {
    let Some(right) = right.first_chunk::<12>() else { return };
    for (to, l) in target.as_chunks_mut::<2>().0.iter_mut().zip(left.as_chunks::<2>().0) {
        let ([a, b, c, d], [e, f, ..]) = (l[0].to_array(), l[1].to_array());
        let [mut x, mut y] = *to;
        for (k, l) in [a, b, c, d, e, f].into_iter().enumerate() {
            let l = f64x4::splat(-l);
            x = l.mul_add(right[2 * k], x);
            y = l.mul_add(right[2 * k + 1], y);
        }
        *to = [x, y];
    }
}

/// Subtracts left · right from `target` for any sizes.
fn general(
    target: &mut [f64x4],
    left: &[f64x4],
    right: &[f64x4],
    (size, through, vectors): (usize, usize, usize),
) {
    for (to, l) in target.chunks_exact_mut(vectors).zip(left.chunks_exact(through)) {
        for k in 0..size {
            let l = f64x4::splat(-l[k / 4].as_array()[k % 4]);
            for (to, r) in to.iter_mut().zip(&right[k * vectors..(k + 1) * vectors]) {
                *to = l.mul_add(*r, *to);
            }
        }
    }
}

/// Inverts A in [A | 1] by Gauss–Jordan elimination with row exchanges. Returns false if A is singular to working precision.
fn inverted(A: &mut [f64], n: usize) -> bool {
    let wide = 2 * n;
    for k in 0..n {
        let mut p = k;
        for i in k + 1..n {
            if A[i * wide + k].abs() > A[p * wide + k].abs() {
                p = i;
            }
        }
        let pivot = A[p * wide + k];
        if !(pivot.abs() > 1e-300) || !pivot.is_finite() {
            return false;
        }
        if p != k {
            let (above, below) = A.split_at_mut(p * wide);
            above[k * wide..(k + 1) * wide].swap_with_slice(&mut below[..wide]);
        }
        let per = 1.0 / pivot;
        A[k * wide + k..(k + 1) * wide].iter_mut().for_each(|x| *x *= per);
        let (above, rest) = A.split_at_mut(k * wide);
        let (row, below) = rest.split_at_mut(wide);
        for other in above.chunks_exact_mut(wide).chain(below.chunks_exact_mut(wide)) {
            let f = other[k];
            if f != 0.0 {
                for (x, r) in other[k..].iter_mut().zip(&row[k..]) {
                    *x = fma(-f, *r, *x);
                }
            }
        }
    }
    true
}

#[cfg(test)]
mod tests {
    use super::super::dense::solve_lu;
    use super::super::problem::{Cone, Factor};
    use super::super::samples::number;
    use super::*;

    /// Random contacts between clusters of one to seven rates give the same solution as the dense matrix.
    #[test]
    fn it_solves_what_the_dense_matrix_solves() {
        let mut seed = 17;
        for trial in 0..40_usize {
            let sizes: Vec<usize> = (0..3 + trial).map(|k| 1 + (k * 5 + trial) % 7).collect();
            let firsts: Vec<usize> = sizes
                .iter()
                .scan(0, |at, s| Some(std::mem::replace(at, *at + s + trial % 2)))
                .collect();
            let dofs = firsts[firsts.len() - 1] + sizes[sizes.len() - 1] + 3;
            let (mut start, mut dof, mut e, mut cones) = (vec![0], vec![], vec![], vec![]);
            let mut pick = |n: usize| ((number(&mut seed) + 1.0) * 0.5 * n as f64) as usize % n;
            let pairs: Vec<[usize; 2]> =
                (0..3 * sizes.len()).map(|_| [pick(sizes.len()), pick(sizes.len())]).collect();
            for [a, b] in &pairs {
                let mut both = vec![*a.min(b), *a.max(b)];
                both.dedup();
                for c in both {
                    for d in firsts[c]..firsts[c] + sizes[c] {
                        dof.push(d as u32);
                        let row =
                            std::array::from_fn(|k| if k < 3 { number(&mut seed) } else { 0.0 });
                        e.push(row);
                    }
                }
                start.push(dof.len() as u32);
                cones.push(Cone::Coulomb { friction: 0.5 });
            }
            let b = vec![[0.0; 4]; cones.len()];
            let factor = Factor { start: &start, dof: &dof, e: &e, dofs };
            let problem = Problem::new(factor, &cones, &b, &[]).expect("a good problem");
            let mut sparse = Sparse::default();
            sparse.prepare(&problem);
            sparse.clear();
            let mut A = vec![0.0; dofs * dofs];
            (0..dofs).for_each(|d| A[d * (dofs + 1)] = 1.0);
            for g in 0..cones.len() {
                let mut H = [[0.0; 4]; 4];
                for row in H.iter_mut().take(3) {
                    row[..3].fill_with(|| 0.3 * number(&mut seed));
                }
                (0..3).for_each(|k| H[k][k] += 2.0);
                if g % 4 == 3 {
                    H = [[0.0; 4]; 4];
                }
                sparse.add(&problem, g, &H);
                let (dof, e) = problem.entries(g);
                for (i, l) in dof.iter().zip(e) {
                    for (j, r) in dof.iter().zip(e) {
                        let sum = (0..3).flat_map(|k| (0..3).map(move |m| (k, m)));
                        A[*i as usize * dofs + *j as usize] +=
                            sum.map(|(k, m)| l[k] * H[k][m] * r[m]).sum::<f64>();
                    }
                }
            }
            let mut x: Vec<f64> = (0..dofs).map(|_| number(&mut seed)).collect();
            let mut want = x.clone();
            assert!(sparse.factor());
            sparse.solve(&mut x);
            assert!(solve_lu(&mut A, dofs, &mut want, &mut vec![[0; 2]; dofs]));
            for (x, w) in x.iter().zip(&want) {
                assert!((x - w).abs() < 1e-10, "{trial}: {x} {w}");
            }
        }
    }

    #[test]
    fn a_singular_block_is_seen() {
        let mut A = [1.0, 2.0, 1.0, 0.0, 2.0, 4.0, 0.0, 1.0];
        assert!(!inverted(&mut A, 2));
        let mut A = [0.0, 2.0, 1.0, 0.0, 1.0, 4.0, 0.0, 1.0];
        assert!(inverted(&mut A, 2));
        assert_eq!([A[2], A[3], A[6], A[7]], [-2.0, 1.0, 0.5, 0.0]);
    }
}
