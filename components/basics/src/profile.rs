//! Profiles: position, rate and acceleration as piecewise polynomials of time.
//! ```text
//! piece k        q = Σ cᵢ τⁱ, i ≤ 5, τ = t − t_k          from row k to row k + 1
//! smooth         q, q̇, q̈ of a cubic spline at the rows inside; q̇ = q̈ = 0 at both ends: quintics, q̈ continuous
//! stops          q̇ = q̈ = 0 at every row: minimum-jerk quintics
//! rates                   linear between rows, or with q̈ = 0 at every row
//! accelerations   linear between rows, or constant from row to row
//! ```
//! Beyond its ends a profile is extrapolated with a constant value of its rows: constant position, rate or acceleration. The cubic spline has zero
//! rate at both ends; like any spline it may overshoot its rows.

/// Interpolation between the rows of a profile.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Between {
    /// The motion is continuous up to q̈; for positions and rates.
    Smooth,
    /// The motion is at rest at every row; for positions.
    Stops,
    /// The values are interpolated linearly; for rates and accelerations.
    Straight,
    /// The value is constant from each row to the next; for accelerations.
    Hold,
}

/// Motion of a profile at a time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Motion {
    /// Position.
    pub position: f64,
    /// Its rate.
    pub rate: f64,
    /// Its acceleration.
    pub acceleration: f64,
}

/// Coefficients of a piece, lowest power first.
type Piece = [f64; 6];

/// A profile.
#[derive(Clone, Debug)]
pub struct Profile {
    /// Times of the rows (s), strictly increasing.
    times: Vec<f64>,
    /// The piece before the first row, followed by the pieces that begin at each row.
    pieces: Vec<Piece>,
}

/// Returns the quintic between two end motions over a duration of `h` (s).
fn quintic(a: Motion, b: Motion, h: f64) -> Piece {
    let step = b.position - a.position;
    let (v0, v1, a0, a1) = (a.rate * h, b.rate * h, a.acceleration * h * h, b.acceleration * h * h);
    let c3 = 0.5 * (20.0 * step - (8.0 * v1 + 12.0 * v0) - (3.0 * a0 - a1));
    let c4 = 0.5 * (-30.0 * step + (14.0 * v1 + 16.0 * v0) + (3.0 * a0 - 2.0 * a1));
    let c5 = 0.5 * (12.0 * step - 6.0 * (v1 + v0) + (a1 - a0));
    let h3 = h * h * h;
    [a.position, a.rate, 0.5 * a.acceleration, c3 / h3, c4 / (h3 * h), c5 / (h3 * h * h)]
}

/// Returns the rates at the rows of the cubic spline with zero rate at its ends (tridiagonal system, Thomas algorithm).
fn spline_rates(rows: &[[f64; 2]]) -> Vec<f64> {
    let n = rows.len();
    let (mut upper, mut m) = (vec![0.0; n], vec![0.0; n]);
    for i in 1..n - 1 {
        let (h0, h1) = (rows[i][0] - rows[i - 1][0], rows[i + 1][0] - rows[i][0]);
        let (s0, s1) = ((rows[i][1] - rows[i - 1][1]) / h0, (rows[i + 1][1] - rows[i][1]) / h1);
        let (low, high) = (1.0 / h0, 1.0 / h1);
        let pivot = 2.0 * (low + high) - low * upper[i - 1];
        upper[i] = high / pivot;
        m[i] = (3.0 * (s0 * low + s1 * high) - low * m[i - 1]) / pivot;
    }
    // The rates at the first and the last row are zero.
    for i in (1..n - 1).rev() {
        m[i] -= upper[i] * m[i + 1];
    }
    m
}

impl Profile {
    /// Creates a profile through positions (time, position), smooth or with stops. Creates a profile from at least two rows with strictly increasing
    /// times.
    #[must_use]
    pub fn of_positions(rows: &[[f64; 2]], between: Between) -> Profile {
        let at = |row: &[f64; 2]| Motion { position: row[1], rate: 0.0, acceleration: 0.0 };
        let mut ends: Vec<Motion> = rows.iter().map(at).collect();
        if between == Between::Smooth {
            let rates = spline_rates(rows);
            for i in 1..rows.len() - 1 {
                let h = rows[i][0] - rows[i - 1][0];
                let slope = (rows[i][1] - rows[i - 1][1]) / h;
                let acceleration = (2.0 * rates[i - 1] + 4.0 * rates[i] - 6.0 * slope) / h;
                (ends[i].rate, ends[i].acceleration) = (rates[i], acceleration);
            }
        }
        let hold = |y: f64| [y, 0.0, 0.0, 0.0, 0.0, 0.0];
        let mut pieces = vec![hold(rows[0][1])];
        for (row, end) in rows.windows(2).zip(ends.windows(2)) {
            pieces.push(quintic(end[0], end[1], row[1][0] - row[0][0]));
        }
        pieces.push(hold(rows[rows.len() - 1][1]));
        Profile { times: rows.iter().map(|r| r[0]).collect(), pieces }
    }

    /// Creates a profile from rates (time, rate), linear or smooth; `start`: position at the first row.
    #[must_use]
    pub fn of_rates(rows: &[[f64; 2]], between: Between, start: f64) -> Profile {
        let mut q = start;
        let mut pieces = vec![[q, rows[0][1], 0.0, 0.0, 0.0, 0.0]];
        for pair in rows.windows(2) {
            let ([t0, r0], [t1, r1]) = (pair[0], pair[1]);
            let (h, step) = (t1 - t0, r1 - r0);
            pieces.push(match between {
                Between::Smooth => [q, r0, 0.0, step / (h * h), -0.5 * step / (h * h * h), 0.0],
                _ => [q, r0, 0.5 * step / h, 0.0, 0.0, 0.0],
            });
            q += 0.5 * h * (r0 + r1);
        }
        pieces.push([q, rows[rows.len() - 1][1], 0.0, 0.0, 0.0, 0.0]);
        Profile { times: rows.iter().map(|r| r[0]).collect(), pieces }
    }

    /// Creates a profile from accelerations (time, acceleration), linear or constant between rows; `start`, `start_rate`: position and rate at
    /// the first row.
    #[must_use]
    pub fn of_accelerations(
        rows: &[[f64; 2]],
        between: Between,
        (start, start_rate): (f64, f64),
    ) -> Profile {
        let (mut q, mut v) = (start, start_rate);
        let mut pieces = vec![[q, v, 0.5 * rows[0][1], 0.0, 0.0, 0.0]];
        for pair in rows.windows(2) {
            let ([t0, a0], [t1, a1]) = (pair[0], pair[1]);
            let h = t1 - t0;
            let jerk = if between == Between::Hold { 0.0 } else { (a1 - a0) / h };
            pieces.push([q, v, 0.5 * a0, jerk / 6.0, 0.0, 0.0]);
            q += h * (v + h * (0.5 * a0 + h * jerk / 6.0));
            v += h * (a0 + 0.5 * h * jerk);
        }
        pieces.push([q, v, 0.5 * rows[rows.len() - 1][1], 0.0, 0.0, 0.0]);
        Profile { times: rows.iter().map(|r| r[0]).collect(), pieces }
    }

    /// Returns the number of rows at or before `t`, which is the index of the piece at `t`.
    #[must_use]
    pub fn piece(&self, t: f64) -> usize {
        self.times.partition_point(|row| *row <= t)
    }

    /// Returns the start and end of a piece (s).
    #[must_use]
    pub fn ends(&self, piece: usize) -> (f64, f64) {
        let begin = if piece == 0 { f64::NEG_INFINITY } else { self.times[piece - 1] };
        (begin, self.times.get(piece).copied().unwrap_or(f64::INFINITY))
    }

    /// Evaluates a piece at `t`, also beyond its ends.
    #[must_use]
    pub fn at(&self, piece: usize, t: f64) -> Motion {
        let tau = t - self.times[piece.saturating_sub(1)];
        let [c0, c1, c2, c3, c4, c5] = self.pieces[piece];
        Motion {
            position: c0 + tau * (c1 + tau * (c2 + tau * (c3 + tau * (c4 + tau * c5)))),
            rate: c1 + tau * (2.0 * c2 + tau * (3.0 * c3 + tau * (4.0 * c4 + tau * 5.0 * c5))),
            acceleration: 2.0 * c2 + tau * (6.0 * c3 + tau * (12.0 * c4 + tau * 20.0 * c5)),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const ROWS: [[f64; 2]; 5] = [[0.5, 0.2], [1.3, 1.1], [1.9, -0.4], [3.6, 0.3], [4.0, 0.7]];

    /// Returns the greatest jumps of position, rate and acceleration at the rows.
    fn jumps(p: &Profile) -> [f64; 3] {
        let mut most = [0.0f64; 3];
        for (k, t) in p.times.iter().enumerate() {
            let (a, b) = (p.at(k, *t), p.at(k + 1, *t));
            let d = [a.position - b.position, a.rate - b.rate, a.acceleration - b.acceleration];
            most = std::array::from_fn(|i| {
                assert!(d[i].is_finite());
                most[i].max(d[i].abs())
            });
        }
        most
    }

    /// Rate and acceleration are derivatives of the position, in every piece.
    fn consistent(p: &Profile) {
        for k in 0..p.pieces.len() {
            let (begin, end) = p.ends(k);
            let t =
                if begin.is_finite() && end.is_finite() { 0.5 * (begin + end) } else { p.times[0] };
            let h = 1e-4;
            let (a, b, c) = (p.at(k, t - h), p.at(k, t), p.at(k, t + h));
            assert!((0.5 * (c.position - a.position) / h - b.rate).abs() < 1e-6);
            assert!((0.5 * (c.rate - a.rate) / h - b.acceleration).abs() < 1e-5);
        }
    }

    #[test]
    fn positions_are_met_and_nothing_jumps_up_to_the_acceleration() {
        for between in [Between::Smooth, Between::Stops] {
            let p = Profile::of_positions(&ROWS, between);
            consistent(&p);
            assert!(jumps(&p).iter().all(|j| *j < 1e-11), "{between:?}: {:?}", jumps(&p));
            for [t, q] in ROWS {
                assert!((p.at(p.piece(t), t).position - q).abs() < 1e-14);
            }
            for t in [-3.0, 0.5, 4.0, 99.0] {
                let m = p.at(p.piece(t), t);
                assert!(m.rate.abs() + m.acceleration.abs() < 1e-11, "{t}: {m:?}");
            }
        }
        let inside = Profile::of_positions(&ROWS, Between::Smooth).at(2, 1.3);
        assert!(inside.rate.abs() > 0.1, "a smooth profile does not stop on its way");
        let least = Profile::of_positions(&[[1.0, 2.0], [5.0, 10.0]], Between::Stops);
        // The profile of least jerk is q₀ + Δ (10 s³ − 15 s⁴ + 6 s⁵). Its rate in the middle is
        // 15/8 Δ/h.
        let m = least.at(1, 3.0);
        assert!((m.position - 6.0).abs() < 1e-12 && (m.rate - 15.0 / 8.0 * 2.0).abs() < 1e-12);
        assert!(m.acceleration.abs() < 1e-12);
    }

    /// Inner pieces are those of the cubic spline, without a fourth or fifth power.
    #[test]
    fn inside_a_smooth_profile_is_the_cubic_spline() {
        let rows: Vec<[f64; 2]> =
            (0..9).map(|k| [f64::from(k), (0.7 * f64::from(k)).sin()]).collect();
        let p = Profile::of_positions(&rows, Between::Smooth);
        for k in 2..8 {
            assert!(p.pieces[k][4].abs() + p.pieces[k][5].abs() < 1e-12, "{:?}", p.pieces[k]);
        }
        assert!(p.pieces[1][4].abs() > 1e-3);
    }

    #[test]
    fn rates_and_accelerations_integrate_to_their_areas() {
        let p = Profile::of_rates(&[[0.0, 0.0], [2.0, 3.0], [4.0, 3.0]], Between::Straight, -1.0);
        consistent(&p);
        let (end, later) = (p.at(p.piece(4.0), 4.0), p.at(p.piece(5.0), 5.0));
        assert_eq!((end.position, later.position, later.rate), (8.0, 11.0, 3.0));
        let smooth = Profile::of_rates(&ROWS, Between::Smooth, 0.4);
        consistent(&smooth);
        assert!(jumps(&smooth).iter().all(|j| *j < 1e-12));
        let area: f64 =
            ROWS.windows(2).map(|w| 0.5 * (w[1][0] - w[0][0]) * (w[0][1] + w[1][1])).sum();
        assert!((smooth.at(5, 4.0).position - 0.4 - area).abs() < 1e-12);
        let p = Profile::of_accelerations(&[[0.0, 2.0], [3.0, 0.0]], Between::Hold, (1.0, -1.0));
        consistent(&p);
        let end = p.at(p.piece(3.0), 3.0);
        assert_eq!((end.position, end.rate, end.acceleration), (1.0 - 3.0 + 9.0, 5.0, 0.0));
        let p = Profile::of_accelerations(&ROWS, Between::Straight, (0.0, 0.3));
        consistent(&p);
        assert!(jumps(&p).iter().all(|j| *j < 1e-12));
        assert!((p.at(5, 4.0).rate - 0.3 - area).abs() < 1e-12);
    }
}
