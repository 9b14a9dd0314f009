//! `Builder` and `Hinge`: a mechanism described in Python; and `Subhinge`, a row of what was built.
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

/// What a body may do against its parent: a chain of subhinges, parent's side first.
///
/// Axes (3,) are in the hinge frame and need not be of unit length.
///
/// >>> import numpy as np, linkwork
/// >>> pin = linkwork.Hinge.pin([0, 1, 0])
#[pyclass(frozen, weakref, module = "linkwork")]
pub struct Hinge {
    /// As in Rust.
    pub hinge: multibody::Hinge,
}

impl Hinge {
    fn with(&self, f: impl FnOnce(multibody::Hinge) -> multibody::Hinge) -> Self {
        Self { hinge: f(self.hinge.clone()) }
    }
}

#[pymethods]
impl Hinge {
    /// Rotation about an axis: q in rad. axis: (3,).
    /// Raises LinkworkError for another shape and NaN; `build` refuses an axis without direction.
    ///
    /// >>> linkwork.Hinge.pin([0, 0, 1])
    /// Hinge(pin)
    #[staticmethod]
    fn pin(axis: &Bound<'_, PyAny>) -> PyResult<Self> {
        Ok(Self { hinge: multibody::Hinge::pin(vec3(axis, "axis")?) })
    }
    /// Translation along an axis: q in m. axis: (3,).
    /// Raises LinkworkError for another shape and NaN; `build` refuses an axis without direction.
    ///
    /// >>> linkwork.Hinge.slider([1, 0, 0])
    /// Hinge(slider)
    #[staticmethod]
    fn slider(axis: &Bound<'_, PyAny>) -> PyResult<Self> {
        Ok(Self { hinge: multibody::Hinge::slider(vec3(axis, "axis")?) })
    }
    /// Rotation about an axis with `pitch` m/rad of advance along it: q in rad. axis: (3,).
    /// Raises LinkworkError for another shape and NaN; `build` refuses an axis without direction.
    ///
    /// >>> linkwork.Hinge.screw([1, 0, 0], 0.002)
    /// Hinge(screw)
    #[staticmethod]
    fn screw(axis: &Bound<'_, PyAny>, pitch: f64) -> PyResult<Self> {
        Ok(Self { hinge: multibody::Hinge::screw(vec3(axis, "axis")?, pitch) })
    }
    /// Any rotation: q is a quaternion [x y z w], v the angular velocity in child axes, rad/s.
    ///
    /// >>> linkwork.Hinge.ball().nq, linkwork.Hinge.ball().nv
    /// (4, 3)
    #[staticmethod]
    fn ball() -> Self {
        Self { hinge: multibody::Hinge::ball() }
    }
    /// Any motion: q is [x y z qx qy qz qw], v is [ω; v] in child axes.
    ///
    /// >>> linkwork.Hinge.free().nq, linkwork.Hinge.free().nv
    /// (7, 6)
    #[staticmethod]
    fn free() -> Self {
        Self { hinge: multibody::Hinge::free() }
    }
    /// No motion.
    ///
    /// >>> linkwork.Hinge.locked().nv
    /// 0
    #[staticmethod]
    fn locked() -> Self {
        Self { hinge: multibody::Hinge::locked() }
    }
    /// Two crossing pins. Axes: (3,) each; q in rad.
    /// Raises LinkworkError for another shape and NaN; `build` refuses an axis without direction.
    ///
    /// >>> linkwork.Hinge.universal([1, 0, 0], [0, 1, 0])
    /// Hinge(pin, pin)
    #[staticmethod]
    fn universal(first: &Bound<'_, PyAny>, second: &Bound<'_, PyAny>) -> PyResult<Self> {
        let (first, second) = (vec3(first, "first")?, vec3(second, "second")?);
        Ok(Self { hinge: multibody::Hinge::universal(first, second) })
    }
    /// A slider and a pin on one axis. axis: (3,); q in m, then rad.
    /// Raises LinkworkError for another shape and NaN; `build` refuses an axis without direction.
    ///
    /// >>> linkwork.Hinge.cylindrical([0, 0, 1])
    /// Hinge(slider, pin)
    #[staticmethod]
    fn cylindrical(axis: &Bound<'_, PyAny>) -> PyResult<Self> {
        Ok(Self { hinge: multibody::Hinge::cylindrical(vec3(axis, "axis")?) })
    }
    /// Three pins about the moving x, y and z axes.
    ///
    /// >>> linkwork.Hinge.gimbal()
    /// Hinge(pin, pin, pin)
    #[staticmethod]
    fn gimbal() -> Self {
        Self { hinge: multibody::Hinge::gimbal() }
    }
    /// Slides along x and y, then turns about z.
    ///
    /// >>> linkwork.Hinge.planar()
    /// Hinge(slider, slider, pin)
    #[staticmethod]
    fn planar() -> Self {
        Self { hinge: multibody::Hinge::planar() }
    }
    /// Several hinges one after another, parent's side first.
    ///
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
    /// The same with its motion given and its force found.
    ///
    /// >>> linkwork.Builder().body("b", "world", pin.prescribed(), mass=1).build().prescribed
    /// [True]
    fn prescribed(&self) -> Self {
        self.with(multibody::Hinge::prescribed)
    }
    /// The same with a rotor of this inertia on each subhinge, kg m² (sliders: kg), at the rotor.
    ///
    /// >>> linkwork.Builder().body("b", "world", pin.armature(0.2), mass=0).build().mass_matrix([0]).tolist()
    /// [[0.2]]
    fn armature(&self, armature: f64) -> Self {
        self.with(|h| h.armature(armature))
    }
    /// The same with this gear ratio: turns of the rotor for a turn of the hinge.
    ///
    /// >>> linkwork.Builder().body("b", "world", pin.armature(0.2).gear(10), mass=0).build().mass_matrix([0]).tolist()
    /// [[20.0]]
    fn gear(&self, gear: f64) -> Self {
        self.with(|h| h.gear(gear))
    }
    /// The same with limits: coordinate (rad or m), its speed, its force. Dynamics does not
    /// enforce them.
    ///
    /// >>> linkwork.Builder().body("b", "world", pin.limits(-1, 2), mass=1).build().position_limits[1].tolist()
    /// [2.0]
    #[pyo3(signature = (lower=f64::NEG_INFINITY, upper=f64::INFINITY, rate=f64::INFINITY, effort=f64::INFINITY))]
    fn limits(&self, lower: f64, upper: f64, rate: f64, effort: f64) -> Self {
        self.with(|h| h.limits(Limits { lower, upper, rate, effort }))
    }
    /// Numbers of q.
    ///
    /// >>> pin.nq
    /// 1
    #[getter]
    fn nq(&self) -> usize {
        self.hinge.nq()
    }
    /// Degrees of freedom.
    ///
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

/// Collects bodies and nodes in any order; `build()` makes the mechanism.
///
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

    /// Adds a body; its parent may come later.
    ///
    /// parent: "world" or a body. hinge: what moves (None: welded). mass: kg. com (3,): centre of
    /// mass in body axes, m. inertia (3, 3): about the centre of mass, body axes, kg m², with
    /// −∫xy dm off the diagonal. inertia_check: "physical", or "positive_moments" for published
    /// data that break the triangle inequality of principal moments. hinge_in_parent, hinge_in_body: poses of the hinge frame:
    /// (3,) position, (7,) position and quaternion [x y z w], or (4, 4). modes: `Modes` of a flexible body, whose mass comes on top
    /// of `mass`.
    /// Raises LinkworkError for shapes, numbers and inertias that cannot be.
    ///
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

    /// Adds a node: a named frame on a body, at a pose in the body's frame: (3,), (7,) or (4, 4), places in m.
    /// Raises LinkworkError for a pose of another shape.
    ///
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

    /// Closes a loop: frame B on one body moves against frame A on another as the hinge permits; places in m.
    ///
    /// body_a, body_b: "world" or a body; bodies may come later. at_a, at_b: poses of the frames in their bodies:
    /// (3,), (7,) or (4, 4). Prescribed pins and sliders of the hinge move as `loop_motions` says.
    /// Raises LinkworkError for a pose of another shape.
    ///
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

    /// Adds a linear relation between hinge coordinates: the sum of factor times coordinate (rad or m) is `constant`.
    ///
    /// terms: {body: factor}, for the only subhinge of the body's hinge, or {(body, subhinge): factor}, counted
    /// from the parent's side.
    /// Raises LinkworkError for terms of another kind.
    ///
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
        crate::core::lock(&slf.get().parts).coupling(Coupling { name, terms, constant });
        Ok(slf)
    }

    /// The mechanism, bodies in canonical order: depth first, siblings by name.
    ///
    /// Raises LinkworkError with every fault of every part.
    ///
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

type Given<'a, 'py> = Option<&'a Bound<'py, PyAny>>;

/// A body as it was described: (mass, centre of mass, inertia, which check), frames of the hinge on
/// parent and body.
pub fn body_spec(
    name: String,
    parent: &str,
    hinge: Option<&Hinge>,
    (mass, com, inertia, inertia_check): (f64, Given<'_, '_>, Given<'_, '_>, &str),
    (hinge_in_parent, hinge_in_body): (Given<'_, '_>, Given<'_, '_>),
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

/// Coordinates of a hinge alone with all angles and displacements zero.
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

/// A link of a hinge's chain: what it allows, and its places in q and v.
///
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
    /// All subhinges that a mechanism has, in order.
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

/// The kind in words.
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
    /// The body whose hinge it belongs to.
    ///
    /// >>> subhinge.body
    /// 'nut'
    #[getter]
    fn body(&self) -> &str {
        &self.body
    }
    /// What that body hangs on: "world" or a body.
    ///
    /// >>> subhinge.parent
    /// 'world'
    #[getter]
    fn parent(&self) -> &str {
        &self.parent
    }
    /// "pin", "slider", "screw", "ball", "free" or "locked".
    ///
    /// >>> subhinge.kind
    /// 'screw'
    #[getter]
    fn kind(&self) -> &'static str {
        kind_name(&self.at.subhinge.kind)
    }
    /// Unit vector (3,) in the hinge frame; None where there is none. q goes along it in m or about it in rad.
    ///
    /// >>> subhinge.axis.tolist()
    /// [0.0, 0.0, 1.0]
    #[getter]
    fn axis<'py>(&self, py: Python<'py>) -> PyResult<Option<crate::array::Array1<'py>>> {
        self.at.subhinge.kind.axis().map(|a| out_vec3(py, &a)).transpose()
    }
    /// Advance of a screw, m/rad; 0 for the others.
    ///
    /// >>> subhinge.pitch
    /// 0.02
    #[getter]
    fn pitch(&self) -> f64 {
        match self.at.subhinge.kind {
            SubhingeKind::Screw { pitch, .. } => pitch,
            _ => 0.0,
        }
    }
    /// Its numbers in q.
    ///
    /// >>> subhinge.q
    /// slice(0, 1, 1)
    #[getter]
    fn q<'py>(&self, py: Python<'py>) -> Bound<'py, PySlice> {
        PySlice::new(py, self.at.q.start as isize, self.at.q.end as isize, 1)
    }
    /// Its numbers in v, forces and accelerations.
    ///
    /// >>> subhinge.v
    /// slice(0, 1, 1)
    #[getter]
    fn v<'py>(&self, py: Python<'py>) -> Bound<'py, PySlice> {
        PySlice::new(py, self.at.v.start as isize, self.at.v.end as isize, 1)
    }
    /// True where the motion is given and the force found.
    ///
    /// >>> subhinge.prescribed
    /// False
    #[getter]
    fn prescribed(&self) -> bool {
        self.at.subhinge.coordinate == Coordinate::Prescribed
    }
    /// Rotor inertia at the rotor, kg m² or kg.
    ///
    /// >>> subhinge.armature
    /// 0.1
    #[getter]
    fn armature(&self) -> f64 {
        self.at.subhinge.armature
    }
    /// Turns of the rotor for a turn of the hinge.
    ///
    /// >>> subhinge.gear
    /// 5.0
    #[getter]
    fn gear(&self) -> f64 {
        self.at.subhinge.gear
    }
    /// Least coordinate, rad or m.
    ///
    /// >>> subhinge.lower
    /// -2.0
    #[getter]
    fn lower(&self) -> f64 {
        self.at.subhinge.limits.lower
    }
    /// Greatest coordinate, rad or m.
    ///
    /// >>> subhinge.upper
    /// 2.0
    #[getter]
    fn upper(&self) -> f64 {
        self.at.subhinge.limits.upper
    }
    /// Greatest speed, rad/s or m/s.
    ///
    /// >>> subhinge.rate
    /// 3.0
    #[getter]
    fn rate(&self) -> f64 {
        self.at.subhinge.limits.rate
    }
    /// Greatest force, N m or N.
    ///
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
