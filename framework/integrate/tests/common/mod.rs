//! Systems with known solutions, and drivers for them.
#![allow(dead_code)]
use linkwork_integrate::{
    Accepted, Control, Failure, Integrator, Limits, Memory, Method, Norm, System, Tolerances,
};
use std::convert::Infallible;

/// A system given by a closure.
pub struct Ode<F>(pub F);

impl<F: FnMut(f64, &[f64], &mut [f64])> System for Ode<F> {
    type Error = Infallible;
    fn derivatives(&mut self, t: f64, x: &[f64], xdot: &mut [f64]) -> Result<(), Infallible> {
        (self.0)(t, x, xdot);
        Ok(())
    }
}

/// Nonlinear, nonautonomous, coupled, with a closed form.
///
/// ```text
/// ẋ = −x² cos t − (y − tan(t/3)) x      x = 1 / (1/x₀ + sin t)
/// ẏ = (1 + y²)/3 + (x (1/x₀ + sin t) − 1)       y = tan(t/3)
/// ```
pub fn coupled(t: f64, x: &[f64], d: &mut [f64]) {
    let held = x[0] * (1.0 / 1.3 + 1.0 + t.sin()) - 1.0;
    d[0] = -x[0] * x[0] * t.cos() - (x[1] - (t / 3.0).tan()) * x[0];
    d[1] = (1.0 + x[1] * x[1]) / 3.0 + held;
}

/// Returns its solution.
pub fn coupled_solution(t: f64) -> [f64; 2] {
    [1.0 / (1.0 / 1.3 + 1.0 + t.sin()), (t / 3.0).tan()]
}

/// Returns the largest difference; keeps NaN.
pub fn distance(a: &[f64], b: &[f64]) -> f64 {
    assert_eq!(a.len(), b.len());
    largest(a.iter().zip(b).map(|(a, b)| (a - b).abs()))
}

/// Returns the largest value; keeps NaN.
pub fn largest(values: impl Iterator<Item = f64>) -> f64 {
    values.fold(0.0, |m, v| if v > m || v.is_nan() { v } else { m })
}

/// Makes `steps` equal steps from t0 to t1.
pub fn fixed<S: System>(
    method: Method,
    system: &mut S,
    (t0, t1): (f64, f64),
    steps: u32,
    x: &mut [f64],
) -> Result<(), Failure<S::Error>> {
    let mut integrator = Integrator::new(method, x.len());
    let h = (t1 - t0) / f64::from(steps);
    for k in 0..steps {
        integrator.step_fixed(system, t0 + f64::from(k) * h, h, x, None)?;
    }
    Ok(())
}

/// Counts of an adaptive run.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Count {
    pub steps: u32,
    pub rejections: u32,
    pub smallest: f64,
    pub largest: f64,
}

/// Settings with uniform tolerances.
pub fn control(method: Method, n: usize, abs: f64, rel: f64) -> Control {
    let tolerances = Tolerances::uniform(n, abs, rel).unwrap();
    Control::new(method, tolerances, Norm::Rms, Limits::default()).unwrap()
}

/// Makes adaptive steps through the given times, and passes k₁ on if the method computes it.
pub fn through<S: System>(
    integrator: &mut Integrator,
    control: &Control,
    system: &mut S,
    times: &[f64],
    x: &mut [f64],
    memory: &mut Memory,
) -> Result<Count, Failure<S::Error>> {
    let mut count = Count { smallest: f64::INFINITY, ..Count::default() };
    let mut k1: Option<Vec<f64>> = None;
    for pair in times.windows(2) {
        let mut t = pair[0];
        loop {
            let left = pair[1] - t;
            let step: Accepted =
                integrator.advance(system, control, t, left, x, k1.as_deref(), memory)?;
            k1 = integrator.end_derivatives().map(<[f64]>::to_vec);
            count.steps += 1;
            count.rejections += step.rejections;
            count.smallest = count.smallest.min(step.h);
            count.largest = count.largest.max(step.h);
            t += step.h;
            if step.end {
                break;
            }
        }
    }
    Ok(count)
}
