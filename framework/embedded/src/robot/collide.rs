//! Collision queries at any configuration: whether there is a collision, which colliders touch, distances, and checks along a path.
//!
//! ```text
//! path qa → qb, all coordinates in proportion; a piece has the middle m and half its length:
//! every point of a collider stays within r = Σ_i bound_i |Δq_i| of its position at m
//! no contact at m with all shapes thickened by r    the piece is free
//! contact at m                                      the path is not free
//! otherwise                                         check both halves
//! ```
//! Thin obstacles are therefore not missed.

use super::{Hold, Mount, Robot};
use crate::collision::{Carrier, Scene, matrix};
use crate::error::RobotError;
use crate::linkage::Link;
use crate::model::{Object, RobotModel};
use crate::part::Part;
use linkwork_collision::{Closest, ColliderId, Detail, Distance, Probe, Visibility};
use linkwork_dynamics::{Workspace, poses};
use linkwork_multibody::{SubhingeKind, SubhingeRange};
use linkwork_spatial::{Motion, Pose};

/// Memory of collision queries.
#[derive(Debug)]
pub(super) struct Memory {
    pub probe: Probe,
    ws: Workspace,
    /// Poses of the objects in the world at the configuration of the query.
    objects: Vec<Pose>,
    /// Workspaces of the objects with joints.
    linkages: Vec<Option<Workspace>>,
    /// Overrides that the user set for pairs (a, b), row after row: whether the pair is checked.
    said: Vec<Option<bool>>,
    q: Vec<f64>,
    dv: Vec<f64>,
    step: Vec<f64>,
}

impl Memory {
    pub fn new(model: &RobotModel) -> Self {
        let n = model.scene.colliders.len();
        Self {
            probe: Probe::new(&model.scene.colliders),
            ws: Workspace::new(&model.tree),
            objects: vec![Pose::identity(); model.objects.len()],
            linkages: (model.linkages.iter())
                .map(|l| l.as_ref().map(|l| Workspace::new(&l.tree)))
                .collect(),
            said: vec![None; n * n],
            q: vec![0.0; model.nq()],
            dv: vec![0.0; model.nv()],
            step: vec![0.0; model.nv()],
        }
    }

    pub fn fork(&self, model: &RobotModel) -> Self {
        let mut new = Self::new(model);
        new.probe = self.probe.fork(&model.scene.colliders);
        new.said.copy_from_slice(&self.said);
        new
    }
}

/// Result of a collision check of a path.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Path {
    /// The whole path is proven free.
    Free,
    /// Two colliders touch at this position of the path.
    Hit {
        /// Position from 0 at the start to 1 at the end.
        at: f64,
        /// The two colliders.
        pair: (ColliderId, ColliderId),
    },
    /// No collision was found, but some pieces of the minimum length could not be proven free because surfaces are too close to each other.
    Undecided {
        /// Position of the first such piece.
        at: f64,
    },
}

/// Progress of [`Robot::path_free_on`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PathProgress {
    at: f64,
    length: f64,
    undecided: Option<f64>,
}

impl Default for PathProgress {
    /// The start of the path.
    fn default() -> Self {
        Self { at: 0.0, length: 1.0, undecided: None }
    }
}

impl Robot {
    /// Returns true if two colliders of a checked pair touch or overlap at `q` (nq), including padding. The robot's own q has no effect. Held objects
    /// move with the hands.
    ///
    /// # Errors
    /// [`RobotError::Length`], [`RobotError::NotFinite`].
    pub fn collides(&mut self, q: &[f64]) -> Result<bool, RobotError> {
        self.first_hit(q).map(|hit| hit.is_some())
    }

    /// Like [`collides`](Self::collides), but returns a pair that touches.
    ///
    /// # Errors
    /// [`RobotError::Length`], [`RobotError::NotFinite`].
    pub fn first_hit(&mut self, q: &[f64]) -> Result<Option<(ColliderId, ColliderId)>, RobotError> {
        self.place(q)?;
        Ok(self.collide.probe.first_hit(&self.model.scene.colliders))
    }

    /// Writes all pairs that touch or overlap at `q` (nq) into `out`, which is cleared first. Allocates only if the capacity of `out` is too small.
    ///
    /// # Errors
    /// [`RobotError::Length`], [`RobotError::NotFinite`].
    pub fn hits(
        &mut self,
        q: &[f64],
        out: &mut Vec<(ColliderId, ColliderId)>,
    ) -> Result<(), RobotError> {
        self.place(q)?;
        self.collide.probe.hits(&self.model.scene.colliders, out);
        Ok(())
    }

    /// Returns the closest checked pair at `q` (nq) within `limit` (m, may be infinite). The distance includes padding and is negative for overlap.
    ///
    /// # Errors
    /// [`RobotError::Length`], [`RobotError::NotFinite`]; [`RobotError::OutOfRange`] for a limit that is NaN.
    pub fn clearance(&mut self, q: &[f64], limit: f64) -> Result<Option<Closest>, RobotError> {
        check_limit(limit)?;
        self.place(q)?;
        Ok(self.collide.probe.closest(&self.model.scene.colliders, limit))
    }

    /// Writes the distances of all checked pairs within `limit` (m, may be infinite) at `q` (nq) into `out`, sorted by identifiers. `out` is cleared
    /// first; this allocates only if its capacity is too small. Distances include padding and are negative for overlap. The work is O(pairs). If you
    /// need only the closest pair, `clearance` is faster because it skips most pairs.
    ///
    /// # Errors
    /// [`RobotError::Length`], [`RobotError::NotFinite`]; [`RobotError::OutOfRange`] for a limit that is NaN.
    pub fn distances(
        &mut self,
        q: &[f64],
        limit: f64,
        out: &mut Vec<Closest>,
    ) -> Result<(), RobotError> {
        check_limit(limit)?;
        self.place(q)?;
        self.collide.probe.distances(&self.model.scene.colliders, limit, out);
        Ok(())
    }

    /// Returns the distance of two colliders at `q` (nq) with the closest points, whether the pair is checked for collisions or not. Includes
    /// padding.
    ///
    /// # Errors
    /// [`RobotError::Length`], [`RobotError::NotFinite`], [`RobotError::ForeignHandle`].
    pub fn distance(
        &mut self,
        q: &[f64],
        a: ColliderId,
        b: ColliderId,
    ) -> Result<Option<Distance>, RobotError> {
        self.known(a)?;
        self.known(b)?;
        self.place(q)?;
        Ok(self.collide.probe.distance(&self.model.scene.colliders, a, b, f64::INFINITY))
    }

    /// Checks whether the path from `qa` to `qb` (nq each) is free of collisions while all coordinates move in proportion. The documentation of this
    /// file describes the method. Pieces shorter than `least` (a fraction of the path, 0 … 1) are not halved again. Held objects move with the hands.
    ///
    /// # Errors
    /// [`RobotError::Length`]; [`RobotError::NotFinite`]; [`RobotError::OpensClosure`]; [`RobotError::OutOfRange`] for `least` outside 1e-9 … 1, and
    /// for an end of the path beyond the limits of a slider, because the bound on the displacement of a collider by a rotation uses these limits.
    pub fn path_free(&mut self, qa: &[f64], qb: &[f64], least: f64) -> Result<Path, RobotError> {
        let mut progress = PathProgress::default();
        loop {
            if let Some(path) = self.path_free_on(qa, qb, least, &mut progress, usize::MAX)? {
                return Ok(path);
            }
        }
    }

    /// Like [`path_free`](Self::path_free), but checks at most `pieces` pieces; returns `None` while pieces remain. Call it again with the same
    /// `progress` to continue. The result does not depend on the number of calls.
    ///
    /// # Errors
    /// Like `path_free`.
    pub fn path_free_on(
        &mut self,
        qa: &[f64],
        qb: &[f64],
        least: f64,
        progress: &mut PathProgress,
        pieces: usize,
    ) -> Result<Option<Path>, RobotError> {
        self.model.configurations("qa", qa, 1)?;
        self.model.configurations("qb", qb, 1)?;
        self.model.opens_between(qa, qb)?;
        self.tears("a straight path", |v| {
            let moved = |s: &SubhingeRange| s.v.contains(&v) && qa[s.q.clone()] != qb[s.q.clone()];
            self.model.multibody().subhinges().any(|(_, s)| moved(s))
        })?;
        if !(1e-9..=1.0).contains(&least) {
            let help = "give a fraction of the path from 1e-9 to 1";
            return Err(RobotError::OutOfRange { what: "least", value: least, help });
        }
        for (_, s) in self.model.multibody().subhinges() {
            let l = s.subhinge.limits;
            let beyond = |q: &[f64]| !(l.lower..=l.upper).contains(&q[s.q.start]);
            let slides =
                matches!(s.subhinge.kind, SubhingeKind::Slider { .. } | SubhingeKind::Screw { .. });
            if let (true, Some(q)) = (slides, [qa, qb].into_iter().find(|q| beyond(q))) {
                let help = "start and end within the limits of sliders and screws";
                let value = q[s.q.start];
                return Err(RobotError::OutOfRange { what: "position of a slider", value, help });
            }
        }
        let mut dv = std::mem::take(&mut self.collide.dv);
        self.model.multibody().difference(qa, qb, &mut dv);
        let path = self.pieces(qa, &dv, least, progress, pieces);
        self.collide.dv = dv;
        path
    }

    /// Checks pieces of the path and halves those that are undecided.
    fn pieces(
        &mut self,
        qa: &[f64],
        dv: &[f64],
        least: f64,
        progress: &mut PathProgress,
        pieces: usize,
    ) -> Result<Option<Path>, RobotError> {
        // Pieces are checked in order, and each is half of a larger one, so position and length are the only memory that the bisection needs.
        let PathProgress { at, length, undecided } = progress;
        for _ in 0..pieces {
            if *at >= 1.0 {
                return Ok(Some(undecided.map_or(Path::Free, |at| Path::Undecided { at })));
            }
            let middle = *at + 0.5 * *length;
            if let Some(pair) = self.at_part(qa, dv, middle, 0.0)? {
                return Ok(Some(Path::Hit { at: middle, pair }));
            }
            if self.at_part(qa, dv, middle, 0.5 * *length)?.is_some() {
                if 0.5 * *length >= least {
                    *length *= 0.5;
                    continue;
                }
                *undecided = undecided.or(Some(middle));
            }
            *at += *length;
            // Double the length as long as the position is a multiple of it, so that pieces remain halves of halves.
            while *length < 1.0 && (*at / (2.0 * *length)).fract() == 0.0 {
                *length *= 2.0;
            }
        }
        Ok(None)
    }

    /// Returns two colliders that may touch within ±`dv` (nv, not negative) of q (nq). `None` proves that no pair touches.
    pub(super) fn first_within(
        &mut self,
        q: &[f64],
        dv: &[f64],
    ) -> Result<Option<(ColliderId, ColliderId)>, RobotError> {
        self.at_part(q, dv, 0.0, 1.0)
    }

    /// Returns a collision at a fraction of the path, with all shapes thickened by the distance that they move within `half` of a piece.
    fn at_part(
        &mut self,
        qa: &[f64],
        dv: &[f64],
        part: f64,
        half: f64,
    ) -> Result<Option<(ColliderId, ColliderId)>, RobotError> {
        self.collide.step.iter_mut().zip(dv).for_each(|(s, d)| *s = part * d);
        let model = self.model.clone();
        for id in model.scene.colliders.ids() {
            let reach = if half > 0.0 { half * self.moved(id, dv)? } else { 0.0 };
            self.collide.probe.set_reach(id, reach);
        }
        let mut q = std::mem::take(&mut self.collide.q);
        self.model.multibody().integrate(qa, &self.collide.step, &mut q);
        let found = self.first_hit(&q);
        self.collide.q = q;
        for id in self.model.scene.colliders.ids() {
            self.collide.probe.set_reach(id, 0.0);
        }
        found
    }

    /// Returns the largest distance, m, that points of a collider can move while the coordinates change by `dv`. Joints of objects do not move.
    fn moved(&self, id: ColliderId, dv: &[f64]) -> Result<f64, RobotError> {
        let scene = &self.model.scene;
        let far = match scene.endless(id) {
            true => f64::INFINITY,
            false => self.collide.probe.extent(&scene.colliders, id),
        };
        let (object, far) = match scene.carriers[id.index()] {
            Carrier::World => return Ok(0.0),
            Carrier::Body(b) => return Ok(scene.motion(b, far, dv)),
            Carrier::Object(o) => (o, far),
            Carrier::Linked(o, b) => {
                (o, self.linkages[o].as_ref().map_or(0.0, |m| m.far[b.index()]) + far)
            }
        };
        match self.holds[self.root(object)] {
            None => Ok(0.0),
            Some(Hold { hand: (part, X), .. }) => {
                let tip = self.model.chain(part)?.tip_body;
                let far = X.position.norm() + self.far_from_root(object, far);
                Ok(scene.motion(tip, far, dv))
            }
        }
    }

    /// Sets the padding around a collider, m. O(colliders).
    ///
    /// # Errors
    /// Like [`pad_all`](Self::pad_all).
    pub fn pad(&mut self, id: ColliderId, padding: f64) -> Result<(), RobotError> {
        self.pad_all(&[id], padding)
    }

    /// Sets the padding around several colliders, m, for example those of a part ([`RobotModel::colliders_of_part`]) or of an object. O(n² ·
    /// colliders).
    ///
    /// # Errors
    /// [`RobotError::ForeignHandle`]; [`RobotError::OutOfRange`] when it is negative or not finite; [`RobotError::NeverFree`] when two checked
    /// colliders of robot and world would touch at every configuration with this padding, according to link lengths and travels of sliders. After an
    /// error no padding has changed.
    pub fn pad_all(&mut self, ids: &[ColliderId], padding: f64) -> Result<(), RobotError> {
        ids.iter().try_for_each(|id| self.known(*id))?;
        if !(padding >= 0.0 && padding.is_finite()) {
            let help = "padding must not be negative";
            return Err(RobotError::OutOfRange { what: "padding", value: padding, help });
        }
        let scene = &self.model.scene;
        let probe = &self.collide.probe;
        let own = |i: ColliderId| probe.extent(&scene.colliders, i) - probe.padding(i);
        for id in ids.iter().copied() {
            for other in scene.colliders.ids().filter(|o| *o != id && probe.meet(id, *o)) {
                let too = if ids.contains(&other) { padding } else { probe.padding(other) };
                let all = padding + too;
                let most = scene.apart(id, other, [own(id), own(other)]);
                if all >= most {
                    let (a, b) = (id.index(), other.index());
                    return Err(RobotError::NeverFree { a, b, padding: all, most });
                }
            }
        }
        ids.iter().for_each(|id| self.collide.probe.set_padding(*id, padding));
        Ok(())
    }

    /// Hides or shows a collider. Hidden colliders are not checked.
    ///
    /// # Errors
    /// [`RobotError::ForeignHandle`].
    pub fn show(&mut self, id: ColliderId, visibility: Visibility) -> Result<(), RobotError> {
        self.known(id)?;
        self.collide.probe.set_visibility(id, visibility);
        Ok(())
    }

    /// Selects the fine or the coarse shapes of all colliders. A collider without a coarse shape uses its fine shape.
    pub fn set_detail(&mut self, detail: Detail) {
        for id in self.model.scene.colliders.ids() {
            self.collide.probe.set_detail(id, detail);
        }
    }

    /// Selects the fine or the coarse shape of one collider. A collider without a coarse shape uses its fine shape.
    ///
    /// # Errors
    /// [`RobotError::ForeignHandle`].
    pub fn set_detail_of(&mut self, id: ColliderId, detail: Detail) -> Result<(), RobotError> {
        self.known(id)?;
        self.collide.probe.set_detail(id, detail);
        Ok(())
    }

    /// Sets whether a pair is checked for collisions, regardless of the collision rules and of which hand holds what. `None` removes this override.
    /// Use it to allow a held object to touch something.
    ///
    /// # Errors
    /// [`RobotError::ForeignHandle`].
    pub fn look_at(
        &mut self,
        a: ColliderId,
        b: ColliderId,
        look: Option<bool>,
    ) -> Result<(), RobotError> {
        self.known(a)?;
        self.known(b)?;
        let n = self.model.scene.colliders.len();
        self.collide.said[a.index() * n + b.index()] = look;
        self.collide.said[b.index() * n + a.index()] = look;
        self.decide(a, b);
        Ok(())
    }

    /// Returns true if a pair is checked for collisions while both colliders are shown.
    ///
    /// # Errors
    /// [`RobotError::ForeignHandle`].
    pub fn looks_at(&self, a: ColliderId, b: ColliderId) -> Result<bool, RobotError> {
        self.known(a)?;
        self.known(b)?;
        Ok(self.collide.probe.meet(a, b))
    }

    /// Updates the pairs of an object, and of all objects attached to it, after its hands or its attachment changed.
    pub(super) fn filter(&mut self, object: Object) {
        let model = self.model.clone();
        let scene = &model.scene;
        for a in scene.colliders.ids() {
            let own = scene.carriers[a.index()].object(&model.linkages);
            if !own.is_some_and(|(o, _)| self.carries(object.index(), o)) {
                continue;
            }
            for b in scene.colliders.ids().filter(|b| *b != a) {
                self.decide(a, b);
            }
        }
    }

    /// Decides whether a pair is checked: by the user's override, otherwise by the rules and by what the hands hold.
    fn decide(&mut self, a: ColliderId, b: ColliderId) {
        let scene = &self.model.scene;
        let n = scene.colliders.len();
        let held = |x: ColliderId, y: ColliderId| {
            let Some((o, link)) = self.carried(x) else { return true };
            let Some(hold) = self.holds[o] else { return true };
            let hands = [Some(hold.hand.0), hold.second.map(|s| s.0)];
            hands.into_iter().flatten().all(|p| self.meets(p, (o, link), y))
        };
        let meet = self.collide.said[a.index() * n + b.index()].unwrap_or_else(|| {
            scene.colliders.meet(a, b) && self.apart(a, b) && held(a, b) && held(b, a)
        });
        self.collide.probe.set_meet(a, b, meet);
    }

    /// Returns true if a collider of an object that a part holds, or of a body that hangs on it, is checked against another collider.
    fn meets(&self, part: Part, (own, link): (usize, Link), other: ColliderId) -> bool {
        let scene = &self.model.scene;
        let Some((o, to)) = self.carried(other) else {
            let [welded, joined] = scene.meets_held[part.index()][other.index()];
            return match link {
                Link::Welded => welded,
                Link::Joined => joined,
                Link::Beyond => true,
            };
        };
        // Pairs of bodies of one object follow the rules; pairs with attached objects follow `apart`.
        let Some(hold) = self.holds[o].filter(|_| o != own) else { return true };
        let tip = |p: Part| self.model.chain(p).map(|c| c.tip_body).ok();
        let hands = [Some(hold.hand.0), hold.second.map(|s| s.0)];
        let apart = hands.into_iter().flatten().all(|p| tip(p) != tip(part));
        // Two objects in one hand are one rigid body. A body that a hinge connects to this rigid body is its neighbour
        // and may touch it.
        apart
            || match (link, to) {
                (Link::Welded, Link::Welded) => false,
                (Link::Welded, Link::Joined) | (Link::Joined, Link::Welded) => !scene.pass,
                _ => true,
            }
    }

    pub(super) fn known(&self, id: ColliderId) -> Result<(), RobotError> {
        let known = id.index() < self.model.scene.colliders.len();
        if known { Ok(()) } else { Err(RobotError::ForeignHandle) }
    }

    /// Moves all colliders to their poses at q.
    fn place(&mut self, q: &[f64]) -> Result<(), RobotError> {
        self.model.configurations("q", q, 1)?;
        let Memory { probe, ws, objects, linkages, .. } = &mut self.collide;
        poses(&self.tree, ws, q);
        let trees = &self.model.linkages;
        for i in self.order.iter().map(|i| *i as usize) {
            objects[i] = match (self.holds[i], self.mounts[i]) {
                (Some(hold), _) => {
                    let tip = self.model.chain(hold.hand.0)?.tip_body;
                    ws.body_pose(&self.tree, tip) * hold.hand.1
                }
                (None, Some(Mount { on, body, pose })) => {
                    let carrier = match (&trees[on.index()], &linkages[on.index()], body) {
                        (Some(l), Some(ws), Some(body)) => ws.body_pose(&l.tree, body),
                        _ => objects[on.index()],
                    };
                    carrier * pose
                }
                (None, None) => self.objects[i],
            };
            if let (Some(l), Some(ws), Some(m)) = (&trees[i], &mut linkages[i], &self.linkages[i]) {
                ws.set_base(&objects[i], &Motion::zero(), &Motion::zero());
                poses(&l.tree, ws, &m.q);
            }
        }
        let linked = |o: usize, b| match (&trees[o], &linkages[o]) {
            (Some(l), Some(ws)) => ws.body_frame(&l.tree, b),
            _ => matrix(&objects[o]),
        };
        let Scene { colliders, bodies, .. } = &self.model.scene;
        probe.place_frames(colliders, |b| {
            let carrier = b.map_or(Carrier::World, |b| bodies[b.index()]);
            carrier.frame(|b| ws.body_frame(&self.tree, b), objects, linked)
        });
        Ok(())
    }
}

fn check_limit(limit: f64) -> Result<(), RobotError> {
    if !limit.is_nan() {
        return Ok(());
    }
    let help = "give a limit in m; use infinity for no limit";
    Err(RobotError::OutOfRange { what: "limit", value: limit, help })
}
