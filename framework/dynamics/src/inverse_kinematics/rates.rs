//! Rates that move nodes with the required velocities in the least-squares sense.
//!
//! On the coordinates that are not at a limit, from zero, with δ a small fraction of the largest |J_i|²:
//! ```text
//! v ← v + (JᵀJ + δ 1)⁻¹ Jᵀ (b − J v)            iterated Tikhonov: converges to the minimizer of smallest norm
//! ```
//! The mechanism's own loops and couplings have priority: their rows are shifted by multipliers until their residual vanishes.
//!
//! The first coordinate that reaches a limit on the path to the solution is fixed, and so on. Then the fixed coordinate that pulls inward most is
//! released (active set, from one feasible point to a better one).

use super::closure::WEIGHT;
use super::{
    InverseKinematics, InverseKinematicsError, RateTarget, Residual, check_nodes, check_state,
};
use crate::kinematics::{check, poses};
use crate::tree::Tree;
use linkwork_spatial::Vec3;

/// After k rounds a direction of relative gain s² lacks the fraction (δ / (δ + s²))ᵏ.
const ROUNDS: usize = 6;
/// Maximum number of rounds of multipliers for closures; and the rate of a closure that counts as zero, relative to the largest required rate.
const CLOSING_ROUNDS: usize = 20;
const CLOSED: f64 = 1e-14;
/// Rate at which a closure counts as opening, relative to the largest rate.
const OPENS: f64 = 1e-7;
const DAMPING: f64 = 1e-8;

impl InverseKinematics {
    /// Computes rates `v` (nv) at `q` for which the nodes move with the required velocities as closely as possible, and the smallest such rates.
    /// Directions in which the nodes hardly move (singular values below 1e-4 of the largest) remain damped. Kept and prescribed coordinates keep the
    /// rates in `v`; others stay within their rate limits and do not move outward at a position limit. Loops and couplings of the mechanism stay
    /// closed, with prescribed subhinges of loops at rest. Returns the residual of each target (m/s, rad/s). O(nv² (rows + nv)) for each coordinate
    /// that reaches a limit.
    ///
    /// # Errors
    /// [`InverseKinematicsError::BadNumber`]; `v` is then unchanged. [`InverseKinematicsError::Opens`] where a closure of the mechanism cannot stay
    /// closed with the kept and prescribed rates, or within limits; `v` is then the best approximation.
    #[track_caller]
    pub fn rates(
        &mut self,
        tree: &Tree,
        targets: &[RateTarget],
        q: &[f64],
        v: &mut [f64],
    ) -> Result<&[Residual], InverseKinematicsError> {
        check_state(self, tree, q);
        check(v.len(), tree.nv(), "v");
        check_nodes(tree, targets.iter().flat_map(|t| [Some(t.node), t.relative_to]).flatten());
        check_numbers(tree, targets, q, v)?;
        let (nv, asked) = (tree.nv(), 6 * targets.len());
        let rows = asked + self.own.rows;
        self.room(rows, targets.len(), 1, nv);
        self.bent.fill(0.0);
        self.disturbed = true;
        poses(tree, &mut self.ws, q);
        self.rate_rows(tree, targets);
        self.closure_rows(tree, q, targets, asked);
        for i in 0..nv {
            self.held[i] = !self.moves[i];
            if self.moves[i] {
                v[i] = 0.0;
            }
        }
        // Each iteration reduces the residual, so no set of fixed coordinates occurs twice; the bound is a safeguard against round-off.
        for _ in 0..=6 * nv {
            self.before.copy_from_slice(v);
            self.least_squares(targets, rows, v);
            if !self.cut_at_limit(q, v) && !self.release_one(targets, rows, q, v) {
                break;
            }
        }
        self.missing(targets, v);
        self.check_closures(tree, asked, v)?;
        Ok(&self.residuals)
    }

    /// Returns an error for rates that open a closure.
    fn check_closures(
        &self,
        tree: &Tree,
        first: usize,
        v: &[f64],
    ) -> Result<(), InverseKinematicsError> {
        let (nv, mut row, loops) = (v.len(), first, &self.own.loops);
        let size = v.iter().fold(1.0_f64, |m, v| m.max(v.abs()));
        for (k, c) in tree.multibody().constraints().enumerate() {
            let rows = loops.get(k).map_or(1, super::closure::FrameGoal::rows);
            let of = |r: usize| -> f64 {
                self.J[r * nv..(r + 1) * nv].iter().zip(v).map(|(J, v)| J * v).sum()
            };
            let most = (row..row + rows).fold(0.0_f64, |m, r| m.max(of(r).abs()));
            let rate = most / self.rate_weight;
            if !(rate <= OPENS * size) {
                let closure = super::closure::name(tree, c);
                return Err(InverseKinematicsError::Opens { closure, rate });
            }
            row += rows;
        }
        Ok(())
    }

    /// Writes the weighted rows of J: angular, then linear, for each target.
    fn rate_rows(&mut self, tree: &Tree, targets: &[RateTarget]) {
        let nv = tree.nv();
        for (target, t) in targets.iter().enumerate() {
            let (end, from) = (tree.node(t.node), t.relative_to.map(|n| tree.node(n)));
            let (R, p) = self.frame(from);
            let d = self.frame(Some(end)).1 - p;
            self.relative_jacobian(tree, (end, from), &R, &d, 0);
            for k in 0..6 {
                let weight = if k < 3 { t.angular_weight } else { t.linear_weight };
                let row = (6 * target + k) * nv;
                for i in 0..nv {
                    self.J[row + i] = weight * self.J_node[k * nv + i];
                }
            }
        }
    }

    /// Writes the rows of the mechanism's closures from `row` on, with a weight larger than that of any target.
    fn closure_rows(&mut self, tree: &Tree, q: &[f64], targets: &[RateTarget], mut row: usize) {
        let weights = targets.iter().flat_map(|t| [t.linear_weight, t.angular_weight]);
        let most = weights.fold(0.0, f64::max);
        let weight = WEIGHT * if most > 0.0 { most } else { 1.0 };
        self.rate_weight = weight;
        let loops = std::mem::take(&mut self.own.loops);
        let first = row;
        for l in &loops {
            self.rows_of(tree, l, row, 0);
            row += l.rows();
        }
        self.own.loops = loops;
        let nv = tree.nv();
        self.J[first * nv..row * nv].iter_mut().for_each(|x| *x *= weight);
        self.coupling_rows(tree, q, row, weight);
    }

    /// Shifts the closures' rows by their residuals; returns whether any was not zero.
    fn shift_closures(&mut self, first: usize, size: f64) -> bool {
        let left = self.e[first..].iter().zip(&self.bent[first..]);
        let left = left.fold(0.0_f64, |m, (e, shift)| m.max((e - shift).abs()));
        self.bent[first..].copy_from_slice(&self.e[first..]);
        left > CLOSED * size
    }

    /// Computes e = b − J v, weighted; including multipliers for closures.
    fn missing(&mut self, targets: &[RateTarget], v: &[f64]) {
        for row in 6 * targets.len()..self.e.len() {
            let J = &self.J[row * v.len()..(row + 1) * v.len()];
            self.e[row] = self.bent[row] - J.iter().zip(v).map(|(J, v)| J * v).sum::<f64>();
        }
        let nv = v.len();
        for (target, t) in targets.iter().enumerate() {
            let mut parts = [Vec3::zeros(); 2];
            for k in 0..6 {
                let row = (6 * target + k) * nv;
                let got: f64 = self.J[row..row + nv].iter().zip(v).map(|(J, v)| J * v).sum();
                let (weight, want) = if k < 3 {
                    (t.angular_weight, t.velocity.angular[k])
                } else {
                    (t.linear_weight, t.velocity.linear[k - 3])
                };
                let e = weight * want - got;
                self.e[6 * target + k] = e;
                parts[k / 3][k % 3] = if weight > 0.0 { e / weight } else { 0.0 };
            }
            let (orientation, position) = (parts[0].norm(), parts[1].norm());
            self.residuals[target] = Residual { position, orientation };
        }
    }

    /// Computes the smallest rates of coordinates that are not fixed.
    fn least_squares(&mut self, targets: &[RateTarget], rows: usize, v: &mut [f64]) {
        let nv = v.len();
        self.free.clear();
        self.free.extend((0..nv).filter(|i| !self.held[*i]));
        let mut largest = 0.0_f64;
        for i in &self.free {
            v[*i] = 0.0;
            largest = largest.max((0..rows).map(|r| self.J[r * nv + i].powi(2)).sum());
        }
        // No coordinate moves the nodes, so rates stay zero.
        if !(largest > 0.0) {
            return;
        }
        let closures = 6 * targets.len();
        for _ in 0..if rows > closures { CLOSING_ROUNDS } else { 1 } {
            for _ in 0..ROUNDS {
                self.missing(targets, v);
                self.gradient_of(rows, nv);
                self.squares(rows, nv);
                if !self.damped_step(DAMPING * largest) {
                    return;
                }
                v.iter_mut().zip(&self.step).for_each(|(v, h)| *v += h);
            }
            self.missing(targets, v);
            let size = v.iter().fold(0.0_f64, |m, v| m.max(v.abs())) * largest.sqrt();
            if rows > closures && !self.shift_closures(closures, size) {
                break;
            }
        }
    }

    /// Moves from the previous rates towards `v` as far as limits allow, and fixes the coordinate that reaches its limit first; returns false when
    /// none does.
    fn cut_at_limit(&mut self, q: &[f64], v: &mut [f64]) -> bool {
        let mut first = (1.0, None);
        for i in (0..v.len()).filter(|i| !self.held[*i]) {
            let (from, to, (low, high)) = (self.before[i], v[i], self.rate_range(i, q));
            let limit = if to > high { high } else { low };
            if to > high || to < low {
                let part = f64::max((limit - from) / (to - from), 0.0);
                if part <= first.0 {
                    first = (part, Some((i, limit)));
                }
            }
        }
        let (part, Some((held, limit))) = first else { return false };
        for (v, from) in v.iter_mut().zip(&self.before) {
            *v = from + part * (*v - from);
        }
        v[held] = limit;
        self.held[held] = true;
        true
    }

    /// Releases the fixed coordinate that pulls inward most; returns false when none does.
    fn release_one(&mut self, targets: &[RateTarget], rows: usize, q: &[f64], v: &[f64]) -> bool {
        self.missing(targets, v);
        self.gradient_of(rows, v.len());
        let size = self.e.iter().fold(0.0_f64, |m, e| m.max(e.abs()));
        let mut most = (1e-7 * size, None);
        for i in (0..v.len()).filter(|i| self.held[*i] && self.moves[*i]) {
            let ((low, high), g) = (self.rate_range(i, q), self.gradient[i]);
            let inward = (v[i] <= low && g > 0.0) || (v[i] >= high && g < 0.0);
            if low < high && inward && g.abs() > most.0 {
                most = (g.abs(), Some(i));
            }
        }
        if let Some(i) = most.1 {
            self.held[i] = false;
        }
        most.1.is_some()
    }

    /// Returns the permitted range of a rate at q.
    fn rate_range(&self, i: usize, q: &[f64]) -> (f64, f64) {
        let limits = &self.limits[i];
        let (mut low, mut high) = (-limits.rate, limits.rate);
        if let Some(at) = self.place[i] {
            low = if q[at] <= limits.lower { 0.0 } else { low };
            high = if q[at] >= limits.upper { 0.0 } else { high };
        }
        (low, high)
    }
}

fn check_numbers(
    tree: &Tree,
    targets: &[RateTarget],
    q: &[f64],
    v: &[f64],
) -> Result<(), InverseKinematicsError> {
    let bad = |place: String, value: f64, help| {
        Err(InverseKinematicsError::BadNumber { place, value, help })
    };
    for (what, x) in [("q", q), ("v", v)] {
        if let Some(i) = x.iter().position(|x| !x.is_finite()) {
            return bad(format!("{what}[{i}]"), x[i], "give finite numbers");
        }
    }
    for (target, t) in targets.iter().enumerate() {
        let name = tree.multibody().get_node(t.node).name();
        let numbers = t.velocity.angular.iter().chain(t.velocity.linear.iter());
        if let Some(value) = numbers.copied().find(|x| !x.is_finite()) {
            let place = format!("velocity {target} (node `{name}`)");
            return bad(place, value, "give finite numbers");
        }
        for value in [t.linear_weight, t.angular_weight] {
            if !(value >= 0.0 && value.is_finite()) {
                let place = format!("a weight of velocity {target} (node `{name}`)");
                return bad(place, value, "weights must not be negative; use 0 to ignore a part");
            }
        }
    }
    Ok(())
}
