//! Collision checks and distances for planners, which make thousands of queries. Padding, visibility, detail and pairs can change between queries
//! without rebuilding.
//!
//! ```text
//! bounding spheres                                          reject most pairs
//! the sphere of one against the box, cylinder or segment of the other
//! nearest points of the cores, until one direction proves a sufficient separation
//! ```
//! A result depends only on the poses and settings. So does the order in which pairs are tested: pairs whose spheres overlap most come first, because
//! a hit ends the query.

mod distance;
mod live;

use crate::colliders::Colliders;
use crate::contact_points::{Most, Room};
use crate::core::{Core, Placed};
use crate::item::ColliderId;
use crate::near::exact;
use crate::pairs::close;
use crate::pieces::{self, matrix};
use crate::shape::{Detail, Visibility};
use crate::solid::{Kind, Solid};
use linkwork_multibody::BodyId;
use linkwork_multibody::spatial::{Mat3, Pose, Vec3};
use std::cmp::Ordering;

/// A collider at its pose.
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

/// Settings and memory for queries of one [`Colliders`]. After [`Probe::new`] no query allocates, except in the caller's lists. Memory: 8 bytes for
/// each triangle of the largest mesh or height field, and 0.5 MB if there are cylinders or hulls with many edges.
pub struct Probe {
    /// The selected shape of each collider.
    detail: Vec<Detail>,
    padding: Vec<f64>,
    hidden: Vec<bool>,
    /// Whether each pair is checked, row after row, both halves.
    meets: Vec<bool>,
    /// Greatest displacement of each collider, m, for queries about a motion.
    reach: Vec<f64>,
    /// Current point clouds and voxel maps: the fine shapes of these colliders.
    live: Vec<Option<Box<Solid>>>,
    /// Bounding spheres in the colliders' frames, fine and coarse.
    balls: Vec<[(Vec3, f64); 2]>,
    /// All checked pairs, also as a table row after row; `stale` marks that they must be updated.
    pairs: Vec<(u32, u32)>,
    looked: Vec<bool>,
    stale: bool,
    /// `X_BC` of each collider.
    frames: Vec<(Mat3, Vec3)>,
    places: Vec<Whereabouts>,
    /// Centres x, y, z and radii of the spheres, for SIMD queries over all of them, and their results.
    lanes: [Vec<f64>; 4],
    close: Vec<bool>,
    /// Pairs whose spheres are near, with the distance of the spheres relative to the smaller one where it was computed.
    near: Vec<(f64, (u32, u32))>,
    room: Room,
}

impl std::fmt::Debug for Probe {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Probe").field("colliders", &self.places.len()).finish_non_exhaustive()
    }
}

impl Probe {
    /// Creates a probe with the padding, visibility and pairs of `colliders`. Use it only with these colliders.
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

    /// Creates another instance with the same settings and its own memory.
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

    /// Returns an upper bound for the distance of a collider's points from its body's origin, m, including the current padding; 0 for an unbounded
    /// collider (a half space).
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

    /// Selects the fine or the coarse shape of a collider. A collider without a coarse shape uses its fine shape.
    #[track_caller]
    pub fn set_detail(&mut self, id: ColliderId, detail: Detail) {
        self.detail[id.index()] = detail;
    }

    /// Sets the padding around a shape, m, and overrides its specification. Panics when it is negative or not finite.
    #[track_caller]
    pub fn set_padding(&mut self, id: ColliderId, padding: f64) {
        assert!(padding >= 0.0 && padding.is_finite(), "a padding of {padding} m");
        self.padding[id.index()] = padding;
    }

    /// Returns the current padding around a shape, m.
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

    /// Sets whether a pair is checked, regardless of the rules.
    #[track_caller]
    pub fn set_meet(&mut self, a: ColliderId, b: ColliderId, meet: bool) {
        let n = self.places.len();
        let meet = meet && a != b;
        self.meets[a.index() * n + b.index()] = meet;
        self.meets[b.index() * n + a.index()] = meet;
        self.stale = true;
    }

    /// Returns true if a pair is checked while both colliders are shown.
    #[must_use]
    #[track_caller]
    pub fn meet(&self, a: ColliderId, b: ColliderId) -> bool {
        self.meets[a.index() * self.places.len() + b.index()]
    }

    /// Sets the greatest displacement of a collider beyond its padding, m, for queries about a motion.
    #[track_caller]
    pub fn set_reach(&mut self, id: ColliderId, reach: f64) {
        self.reach[id.index()] = reach;
    }

    /// Returns all checked pairs, sorted by handles.
    pub fn pairs(&mut self) -> impl ExactSizeIterator<Item = (ColliderId, ColliderId)> + '_ {
        self.refresh();
        self.pairs.iter().map(|(i, j)| (ColliderId(*i), ColliderId(*j)))
    }

    /// Moves all colliders to the poses `X_WB` of the bodies; `None` is the world. A collider with a pose that is not finite collides with nothing.
    pub fn place(&mut self, colliders: &Colliders, poses: impl Fn(Option<BodyId>) -> Pose) {
        self.place_frames(colliders, |body| matrix(&poses(body)));
    }

    /// Like [`place`](Self::place), with poses as rotation matrices and positions of origins, m.
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

    /// Returns a pair that touches or overlaps, including padding, or `None`. The same poses and settings give the same pair. Call
    /// [`place`](Self::place) first.
    pub fn first_hit(&mut self, colliders: &Colliders) -> Option<(ColliderId, ColliderId)> {
        self.look(0.0);
        self.measure();
        // Test the pair with the deepest spheres first: most hits are found there, before the other pairs are sorted.
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

    /// Writes all pairs that touch or overlap to `out`, which is cleared first, sorted by handles. Call [`place`](Self::place) first.
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

    /// Updates the list of checked pairs of shown colliders.
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

    /// Collects the pairs whose spheres are within `limit`, in their order.
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
                // The factor covers the round-off of the squares. Colliders without a valid pose have a negative reach or NaN.
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

    /// Computes how far the spheres of near pairs are apart, relative to the smaller one. Spheres deep inside each other, for example inside the
    /// sphere around a floor, say nothing about the distance of the shapes.
    fn measure(&mut self) {
        for at in 0..self.near.len() {
            let (i, j) = self.near[at].1;
            let (a, b) = (i as usize, j as usize);
            let size = self.places[a].radius.min(self.places[b].radius);
            let apart = self.balls_apart(a, b);
            self.near[at].0 = if apart < -2.0 * size { 0.0 } else { apart / size };
        }
    }

    /// Returns a lower bound for the distance of two colliders, m; infinite for colliders without a valid pose.
    fn balls_apart(&self, a: usize, b: usize) -> f64 {
        let (pa, pb) = (&self.places[a], &self.places[b]);
        let thick = self.thick(a) + self.thick(b);
        (pb.ball - pa.ball).norm() - pa.radius - pb.radius - thick
    }

    fn thick(&self, i: usize) -> f64 {
        self.padding[i] + self.reach[i]
    }

    /// Returns true if two colliders touch.
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
        // Both are in world axes, relative to the origin of the first, to avoid cancellation far from the origin.
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

/// Returns the order in which near pairs are tested.
fn before(a: &(f64, (u32, u32)), b: &(f64, (u32, u32))) -> Ordering {
    a.0.total_cmp(&b.0).then(a.1.cmp(&b.1))
}

/// Returns the current geometry of a collider.
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

/// Returns a bounding sphere of a solid in its frame: centre and radius, which is infinite for an unbounded solid and zero for a solid without
/// pieces.
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
    // The factor covers the round-off of a centre and a norm.
    (centre, radius * (1.0 + 1e-12))
}
