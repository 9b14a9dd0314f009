//! `Mechanism`: structure and coordinates. Its algorithms are in `dynamics.rs`.
use crate::array::{Array1, Input, checked1, out_vec3, out1, vec3, vector};
use crate::core::{Core, GRAVITY};
use crate::error::{refuse, refuse_with};
use crate::files::Couplings;
use crate::hinge::Subhinge;
use crate::show;
use crate::state::State;
use crate::subgraph::Subgraph;
use linkwork_formats::{ReadOptions, Root, Unphysical};
use linkwork_multibody::{BodyId, Coordinate, Limits};
use linkwork_runtime::remedy;
use linkwork_spatial::InertiaCheck;
use pyo3::prelude::*;
use pyo3::types::PySlice;
use std::ops::Range;
use std::path::PathBuf;
use std::sync::Arc;

type Slice<'py> = Bound<'py, PySlice>;

/// Multibody system: bodies connected by hinges, with named frames (nodes).
///
/// The structure of a mechanism never changes; `edit` creates a changed copy.
///
/// Notes
/// -----
/// Shapes: q is (nq,); v, vdot and tau are (nv,), all float64. Units are SI and radians. Functions that accept many states take q of shape (n,
/// nq) and v of shape (n, nv) and return one row per state.
///
/// Vectors are in world axes unless stated otherwise. Spatial vectors have the angular part first. Quaternions are [x y z w].
///
/// Examples
/// --------
/// >>> import numpy as np, linkwork
/// >>> pin, parts = linkwork.Hinge.pin([0, 1, 0]), linkwork.Builder()
/// >>> parts = parts.body("upper", "world", pin.limits(-2, 2, rate=3, effort=40), mass=2, com=[0, 0, -0.5], inertia=np.diag([0.2, 0.2, 0.01]))
/// >>> parts = parts.body("lower", "upper", pin, mass=1, com=[0, 0, -0.4], inertia=np.diag([0.1, 0.1, 0.01]), hinge_in_parent=[0, 0, -1])
/// >>> arm = parts.node("tip", "lower", [0, 0, -0.8]).build()
/// >>> q, v = np.array([0.3, -0.7]), np.array([0.1, 0.4])
/// >>> "lower" in str(arm)                             # print(arm) shows the tree
/// True
/// >>> import copy, pickle
/// >>> twins = [copy.copy(arm), copy.deepcopy(arm), pickle.loads(pickle.dumps(arm))]
/// >>> [twin.nv for twin in twins]
/// [2, 2, 2]
#[pyclass(frozen, weakref, module = "linkwork")]
pub struct Mechanism {
    /// Data that it shares with its states.
    pub core: Arc<Core>,
}

/// Read a mechanism from a file: URDF, MJCF, SDF, or a simulation or assembly in RON.
///
/// For a URDF, MJCF or SDF file, the companion file `robot.linkwork.ron` in the same folder is read, too.
///
/// Parameters
/// ----------
/// path : str or path-like
///     The file.
/// root : {"fixed", "free", "planar"}, optional
///     How the body that no joint moves is connected to the world. By default the file decides.
/// inertia_check : {"warn", "physical", "positive_moments"}
///     What to do with principal moments of inertia that no rigid body can have. "warn" reads them (negative ones as 0) and emits a
///     UserWarning that names the link and the value. "physical" rejects them. "positive_moments" accepts moments that break the triangle
///     inequality without a warning; use it for published data.
/// packages : sequence of str or path-like, optional
///     Folders that contain ROS packages, for `package://name/..`.
/// couplings : bool
///     False ignores the mimic joints and couplings of a URDF, MJCF or SDF file (default: True).
/// keyframe : str, optional
///     The keyframe of an MJCF file that becomes `initial_q`.
///
/// Returns
/// -------
/// Mechanism
///     The mechanism. `ignored` lists the elements of the file that were not used.
///
/// Raises
/// ------
/// LinkworkError
///     If the file has mistakes. The message lists all of them, each with its position in the file.
///
/// Notes
/// -----
/// Loops and couplings of the file are in `constraints`. `constrained_dynamics`, `close` and `simulate` satisfy them; the tree algorithms ignore
/// them.
///
/// The dynamics of a Mechanism do not include damping, springs and friction. If the file has any, a UserWarning names them.
///
/// Examples
/// --------
/// >>> import pathlib
/// >>> _ = pathlib.Path("mug.urdf").write_text('<robot name="mug"><link name="cup"><inertial><mass value="0.3"/><inertia ixx="1e-3" iyy="1e-3" izz="1e-3" ixy="0" ixz="0" iyz="0"/></inertial></link></robot>')
/// >>> mug = linkwork.load("mug.urdf", "free")
/// >>> mug.nq, mug.nv, mug.total_mass
/// (7, 6, 0.3)
#[pyfunction]
#[pyo3(signature = (path, root=None, *, inertia_check="warn", packages=None, couplings=true, keyframe=None))]
pub fn load(
    py: Python<'_>,
    path: PathBuf,
    root: Option<&str>,
    inertia_check: &str,
    packages: Option<Vec<PathBuf>>,
    couplings: bool,
    keyframe: Option<String>,
) -> PyResult<Mechanism> {
    let roots = [("fixed", Root::Fixed), ("free", Root::Free), ("planar", Root::Planar)];
    let root = root.map_or(Ok(Root::AsWritten), |name| choice("root", name, &roots))?;
    let (inertia, unphysical) = match inertia_check {
        "warn" => (InertiaCheck::Physical, Unphysical::Read),
        other => {
            let [physical, positive] = INERTIA_CHECKS;
            let known = [physical, positive, ("warn", InertiaCheck::Physical)];
            (choice("inertia_check", other, &known)?, Unphysical::Refused)
        }
    };
    let package_paths = packages.unwrap_or_default();
    let options = ReadOptions { root, inertia, unphysical, package_paths, keyframe, file: None };
    let couplings = if couplings { Couplings::Kept } else { Couplings::LeftOut };
    let machine = py.detach(|| crate::files::machine(&path, &options, couplings));
    let machine = machine.map_err(refuse)?;
    let of_path = |text: String| format!("{}: {text}", path.display());
    let left_out = machine.left_out().map(of_path);
    let beyond = machine.beyond_the_tree().map(of_path);
    let passive = machine.passive_devices().map(of_path);
    for text in machine.doubtful().into_iter().chain(left_out).chain(passive).chain(beyond) {
        let category = py.get_type::<pyo3::exceptions::PyUserWarning>();
        // The text may contain null bytes from a path, which are replaced.
        let text = std::ffi::CString::new(text.replace('\0', " ")).unwrap_or_default();
        PyErr::warn(py, &category, &text, 1)?;
    }
    let mut core = Core::new(machine.mbs, GRAVITY)?;
    core.initial = machine.initial;
    core.description = machine.description;
    core.contact = machine.contact;
    core.shapes = machine.shapes;
    Ok(Mechanism { core: Arc::new(core) })
}

/// The inertia checks, by name.
pub const INERTIA_CHECKS: [(&str, InertiaCheck); 2] =
    [("physical", InertiaCheck::Physical), ("positive_moments", InertiaCheck::PositiveMoments)];

impl Mechanism {
    fn bodies_of(&self, names: &[String]) -> PyResult<Vec<BodyId>> {
        names.iter().map(|n| self.core.body(n)).collect()
    }

    fn q<'py>(&self, q: &Bound<'py, PyAny>, what: &str) -> PyResult<Input<'py>> {
        self.core.configuration(q, what)
    }

    fn v<'py>(&self, v: &Bound<'py, PyAny>, what: &str) -> PyResult<Input<'py>> {
        vector(v, self.core.nv(), what)
    }

    /// Returns a limit for each degree of freedom; ∞ for subhinges with several degrees of freedom.
    fn by_dof(&self, of: impl Fn(&Limits) -> f64) -> Vec<f64> {
        let mut all = vec![f64::INFINITY; self.core.nv()];
        for (_, s) in self.core.mbs.subhinges().filter(|(_, s)| s.v.len() == 1) {
            all[s.v.start] = of(&s.subhinge.limits);
        }
        all
    }
}

#[pymethods]
impl Mechanism {
    /// Number of coordinates: the length of q.
    ///
    /// Examples
    /// --------
    /// >>> arm.nq
    /// 2
    #[getter]
    fn nq(&self) -> usize {
        self.core.nq()
    }
    /// Number of degrees of freedom: the length of v.
    ///
    /// Examples
    /// --------
    /// >>> arm.nv
    /// 2
    #[getter]
    fn nv(&self) -> usize {
        self.core.nv()
    }
    /// Names of the bodies in canonical order: depth first, siblings by name.
    ///
    /// Examples
    /// --------
    /// >>> arm.bodies
    /// ['upper', 'lower']
    #[getter]
    fn bodies(&self) -> Vec<&str> {
        self.core.mbs.bodies().iter().map(|b| b.name()).collect()
    }
    /// Names of the nodes, ordered by body, then by name.
    ///
    /// Examples
    /// --------
    /// >>> arm.nodes
    /// ['tip']
    #[getter]
    fn nodes(&self) -> Vec<&str> {
        self.core.mbs.nodes().iter().map(|n| n.name()).collect()
    }
    /// The subhinges in order, each with its kind, its limits and its slices of q and v.
    ///
    /// Examples
    /// --------
    /// >>> [(s.body, s.kind, s.v) for s in arm.subhinges]
    /// [('upper', 'pin', slice(0, 1, 1)), ('lower', 'pin', slice(1, 2, 1))]
    #[getter]
    fn subhinges(&self) -> Vec<Subhinge> {
        Subhinge::table(&self.core.mbs)
    }
    /// Total mass of all bodies, kg.
    ///
    /// Examples
    /// --------
    /// >>> arm.total_mass
    /// 3.0
    #[getter]
    fn total_mass(&self) -> f64 {
        self.core.mbs.total_mass()
    }
    /// Gravitational acceleration (3,), m/s², world axes (default: [0, 0, -9.81]).
    ///
    /// States that exist already keep the value with which they were made.
    ///
    /// Raises
    /// ------
    /// LinkworkError
    ///     If the new value has a wrong shape or contains NaN.
    ///
    /// Examples
    /// --------
    /// >>> arm.gravity = [0, 0, -1.62]
    /// >>> arm.gravity.tolist()
    /// [0.0, 0.0, -1.62]
    #[getter]
    fn gravity<'py>(&self, py: Python<'py>) -> PyResult<Array1<'py>> {
        out_vec3(py, &self.core.gravity())
    }
    #[setter]
    fn set_gravity(&self, value: &Bound<'_, PyAny>) -> PyResult<()> {
        self.core.set_gravity(vec3(value, "gravity")?);
        Ok(())
    }
    /// One flag for each degree of freedom (nv): True if its motion is prescribed.
    ///
    /// Examples
    /// --------
    /// >>> arm.with_prescribed(["upper"]).prescribed
    /// [True, False]
    #[getter]
    fn prescribed(&self) -> Vec<bool> {
        self.core.mbs.prescribed()
    }

    /// Return a copy in which the hinges of the given bodies are prescribed and all others are free.
    ///
    /// Parameters
    /// ----------
    /// bodies : sequence of str
    ///     Names of the bodies.
    ///
    /// Returns
    /// -------
    /// Mechanism
    ///     The copy.
    ///
    /// Raises
    /// ------
    /// LinkworkError
    ///     If the name does not exist.
    ///
    /// Examples
    /// --------
    /// >>> given = arm.with_prescribed(["upper"])
    /// >>> given.prescribed, arm.prescribed
    /// ([True, False], [False, False])
    fn with_prescribed(&self, bodies: Vec<String>) -> PyResult<Self> {
        let ids = self.bodies_of(&bodies)?;
        let mut mbs = self.core.mbs.clone();
        for b in self.core.mbs.body_ids() {
            let coordinate =
                if ids.contains(&b) { Coordinate::Prescribed } else { Coordinate::Free };
            mbs = mbs.with_coordinate(b, coordinate);
        }
        Ok(Self { core: Arc::new(Core::new(mbs, self.core.gravity())?) })
    }

    /// Return some of the bodies as a separate mechanism.
    ///
    /// The world of the new mechanism is the frame that carries these bodies. All of them must be connected, directly or through each other, to one
    /// common frame.
    ///
    /// Parameters
    /// ----------
    /// bodies : sequence of str
    ///     Names of the bodies.
    ///
    /// Returns
    /// -------
    /// Subgraph
    ///     The mechanism, and how its coordinates correspond to those of the original.
    ///
    /// Raises
    /// ------
    /// LinkworkError
    ///     If a name does not exist, or the bodies are connected to several frames.
    ///
    /// Examples
    /// --------
    /// >>> part = arm.subgraph(["lower"])
    /// >>> part.base, part.q
    /// ('upper', [1])
    fn subgraph(&self, bodies: Vec<String>) -> PyResult<Subgraph> {
        let part = self.core.mbs.subgraph(&self.bodies_of(&bodies)?).map_err(refuse)?;
        let base = part.base.map(|b| self.core.mbs.get(b).name().to_string());
        let core = Arc::new(Core::new(part.multibody, self.core.gravity())?);
        Ok(Subgraph { core, base, q: part.q, v: part.v })
    }

    /// Lower and upper limits of the coordinates, two arrays (nq,), rad or m.
    ///
    /// Coordinates without a limit, including quaternions, have -inf and inf.
    ///
    /// Examples
    /// --------
    /// >>> arm.position_limits[0].tolist()
    /// [-2.0, -inf]
    #[getter]
    fn position_limits<'py>(&self, py: Python<'py>) -> (Array1<'py>, Array1<'py>) {
        let mut all =
            (vec![f64::NEG_INFINITY; self.core.nq()], vec![f64::INFINITY; self.core.nq()]);
        for (_, s) in self.core.mbs.subhinges().filter(|(_, s)| s.q.len() == 1) {
            all.0[s.q.start] = s.subhinge.limits.lower;
            all.1[s.q.start] = s.subhinge.limits.upper;
        }
        (out1(py, all.0), out1(py, all.1))
    }
    /// Velocity limits (nv,), rad/s or m/s; inf means no limit.
    ///
    /// Examples
    /// --------
    /// >>> arm.rate_limits.tolist()
    /// [3.0, inf]
    #[getter]
    fn rate_limits<'py>(&self, py: Python<'py>) -> Array1<'py> {
        out1(py, self.by_dof(|limits| limits.rate))
    }
    /// Limits of the hinge forces (nv,), N m or N; inf means no limit.
    ///
    /// Examples
    /// --------
    /// >>> arm.effort_limits.tolist()
    /// [40.0, inf]
    #[getter]
    fn effort_limits<'py>(&self, py: Python<'py>) -> Array1<'py> {
        out1(py, self.by_dof(|limits| limits.effort))
    }

    /// Return the slices of q and v that belong to a joint.
    ///
    /// `q[arm.coordinates("elbow")[0]]` is the angle of the elbow.
    ///
    /// Parameters
    /// ----------
    /// name : str
    ///     Name of a joint of the file. If there is no such joint: name of a body, which stands for the hinge that carries it.
    ///
    /// Returns
    /// -------
    /// tuple of slice
    ///     The slice of q and the slice of v.
    ///
    /// Raises
    /// ------
    /// LinkworkError
    ///     If the name does not exist.
    ///
    /// Examples
    /// --------
    /// >>> arm.coordinates("lower")
    /// (slice(1, 2, 1), slice(1, 2, 1))
    fn coordinates<'py>(&self, py: Python<'py>, name: &str) -> PyResult<(Slice<'py>, Slice<'py>)> {
        let joints = self.core.description.iter().flat_map(|d| &d.joints);
        let places = match joints.clone().find(|j| j.name == name) {
            Some(joint) => {
                let body = self.core.mbs.get(self.core.body(&joint.body)?);
                let own = body.subhinges().iter().skip(joint.subhinge).take(joint.count);
                let none = (body.q().start..body.q().start, body.v().start..body.v().start);
                let span = |a: Range<usize>, b: &Range<usize>| a.start..b.end;
                own.map(|s| (s.q.clone(), s.v.clone()))
                    .reduce(|a, b| (span(a.0, &b.0), span(a.1, &b.1)))
                    .unwrap_or(none)
            }
            None => {
                let id = self.core.body(name).map_err(|e| {
                    let names: Vec<&str> = joints.map(|j| j.name.as_str()).collect();
                    match names.is_empty() {
                        true => e,
                        false => refuse_with(
                            format!("no joint and no body `{name}`"),
                            remedy(name, "joints", &names),
                        ),
                    }
                })?;
                (self.core.mbs.get(id).q(), self.core.mbs.get(id).v())
            }
        };
        let slice = |r: Range<usize>| PySlice::new(py, r.start as isize, r.end as isize, 1);
        Ok((slice(places.0), slice(places.1)))
    }

    /// Return the parent of a body.
    ///
    /// Parameters
    /// ----------
    /// body : str
    ///     Name of a body.
    ///
    /// Returns
    /// -------
    /// str
    ///     "world" or the name of a body.
    ///
    /// Raises
    /// ------
    /// LinkworkError
    ///     If the name does not exist.
    ///
    /// Examples
    /// --------
    /// >>> arm.parent("lower")
    /// 'upper'
    fn parent(&self, body: &str) -> PyResult<&str> {
        let parent = self.core.mbs.get(self.core.body(body)?).parent();
        Ok(parent.map_or("world", |p| self.core.mbs.get(p).name()))
    }

    /// Return the slice of v that belongs to the hinge of a body.
    ///
    /// Parameters
    /// ----------
    /// body : str
    ///     Name of a body.
    ///
    /// Returns
    /// -------
    /// slice
    ///     The degrees of freedom of the hinge that carries the body.
    ///
    /// Raises
    /// ------
    /// LinkworkError
    ///     If the name does not exist.
    ///
    /// Examples
    /// --------
    /// >>> arm.hinge("lower")
    /// slice(1, 2, 1)
    fn hinge<'py>(&self, py: Python<'py>, body: &str) -> PyResult<Slice<'py>> {
        let v = self.core.mbs.get(self.core.body(body)?).v();
        Ok(PySlice::new(py, v.start as isize, v.end as isize, 1))
    }

    /// Return the slices of q and v that belong to the modal coordinates η of a body and their rates.
    ///
    /// Parameters
    /// ----------
    /// body : str
    ///     Name of a body.
    ///
    /// Returns
    /// -------
    /// tuple of slice
    ///     The slice of q and the slice of v. Both are empty for a rigid body.
    ///
    /// Raises
    /// ------
    /// LinkworkError
    ///     If the name does not exist.
    ///
    /// Examples
    /// --------
    /// >>> arm.modes("lower")
    /// (slice(2, 2, 1), slice(2, 2, 1))
    fn modes<'py>(&self, py: Python<'py>, body: &str) -> PyResult<(Slice<'py>, Slice<'py>)> {
        let body = self.core.mbs.get(self.core.body(body)?);
        let slice = |r: Range<usize>| PySlice::new(py, r.start as isize, r.end as isize, 1);
        Ok((slice(body.modes_q()), slice(body.modes_v())))
    }

    /// Return the configuration in which all angles and displacements are zero.
    ///
    /// Returns
    /// -------
    /// ndarray, shape (nq,)
    ///     Angles in rad, displacements in m; quaternions are the identity.
    ///
    /// Examples
    /// --------
    /// >>> arm.neutral_q().tolist()
    /// [0.0, 0.0]
    fn neutral_q<'py>(&self, py: Python<'py>) -> Array1<'py> {
        out1(py, self.core.mbs.neutral_q())
    }
    /// Return a random configuration within the limits. Equal seeds give equal configurations.
    ///
    /// Coordinates with two limits are uniform between them. Coordinates with one limit are up to 1 rad or 1 m away from it. Coordinates without
    /// limits are in ±(0.1 … 1). Attitudes are arbitrary.
    ///
    /// Parameters
    /// ----------
    /// seed : int
    ///     Seed (default: 0).
    ///
    /// Returns
    /// -------
    /// ndarray, shape (nq,)
    ///     Angles in rad, displacements in m.
    ///
    /// Examples
    /// --------
    /// >>> low, high = arm.position_limits
    /// >>> x = arm.random_q(seed=3)
    /// >>> bool((low <= x).all() and (x <= high).all())
    /// True
    #[pyo3(signature = (seed=0))]
    fn random_q<'py>(
        &self,
        py: Python<'py>,
        #[pyo3(from_py_with = crate::values::seed)] seed: u64,
    ) -> Array1<'py> {
        out1(py, self.core.mbs.random_q_within_limits(seed))
    }
    /// Return random rates or forces without zeros. Equal seeds give equal numbers.
    ///
    /// Parameters
    /// ----------
    /// seed : int
    ///     Seed (default: 0).
    ///
    /// Returns
    /// -------
    /// ndarray, shape (nv,)
    ///     Numbers in ±(0.1 … 1), in SI units of the quantity that you use them for.
    ///
    /// Examples
    /// --------
    /// >>> bool((arm.random_v(3) == arm.random_v(3)).all())
    /// True
    #[pyo3(signature = (seed=0))]
    fn random_v<'py>(
        &self,
        py: Python<'py>,
        #[pyo3(from_py_with = crate::values::seed)] seed: u64,
    ) -> Array1<'py> {
        out1(py, self.core.mbs.random_v(seed))
    }
    /// Move a configuration by a displacement along v.
    ///
    /// Parameters
    /// ----------
    /// q : array_like, shape (nq,)
    ///     Configuration, rad and m.
    /// dv : array_like, shape (nv,)
    ///     Displacement, rad and m: rates times a duration.
    ///
    /// Returns
    /// -------
    /// ndarray, shape (nq,)
    ///     The new configuration. It is exact for constant rates.
    ///
    /// Raises
    /// ------
    /// LinkworkError
    ///     If an array has a wrong shape or contains NaN.
    ///
    /// Examples
    /// --------
    /// >>> arm.integrate(q, [0.1, 0.2]).round(12).tolist()
    /// [0.4, -0.5]
    fn integrate<'py>(
        &self,
        q: &Bound<'py, PyAny>,
        dv: &Bound<'py, PyAny>,
    ) -> PyResult<Array1<'py>> {
        let (py, q, dv) = (q.py(), self.q(q, "q")?, self.v(dv, "dv")?);
        let mut out = vec![0.0; self.core.nq()];
        self.core.mbs.integrate(q.slice(), dv.slice(), &mut out);
        checked1(py, out)
    }
    /// Return the displacement that takes one configuration to another.
    ///
    /// Inverse of `integrate`. Rotations take the shorter direction.
    ///
    /// Parameters
    /// ----------
    /// q_from, q_to : array_like, shape (nq,)
    ///     Configurations, rad and m.
    ///
    /// Returns
    /// -------
    /// ndarray, shape (nv,)
    ///     Displacement, rad and m.
    ///
    /// Raises
    /// ------
    /// LinkworkError
    ///     If an array has a wrong shape or contains NaN.
    ///
    /// Examples
    /// --------
    /// >>> arm.difference(q, [0.4, -0.5]).round(12).tolist()
    /// [0.1, 0.2]
    fn difference<'py>(
        &self,
        q_from: &Bound<'py, PyAny>,
        q_to: &Bound<'py, PyAny>,
    ) -> PyResult<Array1<'py>> {
        let (py, from, to) = (q_from.py(), self.q(q_from, "q_from")?, self.q(q_to, "q_to")?);
        let mut out = vec![0.0; self.core.nv()];
        self.core.mbs.difference(from.slice(), to.slice(), &mut out);
        checked1(py, out)
    }
    /// Return a copy of a configuration with unit quaternions. A zero quaternion becomes the identity.
    ///
    /// Parameters
    /// ----------
    /// q : array_like, shape (nq,)
    ///     Configuration, rad and m.
    ///
    /// Returns
    /// -------
    /// ndarray, shape (nq,)
    ///     The normalized configuration.
    ///
    /// Raises
    /// ------
    /// LinkworkError
    ///     If an array has a wrong shape or contains NaN.
    ///
    /// Examples
    /// --------
    /// >>> arm.normalize(q).tolist()
    /// [0.3, -0.7]
    fn normalize<'py>(&self, q: &Bound<'py, PyAny>) -> PyResult<Array1<'py>> {
        let (py, q) = (q.py(), self.q(q, "q")?);
        let mut out = q.slice().to_vec();
        self.core.mbs.normalize(&mut out);
        checked1(py, out)
    }
    /// Return the time derivative of q at given rates.
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
    /// ndarray, shape (nq,)
    ///     dq/dt.
    ///
    /// Raises
    /// ------
    /// LinkworkError
    ///     If an array has a wrong shape or contains NaN.
    ///
    /// Examples
    /// --------
    /// >>> arm.qdot(q, v).tolist()
    /// [0.1, 0.4]
    fn qdot<'py>(&self, q: &Bound<'py, PyAny>, v: &Bound<'py, PyAny>) -> PyResult<Array1<'py>> {
        let (py, q, v) = (q.py(), self.q(q, "q")?, self.v(v, "v")?);
        let mut out = vec![0.0; self.core.nq()];
        self.core.mbs.qdot(q.slice(), v.slice(), &mut out);
        checked1(py, out)
    }

    /// Compute the kinematics at q and v, and return a State from which results are read.
    ///
    /// Parameters
    /// ----------
    /// q : array_like, shape (nq,)
    ///     Configuration, rad and m.
    /// v : array_like, shape (nv,), optional
    ///     Rates, rad/s and m/s (default: zeros).
    ///
    /// Returns
    /// -------
    /// State
    ///     The state.
    ///
    /// Raises
    /// ------
    /// LinkworkError
    ///     If an array has a wrong shape or contains NaN.
    ///
    /// Examples
    /// --------
    /// >>> arm.state(q, v).position("tip").round(6).tolist()
    /// [0.016014, 0.0, -1.692185]
    #[pyo3(signature = (q, v=None))]
    fn state(&self, q: &Bound<'_, PyAny>, v: Option<&Bound<'_, PyAny>>) -> PyResult<State> {
        let q = self.q(q, "q")?.slice().to_vec();
        let v = match v {
            Some(v) => self.v(v, "v")?.slice().to_vec(),
            None => vec![0.0; self.core.nv()],
        };
        Ok(State::new(self.core.clone(), q, v))
    }

    fn __repr__(&self) -> String {
        let m = &self.core.mbs;
        format!("Mechanism({} bodies, nq={}, nv={})", m.bodies().len(), m.nq(), m.nv())
    }
    fn __str__(&self) -> String {
        show::tree(&self.core.mbs)
    }
    /// Show the bodies in the Rerun viewer.
    ///
    /// The bodies have the shapes of the file. If no body has a shape, each is drawn as the box that has its mass and inertia. Needs the package
    /// rerun-sdk (`pip install linkwork[rerun]`).
    ///
    /// Parameters
    /// ----------
    /// q : array_like, shape (nq,) or (n, nq), optional
    ///     Configuration, rad and m, or several, which are shown in turn on the timeline "row" (default: `initial_q`).
    /// path : str or path-like, optional
    ///     Write a recording (.rrd) to this file instead of opening the viewer.
    ///
    /// Raises
    /// ------
    /// LinkworkError
    ///     If q is not a valid configuration, or rerun-sdk is not installed.
    ///
    /// Examples
    /// --------
    /// >>> arm.show(np.linspace([0, 0], [0.5, -1.0], 20), path="arm.rrd")
    #[pyo3(signature = (q=None, *, path=None))]
    fn show(
        slf: &Bound<'_, Self>,
        q: Option<&Bound<'_, PyAny>>,
        path: Option<PathBuf>,
    ) -> PyResult<()> {
        let drawing = crate::scene::drawing(slf.py())?;
        drawing.call_method1("mechanism", (slf, q, path)).map(|_| ())
    }
    /// Return the shapes that `show` draws.
    fn _shapes<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, pyo3::types::PyList>> {
        crate::scene::list(py, &crate::scene::of(&self.core))
    }
    fn _repr_html_(&self) -> String {
        show::mechanism(&self.core.mbs, self.core.description.as_ref())
    }
}

/// Returns the value of `name` in `known`, or an error that lists the names.
pub fn choice<T: Copy>(what: &str, name: &str, known: &[(&str, T)]) -> PyResult<T> {
    known.iter().find(|(n, _)| *n == name).map(|(_, x)| *x).ok_or_else(|| {
        let names: Vec<&str> = known.iter().map(|k| k.0).collect();
        refuse_with(format!("`{what}` is \"{name}\""), remedy(name, &format!("{what}s"), &names))
    })
}
