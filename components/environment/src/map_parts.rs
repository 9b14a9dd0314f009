//! Cropped maps and mosaics of maps, read row by row.

use crate::map_file::OpenMap;
use crate::tiles::{HeightRows, TileError};
use linkwork_collision::relief::Lattice;
use linkwork_runtime::prelude::*;

/// Greatest offset of nodes of two maps that count as common, in node spacings.
const ASIDE: f64 = 0.01;

/// Rectangular part of a map.
#[derive(Debug)]
pub struct Cropped {
    map: OpenMap,
    grid: Lattice,
    /// First column and row.
    first: [usize; 2],
    row: Vec<f32>,
}

impl Cropped {
    /// Selects the nodes of a map within x_min, y_min, x_max, y_max (m).
    ///
    /// # Errors
    /// The limits are out of order or contain fewer than two nodes along an axis.
    pub fn new(map: OpenMap, within: [f64; 4]) -> Result<Cropped, BuildError> {
        let (old, [x0, y0, x1, y1]) = (map.grid(), within);
        let (size, origin, spacing) = (old.size(), old.origin(), old.spacing());
        let mut ends = [[0, 0]; 2];
        for (k, (low, high)) in [(x0, x1), (y0, y1)].into_iter().enumerate() {
            // The tolerance includes a node at a limit in spite of round-off.
            let at = |p: f64| (p - origin[k]) / spacing[k];
            let first = (at(low) - 1e-6).ceil().max(0.0);
            let last = (at(high) + 1e-6).floor().min(size[k] as f64 - 1.0);
            if !(last - first >= 1.0) {
                let axis = ["x", "y"][k];
                let end = origin[k] + (size[k] as f64 - 1.0) * spacing[k];
                let fact =
                    format!("the map has fewer than two nodes from {axis} = {low} to {high} m");
                return Err(BuildError::new(fact)
                    .help(format!("the map extends from {axis} = {} to {end} m", origin[k])));
            }
            ends[k] = [first as usize, last as usize];
        }
        let count = |k: usize| ends[k][1] - ends[k][0] + 1;
        let corner = [0, 1].map(|k| origin[k] + ends[k][0] as f64 * spacing[k]);
        let grid =
            Lattice::new(corner, spacing, count(0), count(1)).map_err(|e| BuildError::of(&e))?;
        let row = vec![0.0; size[0]];
        Ok(Cropped { map, grid, first: [ends[0][0], ends[1][0]], row })
    }
}

impl HeightRows for Cropped {
    fn grid(&self) -> Lattice {
        self.grid
    }

    fn datum(&self) -> f64 {
        self.map.datum()
    }

    fn row(&mut self, j: usize, row: &mut [f32]) -> Result<(), TileError> {
        self.map.row(self.first[1] + j, &mut self.row)?;
        row.copy_from_slice(&self.row[self.first[0]..][..row.len()]);
        Ok(())
    }
}

/// Map of a mosaic, with its first column and row in the mosaic.
#[derive(Debug)]
struct Piece {
    map: OpenMap,
    first: [usize; 2],
}

/// Several maps with common nodes as one map; where they overlap, the last map with data is used.
#[derive(Debug)]
pub struct Mosaic {
    pieces: Vec<Piece>,
    grid: Lattice,
    row: Vec<f32>,
}

impl Mosaic {
    /// Combines maps; each has a name for messages.
    ///
    /// # Errors
    /// The spacing or the position of a map's nodes differs from the first map.
    pub fn new(maps: Vec<(String, OpenMap)>) -> Result<Mosaic, BuildError> {
        let Some((first_name, first)) = maps.first() else {
            return Err(BuildError::new("the list of maps is empty").help("name at least two maps"));
        };
        let (spacing, origin, first_name) =
            (first.grid().spacing(), first.grid().origin(), first_name.clone());
        let (mut low, mut high) = ([i64::MAX; 2], [i64::MIN; 2]);
        let mut places = Vec::new();
        for (name, map) in &maps {
            let grid = map.grid();
            let mut place = [0; 2];
            for k in 0..2 {
                let apart = (grid.spacing()[k] / spacing[k] - 1.0).abs() * grid.size()[k] as f64;
                let at = (grid.origin()[k] - origin[k]) / spacing[k];
                if apart > ASIDE || !((at - at.round()).abs() <= ASIDE) || at.abs() > 1e9 {
                    let fact = format!("`{name}` and `{first_name}` have different nodes");
                    return Err(BuildError::new(fact).help("resample one of them to the nodes of the other: `linkwork terrain resample`, or `gdalwarp -tap -tr`"));
                }
                place[k] = at.round() as i64;
                low[k] = low[k].min(place[k]);
                high[k] = high[k].max(place[k] + grid.size()[k] as i64);
            }
            places.push(place);
        }
        let count = |k: usize| (high[k] - low[k]) as usize;
        let corner = [0, 1].map(|k| origin[k] + low[k] as f64 * spacing[k]);
        let grid =
            Lattice::new(corner, spacing, count(0), count(1)).map_err(|e| BuildError::of(&e))?;
        let widest = maps.iter().map(|(_, map)| map.grid().size()[0]).max().unwrap_or(0);
        let pieces = maps.into_iter().zip(places).map(|((_, map), place)| Piece {
            map,
            first: [0, 1].map(|k| (place[k] - low[k]) as usize),
        });
        Ok(Mosaic { pieces: pieces.collect(), grid, row: vec![0.0; widest] })
    }
}

impl HeightRows for Mosaic {
    fn grid(&self) -> Lattice {
        self.grid
    }

    fn datum(&self) -> f64 {
        self.pieces.first().map_or(0.0, |p| p.map.datum())
    }

    fn row(&mut self, j: usize, row: &mut [f32]) -> Result<(), TileError> {
        let datum = self.datum();
        row.fill(f32::NAN);
        for piece in &mut self.pieces {
            let [nx, ny] = piece.map.grid().size();
            let Some(own) = j.checked_sub(piece.first[1]).filter(|own| *own < ny) else { continue };
            piece.map.row(own, &mut self.row[..nx])?;
            let above = piece.map.datum() - datum;
            for (to, h) in row[piece.first[0]..][..nx].iter_mut().zip(&self.row) {
                if !h.is_nan() {
                    *to = if above == 0.0 { *h } else { (f64::from(*h) + above) as f32 };
                }
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::height_field::HeightField;

    fn map(
        origin: [f64; 2],
        nx: usize,
        ny: usize,
        height: impl Fn(usize, usize) -> f32,
    ) -> OpenMap {
        let heights = (0..nx * ny).map(|k| height(k % nx, k / nx)).collect();
        OpenMap::Whole(HeightField::new(origin, [0.5, 0.25], nx, ny, heights).unwrap())
    }

    fn all(rows: &mut dyn HeightRows) -> Vec<f32> {
        let [nx, ny] = rows.grid().size();
        let mut heights = vec![0.0; nx * ny];
        for (j, row) in heights.chunks_exact_mut(nx).enumerate() {
            rows.row(j, row).unwrap();
        }
        heights
    }

    #[test]
    fn a_part_has_the_nodes_within_its_limits() {
        let whole = || map([10.0, -1.0], 6, 5, |i, j| (10 * j + i) as f32);
        let mut part = Cropped::new(whole(), [10.6, -0.75, 12.0, 5.0]).unwrap();
        assert_eq!((part.grid().origin(), part.grid().size()), ([11.0, -0.75], [3, 4]));
        assert_eq!(all(&mut part)[..6], [12.0, 13.0, 14.0, 22.0, 23.0, 24.0]);
        for limits in [
            [12.4, -1.0, 12.6, 0.0],
            [20.0, -1.0, 30.0, 0.0],
            [12.0, -1.0, 10.0, 0.0],
            [f64::NAN, 0.0, 1.0, 1.0],
        ] {
            let told = Cropped::new(whole(), limits).unwrap_err();
            assert!(told.message.contains("fewer than two nodes"), "{}", told.message);
        }
    }

    #[test]
    fn maps_with_common_nodes_are_one_map_and_the_last_counts() {
        let west = map([0.0, 0.0], 3, 3, |_, _| 1.0);
        let north_east = map([1.0, 0.25], 3, 3, |i, _| if i == 1 { f32::NAN } else { 2.0 });
        let mut both =
            Mosaic::new(vec![("west".into(), west), ("east".into(), north_east)]).unwrap();
        assert_eq!((both.grid().origin(), both.grid().size()), ([0.0, 0.0], [5, 4]));
        let n = f32::NAN;
        let wanted =
            [1.0, 1.0, 1.0, n, n, 1.0, 1.0, 2.0, n, 2.0, 1.0, 1.0, 2.0, n, 2.0, n, n, 2.0, n, 2.0];
        let got = all(&mut both);
        assert!(
            got.iter().zip(wanted).all(|(a, b)| *a == b || a.is_nan() && b.is_nan()),
            "{got:?}"
        );
    }

    #[test]
    fn maps_with_other_nodes_are_refused() {
        let aside = map([1.2, 0.25], 3, 3, |_, _| 2.0);
        let told =
            Mosaic::new(vec![("a".into(), map([0.0; 2], 3, 3, |_, _| 1.0)), ("b".into(), aside)])
                .unwrap_err();
        assert!(
            told.message.contains("`b` and `a` have different nodes")
                && told.help.unwrap().contains("resample")
        );
        assert!(Mosaic::new(vec![]).is_err());
    }
}
