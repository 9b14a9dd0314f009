//! User data of a collider: shape, pose, material, groups.

use linkwork_multibody::spatial::{Pose, Vec3};
use std::sync::Arc;

/// A shape in its own frame C.
#[derive(Clone, Debug, PartialEq)]
pub enum Shape {
    /// A sphere about the origin.
    Sphere {
        /// Radius, m.
        radius: f64,
    },
    /// A box about the origin, edges along the axes.
    Box {
        /// Half of each edge, m.
        half: Vec3,
    },
    /// A capsule: all points within `radius` of a segment on the z axis.
    Capsule {
        /// Radius, m.
        radius: f64,
        /// Half length of the segment, without the caps, m.
        half_length: f64,
    },
    /// An ellipsoid about the origin, its axes along x, y, z.
    Ellipsoid {
        /// Half of each axis, m.
        half: Vec3,
    },
    /// A cylinder about the z axis with flat ends.
    Cylinder {
        /// Radius, m.
        radius: f64,
        /// Half of its length, m.
        half_length: f64,
    },
    /// All points with z ≤ 0.
    HalfSpace,
    /// The convex hull of points that are not all in one plane.
    ConvexHull {
        /// Points, m; those inside the hull are ignored.
        points: Vec<Vec3>,
    },
    /// A triangle mesh, counter-clockwise seen from outside. Only its outside collides: a body that has passed through it completely is not detected.
    /// Two meshes, or a mesh and a height field, collide triangle by triangle. This is exact near the surface; for deep penetration the direction of
    /// separation is valid but not the shortest. A convex hull is faster and more robust where it fits.
    Mesh {
        /// Corners, m. Corners at exactly the same position are merged.
        vertices: Vec<Vec3>,
        /// Indices of corners.
        triangles: Vec<[u32; 3]>,
    },
    /// Terrain: heights over a grid that is centred on the origin, solid below without limit. Each cell is cut from its corner of low x and y to that
    /// of high x and y.
    HeightField {
        /// Points along x, at least 2.
        x: usize,
        /// Points along y, at least 2.
        y: usize,
        /// Spacing of points along x and y, m.
        spacing: [f64; 2],
        /// Heights (z), m: `x` numbers for the row of lowest y, then the next row. NaN where there is no ground; triangles with such a corner are
        /// holes.
        heights: Arc<[f64]>,
    },
    /// Spheres around points, from sensor data. [`Probe::set_points`](crate::Probe::set_points) replaces them at run time.
    PointCloud {
        /// x, y, z, radius of each, m; the radius may be 0.
        points: Vec<[f64; 4]>,
        /// Capacity at run time; at least the number of given points.
        room: usize,
    },
    /// The occupied cells of a grid of cubes that begins at the origin and extends along +x, +y, +z. [`Probe::set_cells`](crate::Probe::set_cells)
    /// changes them at run time.
    VoxelMap {
        /// Cells along x, y, z.
        cells: [usize; 3],
        /// Edge of a cell, m.
        edge: f64,
        /// Indices along x, y, z of the occupied cells.
        occupied: Vec<[u32; 3]>,
    },
}

/// State of a cell of a [`Shape::VoxelMap`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Occupancy {
    /// The cell is empty.
    #[default]
    Free,
    /// The cell is a solid cube.
    Occupied,
}

/// A visual shape: a collision geometry, or a mesh file that only a viewer reads.
#[derive(Clone, Debug, PartialEq)]
pub enum VisualShape {
    /// A geometry.
    Shape(Shape),
    /// A mesh file.
    File {
        /// Its path, resolved.
        file: String,
        /// Scale factors to m along x, y, z.
        scale: Vec3,
    },
}

/// Friction and restitution of a surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Material {
    /// Coulomb friction coefficient; a pair uses the geometric mean.
    pub friction: f64,
    /// Restitution coefficient; a pair uses the larger one.
    pub restitution: f64,
}

impl Default for Material {
    fn default() -> Self {
        Self { friction: 0.5, restitution: 0.0 }
    }
}

/// Rolling and spinning friction of a surface. A pair uses the larger of the two values.
///
/// ```text
/// |m_t| ≤ rolling · N      tangential moment, against the relative rotation (N m)
/// |m_n| ≤ spinning · N     moment about the normal, against the relative rotation
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Resistance {
    /// Coefficient of rolling friction, m: the offset of the normal force ahead of the contact point.
    pub rolling: f64,
    /// Coefficient of spinning friction, m; 2/3 μ r for a flat circular patch of radius r with uniform pressure.
    pub spinning: f64,
}

/// Contact parameters for a pair of materials, which override those of the surfaces.
#[derive(Clone, Debug, PartialEq)]
pub struct PairLaw {
    /// Names of the two materials ([`ColliderSpec::material_name`]); they may be equal.
    pub materials: [String; 2],
    /// Friction coefficient of the pair; `None`: the geometric mean of the surfaces.
    pub friction: Option<f64>,
    /// Restitution coefficient of the pair; `None`: the larger value of the surfaces.
    pub restitution: Option<f64>,
    /// Rolling friction coefficient of the pair, m; `None`: the larger value of the surfaces.
    pub rolling: Option<f64>,
    /// Spinning friction coefficient of the pair, m; `None`: the larger value of the surfaces.
    pub spinning: Option<f64>,
}

/// A material that varies with position: a function of the point in the shape's frame C (m).
#[derive(Clone)]
pub struct Varies(pub Arc<dyn Fn(&Vec3) -> Material + Send + Sync>);

impl std::fmt::Debug for Varies {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str("Varies")
    }
}

impl PartialEq for Varies {
    fn eq(&self, other: &Self) -> bool {
        Arc::ptr_eq(&self.0, &other.0)
    }
}

/// Visibility of a collider at the beginning of a run.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Visibility {
    /// The collider is checked.
    #[default]
    Shown,
    /// The collider is not checked until it is shown: [`Hiding`](crate::Hiding).
    Hidden,
}

/// Whether a collider is checked against the terrain that a runtime adds ([`TERRAIN`](crate::TERRAIN)).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum OnTerrain {
    /// It is checked, like all other colliders of the world.
    #[default]
    Collide,
    /// It is not checked, because another model computes its contact with the ground, such as a wheel–soil model.
    Pass,
}

/// The geometry of a collider that a query uses.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Detail {
    /// The fine shape.
    #[default]
    Fine,
    /// The coarse shape where there is one, otherwise the fine one.
    Coarse,
}

/// Specification of one collider. [`Colliders::new`](crate::Colliders::new) checks its public fields.
#[derive(Clone, Debug, PartialEq)]
pub struct ColliderSpec {
    /// Its unique name.
    pub name: String,
    /// The body that carries it, or `world`.
    pub body: String,
    /// `X_BC`, the pose of the shape's frame in the body.
    pub pose: Pose,
    /// The shape.
    pub fine: Shape,
    /// A simpler shape in the same frame, for queries with coarse shapes.
    pub coarse: Option<Shape>,
    /// Groups to which it belongs, one bit each.
    pub groups: u128,
    /// Groups with which it collides. A pair is checked if each is in a group with which the other collides.
    pub collides_with: u128,
    /// Whether it is checked against the terrain.
    pub terrain: OnTerrain,
    /// Padding: the shape counts as this much thicker all around, m. Rays ignore it.
    pub padding: f64,
    /// If above 0, a cylinder's fine shape has the contact of this number of thin discs across its length, with one point each; the first and last
    /// are at its ends. Forces on rolling bodies are then continuous over faces, edges and corners. There is no contact between two discs.
    pub discs: u32,
    /// Visibility at the beginning of a run.
    pub hidden: Visibility,
    /// Friction and restitution.
    pub material: Material,
    /// Rolling and spinning friction; zero by default.
    pub resistance: Resistance,
    /// Surface velocity relative to the body, m/s, axes of the body, for example of a belt or a track. Only its tangential part acts, at each contact
    /// point.
    pub surface_velocity: Vec3,
    /// Name of its material, for [`Rules::laws`].
    pub material_name: Option<String>,
    /// Friction and restitution that vary with position; takes precedence over `material`.
    pub varies: Option<Varies>,
}

impl ColliderSpec {
    /// Creates a collider at a body's origin, in group 0, that collides with all groups.
    #[must_use]
    pub fn new(name: impl Into<String>, body: impl Into<String>, fine: Shape) -> Self {
        Self {
            name: name.into(),
            body: body.into(),
            pose: Pose::identity(),
            fine,
            coarse: None,
            groups: 1,
            collides_with: u128::MAX,
            terrain: OnTerrain::Collide,
            padding: 0.0,
            discs: 0,
            hidden: Visibility::Shown,
            material: Material::default(),
            resistance: Resistance::default(),
            surface_velocity: Vec3::zeros(),
            material_name: None,
            varies: None,
        }
    }

    /// Sets its pose `X_BC`.
    #[must_use]
    pub fn at(mut self, X_BC: Pose) -> Self {
        self.pose = X_BC;
        self
    }
}

/// Rule for colliders of bodies that a hinge or a loop joins.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Neighbours {
    /// They are not checked against each other, except pairs in [`Rules::collide`].
    #[default]
    Pass,
    /// They are checked against each other.
    Collide,
}

/// Collision rules. Names are those of colliders or of bodies (including `world`). A body's name represents all of its colliders; a collider's name
/// takes precedence over a body's.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Rules {
    /// Rule for bodies joined by a loop, or by a hinge with fewer than six degrees of freedom.
    pub neighbours: Neighbours,
    /// Bodies that count as welded to their parents although their hinge has a coordinate, because it never moves.
    pub welded: Vec<String>,
    /// Pairs of bodies that a loop joins; they are neighbours as if joined by a hinge.
    pub joined: Vec<[String; 2]>,
    /// Pairs that are not checked.
    pub ignore: Vec<[String; 2]>,
    /// Lists of bodies: no body of a list is checked against another of the same list.
    pub apart: Vec<Vec<String>>,
    /// Pairs that are checked although they are neighbours or in the same list of `apart`; `ignore` takes precedence.
    pub collide: Vec<[String; 2]>,
    /// Contact parameters for pairs of materials; the first matching entry applies.
    pub laws: Vec<PairLaw>,
}
