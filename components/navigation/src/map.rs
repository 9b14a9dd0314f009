//! Map of the observed ground: each cell stores the moments of its points.
//! ```text
//! new point p          n' = n + 1,  δ = p − m,  m' = m + δ/n',  S' = S + δ (p − m')ᵀ        S = Σ (p_k − m)(p_k − m)ᵀ
//! ```
//! Welford, "Note on a method for calculating corrected sums of squares and products", Technometrics 4, 1962. Moments are about the mean of the cell,
//! and horizontal positions are relative to the centre of the cell, so that precision is not lost far from the origin. The order of the points
//! affects the sums at round-off level.
//!
//! A cell that was not observed for longer than `memory` is reset at its next observation, so that points from a drifted pose estimate are not mixed
//! with old ones. Memory use grows with the observed area: 104 bytes a cell, 0.1 MB a tile of 32 by 32 cells.

use crate::tiles::{Index, Tiles, Touched, cell_at, middle_of, split};
use linkwork_spatial::Vec3;
use serde::{Deserialize, Serialize};

/// Parameters of the map.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Grid {
    /// Edge of a cell, m.
    pub cell: f64,
    /// Time after which an unobserved cell is reset at its next observation, s; ∞: never.
    pub memory: f64,
}

/// Moments of the points of one cell.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(from = "[f64; 13]", into = "[f64; 13]")]
pub struct Cell {
    /// Number of points.
    pub count: f64,
    /// Mean of the points, m: x and y from the centre of the cell, z in W.
    pub mean: Vec3,
    /// Sums of products of deviations from the mean: xx, xy, yy, xz, yz, zz, m².
    pub spread: [f64; 6],
    /// Least height, m.
    pub low: f64,
    /// Greatest height, m.
    pub high: f64,
    /// Time of the last observation, s.
    pub seen: f64,
}

impl From<[f64; 13]> for Cell {
    fn from(v: [f64; 13]) -> Self {
        let [count, x, y, z, a, b, c, d, e, f, low, high, seen] = v;
        Cell { count, mean: Vec3::new(x, y, z), spread: [a, b, c, d, e, f], low, high, seen }
    }
}

impl From<Cell> for [f64; 13] {
    fn from(v: Cell) -> Self {
        let ([a, b, c, d, e, f], m) = (v.spread, v.mean);
        [v.count, m.x, m.y, m.z, a, b, c, d, e, f, v.low, v.high, v.seen]
    }
}

impl Cell {
    fn add(&mut self, p: Vec3, time: f64, memory: f64) {
        if self.count == 0.0 || time - self.seen > memory {
            *self = Cell { low: p.z, high: p.z, ..Cell::default() };
        }
        self.seen = time;
        self.count += 1.0;
        let before = p - self.mean;
        self.mean += before / self.count;
        let after = p - self.mean;
        let products = [
            before.x * after.x,
            before.x * after.y,
            before.y * after.y,
            before.x * after.z,
            before.y * after.z,
            before.z * after.z,
        ];
        self.spread.iter_mut().zip(products).for_each(|(s, p)| *s += p);
        self.low = if p.z < self.low { p.z } else { self.low };
        self.high = if p.z > self.high { p.z } else { self.high };
    }
}

/// All observed ground.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct TerrainMap {
    /// The cells.
    pub cells: Tiles<Cell>,
    /// First observed height, m: heights are summed relative to it.
    pub base: Option<f64>,
}

impl Grid {
    /// Adds points (m, W) that were observed at `time` (s). Returns the changed cells and the number of rejected points (not finite, or farther away
    /// than a billion cells).
    pub fn add(&self, map: &mut TerrainMap, points: &[Vec3], time: f64) -> (Touched, usize) {
        let (mut touched, mut lost) = (Touched::default(), 0);
        let mut rest = points;
        while let Some(first) = rest.first() {
            let Some((tile, _)) = self.place(first) else {
                (lost, rest) = (lost + 1, &rest[1..]);
                continue;
            };
            map.base.get_or_insert(first.z);
            // Neighbouring pixels mostly fall into one tile, so the tile is kept between points.
            let cells = map.cells.tile_mut(tile);
            let mut used = 0;
            for p in rest {
                let Some((at, place)) = self.place(p).filter(|(at, _)| *at == tile) else { break };
                let index = crate::tiles::join(at, place);
                let [x, y] = middle_of(self.cell, index);
                let from_middle = Vec3::new(p.x - x, p.y - y, p.z);
                cells[place].add(from_middle, time, self.memory);
                touched.add(index);
                used += 1;
            }
            rest = &rest[used..];
        }
        (touched, lost)
    }

    fn place(&self, p: &Vec3) -> Option<(Index, usize)> {
        cell_at(self.cell, [p.x, p.y]).filter(|_| p.z.is_finite()).map(split)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const GRID: Grid = Grid { cell: 0.1, memory: f64::INFINITY };

    /// Points in −3 … 3 m without a pattern, a long way up.
    fn cloud(n: u32, seed: u32) -> Vec<Vec3> {
        let at = |k: u32, a: u32| {
            f64::from(k.wrapping_mul(a).wrapping_add(seed.wrapping_mul(40_503)) % 10_007) / 10_007.0
        };
        (0..n)
            .map(|k| {
                let (x, y) = (6.0 * at(k, 7919) - 3.0, 6.0 * at(k, 104_729) - 3.0);
                Vec3::new(x, y, 1000.0 + 0.2 * x - 0.1 * y + 0.05 * at(k, 1_299_709))
            })
            .collect()
    }

    fn near(a: &Cell, b: &Cell, tolerance: f64) -> bool {
        let (a, b): ([f64; 13], [f64; 13]) = ((*a).into(), (*b).into());
        a.iter().zip(b).all(|(a, b)| (a - b).abs() <= tolerance)
    }

    #[test]
    fn moments_are_those_of_the_points() {
        let points = cloud(20_000, 1);
        let mut map = TerrainMap::default();
        let (touched, lost) = GRID.add(&mut map, &points, 3.0);
        assert_eq!(lost, 0);
        let mut total = 0.0;
        for (at, cells) in map.cells.iter() {
            for (place, cell) in cells.iter().enumerate().filter(|(_, c)| c.count > 0.0) {
                let index = crate::tiles::join(at, place);
                let [x, y] = middle_of(GRID.cell, index);
                let here: Vec<_> = points
                    .iter()
                    .filter(|p| cell_at(GRID.cell, [p.x, p.y]) == Some(index))
                    .map(|p| Vec3::new(p.x - x, p.y - y, p.z))
                    .collect();
                let n = here.len() as f64;
                // The reference takes two passes: first the mean, then the moments about it.
                let mean = here.iter().sum::<Vec3>() / n;
                let sum = |f: &dyn Fn(Vec3) -> f64| here.iter().map(|p| f(p - mean)).sum::<f64>();
                let spread = [
                    sum(&|d| d.x * d.x),
                    sum(&|d| d.x * d.y),
                    sum(&|d| d.y * d.y),
                    sum(&|d| d.x * d.z),
                    sum(&|d| d.y * d.z),
                    sum(&|d| d.z * d.z),
                ];
                let low = here.iter().map(|p| p.z).min_by(f64::total_cmp).unwrap();
                let high = here.iter().map(|p| p.z).max_by(f64::total_cmp).unwrap();
                let want = Cell { count: n, mean, spread, low, high, seen: 3.0 };
                // Heights of 1000 m have a rounding error of 1e-13 m, so squares near 1e-3 m² keep
                // eleven digits.
                assert!(near(cell, &want, 1e-11), "{cell:?} {want:?}");
                total += cell.count;
            }
        }
        assert_eq!(total, 20_000.0);
        let [i0, j0, i1, j1] = touched
            .rectangles()
            .reduce(|a, b| [a[0].min(b[0]), a[1].min(b[1]), a[2].max(b[2]), a[3].max(b[3])])
            .unwrap();
        assert!([i0, j0] == [-30, -30] && [i1, j1] == [29, 29]);
    }

    #[test]
    fn batches_of_one_order_leave_no_trace_and_other_orders_only_rounding() {
        let points = cloud(5000, 2);
        let (mut whole, mut parts, mut back) =
            (TerrainMap::default(), TerrainMap::default(), TerrainMap::default());
        GRID.add(&mut whole, &points, 1.0);
        for part in points.chunks(371) {
            GRID.add(&mut parts, part, 1.0);
        }
        assert_eq!(whole, parts);
        let reversed: Vec<_> = points.iter().rev().copied().collect();
        GRID.add(&mut back, &reversed, 1.0);
        for (at, cells) in whole.cells.iter() {
            let other = back.cells.tile(at).unwrap();
            assert!(cells.iter().zip(other).all(|(a, b)| near(a, b, 1e-11)));
        }
    }

    #[test]
    fn old_cells_begin_anew_and_others_do_not() {
        let grid = Grid { memory: 10.0, ..GRID };
        let mut map = TerrainMap::default();
        let (a, b) = (Vec3::new(0.05, 0.05, 1.0), Vec3::new(5.05, 0.05, 1.0));
        grid.add(&mut map, &[a, b], 0.0);
        grid.add(&mut map, &[a], 9.0);
        grid.add(&mut map, &[a, b + Vec3::z()], 15.0);
        let (a, b) = (map.cells.get([0, 0]).unwrap(), map.cells.get([50, 0]).unwrap());
        assert_eq!((a.count, a.low, a.high), (3.0, 1.0, 1.0));
        assert_eq!((b.count, b.low, b.high, b.mean.z), (1.0, 2.0, 2.0, 2.0));
    }

    #[test]
    fn what_has_no_place_is_counted_and_changes_nothing() {
        let mut map = TerrainMap::default();
        let bad = [
            Vec3::new(f64::NAN, 0.0, 0.0),
            Vec3::new(0.0, f64::INFINITY, 0.0),
            Vec3::new(0.0, 0.0, f64::NAN),
            Vec3::new(1e12, 0.0, 0.0),
        ];
        let (touched, lost) = GRID.add(&mut map, &bad, 0.0);
        assert!(touched.is_empty() && lost == 4 && map == TerrainMap::default());
    }

    #[test]
    fn a_map_is_saved_bit_for_bit() {
        let mut map = TerrainMap::default();
        GRID.add(&mut map, &cloud(3000, 5), 2.5);
        let bytes = rmp_serde::to_vec_named(&map).unwrap();
        assert_eq!(rmp_serde::from_slice::<TerrainMap>(&bytes).unwrap(), map);
    }
}
