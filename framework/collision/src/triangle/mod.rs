//! Contact of one triangle of a surface with a convex core, in the surface's frame.
//!
//! Notation: m is the triangle's normal, t_k are the outward directions at its edges k in the plane, p is the core's point that is deepest along m.
//! ```text
//! p over the triangle:                       m is the normal; the part that faces the triangle, clipped by planes through its edges
//! p beyond edges over which normals cannot lean (flat, concave), or not far enough:
//!                                            the part over the triangle, along m, if there is any; the rest belongs to the neighbours
//! p beyond convex edges:                     the normal n(φ) = m cos φ + t_k sin φ of largest separation, or that of a corner      ridge.rs
//! overlap deeper than a tenth of the core that is not proven separate:                                                              general
//! ```
//! The general method does not use the neighbours: it computes nearest points by iteration on A − B and refines them. A normal that a neighbour
//! forbids, because it comes from an edge inside a flat or concave part, is replaced by the triangle's normal. The other methods give the same
//! results: `framework/collision/src/triangle/tests.rs::short_ways_agree_with_the_general_one`.

mod ridge;
#[cfg(test)]
mod tests;

use crate::axis::{Axis, BIAS, Source};
use crate::contact_points::Point;
use crate::contact_points::least;
use crate::contact_points::{Room, corner};
use crate::core::{Core, Placed};
use crate::manifold::{EQUAL, SLACK, across, convex, over_triangle, settle};
use crate::surface::{Facet, LEAN, Surface};
use linkwork_multibody::spatial::Vec3;
use ridge::{apart, ridge};

/// Overlaps deeper than this fraction of the core's smallest half extent use the general method.
const SHALLOW: f64 = 0.1;
/// Overlaps over edges that are more convex than this (sine) use the general method.
const GENTLE: f64 = 0.3;
/// Overlaps below this, relative to the size of the pair, count as touching.
const TOUCH: f64 = 1e-5;

/// A triangle of a surface.
#[derive(Clone, Copy)]
pub(crate) struct Tile<'s> {
    /// The surface.
    pub surface: &'s Surface,
    /// Its index.
    pub number: u32,
    /// Its corners and its normal.
    pub facet: Facet,
}

impl<'s> Tile<'s> {
    pub(crate) fn new(surface: &'s Surface, number: u32) -> Self {
        Self { surface, number, facet: surface.facet(number) }
    }

    fn lean(&self, k: usize, across: &Vec3) -> f64 {
        self.surface.lean(self.number, &self.facet, k, across)
    }

    fn admits(&self, n: &Vec3) -> bool {
        self.facet.admits(n, |k, across| self.lean(k, across))
    }
}

/// Appends the contact points of a triangle and a core.
pub(crate) fn one_triangle(t: &Tile, b: &Placed, limit: f64, size: f64, room: &mut Room) {
    if let Core::Point = b.core {
        return point_on(t, &b.p, limit, size, room);
    }
    let from = room.points.len();
    if short(t, b, limit, size, room).is_none() {
        room.points.truncate(from);
        general(t, b, limit, size, room);
    }
}

/// Tries the methods without iteration on A − B; `None` when an iteration is needed.
fn short(t: &Tile, b: &Placed, limit: f64, size: f64, room: &mut Room) -> Option<()> {
    let f = &t.facet;
    let low = b.support(&-f.n);
    let sep = (low - f.v[0]).dot(&f.n);
    if sep > limit {
        return Some(());
    }
    // The core is far behind the plane, but may be outside the border of the triangle.
    let free = -sep > SHALLOW * b.core.least_half();
    if free && !apart(f, b)? {
        return None;
    }
    let sides = [0, 1, 2].map(|k| f.across(k));
    let out = [0, 1, 2].map(|k| (low - f.v[k]).dot(&sides[k]));
    let slack = SLACK * size;
    let convex_edge = |k: usize| t.lean(k, &sides[k]) > LEAN;
    // A normal that leans by φ over an edge has a smaller depth only for tan(φ/2) > inset/depth; over two edges it may lean more than over one.
    let near = |k: usize| match -out[k] {
        inset if inset < 0.0 => out[k] < slack && convex_edge(k),
        inset => inset < -sep && inset < -2.0 * sep * t.lean(k, &sides[k]),
    };
    if sep < 0.0 && (0..3).any(near) {
        return None;
    }
    if !(0..3).any(|k| out[k] > slack || (out[k] > 0.0 && convex_edge(k))) {
        over_triangle(f, &sides, b, limit, size, room);
        return if free { None } else { Some(()) };
    }
    if let Some(axis) = ridge(t, b, &sides, &out, (sep, limit, slack))?
        && axis.sep > sep + if out.iter().any(|o| *o > slack) { EQUAL } else { BIAS } * size
    {
        if axis.sep > limit {
            return Some(());
        }
        // Over sharp edges several directions may have nearly the same depth.
        if axis.sep < 0.0 && (0..3).any(|k| t.lean(k, &sides[k]) > GENTLE) {
            return None;
        }
        let from = room.points.len();
        with_poly(f, room, |a, room| settle(a, b, &axis, None, limit, size, room));
        if legal(t, room, from) {
            return Some(());
        }
    }
    let from = room.points.len();
    over_triangle(f, &sides, b, limit, size, room);
    if least(&room.points[from..]) < 0.0 {
        if free {
            keep(room, from, |p| p.gap >= 0.0);
        } else if !through(f, &sides, &room.points[from..], TOUCH * size) {
            return None;
        }
    }
    Some(())
}

/// Returns true if points behind the plane show that the core passes through the triangle and not outside its border: one of them, or one between two, is
/// farther than `touch` behind it and inside its border. Also true if all are so close to the plane that the difference does not matter.
fn through(f: &Facet, sides: &[Vec3; 3], points: &[Point], touch: f64) -> bool {
    let inside =
        |p: &Vec3, gap: f64| -gap > touch && (0..3).all(|k| (f.v[k] - p).dot(&sides[k]) > touch);
    least(points) > -touch
        || (0..points.len()).any(|i| {
            let (p, q) = (&points[i], &points[(i + 1) % points.len()]);
            inside(&p.pa, p.gap) || inside(&((p.pa + q.pa) / 2.0), (p.gap + q.gap) / 2.0)
        })
}

/// Returns true if the neighbours permit the normal of the deepest point, or if there is none. Removes points with other normals.
fn legal(t: &Tile, room: &mut Room, from: usize) -> bool {
    let deepest = room.points[from..].iter().min_by(|p, q| p.gap.total_cmp(&q.gap)).copied();
    let legal = deepest.is_none_or(|p| t.admits(&p.n));
    keep(room, from, |p| legal && t.admits(&p.n));
    legal
}

fn keep(room: &mut Room, from: usize, legal: impl Fn(&Point) -> bool) {
    let mut kept = from;
    for i in from..room.points.len() {
        if legal(&room.points[i]) {
            room.points[kept] = room.points[i];
            kept += 1;
        }
    }
    room.points.truncate(kept);
}

/// Calls `work` with the triangle as a core.
fn with_poly(f: &Facet, room: &mut Room, work: impl FnOnce(&Placed, &mut Room)) {
    let Core::Poly(mut poly) = std::mem::replace(&mut room.triangle, Core::Point) else { return };
    f.write(&mut poly);
    let core = Core::Poly(poly);
    work(&Placed::here(&core), room);
    room.triangle = core;
}

/// Computes the nearest points or the penetration depth of triangle and core without the neighbours, then applies what the neighbours permit.
fn general(t: &Tile, b: &Placed, limit: f64, size: f64, room: &mut Room) {
    let n = t.facet.n;
    let (low, high) = b.range(&n);
    let plane = n.dot(&t.facet.v[0]);
    if low - plane > limit || high - plane < -room.behind {
        return;
    }
    with_poly(&t.facet, room, |a, room| {
        let from = room.points.len();
        convex(a, b, limit, size, room);
        let depth = least(&room.points[from..]);
        if legal(t, room, from) {
            return;
        }
        // If the core does not touch the triangle itself, points below the plane do not count.
        let floor = if depth > -TOUCH * size { 0.0 } else { f64::NEG_INFINITY };
        let own = Axis { n, sep: low - plane, source: Source::Face };
        across(a, b, &own, limit, size, room);
        keep(room, from, |p| p.gap >= floor && t.admits(&p.n));
    });
}

/// Computes the contact of a point and a triangle: the nearest point of the face, otherwise of an edge.
fn point_on(t: &Tile, p: &Vec3, limit: f64, size: f64, room: &mut Room) {
    let f = &t.facet;
    let height = (p - f.v[0]).dot(&f.n);
    let mut nearest: Option<(Vec3, f64)> = None;
    let mut outside = false;
    for k in 0..3 {
        let (a, e) = (f.v[k], f.v[(k + 1) % 3] - f.v[k]);
        if (p - a).dot(&f.across(k)) > SLACK * size {
            outside = true;
            let foot = a + e * ((p - a).dot(&e) / e.norm_squared()).clamp(0.0, 1.0);
            let d = (p - foot).norm();
            if nearest.is_none_or(|n| d < n.1) {
                nearest = Some((foot, d));
            }
        }
    }
    let name = corner(2, 0);
    if !outside && height <= limit {
        let pa = p - f.n * height;
        room.points.push(Point { pa, pb: *p, n: f.n, gap: height, name });
    } else if let Some((pa, gap)) = nearest.filter(|(_, d)| *d <= limit && *d > 1e-12 * size) {
        let n = (p - pa) / gap;
        if t.admits(&n) {
            room.points.push(Point { pa, pb: *p, n, gap, name });
        }
    }
}
