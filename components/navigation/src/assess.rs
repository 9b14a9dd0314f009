//! How good the ground is for a rover, in the manner of GESTALT: tilt, roughness and step of the disc that it would stand on.
//! ```text
//! disc        cells whose middles are within r of the middle of the cell that is judged; all of its points by their moments
//! plane       z = m_z + a (x − m_x) + b (y − m_y),   [S_xx S_xy; S_xy S_yy] [a; b] = [S_xz; S_yz]
//! tilt        atan √(a² + b²)
//! roughness   √((S_zz − a S_xz − b S_yz)/n) cos(tilt)                  RMS distance of the points from the plane
//! step        max over the disc of D, less (|a| + |b|) w               D: greatest height less least height in a square of edge w
//! goodness    255 (1 − max(tilt/tilt_max, roughness/roughness_max, step/step_max)), rounded; 0 where that is negative: a hazard
//! unknown     too small a part of the disc seen, or seen along a line only; where D alone is a hazard it is told all the same
//! ```
//! Goldberg, Maimone, Matthies, "Stereo vision and rover navigation software for planetary exploration", IEEE Aerospace Conference, 2002;
//! Maimone, Biesiadecki, Tunstel, Cheng, Leger, "Surface navigation and mobility intelligence on the Mars Exploration Rovers", 2006: planes
//! by sums of moments, the worst of three hazards in 0 … 255. How the three become numbers is this module's: all are linear, and the
//! step is freed of the slope of its own plane.
//!
//! Sums over discs are sums over rows of differences of running sums, greatest values those of runs of 1, 2, 4, … cells. The sums of
//! a tile begin at fixed places, so what is judged now and then is bit for bit what is judged at once.
//! A point counts once, so what is near the camera, or faces it, weighs more in plane and roughness.

use crate::map::{Cell, TerrainMap};
use crate::tiles::{Index, TILE, Tiles, Touched, middle_of, split};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// Sums of a disc: points; x, y, z; xx, xy, yy, xz, yz, zz; seen cells.
const SUMS: usize = 11;
/// Cells along the edge of a tile.
const EDGE: usize = TILE as usize;
/// det S below this part of its diagonal's product: the points lie on a line.
const LINE: f64 = 1e-4;
/// No goodness is higher.
pub const BEST: u8 = 255;
/// Most cells from the middle of a disc to its edge.
pub const REACH_MAX: usize = 64;

/// What a rover stands.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Limits {
    /// Radius of the disc, m.
    pub radius: f64,
    /// Edge of the square in which steps are looked for, m: the diameter of a wheel or so.
    pub step_width: f64,
    /// Tilt of a hazard, rad.
    pub tilt: f64,
    /// Roughness of a hazard, m.
    pub roughness: f64,
    /// Step of a hazard, m.
    pub step: f64,
    /// Least part of a disc's cells that has to be seen, 0 … 1.
    pub seen: f64,
}

/// Why a rover cannot be judged for.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum LimitsFault {
    /// A number that makes no sense.
    #[error("{what} is {value}\n  help: {help}")]
    Number {
        /// Which.
        what: &'static str,
        /// Its value.
        value: f64,
        /// What it must be.
        help: &'static str,
    },
    /// A disc of too many cells.
    #[error(
        "a disc of {radius} m has {cells} cells of {cell} m from its middle to its edge\n  help: {REACH_MAX} at most: make the cells larger"
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

/// The ground as a rover on the middle of a cell would meet it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(from = "(f32, f32, f32, u8, bool)", into = "(f32, f32, f32, u8, bool)")]
pub struct Patch {
    /// Angle of its plane to the horizontal, rad.
    pub tilt: f32,
    /// RMS distance of its points from the plane, m.
    pub roughness: f32,
    /// Greatest step in it, m.
    pub step: f32,
    /// 0 (a hazard) to 255; 0 where it is not known.
    pub goodness: u8,
    /// Enough of it was seen to tell.
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

/// Judges ground.
#[derive(Clone, Debug)]
pub struct Assessor {
    cell: f64,
    limits: Limits,
    /// Cells from the middle of a disc to its edge.
    reach: usize,
    /// For each row of the disc, from the lowest: cells from its middle to its end.
    half: Vec<usize>,
    /// Cells of the disc.
    count: f64,
    /// Cells from the middle of a step's square to its edge.
    square: usize,
    /// What a slope within the limits rises in that square at most, m.
    slope_rise: f64,
}

/// Arrays over a tile with a margin as wide as the reach.
#[derive(Clone, Debug, Default)]
struct Work {
    /// For each sum, row by row the running sums of the row, one more than it has cells.
    running: Vec<f64>,
    /// Level by level, for runs of 1, 2, 4, … cells: the greatest step in the run that begins there.
    steps: Vec<f64>,
    /// Cells with a margin for the squares of steps: least and greatest height, ∞ and −∞ where nothing was seen.
    low: Vec<f64>,
    high: Vec<f64>,
}

impl Assessor {
    /// For cells with an edge of `cell` (m).
    ///
    /// # Errors
    /// Limits that no rover has; a disc of too many cells.
    pub fn new(cell: f64, limits: Limits) -> Result<Self, LimitsFault> {
        let positive = |what, value: f64| match value > 0.0 && value.is_finite() {
            true => Ok(()),
            false => {
                Err(LimitsFault::Number { what, value, help: "it must be positive and finite" })
            }
        };
        positive("the edge of a cell (m)", cell)?;
        positive("the radius of the disc (m)", limits.radius)?;
        positive("the greatest tilt (rad)", limits.tilt)?;
        positive("the greatest roughness (m)", limits.roughness)?;
        positive("the greatest step (m)", limits.step)?;
        positive("the width of a step (m)", limits.step_width)?;
        if !(0.0..=1.0).contains(&limits.seen) {
            let (what, help) = ("the part of a disc that has to be seen", "it is between 0 and 1");
            return Err(LimitsFault::Number { what, value: limits.seen, help });
        }
        // 0.3 m are three cells of 0.1 m.
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

    /// Cells from the middle of one that is judged to the farthest that it depends on, along x or y.
    #[must_use]
    pub fn depends_on(&self) -> i32 {
        (self.reach + self.square) as i32
    }

    /// What it judges for.
    #[must_use]
    pub fn limits(&self) -> &Limits {
        &self.limits
    }

    /// Judges anew what depends on the cells that were touched.
    pub fn refresh(&self, map: &TerrainMap, touched: &Touched, into: &mut Tiles<Patch>) {
        let far = self.depends_on();
        // What is to be judged of each tile: one rectangle around all of it, counted from the tile's first cell.
        let mut tiles = BTreeMap::new();
        for [i0, j0, i1, j1] in touched.rectangles() {
            let (low, high) = ([i0 - far, j0 - far], [i1 + far, j1 + far]);
            let ((a, _), (b, _)) = (split(low), split(high));
            for at in (a[1]..=b[1]).flat_map(|j| (a[0]..=b[0]).map(move |i| [i, j])) {
                let from = |k: usize| (low[k] - at[k] * TILE).max(0) as usize;
                let to = |k: usize| (high[k] - at[k] * TILE).min(TILE - 1) as usize;
                let r = tiles.entry(at).or_insert([from(0), from(1), to(0), to(1)]);
                *r = [r[0].min(from(0)), r[1].min(from(1)), r[2].max(to(0)), r[3].max(to(1))];
            }
        }
        let mut work = Work::default();
        for (at, [x0, y0, x1, y1]) in tiles {
            // A tile beside what was seen, whose discs hold no seen cell, would be all unknown: it is not kept.
            if self.gather(map, at, [y0, y1], &mut work) {
                self.judge(&work, [x0..x1 + 1, y0..y1 + 1], into.tile_mut(at));
            }
        }
    }

    /// Sums and steps around the rows of a tile from the first to the last; whether there is anything.
    fn gather(&self, map: &TerrainMap, at: Index, rows: [usize; 2], work: &mut Work) -> bool {
        let (reach, square) = (self.reach, self.square);
        let wide = EDGE + 2 * reach;
        let outer = wide + 2 * square;
        let Work { running, steps, low, high } = work;
        for (v, none) in [(&mut *low, f64::INFINITY), (&mut *high, f64::NEG_INFINITY)] {
            v.clear();
            v.resize(outer * outer, none);
        }
        // All that is read of it is written first.
        running.resize(SUMS * wide * (wide + 1), 0.0);
        let first = at.map(|k| k * TILE - (reach + square) as i32);
        let middle = middle_of(self.cell, [at[0] * TILE + TILE / 2, at[1] * TILE + TILE / 2]);
        let base = map.base.unwrap_or(0.0);
        let inner = square..square + wide;
        let mut any = false;
        for y in rows[0]..rows[1] + 2 * (reach + square) + 1 {
            let j = first[1] + y as i32;
            let mut sums = [0.0; SUMS];
            let mut cells: Option<(i32, Option<&[Cell]>)> = None;
            for x in 0..outer {
                let i = first[0] + x as i32;
                let (tile, place) = split([i, j]);
                let found = match cells {
                    Some((column, found)) if column == tile[0] => found,
                    _ => map.cells.tile(tile),
                };
                cells = Some((tile[0], found));
                let here = inner.contains(&x) && inner.contains(&y);
                if let Some(cell) = found.map(|c| &c[place]).filter(|c| c.count > 0.0) {
                    any = true;
                    low[y * outer + x] = cell.low;
                    high[y * outer + x] = cell.high;
                    if here {
                        let [cx, cy] = middle_of(self.cell, [i, j]);
                        let moved = [cx - middle[0], cy - middle[1], -base];
                        let add = moments(cell, moved);
                        (0..SUMS).for_each(|k| sums[k] += add[k]);
                    }
                }
                if here {
                    for (k, sum) in sums.iter().enumerate() {
                        running[(k * wide + y - square) * (wide + 1) + x - square + 1] = *sum;
                    }
                }
            }
        }
        if any {
            let rows = rows[0]..rows[1] + 2 * reach + 1;
            rises(low, high, square, wide, &rows, steps);
            for level in 0..(2 * reach + 1).ilog2() as usize {
                let (done, next) = steps.split_at_mut((level + 1) * wide * wide);
                let (from, run) = (&done[level * wide * wide..], 1 << level);
                for y in rows.clone() {
                    let (row, next) = (&from[y * wide..][..wide], &mut next[y * wide..][..wide]);
                    for x in 0..wide {
                        next[x] = high_of(row[x], row[(x + run).min(wide - 1)]);
                    }
                }
            }
        }
        any
    }

    fn judge(&self, work: &Work, [xs, ys]: [std::ops::Range<usize>; 2], into: &mut [Patch]) {
        let (reach, wide) = (self.reach, EDGE + 2 * self.reach);
        for y in ys {
            let mut sums = [[0.0; EDGE]; SUMS];
            for (k, sums) in sums.iter_mut().enumerate() {
                for (dy, half) in self.half.iter().enumerate() {
                    let run = &work.running[(k * wide + y + dy) * (wide + 1)..][..wide + 1];
                    let (a, b) = (&run[reach - half..][..EDGE], &run[reach + half + 1..][..EDGE]);
                    for x in 0..EDGE {
                        sums[x] += b[x] - a[x];
                    }
                }
            }
            let mut step = [0.0; EDGE];
            for (dy, half) in self.half.iter().enumerate() {
                let level = (2 * half + 1).ilog2() as usize;
                let row = &work.steps[(level * wide + y + dy) * wide..][..wide];
                let end = reach + half + 1 - (1 << level);
                let (a, b) = (&row[reach - half..][..EDGE], &row[end..][..EDGE]);
                for x in 0..EDGE {
                    step[x] = high_of(step[x], high_of(a[x], b[x]));
                }
            }
            for x in xs.clone() {
                let of_disc = std::array::from_fn(|k| sums[k][x]);
                into[y * EDGE + x] = self.patch(&of_disc, step[x]);
            }
        }
    }

    /// Of the sums of a disc and the greatest D in it.
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
        // A rise that no slope within the limits makes.
        let wall = rise - self.slope_rise;
        let unknown = !(seen >= limits.seen * self.count && det > LINE * xx * yy);
        if unknown {
            let hazard = wall >= limits.step;
            let step = if hazard { wall } else { 0.0 };
            return Patch { step: step as f32, known: hazard, ..Patch::default() };
        }
        let (a, b) = ((xz * yy - yz * xy) / det, (yz * xx - xz * xy) / det);
        let slope = a.hypot(b);
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

/// The greater of two numbers, one instruction; heights are never NaN.
#[inline]
fn high_of(a: f64, b: f64) -> f64 {
    if a > b { a } else { b }
}

#[inline]
fn low_of(a: f64, b: f64) -> f64 {
    if a < b { a } else { b }
}

/// Sums of a cell about another origin, which lies `−moved` from its own.
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

/// Rise in the square around each cell of some rows, 0 where nothing was seen; what follows in `steps` is room for longer runs.
fn rises(
    low: &mut [f64],
    high: &mut [f64],
    square: usize,
    wide: usize,
    rows: &std::ops::Range<usize>,
    steps: &mut Vec<f64>,
) {
    let outer = wide + 2 * square;
    // Along x, in place: what is written lies behind what is read.
    for y in rows.start..rows.end + 2 * square {
        let (low, high) = (&mut low[y * outer..][..outer], &mut high[y * outer..][..outer]);
        for x in 0..wide {
            let (mut least, mut most) = (low[x], high[x]);
            for dx in 1..=2 * square {
                least = low_of(least, low[x + dx]);
                most = high_of(most, high[x + dx]);
            }
            (low[x], high[x]) = (least, most);
        }
    }
    let levels = (wide - EDGE + 1).ilog2() as usize + 1;
    steps.clear();
    steps.resize(levels * wide * wide, 0.0);
    for y in rows.clone() {
        for x in 0..wide {
            let (mut least, mut most) = (f64::INFINITY, f64::NEG_INFINITY);
            for row in y..=y + 2 * square {
                least = low_of(least, low[row * outer + x]);
                most = high_of(most, high[row * outer + x]);
            }
            steps[y * wide + x] = if most >= least { most - least } else { 0.0 };
        }
    }
}

#[cfg(test)]
mod tests;
