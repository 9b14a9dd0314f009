//! First surface along a ray. Padding has no effect: a ray hits the shape itself.

use crate::colliders::Colliders;
use crate::core::{Core, Poly};
use crate::error::ShapeFault;
use crate::item::ColliderId;
use crate::pieces::{Piece, Pieces};
use crate::query::Query;
use crate::shape::{Shape, Visibility};
use crate::solid::{Kind, Solid};
use linkwork_multibody::BodyId;
use linkwork_multibody::spatial::{Pose, Vec3};
use std::cell::Cell;
use std::ops::ControlFlow;

/// A ray in the world.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ray {
    /// Origin, m.
    pub origin: Vec3,
    /// Direction; any length except zero.
    pub direction: Vec3,
    /// Maximum distance, m.
    pub max: f64,
}

/// Result of a ray.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RayHit {
    /// The collider.
    pub collider: ColliderId,
    /// Its body; `None` is the world.
    pub body: Option<BodyId>,
    /// Distance from the origin, m; 0 when the ray begins inside.
    pub distance: f64,
    /// Unit normal of the surface, against the ray, world. Opposite to the ray's direction when the ray begins inside.
    pub normal: Vec3,
}

impl Colliders {
    /// Returns the first collider along a ray among the shown colliders that `filter` accepts; at equal distance the first by name. Returns `None`
    /// also for a ray without a direction or with NaN. `query.margin` has no effect. O(n).
    pub fn cast_ray(
        &self,
        ray: &Ray,
        query: &Query,
        poses: impl Fn(Option<BodyId>) -> Pose,
        filter: impl Fn(ColliderId) -> bool,
    ) -> Option<RayHit> {
        let length = ray.direction.norm();
        let sane = length > 0.0 && length.is_finite() && ray.max >= 0.0;
        if !sane || !ray.origin.iter().all(|x| x.is_finite()) {
            return None;
        }
        let direction = ray.direction / length;
        let mut best: Option<RayHit> = None;
        for id in self.ids() {
            let hidden = query.hiding.map_or(self.spec(id).hidden, |h| h.of(id));
            let item = &self.items[id.index()];
            let Some(solid) = item.solid(query.detail) else { continue };
            if hidden == Visibility::Hidden || !filter(id) {
                continue;
            }
            let X_WC = poses(item.body) * item.pose;
            let back = X_WC.rotation.inverse();
            let (o, d) = (back * (ray.origin - X_WC.position), back * direction);
            let limit = best.map_or(ray.max, |b| b.distance);
            let hit = cast(solid, &o, &d, limit).filter(|(t, _)| *t <= limit);
            if let Some((distance, n)) = hit.filter(|(t, _)| best.is_none_or(|b| *t < b.distance)) {
                let normal = X_WC.transform_vector(&n);
                best = Some(RayHit { collider: id, body: item.body, distance, normal });
            }
        }
        best
    }
}

/// One shape in its own frame, prepared for many rays, without bodies and names.
#[derive(Debug)]
pub struct Target(Solid);

impl Target {
    /// Prepares a shape: the hull of points, the tree of a mesh.
    ///
    /// # Errors
    /// All faults of the shape.
    pub fn new(shape: &Shape) -> Result<Self, Vec<ShapeFault>> {
        Solid::new(shape).map(Self)
    }

    /// Returns the box around it in its own frame, m; infinite for an unbounded shape.
    #[must_use]
    pub fn bounds(&self) -> (Vec3, Vec3) {
        (self.0.lo, self.0.hi)
    }

    /// Returns the distance (m) along a ray in the shape's frame, at most `max`, and the unit normal against the ray there; `direction` must have
    /// unit length. When the ray begins inside a solid, the distance is 0 and the normal is `-direction`. Surfaces (meshes, height fields) have no
    /// inside and are hit from both sides.
    #[must_use]
    pub fn cast(&self, origin: &Vec3, direction: &Vec3, max: f64) -> Option<(f64, Vec3)> {
        cast(&self.0, origin, direction, max).filter(|(t, _)| *t <= max)
    }
}

/// Returns distance and normal in the shape's frame; d must have unit length.
fn cast(solid: &Solid, o: &Vec3, d: &Vec3, max: f64) -> Option<(f64, Vec3)> {
    match &solid.kind {
        Kind::HalfSpace => interval(o, d, &mut [(Vec3::z(), 0.0)].into_iter()),
        Kind::Surface(s) => s.cast(o, d, max),
        Kind::Pieces(p) => pieces(p, o, d, max),
        Kind::Convex { core: Core::Point, round } => sphere(o, d, *round, &Vec3::zeros()),
        Kind::Convex { core: Core::Poly(p), .. } => interval(o, d, &mut planes(p)),
        Kind::Convex { core: Core::Cylinder { r, h }, .. } => cylinder(o, d, *r, *h),
        Kind::Convex { core: Core::Segment { h }, round } => capsule(o, d, *round, *h),
        Kind::Convex { core: Core::Ellipsoid { half }, .. } => ellipsoid(o, d, half),
    }
}

/// Returns the first of the pieces; a sphere with zero radius is not hit.
fn pieces(p: &Pieces, o: &Vec3, d: &Vec3, max: f64) -> Option<(f64, Vec3)> {
    let mut best: Option<(f64, Vec3)> = None;
    let longest = Cell::new(max);
    let end = |x: f64, d: f64| if d == 0.0 { x } else { x + d * max };
    let other = Vec3::from_fn(|i, _| end(o[i], d[i]));
    let room = 1e-12 * o.amax();
    let off = |lo: &Vec3, hi: &Vec3| {
        let sides = (0..3)
            .flat_map(|k| [(Vec3::ith(k, 1.0), hi[k] + room), (Vec3::ith(k, -1.0), room - lo[k])]);
        interval(o, d, &mut { sides }).is_none_or(|(t, _)| t > longest.get() + room)
    };
    let each = |piece: &Piece| {
        let hit = match p.core() {
            Core::Poly(cube) => interval(&(o - piece.centre), d, &mut planes(cube)),
            _ if piece.round > 0.0 => sphere(o, d, piece.round, &piece.centre),
            _ => None,
        };
        if let Some(hit) = hit.filter(|(t, _)| *t <= max && best.is_none_or(|b| *t < b.0)) {
            best = Some(hit);
            longest.set(hit.0);
        }
        ControlFlow::Continue(())
    };
    let _ = p.visit(&o.inf(&other).add_scalar(-room), &o.sup(&other).add_scalar(room), off, each);
    best
}

fn planes(p: &Poly) -> impl Iterator<Item = (Vec3, f64)> + '_ {
    p.faces.iter().map(|f| (f.n, f.n.dot(&p.vertices[p.ring[f.start as usize] as usize])))
}

/// Returns the hit of a ray that begins inside.
fn inside(d: &Vec3) -> Option<(f64, Vec3)> {
    Some((0.0, -d))
}

/// Intersects a ray with the solid behind all planes n · x ≤ c.
fn interval(
    o: &Vec3,
    d: &Vec3,
    planes: &mut impl Iterator<Item = (Vec3, f64)>,
) -> Option<(f64, Vec3)> {
    let (mut enter, mut leave, mut normal) = (f64::NEG_INFINITY, f64::INFINITY, -d);
    for (n, c) in planes {
        let (height, rate) = (n.dot(o) - c, n.dot(d));
        if rate == 0.0 {
            if height > 0.0 {
                return None;
            }
            continue;
        }
        let t = -height / rate;
        if rate > 0.0 {
            leave = leave.min(t);
        } else if t > enter {
            (enter, normal) = (t, n);
        }
    }
    match () {
        () if enter > leave || leave < 0.0 => None,
        () if enter < 0.0 => inside(d),
        () => Some((enter, normal)),
    }
}

fn sphere(o: &Vec3, d: &Vec3, r: f64, centre: &Vec3) -> Option<(f64, Vec3)> {
    let p = o - centre;
    if p.norm() < r {
        return inside(d);
    }
    let along = p.dot(d);
    let off = (p - d * along).norm_squared(); // square of the distance from the centre to the line
    let t = -along - (r * r - off).max(0.0).sqrt();
    (off <= r * r && t >= 0.0).then(|| (t, (p + d * t) / r))
}

/// Intersects a unit sphere in coordinates divided by the half axes; the distance along the ray does not change.
fn ellipsoid(o: &Vec3, d: &Vec3, half: &Vec3) -> Option<(f64, Vec3)> {
    let (p, e) = (o.component_div(half), d.component_div(half));
    if p.norm() < 1.0 {
        return inside(d);
    }
    let (square, along) = (e.norm_squared(), p.dot(&e));
    let off = (p - e * (along / square)).norm_squared();
    let t = (-along - (square * (1.0 - off)).max(0.0).sqrt()) / square;
    (off <= 1.0 && t >= 0.0).then(|| (t, (p + e * t).component_div(half).normalize()))
}

/// Returns the interval in which a ray is within r of the z axis: first and last distance.
fn tube(o: &Vec3, d: &Vec3, r: f64) -> Option<(f64, f64)> {
    let (a, b, c) = (d.x * d.x + d.y * d.y, o.x * d.x + o.y * d.y, o.x * o.x + o.y * o.y - r * r);
    if a < 1e-24 {
        return (c <= 0.0).then_some((f64::NEG_INFINITY, f64::INFINITY));
    }
    let det = b * b - a * c;
    (det >= 0.0).then(|| ((-b - det.sqrt()) / a, (-b + det.sqrt()) / a))
}

fn radial(p: Vec3) -> Vec3 {
    Vec3::new(p.x, p.y, 0.0).normalize()
}

fn cylinder(o: &Vec3, d: &Vec3, r: f64, h: f64) -> Option<(f64, Vec3)> {
    let (side_in, side_out) = tube(o, d, r)?;
    let ends = [(Vec3::z(), h), (-Vec3::z(), h)];
    let (mut enter, mut leave, mut end) = (side_in, side_out, None);
    for (n, c) in ends {
        let (height, rate) = (n.dot(o) - c, n.dot(d));
        if rate == 0.0 {
            if height > 0.0 {
                return None;
            }
        } else if rate > 0.0 {
            leave = leave.min(-height / rate);
        } else if -height / rate > enter {
            (enter, end) = (-height / rate, Some(n));
        }
    }
    match () {
        () if enter > leave || leave < 0.0 => None,
        () if enter < 0.0 => inside(d),
        () => Some((enter, end.unwrap_or_else(|| radial(o + d * enter)))),
    }
}

fn capsule(o: &Vec3, d: &Vec3, r: f64, h: f64) -> Option<(f64, Vec3)> {
    let foot = Vec3::new(0.0, 0.0, o.z.clamp(-h, h));
    if (o - foot).norm() < r {
        return inside(d);
    }
    let mut best: Option<(f64, Vec3)> = None;
    let side = tube(o, d, r).map(|t| t.0).filter(|t| *t >= 0.0 && (o + d * *t).z.abs() <= h);
    let side = side.map(|t| (t, radial(o + d * t)));
    let caps = [-h, h].map(|z| sphere(o, d, r, &Vec3::new(0.0, 0.0, z)));
    for hit in [side, caps[0], caps[1]].into_iter().flatten() {
        if best.is_none_or(|b| hit.0 < b.0) {
            best = Some(hit);
        }
    }
    best
}
