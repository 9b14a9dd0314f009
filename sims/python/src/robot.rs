//! `Robot`: the embedded robot model: named parts, poses, Jacobians, paths. Inverse kinematics, grasped objects and forces are in submodules.
use crate::array::{Array1, Array2, Input, out_pose, out1, out2, vector};
use crate::collisions::Collisions;
use crate::contact::{Collider, chosen};
use crate::core::lock;
use crate::error::{refuse, refuse_with};
use crate::mechanism::{Mechanism, choice};
use crate::values::pairs;
use linkwork_embedded::{
    Closures, Frame, ModelSpec, Object, Part, PartSpec, PlanOutcome, Planner, Rows, Search, formats,
};
use linkwork_multibody::BodyId;
use linkwork_runtime::remedy;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use std::collections::BTreeMap;
use std::path::PathBuf;

mod control;
mod force;
mod hold;
mod inverse_kinematics;
mod motion;
mod search;
mod together;
pub use control::{WholeBodyForces, support_margin, support_polygon};
pub use hold::Grip;
pub use motion::Trajectory;
pub use search::InverseKinematicsSearch;

/// Number of random samples between two checks for Ctrl-C.
const DRAWS: usize = 50;

type ArrayLike<'a, 'py> = &'a Bound<'py, PyAny>;

/// The robot model that autonomy software embeds.
///
/// It provides kinematics of named parts, inverse kinematics within limits, grasped objects, forces and masses that include what is held,
/// collision-free paths and trajectories, and all queries of `Collisions`, including grasped objects.
///
/// Parameters
/// ----------
/// mechanism : Mechanism
///     The robot. Gravity is that of the mechanism at this moment.
/// chains : dict, optional
///     Serial chains: {name: (base, tip)} with the names of two bodies. The base may be "world".
/// groups : dict, optional
///     Other parts, such as grippers: {name: [bodies]}.
/// srdf : str or path-like, optional
///     SRDF file whose groups become parts; for a mechanism that was loaded from a file.
/// objects : dict, optional
///     Objects that hands can hold: {name: (mass, com, inertia)} for a rigid object, with kg, m (3,) and kg m² (3, 3) about the centre of
///     mass; or {name: Mechanism} for an object with joints, such as pliers. Exactly one body must be attached to the world of this
///     mechanism; it must have this name and a free hinge. A collider belongs to an object if it names one of its bodies.
/// colliders, ignore, collide, neighbours : optional
///     As in `Collisions`. An empty list of colliders disables collision checks.
///
/// Raises
/// ------
/// LinkworkError
///     If names or shapes are not valid, the mechanism has flexible bodies, or a motion across a loop is prescribed. The message lists all
///     mistakes.
///
/// Notes
/// -----
/// Units are m and rad. Vectors are in world axes with the angular part first. `q` (nq,) is the robot's own configuration, initially neutral.
/// Results are reproducible: equal calls give bit-identical results.
///
/// Loops and couplings of the mechanism: `inverse_kinematics_together` keeps them closed. Masses and forces are those of the tree, as if every
/// coordinate had a motor. Functions that would open a loop raise: searches, rates and paths of a chain that is part of it, and control.
/// `time_parameterize` supports linear couplings, such as mimic joints, which then have no motor.
///
/// Examples
/// --------
/// >>> import numpy as np, linkwork
/// >>> parts = linkwork.Builder()
/// >>> for link, parent in [("upper", "world"), ("lower", "upper"), ("hand", "lower")]:
/// ...     at = [0, 0, 0] if parent == "world" else [0.4, 0, 0]
/// ...     parts = parts.body(link, parent, linkwork.Hinge.pin([0, -1, 0]).limits(-3, 3), mass=1, com=[0.2, 0, 0], inertia=np.eye(3) / 100, hinge_in_parent=at)
/// >>> robot = linkwork.Robot(parts.build(), chains={"arm": ("world", "hand")}, objects={"cup": (0.3, [0, 0, 0], np.eye(3) / 1000)}, colliders=[])
/// >>> robot.q = robot.inverse_kinematics("arm", [0.5, 0, 0.3], q=[0.5, 0.5, 0.5])
/// >>> robot.tip_pose("arm")[:3, 3].round(6).tolist()
/// [0.5, 0.0, 0.3]
/// >>> with robot.grasp("arm", "cup", [0.1, 0, 0]):
/// ...     held = robot.gravity_forces()
/// >>> bool(held[0] > robot.gravity_forces()[0])
/// True
#[pyclass(frozen, extends = Collisions, module = "linkwork")]
pub struct Robot {}

impl Collisions {
    fn part(&self, name: &str) -> PyResult<Part> {
        self.model.part(name).ok_or_else(|| {
            let known: Vec<&str> = self.model.parts().map(|p| p.1).collect();
            refuse_with(format!("there is no part `{name}`"), remedy(name, "parts", &known))
        })
    }

    fn object(&self, name: &str) -> PyResult<Object> {
        self.model.object(name).ok_or_else(|| {
            let known: Vec<&str> = self.model.objects().map(|o| o.1).collect();
            refuse_with(format!("there is no object `{name}`"), remedy(name, "objects", &known))
        })
    }

    fn body(&self, name: &str) -> PyResult<BodyId> {
        let mbs = self.model.multibody();
        mbs.body(name).ok_or_else(|| {
            let known: Vec<&str> = mbs.bodies().iter().map(|b| b.name()).collect();
            refuse_with(format!("there is no body `{name}`"), remedy(name, "bodies", &known))
        })
    }

    fn part_name(&self, part: Part) -> String {
        self.model.parts().find(|p| p.0 == part).map_or_else(String::new, |p| p.1.to_owned())
    }

    /// Returns the given configuration, or the robot's own.
    fn q_or_own(&self, q: Option<ArrayLike<'_, '_>>) -> PyResult<Vec<f64>> {
        match q {
            Some(q) => Ok(vector(q, self.model.nq(), "q")?.slice().to_vec()),
            None => Ok(lock(&self.robot).q().to_vec()),
        }
    }
}

/// Returns the base class object, which contains the instance.
fn base<'a>(slf: &'a Bound<'_, Robot>) -> &'a Collisions {
    slf.as_super().get()
}

fn frame(in_base: bool) -> Frame {
    if in_base { Frame::Base } else { Frame::World }
}

fn above_zero(what: &str, x: f64) -> PyResult<f64> {
    if x > 0.0 && x.is_finite() {
        return Ok(x);
    }
    Err(refuse_with(format!("`{what}` is {x}"), "give a number above zero"))
}

fn count_of(what: &str, count: usize) -> PyResult<()> {
    if (1..=10_000).contains(&count) {
        return Ok(());
    }
    Err(refuse_with(format!("`{what}` is {count}"), "give a number from 1 to 10000"))
}

/// Returns the rows of a Jacobian by name.
fn rows_of(rows: &str, length: f64) -> PyResult<Rows> {
    let known =
        [("all", Rows::All { length }), ("linear", Rows::Linear), ("angular", Rows::Angular)];
    choice("rows", rows, &known)
}

#[pymethods]
impl Robot {
    #[new]
    #[pyo3(signature = (mechanism, *, chains=None, groups=None, srdf=None, objects=None, colliders=None, ignore=None, collide=None, neighbours=None))]
    fn new(
        mechanism: &Mechanism,
        chains: Option<BTreeMap<String, (String, String)>>,
        groups: Option<BTreeMap<String, Vec<String>>>,
        srdf: Option<PathBuf>,
        objects: Option<&Bound<'_, PyDict>>,
        colliders: Option<Vec<PyRef<'_, Collider>>>,
        ignore: Option<Vec<[String; 2]>>,
        collide: Option<Vec<[String; 2]>>,
        neighbours: Option<&str>,
    ) -> PyResult<PyClassInitializer<Self>> {
        let core = &mechanism.core;
        let (colliders, rules) = chosen(mechanism, colliders, ignore, collide, neighbours)?;
        let mut spec = ModelSpec {
            mechanism: linkwork_multibody::Builder::from(&core.mbs),
            closures: Closures::Kept,
            colliders,
            rules,
            ..ModelSpec::default()
        };
        if let Some(path) = srdf {
            let Some(description) = &core.description else {
                let help = "give `chains` and `groups`, or load the mechanism from its file";
                return Err(refuse_with(
                    "`srdf` requires a mechanism that was loaded from a file",
                    help,
                ));
            };
            let srdf = formats::read_srdf_file(path).map_err(refuse)?;
            spec = spec.groups(&srdf, description).map_err(refuse)?;
        }
        for (name, (base, tip)) in chains.unwrap_or_default() {
            spec.parts.push(PartSpec::chain(&name, &base, &tip));
        }
        for (name, bodies) in groups.unwrap_or_default() {
            spec.parts.push(PartSpec::Bodies { name, bodies });
        }
        for (name, given) in objects.into_iter().flat_map(pairs) {
            hold::object(name.extract()?, &given, &mut spec)?;
        }
        let own = Collisions::of(core.clone(), &spec)?;
        Ok(PyClassInitializer::from(own).add_subclass(Self {}))
    }

    /// Return an independent copy with the same q, objects and settings.
    ///
    /// Returns
    /// -------
    /// Robot
    ///     The copy.
    ///
    /// Examples
    /// --------
    /// >>> other = robot.copy()
    /// >>> other.q = [0.1, 0.2, 0.3]
    /// >>> robot.q.tolist() == other.q.tolist()
    /// False
    fn copy(slf: &Bound<'_, Self>) -> PyResult<Py<Self>> {
        let own = base(slf).copy();
        Py::new(slf.py(), PyClassInitializer::from(own).add_subclass(Self {}))
    }

    /// The configuration (nq,), rad and m. It may be outside the limits.
    ///
    /// Raises
    /// ------
    /// LinkworkError
    ///     If the new value has a wrong length or contains NaN. The configuration is then unchanged.
    ///
    /// Examples
    /// --------
    /// >>> robot.q = [0.1, 0.2, 0.3]
    /// >>> robot.q.tolist()
    /// [0.1, 0.2, 0.3]
    #[getter]
    fn q<'py>(slf: &Bound<'py, Self>) -> Array1<'py> {
        out1(slf.py(), lock(&base(slf).robot).q().to_vec())
    }

    #[setter]
    fn set_q(slf: &Bound<'_, Self>, q: ArrayLike<'_, '_>) -> PyResult<()> {
        let own = base(slf);
        let q = vector(q, own.model.nq(), "q")?;
        own.ask(|r| r.set_q(q.slice()))
    }

    /// The bodies of each part, from the base outward: {name: bodies}.
    ///
    /// Examples
    /// --------
    /// >>> robot.parts
    /// {'arm': ['upper', 'lower', 'hand']}
    #[getter]
    fn parts<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyDict>> {
        let (model, all) = (&base(slf).model, PyDict::new(slf.py()));
        for (part, name) in model.parts() {
            let bodies = model.bodies(part).map_err(refuse)?;
            let names = bodies.iter().map(|b| model.multibody().get(*b).name());
            all.set_item(name, names.collect::<Vec<_>>())?;
        }
        Ok(all)
    }

    /// Names of the objects, in the order in which they were passed.
    ///
    /// Examples
    /// --------
    /// >>> robot.objects
    /// ['cup']
    #[getter]
    fn objects(slf: &Bound<'_, Self>) -> Vec<String> {
        base(slf).model.objects().map(|o| o.1.to_owned()).collect()
    }

    /// Return the indices in v of the degrees of freedom of a chain: the columns of its Jacobian.
    ///
    /// Parameters
    /// ----------
    /// part : str
    ///     Name of the chain.
    ///
    /// Returns
    /// -------
    /// list of int
    ///     The indices.
    ///
    /// Raises
    /// ------
    /// LinkworkError
    ///     If the part is not a chain.
    ///
    /// Examples
    /// --------
    /// >>> robot.dofs("arm")
    /// [0, 1, 2]
    fn dofs(slf: &Bound<'_, Self>, part: &str) -> PyResult<Vec<usize>> {
        let own = base(slf);
        Ok(own.model.dofs(own.part(part)?).map_err(refuse)?.to_vec())
    }

    /// Return the pose of the tip of a chain in the world at the robot's q.
    ///
    /// Parameters
    /// ----------
    /// part : str
    ///     Name of the chain.
    ///
    /// Returns
    /// -------
    /// ndarray, shape (4, 4)
    ///     Homogeneous matrix, position in m.
    ///
    /// Raises
    /// ------
    /// LinkworkError
    ///     If the part is not a chain.
    ///
    /// Examples
    /// --------
    /// >>> robot.q = [0, 0, 0]
    /// >>> robot.tip_pose("arm")[:2, 3].round(6).tolist()
    /// [0.8, 0.0]
    fn tip_pose<'py>(slf: &Bound<'py, Self>, part: &str) -> PyResult<Array2<'py>> {
        let own = base(slf);
        let part = own.part(part)?;
        out_pose(slf.py(), &own.ask(|r| r.tip_pose(part))?)
    }

    /// Return the pose of the base of a chain in the world at the robot's q.
    ///
    /// Parameters
    /// ----------
    /// part : str
    ///     Name of the chain.
    ///
    /// Returns
    /// -------
    /// ndarray, shape (4, 4)
    ///     Homogeneous matrix, position in m.
    ///
    /// Raises
    /// ------
    /// LinkworkError
    ///     If the part is not a chain.
    ///
    /// Examples
    /// --------
    /// >>> robot.base_pose("arm")[:3, 3].tolist()
    /// [0.0, 0.0, 0.0]
    fn base_pose<'py>(slf: &Bound<'py, Self>, part: &str) -> PyResult<Array2<'py>> {
        let own = base(slf);
        let part = own.part(part)?;
        out_pose(slf.py(), &own.ask(|r| r.base_pose(part))?)
    }

    /// Return the pose of a body in the world at the robot's q.
    ///
    /// Parameters
    /// ----------
    /// body : str
    ///     Name of a body.
    ///
    /// Returns
    /// -------
    /// ndarray, shape (4, 4)
    ///     Homogeneous matrix, position in m.
    ///
    /// Raises
    /// ------
    /// LinkworkError
    ///     If the name does not exist.
    ///
    /// Examples
    /// --------
    /// >>> robot.q = [0, 0, 0]
    /// >>> robot.body_pose("lower")[:2, 3].round(6).tolist()
    /// [0.4, 0.0]
    fn body_pose<'py>(slf: &Bound<'py, Self>, body: &str) -> PyResult<Array2<'py>> {
        let own = base(slf);
        let body = own.body(body)?;
        out_pose(slf.py(), &own.ask(|r| Ok(r.body_pose(body)))?)
    }

    /// Compute the Jacobian of the tip of a chain at the robot's q, in world axes.
    ///
    /// Parameters
    /// ----------
    /// part : str
    ///     Name of the chain.
    /// whole : bool
    ///     False: velocity of the tip relative to the chain's base, over the chain's own degrees of freedom (`dofs`). True: velocity of the tip
    ///     in the world, over all degrees of freedom of the robot (default: False).
    ///
    /// Returns
    /// -------
    /// ndarray, shape (6, n) or (6, nv)
    ///     Rates to [ω; v], rad/s and m/s.
    ///
    /// Raises
    /// ------
    /// LinkworkError
    ///     If the part is not a chain.
    ///
    /// Examples
    /// --------
    /// >>> robot.jacobian("arm").shape, robot.jacobian("arm", whole=True).shape
    /// ((6, 3), (6, 3))
    #[pyo3(signature = (part, *, whole=false))]
    fn jacobian<'py>(slf: &Bound<'py, Self>, part: &str, whole: bool) -> PyResult<Array2<'py>> {
        let own = base(slf);
        let part = own.part(part)?;
        let n = if whole { own.model.nv() } else { own.model.dofs(part).map_err(refuse)?.len() };
        let mut J = vec![0.0; 6 * n];
        own.ask(|r| if whole { r.whole_jacobian(part, &mut J) } else { r.jacobian(part, &mut J) })?;
        out2(slf.py(), J, 6, n)
    }

    /// Compute the velocity ellipsoid of the tip of a chain at the robot's q.
    ///
    /// It contains the tip velocities for joint rates of norm 1. The force ellipsoid, for joint torques of norm 1, has the same directions and the
    /// inverse half axes.
    ///
    /// Parameters
    /// ----------
    /// part : str
    ///     Name of the chain.
    /// rows : {"all", "linear", "angular"}
    ///     Velocity components: 6, or 3 of them (default: "all").
    /// length : float
    ///     Length, m, that weights 1 rad with rows "all" (default: 1).
    ///
    /// Returns
    /// -------
    /// half_axes : ndarray, shape (k,)
    ///     Half axes, m/s or rad/s, largest first; k is the number of components.
    /// directions : ndarray, shape (k, k)
    ///     Their directions, in columns.
    ///
    /// Raises
    /// ------
    /// LinkworkError
    ///     If the part is not a chain, or `length` is not positive.
    ///
    /// Examples
    /// --------
    /// >>> robot.q = [0.1, 0.6, 0.5]
    /// >>> half, directions = robot.ellipsoid("arm", rows="linear")
    /// >>> bool(abs(half.prod() - robot.manipulability("arm", rows="linear")[0]) < 1e-12), directions.shape
    /// (True, (3, 3))
    #[pyo3(signature = (part, *, rows="all", length=1.0))]
    fn ellipsoid<'py>(
        slf: &Bound<'py, Self>,
        part: &str,
        rows: &str,
        length: f64,
    ) -> PyResult<(Array1<'py>, Array2<'py>)> {
        let own = base(slf);
        let part = own.part(part)?;
        let (rows, k) = (rows_of(rows, length)?, if rows == "all" { 6 } else { 3 });
        let found = own.ask(|r| r.manipulability(part, rows, None))?;
        let directions = (0..k).flat_map(|i| (0..k).map(move |j| (i, j)));
        let directions = directions.map(|at| found.axes[at]).collect();
        Ok((out1(slf.py(), found.singular_values[..k].to_vec()), out2(slf.py(), directions, k, k)?))
    }

    /// Compute the manipulability w = √det(J Jᵀ) of the tip of a chain at the robot's q.
    ///
    /// Parameters
    /// ----------
    /// part : str
    ///     Name of the chain.
    /// rows : {"all", "linear", "angular"}
    ///     Velocity components (default: "all").
    /// length : float
    ///     Length, m, that weights 1 rad with rows "all" (default: 1).
    ///
    /// Returns
    /// -------
    /// w : float
    ///     The manipulability.
    /// gradient : ndarray, shape (n,)
    ///     Its gradient over the chain's degrees of freedom, per rad and m.
    ///
    /// Raises
    /// ------
    /// LinkworkError
    ///     If the part is not a chain, or `length` is not positive.
    ///
    /// Examples
    /// --------
    /// >>> robot.q = [0.1, 0.6, 0.5]
    /// >>> w, gradient = robot.manipulability("arm", rows="linear")
    /// >>> gradient.shape
    /// (3,)
    #[pyo3(signature = (part, *, rows="all", length=1.0))]
    fn manipulability<'py>(
        slf: &Bound<'py, Self>,
        part: &str,
        rows: &str,
        length: f64,
    ) -> PyResult<(f64, Array1<'py>)> {
        let own = base(slf);
        let part = own.part(part)?;
        let rows = rows_of(rows, length)?;
        let mut gradient = vec![0.0; own.model.dofs(part).map_err(refuse)?.len()];
        let found = own.ask(|r| r.manipulability(part, rows, Some(&mut gradient)))?;
        Ok((found.w, out1(slf.py(), gradient)))
    }

    /// Test whether a configuration is within all limits and collision-free.
    ///
    /// Use it as the state validity checker of a sampling-based planner, such as OMPL's `setStateValidityChecker`.
    ///
    /// Parameters
    /// ----------
    /// q : array_like, shape (nq,)
    ///     Configuration, rad and m.
    ///
    /// Returns
    /// -------
    /// bool
    ///     True if it is valid.
    ///
    /// Raises
    /// ------
    /// LinkworkError
    ///     If an array has a wrong shape or contains NaN.
    ///
    /// Examples
    /// --------
    /// >>> robot.is_valid([0.1, 0.2, 0.3]), robot.is_valid([4.0, 0, 0])
    /// (True, False)
    fn is_valid(slf: &Bound<'_, Self>, q: ArrayLike<'_, '_>) -> PyResult<bool> {
        let own = base(slf);
        let q: Input<'_> = vector(q, own.model.nq(), "q")?;
        let mut within = q.slice().to_vec();
        own.ask(|r| r.clamp(&mut within))?;
        if within != q.slice() {
            return Ok(false);
        }
        Ok(!own.ask(|r| r.collides(q.slice()))?)
    }

    /// Find a collision-free path of a chain between two configurations (RRT-Connect).
    ///
    /// Only the chain's coordinates may differ between the two. Every piece of the path is proven collision-free. Equal seeds give equal paths.
    ///
    /// Parameters
    /// ----------
    /// part : str
    ///     Name of the chain.
    /// goal : array_like, shape (nq,)
    ///     Goal configuration, rad and m.
    /// start : array_like, shape (nq,), optional
    ///     Start configuration (default: the robot's own).
    /// seed : int
    ///     Seed (default: 1).
    /// step : float
    ///     Largest length of an extension of a tree, rad and m.
    /// room : int
    ///     Largest number of configurations in each of the two trees.
    ///
    /// Returns
    /// -------
    /// ndarray, shape (n, nq)
    ///     The path: configurations between which all coordinates move linearly.
    ///
    /// Raises
    /// ------
    /// LinkworkError
    ///     If the start or the goal is in collision or outside the limits, or no path was found with `room` configurations (which does not prove
    ///     that none exists).
    ///
    /// Examples
    /// --------
    /// >>> robot.plan("arm", [0.5, 0.5, 0.5], start=[0, 0, 0]).shape
    /// (2, 3)
    #[pyo3(signature = (part, goal, start=None, *, seed=1, step=0.5, room=2000))]
    fn plan<'py>(
        slf: &Bound<'py, Self>,
        part: &str,
        goal: ArrayLike<'_, 'py>,
        start: Option<ArrayLike<'_, 'py>>,
        #[pyo3(from_py_with = crate::values::seed)] seed: u64,
        step: f64,
        room: usize,
    ) -> PyResult<Array2<'py>> {
        let (own, name) = (base(slf), part);
        let part = own.part(name)?;
        let nq = own.model.nq();
        let goal = vector(goal, nq, "goal")?.slice().to_vec();
        let start = own.q_or_own(start)?;
        let mut robot = lock(&own.robot).clone();
        if room > 1_000_000 {
            let help = "each step searches all configurations: give at most 1000000";
            return Err(refuse_with(format!("`room` is {room}"), help));
        }
        let mut planner = Planner::new(&robot, part, room).map_err(refuse)?;
        let search = Search { seed, step, ..Search::default() };
        let begin = || planner.begin(&mut robot, &start, &goal, &search);
        let mut found = slf.py().detach(begin).map_err(refuse)?;
        while found == PlanOutcome::Unfinished {
            slf.py().check_signals()?;
            let portion = || planner.resume(&mut robot, DRAWS);
            found = slf.py().detach(portion).map_err(refuse)?;
        }
        let blocked = |end: &str, pair| {
            let (a, b) = own.names(pair);
            refuse_with(
                format!("`{a}` touches `{b}` at the {end}"),
                "choose a collision-free configuration",
            )
        };
        match found {
            PlanOutcome::Found => {
                let rows: Vec<f64> = planner.path().flatten().copied().collect();
                let n = rows.len() / nq;
                out2(slf.py(), rows, n, nq)
            }
            PlanOutcome::BlockedStart { pair } => Err(blocked("start", pair)),
            PlanOutcome::BlockedGoal { pair } => Err(blocked("goal", pair)),
            PlanOutcome::NotFound | PlanOutcome::Unfinished => Err(refuse_with(
                format!("no path of `{name}` was found with {room} configurations"),
                "use more `room`, another `step` or `seed`; possibly no path exists",
            )),
        }
    }

    fn __repr__(slf: &Bound<'_, Self>) -> String {
        let model = &base(slf).model;
        let (parts, objects) = (model.parts().len(), model.objects().len());
        format!(
            "Robot({} dofs, {parts} parts, {objects} objects, {} colliders)",
            model.nv(),
            model.colliders().len()
        )
    }
}
