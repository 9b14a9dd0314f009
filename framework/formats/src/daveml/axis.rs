//! Axes of tables.

/// Interpolation along one independent variable.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Interpolation {
    Linear,
    Nearest,
    Floor,
    Ceiling,
}

/// One independent variable.
#[derive(Clone, Debug)]
pub(super) struct Axis {
    /// Index of the variable.
    pub variable: usize,
    /// Increasing breakpoints, at least one.
    pub points: Vec<f64>,
    pub way: Interpolation,
    /// Whether to extrapolate below the first and above the last breakpoint.
    pub beyond: [bool; 2],
    /// `min`, `max`: the variable is first clamped to these limits.
    pub limits: [f64; 2],
}

impl Axis {
    /// Returns the breakpoint below, the fraction of the way to the next, and the distance from the edge as a share of the width.
    pub(super) fn place(&self, values: &[f64]) -> (usize, f64, f64) {
        let p = &self.points;
        let (first, last) = (p[0], p[p.len() - 1]);
        let u = values[self.variable].clamp(self.limits[0], self.limits[1]);
        if p.len() == 1 {
            return (0, 0.0, 1.0);
        }
        let width = last - first;
        let side = |distance: f64, beyond: bool| if beyond { 1.0 } else { distance / width };
        let inside = side(u - first, self.beyond[0]).min(side(last - u, self.beyond[1]));
        let low = if self.beyond[0] { f64::NEG_INFINITY } else { first };
        let high = if self.beyond[1] { f64::INFINITY } else { last };
        let u = u.clamp(low, high);
        let k = p.partition_point(|b| *b <= u).clamp(1, p.len() - 1) - 1;
        let f = (u - p[k]) / (p[k + 1] - p[k]);
        let f = match self.way {
            Interpolation::Linear => f,
            Interpolation::Nearest => f64::from(u8::from(f >= 0.5)),
            Interpolation::Floor => f64::from(u8::from(f >= 1.0)),
            Interpolation::Ceiling => f64::from(u8::from(f > 0.0)),
        };
        (k, f, inside)
    }
}
