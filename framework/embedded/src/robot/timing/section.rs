//! What limits allow between two neighbouring places of a way: linear rows over u = s̈ and x = ṡ².
//!
//! ```text
//! each row         a u + b x + c ≤ 0
//! u for an x       max over a < 0 of −(b x + c)/a  ≤  u  ≤  min over a > 0 of −(b x + c)/a
//! greatest x       from above: the two rows that leave no u at x meet at a smaller x, and so on; each is convex, so that this ends at the greatest x
//! ```

/// Larger than any x that a limit leaves.
pub(super) const UNBOUNDED: f64 = 1e30;

/// Rows over (u, x).
#[derive(Clone, Debug)]
pub(super) struct Section {
    rows: Vec<[f64; 3]>,
}

/// A bound of u: the line p x + r.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Line {
    p: f64,
    r: f64,
}

impl Line {
    fn at(self, x: f64) -> f64 {
        self.p * x + self.r
    }
}

impl Section {
    pub fn new(room: usize) -> Self {
        Self { rows: Vec::with_capacity(room) }
    }

    pub fn clear(&mut self) {
        self.rows.clear();
    }

    /// a u + b x + c ≤ 0.
    pub fn row(&mut self, a: f64, b: f64, c: f64) {
        self.rows.push([a, b, c]);
    }

    /// |a u + b x + c| ≤ most; nothing when `most` is infinite.
    pub fn within(&mut self, a: f64, b: f64, c: f64, most: f64) {
        if most.is_finite() {
            self.row(a, b, c - most);
            self.row(-a, -b, -c - most);
        }
    }

    /// The lines that bound u from below and above at x.
    fn around(&self, x: f64) -> [Line; 2] {
        let none = f64::INFINITY;
        let mut out = [Line { p: 0.0, r: -none }, Line { p: 0.0, r: none }];
        let mut values = [-none, none];
        for &[a, b, c] in self.rows.iter().filter(|r| r[0] != 0.0) {
            let line = Line { p: -b / a, r: -c / a };
            let value = line.at(x);
            if a < 0.0 && value > values[0] {
                (out[0], values[0]) = (line, value);
            }
            if a > 0.0 && value < values[1] {
                (out[1], values[1]) = (line, value);
            }
        }
        out
    }

    /// Between which u may be at x.
    pub fn u(&self, x: f64) -> [f64; 2] {
        self.around(x).map(|l| l.at(x))
    }

    /// Least and greatest x within `low … high` for which there is a u; `None` when there is none.
    pub fn x(&self, mut low: f64, mut high: f64) -> Option<[f64; 2]> {
        for &[_, b, c] in self.rows.iter().filter(|r| r[0] == 0.0) {
            if b > 0.0 {
                high = high.min(-c / b);
            } else if b < 0.0 {
                low = low.max(-c / b);
            } else if c > 0.0 {
                return None;
            }
        }
        high = self.towards(high, low, -1.0)?;
        low = self.towards(low, high, 1.0)?;
        Some([low, high])
    }

    /// From x on, which leaves no u, to the first that leaves one; `side` says which way. `None` beyond `end`.
    fn towards(&self, mut x: f64, end: f64, side: f64) -> Option<f64> {
        // Each pass leaves one pair of rows for good.
        for _ in 0..=self.rows.len() {
            if side * (end - x) < -1e-12 * end.abs() {
                return None;
            }
            let [low, high] = self.around(x);
            let (l, h) = (low.at(x), high.at(x));
            // Infinite where nothing bounds u: there is one.
            if !(l - h > 1e-12 * (l.abs() + h.abs())) {
                return Some(x);
            }
            // They part that way, or no way.
            let slope = low.p - high.p;
            if !(slope * side < 0.0) {
                return None;
            }
            let next = (high.r - low.r) / slope;
            if !((next - x) * side > 0.0) {
                return Some(x);
            }
            x = next;
        }
        None
    }
}
