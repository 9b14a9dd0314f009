//! Distances of colliders: one pair, the closest pair, all pairs.

use super::{Probe, Whereabouts, before, solid};
use crate::colliders::Colliders;
use crate::contact_points::least;
use crate::core::Placed;
use crate::item::ColliderId;
use crate::near::{Near, near};
use crate::pairs::{PairQuery, Want, pair};
use crate::query::{Closest, Distance};
use crate::solid::{Kind, Solid};
use linkwork_multibody::spatial::{Pose, Vec3, quat};

impl Probe {
    /// Returns the closest of all checked pairs up to `limit` (m, may be infinite), including padding; negative for overlap. Call
    /// [`place`](Self::place) first.
    pub fn closest(&mut self, colliders: &Colliders, limit: f64) -> Option<Closest> {
        self.look(limit);
        self.measure();
        self.near.sort_unstable_by(before);
        let mut best: Option<Closest> = None;
        for at in 0..self.near.len() {
            let (i, j) = self.near[at].1;
            let (a, b) = (i as usize, j as usize);
            let limit = best.map_or(limit, |c| c.distance.distance);
            if self.balls_apart(a, b) > limit.max(0.0) {
                continue;
            }
            if let Some(distance) = self.between(colliders, a, b, limit)
                && best.is_none_or(|c| distance.distance < c.distance.distance)
            {
                best = Some(Closest { a: ColliderId(i), b: ColliderId(j), distance });
            }
        }
        best
    }

    /// Writes the distances of all checked pairs within `limit` (m, may be infinite) to `out`, which is cleared first, sorted by handles. They
    /// include padding and are negative for overlap. Call [`place`](Self::place) first.
    pub fn distances(&mut self, colliders: &Colliders, limit: f64, out: &mut Vec<Closest>) {
        out.clear();
        self.look(limit);
        for at in 0..self.near.len() {
            let (i, j) = self.near[at].1;
            if let Some(distance) = self.between(colliders, i as usize, j as usize, limit) {
                out.push(Closest { a: ColliderId(i), b: ColliderId(j), distance });
            }
        }
    }

    /// Returns the distance of two colliders, including padding, whether the pair is checked or not; `None` when it is above `limit`. Call
    /// [`place`](Self::place) first.
    #[track_caller]
    pub fn distance(
        &mut self,
        colliders: &Colliders,
        a: ColliderId,
        b: ColliderId,
        limit: f64,
    ) -> Option<Distance> {
        let placed = |id: ColliderId| self.places[id.index()].radius > Whereabouts::NONE;
        if !(placed(a) && placed(b)) {
            return None;
        }
        self.between(colliders, a.index(), b.index(), limit)
    }

    /// Returns the nearest points within `limit`.
    pub(super) fn between(
        &mut self,
        colliders: &Colliders,
        i: usize,
        j: usize,
        limit: f64,
    ) -> Option<Distance> {
        let of = |k: usize| solid(&self.live, colliders, k, self.detail[k]);
        let (a, b) = (of(i)?, of(j)?);
        let thick = [self.thick(i), self.thick(j)];
        let places = (&self.places[i], &self.places[j]);
        match apart((a, b), places, thick, limit) {
            Separation::By(distance) => return Some(distance),
            Separation::Far => return None,
            Separation::NotTold => {}
        }
        let pose = |k: usize| Pose::new(quat(&self.places[k].R), self.places[k].p);
        let (pa, pb) = (pose(i), pose(j));
        let back = pa.rotation.inverse();
        let X_AB = Pose::new(back * pb.rotation, back * (pb.position - pa.position));
        let (padding, size) = (thick, a.size.min(b.size));
        let balls = self.balls_apart(i, j);
        let start = if balls.is_finite() { balls.max(0.0) } else { 0.0 };
        let mut margin = (start + size).min(limit);
        loop {
            pair(
                a,
                b,
                &X_AB,
                &PairQuery { margin, padding, size, want: Want::Least },
                &mut self.room,
            );
            let low = least(&self.room.points);
            if let Some(p) = self.room.points.iter().find(|p| p.gap <= low) {
                let (point_a, point_b) = (pa.transform_point(&p.pa), pa.transform_point(&p.pb));
                return Some(Distance { distance: p.gap, point_a, point_b });
            }
            if margin >= limit.min(1e12) {
                return None;
            }
            margin = (margin * 4.0).min(limit);
        }
    }
}

/// Result of the nearest points of two cores.
enum Separation {
    /// Nearest points.
    By(Distance),
    /// The separation is above the limit.
    Far,
    /// The cores overlap or nearly touch, so their contact points must be computed.
    NotTold,
}

/// Computes the distance of two convex solids with separated cores, without contact points. Both are in world axes, relative to the origin of the
/// first.
fn apart(
    (a, b): (&Solid, &Solid),
    (pa, pb): (&Whereabouts, &Whereabouts),
    thick: [f64; 2],
    limit: f64,
) -> Separation {
    let (Kind::Convex { core: ca, round: ra }, Kind::Convex { core: cb, round: rb }) =
        (&a.kind, &b.kind)
    else {
        return Separation::NotTold;
    };
    let (size, thick) = (a.size.min(b.size), [ra + thick[0], rb + thick[1]]);
    let x = Placed { core: ca, R: pa.R, p: Vec3::zeros() };
    let y = Placed { core: cb, R: pb.R, p: pb.p - pa.p };
    let both = thick[0] + thick[1];
    match near(&x, &y, limit + both, &(pb.ball - pa.ball), size) {
        Near::Far => Separation::Far,
        Near::Unsure => Separation::NotTold,
        Near::Apart(gap) => {
            let (n, distance) = (gap.way * (1.0 / gap.d), gap.d - both);
            let point_a = pa.p + gap.pa + n * thick[0];
            let point_b = pa.p + gap.pa + gap.way - n * thick[1];
            Separation::By(Distance { distance, point_a, point_b })
        }
    }
}
