//! Inverse kinematics: numerical search, and all solutions of arms with a closed form.

use crate::call::calls;
use crate::edge::{LwPose, Out, apart, numbers, numbers_mut, rotation, value, vec3};
use crate::robot::LwRobot;
use crate::status::Fault;
use linkwork_embedded::spatial::Vec3;
use linkwork_embedded::{
    Answer, Best, ClosedForm, Effort, Frame, Goal, Outcome, Part, Place, Pointing, Prefer,
    RobotError, RobotModel, Towards,
};

/// The goal has a position.
pub const LW_GOAL_POSITION: u32 = 1;
/// The goal has an orientation.
pub const LW_GOAL_ORIENTATION: u32 = 2;
/// The goal is in the frame of the chain's base instead of the world.
pub const LW_GOAL_IN_BASE: u32 = 4;
/// The position must lie in the plane through the given position with the normal `direction`.
pub const LW_GOAL_PLANE: u32 = 8;
/// The position must lie on the line through the given position along `direction`.
pub const LW_GOAL_LINE: u32 = 16;
/// Instead of an orientation, `axis` points along the direction `towards`, for example for welding and drilling.
pub const LW_GOAL_AXIS: u32 = 32;
/// Instead of an orientation, `axis` points at the point `towards`.
pub const LW_GOAL_LOOK_AT: u32 = 64;

/// Goal of a tip. Fields that are not selected in `parts` are not read.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LwGoal {
    /// Position and orientation.
    pub pose: LwPose,
    /// Weights of 1 m and 1 rad in the sum of squares; positive.
    pub weights: [f64; 2],
    /// A sum of `LW_GOAL_...`.
    pub parts: u32,
    /// Normal of a plane or direction of a line, of length 1, in the frame of the pose.
    pub direction: [f64; 3],
    /// The pointing axis, of length 1, in the tip's frame. The rotation about it is free.
    pub axis: [f64; 3],
    /// Its target: a direction of length 1, or a point, m, in the frame of the pose.
    pub towards: [f64; 3],
    /// Half of the opening angle of the cone about the target in which every direction is accepted, rad, 0 to pi; 0: only the target itself.
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

/// Tolerances and limits of the work of inverse kinematics. The work is counted, not timed.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LwEffort {
    /// Largest errors of position, m, and of orientation, rad.
    pub tolerances: [f64; 2],
    /// Maximum number of steps from one start.
    pub steps: usize,
    /// Number of additional starts, the same for each search. A quarter of them is used for a position that is out of reach because of the link
    /// lengths.
    pub restarts: usize,
    /// Maximum number of kinematics evaluations in one call.
    pub kinematics: usize,
}

/// Result of a search.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LwOutcome {
    /// The goal is met within the tolerances.
    Met,
    /// No start led to the goal. This is the nearest configuration of all starts.
    Nearest,
    /// The limit of evaluations was reached; `lw_robot_resume_inverse_kinematics` continues.
    Unfinished,
}

/// Result of inverse kinematics, in addition to q.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LwAnswer {
    /// Residual distance of the tip from its goal, m; undefined when unfinished.
    pub position: f64,
    /// Residual angle, rad; undefined when unfinished.
    pub orientation: f64,
    /// Kinematics evaluations since the search began.
    pub kinematics: usize,
    /// Index of the start that led there; 0 is the given start.
    pub restart: usize,
    /// Result of the search.
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

/// Secondary cost of configurations that meet a goal, and the amount of search. The cost is `centred` / 2 times the sum of ((q - middle) / (upper -
/// lower))^2, plus `near` / 2 times the sum of ((q - given) / (upper - lower))^2, minus `manipulable` times ln w.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LwPrefer {
    /// Weight of the distance from the middle of the limits; not negative.
    pub centred: f64,
    /// Weight of the distance from the configuration that the search is given; not negative.
    pub near: f64,
    /// Weight of ln w (`lw_robot_manipulability`); not negative. One of the three weights must be above zero.
    pub manipulable: f64,
    /// Length that scales angular rows in w, m; above zero.
    pub length: f64,
    /// Number of starts: the given one and others, the same for each search; at least one is made.
    pub starts: usize,
    /// Maximum number of kinematics evaluations for the improvement of each solution; usually 400.
    pub steps: usize,
}

impl From<LwPrefer> for Prefer {
    fn from(p: LwPrefer) -> Self {
        let LwPrefer { centred, near, manipulable, length, starts, steps } = p;
        Self { centred, near, manipulable, length, starts, steps }
    }
}

/// Result of a search with a secondary cost.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LwBest {
    /// The minimized cost; infinite when the goal is not met.
    pub cost: f64,
    /// Number of starts that led to the goal.
    pub solutions: usize,
    /// Total number of kinematics evaluations.
    pub kinematics: usize,
    /// `LW_OUTCOME_MET`, or `LW_OUTCOME_NEAREST` when no start led to the goal.
    pub outcome: LwOutcome,
}

impl From<Best> for LwBest {
    fn from(b: Best) -> Self {
        let Best { cost, solutions, kinematics, outcome } = b;
        Self { cost, solutions, kinematics, outcome: outcome.into() }
    }
}

/// Returns the given effort, or the default for NULL.
///
/// # Safety
/// The conditions in the crate documentation apply.
pub(crate) unsafe fn effort_of(effort: *const LwEffort) -> Result<Effort, Fault> {
    if effort.is_null() {
        return Ok(Effort::default());
    }
    // SAFETY: guaranteed by the caller.
    let LwEffort { tolerances, steps, restarts, kinematics } = unsafe { value("effort", effort) }?;
    Ok(Effort { tolerances, steps, restarts, kinematics })
}

/// The closed forms of all parts, prepared with the robot. Each part has one for the automatic choice of the locked hinge, followed by one for each
/// hinge that may be locked.
pub(crate) struct Closed(Vec<Vec<Prepared>>);

/// Index in β of the locked hinge, and the closed form.
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
        let why = "the hinge to be locked does not belong to a seven-axis part";
        let found = all.iter().find(|(held, _)| *held == wanted);
        let (_, form) = found.ok_or(RobotError::NoClosedForm { part: part.index(), why })?;
        form.as_ref().map_err(|e| *e)
    }
}

calls![
    /// Writes the effort that `lw_robot_inverse_kinematics` uses for NULL: 1e-9 m and rad, 100 steps from each of 65 starts, no other limit.
    fn lw_effort_default(out: Out<LwEffort>) {
        let Effort { tolerances, steps, restarts, kinematics } = Effort::default();
        out.set(LwEffort { tolerances, steps, restarts, kinematics });
    }

    /// Searches for coordinates of a chain within limits for which its tip meets the goal. `q` (`n` = nq) is the start, within limits, on input, and the
    /// solution or the nearest configuration on output; only the chain's coordinates change. The robot's own q does not change. If the goal cannot be
    /// met, this is a result, not an error. `effort`: NULL for the default.
    fn lw_robot_inverse_kinematics(
        r: &mut LwRobot,
        part: Part,
        goal: *const LwGoal,
        effort: *const LwEffort,
        q: *mut f64,
        n: usize,
        answer: Out<LwAnswer>,
    ) {
        let (goal, frame) = value("goal", goal)?.checked()?;
        let own = effort_of(effort)?;
        let q = numbers_mut("q", q, n, r.model().nq())?;
        answer.set(r.robot.inverse_kinematics(part, &goal, frame, &own, q)?.into());
    }

    /// Like `lw_robot_inverse_kinematics`, but from several starts, and each solution is improved among the configurations that meet the goal; the result is written
    /// to `best`. `restarts` of the effort has no effect; its `kinematics` bounds the sum of all evaluations. If no start leads to the goal, `q` is the
    /// nearest configuration of the last start.
    fn lw_robot_inverse_kinematics_best(
        r: &mut LwRobot,
        part: Part,
        goal: *const LwGoal,
        prefer: *const LwPrefer,
        effort: *const LwEffort,
        q: *mut f64,
        n: usize,
        best: Out<LwBest>,
    ) {
        let (goal, frame) = value("goal", goal)?.checked()?;
        let prefer: Prefer = value("prefer", prefer)?.into();
        let own = effort_of(effort)?;
        let q = numbers_mut("q", q, n, r.model().nq())?;
        best.set(r.robot.inverse_kinematics_best(part, &goal, frame, &prefer, &own, q)?.into());
    }

    /// Continues the last search of a chain for up to `kinematics` evaluations of its kinematics. The result does not depend on how the evaluations are
    /// divided into calls.
    fn lw_robot_resume_inverse_kinematics(
        r: &mut LwRobot,
        part: Part,
        kinematics: usize,
        q: *mut f64,
        n: usize,
        answer: Out<LwAnswer>,
    ) {
        let q = numbers_mut("q", q, n, r.model().nq())?;
        answer.set(r.robot.resume_inverse_kinematics(part, kinematics, q)?.into());
    }

    /// Computes all configurations within limits that bring the tip of an arm with six or seven hinges and a closed form to a pose. Writes them to
    /// `solutions` (`rows` times `n` = nq numbers; 8 rows are always sufficient), sorted by distance from `q` (`n`), and their number to `count`; zero is
    /// a result, not an error. `q` gives the configuration of the bodies that carry the arm, and the revolution of each angle. `held`: index in β of the
    /// hinge of a seven-axis arm that keeps its value in `q`; -1: automatic.
    fn lw_robot_inverse_kinematics_all(
        r: &mut LwRobot,
        part: Part,
        held: i64,
        goal: *const LwGoal,
        q: *const f64,
        n: usize,
        solutions: *mut f64,
        rows: usize,
        count: Out<usize>,
    ) {
        let (goal, frame) = value("goal", goal)?.checked()?;
        let nq = r.model().nq();
        let all = rows.saturating_mul(nq);
        apart(("q", q, n), ("solutions", solutions, all))?;
        let q = numbers("q", q, n, nq)?;
        let out = numbers_mut("solutions", solutions, all, all)?;
        let form = r.closed.form(part, held)?;
        count.set(r.robot.inverse_kinematics_all(form, &goal, frame, q, out)?);
    }
];
