//! `Simulation`: a run of a RON simulation; variables by path, callbacks, logs, checkpoints.
use crate::array::{Array1, Input, out1};
use crate::core::{Core, GRAVITY, lock};
use crate::error::{no_variable, refuse, refuse_with, run_failed};
use crate::files::{self, Ready};
use crate::log::{Filler, Filling, Log, Rows};
use crate::mechanism::Mechanism;
use crate::parts;
use crate::rules::{self, recording, refused, text, window};
use crate::running::{RECORDING, Running, Stopped};
use crate::values::{Variable, object, overrides, period, seconds};
use linkwork_assembly::{LogRule, Text, match_patterns};
use linkwork_runner::{Goal, log_rules};
use linkwork_runtime::{
    self as runtime, Change, Checkpoint, Group, Place, Plan, PortKind, Program, Role, Seconds,
};
use linkwork_runtime::{Value, remedy};
use pyo3::gc::{PyTraverseError, PyVisit};
use pyo3::prelude::*;
use pyo3::types::{PyBool, PyDict, PyFloat};
use std::collections::BTreeMap;
use std::path::PathBuf;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::{Arc, Mutex};

/// A run of a simulation in RON. It begins at t = 0 with the work of the first tick done.
///
/// path: a sim.ron or its folder. overrides: {path: value} of parameters and settings, as
/// `--set` on the command line. seed: replaces the file's. until: when `run()` stops, replaces
/// the file's; s, or a text such as "2 min". models: {name: class}, parts in Python: a class has
/// `inputs` and `outputs` ({name: unit}, {name: (unit, length)}; or, bound to the mechanism under that
/// name, "hinge state", "node state", "hinge torque", "wrench", ..) and `step(self, t, u)`, which is
/// called at the part's rate with t in s and u = {input: value} and returns {output: value}; the
/// part's `params` in the file are arguments of the class. `save(self)` and `load(self, saved)`, or
/// `stateless = True`, make checkpoints and forks possible.
/// Raises LinkworkError with every mistake, each with its place.
#[pyclass(frozen, weakref, module = "linkwork")]
pub struct Simulation {
    plan: Arc<Plan>,
    program: Arc<Program>,
    configuration: String,
    rules: Vec<LogRule>,
    until: Option<Seconds>,
    stop_when: Option<Place>,
    running: Mutex<Running>,
    busy: AtomicBool,
    /// Threads that wait for a turn while the run steps.
    waiting: AtomicUsize,
}

/// Ends the run's claim on the simulation, however it ends.
struct Busy<'a>(&'a AtomicBool);

impl Drop for Busy<'_> {
    fn drop(&mut self) {
        self.0.store(false, Ordering::SeqCst);
    }
}

impl Simulation {
    /// A run at its start, to an end that replaces the file's.
    pub fn from_ready(py: Python<'_>, ready: Ready, until: Option<Seconds>) -> PyResult<Self> {
        let stop_when = match &ready.loaded.simulation.stop_when {
            Some(text) => {
                Some(ready.plan().variable(&text.text).map_err(|e| no_variable(&e))?.place)
            }
            None => None,
        };
        let file = ready.loaded.simulation;
        let program = Arc::new(ready.program);
        let sim = runtime::Simulation::of(program.clone());
        // A part that raised at the first tick.
        sim.check().map_err(|e| parts::raised(py, run_failed(&e)))?;
        Ok(Self {
            plan: program.phases[0].plan.clone(),
            program,
            configuration: ready.loaded.resolved.to_string(),
            rules: file.log,
            until: until.or(file.until),
            stop_when,
            running: Mutex::new(Running::new(sim)),
            busy: AtomicBool::new(false),
            waiting: AtomicUsize::new(0),
        })
    }

    /// Does something with the run; other threads go on while this waits for its turn. A part that
    /// runs in it cannot.
    fn with<R: Send>(
        &self,
        py: Python<'_>,
        f: impl FnOnce(&mut Running) -> R + Send,
    ) -> PyResult<R> {
        if parts::inside() {
            return Err(refuse_with(
                "a part asks the simulation that runs it",
                "declare what it needs in `inputs`, and wire it",
            ));
        }
        Ok(py.detach(|| {
            self.waiting.fetch_add(1, Ordering::SeqCst);
            let mut running = lock(&self.running);
            self.waiting.fetch_sub(1, Ordering::SeqCst);
            f(&mut running)
        }))
    }

    fn claim(&self) -> PyResult<Busy<'_>> {
        if parts::inside() {
            return Err(refuse_with("a part runs a simulation", "run it outside of `step`"));
        }
        if self.busy.swap(true, Ordering::SeqCst) {
            return Err(refuse_with(
                "the simulation is already running",
                "a callback may read and set variables, but not advance the run",
            ));
        }
        Ok(Busy(&self.busy))
    }

    fn advance(slf: &Bound<'_, Self>, mut goal: Goal) -> PyResult<()> {
        let (py, this) = (slf.py(), slf.get());
        let _busy = this.claim()?;
        loop {
            py.check_signals()?;
            let stopped = py.detach(|| {
                // The lock is not fair: those who wait go first, as long as they come soon.
                for _ in 0..1000 {
                    if this.waiting.load(Ordering::SeqCst) == 0 {
                        break;
                    }
                    std::thread::yield_now();
                }
                lock(&this.running).go(&mut goal)
            });
            match stopped {
                Stopped::Done => return Ok(()),
                Stopped::Chunk => {}
                Stopped::Failed(e) => return Err(parts::raised(py, run_failed(&e))),
                Stopped::Recording(e) => {
                    return Err(refuse_with(e, "the run can go on without the recording"));
                }
                Stopped::Calls(due) => {
                    let functions: Vec<Py<PyAny>> = {
                        let running = lock(&this.running);
                        due.iter().map(|k| running.calls[*k].clone_ref(py)).collect()
                    };
                    for f in functions {
                        f.call1(py, (slf,))?;
                    }
                }
            }
        }
    }

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
}

#[pymethods]
impl Simulation {
    #[new]
    #[pyo3(signature = (path, overrides=None, *, seed=None, until=None, models=None))]
    fn new(
        py: Python<'_>,
        path: PathBuf,
        overrides: Option<&Bound<'_, PyDict>>,
        seed: Option<u64>,
        until: Option<&Bound<'_, PyAny>>,
        models: Option<&Bound<'_, PyDict>>,
    ) -> PyResult<Self> {
        let set = self::overrides(overrides)?;
        let until = until.map(|u| seconds(u, "until")).transpose()?;
        let models = parts::entries(models)?;
        let ready = py.detach(|| files::simulation(&path, &set, seed, models)).map_err(refuse)?;
        Self::from_ready(py, ready, until)
    }

    /// A run as it was when `save` (or the command line) wrote the checkpoint; it goes on to the
    /// same bits. The checkpoint holds the whole configuration: no other file is needed, but the
    /// `models` that were given.
    #[staticmethod]
    #[pyo3(signature = (path, *, until=None, models=None))]
    fn resume(
        py: Python<'_>,
        path: PathBuf,
        until: Option<&Bound<'_, PyAny>>,
        models: Option<&Bound<'_, PyDict>>,
    ) -> PyResult<Self> {
        let models = parts::entries(models)?;
        let until = until.map(|u| seconds(u, "until")).transpose()?;
        let read = move || {
            let checkpoint = Checkpoint::read(&path).map_err(|e| {
                format!("{e}\n  help: give a .lwck file that `save` or `linkwork run` wrote, whole")
            })?;
            let ready =
                files::simulation_text("checkpoint.ron", &checkpoint.configuration, models)?;
            Ok((checkpoint, ready))
        };
        let (checkpoint, ready) = py.detach(read).map_err(|e: String| refuse(e))?;
        let this = Self::from_ready(py, ready, until)?;
        this.with(py, |r| {
            r.remember(&checkpoint);
            r.sim_mut().restore(&checkpoint)
        })?
        .map_err(refuse)?;
        Ok(this)
    }

    /// Writes a checkpoint (.lwck) from which `resume`, or `linkwork resume`, goes on.
    fn save(&self, py: Python<'_>, path: PathBuf) -> PyResult<()> {
        let write = |r: &mut Running| -> Result<(), String> {
            let carried = r.runner().carried()?;
            let checkpoint = r.sim().checkpoint(&self.configuration);
            let mut checkpoint = checkpoint.map_err(|e| e.to_string())?;
            checkpoint.extra.extend(carried);
            checkpoint.write(&path).map_err(|e| e.to_string())
        };
        self.with(py, write)?.map_err(refuse)
    }

    /// Another run from the present state on, without this one's logs and callbacks.
    fn fork(&self, py: Python<'_>) -> PyResult<Self> {
        let forked = self.with(py, |r| r.sim().can_save().map(|()| r.sim().fork()))?;
        let forked = forked.map_err(|e| parts::raised(py, refuse(e)))?;
        Ok(Self {
            plan: self.plan.clone(),
            program: self.program.clone(),
            configuration: self.configuration.clone(),
            rules: self.rules.clone(),
            until: self.until,
            stop_when: self.stop_when,
            running: Mutex::new(Running::new(forked)),
            busy: AtomicBool::new(false),
            waiting: AtomicUsize::new(0),
        })
    }

    /// Simulated time, s.
    #[getter]
    fn time(&self, py: Python<'_>) -> PyResult<f64> {
        self.with(py, |r| r.sim().time())
    }
    /// Integration step, s.
    #[getter]
    fn dt(&self) -> f64 {
        self.plan.step.seconds()
    }
    /// When `run()` stops, s; None when nothing says so.
    #[getter]
    fn until(&self) -> Option<f64> {
        self.until.map(Seconds::seconds)
    }
    /// Seed of all noise.
    #[getter]
    fn seed(&self) -> u64 {
        self.plan.seed
    }
    /// Hash of the state: equal hashes, equal bits. As in summary.json of the command line.
    #[getter]
    fn state_hash(&self, py: Python<'_>) -> PyResult<String> {
        self.with(py, |r| format!("{:016x}", r.sim().hash()))
    }
    /// The whole configuration as one RON text that needs no other file.
    #[getter]
    fn configuration(&self) -> &str {
        &self.configuration
    }

    /// Takes n steps.
    #[pyo3(signature = (n=1))]
    fn step(slf: &Bound<'_, Self>, n: u64) -> PyResult<()> {
        Self::advance(slf, Goal { steps: Some(n), ..Goal::default() })
    }
    /// Runs to the first tick at or after t (s, or a text such as "2 min"). Cutting a run into
    /// pieces changes no bit of it. Raises LinkworkError when a state is no number any more.
    fn run_until(slf: &Bound<'_, Self>, t: &Bound<'_, PyAny>) -> PyResult<()> {
        let until = Some(seconds(t, "t")?);
        Self::advance(slf, Goal { until, ..Goal::default() })
    }
    /// Runs to `until`, or to when the file's `stop_when` is true.
    fn run(slf: &Bound<'_, Self>) -> PyResult<()> {
        let this = slf.get();
        if this.until.is_none() && this.stop_when.is_none() {
            return Err(refuse_with(
                "nothing says when to stop",
                "give until=.., write `until` in the file, or call run_until(t)",
            ));
        }
        Self::advance(slf, Goal { until: this.until, stop_when: this.stop_when, steps: None })
    }

    /// Calls `function(simulation)` rate times a second: at the first tick at or after each
    /// multiple of 1/rate, before the rows of that tick are logged. It may read and set variables.
    /// An exception ends the run at that tick.
    fn at(&self, py: Python<'_>, rate: f64, function: Py<PyAny>) -> PyResult<()> {
        self.call(py, period(rate)?, function)
    }
    /// The same every so many seconds (or a text such as "20 ms").
    fn every(
        &self,
        py: Python<'_>,
        seconds: &Bound<'_, PyAny>,
        function: Py<PyAny>,
    ) -> PyResult<()> {
        let period = self::seconds(seconds, "seconds")?;
        if period.num == 0 {
            return Err(refuse_with("`seconds` is 0", "give a time above zero, or use step()"));
        }
        self.call(py, period, function)
    }

    /// A log of the variables that match the patterns (`*` one segment, `**` any number), from
    /// now on: rate rows a second, or one each step. on_change: only rows of which a value has changed since the
    /// last. around: only rows from `before` ahead of the instants from which this condition holds
    /// ("Ball.height < 1 cm and time > 2 s") to `after` behind them (s, or a text such as "20 ms").
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
        let rows = Rows { t: Vec::new(), columns: vec![Vec::new(); names.len()] };
        let rows = Arc::new(Mutex::new(rows));
        let variables: Vec<&runtime::Variable> =
            names.iter().map(|n| &self.plan.variables[n]).collect();
        let places = variables.iter().map(|v| v.place).collect();
        let group = Group { period, places, on_change, around, ..Group::default() };
        let into = Filler::new(rows.clone());
        self.with(py, |r| {
            let due = runtime::Rows::from_now(r.sim(), 0, group)?;
            r.log(Filling { due, into });
            Ok(())
        })?
        .map_err(|e: String| refuse(e))?;
        let units = variables.iter().map(|v| v.unit.clone()).collect();
        Ok(Log { names, units, rows })
    }

    /// Records into an MCAP file until `stop_recording`: the variables that match the patterns
    /// at rate rows a second (one each step when left out), with `on_change` and `around` as of `log`; or what the
    /// file's `log` says; and the poses of all bodies. Read it with read_log, Rerun, Foxglove, PlotJuggler.
    /// What is pinned stands at its start. A recording that is begun where a run was resumed, by the rules of the one
    /// that was under way when the checkpoint was saved, goes on with that.
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
    #[pyo3(signature = (pattern="**"))]
    fn unpin(&self, py: Python<'_>, pattern: &str) -> PyResult<BTreeMap<String, f64>> {
        self.change(py, pattern, Change::Unpin, None)
    }
    /// What is pinned, {path: value}, SI.
    #[getter]
    fn pins(&self, py: Python<'_>) -> PyResult<BTreeMap<String, f64>> {
        self.with(py, |r| r.sim().pins().map(|(path, value)| (path.to_string(), value)).collect())
    }
    fn __contains__(&self, path: &str) -> bool {
        self.plan.variables.contains_key(path)
    }

    /// Every variable that matches a pattern, {path: Variable}, with unit and meaning.
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
            let (unit, doc, part) = (v.unit.clone(), v.doc.clone(), v.part.clone());
            let variable = Variable { path: path.clone(), unit, doc, role, part };
            all.set_item(path, Py::new(py, variable)?)?;
        }
        Ok(all)
    }
    /// Paths of the parts that have a model.
    #[getter]
    fn parts(&self) -> Vec<&str> {
        self.plan.parts.iter().map(|p| p.path.as_str()).collect()
    }
    /// The parameters of a part, as resolved: {name: value}, SI units.
    fn parameters<'py>(&self, py: Python<'py>, part: &str) -> PyResult<Bound<'py, PyAny>> {
        let found = self.plan.parts.iter().find(|p| p.path == part).ok_or_else(|| {
            let help = remedy(part, "parts", &self.parts());
            refuse_with(format!("there is no part `{part}`"), help)
        })?;
        object(py, found.prototype.params())
    }

    /// Name of the present phase; an empty text for a simulation without phases.
    #[getter]
    fn phase(&self, py: Python<'_>) -> PyResult<String> {
        self.with(py, |r| r.sim().phase().to_owned())
    }

    /// The mechanism of the present phase; its q and v are this simulation's.
    #[getter]
    fn mechanism(&self, py: Python<'_>) -> PyResult<Mechanism> {
        let plan = self.with(py, |r| r.sim().plan().clone())?;
        let m = plan.mechanism().ok_or_else(no_mechanism)?;
        let gravity = m.uniform.unwrap_or(GRAVITY);
        Ok(Mechanism { core: Arc::new(Core::new((*m.multibody).clone(), gravity)?) })
    }
    /// Configuration of the mechanism now (nq,), a copy.
    #[getter]
    fn q<'py>(&self, py: Python<'py>) -> PyResult<Array1<'py>> {
        let read = |r: &mut Running| {
            let sim = r.sim();
            let m = sim.plan().mechanism()?;
            Some(sim.state().x[m.x..m.x + m.multibody.nq()].to_vec())
        };
        Ok(out1(py, self.with(py, read)?.ok_or_else(no_mechanism)?))
    }
    /// Velocity of the mechanism now (nv,), a copy.
    #[getter]
    fn v<'py>(&self, py: Python<'py>) -> PyResult<Array1<'py>> {
        let read = |r: &mut Running| {
            let sim = r.sim();
            let m = sim.plan().mechanism()?;
            let at = m.x + m.multibody.nq();
            Some(sim.state().x[at..at + m.multibody.nv()].to_vec())
        };
        Ok(out1(py, self.with(py, read)?.ok_or_else(no_mechanism)?))
    }

    /// Callbacks often hold the simulation that holds them: the garbage collector may see that.
    fn __traverse__(&self, visit: PyVisit<'_>) -> Result<(), PyTraverseError> {
        // A simulation that steps just now is in use, and is left alone.
        let Ok(running) = self.running.try_lock() else { return Ok(()) };
        running.calls.iter().try_for_each(|f| visit.call(f))
    }
    fn __clear__(&self) {
        let calls = {
            let mut running = lock(&self.running);
            running.runner().clear_calls();
            std::mem::take(&mut running.calls)
        };
        drop(calls);
    }

    fn __repr__(&self, py: Python<'_>) -> PyResult<String> {
        let (parts, t) = (self.plan.parts.len(), self.time(py)?);
        Ok(format!("Simulation({parts} parts, {} variables, t = {t} s)", self.plan.variables.len()))
    }
    fn _repr_html_(&self, py: Python<'_>) -> PyResult<String> {
        let show = |r: &mut Running| {
            let sim = r.sim();
            crate::show::simulation(sim.plan(), sim.time(), self.until, sim.phase())
        };
        self.with(py, show)
    }
}

fn no_mechanism() -> PyErr {
    refuse_with("the simulation has no mechanism", "give it bodies")
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

impl Simulation {
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

    fn call(&self, py: Python<'_>, period: Seconds, function: Py<PyAny>) -> PyResult<()> {
        if !function.bind(py).is_callable() {
            return Err(refuse_with(
                "`function` cannot be called",
                "give a function of one argument",
            ));
        }
        self.with(py, |r| {
            r.runner().call(period);
            r.calls.push(function);
        })
    }
}
