//! `Campaign`: many runs of one simulation with drawn values, by the functions that `linkwork campaign` runs by.
use crate::core::lock;
use crate::error::{refuse, refuse_with};
use crate::package;
use crate::patience::patiently;
use crate::rules::recording;
use crate::running::RECORDING;
use crate::simulation::Simulation;
use crate::values::object;
use linkwork_assembly::{Look, show_faults};
use linkwork_campaign::{
    self as campaign, Begun, Column, Folder, LoadError, Means, Orders, Table, end, one,
};
use linkwork_runner::{Library, Need, Stop, Watch as _};
use numpy::PyArray1;
use pyo3::exceptions::PyUserWarning;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use std::path::{Path, PathBuf};
use std::sync::Mutex;

/// Many runs of one simulation with values drawn from distributions, as `linkwork campaign FILE` makes them: a run is
/// a pure function of the file and its number, so that results do not depend on the machine, the number of threads,
/// or how often the campaign was stopped.
///
/// path: a RON file that begins with `Campaign(`. The simulation that it names is loaded once with every distribution
/// at its middle; remarks about it are warnings. Raises LinkworkError with every mistake, each with its place.
///
/// >>> campaign = linkwork.Campaign("sims/ballistic_entry/dispersions.ron")
/// >>> campaign.run(17).figures["peak heating"] > 0
/// True
/// >>> results = campaign.execute("runs/dispersions", threads=4)  # doctest: +SKIP
/// >>> results.table["peak heating [W/cm^2]"].mean()  # doctest: +SKIP
#[pyclass(frozen, weakref, module = "linkwork")]
pub struct Campaign {
    campaign: campaign::Campaign,
    library: Library,
    path: PathBuf,
}

impl Campaign {
    /// That there is a run of this number.
    fn check(&self, run: u64) -> PyResult<()> {
        let runs = self.campaign.form().runs;
        match run < runs {
            true => Ok(()),
            false => Err(refuse(campaign::MakeError::Number { run, runs })),
        }
    }

    fn outcome(&self, outcome: campaign::Outcome) -> Outcome {
        let names = self.campaign.figures().iter().map(|(name, _)| name.clone()).collect();
        Outcome { outcome, names }
    }

    fn open(&self, folder: &Path) -> PyResult<Folder> {
        Folder::open(folder, &self.campaign).map_err(refuse)
    }

    /// Writes tables and report of what has ended.
    fn written(&self, folder: &Folder) -> PyResult<Results> {
        let (results, files) = folder.write(&self.campaign);
        let files = files.map_err(|e| {
            refuse_with(e, "make room and call it again with the same folder: no run is lost")
        })?;
        let runs = self.campaign.form().runs;
        Ok(Results { done: folder.journal.outcomes.len() as u64, runs, files, results })
    }
}

/// `progress(done, failed, runs, left)`.
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
    fn new(py: Python<'_>, path: PathBuf) -> PyResult<Self> {
        let library = package::library();
        let campaign = py.detach(|| campaign::Campaign::read(&path, &library)).map_err(refuse)?;
        let (warnings, sources) = campaign.warnings();
        let category = py.get_type::<PyUserWarning>();
        for fault in warnings {
            let text = show_faults(std::slice::from_ref(fault), sources, Look::Plain);
            let text = std::ffi::CString::new(text.replace('\0', " "))?;
            PyErr::warn(py, &category, &text, 1)?;
        }
        Ok(Self { campaign, library, path })
    }

    /// The file, as given.
    #[getter]
    fn path(&self) -> &Path {
        &self.path
    }
    /// The file without its folder and ending.
    #[getter]
    fn name(&self) -> &str {
        &self.campaign.form().name
    }
    /// What it is for.
    #[getter]
    fn doc(&self) -> &str {
        &self.campaign.form().doc
    }
    /// The number of runs; they are numbered from 0.
    #[getter]
    fn runs(&self) -> u64 {
        self.campaign.form().runs
    }
    /// {name: unit} of the figures of a run.
    #[getter]
    fn figures<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let all = PyDict::new(py);
        self.campaign.figures().iter().try_for_each(|(name, unit)| all.set_item(name, unit))?;
        Ok(all)
    }
    /// {path: unit} of the drawn values; "" for those without one.
    #[getter]
    fn drawn<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let all = PyDict::new(py);
        self.campaign.form().drawn.iter().try_for_each(|d| all.set_item(&d.name, &d.unit))?;
        Ok(all)
    }
    /// Hash of all that decides the runs: the file's values, the simulation, the contents of its files, the version.
    #[getter]
    fn identity(&self) -> String {
        format!("{:016x}", self.campaign.identity())
    }

    /// {path: value} of what run `run` draws, each in its unit of `drawn`.
    fn draws<'py>(&self, py: Python<'py>, run: u64) -> PyResult<Bound<'py, PyDict>> {
        self.check(run)?;
        let all = PyDict::new(py);
        for (d, value) in self.campaign.form().drawn.iter().zip(self.campaign.draws(run)) {
            all.set_item(&d.name, object(py, &value)?)?;
        }
        Ok(all)
    }

    /// Run `run` as a Simulation at its start, with the values, seed and end that the campaign gives it.
    fn simulation(&self, py: Python<'_>, run: u64) -> PyResult<Simulation> {
        self.check(run)?;
        let ready = py.detach(|| self.campaign.load(run, &self.library)).map_err(|e| match e {
            LoadError::Refused(failure) => refuse(failure),
            LoadError::Changed(file) => refuse(campaign::MakeError::Changed { file }),
        })?;
        let (until, _) = end(ready.loaded.simulation.until, self.campaign.until());
        Simulation::from_ready(py, ready, until)
    }

    /// Makes run `run` and gives how it ended: the same bits as in `execute` and on the command line. It writes nothing
    /// but what is asked for. log: an MCAP file of what the simulation's `log` says. checkpoint: a .lwck file of the
    /// last state. Ctrl-C gives it up.
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
                let tap = recording(under.runner().sim(), path, groups, &text)?;
                under.runner().tap(RECORDING, Need::Must, tap);
            }
            let outcome = under.go().map_err(words)?;
            under.runner().finish_tap(RECORDING)?;
            if let (Some(path), Some(outcome)) = (&checkpoint, &outcome) {
                if outcome.ended == campaign::Cause::Panicked {
                    return Err(format!(
                        "run {run} has no state to write: it was in the midst of a step: {}\n  help: `execute` keeps the \
                         last whole state of such runs in `failures`",
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
        // Only what was raised stops it.
        let outcome = outcome.ok_or_else(|| refuse("the run was given up"))?;
        Ok(self.outcome(outcome))
    }

    /// Makes all runs that have not ended yet, and writes into `folder` what `linkwork campaign` writes, byte for byte:
    /// the journal, results, statistics, sensitivity and bands as .csv and .parquet, report.html, for each run a file in
    /// `histories` when the campaign retains variables, and for each failed run a folder in `failures`. threads: as many as there are cores when left out. progress: a function of
    /// (done, failed, runs, left), left in s or None, called at the start and after
    /// each run.
    ///
    /// Ctrl-C, and what `progress` raises, stop it: the files hold what has ended, and the same call goes on. Runs that
    /// fail do not raise: they are in `Results.failures`. Raises LinkworkError when the folder belongs to another
    /// campaign or is in use, a file has changed, or the disk is full.
    #[pyo3(signature = (folder, *, threads=None, progress=None))]
    fn execute(
        &self,
        py: Python<'_>,
        folder: PathBuf,
        threads: Option<usize>,
        progress: Option<Py<PyAny>>,
    ) -> PyResult<Results> {
        if threads == Some(0) {
            return Err(refuse_with("`threads` is 0", "give 1 or more, or leave it out"));
        }
        let cores = || std::thread::available_parallelism().map_or(1, usize::from);
        let threads = threads.unwrap_or_else(cores);
        let mut folder = self.open(&folder)?;
        let stop = Stop::default();
        let orders = Orders { library: &self.library, threads, stop: stop.clone() };
        let gathered = &mut folder;
        let ended = patiently(
            py,
            &stop,
            |told: std::sync::mpsc::Sender<campaign::Progress>| {
                campaign::execute(&self.campaign, &orders, gathered, |p| {
                    // Nobody listens any more only when something was raised.
                    let _ = told.send(*p);
                })
            },
            |p| tell(py, progress.as_ref(), &p),
        );
        // What there is, is written, also when the campaign could not go on.
        let written = self.written(&folder);
        ended.or_raise()?.map_err(refuse)?;
        written
    }

    /// For programs that spread runs themselves: makes these runs, and gives each as a line of text.
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

    /// For programs that spread runs themselves: the folder in which the lines of `_make` are gathered.
    fn _gather(slf: Py<Self>, py: Python<'_>, folder: PathBuf) -> PyResult<Gathering> {
        let folder = slf.bind(py).get().open(&folder)?;
        Ok(Gathering { campaign: slf, folder: Mutex::new(Some(folder)) })
    }

    fn __repr__(&self) -> String {
        let form = self.campaign.form();
        format!("Campaign(\"{}\", {} runs of {})", form.name, form.runs, form.simulation.display())
    }
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
    /// Runs that have not ended yet, and those whose history is gone.
    fn todo(&self, py: Python<'_>) -> PyResult<Vec<u64>> {
        let campaign = &self.campaign.bind(py).get().campaign;
        self.with(|f| Ok(f.todo(campaign)))
    }
    /// (runs that ended, those of them that failed).
    fn counts(&self) -> PyResult<(usize, usize)> {
        self.with(|f| {
            let all = &f.journal.outcomes;
            Ok((all.len(), all.values().filter(|o| !o.ended.is_orderly()).count()))
        })
    }
    /// Adds a line that `_make` gave; gives its run, and the wall time that it took, s.
    fn add(&self, py: Python<'_>, line: &str) -> PyResult<(u64, f64)> {
        let campaign = &self.campaign.bind(py).get().campaign;
        let outcome = campaign::Outcome::from_text(line).map_err(refuse)?;
        let (run, wall, figures) = (outcome.run, outcome.wall, outcome.figures.len());
        if run >= campaign.form().runs || ![0, campaign.figures().len()].contains(&figures) {
            return Err(refuse(format!(
                "run {run} with {figures} figures is none of this campaign"
            )));
        }
        self.with(|f| f.add(outcome).map_err(refuse))?;
        Ok((run, wall))
    }
    /// Where runs leave their files.
    #[getter]
    fn path(&self) -> PyResult<PathBuf> {
        self.with(|f| Ok(f.path().to_path_buf()))
    }
    /// Writes tables and report, and closes the folder.
    fn finish(&self, py: Python<'_>) -> PyResult<Results> {
        let taken = lock(&self.folder).take();
        let mut folder = taken.ok_or_else(|| refuse("the folder is closed"))?;
        folder.journal.sync().map_err(refuse)?;
        self.campaign.bind(py).get().written(&folder)
    }
}

/// How a run of a campaign ended.
#[pyclass(frozen, weakref, module = "linkwork")]
pub struct Outcome {
    outcome: campaign::Outcome,
    names: Vec<String>,
}

#[pymethods]
impl Outcome {
    /// Its number.
    #[getter]
    fn run(&self) -> u64 {
        self.outcome.run
    }
    /// "until", "stop_when", "time_limit"; or, for a failure, "wall_limit", "failed", "refused", "panicked".
    #[getter]
    fn ended(&self) -> &str {
        self.outcome.ended.name()
    }
    /// Whether it came to an end that it was meant to have.
    #[getter]
    fn orderly(&self) -> bool {
        self.outcome.ended.is_orderly()
    }
    /// What went wrong; "" when nothing did.
    #[getter]
    fn why(&self) -> &str {
        &self.outcome.why
    }
    /// Simulated time at the end, s.
    #[getter]
    fn time(&self) -> f64 {
        self.outcome.time
    }
    /// Seed of its noise.
    #[getter]
    fn seed(&self) -> u64 {
        self.outcome.seed
    }
    /// Hash of the last state: equal hashes, equal bits. "0000000000000000" when there was none.
    #[getter]
    fn state_hash(&self) -> String {
        format!("{:016x}", self.outcome.hash)
    }
    /// Wall time that it took, s.
    #[getter]
    fn wall(&self) -> f64 {
        self.outcome.wall
    }
    /// {name: value} of its figures, in the units of `Campaign.figures`; empty when it had none.
    #[getter]
    fn figures<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let all = PyDict::new(py);
        let pairs = self.names.iter().zip(&self.outcome.figures);
        for (name, y) in pairs {
            all.set_item(name, *y)?;
        }
        Ok(all)
    }
    fn __repr__(&self) -> String {
        let Outcome { outcome: o, .. } = self;
        format!("Outcome(run {}, {} at {} s, {:016x})", o.run, o.ended.name(), o.time, o.hash)
    }
}

/// What came out of a campaign. Tables are {title: column}, as in the .csv files: numbers as arrays (rows,), texts as
/// lists; what is read is a copy.
#[pyclass(frozen, weakref, module = "linkwork")]
pub struct Results {
    done: u64,
    runs: u64,
    files: Vec<PathBuf>,
    results: campaign::Results,
}

fn columns<'py>(py: Python<'py>, table: &Table) -> PyResult<Bound<'py, PyDict>> {
    let all = PyDict::new(py);
    for (title, column) in &table.columns {
        match column {
            Column::Whole(v) => all.set_item(title, PyArray1::from_slice(py, v))?,
            Column::Number(v) => all.set_item(title, PyArray1::from_slice(py, v))?,
            Column::Text(v) => all.set_item(title, v)?,
        }
    }
    Ok(all)
}

#[pymethods]
impl Results {
    /// Runs that ended.
    #[getter]
    fn done(&self) -> u64 {
        self.done
    }
    /// All runs.
    #[getter]
    fn runs(&self) -> u64 {
        self.runs
    }
    /// The tables and the report.
    #[getter]
    fn files(&self) -> Vec<PathBuf> {
        self.files.clone()
    }
    /// A row for each run that ended, in their order: run, how it ended, drawn values ("draw:PATH [UNIT]"), figures.
    #[getter]
    fn table<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        columns(py, &self.results.runs)
    }
    /// A row for each figure: n, mean, deviation, error of the mean, percentiles.
    #[getter]
    fn statistics<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        columns(py, &self.results.statistics())
    }
    /// A row for each figure and drawn number: their rank correlation.
    #[getter]
    fn sensitivity<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        columns(py, &self.results.sensitivities())
    }
    /// {cause: runs} of the runs that failed; the most frequent cause first.
    #[getter]
    fn failures<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let all = PyDict::new(py);
        self.results.failures.iter().try_for_each(|(kind, runs)| all.set_item(kind, runs))?;
        Ok(all)
    }
    fn __repr__(&self) -> String {
        format!("Results({} of {} runs)", self.done, self.runs)
    }
}
