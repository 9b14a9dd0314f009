//! Results about constraints: `Constraint`, `ConstrainedMotion`, `Rank`.
use crate::array::{Array1, out1};
use linkwork_solvers::Report;
use pyo3::prelude::*;
use pyo3::types::PyDict;

/// Converts numbers of rows to a dictionary.
fn by_name<'py>(py: Python<'py>, rows: &[(String, usize)]) -> PyResult<Bound<'py, PyDict>> {
    let out = PyDict::new(py);
    rows.iter().try_for_each(|(name, rows)| out.set_item(name, rows))?;
    Ok(out)
}

/// A loop that is closed by a hinge, or a linear relation between hinge coordinates (a coupling).
///
/// Examples
/// --------
/// >>> pin, rod = linkwork.Hinge.pin([0, 1, 0]), dict(mass=1, com=[0.5, 0, 0], inertia=np.diag([0.01, 0.1, 0.1]))
/// >>> parts = linkwork.Builder().body("crank", "world", pin, **rod).body("rod", "crank", pin, hinge_in_parent=[1, 0, 0], **rod)
/// >>> crank = parts.loop("slide", "rod", "world", linkwork.Hinge.slider([1, 0, 0]), at_a=[1, 0, 0]).build()
/// >>> constraint = crank.constraints[0]
/// >>> constraint
/// Constraint(loop `slide`, rod, world, rows=5)
#[pyclass(frozen, weakref, module = "linkwork")]
pub struct Constraint {
    pub(super) name: String,
    pub(super) kind: &'static str,
    pub(super) bodies: Vec<String>,
    pub(super) rows: usize,
    pub(super) motions: usize,
}

#[pymethods]
impl Constraint {
    /// Name of the constraint.
    ///
    /// Examples
    /// --------
    /// >>> constraint.name
    /// 'slide'
    #[getter]
    fn name(&self) -> &str {
        &self.name
    }
    /// "loop" or "coupling".
    ///
    /// Examples
    /// --------
    /// >>> constraint.kind
    /// 'loop'
    #[getter]
    fn kind(&self) -> &'static str {
        self.kind
    }
    /// For a loop: the bodies of its frames A and B ("world" for the world). For a coupling: the bodies whose hinges it relates.
    ///
    /// Examples
    /// --------
    /// >>> constraint.bodies
    /// ['rod', 'world']
    #[getter]
    fn bodies(&self) -> Vec<String> {
        self.bodies.clone()
    }
    /// Number of scalar equations.
    ///
    /// Examples
    /// --------
    /// >>> constraint.rows
    /// 5
    #[getter]
    fn rows(&self) -> usize {
        self.rows
    }
    /// Number of prescribed motions across the hinge of a loop. `loop_motions` has a row for each.
    ///
    /// Examples
    /// --------
    /// >>> constraint.motions
    /// 0
    #[getter]
    fn motions(&self) -> usize {
        self.motions
    }
    fn __repr__(&self) -> String {
        let (kind, name) = (self.kind, &self.name);
        format!("Constraint({kind} `{name}`, {}, rows={})", self.bodies.join(", "), self.rows)
    }
}

/// Accelerations of a mechanism with loops and couplings, and the constraint forces.
///
/// Examples
/// --------
/// >>> pin, rod = linkwork.Hinge.pin([0, 1, 0]), dict(mass=1, com=[0.5, 0, 0], inertia=np.diag([0.01, 0.1, 0.1]))
/// >>> parts = linkwork.Builder().body("crank", "world", pin, **rod).body("rod", "crank", pin, hinge_in_parent=[1, 0, 0], **rod)
/// >>> parts = parts.coupling("gear", {"crank": 1.0, "rod": 1.0})
/// >>> motion = parts.build().constrained_dynamics([0, 0], [0, 0], [0, 0], solver="augment")
/// >>> motion
/// ConstrainedMotion(nv=2, rows=1, rank=1, contradiction=0.0e0)
#[pyclass(frozen, weakref, module = "linkwork")]
pub struct ConstrainedMotion {
    pub(super) vdot: Vec<f64>,
    pub(super) tau: Vec<f64>,
    pub(super) forces: Vec<(String, Vec<f64>)>,
    pub(super) redundant: Vec<(String, usize)>,
    pub(super) report: Report,
}

#[pymethods]
impl ConstrainedMotion {
    /// Accelerations (nv,), rad/s² and m/s².
    ///
    /// Examples
    /// --------
    /// >>> bool(abs(motion.vdot.sum()) < 1e-9)
    /// True
    #[getter]
    fn vdot<'py>(&self, py: Python<'py>) -> Array1<'py> {
        out1(py, self.vdot.clone())
    }
    /// Generalized forces (nv,), N m and N: the input, with the computed forces at prescribed coordinates.
    ///
    /// Examples
    /// --------
    /// >>> motion.tau.tolist()
    /// [0.0, 0.0]
    #[getter]
    fn tau<'py>(&self, py: Python<'py>) -> Array1<'py> {
        out1(py, self.tau.clone())
    }
    /// Constraint forces by name of the constraint: an array (rows,) each, N or N m.
    ///
    /// For a loop, a force acts along the row's wrench on body B and in the opposite direction on body A. For a coupling, it acts with the factors of
    /// the coupling on the coordinates. Redundant rows have zero.
    ///
    /// Examples
    /// --------
    /// >>> list(motion.forces), motion.forces["gear"].shape
    /// (['gear'], (1,))
    #[getter]
    fn forces<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let out = PyDict::new(py);
        for (name, forces) in &self.forces {
            out.set_item(name, out1(py, forces.clone()))?;
        }
        Ok(out)
    }
    /// Number of redundant rows by name of the constraint. Which row of a dependent set is reported is not unique.
    ///
    /// Examples
    /// --------
    /// >>> motion.redundant
    /// {}
    #[getter]
    fn redundant<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        by_name(py, &self.redundant)
    }
    /// Number of constraint rows with multipliers; with the solver "full" this includes the rows of hinges.
    ///
    /// Examples
    /// --------
    /// >>> motion.rows
    /// 1
    #[getter]
    fn rows(&self) -> usize {
        self.report.rows
    }
    /// Number of independent rows among them.
    ///
    /// Examples
    /// --------
    /// >>> motion.rank
    /// 1
    #[getter]
    fn rank(&self) -> usize {
        self.report.rank
    }
    /// Largest inconsistency of the redundant rows, rad/s² or m/s². It is at round-off level if the constraints are consistent.
    ///
    /// Examples
    /// --------
    /// >>> motion.contradiction
    /// 0.0
    #[getter]
    fn contradiction(&self) -> f64 {
        self.report.contradiction
    }
    fn __repr__(&self) -> String {
        let Report { rows, rank, contradiction, .. } = self.report;
        format!(
            "ConstrainedMotion(nv={}, rows={rows}, rank={rank}, contradiction={contradiction:.1e})",
            self.vdot.len()
        )
    }
}

/// Degrees of freedom that remain with all constraints.
///
/// Examples
/// --------
/// >>> pin, rod = linkwork.Hinge.pin([0, 1, 0]), dict(mass=1, com=[0.5, 0, 0], inertia=np.diag([0.01, 0.1, 0.1]))
/// >>> parts = linkwork.Builder().body("crank", "world", pin, **rod).body("rod", "crank", pin, hinge_in_parent=[1, 0, 0], **rod)
/// >>> crank = parts.loop("slide", "rod", "world", linkwork.Hinge.slider([1, 0, 0]), at_a=[1, 0, 0]).build()
/// >>> rank = crank.constraint_rank(crank.close([-0.5, 1.0]))
/// >>> rank
/// Rank(free=2, rows=5, rank=2, mobility=0)
#[pyclass(frozen, weakref, module = "linkwork")]
pub struct Rank {
    pub(super) free: usize,
    pub(super) rows: usize,
    pub(super) rank: usize,
    pub(super) redundant: Vec<(String, usize)>,
}

#[pymethods]
impl Rank {
    /// Number of rates of the tree that are not prescribed.
    ///
    /// Examples
    /// --------
    /// >>> rank.free
    /// 2
    #[getter]
    fn free(&self) -> usize {
        self.free
    }
    /// Number of rows of all loops and couplings.
    ///
    /// Examples
    /// --------
    /// >>> rank.rows
    /// 5
    #[getter]
    fn rows(&self) -> usize {
        self.rows
    }
    /// Number of independent rows at this configuration.
    ///
    /// Examples
    /// --------
    /// >>> rank.rank
    /// 2
    #[getter]
    fn rank(&self) -> usize {
        self.rank
    }
    /// Number of remaining degrees of freedom: free - rank.
    ///
    /// Examples
    /// --------
    /// >>> rank.mobility
    /// 0
    #[getter]
    fn mobility(&self) -> usize {
        self.free.saturating_sub(self.rank)
    }
    /// Number of redundant rows by name of the constraint. Which row of a dependent set is reported is not unique.
    ///
    /// Examples
    /// --------
    /// >>> rank.redundant
    /// {'slide': 3}
    #[getter]
    fn redundant<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        by_name(py, &self.redundant)
    }
    fn __repr__(&self) -> String {
        format!(
            "Rank(free={}, rows={}, rank={}, mobility={})",
            self.free,
            self.rows,
            self.rank,
            self.mobility()
        )
    }
}
