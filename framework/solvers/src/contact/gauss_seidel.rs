//! Projected Gauss–Seidel with conjugate directions: solves one group after the other exactly, with the others fixed. W is never formed: the cost of
//! a group is proportional to its own entries.
//!
//! ```text
//! y = Eᵀ λ
//! sweep      for each group:  v  = E_g y + b_g + R_g λ_g
//!                             λ' = local solution (local.rs);  onto the cone of λ + ω (λ' − λ) when ω ≠ 1
//!                             y += E_gᵀ (λ' − λ),   λ ← λ'
//! r = change of λ in the sweep,   |r|² = Σ w_g |r_g|²
//! β = |r|² / |r before|²;   β ≤ 1:  λ ← λ + β p,  p ← r + β p;   else p ← 0      (ω = 1)
//! ```
//! The directions p are nonlinear conjugate gradients with the gradient −r. Where contacts neither open nor begin to slide, they need a third of the
//! sweeps (M. Silcowitz-Hansen, S. Niebe, K. Erleben, "A nonsmooth nonlinear conjugate gradient method for interactive contact force problems", The
//! Visual Computer 26, 2010). The solution is always the result of a sweep, never the end of a direction. It converges for W from E Eᵀ without
//! friction, and in practice with friction; otherwise the iteration limit stops it.

use super::lanes::Change;
use super::layout::Layout;
use super::problem::{Cone, Problem};
use super::residual::{Measure, measure};
use wide::f64x4;

/// Workspace, allocated once.
#[derive(Clone, Debug, Default)]
pub(crate) struct GaussSeidel {
    /// Change of a sweep, and the direction; then Eᵀ times both.
    r: Vec<[f64; 4]>,
    p: Vec<[f64; 4]>,
    before: Vec<f64x4>,
    q: Vec<f64x4>,
}

/// Stopping criteria.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Stop {
    /// Target residual.
    pub tolerance: f64,
    /// Maximum number of sweeps, or of Newton steps.
    pub iterations: u32,
    /// Minimum number of sweeps.
    pub least: u32,
    /// Whether to stop if `CHECK` sweeps have not reduced the changes by a factor of `GAIN`. Problems with batches do not stop this way, because a
    /// sweep costs only a thirtieth of a Newton step there.
    pub quit: bool,
}

/// One in this many sweeps visits every group. The others skip groups that had zero impulse at their last visit. The residual covers all groups.
const ALL: u32 = 2;
/// Fraction of the change at which a sweep is worth measuring, and up to which quiet batches are skipped for a while.
const QUIET: f64 = 0.1;
/// Number of sweeps between checks of progress, and the required progress.
const CHECK: u32 = 48;
const GAIN: f64 = 2.0;

impl GaussSeidel {
    /// Improves `lambda`. Returns the number of sweeps and the residual of the result.
    pub fn solve(
        &mut self,
        problem: &Problem,
        layout: &mut Layout,
        stop: Stop,
        relaxation: f64,
        lambda: &mut [[f64; 4]],
    ) -> (u32, Measure) {
        self.r.clear();
        self.r.resize(lambda.len(), [0.0; 4]);
        layout.pull(lambda);
        self.restart(lambda.len(), layout);
        let mut last = Measure::default();
        if stop.least.min(stop.iterations) == 0 {
            last = measure(problem, layout, lambda);
            if last.residual <= stop.tolerance {
                return (0, last);
            }
        }
        // Change of a sweep (m/s) below which measuring the residual is worthwhile.
        let mut small = stop.tolerance * problem.scale;
        let quit = stop.quit && layout.lanes.is_empty();
        let (mut sweeps, mut square, mut checked) = (0, f64::INFINITY, f64::INFINITY);
        while sweeps < stop.iterations {
            self.before.copy_from_slice(&layout.y);
            let all = sweeps.is_multiple_of(ALL);
            let pass = Pass { relaxation, all, quiet: QUIET * small };
            let (change, every) = sweep(problem, layout, &pass, lambda, &mut self.r);
            let most = change.most.to_array().into_iter().fold(0.0, f64::max);
            let moved = change.square.reduce_add();
            sweeps += 1;
            let mut end = sweeps == stop.iterations || moved.is_nan();
            if quit && sweeps % CHECK == 0 {
                end |= moved * GAIN * GAIN > checked;
                checked = moved;
            }
            if end || !(most > small) {
                last = measure(problem, layout, lambda);
                if most > 0.0 {
                    small = 0.5 * small.min(most);
                }
                let still = all && every && most == 0.0;
                if end || still || (last.residual <= stop.tolerance && sweeps >= stop.least) {
                    break;
                }
                layout.lanes.wake();
            }
            if relaxation == 1.0 {
                self.conjugate(layout, lambda, moved / square);
                square = moved;
            }
        }
        layout.lanes.store(lambda);
        (sweeps, last)
    }

    /// Allocates for the given numbers of groups and degrees of freedom.
    pub fn reserve(&mut self, groups: usize, dofs: usize) {
        super::room(&mut self.r, groups);
        super::room(&mut self.p, groups);
        super::room(&mut self.before, dofs + 2);
        super::room(&mut self.q, dofs + 2);
    }

    fn restart(&mut self, groups: usize, layout: &mut Layout) {
        let vectors = layout.y.len();
        layout.lanes.restart();
        self.p.clear();
        self.p.resize(groups, [0.0; 4]);
        self.q.clear();
        self.q.resize(vectors, f64x4::splat(0.0));
        self.before.resize(vectors, f64x4::splat(0.0));
    }

    /// Moves along the direction, and updates the direction with the change of the sweep.
    fn conjugate(&mut self, layout: &mut Layout, lambda: &mut [[f64; 4]], beta: f64) {
        if !(beta <= 1.0) {
            self.restart(lambda.len(), layout);
            return;
        }
        layout.lanes.conjugate(beta);
        for g in layout.singles() {
            let (l, p, r) = (&mut lambda[g], &mut self.p[g], &self.r[g]);
            for k in 0..4 {
                let along = beta * p[k];
                l[k] += along;
                p[k] = along + r[k];
            }
        }
        for ((y, q), before) in layout.y.iter_mut().zip(&mut self.q).zip(&self.before) {
            let along = f64x4::splat(beta) * *q;
            *q = along + (*y - *before);
            *y += along;
        }
    }
}

/// Options of a sweep.
struct Pass {
    relaxation: f64,
    /// Whether to visit single groups whose impulse was 0, too.
    all: bool,
    /// A batch counts as quiet up to this change of an impulse times its compliance (m/s).
    quiet: f64,
}

/// Makes one sweep; `r` is the change. Also returns whether every batch was visited.
fn sweep(
    problem: &Problem,
    layout: &mut Layout,
    pass: &Pass,
    lambda: &mut [[f64; 4]],
    r: &mut [[f64; 4]],
) -> (Change, bool) {
    let Pass { relaxation, all, quiet } = *pass;
    let mut change = Change::default();
    let every = layout.sweep_lanes(relaxation, quiet, &mut change);
    layout.each(|g, block, rows, y| {
        let (lambda, r) = (&mut lambda[g], &mut r[g]);
        if block.rests && !all && *lambda == [0.0; 4] {
            return;
        }
        let l = f64x4::new(*lambda);
        let mut new = block.solve(l, block.velocity(rows.gathered(y), l));
        if relaxation != 1.0 {
            let relaxed = (new - l).mul_add(f64x4::splat(relaxation), l);
            new = f64x4::new(projected(&problem.cones[g], relaxed.to_array()));
        }
        let (step, scale) = (new - l, f64x4::splat(block.scale));
        *r = step.to_array();
        block.rests = *r == [0.0; 4];
        if block.rests {
            return;
        }
        rows.spread(step, y);
        let moved = scale * step;
        change.most = change.most.fast_max(moved.abs());
        change.square = moved.mul_add(step, change.square);
        *lambda = new.to_array();
    });
    (change, every)
}

/// Returns the impulse with a non-negative normal part and the rest within its bound.
pub(crate) fn projected(cone: &Cone, mut l: [f64; 4]) -> [f64; 4] {
    match *cone {
        Cone::Equality { .. } => return l,
        Cone::Dry { bound } => {
            l[0] = l[0].clamp(-bound, bound);
            return l;
        }
        Cone::Unilateral => l[0] = l[0].max(0.0),
        Cone::Coulomb { friction } | Cone::Spinning { friction, .. } => {
            l[0] = l[0].max(0.0);
            let (size, radius) = ((l[1] * l[1] + l[2] * l[2]).sqrt(), friction * l[0]);
            if size > radius {
                (l[1], l[2]) = (l[1] * radius / size, l[2] * radius / size);
            }
        }
    }
    if let Cone::Spinning { spin, .. } = *cone {
        let most = spin * l[0];
        l[3] = l[3].clamp(-most, most);
    }
    l
}
