//! Inverse kinematics of several tips of `Robot` at once.
use super::search::{InverseKinematicsSearch, SearchState, ended};
use super::{ArrayLike, Robot, above_zero, base};
use crate::array::{Array1, out1};
use crate::collisions::Collisions;
use crate::core::lock;
use crate::error::{refuse, refuse_with};
use crate::inverse_kinematics::targets_of;
use linkwork_embedded::{
    Answer, Effort, Frame, Goal, Outcome, Prefer, Residual, RobotError, TipGoal, WholeBodyIk,
};
use pyo3::prelude::*;

/// Arguments of a search, and the search.
struct WholeBodySearch {
    /// The beginning of messages.
    name: String,
    goals: Vec<TipGoal>,
    search: WholeBodyIk,
    q: Vec<f64>,
}

impl Collisions {
    fn ask_together(
        &self,
        targets: ArrayLike<'_, '_>,
        q: Option<ArrayLike<'_, '_>>,
        in_base: Option<Vec<String>>,
        keep: Option<Vec<String>>,
    ) -> PyResult<WholeBodySearch> {
        let (mut goals, mut names) = (Vec::new(), Vec::new());
        let in_base = in_base.unwrap_or_default();
        for name in &in_base {
            self.part(name)?;
        }
        for target in targets_of(targets)? {
            let (name, seen_from, goal) = target.parts();
            let part = self.part(name)?;
            let own_base = in_base.iter().any(|b| b == name);
            let frame = match (seen_from, own_base) {
                (None, false) => Frame::World,
                (None, true) => Frame::Base,
                (Some(other), false) => Frame::Tip(self.part(other)?),
                (Some(_), true) => {
                    let fact = format!(
                        "the goal of `{name}` is given both in its base and relative to a tip"
                    );
                    return Err(refuse_with(
                        fact,
                        "omit `relative_to`, or remove the part from `in_base`",
                    ));
                }
            };
            goals.push(TipGoal { part, goal, frame });
            names.push(format!("`{name}`"));
        }
        let name = match &names[..] {
            [] => "the grasped objects do not close".to_owned(),
            [one] => format!("the tip of {one} does not reach its goal"),
            all => format!("the tips of {} do not reach their goals", all.join(", ")),
        };
        let mut search = WholeBodyIk::new(&lock(&self.robot), goals.len());
        for kept in keep.unwrap_or_default() {
            for body in self.model.bodies(self.part(&kept)?).map_err(refuse)? {
                let dofs: Vec<usize> = self.model.multibody().get(*body).v().collect();
                search.keep(&dofs).map_err(refuse)?;
            }
        }
        Ok(WholeBodySearch { name, goals, search, q: self.q_or_own(q)? })
    }
}

fn effort_of(tolerances: [f64; 2], steps: usize, restarts: usize) -> PyResult<Effort> {
    above_zero("position_tolerance", tolerances[0])?;
    above_zero("orientation_tolerance", tolerances[1])?;
    Ok(Effort { tolerances, steps, restarts, kinematics: 0 })
}

impl WholeBodySearch {
    /// Creates the search without running it.
    fn begin(mut self, own: &Collisions, effort: &Effort) -> PyResult<InverseKinematicsSearch> {
        self.search.begin(&lock(&own.robot), &self.goals, effort, &self.q).map_err(refuse)?;
        let residual = Residual { position: 0.0, orientation: 0.0 };
        let answer = Answer { outcome: Outcome::Unfinished, residual, kinematics: 0, restart: 0 };
        let now = SearchState::of(self.q, answer);
        Ok(InverseKinematicsSearch::whole(self.name, self.search, now))
    }
}

#[pymethods]
impl Robot {
    /// Compute a configuration within the joint limits that brings several tips to their goals at the same time.
    ///
    /// Everything that carries the tips moves, for example a torso with both arms. An object that two hands hold stays in both hands; its loop need
    /// not be closed at the start. Without targets, the function closes such loops. The robot's own q does not change.
    ///
    /// Parameters
    /// ----------
    /// targets : dict or sequence of Target
    ///     {part: at} with `at` as in `inverse_kinematics` (m and rad, in the world), or Targets with names of parts as frames. `relative_to` of
    ///     a Target is a part at whose tip the target is seen.
    /// q : array_like, shape (nq,), optional
    ///     Start, rad and m (default: the robot's own).
    /// in_base : sequence of str, optional
    ///     Parts whose goals are given in their bases.
    /// keep : sequence of str, optional
    ///     Parts whose hinges do not move.
    /// position_tolerance, orientation_tolerance, steps, restarts : optional
    ///     As in `inverse_kinematics`.
    ///
    /// Returns
    /// -------
    /// ndarray, shape (nq,)
    ///     The solution, rad and m.
    ///
    /// Raises
    /// ------
    /// LinkworkError
    ///     If no start leads to a solution. The attributes `q` and `residual` of the error are the nearest configuration with closed loops and
    ///     its largest errors (m, rad). If a loop cannot be closed, they are the configuration with the smallest closure error, and that error.
    ///
    /// Examples
    /// --------
    /// >>> torso = linkwork.Builder().body("chest", "world", linkwork.Hinge.pin([0, 0, 1]).limits(-1, 1), mass=5)
    /// >>> for side, y in [("left", 0.2), ("right", -0.2)]:
    /// ...     parent = "chest"
    /// ...     for k, axis in enumerate([[0, 0, 1], [0, 1, 0], [0, 1, 0]]):
    /// ...         at = [0, y, 0.4] if k == 0 else [0.3, 0, 0] if k == 2 else [0, 0, 0]
    /// ...         torso = torso.body(f"{side}{k}", parent, linkwork.Hinge.pin(axis).limits(-2, 2), mass=1, com=[0.1, 0, 0], hinge_in_parent=at)
    /// ...         parent = f"{side}{k}"
    /// ...     torso = torso.body(f"{side}_hand", parent, mass=0.1, hinge_in_parent=[0.3, 0, 0])
    /// >>> two = linkwork.Robot(torso.build(), chains={side: ("chest", f"{side}_hand") for side in ["left", "right"]}, colliders=[])
    /// >>> q = two.inverse_kinematics_together({"left": [0.4, 0.3, 0.2], "right": [0.45, -0.1, 0.3]}, q=[0.1] * 7)
    /// >>> two.q = q
    /// >>> two.tip_pose("left")[:3, 3].round(6).tolist(), two.tip_pose("right")[:3, 3].round(6).tolist()
    /// ([0.4, 0.3, 0.2], [0.45, -0.1, 0.3])
    /// >>> beside = linkwork.Target("right", [0.1, -0.2, 0], relative_to="left")
    /// >>> two.q = two.inverse_kinematics_together([linkwork.Target("left", [0.4, 0.2, 0.3]), beside])
    /// >>> seen = np.linalg.inv(two.tip_pose("left")) @ two.tip_pose("right")
    /// >>> bool(np.allclose(seen[:3, 3], [0.1, -0.2, 0]))
    /// True
    #[pyo3(signature = (targets, q=None, *, in_base=None, keep=None, position_tolerance=1e-9, orientation_tolerance=1e-9, steps=100, restarts=64))]
    #[allow(clippy::too_many_arguments)]
    fn inverse_kinematics_together<'py>(
        slf: &Bound<'py, Self>,
        targets: ArrayLike<'_, 'py>,
        q: Option<ArrayLike<'_, 'py>>,
        in_base: Option<Vec<String>>,
        keep: Option<Vec<String>>,
        position_tolerance: f64,
        orientation_tolerance: f64,
        steps: usize,
        restarts: usize,
    ) -> PyResult<Array1<'py>> {
        let (own, py) = (base(slf), slf.py());
        let effort = effort_of([position_tolerance, orientation_tolerance], steps, restarts)?;
        let asked = own.ask_together(targets, q, in_base, keep)?;
        let name = asked.name.clone();
        let search = asked.begin(own, &effort)?;
        search.resume(py, usize::MAX)?;
        ended(py, &name, search.now(py))
    }

    /// Create the search of `inverse_kinematics_together` without running it. `InverseKinematicsSearch.advance` does the work in portions.
    ///
    /// The search uses the grasped objects at this moment.
    ///
    /// Parameters
    /// ----------
    /// targets, q, in_base, keep, position_tolerance, orientation_tolerance, steps, restarts : optional
    ///     As in `inverse_kinematics_together`: q has the shape (nq,); units are m and rad.
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
    /// >>> robot.q = [0.3, 0.3, 0.3]
    /// >>> search = robot.begin_inverse_kinematics_together({"arm": [0.6, 0, 0.2]})
    /// >>> while not search.advance(100):
    /// ...     pass
    /// >>> search
    /// InverseKinematicsSearch(arm, met)
    /// >>> len(search.residuals)
    /// 1
    #[pyo3(signature = (targets, q=None, *, in_base=None, keep=None, position_tolerance=1e-9, orientation_tolerance=1e-9, steps=100, restarts=64))]
    #[allow(clippy::too_many_arguments)]
    fn begin_inverse_kinematics_together<'py>(
        slf: &Bound<'py, Self>,
        targets: ArrayLike<'_, 'py>,
        q: Option<ArrayLike<'_, 'py>>,
        in_base: Option<Vec<String>>,
        keep: Option<Vec<String>>,
        position_tolerance: f64,
        orientation_tolerance: f64,
        steps: usize,
        restarts: usize,
    ) -> PyResult<InverseKinematicsSearch> {
        let own = base(slf);
        let effort = effort_of([position_tolerance, orientation_tolerance], steps, restarts)?;
        own.ask_together(targets, q, in_base, keep)?.begin(own, &effort)
    }

    /// Compute the best of several configurations that `inverse_kinematics_together` can return.
    ///
    /// Parameters
    /// ----------
    /// targets, q, in_base, keep : optional
    ///     As in `inverse_kinematics_together`: q has the shape (nq,); units are m and rad.
    /// centred, near, manipulable, length, starts : optional
    ///     As in `inverse_kinematics_best`. The cost includes everything that moves, and the manipulability w of each part with a target.
    /// improve : int
    ///     Largest number of evaluations of the kinematics for the improvement of each solution.
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
    /// >>> best, cost = robot.inverse_kinematics_together_best({"arm": [0.6, 0, 0.2]}, q=[0.3, 0.3, 0.3])
    /// >>> bool(cost <= 0.5 * ((first / 6) ** 2).sum())     # limits of −3 … 3 rad
    /// True
    #[pyo3(signature = (targets, q=None, *, centred=1.0, near=0.0, manipulable=0.0, length=1.0, starts=8, improve=400, in_base=None, keep=None))]
    #[allow(clippy::too_many_arguments)]
    fn inverse_kinematics_together_best<'py>(
        slf: &Bound<'py, Self>,
        targets: ArrayLike<'_, 'py>,
        q: Option<ArrayLike<'_, 'py>>,
        centred: f64,
        near: f64,
        manipulable: f64,
        length: f64,
        starts: usize,
        improve: usize,
        in_base: Option<Vec<String>>,
        keep: Option<Vec<String>>,
    ) -> PyResult<(Array1<'py>, f64)> {
        let (own, py) = (base(slf), slf.py());
        super::count_of("starts", starts)?;
        super::count_of("improve", improve)?;
        let prefer = Prefer { centred, near, manipulable, length, starts, steps: improve };
        let WholeBodySearch { goals, mut search, mut q, .. } =
            own.ask_together(targets, q, in_base, keep)?;
        let mut robot = lock(&own.robot).clone();
        let found =
            py.detach(|| search.best(&mut robot, &goals, &prefer, &Effort::default(), &mut q));
        let error = match found {
            Ok(best) if best.outcome == Outcome::Met => return Ok((out1(py, q), best.cost)),
            Ok(_) => {
                let fact = format!("the goals are not reached from any of {starts} starts");
                refuse_with(fact, "use more `starts`, another q, or less restrictive goals")
            }
            Err(error @ RobotError::DoesNotClose { .. }) => refuse(error),
            Err(error) => return Err(refuse(error)),
        };
        error.value(py).setattr("q", out1(py, q))?;
        Err(error)
    }

    /// Return an upper bound of the number of evaluations of the kinematics in `inverse_kinematics`.
    ///
    /// The bound holds for every robot, start and goal, so a control loop can rely on it. Most searches need about a hundredth of it.
    ///
    /// Parameters
    /// ----------
    /// together : bool
    ///     Return the bound for `inverse_kinematics_together` (default: False).
    /// weight : float
    ///     Smallest weight of a target; `inverse_kinematics` uses 1.
    /// position_tolerance, orientation_tolerance : float
    ///     Tolerances, m and rad.
    /// steps, restarts : int
    ///     As in `inverse_kinematics`.
    ///
    /// Returns
    /// -------
    /// int
    ///     Number of evaluations.
    ///
    /// Raises
    /// ------
    /// LinkworkError
    ///     If a tolerance or the weight is not positive.
    ///
    /// Examples
    /// --------
    /// >>> at_most = robot.worst_case_steps(steps=20, restarts=0)
    /// >>> search = robot.begin_inverse_kinematics("arm", [5, 0, 0], q=[0.3, 0.3, 0.3], steps=20, restarts=0)
    /// >>> search.advance(at_most), search.kinematics <= at_most < 300
    /// (True, True)
    #[pyo3(signature = (*, together=false, weight=1.0, position_tolerance=1e-9, orientation_tolerance=1e-9, steps=100, restarts=64))]
    fn worst_case_steps(
        slf: &Bound<'_, Self>,
        together: bool,
        weight: f64,
        position_tolerance: f64,
        orientation_tolerance: f64,
        steps: usize,
        restarts: usize,
    ) -> PyResult<usize> {
        above_zero("weight", weight)?;
        let effort = effort_of([position_tolerance, orientation_tolerance], steps, restarts)?;
        let goal = Goal::pose(linkwork_spatial::Pose::identity()).weights(weight, weight);
        let own = base(slf);
        let first = own.model.parts().next();
        match first.filter(|_| together) {
            None => Ok(effort.worst_case_steps(&goal)),
            Some((part, _)) => {
                let search = WholeBodyIk::new(&lock(&own.robot), 0);
                Ok(search.worst_case_steps(&[TipGoal::new(part, goal)], &effort))
            }
        }
    }
}
