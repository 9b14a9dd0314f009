//! Bounded least squares: shares of jets, forces of feet, anything that has an end on either side.
//!
//! ```text
//! min ½ sᵀ N s − rᵀ s,  lower ≤ s ≤ upper          N = BᵀWB + ε, r = BᵀW w
//! ```
//! Projected Gauss–Seidel: each number in turn goes to where its own slope is zero, or to its end. It ends when no number moves by more than `settled` in a sweep; cost:
//! n² for each sweep.

/// When [`bounded`] ends.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sweeps {
    /// Sweeps at the most.
    pub most: usize,
    /// It ends when no number moves by more in a sweep.
    pub settled: f64,
}

/// Moves `s` to the minimum between `lower` and `upper`, from where it is; returns the sweeps that it took. `normal`: N (n × n, row after
/// row), symmetric with a positive diagonal. `right`: r. Numbers that are none end as such.
///
/// # Panics
/// When lengths do not agree.
pub fn bounded(
    normal: &[f64],
    right: &[f64],
    [lower, upper]: [f64; 2],
    sweeps: &Sweeps,
    s: &mut [f64],
) -> usize {
    let n = s.len();
    assert!(normal.len() == n * n && right.len() == n, "n = {n} numbers need n × n and n");
    for sweep in 1..=sweeps.most {
        let mut moved = 0.0_f64;
        for k in 0..n {
            let row = &normal[k * n..(k + 1) * n];
            let slope = row.iter().zip(&*s).map(|(h, s)| h * s).sum::<f64>() - right[k];
            let next = (s[k] - slope / row[k]).clamp(lower, upper);
            moved = moved.max((next - s[k]).abs());
            s[k] = next;
        }
        if moved < sweeps.settled {
            return sweep;
        }
    }
    sweeps.most
}

#[cfg(test)]
mod tests {
    use super::*;

    const N: [f64; 9] = [4.0, 1.0, -0.5, 1.0, 3.0, 0.7, -0.5, 0.7, 2.0];
    const SWEEPS: Sweeps = Sweeps { most: 200, settled: 1e-13 };

    /// Without ends in the way it solves N s = r.
    #[test]
    fn far_from_its_ends_it_solves_the_system() {
        let right = [1.0, -2.0, 0.3];
        let mut s = [0.0; 3];
        let sweeps = bounded(&N, &right, [-10.0, 10.0], &SWEEPS, &mut s);
        assert!(sweeps < 60, "{sweeps}");
        for k in 0..3 {
            let row: f64 = (0..3).map(|j| N[3 * k + j] * s[j]).sum();
            assert!((row - right[k]).abs() < 1e-11);
        }
    }

    /// At an end the slope pushes against it; between them it is zero (Karush, Kuhn and Tucker), so that no neighbour costs less.
    #[test]
    fn at_an_end_the_slope_pushes_against_it() {
        let right = [6.0, -4.0, 0.3];
        let mut s = [0.5; 3];
        bounded(&N, &right, [0.0, 1.0], &SWEEPS, &mut s);
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
}
