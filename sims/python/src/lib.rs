//! The extension module of the Python package `linkwork`: thin classes over the Rust floors.
//!
//! | file | what |
//! |---|---|
//! | `array` | numpy in and out: shapes and NaN are checked here, nowhere else |
//! | `error` | `LinkworkError` |
//! | `core` | what a mechanism and its states share |
//! | `builder`, `mechanism`, `dynamics`, `state` | `Builder`, `Mechanism`, `State` |
//! | `files` | reading RON with all component libraries |
#![allow(non_snake_case)]
// Python passes references to what it owns.
#![allow(clippy::needless_pass_by_value)]

mod array;
mod batch;
mod builder;
mod core;
mod dynamics;
mod error;
mod files;
mod mechanism;
mod state;

use pyo3::prelude::*;

/// Mechanisms, their dynamics, simulations and logs: the compiled part of the package `linkwork`.
#[pymodule]
mod _linkwork {
    #[pymodule_export]
    use crate::builder::{Builder, Hinge, Subhinge};
    #[pymodule_export]
    use crate::error::LinkworkError;
    #[pymodule_export]
    use crate::mechanism::{Mechanism, Subgraph, load};
    #[pymodule_export]
    use crate::state::State;
}
