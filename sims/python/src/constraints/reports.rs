//! What is told of constraints: `Constraint`, `ConstrainedMotion`, `Rank`.
use crate::array::{Array1, out1};
use linkwork_solvers::Report;
use pyo3::prelude::*;
use pyo3::types::PyDict;

/// Numbers of rows as a dictionary.
fn by_name<'py>(py: Python<'py>, rows: &[(String, usize)]) -> PyResult<Bound<'py, PyDict>> {
    let out = PyDict::new(py);
    rows.iter().try_for_each(|(name, rows)| out.set_item(name, rows))?;
    Ok(out)
}

/// A loop that a hinge closes, or a linear relation between hinge coordinates.
///
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
    /// Its name.
    ///
    /// >>> constraint.name
    /// 'slide'
    #[getter]
    fn name(&self) -> &str {
        &self.name
    }
    /// "loop" or "coupling".
    ///
    /// >>> constraint.kind
    /// 'loop'
    #[getter]
    fn kind(&self) -> &'static str {
        self.kind
    }
    /// Of a loop the bodies ("world" for the world) of frames A and B; of a coupling those whose hinges it joins.
    ///
    /// >>> constraint.bodies
    /// ['rod', 'world']
    #[getter]
    fn bodies(&self) -> Vec<String> {
        self.bodies.clone()
    }
    /// Scalar equations.
    ///
    /// >>> constraint.rows
    /// 5
    #[getter]
    fn rows(&self) -> usize {
        self.rows
    }
    /// Prescribed motions across the hinge of a loop, which `loop_motions` gives.
    ///
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

/// Accelerations of a mechanism with loops and couplings, and what holds them.
///
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
    /// Accelerations (nv,) in rad/s² and m/s².
    ///
    /// >>> bool(abs(motion.vdot.sum()) < 1e-9)
    /// True
    #[getter]
    fn vdot<'py>(&self, py: Python<'py>) -> Array1<'py> {
        out1(py, self.vdot.clone())
    }
    /// Forces of the coordinates (nv,): as given, for prescribed ones what holds them. Forces in N m and N, by coordinate.
    ///
    /// >>> motion.tau.tolist()
    /// [0.0, 0.0]
    #[getter]
    fn tau<'py>(&self, py: Python<'py>) -> Array1<'py> {
        out1(py, self.tau.clone())
    }
    /// Forces of each constraint by its name, one a row (N or N m): along the row's wrench on body B of a loop and
    /// against it on body A, by its factors on the coordinates of a coupling. Redundant rows show zero. Arrays (rows,).
    ///
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
    /// Rows that repeat others, by constraint; which of a group is named is not unique.
    ///
    /// >>> motion.redundant
    /// {}
    #[getter]
    fn redundant<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        by_name(py, &self.redundant)
    }
    /// Rows with multipliers; with "full" those of hinges, too.
    ///
    /// >>> motion.rows
    /// 1
    #[getter]
    fn rows(&self) -> usize {
        self.report.rows
    }
    /// Independent ones among them.
    ///
    /// >>> motion.rank
    /// 1
    #[getter]
    fn rank(&self) -> usize {
        self.report.rank
    }
    /// How far redundant rows contradict the others, rad/s² or m/s²; rounding when they are sound.
    ///
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

/// Degrees of freedom that constraints leave.
///
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
    /// Rates of the tree that are not prescribed.
    ///
    /// >>> rank.free
    /// 2
    #[getter]
    fn free(&self) -> usize {
        self.free
    }
    /// Rows of all loops and couplings.
    ///
    /// >>> rank.rows
    /// 5
    #[getter]
    fn rows(&self) -> usize {
        self.rows
    }
    /// Independent ones among them, at this configuration.
    ///
    /// >>> rank.rank
    /// 2
    #[getter]
    fn rank(&self) -> usize {
        self.rank
    }
    /// Degrees of freedom that are left: free - rank.
    ///
    /// >>> rank.mobility
    /// 0
    #[getter]
    fn mobility(&self) -> usize {
        self.free.saturating_sub(self.rank)
    }
    /// Rows that repeat others, by constraint; which of a group is named is not unique.
    ///
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
