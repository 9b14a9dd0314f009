//! Changes of the colliders of `Collisions`: detail, padding, visibility, pairs, points and cells.
use super::{ArrayLike, Collisions, balls, cells};
use crate::core::lock;
use crate::mechanism::choice;
use linkwork_collision::{Detail, Occupancy};
use linkwork_embedded::Visibility;
use pyo3::prelude::*;

#[pymethods]
impl Collisions {
    /// Select the shapes that the following queries use.
    ///
    /// Parameters
    /// ----------
    /// detail : {"fine", "coarse"}
    ///     "coarse" uses the shapes of `Collider.with_coarse`, and the fine shape of colliders without one. Initially "fine".
    /// of : str, optional
    ///     A name as in `pad` (default: all colliders).
    ///
    /// Raises
    /// ------
    /// LinkworkError
    ///     If `detail` is another word, or the name does not exist.
    ///
    /// Examples
    /// --------
    /// >>> rough = rod.with_coarse(linkwork.Collider.sphere("rough", "arm", 0.6, at=[0.5, 0, 0, 0, 0.5**0.5, 0, 0.5**0.5]))
    /// >>> both = linkwork.Collisions(arm, [rough, linkwork.Collider.sphere("stone", "world", 0.1, at=[0.5, 0.5, 0])], neighbours="collide")
    /// >>> both.set_detail("coarse", of="rod")
    /// >>> coarse = both.collides([0.0])
    /// >>> both.set_detail("fine")
    /// >>> coarse, both.collides([0.0])
    /// (True, False)
    #[pyo3(signature = (detail, *, of=None))]
    fn set_detail(&self, detail: &str, of: Option<&str>) -> PyResult<()> {
        let known = [("fine", Detail::Fine), ("coarse", Detail::Coarse)];
        let detail = choice("detail", detail, &known)?;
        let Some(name) = of else {
            lock(&self.robot).set_detail(detail);
            return Ok(());
        };
        let ids = self.meant(name)?;
        self.ask(|r| ids.into_iter().try_for_each(|id| r.set_detail_of(id, detail)))
    }

    /// Set the padding of colliders: a thickness that is added to their surfaces.
    ///
    /// Parameters
    /// ----------
    /// name : str
    ///     A collider; or a part or an object of a `Robot`, or a body, which stands for all of its colliders.
    /// padding : float
    ///     Thickness, m.
    ///
    /// Raises
    /// ------
    /// LinkworkError
    ///     If the name does not exist, the padding is negative or not finite, or two colliders would touch at every configuration. The settings
    ///     are then unchanged.
    ///
    /// Examples
    /// --------
    /// >>> robot.pad("rod", 0.01)
    /// >>> robot.pad("arm", 0)
    fn pad(&self, name: &str, padding: f64) -> PyResult<()> {
        let ids = self.meant(name)?;
        self.ask(|r| r.pad_all(&ids, padding))
    }

    /// Exclude colliders from all following queries, until `show`.
    ///
    /// Parameters
    /// ----------
    /// name : str
    ///     A name as in `pad`.
    ///
    /// Raises
    /// ------
    /// LinkworkError
    ///     If the name does not exist.
    ///
    /// Examples
    /// --------
    /// >>> robot.hide("seen")
    /// >>> robot.collides([1.6])
    /// False
    fn hide(&self, name: &str) -> PyResult<()> {
        self.set_visibility(name, Visibility::Hidden)
    }

    /// Include colliders that were hidden.
    ///
    /// Parameters
    /// ----------
    /// name : str
    ///     A name as in `pad`.
    ///
    /// Raises
    /// ------
    /// LinkworkError
    ///     If the name does not exist.
    ///
    /// Examples
    /// --------
    /// >>> robot.hide("seen")
    /// >>> robot.show("seen")
    /// >>> robot.collides([1.6])
    /// True
    fn show(&self, name: &str) -> PyResult<()> {
        self.set_visibility(name, Visibility::Shown)
    }

    /// Set whether a pair is checked for collision.
    ///
    /// Parameters
    /// ----------
    /// a, b : str
    ///     Names as in `pad`. If they stand for several colliders, all combinations are set.
    /// look : bool or None
    ///     True checks the pair, False lets it touch, None restores the collision rules.
    ///
    /// Raises
    /// ------
    /// LinkworkError
    ///     If a name does not exist.
    ///
    /// Examples
    /// --------
    /// >>> robot.look_at("rod", "seen", False)
    /// >>> robot.collides([1.6])
    /// False
    #[pyo3(signature = (a, b, look))]
    fn look_at(&self, a: &str, b: &str, look: Option<bool>) -> PyResult<()> {
        let (a, b) = (self.meant(a)?, self.meant(b)?);
        let pairs = a.iter().flat_map(|a| b.iter().map(move |b| (*a, *b))).filter(|(a, b)| a != b);
        self.ask(|r| pairs.into_iter().try_for_each(|(a, b)| r.look_at(a, b, look)))
    }

    /// Return whether a pair is checked for collision when both colliders are shown.
    ///
    /// Parameters
    /// ----------
    /// a, b : str
    ///     Names of the colliders.
    ///
    /// Returns
    /// -------
    /// bool
    ///     True if the pair is checked.
    ///
    /// Raises
    /// ------
    /// LinkworkError
    ///     If a name does not exist.
    ///
    /// Examples
    /// --------
    /// >>> robot.looks_at("rod", "seen")
    /// True
    fn looks_at(&self, a: &str, b: &str) -> PyResult<bool> {
        let (a, b) = (self.id(a)?, self.id(b)?);
        self.ask(|r| r.looks_at(a, b))
    }

    /// Replace the points of a point cloud.
    ///
    /// Parameters
    /// ----------
    /// collider : str
    ///     Name of the point cloud.
    /// points : array_like, shape (n, 4)
    ///     x, y, z and radius of each point in the collider's frame, m.
    ///
    /// Raises
    /// ------
    /// LinkworkError
    ///     If the collider is not a point cloud, there are more points than it has memory for, a radius is negative, or a number is NaN. The
    ///     points are then unchanged.
    ///
    /// Examples
    /// --------
    /// >>> robot.set_points("seen", [[0.5, 0.1, 0, 0.02], [0.6, 0.1, 0, 0.02]])
    /// >>> robot.count("seen")
    /// 2
    fn set_points(&self, collider: &str, points: ArrayLike<'_, '_>) -> PyResult<()> {
        let (id, points) = (self.id(collider)?, balls(points)?);
        self.ask(|r| r.set_points(id, &points))
    }

    /// Mark cells of a voxel map as occupied or free. The map defines the edge length of a cell, m.
    ///
    /// Parameters
    /// ----------
    /// collider : str
    ///     Name of the voxel map.
    /// cells : array_like of int, shape (n, 3)
    ///     Indices of the cells, from 0, along x, y, z.
    /// occupied : bool
    ///     False marks them as free (default: True).
    ///
    /// Raises
    /// ------
    /// LinkworkError
    ///     If the collider is not a voxel map, or a cell is outside. The cells are then unchanged.
    ///
    /// Examples
    /// --------
    /// >>> grid = linkwork.Collider.voxel_map("grid", "world", cells=(10, 10, 10), edge=0.1)
    /// >>> mapped = linkwork.Collisions(arm, [rod, grid], neighbours="collide")
    /// >>> mapped.set_cells("grid", [[5, 0, 0], [6, 0, 0]])
    /// >>> mapped.count("grid")
    /// 2
    #[pyo3(signature = (collider, cells, *, occupied=true))]
    fn set_cells(&self, collider: &str, cells: ArrayLike<'_, '_>, occupied: bool) -> PyResult<()> {
        let (id, cells) = (self.id(collider)?, self::cells(cells)?);
        let to = if occupied { Occupancy::Occupied } else { Occupancy::Free };
        self.ask(|r| r.set_cells(id, &cells, to))
    }

    /// Mark all cells of a voxel map as free.
    ///
    /// Parameters
    /// ----------
    /// collider : str
    ///     Name of the voxel map.
    ///
    /// Raises
    /// ------
    /// LinkworkError
    ///     If the collider is not a voxel map.
    ///
    /// Examples
    /// --------
    /// >>> grid = linkwork.Collider.voxel_map("grid", "world", cells=(10, 10, 10), edge=0.1)
    /// >>> mapped = linkwork.Collisions(arm, [rod, grid], neighbours="collide")
    /// >>> mapped.set_cells("grid", [[5, 0, 0]])
    /// >>> mapped.clear_cells("grid")
    /// >>> mapped.count("grid")
    /// 0
    fn clear_cells(&self, collider: &str) -> PyResult<()> {
        let id = self.id(collider)?;
        self.ask(|r| r.clear_cells(id))
    }

    /// Return the number of points of a point cloud, or of occupied cells of a voxel map.
    ///
    /// Parameters
    /// ----------
    /// collider : str
    ///     Name of the collider.
    ///
    /// Returns
    /// -------
    /// int
    ///     The number.
    ///
    /// Raises
    /// ------
    /// LinkworkError
    ///     If the collider is neither a point cloud nor a voxel map.
    ///
    /// Examples
    /// --------
    /// >>> robot.count("seen")
    /// 1
    fn count(&self, collider: &str) -> PyResult<usize> {
        let id = self.id(collider)?;
        self.ask(|r| r.count(id))
    }
}
