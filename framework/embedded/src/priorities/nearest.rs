//! Nearest point of a polyhedron.
//!
//! ```text
//! min ½ |z − z₀|²,   n_iᵀ z ≤ d_i,   |n_i| = 1
//! ```
//! Uses the dual method of Goldfarb and Idnani (Mathematical Programming 27, 1983) with a unit Hessian. It starts at z₀ and adds the most violated
//! row; rows whose multiplier would become negative are removed. No feasible start is needed.

/// Solver with its memory.
#[derive(Clone, Debug)]
pub(super) struct Nearest {
    /// Active rows and their multipliers.
    active: Vec<usize>,
    u: Vec<f64>,
    /// QR factors of the active rows: columns of Q (m each), R by columns (`room` each).
    Q: Vec<f64>,
    R: Vec<f64>,
    r: Vec<f64>,
    z: Vec<f64>,
    room: usize,
}

/// Largest accepted violation of a row, relative to the size of its numbers.
const TOLERANCE: f64 = 1e-11;

impl Nearest {
    /// Creates a solver for points with up to m numbers.
    pub fn new(m: usize) -> Self {
        Self {
            active: Vec::with_capacity(m + 1),
            u: Vec::with_capacity(m + 1),
            Q: vec![0.0; m * m],
            R: vec![0.0; m * m],
            r: vec![0.0; m],
            z: vec![0.0; m],
            room: m,
        }
    }

    /// Moves z to the nearest point; returns false when the polyhedron is empty. `rows` contains m numbers each, of length 1; `right` is d.
    pub fn solve(&mut self, z: &mut [f64], rows: &[f64], right: &[f64]) -> bool {
        let m = z.len();
        self.active.clear();
        self.u.clear();
        // This bound is far above the number of iterations that occur; a row may enter and leave many times.
        for _ in 0..50 * (right.len() + m + 1) {
            let (mut worst, mut most) = (None, 0.0);
            for (i, (row, d)) in rows.chunks_exact(m).zip(right).enumerate() {
                let over = dot(row, z) - d - TOLERANCE * (1.0 + d.abs());
                if over > most && !self.active.contains(&i) {
                    (worst, most) = (Some(i), over);
                }
            }
            let Some(p) = worst else { return true };
            if !self.take_in(p, z, rows, right) {
                return false;
            }
        }
        false
    }

    /// Adds row p to the active rows, so that it is satisfied.
    fn take_in(&mut self, p: usize, z: &mut [f64], rows: &[f64], right: &[f64]) -> bool {
        let m = z.len();
        let n = &rows[m * p..m * (p + 1)];
        let mut multiplier = 0.0;
        loop {
            let q = self.active.len();
            // Project n onto the complement of the active rows, twice because of round-off; R r = Qᵀ n.
            self.z[..m].copy_from_slice(n);
            self.r[..q].fill(0.0);
            for _ in 0..2 {
                for k in 0..q {
                    let along = dot(&self.Q[m * k..m * (k + 1)], &self.z[..m]);
                    self.r[k] += along;
                    for (x, e) in self.z[..m].iter_mut().zip(&self.Q[m * k..m * (k + 1)]) {
                        *x -= along * e;
                    }
                }
            }
            for i in (0..q).rev() {
                let more: f64 = (i + 1..q).map(|k| self.R[self.room * k + i] * self.r[k]).sum();
                self.r[i] = (self.r[i] - more) / self.R[self.room * i + i];
            }
            let (mut leaves, mut dual) = (None, f64::INFINITY);
            for k in 0..q {
                if self.r[k] > 0.0 && self.u[k] / self.r[k] < dual {
                    (leaves, dual) = (Some(k), self.u[k] / self.r[k]);
                }
            }
            let left = dot(&self.z[..m], &self.z[..m]);
            let over = dot(n, z) - right[p];
            let primal = if left > 1e-20 { over / left } else { f64::INFINITY };
            let t = dual.min(primal);
            if t == f64::INFINITY {
                return false;
            }
            if primal < f64::INFINITY {
                for (x, d) in z.iter_mut().zip(&self.z[..m]) {
                    *x -= t * d;
                }
            }
            for (u, r) in self.u.iter_mut().zip(&self.r) {
                *u -= t * r;
            }
            multiplier += t;
            match leaves {
                Some(k) if dual < primal => self.leave(k, m, rows),
                _ => {
                    self.active.push(p);
                    self.u.push(multiplier);
                    self.factor(q, m, rows);
                    return true;
                }
            }
        }
    }

    fn leave(&mut self, k: usize, m: usize, rows: &[f64]) {
        self.active.remove(k);
        self.u.remove(k);
        for column in k..self.active.len() {
            self.factor(column, m, rows);
        }
    }

    /// Computes a column of Q and R from its row and the columns before it.
    fn factor(&mut self, column: usize, m: usize, rows: &[f64]) {
        let row = self.active[column];
        let (before, own) = self.Q.split_at_mut(m * column);
        let own = &mut own[..m];
        own.copy_from_slice(&rows[m * row..m * (row + 1)]);
        let R = &mut self.R[self.room * column..self.room * column + column + 1];
        R.fill(0.0);
        for _ in 0..2 {
            for (k, e) in before.chunks_exact(m).enumerate() {
                let along = dot(e, own);
                R[k] += along;
                own.iter_mut().zip(e).for_each(|(x, e)| *x -= along * e);
            }
        }
        let length = dot(own, own).sqrt();
        R[column] = length;
        own.iter_mut().for_each(|x| *x /= length);
    }
}

pub(super) fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}
