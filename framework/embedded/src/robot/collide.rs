//! Collisions at any configuration: yes or no, which, how far, along a path.
//!
//! ```text
//! path qa → qb, all coordinates in proportion; a piece of it with its middle m and half its length:
//! every point of a collider stays within r = Σ_i bound_i |Δq_i| of where it is at m
//! free at m with all shapes thicker by their r      the piece is free
//! touching at m                                     the path is not
//! else                                              both halves
//! ```
//! So nothing is jumped over, however thin.

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
    /// Where objects are in the world at the configuration asked for.
    objects: Vec<Pose>,
    /// Bodies of objects with joints.
    linkages: Vec<Option<Workspace>>,
    /// What the user said of pairs: a, b, whether they meet. Row after row.
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

/// Whether a path is free.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Path {
    /// Proven free from end to end.
    Free,
    /// At this part of the way (0 … 1) two colliders touch.
    Hit {
        /// From 0 at the start to 1 at the end.
        at: f64,
        /// The two.
        pair: (ColliderId, ColliderId),
    },
    /// Nothing touches where it was looked, and pieces as short as allowed could not be proven free: surfaces pass within a hair.
    Undecided {
        /// Where the first such piece is.
        at: f64,
    },
}

/// How far [`Robot::path_free_on`] has come.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PathProgress {
    at: f64,
    length: f64,
    undecided: Option<f64>,
}

impl Default for PathProgress {
    /// At the start of the way.
    fn default() -> Self {
        Self { at: 0.0, length: 1.0, undecided: None }
    }
}

impl Robot {
    /// Whether two colliders that meet touch or overlap at `q` (nq), padding counted. The robot's own q does not matter; what hands hold goes with them.
    ///
    /// # Errors
    /// [`RobotError::Length`], [`RobotError::NotFinite`].
    pub fn collides(&mut self, q: &[f64]) -> Result<bool, RobotError> {
        self.first_hit(q).map(|hit| hit.is_some())
    }

    /// As [`collides`](Self::collides), with a pair that touches.
    ///
    /// # Errors
    /// [`RobotError::Length`], [`RobotError::NotFinite`].
    pub fn first_hit(&mut self, q: &[f64]) -> Result<Option<(ColliderId, ColliderId)>, RobotError> {
        self.place(q)?;
        Ok(self.collide.probe.first_hit(&self.model.scene.colliders))
    }

    /// All pairs that touch or overlap at `q` (nq), into `out` (emptied first; allocates when it is too short).
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

    /// The nearest pair that meets at `q` (nq), within `limit` (m, may be infinite): padding counted, negative when it overlaps.
    ///
    /// # Errors
    /// [`RobotError::Length`], [`RobotError::NotFinite`]; [`RobotError::OutOfRange`] for a limit that is NaN.
    pub fn clearance(&mut self, q: &[f64], limit: f64) -> Result<Option<Closest>, RobotError> {
        check_limit(limit)?;
        self.place(q)?;
        Ok(self.collide.probe.closest(&self.model.scene.colliders, limit))
    }

    /// The distances of all pairs that are looked at and within `limit` (m, may be infinite) at `q` (nq), by identifiers, into `out` (emptied first;
    /// allocates when it is too short): padding counted, negative where they overlap. O(pairs): where the nearest is
    /// all that is wanted, `clearance` leaves most of them out.
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

    /// The distance of two colliders at `q` (nq), whether they meet or not, with the nearest points; padding counted.
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

    /// Whether the way from `qa` to `qb` (nq each) is free, all coordinates moving in proportion; see the head of the file. Pieces shorter than
    /// `least` (part of the way, 0 … 1) are not cut again. What hands hold goes with them.
    ///
    /// # Errors
    /// [`RobotError::Length`], [`RobotError::NotFinite`], [`RobotError::OpensClosure`], [`RobotError::OutOfRange`] for `least` outside 1e-9 … 1, and for an
    /// end of the way beyond a slider's limits: how far it carries what turns follows from them.
    pub fn path_free(&mut self, qa: &[f64], qb: &[f64], least: f64) -> Result<Path, RobotError> {
        let mut progress = PathProgress::default();
        loop {
            if let Some(path) = self.path_free_on(qa, qb, least, &mut progress, usize::MAX)? {
                return Ok(path);
            }
        }
    }

    /// As [`path_free`](Self::path_free), for at most so many pieces; `None` while more are left. The same call goes on from `progress`, and portions
    /// do not change the answer.
    ///
    /// # Errors
    /// As `path_free`.
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
        self.tears("a straight way", |v| {
            let moved = |s: &SubhingeRange| s.v.contains(&v) && qa[s.q.clone()] != qb[s.q.clone()];
            self.model.multibody().subhinges().any(|(_, s)| moved(s))
        })?;
        if !(1e-9..=1.0).contains(&least) {
            let help = "give a part of the way from 1e-9 to 1";
            return Err(RobotError::OutOfRange { what: "least", value: least, help });
        }
        for (_, s) in self.model.multibody().subhinges() {
            let l = s.subhinge.limits;
            let beyond = |q: &[f64]| !(l.lower..=l.upper).contains(&q[s.q.start]);
            let slides =
                matches!(s.subhinge.kind, SubhingeKind::Slider { .. } | SubhingeKind::Screw { .. });
            if let (true, Some(q)) = (slides, [qa, qb].into_iter().find(|q| beyond(q))) {
                let help = "begin and end within the limits of sliders and screws";
                let value = q[s.q.start];
                return Err(RobotError::OutOfRange { what: "a slider's place", value, help });
            }
        }
        let mut dv = std::mem::take(&mut self.collide.dv);
        self.model.multibody().difference(qa, qb, &mut dv);
        let path = self.pieces(qa, &dv, least, progress, pieces);
        self.collide.dv = dv;
        path
    }

    /// Looks at pieces of the way, cut in halves as far as it takes.
    fn pieces(
        &mut self,
        qa: &[f64],
        dv: &[f64],
        least: f64,
        progress: &mut PathProgress,
        pieces: usize,
    ) -> Result<Option<Path>, RobotError> {
        // Pieces in order, each half as long as the last or as long: a counter is all the memory that takes.
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
            // As long again as the place allows: pieces stay halves of halves.
            while *length < 1.0 && (*at / (2.0 * *length)).fract() == 0.0 {
                *length *= 2.0;
            }
        }
        Ok(None)
    }

    /// Two that may touch somewhere within `dv` (nv, not negative) of q (nq) on either side; `None` proves that nothing does.
    pub(super) fn first_within(
        &mut self,
        q: &[f64],
        dv: &[f64],
    ) -> Result<Option<(ColliderId, ColliderId)>, RobotError> {
        self.at_part(q, dv, 0.0, 1.0)
    }

    /// A hit at a part of the way, all shapes thicker by what `half` of it moves them.
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

    /// How far points of a collider may come while the coordinates change by `dv`, m. Joints of objects stand still.
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

    /// Thickness around a collider from now on, m. O(colliders).
    ///
    /// # Errors
    /// As [`pad_all`](Self::pad_all).
    pub fn pad(&mut self, id: ColliderId, padding: f64) -> Result<(), RobotError> {
        self.pad_all(&[id], padding)
    }

    /// Thickness around each of several colliders from now on, m: those of a part ([`RobotModel::colliders_of_part`]) or of an object. O(n² · colliders).
    ///
    /// # Errors
    /// [`RobotError::ForeignHandle`]; [`RobotError::OutOfRange`] when it is negative or not finite; [`RobotError::NeverFree`] when with it two colliders of
    /// robot and world that are looked at would touch at every configuration, as lengths of links and travels of sliders say. Then nothing has changed.
    pub fn pad_all(&mut self, ids: &[ColliderId], padding: f64) -> Result<(), RobotError> {
        ids.iter().try_for_each(|id| self.known(*id))?;
        if !(padding >= 0.0 && padding.is_finite()) {
            let help = "padding is not negative";
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

    /// Hides or shows a collider from now on.
    ///
    /// # Errors
    /// [`RobotError::ForeignHandle`].
    pub fn show(&mut self, id: ColliderId, visibility: Visibility) -> Result<(), RobotError> {
        self.known(id)?;
        self.collide.probe.set_visibility(id, visibility);
        Ok(())
    }

    /// Fine or coarse shapes of all colliders from now on; where one has no coarse shape, its fine one.
    pub fn set_detail(&mut self, detail: Detail) {
        for id in self.model.scene.colliders.ids() {
            self.collide.probe.set_detail(id, detail);
        }
    }

    /// The fine or the coarse shape of one collider from now on; where it has no coarse one, its fine shape.
    ///
    /// # Errors
    /// [`RobotError::ForeignHandle`].
    pub fn set_detail_of(&mut self, id: ColliderId, detail: Detail) -> Result<(), RobotError> {
        self.known(id)?;
        self.collide.probe.set_detail(id, detail);
        Ok(())
    }

    /// Says whether a pair is looked at from now on, whatever the rules and hands say; `None` leaves it to them again. Held objects that may touch something
    /// are allowed to by this.
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

    /// Whether a pair is looked at now when both are shown.
    ///
    /// # Errors
    /// [`RobotError::ForeignHandle`].
    pub fn looks_at(&self, a: ColliderId, b: ColliderId) -> Result<bool, RobotError> {
        self.known(a)?;
        self.known(b)?;
        Ok(self.collide.probe.meet(a, b))
    }

    /// After the hands of an object changed, or what it is attached to: its pairs and those of all that it carries.
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

    /// What the user said; else the rules, and what hands hold.
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

    /// Whether an object that a part holds, or a body that hangs on it, meets a collider.
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
        // What is between bodies of one object the rules say, and what is attached to it `apart`.
        let Some(hold) = self.holds[o].filter(|_| o != own) else { return true };
        let tip = |p: Part| self.model.chain(p).map(|c| c.tip_body).ok();
        let hands = [Some(hold.hand.0), hold.second.map(|s| s.0)];
        let apart = hands.into_iter().flatten().all(|p| tip(p) != tip(part));
        // Two objects in one hand are one piece, and what a hinge joins to it is its neighbour.
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

    /// Puts all colliders where they are at q.
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
    let help = "a limit in m, infinite for none";
    Err(RobotError::OutOfRange { what: "limit", value: limit, help })
}
