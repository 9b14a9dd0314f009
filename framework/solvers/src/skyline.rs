//! L D Lᵀ factorization of a positive semidefinite matrix within its envelope, in blocks of four rows, with dependent rows left out.
//!
//! ```text
//! C_gh = (W_gh − Σ C_gk L_hk*) L_hh⁻*,   L_gh = C_gh D_h⁻¹          left to right in block row g
//! L_gg D_g L_gg* = W_gg − Σ C_gk L_gk*                              row by row, and L_gg⁻¹ with it:
//! d_k ≤ RANK · size_k: row k repeats earlier rows; x_k = 0          or ≤ RANK² · greatest size
//! x_g ← L_gg⁻¹ (x_g − Σ L_gk x_k),   x_g ← L_gg⁻* (D_g⁻¹ x_g − Σ L_kg* x_k)
//! ```
//! A semidefinite matrix does not need pivoting here, because where d_k vanishes, the rest of its row vanishes too. Each block row is stored from its
//! first nonzero block. A block is stored as four columns; the diagonal has the inverse. Groups with fewer rows are padded with zeros.

use linkwork_dynamics::units::WIDTH;
use wide::f64x4;

/// A row counts as dependent if its pivot is at most this fraction of its size.
pub(crate) const RANK: f64 = 1e-11;

/// Columns of a block.
pub(crate) type Block = [f64x4; WIDTH];

#[derive(Clone, Debug, Default)]
pub(crate) struct Skyline {
    /// Number of rows of each group.
    rows: Vec<usize>,
    /// First block of each block row, and index of its first block.
    first: Vec<usize>,
    start: Vec<usize>,
    a: Vec<Block>,
    /// Rows of each L_gg⁻¹.
    inverse: Vec<Block>,
    /// Σ L_kg* x_k of the rows behind, before the four lanes are added.
    behind: Vec<Block>,
    /// D⁻¹; zero for rows left out.
    d_inv: Vec<[f64; WIDTH]>,
    /// Residual of the rows left out at the last solution.
    lack: Vec<[f64; WIDTH]>,
    pub rank: usize,
    /// Smallest ratio of pivot to size among the rows that were kept.
    pub weakest: f64,
}

impl Skyline {
    /// Creates the envelope from the number of rows of each group and the first group with which it shares unknowns.
    pub fn new(rows: Vec<usize>, first: Vec<usize>) -> Self {
        let mut start = vec![0];
        for (g, f) in first.iter().enumerate() {
            start.push(start[g] + g + 1 - f);
        }
        let (n, size) = (first.len(), start[first.len()]);
        let zero = [f64x4::splat(0.0); WIDTH];
        let (d_inv, lack) = (vec![[0.0; WIDTH]; n], vec![[0.0; WIDTH]; n]);
        let (a, inverse, behind) = (vec![zero; size], vec![zero; n], vec![zero; n]);
        Self { rows, first, start, a, inverse, behind, d_inv, lack, rank: 0, weakest: 1.0 }
    }

    /// Sets a block of the lower triangle from its columns.
    #[inline(always)]
    pub fn set(&mut self, g: usize, h: usize, columns: Block) {
        self.a[self.start[g] + h - self.first[g]] = columns;
    }

    /// Factors in place. `size(g)` is at least the diagonal of W, and larger if W itself is the remainder of larger terms that cancel.
    pub fn factor(&mut self, size: impl Fn(usize) -> [f64; WIDTH]) {
        self.rank = 0;
        self.weakest = 1.0;
        let mut greatest: f64 = 0.0;
        for g in 0..self.first.len() {
            greatest = size(g).into_iter().fold(greatest, f64::max);
        }
        let least = RANK * RANK * greatest;
        for g in 0..self.first.len() {
            let fg = self.first[g];
            let (done, rest) = self.a.split_at_mut(self.start[g]);
            let (row, diagonal) = rest[..g + 1 - fg].split_at_mut(g - fg);
            for h in fg..g {
                let (fh, start) = (self.first[h], self.start[h]);
                let (before, from) = (&done[start..start + h - fh], fg.max(fh));
                let (left, this) = row.split_at_mut(h - fg);
                let mut C = this[0];
                for (Cgk, Lhk) in left[from - fg..].iter().zip(&before[from - fh..]) {
                    subtract(&mut C, Cgk, Lhk);
                }
                let L = &done[start + h - fh];
                this[0] = std::array::from_fn(|j| {
                    (0..j).fold(C[j], |sum, m| C[m].mul_add(f64x4::splat(L[m].as_array()[j]), sum))
                });
            }
            let mut S = diagonal[0];
            let was: [f64; WIDTH] = std::array::from_fn(|i| S[i].as_array()[i]);
            for (C, d_inv) in row.iter_mut().zip(&self.d_inv[fg..g]) {
                let L: Block = std::array::from_fn(|m| C[m] * f64x4::splat(d_inv[m]));
                subtract(&mut S, C, &L);
                *C = L;
            }
            let (size, d_inv) = (size(g), &mut self.d_inv[g]);
            let mut inverse = UNIT.map(f64x4::new);
            for j in 0..self.rows[g] {
                let column = S[j];
                let d = column.as_array()[j];
                let keep = d > (RANK * was[j].max(size[j])).max(least);
                d_inv[j] = if keep { 1.0 / d } else { 0.0 };
                self.rank += usize::from(keep);
                if keep {
                    self.weakest = self.weakest.min(d / was[j].max(size[j]));
                }
                // The mask keeps the entries strictly below the diagonal.
                let l = column * f64x4::splat(d_inv[j]) * f64x4::new(BELOW[j]);
                for p in j + 1..WIDTH {
                    S[p] = (-l).mul_add(f64x4::splat(column.as_array()[p]), S[p]);
                }
                for N in &mut inverse[..=j] {
                    *N = (-l).mul_add(f64x4::splat(N.as_array()[j]), *N);
                }
            }
            diagonal[0] = inverse;
            self.inverse[g] = f64x4::transpose(inverse);
        }
    }

    /// Returns the number of rows of a group.
    pub fn rows(&self, g: usize) -> usize {
        self.rows[g]
    }

    /// Returns the residual of each row of a group that was left out, at the last solution.
    pub fn left_out(&self, g: usize) -> impl Iterator<Item = f64> + '_ {
        let rows = self.d_inv[g].iter().zip(&self.lack[g]).take(self.rows[g]);
        rows.filter(|(d_inv, _)| **d_inv == 0.0).map(|(_, lack)| *lack)
    }

    /// Computes x ← W⁻¹ x over the rows that were kept; zero at the others. Returns the largest difference between the right side of a row left out
    /// and the value that the kept rows imply.
    pub fn solve(&mut self, x: &mut [[f64; WIDTH]]) -> f64 {
        let n = self.first.len();
        let mut contradiction: f64 = 0.0;
        for g in 0..n {
            let fg = self.first[g];
            let row = &self.a[self.start[g]..self.start[g + 1]];
            let (before, rest) = x.split_at_mut(g);
            let mut t = [f64x4::new(rest[0]), f64x4::splat(0.0)];
            for (L, x) in row.iter().zip(&before[fg..]) {
                for (j, (L, x)) in L.iter().zip(x).enumerate() {
                    t[j % 2] = (-*L).mul_add(f64x4::splat(*x), t[j % 2]);
                }
            }
            rest[0] = times(&row[g - fg], t[0] + t[1]).to_array();
            for i in 0..self.rows[g] {
                if self.d_inv[g][i] == 0.0 {
                    let lack = rest[0][i].abs();
                    self.lack[g][i] = lack;
                    contradiction = if lack <= contradiction { contradiction } else { lack };
                }
            }
        }
        self.behind.fill([f64x4::splat(0.0); WIDTH]);
        for g in (0..n).rev() {
            let row = &self.a[self.start[g]..self.start[g + 1]];
            let [a, b, c, d] = f64x4::transpose(self.behind[g]);
            let t = f64x4::new(x[g]).mul_sub(f64x4::new(self.d_inv[g]), (a + b) + (c + d));
            let t = times(&self.inverse[g], t);
            x[g] = t.to_array();
            for (L, behind) in row.iter().zip(&mut self.behind[self.first[g]..g]) {
                for (L, behind) in L.iter().zip(behind) {
                    *behind = L.mul_add(t, *behind);
                }
            }
        }
        contradiction
    }
}

const UNIT: [[f64; WIDTH]; WIDTH] =
    [[1.0, 0.0, 0.0, 0.0], [0.0, 1.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0], [0.0, 0.0, 0.0, 1.0]];

const BELOW: [[f64; WIDTH]; WIDTH] =
    [[0.0, 1.0, 1.0, 1.0], [0.0, 0.0, 1.0, 1.0], [0.0, 0.0, 0.0, 1.0], [0.0; WIDTH]];

/// Computes A t for a block stored by columns.
#[inline(always)]
fn times(A: &Block, t: f64x4) -> f64x4 {
    let t = t.as_array().map(f64x4::splat);
    A[1].mul_add(t[1], A[0] * t[0]) + A[3].mul_add(t[3], A[2] * t[2])
}

/// Computes S − C L*.
#[inline(always)]
fn subtract(S: &mut Block, C: &Block, L: &Block) {
    for (C, L) in C.iter().zip(L) {
        let L = L.as_array();
        for (S, L) in S.iter_mut().zip(L) {
            *S = (-*C).mul_add(f64x4::splat(*L), *S);
        }
    }
}
