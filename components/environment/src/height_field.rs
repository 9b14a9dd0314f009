//! A grid of heights in memory, with the smooth surface of a [`Lattice`] through its nodes. Terrains are stored and edited as such grids.

use linkwork_collision::relief::{GridFault, Lattice};
use linkwork_formats::heights::Heights;
use linkwork_spatial::Vec3;
use linkwork_surroundings::Surface;

/// Heights on a regular grid; x east, y north, z up.
#[derive(Clone, Debug, PartialEq)]
pub struct HeightField {
    grid: Lattice,
    /// Row-major, y outer, the southern row first; NaN: no data.
    heights: Vec<f32>,
    /// Height above which they are given (m).
    datum: f64,
}

impl HeightField {
    /// Creates a grid with its south-west node at `origin` (m), the node spacing `spacing` (m) and `nx` by `ny` heights
    /// (m, x fastest, southern row first, NaN for no data).
    ///
    /// # Errors
    /// [`GridFault`].
    pub fn new(
        origin: [f64; 2],
        spacing: [f64; 2],
        nx: usize,
        ny: usize,
        heights: Vec<f32>,
    ) -> Result<HeightField, GridFault> {
        let surface = Surface { origin, spacing, nx, ny, heights };
        surface.check()?;
        let grid = Lattice::new(origin, spacing, nx, ny)?;
        Ok(HeightField { grid, heights: surface.heights, datum: 0.0 })
    }

    /// Creates a level grid of height 0. The memory of the heights is not accessed before they are written, so that each page is mapped once.
    ///
    /// # Errors
    /// [`GridFault`].
    pub fn level(
        origin: [f64; 2],
        spacing: [f64; 2],
        nx: usize,
        ny: usize,
    ) -> Result<HeightField, GridFault> {
        let grid = Lattice::new(origin, spacing, nx, ny)?;
        Ok(HeightField { grid, heights: vec![0.0; nx * ny], datum: 0.0 })
    }

    /// Creates the grid of a file, with heights above the file's datum.
    ///
    /// # Errors
    /// [`GridFault`].
    pub fn of_file(read: Heights) -> Result<HeightField, GridFault> {
        let Heights { nx, ny, heights, datum, spacing, origin } = read;
        Ok(HeightField { datum, ..HeightField::new(origin, spacing, nx, ny, heights)? })
    }

    /// Returns the datum to which all heights refer (m): not 0 for files with heights far from zero
    /// ([`Heights::datum`]).
    pub fn datum(&self) -> f64 {
        self.datum
    }

    /// Returns the positions of the nodes.
    pub fn grid(&self) -> &Lattice {
        &self.grid
    }

    /// Returns x, y of the south-west node, m.
    pub fn origin(&self) -> [f64; 2] {
        self.grid.origin()
    }

    /// Returns the node spacing along x and y, m.
    pub fn spacing(&self) -> [f64; 2] {
        self.grid.spacing()
    }

    /// Returns the numbers of nodes along x and y.
    pub fn size(&self) -> [usize; 2] {
        self.grid.size()
    }

    /// Returns the heights above the datum, m; x fastest, southern row first, NaN for no data.
    pub fn heights(&self) -> &[f32] {
        &self.heights
    }

    /// Returns x_min, y_min, x_max, y_max, m.
    pub fn bounds(&self) -> [f64; 4] {
        self.grid.bounds()
    }

    /// Moves the map so that its centre is at x = y = 0.
    pub fn centred(mut self) -> HeightField {
        self.grid = self.grid.centred();
        self
    }

    /// Changes every height that has data: `f(x, y, h)` in m.
    pub fn map(&mut self, f: impl Fn(f64, f64, f64) -> f64 + Sync) {
        self.map_rows(|| {
            |y, xs: &[f64], row: &mut [f32]| {
                for (h, x) in row.iter_mut().zip(xs).filter(|(h, _)| !h.is_nan()) {
                    *h = f(*x, y, f64::from(*h)) as f32;
                }
            }
        });
    }

    /// Changes the heights row by row, in as many threads as the machine has cores. Each thread calls `start` once, and the function that it
    /// returns for each of its rows: `f(y, xs, heights)` with the y of the row, the x of each node and its height (m). Which thread gets which
    /// rows is not defined: the result for a row must not depend on other rows.
    pub fn map_rows<F>(&mut self, start: impl Fn() -> F + Sync)
    where
        F: FnMut(f64, &[f64], &mut [f32]),
    {
        let (origin, spacing, [nx, ny]) =
            (self.grid.origin(), self.grid.spacing(), self.grid.size());
        let xs: Vec<f64> = (0..nx).map(|i| origin[0] + i as f64 * spacing[0]).collect();
        let cores = std::thread::available_parallelism().map_or(1, usize::from);
        // Starting a thread costs some 20 µs, which is too much for few nodes.
        let threads = cores.min(nx * ny / 20_000).max(1);
        let rows_each = ny.div_ceil(threads).max(1);
        let work = |first: usize, rows: &mut [f32]| {
            let mut f = start();
            for (j, row) in rows.chunks_mut(nx.max(1)).enumerate() {
                f(origin[1] + (first + j) as f64 * spacing[1], &xs, row);
            }
        };
        let mut blocks = self.heights.chunks_mut((rows_each * nx).max(1)).enumerate();
        std::thread::scope(|scope| {
            let own = blocks.next();
            for (k, rows) in blocks {
                scope.spawn(move || work(k * rows_each, rows));
            }
            if let Some((_, rows)) = own {
                work(0, rows);
            }
        });
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
        let (origin, spacing, [nx, ny]) =
            (self.grid.origin(), self.grid.spacing(), self.grid.size());
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

    /// Returns height (m) and unit normal at x, y (m); `None` outside the map and where it has no data.
    #[inline]
    pub fn ground(&self, x: f64, y: f64) -> Option<(f64, Vec3)> {
        let nodes = self.nodes();
        self.grid.surface(self.grid.cell(x, y)?, |i, j| nodes.four(i, j), |i, j| nodes.one(i, j))
    }

    /// Writes height (m), ∂h/∂x and ∂h/∂y at each of several points x, y (m) to `out`. The height is NaN outside the map and where it has no
    /// data.
    pub fn relief(&self, at: &[[f64; 2]], out: &mut [[f64; 3]]) {
        let all = self.nodes();
        // Points near each other, such as the points under a wheel, share a window, because rows of the map are pages
        // apart in memory.
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

    /// Copies the nodes that the points need; `None` if there are too many nodes, or too few points for a copy to pay off.
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
        let (rows, [nx, ny]) = (high.j + 3 - j, self.grid.size());
        if high.i + 3 - i > WINDOW || rows > WINDOW || i + WINDOW > nx {
            return None;
        }
        if high.j + 3 > ny {
            return None;
        }
        for (k, row) in copy.chunks_exact_mut(WINDOW).take(rows).enumerate() {
            let from = (j + k) * nx + i;
            row.copy_from_slice(&self.heights[from..from + WINDOW]);
        }
        Some(Window { i, j, nx: WINDOW, heights: copy })
    }

    #[inline]
    fn nodes(&self) -> Window<'_> {
        Window { i: 0, j: 0, nx: self.grid.size()[0], heights: &self.heights }
    }
}

/// Number of nodes along the edge of a window: 0.95 m on a grid of 5 cm.
const WINDOW: usize = 20;
/// Least number of points for which a window is copied.
const WINDOW_WORTH: usize = 9;

/// Nodes of a rectangle of the grid, by column and row of the grid.
#[derive(Clone, Copy)]
pub(crate) struct Window<'a> {
    /// Column of its first node in the grid.
    pub i: usize,
    /// Row of its first node in the grid.
    pub j: usize,
    /// Number of nodes in a row.
    pub nx: usize,
    /// Heights row by row (m).
    pub heights: &'a [f32],
}

impl Window<'_> {
    #[inline(always)]
    pub fn four(self, i: usize, j: usize) -> [f64; 4] {
        let at = (j - self.j) * self.nx + i - self.i;
        let four: [f32; 4] = self.heights[at..at + 4].try_into().unwrap_or_default();
        four.map(f64::from)
    }
    #[inline(always)]
    pub fn one(self, i: usize, j: usize) -> f64 {
        f64::from(self.heights[(j - self.j) * self.nx + i - self.i])
    }
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
        // Test points close together, far apart, over the hole, over each border and outside of the
        // map, in small and large numbers.
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
        assert_eq!(e, GridFault::Count { got: 5, nx: 3, ny: 5 });
        assert!(e.to_string().contains("5 heights for 3 by 5 nodes"));
        assert!(HeightField::new([0.0; 2], [0.0, 1.0], 2, 2, vec![0.0; 4]).is_err());
    }
}
