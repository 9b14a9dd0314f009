//! Inverse kinematics of the whole: several tips at once, what two hands hold stays held.

use crate::edge::{self, Out, alone, disjoint, numbers_mut, plain, value};
use crate::reach::{LwAnswer, LwBest, LwEffort, LwGoal, LwOutcome, LwPrefer, effort_of};
use crate::robot::{Instance, LwRobot};
use crate::status::{Fault, LwStatus};
use crate::tool::{FEW, Tool, lend, room};
use linkwork_embedded::{Answer, Frame, Part, Prefer, RobotError, TipGoal, WholeBodyIk};

/// In `LwTipGoal.seen_from`: in the world, or in the chain's base with `LW_GOAL_IN_BASE`.
pub const LW_NO_PART: u32 = u32::MAX;

/// Where the tip of a chain is to be, beside others.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LwTipGoal {
    /// What is asked of its tip.
    pub goal: LwGoal,
    /// The chain.
    pub part: u32,
    /// The chain at whose tip the goal is seen, wherever it goes; `LW_NO_PART`: none.
    pub seen_from: u32,
}

/// A search of the whole, with its memory. For robots of one model, and one call at a time.
pub struct LwWholeBodyIk(Tool<Whole>);

struct Whole {
    search: WholeBodyIk,
    goals: Vec<TipGoal>,
    room: usize,
    /// Goals of the search that was begun.
    begun: usize,
}

impl Whole {
    /// # Safety
    /// The promises at the head of the crate.
    unsafe fn take(&mut self, r: &Instance, p: *const LwTipGoal, n: usize) -> Result<(), Fault> {
        self.goals.clear();
        let room = self.room;
        if n > room {
            return Err(RobotError::NoRoom { what: "goals", wanted: n, room }.into());
        }
        for k in 0..n {
            // SAFETY: the caller has `n` of them; one by one, since none of them may be there.
            let g = unsafe { value("goals", p.wrapping_add(k)) }?;
            let (goal, mut frame) = g.goal.checked()?;
            if g.seen_from != LW_NO_PART {
                if frame == Frame::Base {
                    let help = "LW_NO_PART with LW_GOAL_IN_BASE, or a part without it";
                    return Err(Fault::Choice { what: "seen_from", value: g.seen_from, help });
                }
                frame = Frame::Tip(r.part(g.seen_from)?);
            }
            self.goals.push(TipGoal { part: r.part(g.part)?, goal, frame });
        }
        Ok(())
    }

    /// What came of a portion; what does not close is told, too.
    ///
    /// # Safety
    /// The promises at the head of the crate.
    unsafe fn tell(
        &self,
        told: Result<Answer, RobotError>,
        residuals: &mut [f64],
        out: Out<LwAnswer>,
    ) -> Result<(), Fault> {
        let error = match told {
            Ok(answer) => {
                for (to, r) in residuals.chunks_exact_mut(2).zip(self.search.residuals()) {
                    to.copy_from_slice(&[r.position, r.orientation]);
                }
                // SAFETY: the caller's promises.
                unsafe { out.set(answer.into()) };
                return Ok(());
            }
            Err(error) => error,
        };
        if let RobotError::DoesNotClose { position, orientation, .. } = error {
            let outcome = LwOutcome::Nearest;
            let gap = LwAnswer { position, orientation, kinematics: 0, restart: 0, outcome };
            // SAFETY: as above.
            unsafe { out.set(gap) };
        }
        Err(error.into())
    }

    fn move_part(&mut self, r: &Instance, part: Part, moves: bool) -> Result<(), Fault> {
        let model = r.model();
        for body in model.bodies(part)? {
            for dof in model.multibody().get(*body).v() {
                let one = [dof];
                if moves { self.search.release(&one)? } else { self.search.keep(&one)? }
            }
        }
        Ok(())
    }
}

/// Memory of `lw_whole_body_ik_solve` with room for so many goals (1024 at most) and two hands on every object, into `out`; free it with `lw_whole_body_ik_free`. It serves every robot of the same model.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn lw_whole_body_ik_new(
    robot: *mut LwRobot,
    goals: usize,
    out: *mut *mut LwWholeBodyIk,
) -> LwStatus {
    // SAFETY: the caller's promises.
    unsafe {
        alone(robot, LwRobot::parts, |r| {
            let (out, room) = (Out::new("out", out)?, room("goals", goals, FEW)?);
            let search = WholeBodyIk::new(&r.robot, room);
            let whole = Whole { search, goals: Vec::with_capacity(room), room, begun: 0 };
            out.set(Box::into_raw(Box::new(LwWholeBodyIk(Tool::new(r, whole)))));
            Ok(())
        })
    }
}

/// Frees it; NULL is none.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn lw_whole_body_ik_free(search: *mut LwWholeBodyIk) {
    // SAFETY: the caller's promises.
    unsafe { edge::free(search) }
}

/// Keeps the hinges of a part's bodies where they are in searches from now on. A search that was begun ends.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn lw_whole_body_ik_keep(
    robot: *mut LwRobot,
    search: *mut LwWholeBodyIk,
    part: u32,
) -> LwStatus {
    // SAFETY: the caller's promises.
    unsafe {
        alone(robot, LwRobot::parts, |r| {
            let mut whole = lend("search", search, |s| &s.0, r)?;
            whole.move_part(r, r.part(part)?, false)
        })
    }
}

/// Lets them move again.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn lw_whole_body_ik_release(
    robot: *mut LwRobot,
    search: *mut LwWholeBodyIk,
    part: u32,
) -> LwStatus {
    // SAFETY: the caller's promises.
    unsafe {
        alone(robot, LwRobot::parts, |r| {
            let mut whole = lend("search", search, |s| &s.0, r)?;
            whole.move_part(r, r.part(part)?, true)
        })
    }
}

/// Moves `q` (`n` = nq; in: where to start, within limits; out: the solution, or the nearest configuration) until every tip meets its goal, within limits, with all that carries them. What two
/// hands of the robot hold now is held in the answer, and loops and couplings are closed; without goals it closes what is open. `effort`: NULL for the default. Of `answer` position and
/// orientation are the greatest of all goals; those of each, m and rad, go into `residuals` (`m` = 2 `goal_count`; NULL and 0: not asked for).
/// `LW_STATUS_DOES_NOT_CLOSE` where nothing closes all: `q` is then where it is least open, position and orientation of `answer` are how far.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn lw_whole_body_ik_solve(
    robot: *mut LwRobot,
    search: *mut LwWholeBodyIk,
    goals: *const LwTipGoal,
    goal_count: usize,
    effort: *const LwEffort,
    q: *mut f64,
    n: usize,
    residuals: *mut f64,
    m: usize,
    answer: *mut LwAnswer,
) -> LwStatus {
    // SAFETY: the caller's promises.
    unsafe {
        alone(robot, LwRobot::parts, |r| {
            let answer = Out::new("answer", answer)?;
            let mut whole = lend("search", search, |s| &s.0, r)?;
            disjoint(&[], &[("q", q, n), ("residuals", residuals, m)])?;
            whole.take(r, goals, goal_count)?;
            let own = effort_of(effort)?;
            let asked = !residuals.is_null() || m > 0;
            let wanted = if asked { goal_count.saturating_mul(2) } else { 0 };
            let residuals = numbers_mut("residuals", residuals, m, wanted)?;
            let q = numbers_mut("q", q, n, r.model().nq())?;
            let Whole { search, goals, begun, .. } = &mut *whole;
            search.begin(&r.robot, goals, &own, q)?;
            *begun = goal_count;
            let told = search.resume(own.kinematics, q);
            whole.tell(told, residuals, answer)
        })
    }
}

/// Goes on with the search for so many evaluations of the kinematics. The same steps are taken in whatever portions. Answers as `lw_whole_body_ik_solve`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn lw_whole_body_ik_resume(
    robot: *mut LwRobot,
    search: *mut LwWholeBodyIk,
    kinematics: usize,
    q: *mut f64,
    n: usize,
    residuals: *mut f64,
    m: usize,
    answer: *mut LwAnswer,
) -> LwStatus {
    // SAFETY: the caller's promises.
    unsafe {
        alone(robot, LwRobot::parts, |r| {
            let answer = Out::new("answer", answer)?;
            let mut whole = lend("search", search, |s| &s.0, r)?;
            disjoint(&[], &[("q", q, n), ("residuals", residuals, m)])?;
            let asked = !residuals.is_null() || m > 0;
            let wanted = if asked { 2 * whole.begun } else { 0 };
            let residuals = numbers_mut("residuals", residuals, m, wanted)?;
            let q = numbers_mut("q", q, n, r.model().nq())?;
            let told = whole.search.resume(kinematics, q);
            whole.tell(told, residuals, answer)
        })
    }
}

/// As `lw_whole_body_ik_solve`, from several starts, each improved among the configurations that meet all goals with everything closed, into `best`: near the middle of the limits of all that
/// moves, and far from singular configurations of the goals' chains. `restarts` of the effort does not count; its `kinematics` bounds all evaluations together. The robot's own q does not change.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn lw_whole_body_ik_best(
    robot: *mut LwRobot,
    search: *mut LwWholeBodyIk,
    goals: *const LwTipGoal,
    goal_count: usize,
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
            let mut whole = lend("search", search, |s| &s.0, r)?;
            whole.take(r, goals, goal_count)?;
            let prefer: Prefer = value("prefer", prefer)?.into();
            let own = effort_of(effort)?;
            let q = numbers_mut("q", q, n, r.model().nq())?;
            let Whole { search, goals, .. } = &mut *whole;
            best.set(search.best(&mut r.robot, goals, &prefer, &own, q)?.into());
            Ok(())
        })
    }
}

/// Evaluations of the kinematics after which `lw_whole_body_ik_solve` has ended for these goals at the latest, whatever the start, the goals' numbers and what hands hold, into `steps`; SIZE_MAX for more.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn lw_whole_body_ik_worst_case_steps(
    robot: *mut LwRobot,
    search: *mut LwWholeBodyIk,
    goals: *const LwTipGoal,
    goal_count: usize,
    effort: *const LwEffort,
    steps: *mut usize,
) -> LwStatus {
    // SAFETY: the caller's promises.
    unsafe {
        alone(robot, LwRobot::parts, |r| {
            let steps = Out::new("steps", steps)?;
            let mut whole = lend("search", search, |s| &s.0, r)?;
            whole.take(r, goals, goal_count)?;
            steps.set(whole.search.worst_case_steps(&whole.goals, &effort_of(effort)?));
            Ok(())
        })
    }
}

/// Evaluations of the kinematics after which `lw_robot_inverse_kinematics` has ended for such a goal at the latest, whatever the chain, the start and the goal's numbers, into `steps`; SIZE_MAX for more.
/// What a caller in real time counts on; most searches take a hundredth of it. `effort`: NULL for the default.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn lw_effort_worst_case_steps(
    effort: *const LwEffort,
    goal: *const LwGoal,
    steps: *mut usize,
) -> LwStatus {
    // SAFETY: the caller's promises.
    unsafe {
        plain(|| {
            let steps = Out::new("steps", steps)?;
            let (goal, _) = value("goal", goal)?.checked()?;
            steps.set(effort_of(effort)?.worst_case_steps(&goal));
            Ok(())
        })
    }
}
