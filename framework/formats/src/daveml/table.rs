//! Functions of one or more variables from tables on a grid of breakpoints, or from points without a grid.
//! ```text
//! linear    y = Σ over the 2ⁿ corners of the cell  y_c Π (1 − f_i or f_i),  f = (u − b_k)/(b_k+1 − b_k)
//! discrete  the nearer breakpoint; floor, ceiling: the one below, above
//! outside   clamped, or the slope of the last cell goes on where `extrapolate` allows
//! ```

use super::axis::Axis;
use super::scattered::Scattered;

/// Maximum number of dimensions of a table: a cell has 2ⁿ corners.
pub(super) const DIMENSIONS: usize = 8;

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
