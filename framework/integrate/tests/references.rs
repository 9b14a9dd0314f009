//! External and analytic references: conserved energy, Arenstorf's orbit, stiff problems, another library.
use crate::common::{Ode, control, distance, fixed, largest, through};
use linkwork_integrate::{
    At, Control, Integrator, Limits, METHODS, Memory, Method, Norm, System, Tolerances,
};
use std::convert::Infallible;

fn named(name: &str) -> Method {
    Method::by_name(name).unwrap()
}

/// Two bodies in a plane, μ = 1: (x, y, ẋ, ẏ).
fn kepler(_: f64, x: &[f64], d: &mut [f64]) {
    let r3 = (x[0] * x[0] + x[1] * x[1]).powf(1.5);
    (d[0], d[1], d[2], d[3]) = (x[2], x[3], -x[0] / r3, -x[1] / r3);
}

fn kepler_energy(x: &[f64]) -> f64 {
    0.5 * (x[2] * x[2] + x[3] * x[3]) - 1.0 / x[0].hypot(x[1])
}

/// Periapsis of an ellipse of eccentricity e and unit major half-axis.
fn periapsis(e: f64) -> [f64; 4] {
    [1.0 - e, 0.0, 0.0, ((1.0 + e) / (1.0 - e)).sqrt()]
}

/// A hundred revolutions at e = 0.6: energy and angular momentum conserved, and the start reached again.
#[test]
fn orbits_keep_their_energy() {
    let method = named("verner-87");
    let settings = control(method, 4, 1e-13, 1e-13);
    let mut x = periapsis(0.6);
    let (start, energy) = (x, kepler_energy(&x));
    let mut memory = Memory::START;
    let times: Vec<f64> = (0..=100).map(|k| std::f64::consts::TAU * f64::from(k)).collect();
    let mut integrator = Integrator::new(method, 4);
    let count =
        through(&mut integrator, &settings, &mut Ode(kepler), &times, &mut x, &mut memory).unwrap();
    let drift = (kepler_energy(&x) / energy - 1.0).abs();
    let momentum = (x[0] * x[3] - x[1] * x[2]) / (start[0] * start[3]) - 1.0;
    let miss = distance(&x, &start);
    println!("energy {drift:.1e}, momentum {momentum:.1e}, closure {miss:.1e}, {count:?}");
    // Measured: 9e-12, 4e-12 and 3e-8 in 9 001 steps.
    assert!(drift < 3e-11 && momentum.abs() < 1e-11 && miss < 1e-7);
}

/// The energy of a fixed-step harmonic oscillator decreases with the order of the method plus one (odd orders) or two, measured over one revolution.
#[test]
fn oscillators_lose_energy_at_the_method_s_order() {
    let spring = |_: f64, x: &[f64], d: &mut [f64]| (d[0], d[1]) = (x[1], -x[0]);
    for method in METHODS.into_iter().filter(|m| m.order() > 1) {
        let drift = |n: u32| {
            let mut x = [0.8, -0.6];
            fixed(method, &mut Ode(spring), (0.0, 5.0), n, &mut x).unwrap();
            (x[0] * x[0] + x[1] * x[1] - 1.0).abs()
        };
        let n = if method.order() > 5 { 8 } else { 40 };
        let (a, b) = (drift(n), drift(2 * n));
        let (rate, p) = ((a / b).log2(), f64::from(method.order()));
        println!("{}: {a:.1e} {b:.1e}, order {rate:.2}", method.name());
        assert!(rate > p - 0.4 && rate < p + 1.6, "{}: {a:e} {b:e} {rate}", method.name());
    }
}

/// Semi-implicit Euler's energy error is bounded, explicit Euler's grows without limit.
#[test]
fn semi_implicit_euler_bounds_the_energy() {
    struct Spring;
    impl System for Spring {
        type Error = Infallible;
        fn derivatives(&mut self, _: f64, x: &[f64], d: &mut [f64]) -> Result<(), Infallible> {
            (d[0], d[1], d[2]) = (x[2], x[0], -x[0]);
            Ok(())
        }
        fn positions(&self) -> &[std::ops::Range<usize>] {
            &[0..1, 1..2]
        }
        fn retract(&mut self, x: &mut [f64], xdot: &[f64], h: f64) -> Result<(), Infallible> {
            // Lane 0 is a position. Lane 1 is a filter of the position, which moves with its own
            // derivative.
            x[0] += h * x[2];
            x[1] += h * xdot[1];
            Ok(())
        }
    }
    let run = |method: &str| {
        let mut integrator = Integrator::new(named(method), 3);
        let mut x = [1.0, 0.0, 0.0];
        let energy = (0..20_000).map(|k| {
            let t = f64::from(k) * 0.01;
            integrator.step_fixed(&mut Spring, t, 0.01, &mut x, None).unwrap();
            (x[0] * x[0] + x[2] * x[2] - 1.0).abs()
        });
        largest(energy)
    };
    let (semi, explicit) = (run("semi-implicit-euler"), run("euler"));
    println!("semi-implicit {semi:.1e}, explicit {explicit:.1e}");
    // Measured: 5.0e-3 (h/2) and 6.4.
    assert!(semi < 6e-3 && explicit > 1.0);
    // Compute one step by hand: first the velocity, then the position with the new velocity, and the
    // filter with the old position.
    let mut x = [1.0, 0.0, 0.5];
    Integrator::new(named("semi-implicit-euler"), 3)
        .step_fixed(&mut Spring, 0.0, 0.1, &mut x, None)
        .unwrap();
    assert_eq!(x, [1.0 + 0.1 * (0.5 - 0.1), 0.1, 0.5 - 0.1]);
}

/// Arenstorf's orbit closes after one period (Hairer, Nørsett, Wanner I, section II.0).
#[test]
fn arenstorf_closes() {
    const MU: f64 = 0.012277471;
    const PERIOD: f64 = 17.0652165601579625588917206249;
    let arenstorf = |_: f64, x: &[f64], d: &mut [f64]| {
        let nu = 1.0 - MU;
        let d1 = ((x[0] + MU).powi(2) + x[1] * x[1]).powf(1.5);
        let d2 = ((x[0] - nu).powi(2) + x[1] * x[1]).powf(1.5);
        d[0] = x[2];
        d[1] = x[3];
        d[2] = x[0] + 2.0 * x[3] - nu * (x[0] + MU) / d1 - MU * (x[0] - nu) / d2;
        d[3] = x[1] - 2.0 * x[2] - nu * x[1] / d1 - MU * x[1] / d2;
    };
    let start = [0.994, 0.0, 0.0, -2.00158510637908252240537862224];
    for (name, tolerance, bound) in
        [("dormand-prince-54", 1e-11, 1e-4), ("verner-87", 1e-12, 1e-6), ("verner-87", 1e-14, 1e-7)]
    {
        let method = named(name);
        let settings = control(method, 4, tolerance, tolerance);
        let (mut x, mut memory) = (start, Memory::START);
        let mut integrator = Integrator::new(method, 4);
        let times = [0.0, PERIOD];
        let mut system = Ode(arenstorf);
        let count =
            through(&mut integrator, &settings, &mut system, &times, &mut x, &mut memory).unwrap();
        let miss = distance(&x[..2], &start[..2]);
        println!("{name} at {tolerance:.0e}: {miss:.1e}, {count:?}");
        assert!(miss < bound, "{name} at {tolerance:e}: {miss:e}");
    }
}

/// Prothero and Robinson's problem: slow solution, stiffness λ. An L-stable method follows it with steps that do not depend on λ.
#[test]
fn stiffness_does_not_shorten_steps() {
    let method = named("rodas-4p");
    let mut steps = Vec::new();
    for lambda in [1e2, 1e5, 1e8] {
        let mut system =
            Ode(|t: f64, x: &[f64], d: &mut [f64]| d[0] = -lambda * (x[0] - t.cos()) - t.sin());
        let settings = control(method, 1, 1e-7, 1e-7);
        let (mut x, mut memory) = ([1.0], Memory::START);
        let mut integrator = Integrator::new(method, 1);
        let times = [0.0, 10.0];
        let count =
            through(&mut integrator, &settings, &mut system, &times, &mut x, &mut memory).unwrap();
        let error = (x[0] - 10.0_f64.cos()).abs();
        println!("λ = {lambda:.0e}: error {error:.1e}, {count:?}");
        assert!(error < 1e-6, "λ = {lambda:e}: {error:e}");
        steps.push(count.steps);
    }
    // Measured: 87, 19 and 9 steps.
    assert!(steps.iter().all(|n| *n < 150), "{steps:?}");
    // Take one step of a million time constants: the fast component vanishes at once. A method that is only A-stable
    // would leave ±1 of it.
    let mut fast = Ode(|_: f64, x: &[f64], d: &mut [f64]| d[0] = -1e6 * x[0]);
    let mut x = [1.0];
    Integrator::new(method, 1).step_fixed(&mut fast, 0.0, 1.0, &mut x, None).unwrap();
    assert!(x[0].abs() < 1e-4, "{}", x[0]);
}

/// Robertson's kinetics to t = 1e11 (Hairer, Wanner II, test set ROBER; reference from there).
#[test]
fn robertson_s_kinetics() {
    struct Robertson {
        analytic: bool,
    }
    impl System for Robertson {
        type Error = Infallible;
        fn derivatives(&mut self, _: f64, x: &[f64], d: &mut [f64]) -> Result<(), Infallible> {
            d[0] = -0.04 * x[0] + 1e4 * x[1] * x[2];
            d[2] = 3e7 * x[1] * x[1];
            d[1] = -d[0] - d[2];
            Ok(())
        }
        fn jacobian(&mut self, _: f64, at: &At<'_>, out: &mut [f64]) -> Result<bool, Infallible> {
            let x = at.x;
            let (a, b) = (1e4 * x[2], 1e4 * x[1]);
            let c = 6e7 * x[1];
            out.copy_from_slice(&[-0.04, a, b, 0.04, -a - c, -b, 0.0, c, 0.0]);
            Ok(self.analytic)
        }
    }
    const END: [f64; 3] = [0.2083340149701255e-7, 0.8333360770334713e-13, 0.9999999791665050];
    let method = named("rodas-4p");
    for analytic in [true, false] {
        let tolerances = Tolerances::new(vec![1e-12, 1e-16, 1e-10], vec![1e-8; 3]).unwrap();
        let settings = Control::new(method, tolerances, Norm::Rms, Limits::default()).unwrap();
        let (mut x, mut memory) = ([1.0, 0.0, 0.0], Memory::START);
        let mut integrator = Integrator::new(method, 3);
        let times = [0.0, 1e11];
        let mut system = Robertson { analytic };
        let count =
            through(&mut integrator, &settings, &mut system, &times, &mut x, &mut memory).unwrap();
        let error = largest((0..3).map(|i| (x[i] / END[i] - 1.0).abs()));
        println!("analytic {analytic}: relative error {error:.1e}, {count:?}, {x:?}");
        assert!(error < 1e-4 && count.steps < 2000, "{analytic}: {error:e} {count:?}");
        assert!((x.iter().sum::<f64>() - 1.0).abs() < 1e-9);
    }
}

/// Van der Pol's relaxation oscillation in the time of the slow motion, μ² = 1/ε (VDPOL of
/// Hairer, Wanner II at ε = 1e-6: reference from the test set).
#[test]
fn van_der_pol_at_a_million() {
    let method = named("rodas-4p");
    let run = |eps: f64, tolerance: f64| {
        let mut system = Ode(move |_: f64, x: &[f64], d: &mut [f64]| {
            (d[0], d[1]) = (x[1], ((1.0 - x[0] * x[0]) * x[1] - x[0]) / eps);
        });
        let settings = control(method, 2, tolerance, tolerance);
        let (mut x, mut memory) = ([2.0, 0.0], Memory::START);
        let mut integrator = Integrator::new(method, 2);
        let times = [0.0, 2.0];
        let count =
            through(&mut integrator, &settings, &mut system, &times, &mut x, &mut memory).unwrap();
        (x, count)
    };
    let (x, count) = run(1e-6, 1e-7);
    let reference = [0.1706167732170483e1, -0.8928097010247975];
    let error = distance(&x, &reference);
    println!("ε = 1e-6: error {error:.1e}, {count:?}");
    assert!(error < 1e-5 && count.steps < 5000, "{x:?} {count:?}");
    // Compare less stiff problems with the result at a tighter tolerance.
    for eps in [1e-3, 1e-4, 1e-5] {
        let ((loose, _), (tight, _)) = (run(eps, 1e-6), run(eps, 1e-9));
        let error = distance(&loose, &tight);
        println!("ε = {eps:.0e}: {error:.1e}");
        assert!(error < 1e-2, "ε = {eps:e}: {loose:?} {tight:?}");
    }
}

/// Another library's DOP853 on the same nonlinear problem.
#[test]
fn another_library_agrees() {
    use differential_equations::prelude::*;
    struct Lorenz;
    impl ODE<f64, [f64; 3]> for Lorenz {
        fn diff(&self, t: f64, y: &[f64; 3], dydt: &mut [f64; 3]) {
            lorenz(t, y, dydt);
        }
    }
    fn lorenz(_: f64, x: &[f64], d: &mut [f64]) {
        d[0] = 10.0 * (x[1] - x[0]);
        d[1] = x[0] * (28.0 - x[2]) - x[1];
        d[2] = x[0] * x[1] - 8.0 / 3.0 * x[2];
    }
    let start = [1.0, 1.2, 0.9];
    let solution = IVP::ode(&Lorenz, 0.0, 5.0, start)
        .method(ExplicitRungeKutta::dop853().rtol(1e-12).atol(1e-12))
        .solve()
        .unwrap();
    let theirs = solution.y.last().unwrap();
    for (name, tolerance) in
        [("verner-87", 1e-12), ("dormand-prince-54", 1e-11), ("rodas-4p", 1e-9)]
    {
        let method = named(name);
        let settings = control(method, 3, tolerance, tolerance);
        let (mut x, mut memory) = (start, Memory::START);
        let mut integrator = Integrator::new(method, 3);
        let mut system = Ode(lorenz);
        let times = [0.0, 5.0];
        let count =
            through(&mut integrator, &settings, &mut system, &times, &mut x, &mut memory).unwrap();
        let apart = distance(&x, theirs);
        println!("{name} at {tolerance:.0e}: {apart:.1e} apart, {count:?}");
        // Lorenz multiplies errors by about 100 in this time.
        assert!(apart < 1e4 * tolerance, "{name}: {x:?} {theirs:?}");
    }
}
