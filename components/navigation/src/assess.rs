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
//! Sums over discs are sums over rows of differences of running sums, greatest values those of runs of 1, 2, 4, … cells. A tile is judged
//! from the map alone, and whole, so what is judged now and then is bit for bit what is judged at once.
//! A point counts once, so what is near the camera, or faces it, weighs more in plane and roughness.

use crate::map::{Cell, TerrainMap};
use crate::tiles::{CELLS, Index, TILE, Tiles, Touched, join, middle_of, split};
use serde::{Deserialize, Serialize};

/// Sums of a disc: points; x, y, z; xx, xy, yy, xz, yz, zz; seen cells.
const SUMS: usize = 11;
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

/// Judges ground; what it needs for that is made once.
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
    work: Work,
}

/// Arrays over a tile with a margin as wide as the reach.
#[derive(Clone, Debug, Default)]
struct Work {
    /// Row by row, for each sum the running sums of the row, one more than it has cells.
    running: Vec<f64>,
    /// Row by row, for runs of 1, 2, 4, … cells: the greatest step in the run that begins there.
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
        Ok(Assessor { cell, limits, reach, half, count, square, work: Work::default() })
    }

    /// What it judges for.
    #[must_use]
    pub fn limits(&self) -> &Limits {
        &self.limits
    }

    /// Judges anew what depends on the cells that were touched.
    pub fn refresh(&mut self, map: &TerrainMap, touched: &Touched, into: &mut Tiles<Patch>) {
        let far = (self.reach + self.square) as i32;
        let mut tiles = std::collections::BTreeSet::new();
        for [i0, j0, i1, j1] in touched.rectangles() {
            let ((a, _), (b, _)) = (split([i0 - far, j0 - far]), split([i1 + far, j1 + far]));
            tiles.extend((a[1]..=b[1]).flat_map(|j| (a[0]..=b[0]).map(move |i| [i, j])));
        }
        for at in tiles {
            // A tile beside what was seen, whose discs hold no seen cell, would be all unknown: it is not kept.
            if self.gather(map, at) {
                self.judge(into.tile_mut(at));
            }
        }
    }

    /// Sums and steps around a tile; whether there is anything.
    fn gather(&mut self, map: &TerrainMap, at: Index) -> bool {
        let (reach, square) = (self.reach, self.square);
        let edge = TILE as usize;
        let wide = edge + 2 * reach;
        let outer = wide + 2 * square;
        let Work { running, steps, low, high } = &mut self.work;
        low.clear();
        low.resize(outer * outer, f64::INFINITY);
        high.clear();
        high.resize(outer * outer, f64::NEG_INFINITY);
        running.clear();
        running.resize(wide * SUMS * (wide + 1), 0.0);
        let first = at.map(|k| k * TILE - (reach + square) as i32);
        let last = first.map(|k| k + outer as i32 - 1);
        let origin = middle_of(self.cell, join(at, CELLS / 2 + edge / 2));
        let mut any = false;
        let ((a, _), (b, _)) = (split(first), split(last));
        // Heights are counted from the first that is there, which any order of seeing leaves the same.
        let mut base = None;
        for tile in (a[1]..=b[1]).flat_map(|j| (a[0]..=b[0]).map(move |i| [i, j])) {
            let Some(cells) = map.cells.tile(tile) else { continue };
            for j in first[1].max(tile[1] * TILE)..=last[1].min(tile[1] * TILE + TILE - 1) {
                for i in first[0].max(tile[0] * TILE)..=last[0].min(tile[0] * TILE + TILE - 1) {
                    let cell = &cells[split([i, j]).1];
                    if cell.count == 0.0 {
                        continue;
                    }
                    any = true;
                    let (x, y) = ((i - first[0]) as usize, (j - first[1]) as usize);
                    low[y * outer + x] = cell.low;
                    high[y * outer + x] = cell.high;
                    let inner = (x.wrapping_sub(square), y.wrapping_sub(square));
                    if inner.0 < wide && inner.1 < wide {
                        let base = *base.get_or_insert(cell.mean.z);
                        let middle = middle_of(self.cell, [i, j]);
                        let moved = [middle[0] - origin[0], middle[1] - origin[1], -base];
                        for (k, v) in moments(cell, moved).into_iter().enumerate() {
                            running[(inner.1 * SUMS + k) * (wide + 1) + inner.0 + 1] = v;
                        }
                    }
                }
            }
        }
        if any {
            for row in running.chunks_exact_mut(wide + 1) {
                let mut sum = 0.0;
                row.iter_mut().for_each(|v| {
                    sum += *v;
                    *v = sum;
                });
            }
            rises(low, high, outer, square, wide, steps);
            let levels = (2 * reach + 1).ilog2() as usize;
            for level in 0..levels {
                let (done, next) = steps.split_at_mut((level + 1) * wide * wide);
                let (from, run) = (&done[level * wide * wide..], 1 << level);
                for (row, next) in from.chunks_exact(wide).zip(next.chunks_exact_mut(wide)) {
                    for x in 0..wide {
                        next[x] = high_of(row[x], row[(x + run).min(wide - 1)]);
                    }
                }
            }
        }
        any
    }

    fn judge(&self, into: &mut [Patch]) {
        let edge = TILE as usize;
        let (reach, wide) = (self.reach, edge + 2 * self.reach);
        let Work { running, steps, .. } = &self.work;
        for (y, into) in into.chunks_exact_mut(edge).enumerate() {
            let mut sums = [[0.0; TILE as usize]; SUMS];
            let mut step = [0.0; TILE as usize];
            for (dy, half) in self.half.iter().enumerate() {
                let row = y + dy;
                let from = reach - half;
                for (k, sum) in sums.iter_mut().enumerate() {
                    let run = &running[(row * SUMS + k) * (wide + 1)..][..wide + 1];
                    let (a, b) = (&run[from..from + edge], &run[reach + half + 1..][..edge]);
                    for x in 0..edge {
                        sum[x] += b[x] - a[x];
                    }
                }
                let level = (2 * half + 1).ilog2() as usize;
                let row = &steps[(level * wide + row) * wide..][..wide];
                let (a, b) =
                    (&row[from..][..edge], &row[reach + half + 1 - (1 << level)..][..edge]);
                for x in 0..edge {
                    step[x] = high_of(step[x], high_of(a[x], b[x]));
                }
            }
            for (x, patch) in into.iter_mut().enumerate() {
                *patch = self.patch(&sums.map(|s| s[x]), step[x]);
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
        let wall = rise - std::f64::consts::SQRT_2 * limits.tilt.tan().max(0.0) * width;
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

/// Rise in the square around each cell of the inner `wide` by `wide`, 0 where nothing was seen; what follows it in `steps` is room for
/// the longer runs.
fn rises(
    low: &mut [f64],
    high: &mut [f64],
    outer: usize,
    square: usize,
    wide: usize,
    steps: &mut Vec<f64>,
) {
    // Along x, in place: what is written lies behind what is read.
    for (low, high) in low.chunks_exact_mut(outer).zip(high.chunks_exact_mut(outer)) {
        for x in 0..wide {
            let around = x..=x + 2 * square;
            low[x] = low[around.clone()].iter().copied().fold(f64::INFINITY, low_of);
            high[x] = high[around].iter().copied().fold(f64::NEG_INFINITY, high_of);
        }
    }
    let levels = (outer - 2 * square - TILE as usize + 1).ilog2() as usize + 1;
    steps.clear();
    steps.resize(levels * wide * wide, 0.0);
    for y in 0..wide {
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
