//! `Robot`: the embedded robot model: parts by name, inverse kinematics, ways. What hands hold and forces are in files of their own.
use crate::array::{Array1, Array2, Input, out_pose, out1, out2, vector};
use crate::collisions::Collisions;
use crate::contact::{Collider, chosen};
use crate::core::lock;
use crate::error::{refuse, refuse_with};
use crate::inverse_kinematics::{Parts, place};
use crate::mechanism::{Mechanism, choice};
use crate::values::pairs;
use linkwork_embedded::{
    ClosedForm, Closures, Effort, Frame, Goal, ModelSpec, Object, Outcome, Part, PartSpec,
    PlanOutcome, Planner, Prefer, Rows, Search, formats,
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
mod motion;
mod search;
mod together;
pub use control::{WholeBodyForces, support_margin, support_polygon};
pub use hold::Grip;
pub use motion::Trajectory;
use search::Asked;
pub use search::InverseKinematicsSearch;

/// Random places between two looks at Ctrl-C.
const DRAWS: usize = 50;

type Given<'a, 'py> = &'a Bound<'py, PyAny>;

/// The robot model that autonomy software embeds: parts by name, each kinematics of its own; inverse kinematics within limits, objects in hands, forces
/// with what is held, free ways; and all that `Collisions` answers, with what is held.
///
/// chains: {name: (base, tip)}, bodies between which a part lies; base may be "world". groups: {name: [bodies]}, other parts, such as grippers. srdf: a
/// file whose groups are parts, too, for a mechanism of a file. objects: {name: (mass, com, inertia)}: rigid things that hands may hold: kg, m (3,), kg m²
/// (3, 3) about the centre of mass; or {name: Mechanism}: things with joints, such as pliers, whose one body on the world has this name and a free hinge. A
/// collider on a body of one names it. Gravity is the mechanism's at this moment. colliders, ignore, collide, neighbours: as `Collisions` (an empty list: nothing touches).
///
/// Lengths in m, angles in rad, world axes, angular part first. `q` (nq,) is the robot's own configuration, neutral at first; each instance has its own, and
/// the same calls give the same bits. Loops and couplings of the mechanism: `inverse_kinematics_together` keeps them closed; masses and forces are those of the tree, as if every
/// coordinate had a motor; what would open them is refused: searches, rates and ways of a chain that takes part in them, control, timed ways. Raises LinkworkError, with all mistakes
/// at once, for names and shapes that cannot be, for a mechanism with flexible bodies, and for loops whose motion is prescribed.
///
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

    /// A configuration that was given, or the robot's own.
    fn q_or_own(&self, q: Option<Given<'_, '_>>) -> PyResult<Vec<f64>> {
        match q {
            Some(q) => Ok(vector(q, self.model.nq(), "q")?.slice().to_vec()),
            None => Ok(lock(&self.robot).q().to_vec()),
        }
    }
}

/// The part of `Collisions`, with the instance.
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

/// Rows of a Jacobian by name.
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
                return Err(refuse_with("`srdf` names joints of a file, and there is none", help));
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

    /// Another instance with the same q, objects and settings; what changes in one afterwards does not in the other.
    ///
    /// >>> other = robot.copy()
    /// >>> other.q = [0.1, 0.2, 0.3]
    /// >>> robot.q.tolist() == other.q.tolist()
    /// False
    fn copy(slf: &Bound<'_, Self>) -> PyResult<Py<Self>> {
        let own = base(slf).copy();
        Py::new(slf.py(), PyClassInitializer::from(own).add_subclass(Self {}))
    }

    /// The configuration (nq,), rad and m, within limits or not. Setting raises LinkworkError for another length and for NaN; then nothing has changed.
    ///
    /// >>> robot.q = [0.1, 0.2, 0.3]
    /// >>> robot.q.tolist()
    /// [0.1, 0.2, 0.3]
    #[getter]
    fn q<'py>(slf: &Bound<'py, Self>) -> Array1<'py> {
        out1(slf.py(), lock(&base(slf).robot).q().to_vec())
    }

    #[setter]
    fn set_q(slf: &Bound<'_, Self>, q: Given<'_, '_>) -> PyResult<()> {
        let own = base(slf);
        let q = vector(q, own.model.nq(), "q")?;
        own.ask(|r| r.set_q(q.slice()))
    }

    /// {name: bodies} of the parts, from the base outward.
    ///
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

    /// Names of the objects, in the order in which they were given.
    ///
    /// >>> robot.objects
    /// ['cup']
    #[getter]
    fn objects(slf: &Bound<'_, Self>) -> Vec<String> {
        base(slf).model.objects().map(|o| o.1.to_owned()).collect()
    }

    /// Places in v of the degrees of freedom of a chain: the columns of its Jacobian. Raises LinkworkError for a part that is no chain.
    ///
    /// >>> robot.dofs("arm")
    /// [0, 1, 2]
    fn dofs(slf: &Bound<'_, Self>, part: &str) -> PyResult<Vec<usize>> {
        let own = base(slf);
        Ok(own.model.dofs(own.part(part)?).map_err(refuse)?.to_vec())
    }

    /// Where the tip of a chain is at the robot's q: (4, 4), m, in the world. Raises LinkworkError for a part that is no chain.
    ///
    /// >>> robot.q = [0, 0, 0]
    /// >>> robot.tip_pose("arm")[:2, 3].round(6).tolist()
    /// [0.8, 0.0]
    fn tip_pose<'py>(slf: &Bound<'py, Self>, part: &str) -> PyResult<Array2<'py>> {
        let own = base(slf);
        let part = own.part(part)?;
        out_pose(slf.py(), &own.ask(|r| r.tip_pose(part))?)
    }

    /// Where the base of a chain is at the robot's q: (4, 4), m, in the world. Raises LinkworkError for a part that is no chain.
    ///
    /// >>> robot.base_pose("arm")[:3, 3].tolist()
    /// [0.0, 0.0, 0.0]
    fn base_pose<'py>(slf: &Bound<'py, Self>, part: &str) -> PyResult<Array2<'py>> {
        let own = base(slf);
        let part = own.part(part)?;
        out_pose(slf.py(), &own.ask(|r| r.base_pose(part))?)
    }

    /// Where a body is at the robot's q: (4, 4), m, in the world. Raises LinkworkError for a name that is not there.
    ///
    /// >>> robot.q = [0, 0, 0]
    /// >>> robot.body_pose("lower")[:2, 3].round(6).tolist()
    /// [0.4, 0.0]
    fn body_pose<'py>(slf: &Bound<'py, Self>, body: &str) -> PyResult<Array2<'py>> {
        let own = base(slf);
        let body = own.body(body)?;
        out_pose(slf.py(), &own.ask(|r| Ok(r.body_pose(body)))?)
    }

    /// The Jacobian (6, n) of a chain at the robot's q, over its own degrees of freedom (`dofs`): [ω; v] of its tip against its base, rad/s and m/s, world
    /// axes. whole: over all degrees of freedom of the robot (6, nv), what carries the chain among them: [ω; v] of its tip in the world. Raises LinkworkError for
    /// a part that is no chain.
    ///
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

    /// The ellipsoid of the velocities of a chain's tip for joint rates of length 1, at the robot's q: half axes (k,), m/s or rad/s, greatest first, and their
    /// directions, columns (k, k) over the rows; k: 6 with rows "all" (1 rad counts as `length`, m), 3 with "linear" and "angular". Forces for joint torques of length 1 have the
    /// same directions, and the inverse half axes. Raises LinkworkError for a part that is no chain and a length that is not positive.
    ///
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

    /// How well a chain's tip moves at the robot's q: w = √det(J Jᵀ), and its gradient (n,) over the chain's degrees of freedom. rows: "all" (m and rad mixed:
    /// 1 rad counts as `length`, m), "linear" or "angular". Raises LinkworkError for a part that is no chain and a length that is not positive.
    ///
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

    /// A configuration (nq,) in which the tip of a chain is where it is to be, within limits; the chain alone moves, from q (nq,; None: the robot's own) on.
    /// The robot's own q does not change.
    ///
    /// at says what is asked by its shape: (3,) the position of the tip, m; (4,) its attitude [x y z w]; (3, 3) the same as a matrix; (7,) position and
    /// attitude; (4, 4) a pose; None: nothing; in the world, or in the chain's base with in_base. axis, along, look_at, within, plane, line: parts of a pose, as of `Target`.
    /// Tolerances in m and rad; steps from a start, and starts elsewhere, the same ones each time. Raises LinkworkError when no start led there: its attribute `q` is then the nearest configuration, `residual` (m, rad) how far it is.
    ///
    /// >>> robot.inverse_kinematics("arm", [0.6, 0, 0.2], q=[0.3, 0.3, 0.3]).shape
    /// (3,)
    /// >>> robot.inverse_kinematics("arm", [5.0, 0, 0], q=[0.3, 0.3, 0.3])  # doctest: +ELLIPSIS
    /// Traceback (most recent call last):
    /// linkwork.LinkworkError: ...
    /// >>> pointed = robot.inverse_kinematics("arm", [0.6, 0, 0.2], q=[0.3, 0.3, 0.3], axis=[1, 0, 0], along=[0, 0, 1], within=0.5)
    #[pyo3(signature = (part, at=None, q=None, *, in_base=false, position_tolerance=1e-9, orientation_tolerance=1e-9, steps=100, restarts=64, axis=None, along=None, look_at=None, within=0.0, plane=None, line=None))]
    #[allow(clippy::too_many_arguments)]
    fn inverse_kinematics<'py>(
        slf: &Bound<'py, Self>,
        part: &str,
        at: Option<Given<'_, 'py>>,
        q: Option<Given<'_, 'py>>,
        in_base: bool,
        position_tolerance: f64,
        orientation_tolerance: f64,
        steps: usize,
        restarts: usize,
        axis: Option<Given<'_, 'py>>,
        along: Option<Given<'_, 'py>>,
        look_at: Option<Given<'_, 'py>>,
        within: f64,
        plane: Option<Given<'_, 'py>>,
        line: Option<Given<'_, 'py>>,
    ) -> PyResult<Array1<'py>> {
        let parts = Parts { axis, along, look_at, within, plane, line };
        let tolerances = [position_tolerance, orientation_tolerance];
        Asked { part, at, q, in_base, tolerances, steps, restarts, parts }.solve(slf)
    }

    /// The search of `inverse_kinematics`, with the same arguments, begun and not gone on with: `advance` of it does all the work, in portions of evaluations of the kinematics. It begins at q (nq,; None: the robot's own), with at and
    /// all else as of `inverse_kinematics`: m and rad. Raises LinkworkError for what that refuses; that no start leads there is told by the search.
    ///
    /// >>> search = robot.begin_inverse_kinematics("arm", [0.6, 0, 0.2], q=[0.3, 0.3, 0.3])
    /// >>> while not search.advance(100):
    /// ...     pass
    /// >>> robot.q = search.solution()
    /// >>> robot.tip_pose("arm")[:3, 3].round(6).tolist()
    /// [0.6, 0.0, 0.2]
    #[pyo3(signature = (part, at=None, q=None, *, in_base=false, position_tolerance=1e-9, orientation_tolerance=1e-9, steps=100, restarts=64, axis=None, along=None, look_at=None, within=0.0, plane=None, line=None))]
    #[allow(clippy::too_many_arguments)]
    fn begin_inverse_kinematics<'py>(
        slf: &Bound<'py, Self>,
        part: &str,
        at: Option<Given<'_, 'py>>,
        q: Option<Given<'_, 'py>>,
        in_base: bool,
        position_tolerance: f64,
        orientation_tolerance: f64,
        steps: usize,
        restarts: usize,
        axis: Option<Given<'_, 'py>>,
        along: Option<Given<'_, 'py>>,
        look_at: Option<Given<'_, 'py>>,
        within: f64,
        plane: Option<Given<'_, 'py>>,
        line: Option<Given<'_, 'py>>,
    ) -> PyResult<InverseKinematicsSearch> {
        let parts = Parts { axis, along, look_at, within, plane, line };
        let tolerances = [position_tolerance, orientation_tolerance];
        Asked { part, at, q, in_base, tolerances, steps, restarts, parts }.search(slf)
    }

    /// Of the configurations (nq,), in rad and m, in which the tip of a chain is where it is to be, within limits, the one that is liked best of those that `starts` searches find: (q, cost). The chain
    /// alone moves, from q (nq,; None: the robot's own) and from other places, the same ones each time; each solution is improved along the null space to a local minimum of
    ///
    /// cost = centred ½ Σ ((q − middle)/(upper − lower))² + near ½ Σ ((q − q₀)/(upper − lower))² − manipulable ln w,
    ///
    /// with the middle of the limits, q₀ the q that is given, and w of `manipulability(part, length=length)`. at, in_base, axis, along, look_at, within, plane, line: as of `inverse_kinematics`. improve: evaluations of
    /// the kinematics for each solution, at most. Raises LinkworkError where no start led there, its attribute `q` the configuration that came of the last one, and for weights that are negative or all zero.
    ///
    /// >>> first = robot.inverse_kinematics("arm", [0.6, 0, 0.2], q=[0.3, 0.3, 0.3])
    /// >>> best, cost = robot.inverse_kinematics_best("arm", [0.6, 0, 0.2], q=[0.3, 0.3, 0.3], starts=8)
    /// >>> bool(cost <= 0.5 * ((first / 6) ** 2).sum())     # limits of −3 … 3 rad
    /// True
    #[pyo3(signature = (part, at=None, q=None, *, centred=1.0, near=0.0, manipulable=0.0, length=1.0, starts=8, improve=400, in_base=false, axis=None, along=None, look_at=None, within=0.0, plane=None, line=None))]
    #[allow(clippy::too_many_arguments)]
    fn inverse_kinematics_best<'py>(
        slf: &Bound<'py, Self>,
        part: &str,
        at: Option<Given<'_, 'py>>,
        q: Option<Given<'_, 'py>>,
        centred: f64,
        near: f64,
        manipulable: f64,
        length: f64,
        starts: usize,
        improve: usize,
        in_base: bool,
        axis: Option<Given<'_, 'py>>,
        along: Option<Given<'_, 'py>>,
        look_at: Option<Given<'_, 'py>>,
        within: f64,
        plane: Option<Given<'_, 'py>>,
        line: Option<Given<'_, 'py>>,
    ) -> PyResult<(Array1<'py>, f64)> {
        let (own, name) = (base(slf), part);
        let part = own.part(name)?;
        let goal = Parts { axis, along, look_at, within, plane, line }.goal(at, "at")?;
        count_of("starts", starts)?;
        count_of("improve", improve)?;
        let prefer = Prefer { centred, near, manipulable, length, starts, steps: improve };
        let mut q = own.q_or_own(q)?;
        let mut robot = lock(&own.robot).clone();
        let search = || {
            robot.inverse_kinematics_best(
                part,
                &goal,
                frame(in_base),
                &prefer,
                &Effort::default(),
                &mut q,
            )
        };
        let best = slf.py().detach(search).map_err(refuse)?;
        let q = out1(slf.py(), q);
        if best.outcome == Outcome::Met {
            return Ok((q, best.cost));
        }
        let fact = format!("none of {starts} starts brings the tip of `{name}` there");
        let error = refuse_with(fact, "give more `starts`, another q, or ask for less");
        error.value(slf.py()).setattr("q", q)?;
        Err(error)
    }

    /// All configurations (k, nq), within limits, in which the tip of an arm of six or seven hinges is where it is to be, the nearest to q (nq,; None: the
    /// robot's own) first, by a closed form; (0, nq) when there is none. at: (7,) position and attitude, or (4, 4) a pose; in the world, or in the chain's
    /// base with in_base. Of seven hinges one is held at its value in q: `held` (its place in v, of `dofs`), or one that is chosen. Each solution meets the pose within 1e-9 m and rad.
    /// Raises LinkworkError for a chain without a closed form (a wrist or shoulder of three axes that meet in a point, or three parallel axes in the
    /// middle, have one), and for a place that is no pose.
    ///
    /// >>> arm, parent = linkwork.Builder(), "world"
    /// >>> hinges = [([0, 0, 1], [0, 0, 0]), ([0, 1, 0], [0, 0, 0]), ([0, 1, 0], [0.43, 0.15, 0]), ([1, 0, 0], [0.43, 0, 0]), ([0, 1, 0], [0, 0, 0]), ([1, 0, 0], [0, 0, 0])]
    /// >>> for k, (axis, at) in enumerate(hinges):
    /// ...     arm = arm.body(f"link{k}", parent, linkwork.Hinge.pin(axis), mass=1, inertia=np.eye(3) / 100, hinge_in_parent=at)
    /// ...     parent = f"link{k}"
    /// >>> puma = linkwork.Robot(arm.build(), chains={"arm": ("world", "link5")}, colliders=[])
    /// >>> puma.q = [0.3, -0.4, 0.9, 0.7, 0.8, -0.5]
    /// >>> every = puma.inverse_kinematics_all("arm", puma.tip_pose("arm"))
    /// >>> every.shape, bool(abs(every[0] - puma.q).max() < 1e-9)
    /// ((8, 6), True)
    #[pyo3(signature = (part, at, q=None, *, held=None, in_base=false))]
    fn inverse_kinematics_all<'py>(
        slf: &Bound<'py, Self>,
        part: &str,
        at: Given<'_, 'py>,
        q: Option<Given<'_, 'py>>,
        held: Option<usize>,
        in_base: bool,
    ) -> PyResult<Array2<'py>> {
        let own = base(slf);
        let part = own.part(part)?;
        let (position, orientation) = place(at, "at")?;
        let goal = Goal { position, orientation, ..Goal::NOTHING };
        let q = own.q_or_own(q)?;
        let closed = own.model.closed_form(part, held).map_err(refuse)?;
        let mut out = vec![0.0; ClosedForm::MOST * q.len()];
        let count =
            own.ask(|r| r.inverse_kinematics_all(&closed, &goal, frame(in_base), &q, &mut out))?;
        out.truncate(count * q.len());
        out2(slf.py(), out, count, q.len())
    }

    /// Whether q (nq,), in rad and m, is within all limits and nothing touches: what sampling planners ask, such as OMPL's `setStateValidityChecker`. Raises LinkworkError
    /// for another length and for NaN.
    ///
    /// >>> robot.is_valid([0.1, 0.2, 0.3]), robot.is_valid([4.0, 0, 0])
    /// (True, False)
    fn is_valid(slf: &Bound<'_, Self>, q: Given<'_, '_>) -> PyResult<bool> {
        let own = base(slf);
        let q: Input<'_> = vector(q, own.model.nq(), "q")?;
        let mut within = q.slice().to_vec();
        own.ask(|r| r.clamp(&mut within))?;
        if within != q.slice() {
            return Ok(false);
        }
        Ok(!own.ask(|r| r.collides(q.slice()))?)
    }

    /// A free way of a chain from start (nq,; None: the robot's own q) to goal (nq,): configurations (n, nq), rad and m, between which all coordinates move in
    /// proportion, each piece proven free. Only the chain's coordinates may differ. Two trees grow towards each other (RRT-Connect), with pieces of `step` at
    /// most (rad, m) and room for so many configurations each; the same seed gives the same way. Raises LinkworkError when an end touches something or is
    /// outside limits, and when the room was used up: there may be a way, or none.
    ///
    /// >>> robot.plan("arm", [0.5, 0.5, 0.5], start=[0, 0, 0]).shape
    /// (2, 3)
    #[pyo3(signature = (part, goal, start=None, *, seed=1, step=0.5, room=2000))]
    fn plan<'py>(
        slf: &Bound<'py, Self>,
        part: &str,
        goal: Given<'_, 'py>,
        start: Option<Given<'_, 'py>>,
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
            let help = "a search looks through all of them each time: give 1000000 at most";
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
            refuse_with(format!("`{a}` touches `{b}` at the {end}"), "choose a free end")
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
                format!("no way of `{name}` was found with {room} configurations"),
                "give more `room`, another `step` or `seed`; there may be no way",
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
