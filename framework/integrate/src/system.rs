//! What an integrator sees of the system that it moves.
use std::ops::Range;

/// A system of ordinary differential equations over a flat state.
///
/// All methods get slices of the same length n. Time is in s; each lane has its own unit.
pub trait System {
    /// What the system itself may refuse; passed through by every driver.
    type Error;

    /// ẋ = f(t, x). Writes every lane of `xdot`, in the lane's unit per second.
    ///
    /// `x` may be a stage and so need not lie on the manifold exactly (a quaternion that is
    /// not quite of unit length). In adaptive steps it is always finite; in a step of fixed size
    /// a stage may follow from an infinite or NaN derivative of the stage before, and the step
    /// is refused at its end.
    ///
    /// # Errors
    /// Whatever the system refuses.
    fn derivatives(&mut self, t: f64, x: &[f64], xdot: &mut [f64]) -> Result<(), Self::Error>;

    /// After a step: brings `x` at time `t` back onto its manifold (unit quaternions, closed
    /// loops). A projection moves x by no more than the method's own error. Default: nothing.
    ///
    /// # Errors
    /// Whatever the system refuses.
    fn project(&mut self, _t: f64, _x: &mut [f64]) -> Result<(), Self::Error> {
        Ok(())
    }

    /// Removes from `change`, a small change of the state `x` at time `t`, the part that [`System::project`] would remove. Adaptive methods
    /// ask for their error estimates, so that an error which the projection at the end of the step removes does not shorten the step.
    /// Default: nothing, which is right unless such errors are much larger than those that stay.
    ///
    /// # Errors
    /// Whatever the system refuses.
    fn project_change(
        &mut self,
        _t: f64,
        _x: &[f64],
        _change: &mut [f64],
    ) -> Result<(), Self::Error> {
        Ok(())
    }

    /// Whether [`System::project`] may move anything. Where it cannot, it is not called, and the
    /// copy that the dense output needs of the end of a step is left until it is asked for.
    /// Default: true.
    fn projects(&self) -> bool {
        true
    }

    /// The lanes that [`System::retract`] moves: positions. Only semi-implicit Euler asks.
    /// Default: none, which makes that method the explicit one.
    fn positions(&self) -> &[Range<usize>] {
        &[]
    }

    /// Moves the lanes of [`System::positions`], and only those, by `h` (s) along the
    /// velocities that stand in `x`; those are at the end of the step already. Lanes with a
    /// rule of their own (quaternions) move by it; the others, filters of position say, may
    /// add `h` times their lane of `xdot`, which is f at the start of the step.
    ///
    /// # Errors
    /// Whatever the system refuses.
    fn retract(&mut self, _x: &mut [f64], _xdot: &[f64], _h: f64) -> Result<(), Self::Error> {
        Ok(())
    }

    /// ∂f/∂x at (t, x), n × n, row by row: `out[i n + j]` = ∂fᵢ/∂xⱼ. Returns whether it was
    /// written; default: no, and finite differences take its place (n calls of
    /// [`System::derivatives`]). Only stiff methods ask, once for each step.
    ///
    /// # Errors
    /// Whatever the system refuses.
    fn jacobian(&mut self, _t: f64, _at: &At<'_>, _out: &mut [f64]) -> Result<bool, Self::Error> {
        Ok(false)
    }

    /// ∂f/∂t at (t, x). Returns whether it was written; default: no, and a finite difference
    /// takes its place (one call). Only stiff methods ask, once for each step.
    ///
    /// # Errors
    /// Whatever the system refuses.
    fn time_derivative(
        &mut self,
        _t: f64,
        _x: &[f64],
        _out: &mut [f64],
    ) -> Result<bool, Self::Error> {
        Ok(false)
    }
}

/// Where a Jacobian is asked for: n lanes each.
#[derive(Clone, Copy, Debug)]
pub struct At<'a> {
    /// The state.
    pub x: &'a [f64],
    /// f(t, x), in the lane's unit per second.
    pub f: &'a [f64],
    /// Increments that fit the lanes in differences: small beside their size, towards where they are going.
    pub steps: &'a [f64],
}

/// A right side alone, without a manifold: ẋ = f(t, x) as a function that writes ẋ.
#[derive(Clone, Copy, Debug)]
pub struct Field<F>(pub F);

impl<F: FnMut(f64, &[f64], &mut [f64])> System for Field<F> {
    type Error = std::convert::Infallible;

    fn derivatives(&mut self, t: f64, x: &[f64], xdot: &mut [f64]) -> Result<(), Self::Error> {
        (self.0)(t, x, xdot);
        Ok(())
    }

    fn projects(&self) -> bool {
        false
    }
}
