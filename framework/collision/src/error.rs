//! Faults of colliders, with place, fact and remedy, all at once.

use thiserror::Error;

/// A fault of a shape. It is printed after the name of its collider.
#[derive(Clone, Copy, Debug, PartialEq, Error)]
pub enum ShapeFault {
    /// A dimension that is zero, negative, infinite or NaN.
    #[error("{what} is {value}\n  help: it must be finite and greater than 0")]
    Size {
        /// Name of the dimension.
        what: &'static str,
        /// Its value.
        value: f64,
    },
    /// A point with NaN or infinity.
    #[error("{what} {index} contains NaN or infinity\n  help: give finite numbers")]
    NotFinite {
        /// Vertex, point or height.
        what: &'static str,
        /// Its index.
        index: usize,
    },
    /// A hull without volume.
    #[error(
        "the {count} points of the hull lie in one plane, on a line, or in a point\n  help: give at least four that \
         span a volume, or a mesh"
    )]
    Flat {
        /// Number of points.
        count: usize,
    },
    /// A mesh without triangles.
    #[error("the mesh has no triangles\n  help: give at least one")]
    Empty,
    /// A triangle that refers to a vertex that does not exist.
    #[error(
        "triangle {triangle} refers to vertex {index}, but there are {count} vertices\n  help: indices count from 0"
    )]
    Index {
        /// Index of the triangle.
        triangle: usize,
        /// Index of the vertex.
        index: u32,
        /// Number of vertices.
        count: usize,
    },
    /// A triangle without area.
    #[error(
        "triangle {triangle} has no area\n  help: remove it, or give three corners that are not on one line"
    )]
    NoArea {
        /// Index of the triangle.
        triangle: usize,
    },
    /// A height field whose dimensions do not match its data.
    #[error(
        "the height field has {x} by {y} points and {heights} heights\n  help: it needs at least 2 by 2 points, a height \
         for each, and fewer than 2^31 of them"
    )]
    Grid {
        /// Points along x.
        x: usize,
        /// Points along y.
        y: usize,
        /// Number of heights.
        heights: usize,
    },
    /// A point of a cloud with a negative radius.
    #[error("point {index} has a radius of {radius}\n  help: give 0 or more, in m")]
    Radius {
        /// Index of the point.
        index: usize,
        /// Its radius, m.
        radius: f64,
    },
    /// More points than the model reserves.
    #[error(
        "the cloud has {count} points, but the model reserves {most}\n  help: use fewer points, or increase `room` in the model"
    )]
    Points {
        /// Number of points, or requested room.
        count: usize,
        /// Maximum number.
        most: usize,
    },
    /// A voxel map without cells, or with too many.
    #[error(
        "the voxel map has {cells:?} cells along x, y, z\n  help: give at least one along each, and at most {most} in all"
    )]
    Voxels {
        /// Along x, y, z.
        cells: [usize; 3],
        /// Maximum total number.
        most: usize,
    },
    /// A cell outside the voxel map.
    #[error(
        "cell {index} of the list is {cell:?}, but the voxel map has {cells:?} cells along x, y, z\n  help: indices count from 0"
    )]
    Outside {
        /// Index in the list.
        index: usize,
        /// Its indices along x, y, z.
        cell: [u32; 3],
        /// Cells along x, y, z.
        cells: [usize; 3],
    },
    /// Points for a collider that is not a point cloud, or cells for a collider that is not a voxel map.
    #[error("this collider is not a {wanted}\n  help: give it that shape in the model")]
    Kind {
        /// Required kind of shape.
        wanted: &'static str,
    },
}

/// One fault.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum ColliderFault {
    /// A shape that is not valid.
    #[error("collider `{collider}`, {which} shape: {fault}")]
    Shape {
        /// The collider.
        collider: String,
        /// "fine" or "coarse".
        which: &'static str,
        /// The fault.
        fault: ShapeFault,
    },
    /// A collider on a body that does not exist.
    #[error("collider `{collider}`: no body `{body}`{}", suggest(suggestion))]
    UnknownBody {
        /// The collider.
        collider: String,
        /// Name of the body.
        body: String,
        /// The most similar existing name.
        suggestion: Option<String>,
    },
    /// Several colliders with the same name.
    #[error("collider `{name}` is defined {count} times\n  help: rename the others")]
    Duplicate {
        /// The name.
        name: String,
        /// Number of occurrences.
        count: usize,
    },
    /// A number out of its range.
    #[error("collider `{collider}`: {what} is {value}\n  help: it must be finite and ≥ 0")]
    Number {
        /// The collider.
        collider: String,
        /// Padding, friction or restitution.
        what: &'static str,
        /// Its value.
        value: f64,
    },
    /// Discs for a shape that is not a cylinder.
    #[error(
        "collider `{collider}`: only cylinders can have discs\n  help: use a cylinder, or remove `discs`"
    )]
    Discs {
        /// The collider.
        collider: String,
    },
    /// A pose with NaN or infinity, or a rotation that is not of unit length.
    #[error(
        "collider `{collider}`: the pose is invalid\n  help: give finite numbers and a unit quaternion"
    )]
    Pose {
        /// The collider.
        collider: String,
    },
    /// A pair law for a material that no collider has.
    #[error("pair law {index}: no collider has the material `{name}`{}", material(suggestion))]
    UnknownMaterial {
        /// Index of the law.
        index: usize,
        /// The name.
        name: String,
        /// The most similar existing name.
        suggestion: Option<String>,
    },
    /// A number of a law out of its range.
    #[error("pair law {index}: {what} is {value}\n  help: it must be finite and ≥ 0")]
    LawNumber {
        /// Index of the law.
        index: usize,
        /// Friction or restitution.
        what: &'static str,
        /// Its value.
        value: f64,
    },
    /// A rule that refers to a name that does not exist.
    #[error("rule {list} {index}: no collider or body `{name}`{}", suggest(suggestion))]
    UnknownName {
        /// Name of the rule list.
        list: &'static str,
        /// Index of the entry.
        index: usize,
        /// The name.
        name: String,
        /// The most similar existing name.
        suggestion: Option<String>,
    },
}

fn material(name: &Option<String>) -> String {
    name.as_ref().map_or_else(
        || "\n  help: set `material` of the colliders for which the law is intended".to_string(),
        |n| format!("\n  help: did you mean `{n}`?"),
    )
}

fn suggest(name: &Option<String>) -> String {
    name.as_ref().map_or_else(
        || "\n  help: give an existing name, or `world`".to_string(),
        |n| format!("\n  help: did you mean `{n}`?"),
    )
}

/// All faults of a set of colliders.
#[derive(Clone, Debug, PartialEq)]
pub struct CollisionError {
    /// The faults, in the order of the colliders, then of the rules; at least one.
    pub faults: Vec<ColliderFault>,
}

impl std::fmt::Display for CollisionError {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        for (i, fault) in self.faults.iter().enumerate() {
            write!(f, "{}error: {fault}", if i == 0 { "" } else { "\n" })?;
        }
        Ok(())
    }
}

impl std::error::Error for CollisionError {}
