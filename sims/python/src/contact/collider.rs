//! `Collider`: a collision shape on a body.
use super::ArrayLike;
use crate::array::{Input, fixed, pose, vec3};
use crate::collisions::balls;
use crate::error::refuse_with;
use linkwork_collision::{ColliderSpec, Material, Shape};
use linkwork_spatial::Vec3;
use pyo3::prelude::*;

/// A collision shape on a body.
///
/// Create it with `sphere`, `box`, `ellipsoid`, `capsule`, `cylinder`, `half_space`, `hull`, `mesh`, `terrain`, `point_cloud` or `voxel_map`.
///
/// Notes
/// -----
/// Every constructor takes a unique name, the body that carries the shape (or "world"), and sizes in m. Keyword arguments: `at`, pose of the
/// shape's frame in the body ((3,), (7,) or (4, 4)); `friction`, Coulomb coefficient (a pair of shapes has the geometric mean); `restitution` (a
/// pair has the larger value). `Contact` checks the sizes.
///
/// Examples
/// --------
/// >>> import linkwork
/// >>> linkwork.Collider.sphere("ball", "bob", 0.1, restitution=0.8)
/// Collider(ball on bob: Sphere { radius: 0.1 })
#[pyclass(frozen, weakref, module = "linkwork")]
pub struct Collider {
    /// The specification for `linkwork_collision`.
    pub spec: ColliderSpec,
}

impl Collider {
    fn made(
        (name, body): (&str, &str),
        shape: Shape,
        at: Option<ArrayLike<'_, '_>>,
        (friction, restitution): (f64, f64),
    ) -> PyResult<Self> {
        let mut spec = ColliderSpec::new(name, body, shape).at(pose(at, "at")?);
        spec.material = Material { friction, restitution };
        Ok(Self { spec })
    }
}

#[pymethods]
impl Collider {
    /// Create a sphere about the origin of its frame.
    ///
    /// Parameters
    /// ----------
    /// name : str
    ///     Unique name.
    /// body : str
    ///     The body that carries the shape, or "world".
    /// radius : float
    ///     Radius, m.
    /// at : array_like, optional
    ///     Pose in the body, m: (3,), (7,) or (4, 4).
    ///
    /// Returns
    /// -------
    /// Collider
    ///     The shape.
    ///
    /// Raises
    /// ------
    /// LinkworkError
    ///     If the pose is not valid.
    ///
    /// Examples
    /// --------
    /// >>> linkwork.Collider.sphere("ball", "bob", 0.1, at=[0, 0, -1])
    /// Collider(ball on bob: Sphere { radius: 0.1 })
    #[staticmethod]
    #[pyo3(signature = (name, body, radius, *, at=None, friction=0.5, restitution=0.0))]
    fn sphere(
        name: &str,
        body: &str,
        radius: f64,
        at: Option<ArrayLike<'_, '_>>,
        friction: f64,
        restitution: f64,
    ) -> PyResult<Self> {
        Self::made((name, body), Shape::Sphere { radius }, at, (friction, restitution))
    }
    /// Create a box about the origin of its frame.
    ///
    /// Parameters
    /// ----------
    /// name : str
    ///     Unique name.
    /// body : str
    ///     The body that carries the shape, or "world".
    /// size : array_like, shape (3,)
    ///     Edge lengths along x, y, z, m.
    /// at : array_like, optional
    ///     Pose in the body, m: (3,), (7,) or (4, 4).
    ///
    /// Returns
    /// -------
    /// Collider
    ///     The shape.
    ///
    /// Raises
    /// ------
    /// LinkworkError
    ///     If the size has a wrong shape, or the pose is not valid.
    ///
    /// Examples
    /// --------
    /// >>> linkwork.Collider.box("crate", "bob", [0.4, 0.2, 0.1])
    /// Collider(crate on bob: Box { half: [[0.2, 0.1, 0.05]] })
    #[staticmethod]
    #[pyo3(name = "box", signature = (name, body, size, *, at=None, friction=0.5, restitution=0.0))]
    fn cuboid(
        name: &str,
        body: &str,
        size: ArrayLike<'_, '_>,
        at: Option<ArrayLike<'_, '_>>,
        friction: f64,
        restitution: f64,
    ) -> PyResult<Self> {
        let half = 0.5 * vec3(size, "size")?;
        Self::made((name, body), Shape::Box { half }, at, (friction, restitution))
    }
    /// Create an ellipsoid about the origin of its frame.
    ///
    /// Parameters
    /// ----------
    /// name : str
    ///     Unique name.
    /// body : str
    ///     The body that carries the shape, or "world".
    /// radii : array_like, shape (3,)
    ///     Half axes along x, y, z, m.
    /// at : array_like, optional
    ///     Pose in the body, m: (3,), (7,) or (4, 4).
    ///
    /// Returns
    /// -------
    /// Collider
    ///     The shape.
    ///
    /// Raises
    /// ------
    /// LinkworkError
    ///     If the radii have a wrong shape, or the pose is not valid.
    ///
    /// Examples
    /// --------
    /// >>> linkwork.Collider.ellipsoid("egg", "bob", [0.3, 0.2, 0.1])
    /// Collider(egg on bob: Ellipsoid { half: [[0.3, 0.2, 0.1]] })
    #[staticmethod]
    #[pyo3(signature = (name, body, radii, *, at=None, friction=0.5, restitution=0.0))]
    fn ellipsoid(
        name: &str,
        body: &str,
        radii: ArrayLike<'_, '_>,
        at: Option<ArrayLike<'_, '_>>,
        friction: f64,
        restitution: f64,
    ) -> PyResult<Self> {
        let half = vec3(radii, "radii")?;
        Self::made((name, body), Shape::Ellipsoid { half }, at, (friction, restitution))
    }
    /// Create a capsule: all points within a radius of a segment on the z axis, about the origin of its frame.
    ///
    /// Parameters
    /// ----------
    /// name : str
    ///     Unique name.
    /// body : str
    ///     The body that carries the shape, or "world".
    /// radius : float
    ///     Radius, m.
    /// length : float
    ///     Length of the segment, m.
    /// at : array_like, optional
    ///     Pose in the body, m: (3,), (7,) or (4, 4).
    ///
    /// Returns
    /// -------
    /// Collider
    ///     The shape.
    ///
    /// Raises
    /// ------
    /// LinkworkError
    ///     If the pose is not valid.
    ///
    /// Examples
    /// --------
    /// >>> linkwork.Collider.capsule("link", "bob", 0.05, 0.4)
    /// Collider(link on bob: Capsule { radius: 0.05, half_length: 0.2 })
    #[staticmethod]
    #[pyo3(signature = (name, body, radius, length, *, at=None, friction=0.5, restitution=0.0))]
    fn capsule(
        name: &str,
        body: &str,
        radius: f64,
        length: f64,
        at: Option<ArrayLike<'_, '_>>,
        friction: f64,
        restitution: f64,
    ) -> PyResult<Self> {
        let shape = Shape::Capsule { radius, half_length: 0.5 * length };
        Self::made((name, body), shape, at, (friction, restitution))
    }
    /// Create a cylinder about the z axis with flat ends, about the origin of its frame.
    ///
    /// Parameters
    /// ----------
    /// name : str
    ///     Unique name.
    /// body : str
    ///     The body that carries the shape, or "world".
    /// radius, length : float
    ///     Radius and length, m.
    /// at : array_like, optional
    ///     Pose in the body, m: (3,), (7,) or (4, 4).
    ///
    /// Returns
    /// -------
    /// Collider
    ///     The shape.
    ///
    /// Raises
    /// ------
    /// LinkworkError
    ///     If the pose is not valid.
    ///
    /// Examples
    /// --------
    /// >>> linkwork.Collider.cylinder("wheel", "bob", 0.3, 0.1)
    /// Collider(wheel on bob: Cylinder { radius: 0.3, half_length: 0.05 })
    #[staticmethod]
    #[pyo3(signature = (name, body, radius, length, *, at=None, friction=0.5, restitution=0.0))]
    fn cylinder(
        name: &str,
        body: &str,
        radius: f64,
        length: f64,
        at: Option<ArrayLike<'_, '_>>,
        friction: f64,
        restitution: f64,
    ) -> PyResult<Self> {
        let shape = Shape::Cylinder { radius, half_length: 0.5 * length };
        Self::made((name, body), shape, at, (friction, restitution))
    }
    /// Create a half space: all points with z ≤ 0 of its frame. On "world", it is flat ground.
    ///
    /// Parameters
    /// ----------
    /// name : str
    ///     Unique name.
    /// body : str
    ///     The body that carries the shape (default: "world").
    /// at : array_like, optional
    ///     Pose in the body, m: (3,), (7,) or (4, 4).
    ///
    /// Returns
    /// -------
    /// Collider
    ///     The shape.
    ///
    /// Raises
    /// ------
    /// LinkworkError
    ///     If the pose is not valid.
    ///
    /// Examples
    /// --------
    /// >>> linkwork.Collider.half_space("ground", at=[0, 0, -0.5])
    /// Collider(ground on world: HalfSpace)
    #[staticmethod]
    #[pyo3(signature = (name, body="world", *, at=None, friction=0.5, restitution=0.0))]
    fn half_space(
        name: &str,
        body: &str,
        at: Option<ArrayLike<'_, '_>>,
        friction: f64,
        restitution: f64,
    ) -> PyResult<Self> {
        Self::made((name, body), Shape::HalfSpace, at, (friction, restitution))
    }
    /// Create the convex hull of points.
    ///
    /// Parameters
    /// ----------
    /// name : str
    ///     Unique name.
    /// body : str
    ///     The body that carries the shape, or "world".
    /// points : array_like, shape (n, 3)
    ///     Points, m.
    /// at : array_like, optional
    ///     Pose in the body, m: (3,), (7,) or (4, 4).
    ///
    /// Returns
    /// -------
    /// Collider
    ///     The shape.
    ///
    /// Raises
    /// ------
    /// LinkworkError
    ///     If the points have a wrong shape, or the pose is not valid.
    ///
    /// Examples
    /// --------
    /// >>> linkwork.Collider.hull("wedge", "bob", [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]])
    /// Collider(wedge on bob: hull of 4 points)
    #[staticmethod]
    #[pyo3(signature = (name, body, points, *, at=None, friction=0.5, restitution=0.0))]
    fn hull(
        name: &str,
        body: &str,
        points: ArrayLike<'_, '_>,
        at: Option<ArrayLike<'_, '_>>,
        friction: f64,
        restitution: f64,
    ) -> PyResult<Self> {
        let shape = Shape::ConvexHull { points: places(points, "points")? };
        Self::made((name, body), shape, at, (friction, restitution))
    }
    /// Create a triangle mesh. Contact is resolved on the outer side of the triangles only.
    ///
    /// Parameters
    /// ----------
    /// name : str
    ///     Unique name.
    /// body : str
    ///     The body that carries the shape, or "world".
    /// vertices : array_like, shape (n, 3)
    ///     Vertices, m.
    /// triangles : array_like of int, shape (m, 3)
    ///     Indices of the vertices of each triangle, counter-clockwise as seen from outside.
    /// at : array_like, optional
    ///     Pose in the body, m: (3,), (7,) or (4, 4).
    ///
    /// Returns
    /// -------
    /// Collider
    ///     The shape.
    ///
    /// Raises
    /// ------
    /// LinkworkError
    ///     If an array has a wrong shape, or the pose is not valid.
    ///
    /// Examples
    /// --------
    /// >>> linkwork.Collider.mesh("plate", "bob", [[0, 0, 0], [1, 0, 0], [0, 1, 0]], [(0, 1, 2)])
    /// Collider(plate on bob: mesh of 1 triangles)
    #[staticmethod]
    #[pyo3(signature = (name, body, vertices, triangles, *, at=None, friction=0.5, restitution=0.0))]
    fn mesh(
        name: &str,
        body: &str,
        vertices: ArrayLike<'_, '_>,
        triangles: Vec<[u32; 3]>,
        at: Option<ArrayLike<'_, '_>>,
        friction: f64,
        restitution: f64,
    ) -> PyResult<Self> {
        let shape = Shape::Mesh { vertices: places(vertices, "vertices")?, triangles };
        Self::made((name, body), shape, at, (friction, restitution))
    }
    /// Create ground from a grid of heights, solid below and centred on the origin of its frame.
    ///
    /// Parameters
    /// ----------
    /// name : str
    ///     Unique name.
    /// heights : array_like, shape (ny, nx)
    ///     Heights, m; `heights[j, i]` is at the i-th x and the j-th y.
    /// spacing : array_like, shape (2,)
    ///     Distance of the grid points along x and y, m.
    /// body : str
    ///     The body that carries the shape (default: "world").
    /// at : array_like, optional
    ///     Pose in the body, m: (3,), (7,) or (4, 4).
    ///
    /// Returns
    /// -------
    /// Collider
    ///     The shape.
    ///
    /// Raises
    /// ------
    /// LinkworkError
    ///     If the heights or the spacing have a wrong shape, or the pose is not valid.
    ///
    /// Examples
    /// --------
    /// >>> linkwork.Collider.terrain("hill", [[0, 0, 0], [0, 0.2, 0]], [0.5, 0.5])
    /// Collider(hill on world: terrain of 2 × 3 heights)
    #[staticmethod]
    #[pyo3(signature = (name, heights, spacing, body="world", *, at=None, friction=0.5, restitution=0.0))]
    fn terrain(
        name: &str,
        heights: ArrayLike<'_, '_>,
        spacing: ArrayLike<'_, '_>,
        body: &str,
        at: Option<ArrayLike<'_, '_>>,
        friction: f64,
        restitution: f64,
    ) -> PyResult<Self> {
        let input = Input::read(heights, "heights")?;
        let [y, x] = *input.shape() else {
            let fact = format!("`heights` has {} dimensions", input.shape().len());
            return Err(refuse_with(fact, "give it the shape (ny, nx)"));
        };
        let spacing = fixed::<2>(spacing, "spacing")?;
        let shape = Shape::HeightField { x, y, spacing, heights: input.slice().into() };
        Self::made((name, body), shape, at, (friction, restitution))
    }

    /// Create a point cloud: a sphere about each point. `Collisions.set_points` replaces the points.
    ///
    /// Parameters
    /// ----------
    /// name : str
    ///     Unique name.
    /// body : str
    ///     The body that carries the shape, or "world".
    /// points : array_like, shape (n, 4), optional
    ///     x, y, z and radius (0 or more) of each point, m (default: no points).
    /// room : int
    ///     Number of points for which `Collisions.set_points` has memory; at least the number of `points`.
    /// at : array_like, optional
    ///     Pose in the body, m: (3,), (7,) or (4, 4).
    ///
    /// Returns
    /// -------
    /// Collider
    ///     The shape.
    ///
    /// Raises
    /// ------
    /// LinkworkError
    ///     If the points have a wrong shape, or the pose is not valid.
    ///
    /// Examples
    /// --------
    /// >>> linkwork.Collider.point_cloud("scan", "world", [[0, 0, 1, 0.01], [0, 1, 1, 0.01]], room=1000)
    /// Collider(scan on world: cloud of 2 points)
    #[staticmethod]
    #[pyo3(signature = (name, body, points=None, *, room=0, at=None, friction=0.5, restitution=0.0))]
    fn point_cloud(
        name: &str,
        body: &str,
        points: Option<ArrayLike<'_, '_>>,
        room: usize,
        at: Option<ArrayLike<'_, '_>>,
        friction: f64,
        restitution: f64,
    ) -> PyResult<Self> {
        let points = points.map_or(Ok(Vec::new()), balls)?;
        Self::made((name, body), Shape::PointCloud { points, room }, at, (friction, restitution))
    }
    /// Create a voxel map: a grid of cubes that are solid or free. `Collisions.set_cells` changes the cells.
    ///
    /// Parameters
    /// ----------
    /// name : str
    ///     Unique name.
    /// body : str
    ///     The body that carries the shape, or "world".
    /// cells : sequence of int, shape (3,)
    ///     Number of cells along x, y, z. The grid begins at the origin of its frame.
    /// edge : float
    ///     Edge length of a cell, m.
    /// occupied : array_like of int, shape (n, 3), optional
    ///     Indices, from 0, of the solid cells (default: none).
    /// at : array_like, optional
    ///     Pose in the body, m: (3,), (7,) or (4, 4).
    ///
    /// Returns
    /// -------
    /// Collider
    ///     The shape.
    ///
    /// Raises
    /// ------
    /// LinkworkError
    ///     If the indices have a wrong shape, or the pose is not valid.
    ///
    /// Examples
    /// --------
    /// >>> linkwork.Collider.voxel_map("map", "world", (10, 10, 5), 0.1, occupied=[[0, 0, 0], [1, 0, 0]])
    /// Collider(map on world: voxel map of 10 × 10 × 5 cells)
    #[staticmethod]
    #[pyo3(signature = (name, body, cells, edge, *, occupied=None, at=None, friction=0.5, restitution=0.0))]
    fn voxel_map(
        name: &str,
        body: &str,
        cells: [usize; 3],
        edge: f64,
        occupied: Option<ArrayLike<'_, '_>>,
        at: Option<ArrayLike<'_, '_>>,
        friction: f64,
        restitution: f64,
    ) -> PyResult<Self> {
        let occupied = crate::collisions::occupied(occupied)?;
        let shape = Shape::VoxelMap { cells, edge, occupied };
        Self::made((name, body), shape, at, (friction, restitution))
    }

    /// Name of the collider.
    ///
    /// Examples
    /// --------
    /// >>> linkwork.Collider.half_space("ground").name
    /// 'ground'
    #[getter]
    fn name(&self) -> &str {
        &self.spec.name
    }
    /// The body that carries it, or "world".
    ///
    /// Examples
    /// --------
    /// >>> linkwork.Collider.half_space("ground").body
    /// 'world'
    #[getter]
    fn body(&self) -> &str {
        &self.spec.body
    }
    /// Coulomb friction coefficient.
    ///
    /// Examples
    /// --------
    /// >>> linkwork.Collider.half_space("ground", friction=0.8).friction
    /// 0.8
    #[getter]
    fn friction(&self) -> f64 {
        self.spec.material.friction
    }
    /// Coefficient of restitution.
    ///
    /// Examples
    /// --------
    /// >>> linkwork.Collider.half_space("ground", restitution=0.3).restitution
    /// 0.3
    #[getter]
    fn restitution(&self) -> f64 {
        self.spec.material.restitution
    }
    /// Name of the material, for `pairs` of `Contact`; None if it has no name.
    ///
    /// Examples
    /// --------
    /// >>> linkwork.Collider.half_space("ground").material(name="ice").material_name
    /// 'ice'
    #[getter]
    fn material_name(&self) -> Option<&str> {
        self.spec.material_name.as_deref()
    }
    /// Return a copy with a second, simpler shape for coarse queries (`Collisions.set_detail`).
    ///
    /// Parameters
    /// ----------
    /// simpler : Collider
    ///     The simpler shape; it must have the same `body` and `at`. Only its shape is used.
    ///
    /// Returns
    /// -------
    /// Collider
    ///     The copy.
    ///
    /// Raises
    /// ------
    /// LinkworkError
    ///     If the two are in different frames.
    ///
    /// Examples
    /// --------
    /// >>> linkwork.Collider.box("crate", "bob", [0.4, 0.2, 0.1]).with_coarse(linkwork.Collider.sphere("ball", "bob", 0.23)).has_coarse
    /// True
    fn with_coarse(&self, simpler: &Self) -> PyResult<Self> {
        let (own, other) = (&self.spec, &simpler.spec);
        if own.body != other.body || own.pose != other.pose {
            let fact = format!("`{}` and `{}` are in different frames", own.name, other.name);
            return Err(refuse_with(fact, "give both the same `body` and `at`"));
        }
        Ok(Self { spec: ColliderSpec { coarse: Some(other.fine.clone()), ..own.clone() } })
    }
    /// True if the collider has a coarse shape.
    ///
    /// Examples
    /// --------
    /// >>> linkwork.Collider.half_space("ground").has_coarse
    /// False
    #[getter]
    fn has_coarse(&self) -> bool {
        self.spec.coarse.is_some()
    }
    /// Return a copy with another friction, restitution or material name. Omitted properties do not change.
    ///
    /// `Contact` checks the values.
    ///
    /// Parameters
    /// ----------
    /// friction, restitution : float, optional
    ///     The coefficients.
    /// name : str, optional
    ///     Name of the material.
    ///
    /// Returns
    /// -------
    /// Collider
    ///     The copy.
    ///
    /// Examples
    /// --------
    /// >>> ice = linkwork.Collider.half_space("ground", restitution=0.3).material(friction=0.05, name="ice")
    /// >>> ice.friction, ice.restitution, ice.material_name
    /// (0.05, 0.3, 'ice')
    #[pyo3(signature = (*, friction=None, restitution=None, name=None))]
    fn material(
        &self,
        friction: Option<f64>,
        restitution: Option<f64>,
        name: Option<String>,
    ) -> Self {
        let mut spec = self.spec.clone();
        spec.material_name = name.or(spec.material_name);
        let own = spec.material;
        spec.material = Material {
            friction: friction.unwrap_or(own.friction),
            restitution: restitution.unwrap_or(own.restitution),
        };
        Self { spec }
    }
    fn __repr__(&self) -> String {
        let shape = match &self.spec.fine {
            Shape::ConvexHull { points } => format!("hull of {} points", points.len()),
            Shape::Mesh { triangles, .. } => format!("mesh of {} triangles", triangles.len()),
            Shape::HeightField { x, y, .. } => format!("terrain of {y} × {x} heights"),
            Shape::PointCloud { points, .. } => format!("cloud of {} points", points.len()),
            Shape::VoxelMap { cells: [x, y, z], .. } => {
                format!("voxel map of {x} × {y} × {z} cells")
            }
            solid => format!("{solid:?}"),
        };
        format!("Collider({} on {}: {shape})", self.spec.name, self.spec.body)
    }
}

/// Reads points (n, 3).
fn places(given: ArrayLike<'_, '_>, what: &str) -> PyResult<Vec<Vec3>> {
    let input = Input::read(given, what)?;
    match *input.shape() {
        [_, 3] => Ok(input.slice().chunks_exact(3).map(Vec3::from_column_slice).collect()),
        ref shape => Err(refuse_with(
            format!("`{what}` has the shape {shape:?}"),
            "give it the shape (n, 3)",
        )),
    }
}
