//! `Mechanism.inverse_kinematics` and its rates; targets as values.
use crate::array::{Array1, Input, fixed, out1, pose, vector};
use crate::core::{Core, lock};
use crate::error::{refuse, refuse_with};
use crate::mechanism::Mechanism;
use crate::values::pairs;
use linkwork_dynamics::inverse_kinematics::{Goal, Place, Pointing, Progress};
use linkwork_dynamics::{self as dynamics, InverseKinematics, InverseKinematicsError};
use linkwork_spatial::{Mat3, Motion, Quat, Vec3, quat};
use numpy::PyArray1;
use pyo3::prelude::*;
use pyo3::types::PyDict;

/// Goal of a frame for inverse kinematics.
///
/// The shape of `at` determines what is prescribed: (3,) position of the frame's origin, m; (4,) attitude as a quaternion [x y z w]; (3, 3)
/// attitude as a rotation matrix; (7,) position and quaternion; (4, 4) pose; None: neither.
///
/// Part of a pose can be prescribed: the frame's axis `axis` points along `along` or towards the point `look_at`, and the rotation about it stays
/// free. With `plane`, only the position component along this normal counts. With `line`, only the position components across this direction
/// count. Directions may have any length.
///
/// Parameters
/// ----------
/// frame : str
///     Name of a node or a body.
/// at : array_like, optional
///     Position, attitude or pose.
/// relative_to : str, optional
///     Frame of the mechanism in which the goal is given (default: the world).
/// position_weight, orientation_weight : float
///     Weights of 1 m and 1 rad in the sum of squares.
/// axis, along, look_at, plane, line : array_like, shape (3,), optional
///     See above; `look_at` in m.
/// within : float
///     Angle of the cone within which the axis has to point, rad (default: 0).
///
/// Raises
/// ------
/// LinkworkError
///     If an array has a wrong shape or contains NaN, a matrix is not a rotation, a direction has length zero, or `axis` is used together
///     with an attitude.
///
/// Examples
/// --------
/// >>> pin = linkwork.Hinge.pin([0, 1, 0])
/// >>> arm = linkwork.Builder().body("upper", "world", pin, mass=2).body("lower", "upper", pin, mass=1, hinge_in_parent=[1, 0, 0]).node("tip", "lower", [1, 0, 0]).build()
/// >>> target = linkwork.Target("tip", [1.2, 0, -0.5])
/// >>> target
/// Target(position of tip)
/// >>> q = arm.inverse_kinematics([0.1, 0.5], [target])
/// >>> bool(np.allclose(arm.state(q).position("tip"), [1.2, 0, -0.5]))
/// True
/// >>> seen = arm.inverse_kinematics([0.1, 0.5], [linkwork.Target("tip", axis=[1, 0, 0], look_at=[2, 0, -1])])
/// >>> X = arm.state(seen).pose("tip")
/// >>> bool(np.allclose(np.cross(X[:3, 0], [2, 0, -1] - X[:3, 3]), 0))
/// True
#[pyclass(frozen, weakref, module = "linkwork")]
pub struct Target {
    frame: String,
    relative_to: Option<String>,
    goal: Goal,
}

/// Arguments that prescribe parts of a pose.
pub struct Parts<'a, 'py> {
    pub axis: Option<&'a Bound<'py, PyAny>>,
    pub along: Option<&'a Bound<'py, PyAny>>,
    pub look_at: Option<&'a Bound<'py, PyAny>>,
    pub within: f64,
    pub plane: Option<&'a Bound<'py, PyAny>>,
    pub line: Option<&'a Bound<'py, PyAny>>,
}

impl Parts<'_, '_> {
    /// Returns the goal of a tip with a position, a pose, or neither. Messages call `at` by the name `what`.
    pub fn goal(&self, at: Option<&Bound<'_, PyAny>>, what: &str) -> PyResult<Goal> {
        let (position, orientation) = at.map_or(Ok((None, None)), |at| place(at, what))?;
        let (place, pointing) = self.read()?;
        Ok(Goal { position, orientation, weights: [1.0; 2], place, pointing })
    }

    /// Returns which components of the position count, and the direction of the axis.
    pub fn read(&self) -> PyResult<(Place, Option<Pointing>)> {
        let direction = |given: &Bound<'_, PyAny>, what: &str| {
            let v = Vec3::from(fixed::<3>(given, what)?);
            let length = v.norm();
            let help = "give a direction with a length above zero";
            let none = || refuse_with(format!("`{what}` has the length zero"), help);
            if length > 0.0 && length.is_finite() { Ok(v / length) } else { Err(none()) }
        };
        let place = match (self.plane, self.line) {
            (None, None) => Place::Point,
            (Some(n), None) => Place::Plane(direction(n, "plane")?),
            (None, Some(u)) => Place::Line(direction(u, "line")?),
            (Some(_), Some(_)) => {
                return Err(refuse_with("both `plane` and `line` are given", "give one of them"));
            }
        };
        let help = "give `axis`, and either `along` or `look_at`";
        let pointing = match (self.axis, self.along, self.look_at) {
            (None, None, None) if self.within == 0.0 => None,
            (Some(axis), Some(a), None) => {
                Some(Pointing::along(direction(axis, "axis")?, direction(a, "along")?))
            }
            (Some(axis), None, Some(x)) => {
                let point = Vec3::from(fixed::<3>(x, "look_at")?);
                Some(Pointing::at(direction(axis, "axis")?, point))
            }
            _ => {
                return Err(refuse_with(
                    "the direction of the axis is incomplete or specified twice",
                    help,
                ));
            }
        };
        Ok((place, pointing.map(|p| p.within(self.within))))
    }
}

#[pymethods]
impl Target {
    #[new]
    #[pyo3(signature = (frame, at=None, *, relative_to=None, position_weight=1.0, orientation_weight=1.0, axis=None, along=None, look_at=None, within=0.0, plane=None, line=None))]
    #[allow(clippy::too_many_arguments)]
    fn new(
        frame: String,
        at: Option<&Bound<'_, PyAny>>,
        relative_to: Option<String>,
        position_weight: f64,
        orientation_weight: f64,
        axis: Option<&Bound<'_, PyAny>>,
        along: Option<&Bound<'_, PyAny>>,
        look_at: Option<&Bound<'_, PyAny>>,
        within: f64,
        plane: Option<&Bound<'_, PyAny>>,
        line: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<Self> {
        let what = format!("target of \"{frame}\"");
        let weights = [position_weight, orientation_weight];
        let parts = Parts { axis, along, look_at, within, plane, line };
        let goal = Goal { weights, ..parts.goal(at, &what)? };
        Ok(Self { frame, relative_to, goal })
    }
    fn __repr__(&self) -> String {
        let what = match (self.goal.position, self.goal.orientation, self.goal.pointing) {
            (Some(_), Some(_), _) => "pose",
            (Some(_), _, Some(_)) => "position and axis",
            (Some(_), None, None) => "position",
            (None, None, Some(_)) => "axis",
            (None, None, None) => "nothing",
            _ => "attitude",
        };
        format!("Target({what} of {})", self.frame)
    }
}

/// {frame: at}, or a list of `Target`.
pub fn targets_of(given: &Bound<'_, PyAny>) -> PyResult<Vec<Target>> {
    let mut all = Vec::new();
    if let Ok(map) = given.cast::<PyDict>() {
        for (frame, at) in pairs(map) {
            all.push(Target::of(frame.extract()?, &at)?);
        }
        return Ok(all);
    }
    for target in given.try_iter()? {
        let target = target?;
        let Target { frame, relative_to, goal } = target.cast::<Target>()?.get();
        let (frame, relative_to, goal) = (frame.clone(), relative_to.clone(), *goal);
        all.push(Target { frame, relative_to, goal });
    }
    Ok(all)
}

impl Target {
    /// Returns the frame, the reference frame (`None`: the world) and the goal.
    pub fn parts(&self) -> (&str, Option<&str>, Goal) {
        (&self.frame, self.relative_to.as_deref(), self.goal)
    }

    /// Creates a target whose kind follows from the shape of `at`.
    fn of(frame: String, at: &Bound<'_, PyAny>) -> PyResult<Self> {
        let (position, orientation) = place(at, &format!("target of \"{frame}\""))?;
        let goal = Goal { position, orientation, ..Goal::NOTHING };
        Ok(Self { frame, relative_to: None, goal })
    }

    fn resolve(&self, core: &Core) -> PyResult<dynamics::Target> {
        let relative_to = self.relative_to.as_deref().map(|f| core.frame(f)).transpose()?;
        Ok(dynamics::Target { node: core.frame(&self.frame)?, relative_to, goal: self.goal })
    }
}

/// Reads a position, an attitude or both; the shape determines which.
pub fn place(at: &Bound<'_, PyAny>, what: &str) -> PyResult<(Option<Vec3>, Option<Quat>)> {
    let input = Input::read(at, what)?;
    let x = input.slice();
    match *input.shape() {
        [3] => Ok((Some(Vec3::new(x[0], x[1], x[2])), None)),
        [4] => {
            let whole = [0.0, 0.0, 0.0, x[0], x[1], x[2], x[3]];
            let whole = PyArray1::from_slice(at.py(), &whole).into_any();
            Ok((None, Some(pose(Some(&whole), what)?.rotation)))
        }
        [3, 3] => {
            let R = Mat3::from_row_slice(x);
            let off = (R * R.transpose() - Mat3::identity()).norm();
            if !(off < 1e-6 && R.determinant() > 0.0) {
                return Err(refuse_with(
                    format!("`{what}` is not a rotation matrix: its error is {off:e}"),
                    "the columns must be orthogonal unit vectors, the axes of the frame",
                ));
            }
            Ok((None, Some(quat(&R))))
        }
        _ => {
            let X = pose(Some(at), what)?;
            Ok((Some(X.position), Some(X.rotation)))
        }
    }
}

/// Desired velocity of a frame, for `Mechanism.inverse_kinematics_rates`.
///
/// Parameters
/// ----------
/// frame : str
///     Name of a node or a body.
/// velocity : array_like, shape (6,)
///     [ω; v] of its origin, rad/s and m/s, as seen from `relative_to` and in its axes.
/// relative_to : str, optional
///     Frame of the mechanism (default: the world).
/// linear_weight, angular_weight : float
///     Weights of 1 m/s and 1 rad/s; 0 ignores the component.
///
/// Raises
/// ------
/// LinkworkError
///     If an array has a wrong shape or contains NaN.
///
/// Examples
/// --------
/// >>> pin = linkwork.Hinge.pin([0, 1, 0])
/// >>> arm = linkwork.Builder().body("upper", "world", pin, mass=2).body("lower", "upper", pin, mass=1, hinge_in_parent=[1, 0, 0]).node("tip", "lower", [1, 0, 0]).build()
/// >>> target = linkwork.RateTarget("tip", [0, 0, 0, 0.1, 0, 0], angular_weight=0)
/// >>> target
/// RateTarget(tip)
/// >>> v = arm.inverse_kinematics_rates([0.1, 0.5], [target])
/// >>> bool(np.allclose(arm.state([0.1, 0.5], v).velocity("tip")[3:], [0.1, 0, 0]))
/// True
#[pyclass(frozen, weakref, module = "linkwork")]
pub struct RateTarget {
    frame: String,
    relative_to: Option<String>,
    velocity: Motion,
    weights: (f64, f64),
}

#[pymethods]
impl RateTarget {
    #[new]
    #[pyo3(signature = (frame, velocity, *, relative_to=None, linear_weight=1.0, angular_weight=1.0))]
    fn new(
        frame: String,
        velocity: &Bound<'_, PyAny>,
        relative_to: Option<String>,
        linear_weight: f64,
        angular_weight: f64,
    ) -> PyResult<Self> {
        let [a, b, c, x, y, z] = fixed::<6>(velocity, &format!("velocity of \"{frame}\""))?;
        let velocity = Motion::new(Vec3::new(a, b, c), Vec3::new(x, y, z));
        Ok(Self { frame, relative_to, velocity, weights: (linear_weight, angular_weight) })
    }
    fn __repr__(&self) -> String {
        format!("RateTarget({})", self.frame)
    }
}

impl RateTarget {
    fn resolve(&self, core: &Core) -> PyResult<dynamics::RateTarget> {
        let relative_to = self.relative_to.as_deref().map(|f| core.frame(f)).transpose()?;
        Ok(dynamics::RateTarget {
            node: core.frame(&self.frame)?,
            relative_to,
            velocity: self.velocity,
            linear_weight: self.weights.0,
            angular_weight: self.weights.1,
        })
    }
}

/// Number of evaluations of the kinematics between two checks for Ctrl-C.
pub const PORTION: usize = 2000;

/// Excludes the hinges of these bodies from the search.
fn keep(ik: &mut InverseKinematics, core: &Core, bodies: &[String]) -> PyResult<()> {
    for body in bodies {
        let v = core.mbs.get(core.body(body)?).v();
        ik.keep(v);
    }
    Ok(())
}

/// Converts the Rust error; its attribute `q` is the nearest configuration.
fn unreached(py: Python<'_>, e: InverseKinematicsError) -> PyErr {
    let error = refuse(&e);
    if let InverseKinematicsError::Unreachable { nearest, .. }
    | InverseKinematicsError::Open { nearest, .. } = e
    {
        let q = out1(py, nearest.q);
        // If the attribute cannot be set, the error is raised without it.
        let _ = error.value(py).setattr("q", q);
    }
    error
}

#[pymethods]
impl Mechanism {
    /// Compute a configuration in which all targets are met.
    ///
    /// The search begins at q and returns the solution to which it leads. Limits are respected, and the mechanism's own loops and couplings are
    /// closed. Prescribed coordinates do not change. Without targets, the function closes open loops and couplings.
    ///
    /// Parameters
    /// ----------
    /// q : array_like, shape (nq,)
    ///     Start, rad and m.
    /// targets : dict or sequence of Target
    ///     {frame: at} with `at` as in Target, or Targets.
    /// keep : sequence of str, optional
    ///     Bodies whose hinges do not move.
    /// position_tolerance, orientation_tolerance : float
    ///     Tolerances, m and rad.
    /// iterations : int
    ///     Largest number of steps from each start.
    /// restarts : int
    ///     Number of further starts, at random configurations.
    /// loop_motions : array_like, shape (m, 3), optional
    ///     Prescribed motions across loops, as in `constraint_errors`.
    ///
    /// Returns
    /// -------
    /// ndarray, shape (nq,)
    ///     The solution.
    ///
    /// Raises
    /// ------
    /// LinkworkError
    ///     If no start leads to a solution. The attribute `q` of the error is the nearest configuration with closed loops; if a loop or coupling
    ///     cannot be closed, it is the configuration with the smallest closure error.
    ///
    /// Examples
    /// --------
    /// >>> x = arm.inverse_kinematics(q, {"tip": [0.5, 0, -1.2]})
    /// >>> arm.state(x).position("tip").round(8).tolist()
    /// [0.5, -0.0, -1.2]
    #[pyo3(signature = (q, targets, *, keep=None, position_tolerance=1e-9, orientation_tolerance=1e-9, iterations=100, restarts=64, loop_motions=None))]
    #[allow(clippy::too_many_arguments)]
    fn inverse_kinematics<'py>(
        &self,
        py: Python<'py>,
        q: &Bound<'py, PyAny>,
        targets: &Bound<'py, PyAny>,
        keep: Option<Vec<String>>,
        position_tolerance: f64,
        orientation_tolerance: f64,
        iterations: usize,
        restarts: usize,
        loop_motions: Option<&Bound<'py, PyAny>>,
    ) -> PyResult<Array1<'py>> {
        let core = &*self.core;
        let mut q = core.configuration(q, "q")?.slice().to_vec();
        let list: Vec<dynamics::Target> =
            targets_of(targets)?.iter().map(|t| t.resolve(core)).collect::<PyResult<_>>()?;
        for (what, x) in [("position", position_tolerance), ("orientation", orientation_tolerance)]
        {
            if !(x.is_finite() && x > 0.0) {
                let fact = format!("`{what}_tolerance` is {x}");
                return Err(refuse_with(fact, "give a number above zero"));
            }
        }
        let mut ik = core.inverse_kinematics();
        let motions = self.motions(loop_motions)?;
        let positions: Vec<f64> = motions.iter().map(|m| m.position).collect();
        ik.set_loop_motions(&core.tree, &positions);
        self::keep(&mut ik, core, &keep.unwrap_or_default())?;
        ik.effort = dynamics::inverse_kinematics::Effort {
            position_tolerance,
            orientation_tolerance,
            iterations,
            restarts,
        };
        ik.begin(&core.tree, &list, &q).map_err(|e| unreached(py, e))?;
        // Ctrl-C is checked after each portion; the size of the portions does not affect the result.
        loop {
            py.check_signals()?;
            match py.detach(|| ik.advance(&core.tree, PORTION, &mut q)) {
                Progress::Unfinished(_) => {}
                Progress::Met(_) => return Ok(out1(py, q)),
                Progress::Nearest(found) => {
                    let e = ik.unreachable(&core.tree, &list, &q, found.iterations);
                    return Err(unreached(py, e));
                }
                Progress::Open(found) => {
                    let e = ik.unclosed(&core.tree, &list, &q, found.iterations);
                    return Err(unreached(py, e));
                }
            }
        }
    }

    /// Compute the smallest rates with which frames move as desired, or as nearly as possible.
    ///
    /// Rate limits are respected, and a coordinate at its limit does not move outward. The mechanism's own loops and couplings stay closed;
    /// prescribed motions across loops are at rest.
    ///
    /// Parameters
    /// ----------
    /// q : array_like, shape (nq,)
    ///     Configuration, rad and m.
    /// targets : dict or sequence of RateTarget
    ///     {frame: (6,)} with velocities [ω; v] in the world, rad/s and m/s, or RateTargets.
    /// v : array_like, shape (nv,), optional
    ///     Rates of prescribed coordinates and of the hinges in `keep` (default: zeros).
    /// keep : sequence of str, optional
    ///     Bodies whose hinges have the rates of `v`.
    ///
    /// Returns
    /// -------
    /// ndarray, shape (nv,)
    ///     Rates, rad/s and m/s.
    ///
    /// Raises
    /// ------
    /// LinkworkError
    ///     If the prescribed rates would open a loop, a name does not exist, or an array has a wrong shape or contains NaN.
    ///
    /// Examples
    /// --------
    /// >>> rates = arm.inverse_kinematics_rates(q, {"tip": [0, 0, 0, 0.1, 0, 0]})
    /// >>> rates.shape
    /// (2,)
    #[pyo3(signature = (q, targets, v=None, *, keep=None))]
    fn inverse_kinematics_rates<'py>(
        &self,
        py: Python<'py>,
        q: &Bound<'py, PyAny>,
        targets: &Bound<'py, PyAny>,
        v: Option<&Bound<'py, PyAny>>,
        keep: Option<Vec<String>>,
    ) -> PyResult<Array1<'py>> {
        let core = &*self.core;
        let q = core.configuration(q, "q")?;
        let mut v = match v {
            Some(v) => vector(v, core.nv(), "v")?.slice().to_vec(),
            None => vec![0.0; core.nv()],
        };
        let mut list = Vec::new();
        if let Ok(map) = targets.cast::<PyDict>() {
            for (frame, velocity) in pairs(map) {
                let target = RateTarget::new(frame.extract()?, &velocity, None, 1.0, 1.0)?;
                list.push(target.resolve(core)?);
            }
        } else {
            for target in targets.try_iter()? {
                list.push(target?.cast::<RateTarget>()?.get().resolve(core)?);
            }
        }
        let mut ik = core.inverse_kinematics();
        self::keep(&mut ik, core, &keep.unwrap_or_default())?;
        let q = q.slice();
        let found = py.detach(|| ik.rates(&core.tree, &list, q, &mut v).map(|_| ()));
        found.map_err(|e| unreached(py, e))?;
        Ok(out1(py, v))
    }
}

impl Core {
    /// Returns memory for inverse kinematics. It is created at first use and copied for each call, because a call marks the coordinates that it
    /// keeps.
    fn inverse_kinematics(&self) -> InverseKinematics {
        lock(&self.ik).get_or_insert_with(|| InverseKinematics::new(&self.tree)).clone()
    }
}
