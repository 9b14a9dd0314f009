//! L D Lᵀ of a positive semidefinite matrix within its envelope, with dependent rows left out.
//!
//! ```text
//! d_k = W_kk − Σ L_kj² d_j        d_k ≤ RANK · size_k: row k repeats earlier rows; x_k = 0
//! ```
//! A semidefinite matrix needs no pivoting for this: where d_k vanishes, what is left of its row
//! vanishes too. Each row is stored from its first entry that is not zero.

/// A pivot that has lost all but this part of its row's size stands for a dependent row.
pub(crate) const RANK: f64 = 1e-11;

#[derive(Clone, Debug, Default)]
pub(crate) struct Skyline {
    /// First column of each row, and where its entries start.
    first: Vec<u32>,
    start: Vec<usize>,
    a: Vec<f64>,
    /// D⁻¹; zero for rows left out.
    d_inv: Vec<f64>,
    pub rank: usize,
}

impl Skyline {
    /// With the first column of each row.
    pub fn new(first: Vec<u32>) -> Self {
        let mut start = vec![0];
        for (i, f) in first.iter().enumerate() {
            start.push(start[i] + i + 1 - *f as usize);
        }
        let (n, size) = (first.len(), start[first.len()]);
        Self { first, start, a: vec![0.0; size], d_inv: vec![0.0; n], rank: 0 }
    }

    /// Sets an entry of the lower triangle.
    #[inline(always)]
    pub fn set(&mut self, i: usize, j: usize, x: f64) {
        self.a[self.start[i] + j - self.first[i] as usize] = x;
    }

    /// Factors in place. `size(k)` is at least W_kk, and more where W_kk itself is what is left of
    /// larger terms that cancel.
    pub fn factor(&mut self, size: impl Fn(usize) -> f64) {
        self.rank = 0;
        for i in 0..self.first.len() {
            let fi = self.first[i] as usize;
            let (done, rest) = self.a.split_at_mut(self.start[i]);
            let row = &mut rest[..i + 1 - fi];
            let diagonal = row[i - fi];
            let mut d = diagonal;
            for j in fi..i {
                // L_ij d_j, then L_ij.
                let fj = self.first[j] as usize;
                let from = fi.max(fj);
                let other = &done[self.start[j] + from - fj..self.start[j] + j - fj];
                let sum = dot(&row[from - fi..j - fi], other);
                row[j - fi] -= sum;
            }
            for j in fi..i {
                let scaled = row[j - fi] * self.d_inv[j];
                d -= scaled * row[j - fi];
                row[j - fi] = scaled;
            }
            let keep = d > RANK * diagonal.max(size(i));
            self.d_inv[i] = if keep { 1.0 / d } else { 0.0 };
            self.rank += usize::from(keep);
        }
    }

    /// x ← W⁻¹ x over the rows that were kept; zero at the others. Returns how far the right side
    /// of a row left out is from what the kept rows imply.
    pub fn solve(&mut self, x: &mut [f64]) -> f64 {
        let n = self.first.len();
        let mut contradiction: f64 = 0.0;
        for i in 0..n {
            let fi = self.first[i] as usize;
            let row = &self.a[self.start[i]..self.start[i] + i - fi];
            x[i] -= dot(row, &x[fi..i]);
        }
        for (x, d) in x[..n].iter_mut().zip(&self.d_inv) {
            if *d == 0.0 && !(x.abs() <= contradiction) {
                contradiction = x.abs();
            }
            *x *= d;
        }
        for i in (0..n).rev() {
            let fi = self.first[i] as usize;
            let row = &self.a[self.start[i]..self.start[i] + i - fi];
            let xi = x[i];
            for (x, l) in x[fi..i].iter_mut().zip(row) {
                *x -= l * xi;
            }
        }
        contradiction
    }
}

/// Four sums side by side.
#[inline(always)]
fn dot(a: &[f64], b: &[f64]) -> f64 {
    let mut s = [0.0; 4];
    let (ac, bc) = (a.chunks_exact(4), b.chunks_exact(4));
    let (ar, br) = (ac.remainder(), bc.remainder());
    for (a, b) in ac.zip(bc) {
        for k in 0..4 {
            s[k] += a[k] * b[k];
        }
    }
    let rest: f64 = ar.iter().zip(br).map(|(a, b)| a * b).sum();
    (s[0] + s[1]) + (s[2] + s[3]) + rest
}
