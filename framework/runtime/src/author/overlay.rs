//! Ground overlays of parts: height changes, colours draped over the ground, planned paths.
//!
//! Viewers and logs request overlays about once a second ([`OVERLAY_PERIOD`]). A part returns an [`Overlay`]: a copy that shares memory with the
//! part's own data. The consumer computes the changed tiles in its own thread. Without a log and a viewer there are no requests and no cost. A
//! request does not affect the part.
use crate::author::time::Seconds;
use std::any::Any;
use std::sync::Arc;

/// Period of the requests by viewers and logs.
pub const OVERLAY_PERIOD: Seconds = Seconds { num: 1, den: 1 };

/// Ground overlay of a part at one instant (`fn overlay` of a [`Model`](crate::Model) or [`Field`](crate::Field)).
pub trait Overlay: Any + Send + Sync {
    /// Returns the tiles that differ from `before`, an earlier overlay of the same part, or all tiles with content without one. A tile replaces an
    /// earlier one with the same corner; all tiles of a part have the same size.
    fn tiles(&self, before: Option<&dyn Overlay>) -> Vec<OverlayTile>;
    /// Returns the planned path: x and y of its vertices (m, W); empty for no path.
    fn way(&self) -> &[[f64; 2]] {
        &[]
    }
}

impl std::fmt::Debug for dyn Overlay {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str("Overlay")
    }
}

/// Shared overlay.
pub type SharedOverlay = Arc<dyn Overlay>;

/// A grid of squares on the ground, each with a value.
#[derive(Clone, Debug, PartialEq)]
pub struct OverlayTile {
    /// Minimum x and y of the first square (m, W).
    pub corner: [f64; 2],
    /// Edge of a square (m).
    pub cell: f64,
    /// Number of squares along x.
    pub columns: usize,
    /// Values, row by row along x.
    pub seen: OverlayValues,
}

/// Values of the squares of a tile.
#[derive(Clone, Debug, PartialEq)]
pub enum OverlayValues {
    /// Height change relative to the terrain, at the centre of each square (m); linear between centres.
    Change(Vec<f32>),
    /// Red, green, blue and opacity, 0 (transparent) to 255.
    Colors(Vec<[u8; 4]>),
}

impl OverlayValues {
    /// Returns the number of values.
    #[must_use]
    pub fn len(&self) -> usize {
        match self {
            OverlayValues::Change(values) => values.len(),
            OverlayValues::Colors(values) => values.len(),
        }
    }

    /// Returns whether there are no values.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Returns whether all values are without effect.
    #[must_use]
    pub fn blank(&self) -> bool {
        match self {
            OverlayValues::Change(values) => values.iter().all(|v| *v == 0.0),
            OverlayValues::Colors(values) => values.iter().all(|c| c[3] == 0),
        }
    }
}

/// Changes of overlays since the last query.
#[derive(Default)]
pub struct OverlayNews {
    before: Option<SharedOverlay>,
    way: Vec<[f64; 2]>,
}

impl OverlayNews {
    /// Returns the tiles that changed since the last call, and the path if it changed.
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
