//! Continuous parts: `evaluate` and `derivatives` at every evaluation of the integrator.
use super::{Class, Problem, as_part, call, exception, ports, told};
use linkwork_runtime::{
    Block, Description, EvalTime, Failure, Functions, Outcome, PortSpec, Value, Wiring,
};
use pyo3::prelude::*;
use pyo3::types::PyDict;

/// Attributes that only a continuous part has.
pub(super) const ONLY: [&str; 3] = ["states", "start", "direct_feedthrough"];

/// Returns the description of a continuous part, without its name. If `direct` is false, outputs do not depend on inputs at the same instant.
pub(super) fn description(
    made: &Bound<'_, PyAny>,
    inputs: Vec<PortSpec>,
    outputs: Vec<PortSpec>,
    direct: bool,
) -> Result<Description, Problem> {
    let has = |name: &str| made.hasattr(name).unwrap_or(false);
    let continuous = if has("states") { ports::read(made, "states")? } else { Vec::new() };
    for (method, dict, empty) in [
        ("derivatives", "states", continuous.is_empty()),
        ("evaluate", "outputs", outputs.is_empty()),
    ] {
        if has(method) == empty {
            let (fact, help) = match empty {
                true => (
                    format!("it has `{method}` but no `{dict}`"),
                    format!("write {dict} = {{name: unit}}"),
                ),
                false => (
                    format!("it has `{dict}` but no `{method}`"),
                    format!("write the method `{method}`, which returns {{name: value}}"),
                ),
            };
            return Err((fact, Some(help)));
        }
    }
    let names = inputs.iter().chain(&outputs);
    if let Some(p) = continuous.iter().find(|p| names.clone().any(|o| o.name == p.name)) {
        let fact = format!("`{}` is both a state and a port", p.name);
        return Err((fact, Some("rename one of the two".into())));
    }
    let functions = Functions {
        outputs: !direct && !outputs.is_empty(),
        outputs_timed: !direct,
        feedthrough: direct && !outputs.is_empty(),
        feedthrough_timed: direct,
        derivatives: !continuous.is_empty(),
        ..Functions::default()
    };
    let described = Description { functions, continuous, ..Description::default() };
    Ok(match direct {
        true => {
            Description { feedthrough_inputs: inputs, feedthrough_outputs: outputs, ..described }
        }
        false => Description { inputs, outputs, ..described },
    })
}

/// Reads `start = {state: value}`; states without a value start at 0.
pub(super) fn start(made: &Bound<'_, PyAny>, states: &[PortSpec]) -> Result<Vec<f64>, Problem> {
    let mut start = vec![0.0; states.iter().map(|p| p.lanes).sum()];
    let Ok(given) = made.getattr("start") else { return Ok(start) };
    let help = || {
        Some("write start = {state: value} in the class, or set `self.start` in `__init__`".into())
    };
    let Ok(given) = given.cast_into::<PyDict>() else {
        return Err(("its `start` is not a dict".into(), help()));
    };
    for name in given.keys() {
        if !states.iter().any(|p| name.eq(&*p.name).unwrap_or(false)) {
            return Err((format!("its `start` has `{name}`, which is not in `states`"), help()));
        }
    }
    let mut at = 0;
    for port in states {
        let lanes = at..at + port.lanes;
        at = lanes.end;
        let value = given.get_item(&*port.name);
        let value = value.map_err(|e| (format!("`start`: {}", told(made.py(), &e)), None))?;
        if let Some(value) = value {
            ports::number(&value, port, &mut start[lanes])
                .map_err(|e| (format!("its `start`: `{}` {e}", port.name), help()))?;
        }
    }
    Ok(start)
}

pub(super) struct Continuous {
    /// Created at the first call.
    made: Option<Py<PyAny>>,
    class: Class,
    params: Value,
    inputs: Vec<PortSpec>,
    outputs: Vec<PortSpec>,
    states: Vec<PortSpec>,
    direct: bool,
    w: Wiring,
}

impl Continuous {
    pub fn new(class: Class, params: Value, d: &Description, w: Wiring) -> Self {
        let all = |a: &[PortSpec], b: &[PortSpec]| a.iter().chain(b).cloned().collect();
        Continuous {
            made: None,
            class,
            params,
            inputs: all(&d.inputs, &d.feedthrough_inputs),
            outputs: all(&d.outputs, &d.feedthrough_outputs),
            states: d.continuous.clone(),
            direct: d.functions.feedthrough_timed,
            w,
        }
    }

    /// Returns the object and the states. The object is created at the first call.
    fn begin<'py>(
        &mut self,
        py: Python<'py>,
        x: &[f64],
    ) -> Result<(Bound<'py, PyAny>, Bound<'py, PyDict>), Box<Failure>> {
        let failed = |what: &str, e| exception(py, &self.class.name, what, e);
        let made = match &self.made {
            Some(made) => made.bind(py).clone(),
            None => self.class.object(py, &self.params).map_err(|e| failed("`__init__`", e))?,
        };
        let x = ports::values(py, &self.states, |k| x[self.w.x + k]);
        let x = x.map_err(|e| failed("its states", e))?;
        self.made = Some(made.clone().unbind());
        Ok((made, x))
    }

    fn given<'py>(&self, py: Python<'py>, sig: &[f64]) -> Result<Bound<'py, PyDict>, Box<Failure>> {
        let lanes = if self.direct { &self.w.ud } else { &self.w.u };
        let given = ports::values(py, &self.inputs, |k| sig[lanes[k] as usize]);
        given.map_err(|e| exception(py, &self.class.name, "its inputs", e))
    }
}

impl Block for Continuous {
    fn outputs(&mut self, now: &EvalTime, x: &[f64], _: &[f64], sig: &mut [f64]) -> Outcome {
        as_part(|py| {
            let (made, x) = self.begin(py, x)?;
            let to = &mut sig[self.w.ym..];
            call(&made, &self.class.name, "evaluate", (now.t, x), ("outputs", &self.outputs), to)
        })
    }
    fn feedthrough(&mut self, now: &EvalTime, x: &[f64], _: &[f64], sig: &mut [f64]) -> Outcome {
        as_part(|py| {
            let ((made, x), u) = (self.begin(py, x)?, self.given(py, sig)?);
            let (to, args) = (&mut sig[self.w.yd..], (now.t, x, u));
            call(&made, &self.class.name, "evaluate", args, ("outputs", &self.outputs), to)
        })
    }
    fn derivatives(
        &mut self,
        now: &EvalTime,
        x: &[f64],
        _: &[f64],
        sig: &[f64],
        xdot: &mut [f64],
    ) -> Outcome {
        as_part(|py| {
            let ((made, x), u) = (self.begin(py, x)?, self.given(py, sig)?);
            let (to, args) = (&mut xdot[self.w.x..], (now.t, x, u));
            call(&made, &self.class.name, "derivatives", args, ("states", &self.states), to)
        })
    }
    fn update(&mut self, _: &EvalTime, _: &[f64], _: &mut [f64], _: &[f64]) -> Outcome {
        Ok(())
    }
    fn save_store(&self) -> Result<Vec<u8>, String> {
        Ok(Vec::new())
    }
    fn load_store(&mut self, _: &[u8]) -> Result<(), String> {
        Ok(())
    }
    fn fork(&self) -> Box<dyn Block> {
        Box::new(Continuous {
            made: None,
            class: Python::attach(|py| self.class.copy(py)),
            params: self.params.clone(),
            inputs: self.inputs.clone(),
            outputs: self.outputs.clone(),
            states: self.states.clone(),
            direct: self.direct,
            w: self.w.clone(),
        })
    }
}
