//! `Outcome` of a run of a campaign, and `Results` of all of them.
use linkwork_campaign::{self as campaign, Column, Table};
use numpy::PyArray1;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use std::path::PathBuf;

/// How a run of a campaign ended.
///
/// Examples
/// --------
/// >>> import pathlib
/// >>> text = 'Campaign(simulation: "sims/pendulum", runs: 4, set: {"until": "2 s"}, vary: {"bob.mass": Uniform(from: "0.5 kg", to: "2 kg")})'
/// >>> _ = pathlib.Path("masses.ron").write_text(text)
/// >>> campaign = linkwork.Campaign("masses.ron")
/// >>> outcome = campaign.run(3)
/// >>> outcome.metrics["largest speed"] > 0
/// True
#[pyclass(frozen, weakref, module = "linkwork")]
pub struct Outcome {
    pub(super) outcome: campaign::Outcome,
    pub(super) names: Vec<String>,
}

#[pymethods]
impl Outcome {
    /// Number of the run.
    ///
    /// Examples
    /// --------
    /// >>> outcome.run
    /// 3
    #[getter]
    fn run(&self) -> u64 {
        self.outcome.run
    }
    /// Reason of the end: "until", "stop_when", "time_limit"; or, for a failure, "wall_limit", "failed", "refused", "panicked".
    ///
    /// Examples
    /// --------
    /// >>> outcome.ended
    /// 'until'
    #[getter]
    fn ended(&self) -> &str {
        self.outcome.ended.name()
    }
    /// True if the run ended for one of the reasons for which it should end.
    ///
    /// Examples
    /// --------
    /// >>> outcome.orderly
    /// True
    #[getter]
    fn orderly(&self) -> bool {
        self.outcome.ended.is_orderly()
    }
    /// Error message of a failed run; "" otherwise.
    ///
    /// Examples
    /// --------
    /// >>> outcome.why
    /// ''
    #[getter]
    fn why(&self) -> &str {
        &self.outcome.why
    }
    /// Simulated time at the end, s.
    ///
    /// Examples
    /// --------
    /// >>> outcome.time
    /// 2.0
    #[getter]
    fn time(&self) -> f64 {
        self.outcome.time
    }
    /// Seed of the noise.
    ///
    /// Examples
    /// --------
    /// >>> outcome.seed == campaign.simulation(3).seed
    /// True
    #[getter]
    fn seed(&self) -> u64 {
        self.outcome.seed
    }
    /// Hash of the last state. Runs with equal hashes are bit-identical. "0000000000000000" if there is no state.
    ///
    /// Examples
    /// --------
    /// >>> sim = campaign.simulation(3)
    /// >>> sim.run()
    /// >>> outcome.state_hash == sim.state_hash
    /// True
    #[getter]
    fn state_hash(&self) -> String {
        format!("{:016x}", self.outcome.hash)
    }
    /// Wall time of the run, s.
    ///
    /// Examples
    /// --------
    /// >>> outcome.wall > 0
    /// True
    #[getter]
    fn wall(&self) -> f64 {
        self.outcome.wall
    }
    /// Metrics of the run: {name: value}, in the units of `Campaign.metrics`. Empty if the run does not have any.
    ///
    /// Examples
    /// --------
    /// >>> list(outcome.metrics)
    /// ['largest speed']
    #[getter]
    fn metrics<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let all = PyDict::new(py);
        let pairs = self.names.iter().zip(&self.outcome.metrics);
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

/// Results of a campaign.
///
/// Tables are {title: column}, as in the .csv files: numbers as arrays (rows,), texts as lists. They are copies.
///
/// Examples
/// --------
/// >>> import pathlib
/// >>> text = 'Campaign(simulation: "sims/pendulum", runs: 4, set: {"until": "2 s"}, vary: {"bob.mass": Uniform(from: "0.5 kg", to: "2 kg")})'
/// >>> _ = pathlib.Path("masses.ron").write_text(text)
/// >>> results = linkwork.Campaign("masses.ron").execute("out", threads=1)
/// >>> results
/// Results(4 of 4 runs)
#[pyclass(frozen, weakref, module = "linkwork")]
pub struct Results {
    pub(super) done: u64,
    pub(super) runs: u64,
    pub(super) files: Vec<PathBuf>,
    pub(super) results: campaign::Results,
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
    /// Number of runs that have ended.
    ///
    /// Examples
    /// --------
    /// >>> results.done
    /// 4
    #[getter]
    fn done(&self) -> u64 {
        self.done
    }
    /// Number of all runs.
    ///
    /// Examples
    /// --------
    /// >>> results.runs
    /// 4
    #[getter]
    fn runs(&self) -> u64 {
        self.runs
    }
    /// Paths of the tables and of the report.
    ///
    /// Examples
    /// --------
    /// >>> [f.name for f in results.files][:2]
    /// ['results.csv', 'results.parquet']
    #[getter]
    fn files(&self) -> Vec<PathBuf> {
        self.files.clone()
    }
    /// One row per run that has ended, in the order of their numbers: run, how it ended, time (s), drawn values ("draw:PATH [UNIT]"), metrics.
    /// Columns have the shape (rows,).
    ///
    /// Examples
    /// --------
    /// >>> results.table["run"].tolist()
    /// [0, 1, 2, 3]
    /// >>> results.table["draw:bob.mass [kg]"].round(3).tolist()
    /// [1.108, 0.935, 0.524, 0.774]
    #[getter]
    fn table<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        columns(py, &self.results.runs)
    }
    /// One row per metric, columns (rows,): n, mean, standard deviation, standard error of the mean, percentiles.
    ///
    /// Examples
    /// --------
    /// >>> bool(np.isclose(results.statistics["mean"][0], results.table["largest speed [rad/s]"].mean()))
    /// True
    #[getter]
    fn statistics<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        columns(py, &self.results.statistics())
    }
    /// One row per metric and drawn number, columns (rows,): their rank correlation (Spearman).
    ///
    /// Examples
    /// --------
    /// >>> results.sensitivity["value"]
    /// ['bob.mass [kg]']
    /// >>> bool(abs(results.sensitivity["rank correlation"][0]) <= 1)
    /// True
    #[getter]
    fn sensitivity<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        columns(py, &self.results.sensitivities())
    }
    /// Number of failed runs by cause, most frequent cause first: {cause: runs}.
    ///
    /// Examples
    /// --------
    /// >>> results.failures
    /// {}
    #[getter]
    fn failures<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let all = PyDict::new(py);
        self.results.failures.iter().try_for_each(|(kind, runs)| all.set_item(kind, runs))?;
        Ok(all)
    }
    /// Number of runs that ended normally but violated a requirement of the campaign, in the order of the file: {cause: runs}.
    ///
    /// Examples
    /// --------
    /// >>> results.missed
    /// {}
    #[getter]
    fn missed<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let all = PyDict::new(py);
        self.results.missed.iter().try_for_each(|m| all.set_item(&m.cause, &m.runs))?;
        Ok(all)
    }
    /// Number of runs that ended normally and satisfied all requirements.
    ///
    /// Examples
    /// --------
    /// >>> results.kept
    /// 4
    #[getter]
    fn kept(&self) -> usize {
        self.results.kept
    }
    fn __repr__(&self) -> String {
        format!("Results({} of {} runs)", self.done, self.runs)
    }
}
