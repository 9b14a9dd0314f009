//! `Collisions`: whether a robot touches itself or what is around it, at one configuration or many; obstacles that change.
//!
//! The queries are those of `linkwork_embedded::Robot`.
use crate::array::{Array2, Input, out2};
use crate::constraints::CLOSED;
use crate::contact::{Collider, chosen};
use crate::core::{Core, lock};
use crate::error::{refuse, refuse_with};
use crate::mechanism::{Mechanism, choice};
use linkwork_collision::{ColliderId, Detail, Distance, Occupancy};
use linkwork_embedded::{
    self as embedded, ModelSpec, Path, PathProgress, Robot, RobotError, RobotModel, Visibility,
};
use linkwork_multibody::{Builder, ConstraintId};
use linkwork_runtime::remedy;
use numpy::PyArray1;
use pyo3::prelude::*;
use std::sync::{Arc, Mutex};

/// Pieces of a way, and rows of configurations, between two looks at Ctrl-C.
const PIECES: usize = 1000;
const ROWS: usize = 1 << 15;

type Given<'a, 'py> = &'a Bound<'py, PyAny>;
type Pair = (String, String);

/// Whether a robot touches itself or what is around it: at one configuration, at many, on the way between two.
///
/// colliders: the shapes; None takes those of the file (`Mechanism.file_colliders`), and of a file in RON also who meets whom, which what is given goes before.
/// Bodies that a loop or a hinge of fewer than six degrees of freedom joins do not meet (the world and what hangs on it, too), unless neighbours is "collide"
/// and not "pass". ignore, collide: pairs of names of colliders or bodies that do not meet, that do.
///
/// A mechanism with loops and couplings is asked at configurations that close them to 1e-6 m and rad (`Mechanism.close`); others are refused, since it cannot
/// be there. `path` is for couplings, not for loops: what moves in proportion opens them.
///
/// No contact is missed: what touches or overlaps is a hit, padding counted. The settings and what sensors saw (`set_points`, `set_cells`) are this
/// object's own, and go with `copy`. Raises LinkworkError for shapes and names that cannot be, for a mechanism with
/// flexible bodies, and for loops whose motion is prescribed.
///
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

/// Nearest points (2, 3) of two, the first's above the second's.
fn ends<'py>(py: Python<'py>, d: &Distance) -> PyResult<Array2<'py>> {
    let points = [d.point_a, d.point_b].iter().flat_map(|p| [p.x, p.y, p.z]).collect();
    out2(py, points, 2, 3)
}

/// Indices (n, 3).
fn cells(given: Given<'_, '_>) -> PyResult<Vec<[u32; 3]>> {
    let input = Input::read(given, "cells")?;
    if !matches!(*input.shape(), [_, 3]) && !input.slice().is_empty() {
        let fact = format!("`cells` has the shape {:?}", input.shape());
        return Err(refuse_with(fact, "give it the shape (n, 3): indices along x, y, z"));
    }
    let index = |x: f64| {
        let whole = x.fract() == 0.0 && (0.0..=f64::from(u32::MAX)).contains(&x);
        let wrong =
            || refuse_with(format!("`cells` has the index {x}"), "give whole numbers, 0 and above");
        if whole { Ok(x as u32) } else { Err(wrong()) }
    };
    let all = input.slice().chunks_exact(3);
    all.map(|c| Ok([index(c[0])?, index(c[1])?, index(c[2])?])).collect()
}

/// Points (n, 4): x, y, z, radius.
pub fn balls(given: Given<'_, '_>) -> PyResult<Vec<[f64; 4]>> {
    let input = Input::read(given, "points")?;
    if !matches!(*input.shape(), [_, 4]) && !input.slice().is_empty() {
        let fact = format!("`points` has the shape {:?}", input.shape());
        return Err(refuse_with(fact, "give it the shape (n, 4): x, y, z, radius of each"));
    }
    Ok(input.slice().chunks_exact(4).map(|p| [p[0], p[1], p[2], p[3]]).collect())
}

/// Indices of the occupied cells of a collider.
pub fn occupied(given: Option<Given<'_, '_>>) -> PyResult<Vec<[u32; 3]>> {
    given.map_or(Ok(Vec::new()), cells)
}

impl Collisions {
    /// Of a model of this mechanism.
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

    /// Those that a name means: a collider; all of a part, of an object or of a body.
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

    /// A configuration (nq,) that keeps loops and couplings.
    fn at<'py>(&self, q: Given<'_, 'py>, what: &str) -> PyResult<Input<'py>> {
        let q = self.core.configuration(q, what)?;
        closed(&self.core, q.slice()).map_err(|e| open(&self.core, &format!("`{what}`"), e))?;
        Ok(q)
    }
}

/// What is wrong with a row of configurations.
enum Problem {
    Open(usize, Opened),
    Refused(RobotError),
}

/// The constraint that is farthest from closed, when that is too far.
type Opened = (ConstraintId, f64);

/// Whether q (nq) keeps loops and couplings.
fn closed(core: &Core, q: &[f64]) -> Result<(), Opened> {
    if !core.is_constrained() {
        return Ok(());
    }
    let worst = core.errors(q, &[]).into_iter().max_by(|a, b| a.1.total_cmp(&b.1));
    worst.filter(|(_, error)| !(*error <= CLOSED)).map_or(Ok(()), Err)
}

fn open(core: &Core, place: &str, (id, error): Opened) -> PyErr {
    let name = core.mbs.constraint_name(id);
    let fact = format!("{place} does not keep `{name}`: an error of {error:.3e} (m or rad)");
    refuse_with(fact, "give a configuration that the mechanism can have: `mechanism.close(q)`")
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
            let help = "make the loop of a hinge without prescribed motion";
            return Err(refuse_with("a motion across a loop is prescribed", help));
        }
        let (specs, rules) = chosen(mechanism, colliders, ignore, collide, neighbours)?;
        // Where bodies are follows from q alone; that q keeps loops and couplings, every question checks.
        let mut mechanism = Builder::from(&core.mbs);
        mechanism.loops_mut().clear();
        mechanism.couplings_mut().clear();
        let spec = ModelSpec { mechanism, colliders: specs, rules, ..ModelSpec::default() };
        Self::of(core, &spec)
    }

    /// Another one with the same settings and obstacles; what changes in one afterwards does not in the other.
    ///
    /// >>> other = robot.copy()
    /// >>> other.set_points("seen", [])
    /// >>> robot.count("seen"), other.count("seen")
    /// (1, 0)
    pub(crate) fn copy(&self) -> Self {
        let robot = Mutex::new(lock(&self.robot).clone());
        Self { core: self.core.clone(), model: self.model.clone(), robot }
    }

    /// Names of the colliders, in the order of names.
    ///
    /// >>> robot.colliders
    /// ['rod', 'seen']
    #[getter]
    fn colliders(&self) -> Vec<&str> {
        self.model.colliders().map(|c| c.1).collect()
    }

    /// Whether anything touches or overlaps, at q (nq,): a bool; or at many, q (n, nq): an array of bool (n,), in so many threads. The number of threads changes
    /// no answer. Angles in rad, lengths in m.
    /// Raises LinkworkError for another shape and for NaN.
    ///
    /// >>> robot.collides([[0.0], [1.6]], threads=2).tolist()
    /// [False, True]
    #[pyo3(signature = (q, *, threads=1))]
    fn collides<'py>(
        &self,
        py: Python<'py>,
        q: Given<'_, 'py>,
        threads: usize,
    ) -> PyResult<Bound<'py, PyAny>> {
        let input = Input::read(q, "q")?;
        let nq = self.model.nq();
        if input.shape().len() != 2 {
            let q = self.at(q, "q")?;
            let hit = self.ask(|r| r.collides(q.slice()))?;
            return Ok(hit.into_pyobject(py)?.to_owned().into_any());
        }
        let [n, width] = *input.shape() else { return Err(refuse("a matrix without two sides")) };
        if width != nq {
            let fact = format!("`q` has {width} numbers in a row, the mechanism has {nq}");
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

    /// Names of two that touch at q (nq,), or None. The same q gives the same pair. Angles in rad, lengths in m.
    /// Raises LinkworkError for another length and for NaN.
    ///
    /// >>> robot.first_hit([1.6])
    /// ('rod', 'seen')
    fn first_hit(&self, q: Given<'_, '_>) -> PyResult<Option<Pair>> {
        let q = self.at(q, "q")?;
        Ok(self.ask(|r| r.first_hit(q.slice()))?.map(|pair| self.names(pair)))
    }

    /// Names of all pairs that touch at q (nq,), in the order of names. Angles in rad, lengths in m.
    /// Raises LinkworkError for another length and for NaN.
    ///
    /// >>> robot.hits([0.0])
    /// []
    fn hits(&self, q: Given<'_, '_>) -> PyResult<Vec<Pair>> {
        let q = self.at(q, "q")?;
        let mut out = Vec::new();
        self.ask(|r| r.hits(q.slice(), &mut out))?;
        Ok(out.into_iter().map(|pair| self.names(pair)).collect())
    }

    /// The nearest pair that meets at q (nq,), within a limit (m): its distance (m), padding taken off, negative when it overlaps; its names; and nearest
    /// points (2, 3), m, world axes. None when nothing is so near.
    /// Raises LinkworkError for another length, for NaN and a limit that is NaN.
    ///
    /// >>> robot.clearance([1.6], limit=0.5)[1]
    /// ('rod', 'seen')
    #[pyo3(signature = (q, limit=f64::INFINITY))]
    fn clearance<'py>(
        &self,
        py: Python<'py>,
        q: Given<'_, 'py>,
        limit: f64,
    ) -> PyResult<Option<(f64, Pair, Array2<'py>)>> {
        let q = self.at(q, "q")?;
        let found = self.ask(|r| r.clearance(q.slice(), limit))?;
        let told = |c: linkwork_collision::Closest| {
            Ok((c.distance.distance, self.names((c.a, c.b)), ends(py, &c.distance)?))
        };
        found.map(told).transpose()
    }

    /// The distance of two colliders at q (nq,), m, whether they meet or not, padding taken off, and nearest points (2, 3), m, world axes. None when there is
    /// none: two half spaces, a cloud without points.
    /// Raises LinkworkError for another length, for NaN and for names that are not there.
    ///
    /// >>> d, ends = robot.distance([0.0], "rod", "seen")
    /// >>> ends.shape
    /// (2, 3)
    fn distance<'py>(
        &self,
        py: Python<'py>,
        q: Given<'_, 'py>,
        a: &str,
        b: &str,
    ) -> PyResult<Option<(f64, Array2<'py>)>> {
        let q = self.at(q, "q")?;
        let (a, b) = (self.id(a)?, self.id(b)?);
        let found = self.ask(|r| r.distance(q.slice(), a, b))?;
        found.map(|d| Ok((d.distance, ends(py, &d)?))).transpose()
    }

    /// The distances of all pairs that meet at q (nq,), within a limit (m): a list of what `clearance` gives of one, in the order of names. Its work grows with
    /// the pairs; where the nearest alone is wanted, `clearance` is faster.
    /// Raises LinkworkError for another length, for NaN and a limit that is NaN.
    ///
    /// >>> robot.show("seen")
    /// >>> [(round(d, 3), pair) for d, pair, ends in robot.distances([0.0])]
    /// [(0.74, ('rod', 'seen'))]
    #[pyo3(signature = (q, limit=f64::INFINITY))]
    fn distances<'py>(
        &self,
        py: Python<'py>,
        q: Given<'_, 'py>,
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

    /// Which shapes questions are about from now on: "fine", as at first, or "coarse", those of `Collider.with_coarse`; where a collider has none, its fine shape.
    /// of: a name as in `pad`; None: all colliders. Raises LinkworkError for another word and for a name that is not there.
    ///
    /// >>> rough = rod.with_coarse(linkwork.Collider.sphere("rough", "arm", 0.6, at=[0.5, 0, 0, 0, 0.5**0.5, 0, 0.5**0.5]))
    /// >>> both = linkwork.Collisions(arm, [rough, linkwork.Collider.sphere("stone", "world", 0.1, at=[0.5, 0.5, 0])], neighbours="collide")
    /// >>> both.set_detail("coarse", of="rod")
    /// >>> coarse = both.collides([0.0])
    /// >>> both.set_detail("fine")
    /// >>> coarse, both.collides([0.0])
    /// (True, False)
    #[pyo3(signature = (detail, *, of=None))]
    fn set_detail(&self, detail: &str, of: Option<&str>) -> PyResult<()> {
        let known = [("fine", Detail::Fine), ("coarse", Detail::Coarse)];
        let detail = choice("detail", detail, &known)?;
        let Some(name) = of else {
            lock(&self.robot).set_detail(detail);
            return Ok(());
        };
        let ids = self.meant(name)?;
        self.ask(|r| ids.into_iter().try_for_each(|id| r.set_detail_of(id, detail)))
    }

    /// Whether the way from one configuration (nq,) to another is free, all coordinates moving in proportion: ("free", None, None), proven from end to end;
    /// ("hit", part of the way from 0 to 1, pair); or ("undecided", part, None) where surfaces pass within a hair. Nothing is jumped over, however thin. Angles in rad, lengths in m.
    /// Pieces shorter than `least`, a part of the way, are not cut again.
    /// Raises LinkworkError for another length, for NaN, for `least` outside 1e-9 … 1, and for a mechanism with loops.
    ///
    /// >>> robot.path([0.0], [1.0])
    /// ('free', None, None)
    #[pyo3(signature = (start, end, least=1e-3))]
    fn path(
        &self,
        py: Python<'_>,
        start: Given<'_, '_>,
        end: Given<'_, '_>,
        least: f64,
    ) -> PyResult<(&'static str, Option<f64>, Option<Pair>)> {
        if let [l, ..] = self.core.mbs.loops() {
            let fact = format!("what moves in proportion opens the loop `{}`", l.closure.name);
            let help = "ask `collides` at configurations on the way that `mechanism.close` gives";
            return Err(refuse_with(fact, help));
        }
        // Couplings are linear: what keeps them at both ends keeps them between.
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

    /// Thickness around colliders from now on, m. name: a collider; else a part or an object of a `Robot`, or a body, and all colliders of it.
    /// Raises LinkworkError for a name that is not there, for padding that is negative or not finite, and for so much that two would touch at every configuration; then nothing has changed.
    ///
    /// >>> robot.pad("rod", 0.01)
    /// >>> robot.pad("arm", 0)
    fn pad(&self, name: &str, padding: f64) -> PyResult<()> {
        let ids = self.meant(name)?;
        self.ask(|r| r.pad_all(&ids, padding))
    }

    /// Colliders are left out from now on; `show` takes them in again. name: as in `pad`.
    /// Raises LinkworkError for a name that is not there.
    ///
    /// >>> robot.hide("seen")
    /// >>> robot.collides([1.6])
    /// False
    fn hide(&self, name: &str) -> PyResult<()> {
        self.set_visibility(name, Visibility::Hidden)
    }

    /// Colliders take part from now on. name: as in `pad`.
    /// Raises LinkworkError for a name that is not there.
    ///
    /// >>> robot.hide("seen")
    /// >>> robot.show("seen")
    /// >>> robot.collides([1.6])
    /// True
    fn show(&self, name: &str) -> PyResult<()> {
        self.set_visibility(name, Visibility::Shown)
    }

    /// A pair is looked at from now on (True), may touch (False), or is left to the rules again (None). a, b: names as in `pad`; of several colliders each with each.
    /// Raises LinkworkError for names that are not there.
    ///
    /// >>> robot.look_at("rod", "seen", False)
    /// >>> robot.collides([1.6])
    /// False
    #[pyo3(signature = (a, b, look))]
    fn look_at(&self, a: &str, b: &str, look: Option<bool>) -> PyResult<()> {
        let (a, b) = (self.meant(a)?, self.meant(b)?);
        let pairs = a.iter().flat_map(|a| b.iter().map(move |b| (*a, *b))).filter(|(a, b)| a != b);
        self.ask(|r| pairs.into_iter().try_for_each(|(a, b)| r.look_at(a, b, look)))
    }

    /// Whether a pair is looked at now when both are shown.
    /// Raises LinkworkError for names that are not there.
    ///
    /// >>> robot.looks_at("rod", "seen")
    /// True
    fn looks_at(&self, a: &str, b: &str) -> PyResult<bool> {
        let (a, b) = (self.id(a)?, self.id(b)?);
        self.ask(|r| r.looks_at(a, b))
    }

    /// Other points of a point cloud instead of those that it has: (n, 4), x, y, z, radius of each, m, in its frame. On an error those of before stay.
    /// Raises LinkworkError for more points than there is room for, negative radii, NaN, and a collider that is no point cloud.
    ///
    /// >>> robot.set_points("seen", [[0.5, 0.1, 0, 0.02], [0.6, 0.1, 0, 0.02]])
    /// >>> robot.count("seen")
    /// 2
    fn set_points(&self, collider: &str, points: Given<'_, '_>) -> PyResult<()> {
        let (id, points) = (self.id(collider)?, balls(points)?);
        self.ask(|r| r.set_points(id, &points))
    }

    /// Makes cells of a voxel map occupied or, with occupied=False, free: (n, 3), whole numbers from 0 along x, y, z. On an error nothing has changed. A cell has the map's edge in m.
    /// Raises LinkworkError for cells outside and a collider that is no voxel map.
    ///
    /// >>> grid = linkwork.Collider.voxel_map("grid", "world", cells=(10, 10, 10), edge=0.1)
    /// >>> mapped = linkwork.Collisions(arm, [rod, grid], neighbours="collide")
    /// >>> mapped.set_cells("grid", [[5, 0, 0], [6, 0, 0]])
    /// >>> mapped.count("grid")
    /// 2
    #[pyo3(signature = (collider, cells, *, occupied=true))]
    fn set_cells(&self, collider: &str, cells: Given<'_, '_>, occupied: bool) -> PyResult<()> {
        let (id, cells) = (self.id(collider)?, self::cells(cells)?);
        let to = if occupied { Occupancy::Occupied } else { Occupancy::Free };
        self.ask(|r| r.set_cells(id, &cells, to))
    }

    /// Makes all cells of a voxel map free.
    /// Raises LinkworkError for a collider that is no voxel map.
    ///
    /// >>> grid = linkwork.Collider.voxel_map("grid", "world", cells=(10, 10, 10), edge=0.1)
    /// >>> mapped = linkwork.Collisions(arm, [rod, grid], neighbours="collide")
    /// >>> mapped.set_cells("grid", [[5, 0, 0]])
    /// >>> mapped.clear_cells("grid")
    /// >>> mapped.count("grid")
    /// 0
    fn clear_cells(&self, collider: &str) -> PyResult<()> {
        let id = self.id(collider)?;
        self.ask(|r| r.clear_cells(id))
    }

    /// How many points a point cloud has now, or occupied cells a voxel map.
    /// Raises LinkworkError for any other collider.
    ///
    /// >>> robot.count("seen")
    /// 1
    fn count(&self, collider: &str) -> PyResult<usize> {
        let id = self.id(collider)?;
        self.ask(|r| r.count(id))
    }

    fn __repr__(&self) -> String {
        let (bodies, colliders) = (self.core.mbs.bodies().len(), self.model.colliders().len());
        format!("Collisions({bodies} bodies, {colliders} colliders)")
    }
}
