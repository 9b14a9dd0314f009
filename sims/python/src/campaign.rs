//! `Campaign`: many runs of one simulation with randomly drawn values, with the functions behind `linkwork campaign`.
use crate::core::lock;
use crate::error::{refuse, refuse_with};
use crate::files::library_with;
use crate::parts;
use crate::patience::patiently;
use crate::rules::recording;
use crate::running::RECORDING;
use crate::simulation::Simulation;
use crate::values::object;
use linkwork_assembly::{Look, show_faults};
use linkwork_campaign::{self as campaign, Begun, Folder, LoadError, Means, Orders, end, one};
use linkwork_runner::{Library, Need, Stop, Watch as _};
use pyo3::exceptions::PyUserWarning;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use std::path::{Path, PathBuf};
use std::sync::Mutex;

mod results;
pub use results::{Outcome, Results};

/// Many runs of one simulation with randomly drawn values, as `linkwork campaign FILE` makes them.
///
/// A run is a pure function of the file and the number of the run. Results therefore do not depend on the machine, the number of threads, or
/// interruptions of the campaign.
///
/// Parameters
/// ----------
/// path : str or path-like
///     A RON file that begins with `Campaign(`. Its simulation is loaded once with the median of every distribution; warnings about it are
///     emitted as Python warnings.
/// models : dict, optional
///     {name: class}: models that are Python classes; see `Simulation`. Their source text is part of `identity`.
///
/// Raises
/// ------
/// LinkworkError
///     If the file has mistakes. The message lists all of them, each with its position.
///
/// Examples
/// --------
/// >>> import pathlib
/// >>> text = 'Campaign(simulation: "sims/pendulum", runs: 4, set: {"until": "2 s"}, vary: {"bob.mass": Uniform(from: "0.5 kg", to: "2 kg")})'
/// >>> _ = pathlib.Path("masses.ron").write_text(text)
/// >>> campaign = linkwork.Campaign("masses.ron")
/// >>> campaign
/// Campaign("masses", 4 runs of sims/pendulum)
/// >>> campaign.execute("out").done
/// 4
#[pyclass(frozen, weakref, module = "linkwork")]
pub struct Campaign {
    campaign: campaign::Campaign,
    library: Library,
    path: PathBuf,
    models: Option<Py<PyDict>>,
}

impl Campaign {
    /// Returns an error if there is no run with this number.
    fn check(&self, run: u64) -> PyResult<()> {
        let runs = self.campaign.form().runs;
        match run < runs {
            true => Ok(()),
            false => Err(refuse(campaign::MakeError::Number { run, runs })),
        }
    }

    fn outcome(&self, outcome: campaign::Outcome) -> Outcome {
        let names = self.campaign.metrics().iter().map(|(name, _)| name.clone()).collect();
        Outcome { outcome, names }
    }

    fn open(&self, py: Python<'_>, path: &Path) -> PyResult<Folder> {
        let folder = Folder::open(path, &self.campaign).map_err(refuse)?;
        for (line, why) in &folder.journal.damaged {
            let journal = Folder::journal_in(path);
            let fact = format!("the journal `{}`, line {line}: {why}", journal.display());
            let text =
                std::ffi::CString::new(format!("{fact}; this run is repeated")).unwrap_or_default();
            PyErr::warn(py, &py.get_type::<pyo3::exceptions::PyUserWarning>(), &text, 1)?;
        }
        Ok(folder)
    }

    /// Writes the tables and the report of the runs that have ended.
    fn written(&self, py: Python<'_>, folder: &Folder, threads: usize) -> PyResult<Results> {
        // Parts in Python run in other threads, which need the interpreter's lock.
        let (results, files) = py.detach(|| folder.write(&self.campaign, threads));
        let files = files.map_err(|e| {
            refuse_with(
                e,
                "free disk space and repeat the call with the same folder; completed runs are kept",
            )
        })?;
        let runs = self.campaign.form().runs;
        Ok(Results { done: folder.journal.outcomes.len() as u64, runs, files, results })
    }
}

/// Calls `progress(done, failed, runs, left)`.
fn tell(py: Python<'_>, progress: Option<&Py<PyAny>>, p: &campaign::Progress) -> PyResult<()> {
    if let Some(f) = progress {
        let left = p.left.map(|left| left.as_secs_f64());
        f.call1(py, (p.done, p.failed, p.runs, left))?;
    }
    Ok(())
}

#[pymethods]
impl Campaign {
    #[new]
    #[pyo3(signature = (path, *, models=None))]
    fn new(py: Python<'_>, path: PathBuf, models: Option<Bound<'_, PyDict>>) -> PyResult<Self> {
        let library = library_with(parts::entries(models.as_ref())?).map_err(refuse)?;
        let campaign = py.detach(|| campaign::Campaign::read(&path, &library)).map_err(refuse)?;
        let (warnings, sources) = campaign.warnings();
        let category = py.get_type::<PyUserWarning>();
        for fault in warnings {
            let text = show_faults(std::slice::from_ref(fault), sources, Look::Plain);
            let text = std::ffi::CString::new(text.replace('\0', " "))?;
            PyErr::warn(py, &category, &text, 1)?;
        }
        let models = models.map(|models| models.copy().map(Bound::unbind)).transpose()?;
        Ok(Self { campaign, library, path, models })
    }

    /// The models that are Python classes, as passed.
    ///
    /// Examples
    /// --------
    /// >>> campaign.models is None
    /// True
    #[getter]
    fn models(&self, py: Python<'_>) -> PyResult<Option<Py<PyDict>>> {
        let copy = |models: &Py<PyDict>| models.bind(py).copy().map(Bound::unbind);
        self.models.as_ref().map(copy).transpose()
    }

    /// The path of the file, as passed.
    ///
    /// Examples
    /// --------
    /// >>> campaign.path.name
    /// 'masses.ron'
    #[getter]
    fn path(&self) -> &Path {
        &self.path
    }
    /// The name of the file without folder and suffix.
    ///
    /// Examples
    /// --------
    /// >>> campaign.name
    /// 'masses'
    #[getter]
    fn name(&self) -> &str {
        &self.campaign.form().name
    }
    /// The description in the file.
    ///
    /// Examples
    /// --------
    /// >>> linkwork.Campaign("sims/ballistic_entry/dispersions.ron").doc[:17]
    /// 'Entry dispersions'
    #[getter]
    fn doc(&self) -> &str {
        &self.campaign.form().doc
    }
    /// Number of runs. They are numbered from 0.
    ///
    /// Examples
    /// --------
    /// >>> campaign.runs
    /// 4
    #[getter]
    fn runs(&self) -> u64 {
        self.campaign.form().runs
    }
    /// Units of the metrics of a run: {name: unit}.
    ///
    /// Examples
    /// --------
    /// >>> campaign.metrics
    /// {'largest speed': 'rad/s'}
    #[getter]
    fn metrics<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let all = PyDict::new(py);
        self.campaign.metrics().iter().try_for_each(|(name, unit)| all.set_item(name, unit))?;
        Ok(all)
    }
    /// Units of the drawn values: {path: unit}; "" for values without a unit.
    ///
    /// Examples
    /// --------
    /// >>> campaign.drawn
    /// {'bob.mass': 'kg'}
    #[getter]
    fn drawn<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let all = PyDict::new(py);
        self.campaign.form().drawn.iter().try_for_each(|d| all.set_item(&d.name, &d.unit))?;
        Ok(all)
    }
    /// Hash of everything that determines the runs: the values in the file, the simulation, the contents of its files, the version.
    ///
    /// Examples
    /// --------
    /// >>> campaign.identity == linkwork.Campaign("masses.ron").identity
    /// True
    #[getter]
    fn identity(&self) -> String {
        format!("{:016x}", self.campaign.identity())
    }

    /// Return the values that a run draws.
    ///
    /// Parameters
    /// ----------
    /// run : int
    ///     Number of the run.
    ///
    /// Returns
    /// -------
    /// dict of str to float
    ///     {path: value}, each in its unit of `drawn`.
    ///
    /// Raises
    /// ------
    /// LinkworkError
    ///     If there is no run with this number.
    ///
    /// Examples
    /// --------
    /// >>> round(campaign.draws(0)["bob.mass"], 3)
    /// 1.108
    fn draws<'py>(&self, py: Python<'py>, run: u64) -> PyResult<Bound<'py, PyDict>> {
        self.check(run)?;
        let all = PyDict::new(py);
        for (d, value) in self.campaign.form().drawn.iter().zip(self.campaign.draws(run)) {
            all.set_item(&d.name, object(py, &value)?)?;
        }
        Ok(all)
    }

    /// Return a run as a Simulation at its start, with the values, seed and end time of the campaign.
    ///
    /// Parameters
    /// ----------
    /// run : int
    ///     Number of the run.
    ///
    /// Returns
    /// -------
    /// Simulation
    ///     The simulation.
    ///
    /// Raises
    /// ------
    /// LinkworkError
    ///     If there is no run with this number, the drawn values are not valid, or a file has changed.
    ///
    /// Examples
    /// --------
    /// >>> sim = campaign.simulation(0)
    /// >>> sim.mechanism.total_mass == campaign.draws(0)["bob.mass"]
    /// True
    fn simulation(&self, py: Python<'_>, run: u64) -> PyResult<Simulation> {
        self.check(run)?;
        let ready = py.detach(|| self.campaign.load(run, &self.library)).map_err(|e| match e {
            LoadError::Refused(failure) => refuse(failure),
            LoadError::Changed(file) => refuse(campaign::MakeError::Changed { file }),
        })?;
        let (until, _) = end(ready.loaded.simulation.until, self.campaign.until());
        Simulation::from_ready(py, ready, until)
    }

    /// Make one run and return its outcome.
    ///
    /// The result is bit-identical to that of `execute` and of the command line. Only the files that you request are written. Ctrl-C interrupts the
    /// run.
    ///
    /// Parameters
    /// ----------
    /// run : int
    ///     Number of the run.
    /// log : str or path-like, optional
    ///     Write the channels of the simulation's `log` to this MCAP file.
    /// checkpoint : str or path-like, optional
    ///     Write the last state to this .lwck file.
    ///
    /// Returns
    /// -------
    /// Outcome
    ///     How the run ended.
    ///
    /// Raises
    /// ------
    /// LinkworkError
    ///     If there is no run with this number, a file has changed, or a file cannot be written.
    ///
    /// Examples
    /// --------
    /// >>> outcome = campaign.run(0, log="run0.mcap")
    /// >>> outcome.ended, outcome.time
    /// ('until', 2.0)
    /// >>> linkwork.read_log("run0.mcap")["bob.angle"].unit
    /// 'rad'
    #[pyo3(signature = (run, *, log=None, checkpoint=None))]
    fn run(
        &self,
        py: Python<'_>,
        run: u64,
        log: Option<PathBuf>,
        checkpoint: Option<PathBuf>,
    ) -> PyResult<Outcome> {
        let stop = Stop::default();
        let means = Means { library: &self.library, folder: None, stop: &stop };
        let make = || -> Result<Option<campaign::Outcome>, String> {
            let words = |e: campaign::MakeError| e.to_string();
            let mut under = match Begun::new(&self.campaign, run, &means).map_err(words)? {
                Begun::Under(under) => under,
                Begun::Ended(outcome) if log.is_none() && checkpoint.is_none() => {
                    return Ok(Some(outcome));
                }
                Begun::Ended(outcome) => {
                    return Err(format!("run {run} has no state to write: {}", outcome.why));
                }
            };
            if let Some(path) = &log {
                let (groups, text) =
                    (under.log_groups().to_vec(), under.configuration().to_string());
                let recorder = recording(under.runner().sim(), path, groups, &text)?;
                under.runner().add_recorder(RECORDING, Need::Must, recorder);
            }
            let outcome = under.go().map_err(words)?;
            under.runner().finish_tap(RECORDING)?;
            if let (Some(path), Some(outcome)) = (&checkpoint, &outcome) {
                if outcome.ended == campaign::Cause::Panicked {
                    return Err(format!(
                        "run {run} has no state to write: it stopped within a step: {}\n  help: `execute` keeps the \
                         last complete state of such runs in `failures`",
                        outcome.why
                    ));
                }
                let text = under.configuration().to_string();
                let mut made = under.runner().sim().checkpoint(&text).map_err(|e| e.to_string())?;
                under.runner().watch.carry(&mut made.extra)?;
                made.write(path).map_err(|e| e.to_string())?;
            }
            Ok(outcome)
        };
        let outcome = patiently(py, &stop, |_: std::sync::mpsc::Sender<()>| make(), |()| Ok(()));
        let outcome = outcome.or_raise()?.map_err(refuse)?;
        // An interruption without an exception cannot occur.
        let outcome = outcome.ok_or_else(|| refuse("the run was interrupted"))?;
        Ok(self.outcome(outcome))
    }

    /// Make all runs that have not ended yet, and write the results into a folder.
    ///
    /// The files are identical to those of `linkwork campaign`: the journal; results, statistics, sensitivity and bands as .csv and .parquet;
    /// report.html; a file per run in `histories` if the campaign retains variables; a folder per failed run in `failures`.
    ///
    /// Parameters
    /// ----------
    /// folder : str or path-like
    ///     The folder.
    /// threads : int, optional
    ///     Number of threads (default: one per core).
    /// progress : callable, optional
    ///     Called with (done, failed, runs, left) at the start and after each run. `left` is the estimated remaining time, s, or None.
    ///
    /// Returns
    /// -------
    /// Results
    ///     The results. Failed runs do not raise; they are in `Results.failures`.
    ///
    /// Raises
    /// ------
    /// LinkworkError
    ///     If the folder belongs to another campaign or is in use, a file has changed, or the disk is full.
    ///
    /// Notes
    /// -----
    /// Ctrl-C, or an exception in `progress`, stops the campaign. The files then contain all runs that have ended, and the same call continues the
    /// campaign.
    ///
    /// Examples
    /// --------
    /// >>> seen = []
    /// >>> results = campaign.execute("more", threads=2, progress=lambda *p: seen.append(p[0]))
    /// >>> results, seen
    /// (Results(4 of 4 runs), [0, 1, 2, 3, 4])
    #[pyo3(signature = (folder, *, threads=None, progress=None))]
    fn execute(
        &self,
        py: Python<'_>,
        folder: PathBuf,
        threads: Option<usize>,
        progress: Option<Py<PyAny>>,
    ) -> PyResult<Results> {
        if threads == Some(0) {
            return Err(refuse_with("`threads` is 0", "give 1 or more, or omit it"));
        }
        let threads = threads.unwrap_or_else(cores);
        let mut folder = self.open(py, &folder)?;
        let stop = Stop::default();
        let orders = Orders { library: &self.library, threads, stop: stop.clone() };
        let gathered = &mut folder;
        let ended = patiently(
            py,
            &stop,
            |told: std::sync::mpsc::Sender<campaign::Progress>| {
                campaign::execute(&self.campaign, &orders, gathered, |p| {
                    // The receiver is gone only after an exception; the value is then not needed.
                    let _ = told.send(*p);
                })
            },
            |p| tell(py, progress.as_ref(), &p),
        );
        // The results of the finished runs are written even if the campaign cannot continue.
        let written = self.written(py, &folder, threads);
        ended.or_raise()?.map_err(refuse)?;
        written
    }

    /// For programs that distribute runs: makes the given runs and returns one line of text per run.
    #[pyo3(signature = (runs, folder))]
    fn _make(&self, py: Python<'_>, runs: Vec<u64>, folder: PathBuf) -> PyResult<Vec<String>> {
        let stop = Stop::default();
        let means = Means { library: &self.library, folder: Some(&folder), stop: &stop };
        let make = || -> Result<Vec<String>, String> {
            let mut lines = Vec::new();
            for run in runs {
                let made = one(&self.campaign, run, &means).map_err(|e| e.to_string())?;
                let Some(outcome) = made else { break };
                lines.push(outcome.to_text().map_err(|e| e.to_string())?);
            }
            Ok(lines)
        };
        let lines = patiently(py, &stop, |_: std::sync::mpsc::Sender<()>| make(), |()| Ok(()));
        lines.or_raise()?.map_err(refuse)
    }

    /// For programs that distribute runs: returns the folder that collects the lines of `_make`.
    fn _gather(slf: Py<Self>, py: Python<'_>, folder: PathBuf) -> PyResult<Gathering> {
        let folder = slf.bind(py).get().open(py, &folder)?;
        Ok(Gathering { campaign: slf, folder: Mutex::new(Some(folder)) })
    }

    fn __repr__(&self) -> String {
        let form = self.campaign.form();
        format!("Campaign(\"{}\", {} runs of {})", form.name, form.runs, form.simulation.display())
    }
}

/// Returns the number of cores.
fn cores() -> usize {
    std::thread::available_parallelism().map_or(1, usize::from)
}

/// The folder of a campaign whose runs are made elsewhere.
#[pyclass(frozen, name = "_Gathering", module = "linkwork")]
pub struct Gathering {
    campaign: Py<Campaign>,
    folder: Mutex<Option<Folder>>,
}

impl Gathering {
    fn with<R>(&self, f: impl FnOnce(&mut Folder) -> PyResult<R>) -> PyResult<R> {
        let mut folder = lock(&self.folder);
        f(folder.as_mut().ok_or_else(|| refuse("the folder is closed"))?)
    }
}

#[pymethods]
impl Gathering {
    /// Returns the runs that have not ended yet, and those whose history file is missing.
    fn todo(&self, py: Python<'_>) -> PyResult<Vec<u64>> {
        let campaign = &self.campaign.bind(py).get().campaign;
        self.with(|f| Ok(f.todo(campaign)))
    }
    /// Returns (number of runs that have ended, number of failed runs among them).
    fn counts(&self) -> PyResult<(usize, usize)> {
        self.with(|f| {
            let all = &f.journal.outcomes;
            Ok((all.len(), all.values().filter(|o| !o.ended.is_orderly()).count()))
        })
    }
    /// Adds a line that `_make` returned. Returns the number of the run and its wall time, s.
    fn add(&self, py: Python<'_>, line: &str) -> PyResult<(u64, f64)> {
        let campaign = &self.campaign.bind(py).get().campaign;
        let outcome = campaign::Outcome::from_text(line).map_err(refuse)?;
        let (run, wall, metrics) = (outcome.run, outcome.wall, outcome.metrics.len());
        if run >= campaign.form().runs || ![0, campaign.metrics().len()].contains(&metrics) {
            return Err(refuse(format!(
                "run {run} with {metrics} metrics does not belong to this campaign"
            )));
        }
        self.with(|f| f.add(outcome).map_err(refuse))?;
        Ok((run, wall))
    }
    /// The folder in which runs write their files.
    #[getter]
    fn path(&self) -> PyResult<PathBuf> {
        self.with(|f| Ok(f.path().to_path_buf()))
    }
    /// Writes the tables and the report, and closes the folder.
    fn finish(&self, py: Python<'_>) -> PyResult<Results> {
        let taken = lock(&self.folder).take();
        let mut folder = taken.ok_or_else(|| refuse("the folder is closed"))?;
        folder.journal.sync().map_err(refuse)?;
        self.campaign.bind(py).get().written(py, &folder, cores())
    }
}
