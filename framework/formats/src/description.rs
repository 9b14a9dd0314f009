//! Result of every reader: the parts of a mechanism, and other contents of the file.
//!
//! ```text
//! coupling       Σ cᵢ qᵢ = c₀                      mimic: q_a − ratio q_b = offset
//! loop closure   X_AB(q) = motion that the hinge permits
//! ```

use crate::device::Device;
use crate::error::FilePlace;
use linkwork_multibody::{Builder, Coupling, HingeCoordinate, LoopClosure, Multibody};
use linkwork_spatial::{Pose, Vec3};
use serde::{Deserialize, Serialize};
use std::collections::{BTreeMap, BTreeSet};
use std::path::PathBuf;

/// A mechanism from a file.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Description {
    /// The file's name for the mechanism.
    pub name: String,
    /// Bodies and nodes.
    pub builder: Builder,
    /// Shapes for display, collision and ground contact.
    pub shapes: Vec<BodyShape>,
    /// Joints of the file and their bodies.
    pub joints: Vec<Joint>,
    /// Relations between coordinates.
    pub couplings: Vec<Coupling>,
    /// Hinges that close loops.
    pub loops: Vec<LoopClosure>,
    /// Treatment of mesh files as collision shapes.
    pub collision_meshes: CollisionMeshes,
    /// Pairs of bodies that do not collide although their shapes would.
    pub exclusions: Vec<[String; 2]>,
    /// Pairs of collision shapes, by their indices in `shapes`, that collide regardless of their filters.
    pub pairs: Vec<[usize; 2]>,
    /// Actuators, tendons, sensors and balancers.
    pub devices: Vec<Device>,
    /// Bodies that roll on the ground.
    pub wheels: Vec<Wheel>,
    /// The initial configuration in the file, where it is not the neutral one.
    pub initial: Vec<Initial>,
    /// All unused contents of the file.
    pub ignored: Vec<Ignored>,
    /// Unphysical mass properties that were accepted ([`Unphysical::Read`](crate::Unphysical::Read)).
    pub doubtful: Vec<Ignored>,
    /// Positions of the bodies in the files, for messages.
    #[serde(default)]
    pub places: Places,
}

/// Position of each body by its name: the file, which may be included by another one, and the line of its element. Descriptions are equal whatever
/// their positions are.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub struct Places(pub BTreeMap<String, FilePlace>);

impl PartialEq for Places {
    fn eq(&self, _: &Self) -> bool {
        true
    }
}

impl Description {
    /// Notes that the bodies of the builder from the `from`-th on are written at a place.
    pub(crate) fn written_at(&mut self, from: usize, place: &FilePlace) {
        let new = self.builder.bodies().iter().skip(from).map(|b| (b.name.clone(), place.clone()));
        self.places.0.extend(new);
    }
}

/// Treatment of a mesh file as a collision shape.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum CollisionMeshes {
    /// Its triangles collide.
    #[default]
    Triangles,
    /// The convex hull of its corners collides, as in MJCF.
    Hulls,
}

/// A shape on a body.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct BodyShape {
    /// Name of the body, or `world`.
    pub body: String,
    /// Name of the shape; empty if the file has none.
    pub name: String,
    /// Its purpose.
    pub role: ShapeRole,
    /// `X_BS`: the shape's frame in the body.
    pub pose: Pose,
    /// Its geometry.
    pub geometry: Geometry,
    /// Red, green, blue, opacity in 0 … 1.
    pub color: Option<[f64; 4]>,
    /// Friction and restitution, where the file has them.
    pub surface: Surface,
    /// Collision shapes of the file with which it collides.
    pub filter: Filter,
}

impl BodyShape {
    /// Creates a shape at the body's frame without name, colour and surface, which collides with all others.
    #[must_use]
    pub fn new(body: impl Into<String>, role: ShapeRole, pose: Pose, geometry: Geometry) -> Self {
        let (surface, filter) = (Surface::default(), Filter::default());
        let (body, name, color) = (body.into(), String::new(), None);
        Self { body, name, role, pose, geometry, color, surface, filter }
    }
}

/// Friction and restitution of a surface; `None`: not in the file.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Surface {
    /// Coefficient of Coulomb friction.
    pub friction: Option<f64>,
    /// Coefficient of restitution.
    pub restitution: Option<f64>,
    /// Coefficient of rolling friction, m.
    pub rolling: Option<f64>,
    /// Coefficient of spinning friction, m.
    pub spinning: Option<f64>,
}

/// Bit masks of a collision shape: `contype` and `conaffinity` of MJCF, `category_bitmask` and `collide_bitmask` of SDF. Two shapes collide if the
/// mask of either includes a category of the other.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
pub struct Filter {
    /// Categories of the shape.
    pub category: u32,
    /// Categories with which it collides.
    pub meets: u32,
}

impl Default for Filter {
    fn default() -> Self {
        Self { category: 1, meets: 1 }
    }
}

impl Filter {
    /// Whether two shapes collide.
    #[must_use]
    pub fn lets(self, other: Self) -> bool {
        self.category & other.meets != 0 || other.category & self.meets != 0
    }
}

/// Classes of collision shapes; the members of a class collide with the same classes.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct CollisionClasses {
    /// The class of each shape of the description; the class of a visual shape has no meaning.
    pub of: Vec<usize>,
    /// The classes with which each class collides.
    pub meets: Vec<Vec<usize>>,
}

/// The purpose of a shape.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum ShapeRole {
    /// The shape is visible only.
    Visual,
    /// Collision, according to the file.
    Collision,
    /// Ground contact, according to a companion file.
    Contact,
}

/// A solid, a plane, a height field or a mesh; lengths in m.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum Geometry {
    /// Centred; full lengths along x, y, z.
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
    /// A cylinder along z with hemispheres on its ends, centred.
    Capsule {
        /// Radius.
        radius: f64,
        /// Length of the cylinder without the hemispheres.
        length: f64,
    },
    /// Centred.
    Ellipsoid {
        /// Half axes along x, y, z.
        radii: [f64; 3],
    },
    /// z = 0, with the normal z.
    Plane {
        /// Full lengths along x and y; 0 is infinite.
        size: [f64; 2],
    },
    /// A surface over a grid that is centred at x = y = 0.
    HeightField {
        /// Number of points along x.
        columns: usize,
        /// Distance of neighbouring points along x and y.
        spacing: [f64; 2],
        /// Heights z: rows from low y to high y, each along x.
        heights: Vec<f64>,
    },
    /// A mesh file.
    Mesh {
        /// File name, as written.
        file: String,
        /// Path of the file, if it was found.
        path: Option<PathBuf>,
        /// Factors to m along x, y, z.
        scale: [f64; 3],
    },
}

/// A joint with the values in the file. Active damping, springs and friction are also in the hinge of its body.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Joint {
    /// Its name in the file.
    pub name: String,
    /// The body that it moves.
    pub body: String,
    /// Its first subhinge in that body's hinge.
    pub subhinge: usize,
    /// Number of its subhinges; 0 for a fixed joint.
    pub count: usize,
    /// Viscous damping, N m s/rad or N s/m.
    pub damping: f64,
    /// Dry friction, N m or N.
    pub friction: f64,
    /// Spring stiffness, N m/rad or N/m.
    pub stiffness: f64,
    /// Coordinate at which the spring is relaxed, rad or m.
    pub spring_reference: f64,
}

impl Joint {
    /// Creates a joint without damping, friction and spring.
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

/// The role of a wheel.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum WheelRole {
    /// Driven by a motor.
    #[default]
    Driven,
    /// Not driven.
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

/// Initial coordinates of a hinge in the file.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Initial {
    /// The body.
    pub body: String,
    /// Generalized coordinates of the hinge.
    pub q: Vec<f64>,
}

/// An element of the file that was not used, or only partly.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
pub struct Ignored {
    /// The file.
    pub file: String,
    /// Line, from 1.
    pub line: u32,
    /// Elements from the outside in, by name where they have one: `robot/link[arm]/visual`.
    pub path: String,
    /// The element, and the reason if it is not obvious.
    pub what: String,
}

impl std::fmt::Display for Ignored {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{}:{}: {}: {}", self.file, self.line, self.path, self.what)
    }
}

impl Description {
    /// Returns the classes of collision shapes according to their filters and `pairs`. The first class has the usual filter.
    #[must_use]
    pub fn collision_classes(&self) -> CollisionClasses {
        let paired: BTreeSet<usize> = self.pairs.iter().flatten().copied().collect();
        let key = |k: usize, s: &BodyShape| (s.filter, paired.contains(&k).then_some(k));
        let mut keys = vec![(Filter::default(), None)];
        let mut found = BTreeMap::from([(keys[0], 0)]);
        let mut of = Vec::new();
        for (k, s) in self.shapes.iter().enumerate() {
            let key = if s.role == ShapeRole::Visual { keys[0] } else { key(k, s) };
            let class = *found.entry(key).or_insert(keys.len());
            if class == keys.len() {
                keys.push(key);
            }
            of.push(class);
        }
        let together = |a: Option<usize>, b: Option<usize>| {
            let both = a.zip(b).map(|(a, b)| [a, b]);
            both.is_some_and(|[a, b]| self.pairs.iter().any(|p| *p == [a, b] || *p == [b, a]))
        };
        let meets = |a: &(Filter, Option<usize>)| -> Vec<usize> {
            let all = keys.iter().enumerate();
            all.filter(|(_, b)| a.0.lets(b.0) || together(a.1, b.1)).map(|(k, _)| k).collect()
        };
        CollisionClasses { of, meets: keys.iter().map(meets).collect() }
    }

    /// Returns the initial configuration in the file: `initial`, and the neutral one for all other bodies.
    #[must_use]
    pub fn configuration(&self, mbs: &Multibody) -> Vec<f64> {
        let mut q = mbs.neutral_q();
        for i in &self.initial {
            let place = mbs.body(&i.body).and_then(|b| q.get_mut(mbs.get(b).q()));
            if let Some(place) = place.filter(|p| p.len() == i.q.len()) {
                place.copy_from_slice(&i.q);
            }
        }
        q
    }

    /// Returns the coordinates of all joints with exactly one, by the name of the joint.
    #[must_use]
    pub fn coordinates(&self) -> BTreeMap<&str, HingeCoordinate> {
        let one = |j: &Joint| HingeCoordinate { body: j.body.clone(), subhinge: j.subhinge };
        // If several joints have the same name, the first one is used, as in `coordinate`.
        let all = self.joints.iter().rev().filter(|j| j.count == 1);
        all.map(|j| (j.name.as_str(), one(j))).collect()
    }

    /// Returns the joint with this name.
    #[must_use]
    pub fn joint(&self, name: &str) -> Option<&Joint> {
        self.joints.iter().find(|j| j.name == name)
    }

    /// Returns the coordinate of a joint, if it has exactly one.
    #[must_use]
    pub fn coordinate(&self, joint: &str) -> Option<HingeCoordinate> {
        let j = self.joint(joint).filter(|j| j.count == 1)?;
        Some(HingeCoordinate { body: j.body.clone(), subhinge: j.subhinge })
    }
}
