//! Contact points and distances for given poses.

use crate::colliders::Colliders;
use crate::contact_points::least;
use crate::contact_points::{Point, Room};
use crate::core::mix;
use crate::discs::Rolls;
use crate::item::ColliderId;
use crate::item::around;
use crate::pairs::{PairQuery, Want, pair};
use crate::settings::Hiding;
use crate::shape::{ColliderSpec, Detail, Material, Visibility};
use crate::thin::thin;
use linkwork_multibody::BodyId;
use linkwork_multibody::spatial::{Pose, Vec3};

/// Parameters of a query.
#[derive(Clone, Copy, Debug)]
pub struct Query<'a> {
    /// Points with at most this gap are reported, m; may be negative, must be finite.
    pub margin: f64,
    /// Fine or coarse shapes.
    pub detail: Detail,
    /// Visibility; `None`: as in the specifications.
    pub hiding: Option<&'a Hiding>,
    /// Greatest displacement of each collider (m, not negative, by handle). Pairs are tested from this additional distance, separately for each
    /// collider. Empty: no motion.
    pub reach: &'a [f64],
}

impl Query<'_> {
    /// Creates a query for fine shapes with a margin in m.
    #[must_use]
    pub fn margin(margin: f64) -> Self {
        Self { margin, detail: Detail::Fine, hiding: None, reach: &[] }
    }
}

/// A contact point at which two bodies touch or nearly touch.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ContactPoint {
    /// The first collider; it has the smaller handle.
    pub a: ColliderId,
    /// The second.
    pub b: ColliderId,
    /// Body of the first; `None` is the world.
    pub body_a: Option<BodyId>,
    /// Body of the second.
    pub body_b: Option<BodyId>,
    /// Midway between the two surfaces, world, m.
    pub point: Vec3,
    /// Unit normal from a to b, world.
    pub normal: Vec3,
    /// Distance of the surfaces along the normal, m; negative for overlap. Its rate is normal · (v_b − v_a) at the point.
    pub gap: f64,
    /// Name of the point within its pair. It is made of the corners and edges in contact, and stays the same from step to step while they do.
    pub feature: u64,
    /// Coulomb friction coefficient of the pair.
    pub friction: f64,
    /// Restitution coefficient of the pair.
    pub restitution: f64,
}

/// The nearest points of two colliders.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Distance {
    /// Distance, m; for overlap the negative length of the shortest translation that separates them.
    pub distance: f64,
    /// Point on the first collider, world, m.
    pub point_a: Vec3,
    /// Point on the second collider, world, m.
    pub point_b: Vec3,
}

/// The closest of all pairs.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Closest {
    /// The first collider.
    pub a: ColliderId,
    /// The second.
    pub b: ColliderId,
    /// Their distance.
    pub distance: Distance,
}

/// A collider at its pose for this query.
#[derive(Clone, Copy)]
pub(crate) struct PosedCollider {
    pub pose: Pose,
    lo: Vec3,
    hi: Vec3,
    pub id: u32,
    reach: f64,
}

/// Memory of queries. No content is used by later queries, so several runs may share it, and it may be discarded.
pub struct Scratch {
    seen: Vec<PosedCollider>,
    order: Vec<(f64, u32)>,
    pairs: Vec<(u32, u32)>,
    room: Room,
}

impl Scratch {
    /// Reserves memory for the given colliders. It grows when necessary.
    #[must_use]
    pub fn new(colliders: &Colliders) -> Self {
        let n = colliders.len();
        Self {
            seen: Vec::with_capacity(n),
            order: Vec::with_capacity(n),
            pairs: Vec::with_capacity(8 * n),
            room: Room::default(),
        }
    }
}

fn overlap(a: &PosedCollider, b: &PosedCollider) -> bool {
    (0..3).all(|k| a.lo[k] <= b.hi[k] && b.lo[k] <= a.hi[k])
}

impl Colliders {
    /// Writes all contact points with a gap of at most `query.margin` (plus `query.reach` of both) to `out`, which is cleared first, sorted by pair
    /// and then by feature. `poses` returns `X_WB` of a body, and the pose of the world (usually the identity) for `None`.
    ///
    /// The result is a pure function of the poses. No allocation occurs once `scratch` and `out` have reached their size. A pair with a pose that is
    /// not finite has no points.
    pub fn contacts(
        &self,
        scratch: &mut Scratch,
        query: &Query,
        poses: impl Fn(Option<BodyId>) -> Pose,
        out: &mut Vec<ContactPoint>,
    ) {
        out.clear();
        self.look(scratch, query, &poses);
        self.sweep(scratch);
        let Scratch { seen, pairs, room, .. } = scratch;
        let mut at = 0;
        for (i, j) in pairs.iter() {
            while seen[at].id != *i {
                at += 1;
            }
            let other = seen[at..].binary_search_by_key(j, |s| s.id).map_or(at, |k| at + k);
            let (a, b) = (&seen[at], &seen[other]);
            self.touch(a, b, query.detail, query.margin + (a.reach + b.reach), room);
            let from = out.len();
            self.report([a, b], &room.points, out);
            if out.len() > from {
                let size = self.size(a.id, b.id, query.detail);
                self.uncover([a, b], (query.detail, size), seen, (from, out));
            }
            out[from..].sort_unstable_by_key(|c| c.feature);
        }
    }

    /// Computes the poses of all shown colliders.
    fn look(&self, scratch: &mut Scratch, query: &Query, poses: &impl Fn(Option<BodyId>) -> Pose) {
        scratch.seen.clear();
        for id in self.ids() {
            let hidden = match query.hiding {
                Some(h) => h.of(id),
                None => self.spec(id).hidden,
            };
            let item = &self.items[id.index()];
            let (Visibility::Shown, Some(solid)) = (hidden, item.solid(query.detail)) else {
                continue;
            };
            let pose = poses(item.body) * item.pose;
            if pose.is_finite() {
                let reach = query.reach.get(id.index()).copied().unwrap_or(0.0);
                let (lo, hi) = around(solid, &pose, item.padding + query.margin / 2.0 + reach);
                scratch.seen.push(PosedCollider { pose, lo, hi, id: id.0, reach });
            }
        }
    }

    /// Collects the pairs whose boxes overlap and that the rules include, in order.
    fn sweep(&self, scratch: &mut Scratch) {
        let Scratch { seen, order, pairs, .. } = scratch;
        let axis = widest(seen);
        order.clear();
        order.extend(seen.iter().enumerate().map(|(i, s)| (s.lo[axis], i as u32)));
        order.sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        pairs.clear();
        for (k, (_, i)) in order.iter().enumerate() {
            let a = &seen[*i as usize];
            for (low, j) in &order[k + 1..] {
                if *low > a.hi[axis] {
                    break;
                }
                let b = &seen[*j as usize];
                if self.meets[a.id as usize * self.items.len() + b.id as usize] && overlap(a, b) {
                    pairs.push((a.id.min(b.id), a.id.max(b.id)));
                }
            }
        }
        pairs.sort_unstable();
    }

    /// Computes the points of a pair in the frame of the first, reduced to few; for a cylinder with discs, the points of each disc.
    fn touch(
        &self,
        a: &PosedCollider,
        b: &PosedCollider,
        detail: Detail,
        margin: f64,
        room: &mut Room,
    ) {
        let size = self.size(a.id, b.id, detail);
        let of = |s: &PosedCollider| self.items[s.id as usize].discs.as_ref();
        let (discs, which) = match (detail, of(a), of(b)) {
            (Detail::Fine, _, Some(discs)) => (discs, Rolls::Second),
            (Detail::Fine, Some(discs), None) => (discs, Rolls::First),
            _ => {
                self.points(a, b, detail, (margin, Want::All), room);
                return thin(&mut room.points, size);
            }
        };
        let (ia, ib) = (&self.items[a.id as usize], &self.items[b.id as usize]);
        let Some(other) = (if which == Rolls::Second { ia } else { ib }).solid(detail) else {
            return room.points.clear();
        };
        let (X_AB, padding) = (relative(a, b), [ia.padding, ib.padding]);
        let ask = PairQuery { margin, padding, size, want: Want::All };
        let mut all = std::mem::take(&mut room.gathered);
        all.clear();
        for (k, z) in discs.places().iter().enumerate() {
            discs.touch((other, which, *z), &X_AB, &ask, room);
            thin(&mut room.points, size);
            let named = |p: &Point| Point { name: mix(p.name, k as u64), ..*p };
            all.extend(room.points.iter().map(named));
        }
        room.gathered = std::mem::replace(&mut room.points, all);
    }

    /// Computes the points of a pair in the frame of the first.
    fn points(
        &self,
        a: &PosedCollider,
        b: &PosedCollider,
        detail: Detail,
        (margin, want): (f64, Want),
        room: &mut Room,
    ) {
        let (ia, ib) = (&self.items[a.id as usize], &self.items[b.id as usize]);
        let (Some(sa), Some(sb)) = (ia.solid(detail), ib.solid(detail)) else { return };
        let size = self.size(a.id, b.id, detail);
        let ask = PairQuery { margin, padding: [ia.padding, ib.padding], size, want };
        pair(sa, sb, &relative(a, b), &ask, room);
    }

    /// Returns the length to which tolerances of a pair are relative: the size of the smaller solid, m.
    fn size(&self, i: u32, j: u32, detail: Detail) -> f64 {
        let of = |i: u32| self.items[i as usize].solid(detail).map_or(1.0, |s| s.size);
        of(i).min(of(j))
    }

    fn report(&self, [a, b]: [&PosedCollider; 2], points: &[Point], out: &mut Vec<ContactPoint>) {
        let (ca, cb) = (ColliderId(a.id), ColliderId(b.id));
        let (body_a, body_b) = (self.body(ca), self.body(cb));
        let (R, at) = (a.pose.rotation.to_rotation_matrix(), a.pose.position);
        let of = |s: &PosedCollider, spec: &ColliderSpec, p: &Vec3| match &spec.varies {
            Some(varies) => (varies.0)(&(s.pose.rotation.inverse() * (p - s.pose.position))),
            None => spec.material,
        };
        let (sa, sb) = (self.spec(ca), self.spec(cb));
        let law = self.law(ca, cb).map(|k| &self.rules().laws[k]);
        let pair = |ma: Material, mb: Material| {
            let mean = || (ma.friction * mb.friction).sqrt();
            let larger = || ma.restitution.max(mb.restitution);
            (
                law.and_then(|l| l.friction).unwrap_or_else(mean),
                law.and_then(|l| l.restitution).unwrap_or_else(larger),
            )
        };
        let same = sa.varies.is_none() && sb.varies.is_none();
        let everywhere = same.then(|| pair(sa.material, sb.material));
        out.extend(points.iter().map(|p| {
            let point = R * ((p.pa + p.pb) / 2.0) + at;
            let (friction, restitution) =
                everywhere.unwrap_or_else(|| pair(of(a, sa, &point), of(b, sb, &point)));
            ContactPoint {
                a: ca,
                b: cb,
                body_a,
                body_b,
                point,
                normal: R * p.n,
                gap: p.gap,
                feature: p.name,
                friction,
                restitution,
            }
        }));
    }

    /// Returns the nearest points of two colliders, regardless of the rules and of their distance; `None` when there are none (two half spaces, a
    /// pose that is not finite). Surfaces are queried with increasing margins, so a query far from one costs as much as all of its triangles.
    #[track_caller]
    pub fn distance(
        &self,
        scratch: &mut Scratch,
        a: ColliderId,
        b: ColliderId,
        detail: Detail,
        poses: impl Fn(Option<BodyId>) -> Pose,
    ) -> Option<Distance> {
        let see = |id: ColliderId| {
            let item = &self.items[id.index()];
            let pose = poses(item.body) * item.pose;
            let (lo, hi) = around(item.solid(detail)?, &pose, item.padding);
            pose.is_finite().then_some(PosedCollider { pose, lo, hi, id: id.0, reach: 0.0 })
        };
        self.between(&see(a)?, &see(b)?, detail, f64::INFINITY, &mut scratch.room)
    }

    fn between(
        &self,
        a: &PosedCollider,
        b: &PosedCollider,
        detail: Detail,
        limit: f64,
        room: &mut Room,
    ) -> Option<Distance> {
        let mut margin = (apart(a, b) + self.size(a.id, b.id, detail)).min(limit);
        loop {
            self.points(a, b, detail, (margin, Want::Least), room);
            let low = least(&room.points);
            if let Some(p) = room.points.iter().find(|p| p.gap <= low) {
                return Some(Distance {
                    distance: p.gap,
                    point_a: a.pose.transform_point(&p.pa),
                    point_b: a.pose.transform_point(&p.pb),
                });
            }
            if margin >= limit.min(1e12) {
                return None;
            }
            margin = (margin * 4.0).min(limit);
        }
    }

    /// Returns the closest of all pairs that the rules include within `query.margin`, which may be infinite.
    pub fn closest(
        &self,
        scratch: &mut Scratch,
        query: &Query,
        poses: impl Fn(Option<BodyId>) -> Pose,
    ) -> Option<Closest> {
        self.nearest_of(scratch, query, &poses, |a, b| self.meet(a, b))
    }

    /// Returns the closest pair of colliders of two bodies, regardless of the rules; `None` is the world. `query.margin` is the search distance and
    /// may be infinite.
    pub fn distance_of_bodies(
        &self,
        scratch: &mut Scratch,
        query: &Query,
        bodies: [Option<BodyId>; 2],
        poses: impl Fn(Option<BodyId>) -> Pose,
    ) -> Option<Closest> {
        let [p, q] = bodies;
        self.nearest_of(scratch, query, &poses, |a, b| {
            let pair = (self.body(a), self.body(b));
            p != q && (pair == (p, q) || pair == (q, p))
        })
    }

    fn nearest_of(
        &self,
        scratch: &mut Scratch,
        query: &Query,
        poses: &impl Fn(Option<BodyId>) -> Pose,
        wanted: impl Fn(ColliderId, ColliderId) -> bool,
    ) -> Option<Closest> {
        self.look(scratch, &Query { margin: 0.0, ..*query }, poses);
        let Scratch { seen, room, .. } = scratch;
        let mut best: Option<Closest> = None;
        for i in 0..seen.len() {
            for j in i + 1..seen.len() {
                let (a, b) = (&seen[i], &seen[j]);
                let limit = best.map_or(query.margin, |c| c.distance.distance);
                if !wanted(ColliderId(a.id), ColliderId(b.id)) || apart(a, b) > limit.max(0.0) {
                    continue;
                }
                if let Some(distance) = self.between(a, b, query.detail, limit, room)
                    && best.is_none_or(|c| distance.distance < c.distance.distance)
                {
                    best = Some(Closest { a: ColliderId(a.id), b: ColliderId(b.id), distance });
                }
            }
        }
        best
    }
}

/// Returns `X_AB`.
fn relative(a: &PosedCollider, b: &PosedCollider) -> Pose {
    let back = a.pose.rotation.inverse();
    Pose::new(back * b.pose.rotation, back * (b.pose.position - a.pose.position))
}

/// Returns a lower bound for the distance of two boxes, m.
fn apart(a: &PosedCollider, b: &PosedCollider) -> f64 {
    let gap = |k: usize| f64::max(0.0, f64::max(a.lo[k] - b.hi[k], b.lo[k] - a.hi[k]));
    Vec3::new(gap(0), gap(1), gap(2)).norm()
}

/// Returns the axis along which finite boxes are spread most.
fn widest(seen: &[PosedCollider]) -> usize {
    let (mut sum, mut square, mut count) = (Vec3::zeros(), Vec3::zeros(), 0.0);
    let origin = seen.iter().map(|s| s.pose.position).next().unwrap_or_default();
    for s in seen.iter().filter(|s| s.lo.x.is_finite()) {
        let p = s.pose.position - origin;
        (sum, square, count) = (sum + p, square + p.component_mul(&p), count + 1.0);
    }
    let variance = square - sum.component_mul(&sum) / f64::max(count, 1.0);
    (0..3).fold(0, |best, k| if variance[k] > variance[best] { k } else { best })
}
