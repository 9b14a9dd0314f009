//! What sensors see: points of clouds and cells of maps, changed between questions without building anything.

use super::{Probe, ball};
use crate::colliders::{ColliderId, Colliders};
use crate::error::ShapeFault;
use crate::pieces::Pieces;
use crate::shape::Occupancy;
use crate::solid::{Kind, Solid};

impl Probe {
    /// Other points of a [`Shape::PointCloud`](crate::Shape::PointCloud), its fine shape: x, y, z, radius of each, m, in its frame. O(n log n),
    /// no allocation.
    ///
    /// # Errors
    /// [`ShapeFault::Kind`], [`ShapeFault::Points`] for more than there is room for, [`ShapeFault::NotFinite`], [`ShapeFault::Radius`]; then
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

    /// Makes cells of a [`Shape::VoxelMap`](crate::Shape::VoxelMap), its fine shape, occupied or free. O(cells), no allocation.
    ///
    /// # Errors
    /// [`ShapeFault::Kind`], [`ShapeFault::Outside`]; then nothing has changed.
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

    /// Makes all cells of a voxel map free.
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

    /// What a cell of a voxel map is now.
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

    /// How many points of a point cloud, or occupied cells of a voxel map, there are now; `None` for any other shape.
    #[must_use]
    #[track_caller]
    pub fn count(&self, id: ColliderId) -> Option<usize> {
        match &self.live[id.index()].as_deref()?.kind {
            Kind::Pieces(p) => Some(p.count()),
            _ => None,
        }
    }

    /// Changes the pieces of a collider, and what is known of its size.
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
