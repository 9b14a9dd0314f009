//! Objects attached to other objects: a key in its lock, a battery on its driver, a wheel on its hub. They go where that goes and load what it loads.
//!
//! ```text
//! X_WC = X_WB X_BC                          B: the other object, or the body of it that carries; C: the object that is attached
//! M_B  = M_B⁰ + Σ φ(B,C) M_C φ*(B,C)        summed anew from the own inertias each time: what was taken off leaves no trace in any bit
//! ```
//! What is attached counts as welded: it does not meet what it is attached to, nor, with rules that let neighbours pass, what a hinge joins to that.

use super::hold::check_pose;
use super::{Grasp, Robot};
use crate::collision::Carrier;
use crate::error::RobotError;
use crate::linkage::Link;
use crate::model::Object;
use linkwork_collision::ColliderId;
use linkwork_multibody::BodyId;
use linkwork_spatial::Pose;

/// What an object is attached to.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Mount {
    /// The other object.
    pub on: Object,
    /// The body of it that carries, where that is not the object itself.
    pub body: Option<BodyId>,
    /// `X_BC`: where the object is in the frame of what carries it.
    pub pose: Pose,
}

impl Robot {
    /// What an object is attached to; `None` when that is nothing.
    ///
    /// # Errors
    /// [`RobotError::ForeignHandle`].
    pub fn mount(&self, object: Object) -> Result<Option<Mount>, RobotError> {
        self.mounts.get(object.index()).copied().ok_or(RobotError::ForeignHandle)
    }

    /// Attaches an object that no hand holds to another one, or to a body that hangs on that ([`RobotModel::object_body`](crate::RobotModel::object_body)): where it is now, or at
    /// `X_BC` in the frame of what carries it. From then on it goes with that, held or not, and the hand that holds that carries both. O(objects), no allocation.
    ///
    /// # Errors
    /// [`RobotError::ForeignHandle`], [`RobotError::NoJoints`], [`RobotError::Held`], [`RobotError::Attached`], [`RobotError::NotFinite`],
    /// [`RobotError::OutOfRange`] (an object that it carries itself); then nothing has changed.
    pub fn attach(
        &mut self,
        object: Object,
        on: Object,
        body: Option<BodyId>,
        at: Grasp,
    ) -> Result<(), RobotError> {
        if self.hold(object)?.is_some() {
            return Err(RobotError::Held { object: object.index() });
        }
        self.not_attached(object)?;
        let carrier = match body {
            // The first body of an object's own tree is the object.
            Some(body) if body.index() > 0 => self.object_body_pose(on, body)?,
            _ => self.object_pose(on)?,
        };
        if self.carries(object.index(), on.index()) {
            let help = "attach it to an object that it does not carry";
            let value = on.index() as f64;
            return Err(RobotError::OutOfRange { what: "on", value, help });
        }
        let pose = match at {
            Grasp::Here => carrier.inverse() * self.object_pose(object)?,
            Grasp::At(X) => {
                check_pose(&X)?;
                X
            }
        };
        let body = body.filter(|b| b.index() > 0);
        self.mounts[object.index()] = Some(Mount { on, body, pose });
        self.remount(object, on)
    }

    /// Takes an object off what it is attached to: it stays where it is in the world.
    ///
    /// # Errors
    /// [`RobotError::ForeignHandle`], [`RobotError::NotAttached`].
    pub fn detach(&mut self, object: Object) -> Result<(), RobotError> {
        let Some(mount) = self.mount(object)? else {
            return Err(RobotError::NotAttached { object: object.index() });
        };
        self.objects[object.index()] = self.object_pose(object)?;
        self.mounts[object.index()] = None;
        self.remount(object, mount.on)
    }

    pub(super) fn not_attached(&self, object: Object) -> Result<(), RobotError> {
        match self.mount(object)? {
            None => Ok(()),
            Some(Mount { on, .. }) => {
                Err(RobotError::Attached { object: object.index(), on: on.index() })
            }
        }
    }

    /// After an object was attached to another one or taken off it.
    fn remount(&mut self, object: Object, on: Object) -> Result<(), RobotError> {
        let mounts = &self.mounts;
        let inward = |o: &usize| mounts[*o].map(|m| m.on.index());
        let depth = |o: u32| std::iter::successors(Some(o as usize), inward).count();
        self.order.sort_unstable_by_key(|o| (depth(*o), *o));
        self.filter(object);
        self.reload(Some(on.index()))
    }

    /// What an object is attached to.
    fn on(&self, object: usize) -> Option<usize> {
        self.mounts[object].map(|m| m.on.index())
    }

    /// Whether an object is another one, or carries it.
    pub(super) fn carries(&self, object: usize, other: usize) -> bool {
        std::iter::successors(Some(other), |o| self.on(*o)).any(|o| o == object)
    }

    /// The object that carries an object and is attached to none.
    pub(super) fn root(&self, object: usize) -> usize {
        std::iter::successors(Some(object), |o| self.on(*o)).last().unwrap_or(object)
    }

    /// How far a point at most `far` (m) from an object's origin may be from that of its root.
    pub(super) fn far_from_root(&self, object: usize, mut far: f64) -> f64 {
        let mut o = object;
        while let Some(Mount { on, body, pose }) = self.mounts[o] {
            o = on.index();
            let off = |b: BodyId| self.linkages[o].as_ref().map_or(0.0, |m| m.far[b.index()]);
            far += pose.position.norm() + body.map_or(0.0, off);
        }
        far
    }

    /// The load of an object and of all that carry it after something about it changed, and of the hand that holds them.
    pub(super) fn reload(&mut self, mut object: Option<usize>) -> Result<(), RobotError> {
        while let Some(o) = object {
            self.load(o);
            object = self.on(o);
            if let (None, Some(hold)) = (object, self.holds[o]) {
                self.carry(hold.hand.0)?;
            }
        }
        Ok(())
    }

    /// The inertia of an object with what is attached to it, about its origin, its axes.
    pub(super) fn load(&mut self, object: usize) {
        let model = self.model.clone();
        let (mounts, loads) = (&self.mounts, &self.loads);
        let on = |carrier: Option<BodyId>, own| {
            let mut sum = own;
            for (mount, load) in mounts.iter().zip(loads) {
                let Some(Mount { on, body, pose: X }) = mount else { continue };
                if on.index() == object && *body == carrier {
                    sum += load.rotate(&X.rotation).shift_to_parent(&X.position);
                }
            }
            sum
        };
        self.loads[object] = match (&model.linkages[object], &mut self.linkages[object]) {
            (Some(linkage), Some(memory)) => {
                for body in linkage.multibody().body_ids() {
                    let own = *linkage.multibody().get(body).inertia();
                    let sum = on(Some(body).filter(|b| b.index() > 0), own);
                    let done = memory.tree.set_inertia(body, sum);
                    debug_assert!(done.is_ok(), "objects have no flexible bodies");
                }
                memory.look();
                memory.inertia
            }
            _ => on(None, model.objects[object].1),
        };
    }

    /// The object that carries a collider in the end, and how what carries it hangs on that.
    pub(super) fn carried(&self, id: ColliderId) -> Option<(usize, Link)> {
        let links = &self.model.linkages;
        let (mut o, mut link) = self.model.scene.carriers[id.index()].object(links)?;
        while let Some(Mount { on, body, .. }) = self.mounts[o] {
            o = on.index();
            let inner = match (&links[o], body) {
                (Some(l), Some(b)) => l.links[b.index()],
                _ => Link::Welded,
            };
            link = match (inner, link) {
                (Link::Welded, link) => link,
                (Link::Joined, Link::Welded) => Link::Joined,
                _ => Link::Beyond,
            };
        }
        Some((o, link))
    }

    /// What a body of an object is welded to in the end: an object, and which of its pieces.
    fn piece(&self, mut object: usize, body: usize) -> (usize, usize) {
        let group = |o: usize, b: usize| self.model.linkages[o].as_ref().map_or(0, |l| l.group[b]);
        let mut piece = group(object, body);
        // Only what is welded to an object goes on to what that is attached to.
        while let (true, Some(m)) = (piece == group(object, 0), self.mounts[object]) {
            object = m.on.index();
            piece = group(object, m.body.map_or(0, BodyId::index));
        }
        (object, piece)
    }

    /// Whether two colliders on different objects meet as far as these are attached to each other.
    pub(super) fn apart(&self, a: ColliderId, b: ColliderId) -> bool {
        let scene = &self.model.scene;
        let of = |i: ColliderId| match scene.carriers[i.index()] {
            Carrier::World | Carrier::Body(_) => None,
            Carrier::Object(o) => Some((o, 0)),
            Carrier::Linked(o, b) => Some((o, b.index())),
        };
        let (Some(a), Some(b)) = (of(a), of(b)) else { return true };
        if a.0 == b.0 || self.root(a.0) != self.root(b.0) {
            return true;
        }
        let (x, y) = (self.piece(a.0, a.1), self.piece(b.0, b.1));
        if x == y {
            return false;
        }
        // A hinge inside one object joins them, or one that hangs by a hinge on an object which is attached to the other.
        let joined = |o: usize, (p, q): (usize, usize)| {
            let Some(l) = &self.model.linkages[o] else { return false };
            l.joined.iter().any(|j| *j == (p, q) || *j == (q, p))
        };
        let inner = |(o, piece): (usize, usize)| {
            let root = self.model.linkages[o].as_ref().map_or(0, |l| l.group[0]);
            (joined(o, (piece, root))).then(|| self.piece(o, 0))
        };
        let near =
            (x.0 == y.0 && joined(x.0, (x.1, y.1))) || inner(x) == Some(y) || inner(y) == Some(x);
        !(near && scene.pass)
    }
}
