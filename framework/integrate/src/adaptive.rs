//! Adaptive steps: error norm, controller, first step.
//!
//! ```text
//! q      = norm of the error estimate over the tolerances; accepted when q ≤ 1
//! h_next = h clamp(0.9 q^(−α) q_old^β, 0.2, 5)       k = order of the estimate + 1
//! α = 1/k − 0.75 β,  β = 0.2/k                       (PI; Hairer, Wanner II, section IV.2)
//! h_next = h max(0.2, min(0.9 q^(−1/k), 0.9))        after a rejection
//! ```
use crate::errors::{Failure, Setup};
use crate::integrator::Integrator;
use crate::method::{METHODS, Method};
use crate::rosenbrock::SIZE;
use crate::system::System;
use crate::tolerances::{Norm, Tolerances};
use crate::work::Attempt;

/// State of the step size controller between steps. It is plain data that the caller keeps in its own state, so that a copy of the state is a
/// complete checkpoint.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Memory {
    /// The step that the controller proposes, s; 0 before the first step. If the last step was cut, this is not its length.
    pub next: f64,
    /// Error norm of the last step that was not cut.
    pub error: f64,
}

impl Memory {
    /// Value before the first step, and after a jump of the state.
    pub const START: Memory = Memory { next: 0.0, error: ERROR_FLOOR };
}

impl Default for Memory {
    fn default() -> Self {
        Memory::START
    }
}

/// Bounds of the step size.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Limits {
    /// Smallest step after a rejection, s. It is never less than 16 times the round-off of t.
    pub step_min: f64,
    /// Largest step, s.
    pub step_max: f64,
    /// Maximum number of consecutive rejections.
    pub rejections_max: u32,
}

impl Default for Limits {
    fn default() -> Self {
        Limits { step_min: 0.0, step_max: f64::INFINITY, rejections_max: 60 }
    }
}

/// Checked settings of adaptive steps.
#[derive(Clone, Debug, PartialEq)]
pub struct Control {
    tolerances: Tolerances,
    norm: Norm,
    limits: Limits,
    /// Order of the error estimate, plus one.
    k: f64,
    /// Minimum sizes of lanes in finite differences.
    sizes: Vec<f64>,
}

/// An accepted step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Accepted {
    /// Its length, s. If it ended at the caller's bound, bit-identical with the bound.
    pub h: f64,
    /// Whether it ended at the caller's bound.
    pub end: bool,
    /// Its error norm, at most 1.
    pub error: f64,
    /// Number of attempts that were rejected before it.
    pub rejections: u32,
}

const SAFETY: f64 = 0.9;
const SHRINK_MAX: f64 = 0.2;
const GROW_MAX: f64 = 5.0;
/// Smallest error norm that the controller stores.
const ERROR_FLOOR: f64 = 1e-4;
/// Factor of the step size after a step that was not finite.
const SHRINK_BAD: f64 = 0.25;
/// A step that ends this close below the bound is extended to it.
const STRETCH: f64 = 1.01;

impl Control {
    /// Creates the settings for `method`.
    ///
    /// # Errors
    /// [`Setup::NoErrorEstimate`], [`Setup::Steps`].
    pub fn new(
        method: Method,
        tolerances: Tolerances,
        norm: Norm,
        limits: Limits,
    ) -> Result<Self, Setup> {
        if method.error_order() == 0 {
            let choices = METHODS.iter().filter(|m| m.error_order() > 0).map(Method::name);
            let choices = choices.collect::<Vec<_>>().join(", ");
            return Err(Setup::NoErrorEstimate { method: method.name(), choices });
        }
        let Limits { step_min: min, step_max: max, .. } = limits;
        if !(min >= 0.0 && min <= max && min.is_finite() && max > 0.0) {
            return Err(Setup::Steps { min, max });
        }
        let k = f64::from(method.error_order() + 1);
        let sizes = tolerances.sizes(SIZE);
        Ok(Control { tolerances, norm, limits, k, sizes })
    }

    /// Returns the tolerances.
    pub fn tolerances(&self) -> &Tolerances {
        &self.tolerances
    }

    /// Returns the factor of the step size after an accepted step with error q.
    fn growth(&self, q: f64, q_old: f64, after_rejection: bool) -> f64 {
        let beta = 0.2 / self.k;
        let alpha = 1.0 / self.k - 0.75 * beta;
        let most = if after_rejection { 1.0 } else { GROW_MAX };
        if q <= 0.0 {
            return most;
        }
        (SAFETY * q.powf(-alpha) * q_old.powf(beta)).clamp(SHRINK_MAX, most)
    }

    /// Returns the factor of the step size after a rejected step with error q > 1, or NaN.
    fn shrink(&self, q: f64) -> f64 {
        if !q.is_finite() {
            return SHRINK_BAD;
        }
        (SAFETY * q.powf(-1.0 / self.k)).clamp(SHRINK_MAX, SAFETY)
    }
}

impl Integrator {
    /// Makes one accepted step from `t`, with a size according to the error and at most `h_max` (s, above zero). A step that comes close to `h_max`
    /// ends exactly there. `x` is moved and projected. Rejected attempts and failures leave `x` and `memory` unchanged. Pass `k1` = f(t, x) if you
    /// have it.
    ///
    /// A step that was cut to `h_max` leaves `memory` unchanged: the proposal remains that from the last step that was not cut. Log samples therefore
    /// do not influence later steps.
    ///
    /// # Errors
    /// [`Failure::System`], [`Failure::Start`], [`Failure::StepTooSmall`], [`Failure::Rejections`]; [`Failure::NotFinite`] if the projection makes x
    /// infinite or NaN.
    ///
    /// # Panics
    /// If `control` is for another number of lanes or a method of another order, if the length of `x` or `k1` is not n, or if `h_max` is not above
    /// zero and finite.
    pub fn advance<S: System>(
        &mut self,
        system: &mut S,
        control: &Control,
        t: f64,
        h_max: f64,
        x: &mut [f64],
        k1: Option<&[f64]>,
        memory: &mut Memory,
    ) -> Result<Accepted, Failure<S::Error>> {
        assert!(h_max > 0.0 && h_max.is_finite(), "the step's bound {h_max} s is not above zero");
        assert_eq!(control.tolerances.lanes(), self.lanes(), "lanes of tolerances and state");
        assert_eq!(
            control.k,
            f64::from(self.method().error_order() + 1),
            "settings of this method"
        );
        self.begin(system, t, x, k1, Some(&control.sizes))?;
        let fresh = !(memory.next > 0.0);
        let least =
            control.limits.step_min.max(16.0 * f64::EPSILON * t.abs()).max(f64::MIN_POSITIVE);
        let mut proposal =
            if fresh { self.first_step(system, control, t, h_max)? } else { memory.next };
        let free = proposal;
        proposal = proposal.max(least).min(control.limits.step_max);
        let mut rejections = 0;
        loop {
            let end = proposal * STRETCH >= h_max && h_max <= control.limits.step_max;
            let h = if end { h_max } else { proposal };
            let (q, worst) = self.try_step(system, control, t, h)?;
            if q <= 1.0 {
                self.accept(system, t, h, x)?;
                if !end {
                    let factor = control.growth(q, memory.error, rejections > 0);
                    *memory = Memory {
                        next: (h * factor).min(control.limits.step_max),
                        error: q.max(ERROR_FLOOR),
                    };
                } else if fresh {
                    memory.next = free;
                }
                return Ok(Accepted { h, end, error: q, rejections });
            }
            if let Some(fault) = self.start_fault(t) {
                return Err(fault);
            }
            rejections += 1;
            let (lane, error) = worst;
            if h <= least {
                return Err(Failure::StepTooSmall { t, h, least, lane, error });
            }
            if rejections > control.limits.rejections_max {
                return Err(Failure::Rejections { t, h, lane, rejections });
            }
            proposal = (h * control.shrink(q)).max(least);
        }
    }

    /// Makes an attempt. Returns its error norm (NaN if it is not finite), and the worst lane if q > 1.
    fn try_step<S: System>(
        &mut self,
        system: &mut S,
        control: &Control,
        t: f64,
        h: f64,
    ) -> Result<(f64, (usize, f64)), Failure<S::Error>> {
        if let Attempt::Bad { lane } = self.attempt(system, t, h)? {
            return Ok((f64::NAN, (lane, f64::NAN)));
        }
        self.estimate(h);
        let work = &mut self.work;
        if system.projects() {
            system.project_change(t + h, &work.x1, &mut work.error).map_err(Failure::System)?;
        }
        let q = control.tolerances.norm(control.norm, &work.error, &work.x0, &work.x1);
        if q <= 1.0 {
            return Ok((q, (0, 0.0)));
        }
        Ok((q, control.tolerances.worst(&work.error, &work.x0, &work.x1)))
    }

    /// Chooses the first step from the sizes of x, f and the change of f over a small step (Hairer, Nørsett, Wanner I, section II.4). Evaluates f
    /// once, at most `h_max` ahead.
    fn first_step<S: System>(
        &mut self,
        system: &mut S,
        control: &Control,
        t: f64,
        h_max: f64,
    ) -> Result<f64, Failure<S::Error>> {
        if let Some(fault) = self.start_fault(t) {
            return Err(fault);
        }
        let Limits { step_max, .. } = control.limits;
        let size = |v: &[f64], x0: &[f64]| control.tolerances.norm(control.norm, v, x0, x0);
        let (x, f) = (size(&self.work.x0, &self.work.x0), size(self.first(), &self.work.x0));
        let small = if x <= 1e-5 || f <= 1e-5 { 1e-6 } else { 0.01 * x / f };
        let small = small.min(h_max).min(step_max);
        if !self.probe(system, t, small)? {
            return Ok(small);
        }
        let bend = size(&self.work.error, &self.work.x0) / small;
        if !bend.is_finite() {
            return Ok(small);
        }
        let steepest = bend.max(f);
        let h = if steepest <= 1e-15 {
            (small * 1e-3).max(1e-6)
        } else {
            (0.01 / steepest).powf(1.0 / f64::from(self.method().order()))
        };
        Ok(h.min(100.0 * small).min(step_max))
    }
}
