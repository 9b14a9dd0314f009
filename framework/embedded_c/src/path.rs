//! Collision checks of paths between configurations, and path planning.

use crate::call::calls;
use crate::collide::LwPair;
use crate::edge::{Out, numbers, numbers_mut, value};
use crate::robot::{Instance, LwRobot};
use crate::status::Fault;
use crate::tool::{MANY, Tool, lend, room};
use linkwork_embedded::{Part, Path, PathProgress, PlanOutcome, Planner, RobotError, Search};

/// Result of a collision check of a path.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LwPathOutcome {
    /// The whole path is proven free.
    Free,
    /// Two colliders touch.
    Hit,
    /// No collision was found, but some pieces of the minimum length could not be proven free.
    Undecided,
    /// The requested number of pieces was checked; `lw_robot_path_free_on` continues.
    Unfinished,
}

/// Result of a collision check of a path, with its position.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LwPath {
    /// Position on the path, from 0 at its start to 1 at its end, where two colliders touch, or of the first undecided piece; otherwise 0.
    pub at: f64,
    /// The two colliders that touch there; otherwise zero.
    pub pair: LwPair,
    /// The result.
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

/// A path that is checked in several calls.
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

/// Settings of path planning.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LwSearch {
    /// Seed of the random samples. The same seed gives the same path.
    pub seed: u64,
    /// Longest piece, as the largest change of one coordinate, rad or m; above zero.
    pub step: f64,
    /// Fraction of a piece that is not halved again, as in `lw_robot_path_free`.
    pub least: f64,
}

/// Result of path planning.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LwPlanOutcome {
    /// A path was found that is free from end to end; `lw_planner_path` returns it.
    Found,
    /// The start is in collision.
    BlockedStart,
    /// The goal is in collision.
    BlockedGoal,
    /// The memory was used up. A path may or may not exist.
    NotFound,
    /// The requested number of samples was used; `lw_planner_resume` continues.
    Unfinished,
}

/// Result of path planning, with the size of the path.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct LwPlan {
    /// Number of configurations, including both ends; 0 when no path was found.
    pub rows: usize,
    /// The two colliders that touch at a blocked end; otherwise zero.
    pub pair: LwPair,
    /// Result of the search.
    pub outcome: LwPlanOutcome,
}

impl LwPlan {
    fn new(outcome: PlanOutcome, planner: &Planner) -> Self {
        let none = LwPair { a: 0, b: 0 };
        let (outcome, pair) = match outcome {
            PlanOutcome::Found => (LwPlanOutcome::Found, none),
            PlanOutcome::BlockedStart { pair } => (LwPlanOutcome::BlockedStart, pair.into()),
            PlanOutcome::BlockedGoal { pair } => (LwPlanOutcome::BlockedGoal, pair.into()),
            PlanOutcome::NotFound => (LwPlanOutcome::NotFound, none),
            PlanOutcome::Unfinished => (LwPlanOutcome::Unfinished, none),
        };
        Self { rows: planner.path().len(), pair, outcome }
    }
}

/// Memory of path planning for one chain. Use it for robots of one model, with one call at a time.
pub struct LwPlanner(Tool<Planner>);

calls![
    /// Checks whether the path from `qa` to `qb` (`n` = nq each) is free of collisions while all coordinates move in proportion, and writes the result to
    /// `out`. The result is proven, not sampled. Held objects move with the hands. Pieces shorter than `least` (a fraction of the path, 1e-9 to 1;
    /// usually 1e-3) are not halved again. Checks at most `pieces` pieces (SIZE_MAX: all). The robot's own q has no effect. Returns
    /// `LW_STATUS_OUT_OF_RANGE` also for an end beyond the limits of a slider.
    fn lw_robot_path_free(
        r: &mut LwRobot,
        qa: *const f64,
        qb: *const f64,
        n: usize,
        least: f64,
        pieces: usize,
        out: Out<LwPath>,
    ) {
        let nq = r.model().nq();
        let (qa, qb) = (numbers("qa", qa, n, nq)?, numbers("qb", qb, n, nq)?);
        // A call with zero pieces only checks the arguments.
        let mut progress = PathProgress::default();
        r.robot.path_free_on(qa, qb, least, &mut progress, 0)?;
        let [a, b] = &mut r.swept.ends;
        a.copy_from_slice(qa);
        b.copy_from_slice(qb);
        (r.swept.least, r.swept.progress) = (least, Some(progress));
        out.set(r.sweep(pieces)?);
    }

    /// Continues the check of the last `lw_robot_path_free` that is unfinished, for up to `pieces` pieces. The robot must hold the same objects. The
    /// result does not depend on the number of calls. Returns `LW_STATUS_NO_SEARCH` when there is no unfinished check.
    fn lw_robot_path_free_on(r: &mut LwRobot, pieces: usize, out: Out<LwPath>) {
        out.set(r.sweep(pieces)?);
    }

    /// Creates the memory of path planning for a chain of pins, sliders and screws, with room for `configurations` (2 to 1048576) in each of two trees,
    /// and writes it to `out`; free it with `lw_planner_free`. It works with every robot of the same model.
    fn lw_planner_new(
        r: &mut LwRobot,
        part: Part,
        configurations: usize,
        out: Out<*mut LwPlanner>,
    ) {
        let planner = Planner::new(&r.robot, part, room("configurations", configurations, MANY)?)?;
        out.set(Box::into_raw(Box::new(LwPlanner(Tool::new(r, planner)))));
    }

    /// Frees the memory; NULL has no effect.
    fn lw_planner_free(planner: *mut LwPlanner);

    /// Searches for a collision-free path of the chain from `start` to `goal` (`n` = nq each, within limits; they may differ only in the chain's
    /// coordinates) with at most `places` random samples in this call (SIZE_MAX: no limit), and writes the result to `out`. `search`: NULL for seed 1,
    /// steps of 0.5 and pieces down to 1e-3. Held objects move with the hands; the robot's own q has no effect. If no path is found, this is a result,
    /// not an error.
    fn lw_planner_plan(
        r: &mut LwRobot,
        planner: *mut LwPlanner,
        start: *const f64,
        goal: *const f64,
        n: usize,
        search: *const LwSearch,
        places: usize,
        out: Out<LwPlan>,
    ) {
        let mut planner = lend("planner", planner, |p| &p.0, r)?;
        let mut how = Search::default();
        if !search.is_null() {
            let LwSearch { seed, step, least } = value("search", search)?;
            how = Search { seed, step, least };
        }
        let nq = r.model().nq();
        let (start, goal) = (numbers("start", start, n, nq)?, numbers("goal", goal, n, nq)?);
        let mut outcome = planner.begin(&mut r.robot, start, goal, &how)?;
        if outcome == PlanOutcome::Unfinished {
            outcome = planner.resume(&mut r.robot, places)?;
        }
        out.set(LwPlan::new(outcome, &planner));
    }

    /// Continues an unfinished search with at most `places` random samples. The robot must hold the same objects as at the beginning. The result does not
    /// depend on the number of calls.
    fn lw_planner_resume(
        r: &mut LwRobot,
        planner: *mut LwPlanner,
        places: usize,
        out: Out<LwPlan>,
    ) {
        let mut planner = lend("planner", planner, |p| &p.0, r)?;
        let outcome = planner.resume(&mut r.robot, places)?;
        out.set(LwPlan::new(outcome, &planner));
    }

    /// Writes the path that was found last to `path`: configurations (nq numbers each) from the start to the goal, one after the other, between which all
    /// coordinates move in proportion. `n`: nq times the `rows` of `LwPlan`.
    fn lw_planner_path(r: &mut LwRobot, planner: *mut LwPlanner, path: *mut f64, n: usize) {
        let planner = lend("planner", planner, |p| &p.0, r)?;
        let nq = r.model().nq();
        let to = numbers_mut("path", path, n, nq * planner.path().len())?;
        for (to, q) in to.chunks_exact_mut(nq.max(1)).zip(planner.path()) {
            to.copy_from_slice(q);
        }
    }
];

/// Converts the robot's result for a path.
pub(crate) fn told(path: Result<Path, RobotError>) -> Result<LwPath, Fault> {
    Ok(Some(path?).into())
}
