//! `Builder` describes a mechanism in Python.
use crate::array::{mat3, pose, vec3};
use crate::core::{Core, GRAVITY};
use crate::error::refuse;
use crate::hinge::Hinge;
use crate::mechanism::{INERTIA_CHECKS, Mechanism, choice};
use crate::modes::Modes;
use linkwork_multibody::{
    self as multibody, BodySpec, Coupling, HingeCoordinate, LoopClosure, Term,
};
use linkwork_spatial::{MassProperties, Mat3, Vec3};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use std::sync::{Arc, Mutex};

/// Collects bodies, nodes, loops and couplings in any order; `build()` returns the mechanism.
///
/// Each method changes the Builder and returns it, so calls can be chained.
///
/// Examples
/// --------
/// >>> import numpy as np, linkwork
/// >>> pin = linkwork.Hinge.pin([0, 1, 0])
/// >>> parts = linkwork.Builder().body("crank", "world", pin, mass=1, com=[0.1, 0, 0])
#[pyclass(frozen, weakref, module = "linkwork")]
pub struct Builder {
    parts: Mutex<multibody::Builder>,
}

#[pymethods]
impl Builder {
    #[new]
    fn new() -> Self {
        Self { parts: Mutex::default() }
    }

    /// Add a body. Its parent may be added later.
    ///
    /// Parameters
    /// ----------
    /// name : str
    ///     Name of the body.
    /// parent : str
    ///     "world" or the name of a body (default: "world").
    /// hinge : Hinge, optional
    ///     Hinge between parent and body (default: a weld).
    /// mass : float
    ///     Mass, kg (default: 0).
    /// com : array_like, shape (3,), optional
    ///     Centre of mass in body axes, m (default: the origin).
    /// inertia : array_like, shape (3, 3), optional
    ///     Inertia about the centre of mass in body axes, kg m², with −∫xy dm off the diagonal (default: zero).
    /// inertia_check : {"physical", "positive_moments"}
    ///     "positive_moments" accepts principal moments that break the triangle inequality; use it for published data.
    /// hinge_in_parent, hinge_in_body : array_like, optional
    ///     Pose of the hinge frame in the parent and in the body, m: (3,) position, (7,) position and quaternion [x y z w], or (4, 4).
    /// modes : Modes, optional
    ///     Mode shapes of a flexible body. Their mass is added to `mass`.
    ///
    /// Returns
    /// -------
    /// Builder
    ///     This builder.
    ///
    /// Raises
    /// ------
    /// LinkworkError
    ///     If an array has a wrong shape or contains NaN, or no rigid body can have the inertia.
    ///
    /// Examples
    /// --------
    /// >>> parts.body("rod", "crank", pin, mass=0.5, hinge_in_parent=[0.2, 0, 0]).build().bodies
    /// ['crank', 'rod']
    #[pyo3(signature = (name, parent="world", hinge=None, *, mass=0.0, com=None, inertia=None, inertia_check="physical", hinge_in_parent=None, hinge_in_body=None, modes=None))]
    fn body(
        slf: Py<Self>,
        name: String,
        parent: &str,
        hinge: Option<&Hinge>,
        mass: f64,
        com: Option<&Bound<'_, PyAny>>,
        inertia: Option<&Bound<'_, PyAny>>,
        inertia_check: &str,
        hinge_in_parent: Option<&Bound<'_, PyAny>>,
        hinge_in_body: Option<&Bound<'_, PyAny>>,
        modes: Option<&Modes>,
    ) -> PyResult<Py<Self>> {
        let mass = (mass, com, inertia, inertia_check);
        let mut spec = body_spec(name, parent, hinge, mass, (hinge_in_parent, hinge_in_body))?;
        spec.modes = modes.map(|m| m.modes.clone());
        crate::core::lock(&slf.get().parts).body(spec);
        Ok(slf)
    }

    /// Add a node: a named frame on a body.
    ///
    /// Parameters
    /// ----------
    /// name : str
    ///     Name of the node.
    /// body : str
    ///     Name of a body.
    /// pose : array_like, optional
    ///     Pose in the body's frame, m: (3,), (7,) or (4, 4) (default: the body's origin).
    ///
    /// Returns
    /// -------
    /// Builder
    ///     This builder.
    ///
    /// Raises
    /// ------
    /// LinkworkError
    ///     If the pose has a wrong shape.
    ///
    /// Examples
    /// --------
    /// >>> parts.node("end", "crank", [0.2, 0, 0]).build().nodes
    /// ['end']
    #[pyo3(signature = (name, body, pose=None))]
    fn node(
        slf: Py<Self>,
        name: String,
        body: String,
        pose: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<Py<Self>> {
        let X = crate::array::pose(pose, "pose")?;
        crate::core::lock(&slf.get().parts).node(name, body, X);
        Ok(slf)
    }

    /// Close a loop: frame B on one body moves relative to frame A on another body as a hinge permits.
    ///
    /// Parameters
    /// ----------
    /// name : str
    ///     Name of the loop.
    /// body_a, body_b : str
    ///     "world" or the name of a body. Bodies may be added later.
    /// hinge : Hinge
    ///     The permitted motion. Positions of its prescribed pins and sliders are passed to the algorithms as `loop_motions`.
    /// at_a, at_b : array_like, optional
    ///     Poses of the frames in their bodies, m: (3,), (7,) or (4, 4).
    ///
    /// Returns
    /// -------
    /// Builder
    ///     This builder.
    ///
    /// Raises
    /// ------
    /// LinkworkError
    ///     If a pose has a wrong shape.
    ///
    /// Examples
    /// --------
    /// >>> rod = parts.body("rod", "crank", pin, mass=1, hinge_in_parent=[0.2, 0, 0])
    /// >>> rod = rod.loop("end", "rod", "world", linkwork.Hinge.slider([1, 0, 0]), at_a=[0.5, 0, 0])
    /// >>> rod.build().constraints
    /// [Constraint(loop `end`, rod, world, rows=5)]
    #[pyo3(signature = (name, body_a, body_b, hinge, *, at_a=None, at_b=None))]
    fn r#loop(
        slf: Py<Self>,
        name: String,
        body_a: String,
        body_b: String,
        hinge: &Hinge,
        at_a: Option<&Bound<'_, PyAny>>,
        at_b: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<Py<Self>> {
        let (frame_a, frame_b) = (pose(at_a, "at_a")?, pose(at_b, "at_b")?);
        let hinge = hinge.hinge.clone();
        let closure = LoopClosure { name, body_a, frame_a, body_b, frame_b, hinge };
        crate::core::lock(&slf.get().parts).loop_closure(closure);
        Ok(slf)
    }

    /// Add a linear relation between hinge coordinates: the sum of factor times coordinate (rad or m) equals a constant.
    ///
    /// Parameters
    /// ----------
    /// name : str
    ///     Name of the coupling.
    /// terms : mapping
    ///     {body: factor} for a body whose hinge has one subhinge, or {(body, subhinge): factor} with the number of the subhinge, counted from
    ///     the parent.
    /// constant : float
    ///     Value of the sum (default: 0).
    ///
    /// Returns
    /// -------
    /// Builder
    ///     This builder.
    ///
    /// Raises
    /// ------
    /// LinkworkError
    ///     If `terms` has keys or values of another type.
    ///
    /// Examples
    /// --------
    /// >>> two = parts.body("other", "world", pin, mass=1).coupling("gear", {"crank": 1.0, "other": 2.0})
    /// >>> two.build().constraints
    /// [Constraint(coupling `gear`, crank, other, rows=1)]
    #[pyo3(signature = (name, terms, constant=0.0))]
    fn coupling(
        slf: Py<Self>,
        name: String,
        terms: &Bound<'_, PyDict>,
        constant: f64,
    ) -> PyResult<Py<Self>> {
        let term = |(key, factor): (Bound<'_, PyAny>, Bound<'_, PyAny>)| -> PyResult<Term> {
            let (body, subhinge) = match key.extract::<(String, usize)>() {
                Ok(pair) => pair,
                Err(_) => (key.extract()?, 0),
            };
            let coordinate = HingeCoordinate { body, subhinge };
            Ok(Term { coordinate, factor: factor.extract()? })
        };
        let terms = crate::values::pairs(terms).into_iter().map(term).collect::<PyResult<_>>()?;
        crate::core::lock(&slf.get().parts).coupling(Coupling::linear(name, terms, constant));
        Ok(slf)
    }

    /// Build the mechanism. Its bodies are in canonical order: depth first, siblings by name.
    ///
    /// Returns
    /// -------
    /// Mechanism
    ///     The mechanism.
    ///
    /// Raises
    /// ------
    /// LinkworkError
    ///     If the description has mistakes. The message lists all of them.
    ///
    /// Examples
    /// --------
    /// >>> parts.build()
    /// Mechanism(1 bodies, nq=1, nv=1)
    fn build(&self) -> PyResult<Mechanism> {
        let mbs = crate::core::lock(&self.parts).build().map_err(refuse)?;
        Ok(Mechanism { core: Arc::new(Core::new(mbs, GRAVITY)?) })
    }

    fn __repr__(&self) -> String {
        let parts = crate::core::lock(&self.parts);
        format!("Builder({} bodies, {} nodes)", parts.bodies().len(), parts.nodes().len())
    }
}

type ArrayLike<'a, 'py> = Option<&'a Bound<'py, PyAny>>;

/// Returns the specification of a body from (mass, centre of mass, inertia, inertia check) and the hinge frames on parent and body.
pub fn body_spec(
    name: String,
    parent: &str,
    hinge: Option<&Hinge>,
    (mass, com, inertia, inertia_check): (f64, ArrayLike<'_, '_>, ArrayLike<'_, '_>, &str),
    (hinge_in_parent, hinge_in_body): (ArrayLike<'_, '_>, ArrayLike<'_, '_>),
) -> PyResult<BodySpec> {
    let com = com.map_or(Ok(Vec3::zeros()), |c| vec3(c, "com"))?;
    let inertia = inertia.map_or(Ok(Mat3::zeros()), |i| mat3(i, "inertia"))?;
    let check = choice("inertia_check", inertia_check, &INERTIA_CHECKS)?;
    Ok(BodySpec::new(name, parent)
        .hinge(hinge.map_or_else(multibody::Hinge::locked, |h| h.hinge.clone()))
        .hinge_in_parent(pose(hinge_in_parent, "hinge_in_parent")?)
        .hinge_in_body(pose(hinge_in_body, "hinge_in_body")?)
        .mass(MassProperties::new(mass, com, inertia).with_check(check)))
}
