//! The integrator: a method with its workspace, fixed-size steps, and queries about the last step.
use crate::combine::{Stages, finite, first_bad, sum, weigh};
use crate::dense::{Dense, Polynomials};
use crate::errors::Failure;
use crate::explicit::Rows;
use crate::method::Method;
use crate::rosenbrock::Stiff;
use crate::system::System;
use crate::work::{Attempt, Work};

/// A method with its workspace for n lanes. From a step it keeps only the dense output and f at its end. The state that a simulation must save is in
/// its own state and in [`crate::Memory`].
#[derive(Clone, Debug)]
pub struct Integrator {
    method: Method,
    n: usize,
    engine: Engine,
    polynomials: Polynomials,
    pub(crate) work: Work,
    last: Option<Last>,
}

#[derive(Clone, Debug)]
enum Engine {
    Explicit(Box<Rows>),
    Rosenbrock(Box<Stiff>),
    SemiImplicitEuler,
}

/// The last accepted step.
#[derive(Clone, Copy, Debug)]
struct Last {
    t: f64,
    h: f64,
    /// Whether the last stage is f at the end because the projection left x unchanged.
    slope_known: bool,
    /// Whether x₁ was copied after the projection; otherwise it follows from the stages.
    end_kept: bool,
    /// Whether extra stages and defect are computed.
    dense_ready: bool,
}

impl Integrator {
    /// Creates an integrator for n lanes. Memory: n times the stages of the method, plus n² for stiff methods. Later calls do not allocate.
    ///
    /// # Panics
    /// If a table has more than 16 nonzero weights in a row, or an interpolant of degree above 7.
    pub fn new(method: Method, n: usize) -> Self {
        let (engine, polynomials, stages) = match method {
            Method::Explicit(table) => {
                let polynomials = Polynomials::new(table.dense.iter().copied());
                (Engine::Explicit(Box::new(Rows::new(table))), polynomials, table.a.len())
            }
            Method::Rosenbrock(table) => {
                let rows = crate::rosenbrock::bezier(table);
                let polynomials = Polynomials::new(rows.iter().map(|row| &row[..]));
                (Engine::Rosenbrock(Box::new(Stiff::new(table, n))), polynomials, table.a.len())
            }
            Method::SemiImplicitEuler => {
                (Engine::SemiImplicitEuler, Polynomials::new(std::iter::empty()), 1)
            }
        };
        Integrator { method, n, engine, polynomials, work: Work::new(n, stages), last: None }
    }

    /// Returns the method.
    pub fn method(&self) -> Method {
        self.method
    }

    /// Returns the number of lanes.
    pub fn lanes(&self) -> usize {
        self.n
    }

    /// Makes one step of `h` (s, either sign) from `t`. `x` is moved and projected; after a failure it is unchanged. Pass `k1` = f(t, x) if you have
    /// it; it must be exactly this value.
    ///
    /// # Errors
    /// [`Failure::System`], [`Failure::Start`], [`Failure::NotFinite`].
    ///
    /// # Panics
    /// If the length of `x` or `k1` is not n.
    pub fn step_fixed<S: System>(
        &mut self,
        system: &mut S,
        t: f64,
        h: f64,
        x: &mut [f64],
        k1: Option<&[f64]>,
    ) -> Result<(), Failure<S::Error>> {
        if let (Engine::Explicit(rows), Some(k1)) = (&self.engine, k1) {
            assert_eq!(x.len(), self.n, "lanes of the state and of the integrator");
            assert_eq!(k1.len(), self.n, "lanes of k1 and of the integrator");
            self.last = None;
            let attempt = rows.attempt_from(system, &mut self.work, (t, h), x, k1);
            return match attempt {
                Ok(Attempt::Finite) => self.settle(system, t, h, x),
                Ok(Attempt::Bad { lane }) => Err(self.undo(x, self.not_finite(t, h, lane))),
                Err(fault) => Err(Failure::System(fault)),
            };
        }
        self.begin(system, t, x, k1, None)?;
        match self.attempt(system, t, h)? {
            Attempt::Finite => self.accept(system, t, h, x),
            Attempt::Bad { lane } => Err(self.not_finite(t, h, lane)),
        }
    }

    /// Returns the failure of a step that is not finite, due to its start or to its size.
    #[cold]
    fn not_finite<E>(&self, t: f64, h: f64, lane: usize) -> Failure<E> {
        self.start_fault(t).unwrap_or(Failure::NotFinite { t, h, lane })
    }

    /// Restores x to its value at the start.
    #[cold]
    fn undo<E>(&self, x: &mut [f64], failure: Failure<E>) -> Failure<E> {
        x.copy_from_slice(&self.work.x0);
        failure
    }

    /// Returns f at the end of the last step, if the last stage computed it and the projection did not move x. It is f at time t + h; pass it to the
    /// next step as `k1`.
    pub fn end_derivatives(&self) -> Option<&[f64]> {
        let (Engine::Explicit(rows), Some(last)) = (&self.engine, &self.last) else { return None };
        let at = (rows.table.stages - 1) * self.n;
        last.slope_known.then(|| &self.work.k[at..at + self.n])
    }

    /// Returns the solution within the last accepted step. The first call after a step may evaluate `system` for more stages (RK4 one, Verner 8(7)
    /// four, the others none), so the system must be in the same condition as during the step.
    ///
    /// # Errors
    /// [`Failure::NoStep`] if no step was made or the last one failed; [`Failure::System`] and [`Failure::NotFinite`] of the extra stages.
    pub fn dense<S: System>(&mut self, system: &mut S) -> Result<Dense<'_>, Failure<S::Error>> {
        let Some(last) = self.last else { return Err(Failure::NoStep) };
        let Last { t, h, .. } = last;
        if !last.dense_ready {
            self.prepare_dense(system, last)?;
        }
        Ok(Dense {
            work: &self.work,
            polynomials: &self.polynomials,
            scale: self.scale(h),
            t,
            h,
            straight: self.method.dense_order() == 1,
        })
    }

    /// Repeats the last accepted step from its start t with another length h, into `x`, projected. If the step ends at an event, its stages do not
    /// include anything after the event, whereas the dense output of a step across the event does. The repeated step becomes the last step.
    ///
    /// # Errors
    /// [`Failure::NoStep`] if no step was made or the last one failed; [`Failure::System`], [`Failure::Start`], [`Failure::NotFinite`].
    ///
    /// # Panics
    /// If the length of `x` is not n.
    pub fn again<S: System>(
        &mut self,
        system: &mut S,
        (t, h): (f64, f64),
        x: &mut [f64],
    ) -> Result<(), Failure<S::Error>> {
        if self.last.take().is_none() {
            return Err(Failure::NoStep);
        }
        match self.attempt(system, t, h)? {
            Attempt::Finite => self.accept(system, t, h, x),
            Attempt::Bad { lane } => Err(self.not_finite(t, h, lane)),
        }
    }

    /// Like [`Integrator::again`], for a system whose derivatives depend on the length of the step: evaluates the derivatives at the start again.
    ///
    /// # Errors
    /// As [`Integrator::again`].
    ///
    /// # Panics
    /// If the length of `x` is not n.
    pub fn again_anew<S: System>(
        &mut self,
        system: &mut S,
        (t, h): (f64, f64),
        x: &mut [f64],
    ) -> Result<(), Failure<S::Error>> {
        if self.last.is_none() {
            return Err(Failure::NoStep);
        }
        x.copy_from_slice(&self.work.x0);
        self.step_fixed(system, t, h, x, None)
    }

    fn prepare_dense<S: System>(
        &mut self,
        system: &mut S,
        Last { t, h, end_kept, .. }: Last,
    ) -> Result<(), Failure<S::Error>> {
        let scale = self.scale(h);
        if let Engine::Explicit(rows) = &self.engine {
            if !end_kept {
                rows.recall_end(&mut self.work, h);
            }
            let bad = rows.extra_stages(system, &mut self.work, t, h).map_err(Failure::System)?;
            if let Some(lane) = bad {
                return Err(Failure::NotFinite { t, h, lane });
            }
        }
        let weights = self.polynomials.weights(1.0);
        let stages = &self.polynomials.stages;
        let Work { x0, x1, k, defect, .. } = &mut self.work;
        sum(defect, x0, scale, &weights[..stages.len()], stages, Stages::new(k, x0.len()));
        for (d, x1) in defect.iter_mut().zip(x1.iter()) {
            *d = x1 - *d;
        }
        if let Some(last) = &mut self.last {
            last.dense_ready = true;
        }
        Ok(())
    }

    /// Returns the factor of the stages.
    fn scale(&self, h: f64) -> f64 {
        match self.engine {
            Engine::Rosenbrock(_) => 1.0,
            _ => h,
        }
    }

    /// Stores x and k₁, and forgets the last step. `sizes` are the minimum sizes of lanes in finite differences, if known.
    #[inline]
    pub(crate) fn begin<S: System>(
        &mut self,
        system: &mut S,
        t: f64,
        x: &[f64],
        k1: Option<&[f64]>,
        sizes: Option<&[f64]>,
    ) -> Result<(), Failure<S::Error>> {
        assert_eq!(x.len(), self.n, "lanes of the state and of the integrator");
        self.last = None;
        self.work.x0.copy_from_slice(x);
        let first = match &mut self.engine {
            Engine::Rosenbrock(stiff) => stiff.begin(sizes),
            _ => &mut self.work.k[..self.n],
        };
        match k1 {
            Some(k1) => first.copy_from_slice(k1),
            None => system.derivatives(t, x, first).map_err(Failure::System)?,
        }
        Ok(())
    }

    /// Returns f at the start.
    pub(crate) fn first(&self) -> &[f64] {
        match &self.engine {
            Engine::Rosenbrock(stiff) => &stiff.f0,
            _ => &self.work.k[..self.n],
        }
    }

    /// Returns the failure if x or f at the start is not finite.
    #[cold]
    pub(crate) fn start_fault<E>(&self, t: f64) -> Option<Failure<E>> {
        let lane = first_bad(&self.work.x0).or_else(|| first_bad(self.first()))?;
        Some(Failure::Start { t, lane })
    }

    /// Attempts a step of h from the start stored by [`Integrator::begin`]. It may be repeated with another h.
    #[inline]
    pub(crate) fn attempt<S: System>(
        &mut self,
        system: &mut S,
        t: f64,
        h: f64,
    ) -> Result<Attempt, Failure<S::Error>> {
        let work = &mut self.work;
        match &mut self.engine {
            Engine::Explicit(rows) => rows.attempt(system, work, t, h),
            Engine::Rosenbrock(stiff) => stiff.attempt(system, work, t, h),
            Engine::SemiImplicitEuler => semi_implicit_euler(system, work, h),
        }
        .map_err(Failure::System)
    }

    /// Computes f(t + h, x + h f) − f into `work.error`, for the first step. Returns false if x + h f is not finite.
    pub(crate) fn probe<S: System>(
        &mut self,
        system: &mut S,
        t: f64,
        h: f64,
    ) -> Result<bool, Failure<S::Error>> {
        let Work { x0, stage, k, error, .. } = &mut self.work;
        let first = match &self.engine {
            Engine::Rosenbrock(stiff) => &stiff.f0[..],
            _ => &k[..self.n],
        };
        for (out, (x, f)) in stage.iter_mut().zip(x0.iter().zip(first)) {
            *out = x + h * f;
        }
        if !finite(stage) {
            return Ok(false);
        }
        system.derivatives(t + h, stage, error).map_err(Failure::System)?;
        for (e, f) in error.iter_mut().zip(first) {
            *e -= f;
        }
        Ok(true)
    }

    /// Computes the error estimate of the attempt, into `work.error`.
    pub(crate) fn estimate(&mut self, h: f64) {
        let scale = self.scale(h);
        let row = match &self.engine {
            Engine::Explicit(rows) => &rows.error,
            Engine::Rosenbrock(stiff) => &stiff.error,
            Engine::SemiImplicitEuler => return,
        };
        weigh(&mut self.work.error, scale, row, &self.work.k);
    }

    /// Returns the end of the attempt to the caller, projected.
    pub(crate) fn accept<S: System>(
        &mut self,
        system: &mut S,
        t: f64,
        h: f64,
        x: &mut [f64],
    ) -> Result<(), Failure<S::Error>> {
        x.copy_from_slice(&self.work.x1);
        self.settle(system, t, h, x)
    }

    /// Projects `x`, which is x₁, and stores the step. Restores `x` after a failure.
    #[inline]
    fn settle<S: System>(
        &mut self,
        system: &mut S,
        t: f64,
        h: f64,
        x: &mut [f64],
    ) -> Result<(), Failure<S::Error>> {
        let projects = system.projects();
        if projects && let Err(fault) = system.project(t + h, x) {
            return Err(self.undo(x, Failure::System(fault)));
        }
        let same_as_last =
            matches!(&self.engine, Engine::Explicit(rows) if rows.table.first_same_as_last);
        // Only methods with a last stage at the end need to check whether the projection moved x.
        let slope_known = same_as_last && same_bits(x, &self.work.x1);
        if projects {
            self.work.x1.copy_from_slice(x);
        }
        if !finite(x) {
            let lane = first_bad(x).unwrap_or(0);
            return Err(self.undo(x, self.not_finite(t, h, lane)));
        }
        self.last = Some(Last { t, h, slope_known, end_kept: projects, dense_ready: false });
        Ok(())
    }
}

fn same_bits(a: &[f64], b: &[f64]) -> bool {
    a.iter().zip(b).fold(0, |moved, (a, b)| moved | (a.to_bits() ^ b.to_bits())) == 0
}

/// Advances velocities by h f; then the system moves its positions along them.
fn semi_implicit_euler<S: System>(
    system: &mut S,
    work: &mut Work,
    h: f64,
) -> Result<Attempt, S::Error> {
    let Work { x0, x1, k, .. } = work;
    for (out, (x, k)) in x1.iter_mut().zip(x0.iter().zip(k.iter())) {
        *out = x + h * k;
    }
    for lanes in system.positions() {
        x1[lanes.clone()].copy_from_slice(&x0[lanes.clone()]);
    }
    system.retract(x1, k, h)?;
    Ok(if finite(x1) { Attempt::Finite } else { Attempt::bad(x1) })
}
