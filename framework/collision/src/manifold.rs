//! Contact manifold: several contact points of two convex cores.
//!
//! ```text
//! the normal n, from A to B                       (axis.rs)
//! a face of one is nearly perpendicular to n:  the facing part of the other, clipped by planes through the face's edges;
//!                                      each remaining corner p has the distance (p − face) · m, m the face's normal
//! the deepest is not among them:       the pair of points that determined n
//! two parallel edges:                  the ends of the common segment
//! ```
//! A point is named by the corners and edges that form it, so it keeps its name while they do. A corner counts as inside a plane if it is less than
//! [`SLACK`] outside, so that coincident edges do not cut each other's ends off.

use crate::axis::{self, Axis, BIAS, Nearest, Source};
use crate::contact_points::{Cut, OF_A, OF_B, Point, Room, corner, crossing, least};
use crate::core::{Core, Corner, Placed, edge_name};
use crate::edges::deepest;
use crate::polish::polish;
use crate::surface::Facet;
use linkwork_multibody::spatial::Vec3;

/// Relative to the size of the pair.
pub(crate) const SLACK: f64 = 1e-4;
/// A face counts as perpendicular to n if the cosine is above this.
const ACROSS: f64 = 0.985;
/// Tolerance for equality, relative to the size of the pair.
pub(crate) const EQUAL: f64 = 1e-9;

/// Appends the contact points of two cores with a separation of at most `limit`.
pub(crate) fn convex(a: &Placed, b: &Placed, limit: f64, size: f64, room: &mut Room) {
    let Some(mut axis) = axis::best(a, b, limit, BIAS * size) else { return };
    let from = room.points.len();
    let equal = EQUAL * size;
    let mut done = false;
    if axis.source == Source::Face {
        across(a, b, &axis, limit, size, room);
        done = enough(a, b, &axis, size, &room.points[from..]);
    }
    let thin = a.core.is_triangle();
    let complete = axis::complete(a.core, b.core);
    if done
        && (axis.sep > 0.0
            || complete
            || thin
            || well_inside(&axis, &room.points[from..], room, size))
    {
        return;
    }
    let mut ends = None;
    if axis.sep > 0.0 || !complete || thin {
        match refine(a, b, &axis, limit, complete, room) {
            None => return room.points.truncate(from),
            Some((n, sep, near)) => {
                ends = near;
                if sep > axis.sep + equal {
                    axis = Axis { n, sep, source: Source::Other };
                }
            }
        }
    }
    if done && axis.source == Source::Face || axis.sep > limit {
        return;
    }
    room.points.truncate(from);
    settle(a, b, &axis, ends, limit, size, room);
}

/// Appends the points along a final axis; `ends` are the nearest points if the axis was found from them.
pub(crate) fn settle(
    a: &Placed,
    b: &Placed,
    axis: &Axis,
    ends: Option<(Vec3, Vec3)>,
    limit: f64,
    size: f64,
    room: &mut Room,
) {
    let from = room.points.len();
    across(a, b, axis, limit, size, room);
    keep_shallower(&mut room.points, from, axis, EQUAL * size);
    // A corner that is behind the plane of a face but not behind the face itself belongs to another face. If the end of
    // a cylinder faces the triangle, points between corners are valid, too, because a circle has more points than the
    // eight corners.
    let cylinder = matches!(b.core, Core::Cylinder { .. });
    let round = || cylinder && b.R.column(2).dot(&axis.n).abs() > 1.0 - 1e-12;
    let beside = a.core.is_triangle() && axis.source == Source::Face && !round();
    if !beside && !enough(a, b, axis, size, &room.points[from..]) {
        deepest(a, b, axis, ends, size, room);
    }
}

/// Returns normal, distance and nearest points of cores for which the candidates do not suffice; `None` when they are too far apart.
fn refine(
    a: &Placed,
    b: &Placed,
    axis: &Axis,
    limit: f64,
    complete: bool,
    room: &mut Room,
) -> Option<(Vec3, f64, Option<(Vec3, Vec3)>)> {
    let (n, sep, ends) = match axis::nearest(a, b, limit, &axis.n, &mut room.simplex) {
        Nearest::Far => return None,
        Nearest::Apart(pa, pb, n, d) => (n, d, Some((pa, pb))),
        Nearest::Overlap(_) if complete => (axis.n, axis.sep, None),
        Nearest::Overlap(n) => {
            let found = axis::depth(a, b, &room.simplex, &mut room.epa);
            let tried =
                [(n, b.range(&n).0 - a.range(&n).1), found.unwrap_or((n, f64::NEG_INFINITY))];
            let best = tried.iter().fold((axis.n, axis.sep), |m, t| if t.1 > m.1 { *t } else { m });
            (best.0, best.1, None)
        }
    };
    if !axis::round(a.core) && !axis::round(b.core) {
        return Some((n, sep, ends));
    }
    let (n, sep) = polish(a, b, &n);
    Some((n, sep, None))
}

/// Returns true if a face of A is perpendicular to an axis and a point of B is so far within its border that no other direction has a smaller depth:
/// see [`well_inside`].
pub(crate) fn inset(a: &Placed, axis: &Axis, p: &Vec3, size: f64, room: &mut Room) -> bool {
    let depth = -10.0 * axis.sep;
    let face = a.facing(&axis.n, &mut room.fa);
    let across = face.is_some_and(|m| m.dot(&axis.n) > 1.0 - 1e-12);
    let fa = &room.fa;
    across
        && fa.len() > 2
        && 0.1 * size > depth
        && (0..fa.len()).all(|k| {
            let out = (fa[(k + 1) % fa.len()].p - fa[k].p).cross(&axis.n);
            (fa[k].p - p).dot(&out) > f64::max(depth, 0.0) * out.norm()
        })
}

/// Returns true if no other direction can have a smaller depth. With depth δ below a face, and at least ρ from its border, a normal rotated by θ has
/// sep ≤ −δ cos θ − ρ sin θ. This exceeds −δ only for tan(θ/2) > ρ/δ, which never occurs unless the face is the back of something thinner than δ.
fn well_inside(axis: &Axis, points: &[Point], room: &Room, size: f64) -> bool {
    let Some(p) = points.iter().find(|p| p.gap <= least(points)) else { return false };
    let inset = |face: &[Corner], foot: &Vec3| {
        (0..face.len()).fold(f64::INFINITY, |m, k| {
            let out = (face[(k + 1) % face.len()].p - face[k].p).cross(&axis.n);
            let height = (foot - face[k].p).dot(&out).abs() / out.norm();
            if height < m { height } else { m }
        })
    };
    let depth = -10.0 * axis.sep;
    let on = |face: &[Corner], foot: &Vec3| face.len() > 2 && inset(face, foot) > depth;
    0.1 * size > depth && (on(&room.fa, &p.pa) || on(&room.fb, &p.pb))
}

/// Returns true if some points show the distance `sep`. Where flat parts of both shapes touch, a corner that protrudes beyond the edge may be deeper
/// by [`BIAS`], and eight points represent a whole rim. Otherwise a resting contact would gain and lose a point with every small motion.
fn enough(a: &Placed, b: &Placed, axis: &Axis, size: f64, points: &[Point]) -> bool {
    let along = points.iter().filter(|p| p.n.dot(&axis.n) > 1.0 - 5e-9);
    let missing = along.fold(f64::INFINITY, |m, p| if p.gap < m { p.gap } else { m }) - axis.sep;
    missing <= EQUAL * size
        || (missing <= BIAS * size && a.lies_flat(&axis.n) && b.lies_flat(&-axis.n))
}

/// Removes points after the first `from` that are deeper than the pair; if their normal differs, also those that are equally deep.
fn keep_shallower(points: &mut Vec<Point>, from: usize, axis: &Axis, equal: f64) {
    let same = |p: &Point| p.n.dot(&axis.n) > 1.0 - 5e-9;
    let mut kept = from;
    for i in from..points.len() {
        let p = &points[i];
        if p.gap >= axis.sep + if same(p) { -equal } else { 2.0 * equal } {
            points[kept] = points[i];
            kept += 1;
        }
    }
    points.truncate(kept);
}

/// Computes points by clipping if a face of one core is perpendicular to the normal.
pub(crate) fn across(a: &Placed, b: &Placed, axis: &Axis, limit: f64, size: f64, room: &mut Room) {
    let ma = a.facing(&axis.n, &mut room.fa);
    let mb = b.facing(&-axis.n, &mut room.fb);
    let ca = ma.map_or(-1.0, |m| m.dot(&axis.n));
    let cb = mb.map_or(-1.0, |m| -m.dot(&axis.n));
    if ca.max(cb) < ACROSS {
        return;
    }
    let first = ca + 1e-9 >= cb;
    let (m, face, other) = match (ma, mb) {
        (Some(m), _) if first => (m, &room.fa, &room.fb),
        (_, Some(m)) => (m, &room.fb, &room.fa),
        _ => return,
    };
    clip(face, other, &m, SLACK * size, first, &mut room.cut, &mut room.next);
    for c in &room.cut {
        let gap = (c.p - face[0].p).dot(&m);
        if gap <= limit {
            let foot = c.p - m * gap;
            let (pa, pb, n) = if first { (foot, c.p, m) } else { (c.p, foot, -m) };
            room.points.push(Point { pa, pb, n, gap, name: c.name });
        }
    }
}

/// Appends the part of a core above a triangle, along the triangle's normal.
pub(crate) fn over_triangle(
    t: &Facet,
    sides: &[Vec3; 3],
    b: &Placed,
    limit: f64,
    size: f64,
    room: &mut Room,
) {
    b.facing(&-t.n, &mut room.fb);
    if let [c, d] = room.fb[..] {
        let ends = on_line(t, sides, [c, d], SLACK * size);
        for (p, name) in ends.iter().flatten() {
            let gap = (p - t.v[0]).dot(&t.n);
            if gap <= limit {
                let pa = p - t.n * gap;
                room.points.push(Point { pa, pb: *p, n: t.n, gap, name: *name });
            }
        }
        return;
    }
    room.fa.clear();
    room.fa.extend((0..3).map(|k| {
        let edge = edge_name(t.names[k], t.names[(k + 1) % 3]);
        Corner { p: t.v[k], name: t.names[k], edge }
    }));
    clip(&room.fa, &room.fb, &t.n, SLACK * size, true, &mut room.cut, &mut room.next);
    for c in &room.cut {
        let gap = (c.p - t.v[0]).dot(&t.n);
        if gap <= limit {
            let pa = c.p - t.n * gap;
            room.points.push(Point { pa, pb: c.p, n: t.n, gap, name: c.name });
        }
    }
}

/// Appends the part of a line above a triangle; `sides` point away from its edges. Two ends, or one if they are within the slack of each other.
fn on_line(
    t: &Facet,
    sides: &[Vec3; 3],
    line: [Corner; 2],
    slack: f64,
) -> [Option<(Vec3, u64)>; 2] {
    let mut ends = line.map(|c| (c.p, corner(OF_B, c.name)));
    for k in 0..3 {
        let heights = ends.map(|e| (e.0 - t.v[k]).dot(&sides[k]) - slack);
        if heights[0] <= 0.0 && heights[1] <= 0.0 {
            continue;
        }
        let Some(inner) = (0..2).find(|i| heights[*i] <= 0.0) else { return [None; 2] };
        let outer = 1 - inner;
        // An end that is on the plane within the slack replaces the crossing next to it.
        if heights[inner] > -2.0 * slack {
            ends[outer] = ends[inner];
            continue;
        }
        // Intersect with the plane itself, not with the plane displaced by the slack.
        let s = (heights[inner] + slack) / (heights[inner] - heights[outer]);
        let edge = edge_name(t.names[k], t.names[(k + 1) % 3]);
        ends[outer] =
            (ends[inner].0.lerp(&ends[outer].0, s.clamp(0.0, 1.0)), crossing(edge, line[0].edge));
    }
    [Some(ends[0]), Some(ends[1]).filter(|e| e.1 != ends[0].1)]
}

const OWN: usize = usize::MAX;

/// Clips `other` by the planes through the edges of `face` (Sutherland and Hodgman) into `cut`.
fn clip(
    face: &[Corner],
    other: &[Corner],
    m: &Vec3,
    slack: f64,
    first: bool,
    cut: &mut Vec<Cut>,
    next: &mut Vec<Cut>,
) {
    let (mine, theirs) = if first { (OF_A, OF_B) } else { (OF_B, OF_A) };
    cut.clear();
    cut.extend(other.iter().map(|c| Cut {
        p: c.p,
        name: corner(theirs, c.name),
        edge: c.edge,
        plane: OWN,
    }));
    for k in 0..face.len() {
        let start = &face[k];
        let out = (face[(k + 1) % face.len()].p - start.p).cross(m);
        let length = out.norm();
        if !(length > 0.0) {
            continue;
        }
        let height = |p: &Vec3| (p - start.p).dot(&out) / length - slack;
        next.clear();
        for i in 0..cut.len() {
            let (c, d) = (cut[i], cut[(i + 1) % cut.len()]);
            let (hc, hd) = (height(&c.p), height(&d.p));
            if hc <= 0.0 {
                next.push(c);
            }
            if (hc <= 0.0) != (hd <= 0.0) {
                // A corner that is on the plane within the slack replaces the crossing next to it.
                if hc.min(hd) > -2.0 * slack {
                    if let (true, Some(last)) = (hc <= 0.0, next.last_mut()) {
                        (last.edge, last.plane) = (start.edge, k);
                    }
                    continue;
                }
                // Intersect with the plane itself, not with the plane displaced by the slack.
                let t = ((hc + slack) / (hc - hd)).clamp(0.0, 1.0);
                let name = if c.plane == OWN {
                    if first { crossing(start.edge, c.edge) } else { crossing(c.edge, start.edge) }
                } else {
                    let shared = if (c.plane + 1) % face.len() == k { k } else { c.plane };
                    corner(mine, face[shared].name)
                };
                let leaving = hc <= 0.0;
                let (edge, plane) = if leaving { (start.edge, k) } else { (c.edge, c.plane) };
                let p = c.p + (d.p - c.p) * t;
                if !next.iter().any(|o| o.name == name) {
                    next.push(Cut { p, name, edge, plane });
                }
            }
        }
        std::mem::swap(cut, next);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::contact_points::Most;
    use crate::core::Poly;
    use linkwork_multibody::spatial::Quat;

    /// Relative poses of two axes, from equal to arbitrary, including small angles, at which curved cores need most steps.
    #[test]
    fn the_depth_of_no_overlap_takes_more_memory() {
        let mut room = Room::new(&Most { searched: true, ..Most::default() });
        let cylinder = |r, h| Core::Cylinder { r, h };
        let poly = |x, y, z| Core::Poly(Poly::cuboid(Vec3::new(x, y, z)));
        let round = [cylinder(1.0, 0.9), cylinder(0.2, 1.5), cylinder(1.0, 0.05)];
        let cores = round.into_iter().chain([Core::Segment { h: 1.0 }]);
        let cores: Vec<_> = cores.chain([poly(1.0, 0.5, 0.1), poly(1.0, 1.0, 1.0)]).collect();
        let mut seed = 1_u64;
        let mut random = || {
            seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
            (seed >> 33) as f64 / f64::from(1 << 30) - 1.0
        };
        let mut overlaps = 0;
        for k in 0..20_000 {
            let small = [1.0, 1e-3, 0.03, 1e-6][k / 36 % 4];
            let turn = Vec3::from_fn(|_, _| random()) * 3.0 * small;
            let R = Quat::from_scaled_axis(turn).to_rotation_matrix().into_inner();
            let p = Vec3::from_fn(|_, _| random()) * 0.7 * small;
            let (a, b) = (Placed::here(&cores[k % 6]), Placed { core: &cores[k / 6 % 6], R, p });
            let found = axis::nearest(&a, &b, 0.0, &Vec3::x(), &mut room.simplex);
            if matches!(found, Nearest::Overlap(_)) {
                overlaps += 1;
                let Room { simplex, epa, .. } = &mut room;
                let counted = allocation_counter::measure(|| {
                    axis::depth(&a, &b, simplex, epa);
                });
                assert_eq!(counted.count_total, 0, "{k}: {counted:?}");
            }
        }
        assert!(overlaps > 10_000, "{overlaps}");
    }
}
