//! C interface of the embedded robot model ([`linkwork_embedded`]). cbindgen generates `include/linkwork/robot.h` from this crate;
//! `include/linkwork/robot.hpp` is a C++ wrapper. `README.md` contains the rules for callers.
//!
//! ```text
//! edge      pointers and lengths → slices and values, or a fault; catches panics
//! call      the table of functions, and the kinds of their arguments
//! status    faults → codes and messages
//! builder   files, parts, objects, shapes       → LwBuilder
//! model     constant data, names                 → LwModel
//! robot     q, kinematics, forces, masses        → LwRobot
//! reach     inverse kinematics
//! together  whole-body inverse kinematics
//! task      manipulability, rates of a tip, operational space
//! control   rates and forces for tasks in order of priority
//! hold      objects in the hands
//! dual      two hands on one object
//! mass      momentum, composite inertias, predictions
//! shape     hulls, meshes, terrain, coarse shapes
//! collide   collisions
//! path      collision checks of paths, path planning
//! timing    time parameterization, transfers
//! priorities  least-squares solvers without a robot
//! tool      handles that provide memory for calls of a robot
//! ```
//! Every function may be called with any arguments that meet the following conditions, which no library can check. They are the safety conditions of
//! every `unsafe fn` in this crate: a handle comes from this library and is not yet freed; a pointer that is not NULL and has a length next to it (or
//! a type of fixed size) points to that much memory, readable (`const`) or writable for the duration of the call; a text ends with a zero.
#![allow(non_snake_case)]
// The conditions above apply to all functions.
#![allow(clippy::missing_safety_doc)]

mod builder;
mod call;
mod collide;
mod control;
mod dual;
mod edge;
mod hold;
mod mass;
mod mass_properties;
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

/// Handles may move between threads, and several threads may use a model at once: check this at compile time.
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
