//! A function of two variables by points without a grid: linear in the triangles between them.
//! ```text
//! x_i = (u_i − least_i)/width_i      widths of all points, so that units do not matter
//! inside      y = Σ b_k y_k over the corners of the triangle that x is in, b: barycentric coordinates
//! outside     the value at the nearest place of the hull (in x)
//! ```
//! The triangulation is Delaunay's; for points on one circle it is one of several. The search for a triangle moves from one triangle to its neighbour
//! towards x; it takes about √n steps for n triangles and does not allocate memory.

use super::axis::Axis;
use spade::{DelaunayTriangulation, Point2, Triangulation};
use std::collections::BTreeMap;

/// No triangle: the edge is on the hull.
const NONE: u32 = u32::MAX;
/// A point this far outside an edge, as a share of the width, is still on it.
const ON_EDGE: f64 = 1e-14;

/// Corners counterclockwise, and the triangle beyond the edge from each to the next.
#[derive(Clone, Copy, Debug)]
struct Triangle {
    corners: [u32; 3],
    beyond: [u32; 3],
}

/// Points of two variables, in a triangulation.
#[derive(Clone, Debug)]
pub(super) struct Scattered {
    /// The variables with their limits; the breakpoints are empty.
    pub axes: [Axis; 2],
    /// Minimum and width of each variable.
    scale: [[f64; 2]; 2],
    points: Vec<[f64; 2]>,
    values: Vec<f64>,
    triangles: Vec<Triangle>,
    /// Edges of the hull, counterclockwise: first and second point.
    hull: Vec<[u32; 2]>,
}

/// Returns twice the area of a triangle, positive for counterclockwise corners.
fn area(a: [f64; 2], b: [f64; 2], c: [f64; 2]) -> f64 {
    (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
}

fn apart(a: [f64; 2], b: [f64; 2]) -> f64 {
    (a[0] - b[0]).hypot(a[1] - b[1])
}

impl Scattered {
    /// Creates a function; rows are u₁, u₂, y.
    ///
    /// # Errors
    /// The mistake in the points, and a remedy.
    pub fn new(axes: [Axis; 2], rows: &[[f64; 3]]) -> Result<Self, [&'static str; 2]> {
        let scale = [0, 1].map(|i| {
            let column = rows.iter().map(|row| row[i]);
            let low = column.clone().fold(f64::INFINITY, f64::min);
            [low, column.fold(f64::NEG_INFINITY, f64::max) - low]
        });
        let line =
            ["points that lie on a line", "write at least three points that are not on a line"];
        if !scale.iter().all(|[_, width]| *width > 0.0 && width.is_finite()) {
            return Err(line);
        }
        let mut triangulation = DelaunayTriangulation::<Point2<f64>>::new();
        let (mut points, mut values): (Vec<[f64; 2]>, Vec<f64>) = (Vec::new(), Vec::new());
        for row in rows {
            let x = [0, 1].map(|i| {
                let x = (row[i] - scale[i][0]) / scale[i][1];
                if x < 1e-30 { 0.0 } else { x }
            });
            let Ok(handle) = triangulation.insert(Point2::new(x[0], x[1])) else {
                return Err(["points too close to each other", "remove some of them"]);
            };
            // Only the first of equal points is used.
            match values.get(handle.index()) {
                None => {
                    points.push(x);
                    values.push(row[2]);
                }
                Some(before) if *before == row[2] => {}
                Some(_) => return Err(["two values at the same point", "remove one of them"]),
            }
        }
        let numbers: BTreeMap<usize, u32> =
            triangulation.inner_faces().zip(0..).map(|(face, k)| (face.fix().index(), k)).collect();
        let (mut triangles, mut hull) = (Vec::new(), Vec::new());
        for face in triangulation.inner_faces() {
            let corners = face.vertices().map(|v| v.fix().index() as u32);
            let beyond = face.adjacent_edges().map(|edge| {
                let other = edge.rev().face().as_inner();
                if other.is_none() {
                    hull.push([edge.from(), edge.to()].map(|v| v.fix().index() as u32));
                }
                other.and_then(|face| numbers.get(&face.fix().index()).copied()).unwrap_or(NONE)
            });
            triangles.push(Triangle { corners, beyond });
        }
        if triangles.is_empty() {
            return Err(line);
        }
        Ok(Scattered { axes, scale, points, values, triangles, hull })
    }

    fn point(&self, k: u32) -> [f64; 2] {
        self.points[k as usize]
    }

    /// Returns the value, and the distance of the point from the hull as a share of the width, negative outside.
    pub fn value(&self, values: &[f64]) -> (f64, f64) {
        let x = [0, 1].map(|i| {
            let axis = &self.axes[i];
            let u = values[axis.variable].clamp(axis.limits[0], axis.limits[1]);
            (u - self.scale[i][0]) / self.scale[i][1]
        });
        if x.iter().any(|x| x.is_nan()) {
            return (f64::NAN, f64::NAN);
        }
        let mut at = 0;
        'walk: for _ in 0..self.triangles.len() {
            let Triangle { corners, beyond } = self.triangles[at];
            for k in 0..3 {
                let (a, b) = (self.point(corners[k]), self.point(corners[(k + 1) % 3]));
                if area(a, b, x) < -ON_EDGE * apart(a, b) {
                    if beyond[k] == NONE {
                        return self.nearest(x);
                    }
                    at = beyond[k] as usize;
                    continue 'walk;
                }
            }
            break;
        }
        let corners = self.triangles[at].corners;
        let [a, b, c] = corners.map(|k| self.point(k));
        let [y_a, y_b, y_c] = corners.map(|k| self.values[k as usize]);
        let whole = area(a, b, c);
        let (to_b, to_c) = (area(a, x, c) / whole, area(a, b, x) / whole);
        let inside = self.hull.iter().map(|edge| {
            let [a, b] = edge.map(|k| self.point(k));
            area(a, b, x) / apart(a, b)
        });
        let y = y_a + to_b * (y_b - y_a) + to_c * (y_c - y_a);
        (y, inside.fold(f64::INFINITY, f64::min).max(0.0))
    }

    /// Returns the value at the nearest point of the hull, and the negative distance to it.
    fn nearest(&self, x: [f64; 2]) -> (f64, f64) {
        let mut best = (f64::NAN, f64::INFINITY);
        for edge in &self.hull {
            let ([a, b], [y_a, y_b]) =
                (edge.map(|k| self.point(k)), edge.map(|k| self.values[k as usize]));
            let along = [b[0] - a[0], b[1] - a[1]];
            let part = (x[0] - a[0]) * along[0] + (x[1] - a[1]) * along[1];
            let part = (part / (along[0] * along[0] + along[1] * along[1])).clamp(0.0, 1.0);
            let distance = apart(x, [a[0] + part * along[0], a[1] + part * along[1]]);
            if distance < best.1 {
                best = (y_a + part * (y_b - y_a), distance);
            }
        }
        (best.0, -best.1)
    }
}

#[cfg(test)]
mod tests {
    use super::super::axis::Interpolation;
    use super::*;

    fn axis(variable: usize) -> Axis {
        let limits = [f64::NEG_INFINITY, f64::INFINITY];
        Axis {
            variable,
            points: Vec::new(),
            way: Interpolation::Linear,
            beyond: [false; 2],
            limits,
        }
    }

    fn of(rows: &[[f64; 3]]) -> Result<Scattered, [&'static str; 2]> {
        Scattered::new([axis(0), axis(1)], rows)
    }

    /// Mach from 0 to 5, angles of some degrees: points of a plane reproduce the plane for any triangulation.
    fn plane(rows: usize) -> Vec<[f64; 3]> {
        let mut seed = 3_u64;
        let mut random = move || {
            seed = seed
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1_442_695_040_888_963_407);
            (seed >> 11) as f64 / (1_u64 << 53) as f64
        };
        let corners = [[0.0, -10.0], [5.0, -10.0], [0.0, 25.0], [5.0, 25.0]];
        let inside = (0..rows).map(|_| [5.0 * random(), 35.0 * random() - 10.0]);
        let all = corners.into_iter().chain(inside);
        all.map(|[mach, alpha]| [mach, alpha, 1.0 + 0.3 * mach - 0.02 * alpha]).collect()
    }

    #[test]
    fn a_plane_is_found_again_and_the_nearest_edge_outside() {
        let table = of(&plane(400)).unwrap();
        for k in 0..50 {
            for j in 0..50 {
                let (mach, alpha) = (0.1 + 0.098 * f64::from(k), -9.0 + 0.66 * f64::from(j));
                let (y, inside) = table.value(&[mach, alpha]);
                assert!((y - (1.0 + 0.3 * mach - 0.02 * alpha)).abs() < 1e-12, "{mach} {alpha}");
                let (x, z) = (mach / 5.0, (alpha + 10.0) / 35.0);
                let want = x.min(1.0 - x).min(z).min(1.0 - z);
                assert!((inside - want).abs() < 1e-12, "{mach} {alpha}: {inside} {want}");
            }
        }
        for (mach, alpha, at_mach, at_alpha, inside) in [
            (6.0, 3.0, 5.0, 3.0, -0.2),
            (-1.0, -17.0, 0.0, -10.0, -0.2 * 2f64.sqrt()),
            (2.0, 32.0, 2.0, 25.0, -0.2),
        ] {
            let (y, found) = table.value(&[mach, alpha]);
            assert!((y - (1.0 + 0.3 * at_mach - 0.02 * at_alpha)).abs() < 1e-12, "{mach} {alpha}");
            assert!((found - inside).abs() < 1e-12, "{found}");
        }
        assert!(table.value(&[f64::NAN, 0.0]).0.is_nan());
    }

    /// Every point of the table has its own value, and the function is continuous; the triangulation is Delaunay's: no point is inside the
    /// circumcircle of another triangle.
    #[test]
    fn points_keep_their_values_in_triangles_without_slivers() {
        let mut rows = plane(300);
        rows.iter_mut().for_each(|r| r[2] = (1.7 * r[0]).sin() + 0.01 * r[1] * r[1]);
        let table = of(&rows).unwrap();
        for [mach, alpha, y] in &rows {
            let (found, inside) = table.value(&[*mach, *alpha]);
            assert!((found - y).abs() < 1e-11 && inside >= 0.0, "{found} {y}");
        }
        let mut last = table.value(&[0.01, -9.9]).0;
        for k in 1..100_000 {
            let s = f64::from(k) * 1e-5;
            let y = table.value(&[0.01 + 4.9 * s, -9.9 + 34.0 * s * s]).0;
            assert!((y - last).abs() < 2e-3, "{s}");
            last = y;
        }
        let n = table.points.len();
        // Euler's formula: n points, h of them on the hull, have 2 n − 2 − h triangles.
        assert_eq!(table.triangles.len(), 2 * n - 2 - table.hull.len());
        for Triangle { corners, .. } in &table.triangles {
            let [a, b, c] = corners.map(|k| table.point(k));
            assert!(area(a, b, c) > 0.0);
            for p in &table.points {
                let [u, v, w] = [a, b, c].map(|q| [q[0] - p[0], q[1] - p[1]]);
                let square = |q: [f64; 2]| q[0] * q[0] + q[1] * q[1];
                let in_circle = square(u) * (v[0] * w[1] - v[1] * w[0])
                    - square(v) * (u[0] * w[1] - u[1] * w[0])
                    + square(w) * (u[0] * v[1] - u[1] * v[0]);
                assert!(in_circle < 1e-12, "{in_circle}");
            }
        }
    }

    #[test]
    fn points_that_make_no_table_are_told() {
        let told = |rows: &[[f64; 3]]| of(rows).err().map(|e| e[0]);
        let line = [[0.0, 0.0, 1.0], [1.0, 2.0, 1.0], [2.0, 4.0, 3.0]];
        assert_eq!(told(&line), Some("points that lie on a line"));
        assert_eq!(told(&[[0.0, 1.0, 1.0], [1.0, 1.0, 1.0]]), Some("points that lie on a line"));
        assert_eq!(told(&[]), Some("points that lie on a line"));
        let twice = [[0.0, 0.0, 1.0], [1.0, 0.0, 2.0], [0.0, 1.0, 3.0], [1.0, 0.0, 2.5]];
        assert_eq!(told(&twice), Some("two values at the same point"));
        let same = [[0.0, 0.0, 1.0], [1.0, 0.0, 2.0], [0.0, 1.0, 3.0], [1.0, 0.0, 2.0]];
        assert_eq!(of(&same).unwrap().value(&[0.25, 0.25]).0, 1.75);
    }
}
