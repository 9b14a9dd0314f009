//! `Subgraph`: some bodies of a mechanism as a mechanism.
use crate::core::Core;
use crate::mechanism::Mechanism;
use pyo3::prelude::*;
use std::sync::Arc;

/// Some bodies of a mechanism as a separate mechanism, and how its coordinates correspond to those of the original.
///
/// Examples
/// --------
/// >>> pin = linkwork.Hinge.pin([0, 1, 0])
/// >>> arm = linkwork.Builder().body("upper", "world", pin, mass=2).body("lower", "upper", pin, mass=1).body("hand", "lower", pin, mass=0.5).build()
/// >>> part = arm.subgraph(["lower", "hand"])
/// >>> part.mechanism.bodies
/// ['lower', 'hand']
#[pyclass(frozen, weakref, module = "linkwork")]
pub struct Subgraph {
    pub core: Arc<Core>,
    pub base: Option<String>,
    pub q: Vec<usize>,
    pub v: Vec<usize>,
}

#[pymethods]
impl Subgraph {
    /// The chosen bodies as a mechanism. Its world is the frame of `base`.
    ///
    /// Examples
    /// --------
    /// >>> part.mechanism.total_mass
    /// 1.5
    #[getter]
    fn mechanism(&self) -> Mechanism {
        Mechanism { core: self.core.clone() }
    }
    /// The body of the original mechanism that carries the chosen bodies; None for the world.
    ///
    /// Examples
    /// --------
    /// >>> part.base
    /// 'upper'
    #[getter]
    fn base(&self) -> Option<&str> {
        self.base.as_deref()
    }
    /// Index into the original q for each entry of the subgraph's q: `part_q = whole_q[part.q]`.
    ///
    /// Examples
    /// --------
    /// >>> np.array([0.1, 0.2, 0.3])[part.q].tolist()
    /// [0.2, 0.3]
    #[getter]
    fn q(&self) -> Vec<usize> {
        self.q.clone()
    }
    /// Index into the original v for each entry of the subgraph's v.
    ///
    /// Examples
    /// --------
    /// >>> part.v
    /// [1, 2]
    #[getter]
    fn v(&self) -> Vec<usize> {
        self.v.clone()
    }
    fn __repr__(&self) -> String {
        let bodies = self.core.mbs.bodies().len();
        format!("Subgraph({bodies} bodies on {})", self.base.as_deref().unwrap_or("world"))
    }
}
