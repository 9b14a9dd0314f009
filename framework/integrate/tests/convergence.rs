//! Measured orders on nonlinear nonautonomous problems: steps, dense output, adaptive accuracy.
#![allow(clippy::unwrap_used)]
mod common;
use common::{Ode, control, coupled, coupled_solution, distance, largest, through};
use linkwork_integrate::{Integrator, METHODS, Memory, Method};

/// Steps for which the error is far from rounding and in the asymptotic range.
fn steps(method: &Method) -> [u32; 3] {
    match method.order() {
        1 => [400, 800, 1600],
        3 => [60, 120, 240],
        4 => [60, 120, 240],
        5 => [30, 60, 120],
        _ => [5, 7, 10],
    }
}

fn short(errors: &[f64]) -> String {
    errors.iter().map(|e| format!("{e:.1e}")).collect::<Vec<_>>().join(" ")
}

#[test]
fn every_method_has_its_order() {
    for method in METHODS {
        // The largest error of all steps.
        let error = |n: u32| {
            let (mut x, h) = (coupled_solution(0.0), 3.0 / f64::from(n));
            let mut integrator = Integrator::new(method, 2);
            let one = |k: u32| {
                let t = f64::from(k) * h;
                integrator.step_fixed(&mut Ode(coupled), t, h, &mut x, None).unwrap();
                distance(&x, &coupled_solution(t + h))
            };
            largest((0..n).map(one))
        };
        let n = steps(&method);
        let e = n.map(error);
        let rate =
            |i: usize, j: usize| (e[i] / e[j]).ln() / (f64::from(n[j]) / f64::from(n[i])).ln();
        let (name, p, all) = (method.name(), f64::from(method.order()), rate(0, 2));
        let (one, two) = (rate(0, 1), rate(1, 2));
        println!("{name}: order {p}, measured {all:.2} ({one:.2}, {two:.2}), errors {}", short(&e));
        // Measured within 0.35 of the order.
        assert!((all - p).abs() < 0.5, "{name}: {all}, errors {e:?}");
    }
}

/// The error of the interpolant of one step from an exact start is O(h^(q+1)).
#[test]
fn every_dense_output_has_its_order() {
    for method in METHODS {
        let mut integrator = Integrator::new(method, 2);
        let mut error = |h: f64| {
            let t = 0.4;
            let mut x = coupled_solution(t);
            integrator.step_fixed(&mut Ode(coupled), t, h, &mut x, None).unwrap();
            let dense = integrator.dense(&mut Ode(coupled)).unwrap();
            let mut out = [0.0; 2];
            let at = |i: u32| {
                let theta = f64::from(i) / 17.0;
                dense.at(theta, &mut out);
                distance(&out, &coupled_solution(t + theta * h))
            };
            largest((1..17).map(at))
        };
        let (name, q) = (method.name(), f64::from(method.dense_order()));
        let h = if q > 5.0 { [0.8, 0.4, 0.2] } else { [0.1, 0.05, 0.025] };
        let e = h.map(&mut error);
        let rates = [(e[0] / e[1]).log2(), (e[1] / e[2]).log2()];
        println!("{name}: dense order {q}, measured {rates:.2?} − 1, errors {}", short(&e));
        // Measured within 0.4.
        assert!((rates[1] - q - 1.0).abs() < 0.6, "{name}: {rates:?}, errors {e:?}");
    }
}

/// A hundredth of the tolerance makes between 1/30 and 1/300 of the error, which stays within 100 times the tolerance.
#[test]
fn errors_follow_the_tolerance() {
    for method in METHODS.into_iter().filter(|m| m.error_order() > 0) {
        let error = |tolerance: f64| {
            let mut x = coupled_solution(0.0);
            let settings = control(method, 2, tolerance, tolerance);
            let mut integrator = Integrator::new(method, 2);
            let count = through(
                &mut integrator,
                &settings,
                &mut Ode(coupled),
                &[0.0, 3.0],
                &mut x,
                &mut Memory::default(),
            );
            (distance(&x, &coupled_solution(3.0)), count.unwrap())
        };
        let name = method.name();
        for tolerance in [1e-5, 1e-7, 1e-9] {
            let (e, count) = error(tolerance);
            println!("{name} at {tolerance:.0e}: error {e:.1e}, {count:?}");
            assert!(e < 100.0 * tolerance, "{name} at {tolerance:e}: {e:e}");
            let (tight, more) = error(tolerance * 1e-2);
            assert!(tight < e / 5.0, "{name} at {tolerance:e}: {e:e}, then {tight:e}");
            assert!(more.steps > count.steps, "{name}: {count:?} {more:?}");
        }
    }
}
