//! Cells of the horizontal plane in tiles that are created when they are first written, so that memory grows with the written area.
//!
//! A copy shares the tiles that do not change, so the cost of forks and checkpoints in memory is proportional to the differences.

use serde::de::DeserializeOwned;
use serde::{Deserialize, Deserializer, Serialize, Serializer};
use std::collections::BTreeMap;
use std::sync::Arc;

/// The written cells of a plane, in tiles of `EDGE` by `EDGE`.
#[derive(Clone, Debug, PartialEq)]
pub struct Tiles<C, const EDGE: usize> {
    tiles: BTreeMap<[i32; 2], Arc<Vec<C>>>,
}

impl<C, const EDGE: usize> Default for Tiles<C, EDGE> {
    fn default() -> Self {
        Tiles { tiles: BTreeMap::new() }
    }
}

/// A part of one tile that a box of cells covers.
#[derive(Clone, Copy, Debug)]
pub struct Part {
    /// The tile.
    pub tile: [i32; 2],
    /// First and last column and row.
    pub from: [i32; 2],
    /// Likewise.
    pub to: [i32; 2],
}

impl<C: Copy + Default, const EDGE: usize> Tiles<C, EDGE> {
    const EDGE_I: i32 = EDGE as i32;

    /// Returns the tile of a cell, and its index there.
    #[inline(always)]
    pub fn split(i: i32, j: i32) -> ([i32; 2], usize) {
        let e = Self::EDGE_I;
        ([i.div_euclid(e), j.div_euclid(e)], Self::place(i, j))
    }

    /// Returns the index of a cell in its tile.
    #[inline(always)]
    pub fn place(i: i32, j: i32) -> usize {
        let e = Self::EDGE_I;
        (j.rem_euclid(e) * e + i.rem_euclid(e)) as usize
    }

    /// Returns the parts of tiles that a box of cells covers, including its ends.
    pub fn parts(from: [i32; 2], to: [i32; 2]) -> impl Iterator<Item = Part> {
        let e = Self::EDGE_I;
        let ([x0, y0], [x1, y1]) = (from.map(|v| v.div_euclid(e)), to.map(|v| v.div_euclid(e)));
        (y0..=y1).flat_map(move |y| (x0..=x1).map(move |x| [x, y])).map(move |tile| Part {
            tile,
            from: [0, 1].map(|k| from[k].max(tile[k] * e)),
            to: [0, 1].map(|k| to[k].min(tile[k] * e + e - 1)),
        })
    }

    /// Returns the cells of a tile, row by row; `None` if it was never written. O(log tiles).
    #[inline]
    pub fn tile(&self, at: [i32; 2]) -> Option<&[C]> {
        self.tiles.get(&at).map(|cells| cells.as_slice())
    }

    /// Returns the cells of a tile for writing; creates them if the tile does not exist, and copies them if a fork shares them.
    pub fn tile_mut(&mut self, at: [i32; 2]) -> &mut [C] {
        let new = || Arc::new(vec![C::default(); EDGE * EDGE]);
        let tile: &mut Arc<Vec<C>> = self.tiles.entry(at).or_insert_with(new);
        Arc::make_mut(tile).as_mut_slice()
    }

    /// Returns a cell; `None` if its tile was never written.
    pub fn get(&self, i: i32, j: i32) -> Option<&C> {
        let (at, k) = Self::split(i, j);
        self.tile(at).map(|cells| &cells[k])
    }

    /// A cell to write to.
    pub fn get_mut(&mut self, i: i32, j: i32) -> &mut C {
        let (at, k) = Self::split(i, j);
        &mut self.tile_mut(at)[k]
    }

    /// Returns all cells of all tiles with their columns and rows, in a fixed order.
    pub fn cells(&self) -> impl Iterator<Item = ([i32; 2], &C)> {
        self.tiles.iter().flat_map(|(at, cells)| {
            let [i, j] = at.map(|v| v * Self::EDGE_I);
            cells
                .iter()
                .enumerate()
                .map(move |(k, c)| ([i + (k % EDGE) as i32, j + (k / EDGE) as i32], c))
        })
    }

    /// Returns the tiles that differ in memory from those of an earlier copy, with their present and earlier cells.
    pub fn differing<'a>(
        &'a self,
        before: Option<&'a Self>,
    ) -> impl Iterator<Item = ([i32; 2], &'a [C], Option<&'a [C]>)> {
        self.tiles.iter().filter_map(move |(at, now)| {
            let then = before.and_then(|b| b.tiles.get(at));
            let same = then.is_some_and(|then| Arc::ptr_eq(now, then));
            (!same).then(|| (*at, now.as_slice(), then.map(|t| t.as_slice())))
        })
    }

    /// Returns whether all tiles are shared in memory.
    pub fn shares_with(&self, other: &Self) -> bool {
        let mut pairs = self.tiles.iter().zip(&other.tiles);
        self.tiles.len() == other.tiles.len()
            && pairs.all(|((a, one), (b, two))| a == b && Arc::ptr_eq(one, two))
    }

    /// Bytes of all tiles.
    pub fn bytes(&self) -> usize {
        self.tiles.len() * EDGE * EDGE * size_of::<C>()
    }
}

impl<C: Serialize, const EDGE: usize> Serialize for Tiles<C, EDGE> {
    fn serialize<S: Serializer>(&self, s: S) -> Result<S::Ok, S::Error> {
        s.collect_seq(self.tiles.iter().map(|(at, cells)| (at, &**cells)))
    }
}

impl<'de, C: DeserializeOwned, const EDGE: usize> Deserialize<'de> for Tiles<C, EDGE> {
    fn deserialize<D: Deserializer<'de>>(d: D) -> Result<Self, D::Error> {
        let tiles: Vec<([i32; 2], Vec<C>)> = Vec::deserialize(d)?;
        if let Some((at, cells)) = tiles.iter().find(|(_, cells)| cells.len() != EDGE * EDGE) {
            let (n, wanted) = (cells.len(), EDGE * EDGE);
            let fact = format!("a tile of ground at {at:?} has {n} cells, not {wanted}");
            return Err(serde::de::Error::custom(fact));
        }
        Ok(Tiles { tiles: tiles.into_iter().map(|(at, cells)| (at, Arc::new(cells))).collect() })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parts_of_a_box_are_each_of_its_cells_once() {
        type T = Tiles<u8, 4>;
        let mut tiles = T::default();
        for part in T::parts([-5, -2], [6, 3]) {
            let cells = tiles.tile_mut(part.tile);
            for j in part.from[1]..=part.to[1] {
                for i in part.from[0]..=part.to[0] {
                    cells[T::place(i, j)] += 1;
                }
            }
        }
        for ([i, j], c) in tiles.cells() {
            let inside = (-5..=6).contains(&i) && (-2..=3).contains(&j);
            assert_eq!(*c, u8::from(inside), "{i} {j}");
            assert_eq!(tiles.get(i, j), Some(c));
        }
        assert_eq!(tiles.bytes(), 4 * 2 * 16);
        assert_eq!(tiles.get(100, 0), None);
    }
}
