//! Trajectories: time parameterization of paths within limits of velocity, acceleration and effort; transfers within limits of jerk.
use super::{ArrayLike, Robot, base};
use crate::array::{Array, Input, out, out1, vector};
use crate::collisions::Collisions;
use crate::core::lock;
use crate::error::{refuse, refuse_with};
use linkwork_embedded::{MotionLimits, MotionState, Path, Timed, Timing, Transfer, Transferred};
use pyo3::prelude::*;
use std::sync::Mutex;

/// The representation of a trajectory.
enum Kind {
    PlanOutcome(Box<Timing>),
    Move(Box<Transfer>),
}

/// A trajectory: configurations, rates and accelerations as functions of time. Result of `Robot.time_parameterize` and `Robot.transfer`.
///
/// Examples
/// --------
/// >>> rail = linkwork.Builder().body("cart", "world", linkwork.Hinge.slider([1, 0, 0]), mass=2, com=[0, 0, 0], inertia=np.eye(3)).build()
/// >>> robot = linkwork.Robot(rail, chains={"arm": ("world", "cart")}, colliders=[])
/// >>> motion = robot.time_parameterize([[0.0], [1.0]], acceleration=4.0)
/// >>> motion
/// Trajectory(1 s, 1 dofs)
#[pyclass(frozen, weakref, module = "linkwork")]
pub struct Trajectory {
    kind: Mutex<Kind>,
    duration: f64,
    nq: usize,
    nv: usize,
}

#[pymethods]
impl Trajectory {
    /// Duration, s.
    ///
    /// Examples
    /// --------
    /// >>> round(motion.duration, 9)
    /// 1.0
    #[getter]
    fn duration(&self) -> f64 {
        self.duration
    }

    /// Evaluate the trajectory at one time or at many.
    ///
    /// Before its beginning, it returns the start. After its end, it returns the end at rest; after a transfer that ends with nonzero rates, it
    /// continues with these rates.
    ///
    /// Parameters
    /// ----------
    /// t : array_like, scalar or shape (n,)
    ///     Time, s.
    ///
    /// Returns
    /// -------
    /// q : ndarray, shape (nq,) or (n, nq)
    ///     Configurations, rad and m.
    /// v : ndarray, shape (nv,) or (n, nv)
    ///     Rates, rad/s and m/s.
    /// a : ndarray, shape (nv,) or (n, nv)
    ///     Accelerations, rad/s² and m/s².
    ///
    /// Raises
    /// ------
    /// LinkworkError
    ///     If t has a wrong shape or contains NaN.
    ///
    /// Examples
    /// --------
    /// >>> q, v, a = motion.at(0.5)
    /// >>> q.round(6).tolist(), v.round(6).tolist(), a.round(6).tolist()
    /// ([0.5], [2.0], [-4.0])
    /// >>> motion.at(np.linspace(0, 1, 5))[0].round(6).ravel().tolist()
    /// [0.0, 0.125, 0.5, 0.875, 1.0]
    #[allow(clippy::type_complexity)]
    fn at<'py>(
        &self,
        py: Python<'py>,
        t: ArrayLike<'_, 'py>,
    ) -> PyResult<(Array<'py>, Array<'py>, Array<'py>)> {
        let input = Input::read(t, "t")?;
        let (nq, nv) = (self.nq, self.nv);
        let n = match input.shape() {
            [] => None,
            [n] => Some(*n),
            shape => {
                let fact = format!("`t` has the shape {shape:?}");
                return Err(refuse_with(fact, "give one time, or times (n,)"));
            }
        };
        let count = n.unwrap_or(1);
        let mut all = [(); 3].map(|()| Vec::new());
        for (all, width) in all.iter_mut().zip([nq, nv, nv]) {
            *all = crate::array::zeros(count, width)?;
        }
        let [q, v, a] = &mut all;
        let mut kind = lock(&self.kind);
        for (k, t) in input.slice().iter().enumerate() {
            let q = &mut q[nq * k..nq * (k + 1)];
            let (v, a) = (&mut v[nv * k..nv * (k + 1)], &mut a[nv * k..nv * (k + 1)]);
            match &mut *kind {
                Kind::PlanOutcome(timing) => timing.at(*t, q, v, a),
                Kind::Move(transfer) => transfer.at(*t, q, v, a),
            }
            .map_err(refuse)?;
        }
        let shape = |width: usize| n.map_or(vec![width], |n| vec![n, width]);
        let [q, v, a] = all;
        Ok((out(py, q, &shape(nq))?, out(py, v, &shape(nv))?, out(py, a, &shape(nv))?))
    }

    fn __repr__(&self) -> String {
        format!("Trajectory({:.6} s, {} dofs)", self.duration, self.nv).replace(".000000 s", " s")
    }
}

impl Collisions {
    /// Reads a limit of each degree of freedom: one number for all, or (nv,). Infinite limits are allowed.
    fn limit(&self, given: Option<ArrayLike<'_, '_>>, what: &str, to: &mut [f64]) -> PyResult<()> {
        let Some(given) = given else { return Ok(()) };
        let wrong = || {
            let help = format!("give one number, or ({},); math.inf where there is none", to.len());
            refuse_with(format!("`{what}` is not a limit for each degree of freedom"), help)
        };
        if let Ok(one) = given.extract::<f64>() {
            to.fill(one);
            return Ok(());
        }
        // Infinite limits are allowed, so the usual check of arrays cannot be used.
        let all: Vec<f64> =
            given.extract().map_err(|e| crate::error::unless_own(given.py(), e, |_| wrong()))?;
        if all.len() != to.len() {
            return Err(wrong());
        }
        to.copy_from_slice(&all);
        Ok(())
    }

    fn limits(
        &self,
        rate: Option<ArrayLike<'_, '_>>,
        acceleration: Option<ArrayLike<'_, '_>>,
        jerk: Option<ArrayLike<'_, '_>>,
        effort: Option<ArrayLike<'_, '_>>,
    ) -> PyResult<MotionLimits> {
        let mut limits = MotionLimits::of(&self.model);
        self.limit(rate, "rate", &mut limits.rate)?;
        self.limit(acceleration, "acceleration", &mut limits.acceleration)?;
        self.limit(jerk, "jerk", &mut limits.jerk)?;
        self.limit(effort, "effort", &mut limits.effort)?;
        Ok(limits)
    }
}

#[pymethods]
impl Robot {
    /// Compute the time-optimal trajectory along a path, from rest to rest (time parameterization).
    ///
    /// Between the configurations of the path, all coordinates move linearly. Limits hold everywhere on the trajectory. Its duration exceeds the
    /// optimum by a fraction that decreases as 1/sections. The robot's own q does not change. Joints that mimic others must follow them in every
    /// configuration of the path; they have no motor, so their forces count at the joints that they follow.
    ///
    /// Parameters
    /// ----------
    /// path : array_like, shape (n, nq)
    ///     The path, rad and m, such as the result of `plan`.
    /// acceleration : float or array_like, shape (nv,), optional
    ///     Acceleration limits, rad/s² and m/s² (default: none).
    /// rate : float or array_like, shape (nv,), optional
    ///     Velocity limits, rad/s and m/s (default: those of the mechanism).
    /// effort : float or array_like, shape (nv,), optional
    ///     Limits of the hinge forces, N m and N, including gravity and grasped objects (default: those of the mechanism).
    /// round : float
    ///     0 stops at each corner. A positive value rounds corners within this distance of the path (2-norm of rad and m) and checks the rounded
    ///     path for collisions (default: 0).
    /// sections : int, optional
    ///     Number of sections of the time-optimal control problem (default: 100 for each configuration).
    ///
    /// Returns
    /// -------
    /// Trajectory
    ///     The trajectory.
    ///
    /// Raises
    /// ------
    /// LinkworkError
    ///     If no trajectory satisfies the limits: the attribute `q` of the error is where it becomes infeasible, and `share` is the factor by
    ///     which all acceleration and effort limits would have to be multiplied. Also if a rounded corner touches something, a limit is not
    ///     positive, the velocity along the path is unbounded, or an array has a wrong shape or contains NaN.
    ///
    /// Examples
    /// --------
    /// >>> robot.time_parameterize([[0, 0, 0], [0.5, 0.2, 0.1], [0.6, 0.8, 0.3]], rate=1.0, acceleration=2.0, round=0.1)
    /// Trajectory(1.562001 s, 3 dofs)
    /// >>> robot.time_parameterize([[0, 0, 0], [0.5, 0.2, 0.1]], rate=1.0, acceleration=2.0, effort=0.1)  # doctest: +ELLIPSIS
    /// Traceback (most recent call last):
    /// linkwork.LinkworkError: no trajectory along the path satisfies the limits ...
    #[pyo3(signature = (path, *, acceleration=None, rate=None, effort=None, round=0.0, sections=None))]
    fn time_parameterize(
        slf: &Bound<'_, Self>,
        path: ArrayLike<'_, '_>,
        acceleration: Option<ArrayLike<'_, '_>>,
        rate: Option<ArrayLike<'_, '_>>,
        effort: Option<ArrayLike<'_, '_>>,
        round: f64,
        sections: Option<usize>,
    ) -> PyResult<Trajectory> {
        let own = base(slf);
        let (nq, nv) = (own.model.nq(), own.model.nv());
        let input = Input::read(path, "path")?;
        let rows = match input.shape() {
            [rows, width] if *width == nq && *rows >= 1 => *rows,
            shape => {
                let fact = format!("`path` has the shape {shape:?}");
                return Err(refuse_with(fact, format!("give it the shape (n, {nq})")));
            }
        };
        let limits = own.limits(rate, acceleration, None, effort)?;
        let mut robot = lock(&own.robot).clone();
        let sections = sections.unwrap_or(100 * rows.max(2));
        if sections > 1_000_000 {
            let fact = format!("`sections` is {sections}");
            return Err(refuse_with(fact, "give at most 1000000"));
        }
        let mut timing = Timing::new(&robot, rows.max(2), sections).map_err(refuse)?;
        let mut work = || {
            let timed = timing.plan(&mut robot, input.slice(), &limits, round)?;
            let free = match (timed, round > 0.0) {
                (Timed::Found { .. }, true) => timing.free(&mut robot, 1e-3)?,
                _ => Path::Free,
            };
            Ok((timed, free))
        };
        let (timed, free) = work().map_err(|e: linkwork_embedded::RobotError| refuse(e))?;
        match free {
            Path::Free => {}
            Path::Hit { pair, .. } => {
                let (a, b) = own.names(pair);
                let fact = format!("`{a}` touches `{b}` where a corner is rounded");
                return Err(refuse_with(fact, "give a smaller `round`, or 0"));
            }
            Path::Undecided { .. } => {
                let fact = "a rounded corner passes an obstacle too closely to prove that it is collision-free";
                return Err(refuse_with(fact, "give a smaller `round`, or 0"));
            }
        }
        match timed {
            Timed::Found { duration } => {
                let kind = Mutex::new(Kind::PlanOutcome(Box::new(timing)));
                Ok(Trajectory { kind, duration, nq, nv })
            }
            Timed::Infeasible { part, share } => {
                let error = refuse_with(
                    format!(
                        "no trajectory along the path satisfies the limits beyond the fraction {:.4} of the path",
                        part
                    ),
                    format!(
                        "{share:.6} times the acceleration and effort limits would suffice (the error's `share`); its `q` is the configuration there"
                    ),
                );
                let mut q = vec![0.0; nq];
                timing.place(part, &mut q).map_err(refuse)?;
                let value = error.value(slf.py());
                value.setattr("q", out1(slf.py(), q))?;
                value.setattr("share", share)?;
                Err(error)
            }
        }
    }

    /// Compute the fastest trajectory between two states within limits of velocity, acceleration and jerk. All coordinates arrive together.
    ///
    /// Obstacles are not checked; use `path` for that.
    ///
    /// Parameters
    /// ----------
    /// goal : array_like, shape (nq,)
    ///     Goal configuration, rad and m.
    /// start : array_like, shape (nq,), optional
    ///     Start configuration (default: the robot's own).
    /// v, a, goal_v, goal_a : array_like, shape (nv,), optional
    ///     Rates and accelerations at the start and at the goal (default: zeros).
    /// rate : float or array_like, shape (nv,), optional
    ///     Velocity limits, rad/s and m/s (default: those of the mechanism).
    /// acceleration : float or array_like, shape (nv,)
    ///     Acceleration limits, rad/s² and m/s².
    /// jerk : float or array_like, shape (nv,)
    ///     Jerk limits, rad/s³ and m/s³.
    ///
    /// Returns
    /// -------
    /// Trajectory
    ///     The trajectory.
    ///
    /// Raises
    /// ------
    /// LinkworkError
    ///     If the trajectory leaves the limits of a coordinate (the attribute `value` of the error is the coordinate's extreme value), the start
    ///     or goal state violates limits, a limit is not positive, or an array has a wrong shape or contains NaN.
    ///
    /// Examples
    /// --------
    /// >>> move = robot.transfer([0.5, 0.2, 0.1], start=[0, 0, 0], rate=1.0, acceleration=2.0, jerk=8.0)
    /// >>> round(move.duration, 9)
    /// 1.280776406
    #[pyo3(signature = (goal, *, start=None, v=None, a=None, goal_v=None, goal_a=None, rate=None, acceleration, jerk))]
    fn transfer(
        slf: &Bound<'_, Self>,
        goal: ArrayLike<'_, '_>,
        start: Option<ArrayLike<'_, '_>>,
        v: Option<ArrayLike<'_, '_>>,
        a: Option<ArrayLike<'_, '_>>,
        goal_v: Option<ArrayLike<'_, '_>>,
        goal_a: Option<ArrayLike<'_, '_>>,
        rate: Option<ArrayLike<'_, '_>>,
        acceleration: ArrayLike<'_, '_>,
        jerk: ArrayLike<'_, '_>,
    ) -> PyResult<Trajectory> {
        let own = base(slf);
        let (nq, nv) = (own.model.nq(), own.model.nv());
        let rates = |x: Option<ArrayLike<'_, '_>>, what: &str| match x {
            Some(x) => Ok(vector(x, nv, what)?.slice().to_vec()),
            None => Ok::<_, PyErr>(vec![0.0; nv]),
        };
        let from = (own.q_or_own(start)?, rates(v, "v")?, rates(a, "a")?);
        let goal = vector(goal, nq, "goal")?;
        let to = (goal.slice(), rates(goal_v, "goal_v")?, rates(goal_a, "goal_a")?);
        let limits = own.limits(rate, Some(acceleration), Some(jerk), None)?;
        let mut transfer = Transfer::new(&lock(&own.robot));
        let from = MotionState { q: &from.0, v: &from.1, vdot: &from.2 };
        let to = MotionState { q: to.0, v: &to.1, vdot: &to.2 };
        match transfer.plan(&from, &to, &limits).map_err(refuse)? {
            Transferred::Found { duration } => {
                let kind = Mutex::new(Kind::Move(Box::new(transfer)));
                Ok(Trajectory { kind, duration, nq, nv })
            }
            Transferred::LeavesLimits { dof, value, .. } => {
                let error = refuse_with(
                    format!(
                        "the trajectory moves coordinate {dof} of v to {value}, beyond its limits"
                    ),
                    "start slower or farther from the limit, or increase the limits of acceleration and jerk",
                );
                error.value(slf.py()).setattr("value", value)?;
                Err(error)
            }
        }
    }
}
