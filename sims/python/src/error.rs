//! The one exception of the package, and how Rust's errors become it: with the same text.
use linkwork_runtime::{RunError, VariableError};
use pyo3::exceptions::{PyException, PyMemoryError, PyValueError};
use pyo3::{PyErr, Python};
use std::fmt::Display;

pyo3::create_exception!(
    linkwork,
    LinkworkError,
    PyValueError,
    "What Linkwork refuses: place, fact and remedy, in the words of the Rust error.

>>> linkwork.Hinge.pin([0, 1])
Traceback (most recent call last):
linkwork.LinkworkError: `axis` has the shape (2)
  help: give it the shape (3,)"
);

/// The exception with a text: place, fact, then `\n  help: remedy`.
pub fn refuse(text: impl Display) -> PyErr {
    LinkworkError::new_err(text.to_string().trim_end().to_string())
}

/// A fact and its remedy.
pub fn refuse_with(fact: impl Display, help: impl Display) -> PyErr {
    refuse(format!("{fact}\n  help: {help}"))
}

/// Whether an exception stays what it is: Ctrl-C, no memory, an exit.
pub fn is_own(py: Python<'_>, e: &PyErr) -> bool {
    e.is_instance_of::<PyMemoryError>(py) || !e.is_instance_of::<PyException>(py)
}

/// What was raised in another's code, in this package's words, unless it stays what it is.
pub fn unless_own(py: Python<'_>, e: PyErr, words: impl FnOnce(&PyErr) -> PyErr) -> PyErr {
    if is_own(py, &e) { e } else { words(&e) }
}

/// A run that failed.
pub fn run_failed(e: &RunError) -> PyErr {
    refuse_with(e, format!("try a smaller step, and look at what drives `{}`", e.path))
}

/// A variable that cannot be read or set.
pub fn no_variable(e: &VariableError) -> PyErr {
    refuse(e)
}
