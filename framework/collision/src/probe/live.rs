//! Obstacles from sensor data: points of clouds and cells of maps that change between queries without rebuilding.

use super::{Probe, ball};
use crate::colliders::Colliders;
use crate::error::ShapeFault;
use crate::item::ColliderId;
use crate::pieces::Pieces;
use crate::shape::Occupancy;
use crate::solid::{Kind, Solid};

impl Probe {
    /// Replaces the points of a [`Shape::PointCloud`](crate::Shape::PointCloud), which is a fine shape: x, y, z, radius of each, m, in its frame. O(n
    /// log n), no allocation.
    ///
    /// # Errors
    /// [`ShapeFault::Kind`], [`ShapeFault::Points`] for more points than reserved, [`ShapeFault::NotFinite`], [`ShapeFault::Radius`]. After an error
    /// nothing has changed.
    pub fn set_points(
        &mut self,
        colliders: &Colliders,
        id: ColliderId,
        points: &[[f64; 4]],
    ) -> Result<(), ShapeFault> {
        self.change(colliders, id, |p| match p {
            Some(Pieces::Balls(balls)) => balls.fill(points),
            _ => Err(ShapeFault::Kind { wanted: "point cloud" }),
        })
    }

    /// Sets cells of a [`Shape::VoxelMap`](crate::Shape::VoxelMap), which is a fine shape, to occupied or free. O(cells), no allocation.
    ///
    /// # Errors
    /// [`ShapeFault::Kind`], [`ShapeFault::Outside`]. After an error nothing has changed.
    pub fn set_cells(
        &mut self,
        colliders: &Colliders,
        id: ColliderId,
        cells: &[[u32; 3]],
        to: Occupancy,
    ) -> Result<(), ShapeFault> {
        self.change(colliders, id, |p| match p {
            Some(Pieces::Cells(map)) => map.set(cells, to),
            _ => Err(ShapeFault::Kind { wanted: "voxel map" }),
        })
    }

    /// Sets all cells of a voxel map to free.
    ///
    /// # Errors
    /// [`ShapeFault::Kind`].
    pub fn clear_cells(&mut self, colliders: &Colliders, id: ColliderId) -> Result<(), ShapeFault> {
        self.change(colliders, id, |p| match p {
            Some(Pieces::Cells(map)) => {
                map.clear();
                Ok(())
            }
            _ => Err(ShapeFault::Kind { wanted: "voxel map" }),
        })
    }

    /// Returns the state of a cell of a voxel map.
    ///
    /// # Errors
    /// [`ShapeFault::Kind`], [`ShapeFault::Outside`].
    #[track_caller]
    pub fn cell(&self, id: ColliderId, cell: [u32; 3]) -> Result<Occupancy, ShapeFault> {
        let live = self.live[id.index()].as_deref();
        let Some(Solid { kind: Kind::Pieces(Pieces::Cells(map)), .. }) = live else {
            return Err(ShapeFault::Kind { wanted: "voxel map" });
        };
        map.get(cell).ok_or(ShapeFault::Outside { index: 0, cell, cells: map.n() })
    }

    /// Returns the number of points of a point cloud, or of occupied cells of a voxel map; `None` for any other shape.
    #[must_use]
    #[track_caller]
    pub fn count(&self, id: ColliderId) -> Option<usize> {
        match &self.live[id.index()].as_deref()?.kind {
            Kind::Pieces(p) => Some(p.count()),
            _ => None,
        }
    }

    /// Changes the pieces of a collider and updates its stored size.
    #[track_caller]
    fn change(
        &mut self,
        colliders: &Colliders,
        id: ColliderId,
        with: impl FnOnce(Option<&mut Pieces>) -> Result<(), ShapeFault>,
    ) -> Result<(), ShapeFault> {
        let Some(live) = &mut self.live[id.index()] else { return with(None) };
        let Kind::Pieces(p) = &mut live.kind else { return with(None) };
        with(Some(p))?;
        ((live.lo, live.hi), live.size) = (p.bounds(), p.size());
        let ball = ball(live);
        let [fine, coarse] = &mut self.balls[id.index()];
        *fine = ball;
        if colliders.spec(id).coarse.is_none() {
            *coarse = ball;
        }
        Ok(())
    }
}
