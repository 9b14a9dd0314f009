//! Squares of cells over the horizontal plane, made when they are first touched.
//!
//! Cell (i, j) covers i c ≤ x < (i + 1) c and j c ≤ y < (j + 1) c, c the edge of a cell. A tile has 32 by 32 cells, rows of x first. A
//! copy shares the tiles that do not change.

use serde::de::DeserializeOwned;
use serde::{Deserialize, Deserializer, Serialize, Serializer};
use std::collections::BTreeMap;
use std::sync::Arc;

/// Cells along the edge of a tile.
pub const TILE: i32 = 32;
/// Cells of a tile.
pub const CELLS: usize = (TILE * TILE) as usize;
/// No index of a cell is larger.
const FARTHEST: f64 = 1e9;

/// A cell or a tile by its indices along x and y.
pub type Index = [i32; 2];

/// Cells of one kind, tile by tile.
#[derive(Clone, Debug, PartialEq)]
pub struct Tiles<T> {
    tiles: BTreeMap<Index, Arc<Vec<T>>>,
}

impl<T> Default for Tiles<T> {
    fn default() -> Self {
        Tiles { tiles: BTreeMap::new() }
    }
}

/// The cell around x, y (m); `None` for what is not finite or too far off to have one.
#[must_use]
pub fn cell_at(edge: f64, [x, y]: [f64; 2]) -> Option<Index> {
    let (i, j) = ((x / edge).floor(), (y / edge).floor());
    // The comparisons are written so that NaN gives no cell.
    (i.abs() < FARTHEST && j.abs() < FARTHEST).then_some([i as i32, j as i32])
}

/// The middle of a cell, m.
#[must_use]
pub fn middle_of(edge: f64, [i, j]: Index) -> [f64; 2] {
    [(f64::from(i) + 0.5) * edge, (f64::from(j) + 0.5) * edge]
}

/// The tile of a cell, and its place in it.
#[must_use]
pub fn split([i, j]: Index) -> (Index, usize) {
    let at = [i.div_euclid(TILE), j.div_euclid(TILE)];
    (at, (j.rem_euclid(TILE) * TILE + i.rem_euclid(TILE)) as usize)
}

/// The cell at a place in a tile.
#[must_use]
pub fn join(at: Index, place: usize) -> Index {
    [at[0] * TILE + place as i32 % TILE, at[1] * TILE + place as i32 / TILE]
}

impl<T: Copy + Default> Tiles<T> {
    /// A cell; `None` where no tile is. Cost: one search of a tile.
    #[must_use]
    pub fn get(&self, cell: Index) -> Option<&T> {
        let (at, place) = split(cell);
        self.tiles.get(&at).map(|tile| &tile[place])
    }

    /// The cells of a tile.
    #[must_use]
    pub fn tile(&self, at: Index) -> Option<&[T]> {
        self.tiles.get(&at).map(|tile| tile.as_slice())
    }

    /// The cells of a tile, to change them: made with defaults when it is not there, copied when another map has it too.
    pub fn tile_mut(&mut self, at: Index) -> &mut [T] {
        let tile = self.tiles.entry(at).or_insert_with(|| Arc::new(vec![T::default(); CELLS]));
        Arc::make_mut(tile).as_mut_slice()
    }

    /// All tiles, in a fixed order.
    pub fn iter(&self) -> impl Iterator<Item = (Index, &[T])> {
        self.tiles.iter().map(|(at, cells)| (*at, cells.as_slice()))
    }

    /// The tiles that are other ones in memory than in an earlier copy.
    pub fn differing<'a>(&'a self, before: Option<&'a Self>) -> impl Iterator<Item = Index> + 'a {
        let same = move |at: &Index, now: &Arc<Vec<T>>| {
            before.and_then(|b| b.tiles.get(at)).is_some_and(|then| Arc::ptr_eq(now, then))
        };
        self.tiles.iter().filter(move |(at, now)| !same(at, now)).map(|(at, _)| *at)
    }

    /// Bytes of all cells.
    #[must_use]
    pub fn bytes(&self) -> usize {
        self.tiles.len() * CELLS * size_of::<T>()
    }
}

impl<T: Serialize> Serialize for Tiles<T> {
    fn serialize<S: Serializer>(&self, s: S) -> Result<S::Ok, S::Error> {
        s.collect_seq(self.tiles.iter().map(|(at, cells)| (at, &**cells)))
    }
}

impl<'de, T: DeserializeOwned> Deserialize<'de> for Tiles<T> {
    fn deserialize<D: Deserializer<'de>>(d: D) -> Result<Self, D::Error> {
        let tiles: Vec<(Index, Vec<T>)> = Vec::deserialize(d)?;
        if let Some((at, cells)) = tiles.iter().find(|(_, cells)| cells.len() != CELLS) {
            let fact = format!("a tile at {at:?} has {} cells, not {CELLS}", cells.len());
            return Err(serde::de::Error::custom(fact));
        }
        Ok(Tiles { tiles: tiles.into_iter().map(|(at, cells)| (at, Arc::new(cells))).collect() })
    }
}

/// Which cells were touched: for each tile the least and greatest indices along x and y, both included.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Touched(BTreeMap<Index, [i32; 4]>);

impl Touched {
    /// Adds a cell.
    pub fn add(&mut self, [i, j]: Index) {
        let (at, _) = split([i, j]);
        let r = self.0.entry(at).or_insert([i, j, i, j]);
        *r = [r[0].min(i), r[1].min(j), r[2].max(i), r[3].max(j)];
    }

    /// The rectangles, tile by tile: least i, j, greatest i, j.
    pub fn rectangles(&self) -> impl Iterator<Item = [i32; 4]> + '_ {
        self.0.values().copied()
    }

    /// Returns whether nothing was touched.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cells_and_tiles_go_on_below_zero() {
        for cell in [[0, 0], [31, 31], [32, -1], [-32, -33], [-1, 95], [1_000_000, -999_999]] {
            let (at, place) = split(cell);
            assert_eq!(join(at, place), cell);
            let middle = middle_of(0.1, cell);
            assert_eq!(cell_at(0.1, middle), Some(cell));
        }
        assert_eq!(split([-1, -1]), ([-1, -1], CELLS - 1));
        for p in [[f64::NAN, 0.0], [0.0, f64::INFINITY], [1e12, 0.0]] {
            assert_eq!(cell_at(0.1, p), None, "{p:?}");
        }
    }

    #[test]
    fn a_copy_shares_what_does_not_change() {
        let mut a = Tiles::<u8>::default();
        a.tile_mut([0, 0])[3] = 7;
        a.tile_mut([5, -2])[0] = 9;
        let b = a.clone();
        a.tile_mut([0, 0])[3] = 8;
        assert_eq!((a.get([3, 0]), b.get([3, 0])), (Some(&8), Some(&7)));
        let same = |at: Index| std::ptr::eq(a.tile(at).unwrap(), b.tile(at).unwrap());
        assert!(same([5, -2]) && !same([0, 0]));
        assert_eq!(a.get([100, 100]), None);
        assert_eq!(a.bytes(), 2 * CELLS);
    }

    #[test]
    fn a_tile_of_the_wrong_size_is_refused() {
        let bytes = rmp_serde::to_vec(&vec![([0, 0], vec![1u8; 7])]).unwrap();
        let fault = rmp_serde::from_slice::<Tiles<u8>>(&bytes).unwrap_err().to_string();
        assert!(fault.contains("7 cells, not 1024"), "{fault}");
    }
}
