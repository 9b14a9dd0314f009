//! The package: its models, and the module that contains its classes.
use crate::builder::Builder;
use crate::calibration::{Calibration, Identifiable};
use crate::campaign::{Campaign, Gathering, Outcome, Results};
use crate::collisions::Collisions;
use crate::constraints::{ConstrainedMotion, Constraint, Rank};
use crate::contact::{Collider, Contact, ContactStep};
use crate::edit::{Edit, Report};
use crate::error::LinkworkError;
use crate::frames::Frames;
use crate::hinge::{Hinge, Subhinge};
use crate::inverse_kinematics::{RateTarget, Target};
use crate::log::{Log, Series};
use crate::mechanism::Mechanism;
use crate::modes::Modes;
use crate::operators::{Operator, Operators};
use crate::robot::{Grip, InverseKinematicsSearch, Robot, Trajectory, WholeBodyForces};
use crate::simulation::Simulation;
use crate::state::State;
use crate::subgraph::Subgraph;
use crate::values::Variable;
use linkwork_runner::Library;
use pyo3::prelude::*;
use pyo3::types::PyType;
use std::sync::OnceLock;

/// The package of this shared library: a function that returns the model library, and the name of the module.
static PACKAGE: OnceLock<(fn() -> Library, String)> = OnceLock::new();

/// Returns all models and assemblies that a simulation can name.
pub fn library() -> Library {
    match PACKAGE.get() {
        Some((library, _)) => library(),
        None => crate::files::library(),
    }
}

/// Returns the name of the module: `linkwork._linkwork`.
pub fn module() -> &'static str {
    PACKAGE.get().map_or("linkwork._linkwork", |p| &p.1)
}

/// Defines the compiled part of a Python package: all classes of the package `linkwork`, with the models of a `fn() -> Library`. The module is named
/// `_linkwork` in any package; its `__version__` is that of the crate that calls the macro.
///
/// ```ignore
/// linkwork_python::module!(windmill::library);
/// ```
#[macro_export]
macro_rules! module {
    ($library:path) => {
        /// Mechanisms, their dynamics, simulations and logs: the compiled part of a package.
        #[$crate::pyo3::pymodule]
        #[pyo3(crate = "linkwork_python::pyo3")]
        fn _linkwork(
            module: &$crate::pyo3::Bound<'_, $crate::pyo3::types::PyModule>,
        ) -> $crate::pyo3::PyResult<()> {
            $crate::fill(module, $library, env!("CARGO_PKG_VERSION"))
        }
    };
}

/// Adds all classes and functions to the module of a package; see [`module!`].
///
/// # Errors
/// Errors of the interpreter.
pub fn fill(module: &Bound<'_, PyModule>, library: fn() -> Library, version: &str) -> PyResult<()> {
    let name: String = module.name()?.extract()?;
    let package = name.rsplit_once('.').map_or(name.as_str(), |(package, _)| package).to_string();
    // Loading the module again does not change the library.
    PACKAGE.get_or_init(|| (library, name));
    macro_rules! classes {
        ($($class:ty),*) => { $(module.add_class::<$class>()?;)* };
    }
    classes!(Builder, Hinge, Modes, Subhinge, Campaign, Gathering, Outcome, Results);
    classes!(ConstrainedMotion, Constraint, Rank, Collider, Collisions, Contact, ContactStep);
    classes!(Edit, Report, Frames, RateTarget, Target, Grip, Robot, Log, Series);
    classes!(Calibration, Identifiable, InverseKinematicsSearch, Trajectory, WholeBodyForces);
    classes!(Mechanism, Subgraph, Operator, Operators, Simulation, State, Variable);
    module.add("LinkworkError", module.py().get_type::<LinkworkError>())?;
    module.add_function(wrap_pyfunction!(crate::command_line::_main, module)?)?;
    module.add_function(wrap_pyfunction!(crate::copies::_restore, module)?)?;
    module.add_function(wrap_pyfunction!(crate::log::read_log, module)?)?;
    module.add_function(wrap_pyfunction!(crate::robot::support_polygon, module)?)?;
    module.add_function(wrap_pyfunction!(crate::robot::support_margin, module)?)?;
    module.add_function(wrap_pyfunction!(crate::mechanism::load, module)?)?;
    module.add_function(wrap_pyfunction!(crate::processor::_levels, module)?)?;
    module.add("__version__", version)?;
    module.add("__cpu__", crate::processor::BUILT_FOR)?;
    // `__module__` becomes the package in which users find a class, such as `windmill.Mechanism`.
    for (_, value) in module.dict().iter() {
        if let Ok(class) = value.cast::<PyType>() {
            class.setattr("__module__", &package)?;
        }
    }
    Ok(())
}
