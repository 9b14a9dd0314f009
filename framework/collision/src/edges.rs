//! Contact of two cores without a contact face: the point that determined the normal, or two points where edges are parallel.

use crate::axis::{Axis, BIAS};
use crate::contact_points::{OF_A, OF_B, Point, Room, corner, crossing};
use crate::core::{Core, Corner, Placed, edge_name};
use linkwork_multibody::spatial::Vec3;

/// Sine of the angle below which edges count as parallel.
const PARALLEL: f64 = 1e-3;

/// Returns one or two corners that are farthest along n, and their total number.
fn extreme(c: &Placed, n: &Vec3, room: f64) -> ([Corner; 2], usize) {
    let d = c.R.tr_mul(n);
    let none = Corner { p: Vec3::zeros(), name: 0, edge: 0 };
    let (mut found, mut count) = ([none; 2], 0);
    let mut put = |p: Vec3, name: u64| {
        if count < 2 {
            found[count] = Corner { p: c.R * p + c.p, name, edge: 0 };
        }
        count += 1;
    };
    match c.core {
        Core::Point => put(Vec3::zeros(), 0),
        Core::Ellipsoid { .. } => put(c.core.support(&d), 0),
        Core::Segment { h } | Core::Cylinder { h, .. } => {
            let top = c.core.support(&d);
            let level = 2.0 * h * d.z.abs() <= room;
            if let Core::Cylinder { r, .. } = c.core
                && 2.0 * r * d.x.hypot(d.y) <= room
            {
                (0..3).for_each(|_| put(Vec3::new(0.0, 0.0, h.copysign(d.z)), 18));
                return (found, count);
            }
            for (z, name) in [(-h, 16), (*h, 17)] {
                if level || z * d.z > 0.0 {
                    put(Vec3::new(top.x, top.y, z), name);
                }
            }
        }
        Core::Poly(p) => {
            let far = p.vertices.iter().fold(f64::NEG_INFINITY, |m, v| m.max(v.dot(&d)));
            for (v, name) in p.vertices.iter().zip(&p.names) {
                if v.dot(&d) >= far - room {
                    put(*v, *name);
                }
            }
        }
    }
    (found, count)
}

/// Returns the point that determined the normal, or two points where edges are parallel.
pub(crate) fn deepest(
    a: &Placed,
    b: &Placed,
    axis: &Axis,
    ends: Option<(Vec3, Vec3)>,
    size: f64,
    room: &mut Room,
) {
    let Axis { n, sep, .. } = *axis;
    let ((ea, na), (eb, nb)) = (extreme(a, &n, BIAS * size), extreme(b, &-n, BIAS * size));
    if na == 2 && nb == 2 && side_by_side(&ea, &eb, &n, size, room) {
        return;
    }
    let name = match (na, nb) {
        (1, _) => corner(OF_A, ea[0].name),
        (_, 1) => corner(OF_B, eb[0].name),
        _ => crossing(edge_name(ea[0].name, ea[1].name), edge_name(eb[0].name, eb[1].name)),
    };
    let (half, (s, t)) = (n * (sep / 2.0), lines(&ea, &eb));
    let crossing = (na, nb) == (2, 2) && [s, t].iter().all(|x| *x > 0.0 && *x < 1.0);
    let (pa, pb) = match (na, nb) {
        (1, _) => (ea[0].p, ea[0].p + n * sep),
        (_, 1) => (eb[0].p - n * sep, eb[0].p),
        _ => {
            let on_edges = || (ea[0].p.lerp(&ea[1].p, s) + eb[0].p.lerp(&eb[1].p, t)) / 2.0;
            let middle = match ends {
                Some((pa, pb)) if !crossing => (pa + pb) / 2.0,
                None if na > 2 => eb[0].p,
                None if nb > 2 => ea[0].p,
                _ => on_edges(),
            };
            (middle - half, middle + half)
        }
    };
    room.points.push(Point { pa, pb, n, gap: sep, name });
}

/// Returns the ends of the common segment of two parallel edges.
fn side_by_side(ea: &[Corner; 2], eb: &[Corner; 2], n: &Vec3, size: f64, room: &mut Room) -> bool {
    let (u, v) = (ea[1].p - ea[0].p, eb[1].p - eb[0].p);
    let length = u.norm();
    if u.cross(&v).norm() > PARALLEL * length * v.norm() {
        return false;
    }
    let along = |p: &Vec3| (p - ea[0].p).dot(&u) / (length * length);
    let flip = usize::from(along(&eb[0].p) > along(&eb[1].p));
    let (b0, b1) = (&eb[flip], &eb[1 - flip]);
    let (t0, t1) = (along(&b0.p), along(&b1.p));
    let low = if t0 > 0.0 { (t0, corner(OF_B, b0.name)) } else { (0.0, corner(OF_A, ea[0].name)) };
    let high = if t1 < 1.0 { (t1, corner(OF_B, b1.name)) } else { (1.0, corner(OF_A, ea[1].name)) };
    if (high.0 - low.0) * length < 1e-6 * size {
        return false;
    }
    for (t, name) in [low, high] {
        let pa = ea[0].p + u * t;
        let pb = b0.p + (b1.p - b0.p) * ((t - t0) / (t1 - t0));
        let gap = (pb - pa).dot(n);
        room.points.push(Point { pa, pb: pa + n * gap, n: *n, gap, name });
    }
    true
}

/// Returns the parameters of the nearest points of two edges.
pub(crate) fn lines(ea: &[Corner; 2], eb: &[Corner; 2]) -> (f64, f64) {
    let (u, v, w) = (ea[1].p - ea[0].p, eb[1].p - eb[0].p, ea[0].p - eb[0].p);
    let (uu, uv, vv, uw, vw) = (u.dot(&u), u.dot(&v), v.dot(&v), u.dot(&w), v.dot(&w));
    let det = uu * vv - uv * uv;
    let mut s =
        if det > 1e-14 * uu * vv { ((uv * vw - vv * uw) / det).clamp(0.0, 1.0) } else { 0.5 };
    let t = (uv * s + vw) / vv;
    let inside = t.clamp(0.0, 1.0);
    if t != inside {
        s = ((uv * inside - uw) / uu).clamp(0.0, 1.0);
    }
    (s, inside)
}
