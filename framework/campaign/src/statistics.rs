//! Statistics of the orderly runs, which are those that ended normally.
//!
//! ```text
//! mean       m = Σ y / n              deviation  s² = Σ (y − m)² / (n − 1)       error of the mean  s / √n
//! percentile linear between the ordered values y₀ … y₍ₙ₋₁₎ at p (n − 1)          (type 7 of Hyndman and Fan, 1996)
//! rank correlation (Spearman): the correlation of the ranks; ties have the mean of their ranks
//! fraction   p = k/n, and Wilson's interval (1927): (p + z²/2n ± z √(p (1 − p)/n + z²/4n²))/(1 + z²/n), z = 1.959964 for 95 %
//! ellipse    of k deviations: centre m, half axes k √λ along the eigenvectors of the covariance
//!            a normal distribution has the probability 1 − exp(−k²/2) in it: k = √(−2 ln(1 − P)), 3.035 for P = 99 %
//! ```
//! The error of the mean and Wilson's interval assume independent runs. The runs of a Latin hypercube or a Sobol sequence depend on
//! each other, and their means usually have much smaller errors than s/√n. One campaign does not show how much smaller: that takes
//! repetitions with other seeds. Therefore `Summary::error` is NaN for them.
//!
//! NaN values (such as metrics of a phase that did not begin) are omitted and not counted in `n`.

use crate::sampling::Sampling;

/// Summary of one metric over all runs.
#[derive(Clone, Debug, PartialEq)]
pub struct Summary {
    /// Number of runs with a value.
    pub n: usize,
    /// Mean.
    pub mean: f64,
    /// Standard deviation of the runs; NaN for fewer than two.
    pub deviation: f64,
    /// Standard error of the mean; NaN if the runs are not independent.
    pub error: f64,
    /// Smallest, 1 %, 5 %, 25 %, 50 %, 75 %, 95 %, 99 %, largest.
    pub percentiles: [f64; 9],
}

/// The probabilities of [`Summary::percentiles`].
pub const PERCENTILES: [f64; 9] = [0.0, 0.01, 0.05, 0.25, 0.5, 0.75, 0.95, 0.99, 1.0];

impl Summary {
    /// Summarizes the values of runs that were sampled by `how`. Cost: n log n.
    pub fn of(values: &[f64], how: Sampling) -> Summary {
        let mut y: Vec<f64> = values.iter().copied().filter(|y| !y.is_nan()).collect();
        y.sort_by(f64::total_cmp);
        let n = y.len();
        let mean = mean(&y);
        let deviation = covariance(&y, &y).sqrt();
        let percentiles = PERCENTILES.map(|p| percentile(&y, p));
        let error = match how {
            Sampling::Random => deviation / (n as f64).sqrt(),
            Sampling::LatinHypercube | Sampling::Sobol => f64::NAN,
        };
        Summary { n, mean, deviation, error, percentiles }
    }
}

/// Returns the fraction `k` of `n`, and its 95 % confidence interval; NaN for n = 0.
pub fn share(k: usize, n: usize) -> (f64, [f64; 2]) {
    let (p, n, z) = (k as f64 / n as f64, n as f64, 1.959_964);
    let (middle, wide) =
        (p + z * z / (2.0 * n), z * (p * (1.0 - p) / n + z * z / (4.0 * n * n)).sqrt());
    let at = |y: f64| (y / (1.0 + z * z / n)).clamp(0.0, 1.0);
    (p, [at(middle - wide), at(middle + wide)])
}

/// Returns a percentile of sorted values; NaN without values.
pub fn percentile(sorted: &[f64], p: f64) -> f64 {
    let Some(last) = sorted.len().checked_sub(1) else { return f64::NAN };
    let at = p * last as f64;
    let (k, rest) = ((at.floor() as usize).min(last), at.fract());
    match rest {
        0.0 => sorted[k],
        _ => sorted[k] + rest * (sorted[(k + 1).min(last)] - sorted[k]),
    }
}

fn mean(y: &[f64]) -> f64 {
    y.iter().sum::<f64>() / y.len() as f64
}

/// Returns the covariance of two lists of equal length, NaN for fewer than two values.
fn covariance(x: &[f64], y: &[f64]) -> f64 {
    if x.len() < 2 {
        return f64::NAN;
    }
    let (a, b) = (mean(x), mean(y));
    x.iter().zip(y).map(|(x, y)| (x - a) * (y - b)).sum::<f64>() / (x.len() - 1) as f64
}

/// Returns the pairs without NaN.
pub fn pairs(x: &[f64], y: &[f64]) -> (Vec<f64>, Vec<f64>) {
    x.iter().zip(y).filter(|(x, y)| !x.is_nan() && !y.is_nan()).unzip()
}

/// Returns Spearman's rank correlation; NaN if one of the two is constant. Cost: n log n.
pub fn rank_correlation(x: &[f64], y: &[f64]) -> f64 {
    let (x, y) = pairs(x, y);
    let (x, y) = (ranks(&x), ranks(&y));
    let r = covariance(&x, &y) / (covariance(&x, &x) * covariance(&y, &y)).sqrt();
    // Round-off can move r slightly out of the range.
    if r.is_nan() { r } else { r.clamp(-1.0, 1.0) }
}

fn ranks(y: &[f64]) -> Vec<f64> {
    let mut order: Vec<usize> = (0..y.len()).collect();
    order.sort_by(|a, b| y[*a].total_cmp(&y[*b]));
    let mut ranks = vec![0.0; y.len()];
    let mut k = 0;
    while k < order.len() {
        let same = order[k..].iter().take_while(|j| y[**j] == y[order[k]]).count().max(1);
        let rank = k as f64 + (same - 1) as f64 / 2.0;
        order[k..k + same].iter().for_each(|j| ranks[*j] = rank);
        k += same;
    }
    ranks
}

/// The one-sigma ellipse of two metrics.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ellipse {
    /// Centre.
    pub centre: (f64, f64),
    /// Half axes, the longer first.
    pub axes: (f64, f64),
    /// Angle from the first coordinate to the longer axis (rad).
    pub angle: f64,
}

impl Ellipse {
    /// Computes the ellipse of the finite pairs; `None` for fewer than three.
    pub fn of(x: &[f64], y: &[f64]) -> Option<Ellipse> {
        let (x, y) = pairs(x, y);
        if x.len() < 3 || x.iter().chain(&y).any(|v| !v.is_finite()) {
            return None;
        }
        let (a, b, c) = (covariance(&x, &x), covariance(&x, &y), covariance(&y, &y));
        let (half, root) = ((a + c) / 2.0, ((a - c) / 2.0).hypot(b));
        let axes = ((half + root).max(0.0).sqrt(), (half - root).max(0.0).sqrt());
        Some(Ellipse { centre: (mean(&x), mean(&y)), axes, angle: 0.5 * (2.0 * b).atan2(a - c) })
    }

    /// Returns the number of deviations of the ellipse that contains a normal distribution with the probability `p`.
    pub fn deviations(p: f64) -> f64 {
        (-2.0 * (-p).ln_1p()).sqrt()
    }

    /// Returns the number of pairs within the `k`-sigma ellipse, and the number of pairs without NaN.
    pub fn within(&self, k: f64, x: &[f64], y: &[f64]) -> (usize, usize) {
        let (x, y) = pairs(x, y);
        let (sin, cos) = self.angle.sin_cos();
        let inside = x.iter().zip(&y).filter(|(x, y)| {
            let (dx, dy) = (*x - self.centre.0, *y - self.centre.1);
            let (u, v) = (dx * cos + dy * sin, dy * cos - dx * sin);
            // A degenerate ellipse is a line: points on it have v = 0 to round-off.
            let share = |d: f64, axis: f64| if axis > 0.0 { d / axis } else { 0.0 };
            share(u, self.axes.0).hypot(share(v, self.axes.1)) <= k
        });
        (inside.count(), x.len())
    }

    /// Returns the point of the `k`-sigma ellipse at the parameter `s` (rad).
    pub fn point(&self, k: f64, s: f64) -> (f64, f64) {
        let (u, v) = (k * self.axes.0 * s.cos(), k * self.axes.1 * s.sin());
        let (sin, cos) = self.angle.sin_cos();
        (self.centre.0 + u * cos - v * sin, self.centre.1 + u * sin + v * cos)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn near(a: f64, b: f64, tolerance: f64) {
        assert!((a - b).abs() <= tolerance, "{a} against {b}");
    }

    #[test]
    fn a_summary_by_hand() {
        let s = Summary::of(&[4.0, f64::NAN, 1.0, 3.0, 2.0], Sampling::Random);
        assert_eq!((s.n, s.mean), (4, 2.5));
        near(s.deviation, (5.0f64 / 3.0).sqrt(), 1e-15);
        near(s.error, (5.0f64 / 12.0).sqrt(), 1e-15);
        // Reference: numpy.percentile([1, 2, 3, 4], [0, 1, 5, 25, 50, 75, 95, 99, 100])
        for (a, b) in
            s.percentiles.into_iter().zip([1.0, 1.03, 1.15, 1.75, 2.5, 3.25, 3.85, 3.97, 4.0])
        {
            near(a, b, 1e-14);
        }
        let of = |y: &[f64]| Summary::of(y, Sampling::Random);
        assert!(of(&[]).mean.is_nan() && of(&[1.0]).deviation.is_nan());
        for how in [Sampling::LatinHypercube, Sampling::Sobol] {
            let other = Summary::of(&[4.0, f64::NAN, 1.0, 3.0, 2.0], how);
            assert!(other.error.is_nan() && other.deviation == s.deviation, "{how:?}");
        }
    }

    #[test]
    fn rank_correlation_sees_order_and_nothing_else() {
        let x: Vec<f64> = (0..20).map(f64::from).collect();
        let up: Vec<f64> = x.iter().map(|x| x.exp()).collect();
        let down: Vec<f64> = x.iter().map(|x| -x * x * x).collect();
        near(rank_correlation(&x, &up), 1.0, 1e-15);
        near(rank_correlation(&x, &down), -1.0, 1e-15);
        assert!(rank_correlation(&x, &[1.0; 20]).is_nan());
        // With ties, computed by hand: the ranks (0, 1.5, 1.5, 3) and (1, 0, 2, 3) give 3 / √(4.5 ·
        // 5).
        near(rank_correlation(&[1.0, 2.0, 2.0, 3.0], &[5.0, 4.0, 6.0, 7.0]), 0.632_455_532, 1e-9);
        // A NaN excludes its pair.
        near(rank_correlation(&[1.0, f64::NAN, 3.0], &[1.0, -9.0, 2.0]), 1.0, 1e-15);
    }

    /// Points on an ellipse with known axes, evenly spaced in its parameter: their covariance is that of the ellipse times (n/(n − 1))/2.
    #[test]
    fn the_ellipse_of_points_on_an_ellipse() {
        let known = Ellipse { centre: (3.0, -2.0), axes: (5.0, 1.0), angle: 0.6 };
        let n = 360;
        let (x, y): (Vec<f64>, Vec<f64>) = (0..n)
            .map(|k| known.point(1.0, f64::from(k) * std::f64::consts::TAU / f64::from(n)))
            .unzip();
        let e = Ellipse::of(&x, &y).unwrap();
        let factor = (f64::from(n) / f64::from(n - 1) / 2.0).sqrt();
        near(e.axes.0, 5.0 * factor, 1e-12);
        near(e.axes.1, factor, 1e-12);
        near(e.angle, 0.6, 1e-12);
        near(e.centre.0, 3.0, 1e-12);
        near(e.centre.1, -2.0, 1e-12);
        assert!(Ellipse::of(&[1.0, 2.0], &[1.0, 2.0]).is_none());
    }

    /// The squared deviations agree with the χ² distribution with two degrees of freedom, computed by `scipy.stats.chi2(2).ppf(p)`.
    #[test]
    fn ellipses_contain_their_probability() {
        for (p, k2) in [(0.5, 1.386_294_361_119_891), (0.99, 9.210_340_371_976_18)] {
            near(Ellipse::deviations(p).powi(2), k2, 1e-12);
        }
        let e = Ellipse { centre: (3.0, -2.0), axes: (5.0, 1.0), angle: 0.6 };
        // Points at 0.999 and 1.001 deviations all around, and one without a value.
        let at = |k: f64| (0..40).map(move |j| e.point(k, f64::from(j) * 0.16));
        let (mut x, mut y): (Vec<f64>, Vec<f64>) = at(0.999).chain(at(1.001)).unzip();
        x.push(f64::NAN);
        y.push(0.0);
        assert_eq!(e.within(1.0, &x, &y), (40, 80));
        assert_eq!(e.within(1.01, &x, &y), (80, 80));
    }
}
