//! The last digits of a normal where something round takes part: the greatest separation near a normal that is nearly right.
//!
//! ```text
//! sep(n) = n · (p_B(n) − p_A(n)),   p the support points;   every n gives a lower bound of the distance
//! two corners or rims:    n free, gradient p_B − p_A across n:               Newton
//! an edge or an axis e:   n(φ) across e, sep'(φ) = n'(φ) · (p_B − p_A):      regula falsi (Illinois)
//! ```
//! All are tried; the greatest is the distance, so that nothing has to be decided.

use crate::core::Placed;
use linkwork_multibody::spatial::Vec3;

/// Edges are tried while the sine of their angle to the plane across n is below this.
const NEAR: f64 = 0.05;
/// How far n may turn about an edge, rad.
const TURN: f64 = 0.1;

fn between(a: &Placed, b: &Placed, n: &Vec3) -> Vec3 {
    b.support(&-n) - a.support(n)
}

/// A normal from A to B near `n`, and the separation along it, at least that of `n`.
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

/// Two vectors across n.
fn basis(n: &Vec3) -> (Vec3, Vec3) {
    let t = if n.x.abs() < 0.6 { Vec3::x() } else { Vec3::y() };
    let t = (t - n * n.dot(&t)).normalize();
    (t, n.cross(&t))
}

fn free(a: &Placed, b: &Placed, start: &Vec3) -> Option<Vec3> {
    let mut n = *start;
    for _ in 0..8 {
        let (t, u) = basis(&n);
        let gradient = |n: &Vec3| {
            let d = between(a, b, n);
            let d = d - n * n.dot(&d);
            (t.dot(&d), u.dot(&d))
        };
        let h = 1e-6;
        let at = |s: f64, r: f64| gradient(&(n + t * s + u * r).normalize());
        let (f, ft, fu) = (gradient(&n), [at(h, 0.0), at(-h, 0.0)], [at(0.0, h), at(0.0, -h)]);
        let (j11, j21) = ((ft[0].0 - ft[1].0) / (2.0 * h), (ft[0].1 - ft[1].1) / (2.0 * h));
        let (j12, j22) = ((fu[0].0 - fu[1].0) / (2.0 * h), (fu[0].1 - fu[1].1) / (2.0 * h));
        let det = j11 * j22 - j12 * j21;
        let (s, r) = ((j12 * f.1 - j22 * f.0) / det, (j21 * f.0 - j11 * f.1) / det);
        let step = s.hypot(r);
        if !(step < TURN) {
            return None;
        }
        n = (n + t * s + u * r).normalize();
        if step < 1e-15 {
            break;
        }
    }
    Some(n)
}

fn about(a: &Placed, b: &Placed, start: &Vec3, e: &Vec3) -> Option<Vec3> {
    let n0 = (start - e * e.dot(start)).normalize();
    let side = e.cross(&n0);
    let turned = |phi: f64| n0 * phi.cos() + side * phi.sin();
    let slope = |phi: f64| (side * phi.cos() - n0 * phi.sin()).dot(&between(a, b, &turned(phi)));
    let (mut lo, mut hi) = (-TURN, TURN);
    let (mut flo, mut fhi) = (slope(lo), slope(hi));
    if !(flo > 0.0 && fhi < 0.0) {
        return None;
    }
    let mut kept = 0;
    for _ in 0..60 {
        let phi = (lo * fhi - hi * flo) / (fhi - flo);
        let f = slope(phi);
        if f > 0.0 {
            (lo, flo) = (phi, f);
            fhi *= if kept == 1 { 0.5 } else { 1.0 };
            kept = 1;
        } else {
            (hi, fhi) = (phi, f);
            flo *= if kept == 2 { 0.5 } else { 1.0 };
            kept = 2;
        }
        if f == 0.0 || hi - lo < 1e-15 {
            break;
        }
    }
    Some(turned(if flo < -fhi { lo } else { hi }))
}
