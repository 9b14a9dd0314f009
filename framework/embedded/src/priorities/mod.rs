//! Prioritized least squares with bounds: a later level never degrades an earlier one.
//!
//! ```text
//! level k:   min |A_k x − b_k|²   over the x that are optimal at levels 1 … k − 1,   c_iᵀ x ≤ d_i for all i
//! x = x_{k−1} + Z y               Z: null space of the earlier levels
//! A_k Z = B = P [T 0] [V₁ V₂]ᵀ    min |T w − Pᵀ(b_k − A_k x_{k−1})|² + ε |t|²,   y = V₁ w + V₂ t;   Z ← Z V₂
//! ```
//! One least-squares problem is solved for each level (Kanoun, Lamiraux, Wieber, IEEE Transactions on Robotics 27, 2011). Each is reduced to the
//! nearest point of a polyhedron (`framework/embedded/src/priorities/nearest.rs`) in variables in which the cost is a distance, so no matrix is
//! squared. Among all solutions the one with the smallest norm is chosen.

mod nearest;

use nearest::{Nearest, dot};

/// √ε: weight of the remaining freedom, small enough not to change the solution of a level.
const FREE: f64 = 1e-5;
/// Rank tolerance of a level, relative to its largest row.
const RANK: f64 = 1e-9;

/// Result of a level.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LevelResult {
    /// |A x − b| in the unit of the rows.
    pub residual: f64,
    /// Degrees of freedom that remain for later levels.
    pub free: usize,
}

/// The bounds contradict each other.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct NoSolution;

/// A prioritized least-squares problem, with its memory.
#[derive(Clone, Debug)]
pub struct Priorities {
    n: usize,
    rows: usize,
    room: usize,
    x: Vec<f64>,
    /// Columns of Z (n each), and their number.
    Z: Vec<f64>,
    free: usize,
    /// c (n each) and d.
    c: Vec<f64>,
    d: Vec<f64>,
    /// Rows of B (free each), e, and the right-hand reflections.
    B: Vec<f64>,
    e: Vec<f64>,
    V: Vec<f64>,
    T: Vec<f64>,
    y: Vec<f64>,
    z: Vec<f64>,
    normals: Vec<f64>,
    right: Vec<f64>,
    next: Vec<f64>,
    nearest: Nearest,
}

impl Priorities {
    /// Creates a problem for n unknowns, with up to `rows` rows in each level and up to `bounds` bounds. Allocates memory; later calls do not.
    #[must_use]
    pub fn new(n: usize, rows: usize, bounds: usize) -> Self {
        Self {
            n,
            rows,
            room: bounds,
            x: vec![0.0; n],
            Z: vec![0.0; n * n],
            free: n,
            c: Vec::with_capacity(n * bounds),
            d: Vec::with_capacity(bounds),
            B: vec![0.0; n * rows],
            e: vec![0.0; rows],
            V: vec![0.0; n * n],
            T: vec![0.0; n * rows],
            y: vec![0.0; n],
            z: vec![0.0; n],
            normals: Vec::with_capacity(n * bounds),
            right: Vec::with_capacity(bounds),
            next: vec![0.0; (n * n).max(rows)],
            nearest: Nearest::new(n),
        }
    }

    /// Starts a new problem: no bounds, no levels, x = 0.
    pub fn begin(&mut self) {
        self.x.fill(0.0);
        self.Z.fill(0.0);
        self.free = self.n;
        for i in 0..self.n {
            self.Z[self.n * i + i] = 1.0;
        }
        self.c.clear();
        self.d.clear();
    }

    /// Adds the bound cᵀ x ≤ d (n numbers) for all following levels. An infinite d adds no bound.
    ///
    /// # Panics
    /// If the length is wrong or the reserved number of bounds is exceeded.
    pub fn bound(&mut self, c: &[f64], d: f64) {
        assert!(c.len() == self.n, "a bound has {} numbers", self.n);
        if d < f64::INFINITY {
            assert!(self.d.len() < self.room, "room for {} bounds", self.room);
            self.c.extend_from_slice(c);
            self.d.push(d);
        }
    }

    /// Returns the solution of all levels so far.
    #[must_use]
    pub fn x(&self) -> &[f64] {
        &self.x
    }

    /// Adds and solves the next level: A (rows × n, row after row) and b.
    ///
    /// # Errors
    /// [`NoSolution`] when the bounds contradict each other or the earlier levels.
    ///
    /// # Panics
    /// If lengths do not agree or the reserved number of rows is exceeded.
    pub fn level(&mut self, A: &[f64], b: &[f64]) -> Result<LevelResult, NoSolution> {
        let (n, rows, free) = (self.n, b.len(), self.free);
        assert!(A.len() == rows * n && rows <= self.rows, "room for {} rows of {n}", self.rows);
        for (i, row) in A.chunks_exact(n.max(1)).enumerate() {
            self.e[i] = b[i] - dot(row, &self.x);
            for k in 0..free {
                self.B[free * i + k] = dot(row, &self.Z[n * k..n * (k + 1)]);
            }
        }
        // The rank tolerance is relative to the original rows, because rows that earlier levels fix completely contain only round-off.
        let length = |x: &[f64]| dot(x, x).sqrt();
        let greatest = A.chunks_exact(n.max(1)).map(length).fold(0.0, f64::max);
        let rank = self.decompose(rows, greatest);
        self.solve(rows, rank)?;
        // x = x + Z V (w, t); Z ← Z V₂.
        for k in 0..free {
            for i in 0..n {
                self.next[n * k + i] =
                    (0..free).map(|j| self.Z[n * j + i] * self.V[free * k + j]).sum();
            }
        }
        for k in 0..free {
            let column = &self.next[n * k..n * (k + 1)];
            self.x.iter_mut().zip(column).for_each(|(x, v)| *x += v * self.y[k]);
        }
        self.free = free - rank;
        self.Z[..n * self.free].copy_from_slice(&self.next[n * rank..n * free]);
        let rest = A.chunks_exact(n.max(1)).zip(b).map(|(row, b)| dot(row, &self.x) - b);
        Ok(LevelResult { residual: rest.map(|x| x * x).sum::<f64>().sqrt(), free: self.free })
    }

    /// Computes columns of V (free each), an orthonormal basis whose first `rank` columns span the rows of B, with a rank tolerance relative to
    /// `greatest`; T = B V₁ (rows × rank).
    fn decompose(&mut self, rows: usize, greatest: f64) -> usize {
        let free = self.free;
        let length = |x: &[f64]| dot(x, x).sqrt();
        let mut rank = 0;
        self.T[..rows * free].copy_from_slice(&self.B[..rows * free]);
        // Select the row that is longest after projection: Gram–Schmidt with pivoting, each projection done twice.
        while rank < free.min(rows) && greatest > 0.0 {
            let (mut best, mut most) = (0, 0.0);
            for (i, row) in self.T[..rows * free].chunks_exact(free).enumerate() {
                if length(row) > most {
                    (best, most) = (i, length(row));
                }
            }
            if most <= RANK * greatest {
                break;
            }
            let (before, own) = self.V.split_at_mut(free * rank);
            let own = &mut own[..free];
            own.copy_from_slice(&self.T[free * best..free * (best + 1)]);
            own.iter_mut().for_each(|x| *x /= most);
            orthogonal(before, own);
            let own = &self.V[free * rank..free * (rank + 1)];
            for row in self.T[..rows * free].chunks_exact_mut(free) {
                let along = dot(row, own);
                row.iter_mut().zip(own).for_each(|(x, v)| *x -= along * v);
            }
            rank += 1;
        }
        // Complete the basis from the unit vectors with the largest projections.
        for k in rank..free {
            let (mut best, mut most) = (0, -1.0);
            for i in 0..free {
                let inside: f64 = (0..k).map(|c| self.V[free * c + i].powi(2)).sum();
                if 1.0 - inside > most {
                    (best, most) = (i, 1.0 - inside);
                }
            }
            let (before, own) = self.V.split_at_mut(free * k);
            let own = &mut own[..free];
            own.fill(0.0);
            own[best] = 1.0;
            orthogonal(before, own);
        }
        for i in 0..rows {
            for k in 0..rank {
                let row = &self.B[free * i..free * (i + 1)];
                self.T[rank * i + k] = dot(row, &self.V[free * k..free * (k + 1)]);
            }
        }
        rank
    }

    /// Computes y, the optimal coefficients along V within the bounds.
    fn solve(&mut self, rows: usize, rank: usize) -> Result<(), NoSolution> {
        let (n, free) = (self.n, self.free);
        if free == 0 {
            return Ok(());
        }
        // Factor T = Q R by Householder reflections (rows ≥ rank), in place; e ← Qᵀ e.
        for k in 0..rank {
            let column = |i: usize| rank * i + k;
            let length = (k..rows).map(|i| self.T[column(i)].powi(2)).sum::<f64>().sqrt();
            let first = self.T[column(k)];
            let alpha = if first > 0.0 { -length } else { length };
            let mut square = 0.0;
            for i in k..rows {
                let x = if i == k { first - alpha } else { self.T[column(i)] };
                self.next[i] = x;
                square += x * x;
            }
            for j in k..rank {
                let along: f64 = (k..rows).map(|i| self.next[i] * self.T[rank * i + j]).sum();
                for i in k..rows {
                    self.T[rank * i + j] -= 2.0 * along / square * self.next[i];
                }
            }
            let along: f64 = (k..rows).map(|i| self.next[i] * self.e[i]).sum();
            for i in k..rows {
                self.e[i] -= 2.0 * along / square * self.next[i];
            }
        }
        // z = (R w, √ε t); the optimum without bounds is (Qᵀ e, 0).
        let z = &mut self.z[..free];
        z[..rank].copy_from_slice(&self.e[..rank]);
        z[rank..].fill(0.0);
        self.normals.clear();
        self.right.clear();
        for (c, d) in self.c.chunks_exact(n).zip(&self.d) {
            let at = self.normals.len();
            // Transform the bound: cᵀ Z V along y, then Rᵀ n_w = c_w and √ε n_t = c_t.
            for k in 0..free {
                self.y[k] = dot(c, &self.Z[n * k..n * (k + 1)]);
            }
            let mut left = 0.0;
            for k in 0..free {
                let x = dot(&self.y[..free], &self.V[free * k..free * (k + 1)]);
                left += x * x;
                self.normals.push(x);
            }
            // The bound does not depend on the remaining freedom, so only check it.
            if left <= 1e-18 * dot(c, c) {
                if dot(c, &self.x) - d > 1e-6 * (1.0 + d.abs()) {
                    return Err(NoSolution);
                }
                self.normals.truncate(at);
                continue;
            }
            let own = &mut self.normals[at..];
            for k in 0..rank {
                let before: f64 = (0..k).map(|i| self.T[rank * i + k] * own[i]).sum();
                own[k] = (own[k] - before) / self.T[rank * k + k];
            }
            own[rank..].iter_mut().for_each(|x| *x /= FREE);
            let length = dot(own, own).sqrt();
            own.iter_mut().for_each(|x| *x /= length);
            self.right.push((d - dot(c, &self.x)) / length);
        }
        if !self.nearest.solve(z, &self.normals, &self.right) {
            return Err(NoSolution);
        }
        for k in (0..rank).rev() {
            let after: f64 = (k + 1..rank).map(|j| self.T[rank * k + j] * self.y[j]).sum();
            self.y[k] = (z[k] - after) / self.T[rank * k + k];
        }
        for k in rank..free {
            self.y[k] = z[k] / FREE;
        }
        Ok(())
    }
}

/// Makes `own` a unit vector that is orthogonal to the columns before it.
fn orthogonal(before: &[f64], own: &mut [f64]) {
    for _ in 0..2 {
        for e in before.chunks_exact(own.len()) {
            let along = dot(e, own);
            own.iter_mut().zip(e).for_each(|(x, e)| *x -= along * e);
        }
        let length = dot(own, own).sqrt();
        own.iter_mut().for_each(|x| *x /= length);
    }
}
