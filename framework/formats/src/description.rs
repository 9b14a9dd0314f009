//! What every reader gives: a mechanism's parts, and what the file says beside them.
//!
//! ```text
//! coupling       Σ cᵢ qᵢ = c₀                      mimic: q_a − ratio q_b = offset
//! loop closure   X_AB(q) = motion that the hinge permits
//! ```

use linkwork_multibody::{Builder, Coupling, HingeCoordinate, LoopClosure};
use linkwork_spatial::{Pose, Vec3};
use serde::{Deserialize, Serialize};
use std::path::PathBuf;

/// A mechanism as a file describes it.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Description {
    /// The file's name for the mechanism.
    pub name: String,
    /// Bodies and nodes.
    pub builder: Builder,
    /// Shapes to show, to collide and to touch the ground with.
    pub shapes: Vec<BodyShape>,
    /// The file's joints and the bodies that they became.
    pub joints: Vec<Joint>,
    /// Relations between coordinates.
    pub couplings: Vec<Coupling>,
    /// Hinges that close loops of the tree.
    pub loops: Vec<LoopClosure>,
    /// Bodies that roll on the ground.
    pub wheels: Vec<Wheel>,
    /// The configuration that the file shows, where it is not the neutral one.
    pub initial: Vec<Initial>,
    /// Everything in the file that was not used.
    pub ignored: Vec<Ignored>,
    /// Mass properties that no body has and that were read all the same ([`Unphysical::Read`](crate::Unphysical::Read)).
    pub doubtful: Vec<Ignored>,
}

/// A shape on a body.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct BodyShape {
    /// Name of the body, or `world`.
    pub body: String,
    /// Name of the shape; empty when the file gives none.
    pub name: String,
    /// What it is for.
    pub role: ShapeRole,
    /// `X_BS`: the shape's frame in the body.
    pub pose: Pose,
    /// What it is.
    pub geometry: Geometry,
    /// Red, green, blue, opacity in 0 … 1.
    pub color: Option<[f64; 4]>,
}

/// What a shape is for.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum ShapeRole {
    /// To be seen.
    Visual,
    /// To collide, as the file says.
    Collision,
    /// To touch the ground, as a side-car says.
    Contact,
}

/// A solid, a plane or a mesh; lengths in m.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum Geometry {
    /// Centred; whole lengths along x, y, z.
    Box {
        /// Whole lengths.
        size: [f64; 3],
    },
    /// Centred.
    Sphere {
        /// Radius.
        radius: f64,
    },
    /// Along z, centred.
    Cylinder {
        /// Radius.
        radius: f64,
        /// Whole length.
        length: f64,
    },
    /// A cylinder along z with half spheres on its ends, centred.
    Capsule {
        /// Radius.
        radius: f64,
        /// Length of the cylinder without the ends.
        length: f64,
    },
    /// Centred.
    Ellipsoid {
        /// Half axes along x, y, z.
        radii: [f64; 3],
    },
    /// z = 0, with the normal z.
    Plane {
        /// Whole lengths along x and y; 0 is without end.
        size: [f64; 2],
    },
    /// A mesh file.
    Mesh {
        /// As the file writes it.
        file: String,
        /// Where it was found.
        path: Option<PathBuf>,
        /// Factors to m along x, y, z.
        scale: [f64; 3],
    },
}

/// A joint of the file, as the file says it. What acts is in the hinge of its body: damping of all
/// coordinates, friction of joints with one; springs do not act.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Joint {
    /// Its name in the file.
    pub name: String,
    /// The body that it moves.
    pub body: String,
    /// Its first subhinge in that body's hinge.
    pub subhinge: usize,
    /// How many subhinges it has; 0 for a fixed joint.
    pub count: usize,
    /// Viscous damping, N m s/rad or N s/m.
    pub damping: f64,
    /// Dry friction, N m or N.
    pub friction: f64,
    /// Spring stiffness, N m/rad or N/m.
    pub stiffness: f64,
    /// Coordinate at which the spring is at rest, rad or m.
    pub spring_reference: f64,
}

impl Joint {
    /// A joint without damping, friction or spring.
    #[must_use]
    pub fn new(name: impl Into<String>, body: impl Into<String>, count: usize) -> Self {
        Self {
            name: name.into(),
            body: body.into(),
            subhinge: 0,
            count,
            damping: 0.0,
            friction: 0.0,
            stiffness: 0.0,
            spring_reference: 0.0,
        }
    }
}

/// What a wheel does.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum WheelRole {
    /// A motor turns it.
    #[default]
    Driven,
    /// It is carried along.
    Idle,
}

/// A body that rolls on the ground.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Wheel {
    /// The body.
    pub body: String,
    /// Direction of the axle in the body.
    pub axis: Vec3,
    /// Rolling radius, m.
    pub radius: f64,
    /// Width, m.
    pub width: f64,
    /// Driven or idle.
    pub role: WheelRole,
    /// The joint that steers it.
    pub steering: Option<String>,
}

/// Where a hinge stands in the file's picture.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Initial {
    /// The body.
    pub body: String,
    /// Its hinge's numbers of q.
    pub q: Vec<f64>,
}

/// Something in the file that was not used, or not as it stands there.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
pub struct Ignored {
    /// The file.
    pub file: String,
    /// Line, from 1.
    pub line: u32,
    /// Elements from the outside in, by name where they have one: `robot/link[arm]/visual`.
    pub path: String,
    /// What it is, and why it was not used when that is not plain.
    pub what: String,
}

impl std::fmt::Display for Ignored {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{}:{}: {}: {}", self.file, self.line, self.path, self.what)
    }
}

impl Description {
    /// The joint of this name.
    #[must_use]
    pub fn joint(&self, name: &str) -> Option<&Joint> {
        self.joints.iter().find(|j| j.name == name)
    }

    /// The coordinate of a joint that has exactly one.
    #[must_use]
    pub fn coordinate(&self, joint: &str) -> Option<HingeCoordinate> {
        let j = self.joint(joint).filter(|j| j.count == 1)?;
        Some(HingeCoordinate { body: j.body.clone(), subhinge: j.subhinge })
    }
}
