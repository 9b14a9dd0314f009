//! Reduces the contact points of a pair: names are made unique, and for each direction at most eight corners of an outline are kept.
//!
//! The overlap of two rectangles has at most eight corners, so a box keeps all of its corners. With fewer points a body would tip about the missing
//! corner until this corner is deeper and another one is removed, and it would rock endlessly.
//!
//! The selection follows corners and edges, not the round-off of their positions: points that are equal within a tolerance are ordered by name.

use crate::contact_points::Point;
use crate::core::mix;
use linkwork_multibody::spatial::Vec3;

/// Points for each direction: `FEW` or fewer points are never reduced, and at most `MOST` remain.
const FEW: usize = 4;
const MOST: usize = 8;

/// More points than this, which occur for a box deep in fine terrain, are first reduced to the farthest ones in `DIRECTIONS` directions, because
/// removing points one by one takes quadratic time.
const MANY: usize = 64;
const DIRECTIONS: usize = 32;

/// Makes names unique, and reduces points with a common normal to an outline.
pub(crate) fn thin(points: &mut Vec<Point>, size: f64) {
    points.sort_unstable_by(|p, q| p.name.cmp(&q.name).then(p.gap.total_cmp(&q.gap)));
    same_names(points);
    let mut rest = 0;
    while rest < points.len() {
        let Some(n) = lowest(&points[rest..]).map(|p| p.n) else { break };
        let mut end = rest;
        for i in rest..points.len() {
            if points[i].n.dot(&n) > 0.95 {
                points.swap(i, end);
                end += 1;
            }
        }
        points[rest..end].sort_unstable_by_key(|p| p.name);
        let keep = outline(&mut points[rest..end], &n, size);
        points.drain(rest + keep..end);
        rest += keep;
        points[rest..].sort_unstable_by_key(|p| p.name);
    }
}

/// Keeps the first of several points with the same name and normal; points with the same name and other normals get new names. The points must be
/// sorted by name.
fn same_names(points: &mut Vec<Point>) {
    let (mut kept, mut group) = (0, 0);
    let mut name = None;
    for i in 0..points.len() {
        let mut p = points[i];
        if name != Some(p.name) {
            (name, group) = (Some(p.name), kept);
        } else if points[group..kept].iter().any(|q| q.n.dot(&p.n) > 0.999) {
            continue;
        } else {
            p.name = mix(p.name, (kept - group) as u64);
        }
        points[kept] = p;
        kept += 1;
    }
    points.truncate(kept);
    points.sort_unstable_by_key(|p| p.name);
}

/// Moves the points to keep to the front: the corners of the outline seen along n, and one of the deepest. The point that adds least to the outline
/// is removed first; points that are equal within a thousandth are ordered by name, so that small motions do not change the selection.
fn outline(points: &mut [Point], n: &Vec3, size: f64) -> usize {
    let mut count = points.len();
    if count <= 2 {
        return count;
    }
    let Some(low) = lowest(points) else { return count };
    let deep = |p: &Point| p.gap <= low.gap + 1e-5 * size && p.n.dot(&low.n) > 1.0 - 5e-9;
    let mid = points.iter().map(|p| p.pb).sum::<Vec3>() / count as f64;
    let far = points.iter().map(|p| (p.pb - mid).norm_squared()).fold(0.0, f64::max);
    // No three points span an area if all are on a line. This test does not depend on the order of
    // the points.
    let flat = |p: &[Point]| (p[1].pb - p[0].pb).cross(&(p[2].pb - p[0].pb)).norm() <= 1e-3 * far;
    if points.windows(3).all(flat) {
        return line(points, &mid, deep);
    }
    if count <= FEW {
        return count;
    }
    let mut e = Vec3::zeros();
    e[n.iamin()] = 1.0;
    let x = n.cross(&e);
    let y = n.cross(&x);
    // The value increases with the angle around the centre; a point in the centre has no angle.
    let around = |p: &Point| {
        let d = p.pb - mid;
        let (x, y) = (d.dot(&x), d.dot(&y));
        let part = y / (x.abs() + y.abs());
        let turn = if x >= 0.0 { part } else { 2.0 - part };
        if d.norm_squared() > 1e-6 * far { turn } else { f64::INFINITY }
    };
    if count > MANY {
        count = farthest(points, [&x, &y], far, deep);
    }
    let points = &mut points[..count];
    points.sort_unstable_by(|p, q| around(p).total_cmp(&around(q)).then(p.name.cmp(&q.name)));
    let mut deepest = points.iter().filter(|p| deep(p)).count();
    while count > FEW {
        let corner = |i: usize| {
            let p = |k: usize| points[k % count].pb;
            (p(i) - p(i + count - 1)).cross(&(p(i + 1) - p(i))).dot(n)
        };
        let may_go = |i: &usize| deepest > 1 || !deep(&points[*i]);
        let least = (0..count).filter(may_go).map(corner).fold(f64::INFINITY, f64::min);
        if least > 1e-3 * far && count <= MOST {
            break;
        }
        let equal = (0..count).filter(may_go).filter(|i| corner(*i) <= least + 1e-3 * far);
        let Some(out) = equal.min_by_key(|i| points[*i].name) else { break };
        deepest -= usize::from(deep(&points[out]));
        points[out..count].rotate_left(1);
        count -= 1;
    }
    count
}

/// Moves the points that are farthest in directions of the plane of x and y to the front, and one of the deepest; returns their number. Points that
/// are equally far within a thousandth are ordered by name.
fn farthest(
    points: &mut [Point],
    [x, y]: [&Vec3; 2],
    far: f64,
    deep: impl Fn(&Point) -> bool,
) -> usize {
    let first = |may: &dyn Fn(&Point) -> bool| {
        let found = points.iter().filter(|p| may(p)).min_by_key(|p| p.name);
        found.map(|p| p.name)
    };
    let (mut names, mut count) = ([u64::MAX; DIRECTIONS + 1], 0);
    let mut keep = |name: Option<u64>| {
        let Some(name) = name.filter(|name| !names[..count].contains(name)) else { return };
        (names[count], count) = (name, count + 1);
    };
    keep(first(&deep));
    let slack = 1e-3 * far.sqrt() * x.norm();
    for k in 0..DIRECTIONS {
        let (sin, cos) = (std::f64::consts::TAU * k as f64 / DIRECTIONS as f64).sin_cos();
        let along = x * cos + y * sin;
        let most = points.iter().map(|p| p.pb.dot(&along)).fold(f64::NEG_INFINITY, f64::max);
        keep(first(&|p| p.pb.dot(&along) >= most - slack));
    }
    let mut front = 0;
    for i in 0..points.len() {
        if names[..count].contains(&points[i].name) {
            points.swap(front, i);
            front += 1;
        }
    }
    front
}

/// Returns, for points on a line, its ends, and one of the deepest when it is not one of them.
fn line(points: &mut [Point], mid: &Vec3, deep: impl Fn(&Point) -> bool) -> usize {
    points.sort_unstable_by_key(|p| p.name);
    let farthest = |points: &[Point], from: &Vec3| {
        let most = points.iter().map(|p| (p.pb - from).norm()).fold(0.0, f64::max);
        points.iter().position(|p| (p.pb - from).norm() >= (1.0 - 1e-3) * most).unwrap_or(0)
    };
    points.swap(0, farthest(points, mid));
    let a = points[0].pb;
    points[1..].sort_unstable_by_key(|p| p.name);
    points.swap(1, 1 + farthest(&points[1..], &a));
    if points[..2].iter().any(&deep) {
        return 2;
    }
    points[2..].sort_unstable_by_key(|p| p.name);
    points.swap(2, 2 + points[2..].iter().position(deep).unwrap_or(0));
    3
}

/// Returns the point with the smallest distance.
fn lowest(points: &[Point]) -> Option<Point> {
    points.iter().min_by(|p, q| p.gap.total_cmp(&q.gap)).copied()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A plate of 2 m by 1 m deep in terrain with 2.5 cm resolution has 3321 points. Its corners and one of the deepest points remain, independent of
    /// the order of the points.
    #[test]
    fn a_plate_deep_in_fine_ground_stands_on_its_corners() {
        let n = Vec3::z();
        let points: Vec<Point> = (0..81 * 41)
            .map(|k| {
                let pb = Vec3::new(f64::from(k % 81) * 0.025, f64::from(k / 81) * 0.025, 0.0);
                let gap = if k == 81 * 20 + 33 { -0.3 } else { -0.2 };
                Point { pa: pb + n * gap, pb, n, gap, name: mix(7, k as u64) }
            })
            .collect();
        let thinned = |mut points: Vec<Point>| {
            thin(&mut points, 1.0);
            points
        };
        let kept = thinned(points.clone());
        assert!(kept.len() <= MOST, "{}", kept.len());
        for corner in [[0.0, 0.0], [2.0, 0.0], [0.0, 1.0], [2.0, 1.0]] {
            let near = |p: &Point| (p.pb.x - corner[0]).hypot(p.pb.y - corner[1]) < 1e-12;
            assert!(kept.iter().any(near), "no point at {corner:?}");
        }
        assert!(kept.iter().any(|p| p.gap == -0.3));
        let mut turned = points;
        turned.reverse();
        turned.rotate_left(1234);
        let names = |points: &[Point]| points.iter().map(|p| p.name).collect::<Vec<_>>();
        assert_eq!(names(&thinned(turned)), names(&kept));
    }
}
