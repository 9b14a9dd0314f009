//! `Edit`: a mechanism in motion whose structure is changed; `Report`: its books of momentum.
use crate::array::{Array1, Input, out_force, out_vec3, out1, pose, vector};
use crate::builder::{Hinge, body_spec};
use crate::core::{Core, lock};
use crate::error::refuse;
use crate::mechanism::Mechanism;
use linkwork_dynamics::{self as dynamics, Placement, TopologyError};
use linkwork_spatial::Vec3;
use pyo3::prelude::*;
use std::sync::{Arc, Mutex};

/// Momentum and energy of the whole scene before and after an operation.
#[pyclass(frozen, weakref, module = "linkwork")]
pub struct Report(dynamics::topology::Report);

#[pymethods]
impl Report {
    /// The point (3,) of the world that moments are about, m: the origin of the body concerned.
    #[getter]
    fn point<'py>(&self, py: Python<'py>) -> Array1<'py> {
        out_vec3(py, &self.0.point)
    }
    /// Momentum (6,) of all bodies before: angular about the point (kg m²/s), linear (kg m/s).
    #[getter]
    fn momentum_before<'py>(&self, py: Python<'py>) -> Array1<'py> {
        out_force(py, &self.0.momentum_before)
    }
    /// The same after. It differs when mass comes or goes, and when the world takes part.
    #[getter]
    fn momentum_after<'py>(&self, py: Python<'py>) -> Array1<'py> {
        out_force(py, &self.0.momentum_after)
    }
    /// What the new hinge gave to the attached body and all outboard of it (6,): N m s, N s.
    #[getter]
    fn impulse<'py>(&self, py: Python<'py>) -> Array1<'py> {
        out_force(py, &self.0.impulse)
    }
    /// Kinetic energy before, J.
    #[getter]
    fn energy_before(&self) -> f64 {
        self.0.energy_before
    }
    /// Kinetic energy after, J.
    #[getter]
    fn energy_after(&self) -> f64 {
        self.0.energy_after
    }
    fn __repr__(&self) -> String {
        format!("Report(energy {} J -> {} J)", self.0.energy_before, self.0.energy_after)
    }
}

/// A mechanism in motion, open to changes of its structure. Make it with `Mechanism.edit(q, v)`;
/// `mechanism`, `q` and `v` are what has become of it.
///
/// Every body stays where it is and moves as it moved, as far as its hinge permits; what a new hinge
/// does not permit goes in an inelastic impact. An operation that fails leaves the edit as it was.
#[pyclass(frozen, weakref, module = "linkwork")]
pub struct Edit {
    gravity: Vec3,
    edit: Mutex<dynamics::Edit>,
}

impl Edit {
    fn with(
        &self,
        f: impl FnOnce(&mut dynamics::Edit) -> Result<dynamics::topology::Report, TopologyError>,
    ) -> PyResult<Report> {
        f(&mut lock(&self.edit)).map(Report).map_err(refuse)
    }
}

#[pymethods]
impl Mechanism {
    /// Opens the mechanism at q (nq,), v (nv,) for changes of its structure: see Edit. The
    /// mechanism itself never changes.
    /// Raises LinkworkError for another shape and for NaN.
    ///
    /// >>> edit = arm.edit(q, v)
    /// >>> _ = edit.delete("lower")
    /// >>> edit.mechanism.bodies
    /// ['upper']
    fn edit(&self, q: &Bound<'_, PyAny>, v: &Bound<'_, PyAny>) -> PyResult<Edit> {
        let (q, v) = (vector(q, self.core.nq(), "q")?, vector(v, self.core.nv(), "v")?);
        let edit = dynamics::Edit::new(&self.core.mbs, q.slice(), v.slice()).map_err(refuse)?;
        Ok(Edit { gravity: self.core.gravity(), edit: Mutex::new(edit) })
    }
}

/// The numbers of an optional vector.
fn numbers(given: Option<&Bound<'_, PyAny>>, what: &str) -> PyResult<Option<Vec<f64>>> {
    given.map(|g| Ok(Input::read(g, what)?.slice().to_vec())).transpose()
}

fn placement(
    q: Option<&Bound<'_, PyAny>>,
    hinge_in_parent: Option<&Bound<'_, PyAny>>,
    hinge_in_body: Option<&Bound<'_, PyAny>>,
) -> PyResult<Placement> {
    let body = pose(hinge_in_body, "hinge_in_body")?;
    Ok(match hinge_in_parent {
        Some(parent) => Placement::Frames {
            hinge_in_parent: pose(Some(parent), "hinge_in_parent")?,
            hinge_in_body: body,
        },
        None => Placement::Here { hinge_in_body: body, q: numbers(q, "q")? },
    })
}

#[pymethods]
impl Edit {
    /// The mechanism as it is now.
    #[getter]
    fn mechanism(&self) -> PyResult<Mechanism> {
        let mbs = lock(&self.edit).multibody().clone();
        Ok(Mechanism { core: Arc::new(Core::new(mbs, self.gravity)?) })
    }
    /// Its configuration (nq,).
    #[getter]
    fn q<'py>(&self, py: Python<'py>) -> Array1<'py> {
        out1(py, lock(&self.edit).q().to_vec())
    }
    /// Its velocity (nv,).
    #[getter]
    fn v<'py>(&self, py: Python<'py>) -> Array1<'py> {
        out1(py, lock(&self.edit).v().to_vec())
    }
    /// For each number of v of the mechanism that the edit began with its place in v now; None
    /// where it is gone or the hinge is another.
    #[getter]
    fn places_v(&self) -> Vec<Option<usize>> {
        lock(&self.edit).clone().finish().places.v
    }
    /// The same for q.
    #[getter]
    fn places_q(&self) -> Vec<Option<usize>> {
        lock(&self.edit).clone().finish().places.q
    }

    /// Adds a body with the state q, v of its hinge (neutral, at rest); else as Builder.body.
    #[pyo3(signature = (name, parent="world", hinge=None, *, q=None, v=None, mass=0.0, com=None, inertia=None, inertia_check="physical", hinge_in_parent=None, hinge_in_body=None))]
    fn add(
        &self,
        name: String,
        parent: &str,
        hinge: Option<&Hinge>,
        q: Option<&Bound<'_, PyAny>>,
        v: Option<&Bound<'_, PyAny>>,
        mass: f64,
        com: Option<&Bound<'_, PyAny>>,
        inertia: Option<&Bound<'_, PyAny>>,
        inertia_check: &str,
        hinge_in_parent: Option<&Bound<'_, PyAny>>,
        hinge_in_body: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<Report> {
        let spec = body_spec(
            name,
            parent,
            hinge,
            (mass, com, inertia, inertia_check),
            (hinge_in_parent, hinge_in_body),
        )?;
        let (q, v) = (numbers(q, "q")?, numbers(v, "v")?);
        let q = q.unwrap_or_else(|| crate::builder::neutral(&spec.hinge));
        let v = v.unwrap_or_else(|| vec![0.0; spec.hinge.nv()]);
        self.with(|e| e.add(spec, &q, &v))
    }
    /// Adds a whole mechanism at q, v. Names get the prefix; its world is put at a pose on the body
    /// `onto`.
    #[pyo3(signature = (prefix, mechanism, q, v, onto="world", pose=None))]
    fn add_mechanism(
        &self,
        prefix: &str,
        mechanism: &Mechanism,
        q: &Bound<'_, PyAny>,
        v: &Bound<'_, PyAny>,
        onto: &str,
        pose: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<Report> {
        let core = &*mechanism.core;
        let (q, v) = (vector(q, core.nq(), "q")?, vector(v, core.nv(), "v")?);
        let X = crate::array::pose(pose, "pose")?;
        self.with(|e| e.add_mechanism(prefix, &core.mbs, (q.slice(), v.slice()), onto, X))
    }
    /// Deletes a body with all that hangs on it.
    fn delete(&self, body: &str) -> PyResult<Report> {
        self.with(|e| e.delete(body))
    }
    /// Puts a body, with all that hangs on it, on a free hinge on `base`.
    #[pyo3(signature = (body, base="world"))]
    fn detach(&self, body: &str, base: &str) -> PyResult<Report> {
        self.with(|e| e.detach(body, base))
    }
    /// Makes a body the root of the free tree that it is in; hinges between are turned round.
    fn reroot(&self, body: &str) -> PyResult<Report> {
        self.with(|e| e.reroot(body))
    }
    /// Puts a body, with all that hangs on it, on a new hinge on `onto`. Without hinge_in_parent the
    /// hinge is put where the body is, with its coordinates at q (neutral); with it both frames are
    /// given and the coordinates are found.
    #[pyo3(signature = (body, onto, hinge, *, q=None, hinge_in_parent=None, hinge_in_body=None))]
    fn attach(
        &self,
        body: &str,
        onto: &str,
        hinge: &Hinge,
        q: Option<&Bound<'_, PyAny>>,
        hinge_in_parent: Option<&Bound<'_, PyAny>>,
        hinge_in_body: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<Report> {
        let placement = placement(q, hinge_in_parent, hinge_in_body)?;
        self.with(|e| e.attach(body, onto, hinge.hinge.clone(), &placement))
    }
    /// `reroot` and `attach`: puts a body on a new hinge with the whole free tree that it is in.
    #[pyo3(signature = (body, onto, hinge, *, q=None, hinge_in_parent=None, hinge_in_body=None))]
    fn attach_tree(
        &self,
        body: &str,
        onto: &str,
        hinge: &Hinge,
        q: Option<&Bound<'_, PyAny>>,
        hinge_in_parent: Option<&Bound<'_, PyAny>>,
        hinge_in_body: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<Report> {
        let placement = placement(q, hinge_in_parent, hinge_in_body)?;
        self.with(|e| e.attach_tree(body, onto, hinge.hinge.clone(), &placement))
    }
    fn __repr__(&self) -> String {
        let edit = lock(&self.edit);
        format!("Edit({} bodies)", edit.multibody().bodies().len())
    }
}
