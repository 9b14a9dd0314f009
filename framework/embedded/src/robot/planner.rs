//! A free way for a chain from one configuration to another: two trees of configurations, one from each end, grow towards random places and then
//! towards each other (RRT-Connect: Kuffner and LaValle, ICRA 2000). Then corners that are not needed are cut off.
//!
//! Every piece is [proven free](Robot::path_free), not sampled. Work is counted in configurations; the same seed gives the same way. What hands
//! hold goes with them.

use super::{Path, Robot};
use crate::error::RobotError;
use crate::part::Part;
use linkwork_collision::ColliderId;
use linkwork_multibody::uniform;

/// How to look for a way.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Search {
    /// Of the random places.
    pub seed: u64,
    /// Longest piece, as the greatest change of one coordinate, rad or m.
    pub step: f64,
    /// Pieces of a piece that are not cut again, see [`Robot::path_free`].
    pub least: f64,
}

impl Default for Search {
    /// Seed 1, pieces of 0.5 rad or m, cut down to a thousandth.
    fn default() -> Self {
        Self { seed: 1, step: 0.5, least: 1e-3 }
    }
}

/// What a search for a way ends with.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum PlanOutcome {
    /// [`Planner::path`] is free from end to end.
    Found,
    /// The start touches something.
    BlockedStart {
        /// The two that touch.
        pair: (ColliderId, ColliderId),
    },
    /// The goal touches something.
    BlockedGoal {
        /// The two that touch.
        pair: (ColliderId, ColliderId),
    },
    /// The room was used up. There may be a way, or none.
    NotFound,
    /// There is room left: [`Planner::resume`] goes on.
    Unfinished,
}

/// One coordinate of the chain: its place in q, and between which values it is drawn.
#[derive(Clone, Copy, Debug)]
struct Coordinate {
    at: usize,
    lower: f64,
    upper: f64,
}

/// Configurations (rows of the chain's numbers), each with the one that it came from.
#[derive(Clone, Debug)]
struct Branches {
    q: Vec<f64>,
    parents: Vec<usize>,
}

/// Memory of searches for one chain of a model.
#[derive(Clone, Debug)]
pub struct Planner {
    part: Part,
    nq: usize,
    chain: Vec<Coordinate>,
    room: usize,
    trees: [Branches; 2],
    /// Where a tree grows to, and what it reached.
    to: Vec<f64>,
    new: Vec<f64>,
    /// Whole configurations: ends of a piece.
    ends: [Vec<f64>; 2],
    /// Rows of whole configurations.
    way: Vec<f64>,
    search: Search,
    /// Of the random places: its state, how many were drawn; and the tree that grows next.
    state: u64,
    drawn: usize,
    growing: usize,
}

/// How a tree grew.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Grown {
    /// To where it was to grow.
    There,
    /// A step towards it.
    Nearer,
    /// Not at all.
    Blocked,
}

impl Planner {
    /// For a chain, with room for so many configurations in each tree. Allocates: once, at set-up.
    ///
    /// # Errors
    /// [`RobotError::ForeignHandle`], [`RobotError::NotAChain`]; [`RobotError::OutOfRange`] for a chain with ball or free hinges, and for no room; [`RobotError::OpensClosure`].
    pub fn new(robot: &Robot, part: Part, room: usize) -> Result<Self, RobotError> {
        if room < 2 {
            let (what, help) = ("room", "at least two configurations");
            return Err(RobotError::OutOfRange { what, value: room as f64, help });
        }
        let own = robot.model.chain(part)?;
        robot.model.opens(own, "a planned way")?;
        let mut chain = Vec::with_capacity(own.limits.len());
        for (i, limit) in own.limits.iter().enumerate() {
            let Some((at, limits)) = limit else {
                let help = "plan for parts of pins, sliders and screws";
                let what = "a degree of freedom of the part without a coordinate of its own";
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
            way: Vec::with_capacity(2 * room * nq),
            search: Search::default(),
            state: 0,
            drawn: 8 * room,
            growing: 0,
        })
    }

    /// The way that was found last, configurations (nq) from the start to the goal; all coordinates move in proportion between two of them.
    pub fn path(&self) -> impl ExactSizeIterator<Item = &[f64]> {
        self.way.chunks_exact(self.nq)
    }

    /// Looks for a free way of the chain from `start` to `goal` (nq each), which differ in its coordinates alone. The robot's own q does not matter.
    ///
    /// # Errors
    /// [`RobotError::Length`], [`RobotError::NotFinite`], [`RobotError::ForeignHandle`] for a robot of another size, [`RobotError::OutsideLimits`];
    /// [`RobotError::OutOfRange`] for ends that differ elsewhere, and for a step or `least` out of range. *Not found* is an answer, not an error.
    pub fn plan(
        &mut self,
        robot: &mut Robot,
        start: &[f64],
        goal: &[f64],
        search: &Search,
    ) -> Result<PlanOutcome, RobotError> {
        match self.begin(robot, start, goal, search)? {
            PlanOutcome::Unfinished => self.resume(robot, usize::MAX),
            way => Ok(way),
        }
    }

    /// Begins a search as [`plan`](Self::plan) does it, for [`resume`](Self::resume): both ends and the straight way. [`PlanOutcome::Unfinished`] when these do not tell.
    ///
    /// # Errors
    /// As `plan`.
    pub fn begin(
        &mut self,
        robot: &mut Robot,
        start: &[f64],
        goal: &[f64],
        search: &Search,
    ) -> Result<PlanOutcome, RobotError> {
        self.check(robot, start, goal, search)?;
        self.way.clear();
        // Nothing to go on with, unless this ends as unfinished.
        self.drawn = 8 * self.room;
        if let Some(pair) = robot.first_hit(start)? {
            return Ok(PlanOutcome::BlockedStart { pair });
        }
        if let Some(pair) = robot.first_hit(goal)? {
            return Ok(PlanOutcome::BlockedGoal { pair });
        }
        if robot.path_free(start, goal, search.least)? == Path::Free {
            self.way.extend_from_slice(start);
            self.way.extend_from_slice(goal);
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

    /// Goes on with a search for at most so many random places, with the robot as it was at its begin. Portions do not change what is found.
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
            // A draw that leads nowhere counts as well: the work is bounded.
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
            let (what, value, help) = ("step", search.step, "a step is above zero");
            return Err(RobotError::OutOfRange { what, value, help });
        }
        let own = |at: usize| self.chain.iter().any(|c| c.at == at);
        if let Some(at) = (0..self.nq).find(|at| start[*at] != goal[*at] && !own(*at)) {
            let what =
                "the difference of start and goal in a coordinate that the part does not move";
            let (value, help) = (goal[at] - start[at], "give both the same value there");
            return Err(RobotError::OutOfRange { what, value, help });
        }
        let chain = robot.model.chain(self.part)?;
        chain.within_limits(start)?;
        chain.within_limits(goal)
    }

    /// Grows a tree from its nearest configuration towards `to` by a step at most.
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
            // The end itself, to the bit.
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

    /// The way through the last configurations of both trees, which are one.
    fn join(&mut self) {
        let n = self.chain.len();
        // What the chain does not move is in both ends of every piece.
        let rest = &self.ends[0];
        let row = |way: &mut Vec<f64>, q: &[f64]| {
            let from = way.len();
            way.extend_from_slice(rest);
            for (c, x) in self.chain.iter().zip(q) {
                way[from + c.at] = *x;
            }
        };
        let mut at = self.trees[0].parents.len() - 1;
        loop {
            row(&mut self.way, &self.trees[0].q[n * at..n * (at + 1)]);
            if at == 0 {
                break;
            }
            at = self.trees[0].parents[at];
        }
        // From the start on.
        let rows = self.way.len() / self.nq;
        for k in 0..rows / 2 {
            let (a, b) = self.way.split_at_mut(self.nq * (rows - 1 - k));
            a[self.nq * k..self.nq * (k + 1)].swap_with_slice(&mut b[..self.nq]);
        }
        at = self.trees[1].parents.len() - 1;
        while at != 0 {
            at = self.trees[1].parents[at];
            row(&mut self.way, &self.trees[1].q[n * at..n * (at + 1)]);
        }
    }

    /// From each configuration on to the last that can be reached from it straight on.
    fn cut_corners(&mut self, robot: &mut Robot, search: &Search) -> Result<(), RobotError> {
        let nq = self.nq;
        let (mut kept, mut rows) = (0, self.way.len() / nq);
        while kept + 2 < rows {
            let mut next = rows - 1;
            while next > kept + 1 {
                let [a, b] = [kept, next].map(|k| &self.way[nq * k..nq * (k + 1)]);
                if robot.path_free(a, b, search.least)? == Path::Free {
                    break;
                }
                next -= 1;
            }
            self.way.copy_within(nq * next.., nq * (kept + 1));
            rows -= next - kept - 1;
            self.way.truncate(nq * rows);
            kept += 1;
        }
        Ok(())
    }
}
