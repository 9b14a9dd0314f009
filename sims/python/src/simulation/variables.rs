//! Variables of a `Simulation`: read, set, pinned, logged and recorded by path.
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
    /// The places of `path`: one variable, or the lanes of a vector.
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

    /// Says that a variable does not exist, or that it is a parameter.
    fn unknown(&self, path: &str) -> PyErr {
        if let Some((part, name)) = path.rsplit_once('.')
            && let Some(p) = self.plan.parts.iter().find(|p| p.path == part)
            && let Value::Map(params) = p.prototype.params()
            && params.iter().any(|(key, _)| key == name)
        {
            return refuse_with(
                format!("`{path}` is a parameter: it is fixed when the simulation is loaded"),
                format!(
                    "set it with Simulation(.., overrides={{\"{path}\": value}}), read it with parameters(\"{part}\")"
                ),
            );
        }
        match self.plan.variable(path) {
            Err(e) => no_variable(&e),
            Ok(_) => refuse(format!("`{path}` has no lanes")),
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
    /// A log of the variables that match the patterns (`*` one segment, `**` any number), from
    /// now on: rate rows a second, or one each step. on_change: only rows of which a value has changed since the
    /// last. around: only rows from `before` ahead of the instants from which this condition holds
    /// ("Ball.height < 1 cm and time > 2 s") to `after` behind them (s, or a text such as "20 ms").
    /// Raises LinkworkError for a pattern that nothing matches, a rate, Hz, that is not above zero, and a condition that cannot be read.
    ///
    /// >>> log = sim.log(["bob.angle", "bob.rate"], 10)
    /// >>> sim.run_until(1.25)
    /// >>> log["t"].tolist()
    /// [1.0, 1.1, 1.2]
    /// >>> log["bob.angle"].shape
    /// (3,)
    #[pyo3(signature = (channels, rate=None, *, on_change=false, around=None, before=None, after=None))]
    #[allow(clippy::too_many_arguments)] // As Python sees it.
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
            // Rows of parts that are sampled between two steps, too.
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

    /// Records into an MCAP file until `stop_recording`: the variables that match the patterns
    /// at rate rows a second, Hz (one each step when left out), with `on_change` and `around` as of `log`; or what the
    /// file's `log` says; and the poses of all bodies. Read it with read_log, Rerun, Foxglove, PlotJuggler.
    /// What is pinned stands at its start. Rows begin at the start of a run, or after the present tick of one that is under way. A recording that is begun where a run was resumed, by the rules of the one
    /// that was under way when the checkpoint was saved, goes on with that.
    /// Raises LinkworkError while another recording is under way, for what `log` refuses, and when the file cannot be written.
    ///
    /// >>> sim.record("swing.mcap", ["bob.angle"], 10)
    /// >>> sim.run_until(1.25)
    /// >>> sim.stop_recording()
    /// >>> linkwork.read_log("swing.mcap")["bob.angle"].t.round(3).tolist()
    /// [1.1, 1.2]
    #[pyo3(signature = (path, channels=None, rate=None, *, on_change=false, around=None, before=None, after=None))]
    #[allow(clippy::too_many_arguments)] // As Python sees it.
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
                    "`rate`, `on_change` and `around` are of channels, and there are none",
                    "give channels, or leave them out to record what the file's `log` says",
                ));
            }
            None => log_rules(&self.plan, &self.rules).map_err(|faults| refused(&faults))?,
        };
        let open = |r: &mut Running| {
            if r.runner().has_tap(RECORDING) {
                return Err("a recording is under way\n  help: call stop_recording() first".into());
            }
            let tap = recording(r.sim(), &path, chosen, &self.configuration)?;
            r.record(tap);
            Ok(())
        };
        self.with(py, open)?.map_err(|e: String| refuse(e))
    }
    /// Ends the recording: the file is whole when this returns. Nothing happens without one.
    /// Raises LinkworkError when the file could not be written.
    ///
    /// >>> sim.record("swing.mcap")
    /// >>> sim.step(100)
    /// >>> sim.stop_recording()
    /// >>> linkwork.read_log("swing.mcap")["bob.angle"].unit
    /// 'rad'
    fn stop_recording(&self, py: Python<'_>) -> PyResult<()> {
        self.with(py, |r| r.runner().finish_tap(RECORDING))?.map_err(refuse)
    }

    /// The value of a variable, in its unit: a float, or a bool for truth values. The path of a
    /// vector ("…velocity" of "…velocity.x") gives an array of its lanes.
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
    /// Sets a state, or an input without a wire, from the present tick on; a vector from an array, all of it or nothing.
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

    /// Pins a variable, or all that match a pattern with a star: it has this value (SI, or a text such as "12 deg"),
    /// or without one its present value, from now on and for every reader, until it is unpinned, whatever the
    /// model does. States (their derivative is then zero), inputs without a wire and outputs can be pinned. Pins go into
    /// checkpoints and recordings. Gives what is pinned now by this call, {path: value}, SI.
    /// Raises LinkworkError for a pattern that nothing matches, a value that is no number or of another unit, and a variable that a wire drives.
    ///
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
    /// Lets a pinned variable go, or all that match a pattern with a star; gives them with their values, SI.
    /// Raises LinkworkError for a pattern that nothing matches.
    ///
    /// >>> _ = sim.pin("bob.rate", 0.25)
    /// >>> sim.unpin()
    /// {'bob.rate': 0.25}
    #[pyo3(signature = (pattern="**"))]
    fn unpin(&self, py: Python<'_>, pattern: &str) -> PyResult<BTreeMap<String, f64>> {
        self.change(py, pattern, Change::Unpin, None)
    }
    /// What is pinned, {path: value}, SI.
    ///
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

    /// Every variable that matches a pattern, {path: Variable}, with unit and meaning.
    /// Raises LinkworkError for a pattern that nothing matches.
    ///
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
    /// >>> sim.parts
    /// ['Friction', 'Mechanism']
    #[getter]
    fn parts(&self) -> Vec<&str> {
        self.plan.parts.iter().map(|p| p.path.as_str()).collect()
    }
    /// The parameters of a part, as resolved: {name: value}, SI units.
    /// Raises LinkworkError for a part that is not there.
    ///
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

/// A number, or a quantity as text.
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
