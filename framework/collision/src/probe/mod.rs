//! Yes or no, and how far: what planners ask thousands of times, with padding, hiding, detail and pairs that change between
//! questions without building anything.
//!
//! ```text
//! a ball around each shape                                  most pairs end here
//! the ball of one against the box, cylinder or segment of the other
//! nearest points of the cores, until one direction shows enough between them
//! ```
//! An answer depends on the poses and settings alone. The order in which pairs are looked at does too: those whose balls
//! overlap most go first, since a hit among them ends a question.

mod distance;
mod live;

use crate::colliders::{ColliderId, Colliders};
use crate::core::{Core, Placed};
use crate::manifold::{Most, Room};
use crate::near::exact;
use crate::pairs::close;
use crate::pieces::{self, matrix};
use crate::shape::{Detail, Visibility};
use crate::solid::{Kind, Solid};
use linkwork_multibody::BodyId;
use linkwork_multibody::spatial::{Mat3, Pose, Vec3};
use std::cmp::Ordering;

/// A collider at its place.
#[derive(Clone, Copy)]
struct Whereabouts {
    R: Mat3,
    p: Vec3,
    ball: Vec3,
    radius: f64,
}

impl Whereabouts {
    const NONE: f64 = f64::NEG_INFINITY;
}

/// Settings and memory of questions to one [`Colliders`]. After [`Probe::new`] no question allocates anything, the caller's lists apart.
/// Memory: 8 bytes for each triangle of the largest mesh or height field, and 0.5 MB where there are cylinders or hulls of many edges.
pub struct Probe {
    /// Which shape of each.
    detail: Vec<Detail>,
    padding: Vec<f64>,
    hidden: Vec<bool>,
    /// Row after row, both halves.
    meets: Vec<bool>,
    /// How far each may come, m: for swept questions.
    reach: Vec<f64>,
    /// Point clouds and voxel maps as they are now: the fine shapes of these colliders.
    live: Vec<Option<Box<Solid>>>,
    /// Balls in the colliders' frames, fine and coarse.
    balls: Vec<[(Vec3, f64); 2]>,
    /// All pairs that are looked at, also row after row, and whether that is up to date.
    pairs: Vec<(u32, u32)>,
    looked: Vec<bool>,
    stale: bool,
    /// `X_BC` of each.
    frames: Vec<(Mat3, Vec3)>,
    places: Vec<Whereabouts>,
    /// Middles of balls x, y, z and bounds, for questions about all of them at once, and the answers for one.
    lanes: [Vec<f64>; 4],
    close: Vec<bool>,
    /// Pairs whose balls are near; by how much of the smaller they are apart, where that was asked for.
    near: Vec<(f64, (u32, u32))>,
    room: Room,
}

impl std::fmt::Debug for Probe {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Probe").field("colliders", &self.places.len()).finish_non_exhaustive()
    }
}

impl Probe {
    /// With the padding, hiding and pairs of `colliders`; it must be used with no other.
    #[must_use]
    pub fn new(colliders: &Colliders) -> Self {
        let n = colliders.len();
        let of = |id: ColliderId, detail| {
            colliders.items[id.index()]
                .solid(detail)
                .map_or((Vec3::zeros(), Whereabouts::NONE), ball)
        };
        let place = Whereabouts {
            R: Mat3::identity(),
            p: Vec3::zeros(),
            ball: Vec3::zeros(),
            radius: Whereabouts::NONE,
        };
        let room = n * n.saturating_sub(1) / 2;
        let solids = colliders
            .items
            .iter()
            .flat_map(|i| [Detail::Fine, Detail::Coarse].map(|d| i.solid(d)))
            .flatten();
        let live = |id: ColliderId| {
            let solid = colliders.items[id.index()].solid(Detail::Fine);
            let Kind::Pieces(p) = &solid?.kind else { return None };
            Some(Box::new(Solid::around(Kind::Pieces(p.clone()))))
        };
        let mut probe = Self {
            detail: vec![Detail::Fine; n],
            padding: colliders.items.iter().map(|i| i.padding).collect(),
            hidden: colliders
                .ids()
                .map(|i| colliders.hiding().of(i) == Visibility::Hidden)
                .collect(),
            meets: colliders.meets.clone(),
            reach: vec![0.0; n],
            live: colliders.ids().map(live).collect(),
            balls: colliders.ids().map(|i| [of(i, Detail::Fine), of(i, Detail::Coarse)]).collect(),
            pairs: Vec::with_capacity(room),
            looked: vec![false; n * n],
            stale: true,
            frames: colliders.items.iter().map(|i| matrix(&i.pose)).collect(),
            places: vec![place; n],
            lanes: std::array::from_fn(|_| vec![0.0; n]),
            close: vec![false; n],
            near: Vec::with_capacity(room),
            room: Room::new(&Most::of(solids)),
        };
        probe.refresh();
        probe
    }

    /// Another instance with the same settings, and memory of its own.
    #[must_use]
    pub fn fork(&self, colliders: &Colliders) -> Self {
        let mut new = Self::new(colliders);
        new.detail.copy_from_slice(&self.detail);
        new.padding.copy_from_slice(&self.padding);
        new.hidden.copy_from_slice(&self.hidden);
        new.meets.copy_from_slice(&self.meets);
        for (new, own) in new.live.iter_mut().zip(&self.live) {
            if let (Some(new), Some(Solid { kind: Kind::Pieces(p), .. })) = (new, own.as_deref()) {
                **new = Solid::around(Kind::Pieces(p.clone()));
            }
        }
        new.balls.copy_from_slice(&self.balls);
        new.stale = true;
        new
    }

    /// The distance of a collider's farthest point from its body's origin, at most, m, padding counted, as it is now; 0 where it has none (a half
    /// space).
    #[must_use]
    #[track_caller]
    pub fn extent(&self, colliders: &Colliders, id: ColliderId) -> f64 {
        let item = &colliders.items[id.index()];
        let far = |(centre, radius): &(Vec3, f64)| {
            let far = item.pose.transform_point(centre).norm() + radius + self.padding[id.index()];
            if far.is_finite() { far } else { 0.0 }
        };
        self.balls[id.index()].iter().map(far).fold(0.0, f64::max)
    }

    /// The fine or the coarse shape of a collider from now on; where it has no coarse one, its fine shape.
    #[track_caller]
    pub fn set_detail(&mut self, id: ColliderId, detail: Detail) {
        self.detail[id.index()] = detail;
    }

    /// Thickness around a shape, m, instead of what its specification says. Panics when it is negative or not finite.
    #[track_caller]
    pub fn set_padding(&mut self, id: ColliderId, padding: f64) {
        assert!(padding >= 0.0 && padding.is_finite(), "a padding of {padding} m");
        self.padding[id.index()] = padding;
    }

    /// Thickness around a shape as it is now, m.
    #[must_use]
    #[track_caller]
    pub fn padding(&self, id: ColliderId) -> f64 {
        self.padding[id.index()]
    }

    /// Hides or shows a collider.
    #[track_caller]
    pub fn set_visibility(&mut self, id: ColliderId, visibility: Visibility) {
        self.hidden[id.index()] = visibility == Visibility::Hidden;
        self.stale = true;
    }

    /// Whether a pair is looked at, whatever the rules said.
    #[track_caller]
    pub fn set_meet(&mut self, a: ColliderId, b: ColliderId, meet: bool) {
        let n = self.places.len();
        let meet = meet && a != b;
        self.meets[a.index() * n + b.index()] = meet;
        self.meets[b.index() * n + a.index()] = meet;
        self.stale = true;
    }

    /// Whether a pair is looked at when both are shown.
    #[must_use]
    #[track_caller]
    pub fn meet(&self, a: ColliderId, b: ColliderId) -> bool {
        self.meets[a.index() * self.places.len() + b.index()]
    }

    /// How far a collider may come beyond its padding, m: for questions about a motion.
    #[track_caller]
    pub fn set_reach(&mut self, id: ColliderId, reach: f64) {
        self.reach[id.index()] = reach;
    }

    /// All pairs that are looked at, by identifiers.
    pub fn pairs(&mut self) -> impl ExactSizeIterator<Item = (ColliderId, ColliderId)> + '_ {
        self.refresh();
        self.pairs.iter().map(|(i, j)| (ColliderId(*i), ColliderId(*j)))
    }

    /// Puts all colliders where the bodies are: `X_WB`, the world's own for `None`. A collider with a pose that is not finite
    /// meets nothing.
    pub fn place(&mut self, colliders: &Colliders, poses: impl Fn(Option<BodyId>) -> Pose) {
        self.place_frames(colliders, |body| matrix(&poses(body)));
    }

    /// As [`place`](Self::place), with poses as rotation matrices and places of origins, m.
    pub fn place_frames(
        &mut self,
        colliders: &Colliders,
        frames: impl Fn(Option<BodyId>) -> (Mat3, Vec3),
    ) {
        for (i, item) in colliders.items.iter().enumerate() {
            let (own, at) = &self.frames[i];
            let (R, p) = frames(item.body);
            let (R, p) = (R * own, R * at + p);
            let which = usize::from(self.detail[i] == Detail::Coarse);
            let (centre, radius) = self.balls[i][which];
            let finite = R.iter().chain(p.iter()).all(|x| x.is_finite());
            let radius = if finite { radius } else { Whereabouts::NONE };
            self.places[i] = Whereabouts { R, p, ball: R * centre + p, radius };
        }
    }

    /// A pair that touches or overlaps, padding counted, or `None`. The same poses and settings give the same pair.
    /// After [`place`](Self::place).
    pub fn first_hit(&mut self, colliders: &Colliders) -> Option<(ColliderId, ColliderId)> {
        self.look(0.0);
        self.measure();
        // The deepest balls first: most hits are found there, and often at once, before the rest is in order.
        let least = (0..self.near.len()).min_by(|i, j| before(&self.near[*i], &self.near[*j]));
        if let Some(least) = least {
            self.near.swap(0, least);
        }
        for at in 0..self.near.len() {
            if at == 1 {
                self.near[1..].sort_unstable_by(before);
            }
            let (i, j) = self.near[at].1;
            if self.touch(colliders, i as usize, j as usize) {
                return Some((ColliderId(i), ColliderId(j)));
            }
        }
        None
    }

    /// All pairs that touch or overlap, by identifiers, into `out` (emptied first). After [`place`](Self::place).
    pub fn hits(&mut self, colliders: &Colliders, out: &mut Vec<(ColliderId, ColliderId)>) {
        out.clear();
        self.look(0.0);
        for at in 0..self.near.len() {
            let (i, j) = self.near[at].1;
            if self.touch(colliders, i as usize, j as usize) {
                out.push((ColliderId(i), ColliderId(j)));
            }
        }
    }

    /// Pairs of shown colliders that meet.
    fn refresh(&mut self) {
        if !std::mem::take(&mut self.stale) {
            return;
        }
        let n = self.places.len();
        self.pairs.clear();
        self.looked.fill(false);
        for i in (0..n).filter(|i| !self.hidden[*i]) {
            for j in (i + 1..n).filter(|j| !self.hidden[*j]) {
                if self.meets[i * n + j] {
                    self.pairs.push((i as u32, j as u32));
                    self.looked[i * n + j] = true;
                }
            }
        }
    }

    /// Pairs whose balls are within `limit`, in their order.
    fn look(&mut self, limit: f64) {
        self.refresh();
        self.near.clear();
        let n = self.places.len();
        for (i, place) in self.places.iter().enumerate() {
            let bound = place.radius + self.padding[i] + self.reach[i];
            let [x, y, z, r] = &mut self.lanes;
            (x[i], y[i], z[i], r[i]) = (place.ball.x, place.ball.y, place.ball.z, bound);
        }
        let [x, y, z, r] = &self.lanes;
        for i in 0..n {
            let (x0, y0, z0, reach, from) = (x[i], y[i], z[i], r[i] + limit, i + 1);
            let close = &mut self.close[from..n];
            let rest = x[from..n].iter().zip(&y[from..n]).zip(&z[from..n]).zip(&r[from..n]);
            for (close, (((x, y), z), r)) in close.iter_mut().zip(rest) {
                let (x, y, z, reach) = (x - x0, y - y0, z - z0, reach + r);
                let square = x * x + y * y + z * z;
                // Rounding of the squares. What is nowhere has a reach below zero, or none.
                *close = (reach >= 0.0) & (square <= reach * reach * (1.0 + 1e-14));
            }
            let looked = &self.looked[i * n + from..(i + 1) * n];
            for (k, (close, looked)) in close.iter().zip(looked).enumerate() {
                if close & looked {
                    self.near.push((0.0, (i as u32, (from + k) as u32)));
                }
            }
        }
    }

    /// How far the balls of near pairs are apart, as part of the smaller one. A ball deep in another, as that about a floor, tells nothing.
    fn measure(&mut self) {
        for at in 0..self.near.len() {
            let (i, j) = self.near[at].1;
            let (a, b) = (i as usize, j as usize);
            let size = self.places[a].radius.min(self.places[b].radius);
            let apart = self.balls_apart(a, b);
            self.near[at].0 = if apart < -2.0 * size { 0.0 } else { apart / size };
        }
    }

    /// At least this is between two colliders, m; infinite for what is nowhere.
    fn balls_apart(&self, a: usize, b: usize) -> f64 {
        let (pa, pb) = (&self.places[a], &self.places[b]);
        let thick = self.thick(a) + self.thick(b);
        (pb.ball - pa.ball).norm() - pa.radius - pb.radius - thick
    }

    fn thick(&self, i: usize) -> f64 {
        self.padding[i] + self.reach[i]
    }

    /// Whether two colliders touch.
    fn touch(&mut self, colliders: &Colliders, i: usize, j: usize) -> bool {
        let of = |k: usize| solid(&self.live, colliders, k, self.detail[k]);
        let (Some(a), Some(b)) = (of(i), of(j)) else { return false };
        let (pa, pb) = (&self.places[i], &self.places[j]);
        let thick = self.thick(i) + self.thick(j);
        let pieces = |s: &Solid| matches!(s.kind, Kind::Pieces(_));
        if pieces(a) || pieces(b) {
            let place = (pa.R.tr_mul(&pb.R), pa.R.tr_mul(&(pb.p - pa.p)));
            let (place, size) = ((&place.0, &place.1), a.size.min(b.size));
            if let Some(touch) =
                pieces::near(&a.kind, &b.kind, place, (thick, size), &mut self.room)
            {
                return touch;
            }
        }
        let (Kind::Convex { core: ca, round: ra }, Kind::Convex { core: cb, round: rb }) =
            (&a.kind, &b.kind)
        else {
            return self.between(colliders, i, j, 0.0).is_some_and(|d| d.distance <= 0.0);
        };
        let size = a.size.min(b.size);
        // Both in axes of the world, about the origin of the first: no digits are lost far away.
        let a = Placed { core: ca, R: pa.R, p: Vec3::zeros() };
        let b = Placed { core: cb, R: pb.R, p: pb.p - pa.p };
        let limit = thick + ra + rb;
        let (ball_a, ball_b) = (pa.ball - pa.p, pb.ball - pa.p);
        if (exact(ca) && a.toward(&ball_b).norm() > pb.radius - rb + limit)
            || (exact(cb) && b.toward(&ball_a).norm() > pa.radius - ra + limit)
        {
            return false;
        }
        close(&a, &b, limit, &(ball_b - ball_a), size, &mut self.room)
    }
}

/// The order in which near pairs are looked at.
fn before(a: &(f64, (u32, u32)), b: &(f64, (u32, u32))) -> Ordering {
    a.0.total_cmp(&b.0).then(a.1.cmp(&b.1))
}

/// The geometry of a collider as it is now.
fn solid<'a>(
    live: &'a [Option<Box<Solid>>],
    colliders: &'a Colliders,
    k: usize,
    detail: Detail,
) -> Option<&'a Solid> {
    let item = &colliders.items[k];
    match &live[k] {
        Some(live) if !item.is_coarse(detail) => Some(live),
        _ => item.solid(detail),
    }
}

/// A ball around a solid in its frame: centre and radius, infinite for what has no end; of no radius for what has no pieces.
fn ball(solid: &Solid) -> (Vec3, f64) {
    let finite = solid.lo.iter().chain(solid.hi.iter()).all(|x| x.is_finite());
    if !finite {
        return (Vec3::zeros(), f64::INFINITY);
    }
    if matches!(&solid.kind, Kind::Pieces(p) if p.count() == 0) {
        return (Vec3::zeros(), Whereabouts::NONE);
    }
    let centre = (solid.lo + solid.hi) / 2.0;
    let radius = match &solid.kind {
        Kind::Convex { core: Core::Point, round } => *round,
        Kind::Convex { core: Core::Segment { h }, round } => h + round,
        Kind::Convex { core: Core::Ellipsoid { half }, round } => half.max() + round,
        Kind::Convex { core: Core::Cylinder { r, h }, round } => r.hypot(*h) + round,
        Kind::Convex { core: Core::Poly(p), round } => {
            p.vertices.iter().map(|v| (v - centre).norm()).fold(0.0, f64::max) + round
        }
        _ => (solid.hi - solid.lo).norm() / 2.0,
    };
    // Rounding of a centre and a norm.
    (centre, radius * (1.0 + 1e-12))
}
