//! Mass matrix, mass and centre of mass of the whole, with what is held.

use super::Robot;
use crate::error::RobotError;
use linkwork_dynamics::{center_of_mass, mass_matrix};
use linkwork_spatial::Vec3;

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
}
