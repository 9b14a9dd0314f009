//! The exception of the package, and the conversion of Rust errors to it, with the same message.
use linkwork_runtime::{RunError, VariableError};
use pyo3::exceptions::{PyException, PyMemoryError, PyValueError};
use pyo3::{PyErr, Python};
use std::fmt::Display;

pyo3::create_exception!(
    linkwork,
    LinkworkError,
    PyValueError,
    "Raised for all invalid arguments and failed computations. The message states where the mistake is, what is wrong, and the remedy.

>>> linkwork.Hinge.pin([0, 1])
Traceback (most recent call last):
linkwork.LinkworkError: `axis` has the shape (2)
  help: give it the shape (3,)"
);

/// Returns the exception with a message: position, fact, then `\n  help: remedy`.
pub fn refuse(text: impl Display) -> PyErr {
    LinkworkError::new_err(text.to_string().trim_end().to_string())
}

/// Returns the exception with a fact and its remedy.
pub fn refuse_with(fact: impl Display, help: impl Display) -> PyErr {
    refuse(format!("{fact}\n  help: {help}"))
}

/// Returns whether an exception must not be converted: Ctrl-C, out of memory, exit.
pub fn is_own(py: Python<'_>, e: &PyErr) -> bool {
    e.is_instance_of::<PyMemoryError>(py) || !e.is_instance_of::<PyException>(py)
}

/// Converts an exception from foreign code to an exception of this package, unless [`is_own`] holds.
pub fn unless_own(py: Python<'_>, e: PyErr, words: impl FnOnce(&PyErr) -> PyErr) -> PyErr {
    if is_own(py, &e) { e } else { words(&e) }
}

/// Converts the error of a failed run.
pub fn run_failed(e: &RunError) -> PyErr {
    refuse_with(e, format!("try a smaller step, and check the inputs of `{}`", e.path))
}

/// Converts the error for a variable that cannot be read or set.
pub fn no_variable(e: &VariableError) -> PyErr {
    refuse(e)
}
