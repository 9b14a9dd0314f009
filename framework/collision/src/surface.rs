//! Triangle surfaces: meshes with neighbour information and a tree, height fields with direct indexing.
//!
//! A triangle has a unit normal n, and at each edge k a direction t_k in its plane, pointing outwards. A contact normal that leans over the edge is
//! admissible as far as the neighbour's normal leans: n · t_k ≤ lean_k, with 0 where the surface is flat or concave. A facet is a triangle without
//! its neighbours, which is sufficient for most queries.

use crate::convert::{bounds, to_parry};
use crate::core::Poly;
use crate::error::ShapeFault;
use crate::relief::{Lattice, Relief};
use linkwork_multibody::spatial::Vec3;
use parry3d_f64::partitioning::{Bvh, BvhBuildStrategy};
use parry3d_f64::query::Ray;
use std::collections::BTreeMap;
use std::ops::Range;
use std::sync::Arc;

/// Additional lean of an admissible normal, sine, because a resting body moves slightly.
pub(crate) const LEAN: f64 = 1e-4;

/// A triangle without neighbour information.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Facet {
    /// Corners, m.
    pub v: [Vec3; 3],
    /// Names of the corners.
    pub names: [u64; 3],
    /// Outward normal, unit.
    pub n: Vec3,
}

impl Facet {
    /// Returns the unit vector in its plane, perpendicular to the edge from corner k, pointing outwards.
    #[inline]
    pub(crate) fn across(&self, k: usize) -> Vec3 {
        (self.v[(k + 1) % 3] - self.v[k]).cross(&self.n).normalize()
    }

    /// Returns true if a contact normal belongs to this triangle or to its convex edges. `lean` returns how far a normal may lean over the edge from
    /// corner k to the next (sine).
    pub(crate) fn admits(&self, n: &Vec3, lean: impl Fn(usize, &Vec3) -> f64) -> bool {
        n.dot(&self.n) > -LEAN
            && (0..3).all(|k| {
                let across = self.across(k);
                let along = n.dot(&across);
                along <= LEAN || along <= lean(k, &across) + LEAN
            })
    }

    /// Writes it to a polytope.
    pub(crate) fn write(&self, poly: &mut Poly) {
        poly.set_triangle(&self.v, &self.names, self.n);
    }
}

fn normal(v: &[Vec3; 3]) -> Vec3 {
    (v[1] - v[0]).cross(&(v[2] - v[0])).normalize()
}

/// Returns how far normals may lean over an edge: up to the neighbour's normal at a convex edge, up to the horizon at a border.
fn lean(n: &Vec3, across: &Vec3, neighbour: Option<Vec3>) -> f64 {
    match neighbour {
        None => 1.0,
        Some(m) if m.dot(across) <= 0.0 => 0.0,
        Some(m) if m.dot(n) <= 0.0 => 1.0,
        Some(m) => m.dot(across),
    }
}

/// A mesh or a height field.
#[derive(Debug)]
pub(crate) enum Surface {
    /// Triangles with indices.
    Mesh(Triangles),
    /// Triangles of a grid.
    Grid(Grid),
}

impl Surface {
    /// Returns the bounding box; a height field is unbounded below.
    pub(crate) fn bounds(&self) -> (Vec3, Vec3) {
        match self {
            Self::Mesh(m) => (m.lo, m.hi),
            Self::Grid(g) => (
                Vec3::new(-g.far[0], -g.far[1], f64::NEG_INFINITY),
                Vec3::new(g.far[0], g.far[1], g.top),
            ),
        }
    }

    /// Returns the largest extent, m.
    pub(crate) fn size(&self) -> f64 {
        match self {
            Self::Mesh(m) => (m.hi - m.lo).max(),
            Self::Grid(g) => 2.0 * g.far[0].max(g.far[1]),
        }
    }

    /// Returns true if the space below is solid without limit.
    pub(crate) fn is_terrain(&self) -> bool {
        matches!(self, Self::Grid(_))
    }

    /// Returns the number of triangles, including holes.
    pub(crate) fn count(&self) -> usize {
        match self {
            Self::Mesh(m) => m.triangles.len(),
            Self::Grid(g) => 2 * (g.x - 1) * (g.y - 1),
        }
    }

    /// Returns all vertices.
    pub(crate) fn vertices(&self) -> impl Iterator<Item = (u64, Vec3)> + '_ {
        let (mesh, grid) = match self {
            Self::Mesh(m) => (Some(m), None),
            Self::Grid(g) => (None, Some(g)),
        };
        let of_mesh = mesh.into_iter().flat_map(|m| m.vertices.iter().copied().enumerate());
        let of_grid = grid
            .into_iter()
            .flat_map(|g| (0..g.x * g.y).map(move |i| (i, g.point(i % g.x, i / g.x))));
        of_mesh.chain(of_grid).filter(|(_, v)| !v.z.is_nan()).map(|(i, v)| (i as u64, v))
    }

    /// Writes the indices of triangles that a box may overlap to `out`, ascending. No allocation occurs once `out` has reached its size.
    pub(crate) fn near(&self, lo: &Vec3, hi: &Vec3, out: &mut Vec<u32>) {
        out.clear();
        match self {
            Self::Mesh(m) => {
                let room = 1e-9 * (m.hi - m.lo).max();
                let query = bounds(&lo.add_scalar(-room), &hi.add_scalar(room));
                out.extend(m.tree.intersect_aabb(&query));
                out.sort_unstable();
            }
            Self::Grid(g) => g.near(lo, hi, out),
        }
    }

    /// Like [`near`](Self::near), but only for triangles that `keep` accepts by their normal, of any length, and their corners. On a height field,
    /// `far` may reject a cell by its corners first.
    pub(crate) fn near_if(
        &self,
        lo: &Vec3,
        hi: &Vec3,
        far: impl Fn(&[Vec3; 4]) -> bool,
        keep: impl Fn(&Vec3, &[Vec3; 3]) -> bool,
        out: &mut Vec<u32>,
    ) {
        match self {
            Self::Mesh(m) => {
                self.near(lo, hi, out);
                out.retain(|i| keep(&m.normals[*i as usize], &m.corners(*i as usize)));
            }
            Self::Grid(g) => g.near_if(lo, hi, far, keep, out),
        }
    }

    /// Returns a triangle by index.
    pub(crate) fn facet(&self, i: u32) -> Facet {
        match self {
            Self::Mesh(m) => m.facet(i as usize),
            Self::Grid(g) => g.facet(i as usize),
        }
    }

    /// Returns how far a normal may lean over the edge from corner k to the next (sine); `across` is the result of [`Facet::across`].
    pub(crate) fn lean(&self, i: u32, t: &Facet, k: usize, across: &Vec3) -> f64 {
        match self {
            Self::Mesh(m) => m.lean[i as usize][k],
            Self::Grid(g) => lean(&t.n, across, g.neighbour(i as usize, k)),
        }
    }

    /// Returns the first hit of a ray: distance and normal against the ray.
    pub(crate) fn cast(&self, origin: &Vec3, direction: &Vec3, max: f64) -> Option<(f64, Vec3)> {
        let hit = match self {
            Self::Mesh(m) => {
                let ray = Ray::new(to_parry(origin), to_parry(direction));
                let test = |i: u32, best: f64| {
                    meet(origin, direction, &m.facet(i as usize).v).filter(|t| *t <= best)
                };
                m.tree.cast_ray(&ray, max, test).filter(|(_, t)| *t <= max)
            }
            Self::Grid(g) => g.cast(origin, direction, max),
        };
        hit.map(|(i, t)| {
            let n = self.facet(i).n;
            (t, if n.dot(direction) > 0.0 { -n } else { n })
        })
    }
}

/// Returns the distance at which a ray hits a triangle, from either side.
fn meet(origin: &Vec3, direction: &Vec3, v: &[Vec3; 3]) -> Option<f64> {
    let (e1, e2) = (v[1] - v[0], v[2] - v[0]);
    let h = direction.cross(&e2);
    let det = e1.dot(&h);
    if det == 0.0 {
        return None;
    }
    let s = origin - v[0];
    let u = s.dot(&h) / det;
    let q = s.cross(&e1);
    let w = direction.dot(&q) / det;
    let t = e2.dot(&q) / det;
    let inside = u >= -1e-12 && w >= -1e-12 && u + w <= 1.0 + 1e-12 && t >= 0.0;
    inside.then_some(t)
}

/// A triangle mesh.
#[derive(Debug)]
pub(crate) struct Triangles {
    vertices: Vec<Vec3>,
    triangles: Vec<[u32; 3]>,
    normals: Vec<Vec3>,
    lean: Vec<[f64; 3]>,
    tree: Bvh,
    lo: Vec3,
    hi: Vec3,
}

impl Triangles {
    /// Checks and builds; merges corners at the same position.
    pub(crate) fn new(given: &[Vec3], triangles: &[[u32; 3]]) -> Result<Self, Vec<ShapeFault>> {
        let mut faults = Vec::new();
        let bad = |v: &Vec3| !v.iter().all(|x| x.is_finite());
        faults.extend(
            (0..given.len())
                .filter(|i| bad(&given[*i]))
                .map(|index| ShapeFault::NotFinite { what: "vertex", index }),
        );
        if triangles.is_empty() {
            faults.push(ShapeFault::Empty);
        }
        for (triangle, t) in triangles.iter().enumerate() {
            let wild = t.iter().find(|i| **i as usize >= given.len());
            if let Some(index) = wild {
                faults.push(ShapeFault::Index { triangle, index: *index, count: given.len() });
                continue;
            }
            let v = t.map(|i| given[i as usize]);
            let longest = (0..3).map(|k| (v[k] - v[(k + 1) % 3]).norm()).fold(0.0, f64::max);
            let double_area = (v[1] - v[0]).cross(&(v[2] - v[0])).norm();
            if !v.iter().any(bad) && !(double_area > 1e-12 * longest * longest) {
                faults.push(ShapeFault::NoArea { triangle });
            }
        }
        if faults.is_empty() { Ok(Self::build(given, triangles)) } else { Err(faults) }
    }

    fn build(given: &[Vec3], triangles: &[[u32; 3]]) -> Self {
        let mut first = BTreeMap::new();
        let same: Vec<u32> = given
            .iter()
            .enumerate()
            .map(|(i, v)| {
                *first.entry([v.x, v.y, v.z].map(|x| (x + 0.0).to_bits())).or_insert(i as u32)
            })
            .collect();
        let triangles: Vec<[u32; 3]> =
            triangles.iter().map(|t| t.map(|i| same[i as usize])).collect();
        let corners = |t: &[u32; 3]| t.map(|i| given[i as usize]);
        let boxes: Vec<(Vec3, Vec3)> = triangles
            .iter()
            .map(|t| {
                let v = corners(t);
                (v[0].inf(&v[1]).inf(&v[2]), v[0].sup(&v[1]).sup(&v[2]))
            })
            .collect();
        let far = Vec3::repeat(f64::INFINITY);
        let (lo, hi) = boxes.iter().fold((far, -far), |(lo, hi), b| (lo.inf(&b.0), hi.sup(&b.1)));
        let leaves: Vec<_> = boxes.iter().map(|b| bounds(&b.0, &b.1)).collect();
        let mut owner: BTreeMap<(u32, u32), u32> = BTreeMap::new();
        for (i, t) in triangles.iter().enumerate() {
            for k in 0..3 {
                owner.entry((t[k], t[(k + 1) % 3])).or_insert(i as u32);
            }
        }
        let leans = |t: &[u32; 3]| {
            let v = corners(t);
            let n = normal(&v);
            [0, 1, 2].map(|k| {
                let l = (k + 1) % 3;
                let across = (v[l] - v[k]).cross(&n).normalize();
                let other =
                    owner.get(&(t[l], t[k])).map(|i| normal(&corners(&triangles[*i as usize])));
                lean(&n, &across, other)
            })
        };
        let lean = triangles.iter().map(leans).collect();
        let normals = triangles.iter().map(|t| normal(&corners(t))).collect();
        let tree = Bvh::from_leaves(BvhBuildStrategy::Binned, &leaves);
        Self { vertices: given.to_vec(), triangles, normals, lean, tree, lo, hi }
    }

    fn corners(&self, i: usize) -> [Vec3; 3] {
        self.triangles[i].map(|k| self.vertices[k as usize])
    }

    fn facet(&self, i: usize) -> Facet {
        let names = self.triangles[i].map(u64::from);
        Facet { v: self.corners(i), names, n: self.normals[i] }
    }
}

/// Cells along a side of the blocks whose largest height is stored.
const BLOCK: usize = 8;

/// A height field.
#[derive(Debug)]
pub(crate) struct Grid {
    x: usize,
    y: usize,
    spacing: [f64; 2],
    heights: Arc<[f64]>,
    far: [f64; 2],
    top: f64,
    /// Largest height of each block of cells, in rows of `blocks` numbers.
    tops: Vec<f64>,
    blocks: usize,
    /// The smooth surface through its points, for rolling discs.
    lattice: Lattice,
}

impl Relief for Grid {
    fn relief(&self, at: &[[f64; 2]], out: &mut [[f64; 3]]) {
        let node = |i: usize, j: usize| self.heights[j * self.x + i];
        let four = |i: usize, j: usize| [0, 1, 2, 3].map(|k| node(i + k, j));
        for ([x, y], out) in at.iter().zip(out) {
            let cell = self.lattice.cell(*x, *y);
            *out = cell.map_or([f64::NAN; 3], |cell| self.lattice.relief(cell, four, node));
        }
    }
}

impl Grid {
    /// Checks and builds.
    pub(crate) fn new(
        x: usize,
        y: usize,
        spacing: [f64; 2],
        heights: &Arc<[f64]>,
    ) -> Result<Self, Vec<ShapeFault>> {
        let points = x.checked_mul(y).filter(|n| *n < 1 << 31);
        if x < 2 || y < 2 || points != Some(heights.len()) {
            return Err(vec![ShapeFault::Grid { x, y, heights: heights.len() }]);
        }
        if let Some(index) = heights.iter().position(|h| h.is_infinite()) {
            return Err(vec![ShapeFault::NotFinite { what: "height", index }]);
        }
        let far = [(x - 1) as f64 * spacing[0] / 2.0, (y - 1) as f64 * spacing[1] / 2.0];
        let blocks = (x - 1).div_ceil(BLOCK);
        let mut tops = Vec::with_capacity(blocks * (y - 1).div_ceil(BLOCK));
        for j in (0..y - 1).step_by(BLOCK) {
            let rows = &heights[j * x..(j + BLOCK + 1).min(y) * x];
            for i in (0..x - 1).step_by(BLOCK) {
                let points = rows.chunks_exact(x).flat_map(|row| &row[i..(i + BLOCK + 1).min(x)]);
                tops.push(points.copied().fold(f64::NEG_INFINITY, f64::max));
            }
        }
        let top = tops.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        if top == f64::NEG_INFINITY {
            return Err(vec![ShapeFault::NotFinite { what: "height", index: 0 }]);
        }
        let lattice = Lattice::new([-far[0], -far[1]], spacing, x, y);
        let lattice =
            lattice.map_err(|_| vec![ShapeFault::Grid { x, y, heights: heights.len() }])?;
        Ok(Self { x, y, spacing, heights: heights.clone(), far, top, tops, blocks, lattice })
    }

    /// Returns the rows of some cells whose blocks have a point as high as `floor`.
    fn high_rows(
        &self,
        columns: &Range<usize>,
        rows: Range<usize>,
        floor: f64,
    ) -> impl Iterator<Item = usize> + use<'_> {
        let pieces = columns.start / BLOCK..columns.end.div_ceil(BLOCK);
        let blocks = rows.start / BLOCK..rows.end.div_ceil(BLOCK);
        let any = move |b: &usize| {
            self.tops[b * self.blocks..][pieces.clone()].iter().any(|top| *top >= floor)
        };
        blocks
            .filter(any)
            .flat_map(move |b| (b * BLOCK).max(rows.start)..((b + 1) * BLOCK).min(rows.end))
    }

    /// Returns the parts of the columns of a row of cells that are in a block with a point as high as `floor`.
    fn high(
        &self,
        columns: &Range<usize>,
        row: usize,
        floor: f64,
    ) -> impl Iterator<Item = usize> + use<'_> {
        let columns = columns.clone();
        let tops = &self.tops[row / BLOCK * self.blocks..][..self.blocks];
        let pieces = columns.start / BLOCK..columns.end.div_ceil(BLOCK);
        pieces
            .filter(move |b| tops[*b] >= floor)
            .flat_map(move |b| (b * BLOCK).max(columns.start)..((b + 1) * BLOCK).min(columns.end))
    }

    fn point(&self, i: usize, j: usize) -> Vec3 {
        let at = |i: usize, axis: usize| i as f64 * self.spacing[axis] - self.far[axis];
        Vec3::new(at(i, 0), at(j, 1), self.heights[j * self.x + i])
    }

    /// Returns the corners of the lower right (0) or upper left (1) half of a cell, as columns and rows.
    fn corners(i: usize, j: usize, half: usize) -> [(usize, usize); 3] {
        if half == 0 {
            [(i, j), (i + 1, j), (i + 1, j + 1)]
        } else {
            [(i, j), (i + 1, j + 1), (i, j + 1)]
        }
    }

    /// Returns the normal of a half cell, or `None` without data.
    fn normal(&self, i: Option<usize>, j: Option<usize>, half: usize) -> Option<Vec3> {
        let (i, j) = (i.filter(|i| *i < self.x - 1)?, j.filter(|j| *j < self.y - 1)?);
        let n = normal(&Self::corners(i, j, half).map(|(i, j)| self.point(i, j)));
        // A cell next to a hole counts as a border.
        (!n.z.is_nan()).then_some(n)
    }

    fn place(&self, number: usize) -> (usize, usize, usize) {
        let (cell, half) = (number / 2, number % 2);
        (cell % (self.x - 1), cell / (self.x - 1), half)
    }

    fn facet(&self, number: usize) -> Facet {
        let (i, j, half) = self.place(number);
        let at = Self::corners(i, j, half);
        let v = at.map(|(i, j)| self.point(i, j));
        Facet { v, names: at.map(|(i, j)| (j * self.x + i) as u64), n: normal(&v) }
    }

    /// Returns the normal of the triangle across the edge from corner k, or `None`.
    fn neighbour(&self, number: usize, k: usize) -> Option<Vec3> {
        let (i, j, half) = self.place(number);
        match (half, k) {
            (0, 0) => self.normal(Some(i), j.checked_sub(1), 1),
            (0, 1) => self.normal(Some(i + 1), Some(j), 1),
            (0, _) => self.normal(Some(i), Some(j), 1),
            (_, 0) => self.normal(Some(i), Some(j), 0),
            (_, 1) => self.normal(Some(i), Some(j + 1), 0),
            _ => self.normal(i.checked_sub(1), Some(j), 0),
        }
    }

    /// Returns the range of cells along an axis that an interval covers.
    fn cells(&self, axis: usize, lo: f64, hi: f64) -> Range<usize> {
        let count = [self.x, self.y][axis] - 1;
        let at = |v: f64| (v + self.far[axis]) / self.spacing[axis];
        let (lo, hi) = (at(lo) - 1e-9, at(hi) + 1e-9);
        if hi < 0.0 || lo > count as f64 {
            return 0..0;
        }
        (lo.max(0.0) as usize).min(count - 1)..(hi.max(0.0) as usize).min(count - 1) + 1
    }

    fn near(&self, lo: &Vec3, hi: &Vec3, out: &mut Vec<u32>) {
        let (columns, rows) = (self.cells(0, lo.x, hi.x), self.cells(1, lo.y, hi.y));
        let floor = lo.z - 1e-9 * self.far[0];
        for j in self.high_rows(&columns, rows, floor) {
            for i in self.high(&columns, j, floor) {
                for half in 0..2 {
                    let at = Self::corners(i, j, half).map(|(i, j)| self.heights[j * self.x + i]);
                    let whole = !at.iter().any(|h| h.is_nan());
                    if whole && at[0].max(at[1]).max(at[2]) >= floor {
                        out.push((2 * (j * (self.x - 1) + i) + half) as u32);
                    }
                }
            }
        }
    }

    /// Like [`Grid::near`], with normals from slopes: (−∂z/∂x, −∂z/∂y, 1).
    fn near_if(
        &self,
        lo: &Vec3,
        hi: &Vec3,
        far: impl Fn(&[Vec3; 4]) -> bool,
        keep: impl Fn(&Vec3, &[Vec3; 3]) -> bool,
        out: &mut Vec<u32>,
    ) {
        out.clear();
        let [per_x, per_y] = self.spacing.map(|d| 1.0 / d);
        let floor = lo.z - 1e-9 * self.far[0];
        let (columns, rows) = (self.cells(0, lo.x, hi.x), self.cells(1, lo.y, hi.y));
        for j in self.high_rows(&columns, rows, floor) {
            let row = &self.heights[j * self.x..];
            let (row, above) = (&row[..self.x], &row[self.x..2 * self.x]);
            let y = [j, j + 1].map(|j| j as f64 * self.spacing[1] - self.far[1]);
            for i in self.high(&columns, j, floor) {
                let (z00, z10, z01, z11) = (row[i], row[i + 1], above[i], above[i + 1]);
                let x = [i, i + 1].map(|i| i as f64 * self.spacing[0] - self.far[0]);
                let v = [
                    Vec3::new(x[0], y[0], z00),
                    Vec3::new(x[1], y[0], z10),
                    Vec3::new(x[1], y[1], z11),
                    Vec3::new(x[0], y[1], z01),
                ];
                let most = if z00 > z11 { z00 } else { z11 };
                if most.max(z10).max(z01) < floor || far(&v) {
                    continue;
                }
                let number = 2 * (j * (self.x - 1) + i) as u32;
                let n = Vec3::new((z00 - z10) * per_x, (z10 - z11) * per_y, 1.0);
                // A hole has no slope (NaN).
                if !(n.x + n.y).is_nan() && most.max(z10) >= floor && keep(&n, &[v[0], v[1], v[2]])
                {
                    out.push(number);
                }
                let n = Vec3::new((z01 - z11) * per_x, (z00 - z01) * per_y, 1.0);
                if !(n.x + n.y).is_nan() && most.max(z01) >= floor && keep(&n, &[v[0], v[2], v[3]])
                {
                    out.push(number + 1);
                }
            }
        }
    }

    /// Traverses the cells below a ray.
    fn cast(&self, origin: &Vec3, direction: &Vec3, max: f64) -> Option<(u32, f64)> {
        let (mut from, mut to) = (0.0, max.min(1e12));
        for k in 0..2 {
            if direction[k] == 0.0 {
                if origin[k].abs() > self.far[k] {
                    return None;
                }
                continue;
            }
            let (a, b) = (
                (-self.far[k] - origin[k]) / direction[k],
                (self.far[k] - origin[k]) / direction[k],
            );
            (from, to) = (f64::max(from, a.min(b)), f64::min(to, a.max(b)));
        }
        let mut t = from;
        while t <= to {
            let at = origin + direction * t;
            // Step to the next grid line, and slightly beyond it.
            let mut next = to;
            for k in 0..2 {
                if direction[k] != 0.0 {
                    let u = (at[k] + self.far[k]) / self.spacing[k];
                    let line = if direction[k] > 0.0 {
                        (u + 1e-9).floor() + 1.0
                    } else {
                        (u - 1e-9).ceil() - 1.0
                    };
                    next = next.min(t + (line - u) * self.spacing[k] / direction[k]);
                }
            }
            let end = origin + direction * next.min(to);
            let mut best: Option<(u32, f64)> = None;
            for j in self.cells(1, at.y.min(end.y), at.y.max(end.y)) {
                for i in self.cells(0, at.x.min(end.x), at.x.max(end.x)) {
                    for half in 0..2 {
                        let number = (2 * (j * (self.x - 1) + i) + half) as u32;
                        let hit = meet(origin, direction, &self.facet(number as usize).v);
                        if let Some(t) = hit.filter(|t| *t <= max && best.is_none_or(|b| *t < b.1))
                        {
                            best = Some((number, t));
                        }
                    }
                }
            }
            if best.is_some() || next >= to {
                return best;
            }
            t = next;
        }
        None
    }
}
