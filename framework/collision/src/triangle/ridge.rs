//! Normal of largest separation between a triangle and a core whose deepest point lies beyond a convex edge.
//!
//! ```text
//! over edge k:    n(φ) = m cos φ + t_k sin φ,  0 ≤ φ ≤ the largest admissible lean
//!                 sep(φ) = n · (p(n) − v_k),   sep'(φ) = n' · (p(n) − v_k),   sep'' = −sep + n' · ∂p/∂φ,   p the core's lowest point along n
//!                 sep' > 0 at the far end:     belongs to the neighbour
//!                 a line of the core and the edge cross where n is perpendicular to both: sep' jumps;  otherwise Newton between bounds
//! over a corner:  the core's nearest point to it
//! ```
//! If the contact point lies on the edge, no other normal has a larger separation: for any unit n, sep(n) ≤ n · (p − v), with p − v along n(φ), when
//! they are separated.

use super::{LEAN, Tile};
use crate::axis::{Axis, Source};
use crate::core::{Core, Corner, Placed};
use crate::edges::lines;
use crate::pairs::on_cylinder;
use crate::surface::Facet;
use linkwork_multibody::spatial::Vec3;

/// Returns the best admissible normal over the edges and corners that the core's lowest point is `beyond`, by `out`, if there is one. The point is
/// `sep` above the plane. `None`: undecided.
pub(super) fn ridge(
    t: &Tile,
    b: &Placed,
    sides: &[Vec3; 3],
    out: &[f64; 3],
    (sep, limit, slack): (f64, f64, f64),
) -> Option<Option<Axis>> {
    let f = &t.facet;
    let mut best: Option<Axis> = None;
    let mut offer = |n: Vec3, sep: f64| {
        if best.is_none_or(|b| sep > b.sep) && t.admits(&n) {
            best = Some(Axis { n, sep, source: Source::Other });
        }
    };
    for k in 0..3 {
        // The lowest point is not outside of this edge.
        if out[k] <= 0.0 {
            continue;
        }
        let lean = t.lean(k, &sides[k]);
        if lean * b.core.radius() <= 0.5 * slack && lean <= 0.5 * LEAN {
            // The core is outside of a flat or concave edge and below it. Its corners may belong to
            // convex edges.
            if sep < -slack {
                matches!(b.core, Core::Cylinder { .. }).then_some(())?;
            }
            continue;
        }
        match *b.core {
            Core::Segment { h } => {
                let (n, sep) = segment(f, k, b, h)?;
                offer(n, sep);
            }
            Core::Cylinder { r, h } => {
                let w = Wheel { c: b.p, z: b.R.column(2).into_owned(), r, h };
                if let Some(s) = w.over_edge(&f.n, &sides[k], &f.v[k], (out[k], sep), lean)? {
                    let e = f.v[(k + 1) % 3] - f.v[k];
                    if (0.0..=e.norm_squared()).contains(&(s.p - f.v[k]).dot(&e)) {
                        offer(s.n, s.sep);
                    }
                }
            }
            _ => return None,
        }
    }
    if let Core::Cylinder { r, h } = *b.core {
        let z = b.R.column(2);
        for k in 0..3 {
            let d = f.v[k] - b.p;
            let along = d.dot(&z);
            let far = d.norm_squared() - along * along > (r + limit) * (r + limit);
            if far || along.abs() > h + limit {
                continue;
            }
            let (_, n, gap) = on_cylinder(b, r, h, &f.v[k]);
            let within = |o: usize| n.dot(&(f.v[(k + o) % 3] - f.v[k])) >= 0.0;
            if within(1) && within(2) {
                offer(-n, gap);
            } else if gap < 0.0 {
                return None;
            }
        }
    }
    Some(best)
}

/// Returns the normal of a separate segment over edge k; `None` when its nearest point of the triangle is elsewhere.
fn segment(f: &Facet, k: usize, b: &Placed, h: f64) -> Option<(Vec3, f64)> {
    let z = b.R.column(2).into_owned();
    let end = |p: Vec3| Corner { p, name: 0, edge: 0 };
    let (ea, eb) = ([end(f.v[k]), end(f.v[(k + 1) % 3])], [end(b.p - z * h), end(b.p + z * h)]);
    let (s, t) = lines(&ea, &eb);
    let (pa, p) = (ea[0].p.lerp(&ea[1].p, s), eb[0].p.lerp(&eb[1].p, t));
    let d = p - pa;
    let sep = d.norm();
    let n = d / sep;
    (sep > 1e-9 * h && lower(f, b, &n) >= sep - 1e-13 * h).then_some((n, sep))
}

/// Returns the separation of a triangle and a core along a normal, which is a lower bound of their distance.
fn lower(f: &Facet, b: &Placed, n: &Vec3) -> f64 {
    let top = f.v.iter().fold(f64::NEG_INFINITY, |m, v| m.max(v.dot(n)));
    b.range(n).0 - top
}

/// Returns whether a triangle and a core are proven separate. `None`: undecided.
pub(super) fn apart(f: &Facet, b: &Placed) -> Option<bool> {
    let Core::Cylinder { r, h } = *b.core else { return None };
    let mut p = b.p;
    for _ in 0..4 {
        let (foot, n, gap) = on_cylinder(b, r, h, &nearest(f, &p));
        if gap <= 0.0 {
            return Some(false);
        }
        if lower(f, b, &-n) > 0.0 {
            return Some(true);
        }
        p = foot;
    }
    None
}

/// Returns the point of a triangle nearest to p.
fn nearest(f: &Facet, p: &Vec3) -> Vec3 {
    let mut best: Option<(Vec3, f64)> = None;
    for k in 0..3 {
        let (a, e) = (f.v[k], f.v[(k + 1) % 3] - f.v[k]);
        if (p - a).dot(&e.cross(&f.n)) > 0.0 {
            let foot = a + e * ((p - a).dot(&e) / e.norm_squared()).clamp(0.0, 1.0);
            let d = (p - foot).norm_squared();
            if best.is_none_or(|b| d < b.1) {
                best = Some((foot, d));
            }
        }
    }
    best.map_or_else(|| p - f.n * (p - f.v[0]).dot(&f.n), |b| b.0)
}

/// A cylinder: centre, axis, radius, half length.
struct Wheel {
    c: Vec3,
    z: Vec3,
    r: f64,
    h: f64,
}

/// sep and its derivatives at one normal.
struct Slope {
    n: Vec3,
    p: Vec3,
    sep: f64,
    first: f64,
    second: f64,
}

impl Wheel {
    /// Evaluates sep and its derivatives at n(φ), with the lower end at `end` (±1) of the axis.
    fn slope(&self, (m, t, v): (&Vec3, &Vec3, &Vec3), (sin, cos): (f64, f64), end: f64) -> Slope {
        let (n, turned) = (m * cos + t * sin, t * cos - m * sin);
        let w = n - self.z * self.z.dot(&n);
        let l = w.norm();
        // The lowest point along the axis is not unique, so NaN makes the search fail.
        let u = if l > 1e-4 { w / l } else { Vec3::repeat(f64::NAN) };
        let p = self.c + self.z * (self.h * end) - u * self.r;
        let d = p - v;
        let along = turned.dot(&self.z.cross(&u));
        let sep = n.dot(&d);
        let second = -sep - self.r * along * along / l;
        Slope { n, p, sep, first: turned.dot(&d), second }
    }

    /// Returns the normal of largest separation over an edge at v that leans by at most `lean`, if it is not beyond that; `first` and `sep` are those
    /// of m. `None`: undecided.
    fn over_edge(
        &self,
        m: &Vec3,
        t: &Vec3,
        v: &Vec3,
        (first, sep): (f64, f64),
        lean: f64,
    ) -> Option<Option<Slope>> {
        let frame = (m, t, v);
        let sin = (lean + LEAN).min(1.0);
        let far = (sin, if sin < 1.0 { (1.0 - sin * sin).sqrt() } else { -LEAN });
        let end = |(sin, cos): (f64, f64)| -> f64 {
            if m.dot(&self.z) * cos + t.dot(&self.z) * sin > 0.0 { -1.0 } else { 1.0 }
        };
        let ends = [end((0.0, 1.0)), end(far)];
        let last = self.slope(frame, far, ends[1]);
        if !(last.first <= 0.0) {
            // While the solids overlap, sep' may increase again, but not faster than the overlap
            // permits.
            let sure = last.sep >= 0.0 || last.first > -4.0 * sep * sin;
            return sure.then_some(None);
        }
        let (mut lo, mut hi, mut side) = ((0.0, first), (far.0.atan2(far.1), last.first), ends[1]);
        if ends[0] != ends[1] {
            // Here n is perpendicular to the axis, so a line on the side of the cylinder is lowest.
            let (x, y) = (t.dot(&self.z), -m.dot(&self.z));
            let turn = if y < 0.0 { (-y).atan2(-x) } else { y.atan2(x) };
            let at = turn.sin_cos();
            let [before, after] = ends.map(|e| self.slope(frame, at, e));
            if before.first > 0.0 && after.first < 0.0 {
                let s = before.first / (before.first - after.first);
                return Some(Some(Slope { p: before.p.lerp(&after.p, s), ..before }));
            }
            if before.first > 0.0 {
                lo = (turn, after.first);
            } else {
                (hi, side) = ((turn, before.first), ends[0]);
            }
        }
        let mut phi = lo.0 + (hi.0 - lo.0) * lo.1 / (lo.1 - hi.1);
        for _ in 0..16 {
            let s = self.slope(frame, phi.sin_cos(), side);
            if s.first > 0.0 {
                lo.0 = phi
            } else {
                hi.0 = phi
            }
            let next = phi - s.first / s.second;
            let step = (next - phi).abs();
            if step < 1e-8 {
                // Convergence is quadratic here, so the next value is exact up to round-off.
                return Some(Some(self.slope(frame, next.sin_cos(), side)));
            }
            phi = if next > lo.0 && next < hi.0 { next } else { 0.5 * (lo.0 + hi.0) };
        }
        None
    }
}
