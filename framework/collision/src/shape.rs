//! What a user says about a collider: shape, place, material, groups.

use linkwork_multibody::spatial::{Pose, Vec3};
use std::sync::Arc;

/// A shape in its own frame C.
#[derive(Clone, Debug, PartialEq)]
pub enum Shape {
    /// A ball about the origin.
    Sphere {
        /// Radius, m.
        radius: f64,
    },
    /// A box about the origin, edges along the axes.
    Box {
        /// Half of each edge, m.
        half: Vec3,
    },
    /// All points within `radius` of a segment on the z axis.
    Capsule {
        /// Radius, m.
        radius: f64,
        /// Half of the segment, without the caps, m.
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
    /// A surface of triangles, counter-clockwise seen from outside. Only the outside pushes: what
    /// passes through entirely is no longer seen. Two meshes, or a mesh and a height field, meet triangle by triangle: near the
    /// surface that is exact, deep in each other it is a way out and not the shortest. A hull is faster and better where it fits.
    Mesh {
        /// Corners, m. Corners at exactly one place are one corner.
        vertices: Vec<Vec3>,
        /// Indices of corners.
        triangles: Vec<[u32; 3]>,
    },
    /// Terrain: heights over a grid that is centred on the origin, solid below without end. Each
    /// cell is cut from its corner of low x and y to that of high x and y.
    HeightField {
        /// Points along x, at least 2.
        x: usize,
        /// Points along y, at least 2.
        y: usize,
        /// Distance of neighbouring points along x and y, m.
        spacing: [f64; 2],
        /// Heights (z), `x` numbers for the row of lowest y, then the next row, m; NaN where there is no ground: the
        /// triangles that such a point is a corner of are holes.
        heights: Arc<[f64]>,
    },
    /// Balls about points, as a sensor saw them. [`Probe::set_points`](crate::Probe::set_points) replaces them at run time.
    PointCloud {
        /// x, y, z, radius of each, m; the radius may be 0.
        points: Vec<[f64; 4]>,
        /// For so many there is room at run time; for those given in any case.
        room: usize,
    },
    /// The occupied cells of a grid of cubes that begins at the origin and goes along +x, +y, +z.
    /// [`Probe::set_cells`](crate::Probe::set_cells) changes them at run time.
    VoxelMap {
        /// Cells along x, y, z.
        cells: [usize; 3],
        /// Edge of a cell, m.
        edge: f64,
        /// Indices along x, y, z of those that are occupied.
        occupied: Vec<[u32; 3]>,
    },
}

/// What a cell of a [`Shape::VoxelMap`] is.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Occupancy {
    /// It meets nothing.
    #[default]
    Free,
    /// It is a solid cube.
    Occupied,
}

/// A shape as it is shown: with the geometry of what collides, or as a mesh file that only a viewer reads.
#[derive(Clone, Debug, PartialEq)]
pub enum Seen {
    /// A geometry.
    Shape(Shape),
    /// A mesh file.
    File {
        /// Its path, as found.
        file: String,
        /// Factors to m along x, y, z.
        scale: Vec3,
    },
}

/// How a surface rubs and bounces.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Material {
    /// Coefficient of Coulomb friction; that of a pair is the geometric mean.
    pub friction: f64,
    /// Coefficient of restitution; that of a pair is the larger.
    pub restitution: f64,
}

impl Default for Material {
    fn default() -> Self {
        Self { friction: 0.5, restitution: 0.0 }
    }
}

/// Resistance of a surface to rolling and to spinning on the spot. That of a pair is the larger of the two.
///
/// ```text
/// |m_t| ≤ rolling · N      moment across the normal, against the relative rotation (N m)
/// |m_n| ≤ spinning · N     moment about the normal
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Resistance {
    /// Coefficient of rolling friction, m: the offset of the normal force ahead of the contact point.
    pub rolling: f64,
    /// Coefficient of spinning friction, m; 2/3 μ r of a flat circular patch of radius r that presses evenly.
    pub spinning: f64,
}

/// What two materials do to each other, where that is not what the numbers of their surfaces say.
#[derive(Clone, Debug, PartialEq)]
pub struct PairLaw {
    /// Names of the materials ([`ColliderSpec::material_name`]); they may be one.
    pub materials: [String; 2],
    /// Coefficient of friction between them; `None`: the geometric mean of the surfaces'.
    pub friction: Option<f64>,
    /// Coefficient of restitution between them; `None`: the larger of the surfaces'.
    pub restitution: Option<f64>,
    /// Coefficient of rolling friction between them, m; `None`: the larger of the surfaces'.
    pub rolling: Option<f64>,
    /// Coefficient of spinning friction between them, m; `None`: the larger of the surfaces'.
    pub spinning: Option<f64>,
}

/// A material that differs from place to place: a function of the point in the shape's frame C (m).
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

/// Whether a collider takes part when a run begins.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Visibility {
    /// It takes part.
    #[default]
    Shown,
    /// It does not, until it is shown: [`Hiding`](crate::Hiding).
    Hidden,
}

/// Whether a collider meets the terrain that a runtime adds ([`TERRAIN`](crate::TERRAIN)).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum OnTerrain {
    /// It does, as any other collider of the world.
    #[default]
    Collide,
    /// It does not: something else carries it there, as a model of wheel and ground does.
    Pass,
}

/// Which of the two geometries of a collider a query uses.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Detail {
    /// The fine shape.
    #[default]
    Fine,
    /// The coarse shape where there is one, else the fine one.
    Coarse,
}

/// One collider. The public fields are checked by [`Colliders::new`](crate::Colliders::new).
#[derive(Clone, Debug, PartialEq)]
pub struct ColliderSpec {
    /// A name of its own.
    pub name: String,
    /// The body that carries it, or `world`.
    pub body: String,
    /// `X_BC`: the shape's frame in the body.
    pub pose: Pose,
    /// The shape.
    pub fine: Shape,
    /// A simpler shape in the same frame, for queries that ask for it.
    pub coarse: Option<Shape>,
    /// Groups that it is a member of, one bit each.
    pub groups: u128,
    /// Groups that it meets. A pair meets when each is in a group that the other meets.
    pub collides_with: u128,
    /// Whether it meets the terrain.
    pub terrain: OnTerrain,
    /// The shape is taken to be this much thicker all around, m. Rays see it without.
    pub padding: f64,
    /// Above 0: a cylinder's fine shape touches as so many thin discs across its length, one point of each, the first and the last at
    /// its ends. Forces on what rolls are then continuous over faces, edges and corners; between two discs nothing touches.
    pub discs: u32,
    /// Whether it takes part when a run begins.
    pub hidden: Visibility,
    /// How it rubs and bounces.
    pub material: Material,
    /// How it resists rolling and spinning; nothing by default.
    pub resistance: Resistance,
    /// Velocity of the surface relative to the body, m/s, axes of the body: a belt or a track. Only its part along the surface
    /// acts, at each contact point.
    pub surface_velocity: Vec3,
    /// What its material is called, for [`Rules::laws`].
    pub material_name: Option<String>,
    /// How it rubs and bounces where that differs from place to place; goes before `material`.
    pub varies: Option<Varies>,
}

impl ColliderSpec {
    /// A shape at a body's origin, in group 0, meeting all.
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

    /// At another place: `X_BC`.
    #[must_use]
    pub fn at(mut self, X_BC: Pose) -> Self {
        self.pose = X_BC;
        self
    }
}

/// What happens between colliders of bodies that a hinge or a loop joins.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Neighbours {
    /// They do not meet, except where [`Rules::collide`] lists them.
    #[default]
    Pass,
    /// They meet.
    Collide,
}

/// Which pairs meet. Names are those of colliders or of bodies (`world` included); a body's name
/// stands for all its colliders, and a collider's name goes before a body's.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Rules {
    /// Bodies joined by a hinge of fewer than six degrees of freedom, or by a loop.
    pub neighbours: Neighbours,
    /// Bodies that count as welded to their parents although their hinge has a coordinate that never moves.
    pub welded: Vec<String>,
    /// Pairs of bodies that a loop joins: neighbours as if by a hinge.
    pub joined: Vec<[String; 2]>,
    /// Pairs that do not meet.
    pub ignore: Vec<[String; 2]>,
    /// Lists of bodies: no body of a list meets another of the same list.
    pub apart: Vec<Vec<String>>,
    /// Pairs that meet though they are neighbours or in one list of `apart`; `ignore` goes before.
    pub collide: Vec<[String; 2]>,
    /// What pairs of materials do to each other; the first that fits counts.
    pub laws: Vec<PairLaw>,
}
