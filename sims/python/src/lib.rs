//! What the compiled part of a Python package is made of: thin classes over the Rust floors.
//!
//! The package `linkwork` is `sims/python/module`. A library of models has a package of its own, with everything of
//! this one and its own models: a crate with `crate-type = ["cdylib"]` and [`module!`].
//!
//! | file | what |
//! |---|---|
//! | `array` | numpy in and out: shapes and NaN are checked here, nowhere else |
//! | `error` | `LinkworkError` |
//! | `core` | what a mechanism and its states share |
//! | `builder`, `mechanism`, `dynamics`, `state` | `Builder`, `Mechanism`, `State` |
//! | `constraints` | loops and couplings of a `Mechanism` |
//! | `contact` | `Collider`, `Contact`: bodies of a `Mechanism` that touch |
//! | `collisions` | `Collisions`: whether a robot touches itself or obstacles |
//! | `robot` | `Robot`: the embedded robot model |
//! | `copies` | `copy` and `pickle` of a `Mechanism` |
//! | `algorithms`, `derivatives`, `calibration` | more algorithms of `Mechanism` |
//! | `batch` | one state or many; threads and lanes |
//! | `inverse_kinematics`, `edit`, `frames` | `Target`, `Edit`, `Frames` |
//! | `operators` | `Operators`, `Operator`: expressions |
//! | `simulate` | a small time integration of one mechanism |
//! | `files`, `formats` | reading files with all component libraries; what a file says besides; URDF and RON out |
//! | `parts` | parts of a simulation that are Python classes |
//! | `simulation`, `running`, `log`, `values` | `Simulation` and its logs |
//! | `scene` | the shapes of bodies, for `show` in Rerun |
//! | `show` | how a `Mechanism` and a `Simulation` show themselves |
//! | `package` | which package this is: its models, the module that all of this is put into |
//! | `processor` | which processors a build is for |
//! | `campaign`, `patience` | `Campaign`: many runs with drawn values; Ctrl-C while Rust works |
// `cargo test --workspace NAME` builds a test of this library although its manifest says it has
// none, and what calls an interpreter does not link without one: then it is empty.
#![cfg(not(test))]
#![allow(non_snake_case)]
// Python passes references to what it owns.
#![allow(clippy::needless_pass_by_value)]

mod algorithms;
mod array;
mod batch;
mod builder;
mod calibration;
mod campaign;
mod collisions;
mod constraints;
mod contact;
mod copies;
mod core;
mod derivatives;
mod dynamics;
mod edit;
mod error;
mod files;
mod formats;
mod frames;
mod inverse_kinematics;
mod log;
mod mechanism;
mod modes;
mod operators;
mod package;
mod parts;
mod patience;
mod processor;
mod robot;
mod rules;
mod running;
mod scene;
mod show;
mod simulate;
mod simulation;
mod state;
mod values;

pub use files::library;
pub use package::fill;
#[doc(hidden)]
pub use pyo3;
