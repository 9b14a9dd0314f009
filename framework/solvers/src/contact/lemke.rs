//! Lemke's method for the linear complementarity problem with polyhedral friction: for small problems.
//!
//! ```text
//! equality rows first (rank by pivots, redundant ones get no impulse):
//!   W ← W_cc − W_cb W_bb⁺ W_bc,    w ← b_c − W_cb W_bb⁺ b_b
//! rows of the LCP  z ≥ 0 ⊥ M z + q ≥ 0, with d_k = (cos 2πk/n, sin 2πk/n):
//!   unilateral   z = λ,                          M z + q = v
//!   dry          z = [λ + bound; σ],             [v + σ; 2 bound − (λ + bound)]
//!   Coulomb      z = [pn; p_k; σ],  λt = Σ d_k p_k,   [vn; d_k·vt + σ; μ pn − Σ p_k]
//!   spin         z = [.. p₊, p₋, σs],  λs = p₊ − p₋,   [.. ±vs + σs; μs pn − p₊ − p₋]
//! Lemke: w − M z − 1 z₀ = q; z₀ enters for the least q; then the complement of what left enters;
//!   the row that leaves is the lexicographic least of (w at basis row) / pivot, so nothing cycles
//! λ_b = −W_bb⁺ (W_bc λ_c + b_b)
//! ```
//! M is copositive for μ ≥ 0, so the method ends at a solution where one exists in the sense of Stewart and Trinkle; a secondary ray is reported. A
//! sliding direction is one of n directions, or between two of them: compared with the circular cone, an impulse is too small by up to 1 − cos(π/n).

use super::dense::{pivoted_cholesky, solve_cholesky};
use super::problem::{Cone, Problem, axpy4};

/// Reason why Lemke's method did not find a solution.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Failure {
    /// The complementarity problem has more than 160 rows.
    TooLarge,
    /// A secondary ray: no variable can leave the basis. A solution may not exist.
    Ray,
    /// The limit of pivots was reached, or the numbers lost their precision.
    Stalled,
}

/// Workspace, allocated once.
#[derive(Clone, Debug, Default)]
pub(crate) struct Lemke {
    /// First row of each group in W.
    first: Vec<usize>,
    /// Dense compliance, rows × rows, and free velocities.
    W: Vec<f64>,
    v: Vec<f64>,
    /// Equality rows: indices, factor, order of pivots, right sides.
    bilateral: Vec<usize>,
    factor: Vec<f64>,
    order: Vec<usize>,
    side: Vec<f64>,
    /// One row for each degree of freedom.
    spread: Vec<[f64; 4]>,
    /// Variables of the LCP as combinations of rows: (row, weight) twice, and their kind.
    unknowns: Vec<Unknown>,
    tableau: Vec<f64>,
    basis: Vec<usize>,
    impulse: Vec<f64>,
    /// Unit of impulses: largest |b| divided by the largest diagonal entry of W.
    unit: f64,
}

/// A variable of the LCP, and the slack that is its complement.
#[derive(Clone, Copy, Debug)]
enum Unknown {
    /// An impulse along a direction in the rows from `row` on; `sigma` is its slip variable.
    Impulse { row: usize, direction: [f64; 2], sigma: Option<usize> },
    /// Slip: bound of the impulses `members`: weight × impulse of `of`, or a constant.
    Slip { of: Option<usize>, weight: f64, members: (usize, usize) },
}

impl Lemke {
    /// Maximum number of rows of the LCP; the tableau has rows × (2 rows + 2) numbers.
    pub const ROWS: usize = 160;

    /// Returns the number of rows of the LCP.
    pub fn size(problem: &Problem, directions: usize) -> usize {
        let rows = |cone: &Cone| match cone {
            Cone::Equality { .. } => 0,
            Cone::Unilateral => 1,
            Cone::Dry { .. } => 2,
            Cone::Coulomb { .. } => 2 + directions,
            Cone::Spinning { .. } => 5 + directions,
        };
        problem.cones.iter().map(rows).sum()
    }

    /// Solves for `lambda`. Returns the number of pivots.
    pub fn solve(
        &mut self,
        problem: &Problem,
        directions: usize,
        lambda: &mut [[f64; 4]],
    ) -> Result<u32, Failure> {
        let n = Self::size(problem, directions);
        if n > Self::ROWS {
            return Err(Failure::TooLarge);
        }
        let rows = self.dense(problem);
        let rank = self.eliminate(problem, rows);
        self.describe(problem, directions);
        self.tabulate(problem, rows);
        let pivots = self.pivot(n)?;
        self.impulse.clear();
        self.impulse.resize(rows, 0.0);
        for i in 0..n {
            let (variable, value) = (self.basis[i], self.tableau[i * (2 * n + 2) + 2 * n + 1]);
            if let Some(Unknown::Impulse { row, direction, .. }) =
                variable.checked_sub(n).and_then(|u| self.unknowns.get(u))
            {
                self.impulse[*row] += direction[0] * value;
                if direction[1] != 0.0 {
                    self.impulse[row + 1] += direction[1] * value;
                }
            }
        }
        self.hand_back(problem, rows, rank, lambda);
        Ok(pivots)
    }

    /// Computes W = E Eᵀ + R and b, all rows. O(groups × entries).
    fn dense(&mut self, problem: &Problem) -> usize {
        let rows = problem.rows();
        self.first.clear();
        self.W.clear();
        self.W.resize(rows * rows, 0.0);
        self.v.clear();
        let mut first = 0;
        for (g, cone) in problem.cones.iter().enumerate() {
            self.first.push(first);
            self.v.extend_from_slice(&problem.b[g][..cone.rows()]);
            first += cone.rows();
        }
        self.spread.clear();
        self.spread.resize(problem.factor.dofs, [0.0; 4]);
        for (g, cone) in problem.cones.iter().enumerate() {
            let (dof, e) = problem.entries(g);
            for (&d, e) in dof.iter().zip(e) {
                self.spread[d as usize] = *e;
            }
            for h in 0..=g {
                let mut block = [[0.0; 4]; 4];
                let (dofs, es) = problem.entries(h);
                for (&d, e) in dofs.iter().zip(es) {
                    let x = &self.spread[d as usize];
                    for j in 0..4 {
                        block[j] = axpy4(x[j], e, block[j]);
                    }
                }
                for j in 0..cone.rows() {
                    for k in 0..problem.cones[h].rows() {
                        let (a, b) = (self.first[g] + j, self.first[h] + k);
                        self.W[a * rows + b] = block[j][k];
                        self.W[b * rows + a] = block[j][k];
                    }
                }
            }
            for &d in dof {
                self.spread[d as usize] = [0.0; 4];
            }
            let soft = problem.soft(g);
            for j in 0..cone.rows() {
                self.W[(self.first[g] + j) * (rows + 1)] += soft[j];
            }
        }
        self.scale(rows);
        rows
    }

    /// Divides W by its largest diagonal entry and v by its largest.
    fn scale(&mut self, rows: usize) {
        let w = (0..rows).fold(0.0f64, |m, k| m.max(self.W[k * (rows + 1)]));
        let v = self.v.iter().fold(0.0f64, |m, v| m.max(v.abs()));
        let (w, v) = (if w > 0.0 { w } else { 1.0 }, if v > 0.0 { v } else { 1.0 });
        self.W.iter_mut().for_each(|x| *x /= w);
        self.v.iter_mut().for_each(|x| *x /= v);
        self.unit = v / w;
    }

    /// Eliminates the equality rows from W and v. Returns their rank.
    fn eliminate(&mut self, problem: &Problem, rows: usize) -> usize {
        self.bilateral.clear();
        for (g, cone) in problem.cones.iter().enumerate() {
            if let Cone::Equality { rows } = *cone {
                self.bilateral.extend(self.first[g]..self.first[g] + rows);
            }
        }
        let m = self.bilateral.len();
        self.factor.clear();
        self.factor.resize(m * m, 0.0);
        self.order.clear();
        self.order.resize(m, 0);
        for (i, &a) in self.bilateral.iter().enumerate() {
            for (j, &b) in self.bilateral.iter().enumerate() {
                self.factor[i * m + j] = self.W[a * rows + b];
            }
        }
        let rank = pivoted_cholesky(&mut self.factor, m, &mut self.order);
        // The loop is over the columns of W_bc, then b_b.
        for c in 0..=rows {
            if self.bilateral.binary_search(&c).is_ok() || rank == 0 {
                continue;
            }
            self.side.clear();
            for &k in &self.order[..rank] {
                let row = self.bilateral[k];
                self.side.push(if c < rows { self.W[row * rows + c] } else { self.v[row] });
            }
            solve_cholesky(&self.factor, m, rank, &mut self.side);
            for a in 0..rows {
                if self.bilateral.binary_search(&a).is_ok() {
                    continue;
                }
                let pairs = self.order[..rank].iter().zip(&self.side);
                let x: f64 = pairs.map(|(&k, x)| self.W[a * rows + self.bilateral[k]] * x).sum();
                if c < rows {
                    self.W[a * rows + c] -= x;
                } else {
                    self.v[a] -= x;
                }
            }
        }
        rank
    }

    /// Lists the variables of the LCP.
    fn describe(&mut self, problem: &Problem, directions: usize) {
        self.unknowns.clear();
        for (g, cone) in problem.cones.iter().enumerate() {
            let (row, at) = (self.first[g], self.unknowns.len());
            let normal = Unknown::Impulse { row, direction: [1.0, 0.0], sigma: None };
            match *cone {
                Cone::Equality { .. } => {}
                Cone::Unilateral => self.unknowns.push(normal),
                Cone::Dry { bound } => {
                    let direction = [1.0, 0.0];
                    self.unknowns.push(Unknown::Impulse { row, direction, sigma: Some(at + 1) });
                    let members = (at, at + 1);
                    self.unknowns.push(Unknown::Slip {
                        of: None,
                        weight: 2.0 * bound / self.unit,
                        members,
                    });
                }
                Cone::Coulomb { friction } => {
                    self.unknowns.push(normal);
                    self.wheel(row + 1, at, directions, friction);
                }
                Cone::Spinning { friction, spin } => {
                    self.unknowns.push(normal);
                    self.wheel(row + 1, at, directions, friction);
                    let (from, sigma) = (self.unknowns.len(), Some(self.unknowns.len() + 2));
                    for sign in [1.0, -1.0] {
                        let (row, direction) = (row + 3, [sign, 0.0]);
                        self.unknowns.push(Unknown::Impulse { row, direction, sigma });
                    }
                    let members = (from, from + 2);
                    self.unknowns.push(Unknown::Slip { of: Some(at), weight: spin, members });
                }
            }
        }
    }

    /// Adds the directions of friction, evenly distributed, and their slip variable.
    fn wheel(&mut self, row: usize, of: usize, directions: usize, friction: f64) {
        let from = self.unknowns.len();
        for k in 0..directions {
            let (s, c) = (std::f64::consts::TAU * k as f64 / directions as f64).sin_cos();
            let sigma = Some(from + directions);
            self.unknowns.push(Unknown::Impulse { row, direction: [c, s], sigma });
        }
        let members = (from, from + directions);
        self.unknowns.push(Unknown::Slip { of: Some(of), weight: friction, members });
    }

    /// Fills the tableau [1 | −M | −1 | q], in the units of `scale`.
    fn tabulate(&mut self, problem: &Problem, rows: usize) {
        let n = self.unknowns.len();
        let width = 2 * n + 2;
        self.tableau.clear();
        self.tableau.resize(n * width, 0.0);
        self.basis.clear();
        self.basis.extend(0..n);
        let bound = |row: usize| {
            let g = self.first.partition_point(|&f| f <= row) - 1;
            if let Cone::Dry { bound } = problem.cones[g] { bound / self.unit } else { 0.0 }
        };
        let along = |row: usize, d: &[f64; 2], other: usize, e: &[f64; 2]| {
            let w = |i: usize, j: usize| {
                let weight = d[i] * e[j];
                if weight == 0.0 { 0.0 } else { weight * self.W[(row + i) * rows + other + j] }
            };
            w(0, 0) + w(0, 1) + w(1, 0) + w(1, 1)
        };
        for (i, unknown) in self.unknowns.iter().enumerate() {
            let line = &mut self.tableau[i * width..(i + 1) * width];
            line[i] = 1.0;
            line[2 * n] = -1.0;
            match unknown {
                Unknown::Impulse { row, direction, sigma } => {
                    let second = if direction[1] != 0.0 { self.v[row + 1] } else { 0.0 };
                    let mut q = direction[0] * self.v[*row] + direction[1] * second;
                    for (j, other) in self.unknowns.iter().enumerate() {
                        if let Unknown::Impulse { row: c, direction: e, .. } = other {
                            let w = along(*row, direction, *c, e);
                            line[n + j] = -w;
                            q -= w * bound(*c);
                        }
                    }
                    if let Some(s) = sigma {
                        line[n + s] = -1.0;
                    }
                    line[2 * n + 1] = q;
                }
                Unknown::Slip { of, weight, members } => {
                    for j in members.0..members.1 {
                        line[n + j] = 1.0;
                    }
                    match of {
                        Some(normal) => line[n + normal] = -weight,
                        None => line[2 * n + 1] = *weight,
                    }
                }
            }
        }
    }

    /// Makes complementary pivots until z₀ leaves. Columns: w 0..n, z n..2n, z₀ 2n, q 2n + 1.
    fn pivot(&mut self, n: usize) -> Result<u32, Failure> {
        let width = 2 * n + 2;
        let q = |t: &[f64], i: usize| t[i * width + 2 * n + 1];
        let mut leave = 0;
        for i in 1..n {
            if q(&self.tableau, i) < q(&self.tableau, leave) {
                leave = i;
            }
        }
        if n == 0 || q(&self.tableau, leave) >= 0.0 {
            return Ok(0);
        }
        let mut enter = 2 * n;
        for pivots in 1..=(50 + 20 * n as u32) {
            let left = self.basis[leave];
            self.basis[leave] = enter;
            eliminate(&mut self.tableau, n, width, leave, enter);
            if left == 2 * n {
                let fine = self.tableau.iter().all(|x| x.is_finite());
                return if fine { Ok(pivots) } else { Err(Failure::Stalled) };
            }
            enter = if left < n { left + n } else { left - n };
            leave = self.leaving(n, width, enter).ok_or(Failure::Ray)?;
        }
        Err(Failure::Stalled)
    }

    /// Returns the row with the lexicographically smallest (q, w columns) / pivot. If q is equal, z₀ has priority.
    fn leaving(&self, n: usize, width: usize, enter: usize) -> Option<usize> {
        let t = |i: usize, j: usize| self.tableau[i * width + j];
        let largest = (0..n).fold(0.0f64, |m, i| m.max(t(i, enter)));
        let mut best: Option<usize> = None;
        for i in 0..n {
            if !(t(i, enter) > 1e-11 * largest.max(1e-3)) {
                continue;
            }
            let Some(b) = best else {
                best = Some(i);
                continue;
            };
            let ratio = |i: usize, j: usize| t(i, j) / t(i, enter);
            let (x, y) = (ratio(i, 2 * n + 1), ratio(b, 2 * n + 1));
            let tie = (x - y).abs() <= 1e-14 * (x.abs() + y.abs());
            if !tie {
                if x < y {
                    best = Some(i);
                }
                continue;
            }
            if self.basis[b] == 2 * n {
                continue;
            }
            let less = (0..n).map(|j| (ratio(i, j), ratio(b, j))).find(|(x, y)| x != y);
            if self.basis[i] == 2 * n || less.is_some_and(|(x, y)| x < y) {
                best = Some(i);
            }
        }
        best
    }

    /// Writes the impulses of the groups, and computes those of equality rows from the others.
    fn hand_back(&mut self, problem: &Problem, rows: usize, rank: usize, lambda: &mut [[f64; 4]]) {
        for (g, cone) in problem.cones.iter().enumerate() {
            lambda[g] = [0.0; 4];
            if let Cone::Dry { bound } = *cone {
                self.impulse[self.first[g]] -= bound / self.unit;
            }
        }
        self.side.clear();
        for &k in &self.order[..rank] {
            let row = self.bilateral[k];
            let line = &self.W[row * rows..(row + 1) * rows];
            let sum: f64 = line.iter().zip(&self.impulse).map(|(w, l)| w * l).sum();
            self.side.push(-self.v[row] - sum);
        }
        solve_cholesky(&self.factor, self.bilateral.len(), rank, &mut self.side);
        for (&k, x) in self.order[..rank].iter().zip(&self.side) {
            self.impulse[self.bilateral[k]] = *x;
        }
        for (g, cone) in problem.cones.iter().enumerate() {
            let first = self.first[g];
            for k in 0..cone.rows() {
                lambda[g][k] = self.impulse[first + k] * self.unit;
            }
        }
    }
}

/// Makes column `enter` a unit vector with its one in row `leave`.
fn eliminate(t: &mut [f64], n: usize, width: usize, leave: usize, enter: usize) {
    let pivot = t[leave * width + enter];
    for x in &mut t[leave * width..(leave + 1) * width] {
        *x /= pivot;
    }
    let (above, rest) = t.split_at_mut(leave * width);
    let (row, below) = rest.split_at_mut(width);
    for line in above.chunks_exact_mut(width).chain(below.chunks_exact_mut(width)).take(n) {
        let f = line[enter];
        if f != 0.0 {
            for (a, b) in line.iter_mut().zip(row.iter()) {
                *a = super::problem::fma(-f, *b, *a);
            }
            line[enter] = 0.0;
        }
    }
}
