//! The structure of a mechanism: bodies, hinges made of subhinges, nodes, constraints.
//!
//! A [`Builder`] takes parts in any order and reports every fault at once; [`Builder::build`]
//! returns an immutable [`Multibody`] whose arrays are in canonical order (depth first, parents
//! before children, siblings by name), so the order of adding leaves no trace.
//!
//! | subhinge | q | β (rates) |
//! |---|---|---|
//! | pin, screw | angle, rad | rad/s |
//! | slider | displacement, m | m/s |
//! | ball | unit quaternion [x y z w], child to parent axes | ω of the child in the parent, child axes |
//! | free | position of the child hinge frame in the parent hinge frame (3, m), quaternion [x y z w] | ω (3), v (3) of the child hinge frame, both in child axes |
//!
//! "Child axes" are those of the hinge frame on the child: the body's own axes unless the body
//! places its hinge frame elsewhere ([`BodySpec::hinge_in_body`]).
//!
//! A flexible body ([`modes`]) has its modal coordinates η and their rates directly after its hinge's.
#![allow(non_snake_case)]

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

pub use builder::{BodySpec, Builder, NodeSpec};
pub use constraint::{
    Anchor, ConstraintId, Coupled, Coupling, HingeCoordinate, Loop, LoopClosure, LoopFault,
    LoopMotion, LoopRow, Term,
};
pub use coordinates::straight;
pub use error::{BuildError, MechanismFault};
pub use hinge::{Coordinate, Friction, Hinge, Limits, Stop, Subhinge, SubhingeKind};
pub use ids::{BodyId, NodeId};
pub use linkwork_spatial as spatial;
pub use mechanism::{Body, Multibody, Node, SubhingeRange};
pub use modes::Modes;
pub use subgraph::{Subgraph, SubgraphError};
