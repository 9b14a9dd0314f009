//! `mobility.ruts`: soft ground that stores the compaction by earlier passes, as a field that wheels read and write.
//! ```text
//! cells      squares of the horizontal plane; each keeps the deepest press z_u, its pressure p_u, the rut z_r
//! print      z(s) = Z − (r − √(r² − s²)) under a rim, s along the heading, |t| ≤ b/2 across
//! update     a cell takes its state after a press to z(s) (`multipass`); the deepest press stays
//! reading    bilinear between the middles of cells in z_u, p_u, z_r;  k_u = p_u/(z_u − z_r)
//! ```
//! Depths are along the normal of the ground, below its undisturbed surface, which the terrain still returns. Cells are stored in tiles of 32 by 32
//! cells, which are allocated when they are first pressed; a cell takes 12 bytes. With cells of 4 cm, the track of a wheel of 0.4 m takes about 0.2
//! MB per 10 m, and a whole region of 100 m by 100 m takes 75 MB.
use crate::changed::Changed;
use crate::multipass::{Rut, Unloading};
use linkwork_surroundings::prelude::*;
use serde::{Deserialize, Serialize};
use std::sync::Arc;

/// One cell: deepest loading (m), pressure at that depth (Pa), depth without load (m).
type Cell = [f32; 3];
/// Tiles of cells.
type Tiles = crate::tiles::Tiles<Cell, 32>;

/// Parameters of the ruts.
#[derive(Params, Clone, Debug)]
pub struct RutsParams {
    /// Edge of a cell.
    #[param(unit = "m", default = 0.04, range = 0.001..=10.0)]
    pub cell: f64,
    /// Region x_min, y_min, x_max, y_max (m) in which ruts are stored; default: the whole terrain.
    #[param(default = None)]
    pub region: Option<[f64; 4]>,
    /// Unloading stiffness of pressed soil at depth zero, N/m³.
    #[param(default = 0.0, range = 0.0..)]
    pub stiffness: f64,
    /// Increase of the unloading stiffness with depth, N/m⁴; the default is Wong's value for LETE sand.
    #[param(default = 5.03e8, range = 0.0..)]
    pub stiffness_growth: f64,
    /// Terrain of the ground.
    #[param(service)]
    pub terrain: Handle<dyn Terrain>,
}

/// Print of one wheel; zero sinkage leaves no print.
#[derive(Ports, Clone, Copy, Debug)]
pub struct Print {
    /// Lowest point of the rim, W.
    #[port("m")]
    pub contact_point: Vec3,
    /// Depth of that point below the undisturbed surface.
    #[port("m")]
    pub sinkage: f64,
    /// Ground normal, unit, W.
    #[port("1")]
    pub print_normal: Vec3,
    /// Heading of the wheel in the ground plane, unit, W.
    #[port("1")]
    pub print_heading: Vec3,
    /// Radius of the rim.
    #[port("m")]
    pub print_radius: f64,
    /// Width of the rim.
    #[port("m")]
    pub print_width: f64,
    /// Sinkage modulus k, N/m^(n+2).
    #[port("1")]
    pub print_modulus: f64,
    /// Sinkage exponent n.
    #[port("1")]
    pub print_exponent: f64,
}

/// Cell grid of the ground, and the unloading stiffness of pressed soil.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RutGrid {
    /// Edge of a cell, m.
    pub cell: f64,
    /// x_min, y_min, x_max, y_max, m.
    pub region: [f64; 4],
    /// Unloading stiffness of pressed soil.
    pub unloading: Unloading,
}

/// Data of the field: all cells that have been pressed. Copies share tiles that do not change.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(transparent)]
pub struct Tracks {
    tiles: Tiles,
}

impl Shows for Tracks {
    const KIND: &'static str = "ruts";
}

impl Tracks {
    /// Returns the number of bytes of all tiles.
    pub fn bytes(&self) -> usize {
        self.tiles.bytes()
    }

    /// Returns the centres (m) of all pressed cells with their states, in a fixed order.
    pub fn pressed<'a>(&'a self, grid: &'a RutGrid) -> impl Iterator<Item = ([f64; 2], Rut)> + 'a {
        let pressed = self.tiles.cells().filter(|(_, c)| c[0] > 0.0);
        pressed.map(move |([i, j], c)| ([grid.middle(i), grid.middle(j)], rut(c.map(f64::from))))
    }
}

/// Converts the numbers of a cell, or a mean of several cells, to a state.
fn rut([sinkage, pressure, depth]: [f64; 3]) -> Rut {
    let rebound = sinkage - depth;
    let stiffness = if rebound > 0.0 { pressure / rebound } else { 0.0 };
    Rut { sinkage, pressure, stiffness }
}

impl RutGrid {
    fn middle(&self, i: i32) -> f64 {
        (f64::from(i) + 0.5) * self.cell
    }

    /// Returns the state of the ground at x, y (m); the default where it was never pressed. It costs one tile lookup, or up to four at the edge of a
    /// tile.
    pub fn at(&self, tracks: &Tracks, x: f64, y: f64) -> Rut {
        rut(self.mean(tracks, x, y))
    }

    fn mean(&self, tracks: &Tracks, x: f64, y: f64) -> [f64; 3] {
        let (gx, gy) = (x / self.cell - 0.5, y / self.cell - 0.5);
        // The negated comparison also treats NaN as ground that was never pressed.
        if !(gx.abs() < 1e9 && gy.abs() < 1e9) {
            return [0.0; 3];
        }
        let (i, j) = (gx.floor() as i32, gy.floor() as i32);
        let (u, v) = (gx - gx.floor(), gy - gy.floor());
        let mut sum = [0.0; 3];
        let mut add = |cell: &Cell, w: f64| {
            for (s, c) in sum.iter_mut().zip(cell) {
                *s += w * f64::from(*c);
            }
        };
        let weights = [(0, 0, (1.0 - u) * (1.0 - v)), (1, 0, u * (1.0 - v))];
        let weights = weights.into_iter().chain([(0, 1, (1.0 - u) * v), (1, 1, u * v)]);
        let (mut last, mut tile) = (None, None);
        for (di, dj, w) in weights {
            let (at, k) = Tiles::split(i + di, j + dj);
            if last != Some(at) {
                (last, tile) = (Some(at), tracks.tiles.tile(at));
            }
            if let Some(cells) = tile {
                add(&cells[k], w);
            }
        }
        sum
    }

    /// Returns the weighted mean state at several points (x, y in m); the weights must sum to 1.
    pub fn mean_at(&self, tracks: &Tracks, points: impl Iterator<Item = ([f64; 2], f64)>) -> Rut {
        let mut sum = [0.0; 3];
        for ([x, y], w) in points {
            for (s, m) in sum.iter_mut().zip(self.mean(tracks, x, y)) {
                *s += w * m;
            }
        }
        rut(sum)
    }

    /// Updates the ground with a print.
    pub fn press(&self, tracks: &mut Tracks, print: &Print) {
        let (r, half, depth) = (print.print_radius, 0.5 * print.print_width, print.sinkage);
        // The negated comparison also ignores NaN.
        if !(depth > 0.0 && print.print_normal.z > 0.0) {
            return;
        }
        let fall = (r - depth).max(0.0);
        let reach = (r * r - fall * fall).sqrt();
        let around = reach.hypot(half);
        let p = &print.contact_point;
        let [x0, y0, x1, y1] = self.region;
        let first = |v: f64, low: f64| ((v - around).max(low) / self.cell - 0.5).ceil() as i32;
        let last = |v: f64, high: f64| ((v + around).min(high) / self.cell - 0.5).floor() as i32;
        let n = &print.print_normal;
        let across = n.cross(&print.print_heading);
        for j in first(p.y, y0)..=last(p.y, y1) {
            for i in first(p.x, x0)..=last(p.x, x1) {
                let (dx, dy) = (self.middle(i) - p.x, self.middle(j) - p.y);
                let q = Vec3::new(dx, dy, -(n.x * dx + n.y * dy) / n.z);
                let (s, t) = (q.dot(&print.print_heading), q.dot(&across));
                if t.abs() > half || s.abs() >= reach {
                    continue;
                }
                let z = depth - r + (r * r - s * s).sqrt();
                self.press_cell(tracks, i, j, z, print);
            }
        }
    }

    fn press_cell(&self, tracks: &mut Tracks, i: i32, j: i32, z: f64, print: &Print) {
        let was = tracks.tiles.get(i, j).copied().unwrap_or_default();
        // Compare in f32, as the values are stored, so that a wheel at rest does not change the
        // cell.
        if z as f32 <= was[0] {
            return;
        }
        let (k_z, n) = (print.print_modulus, print.print_exponent);
        let left = rut(was.map(f64::from)).pressed(z, k_z, n, &self.unloading);
        let cell = [left.sinkage as f32, left.pressure as f32, left.depth() as f32];
        if cell.iter().all(|v| v.is_finite()) {
            *tracks.tiles.get_mut(i, j) = cell;
        }
    }
}

/// Ground for a wheel model: the grid and its stored tracks.
#[derive(Clone, Copy, Debug)]
pub struct Past<'a> {
    /// The cell grid.
    pub grid: &'a RutGrid,
    /// Stored tracks.
    pub tracks: &'a Tracks,
}

/// Soft ground that stores ruts.
pub struct Ruts {
    /// The cells.
    pub grid: RutGrid,
    terrain: Handle<dyn Terrain>,
}

impl Ruts {
    /// Returns the view of this field for wheel models.
    pub fn past<'a>(&'a self, tracks: &'a Tracks) -> Past<'a> {
        Past { grid: &self.grid, tracks }
    }
}

/// Checks that a region has a positive area.
///
/// # Errors
/// The maxima do not exceed the minima, or a number is not finite.
pub(crate) fn check_region(region: [f64; 4]) -> Result<(), BuildError> {
    let [x0, y0, x1, y1] = region;
    if x1 > x0 && y1 > y0 && region.iter().all(|v| v.is_finite()) {
        return Ok(());
    }
    Err(BuildError::new(format!("the region {region:?} is empty"))
        .at("region")
        .help("write (x_min, y_min, x_max, y_max) in metres, with maxima greater than minima"))
}

/// Soft ground that stores the deepest compaction of each cell. Wheels of `mobility.wheel_soil` read the state of the last sample and press the
/// ground at each sample. Choose a rate at which a wheel moves less than half of its contact length per sample.
#[field("mobility.ruts")]
impl Field for Ruts {
    type Params = RutsParams;
    type Data = Tracks;
    type Imprint = Print;
    fn build(p: RutsParams) -> Result<Self, BuildError> {
        let region = p.region.unwrap_or_else(|| p.terrain.bounds());
        check_region(region)?;
        let unloading = Unloading { k0: p.stiffness, growth: p.stiffness_growth };
        Ok(Ruts { grid: RutGrid { cell: p.cell, region, unloading }, terrain: p.terrain })
    }
    fn start(&self) -> Tracks {
        Tracks::default()
    }
    fn update(&self, _: &Clock, tracks: &mut Tracks, prints: &[Print], _: &[f64]) {
        prints.iter().for_each(|print| self.grid.press(tracks, print));
    }
    fn overlay(&self, tracks: &Tracks) -> Option<SharedOverlay> {
        let terrain = self.terrain.clone();
        // Depths are measured along the normal.
        let change = move |cell: &Cell, [x, y]: [f64; 2]| {
            let ground = if cell[2] == 0.0 { None } else { terrain.ground(x, y) };
            ground.map_or(0.0, |g| -cell[2] / g.normal.z as f32)
        };
        let (tiles, cell) = (tracks.tiles.clone(), self.grid.cell);
        Some(Arc::new(Changed { tiles, cell, middle: 0.5, change: Box::new(change) }))
    }
}

#[cfg(test)]
#[path = "ruts_tests.rs"]
mod tests;
