//! Limits between two neighbouring positions of a path, as linear rows over u = s̈ and x = ṡ².
//!
//! ```text
//! each row         a u + b x + c ≤ 0
//! u for an x       max over a < 0 of −(b x + c)/a  ≤  u  ≤  min over a > 0 of −(b x + c)/a
//! greatest x       from above: go to the smaller x where the two rows that exclude every u meet, and repeat (the set is convex)
//! ```

/// Larger than any x that a limit allows.
pub(super) const UNBOUNDED: f64 = 1e30;

/// Linear rows over (u, x).
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

    /// Adds the row a u + b x + c ≤ 0.
    pub fn row(&mut self, a: f64, b: f64, c: f64) {
        self.rows.push([a, b, c]);
    }

    /// Adds |a u + b x + c| ≤ most; adds no row when `most` is infinite.
    pub fn within(&mut self, a: f64, b: f64, c: f64, most: f64) {
        if most.is_finite() {
            self.row(a, b, c - most);
            self.row(-a, -b, -c - most);
        }
    }

    /// Returns the lines that bound u from below and from above at x.
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

    /// Returns the smallest and largest u at x.
    pub fn u(&self, x: f64) -> [f64; 2] {
        self.around(x).map(|l| l.at(x))
    }

    /// Returns the smallest and largest x in `low … high` for which an admissible u exists, or `None`.
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

    /// Starts at an x without an admissible u and returns the first x with one, in the direction `side`; `None` beyond `end`.
    fn towards(&self, mut x: f64, end: f64, side: f64) -> Option<f64> {
        // Each pass removes one pair of rows permanently, so this loop ends.
        for _ in 0..=self.rows.len() {
            if side * (end - x) < -1e-12 * end.abs() {
                return None;
            }
            let [low, high] = self.around(x);
            let (l, h) = (low.at(x), high.at(x));
            // The difference is infinite where no row bounds u; an admissible u then exists.
            if !(l - h > 1e-12 * (l.abs() + h.abs())) {
                return Some(x);
            }
            // The two lines diverge in this direction or are parallel.
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
