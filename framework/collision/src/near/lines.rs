//! The point of a segment that is nearest to another segment, a box or a cylinder.
//!
//! ```text
//! segment          x(t) = p + t u, |t| ≤ h, u unit vector, in the axes of the other core
//! f(t) = ½ e·e     e(t) the vector from the nearest point of a box or a cylinder to x(t): convex, f' = e·u increases with t
//! box              f' is piecewise linear with six breaks, where a coordinate reaches a face: Newton's method ends on the right piece
//! cylinder         f' is curved where the segment passes beside it: Newton's method between bounds
//! ```
//! f is flat at its minimum, so an error of t affects the distance only in second order.

use super::Gap;
use crate::core::{Placed, beyond};
use linkwork_multibody::spatial::Vec3;

/// Maximum number of steps: a handful is usual, bisection needs sixty.
const MOST: usize = 100;

/// Returns the smallest of five distances: each of the four ends with the other segment, and the common perpendicular if it meets both.
pub(super) fn segments(a: &Placed, ha: f64, b: &Placed, hb: f64) -> Gap {
    let (u, v): (Vec3, Vec3) = (a.R.column(2).into_owned(), b.R.column(2).into_owned());
    let r = b.p - a.p;
    let (ru, rv, uv) = (r.dot(&u), r.dot(&v), u.dot(&v));
    let mut best = (0.0, 0.0, f64::INFINITY);
    let mut offer = |s: f64, t: f64| {
        let square = (r + v * t - u * s).norm_squared();
        if square < best.2 {
            best = (s, t, square);
        }
    };
    for t in [-hb, hb] {
        offer((ru + uv * t).clamp(-ha, ha), t);
    }
    for s in [-ha, ha] {
        offer(s, (uv * s - rv).clamp(-hb, hb));
    }
    // The cross product is accurate where the two segments are nearly parallel.
    let n = u.cross(&v);
    let square = n.norm_squared();
    let (s, t) = (r.cross(&v).dot(&n), r.cross(&u).dot(&n));
    if s.abs() < ha * square && t.abs() < hb * square {
        offer(s / square, t / square);
    }
    let (s, t, _) = best;
    Gap::new(a.p + u * s, r + v * t - u * s)
}

/// Computes the gap from a segment to a box.
pub(super) fn segment_box(a: &Placed, h: f64, b: &Placed, half: &Vec3) -> Gap {
    let z: Vec3 = a.R.column(2).into_owned();
    let (p, u) = (b.R.tr_mul(&(a.p - b.p)), b.R.tr_mul(&z));
    let squares = u.component_mul(&u);
    let outside = |t: f64| {
        let x = p + u * t;
        Vec3::new(beyond(x.x, half.x), beyond(x.y, half.y), beyond(x.z, half.z))
    };
    // The bounds have f' < 0 and f' > 0. At first there are none.
    let (mut lo, mut hi) = (-2.0 * h, 2.0 * h);
    let mut t = (-p.dot(&u)).clamp(-h, h);
    let mut e = outside(t);
    // Newton steps move from piece to piece of f' and end on the right one; they are always kept between the bounds.
    for _ in 0..MOST {
        let f = e.dot(&u);
        let part = |i: usize| if e[i] != 0.0 { squares[i] } else { 0.0 };
        let curve = part(0) + part(1) + part(2);
        if f * f <= 1e-30 * curve * e.norm_squared() {
            break;
        }
        if f < 0.0 {
            lo = t;
        } else {
            hi = t;
        }
        let next = (t - f / curve).clamp(-h, h);
        if next == t {
            break;
        }
        let inside = next > lo && next < hi;
        let next = if inside { next } else { 0.5 * (lo.max(-h) + hi.min(h)) };
        t = next;
        e = outside(t);
    }
    Gap::new(a.p + z * t, -(b.R * e))
}

/// Computes the gap from a segment to a cylinder with radius r and half height `height`.
pub(super) fn segment_cylinder(a: &Placed, h: f64, b: &Placed, r: f64, height: f64) -> Gap {
    let z: Vec3 = a.R.column(2).into_owned();
    let (p, u) = (b.R.tr_mul(&(a.p - b.p)), b.R.tr_mul(&z));
    // The function returns the vector from the nearest point of the cylinder, f' and f''.
    let at = |t: f64| {
        let x = p + u * t;
        let s = (x.x * x.x + x.y * x.y).sqrt();
        let part = if s > r { 1.0 - r / s } else { 0.0 };
        let e = Vec3::new(x.x * part, x.y * part, beyond(x.z, height));
        let across = x.x * u.y - x.y * u.x;
        let turn = across * across;
        // f'' next to the cylinder is ρ'² + (1 − r/s) × the square of the tangential part of u; above it,
        // u_z².
        let beside = if s > r {
            let out = x.x * u.x + x.y * u.y;
            (out * out + part * turn) / (s * s)
        } else {
            0.0
        };
        let above = if e.z != 0.0 { u.z * u.z } else { 0.0 };
        (e, e.dot(&u), beside + above)
    };
    let (mut lo, mut hi) = (-h, h);
    let (first, last) = (at(lo), at(hi));
    let t = if first.1 >= 0.0 {
        lo
    } else if last.1 <= 0.0 {
        hi
    } else {
        // Start at the zero of the line through the derivatives at both ends.
        let mut t = lo + (hi - lo) * (first.1 / (first.1 - last.1));
        for _ in 0..MOST {
            let (e, f, curve) = at(t);
            if f < 0.0 {
                lo = t;
            } else {
                hi = t;
            }
            let next = t - f / curve;
            if !(next > lo && next < hi) {
                t = 0.5 * (lo + hi);
                if hi - lo <= 1e-16 * h {
                    break;
                }
                continue;
            }
            t = next;
            // A step this small changes e² by f²/f'', and the next one by the square of that.
            if f * f <= 1e-12 * curve * e.norm_squared() {
                break;
            }
        }
        t
    };
    Gap::new(a.p + z * t, -(b.R * at(t).0))
}
