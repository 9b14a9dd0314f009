//! Functions of one or more variables from tables on a grid of breakpoints, or from points without a grid.
//! ```text
//! linear    y = Σ over the 2ⁿ corners of the cell  y_c Π (1 − f_i or f_i),  f = (u − b_k)/(b_k+1 − b_k)
//! discrete  the nearer breakpoint; floor, ceiling: the one below, above
//! outside   clamped, or the slope of the last cell goes on where `extrapolate` allows
//! ```

use super::scattered::Scattered;

/// Maximum number of dimensions of a table: a cell has 2ⁿ corners.
pub(super) const DIMENSIONS: usize = 8;

/// Interpolation along one independent variable.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Way {
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
    pub way: Way,
    /// Whether to extrapolate below the first and above the last breakpoint.
    pub beyond: [bool; 2],
    /// `min`, `max`: the variable is first clamped to these limits.
    pub limits: [f64; 2],
}

/// A function.
#[derive(Clone, Debug)]
pub(super) enum Function {
    Grid(Grid),
    Scattered(Scattered),
}

/// A table over axes; the last axis varies fastest.
#[derive(Clone, Debug)]
pub(super) struct Grid {
    pub axes: Vec<Axis>,
    pub data: Vec<f64>,
}

impl Axis {
    /// Returns the breakpoint below, the fraction of the way to the next, and the distance from the edge as a share of the width.
    fn place(&self, values: &[f64]) -> (usize, f64, f64) {
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
            Way::Linear => f,
            Way::Nearest => f64::from(u8::from(f >= 0.5)),
            Way::Floor => f64::from(u8::from(f >= 1.0)),
            Way::Ceiling => f64::from(u8::from(f > 0.0)),
        };
        (k, f, inside)
    }
}

impl Function {
    /// Returns the value, and the distance of the point from the edge of the table.
    pub fn value(&self, values: &[f64]) -> (f64, f64) {
        match self {
            Function::Grid(grid) => grid.value(values),
            Function::Scattered(scattered) => scattered.value(values),
        }
    }

    /// The independent variables.
    pub fn variables(&self) -> impl Iterator<Item = usize> + '_ {
        let axes = match self {
            Function::Grid(grid) => &grid.axes[..],
            Function::Scattered(scattered) => &scattered.axes[..],
        };
        axes.iter().map(|axis| axis.variable)
    }
}

impl Grid {
    /// Returns the value, and the distance of the point from the edge of the table.
    pub fn value(&self, values: &[f64]) -> (f64, f64) {
        let n = self.axes.len();
        let mut at = [(0, 0.0); DIMENSIONS];
        let mut inside = 1.0_f64;
        for (slot, axis) in at.iter_mut().zip(&self.axes) {
            let (k, f, margin) = axis.place(values);
            *slot = (k, f);
            inside = inside.min(margin);
        }
        let mut sum = 0.0;
        for corner in 0..1usize << n {
            let (mut weight, mut index) = (1.0, 0);
            for (i, axis) in self.axes.iter().enumerate() {
                let (k, f) = at[i];
                let up = corner >> i & 1 == 1;
                weight *= if up { f } else { 1.0 - f };
                index =
                    index * axis.points.len() + (k + usize::from(up)).min(axis.points.len() - 1);
            }
            // A corner with the weight zero may be NaN.
            if weight != 0.0 {
                sum += weight * self.data[index];
            }
        }
        (sum, inside)
    }
}
