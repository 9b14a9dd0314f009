//! Contact and friction as a complementarity problem: computes impulses of rows from their compliance and free velocities. Bodies, geometry and time
//! are outside this module.
//!
//! ```text
//! v = W λ + R λ + b,   W = E Eᵀ       velocity after; target and restitution are in b
//! λ_g and v_g as their cone says      problem.rs: equality, unilateral, dry, Coulomb, with spin
//! ```
//! W is usually singular (a box on four points): then λ is one of many solutions, and v is the unique result. All methods share one residual measure
//! (residual.rs).
//!
//! | method | for |
//! |---|---|
//! | projected Gauss–Seidel, local solutions exact (gauss_seidel.rs, local.rs; lanes/mod.rs for many free bodies) | warm starts, small systems, moderate accuracy |
//! | semismooth Newton with proximal steps (newton.rs) | large or ill-conditioned systems, 1e-10 |
//! | Lemke with polyhedral friction (lemke.rs) | small systems, and if the others fail |
#![allow(non_snake_case)]

mod dense;
mod error;
mod gauss_seidel;
mod lanes;
mod largest;
mod law;
mod layout;
mod lemke;
mod local;
mod newton;
mod problem;
mod residual;
#[cfg(test)]
mod samples;
mod sparse;

pub use error::ContactError;
pub use lemke::Failure;
pub use problem::{Cone, Factor, Problem};
pub use residual::Measure;

use gauss_seidel::{GaussSeidel, Stop};
use layout::Layout;
use lemke::Lemke;
use newton::Newton;

/// Solution method.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub enum Method {
    /// Gauss–Seidel while it makes progress, then Newton, then Lemke for small problems. Each starts from the best result yet, and the best is
    /// returned.
    #[default]
    Auto,
    /// Only projected Gauss–Seidel.
    GaussSeidel,
    /// Only semismooth Newton.
    Newton,
    /// Only Lemke. Ignores the initial impulses. Friction is polyhedral.
    Lemke,
}

/// Method and stopping criteria.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Settings {
    /// The method.
    pub method: Method,
    /// Target residual, relative to the largest |b| (see `Measure::residual`).
    pub tolerance: f64,
    /// Maximum number of Gauss–Seidel sweeps.
    pub sweeps: u32,
    /// Minimum number of sweeps. They improve a start that is already within the tolerance, so that a resting body comes fully to rest over several
    /// steps.
    pub least: u32,
    /// Maximum number of linear systems of Newton.
    pub steps: u32,
    /// Over-relaxation factor of Gauss–Seidel, between 0 and 2, exclusive.
    pub relaxation: f64,
    /// Number of friction directions of Lemke, at least 3.
    pub directions: usize,
}

impl Default for Settings {
    fn default() -> Self {
        Settings {
            method: Method::Auto,
            tolerance: 1e-6,
            sweeps: 200,
            least: 0,
            steps: 100,
            relaxation: 1.0,
            directions: 8,
        }
    }
}

/// Result of a solution.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Report {
    /// The method whose result was returned; never `Auto`.
    pub method: Method,
    /// Number of sweeps, linear systems or pivots of that method.
    pub iterations: u32,
    /// Distance of the result from a solution.
    pub measure: Measure,
    /// Whether the residual is within the tolerance. False for inconsistent equalities, for which the result is near least squares, and if a method
    /// reached its limit.
    pub converged: bool,
    /// Reason why Lemke's method failed, if it was tried last; the impulses are then the previous ones.
    pub failure: Option<Failure>,
}

/// The solver with its workspace, which grows to the largest problem and is reused.
#[derive(Clone, Debug, Default)]
pub struct Contact {
    /// Settings. You may change them between problems.
    pub settings: Settings,
    sweeps: GaussSeidel,
    newton: Newton,
    lemke: Lemke,
    trial: Vec<[f64; 4]>,
    kept: Vec<[f64; 4]>,
    layout: Layout,
}

impl Contact {
    /// Creates a solver with these settings.
    pub fn new(settings: Settings) -> Self {
        Contact { settings, ..Contact::default() }
    }

    /// Computes the impulses of the groups of `problem`, four numbers each; unused lanes are returned as 0. The search starts from `lambda`, after
    /// replacing or projecting impulses that are not finite or outside their cone. The same input gives bit-identical results.
    ///
    /// # Errors
    /// `lambda` has the wrong length, a setting is invalid, or numbers overflow. Impulses then keep their initial values.
    pub fn solve(
        &mut self,
        problem: &Problem,
        lambda: &mut [[f64; 4]],
    ) -> Result<Report, ContactError> {
        self.check(problem, lambda)?;
        self.layout.set(problem);
        if !self.layout.is_finite() {
            return Err(ContactError::Overflow);
        }
        self.trial.clear();
        self.trial.extend(lambda.iter().zip(problem.cones).map(|(l, cone)| admitted(cone, *l)));
        let report = match self.settings.method {
            Method::Auto => self.automatic(problem),
            Method::GaussSeidel => self.gauss_seidel(problem, false),
            Method::Newton => self.semismooth(problem, LEAD),
            Method::Lemke => self.polyhedral(problem),
        };
        if !self.trial.iter().flatten().all(|x| x.is_finite())
            || !report.measure.residual.is_finite()
        {
            return Err(ContactError::Overflow);
        }
        lambda.copy_from_slice(&self.trial);
        if report.method != Method::GaussSeidel {
            self.layout.pull(&self.trial);
        }
        Ok(report)
    }

    /// Allocates for problems up to the given numbers of groups, entries and degrees of freedom.
    pub(crate) fn reserve(&mut self, groups: usize, entries: usize, dofs: usize) {
        room(&mut self.trial, groups);
        room(&mut self.kept, groups);
        self.layout.reserve(groups, entries, dofs);
        self.sweeps.reserve(groups, dofs);
        self.newton.make_room(groups, dofs);
    }

    /// Returns Eᵀ λ of the last result, by degrees of freedom.
    pub(crate) fn pulled(&self) -> impl Iterator<Item = f64> {
        self.layout.pulled()
    }

    fn check(&self, problem: &Problem, lambda: &[[f64; 4]]) -> Result<(), ContactError> {
        if lambda.len() != problem.groups() {
            let (expected, found) = (problem.groups(), lambda.len());
            return Err(ContactError::Length { what: "lambda", expected, found });
        }
        let Settings { tolerance, relaxation, directions, .. } = self.settings;
        if !(tolerance >= 0.0) {
            let help = "give 0 or more; 1e-6 is a millionth of the largest free velocity";
            return Err(ContactError::Setting { what: "tolerance", value: tolerance, help });
        }
        if !(relaxation > 0.0 && relaxation < 2.0) {
            let help = "give a number between 0 and 2, exclusive; 1 is plain Gauss–Seidel";
            return Err(ContactError::Setting { what: "relaxation", value: relaxation, help });
        }
        if directions < 3 {
            let (value, help) = (directions as f64, "give 3 directions or more; 8 is usual");
            return Err(ContactError::Setting { what: "directions", value, help });
        }
        Ok(())
    }

    fn automatic(&mut self, problem: &Problem) -> Report {
        let first = self.gauss_seidel(problem, true);
        if first.converged {
            return first;
        }
        let second = self.semismooth(problem, 0);
        if second.converged || Lemke::size(problem, self.settings.directions) > AUTO_ROWS {
            return second;
        }
        self.kept.clone_from(&self.trial);
        let third = self.polyhedral(problem);
        let polished = if third.converged { third } else { self.semismooth(problem, LEAD) };
        if polished.measure.residual < second.measure.residual {
            return polished;
        }
        self.trial.clone_from(&self.kept);
        second
    }

    /// Solves with Gauss–Seidel. With `quit`, stops if sweeps do not make progress.
    fn gauss_seidel(&mut self, problem: &Problem, quit: bool) -> Report {
        let Settings { tolerance, sweeps, least, relaxation, .. } = self.settings;
        let stop = Stop { tolerance, iterations: sweeps, least, quit };
        let (iterations, measure) =
            self.sweeps.solve(problem, &mut self.layout, stop, relaxation, &mut self.trial);
        self.report(Method::GaussSeidel, iterations, measure)
    }

    fn semismooth(&mut self, problem: &Problem, lead: u32) -> Report {
        let Settings { tolerance, steps, .. } = self.settings;
        let stop = Stop { tolerance, iterations: steps, least: 0, quit: false };
        let (iterations, measure) = self.newton.solve(
            problem,
            &mut self.layout,
            &mut self.sweeps,
            stop,
            lead,
            &mut self.trial,
        );
        self.report(Method::Newton, iterations, measure)
    }

    /// Solves with Lemke's method. A ray leaves the impulses unchanged.
    fn polyhedral(&mut self, problem: &Problem) -> Report {
        let pivots = self.lemke.solve(problem, self.settings.directions, &mut self.trial);
        self.layout.pull(&self.trial);
        let measure = residual::measure(problem, &mut self.layout, &self.trial);
        let report = self.report(Method::Lemke, pivots.unwrap_or(0), measure);
        Report { failure: pivots.err(), ..report }
    }

    fn report(&self, method: Method, iterations: u32, measure: Measure) -> Report {
        let converged = measure.residual <= self.settings.tolerance;
        Report { method, iterations, measure, converged, failure: None }
    }
}

/// Reserves capacity for `n` elements in total.
pub(crate) fn room<T>(vec: &mut Vec<T>, n: usize) {
    vec.reserve(n.saturating_sub(vec.len()));
}

/// Number of Gauss–Seidel sweeps before Newton: they are cheap and find most of the touching and sliding contacts.
const LEAD: u32 = 8;
/// Maximum number of rows of a linear complementarity problem for which `Auto` tries Lemke.
const AUTO_ROWS: usize = 60;

/// Projects the impulse onto its cone; returns 0 if it is not finite.
fn admitted(cone: &Cone, l: [f64; 4]) -> [f64; 4] {
    let l = problem::masked(l, cone.rows());
    if l.iter().all(|x| x.is_finite()) { gauss_seidel::projected(cone, l) } else { [0.0; 4] }
}
