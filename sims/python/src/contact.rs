//! Contact of a `Mechanism`: shapes of its bodies, and a stepper of velocities and impulses.
//!
//! The equations and the solver are `linkwork_solvers::ContactStepper`; a step is of first order in `dt`.
use crate::array::{Array1, Array2, Input, fixed, out1, out2, pose, room, vec3, vector};
use crate::collisions::balls;
use crate::constraints::may_begin;
use crate::core::{Core, lock};
use crate::error::{refuse, refuse_with};
use crate::mechanism::{Mechanism, choice};
use crate::simulate::{Forces, Torque};
use linkwork_collision::{
    ColliderId, ColliderSpec, Colliders, Hiding, Material, Neighbours, Rules, Shape,
};
use linkwork_multibody::NodeId;
use linkwork_solvers::{ContactSettings, ContactStepper, JointLimits, StepReport, Treatment};
use linkwork_spatial::{Force, Vec3};
use numpy::PyArray1;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use std::sync::{Arc, Mutex};

type Given<'a, 'py> = &'a Bound<'py, PyAny>;

/// A shape on a body that touches others.
///
/// Made by `sphere`, `box`, `capsule`, `cylinder`, `half_space`, `hull`, `mesh`, `terrain`, `point_cloud`, `voxel_map`. Each takes a name of its own, the
/// body that carries it (or "world"), sizes in m, and by name: at, the shape's frame in the body ((3,), (7,) or (4, 4)); friction, Coulomb's
/// coefficient (of a pair: the geometric mean); restitution (of a pair: the larger). Sizes are checked by `Contact`.
///
/// >>> import linkwork
/// >>> linkwork.Collider.sphere("ball", "bob", 0.1, restitution=0.8)
/// Collider(ball on bob: Sphere { radius: 0.1 })
#[pyclass(frozen, weakref, module = "linkwork")]
pub struct Collider {
    /// What `linkwork_collision` takes.
    pub spec: ColliderSpec,
}

impl Collider {
    fn made(
        (name, body): (&str, &str),
        shape: Shape,
        at: Option<Given<'_, '_>>,
        (friction, restitution): (f64, f64),
    ) -> PyResult<Self> {
        let mut spec = ColliderSpec::new(name, body, shape).at(pose(at, "at")?);
        spec.material = Material { friction, restitution };
        Ok(Self { spec })
    }
}

#[pymethods]
impl Collider {
    /// A ball about the origin; radius in m.
    #[staticmethod]
    #[pyo3(signature = (name, body, radius, *, at=None, friction=0.5, restitution=0.0))]
    fn sphere(
        name: &str,
        body: &str,
        radius: f64,
        at: Option<Given<'_, '_>>,
        friction: f64,
        restitution: f64,
    ) -> PyResult<Self> {
        Self::made((name, body), Shape::Sphere { radius }, at, (friction, restitution))
    }
    /// A box about the origin; size (3,): whole edges along x, y, z, m.
    #[staticmethod]
    #[pyo3(name = "box", signature = (name, body, size, *, at=None, friction=0.5, restitution=0.0))]
    fn cuboid(
        name: &str,
        body: &str,
        size: Given<'_, '_>,
        at: Option<Given<'_, '_>>,
        friction: f64,
        restitution: f64,
    ) -> PyResult<Self> {
        let half = 0.5 * vec3(size, "size")?;
        Self::made((name, body), Shape::Box { half }, at, (friction, restitution))
    }
    /// All within a radius of a segment of this length on the z axis, about the origin, m.
    #[staticmethod]
    #[pyo3(signature = (name, body, radius, length, *, at=None, friction=0.5, restitution=0.0))]
    fn capsule(
        name: &str,
        body: &str,
        radius: f64,
        length: f64,
        at: Option<Given<'_, '_>>,
        friction: f64,
        restitution: f64,
    ) -> PyResult<Self> {
        let shape = Shape::Capsule { radius, half_length: 0.5 * length };
        Self::made((name, body), shape, at, (friction, restitution))
    }
    /// A cylinder about the z axis with flat ends, about the origin, m.
    #[staticmethod]
    #[pyo3(signature = (name, body, radius, length, *, at=None, friction=0.5, restitution=0.0))]
    fn cylinder(
        name: &str,
        body: &str,
        radius: f64,
        length: f64,
        at: Option<Given<'_, '_>>,
        friction: f64,
        restitution: f64,
    ) -> PyResult<Self> {
        let shape = Shape::Cylinder { radius, half_length: 0.5 * length };
        Self::made((name, body), shape, at, (friction, restitution))
    }
    /// All points with z ≤ 0 of its frame: the ground, on "world".
    #[staticmethod]
    #[pyo3(signature = (name, body="world", *, at=None, friction=0.5, restitution=0.0))]
    fn half_space(
        name: &str,
        body: &str,
        at: Option<Given<'_, '_>>,
        friction: f64,
        restitution: f64,
    ) -> PyResult<Self> {
        Self::made((name, body), Shape::HalfSpace, at, (friction, restitution))
    }
    /// The convex hull of points (n, 3), m.
    #[staticmethod]
    #[pyo3(signature = (name, body, points, *, at=None, friction=0.5, restitution=0.0))]
    fn hull(
        name: &str,
        body: &str,
        points: Given<'_, '_>,
        at: Option<Given<'_, '_>>,
        friction: f64,
        restitution: f64,
    ) -> PyResult<Self> {
        let shape = Shape::ConvexHull { points: places(points, "points")? };
        Self::made((name, body), shape, at, (friction, restitution))
    }
    /// Triangles (m, 3): places among the vertices (n, 3) (m), counter-clockwise seen from outside. Only the outside pushes.
    #[staticmethod]
    #[pyo3(signature = (name, body, vertices, triangles, *, at=None, friction=0.5, restitution=0.0))]
    fn mesh(
        name: &str,
        body: &str,
        vertices: Given<'_, '_>,
        triangles: Vec<[u32; 3]>,
        at: Option<Given<'_, '_>>,
        friction: f64,
        restitution: f64,
    ) -> PyResult<Self> {
        let shape = Shape::Mesh { vertices: places(vertices, "vertices")?, triangles };
        Self::made((name, body), shape, at, (friction, restitution))
    }
    /// Ground of heights (ny, nx), m, over a grid centred on the origin, solid below: `heights[j, i]` is at the i-th x and the j-th y; spacing (2,): of
    /// points along x and y, m.
    #[staticmethod]
    #[pyo3(signature = (name, heights, spacing, body="world", *, at=None, friction=0.5, restitution=0.0))]
    fn terrain(
        name: &str,
        heights: Given<'_, '_>,
        spacing: Given<'_, '_>,
        body: &str,
        at: Option<Given<'_, '_>>,
        friction: f64,
        restitution: f64,
    ) -> PyResult<Self> {
        let input = Input::read(heights, "heights")?;
        let [y, x] = *input.shape() else {
            let fact = format!("`heights` has {} dimensions", input.shape().len());
            return Err(refuse_with(fact, "give it the shape (ny, nx)"));
        };
        let spacing = fixed::<2>(spacing, "spacing")?;
        let shape = Shape::HeightField { x, y, spacing, heights: input.slice().into() };
        Self::made((name, body), shape, at, (friction, restitution))
    }

    /// Balls about points (n, 4), x, y, z, radius (0 or more) of each, m: none when left out. room: for so many there is room in
    /// `Collisions.set_points`, for those given in any case.
    #[staticmethod]
    #[pyo3(signature = (name, body, points=None, *, room=0, at=None, friction=0.5, restitution=0.0))]
    fn point_cloud(
        name: &str,
        body: &str,
        points: Option<Given<'_, '_>>,
        room: usize,
        at: Option<Given<'_, '_>>,
        friction: f64,
        restitution: f64,
    ) -> PyResult<Self> {
        let points = points.map_or(Ok(Vec::new()), balls)?;
        Self::made((name, body), Shape::PointCloud { points, room }, at, (friction, restitution))
    }
    /// Cubes of a grid with edges of this length, m, that begins at the origin and has cells (3,) along +x, +y, +z; occupied (n, 3): indices from 0 of those
    /// that are solid, none when left out. `Collisions.set_cells` changes them.
    #[staticmethod]
    #[pyo3(signature = (name, body, cells, edge, *, occupied=None, at=None, friction=0.5, restitution=0.0))]
    fn voxel_map(
        name: &str,
        body: &str,
        cells: [usize; 3],
        edge: f64,
        occupied: Option<Given<'_, '_>>,
        at: Option<Given<'_, '_>>,
        friction: f64,
        restitution: f64,
    ) -> PyResult<Self> {
        let occupied = crate::collisions::occupied(occupied)?;
        let shape = Shape::VoxelMap { cells, edge, occupied };
        Self::made((name, body), shape, at, (friction, restitution))
    }

    /// Its name.
    #[getter]
    fn name(&self) -> &str {
        &self.spec.name
    }
    /// The body that carries it, or "world".
    #[getter]
    fn body(&self) -> &str {
        &self.spec.body
    }
    /// Coulomb's coefficient.
    #[getter]
    fn friction(&self) -> f64 {
        self.spec.material.friction
    }
    /// Coefficient of restitution.
    #[getter]
    fn restitution(&self) -> f64 {
        self.spec.material.restitution
    }
    /// The same shape with another friction and restitution; what is left out stays.
    #[pyo3(signature = (*, friction=None, restitution=None))]
    fn material(&self, friction: Option<f64>, restitution: Option<f64>) -> Self {
        let mut spec = self.spec.clone();
        let own = spec.material;
        spec.material = Material {
            friction: friction.unwrap_or(own.friction),
            restitution: restitution.unwrap_or(own.restitution),
        };
        Self { spec }
    }
    fn __repr__(&self) -> String {
        let shape = match &self.spec.fine {
            Shape::ConvexHull { points } => format!("hull of {} points", points.len()),
            Shape::Mesh { triangles, .. } => format!("mesh of {} triangles", triangles.len()),
            Shape::HeightField { x, y, .. } => format!("terrain of {y} × {x} heights"),
            Shape::PointCloud { points, .. } => format!("cloud of {} points", points.len()),
            Shape::VoxelMap { cells: [x, y, z], .. } => {
                format!("voxel map of {x} × {y} × {z} cells")
            }
            solid => format!("{solid:?}"),
        };
        format!("Collider({} on {}: {shape})", self.spec.name, self.spec.body)
    }
}

/// Points (n, 3).
fn places(given: Given<'_, '_>, what: &str) -> PyResult<Vec<Vec3>> {
    let input = Input::read(given, what)?;
    match *input.shape() {
        [_, 3] => Ok(input.slice().chunks_exact(3).map(Vec3::from_column_slice).collect()),
        ref shape => Err(refuse_with(
            format!("`{what}` has the shape {shape:?}"),
            "give it the shape (n, 3)",
        )),
    }
}

#[pymethods]
impl Mechanism {
    /// The collision shapes of the file that the mechanism was loaded from, as Colliders with the file's names, or `body/number`.
    ///
    /// Their friction is 0.5 and their restitution 0 where the file is no RON: `material` changes that. Raises LinkworkError for shapes that a
    /// Collider cannot be (mesh files, ellipsoids), and for a mechanism that is of no file.
    ///
    /// >>> import pathlib
    /// >>> _ = pathlib.Path("ball.urdf").write_text('<robot name="b"><link name="l"><inertial><mass value="1"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial>' '<collision><geometry><sphere radius="0.1"/></geometry></collision></link></robot>')
    /// >>> linkwork.load("ball.urdf", "free").file_colliders()
    /// [Collider(l/0 on l: Sphere { radius: 0.1 })]
    pub fn file_colliders(&self) -> PyResult<Vec<Collider>> {
        let specs = match (&self.core.contact, &self.core.description) {
            (Some(c), _) => c.colliders.ids().map(|id| c.colliders.spec(id).clone()).collect(),
            (None, Some(d)) => linkwork_embedded::colliders_of(d).map_err(refuse)?,
            (None, None) => {
                let fact =
                    "this mechanism has no file that says what touches (a pickled one has lost it)";
                return Err(refuse_with(fact, "give Contact a list of linkwork.Collider"));
            }
        };
        Ok(specs.into_iter().map(|spec| Collider { spec }).collect())
    }
}

/// The stepper and its memory.
struct Memory {
    stepper: ContactStepper,
    /// What the file hides.
    hiding: Hiding,
    vdot: Vec<f64>,
}

/// Steps a mechanism whose bodies touch each other and the ground: velocities and impulses together.
///
/// colliders: the shapes; None takes those of the file (`Mechanism.file_colliders`), and of a file in RON also who meets whom and the settings, which what is
/// given goes before. Bodies that a hinge of fewer than six degrees of freedom joins do not meet, unless neighbours is "collide" and not "pass".
/// ignore, collide: pairs of names of colliders or bodies that do not meet, that do. limits: "stop" (else the default) holds hinges within their limits,
/// "ignore" does not.
///
/// margin: gaps up to it are looked at, m. slop: penetration that is left alone, m. correction: part of the rest that a step works off. push_max: greatest speed
/// of that, m/s. bounce_min: what approaches more slowly does not bounce, m/s. tolerance of the solver, relative to the largest velocity.
///
/// A step is of first order in dt; a Contact begins its search with the impulses of its last step (`reset` forgets them), so that a
/// step's result depends on them within the tolerance. Damping of hinges is no part of it, their dry friction only
/// where a file's `contact` has it. Raises LinkworkError for shapes, names and settings that cannot be.
///
/// >>> import numpy as np, linkwork
/// >>> ball = linkwork.Builder().body("ball", "world", linkwork.Hinge.free(), mass=2.0, com=[0, 0, 0], inertia=0.008 * np.eye(3)).build()
/// >>> contact = linkwork.Contact(ball, [linkwork.Collider.sphere("skin", "ball", 0.1), linkwork.Collider.half_space("ground")])
/// >>> step = contact.step([0, 0, 0.1, 0, 0, 0, 1], np.zeros(6), 1e-3)
/// >>> step.pairs
/// [('ground', 'skin')]
/// >>> print(np.round(step.forces[0], 6))
/// [ 0.    0.   19.62]
#[pyclass(frozen, weakref, module = "linkwork")]
pub struct Contact {
    core: Arc<Core>,
    memory: Mutex<Memory>,
}

/// A number that must be above zero, or as given by the default.
fn setting(what: &str, given: Option<f64>, default: f64, zero: bool) -> PyResult<f64> {
    let x = given.unwrap_or(default);
    if x.is_finite() && (x > 0.0 || (zero && x == 0.0)) {
        return Ok(x);
    }
    let help = if zero { "give a number that is not negative" } else { "give a number above zero" };
    Err(refuse_with(format!("`{what}` is {x}"), help))
}

/// Colliders that were given, or those of the mechanism's file with its rules; and what is added to the rules.
pub(crate) fn chosen(
    mechanism: &Mechanism,
    colliders: Option<Vec<PyRef<'_, Collider>>>,
    ignore: Option<Vec<[String; 2]>>,
    collide: Option<Vec<[String; 2]>>,
    neighbours: Option<&str>,
) -> PyResult<(Vec<ColliderSpec>, Rules)> {
    let (specs, mut rules): (Vec<_>, _) = match colliders {
        Some(given) => (given.iter().map(|c| c.spec.clone()).collect(), Rules::default()),
        None => {
            let contact = &mechanism.core.contact;
            let rules = contact.as_ref().map(|c| c.colliders.rules().clone());
            let specs = mechanism.file_colliders()?.into_iter().map(|c| c.spec).collect();
            (specs, rules.unwrap_or_default())
        }
    };
    let known = [("pass", Neighbours::Pass), ("collide", Neighbours::Collide)];
    if let Some(given) = neighbours {
        rules.neighbours = choice("neighbours", given, &known)?;
    }
    rules.ignore.extend(ignore.unwrap_or_default());
    rules.collide.extend(collide.unwrap_or_default());
    Ok((specs, rules))
}

#[pymethods]
impl Contact {
    #[new]
    #[pyo3(signature = (mechanism, colliders=None, *, ignore=None, collide=None, neighbours=None, limits=None,
        margin=None, slop=None, correction=None, push_max=None, bounce_min=None, tolerance=None))]
    fn new(
        mechanism: &Mechanism,
        colliders: Option<Vec<PyRef<'_, Collider>>>,
        ignore: Option<Vec<[String; 2]>>,
        collide: Option<Vec<[String; 2]>>,
        neighbours: Option<&str>,
        limits: Option<&str>,
        margin: Option<f64>,
        slop: Option<f64>,
        correction: Option<f64>,
        push_max: Option<f64>,
        bounce_min: Option<f64>,
        tolerance: Option<f64>,
    ) -> PyResult<Self> {
        let core = mechanism.core.clone();
        let mut own = ContactSettings::default();
        if let (None, Some(c)) = (&colliders, &core.contact) {
            let fact = "the contact of the file is compliant, and this one is by impulses";
            let help = "give `mechanism.file_colliders()` as colliders, or use linkwork.Simulation";
            own = c.settings.clone().ok_or_else(|| refuse_with(fact, help))?;
        }
        let (specs, rules) = chosen(mechanism, colliders, ignore, collide, neighbours)?;
        let known = [("stop", JointLimits::Stop), ("ignore", JointLimits::Ignore)];
        let limits = limits.map_or(Ok(own.limits), |given| choice("limits", given, &known))?;
        let mut settings = ContactSettings {
            margin: setting("margin", margin, own.margin, false)?,
            slop: setting("slop", slop, own.slop, true)?,
            correction: setting("correction", correction, own.correction, true)?,
            push_max: setting("push_max", push_max, own.push_max, true)?,
            bounce_min: setting("bounce_min", bounce_min, own.bounce_min, true)?,
            limits,
            ..own
        };
        if settings.correction > 1.0 {
            let fact = format!("`correction` is {}", settings.correction);
            return Err(refuse_with(fact, "give a part, from 0 to 1"));
        }
        let solver = &mut settings.solver;
        solver.tolerance = setting("tolerance", tolerance, solver.tolerance, false)?;
        let all = Colliders::new(specs, rules, core.tree.multibody()).map_err(refuse)?;
        let auto = |_| Treatment::Auto;
        let stepper = ContactStepper::new(&core.tree, Arc::new(all), settings, auto);
        let hiding = stepper.colliders().hiding();
        let memory = Mutex::new(Memory { stepper, hiding, vdot: vec![0.0; core.nv()] });
        Ok(Self { core, memory })
    }

    /// Names of the colliders, in the order of names.
    #[getter]
    fn colliders(&self) -> Vec<String> {
        let memory = lock(&self.memory);
        let all = memory.stepper.colliders();
        all.ids().map(|id| all.spec(id).name.clone()).collect()
    }

    /// Forgets the impulses of the last step: the next begins its search without them, as the first one did.
    fn reset(&self) {
        lock(&self.memory).stepper.set_warm(&[]);
    }

    /// One step of dt (s) from q (nq,), v (nv,) with the forces tau (nv,), zero when left out: a ContactStep.
    ///
    /// wrenches: {frame: (6,)}, moment about the frame's origin (N m) and force (N), world axes. Prescribed coordinates keep their rates. Loops and
    /// couplings are obeyed; q must close them, and v keep them closed (`close`). Raises LinkworkError when a free coordinate moves nothing with
    /// inertia, and when a number becomes too large.
    #[pyo3(signature = (q, v, dt, tau=None, *, wrenches=None))]
    fn step(
        &self,
        q: Given<'_, '_>,
        v: Given<'_, '_>,
        dt: f64,
        tau: Option<Given<'_, '_>>,
        wrenches: Option<&Bound<'_, PyDict>>,
    ) -> PyResult<ContactStep> {
        let (py, core) = (q.py(), &*self.core);
        let dt = setting("dt", Some(dt), dt, false)?;
        let mut q = vector(q, core.nq(), "q")?.slice().to_vec();
        let mut v = vector(v, core.nv(), "v")?.slice().to_vec();
        let mut tau = match tau {
            Some(tau) => vector(tau, core.nv(), "tau")?.slice().to_vec(),
            None => vec![0.0; core.nv()],
        };
        let wrenches = core.wrenches(wrenches)?;
        if core.is_constrained() {
            may_begin(core, &q, &v)?;
        }
        py.detach(|| {
            let mut memory = lock(&self.memory);
            let report = memory.step(core, &wrenches, dt, &mut q, &mut v, &mut tau)?;
            let Memory { stepper, vdot, .. } = &*memory;
            let points = stepper.points();
            let sum = stepper.warm().iter().zip(stepper.impacts()).map(|(w, i)| w.impulse + i);
            Ok(ContactStep {
                vdot: vdot.clone(),
                colliders: stepper.colliders().clone(),
                pairs: points.iter().map(|p| (p.a, p.b)).collect(),
                points: points.iter().flat_map(|p| p.point.data.0[0]).collect(),
                normals: points.iter().flat_map(|p| p.normal.data.0[0]).collect(),
                gaps: points.iter().map(|p| p.gap).collect(),
                impulses: sum.flat_map(|i: Vec3| i.data.0[0]).collect(),
                q,
                v,
                dt,
                report,
            })
        })
    }

    /// Trajectories (t, q, v) of shapes (steps + 1,), (steps + 1, nq), (steps + 1, nv), from q (nq,) and v (nv,) at t = 0 in steps of dt (s).
    ///
    /// torque: None; (nv,) constant; (steps, nv) one row a step; or a function of (t, q, v) that gives (nv,), called once a step. wrenches:
    /// as in `step`. Warns (UserWarning) when impulses of some steps were not found within the tolerance.
    #[pyo3(signature = (q, v, dt, steps, *, torque=None, wrenches=None))]
    fn simulate<'py>(
        &self,
        py: Python<'py>,
        q: Given<'_, 'py>,
        v: Given<'_, 'py>,
        dt: f64,
        steps: usize,
        torque: Option<Given<'_, 'py>>,
        wrenches: Option<&Bound<'py, PyDict>>,
    ) -> PyResult<(Array1<'py>, Array2<'py>, Array2<'py>)> {
        let (core, nq, nv) = (&*self.core, self.core.nq(), self.core.nv());
        let dt = setting("dt", Some(dt), dt, false)?;
        let mut q = vector(q, nq, "q")?.slice().to_vec();
        let mut v = vector(v, nv, "v")?.slice().to_vec();
        let torque = Torque::read(torque, nv, steps)?;
        let wrenches = core.wrenches(wrenches)?;
        if core.is_constrained() {
            may_begin(core, &q, &v)?;
        }
        let rows = steps.saturating_add(1);
        let (mut qs, mut vs, mut t) = (room(rows, nq)?, room(rows, nv)?, room(rows, 1)?);
        qs.extend_from_slice(&q);
        vs.extend_from_slice(&v);
        let (mut open, mut worst, mut tau) = (0_usize, 0.0_f64, vec![0.0; nv]);
        torque.drive(py, nv, steps, |k, forces: &mut Forces<'_>| {
            let now = k as f64 * dt;
            tau.fill(0.0);
            forces(k, now, &q, &v, &mut tau)?;
            // Not held while the forces are asked for: they may use this Contact.
            let report = lock(&self.memory).step(core, &wrenches, dt, &mut q, &mut v, &mut tau);
            let report = report.map_err(|e| refuse(format!("t = {now} s: {e}")))?;
            if !report.converged {
                open += 1;
                worst = worst.max(report.measure.residual);
            }
            qs.extend_from_slice(&q);
            vs.extend_from_slice(&v);
            Ok(())
        })?;
        if open > 0 {
            let tolerance = lock(&self.memory).stepper.settings.solver.tolerance;
            let text = format!(
                "impulses of {open} of {steps} steps were not found within the tolerance {tolerance}: {worst:.1e} at worst\n  help: take a \
                 smaller dt, or a larger tolerance"
            );
            let text = std::ffi::CString::new(text).unwrap_or_default();
            PyErr::warn(py, &py.get_type::<pyo3::exceptions::PyUserWarning>(), &text, 1)?;
        }
        t.extend((0..=steps).map(|k| k as f64 * dt));
        Ok((out1(py, t), out2(py, qs, rows, nq)?, out2(py, vs, rows, nv)?))
    }

    fn __repr__(&self) -> String {
        let memory = lock(&self.memory);
        let (bodies, colliders) = (self.core.mbs.bodies().len(), memory.stepper.colliders().len());
        format!("Contact({bodies} bodies, {colliders} colliders)")
    }
}

impl Memory {
    /// One step in place; then back onto loops and couplings.
    fn step(
        &mut self,
        core: &Core,
        wrenches: &[(NodeId, Force)],
        dt: f64,
        q: &mut [f64],
        v: &mut [f64],
        tau: &mut [f64],
    ) -> PyResult<StepReport> {
        let mut ws = core.workspace();
        core.load(&mut ws, q, v, wrenches);
        self.vdot.fill(0.0);
        let state = (&mut *q, &mut *v);
        let Self { stepper, hiding, vdot } = self;
        let step = stepper.step(&core.tree, &mut ws, dt, state, &[], Some(hiding), tau, vdot);
        core.give_back(ws);
        let report = step.map_err(refuse)?;
        core.mbs.normalize(q);
        if core.is_constrained() {
            core.with_constrained(Treatment::Auto, |c| c.close(core, &[], q, Some(v)))
                .map_err(refuse)?;
        }
        if q.iter().chain(&*v).all(|x| x.is_finite()) {
            return Ok(report);
        }
        Err(refuse_with(
            "the state after the step is no number any more",
            "take a smaller dt, and look at the forces",
        ))
    }
}

/// What came of a step: the state after it, and what touched.
///
/// Row k of `pairs`, `points`, `normals`, `gaps`, `impulses` and `forces` is one contact point of the n that were near enough to matter; where no
/// force acts its impulse is zero. They are as at the start of the step.
#[pyclass(frozen, weakref, module = "linkwork")]
pub struct ContactStep {
    q: Vec<f64>,
    v: Vec<f64>,
    vdot: Vec<f64>,
    colliders: Arc<Colliders>,
    pairs: Vec<(ColliderId, ColliderId)>,
    points: Vec<f64>,
    normals: Vec<f64>,
    gaps: Vec<f64>,
    impulses: Vec<f64>,
    dt: f64,
    report: StepReport,
}

#[pymethods]
impl ContactStep {
    /// The configuration after the step (nq,).
    #[getter]
    fn q<'py>(&self, py: Python<'py>) -> Array1<'py> {
        PyArray1::from_slice(py, &self.q)
    }
    /// The rates after the step (nv,).
    #[getter]
    fn v<'py>(&self, py: Python<'py>) -> Array1<'py> {
        PyArray1::from_slice(py, &self.v)
    }
    /// The mean accelerations of the step (nv,), impulses included.
    #[getter]
    fn vdot<'py>(&self, py: Python<'py>) -> Array1<'py> {
        PyArray1::from_slice(py, &self.vdot)
    }
    /// The names of the two colliders of each point, in the order of names; the second is the one that `impulses` push.
    #[getter]
    fn pairs(&self) -> Vec<(&str, &str)> {
        let name = |id: ColliderId| self.colliders.spec(id).name.as_str();
        self.pairs.iter().map(|(a, b)| (name(*a), name(*b))).collect()
    }
    /// Where (n, 3): midway between the surfaces, world, m.
    #[getter]
    fn points<'py>(&self, py: Python<'py>) -> PyResult<Array2<'py>> {
        out2(py, self.points.clone(), self.gaps.len(), 3)
    }
    /// Unit vectors (n, 3) from the first collider to the second, world axes.
    #[getter]
    fn normals<'py>(&self, py: Python<'py>) -> PyResult<Array2<'py>> {
        out2(py, self.normals.clone(), self.gaps.len(), 3)
    }
    /// Distances of the surfaces (n,), m; negative where they overlap.
    #[getter]
    fn gaps<'py>(&self, py: Python<'py>) -> Array1<'py> {
        out1(py, self.gaps.clone())
    }
    /// Impulses on the second collider (n, 3), those of impacts included, world axes, N s.
    #[getter]
    fn impulses<'py>(&self, py: Python<'py>) -> PyResult<Array2<'py>> {
        out2(py, self.impulses.clone(), self.gaps.len(), 3)
    }
    /// Mean forces of the step on the second collider (n, 3): impulses / dt, world axes, N.
    #[getter]
    fn forces<'py>(&self, py: Python<'py>) -> PyResult<Array2<'py>> {
        let forces = self.impulses.iter().map(|x| x / self.dt).collect();
        out2(py, forces, self.gaps.len(), 3)
    }
    /// Deepest penetration at the start of the step, m; 0 where nothing overlaps.
    #[getter]
    fn penetration(&self) -> f64 {
        self.report.penetration.max(0.0)
    }
    /// Impacts that were resolved one after another.
    #[getter]
    fn impacts(&self) -> usize {
        self.report.impacts
    }
    /// Whether the impulses were found within the tolerance.
    #[getter]
    fn converged(&self) -> bool {
        self.report.converged
    }
    /// How far they are from a solution, relative to the largest velocity.
    #[getter]
    fn residual(&self) -> f64 {
        self.report.measure.residual
    }
    fn __repr__(&self) -> String {
        let (n, deep) = (self.gaps.len(), self.penetration());
        format!(
            "ContactStep({n} points, penetration {deep:.2e} m, residual {:.1e})",
            self.residual()
        )
    }
}
