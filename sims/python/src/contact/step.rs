//! `ContactStep`: what came of a step with contact.
use crate::array::{Array1, Array2, out1, out2};
use linkwork_collision::{ColliderId, Colliders};
use linkwork_solvers::StepReport;
use numpy::PyArray1;
use pyo3::prelude::*;
use std::sync::Arc;

/// What came of a step: the state after it, and what touched.
///
/// Row k of `pairs`, `points`, `normals`, `gaps`, `impulses` and `forces` is one contact point of the n that were near enough to matter; where no
/// force acts its impulse is zero. They are as at the start of the step.
///
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
    /// The configuration after the step (nq,). Angles in rad, lengths in m.
    ///
    /// >>> np.round(step.q, 6).tolist()
    /// [0.0, 0.0, 0.1, 0.0, 0.0, 0.0, 1.0]
    #[getter]
    fn q<'py>(&self, py: Python<'py>) -> Array1<'py> {
        PyArray1::from_slice(py, &self.q)
    }
    /// The rates after the step (nv,). Rates in rad/s and m/s.
    ///
    /// >>> bool(abs(step.v).max() < 1e-9)
    /// True
    #[getter]
    fn v<'py>(&self, py: Python<'py>) -> Array1<'py> {
        PyArray1::from_slice(py, &self.v)
    }
    /// The mean accelerations of the step (nv,), impulses included. Accelerations in rad/s² and m/s².
    ///
    /// >>> bool(abs(step.vdot).max() < 1e-6)
    /// True
    #[getter]
    fn vdot<'py>(&self, py: Python<'py>) -> Array1<'py> {
        PyArray1::from_slice(py, &self.vdot)
    }
    /// The names of the two colliders of each point, in the order of names; the second is the one that `impulses` push.
    ///
    /// >>> step.pairs
    /// [('ground', 'skin')]
    #[getter]
    fn pairs(&self) -> Vec<(&str, &str)> {
        let name = |id: ColliderId| self.colliders.spec(id).name.as_str();
        self.pairs.iter().map(|(a, b)| (name(*a), name(*b))).collect()
    }
    /// Where (n, 3): midway between the surfaces, world, m.
    ///
    /// >>> step.points.shape, bool(abs(step.points).max() < 1e-9)
    /// ((1, 3), True)
    #[getter]
    fn points<'py>(&self, py: Python<'py>) -> PyResult<Array2<'py>> {
        out2(py, self.points.clone(), self.gaps.len(), 3)
    }
    /// Unit vectors (n, 3) from the first collider to the second, world axes.
    ///
    /// >>> step.normals.tolist()
    /// [[0.0, 0.0, 1.0]]
    #[getter]
    fn normals<'py>(&self, py: Python<'py>) -> PyResult<Array2<'py>> {
        out2(py, self.normals.clone(), self.gaps.len(), 3)
    }
    /// Distances of the surfaces (n,), m; negative where they overlap.
    ///
    /// >>> bool(abs(step.gaps[0]) < 1e-9)
    /// True
    #[getter]
    fn gaps<'py>(&self, py: Python<'py>) -> Array1<'py> {
        out1(py, self.gaps.clone())
    }
    /// Impulses on the second collider (n, 3), those of impacts included, world axes, N s.
    ///
    /// >>> round(float(step.impulses[0, 2]), 6)
    /// 0.01962
    #[getter]
    fn impulses<'py>(&self, py: Python<'py>) -> PyResult<Array2<'py>> {
        out2(py, self.impulses.clone(), self.gaps.len(), 3)
    }
    /// Mean forces of the step on the second collider (n, 3): impulses / dt, world axes, N.
    ///
    /// >>> round(float(step.forces[0, 2]), 3)
    /// 19.62
    #[getter]
    fn forces<'py>(&self, py: Python<'py>) -> PyResult<Array2<'py>> {
        let forces = self.impulses.iter().map(|x| x / self.dt).collect();
        out2(py, forces, self.gaps.len(), 3)
    }
    /// Deepest penetration at the start of the step, m; 0 where nothing overlaps.
    ///
    /// >>> deep = contact.step([0, 0, 0.09, 0, 0, 0, 1], np.zeros(6), 1e-3)
    /// >>> round(deep.penetration, 6)
    /// 0.01
    #[getter]
    fn penetration(&self) -> f64 {
        self.report.penetration.max(0.0)
    }
    /// Impacts that were resolved one after another.
    ///
    /// >>> step.impacts
    /// 0
    #[getter]
    fn impacts(&self) -> usize {
        self.report.impacts
    }
    /// Whether the impulses were found within the tolerance.
    ///
    /// >>> step.converged
    /// True
    #[getter]
    fn converged(&self) -> bool {
        self.report.converged
    }
    /// How far they are from a solution, relative to the largest velocity.
    ///
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
