//! L D Lᵀ factorization of a sparse positive semidefinite matrix in blocks of at most six rows, with a pattern fixed at set-up.
//!
//! ```text
//! column j:   S_jj = L_jj D_j L_jj*,   L_ij = S_ij L_jj⁻* D_j⁻¹         rows i below j
//!             S_ik ← S_ik − L_ij D_j L_kj*                              pairs i ≥ k of them
//! d ≤ RANK · size: the row repeats earlier ones; x = 0                  or ≤ RANK² · greatest size
//! ```

use linkwork_spatial::nalgebra::{Matrix6, Vector6};
use std::collections::BTreeSet;

/// A row counts as dependent if its pivot is at most this fraction of its diagonal.
const RANK: f64 = 1e-11;

#[derive(Clone, Debug)]
pub(super) struct Sparse {
    /// Number of rows of each block.
    rows: Vec<usize>,
    /// Block rows below the diagonal of each column, and the indices of their blocks.
    below: Vec<Vec<(usize, usize)>>,
    /// Indices of the blocks from which the pairs of each column are subtracted.
    pairs: Vec<Vec<usize>>,
    /// Blocks below the diagonal, then blocks of the diagonal.
    a: Vec<Matrix6<f64>>,
    diagonal: Vec<Matrix6<f64>>,
    /// D, and D⁻¹ with zero for rows left out.
    d: Vec<Vector6<f64>>,
    d_inv: Vec<Vector6<f64>>,
    pub rank: usize,
}

impl Sparse {
    /// Creates the pattern from the number of rows of each block and the pairs (i > j) of blocks that share unknowns. Blocks are eliminated in their
    /// order.
    pub fn new(rows: Vec<usize>, meets: &[(usize, usize)]) -> Self {
        let n = rows.len();
        let mut pattern: Vec<BTreeSet<usize>> = vec![BTreeSet::new(); n];
        for (i, j) in meets {
            pattern[*j].insert(*i);
        }
        for j in 0..n {
            let column: Vec<usize> = pattern[j].iter().copied().collect();
            for (at, k) in column.iter().enumerate() {
                pattern[*k].extend(&column[at + 1..]);
            }
        }
        let mut blocks = 0;
        let below: Vec<Vec<(usize, usize)>> = (pattern.iter())
            .map(|column| {
                let start = blocks;
                blocks += column.len();
                column.iter().copied().zip(start..).collect()
            })
            .collect();
        let place = |i: usize, k: usize| match below[k].binary_search_by_key(&i, |e| e.0) {
            Ok(at) => below[k][at].1,
            // Diagonal blocks have indices after all others.
            Err(_) => blocks + k,
        };
        let pairs = (below.iter())
            .map(|column| {
                let pair = |at: usize| column[at..].iter().map(move |i| (i.0, column[at].0));
                (0..column.len()).flat_map(pair).map(|(i, k)| place(i, k)).collect()
            })
            .collect();
        Self {
            a: vec![Matrix6::zeros(); blocks],
            diagonal: vec![Matrix6::zeros(); n],
            d: vec![Vector6::zeros(); n],
            d_inv: vec![Vector6::zeros(); n],
            rank: 0,
            rows,
            below,
            pairs,
        }
    }

    /// Returns the number of blocks of L below its diagonal.
    pub fn blocks(&self) -> usize {
        self.a.len()
    }

    /// Sets all blocks to zero.
    pub fn clear(&mut self) {
        self.a.fill(Matrix6::zeros());
        self.diagonal.fill(Matrix6::zeros());
    }

    /// Returns the block (i, j) of the lower triangle, for adding to it.
    pub fn block(&mut self, i: usize, j: usize) -> &mut Matrix6<f64> {
        match self.below[j].binary_search_by_key(&i, |e| e.0) {
            Ok(at) => &mut self.a[self.below[j][at].1],
            Err(_) => &mut self.diagonal[j],
        }
    }

    /// Factors in place.
    pub fn factor(&mut self) {
        self.rank = 0;
        let mut greatest: f64 = 0.0;
        let mut sizes = [0.0; 6];
        for (S, n) in self.diagonal.iter().zip(&self.rows) {
            greatest = (0..*n).fold(greatest, |g, i| g.max(S[(i, i)]));
        }
        let least = RANK * RANK * greatest;
        // Pivots are compared with the diagonals before elimination.
        for (S, d) in self.diagonal.iter().zip(&mut self.d) {
            *d = S.diagonal();
        }
        for j in 0..self.rows.len() {
            sizes.copy_from_slice(self.d[j].as_slice());
            self.pivot(j, &sizes, least);
            let (L, d, d_inv) = (self.diagonal[j], self.d[j], self.d_inv[j]);
            for (_, at) in &self.below[j] {
                let S = &mut self.a[*at];
                // The update is S ← S L⁻*, column by column.
                for c in 0..self.rows[j] {
                    for m in 0..c {
                        let l = L[(c, m)];
                        for r in 0..6 {
                            S[(r, c)] -= S[(r, m)] * l;
                        }
                    }
                }
                for c in 0..6 {
                    let scaled = S.column(c) * d_inv[c];
                    S.set_column(c, &scaled);
                }
            }
            let column = &self.below[j];
            let mut places = self.pairs[j].iter();
            let blocks = self.a.len();
            for (at, (_, k)) in column.iter().enumerate() {
                let LD = self.a[*k] * Matrix6::from_diagonal(&d);
                for (_, i) in &column[at..] {
                    let product = self.a[*i] * LD.transpose();
                    let Some(to) = places.next() else { break };
                    match to.checked_sub(blocks) {
                        Some(k) => self.diagonal[k] -= product,
                        None => self.a[*to] -= product,
                    }
                }
            }
        }
    }

    /// Factors the diagonal block of a column: L below the diagonal, ones left out.
    fn pivot(&mut self, j: usize, sizes: &[f64; 6], least: f64) {
        let S = &mut self.diagonal[j];
        let n = self.rows[j];
        let (d, d_inv) = (&mut self.d[j], &mut self.d_inv[j]);
        *d = Vector6::zeros();
        *d_inv = Vector6::zeros();
        for c in 0..n {
            let pivot = S[(c, c)];
            let keep = pivot > (RANK * sizes[c]).max(least);
            if keep {
                (d[c], d_inv[c]) = (pivot, 1.0 / pivot);
                self.rank += 1;
            }
            for r in c + 1..n {
                let l = S[(r, c)] * d_inv[c];
                for m in c + 1..=r {
                    let x = S[(m, c)];
                    S[(r, m)] -= l * x;
                }
            }
            for r in c + 1..n {
                S[(r, c)] *= d_inv[c];
            }
        }
    }

    /// Returns whether row `r` of a block was left out at the last factorisation.
    pub fn left_out(&self, block: usize, r: usize) -> bool {
        self.d_inv[block][r] == 0.0
    }

    /// Computes x ← S⁻¹ x over the rows that were kept; zero at the others. Calls `dropped(block, by)` for each row left out, with the difference
    /// between its right side and the value that the kept rows imply.
    pub fn solve(&self, x: &mut [Vector6<f64>], mut dropped: impl FnMut(usize, f64)) {
        let n = self.rows.len();
        for j in 0..n {
            let L = &self.diagonal[j];
            for c in 0..self.rows[j] {
                let y = x[j][c];
                for r in c + 1..self.rows[j] {
                    x[j][r] -= L[(r, c)] * y;
                }
            }
            let y = x[j];
            for (i, at) in &self.below[j] {
                x[*i] -= self.a[*at] * y;
            }
        }
        for j in 0..n {
            for r in 0..self.rows[j] {
                if self.left_out(j, r) {
                    dropped(j, x[j][r].abs());
                }
                x[j][r] *= self.d_inv[j][r];
            }
        }
        for j in (0..n).rev() {
            let mut y = x[j];
            for (i, at) in &self.below[j] {
                y -= self.a[*at].transpose() * x[*i];
            }
            let L = &self.diagonal[j];
            for c in (0..self.rows[j]).rev() {
                for r in c + 1..self.rows[j] {
                    y[c] -= L[(r, c)] * y[r];
                }
            }
            x[j] = y;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A random semidefinite matrix whose last row of block 2 repeats a row of block 0.
    #[test]
    fn solves_and_reports_the_repeated_row() {
        let rows = vec![3, 2, 3];
        let meets = [(1, 0), (2, 0), (2, 1)];
        let mut seed = 7_u64;
        let mut random = || {
            seed = seed
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1_442_695_040_888_963_407);
            (seed >> 11) as f64 / (1_u64 << 53) as f64 - 0.5
        };
        let mut G: Vec<Vec<f64>> = (0..8).map(|_| (0..12).map(|_| random()).collect()).collect();
        G[7] = G[1].iter().zip(&G[4]).map(|(a, b)| 2.0 * a - b).collect();
        let start = [0, 3, 5];
        let mut s = Sparse::new(rows.clone(), &meets);
        let dot = |a: usize, b: usize| -> f64 { G[a].iter().zip(&G[b]).map(|(x, y)| x * y).sum() };
        for (i, j) in meets.into_iter().chain([(0, 0), (1, 1), (2, 2)]) {
            for r in 0..rows[i] {
                for c in 0..rows[j] {
                    s.block(i, j)[(r, c)] = dot(start[i] + r, start[j] + c);
                }
            }
        }
        s.factor();
        assert_eq!(s.rank, 7);
        let want: Vec<f64> = (0..8).map(|k| 0.3 + 0.1 * f64::from(k)).collect();
        // b is in the range of S: b = S want.
        let b: Vec<f64> = (0..8).map(|r| (0..8).map(|c| dot(r, c) * want[c]).sum()).collect();
        let mut x = [Vector6::zeros(); 3];
        for i in 0..3 {
            (0..rows[i]).for_each(|r| x[i][r] = b[start[i] + r]);
        }
        let mut worst: f64 = 0.0;
        s.solve(&mut x, |block, by| {
            assert_eq!(block, 2);
            worst = worst.max(by);
        });
        assert!(worst < 1e-12, "{worst:e}");
        let flat: Vec<f64> =
            (0..3).flat_map(|i| (0..rows[i]).map(move |r| (i, r))).map(|(i, r)| x[i][r]).collect();
        for (r, b) in b.iter().enumerate() {
            let got: f64 = (0..8).map(|c| dot(r, c) * flat[c]).sum();
            assert!((got - b).abs() < 1e-11, "row {r}: {got} {b}");
        }
    }
}
