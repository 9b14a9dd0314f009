//! Inverse kinematics of `Robot`: a search at once, and one that goes on as it is told.
use super::{Given, Robot, above_zero, base, frame};
use crate::array::{Array1, out1};
use crate::core::lock;
use crate::error::{refuse, refuse_with};
use crate::inverse_kinematics::{PORTION, Parts, place};
use linkwork_embedded::{self as embedded, Answer, Effort, Goal, Outcome, Part, RobotError};
use pyo3::prelude::*;
use std::sync::Mutex;

/// A search of `Robot.begin_inverse_kinematics` that goes on as it is told: what planners and control loops ask that have so much time and no more. It has the configuration, and what
/// hands held, of the moment it began; what the robot does afterwards does not change it.
///
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
    part: Part,
    state: Mutex<State>,
}

struct State {
    robot: embedded::Robot,
    q: Vec<f64>,
    answer: Answer,
}

/// A solution, or the error that has the nearest configuration.
fn ended<'py>(py: Python<'py>, name: &str, answer: &Answer, q: Vec<f64>) -> PyResult<Array1<'py>> {
    let q = out1(py, q);
    let (p, R) = (answer.residual.position, answer.residual.orientation);
    let error = match answer.outcome {
        Outcome::Met => return Ok(q),
        Outcome::Nearest => refuse_with(
            format!("the tip of `{name}` comes no nearer than {p:.3e} m and {R:.3e} rad"),
            "ask for less (a position alone), or from another start; the nearest configuration is the error's `q`",
        ),
        Outcome::Unfinished => refuse_with(
            format!(
                "the search of `{name}` has not ended after {} evaluations of its kinematics",
                answer.kinematics
            ),
            "go on with `advance` until it is True; the nearest configuration so far is the error's `q`",
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
    /// Goes on for so many evaluations of the kinematics of the chain at most; True when it has ended, which no further call changes. A step of the search is one evaluation: the same steps are taken in whatever
    /// portions, to the same bits, and a portion takes the same time each, some µs an evaluation. After Ctrl-C it may be gone on with. Raises LinkworkError for a negative number.
    ///
    /// >>> search = robot.begin_inverse_kinematics("arm", [0.6, 0, 0.2], q=[0.3, 0.3, 0.3])
    /// >>> search.advance(1), search.kinematics
    /// (False, 1)
    /// >>> search.advance()
    /// True
    #[pyo3(signature = (kinematics=1000))]
    fn advance(&self, py: Python<'_>, kinematics: i64) -> PyResult<bool> {
        let kinematics = usize::try_from(kinematics).map_err(|_| {
            let fact = format!("`kinematics` is {kinematics}");
            refuse_with(fact, "give how many evaluations there may be, 0 or more")
        })?;
        self.go_on(py, kinematics)
    }

    /// The solution (nq,), rad and m. Raises LinkworkError while the search goes on, and when no start led to the goal; the error's `q` is then the nearest configuration, and at the end its `residual` (m, rad) how far that is.
    ///
    /// >>> search = robot.begin_inverse_kinematics("arm", [5.0, 0, 0], q=[0.3, 0.3, 0.3])
    /// >>> search.advance(10**6)
    /// True
    /// >>> try:
    /// ...     search.solution()
    /// ... except linkwork.LinkworkError as error:
    /// ...     round(error.residual[0], 6)
    /// 4.2
    fn solution<'py>(&self, py: Python<'py>) -> PyResult<Array1<'py>> {
        let (answer, q) = self.now(py);
        ended(py, &self.name, &answer, q)
    }

    /// "met": within the tolerances; "nearest": no start led there; "unfinished": it may go on.
    ///
    /// >>> robot.begin_inverse_kinematics("arm", [0.6, 0, 0.2]).outcome
    /// 'unfinished'
    #[getter]
    fn outcome(&self, py: Python<'_>) -> &'static str {
        word(self.now(py).0.outcome)
    }

    /// The solution, or the nearest configuration so far (nq,), rad and m.
    ///
    /// >>> robot.begin_inverse_kinematics("arm", [0.6, 0, 0.2], q=[0.3, 0.3, 0.3]).q.tolist()
    /// [0.3, 0.3, 0.3]
    #[getter]
    fn q<'py>(&self, py: Python<'py>) -> Array1<'py> {
        out1(py, self.now(py).1)
    }

    /// How far the tip is from the goal at `q`, m and rad; None until the search has ended.
    ///
    /// >>> robot.begin_inverse_kinematics("arm", [0.6, 0, 0.2]).residual is None
    /// True
    #[getter]
    fn residual(&self, py: Python<'_>) -> Option<(f64, f64)> {
        let Answer { outcome, residual, .. } = self.now(py).0;
        (outcome != Outcome::Unfinished).then_some((residual.position, residual.orientation))
    }

    /// How many evaluations of the kinematics there were so far.
    ///
    /// >>> robot.begin_inverse_kinematics("arm", [0.6, 0, 0.2]).kinematics
    /// 0
    #[getter]
    fn kinematics(&self, py: Python<'_>) -> usize {
        self.now(py).0.kinematics
    }

    /// Which start led to `q`: 0 is the given one.
    ///
    /// >>> robot.begin_inverse_kinematics("arm", [0.6, 0, 0.2]).restart
    /// 0
    #[getter]
    fn restart(&self, py: Python<'_>) -> usize {
        self.now(py).0.restart
    }

    fn __repr__(&self, py: Python<'_>) -> String {
        let outcome = word(self.now(py).0.outcome);
        format!("InverseKinematicsSearch({}, {outcome})", self.name)
    }
}

impl InverseKinematicsSearch {
    /// Where it is. Waits without the interpreter, which another thread that goes on may need.
    fn now(&self, py: Python<'_>) -> (Answer, Vec<f64>) {
        py.detach(|| {
            let state = lock(&self.state);
            (state.answer, state.q.clone())
        })
    }

    /// Goes on with looks at Ctrl-C, between which others may go on, too; whether it has ended.
    fn go_on(&self, py: Python<'_>, mut kinematics: usize) -> PyResult<bool> {
        loop {
            py.check_signals()?;
            let portion = kinematics.min(PORTION);
            kinematics -= portion;
            let outcome: Result<Outcome, RobotError> = py.detach(|| {
                let mut state = lock(&self.state);
                let State { robot, q, answer } = &mut *state;
                if answer.outcome == Outcome::Unfinished && portion > 0 {
                    *answer = robot.reach_on(self.part, portion, q)?;
                }
                Ok(answer.outcome)
            });
            let outcome = outcome.map_err(refuse)?;
            if outcome != Outcome::Unfinished || kinematics == 0 {
                return Ok(outcome != Outcome::Unfinished);
            }
        }
    }
}

fn word(outcome: Outcome) -> &'static str {
    match outcome {
        Outcome::Met => "met",
        Outcome::Nearest => "nearest",
        Outcome::Unfinished => "unfinished",
    }
}

/// A search as it is asked for.
pub(super) struct Asked<'a, 'py> {
    pub part: &'a str,
    pub at: Option<Given<'a, 'py>>,
    pub q: Option<Given<'a, 'py>>,
    pub in_base: bool,
    /// m and rad.
    pub tolerances: [f64; 2],
    pub steps: usize,
    pub restarts: usize,
    pub parts: Parts<'a, 'py>,
}

impl Asked<'_, '_> {
    /// Begins and goes on by so many evaluations: what came of it, and an instance for the rest if there is any.
    fn begin(
        self,
        slf: &Bound<'_, Robot>,
        kinematics: usize,
    ) -> PyResult<(Answer, Vec<f64>, Option<InverseKinematicsSearch>)> {
        let (own, name) = (base(slf), self.part.to_owned());
        let part = own.part(&name)?;
        let (position, orientation) = self.at.map_or(Ok((None, None)), |at| place(at, "at"))?;
        let (place, pointing) = self.parts.read()?;
        let goal = Goal { position, orientation, weights: [1.0; 2], place, pointing };
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
                let answer = r.reach(part, &goal, frame, &effort, &mut q)?;
                // What takes long goes on in an instance of its own.
                Ok((answer, (answer.outcome == Outcome::Unfinished).then(|| r.clone())))
            })
        })?;
        let rest = robot.map(|robot| {
            let state = Mutex::new(State { robot, q: q.clone(), answer });
            InverseKinematicsSearch { name, part, state }
        });
        Ok((answer, q, rest))
    }

    /// At once.
    pub fn solve<'py>(self, slf: &Bound<'py, Robot>) -> PyResult<Array1<'py>> {
        let (py, name) = (slf.py(), self.part.to_owned());
        let (mut answer, mut q, rest) = self.begin(slf, PORTION)?;
        if let Some(rest) = rest {
            rest.go_on(py, usize::MAX)?;
            (answer, q) = rest.now(py);
        }
        ended(py, &name, &answer, q)
    }

    /// To be gone on with.
    pub fn search(self, slf: &Bound<'_, Robot>) -> PyResult<InverseKinematicsSearch> {
        let (_, _, rest) = self.begin(slf, 0)?;
        rest.ok_or_else(|| refuse_with("the search ended at once", "report this"))
    }
}
