//! Dense output: bit-identical ends, continuity between steps, single lanes, projections, derivatives.
use crate::common;
use common::{Ode, coupled, coupled_solution, distance};
use linkwork_integrate::{Failure, Integrator, METHODS, System};
use std::convert::Infallible;

const THETAS: [f64; 7] = [1e-9, 0.1, 0.37, 0.5, 0.81, 0.999, 1.0 - 1e-12];

#[test]
fn ends_are_exact_and_single_lanes_have_the_bits_of_all() {
    for method in METHODS {
        let mut integrator = Integrator::new(method, 2);
        let mut x = coupled_solution(0.3);
        let x0 = x;
        integrator.step_fixed(&mut Ode(coupled), 0.3, 0.2, &mut x, None).unwrap();
        let dense = integrator.dense(&mut Ode(coupled)).unwrap();
        assert_eq!((dense.t(), dense.h()), (0.3, 0.2));
        let mut out = [0.0; 2];
        for (theta, end) in [(0.0, x0), (1.0, x)] {
            dense.at(theta, &mut out);
            assert_eq!(out.map(f64::to_bits), end.map(f64::to_bits), "{}", method.name());
        }
        for theta in THETAS.into_iter().chain([0.0, 1.0]) {
            dense.at(theta, &mut out);
            let lanes = [dense.lane(theta, 0), dense.lane(theta, 1)];
            assert_eq!(out.map(f64::to_bits), lanes.map(f64::to_bits), "{}", method.name());
        }
        // Dense output is continuous at the ends.
        dense.at(1e-13, &mut out);
        assert!(distance(&out, &x0) < 1e-12, "{}", method.name());
        dense.at(1.0 - 1e-13, &mut out);
        assert!(distance(&out, &x) < 1e-12, "{}", method.name());
    }
}

/// Repeating a step with another length is bit-identical with a step of that length from the same start, also after dense output.
#[test]
fn a_step_again_has_the_bits_of_a_step_of_that_length() {
    for method in METHODS {
        let mut integrator = Integrator::new(method, 2);
        let start = coupled_solution(0.3);
        let mut x = start;
        let none = integrator.again(&mut Ode(coupled), (0.3, 0.1), &mut x);
        assert_eq!((none, x), (Err(Failure::NoStep), start), "{}", method.name());
        integrator.step_fixed(&mut Ode(coupled), 0.3, 0.2, &mut x, None).unwrap();
        for h in [0.07, 0.2, 0.001] {
            integrator.dense(&mut Ode(coupled)).unwrap().at(0.4, &mut x);
            integrator.again(&mut Ode(coupled), (0.3, h), &mut x).unwrap();
            let mut fresh = start;
            let mut other = Integrator::new(method, 2);
            other.step_fixed(&mut Ode(coupled), 0.3, h, &mut fresh, None).unwrap();
            assert_eq!(x.map(f64::to_bits), fresh.map(f64::to_bits), "{} {h}", method.name());
        }
    }
}

/// A planar pendulum as a unit vector and a rate; the projection normalizes the vector.
struct OnCircle;

impl System for OnCircle {
    type Error = Infallible;
    fn derivatives(&mut self, _: f64, x: &[f64], d: &mut [f64]) -> Result<(), Infallible> {
        d[0] = -x[2] * x[1];
        d[1] = x[2] * x[0];
        d[2] = -9.81 * x[0];
        Ok(())
    }
    fn project(&mut self, _: f64, x: &mut [f64]) -> Result<(), Infallible> {
        let length = x[0].hypot(x[1]);
        x[0] /= length;
        x[1] /= length;
        Ok(())
    }
}

/// The displacement of a projection is distributed over the step: the ends stay exact, and the order is kept.
#[test]
fn projections_join_and_keep_the_order() {
    for method in METHODS.into_iter().filter(|m| m.order() > 1) {
        let miss = |h: f64| {
            let mut x = [0.6, -0.8, 1.3];
            let mut integrator = Integrator::new(method, 3);
            integrator.step_fixed(&mut OnCircle, 0.0, h, &mut x, None).unwrap();
            assert!((x[0].hypot(x[1]) - 1.0).abs() < 1e-15);
            let dense = integrator.dense(&mut OnCircle).unwrap();
            let mut out = [0.0; 3];
            dense.at(1.0, &mut out);
            assert_eq!(out, x, "{}", method.name());
            dense.at(1.0 - 1e-13, &mut out);
            assert!(distance(&out, &x) < 1e-12, "{}", method.name());
            // Compare with many small steps.
            let mut exact = [0.6, -0.8, 1.3];
            let steps = 400;
            common::fixed(
                linkwork_integrate::Method::by_name("verner-87").unwrap(),
                &mut OnCircle,
                (0.0, 0.6 * h),
                steps,
                &mut exact,
            )
            .unwrap();
            dense.at(0.6, &mut out);
            distance(&out, &exact)
        };
        let q = f64::from(method.dense_order());
        let (a, b) = (miss(0.1), miss(0.05));
        let rate = (a / b).log2();
        println!("{}: {a:.1e} {b:.1e}, order {rate:.2}", method.name());
        // Measured: within 0.5; some methods are better.
        assert!(rate > q + 0.4 && rate < q + 2.6, "{}: {a:e} {b:e} {rate}", method.name());
    }
}

/// Hermite-like interpolants have the derivatives f at both ends.
#[test]
fn slopes_at_the_ends_are_f() {
    for method in METHODS.into_iter().filter(|m| m.order() > 1) {
        let mut x = coupled_solution(0.3);
        let mut first = [0.0; 2];
        coupled(0.3, &x, &mut first);
        let mut integrator = Integrator::new(method, 2);
        let h = 0.01;
        integrator.step_fixed(&mut Ode(coupled), 0.3, h, &mut x, None).unwrap();
        let mut last = [0.0; 2];
        coupled(0.3 + h, &x, &mut last);
        let dense = integrator.dense(&mut Ode(coupled)).unwrap();
        let e = 1e-5;
        for i in 0..2 {
            let start = (dense.lane(e, i) - dense.lane(0.0, i)) / (e * h);
            let end = (dense.lane(1.0, i) - dense.lane(1.0 - e, i)) / (e * h);
            // At this step size, the error of the step is at most 1e-9, and the error of the difference
            // quotients is 1e-7.
            assert!((start - first[i]).abs() < 1e-5, "{}: {start} {}", method.name(), first[i]);
            assert!((end - last[i]).abs() < 1e-5, "{}: {end} {}", method.name(), last[i]);
        }
    }
}

/// Without a projection the end is not copied but recomputed, bit-identical.
#[test]
fn ends_are_exact_without_a_projection() {
    struct Free;
    impl System for Free {
        type Error = Infallible;
        fn derivatives(&mut self, t: f64, x: &[f64], d: &mut [f64]) -> Result<(), Infallible> {
            coupled(t, x, d);
            Ok(())
        }
        fn projects(&self) -> bool {
            false
        }
    }
    for method in METHODS {
        let mut integrator = Integrator::new(method, 2);
        let mut x = coupled_solution(0.3);
        for k in 0..3 {
            let (t, x0) = (0.3 + 0.1 * f64::from(k), x);
            let mut k1 = [0.0; 2];
            coupled(t, &x, &mut k1);
            integrator.step_fixed(&mut Free, t, 0.1, &mut x, Some(&k1)).unwrap();
            let dense = integrator.dense(&mut Free).unwrap();
            assert_eq!([dense.lane(0.0, 0), dense.lane(0.0, 1)], x0, "{}", method.name());
            assert_eq!([dense.lane(1.0, 0), dense.lane(1.0, 1)], x, "{}", method.name());
        }
    }
}

/// The displacement of a projection is distributed with zero derivative at the ends.
#[test]
fn projections_leave_the_slopes_at_the_ends() {
    struct Pushed;
    impl System for Pushed {
        type Error = Infallible;
        fn derivatives(&mut self, _: f64, _: &[f64], d: &mut [f64]) -> Result<(), Infallible> {
            d[0] = 2.0;
            Ok(())
        }
        fn project(&mut self, _: f64, x: &mut [f64]) -> Result<(), Infallible> {
            x[0] += 1e-3;
            Ok(())
        }
    }
    for method in METHODS.into_iter().filter(|m| m.order() > 1) {
        let mut integrator = Integrator::new(method, 1);
        integrator.step_fixed(&mut Pushed, 0.0, 1.0, &mut [1.0], None).unwrap();
        let dense = integrator.dense(&mut Pushed).unwrap();
        let push = |theta: f64| dense.lane(theta, 0) - (1.0 + 2.0 * theta);
        assert!(push(1e-3).abs() < 1e-8 && (push(0.999) - 1e-3).abs() < 1e-8, "{}", method.name());
        assert!((push(0.5) - 5e-4).abs() < 1e-12, "{}", method.name());
    }
}

#[test]
#[should_panic(expected = "outside the step")]
fn outside_the_step_is_refused() {
    let mut integrator = Integrator::new(METHODS[2], 1);
    let mut decay = Ode(|_: f64, x: &[f64], d: &mut [f64]| d[0] = -x[0]);
    integrator.step_fixed(&mut decay, 0.0, 0.1, &mut [1.0], None).unwrap();
    integrator.dense(&mut decay).unwrap().lane(1.5, 0);
}
