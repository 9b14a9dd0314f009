//! Bounded least squares, for example for thruster allocation or contact forces.
//!
//! ```text
//! min ½ sᵀ N s − rᵀ s,  lower ≤ s ≤ upper          N = BᵀWB + ε, r = BᵀW w
//! ```
//! For up to 64 unknowns an active-set method is used. Unknowns between their bounds are solved for together (Cholesky); the others stay at their
//! bounds. An unknown that would leave its bounds stops there. When all free unknowns are solved, the bounded unknown with the steepest descent away
//! from its bound is freed. The cost decreases in each iteration. The number of iterations is slightly above the number of unknowns that end between
//! their bounds. Each iteration costs n² operations plus one sixth of the cube of the number of free unknowns.
//! Source: Björck, *Numerical Methods for Least Squares Problems*, SIAM 1996, 5.2.3.
//!
//! For more unknowns projected Gauss–Seidel is used, which needs no memory: each unknown in turn moves to the minimum along it or to its bound. A
//! sweep costs n² operations, and many sweeps are needed if N has small eigenvalues.

/// Stopping criteria of [`bounded`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sweeps {
    /// Maximum number of iterations or sweeps.
    pub most: usize,
    /// The method ends when no unknown would move by more than this on its own.
    pub settled: f64,
}

/// Smallest pivot, relative to the diagonal entry.
const PIVOT_MIN: f64 = 1e-13;

/// Moves `s` from its current value to the minimum between `lower` and `upper`, and returns the number of iterations or sweeps. `normal` is N (n × n,
/// row after row), symmetric and positive semidefinite with a positive diagonal; `right` is r. NaN in the inputs gives NaN in the result.
///
/// # Panics
/// If the lengths do not agree.
pub fn bounded(
    normal: &[f64],
    right: &[f64],
    ends: [f64; 2],
    sweeps: &Sweeps,
    s: &mut [f64],
) -> usize {
    let n = s.len();
    assert!(normal.len() == n * n && right.len() == n, "n = {n} numbers need n × n and n");
    match n {
        0..=16 => active_set::<16, { 16 * 16 }>(normal, right, ends, sweeps, s),
        17..=32 => active_set::<32, { 32 * 32 }>(normal, right, ends, sweeps, s),
        33..=64 => active_set::<64, { 64 * 64 }>(normal, right, ends, sweeps, s),
        _ => gauss_seidel(normal, right, ends, sweeps, s),
    }
}

fn gauss_seidel(
    normal: &[f64],
    right: &[f64],
    [lower, upper]: [f64; 2],
    sweeps: &Sweeps,
    s: &mut [f64],
) -> usize {
    let n = s.len();
    for sweep in 1..=sweeps.most {
        let mut moved = 0.0_f64;
        for k in 0..n {
            let row = &normal[k * n..(k + 1) * n];
            let next = (s[k] - (dot(row, s) - right[k]) / row[k]).clamp(lower, upper);
            moved = moved.max((next - s[k]).abs());
            s[k] = next;
        }
        if moved < sweeps.settled {
            return sweep;
        }
    }
    sweeps.most
}

/// Active-set method for at most N unknowns; NN is the square of N.
fn active_set<const N: usize, const NN: usize>(
    normal: &[f64],
    right: &[f64],
    [lower, upper]: [f64; 2],
    sweeps: &Sweeps,
    s: &mut [f64],
) -> usize {
    let n = s.len();
    let (mut factor, mut slope, mut move_by) = ([0.0; NN], [0.0; N], [0.0; N]);
    s.iter_mut().for_each(|s| *s = s.clamp(lower, upper));
    for iteration in 1..=sweeps.most {
        // Compute the gradient of each unknown and the step that it would take alone. Find the largest step of the free
        // unknowns, and the largest of those at a bound.
        let (mut inside, mut chosen) = (0.0_f64, (0.0, None));
        for k in 0..n {
            let row = &normal[k * n..(k + 1) * n];
            slope[k] = dot(row, s) - right[k];
            let alone = ((s[k] - slope[k] / row[k]).clamp(lower, upper) - s[k]).abs();
            if alone.is_nan() {
                s.fill(f64::NAN);
                return iteration;
            }
            if lower < s[k] && s[k] < upper {
                inside = inside.max(alone);
            } else if alone > chosen.0 {
                chosen = (alone, Some(k));
            }
        }
        if inside.max(chosen.0) <= sweeps.settled {
            return iteration;
        }
        let chosen = if inside <= sweeps.settled { chosen.1 } else { None };
        let is_free = |k: usize| (lower < s[k] && s[k] < upper) || chosen == Some(k);
        solve(normal, &slope[..n], is_free, &mut factor, &mut move_by[..n]);
        // Step to the first bound that is reached.
        let (mut part, mut first) = (1.0, None);
        for k in (0..n).filter(|k| is_free(*k) && move_by[*k] != 0.0) {
            let end = if move_by[k] < 0.0 { lower } else { upper };
            let most = (end - s[k]) / move_by[k];
            if most < part {
                (part, first) = (most, Some((k, end)));
            }
        }
        let mut moved = false;
        for k in 0..n {
            let next = (s[k] + part * move_by[k]).clamp(lower, upper);
            let next = first.filter(|(at, _)| *at == k).map_or(next, |(_, end)| end);
            moved |= next != s[k];
            s[k] = next;
        }
        // No unknown moved, so round-off prevents further progress.
        if !moved {
            return iteration;
        }
    }
    sweeps.most
}

#[inline(always)]
fn dot(a: &[f64], b: &[f64]) -> f64 {
    let (a4, b4) = (a.as_chunks::<4>(), b.as_chunks::<4>());
    let mut sum = [0.0; 4];
    for (a, b) in a4.0.iter().zip(b4.0) {
        for i in 0..4 {
            sum[i] = a[i].mul_add(b[i], sum[i]);
        }
    }
    let rest: f64 = a4.1.iter().zip(b4.1).map(|(a, b)| a * b).sum();
    (sum[0] + sum[2]) + (sum[1] + sum[3]) + rest
}

/// Computes the step −N⁻¹ gradient for the free unknowns, 0 for the others. `factor` is L of N = L Lᵀ, with rows for free unknowns only and zeros in
/// the columns of the others.
fn solve(
    normal: &[f64],
    slope: &[f64],
    is_free: impl Fn(usize) -> bool,
    factor: &mut [f64],
    move_by: &mut [f64],
) {
    let n = slope.len();
    for i in 0..n {
        move_by[i] = 0.0;
        if !is_free(i) {
            continue;
        }
        let (above, row) = factor.split_at_mut(i * n);
        let row = &mut row[..n];
        for j in 0..i {
            row[j] = 0.0;
            if is_free(j) {
                let other = &above[j * n..j * n + j + 1];
                row[j] = (normal[i * n + j] - dot(&row[..j], &other[..j])) / other[j];
            }
        }
        let least = PIVOT_MIN * normal[i * n + i];
        row[i] = (normal[i * n + i] - dot(&row[..i], &row[..i])).max(least).sqrt();
        move_by[i] = (-slope[i] - dot(&row[..i], &move_by[..i])) / row[i];
    }
    for i in (0..n).rev().filter(|i| is_free(*i)) {
        move_by[i] /= factor[i * n + i];
        let moved = move_by[i];
        for (x, l) in move_by[..i].iter_mut().zip(&factor[i * n..i * n + i]) {
            *x -= l * moved;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const N: [f64; 9] = [4.0, 1.0, -0.5, 1.0, 3.0, 0.7, -0.5, 0.7, 2.0];
    const ITERATIONS: Sweeps = Sweeps { most: 50, settled: 1e-13 };

    fn minimum(normal: &[f64], right: &[f64], ends: [f64; 2], s: &mut [f64]) -> usize {
        bounded(normal, right, ends, &ITERATIONS, s)
    }

    /// Returns the largest move that an unknown would make on its own: zero at a minimum (Karush, Kuhn and Tucker).
    fn unsettled(normal: &[f64], right: &[f64], [lower, upper]: [f64; 2], s: &[f64]) -> f64 {
        let n = s.len();
        let alone = |k: usize| {
            let slope = (0..n).map(|j| normal[n * k + j] * s[j]).sum::<f64>() - right[k];
            ((s[k] - slope / normal[n * k + k]).clamp(lower, upper) - s[k]).abs()
        };
        (0..n).map(alone).fold(0.0, f64::max)
    }

    /// Without active bounds the method solves N s = r.
    #[test]
    fn far_from_its_ends_it_solves_the_system() {
        let right = [1.0, -2.0, 0.3];
        let mut s = [0.0; 3];
        let iterations = minimum(&N, &right, [-10.0, 10.0], &mut s);
        assert!(iterations <= 3, "{iterations}");
        for k in 0..3 {
            let row: f64 = (0..3).map(|j| N[3 * k + j] * s[j]).sum();
            assert!((row - right[k]).abs() < 1e-14);
        }
    }

    /// At a bound the gradient points outward; between bounds it is zero (Karush, Kuhn and Tucker). No neighbouring point has a lower cost.
    #[test]
    fn at_an_end_the_slope_pushes_against_it() {
        let right = [6.0, -4.0, 0.3];
        let mut s = [0.5; 3];
        minimum(&N, &right, [0.0, 1.0], &mut s);
        let slope = |k: usize| (0..3).map(|j| N[3 * k + j] * s[j]).sum::<f64>() - right[k];
        assert!(s[0] == 1.0 && slope(0) < 0.0 && s[1] == 0.0 && slope(1) > 0.0, "{s:?}");
        assert!(s[2] > 0.0 && s[2] < 1.0 && slope(2).abs() < 1e-12, "{s:?}");
        let cost = |s: &[f64; 3]| {
            let square: f64 =
                (0..3).map(|k| s[k] * (0..3).map(|j| N[3 * k + j] * s[j]).sum::<f64>()).sum();
            0.5 * square - (0..3).map(|k| right[k] * s[k]).sum::<f64>()
        };
        for k in 0..3 {
            for step in [-1e-3, 1e-3] {
                let mut near = s;
                near[k] = (near[k] + step).clamp(0.0, 1.0);
                assert!(cost(&near) >= cost(&s), "{k} {step}");
            }
        }
    }

    /// Problems of all sizes: full rank, with a small ε, and of rank 6 without it. From any start the method ends at the minimum, in about as many
    /// iterations as there are unknowns.
    #[test]
    fn every_minimum_is_one() {
        let mut seed = 5_u64;
        let mut random = move || {
            seed = seed
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1_442_695_040_888_963_407);
            (seed >> 11) as f64 / (1_u64 << 53) as f64 - 0.5
        };
        let (mut at_ends, mut between, mut longest) = (0, 0, 0);
        for case in 0..390 {
            let (n, rank) = (1 + case % 64, if case % 2 == 0 { 6 } else { 40 });
            let epsilon = [1e-3, 1e-6, 0.0][case % 3];
            let columns: Vec<f64> = (0..n * rank).map(|_| random()).collect();
            let column = |k: usize| &columns[k * rank..(k + 1) * rank];
            let mut normal = vec![0.0; n * n];
            for k in 0..n * n {
                let same = if k / n == k % n { epsilon } else { 0.0 };
                normal[k] = dot(column(k / n), column(k % n)) + same;
            }
            let w: Vec<f64> = (0..rank).map(|_| 2.0 * random()).collect();
            let right: Vec<f64> = (0..n).map(|k| dot(column(k), &w)).collect();
            let ends = [0.0, if case % 5 == 0 { f64::INFINITY } else { 1.0 }];
            let mut s: Vec<f64> = (0..n).map(|_| (2.0 * random()).clamp(0.0, 1.0)).collect();
            let sweeps = Sweeps { most: 300, settled: 1e-9 };
            let took = bounded(&normal, &right, ends, &sweeps, &mut s);
            let off = unsettled(&normal, &right, ends, &s);
            assert!(off <= 1e-9, "case {case}: {off:.1e} after {took}");
            longest = longest.max(took);
            at_ends += s.iter().filter(|s| **s == 0.0 || **s == 1.0).count();
            between += s.iter().filter(|s| **s > 0.0 && **s < 1.0).count();
        }
        assert!(at_ends > 1000 && between > 500, "{at_ends} {between}");
        assert!(longest < 100, "{longest}");
    }

    /// Without couplings each unknown ends at its own minimum.
    #[test]
    fn without_couplings_each_ends_for_itself() {
        let mut normal = [0.0; 25];
        (0..5).for_each(|k| normal[6 * k] = 1.0 + k as f64);
        let right = [0.5, -1.0, 6.0, 1.0, 0.0];
        for start in [0.0, 0.3, 1.0] {
            let mut s = [start; 5];
            minimum(&normal, &right, [0.0, 1.0], &mut s);
            for (s, want) in s.iter().zip([0.5, 0.0, 1.0, 0.25, 0.0]) {
                assert!((s - want).abs() < 1e-15, "{s} {want}");
            }
        }
    }

    /// More unknowns than the active-set method supports: the sweeps find the same minimum.
    #[test]
    fn many_numbers_end_at_the_minimum_by_sweeps() {
        let n = 80;
        let mut normal = vec![0.0; n * n];
        for k in 0..n * n {
            let apart = (k / n).abs_diff(k % n);
            normal[k] = if apart == 0 { 2.5 } else { 1.0 / (1.0 + apart as f64).powi(2) };
        }
        let right: Vec<f64> = (0..n).map(|k| 6.0 * (k as f64 * 0.7).sin()).collect();
        let mut s = vec![0.0; n];
        let sweeps = Sweeps { most: 2000, settled: 1e-13 };
        let took = bounded(&normal, &right, [0.0, 1.0], &sweeps, &mut s);
        let off = unsettled(&normal, &right, [0.0, 1.0], &s);
        assert!(took < 200 && off < 1e-12, "{took} {off:.1e}");
        assert!(s.iter().any(|s| *s > 0.0 && *s < 1.0) && s.contains(&0.0) && s.contains(&1.0));
    }

    #[test]
    fn numbers_that_are_none_end_as_such_and_starts_outside_come_in() {
        for (normal, right) in [([f64::NAN; 9], [0.0; 3]), (N, [0.0, f64::NAN, 0.0])] {
            let mut s = [0.5; 3];
            minimum(&normal, &right, [0.0, 1.0], &mut s);
            assert!(s.iter().all(|s| s.is_nan()), "{s:?}");
        }
        let mut s = [7.0, -7.0, 0.5];
        minimum(&N, &[6.0, -4.0, 0.3], [0.0, 1.0], &mut s);
        let mut other = [0.5; 3];
        minimum(&N, &[6.0, -4.0, 0.3], [0.0, 1.0], &mut other);
        for k in 0..3 {
            assert!((s[k] - other[k]).abs() < 1e-14, "{s:?} {other:?}");
        }
        let mut none = [];
        assert_eq!(minimum(&[], &[], [0.0, 1.0], &mut none), 1);
    }
}
