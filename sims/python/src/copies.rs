//! Copies of a `Mechanism`: `copy`, `deepcopy` and `pickle` (and therefore `multiprocessing`).
use crate::core::Core;
use crate::error::{refuse, refuse_with};
use crate::mechanism::Mechanism;
use linkwork_formats::Description;
use linkwork_multibody::Builder;
use linkwork_spatial::Vec3;
use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyTuple};
use serde::{Deserialize, Serialize};
use std::sync::Arc;

/// The complete content of a mechanism.
#[derive(Serialize, Deserialize)]
struct Parts {
    /// Version of the package that wrote it.
    version: String,
    builder: Builder,
    gravity: Vec3,
    initial: Vec<f64>,
    description: Option<Description>,
}

#[pymethods]
impl Mechanism {
    /// Returns a mechanism with the same content and its own gravity.
    fn __copy__(&self) -> PyResult<Self> {
        let mut core = Core::new(self.core.mbs.clone(), self.core.gravity())?;
        core.initial.clone_from(&self.core.initial);
        core.description.clone_from(&self.core.description);
        core.contact.clone_from(&self.core.contact);
        Ok(Self { core: Arc::new(core) })
    }
    /// Like `copy.copy`: the copies do not share mutable data.
    fn __deepcopy__(&self, _memo: &Bound<'_, PyAny>) -> PyResult<Self> {
        self.__copy__()
    }
    /// For `pickle`. Only the same version of the package can read the result.
    fn __reduce__<'py>(
        &self,
        py: Python<'py>,
    ) -> PyResult<(Bound<'py, PyAny>, Bound<'py, PyTuple>)> {
        let parts = Parts {
            version: env!("CARGO_PKG_VERSION").into(),
            builder: Builder::from(&self.core.mbs),
            gravity: self.core.gravity(),
            initial: self.core.initial.clone(),
            description: self.core.description.clone(),
        };
        let bytes = rmp_serde::to_vec_named(&parts).map_err(refuse)?;
        let restore = py.import(crate::package::module())?.getattr("_restore")?;
        Ok((restore, PyTuple::new(py, [PyBytes::new(py, &bytes)])?))
    }
}

/// Restores a mechanism from the content of a pickle.
#[pyfunction]
pub fn _restore(bytes: &[u8]) -> PyResult<Mechanism> {
    let help =
        "only the same version of linkwork can read a pickle; use `to_ron` to store a mechanism";
    let parts: Parts = rmp_serde::from_slice(bytes)
        .map_err(|e| refuse_with(format!("this is not a pickle of a Mechanism: {e}"), help))?;
    let own = env!("CARGO_PKG_VERSION");
    if parts.version != own {
        let fact = format!(
            "the Mechanism was pickled by linkwork {}, but this is linkwork {own}",
            parts.version
        );
        return Err(refuse_with(fact, help));
    }
    let mut core = Core::new(parts.builder.build().map_err(refuse)?, parts.gravity)?;
    if parts.initial.len() != core.nq() || parts.initial.iter().any(|x| !x.is_finite()) {
        return Err(refuse_with(
            "this is not a pickle of a Mechanism: its configuration is not valid",
            help,
        ));
    }
    (core.initial, core.description) = (parts.initial, parts.description);
    Ok(Mechanism { core: Arc::new(core) })
}
