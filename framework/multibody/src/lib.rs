//! The structure of a mechanism: bodies, hinges made of subhinges, nodes, constraints.
//!
//! A [`Builder`] takes parts in any order and reports all faults at once. [`Builder::build`] returns an immutable [`Multibody`] whose arrays are in
//! canonical order (depth first, parents before children, siblings by name), so the result does not depend on the order of adding.
//!
//! | subhinge | q | β (rates) |
//! |---|---|---|
//! | pin, screw | angle, rad | rad/s |
//! | slider | displacement, m | m/s |
//! | ball | unit quaternion [x y z w], child to parent axes | ω of the child in the parent, child axes |
//! | free | position of the child hinge frame in the parent hinge frame (3, m), quaternion [x y z w] | ω (3), v (3) of the child hinge frame, both in child axes |
//!
//! "Child axes" are the axes of the hinge frame on the child. They equal the body's own axes unless the body sets its hinge frame elsewhere
//! ([`BodySpec::hinge_in_body`]).
//!
//! In q and β, the modal coordinates η and rates of a flexible body ([`modes`]) follow directly after the elements of its hinge.
//! ```
//! use linkwork_multibody::spatial::{MassProperties, Mat3, Pose, Vec3};
//! use linkwork_multibody::{BodySpec, Builder, Hinge};
//!
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! let bar = MassProperties { mass: 2.0, com: Vec3::new(0.0, 0.0, -0.5), inertia_com: Mat3::from_diagonal(&Vec3::new(0.17, 0.17, 0.01)), ..MassProperties::default() };
//! let mut builder = Builder::new();
//! builder.body(BodySpec::new("lower", "upper").hinge(Hinge::pin(Vec3::y())).hinge_in_parent(Pose::translation(0.0, 0.0, -1.0)).mass(bar));
//! builder.body(BodySpec::new("upper", "world").hinge(Hinge::ball()).mass(bar));
//! let arm = builder.build()?;
//! assert_eq!((arm.nq(), arm.nv()), (4 + 1, 3 + 1));
//! # Ok(())
//! # }
//! ```
#![allow(non_snake_case)]

mod ball;
mod builder;
mod checks;
mod constraint;
mod coordinates;
mod error;
mod hinge;
mod ids;
mod mechanism;
pub mod modes;
mod subgraph;

pub use ball::BallLimits;
pub use builder::{BodySpec, Builder, NodeSpec};
pub use constraint::{
    Anchor, ConstraintId, Coupled, Coupling, HingeCoordinate, Loop, LoopClosure, LoopFault,
    LoopMotion, LoopRow, Powers, Term,
};
pub use coordinates::{straight, uniform};
pub use error::{BuildError, MechanismFault};
pub use hinge::{Coordinate, Friction, Hinge, Limits, Spring, Stop, Subhinge, SubhingeKind};
pub use ids::{BodyId, NodeId};
pub use linkwork_spatial as spatial;
pub use mechanism::{Body, Multibody, Node, SubhingeRange};
pub use modes::Modes;
pub use subgraph::{Subgraph, SubgraphError};
