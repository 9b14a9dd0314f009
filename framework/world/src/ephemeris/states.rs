//! SPK segments with states at epochs, mostly of spacecraft: types 8, 9, 12 and 13.
//!
//! NAIF, *SPK Required Reading*:
//! ```text
//! 9, 13   N states of 6 numbers, N epochs, a directory of every hundredth epoch, size, N
//! 8, 12   N states of 6 numbers, first epoch, step, size, N
//! 8, 9    Lagrange's polynomial of degree `size` for each of the 6 numbers
//! 12, 13  Hermite's polynomial through `size` + 1 positions and velocities
//! ```

use linkwork_spatial::Vec3;

/// Maximum number of states per polynomial.
const WINDOW_MAX: usize = 32;

/// States at increasing epochs.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct States {
    /// TDB seconds past J2000.
    epochs: Vec<f64>,
    /// Position (km) and velocity (km/s).
    states: Vec<[f64; 6]>,
    /// Number of states per polynomial.
    window: usize,
    /// Whether positions and velocities are interpolated together.
    hermite: bool,
}

impl States {
    /// Reads the words of a segment. The error is the fact.
    pub(super) fn read(words: Vec<f64>, kind: i32) -> Result<States, String> {
        let (count, size) = (words[words.len() - 1] as usize, words[words.len() - 2] as usize);
        let even = matches!(kind, 8 | 12);
        let rest = if even { 4 } else { count + count.saturating_sub(1) / 100 + 2 };
        let window = size.saturating_add(1);
        if count == 0 || count.checked_mul(6).and_then(|n| n.checked_add(rest)) != Some(words.len())
        {
            return Err(format!("{count} states do not match its length"));
        }
        if !(2..=WINDOW_MAX).contains(&window) || window > count {
            return Err(format!("a polynomial through {window} of {count} states"));
        }
        let epochs: Vec<f64> = match even {
            true => {
                (0..count).map(|k| words[6 * count] + k as f64 * words[6 * count + 1]).collect()
            }
            false => words[6 * count..7 * count].to_vec(),
        };
        if !epochs.windows(2).all(|w| w[0] < w[1]) {
            return Err("its epochs are not strictly increasing".into());
        }
        let state = |s: &[f64]| [s[0], s[1], s[2], s[3], s[4], s[5]];
        let states = words[..6 * count].chunks_exact(6).map(state).collect();
        Ok(States { epochs, states, window, hermite: matches!(kind, 12 | 13) })
    }

    /// Returns position (km) and velocity (km/s).
    pub(super) fn at(&self, et: f64) -> [Vec3; 2] {
        let (n, w) = (self.epochs.len(), self.window);
        let above = self.epochs.partition_point(|e| *e <= et).clamp(1, n - 1);
        let low = above - 1;
        // An odd window is centred on the nearest epoch, an even one on the interval.
        let middle = match w % 2 {
            1 if self.epochs[above] - et <= et - self.epochs[low] => above,
            _ => low,
        };
        let first = middle.saturating_sub((w - 1) / 2).min(n - w);
        let (epochs, states) = (&self.epochs[first..first + w], &self.states[first..first + w]);
        let mut out = [Vec3::zeros(); 2];
        for axis in 0..3 {
            let values = |k: usize| states.iter().map(move |s| s[k]);
            let (p, v) = match self.hermite {
                true => hermite(epochs, values(axis).zip(values(axis + 3)), et),
                false => {
                    (lagrange(epochs, values(axis), et), lagrange(epochs, values(axis + 3), et))
                }
            };
            (out[0][axis], out[1][axis]) = (p, v);
        }
        out
    }
}

/// Evaluates Lagrange's polynomial, by Neville's scheme.
fn lagrange(x: &[f64], y: impl Iterator<Item = f64>, at: f64) -> f64 {
    let mut work = [0.0; WINDOW_MAX];
    work.iter_mut().zip(y).for_each(|(w, y)| *w = y);
    for j in 1..x.len() {
        for i in 0..x.len() - j {
            work[i] = ((at - x[i + j]) * work[i] + (x[i] - at) * work[i + 1]) / (x[i] - x[i + j]);
        }
    }
    work[0]
}

/// Evaluates Hermite's polynomial and its derivative, by divided differences at doubled nodes.
fn hermite(x: &[f64], y: impl Iterator<Item = (f64, f64)>, at: f64) -> (f64, f64) {
    let n = 2 * x.len();
    let place = |i: usize| x[i / 2];
    let (mut work, mut slopes) = ([0.0; 2 * WINDOW_MAX], [0.0; WINDOW_MAX]);
    for (k, (value, slope)) in y.enumerate() {
        (work[2 * k], work[2 * k + 1], slopes[k]) = (value, value, slope);
    }
    for j in 1..n {
        // Go backwards, so that differences of the previous order are still available.
        for i in (j..n).rev() {
            work[i] = match j {
                1 if i % 2 == 1 => slopes[i / 2],
                _ => (work[i] - work[i - 1]) / (place(i) - place(i - j)),
            };
        }
    }
    // Evaluate Newton's form and its derivative, by Horner's rule.
    let (mut value, mut slope) = (work[n - 1], 0.0);
    for i in (0..n - 1).rev() {
        slope = slope * (at - place(i)) + value;
        value = value * (at - place(i)) + work[i];
    }
    (value, slope)
}
