//! Faces of a collider that other colliders of the same rigid piece cover: the piece has no surface there.
//!
//! Flush boxes that make up the ground, or several shapes of one body, are one solid to what slides over them. Where two of them
//! meet, each has a face that ends at the other. A contact point on that face has a normal along the common surface, and would stop
//! a box that slides over the seam.
//!
//! ```text
//! p on the face, n outwards, e and s small parts of the pair's size
//! covered:   p + e n lies in another shape of the piece, and so does q + e n for each q of the face at the distance s from p
//! ```
//! The points q matter where a wall is placed on a larger block: at the foot of the wall the top of the block is covered, but it is exposed next to it.
//! Only convex shapes and half spaces cover, and only convex shapes are covered: triangles of a mesh know their neighbours.

use crate::colliders::{Colliders, Item};
use crate::core::{Core, Placed, over_ellipsoid};
use crate::pairs::on_cylinder;
use crate::query::{ContactPoint, Seen};
use crate::rules::groups;
use crate::shape::Detail;
use crate::solid::{Kind, Solid};
use linkwork_multibody::Multibody;
use linkwork_multibody::spatial::{Pose, Vec3};

/// Distance from a contact point at which its face is tested, as a part of the size of the pair.
const ASIDE: f64 = 1e-2;
/// How far outside the face another shape must be there: cracks up to this are closed.
const OUTSIDE: f64 = 1e-3;
/// What counts as on a surface.
const ON: f64 = 1e-6;

/// Returns, for each collider, the others of its rigid piece whose bounding boxes overlap with its own. O(n²) in the colliders.
pub(crate) fn fellows(items: &[Item], multibody: &Multibody) -> Vec<Vec<u32>> {
    let world = multibody.bodies().len();
    let group = groups(multibody);
    // Poses in the frame of the piece: parents come first.
    let mut in_piece = vec![Pose::identity(); world + 1];
    for (i, body) in multibody.bodies().iter().enumerate() {
        if body.v().is_empty() {
            let parent = in_piece[body.parent().map_or(world, |p| p.index())];
            in_piece[i] = parent * body.hinge_in_parent() * body.hinge_in_body().inverse();
        }
    }
    let place = |item: &Item| item.body.map_or(world, |b| b.index());
    let bounds: Vec<Option<(Vec3, Vec3)>> = (items.iter())
        .map(|item| {
            let solid = item.solid(Detail::Fine)?;
            let covers = matches!(solid.kind, Kind::Convex { .. } | Kind::HalfSpace);
            let X = in_piece[place(item)] * item.pose;
            covers.then(|| crate::query::around(solid, &X, item.padding + OUTSIDE * solid.size))
        })
        .collect();
    let meet = |i: usize, j: usize| {
        let (Some((lo, hi)), Some((low, high))) = (&bounds[i], &bounds[j]) else { return false };
        (0..3).all(|k| lo[k] <= high[k] && low[k] <= hi[k])
    };
    let of = |i: usize| group[place(&items[i])];
    let near = |i: usize| {
        let all = (0..items.len()).filter(move |j| i != *j);
        all.filter(|j| of(i) == of(*j) && meet(i, *j)).map(|j| j as u32).collect()
    };
    (0..items.len()).map(near).collect()
}

/// Returns the distance of a point from a solid at a pose, less its padding, m; negative inside. The value for a polytope is a lower bound.
fn gap(solid: &Solid, X: &Pose, padding: f64, p: &Vec3) -> f64 {
    let q = X.rotation.inverse() * (p - X.position);
    let bare = match &solid.kind {
        Kind::HalfSpace => q.z,
        Kind::Convex { core, round } => {
            let far = match core {
                Core::Point => q.norm(),
                Core::Segment { h } => Vec3::new(q.x, q.y, q.z - q.z.clamp(-h, *h)).norm(),
                Core::Cylinder { r, h } => on_cylinder(&Placed::here(core), *r, *h, &q).2,
                Core::Ellipsoid { half } => over_ellipsoid(half, &q),
                Core::Poly(poly) => {
                    let over = |f: &crate::core::Face| {
                        f.n.dot(&(q - poly.vertices[poly.ring_of(f)[0] as usize]))
                    };
                    poly.faces.iter().map(over).fold(f64::NEG_INFINITY, f64::max)
                }
            };
            far - round
        }
        Kind::Surface(_) | Kind::Pieces(_) => f64::INFINITY,
    };
    bare - padding
}

impl Colliders {
    /// Takes the contact points of a pair out, from `from` on, at which the face of one of the two is covered.
    pub(crate) fn uncover(
        &self,
        [a, b]: [&Seen; 2],
        (detail, size): (Detail, f64),
        seen: &[Seen],
        (from, out): (usize, &mut Vec<ContactPoint>),
    ) {
        for (own, other, sign) in [(a, b, 1.0), (b, a, -1.0)] {
            let item = &self.items[own.id as usize];
            let solid = item.solid(detail).filter(|s| matches!(s.kind, Kind::Convex { .. }));
            let (Some(solid), false) = (solid, item.fellows.is_empty()) else { continue };
            let shown = |k: &u32| {
                let meets = self.meets[*k as usize * self.items.len() + other.id as usize];
                meets.then(|| seen.binary_search_by_key(k, |s| s.id).ok()).flatten()
            };
            let within = |p: &Vec3| {
                item.fellows.iter().filter_map(shown).any(|at| {
                    let (fellow, s) = (&self.items[seen[at].id as usize], &seen[at]);
                    let solid = fellow.solid(detail);
                    solid.is_some_and(|x| gap(x, &s.pose, fellow.padding, p) <= ON * size)
                })
            };
            let covered = |c: &ContactPoint| {
                let n = c.normal * sign;
                let p = c.point - n * (c.gap / 2.0);
                if !within(&(p + n * (OUTSIDE * size))) {
                    return false;
                }
                let least = if n.x.abs() < n.y.abs() { Vec3::x() } else { Vec3::y() };
                let u = n.cross(&least).normalize();
                let v = n.cross(&u);
                [u, -u, v, -v].iter().all(|d| {
                    let q = p + d * (ASIDE * size);
                    gap(solid, &own.pose, item.padding, &q) > ON * size
                        || within(&(q + n * (OUTSIDE * size)))
                })
            };
            let mut kept = from;
            for k in from..out.len() {
                if !covered(&out[k]) {
                    out[kept] = out[k];
                    kept += 1;
                }
            }
            out.truncate(kept);
        }
    }
}
