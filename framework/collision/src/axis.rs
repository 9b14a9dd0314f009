//! Separating axis of two convex cores: the normal of largest distance, or of smallest penetration depth.
//!
//! ```text
//! candidates: normals of faces of A, of B, products of edges     (complete for points, segments, overlapping polytopes)
//! separated:  the nearest points by Gilbert, Johnson and Keerthi on A − B
//! overlap:    of a cylinder or an ellipsoid: expanding polytopes (parry)
//! ```
//! If the separations differ by less than [`BIAS`], a face takes precedence over an edge, and A over B, so that a resting contact keeps its face.

use crate::convert::{from_parry, magnitudes, to_parry};
use crate::core::{Core, Placed, Poly};
use linkwork_multibody::spatial::Vec3;
use parry3d_f64::math::{Pose as ParryPose, Vector};
use parry3d_f64::query::epa::EPA;
use parry3d_f64::query::gjk::{CsoPoint, VoronoiSimplex};
use parry3d_f64::shape::SupportMap;

/// Relative to the size of the pair.
pub(crate) const BIAS: f64 = 1e-5;
/// Maximum number of edge products; with more, expanding polytopes are used.
const PRODUCTS: usize = 600;

/// Origin of a normal.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Source {
    /// A face of one of the cores.
    Face,
    /// Edges, or a curved surface.
    Other,
}

/// A unit normal from A to B and the separation along it.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Axis {
    /// Unit vector from A to B.
    pub n: Vec3,
    /// Separation, m.
    pub sep: f64,
    /// Origin of the normal.
    pub source: Source,
}

/// Returns true if the candidates alone determine the penetration depth.
pub(crate) fn complete(a: &Core, b: &Core) -> bool {
    !round(a) && !round(b) && few(a, b)
}

/// Returns true if a core is curved.
pub(crate) fn round(c: &Core) -> bool {
    matches!(c, Core::Cylinder { .. } | Core::Ellipsoid { .. })
}

fn few(a: &Core, b: &Core) -> bool {
    a.edges().len() * b.edges().len() <= PRODUCTS
}

/// Returns the best candidate; `None` when one of them shows a separation above `limit`.
pub(crate) fn best(a: &Placed, b: &Placed, limit: f64, bias: f64) -> Option<Axis> {
    if let (Core::Poly(Poly { half: Some(ha), .. }), Core::Poly(Poly { half: Some(hb), .. })) =
        (a.core, b.core)
    {
        return boxes(a, b, ha, hb, limit, bias);
    }
    let mut best =
        Axis { n: direction(&(b.p - a.p)), sep: f64::NEG_INFINITY, source: Source::Other };
    let mut take = |n: Vec3, sep: f64, source: Source, lead: f64| {
        if sep > best.sep + lead {
            best = Axis { n, sep, source };
        }
        sep <= limit
    };
    let mut open = true;
    faces(a, &mut |n, top| open = open && take(n, b.range(&n).0 - top, Source::Face, 0.0));
    if !open {
        return None;
    }
    faces(b, &mut |n, top| open = open && take(-n, a.range(&n).0 - top, Source::Face, bias));
    if !open {
        return None;
    }
    let mut both = |n: Vec3| {
        let (ra, rb) = (a.range(&n), b.range(&n));
        take(n, rb.0 - ra.1, Source::Other, bias) && take(-n, ra.0 - rb.1, Source::Other, bias)
    };
    if few(a.core, b.core) {
        for e in a.core.edges() {
            let e = a.R * e;
            for f in b.core.edges() {
                let n = e.cross(&(b.R * f));
                let sine = n.norm();
                if sine > 1e-6 && !both(n / sine) {
                    return None;
                }
            }
        }
    }
    for (c, o) in [(a, b), (b, a)] {
        if let Core::Cylinder { .. } = c.core {
            let z = c.R.column(2).into_owned();
            let r = o.p - c.p;
            let r = r - z * z.dot(&r);
            let length = r.norm();
            if length > 1e-12 && !both(r / length) {
                return None;
            }
        }
    }
    let smooth = |c: &Placed| matches!(c.core, Core::Ellipsoid { .. });
    if (smooth(a) || smooth(b)) && !both(direction(&(b.p - a.p))) {
        return None;
    }
    Some(best)
}

/// Visits the normals of faces with the plane's offset along them.
fn faces(c: &Placed, visit: &mut impl FnMut(Vec3, f64)) {
    match c.core {
        Core::Poly(p) => {
            for f in &p.faces {
                let n = c.R * f.n;
                visit(n, f.n.dot(&p.vertices[p.ring[f.start as usize] as usize]) + n.dot(&c.p));
            }
        }
        Core::Cylinder { h, .. } => {
            for up in [1.0, -1.0] {
                let n = c.R.column(2) * up;
                visit(n, h + n.dot(&c.p));
            }
        }
        _ => {}
    }
}

/// Returns a unit vector along v; z if v has no direction.
pub(crate) fn direction(v: &Vec3) -> Vec3 {
    let length = v.norm();
    if length > 1e-300 { v / length } else { Vec3::z() }
}

/// Tests the fifteen axes of two boxes.
fn boxes(a: &Placed, b: &Placed, ha: &Vec3, hb: &Vec3, limit: f64, bias: f64) -> Option<Axis> {
    let C = a.R.tr_mul(&b.R);
    let t = a.R.tr_mul(&(b.p - a.p));
    let Q = magnitudes(&C);
    let along_b = C.tr_mul(&t);
    let (reach_b, reach_a) = (Q * hb, Q.tr_mul(ha));
    let (mut sep, mut which, mut sign) = (f64::NEG_INFINITY, 0, 1.0);
    for i in 0..3 {
        let s = t[i].abs() - ha[i] - reach_b[i];
        if s > sep {
            (sep, which, sign) = (s, i, 1f64.copysign(t[i]));
        }
    }
    if sep > limit {
        return None;
    }
    for i in 0..3 {
        let s = along_b[i].abs() - hb[i] - reach_a[i];
        if s > sep + bias {
            (sep, which, sign) = (s, 3 + i, 1f64.copysign(along_b[i]));
        }
    }
    if sep > limit {
        return None;
    }
    let mut product = None;
    for i in 0..3 {
        let (i1, i2) = ((i + 1) % 3, (i + 2) % 3);
        for j in 0..3 {
            let (j1, j2) = ((j + 1) % 3, (j + 2) % 3);
            let square = 1.0 - C[(i, j)] * C[(i, j)];
            if square < 1e-12 {
                continue;
            }
            // The product e_i × b_j in A's axes is 0 at i, −C(i2,j) at i1, and C(i1,j) at i2.
            let at = C[(i1, j)] * t[i2] - C[(i2, j)] * t[i1];
            let reach = ha[i1] * Q[(i2, j)]
                + ha[i2] * Q[(i1, j)]
                + hb[j1] * Q[(i, j2)]
                + hb[j2] * Q[(i, j1)];
            let s = (at.abs() - reach) / square.sqrt();
            if s > limit {
                return None;
            }
            if s > sep + bias {
                (sep, sign) = (s, 1f64.copysign(at) / square.sqrt());
                product = Some((i1, i2, j));
            }
        }
    }
    let (n, source) = match product {
        Some((i1, i2, j)) => {
            let mut n = Vec3::zeros();
            (n[i1], n[i2]) = (-C[(i2, j)] * sign, C[(i1, j)] * sign);
            (a.R * n, Source::Other)
        }
        None if which < 3 => (a.R.column(which) * sign, Source::Face),
        None => (b.R.column(which - 3) * sign, Source::Face),
    };
    Some(Axis { n, sep, source })
}

/// Result of the iteration on A − B.
pub(crate) enum Nearest {
    /// The separation is above the limit.
    Far,
    /// Points on A and B, the unit normal between them, the distance.
    Apart(Vec3, Vec3, Vec3, f64),
    /// The shapes overlap or touch; contains the best normal found during the iteration.
    Overlap(Vec3),
}

/// Returns the nearest points of two cores.
pub(crate) fn nearest(
    a: &Placed,
    b: &Placed,
    limit: f64,
    start: &Vec3,
    simplex: &mut VoronoiSimplex,
) -> Nearest {
    let probe = |d: &Vec3| (a.support(d), b.support(&-d));
    let put = |s: &(Vec3, Vec3)| CsoPoint::new(to_parry(&s.0), to_parry(&s.1));
    let first = probe(start);
    simplex.reset(put(&first));
    let mut proj = from_parry(simplex.project_origin_and_reduce());
    let scale = (first.0.norm()).max(first.1.norm()).max(proj.norm());
    let (mut lower, mut normal) = (-start.dot(&(first.0 - first.1)), *start);
    let mut points = first;
    let mut dist = proj.norm();
    for _ in 0..100 {
        if dist <= 1e-14 * scale {
            return Nearest::Overlap(normal);
        }
        let d = -proj / dist;
        let s = probe(&d);
        let bound = -d.dot(&(s.0 - s.1));
        if bound > lower {
            (lower, normal) = (bound, d);
        }
        if bound > limit {
            return Nearest::Far;
        }
        if dist - bound <= 1e-14 * dist || !simplex.add_point(put(&s)) {
            break;
        }
        let next = from_parry(simplex.project_origin_and_reduce());
        if simplex.dimension() == 3 && lower <= 0.0 {
            return Nearest::Overlap(normal);
        }
        // A flat tetrahedron may seem to contain the origin, so the separation of the last normal decides.
        if simplex.dimension() == 3 || !(next.norm() < dist) {
            break;
        }
        (proj, dist) = (next, next.norm());
        points = (0..=simplex.dimension()).fold((Vec3::zeros(), Vec3::zeros()), |(p, q), i| {
            let (c, w) = (simplex.point(i), simplex.proj_coord(i));
            (p + from_parry(c.orig1) * w, q + from_parry(c.orig2) * w)
        });
    }
    if lower <= 0.0 {
        return Nearest::Overlap(normal);
    }
    let n = if dist > 1e-7 * scale { -proj / dist } else { normal };
    Nearest::Apart(points.0, points.1, n, dist)
}

/// A core in the pair's frame, as a support map for parry.
struct Shim<'a>(Placed<'a>);

impl SupportMap for Shim<'_> {
    fn local_support_point(&self, d: Vector) -> Vector {
        to_parry(&self.0.support(&from_parry(d)))
    }
}

/// Returns the smallest penetration depth of overlapping cores: normal and distance (negative). The simplex is that of [`nearest`].
pub(crate) fn depth(
    a: &Placed,
    b: &Placed,
    simplex: &VoronoiSimplex,
    epa: &mut EPA,
) -> Option<(Vec3, f64)> {
    let (_, _, n) = epa.closest_points(&ParryPose::IDENTITY, &Shim(*a), &Shim(*b), simplex)?;
    let n = from_parry(n);
    let length = n.norm();
    if !(length > 0.5) {
        return None;
    }
    let n = n / length;
    let (ra, rb) = (a.range(&n), b.range(&n));
    let sep = rb.0 - ra.1;
    sep.is_finite().then_some((n, sep))
}
