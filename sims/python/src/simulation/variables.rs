//! Variables of a `Simulation`: read, set, pin, log and record by path.
use super::Simulation;
use crate::array::{Input, out1};
use crate::error::{no_variable, refuse, refuse_with};
use crate::log::{Filling, Log};
use crate::rules::{self, recording, refused, text, window};
use crate::running::{RECORDING, Running};
use crate::values::{Variable, object, period};
use linkwork_assembly::Text;
use linkwork_assembly::patterns::match_patterns;
use linkwork_runner::{Columns, log_rules};
use linkwork_runtime::{self as runtime, Change, Group, Place, PortKind, Role, Value, remedy};
use pyo3::prelude::*;
use pyo3::types::{PyBool, PyDict, PyFloat};
use std::collections::BTreeMap;
use std::path::PathBuf;
use std::sync::{Arc, Mutex};

impl Simulation {
    /// Returns the names of one variable, or of the components of a vector.
    fn places(&self, path: &str) -> PyResult<Vec<String>> {
        if self.plan.variables.contains_key(path) {
            return Ok(vec![path.to_string()]);
        }
        let lane = |name: &str| {
            let rest = name.strip_prefix(path)?;
            let inside = |r: &str| r.strip_suffix(']').and_then(|r| r.parse::<usize>().ok());
            match rest.strip_prefix('[') {
                Some(index) => inside(index),
                None => ["x", "y", "z", "w"].iter().position(|c| rest.strip_prefix('.') == Some(c)),
            }
        };
        let mut lanes: Vec<(usize, &String)> =
            self.plan.variables.keys().filter_map(|n| Some((lane(n)?, n))).collect();
        lanes.sort();
        if lanes.is_empty() {
            Err(self.unknown(path))
        } else {
            Ok(lanes.into_iter().map(|l| l.1.clone()).collect())
        }
    }

    /// Returns the error for a variable that does not exist, or for a parameter.
    fn unknown(&self, path: &str) -> PyErr {
        if let Some((part, name)) = path.rsplit_once('.')
            && let Some(p) = self.plan.parts.iter().find(|p| p.path == part)
            && let Value::Map(params) = p.prototype.params()
            && params.iter().any(|(key, _)| key == name)
        {
            return refuse_with(
                format!(
                    "`{path}` is a parameter, which cannot change after the simulation is loaded"
                ),
                format!(
                    "set it with Simulation(.., overrides={{\"{path}\": value}}), read it with parameters(\"{part}\")"
                ),
            );
        }
        match self.plan.variable(path) {
            Err(e) => no_variable(&e),
            Ok(_) => refuse(format!("`{path}` does not have components")),
        }
    }

    fn matching(&self, patterns: &[String]) -> PyResult<Vec<String>> {
        let names: Vec<&str> = self.plan.variables.keys().map(String::as_str).collect();
        let texts: Vec<Text> = patterns.iter().map(|p| text(p)).collect();
        let found = match_patterns(&texts, &names).map_err(|faults| refused(&faults))?;
        Ok(found.into_iter().map(|k| names[k].to_string()).collect())
    }

    fn change(
        &self,
        py: Python<'_>,
        pattern: &str,
        change: Change,
        value: Option<Value>,
    ) -> PyResult<BTreeMap<String, f64>> {
        let done = self.with(py, |r| r.runner().change(pattern, change, value.as_ref()))?;
        Ok(done.map_err(|e| no_variable(&e))?.into_iter().collect())
    }
}

#[pymethods]
impl Simulation {
    /// Log variables in memory from now on.
    ///
    /// Parameters
    /// ----------
    /// channels : sequence of str
    ///     Paths of variables; `*` matches one segment, `**` any number.
    /// rate : float, optional
    ///     Samples per second, Hz (default: one sample per step).
    /// on_change : bool
    ///     Keep only samples in which a value has changed since the last one.
    /// around : str, optional
    ///     A condition such as "Ball.height < 1 cm and time > 2 s". Only samples around the instants at which it becomes true are kept.
    /// before, after : float or str, optional
    ///     Length of the interval before and after these instants, s, or a text such as "20 ms".
    ///
    /// Returns
    /// -------
    /// Log
    ///     The log. It grows while the simulation runs.
    ///
    /// Raises
    /// ------
    /// LinkworkError
    ///     If a pattern does not match any variable, the rate is not positive, or the condition has a syntax error.
    ///
    /// Examples
    /// --------
    /// >>> log = sim.log(["bob.angle", "bob.rate"], 10)
    /// >>> sim.run_until(1.25)
    /// >>> log["t"].tolist()
    /// [1.0, 1.1, 1.2]
    /// >>> log["bob.angle"].shape
    /// (3,)
    #[pyo3(signature = (channels, rate=None, *, on_change=false, around=None, before=None, after=None))]
    #[allow(clippy::too_many_arguments)] // The Python method has these arguments.
    fn log(
        &self,
        py: Python<'_>,
        channels: Vec<String>,
        rate: Option<f64>,
        on_change: bool,
        around: Option<String>,
        before: Option<&Bound<'_, PyAny>>,
        after: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<Log> {
        let around = window(around, before, after)?;
        let period = rate.map(period).transpose()?;
        let mut rule = rules::rule(&self.plan, &channels, period, on_change, around)?;
        if period.is_none() && rule.around.is_none() {
            // Samples of parts between two steps are included.
            rule.period = self.plan.base;
        }
        let runtime::Rule { paths: names, period, on_change, around } = rule;
        let rows = Arc::new(Mutex::new(Columns::new(names.len())));
        let variables: Vec<&runtime::Variable> =
            names.iter().map(|n| &self.plan.variables[n]).collect();
        let places = variables.iter().map(|v| v.place).collect();
        let group = Group { period, places, on_change, around, ..Group::default() };
        let into = rows.clone();
        self.with(py, |r| {
            let due = runtime::Rows::from_now(r.sim(), 0, group)?;
            r.log(Filling { due, into });
            Ok(())
        })?
        .map_err(|e: String| refuse(e))?;
        let units = variables.iter().map(|v| v.unit.to_string()).collect();
        Ok(Log { names, units, rows })
    }

    /// Record variables and the poses of all bodies into an MCAP file until `stop_recording`.
    ///
    /// Read the file with read_log, Rerun, Foxglove or PlotJuggler.
    ///
    /// Parameters
    /// ----------
    /// path : str or path-like
    ///     The file.
    /// channels : sequence of str, optional
    ///     Patterns of variables as in `log` (default: the channels of the file's `log`).
    /// rate : float, optional
    ///     Samples per second, Hz (default: one sample per step).
    /// on_change, around, before, after : optional
    ///     As in `log`.
    ///
    /// Raises
    /// ------
    /// LinkworkError
    ///     If another recording is active, `log` would raise, or the file cannot be written.
    ///
    /// Notes
    /// -----
    /// The recording begins with the pinned variables. The first sample is that at the start of the run; for a run that has begun, it is the one
    /// after the present tick. If the run was resumed from a checkpoint that was saved during a recording with the same rules, the new recording
    /// continues that one.
    ///
    /// Examples
    /// --------
    /// >>> sim.record("swing.mcap", ["bob.angle"], 10)
    /// >>> sim.run_until(1.25)
    /// >>> sim.stop_recording()
    /// >>> linkwork.read_log("swing.mcap")["bob.angle"].t.round(3).tolist()
    /// [1.1, 1.2]
    #[pyo3(signature = (path, channels=None, rate=None, *, on_change=false, around=None, before=None, after=None))]
    #[allow(clippy::too_many_arguments)] // The Python method has these arguments.
    fn record(
        &self,
        py: Python<'_>,
        path: PathBuf,
        channels: Option<Vec<String>>,
        rate: Option<f64>,
        on_change: bool,
        around: Option<String>,
        before: Option<&Bound<'_, PyAny>>,
        after: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<()> {
        let around = window(around, before, after)?;
        let chosen = match channels {
            Some(channels) => {
                let rate = rate.map(period).transpose()?;
                vec![rules::rule(&self.plan, &channels, rate, on_change, around)?]
            }
            None if rate.is_some() || on_change || around.is_some() => {
                return Err(refuse_with(
                    "`rate`, `on_change` and `around` require `channels`",
                    "give channels, or omit these arguments to record the channels of the file's `log`",
                ));
            }
            None => log_rules(&self.plan, &self.rules).map_err(|faults| refused(&faults))?,
        };
        let open = |r: &mut Running| {
            if r.runner().has_tap(RECORDING) {
                return Err(
                    "a recording is already active\n  help: call stop_recording() first".into()
                );
            }
            let recorder = recording(r.sim(), &path, chosen, &self.configuration)?;
            r.record(recorder);
            Ok(())
        };
        self.with(py, open)?.map_err(|e: String| refuse(e))
    }
    /// Stop the recording and complete the file. Without an active recording, the call has no effect.
    ///
    /// Raises
    /// ------
    /// LinkworkError
    ///     If the file cannot be written.
    ///
    /// Examples
    /// --------
    /// >>> sim.record("swing.mcap")
    /// >>> sim.step(100)
    /// >>> sim.stop_recording()
    /// >>> linkwork.read_log("swing.mcap")["bob.angle"].unit
    /// 'rad'
    fn stop_recording(&self, py: Python<'_>) -> PyResult<()> {
        self.with(py, |r| r.runner().finish_tap(RECORDING))?.map_err(refuse)
    }

    /// Return the value of a variable in its unit: a float, or a bool for truth values. The path of a vector ("…velocity" for "…velocity.x") returns
    /// an array of its components.
    fn __getitem__<'py>(&self, py: Python<'py>, path: &str) -> PyResult<Bound<'py, PyAny>> {
        let names = self.places(path)?;
        let places: Vec<Place> = names.iter().map(|n| self.plan.variables[n].place).collect();
        let values =
            self.with(py, |r| places.iter().map(|p| r.sim().value(*p)).collect::<Vec<_>>())?;
        let [name] = &names[..] else { return Ok(out1(py, values).into_any()) };
        if name != path {
            return Ok(out1(py, values).into_any());
        }
        Ok(match self.plan.variables[name].kind {
            PortKind::Bool => PyBool::new(py, values[0] > 0.5).to_owned().into_any(),
            _ => PyFloat::new(py, values[0]).into_any(),
        })
    }
    /// Set a state or an unconnected input from the present tick on. A vector is set from an array, completely or not at all.
    fn __setitem__(&self, py: Python<'_>, path: &str, value: &Bound<'_, PyAny>) -> PyResult<()> {
        let names = self.places(path)?;
        let single = names.len() == 1 && names[0] == path;
        let values = if single {
            let not_a_number = |_| {
                refuse_with(format!("`{path}` cannot be set to {value}"), "give a finite number")
            };
            vec![value.extract::<f64>().map_err(not_a_number)?]
        } else {
            Input::read(value, path)?.slice().to_vec()
        };
        if values.len() != names.len() {
            return Err(refuse_with(
                format!("`{path}` has {} numbers, not {}", names.len(), values.len()),
                format!("give an array of the shape ({},)", names.len()),
            ));
        }
        let all: Vec<(String, f64)> = names.into_iter().zip(values).collect();
        let set = |r: &mut Running| r.runner().change_all(Change::Set, &all);
        self.with(py, set)?.map_err(|e| no_variable(&e))
    }

    /// Fix the value of a variable, or of all variables that match a pattern, until it is unpinned.
    ///
    /// All readers see the pinned value, whatever the model computes. You can pin states (their derivative is then zero), unconnected inputs and
    /// outputs. Checkpoints and recordings contain the pinned variables.
    ///
    /// Parameters
    /// ----------
    /// pattern : str
    ///     Path of a variable, or a pattern with a star.
    /// value : float or str, optional
    ///     The value, SI, or a text such as "12 deg" (default: the present value).
    ///
    /// Returns
    /// -------
    /// dict of str to float
    ///     {path: value} of the variables that this call pinned, SI.
    ///
    /// Raises
    /// ------
    /// LinkworkError
    ///     If the pattern does not match any variable, the value is not finite or has another unit, or a wire drives the variable.
    ///
    /// Examples
    /// --------
    /// >>> sim.pin("bob.rate", "10 deg/s")
    /// {'bob.rate': 0.17453292519943295}
    /// >>> sim.run_until(2)
    /// >>> round(sim["bob.rate"], 6)
    /// 0.174533
    #[pyo3(signature = (pattern, value=None))]
    fn pin(
        &self,
        py: Python<'_>,
        pattern: &str,
        value: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<BTreeMap<String, f64>> {
        let value = value.map(|v| amount(v, pattern)).transpose()?;
        self.change(py, pattern, Change::Pin, value)
    }
    /// Release a pinned variable, or all that match a pattern.
    ///
    /// Parameters
    /// ----------
    /// pattern : str
    ///     Path of a variable, or a pattern with a star.
    ///
    /// Returns
    /// -------
    /// dict of str to float
    ///     {path: value} of the released variables, SI.
    ///
    /// Raises
    /// ------
    /// LinkworkError
    ///     If the pattern does not match any variable.
    ///
    /// Examples
    /// --------
    /// >>> _ = sim.pin("bob.rate", 0.25)
    /// >>> sim.unpin()
    /// {'bob.rate': 0.25}
    #[pyo3(signature = (pattern="**"))]
    fn unpin(&self, py: Python<'_>, pattern: &str) -> PyResult<BTreeMap<String, f64>> {
        self.change(py, pattern, Change::Unpin, None)
    }
    /// The pinned variables: {path: value}, SI.
    ///
    /// Examples
    /// --------
    /// >>> _ = sim.pin("bob.rate", 0.25)
    /// >>> sim.pins
    /// {'bob.rate': 0.25}
    #[getter]
    fn pins(&self, py: Python<'_>) -> PyResult<BTreeMap<String, f64>> {
        self.with(py, |r| r.sim().pins().map(|(path, value)| (path.to_string(), value)).collect())
    }
    fn __contains__(&self, path: &str) -> bool {
        self.plan.variables.contains_key(path)
    }

    /// Return all variables that match a pattern.
    ///
    /// Parameters
    /// ----------
    /// pattern : str
    ///     The pattern (default: all variables).
    ///
    /// Returns
    /// -------
    /// dict of str to Variable
    ///     {path: Variable}, with unit and description.
    ///
    /// Raises
    /// ------
    /// LinkworkError
    ///     If the pattern does not match any variable.
    ///
    /// Examples
    /// --------
    /// >>> sim.variables("bob.*")["bob.rate"]
    /// Variable("bob.rate", "rad/s", state)
    #[pyo3(signature = (pattern="**"))]
    fn variables<'py>(&self, py: Python<'py>, pattern: &str) -> PyResult<Bound<'py, PyDict>> {
        let all = PyDict::new(py);
        for path in self.matching(&[pattern.to_string()])? {
            let v = &self.plan.variables[&path];
            let role = match v.role {
                Role::State => "state",
                Role::Output => "output",
                Role::Free => "input",
                Role::Input => "wired input",
            };
            let (unit, doc, part) = (v.unit.to_string(), v.doc.to_string(), v.part.to_string());
            let variable = Variable { path: path.clone(), unit, doc, role, part };
            all.set_item(path, Py::new(py, variable)?)?;
        }
        Ok(all)
    }
    /// Paths of the parts that have a model.
    ///
    /// Examples
    /// --------
    /// >>> sim.parts
    /// ['Friction', 'Mechanism']
    #[getter]
    fn parts(&self) -> Vec<&str> {
        self.plan.parts.iter().map(|p| p.path.as_str()).collect()
    }
    /// Return the resolved parameters of a part.
    ///
    /// Parameters
    /// ----------
    /// part : str
    ///     Path of the part.
    ///
    /// Returns
    /// -------
    /// dict
    ///     {name: value}, SI units.
    ///
    /// Raises
    /// ------
    /// LinkworkError
    ///     If the part does not exist.
    ///
    /// Examples
    /// --------
    /// >>> sim.parameters("Friction")
    /// {'stiffness': 0.0, 'damping': 0.05, 'rest': 0.0}
    fn parameters<'py>(&self, py: Python<'py>, part: &str) -> PyResult<Bound<'py, PyAny>> {
        let found = self.plan.parts.iter().find(|p| p.path == part).ok_or_else(|| {
            let help = remedy(part, "parts", &self.parts());
            refuse_with(format!("there is no part `{part}`"), help)
        })?;
        object(py, found.prototype.params())
    }
}

/// Reads a number, or a quantity as text.
fn amount(value: &Bound<'_, PyAny>, pattern: &str) -> PyResult<Value> {
    if let Ok(text) = value.extract::<String>() {
        return Ok(Value::Text(text));
    }
    value.extract::<f64>().map(Value::Number).map_err(|_| {
        refuse_with(
            format!("`{pattern}` cannot be pinned to {value}"),
            "give a finite number, or a text such as \"12 deg\"",
        )
    })
}
