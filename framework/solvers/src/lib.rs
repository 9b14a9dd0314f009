//! Solvers for constrained motion and contact, based on the recursive dynamics.
//!
//! | solver | constraints | unknowns |
//! |---|---|---|
//! | tree | none | β̇ |
//! | tree-augmented | rows in addition to the tree | λ of every row, dense over rows that share unknowns |
//! | constraint embedding | loops become aggregates of the tree | β̇ only |
//! | both | each loop by `solve: Auto` or by the user's choice | λ of the remaining rows |
//! | fully augmented ([`FullyAugmentedSolver`]) | each body is free; hinges and all other constraints are rows | λ of all, sparse |
//! | non-smooth ([`ContactStepper`]) | all of the above, and contacts, limits, dry friction | impulses of a step |
//! | compliant ([`CompliantContact`]) | forces of penetration and bristles | only its states |
//! | rolling ([`Rolling`]) | wheels that roll on the ground, no forces | planar motion of vehicles, their attitude on the ground |
//!
//! The first four use the same [`ConstrainedSolver`]; they differ in the [`ConstraintMethod`] of each constraint.
#![allow(non_snake_case)]

mod bristles;
mod compliant;
mod constrained;
pub mod contact;
pub mod contact_law;
mod fully_augmented;
mod projection;
mod rolling;
mod shared;
mod skyline;
mod start;
mod stepper;

pub use bristles::{BRISTLE, TooManyTouch};
pub use compliant::{
    CompliantContact, CompliantError, CompliantLaws, CompliantSettings, NormalLoad, PairLoad,
};
pub use constrained::{ConstrainedSolver, NEAR, Redundant, Report, SolverError, Stabilisation};
pub use fully_augmented::{FullyAugmentedError, FullyAugmentedSolver};
pub use linkwork_dynamics::units::ConstraintMethod;
pub use projection::{Closing, ProjectionError, Projector};
pub use rolling::{
    Footing, Rolling, RollingError, RollingGround, RollingReport, Traction, Vehicle, WheelLoad,
    footing,
};
pub use start::{FixedValues, ROUNDED, StartError, close_start};
pub use stepper::{ContactSettings, ContactStepper, Impulse, JointLimits, StepError, StepReport};
