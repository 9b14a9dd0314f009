//! Contact points of pieces with any other solid, either all or only the deepest.

use super::{Piece, Pieces, around, beyond, exact, matrix, slack, within};
use crate::contact_points::Room;
use crate::contact_points::least;
use crate::core::{Placed, mix};
use crate::pairs::{Want, two_cores};
use linkwork_multibody::spatial::{Pose, Vec3};
use std::cell::Cell;
use std::ops::ControlFlow;

/// A query over many pieces. The required distance, m, shrinks to the smallest gap found when only the deepest point is required.
struct Search {
    limit: Cell<f64>,
    size: f64,
    want: Want,
    /// Index of the first point of this query.
    first: usize,
}

impl Search {
    fn new(limit: f64, size: f64, want: Want, first: usize) -> Self {
        Self { limit: Cell::new(limit), size, want, first }
    }

    /// Returns the limit at which groups of pieces are rejected.
    fn cull(&self, slack: f64) -> f64 {
        self.limit.get().max(0.0) * (1.0 + 1e-12) + slack
    }

    /// Subtracts the radius of a piece, which is the second solid, from its points from `from` on, names them, and keeps the required ones.
    fn take(&self, from: usize, piece: &Piece, room: &mut Room) {
        for p in &mut room.points[from..] {
            p.pb -= p.n * piece.round;
            p.gap -= piece.round;
            p.name = mix(p.name, mix(piece.name, 7));
        }
        if self.want == Want::All {
            return;
        }
        let low = least(&room.points[self.first..]);
        if let Some(best) = room.points[self.first..].iter().find(|p| p.gap <= low).copied() {
            room.points.truncate(self.first);
            room.points.push(best);
            self.limit.set(self.limit.get().min(best.gap));
        }
    }
}

/// Appends the points of a core, in the frame of the pieces, with pieces. The core is A.
pub(crate) fn with_core(
    a: &Placed,
    b: &Pieces,
    limit: f64,
    size: f64,
    want: Want,
    room: &mut Room,
) {
    let search = Search::new(limit, size, want, room.points.len());
    let (lo, hi) = b.bounds();
    let slack = slack(&a.p, &lo.abs().sup(&hi.abs()));
    let (outer, _) = b.reach();
    let closest = exact(a.core);
    let (lo, hi) = around(a, search.cull(slack));
    let far = |lo: &Vec3, hi: &Vec3| beyond(lo, hi, a, search.cull(slack));
    let each = |piece: &Piece| {
        let cull = search.cull(slack) + piece.round;
        if !(closest && a.toward(&piece.centre).norm() > outer + cull) {
            // Compute relative to the piece's centre, to avoid cancellation far from the origin.
            let from = room.points.len();
            let moved = Placed { p: a.p - piece.centre, ..*a };
            let limit = search.limit.get() + piece.round;
            two_cores(&moved, &Placed::here(b.core()), limit, search.size, room);
            for p in &mut room.points[from..] {
                (p.pa, p.pb) = (p.pa + piece.centre, p.pb + piece.centre);
            }
            search.take(from, piece, room);
        }
        ControlFlow::Continue(())
    };
    let _ = b.visit(&lo, &hi, far, each);
}

/// Appends the points of two solids of pieces, in the frame of A, with `b` at `X_AB`.
pub(crate) fn with_pieces(
    a: &Pieces,
    b: &Pieces,
    X_AB: &Pose,
    limit: f64,
    size: f64,
    want: Want,
    room: &mut Room,
) {
    let search = Search::new(limit, size, want, room.points.len());
    let (R, p) = matrix(X_AB);
    let (lo, hi) = within(a.bounds(), (&R, &p), limit);
    let each = |piece: &Piece| {
        let from = room.points.len();
        let other = Placed { core: b.core(), R, p: R * piece.centre + p };
        with_core(&other, a, search.limit.get() + piece.round, size, want, room);
        // The core was the first solid; here it is the second.
        for p in &mut room.points[from..] {
            (p.pa, p.pb, p.n) = (p.pb, p.pa, -p.n);
        }
        search.take(from, piece, room);
        ControlFlow::Continue(())
    };
    let _ = b.visit(&lo, &hi, |_, _| false, each);
}

/// Appends the points of pieces with a solid that is neither convex nor made of pieces. `one` appends the points of that solid, which is A, and a
/// core. `bounds` is the box around the solid in its own frame.
pub(crate) fn with_other(
    bounds: (Vec3, Vec3),
    b: &Pieces,
    X_AB: &Pose,
    (limit, size, want): (f64, f64, Want),
    room: &mut Room,
    mut one: impl FnMut(&Placed, f64, f64, &mut Room),
) {
    let search = Search::new(limit, size, want, 0);
    let (R, p) = matrix(X_AB);
    let clamped = |v: Vec3| v.map(|x| x.clamp(-1e12, 1e12));
    let (lo, hi) = within((clamped(bounds.0), clamped(bounds.1)), (&R, &p), limit);
    // The points of one piece must not depend on the pieces before it.
    let mut kept = std::mem::take(&mut room.kept);
    kept.clear();
    let behind = room.behind;
    let each = |piece: &Piece| {
        room.points.clear();
        room.behind = behind + piece.round;
        let core = Placed { core: b.core(), R, p: R * piece.centre + p };
        // A core behind a triangle is detected by its position, not by its distance, so the limit must not shrink below this.
        let limit = (search.limit.get() + piece.round).max(room.behind);
        one(&core, limit, size, room);
        std::mem::swap(&mut room.points, &mut kept);
        let from = room.points.len();
        room.points.extend_from_slice(&kept);
        search.take(from, piece, room);
        std::mem::swap(&mut room.points, &mut kept);
        ControlFlow::Continue(())
    };
    let _ = b.visit(&lo, &hi, |_, _| false, each);
    std::mem::swap(&mut room.points, &mut kept);
    (room.kept, room.behind) = (kept, behind);
}
