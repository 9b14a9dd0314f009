//! What can be wrong with colliders: place, fact, remedy, all at once.

use thiserror::Error;

/// What is wrong with a shape. It is printed behind the name of its collider.
#[derive(Clone, Copy, Debug, PartialEq, Error)]
pub enum ShapeFault {
    /// A size that is zero, negative, infinite or NaN.
    #[error("{what} is {value}\n  help: it must be finite and greater than 0")]
    Size {
        /// Which size.
        what: &'static str,
        /// Its value.
        value: f64,
    },
    /// A point with a NaN or an infinity.
    #[error("{what} {index} has a NaN or an infinity\n  help: give finite numbers")]
    NotFinite {
        /// Vertex, point or height.
        what: &'static str,
        /// Which.
        index: usize,
    },
    /// A hull without volume.
    #[error(
        "the {count} points of the hull lie in one plane, on a line, or in a point\n  help: give at least four that \
         span a volume, or a mesh"
    )]
    Flat {
        /// How many points there are.
        count: usize,
    },
    /// A mesh without triangles.
    #[error("the mesh has no triangles\n  help: give at least one")]
    Empty,
    /// A triangle that names a corner that does not exist.
    #[error("triangle {triangle} names vertex {index} of {count}\n  help: indices count from 0")]
    Index {
        /// Which triangle.
        triangle: usize,
        /// The index.
        index: u32,
        /// How many vertices there are.
        count: usize,
    },
    /// A triangle without area.
    #[error(
        "triangle {triangle} has no area\n  help: remove it, or give three corners that are not on one line"
    )]
    NoArea {
        /// Which triangle.
        triangle: usize,
    },
    /// A height field whose sizes do not fit.
    #[error(
        "the height field has {x} by {y} points and {heights} heights\n  help: it needs at least 2 by 2 points, a height \
         for each, and fewer than 2^31 of them"
    )]
    Grid {
        /// Points along x.
        x: usize,
        /// Points along y.
        y: usize,
        /// Heights given.
        heights: usize,
    },
    /// A point of a cloud with a negative radius.
    #[error("point {index} has a radius of {radius}\n  help: give 0 or more, in m")]
    Radius {
        /// Which point.
        index: usize,
        /// Its radius, m.
        radius: f64,
    },
    /// More points than there is room for.
    #[error(
        "the cloud has {count} points, there is room for {most}\n  help: give fewer, or more `room` when the model is made"
    )]
    Points {
        /// How many there are, or would have room.
        count: usize,
        /// How many there may be.
        most: usize,
    },
    /// A voxel map of no cells, or of too many.
    #[error(
        "the voxel map has {cells:?} cells along x, y, z\n  help: give at least one along each, and at most {most} in all"
    )]
    Voxels {
        /// Along x, y, z.
        cells: [usize; 3],
        /// How many there may be in all.
        most: usize,
    },
    /// A cell that the voxel map has not.
    #[error(
        "cell {index} of the list is {cell:?}, the voxel map has {cells:?} along x, y, z\n  help: indices count from 0"
    )]
    Outside {
        /// Place in the list.
        index: usize,
        /// Its indices along x, y, z.
        cell: [u32; 3],
        /// Cells along x, y, z.
        cells: [usize; 3],
    },
    /// Points for what is no point cloud, cells for what is no voxel map.
    #[error("this collider is no {wanted}\n  help: give it that shape when the model is made")]
    Kind {
        /// What it would have to be.
        wanted: &'static str,
    },
}

/// One fault.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum ColliderFault {
    /// A shape that cannot be.
    #[error("collider `{collider}`, {which} shape: {fault}")]
    Shape {
        /// The collider.
        collider: String,
        /// "fine" or "coarse".
        which: &'static str,
        /// What is wrong.
        fault: ShapeFault,
    },
    /// A collider on a body that does not exist.
    #[error("collider `{collider}`: no body `{body}`{}", suggest(suggestion))]
    UnknownBody {
        /// The collider.
        collider: String,
        /// The body it names.
        body: String,
        /// The nearest existing name.
        suggestion: Option<String>,
    },
    /// Several colliders of one name.
    #[error("collider `{name}` is defined {count} times\n  help: give each its own name")]
    Duplicate {
        /// The name.
        name: String,
        /// How often it occurs.
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
    /// Discs of what is no cylinder.
    #[error(
        "collider `{collider}`: discs are those of a cylinder\n  help: take a cylinder, or leave `discs` out"
    )]
    Discs {
        /// The collider.
        collider: String,
    },
    /// A pose with a NaN, an infinity, or a rotation that is not of unit length.
    #[error(
        "collider `{collider}`: its pose is not a pose\n  help: give finite numbers and a unit quaternion"
    )]
    Pose {
        /// The collider.
        collider: String,
    },
    /// A law about a material that no collider has.
    #[error(
        "law of pairs {index}: no collider is of the material `{name}`{}",
        material(suggestion)
    )]
    UnknownMaterial {
        /// Which law.
        index: usize,
        /// The name.
        name: String,
        /// The nearest existing name.
        suggestion: Option<String>,
    },
    /// A number of a law out of its range.
    #[error("law of pairs {index}: {what} is {value}\n  help: it must be finite and ≥ 0")]
    LawNumber {
        /// Which law.
        index: usize,
        /// Friction or restitution.
        what: &'static str,
        /// Its value.
        value: f64,
    },
    /// A rule about something that does not exist.
    #[error("rule {list} {index}: no collider or body `{name}`{}", suggest(suggestion))]
    UnknownName {
        /// Which list of the rules.
        list: &'static str,
        /// Which entry.
        index: usize,
        /// The name.
        name: String,
        /// The nearest existing name.
        suggestion: Option<String>,
    },
}

fn material(name: &Option<String>) -> String {
    name.as_ref().map_or_else(
        || "\n  help: write `material` of the colliders that it is about".to_string(),
        |n| format!("\n  help: did you mean `{n}`?"),
    )
}

fn suggest(name: &Option<String>) -> String {
    name.as_ref().map_or_else(
        || "\n  help: give the name of one that exists, or `world`".to_string(),
        |n| format!("\n  help: did you mean `{n}`?"),
    )
}

/// Everything that is wrong with a set of colliders.
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
