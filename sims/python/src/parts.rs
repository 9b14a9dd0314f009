//! Parts that are Python classes, for prototypes of controllers and planners. They are sampled and run at their position in the evaluation order.
//!
//! ```python
//! class Pd:
//!     """Holds an angle."""
//!     inputs = {"angle": "rad", "rate": "rad/s"}
//!     outputs = {"torque": "N m"}
//!     stateless = True
//!     def __init__(self, stiffness=10.0, damping=1.0):
//!         self.k, self.d = stiffness, damping
//!     def step(self, t, u):
//!         return {"torque": -self.k * u["angle"] - self.d * u["rate"]}
//!
//! lw.Simulation("sim.ron", models={"demo.pd": Pd})
//! ```
//! In place of a unit, a port can have `"bool"` or the quantity to which it binds under its own name: `"hinge state"` [angle, rate], `"node state"`
//! [position, rotation x y z w, angular velocity, velocity], `"node acceleration"` [angular, linear], `"hinge load"` [force, moment] of a body's
//! hinge in the axes of its frame; as outputs `"hinge torque"`, `"hinge acceleration"`, `"wrench"` [moment, force]. World axes, SI units.
//!
//! Each run has its own object for each part. Data that `step` stores in `self` are state of the run: `save()` returns them (bytes, text, or JSON
//! data) and `load(saved)` restores them. Without these two methods and without `stateless = True`, checkpoints and forks are rejected.
use crate::array::{Input, out1};
use crate::error::{is_own, refuse_with};
use crate::values::object;
use crate::values::pairs;
use linkwork_runtime::{
    Block, Description, Entry, EvalTime, Failure, Functions, Located, Making, Outcome, PortKind,
    PortSpec, Prototype, ReadCx, Unit, Value, Wiring, remedy,
};
use pyo3::prelude::*;
use pyo3::types::{PyBool, PyBytes, PyDict, PyFloat, PyString, PyType};
use std::any::Any;
use std::cell::{Cell, RefCell};
use std::sync::Arc;

thread_local! {
    /// The last exception that a part raised in this thread, until it is raised again.
    static RAISED: RefCell<Option<PyErr>> = const { RefCell::new(None) };
    /// Whether a part runs in this thread.
    static INSIDE: Cell<bool> = const { Cell::new(false) };
}

/// Returns whether a part runs in this thread. The simulation that runs it is then not accessible.
pub fn inside() -> bool {
    INSIDE.get()
}

/// Returns `error` with the exception of a part as its cause. Exceptions that are not errors of the part (Ctrl-C, out of memory, exit) are returned
/// unchanged.
pub fn raised(py: Python<'_>, error: PyErr) -> PyErr {
    let Some(cause) = RAISED.take() else { return error };
    if is_own(py, &cause) {
        return cause;
    }
    error.set_cause(py, Some(cause));
    error
}

/// Reads `models={name: class}`.
pub fn entries(given: Option<&Bound<'_, PyDict>>) -> PyResult<Vec<Entry>> {
    let Some(given) = given else { return Ok(Vec::new()) };
    let one = |(name, class): (Bound<'_, PyAny>, Bound<'_, PyAny>)| {
        let name: String = name.extract().map_err(|_| {
            refuse_with(
                "a name in `models` is not a string",
                "write {\"my.controller\": Controller}",
            )
        })?;
        let class = class.cast_into::<PyType>().map_err(|_| {
            refuse_with(
                format!("`models[\"{name}\"]` is not a class"),
                "give the class, not an instance",
            )
        })?;
        if !class.hasattr("step")? {
            let fact = format!("`{name}`: class `{}` has no `step`", class.name()?);
            return Err(refuse_with(fact, "write `def step(self, t, u): return {output: value}`"));
        }
        let doc = class.getattr("__doc__")?.extract::<Option<String>>().ok().flatten();
        let description = Description {
            name: name.clone().into(),
            doc: doc.unwrap_or_else(|| "A part in Python.".into()).into(),
            ..Description::default()
        };
        Ok(Entry::given(description, Arc::new(Class { name, class: class.unbind() })))
    };
    pairs(given).into_iter().map(one).collect()
}

struct Class {
    name: String,
    class: Py<PyType>,
}

/// Fact and remedy.
type Problem = (String, Option<String>);

fn told(py: Python<'_>, e: &PyErr) -> String {
    let text = e.value(py).to_string();
    let kind = e.get_type(py).name().map_or_else(|_| "error".into(), |n| n.to_string());
    if text.is_empty() { kind } else { format!("{kind}: {text}") }
}

impl Class {
    /// Creates an object with these parameters.
    fn object<'py>(&self, py: Python<'py>, params: &Value) -> PyResult<Bound<'py, PyAny>> {
        let given = object(py, params)?;
        let kwargs = given.cast_into::<PyDict>().unwrap_or_else(|_| PyDict::new(py));
        self.class.bind(py).call((), Some(&kwargs))
    }

    /// Creates the object and reads its description.
    fn described(&self, py: Python<'_>, params: &Value) -> Result<Python_, Problem> {
        let failed = |what: &str, e: &PyErr| (format!("{what}: {}", told(py, e)), None);
        let made = self.object(py, params).map_err(|e| {
            let names = self.parameters(py);
            let help = names.map(|n| format!("parameters of the class: {}", n.join(", ")));
            (format!("its class cannot be called: {}", told(py, &e)), help)
        })?;
        let inputs = ports(&made, "inputs")?;
        let outputs = ports(&made, "outputs")?;
        if let Some(p) = inputs.iter().find(|p| outputs.iter().any(|o| o.name == p.name)) {
            let fact = format!("`{}` is both an input and an output", p.name);
            return Err((fact, Some("rename one of the two".into())));
        }
        let has = |name: &str| made.hasattr(name).map_err(|e| failed(name, &e));
        let stateless = match made.getattr("stateless") {
            Ok(v) => v.is_truthy().map_err(|e| failed("stateless", &e))?,
            Err(_) => false,
        };
        let (save, load) = (has("save")?, has("load")?);
        if save != load {
            let fact = format!("it has only `{}`", if save { "save" } else { "load" });
            return Err((fact, Some("write both: `save(self)` and `load(self, saved)`".into())));
        }
        let description = Description {
            name: self.name.clone().into(),
            functions: Functions {
                feedthrough: true,
                feedthrough_timed: true,
                update: true,
                ..Functions::default()
            },
            feedthrough_inputs: inputs,
            feedthrough_outputs: outputs,
            ..Description::default()
        };
        Ok(Python_ {
            name: self.name.clone(),
            class: self.class.clone_ref(py),
            params: params.clone(),
            description,
            saves: if save {
                Saves::Own
            } else if stateless {
                Saves::Nothing
            } else {
                Saves::Not
            },
        })
    }

    /// Returns the names of the constructor's parameters, if Python can inspect them.
    fn parameters(&self, py: Python<'_>) -> Option<Vec<String>> {
        let inspect = py.import("inspect").ok()?;
        let signature = inspect.call_method1("signature", (self.class.bind(py),)).ok()?;
        let names = signature.getattr("parameters").ok()?.call_method0("keys").ok()?;
        names.try_iter().ok()?.map(|n| n.ok()?.extract().ok()).collect()
    }
}

/// Ports that bind to the mechanism under their own names: word, kind, number of values, direction.
const BOUND: [(&str, PortKind, usize, &str); 10] = [
    ("hinge state", PortKind::HingeState, 2, "inputs"),
    ("node state", PortKind::NodeState, 13, "inputs"),
    ("node acceleration", PortKind::NodeAccel, 6, "inputs"),
    ("hinge load", PortKind::HingeLoad, 6, "inputs"),
    ("hinge torque", PortKind::HingeTorque, 1, "outputs"),
    ("hinge acceleration", PortKind::HingeAccel, 1, "outputs"),
    ("wrench", PortKind::Wrench, 6, "outputs"),
    ("ball state", PortKind::BallState, 7, "inputs"),
    ("ball torque", PortKind::BallTorque, 3, "outputs"),
    ("surface velocity", PortKind::SurfaceVelocity, 3, "outputs"),
];

/// Reads `{name: unit}` or `{name: (unit, lanes)}`.
fn ports(made: &Bound<'_, PyAny>, which: &str) -> Result<Vec<PortSpec>, Problem> {
    let help = || {
        Some(format!("write {which} = {{\"angle\": \"rad\", \"rates\": (\"rad/s\", 3)}}, or {{}}"))
    };
    let Ok(given) = made.getattr(which) else {
        return Err((format!("it has no `{which}`"), help()));
    };
    let Ok(given) = given.cast_into::<PyDict>() else {
        return Err((format!("its `{which}` is not a dict"), help()));
    };
    let mut all = Vec::new();
    for (name, port) in pairs(&given) {
        let wrong = || (format!("its `{which}` have `{name}: {port}`"), help());
        let name: String = name.extract().map_err(|_| wrong())?;
        let plain = !name.is_empty() && name.chars().all(|c| c.is_alphanumeric() || c == '_');
        if !plain {
            let fact = format!("`{name}` is not a valid port name");
            return Err((fact, Some("use letters, digits and `_`".into())));
        }
        let (unit, lanes) = match port.extract::<String>() {
            Ok(unit) => (unit, 1),
            Err(_) => port.extract::<(String, usize)>().map_err(|_| wrong())?,
        };
        if !(1..=100_000).contains(&lanes) {
            return Err((format!("`{name}` has {lanes} numbers"), Some("from 1 to 100000".into())));
        }
        let bound = BOUND.iter().find(|b| b.0 == unit);
        if let Some((_, kind, n, of)) = bound {
            if *of != which {
                let fact = format!("`{name}`: the kind \"{unit}\" is only possible in `{of}`");
                return Err((fact, Some(format!("declare it in `{of}`"))));
            }
            let mut port = PortSpec::named(name.clone(), *kind, *n);
            port.bind = Some(name.into());
            all.push(port);
            continue;
        }
        if unit == "bool" {
            all.push(PortSpec::named(name, PortKind::Bool, 1));
            continue;
        }
        Unit::parse(&unit).map_err(|e| {
            let kinds: Vec<&str> = BOUND.iter().filter(|b| b.3 == which).map(|b| b.0).collect();
            let help = format!(
                "give a unit, \"bool\", or a kind that binds to the mechanism: {}",
                kinds.join(", ")
            );
            (format!("`{name}`: {e}"), Some(help))
        })?;
        all.push(PortSpec::named(name, PortKind::Numbers, lanes).unit_of(unit));
    }
    Ok(all)
}

impl Making for Class {
    fn describe(&self, params: &Located) -> Option<Description> {
        let value = plain(params);
        Python::attach(|py| self.described(py, &value).ok().map(|p| p.description))
    }
    fn make(&self, params: &Located, cx: &mut ReadCx<'_>) -> Option<Box<dyn Prototype>> {
        let value = plain(params);
        match Python::attach(|py| self.described(py, &value)) {
            Ok(made) => Some(Box::new(made)),
            Err((fact, help)) => {
                cx.fault(params.origin, format!("`{}` ({}): {fact}", cx.path, self.name), help);
                None
            }
        }
    }
}

/// Returns the parameters as a map.
fn plain(params: &Located) -> Value {
    match &params.value {
        Value::Map(_) => params.value.clone(),
        _ => Value::Map(Vec::new()),
    }
}

#[derive(Clone, Copy, PartialEq, Eq)]
enum Saves {
    /// The part has its own `save` and `load`.
    Own,
    /// `stateless = True`: the part does not have state.
    Nothing,
    /// The class does not define how its state is saved.
    Not,
}

/// A part in Python with its parameters.
struct Python_ {
    name: String,
    class: Py<PyType>,
    params: Value,
    description: Description,
    saves: Saves,
}

impl Prototype for Python_ {
    fn description(&self) -> &Description {
        &self.description
    }
    fn params(&self) -> &Value {
        &self.params
    }
    fn initial(&self, _: &mut [f64], _: &mut [f64]) {}
    fn stored(&self) -> bool {
        self.saves != Saves::Nothing
    }
    fn can_save(&self) -> Result<(), String> {
        match self.saves {
            Saves::Own | Saves::Nothing => Ok(()),
            Saves::Not => Err(unsaved(&self.name)),
        }
    }
    fn block(&self, w: Wiring) -> Box<dyn Block> {
        let (inputs, outputs) = (
            self.description.feedthrough_inputs.clone(),
            self.description.feedthrough_outputs.clone(),
        );
        let class = Python::attach(|py| self.class.clone_ref(py));
        let class = Class { name: self.name.clone(), class };
        Box::new(Running {
            made: PartObject::Not(Vec::new()),
            class,
            params: self.params.clone(),
            inputs,
            outputs,
            saves: self.saves,
            w,
        })
    }
}

fn unsaved(name: &str) -> String {
    format!(
        "the Python class of `{name}` does not define how its state is saved\n  help: give it `save(self)` and \
         `load(self, saved)`, or set `stateless = True` in it"
    )
}

/// The object of a run.
enum PartObject {
    /// Not created yet; with the saved state to load.
    Not(Vec<u8>),
    Yes(Py<PyAny>),
}

struct Running {
    made: PartObject,
    class: Class,
    params: Value,
    inputs: Vec<PortSpec>,
    outputs: Vec<PortSpec>,
    saves: Saves,
    w: Wiring,
}

/// Returns the failure for an error in a Python part.
fn failure(message: String, help: &str) -> Box<Failure> {
    Box::new(Failure { message, help: Some(help.into()) })
}

impl Running {
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
        let failed = |what: &str, e: PyErr| {
            let message =
                format!("its class `{}` raised in {what}: {}", self.class.name, told(py, &e));
            RAISED.set(Some(e));
            failure(message, "see the exception that caused this one")
        };
        let (mut lane, given) = (0, PyDict::new(py));
        for port in &self.inputs {
            let lanes = &self.w.ud[lane..lane + port.lanes];
            let at = |k: usize| sig[lanes[k] as usize];
            let value = match (port.kind, port.lanes) {
                (PortKind::Bool, _) => PyBool::new(py, at(0) > 0.5).to_owned().into_any(),
                (_, 1) => PyFloat::new(py, at(0)).into_any(),
                (_, n) => out1(py, (0..n).map(at).collect()).into_any(),
            };
            given.set_item(&*port.name, value).map_err(|e| failed("its inputs", e))?;
            lane += port.lanes;
        }
        let object = match self.object(py) {
            Ok(object) => object,
            Err(e) => {
                let message = format!("its class `{}` raised: {}", self.class.name, told(py, &e));
                RAISED.set(Some(e));
                return Err(failure(message, "see the exception that caused this one"));
            }
        };
        let name = &self.class.name;
        let answer = match object.call_method1("step", (t, given)) {
            Ok(answer) => answer,
            Err(e) => {
                let message = format!("its class `{name}` raised in `step`: {}", told(py, &e));
                RAISED.set(Some(e));
                return Err(failure(message, "see the exception that caused this one"));
            }
        };
        let help = format!(
            "return a dict with {}",
            self.outputs.iter().map(|p| format!("\"{}\"", p.name)).collect::<Vec<_>>().join(", ")
        );
        if self.outputs.is_empty() && answer.is_none() {
            return Ok(());
        }
        let Ok(answer) = answer.cast_into::<PyDict>() else {
            return Err(failure(format!("`step` of `{name}` did not return a dict"), &help));
        };
        let known: Vec<&str> = self.outputs.iter().map(|p| &*p.name).collect();
        for key in answer.keys() {
            let key = key.to_string();
            if !known.contains(&key.as_str()) {
                let message =
                    format!("`step` of `{name}` returned `{key}`, which is not an output");
                return Err(failure(message, &remedy(&key, "outputs", &known)));
            }
        }
        let mut at = self.w.yd;
        for port in &self.outputs {
            let Ok(Some(value)) = answer.get_item(&*port.name) else {
                let message =
                    format!("`step` of `{name}` did not return the output `{}`", port.name);
                return Err(failure(message, &help));
            };
            number(&value, port, &mut sig[at..at + port.lanes])
                .map_err(|e| failure(format!("`step` of `{name}`: `{}` {e}", port.name), &help))?;
            at += port.lanes;
        }
        Ok(())
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

/// Writes a number, truth value or array into the slots of a port.
fn number(value: &Bound<'_, PyAny>, port: &PortSpec, to: &mut [f64]) -> Result<(), String> {
    if port.lanes == 1 {
        let x = match value.cast::<PyBool>() {
            Ok(b) => f64::from(u8::from(b.is_true())),
            Err(_) if value.is_instance_of::<PyString>() => return Err("is a string".into()),
            Err(_) => value.extract::<f64>().map_err(|_| "is not a number".to_string())?,
        };
        if !x.is_finite() {
            return Err(format!("is {x}"));
        }
        to[0] = x;
        return Ok(());
    }
    let given =
        Input::read(value, &port.name).map_err(|e| format!("is not an array of numbers: {e}"))?;
    if given.slice().len() != port.lanes {
        return Err(format!("has {} numbers, not {}", given.slice().len(), port.lanes));
    }
    to.copy_from_slice(given.slice());
    Ok(())
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

impl Block for Running {
    fn outputs(&mut self, _: &EvalTime, _: &[f64], _: &[f64], _: &mut [f64]) -> Outcome {
        Ok(())
    }
    /// Runs once per sample: sampled parts are not evaluated at stages of the integrator.
    fn feedthrough(&mut self, now: &EvalTime, _: &[f64], _: &[f64], sig: &mut [f64]) -> Outcome {
        Python::attach(|py| {
            let before = INSIDE.replace(true);
            let outcome = self.call(py, now.t, sig);
            INSIDE.set(before);
            outcome
        })
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
        let class = Python::attach(|py| self.class.class.clone_ref(py));
        Box::new(Running {
            made: PartObject::Not(self.saved().unwrap_or_default()),
            class: Class { name: self.class.name.clone(), class },
            params: self.params.clone(),
            inputs: self.inputs.clone(),
            outputs: self.outputs.clone(),
            saves: self.saves,
            w: self.w.clone(),
        })
    }
}
