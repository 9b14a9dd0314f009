//! `ContactStep`: the result of a step with contact.
use crate::array::{Array1, Array2, out1, out2};
use linkwork_collision::{ColliderId, Colliders};
use linkwork_solvers::StepReport;
use numpy::PyArray1;
use pyo3::prelude::*;
use std::sync::Arc;

/// Result of a step with contact: the state after the step, and the contacts.
///
/// Notes
/// -----
/// Row k of `pairs`, `points`, `normals`, `gaps`, `impulses` and `forces` belongs to one of the n contact points within the margin. Contacts that
/// carry no force have a zero impulse. Geometry is that at the start of the step.
///
/// Examples
/// --------
/// >>> ball = linkwork.Builder().body("ball", "world", linkwork.Hinge.free(), mass=2.0, com=[0, 0, 0], inertia=0.008 * np.eye(3)).build()
/// >>> contact = linkwork.Contact(ball, [linkwork.Collider.sphere("skin", "ball", 0.1), linkwork.Collider.half_space("ground")])
/// >>> step = contact.step([0, 0, 0.1, 0, 0, 0, 1], np.zeros(6), 1e-3)
/// >>> len(step.pairs), step.converged
/// (1, True)
#[pyclass(frozen, weakref, module = "linkwork")]
pub struct ContactStep {
    pub(super) q: Vec<f64>,
    pub(super) v: Vec<f64>,
    pub(super) vdot: Vec<f64>,
    pub(super) colliders: Arc<Colliders>,
    pub(super) pairs: Vec<(ColliderId, ColliderId)>,
    pub(super) points: Vec<f64>,
    pub(super) normals: Vec<f64>,
    pub(super) gaps: Vec<f64>,
    pub(super) impulses: Vec<f64>,
    pub(super) dt: f64,
    pub(super) report: StepReport,
}

#[pymethods]
impl ContactStep {
    /// Configuration after the step (nq,), rad and m.
    ///
    /// Examples
    /// --------
    /// >>> np.round(step.q, 6).tolist()
    /// [0.0, 0.0, 0.1, 0.0, 0.0, 0.0, 1.0]
    #[getter]
    fn q<'py>(&self, py: Python<'py>) -> Array1<'py> {
        PyArray1::from_slice(py, &self.q)
    }
    /// Rates after the step (nv,), rad/s and m/s.
    ///
    /// Examples
    /// --------
    /// >>> bool(abs(step.v).max() < 1e-9)
    /// True
    #[getter]
    fn v<'py>(&self, py: Python<'py>) -> Array1<'py> {
        PyArray1::from_slice(py, &self.v)
    }
    /// Mean accelerations of the step (nv,), including impulses, rad/s² and m/s².
    ///
    /// Examples
    /// --------
    /// >>> bool(abs(step.vdot).max() < 1e-6)
    /// True
    #[getter]
    fn vdot<'py>(&self, py: Python<'py>) -> Array1<'py> {
        PyArray1::from_slice(py, &self.vdot)
    }
    /// Names of the two colliders of each contact point, sorted. `impulses` act on the second one.
    ///
    /// Examples
    /// --------
    /// >>> step.pairs
    /// [('ground', 'skin')]
    #[getter]
    fn pairs(&self) -> Vec<(&str, &str)> {
        let name = |id: ColliderId| self.colliders.spec(id).name.as_str();
        self.pairs.iter().map(|(a, b)| (name(*a), name(*b))).collect()
    }
    /// Contact points (n, 3), midway between the surfaces, in the world, m.
    ///
    /// Examples
    /// --------
    /// >>> step.points.shape, bool(abs(step.points).max() < 1e-9)
    /// ((1, 3), True)
    #[getter]
    fn points<'py>(&self, py: Python<'py>) -> PyResult<Array2<'py>> {
        out2(py, self.points.clone(), self.gaps.len(), 3)
    }
    /// Unit vectors (n, 3) from the first to the second collider, world axes.
    ///
    /// Examples
    /// --------
    /// >>> step.normals.tolist()
    /// [[0.0, 0.0, 1.0]]
    #[getter]
    fn normals<'py>(&self, py: Python<'py>) -> PyResult<Array2<'py>> {
        out2(py, self.normals.clone(), self.gaps.len(), 3)
    }
    /// Distances between the surfaces (n,), m; negative for overlap.
    ///
    /// Examples
    /// --------
    /// >>> bool(abs(step.gaps[0]) < 1e-9)
    /// True
    #[getter]
    fn gaps<'py>(&self, py: Python<'py>) -> Array1<'py> {
        out1(py, self.gaps.clone())
    }
    /// Impulses on the second collider (n, 3), including impacts, world axes, N s.
    ///
    /// Examples
    /// --------
    /// >>> round(float(step.impulses[0, 2]), 6)
    /// 0.01962
    #[getter]
    fn impulses<'py>(&self, py: Python<'py>) -> PyResult<Array2<'py>> {
        out2(py, self.impulses.clone(), self.gaps.len(), 3)
    }
    /// Mean contact forces on the second collider (n, 3), impulses / dt, world axes, N.
    ///
    /// Examples
    /// --------
    /// >>> round(float(step.forces[0, 2]), 3)
    /// 19.62
    #[getter]
    fn forces<'py>(&self, py: Python<'py>) -> PyResult<Array2<'py>> {
        let forces = self.impulses.iter().map(|x| x / self.dt).collect();
        out2(py, forces, self.gaps.len(), 3)
    }
    /// Largest penetration at the start of the step, m; 0 without overlap.
    ///
    /// Examples
    /// --------
    /// >>> deep = contact.step([0, 0, 0.09, 0, 0, 0, 1], np.zeros(6), 1e-3)
    /// >>> round(deep.penetration, 6)
    /// 0.01
    #[getter]
    fn penetration(&self) -> f64 {
        self.report.penetration.max(0.0)
    }
    /// Number of impacts that were resolved one after another.
    ///
    /// Examples
    /// --------
    /// >>> step.impacts
    /// 0
    #[getter]
    fn impacts(&self) -> usize {
        self.report.impacts
    }
    /// True if the impulses satisfy the tolerance.
    ///
    /// Examples
    /// --------
    /// >>> step.converged
    /// True
    #[getter]
    fn converged(&self) -> bool {
        self.report.converged
    }
    /// Residual of the contact problem, relative to the largest velocity.
    ///
    /// Examples
    /// --------
    /// >>> step.residual < 1e-6
    /// True
    #[getter]
    fn residual(&self) -> f64 {
        self.report.measure.residual
    }
    fn __repr__(&self) -> String {
        let (n, deep) = (self.gaps.len(), self.penetration());
        format!(
            "ContactStep({n} points, penetration {deep:.2e} m, residual {:.1e})",
            self.residual()
        )
    }
}
