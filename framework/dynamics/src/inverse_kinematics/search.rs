//! The search: Levenberg–Marquardt with limits, from one start after another, one evaluation of the kinematics at a time, so that it can be
//! interrupted and continued at any point.
//!
//! ```text
//! start ─ step ─ step ─ … ─ met
//!           └ slow: the next start … the last one: the best start, to convergence ─ met, or nearest
//! ```
//! A start is abandoned when its steps hardly reduce the cost: this detects most nonzero minima, and another start costs less than following them. If
//! link lengths prove that a target is out of reach (`beyond.rs`), only a quarter of the starts is used.
//!
//! Closures are rows in addition to those of targets. If not all can be met, closures have priority: starting from the best result, the smallest
//! error of targets with d = 0 of closures is computed with multipliers, and then with closures alone, whose step is the smallest that closes them.
//! ```text
//! minimise ½ |e|² + ½ |w d + s|²,   then s ← s + w d       until d is small       (method of multipliers: Hestenes, Powell 1969)
//! the last ─ not closed ─ round ─ round ─ … ─ closures alone ─ closed: nearest
//!                                                 └ open ─ closures alone from every start ─ closed: rounds once more ─ nearest
//!                                                                                         └ none: open, the smallest closure error of all
//! ```

use super::beyond::beyond;
use super::closure::{FrameGoal, WEIGHT};
use super::{
    Effort, Goal, InverseKinematics, InverseKinematicsError, Place, Residual, SearchStatistics,
    Target,
};
use super::{check_nodes, check_state};
use crate::tree::Tree;
use linkwork_multibody::Limits;
use std::f64::consts::PI;

/// A decrease of less than this fraction of the cost is a slow step.
const SLOW: f64 = 0.25;
/// Number of consecutive slow steps that ends a start.
const SLOW_STEPS: usize = 2;
/// Number of consecutive rejected steps that ends a start: damping has then grown by 2^300.
const REFUSALS: usize = 24;
/// If a target is proven to be out of reach, one start in this number is used, because more starts hardly find a nearer configuration.
const BEYOND: usize = 4;
/// Maximum number of rounds of multipliers.
const ROUNDS: usize = 40;
/// Closure error at which rounds end, m or rad: the remaining error is closed alone and hardly moves the nearest configuration.
const NEAR: f64 = 1e-7;

/// State of a search.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Progress {
    /// All targets are met.
    Met(SearchStatistics),
    /// No start led to the targets: this is the nearest configuration of all, with all closures closed.
    Nearest(SearchStatistics),
    /// The closures cannot be closed from any start: this is the smallest closure error.
    Open(SearchStatistics),
    /// The search is not finished.
    Unfinished(SearchStatistics),
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Stage {
    Start,
    Step,
    /// From the best of all starts to convergence.
    Last,
    /// Like `Last`, with multipliers of closures.
    Round,
    /// Closures alone, from that result.
    Close,
    /// Closures alone, from a start.
    CloseStart,
    CloseStep,
    Met,
    Nearest,
    Open,
}

/// Progress of a search.
#[derive(Clone, Copy, Debug)]
pub(super) struct Search {
    stage: Stage,
    restart: usize,
    best_restart: usize,
    iterations: usize,
    kinematics: usize,
    /// Steps from this start, and consecutive slow ones.
    steps: usize,
    slow: usize,
    /// Consecutive rejected steps.
    refused: usize,
    /// Rounds of multipliers, and whether they are repeated.
    rounds: usize,
    again: bool,
    factor: f64,
    growth: f64,
    cost: f64,
    least: f64,
    /// J belongs to the present q.
    linear: bool,
    /// A target is proven to be out of reach.
    beyond: bool,
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
        refused: 0,
        rounds: 0,
        again: false,
        factor: 1.0,
        growth: 2.0,
        cost: f64::INFINITY,
        least: f64::INFINITY,
        linear: false,
        beyond: false,
    };

    fn found(&self) -> SearchStatistics {
        SearchStatistics {
            iterations: self.iterations,
            restarts: self.best_restart,
            kinematics: self.kinematics,
        }
    }
}

impl Effort {
    /// Returns an upper bound for the kinematics evaluations of a search for these goals, for every mechanism, start and all values of the goals.
    /// Real-time callers can rely on it. Most searches take one hundredth of it. `closures` is true if the mechanism or the caller has any.
    ///
    /// One start has at most n steps. The k-th consecutive rejection raises the damping c by k bits, and an accepted step lowers it by at most
    /// log₂ 10. c begins at 10⁻², and the start ends where c ≥ 10¹⁸ (1 + 1/F). Because F ≥ ½ (w tolerance)² while targets are not met, with r rejections
    /// in total:
    /// ```text
    /// Σ r_i (r_i + 1)/2 ≤ n log₂ 10 + log₂(10²⁰ (1 + 1/F)) + 24,      r (r + 1)/2 ≥ 3 r − 3,      r_i ≤ 24
    /// ```
    #[must_use]
    pub fn worst_case_steps<'a>(
        &self,
        goals: impl IntoIterator<Item = &'a Goal>,
        closures: bool,
    ) -> usize {
        let mut least = f64::INFINITY;
        for g in goals {
            if g.position.is_some() {
                least = least.min(g.weights[0] * self.position_tolerance);
            }
            if g.turns() {
                least = least.min(g.weights[1] * self.orientation_tolerance);
            }
        }
        let finest = self.position_tolerance.min(self.orientation_tolerance);
        let least = if least.is_finite() { least } else { WEIGHT * finest };
        let n = self.iterations as f64;
        let bits = n * 10.0_f64.log2() + (1e20 * (1.0 + 2.0 / (least * least))).log2() + 24.0;
        // A value that is too large for an integer saturates.
        let refused = (bits / 3.0 + n + 1.0).ceil() as usize;
        let most = REFUSALS.saturating_mul(self.iterations.saturating_add(1));
        let way = |refused: usize| self.iterations.saturating_add(1).saturating_add(refused);
        let starts = self.restarts.saturating_add(1);
        let plain = way(refused.min(most)).saturating_mul(starts.saturating_add(1));
        // With closures there are additional rounds and starts for the closures alone, and each may
        // take the maximum number of steps.
        let more = starts.saturating_add(2 * ROUNDS + 2).saturating_mul(way(most));
        plain.saturating_add(if closures { more } else { 0 })
    }
}

impl InverseKinematics {
    /// Prepares a search from `q` (nq) for [`advance`](Self::advance), which does all the work. Allocates for errors, and for more targets than
    /// before ([`reserve`](Self::reserve)).
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
        self.begin_closed(tree, targets, &[], q)
    }

    /// Like [`begin`](Self::begin), with additional closures next to the mechanism's loops and couplings. If targets and closures cannot all be met,
    /// closures are, and the targets as closely as possible. The weights of closures are ignored. [`reserve`](Self::reserve) counts them as targets.
    ///
    /// # Errors
    /// [`InverseKinematicsError::BadNumber`] and [`InverseKinematicsError::Empty`].
    #[track_caller]
    pub fn begin_closed(
        &mut self,
        tree: &Tree,
        targets: &[Target],
        closures: &[Target],
        q: &[f64],
    ) -> Result<(), InverseKinematicsError> {
        check_state(self, tree, q);
        let all = || targets.iter().chain(closures);
        check_nodes(tree, all().flat_map(|t| [Some(t.node), t.relative_to]).flatten());
        super::solve::check_targets(tree, targets, "target")?;
        super::solve::check_targets(tree, closures, "closure")?;
        super::solve::check_start(q)?;
        self.check_modes(tree)?;
        self.targets.clear();
        self.targets.extend_from_slice(targets);
        self.asked.clear();
        self.asked.extend(targets.iter().map(|t| FrameGoal::of(tree, t)));
        self.asked.extend(self.own.loops.iter().cloned());
        self.asked.extend(closures.iter().map(|t| FrameGoal::of(tree, t)));
        self.closed.clear();
        let count = closures.len() + self.own.count(tree);
        self.closed.resize(count, Residual::default());
        self.weigh_closures();
        let couplings = tree.multibody().couplings().len();
        self.rows = self.asked.iter().map(FrameGoal::rows).sum::<usize>() + couplings;
        self.room_again();
        self.shift.clear();
        self.shift.resize(self.rows, 0.0);
        (self.multiplied, self.alone) = (false, false);
        self.start.copy_from_slice(q);
        self.best.copy_from_slice(q);
        self.search = Search { stage: Stage::Start, ..Search::NONE };
        self.disturbed = false;
        let known = |t: &Target| {
            t.relative_to.is_none() && t.goal.pointing.is_none() && t.goal.place == Place::Point
        };
        let mut moves = self.moves.iter().zip(&self.place);
        self.bends = self.closed.is_empty()
            && targets.iter().all(known)
            && moves.all(|(moves, at)| !moves || at.is_some());
        Ok(())
    }

    /// Checks that no mode may move.
    fn check_modes(&self, tree: &Tree) -> Result<(), InverseKinematicsError> {
        let mut bodies = tree.multibody().bodies().iter();
        match bodies.find(|b| self.moves[b.modes_v()].contains(&true)) {
            Some(b) => Err(InverseKinematicsError::Flexible { body: b.name().to_owned() }),
            None => Ok(()),
        }
    }

    /// Selects another of the fixed starts: 0 is the given one. Call [`begin`](Self::begin) first.
    pub fn skip_to(&mut self, restart: usize) {
        self.search.restart = restart;
    }

    /// Continues a search for up to `kinematics` evaluations of the kinematics. `q` (nq) receives the solution, or the nearest configuration so far.
    /// The result does not depend on how the evaluations are divided into calls. Does not allocate.
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
                Stage::Open => {
                    q.copy_from_slice(&self.best);
                    return Progress::Open(self.search.found());
                }
                _ if self.search.kinematics >= until => {
                    let nearer = self.search.cost < self.search.least;
                    q.copy_from_slice(if nearer { &self.now } else { &self.best });
                    return Progress::Unfinished(self.search.found());
                }
                Stage::Start => self.begin_start(tree, Stage::Step),
                Stage::CloseStart => self.begin_start(tree, Stage::CloseStep),
                _ => self.step(tree),
            }
        }
    }

    /// Restores the memory at `now` after rates have overwritten it.
    fn settle(&mut self, tree: &Tree) {
        if std::mem::take(&mut self.disturbed) {
            self.room_again();
            self.look_at_now(tree);
            self.search.linear = false;
        }
    }

    fn begin_start(&mut self, tree: &Tree, stage: Stage) {
        self.now.copy_from_slice(&self.start);
        if self.search.restart > 0 {
            self.elsewhere(tree, self.search.restart);
        }
        self.go_from_now(tree, stage);
    }

    /// Starts stepping from `now`.
    fn go_from_now(&mut self, tree: &Tree, stage: Stage) {
        let mut now = std::mem::take(&mut self.now);
        self.clamp(&mut now);
        let cost = self.evaluate(tree, &now);
        self.now = now;
        let s = &mut self.search;
        (s.steps, s.slow, s.refused, s.factor, s.growth) = (0, 0, 0, 1e-2, 2.0);
        (s.cost, s.linear, s.stage) = (cost, false, stage);
        s.kinematics += 1;
        self.end_if_met(tree);
    }

    /// Ends the search if all targets are met, or the stage of closures alone if these are closed; returns whether it did.
    fn end_if_met(&mut self, tree: &Tree) -> bool {
        let met = if self.alone { self.is_closed() } else { self.is_met() };
        if met && self.alone {
            self.end_start(tree);
        } else if met {
            let s = &mut self.search;
            if s.stage == Stage::Step {
                s.best_restart = s.restart;
            }
            s.stage = Stage::Met;
            self.multiplied = false;
        }
        met
    }

    /// Performs at most one evaluation.
    fn step(&mut self, tree: &Tree) {
        let (rows, nv) = (self.rows, tree.nv());
        if !self.search.linear {
            if self.search.steps >= self.effort.iterations {
                return self.end_start(tree);
            }
            let now = std::mem::take(&mut self.now);
            self.linearise(tree, &now);
            self.now = now;
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
        if !(factor * cost < 1e18 * (1.0 + cost)) || self.search.refused >= REFUSALS {
            // No step, however short, reduces the cost: the start has converged.
            return self.end_start(tree);
        }
        let solved = self.damped_step(factor * 2.0 * cost);
        let now = std::mem::take(&mut self.now);
        let promised = if solved { self.cut_step(rows, nv, &now) } else { 0.0 };
        let mut next = f64::INFINITY;
        if promised > 0.0 {
            // If J predicts that most of the error remains, its curvature does not lead towards the minimum.
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
            self.search.refused += 1;
            return;
        }
        std::mem::swap(&mut self.now, &mut self.tried);
        let s = &mut self.search;
        let gain = (cost - next) / promised;
        s.factor = f64::max(factor * f64::max(0.1, 1.0 - (2.0 * gain - 1.0).powi(3)), 1e-12);
        (s.growth, s.cost, s.linear, s.refused) = (2.0, next, false, 0);
        s.iterations += 1;
        s.steps += 1;
        s.slow = if cost - next < SLOW * cost { s.slow + 1 } else { 0 };
        let slow = s.slow >= SLOW_STEPS && s.stage == Stage::Step;
        if !self.end_if_met(tree) && slow {
            self.end_start(tree);
        }
    }

    /// Ends a start: keeps the best result, then continues with another start, with the best result, or with closing what is open.
    fn end_start(&mut self, tree: &Tree) {
        if !matches!(self.search.stage, Stage::Step | Stage::Last) {
            // The last step may have been rejected, so evaluate the errors at the present
            // configuration.
            self.look_at_now(tree);
        }
        match self.search.stage {
            Stage::Step => {
                self.keep_better();
                let mut restarts = self.effort.restarts;
                if self.search.restart == 0 && restarts > 0 {
                    self.search.beyond = self.is_beyond(tree);
                }
                let s = &mut self.search;
                if s.beyond {
                    restarts = restarts.div_ceil(BEYOND);
                }
                if s.restart < restarts {
                    (s.restart, s.stage) = (s.restart + 1, Stage::Start);
                } else {
                    s.restart = s.best_restart;
                    self.now.copy_from_slice(&self.best);
                    self.go_from_now(tree, Stage::Last);
                }
            }
            Stage::Last => {
                self.keep_better();
                self.now.copy_from_slice(&self.best);
                self.look_at_now(tree);
                if self.is_closed() {
                    self.search.stage = Stage::Nearest;
                } else {
                    // The rounds search for another minimum, so forget the least cost so far.
                    self.search.least = f64::NEG_INFINITY;
                    self.multiply(tree);
                }
            }
            Stage::Round if !self.is_closed() => {
                self.search.rounds += 1;
                let near = |r: &Residual| r.position <= NEAR && r.orientation <= NEAR;
                let done = self.search.rounds >= ROUNDS || self.closed.iter().all(near);
                if done { self.close(tree) } else { self.multiply(tree) }
            }
            Stage::Round => self.end(tree, Stage::Nearest),
            Stage::Close if self.is_closed() => self.end(tree, Stage::Nearest),
            Stage::Close if self.search.again => self.end(tree, Stage::Open),
            Stage::Close => {
                self.search.least = f64::INFINITY;
                self.keep_better();
                let s = &mut self.search;
                (s.restart, s.stage, s.again) = (0, Stage::CloseStart, true);
            }
            Stage::CloseStep if self.is_closed() => {
                let s = &mut self.search;
                (s.best_restart, s.rounds, s.least) = (s.restart, 0, f64::NEG_INFINITY);
                self.best.copy_from_slice(&self.now);
                self.alone = false;
                self.shift.fill(0.0);
                self.go_from_now(tree, Stage::Round);
            }
            Stage::CloseStep => {
                self.keep_better();
                let s = &mut self.search;
                if s.restart < self.effort.restarts {
                    (s.restart, s.stage) = (s.restart + 1, Stage::CloseStart);
                } else {
                    self.now.copy_from_slice(&self.best);
                    self.end(tree, Stage::Open);
                }
            }
            Stage::Start | Stage::CloseStart | Stage::Met | Stage::Nearest | Stage::Open => {}
        }
    }

    /// Returns true if link lengths prove that one of the targets is out of reach.
    fn is_beyond(&self, tree: &Tree) -> bool {
        let margin = self.effort.position_tolerance;
        let kept = |dof: usize, at: usize| (!self.moves[dof]).then(|| self.start[at]);
        self.targets.iter().any(|t| match (t.goal.position, t.goal.place, t.relative_to) {
            (Some(p), Place::Point, None) => beyond(tree, t.node, kept, &p, margin),
            _ => false,
        })
    }

    /// Keeps `now` if it is the best so far.
    fn keep_better(&mut self) {
        let s = &mut self.search;
        if s.cost < s.least || s.least == f64::INFINITY {
            (s.least, s.best_restart) = (s.cost, s.restart);
            self.best.copy_from_slice(&self.now);
        }
        s.cost = f64::INFINITY;
    }

    /// Computes errors and residuals of `now`.
    fn look_at_now(&mut self, tree: &Tree) {
        let now = std::mem::take(&mut self.now);
        self.evaluate(tree, &now);
        self.now = now;
    }

    /// Starts another round: updates the multipliers from the closures' errors at `now`, where they were evaluated.
    fn multiply(&mut self, tree: &Tree) {
        let first: usize = self.asked[..self.targets.len()].iter().map(FrameGoal::rows).sum();
        // The errors include the previous multipliers.
        self.shift[first..].copy_from_slice(&self.e[first..self.rows]);
        self.multiplied = true;
        self.go_from_now(tree, Stage::Round);
    }

    /// Closes the closures alone, from `now`.
    fn close(&mut self, tree: &Tree) {
        (self.alone, self.multiplied) = (true, false);
        self.go_from_now(tree, Stage::Close);
    }

    /// Ends the search at `now`.
    fn end(&mut self, tree: &Tree, stage: Stage) {
        (self.alone, self.multiplied) = (false, false);
        self.best.copy_from_slice(&self.now);
        self.look_at_now(tree);
        self.search.stage = stage;
    }

    /// Computes another start: anywhere within limits, or within half a revolution, or π m, of the given one.
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
