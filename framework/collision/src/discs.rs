//! A cylinder as a row of thin discs, for rolling contact.
//!
//! A cylinder on a face has a contact line, represented by its two ends. On an edge it has the ends of the common segment while both are parallel,
//! and a single point otherwise. A force that is summed over such points is discontinuous. A thin disc touches a face, an edge or a corner at one
//! point, which moves continuously while the disc rolls over them. The contact of each disc of a wheel is computed separately.
//! ```text
//! n        from the nearest points of the other core and a disc of half the radius, which do not overlap; and from the candidates (axis.rs)
//! polish   the local maximum of sep(n) near each; the larger of both                          (polish.rs)
//! point    the support point of the disc along −n
//! ```
//! On a height field a disc touches the smooth surface through the heights ([`relief`](crate::relief)), as the wheel models do. Where an end of the
//! cylinder faces the other shape (the cylinder lies on its side), and on meshes, discs have the contact of a cylinder.

use crate::axis::{self, Nearest, Source};
use crate::contact_points::{Point, Room};
use crate::core::{Core, Placed, mix};
use crate::manifold::inset;
use crate::pairs::{PairQuery, pair};
use crate::polish::polish;
use crate::relief::{Disc, Relief};
use crate::shape::Shape;
use crate::solid::{Kind, Solid};
use crate::surface::Surface;
use linkwork_multibody::spatial::{Pose, Vec3};

/// Half of a disc's thickness, relative to its radius.
const THIN: f64 = 1e-3;
/// An end faces the other shape if the cosine is above this.
const ENDS: f64 = 0.98;
/// On the ground the disc lies on its side if the sine of the elevation of its axle is above this.
const UPRIGHT: f64 = 0.9;

/// The discs of one cylinder.
#[derive(Debug)]
pub(crate) struct Discs {
    /// One disc about its centre.
    solid: Solid,
    /// Radius, m.
    radius: f64,
    /// A disc of half the radius.
    inner: Core,
    /// Positions of the discs' centres on the cylinder's axis, m.
    places: Vec<f64>,
    /// Contact points of one disc that are closer than this are merged, m.
    near: f64,
}

/// Selects which collider of a pair is the cylinder with discs.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(crate) enum Rolls {
    First,
    Second,
}

impl Discs {
    /// Creates `count` discs, with the first and last at the ends; `None` when the shape is not a cylinder or the count is zero.
    pub(crate) fn new(shape: &Shape, count: u32) -> Option<Self> {
        let Shape::Cylinder { radius, half_length } = *shape else { return None };
        let half = THIN * radius;
        let solid = Solid::new(&Shape::Cylinder { radius, half_length: half }).ok()?;
        let reach = f64::max(half_length - half, 0.0);
        let places = match count {
            0 => return None,
            1 => vec![0.0],
            n => (0..n).map(|k| reach * (2.0 * f64::from(k) / f64::from(n - 1) - 1.0)).collect(),
        };
        let inner = Core::Cylinder { r: 0.5 * radius, h: half };
        Some(Self { solid, radius, inner, places, near: 3.0 * half })
    }

    /// Returns the positions of the discs on the cylinder's axis, m.
    pub(crate) fn places(&self) -> &[f64] {
        &self.places
    }

    /// Computes the contact points of the disc at `z` on its axis and another solid, as [`pair`] does; `X_AB` is the pose of the whole pair.
    pub(crate) fn touch(
        &self,
        (other, which, z): (&Solid, Rolls, f64),
        X_AB: &Pose,
        ask: &PairQuery,
        room: &mut Room,
    ) {
        let along = Pose::translation(0.0, 0.0, z);
        let X_disc = match which {
            // The result is the pose of the disc in the frame of the other solid.
            Rolls::First => X_AB.inverse() * along,
            Rolls::Second => *X_AB * along,
        };
        if let Kind::Surface(Surface::Grid(ground)) = &other.kind
            && self.on_ground(ground, &X_disc, ask, room)
        {
            if which == Rolls::First {
                room.points.iter_mut().for_each(|p| *p = p.swapped(X_AB));
            }
            return;
        }
        if let (Kind::Convex { core, round }, Kind::Convex { core: disc, .. }) =
            (&other.kind, &self.solid.kind)
        {
            let thick = match which {
                Rolls::First => [ask.padding[1] + round, ask.padding[0]],
                Rolls::Second => [ask.padding[0] + round, ask.padding[1]],
            };
            let limit = ask.margin + thick[0] + thick[1];
            let a = Placed::here(core);
            let (b, inner) = (Placed::at(disc, &X_disc), Placed::at(&self.inner, &X_disc));
            match deepest(&a, &b, &inner, limit, ask.size, room) {
                DiscContact::Far => return room.points.clear(),
                DiscContact::At(p) => {
                    room.points.clear();
                    let mut p = p;
                    p.pa += p.n * thick[0];
                    p.pb -= p.n * thick[1];
                    p.gap -= thick[0] + thick[1];
                    return room.points.push(if which == Rolls::First {
                        p.swapped(X_AB)
                    } else {
                        p
                    });
                }
                DiscContact::Flat => {}
            }
        }
        match which {
            Rolls::First => {
                pair(&self.solid, other, &(along.inverse() * *X_AB), ask, room);
                for p in &mut room.points {
                    (p.pa.z, p.pb.z) = (p.pa.z + z, p.pb.z + z);
                }
            }
            Rolls::Second => pair(other, &self.solid, &X_disc, ask, room),
        }
        self.join(&mut room.points);
    }

    /// Computes the contact points of the disc at `X_disc` on a ground, in the ground's frame and with it as the first collider. Returns false if the
    /// disc lies on its side. Patches with the same depth are weighted by their share.
    fn on_ground(
        &self,
        ground: &impl Relief,
        X_disc: &Pose,
        ask: &PairQuery,
        room: &mut Room,
    ) -> bool {
        let axle = X_disc.rotation * Vec3::z();
        if axle.z.abs() > UPRIGHT {
            return false;
        }
        let thick = ask.padding[0] + ask.padding[1];
        let disc = Disc {
            radius: self.radius,
            centre: X_disc.position,
            axle,
            margin: (ask.margin + thick).max(0.0),
        };
        room.points.clear();
        for (k, p) in disc.contact(ground).patches().iter().enumerate() {
            let depth = if p.depth > 0.0 { p.depth * p.share } else { p.depth };
            let gap = -depth - thick;
            if gap <= ask.margin {
                let pa = p.point + p.normal * depth;
                let name = mix(7, k as u64);
                room.points.push(Point { pa, pb: p.point, n: p.normal, gap, name });
            }
        }
        true
    }

    /// Merges the points on both sides of a disc, which is almost infinitely thin.
    fn join(&self, points: &mut Vec<Point>) {
        let mut kept = 0;
        for i in 0..points.len() {
            let p = points[i];
            let same = |q: &Point| (q.pb - p.pb).norm() < self.near && q.n.dot(&p.n) > 0.95;
            match points[..kept].iter().position(same) {
                Some(k) => {
                    let q = &mut points[k];
                    (q.pa, q.pb) = ((q.pa + p.pa) / 2.0, (q.pb + p.pb) / 2.0);
                    q.gap = (q.gap + p.gap) / 2.0;
                }
                None => {
                    points[kept] = p;
                    kept += 1;
                }
            }
        }
        points.truncate(kept);
    }
}

/// Contact of a disc and a core.
enum DiscContact {
    /// The separation is above the limit.
    Far,
    /// One point.
    At(Point),
    /// The disc's end faces the other core.
    Flat,
}

/// Returns the deepest point of a disc `b` in a core `a`.
fn deepest(
    a: &Placed,
    b: &Placed,
    inner: &Placed,
    limit: f64,
    size: f64,
    room: &mut Room,
) -> DiscContact {
    let Some(axis) = axis::best(a, b, limit, 0.0) else { return DiscContact::Far };
    let axle: Vec3 = b.R.column(2).into_owned();
    let flat = |n: &Vec3| n.dot(&axle).abs() > ENDS;
    let at = |n: Vec3, sep: f64| {
        let pb = b.support(&-n);
        DiscContact::At(Point { pa: pb - n * sep, pb, n, gap: sep, name: 4 })
    };
    if axis.source == Source::Face
        && !flat(&axis.n)
        && inset(a, &axis, &b.support(&-axis.n), size, room)
    {
        return at(axis.n, axis.sep);
    }
    let mut best = (axis.n, axis.sep);
    let guess = match axis::nearest(a, inner, f64::INFINITY, &axis.n, &mut room.simplex) {
        Nearest::Apart(_, _, n, _) | Nearest::Overlap(n) => Some(n),
        Nearest::Far => None,
    };
    for n in [Some(axis.n), guess].into_iter().flatten() {
        let found = polish(a, b, &n);
        if found.1 > best.1 {
            best = found;
        }
    }
    match best {
        (_, sep) if sep > limit => DiscContact::Far,
        (n, _) if flat(&n) => DiscContact::Flat,
        (n, sep) => at(n, sep),
    }
}
