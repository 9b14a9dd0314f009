//! Overlays of parts on the ground: height differences from the terrain, and colours.
use linkwork_runtime::{OverlayTile, OverlayValues};
use std::collections::BTreeMap;

/// Index of a tile among those of its part.
type Place = [i64; 2];

/// The overlays of all parts.
#[derive(Default)]
pub struct Layers {
    parts: BTreeMap<String, Layer>,
}

/// The overlay of a part, by tile.
struct Layer {
    /// Edge of a square (m).
    cell: f64,
    /// Number of squares of a tile along x and y.
    size: [usize; 2],
    /// Smallest x and y of the square 0, 0 (m).
    origin: [f64; 2],
    changes: BTreeMap<Place, Vec<f32>>,
    colors: BTreeMap<Place, Vec<[u8; 4]>>,
}

/// Smallest x and y, largest x and y (m).
pub type Bounds = [f64; 4];

/// The parts that must be drawn again.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum News {
    /// The shape of the ground.
    Shape(Bounds),
    /// The colours of the ground.
    Colors(Bounds),
}

impl Layers {
    /// Stores a tile in place of an earlier one.
    pub fn take(&mut self, part: &str, tile: OverlayTile) -> News {
        let size = [tile.columns, tile.seen.len() / tile.columns];
        let cell = tile.cell;
        let along = |k: usize| size[k] as f64 * cell;
        let index = |k: usize| (tile.corner[k] / along(k)).round();
        let new = || Layer {
            cell,
            size,
            origin: [0, 1].map(|k| tile.corner[k] - index(k) * along(k)),
            changes: BTreeMap::new(),
            colors: BTreeMap::new(),
        };
        let layer = self.parts.entry(part.into()).or_insert_with(new);
        if (layer.cell, layer.size) != (cell, size) {
            *layer = new();
        }
        let place = [0, 1].map(|k| ((tile.corner[k] - layer.origin[k]) / along(k)).round() as i64);
        // Heights are interpolated between the centres of squares, so a square also affects its neighbours.
        let [x, y] = tile.corner;
        let bounds = [x - cell, y - cell, x + along(0) + cell, y + along(1) + cell];
        match tile.seen {
            OverlayValues::Change(values) => {
                layer.changes.insert(place, values);
                News::Shape(bounds)
            }
            OverlayValues::Colors(colors) => {
                layer.colors.insert(place, colors);
                News::Colors(bounds)
            }
        }
    }

    /// Returns the height difference of the ground at x, y (m).
    pub fn change(&self, x: f64, y: f64) -> f64 {
        self.parts.values().map(|layer| layer.change(x, y)).sum()
    }

    /// Returns whether the ground is changed anywhere within these bounds (m).
    pub fn changed(&self, bounds: Bounds) -> bool {
        self.parts.values().any(|layer| layer.changed(bounds))
    }

    /// Returns the edge of the smallest squares that change the height (m).
    pub fn pitch(&self) -> Option<f64> {
        let changing = self.parts.values().filter(|layer| !layer.changes.is_empty());
        changing.map(|layer| layer.cell).min_by(f64::total_cmp)
    }

    /// Returns the edge of the smallest squares with colours (m).
    pub fn grain(&self) -> Option<f64> {
        let colored = self.parts.values().filter(|layer| !layer.colors.is_empty());
        colored.map(|layer| layer.cell).min_by(f64::total_cmp)
    }

    /// Returns the colour by which the ground's colour is multiplied at x, y (m); white does not change it.
    pub fn tint(&self, x: f64, y: f64) -> [u8; 3] {
        let seen = self.parts.values().filter_map(|layer| layer.color(x, y)).find(|c| c[3] > 0);
        let Some([r, g, b, a]) = seen else { return [255; 3] };
        let share = f32::from(a) / 255.0;
        [r, g, b].map(|c| (255.0 + share * (f32::from(c) - 255.0)).round() as u8)
    }
}

impl Layer {
    /// Returns the tile of a square, and its index there.
    fn split(&self, [i, j]: [i64; 2]) -> (Place, usize) {
        let [nx, ny] = self.size.map(|n| n as i64);
        ([i.div_euclid(nx), j.div_euclid(ny)], (j.rem_euclid(ny) * nx + i.rem_euclid(nx)) as usize)
    }

    fn value(&self, square: [i64; 2]) -> f64 {
        let (place, k) = self.split(square);
        self.changes.get(&place).map_or(0.0, |values| f64::from(values[k]))
    }

    fn change(&self, x: f64, y: f64) -> f64 {
        if self.changes.is_empty() {
            return 0.0;
        }
        let at = [x, y];
        let g = [0, 1].map(|k| (at[k] - self.origin[k]) / self.cell - 0.5);
        let [i, j] = g.map(|g| g.floor() as i64);
        let [u, v] = g.map(|g| g - g.floor());
        let row = |j: i64| (1.0 - u) * self.value([i, j]) + u * self.value([i + 1, j]);
        (1.0 - v) * row(j) + v * row(j + 1)
    }

    fn changed(&self, [x0, y0, x1, y1]: Bounds) -> bool {
        if self.changes.is_empty() {
            return false;
        }
        let square = |v: f64, k: usize| (v - self.origin[k]) / self.cell - 0.5;
        let range =
            |a: f64, b: f64, k: usize| square(a, k).floor() as i64..=square(b, k).ceil() as i64;
        let columns = range(x0, x1, 0);
        range(y0, y1, 1).any(|j| columns.clone().any(|i| self.value([i, j]) != 0.0))
    }

    fn color(&self, x: f64, y: f64) -> Option<[u8; 4]> {
        let at = [x, y];
        let (place, k) =
            self.split([0, 1].map(|k| ((at[k] - self.origin[k]) / self.cell).floor() as i64));
        self.colors.get(&place).map(|colors| colors[k])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn tile(corner: [f64; 2], seen: OverlayValues) -> OverlayTile {
        OverlayTile { corner, cell: 0.5, columns: 2, seen }
    }

    #[test]
    fn it_is_linear_between_the_middles_of_squares_and_across_tiles() {
        let mut layers = Layers::default();
        // The nodes are at multiples of 0.5, and the squares around them begin 0.25 before.
        let first = tile([-0.25, -0.25], OverlayValues::Change(vec![0.0, -0.1, 0.0, -0.1]));
        assert_eq!(layers.take("Soil", first), News::Shape([-0.75, -0.75, 1.25, 1.25]));
        layers.take("Soil", tile([0.75, -0.25], OverlayValues::Change(vec![0.3, 0.0, 0.3, 0.0])));
        let near = |x: f64, y: f64, want: f64| {
            let got = layers.change(x, y);
            // Values are in single precision.
            assert!((got - want).abs() < 1e-7, "{x} {y}: {got} for {want}");
        };
        for (x, want) in
            [(0.0, 0.0), (0.25, -0.05), (0.5, -0.1), (0.75, 0.1), (1.0, 0.3), (1.5, 0.0)]
        {
            near(x, 0.0, want);
            near(x, 0.4, want);
            // Within one square of the border, the change decreases to the previous ground.
            near(x, 0.75, 0.5 * want);
            near(x, -7.0, 0.0);
        }
        assert_eq!((layers.pitch(), layers.grain()), (Some(0.5), None));
        assert!(layers.changed([0.6, 0.1, 0.7, 0.2]) && !layers.changed([2.1, 0.0, 3.0, 1.0]));
        // A tile replaces the previous one at its place. A tile of another size replaces all tiles.
        layers.take("Soil", tile([0.75, -0.25], OverlayValues::Change(vec![0.0; 4])));
        assert_eq!(layers.change(1.0, 0.0), 0.0);
        let other =
            OverlayTile { cell: 0.25, ..tile([0.0; 2], OverlayValues::Change(vec![0.0; 4])) };
        layers.take("Soil", other);
        assert_eq!(layers.change(0.5, 0.0), 0.0);
    }

    #[test]
    fn colours_hide_as_much_of_the_ground_as_they_say() {
        let mut layers = Layers::default();
        let colors = vec![[255, 0, 0, 255], [0, 0, 0, 0], [0, 255, 0, 51], [9, 9, 9, 0]];
        let news = layers.take("Map", tile([-1.0, 2.0], OverlayValues::Colors(colors)));
        assert_eq!(news, News::Colors([-1.5, 1.5, 0.5, 3.5]));
        assert_eq!(layers.tint(-0.9, 2.1), [255, 0, 0]);
        assert_eq!(layers.tint(-0.9, 2.6), [204, 255, 204]);
        for (x, y) in [(-0.4, 2.1), (-0.4, 2.9), (-1.1, 2.1), (50.0, 2.1)] {
            assert_eq!(layers.tint(x, y), [255; 3], "{x} {y}");
        }
        assert_eq!(
            (layers.pitch(), layers.grain(), layers.change(-0.9, 2.1)),
            (None, Some(0.5), 0.0)
        );
    }
}
