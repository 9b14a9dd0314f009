//! The embedded robot model ([`linkwork_embedded`]) for C: `include/linkwork/robot.h`, made of this crate by cbindgen;
//! `include/linkwork/robot.hpp` is a wrapper of it for C++. `README.md` has the rules for those who call.
//!
//! ```text
//! edge      pointers and lengths → slices and values, or a fault; panics end here
//! status    faults → codes and messages
//! builder   files, parts, objects, shapes       → LwBuilder
//! model     what never changes, names            → LwModel
//! robot     q, kinematics, forces, masses        → LwRobot
//! reach     inverse kinematics
//! together  the same of several tips at once
//! task      manipulability, rates of a tip, operational space
//! control   rates and forces for objectives in order of priority
//! hold      what hands hold
//! dual      two hands on one object
//! mass      momentum, composite inertias, predictions
//! shape     hulls, meshes, terrain, coarse shapes
//! collide   collisions
//! path      free paths and ways
//! timing    times of ways, transfers
//! priorities  solvers of plain numbers
//! tool      handles that lend memory to calls of a robot
//! ```
//! Every function may be called with any argument that keeps these promises, which no library can check; they are the
//! safety condition of every `unsafe fn` here:
//! a handle comes from this library and is not yet freed; a pointer that is not NULL and has a length beside it
//! (or a type of its own) points to that much memory, readable (`const`) or writable for the time of the call; a text ends with a zero.
#![allow(non_snake_case)]
// The promises above hold for all functions alike.
#![allow(clippy::missing_safety_doc)]

mod builder;
mod collide;
mod control;
mod dual;
mod edge;
mod hold;
mod mass;
mod mechanism;
mod model;
mod path;
mod priorities;
mod reach;
mod robot;
mod rules;
mod shape;
mod status;
mod task;
mod timing;
mod together;
mod tool;

pub use builder::*;
pub use collide::*;
pub use control::*;
pub use dual::*;
pub use edge::LwPose;
pub use hold::*;
pub use mass::*;
pub use mechanism::*;
pub use model::*;
pub use path::*;
pub use priorities::*;
pub use reach::*;
pub use robot::*;
pub use rules::*;
pub use shape::*;
pub use status::{LwStatus, lw_status_text, lw_version};
pub use task::*;
pub use timing::*;
pub use together::*;

/// Handles go from thread to thread, and a model is used by several at once: the compiler says whether they may.
const _: fn() = || {
    fn send<T: Send>() {}
    fn sync<T: Sync>() {}
    send::<robot::LwRobot>();
    sync::<model::LwModel>();
    send::<task::LwTaskSpace>();
    send::<control::LwRateControl>();
    send::<control::LwWholeBody>();
    send::<mass::LwPredictor>();
    send::<path::LwPlanner>();
    send::<priorities::LwPriorities>();
    send::<timing::LwTiming>();
    send::<timing::LwTransfer>();
    send::<together::LwWholeBodyIk>();
};
