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
///
/// >>> block = dict(mass=2, com=[0, 0, 0], inertia=0.1 * np.eye(3))
/// >>> parts = linkwork.Builder().body("a", "world", linkwork.Hinge.free(), **block).body("b", "world", linkwork.Hinge.free(), **block)
/// >>> at_rest, moving = [0, 0, 0, 0, 0, 0], [0, 0, 0, 3, 0, 0]
/// >>> edit = parts.build().edit([0, 0, 0, 0, 0, 0, 1, 1, 0, 0, 0, 0, 0, 1], moving + at_rest)
/// >>> report = edit.attach("b", "a", linkwork.Hinge.locked())
/// >>> report
/// Report(energy 9 J -> 4.5 J)
#[pyclass(frozen, weakref, module = "linkwork")]
pub struct Report(dynamics::topology::Report);

#[pymethods]
impl Report {
    /// The point (3,) of the world that moments are about, m: the origin of the body concerned.
    ///
    /// >>> report.point.tolist()
    /// [1.0, 0.0, 0.0]
    #[getter]
    fn point<'py>(&self, py: Python<'py>) -> PyResult<Array1<'py>> {
        out_vec3(py, &self.0.point)
    }
    /// Momentum (6,) of all bodies before: angular about the point (kg m²/s), linear (kg m/s).
    ///
    /// >>> report.momentum_before.tolist()
    /// [0.0, 0.0, 0.0, 6.0, 0.0, 0.0]
    #[getter]
    fn momentum_before<'py>(&self, py: Python<'py>) -> PyResult<Array1<'py>> {
        out_force(py, &self.0.momentum_before)
    }
    /// Momentum (6,) after, about the same point. It differs when mass comes or goes, and when the world takes part. [N m s; N s].
    ///
    /// >>> bool(np.allclose(report.momentum_after, report.momentum_before))
    /// True
    #[getter]
    fn momentum_after<'py>(&self, py: Python<'py>) -> PyResult<Array1<'py>> {
        out_force(py, &self.0.momentum_after)
    }
    /// What the new hinge gave to the attached body and all outboard of it (6,): N m s, N s.
    ///
    /// >>> report.impulse.round(9).tolist()
    /// [0.0, 0.0, 0.0, 3.0, 0.0, 0.0]
    #[getter]
    fn impulse<'py>(&self, py: Python<'py>) -> PyResult<Array1<'py>> {
        out_force(py, &self.0.impulse)
    }
    /// Kinetic energy before, J.
    ///
    /// >>> report.energy_before
    /// 9.0
    #[getter]
    fn energy_before(&self) -> f64 {
        self.0.energy_before
    }
    /// Kinetic energy after, J.
    ///
    /// >>> round(report.energy_after, 9)
    /// 4.5
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
///
/// >>> pin, rod = linkwork.Hinge.pin([0, 1, 0]), dict(mass=2, com=[0.5, 0, 0], inertia=np.diag([0.01, 0.2, 0.2]))
/// >>> parts = linkwork.Builder().body("upper", "world", pin, **rod).body("lower", "upper", pin, hinge_in_parent=[1, 0, 0], **rod)
/// >>> edit = parts.build().edit([0, 0], [1, 0])
/// >>> report = edit.detach("lower")
/// >>> edit.mechanism.nv, report.energy_after == report.energy_before
/// (7, True)
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
    /// mechanism itself never changes. q in rad and m, v in rad/s and m/s.
    /// Raises LinkworkError for another shape and for NaN.
    ///
    /// >>> edit = arm.edit(q, v)
    /// >>> _ = edit.delete("lower")
    /// >>> edit.mechanism.bodies
    /// ['upper']
    fn edit(&self, q: &Bound<'_, PyAny>, v: &Bound<'_, PyAny>) -> PyResult<Edit> {
        let (q, v) = (self.core.configuration(q, "q")?, vector(v, self.core.nv(), "v")?);
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
    ///
    /// >>> edit.mechanism.bodies
    /// ['lower', 'upper']
    #[getter]
    fn mechanism(&self) -> PyResult<Mechanism> {
        let mbs = lock(&self.edit).multibody().clone();
        Ok(Mechanism { core: Arc::new(Core::new(mbs, self.gravity)?) })
    }
    /// Its configuration (nq,). Angles in rad, lengths in m.
    ///
    /// >>> edit.q.tolist()
    /// [1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0]
    #[getter]
    fn q<'py>(&self, py: Python<'py>) -> Array1<'py> {
        out1(py, lock(&self.edit).q().to_vec())
    }
    /// Its velocity (nv,). Rates in rad/s and m/s.
    ///
    /// >>> edit.v.tolist()
    /// [0.0, 1.0, 0.0, 0.0, 0.0, -1.0, 1.0]
    #[getter]
    fn v<'py>(&self, py: Python<'py>) -> Array1<'py> {
        out1(py, lock(&self.edit).v().to_vec())
    }
    /// For each number of v of the mechanism that the edit began with its place in v now; None
    /// where it is gone or the hinge is another.
    ///
    /// >>> edit.places_v
    /// [6, None]
    #[getter]
    fn places_v(&self) -> Vec<Option<usize>> {
        lock(&self.edit).clone().finish().places.v
    }
    /// The same for q.
    ///
    /// >>> edit.places_q
    /// [7, None]
    #[getter]
    fn places_q(&self) -> Vec<Option<usize>> {
        lock(&self.edit).clone().finish().places.q
    }

    /// Adds a body with the state q, v of its hinge (neutral, at rest); else as Builder.body.
    /// mass in kg, com (3,) in m, inertia (3, 3) about it in kg m².
    /// Raises LinkworkError for a name that is taken, a parent that is not there, and what Builder.body refuses.
    ///
    /// >>> _ = edit.add("tool", "upper", linkwork.Hinge.locked(), mass=0.5, com=[0, 0, 0])
    /// >>> edit.mechanism.total_mass
    /// 4.5
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
    /// `onto`. q in rad and m, v in rad/s and m/s. Places in m.
    /// q (nq,), v (nv,), pose (3,), (7,) or (4, 4). Raises LinkworkError for names that are taken, a body that is not there, other shapes, and NaN.
    ///
    /// >>> other = linkwork.Builder().body("wheel", "world", pin, **rod).build()
    /// >>> _ = edit.add_mechanism("left_", other, [0.3], [0], onto="upper", pose=[0, 0, 1])
    /// >>> sorted(edit.mechanism.bodies)
    /// ['left_wheel', 'lower', 'upper']
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
        let (q, v) = (core.configuration(q, "q")?, vector(v, core.nv(), "v")?);
        let X = crate::array::pose(pose, "pose")?;
        self.with(|e| e.add_mechanism(prefix, &core.mbs, (q.slice(), v.slice()), onto, X))
    }
    /// Deletes a body with all that hangs on it.
    /// Raises LinkworkError for a body that is not there.
    ///
    /// >>> _ = edit.delete("lower")
    /// >>> edit.mechanism.bodies
    /// ['upper']
    fn delete(&self, body: &str) -> PyResult<Report> {
        self.with(|e| e.delete(body))
    }
    /// Puts a body, with all that hangs on it, on a free hinge on `base`.
    /// Raises LinkworkError for a body that is not there, and a base that hangs on the body.
    ///
    /// >>> _ = edit.detach("upper")
    /// >>> edit.mechanism.nv
    /// 12
    #[pyo3(signature = (body, base="world"))]
    fn detach(&self, body: &str, base: &str) -> PyResult<Report> {
        self.with(|e| e.detach(body, base))
    }
    /// Makes a body the root of the free tree that it is in; hinges between are turned round.
    /// Raises LinkworkError for a body that is not there, and for a tree that is not free.
    ///
    /// >>> _ = edit.attach("upper", "lower", linkwork.Hinge.locked())
    /// >>> _ = edit.reroot("upper")
    /// >>> edit.mechanism.parent("lower")
    /// 'upper'
    fn reroot(&self, body: &str) -> PyResult<Report> {
        self.with(|e| e.reroot(body))
    }
    /// Puts a body, with all that hangs on it, on a new hinge on `onto`. Without hinge_in_parent the
    /// hinge is put where the body is, with its coordinates at q (neutral); with it both frames are
    /// given and the coordinates are found.
    /// q (nq,) of the hinge, frames (3,), m, (7,) or (4, 4). Raises LinkworkError for bodies that are not there, `onto` among what hangs on the body, and frames
    /// between which the hinge cannot lie.
    ///
    /// >>> report = edit.attach("lower", "upper", linkwork.Hinge.locked())
    /// >>> edit.mechanism.nv, report.energy_after <= report.energy_before
    /// (1, True)
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
    /// q (nq,) of the hinge, frames (3,), m, (7,) or (4, 4). Raises LinkworkError for what `reroot` and `attach` refuse.
    ///
    /// >>> _ = edit.attach_tree("lower", "upper", linkwork.Hinge.ball())
    /// >>> edit.mechanism.nv
    /// 4
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
