//! Interface of the systems that an integrator advances.
use std::ops::Range;

/// A system of ordinary differential equations over a flat state.
///
/// All functions get slices of the same length n. Time is in s; each lane has its own unit.
pub trait System {
    /// Error of the system. Every driver passes it through.
    type Error;

    /// Computes ẋ = f(t, x). Must write every lane of `xdot`, in the lane's unit per second.
    ///
    /// `x` may be a stage, so it need not lie on the manifold exactly (a quaternion may have a length slightly different from one). In adaptive steps
    /// it is always finite. In a fixed-size step, a stage may result from an infinite or NaN derivative of the previous stage; the step then fails at
    /// its end.
    ///
    /// # Errors
    /// Any error of the system.
    fn derivatives(&mut self, t: f64, x: &[f64], xdot: &mut [f64]) -> Result<(), Self::Error>;

    /// Projects `x` at time `t` back onto its manifold after a step (unit quaternions, closed loops). A projection must not move x by more than the
    /// method's own error. Default: does nothing.
    ///
    /// # Errors
    /// Any error of the system.
    fn project(&mut self, _t: f64, _x: &mut [f64]) -> Result<(), Self::Error> {
        Ok(())
    }

    /// Removes from `change`, a small change of the state `x` at time `t`, the part that [`System::project`] would remove. Adaptive methods apply it
    /// to their error estimates, so that an error which the projection removes anyway does not shorten the step. Default: does nothing, which is
    /// right unless such errors are much larger than the remaining ones.
    ///
    /// # Errors
    /// Any error of the system.
    fn project_change(
        &mut self,
        _t: f64,
        _x: &[f64],
        _change: &mut [f64],
    ) -> Result<(), Self::Error> {
        Ok(())
    }

    /// Returns whether [`System::project`] may move anything. If false, it is never called, and the copy of the end of a step for dense output is
    /// deferred until needed. Default: true.
    fn projects(&self) -> bool {
        true
    }

    /// Returns the lanes that [`System::retract`] moves: positions. Only semi-implicit Euler uses this. Default: empty, which makes that method the
    /// explicit one.
    fn positions(&self) -> &[Range<usize>] {
        &[]
    }

    /// Moves the lanes of [`System::positions`], and only those, by `h` (s) along the velocities in `x`, which are already those at the end of the
    /// step. Lanes with a special rule (quaternions) follow it. Other lanes, for example filters of positions, may add `h` times their lane of
    /// `xdot`, which is f at the start of the step.
    ///
    /// # Errors
    /// Any error of the system.
    fn retract(&mut self, _x: &mut [f64], _xdot: &[f64], _h: f64) -> Result<(), Self::Error> {
        Ok(())
    }

    /// Computes ∂f/∂x at (t, x), n × n, row by row: `out[i n + j]` = ∂fᵢ/∂xⱼ. Returns whether it was written. Default: false, so that finite
    /// differences are used (n calls of [`System::derivatives`]). Only stiff methods call this, once per step.
    ///
    /// # Errors
    /// Any error of the system.
    fn jacobian(&mut self, _t: f64, _at: &At<'_>, _out: &mut [f64]) -> Result<bool, Self::Error> {
        Ok(false)
    }

    /// Computes ∂f/∂t at (t, x). Returns whether it was written. Default: false, so that a finite difference is used (one call). Only stiff methods
    /// call this, once per step.
    ///
    /// # Errors
    /// Any error of the system.
    fn time_derivative(
        &mut self,
        _t: f64,
        _x: &[f64],
        _out: &mut [f64],
    ) -> Result<bool, Self::Error> {
        Ok(false)
    }
}

/// State at which a Jacobian is computed: n lanes each.
#[derive(Clone, Copy, Debug)]
pub struct At<'a> {
    /// The state.
    pub x: &'a [f64],
    /// f(t, x), in the lane's unit per second.
    pub f: &'a [f64],
    /// Suitable increments of the lanes in finite differences: small relative to their size, in the direction of their motion.
    pub steps: &'a [f64],
}

/// A system without a manifold: ẋ = f(t, x) as a function that writes ẋ.
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
