//! A grid of heights with a smooth surface: cubic convolution (Catmull-Rom) between nodes.
//! ```text
//! h(x, y) = Σ_j Σ_i w_j(v) w_i(u) h_ij      over 4 × 4 nodes
//! w(t) = ½ [−t + 2t² − t³,  2 − 5t² + 3t³,  t + 4t² − 3t³,  −t² + t³]
//! n ∝ (−∂h/∂x, −∂h/∂y, 1)
//! ```
//! The surface passes through the nodes and its normal is the exact gradient and continuous, so a wheel
//! feels no edge between cells; quadratic ground is reproduced exactly. At the border a ghost row
//! continues the slope. Where a node of the 4 × 4 block has no data the cell falls back to the bilinear
//! surface of its own four nodes; where one of those has none there is no ground. O(1).

use linkwork_runtime::{Surface, SurfaceFault};
use linkwork_spatial::Vec3;

/// Where the nodes of a grid are; x east, y north.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Grid {
    origin: [f64; 2],
    spacing: [f64; 2],
    /// North-east node, m: derived.
    end: [f64; 2],
    /// Inverse of the spacing, 1/m: derived.
    inverse: [f64; 2],
    nx: usize,
    ny: usize,
}

/// A cell, and where in it a point is.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Inside {
    /// Column and row of the cell's south-west node.
    pub i: usize,
    pub j: usize,
    /// From there, in cells.
    u: f64,
    v: f64,
}

impl Grid {
    /// A grid with its south-west node at `origin` (m), nodes `spacing` apart (m), `nx` by `ny` nodes.
    ///
    /// # Errors
    /// Fewer than 2 by 2 nodes, a spacing that is not positive, numbers that are not finite.
    pub fn new(
        origin: [f64; 2],
        spacing: [f64; 2],
        nx: usize,
        ny: usize,
    ) -> Result<Grid, SurfaceFault> {
        Surface::check_grid(origin, spacing, nx, ny)?;
        let inverse = spacing.map(|s| 1.0 / s);
        Ok(Grid { origin, spacing, end: origin, inverse, nx, ny }.moved(origin))
    }

    /// The same nodes with the south-west one at `origin` (m).
    pub fn moved(mut self, origin: [f64; 2]) -> Grid {
        self.origin = origin;
        let [.., x1, y1] = self.bounds();
        self.end = [x1, y1];
        self
    }

    /// The same nodes with the middle of the map at x = y = 0.
    pub fn centred(self) -> Grid {
        let [x0, y0, x1, y1] = self.bounds();
        self.moved([-0.5 * (x1 - x0), -0.5 * (y1 - y0)])
    }

    /// x, y of the south-west node, m.
    pub fn origin(&self) -> [f64; 2] {
        self.origin
    }

    /// Distance of nodes along x and y, m.
    pub fn spacing(&self) -> [f64; 2] {
        self.spacing
    }

    /// Nodes along x and y.
    pub fn size(&self) -> [usize; 2] {
        [self.nx, self.ny]
    }

    /// x_min, y_min, x_max, y_max, m.
    pub fn bounds(&self) -> [f64; 4] {
        let [x, y] = self.origin;
        let (w, h) = ((self.nx - 1) as f64, (self.ny - 1) as f64);
        [x, y, x + w * self.spacing[0], y + h * self.spacing[1]]
    }

    /// The cell under x, y (m); `None` off the map.
    #[inline]
    pub(crate) fn cell(&self, x: f64, y: f64) -> Option<Inside> {
        let ([x0, y0], [x1, y1]) = (self.origin, self.end);
        // Written so that NaN is off the map.
        if !(x >= x0 && y >= y0 && x <= x1 && y <= y1) {
            return None;
        }
        let (gx, gy) = ((x - x0) * self.inverse[0], (y - y0) * self.inverse[1]);
        let i = (gx as usize).min(self.nx - 2);
        let j = (gy as usize).min(self.ny - 2);
        Some(Inside { i, j, u: gx - i as f64, v: gy - j as f64 })
    }

    /// Height (m) and unit normal in a cell; `None` where there is no data. `four` gives the heights of four nodes of
    /// row `j` from column `i` on, `node` that of one: both are asked for the nodes `i − 1` to `i + 2` of the rows `j − 1` to `j + 2`
    /// of the cell, as far as the grid has them.
    #[inline]
    pub(crate) fn surface(
        &self,
        Inside { i, j, u, v }: Inside,
        four: impl Fn(usize, usize) -> [f32; 4],
        node: impl Fn(usize, usize) -> f32,
    ) -> Option<(f64, Vec3)> {
        let (wu, du) = weights(u);
        let (wv, dv) = weights(v);
        let (mut h, mut hu, mut hv) = (0.0, 0.0, 0.0);
        if i > 0 && j > 0 && i + 2 < self.nx && j + 2 < self.ny {
            // Columns side by side: one vector operation each.
            let (mut value, mut slope) = ([0.0; 4], [0.0; 4]);
            for k in 0..4 {
                let row = four(i - 1, j - 1 + k).map(f64::from);
                value = madd(wv[k], row, value);
                slope = madd(dv[k], row, slope);
            }
            (h, hu, hv) = (dot(wu, value), dot(du, value), dot(wu, slope));
        } else {
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
            let at = |a: usize, b: usize| f64::from(node(a, b));
            let (h00, h10, h01, h11) = (at(i, j), at(i + 1, j), at(i, j + 1), at(i + 1, j + 1));
            hu = (h10 - h00) * (1.0 - v) + (h11 - h01) * v;
            hv = (h01 - h00) * (1.0 - u) + (h11 - h10) * u;
            h = h00 + u * (h10 - h00) + v * (h01 - h00) + u * v * (h11 - h10 - h01 + h00);
            if h.is_nan() {
                return None;
            }
        }
        let (sx, sy) = (hu * self.inverse[0], hv * self.inverse[1]);
        let scale = 1.0 / (1.0 + sx * sx + sy * sy).sqrt();
        Some((h, Vec3::new(-sx * scale, -sy * scale, scale)))
    }

    /// A node's height, continued linearly by one row beyond the border.
    fn ghost(&self, i: isize, j: isize, node: &impl Fn(usize, usize) -> f32) -> f64 {
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
            f64::from(node(i as usize, j as usize))
        }
    }
}

/// Heights on a regular grid; x east, y north, z up.
#[derive(Clone, Debug, PartialEq)]
pub struct HeightField {
    grid: Grid,
    /// Row-major, y outer, the southern row first; NaN: no data.
    heights: Vec<f32>,
}

impl HeightField {
    /// A grid with its south-west node at `origin` (m), nodes `spacing` apart (m) and `nx` by `ny` heights
    /// (m, x fastest, southern row first, NaN for no data).
    ///
    /// # Errors
    /// [`SurfaceFault`].
    pub fn new(
        origin: [f64; 2],
        spacing: [f64; 2],
        nx: usize,
        ny: usize,
        heights: Vec<f32>,
    ) -> Result<HeightField, SurfaceFault> {
        let surface = Surface { origin, spacing, nx, ny, heights };
        surface.check()?;
        Ok(HeightField { grid: Grid::new(origin, spacing, nx, ny)?, heights: surface.heights })
    }

    /// Where its nodes are.
    pub fn grid(&self) -> &Grid {
        &self.grid
    }

    /// x, y of the south-west node, m.
    pub fn origin(&self) -> [f64; 2] {
        self.grid.origin
    }

    /// Distance of nodes along x and y, m.
    pub fn spacing(&self) -> [f64; 2] {
        self.grid.spacing
    }

    /// Nodes along x and y.
    pub fn size(&self) -> [usize; 2] {
        self.grid.size()
    }

    /// Heights, m; x fastest, southern row first, NaN for no data.
    pub fn heights(&self) -> &[f32] {
        &self.heights
    }

    /// x_min, y_min, x_max, y_max, m.
    pub fn bounds(&self) -> [f64; 4] {
        self.grid.bounds()
    }

    /// Same heights moved so that the middle of the map is at x = y = 0.
    pub fn centred(mut self) -> HeightField {
        self.grid = self.grid.centred();
        self
    }

    /// Changes every height that has data: `f(x, y, h)` in m.
    pub fn map(&mut self, mut f: impl FnMut(f64, f64, f64) -> f64) {
        let Grid { origin, spacing, nx, ny, .. } = self.grid;
        for j in 0..ny {
            let y = origin[1] + j as f64 * spacing[1];
            for i in 0..nx {
                let x = origin[0] + i as f64 * spacing[0];
                let h = &mut self.heights[j * nx + i];
                if !h.is_nan() {
                    *h = f(x, y, f64::from(*h)) as f32;
                }
            }
        }
    }

    /// Changes the heights within `reach` (m) of a point: `f(distance, h)`.
    pub fn map_around(&mut self, x: f64, y: f64, reach: f64, mut f: impl FnMut(f64, f64) -> f64) {
        let box_around = [x - reach, y - reach, x + reach, y + reach];
        self.map_within(box_around, |px, py, h| {
            let d = (px - x).hypot(py - y);
            if d <= reach { f(d, h) } else { h }
        });
    }

    /// Changes the heights within x_min, y_min, x_max, y_max (m): `f(x, y, h)`.
    pub fn map_within(&mut self, within: [f64; 4], mut f: impl FnMut(f64, f64, f64) -> f64) {
        let Grid { origin, spacing, nx, ny, .. } = self.grid;
        let low = |p: f64, k: usize| ((p - origin[k]) / spacing[k]).ceil().max(0.0) as usize;
        let high = |p: f64, k: usize, n: usize| {
            let at = ((p - origin[k]) / spacing[k]).floor();
            if at < 0.0 { 0 } else { (at as usize + 1).min(n) }
        };
        for j in low(within[1], 1)..high(within[3], 1, ny) {
            let y = origin[1] + j as f64 * spacing[1];
            for i in low(within[0], 0)..high(within[2], 0, nx) {
                let x = origin[0] + i as f64 * spacing[0];
                let h = &mut self.heights[j * nx + i];
                if !h.is_nan() {
                    *h = f(x, y, f64::from(*h)) as f32;
                }
            }
        }
    }

    /// Height (m) and unit normal at x, y (m); `None` off the map and where there is no data.
    #[inline]
    pub fn ground(&self, x: f64, y: f64) -> Option<(f64, Vec3)> {
        let (nx, heights) = (self.grid.nx, &self.heights);
        let four = |i: usize, j: usize| -> [f32; 4] {
            let at = j * nx + i;
            heights[at..at + 4].try_into().unwrap_or_default()
        };
        self.grid.surface(self.grid.cell(x, y)?, four, |i, j| heights[j * nx + i])
    }
}

/// Weights of the four nodes and their derivatives.
#[inline(always)]
fn weights(t: f64) -> ([f64; 4], [f64; 4]) {
    /// Coefficients of the cubics, by power.
    const C: [[f64; 4]; 4] = [
        [0.0, 1.0, 0.0, 0.0],
        [-0.5, 0.0, 0.5, 0.0],
        [1.0, -2.5, 2.0, -0.5],
        [-0.5, 1.5, -1.5, 0.5],
    ];
    const D: [[f64; 4]; 3] = [C[1], [2.0, -5.0, 4.0, -1.0], [-1.5, 4.5, -4.5, 1.5]];
    (madd(t, madd(t, madd(t, C[3], C[2]), C[1]), C[0]), madd(t, madd(t, D[2], D[1]), D[0]))
}

/// `a b + c` for four columns.
#[inline(always)]
fn madd(a: f64, b: [f64; 4], c: [f64; 4]) -> [f64; 4] {
    std::array::from_fn(|l| a.mul_add(b[l], c[l]))
}

#[inline(always)]
fn dot(a: [f64; 4], b: [f64; 4]) -> f64 {
    a[0].mul_add(b[0], a[1] * b[1]) + a[2].mul_add(b[2], a[3] * b[3])
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sampled(f: impl Fn(f64, f64) -> f64) -> HeightField {
        let (nx, ny) = (31, 41);
        let (sx, sy) = (0.2, 0.25);
        let mut h = Vec::new();
        for j in 0..ny {
            for i in 0..nx {
                h.push(f(-3.0 + sx * i as f64, -5.0 + sy * j as f64) as f32);
            }
        }
        HeightField::new([-3.0, -5.0], [sx, sy], nx, ny, h).unwrap()
    }

    #[test]
    fn quadratic_ground_is_exact_with_its_normal() {
        let f =
            |x: f64, y: f64| 0.5 + 0.1 * x - 0.2 * y + 0.03 * x * x - 0.05 * x * y + 0.02 * y * y;
        let field = sampled(f);
        for k in 0..200 {
            let (x, y) = (-2.7 + 0.027 * k as f64, 4.6 - 0.045 * k as f64);
            let (h, n) = field.ground(x, y).unwrap();
            assert!((h - f(x, y)).abs() < 2e-6, "{x} {y}: {h} {}", f(x, y));
            let want =
                Vec3::new(-(0.1 + 0.06 * x - 0.05 * y), 0.2 + 0.05 * x - 0.04 * y, 1.0).normalize();
            assert!((n - want).norm() < 2e-5, "{x} {y}: {n} {want}");
        }
    }

    #[test]
    fn normal_is_the_gradient_and_continuous_everywhere() {
        let field = sampled(|x, y| (3.0 * x).sin() * (2.0 * y).cos() * 0.2);
        let mut last: Option<Vec3> = None;
        for k in 0..59_000 {
            let (x, y) = (-2.999 + 1e-4 * k as f64, -4.0 + 1.3e-4 * k as f64);
            let (_, n) = field.ground(x, y).unwrap();
            let e = 1e-5;
            if k % 500 == 0 && k > 0 {
                let dx = (field.ground(x + e, y).unwrap().0 - field.ground(x - e, y).unwrap().0)
                    / (2.0 * e);
                let dy = (field.ground(x, y + e).unwrap().0 - field.ground(x, y - e).unwrap().0)
                    / (2.0 * e);
                assert!((n - Vec3::new(-dx, -dy, 1.0).normalize()).norm() < 1e-4);
            }
            if let Some(last) = last {
                assert!((n - last).norm() < 3e-3, "normal jumps at {x} {y}");
            }
            last = Some(n);
        }
    }

    #[test]
    fn nodes_are_met_and_the_border_belongs_to_the_map() {
        let field = sampled(|x, y| x.sin() + y.cos());
        let [x0, y0, x1, y1] = field.bounds();
        assert!((x1 - 3.0).abs() < 1e-12 && (y1 - 5.0).abs() < 1e-12);
        for (x, y) in [(x0, y0), (x1, y1), (x0, y1), (0.0, 0.0)] {
            let (h, _) = field.ground(x, y).unwrap();
            assert!((h - (x.sin() + y.cos())).abs() < 1e-5, "{x} {y} {h}");
        }
        assert!(field.ground(x0 - 1e-9, 0.0).is_none() && field.ground(0.0, y1 + 1e-9).is_none());
        assert!(field.ground(f64::NAN, 0.0).is_none());
    }

    #[test]
    fn missing_nodes_take_only_their_own_cells() {
        let mut field = sampled(|x, _| x);
        field.heights[20 * 31 + 15] = f32::NAN; // x = 0, y = 0
        for (x, y) in [(0.05, 0.05), (-0.05, 0.1), (0.0, 0.0), (0.19, -0.2)] {
            assert!(field.ground(x, y).is_none(), "{x} {y}");
        }
        let (h, n) = field.ground(0.3, 0.3).unwrap();
        assert!((h - 0.3).abs() < 1e-6 && (n.x + n.z).abs() < 1e-5);
    }

    #[test]
    fn wrong_grids_say_what_is_wrong() {
        assert!(HeightField::new([0.0; 2], [1.0; 2], 1, 5, vec![0.0; 5]).is_err());
        let e = HeightField::new([0.0; 2], [1.0; 2], 3, 5, vec![0.0; 5]).unwrap_err();
        assert_eq!(e, SurfaceFault::Count { got: 5, nx: 3, ny: 5 });
        assert!(e.to_string().contains("5 heights for 3 by 5 nodes"));
        assert!(HeightField::new([0.0; 2], [0.0, 1.0], 2, 2, vec![0.0; 4]).is_err());
    }
}
