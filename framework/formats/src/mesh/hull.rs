//! Convex hull of points: each new point replaces the faces that are visible from it by faces to their outer edges (O(n · faces)).

use linkwork_spatial::Vec3;
use std::collections::BTreeSet;

/// Maximum number of points; more would take minutes.
const POINTS: usize = 100_000;

/// Distance, relative to the size of the points, within which a point is on a face.
const FLAT: f64 = 1e-10;

/// A face with its outward normal (not of unit length) and the distance of its plane.
struct Face {
    corners: [usize; 3],
    normal: Vec3,
    distance: f64,
}

/// Returns the corners of the hull's triangles, three for each, counter-clockwise from outside; `None` for points in one plane or too many points.
pub(crate) fn hull(points: &[Vec3]) -> Option<Vec<Vec3>> {
    let mut points = points.to_vec();
    points.sort_by(|a, b| a.iter().partial_cmp(b.iter()).unwrap_or(std::cmp::Ordering::Equal));
    points.dedup();
    if points.len() > POINTS {
        return None;
    }
    let start = tetrahedron(&points)?;
    let size = points.iter().map(|p| (p - points[start[0]]).amax()).fold(0.0, f64::max);
    let inside = start.iter().map(|k| points[*k]).sum::<Vec3>() / 4.0;
    let face = |corners: [usize; 3]| -> Face {
        let [a, b, c] = corners.map(|k| points[k]);
        let normal = (b - a).cross(&(c - a));
        let normal = normal / normal.norm().max(f64::MIN_POSITIVE);
        Face { corners, normal, distance: normal.dot(&a) }
    };
    let [a, b, c, d] = start;
    let outward = |[a, b, c]: [usize; 3]| {
        let f = face([a, b, c]);
        if f.normal.dot(&inside) > f.distance { face([a, c, b]) } else { f }
    };
    let mut faces: Vec<Face> = [[a, b, c], [a, b, d], [a, c, d], [b, c, d]].map(outward).into();
    for (k, p) in points.iter().enumerate().filter(|(k, _)| !start.contains(k)) {
        let sees = |f: &Face| f.normal.dot(p) - f.distance > FLAT * size;
        let (seen, kept): (Vec<Face>, Vec<Face>) = faces.into_iter().partition(sees);
        faces = kept;
        let edges = |f: &Face| {
            let [a, b, c] = f.corners;
            [[a, b], [b, c], [c, a]]
        };
        let all: BTreeSet<[usize; 2]> = seen.iter().flat_map(edges).collect();
        // An edge of the boundary is visible from one side only.
        let rim = all.iter().filter(|[a, b]| !all.contains(&[*b, *a]));
        faces.extend(rim.map(|[a, b]| face([*a, *b, k])));
    }
    Some(faces.iter().flat_map(|f| f.corners.map(|k| points[k])).collect())
}

/// Returns four points that are not in one plane.
fn tetrahedron(points: &[Vec3]) -> Option<[usize; 4]> {
    let farthest = |measure: &dyn Fn(&Vec3) -> f64| -> Option<(usize, f64)> {
        let all = points.iter().map(measure).enumerate();
        all.max_by(|a, b| a.1.total_cmp(&b.1))
    };
    let a = 0;
    let origin = *points.first()?;
    let (b, length) = farthest(&|p| (p - origin).norm())?;
    let along = (points[b] - origin) / length.max(f64::MIN_POSITIVE);
    let (c, width) = farthest(&|p| (p - origin).cross(&along).norm())?;
    let normal = along.cross(&(points[c] - origin)) / width.max(f64::MIN_POSITIVE);
    let (d, height) = farthest(&|p| (p - origin).dot(&normal).abs())?;
    (height > FLAT * length && width > FLAT * length).then_some([a, b, c, d])
}
