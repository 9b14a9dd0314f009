//! Faces of a collider that other colliders of the same rigid piece cover. The piece has no surface there.
//!
//! Several flush boxes that form the ground, or several shapes of one body, must act as one solid for an object that slides over them. At a seam,
//! each of two boxes has a face that touches the other. A contact point on such a face has a normal along the common surface and would stop a sliding
//! box.
//!
//! ```text
//! p on the face, n outwards; e and s are small fractions of the pair's size
//! covered:   p + e n lies in another shape of the piece, and q + e n also does for each q of the face at the distance s from p
//! ```
//! The points q are needed where a wall stands on a larger block: the top of the block is covered under the wall but exposed next to it. Only convex
//! shapes and half spaces can cover, and only convex shapes can be covered, because the triangles of a mesh have neighbour information.

use crate::colliders::Colliders;
use crate::core::{Core, Placed, over_ellipsoid};
use crate::item::OUTSIDE;
use crate::pairs::on_cylinder;
use crate::query::{ContactPoint, PosedCollider};
use crate::shape::Detail;
use crate::solid::{Kind, Solid};
use linkwork_multibody::spatial::{Pose, Vec3};

/// Distance from a contact point at which its face is tested, relative to the size of the pair.
const ASIDE: f64 = 1e-2;

/// Tolerance for a point on a surface.
const ON: f64 = 1e-6;

/// Returns the distance of a point from a solid at a pose, minus its padding, m; negative inside. For a polytope it is a lower bound.
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
    /// Removes the contact points of a pair, from `from` on, at which the face of one of the two is covered.
    pub(crate) fn uncover(
        &self,
        [a, b]: [&PosedCollider; 2],
        (detail, size): (Detail, f64),
        seen: &[PosedCollider],
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
