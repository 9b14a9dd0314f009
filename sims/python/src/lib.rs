//! The extension module of the Python package `linkwork`: thin classes over the Rust floors.
//!
//! | file | what |
//! |---|---|
//! | `array` | numpy in and out: shapes and NaN are checked here, nowhere else |
//! | `error` | `LinkworkError` |
//! | `core` | what a mechanism and its states share |
//! | `builder`, `mechanism`, `dynamics`, `state` | `Builder`, `Mechanism`, `State` |
//! | `constraints` | loops and couplings of a `Mechanism` |
//! | `contact` | `Collider`, `Contact`: bodies of a `Mechanism` that touch |
//! | `copies` | `copy` and `pickle` of a `Mechanism` |
//! | `algorithms`, `derivatives` | more algorithms of `Mechanism` |
//! | `batch` | one state or many; threads and lanes |
//! | `inverse_kinematics`, `edit`, `frames` | `Target`, `Edit`, `Frames` |
//! | `operators` | `Operators`, `Operator`: expressions |
//! | `simulate` | a small time integration of one mechanism |
//! | `files`, `formats` | reading files with all component libraries; what a file says besides; URDF and RON out |
//! | `parts` | parts of a simulation that are Python classes |
//! | `simulation`, `running`, `log`, `values` | `Simulation` and its logs |
//! | `campaign`, `patience` | `Campaign`: many runs with drawn values; Ctrl-C while Rust works |
// `cargo test --workspace NAME` builds a test of this library although its manifest says it has
// none, and an extension module does not link without an interpreter: then it is empty.
#![cfg(not(test))]
#![allow(non_snake_case)]
// Python passes references to what it owns.
#![allow(clippy::needless_pass_by_value)]

mod algorithms;
mod array;
mod batch;
mod builder;
mod campaign;
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
mod operators;
mod parts;
mod patience;
mod rules;
mod running;
mod simulate;
mod simulation;
mod state;
mod values;

use pyo3::prelude::*;

/// Mechanisms, their dynamics, simulations and logs: the compiled part of the package `linkwork`.
#[pymodule]
mod _linkwork {
    #[pymodule_export]
    use crate::builder::{Builder, Hinge, Subhinge};
    #[pymodule_export]
    use crate::campaign::{Campaign, Gathering, Outcome, Results};
    #[pymodule_export]
    use crate::constraints::{ConstrainedMotion, Constraint, Rank};
    #[pymodule_export]
    use crate::contact::{Collider, Contact, ContactStep};
    #[pymodule_export]
    use crate::copies::_restore;
    #[pymodule_export]
    use crate::edit::{Edit, Report};
    #[pymodule_export]
    use crate::error::LinkworkError;
    #[pymodule_export]
    use crate::frames::Frames;
    #[pymodule_export]
    use crate::inverse_kinematics::{RateTarget, Target};
    #[pymodule_export]
    use crate::log::{Log, Series, read_log};
    #[pymodule_export]
    use crate::mechanism::{Mechanism, Subgraph, load};
    #[pymodule_export]
    use crate::operators::{Operator, Operators};
    #[pymodule_export]
    use crate::simulation::Simulation;
    #[pymodule_export]
    use crate::state::State;
    #[pymodule_export]
    use crate::values::Variable;
    /// Version of the package.
    #[allow(non_upper_case_globals)]
    #[pymodule_export]
    const __version__: &str = env!("CARGO_PKG_VERSION");
}
