//! Parts that are Python classes, for prototypes of controllers, planners and physical models.
//!
//! ```python
//! class Pd:                                     # sampled: `step` is called at the rate of the part
//!     """Holds an angle."""
//!     inputs = {"angle": "rad", "rate": "rad/s"}
//!     outputs = {"torque": "N m"}
//!     stateless = True
//!     def __init__(self, stiffness=10.0, damping=1.0):
//!         self.k, self.d = stiffness, damping
//!     def step(self, t, u):
//!         return {"torque": -self.k * u["angle"] - self.d * u["rate"]}
//!
//! class Winding:                                # continuous: the integrator of the run calls both methods
//!     """Current of a motor winding."""
//!     inputs = {"voltage": "V"}
//!     outputs = {"current": "A"}
//!     states = {"i": "A"}
//!     direct_feedthrough = False
//!     def evaluate(self, t, x):
//!         return {"current": x["i"]}
//!     def derivatives(self, t, x, u):
//!         return {"i": (u["voltage"] - 2.0 * x["i"]) / 0.01}
//!
//! lw.Simulation("sim.ron", models={"demo.pd": Pd, "demo.winding": Winding})
//! ```
//! In place of a unit, a port can have `"bool"` or the quantity to which it binds under its own name ([`ports::BOUND`]). World axes, SI units.
//!
//! Each run has its own object for each part. Data that `step` stores in `self` are state of the run: `save()` returns them (bytes, text, or JSON
//! data) and `load(saved)` restores them. Checkpoints and forks of a part without these two methods are rejected unless it has `stateless = True`. A continuous
//! part is a function of time, `states` and inputs, and keeps nothing else.
use crate::core::lock;
use crate::error::{is_own, refuse_with};
use crate::values::{object, pairs};
use linkwork_runtime::{
    Description, Entry, Failure, Functions, Located, Making, ParamSpec, PortSpec, Prototype,
    ReadCx, Value,
};
use part::{Part, Saves};
use pyo3::prelude::*;
use pyo3::types::{PyBool, PyDict, PyType};
use std::cell::{Cell, RefCell};
use std::collections::BTreeSet;
use std::sync::{Arc, Mutex};

mod continuous;
mod part;
mod ports;
mod sampled;

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

/// Calls `f` with the interpreter, as a part of a run.
fn as_part<R>(f: impl FnOnce(Python<'_>) -> R) -> R {
    Python::attach(|py| {
        let before = INSIDE.replace(true);
        let result = f(py);
        INSIDE.set(before);
        result
    })
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
        let sampled = class.hasattr("step")?;
        if sampled == (class.hasattr("evaluate")? || class.hasattr("derivatives")?) {
            let class = class.name()?;
            let fact = match sampled {
                true => format!(
                    "`{name}`: class `{class}` has `step`, and also `evaluate` or `derivatives`"
                ),
                false => {
                    format!("`{name}`: class `{class}` has no `step`, `evaluate` or `derivatives`")
                }
            };
            let help = "write `def step(self, t, u): return {output: value}` for a sampled part, or `evaluate(self, t, x, u)` and `derivatives(self, t, x, u)` for a continuous part";
            return Err(refuse_with(fact, help));
        }
        let doc = class.getattr("__doc__")?.extract::<Option<String>>().ok().flatten();
        let description = Description {
            name: name.clone().into(),
            doc: doc.unwrap_or_else(|| "A part in Python.".into()).into(),
            params: parameters(&class).unwrap_or_default(),
            ..Description::default()
        };
        Ok(Entry::given(description, Arc::new(Class { name, class: class.unbind(), sampled })))
    };
    pairs(given).into_iter().map(one).collect()
}

/// Returns the parameters of a class's constructor, if Python can inspect them.
fn parameters(class: &Bound<'_, PyType>) -> PyResult<Vec<ParamSpec>> {
    let inspect = class.py().import("inspect")?;
    let empty = inspect.getattr("Parameter")?.getattr("empty")?;
    let signature = inspect.call_method1("signature", (class,))?;
    let all = signature.getattr("parameters")?.call_method0("values")?;
    let mut specs = Vec::new();
    for parameter in all.try_iter()? {
        let parameter = parameter?;
        // `*args` and `**kwargs` have no names.
        if matches!(parameter.getattr("kind")?.str()?.to_str()?, "VAR_POSITIONAL" | "VAR_KEYWORD") {
            continue;
        }
        let default = parameter.getattr("default")?;
        let value = match default.extract::<f64>() {
            _ if default.is(&empty) => None,
            _ if default.is_instance_of::<PyBool>() => Some(Value::Bool(default.is_truthy()?)),
            Ok(number) => Some(Value::Number(number)),
            Err(_) if default.is_none() => Some(Value::Null),
            Err(_) => Some(Value::Text(default.str()?.extract()?)),
        };
        specs.push(ParamSpec {
            name: lasting(parameter.getattr("name")?.extract()?),
            unit: None,
            doc: "",
            range: None,
            default: value,
            kind: "value".into(),
            fields: Vec::new(),
            service: false,
            slider: None,
            needs: None,
        });
    }
    Ok(specs)
}

/// Returns a name that lasts as long as the process; equal names share memory.
fn lasting(name: String) -> &'static str {
    static NAMES: Mutex<BTreeSet<&'static str>> = Mutex::new(BTreeSet::new());
    let mut names = lock(&NAMES);
    if let Some(known) = names.get(name.as_str()) {
        return known;
    }
    let name: &'static str = name.leak();
    names.insert(name);
    name
}

struct Class {
    name: String,
    class: Py<PyType>,
    /// The class has `step`; otherwise it has `evaluate` or `derivatives`.
    sampled: bool,
}

/// Fact and remedy.
type Problem = (String, Option<String>);

/// Returns kind, text, and place of an exception: `ValueError: no map (planner.py:12)`.
fn told(py: Python<'_>, e: &PyErr) -> String {
    let text = e.value(py).to_string();
    let kind = e.get_type(py).name().map_or_else(|_| "error".into(), |n| n.to_string());
    let place = place(py, e).map_or(String::new(), |place| format!(" ({place})"));
    if text.is_empty() { format!("{kind}{place}") } else { format!("{kind}: {text}{place}") }
}

/// Returns the file and line that raised an exception.
fn place(py: Python<'_>, e: &PyErr) -> Option<String> {
    let mut last = e.traceback(py)?.into_any();
    while let Ok(next) = last.getattr("tb_next") {
        if next.is_none() {
            break;
        }
        last = next;
    }
    let code = last.getattr("tb_frame").ok()?.getattr("f_code").ok()?;
    let file: String = code.getattr("co_filename").ok()?.extract().ok()?;
    let name = std::path::Path::new(&file).file_name()?.to_string_lossy().into_owned();
    let line: u32 = last.getattr("tb_lineno").ok()?.extract().ok()?;
    Some(format!("{name}:{line}"))
}

impl Class {
    fn copy(&self, py: Python<'_>) -> Class {
        Class { name: self.name.clone(), class: self.class.clone_ref(py), sampled: self.sampled }
    }

    /// Creates an object with these parameters.
    fn object<'py>(&self, py: Python<'py>, params: &Value) -> PyResult<Bound<'py, PyAny>> {
        let given = object(py, params)?;
        let kwargs = given.cast_into::<PyDict>().unwrap_or_else(|_| PyDict::new(py));
        self.class.bind(py).call((), Some(&kwargs))
    }

    /// Creates the object and reads its description.
    fn described(&self, py: Python<'_>, params: &Value) -> Result<Part, Problem> {
        let failed = |what: &str, e: &PyErr| (format!("{what}: {}", told(py, e)), None);
        let made = self.object(py, params).map_err(|e| {
            let names = parameters(self.class.bind(py)).ok();
            let names = names.map(|all| all.iter().map(|p| p.name).collect::<Vec<_>>().join(", "));
            let help = names.map(|names| format!("parameters of the class: {names}"));
            (format!("its class cannot be called: {}", told(py, &e)), help)
        })?;
        let inputs = ports::read(&made, "inputs")?;
        let outputs = ports::read(&made, "outputs")?;
        if let Some(p) = inputs.iter().find(|p| outputs.iter().any(|o| o.name == p.name)) {
            let fact = format!("`{}` is both an input and an output", p.name);
            return Err((fact, Some("rename one of the two".into())));
        }
        let has = |name: &str| made.hasattr(name).map_err(|e| failed(name, &e));
        let flag = |name: &str, default| match made.getattr(name) {
            Ok(v) => v.is_truthy().map_err(|e| failed(name, &e)),
            Err(_) => Ok(default),
        };
        let (save, load) = (has("save")?, has("load")?);
        if save != load {
            let fact = format!("it has only `{}`", if save { "save" } else { "load" });
            return Err((fact, Some("write both: `save(self)` and `load(self, saved)`".into())));
        }
        let name = self.name.clone().into();
        let description = if self.sampled {
            if let Some(only) = continuous::ONLY.iter().find(|name| has(name).unwrap_or(false)) {
                let fact = format!("it has `step`, but `{only}` belongs to a continuous part");
                let help = "replace `step` by `evaluate(self, t, x, u)` and `derivatives(self, t, x, u)`, or keep the state in `self` with `save` and `load`";
                return Err((fact, Some(help.into())));
            }
            Description {
                name,
                functions: Functions {
                    feedthrough: true,
                    feedthrough_timed: true,
                    update: true,
                    ..Functions::default()
                },
                feedthrough_inputs: inputs,
                feedthrough_outputs: outputs,
                ..Description::default()
            }
        } else {
            if save {
                let help = "declare its continuous states in `states`; a continuous part keeps nothing else";
                return Err((
                    "a continuous part does not have `save` and `load`".into(),
                    Some(help.into()),
                ));
            }
            let direct = flag("direct_feedthrough", true)?;
            let description = continuous::description(&made, inputs, outputs, direct)?;
            Description { name, ..description }
        };
        let start = continuous::start(&made, &description.continuous)?;
        let stateless = !self.sampled || flag("stateless", false)?;
        let saves = match (save, stateless) {
            (true, _) => Saves::Own,
            (false, true) => Saves::Nothing,
            (false, false) => Saves::Not,
        };
        Ok(Part { class: self.copy(py), params: params.clone(), description, start, saves })
    }
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
    /// Returns the source text of the class, or its name if Python does not have the text.
    fn source(&self) -> String {
        Python::attach(|py| {
            let class = self.class.bind(py);
            let text = py.import("inspect").and_then(|m| m.call_method1("getsource", (class,)));
            let text = text.and_then(|text| text.extract::<String>());
            text.unwrap_or_else(|_| class.to_string())
        })
    }
}

/// Returns the parameters as a map.
fn plain(params: &Located) -> Value {
    match &params.value {
        Value::Map(_) => params.value.clone(),
        _ => Value::Map(Vec::new()),
    }
}

/// Returns the failure for an error in a Python part.
fn failure(message: String, help: &str) -> Box<Failure> {
    Box::new(Failure { message, help: Some(help.into()) })
}

/// Keeps an exception of a part, and returns the failure of the run. `what` says where it was raised: `` `step` ``.
fn exception(py: Python<'_>, class: &str, what: &str, e: PyErr) -> Box<Failure> {
    let message = format!("its class `{class}` raised in {what}: {}", told(py, &e));
    RAISED.set(Some(e));
    failure(message, "see the exception that caused this one")
}

/// Calls a method of a part, and writes the values that it returns to `to`, in the order of `ports`.
fn call<'py>(
    object: &Bound<'py, PyAny>,
    class: &str,
    method: &str,
    args: impl pyo3::call::PyCallArgs<'py>,
    (what, ports): (&str, &[PortSpec]),
    to: &mut [f64],
) -> Result<(), Box<Failure>> {
    let answer = object
        .call_method1(method, args)
        .map_err(|e| exception(object.py(), class, &format!("`{method}`"), e))?;
    ports::write(&answer, &format!("`{method}` of `{class}`"), (what, ports), to)
}
