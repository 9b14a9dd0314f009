//! Distance of two convex cores that do not overlap, with nearest points. Closed forms are used where they exist, otherwise the iteration of Gilbert,
//! Johnson and Keerthi (`walk.rs`).
//!
//! ```text
//! a point with a point, segment, cylinder, box       the nearest point
//! two segments, a segment and a box                  lines.rs
//! a segment and a cylinder                           lines.rs, Newton's steps between bounds
//! a cylinder and a box or a cylinder                 cylinders.rs, if a guess is verified
//! all others                                         walk.rs, until the normal verifies the distance
//! ```
//! If the result is not certain (cores overlap or nearly touch, or the verification fails), the caller computes contact points, whose normal is
//! determined more carefully.

mod cylinders;
mod lines;
mod walk;

use crate::core::{Core, Placed, Poly};
use crate::polish::polish;
use linkwork_multibody::spatial::Vec3;

/// Nearest points: on A (m), the vector from there to B (m), and its length (m).
#[derive(Clone, Copy, Debug)]
pub(crate) struct Gap {
    pub pa: Vec3,
    pub way: Vec3,
    pub d: f64,
}

impl Gap {
    fn new(pa: Vec3, way: Vec3) -> Self {
        Self { pa, way, d: way.norm() }
    }

    /// Returns the gap from B to A.
    fn back(self) -> Self {
        Self { pa: self.pa + self.way, way: -self.way, d: self.d }
    }
}

/// Result for two cores.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Near {
    /// The separation is above the limit.
    Far,
    /// Nearest points, exact up to round-off.
    Apart(Gap),
    /// The shapes overlap, or are so close that round-off decides.
    Unsure,
}

/// Limit of the distance relative to the size of the pair; for closer cores the contact point computation is used.
const NEARLY: f64 = 1e-6;
/// Relative to the size of the pair: largest difference between the distance and the value that its normal proves.
const PROOF: f64 = 1e-12;
/// Like [`PROOF`], but for the retry with a refined normal, which is needed only for cylinders.
const ENOUGH: f64 = 3e-9;

/// Computes the nearest points of two cores within `limit` (m). `start` is roughly the direction from A to B, of any length; `size` is a length of
/// the smaller core.
pub(crate) fn near(a: &Placed, b: &Placed, limit: f64, start: &Vec3, size: f64) -> Near {
    let gap = match closed(a, b).or_else(|| guessed(a, b, size)) {
        Some(gap) => gap,
        None => match walk::walk(a, b, limit, f64::NEG_INFINITY, start) {
            walk::End::Far => return Near::Far,
            walk::End::Apart(gap, proven) if gap.d - proven <= PROOF * size => gap,
            walk::End::Apart(gap, _) => match again(a, b, gap) {
                (gap, proven) if gap.d - proven <= ENOUGH * size => gap,
                _ => return Near::Unsure,
            },
            _ => return Near::Unsure,
        },
    };
    // The cores overlap or nearly overlap, whatever the limit is.
    match gap.d {
        d if !(d > NEARLY * size) => Near::Unsure,
        d if d > limit => Near::Far,
        _ => Near::Apart(gap),
    }
}

/// Refines the normal to full accuracy and evaluates the distance that it proves. Curved sides give support points so close to each other that their
/// simplex is ill-conditioned.
#[cold]
fn again(a: &Placed, b: &Placed, gap: Gap) -> (Gap, f64) {
    let (n, sep) = polish(a, b, &(gap.way / gap.d));
    let gap = match walk::walk(a, b, f64::INFINITY, f64::NEG_INFINITY, &n) {
        walk::End::Apart(other, _) if other.d < gap.d => other,
        _ => gap,
    };
    (gap, sep.max(proof(a, b, &(gap.way / gap.d))))
}

/// Returns the distance that a normal from A to B proves, m.
fn proof(a: &Placed, b: &Placed, n: &Vec3) -> f64 {
    b.range(n).0 - a.range(n).1
}

/// Returns whether two cores come within `limit` (m, not negative); `None` if round-off decides. `start` as in [`near`].
pub(crate) fn within(a: &Placed, b: &Placed, limit: f64, start: &Vec3) -> Option<bool> {
    if let Some(gap) = closed(a, b) {
        return Some(gap.d <= limit);
    }
    match walk::walk(a, b, limit, limit, start) {
        walk::End::Far => Some(false),
        walk::End::Within => Some(true),
        walk::End::Apart(gap, proven) if gap.d <= limit || proven > limit => Some(gap.d <= limit),
        walk::End::Apart(..) | walk::End::Lost => None,
    }
}

/// Computes the gap by closed forms; returns `None` if the pair has none.
#[inline]
fn closed(a: &Placed, b: &Placed) -> Option<Gap> {
    Some(match (a.core, b.core) {
        (Core::Point, _) if exact(b.core) => Gap::new(a.p, b.toward(&a.p)),
        (_, Core::Point) if exact(a.core) => Gap::new(b.p, a.toward(&b.p)).back(),
        (Core::Segment { h: ha }, Core::Segment { h: hb }) => lines::segments(a, *ha, b, *hb),
        (Core::Segment { h }, Core::Poly(Poly { half: Some(half), .. })) => {
            lines::segment_box(a, *h, b, half)
        }
        (Core::Poly(Poly { half: Some(half), .. }), Core::Segment { h }) => {
            lines::segment_box(b, *h, a, half).back()
        }
        (Core::Segment { h }, Core::Cylinder { r, h: height }) => {
            lines::segment_cylinder(a, *h, b, *r, *height)
        }
        (Core::Cylinder { r, h: height }, Core::Segment { h }) => {
            lines::segment_cylinder(b, *h, a, *r, *height).back()
        }
        _ => return None,
    })
}

/// Computes the gap of a cylinder with a box or another cylinder.
fn guessed(a: &Placed, b: &Placed, size: f64) -> Option<Gap> {
    let from = |a: &Placed, b: &Placed| match a.core {
        Core::Cylinder { r, h } => cylinders::from_cylinder(a, *r, *h, b, size),
        _ => None,
    };
    from(a, b).or_else(|| from(b, a).map(Gap::back))
}

/// Returns true if [`Placed::toward`] ends at the core's nearest point.
pub(crate) fn exact(core: &Core) -> bool {
    !matches!(core, Core::Ellipsoid { .. } | Core::Poly(Poly { half: None, .. }))
}
