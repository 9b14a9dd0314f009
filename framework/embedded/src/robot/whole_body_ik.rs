//! Inverse kinematics of the whole: several tips at once, each where it is to be in the world, in its base or in the hand of another, with everything
//! that carries them; what two hands hold stays held, and the mechanism's own loops and couplings stay closed.
//!
//! The same search as of one chain (`linkwork_dynamics::inverse_kinematics`), over all coordinates that are not kept. Closures come before goals:
//! where not all can be met, the nearest configuration is the nearest of those in which everything is closed.

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

/// Where the tip of a chain is to be.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TipGoal {
    /// The chain.
    pub part: Part,
    /// What is asked of its tip.
    pub goal: Goal,
    /// From where that is seen.
    pub frame: Frame,
}

impl TipGoal {
    /// In the world.
    #[must_use]
    pub fn new(part: Part, goal: Goal) -> Self {
        Self { part, goal, frame: Frame::World }
    }

    /// The same in another frame: the chain's base, or the tip of another chain, which may move, too.
    #[must_use]
    pub fn seen_from(mut self, frame: Frame) -> Self {
        self.frame = frame;
        self
    }
}

/// A search of the whole, with its memory. Answers depend on no search before.
#[derive(Debug)]
pub struct WholeBodyIk {
    model: Arc<RobotModel>,
    ik: InverseKinematics,
    /// Goals, and closures, for which there is room.
    room: [usize; 2],
    targets: Vec<Target>,
    closures: Vec<Target>,
    /// The objects that are held by two hands, in the order of the closures.
    held: Vec<usize>,
    /// For each degree of freedom: whether it may move.
    moves: Vec<bool>,
    q: Vec<f64>,
    best: Vec<f64>,
    scale: Vec<f64>,
    searching: bool,
}

impl Clone for WholeBodyIk {
    /// Of its own, with all its memory: no later call allocates.
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
    /// With room for so many goals at once, and for two hands on every object. Allocates: once, at set-up.
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

    /// Keeps degrees of freedom (places in β; [`RobotModel::dofs`] tells a chain's) where they are from now on. A search that was begun ends.
    ///
    /// # Errors
    /// [`RobotError::OutOfRange`] for a place that is none; then nothing is kept.
    pub fn keep(&mut self, dofs: &[usize]) -> Result<(), RobotError> {
        self.set_moves(dofs, false)
    }

    /// Lets degrees of freedom move from now on. A search that was begun ends.
    ///
    /// # Errors
    /// [`RobotError::OutOfRange`] for a place that is none; then nothing has changed.
    pub fn release(&mut self, dofs: &[usize]) -> Result<(), RobotError> {
        self.set_moves(dofs, true)
    }

    fn set_moves(&mut self, dofs: &[usize], moves: bool) -> Result<(), RobotError> {
        if let Some(dof) = dofs.iter().find(|d| **d >= self.moves.len()) {
            let (what, help) = ("degree of freedom", "give places in β, below nv");
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

    /// Moves `q` (nq; in: where to start, out: the solution, or the nearest configuration) until every tip meets its goal, within limits. The robot's
    /// own q does not change; what two of its hands hold is held in the answer, held at the start or not. Without goals it closes what is open.
    ///
    /// # Errors
    /// As [`begin`](Self::begin) and [`resume`](Self::resume).
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

    /// Evaluations of the kinematics after which a search for such goals has ended at the latest, whatever the start, the goals' numbers and what hands hold.
    /// Most searches take a hundredth of it.
    #[must_use]
    pub fn worst_case_steps(&self, goals: &[TipGoal], effort: &Effort) -> usize {
        let multibody = self.model.multibody();
        let own = multibody.loops().len() + multibody.couplings().len();
        let closures = own + self.room[1] > 0;
        effort.inner().worst_case_steps(goals.iter().map(|g| &g.goal), closures)
    }

    /// Prepares a search, for [`resume`](Self::resume). It knows what hands hold now.
    ///
    /// # Errors
    /// [`RobotError::ForeignHandle`], [`RobotError::NotAChain`], [`RobotError::Length`], [`RobotError::NotFinite`], [`RobotError::NoRoom`],
    /// [`RobotError::OutOfRange`] (weights, tolerances, a goal that asks for nothing, a tip seen from itself), [`RobotError::OutsideLimits`]. A search that was
    /// begun before is then as it was.
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

    /// Begins again with what was checked, at `self.q`.
    fn start(&mut self, effort: &Effort) {
        let ik = &mut self.ik;
        ik.effort = effort.inner();
        let begun = ik.begin_closed(&self.model.tree, &self.targets, &self.closures, &self.q);
        debug_assert!(begun.is_ok(), "everything was checked: {begun:?}");
        self.searching = true;
    }

    /// Goes on with the search for so many evaluations of the kinematics. The same steps are taken in whatever portions. Of the answer's residual each
    /// number is the greatest of all goals; [`residuals`](Self::residuals) has them apart.
    ///
    /// # Errors
    /// [`RobotError::Length`], [`RobotError::NoSearch`]; [`RobotError::DoesNotClose`] at the end of a search without a configuration in which all is closed:
    /// `q` is then where it is least open.
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

    /// How far each tip of the last search is from its goal; not defined while that is unfinished.
    #[must_use]
    pub fn residuals(&self) -> &[Residual] {
        self.ik.residuals()
    }

    /// Each closure of the last search and how far it is from closed; not defined while that is unfinished.
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

    /// As [`reach`](Self::reach), from several starts, each improved among the configurations that meet all goals with everything closed: near the middle
    /// of the limits of what may move, near the q that is given, and far from singular configurations of the goals' chains. `effort.restarts` does not count; `effort.kinematics`
    /// bounds all evaluations together. When no start leads there, `q` is the nearest of the last of them.
    ///
    /// # Errors
    /// As [`reach`](Self::reach), of the last start; [`RobotError::OutOfRange`] for weights that are negative or all zero.
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

    /// Improves `self.q`; c, and evaluations.
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
                // Positions do not count: the chain stands on its base.
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

/// A goal as the search takes it.
fn target(model: &RobotModel, g: &TipGoal) -> Result<Target, RobotError> {
    let node = model.tip(g.part)?;
    let relative_to = match g.frame {
        Frame::World => None,
        Frame::Base => model.bases[g.part.index()],
        Frame::Tip(other) if other == g.part => {
            let (what, value) = ("tip seen from itself", g.part.index() as f64);
            let help = "give another chain's, or a goal in the world or in the base";
            return Err(RobotError::OutOfRange { what, value, help });
        }
        Frame::Tip(other) => Some(model.tip(other)?),
    };
    Ok(Target { node, relative_to, goal: g.goal })
}
