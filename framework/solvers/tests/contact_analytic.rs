//! Contact solvers compared with analytical solutions, and with enumeration of all cases.

use crate::support::*;
use linkwork_solvers::contact::{Cone, Contact, Method, Settings};

const EXACT: [Method; 3] = [Method::Auto, Method::GaussSeidel, Method::Newton];

/// A point of mass `m` on a plane z = 0 with velocity `v` before.
fn point(m: f64, v: [f64; 3], friction: f64) -> Case {
    let mut case = Case::new(3);
    let s = 1.0 / m.sqrt();
    // The rows are normal z, tangents x, y.
    let entries = [(0, [0.0, s, 0.0, 0.0]), (1, [0.0, 0.0, s, 0.0]), (2, [s, 0.0, 0.0, 0.0])];
    case.add(Cone::Coulomb { friction }, &entries, [v[2], v[0], v[1], 0.0]);
    case
}

fn near(a: &[f64], b: &[f64], tolerance: f64) {
    for (x, y) in a.iter().zip(b) {
        assert!((x - y).abs() <= tolerance, "{a:?} instead of {b:?}");
    }
}

#[test]
fn a_point_sticks_slides_or_leaves() {
    let m = 1.7;
    for method in EXACT {
        // Stick: the tangential speed is below μ times the normal speed, so the impulse is −m v.
        let (l, _) = point(m, [0.3, -0.4, -2.0], 0.3).solve(method, 1e-12);
        near(&l[0], &[m * 2.0, -m * 0.3, m * 0.4, 0.0], 1e-12);
        // Slide: λt = −μ λn along vt. The tangential speed decreases and its direction stays the
        // same.
        let case = point(m, [3.0, -4.0, -2.0], 0.3);
        let (l, _) = case.solve(method, 1e-12);
        near(&l[0], &[2.0 * m, -0.6 * m * 0.6, 0.6 * m * 0.8, 0.0], 1e-12);
        near(&case.velocities(&l)[0], &[0.0, 3.0 - 0.36, -4.0 + 0.48, 0.0], 1e-12);
        // The point leaves the contact.
        let (l, _) = point(m, [3.0, -4.0, 0.2], 0.3).solve(method, 1e-12);
        assert_eq!(l[0], [0.0; 4]);
        // The point slides without friction.
        let (l, _) = point(m, [3.0, -4.0, -2.0], 0.0).solve(method, 1e-12);
        near(&l[0], &[2.0 * m, 0.0, 0.0, 0.0], 1e-12);
    }
}

/// An anisotropic, coupled compliance: sliding has vn = 0, λt on the cone's edge and opposite to vt.
/// The associated relaxation would lift off with vn = μ |vt|.
#[test]
fn sliding_obeys_coulomb_and_not_its_associated_relaxation() {
    let mut slid = 0;
    for seed in 0..300 {
        let case = random(seed, 5, 1, 5, coulomb);
        let Cone::Coulomb { friction } = case.cones[0] else { unreachable!() };
        for method in EXACT {
            let (l, report) = case.solve(method, 1e-12);
            assert!(report.converged, "seed {seed} {method:?} {report:?}");
            let (l, v) = (l[0], case.velocities(&l)[0]);
            let (speed, force) = (v[1].hypot(v[2]), l[1].hypot(l[2]));
            if l[0] > 1e-9 && speed > 1e-6 {
                slid += 1;
                assert!(v[0].abs() < 1e-11, "seed {seed}: lifts off with {}", v[0]);
                assert!((force - friction * l[0]).abs() < 1e-10);
                assert!((l[1] * v[1] + l[2] * v[2] + force * speed).abs() < 1e-10);
            }
        }
    }
    assert!(slid > 100, "{slid}");
}

/// A ball of unit mass in a wedge between two planes inclined by ±45°: each gives v/√2 · m without friction.
#[test]
fn a_wedge_holds_with_both_planes() {
    let h = std::f64::consts::FRAC_1_SQRT_2;
    for method in EXACT {
        let mut case = Case::new(2);
        case.add(
            Cone::Unilateral,
            &[(0, [h, 0.0, 0.0, 0.0]), (1, [h, 0.0, 0.0, 0.0])],
            [-3.0 * h, 0.0, 0.0, 0.0],
        );
        case.add(
            Cone::Unilateral,
            &[(0, [-h, 0.0, 0.0, 0.0]), (1, [h, 0.0, 0.0, 0.0])],
            [-3.0 * h, 0.0, 0.0, 0.0],
        );
        let (l, _) = case.solve(method, 1e-12);
        near(&[l[0][0], l[1][0]], &[3.0 * h, 3.0 * h], 1e-12);
    }
}

/// A box on four corners, and on eight: λ is not unique, but its sum is m g h, and the box stays at rest.
#[test]
fn a_box_on_many_points_rests() {
    let (mass, step) = (2.3, 1e-3);
    let velocity = [0.0, 0.0, 0.0, 0.0, 0.0, -9.81 * step];
    let bodies = [Body { mass, inertia: [0.02, 0.03, 0.04], place: [0.0, 0.0, 0.1], velocity }];
    for points in [4, 8] {
        let mut case = Case::new(6);
        for k in 0..points {
            let (s, c) = (0.5 + k as f64 * std::f64::consts::TAU / points as f64).sin_cos();
            touch(
                &mut case,
                &bodies,
                0,
                None,
                [0.2 * c, 0.2 * s, 0.0],
                UP,
                Cone::Coulomb { friction: 0.5 },
            );
        }
        for method in [Method::Auto, Method::GaussSeidel, Method::Newton, Method::Lemke] {
            let (l, report) = case.solve(method, 1e-10);
            assert!(report.converged, "{method:?} {report:?}");
            let normal: f64 = l.iter().map(|l| l[0]).sum();
            assert!((normal - mass * 9.81 * step).abs() < 1e-10 * mass, "{method:?} {normal}");
            for v in case.velocities(&l) {
                near(&v, &[0.0; 4], 1e-11);
            }
        }
    }
}

/// A rod of unit mass and length 2, at `angle` from the horizontal, its tip on the ground with strong friction.
fn rod(angle: f64, friction: f64, tip: [f64; 2]) -> Case {
    let (s, c) = angle.sin_cos();
    let inertia = (1.0f64 / 3.0).sqrt();
    // The degrees of freedom are x, z and rotation. The tip is at (−c, −s) from the centre: v_tip =
    // v + ω (s, −c).
    let mut case = Case::new(3);
    let entries = [
        (0, [0.0, 1.0, 0.0, 0.0]),
        (1, [1.0, 0.0, 0.0, 0.0]),
        (2, [-c / inertia, s / inertia, 0.0, 0.0]),
    ];
    case.add(Cone::Coulomb { friction }, &entries, [tip[1], tip[0], 0.0, 0.0]);
    case
}

/// Painlevé: Wnn − μ Wnt < 0 while sliding. For an approaching tip a solution exists and obeys the law. A separating tip gets zero impulse, although
/// another solution exists.
#[test]
fn painleve_rod_ends() {
    for friction in [0.5, 1.4, 3.0, 50.0] {
        for angle in [0.3, 0.8, 1.1, 1.5] {
            for tip in [[1.0, -0.1], [-1.0, -0.1], [1.0, -1e-9], [-2.0, 0.05], [1.0, 0.05]] {
                let case = rod(angle, friction, tip);
                for method in EXACT {
                    let (l, report) = case.solve(method, 1e-10);
                    assert!(
                        report.converged,
                        "μ {friction} angle {angle} {tip:?} {method:?} {report:?}"
                    );
                    if tip[1] > 0.0 && method != Method::Newton {
                        assert_eq!(l[0], [0.0; 4]);
                    }
                }
            }
        }
    }
}

/// Dry friction: sticks within its bound, otherwise brakes with its full bound.
#[test]
fn a_dry_row_sticks_or_brakes() {
    for method in [Method::Auto, Method::GaussSeidel, Method::Newton, Method::Lemke] {
        for (speed, impulse) in [(0.4, -0.2), (-0.4, 0.2), (3.0, -0.7), (-3.0, 0.7), (1.4, -0.7)] {
            let mut case = Case::new(1);
            // The inverse mass of this row is 2.
            case.add(
                Cone::Dry { bound: 0.7 },
                &[(0, [2.0f64.sqrt(), 0.0, 0.0, 0.0])],
                [speed, 0.0, 0.0, 0.0],
            );
            let (l, _) = case.solve(method, 1e-12);
            near(&[l[0][0]], &[impulse], 1e-12);
        }
    }
}

/// A chain of point masses with constraints of equal velocity between neighbours, each written twice and once more as a sum: the velocity after is
/// the mean.
#[test]
fn redundant_equalities_are_no_trouble() {
    let masses = [1.0, 2.5, 0.7, 4.0];
    let before = [1.0, -2.0, 3.0, 0.5];
    let s = |k: usize| 1.0f64 / f64::sqrt(masses[k]);
    let mean =
        masses.iter().zip(&before).map(|(m, v)| m * v).sum::<f64>() / masses.iter().sum::<f64>();
    for method in [Method::Auto, Method::GaussSeidel, Method::Newton, Method::Lemke] {
        let mut case = Case::new(4);
        for k in 0..3 {
            let d = before[k] - before[k + 1];
            // The group has two identical rows.
            let (a, b) = (s(k), -s(k + 1));
            case.add(
                Cone::Equality { rows: 2 },
                &[(k, [a, 2.0 * a, 0.0, 0.0]), (k + 1, [b, 2.0 * b, 0.0, 0.0])],
                [d, 2.0 * d, 0.0, 0.0],
            );
        }
        let d = before[0] - before[3];
        case.add(
            Cone::Equality { rows: 1 },
            &[(0, [s(0), 0.0, 0.0, 0.0]), (3, [-s(3), 0.0, 0.0, 0.0])],
            [d, 0.0, 0.0, 0.0],
        );
        let (l, report) = case.solve(method, 1e-11);
        assert!(report.converged, "{method:?} {report:?}");
        let y = case.pulled(&l);
        for k in 0..4 {
            near(&[before[k] + s(k) * y[k]], &[mean], 1e-10);
        }
    }
}

/// Soft rows: one row gives v = b + (W + R) λ = 0, so W λ = −b W / (W + R).
#[test]
fn compliance_takes_its_share() {
    for method in [Method::Auto, Method::GaussSeidel, Method::Newton, Method::Lemke] {
        let mut case = Case::new(1);
        case.add(Cone::Unilateral, &[(0, [1.5, 0.0, 0.0, 0.0])], [-2.0, 0.0, 0.0, 0.0]);
        case.r = vec![[0.75, 0.0, 0.0, 0.0]];
        let (l, report) = case.solve(method, 1e-12);
        assert!(report.converged, "{method:?} {report:?}");
        near(&[l[0][0]], &[2.0 / (2.25 + 0.75)], 1e-12);
    }
    // An equal compliance as a separate degree of freedom, with friction.
    let soft = {
        let mut c = random(9, 12, 4, 9, coulomb);
        c.r = vec![[0.3, 0.2, 0.2, 0.0]; 4];
        c
    };
    let mut rigid = Case::new(12 + 12);
    for g in 0..4 {
        let range = soft.start[g] as usize..soft.start[g + 1] as usize;
        let mut entries: Vec<_> = range.map(|i| (soft.dof[i] as usize, soft.e[i])).collect();
        for k in 0..3 {
            let mut e = [0.0; 4];
            e[k] = soft.r[g][k].sqrt();
            entries.push((12 + 3 * g + k, e));
        }
        rigid.add(soft.cones[g], &entries, soft.b[g]);
    }
    for method in EXACT {
        let (x, y) = (soft.solve(method, 1e-12).0, rigid.solve(method, 1e-12).0);
        for (x, y) in x.iter().zip(&y) {
            near(x, y, 1e-9);
        }
    }
}

/// Torque about the normal: a disc on a plane, spun without slip.
#[test]
fn a_spinning_disc_is_braked_by_its_normal_force() {
    let (mass, inertia, spin) = (2.0, 0.5, 0.1);
    for method in [Method::Auto, Method::GaussSeidel, Method::Newton, Method::Lemke] {
        for (rate, torque) in [(0.1, -0.05), (3.0, -0.2), (-3.0, 0.2)] {
            let velocity = [0.0, 0.0, rate, 0.0, 0.0, -1.0];
            let bodies = [Body { mass, inertia: [1.0, 1.0, inertia], place: [0.0; 3], velocity }];
            let mut case = Case::new(6);
            touch(
                &mut case,
                &bodies,
                0,
                None,
                [0.0; 3],
                UP,
                Cone::Spinning { friction: 0.4, spin },
            );
            let (l, _) = case.solve(method, 1e-12);
            near(&l[0], &[mass, 0.0, 0.0, torque], 1e-11);
        }
    }
}

/// Up to three contacts in the plane (one tangent): solves every combination of leave, stick, slide left and slide right as a linear system. The
/// solver's result must be among those that obey the law.
#[test]
fn enumeration_of_all_cases_contains_the_answer() {
    for seed in 0..60 {
        let groups = 1 + seed as usize % 3;
        let mut case = random(seed, 7, groups, 6, coulomb);
        for e in &mut case.e {
            e[2] = 0.0;
        }
        case.b.iter_mut().for_each(|b| b[2] = 0.0);
        let found = enumerate(&case);
        assert!(!found.is_empty(), "seed {seed}: no case obeys the law");
        for method in EXACT {
            let (l, report) = case.solve(method, 1e-12);
            assert!(report.converged, "seed {seed} {method:?} {report:?}");
            let v: Vec<f64> = case.velocities(&l).iter().flatten().copied().collect();
            let best = found
                .iter()
                .map(|f| f.iter().zip(&v).fold(0.0f64, |m, (a, b)| m.max((a - b).abs())));
            let best = best.fold(f64::INFINITY, f64::min);
            assert!(best < 1e-9, "seed {seed} {method:?}: {best:e} from the nearest case");
        }
    }
}

/// Returns the velocities after, for every combination that obeys the law.
fn enumerate(case: &Case) -> Vec<Vec<f64>> {
    let groups = case.cones.len();
    let unit = |g: usize, k: usize| {
        let mut l = vec![[0.0; 4]; groups];
        l[g][k] = 1.0;
        let (v, mut free) = (case.velocities(&l), case.b.clone());
        free.iter_mut().zip(&v).for_each(|(f, v)| (0..4).for_each(|k| f[k] = v[k] - f[k]));
        free
    };
    let W: Vec<Vec<[f64; 4]>> = (0..2 * groups).map(|i| unit(i / 2, i % 2)).collect();
    let mut found = Vec::new();
    for code in 0..4usize.pow(groups as u32) {
        let kind = |g: usize| code / 4usize.pow(g as u32) % 4;
        let n = 2 * groups;
        let mut A = vec![vec![0.0; n + 1]; n];
        for g in 0..groups {
            let Cone::Coulomb { friction } = case.cones[g] else { unreachable!() };
            for k in 0..2 {
                let row = &mut A[2 * g + k];
                let moving = !matches!((kind(g), k), (0, _) | (2 | 3, 1));
                if moving {
                    (0..n).for_each(|i| row[i] = W[i][g][k]);
                    row[n] = -case.b[g][k];
                } else {
                    row[2 * g + k] = 1.0;
                    if kind(g) >= 2 {
                        row[2 * g] = if kind(g) == 2 { friction } else { -friction };
                    }
                }
            }
        }
        let Some(x) = gauss(A) else { continue };
        let l: Vec<[f64; 4]> = (0..groups).map(|g| [x[2 * g], x[2 * g + 1], 0.0, 0.0]).collect();
        let v = case.velocities(&l);
        let lawful = (0..groups).all(|g| {
            let Cone::Coulomb { friction } = case.cones[g] else { unreachable!() };
            let (n, t, vn, vt) = (l[g][0], l[g][1], v[g][0], v[g][1]);
            n >= -1e-12
                && vn >= -1e-12
                && t.abs() <= friction * n + 1e-12
                && (vt.abs() < 1e-12 || t * vt <= 1e-12)
        });
        if lawful {
            found.push(v.into_iter().flatten().collect());
        }
    }
    found
}

/// Returns the solution of [A | b], or `None` if A is singular.
fn gauss(mut A: Vec<Vec<f64>>) -> Option<Vec<f64>> {
    let n = A.len();
    for k in 0..n {
        let p = (k..n).max_by(|&i, &j| A[i][k].abs().total_cmp(&A[j][k].abs()))?;
        A.swap(k, p);
        if A[k][k].abs() < 1e-10 {
            return None;
        }
        for i in 0..n {
            if i != k {
                let f = A[i][k] / A[k][k];
                (k..=n).for_each(|j| A[i][j] -= f * A[k][j]);
            }
        }
    }
    Some((0..n).map(|k| A[k][n] / A[k][k]).collect())
}

/// If the iteration limit is too small, the report states it.
#[test]
fn a_short_limit_is_reported() {
    let case = pile(0.02);
    let settings = Settings { method: Method::GaussSeidel, sweeps: 3, ..Settings::default() };
    let mut l = vec![[0.0; 4]; 60];
    let report = Contact::new(settings).solve(&case.problem(), &mut l).unwrap();
    assert!(!report.converged && report.iterations == 3 && report.measure.residual > 1e-6);
}
