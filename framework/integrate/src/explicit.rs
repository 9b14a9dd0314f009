//! One attempt of an explicit Runge–Kutta step, from its table.
use crate::combine::{Row, combine, first_bad};
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
        let n = work.x0.len();
        for i in 1..self.table.stages {
            if !combine(&mut work.stage, &work.x0, h, &self.a[i], &work.k) {
                return Ok(Attempt::bad(&work.stage));
            }
            let k = &mut work.k[i * n..(i + 1) * n];
            system.derivatives(t + self.table.c[i] * h, &work.stage, k)?;
        }
        if self.table.first_same_as_last {
            std::mem::swap(&mut work.x1, &mut work.stage);
        } else if !combine(&mut work.x1, &work.x0, h, &self.b, &work.k) {
            return Ok(Attempt::bad(&work.x1));
        }
        Ok(Attempt::Finite)
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
            if !combine(&mut work.stage, &work.x0, h, &self.a[i], &work.k) {
                return Ok(first_bad(&work.stage));
            }
            let k = &mut work.k[i * n..(i + 1) * n];
            system.derivatives(t + self.table.c[i] * h, &work.stage, k)?;
            if let Some(lane) = first_bad(k) {
                return Ok(Some(lane));
            }
        }
        Ok(None)
    }
}
