//! The compiled part of a Python package: thin classes over the Rust crates.
//!
//! The package `linkwork` is `sims/python/module`. A model library can have its own package, which contains
//! everything of this package and its own models: a crate with `crate-type = ["cdylib"]` and [`module!`].
//!
//! | file | what |
//! |---|---|
//! | `array` | conversion of numpy arrays; all checks of shapes and NaN are here |
//! | `error` | `LinkworkError` |
//! | `core` | shared data of a mechanism and its states |
//! | `hinge`, `builder`, `mechanism`, `subgraph`, `dynamics`, `state` | `Hinge`, `Builder`, `Mechanism`, `Subgraph`, `State` |
//! | `constraints` | loops and couplings of a `Mechanism` |
//! | `contact` | `Collider`, `Contact`: contact of the bodies of a `Mechanism` |
//! | `collisions` | `Collisions`: collision queries of a robot with itself and with obstacles |
//! | `robot` | `Robot`: the embedded robot model |
//! | `copies` | `copy` and `pickle` of a `Mechanism` |
//! | `algorithms`, `derivatives`, `calibration` | further algorithms of `Mechanism` |
//! | `batch` | evaluation of one state or many; threads and SIMD lanes |
//! | `inverse_kinematics`, `edit`, `frames` | `Target`, `Edit`, `Frames` |
//! | `operators` | `Operators`, `Operator`: symbolic expressions |
//! | `simulate` | `Mechanism.simulate`: time integration of one mechanism |
//! | `files`, `formats` | reading files with all component libraries; further content of a file; export to URDF and RON |
//! | `parts` | parts of a simulation that are Python classes: sampled and continuous |
//! | `command_line` | `python -m linkwork` |
//! | `simulation`, `running`, `log`, `values` | `Simulation` and its logs |
//! | `scene` | the shapes of bodies, for `show` in Rerun |
//! | `show` | text and HTML representations of `Mechanism` and `Simulation` |
//! | `package` | name, models and module of the package |
//! | `processor` | processor levels of a build |
//! | `campaign`, `patience` | `Campaign`: many runs with drawn values; handling of Ctrl-C during long calls |
// `cargo test --workspace NAME` builds a test of this library although its manifest disables tests. It would not
// link without a Python interpreter, so the crate is empty then.
#![cfg(not(test))]
#![allow(non_snake_case)]
// Arguments from Python are references to objects that Python owns.
#![allow(clippy::needless_pass_by_value)]

mod algorithms;
mod array;
mod batch;
mod builder;
mod calibration;
mod campaign;
mod collisions;
mod command_line;
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
mod hinge;
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
mod subgraph;
mod values;

pub use files::library;
pub use package::fill;
#[doc(hidden)]
pub use pyo3;
