//! Inverse kinematics: a search, and all solutions of arms with a closed form.

use crate::edge::{LwPose, Out, alone, apart, numbers, numbers_mut, rotation, value, vec3};
use crate::robot::LwRobot;
use crate::status::{Fault, LwStatus};
use linkwork_embedded::{Answer, ClosedForm, Effort, Goal, Outcome, Part, RobotError, RobotModel};

/// The position of the goal counts.
pub const LW_GOAL_POSITION: u32 = 1;
/// The orientation of the goal counts.
pub const LW_GOAL_ORIENTATION: u32 = 2;
/// The goal is in the frame of the chain's base instead of the world.
pub const LW_GOAL_IN_BASE: u32 = 4;

/// Where a tip is to be.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LwGoal {
    /// Where; what does not count is not read.
    pub pose: LwPose,
    /// What 1 m and 1 rad count in the sum of squares; positive.
    pub weights: [f64; 2],
    /// A sum of `LW_GOAL_...`.
    pub parts: u32,
}

impl LwGoal {
    fn checked(&self) -> Result<Goal, Fault> {
        let all = LW_GOAL_POSITION | LW_GOAL_ORIENTATION | LW_GOAL_IN_BASE;
        if self.parts & !all != 0 {
            let help = "a sum of LW_GOAL_..";
            return Err(Fault::Choice { what: "parts", value: self.parts, help });
        }
        let asks = |what| self.parts & what != 0;
        let position = asks(LW_GOAL_POSITION).then(|| vec3("position", &self.pose.position));
        let orientation = asks(LW_GOAL_ORIENTATION).then(|| rotation(&self.pose.quaternion));
        Ok(Goal {
            position: position.transpose()?,
            orientation: orientation.transpose()?,
            weights: self.weights,
            in_base: asks(LW_GOAL_IN_BASE),
            place: linkwork_embedded::Place::Point,
            pointing: None,
        })
    }
}

/// When inverse kinematics is content, and how long it tries: in work, never in time.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LwEffort {
    /// Greatest error of position, m, and of orientation, rad.
    pub tolerances: [f64; 2],
    /// Steps from one start.
    pub steps: usize,
    /// Starts elsewhere, the same ones each time.
    pub restarts: usize,
    /// Evaluations of the kinematics in one call, at most.
    pub kinematics: usize,
}

/// How a search ended.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LwOutcome {
    /// The goal is met within the tolerances.
    Met,
    /// No start led there: this is the nearest of all.
    Nearest,
    /// The effort was used up; `lw_robot_reach_on` goes on.
    Unfinished,
}

/// What inverse kinematics answers beside q.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LwAnswer {
    /// How far the tip is from the goal, m; not defined when unfinished.
    pub position: f64,
    /// The same, rad.
    pub orientation: f64,
    /// Evaluations of the kinematics since the search began.
    pub kinematics: usize,
    /// Which start led there; 0 is the given one.
    pub restart: usize,
    /// How it ended.
    pub outcome: LwOutcome,
}

impl From<Answer> for LwAnswer {
    fn from(a: Answer) -> Self {
        Self {
            position: a.residual.position,
            orientation: a.residual.orientation,
            kinematics: a.kinematics,
            restart: a.restart,
            outcome: match a.outcome {
                Outcome::Met => LwOutcome::Met,
                Outcome::Nearest => LwOutcome::Nearest,
                Outcome::Unfinished => LwOutcome::Unfinished,
            },
        }
    }
}

/// The closed forms of all parts, prepared with the robot: one for each hinge that may be held, after one for the hinge that is chosen.
pub(crate) struct Closed(Vec<Vec<Prepared>>);

/// A place in β, and the form with it held.
type Prepared = (Option<usize>, Result<ClosedForm, RobotError>);

impl Closed {
    pub fn of(model: &RobotModel) -> Self {
        let forms = |part: Part| {
            let dofs = model.dofs(part).unwrap_or_default();
            let held = dofs.iter().map(|dof| Some(*dof)).filter(|_| dofs.len() == 7);
            let all = std::iter::once(None).chain(held);
            all.map(|held| (held, model.closed_form(part, held))).collect()
        };
        Self(model.parts().map(|(part, _)| forms(part)).collect())
    }

    fn form(&self, part: Part, held: i64) -> Result<&ClosedForm, RobotError> {
        let all = self.0.get(part.index()).ok_or(RobotError::ForeignHandle)?;
        let wanted = (held != -1).then(|| usize::try_from(held).unwrap_or(usize::MAX));
        let why = "the hinge to be held is none of seven of its own";
        let found = all.iter().find(|(held, _)| *held == wanted);
        let (_, form) = found.ok_or(RobotError::NoClosedForm { part: part.index(), why })?;
        form.as_ref().map_err(|e| *e)
    }
}

/// The effort that `lw_robot_reach` takes for NULL: 1e-9 m and rad, 100 steps from each of 65 starts, no other bound.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn lw_effort_default(out: *mut LwEffort) -> LwStatus {
    let Effort { tolerances, steps, restarts, kinematics } = Effort::default();
    match Out::new("out", out) {
        Ok(out) => {
            // SAFETY: the caller's promises.
            unsafe { out.set(LwEffort { tolerances, steps, restarts, kinematics }) };
            LwStatus::Ok
        }
        Err(fault) => fault.status(),
    }
}

/// Moves the chain's numbers in `q` (`n` = nq; in: where to start, within limits; out: the solution, or the nearest configuration) until its tip meets the goal, within
/// limits. The robot's own q does not change. *Not reached* is an answer, not an error. `effort`: NULL for the default.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn lw_robot_reach(
    robot: *mut LwRobot,
    part: u32,
    goal: *const LwGoal,
    effort: *const LwEffort,
    q: *mut f64,
    n: usize,
    answer: *mut LwAnswer,
) -> LwStatus {
    // SAFETY: the caller's promises.
    unsafe {
        alone(robot, LwRobot::parts, |r| {
            let (answer, goal) = (Out::new("answer", answer)?, value("goal", goal)?.checked()?);
            let mut own = Effort::default();
            if !effort.is_null() {
                let LwEffort { tolerances, steps, restarts, kinematics } = value("effort", effort)?;
                own = Effort { tolerances, steps, restarts, kinematics };
            }
            let part = r.part(part)?;
            let q = numbers_mut("q", q, n, r.model().nq())?;
            answer.set(r.robot.reach(part, &goal, &own, q)?.into());
            Ok(())
        })
    }
}

/// Goes on with the last search of a chain for so many evaluations of its kinematics. The same steps are taken in whatever portions.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn lw_robot_reach_on(
    robot: *mut LwRobot,
    part: u32,
    kinematics: usize,
    q: *mut f64,
    n: usize,
    answer: *mut LwAnswer,
) -> LwStatus {
    // SAFETY: the caller's promises.
    unsafe {
        alone(robot, LwRobot::parts, |r| {
            let (answer, part) = (Out::new("answer", answer)?, r.part(part)?);
            let q = numbers_mut("q", q, n, r.model().nq())?;
            answer.set(r.robot.reach_on(part, kinematics, q)?.into());
            Ok(())
        })
    }
}

/// All configurations within limits that bring the tip of an arm of six or seven hinges with a closed form to a pose, into `solutions` (`rows` times `n` = nq
/// numbers; 8 rows are always enough), those nearest to `q` (`n`) first, and how many there are into `count`: none is an answer, not an error. `q` says where
/// what carries the arm is, and of whole turns which are meant. `held`: the place in β of that hinge of seven which stays as it is in `q`; -1: the library chooses it.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn lw_robot_reach_all(
    robot: *mut LwRobot,
    part: u32,
    held: i64,
    goal: *const LwGoal,
    q: *const f64,
    n: usize,
    solutions: *mut f64,
    rows: usize,
    count: *mut usize,
) -> LwStatus {
    // SAFETY: the caller's promises.
    unsafe {
        alone(robot, LwRobot::parts, |r| {
            let (count, goal) = (Out::new("count", count)?, value("goal", goal)?.checked()?);
            let part = r.part(part)?;
            let nq = r.model().nq();
            let all = rows.saturating_mul(nq);
            apart(("q", q, n), ("solutions", solutions, all))?;
            let q = numbers("q", q, n, nq)?;
            let out = numbers_mut("solutions", solutions, all, all)?;
            let form = r.closed.form(part, held)?;
            count.set(r.robot.reach_all(form, &goal, q, out)?);
            Ok(())
        })
    }
}
