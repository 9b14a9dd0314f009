//! `Edit`: a mechanism in motion whose structure can be changed; `Report`: momentum and energy before and after a change.
use crate::array::{Array1, Input, out_force, out_vec3, out1, pose, vector};
use crate::builder::body_spec;
use crate::core::{Core, lock};
use crate::error::refuse;
use crate::hinge::Hinge;
use crate::mechanism::Mechanism;
use linkwork_dynamics::{self as dynamics, Placement, TopologyError};
use linkwork_spatial::Vec3;
use pyo3::prelude::*;
use std::sync::{Arc, Mutex};

/// Momentum and energy of the whole scene before and after a structural change.
///
/// Examples
/// --------
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
    /// Reference point (3,) of the angular momenta in the world, m: the origin of the body that the change concerns.
    ///
    /// Examples
    /// --------
    /// >>> report.point.tolist()
    /// [1.0, 0.0, 0.0]
    #[getter]
    fn point<'py>(&self, py: Python<'py>) -> PyResult<Array1<'py>> {
        out_vec3(py, &self.0.point)
    }
    /// Momentum (6,) of all bodies before the change: angular about `point`, kg m²/s, then linear, kg m/s.
    ///
    /// Examples
    /// --------
    /// >>> report.momentum_before.tolist()
    /// [0.0, 0.0, 0.0, 6.0, 0.0, 0.0]
    #[getter]
    fn momentum_before<'py>(&self, py: Python<'py>) -> PyResult<Array1<'py>> {
        out_force(py, &self.0.momentum_before)
    }
    /// Momentum (6,) of all bodies after the change, about the same point, kg m²/s and kg m/s.
    ///
    /// It differs from `momentum_before` if mass was added or removed, or if the world took part in the impact.
    ///
    /// Examples
    /// --------
    /// >>> bool(np.allclose(report.momentum_after, report.momentum_before))
    /// True
    #[getter]
    fn momentum_after<'py>(&self, py: Python<'py>) -> PyResult<Array1<'py>> {
        out_force(py, &self.0.momentum_after)
    }
    /// Impulse (6,) of the new hinge on the attached body and all bodies outboard of it: N m s, then N s.
    ///
    /// Examples
    /// --------
    /// >>> report.impulse.round(9).tolist()
    /// [0.0, 0.0, 0.0, 3.0, 0.0, 0.0]
    #[getter]
    fn impulse<'py>(&self, py: Python<'py>) -> PyResult<Array1<'py>> {
        out_force(py, &self.0.impulse)
    }
    /// Kinetic energy before the change, J.
    ///
    /// Examples
    /// --------
    /// >>> report.energy_before
    /// 9.0
    #[getter]
    fn energy_before(&self) -> f64 {
        self.0.energy_before
    }
    /// Kinetic energy after the change, J.
    ///
    /// Examples
    /// --------
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

/// A mechanism in motion whose structure can be changed. Create it with `Mechanism.edit(q, v)`.
///
/// `mechanism`, `q` and `v` are the result of all changes so far.
///
/// Notes
/// -----
/// Every body keeps its pose, and its velocity as far as its hinge permits. A new hinge removes the rest of the velocity in an inelastic impact.
/// An operation that raises leaves the edit unchanged.
///
/// Examples
/// --------
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
    /// Begin structural changes at a state. The mechanism itself never changes.
    ///
    /// Parameters
    /// ----------
    /// q : array_like, shape (nq,)
    ///     Configuration, rad and m.
    /// v : array_like, shape (nv,)
    ///     Rates, rad/s and m/s.
    ///
    /// Returns
    /// -------
    /// Edit
    ///     The edit.
    ///
    /// Raises
    /// ------
    /// LinkworkError
    ///     If an array has a wrong shape or contains NaN.
    ///
    /// Examples
    /// --------
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

/// Reads an optional vector.
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
    /// The mechanism after all changes so far.
    ///
    /// Examples
    /// --------
    /// >>> edit.mechanism.bodies
    /// ['lower', 'upper']
    #[getter]
    fn mechanism(&self) -> PyResult<Mechanism> {
        let mbs = lock(&self.edit).multibody().clone();
        Ok(Mechanism { core: Arc::new(Core::new(mbs, self.gravity)?) })
    }
    /// Its configuration (nq,), rad and m.
    ///
    /// Examples
    /// --------
    /// >>> edit.q.tolist()
    /// [1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0]
    #[getter]
    fn q<'py>(&self, py: Python<'py>) -> Array1<'py> {
        out1(py, lock(&self.edit).q().to_vec())
    }
    /// Its rates (nv,), rad/s and m/s.
    ///
    /// Examples
    /// --------
    /// >>> edit.v.tolist()
    /// [0.0, 1.0, 0.0, 0.0, 0.0, -1.0, 1.0]
    #[getter]
    fn v<'py>(&self, py: Python<'py>) -> Array1<'py> {
        out1(py, lock(&self.edit).v().to_vec())
    }
    /// For each entry of v of the original mechanism, its index in the current v; None if it was removed or its hinge was replaced.
    ///
    /// Examples
    /// --------
    /// >>> edit.places_v
    /// [6, None]
    #[getter]
    fn places_v(&self) -> Vec<Option<usize>> {
        lock(&self.edit).clone().finish().places.v
    }
    /// For each entry of q of the original mechanism, its index in the current q; None if it was removed or its hinge was replaced.
    ///
    /// Examples
    /// --------
    /// >>> edit.places_q
    /// [7, None]
    #[getter]
    fn places_q(&self) -> Vec<Option<usize>> {
        lock(&self.edit).clone().finish().places.q
    }

    /// Add a body. Parameters that are not listed are those of `Builder.body`.
    ///
    /// Parameters
    /// ----------
    /// q, v : array_like, optional
    ///     Coordinates, rad and m, and rates of the body's hinge, shapes (nq,) and (nv,) of the hinge (default: neutral and at rest).
    /// mass : float
    ///     Mass, kg.
    /// com : array_like, shape (3,), optional
    ///     Centre of mass, m.
    /// inertia : array_like, shape (3, 3), optional
    ///     Inertia about the centre of mass, kg m².
    ///
    /// Returns
    /// -------
    /// Report
    ///     Momentum and energy before and after.
    ///
    /// Raises
    /// ------
    /// LinkworkError
    ///     If the name is in use, the parent does not exist, or `Builder.body` rejects an argument.
    ///
    /// Examples
    /// --------
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
        let q = q.unwrap_or_else(|| crate::hinge::neutral(&spec.hinge));
        let v = v.unwrap_or_else(|| vec![0.0; spec.hinge.nv()]);
        self.with(|e| e.add(spec, &q, &v))
    }
    /// Add a whole mechanism.
    ///
    /// Parameters
    /// ----------
    /// prefix : str
    ///     Prefix of all its names.
    /// mechanism : Mechanism
    ///     The mechanism.
    /// q : array_like, shape (nq,)
    ///     Its configuration, rad and m.
    /// v : array_like, shape (nv,)
    ///     Its rates, rad/s and m/s.
    /// onto : str
    ///     Body on which its world is placed (default: "world").
    /// pose : array_like, optional
    ///     Pose of its world on `onto`, m: (3,), (7,) or (4, 4).
    ///
    /// Returns
    /// -------
    /// Report
    ///     Momentum and energy before and after.
    ///
    /// Raises
    /// ------
    /// LinkworkError
    ///     If a name is in use, the body does not exist, or an array has a wrong shape or contains NaN.
    ///
    /// Examples
    /// --------
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
    /// Remove a body and all bodies outboard of it.
    ///
    /// Parameters
    /// ----------
    /// body : str
    ///     Name of a body.
    ///
    /// Returns
    /// -------
    /// Report
    ///     Momentum and energy before and after.
    ///
    /// Raises
    /// ------
    /// LinkworkError
    ///     If the body does not exist.
    ///
    /// Examples
    /// --------
    /// >>> _ = edit.delete("lower")
    /// >>> edit.mechanism.bodies
    /// ['upper']
    fn delete(&self, body: &str) -> PyResult<Report> {
        self.with(|e| e.delete(body))
    }
    /// Replace the hinge of a body by a free hinge on `base`. Bodies outboard of it stay connected.
    ///
    /// Parameters
    /// ----------
    /// body : str
    ///     Name of a body.
    /// base : str
    ///     Parent of the free hinge (default: "world").
    ///
    /// Returns
    /// -------
    /// Report
    ///     Momentum and energy before and after.
    ///
    /// Raises
    /// ------
    /// LinkworkError
    ///     If the body does not exist, or `base` is outboard of it.
    ///
    /// Examples
    /// --------
    /// >>> _ = edit.detach("upper")
    /// >>> edit.mechanism.nv
    /// 12
    #[pyo3(signature = (body, base="world"))]
    fn detach(&self, body: &str, base: &str) -> PyResult<Report> {
        self.with(|e| e.detach(body, base))
    }
    /// Make a body the root of its free-floating tree. Hinges between the old and the new root are reversed.
    ///
    /// Parameters
    /// ----------
    /// body : str
    ///     Name of a body.
    ///
    /// Returns
    /// -------
    /// Report
    ///     Momentum and energy before and after.
    ///
    /// Raises
    /// ------
    /// LinkworkError
    ///     If the body does not exist, or its tree is not free-floating.
    ///
    /// Examples
    /// --------
    /// >>> _ = edit.attach("upper", "lower", linkwork.Hinge.locked())
    /// >>> _ = edit.reroot("upper")
    /// >>> edit.mechanism.parent("lower")
    /// 'upper'
    fn reroot(&self, body: &str) -> PyResult<Report> {
        self.with(|e| e.reroot(body))
    }
    /// Replace the hinge of a body by a new hinge on another body. Bodies outboard of it stay connected.
    ///
    /// Parameters
    /// ----------
    /// body : str
    ///     Name of a body.
    /// onto : str
    ///     The new parent.
    /// hinge : Hinge
    ///     The new hinge.
    /// q : array_like, shape (nq,) of the hinge, optional
    ///     Coordinates of the hinge, rad and m, if `hinge_in_parent` is omitted (default: neutral).
    /// hinge_in_parent : array_like, optional
    ///     Hinge frame in the parent, m: (3,), (7,) or (4, 4). By default the hinge frame is where the body is. If you pass it, the coordinates
    ///     are computed from both frames.
    /// hinge_in_body : array_like, optional
    ///     Hinge frame in the body, m: (3,), (7,) or (4, 4).
    ///
    /// Returns
    /// -------
    /// Report
    ///     Momentum and energy before and after; `impulse` is that of the impact.
    ///
    /// Raises
    /// ------
    /// LinkworkError
    ///     If a body does not exist, `onto` is outboard of the body, or the hinge cannot connect the two frames.
    ///
    /// Examples
    /// --------
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
    /// Attach a body by a new hinge, together with its whole free-floating tree: `reroot`, then `attach`.
    ///
    /// Parameters
    /// ----------
    /// body : str
    ///     Name of a body.
    /// onto : str
    ///     The new parent.
    /// hinge : Hinge
    ///     The new hinge.
    /// q : array_like, shape (nq,) of the hinge, optional
    ///     Coordinates of the hinge, rad and m.
    /// hinge_in_parent, hinge_in_body : array_like, optional
    ///     Hinge frames, m: (3,), (7,) or (4, 4), as in `attach`.
    ///
    /// Returns
    /// -------
    /// Report
    ///     Momentum and energy before and after.
    ///
    /// Raises
    /// ------
    /// LinkworkError
    ///     If `reroot` or `attach` would raise.
    ///
    /// Examples
    /// --------
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
