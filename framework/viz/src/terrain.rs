//! The ground as tiles: coarse everywhere, at full resolution near the machine, finer where it was changed.
use crate::layers::{Bounds, Layers};
use linkwork_surroundings::Surface;
use re_sdk_types::archetypes::Mesh3D;
use re_sdk_types::components::{ImageBuffer, ImageFormat};

/// Edge of a tile (m), without overlays and with overlays. Tiles with overlays are smaller because they are sent repeatedly.
const TILE: [f64; 2] = [5.0, 2.5];
/// Number of tiles along an edge of the map if they have at most `NODES` nodes along their edges, and largest number.
const FEW: f64 = 16.0;
const NODES: f64 = 128.0;
const MOST: f64 = 60.0;
/// Approximate largest number of nodes of the coarse mesh along an edge of the map.
const SEEN: usize = 720;
/// Smallest distance of nodes of the coarse mesh (m).
const COARSE: f64 = 0.5;
/// Largest number of subdivisions of a grid cell that was changed.
const FINEST: f64 = 32.0;
/// Largest number of pixels along the edge of a texture.
const TEXELS: f64 = 256.0;
/// Fraction of a tile by which its texture extends beyond the tile, because textures wrap around at their edges.
const MARGIN: f64 = 1.0 / 16.0;
/// Relative darkening of compressed soil, and its depth (m).
const PRESSED: f32 = 0.2;
const PRESSED_AT: f32 = 0.01;

/// Tiles of a surface.
pub struct Tiles {
    surface: Surface,
    /// Number of nodes per tile along x and y.
    per: [usize; 2],
    /// Number of tiles along x and y.
    count: [usize; 2],
    fine: Vec<bool>,
    range: (f32, f32),
    stride: [usize; 2],
    colors: Colors,
    /// Whether it has overlays.
    draped: bool,
}

/// Colours of the ground at its lowest and highest points: red, green, blue.
type Colors = [[f32; 3]; 2];

/// The colours of Mars.
const REDDISH: Colors = [[150.0, 92.0, 62.0], [214.0, 150.0, 108.0]];

/// Computes the colours from that at the middle height.
fn colors(middle: Option<[u8; 4]>) -> Colors {
    let Some([r, g, b, _]) = middle else { return REDDISH };
    [0.8, 1.2].map(|share| [r, g, b].map(|c| share * f32::from(c)))
}

impl Tiles {
    /// Creates the tiles of a surface with at least 2 × 2 nodes, in its colour at the middle height. `draped`: it has overlays.
    pub fn new(surface: Surface, middle: Option<[u8; 4]>, draped: bool) -> Option<Tiles> {
        if surface.nx < 2 || surface.ny < 2 {
            return None;
        }
        // Viewers are slow with thousands of meshes, so tiles are large, within the limit of nodes. Tiles that are sent repeatedly stay small.
        let cells = [surface.nx - 1, surface.ny - 1];
        let per = [0, 1].map(|k| {
            let all = cells[k] as f64;
            let least = TILE[usize::from(draped)] / surface.spacing[k];
            let few = if draped { 0.0 } else { (all / FEW).min(NODES) };
            let nodes = least.max(few).max(all / MOST).round() as usize;
            nodes.clamp(1, cells[k])
        });
        let count = [0, 1].map(|k| cells[k].div_ceil(per[k]));
        let stride = [0, 1].map(|k| {
            let want = (COARSE / surface.spacing[k]).round().max(1.0) as usize;
            want.max(cells[k] / SEEN).min(per[k])
        });
        let range = surface
            .heights
            .iter()
            .filter(|h| h.is_finite())
            .fold((f32::INFINITY, f32::NEG_INFINITY), |(l, h), v| (l.min(*v), h.max(*v)));
        let fine = vec![false; count[0] * count[1]];
        let colors = colors(middle);
        Some(Tiles { surface, per, count, fine, range, stride, colors, draped })
    }

    /// Returns all tiles in coarse resolution.
    pub fn coarse(&self) -> Vec<(usize, Mesh3D)> {
        let none = Layers::default();
        let mesh = |k: usize| Some((k, self.mesh(k, self.stride, &none)?));
        (0..self.fine.len()).filter_map(mesh).collect()
    }

    /// Returns the tiles near a point that are not shown at full resolution yet.
    pub fn approach(
        &mut self,
        x: f64,
        y: f64,
        radius: f64,
        layers: &Layers,
    ) -> Vec<(usize, Mesh3D)> {
        let near = self.between([x - radius, y - radius, x + radius, y + radius]);
        let new: Vec<usize> = near.into_iter().filter(|k| !self.fine[*k]).collect();
        new.into_iter().filter_map(|k| Some((k, self.fine(k, layers)?))).collect()
    }

    fn nodes(&self, axis: usize, tile: usize, stride: usize) -> Vec<usize> {
        let n = if axis == 0 { self.surface.nx } else { self.surface.ny };
        let (a, b) = (tile * self.per[axis], ((tile + 1) * self.per[axis]).min(n - 1));
        let mut v: Vec<usize> = (a..b).step_by(stride).collect();
        v.push(b);
        v
    }

    /// Returns the tiles that overlap these bounds (m).
    pub fn between(&self, [x0, y0, x1, y1]: Bounds) -> Vec<usize> {
        let s = &self.surface;
        let range = |k: usize, a: f64, b: f64| {
            let tile = |v: f64| (v - s.origin[k]) / (s.spacing[k] * self.per[k] as f64);
            let (a, b) = (tile(a).floor(), tile(b).floor());
            let last = self.count[k] as f64 - 1.0;
            // These comparisons are false for NaN, so it does not match any tile.
            let some = b >= 0.0 && a <= last;
            let ends = some.then(|| (a.max(0.0) as usize, b.min(last) as usize));
            ends.map_or(0..0, |(a, b)| a..b + 1)
        };
        let columns = range(0, x0, x1);
        let row = |j: usize| columns.clone().map(move |i| j * self.count[0] + i);
        range(1, y0, y1).flat_map(row).collect()
    }

    /// Returns a tile at full resolution.
    pub fn fine(&mut self, k: usize, layers: &Layers) -> Option<Mesh3D> {
        self.fine[k] = true;
        self.mesh(k, [1, 1], layers)
    }

    /// Returns the height (m) at x, y (m); `None` outside the map and where there are no data.
    pub fn height(&self, x: f64, y: f64) -> Option<f64> {
        let s = &self.surface;
        let g = [(x - s.origin[0]) / s.spacing[0], (y - s.origin[1]) / s.spacing[1]];
        let last = [s.nx - 1, s.ny - 1];
        let inside = (0..2).all(|k| g[k] >= 0.0 && g[k] <= last[k] as f64);
        let at = [0, 1].map(|k| (g[k].floor() as usize).min(last[k] - 1));
        let [u, v] = [0, 1].map(|k| g[k] - at[k] as f64);
        let z = inside.then(|| self.cell(at).map(f64::from)).map(|c| bilinear(c, u, v))?;
        z.is_finite().then_some(z)
    }

    /// Returns the heights at the corners of a cell: smallest x and y, then larger x, then larger y, then both.
    fn cell(&self, [i, j]: [usize; 2]) -> [f32; 4] {
        let h = |i: usize, j: usize| self.surface.heights[j * self.surface.nx + i];
        [h(i, j), h(i + 1, j), h(i, j + 1), h(i + 1, j + 1)]
    }

    /// Returns ∂h/∂x and ∂h/∂y at a node.
    fn slopes(&self, i: usize, j: usize) -> [f32; 2] {
        let s = &self.surface;
        let h = |i: usize, j: usize| s.heights[j * s.nx + i];
        let (il, ir) = (i.saturating_sub(1), (i + 1).min(s.nx - 1));
        let (jl, jr) = (j.saturating_sub(1), (j + 1).min(s.ny - 1));
        [
            (h(ir, j) - h(il, j)) / ((ir - il) as f32 * s.spacing[0] as f32),
            (h(i, jr) - h(i, jl)) / ((jr - jl) as f32 * s.spacing[1] as f32),
        ]
    }

    fn place(&self, i: f64, j: f64) -> [f64; 2] {
        let s = &self.surface;
        [s.origin[0] + i * s.spacing[0], s.origin[1] + j * s.spacing[1]]
    }

    /// Returns the smallest x and y and the largest x and y of a tile (m).
    fn bounds(&self, k: usize) -> Bounds {
        let end = |axis: usize, tile: usize| {
            let nodes = self.nodes(axis, tile, self.per[axis]);
            (nodes[0] as f64, nodes[nodes.len() - 1] as f64)
        };
        let ((i0, i1), (j0, j1)) = (end(0, k % self.count[0]), end(1, k / self.count[0]));
        let ([x0, y0], [x1, y1]) = (self.place(i0, j0), self.place(i1, j1));
        [x0, y0, x1, y1]
    }

    /// Returns the overlay colours of a tile, as a texture that multiplies the colours of its mesh.
    pub fn texture(&self, k: usize, layers: &Layers) -> Option<Mesh3D> {
        let grain = layers.grain()?;
        let [x0, y0, x1, y1] = framed(self.bounds(k));
        let count = |length: f64| (length / grain).round().clamp(1.0, TEXELS) as usize;
        let (w, h) = (count(x1 - x0), count(y1 - y0));
        let middle = |k: usize, n: usize, a: f64, b: f64| a + (k as f64 + 0.5) / n as f64 * (b - a);
        let texel = |k: usize| layers.tint(middle(k % w, w, x0, x1), middle(k / w, h, y0, y1));
        let bytes: Vec<u8> = (0..w * h).flat_map(texel).collect();
        let format = ImageFormat::rgb8([w as u32, h as u32]);
        Some(Mesh3D::update_fields().with_albedo_texture(format, ImageBuffer(bytes.into())))
    }

    fn mesh(&self, k: usize, stride: [usize; 2], layers: &Layers) -> Option<Mesh3D> {
        self.soup(k, stride, layers).mesh(self.draped)
    }

    fn soup(&self, k: usize, stride: [usize; 2], layers: &Layers) -> Soup<'_> {
        let (ti, tj) = (k % self.count[0], k / self.count[0]);
        let (xs, ys) = (self.nodes(0, ti, stride[0]), self.nodes(1, tj, stride[1]));
        let s = &self.surface;
        let mut soup = Soup::new(self, k);
        for &j in &ys {
            for &i in &xs {
                let [x, y] = self.place(i as f64, j as f64);
                let z = s.heights[j * s.nx + i];
                soup.add(
                    [x, y],
                    if z.is_finite() { z } else { self.range.0 },
                    self.slopes(i, j),
                    0.0,
                );
            }
        }
        let w = xs.len() as u32;
        for j in 0..ys.len() - 1 {
            for i in 0..xs.len() - 1 {
                let corner = |a: usize, b: usize| s.heights[ys[j + b] * s.nx + xs[i + a]];
                let all = [corner(0, 0), corner(1, 0), corner(0, 1), corner(1, 1)];
                if !all.iter().all(|h| h.is_finite()) {
                    continue;
                }
                let from = self.place(xs[i] as f64, ys[j] as f64);
                let to = self.place(xs[i + 1] as f64, ys[j + 1] as f64);
                if stride == [1, 1] && layers.changed([from[0], from[1], to[0], to[1]]) {
                    self.refine([xs[i], ys[j]], layers, &mut soup);
                } else {
                    soup.square(j as u32 * w + i as u32, w);
                }
            }
        }
        soup
    }

    /// Adds a changed grid cell, subdivided into small cells. Its edges match the neighbouring cells, because a neighbour that is drawn as a whole
    /// has an unchanged edge.
    fn refine(&self, [i, j]: [usize; 2], layers: &Layers, soup: &mut Soup<'_>) {
        let pitch = layers.pitch().unwrap_or(f64::INFINITY);
        let count = |k: usize| (self.surface.spacing[k] / pitch).ceil().clamp(1.0, FINEST) as usize;
        let (nx, ny) = (count(0), count(1));
        let heights = self.cell([i, j]).map(f64::from);
        let corners = [(i, j), (i + 1, j), (i, j + 1), (i + 1, j + 1)];
        let slopes = corners.map(|(i, j)| self.slopes(i, j).map(f64::from));
        let first = soup.points.len() as u32;
        for b in 0..=ny {
            for a in 0..=nx {
                let (u, v) = (a as f64 / nx as f64, b as f64 / ny as f64);
                let [x, y] = self.place(i as f64 + u, j as f64 + v);
                let change = layers.change(x, y);
                let rise = |dx: f64, dy: f64| {
                    (layers.change(x + dx, y + dy) - layers.change(x - dx, y - dy)) / (2.0 * pitch)
                };
                let more = [rise(pitch, 0.0), rise(0.0, pitch)];
                let slope = [0, 1].map(|k| (bilinear(slopes.map(|s| s[k]), u, v) + more[k]) as f32);
                soup.add([x, y], (bilinear(heights, u, v) + change) as f32, slope, change as f32);
            }
        }
        for b in 0..ny as u32 {
            for a in 0..nx as u32 {
                soup.square(first + b * (nx as u32 + 1) + a, nx as u32 + 1);
            }
        }
    }
}

/// Returns the bounds of a tile's texture.
fn framed([x0, y0, x1, y1]: Bounds) -> Bounds {
    let (x, y) = (MARGIN * (x1 - x0), MARGIN * (y1 - y0));
    [x0 - x, y0 - y, x1 + x, y1 + y]
}

/// Interpolates between the corners of a cell: u along x, v along y, 0 to 1.
fn bilinear([a, b, c, d]: [f64; 4], u: f64, v: f64) -> f64 {
    (1.0 - v) * ((1.0 - u) * a + u * b) + v * ((1.0 - u) * c + u * d)
}

/// Vertices and triangles of a tile.
struct Soup<'a> {
    tiles: &'a Tiles,
    /// Bounds of its texture.
    frame: Bounds,
    points: Vec<[f32; 3]>,
    normals: Vec<[f32; 3]>,
    colors: Vec<[u8; 3]>,
    texcoords: Vec<[f32; 2]>,
    triangles: Vec<[u32; 3]>,
}

impl<'a> Soup<'a> {
    fn new(tiles: &'a Tiles, k: usize) -> Self {
        Soup {
            tiles,
            frame: framed(tiles.bounds(k)),
            points: Vec::new(),
            normals: Vec::new(),
            colors: Vec::new(),
            texcoords: Vec::new(),
            triangles: Vec::new(),
        }
    }

    /// Adds a vertex of ground with gradient gx, gy whose height was changed by `change`.
    fn add(&mut self, [x, y]: [f64; 2], z: f32, [gx, gy]: [f32; 2], change: f32) {
        let n = (1.0 + gx * gx + gy * gy).sqrt();
        let normal = [-gx / n, -gy / n, 1.0 / n];
        let color = shade(&self.tiles.colors, z, self.tiles.range, normal);
        // Compressed soil is darker.
        let dark = 1.0 - PRESSED * (-change / PRESSED_AT).clamp(0.0, 1.0);
        let [x0, y0, x1, y1] = self.frame;
        self.points.push([x as f32, y as f32, z]);
        self.normals.push(normal);
        self.colors.push(color.map(|c| (f32::from(c) * dark) as u8));
        self.texcoords.push([((x - x0) / (x1 - x0)) as f32, ((y - y0) / (y1 - y0)) as f32]);
    }

    /// Adds two triangles, from the vertex at their smallest x and y in rows of `w` vertices.
    fn square(&mut self, p: u32, w: u32) {
        self.triangles.push([p, p + 1, p + w + 1]);
        self.triangles.push([p, p + w + 1, p + w]);
    }

    fn mesh(self, draped: bool) -> Option<Mesh3D> {
        if self.triangles.is_empty() {
            return None;
        }
        let mesh = Mesh3D::new(self.points)
            .with_triangle_indices(self.triangles)
            .with_vertex_normals(self.normals)
            .with_vertex_colors(self.colors);
        Some(if draped { mesh.with_vertex_texcoords(self.texcoords) } else { mesh })
    }
}

/// Returns a colour that is lighter at larger heights, shaded by a low sun from the north-west.
fn shade([low, high]: &Colors, z: f32, range: (f32, f32), n: [f32; 3]) -> [u8; 3] {
    let t = ((z - range.0) / (range.1 - range.0).max(1e-3)).clamp(0.0, 1.0);
    let light = (0.62 * n[2] - 0.55 * n[0] + 0.55 * n[1]).clamp(0.0, 1.0) * 0.75 + 0.3;
    [0, 1, 2].map(|k| ((low[k] + (high[k] - low[k]) * t) * light).clamp(0.0, 255.0) as u8)
}

#[cfg(test)]
mod tests {
    use super::*;
    use linkwork_runtime::{OverlayTile, OverlayValues};
    use re_sdk::Loggable as _;

    /// A slope of 9 by 7 nodes, 0.5 m by 0.4 m apart, with a hole.
    fn slope(draped: bool) -> Tiles {
        let (nx, ny, origin, spacing) = (9, 7, [-2.0, 1.0], [0.5, 0.4]);
        let height = |k: usize| 0.3 * (k % nx) as f32 - 0.1 * (k / nx) as f32;
        let mut heights: Vec<f32> = (0..nx * ny).map(height).collect();
        heights[0] = f32::NAN;
        Tiles::new(Surface { origin, spacing, nx, ny, heights }, None, draped).unwrap()
    }

    /// A dent of one square in tiles of 4 by 4, around (0.2, 2.6).
    fn dent() -> Layers {
        let mut layers = Layers::default();
        let mut values = vec![0.0; 16];
        values[5] = -0.05;
        let seen = OverlayValues::Change(values);
        layers.take("Soil", OverlayTile { corner: [0.05, 2.45], cell: 0.1, columns: 4, seen });
        layers
    }

    #[test]
    fn ground_that_was_changed_is_drawn_fine_and_without_gaps() {
        let tiles = slope(true);
        let (layers, mut area, mut lowest) = (dent(), 0.0, f64::INFINITY);
        let mut vertices = 0;
        for k in 0..tiles.fine.len() {
            let soup = tiles.soup(k, [1, 1], &layers);
            vertices += soup.points.len();
            for triangle in &soup.triangles {
                let [a, b, c] = triangle.map(|v| soup.points[v as usize].map(f64::from));
                let twice = (b[0] - a[0]) * (c[1] - a[1]) - (c[0] - a[0]) * (b[1] - a[1]);
                assert!(twice > 0.0, "{a:?} {b:?} {c:?}");
                area += 0.5 * twice;
            }
            for triangle in soup.triangles.iter().flatten() {
                let [x, y, z] = soup.points[*triangle as usize].map(f64::from);
                let plane = 0.6 * (x + 2.0) - 0.25 * (y - 1.0);
                let change = layers.change(x, y);
                assert!((z - plane - change).abs() < 1e-6, "{x} {y} {z} {plane} {change}");
                lowest = lowest.min(z - plane);
            }
        }
        // The triangles cover each position once, except for the cell of the hole.
        assert!((area - (4.0 * 2.4 - 0.2)).abs() < 1e-5, "{area}");
        // A vertex is within a tenth of a metre of the deepest point, and the sides are steeper than the slope.
        assert!((-0.0500001..-0.03).contains(&lowest), "{lowest}");
        let before: usize = (0..tiles.fine.len())
            .map(|k| tiles.soup(k, [1, 1], &Layers::default()).points.len())
            .sum();
        assert!(vertices > before + 20, "{vertices} {before}");
        let normals = |layers: &Layers| {
            let all = (0..tiles.fine.len()).flat_map(|k| tiles.soup(k, [1, 1], layers).normals);
            all.map(|n| n[2]).fold(1.0, f32::min)
        };
        assert!(normals(&layers) < 0.9 * normals(&Layers::default()));
    }

    #[test]
    fn large_maps_have_few_tiles_unless_they_are_sent_again() {
        let of = |n: usize, spacing: f64, draped: bool| {
            let surface = Surface {
                origin: [0.0; 2],
                spacing: [spacing; 2],
                nx: n + 1,
                ny: n + 1,
                heights: vec![0.0; (n + 1) * (n + 1)],
            };
            let t = Tiles::new(surface, None, draped).unwrap();
            (t.count, t.per, t.stride)
        };
        // A map of 300 m at 0.5 m has 16 tiles along an edge, which are as fine as the map. Where parts have
        // overlays, it has 60 tiles of 5 m.
        assert_eq!(of(600, 0.5, false), ([16; 2], [38; 2], [1; 2]));
        assert_eq!(of(600, 0.5, true), ([60; 2], [10; 2], [1; 2]));
        // A map of 1 km at 0.25 m has tiles of 128 nodes. At first every fifth node is shown.
        assert_eq!(of(4000, 0.25, false), ([32; 2], [128; 2], [5; 2]));
        // A small map has tiles of 5 m with nodes 0.5 m apart.
        assert_eq!(of(400, 0.05, false), ([4; 2], [100; 2], [10; 2]));
    }

    #[test]
    fn tiles_are_found_by_what_lies_on_them() {
        let tiles = slope(true);
        assert_eq!(tiles.count, [2, 1]);
        assert_eq!(tiles.between([-9.0, -9.0, 9.0, 9.0]), [0, 1]);
        let [x0, y0, x1, y1] = tiles.bounds(1);
        assert!((x0 - 0.5).abs() + (y0 - 1.0).abs() + (x1 - 2.0).abs() + (y1 - 3.4).abs() < 1e-12);
        assert_eq!(tiles.between([1.0, 2.0, 1.1, 2.1]), [1]);
        for nowhere in [[3.1, 1.0, 4.0, 2.0], [f64::NAN; 4], [0.0, -9.0, 1.0, 0.9]] {
            assert_eq!(tiles.between(nowhere), [0; 0], "{nowhere:?}");
        }
        let height = |x: f64, y: f64| tiles.height(x, y);
        assert!((height(0.3, 2.0).unwrap() - (0.6 * 2.3 - 0.25)).abs() < 1e-6);
        assert_eq!(
            (height(-1.9, 1.1), height(2.1, 2.0), height(f64::NAN, 2.0)),
            (None, None, None)
        );
    }

    #[test]
    fn colours_stand_where_they_were_laid() {
        let (tiles, mut layers) = (slope(true), Layers::default());
        assert!(tiles.texture(0, &layers).is_none());
        let mut colors = vec![[0, 0, 0, 0]; 16];
        colors[6] = [255, 0, 0, 255];
        let seen = OverlayValues::Colors(colors);
        layers.take("Map", OverlayTile { corner: [-0.5, 2.0], cell: 0.25, columns: 4, seen });
        // Tile 0 is 2.5 m by 2.4 m and begins at (-2, 1). Its texture is an eighth larger. The square is from (0, 2.25)
        // to (0.25, 2.5).
        let texture = tiles.texture(0, &layers).unwrap();
        let buffer = texture.albedo_texture_buffer.unwrap();
        let bytes = re_sdk_types::components::ImageBuffer::from_arrow(&buffer.array).unwrap();
        let texels: Vec<&[u8]> = bytes[0].0.0.chunks(3).collect();
        let red: Vec<usize> = (0..121).filter(|k| *texels[*k] == [255, 0, 0]).collect();
        assert_eq!((texels.len(), red), (121, vec![6 * 11 + 8]));
        assert!(texels.iter().filter(|t| ***t == [255; 3]).count() == 120);
    }

    #[test]
    fn the_ground_has_the_colour_that_it_is_given() {
        let level = [0.0, 0.0, 1.0];
        let at = |colors: &Colors, z| shade(colors, z, (-1.0, 1.0), level);
        // Level ground receives 0.765 of the light.
        let grey = colors(Some([200, 200, 200, 255]));
        assert_eq!(
            [at(&grey, -1.0), at(&grey, 0.0), at(&grey, 1.0)],
            [[122; 3], [153; 3], [183; 3]]
        );
        assert_eq!(at(&colors(None), 0.0), [139, 92, 65]);
        // Ground that faces away from the sun is darker.
        let north_east = [0.5, 0.5, std::f32::consts::FRAC_1_SQRT_2];
        let south_east = [0.5, -0.5, std::f32::consts::FRAC_1_SQRT_2];
        let light = |n| shade(&grey, 0.0, (-1.0, 1.0), n)[0];
        assert!(light(south_east) < light(north_east) && light(north_east) < light(level));
    }
}
