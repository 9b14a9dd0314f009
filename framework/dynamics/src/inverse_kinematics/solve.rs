//! Configurations: Levenberg–Marquardt with limits, from one start after another.

use super::{
    Found, InverseKinematics, InverseKinematicsError, Nearest, Residual, Target, check_nodes,
    check_state, log,
};
use crate::kinematics::poses;
use crate::tree::Tree;
use linkwork_multibody::Limits;
use linkwork_spatial::Mat3;
use std::f64::consts::PI;
use std::fmt::Write;

impl InverseKinematics {
    /// Moves `q` (nq; in: where to start, out: the solution) until every target is met. The solution
    /// found first is the one that the start leads to. Allocates only for more targets than ever before,
    /// and for errors. Cost of a step: O(nv² (rows + nv)).
    ///
    /// # Errors
    /// [`InverseKinematicsError::Unreachable`] with the nearest configuration; `q` is it, too.
    /// [`InverseKinematicsError::BadNumber`] and [`InverseKinematicsError::Empty`] leave `q` alone.
    #[track_caller]
    pub fn solve(
        &mut self,
        tree: &Tree,
        targets: &[Target],
        q: &mut [f64],
    ) -> Result<Found, InverseKinematicsError> {
        check_state(self, tree, q);
        check_nodes(tree, targets.iter().flat_map(|t| [Some(t.node), t.relative_to]).flatten());
        check_targets(tree, targets)?;
        check_start(q)?;
        let rows = targets.iter().map(Target::rows).sum();
        self.reserve(rows, targets.len(), tree.nv());
        self.start.copy_from_slice(q);
        let (mut total, mut least) = (0, f64::INFINITY);
        for restart in 0..=self.effort.restarts {
            q.copy_from_slice(&self.start);
            if restart > 0 {
                self.elsewhere(tree, restart, q);
            }
            self.clamp(q);
            let (cost, iterations, met) = self.descend(tree, targets, rows, q);
            total += iterations;
            if met {
                return Ok(Found { iterations: total, restarts: restart });
            }
            if cost < least || restart == 0 {
                least = cost;
                self.best.copy_from_slice(q);
            }
        }
        q.copy_from_slice(&self.best);
        self.evaluate(tree, targets, q);
        Err(self.unreachable(tree, targets, q, total))
    }

    /// Steps from q; the cost at the end, the steps, and whether all targets are met.
    fn descend(
        &mut self,
        tree: &Tree,
        targets: &[Target],
        rows: usize,
        q: &mut [f64],
    ) -> (f64, usize, bool) {
        let (nv, mbs) = (tree.nv(), tree.multibody());
        let (mut factor, mut growth) = (1.0, 2.0);
        let mut cost = self.evaluate(tree, targets, q);
        for iteration in 0..self.effort.iterations {
            if self.is_met() {
                return (cost, iteration, true);
            }
            self.linearise(tree, targets);
            self.gradient_of(rows, nv);
            self.choose_free(q);
            let steep = self.free.iter().fold(0.0_f64, |m, i| m.max(self.gradient[*i].abs()));
            if !(steep > 1e-16 * cost.sqrt()) || !cost.is_finite() {
                return (cost, iteration, false);
            }
            loop {
                let solved = self.damped_step(rows, nv, factor * 2.0 * cost);
                let promised = if solved { self.cut_step(rows, nv, q) } else { 0.0 };
                let mut gain = -1.0;
                if promised > 0.0 {
                    let mut tried = std::mem::take(&mut self.tried);
                    mbs.integrate(q, &self.step, &mut tried);
                    self.clamp(&mut tried);
                    let next = self.evaluate(tree, targets, &tried);
                    if next < cost {
                        gain = (cost - next) / promised;
                        q.copy_from_slice(&tried);
                        cost = next;
                    }
                    self.tried = tried;
                }
                if gain > 0.0 {
                    factor *= f64::max(0.1, 1.0 - (2.0 * gain - 1.0).powi(3));
                    factor = f64::max(factor, 1e-12);
                    growth = 2.0;
                    break;
                }
                factor *= growth;
                growth *= 2.0;
                if !(factor * cost < 1e18 * (1.0 + cost)) {
                    // No step, however short, gains anything: the end of the way.
                    self.evaluate(tree, targets, q);
                    return (cost, iteration + 1, self.is_met());
                }
            }
        }
        (cost, self.effort.iterations, self.is_met())
    }

    /// Errors and residuals at q; returns ½ eᵀe.
    fn evaluate(&mut self, tree: &Tree, targets: &[Target], q: &[f64]) -> f64 {
        poses(tree, &mut self.ws, q);
        let mut row = 0;
        for (i, t) in targets.iter().enumerate() {
            let (R, p) = self.frame(tree, t.relative_to);
            let (R1, p1) = self.frame(tree, Some(t.node));
            let mut residual = Residual::default();
            if let Some(goal) = t.position {
                let d = goal - R.tr_mul(&(p1 - p));
                residual.position = d.norm();
                self.e[row..row + 3].copy_from_slice((d * t.position_weight).as_slice());
                row += 3;
            }
            if let Some(goal) = t.orientation {
                let turn = goal.to_rotation_matrix().into_inner() * R1.tr_mul(&R);
                let d = log(&turn);
                residual.orientation = d.norm();
                self.e[row..row + 3].copy_from_slice((d * t.orientation_weight).as_slice());
                row += 3;
            }
            self.residuals[i] = residual;
        }
        0.5 * self.e[..row].iter().map(|e| e * e).sum::<f64>()
    }

    /// J at the configuration of the last `evaluate` that was accepted.
    fn linearise(&mut self, tree: &Tree, targets: &[Target]) {
        let (nv, mut row) = (tree.nv(), 0);
        for t in targets {
            let (R, p) = self.frame(tree, t.relative_to);
            let d = self.frame(tree, Some(t.node)).1 - p;
            self.relative_jacobian(tree, t.node, t.relative_to, &R, &d);
            let parts = [
                (t.position.is_some(), 3, t.position_weight),
                (t.orientation.is_some(), 0, t.orientation_weight),
            ];
            for (_, from, weight) in parts.into_iter().filter(|p| p.0) {
                for k in 0..3 {
                    for i in 0..nv {
                        self.J[(row + k) * nv + i] = weight * self.J_node[(from + k) * nv + i];
                    }
                }
                row += 3;
            }
        }
    }

    fn is_met(&self) -> bool {
        let (p, o) = (self.effort.position_tolerance, self.effort.orientation_tolerance);
        self.residuals.iter().all(|r| r.position <= p && r.orientation <= o)
    }

    /// Coordinates that may move and are not pushed against a limit.
    fn choose_free(&mut self, q: &[f64]) {
        self.free.clear();
        for i in 0..self.moves.len() {
            let g = self.gradient[i];
            let pushed = self.place[i].is_some_and(|at| {
                (q[at] <= self.limits[i].lower && g < 0.0)
                    || (q[at] >= self.limits[i].upper && g > 0.0)
            });
            if self.moves[i] && !pushed {
                self.free.push(i);
            }
        }
    }

    /// Cuts the step at limits; returns the gain that J promises for it.
    fn cut_step(&mut self, rows: usize, nv: usize, q: &[f64]) -> f64 {
        for i in &self.free {
            if let Some(at) = self.place[*i] {
                let (low, high) = (self.limits[*i].lower, self.limits[*i].upper);
                if low.is_finite() || high.is_finite() {
                    self.step[*i] = (q[at] + self.step[*i]).clamp(low, high) - q[at];
                }
            }
        }
        let along: f64 = self.step.iter().zip(&self.gradient).map(|(h, g)| h * g).sum();
        let image = |r: usize| -> f64 {
            self.J[r * nv..(r + 1) * nv].iter().zip(&self.step).map(|(J, h)| J * h).sum()
        };
        along - 0.5 * (0..rows).map(|r| image(r).powi(2)).sum::<f64>()
    }

    /// Within limits, for coordinates that may move.
    fn clamp(&self, q: &mut [f64]) {
        for (i, at) in self.place.iter().enumerate() {
            if let Some(at) = at.filter(|_| self.moves[i]) {
                q[at] = q[at].clamp(self.limits[i].lower, self.limits[i].upper);
            }
        }
    }

    /// Another start: anywhere within limits, or a turn or 1 m from the given one.
    fn elsewhere(&mut self, tree: &Tree, restart: usize, q: &mut [f64]) {
        let mut state = restart as u64;
        for i in 0..self.moves.len() {
            state = state.wrapping_add(0x9e37_79b9_7f4a_7c15);
            let mut z = (state ^ (state >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
            z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
            let u = ((z ^ (z >> 31)) >> 11) as f64 / (1u64 << 53) as f64;
            let Limits { lower, upper, .. } = self.limits[i];
            self.step[i] = match self.place[i] {
                _ if !self.moves[i] => 0.0,
                Some(at) if lower.is_finite() && upper.is_finite() => {
                    lower + (upper - lower) * u - self.start[at]
                }
                _ => PI * (2.0 * u - 1.0),
            };
        }
        tree.multibody().integrate(&self.start, &self.step, q);
    }

    fn unreachable(
        &self,
        tree: &Tree,
        targets: &[Target],
        q: &[f64],
        iterations: usize,
    ) -> InverseKinematicsError {
        let mbs = tree.multibody();
        let mut text = String::new();
        for (t, r) in targets.iter().zip(&self.residuals) {
            let _ = write!(text, "\n  node `{}` is", mbs.get_node(t.node).name());
            let and = if t.position.is_some() && t.orientation.is_some() { " and" } else { "" };
            if t.position.is_some() {
                let _ = write!(text, " {:.3e} m{and}", r.position);
            }
            if t.orientation.is_some() {
                let _ = write!(text, " {:.3e} rad", r.orientation);
            }
            let _ = write!(text, " from its target");
        }
        let at_limit: Vec<usize> = self.at_limit(q).collect();
        for i in &at_limit {
            let body = mbs.bodies().iter().find(|b| b.v().contains(i)).map_or("", |b| b.name());
            let _ = write!(text, "\n  body `{body}`, coordinate {i}, is at its limit");
        }
        let (q, residuals) = (q.to_vec(), self.residuals.clone());
        let nearest = Box::new(Nearest { q, residuals, at_limit, text });
        InverseKinematicsError::Unreachable { iterations, nearest }
    }
}

fn check_start(q: &[f64]) -> Result<(), InverseKinematicsError> {
    match q.iter().position(|x| !x.is_finite()) {
        None => Ok(()),
        Some(i) => Err(InverseKinematicsError::BadNumber {
            place: format!("q[{i}] of the start"),
            value: q[i],
            help: "start at a finite configuration",
        }),
    }
}

fn check_targets(tree: &Tree, targets: &[Target]) -> Result<(), InverseKinematicsError> {
    for (target, t) in targets.iter().enumerate() {
        if t.rows() == 0 {
            let fact = "neither position nor orientation";
            let help = "give at least one, or leave the target out";
            return Err(InverseKinematicsError::Empty { target, fact, help });
        }
        if t.relative_to == Some(t.node) {
            let fact = "a node relative to itself";
            let help = "name another node, or the world";
            return Err(InverseKinematicsError::Empty { target, fact, help });
        }
        let name = tree.multibody().get_node(t.node).name();
        let R = t.orientation.map(|R| R.to_rotation_matrix().into_inner());
        let numbers = t.position.iter().flat_map(|p| p.iter().copied());
        let turns = R.iter().flat_map(|R: &Mat3| R.iter().copied());
        if let Some(value) = numbers.chain(turns).find(|x| !x.is_finite()) {
            let place = format!("target {target} (node `{name}`)");
            let help = "give finite numbers";
            return Err(InverseKinematicsError::BadNumber { place, value, help });
        }
        for value in [t.position_weight, t.orientation_weight] {
            if !(value > 0.0 && value.is_finite()) {
                let place = format!("a weight of target {target} (node `{name}`)");
                let help = "weights are positive; leave out what does not count";
                return Err(InverseKinematicsError::BadNumber { place, value, help });
            }
        }
    }
    Ok(())
}
