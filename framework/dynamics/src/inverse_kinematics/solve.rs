//! A complete solve; errors, Jacobians and limits at a configuration.

use super::closure::FrameGoal;
use super::{
    Closure, InverseKinematics, InverseKinematicsError, Nearest, Place, Progress, Residual,
    SearchStatistics, Target, Towards, log, of_size,
};
use crate::kinematics::poses;
use crate::tree::Tree;
use linkwork_spatial::{Mat3, Vec3};
use std::f64::consts::TAU;
use std::fmt::Write;

impl InverseKinematics {
    /// Searches for a configuration in which every target is met. `q` (nq) is the start on input and the solution on output. The first solution is
    /// the one to which the start leads. Allocates only for more targets than before, and for errors. A step costs O(nv² (rows + nv)).
    ///
    /// # Errors
    /// [`InverseKinematicsError::Unreachable`] with the nearest configuration, or [`InverseKinematicsError::Open`] with the configuration of smallest
    /// closure error of the mechanism's loops and couplings; `q` is this configuration, too. After [`InverseKinematicsError::BadNumber`] and
    /// [`InverseKinematicsError::Empty`] `q` is unchanged.
    #[track_caller]
    pub fn solve(
        &mut self,
        tree: &Tree,
        targets: &[Target],
        q: &mut [f64],
    ) -> Result<SearchStatistics, InverseKinematicsError> {
        self.begin(tree, targets, q)?;
        match self.advance(tree, usize::MAX, q) {
            Progress::Met(found) => Ok(found),
            Progress::Nearest(found) => Err(self.unreachable(tree, targets, q, found.iterations)),
            Progress::Open(found) => Err(self.unclosed(tree, targets, q, found.iterations)),
            Progress::Unfinished(_) => unreachable!("no end was set"),
        }
    }

    /// Computes errors and residuals at q; returns ½ eᵀe.
    pub(super) fn evaluate(&mut self, tree: &Tree, q: &[f64]) -> f64 {
        poses(tree, &mut self.ws, q);
        let (mut row, targets) = (0, self.targets.len());
        let all = std::mem::take(&mut self.asked);
        for (i, a) in all.iter().enumerate() {
            let (asked, first) = (&a.goal, row);
            let (R, p) = self.frame(a.from.as_ref());
            let (R1, p1) = self.frame(Some(&a.end));
            let mut residual = Residual::default();
            if let Some(goal) = asked.position {
                let d = asked.place.part(goal - R.tr_mul(&(p1 - p)));
                residual.position = d.norm();
                self.e[row..row + 3].copy_from_slice((d * asked.weights[0]).as_slice());
                row += 3;
            }
            if let Some(goal) = asked.orientation {
                let turn = goal.to_rotation_matrix().into_inner() * R1.tr_mul(&R);
                let d = log(&turn);
                residual.orientation = d.norm();
                self.e[row..row + 3].copy_from_slice((d * asked.weights[1]).as_slice());
                row += 3;
            }
            if let Some(pointing) = asked.pointing {
                let (axis, at) = (R.tr_mul(&(R1 * pointing.axis)), R.tr_mul(&(p1 - p)));
                let e = pointing.missing(axis, at).0;
                residual.orientation = e.norm();
                self.e[row..row + 3].copy_from_slice((e * asked.weights[1]).as_slice());
                row += 3;
            }
            if let Some(more) = &a.more {
                let (R, p) = (R.tr_mul(&R1), R.tr_mul(&(p1 - p)));
                self.e[row] = asked.weights[0] * Self::more_error(more, &R, &p, &mut residual);
                row += 1;
            }
            if i < targets {
                self.residuals[i] = residual;
                if self.alone {
                    self.e[first..row].fill(0.0);
                }
            } else {
                self.closed[i - targets] = residual;
            }
        }
        self.asked = all;
        row = self.coupling_errors(tree, q, row);
        if self.multiplied {
            self.e.iter_mut().zip(&self.shift).for_each(|(e, s)| *e += s);
        }
        0.5 * self.e[..row].iter().map(|e| e * e).sum::<f64>()
    }

    /// Computes J at q, the configuration of the last accepted `evaluate`.
    pub(super) fn linearise(&mut self, tree: &Tree, q: &[f64]) {
        let (nv, mut row) = (tree.nv(), 0);
        let all = std::mem::take(&mut self.asked);
        for (i, a) in all.iter().enumerate() {
            if self.alone && i < self.targets.len() {
                self.J[row * nv..(row + a.rows()) * nv].fill(0.0);
            } else {
                self.rows_of(tree, a, row, 6 * nv * i);
            }
            row += a.rows();
        }
        self.asked = all;
        self.coupling_rows(tree, q, row, self.closing);
    }

    /// Computes the rows of J of one frame from `row` on; its Jacobian is written to the memory `J_node` from index `J_node` on.
    pub(super) fn rows_of(&mut self, tree: &Tree, a: &FrameGoal, mut row: usize, J_node: usize) {
        let (nv, asked) = (tree.nv(), &a.goal);
        let (R, p) = self.frame(a.from.as_ref());
        let (R1, p1) = self.frame(Some(&a.end));
        let d = p1 - p;
        self.relative_jacobian(tree, (&a.end, a.from.as_ref()), &R, &d, J_node);
        let parts = [
            (asked.position.is_some(), 3, asked.weights[0]),
            (asked.orientation.is_some(), 0, asked.weights[1]),
        ];
        let whole = asked.place == Place::Point;
        for (_, from, weight) in parts.into_iter().filter(|p| p.0) {
            let read = &self.J_node[J_node + from * nv..J_node + (from + 3) * nv];
            let written = &mut self.J[row * nv..(row + 3) * nv];
            written.iter_mut().zip(read).for_each(|(out, x)| *out = weight * x);
            if from == 3 && !whole {
                self.keep_part(nv, row, |d| asked.place.part(d));
            }
            row += 3;
        }
        let J_node = &self.J_node[J_node..J_node + 6 * nv];
        let part = |from: usize, i: usize| Vec3::from_fn(|k, _| J_node[(from + k) * nv + i]);
        if let Some(pointing) = asked.pointing {
            let axis = R.tr_mul(&(R1 * pointing.axis));
            let (_, turn, shift) = pointing.missing(axis, R.tr_mul(&d));
            for i in 0..nv {
                let moved = (turn * part(0, i) + shift * part(3, i)) * asked.weights[1];
                for k in 0..3 {
                    self.J[(row + k) * nv + i] = moved[k];
                }
            }
            row += 3;
        }
        if let Some(more) = &a.more {
            let (turn, shift) = Self::more_factors(more, &R.tr_mul(&R1));
            for i in 0..nv {
                let moved = turn.dot(&part(0, i)) + shift.dot(&part(3, i));
                self.J[row * nv + i] = asked.weights[0] * moved;
            }
        }
    }

    /// Projects three rows of J onto the controlled part.
    fn keep_part(&mut self, nv: usize, row: usize, part: impl Fn(Vec3) -> Vec3) {
        for i in 0..nv {
            let d = part(Vec3::from_fn(|k, _| self.J[(row + k) * nv + i]));
            for k in 0..3 {
                self.J[(row + k) * nv + i] = d[k];
            }
        }
    }

    pub(super) fn is_met(&self) -> bool {
        self.residuals.iter().all(|r| self.within(r)) && self.is_closed()
    }

    /// Returns true if all closures are closed.
    pub(super) fn is_closed(&self) -> bool {
        self.closed.iter().all(|r| self.within(r))
    }

    fn within(&self, r: &Residual) -> bool {
        let (p, o) = (self.effort.position_tolerance, self.effort.orientation_tolerance);
        r.position <= p && r.orientation <= o
    }

    /// Selects the coordinates that may move and are not pushed against a limit.
    pub(super) fn choose_free(&mut self, q: &[f64]) {
        self.free.clear();
        for i in 0..self.moves.len() {
            let g = self.gradient[i];
            let pushed = self.place[i].is_some_and(|at| {
                !self.turns[i]
                    && ((q[at] <= self.limits[i].lower && g < 0.0)
                        || (q[at] >= self.limits[i].upper && g > 0.0))
            });
            if self.moves[i] && !pushed {
                self.free.push(i);
            }
        }
    }

    /// Cuts the step at limits; returns the decrease of the cost that J predicts for it.
    pub(super) fn cut_step(&mut self, rows: usize, nv: usize, q: &[f64]) -> f64 {
        for i in &self.free {
            if let Some(at) = self.place[*i].filter(|_| !self.turns[*i]) {
                let (low, high) = (self.limits[*i].lower, self.limits[*i].upper);
                if low.is_finite() || high.is_finite() {
                    self.step[*i] = (q[at] + self.step[*i]).clamp(low, high) - q[at];
                }
            }
        }
        let (J, h) = (&self.J[..rows * nv], &self.step[..nv]);
        let along: f64 = h.iter().zip(&self.gradient).map(|(h, g)| h * g).sum();
        let images = of_size(nv, |nv| {
            let h = &h[..nv];
            let image = |J: &[f64]| J.iter().zip(h).map(|(J, h)| J * h).sum::<f64>().powi(2);
            J.chunks_exact(nv.max(1)).map(image).sum::<f64>()
        });
        along - 0.5 * images
    }

    /// Moves coordinates that may move into their limits; those with a full revolution between their limits by full revolutions.
    pub(super) fn clamp(&self, q: &mut [f64]) {
        for (i, at) in self.place.iter().enumerate() {
            if let Some(at) = at.filter(|_| self.moves[i]) {
                let (low, high) = (self.limits[i].lower, self.limits[i].upper);
                if self.turns[i] && q[at] > high {
                    q[at] -= TAU * ((q[at] - high) / TAU).ceil();
                } else if self.turns[i] && q[at] < low {
                    q[at] += TAU * ((low - q[at]) / TAU).ceil();
                }
                q[at] = q[at].clamp(low, high);
            }
        }
    }

    /// Returns the error of [`solve`](Self::solve) when no start led to the targets, after a search that ended with [`Progress::Nearest`] at `q`.
    #[must_use]
    pub fn unreachable(
        &self,
        tree: &Tree,
        targets: &[Target],
        q: &[f64],
        iterations: usize,
    ) -> InverseKinematicsError {
        let nearest = self.nearest(tree, targets, q);
        InverseKinematicsError::Unreachable { iterations, nearest }
    }

    /// Returns the error of [`solve`](Self::solve) when closures stay open, after a search that ended with [`Progress::Open`] at `q`.
    #[must_use]
    pub fn unclosed(
        &self,
        tree: &Tree,
        targets: &[Target],
        q: &[f64],
        iterations: usize,
    ) -> InverseKinematicsError {
        let (closure, residual) = match self.open() {
            Some((Closure::Constraint(c), r)) => (super::closure::name(tree, c), r),
            Some((Closure::Given(i), r)) => (format!("closure {i}"), r),
            None => (String::new(), Residual::default()),
        };
        let nearest = self.nearest(tree, targets, q);
        InverseKinematicsError::Open { iterations, closure, residual, nearest }
    }

    fn nearest(&self, tree: &Tree, targets: &[Target], q: &[f64]) -> Box<Nearest> {
        let mbs = tree.multibody();
        let mut text = String::new();
        for (t, r) in targets.iter().zip(&self.residuals) {
            let _ = write!(text, "\n  node `{}` is", mbs.get_node(t.node).name());
            let and = if t.goal.position.is_some() && t.goal.turns() { " and" } else { "" };
            if t.goal.position.is_some() {
                let _ = write!(text, " {:.3e} m{and}", r.position);
            }
            if t.goal.turns() {
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
        Box::new(Nearest { q, residuals, at_limit, text })
    }
}

pub(super) fn check_start(q: &[f64]) -> Result<(), InverseKinematicsError> {
    match q.iter().position(|x| !x.is_finite()) {
        None => Ok(()),
        Some(i) => Err(InverseKinematicsError::BadNumber {
            place: format!("q[{i}] of the start"),
            value: q[i],
            help: "start at a finite configuration",
        }),
    }
}

pub(super) fn check_targets(
    tree: &Tree,
    targets: &[Target],
    what: &'static str,
) -> Result<(), InverseKinematicsError> {
    for (target, t) in targets.iter().enumerate() {
        let asked = &t.goal;
        if asked.rows() == 0 {
            let fact = "neither position nor orientation nor pointing";
            let help = "give at least one, or remove the target";
            return Err(InverseKinematicsError::Empty { what, target, fact, help });
        }
        if asked.orientation.is_some() && asked.pointing.is_some() {
            let fact = "both an orientation and a pointing axis";
            let help =
                "give only one of them: an orientation already fixes the direction of every axis";
            return Err(InverseKinematicsError::Empty { what, target, fact, help });
        }
        if t.relative_to == Some(t.node) {
            let fact = "a node relative to itself";
            let help = "use another node, or the world";
            return Err(InverseKinematicsError::Empty { what, target, fact, help });
        }
        let name = tree.multibody().get_node(t.node).name();
        let R = asked.orientation.map(|R| R.to_rotation_matrix().into_inner());
        let numbers = asked.position.iter().flat_map(|p| p.iter().copied());
        let turns = R.iter().flat_map(|R: &Mat3| R.iter().copied());
        if let Some(value) = numbers.chain(turns).find(|x| !x.is_finite()) {
            let place = format!("{what} {target} (node `{name}`)");
            let help = "give finite numbers";
            return Err(InverseKinematicsError::BadNumber { place, value, help });
        }
        let unit = |v: Vec3| (v.norm(), (v.norm() - 1.0).abs() < 1e-6);
        let directions = match asked.place {
            Place::Point => None,
            Place::Plane(v) | Place::Line(v) => Some(v),
        };
        let pointing = asked.pointing.iter().flat_map(|p| match p.to {
            Towards::Direction(a) => [Some(p.axis), Some(a)],
            Towards::Point(_) => [Some(p.axis), None],
        });
        let directions = pointing.flatten().chain(directions);
        if let Some((value, _)) = directions.map(unit).find(|u| !u.1) {
            let place = format!("the length of a direction of {what} {target} (node `{name}`)");
            let help = "give directions of length 1";
            return Err(InverseKinematicsError::BadNumber { place, value, help });
        }
        if let Some(p) = asked.pointing {
            let point = match p.to {
                Towards::Point(x) => x,
                Towards::Direction(_) => Vec3::zeros(),
            };
            let bad = point.iter().copied().find(|x| !x.is_finite());
            let angle = !(0.0..=std::f64::consts::PI).contains(&p.within);
            if let Some(value) = bad.or(angle.then_some(p.within)) {
                let place = format!("where {what} {target} (node `{name}`) points");
                let help = "give a finite point, and a cone from 0 to π";
                return Err(InverseKinematicsError::BadNumber { place, value, help });
            }
        }
        for value in asked.weights {
            if !(value > 0.0 && value.is_finite()) {
                let place = format!("a weight of {what} {target} (node `{name}`)");
                let help = "weights must be positive; remove parts that should be ignored";
                return Err(InverseKinematicsError::BadNumber { place, value, help });
            }
        }
    }
    Ok(())
}
