//! Statistics of one variable over time, with constant memory.
//!
//! ```text
//! mean   (1/T) ∫ y dt          std  √((1/T) ∫ (y − mean)² dt)        T: the time in which the variable exists
//! held   y Δt                  smooth  Simpson's rule on the dense output, with intervals halved until it converges;
//!                              the trapezoidal rule where the variable is nearly linear within a step
//! truth  the time from the instant at which it becomes true to that at which it becomes false
//! max    at instants, at ends of intervals, and at extrema of the dense output
//! ```
use super::quantiles::Quantiles;
use serde::{Deserialize, Serialize};

/// The statistics that a metric needs.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Wants {
    /// The last value.
    Last,
    /// Integrals of the variable and its square.
    Moments,
    /// The smallest and the largest value.
    Extremes,
    /// The distribution.
    Quantiles,
}

/// Statistics so far.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(super) struct Statistics {
    /// Time for which the variable has existed (s).
    pub time: f64,
    /// The first value; integrals are of the difference from it.
    first: f64,
    sum: f64,
    square: f64,
    /// Value and instant.
    pub min: (f64, f64),
    pub max: (f64, f64),
    /// The last value; NaN before the first.
    pub last: f64,
    pub quantiles: Option<Quantiles>,
    /// Slope and end of the last interval; `bend` is the change of the slope from the interval before.
    slope: f64,
    end: f64,
    bend: f64,
}

/// Accepted error of an integral over a panel, relative to the scale of the variable, and largest number of halvings of a panel.
const ACCURACY: f64 = 1e-6;
const HALVINGS: u32 = 7;
/// Largest number of points of an interval in the search for its extrema.
const POINTS: usize = 257;

/// Values inside an interval, at a position from 0 to 1.
pub(super) type Inside<'a> = dyn FnMut(f64) -> Option<f64> + 'a;

/// An interval of a variable: begin, length, first and last value.
#[derive(Clone, Copy, Debug)]
pub(super) struct Span {
    pub begin: f64,
    pub length: f64,
    pub start: f64,
    pub end: f64,
    /// The variable may be strongly nonlinear in it ([`Stretch::is_wide`](linkwork_runtime::Stretch::is_wide)).
    pub wide: bool,
}

impl Statistics {
    pub fn new(wants: Wants) -> Self {
        Statistics {
            time: 0.0,
            first: f64::NAN,
            sum: 0.0,
            square: 0.0,
            min: (f64::INFINITY, f64::NAN),
            max: (f64::NEG_INFINITY, f64::NAN),
            last: f64::NAN,
            quantiles: (wants == Wants::Quantiles).then(Quantiles::with_room),
            slope: f64::NAN,
            end: f64::NAN,
            bend: f64::INFINITY,
        }
    }

    /// Allocates the memory again, after reading from a file.
    pub fn make_room(&mut self) {
        if let Some(quantiles) = &mut self.quantiles {
            quantiles.make_room();
        }
    }

    /// Adds a value at an instant.
    pub fn see(&mut self, t: f64, y: f64) {
        if self.first.is_nan() {
            self.first = y;
        }
        if y < self.min.0 {
            self.min = (y, t);
        }
        if y > self.max.0 {
            self.max = (y, t);
        }
    }

    /// Adds the final value at an instant.
    pub fn instant(&mut self, t: f64, y: f64) {
        self.see(t, y);
        self.last = y;
    }

    fn add(&mut self, time: f64, y: f64, square: f64) {
        self.sum += time * y;
        self.square += time * square;
    }

    fn pass(&mut self, y: f64, time: f64) {
        if let Some(quantiles) = &mut self.quantiles {
            quantiles.pass(y, time);
        }
    }

    fn hold(&mut self, y: f64, time: f64) {
        if let Some(quantiles) = &mut self.quantiles {
            quantiles.hold(y, time);
        }
    }

    /// Adds a value that is held for a time.
    pub fn held(&mut self, begin: f64, length: f64, y: f64) {
        self.see(begin, y);
        let above = y - self.first;
        self.time += length;
        self.add(length, above, above * above);
        self.hold(y, length);
        self.end = f64::NAN;
    }

    /// Returns the scale of the variable's variation, for tolerances.
    fn scale(&self) -> f64 {
        (self.max.0 - self.min.0).max(1e-12 * self.max.0.abs().max(self.min.0.abs()))
    }

    /// Adds an interval in which the variable does not jump.
    pub fn smooth(&mut self, span: Span, wants: Wants, inside: &mut Inside<'_>) {
        let Span { begin, length, start, end, wide } = span;
        self.see(begin, start);
        let top = self.max.0;
        let bottom = self.min.0;
        self.see(begin + length, end);
        self.time += length;
        let slope = (end - start) / length;
        let joins = (start - self.end).abs() <= 1e-6 * (end - start).abs() + 1e-9 * self.scale();
        if joins {
            self.bend = (slope - self.slope).abs();
        }
        (self.slope, self.end) = (slope, end);
        // Estimate the deviation from a straight line. For a parabola it is 1/8 of the change of slope over the
        // interval.
        let scale = self.scale();
        let mut off = 0.25 * self.bend * length;
        if wide {
            off = off.max((end - start).abs());
        }
        let bends = |part: f64| wide || !(off <= part * scale);
        let sums = matches!(wants, Wants::Moments | Wants::Quantiles) && bends(1e-4);
        let turns = (end - start).abs() <= 8.0 * off;
        let beats = start.max(end) + off > top || start.min(end) - off < bottom;
        let extremes = wants == Wants::Extremes && beats && (wide || (turns && bends(1e-12)));
        let middle = if sums || extremes { inside(0.5) } else { None };
        let Some(middle) = middle.filter(|m| m.is_finite()) else {
            return self.straight(length, start, end, wants);
        };
        self.bend = 4.0 * (start - 2.0 * middle + end).abs() / length;
        let mut points = Points::default();
        points.push(0.0, start);
        let all = Panel { from: 0.0, to: 1.0, start, middle, end };
        if sums {
            let depth = if wide { HALVINGS } else { 3 };
            self.panel(all, (length, scale), depth, &mut points, inside);
        } else {
            points.push(0.5, middle);
            points.push(1.0, end);
            self.sum_panel(&all, length);
        }
        if wants == Wants::Extremes {
            for sign in [1.0, -1.0] {
                if let Some((part, y)) = points.extreme(sign, scale, inside) {
                    self.see(begin + part * length, y);
                }
            }
        }
    }

    fn straight(&mut self, length: f64, start: f64, end: f64, wants: Wants) {
        if wants == Wants::Moments {
            let (a, b) = (start - self.first, end - self.first);
            self.add(length, 0.5 * (a + b), (a * a + a * b + b * b) / 3.0);
        }
        match start == end {
            true => self.hold(start, length),
            false => self.pass(0.5 * (start + end), length),
        }
    }

    /// Integrates a panel with Simpson's rule, or its halves if the result differs.
    fn panel(
        &mut self,
        p: Panel,
        (length, scale): (f64, f64),
        depth: u32,
        points: &mut Points,
        inside: &mut Inside<'_>,
    ) {
        let width = p.to - p.from;
        // The relative error of Simpson's rule is about a twentieth of the squared relative error of the trapezoidal rule.
        let straight = 0.5 * (p.start + p.end);
        let off = (p.simpson() - straight).abs() / scale;
        let flat = 0.05 * off * off <= ACCURACY;
        if depth > 0 && !flat {
            let quarter = |part: f64, inside: &mut Inside<'_>| inside(p.from + part * width);
            if let (Some(left), Some(right)) = (quarter(0.25, inside), quarter(0.75, inside)) {
                let half = p.from + 0.5 * width;
                let a =
                    Panel { from: p.from, to: half, start: p.start, middle: left, end: p.middle };
                let b = Panel { from: half, to: p.to, start: p.middle, middle: right, end: p.end };
                let differs = (0.5 * (a.simpson() + b.simpson()) - p.simpson()).abs();
                let last = differs <= 15.0 * ACCURACY * scale;
                for half in [a, b] {
                    if last {
                        points.push(half.from + 0.25 * width, half.middle);
                        points.push(half.to, half.end);
                        self.sum_panel(&half, length);
                    } else {
                        self.panel(half, (length, scale), depth - 1, points, inside);
                    }
                }
                return;
            }
        }
        points.push(p.from + 0.5 * width, p.middle);
        points.push(p.to, p.end);
        self.sum_panel(&p, length);
    }

    fn sum_panel(&mut self, p: &Panel, length: f64) {
        let time = (p.to - p.from) * length;
        let [a, m, b] = [p.start, p.middle, p.end].map(|y| y - self.first);
        let of = |a: f64, m: f64, b: f64| (a + 4.0 * m + b) / 6.0;
        self.add(time, of(a, m, b), of(a * a, m * m, b * b));
        if a == m && m == b {
            self.hold(p.start, time);
        } else if self.quantiles.is_some() {
            for part in [0.125, 0.375, 0.625, 0.875] {
                self.pass(p.parabola(part), 0.25 * time);
            }
        }
    }

    /// Returns the mean; NaN without a value.
    pub fn mean(&self) -> f64 {
        if self.time > 0.0 { self.first + self.sum / self.time } else { self.last }
    }

    /// Returns the variance; NaN without a value.
    pub fn variance(&self) -> f64 {
        if self.time > 0.0 {
            let mean = self.sum / self.time;
            (self.square / self.time - mean * mean).max(0.0)
        } else {
            0.0 * self.last
        }
    }
}

/// A part of an interval with three values.
#[derive(Clone, Copy)]
struct Panel {
    from: f64,
    to: f64,
    start: f64,
    middle: f64,
    end: f64,
}

impl Panel {
    fn simpson(&self) -> f64 {
        (self.start + 4.0 * self.middle + self.end) / 6.0
    }

    /// Evaluates the parabola through its three values at a position.
    fn parabola(&self, part: f64) -> f64 {
        let (a, m, b) = (self.start, self.middle, self.end);
        let (s, c) = (4.0 * m - 3.0 * a - b, 2.0 * (a - 2.0 * m + b));
        a + part * (s + part * c)
    }
}

/// Known values of an interval, in order.
struct Points {
    list: [(f64, f64); POINTS],
    n: usize,
}

impl Default for Points {
    fn default() -> Self {
        Points { list: [(0.0, 0.0); POINTS], n: 0 }
    }
}

impl Points {
    fn push(&mut self, part: f64, y: f64) {
        if self.n < POINTS {
            self.list[self.n] = (part, y);
            self.n += 1;
        }
    }

    /// Returns the position of the largest (sign 1) or smallest (sign −1) interior value, if the extremum is in the interior.
    fn extreme(&self, sign: f64, scale: f64, inside: &mut Inside<'_>) -> Option<(f64, f64)> {
        let list = &self.list[..self.n];
        let above = |y: f64, than: f64| sign * (y - than) > 0.0;
        let best =
            (0..list.len()).reduce(|k, j| if above(list[j].1, list[k].1) { j } else { k })?;
        // Take three points with the extremum in the middle, or the first or last three points.
        let middle = best.clamp(1, list.len().checked_sub(2)?);
        let [mut low, mut high] = [list[middle - 1], list[middle + 1]];
        let mut top = list[middle];
        for _ in 0..12 {
            let part = vertex(low, top, high, sign)?;
            if !(low.0 < part && part < high.0) || (part - top.0).abs() < 1e-9 {
                break;
            }
            let found = (part, inside(part)?);
            let gain = sign * (found.1 - top.1);
            let (a, b) = if found.0 < top.0 { (found, top) } else { (top, found) };
            if gain > 0.0 {
                (low, high) = if found.0 < top.0 { (low, top) } else { (top, high) };
                top = found;
            } else {
                (low, high) = if found.0 < top.0 { (a, high) } else { (low, b) };
            }
            if gain.abs() <= 1e-12 * scale {
                break;
            }
        }
        Some(top)
    }
}

/// Returns the vertex of the parabola through three points, if it is a maximum (sign 1) or minimum (sign −1).
fn vertex(a: (f64, f64), m: (f64, f64), b: (f64, f64), sign: f64) -> Option<f64> {
    let (h, k) = (m.0 - a.0, b.0 - m.0);
    let (s, t) = ((m.1 - a.1) / h, (b.1 - m.1) / k);
    let curve = (t - s) / (h + k);
    if !(sign * curve < 0.0) {
        return None;
    }
    let slope = (s * k + t * h) / (h + k);
    Some(m.0 - slope / (2.0 * curve))
}

/// Returns the position in an interval at which a number changes its sign, given its values at both ends. There it has the sign of the end of the
/// interval. `inside` returns the number at a position.
pub(super) fn crossing(start: f64, end: f64, inside: &mut Inside<'_>) -> f64 {
    let (mut low, mut high) = ((0.0, start), (1.0, end));
    let side = |y: f64| y >= 0.0;
    let mut lean = 0;
    for k in 0..60 {
        if high.0 - low.0 < 1e-10 {
            break;
        }
        // Use the secant method, with a bisection every third time, because a jump does not have a
        // slope.
        let span = high.1 - low.1;
        let secant = low.0 - low.1 * (high.0 - low.0) / span;
        let middle = 0.5 * (low.0 + high.0);
        let inner = secant > low.0 && secant < high.0 && secant.is_finite() && k % 3 != 2;
        let part = if inner { secant } else { middle };
        let Some(y) = inside(part).filter(|y| !y.is_nan()) else { break };
        // Illinois variant: the value at an end that does not move is halved.
        if side(y) == side(end) {
            high = (part, y);
            low.1 *= if lean == 1 { 0.5 } else { 1.0 };
            lean = 1;
        } else {
            low = (part, y);
            high.1 *= if lean == 2 { 0.5 } else { 1.0 };
            lean = 2;
        }
    }
    high.0
}
