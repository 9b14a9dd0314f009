//! `Collider`: a shape on a body that touches others.
use super::Given;
use crate::array::{Input, fixed, pose, vec3};
use crate::collisions::balls;
use crate::error::refuse_with;
use linkwork_collision::{ColliderSpec, Material, Shape};
use linkwork_spatial::Vec3;
use pyo3::prelude::*;

/// A shape on a body that touches others.
///
/// Made by `sphere`, `box`, `capsule`, `cylinder`, `half_space`, `hull`, `mesh`, `terrain`, `point_cloud`, `voxel_map`. Each takes a name of its own, the
/// body that carries it (or "world"), sizes in m, and by name: at, the shape's frame in the body ((3,), (7,) or (4, 4)); friction, Coulomb's
/// coefficient (of a pair: the geometric mean); restitution (of a pair: the larger). Sizes are checked by `Contact`.
///
/// >>> import linkwork
/// >>> linkwork.Collider.sphere("ball", "bob", 0.1, restitution=0.8)
/// Collider(ball on bob: Sphere { radius: 0.1 })
#[pyclass(frozen, weakref, module = "linkwork")]
pub struct Collider {
    /// What `linkwork_collision` takes.
    pub spec: ColliderSpec,
}

impl Collider {
    fn made(
        (name, body): (&str, &str),
        shape: Shape,
        at: Option<Given<'_, '_>>,
        (friction, restitution): (f64, f64),
    ) -> PyResult<Self> {
        let mut spec = ColliderSpec::new(name, body, shape).at(pose(at, "at")?);
        spec.material = Material { friction, restitution };
        Ok(Self { spec })
    }
}

#[pymethods]
impl Collider {
    /// A ball about the origin; radius in m. pose: (3,), (7,) or (4, 4).
    /// Raises LinkworkError for what is no pose.
    ///
    /// >>> linkwork.Collider.sphere("ball", "bob", 0.1, at=[0, 0, -1])
    /// Collider(ball on bob: Sphere { radius: 0.1 })
    #[staticmethod]
    #[pyo3(signature = (name, body, radius, *, at=None, friction=0.5, restitution=0.0))]
    fn sphere(
        name: &str,
        body: &str,
        radius: f64,
        at: Option<Given<'_, '_>>,
        friction: f64,
        restitution: f64,
    ) -> PyResult<Self> {
        Self::made((name, body), Shape::Sphere { radius }, at, (friction, restitution))
    }
    /// A box about the origin; size (3,): whole edges along x, y, z, m.
    /// Raises LinkworkError for a size of another shape, and for what is no pose.
    ///
    /// >>> linkwork.Collider.box("crate", "bob", [0.4, 0.2, 0.1])
    /// Collider(crate on bob: Box { half: [[0.2, 0.1, 0.05]] })
    #[staticmethod]
    #[pyo3(name = "box", signature = (name, body, size, *, at=None, friction=0.5, restitution=0.0))]
    fn cuboid(
        name: &str,
        body: &str,
        size: Given<'_, '_>,
        at: Option<Given<'_, '_>>,
        friction: f64,
        restitution: f64,
    ) -> PyResult<Self> {
        let half = 0.5 * vec3(size, "size")?;
        Self::made((name, body), Shape::Box { half }, at, (friction, restitution))
    }
    /// An ellipsoid about the origin; radii (3,): half axes along x, y, z, m.
    /// Raises LinkworkError for radii of another shape, and for what is no pose.
    ///
    /// >>> linkwork.Collider.ellipsoid("egg", "bob", [0.3, 0.2, 0.1])
    /// Collider(egg on bob: Ellipsoid { half: [[0.3, 0.2, 0.1]] })
    #[staticmethod]
    #[pyo3(signature = (name, body, radii, *, at=None, friction=0.5, restitution=0.0))]
    fn ellipsoid(
        name: &str,
        body: &str,
        radii: Given<'_, '_>,
        at: Option<Given<'_, '_>>,
        friction: f64,
        restitution: f64,
    ) -> PyResult<Self> {
        let half = vec3(radii, "radii")?;
        Self::made((name, body), Shape::Ellipsoid { half }, at, (friction, restitution))
    }
    /// All within a radius of a segment of this length on the z axis, about the origin, m. pose: (3,), (7,) or (4, 4).
    /// Raises LinkworkError for what is no pose.
    ///
    /// >>> linkwork.Collider.capsule("link", "bob", 0.05, 0.4)
    /// Collider(link on bob: Capsule { radius: 0.05, half_length: 0.2 })
    #[staticmethod]
    #[pyo3(signature = (name, body, radius, length, *, at=None, friction=0.5, restitution=0.0))]
    fn capsule(
        name: &str,
        body: &str,
        radius: f64,
        length: f64,
        at: Option<Given<'_, '_>>,
        friction: f64,
        restitution: f64,
    ) -> PyResult<Self> {
        let shape = Shape::Capsule { radius, half_length: 0.5 * length };
        Self::made((name, body), shape, at, (friction, restitution))
    }
    /// A cylinder about the z axis with flat ends, about the origin, m. pose: (3,), (7,) or (4, 4).
    /// Raises LinkworkError for what is no pose.
    ///
    /// >>> linkwork.Collider.cylinder("wheel", "bob", 0.3, 0.1)
    /// Collider(wheel on bob: Cylinder { radius: 0.3, half_length: 0.05 })
    #[staticmethod]
    #[pyo3(signature = (name, body, radius, length, *, at=None, friction=0.5, restitution=0.0))]
    fn cylinder(
        name: &str,
        body: &str,
        radius: f64,
        length: f64,
        at: Option<Given<'_, '_>>,
        friction: f64,
        restitution: f64,
    ) -> PyResult<Self> {
        let shape = Shape::Cylinder { radius, half_length: 0.5 * length };
        Self::made((name, body), shape, at, (friction, restitution))
    }
    /// All points with z ≤ 0 of its frame: the ground, on "world".
    /// Raises LinkworkError for what is no pose (at: (3,), m, (7,) or (4, 4)).
    ///
    /// >>> linkwork.Collider.half_space("ground", at=[0, 0, -0.5])
    /// Collider(ground on world: HalfSpace)
    #[staticmethod]
    #[pyo3(signature = (name, body="world", *, at=None, friction=0.5, restitution=0.0))]
    fn half_space(
        name: &str,
        body: &str,
        at: Option<Given<'_, '_>>,
        friction: f64,
        restitution: f64,
    ) -> PyResult<Self> {
        Self::made((name, body), Shape::HalfSpace, at, (friction, restitution))
    }
    /// The convex hull of points (n, 3), m.
    /// Raises LinkworkError for points of another shape, and for what is no pose.
    ///
    /// >>> linkwork.Collider.hull("wedge", "bob", [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]])
    /// Collider(wedge on bob: hull of 4 points)
    #[staticmethod]
    #[pyo3(signature = (name, body, points, *, at=None, friction=0.5, restitution=0.0))]
    fn hull(
        name: &str,
        body: &str,
        points: Given<'_, '_>,
        at: Option<Given<'_, '_>>,
        friction: f64,
        restitution: f64,
    ) -> PyResult<Self> {
        let shape = Shape::ConvexHull { points: places(points, "points")? };
        Self::made((name, body), shape, at, (friction, restitution))
    }
    /// Triangles (m, 3): places among the vertices (n, 3) (m), counter-clockwise seen from outside. Only the outside pushes.
    /// Raises LinkworkError for vertices of another shape, and for what is no pose.
    ///
    /// >>> linkwork.Collider.mesh("plate", "bob", [[0, 0, 0], [1, 0, 0], [0, 1, 0]], [(0, 1, 2)])
    /// Collider(plate on bob: mesh of 1 triangles)
    #[staticmethod]
    #[pyo3(signature = (name, body, vertices, triangles, *, at=None, friction=0.5, restitution=0.0))]
    fn mesh(
        name: &str,
        body: &str,
        vertices: Given<'_, '_>,
        triangles: Vec<[u32; 3]>,
        at: Option<Given<'_, '_>>,
        friction: f64,
        restitution: f64,
    ) -> PyResult<Self> {
        let shape = Shape::Mesh { vertices: places(vertices, "vertices")?, triangles };
        Self::made((name, body), shape, at, (friction, restitution))
    }
    /// Ground of heights (ny, nx), m, over a grid centred on the origin, solid below: `heights[j, i]` is at the i-th x and the j-th y; spacing (2,): of
    /// points along x and y, m.
    /// Raises LinkworkError for heights or a spacing of another shape, and for what is no pose.
    ///
    /// >>> linkwork.Collider.terrain("hill", [[0, 0, 0], [0, 0.2, 0]], [0.5, 0.5])
    /// Collider(hill on world: terrain of 2 × 3 heights)
    #[staticmethod]
    #[pyo3(signature = (name, heights, spacing, body="world", *, at=None, friction=0.5, restitution=0.0))]
    fn terrain(
        name: &str,
        heights: Given<'_, '_>,
        spacing: Given<'_, '_>,
        body: &str,
        at: Option<Given<'_, '_>>,
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

    /// Balls about points (n, 4), x, y, z, radius (0 or more) of each, m: none when left out. room: for so many there is room in
    /// `Collisions.set_points`, for those given in any case.
    /// Raises LinkworkError for points of another shape, and for what is no pose.
    ///
    /// >>> linkwork.Collider.point_cloud("scan", "world", [[0, 0, 1, 0.01], [0, 1, 1, 0.01]], room=1000)
    /// Collider(scan on world: cloud of 2 points)
    #[staticmethod]
    #[pyo3(signature = (name, body, points=None, *, room=0, at=None, friction=0.5, restitution=0.0))]
    fn point_cloud(
        name: &str,
        body: &str,
        points: Option<Given<'_, '_>>,
        room: usize,
        at: Option<Given<'_, '_>>,
        friction: f64,
        restitution: f64,
    ) -> PyResult<Self> {
        let points = points.map_or(Ok(Vec::new()), balls)?;
        Self::made((name, body), Shape::PointCloud { points, room }, at, (friction, restitution))
    }
    /// Cubes of a grid with edges of this length, m, that begins at the origin and has cells (3,) along +x, +y, +z; occupied (n, 3): indices from 0 of those
    /// that are solid, none when left out. `Collisions.set_cells` changes them.
    /// Raises LinkworkError for indices of another shape, and for what is no pose.
    ///
    /// >>> linkwork.Collider.voxel_map("map", "world", (10, 10, 5), 0.1, occupied=[[0, 0, 0], [1, 0, 0]])
    /// Collider(map on world: voxel map of 10 × 10 × 5 cells)
    #[staticmethod]
    #[pyo3(signature = (name, body, cells, edge, *, occupied=None, at=None, friction=0.5, restitution=0.0))]
    fn voxel_map(
        name: &str,
        body: &str,
        cells: [usize; 3],
        edge: f64,
        occupied: Option<Given<'_, '_>>,
        at: Option<Given<'_, '_>>,
        friction: f64,
        restitution: f64,
    ) -> PyResult<Self> {
        let occupied = crate::collisions::occupied(occupied)?;
        let shape = Shape::VoxelMap { cells, edge, occupied };
        Self::made((name, body), shape, at, (friction, restitution))
    }

    /// Its name.
    ///
    /// >>> linkwork.Collider.half_space("ground").name
    /// 'ground'
    #[getter]
    fn name(&self) -> &str {
        &self.spec.name
    }
    /// The body that carries it, or "world".
    ///
    /// >>> linkwork.Collider.half_space("ground").body
    /// 'world'
    #[getter]
    fn body(&self) -> &str {
        &self.spec.body
    }
    /// Coulomb's coefficient.
    ///
    /// >>> linkwork.Collider.half_space("ground", friction=0.8).friction
    /// 0.8
    #[getter]
    fn friction(&self) -> f64 {
        self.spec.material.friction
    }
    /// Coefficient of restitution.
    ///
    /// >>> linkwork.Collider.half_space("ground", restitution=0.3).restitution
    /// 0.3
    #[getter]
    fn restitution(&self) -> f64 {
        self.spec.material.restitution
    }
    /// What it is made of, for `pairs` of `Contact`; None: nothing that has a name.
    ///
    /// >>> linkwork.Collider.half_space("ground").material(name="ice").material_name
    /// 'ice'
    #[getter]
    fn material_name(&self) -> Option<&str> {
        self.spec.material_name.as_deref()
    }
    /// The same with a simpler shape, of another collider, for questions about coarse shapes (`Collisions.set_detail`): of that the shape alone counts, which has to be in the same frame,
    /// `body` and `at`.
    /// Raises LinkworkError for another frame.
    ///
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
    /// Whether it has a coarse shape beside its fine one.
    ///
    /// >>> linkwork.Collider.half_space("ground").has_coarse
    /// False
    #[getter]
    fn has_coarse(&self) -> bool {
        self.spec.coarse.is_some()
    }
    /// The same shape with another friction and restitution, and what it is made of; what is left out stays.
    /// What cannot be is refused by `Contact`.
    ///
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

/// Points (n, 3).
fn places(given: Given<'_, '_>, what: &str) -> PyResult<Vec<Vec3>> {
    let input = Input::read(given, what)?;
    match *input.shape() {
        [_, 3] => Ok(input.slice().chunks_exact(3).map(Vec3::from_column_slice).collect()),
        ref shape => Err(refuse_with(
            format!("`{what}` has the shape {shape:?}"),
            "give it the shape (n, 3)",
        )),
    }
}
