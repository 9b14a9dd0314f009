//! Obstacles from sensor data: point clouds and voxel maps that change while the robot works.
//!
//! Both are colliders of the model ([`Shape::PointCloud`](crate::Shape::PointCloud), [`Shape::VoxelMap`](crate::Shape::VoxelMap)) in the world, on a
//! body or on an object. Rules, padding and visibility apply to them as to any other collider. The model defines the maximum number of points and the
//! size of the map. The current content belongs to each instance and is copied to its clones. A cloud or map on an object moves with [`Robot::put`]
//! and with the hand that holds the object.

use super::Robot;
use crate::error::RobotError;
use linkwork_collision::{ColliderId, Occupancy};

impl Robot {
    /// Replaces the points of a point cloud. Each point is x, y, z, radius, m, in the collider's frame. O(n log n), no allocation.
    ///
    /// # Errors
    /// [`RobotError::ForeignHandle`]; [`RobotError::Shape`] for a collider that is not a point cloud, more points than the model reserves, NaN and
    /// negative radii. After an error nothing has changed.
    pub fn set_points(&mut self, id: ColliderId, points: &[[f64; 4]]) -> Result<(), RobotError> {
        self.known(id)?;
        Ok(self.collide.probe.set_points(&self.model.scene.colliders, id, points)?)
    }

    /// Sets cells of a voxel map to occupied or free. Indices are along x, y, z from 0. O(cells), no allocation.
    ///
    /// # Errors
    /// [`RobotError::ForeignHandle`]; [`RobotError::Shape`] for a collider that is not a voxel map, and for cells outside the map. After an error
    /// nothing has changed.
    pub fn set_cells(
        &mut self,
        id: ColliderId,
        cells: &[[u32; 3]],
        to: Occupancy,
    ) -> Result<(), RobotError> {
        self.known(id)?;
        Ok(self.collide.probe.set_cells(&self.model.scene.colliders, id, cells, to)?)
    }

    /// Sets all cells of a voxel map to free.
    ///
    /// # Errors
    /// [`RobotError::ForeignHandle`]; [`RobotError::Shape`] for a collider that is not a voxel map.
    pub fn clear_cells(&mut self, id: ColliderId) -> Result<(), RobotError> {
        self.known(id)?;
        Ok(self.collide.probe.clear_cells(&self.model.scene.colliders, id)?)
    }

    /// Returns the state of a cell of a voxel map.
    ///
    /// # Errors
    /// [`RobotError::ForeignHandle`]; [`RobotError::Shape`] for a collider that is not a voxel map, and for a cell outside the map.
    pub fn cell(&self, id: ColliderId, cell: [u32; 3]) -> Result<Occupancy, RobotError> {
        self.known(id)?;
        Ok(self.collide.probe.cell(id, cell)?)
    }

    /// Returns the number of points of a point cloud, or of occupied cells of a voxel map.
    ///
    /// # Errors
    /// [`RobotError::ForeignHandle`]; [`RobotError::Shape`] for any other collider.
    pub fn count(&self, id: ColliderId) -> Result<usize, RobotError> {
        self.known(id)?;
        let wanted = "point cloud or a voxel map";
        Ok(self.collide.probe.count(id).ok_or(linkwork_collision::ShapeFault::Kind { wanted })?)
    }
}
