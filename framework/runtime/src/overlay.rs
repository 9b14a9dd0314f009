//! What parts show on the ground: how they changed it, colours draped over it, a way that they plan.
//!
//! Viewers and logs ask for it about once a second ([`OVERLAY_PERIOD`]). A part answers with an [`Overlay`]: a copy that shares memory
//! with the part's own data. The consumer, in its own thread, makes of it the tiles that are not as they were. Nothing is asked, and
//! nothing costs time, in a run without a log and a viewer; a part does not notice whether it was asked.
use crate::time::Seconds;
use std::any::Any;
use std::sync::Arc;

/// How often viewers and logs ask.
pub const OVERLAY_PERIOD: Seconds = Seconds { num: 1, den: 1 };

/// What a part shows on the ground at one instant (`fn overlay` of a [`Model`](crate::Model) or [`Field`](crate::Field)).
pub trait Overlay: Any + Send + Sync {
    /// The tiles that are not as in `before`, an earlier overlay of the same part; without one all that show anything. A tile takes the
    /// place of an earlier one with the same corner; all tiles of a part have the same size.
    fn tiles(&self, before: Option<&dyn Overlay>) -> Vec<OverlayTile>;
    /// The way that it plans, x and y of its corners (m, W); empty: it plans none.
    fn way(&self) -> &[[f64; 2]] {
        &[]
    }
}

impl std::fmt::Debug for dyn Overlay {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str("Overlay")
    }
}

/// An overlay as it is handed on.
pub type SharedOverlay = Arc<dyn Overlay>;

/// A grid of squares on the ground, each with a value.
#[derive(Clone, Debug, PartialEq)]
pub struct OverlayTile {
    /// Least x and y of the first square (m, W).
    pub corner: [f64; 2],
    /// Edge of a square (m).
    pub cell: f64,
    /// Squares along x.
    pub columns: usize,
    /// What there is to see, rows of x one after the other.
    pub seen: OverlayValues,
}

/// Values of the squares of a tile.
#[derive(Clone, Debug, PartialEq)]
pub enum OverlayValues {
    /// By how much the ground is higher than the terrain says, at the middle of each square (m); linear between.
    Change(Vec<f32>),
    /// Red, green, blue, and how much of the ground's own colour they hide: 0 (all is left) to 255.
    Colors(Vec<[u8; 4]>),
}

impl OverlayValues {
    /// How many there are.
    #[must_use]
    pub fn len(&self) -> usize {
        match self {
            OverlayValues::Change(values) => values.len(),
            OverlayValues::Colors(values) => values.len(),
        }
    }

    /// Whether there are none.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Whether they show nothing.
    #[must_use]
    pub fn blank(&self) -> bool {
        match self {
            OverlayValues::Change(values) => values.iter().all(|v| *v == 0.0),
            OverlayValues::Colors(values) => values.iter().all(|c| c[3] == 0),
        }
    }
}

/// What is new in what parts show, for a consumer that remembers what it has told.
#[derive(Default)]
pub struct OverlayNews {
    before: Option<SharedOverlay>,
    way: Vec<[f64; 2]>,
}

impl OverlayNews {
    /// The tiles that are not as they were when this was asked last, and the way when it is another.
    pub fn of(&mut self, now: &SharedOverlay) -> (Vec<OverlayTile>, Option<&[[f64; 2]]>) {
        let tiles = now.tiles(self.before.as_deref());
        self.before = Some(now.clone());
        let other = self.way != now.way();
        if other {
            self.way = now.way().to_vec();
        }
        (tiles, other.then_some(&self.way))
    }
}
