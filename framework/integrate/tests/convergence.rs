//! Measured orders on nonlinear nonautonomous problems: steps, dense output, adaptive accuracy.
use crate::common::{Ode, control, coupled, coupled_solution, distance, fixed, largest, through};
use linkwork_integrate::{Integrator, METHODS, Memory, Method, System};
use std::convert::Infallible;

/// Numbers of steps for which the error is far from round-off and in the asymptotic range.
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
        // Returns the largest error of all steps.
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
        // Measured: within 0.35 of the order.
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
        // Measured: within 0.4.
        assert!((rates[1] - q - 1.0).abs() < 0.6, "{name}: {rates:?}, errors {e:?}");
    }
}

/// A free top: Euler's equations and a quaternion (w, x, y, z; x, y, z; body rates last), normalized after every step.
struct FreeTop;

impl System for FreeTop {
    type Error = Infallible;
    fn derivatives(&mut self, _: f64, x: &[f64], d: &mut [f64]) -> Result<(), Infallible> {
        let ([w, i, j, k], [p, q, r]) = ([x[0], x[1], x[2], x[3]], [x[4], x[5], x[6]]);
        d[0] = 0.5 * (-i * p - j * q - k * r);
        d[1] = 0.5 * (w * p + j * r - k * q);
        d[2] = 0.5 * (w * q + k * p - i * r);
        d[3] = 0.5 * (w * r + i * q - j * p);
        let [a, b, c] = INERTIA;
        (d[4], d[5], d[6]) = ((b - c) / a * q * r, (c - a) / b * r * p, (a - b) / c * p * q);
        Ok(())
    }
    fn project(&mut self, _: f64, x: &mut [f64]) -> Result<(), Infallible> {
        let length = x[..4].iter().map(|v| v * v).sum::<f64>().sqrt();
        x[..4].iter_mut().for_each(|v| *v /= length);
        Ok(())
    }
}

const INERTIA: [f64; 3] = [1.3, 2.1, 2.9];

/// Angular momentum in space, which a free top conserves.
fn momentum(x: &[f64]) -> [f64; 3] {
    let l = [INERTIA[0] * x[4], INERTIA[1] * x[5], INERTIA[2] * x[6]];
    let cross = |a: [f64; 3], b: [f64; 3]| {
        [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
    };
    let axis = [x[1], x[2], x[3]];
    let once = cross(axis, l);
    let twice = cross(axis, once);
    std::array::from_fn(|i| l[i] + 2.0 * (x[0] * once[i] + twice[i]))
}

/// The projection onto unit quaternions does not reduce the order of any method; checks angular momentum in space.
#[test]
fn attitude_keeps_the_order_under_projection() {
    for method in METHODS.into_iter().filter(|m| m.order() > 1) {
        let start = [1.0, 0.0, 0.0, 0.0, 0.7, 1.1, -0.4];
        let error = |n: u32| {
            let mut x = start;
            fixed(method, &mut FreeTop, (0.0, 4.0), n, &mut x).unwrap();
            assert!((x[..4].iter().map(|v| v * v).sum::<f64>() - 1.0).abs() < 1e-14);
            distance(&momentum(&x), &momentum(&start))
        };
        let n = if method.order() > 5 { 10 } else { 80 };
        let (a, b) = (error(n), error(2 * n));
        let (rate, p, name) = ((a / b).log2(), f64::from(method.order()), method.name());
        println!("{name}: order {p}, measured {rate:.2}, errors {a:.1e} {b:.1e}");
        assert!(rate > p - 0.5 && rate < p + 1.5, "{name}: {a:e} {b:e} {rate}");
    }
}

/// A hundredth of the tolerance gives less than a fifth of the error, which stays within 100 times the tolerance.
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
