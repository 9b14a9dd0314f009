//! Nearest points of any two cores by the iteration of Gilbert, Johnson and Keerthi (GJK) on A − B.
//!
//! ```text
//! v      the point of a simplex in A − B nearest to the origin     |v| is an upper bound of the distance
//! w      the support point of A − B along −v                        v·w / |v| is a lower bound
//! ```
//! Each w joins the simplex; only the corners around v are kept. With flat sides the iteration ends at a corner that is already in the simplex, and
//! the result is exact up to round-off. With curved sides both bounds converge.

use super::Gap;
use crate::core::{Core, Placed, Poly};
use linkwork_multibody::spatial::Vec3;

/// Result of the iteration.
#[derive(Clone, Copy, Debug)]
pub(super) enum End {
    /// The separation is above the limit.
    Far,
    /// The distance is not above `enough`.
    Within,
    /// Nearest points, and the distance that their normal proves, m.
    Apart(Gap, f64),
    /// Round-off prevents a decision.
    Lost,
}

/// A core with its axes in the frame of the pair, prepared for support points.
enum Form<'a> {
    Point,
    /// Half of the segment.
    Segment(Vec3),
    /// Half edges.
    Box([Vec3; 3]),
    /// Axis, radius, half height.
    Cylinder(Vec3, f64, f64),
    Ellipsoid(&'a Placed<'a>),
    Hull(&'a Placed<'a>, &'a [Vec3]),
}

impl<'a> Form<'a> {
    fn of(x: &'a Placed<'a>) -> Self {
        let axis = |k: usize| -> Vec3 { x.R.column(k).into_owned() };
        match x.core {
            Core::Point => Form::Point,
            Core::Segment { h } => Form::Segment(axis(2) * *h),
            Core::Cylinder { r, h } => Form::Cylinder(axis(2), *r, *h),
            Core::Ellipsoid { .. } => Form::Ellipsoid(x),
            Core::Poly(Poly { half: Some(half), .. }) => {
                Form::Box([axis(0) * half.x, axis(1) * half.y, axis(2) * half.z])
            }
            Core::Poly(p) => Form::Hull(x, &p.vertices),
        }
    }

    /// Returns the support point along d, of any length, relative to the core's origin.
    #[inline(always)]
    fn support(&self, d: &Vec3) -> Vec3 {
        let signed = |c: &Vec3| c * 1f64.copysign(c.dot(d));
        match self {
            Form::Point => Vec3::zeros(),
            Form::Segment(z) => signed(z),
            Form::Box([x, y, z]) => signed(x) + signed(y) + signed(z),
            Form::Cylinder(z, r, h) => {
                let along = z.dot(d);
                let mut w = d - z * along;
                let mut s = w.norm_squared();
                if s < 1e-4 * d.norm_squared() {
                    // Orthogonalize to the axis again, because d is nearly parallel to it and w suffers from cancellation.
                    w -= z * z.dot(&w);
                    s = w.norm_squared();
                }
                let end = z * h.copysign(along);
                if s > 0.0 { end + w * (r / s.sqrt()) } else { end }
            }
            Form::Ellipsoid(x) => x.R * x.core.support(&x.R.tr_mul(d)),
            Form::Hull(x, vertices) => {
                let d = x.R.tr_mul(d);
                let (mut best, mut far) = (0, f64::NEG_INFINITY);
                for (i, v) in vertices.iter().enumerate() {
                    let along = v.dot(&d);
                    if along > far {
                        (best, far) = (i, along);
                    }
                }
                x.R * vertices[best]
            }
        }
    }
}

/// A corner of A − B and the point of A that it belongs to.
#[derive(Clone, Copy)]
struct Corner {
    w: Vec3,
    a: Vec3,
}

impl Corner {
    /// Returns the support point along d, relative to the origin of A.
    #[inline(always)]
    fn along(d: &Vec3, fa: &Form, fb: &Form, apart: &Vec3) -> Self {
        let a = fa.support(d);
        Self { w: a - fb.support(&-d) - apart, a }
    }
}

/// Up to four corners, with the weights of v.
struct Simplex {
    c: [Corner; 4],
    u: [f64; 4],
    n: usize,
}

/// Maximum number of steps; a dozen is already high.
const MOST: usize = 64;

/// Computes the nearest points of two cores. Ends early when the separation exceeds `limit`, or when it is at most `enough`.
pub(super) fn walk(a: &Placed, b: &Placed, limit: f64, enough: f64, start: &Vec3) -> End {
    let (fa, fb) = (Form::of(a), Form::of(b));
    let apart = b.p - a.p;
    let first = Corner::along(start, &fa, &fb, &apart);
    let mut s = Simplex { c: [first; 4], u: [1.0, 0.0, 0.0, 0.0], n: 1 };
    let mut v = first.w;
    let mut scale = v.norm();
    let mut square = v.norm_squared();
    let mut separate = false;
    let mut bound = f64::NEG_INFINITY;
    for _ in 0..MOST {
        let d = square.sqrt();
        if d <= 1e-14 * scale || d <= enough {
            // Compute the point from the weights, because v has fewer accurate digits for a narrow
            // triangle.
            let within = s.point().norm() <= enough.max(1e-13 * scale);
            return if within { End::Within } else { End::Lost };
        }
        let new = Corner::along(&-v, &fa, &fb, &apart);
        bound = v.dot(&new.w) / d;
        if bound > limit {
            return End::Far;
        }
        separate |= bound > 0.0;
        if d - bound <= 1e-14 * d || s.c[..s.n].iter().any(|c| c.w == new.w) {
            break;
        }
        scale = scale.max(new.w.norm());
        let before = (v, s.u, s.c, s.n);
        s.c[s.n] = new;
        s.n += 1;
        let Some(next) = s.nearest() else {
            // The origin is in a tetrahedron; a flat one may only seem to contain it.
            return if separate { End::Lost } else { End::Within };
        };
        let less = next.norm_squared();
        if !(less < square) {
            (v, s.u, s.c, s.n) = before;
            break;
        }
        (v, square) = (next, less);
    }
    if !(bound > 0.0) {
        return End::Lost;
    }
    s.weigh(&v);
    let pa = (1..s.n).fold(s.c[0].a * s.u[0], |p, i| p + s.c[i].a * s.u[i]);
    // Compute the vector from the weights, so that the end points lie between corners.
    End::Apart(Gap::new(a.p + pa, -s.point()), bound)
}

impl Simplex {
    /// Keeps these corners with these weights.
    #[inline(always)]
    fn keep<const N: usize>(&mut self, which: [usize; N], u: [f64; N]) {
        let c = which.map(|i| self.c[i]);
        self.c[..N].copy_from_slice(&c);
        self.u[..N].copy_from_slice(&u);
        self.n = N;
    }

    /// Returns its point nearest to the origin and keeps the corners around it; `None` when it contains the origin. The newest corner must be the
    /// last.
    fn nearest(&mut self) -> Option<Vec3> {
        match self.n {
            2 => Some(self.of_line([0, 1])),
            3 => Some(self.of_triangle([0, 1, 2])),
            _ => self.of_tetrahedron(),
        }
    }

    /// Returns the point given by the weights, which is not closer to the origin than A − B.
    fn point(&self) -> Vec3 {
        (1..self.n).fold(self.c[0].w * self.u[0], |p, i| p + self.c[i].w * self.u[i])
    }

    /// Recomputes the weights of v for three corners relative to v, which is more accurate for a narrow triangle.
    fn weigh(&mut self, v: &Vec3) {
        if self.n == 3 {
            let [p, q, r, _] = self.c.map(|c| c.w - v);
            let n = (q - p).cross(&(r - p));
            let u = [q.cross(&r), r.cross(&p), p.cross(&q)].map(|a| f64::max(a.dot(&n), 0.0));
            let total = u[0] + u[1] + u[2];
            self.u[..3].copy_from_slice(&u.map(|u| u / total));
        }
    }

    fn of_line(&mut self, [i, j]: [usize; 2]) -> Vec3 {
        let (p, q) = (self.c[i].w, self.c[j].w);
        let e = q - p;
        let (t, square) = (-p.dot(&e), e.norm_squared());
        if t <= 0.0 {
            self.keep([i], [1.0]);
            p
        } else if t >= square {
            self.keep([j], [1.0]);
            q
        } else {
            let t = t / square;
            self.keep([i, j], [1.0 - t, t]);
            p + e * t
        }
    }

    /// Tests the regions of a triangle's corners, edges and face (Ericson).
    fn of_triangle(&mut self, [i, j, k]: [usize; 3]) -> Vec3 {
        let (a, b, c) = (self.c[i].w, self.c[j].w, self.c[k].w);
        let (ab, ac) = (b - a, c - a);
        let (d1, d2) = (-ab.dot(&a), -ac.dot(&a));
        if d1 <= 0.0 && d2 <= 0.0 {
            self.keep([i], [1.0]);
            return a;
        }
        let (d3, d4) = (-ab.dot(&b), -ac.dot(&b));
        if d3 >= 0.0 && d4 <= d3 {
            self.keep([j], [1.0]);
            return b;
        }
        let (d5, d6) = (-ab.dot(&c), -ac.dot(&c));
        if d6 >= 0.0 && d5 <= d6 {
            self.keep([k], [1.0]);
            return c;
        }
        let vc = d1 * d4 - d3 * d2;
        if vc <= 0.0 && d1 >= 0.0 && d3 <= 0.0 {
            return self.of_line([i, j]);
        }
        let vb = d5 * d2 - d1 * d6;
        if vb <= 0.0 && d2 >= 0.0 && d6 <= 0.0 {
            return self.of_line([i, k]);
        }
        let va = d3 * d6 - d5 * d4;
        if va <= 0.0 && d4 >= d3 && d5 >= d6 {
            return self.of_line([j, k]);
        }
        let n = ab.cross(&ac);
        let (total, square) = (va + vb + vc, n.norm_squared());
        self.keep([i, j, k], [va / total, vb / total, vc / total]);
        n * (a.dot(&n) / square)
    }

    /// Tests the faces at the last corner. The origin cannot be outside the first face.
    fn of_tetrahedron(&mut self) -> Option<Vec3> {
        let [a, b, c, d] = self.c.map(|c| c.w);
        let outside = |p: &Vec3, q: &Vec3, other: &Vec3| {
            let n = (p - d).cross(&(q - d));
            (other - d).dot(&n) * d.dot(&n) >= 0.0
        };
        let faces = [
            (outside(&a, &b, &c), [0, 1, 3]),
            (outside(&b, &c, &a), [1, 2, 3]),
            (outside(&c, &a, &b), [2, 0, 3]),
        ];
        let all = self.c;
        let mut best: Option<(Vec3, f64, [Corner; 4], [f64; 4], usize)> = None;
        for (seen, face) in faces {
            if !seen {
                continue;
            }
            self.c = all;
            let v = self.of_triangle(face);
            let square = v.norm_squared();
            if best.as_ref().is_none_or(|b| square < b.1) {
                best = Some((v, square, self.c, self.u, self.n));
            }
        }
        let (v, _, c, u, n) = best?;
        (self.c, self.u, self.n) = (c, u, n);
        Some(v)
    }
}
