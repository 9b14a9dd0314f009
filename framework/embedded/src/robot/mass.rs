//! Mass matrix, mass, centre of mass, composite inertias and momentum of the whole, with what is held.

use super::{Robot, numbers};
use crate::error::RobotError;
use linkwork_dynamics::{
    center_of_mass, centroidal_matrix, kinematics, mass_matrix, momentum, subtree_inertia,
};
use linkwork_multibody::BodyId;
use linkwork_spatial::{Force, RigidInertia, Vec3};

impl Robot {
    /// M (nv × nv, row after row) at the robot's q, with what is held.
    ///
    /// # Errors
    /// [`RobotError::Length`].
    pub fn mass_matrix(&mut self, M: &mut [f64]) -> Result<(), RobotError> {
        let wanted = self.tree.nv() * self.tree.nv();
        if M.len() != wanted {
            return Err(RobotError::Length { what: "M", got: M.len(), wanted });
        }
        self.move_all();
        mass_matrix(&self.tree, &mut self.ws, M);
        Ok(())
    }

    /// Mass (kg) and centre of mass (world, m) at the robot's q of all that moves, with what is held. Bodies
    /// that are welded to the world do not count. The centre is that of the first body that moves where nothing has mass.
    pub fn center_of_mass(&mut self) -> (f64, Vec3) {
        self.move_all();
        (self.tree.total_mass(), center_of_mass(&self.tree, &self.ws))
    }

    /// The composite inertia of a body: that of all that it carries and itself, with what is held, as if they were one at the robot's q; about the
    /// body's origin, world axes. O(bodies).
    #[must_use]
    pub fn composite_inertia(&mut self, body: BodyId) -> RigidInertia {
        self.move_all();
        subtree_inertia(&self.tree, &self.ws, body)
    }

    /// Momentum about the centre of mass at the robot's q and rates `v` (nv), with what is held: angular (kg m²/s) in `moment`, linear (kg m/s) in
    /// `force`, world axes.
    ///
    /// # Errors
    /// [`RobotError::Length`], [`RobotError::NotFinite`].
    pub fn momentum(&mut self, v: &[f64]) -> Result<Force, RobotError> {
        numbers("v", v, self.tree.nv())?;
        kinematics(&self.tree, &mut self.ws, &self.q, v);
        self.fresh = true;
        Ok(momentum(&self.tree, &self.ws))
    }

    /// The centroidal momentum matrix (6 × nv, row after row) at the robot's q, with what is held: rates to [`momentum`](Self::momentum).
    ///
    /// # Errors
    /// [`RobotError::Length`].
    pub fn centroidal_matrix(&mut self, A: &mut [f64]) -> Result<(), RobotError> {
        let wanted = 6 * self.tree.nv();
        if A.len() != wanted {
            return Err(RobotError::Length { what: "A", got: A.len(), wanted });
        }
        self.move_all();
        centroidal_matrix(&self.tree, &mut self.ws, A);
        Ok(())
    }
}
