//! Errors of the contact solvers, and their results for problems without solution.

use crate::support::*;
use linkwork_solvers::contact::*;

const METHODS: [Method; 4] = [Method::Auto, Method::GaussSeidel, Method::Newton, Method::Lemke];

fn refused(case: &Case) -> ContactError {
    let (start, dof, e) = (&case.start[..], &case.dof[..], &case.e[..]);
    let factor = Factor { start, dof, e, dofs: case.dofs };
    Problem::new(factor, &case.cones, &case.b, &case.r).unwrap_err()
}

/// A valid problem, made invalid by `spoil`.
fn spoilt(spoil: impl FnOnce(&mut Case)) -> ContactError {
    let mut case = random(1, 10, 5, 6, mixed);
    case.r = vec![[0.1; 4]; 5];
    let _ = case.problem();
    spoil(&mut case);
    refused(&case)
}

#[test]
fn mistakes_are_typed_and_say_where() {
    use ContactError::*;
    let nan = f64::NAN;
    let is = |x: ContactError, what: &str| {
        let text = x.to_string();
        assert!(text.contains(what) && text.contains("help: "), "{text}");
        x
    };
    assert!(matches!(
        is(spoilt(|c| c.b[2][0] = nan), "group 2"),
        NotFinite { group: 2, row: 0, .. }
    ));
    assert!(matches!(spoilt(|c| c.b[0][2] = f64::INFINITY), NotFinite { group: 0, row: 2, .. }));
    assert!(matches!(
        is(spoilt(|c| c.e[8][0] = nan), "factor"),
        NotFinite { group: 1, row: 0, .. }
    ));
    assert!(matches!(spoilt(|c| c.e[8][0] = -f64::INFINITY), NotFinite { group: 1, .. }));
    let cone = Cone::Coulomb { friction: -0.1 };
    assert!(matches!(
        is(spoilt(|c| c.cones[0] = cone), "-0.1"),
        Negative { group: 0, what: "friction", .. }
    ));
    let cone = Cone::Coulomb { friction: nan };
    assert!(matches!(spoilt(|c| c.cones[0] = cone), Negative { .. }));
    let cone = Cone::Dry { bound: -1.0 };
    assert!(matches!(spoilt(|c| c.cones[3] = cone), Negative { group: 3, what: "bound", .. }));
    let cone = Cone::Spinning { friction: 0.1, spin: f64::INFINITY };
    assert!(matches!(spoilt(|c| c.cones[4] = cone), Negative { what: "spin", .. }));
    assert!(matches!(is(spoilt(|c| c.r[1][0] = -1e-9), "compliance"), Negative { group: 1, .. }));
    assert!(matches!(spoilt(|c| c.r[1][0] = nan), Negative { .. }));
    for rows in [0, 5] {
        let cone = Cone::Equality { rows };
        assert!(matches!(is(spoilt(|c| c.cones[1] = cone), "rows"), Rows { group: 1, .. }));
    }
    let cone = Cone::Unilateral;
    assert!(matches!(
        is(spoilt(|c| c.cones[0] = cone), "beyond row 1"),
        Lanes { group: 0, rows: 1 }
    ));
    assert!(matches!(is(spoilt(|c| c.dofs = 9), "below 9"), Dof { dofs: 9, .. }));
    assert!(matches!(spoilt(|c| c.dof.swap(0, 1)), Dof { group: 0, .. }));
    assert!(matches!(spoilt(|c| c.dof[1] = c.dof[0]), Dof { group: 0, .. }));
    assert!(matches!(is(spoilt(|c| c.start[0] = 1), "start"), Start { group: 0 }));
    assert!(matches!(spoilt(|c| c.start[2] = 100), Start { group: 2 }));
    assert!(matches!(spoilt(|c| c.start[5] = 31), Length { what: "dof", .. }));
    assert!(matches!(spoilt(|c| c.start.truncate(0)), Length { what: "start", .. }));
    assert!(matches!(
        is(spoilt(|c| c.b.truncate(4)), "`b`"),
        Length { what: "b", expected: 5, found: 4 }
    ));
    assert!(matches!(spoilt(|c| c.r.truncate(4)), Length { what: "r", .. }));
    assert!(matches!(spoilt(|c| c.e.truncate(4)), Length { what: "e", .. }));
}

#[test]
fn settings_and_impulses_are_checked() {
    let case = random(1, 10, 5, 6, mixed);
    let try_with = |settings: Settings, groups: usize| {
        let mut l = vec![[0.0; 4]; groups];
        Contact::new(settings).solve(&case.problem(), &mut l).unwrap_err()
    };
    let good = Settings::default();
    for tolerance in [-1.0, f64::NAN] {
        let error = try_with(Settings { tolerance, ..good }, 5);
        assert!(matches!(error, ContactError::Setting { what: "tolerance", .. }));
    }
    for relaxation in [0.0, 2.0, f64::NAN] {
        let error = try_with(Settings { relaxation, ..good }, 5);
        assert!(matches!(error, ContactError::Setting { what: "relaxation", .. }));
    }
    let error = try_with(Settings { directions: 2, ..good }, 5);
    assert!(matches!(error, ContactError::Setting { what: "directions", .. }));
    assert!(matches!(try_with(good, 4), ContactError::Length { what: "lambda", .. }));
    // Impulses that are not finite are replaced by zero; those outside a cone are projected onto it.
    for method in METHODS {
        let mut l = vec![[f64::NAN, -3.0, f64::INFINITY, 1e9]; 5];
        l[2] = [-7.0, 1.0, 2.0, 3.0];
        let settings = Settings { method, sweeps: 5000, ..good };
        let report = Contact::new(settings).solve(&case.problem(), &mut l).unwrap();
        assert!(l.iter().flatten().all(|x| x.is_finite()) && report.measure.residual.is_finite());
        assert!(report.measure.violation < 1e-9, "{method:?} {report:?}");
        assert_eq!(l[2][1..], [0.0; 3], "lanes that the group lacks");
    }
}

#[test]
fn nothing_to_do_is_done() {
    for method in METHODS {
        let (l, report) = Case::new(7).solve(method, 1e-9);
        assert!(l.is_empty() && report.converged && report.measure.residual == 0.0);
        let (_, report) = Case::new(0).solve(method, 1e-9);
        assert!(report.converged);
        // No impulse can move these rows. The result is zero if none is needed; otherwise it is not reported
        // as converged.
        let mut case = Case::new(2);
        case.add(Cone::Coulomb { friction: 0.5 }, &[], [1.0, 2.0, 0.0, 0.0]);
        case.add(Cone::Equality { rows: 2 }, &[(0, [0.0; 4])], [0.0; 4]);
        let (l, report) = case.solve(method, 1e-9);
        assert!(report.converged && l == [[0.0; 4]; 2], "{method:?} {report:?}");
        case.b[0][0] = -1.0;
        let (l, report) = case.solve(method, 1e-9);
        assert!(!report.converged && report.measure.residual > 0.4, "{method:?} {report:?}");
        assert!(l.iter().flatten().all(|x| x.is_finite()), "{method:?} {l:?}");
    }
}

/// Three rows demand different velocities of one mass, so a solution does not exist. The velocity after is between the demands, the impulses are
/// finite, and the residual states the error.
#[test]
fn inconsistent_equalities_get_a_compromise_and_are_reported() {
    let mut case = Case::new(1);
    for target in [1.0, 2.0, 6.0] {
        case.add(
            Cone::Equality { rows: 1 },
            &[(0, [1.0, 0.0, 0.0, 0.0])],
            [-target, 0.0, 0.0, 0.0],
        );
    }
    for method in [Method::Auto, Method::Newton] {
        let (l, report) = case.solve(method, 1e-9);
        assert!(!report.converged, "{method:?} {report:?}");
        let y = case.pulled(&l)[0];
        // The least squares solution is 3; the remaining residual is 3 of 6.
        assert!((y - 3.0).abs() < 1e-3, "{method:?}: {y}");
        assert!((report.measure.residual - 0.5).abs() < 1e-3, "{method:?} {report:?}");
        assert!(l.iter().flatten().all(|x| x.abs() < 1e8), "{method:?} {l:?}");
    }
}

/// The start has the smallest maximum error, 2.5 of 6, but the result is still least squares.
#[test]
fn inconsistent_equalities_do_not_stay_where_they_began() {
    let mut case = Case::new(1);
    for target in [1.0, 2.0, 6.0] {
        let entries = [(0, [1.0, 0.0, 0.0, 0.0])];
        case.add(Cone::Equality { rows: 1 }, &entries, [-target, 0.0, 0.0, 0.0]);
    }
    let settings = Settings { sweeps: 0, ..Settings::default() };
    let mut l = vec![[3.5, 0.0, 0.0, 0.0], [0.0; 4], [0.0; 4]];
    let report = Contact::new(settings).solve(&case.problem(), &mut l).unwrap();
    assert!(!report.converged);
    let y = case.pulled(&l)[0];
    assert!((y - 3.0).abs() < 1e-3, "{y}");
}

/// Two walls that approach each other with a mass between them, and a jammed group of bodies: no solution exists.
#[test]
fn impossible_contacts_end_and_are_reported() {
    let mut squeeze = Case::new(1);
    squeeze.add(Cone::Unilateral, &[(0, [1.0, 0.0, 0.0, 0.0])], [-1.0, 0.0, 0.0, 0.0]);
    squeeze.add(Cone::Unilateral, &[(0, [-1.0, 0.0, 0.0, 0.0])], [-1.5, 0.0, 0.0, 0.0]);
    let mut crowd = random(3, 8, 60, 6, coulomb);
    let mut rng = Random(5);
    crowd.b.iter_mut().for_each(|b| b[..3].fill_with(|| rng.number() - 0.5));
    for case in [squeeze, crowd] {
        for method in METHODS {
            let settings = Settings { method, ..Settings::default() };
            let mut l = vec![[0.0; 4]; case.cones.len()];
            let report = Contact::new(settings).solve(&case.problem(), &mut l).unwrap();
            assert!(!report.converged && report.measure.residual > 1e-3, "{method:?} {report:?}");
            assert!(l.iter().flatten().all(|x| x.is_finite()));
            // The report describes the returned impulses.
            let only = Settings { method: Method::GaussSeidel, sweeps: 0, ..Settings::default() };
            let again = Contact::new(only).solve(&case.problem(), &mut l.clone()).unwrap();
            let (a, b) = (report.measure.residual, again.measure.residual);
            assert!((a - b).abs() < 1e-9 * a, "{method:?}: {a} {b}");
            if method == Method::Lemke {
                assert!(report.failure.is_some(), "{report:?}");
                assert!(l.iter().flatten().all(|x| *x == 0.0), "a failure leaves what was given");
            }
        }
    }
}

#[test]
fn huge_and_tiny_numbers_scale_or_are_refused() {
    let base = random(2, 12, 5, 8, mixed);
    for (length, velocity) in [(1e-60, 1.0), (1e60, 1e-30), (1e-3, 1e80), (1.0, 1e-120)] {
        let mut case = base.clone();
        case.e.iter_mut().flatten().for_each(|e| *e *= length);
        case.b.iter_mut().flatten().for_each(|b| *b *= velocity);
        // Impulses scale with velocity / length².
        let unit = velocity / length / length;
        case.cones[3] = match base.cones[3] {
            Cone::Dry { bound } => Cone::Dry { bound: bound * unit },
            _ => unreachable!(),
        };
        let (x, _) = base.solve(Method::Auto, 1e-10);
        let (y, report) = case.solve(Method::Auto, 1e-10);
        assert!(report.converged, "{length:e} {velocity:e} {report:?}");
        for (x, y) in x.iter().flatten().zip(y.iter().flatten()) {
            assert!((x - y / unit).abs() < 1e-7, "{length:e} {velocity:e}: {x} {}", y / unit);
        }
    }
    for method in METHODS {
        let mut case = base.clone();
        case.e.iter_mut().flatten().for_each(|e| *e *= 1e200);
        let mut l = vec![[0.25; 4]; 5];
        let error = Contact::new(Settings { method, ..Settings::default() });
        let error = { error }.solve(&case.problem(), &mut l).unwrap_err();
        assert!(matches!(error, ContactError::Overflow), "{method:?} {error}");
        assert_eq!(l, vec![[0.25; 4]; 5], "impulses are as they were");
        let mut case = base.clone();
        case.b.iter_mut().flatten().for_each(|b| *b *= 1e308);
        let mut l = vec![[0.0; 4]; 5];
        let answer =
            Contact::new(Settings { method, ..Settings::default() }).solve(&case.problem(), &mut l);
        assert!(l.iter().flatten().all(|x| x.is_finite()), "{method:?} {answer:?}");
    }
}

/// Numbers of every size and sign, many without a solution: the result is a solution or a typed error, always finite.
#[test]
fn anything_finite_ends_with_finite_impulses() {
    let mut rng = Random(11);
    for k in 0..400 {
        let mut case = random(rng.bits(), 1 + k % 9, 1 + k % 13, 1 + k % 5, mixed);
        let spread = [0.0, 3.0, 20.0][k % 3];
        case.e.iter_mut().flatten().for_each(|e| *e *= 10f64.powf(spread * rng.number()));
        case.b.iter_mut().flatten().for_each(|b| *b *= 10f64.powf(spread * rng.number()));
        if k % 4 == 0 {
            case.e.iter_mut().flatten().for_each(|e| *e = e.round());
        }
        for method in METHODS {
            let settings = Settings { method, ..Settings::default() };
            let mut l = vec![[0.0; 4]; case.cones.len()];
            let answer = Contact::new(settings).solve(&case.problem(), &mut l);
            assert!(l.iter().flatten().all(|x| x.is_finite()), "{k} {method:?} {answer:?}");
            if let Ok(report) = answer {
                assert!(report.measure.residual.is_finite(), "{k} {method:?} {report:?}");
            }
        }
    }
}

#[test]
fn nothing_is_allocated_once_a_problem_of_that_size_was_solved() {
    let (small, large) = (random(2, 12, 5, 8, mixed), pile(0.02));
    for method in METHODS {
        let mut contact = Contact::new(Settings { method, ..Settings::default() });
        let mut run = |case: &Case, l: &mut Vec<[f64; 4]>| {
            l.fill([0.0; 4]);
            contact.solve(&case.problem(), l).unwrap();
        };
        let (mut x, mut y) = (vec![[0.0; 4]; 5], vec![[0.0; 4]; 60]);
        run(&small, &mut x);
        run(&large, &mut y);
        let info = allocation_counter::measure(|| {
            run(&small, &mut x);
            run(&large, &mut y);
        });
        assert_eq!(info.count_total, 0, "{method:?}");
    }
}
