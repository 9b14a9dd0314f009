//! The robot model that autonomy software embeds: parts by name, kinematics, inverse kinematics,
//! what the hands hold, forces.
//!
//! ```text
//! RobotModel   what never changes: bodies, parts, objects             shared: Arc, Sync
//! Robot        one instance: its q, what it holds, all its memory     Send; a clone is independent
//! ```
//! Names are looked up once, at the model; the handles ([`Part`], [`Object`]) are `Copy`. After [`Robot::new`]
//! no call allocates, errors included, and none depends on what the instance did before: the same
//! inputs give the same bits. There is no clock, no thread and no log inside.
//!
//! Angular part first, world axes, SI and radians throughout. Columns are the degrees of freedom of
//! the mechanism in canonical order ([`RobotModel::coordinate`] finds a joint's), or those of a part in the same order.
#![allow(non_snake_case)]

mod collision;
mod error;
mod manipulability;
mod model;
mod part;
mod robot;

pub use error::{ModelError, ModelFault, RobotError};
pub use linkwork_collision::{
    Closest, ColliderId, ColliderSpec, Detail, Distance, Rules, Shape, Visibility,
};
pub use linkwork_dynamics as dynamics;
pub use linkwork_dynamics::inverse_kinematics::Residual;
pub use linkwork_formats as formats;
pub use linkwork_multibody as multibody;
pub use linkwork_spatial as spatial;
pub use manipulability::{Manipulability, Rows};
pub use model::{ModelSpec, Object, ObjectSpec, RobotModel};
pub use part::{Part, PartSpec};
pub use robot::{
    Answer, Balance, Best, Effort, Goal, Grasp, HandWeights, Hold, MoveSqueeze, Outcome, Path,
    Prefer, Push, Robot, Shared, TaskSpace,
};
