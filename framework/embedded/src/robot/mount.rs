//! Objects attached to other objects, such as a key in its lock, a battery on its driver or a wheel on its hub. An attached object moves with its
//! carrier and adds to its load.
//!
//! ```text
//! X_WC = X_WB X_BC                          B: the carrier (an object or a body of it); C: the attached object
//! M_B  = M_B⁰ + Σ φ(B,C) M_C φ*(B,C)        summed from the original inertias each time, so detaching leaves no round-off
//! ```
//! An attached object counts as welded to its carrier. It is not checked for collisions with the carrier, nor, under rules that ignore neighbours,
//! with bodies that a hinge joins to the carrier.

use super::hold::check_pose;
use super::{Grasp, Robot};
use crate::collision::Carrier;
use crate::error::RobotError;
use crate::linkage::Link;
use crate::model::Object;
use linkwork_collision::ColliderId;
use linkwork_multibody::BodyId;
use linkwork_spatial::Pose;

/// Mounting of an attached object.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Mount {
    /// The other object.
    pub on: Object,
    /// The body of that object which carries, or `None` for the object itself.
    pub body: Option<BodyId>,
    /// `X_BC`, the pose of the object in the frame of its carrier.
    pub pose: Pose,
}

impl Robot {
    /// Returns what an object is attached to, or `None`.
    ///
    /// # Errors
    /// [`RobotError::ForeignHandle`].
    pub fn mount(&self, object: Object) -> Result<Option<Mount>, RobotError> {
        self.mounts.get(object.index()).copied().ok_or(RobotError::ForeignHandle)
    }

    /// Attaches an object that no hand holds to another object, or to a body that hangs on it
    /// ([`RobotModel::object_body`](crate::RobotModel::object_body)). The attached object keeps its current pose, or takes the pose `X_BC` in the
    /// frame of its carrier. It then moves with the carrier, and a hand that holds the carrier carries both. O(objects), no allocation.
    ///
    /// # Errors
    /// [`RobotError::ForeignHandle`], [`RobotError::NoJoints`], [`RobotError::Held`], [`RobotError::Attached`], [`RobotError::NotFinite`],
    /// [`RobotError::OutOfRange`] (an object that the attached object itself carries). After an error nothing has changed.
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
            // The first body of an object's tree is the object itself.
            Some(body) if body.index() > 0 => self.object_body_pose(on, body)?,
            _ => self.object_pose(on)?,
        };
        if self.carries(object.index(), on.index()) {
            let help = "attach it to an object that is not attached to it";
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

    /// Detaches an object. It keeps its pose in the world.
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

    /// Updates loads, order and collision pairs after an object was attached or detached.
    fn remount(&mut self, object: Object, on: Object) -> Result<(), RobotError> {
        let mounts = &self.mounts;
        let inward = |o: &usize| mounts[*o].map(|m| m.on.index());
        let depth = |o: u32| std::iter::successors(Some(o as usize), inward).count();
        self.order.sort_unstable_by_key(|o| (depth(*o), *o));
        self.filter(object);
        self.reload(Some(on.index()))
    }

    /// Returns the object to which an object is attached.
    fn on(&self, object: usize) -> Option<usize> {
        self.mounts[object].map(|m| m.on.index())
    }

    /// Returns true if an object is the other object or carries it.
    pub(super) fn carries(&self, object: usize, other: usize) -> bool {
        std::iter::successors(Some(other), |o| self.on(*o)).any(|o| o == object)
    }

    /// Returns the object at the end of a chain of attachments.
    pub(super) fn root(&self, object: usize) -> usize {
        std::iter::successors(Some(object), |o| self.on(*o)).last().unwrap_or(object)
    }

    /// Returns an upper bound for the distance, m, between the origin of the root object and a point at most `far` (m) from an object's origin.
    pub(super) fn far_from_root(&self, object: usize, mut far: f64) -> f64 {
        let mut o = object;
        while let Some(Mount { on, body, pose }) = self.mounts[o] {
            o = on.index();
            let off = |b: BodyId| self.linkages[o].as_ref().map_or(0.0, |m| m.far[b.index()]);
            far += pose.position.norm() + body.map_or(0.0, off);
        }
        far
    }

    /// Updates the load of an object, of all objects that carry it, and of the hand that holds them.
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

    /// Computes the inertia of an object with everything attached to it, about its origin in its axes.
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

    /// Returns the root object that carries a collider, and how the collider's body is connected to it.
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

    /// Returns the object, and the rigid group of its bodies, to which a body of an object is welded.
    fn piece(&self, mut object: usize, body: usize) -> (usize, usize) {
        let group = |o: usize, b: usize| self.model.linkages[o].as_ref().map_or(0, |l| l.group[b]);
        let mut piece = group(object, body);
        // Follow an attachment only from bodies that are welded to the attached object.
        while let (true, Some(m)) = (piece == group(object, 0), self.mounts[object]) {
            object = m.on.index();
            piece = group(object, m.body.map_or(0, BodyId::index));
        }
        (object, piece)
    }

    /// Returns false for colliders on two objects that are not checked against each other because of how these objects are attached.
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
        // The pieces may be joined by a hinge within one object, or by the hinge of an object that is attached to the other.
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
