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
use wide::f64x4;

/// Where the nodes of a grid are; x east, y north.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Grid {
    origin: [f64; 2],
    spacing: [f64; 2],
    /// North-east node, m: derived.
    end: [f64; 2],
    /// Inverse of the spacing, 1/m: derived.
    inverse: [f64; 2],
    /// Column and row of the last cell: derived.
    last: [i32; 2],
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
        let last = [nx, ny].map(|n| i32::try_from(n - 2).unwrap_or(i32::MAX));
        Ok(Grid { origin, spacing, end: origin, inverse, last, nx, ny }.moved(origin))
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
        // By way of i32, which the processor converts at once both ways.
        let (i, j) = ((gx as i32).min(self.last[0]), (gy as i32).min(self.last[1]));
        let (u, v) = (gx - f64::from(i), gy - f64::from(j));
        Some(Inside { i: i as usize, j: j as usize, u, v })
    }

    /// Height (m) and unit normal in a cell; `None` where there is no data. `four` and `node` as for `relief`.
    #[inline]
    pub(crate) fn surface(
        &self,
        inside: Inside,
        four: impl Fn(usize, usize) -> [f32; 4],
        node: impl Fn(usize, usize) -> f32,
    ) -> Option<(f64, Vec3)> {
        let [h, sx, sy] = self.relief(inside, four, node);
        let scale = 1.0 / (1.0 + sx * sx + sy * sy).sqrt();
        (!h.is_nan()).then(|| (h, Vec3::new(-sx * scale, -sy * scale, scale)))
    }

    /// Height (m), ∂h/∂x and ∂h/∂y in a cell; NaN where there is no data. `four` gives the heights of four nodes of
    /// row `j` from column `i` on, `node` that of one: both are asked for the nodes `i − 1` to `i + 2` of the rows `j − 1` to `j + 2`
    /// of the cell, as far as the grid has them.
    #[inline]
    pub(crate) fn relief(
        &self,
        Inside { i, j, u, v }: Inside,
        four: impl Fn(usize, usize) -> [f32; 4],
        node: impl Fn(usize, usize) -> f32,
    ) -> [f64; 3] {
        let (wu, du) = weights(u);
        let (wv, dv) = weights(v);
        let (mut h, mut hu, mut hv) = (0.0, 0.0, 0.0);
        if i > 0 && j > 0 && i + 2 < self.nx && j + 2 < self.ny {
            // Columns side by side: one vector operation each.
            let (wv, dv) = (wv.as_array(), dv.as_array());
            let (mut value, mut slope) = (f64x4::ZERO, f64x4::ZERO);
            for k in 0..4 {
                let row = f64x4::new(four(i - 1, j - 1 + k).map(f64::from));
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
            let at = |a: usize, b: usize| f64::from(node(a, b));
            let (h00, h10, h01, h11) = (at(i, j), at(i + 1, j), at(i, j + 1), at(i + 1, j + 1));
            hu = (h10 - h00) * (1.0 - v) + (h11 - h01) * v;
            hv = (h01 - h00) * (1.0 - u) + (h11 - h10) * u;
            h = h00 + u * (h10 - h00) + v * (h01 - h00) + u * v * (h11 - h10 - h01 + h00);
        }
        [h, hu * self.inverse[0], hv * self.inverse[1]]
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
        let nodes = self.nodes();
        self.grid.surface(self.grid.cell(x, y)?, |i, j| nodes.four(i, j), |i, j| nodes.one(i, j))
    }

    /// Height (m), ∂h/∂x and ∂h/∂y at each of several points x, y (m); the height is NaN off the map and where there is no data.
    pub fn relief(&self, at: &[[f64; 2]], out: &mut [[f64; 3]]) {
        let all = self.nodes();
        // Points together, as those under a wheel are, share a window: rows of the map are pages apart.
        let mut window = [0.0; WINDOW * WINDOW];
        let nodes = self.window(at, &mut window).unwrap_or(all);
        for ([x, y], out) in at.iter().zip(out) {
            *out = match self.grid.cell(*x, *y) {
                Some(cell) => {
                    self.grid.relief(cell, |i, j| nodes.four(i, j), |i, j| nodes.one(i, j))
                }
                None => [f64::NAN; 3],
            };
        }
    }

    /// The nodes that points ask for, copied; `None` where that is not worth it, or too many.
    #[inline]
    fn window<'a>(
        &self,
        at: &[[f64; 2]],
        copy: &'a mut [f32; WINDOW * WINDOW],
    ) -> Option<Window<'a>> {
        if at.len() < WINDOW_WORTH {
            return None;
        }
        let mut ends = [f64::INFINITY, f64::INFINITY, -f64::INFINITY, -f64::INFINITY];
        for [x, y] in at {
            ends[0] = if *x < ends[0] { *x } else { ends[0] };
            ends[1] = if *y < ends[1] { *y } else { ends[1] };
            ends[2] = if *x > ends[2] { *x } else { ends[2] };
            ends[3] = if *y > ends[3] { *y } else { ends[3] };
        }
        let (low, high) = (self.grid.cell(ends[0], ends[1])?, self.grid.cell(ends[2], ends[3])?);
        let (i, j) = (low.i.checked_sub(1)?, low.j.checked_sub(1)?);
        let rows = high.j + 3 - j;
        if high.i + 3 - i > WINDOW || rows > WINDOW || i + WINDOW > self.grid.nx {
            return None;
        }
        if high.j + 3 > self.grid.ny {
            return None;
        }
        for (k, row) in copy.chunks_exact_mut(WINDOW).take(rows).enumerate() {
            let from = (j + k) * self.grid.nx + i;
            row.copy_from_slice(&self.heights[from..from + WINDOW]);
        }
        Some(Window { i, j, nx: WINDOW, heights: copy })
    }

    #[inline]
    fn nodes(&self) -> Window<'_> {
        Window { i: 0, j: 0, nx: self.grid.nx, heights: &self.heights }
    }
}

/// Nodes along the edge of a window: 0.95 m on a grid of 5 cm.
const WINDOW: usize = 20;
/// Points for which one is copied.
const WINDOW_WORTH: usize = 9;

/// Nodes by column and row of the grid, from one of them on.
#[derive(Clone, Copy)]
pub(crate) struct Window<'a> {
    /// Column of the first, in the grid.
    pub i: usize,
    /// Its row.
    pub j: usize,
    /// Nodes in a row of these.
    pub nx: usize,
    /// Row by row (m).
    pub heights: &'a [f32],
}

impl Window<'_> {
    #[inline(always)]
    pub fn four(self, i: usize, j: usize) -> [f32; 4] {
        let at = (j - self.j) * self.nx + i - self.i;
        self.heights[at..at + 4].try_into().unwrap_or_default()
    }
    #[inline(always)]
    pub fn one(self, i: usize, j: usize) -> f32 {
        self.heights[(j - self.j) * self.nx + i - self.i]
    }
}

/// Weights of the four nodes and their derivatives.
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
    fn points_together_get_what_each_gets_alone() {
        let mut field = sampled(|x, y| (3.0 * x).sin() * (2.0 * y).cos() * 0.2 + 0.1 * x * y);
        field.heights[20 * 31 + 15] = f32::NAN; // x = 0, y = 0
        // Close together, far apart, over the hole, over each border, off the map; few and many.
        for (x, y, apart) in [
            (1.3, 2.1, 0.05),
            (0.0, 0.0, 0.04),
            (-2.9, -4.9, 0.04),
            (2.9, 4.9, 0.04),
            (0.3, 0.2, 0.4),
            (5.0, 0.0, 0.1),
        ] {
            for count in [1_usize, 4, 27] {
                let at: Vec<[f64; 2]> = (0..count)
                    .map(|k| [x + apart * (k % 9) as f64, y - 1.7 * apart * (k / 9) as f64])
                    .collect();
                let mut out = vec![[0.0; 3]; count];
                field.relief(&at, &mut out);
                for ([x, y], [h, sx, sy]) in at.iter().zip(out) {
                    let Some((height, n)) = field.ground(*x, *y) else {
                        assert!(h.is_nan(), "{x} {y}: {h}");
                        continue;
                    };
                    assert_eq!(h, height, "{x} {y}");
                    assert!((n.x + sx * n.z).abs() + (n.y + sy * n.z).abs() < 1e-15, "{x} {y}");
                }
            }
        }
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
