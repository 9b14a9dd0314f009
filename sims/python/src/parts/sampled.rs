//! Sampled parts: `step` at the rate of the part.
use super::part::{Saves, unsaved};
use super::{Class, as_part, call, exception, ports, told};
use crate::error::refuse_with;
use linkwork_runtime::{Block, Description, EvalTime, Outcome, PortSpec, Value, Wiring};
use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyDict};
use std::any::Any;

/// The object of a run.
enum PartObject {
    /// Not created yet; with the saved state to load.
    Not(Vec<u8>),
    Yes(Py<PyAny>),
}

pub(super) struct Sampled {
    made: PartObject,
    class: Class,
    params: Value,
    inputs: Vec<PortSpec>,
    outputs: Vec<PortSpec>,
    saves: Saves,
    w: Wiring,
}

impl Sampled {
    pub fn new(class: Class, params: Value, d: &Description, saves: Saves, w: Wiring) -> Self {
        let made = PartObject::Not(Vec::new());
        let (inputs, outputs) = (d.feedthrough_inputs.clone(), d.feedthrough_outputs.clone());
        Sampled { made, class, params, inputs, outputs, saves, w }
    }

    /// Returns the object. It is created at the first call.
    fn object<'py>(&mut self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        if let PartObject::Not(saved) = &self.made {
            let made = self.class.object(py, &self.params)?;
            if !saved.is_empty() {
                made.call_method1("load", (unpack(py, saved)?,))?;
            }
            self.made = PartObject::Yes(made.unbind());
        }
        match &self.made {
            PartObject::Yes(made) => Ok(made.bind(py).clone()),
            PartObject::Not(_) => Err(refuse_with(
                "the object of a Python part is missing",
                "report this as a bug in Linkwork",
            )),
        }
    }

    fn call(&mut self, py: Python<'_>, t: f64, sig: &mut [f64]) -> Outcome {
        let name = self.class.name.clone();
        let given = ports::values(py, &self.inputs, |k| sig[self.w.ud[k] as usize])
            .map_err(|e| exception(py, &name, "its inputs", e))?;
        let object =
            self.object(py).map_err(|e| exception(py, &name, "`__init__` or `load`", e))?;
        let to = &mut sig[self.w.yd..];
        call(&object, &name, "step", (t, given), ("outputs", &self.outputs), to)
    }

    fn saved(&self) -> Result<Vec<u8>, String> {
        match self.saves {
            Saves::Own => {}
            Saves::Nothing => return Ok(Vec::new()),
            Saves::Not => return Err(unsaved(&self.class.name)),
        }
        match &self.made {
            PartObject::Not(saved) => Ok(saved.clone()),
            PartObject::Yes(object) => Python::attach(|py| {
                let packed = object.bind(py).call_method0("save").and_then(|v| pack(&v));
                packed.map_err(|e| format!("`save` of `{}`: {}", self.class.name, told(py, &e)))
            }),
        }
    }
}

/// Converts the result of `save` to bytes: unchanged, or as JSON.
fn pack(value: &Bound<'_, PyAny>) -> PyResult<Vec<u8>> {
    if let Ok(bytes) = value.cast::<PyBytes>() {
        return Ok([b"b", bytes.as_bytes()].concat());
    }
    let json = value.py().import("json")?;
    let options = PyDict::new(value.py());
    options.set_item("allow_nan", false)?;
    let text: String = json.call_method("dumps", (value,), Some(&options))?.extract()?;
    Ok([b"j", text.as_bytes()].concat())
}

fn unpack<'py>(py: Python<'py>, bytes: &[u8]) -> PyResult<Bound<'py, PyAny>> {
    match bytes.split_first() {
        Some((b'b', rest)) => Ok(PyBytes::new(py, rest).into_any()),
        Some((b'j', rest)) => {
            let text = String::from_utf8_lossy(rest);
            py.import("json")?.call_method1("loads", (&*text,))
        }
        _ => Err(refuse_with(
            "the saved state of a Python part is corrupt",
            "use another checkpoint",
        )),
    }
}

impl Block for Sampled {
    fn outputs(&mut self, _: &EvalTime, _: &[f64], _: &[f64], _: &mut [f64]) -> Outcome {
        Ok(())
    }
    /// Runs once per sample: sampled parts are not evaluated at stages of the integrator.
    fn feedthrough(&mut self, now: &EvalTime, _: &[f64], _: &[f64], sig: &mut [f64]) -> Outcome {
        as_part(|py| self.call(py, now.t, sig))
    }
    fn derivatives(
        &mut self,
        _: &EvalTime,
        _: &[f64],
        _: &[f64],
        _: &[f64],
        _: &mut [f64],
    ) -> Outcome {
        Ok(())
    }
    fn update(&mut self, _: &EvalTime, _: &[f64], _: &mut [f64], _: &[f64]) -> Outcome {
        Ok(())
    }
    fn save_store(&self) -> Result<Vec<u8>, String> {
        self.saved()
    }
    fn load_store(&mut self, bytes: &[u8]) -> Result<(), String> {
        self.made = PartObject::Not(bytes.to_vec());
        // The object is created now, so that an error in `load` is reported here and not at the next
        // sample.
        Python::attach(|py| {
            self.object(py)
                .map(|_| ())
                .map_err(|e| format!("`load` of `{}`: {}", self.class.name, told(py, &e)))
        })
    }
    fn copy_store(&self, into: &mut Option<Box<dyn Any + Send>>) {
        // An exception in `save` is reported by `save_store`, which every checkpoint and fork calls first.
        *into = self.saved().ok().map(|s| Box::new(s) as Box<dyn Any + Send>);
    }
    fn take_store(&mut self, from: &dyn Any) {
        if let Some(saved) = from.downcast_ref::<Vec<u8>>() {
            self.made = PartObject::Not(saved.clone());
        }
    }
    fn fork(&self) -> Box<dyn Block> {
        Box::new(Sampled {
            made: PartObject::Not(self.saved().unwrap_or_default()),
            class: Python::attach(|py| self.class.copy(py)),
            params: self.params.clone(),
            inputs: self.inputs.clone(),
            outputs: self.outputs.clone(),
            saves: self.saves,
            w: self.w.clone(),
        })
    }
}
