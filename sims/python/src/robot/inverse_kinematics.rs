//! Inverse kinematics of `Robot` by tasks: one solution, the best one, all solutions of a closed form.
use super::search::{InverseKinematicsSearch, SearchArguments};
use super::{ArrayLike, Robot, base, count_of, frame};
use crate::array::{Array1, Array2, out1, out2};
use crate::core::lock;
use crate::error::{refuse, refuse_with};
use crate::inverse_kinematics::{Parts, place};
use linkwork_embedded::{ClosedForm, Effort, Goal, Outcome, Prefer};
use pyo3::prelude::*;

#[pymethods]
impl Robot {
    /// Compute a configuration within the limits in which the tip of a chain meets a goal.
    ///
    /// Only the chain moves. The robot's own q does not change.
    ///
    /// Parameters
    /// ----------
    /// part : str
    ///     Name of the chain.
    /// at : array_like, optional
    ///     The goal, determined by its shape: (3,) position of the tip, m; (4,) attitude [x y z w]; (3, 3) attitude as a matrix; (7,) position
    ///     and attitude; (4, 4) pose.
    /// q : array_like, shape (nq,), optional
    ///     Start, rad and m (default: the robot's own).
    /// in_base : bool
    ///     The goal is given in the chain's base instead of the world (default: False).
    /// position_tolerance, orientation_tolerance : float
    ///     Tolerances, m and rad.
    /// steps : int
    ///     Largest number of steps from each start.
    /// restarts : int
    ///     Number of further starts. They are the same in every call.
    /// axis, along, look_at, within, plane, line : optional
    ///     Parts of a pose, as in `Target`.
    ///
    /// Returns
    /// -------
    /// ndarray, shape (nq,)
    ///     The solution, rad and m.
    ///
    /// Raises
    /// ------
    /// LinkworkError
    ///     If no start leads to a solution. The attributes `q` and `residual` of the error are the nearest configuration and its errors (m, rad).
    ///
    /// Examples
    /// --------
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
        at: Option<ArrayLike<'_, 'py>>,
        q: Option<ArrayLike<'_, 'py>>,
        in_base: bool,
        position_tolerance: f64,
        orientation_tolerance: f64,
        steps: usize,
        restarts: usize,
        axis: Option<ArrayLike<'_, 'py>>,
        along: Option<ArrayLike<'_, 'py>>,
        look_at: Option<ArrayLike<'_, 'py>>,
        within: f64,
        plane: Option<ArrayLike<'_, 'py>>,
        line: Option<ArrayLike<'_, 'py>>,
    ) -> PyResult<Array1<'py>> {
        let parts = Parts { axis, along, look_at, within, plane, line };
        let tolerances = [position_tolerance, orientation_tolerance];
        SearchArguments { part, at, q, in_base, tolerances, steps, restarts, parts }.solve(slf)
    }

    /// Create the search of `inverse_kinematics` without running it. `InverseKinematicsSearch.advance` does the work in portions.
    ///
    /// Parameters
    /// ----------
    /// part, at, q, in_base, position_tolerance, orientation_tolerance, steps, restarts, axis, along, look_at, within, plane, line : optional
    ///     As in `inverse_kinematics`: q has the shape (nq,); units are m and rad.
    ///
    /// Returns
    /// -------
    /// InverseKinematicsSearch
    ///     The search.
    ///
    /// Raises
    /// ------
    /// LinkworkError
    ///     If an argument is not valid. A failed search is reported by the InverseKinematicsSearch.
    ///
    /// Examples
    /// --------
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
        at: Option<ArrayLike<'_, 'py>>,
        q: Option<ArrayLike<'_, 'py>>,
        in_base: bool,
        position_tolerance: f64,
        orientation_tolerance: f64,
        steps: usize,
        restarts: usize,
        axis: Option<ArrayLike<'_, 'py>>,
        along: Option<ArrayLike<'_, 'py>>,
        look_at: Option<ArrayLike<'_, 'py>>,
        within: f64,
        plane: Option<ArrayLike<'_, 'py>>,
        line: Option<ArrayLike<'_, 'py>>,
    ) -> PyResult<InverseKinematicsSearch> {
        let parts = Parts { axis, along, look_at, within, plane, line };
        let tolerances = [position_tolerance, orientation_tolerance];
        SearchArguments { part, at, q, in_base, tolerances, steps, restarts, parts }.search(slf)
    }

    /// Compute the best of several configurations within the limits in which the tip of a chain meets a goal.
    ///
    /// Only the chain moves. The search begins at q and at other configurations, which are the same in every call. Each solution is improved along
    /// the null space to a local minimum of
    ///
    /// cost = centred ½ Σ ((q − middle)/(upper − lower))² + near ½ Σ ((q − q₀)/(upper − lower))² − manipulable ln w,
    ///
    /// with the middle of the limits, the start q₀, and w of `manipulability(part, length=length)`.
    ///
    /// Parameters
    /// ----------
    /// part : str
    ///     Name of the chain.
    /// at : array_like, optional
    ///     The goal, as in `inverse_kinematics`, m and rad.
    /// q : array_like, shape (nq,), optional
    ///     Start q₀, rad and m (default: the robot's own).
    /// centred, near, manipulable : float
    ///     Weights of the cost terms.
    /// length : float
    ///     Length, m, that weights 1 rad in w.
    /// starts : int
    ///     Number of searches.
    /// improve : int
    ///     Largest number of evaluations of the kinematics for the improvement of each solution.
    /// in_base, axis, along, look_at, within, plane, line : optional
    ///     As in `inverse_kinematics`.
    ///
    /// Returns
    /// -------
    /// q : ndarray, shape (nq,)
    ///     The best configuration.
    /// cost : float
    ///     Its cost.
    ///
    /// Raises
    /// ------
    /// LinkworkError
    ///     If no start leads to a solution (the attribute `q` of the error is the result of the last search), or a weight is negative, or all
    ///     weights are zero.
    ///
    /// Examples
    /// --------
    /// >>> first = robot.inverse_kinematics("arm", [0.6, 0, 0.2], q=[0.3, 0.3, 0.3])
    /// >>> best, cost = robot.inverse_kinematics_best("arm", [0.6, 0, 0.2], q=[0.3, 0.3, 0.3], starts=8)
    /// >>> bool(cost <= 0.5 * ((first / 6) ** 2).sum())     # limits of −3 … 3 rad
    /// True
    #[pyo3(signature = (part, at=None, q=None, *, centred=1.0, near=0.0, manipulable=0.0, length=1.0, starts=8, improve=400, in_base=false, axis=None, along=None, look_at=None, within=0.0, plane=None, line=None))]
    #[allow(clippy::too_many_arguments)]
    fn inverse_kinematics_best<'py>(
        slf: &Bound<'py, Self>,
        part: &str,
        at: Option<ArrayLike<'_, 'py>>,
        q: Option<ArrayLike<'_, 'py>>,
        centred: f64,
        near: f64,
        manipulable: f64,
        length: f64,
        starts: usize,
        improve: usize,
        in_base: bool,
        axis: Option<ArrayLike<'_, 'py>>,
        along: Option<ArrayLike<'_, 'py>>,
        look_at: Option<ArrayLike<'_, 'py>>,
        within: f64,
        plane: Option<ArrayLike<'_, 'py>>,
        line: Option<ArrayLike<'_, 'py>>,
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
        let fact =
            format!("the tip of `{name}` does not reach its goal from any of {starts} starts");
        let error = refuse_with(fact, "use more `starts`, another q, or a less restrictive goal");
        error.value(slf.py()).setattr("q", q)?;
        Err(error)
    }

    /// Compute all configurations within the limits in which the tip of an arm with six or seven hinges has a given pose, in closed form.
    ///
    /// Closed forms exist for a wrist or shoulder of three axes that intersect in a point, and for three parallel axes in the middle.
    ///
    /// Parameters
    /// ----------
    /// part : str
    ///     Name of the chain.
    /// at : array_like, shape (7,) or (4, 4)
    ///     Pose of the tip, m.
    /// q : array_like, shape (nq,), optional
    ///     Reference configuration, rad and m (default: the robot's own). Solutions are sorted by their distance from it.
    /// held : int, optional
    ///     For seven hinges: index in v (see `dofs`) of the hinge that keeps its value in q. By default a suitable hinge is chosen.
    /// in_base : bool
    ///     The pose is given in the chain's base instead of the world (default: False).
    ///
    /// Returns
    /// -------
    /// ndarray, shape (k, nq)
    ///     The solutions; (0, nq) if there are none. Each meets the pose within 1e-9 m and rad.
    ///
    /// Raises
    /// ------
    /// LinkworkError
    ///     If the chain does not have a closed form, or `at` is not a pose.
    ///
    /// Examples
    /// --------
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
        at: ArrayLike<'_, 'py>,
        q: Option<ArrayLike<'_, 'py>>,
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
}
