//! `Log`: samples of a run as numpy arrays; `Series` and `read_log`: the numbers of an MCAP file.
use crate::array::{Array1, out1};
use crate::core::lock;
use crate::error::{refuse, refuse_with};
use linkwork_runner::Columns;
use linkwork_runtime::{self as runtime, Simulation, remedy};
use numpy::PyArray1;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use std::path::PathBuf;
use std::sync::{Arc, Mutex};

/// A log that a run fills.
pub struct Filling {
    /// Selects the samples.
    pub due: runtime::Rows,
    /// Destination of its rows.
    pub into: Arc<Mutex<Columns>>,
}

impl Filling {
    /// Stores the samples that are due at the present tick.
    pub fn sample(&mut self, sim: &Simulation) {
        // There is always room, so the result is not needed.
        let _ = self.due.sample(sim, &mut *lock(&self.into));
    }
}

/// Variables of a run over time, in memory.
///
/// `log["Rover.Motor.torque"]` is an array (rows,) of values, `log["t"]` an array (rows,) of times in s, and `dict(log)` contains all of them.
/// The log grows while the simulation runs; arrays read from it are copies.
///
/// Examples
/// --------
/// >>> sim = linkwork.Simulation("sims/pendulum")
/// >>> log = sim.log(["bob.angle"], rate=10)
/// >>> sim.run_until(0.5)
/// >>> log
/// Log(1 variables, 6 rows)
/// >>> "bob.angle" in log, len(log), list(log)
/// (True, 2, ['t', 'bob.angle'])
/// >>> np.round(log["bob.angle"][:3], 4).tolist()
/// [1.0472, 1.0051, 0.8815]
#[pyclass(frozen, mapping, weakref, module = "linkwork")]
pub struct Log {
    pub names: Vec<String>,
    pub units: Vec<String>,
    pub rows: Arc<Mutex<Columns>>,
}

#[pymethods]
impl Log {
    /// Times of the samples (rows,), s.
    ///
    /// Examples
    /// --------
    /// >>> log.t.tolist()
    /// [0.0, 0.1, 0.2, 0.3, 0.4, 0.5]
    #[getter]
    fn t<'py>(&self, py: Python<'py>) -> Array1<'py> {
        PyArray1::from_slice(py, &lock(&self.rows).t)
    }
    /// Number of samples so far.
    ///
    /// Examples
    /// --------
    /// >>> log.rows
    /// 6
    #[getter]
    fn rows(&self) -> usize {
        lock(&self.rows).t.len()
    }
    /// Return "t" and the paths of the variables.
    ///
    /// Returns
    /// -------
    /// list of str
    ///     The names.
    ///
    /// Examples
    /// --------
    /// >>> log.keys()
    /// ['t', 'bob.angle']
    fn keys(&self) -> Vec<&str> {
        std::iter::once("t").chain(self.names.iter().map(String::as_str)).collect()
    }
    /// Return the unit of a variable; "s" for "t".
    ///
    /// Parameters
    /// ----------
    /// name : str
    ///     Path of the variable.
    ///
    /// Returns
    /// -------
    /// str
    ///     The unit.
    ///
    /// Raises
    /// ------
    /// LinkworkError
    ///     If the log does not contain the variable.
    ///
    /// Examples
    /// --------
    /// >>> log.unit("bob.angle")
    /// 'rad'
    fn unit(&self, name: &str) -> PyResult<&str> {
        if name == "t" { Ok("s") } else { Ok(&self.units[self.column(name)?]) }
    }
    fn __getitem__<'py>(&self, py: Python<'py>, name: &str) -> PyResult<Array1<'py>> {
        if name == "t" {
            return Ok(self.t(py));
        }
        let k = self.column(name)?;
        Ok(PyArray1::from_slice(py, &lock(&self.rows).values[k]))
    }
    fn __len__(&self) -> usize {
        self.names.len() + 1
    }
    fn __contains__(&self, name: &str) -> bool {
        name == "t" || self.names.iter().any(|n| n == name)
    }
    fn __iter__<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.keys().into_pyobject(py)?.call_method0("__iter__")
    }
    fn __repr__(&self) -> String {
        format!("Log({} variables, {} rows)", self.names.len(), self.rows())
    }
}

impl Log {
    fn column(&self, name: &str) -> PyResult<usize> {
        self.names.iter().position(|n| n == name).ok_or_else(|| {
            let help = remedy(name, "variables of this log", &self.keys());
            refuse_with(format!("the log does not contain `{name}`"), help)
        })
    }
}

/// One variable of a log file over time.
///
/// Examples
/// --------
/// >>> sim = linkwork.Simulation("sims/pendulum")
/// >>> sim.record("swing.mcap", ["bob.angle"], rate=10)
/// >>> sim.run_until(0.5)
/// >>> sim.stop_recording()
/// >>> series = linkwork.read_log("swing.mcap")["bob.angle"]
/// >>> series
/// Series(6 rows, unit "rad")
#[pyclass(frozen, weakref, module = "linkwork")]
pub struct Series {
    t: Py<PyArray1<f64>>,
    y: Py<PyArray1<f64>>,
    unit: String,
}

#[pymethods]
impl Series {
    /// Times (rows,), s.
    ///
    /// Examples
    /// --------
    /// >>> series.t.round(3).tolist()
    /// [0.0, 0.1, 0.2, 0.3, 0.4, 0.5]
    #[getter]
    fn t<'py>(&self, py: Python<'py>) -> Array1<'py> {
        self.t.bind(py).clone()
    }
    /// Values (rows,), in the SI unit `unit`.
    ///
    /// Examples
    /// --------
    /// >>> np.round(series.y[:3], 4).tolist()
    /// [1.0472, 1.0051, 0.8815]
    #[getter]
    fn y<'py>(&self, py: Python<'py>) -> Array1<'py> {
        self.y.bind(py).clone()
    }
    /// The unit; empty if the file does not contain it.
    ///
    /// Examples
    /// --------
    /// >>> series.unit
    /// 'rad'
    #[getter]
    fn unit(&self) -> &str {
        &self.unit
    }
    fn __repr__(&self, py: Python<'_>) -> PyResult<String> {
        let rows = self.t.bind(py).len()?;
        Ok(format!("Series({rows} rows, unit \"{}\")", self.unit))
    }
}

/// Read all numbers of an MCAP log.
///
/// A log without its end, as after a crash, is read as far as it is complete.
///
/// Parameters
/// ----------
/// path : str or path-like
///     The file.
///
/// Returns
/// -------
/// dict of str to Series
///     {path: Series}.
///
/// Raises
/// ------
/// LinkworkError
///     If the file is not an MCAP log.
///
/// Examples
/// --------
/// >>> sim = linkwork.Simulation("sims/pendulum")
/// >>> sim.record("swing.mcap", ["bob.angle"], rate=10)
/// >>> sim.run_until(0.5)
/// >>> sim.stop_recording()
/// >>> log = linkwork.read_log("swing.mcap")
/// >>> log["bob.angle"].y.shape, log["bob.angle"].unit
/// ((6,), 'rad')
#[pyfunction]
pub fn read_log(py: Python<'_>, path: PathBuf) -> PyResult<Bound<'_, PyDict>> {
    let read = py.detach(|| linkwork_record::read_log(&path)).map_err(refuse)?;
    let all = PyDict::new(py);
    for (name, s) in read {
        let (t, y) = (out1(py, s.t).unbind(), out1(py, s.y).unbind());
        all.set_item(name, Py::new(py, Series { t, y, unit: s.unit })?)?;
    }
    Ok(all)
}
