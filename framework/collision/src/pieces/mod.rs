//! Solids of many pieces from sensor data: a point cloud with radii, or the occupied cells of a voxel map. Each piece is a convex core with a radius.
//!
//! ```text
//! boxes around groups of pieces within range               balls.rs, cells.rs
//! a box and the other core: one direction with a separation above the limit rejects the group
//! a piece and the other solid: like any two solids         pairs.rs
//! ```
//! The solid is the union of its pieces: its distance is the smallest distance of a piece, its penetration depth the largest depth of a single piece.

mod balls;
mod cells;
pub(crate) mod points;

pub(crate) use balls::Balls;
pub(crate) use cells::Cells;

use crate::contact_points::Room;
use crate::core::{Core, Placed};
use crate::near::exact;
use crate::pairs::close;
use crate::solid::Kind;
use linkwork_multibody::spatial::{Mat3, Pose, Vec3};
use std::ops::ControlFlow;

/// A sphere or a cell.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Piece {
    /// Its centre, m.
    pub centre: Vec3,
    /// Radius around the core, m: zero for a cell.
    pub round: f64,
    /// Name of the piece.
    pub name: u64,
}

/// The pieces of a solid.
#[derive(Clone, Debug)]
pub(crate) enum Pieces {
    /// Spheres around points.
    Balls(Balls),
    /// Occupied cells of a grid.
    Cells(Cells),
}

const POINT: Core = Core::Point;

impl Pieces {
    /// Returns the box around all pieces, or around the grid of cells, m; empty without pieces.
    pub fn bounds(&self) -> (Vec3, Vec3) {
        match self {
            Self::Balls(b) => b.bounds(),
            Self::Cells(c) => c.bounds(),
        }
    }

    /// Returns a length for tolerances, m.
    pub fn size(&self) -> f64 {
        match self {
            Self::Balls(b) => {
                let (lo, hi) = b.bounds();
                let sizes = [2.0 * b.largest(), (hi - lo).max(), 1.0];
                sizes.into_iter().find(|size| *size > 0.0).unwrap_or(1.0)
            }
            Self::Cells(c) => c.edge(),
        }
    }

    /// Returns the number of pieces.
    pub fn count(&self) -> usize {
        match self {
            Self::Balls(b) => b.len(),
            Self::Cells(c) => c.count(),
        }
    }

    /// Returns the core of all pieces.
    pub fn core(&self) -> &Core {
        match self {
            Self::Balls(_) => &POINT,
            Self::Cells(c) => c.core(),
        }
    }

    /// Returns the largest and the smallest distance of a core's surface from its centre.
    fn reach(&self) -> (f64, f64) {
        match self {
            Self::Balls(_) => (0.0, 0.0),
            Self::Cells(c) => (0.5 * c.edge() * 3f64.sqrt() * (1.0 + 1e-12), 0.5 * c.edge()),
        }
    }

    /// Visits the pieces that a box may overlap, group by group; `far` may reject a group by the corners of its box.
    pub fn visit(
        &self,
        lo: &Vec3,
        hi: &Vec3,
        mut far: impl FnMut(&Vec3, &Vec3) -> bool,
        mut each: impl FnMut(&Piece) -> ControlFlow<()>,
    ) -> ControlFlow<()> {
        match self {
            Self::Balls(b) => b.visit(lo, hi, &mut far, &mut each),
            Self::Cells(c) => c.visit(lo, hi, &mut far, &mut each),
        }
    }
}

/// Returns a margin for limits when groups are rejected: the round-off of positions of this size, m.
pub(crate) fn slack(a: &Vec3, b: &Vec3) -> f64 {
    1e-12 * (a.amax() + b.amax())
}

/// Returns the box around a core, enlarged by `limit`.
pub(crate) fn around(b: &Placed, limit: f64) -> (Vec3, Vec3) {
    let reach = |i: usize, sign: f64| {
        let d = Vec3::ith(i, sign);
        b.support(&d)[i] + sign * limit
    };
    let corner = |sign| Vec3::new(reach(0, sign), reach(1, sign), reach(2, sign));
    (corner(-1.0), corner(1.0))
}

/// Returns true if the direction from the nearest part of a box to the core proves a separation above `limit`.
pub(crate) fn beyond(lo: &Vec3, hi: &Vec3, b: &Placed, limit: f64) -> bool {
    let n = b.toward(&b.p.sup(lo).inf(hi));
    let top = (lo + hi).dot(&n) / 2.0 + n.abs().dot(&(hi - lo)) / 2.0;
    b.range(&n).0 - top > limit * n.norm()
}

/// Returns true if pieces come within `limit` (not negative) of a core, which is given in their frame.
pub(crate) fn near_core(
    pieces: &Pieces,
    b: &Placed,
    (limit, size): (f64, f64),
    room: &mut Room,
) -> bool {
    let (lo, hi) = pieces.bounds();
    let cull = limit + slack(&b.p, &lo.abs().sup(&hi.abs())) + 1e-12 * limit;
    let (lo, hi) = around(b, cull);
    let (outer, inner) = pieces.reach();
    let exact = exact(b.core);
    let found = pieces.visit(
        &lo,
        &hi,
        |lo, hi| beyond(lo, hi, b, cull),
        |piece| {
            let limit = limit + piece.round;
            let toward = b.toward(&piece.centre);
            if exact {
                let d = toward.norm();
                if d <= inner + limit {
                    return ControlFlow::Break(());
                }
                if d > outer + cull + piece.round {
                    return ControlFlow::Continue(());
                }
            }
            // Compute relative to the piece's centre, to avoid cancellation far from the origin.
            let a = Placed::here(pieces.core());
            let b = Placed { p: b.p - piece.centre, ..*b };
            match close(&a, &b, limit, &toward, size, room) {
                true => ControlFlow::Break(()),
                false => ControlFlow::Continue(()),
            }
        },
    );
    found.is_break()
}

/// Returns whether two solids, at least one of which has pieces, come within `limit` (not negative), with `b` at `X_AB`; `None` when their contact
/// points must decide.
pub(crate) fn near(
    a: &Kind,
    b: &Kind,
    (R, p): (&Mat3, &Vec3),
    (limit, size): (f64, f64),
    room: &mut Room,
) -> Option<bool> {
    let back = || (R.transpose(), -R.tr_mul(p));
    match (a, b) {
        (Kind::Pieces(a), Kind::Convex { core, round }) => {
            Some(near_core(a, &Placed { core, R: *R, p: *p }, (limit + round, size), room))
        }
        (Kind::Convex { core, round }, Kind::Pieces(b)) => {
            let (R, p) = back();
            Some(near_core(b, &Placed { core, R, p }, (limit + round, size), room))
        }
        (Kind::Pieces(a), Kind::Pieces(b)) if a.count() < b.count() => {
            let (R, p) = back();
            Some(near_pieces(b, a, (&R, &p), (limit, size), room))
        }
        (Kind::Pieces(a), Kind::Pieces(b)) => Some(near_pieces(a, b, (R, p), (limit, size), room)),
        _ => None,
    }
}

/// Tests each piece of `b` against all of `a`.
fn near_pieces(
    a: &Pieces,
    b: &Pieces,
    (R, p): (&Mat3, &Vec3),
    (limit, size): (f64, f64),
    room: &mut Room,
) -> bool {
    let (lo, hi) = within(a.bounds(), (R, p), limit);
    let each = |piece: &Piece| {
        let other = Placed { core: b.core(), R: *R, p: R * piece.centre + p };
        if near_core(a, &other, (limit + piece.round, size), room) {
            ControlFlow::Break(())
        } else {
            ControlFlow::Continue(())
        }
    };
    b.visit(&lo, &hi, |_, _| false, each).is_break()
}

/// Returns the box, in the frame of B, around a box in the frame of A that is enlarged by `limit` and by a margin for round-off.
pub(crate) fn within((lo, hi): (Vec3, Vec3), (R, p): (&Mat3, &Vec3), limit: f64) -> (Vec3, Vec3) {
    let (centre, half) = ((lo + hi) / 2.0, (hi - lo) / 2.0);
    let (centre, half) = (R.tr_mul(&(centre - p)), R.abs().tr_mul(&half));
    let room = limit.max(0.0) * (1.0 + 1e-12) + slack(&(centre.abs() + half), p);
    (centre - half.add_scalar(room), centre + half.add_scalar(room))
}

/// Returns the pose of B in A as a matrix.
pub(crate) fn matrix(X: &Pose) -> (Mat3, Vec3) {
    (X.rotation.to_rotation_matrix().into_inner(), X.position)
}
