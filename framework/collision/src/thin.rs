//! Many contact points of a pair to few: names made unique, at most four points for each direction.
//!
//! The choice follows corners and edges, not the last digits of their places: what is equal within a tolerance goes by name.

use crate::core::mix;
use crate::manifold::Point;
use linkwork_multibody::spatial::Vec3;

/// Names are made unique, and points that share a normal are thinned to four that are spread well.
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
        let keep = spread(&mut points[rest..end], &n, size);
        points.drain(rest + keep..end);
        rest += keep;
        points[rest..].sort_unstable_by_key(|p| p.name);
    }
}

/// Of points of one name and one normal the first stays; those with other normals get names of their own. Sorted by name.
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

/// Moves at most four points to the front: the deepest, the farthest from it, the farthest from their line on either side. Sorted by name; what is equal
/// within a thousandth goes by name, so that small motions change nothing.
fn spread(points: &mut [Point], n: &Vec3, size: f64) -> usize {
    let count = points.len();
    if count <= 2 {
        return count;
    }
    let Some(low) = lowest(points) else { return count };
    let (limit, normal) = (low.gap + 1e-5 * size, low.n);
    let deep = |p: &Point| p.gap <= limit && p.n.dot(&normal) > 1.0 - 5e-9;
    let at = |p: &Point| p.pb;
    let pick = |points: &[Point], from: usize, measure: &dyn Fn(&Point) -> f64| {
        let most = points[from..].iter().map(measure).fold(f64::NEG_INFINITY, f64::max);
        let enough = most - 1e-3 * most.abs();
        (from..points.len()).find(|i| measure(&points[*i]) >= enough).unwrap_or(from)
    };
    // Where many are equally deep, a corner of them and not one in their midst.
    let some = points.iter().find(|p| deep(p)).map_or_else(Vec3::zeros, at);
    let first = pick(points, 0, &|p| if deep(p) { (at(p) - some).norm_squared() } else { -1.0 });
    points.swap(0, first);
    points[1..].sort_unstable_by_key(|p| p.name);
    let a = at(&points[0]);
    let second = pick(points, 1, &|p| (at(p) - a).norm_squared());
    points.swap(1, second);
    points[2..].sort_unstable_by_key(|p| p.name);
    let across = n.cross(&(at(&points[1]) - a));
    let third = pick(points, 2, &|p| (at(p) - a).dot(&across).abs());
    let line = at(&points[1]) - a;
    if (at(&points[third]) - a).dot(&across).abs() <= 1e-3 * line.norm_squared() {
        // All on one line: both ends, and the deepest when it is between them.
        let other = pick(points, 2, &|p| -(at(p) - a).dot(&line));
        points.swap(2, other);
        let beyond = -(at(&points[2]) - a).dot(&line) > 1e-3 * line.norm_squared();
        return if beyond { 3 } else { 2 };
    }
    points.swap(2, third);
    if count == 3 {
        return 3;
    }
    points[3..].sort_unstable_by_key(|p| p.name);
    let side = -(at(&points[2]) - a).dot(&across).signum();
    let fourth = pick(points, 3, &|p| side * (at(p) - a).dot(&across));
    points.swap(3, fourth);
    4
}

/// The point with the smallest distance.
fn lowest(points: &[Point]) -> Option<Point> {
    points.iter().min_by(|p, q| p.gap.total_cmp(&q.gap)).copied()
}
