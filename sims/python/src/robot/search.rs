//! Inverse kinematics of `Robot`: a complete search, and a search that runs in portions.
use super::{ArrayLike, Robot, above_zero, base, frame};
use crate::array::{Array1, out1};
use crate::core::lock;
use crate::error::{refuse, refuse_with};
use crate::inverse_kinematics::{PORTION, Parts};
use linkwork_embedded::{
    self as embedded, Answer, Effort, Outcome, Part, Residual, RobotError, WholeBodyIk,
};
use pyo3::prelude::*;
use std::sync::Mutex;

/// A search for inverse kinematics that runs in portions, for planners and control loops with a time budget.
///
/// Result of `Robot.begin_inverse_kinematics` and `Robot.begin_inverse_kinematics_together`.
///
/// Notes
/// -----
/// The search uses the configuration and the grasped objects at the moment of its creation. Later changes of the robot do not affect it.
///
/// Examples
/// --------
/// >>> links = linkwork.Builder()
/// >>> for link, parent in [("upper", "world"), ("lower", "upper"), ("hand", "lower")]:
/// ...     at = [0, 0, 0] if parent == "world" else [0.4, 0, 0]
/// ...     links = links.body(link, parent, linkwork.Hinge.pin([0, -1, 0]).limits(-3, 3), mass=1, com=[0.2, 0, 0], inertia=np.eye(3) / 100, hinge_in_parent=at)
/// >>> robot = linkwork.Robot(links.build(), chains={"arm": ("world", "hand")}, colliders=[])
/// >>> search = robot.begin_inverse_kinematics("arm", [0.6, 0, 0.2], q=[0.3, 0.3, 0.3])
/// >>> while not search.advance(3):        # three evaluations of the kinematics at a time
/// ...     pass                            # what else there is to do
/// >>> search
/// InverseKinematicsSearch(arm, met)
/// >>> bool((search.solution() == robot.inverse_kinematics("arm", [0.6, 0, 0.2], q=[0.3, 0.3, 0.3])).all())
/// True
#[pyclass(frozen, weakref, module = "linkwork")]
pub struct InverseKinematicsSearch {
    name: String,
    state: Mutex<State>,
}

struct State {
    of: Of,
    now: SearchState,
}

/// Subject of the search: one chain, or several tips.
enum Of {
    Chain(Box<embedded::Robot>, Part),
    Whole(Box<WholeBodyIk>),
}

/// The present state of a search.
#[derive(Clone)]
pub(super) struct SearchState {
    pub q: Vec<f64>,
    pub answer: Answer,
    /// Residual of each goal.
    pub residuals: Vec<Residual>,
    /// The constraint that cannot be closed. The answer's residual is then its closure error.
    pub open: Option<RobotError>,
}

impl SearchState {
    pub fn of(q: Vec<f64>, answer: Answer) -> Self {
        Self { q, answer, residuals: vec![answer.residual], open: None }
    }

    /// Stores the result of a portion of a search of several tips.
    pub fn take(&mut self, told: Result<Answer, RobotError>, search: &WholeBodyIk) -> PyResult<()> {
        match told {
            Ok(answer) => self.answer = answer,
            Err(error @ RobotError::DoesNotClose { position, orientation, .. }) => {
                self.open = Some(error);
                self.answer.outcome = Outcome::Nearest;
                self.answer.residual = Residual { position, orientation };
            }
            Err(error) => return Err(refuse(error)),
        }
        self.residuals = search.residuals().to_vec();
        Ok(())
    }

    fn word(&self) -> &'static str {
        match self.answer.outcome {
            Outcome::Met => "met",
            Outcome::Nearest if self.open.is_some() => "open",
            Outcome::Nearest => "nearest",
            Outcome::Unfinished => "unfinished",
        }
    }

    fn ended(&self) -> bool {
        self.answer.outcome != Outcome::Unfinished
    }
}

/// Returns the solution, or the error with the nearest configuration. `name` begins the message.
pub(super) fn ended<'py>(py: Python<'py>, name: &str, now: SearchState) -> PyResult<Array1<'py>> {
    let SearchState { q, answer, open, .. } = now;
    let q = out1(py, q);
    let (p, R) = (answer.residual.position, answer.residual.orientation);
    let error = match (answer.outcome, open) {
        (Outcome::Met, _) => return Ok(q),
        (Outcome::Nearest, Some(open)) => refuse(open),
        (Outcome::Nearest, None) => refuse_with(
            format!("{name}: remaining error {p:.3e} m and {R:.3e} rad"),
            "use a less restrictive goal (only a position), or another start; the nearest configuration is the error's `q`",
        ),
        (Outcome::Unfinished, _) => refuse_with(
            format!(
                "the search has not ended after {} evaluations of the kinematics",
                answer.kinematics
            ),
            "call `advance` until it returns True; the nearest configuration so far is the error's `q`",
        ),
    };
    let value = error.value(py);
    value.setattr("q", q)?;
    if answer.outcome == Outcome::Nearest {
        value.setattr("residual", (p, R))?;
    }
    Err(error)
}

#[pymethods]
impl InverseKinematicsSearch {
    /// Continue the search.
    ///
    /// Each step of the search is one evaluation of the kinematics and takes a few µs, independent of the state of the search. The size of the
    /// portions does not affect the result: it is bit-identical. After Ctrl-C the search can be continued.
    ///
    /// Parameters
    /// ----------
    /// kinematics : int
    ///     Largest number of evaluations of the kinematics (default: 1000).
    ///
    /// Returns
    /// -------
    /// bool
    ///     True if the search has ended. Further calls then have no effect.
    ///
    /// Raises
    /// ------
    /// LinkworkError
    ///     If the number is negative.
    ///
    /// Examples
    /// --------
    /// >>> search = robot.begin_inverse_kinematics("arm", [0.6, 0, 0.2], q=[0.3, 0.3, 0.3])
    /// >>> search.advance(1), search.kinematics
    /// (False, 1)
    /// >>> search.advance()
    /// True
    #[pyo3(signature = (kinematics=1000))]
    fn advance(&self, py: Python<'_>, kinematics: i64) -> PyResult<bool> {
        let kinematics = usize::try_from(kinematics).map_err(|_| {
            let fact = format!("`kinematics` is {kinematics}");
            refuse_with(fact, "give the number of evaluations, 0 or more")
        })?;
        self.resume(py, kinematics)
    }

    /// Return the solution.
    ///
    /// Returns
    /// -------
    /// ndarray, shape (nq,)
    ///     The configuration, rad and m.
    ///
    /// Raises
    /// ------
    /// LinkworkError
    ///     If the search has not ended, or no start led to the goal. The attribute `q` of the error is the nearest configuration so far; after
    ///     the end of the search, `residual` has its errors (m, rad).
    ///
    /// Examples
    /// --------
    /// >>> search = robot.begin_inverse_kinematics("arm", [5.0, 0, 0], q=[0.3, 0.3, 0.3])
    /// >>> search.advance(10**6)
    /// True
    /// >>> try:
    /// ...     search.solution()
    /// ... except linkwork.LinkworkError as error:
    /// ...     round(error.residual[0], 6)
    /// 4.2
    fn solution<'py>(&self, py: Python<'py>) -> PyResult<Array1<'py>> {
        ended(py, &self.name, self.now(py))
    }

    /// State of the search: "met" (within the tolerances), "nearest" (no start led to the goal), "open" (a loop, a coupling or an object in two hands
    /// cannot be closed) or "unfinished".
    ///
    /// Examples
    /// --------
    /// >>> robot.begin_inverse_kinematics("arm", [0.6, 0, 0.2]).outcome
    /// 'unfinished'
    #[getter]
    fn outcome(&self, py: Python<'_>) -> &'static str {
        self.now(py).word()
    }

    /// The solution, or the nearest configuration so far (nq,), rad and m.
    ///
    /// Examples
    /// --------
    /// >>> robot.begin_inverse_kinematics("arm", [0.6, 0, 0.2], q=[0.3, 0.3, 0.3]).q.tolist()
    /// [0.3, 0.3, 0.3]
    #[getter]
    fn q<'py>(&self, py: Python<'py>) -> Array1<'py> {
        out1(py, self.now(py).q)
    }

    /// Position and orientation error of the tip at `q`, m and rad; None until the search has ended.
    ///
    /// For several tips, it is the largest error of each kind. If the outcome is "open", it is the closure error.
    ///
    /// Examples
    /// --------
    /// >>> robot.begin_inverse_kinematics("arm", [0.6, 0, 0.2]).residual is None
    /// True
    #[getter]
    fn residual(&self, py: Python<'_>) -> Option<(f64, f64)> {
        let now = self.now(py);
        let Residual { position, orientation } = now.answer.residual;
        now.ended().then_some((position, orientation))
    }

    /// Position and orientation error of each goal, m and rad, in the order of the goals; None until the search has ended.
    ///
    /// Examples
    /// --------
    /// >>> robot.begin_inverse_kinematics("arm", [0.6, 0, 0.2]).residuals is None
    /// True
    #[getter]
    fn residuals(&self, py: Python<'_>) -> Option<Vec<(f64, f64)>> {
        let now = self.now(py);
        let all = now.residuals.iter().map(|r| (r.position, r.orientation)).collect();
        now.ended().then_some(all)
    }

    /// Number of evaluations of the kinematics so far.
    ///
    /// Examples
    /// --------
    /// >>> robot.begin_inverse_kinematics("arm", [0.6, 0, 0.2]).kinematics
    /// 0
    #[getter]
    fn kinematics(&self, py: Python<'_>) -> usize {
        self.now(py).answer.kinematics
    }

    /// Number of the start that led to `q`; 0 is the given start.
    ///
    /// Examples
    /// --------
    /// >>> robot.begin_inverse_kinematics("arm", [0.6, 0, 0.2]).restart
    /// 0
    #[getter]
    fn restart(&self, py: Python<'_>) -> usize {
        self.now(py).answer.restart
    }

    fn __repr__(&self, py: Python<'_>) -> String {
        let now = self.now(py);
        let tips = self.name.split('`').skip(1).step_by(2).collect::<Vec<_>>().join(", ");
        format!("InverseKinematicsSearch({tips}, {})", now.word())
    }
}

impl InverseKinematicsSearch {
    /// Creates a search for several tips.
    pub(super) fn whole(name: String, search: WholeBodyIk, now: SearchState) -> Self {
        Self { name, state: Mutex::new(State { of: Of::Whole(Box::new(search)), now }) }
    }

    /// Returns the present state. The interpreter's lock is released during the wait, because another thread that runs the search may need it.
    pub(super) fn now(&self, py: Python<'_>) -> SearchState {
        py.detach(|| lock(&self.state).now.clone())
    }

    /// Continues the search in portions, with checks for Ctrl-C between them; other threads may continue it, too. Returns whether it has ended.
    pub(super) fn resume(&self, py: Python<'_>, mut kinematics: usize) -> PyResult<bool> {
        loop {
            py.check_signals()?;
            let portion = kinematics.min(PORTION);
            kinematics -= portion;
            let done: PyResult<bool> = py.detach(|| {
                let mut state = lock(&self.state);
                let State { of, now } = &mut *state;
                if !now.ended() && portion > 0 {
                    match of {
                        Of::Chain(robot, part) => {
                            let told = robot
                                .resume_inverse_kinematics(*part, portion, &mut now.q)
                                .map_err(refuse)?;
                            (now.answer, now.residuals) = (told, vec![told.residual]);
                        }
                        Of::Whole(search) => {
                            let told = search.resume(portion, &mut now.q);
                            now.take(told, search)?;
                        }
                    }
                }
                Ok(now.ended())
            });
            let done = done?;
            if done || kinematics == 0 {
                return Ok(done);
            }
        }
    }
}

/// Returns the beginning of messages about a chain.
fn tip(part: &str) -> String {
    format!("the tip of `{part}` does not reach its goal")
}

/// Arguments of a search.
pub(super) struct SearchArguments<'a, 'py> {
    pub part: &'a str,
    pub at: Option<ArrayLike<'a, 'py>>,
    pub q: Option<ArrayLike<'a, 'py>>,
    pub in_base: bool,
    /// Tolerances, m and rad.
    pub tolerances: [f64; 2],
    pub steps: usize,
    pub restarts: usize,
    pub parts: Parts<'a, 'py>,
}

impl SearchArguments<'_, '_> {
    /// Runs the first evaluations. Returns the state, and the search if it has not ended.
    fn begin(
        self,
        slf: &Bound<'_, Robot>,
        kinematics: usize,
    ) -> PyResult<(SearchState, Option<InverseKinematicsSearch>)> {
        let (own, name) = (base(slf), tip(self.part));
        let part = own.part(self.part)?;
        let goal = self.parts.goal(self.at, "at")?;
        let mut q = own.q_or_own(self.q)?;
        let tolerances = [
            above_zero("position_tolerance", self.tolerances[0])?,
            above_zero("orientation_tolerance", self.tolerances[1])?,
        ];
        let (steps, restarts) = (self.steps, self.restarts);
        let effort = Effort { tolerances, steps, restarts, kinematics };
        let frame = frame(self.in_base);
        let (answer, robot) = slf.py().detach(|| {
            own.ask(|r| {
                let answer = r.inverse_kinematics(part, &goal, frame, &effort, &mut q)?;
                // A long search continues in its own instance.
                Ok((answer, (answer.outcome == Outcome::Unfinished).then(|| r.clone())))
            })
        })?;
        let now = SearchState::of(q, answer);
        let rest = robot.map(|robot| {
            let state = State { of: Of::Chain(Box::new(robot), part), now: now.clone() };
            InverseKinematicsSearch { name, state: Mutex::new(state) }
        });
        Ok((now, rest))
    }

    /// Runs the whole search.
    pub fn solve<'py>(self, slf: &Bound<'py, Robot>) -> PyResult<Array1<'py>> {
        let (py, name) = (slf.py(), tip(self.part));
        let (mut now, rest) = self.begin(slf, PORTION)?;
        if let Some(rest) = rest {
            rest.resume(py, usize::MAX)?;
            now = rest.now(py);
        }
        ended(py, &name, now)
    }

    /// Creates the search without running it.
    pub fn search(self, slf: &Bound<'_, Robot>) -> PyResult<InverseKinematicsSearch> {
        let (_, rest) = self.begin(slf, 0)?;
        rest.ok_or_else(|| refuse_with("the search ended at once", "report this"))
    }
}
