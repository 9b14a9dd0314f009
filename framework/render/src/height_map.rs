//! Intersection of rays with a grid of heights: two triangles per cell, and a tree of minimum and maximum heights above the cells.
//! ```text
//! cell     cut from its corner of low x and y to that of high x and y, like a height field in collision queries
//! gap      g(t) = z(t) − h(x(t), y(t)): linear in t over one triangle; a change of its sign is a hit, t = −a/b
//! block    4 × 4 cells are a leaf of the tree; each level above joins 2 × 2
//! ```
//! Rays hit the triangles exactly, up to round-off. A smooth surface differs from the triangles by at most |h''| s²/8 (s: node spacing). The normal
//! is interpolated linearly from central differences at the nodes, so that edges of cells are not visible; it points against the ray. Both sides are
//! visible. Cells with a node without data (NaN) are holes. A ray costs O(log n) if it passes high above the ground, and O(n^½) cells if it grazes
//! it.

use crate::beam::Beam;
use crate::error::RenderError;
use linkwork_spatial::Vec3;
use linkwork_surroundings::Surface;

/// Cells along the edge of a leaf.
const LEAF: usize = 4;

/// A grid of heights with its tree of minimum and maximum heights. The axes are x east, y north, z up.
#[derive(Clone, Debug, PartialEq)]
pub struct HeightMap {
    origin: [f64; 2],
    spacing: [f64; 2],
    inverse: [f64; 2],
    nx: usize,
    ny: usize,
    heights: Vec<f32>,
    /// Levels from the leaves upwards; the last has one node.
    levels: Vec<Level>,
}

#[derive(Clone, Debug, PartialEq)]
struct Level {
    nx: usize,
    ny: usize,
    /// Edge length of a node, cells.
    edge: usize,
    /// Minimum and maximum height; (∞, −∞) without data.
    range: Vec<[f32; 2]>,
}

/// Inverse of a direction component that counts as zero.
const PARALLEL: f64 = 1e200;

/// A node of the tree: level, column, row.
type Node = (u8, u32, u32);

/// A node with its box, slightly larger than its cells, in which the rays of a beam may hit the ground.
#[derive(Clone, Copy)]
pub(crate) struct Region {
    node: Node,
    lo: Vec3,
    hi: Vec3,
}

/// A ray in the frame of the map, with precomputed data for its traversal.
pub(crate) struct Line {
    o: Vec3,
    d: Vec3,
    inv: Vec3,
    near: usize,
}

impl Line {
    #[inline]
    pub(crate) fn new(o: &Vec3, d: &Vec3) -> Self {
        // A zero would give 0 · ∞ in the slab test, so it is replaced by a number that is too small to change the ray.
        let invert = |v: f64| {
            if v.abs() * PARALLEL < 1.0 { PARALLEL.copysign(v) } else { 1.0 / v }
        };
        let inv = d.map(invert);
        let near = usize::from(d.x < 0.0) | usize::from(d.y < 0.0) << 1;
        Line { o: *o, d: *d, inv, near }
    }

    /// Returns the interval in which a ray is above a box and low enough to reach it.
    #[inline]
    fn span(&self, lo: &Vec3, hi: &Vec3, max: f64) -> Option<[f64; 2]> {
        let slab = |k: usize| {
            let (a, b) = ((lo[k] - self.o[k]) * self.inv[k], (hi[k] - self.o[k]) * self.inv[k]);
            if a < b { (a, b) } else { (b, a) }
        };
        let ((x0, x1), (y0, y1), (z0, z1)) = (slab(0), slab(1), slab(2));
        let from = if x0 > y0 { x0 } else { y0 };
        let to = if x1 < y1 { x1 } else { y1 };
        let (from, to) = (if from > 0.0 { from } else { 0.0 }, if to < max { to } else { max });
        // Extend the interval slightly, so that neighbours overlap and round-off leaves no crack between them.
        let slack = 1e-9 * (1.0 + to.abs());
        let (from, to) = (from - slack, to + slack);
        // A box without data has its minimum above its maximum.
        let there = lo.z <= hi.z && from <= to && z0 <= to && z1 >= from;
        there.then_some([if from > 0.0 { from } else { 0.0 }, to])
    }
}

impl HeightMap {
    /// Creates a map from the heights of a surface, such as a terrain returns. The tree takes two thirds of a byte per cell.
    ///
    /// # Errors
    /// [`RenderError::Surface`].
    pub fn new(surface: Surface) -> Result<Self, RenderError> {
        surface.check()?;
        let Surface { origin, spacing, nx, ny, heights } = surface;
        let inverse = spacing.map(|s| 1.0 / s);
        let mut map = Self { origin, spacing, inverse, nx, ny, heights, levels: vec![] };
        map.levels = map.tree();
        Ok(map)
    }

    fn tree(&self) -> Vec<Level> {
        let (cx, cy) = (self.nx - 1, self.ny - 1);
        let (nx, ny) = (cx.div_ceil(LEAF), cy.div_ceil(LEAF));
        let mut range = Vec::with_capacity(nx * ny);
        for j in 0..ny {
            for i in 0..nx {
                let rows = j * LEAF..=((j + 1) * LEAF).min(cy);
                let all = rows.flat_map(|b| {
                    let row = b * self.nx;
                    &self.heights[row + i * LEAF..=row + ((i + 1) * LEAF).min(cx)]
                });
                // Comparisons with NaN are false, so missing data do not affect the range.
                range.push(all.fold([f32::INFINITY, f32::NEG_INFINITY], |[lo, hi], &h| {
                    [if h < lo { h } else { lo }, if h > hi { h } else { hi }]
                }));
            }
        }
        let mut levels = vec![Level { nx, ny, edge: LEAF, range }];
        while let Some(low) = levels.last().filter(|l| l.nx * l.ny > 1) {
            let (nx, ny) = (low.nx.div_ceil(2), low.ny.div_ceil(2));
            let mut range = vec![[f32::INFINITY, f32::NEG_INFINITY]; nx * ny];
            for j in 0..low.ny {
                for i in 0..low.nx {
                    let [lo, hi] = low.range[j * low.nx + i];
                    let r = &mut range[j / 2 * nx + i / 2];
                    *r = [r[0].min(lo), r[1].max(hi)];
                }
            }
            levels.push(Level { nx, ny, edge: low.edge * 2, range });
        }
        levels
    }

    /// Returns the lower and upper corners of the bounding box, m; the lower is above the upper when there are no data.
    #[must_use]
    pub fn bounds(&self) -> (Vec3, Vec3) {
        let far = |k: usize, n: usize| self.origin[k] + (n - 1) as f64 * self.spacing[k];
        let [lo, hi] = self.levels.last().map_or([0.0, 0.0], |top| top.range[0]);
        (
            Vec3::new(self.origin[0], self.origin[1], f64::from(lo)),
            Vec3::new(far(0, self.nx), far(1, self.ny), f64::from(hi)),
        )
    }

    /// Returns the height at x, y (m) of the triangles that rays hit; `None` outside the map and in a hole.
    #[must_use]
    pub fn height(&self, x: f64, y: f64) -> Option<f64> {
        let g = [x, y];
        let g = [0, 1].map(|k| (g[k] - self.origin[k]) * self.inverse[k]);
        let (cx, cy) = (self.nx - 1, self.ny - 1);
        // The comparison is negated so that NaN counts as outside.
        if !(g[0] >= 0.0 && g[1] >= 0.0 && g[0] <= cx as f64 && g[1] <= cy as f64) {
            return None;
        }
        let (i, j) = ((g[0] as usize).min(cx - 1), (g[1] as usize).min(cy - 1));
        let (u, v) = (g[0] - i as f64, g[1] - j as f64);
        let [h00, h10, h01, h11] = self.corners(i, j);
        let h = match u >= v {
            true => h00 + u * (h10 - h00) + v * (h11 - h10),
            false => h00 + v * (h01 - h00) + u * (h11 - h01),
        };
        (h00 + h10 + h01 + h11).is_finite().then_some(h)
    }

    #[inline]
    fn corners(&self, i: usize, j: usize) -> [f64; 4] {
        let at = j * self.nx + i;
        let (a, b) = (&self.heights[at..at + 2], &self.heights[at + self.nx..at + self.nx + 2]);
        [a[0], a[1], b[0], b[1]].map(f64::from)
    }

    /// Returns the unit normal of the smoothed ground at x, y on the map, upwards.
    pub(crate) fn normal(&self, x: f64, y: f64) -> Vec3 {
        let g = [(x - self.origin[0]) * self.inverse[0], (y - self.origin[1]) * self.inverse[1]];
        let i = (g[0].max(0.0) as usize).min(self.nx - 2);
        let j = (g[1].max(0.0) as usize).min(self.ny - 2);
        let (u, v) = ((g[0] - i as f64).clamp(0.0, 1.0), (g[1] - j as f64).clamp(0.0, 1.0));
        let slopes = self.inner_slopes(i, j);
        let [a, b, c, d] = slopes.unwrap_or_else(|| {
            [[i, j], [i + 1, j], [i, j + 1], [i + 1, j + 1]].map(|n| self.slope(n))
        });
        let mix = |k: usize| {
            (a[k] * (1.0 - u) + b[k] * u) * (1.0 - v) + (c[k] * (1.0 - u) + d[k] * u) * v
        };
        Vec3::new(-mix(0), -mix(1), 1.0).normalize()
    }

    /// Returns the gradients at the corners of a cell if all surrounding nodes have data.
    #[inline]
    fn inner_slopes(&self, i: usize, j: usize) -> Option<[[f64; 2]; 4]> {
        if i == 0 || j == 0 || i + 2 >= self.nx || j + 2 >= self.ny {
            return None;
        }
        let row = |k: usize| {
            let at = (j + k - 1) * self.nx + i - 1;
            <[f32; 4]>::try_from(&self.heights[at..at + 4]).unwrap_or_default().map(f64::from)
        };
        let (r0, r1, r2, r3) = (row(0), row(1), row(2), row(3));
        let half = self.inverse.map(|v| 0.5 * v);
        let at = |x: f64, y: f64| [x * half[0], y * half[1]];
        let all = [
            at(r1[2] - r1[0], r2[1] - r0[1]),
            at(r1[3] - r1[1], r2[2] - r0[2]),
            at(r2[2] - r2[0], r3[1] - r1[1]),
            at(r2[3] - r2[1], r3[2] - r1[2]),
        ];
        all.as_flattened().iter().sum::<f64>().is_finite().then_some(all)
    }

    /// Returns the gradient at a node by central differences, or by a one-sided difference if one neighbour has no data.
    fn slope(&self, [i, j]: [usize; 2]) -> [f64; 2] {
        let h = |i: usize, j: usize| f64::from(self.heights[j * self.nx + i]);
        let here = h(i, j);
        let pick = |low: Option<f64>, high: Option<f64>, inverse: f64| match (low, high) {
            (Some(a), Some(b)) => 0.5 * (b - a) * inverse,
            (Some(a), None) => (here - a) * inverse,
            (None, Some(b)) => (b - here) * inverse,
            (None, None) => 0.0,
        };
        let data = |v: f64| (!v.is_nan()).then_some(v);
        let left = i.checked_sub(1).and_then(|i| data(h(i, j)));
        let right = (i + 1 < self.nx).then(|| h(i + 1, j)).and_then(data);
        let down = j.checked_sub(1).and_then(|j| data(h(i, j)));
        let up = (j + 1 < self.ny).then(|| h(i, j + 1)).and_then(data);
        [pick(left, right, self.inverse[0]), pick(down, up, self.inverse[1])]
    }

    /// Returns the root node of the tree.
    pub(crate) fn root(&self) -> Region {
        self.region((self.levels.len() as u8 - 1, 0, 0))
    }

    /// Returns the distance of the first hit, m along the unit direction, between 0 and `max`. The regions are searched in the given order, in which
    /// every ray must reach them; [`HeightMap::regions`] returns such an order for all rays of a beam.
    #[inline]
    pub(crate) fn cast(&self, line: &Line, regions: &[Region], max: f64) -> Option<f64> {
        regions.iter().find_map(|r| {
            let [from, to] = line.span(&r.lo, &r.hi, max)?;
            match r.node {
                (0, i, j) => {
                    self.leaf(line, i as usize, j as usize, from, to).filter(|t| *t <= max)
                }
                node => self.descend(line, node, max),
            }
        })
    }

    /// Returns the box of a node; its minimum height is above its maximum without data.
    #[inline]
    fn region(&self, node: Node) -> Region {
        let (level, i, j) = node;
        let l = &self.levels[level as usize];
        let [bottom, top] = l.range[j as usize * l.nx + i as usize];
        let cells = [self.nx - 1, self.ny - 1];
        // The last node of a row ends with the map. The box is slightly enlarged, so that a ray in the face between two nodes is in both.
        let edge = |k: usize, n: u32, room: f64| {
            let at = (n as usize * l.edge).min(cells[k]) as f64 + room;
            self.origin[k] + at * self.spacing[k]
        };
        const ROOM: f64 = 1e-9;
        Region {
            node,
            lo: Vec3::new(edge(0, i, -ROOM), edge(1, j, -ROOM), f64::from(bottom)),
            hi: Vec3::new(edge(0, i + 1, ROOM), edge(1, j + 1, ROOM), f64::from(top)),
        }
    }

    fn descend(&self, line: &Line, start: Node, max: f64) -> Option<f64> {
        // At most three nodes per level remain on the stack, and a map of 2^32 nodes has 15 levels.
        let mut stack = [(0u8, 0u32, 0u32); 48];
        stack[0] = start;
        let mut left = 1;
        while left > 0 {
            left -= 1;
            let node = stack[left];
            let Region { lo, hi, .. } = self.region(node);
            let Some([from, to]) = line.span(&lo, &hi, max) else { continue };
            let (level, i, j) = node;
            if level == 0 {
                if let Some(t) = self.leaf(line, i as usize, j as usize, from, to) {
                    return (t <= max).then_some(t);
                }
                continue;
            }
            let below = &self.levels[level as usize - 1];
            // Push the nearest child last, so that it is searched first.
            for c in [3, 2, 1, 0] {
                let c = c ^ line.near;
                let (ci, cj) = (2 * i + (c & 1) as u32, 2 * j + (c >> 1) as u32);
                if (ci as usize) < below.nx && (cj as usize) < below.ny {
                    stack[left] = (level - 1, ci, cj);
                    left += 1;
                }
            }
        }
        None
    }

    /// Traverses the cells of a leaf.
    fn leaf(&self, line: &Line, bi: usize, bj: usize, from: f64, to: f64) -> Option<f64> {
        let cells = [self.nx - 1, self.ny - 1];
        let block = [bi, bj];
        let (mut cell, mut next, mut step, mut jump) =
            ([0usize; 2], [0.0; 2], [0isize; 2], [0.0; 2]);
        let low = block.map(|b| b * LEAF);
        let high = [0, 1].map(|k| ((block[k] + 1) * LEAF).min(cells[k]) - 1);
        for k in 0..2 {
            let p = (line.o[k] + line.d[k] * from - self.origin[k]) * self.inverse[k];
            cell[k] = (p.max(0.0) as usize).clamp(low[k], high[k]);
            step[k] = if line.d[k] < 0.0 { -1 } else { 1 };
            let edge = cell[k] + usize::from(line.d[k] >= 0.0);
            // A ray parallel to its row never reaches the next grid line.
            next[k] = match line.inv[k].abs() < PARALLEL {
                true => (self.origin[k] + edge as f64 * self.spacing[k] - line.o[k]) * line.inv[k],
                false => f64::INFINITY,
            };
            jump[k] = self.spacing[k] * line.inv[k].abs();
        }
        let mut t = from;
        loop {
            let k = usize::from(next[1] < next[0]);
            let end = next[k].min(to);
            if let Some(hit) = self.cell(line, cell, t, end) {
                return Some(hit);
            }
            let moved = cell[k] as isize + step[k];
            if next[k] >= to || moved < low[k] as isize || moved > high[k] as isize {
                return None;
            }
            cell[k] = moved as usize;
            t = end;
            next[k] += jump[k];
        }
    }

    /// Returns the first sign change of the gap over one cell.
    #[inline]
    fn cell(&self, line: &Line, [i, j]: [usize; 2], from: f64, to: f64) -> Option<f64> {
        let [h00, h10, h01, h11] = self.corners(i, j);
        let slack = 1e-9 * (1.0 + to.abs());
        let (from, to) = ((from - slack).max(0.0), to + slack);
        // These comparisons compile to one instruction each; a hole (NaN) is detected below.
        let high = |a: f64, b: f64| if a > b { a } else { b };
        let low = |a: f64, b: f64| if a < b { a } else { b };
        let (za, zb) = (line.o.z + line.d.z * from, line.o.z + line.d.z * to);
        let above = low(za, zb) > high(high(h00, h10), high(h01, h11));
        let below = high(za, zb) < low(low(h00, h10), low(h01, h11));
        if above || below || (h00 + h10 + h01 + h11).is_nan() {
            return None;
        }
        // The cell coordinates, 0 to 1, are linear functions of t.
        let u0 = (line.o.x - self.origin[0]) * self.inverse[0] - i as f64;
        let v0 = (line.o.y - self.origin[1]) * self.inverse[1] - j as f64;
        let (du, dv) = (line.d.x * self.inverse[0], line.d.y * self.inverse[1]);
        // Gap a + b t between the ray and the triangle of high u, and between the ray and the
        // triangle of high v.
        let right = [
            line.o.z - (h00 + u0 * (h10 - h00) + v0 * (h11 - h10)),
            line.d.z - (du * (h10 - h00) + dv * (h11 - h10)),
        ];
        let left = [
            line.o.z - (h00 + v0 * (h01 - h00) + u0 * (h11 - h01)),
            line.d.z - (dv * (h01 - h00) + du * (h11 - h01)),
        ];
        let across = |t: f64| (u0 - v0) + (du - dv) * t;
        let root = |[a, b]: [f64; 2], from: f64, to: f64| {
            let (ga, gb) = (a + b * from, a + b * to);
            ((ga >= 0.0) != (gb >= 0.0) || ga == 0.0)
                .then(|| (-a / b).clamp(from, to))
                .filter(|t| !t.is_nan())
        };
        let (wa, wb) = (across(from), across(to));
        let (first, second) = if wa >= 0.0 { (right, left) } else { (left, right) };
        if (wa >= 0.0) == (wb >= 0.0) {
            return root(first, from, to);
        }
        let middle = ((v0 - u0) / (du - dv)).clamp(from, to);
        root(first, from, middle + slack).or_else(|| root(second, middle - slack, to))
    }

    /// Collects regions that contain everything that the rays of a beam may hit, in the order in which each ray reaches them. Returns the root if the
    /// order differs between the rays.
    pub(crate) fn regions(&self, beam: &Beam, out: &mut Vec<Region>, left: &mut Vec<Region>) {
        out.clear();
        let Some(near) = beam.near() else { return out.push(self.root()) };
        /// Limit of the number of regions, because each ray tests them one by one. Regions at the end remain coarse, since few rays reach them.
        const MANY: usize = 32;
        left.clear();
        left.push(self.root());
        while let Some(region) = left.pop() {
            let (level, i, j) = region.node;
            if level == 0 || out.len() + left.len() >= MANY {
                out.push(region);
                continue;
            }
            let below = &self.levels[level as usize - 1];
            // Push the nearest child last, so that it is searched first.
            for c in [3, 2, 1, 0] {
                let c = c ^ near;
                let child = (level - 1, 2 * i + (c & 1) as u32, 2 * j + (c >> 1) as u32);
                if (child.1 as usize) < below.nx && (child.2 as usize) < below.ny {
                    let region = self.region(child);
                    if region.lo.z <= region.hi.z && beam.meets(&region.lo, &region.hi) {
                        left.push(region);
                    }
                }
            }
        }
    }
}
