//! Sampling-based motion planning: a collision-free path of a chain from one configuration to another. RRT-Connect (Kuffner and LaValle, ICRA 2000)
//! grows two trees of configurations, one from each end, towards random samples and then towards each other. Unnecessary corners of the path are
//! removed afterwards.
//!
//! Every piece is [proven free](Robot::path_free), not sampled. Work is counted in configurations, and the same seed gives the same path. Held
//! objects move with the hands.

use super::{Path, Robot};
use crate::error::RobotError;
use crate::part::Part;
use linkwork_collision::ColliderId;
use linkwork_multibody::uniform;

/// Settings of a search.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Search {
    /// Seed of the random samples.
    pub seed: u64,
    /// Longest piece, as the largest change of one coordinate, rad or m.
    pub step: f64,
    /// Fraction of a piece that [`Robot::path_free`] does not halve again.
    pub least: f64,
}

impl Default for Search {
    /// Seed 1, pieces of 0.5 rad or m, halved down to a thousandth.
    fn default() -> Self {
        Self { seed: 1, step: 0.5, least: 1e-3 }
    }
}

/// Result of a search.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum PlanOutcome {
    /// [`Planner::path`] is free from end to end.
    Found,
    /// The start is in collision.
    BlockedStart {
        /// The two colliders that touch.
        pair: (ColliderId, ColliderId),
    },
    /// The goal is in collision.
    BlockedGoal {
        /// The two colliders that touch.
        pair: (ColliderId, ColliderId),
    },
    /// The memory was used up. A path may or may not exist.
    NotFound,
    /// The search is not finished: [`Planner::resume`] continues it.
    Unfinished,
}

/// One coordinate of the chain: its index in q, and the range of its samples.
#[derive(Clone, Copy, Debug)]
struct Coordinate {
    at: usize,
    lower: f64,
    upper: f64,
}

/// Configurations (rows of the chain's coordinates), each with the index of its parent.
#[derive(Clone, Debug)]
struct Branches {
    q: Vec<f64>,
    parents: Vec<usize>,
}

/// Planner for one chain of a model, with its memory.
#[derive(Clone, Debug)]
pub struct Planner {
    part: Part,
    nq: usize,
    chain: Vec<Coordinate>,
    room: usize,
    trees: [Branches; 2],
    /// Target of the growth, and the new configuration.
    to: Vec<f64>,
    new: Vec<f64>,
    /// Whole configurations: ends of a piece.
    ends: [Vec<f64>; 2],
    /// Whole configurations of the path.
    path: Vec<f64>,
    search: Search,
    /// State of the random numbers, number of samples so far, and the tree that grows next.
    state: u64,
    drawn: usize,
    growing: usize,
}

/// Result of growing a tree.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Grown {
    /// The target was reached.
    There,
    /// A step towards the target was added.
    Nearer,
    /// No step was possible.
    Blocked,
}

impl Planner {
    /// Creates a planner for a chain, with memory for `room` configurations in each tree. Allocates memory; later calls do not.
    ///
    /// # Errors
    /// [`RobotError::ForeignHandle`]; [`RobotError::NotAChain`]; [`RobotError::OutOfRange`] for a chain with ball or free hinges, and for fewer than
    /// two configurations; [`RobotError::OpensClosure`].
    pub fn new(robot: &Robot, part: Part, room: usize) -> Result<Self, RobotError> {
        if room < 2 {
            let (what, help) = ("room", "reserve at least two configurations");
            return Err(RobotError::OutOfRange { what, value: room as f64, help });
        }
        let own = robot.model.chain(part)?;
        robot.model.opens(own, "path planning")?;
        let mut chain = Vec::with_capacity(own.limits.len());
        for (i, limit) in own.limits.iter().enumerate() {
            let Some((at, limits)) = limit else {
                let help = "plan only for parts with pins, sliders and screws";
                let what = "a degree of freedom of the part that has no single coordinate";
                return Err(RobotError::OutOfRange { what, value: i as f64, help });
            };
            let turn = std::f64::consts::PI;
            let lower = if limits.lower.is_finite() { limits.lower } else { -turn };
            let upper = if limits.upper.is_finite() { limits.upper } else { turn };
            chain.push(Coordinate { at: own.q[*at], lower, upper });
        }
        let (n, nq) = (chain.len(), robot.q.len());
        let tree =
            || Branches { q: Vec::with_capacity(n * room), parents: Vec::with_capacity(room) };
        Ok(Self {
            part,
            nq,
            chain,
            room,
            trees: [tree(), tree()],
            to: vec![0.0; n],
            new: vec![0.0; n],
            ends: [vec![0.0; nq], vec![0.0; nq]],
            path: Vec::with_capacity(2 * room * nq),
            search: Search::default(),
            state: 0,
            drawn: 8 * room,
            growing: 0,
        })
    }

    /// Returns the configurations (nq) of the last path, from start to goal. All coordinates move in proportion between two of them.
    pub fn path(&self) -> impl ExactSizeIterator<Item = &[f64]> {
        self.path.chunks_exact(self.nq)
    }

    /// Searches for a collision-free path of the chain from `start` to `goal` (nq each), which may differ only in the chain's coordinates. The
    /// robot's own q has no effect.
    ///
    /// # Errors
    /// [`RobotError::Length`]; [`RobotError::NotFinite`]; [`RobotError::ForeignHandle`] for a robot of another size; [`RobotError::OutsideLimits`];
    /// [`RobotError::OutOfRange`] for ends that differ in other coordinates, and for a `step` or `least` out of range. [`PlanOutcome::NotFound`] is a result,
    /// not an error.
    pub fn plan(
        &mut self,
        robot: &mut Robot,
        start: &[f64],
        goal: &[f64],
        search: &Search,
    ) -> Result<PlanOutcome, RobotError> {
        match self.begin(robot, start, goal, search)? {
            PlanOutcome::Unfinished => self.resume(robot, usize::MAX),
            outcome => Ok(outcome),
        }
    }

    /// Begins a search like [`plan`](Self::plan), to be continued with [`resume`](Self::resume): checks both ends and the straight path. Returns
    /// [`PlanOutcome::Unfinished`] if these do not decide the result.
    ///
    /// # Errors
    /// Like `plan`.
    pub fn begin(
        &mut self,
        robot: &mut Robot,
        start: &[f64],
        goal: &[f64],
        search: &Search,
    ) -> Result<PlanOutcome, RobotError> {
        self.check(robot, start, goal, search)?;
        self.path.clear();
        // Mark the search as ended, so that it cannot be continued unless it ends as unfinished.
        self.drawn = 8 * self.room;
        if let Some(pair) = robot.first_hit(start)? {
            return Ok(PlanOutcome::BlockedStart { pair });
        }
        if let Some(pair) = robot.first_hit(goal)? {
            return Ok(PlanOutcome::BlockedGoal { pair });
        }
        if robot.path_free(start, goal, search.least)? == Path::Free {
            self.path.extend_from_slice(start);
            self.path.extend_from_slice(goal);
            return Ok(PlanOutcome::Found);
        }
        for (tree, end) in self.trees.iter_mut().zip([start, goal]) {
            tree.q.clear();
            tree.parents.clear();
            tree.q.extend(self.chain.iter().map(|c| end[c.at]));
            tree.parents.push(0);
        }
        for end in &mut self.ends {
            end.copy_from_slice(start);
        }
        (self.search, self.state, self.drawn, self.growing) = (*search, search.seed, 0, 0);
        Ok(PlanOutcome::Unfinished)
    }

    /// Continues a search with at most `places` random samples. The robot must hold the same objects as at the beginning. The result does not depend
    /// on how the samples are divided into calls.
    ///
    /// # Errors
    /// [`RobotError::ForeignHandle`] for a robot of another size.
    pub fn resume(&mut self, robot: &mut Robot, places: usize) -> Result<PlanOutcome, RobotError> {
        if robot.q.len() != self.nq {
            return Err(RobotError::ForeignHandle);
        }
        let own = self.search;
        let search = &own;
        for _ in 0..places {
            let full = self.trees.iter().any(|t| t.parents.len() == self.room);
            // Samples that lead nowhere count as well, so that the work is bounded.
            if full || self.drawn >= 8 * self.room {
                return Ok(PlanOutcome::NotFound);
            }
            self.drawn += 1;
            for (x, c) in self.to.iter_mut().zip(&self.chain) {
                *x = c.lower + (c.upper - c.lower) * uniform(&mut self.state);
            }
            let growing = self.growing;
            if self.grow(robot, growing, search)? != Grown::Blocked {
                let n = self.chain.len();
                let tree = &self.trees[growing];
                self.to.copy_from_slice(&tree.q[tree.q.len() - n..]);
                let mut grown = Grown::Nearer;
                while grown == Grown::Nearer && self.trees[1 - growing].parents.len() < self.room {
                    grown = self.grow(robot, 1 - growing, search)?;
                }
                if grown == Grown::There {
                    self.join();
                    self.cut_corners(robot, search)?;
                    self.drawn = 8 * self.room;
                    return Ok(PlanOutcome::Found);
                }
            }
            self.growing = 1 - growing;
        }
        Ok(PlanOutcome::Unfinished)
    }

    fn check(
        &self,
        robot: &Robot,
        start: &[f64],
        goal: &[f64],
        search: &Search,
    ) -> Result<(), RobotError> {
        if robot.q.len() != self.nq {
            return Err(RobotError::ForeignHandle);
        }
        robot.model.configurations("start", start, 1)?;
        robot.model.configurations("goal", goal, 1)?;
        if !(search.step > 0.0 && search.step.is_finite()) {
            let (what, value, help) = ("step", search.step, "the step must be positive");
            return Err(RobotError::OutOfRange { what, value, help });
        }
        let own = |at: usize| self.chain.iter().any(|c| c.at == at);
        if let Some(at) = (0..self.nq).find(|at| start[*at] != goal[*at] && !own(*at)) {
            let what =
                "difference of start and goal in a coordinate that does not belong to the part";
            let (value, help) = (goal[at] - start[at], "give both the same value");
            return Err(RobotError::OutOfRange { what, value, help });
        }
        let chain = robot.model.chain(self.part)?;
        chain.within_limits(start)?;
        chain.within_limits(goal)
    }

    /// Grows a tree from the configuration nearest to `to` by at most one step.
    fn grow(
        &mut self,
        robot: &mut Robot,
        which: usize,
        search: &Search,
    ) -> Result<Grown, RobotError> {
        let n = self.chain.len();
        let tree = &self.trees[which];
        let (mut near, mut least) = (0, f64::INFINITY);
        for (k, q) in tree.q.chunks_exact(n).enumerate() {
            let d: f64 = q.iter().zip(&self.to).map(|(a, b)| (a - b) * (a - b)).sum();
            if d < least {
                (near, least) = (k, d);
            }
        }
        let from = &tree.q[n * near..n * (near + 1)];
        let far = from.iter().zip(&self.to).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        let grown = if far <= search.step { Grown::There } else { Grown::Nearer };
        let part = if grown == Grown::There { 1.0 } else { search.step / far };
        for ((new, a), b) in self.new.iter_mut().zip(from).zip(&self.to) {
            // Use the exact end when it is reached.
            *new = if grown == Grown::There { *b } else { a + part * (b - a) };
        }
        let [qa, qb] = &mut self.ends;
        for ((c, a), b) in self.chain.iter().zip(from).zip(&self.new) {
            (qa[c.at], qb[c.at]) = (*a, *b);
        }
        if robot.path_free(qa, qb, search.least)? != Path::Free {
            return Ok(Grown::Blocked);
        }
        let tree = &mut self.trees[which];
        tree.q.extend_from_slice(&self.new);
        tree.parents.push(near);
        Ok(grown)
    }

    /// Joins the paths through the last configurations of both trees, which coincide.
    fn join(&mut self) {
        let n = self.chain.len();
        // Coordinates outside the chain have the same values in all configurations.
        let rest = &self.ends[0];
        let row = |path: &mut Vec<f64>, q: &[f64]| {
            let from = path.len();
            path.extend_from_slice(rest);
            for (c, x) in self.chain.iter().zip(q) {
                path[from + c.at] = *x;
            }
        };
        let mut at = self.trees[0].parents.len() - 1;
        loop {
            row(&mut self.path, &self.trees[0].q[n * at..n * (at + 1)]);
            if at == 0 {
                break;
            }
            at = self.trees[0].parents[at];
        }
        // Reverse the path so that it begins at the start.
        let rows = self.path.len() / self.nq;
        for k in 0..rows / 2 {
            let (a, b) = self.path.split_at_mut(self.nq * (rows - 1 - k));
            a[self.nq * k..self.nq * (k + 1)].swap_with_slice(&mut b[..self.nq]);
        }
        at = self.trees[1].parents.len() - 1;
        while at != 0 {
            at = self.trees[1].parents[at];
            row(&mut self.path, &self.trees[1].q[n * at..n * (at + 1)]);
        }
    }

    /// Connects each configuration to the last one that can be reached by a straight path.
    fn cut_corners(&mut self, robot: &mut Robot, search: &Search) -> Result<(), RobotError> {
        let nq = self.nq;
        let (mut kept, mut rows) = (0, self.path.len() / nq);
        while kept + 2 < rows {
            let mut next = rows - 1;
            while next > kept + 1 {
                let [a, b] = [kept, next].map(|k| &self.path[nq * k..nq * (k + 1)]);
                if robot.path_free(a, b, search.least)? == Path::Free {
                    break;
                }
                next -= 1;
            }
            self.path.copy_within(nq * next.., nq * (kept + 1));
            rows -= next - kept - 1;
            self.path.truncate(nq * rows);
            kept += 1;
        }
        Ok(())
    }
}
