//! `Simulation`: a run of a RON simulation; variables by path, callbacks, logs, checkpoints.
use crate::array::{Array1, out1};
use crate::core::{Core, GRAVITY, lock};
use crate::error::{refuse, refuse_with, run_failed};
use crate::files::{self, Ready};
use crate::mechanism::Mechanism;
use crate::parts;
use crate::running::{Running, Stopped};
use crate::values::{overrides, period, seconds, seed_or_none};
use linkwork_assembly::BodyShape;
use linkwork_assembly::form::LogRule;
use linkwork_plant::PlanExt;
use linkwork_runner::Goal;
use linkwork_runtime::{self as runtime, Checkpoint, Plan, Program, Seconds};
use pyo3::gc::{PyTraverseError, PyVisit};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use std::path::PathBuf;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::{Arc, Mutex};

mod variables;

/// A run of a RON simulation. After construction, it is at t = 0 and the first tick has been evaluated.
///
/// Parameters
/// ----------
/// path : str or path-like
///     A sim.ron file, or its folder.
/// overrides : dict, optional
///     {path: value} of parameters and settings, as with `--set` on the command line.
/// seed : int, optional
///     Seed of the noise; replaces that of the file.
/// until : float or str, optional
///     End time of `run()`, s, or a text such as "2 min"; replaces that of the file.
/// models : dict, optional
///     {name: class}: models that are Python classes; see Notes.
///
/// Raises
/// ------
/// LinkworkError
///     If the simulation has mistakes. The message lists all of them, each with its position.
///
/// Notes
/// -----
/// A model class has `inputs` and `outputs`: {name: unit} or {name: (unit, length)}. A port that binds to the mechanism has a kind in place of
/// the unit: "hinge state", "node state", "hinge torque", "wrench", "added mass", ... The part's `params` in the file are the arguments of the
/// constructor.
///
/// Sampled: `step(self, t, u)` is called at the rate of the part, with the time t in s and u = {input: value}, and returns {output: value}.
/// `save(self)` and `load(self, saved)`, or `stateless = True`, make checkpoints and forks possible.
///
/// Continuous: `states` = {name: unit}, with the values at the start in `start`. `derivatives(self, t, x, u)` returns {state: rate}, and
/// `evaluate(self, t, x, u)` returns {output: value}; with `direct_feedthrough = False` it is `evaluate(self, t, x)`. The integrator calls both,
/// so they must not keep anything in `self`.
///
/// Examples
/// --------
/// >>> sim = linkwork.Simulation("sims/pendulum")
/// >>> sim.run_until("1 s")
/// >>> round(sim["bob.angle"], 6)
/// -0.993435
/// >>> "bob.rate" in sim, "bob.colour" in sim
/// (True, False)
#[pyclass(frozen, weakref, module = "linkwork")]
pub struct Simulation {
    plan: Arc<Plan>,
    program: Arc<Program>,
    configuration: String,
    /// Visual shapes of each phase.
    shapes: Arc<Vec<Vec<BodyShape>>>,
    rules: Vec<LogRule>,
    until: Option<Seconds>,
    stop_when: Option<u32>,
    running: Mutex<Running>,
    busy: AtomicBool,
    /// Number of threads that wait for access while the run steps.
    waiting: AtomicUsize,
}

/// Releases the simulation at the end of a call, also after an error.
struct Busy<'a>(&'a AtomicBool);

impl Drop for Busy<'_> {
    fn drop(&mut self) {
        self.0.store(false, Ordering::SeqCst);
    }
}

impl Simulation {
    /// Creates a run at its start. `until` replaces the end time of the file.
    pub fn from_ready(py: Python<'_>, ready: Ready, until: Option<Seconds>) -> PyResult<Self> {
        let stop_when = ready.loaded.simulation.stop_when.as_ref().map(|_| 0);
        let file = ready.loaded.simulation;
        let program = Arc::new(ready.program);
        let sim = runtime::Simulation::of(program.clone());
        // An exception of a part is reported at the first tick.
        sim.check().map_err(|e| parts::raised(py, run_failed(&e)))?;
        Ok(Self {
            plan: program.phases[0].plan.clone(),
            program,
            configuration: ready.loaded.resolved.to_string(),
            shapes: Arc::new(ready.loaded.phase_shapes),
            rules: file.log,
            until: until.or(file.until),
            stop_when,
            running: Mutex::new(Running::new(sim)),
            busy: AtomicBool::new(false),
            waiting: AtomicUsize::new(0),
        })
    }

    /// Calls `f` with the run. While this call waits for access, other Python threads continue. A part that the run evaluates cannot call it.
    fn with<R: Send>(
        &self,
        py: Python<'_>,
        f: impl FnOnce(&mut Running) -> R + Send,
    ) -> PyResult<R> {
        if parts::inside() {
            return Err(refuse_with(
                "a part accesses the simulation that runs it",
                "declare the values that it needs in `inputs`, and wire them",
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
            return Err(refuse_with(
                "a part advances a simulation",
                "advance it outside of `step`",
            ));
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
                // The lock is not fair, so waiting threads go first for a while.
                for _ in 0..1000 {
                    if this.waiting.load(Ordering::SeqCst) == 0 {
                        break;
                    }
                    std::thread::yield_now();
                }
                lock(&this.running).go(&mut goal)
            });
            let told = lock(&this.running).runner().new_notices();
            for (t, fault) in told {
                let help = fault.help.map_or(String::new(), |help| format!("\n  help: {help}"));
                let text = format!("t = {t} s: {}{help}", fault.message).replace('\0', " ");
                let text = std::ffi::CString::new(text).unwrap_or_default();
                let category = py.get_type::<pyo3::exceptions::PyUserWarning>();
                PyErr::warn(py, &category, &text, 1)?;
            }
            match stopped {
                Stopped::Done => return Ok(()),
                Stopped::Chunk => {}
                Stopped::Failed(e) => return Err(parts::raised(py, run_failed(&e))),
                Stopped::Recording(e) => {
                    return Err(refuse_with(e, "the run can continue without the recording"));
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
}

#[pymethods]
impl Simulation {
    #[new]
    #[pyo3(signature = (path, overrides=None, *, seed=None, until=None, models=None))]
    fn new(
        py: Python<'_>,
        path: PathBuf,
        overrides: Option<&Bound<'_, PyDict>>,
        #[pyo3(from_py_with = seed_or_none)] seed: Option<u64>,
        until: Option<&Bound<'_, PyAny>>,
        models: Option<&Bound<'_, PyDict>>,
    ) -> PyResult<Self> {
        let set = self::overrides(overrides)?;
        let until = until.map(|u| seconds(u, "until")).transpose()?;
        let models = parts::entries(models)?;
        let ready = py.detach(|| files::simulation(&path, &set, seed, models)).map_err(refuse)?;
        Self::from_ready(py, ready, until)
    }

    /// Return a run in the state of a checkpoint. It continues bit-identically.
    ///
    /// The checkpoint contains the whole configuration, so no other file is needed except `models`.
    ///
    /// Parameters
    /// ----------
    /// path : str or path-like
    ///     A .lwck file that `save` or the command line wrote.
    /// until : float or str, optional
    ///     End time of `run()`, s, or a text such as "2 min"; replaces that of the checkpoint.
    /// models : dict, optional
    ///     As in the constructor.
    ///
    /// Returns
    /// -------
    /// Simulation
    ///     The run.
    ///
    /// Raises
    /// ------
    /// LinkworkError
    ///     If the file is not a complete checkpoint, or one of its models is missing.
    ///
    /// Examples
    /// --------
    /// >>> sim.save("here.lwck")
    /// >>> linkwork.Simulation.resume("here.lwck").time
    /// 1.0
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
                format!(
                    "{e}\n  help: give a complete .lwck file that `save` or `linkwork run` wrote"
                )
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

    /// Write a checkpoint (.lwck), from which `resume` or `linkwork resume` continues.
    ///
    /// Parameters
    /// ----------
    /// path : str or path-like
    ///     The file. If it is a symbolic link, the file to which it points is written.
    ///
    /// Raises
    /// ------
    /// LinkworkError
    ///     If a Python part does not support saving, or the file cannot be written.
    ///
    /// Examples
    /// --------
    /// >>> sim.save("here.lwck")
    /// >>> linkwork.Simulation.resume("here.lwck").state_hash == sim.state_hash
    /// True
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

    /// Return an independent copy of the run in its present state, without its logs and callbacks.
    ///
    /// Returns
    /// -------
    /// Simulation
    ///     The copy.
    ///
    /// Raises
    /// ------
    /// LinkworkError
    ///     If a Python part does not support saving.
    ///
    /// Examples
    /// --------
    /// >>> other = sim.fork()
    /// >>> other["bob.rate"] = 0.0
    /// >>> other.run_until(2)
    /// >>> sim.time, other.time
    /// (1.0, 2.0)
    fn fork(&self, py: Python<'_>) -> PyResult<Self> {
        let forked = self.with(py, |r| r.sim().can_save().map(|()| r.sim().fork()))?;
        let forked = forked.map_err(|e| parts::raised(py, refuse(e)))?;
        Ok(Self {
            plan: self.plan.clone(),
            program: self.program.clone(),
            configuration: self.configuration.clone(),
            shapes: self.shapes.clone(),
            rules: self.rules.clone(),
            until: self.until,
            stop_when: self.stop_when,
            running: Mutex::new(Running::new(forked)),
            busy: AtomicBool::new(false),
            waiting: AtomicUsize::new(0),
        })
    }

    /// Simulated time, s.
    ///
    /// Examples
    /// --------
    /// >>> sim.time
    /// 1.0
    #[getter]
    fn time(&self, py: Python<'_>) -> PyResult<f64> {
        self.with(py, |r| r.sim().time())
    }
    /// Integration step, s.
    ///
    /// Examples
    /// --------
    /// >>> sim.dt
    /// 0.001
    #[getter]
    fn dt(&self) -> f64 {
        self.plan.step.seconds()
    }
    /// End time of `run()`, s; None if there is none.
    ///
    /// Examples
    /// --------
    /// >>> sim.until
    /// 20.0
    #[getter]
    fn until(&self) -> Option<f64> {
        self.until.map(Seconds::seconds)
    }
    /// Seed of all noise.
    ///
    /// Examples
    /// --------
    /// >>> linkwork.Simulation("sims/pendulum", seed=5).seed
    /// 5
    #[getter]
    fn seed(&self) -> u64 {
        self.plan.seed
    }
    /// Hash of the state, as in summary.json of the command line. States with equal hashes are bit-identical.
    ///
    /// Examples
    /// --------
    /// >>> again = linkwork.Simulation("sims/pendulum")
    /// >>> again.run_until(1)
    /// >>> again.state_hash == sim.state_hash
    /// True
    #[getter]
    fn state_hash(&self, py: Python<'_>) -> PyResult<String> {
        self.with(py, |r| format!("{:016x}", r.sim().hash()))
    }
    /// The whole configuration as one RON text that needs no other file.
    ///
    /// Examples
    /// --------
    /// >>> sim.configuration.startswith("Simulation(")
    /// True
    #[getter]
    fn configuration(&self) -> &str {
        &self.configuration
    }

    /// Make n steps.
    ///
    /// Parameters
    /// ----------
    /// n : int
    ///     Number of steps (default: 1).
    ///
    /// Raises
    /// ------
    /// LinkworkError
    ///     If a state diverges (NaN or infinite), or if called inside a function of `at` or `every`.
    ///
    /// Examples
    /// --------
    /// >>> sim.step(5)
    /// >>> sim.time
    /// 1.005
    #[pyo3(signature = (n=1))]
    fn step(slf: &Bound<'_, Self>, n: u64) -> PyResult<()> {
        Self::advance(slf, Goal { steps: Some(n), ..Goal::default() })
    }
    /// Advance to the next step or event.
    ///
    /// Events at the same instant are returned one at a time. After an event, the state and `time` are those of the event.
    ///
    /// Returns
    /// -------
    /// str
    ///     "row" for a step, "event" for an event.
    ///
    /// Raises
    /// ------
    /// LinkworkError
    ///     If a state diverges (NaN or infinite), or if called inside a function of `at` or `every`.
    ///
    /// Examples
    /// --------
    /// >>> ball = linkwork.Simulation("sims/bouncing_ball")
    /// >>> while ball.step_event() != "event": pass
    /// >>> ball["Ball.impacts"]
    /// 1.0
    fn step_event(slf: &Bound<'_, Self>) -> PyResult<&'static str> {
        Self::advance(slf, Goal { events: Some(1), ..Goal::default() })?;
        let at_row = slf.get().with(slf.py(), |r| r.sim().state().since == 0.0)?;
        Ok(if at_row { "row" } else { "event" })
    }
    /// Run to the first tick at or after a time.
    ///
    /// Splitting a run into several calls does not affect the result: it is bit-identical.
    ///
    /// Parameters
    /// ----------
    /// t : float or str
    ///     Time since the start of the simulation, s, or a text such as "2 min".
    ///
    /// Raises
    /// ------
    /// LinkworkError
    ///     If the time is a step or more in the past, or a state diverges.
    ///
    /// Examples
    /// --------
    /// >>> sim.run_until("1500 ms")
    /// >>> sim.time
    /// 1.5
    fn run_until(slf: &Bound<'_, Self>, t: &Bound<'_, PyAny>) -> PyResult<()> {
        let until = seconds(t, "t")?;
        let (to, now) = (until.seconds(), slf.get().time(slf.py())?);
        if to + slf.get().dt() <= now {
            return Err(refuse_with(
                format!("the simulation is already at {now} s, after {to} s"),
                "give a later time, counted from the start, such as run_until(sim.time + 1)",
            ));
        }
        Self::advance(slf, Goal { until: Some(until), ..Goal::default() })
    }
    /// Run to `until`, or until the `stop_when` of the file is true.
    ///
    /// Raises
    /// ------
    /// LinkworkError
    ///     If the run has neither, or a state diverges (NaN or infinite).
    ///
    /// Examples
    /// --------
    /// >>> brief = linkwork.Simulation("sims/pendulum", until=0.5)
    /// >>> brief.run()
    /// >>> brief.time
    /// 0.5
    fn run(slf: &Bound<'_, Self>) -> PyResult<()> {
        let this = slf.get();
        if this.until.is_none() && this.stop_when.is_none() {
            return Err(refuse_with(
                "the simulation does not have an end time or a stop condition",
                "give until=.., write `until` in the file, or call run_until(t)",
            ));
        }
        Self::advance(slf, Goal { until: this.until, stop_when: this.stop_when, ..Goal::default() })
    }

    /// Call a function periodically during the run.
    ///
    /// It is called as `function(simulation)` at the first tick at or after each multiple of 1/rate, before the samples of that tick are logged. It
    /// may read and set variables. If it raises, the run stops at that tick.
    ///
    /// Parameters
    /// ----------
    /// rate : float
    ///     Calls per second, Hz.
    /// function : callable
    ///     The function.
    ///
    /// Raises
    /// ------
    /// LinkworkError
    ///     If the rate is not positive, or `function` is not callable.
    ///
    /// Examples
    /// --------
    /// >>> seen = []
    /// >>> sim.at(10, lambda s: seen.append(s.time))
    /// >>> sim.run_until(1.25)
    /// >>> seen
    /// [1.0, 1.1, 1.2]
    fn at(&self, py: Python<'_>, rate: f64, function: Py<PyAny>) -> PyResult<()> {
        self.call(py, period(rate)?, function)
    }
    /// Call a function periodically during the run, as `at`, with a period instead of a rate.
    ///
    /// Parameters
    /// ----------
    /// seconds : float or str
    ///     Period, s, or a text such as "20 ms".
    /// function : callable
    ///     The function.
    ///
    /// Raises
    /// ------
    /// LinkworkError
    ///     If the period is not positive, or `function` is not callable.
    ///
    /// Examples
    /// --------
    /// >>> seen = []
    /// >>> sim.every("0.1 s", lambda s: seen.append(s.time))
    /// >>> sim.run_until(1.25)
    /// >>> seen
    /// [1.0, 1.1, 1.2]
    fn every(
        &self,
        py: Python<'_>,
        seconds: &Bound<'_, PyAny>,
        function: Py<PyAny>,
    ) -> PyResult<()> {
        let period = self::seconds(seconds, "seconds")?;
        if period.num == 0 {
            return Err(refuse_with("`seconds` is 0", "give a positive time, or use step()"));
        }
        self.call(py, period, function)
    }

    /// Name of the present phase; empty for a simulation without phases.
    ///
    /// Examples
    /// --------
    /// >>> sim.phase
    /// ''
    #[getter]
    fn phase(&self, py: Python<'_>) -> PyResult<String> {
        self.with(py, |r| r.sim().phase().to_owned())
    }

    /// The mechanism of the present phase; its q and v are those of this simulation.
    ///
    /// Raises
    /// ------
    /// LinkworkError
    ///     If the simulation does not have a mechanism.
    ///
    /// Examples
    /// --------
    /// >>> float(sim.mechanism.potential_energy(sim.q)) < 0
    /// True
    #[getter]
    fn mechanism(&self, py: Python<'_>) -> PyResult<Mechanism> {
        let plan = self.with(py, |r| r.sim().plan().clone())?;
        let m = plan.mechanism().ok_or_else(no_mechanism)?;
        let gravity = m.uniform.unwrap_or(GRAVITY);
        let mut core = Core::new((*m.multibody).clone(), gravity)?;
        let phase = self.with(py, |r| r.sim().phase().to_owned())?;
        let place = self.program.phases.iter().position(|p| p.name == phase);
        core.shapes = place.and_then(|k| self.shapes.get(k)).cloned().unwrap_or_default();
        Ok(Mechanism { core: Arc::new(core) })
    }

    /// Show the bodies in the Rerun viewer at the present time.
    ///
    /// Each further call adds the state at its time to the timeline "time" (s), so a call from `every` records a film. Bodies have the shapes of the
    /// file for the present phase. Needs the package rerun-sdk (`pip install linkwork[rerun]`). For trajectories, plots and camera images, use
    /// `record` and `linkwork view`.
    ///
    /// Parameters
    /// ----------
    /// path : str or path-like, optional
    ///     Write a recording (.rrd) to this file instead of opening the viewer. Another path begins another recording.
    ///
    /// Raises
    /// ------
    /// LinkworkError
    ///     If the simulation does not have a mechanism, or rerun-sdk is not installed.
    ///
    /// Examples
    /// --------
    /// >>> sim.show(path="now.rrd")
    #[pyo3(signature = (*, path=None))]
    fn show(slf: &Bound<'_, Self>, path: Option<PathBuf>) -> PyResult<()> {
        let drawing = crate::scene::drawing(slf.py())?;
        drawing.call_method1("simulation", (slf, path)).map(|_| ())
    }
    /// Present configuration of the mechanism (nq,), rad and m; a copy.
    ///
    /// Raises
    /// ------
    /// LinkworkError
    ///     If the simulation does not have a mechanism.
    ///
    /// Examples
    /// --------
    /// >>> float(sim.q[0]) == sim["bob.angle"]
    /// True
    #[getter]
    fn q<'py>(&self, py: Python<'py>) -> PyResult<Array1<'py>> {
        let read = |r: &mut Running| {
            let sim = r.sim();
            let m = sim.plan().mechanism()?;
            Some(sim.state().x[m.x..m.x + m.multibody.nq()].to_vec())
        };
        Ok(out1(py, self.with(py, read)?.ok_or_else(no_mechanism)?))
    }
    /// Present rates of the mechanism (nv,), rad/s and m/s; a copy.
    ///
    /// Raises
    /// ------
    /// LinkworkError
    ///     If the simulation does not have a mechanism.
    ///
    /// Examples
    /// --------
    /// >>> float(sim.v[0]) == sim["bob.rate"]
    /// True
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

    /// Callbacks often refer to the simulation that holds them; this makes the cycle visible to the garbage collector.
    fn __traverse__(&self, visit: PyVisit<'_>) -> Result<(), PyTraverseError> {
        // A simulation that is stepping is in use, so its references need not be visited.
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

impl Simulation {
    fn call(&self, py: Python<'_>, period: Seconds, function: Py<PyAny>) -> PyResult<()> {
        if !function.bind(py).is_callable() {
            return Err(refuse_with(
                "`function` is not callable",
                "give a function of one argument",
            ));
        }
        self.with(py, |r| {
            r.runner().call(period);
            r.calls.push(function);
        })
    }
}
