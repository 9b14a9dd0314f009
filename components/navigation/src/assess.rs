//! Terrain assessment in the manner of GESTALT: tilt, roughness and step of the disc on which the rover would stand.
//! ```text
//! disc        cells whose centres are within r of the centre of the assessed cell; its points enter by their moments
//! plane       z = m_z + a (x − m_x) + b (y − m_y),   [S_xx S_xy; S_xy S_yy] [a; b] = [S_xz; S_yz]
//! tilt        atan √(a² + b²)
//! roughness   √((S_zz − a S_xz − b S_yz)/n) cos(tilt)                  RMS distance of the points from the plane
//! step        max of D over the disc, minus (|a| + |b|) w               D: maximum minus minimum height in a square of edge w
//! goodness    255 (1 − max(tilt/tilt_max, roughness/roughness_max, step/step_max)), rounded; 0 where that is negative: a hazard
//! unknown     too small a part of the disc was observed, or only points along a line; if D alone is a hazard, it is reported as a hazard
//! ```
//! Goldberg, Maimone, Matthies, "Stereo vision and rover navigation software for planetary exploration", IEEE Aerospace Conference, 2002;
//! Maimone, Biesiadecki, Tunstel, Cheng, Leger, "Surface navigation and mobility intelligence on the Mars Exploration Rovers", 2006: planes
//! by sums of moments, the worst of three hazards in 0 … 255. The scaling of the three hazards is specific to this module: all are linear, and the
//! slope of the fitted plane is subtracted from the step.
//!
//! Sums over discs are computed from prefix sums of rows, maxima from runs of 1, 2, 4, … cells. Prefix sums cover a block of tiles with its margin
//! and begin at fixed cells, so an incremental assessment is bit-identical to a complete one. Every point has equal weight, so ground near the camera
//! or facing it has more weight in plane and roughness.

use crate::map::{Cell, TerrainMap};
use crate::tiles::{Index, TILE, Tiles, Touched, middle_of, split};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// Number of sums of a disc: points; x, y, z; xx, xy, yy, xz, yz, zz; seen cells.
const SUMS: usize = 11;
/// Cells along the edge of a tile.
const EDGE: usize = TILE as usize;
/// Tiles of a block along x and y: long along y, because rows that are not needed are skipped.
const BLOCK: Index = [2, 8];
/// Number of lines of cells that are assessed together: their discs share most rows.
const TOGETHER: usize = 4;
/// The points are treated as collinear if det S is below this fraction of the product of its diagonal.
const LINE: f64 = 1e-4;
/// Maximum goodness.
pub const BEST: u8 = 255;
/// Maximum number of cells from the centre of a disc to its edge.
pub const REACH_MAX: usize = 64;

/// Terrain limits of a rover.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Limits {
    /// Radius of the disc, m.
    pub radius: f64,
    /// Edge of the square in which steps are measured, m: about a wheel diameter.
    pub step_width: f64,
    /// Tilt from which the ground is a hazard, rad.
    pub tilt: f64,
    /// Roughness from which the ground is a hazard, m.
    pub roughness: f64,
    /// Step from which the ground is a hazard, m.
    pub step: f64,
    /// Minimum fraction of a disc's cells that must be observed, 0 … 1.
    pub seen: f64,
}

/// Error of terrain limits.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum LimitsFault {
    /// A value is out of its range.
    #[error("{what} is {value}\n  help: {help}")]
    Number {
        /// Name of the parameter.
        what: &'static str,
        /// Its value.
        value: f64,
        /// The remedy.
        help: &'static str,
    },
    /// The disc has too many cells.
    #[error(
        "a disc of {radius} m has {cells} cells of {cell} m from its centre to its edge\n help: the maximum is {REACH_MAX}: make the cells larger"
    )]
    Cells {
        /// Radius, m.
        radius: f64,
        /// Edge of a cell, m.
        cell: f64,
        /// Cells along the radius.
        cells: f64,
    },
}

impl Part {
    /// Returns the bounding rectangle of both.
    fn and(self, b: Part) -> Part {
        let around = |a: [usize; 2], b: [usize; 2]| [a[0].min(b[0]), a[1].max(b[1])];
        Part { x: around(self.x, b.x), y: around(self.y, b.y) }
    }
}

/// Assessment of the ground for a rover at the centre of a cell.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(from = "(f32, f32, f32, u8, bool)", into = "(f32, f32, f32, u8, bool)")]
pub struct Patch {
    /// Angle between the fitted plane and the horizontal, rad.
    pub tilt: f32,
    /// RMS distance of the points from the plane, m.
    pub roughness: f32,
    /// Largest step, m.
    pub step: f32,
    /// Goodness, 0 (a hazard) to 255; 0 where unknown.
    pub goodness: u8,
    /// Enough of the disc was observed for an assessment.
    pub known: bool,
}

impl From<(f32, f32, f32, u8, bool)> for Patch {
    fn from((tilt, roughness, step, goodness, known): (f32, f32, f32, u8, bool)) -> Self {
        Patch { tilt, roughness, step, goodness, known }
    }
}

impl From<Patch> for (f32, f32, f32, u8, bool) {
    fn from(p: Patch) -> Self {
        (p.tilt, p.roughness, p.step, p.goodness, p.known)
    }
}

/// Assesses the ground.
#[derive(Clone, Debug)]
pub struct Assessor {
    cell: f64,
    limits: Limits,
    /// Cells from the middle of a disc to its edge.
    reach: usize,
    /// Half width in cells of each row of the disc, from the lowest row.
    half: Vec<usize>,
    /// Number of cells of the disc.
    count: f64,
    /// Cells from the centre of a step's square to its edge.
    square: usize,
    /// Maximum rise of a slope within the limits over that square, m.
    slope_rise: f64,
}

/// Work arrays over the needed rows and columns of a block with its margin.
#[derive(Clone, Debug, Default)]
struct Work {
    /// Columns and rows; with the margin for the squares of steps as well.
    wide: usize,
    rows: usize,
    outer: usize,
    /// Prefix sums along each row for each sum; one more entry than cells.
    running: Vec<f64>,
    /// Largest step in the run that begins at each cell, for runs of 1, 2, 4, … cells.
    steps: Vec<f64>,
    /// Cells with a margin for the squares of steps: minimum and maximum height, ∞ and −∞ where nothing was observed.
    low: Vec<f64>,
    high: Vec<f64>,
}

/// Rectangle of cells to assess, relative to the first cell of their block: minimum and maximum x and y, inclusive.
#[derive(Clone, Copy, Debug)]
struct Part {
    x: [usize; 2],
    y: [usize; 2],
}

impl Assessor {
    /// Creates an assessor for cells with an edge of `cell` (m).
    ///
    /// # Errors
    /// Returns an error for limits out of range and for a disc of too many cells.
    pub fn new(cell: f64, limits: Limits) -> Result<Self, LimitsFault> {
        let positive = |what, value: f64| match value > 0.0 && value.is_finite() {
            true => Ok(()),
            false => {
                Err(LimitsFault::Number { what, value, help: "it must be positive and finite" })
            }
        };
        positive("the cell edge (m)", cell)?;
        positive("the radius of the disc (m)", limits.radius)?;
        positive("the tilt limit (rad)", limits.tilt)?;
        positive("the roughness limit (m)", limits.roughness)?;
        positive("the step limit (m)", limits.step)?;
        positive("the width of a step (m)", limits.step_width)?;
        if !(0.0..=1.0).contains(&limits.seen) {
            let (what, help) =
                ("the minimum observed fraction of a disc", "it must be between 0 and 1");
            return Err(LimitsFault::Number { what, value: limits.seen, help });
        }
        // The factor covers round-off, because 0.3 m must be three cells of 0.1 m.
        let reaches = limits.radius / cell * (1.0 + 1e-12);
        let widest = reaches.max(0.5 * limits.step_width / cell);
        if widest > REACH_MAX as f64 {
            return Err(LimitsFault::Cells { radius: limits.radius, cell, cells: widest });
        }
        let reach = reaches as usize;
        let end = |dy: usize| (reaches * reaches - (dy * dy) as f64).max(0.0).sqrt() as usize;
        let half: Vec<_> = (0..=2 * reach).map(|k| end(k.abs_diff(reach))).collect();
        let count = half.iter().map(|h| 2 * h + 1).sum::<usize>() as f64;
        let square = (0.5 * limits.step_width / cell).round() as usize;
        let width = (2 * square) as f64 * cell;
        let slope_rise = std::f64::consts::SQRT_2 * limits.tilt.tan().max(0.0) * width;
        Ok(Assessor { cell, limits, reach, half, count, square, slope_rise })
    }

    /// Returns the distance, in cells along x or y, from an assessed cell to the farthest cell that affects it.
    #[must_use]
    pub fn depends_on(&self) -> i32 {
        (self.reach + self.square) as i32
    }

    /// Returns the terrain limits.
    #[must_use]
    pub fn limits(&self) -> &Limits {
        &self.limits
    }

    /// Reassesses all cells that depend on the changed cells.
    pub fn refresh(&self, map: &TerrainMap, touched: &Touched, into: &mut Tiles<Patch>) {
        let far = self.depends_on();
        // For each tile, find the bounding rectangle of the cells to assess; group the tiles by
        // block.
        let mut blocks: BTreeMap<Index, BTreeMap<Index, Part>> = BTreeMap::new();
        for [i0, j0, i1, j1] in touched.rectangles() {
            let (low, high) = ([i0 - far, j0 - far], [i1 + far, j1 + far]);
            let ((a, _), (b, _)) = (split(low), split(high));
            for at in (a[1]..=b[1]).flat_map(|j| (a[0]..=b[0]).map(move |i| [i, j])) {
                let block = [0, 1].map(|k| at[k].div_euclid(BLOCK[k]));
                let ends = |k: usize| {
                    let first = block[k] * BLOCK[k] * TILE;
                    let from = low[k].max(at[k] * TILE) - first;
                    let to = high[k].min(at[k] * TILE + TILE - 1) - first;
                    [from as usize, to as usize]
                };
                let part = Part { x: ends(0), y: ends(1) };
                let tiles = blocks.entry(block).or_default();
                let all = tiles.entry(at).or_insert(part);
                *all = all.and(part);
            }
        }
        let mut work = Work::default();
        for (block, tiles) in blocks {
            let Some(all) = tiles.values().copied().reduce(Part::and) else { continue };
            if self.gather(map, block, all, &mut work) {
                tiles.into_iter().for_each(|(at, part)| self.judge(&work, all, at, part, into));
            }
        }
    }

    /// Computes sums and steps for a part of a block. Returns false if it has no observations.
    fn gather(&self, map: &TerrainMap, block: Index, part: Part, work: &mut Work) -> bool {
        let (reach, square) = (self.reach, self.square);
        let Work { wide, rows, outer, running, steps, low, high } = work;
        *wide = part.x[1] + 1 + 2 * reach;
        *rows = part.y[1] + 1 - part.y[0] + 2 * reach;
        *outer = *wide + 2 * square;
        let (wide, rows, outer) = (*wide, *rows, *outer);
        let tall = rows + 2 * square;
        for (v, none) in [(&mut *low, f64::INFINITY), (&mut *high, f64::NEG_INFINITY)] {
            v.clear();
            v.resize(outer * tall, none);
        }
        // The first entry of each row is 0; all others are written before they are read.
        running.resize(SUMS * rows * (wide + 1), 0.0);
        let margin = (reach + square) as i32;
        let first = [0, 1].map(|k| block[k] * BLOCK[k] * TILE - margin);
        let middle = [0, 1].map(|k| block[k] * BLOCK[k] * TILE + BLOCK[k] * TILE / 2);
        let middle = middle_of(self.cell, middle);
        let base = map.base.unwrap_or(0.0);
        let mut any = false;
        for y in 0..tall {
            let j = first[1] + (part.y[0] + y) as i32;
            let summed = (square..square + rows).contains(&y);
            let stride = wide + 1;
            let running = match summed {
                true => &mut running[(y - square) * SUMS * stride..][..SUMS * stride],
                false => &mut [],
            };
            let (low, high) = (&mut low[y * outer..][..outer], &mut high[y * outer..][..outer]);
            let mut sums = [0.0; SUMS];
            running.iter_mut().step_by(stride).for_each(|v| *v = 0.0);
            let mut x = 0;
            while x < outer {
                // Process cells up to the end of one tile.
                let i = first[0] + x as i32;
                let (tile, place) = split([i, j]);
                let count = (EDGE - i.rem_euclid(TILE) as usize).min(outer - x);
                let cells = map.cells.tile(tile).map(|cells| &cells[place..place + count]);
                for k in 0..count {
                    let x = x + k;
                    let cell = cells.map(|c| &c[k]).filter(|c| c.count > 0.0);
                    if let Some(cell) = cell {
                        (low[x], high[x]) = (cell.low, cell.high);
                    }
                    if !summed || !(square..square + wide).contains(&x) {
                        continue;
                    }
                    if let Some(cell) = cell {
                        let [cx, cy] = middle_of(self.cell, [i + k as i32, j]);
                        let add = moments(cell, [cx - middle[0], cy - middle[1], -base]);
                        (0..SUMS).for_each(|k| sums[k] += add[k]);
                    }
                    let at = x - square + 1;
                    (0..SUMS).for_each(|k| running[k * stride + at] = sums[k]);
                }
                any |= cells.is_some_and(|c| c.iter().any(|c| c.count > 0.0));
                x += count;
            }
        }
        if any {
            rises(low, high, square, [wide, rows], steps);
            let level_size = wide * rows;
            let levels = (2 * reach + 1).ilog2() as usize;
            steps.resize((levels + 1) * level_size, 0.0);
            for level in 0..levels {
                let (done, next) = steps.split_at_mut((level + 1) * level_size);
                let (from, run) = (&done[level * level_size..], 1 << level);
                for y in 0..rows {
                    let (row, next) = (&from[y * wide..][..wide], &mut next[y * wide..][..wide]);
                    // Runs that would end beyond the row are not needed.
                    let count = wide.saturating_sub(run);
                    let (a, b) = (&row[..count], &row[wide - count..]);
                    for ((next, a), b) in next.iter_mut().zip(a).zip(b) {
                        *next = high_of(*a, *b);
                    }
                }
            }
        }
        any
    }

    /// Assesses a part of a tile; `all` is the part of its block that was gathered.
    fn judge(&self, work: &Work, all: Part, at: Index, part: Part, into: &mut Tiles<Patch>) {
        let Work { wide, rows, running, steps, .. } = work;
        let (reach, wide, stride) = (self.reach, *wide, *wide + 1);
        let [x0, x1] = part.x;
        let count = x1 + 1 - x0;
        let mut patches = [Patch::default(); EDGE];
        let end = part.y[1] + 1;
        for y in (part.y[0]..end).step_by(TOGETHER) {
            let lines = TOGETHER.min(end - y);
            let mut sums = [[[0.0; EDGE]; SUMS]; TOGETHER];
            let mut steps_of = [[0.0; EDGE]; TOGETHER];
            for below in 0..lines - 1 + self.half.len() {
                let row = y - all.y[0] + below;
                let of_row = &running[row * SUMS * stride..][..SUMS * stride];
                // Each row contributes to the discs of several lines.
                for line in 0..lines {
                    let half = below.checked_sub(line).and_then(|dy| self.half.get(dy));
                    let Some(half) = half.copied() else { continue };
                    let (from, to) = (x0 + reach - half, x0 + reach + half + 1);
                    for (k, sums) in sums[line].iter_mut().enumerate() {
                        let run = &of_row[k * stride..][..stride];
                        let (a, b) = (&run[from..][..count], &run[to..][..count]);
                        for ((sum, a), b) in sums[..count].iter_mut().zip(a).zip(b) {
                            *sum += b - a;
                        }
                    }
                    let level = (2 * half + 1).ilog2() as usize;
                    let run = &steps[(level * rows + row) * wide..][..wide];
                    let (a, b) = (&run[from..][..count], &run[to - (1 << level)..][..count]);
                    for ((step, a), b) in steps_of[line][..count].iter_mut().zip(a).zip(b) {
                        *step = high_of(*step, high_of(*a, *b));
                    }
                }
            }
            for line in 0..lines {
                for x in 0..count {
                    let of_disc = std::array::from_fn(|k| sums[line][k][x]);
                    patches[x] = self.patch(&of_disc, steps_of[line][x]);
                }
                // Tiles without any known cell are not stored.
                let told = &patches[..count];
                if into.tile(at).is_some() || told.iter().any(|p| *p != Patch::default()) {
                    let first = ((y + line) % EDGE) * EDGE + x0 % EDGE;
                    into.tile_mut(at)[first..first + count].copy_from_slice(told);
                }
            }
        }
    }

    /// Computes the assessment from the sums of a disc and the maximum D in it.
    fn patch(&self, sums: &[f64; SUMS], rise: f64) -> Patch {
        let [n, x, y, z, xx, xy, yy, xz, yz, zz, seen] = *sums;
        if n < 0.5 {
            return Patch::default();
        }
        let limits = &self.limits;
        let (mx, my, mz) = (x / n, y / n, z / n);
        let (xx, xy, yy) = (xx - x * mx, xy - x * my, yy - y * my);
        let (xz, yz, zz) = (xz - x * mz, yz - y * mz, zz - z * mz);
        let det = xx * yy - xy * xy;
        let width = (2 * self.square) as f64 * self.cell;
        // This is the part of the rise that a slope within the limits cannot explain.
        let wall = rise - self.slope_rise;
        let unknown = !(seen >= limits.seen * self.count && det > LINE * xx * yy);
        if unknown {
            let hazard = wall >= limits.step;
            let step = if hazard { wall } else { 0.0 };
            return Patch { step: step as f32, known: hazard, ..Patch::default() };
        }
        let (a, b) = ((xz * yy - yz * xy) / det, (yz * xx - xz * xy) / det);
        let slope = (a * a + b * b).sqrt();
        let tilt = slope.atan();
        let left = (zz - a * xz - b * yz) / n;
        let roughness = (left.max(0.0) / (1.0 + slope * slope)).sqrt();
        let step = (rise - (a.abs() + b.abs()) * width).max(0.0);
        let worst = (tilt / limits.tilt).max(roughness / limits.roughness).max(step / limits.step);
        let goodness = (f64::from(BEST) * (1.0 - worst)).round().max(0.0) as u8;
        let [tilt, roughness, step] = [tilt, roughness, step].map(|v| v as f32);
        Patch { tilt, roughness, step, goodness, known: true }
    }
}

/// Returns the greater of two numbers with one instruction; heights are never NaN.
#[inline]
fn high_of(a: f64, b: f64) -> f64 {
    if a > b { a } else { b }
}

#[inline]
fn low_of(a: f64, b: f64) -> f64 {
    if a < b { a } else { b }
}

/// Returns the sums of a cell about another origin, at `−moved` from its own.
fn moments(cell: &Cell, moved: [f64; 3]) -> [f64; SUMS] {
    let n = cell.count;
    let [x, y, z] = [cell.mean.x + moved[0], cell.mean.y + moved[1], cell.mean.z + moved[2]];
    let [xx, xy, yy, xz, yz, zz] = cell.spread;
    [
        n,
        n * x,
        n * y,
        n * z,
        xx + n * x * x,
        xy + n * x * y,
        yy + n * y * y,
        xz + n * x * z,
        yz + n * y * z,
        zz + n * z * z,
        1.0,
    ]
}

/// Computes the rise in the square around each cell, 0 where nothing was observed: the first level of the steps.
fn rises(
    low: &mut [f64],
    high: &mut [f64],
    square: usize,
    [wide, rows]: [usize; 2],
    steps: &mut Vec<f64>,
) {
    let outer = wide + 2 * square;
    // This pass works along x in place, because writes stay behind reads.
    for (low, high) in low.chunks_exact_mut(outer).zip(high.chunks_exact_mut(outer)) {
        for x in 0..wide {
            let (mut least, mut most) = (low[x], high[x]);
            for dx in 1..=2 * square {
                least = low_of(least, low[x + dx]);
                most = high_of(most, high[x + dx]);
            }
            (low[x], high[x]) = (least, most);
        }
    }
    steps.clear();
    steps.resize(wide * rows, 0.0);
    // This pass works along y, also in place.
    for (y, steps) in steps.chunks_exact_mut(wide).enumerate() {
        let (least, low) = low[y * outer..].split_at_mut(outer);
        let (most, high) = high[y * outer..].split_at_mut(outer);
        let (least, most) = (&mut least[..wide], &mut most[..wide]);
        for row in 0..2 * square {
            let (low, high) = (&low[row * outer..][..wide], &high[row * outer..][..wide]);
            for x in 0..wide {
                least[x] = low_of(least[x], low[x]);
                most[x] = high_of(most[x], high[x]);
            }
        }
        for ((step, least), most) in steps.iter_mut().zip(least).zip(most) {
            *step = if *most >= *least { *most - *least } else { 0.0 };
        }
    }
}

#[cfg(test)]
mod tests;
