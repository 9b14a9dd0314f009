//! Feed-forward: inverse dynamics including held objects and the wrenches that the tips exert.
//!
//! ```text
//! τ = M β̇ + C + g + Σ J_iᵀ f_i          f_i: wrench that tip i exerts on its surroundings
//! ```

use super::{Robot, numbers};
use crate::error::RobotError;
use crate::part::Part;
use linkwork_dynamics::{inverse_dynamics_given_kinematics, kinematics};
use linkwork_spatial::{Force, Motion, Vec3};

/// A wrench that a tip exerts on its surroundings.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Push {
    /// The chain.
    pub part: Part,
    /// Moment about `at` and force, world axes.
    pub wrench: Force,
    /// Point of application in the tip's frame, m.
    pub at: Vec3,
}

impl Push {
    /// Creates a wrench at the origin of a chain's tip: moment (N m) and force (N), world axes.
    #[must_use]
    pub fn new(part: Part, moment: Vec3, force: Vec3) -> Self {
        Self { part, wrench: Force::new(moment, force), at: Vec3::zeros() }
    }

    /// Sets the point of application in the tip's frame, m.
    #[must_use]
    pub fn at(mut self, p: Vec3) -> Self {
        self.at = p;
        self
    }
}

impl Robot {
    /// Sets the acceleration of gravity, world axes, m/s². Default: 9.81 m/s² along −z.
    ///
    /// # Errors
    /// [`RobotError::NotFinite`].
    pub fn set_gravity(&mut self, g: Vec3) -> Result<(), RobotError> {
        numbers("gravity", g.as_slice(), 3)?;
        self.gravity = g;
        Ok(())
    }

    /// Computes forces `tau` (nv) that hold the configuration at rest, including held objects.
    ///
    /// # Errors
    /// [`RobotError::Length`].
    pub fn gravity_forces(&mut self, tau: &mut [f64]) -> Result<(), RobotError> {
        self.held_still(&[], tau)
    }

    /// Computes forces `tau` (nv) that hold the configuration at rest while the tips exert wrenches.
    ///
    /// # Errors
    /// [`RobotError::Length`], [`RobotError::NotFinite`], [`RobotError::ForeignHandle`], [`RobotError::NotAChain`].
    pub fn held_still(&mut self, pushes: &[Push], tau: &mut [f64]) -> Result<(), RobotError> {
        self.forces(None, None, pushes, tau)
    }

    /// Computes forces `tau` (nv) for rates `v` and accelerations `vdot` (nv) at the robot's q, including held objects, while the tips exert
    /// wrenches.
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

    /// Writes the forces C + g (nv) at the robot's q and rates `v`, including held objects, into `tau`. Writes the accelerations J̇ v of the tips of
    /// `parts` into `tips`: [angular; linear] of each tip's origin, world axes.
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

    /// Checks all inputs, then computes the forces. `None` means zero.
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
            numbers("position of a push", p.at.as_slice(), 3)?;
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
