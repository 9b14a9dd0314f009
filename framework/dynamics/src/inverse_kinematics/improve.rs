//! Secondary objectives: a better one among the configurations that meet the targets.
//!
//! c is the cost to be minimized; D scales the coordinates that are not at a limit:
//! ```text
//! minimise ∇c · h + ½ s hᵀ D h   with   J h = e
//! h = −D⁻¹ (∇c + Jᵀ λ) / s,      (J D⁻¹ Jᵀ) λ = −(s e + J D⁻¹ ∇c)
//! ```
//! Then q ⊕ h is moved back onto the targets by steps of smallest |h|_D, and accepted if c has decreased there; otherwise s is multiplied by four.
//! With c = ½ (q − m)ᵀ D (q − m) and s = 1 this is a Newton step without the curvature of the targets. A coordinate at a limit stays there while its
//! gradient, projected onto the targets' null space, points outward. The minimum is a local one.

use super::{InverseKinematics, Target};
use crate::tree::Tree;

/// Maximum number of steps back onto the targets.
const BACK: usize = 6;

/// Distance from a limit at which a coordinate counts as being at it, rad or m.
const AT: f64 = 1e-12;

/// Result of an improvement.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Improved {
    /// c at the end.
    pub cost: f64,
    /// The length |h|_D of the last step, accepted or not: small at a minimum.
    pub step: f64,
    /// Evaluations of the kinematics.
    pub kinematics: usize,
}

impl InverseKinematics {
    /// Minimizes c over the configurations that meet the targets of the last search, from `q` (nq), which must meet them. The result, too, meets the
    /// goals within the tolerances of [`Effort`](super::Effort) and is within limits. `objective` returns c and its gradient (nv) at a configuration;
    /// `scale` (nv, positive) is D. Ends after the given number of kinematics evaluations, or when a step is shorter than 1e-10. Limits are not
    /// enforced for coordinates with several numbers of q. Does not allocate.
    #[track_caller]
    pub fn improve(
        &mut self,
        tree: &Tree,
        objective: &mut dyn FnMut(&[f64], &mut [f64]) -> f64,
        scale: &[f64],
        kinematics: usize,
        q: &mut [f64],
    ) -> Improved {
        super::check_state(self, tree, q);
        crate::kinematics::check(scale.len(), tree.nv(), "scale");
        self.room_again();
        self.disturbed = true;
        let mut slope = std::mem::take(&mut self.slope);
        let mut cost = objective(q, &mut slope);
        let (mut used, mut s, mut size) = (1, 1.0, f64::INFINITY);
        self.evaluate(tree, q);
        while used < kinematics && self.toward(tree, &slope, scale, s, q) {
            size = self.size(scale);
            if size < 1e-10 {
                break;
            }
            let mut tried = std::mem::take(&mut self.tried);
            tree.multibody().integrate(q, &self.step, &mut tried);
            self.clamp(&mut tried);
            self.evaluate(tree, &tried);
            used += 1;
            for _ in 0..BACK {
                if self.is_met() || used >= kinematics || !self.back(tree, scale, &tried) {
                    break;
                }
                self.before_q.copy_from_slice(&tried);
                let from = std::mem::take(&mut self.before_q);
                tree.multibody().integrate(&from, &self.step, &mut tried);
                self.before_q = from;
                self.clamp(&mut tried);
                self.evaluate(tree, &tried);
                used += 1;
            }
            let next =
                if self.is_met() { objective(&tried, &mut self.slope_tried) } else { f64::NAN };
            if next < cost {
                q.copy_from_slice(&tried);
                std::mem::swap(&mut slope, &mut self.slope_tried);
                (cost, s) = (next, f64::max(0.5 * s, 1.0));
            } else {
                self.evaluate(tree, q);
                used += 1;
                s *= 4.0;
            }
            self.tried = tried;
        }
        self.evaluate(tree, q);
        self.slope = slope;
        Improved { cost, step: size, kinematics: used }
    }

    /// Computes the step h into `step`, cut at limits; returns false when there is none.
    fn toward(&mut self, tree: &Tree, slope: &[f64], scale: &[f64], s: f64, q: &[f64]) -> bool {
        let (rows, nv) = (self.rows, tree.nv());
        self.linearise(tree, q);
        self.free.clear();
        self.free.extend((0..nv).filter(|i| self.moves[*i]));
        // Each coordinate is fixed at most once.
        for _ in 0..=nv {
            if !self.multipliers(rows, nv, scale, slope, s) {
                return false;
            }
            self.step.fill(0.0);
            let mut held = false;
            for a in (0..self.free.len()).rev() {
                let i = self.free[a];
                let pull: f64 = (0..rows).map(|r| self.J[r * nv + i] * self.x[r]).sum();
                let h = -(slope[i] + pull) / (s * scale[i]);
                self.step[i] = h;
                let at = self.place[i].filter(|_| !self.turns[i]);
                if at.is_some_and(|at| {
                    (q[at] <= self.limits[i].lower + AT && h < 0.0)
                        || (q[at] >= self.limits[i].upper - AT && h > 0.0)
                }) {
                    self.free.remove(a);
                    held = true;
                }
            }
            if !held {
                self.shorten(q);
                return true;
            }
        }
        false
    }

    /// Computes λ into `x`; the documentation of this file has the equations. Returns false when the rows cannot be solved.
    fn multipliers(
        &mut self,
        rows: usize,
        nv: usize,
        scale: &[f64],
        slope: &[f64],
        s: f64,
    ) -> bool {
        for a in 0..rows {
            for b in 0..=a {
                let of = |i: &usize| self.J[a * nv + i] * self.J[b * nv + i] / scale[*i];
                self.small[a * rows + b] = self.free.iter().map(of).sum();
            }
            let of = |i: &usize| self.J[a * nv + i] * slope[*i] / scale[*i];
            self.x[a] = -(s * self.e[a] + self.free.iter().map(of).sum::<f64>());
        }
        // Rows that repeat others, or depend only on fixed coordinates, are regularized by an addition to the diagonal.
        let most = (0..rows).map(|a| self.small[a * rows + a]).fold(0.0, f64::max);
        for a in 0..rows {
            self.small[a * rows + a] += 1e-12 * most;
        }
        most > 0.0 && super::solve_spd(&mut self.small[..rows * rows], &mut self.x[..rows])
    }

    /// Performs a step of smallest |h|_D onto the targets from `q`, where they were evaluated; limits are enforced.
    fn back(&mut self, tree: &Tree, scale: &[f64], q: &[f64]) -> bool {
        let nv = tree.nv();
        let mut none = std::mem::take(&mut self.before);
        none.fill(0.0);
        let found = self.toward(tree, &none[..nv], scale, 1.0, q);
        self.before = none;
        found
    }

    /// Scales the whole step so that no coordinate leaves its limits.
    fn shorten(&mut self, q: &[f64]) {
        let mut part = 1.0_f64;
        for i in &self.free {
            let Some(at) = self.place[*i].filter(|_| !self.turns[*i]) else { continue };
            let (to, low, high) =
                (q[at] + self.step[*i], self.limits[*i].lower, self.limits[*i].upper);
            if to > high && to > q[at] {
                part = part.min((high - q[at]) / (to - q[at]));
            } else if to < low && to < q[at] {
                part = part.min((low - q[at]) / (to - q[at]));
            }
        }
        self.step.iter_mut().for_each(|h| *h *= part.max(0.0));
    }

    fn size(&self, scale: &[f64]) -> f64 {
        self.step.iter().zip(scale).map(|(h, d)| d * h * h).sum::<f64>().sqrt()
    }

    /// Returns the targets of the last search.
    #[must_use]
    pub fn targets(&self) -> &[Target] {
        &self.targets
    }
}
