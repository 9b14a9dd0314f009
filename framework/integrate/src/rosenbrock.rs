//! One attempt of a Rosenbrock step: Jacobian, one LU factorization, s solutions.
use crate::combine::{Row, Stages, combine, finite, first_bad};
use crate::lu::Lu;
use crate::system::{At, System};
use crate::tableau::Rosenbrock;
use crate::work::{Attempt, Work};

/// Table and workspace of a Rosenbrock method.
#[derive(Clone, Debug)]
pub(crate) struct Stiff {
    table: &'static Rosenbrock,
    a: Vec<Row>,
    c: Vec<Row>,
    m: Row,
    pub error: Row,
    /// f at the start.
    pub f0: Vec<f64>,
    /// Minimum size of each lane in finite differences.
    sizes: Vec<f64>,
    /// Increments of the lanes in finite differences.
    steps: Vec<f64>,
    /// ∂f/∂t at the start.
    slope: Vec<f64>,
    /// ∂f/∂x at the start, row by row.
    jacobian: Vec<f64>,
    /// Whether `slope` and `jacobian` belong to the present start.
    fresh: bool,
    lu: Lu,
}

impl Stiff {
    pub fn new(table: &'static Rosenbrock, n: usize) -> Self {
        Stiff {
            table,
            a: table.a.iter().map(|row| Row::new(row)).collect(),
            c: table.c.iter().map(|row| Row::new(row)).collect(),
            m: Row::new(table.m),
            error: Row::new(table.error),
            f0: vec![0.0; n],
            sizes: vec![SIZE; n],
            steps: vec![0.0; n],
            slope: vec![0.0; n],
            jacobian: vec![0.0; n * n],
            fresh: false,
            lu: Lu::new(n),
        }
    }

    /// Begins at a new start with unknown derivatives; `sizes` are the minimum sizes of lanes.
    pub fn begin(&mut self, sizes: Option<&[f64]>) -> &mut [f64] {
        self.fresh = false;
        match sizes {
            Some(sizes) => self.sizes.copy_from_slice(sizes),
            None => self.sizes.fill(SIZE),
        }
        &mut self.f0
    }

    /// Makes an attempt from `x0` and `f0` to `x1`, with the uᵢ in `k`.
    pub fn attempt<S: System>(
        &mut self,
        system: &mut S,
        work: &mut Work,
        t: f64,
        h: f64,
    ) -> Result<Attempt, S::Error> {
        if !self.fresh {
            self.linearise(system, work, t, h)?;
            let n = work.x0.len();
            let row = first_bad(&self.jacobian).map(|at| at / n);
            if let Some(lane) = first_bad(&self.slope).or(row) {
                // The derivatives failed at an increment of the difference quotients; a shorter
                // attempt uses smaller increments.
                return Ok(Attempt::Bad { lane });
            }
            self.fresh = true;
        }
        let n = work.x0.len();
        if !self.factor(h) {
            // The matrix is singular. With a shorter step it is closer to a multiple of the
            // identity.
            return Ok(Attempt::Bad { lane: 0 });
        }
        for i in 0..self.a.len() {
            let Work { x0, stage, k, error: rhs, .. } = &mut *work;
            if i == 0 {
                rhs.copy_from_slice(&self.f0);
            } else {
                if !combine::<true>(stage, x0, 1.0, &self.a[i], Stages::new(k, n)) {
                    return Ok(Attempt::bad(stage));
                }
                system.derivatives(t + self.table.alpha[i] * h, stage, rhs)?;
                if !finite(rhs) {
                    // Check here, because the linear solution would spread a NaN over all lanes.
                    return Ok(Attempt::bad(rhs));
                }
            }
            let u = &mut stage[..];
            combine::<false>(u, rhs, 1.0 / h, &self.c[i], Stages::new(k, n));
            let hd = h * self.table.d[i];
            if hd != 0.0 {
                u.iter_mut().zip(&self.slope).for_each(|(u, s)| *u += hd * s);
            }
            self.lu.solve(u);
            k[i * n..(i + 1) * n].copy_from_slice(u);
        }
        if !combine::<true>(&mut work.x1, &work.x0, 1.0, &self.m, Stages::new(&work.k, n)) {
            return Ok(Attempt::bad(&work.x1));
        }
        Ok(Attempt::Finite)
    }

    /// Factors W = 1/(γh) − J.
    fn factor(&mut self, h: f64) -> bool {
        let n = self.f0.len();
        for (w, j) in self.lu.a.iter_mut().zip(&self.jacobian) {
            *w = -j;
        }
        let diagonal = 1.0 / (self.table.gamma * h);
        self.lu.a.iter_mut().step_by(n + 1).for_each(|w| *w += diagonal);
        self.lu.factor()
    }

    /// Computes ∂f/∂x and ∂f/∂t, from the system or by finite differences.
    fn linearise<S: System>(
        &mut self,
        system: &mut S,
        work: &mut Work,
        t: f64,
        h: f64,
    ) -> Result<(), S::Error> {
        for (j, (x, f)) in work.x0.iter().zip(&self.f0).enumerate() {
            self.steps[j] = increment(*x, h * f, self.sizes[j]);
        }
        let at = At { x: &work.x0, f: &self.f0, steps: &self.steps };
        if !system.jacobian(t, &at, &mut self.jacobian)? {
            self.differences(system, work, t)?;
        }
        if !system.time_derivative(t, &work.x0, &mut self.slope)? {
            let step = look_ahead(t, h);
            system.derivatives(t + step, &work.x0, &mut self.slope)?;
            for (s, f) in self.slope.iter_mut().zip(&self.f0) {
                *s = (*s - f) / step;
            }
        }
        Ok(())
    }

    /// Computes ∂f/∂x by one-sided differences, n evaluations.
    fn differences<S: System>(
        &mut self,
        system: &mut S,
        work: &mut Work,
        t: f64,
    ) -> Result<(), S::Error> {
        let n = self.f0.len();
        let Work { x0, stage, error: f, .. } = work;
        stage.copy_from_slice(x0);
        for j in 0..n {
            let step = self.steps[j];
            stage[j] = x0[j] + step;
            system.derivatives(t, stage, f)?;
            stage[j] = x0[j];
            for i in 0..n {
                self.jacobian[i * n + j] = (f[i] - self.f0[i]) / step;
            }
        }
        Ok(())
    }
}

/// Minimum size of a lane without further information (RODAS of Hairer has √ε √1e-5, too).
pub(crate) const SIZE: f64 = 3e-3;

/// Returns the increment of a finite difference: √ε times the lane's size, which is the largest of its value, its change in a step and `least`. It
/// points in the direction of the lane's motion, so that a lane does not leave its valid range. It is exactly representable.
fn increment(x: f64, change: f64, least: f64) -> f64 {
    let change = if change.is_finite() { change } else { 0.0 };
    let size = x.abs().max(change.abs()).max(least);
    let step = (f64::EPSILON.sqrt() * size).copysign(change);
    (x + step) - x
}

/// Returns the increment of the finite difference in time: √ε times t or h, at most a tenth of the step. The round-off error ε f / increment is
/// multiplied by h.
fn look_ahead(t: f64, h: f64) -> f64 {
    let most = (f64::EPSILON.sqrt() * t.abs().max(h.abs())).min(0.1 * h.abs());
    let step = most.max(4.0 * f64::EPSILON * t.abs()).copysign(h);
    (t + step) - t
}

/// Returns the interpolant of each uᵢ in Bernstein form: (m + h₁)/3, (2m + h₁ + h₂)/3, m.
pub(crate) fn bezier(table: &Rosenbrock) -> Vec<[f64; 3]> {
    let [h1, h2] = table.dense;
    let row = |i: usize| {
        let (m, h1, h2) = (table.m[i], h1[i], h2[i]);
        [(m + h1) / 3.0, (2.0 * m + h1 + h2) / 3.0, m]
    };
    (0..table.m.len()).map(row).collect()
}
