//! Heights on a regular grid as a smooth surface: cubic convolution (Catmull–Rom) between nodes.
//! ```text
//! h(x, y) = Σ_j Σ_i w_j(v) w_i(u) h_ij      over 4 × 4 nodes
//! w(t) = ½ [−t + 2t² − t³,  2 − 5t² + 3t³,  t + 4t² − 3t³,  −t² + t³]
//! n ∝ (−∂h/∂x, −∂h/∂y, 1)
//! ```
//! The surface passes through the nodes. Its normal is the exact gradient and continuous, so a rolling wheel does not feel edges between cells;
//! quadratic ground is reproduced exactly. At the border a ghost row extrapolates the slope. If a node of the 4 × 4 block has no data, the cell uses
//! bilinear interpolation of its own four nodes; if one of those has no data, there is no ground. O(1).

use linkwork_multibody::spatial::Vec3;
use wide::f64x4;

/// Faults of a grid of heights.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum GridFault {
    /// The grid has no cells.
    #[error("a grid of {nx} by {ny} heights has no cell\n  help: it needs at least 2 by 2")]
    NoCell {
        /// Nodes along x.
        nx: usize,
        /// Nodes along y.
        ny: usize,
    },
    /// The number of heights is not nx ny.
    #[error(
        "{got} heights for {nx} by {ny} nodes\n  help: give one for each node, NaN where there is no data"
    )]
    Count {
        /// Number of heights.
        got: usize,
        /// Nodes along x.
        nx: usize,
        /// Nodes along y.
        ny: usize,
    },
    /// An invalid node spacing or position of the first node.
    #[error("{what} is {value} m\n  help: it must be {wanted}")]
    Number {
        /// Name of the number.
        what: &'static str,
        /// Its value.
        value: f64,
        /// Permitted range.
        wanted: &'static str,
    },
    /// An infinite height.
    #[error(
        "height {index} is infinite\n  help: give finite heights, or NaN where there is no data"
    )]
    Infinite {
        /// Its index.
        index: usize,
    },
}

/// Positions of the nodes of a grid; x east, y north.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Lattice {
    origin: [f64; 2],
    spacing: [f64; 2],
    /// North-east node, m (derived).
    end: [f64; 2],
    /// Inverse of the spacing, 1/m (derived).
    inverse: [f64; 2],
    /// Column and row of the last cell (derived).
    last: [i32; 2],
    nx: usize,
    ny: usize,
}

/// A cell, and the position of a point in it.
#[derive(Clone, Copy, Debug)]
pub struct Inside {
    /// Column of the south-west node of the cell.
    pub i: usize,
    /// Row of the south-west node of the cell.
    pub j: usize,
    /// Position relative to this node, in cells.
    u: f64,
    v: f64,
}

impl Lattice {
    /// Creates a grid of `nx` by `ny` nodes with its south-west node at `origin` (m) and the node spacing `spacing` (m).
    ///
    /// # Errors
    /// Fewer than 2 by 2 nodes, a spacing that is not positive, numbers that are not finite.
    pub fn new(
        origin: [f64; 2],
        spacing: [f64; 2],
        nx: usize,
        ny: usize,
    ) -> Result<Lattice, GridFault> {
        check(origin, spacing, nx, ny)?;
        let inverse = spacing.map(|s| 1.0 / s);
        let last = [nx, ny].map(|n| i32::try_from(n - 2).unwrap_or(i32::MAX));
        Ok(Lattice { origin, spacing, end: origin, inverse, last, nx, ny }.moved(origin))
    }

    /// Returns the same grid with the south-west node at `origin` (m).
    pub fn moved(mut self, origin: [f64; 2]) -> Lattice {
        self.origin = origin;
        let [.., x1, y1] = self.bounds();
        self.end = [x1, y1];
        self
    }

    /// Returns the same grid with its centre at x = y = 0.
    pub fn centred(self) -> Lattice {
        let [x0, y0, x1, y1] = self.bounds();
        self.moved([-0.5 * (x1 - x0), -0.5 * (y1 - y0)])
    }

    /// Returns x, y of the south-west node, m.
    pub fn origin(&self) -> [f64; 2] {
        self.origin
    }

    /// Returns the node spacing along x and y, m.
    pub fn spacing(&self) -> [f64; 2] {
        self.spacing
    }

    /// Returns the numbers of nodes along x and y.
    pub fn size(&self) -> [usize; 2] {
        [self.nx, self.ny]
    }

    /// Returns x_min, y_min, x_max, y_max, m.
    pub fn bounds(&self) -> [f64; 4] {
        let [x, y] = self.origin;
        let (w, h) = ((self.nx - 1) as f64, (self.ny - 1) as f64);
        [x, y, x + w * self.spacing[0], y + h * self.spacing[1]]
    }

    /// Returns the cell at x, y (m); `None` outside the map.
    #[inline]
    pub fn cell(&self, x: f64, y: f64) -> Option<Inside> {
        let ([x0, y0], [x1, y1]) = (self.origin, self.end);
        // The comparison is negated so that NaN counts as outside.
        if !(x >= x0 && y >= y0 && x <= x1 && y <= y1) {
            return None;
        }
        let (gx, gy) = ((x - x0) * self.inverse[0], (y - y0) * self.inverse[1]);
        // Convert through i32, for which the processor has direct conversions.
        let (i, j) = ((gx as i32).min(self.last[0]), (gy as i32).min(self.last[1]));
        let (u, v) = (gx - f64::from(i), gy - f64::from(j));
        Some(Inside { i: i as usize, j: j as usize, u, v })
    }

    /// Returns height (m) and unit normal in a cell; `None` without data. `four` and `node` as in `relief`.
    #[inline]
    pub fn surface(
        &self,
        inside: Inside,
        four: impl Fn(usize, usize) -> [f64; 4],
        node: impl Fn(usize, usize) -> f64,
    ) -> Option<(f64, Vec3)> {
        let [h, sx, sy] = self.relief(inside, four, node);
        let scale = 1.0 / (1.0 + sx * sx + sy * sy).sqrt();
        (!h.is_nan()).then(|| (h, Vec3::new(-sx * scale, -sy * scale, scale)))
    }

    /// Returns height (m), ∂h/∂x and ∂h/∂y in a cell; NaN without data. `four` returns the heights of four nodes of row `j` from column `i` on,
    /// `node` returns that of one. They are called for the nodes `i − 1` to `i + 2` of the rows `j − 1` to `j + 2` of the cell, as far as the grid
    /// contains them.
    #[inline]
    pub fn relief(
        &self,
        Inside { i, j, u, v }: Inside,
        four: impl Fn(usize, usize) -> [f64; 4],
        node: impl Fn(usize, usize) -> f64,
    ) -> [f64; 3] {
        let (wu, du) = weights(u);
        let (wv, dv) = weights(v);
        let (mut h, mut hu, mut hv) = (0.0, 0.0, 0.0);
        if i > 0 && j > 0 && i + 2 < self.nx && j + 2 < self.ny {
            // Process the columns side by side, each in one vector operation.
            let (wv, dv) = (wv.as_array(), dv.as_array());
            let (mut value, mut slope) = (f64x4::ZERO, f64x4::ZERO);
            for k in 0..4 {
                let row = f64x4::new(four(i - 1, j - 1 + k));
                value = row.mul_add(f64x4::splat(wv[k]), value);
                slope = row.mul_add(f64x4::splat(dv[k]), slope);
            }
            h = (wu * value).reduce_add();
            (hu, hv) = ((du * value).reduce_add(), (wu * slope).reduce_add());
        } else {
            let [wu, du, wv, dv] = [wu, du, wv, dv].map(f64x4::to_array);
            for k in 0..4 {
                for l in 0..4 {
                    let (a, b) = (i as isize + l as isize - 1, j as isize + k as isize - 1);
                    let z = self.ghost(a, b, &node);
                    h += wv[k] * wu[l] * z;
                    hu += wv[k] * du[l] * z;
                    hv += dv[k] * wu[l] * z;
                }
            }
        }
        if h.is_nan() {
            let at = &node;
            let (h00, h10, h01, h11) = (at(i, j), at(i + 1, j), at(i, j + 1), at(i + 1, j + 1));
            hu = (h10 - h00) * (1.0 - v) + (h11 - h01) * v;
            hv = (h01 - h00) * (1.0 - u) + (h11 - h10) * u;
            h = h00 + u * (h10 - h00) + v * (h01 - h00) + u * v * (h11 - h10 - h01 + h00);
        }
        [h, hu * self.inverse[0], hv * self.inverse[1]]
    }

    /// Returns a node's height, extrapolated linearly by one row beyond the border.
    fn ghost(&self, i: isize, j: isize, node: &impl Fn(usize, usize) -> f64) -> f64 {
        let (nx, ny) = (self.nx as isize, self.ny as isize);
        let at = |a: isize, b: isize| self.ghost(a, b, node);
        if i < 0 {
            2.0 * at(0, j) - at(1, j)
        } else if i >= nx {
            2.0 * at(nx - 1, j) - at(nx - 2, j)
        } else if j < 0 {
            2.0 * at(i, 0) - at(i, 1)
        } else if j >= ny {
            2.0 * at(i, ny - 1) - at(i, ny - 2)
        } else {
            node(i as usize, j as usize)
        }
    }
}

/// Checks the grid: number of cells, positive spacings, finite numbers. Returns the first fault.
fn check(origin: [f64; 2], spacing: [f64; 2], nx: usize, ny: usize) -> Result<(), GridFault> {
    if nx < 2 || ny < 2 {
        return Err(GridFault::NoCell { nx, ny });
    }
    for k in 0..2 {
        let (spacing, origin) = (spacing[k], origin[k]);
        if !(spacing > 0.0 && spacing.is_finite()) {
            let (what, wanted) = ("the node spacing", "positive and finite");
            return Err(GridFault::Number { what, value: spacing, wanted });
        }
        if !origin.is_finite() {
            let (what, wanted) = ("the position of the first node", "finite");
            return Err(GridFault::Number { what, value: origin, wanted });
        }
    }
    Ok(())
}

/// Returns the weights of the four nodes and their derivatives.
#[inline(always)]
fn weights(t: f64) -> (f64x4, f64x4) {
    /// Coefficients of the cubics, by power.
    const C: [[f64; 4]; 4] = [
        [0.0, 1.0, 0.0, 0.0],
        [-0.5, 0.0, 0.5, 0.0],
        [1.0, -2.5, 2.0, -0.5],
        [-0.5, 1.5, -1.5, 0.5],
    ];
    const D: [[f64; 4]; 3] = [C[1], [2.0, -5.0, 4.0, -1.0], [-1.5, 4.5, -4.5, 1.5]];
    let t = f64x4::splat(t);
    let [c0, c1, c2, c3] = C.map(f64x4::new);
    let [d0, d1, d2] = D.map(f64x4::new);
    (c3.mul_add(t, c2).mul_add(t, c1).mul_add(t, c0), d2.mul_add(t, d1).mul_add(t, d0))
}
