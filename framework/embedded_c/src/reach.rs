//! Inverse kinematics: a search, and all solutions of arms with a closed form.

use crate::edge::{LwPose, Out, alone, apart, numbers, numbers_mut, rotation, value, vec3};
use crate::robot::LwRobot;
use crate::status::{Fault, LwStatus};
use linkwork_embedded::spatial::Vec3;
use linkwork_embedded::{
    Answer, Best, ClosedForm, Effort, Frame, Goal, Outcome, Part, Place, Pointing, Prefer,
    RobotError, RobotModel, Towards,
};

/// The position of the goal counts.
pub const LW_GOAL_POSITION: u32 = 1;
/// The orientation of the goal counts.
pub const LW_GOAL_ORIENTATION: u32 = 2;
/// The goal is in the frame of the chain's base instead of the world.
pub const LW_GOAL_IN_BASE: u32 = 4;
/// Of the position only the plane through it with the normal `direction` counts.
pub const LW_GOAL_PLANE: u32 = 8;
/// Of the position only the line through it along `direction` counts.
pub const LW_GOAL_LINE: u32 = 16;
/// In place of an orientation `axis` points along the direction `towards`: all that welding and drilling ask for.
pub const LW_GOAL_AXIS: u32 = 32;
/// In place of an orientation `axis` looks at the point `towards`.
pub const LW_GOAL_LOOK_AT: u32 = 64;

/// Where a tip is to be. What does not count is not read.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LwGoal {
    /// Where.
    pub pose: LwPose,
    /// What 1 m and 1 rad count in the sum of squares; positive.
    pub weights: [f64; 2],
    /// A sum of `LW_GOAL_...`.
    pub parts: u32,
    /// Normal of a plane or direction of a line, of length 1, in the frame of the pose.
    pub direction: [f64; 3],
    /// The axis that points somewhere, of length 1, in the tip's frame. The turn about it is free.
    pub axis: [f64; 3],
    /// To where: a direction of length 1, or a point, m, in the frame of the pose.
    pub towards: [f64; 3],
    /// Half of the angle of the cone about it within which any direction will do, rad, 0 to pi; 0: the direction itself.
    pub within: f64,
}

impl LwGoal {
    pub(crate) fn checked(&self) -> Result<(Goal, Frame), Fault> {
        let asks = |what| self.parts & what != 0;
        let both = |a, b| asks(a) && asks(b);
        let [place, axis] = [[LW_GOAL_PLANE, LW_GOAL_LINE], [LW_GOAL_AXIS, LW_GOAL_LOOK_AT]];
        let orphan = (asks(place[0]) || asks(place[1])) && !asks(LW_GOAL_POSITION);
        let help = match () {
            () if self.parts >= 2 * LW_GOAL_LOOK_AT => "a sum of LW_GOAL_..",
            () if both(place[0], place[1]) => "a plane or a line, not both",
            () if both(axis[0], axis[1]) => "a direction or a point for the axis, not both",
            () if orphan => "LW_GOAL_POSITION with a plane or a line: a point of it",
            () => "",
        };
        if !help.is_empty() {
            return Err(Fault::Choice { what: "parts", value: self.parts, help });
        }
        let position = asks(LW_GOAL_POSITION).then(|| vec3("position", &self.pose.position));
        let orientation = asks(LW_GOAL_ORIENTATION).then(|| rotation(&self.pose.quaternion));
        let direction = || vec3("direction", &self.direction);
        let towards = || vec3("towards", &self.towards);
        let place = match () {
            () if asks(LW_GOAL_PLANE) => Place::Plane(direction()?),
            () if asks(LW_GOAL_LINE) => Place::Line(direction()?),
            () => Place::Point,
        };
        let pointing = |to| -> Result<Pointing, Fault> {
            let axis: Vec3 = vec3("axis", &self.axis)?;
            Ok(Pointing { axis, to, within: self.within })
        };
        let pointing = match () {
            () if asks(LW_GOAL_AXIS) => Some(pointing(Towards::Direction(towards()?))?),
            () if asks(LW_GOAL_LOOK_AT) => Some(pointing(Towards::Point(towards()?))?),
            () => None,
        };
        let (position, orientation) = (position.transpose()?, orientation.transpose()?);
        let goal = Goal { position, orientation, weights: self.weights, place, pointing };
        Ok((goal, if asks(LW_GOAL_IN_BASE) { Frame::Base } else { Frame::World }))
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
    /// Starts elsewhere, the same ones each time; a quarter of them for the nearest to a position that is out of reach by the lengths of links.
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
    /// The effort was used up; `lw_robot_resume_inverse_kinematics` goes on.
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
            outcome: a.outcome.into(),
        }
    }
}

impl From<Outcome> for LwOutcome {
    fn from(outcome: Outcome) -> Self {
        match outcome {
            Outcome::Met => Self::Met,
            Outcome::Nearest => Self::Nearest,
            Outcome::Unfinished => Self::Unfinished,
        }
    }
}

/// What is liked among configurations that meet a goal, and how hard to look: the least of `centred` / 2 times the sum of ((q - middle) / (upper - lower))^2, and `near` / 2 times that of ((q - given) / (upper - lower))^2, less `manipulable` times ln w.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LwPrefer {
    /// What distance from the middle of the limits counts; not negative.
    pub centred: f64,
    /// What distance from the configuration that the search is given counts; not negative.
    pub near: f64,
    /// What ln w counts (`lw_robot_manipulability`); not negative, and one of the three above zero.
    pub manipulable: f64,
    /// What 1 rad counts in w, m; above zero.
    pub length: f64,
    /// Starts: the given one and others, the same ones each time; at least one is made.
    pub starts: usize,
    /// Evaluations of the kinematics to improve each solution, at most; 400 is usual.
    pub steps: usize,
}

impl From<LwPrefer> for Prefer {
    fn from(p: LwPrefer) -> Self {
        let LwPrefer { centred, near, manipulable, length, starts, steps } = p;
        Self { centred, near, manipulable, length, starts, steps }
    }
}

/// The best of several solutions.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LwBest {
    /// What was made small; infinite when the goal is not met.
    pub cost: f64,
    /// Starts that led to the goal.
    pub solutions: usize,
    /// Evaluations of the kinematics in all.
    pub kinematics: usize,
    /// Met, or nearest when no start led there.
    pub outcome: LwOutcome,
}

impl From<Best> for LwBest {
    fn from(b: Best) -> Self {
        let Best { cost, solutions, kinematics, outcome } = b;
        Self { cost, solutions, kinematics, outcome: outcome.into() }
    }
}

/// The effort that is given, or the default for NULL.
///
/// # Safety
/// The promises at the head of the crate.
pub(crate) unsafe fn effort_of(effort: *const LwEffort) -> Result<Effort, Fault> {
    if effort.is_null() {
        return Ok(Effort::default());
    }
    // SAFETY: the caller's promises.
    let LwEffort { tolerances, steps, restarts, kinematics } = unsafe { value("effort", effort) }?;
    Ok(Effort { tolerances, steps, restarts, kinematics })
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

/// The effort that `lw_robot_inverse_kinematics` takes for NULL: 1e-9 m and rad, 100 steps from each of 65 starts, no other bound.
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
pub unsafe extern "C" fn lw_robot_inverse_kinematics(
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
            let answer = Out::new("answer", answer)?;
            let (goal, frame) = value("goal", goal)?.checked()?;
            let own = effort_of(effort)?;
            let part = r.part(part)?;
            let q = numbers_mut("q", q, n, r.model().nq())?;
            answer.set(r.robot.inverse_kinematics(part, &goal, frame, &own, q)?.into());
            Ok(())
        })
    }
}

/// As `lw_robot_inverse_kinematics`, from several starts, each improved among the configurations that meet the goal, into `best`. `restarts` of the effort does not count; its `kinematics` bounds all
/// evaluations together. When no start leads there, `q` is the nearest of the last of them.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn lw_robot_inverse_kinematics_best(
    robot: *mut LwRobot,
    part: u32,
    goal: *const LwGoal,
    prefer: *const LwPrefer,
    effort: *const LwEffort,
    q: *mut f64,
    n: usize,
    best: *mut LwBest,
) -> LwStatus {
    // SAFETY: the caller's promises.
    unsafe {
        alone(robot, LwRobot::parts, |r| {
            let best = Out::new("best", best)?;
            let (goal, frame) = value("goal", goal)?.checked()?;
            let prefer: Prefer = value("prefer", prefer)?.into();
            let (own, part) = (effort_of(effort)?, r.part(part)?);
            let q = numbers_mut("q", q, n, r.model().nq())?;
            best.set(r.robot.inverse_kinematics_best(part, &goal, frame, &prefer, &own, q)?.into());
            Ok(())
        })
    }
}

/// Goes on with the last search of a chain for so many evaluations of its kinematics. The same steps are taken in whatever portions.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn lw_robot_resume_inverse_kinematics(
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
            answer.set(r.robot.resume_inverse_kinematics(part, kinematics, q)?.into());
            Ok(())
        })
    }
}

/// All configurations within limits that bring the tip of an arm of six or seven hinges with a closed form to a pose, into `solutions` (`rows` times `n` = nq
/// numbers; 8 rows are always enough), those nearest to `q` (`n`) first, and how many there are into `count`: none is an answer, not an error. `q` says where
/// what carries the arm is, and of whole turns which are meant. `held`: the place in β of that hinge of seven which stays as it is in `q`; -1: the library chooses it.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn lw_robot_inverse_kinematics_all(
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
            let count = Out::new("count", count)?;
            let (goal, frame) = value("goal", goal)?.checked()?;
            let part = r.part(part)?;
            let nq = r.model().nq();
            let all = rows.saturating_mul(nq);
            apart(("q", q, n), ("solutions", solutions, all))?;
            let q = numbers("q", q, n, nq)?;
            let out = numbers_mut("solutions", solutions, all, all)?;
            let form = r.closed.form(part, held)?;
            count.set(r.robot.inverse_kinematics_all(form, &goal, frame, q, out)?);
            Ok(())
        })
    }
}
