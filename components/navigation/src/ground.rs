//! Ground for planning: the terrain assessment combined with keep-out and free discs of the operators.
//! ```text
//! keep-out     discs that no part of it may come into          hazards, grown by the radius that it is judged with
//! free         discs that are known to be free                 unknown ground in them counts as best
//! ```

use crate::assess::{BEST, Patch};
use crate::tiles::{Index, Tiles, cell_at, middle_of};

/// A disc: x, y, radius, m.
pub type Disc = [f64; 3];

/// Assessment of a place.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Sight {
    /// Too little was seen.
    Unknown,
    /// Goodness, 0 (a hazard) to 255.
    Known(u8),
}

/// Terrain assessment and discs of the operators.
#[derive(Clone, Copy, Debug)]
pub struct Ground<'a> {
    /// Edge of a cell, m.
    pub cell: f64,
    /// Assessed patches.
    pub patches: &'a Tiles<Patch>,
    /// Discs that are not to be entered.
    pub keep_out: &'a [Disc],
    /// Discs that are known to be free.
    pub free: &'a [Disc],
    /// Margin of keep-out discs, m: the radius of the disc of the terrain assessment.
    pub radius: f64,
}

fn within(discs: &[Disc], [x, y]: [f64; 2], more: f64) -> bool {
    discs.iter().any(|[cx, cy, r]| (x - cx).hypot(y - cy) <= r + more)
}

impl Ground<'_> {
    /// Returns the assessment of a rover's disc at x, y (m). Places that are none are hazards.
    #[must_use]
    pub fn at(&self, p: [f64; 2]) -> Sight {
        match cell_at(self.cell, p) {
            Some(cell) => self.seen(cell, p),
            None => Sight::Known(0),
        }
    }

    /// Returns the assessment at the centre of a cell.
    #[must_use]
    pub fn of_cell(&self, cell: Index) -> Sight {
        self.seen(cell, middle_of(self.cell, cell))
    }

    fn seen(&self, cell: Index, p: [f64; 2]) -> Sight {
        if within(self.keep_out, p, self.radius) {
            return Sight::Known(0);
        }
        match self.patches.get(cell) {
            Some(patch) if patch.known => Sight::Known(patch.goodness),
            _ if within(self.free, p, 0.0) => Sight::Known(BEST),
            _ => Sight::Unknown,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_was_said_goes_with_what_was_seen() {
        let mut patches = Tiles::default();
        patches.tile_mut([0, 0])[5] = Patch { goodness: 90, known: true, ..Patch::default() };
        patches.tile_mut([0, 0])[9] = Patch { goodness: 0, known: true, ..Patch::default() };
        let (keep_out, free) = ([[2.0, 2.0, 0.5]], [[0.8, 0.0, 0.6]]);
        let ground =
            Ground { cell: 0.1, patches: &patches, keep_out: &keep_out, free: &free, radius: 0.3 };
        assert_eq!(ground.at([0.55, 0.05]), Sight::Known(90));
        // Observed hazards count inside free discs, too; unobserved ground is free only there.
        assert_eq!(ground.of_cell([9, 0]), Sight::Known(0));
        assert_eq!(
            (ground.at([0.75, 0.05]), ground.at([1.5, 0.05])),
            (Sight::Known(BEST), Sight::Unknown)
        );
        assert_eq!(
            (ground.at([2.75, 2.0]), ground.at([2.85, 2.0])),
            (Sight::Known(0), Sight::Unknown)
        );
        assert_eq!(ground.at([f64::NAN, 0.0]), Sight::Known(0));
    }
}
