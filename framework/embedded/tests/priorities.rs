//! Least squares by priority, within bounds.

use crate::support;

use linkwork_embedded::*;
use support::Rng;

fn random(rng: &mut Rng, n: usize) -> Vec<f64> {
    (0..n).map(|_| rng.within(-1.0, 1.0)).collect()
}

fn times(A: &[f64], x: &[f64]) -> Vec<f64> {
    A.chunks_exact(x.len()).map(|r| r.iter().zip(x).map(|(a, b)| a * b).sum()).collect()
}

fn square(A: &[f64], x: &[f64], b: &[f64]) -> f64 {
    times(A, x).iter().zip(b).map(|(a, b)| (a - b) * (a - b)).sum()
}

/// Compares with projected Gauss–Seidel, an independent method: boxes around full-rank problems.
#[test]
fn within_a_box_it_is_what_another_method_finds() {
    let mut rng = Rng(3);
    let mut active = 0;
    for case in 0..200 {
        let n = 2 + case % 5;
        let (A, b) = (random(&mut rng, n * (n + 2)), random(&mut rng, n + 2));
        let most = rng.within(0.05, 0.6);
        let mut problem = Priorities::new(n, n + 2, 2 * n);
        problem.begin();
        for i in 0..n {
            for side in [1.0, -1.0] {
                let mut row = vec![0.0; n];
                row[i] = side;
                problem.bound(&row, most);
            }
        }
        problem.level(&A, &b).unwrap();
        let column = |i: usize| -> Vec<f64> { A.iter().skip(i).step_by(n).copied().collect() };
        let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
        let N: Vec<f64> = (0..n * n).map(|k| dot(&column(k / n), &column(k % n))).collect();
        let right: Vec<f64> = (0..n).map(|i| dot(&column(i), &b)).collect();
        let mut x = vec![0.0; n];
        let sweeps = Sweeps { most: 200_000, settled: 1e-14 };
        bounded(&N, &right, [-most, most], &sweeps, &mut x);
        let off = support::difference(problem.x(), &x);
        assert!(off < 1e-7, "case {case}: {off:.1e}");
        active += x.iter().filter(|x| x.abs() == most).count();
    }
    assert!(active > 100, "{active} bounds were active");
}

/// Every level is optimal given the levels before: a small change within the bounds that keeps their residuals does not improve it. Includes
/// rank-deficient levels, contradicting levels and active bounds.
#[test]
fn later_levels_take_nothing_from_earlier_ones() {
    let mut rng = Rng(7);
    let (n, mut contradicting, mut active) = (6, 0, 0);
    for case in 0..60 {
        let bounds: Vec<(Vec<f64>, f64)> =
            (0..8).map(|_| (random(&mut rng, n), rng.within(0.05, 0.8))).collect();
        let levels: Vec<(Vec<f64>, Vec<f64>)> = [2, 3, 2]
            .iter()
            .map(|rows| {
                let mut A = random(&mut rng, n * rows);
                // The last row is twice another, so the rank is one less.
                if case % 2 == 0 {
                    for i in 0..n {
                        A[n * (rows - 1) + i] = 2.0 * A[i];
                    }
                }
                (A, random(&mut rng, *rows))
            })
            .collect();
        let mut problem = Priorities::new(n, 3, 8);
        problem.begin();
        bounds.iter().for_each(|(c, d)| problem.bound(c, *d));
        let mut found = Vec::new();
        for (A, b) in &levels {
            let met = problem.level(A, b).unwrap();
            found.push(met.residual);
            contradicting += usize::from(met.residual > 1e-3);
        }
        let x = problem.x().to_vec();
        for (c, d) in &bounds {
            let over = times(c, &x)[0] - d;
            assert!(over < 1e-9, "case {case}: {over}");
            active += usize::from(over > -1e-9);
        }
        for (k, (A, b)) in levels.iter().enumerate() {
            // The residual of each level is preserved.
            assert!((square(A, &x, b).sqrt() - found[k]).abs() < 1e-8, "case {case} level {k}");
        }
        // Random changes that keep the residuals of all previous levels cost more at each level.
        for (k, (A, b)) in levels.iter().enumerate() {
            let before: Vec<&[f64]> =
                levels[..k].iter().flat_map(|l| l.0.chunks_exact(n)).collect();
            for _ in 0..200 {
                let mut d = random(&mut rng, n);
                // Apply Gram–Schmidt twice against an orthonormal basis of the previous rows.
                let mut basis: Vec<Vec<f64>> = Vec::new();
                for row in &before {
                    let mut v = row.to_vec();
                    for _ in 0..2 {
                        for e in &basis {
                            let s = times(e, &v)[0];
                            v.iter_mut().zip(e).for_each(|(x, e)| *x -= s * e);
                        }
                    }
                    let length = times(&v, &v)[0].sqrt();
                    if length > 1e-6 {
                        basis.push(v.iter().map(|x| x / length).collect());
                    }
                }
                for _ in 0..2 {
                    for e in &basis {
                        let s = times(e, &d)[0];
                        d.iter_mut().zip(e).for_each(|(x, e)| *x -= s * e);
                    }
                }
                let near: Vec<f64> = x.iter().zip(&d).map(|(x, d)| x + 1e-4 * d).collect();
                if bounds.iter().all(|(c, most)| times(c, &near)[0] <= *most) {
                    let gain = square(A, &x, b) - square(A, &near, b);
                    assert!(gain < 1e-11, "case {case} level {k}: better by {gain:.1e}");
                }
            }
        }
    }
    assert!(contradicting > 20 && active > 60, "{contradicting} {active}");
}

/// Computed by hand: x + y = 2 with x ≤ 0.5, then x = y, then the minimum norm.
#[test]
fn a_small_problem_by_hand() {
    let mut problem = Priorities::new(3, 2, 2);
    problem.begin();
    problem.bound(&[1.0, 0.0, 0.0], 0.5);
    assert_eq!(problem.level(&[1.0, 1.0, 0.0], &[2.0]).unwrap().free, 2);
    let met = problem.level(&[1.0, -1.0, 0.0], &[0.0]).unwrap();
    let x = problem.x();
    assert!(support::difference(x, &[0.5, 1.5, 0.0]) < 1e-8, "{x:?}");
    assert!((met.residual - 1.0).abs() < 1e-8 && met.free == 1);
    // x and y are already determined, so a task for another x changes nothing. z is free.
    problem.level(&[1.0, 0.0, 0.0, 0.0, 0.0, 2.0], &[-3.0, 8.0]).unwrap();
    assert!(support::difference(problem.x(), &[0.5, 1.5, 4.0]) < 1e-8, "{:?}", problem.x());
    // These bounds contradict each other.
    problem.begin();
    problem.bound(&[1.0, 0.0, 0.0], -1.0);
    problem.bound(&[-1.0, 0.0, 0.0], 0.5);
    assert_eq!(problem.level(&[0.0, 1.0, 0.0], &[1.0]), Err(NoSolution));
}

#[test]
fn the_same_bits_without_allocation() {
    let mut rng = Rng(5);
    let (n, A, b) = (5, random(&mut rng, 15), random(&mut rng, 3));
    let (c, mut problem) = (random(&mut rng, 5), Priorities::new(5, 3, 4));
    let mut kept: [Vec<f64>; 2] = [vec![0.0; n], vec![0.0; n]];
    let counted = allocation_counter::measure(|| {
        for kept in &mut kept {
            problem.begin();
            problem.bound(&c, 0.01);
            problem.level(&A, &b).unwrap();
            // Rows that already exist do not reduce the freedom.
            assert_eq!(problem.level(&A[5..], &b[..2]).unwrap().free, 2);
            kept.copy_from_slice(problem.x());
            // No x can make zero less than −1.
            problem.bound(&[0.0; 5], -1.0);
            problem.level(&A, &b).unwrap_err();
        }
    });
    assert_eq!(counted.count_total, 0, "{counted:?}");
    assert_eq!(kept[0], kept[1]);
}

#[test]
fn a_problem_of_no_numbers_has_its_answer() {
    let mut problem = Priorities::new(0, 0, 0);
    problem.begin();
    assert_eq!(problem.level(&[], &[]), Ok(LevelResult { residual: 0.0, free: 0 }));
    assert!(problem.x().is_empty());
}
