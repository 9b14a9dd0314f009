//! How far two convex cores are apart that do not overlap, with nearest points: closed forms where there are some, else the iteration
//! of Gilbert, Johnson and Keerthi (`walk.rs`).
//!
//! ```text
//! a point with a point, segment, cylinder, box       the nearest point
//! two segments, a segment and a box                  lines.rs
//! a segment and a cylinder                           lines.rs, Newton's steps between bounds
//! a cylinder and a box or a cylinder                 cylinders.rs, where a guess is proven
//! the rest                                           walk.rs, until the normal proves the distance
//! ```
//! Where neither says enough (cores overlap, nearly touch, or the proof fails), the caller asks for contact points, whose normal has
//! more care taken of it.

mod cylinders;
mod lines;
mod walk;

use crate::core::{Core, Placed, Poly};
use crate::polish::polish;
use linkwork_multibody::spatial::Vec3;

/// Nearest points: on A (m), the way from there to B (m), and its length (m).
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

    /// The same between B and A.
    fn back(self) -> Self {
        Self { pa: self.pa + self.way, way: -self.way, d: self.d }
    }
}

/// What is known of two cores.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Near {
    /// More than the limit is between them.
    Far,
    /// Nearest points, exact to rounding.
    Apart(Gap),
    /// They overlap, or are so near that rounding decides.
    Unsure,
}

/// In sizes of the pair: nearer cores are left to their contact points.
const NEARLY: f64 = 1e-6;
/// In sizes of the pair: how far the distance and what the normal proves of it may differ.
const PROOF: f64 = 1e-12;
/// The same after a second walk: only of cylinders.
const ENOUGH: f64 = 3e-9;

/// Nearest points of two cores within `limit` (m). `start` is about the way from A to B, of any length; `size` a length of the smaller one.
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
    // What overlaps may be less far than any limit.
    match gap.d {
        d if !(d > NEARLY * size) => Near::Unsure,
        d if d > limit => Near::Far,
        _ => Near::Apart(gap),
    }
}

/// Once more from the normal with its last digits, and what it proves: round sides give corners so near each other that their simplex has lost digits.
#[cold]
fn again(a: &Placed, b: &Placed, gap: Gap) -> (Gap, f64) {
    let (n, sep) = polish(a, b, &(gap.way / gap.d));
    let gap = match walk::walk(a, b, f64::INFINITY, f64::NEG_INFINITY, &n) {
        walk::End::Apart(other, _) if other.d < gap.d => other,
        _ => gap,
    };
    (gap, sep.max(proof(a, b, &(gap.way / gap.d))))
}

/// The distance that a normal from A to B proves, m.
fn proof(a: &Placed, b: &Placed, n: &Vec3) -> f64 {
    b.range(n).0 - a.range(n).1
}

/// Whether two cores come within `limit` (m, not negative); `None` where rounding decides. `start` as in [`near`].
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

/// The closed forms; `None` when the pair has none.
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

/// A cylinder with a box or another cylinder.
fn guessed(a: &Placed, b: &Placed, size: f64) -> Option<Gap> {
    let from = |a: &Placed, b: &Placed| match a.core {
        Core::Cylinder { r, h } => cylinders::from_cylinder(a, *r, *h, b, size),
        _ => None,
    };
    from(a, b).or_else(|| from(b, a).map(Gap::back))
}

/// Whether [`Placed::toward`] ends at the core's nearest point.
pub(crate) fn exact(core: &Core) -> bool {
    !matches!(core, Core::Ellipsoid { .. } | Core::Poly(Poly { half: None, .. }))
}
