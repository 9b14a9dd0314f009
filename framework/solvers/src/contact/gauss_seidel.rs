//! Projected Gauss–Seidel with conjugate directions: groups one after the other, each solved exactly
//! with the others held. W is never formed: a group costs its own entries.
//!
//! ```text
//! y = Eᵀ λ
//! sweep      for each group:  v  = E_g y + b_g + R_g λ_g
//!                             λ' = local solution (local.rs);  onto the cone of λ + ω (λ' − λ) when ω ≠ 1
//!                             y += E_gᵀ (λ' − λ),   λ ← λ'
//! r = change of λ in the sweep,   |r|² = Σ w_g |r_g|²
//! β = |r|² / |r before|²;   β ≤ 1:  λ ← λ + β p,  p ← r + β p;   else p ← 0      (ω = 1)
//! ```
//! The directions p are those of nonlinear conjugate gradients whose gradient is −r: where contacts
//! neither open nor begin to slide they take a third of the sweeps (M. Silcowitz-Hansen, S. Niebe,
//! K. Erleben, "A nonsmooth nonlinear conjugate gradient method for interactive contact force
//! problems", The Visual Computer 26, 2010). An answer is always what a sweep left, never a
//! direction's end. Converges for W from E Eᵀ without friction; with friction in practice, and is
//! stopped by its limit where it does not.

use super::lanes::Change;
use super::layout::Layout;
use super::problem::{Cone, Problem};
use super::residual::{Measure, measure};
use wide::f64x4;

/// Storage, made once.
#[derive(Clone, Debug, Default)]
pub(crate) struct GaussSeidel {
    /// Change of a sweep, and the direction; then both as Eᵀ of them.
    r: Vec<[f64; 4]>,
    p: Vec<[f64; 4]>,
    before: Vec<f64x4>,
    q: Vec<f64x4>,
}

/// When to stop.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Stop {
    /// Residual to reach.
    pub tolerance: f64,
    /// Sweeps, or steps of Newton, at most.
    pub iterations: u32,
    /// Sweeps at least.
    pub least: u32,
    /// Whether to end when `CHECK` sweeps have not made changes `GAIN` times smaller. Problems with batches do not end so: a
    /// sweep costs a thirtieth of one of Newton's steps there.
    pub quit: bool,
}

/// One sweep in so many looks at every group; the others pass over those that took no impulse when they
/// were last seen. The measure looks at all.
const ALL: u32 = 2;
/// Part of the change at which a sweep is worth measuring, up to which batches are passed over for a while.
const QUIET: f64 = 0.1;
/// Sweeps after which progress is looked at, and how much there must be.
const CHECK: u32 = 48;
const GAIN: f64 = 2.0;

impl GaussSeidel {
    /// Improves `lambda`; the sweeps used, and the measure of what came out.
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
        // Change of a sweep (m/s) below which it is worth measuring.
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

    /// Goes on along the direction, and turns it by what the sweep found.
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

/// How a sweep is made.
struct Pass {
    relaxation: f64,
    /// Whether single groups that rested at 0 are looked at too.
    all: bool,
    /// Change of an impulse times its compliance (m/s) up to which a batch counts as quiet.
    quiet: f64,
}

/// One sweep; `r` is what it changed. Returns also whether every batch was looked at.
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

/// The impulse with its normal part made positive and the rest brought within its bound.
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
