//! Overlay of ruts and heaps for viewers and logs.
use crate::tiles::Tiles;
use linkwork_runtime::prelude::*;
use std::any::Any;

/// Function that returns the height of the ground in a cell above the terrain service (m), from the cell and the position x, y of its middle (m, W).
pub(crate) type Change<C> = dyn Fn(&C, [f64; 2]) -> f32 + Send + Sync;

/// Snapshot of deformed ground at one instant. It shares the tiles that have not changed since then.
pub(crate) struct Changed<C, const EDGE: usize> {
    /// The cells.
    pub tiles: Tiles<C, EDGE>,
    /// Edge of a cell, m.
    pub cell: f64,
    /// Middle of the cell 0, 0, in cells.
    pub middle: f64,
    /// Function that returns the height change of a cell.
    pub change: Box<Change<C>>,
}

impl<C: Copy + Default, const EDGE: usize> Changed<C, EDGE> {
    fn values(&self, at: [i32; 2], cells: &[C]) -> OverlayValues {
        let [x, y] = at.map(|v| f64::from(v) * EDGE as f64 + self.middle);
        let middle =
            |k: usize| [(x + (k % EDGE) as f64) * self.cell, (y + (k / EDGE) as f64) * self.cell];
        let change = |(k, cell): (usize, &C)| (self.change)(cell, middle(k));
        OverlayValues::Change(cells.iter().enumerate().map(change).collect())
    }
}

impl<C: Copy + Default + Send + Sync + 'static, const EDGE: usize> Overlay for Changed<C, EDGE> {
    fn tiles(&self, before: Option<&dyn Overlay>) -> Vec<OverlayTile> {
        let before = before.and_then(|b| (b as &dyn Any).downcast_ref::<Self>());
        let tile = |(at, now, then): ([i32; 2], &[C], Option<&[C]>)| {
            let seen = self.values(at, now);
            let news = match then {
                Some(then) => seen != self.values(at, then),
                None => !seen.blank(),
            };
            let corner = at.map(|v| (f64::from(v) * EDGE as f64 + self.middle - 0.5) * self.cell);
            news.then_some(OverlayTile { corner, cell: self.cell, columns: EDGE, seen })
        };
        self.tiles.differing(before.map(|b| &b.tiles)).filter_map(tile).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn shown(tiles: Tiles<f32, 4>) -> Changed<f32, 4> {
        // The content of a cell depends on its place: cells of 0.5 m have their centres at whole multiples of 0.5 m.
        let change = |cell: &f32, [x, y]: [f64; 2]| cell * (1.0 + x + 10.0 * y) as f32;
        Changed { tiles, cell: 0.5, middle: 0.0, change: Box::new(change) }
    }

    #[test]
    fn it_tells_the_tiles_that_have_changed_and_no_others() {
        let mut tiles = Tiles::<f32, 4>::default();
        *tiles.get_mut(1, 2) = 1.0;
        *tiles.get_mut(-1, 0) = 2.0;
        // This tile was written but contains no change.
        *tiles.get_mut(40, 40) = 0.0;
        let first = shown(tiles.clone());
        let all = first.tiles(None);
        let corners: Vec<[f64; 2]> = all.iter().map(|t| t.corner).collect();
        assert_eq!(corners, [[-2.25, -0.25], [-0.25, -0.25]]);
        let OverlayValues::Change(values) = &all[1].seen else { panic!("{all:?}") };
        // The centre of cell (1, 2) is at (0.5, 1).
        assert_eq!((values[2 * 4 + 1], values.len(), all[1].columns), (11.5, 16, 4));
        assert_eq!(values.iter().filter(|v| **v != 0.0).count(), 1);
        // The second call reports no changes. A tile that is written with its old content is a copy, but it is
        // not reported either.
        assert_eq!(shown(tiles.clone()).tiles(Some(&first)), []);
        *tiles.get_mut(1, 2) = 1.0;
        assert_eq!(shown(tiles.clone()).tiles(Some(&first)), []);
        // Removed cells are reported, too.
        *tiles.get_mut(-1, 0) = 0.0;
        let news = shown(tiles).tiles(Some(&first));
        assert_eq!((news.len(), news[0].corner), (1, [-2.25, -0.25]));
        assert!(news[0].seen.blank());
    }
}
