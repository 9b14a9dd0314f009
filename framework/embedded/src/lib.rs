//! The robot model that autonomy software embeds: parts by name, kinematics, inverse kinematics,
//! collisions, what the hands hold, forces, motions in time.
//!
//! ```text
//! RobotModel   what never changes: bodies, parts, objects             shared: Arc, Sync
//! Robot        one instance: its q, what it holds, all its memory     Send; a clone is independent
//! ```
//! Names are looked up once, at the model; the handles ([`Part`], [`Object`]) are `Copy`. After [`Robot::new`]
//! no call allocates, errors included (lists that are too short for an answer apart, and a `Transfer` whose profile fails by round-off, which formats a text in rsruckig), and none depends on what the instance did before: the same
//! inputs give the same bits. There is no clock, no thread and no log inside.
//!
//! Files with masses that no body has are read; `RobotModel::doubtful` warns of them, with link and numbers (`Unphysical::Refused` refuses them).
//!
//! Objects that hands hold are rigid, or have joints of their own ([`ModelSpec::linkages`]): pliers, a drawer, a door. They may be attached to each other ([`Robot::attach`]): a battery to its driver, a key to its lock. Obstacles are shapes, or what sensors see while the
//! robot works: point clouds and voxel maps ([`Robot::set_points`], [`Robot::set_cells`]). What loops of two hands, or of a key in a lock, leave is [`Robot::closure`]. A [`Planner`] finds free ways between configurations.
//!
//! [`Robot::inverse_kinematics`] searches for a configuration of any chain; arms of six or seven hinges whose axes admit it are solved in closed form, all solutions at once
//! ([`RobotModel::closed_form`], [`Robot::inverse_kinematics_all`]). [`WholeBodyIk`] searches for one in which several tips are where they are to be at once, in the world or in
//! each other's hands, with what carries them; what two hands hold stays closed, and so do the mechanism's own loops and couplings ([`Closures`]).
//! [`Effort::worst_case_steps`] says after how much work a search has ended at the latest.
//!
//! A way gets its times by [`Timing`]: as fast as limits of rate, acceleration and effort allow, what is held counted. [`Transfer`] goes from any state to any
//! other within limits of jerk. [`RateControl`] and [`WholeBody`] give rates and forces for objectives in order of priority, away from limits and singular
//! configurations, with contacts that press and do not slip; [`TaskSpace`] operational space and impedance; [`support_polygon`] where a robot stands firm.
//!
//! Angular part first, world axes, SI and radians throughout. Columns are the degrees of freedom of
//! the mechanism in canonical order ([`RobotModel::coordinate`] finds a joint's), or those of a part in the same order.
//!
//! # Speed
//! Beside its peers in the same run, on an AMD EPYC; all rows, other days and definitions: `framework/embedded/BENCHES.md` (`tests/benches/robots`).
//!
//! | what | ours | of the peer's time | asked for |
//! |---|---|---|---|
//! | inverse kinematics from anywhere to 1e-9 (ur5; iiwa7), median; p99 | 8.1; 8.6 µs, all met, 17.2 and 15.0 kinematics a target | Pinocchio: 0.30; 0.56, p99 0.23; 0.44 | 0.6, 99.99 %, 25 |
//! | the same from near by (ur5; iiwa7), median | 2.3; 2.7 µs | Pinocchio: 0.54; 0.59 | 0.6, 99.9 % |
//! | a target out of reach, answered with the nearest | 0.2 to 0.4 ms | – | 1 ms |
//! | yes or no of collisions (one arm of 111 pairs; two of 278), no answer wrong | 1.9; 2.2 µs | coal's tree: 0.30; 0.32 | 0.4 |
//! | all distances | 12; 32 µs | coal: 0.36; 0.36 | 0.4 |
//! | grasp and ungrasp with filters; forces of 18 dofs with a load; balance of two arms | 0.94; 0.54; 0.88 µs | – | 60; 1.5; 10 µs |
//! | Python: inverse, forward dynamics, mass matrix, kinematics of an arm of seven axes, one call | 0.7 to 1.2 µs | pin: 0.76, 0.62, 0.98, 0.67 | 1 |
//! | Python: a step of a humanoid with contact | 12 µs | MuJoCo: 0.94 | 1 |
//! | Python: many states in two threads | | pin in a loop: 0.09; MuJoCo's rollout: 0.16 | 0.2; 0.5 |
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
//! let arm = model.part("arm").ok_or("no arm")?; // names once
//! let mut robot = Robot::new(&model); // memory of its own
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
pub use linkwork_dynamics::Known;
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
