//! `Collisions`: collision queries of a robot with itself and with its surroundings, at one configuration or at many.
//!
//! `linkwork_embedded::Robot` computes them. Changes of the colliders are in a submodule.
use crate::array::{Array2, Input, out2};
use crate::constraints::CLOSED;
use crate::contact::{Collider, chosen};
use crate::core::{Core, lock};
use crate::error::{refuse, refuse_with};
use crate::mechanism::Mechanism;
use linkwork_collision::{ColliderId, Distance};
use linkwork_embedded::{
    self as embedded, ModelSpec, Path, PathProgress, Robot, RobotError, RobotModel, Visibility,
};
use linkwork_multibody::{Builder, ConstraintId};
use linkwork_runtime::remedy;
use numpy::PyArray1;
use pyo3::prelude::*;
use std::sync::{Arc, Mutex};

mod changes;

/// Numbers of path pieces and of configurations between two checks for Ctrl-C.
const PIECES: usize = 1000;
const ROWS: usize = 1 << 15;

type ArrayLike<'a, 'py> = &'a Bound<'py, PyAny>;
type Pair = (String, String);

/// Collision queries for a robot and its surroundings, at one configuration, at many, or along a straight path in joint space.
///
/// Bodies that are connected by a loop or by a hinge of fewer than six degrees of freedom do not collide (nor do the world and the bodies on it),
/// unless `neighbours` is "collide" instead of "pass".
///
/// Parameters
/// ----------
/// mechanism : Mechanism
///     The robot.
/// colliders : sequence of Collider, optional
///     The shapes. By default those of the file (`Mechanism.file_colliders`); for a RON file also its collision rules, which the arguments
///     override.
/// ignore, collide : sequence of (str, str), optional
///     Pairs of colliders or bodies, by name, that do not collide, and that do.
/// neighbours : {"pass", "collide"}, optional
///     See above.
///
/// Raises
/// ------
/// LinkworkError
///     If a shape or a name is not valid, the mechanism has flexible bodies, or a motion across a loop is prescribed.
///
/// Notes
/// -----
/// Configurations must close loops and couplings to 1e-6 m and rad (see `Mechanism.close`); others raise an error. `path` supports couplings, but
/// not loops, because a straight path in joint space opens them.
///
/// Queries are conservative: every contact or overlap is a hit, including padding. Settings and sensor data (`set_points`, `set_cells`) belong to
/// this object, and `copy` copies them.
///
/// Examples
/// --------
/// >>> import linkwork
/// >>> arm = linkwork.Builder().body("arm", "world", linkwork.Hinge.pin([0, 0, 1]), mass=1.0, com=[0.5, 0, 0], inertia=[[1, 0, 0], [0, 1, 0], [0, 0, 1]]).build()
/// >>> rod = linkwork.Collider.capsule("rod", "arm", 0.05, 1.0, at=[0.5, 0, 0, 0, 0.5**0.5, 0, 0.5**0.5])
/// >>> seen = linkwork.Collider.point_cloud("seen", "world", room=1000)
/// >>> robot = linkwork.Collisions(arm, [rod, seen], neighbours="collide")
/// >>> robot.set_points("seen", [[0.0, 0.8, 0.0, 0.01]])
/// >>> robot.collides([[0.0], [1.4], [1.6]]).tolist()
/// [False, False, True]
#[pyclass(frozen, subclass, weakref, module = "linkwork")]
pub struct Collisions {
    core: Arc<Core>,
    pub(crate) model: Arc<RobotModel>,
    pub(crate) robot: Mutex<Robot>,
}

/// Returns the nearest points of two colliders (2, 3); the first row is on the first collider.
fn ends<'py>(py: Python<'py>, d: &Distance) -> PyResult<Array2<'py>> {
    let points = [d.point_a, d.point_b].iter().flat_map(|p| [p.x, p.y, p.z]).collect();
    out2(py, points, 2, 3)
}

/// Reads cell indices (n, 3).
fn cells(given: ArrayLike<'_, '_>) -> PyResult<Vec<[u32; 3]>> {
    let input = Input::read(given, "cells")?;
    if !matches!(*input.shape(), [_, 3]) && !input.slice().is_empty() {
        let fact = format!("`cells` has the shape {:?}", input.shape());
        return Err(refuse_with(fact, "give it the shape (n, 3): indices along x, y, z"));
    }
    let index = |x: f64| {
        let whole = x.fract() == 0.0 && (0.0..=f64::from(u32::MAX)).contains(&x);
        let wrong =
            || refuse_with(format!("`cells` has the index {x}"), "give integers, 0 or larger");
        if whole { Ok(x as u32) } else { Err(wrong()) }
    };
    let all = input.slice().chunks_exact(3);
    all.map(|c| Ok([index(c[0])?, index(c[1])?, index(c[2])?])).collect()
}

/// Reads points (n, 4): x, y, z, radius.
pub fn balls(given: ArrayLike<'_, '_>) -> PyResult<Vec<[f64; 4]>> {
    let input = Input::read(given, "points")?;
    if !matches!(*input.shape(), [_, 4]) && !input.slice().is_empty() {
        let fact = format!("`points` has the shape {:?}", input.shape());
        return Err(refuse_with(fact, "give it the shape (n, 4): x, y, z, radius of each"));
    }
    Ok(input.slice().chunks_exact(4).map(|p| [p[0], p[1], p[2], p[3]]).collect())
}

/// Reads the indices of the occupied cells of a collider.
pub fn occupied(given: Option<ArrayLike<'_, '_>>) -> PyResult<Vec<[u32; 3]>> {
    given.map_or(Ok(Vec::new()), cells)
}

impl Collisions {
    /// Creates the queries for a model of this mechanism.
    pub(crate) fn of(core: Arc<Core>, spec: &ModelSpec) -> PyResult<Self> {
        let model = RobotModel::new(spec).map_err(refuse)?;
        let mut robot = Robot::new(&model);
        robot.set_gravity(core.gravity()).map_err(refuse)?;
        Ok(Self { core, model, robot: Mutex::new(robot) })
    }

    fn id(&self, name: &str) -> PyResult<ColliderId> {
        self.model.collider(name).ok_or_else(|| {
            let known: Vec<&str> = self.model.colliders().map(|c| c.1).collect();
            refuse_with(format!("there is no collider `{name}`"), remedy(name, "colliders", &known))
        })
    }

    /// Returns the colliders that a name stands for: a collider, or all colliders of a part, an object or a body.
    fn meant(&self, name: &str) -> PyResult<Vec<ColliderId>> {
        let model = &self.model;
        if let Some(id) = model.collider(name) {
            return Ok(vec![id]);
        }
        let all: Vec<ColliderId> = match (model.part(name), model.object(name)) {
            (Some(part), _) => model.colliders_of_part(part).map_err(refuse)?.collect(),
            (None, Some(object)) => model.colliders_of_object(object).map_err(refuse)?.collect(),
            (None, None) => {
                let on = |id: &ColliderId| model.collider_spec(*id).body == name;
                model.colliders().map(|c| c.0).filter(on).collect()
            }
        };
        if !all.is_empty() {
            return Ok(all);
        }
        let bodies = model.colliders().map(|c| model.collider_spec(c.0).body.as_str());
        let parts = model.parts().map(|p| p.1).chain(model.objects().map(|o| o.1));
        let mut known: Vec<&str> =
            model.colliders().map(|c| c.1).chain(parts).chain(bodies).collect();
        known.sort_unstable();
        known.dedup();
        let fact = format!("there is no collider, part, object or body with colliders `{name}`");
        Err(refuse_with(fact, remedy(name, "names", &known)))
    }

    pub(crate) fn names(&self, (a, b): (ColliderId, ColliderId)) -> Pair {
        (self.model.collider_name(a).to_owned(), self.model.collider_name(b).to_owned())
    }

    fn set_visibility(&self, name: &str, visibility: Visibility) -> PyResult<()> {
        let ids = self.meant(name)?;
        self.ask(|r| ids.into_iter().try_for_each(|id| r.show(id, visibility)))
    }

    pub(crate) fn ask<R>(
        &self,
        ask: impl FnOnce(&mut Robot) -> Result<R, RobotError>,
    ) -> PyResult<R> {
        ask(&mut lock(&self.robot)).map_err(refuse)
    }

    /// Reads a configuration (nq,) that satisfies loops and couplings.
    fn at<'py>(&self, q: ArrayLike<'_, 'py>, what: &str) -> PyResult<Input<'py>> {
        let q = self.core.configuration(q, what)?;
        closed(&self.core, q.slice()).map_err(|e| open(&self.core, &format!("`{what}`"), e))?;
        Ok(q)
    }
}

/// The problem with a row of configurations.
enum Problem {
    Open(usize, Opened),
    Refused(RobotError),
}

/// The constraint with the largest closure error, and the error, if it is above the tolerance.
type Opened = (ConstraintId, f64);

/// Returns an error if q (nq) does not satisfy loops and couplings.
fn closed(core: &Core, q: &[f64]) -> Result<(), Opened> {
    if !core.is_constrained() {
        return Ok(());
    }
    let worst = core.errors(q, &[]).into_iter().max_by(|a, b| a.1.total_cmp(&b.1));
    worst.filter(|(_, error)| !(*error <= CLOSED)).map_or(Ok(()), Err)
}

fn open(core: &Core, place: &str, (id, error): Opened) -> PyErr {
    let name = core.mbs.constraint_name(id);
    let fact =
        format!("{place} violates the constraint `{name}`: closure error {error:.3e} (m or rad)");
    refuse_with(fact, "give a configuration that satisfies the constraints: `mechanism.close(q)`")
}

#[pymethods]
impl Collisions {
    #[new]
    #[pyo3(signature = (mechanism, colliders=None, *, ignore=None, collide=None, neighbours=None))]
    fn new(
        mechanism: &Mechanism,
        colliders: Option<Vec<PyRef<'_, Collider>>>,
        ignore: Option<Vec<[String; 2]>>,
        collide: Option<Vec<[String; 2]>>,
        neighbours: Option<&str>,
    ) -> PyResult<Self> {
        let core = mechanism.core.clone();
        if core.mbs.motions() > 0 {
            let help = "use a hinge without prescribed motion for the loop";
            return Err(refuse_with("a motion across a loop is prescribed", help));
        }
        let (specs, rules) = chosen(mechanism, colliders, ignore, collide, neighbours)?;
        // Collision queries need only q, and every query checks that q satisfies loops and couplings, so the constraints are removed here.
        let mut mechanism = Builder::from(&core.mbs);
        mechanism.loops_mut().clear();
        mechanism.couplings_mut().clear();
        let spec = ModelSpec { mechanism, colliders: specs, rules, ..ModelSpec::default() };
        Self::of(core, &spec)
    }

    /// Return an independent copy with the same settings and obstacles.
    ///
    /// Returns
    /// -------
    /// Collisions
    ///     The copy.
    ///
    /// Examples
    /// --------
    /// >>> other = robot.copy()
    /// >>> other.set_points("seen", [])
    /// >>> robot.count("seen"), other.count("seen")
    /// (1, 0)
    pub(crate) fn copy(&self) -> Self {
        let robot = Mutex::new(lock(&self.robot).clone());
        Self { core: self.core.clone(), model: self.model.clone(), robot }
    }

    /// Names of the colliders, sorted.
    ///
    /// Examples
    /// --------
    /// >>> robot.colliders
    /// ['rod', 'seen']
    #[getter]
    fn colliders(&self) -> Vec<&str> {
        self.model.colliders().map(|c| c.1).collect()
    }

    /// Test whether anything touches or overlaps, at one configuration or at many.
    ///
    /// Parameters
    /// ----------
    /// q : array_like, shape (nq,) or (n, nq)
    ///     Configuration, rad and m, or one per row.
    /// threads : int
    ///     Number of threads for many configurations. The result does not depend on it.
    ///
    /// Returns
    /// -------
    /// bool or ndarray of bool, shape (n,)
    ///     True for a collision.
    ///
    /// Raises
    /// ------
    /// LinkworkError
    ///     If an array has a wrong shape or contains NaN.
    ///
    /// Examples
    /// --------
    /// >>> robot.collides([[0.0], [1.6]], threads=2).tolist()
    /// [False, True]
    #[pyo3(signature = (q, *, threads=1))]
    fn collides<'py>(
        &self,
        py: Python<'py>,
        q: ArrayLike<'_, 'py>,
        threads: usize,
    ) -> PyResult<Bound<'py, PyAny>> {
        let input = Input::read(q, "q")?;
        let nq = self.model.nq();
        if input.shape().len() != 2 {
            let q = self.at(q, "q")?;
            let hit = self.ask(|r| r.collides(q.slice()))?;
            return Ok(hit.into_pyobject(py)?.to_owned().into_any());
        }
        let [n, width] = *input.shape() else { return Err(refuse("`q` is not a matrix")) };
        if width != nq {
            let fact = format!("`q` has {width} numbers per row, the mechanism has {nq}");
            return Err(refuse_with(fact, format!("give it the shape (n, {nq})")));
        }
        self.core.attitudes(input.slice())?;
        let threads = crate::batch::checked(threads)?.min(n.max(1));
        let mut out = vec![false; n];
        let values = input.slice();
        let mut robots = vec![lock(&self.robot).clone(); threads];
        for (k, block) in out.chunks_mut(ROWS).enumerate() {
            py.check_signals()?;
            let (from, n) = (k * ROWS, block.len());
            py.detach(|| {
                for k in from..from + n {
                    let q = &values[k * nq..(k + 1) * nq];
                    closed(&self.core, q).map_err(|e| Problem::Open(k, e))?;
                }
                let q = &values[from * nq..(from + n) * nq];
                embedded::collides_all(&mut robots, q, block).map_err(Problem::Refused)
            })
            .map_err(|e| match e {
                Problem::Open(k, e) => open(&self.core, &format!("row {k} of `q`"), e),
                Problem::Refused(e) => refuse(e),
            })?;
        }
        Ok(PyArray1::from_vec(py, out).into_any())
    }

    /// Return the names of two colliders that touch, or None.
    ///
    /// Equal configurations give equal pairs.
    ///
    /// Parameters
    /// ----------
    /// q : array_like, shape (nq,)
    ///     Configuration, rad and m.
    ///
    /// Returns
    /// -------
    /// tuple of str, or None
    ///     The two names.
    ///
    /// Raises
    /// ------
    /// LinkworkError
    ///     If an array has a wrong shape or contains NaN.
    ///
    /// Examples
    /// --------
    /// >>> robot.first_hit([1.6])
    /// ('rod', 'seen')
    fn first_hit(&self, q: ArrayLike<'_, '_>) -> PyResult<Option<Pair>> {
        let q = self.at(q, "q")?;
        Ok(self.ask(|r| r.first_hit(q.slice()))?.map(|pair| self.names(pair)))
    }

    /// Return the names of all pairs of colliders that touch, sorted.
    ///
    /// Parameters
    /// ----------
    /// q : array_like, shape (nq,)
    ///     Configuration, rad and m.
    ///
    /// Returns
    /// -------
    /// list of tuple of str
    ///     The pairs.
    ///
    /// Raises
    /// ------
    /// LinkworkError
    ///     If an array has a wrong shape or contains NaN.
    ///
    /// Examples
    /// --------
    /// >>> robot.hits([0.0])
    /// []
    fn hits(&self, q: ArrayLike<'_, '_>) -> PyResult<Vec<Pair>> {
        let q = self.at(q, "q")?;
        let mut out = Vec::new();
        self.ask(|r| r.hits(q.slice(), &mut out))?;
        Ok(out.into_iter().map(|pair| self.names(pair)).collect())
    }

    /// Return the nearest pair of colliders within a distance, or None.
    ///
    /// Only pairs that are checked for collision count.
    ///
    /// Parameters
    /// ----------
    /// q : array_like, shape (nq,)
    ///     Configuration, rad and m.
    /// limit : float
    ///     Largest distance, m.
    ///
    /// Returns
    /// -------
    /// distance : float
    ///     Distance minus padding, m; negative for overlap.
    /// pair : tuple of str
    ///     The two names.
    /// points : ndarray, shape (2, 3)
    ///     The nearest points, world axes, m.
    ///
    /// Raises
    /// ------
    /// LinkworkError
    ///     If q has a wrong length or contains NaN, or `limit` is NaN.
    ///
    /// Examples
    /// --------
    /// >>> robot.clearance([1.6], limit=0.5)[1]
    /// ('rod', 'seen')
    #[pyo3(signature = (q, limit=f64::INFINITY))]
    fn clearance<'py>(
        &self,
        py: Python<'py>,
        q: ArrayLike<'_, 'py>,
        limit: f64,
    ) -> PyResult<Option<(f64, Pair, Array2<'py>)>> {
        let q = self.at(q, "q")?;
        let found = self.ask(|r| r.clearance(q.slice(), limit))?;
        let told = |c: linkwork_collision::Closest| {
            Ok((c.distance.distance, self.names((c.a, c.b)), ends(py, &c.distance)?))
        };
        found.map(told).transpose()
    }

    /// Return the distance of two colliders, whether the pair is checked for collision or not.
    ///
    /// Parameters
    /// ----------
    /// q : array_like, shape (nq,)
    ///     Configuration, rad and m.
    /// a, b : str
    ///     Names of the colliders.
    ///
    /// Returns
    /// -------
    /// distance : float
    ///     Distance minus padding, m.
    /// points : ndarray, shape (2, 3)
    ///     The nearest points, world axes, m. The result is None if there is no distance: for two half spaces, or for an empty point cloud.
    ///
    /// Raises
    /// ------
    /// LinkworkError
    ///     If a name does not exist, or q has a wrong length or contains NaN.
    ///
    /// Examples
    /// --------
    /// >>> d, ends = robot.distance([0.0], "rod", "seen")
    /// >>> ends.shape
    /// (2, 3)
    fn distance<'py>(
        &self,
        py: Python<'py>,
        q: ArrayLike<'_, 'py>,
        a: &str,
        b: &str,
    ) -> PyResult<Option<(f64, Array2<'py>)>> {
        let q = self.at(q, "q")?;
        let (a, b) = (self.id(a)?, self.id(b)?);
        let found = self.ask(|r| r.distance(q.slice(), a, b))?;
        found.map(|d| Ok((d.distance, ends(py, &d)?))).transpose()
    }

    /// Return the distances of all checked pairs within a limit.
    ///
    /// The cost grows with the number of pairs. `clearance` is faster if you need only the nearest pair.
    ///
    /// Parameters
    /// ----------
    /// q : array_like, shape (nq,)
    ///     Configuration, rad and m.
    /// limit : float
    ///     Largest distance, m.
    ///
    /// Returns
    /// -------
    /// list of tuple
    ///     (distance, pair, points (2, 3)) as in `clearance`, sorted by name.
    ///
    /// Raises
    /// ------
    /// LinkworkError
    ///     If q has a wrong length or contains NaN, or `limit` is NaN.
    ///
    /// Examples
    /// --------
    /// >>> robot.show("seen")
    /// >>> [(round(d, 3), pair) for d, pair, ends in robot.distances([0.0])]
    /// [(0.74, ('rod', 'seen'))]
    #[pyo3(signature = (q, limit=f64::INFINITY))]
    fn distances<'py>(
        &self,
        py: Python<'py>,
        q: ArrayLike<'_, 'py>,
        limit: f64,
    ) -> PyResult<Vec<(f64, Pair, Array2<'py>)>> {
        let q = self.at(q, "q")?;
        let mut out = Vec::new();
        self.ask(|r| r.distances(q.slice(), limit, &mut out))?;
        let told = |c: &linkwork_collision::Closest| {
            Ok((c.distance.distance, self.names((c.a, c.b)), ends(py, &c.distance)?))
        };
        out.iter().map(told).collect()
    }

    /// Test whether the straight path in joint space between two configurations is collision-free.
    ///
    /// The proof covers the whole path, so obstacles cannot be missed however thin they are.
    ///
    /// Parameters
    /// ----------
    /// start, end : array_like, shape (nq,)
    ///     Configurations, rad and m.
    /// least : float
    ///     Smallest piece of the path that is subdivided, as a fraction of the path, from 1e-9 to 1.
    ///
    /// Returns
    /// -------
    /// outcome : str
    ///     "free"; "hit"; or "undecided", if surfaces pass each other too closely for a decision.
    /// part : float or None
    ///     Fraction of the path, from 0 to 1, at which it is hit or undecided.
    /// pair : tuple of str, or None
    ///     The names of the colliders of a hit.
    ///
    /// Raises
    /// ------
    /// LinkworkError
    ///     If the mechanism has loops, `least` is out of range, or a configuration has a wrong length or contains NaN.
    ///
    /// Examples
    /// --------
    /// >>> robot.path([0.0], [1.0])
    /// ('free', None, None)
    #[pyo3(signature = (start, end, least=1e-3))]
    fn path(
        &self,
        py: Python<'_>,
        start: ArrayLike<'_, '_>,
        end: ArrayLike<'_, '_>,
        least: f64,
    ) -> PyResult<(&'static str, Option<f64>, Option<Pair>)> {
        if let [l, ..] = self.core.mbs.loops() {
            let fact =
                format!("a straight path in joint space opens the loop `{}`", l.closure.name);
            let help =
                "call `collides` with configurations along the path that `mechanism.close` returns";
            return Err(refuse_with(fact, help));
        }
        // Couplings are linear, so they hold between the two ends if they hold at both.
        let (start, end) = (self.at(start, "start")?, self.at(end, "end")?);
        let (from, to) = (start.slice(), end.slice());
        let mut robot = lock(&self.robot).clone();
        let mut progress = PathProgress::default();
        let path = loop {
            py.check_signals()?;
            let portion = || robot.path_free_on(from, to, least, &mut progress, PIECES);
            if let Some(path) = py.detach(portion).map_err(refuse)? {
                break path;
            }
        };
        Ok(match path {
            Path::Free => ("free", None, None),
            Path::Hit { at, pair } => ("hit", Some(at), Some(self.names(pair))),
            Path::Undecided { at } => ("undecided", Some(at), None),
        })
    }

    fn __repr__(&self) -> String {
        let (bodies, colliders) = (self.core.mbs.bodies().len(), self.model.colliders().len());
        format!("Collisions({bodies} bodies, {colliders} colliders)")
    }
}
