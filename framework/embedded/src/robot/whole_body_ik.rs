//! Whole-body inverse kinematics: several tips reach their goals at once, each given in the world, in the chain's base or in the tip of another
//! chain. All bodies that carry the chains may move. Objects in two hands stay in both hands, and the mechanism's own loops and couplings stay
//! closed.
//!
//! The search is the same as for one chain (`linkwork_dynamics::inverse_kinematics`), over all coordinates that are not kept fixed. Closures have
//! priority over goals: if not all goals can be met, the result is the nearest configuration among those in which all closures are closed.

use super::inverse_kinematics::{Answer, Effort, Frame, Outcome, check};
use super::kinematics::gather;
use super::prefer::{agility, check_prefer, distances, scales};
use super::{Best, Hold, Prefer, Robot};
use crate::error::{Closure, RobotError};
use crate::model::RobotModel;
use crate::part::Part;
use linkwork_dynamics::inverse_kinematics::{self as search, Goal, Progress, Residual};
use linkwork_dynamics::{InverseKinematics, Target};
use linkwork_multibody::{ConstraintId, Coordinate};
use linkwork_spatial::{Motion, Pose, Vec3};
use std::sync::Arc;

/// Goal of the tip of a chain.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TipGoal {
    /// The chain.
    pub part: Part,
    /// The goal of its tip.
    pub goal: Goal,
    /// The frame in which the goal is given.
    pub frame: Frame,
}

impl TipGoal {
    /// Creates a goal that is given in the world.
    #[must_use]
    pub fn new(part: Part, goal: Goal) -> Self {
        Self { part, goal, frame: Frame::World }
    }

    /// Returns a copy that is given in another frame: the chain's base, or the tip of another chain, which may also move.
    #[must_use]
    pub fn seen_from(mut self, frame: Frame) -> Self {
        self.frame = frame;
        self
    }
}

/// Solver for whole-body inverse kinematics, with its memory. Results do not depend on earlier searches.
#[derive(Debug)]
pub struct WholeBodyIk {
    model: Arc<RobotModel>,
    ik: InverseKinematics,
    /// Maximum numbers of goals and of closures.
    room: [usize; 2],
    targets: Vec<Target>,
    closures: Vec<Target>,
    /// Objects that two hands hold, in the order of their closures.
    held: Vec<usize>,
    /// Whether each degree of freedom may move.
    moves: Vec<bool>,
    q: Vec<f64>,
    best: Vec<f64>,
    scale: Vec<f64>,
    searching: bool,
}

impl Clone for WholeBodyIk {
    /// Creates an independent copy that already has all of its memory, so that no later call allocates.
    fn clone(&self) -> Self {
        let mut new = Self {
            model: self.model.clone(),
            ik: self.ik.clone(),
            room: self.room,
            targets: Vec::with_capacity(self.room[0]),
            closures: Vec::with_capacity(self.room[1]),
            held: Vec::with_capacity(self.room[1]),
            moves: self.moves.clone(),
            q: self.q.clone(),
            best: self.best.clone(),
            scale: self.scale.clone(),
            searching: self.searching,
        };
        new.ik.reserve(self.room[0] + self.room[1]);
        new.targets.extend_from_slice(&self.targets);
        new.closures.extend_from_slice(&self.closures);
        new.held.extend_from_slice(&self.held);
        new
    }
}

impl WholeBodyIk {
    /// Creates a solver for up to `goals` goals at once and for two hands on every object. Allocates memory; later calls do not.
    #[must_use]
    pub fn new(robot: &Robot, goals: usize) -> Self {
        let model = robot.model.clone();
        let (nq, nv, objects) = (model.nq(), model.nv(), model.objects.len());
        let mut ik = InverseKinematics::new(&model.tree);
        ik.reserve(goals + objects);
        let mut moves = vec![true; nv];
        for (_, s) in model.multibody().subhinges() {
            moves[s.v.clone()].fill(s.subhinge.coordinate == Coordinate::Free);
        }
        Self {
            ik,
            room: [goals, objects],
            targets: Vec::with_capacity(goals),
            closures: Vec::with_capacity(objects),
            held: Vec::with_capacity(objects),
            moves,
            q: model.multibody().neutral_q(),
            best: vec![0.0; nq],
            scale: vec![0.0; nv],
            searching: false,
            model,
        }
    }

    /// Keeps degrees of freedom at their values in later searches. `dofs` are indices in β; [`RobotModel::dofs`] returns those of a chain. Ends a
    /// search in progress.
    ///
    /// # Errors
    /// [`RobotError::OutOfRange`] for an index that is not below nv; then no setting changes.
    pub fn keep(&mut self, dofs: &[usize]) -> Result<(), RobotError> {
        self.set_moves(dofs, false)
    }

    /// Lets degrees of freedom move in later searches. Ends a search in progress.
    ///
    /// # Errors
    /// [`RobotError::OutOfRange`] for an index that is not below nv; then no setting changes.
    pub fn release(&mut self, dofs: &[usize]) -> Result<(), RobotError> {
        self.set_moves(dofs, true)
    }

    fn set_moves(&mut self, dofs: &[usize], moves: bool) -> Result<(), RobotError> {
        if let Some(dof) = dofs.iter().find(|d| **d >= self.moves.len()) {
            let (what, help) = ("degree of freedom", "give indices in β below nv");
            return Err(RobotError::OutOfRange { what, value: *dof as f64, help });
        }
        for dof in dofs.iter().copied() {
            self.moves[dof] = moves;
            let one = dof..dof + 1;
            if moves { self.ik.release(one) } else { self.ik.keep(one) }
        }
        self.searching = false;
        Ok(())
    }

    /// Searches for a configuration within limits in which every tip meets its goal. `q` (nq) is the start of the search on input and the solution,
    /// or the nearest configuration, on output. The robot's own q does not change. Objects that two of the robot's hands hold are in both hands in
    /// the result, even if they are not at the start. Without goals the search only closes open loops.
    ///
    /// # Errors
    /// Like [`begin`](Self::begin) and [`resume`](Self::resume).
    pub fn solve(
        &mut self,
        robot: &Robot,
        goals: &[TipGoal],
        effort: &Effort,
        q: &mut [f64],
    ) -> Result<Answer, RobotError> {
        self.begin(robot, goals, effort, q)?;
        self.resume(effort.kinematics, q)
    }

    /// Returns an upper bound for the kinematics evaluations of a search for such goals, for every start, all values of the goals and everything that
    /// the hands may hold. Most searches take one hundredth of it.
    #[must_use]
    pub fn worst_case_steps(&self, goals: &[TipGoal], effort: &Effort) -> usize {
        let multibody = self.model.multibody();
        let own = multibody.loops().len() + multibody.couplings().len();
        let closures = own + self.room[1] > 0;
        effort.inner().worst_case_steps(goals.iter().map(|g| &g.goal), closures)
    }

    /// Prepares a search with what the hands hold now. [`resume`](Self::resume) performs it.
    ///
    /// # Errors
    /// [`RobotError::ForeignHandle`], [`RobotError::NotAChain`], [`RobotError::Length`], [`RobotError::NotFinite`], [`RobotError::NoRoom`],
    /// [`RobotError::OutOfRange`] (weights, tolerances, an empty goal, a tip relative to itself), [`RobotError::OutsideLimits`]. After an error the
    /// search in progress is unchanged.
    pub fn begin(
        &mut self,
        robot: &Robot,
        goals: &[TipGoal],
        effort: &Effort,
        q: &[f64],
    ) -> Result<(), RobotError> {
        if !Arc::ptr_eq(&self.model, &robot.model) {
            return Err(RobotError::ForeignHandle);
        }
        let model = &self.model;
        model.configurations("q", q, 1)?;
        let room = self.room[0];
        if goals.len() > room {
            return Err(RobotError::NoRoom { what: "goals", wanted: goals.len(), room });
        }
        check(&Goal::position(Vec3::zeros()), effort)?;
        for g in goals {
            check(&g.goal, effort)?;
            target(model, g)?;
        }
        for (dof, limit) in model.limits.iter().enumerate().filter(|(dof, _)| self.moves[*dof]) {
            let Some((at, l)) = limit else { continue };
            let (value, lower, upper) = (q[*at], l.lower, l.upper);
            if !(value >= lower && value <= upper) {
                return Err(RobotError::OutsideLimits { dof, value, lower, upper });
            }
        }
        self.targets.clear();
        for g in goals {
            self.targets.push(target(model, g)?);
        }
        self.closures.clear();
        self.held.clear();
        for (object, hold) in robot.holds.iter().enumerate() {
            let Some(Hold { hand: (l, X_LO), second: Some((r, X_RO)) }) = hold else { continue };
            let grasp = Goal::pose(*X_LO * X_RO.inverse());
            self.closures.push(Target::new(model.tip(*r)?, grasp).relative_to(model.tip(*l)?));
            self.held.push(object);
        }
        self.q.copy_from_slice(q);
        self.start(effort);
        Ok(())
    }

    /// Starts a search from `self.q` with inputs that are already checked.
    fn start(&mut self, effort: &Effort) {
        let ik = &mut self.ik;
        ik.effort = effort.inner();
        let begun = ik.begin_closed(&self.model.tree, &self.targets, &self.closures, &self.q);
        debug_assert!(begun.is_ok(), "everything was checked: {begun:?}");
        self.searching = true;
    }

    /// Continues the search for up to `kinematics` evaluations of the kinematics. The result does not depend on how the evaluations are divided into
    /// calls. Each number of the result's residual is the largest of all goals; [`residuals`](Self::residuals) returns those of each goal.
    ///
    /// # Errors
    /// [`RobotError::Length`]; [`RobotError::NoSearch`]; [`RobotError::DoesNotClose`] at the end of a search without a configuration in which
    /// everything is closed. `q` is then the configuration with the smallest closure error.
    pub fn resume(&mut self, kinematics: usize, q: &mut [f64]) -> Result<Answer, RobotError> {
        if q.len() != self.q.len() {
            let (got, wanted) = (q.len(), self.q.len());
            return Err(RobotError::Length { what: "q", got, wanted });
        }
        if !self.searching {
            return Err(RobotError::NoSearch { part: self.targets.len() });
        }
        let progress = self.ik.advance(&self.model.tree, kinematics, &mut self.q);
        q.copy_from_slice(&self.q);
        let (outcome, found) = match progress {
            Progress::Met(found) => (Outcome::Met, found),
            Progress::Nearest(found) => (Outcome::Nearest, found),
            Progress::Unfinished(found) => (Outcome::Unfinished, found),
            Progress::Open(_) => return Err(self.does_not_close()),
        };
        let residual = self.residuals().iter().fold(Residual::default(), |a, r| Residual {
            position: a.position.max(r.position),
            orientation: a.orientation.max(r.orientation),
        });
        let (kinematics, restart) = (found.kinematics, found.restarts);
        Ok(Answer { outcome, residual, kinematics, restart })
    }

    /// Returns the residual of each goal of the last search. The values are undefined while the search is unfinished.
    #[must_use]
    pub fn residuals(&self) -> &[Residual] {
        self.ik.residuals()
    }

    /// Returns each closure of the last search and its residual. The values are undefined while the search is unfinished.
    pub fn closures(&self) -> impl Iterator<Item = (Closure, Residual)> + '_ {
        self.ik.closures().map(|(c, r)| (self.closure(c), r))
    }

    fn closure(&self, c: search::Closure) -> Closure {
        match c {
            search::Closure::Given(i) => Closure::Hands { object: self.held[i] },
            search::Closure::Constraint(ConstraintId::Loop(i)) => {
                Closure::Loop { index: i as usize }
            }
            search::Closure::Constraint(ConstraintId::Coupling(i)) => {
                Closure::Coupling { index: i as usize }
            }
        }
    }

    fn does_not_close(&self) -> RobotError {
        let worst = self.ik.open().map(|(c, r)| (self.closure(c), r));
        debug_assert!(worst.is_some(), "the search says that one is open");
        let (closure, r) = worst.unwrap_or((Closure::Loop { index: 0 }, Residual::default()));
        let Residual { position, orientation } = r;
        RobotError::DoesNotClose { closure, position, orientation }
    }

    /// Like [`solve`](Self::solve), but starts from several configurations and improves each solution among the configurations that meet all goals
    /// with everything closed: near the middle of the limits, near the given q, and far from singular configurations of the goals' chains.
    /// `effort.restarts` has no effect. `effort.kinematics` bounds the sum of all evaluations. If no start leads to a solution, `q` is the nearest
    /// configuration of the last start.
    ///
    /// # Errors
    /// Like [`solve`](Self::solve), for the last start; [`RobotError::OutOfRange`] for weights that are negative or all zero.
    pub fn best(
        &mut self,
        robot: &mut Robot,
        goals: &[TipGoal],
        prefer: &Prefer,
        effort: &Effort,
        q: &mut [f64],
    ) -> Result<Best, RobotError> {
        check_prefer(prefer)?;
        self.begin(robot, goals, effort, q)?;
        let mut best =
            Best { outcome: Outcome::Nearest, cost: f64::INFINITY, solutions: 0, kinematics: 0 };
        let mut open = None;
        for start in 0..prefer.starts.max(1) {
            let left = effort.kinematics - best.kinematics.min(effort.kinematics);
            if left == 0 {
                break;
            }
            self.q.copy_from_slice(q);
            self.start(&Effort { restarts: start, ..*effort });
            self.ik.skip_to(start);
            let progress = self.ik.advance(&self.model.tree, left, &mut self.q);
            open = None;
            match progress {
                Progress::Met(found) => {
                    best.kinematics += found.kinematics;
                    let left = effort.kinematics - best.kinematics.min(effort.kinematics);
                    let (cost, used) =
                        self.improve(robot, goals, (prefer, q), left.min(prefer.steps))?;
                    best.kinematics += used;
                    best.solutions += 1;
                    if cost < best.cost || best.solutions == 1 {
                        (best.cost, best.outcome) = (cost, Outcome::Met);
                        self.best.copy_from_slice(&self.q);
                    }
                }
                Progress::Nearest(found) | Progress::Open(found) | Progress::Unfinished(found) => {
                    best.kinematics += found.kinematics;
                    if best.solutions == 0 {
                        self.best.copy_from_slice(&self.q);
                    }
                    if let Progress::Open(_) = progress {
                        open = Some(self.does_not_close());
                    }
                }
            }
        }
        self.searching = false;
        if best.solutions > 0 || best.kinematics > 0 {
            q.copy_from_slice(&self.best);
        }
        match open {
            Some(error) if best.solutions == 0 => Err(error),
            _ => Ok(best),
        }
    }

    /// Improves `self.q`. Returns the cost and the number of evaluations.
    fn improve(
        &mut self,
        robot: &mut Robot,
        goals: &[TipGoal],
        (prefer, given): (&Prefer, &[f64]),
        steps: usize,
    ) -> Result<(f64, usize), RobotError> {
        let model = &self.model;
        for g in goals {
            if let Some(memory) = robot.chains[g.part.index()].as_mut() {
                // The position of the base does not matter here, so the chain is evaluated on a base at the origin.
                memory.ws.set_base(&Pose::identity(), &Motion::zero(), &Motion::zero());
                memory.fresh = false;
            }
        }
        scales(&model.limits, prefer, &mut self.scale);
        let mut objective = |q: &[f64], gradient: &mut [f64]| {
            gradient.fill(0.0);
            let mut cost = 0.0;
            for (k, g) in goals.iter().enumerate() {
                let twice = goals[..k].iter().any(|other| other.part == g.part);
                let memory = robot.chains[g.part.index()].as_mut();
                let (Ok(chain), Some(memory)) = (model.chain(g.part), memory) else { continue };
                if prefer.manipulable == 0.0 || twice {
                    continue;
                }
                let super::ChainMemory { ws, J, best, scale, .. } = memory;
                gather(&chain.q, q, best);
                cost += agility(chain, (ws, J), prefer, best, scale);
                for (dof, x) in chain.v.iter().zip(&*scale) {
                    gradient[*dof] += x;
                }
            }
            cost + distances(&model.limits, (prefer, &|at| given[at]), q, gradient)
        };
        let (tree, scale) = (&model.tree, &self.scale);
        let improved = self.ik.improve(tree, &mut objective, scale, steps, &mut self.q);
        Ok((improved.cost, improved.kinematics))
    }
}

/// Converts a goal to a target of the search.
fn target(model: &RobotModel, g: &TipGoal) -> Result<Target, RobotError> {
    let node = model.tip(g.part)?;
    let relative_to = match g.frame {
        Frame::World => None,
        Frame::Base => model.bases[g.part.index()],
        Frame::Tip(other) if other == g.part => {
            let (what, value) = ("tip relative to itself", g.part.index() as f64);
            let help = "give the tip of another chain, or a goal in the world or in the base";
            return Err(RobotError::OutOfRange { what, value, help });
        }
        Frame::Tip(other) => Some(model.tip(other)?),
    };
    Ok(Target { node, relative_to, goal: g.goal })
}
