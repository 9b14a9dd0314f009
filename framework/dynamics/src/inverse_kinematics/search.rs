//! The search: Levenberg–Marquardt with limits, from one start after another, an evaluation of the
//! kinematics at a time, so that it may stop anywhere and go on later.
//!
//! ```text
//! start ─ step ─ step ─ … ─ met
//!           └ slow: the next start … the last one: the best of all, to its end ─ met, or nearest
//! ```
//! A start is left when its steps hardly gain: most of the minima that are not zero are told by that, and
//! another start costs less than to follow them.

use super::{Found, InverseKinematics, InverseKinematicsError, Place, Target};
use super::{check_nodes, check_state};
use crate::tree::Tree;
use linkwork_multibody::Limits;
use std::f64::consts::PI;

/// A gain of less than this part of the cost is a slow step.
const SLOW: f64 = 0.25;
/// So many slow steps one after another end a start.
const SLOW_STEPS: usize = 2;

/// How far a search has come.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Progress {
    /// All targets are met.
    Met(Found),
    /// No start led there: this is the nearest of all.
    Nearest(Found),
    /// Not yet decided.
    Unfinished(Found),
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Stage {
    Start,
    Step,
    /// From the best of all starts to the end of its way.
    Last,
    Met,
    Nearest,
}

/// Where a search stands.
#[derive(Clone, Copy, Debug)]
pub(super) struct Search {
    stage: Stage,
    restart: usize,
    best_restart: usize,
    iterations: usize,
    kinematics: usize,
    /// Steps from this start, and slow ones one after another.
    steps: usize,
    slow: usize,
    factor: f64,
    growth: f64,
    cost: f64,
    least: f64,
    /// J is that of the present q.
    linear: bool,
}

impl Search {
    pub(super) const NONE: Self = Self {
        stage: Stage::Nearest,
        restart: 0,
        best_restart: 0,
        iterations: 0,
        kinematics: 0,
        steps: 0,
        slow: 0,
        factor: 1.0,
        growth: 2.0,
        cost: f64::INFINITY,
        least: f64::INFINITY,
        linear: false,
    };

    fn found(&self) -> Found {
        Found {
            iterations: self.iterations,
            restarts: self.best_restart,
            kinematics: self.kinematics,
        }
    }
}

impl InverseKinematics {
    /// Prepares a search from `q` (nq) for [`advance`](Self::advance), which does all the work. Allocates for
    /// errors, and for more targets than ever before ([`reserve`](Self::reserve)).
    ///
    /// # Errors
    /// [`InverseKinematicsError::BadNumber`] and [`InverseKinematicsError::Empty`].
    #[track_caller]
    pub fn begin(
        &mut self,
        tree: &Tree,
        targets: &[Target],
        q: &[f64],
    ) -> Result<(), InverseKinematicsError> {
        check_state(self, tree, q);
        check_nodes(tree, targets.iter().flat_map(|t| [Some(t.node), t.relative_to]).flatten());
        super::solve::check_targets(tree, targets)?;
        super::solve::check_start(q)?;
        let rows = targets.iter().map(|t| t.goal.rows()).sum();
        self.room(rows, targets.len(), tree.nv());
        self.targets.clear();
        self.targets.extend_from_slice(targets);
        self.rows = rows;
        self.start.copy_from_slice(q);
        self.best.copy_from_slice(q);
        self.search = Search { stage: Stage::Start, ..Search::NONE };
        self.disturbed = false;
        let known = |t: &Target| {
            t.relative_to.is_none() && t.goal.pointing.is_none() && t.goal.place == Place::Point
        };
        let mut moves = self.moves.iter().zip(&self.place);
        self.bends = targets.iter().all(known) && moves.all(|(moves, at)| !moves || at.is_some());
        Ok(())
    }

    /// Begins at another start of the same ones: 0 is the given one. After [`begin`](Self::begin).
    pub fn skip_to(&mut self, restart: usize) {
        self.search.restart = restart;
    }

    /// Goes on with a search for at most so many evaluations of the kinematics. `q` (nq) gets the solution,
    /// or the nearest configuration so far. The same steps are taken whatever the portions. Allocates nothing.
    #[track_caller]
    pub fn advance(&mut self, tree: &Tree, kinematics: usize, q: &mut [f64]) -> Progress {
        check_state(self, tree, q);
        self.settle(tree);
        let until = self.search.kinematics.saturating_add(kinematics);
        loop {
            match self.search.stage {
                Stage::Met => {
                    q.copy_from_slice(&self.now);
                    return Progress::Met(self.search.found());
                }
                Stage::Nearest => {
                    q.copy_from_slice(&self.best);
                    return Progress::Nearest(self.search.found());
                }
                _ if self.search.kinematics >= until => {
                    let nearer = self.search.cost < self.search.least;
                    q.copy_from_slice(if nearer { &self.now } else { &self.best });
                    return Progress::Unfinished(self.search.found());
                }
                Stage::Start => self.begin_start(tree),
                Stage::Step | Stage::Last => self.step(tree),
            }
        }
    }

    /// Brings the memory back to `now` after rates have used it.
    fn settle(&mut self, tree: &Tree) {
        if std::mem::take(&mut self.disturbed) {
            self.room(self.rows, self.targets.len(), tree.nv());
            let now = std::mem::take(&mut self.now);
            self.evaluate(tree, &now);
            self.now = now;
            self.search.linear = false;
        }
    }

    fn begin_start(&mut self, tree: &Tree) {
        self.now.copy_from_slice(&self.start);
        if self.search.restart > 0 {
            self.elsewhere(tree, self.search.restart);
        }
        self.go_from_now(tree, Stage::Step);
    }

    /// Begins to step from `now`.
    fn go_from_now(&mut self, tree: &Tree, stage: Stage) {
        let mut now = std::mem::take(&mut self.now);
        self.clamp(&mut now);
        let cost = self.evaluate(tree, &now);
        self.now = now;
        let met = self.is_met();
        let s = &mut self.search;
        (s.steps, s.slow, s.factor, s.growth) = (0, 0, 1e-2, 2.0);
        (s.cost, s.linear) = (cost, false);
        s.kinematics += 1;
        s.stage = if met { Stage::Met } else { stage };
        if met {
            s.best_restart = if stage == Stage::Last { s.best_restart } else { s.restart };
        }
    }

    /// One evaluation at most.
    fn step(&mut self, tree: &Tree) {
        let (rows, nv) = (self.rows, tree.nv());
        if !self.search.linear {
            if self.search.steps >= self.effort.iterations {
                return self.end_start(tree);
            }
            self.linearise(tree);
            self.gradient_of(rows, nv);
            let now = std::mem::take(&mut self.now);
            self.choose_free(&now);
            self.now = now;
            self.squares(rows, nv);
            let steep = self.free.iter().fold(0.0_f64, |m, i| m.max(self.gradient[*i].abs()));
            if !(steep > 1e-16 * self.search.cost.sqrt()) || !self.search.cost.is_finite() {
                return self.end_start(tree);
            }
            self.search.linear = true;
        }
        let (cost, factor) = (self.search.cost, self.search.factor);
        if !(factor * cost < 1e18 * (1.0 + cost)) {
            // No step, however short, gains anything: the end of the way.
            return self.end_start(tree);
        }
        let solved = self.damped_step(factor * 2.0 * cost);
        let now = std::mem::take(&mut self.now);
        let promised = if solved { self.cut_step(rows, nv, &now) } else { 0.0 };
        let mut next = f64::INFINITY;
        if promised > 0.0 {
            // Where J says that most of the error stays, its curvature is no guide to the minimum.
            if self.bends && promised > 0.5 * cost {
                self.bend(nv);
            }
            let mut tried = std::mem::take(&mut self.tried);
            tree.multibody().integrate(&now, &self.step, &mut tried);
            self.clamp(&mut tried);
            next = self.evaluate(tree, &tried);
            self.search.kinematics += 1;
            self.tried = tried;
        }
        self.now = now;
        if !(next < cost) {
            self.search.factor *= self.search.growth;
            self.search.growth *= 2.0;
            return;
        }
        std::mem::swap(&mut self.now, &mut self.tried);
        let met = self.is_met();
        let s = &mut self.search;
        let gain = (cost - next) / promised;
        s.factor = f64::max(factor * f64::max(0.1, 1.0 - (2.0 * gain - 1.0).powi(3)), 1e-12);
        (s.growth, s.cost, s.linear) = (2.0, next, false);
        s.iterations += 1;
        s.steps += 1;
        s.slow = if cost - next < SLOW * cost { s.slow + 1 } else { 0 };
        if met {
            if s.stage == Stage::Step {
                s.best_restart = s.restart;
            }
            s.stage = Stage::Met;
        } else if s.slow >= SLOW_STEPS && s.stage == Stage::Step {
            self.end_start(tree);
        }
    }

    /// Keeps the best; goes elsewhere, or to the end of the best way.
    fn end_start(&mut self, tree: &Tree) {
        let s = &mut self.search;
        if s.cost < s.least || s.least.is_infinite() {
            (s.least, s.best_restart) = (s.cost, s.restart);
            self.best.copy_from_slice(&self.now);
        }
        s.cost = f64::INFINITY;
        if s.stage == Stage::Last {
            s.stage = Stage::Nearest;
            let best = std::mem::take(&mut self.best);
            self.evaluate(tree, &best);
            self.best = best;
        } else if s.restart < self.effort.restarts {
            (s.restart, s.stage) = (s.restart + 1, Stage::Start);
        } else {
            s.restart = s.best_restart;
            self.now.copy_from_slice(&self.best);
            self.go_from_now(tree, Stage::Last);
        }
    }

    /// Another start: anywhere within limits, or half a turn, or π m, at most from the given one.
    fn elsewhere(&mut self, tree: &Tree, restart: usize) {
        let mut state = restart as u64;
        for i in 0..self.moves.len() {
            state = state.wrapping_add(0x9e37_79b9_7f4a_7c15);
            let mut z = (state ^ (state >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
            z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
            let u = ((z ^ (z >> 31)) >> 11) as f64 / (1u64 << 53) as f64;
            let Limits { lower, upper, .. } = self.limits[i];
            self.step[i] = match self.place[i] {
                _ if !self.moves[i] => 0.0,
                Some(at) if lower.is_finite() && upper.is_finite() => {
                    lower + (upper - lower) * u - self.start[at]
                }
                _ => PI * (2.0 * u - 1.0),
            };
        }
        tree.multibody().integrate(&self.start, &self.step, &mut self.now);
    }
}
