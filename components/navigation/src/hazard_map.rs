//! Ground overlay of the navigation: goodness of the ground as colours, and the planned path.
//! ```text
//! red       a hazard: the middle of the rover is not to come there
//! yellow to green    the better, the greener
//! clear     not known
//! ```
use crate::assess::{Assessor, BEST, Patch};
use crate::ground::{Disc, Ground, Sight};
use crate::rover::{Knowledge, Memory, Rover};
use crate::tiles::{Index, TILE, Tiles, join};
use linkwork_surroundings::prelude::*;
use std::any::Any;

/// Corners of a way that are shown, at most.
const WAY: usize = 10_000;
/// Opacity of the overlay over the colour of the ground.
const OPACITY: u8 = 190;
/// Colours of hazards, of the worst ground that is none, and of the best.
const HAZARD: [u8; 3] = [235, 55, 45];
const WORST: [f64; 3] = [255.0, 215.0, 60.0];
const BEST_COLOR: [f64; 3] = [80.0, 225.0, 110.0];

/// Snapshot of the map at one instant. It shares the tiles that have not changed since.
pub(crate) struct HazardMap {
    /// Edge of a cell, m.
    pub cell: f64,
    /// Assessed patches.
    pub patches: Tiles<Patch>,
    /// Discs that are not to be entered.
    pub keep_out: Vec<Disc>,
    /// Discs that are known to be free.
    pub free: Vec<Disc>,
    /// Radius that keep-out discs grow by, m.
    pub radius: f64,
    /// The way that is planned, m.
    pub way: Vec<[f64; 2]>,
}

/// The colour of a place.
fn color(sight: Sight) -> [u8; 4] {
    let [r, g, b] = match sight {
        Sight::Unknown => return [0; 4],
        Sight::Known(0) => HAZARD,
        Sight::Known(goodness) => {
            let share = f64::from(goodness) / f64::from(BEST);
            [0, 1, 2].map(|k| (WORST[k] + share * (BEST_COLOR[k] - WORST[k])).round() as u8)
        }
    };
    [r, g, b, OPACITY]
}

impl HazardMap {
    /// Returns the overlay of a rover's map and plan. Cost: the tiles are shared; the path is traversed once.
    pub fn of(rover: &Rover, judge: &Assessor, k: &Knowledge, memory: &Memory) -> Self {
        let planner = k.planner.as_ref().filter(|_| memory.status.goes_on());
        let way = planner.map_or(Vec::new(), |planner| planner.path(memory.from, WAY));
        HazardMap {
            cell: rover.grid.cell,
            patches: k.patches.clone(),
            keep_out: rover.keep_out.clone(),
            free: rover.free.clone(),
            radius: judge.limits().radius,
            way: if way.len() > 1 { way } else { Vec::new() },
        }
    }

    fn colors(&self, at: Index, patches: &Tiles<Patch>) -> OverlayValues {
        let (cell, keep_out, free) = (self.cell, &*self.keep_out, &*self.free);
        let ground = Ground { cell, patches, keep_out, free, radius: self.radius };
        let places = 0..(TILE * TILE) as usize;
        OverlayValues::Colors(places.map(|k| color(ground.of_cell(join(at, k)))).collect())
    }
}

impl Overlay for HazardMap {
    fn tiles(&self, before: Option<&dyn Overlay>) -> Vec<OverlayTile> {
        let before = before.and_then(|b| (b as &dyn Any).downcast_ref::<Self>());
        let tile = |at: Index| {
            let seen = self.colors(at, &self.patches);
            let news = match before.filter(|b| b.patches.tile(at).is_some()) {
                Some(b) => seen != b.colors(at, &b.patches),
                None => !seen.blank(),
            };
            let corner = at.map(|v| f64::from(v * TILE) * self.cell);
            news.then_some(OverlayTile { corner, cell: self.cell, columns: TILE as usize, seen })
        };
        self.patches.differing(before.map(|b| &b.patches)).filter_map(tile).collect()
    }

    fn way(&self) -> &[[f64; 2]] {
        &self.way
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn map(patches: &Tiles<Patch>) -> HazardMap {
        let (keep_out, free) = (vec![[0.55, 0.05, 0.04]], Vec::new());
        HazardMap {
            cell: 0.1,
            patches: patches.clone(),
            keep_out,
            free,
            radius: 0.0,
            way: Vec::new(),
        }
    }

    #[test]
    fn a_hazard_is_red_good_ground_green_and_what_is_not_known_clear() {
        let mut patches = Tiles::<Patch>::default();
        let known = |goodness| Patch { goodness, known: true, ..Patch::default() };
        let cells = patches.tile_mut([-1, 0]);
        (cells[3], cells[4], cells[5]) = (known(0), known(1), known(BEST));
        patches.tile_mut([0, 0])[5] = known(BEST);
        let first = map(&patches);
        let tiles = first.tiles(None);
        assert_eq!(tiles.iter().map(|t| t.corner).collect::<Vec<_>>(), [[-3.2, 0.0], [0.0, 0.0]]);
        let of = |tile: &OverlayTile, k: usize| match &tile.seen {
            OverlayValues::Colors(colors) => colors[k],
            OverlayValues::Change(_) => panic!("{tile:?}"),
        };
        let (hazard, worst, best) = (of(&tiles[0], 3), of(&tiles[0], 4), of(&tiles[0], 5));
        assert_eq!(
            (hazard, worst, best),
            ([235, 55, 45, 190], [254, 215, 60, 190], [80, 225, 110, 190])
        );
        assert_eq!(of(&tiles[0], 6)[3], 0);
        // Ground that the operators forbid is a hazard, however good it is.
        assert_eq!(of(&tiles[1], 5), hazard);
        // Only tiles with changed colours are sent again.
        assert_eq!(map(&patches).tiles(Some(&first)), []);
        patches.tile_mut([-1, 0])[3].tilt = 0.1;
        assert_eq!(map(&patches).tiles(Some(&first)), []);
        patches.tile_mut([-1, 0])[3].goodness = 200;
        let news = map(&patches).tiles(Some(&first));
        assert_eq!((news.len(), news[0].corner), (1, [-3.2, 0.0]));
    }
}
