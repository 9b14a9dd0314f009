//! Projected Gauss–Seidel: groups one after the other, each solved exactly with the others held.
//! W is never formed: a group costs its own entries.
//!
//! ```text
//! y = Eᵀ λ
//! for each group, forwards, then backwards, and so on:
//!   v  = E_g y + b_g + R_g λ_g
//!   λ' = local solution (local.rs);  λ' ← onto the cone of λ + ω (λ' − λ) when ω ≠ 1
//!   y += E_gᵀ (λ' − λ),   λ ← λ'
//! ```
//! Converges for W from E Eᵀ without friction; linearly, and slowly where many bodies rest on each other.
//! With friction it converges in practice, and is stopped by its limit where it does not.

use super::local::Block;
use super::problem::{Cone, Problem};
use super::residual::{Measure, larger, measure};

/// Storage, made once.
#[derive(Clone, Debug, Default)]
pub(crate) struct GaussSeidel {
    y: Vec<f64>,
}

/// When to stop.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Stop {
    /// Residual to reach.
    pub tolerance: f64,
    /// Sweeps, or steps of Newton, at most.
    pub iterations: u32,
}

impl GaussSeidel {
    /// Room for `dofs` degrees of freedom.
    pub fn reserve(&mut self, dofs: usize) {
        if self.y.len() < dofs {
            self.y.resize(dofs, 0.0);
        }
    }

    /// Improves `lambda`; the sweeps used, and the measure of what came out.
    pub fn solve(
        &mut self,
        problem: &Problem,
        blocks: &mut [Block],
        stop: Stop,
        relaxation: f64,
        lambda: &mut [[f64; 4]],
    ) -> (u32, Measure) {
        let y = &mut self.y[..problem.factor.dofs];
        let mut last = measure(problem, |g| blocks[g].scale, lambda, y);
        // Change of a sweep (m/s) below which it is worth measuring.
        let mut small = stop.tolerance * last.velocity;
        let mut sweeps = 0;
        while sweeps < stop.iterations && !(last.residual <= stop.tolerance) {
            let change = sweep(problem, blocks, sweeps % 2 == 0, relaxation, lambda, y);
            sweeps += 1;
            if !(change > small) {
                last = measure(problem, |g| blocks[g].scale, lambda, y);
                small = 0.5 * small.min(change);
                if change == 0.0 || change.is_nan() {
                    break;
                }
            }
        }
        if !(last.residual <= stop.tolerance) {
            last = measure(problem, |g| blocks[g].scale, lambda, y);
        }
        (sweeps, last)
    }
}

/// One sweep; the largest change of an impulse times its group's compliance (m/s).
fn sweep(
    problem: &Problem,
    blocks: &mut [Block],
    forwards: bool,
    relaxation: f64,
    lambda: &mut [[f64; 4]],
    y: &mut [f64],
) -> f64 {
    let (groups, mut change) = (problem.groups(), 0.0);
    for k in 0..groups {
        let g = if forwards { k } else { groups - 1 - k };
        let (cone, l, soft) = (&problem.cones[g], lambda[g], problem.soft(g));
        let mut v = problem.velocity(g, y);
        for k in 0..4 {
            v[k] += soft[k] * l[k];
        }
        let mut new = blocks[g].solve(cone, &l, &v);
        if relaxation != 1.0 {
            new = projected(cone, std::array::from_fn(|k| l[k] + relaxation * (new[k] - l[k])));
        }
        let step: [f64; 4] = std::array::from_fn(|k| new[k] - l[k]);
        for x in step {
            larger(&mut change, x * blocks[g].scale);
        }
        if step != [0.0; 4] {
            problem.scatter(g, &step, y);
            lambda[g] = new;
        }
    }
    change
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
