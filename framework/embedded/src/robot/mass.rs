//! Mass matrix, mass, centre of mass, composite inertias and momentum of the whole robot, including held objects.

use super::{Robot, numbers};
use crate::error::RobotError;
use linkwork_dynamics::{
    center_of_mass, centroidal_matrix, kinematics, mass_matrix, momentum, subtree_inertia,
};
use linkwork_multibody::BodyId;
use linkwork_spatial::{Force, RigidInertia, Vec3};

impl Robot {
    /// Writes the mass matrix M (nv × nv, row after row) at the robot's q, including held objects.
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

    /// Returns mass (kg) and centre of mass (world, m) of all moving bodies at the robot's q, including held objects. Bodies that are welded to the
    /// world are not included. If no body has mass, the centre is that of the first moving body.
    pub fn center_of_mass(&mut self) -> (f64, Vec3) {
        self.move_all();
        (self.tree.total_mass(), center_of_mass(&self.tree, &self.ws))
    }

    /// Returns the composite inertia of a body: the inertia of the body, everything that it carries, and held objects, as one rigid body at the
    /// robot's q, about the body's origin in world axes. O(bodies).
    #[must_use]
    pub fn composite_inertia(&mut self, body: BodyId) -> RigidInertia {
        self.move_all();
        subtree_inertia(&self.tree, &self.ws, body)
    }

    /// Returns the momentum about the centre of mass at the robot's q and rates `v` (nv), including held objects: angular (kg m²/s) in `moment`,
    /// linear (kg m/s) in `force`, world axes.
    ///
    /// # Errors
    /// [`RobotError::Length`], [`RobotError::NotFinite`].
    pub fn momentum(&mut self, v: &[f64]) -> Result<Force, RobotError> {
        numbers("v", v, self.tree.nv())?;
        kinematics(&self.tree, &mut self.ws, &self.q, v);
        self.fresh = true;
        Ok(momentum(&self.tree, &self.ws))
    }

    /// Writes the centroidal momentum matrix (6 × nv, row after row) at the robot's q, including held objects. It maps rates to
    /// [`momentum`](Self::momentum).
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
