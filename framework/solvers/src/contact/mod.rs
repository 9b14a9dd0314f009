//! Contact and friction as complementarity: impulses of rows, given their compliance and their free
//! velocities. No bodies, no geometry, no time.
//!
//! ```text
//! v = W λ + R λ + b,   W = E Eᵀ       velocity after; target and restitution are in b
//! λ_g and v_g as their cone says      problem.rs: equality, unilateral, dry, Coulomb, with spin
//! ```
//! W is usually singular (a box on four points): λ is then one of many, and v is what counts. One
//! measure of what is left open serves all methods (residual.rs).
//!
//! | method | for |
//! |---|---|
//! | projected Gauss–Seidel, local solutions exact (gauss_seidel.rs, local.rs; lanes/mod.rs for many free bodies) | warm starts, small systems, moderate accuracy |
//! | semismooth Newton with proximal steps (newton.rs) | large or ill-conditioned systems, 1e-10 |
//! | Lemke with polyhedral friction (lemke.rs) | small systems, and where the others find nothing |
#![allow(non_snake_case)]

mod dense;
mod error;
mod gauss_seidel;
mod lanes;
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

/// How to solve.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub enum Method {
    /// Gauss–Seidel while it gets on, then Newton, then Lemke on small problems: each starts from
    /// the best so far, and the best is returned.
    #[default]
    Auto,
    /// Projected Gauss–Seidel alone.
    GaussSeidel,
    /// Semismooth Newton alone.
    Newton,
    /// Lemke alone. Does not use the impulses given. Friction is polyhedral.
    Lemke,
}

/// When to stop, and how.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Settings {
    /// The method.
    pub method: Method,
    /// Residual to reach, relative to the largest |b| (see `Measure::residual`).
    pub tolerance: f64,
    /// Sweeps of Gauss–Seidel at most.
    pub sweeps: u32,
    /// Sweeps at least, by which a start within the tolerance comes nearer too: what rests then comes
    /// to rest, step after step.
    pub least: u32,
    /// Linear systems of Newton at most.
    pub steps: u32,
    /// Over-relaxation of Gauss–Seidel, between 0 and 2, exclusive.
    pub relaxation: f64,
    /// Friction directions of Lemke, at least 3.
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

/// What came out.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Report {
    /// The method whose answer was taken; never `Auto`.
    pub method: Method,
    /// Sweeps, linear systems or pivots of that method.
    pub iterations: u32,
    /// How far the answer is from a solution.
    pub measure: Measure,
    /// The residual is within the tolerance. False for inconsistent equalities, for which the answer
    /// is near least squares, and where a method has come to its limit.
    pub converged: bool,
    /// Why Lemke's method, when it was tried last, gave nothing; the impulses are then those before.
    pub failure: Option<Failure>,
}

/// The solver, with its storage. Storage grows to the largest problem seen and is kept.
#[derive(Clone, Debug, Default)]
pub struct Contact {
    /// May be changed between problems.
    pub settings: Settings,
    sweeps: GaussSeidel,
    newton: Newton,
    lemke: Lemke,
    trial: Vec<[f64; 4]>,
    kept: Vec<[f64; 4]>,
    layout: Layout,
}

impl Contact {
    /// With settings.
    pub fn new(settings: Settings) -> Self {
        Contact { settings, ..Contact::default() }
    }

    /// Impulses of the groups of `problem`, one quadruple for each; lanes that a group lacks come
    /// back 0. What `lambda` holds is where the search begins; what is not finite or outside its
    /// cone is brought into it first. The same input gives the same bits.
    ///
    /// # Errors
    /// `lambda` of the wrong length, settings that make no sense, numbers that overflow.
    /// Impulses are then as they were given.
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

    /// Eᵀ λ of the last answer, by degrees of freedom.
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

    /// With `quit`, ends when sweeps get nowhere.
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

    /// A ray leaves the impulses as they are.
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

/// Capacity for `n` in all.
pub(crate) fn room<T>(vec: &mut Vec<T>, n: usize) {
    vec.reserve(n.saturating_sub(vec.len()));
}

/// Sweeps of Gauss–Seidel before Newton: cheap, and they find most of what touches and slides.
const LEAD: u32 = 8;
/// Rows of a linear complementarity problem up to which `Auto` tries Lemke.
const AUTO_ROWS: usize = 60;

/// The impulse brought into its cone; 0 when it is not finite.
fn admitted(cone: &Cone, l: [f64; 4]) -> [f64; 4] {
    let l = problem::masked(l, cone.rows());
    if l.iter().all(|x| x.is_finite()) { gauss_seidel::projected(cone, l) } else { [0.0; 4] }
}
