//! Collision geometry of a multibody system: contact points of bodies that touch or nearly touch, with normals and depths. This is the only crate
//! that depends on parry.
//!
//! [`Colliders`] are shapes on bodies, checked and constant. A query is a pure function of the poses of the bodies. No result of an earlier query is
//! used, so a resumed run is bit-identical. [`Scratch`] contains only memory.
//!
//! ```text
//! bounding boxes, sorted along the axis on which they are spread most                query.rs
//! pairs that the rules include                                                      colliders.rs, rules.rs
//! contact points of a pair, in the frame of one of the two                          pairs.rs, manifold.rs, edges.rs, axis.rs
//! surfaces: each triangle                                                           triangle/mod.rs
//! rolling cylinders: each disc                                                      discs.rs
//! a disc on a height field: the smooth surface through the heights                  relief/discs.rs
//! point clouds and voxel maps: each sphere or cell                                  pieces/mod.rs
//! reduction to at most eight named corners of an outline for each direction         thin.rs
//! removal of points on faces that other shapes of the same body cover               covered.rs
//! ```
//! [`Probe`] answers collision checks and distances with settings that may change between queries. It computes contact points only for overlapping
//! pairs:
//! ```text
//! nearest points of two cores                                                       near/mod.rs
//! segments, boxes, cylinders: closed forms, and guesses that are verified            near/lines.rs, near/cylinders.rs
//! all other pairs: the iteration of Gilbert, Johnson and Keerthi                    near/walk.rs
//! ```
//!
//! Accuracy:
//! * Distances of `Probe` between cores that are separated by more than 1e-6 of the smaller core's size are verified by their normals to 2e-12 m; for
//!   a cylinder with a box, a hull or another cylinder to 5e-10 m (measured on shapes of 0.01 to 4 m). Nearest points lie in their shapes.
//! * Gaps and normals of separated convex pairs are exact up to round-off. The depth of an overlap may be overestimated by up to 1e-5 of the size of
//!   the smaller shape, because a face takes precedence over an edge, and the first collider's over the second's, so that a resting contact does not
//!   switch. Pairs are solved in relative poses, so accuracy far from the origin is limited only by the resolution of the positions themselves.
//! * While faces are parallel within 1e-4 rad, the smallest gap may be missed by up to 1e-5 of the size of the smaller shape (a corner that protrudes
//!   over an edge, the rim between eight points). Otherwise points would appear and disappear with every small motion.
//! * Surfaces that are convex only in parts (meshes, height fields) are resolved triangle by triangle, outwards, along a normal that the neighbours
//!   permit. Over a convex edge this is a normal of smallest depth near the triangle's own normal.
//! * A cylinder on an edge has a contact segment, represented by its ends, while both are parallel within 1e-3 rad, and otherwise a single point, so
//!   forces that are summed over points are discontinuous. With `discs` it has the contact of several discs, each with one point that moves
//!   continuously.
//! * Point clouds and voxel maps are the union of their spheres and cells. Distances are the smallest, depths the largest of a single sphere or cell.
//! * Capsules that are parallel within 1e-3 rad have a contact line, represented by its two ends.
//!
//! The output is in the order of the colliders' names and does not depend on the order in which they were given.
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
mod contact_points;
mod convert;
mod core;
mod covered;
mod discs;
mod drawn;
mod edges;
mod error;
mod item;
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
mod settings;
mod shape;
mod solid;
mod surface;
mod thin;
mod triangle;

pub use colliders::{Colliders, Rebuilt};
pub use drawn::{Triangles, box_of_inertia, drawn_plane, drawn_surface};
pub use error::{ColliderFault, CollisionError, ShapeFault};
pub use item::ColliderId;
pub use linkwork_multibody as multibody;
pub use probe::Probe;
pub use query::{Closest, ContactPoint, Distance, Query, Scratch};
pub use ray::{Ray, RayHit, Target};
pub use rules::{TERRAIN, groups, neighbours};
pub use settings::{Hiding, SurfaceVelocities};
pub use shape::{
    ColliderSpec, Detail, Material, Neighbours, Occupancy, OnTerrain, PairLaw, Resistance, Rules,
    Shape, Varies, Visibility, VisualShape,
};
pub use solid::hull_surface;
