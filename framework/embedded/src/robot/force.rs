//! Feed-forward: forces that a motion takes, with what is held and what the tips push.
//!
//! ```text
//! τ = M β̇ + C + g + Σ J_iᵀ f_i          f_i: wrench that tip i exerts on what it touches
//! ```

use super::{Robot, numbers};
use crate::error::RobotError;
use crate::part::Part;
use linkwork_dynamics::{inverse_dynamics_given_kinematics, kinematics};
use linkwork_spatial::{Force, Motion, Vec3};

/// A wrench that a tip exerts on something.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Push {
    /// The chain.
    pub part: Part,
    /// Moment about `at` and force, world axes.
    pub wrench: Force,
    /// Where, in the tip's frame, m.
    pub at: Vec3,
}

impl Push {
    /// At the origin of a chain's tip: moment (N m), force (N), world axes.
    #[must_use]
    pub fn new(part: Part, moment: Vec3, force: Vec3) -> Self {
        Self { part, wrench: Force::new(moment, force), at: Vec3::zeros() }
    }

    /// At another point of the tip's frame, m.
    #[must_use]
    pub fn at(mut self, p: Vec3) -> Self {
        self.at = p;
        self
    }
}

impl Robot {
    /// The acceleration of free fall, world axes, m/s²; 9.81 down z at first.
    ///
    /// # Errors
    /// [`RobotError::NotFinite`].
    pub fn set_gravity(&mut self, g: Vec3) -> Result<(), RobotError> {
        numbers("gravity", g.as_slice(), 3)?;
        self.gravity = g;
        Ok(())
    }

    /// Forces `tau` (nv) that hold the configuration still, with what is held.
    ///
    /// # Errors
    /// [`RobotError::Length`].
    pub fn gravity_forces(&mut self, tau: &mut [f64]) -> Result<(), RobotError> {
        self.held_still(&[], tau)
    }

    /// Forces `tau` (nv) that hold the configuration still while tips push.
    ///
    /// # Errors
    /// [`RobotError::Length`], [`RobotError::NotFinite`], [`RobotError::ForeignHandle`], [`RobotError::NotAChain`].
    pub fn held_still(&mut self, pushes: &[Push], tau: &mut [f64]) -> Result<(), RobotError> {
        self.forces(None, None, pushes, tau)
    }

    /// Forces `tau` (nv) for rates `v` and accelerations `vdot` (nv) at the robot's q, with what is held, while tips push.
    ///
    /// # Errors
    /// [`RobotError::Length`], [`RobotError::NotFinite`], [`RobotError::ForeignHandle`], [`RobotError::NotAChain`].
    pub fn feed_forward(
        &mut self,
        v: &[f64],
        vdot: &[f64],
        pushes: &[Push],
        tau: &mut [f64],
    ) -> Result<(), RobotError> {
        numbers("v", v, self.tree.nv())?;
        numbers("vdot", vdot, self.tree.nv())?;
        self.forces(Some(v), Some(vdot), pushes, tau)
    }

    /// Forces C + g (nv) into `tau` at the robot's q and rates `v`, with what is held, and into `tips` the accelerations J̇ v that the tips of
    /// `parts` have while no rate changes: [angular; linear] of each tip's origin, world axes.
    ///
    /// # Errors
    /// [`RobotError::Length`], [`RobotError::NotFinite`], [`RobotError::ForeignHandle`], [`RobotError::NotAChain`].
    pub fn bias(
        &mut self,
        v: &[f64],
        parts: &[Part],
        tau: &mut [f64],
        tips: &mut [Motion],
    ) -> Result<(), RobotError> {
        numbers("v", v, self.tree.nv())?;
        if tips.len() != parts.len() {
            let (got, wanted) = (tips.len(), parts.len());
            return Err(RobotError::Length { what: "tips", got, wanted });
        }
        for part in parts {
            self.model.tip(*part)?;
        }
        self.forces(Some(v), None, &[], tau)?;
        for (part, out) in parts.iter().zip(tips) {
            *out = self.ws.node_acceleration(&self.tree, self.model.tip(*part)?);
        }
        Ok(())
    }

    /// Checks all before anything is written; `None` is rest.
    pub(super) fn forces(
        &mut self,
        v: Option<&[f64]>,
        vdot: Option<&[f64]>,
        pushes: &[Push],
        tau: &mut [f64],
    ) -> Result<(), RobotError> {
        let wanted = self.tree.nv();
        if tau.len() != wanted {
            return Err(RobotError::Length { what: "tau", got: tau.len(), wanted });
        }
        for p in pushes {
            self.model.tip(p.part)?;
            numbers("moment of a push", p.wrench.moment.as_slice(), 3)?;
            numbers("force of a push", p.wrench.force.as_slice(), 3)?;
            numbers("place of a push", p.at.as_slice(), 3)?;
        }
        kinematics(&self.tree, &mut self.ws, &self.q, v.unwrap_or(&self.rest));
        self.fresh = true;
        self.ws.clear_forces();
        self.ws.apply_uniform_gravity(self.gravity);
        for p in pushes {
            let tip = self.model.tip(p.part)?;
            let arm = self.ws.node_rotation(&self.tree, tip) * p.at;
            let on_tip = p.wrench.shift_to_parent(&arm);
            let felt = Force::new(-on_tip.moment, -on_tip.force);
            self.ws.add_wrench_at_node(&self.tree, tip, felt);
        }
        let vdot = vdot.unwrap_or(&self.rest);
        inverse_dynamics_given_kinematics(&self.tree, &mut self.ws, vdot, tau);
        Ok(())
    }
}
