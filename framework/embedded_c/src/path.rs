//! Free paths between configurations, and ways that a search finds.

use crate::collide::LwPair;
use crate::edge::{self, Out, alone, numbers, numbers_mut, value};
use crate::robot::{Instance, LwRobot};
use crate::status::{Fault, LwStatus};
use crate::tool::{MANY, Tool, lend, room};
use linkwork_embedded::{Path, PathProgress, PlanOutcome, Planner, RobotError, Search};

/// Whether a path is free.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LwPathOutcome {
    /// Proven free from end to end.
    Free,
    /// Two colliders touch.
    Hit,
    /// Nothing touches where it was looked, and pieces as short as allowed could not be proven free.
    Undecided,
    /// The pieces asked for were used up; `lw_robot_path_free_on` goes on.
    Unfinished,
}

/// What is told of a path.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LwPath {
    /// Which part of the way, from 0 at its start to 1: where two touch, or the first piece that is undecided; else 0.
    pub at: f64,
    /// Two that touch there; else zero.
    pub pair: LwPair,
    /// What came of it.
    pub outcome: LwPathOutcome,
}

impl From<Option<Path>> for LwPath {
    fn from(path: Option<Path>) -> Self {
        let none = LwPair { a: 0, b: 0 };
        let told = |outcome, at, pair| Self { at, pair, outcome };
        match path {
            Some(Path::Free) => told(LwPathOutcome::Free, 0.0, none),
            Some(Path::Hit { at, pair }) => told(LwPathOutcome::Hit, at, pair.into()),
            Some(Path::Undecided { at }) => told(LwPathOutcome::Undecided, at, none),
            None => told(LwPathOutcome::Unfinished, 0.0, none),
        }
    }
}

/// A path that is looked at in portions.
pub(crate) struct Swept {
    ends: [Vec<f64>; 2],
    least: f64,
    progress: Option<PathProgress>,
}

impl Swept {
    pub fn new(nq: usize) -> Self {
        Self { ends: [vec![0.0; nq], vec![0.0; nq]], least: 1.0, progress: None }
    }
}

impl Instance {
    fn sweep(&mut self, pieces: usize) -> Result<LwPath, Fault> {
        let Swept { ends: [a, b], least, progress } = &mut self.swept;
        let Some(at) = progress else { return Err(Fault::NotBegun("lw_robot_path_free")) };
        let told = self.robot.path_free_on(a, b, *least, at, pieces)?;
        if told.is_some() {
            *progress = None;
        }
        Ok(told.into())
    }
}

/// How to look for a way.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LwSearch {
    /// Of the random places: the same seed gives the same way.
    pub seed: u64,
    /// Longest piece, as the greatest change of one coordinate, rad or m; above zero.
    pub step: f64,
    /// Pieces of a piece that are not cut again, as of `lw_robot_path_free`.
    pub least: f64,
}

/// How a search for a way ended.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LwPlanOutcome {
    /// `lw_planner_path` gives it: free from end to end.
    Found,
    /// The start touches something.
    BlockedStart,
    /// The goal touches something.
    BlockedGoal,
    /// The room was used up. There may be a way, or none.
    NotFound,
    /// The places asked for were used up; `lw_planner_resume` goes on.
    Unfinished,
}

/// What is told of a way.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct LwPlan {
    /// How many configurations it has, both ends counted; 0 when none was found.
    pub rows: usize,
    /// Two that touch at a blocked end; else zero.
    pub pair: LwPair,
    /// How the search ended.
    pub outcome: LwPlanOutcome,
}

impl LwPlan {
    fn new(way: PlanOutcome, planner: &Planner) -> Self {
        let none = LwPair { a: 0, b: 0 };
        let (outcome, pair) = match way {
            PlanOutcome::Found => (LwPlanOutcome::Found, none),
            PlanOutcome::BlockedStart { pair } => (LwPlanOutcome::BlockedStart, pair.into()),
            PlanOutcome::BlockedGoal { pair } => (LwPlanOutcome::BlockedGoal, pair.into()),
            PlanOutcome::NotFound => (LwPlanOutcome::NotFound, none),
            PlanOutcome::Unfinished => (LwPlanOutcome::Unfinished, none),
        };
        Self { rows: planner.path().len(), pair, outcome }
    }
}

/// Memory of searches for ways of one chain. For robots of one model, and one call at a time.
pub struct LwPlanner(Tool<Planner>);

/// Whether the way from `qa` to `qb` (`n` = nq each) touches nothing, all coordinates moving in proportion, into `out`: proven, not sampled; what hands hold goes with them. Pieces shorter than
/// `least` (a part of the way, 1e-9 to 1; 1e-3 is usual) are not cut again. At most so many `pieces` are looked at (SIZE_MAX: all). The robot's own q does not matter.
/// `LW_STATUS_OUT_OF_RANGE` also for an end beyond the limits of a slider.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn lw_robot_path_free(
    robot: *mut LwRobot,
    qa: *const f64,
    qb: *const f64,
    n: usize,
    least: f64,
    pieces: usize,
    out: *mut LwPath,
) -> LwStatus {
    // SAFETY: the caller's promises.
    unsafe {
        alone(robot, LwRobot::parts, |r| {
            let out = Out::new("out", out)?;
            let nq = r.model().nq();
            let (qa, qb) = (numbers("qa", qa, n, nq)?, numbers("qb", qb, n, nq)?);
            // No pieces: the arguments alone are checked.
            let mut progress = PathProgress::default();
            r.robot.path_free_on(qa, qb, least, &mut progress, 0)?;
            let [a, b] = &mut r.swept.ends;
            a.copy_from_slice(qa);
            b.copy_from_slice(qb);
            (r.swept.least, r.swept.progress) = (least, Some(progress));
            out.set(r.sweep(pieces)?);
            Ok(())
        })
    }
}

/// Goes on with the path of the last `lw_robot_path_free` that was left unfinished, for so many pieces, with the robot as it was then. Portions do not change the answer.
/// `LW_STATUS_NO_SEARCH` when there is none.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn lw_robot_path_free_on(
    robot: *mut LwRobot,
    pieces: usize,
    out: *mut LwPath,
) -> LwStatus {
    // SAFETY: the caller's promises.
    unsafe {
        alone(robot, LwRobot::parts, |r| {
            let out = Out::new("out", out)?;
            out.set(r.sweep(pieces)?);
            Ok(())
        })
    }
}

/// Memory of searches for ways of a chain of pins, sliders and screws, with room for so many configurations (2 to 1048576) in each of two trees, into `out`; free it with `lw_planner_free`.
/// It serves every robot of the same model.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn lw_planner_new(
    robot: *mut LwRobot,
    part: u32,
    configurations: usize,
    out: *mut *mut LwPlanner,
) -> LwStatus {
    // SAFETY: the caller's promises.
    unsafe {
        alone(robot, LwRobot::parts, |r| {
            let (out, part) = (Out::new("out", out)?, r.part(part)?);
            let planner =
                Planner::new(&r.robot, part, room("configurations", configurations, MANY)?)?;
            out.set(Box::into_raw(Box::new(LwPlanner(Tool::new(r, planner)))));
            Ok(())
        })
    }
}

/// Frees it; NULL is none.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn lw_planner_free(planner: *mut LwPlanner) {
    // SAFETY: the caller's promises.
    unsafe { edge::free(planner) }
}

/// Looks for a free way of the chain from `start` to `goal` (`n` = nq each, within limits; they differ in the chain's coordinates alone) with at most so many random `places` in this call
/// (SIZE_MAX: until it ends), into `out`. `search`: NULL for seed 1, steps of 0.5 and pieces down to 1e-3. What hands hold goes with them; the robot's own q does not matter. *Not found*
/// is an answer, not an error.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn lw_planner_plan(
    robot: *mut LwRobot,
    planner: *mut LwPlanner,
    start: *const f64,
    goal: *const f64,
    n: usize,
    search: *const LwSearch,
    places: usize,
    out: *mut LwPlan,
) -> LwStatus {
    // SAFETY: the caller's promises.
    unsafe {
        alone(robot, LwRobot::parts, |r| {
            let out = Out::new("out", out)?;
            let mut planner = lend("planner", planner, |p| &p.0, r)?;
            let mut how = Search::default();
            if !search.is_null() {
                let LwSearch { seed, step, least } = value("search", search)?;
                how = Search { seed, step, least };
            }
            let nq = r.model().nq();
            let (start, goal) = (numbers("start", start, n, nq)?, numbers("goal", goal, n, nq)?);
            let mut way = planner.begin(&mut r.robot, start, goal, &how)?;
            if way == PlanOutcome::Unfinished {
                way = planner.resume(&mut r.robot, places)?;
            }
            out.set(LwPlan::new(way, &planner));
            Ok(())
        })
    }
}

/// Goes on with an unfinished search for at most so many random places, with the robot as it was at its begin. Portions do not change what is found.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn lw_planner_resume(
    robot: *mut LwRobot,
    planner: *mut LwPlanner,
    places: usize,
    out: *mut LwPlan,
) -> LwStatus {
    // SAFETY: the caller's promises.
    unsafe {
        alone(robot, LwRobot::parts, |r| {
            let out = Out::new("out", out)?;
            let mut planner = lend("planner", planner, |p| &p.0, r)?;
            let way = planner.resume(&mut r.robot, places)?;
            out.set(LwPlan::new(way, &planner));
            Ok(())
        })
    }
}

/// The way that was found last, into `way`: configurations (nq numbers each) from the start to the goal, one after the other, between which all coordinates move in proportion; `n`: nq times the
/// `rows` of `LwPlan`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn lw_planner_path(
    robot: *mut LwRobot,
    planner: *mut LwPlanner,
    way: *mut f64,
    n: usize,
) -> LwStatus {
    // SAFETY: the caller's promises.
    unsafe {
        alone(robot, LwRobot::parts, |r| {
            let planner = lend("planner", planner, |p| &p.0, r)?;
            let nq = r.model().nq();
            let to = numbers_mut("way", way, n, nq * planner.path().len())?;
            for (to, q) in to.chunks_exact_mut(nq.max(1)).zip(planner.path()) {
                to.copy_from_slice(q);
            }
            Ok(())
        })
    }
}

/// A path as the robot tells it, where there is one.
pub(crate) fn told(path: Result<Path, RobotError>) -> Result<LwPath, Fault> {
    Ok(Some(path?).into())
}
