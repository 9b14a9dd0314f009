//! The ground of a scene: terrains, and overlays that parts show on them.
use crate::layers::{Bounds, Layers, News};
use crate::pictures::Sent;
use crate::shapes::entity;
use crate::terrain::Tiles;
use linkwork_runtime::{OverlayNews, OverlayTile, Program, SharedOverlay};
use linkwork_surroundings::Surface;
use re_sdk::EntityPath;
use re_sdk_types::archetypes::LineStrips3D;
use re_sdk_types::components::{Color, Radius};
use std::collections::BTreeSet;

/// Distance from the followed body within which the ground is drawn at full resolution (m).
const NEAR: f64 = 4.0;
/// Height of a planned path over the ground (m).
const OVER: f64 = 0.06;
/// Longest straight piece of a path, so that it follows the ground (m).
const PIECE: f64 = 0.25;

/// Terrains and their overlays.
#[derive(Default)]
pub(crate) struct Ground {
    terrain: Vec<(EntityPath, Tiles)>,
    layers: Layers,
    /// The latest overlay of each part that shows something on the ground.
    news: Vec<(String, OverlayNews)>,
    /// Tiles whose shape, or whose colours, must be drawn again: terrain and tile.
    shapes: BTreeSet<(usize, usize)>,
    colors: BTreeSet<(usize, usize)>,
    ways: Vec<Sent>,
}

/// Returns the paths of the parts, in all phases, that show something on the ground.
pub(crate) fn overlays(program: &Program) -> Vec<String> {
    let all: BTreeSet<&str> = program.phases.iter().flat_map(|p| p.plan.overlays()).collect();
    all.into_iter().map(String::from).collect()
}

impl Ground {
    /// Creates the ground of these terrains, each with its colour at the middle height, and the overlays of these parts.
    pub fn new(
        terrain: Vec<(EntityPath, Surface)>,
        middle: Option<[u8; 4]>,
        overlays: Vec<String>,
    ) -> Ground {
        let draped = !overlays.is_empty();
        let tiles = |(path, surface)| Some((path, Tiles::new(surface, middle, draped)?));
        let terrain = terrain.into_iter().filter_map(tiles).collect();
        let news = overlays.into_iter().map(|part| (part, OverlayNews::default())).collect();
        Ground { terrain, news, ..Ground::default() }
    }

    /// Returns all tiles in coarse resolution.
    pub fn coarse(&self) -> Vec<Sent> {
        let of = |(path, tiles): &(EntityPath, Tiles)| -> Vec<Sent> {
            let sent = |(k, mesh)| -> Sent { (tile(path, k), Box::new(mesh)) };
            tiles.coarse().into_iter().map(sent).collect()
        };
        self.terrain.iter().flat_map(of).collect()
    }

    /// Returns the tiles around x, y (m) that change to full resolution.
    pub fn approach(&mut self, x: f64, y: f64) -> Vec<Sent> {
        let mut out: Vec<Sent> = Vec::new();
        for (path, tiles) in &mut self.terrain {
            for (k, mesh) in tiles.approach(x, y, NEAR, &self.layers) {
                out.push((tile(path, k), Box::new(mesh)));
            }
        }
        out
    }

    /// Updates the overlays of the parts.
    pub fn show(&mut self, shown: &[Option<SharedOverlay>]) {
        for k in 0..self.news.len().min(shown.len()) {
            let Some(now) = &shown[k] else { continue };
            let (part, news) = &mut self.news[k];
            let (tiles, way) = news.of(now);
            let (part, way) = (part.clone(), way.map(<[[f64; 2]]>::to_vec));
            tiles.into_iter().for_each(|tile| self.lay(&part, tile));
            if let Some(corners) = way {
                self.way(&part, &corners);
            }
        }
    }

    /// Stores a tile that a part shows.
    pub fn lay(&mut self, part: &str, tile: OverlayTile) {
        let (bounds, wanted): (Bounds, &mut BTreeSet<_>) = match self.layers.take(part, tile) {
            News::Shape(bounds) => (bounds, &mut self.shapes),
            News::Colors(bounds) => (bounds, &mut self.colors),
        };
        for (n, (_, tiles)) in self.terrain.iter().enumerate() {
            wanted.extend(tiles.between(bounds).into_iter().map(|k| (n, k)));
        }
    }

    /// Stores the path that a part plans.
    pub fn way(&mut self, part: &str, corners: &[[f64; 2]]) {
        let mut points = Vec::new();
        for pair in corners.windows(2) {
            let [a, b] = [pair[0], pair[1]];
            let pieces = ((a[0] - b[0]).hypot(a[1] - b[1]) / PIECE).ceil().clamp(1.0, 1e4) as usize;
            let first = usize::from(!points.is_empty());
            for k in first..=pieces {
                let share = k as f64 / pieces as f64;
                let [x, y] = [0, 1].map(|k| a[k] + share * (b[k] - a[k]));
                points.push([x as f32, y as f32, (self.height(x, y) + OVER) as f32]);
            }
        }
        let strips = if points.is_empty() { Vec::new() } else { vec![points] };
        let line = LineStrips3D::new(strips)
            .with_colors([Color::from_rgb(40, 200, 255)])
            .with_radii([Radius::new_ui_points(2.5)]);
        self.ways.push((entity(&format!("ways/{part}")), Box::new(line)));
    }

    /// Returns the present height of the ground (m).
    fn height(&self, x: f64, y: f64) -> f64 {
        let height = self.terrain.iter().find_map(|(_, tiles)| tiles.height(x, y));
        height.unwrap_or(0.0) + self.layers.change(x, y)
    }

    /// Returns what has changed since the last call.
    pub fn changes(&mut self) -> Vec<Sent> {
        let mut out: Vec<Sent> = Vec::new();
        for (n, k) in std::mem::take(&mut self.shapes) {
            let (path, tiles) = &mut self.terrain[n];
            if let Some(mesh) = tiles.fine(k, &self.layers) {
                out.push((tile(path, k), Box::new(mesh)));
            }
        }
        for (n, k) in std::mem::take(&mut self.colors) {
            let (path, tiles) = &self.terrain[n];
            if let Some(texture) = tiles.texture(k, &self.layers) {
                out.push((tile(path, k), Box::new(texture)));
            }
        }
        out.append(&mut self.ways);
        out
    }
}

/// Returns how far below the ellipsoid, and within which distance of the origin of W, the sphere of the planet is lowered (m), so that it stays below
/// the ground that is shown.
pub(crate) fn room<'a>(surfaces: impl Iterator<Item = &'a Surface>) -> (f64, f64) {
    surfaces.fold((0.0_f64, 0.0_f64), |(sink, clear), surface| {
        (sink.max(0.1 - f64::from(lowest(surface))), clear.max(farthest(surface)))
    })
}

/// Returns the lowest height of a surface (m), if it has any data.
fn lowest(surface: &Surface) -> f32 {
    surface.heights.iter().copied().filter(|h| h.is_finite()).fold(0.0, f32::min)
}

/// Returns the distance of its farthest corner from the origin of W (m).
fn farthest(surface: &Surface) -> f64 {
    let reach = |k: usize, n: usize| {
        let end = surface.origin[k] + surface.spacing[k] * (n.saturating_sub(1)) as f64;
        surface.origin[k].abs().max(end.abs())
    };
    reach(0, surface.nx).hypot(reach(1, surface.ny))
}

/// Returns the entity of a tile.
fn tile(terrain: &EntityPath, k: usize) -> EntityPath {
    terrain.join(&format!("tile{k}").into())
}
