//! `Builder` and `Hinge` describe a mechanism in Python; `Subhinge` describes a subhinge of a built mechanism.
use crate::array::{mat3, out_vec3, pose, vec3};
use crate::core::{Core, GRAVITY};
use crate::error::refuse;
use crate::mechanism::{INERTIA_CHECKS, Mechanism, choice};
use crate::modes::Modes;
use linkwork_multibody::{
    self as multibody, BodySpec, Coordinate, Coupling, HingeCoordinate, Limits, LoopClosure,
    SubhingeKind, Term,
};
use linkwork_spatial::{MassProperties, Mat3, Vec3};
use pyo3::prelude::*;
use pyo3::types::{PyDict, PySlice, PyTuple};
use std::sync::{Arc, Mutex};

/// The motion of a body relative to its parent: a chain of subhinges, beginning at the parent.
///
/// Notes
/// -----
/// Axes (3,) are in the hinge frame and need not be of unit length.
///
/// Examples
/// --------
/// >>> import numpy as np, linkwork
/// >>> pin = linkwork.Hinge.pin([0, 1, 0])
#[pyclass(frozen, weakref, module = "linkwork")]
pub struct Hinge {
    /// The hinge of the Rust interface.
    pub hinge: multibody::Hinge,
}

impl Hinge {
    fn with(&self, f: impl FnOnce(multibody::Hinge) -> multibody::Hinge) -> Self {
        Self { hinge: f(self.hinge.clone()) }
    }
}

#[pymethods]
impl Hinge {
    /// Create a hinge that rotates about an axis; q in rad.
    ///
    /// Parameters
    /// ----------
    /// axis : array_like, shape (3,)
    ///     Direction of the axis.
    ///
    /// Returns
    /// -------
    /// Hinge
    ///     One degree of freedom.
    ///
    /// Raises
    /// ------
    /// LinkworkError
    ///     If the axis has a wrong shape or contains NaN. An axis of length zero is an error in `Builder.build`.
    ///
    /// Examples
    /// --------
    /// >>> linkwork.Hinge.pin([0, 0, 1])
    /// Hinge(pin)
    #[staticmethod]
    fn pin(axis: &Bound<'_, PyAny>) -> PyResult<Self> {
        Ok(Self { hinge: multibody::Hinge::pin(vec3(axis, "axis")?) })
    }
    /// Create a hinge that translates along an axis; q in m.
    ///
    /// Parameters
    /// ----------
    /// axis : array_like, shape (3,)
    ///     Direction of the axis.
    ///
    /// Returns
    /// -------
    /// Hinge
    ///     One degree of freedom.
    ///
    /// Raises
    /// ------
    /// LinkworkError
    ///     If the axis has a wrong shape or contains NaN. An axis of length zero is an error in `Builder.build`.
    ///
    /// Examples
    /// --------
    /// >>> linkwork.Hinge.slider([1, 0, 0])
    /// Hinge(slider)
    #[staticmethod]
    fn slider(axis: &Bound<'_, PyAny>) -> PyResult<Self> {
        Ok(Self { hinge: multibody::Hinge::slider(vec3(axis, "axis")?) })
    }
    /// Create a hinge that rotates about an axis and advances along it; q in rad.
    ///
    /// Parameters
    /// ----------
    /// axis : array_like, shape (3,)
    ///     Direction of the axis.
    /// pitch : float
    ///     Advance, m/rad.
    ///
    /// Returns
    /// -------
    /// Hinge
    ///     One degree of freedom.
    ///
    /// Raises
    /// ------
    /// LinkworkError
    ///     If the axis has a wrong shape or contains NaN. An axis of length zero is an error in `Builder.build`.
    ///
    /// Examples
    /// --------
    /// >>> linkwork.Hinge.screw([1, 0, 0], 0.002)
    /// Hinge(screw)
    #[staticmethod]
    fn screw(axis: &Bound<'_, PyAny>, pitch: f64) -> PyResult<Self> {
        Ok(Self { hinge: multibody::Hinge::screw(vec3(axis, "axis")?, pitch) })
    }
    /// Create a hinge with any rotation.
    ///
    /// Returns
    /// -------
    /// Hinge
    ///     q is a quaternion [x y z w], child to parent; v is the angular velocity in child axes, rad/s.
    ///
    /// Examples
    /// --------
    /// >>> linkwork.Hinge.ball().nq, linkwork.Hinge.ball().nv
    /// (4, 3)
    #[staticmethod]
    fn ball() -> Self {
        Self { hinge: multibody::Hinge::ball() }
    }
    /// Create a hinge with any motion.
    ///
    /// Returns
    /// -------
    /// Hinge
    ///     q is [x y z qx qy qz qw], m; v is [ω; v] in child axes, rad/s and m/s.
    ///
    /// Examples
    /// --------
    /// >>> linkwork.Hinge.free().nq, linkwork.Hinge.free().nv
    /// (7, 6)
    #[staticmethod]
    fn free() -> Self {
        Self { hinge: multibody::Hinge::free() }
    }
    /// Create a hinge without motion (a weld).
    ///
    /// Returns
    /// -------
    /// Hinge
    ///     No degrees of freedom.
    ///
    /// Examples
    /// --------
    /// >>> linkwork.Hinge.locked().nv
    /// 0
    #[staticmethod]
    fn locked() -> Self {
        Self { hinge: multibody::Hinge::locked() }
    }
    /// Create a hinge of two pins with intersecting axes; q in rad.
    ///
    /// Parameters
    /// ----------
    /// first, second : array_like, shape (3,)
    ///     Directions of the axes.
    ///
    /// Returns
    /// -------
    /// Hinge
    ///     Two degrees of freedom.
    ///
    /// Raises
    /// ------
    /// LinkworkError
    ///     If an axis has a wrong shape or contains NaN. An axis of length zero is an error in `Builder.build`.
    ///
    /// Examples
    /// --------
    /// >>> linkwork.Hinge.universal([1, 0, 0], [0, 1, 0])
    /// Hinge(pin, pin)
    #[staticmethod]
    fn universal(first: &Bound<'_, PyAny>, second: &Bound<'_, PyAny>) -> PyResult<Self> {
        let (first, second) = (vec3(first, "first")?, vec3(second, "second")?);
        Ok(Self { hinge: multibody::Hinge::universal(first, second) })
    }
    /// Create a hinge of a slider and a pin on one axis.
    ///
    /// Parameters
    /// ----------
    /// axis : array_like, shape (3,)
    ///     Direction of the axis.
    ///
    /// Returns
    /// -------
    /// Hinge
    ///     Two degrees of freedom; q in m, then rad.
    ///
    /// Raises
    /// ------
    /// LinkworkError
    ///     If the axis has a wrong shape or contains NaN. An axis of length zero is an error in `Builder.build`.
    ///
    /// Examples
    /// --------
    /// >>> linkwork.Hinge.cylindrical([0, 0, 1])
    /// Hinge(slider, pin)
    #[staticmethod]
    fn cylindrical(axis: &Bound<'_, PyAny>) -> PyResult<Self> {
        Ok(Self { hinge: multibody::Hinge::cylindrical(vec3(axis, "axis")?) })
    }
    /// Create a hinge of three pins, about the moving x, y and z axes.
    ///
    /// Returns
    /// -------
    /// Hinge
    ///     Three degrees of freedom.
    ///
    /// Examples
    /// --------
    /// >>> linkwork.Hinge.gimbal()
    /// Hinge(pin, pin, pin)
    #[staticmethod]
    fn gimbal() -> Self {
        Self { hinge: multibody::Hinge::gimbal() }
    }
    /// Create a hinge that slides along x and y, then rotates about z.
    ///
    /// Returns
    /// -------
    /// Hinge
    ///     Three degrees of freedom.
    ///
    /// Examples
    /// --------
    /// >>> linkwork.Hinge.planar()
    /// Hinge(slider, slider, pin)
    #[staticmethod]
    fn planar() -> Self {
        Self { hinge: multibody::Hinge::planar() }
    }
    /// Create a hinge that consists of several hinges in series, beginning at the parent.
    ///
    /// Parameters
    /// ----------
    /// *hinges : Hinge
    ///     The hinges.
    ///
    /// Returns
    /// -------
    /// Hinge
    ///     The chain.
    ///
    /// Examples
    /// --------
    /// >>> linkwork.Hinge.chain(pin, linkwork.Hinge.slider([1, 0, 0]))
    /// Hinge(pin, slider)
    #[staticmethod]
    #[pyo3(signature = (*hinges))]
    fn chain(hinges: &Bound<'_, PyTuple>) -> PyResult<Self> {
        let mut subhinges = Vec::new();
        for h in hinges.iter() {
            subhinges.extend_from_slice(&h.cast::<Hinge>()?.get().hinge.subhinges);
        }
        Ok(Self { hinge: multibody::Hinge { subhinges } })
    }
    /// Return a copy whose motion is prescribed; its forces are computed.
    ///
    /// Returns
    /// -------
    /// Hinge
    ///     The copy.
    ///
    /// Examples
    /// --------
    /// >>> linkwork.Builder().body("b", "world", pin.prescribed(), mass=1).build().prescribed
    /// [True]
    fn prescribed(&self) -> Self {
        self.with(multibody::Hinge::prescribed)
    }
    /// Return a copy with a rotor of the given inertia on each subhinge.
    ///
    /// Parameters
    /// ----------
    /// armature : float
    ///     Inertia at the rotor, before the gear, kg m² (sliders: kg).
    ///
    /// Returns
    /// -------
    /// Hinge
    ///     The copy.
    ///
    /// Examples
    /// --------
    /// >>> linkwork.Builder().body("b", "world", pin.armature(0.2), mass=0).build().mass_matrix([0]).tolist()
    /// [[0.2]]
    fn armature(&self, armature: f64) -> Self {
        self.with(|h| h.armature(armature))
    }
    /// Return a copy with the given gear ratio.
    ///
    /// Parameters
    /// ----------
    /// gear : float
    ///     Revolutions of the rotor per revolution of the hinge.
    ///
    /// Returns
    /// -------
    /// Hinge
    ///     The copy.
    ///
    /// Examples
    /// --------
    /// >>> linkwork.Builder().body("b", "world", pin.armature(0.2).gear(10), mass=0).build().mass_matrix([0]).tolist()
    /// [[20.0]]
    fn gear(&self, gear: f64) -> Self {
        self.with(|h| h.gear(gear))
    }
    /// Return a copy with limits. The dynamics does not enforce them.
    ///
    /// Parameters
    /// ----------
    /// lower, upper : float, optional
    ///     Limits of the coordinate, rad or m.
    /// rate : float, optional
    ///     Limit of the velocity, rad/s or m/s.
    /// effort : float, optional
    ///     Limit of the force, N m or N.
    ///
    /// Returns
    /// -------
    /// Hinge
    ///     The copy.
    ///
    /// Examples
    /// --------
    /// >>> linkwork.Builder().body("b", "world", pin.limits(-1, 2), mass=1).build().position_limits[1].tolist()
    /// [2.0]
    #[pyo3(signature = (lower=f64::NEG_INFINITY, upper=f64::INFINITY, rate=f64::INFINITY, effort=f64::INFINITY))]
    fn limits(&self, lower: f64, upper: f64, rate: f64, effort: f64) -> Self {
        self.with(|h| h.limits(Limits { lower, upper, rate, effort }))
    }
    /// Number of coordinates (length of q).
    ///
    /// Examples
    /// --------
    /// >>> pin.nq
    /// 1
    #[getter]
    fn nq(&self) -> usize {
        self.hinge.nq()
    }
    /// Number of degrees of freedom.
    ///
    /// Examples
    /// --------
    /// >>> pin.nv
    /// 1
    #[getter]
    fn nv(&self) -> usize {
        self.hinge.nv()
    }
    fn __repr__(&self) -> String {
        let kinds: Vec<&str> = self.hinge.subhinges.iter().map(|s| kind_name(&s.kind)).collect();
        format!("Hinge({})", if kinds.is_empty() { "locked".into() } else { kinds.join(", ") })
    }
}

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

/// Returns the coordinates of a single hinge with all angles and displacements zero.
pub fn neutral(hinge: &multibody::Hinge) -> Vec<f64> {
    let one = |s: &multibody::Subhinge| {
        let mut q = vec![0.0; s.kind.nq()];
        if matches!(s.kind, SubhingeKind::Ball | SubhingeKind::Free)
            && let Some(w) = q.last_mut()
        {
            *w = 1.0;
        }
        q
    };
    hinge.subhinges.iter().flat_map(one).collect()
}

/// One subhinge of a hinge: the motion it permits, and its slices of q and v.
///
/// Examples
/// --------
/// >>> hinge = linkwork.Hinge.screw([0, 0, 1], 0.02).armature(0.1).gear(5).limits(-2, 2, rate=3, effort=40)
/// >>> subhinge = linkwork.Builder().body("nut", "world", hinge, mass=1, com=[0, 0, 0], inertia=np.eye(3)).build().subhinges[0]
/// >>> subhinge
/// Subhinge(screw of nut, q[0:1], v[0:1])
#[pyclass(frozen, weakref, module = "linkwork")]
pub struct Subhinge {
    body: String,
    parent: String,
    at: multibody::SubhingeRange,
}

impl Subhinge {
    /// Returns all subhinges of a mechanism, in order.
    pub fn table(mbs: &multibody::Multibody) -> Vec<Self> {
        let name = |b: Option<multibody::BodyId>| b.map_or("world", |b| mbs.get(b).name()).into();
        let row = |(b, s): (multibody::BodyId, &multibody::SubhingeRange)| Self {
            body: name(Some(b)),
            parent: name(mbs.get(b).parent()),
            at: s.clone(),
        };
        mbs.subhinges().map(row).collect()
    }
}

/// Returns the name of the kind.
pub fn kind_name(kind: &SubhingeKind) -> &'static str {
    match kind {
        SubhingeKind::Pin { .. } => "pin",
        SubhingeKind::Slider { .. } => "slider",
        SubhingeKind::Screw { .. } => "screw",
        SubhingeKind::Ball => "ball",
        SubhingeKind::Free => "free",
        SubhingeKind::Locked => "locked",
    }
}

#[pymethods]
impl Subhinge {
    /// The body whose hinge contains the subhinge.
    ///
    /// Examples
    /// --------
    /// >>> subhinge.body
    /// 'nut'
    #[getter]
    fn body(&self) -> &str {
        &self.body
    }
    /// The parent of that body: "world" or the name of a body.
    ///
    /// Examples
    /// --------
    /// >>> subhinge.parent
    /// 'world'
    #[getter]
    fn parent(&self) -> &str {
        &self.parent
    }
    /// "pin", "slider", "screw", "ball", "free" or "locked".
    ///
    /// Examples
    /// --------
    /// >>> subhinge.kind
    /// 'screw'
    #[getter]
    fn kind(&self) -> &'static str {
        kind_name(&self.at.subhinge.kind)
    }
    /// Unit vector (3,) of the axis in the hinge frame; None for subhinges without an axis. q is the displacement along it, m, or the angle about it,
    /// rad.
    ///
    /// Examples
    /// --------
    /// >>> subhinge.axis.tolist()
    /// [0.0, 0.0, 1.0]
    #[getter]
    fn axis<'py>(&self, py: Python<'py>) -> PyResult<Option<crate::array::Array1<'py>>> {
        self.at.subhinge.kind.axis().map(|a| out_vec3(py, &a)).transpose()
    }
    /// Advance of a screw, m/rad; 0 for all other kinds.
    ///
    /// Examples
    /// --------
    /// >>> subhinge.pitch
    /// 0.02
    #[getter]
    fn pitch(&self) -> f64 {
        match self.at.subhinge.kind {
            SubhingeKind::Screw { pitch, .. } => pitch,
            _ => 0.0,
        }
    }
    /// Slice of q.
    ///
    /// Examples
    /// --------
    /// >>> subhinge.q
    /// slice(0, 1, 1)
    #[getter]
    fn q<'py>(&self, py: Python<'py>) -> Bound<'py, PySlice> {
        PySlice::new(py, self.at.q.start as isize, self.at.q.end as isize, 1)
    }
    /// Slice of v, of forces and of accelerations.
    ///
    /// Examples
    /// --------
    /// >>> subhinge.v
    /// slice(0, 1, 1)
    #[getter]
    fn v<'py>(&self, py: Python<'py>) -> Bound<'py, PySlice> {
        PySlice::new(py, self.at.v.start as isize, self.at.v.end as isize, 1)
    }
    /// True if the motion is prescribed, so that the force is computed.
    ///
    /// Examples
    /// --------
    /// >>> subhinge.prescribed
    /// False
    #[getter]
    fn prescribed(&self) -> bool {
        self.at.subhinge.coordinate == Coordinate::Prescribed
    }
    /// Inertia of the rotor, before the gear, kg m² or kg.
    ///
    /// Examples
    /// --------
    /// >>> subhinge.armature
    /// 0.1
    #[getter]
    fn armature(&self) -> f64 {
        self.at.subhinge.armature
    }
    /// Gear ratio: revolutions of the rotor per revolution of the hinge.
    ///
    /// Examples
    /// --------
    /// >>> subhinge.gear
    /// 5.0
    #[getter]
    fn gear(&self) -> f64 {
        self.at.subhinge.gear
    }
    /// Lower limit of the coordinate, rad or m.
    ///
    /// Examples
    /// --------
    /// >>> subhinge.lower
    /// -2.0
    #[getter]
    fn lower(&self) -> f64 {
        self.at.subhinge.limits.lower
    }
    /// Upper limit of the coordinate, rad or m.
    ///
    /// Examples
    /// --------
    /// >>> subhinge.upper
    /// 2.0
    #[getter]
    fn upper(&self) -> f64 {
        self.at.subhinge.limits.upper
    }
    /// Limit of the velocity, rad/s or m/s.
    ///
    /// Examples
    /// --------
    /// >>> subhinge.rate
    /// 3.0
    #[getter]
    fn rate(&self) -> f64 {
        self.at.subhinge.limits.rate
    }
    /// Limit of the force, N m or N.
    ///
    /// Examples
    /// --------
    /// >>> subhinge.effort
    /// 40.0
    #[getter]
    fn effort(&self) -> f64 {
        self.at.subhinge.limits.effort
    }
    fn __repr__(&self) -> String {
        let (q, v) = (&self.at.q, &self.at.v);
        format!(
            "Subhinge({} of {}, q[{}:{}], v[{}:{}])",
            self.kind(),
            self.body,
            q.start,
            q.end,
            v.start,
            v.end
        )
    }
}
