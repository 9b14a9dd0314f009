//! Control: rates and forces for tasks in order of priority, impedance; momentum and composite inertias with grasped objects.
use super::{ArrayLike, Robot, base};
use crate::array::{Array1, Array2, Input, checked1, out_force, out1, out2, pose, vec3, vector};
use crate::collisions::Collisions;
use crate::core::lock;
use crate::error::{refuse, refuse_with};
use crate::values::pairs;
use linkwork_embedded::{
    Aim, Guards, Impedance, MotionLimits, Objective, Part, RateControl, Rows, Touch, WholeBody,
};
use linkwork_embedded::{support_margin as margin, support_polygon as polygon};
use linkwork_spatial::{Motion, Vec3};
use pyo3::prelude::*;
use pyo3::types::PyDict;

/// One task as passed from Python; posture tasks own their numbers.
enum Given1 {
    Tip(Part, Motion, Rows),
    Center(Vec3),
    Posture(Vec<f64>),
}

/// The key of a level that stands for the centre of mass.
const CENTER: &str = "center_of_mass";

impl Collisions {
    /// Reads levels: dicts of parts (and the centre of mass), or arrays (nv,) for all degrees of freedom.
    fn levels(&self, given: &[Bound<'_, PyAny>], length: f64) -> PyResult<Vec<(usize, Given1)>> {
        let mut all = Vec::new();
        for (level, objective) in given.iter().enumerate() {
            let of = |what: &str| format!("levels[{level}]{what}");
            let Ok(dict) = objective.cast::<PyDict>() else {
                let posture = vector(objective, self.model.nv(), &of(""))?;
                all.push((level, Given1::Posture(posture.slice().to_vec())));
                continue;
            };
            for (name, value) in pairs(dict) {
                let name: String = name.extract()?;
                let what = of(&format!("[\"{name}\"]"));
                if name == CENTER && self.model.part(CENTER).is_none() {
                    all.push((level, Given1::Center(vec3(&value, &what)?)));
                    continue;
                }
                let part = self.part(&name)?;
                let x = Input::read(&value, &what)?;
                let (w, v, rows) = match (x.shape(), x.slice()) {
                    ([6], [a, b, c, x, y, z]) => {
                        let rows = Rows::All { length };
                        (Vec3::new(*a, *b, *c), Vec3::new(*x, *y, *z), rows)
                    }
                    ([3], [x, y, z]) => (Vec3::zeros(), Vec3::new(*x, *y, *z), Rows::Linear),
                    (shape, _) => {
                        let fact = format!("`{what}` has the shape {shape:?}");
                        let help = "give (6,), angular then linear, or (3,), only linear";
                        return Err(refuse_with(fact, help));
                    }
                };
                all.push((level, Given1::Tip(part, Motion::new(w, v), rows)));
            }
        }
        Ok(all)
    }
}

fn objectives(all: &[(usize, Given1)]) -> Vec<Objective<'_>> {
    let aim = |g| match g {
        &Given1::Tip(part, motion, rows) => Aim::Tip { part, motion, rows },
        &Given1::Center(x) => Aim::Center(x),
        Given1::Posture(x) => Aim::Posture(x),
    };
    all.iter().map(|(level, g)| Objective::new(*level, aim(g))).collect()
}

/// Result of `Robot.whole_body`.
///
/// Examples
/// --------
/// >>> ball = linkwork.Builder().body("ball", "world", linkwork.Hinge.free(), mass=2, com=[0, 0, 0], inertia=np.eye(3)).build()
/// >>> robot = linkwork.Robot(ball, chains={"ball": ("world", "ball")}, colliders=[])
/// >>> balanced = robot.whole_body(np.zeros(6), [np.zeros(6)], touches=[("ball", [0, 0, 0], [0, 0, 1], 0.5)])
/// >>> balanced
/// WholeBodyForces(unbalanced 0, slipping 0, shortfall 0)
#[pyclass(frozen, weakref, module = "linkwork")]
pub struct WholeBodyForces {
    tau: Vec<f64>,
    vdot: Vec<f64>,
    forces: Vec<f64>,
    told: linkwork_embedded::Balanced,
}

#[pymethods]
impl WholeBodyForces {
    /// Generalized forces (nv,), N m and N; zero at degrees of freedom without an actuator.
    ///
    /// Examples
    /// --------
    /// >>> balanced.tau.tolist()
    /// [0.0, 0.0, 0.0, 0.0, 0.0, 0.0]
    #[getter]
    fn tau<'py>(&self, py: Python<'py>) -> PyResult<Array1<'py>> {
        checked1(py, self.tau.clone())
    }
    /// Accelerations (nv,), rad/s² and m/s².
    ///
    /// Examples
    /// --------
    /// >>> bool(abs(balanced.vdot).max() < 1e-9)
    /// True
    #[getter]
    fn vdot<'py>(&self, py: Python<'py>) -> PyResult<Array1<'py>> {
        checked1(py, self.vdot.clone())
    }
    /// Contact forces on the robot (k, 3), N, world axes.
    ///
    /// Examples
    /// --------
    /// >>> balanced.forces[0, 2].round(6).item()
    /// 19.62
    #[getter]
    fn forces<'py>(&self, py: Python<'py>) -> PyResult<Array2<'py>> {
        out2(py, self.forces.clone(), self.forces.len() / 3, 3)
    }
    /// Residual force at degrees of freedom without an actuator, which the contacts cannot provide, N m and N; 0 if the robot is balanced.
    ///
    /// Examples
    /// --------
    /// >>> balanced.unbalanced < 1e-9
    /// True
    #[getter]
    fn unbalanced(&self) -> f64 {
        self.told.unbalanced
    }
    /// Residual acceleration of contact points that should be at rest, m/s².
    ///
    /// Examples
    /// --------
    /// >>> balanced.slipping < 1e-9
    /// True
    #[getter]
    fn slipping(&self) -> f64 {
        self.told.slipping
    }
    /// Fraction by which all effort limits (N m, N) and normal force limits (N) would have to be larger; 0 if they suffice.
    ///
    /// Examples
    /// --------
    /// >>> balanced.shortfall
    /// 0.0
    #[getter]
    fn shortfall(&self) -> f64 {
        self.told.shortfall
    }
    fn __repr__(&self) -> String {
        let t = &self.told;
        let short = |x: f64| if x < 1e-9 { "0".to_owned() } else { format!("{x:.3e}") };
        let [a, b, c] = [t.unbalanced, t.slipping, t.shortfall].map(short);
        format!("WholeBodyForces(unbalanced {a}, slipping {b}, shortfall {c})")
    }
}

#[pymethods]
impl Robot {
    /// Compute rates for tasks in strict order of priority, within limits of velocity and position (hierarchical control).
    ///
    /// Tasks of lower levels do not disturb tasks of higher levels.
    ///
    /// Parameters
    /// ----------
    /// levels : sequence of dict or array_like
    ///     Tasks of each level, highest priority first: a dict {part: (6,) twist [ω; v] of its tip, or (3,) velocity; "center_of_mass": (3,)}, in
    ///     world axes, or rates (nv,) of all degrees of freedom.
    /// horizon : float
    ///     Time in which a coordinate may reach its limit, s.
    /// manipulable : dict, optional
    ///     {part: smallest w}: the manipulability of a chain (`manipulability(part)` with length 1 m) must not fall below it.
    /// length : float
    ///     Length, m, that weights 1 rad (default: 1).
    ///
    /// Returns
    /// -------
    /// v : ndarray, shape (nv,)
    ///     Rates, rad/s and m/s.
    /// residuals : ndarray, shape (k,)
    ///     Residual of each level.
    ///
    /// Raises
    /// ------
    /// LinkworkError
    ///     If a name does not exist, an array has a wrong shape or contains NaN, or guards contradict each other.
    ///
    /// Examples
    /// --------
    /// >>> robot.q = [0.3, 0.5, 0.4]
    /// >>> v, residuals = robot.prioritized_joint_rates([{"arm": [0.1, 0, 0]}, [0.0, 0.0, 0.5]])
    /// >>> bool(np.allclose((robot.jacobian("arm") @ v)[3:], [0.1, 0, 0])), float(residuals[0]) < 1e-9
    /// (True, True)
    #[pyo3(signature = (levels, *, horizon=0.1, manipulable=None, length=1.0))]
    fn prioritized_joint_rates<'py>(
        slf: &Bound<'py, Self>,
        levels: Vec<Bound<'py, PyAny>>,
        horizon: f64,
        manipulable: Option<&Bound<'py, PyDict>>,
        length: f64,
    ) -> PyResult<(Array1<'py>, Array1<'py>)> {
        let (py, own) = (slf.py(), base(slf));
        let all = own.levels(&levels, length)?;
        let mut guarded = Vec::new();
        for (name, least) in manipulable.into_iter().flat_map(pairs) {
            guarded.push((own.part(&name.extract::<String>()?)?, least.extract::<f64>()?));
        }
        let (mut v, mut residuals) = (vec![0.0; own.model.nv()], vec![0.0; levels.len()]);
        let objectives = objectives(&all);
        let guards = Guards { horizon, manipulable: &guarded };
        own.ask(|r| {
            let mut control = RateControl::new(r, objectives.len(), guarded.len());
            control.solve(r, &objectives, &guards, &mut v, &mut residuals)
        })?;
        Ok((checked1(py, v)?, checked1(py, residuals)?))
    }

    /// Compute the smallest rates with which the tip of a chain moves as commanded, or as nearly as possible.
    ///
    /// Only the chain moves. Velocity limits are respected, and a coordinate at its limit does not move outward. Use `prioritized_joint_rates` for several tasks,
    /// or for a smooth approach to limits.
    ///
    /// Parameters
    /// ----------
    /// part : str
    ///     Name of the chain.
    /// twist : array_like, shape (6,)
    ///     [ω; v] of the tip's origin relative to the chain's base, rad/s and m/s, world axes.
    ///
    /// Returns
    /// -------
    /// v : ndarray, shape (nv,)
    ///     Rates, rad/s and m/s.
    /// residual : tuple of float
    ///     Remaining linear and angular error, m/s and rad/s.
    ///
    /// Raises
    /// ------
    /// LinkworkError
    ///     If the part is not a chain, or the twist has a wrong length or contains NaN.
    ///
    /// Examples
    /// --------
    /// >>> robot.q = [0.3, 0.5, 0.4]
    /// >>> v, missing = robot.joint_rates("arm", [0, -0.2, 0, 0.1, 0, 0.05])
    /// >>> bool(np.allclose(robot.jacobian("arm") @ v, [0, -0.2, 0, 0.1, 0, 0.05])), bool(max(missing) < 1e-9)
    /// (True, True)
    fn joint_rates<'py>(
        slf: &Bound<'py, Self>,
        part: &str,
        twist: ArrayLike<'_, 'py>,
    ) -> PyResult<(Array1<'py>, (f64, f64))> {
        let own = base(slf);
        let part = own.part(part)?;
        let [a, b, c, x, y, z] = crate::array::fixed::<6>(twist, "twist")?;
        let twist = Motion::new(Vec3::new(a, b, c), Vec3::new(x, y, z));
        let mut v = vec![0.0; own.model.nv()];
        let missing = own.ask(|r| r.rates(part, &twist, &mut v))?;
        Ok((checked1(slf.py(), v)?, (missing.position, missing.orientation)))
    }

    /// Compute generalized forces of the whole robot for acceleration tasks in order of priority, with contacts that push and do not slip, within
    /// effort limits.
    ///
    /// If the contacts cannot carry the robot, or the joints are too weak, the result is the best that is possible, and WholeBodyForces reports the
    /// deficit.
    ///
    /// Parameters
    /// ----------
    /// v : array_like, shape (nv,)
    ///     Rates, rad/s and m/s.
    /// levels : sequence of dict or array_like
    ///     Tasks as in `prioritized_joint_rates`, with accelerations, rad/s² and m/s².
    /// touches : sequence of tuple, optional
    ///     Contacts: (part, point (3,) in its tip's frame, m, normal (3,) towards the robot in the world, friction[, largest normal force, N]).
    /// effort : array_like, shape (nv,), optional
    ///     Limits of the forces, N m and N; 0 for degrees of freedom without an actuator. By default the limits of the mechanism, and 0 for ball
    ///     and free hinges.
    /// length : float
    ///     Length, m, that weights 1 rad (default: 1).
    ///
    /// Returns
    /// -------
    /// WholeBodyForces
    ///     Forces, accelerations and contact forces.
    ///
    /// Raises
    /// ------
    /// LinkworkError
    ///     If a name does not exist, an array has a wrong shape or contains NaN, or a friction coefficient or normal is not valid.
    ///
    /// Examples
    /// --------
    /// >>> found = robot.whole_body([0, 0, 0], [{"arm": [0, 0, 1.0]}])
    /// >>> bool(np.allclose(robot.feed_forward([0, 0, 0], found.vdot), found.tau))
    /// True
    #[pyo3(signature = (v, levels, *, touches=None, effort=None, length=1.0))]
    fn whole_body<'py>(
        slf: &Bound<'py, Self>,
        v: ArrayLike<'_, 'py>,
        levels: Vec<Bound<'py, PyAny>>,
        touches: Option<Vec<Bound<'py, PyAny>>>,
        effort: Option<ArrayLike<'_, 'py>>,
        length: f64,
    ) -> PyResult<WholeBodyForces> {
        let own = base(slf);
        let nv = own.model.nv();
        let v = vector(v, nv, "v")?;
        let all = own.levels(&levels, length)?;
        let mut points = Vec::new();
        for (k, touch) in touches.into_iter().flatten().enumerate() {
            let of = |what: &str| format!("touches[{k}]: {what}");
            let wrong = || {
                let help = "give (part, point, normal, friction), optionally followed by the largest normal force";
                refuse_with(of("no touch"), help)
            };
            let items: Vec<Bound<'_, PyAny>> = touch.extract().map_err(|_| wrong())?;
            let (part, at, normal, friction, most) = match &items[..] {
                [part, at, normal, friction] => (part, at, normal, friction, f64::INFINITY),
                [part, at, normal, friction, most] => {
                    (part, at, normal, friction, most.extract().map_err(|_| wrong())?)
                }
                _ => return Err(wrong()),
            };
            points.push(Touch {
                part: own.part(&part.extract::<String>().map_err(|_| wrong())?)?,
                at: vec3(at, &of("point"))?,
                normal: vec3(normal, &of("normal"))?,
                friction: friction.extract().map_err(|_| wrong())?,
                most,
            });
        }
        let effort = match effort {
            Some(given) => {
                let fact =
                    || refuse_with("`effort` is not an array of numbers", format!("give ({nv},)"));
                given.extract::<Vec<f64>>().map_err(|_| fact())?
            }
            None => {
                let mut effort = MotionLimits::of(&own.model).effort;
                for (_, s) in own.model.multibody().subhinges().filter(|(_, s)| s.v.len() > 1) {
                    effort[s.v.clone()].fill(0.0);
                }
                effort
            }
        };
        let objectives = objectives(&all);
        let (mut tau, mut vdot) = (vec![0.0; nv], vec![0.0; nv]);
        let mut forces = vec![Vec3::zeros(); points.len()];
        let told = own.ask(|r| {
            let mut whole = WholeBody::new(r, points.len(), objectives.len());
            let out = (&mut tau[..], &mut vdot[..], &mut forces[..]);
            whole.solve(r, v.slice(), &points, &objectives, &effort, out)
        })?;
        let forces = forces.iter().flat_map(|f| [f.x, f.y, f.z]).collect();
        Ok(WholeBodyForces { tau, vdot, forces, told })
    }

    /// Compute generalized forces of Cartesian impedance control: the tip of each chain behaves like a spring and a damper at its setpoint.
    ///
    /// At rest, a tip yields to an external wrench according to its stiffness.
    ///
    /// Parameters
    /// ----------
    /// springs : dict
    ///     {part: (place, stiffness (6,), damping (6,))}. The setpoint `place` is (7,) or (4, 4). Stiffness is in N m/rad and N/m, damping in N m
    ///     s/rad and N s/m, along world axes.
    /// v : array_like, shape (nv,)
    ///     Rates, rad/s and m/s.
    /// rest : array_like, shape (nv,), optional
    ///     Generalized forces that act in the null space of the tips, N m and N.
    ///
    /// Returns
    /// -------
    /// ndarray, shape (nv,)
    ///     Generalized forces, N m and N.
    ///
    /// Raises
    /// ------
    /// LinkworkError
    ///     If a name does not exist, an array has a wrong shape or contains NaN, a stiffness or damping is negative, or the tips cannot move
    ///     independently.
    ///
    /// Examples
    /// --------
    /// >>> drone = linkwork.Builder().body("drone", "world", linkwork.Hinge.free(), mass=2, com=[0, 0, 0], inertia=np.eye(3) / 10).build()
    /// >>> flying = linkwork.Robot(drone, chains={"body": ("world", "drone")}, colliders=[])
    /// >>> flying.impedance({"body": ([0, 0, 0.1, 0, 0, 0, 1], 6 * [100.0], 6 * [5.0])}, np.zeros(6))[5].round(9).item()
    /// 29.62
    #[pyo3(signature = (springs, v, rest=None))]
    fn impedance<'py>(
        slf: &Bound<'py, Self>,
        springs: &Bound<'py, PyDict>,
        v: ArrayLike<'_, 'py>,
        rest: Option<ArrayLike<'_, 'py>>,
    ) -> PyResult<Array1<'py>> {
        let own = base(slf);
        let nv = own.model.nv();
        let (mut parts, mut all) = (Vec::new(), Vec::new());
        for (name, value) in pairs(springs) {
            let name: String = name.extract()?;
            let wrong = || {
                let fact = format!("`springs[\"{name}\"]` is not a spring");
                refuse_with(fact, "give (place, stiffness (6,), damping (6,))")
            };
            let items: Vec<Bound<'_, PyAny>> = value.extract().map_err(|_| wrong())?;
            let [place, stiffness, damping] = &items[..] else { return Err(wrong()) };
            let of = |what: &str| format!("springs[\"{name}\"]: {what}");
            let mut spring = Impedance::at(pose(Some(place), &of("place"))?, [0.0; 2], [0.0; 2]);
            spring.stiffness = crate::array::fixed::<6>(stiffness, &of("stiffness"))?;
            spring.damping = crate::array::fixed::<6>(damping, &of("damping"))?;
            parts.push(name);
            all.push(spring);
        }
        let mut space = own.task_space(&parts)?;
        let v = vector(v, nv, "v")?;
        let rest = rest.map(|r| vector(r, nv, "rest")).transpose()?;
        let rest = rest.as_ref().map(Input::slice);
        let mut tau = vec![0.0; nv];
        own.ask(|r| space.impedance(r, v.slice(), &all, rest, &mut tau))?;
        checked1(slf.py(), tau)
    }

    /// Return the composite inertia of a body: of the body and all bodies and grasped objects outboard of it, at the robot's q.
    ///
    /// Parameters
    /// ----------
    /// body : str
    ///     Name of a body.
    ///
    /// Returns
    /// -------
    /// mass : float
    ///     Mass, kg.
    /// com : ndarray, shape (3,)
    ///     Centre of mass in the world, m.
    /// inertia : ndarray, shape (3, 3)
    ///     Inertia about the centre of mass, world axes, kg m².
    ///
    /// Raises
    /// ------
    /// LinkworkError
    ///     If the body does not exist.
    ///
    /// Examples
    /// --------
    /// >>> mass, com, inertia = robot.composite_inertia("lower")
    /// >>> mass, inertia.shape
    /// (2.0, (3, 3))
    fn composite_inertia<'py>(
        slf: &Bound<'py, Self>,
        body: &str,
    ) -> PyResult<(f64, Array1<'py>, Array2<'py>)> {
        let (py, own) = (slf.py(), base(slf));
        let id = own.body(body)?;
        let mut robot = lock(&own.robot);
        let inertia = robot.composite_inertia(id);
        let mut com = robot.body_pose(id).position;
        let mass = inertia.mass();
        if mass > 0.0 {
            com += inertia.h() / mass;
        }
        let I = inertia.inertia_com();
        let rows = (0..9).map(|k| I[(k / 3, k % 3)]).collect();
        Ok((mass, out1(py, com.as_slice().to_vec()), out2(py, rows, 3, 3)?))
    }

    /// Return the momentum about the centre of mass at the robot's q, including grasped objects.
    ///
    /// Parameters
    /// ----------
    /// v : array_like, shape (nv,)
    ///     Rates, rad/s and m/s.
    ///
    /// Returns
    /// -------
    /// ndarray, shape (6,)
    ///     Angular momentum, kg m²/s, then linear momentum, kg m/s, world axes.
    ///
    /// Raises
    /// ------
    /// LinkworkError
    ///     If v has a wrong length or contains NaN.
    ///
    /// Examples
    /// --------
    /// >>> robot.momentum([0.1, 0.2, 0.3]).shape
    /// (6,)
    fn momentum<'py>(slf: &Bound<'py, Self>, v: ArrayLike<'_, 'py>) -> PyResult<Array1<'py>> {
        let own = base(slf);
        let v = vector(v, own.model.nv(), "v")?;
        out_force(slf.py(), &own.ask(|r| r.momentum(v.slice()))?)
    }

    /// Return the centroidal momentum matrix at the robot's q, including grasped objects: rates to `momentum`.
    ///
    /// Returns
    /// -------
    /// ndarray, shape (6, nv)
    ///     Its product with v is in kg m²/s and kg m/s.
    ///
    /// Examples
    /// --------
    /// >>> bool(np.allclose(robot.centroidal_matrix() @ [0.1, 0.2, 0.3], robot.momentum([0.1, 0.2, 0.3])))
    /// True
    fn centroidal_matrix<'py>(slf: &Bound<'py, Self>) -> PyResult<Array2<'py>> {
        let own = base(slf);
        let nv = own.model.nv();
        let mut A = vec![0.0; 6 * nv];
        own.ask(|r| r.centroidal_matrix(&mut A))?;
        out2(slf.py(), A, 6, nv)
    }
}

/// Reads points in a plane (n, 2), m.
fn plane(given: ArrayLike<'_, '_>, what: &str) -> PyResult<Vec<[f64; 2]>> {
    let input = Input::read(given, what)?;
    if !matches!(input.shape(), [_, 2]) && !input.slice().is_empty() {
        let fact = format!("`{what}` has the shape {:?}", input.shape());
        return Err(refuse_with(fact, "give it the shape (n, 2): x and y of each, m"));
    }
    Ok(input.slice().chunks_exact(2).map(|p| [p[0], p[1]]).collect())
}

/// Compute the support polygon of contact points on level ground.
///
/// Parameters
/// ----------
/// points : array_like, shape (n, 2)
///     Contact points, m.
///
/// Returns
/// -------
/// ndarray, shape (k, 2)
///     Corners, counter-clockwise, m.
///
/// Raises
/// ------
/// LinkworkError
///     If an array has a wrong shape or contains NaN.
///
/// Examples
/// --------
/// >>> linkwork.support_polygon([[0, 0], [1, 0], [0.5, 0.2], [1, 1], [0, 1]]).tolist()
/// [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]]
#[pyfunction]
pub fn support_polygon<'py>(py: Python<'py>, points: ArrayLike<'_, 'py>) -> PyResult<Array2<'py>> {
    let mut points = plane(points, "points")?;
    let mut hull = vec![[0.0; 2]; points.len() + 1];
    let n = polygon(&mut points, &mut hull);
    out2(py, hull[..n].iter().flatten().copied().collect(), n, 2)
}

/// Compute the distance of a point, such as the projected centre of mass, from the nearest edge of a support polygon.
///
/// Parameters
/// ----------
/// polygon : array_like, shape (k, 2)
///     Corners, m.
/// point : array_like, shape (2,)
///     The point, m.
///
/// Returns
/// -------
/// float
///     Distance, m; negative outside the polygon.
///
/// Raises
/// ------
/// LinkworkError
///     If an array has a wrong shape or contains NaN, or the polygon has no corners.
///
/// Examples
/// --------
/// >>> linkwork.support_margin([[0, 0], [1, 0], [1, 1], [0, 1]], [0.5, 0.2])
/// 0.2
#[pyfunction]
pub fn support_margin(polygon: ArrayLike<'_, '_>, point: ArrayLike<'_, '_>) -> PyResult<f64> {
    let hull = plane(polygon, "polygon")?;
    if hull.is_empty() {
        return Err(refuse("`polygon` has no corners\n  help: give points that touch the ground"));
    }
    Ok(margin(&hull, crate::array::fixed::<2>(point, "point")?))
}
