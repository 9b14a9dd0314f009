//! Semismooth Newton on the degrees of freedom, inside proximal steps: for large or ill-conditioned problems.
//!
//! ```text
//! proximal problem k, from λᵏ, with weights ρ:      one answer, however redundant the rows
//!   z(y) = (ρ λᵏ − E y − b) / d,   d = R + ρ                    the same d for both tangents
//!   λ(y):  equality z;  unilateral max(0, z);  dry clamp(z, ± bound)
//!          Coulomb  λn = max(0, zn),  λt = disc(zt; μ λn)       exact, not the associated relaxation
//!   G(y) = y − Eᵀ λ(y) = 0
//! Newton:  (1 + Eᵀ H E) δ = −G,   H = −∂λ/∂v by groups; a sliding contact's is not symmetric
//!   dof side:  1 + Eᵀ H E, dofs × dofs
//!   row side:  δ = −G + Eᵀ H w,  (1 + W_aa H_aa) w = E_a G        a: groups with H ≠ 0
//!   the smaller side, dense, up to `DENSE` unknowns; beyond that the dof side, sparse (sparse.rs)
//!   y ← y + t δ, t halved until |G|² falls
//! λᵏ⁺¹ = λ(y), ρ falls while that is easy; else sweeps of Gauss–Seidel from λᵏ, and ρ grows
//! the limit solves the problem itself: ρ leaves no trace in it
//! ```
//! The outer steps contract by ρ / (ρ + σ), where σ is the smallest nonzero compliance. Components that W leaves undetermined keep the values of λ⁰.
//! ρ is relative to the compliance of each group, so that light and heavy bodies may touch. De Saxcé's term is inside the map: only the normal
//! velocity enters λn. For inconsistent equalities, y converges to the least squares solution, each row weighted by 1 / (ρ w_g), while λ drifts in
//! the null space of Eᵀ; the search stops after some steps without progress. Convergence of a line search is not proven for a map that is not a
//! gradient (Coulomb's law does not have a potential); the residual reports failures.

use super::dense::solve_lu;
use super::gauss_seidel::{GaussSeidel, Stop};
use super::law::{pulled, slope};
use super::layout::Layout;
use super::problem::{Problem, axpy4, dot4};
use super::residual::{Measure, measure};
use super::sparse::Sparse;

/// Proximal weight relative to the compliance of the group. The first weight is `START` times the residual of the start, but at most `FIRST`; then it
/// decreases by factors of ten down to `LAST`.
const START: f64 = 10.0;
const FIRST: f64 = 1e-2;
const LAST: f64 = 1e-5;
/// Maximum number of unknowns of a dense matrix.
const DENSE: usize = 64;
/// Maximum number of Newton steps of one proximal problem, and number of steps below which the weight decreases.
const INNER: u32 = 12;
const EASY: u32 = 4;
/// Maximum number of halvings of a step.
const HALVINGS: u32 = 8;
/// A proximal problem counts as solved if |G|² is at most this fraction of (ρ (λ − λᵏ))², or round-off of Σ w λ².
const INEXACT: f64 = 1.0;
const NOISE: f64 = 1e-27;
/// Number of Gauss–Seidel sweeps after a proximal problem that was not solved.
const SWEEPS: u32 = 80;
/// Number of solved proximal problems without progress after which the search stops.
const STALE: u32 = 20;

/// Workspace, allocated once.
#[derive(Clone, Debug, Default)]
pub(crate) struct Newton {
    y: Vec<f64>,
    trial: Vec<f64>,
    G: Vec<f64>,
    step: Vec<f64>,
    A: Vec<f64>,
    side: Vec<f64>,
    extent: Vec<[usize; 2]>,
    /// Impulses of the proximal problem, and of the best result.
    lambda: Vec<[f64; 4]>,
    best: Vec<[f64; 4]>,
    center: Vec<[f64; 4]>,
    /// −∂λ/∂v of each group, by rows: H[i][j].
    H: Vec<[[f64; 4]; 4]>,
    active: Vec<usize>,
    spread: Vec<[f64; 4]>,
    sparse: Sparse,
    /// Whether `sparse` has the pattern of the present problem.
    prepared: bool,
}

impl Newton {
    /// Improves `lambda` after `lead` sweeps of Gauss–Seidel. Returns the number of linear systems solved, and the residual of the result.
    pub fn solve(
        &mut self,
        problem: &Problem,
        layout: &mut Layout,
        sweeps: &mut GaussSeidel,
        stop: Stop,
        lead: u32,
        lambda: &mut [[f64; 4]],
    ) -> (u32, Measure) {
        self.reserve(problem);
        let (lead, few) = (Stop { iterations: lead, ..stop }, Stop { iterations: SWEEPS, ..stop });
        let (_, mut best) = sweeps.solve(problem, layout, lead, 1.0, lambda);
        self.start(layout);
        self.best.copy_from_slice(lambda);
        let mut rho = (START * best.residual).clamp(10.0 * LAST, FIRST);
        let (mut steps, mut stale, mut last) = (0, 0, best);
        while steps < stop.iterations && !(best.residual <= stop.tolerance) && stale < STALE {
            let limit = (stop.iterations - steps).min(INNER);
            let (used, solved) = self.proximal(problem, &layout.scales, rho, limit, lambda);
            steps += used.max(1);
            std::mem::swap(&mut self.lambda, &mut self.center);
            layout.pull(&self.center);
            let now = measure(problem, layout, &self.center);
            self.start(layout);
            if solved || now.residual < best.residual {
                lambda.copy_from_slice(&self.center);
                last = now;
            }
            // An unsolved proximal problem does not indicate lack of progress.
            stale = if now.residual < 0.7 * best.residual { 0 } else { stale + u32::from(solved) };
            self.keep(&mut best, &now, lambda);
            if !solved {
                rho = (10.0 * rho).min(1.0);
                (_, last) = sweeps.solve(problem, layout, few, 1.0, lambda);
                self.start(layout);
                self.keep(&mut best, &last, lambda);
            } else if used <= EASY && stale < EASY {
                rho = (0.1 * rho).max(LAST);
            }
        }
        // If no solution exists, the last step is the least-squares solution, and the best iterate
        // is not.
        if best.residual <= stop.tolerance || !(last.residual <= 2.0 * best.residual) {
            lambda.copy_from_slice(&self.best);
            last = best;
        }
        (steps, last)
    }

    /// Sets y = Eᵀ λ from the last measurement.
    fn start(&mut self, layout: &Layout) {
        self.y.iter_mut().zip(layout.pulled()).for_each(|(y, x)| *y = x);
    }

    /// Keeps `lambda` if it is the best result yet.
    fn keep(&mut self, best: &mut Measure, now: &Measure, lambda: &[[f64; 4]]) {
        if now.residual < best.residual {
            *best = *now;
            self.best.copy_from_slice(lambda);
        }
    }

    /// Allocates for the given numbers of groups and degrees of freedom.
    pub fn make_room(&mut self, groups: usize, dofs: usize) {
        for x in [&mut self.y, &mut self.trial, &mut self.G, &mut self.step] {
            super::room(x, dofs);
        }
        for x in [&mut self.lambda, &mut self.best, &mut self.center] {
            super::room(x, groups);
        }
        super::room(&mut self.spread, dofs);
        super::room(&mut self.H, groups);
        super::room(&mut self.active, groups);
    }

    fn reserve(&mut self, problem: &Problem) {
        let (dofs, groups) = (problem.factor.dofs, problem.groups());
        let n = dofs.min(problem.rows()).min(DENSE);
        self.prepared = false;
        for x in [&mut self.y, &mut self.trial, &mut self.G, &mut self.step] {
            x.resize(dofs, 0.0);
        }
        self.spread.resize(dofs, [0.0; 4]);
        self.side.resize(n, 0.0);
        self.extent.resize(n, [0; 2]);
        self.A.resize(n * n, 0.0);
        self.lambda.resize(groups, [0.0; 4]);
        self.best.resize(groups, [0.0; 4]);
        self.center.resize(groups, [0.0; 4]);
        self.H.resize(groups, [[0.0; 4]; 4]);
        self.active.clear();
        self.active.reserve(groups);
    }

    /// Solves the proximal problem around `center` from y = Eᵀ λ. Returns the number of linear systems solved.
    fn proximal(
        &mut self,
        problem: &Problem,
        scales: &[f64],
        rho: f64,
        limit: u32,
        center: &[[f64; 4]],
    ) -> (u32, bool) {
        let mut size = residual(
            problem,
            scales,
            rho,
            center,
            &self.y,
            Out::new(&mut self.lambda, &mut self.G),
        );
        for steps in 0..limit {
            let close = steps > 0 && size.G <= INEXACT * size.moved;
            if close || !(size.G > NOISE * size.total) {
                return (steps, true);
            }
            self.jacobian(problem, scales, rho, center);
            if !self.direction(problem) {
                return (steps + 1, false);
            }
            let mut t = 1.0;
            let mut falls = false;
            for _ in 0..HALVINGS {
                for (k, x) in self.trial.iter_mut().enumerate() {
                    *x = self.y[k] + t * self.step[k];
                }
                let out = Out::new(&mut self.lambda, &mut self.G);
                let now = residual(problem, scales, rho, center, &self.trial, out);
                if now.G < (1.0 - 1e-4 * t) * size.G {
                    (size, falls) = (now, true);
                    break;
                }
                t *= 0.5;
            }
            if !falls {
                let out = Out::new(&mut self.lambda, &mut self.G);
                residual(problem, scales, rho, center, &self.y, out);
                return (steps + 1, false);
            }
            std::mem::swap(&mut self.y, &mut self.trial);
        }
        (limit, false)
    }
}

impl Newton {
    /// Computes H of each group at y, and lists the groups with H ≠ 0.
    fn jacobian(&mut self, problem: &Problem, scales: &[f64], rho: f64, center: &[[f64; 4]]) {
        self.active.clear();
        for (g, cone) in problem.cones.iter().enumerate() {
            let (z, d) = pulled(problem, scales, rho, center, g, &self.y);
            self.H[g] = slope(cone, &z, &d);
            if self.H[g] != [[0.0; 4]; 4] {
                self.active.push(g);
            }
        }
    }

    /// Computes δ = −(1 + Eᵀ H E)⁻¹ G. Returns false if the matrix is singular.
    fn direction(&mut self, problem: &Problem) -> bool {
        let rows: usize = self.active.iter().map(|&g| problem.cones[g].rows()).sum();
        let dofs = problem.factor.dofs;
        if rows.min(dofs) > DENSE {
            self.sparse_side(problem)
        } else if rows < dofs {
            self.row_side(problem, rows)
        } else {
            self.dof_side(problem)
        }
    }

    fn sparse_side(&mut self, problem: &Problem) -> bool {
        if !self.prepared {
            self.sparse.prepare(problem);
            self.prepared = true;
        }
        self.sparse.clear();
        for &g in &self.active {
            self.sparse.add(problem, g, &self.H[g]);
        }
        if !self.sparse.factor() {
            return false;
        }
        for (step, G) in self.step.iter_mut().zip(&self.G) {
            *step = -G;
        }
        self.sparse.solve(&mut self.step);
        true
    }

    fn dof_side(&mut self, problem: &Problem) -> bool {
        let n = problem.factor.dofs;
        let A = &mut self.A[..n * n];
        A.fill(0.0);
        for k in 0..n {
            A[k * (n + 1)] = 1.0;
            self.step[k] = -self.G[k];
        }
        for &g in &self.active {
            let (dof, e) = problem.entries(g);
            let H = &self.H[g];
            for (&i, left) in dof.iter().zip(e) {
                // This is row i of Eᵀ H.
                let mut row = [0.0; 4];
                for k in 0..4 {
                    row = axpy4(left[k], &H[k], row);
                }
                let line = &mut A[i as usize * n..(i as usize + 1) * n];
                for (&j, right) in dof.iter().zip(e) {
                    line[j as usize] += dot4(&row, right);
                }
            }
        }
        solve_lu(A, n, &mut self.step, &mut self.extent)
    }

    fn row_side(&mut self, problem: &Problem, n: usize) -> bool {
        let A = &mut self.A[..n * n];
        let mut first = 0;
        for &g in &self.active {
            let (dof, e) = problem.entries(g);
            let rows = problem.cones[g].rows();
            let side = problem.gathered(g, &self.G);
            self.side[first..first + rows].copy_from_slice(&side[..rows]);
            for (&d, e) in dof.iter().zip(e) {
                self.spread[d as usize] = *e;
            }
            let mut column = 0;
            for &h in &self.active {
                let mut W = [[0.0; 4]; 4];
                let (dofs, es) = problem.entries(h);
                for (&d, e) in dofs.iter().zip(es) {
                    let x = &self.spread[d as usize];
                    for j in 0..4 {
                        W[j] = axpy4(x[j], e, W[j]);
                    }
                }
                let columns = problem.cones[h].rows();
                for j in 0..rows {
                    let mut line = [0.0; 4];
                    for k in 0..4 {
                        line = axpy4(W[j][k], &self.H[h][k], line);
                    }
                    let at = (first + j) * n + column;
                    A[at..at + columns].copy_from_slice(&line[..columns]);
                }
                column += columns;
            }
            for j in 0..rows {
                A[(first + j) * (n + 1)] += 1.0;
            }
            for &d in dof {
                self.spread[d as usize] = [0.0; 4];
            }
            first += rows;
        }
        if !solve_lu(A, n, &mut self.side[..n], &mut self.extent) {
            return false;
        }
        for (step, G) in self.step.iter_mut().zip(&self.G) {
            *step = -G;
        }
        let mut first = 0;
        for &g in &self.active {
            let rows = problem.cones[g].rows();
            let mut w = [0.0; 4];
            w[..rows].copy_from_slice(&self.side[first..first + rows]);
            let H = &self.H[g];
            let impulse: [f64; 4] = std::array::from_fn(|i| dot4(&H[i], &w));
            problem.scatter(g, &impulse, &mut self.step);
            first += rows;
        }
        true
    }
}

/// Destination of a residual.
struct Out<'a> {
    lambda: &'a mut [[f64; 4]],
    G: &'a mut [f64],
}

impl<'a> Out<'a> {
    fn new(lambda: &'a mut [[f64; 4]], G: &'a mut [f64]) -> Self {
        Out { lambda, G }
    }
}

/// Squared norms: |G|², Σ w (ρ (λ − λᵏ))² and Σ w λ².
#[derive(Clone, Copy)]
struct Sizes {
    G: f64,
    moved: f64,
    total: f64,
}

/// Computes λ(y), G(y) and their norms.
fn residual(
    problem: &Problem,
    scales: &[f64],
    rho: f64,
    center: &[[f64; 4]],
    y: &[f64],
    out: Out,
) -> Sizes {
    out.G.copy_from_slice(y);
    let (mut moved, mut total) = (0.0, 0.0);
    for (g, cone) in problem.cones.iter().enumerate() {
        let (z, _) = pulled(problem, scales, rho, center, g, y);
        out.lambda[g] = super::gauss_seidel::projected(cone, z);
        problem.scatter(g, &out.lambda[g].map(|x| -x), out.G);
        let step: [f64; 4] = std::array::from_fn(|k| out.lambda[g][k] - center[g][k]);
        moved += scales[g] * dot4(&step, &step);
        total += scales[g] * dot4(&out.lambda[g], &out.lambda[g]);
    }
    Sizes { G: squared(out.G), moved: rho * rho * moved, total }
}

fn squared(x: &[f64]) -> f64 {
    x.iter().map(|x| x * x).sum()
}

#[cfg(test)]
mod tests {
    use super::super::problem::Factor;
    use super::super::samples::{CONES, number};
    use super::*;

    /// (1 + Eᵀ H E) δ = −G, computed from each side.
    #[test]
    fn the_direction_solves_its_equation_on_every_side() {
        let mut seed = 8;
        let (dofs, groups) = (11, CONES.len());
        let (mut start, mut dof, mut e) = (vec![0], Vec::new(), Vec::new());
        for g in 0..groups {
            for d in (0..dofs).filter(|d| (d + g) % 3 != 0) {
                dof.push(d as u32);
                let mut row = [0.0; 4];
                row[..CONES[g].rows()].fill_with(|| number(&mut seed));
                e.push(row);
            }
            start.push(dof.len() as u32);
        }
        let factor = Factor { start: &start, dof: &dof, e: &e, dofs };
        let b = vec![[0.0; 4]; groups];
        let problem = Problem::new(factor, &CONES, &b, &[]).expect("a good problem");
        let mut newton = Newton::default();
        newton.reserve(&problem);
        newton.A.resize(400, 0.0);
        newton.side.resize(20, 0.0);
        newton.extent.resize(20, [0; 2]);
        newton.G.fill_with(|| number(&mut seed));
        for g in 0..groups {
            let z = [0.4, number(&mut seed), 0.3, number(&mut seed)];
            newton.H[g] = slope(&CONES[g], &z, &[0.3, 0.7, 0.7, 0.2]);
            newton.active.push(g);
        }
        let rows = problem.rows();
        for side in 0..3 {
            assert!(match side {
                0 => newton.dof_side(&problem),
                1 => newton.row_side(&problem, rows),
                _ => newton.sparse_side(&problem),
            });
            let step = newton.step.clone();
            let mut left = step.clone();
            for g in 0..groups {
                let v = problem.gathered(g, &step);
                let pull: [f64; 4] = std::array::from_fn(|i| dot4(&newton.H[g][i], &v));
                problem.scatter(g, &pull, &mut left);
            }
            for (x, G) in left.iter().zip(&newton.G) {
                // Measured: 2.4e-15.
                assert!((x + G).abs() < 1e-12, "side {side}: {x} {G}");
            }
        }
    }
}
