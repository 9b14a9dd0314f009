//! Contact solvers compared with each other and with energy: identities and conservation.

use crate::support::*;
use linkwork_solvers::contact::{Cone, Contact, Method, Settings};

/// Largest difference of velocities after, relative to the largest |b|.
fn apart(case: &Case, x: &[[f64; 4]], y: &[[f64; 4]]) -> f64 {
    let (u, v) = (case.velocities(x), case.velocities(y));
    let scale = case.b.iter().flatten().fold(0.0f64, |m, b| m.max(b.abs()));
    let mut most = 0.0;
    for (u, v) in u.iter().flatten().zip(v.iter().flatten()) {
        let d = (u - v).abs() / scale;
        if !(d <= most) {
            most = d;
        }
    }
    most
}

/// Few rows on many degrees of freedom and moderate friction: one solution.
#[test]
fn gauss_seidel_and_newton_agree_where_the_solution_is_unique() {
    for seed in 0..12 {
        for case in [random(seed, 40, 10, 12, coulomb), random(seed, 60, 15, 14, mixed)] {
            let (x, a) = case.solve(Method::GaussSeidel, 1e-12);
            let (y, b) = case.solve(Method::Newton, 1e-12);
            assert!(a.converged && b.converged, "seed {seed}: {a:?} {b:?}");
            let apart = apart(&case, &x, &y);
            // Measured: 1.3e-12.
            assert!(apart < 1e-9, "seed {seed}: {apart:e}");
        }
    }
}

#[test]
fn every_large_problem_is_solved_by_newton_to_1e_10() {
    let cases = [
        ("pile at rest", pile(0.0)),
        ("pile pushed", pile(0.02)),
        ("humanoid", humanoid(1)),
        ("more rows than dofs", random(4, 30, 60, 8, mixed)),
        ("many contacts on few dofs", random(7, 20, 100, 6, coulomb)),
        ("many dofs", random(8, 300, 100, 6, coulomb)),
    ];
    for (name, case) in &cases {
        let (lambda, report) = case.solve(Method::Newton, 1e-10);
        assert!(report.converged && report.measure.residual <= 1e-10, "{name}: {report:?}");
        assert!(report.measure.complementarity < 1e-9, "{name}: {report:?}");
        assert!(report.measure.violation < 1e-12, "{name}: {report:?}");
        // Measured: 4 to 41.
        assert!(report.iterations <= 60, "{name}: {report:?}");
        assert!(energy(case, &lambda) <= 1e-12, "{name}: energy {:e}", energy(case, &lambda));
        let (same, _) = case.solve(Method::Newton, 1e-10);
        assert_eq!(lambda, same, "{name}: the same input, other bits");
    }
}

/// The linear system has a dof side (for more rows) and a row side (for more dofs); both are used above. Here the velocities of a problem must not
/// change if degrees of freedom that nothing touches are added.
#[test]
fn both_sides_of_the_linear_system_give_one_answer() {
    for seed in 0..5 {
        let narrow = random(seed, 14, 8, 9, coulomb);
        let wide = Case { dofs: 200, ..narrow.clone() };
        let settings =
            Settings { method: Method::Newton, tolerance: 1e-11, steps: 80, ..generous() };
        let (x, a) = narrow.solve(Method::Newton, 1e-11);
        let mut y = vec![[0.0; 4]; 8];
        let b = Contact::new(settings).solve(&wide.problem(), &mut y).unwrap();
        assert!(a.converged && b.converged && a.iterations > 0 && b.iterations > 0);
        // Measured: 5.8e-12.
        assert!(apart(&narrow, &x, &y) < 1e-9, "seed {seed}: {:e}", apart(&narrow, &x, &y));
    }
}

/// Without Coulomb cones the linear complementarity problem is the problem itself.
#[test]
fn lemke_agrees_with_newton_without_cones() {
    for seed in 0..20 {
        let case = random(seed, 24, 10, 8, |rng, g| match g % 3 {
            0 => Cone::Unilateral,
            1 => Cone::Dry { bound: rng.between(0.05, 0.5) },
            _ => Cone::Equality { rows: 1 + g % 2 },
        });
        let (x, a) = case.solve(Method::Lemke, 1e-9);
        let (y, b) = case.solve(Method::Newton, 1e-11);
        assert!(a.failure.is_none() && a.converged && b.converged, "seed {seed}: {a:?} {b:?}");
        // Measured: 9.8e-12.
        assert!(apart(&case, &x, &y) < 1e-9, "seed {seed}: {:e}", apart(&case, &x, &y));
    }
}

#[test]
fn lemke_tends_to_the_circular_cone_with_more_directions() {
    let worst = |directions: usize| {
        let mut most = 0.0f64;
        for seed in 0..8 {
            let case = random(seed, 18, 3, 9, |rng, g| match g {
                0 => Cone::Spinning { friction: rng.between(0.2, 0.5), spin: 0.1 },
                _ => Cone::Coulomb { friction: rng.between(0.2, 0.5) },
            });
            let (exact, report) = case.solve(Method::Newton, 1e-11);
            assert!(report.converged, "{report:?}");
            let settings = Settings { method: Method::Lemke, directions, ..generous() };
            let mut lambda = vec![[0.0; 4]; 3];
            let report = Contact::new(settings).solve(&case.problem(), &mut lambda).unwrap();
            assert!(report.failure.is_none(), "{report:?}");
            let apart = apart(&case, &exact, &lambda);
            assert!(apart.is_finite());
            most = most.max(apart);
        }
        most
    };
    let (few, many) = (worst(4), worst(32));
    assert!(few > 1e-2, "four directions can be told from a circle: {few:e}");
    // Measured: 7.9e-2 and 5.2e-3. The error of the polygon itself, 1 − cos(π/n), decreases by a
    // factor of 64.
    assert!(many < few / 8.0 && many < 1e-2, "{few:e} {many:e}");
}

/// Returns ½ λᵀ W λ + bᵀ λ, the kinetic energy that the impulses add.
fn energy(case: &Case, lambda: &[[f64; 4]]) -> f64 {
    let y = case.pulled(lambda);
    let work: f64 = lambda.iter().flatten().zip(case.b.iter().flatten()).map(|(l, b)| l * b).sum();
    0.5 * y.iter().map(|y| y * y).sum::<f64>() + work
}

#[test]
fn impulses_never_add_energy() {
    for seed in 0..20 {
        for method in [Method::GaussSeidel, Method::Newton, Method::Auto] {
            let case = random(seed, 30, 20, 8, mixed);
            let (lambda, report) = case.solve(method, 1e-10);
            assert!(report.converged, "seed {seed} {method:?}: {report:?}");
            let energy = energy(&case, &lambda);
            assert!(energy < -1e-6, "seed {seed} {method:?}: {energy:e}");
        }
    }
}

/// Newton's restitution is included in b: b_n = (1 + e) v⁻_n. With one contact, e ≤ 1, and no friction or an impact without slip, λᵀ (v⁺ + v⁻) / 2 ≤
/// 0. (Several contacts with friction can gain energy with Newton's rule.)
#[test]
fn a_bounce_never_gains_energy() {
    let mut rng = Random(77);
    for k in 0..200 {
        let e = [0.0, 0.4, 1.0][k % 3];
        let seed = rng.bits();
        let friction = if k % 2 == 0 { 0.0 } else { 0.6 };
        let mut case = random(seed, 6, 1, 6, |_, _| Cone::Coulomb { friction });
        let before = case.b[0];
        if before[0] >= 0.0 {
            continue;
        }
        // Decouple the tangents from the normal, as in a central impact.
        for i in 0..6 {
            let e = &mut case.e[i];
            *e = if i < 2 { [e[0], 0.0, 0.0, 0.0] } else { [0.0, e[1], e[2], 0.0] };
        }
        case.b[0][0] = (1.0 + e) * before[0];
        let (l, report) = case.solve(Method::Auto, 1e-12);
        assert!(report.converged);
        let y = case.pulled(&l);
        let added: f64 = (0..4).map(|k| l[0][k] * before[k]).sum::<f64>()
            + 0.5 * y.iter().map(|y| y * y).sum::<f64>();
        // The work of the impulse is λ·v⁻ + ½ λ W λ = λ (v⁺ + v⁻) / 2.
        assert!(added <= 1e-12, "{k}: {added:e}");
        if e == 1.0 && friction == 0.0 {
            assert!(added.abs() < 1e-12, "a perfect bounce keeps it: {added:e}");
        }
    }
}

/// A warm start at the solution takes no iterations, and a nearby one fewer than a cold start.
#[test]
fn warm_starts_are_used() {
    let case = pile(0.02);
    let (lambda, _) = case.solve(Method::Auto, 1e-11);
    for method in [Method::Auto, Method::GaussSeidel, Method::Newton] {
        let mut contact = Contact::new(Settings { method, tolerance: 1e-9, ..generous() });
        let mut again = lambda.clone();
        let report = contact.solve(&case.problem(), &mut again).unwrap();
        assert!(report.converged && report.iterations == 0, "{method:?}: {report:?}");
        assert!(apart(&case, &again, &lambda) < 1e-15, "{method:?}");
    }
    let cold = case.solve(Method::GaussSeidel, 1e-6).1.iterations;
    let mut near = lambda.iter().map(|l| l.map(|x| x * 1.0001)).collect::<Vec<_>>();
    let settings = Settings { method: Method::GaussSeidel, sweeps: 20_000, ..generous() };
    let warm = Contact::new(settings).solve(&case.problem(), &mut near).unwrap();
    assert!(warm.converged && 3 * warm.iterations < cold, "{} {cold}", warm.iterations);
}

/// With a minimum number of sweeps, a start within the tolerance improves from call to call.
#[test]
fn sweeps_at_least_bring_a_good_start_nearer() {
    let case = pile(0.0);
    let settings = Settings { tolerance: 1e-4, least: 1, ..generous() };
    let (mut lambda, _) = case.solve(Method::Auto, 1e-4);
    let mut contact = Contact::new(settings);
    let mut last = f64::INFINITY;
    for _ in 0..5 {
        let report = (0..40).map(|_| contact.solve(&case.problem(), &mut lambda).unwrap()).last();
        let now = report.unwrap();
        assert!(now.converged && now.iterations == 1, "{now:?}");
        assert!(now.measure.residual < last, "{now:?} after {last:e}");
        last = now.measure.residual;
    }
}

/// For any minimum number of sweeps, the result is that of the last sweep: it has the reported residual, and every impulse is in its cone.
#[test]
fn an_answer_is_what_a_sweep_left() {
    let case = pile(0.02);
    for least in 1..8 {
        let settings = Settings { tolerance: 0.5, least, ..generous() };
        let mut lambda = vec![[0.0; 4]; case.cones.len()];
        let report = Contact::new(settings).solve(&case.problem(), &mut lambda).unwrap();
        assert!(report.converged && report.iterations >= least, "{report:?}");
        assert!(report.measure.violation < 1e-12, "{report:?}");
        let again = Settings { sweeps: 0, method: Method::GaussSeidel, ..generous() };
        let mut same = lambda.clone();
        let told = Contact::new(again).solve(&case.problem(), &mut same).unwrap().measure;
        assert!((told.residual - report.measure.residual).abs() < 1e-12, "{told:?} {report:?}");
    }
}

/// Conjugate directions need fewer sweeps than plain ones (a relaxation slightly different from one disables them).
#[test]
fn conjugate_directions_save_sweeps() {
    let case = pile(0.02);
    let sweeps = |relaxation: f64| {
        let settings = Settings { method: Method::GaussSeidel, relaxation, ..generous() };
        let settings = Settings { tolerance: 1e-8, sweeps: 20_000, ..settings };
        let mut lambda = vec![[0.0; 4]; case.cones.len()];
        let report = Contact::new(settings).solve(&case.problem(), &mut lambda).unwrap();
        assert!(report.converged, "{report:?}");
        report.iterations
    };
    let (plain, along) = (sweeps(1.0 - 1e-12), sweeps(1.0));
    println!("sweeps: plain {plain}, along conjugate directions {along}");
    assert!(2 * along < plain, "{along} of {plain}");
}

#[test]
fn over_relaxation_ends_at_the_same_velocities() {
    let case = random(5, 60, 15, 14, mixed);
    let (x, _) = case.solve(Method::Newton, 1e-12);
    for relaxation in [0.7, 1.2] {
        let settings = Settings {
            method: Method::GaussSeidel,
            relaxation,
            tolerance: 1e-11,
            sweeps: 5000,
            ..generous()
        };
        let mut y = vec![[0.0; 4]; 15];
        let report = Contact::new(settings).solve(&case.problem(), &mut y).unwrap();
        assert!(report.converged, "{report:?}");
        assert!(apart(&case, &x, &y) < 1e-9);
    }
}

/// If sweeps and steps are zero, `Auto` uses Lemke.
#[test]
fn auto_falls_back_on_lemke() {
    let case = random(4, 24, 10, 8, |rng, g| match g % 2 {
        0 => Cone::Unilateral,
        _ => Cone::Dry { bound: rng.between(0.05, 0.5) },
    });
    let settings = Settings { sweeps: 0, steps: 0, ..generous() };
    let mut lambda = vec![[0.0; 4]; 10];
    let report = Contact::new(settings).solve(&case.problem(), &mut lambda).unwrap();
    assert!(report.converged && report.method == Method::Lemke, "{report:?}");
    let (exact, _) = case.solve(Method::GaussSeidel, 1e-12);
    assert!(apart(&case, &exact, &lambda) < 1e-9);
}
