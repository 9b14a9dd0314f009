//! Objects in the hands, rigid or with joints (`linkage.rs`). Grasping and releasing does not rebuild the model.
//!
//! An object hangs on the tip of the hand that grasped it first. Its inertia is added to the body of the tip. The sum is computed from the original
//! inertias each time, in the order of the model's objects, so results after a release are bit-identical to results before the grasp. Objects may be
//! attached to other objects (`mount.rs`); the hand carries all of them. A second hand on the same object closes a loop; [`Robot::balance`] shares
//! the load between both.
//! ```text
//! M_T = M_T⁰ + Σ φ(T,O) M_O φ*(T,O)          T: body of the tip; O: objects in the hand, each at X_TO
//! ```

use super::{Mount, Robot};
use crate::error::{Closure, RobotError};
use crate::model::Object;
use crate::part::Part;
use linkwork_spatial::Pose;

/// Pose at which a hand grasps an object.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Grasp {
    /// The current pose: [`Robot::object_pose`] relative to the tip.
    Here,
    /// The given pose `X_TO` in the tip's frame.
    At(Pose),
}

/// The hands that hold an object.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hold {
    /// The hand that carries it in the mechanism, and `X_TO` there.
    pub hand: (Part, Pose),
    /// The second hand, and `X_TO` there.
    pub second: Option<(Part, Pose)>,
}

impl Robot {
    /// Returns the hands that hold an object, or `None`.
    ///
    /// # Errors
    /// [`RobotError::ForeignHandle`].
    pub fn hold(&self, object: Object) -> Result<Option<Hold>, RobotError> {
        self.holds.get(object.index()).copied().ok_or(RobotError::ForeignHandle)
    }

    /// Returns `X_WO`, the pose of an object: in the hand, on its carrier, or where it was placed or released last.
    ///
    /// # Errors
    /// [`RobotError::ForeignHandle`].
    pub fn object_pose(&mut self, object: Object) -> Result<Pose, RobotError> {
        match self.hold(object)? {
            Some(Hold { hand: (part, X_TO), .. }) => Ok(self.tip_pose(part)? * X_TO),
            None => match self.mounts[object.index()] {
                Some(Mount { on, body: Some(body), pose }) => {
                    Ok(self.object_body_pose(on, body)? * pose)
                }
                Some(Mount { on, body: None, pose }) => Ok(self.object_pose(on)? * pose),
                None => Ok(self.objects[object.index()]),
            },
        }
    }

    /// Moves an object that no hand holds to the pose `X_WO`.
    ///
    /// # Errors
    /// [`RobotError::ForeignHandle`], [`RobotError::Held`], [`RobotError::Attached`], [`RobotError::NotFinite`], [`RobotError::OutOfRange`].
    pub fn put(&mut self, object: Object, X_WO: Pose) -> Result<(), RobotError> {
        check_pose(&X_WO)?;
        if self.hold(object)?.is_some() {
            return Err(RobotError::Held { object: object.index() });
        }
        self.not_attached(object)?;
        self.objects[object.index()] = X_WO;
        Ok(())
    }

    /// Grasps an object with a hand, which is the tip of a chain. The first hand carries it. A second hand closes a loop and must be within `1e-6` m
    /// and rad of the pose that its grasp requires. O(objects), no allocation.
    ///
    /// # Errors
    /// [`RobotError::ForeignHandle`], [`RobotError::NotAChain`], [`RobotError::Held`] (by this hand or by two hands), [`RobotError::Attached`],
    /// [`RobotError::LoopOpen`], [`RobotError::NotFinite`], [`RobotError::OutOfRange`]. After an error nothing has changed.
    pub fn grasp(&mut self, hand: Part, object: Object, grasp: Grasp) -> Result<(), RobotError> {
        let held = self.hold(object)?;
        self.not_attached(object)?;
        let X_WT = self.tip_pose(hand)?;
        let X_WO = self.object_pose(object)?;
        let here = X_WT.inverse() * X_WO;
        let X_TO = match grasp {
            Grasp::Here => here,
            Grasp::At(X) => {
                check_pose(&X)?;
                X
            }
        };
        let hold = match held {
            None => Hold { hand: (hand, X_TO), second: None },
            Some(Hold { hand: first, second: None }) if first.0 != hand => {
                let off = X_TO.inverse() * here;
                let (position, orientation) = (off.position.norm(), off.rotation.angle());
                if !(position <= 1e-6 && orientation <= 1e-6) {
                    let part = hand.index();
                    return Err(RobotError::LoopOpen { part, position, orientation });
                }
                Hold { hand: first, second: Some((hand, X_TO)) }
            }
            Some(_) => return Err(RobotError::Held { object: object.index() }),
        };
        self.holds[object.index()] = Some(hold);
        self.filter(object);
        self.carry(hold.hand.0)
    }

    /// Returns an error if a motion moves one of the two hands on an object relative to the other. `moves` returns which degrees of freedom move.
    /// Those that carry both hands are allowed.
    pub(super) fn tears(
        &self,
        what: &'static str,
        moves: impl Fn(usize) -> bool,
    ) -> Result<(), RobotError> {
        for (object, hold) in self.holds.iter().enumerate() {
            let Some(Hold { hand: (l, _), second: Some((r, _)) }) = hold else { continue };
            let (l, r) = (&self.model.chain(*l)?.v, &self.model.chain(*r)?.v);
            let mut between = l.iter().filter(|v| !r.contains(v));
            let mut other = r.iter().filter(|v| !l.contains(v));
            if between.any(|v| moves(*v)) || other.any(|v| moves(*v)) {
                return Err(RobotError::OpensClosure { what, closure: Closure::Hands { object } });
            }
        }
        Ok(())
    }

    /// Changes the pose `X_TO` of an object in a hand that holds it, for example to the value of an estimator. The load moves with the object. If two
    /// hands hold it, the pose in the other hand changes as well, so that the loop stays closed.
    ///
    /// # Errors
    /// [`RobotError::ForeignHandle`], [`RobotError::NotHeld`], [`RobotError::EmptyHand`] when another hand holds it,
    /// [`RobotError::NotFinite`], [`RobotError::OutOfRange`].
    pub fn update_grasp(
        &mut self,
        hand: Part,
        object: Object,
        X_TO: Pose,
    ) -> Result<(), RobotError> {
        check_pose(&X_TO)?;
        let Some(mut hold) = self.hold(object)? else {
            return Err(RobotError::NotHeld { object: object.index() });
        };
        if hold.hand.0 == hand {
            hold.hand.1 = X_TO;
            if let Some(second) = &mut hold.second {
                second.1 = self.tip_pose(second.0)?.inverse() * (self.tip_pose(hand)? * X_TO);
            }
        } else if let Some(second) = hold.second.as_mut().filter(|s| s.0 == hand) {
            second.1 = X_TO;
            let first = hold.hand.0;
            hold.hand.1 = self.tip_pose(first)?.inverse() * (self.tip_pose(hand)? * X_TO);
        } else {
            return Err(RobotError::EmptyHand { part: hand.index() });
        }
        self.holds[object.index()] = Some(hold);
        self.carry(hold.hand.0)
    }

    /// Releases an object from one hand. It stays in the other hand, or keeps its pose in the world.
    ///
    /// # Errors
    /// [`RobotError::ForeignHandle`], [`RobotError::NotHeld`], [`RobotError::EmptyHand`] when another hand holds it.
    pub fn release(&mut self, hand: Part, object: Object) -> Result<(), RobotError> {
        let Some(hold) = self.hold(object)? else {
            return Err(RobotError::NotHeld { object: object.index() });
        };
        let (first, second) = (hold.hand, hold.second);
        let left = if first.0 == hand {
            second.map(|s| Hold { hand: s, second: None })
        } else if second.is_some_and(|s| s.0 == hand) {
            Some(Hold { hand: first, second: None })
        } else {
            return Err(RobotError::EmptyHand { part: hand.index() });
        };
        self.objects[object.index()] = self.object_pose(object)?;
        self.holds[object.index()] = left;
        self.filter(object);
        self.carry(first.0)?;
        left.map_or(Ok(()), |h| self.carry(h.hand.0))
    }

    /// Releases an object from all hands. It keeps its pose in the world.
    ///
    /// # Errors
    /// [`RobotError::ForeignHandle`], [`RobotError::NotHeld`].
    pub fn ungrasp(&mut self, object: Object) -> Result<(), RobotError> {
        let Some(hold) = self.hold(object)? else {
            return Err(RobotError::NotHeld { object: object.index() });
        };
        self.objects[object.index()] = self.object_pose(object)?;
        self.holds[object.index()] = None;
        self.filter(object);
        self.carry(hold.hand.0)
    }

    /// Updates the inertia of the body at a tip, including everything that its hands carry.
    pub(super) fn carry(&mut self, hand: Part) -> Result<(), RobotError> {
        let model = &self.model;
        let body = model.chain(hand)?.tip_body;
        let mut sum = *model.multibody().get(body).inertia();
        for (hold, load) in self.holds.iter().zip(&self.loads) {
            let Some(Hold { hand: (part, X), .. }) = hold else { continue };
            // Compare bodies instead of parts, because two parts may have their tips on the same
            // body.
            if model.chain(*part)?.tip_body == body {
                sum += load.rotate(&X.rotation).shift_to_parent(&X.position);
            }
        }
        let done = self.tree.set_inertia(body, sum);
        debug_assert!(done.is_ok(), "embedded models have no flexible bodies");
        Ok(())
    }
}

/// Checks that a pose is finite and its quaternion has length 1.
pub(super) fn check_pose(X: &Pose) -> Result<(), RobotError> {
    super::numbers("position", X.position.as_slice(), 3)?;
    super::numbers("rotation", X.rotation.coords.as_slice(), 4)?;
    let value = X.rotation.coords.norm();
    if (value - 1.0).abs() < 1e-6 {
        return Ok(());
    }
    let help = "give a quaternion of length 1";
    Err(RobotError::OutOfRange { what: "length of the quaternion", value, help })
}
