//! Motions in time: ways within limits of rate, acceleration and effort; moves with limits of jerk.
use super::{Given, Robot, base};
use crate::array::{Array, Input, out, out1, vector};
use crate::collisions::Collisions;
use crate::core::lock;
use crate::error::{refuse, refuse_with};
use linkwork_embedded::{MotionLimits, MotionState, Path, Timed, Timing, Transfer, Transferred};
use pyo3::prelude::*;
use std::sync::Mutex;

/// What tells where the robot is at a time.
enum Kind {
    PlanOutcome(Box<Timing>),
    Move(Box<Transfer>),
}

/// A motion in time, of `Robot.time_parameterize` and `Robot.transfer`: configurations, rates and accelerations at any time.
///
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
    /// How long it takes, s.
    ///
    /// >>> round(motion.duration, 9)
    /// 1.0
    #[getter]
    fn duration(&self) -> f64 {
        self.duration
    }

    /// Configurations, rates and accelerations at a time, s: (nq,), (nv,), (nv,); or at many times (n,): (n, nq), (n, nv), (n, nv). Before its beginning
    /// it is at its start; after its end it stays there, or, after a move that ends with rates, goes on with them. Raises LinkworkError for NaN and other shapes.
    ///
    /// >>> q, v, a = motion.at(0.5)
    /// >>> q.round(6).tolist(), v.round(6).tolist(), a.round(6).tolist()
    /// ([0.5], [2.0], [-4.0])
    /// >>> motion.at(np.linspace(0, 1, 5))[0].round(6).ravel().tolist()
    /// [0.0, 0.125, 0.5, 0.875, 1.0]
    #[allow(clippy::type_complexity)]
    fn at<'py>(
        &self,
        py: Python<'py>,
        t: Given<'_, 'py>,
    ) -> PyResult<(Array<'py>, Array<'py>, Array<'py>)> {
        let input = Input::read(t, "t")?;
        let (nq, nv) = (self.nq, self.nv);
        let n = match input.shape() {
            [] => None,
            [n] => Some(*n),
            shape => {
                let fact = format!("`t` has the shape {shape:?}");
                return Err(refuse_with(fact, "give a time, or times (n,)"));
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
    /// A limit of each degree of freedom: one number for all, or (nv,); infinite ones are allowed.
    fn limit(&self, given: Option<Given<'_, '_>>, what: &str, to: &mut [f64]) -> PyResult<()> {
        let Some(given) = given else { return Ok(()) };
        let wrong = || {
            let help = format!("give one number, or ({},); math.inf where there is none", to.len());
            refuse_with(format!("`{what}` is no limit of each degree of freedom"), help)
        };
        if let Ok(one) = given.extract::<f64>() {
            to.fill(one);
            return Ok(());
        }
        // Infinities are limits here, so that the usual reading of arrays does not do.
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
        rate: Option<Given<'_, '_>>,
        acceleration: Option<Given<'_, '_>>,
        jerk: Option<Given<'_, '_>>,
        effort: Option<Given<'_, '_>>,
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
    /// A way (n, nq), as `plan` gives it, in the least time from rest to rest: a Trajectory within limits of rate (rad/s, m/s), acceleration (rad/s², m/s²) and effort (N m,
    /// N; gravity and what is held count). Each is one number or (nv,); None: of rate and effort those of the mechanism, of acceleration none.
    ///
    /// Between its configurations all coordinates move in proportion. With round 0 it stands still at each corner; else corners are rounded, within `round` of
    /// the way (root of the sum of squares of rad and m), and proven free. sections: pieces of time-optimal control, 100 for each configuration at first. Limits
    /// hold everywhere; the time is above the least by a share that falls as 1/sections. The robot's own q does not change. Raises LinkworkError when no motion keeps the limits: its attributes `q`
    /// (where it becomes impossible) and `share` (what all limits of acceleration and effort would have to be multiplied by); when a rounded corner touches something;
    /// for limits that are not above zero, a way whose speed nothing bounds, other shapes and NaN.
    ///
    /// >>> robot.time_parameterize([[0, 0, 0], [0.5, 0.2, 0.1], [0.6, 0.8, 0.3]], rate=1.0, acceleration=2.0, round=0.1)
    /// Trajectory(1.562001 s, 3 dofs)
    /// >>> robot.time_parameterize([[0, 0, 0], [0.5, 0.2, 0.1]], rate=1.0, acceleration=2.0, effort=0.1)  # doctest: +ELLIPSIS
    /// Traceback (most recent call last):
    /// linkwork.LinkworkError: no motion along the way keeps the limits ...
    #[pyo3(signature = (way, *, acceleration=None, rate=None, effort=None, round=0.0, sections=None))]
    fn time_parameterize(
        slf: &Bound<'_, Self>,
        way: Given<'_, '_>,
        acceleration: Option<Given<'_, '_>>,
        rate: Option<Given<'_, '_>>,
        effort: Option<Given<'_, '_>>,
        round: f64,
        sections: Option<usize>,
    ) -> PyResult<Trajectory> {
        let own = base(slf);
        let (nq, nv) = (own.model.nq(), own.model.nv());
        let input = Input::read(way, "way")?;
        let rows = match input.shape() {
            [rows, width] if *width == nq && *rows >= 1 => *rows,
            shape => {
                let fact = format!("`way` has the shape {shape:?}");
                return Err(refuse_with(fact, format!("give it the shape (n, {nq})")));
            }
        };
        let limits = own.limits(rate, acceleration, None, effort)?;
        let mut robot = lock(&own.robot).clone();
        let sections = sections.unwrap_or(100 * rows.max(2));
        if sections > 1_000_000 {
            let fact = format!("`sections` is {sections}");
            return Err(refuse_with(fact, "give 1000000 at most"));
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
                let fact = "a rounded corner passes too near to tell it free";
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
                    format!("no motion along the way keeps the limits from {:.4} of it on", part),
                    format!(
                        "{share:.6} times the acceleration and effort would do (the error's `share`); the place is its `q`"
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

    /// The fastest move from one state to another with limits of rate (rad/s, m/s), acceleration (rad/s², m/s²) and jerk (rad/s³, m/s³), all coordinates arriving together: a
    /// Trajectory. goal (nq,); start (nq,; None: the robot's own q); v, a: rates and accelerations (nv,) at the start, goal_v, goal_a at the end (None: rest). A limit
    /// is one number or (nv,); a rate of None is the mechanism's. Nothing is asked about obstacles: that is `path`'s. Raises LinkworkError when the move
    /// leaves the limits of a coordinate (its attribute `value`: how far it comes), for ends that limits forbid, limits that are not above zero, other shapes and NaN.
    ///
    /// >>> move = robot.transfer([0.5, 0.2, 0.1], start=[0, 0, 0], rate=1.0, acceleration=2.0, jerk=8.0)
    /// >>> round(move.duration, 9)
    /// 1.280776406
    #[pyo3(signature = (goal, *, start=None, v=None, a=None, goal_v=None, goal_a=None, rate=None, acceleration, jerk))]
    fn transfer(
        slf: &Bound<'_, Self>,
        goal: Given<'_, '_>,
        start: Option<Given<'_, '_>>,
        v: Option<Given<'_, '_>>,
        a: Option<Given<'_, '_>>,
        goal_v: Option<Given<'_, '_>>,
        goal_a: Option<Given<'_, '_>>,
        rate: Option<Given<'_, '_>>,
        acceleration: Given<'_, '_>,
        jerk: Given<'_, '_>,
    ) -> PyResult<Trajectory> {
        let own = base(slf);
        let (nq, nv) = (own.model.nq(), own.model.nv());
        let rates = |x: Option<Given<'_, '_>>, what: &str| match x {
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
                    format!("the move takes coordinate {dof} of v to {value}, beyond its limits"),
                    "start slower or farther from the limit, or allow more acceleration and jerk",
                );
                error.value(slf.py()).setattr("value", value)?;
                Err(error)
            }
        }
    }
}
