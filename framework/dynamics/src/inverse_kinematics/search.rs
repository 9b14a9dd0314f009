//! The search: Levenberg–Marquardt with limits, from one start after another, an evaluation of the
//! kinematics at a time, so that it may stop anywhere and go on later.
//!
//! ```text
//! start ─ step ─ step ─ … ─ met
//!           └ slow: the next start … the last one: the best of all, to its end ─ met, or nearest
//! ```
//! A start is left when its steps hardly gain: most of the minima that are not zero are told by that, and
//! another start costs less than to follow them. Where lengths of links prove that a target is out of reach (`beyond.rs`), a quarter of the starts is left.
//!
//! Closures are rows beside those of targets. Where not all can be met, closures come first: the least error of targets with d = 0 of closures
//! is sought from the best of all by multipliers, then by closures alone, whose step is the least that closes them.
//! ```text
//! minimise ½ |e|² + ½ |w d + s|²,   then s ← s + w d       until d is small       (method of multipliers: Hestenes, Powell 1969)
//! the last ─ not closed ─ round ─ round ─ … ─ closures alone ─ closed: nearest
//!                                                 └ open ─ closures alone from every start ─ closed: rounds once more ─ nearest
//!                                                                                         └ none: open, the least open of all
//! ```

use super::beyond::beyond;
use super::closure::{Asked, WEIGHT};
use super::{
    Effort, Found, Goal, InverseKinematics, InverseKinematicsError, Place, Residual, Target,
};
use super::{check_nodes, check_state};
use crate::tree::Tree;
use linkwork_multibody::Limits;
use std::f64::consts::PI;

/// A gain of less than this part of the cost is a slow step.
const SLOW: f64 = 0.25;
/// So many slow steps one after another end a start.
const SLOW_STEPS: usize = 2;
/// So many steps refused one after another end a start: damping has grown by 2^300 then.
const REFUSALS: usize = 24;
/// Where a target is proven to be out of reach, the nearest is sought from one start in so many: more of them hardly find a nearer one.
const BEYOND: usize = 4;
/// Rounds of multipliers, at most.
const ROUNDS: usize = 40;
/// Rounds end when closures are as near to closed, m or rad: what is left is closed alone, and moves the nearest configuration by as little.
const NEAR: f64 = 1e-7;

/// How far a search has come.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Progress {
    /// All targets are met.
    Met(Found),
    /// No start led there: this is the nearest of all, with all closures closed.
    Nearest(Found),
    /// The closures cannot be closed from any start: here they are least open.
    Open(Found),
    /// Not yet decided.
    Unfinished(Found),
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Stage {
    Start,
    Step,
    /// From the best of all starts to the end of its way.
    Last,
    /// The same with multipliers of closures.
    Round,
    /// Closures alone, from there.
    Close,
    /// Closures alone, from a start.
    CloseStart,
    CloseStep,
    Met,
    Nearest,
    Open,
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
    /// Steps refused one after another.
    refused: usize,
    /// Rounds of multipliers, and whether they are the second ones.
    rounds: usize,
    again: bool,
    factor: f64,
    growth: f64,
    cost: f64,
    least: f64,
    /// J is that of the present q.
    linear: bool,
    /// A target was proven to be out of reach.
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

    fn found(&self) -> Found {
        Found {
            iterations: self.iterations,
            restarts: self.best_restart,
            kinematics: self.kinematics,
        }
    }
}

impl Effort {
    /// Evaluations of the kinematics after which a search for these goals has ended at the latest, whatever the mechanism, the start and the goals'
    /// numbers: what a caller in real time counts on. Most searches take a hundredth of it. `closures`: there are some, of the mechanism or given.
    ///
    /// The way from one start has n steps at the most. The k-th refusal in a row raises the damping c by k bits, and a step that is taken lowers it by no more
    /// than log₂ 10; c begins at 10⁻² and the way ends where c ≥ 10¹⁸ (1 + 1/F). Since what is not met has F ≥ ½ (w tolerance)², r refusals in all:
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
        // What is too large for a number is too large for a bound.
        let refused = (bits / 3.0 + n + 1.0).ceil() as usize;
        let most = REFUSALS.saturating_mul(self.iterations.saturating_add(1));
        let way = |refused: usize| self.iterations.saturating_add(1).saturating_add(refused);
        let starts = self.restarts.saturating_add(1);
        let plain = way(refused.min(most)).saturating_mul(starts.saturating_add(1));
        // Rounds and ways of closures alone may have any cost.
        let more = starts.saturating_add(2 * ROUNDS + 2).saturating_mul(way(most));
        plain.saturating_add(if closures { more } else { 0 })
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
        self.begin_closed(tree, targets, &[], q)
    }

    /// As [`begin`](Self::begin), with more that is to be closed beside the mechanism's loops and couplings: where targets and closures cannot all be
    /// met, closures are, and the targets as nearly as that allows. Their weights do not count. [`reserve`](Self::reserve) counts them as targets.
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
        self.asked.extend(targets.iter().map(|t| Asked::of(tree, t)));
        self.asked.extend(self.own.loops.iter().cloned());
        self.asked.extend(closures.iter().map(|t| Asked::of(tree, t)));
        self.closed.clear();
        let count = closures.len() + self.own.count(tree);
        self.closed.resize(count, Residual::default());
        self.weigh_closures();
        let couplings = tree.multibody().couplings().len();
        self.rows = self.asked.iter().map(Asked::rows).sum::<usize>() + couplings;
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

    /// No mode moves.
    fn check_modes(&self, tree: &Tree) -> Result<(), InverseKinematicsError> {
        let mut bodies = tree.multibody().bodies().iter();
        match bodies.find(|b| self.moves[b.modes_v()].contains(&true)) {
            Some(b) => Err(InverseKinematicsError::Flexible { body: b.name().to_owned() }),
            None => Ok(()),
        }
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

    /// Brings the memory back to `now` after rates have used it.
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

    /// Begins to step from `now`.
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

    /// Ends the search where all is met, or a way of closures alone where they are; whether it did.
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
        if !(factor * cost < 1e18 * (1.0 + cost)) || self.search.refused >= REFUSALS {
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

    /// The end of a way: keeps the best; goes elsewhere, or to the end of the best way, or closes what is open.
    fn end_start(&mut self, tree: &Tree) {
        if !matches!(self.search.stage, Stage::Step | Stage::Last) {
            // The last step may have been refused.
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
                    // What is sought from here on is another least.
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

    /// Whether lengths prove that one of the targets is out of reach.
    fn is_beyond(&self, tree: &Tree) -> bool {
        let margin = self.effort.position_tolerance;
        let kept = |dof: usize, at: usize| (!self.moves[dof]).then(|| self.start[at]);
        self.targets.iter().any(|t| match (t.goal.position, t.goal.place, t.relative_to) {
            (Some(p), Place::Point, None) => beyond(tree, t.node, kept, &p, margin),
            _ => false,
        })
    }

    /// Keeps `now` where it is the best so far.
    fn keep_better(&mut self) {
        let s = &mut self.search;
        if s.cost < s.least || s.least == f64::INFINITY {
            (s.least, s.best_restart) = (s.cost, s.restart);
            self.best.copy_from_slice(&self.now);
        }
        s.cost = f64::INFINITY;
    }

    /// Errors and residuals of `now`.
    fn look_at_now(&mut self, tree: &Tree) {
        let now = std::mem::take(&mut self.now);
        self.evaluate(tree, &now);
        self.now = now;
    }

    /// Another round: multipliers of the closures' errors at `now`, where they were evaluated.
    fn multiply(&mut self, tree: &Tree) {
        let first: usize = self.asked[..self.targets.len()].iter().map(Asked::rows).sum();
        // The errors have what multipliers were before.
        self.shift[first..].copy_from_slice(&self.e[first..self.rows]);
        self.multiplied = true;
        self.go_from_now(tree, Stage::Round);
    }

    /// Closures alone, from `now`.
    fn close(&mut self, tree: &Tree) {
        (self.alone, self.multiplied) = (true, false);
        self.go_from_now(tree, Stage::Close);
    }

    /// The end, at `now`.
    fn end(&mut self, tree: &Tree, stage: Stage) {
        (self.alone, self.multiplied) = (false, false);
        self.best.copy_from_slice(&self.now);
        self.look_at_now(tree);
        self.search.stage = stage;
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
