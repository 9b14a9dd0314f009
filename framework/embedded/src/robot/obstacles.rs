//! What sensors see, as obstacles: point clouds and voxel maps that change while the robot works.
//!
//! Both are colliders of the model ([`Shape::PointCloud`](crate::Shape::PointCloud), [`Shape::VoxelMap`](crate::Shape::VoxelMap)), on the world, on a body or
//! on an object, with rules, padding and hiding like any other; the model says for how many points there is room and how large the map is. What
//! they hold now is each instance's own, and goes with its clones. One on an object moves with [`Robot::put`], and with the hand that holds it.

use super::Robot;
use crate::error::RobotError;
use linkwork_collision::{ColliderId, Occupancy};

impl Robot {
    /// Other points of a point cloud instead of those that it has: x, y, z, radius of each, m, in the collider's frame. O(n log n), no allocation.
    ///
    /// # Errors
    /// [`RobotError::ForeignHandle`]; [`RobotError::Shape`] for a collider that is no point cloud, more points than there is room for, NaN and
    /// negative radii. Then nothing has changed.
    pub fn set_points(&mut self, id: ColliderId, points: &[[f64; 4]]) -> Result<(), RobotError> {
        self.known(id)?;
        Ok(self.collide.probe.set_points(&self.model.scene.colliders, id, points)?)
    }

    /// Makes cells of a voxel map occupied or free: indices along x, y, z from 0. O(cells), no allocation.
    ///
    /// # Errors
    /// [`RobotError::ForeignHandle`]; [`RobotError::Shape`] for a collider that is no voxel map, and for cells outside. Then nothing has changed.
    pub fn set_cells(
        &mut self,
        id: ColliderId,
        cells: &[[u32; 3]],
        to: Occupancy,
    ) -> Result<(), RobotError> {
        self.known(id)?;
        Ok(self.collide.probe.set_cells(&self.model.scene.colliders, id, cells, to)?)
    }

    /// Makes all cells of a voxel map free.
    ///
    /// # Errors
    /// [`RobotError::ForeignHandle`]; [`RobotError::Shape`] for a collider that is no voxel map.
    pub fn clear_cells(&mut self, id: ColliderId) -> Result<(), RobotError> {
        self.known(id)?;
        Ok(self.collide.probe.clear_cells(&self.model.scene.colliders, id)?)
    }

    /// What a cell of a voxel map is now.
    ///
    /// # Errors
    /// [`RobotError::ForeignHandle`]; [`RobotError::Shape`] for a collider that is no voxel map, and for a cell outside.
    pub fn cell(&self, id: ColliderId, cell: [u32; 3]) -> Result<Occupancy, RobotError> {
        self.known(id)?;
        Ok(self.collide.probe.cell(id, cell)?)
    }

    /// How many points a point cloud has now, or occupied cells a voxel map.
    ///
    /// # Errors
    /// [`RobotError::ForeignHandle`]; [`RobotError::Shape`] for any other collider.
    pub fn count(&self, id: ColliderId) -> Result<usize, RobotError> {
        self.known(id)?;
        let wanted = "point cloud and no voxel map";
        Ok(self.collide.probe.count(id).ok_or(linkwork_collision::ShapeFault::Kind { wanted })?)
    }
}
