//! The ground as tiles: coarse everywhere, at full resolution where the machine goes.
use linkwork_runtime::Surface;
use re_sdk_types::archetypes::Mesh3D;

/// Edge of a tile (m).
const TILE: f64 = 5.0;
/// Nodes of the coarse form are at least this far apart (m).
const COARSE: f64 = 0.5;

/// Tiles of a surface.
pub struct Tiles {
    surface: Surface,
    /// Nodes per tile along x and y.
    per: [usize; 2],
    /// Tiles along x and y.
    count: [usize; 2],
    fine: Vec<bool>,
    range: (f32, f32),
    stride: [usize; 2],
    colors: Colors,
}

/// Colours of the ground where it is lowest and highest, red, green, blue.
type Colors = [[f32; 3]; 2];

/// Mars.
const REDDISH: Colors = [[150.0, 92.0, 62.0], [214.0, 150.0, 108.0]];

/// From the colour at the middle height.
fn colors(middle: Option<[u8; 4]>) -> Colors {
    let Some([r, g, b, _]) = middle else { return REDDISH };
    [0.8, 1.2].map(|share| [r, g, b].map(|c| share * f32::from(c)))
}

impl Tiles {
    /// Of a surface with at least 2 × 2 nodes, in the colour that it has at its middle height.
    pub fn new(surface: Surface, middle: Option<[u8; 4]>) -> Option<Tiles> {
        if surface.nx < 2 || surface.ny < 2 {
            return None;
        }
        // At most 60 tiles along an edge, however large the map.
        let tile = |k: usize, n: usize| {
            let extent = surface.spacing[k] * (n - 1) as f64;
            let nodes = (TILE.max(extent / 60.0) / surface.spacing[k]).round() as usize;
            nodes.clamp(1, n - 1)
        };
        let per = [tile(0, surface.nx), tile(1, surface.ny)];
        let count = [(surface.nx - 1).div_ceil(per[0]), (surface.ny - 1).div_ceil(per[1])];
        let stride = [0, 1].map(|k| {
            let want = (COARSE / surface.spacing[k]).round().max(1.0) as usize;
            want.max(per[k] / 12).min(per[k])
        });
        let range = surface
            .heights
            .iter()
            .filter(|h| h.is_finite())
            .fold((f32::INFINITY, f32::NEG_INFINITY), |(l, h), v| (l.min(*v), h.max(*v)));
        let fine = vec![false; count[0] * count[1]];
        Some(Tiles { surface, per, count, fine, range, stride, colors: colors(middle) })
    }

    /// All tiles in their coarse form.
    pub fn coarse(&self) -> Vec<(usize, Mesh3D)> {
        (0..self.fine.len()).filter_map(|k| Some((k, self.mesh(k, self.stride)?))).collect()
    }

    /// Tiles near a point that were not yet shown at full resolution.
    pub fn approach(&mut self, x: f64, y: f64, radius: f64) -> Vec<(usize, Mesh3D)> {
        let s = &self.surface;
        let index = |k: usize, v: f64| {
            let i = ((v - s.origin[k]) / (s.spacing[k] * self.per[k] as f64)).floor();
            i.clamp(0.0, (self.count[k] - 1) as f64) as usize
        };
        let (i0, i1) = (index(0, x - radius), index(0, x + radius));
        let (j0, j1) = (index(1, y - radius), index(1, y + radius));
        let mut out = Vec::new();
        for j in j0..=j1 {
            for i in i0..=i1 {
                let k = j * self.count[0] + i;
                if !self.fine[k] {
                    self.fine[k] = true;
                    out.extend(self.mesh(k, [1, 1]).map(|m| (k, m)));
                }
            }
        }
        out
    }

    fn nodes(&self, axis: usize, tile: usize, stride: usize) -> Vec<usize> {
        let n = if axis == 0 { self.surface.nx } else { self.surface.ny };
        let (a, b) = (tile * self.per[axis], ((tile + 1) * self.per[axis]).min(n - 1));
        let mut v: Vec<usize> = (a..b).step_by(stride).collect();
        v.push(b);
        v
    }

    fn mesh(&self, k: usize, stride: [usize; 2]) -> Option<Mesh3D> {
        let (ti, tj) = (k % self.count[0], k / self.count[0]);
        let (xs, ys) = (self.nodes(0, ti, stride[0]), self.nodes(1, tj, stride[1]));
        let s = &self.surface;
        let h = |i: usize, j: usize| s.heights[j * s.nx + i];
        let (mut points, mut normals, mut colors) = (Vec::new(), Vec::new(), Vec::new());
        for &j in &ys {
            for &i in &xs {
                let z = h(i, j);
                points.push([
                    (s.origin[0] + i as f64 * s.spacing[0]) as f32,
                    (s.origin[1] + j as f64 * s.spacing[1]) as f32,
                    if z.is_finite() { z } else { self.range.0 },
                ]);
                let (il, ir) = (i.saturating_sub(1), (i + 1).min(s.nx - 1));
                let (jl, jr) = (j.saturating_sub(1), (j + 1).min(s.ny - 1));
                let gx = (h(ir, j) - h(il, j)) / ((ir - il) as f32 * s.spacing[0] as f32);
                let gy = (h(i, jr) - h(i, jl)) / ((jr - jl) as f32 * s.spacing[1] as f32);
                let n = (1.0 + gx * gx + gy * gy).sqrt();
                normals.push([-gx / n, -gy / n, 1.0 / n]);
                colors.push(shade(&self.colors, z, self.range, [-gx / n, -gy / n, 1.0 / n]));
            }
        }
        let w = xs.len() as u32;
        let mut triangles = Vec::new();
        for j in 0..ys.len() as u32 - 1 {
            for i in 0..w - 1 {
                let at = |a: u32, b: u32| h(xs[a as usize], ys[b as usize]).is_finite();
                if at(i, j) && at(i + 1, j) && at(i, j + 1) && at(i + 1, j + 1) {
                    let p = j * w + i;
                    triangles.push([p, p + 1, p + w + 1]);
                    triangles.push([p, p + w + 1, p + w]);
                }
            }
        }
        (!triangles.is_empty()).then(|| {
            Mesh3D::new(points)
                .with_triangle_indices(triangles)
                .with_vertex_normals(normals)
                .with_vertex_colors(colors)
        })
    }
}

/// Lighter where high, with a low sun from the north-west for relief.
fn shade([low, high]: &Colors, z: f32, range: (f32, f32), n: [f32; 3]) -> [u8; 3] {
    let t = ((z - range.0) / (range.1 - range.0).max(1e-3)).clamp(0.0, 1.0);
    let light = (0.62 * n[2] - 0.55 * n[0] + 0.55 * n[1]).clamp(0.0, 1.0) * 0.75 + 0.3;
    [0, 1, 2].map(|k| ((low[k] + (high[k] - low[k]) * t) * light).clamp(0.0, 255.0) as u8)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_ground_has_the_colour_that_it_is_given() {
        let level = [0.0, 0.0, 1.0];
        let at = |colors: &Colors, z| shade(colors, z, (-1.0, 1.0), level);
        // 0.765 of the light falls on level ground.
        let grey = colors(Some([200, 200, 200, 255]));
        assert_eq!(
            [at(&grey, -1.0), at(&grey, 0.0), at(&grey, 1.0)],
            [[122; 3], [153; 3], [183; 3]]
        );
        assert_eq!(at(&colors(None), 0.0), [139, 92, 65]);
        // Turned from the sun it is darker.
        let north_east = [0.5, 0.5, std::f32::consts::FRAC_1_SQRT_2];
        let south_east = [0.5, -0.5, std::f32::consts::FRAC_1_SQRT_2];
        let light = |n| shade(&grey, 0.0, (-1.0, 1.0), n)[0];
        assert!(light(south_east) < light(north_east) && light(north_east) < light(level));
    }
}
