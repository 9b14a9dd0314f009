//! One attempt of an explicit Runge–Kutta step, from its table.
use crate::combine::{Row, Stages, combine, combine_unchecked, end_of_four, first_bad};
use crate::method::Explicit;
use crate::system::System;
use crate::work::{Attempt, Work};

/// The table without its zeros.
#[derive(Clone, Debug)]
pub(crate) struct Rows {
    pub table: &'static Explicit,
    a: Vec<Row>,
    b: Row,
    /// Weights of the error estimate.
    pub error: Row,
}

impl Rows {
    pub fn new(table: &'static Explicit) -> Self {
        Rows {
            table,
            a: table.a.iter().map(|row| Row::new(row)).collect(),
            b: Row::new(table.b),
            error: Row::new(table.error),
        }
    }

    /// From `x0` with k₁ in the first row of `k` to `x1`, all stages in `k`.
    #[inline]
    pub fn attempt<S: System>(
        &self,
        system: &mut S,
        work: &mut Work,
        t: f64,
        h: f64,
    ) -> Result<Attempt, S::Error> {
        Ok(match self.stages::<S, true>(system, work, (t, h), None)? {
            Attempt::Finite => self.end(work, h),
            bad => bad,
        })
    }

    /// The same from the caller's x and k₁, which end up in `work`; `x` is x₁ then, and as it
    /// was when the system refuses or a stage is bad. Nothing is copied that is read soon after.
    #[inline]
    pub fn attempt_from<S: System>(
        &self,
        system: &mut S,
        work: &mut Work,
        (t, h): (f64, f64),
        x: &mut [f64],
        k1: &[f64],
    ) -> Result<Attempt, S::Error> {
        let stages = self.stages::<S, false>(system, work, (t, h), Some((x, k1)))?;
        let Work { x0, k, .. } = &mut *work;
        if stages == Attempt::Finite && self.b.weights.len() == 4 && !self.table.first_same_as_last
        {
            let stages = Stages { first: k1, all: k };
            end_of_four(x, x0, h, &self.b, stages);
            k[..x.len()].copy_from_slice(k1);
            return Ok(Attempt::Finite);
        }
        x0.copy_from_slice(x);
        k[..x.len()].copy_from_slice(k1);
        if stages != Attempt::Finite {
            return Ok(stages);
        }
        let end = self.end(work, h);
        x.copy_from_slice(&work.x1);
        Ok(end)
    }

    /// All stages after the first; x and k₁ from the caller, or in `work`. With CHECKED the system
    /// sees finite stages only.
    #[inline(always)]
    fn stages<S: System, const CHECKED: bool>(
        &self,
        system: &mut S,
        work: &mut Work,
        (t, h): (f64, f64),
        start: Option<(&[f64], &[f64])>,
    ) -> Result<Attempt, S::Error> {
        let n = work.x0.len();
        for i in 1..self.table.stages {
            let Work { x0, stage, k, .. } = &mut *work;
            let (x, first) = start.unwrap_or((x0, &k[..n]));
            let stages = Stages { first, all: k };
            if !CHECKED {
                combine_unchecked(stage, x, h, &self.a[i], stages);
            } else if !combine(stage, x, h, &self.a[i], stages) {
                return Ok(Attempt::bad(stage));
            }
            let k = &mut k[i * n..(i + 1) * n];
            system.derivatives(t + self.table.c[i] * h, stage, k)?;
        }
        Ok(Attempt::Finite)
    }

    /// x₁ from all stages.
    fn end(&self, work: &mut Work, h: f64) -> Attempt {
        let Work { x0, x1, stage, k, .. } = work;
        if self.table.first_same_as_last {
            std::mem::swap(x1, stage);
        } else if !combine(x1, x0, h, &self.b, Stages::new(k, x0.len())) {
            return Attempt::bad(x1);
        }
        Attempt::Finite
    }

    /// The stages that only the dense output needs; a lane that is not finite is returned.
    pub fn extra_stages<S: System>(
        &self,
        system: &mut S,
        work: &mut Work,
        t: f64,
        h: f64,
    ) -> Result<Option<usize>, S::Error> {
        let n = work.x0.len();
        for i in self.table.stages..self.a.len() {
            let Work { x0, stage, k, .. } = &mut *work;
            if !combine(stage, x0, h, &self.a[i], Stages::new(k, n)) {
                return Ok(first_bad(stage));
            }
            let k = &mut k[i * n..(i + 1) * n];
            system.derivatives(t + self.table.c[i] * h, stage, k)?;
            if let Some(lane) = first_bad(k) {
                return Ok(Some(lane));
            }
        }
        Ok(None)
    }
}
