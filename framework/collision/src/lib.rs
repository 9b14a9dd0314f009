//! Collision geometry of a multibody: which points of which bodies touch or nearly touch, where, along which normal, how deep.
//! Home of parry.
//!
//! [`Colliders`] are shapes on bodies, checked and constant. A query is a pure function of the poses of the bodies: no result of
//! an earlier one is kept, so that a run that is resumed gives the same bits. [`Scratch`] is memory and nothing else.
//!
//! ```text
//! boxes around the shapes, sorted along the axis on which they are spread most      query.rs
//! pairs that the rules let through                                                  colliders.rs, rules.rs
//! contact points of a pair, in the frame of one of the two                          pairs.rs, manifold.rs, edges.rs, axis.rs
//! of a surface: one triangle after the other                                        triangle/mod.rs
//! of a cylinder that rolls: one disc after the other                                discs.rs
//! of such a disc and a height field: the smooth surface through the heights         relief/discs.rs
//! of a point cloud, a voxel map: one ball or cell after the other                   pieces/mod.rs
//! for each direction the corners of an outline, eight at most, with names           thin.rs
//! without those on faces that other shapes of the same body cover                   covered.rs
//! ```
//! Yes or no, and distances, with settings that change between questions: [`Probe`], which makes contact points only of what overlaps:
//! ```text
//! nearest points of two cores                                                       near/mod.rs
//! segments, boxes, cylinders: closed forms, and guesses that are proven              near/lines.rs, near/cylinders.rs
//! any two: the iteration of Gilbert, Johnson and Keerthi                             near/walk.rs
//! ```
//!
//! What is exact and what is not:
//! * Distances that `Probe` tells of cores that are apart by more than 1e-6 of the smaller's size are proven by their normals to 2e-12 m, of a cylinder with
//!   a box, a hull or another cylinder to 5e-10 m (measured on shapes of 0.01 to 4 m); nearest points lie in their shapes.
//! * Gaps and normals of convex pairs that are apart are exact to rounding. The depth of an overlap may be told too large by up to 1e-5 of the size of the
//!   smaller shape: a face goes before an edge, and the first collider's before the second's, so that what rests does not change its mind.
//!   Pairs are solved in relative poses: far from the origin only the digits are lost that the positions themselves have not.
//! * While faces lie on each other within 1e-4 rad, the smallest gap may lack up to 1e-5 of the size of the smaller shape (a corner that sticks
//!   out over an edge, the rim between eight points): else points would come and go with every tremor.
//! * Where surfaces are convex in parts only (meshes, height fields), an overlap is resolved triangle by triangle, outwards, along a normal that the neighbours
//!   permit; over a convex edge that is one of least depth near the triangle's own normal.
//! * A cylinder on an edge touches along a stretch, told by its ends, while both are parallel within 1e-3 rad, and else at one point: forces that are
//!   summed over points jump. With `discs` it touches as discs across its length, each at one place that moves without jumps.
//! * Point clouds and voxel maps are the union of their balls and cells: distances are those of the nearest, depths those of the deepest single one.
//! * Capsules within 1e-3 rad of parallel touch along a line, told by its two ends.
//!
//! The output is in the order of the colliders' names, whatever the order in which they were given.
//!
//! ```
//! use linkwork_collision::*;
//! use linkwork_collision::multibody::{BodySpec, Builder, Hinge};
//! use linkwork_collision::multibody::spatial::{Pose, Vec3};
//!
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! let mut builder = Builder::new();
//! builder.body(BodySpec::new("crate", "world").hinge(Hinge::free()));
//! let multibody = builder.build()?;
//! let shapes = vec![
//!     ColliderSpec::new("ground", "world", Shape::HalfSpace),
//!     ColliderSpec::new("sides", "crate", Shape::Box { half: Vec3::new(0.3, 0.2, 0.1) }),
//! ];
//! let colliders = Colliders::new(shapes, Rules::default(), &multibody)?;
//! let mut scratch = Scratch::new(&colliders);
//! let mut contacts = Vec::new();
//! let poses = |body: Option<_>| body.map_or(Pose::identity(), |_| Pose::translation(0.0, 0.0, 0.099));
//! colliders.contacts(&mut scratch, &Query::margin(0.01), poses, &mut contacts);
//! assert_eq!(contacts.len(), 4);
//! assert!(contacts.iter().all(|c| (c.gap + 0.001).abs() < 1e-12));
//! # Ok(())
//! # }
//! ```
#![allow(non_snake_case)]

mod axis;
mod colliders;
mod convert;
mod core;
mod covered;
mod discs;
mod drawn;
mod edges;
mod error;
mod manifold;
mod near;
mod pairs;
mod pieces;
mod polish;
mod probe;
mod query;
mod ray;
pub mod relief;
mod rules;
mod shape;
mod solid;
mod surface;
mod thin;
mod triangle;

pub use colliders::{ColliderId, Colliders, Rebuilt};
pub use drawn::{Triangles, box_of_inertia, drawn_plane, drawn_surface};
pub use error::{ColliderFault, CollisionError, ShapeFault};
pub use linkwork_multibody as multibody;
pub use probe::Probe;
pub use query::{Closest, ContactPoint, Distance, Hiding, Query, Scratch, SurfaceVelocities};
pub use ray::{Ray, RayHit, Target};
pub use rules::{TERRAIN, groups, neighbours};
pub use shape::{
    ColliderSpec, Detail, Material, Neighbours, Occupancy, OnTerrain, PairLaw, Resistance, Rules,
    Seen, Shape, Varies, Visibility,
};
pub use solid::hull_surface;
