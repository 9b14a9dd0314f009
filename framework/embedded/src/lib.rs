//! Robot model for embedding in autonomy software: named parts, kinematics, inverse kinematics, collisions, held objects, forces, and trajectories.
//!
//! ```text
//! RobotModel   constant data: bodies, parts, objects                  shared: Arc, Sync
//! Robot        one instance: its q, held objects, all memory          Send; a clone is independent
//! ```
//! Names are looked up once, in the model; the handles ([`Part`], [`Object`]) are `Copy`. No call allocates after [`Robot::new`], including calls
//! that return errors. The two exceptions are lists that are too short for a result, and a `Transfer` whose profile fails by round-off, because
//! rsruckig then formats a text. No call depends on earlier calls of the instance: equal inputs give bit-identical results, on Linux on
//! every machine, because the crate has its own mathematical functions (`linkwork-maths`). The crate uses no clock, no thread and no log.
//!
//! Files with mass properties that no rigid body can have are read; `RobotModel::doubtful` returns warnings with link and numbers (with
//! `Unphysical::Refused` such files are errors).
//!
//! Held objects are rigid or have joints ([`ModelSpec::linkages`]), such as pliers, a drawer or a door. Objects may be attached to each other
//! ([`Robot::attach`]), such as a battery to its driver or a key to its lock. Obstacles are shapes or sensor data that change while the robot works:
//! point clouds and voxel maps ([`Robot::set_points`], [`Robot::set_cells`]). [`Robot::closure`] returns the mobility of loops, such as two hands on
//! an object or a key in a lock. A [`Planner`] finds collision-free paths between configurations.
//!
//! [`Robot::inverse_kinematics`] solves the inverse kinematics of a chain numerically. Arms with six or seven hinges whose axes admit it are solved in closed
//! form, with all solutions at once ([`RobotModel::closed_form`], [`Robot::inverse_kinematics_all`]). [`WholeBodyIk`] solves for several tips at once, with goals
//! in the world or relative to each other, and moves the bodies that carry them. Objects in two hands stay in both hands, and the mechanism's own
//! loops and couplings stay closed ([`Closures`]). [`Effort::worst_case_steps`] returns an upper bound of the work of a search.
//!
//! [`Timing`] time-parameterizes a path: minimum time within limits of rate, acceleration and effort, including held objects. [`Transfer`] plans a
//! jerk-limited motion between any two states. [`RateControl`] and [`WholeBody`] compute rates and forces for tasks in order of priority, avoid
//! limits and singular configurations, and keep contacts pressed and free of slip. [`TaskSpace`] provides operational space and impedance control.
//! [`support_polygon`] computes the region of centres of mass in which a robot stands stably.
//!
//! Angular part first, world axes, SI units and radians throughout. Columns are the degrees of freedom of the mechanism in canonical order
//! ([`RobotModel::coordinate`] returns a joint's), or the degrees of freedom of a part in the same order.
//!
//! # Speed
//! Measured against other libraries in the same run, on an AMD EPYC. All rows, other days and definitions: `framework/embedded/BENCHES.md`
//! (`tests/benches/robots`).
//!
//! | quantity | Linkwork | fraction of the other library's time | target |
//! |---|---|---|---|
//! | inverse kinematics from a random start to 1e-9 (ur5; iiwa7), median; p99 | 8.1; 8.6 µs, all goals met, 17.2 and 15.0 kinematics evaluations for each goal | Pinocchio: 0.30; 0.56, p99 0.23; 0.44 | 0.6, 99.99 %, 25 |
//! | inverse kinematics from a nearby start (ur5; iiwa7), median | 2.3; 2.7 µs | Pinocchio: 0.54; 0.59 | 0.6, 99.9 % |
//! | inverse kinematics of a goal out of reach, with the nearest configuration as result | 0.2 to 0.4 ms | – | 1 ms |
//! | collision check (one arm with 111 pairs; two arms with 278), no result wrong | 1.9; 2.2 µs | coal's tree: 0.30; 0.32 | 0.4 |
//! | all distances | 12; 32 µs | coal: 0.36; 0.36 | 0.4 |
//! | grasp and release with collision filters | 0.94 µs | – | 60 µs |
//! | inverse dynamics of 18 dofs with a load | 0.54 µs | – | 1.5 µs |
//! | load sharing of two arms | 0.88 µs | – | 10 µs |
//! | Python: one call of inverse dynamics of an arm with seven axes | 0.79 µs | Pinocchio's Python package: 0.76 | 1 |
//! | Python: one call of forward dynamics of this arm | 1.19 µs | Pinocchio's Python package: 0.62 | 1 |
//! | Python: one call of the mass matrix of this arm | 0.72 µs | Pinocchio's Python package: 0.98 | 1 |
//! | Python: one call of the kinematics of this arm | 0.73 µs | Pinocchio's Python package: 0.67 | 1 |
//! | Python: one step of a humanoid with contact | 12 µs | MuJoCo: 0.94 | 1 |
//! | Python: many states in two threads | | Pinocchio's Python package in a loop: 0.09; MuJoCo's rollout: 0.16 | 0.2; 0.5 |
//!
//! # An example
//! ```
//! use linkwork_embedded::formats::{ReadOptions, Root, read_text};
//! use linkwork_embedded::spatial::Vec3;
//! use linkwork_embedded::*;
//!
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! let text = r#"<robot name="arm"><link name="base"/>
//!   <link name="upper"><inertial><origin xyz="0.2 0 0"/><mass value="2"/>
//!     <inertia ixx="0.01" iyy="0.03" izz="0.03" ixy="0" ixz="0" iyz="0"/></inertial></link>
//!   <link name="lower"><inertial><origin xyz="0.2 0 0"/><mass value="1"/>
//!     <inertia ixx="0.01" iyy="0.02" izz="0.02" ixy="0" ixz="0" iyz="0"/></inertial></link><link name="tool"/>
//!   <joint name="shoulder" type="continuous"><parent link="base"/><child link="upper"/><axis xyz="0 -1 0"/></joint>
//!   <joint name="elbow" type="continuous"><parent link="upper"/><child link="lower"/>
//!     <origin xyz="0.4 0 0"/><axis xyz="0 -1 0"/></joint>
//!   <joint name="flange" type="fixed"><parent link="lower"/><child link="tool"/><origin xyz="0.4 0 0"/></joint>
//! </robot>"#;
//! let options = ReadOptions { root: Root::Fixed, ..ReadOptions::default() };
//! let mut spec = ModelSpec::from_description(&read_text(text, &options)?)?;
//! spec.parts.push(PartSpec::chain("arm", "base", "tool"));
//! let model = RobotModel::new(&spec)?; // shared, constant
//! let arm = model.part("arm").ok_or("no arm")?; // look up names once
//! let mut robot = Robot::new(&model); // its own memory
//!
//! let mut q = [0.1, 0.5];
//! let goal = Goal::position(Vec3::new(0.5, 0.0, 0.3));
//! let answer = robot.inverse_kinematics(arm, &goal, Frame::World, &Effort::kinematics(500), &mut q)?;
//! assert_eq!(answer.outcome, Outcome::Met);
//! robot.set_q(&q)?;
//! let mut tau = [0.0; 2];
//! robot.gravity_forces(&mut tau)?;
//! assert!(tau[0] > 0.0 && robot.manipulability(arm, Rows::Linear, None)?.w < 1.0);
//! # Ok(())
//! # }
//! ```
#![allow(non_snake_case)]
// The mathematical functions of `linkwork-maths` are bit-identical on every machine.
extern crate linkwork_maths as _;

mod bounded;
mod closed_form;
mod collision;
mod error;
mod linkage;
mod manipulability;
mod model;
mod part;
mod priorities;
mod robot;
mod support;

pub use bounded::{Sweeps, bounded};
pub use closed_form::ClosedForm;
pub use error::{Closure, ModelError, ModelFault, RobotError};
pub use linkwork_collision::{
    Closest, ColliderId, ColliderSpec, Detail, Distance, Neighbours, Occupancy, Rules, Shape,
    ShapeFault, Visibility,
};
pub use linkwork_dynamics as dynamics;
pub use linkwork_dynamics::StateEstimate;
pub use linkwork_dynamics::inverse_kinematics::{Goal, Place, Pointing, Residual, Towards};
pub use linkwork_formats as formats;
pub use linkwork_multibody as multibody;
pub use linkwork_spatial as spatial;
pub use manipulability::{Manipulability, Rows};
pub use model::{Closures, ModelSpec, Object, ObjectSpec, RobotModel, colliders_of};
pub use part::{Part, PartSpec};
pub use priorities::{LevelResult, NoSolution, Priorities};
pub use robot::{
    Aim, Answer, Balance, Balanced, Best, Closing, ClosureRank, Effort, Frame, Friction, Grasp,
    Gripped, Guards, HandWeights, HandWrenches, Hold, Impedance, MotionLimits, MotionState, Mount,
    Objective, Outcome, Path, PathProgress, PlanOutcome, Planner, Predictor, Prefer, Push,
    RateControl, Robot, Search, Shared, TaskSpace, Timed, Timing, TipGoal, Touch, Transfer,
    Transferred, WholeBody, WholeBodyIk, collides_all,
};
pub use support::{support_margin, support_polygon};
