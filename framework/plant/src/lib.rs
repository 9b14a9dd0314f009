//! The mechanism of a simulation: rigid and flexible bodies with hinges, loops, contact and wheels, as one part of a dataflow simulation.
//!
//! [`MechanismSpec`] is the description. It is the [`Host`](linkwork_runtime::Host) of a specification: `compile` passes the bindings of the
//! other parts to it, and it returns a part with one port for each binding. The part has two operations: kinematics (from state) and dynamics
//! (from forces).
//!
//! ```text
//! outputs       q, v → poses and velocities of the bound nodes, hinge states
//! feedthrough   Σ wrenches, Σ torques, gravity, damping and stops of hinges → accelerations, forces of constraints
//! derivatives   q̇ = N(q) v,  v̇ from feedthrough
//! ```
//! After a step, q and v are projected onto the constraints. The part uses its own stepping method (`advance`) if contact is solved by impulses,
//! or if machines move by kinematics. Its store holds the impulses of the last contacts, which start the iteration of the next step.
//!
//! The traits [`SpecExt`], [`PlanExt`] and [`ProgramExt`] find the mechanism of a specification, a plan and a program.
// Mathematical functions that are bit-identical on every machine: they are called by their names in C.
extern crate linkwork_maths as _;

mod accounts;
mod axle;
mod block;
mod branch;
mod carry;
mod closing;
mod extension;
mod forward_jacobian;
mod frame;
mod gaps;
mod host;
mod idle;
mod jacobian;
mod joints;
mod loads;
mod masses;
mod names;
mod part;
mod passing;
mod placement;
mod plan;
mod ports;
mod rank;
mod reaction;
mod rolling;
mod rolls;
mod spec;
mod start;
mod touch;
mod vehicles;
mod zone;

pub use extension::{PlanExt, ProgramExt, SpecExt};
pub use frame::Frame;
pub use gaps::Closing;
pub use part::MechanismPart;
pub use passing::Passing;
pub use placement::{PlaceError, Placed, Placement, place_on_terrain, settle_placed};
pub use plan::MechanismPlan;
pub use ports::MechanismPorts;
pub use rank::RankReport;
pub use spec::{ContactSpec, KinematicSpec, MechanismSpec};
