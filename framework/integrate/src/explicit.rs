//! One attempt of an explicit Runge–Kutta step, driven by its table.
use crate::combine::{Row, Stages, axpy, combine, first_bad, four};
use crate::system::System;
use crate::tableau::Explicit;
use crate::work::{Attempt, Work};

/// The table without its zeros.
#[derive(Clone, Debug)]
pub(crate) struct Rows {
    pub table: &'static Explicit,
    a: Vec<Row>,
    b: Row,
    chain: Option<Chain>,
    /// Weights of the error estimate.
    pub error: Row,
}

impl Rows {
    pub fn new(table: &'static Explicit) -> Self {
        Rows {
            table,
            a: table.a.iter().map(|row| Row::new(row)).collect(),
            b: Row::new(table.b),
            chain: Chain::of(table),
            error: Row::new(table.error),
        }
    }

    /// Makes an attempt from `x0`, with k₁ in the first row of `k`, to `x1`. All stages are in `k`.
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

    /// Makes the same attempt from the caller's x and k₁, which are moved to `work`. Afterwards `x` is x₁; if the system returns an error or a stage
    /// is not finite, `x` is unchanged. Avoids copies of data that is read soon after.
    #[inline]
    pub fn attempt_from<S: System>(
        &self,
        system: &mut S,
        work: &mut Work,
        (t, h): (f64, f64),
        x: &mut [f64],
        k1: &[f64],
    ) -> Result<Attempt, S::Error> {
        if let Some(chain) = &self.chain {
            return chain.attempt(system, work, (t, h), x, k1);
        }
        let stages = self.stages::<S, false>(system, work, (t, h), Some((x, k1)))?;
        let Work { x0, k, .. } = &mut *work;
        x0.copy_from_slice(x);
        k[..x.len()].copy_from_slice(k1);
        if stages != Attempt::Finite {
            return Ok(stages);
        }
        let end = self.end(work, h);
        x.copy_from_slice(&work.x1);
        Ok(end)
    }

    /// Computes all stages after the first. x and k₁ are the caller's, or in `work`. With CHECKED the system receives only finite stages.
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
            if !combine::<CHECKED>(stage, x, h, &self.a[i], stages) {
                return Ok(Attempt::bad(stage));
            }
            let k = &mut k[i * n..(i + 1) * n];
            system.derivatives(t + self.table.c[i] * h, stage, k)?;
        }
        Ok(Attempt::Finite)
    }

    /// Recomputes x₁ if the step did not store it.
    pub fn recall_end(&self, work: &mut Work, h: f64) {
        if self.chain.is_some() {
            self.end(work, h);
        }
    }

    /// Computes x₁ from all stages.
    fn end(&self, work: &mut Work, h: f64) -> Attempt {
        let Work { x0, x1, stage, k, .. } = work;
        if self.table.first_same_as_last {
            std::mem::swap(x1, stage);
        } else if !combine::<true>(x1, x0, h, &self.b, Stages::new(k, x0.len())) {
            return Attempt::bad(x1);
        }
        Attempt::Finite
    }

    /// Computes the stages that only dense output needs. Returns a lane that is not finite, if any.
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
            if !combine::<true>(stage, x0, h, &self.a[i], Stages::new(k, n)) {
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

/// Four stages, each of which depends only on the previous one, as in the classical method. The coefficients are read once, and each stage is one
/// pass over the lanes.
#[derive(Clone, Copy, Debug)]
struct Chain {
    a: [f64; 3],
    b: [f64; 4],
    c: [f64; 3],
}

impl Chain {
    /// Returns the chain of a table, if it is one.
    fn of(table: &Explicit) -> Option<Self> {
        let &[b1, b2, b3, b4] = table.b else { return None };
        let link = |i: usize| {
            let (a, zeros) = table.a.get(i)?.split_last()?;
            (zeros.len() + 1 == i && zeros.iter().all(|z| *z == 0.0)).then_some(*a)
        };
        let a = [link(1)?, link(2)?, link(3)?];
        let plain = !table.first_same_as_last && table.b.iter().all(|b| *b != 0.0);
        let c = [table.c[1], table.c[2], table.c[3]];
        plain.then_some(Chain { a, b: [b1, b2, b3, b4], c })
    }

    /// Makes an attempt as [`Rows::attempt_from`], bit-identical.
    #[inline]
    fn attempt<S: System>(
        &self,
        system: &mut S,
        work: &mut Work,
        (t, h): (f64, f64),
        x: &mut [f64],
        k1: &[f64],
    ) -> Result<Attempt, S::Error> {
        let n = x.len();
        let Work { x0, stage, k, .. } = work;
        let (first, k) = k.split_at_mut(n);
        let (k2, k) = k.split_at_mut(n);
        let (k3, k) = k.split_at_mut(n);
        let k4 = &mut k[..n];
        axpy::<false>(stage, x, h * self.a[0], k1);
        system.derivatives(t + self.c[0] * h, stage, k2)?;
        axpy::<false>(stage, x, h * self.a[1], k2);
        system.derivatives(t + self.c[1] * h, stage, k3)?;
        axpy::<false>(stage, x, h * self.a[2], k3);
        system.derivatives(t + self.c[2] * h, stage, k4)?;
        four(x, x0, self.b.map(|b| h * b), k1, k2, k3, k4);
        first.copy_from_slice(k1);
        Ok(Attempt::Finite)
    }
}
