//! Solves the problems of a step, island by island: impulses, then displacements out of penetration.

use super::islands::{Islands, first_lanes};
use super::{ContactStepper, Kind, StepError};
use crate::contact::{Cone, Contact, Factor, Method, Problem, Report};
use linkwork_dynamics::Tree;
use linkwork_dynamics::units::{RowSet, WIDTH};
use wide::f64x4;

impl ContactStepper {
    /// Solves the problem of each island, and writes Eᵀ λ to `y`. Reports the worst island.
    pub(super) fn solve(&mut self) -> Result<Report, StepError> {
        self.y.fill(0.0);
        if !self.islands.several() || self.islands.len() == 0 {
            let speed = self.speeds.first().map_or(0.0, fastest);
            let problem = Problem::trusted(factor(&self.rows), &self.cones, &self.b).scaled(speed);
            let report = answer(&mut self.contact, &problem, &mut self.lambda)?;
            self.y.iter_mut().zip(self.contact.pulled()).for_each(|(to, y)| *to = y);
            return Ok(report);
        }
        let (groups, entries) = (self.rows.groups().len(), self.rows.e().len());
        self.contact.reserve(groups, entries, self.rows.independent());
        let mut islands = std::mem::take(&mut self.islands);
        let mut worst = self.solve_island(&mut islands, 0);
        for k in 1..islands.len() {
            let report = self.solve_island(&mut islands, k);
            worst = worst.and_then(|before| Ok(merged(&before, &report?)));
        }
        self.islands = islands;
        worst
    }

    fn solve_island(&mut self, islands: &mut Islands, k: usize) -> Result<Report, StepError> {
        islands.copy(&self.rows, k, |_| WIDTH);
        for i in 0..islands.groups(k).len() {
            let g = islands.groups(k)[i] as usize;
            islands.cones.push(self.cones[g]);
            islands.b.push(self.b[g]);
            islands.lambda.push(self.lambda[g]);
        }
        let mut lambda = std::mem::take(&mut islands.lambda);
        let problem = Problem::trusted(islands.factor(k), &islands.cones, &islands.b);
        let report =
            answer(&mut self.contact, &problem.scaled(fastest(&self.speeds[k])), &mut lambda);
        for (g, l) in islands.groups(k).iter().zip(&lambda) {
            self.lambda[*g as usize] = *l;
        }
        islands.lambda = lambda;
        for (d, y) in islands.rates(k).iter().zip(self.contact.pulled()) {
            self.y[*d as usize] = y;
        }
        report
    }

    /// Writes displacements in addition to the velocities into `dq`: the part missing because of late impacts, and displacements out of penetration,
    /// with the same rows as motions, without friction. `y` are impulses of the step over its length.
    pub(super) fn push_out(&mut self, tree: &Tree, h: f64, impacts: bool) -> Result<(), StepError> {
        self.dq.fill(0.0);
        let (slop, part) = (self.settings.slop, self.settings.correction);
        let most = self.settings.push_max * h;
        let mut any = false;
        self.b.clear();
        for (g, row) in self.rows.groups().iter().enumerate() {
            let gap = match self.kinds[g] {
                Kind::Contact(i) => self.points[i as usize].gap,
                Kind::Limit(_) => row.error[0],
                _ => 0.0,
            };
            let mut depth = part * (-gap - slop);
            if depth > 0.0 {
                // Subtract the part of the depth that the step itself removes.
                let (mut v, mut pulled) = (self.free_velocity(g, h, false), [0.0; WIDTH]);
                self.rows.push(g, &self.y, &mut pulled);
                v[0] += h * pulled[0];
                let late = if impacts { self.impacts.shift[g] } else { 0.0 };
                depth = (depth - (h * v[0] + late).max(0.0)).clamp(0.0, most);
            }
            any |= depth > 0.0;
            self.b.push([gap.max(0.0) - depth.max(0.0), 0.0, 0.0, 0.0]);
        }
        if impacts {
            self.y.copy_from_slice(&self.impacts.lag);
        } else if any {
            self.y.fill(0.0);
        } else {
            return Ok(());
        }
        if any {
            self.find_push()?;
        }
        self.units.impulse(tree, &mut self.uw, &self.y, &mut self.dq);
        Ok(())
    }

    /// Adds displacements out of penetration to `y`, for the islands that have any.
    fn find_push(&mut self) -> Result<(), StepError> {
        self.some.clear();
        for (kind, row) in self.kinds.iter().zip(self.rows.groups()) {
            self.some.push(match kind {
                Kind::Constraint => Cone::Equality { rows: row.n },
                // Other contacts that touch must not be pushed into each other.
                Kind::Contact(_) | Kind::Limit(_) => Cone::Unilateral,
                Kind::Dry | Kind::Rolling => Cone::Dry { bound: 0.0 },
            });
        }
        self.lambda.clear();
        self.lambda.resize(self.kinds.len(), [0.0; WIDTH]);
        let kinds = &self.kinds;
        let lanes = |g: usize| match kinds[g] {
            Kind::Constraint => WIDTH,
            Kind::Contact(_) | Kind::Limit(_) => 1,
            Kind::Dry | Kind::Rolling => 0,
        };
        if !self.islands.several() {
            mask(&self.rows, &mut self.some_e, lanes);
            let factor = Factor { e: &self.some_e, ..factor(&self.rows) };
            let problem = Problem::new(factor, &self.some, &self.b, &[])?;
            self.push.solve(&problem, &mut self.lambda)?;
            self.y.iter_mut().zip(self.push.pulled()).for_each(|(to, y)| *to += y);
            return Ok(());
        }
        let (groups, entries) = (self.rows.groups().len(), self.rows.e().len());
        self.push.reserve(groups, entries, self.rows.independent());
        let islands = &mut self.islands;
        for k in 0..islands.len() {
            if !islands.groups(k).iter().any(|g| self.b[*g as usize][0] < 0.0) {
                continue;
            }
            islands.copy(&self.rows, k, lanes);
            for i in 0..islands.groups(k).len() {
                let g = islands.groups(k)[i] as usize;
                islands.cones.push(self.some[g]);
                islands.b.push(self.b[g]);
                islands.lambda.push([0.0; WIDTH]);
            }
            let mut lambda = std::mem::take(&mut islands.lambda);
            let problem = Problem::new(islands.factor(k), &islands.cones, &islands.b, &[])?;
            self.push.solve(&problem, &mut lambda)?;
            islands.lambda = lambda;
            for (d, y) in islands.rates(k).iter().zip(self.push.pulled()) {
                self.y[*d as usize] += y;
            }
        }
        Ok(())
    }
}

/// Solves a problem. If the user chose Lemke's method and it fails, the other methods are used, because the impulses would otherwise be those of the
/// last step.
fn answer(
    contact: &mut Contact,
    problem: &Problem,
    lambda: &mut [[f64; WIDTH]],
) -> Result<Report, StepError> {
    let report = contact.solve(problem, lambda)?;
    if report.failure.is_none() || contact.settings.method != Method::Lemke {
        return Ok(report);
    }
    contact.settings.method = Method::Auto;
    let second = contact.solve(problem, lambda);
    contact.settings.method = Method::Lemke;
    Ok(second?)
}

/// Returns the largest of four numbers.
fn fastest(speeds: &f64x4) -> f64 {
    speeds.to_array().into_iter().fold(0.0, f64::max)
}

/// Combines two islands: the worse residual, with the method of the one that took more iterations.
fn merged(a: &Report, b: &Report) -> Report {
    let most = if b.iterations > a.iterations { b } else { a };
    // A NaN residual counts as the worse one.
    let a_is_worse = !(b.measure.residual > a.measure.residual) && !b.measure.residual.is_nan();
    let measure = if a_is_worse { a.measure } else { b.measure };
    Report { measure, converged: a.converged && b.converged, ..*most }
}

fn factor(rows: &RowSet) -> Factor<'_> {
    Factor { start: rows.start(), dof: rows.dof(), e: rows.e(), dofs: rows.independent() }
}

/// Copies E with only the first lanes of each group's entries.
fn mask(rows: &RowSet, out: &mut Vec<[f64; WIDTH]>, lanes: impl Fn(usize) -> usize) {
    out.clear();
    for g in 0..rows.groups().len() {
        let (from, to) = (rows.start()[g] as usize, rows.start()[g + 1] as usize);
        let n = lanes(g);
        out.extend(rows.e()[from..to].iter().map(|e| first_lanes(e, n)));
    }
}
