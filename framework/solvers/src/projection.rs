//! Projection of positions and velocities onto the constraints.
//!
//! Embedded loops are closed aggregate by aggregate, with only their dependent coordinates. Rows are closed with the smallest motion in the metric of
//! the mass matrix:
//! ```text
//! Γ_d Δθ_d = −d                             aggregates
//! W λ = −d,   Δ = M⁻¹ J* λ                   rows;   q ← q ⊕ Δ until |d| is small (Newton)
//! W λ = −ḋ,   β ← β + M⁻¹ J* λ               once: rates are linear
//! ```
//! A step that increases the error is halved. If no step reduces the error, the loops cannot be closed from here, and the error message states the
//! residual.
//!
//! Where the rank of the rows drops, as in a parallelogram whose links are in line, two branches of motion cross: d = θ₁ θ₂ + …, with the distances
//! θ₁, θ₂ from both. The curve d = ε ≠ 0 does not cross: it bends from one branch to the other where θ ≈ √ε. A residual error would therefore lead an
//! accurate integrator to the other branch, with much smaller steps before that. So loops are closed to tolerance · i² there, where i is the
//! independence of the rows (about θ), and finally to round-off. There, all constraints are treated as rows, because closing embedded loops by their
//! dependent coordinates alone would turn the large errors across a branch into errors along it.

use crate::constrained::{ConstrainedSolver, NEAR, SolverError, named};
use linkwork_dynamics::units::Level;
use linkwork_dynamics::{Tree, Workspace, kinematics};
use linkwork_multibody::{ConstraintId, LoopMotion};
use thiserror::Error;

/// If no step reduces the error of a loop, it counts as closed below this multiple of the tolerance.
const STUCK: f64 = 100.0;

/// Result of closing.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Closing {
    /// Number of Newton steps.
    pub steps: usize,
    /// Largest error before, rad or m.
    pub before: f64,
    /// Largest error after, rad or m.
    pub error: f64,
}

/// Reason why no configuration was found.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum ProjectionError {
    /// Newton's method did not converge.
    #[error(
        "{constraint} does not close: an error of {:.3e} (rad or m) remains after {} steps\n  help: \
         start nearer to a closed configuration, or check lengths, frames and prescribed hinges",
        closing.error, closing.steps
    )]
    Open {
        /// The constraint with the largest error, as ``loop `NAME` ``.
        constraint: String,
        /// The last result.
        closing: Closing,
    },
    /// The constraints could not be evaluated.
    #[error(transparent)]
    Solver(#[from] SolverError),
}

/// Workspace of projections for one mechanism.
#[derive(Clone, Debug)]
pub struct Projector {
    /// Tolerance of the error, rad or m.
    pub tolerance: f64,
    /// Maximum number of Newton steps.
    pub steps_max: usize,
    step: Vec<f64>,
    next: Vec<f64>,
    scaled: Vec<f64>,
    trial: Vec<f64>,
    quiet: Vec<LoopMotion>,
}

impl Projector {
    /// Creates a projector for a tree, with a tolerance of 1e-12 and at most 50 steps.
    #[must_use]
    pub fn new(tree: &Tree) -> Self {
        let (nq, nv) = (tree.nq(), tree.nv());
        Self {
            tolerance: 1e-12,
            steps_max: 50,
            step: vec![0.0; nv],
            next: vec![0.0; nv],
            scaled: vec![0.0; nv],
            trial: vec![0.0; nq],
            quiet: Vec::with_capacity(tree.multibody().motions()),
        }
    }

    /// Moves q until every loop closes. Prescribed coordinates stay unchanged.
    ///
    /// # Errors
    /// [`ProjectionError`]; q is then the best configuration that was found.
    pub fn positions(
        &mut self,
        tree: &Tree,
        ws: &mut Workspace,
        solver: &mut ConstrainedSolver,
        motions: &[LoopMotion],
        q: &mut [f64],
    ) -> Result<Closing, ProjectionError> {
        let error = solver.newton(tree, ws, q, motions, &mut self.step)?;
        if let Some(mut near) = solver.take_near() {
            let closed = self.positions(tree, ws, &mut near, motions, q);
            solver.put_near(near);
            return closed;
        }
        let mut closing = Closing { steps: 0, before: error, error };
        let mut scale = 1.0;
        while !(closing.error <= self.target(solver)) {
            // Only round-off is left: no step reduces an error that the tolerance permits.
            if scale < 1.0 && closing.error <= self.tolerance {
                break;
            }
            // If links are nearly in line, a row is left out, and the error of this row is of
            // second order.
            let stuck = closing.steps == self.steps_max || scale < 1e-3;
            if stuck && closing.error <= STUCK * self.tolerance {
                break;
            }
            if stuck || !closing.error.is_finite() {
                if !closing.error.is_finite() {
                    return Err(SolverError::NotFinite.into());
                }
                let constraint = solver.worst(tree, ws, motions, q);
                return Err(ProjectionError::Open { constraint, closing });
            }
            closing.steps += 1;
            self.scaled.iter_mut().zip(&self.step).for_each(|(s, d)| *s = scale * d);
            tree.multibody().integrate(q, &self.scaled, &mut self.trial);
            let error = solver.newton(tree, ws, &self.trial, motions, &mut self.next)?;
            if error < closing.error {
                q.copy_from_slice(&self.trial);
                std::mem::swap(&mut self.step, &mut self.next);
                (closing.error, scale) = (error, 1.0);
            } else {
                scale *= 0.5;
            }
        }
        Ok(closing)
    }

    /// Returns the target error (rad or m) with the rows of the last Newton step.
    fn target(&self, solver: &ConstrainedSolver) -> f64 {
        let i = solver.independence();
        self.tolerance * if i < NEAR { i * i } else { 1.0 }
    }

    /// Moves β onto the constraints at q. Prescribed rates stay unchanged. Returns the largest |ḋ| before, per second.
    ///
    /// # Errors
    /// [`ProjectionError::Solver`].
    pub fn rates(
        &mut self,
        tree: &Tree,
        ws: &mut Workspace,
        solver: &mut ConstrainedSolver,
        motions: &[LoopMotion],
        q: &[f64],
        v: &mut [f64],
    ) -> Result<f64, ProjectionError> {
        let mut before: f64 = 0.0;
        for pass in 0..solver.passes() {
            kinematics(tree, ws, q, v);
            let error = solver.rate_step(tree, ws, (q, v), motions, &mut self.step)?;
            if pass == 0
                && let Some(mut near) = solver.take_near()
            {
                let moved = self.rates(tree, ws, &mut near, motions, q, v);
                solver.put_near(near);
                return moved;
            }
            v.iter_mut().zip(&self.step).for_each(|(v, d)| *v += d);
            if pass == 0 {
                before = error;
            }
        }
        Ok(before)
    }
}

impl Projector {
    /// Removes from a small change `dv` of the coordinates at q, or of β, the part that a projection would remove.
    ///
    /// # Errors
    /// [`ProjectionError::Solver`].
    pub fn change(
        &mut self,
        tree: &Tree,
        ws: &mut Workspace,
        solver: &mut ConstrainedSolver,
        motions: &[LoopMotion],
        q: &[f64],
        dv: &mut [f64],
    ) -> Result<(), ProjectionError> {
        let mut quiet = std::mem::take(&mut self.quiet);
        quiet.clear();
        quiet.extend(motions.iter().map(|m| LoopMotion { rate: 0.0, ..*m }));
        let done = self.rates(tree, ws, solver, &quiet, q, dv);
        self.quiet = quiet;
        done.map(|_| ())
    }
}

impl ConstrainedSolver {
    /// One pass makes rates exact, unless rows act on coordinates that an embedded loop has moved.
    fn passes(&self) -> usize {
        match (self.units().embedded().is_empty(), self.units().augmented().is_empty()) {
            (false, false) => 2,
            (true, true) => 0,
            _ => 1,
        }
    }

    /// Returns the constraint with the largest error at q.
    fn worst(&self, tree: &Tree, ws: &mut Workspace, motions: &[LoopMotion], q: &[f64]) -> String {
        kinematics(tree, ws, q, &vec![0.0; tree.nv()]);
        let error = |c: &ConstraintId| self.error(tree, ws, *c, motions, q);
        let worst = tree.multibody().constraints().max_by(|a, b| error(a).total_cmp(&error(b)));
        worst.map_or_else(String::new, |c| named(tree, c))
    }

    /// Computes the Newton step of the positions, and the largest error before it.
    fn newton(
        &mut self,
        tree: &Tree,
        ws: &mut Workspace,
        q: &[f64],
        motions: &[LoopMotion],
        step: &mut [f64],
    ) -> Result<f64, SolverError> {
        step.fill(0.0);
        kinematics(tree, ws, q, step);
        self.correct(tree, ws, motions, Level::Position, q, step)
    }

    fn rate_step(
        &mut self,
        tree: &Tree,
        ws: &mut Workspace,
        (q, v): (&[f64], &[f64]),
        motions: &[LoopMotion],
        step: &mut [f64],
    ) -> Result<f64, SolverError> {
        step.copy_from_slice(v);
        self.correct(tree, ws, motions, Level::Rate, q, step)
    }
}
