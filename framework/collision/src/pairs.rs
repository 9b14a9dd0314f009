//! Contact points of two solids of any kind, in the frame of the first.
//!
//! Spheres and capsules with each other, spheres with cylinders, and half spaces with all shapes have closed forms; all other pairs use
//! `manifold.rs`. For surfaces each triangle is a separate pair (`triangle/mod.rs`).

use crate::axis::direction;
use crate::contact_points::least;
use crate::contact_points::{Point, Room, corner};
use crate::core::{Core, Corner, Placed, mix};
use crate::edges::lines;
use crate::manifold::convex;
use crate::near::within;
use crate::pieces::points::{with_core, with_other, with_pieces};
use crate::solid::{Kind, Solid};
use crate::surface::Surface;
use crate::triangle::{Tile, one_triangle};
use linkwork_multibody::spatial::{Pose, Vec3};

/// Parameters of a query for one pair.
#[derive(Clone, Copy)]
pub(crate) struct PairQuery {
    /// Largest gap, after subtraction of the padding, m.
    pub margin: f64,
    /// Padding of the first and the second, m.
    pub padding: [f64; 2],
    /// Length to which tolerances are relative, m.
    pub size: f64,
    /// Required points of solids with many pieces.
    pub want: Want,
}

/// Required points of a solid with many pieces.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Want {
    /// The points of all pieces.
    All,
    /// Only the deepest point.
    Least,
}

/// Computes the contact points of `a` at the origin and `b` at `X_AB` into `room.points`, including their radii and padding.
pub(crate) fn pair(a: &Solid, b: &Solid, X_AB: &Pose, ask: &PairQuery, room: &mut Room) {
    room.points.clear();
    let round = |s: &Solid| if let Kind::Convex { round, .. } = &s.kind { *round } else { 0.0 };
    let thick = [round(a) + ask.padding[0], round(b) + ask.padding[1]];
    room.behind = thick[0] + thick[1];
    let limit = ask.margin + room.behind;
    if rank(&a.kind) > rank(&b.kind) {
        // Exchange the two solids so that A is the simpler kind.
        let X_BA = X_AB.inverse();
        cores(b, a, &X_BA, limit, ask, room);
        room.points.iter_mut().for_each(|p| *p = p.swapped(X_AB));
    } else {
        cores(a, b, X_AB, limit, ask, room);
    }
    for p in &mut room.points {
        p.pa += p.n * thick[0];
        p.pb -= p.n * thick[1];
        p.gap -= thick[0] + thick[1];
    }
}

/// Returns the order of the kinds: half spaces, surfaces, convex solids, solids of pieces.
fn rank(kind: &Kind) -> u8 {
    match kind {
        Kind::HalfSpace => 0,
        Kind::Surface(_) => 1,
        Kind::Convex { .. } => 2,
        Kind::Pieces(_) => 3,
    }
}

fn cores(a: &Solid, b: &Solid, X_AB: &Pose, limit: f64, ask: &PairQuery, room: &mut Room) {
    let PairQuery { size, want, .. } = *ask;
    match (&a.kind, &b.kind) {
        (Kind::HalfSpace, Kind::Convex { core, .. }) => {
            half_space(&Placed::at(core, X_AB), limit, size, room);
        }
        (Kind::HalfSpace, Kind::Surface(s)) => {
            for (name, v) in s.vertices() {
                let pb = X_AB.transform_point(&v);
                if pb.z <= limit {
                    push_plane(pb, corner(2, name), room);
                    keep_wanted(want, room);
                }
            }
        }
        (Kind::Surface(s), Kind::Convex { core, .. }) => {
            surface(s, &Placed::at(core, X_AB), (limit, size, want), room);
        }
        (Kind::Surface(s), Kind::Surface(t)) => {
            surfaces(s, t, X_AB, (limit, size, want), room);
        }
        (Kind::Convex { core: a, .. }, Kind::Convex { core: b, .. }) => {
            two_cores(&Placed::here(a), &Placed::at(b, X_AB), limit, size, room);
        }
        (Kind::HalfSpace, Kind::Pieces(p)) => {
            let far = Vec3::repeat(f64::INFINITY);
            let below = (-far, Vec3::new(far.x, far.y, 0.0));
            with_other(below, p, X_AB, (limit, size, want), room, half_space);
        }
        (Kind::Surface(s), Kind::Pieces(p)) => {
            let one = |b: &Placed, limit: f64, size: f64, room: &mut Room| {
                surface(s, b, (limit, size, want), room);
            };
            with_other(s.bounds(), p, X_AB, (limit, size, want), room, one);
        }
        (Kind::Convex { core, .. }, Kind::Pieces(p)) => {
            // Compute in the frame of the pieces and transform back.
            let X_BA = X_AB.inverse();
            with_core(&Placed::at(core, &X_BA), p, limit, size, want, room);
            for p in &mut room.points {
                (p.pa, p.pb) = (X_AB.transform_point(&p.pa), X_AB.transform_point(&p.pb));
                p.n = X_AB.transform_vector(&p.n);
            }
        }
        (Kind::Pieces(p), Kind::Pieces(q)) => {
            with_pieces(p, q, X_AB, limit, size, want, room);
        }
        _ => {}
    }
}

/// Returns true if two cores come within `limit` (not negative). If round-off prevents a decision, their contact points decide.
pub(crate) fn close(
    a: &Placed,
    b: &Placed,
    limit: f64,
    start: &Vec3,
    size: f64,
    room: &mut Room,
) -> bool {
    if let Some(close) = within(a, b, limit, start) {
        return close;
    }
    let from = room.points.len();
    two_cores(a, b, limit, size, room);
    let touch = least(&room.points[from..]) <= limit;
    room.points.truncate(from);
    touch
}

/// Appends the contact points of two cores.
pub(crate) fn two_cores(a: &Placed, b: &Placed, limit: f64, size: f64, room: &mut Room) {
    if !closed_form(a, b, limit, size, room) {
        convex(a, b, limit, size, room);
    }
}

fn push_plane(pb: Vec3, name: u64, room: &mut Room) {
    let pa = Vec3::new(pb.x, pb.y, 0.0);
    room.points.push(Point { pa, pb, n: Vec3::z(), gap: pb.z, name });
}

/// Appends the points of the half space z ≤ 0 and a core: the corners that face down, and the lowest point if it is not one of them.
fn half_space(b: &Placed, limit: f64, size: f64, room: &mut Room) {
    let down = -Vec3::z();
    let lowest = b.support(&down);
    if lowest.z > limit {
        return;
    }
    let mut list = std::mem::take(&mut room.corners);
    b.facing(&down, &mut list);
    for c in list.iter().filter(|c| c.p.z <= limit) {
        push_plane(c.p, corner(2, c.name), room);
    }
    room.corners = list;
    if least(&room.points) > lowest.z + 1e-9 * size {
        let name = if let Core::Poly(p) = b.core {
            let at = |v: &Vec3| (b.R * v + b.p - lowest).norm_squared();
            let nearest = (0..p.vertices.len())
                .min_by(|i, j| at(&p.vertices[*i]).total_cmp(&at(&p.vertices[*j])));
            nearest.map_or(0, |i| p.names[i])
        } else {
            19
        };
        push_plane(lowest, corner(2, name), room);
    }
}

/// Appends the points of point, segment and cylinder pairs with a closed form. Returns false for all other pairs.
fn closed_form(a: &Placed, b: &Placed, limit: f64, size: f64, room: &mut Room) -> bool {
    let name = |a: u64, b: u64| mix(4, mix(a, b));
    let mut push = |pa: Vec3, pb: Vec3, instead: Vec3, name: u64| {
        let d = pb - pa;
        let gap = d.norm();
        if gap <= limit {
            let n = if gap > 1e-12 * size { d / gap } else { instead };
            room.points.push(Point { pa, pb, n, gap, name });
        }
    };
    match (a.core, b.core) {
        (Core::Point, Core::Point) => push(a.p, b.p, Vec3::z(), name(0, 0)),
        (Core::Point, Core::Segment { h }) => {
            let (foot, n) = on_segment(b, *h, &a.p);
            push(a.p, foot, -n, name(0, 1));
        }
        (Core::Segment { h }, Core::Point) => {
            let (foot, n) = on_segment(a, *h, &b.p);
            push(foot, b.p, n, name(1, 0));
        }
        (Core::Segment { h: ha }, Core::Segment { h: hb }) => segments(a, *ha, b, *hb, &mut push),
        (Core::Cylinder { r, h }, Core::Point) => {
            let (pa, n, gap) = on_cylinder(a, *r, *h, &b.p);
            if gap <= limit {
                room.points.push(Point { pa, pb: b.p, n, gap, name: name(2, 0) });
            }
        }
        (Core::Point, Core::Cylinder { r, h }) => {
            let (pb, n, gap) = on_cylinder(b, *r, *h, &a.p);
            if gap <= limit {
                room.points.push(Point { pa: a.p, pb, n: -n, gap, name: name(0, 2) });
            }
        }
        _ => return false,
    }
    true
}

/// Returns the point of a segment nearest to p, and a direction perpendicular to the segment.
fn on_segment(s: &Placed, h: f64, p: &Vec3) -> (Vec3, Vec3) {
    let z = s.R.column(2).into_owned();
    (s.p + z * z.dot(&(p - s.p)).clamp(-h, h), s.R.column(0).into_owned())
}

/// Returns the point of a cylinder's surface nearest to p, the normal there, and the distance, negative inside.
pub(crate) fn on_cylinder(c: &Placed, r: f64, h: f64, p: &Vec3) -> (Vec3, Vec3, f64) {
    let q = c.R.tr_mul(&(p - c.p));
    let s = (q.x * q.x + q.y * q.y).sqrt();
    let u = if s > 1e-14 * r { Vec3::new(q.x / s, q.y / s, 0.0) } else { Vec3::x() };
    let up = Vec3::new(0.0, 0.0, 1f64.copysign(q.z));
    let (side, end) = (s - r, q.z.abs() - h);
    let (n, gap) = if side > 0.0 && end > 0.0 {
        let d = (side * side + end * end).sqrt();
        ((u * side + up * end) / d, d)
    } else if side > end {
        (u, side)
    } else {
        (up, end)
    };
    let n = c.R * n;
    (p - n * gap, n, gap)
}

/// Appends one point, or two where the segments are parallel.
fn segments(
    a: &Placed,
    ha: f64,
    b: &Placed,
    hb: f64,
    push: &mut impl FnMut(Vec3, Vec3, Vec3, u64),
) {
    let (u, v) = (a.R.column(2).into_owned(), b.R.column(2).into_owned());
    let cross = u.cross(&v);
    let across = if cross.norm() > 1e-9 { cross } else { a.R.column(0).into_owned() };
    let toward = across.dot(&(b.p - a.p));
    let instead = direction(&across) * 1f64.copysign(toward);
    if cross.norm() < 1e-3 {
        let (mid, half) = (u.dot(&(b.p - a.p)), hb * u.dot(&v).abs());
        let (low, high) = (f64::max(-ha, mid - half), f64::min(ha, mid + half));
        if high - low > 1e-3 * ha.min(hb) {
            for (t, end) in [(low, 0), (high, 1)] {
                let pa = a.p + u * t;
                push(pa, on_segment(b, hb, &pa).0, instead, mix(5, end));
            }
            return;
        }
    }
    let ends =
        |p: &Placed, d: &Vec3, h: f64| [-h, h].map(|h| Corner { p: p.p + d * h, name: 0, edge: 0 });
    let (ea, eb) = (ends(a, &u, ha), ends(b, &v, hb));
    let (s, t) = lines(&ea, &eb);
    push(ea[0].p + (ea[1].p - ea[0].p) * s, eb[0].p + (eb[1].p - eb[0].p) * t, instead, mix(5, 2));
}

/// If only the deepest point is required, keeps no other, so that the query needs memory for one triangle only.
fn keep_wanted(want: Want, room: &mut Room) {
    if want == Want::Least {
        room.deepest_alone();
    }
}

/// Appends the points of a surface and a core.
pub(crate) fn surface(
    s: &Surface,
    b: &Placed,
    (limit, size, want): (f64, f64, Want),
    room: &mut Room,
) {
    let reach = |i: usize, sign: f64| {
        let d = Vec3::ith(i, sign);
        b.support(&d)[i] + sign * limit
    };
    let corner_of = |sign| Vec3::new(reach(0, sign), reach(1, sign), reach(2, sign));
    let (lo, hi) = (corner_of(-1.0), corner_of(1.0));
    let mut list = std::mem::take(&mut room.list);
    let behind = room.behind;
    let meets_plane = |n: &Vec3, v: &Vec3| {
        let ((low, high), plane, length) = (b.range(n), n.dot(v), n.norm());
        low - plane <= limit * length && high - plane >= -behind * length
    };
    let keep = |n: &Vec3, v: &[Vec3; 3]| meets_plane(n, &v[0]) && !far(v, b, limit);
    s.near_if(&lo, &hi, |cell| far(cell, b, limit), keep, &mut list);
    for i in &list {
        one_triangle(&Tile::new(s, *i), b, limit, size, room);
        keep_wanted(want, room);
    }
    room.list = list;
    if room.points.is_empty() && s.is_terrain() {
        sunk(s, b, limit, room);
    }
}

/// Returns true if the direction from the nearest part of some corners to the core proves a separation above `limit`. This rejects most triangles
/// that their plane does not reject.
#[inline(always)]
fn far<const N: usize>(v: &[Vec3; N], b: &Placed, limit: f64) -> bool {
    let (mut lo, mut hi) = (v[0], v[0]);
    for v in &v[1..] {
        (lo, hi) = (lo.inf(v), hi.sup(v));
    }
    let n = b.toward(&b.p.sup(&lo).inf(&hi));
    let top = v.iter().map(|v| n.dot(v)).fold(f64::NEG_INFINITY, |m, x| if x > m { x } else { m });
    b.range(&n).0 - top > f64::max(limit * n.norm(), 0.0)
}

/// Appends the contact of a core far below the terrain: its lowest point against the triangle above it.
fn sunk(s: &Surface, b: &Placed, limit: f64, room: &mut Room) {
    let low = b.support(&-Vec3::z());
    let mut list = std::mem::take(&mut room.list);
    s.near(&low, &low, &mut list);
    for i in &list {
        let t = s.facet(*i);
        let gap = (low - t.v[0]).dot(&t.n);
        let over = (0..3).all(|k| {
            let out = (t.v[(k + 1) % 3] - t.v[k]).cross(&Vec3::z());
            (low - t.v[k]).dot(&out) <= 1e-12
        });
        if over && gap < limit.min(0.0) {
            room.points.push(Point { pa: low - t.n * gap, pb: low, n: t.n, gap, name: mix(6, 0) });
            break;
        }
    }
    room.list = list;
}

/// Appends the points of two surfaces; every triangle of the second is treated as a thin solid.
fn surfaces(
    s: &Surface,
    t: &Surface,
    X_AB: &Pose,
    (limit, size, want): (f64, f64, Want),
    room: &mut Room,
) {
    let X_BA = X_AB.inverse();
    let (lo, hi) = s.bounds();
    let lo = lo.map(|x| x.max(-1e12));
    let (mut low, mut high) = (Vec3::repeat(f64::INFINITY), Vec3::repeat(f64::NEG_INFINITY));
    for i in 0..8 {
        let pick = |k: usize| if i >> k & 1 == 1 { hi[k] } else { lo[k] };
        let v = X_BA.transform_point(&Vec3::new(pick(0), pick(1), pick(2)));
        (low, high) = (low.inf(&v), high.sup(&v));
    }
    let mut others = std::mem::take(&mut room.others);
    t.near(&low.add_scalar(-limit.abs()), &high.add_scalar(limit.abs()), &mut others);
    for i in &others {
        let Core::Poly(mut poly) = std::mem::replace(&mut room.second, Core::Point) else { break };
        t.facet(*i).write(&mut poly);
        let core = Core::Poly(poly);
        surface(s, &Placed::at(&core, X_AB), (limit, size, want), room);
        room.second = core;
    }
    room.others = others;
}
