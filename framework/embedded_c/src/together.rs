//! Whole-body inverse kinematics: several tips at once; objects in two hands stay in both hands.

use crate::call::calls;
use crate::edge::{Out, disjoint, numbers_mut, value};
use crate::reach::{LwAnswer, LwBest, LwEffort, LwGoal, LwOutcome, LwPrefer, effort_of};
use crate::robot::{Instance, LwRobot};
use crate::status::Fault;
use crate::tool::{FEW, Tool, lend, room};
use linkwork_embedded::{Answer, Frame, Part, Prefer, RobotError, TipGoal, WholeBodyIk};

/// In `LwTipGoal.seen_from`: the goal is in the world, or in the chain's base with `LW_GOAL_IN_BASE`.
pub const LW_NO_PART: u32 = u32::MAX;

/// Goal of the tip of a chain, one of several.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LwTipGoal {
    /// The goal of its tip.
    pub goal: LwGoal,
    /// The chain.
    pub part: u32,
    /// The chain relative to whose tip the goal is given, even if that tip moves; `LW_NO_PART`: none.
    pub seen_from: u32,
}

/// Solver for whole-body inverse kinematics, with its memory. Use it for robots of one model, with one call at a time.
pub struct LwWholeBodyIk(Tool<Whole>);

struct Whole {
    search: WholeBodyIk,
    goals: Vec<TipGoal>,
    room: usize,
    /// Number of goals of the search in progress.
    begun: usize,
}

impl Whole {
    /// # Safety
    /// The conditions in the crate documentation apply.
    unsafe fn take(&mut self, r: &Instance, p: *const LwTipGoal, n: usize) -> Result<(), Fault> {
        self.goals.clear();
        let room = self.room;
        if n > room {
            return Err(RobotError::NoRoom { what: "goals", wanted: n, room }.into());
        }
        for k in 0..n {
            // SAFETY: the caller has `n` of them; they are read one by one, because `n` may be zero.
            let g = unsafe { value("goals", p.wrapping_add(k)) }?;
            let (goal, mut frame) = g.goal.checked()?;
            if g.seen_from != LW_NO_PART {
                if frame == Frame::Base {
                    let help = "LW_NO_PART, or remove LW_GOAL_IN_BASE from the goal";
                    return Err(Fault::Choice { what: "seen_from", value: g.seen_from, help });
                }
                frame = Frame::Tip(r.part(g.seen_from)?);
            }
            self.goals.push(TipGoal { part: r.part(g.part)?, goal, frame });
        }
        Ok(())
    }

    /// Writes the result of a call, also when closures cannot be closed.
    ///
    /// # Safety
    /// The conditions in the crate documentation apply.
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
                // SAFETY: guaranteed by the caller.
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

calls![
    /// Creates the memory of `lw_whole_body_ik_solve` for up to `goals` goals (at most 1024) and two hands on every object and writes it to `out`; free it
    /// with `lw_whole_body_ik_free`. It works with every robot of the same model.
    fn lw_whole_body_ik_new(r: &mut LwRobot, goals: usize, out: Out<*mut LwWholeBodyIk>) {
        let room = room("goals", goals, FEW)?;
        let search = WholeBodyIk::new(&r.robot, room);
        let whole = Whole { search, goals: Vec::with_capacity(room), room, begun: 0 };
        out.set(Box::into_raw(Box::new(LwWholeBodyIk(Tool::new(r, whole)))));
    }

    /// Frees the memory; NULL has no effect.
    fn lw_whole_body_ik_free(search: *mut LwWholeBodyIk);

    /// Keeps the hinges of a part's bodies at their values in later searches. Ends a search in progress.
    fn lw_whole_body_ik_keep(r: &mut LwRobot, search: *mut LwWholeBodyIk, part: Part) {
        let mut whole = lend("search", search, |s| &s.0, r)?;
        whole.move_part(r, part, false)?;
    }

    /// Lets the hinges of a part's bodies move again.
    fn lw_whole_body_ik_release(r: &mut LwRobot, search: *mut LwWholeBodyIk, part: Part) {
        let mut whole = lend("search", search, |s| &s.0, r)?;
        whole.move_part(r, part, true)?;
    }

    /// Searches for a configuration within limits in which every tip meets its goal; all bodies that carry the tips may move. `q` (`n` = nq) is the
    /// start, within limits, on input, and the solution or the nearest configuration on output. Objects in two hands of the robot are in both hands in
    /// the result, and loops and couplings are closed; without goals the search only closes what is open. `effort`: NULL for the default. Position and
    /// orientation of `answer` are the largest residuals of all goals; those of each goal, m and rad, are written to `residuals` (`m` = 2 `goal_count`;
    /// NULL and 0: not written). Returns `LW_STATUS_DOES_NOT_CLOSE` if no configuration closes everything: `q` is then the configuration with the
    /// smallest closure error, which position and orientation of `answer` contain.
    fn lw_whole_body_ik_solve(
        r: &mut LwRobot,
        search: *mut LwWholeBodyIk,
        goals: *const LwTipGoal,
        goal_count: usize,
        effort: *const LwEffort,
        q: *mut f64,
        n: usize,
        residuals: *mut f64,
        m: usize,
        answer: Out<LwAnswer>,
    ) {
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
        whole.tell(told, residuals, answer)?;
    }

    /// Continues the search for up to `kinematics` evaluations of the kinematics. The result does not depend on how the evaluations are divided into
    /// calls. Results are written as in `lw_whole_body_ik_solve`.
    fn lw_whole_body_ik_resume(
        r: &mut LwRobot,
        search: *mut LwWholeBodyIk,
        kinematics: usize,
        q: *mut f64,
        n: usize,
        residuals: *mut f64,
        m: usize,
        answer: Out<LwAnswer>,
    ) {
        let mut whole = lend("search", search, |s| &s.0, r)?;
        disjoint(&[], &[("q", q, n), ("residuals", residuals, m)])?;
        let asked = !residuals.is_null() || m > 0;
        let wanted = if asked { 2 * whole.begun } else { 0 };
        let residuals = numbers_mut("residuals", residuals, m, wanted)?;
        let q = numbers_mut("q", q, n, r.model().nq())?;
        let told = whole.search.resume(kinematics, q);
        whole.tell(told, residuals, answer)?;
    }

    /// Like `lw_whole_body_ik_solve`, but from several starts, and each solution is improved among the configurations that meet all goals with everything
    /// closed: near the middle of the limits of all that moves, and far from singular configurations of the goals' chains. Writes the result to `best`.
    /// `restarts` of the effort has no effect; its `kinematics` bounds the sum of all evaluations. The robot's own q does not change.
    fn lw_whole_body_ik_best(
        r: &mut LwRobot,
        search: *mut LwWholeBodyIk,
        goals: *const LwTipGoal,
        goal_count: usize,
        prefer: *const LwPrefer,
        effort: *const LwEffort,
        q: *mut f64,
        n: usize,
        best: Out<LwBest>,
    ) {
        let mut whole = lend("search", search, |s| &s.0, r)?;
        whole.take(r, goals, goal_count)?;
        let prefer: Prefer = value("prefer", prefer)?.into();
        let own = effort_of(effort)?;
        let q = numbers_mut("q", q, n, r.model().nq())?;
        let Whole { search, goals, .. } = &mut *whole;
        best.set(search.best(&mut r.robot, goals, &prefer, &own, q)?.into());
    }

    /// Writes an upper bound for the kinematics evaluations of `lw_whole_body_ik_solve` with these goals to `steps`, for every start, all values of the
    /// goals and everything that the hands may hold; SIZE_MAX if it is larger.
    fn lw_whole_body_ik_worst_case_steps(
        r: &mut LwRobot,
        search: *mut LwWholeBodyIk,
        goals: *const LwTipGoal,
        goal_count: usize,
        effort: *const LwEffort,
        steps: Out<usize>,
    ) {
        let mut whole = lend("search", search, |s| &s.0, r)?;
        whole.take(r, goals, goal_count)?;
        steps.set(whole.search.worst_case_steps(&whole.goals, &effort_of(effort)?));
    }

    /// Writes an upper bound for the kinematics evaluations of `lw_robot_inverse_kinematics` with such a goal to `steps`, for every chain, every start and all values
    /// of the goal; SIZE_MAX if it is larger. Real-time callers can rely on it; most searches take one hundredth of it. `effort`: NULL for the default.
    fn lw_effort_worst_case_steps(effort: *const LwEffort, goal: *const LwGoal, steps: Out<usize>) {
        let (goal, _) = value("goal", goal)?.checked()?;
        steps.set(effort_of(effort)?.worst_case_steps(&goal));
    }
];
