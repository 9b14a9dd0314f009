//! Refines a nearly exact normal of curved cores to full accuracy: the local maximum of the separation.
//!
//! ```text
//! sep(n) = n · (p_B(n) − p_A(n)),   p the support points;   every n gives a lower bound of the distance
//! two corners or rims:    n free, gradient p_B − p_A perpendicular to n:     Newton
//! an edge or an axis e:   n(φ) perpendicular to e, sep'(φ) = n'(φ) · (p_B − p_A):  Newton between bounds, otherwise bisection
//! ```
//! All methods are tried, and the largest separation is the distance, so no case distinction is needed.

use crate::core::Placed;
use linkwork_multibody::spatial::Vec3;

/// Edges are tried if the sine of their angle to the plane perpendicular to n is below this.
const NEAR: f64 = 0.05;
/// Largest rotation of n about an edge, rad.
const TURN: f64 = 0.1;

fn between(a: &Placed, b: &Placed, n: &Vec3) -> Vec3 {
    b.support(&-n) - a.support(n)
}

/// Returns a normal from A to B near `n`, and the separation along it, which is at least that of `n`.
pub(crate) fn polish(a: &Placed, b: &Placed, n: &Vec3) -> (Vec3, f64) {
    let value = |n: &Vec3| n.dot(&between(a, b, n));
    let mut best = (*n, value(n));
    let mut offer = |n: Option<Vec3>| {
        if let Some(n) = n {
            let sep = value(&n);
            if sep > best.1 {
                best = (n, sep);
            }
        }
    };
    offer(free(a, b, n));
    for c in [a, b] {
        for e in c.core.edges() {
            let e = c.R * e;
            if e.dot(n).abs() < NEAR {
                offer(about(a, b, n, &e));
            }
        }
    }
    best
}

/// Returns two vectors perpendicular to n.
fn basis(n: &Vec3) -> (Vec3, Vec3) {
    let t = if n.x.abs() < 0.6 { Vec3::x() } else { Vec3::y() };
    let t = (t - n * n.dot(&t)).normalize();
    (t, n.cross(&t))
}

/// Returns the change of p_B − p_A when n changes by `step`.
fn between_rate(a: &Placed, b: &Placed, n: &Vec3, step: &Vec3) -> Vec3 {
    b.support_rate(&-n, &-step) - a.support_rate(n, step)
}

fn free(a: &Placed, b: &Placed, start: &Vec3) -> Option<Vec3> {
    let mut n = *start;
    for _ in 0..8 {
        let (t, u) = basis(&n);
        let d = between(a, b, &n);
        let (along, f) = (n.dot(&d), (t.dot(&d), u.dot(&d)));
        let (dt, du) = (between_rate(a, b, &n, &t), between_rate(a, b, &n, &u));
        let (j11, j21) = (t.dot(&dt) - along, u.dot(&dt));
        let (j12, j22) = (t.dot(&du), u.dot(&du) - along);
        let det = j11 * j22 - j12 * j21;
        let (s, r) = ((j12 * f.1 - j22 * f.0) / det, (j21 * f.0 - j11 * f.1) / det);
        let step = (s * s + r * r).sqrt();
        if !(step < TURN) {
            return None;
        }
        n = (n + t * s + u * r).normalize();
        // Convergence is quadratic, so a further step would be below round-off.
        if step < 1e-9 {
            break;
        }
    }
    Some(n)
}

fn about(a: &Placed, b: &Placed, start: &Vec3, e: &Vec3) -> Option<Vec3> {
    let n0 = (start - e * e.dot(start)).normalize();
    let side = e.cross(&n0);
    // Computes n, n' and sep'.
    let slope = |phi: f64| {
        let (sin, cos) = phi.sin_cos();
        let (n, turned) = (n0 * cos + side * sin, side * cos - n0 * sin);
        let d = between(a, b, &n);
        (n, turned, turned.dot(&d), n.dot(&d))
    };
    let (mut lo, mut hi) = (-TURN, TURN);
    let (flo, fhi) = (slope(lo).2, slope(hi).2);
    if !(flo > 0.0 && fhi < 0.0) {
        return None;
    }
    // Round-off of the positions causes this error of f; it affects sep only in second order.
    let end = 1e-15 * (flo - fhi);
    let mut phi = 0.0;
    let mut best = n0;
    // Where two support points have the same distance, sep has a kink. The normal there is already among the
    // candidates, so it need not be found again.
    for _ in 0..12 {
        let (n, turned, f, sep) = slope(phi);
        best = n;
        if f.abs() <= end || hi - lo < 1e-15 {
            break;
        }
        if f > 0.0 {
            lo = phi;
        } else {
            hi = phi;
        }
        let curve = turned.dot(&between_rate(a, b, &n, &turned)) - sep;
        let next = phi - f / curve;
        let within = next > lo && next < hi;
        if within && (next - phi).abs() < 1e-12 {
            // Convergence is quadratic here, so the next value is exact up to round-off.
            best = slope(next).0;
            break;
        }
        phi = if within { next } else { 0.5 * (lo + hi) };
    }
    Some(best)
}
