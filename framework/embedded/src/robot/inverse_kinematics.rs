//! Inverse kinematics of a chain: where its joints have to be so that its tip is where it is to be.
//!
//! The chain alone moves; what carries it stays as the q given says. Work is counted in evaluations of the chain's
//! kinematics, so that a bound holds on every machine, and a search may be cut anywhere and gone on with.

use super::kinematics::{base, gather};
use super::{ChainMemory, Robot, numbers};
use crate::closed_form::ClosedForm;
use crate::error::RobotError;
use crate::part::{Chain, Part};
use linkwork_dynamics::inverse_kinematics::{
    self as search, Goal, Place, Progress, Residual, Towards,
};
use linkwork_dynamics::{InverseKinematics, RateTarget, Target, poses};
use linkwork_spatial::{Motion, Pose};

/// In which frame a [`Goal`] is given.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Frame {
    /// The world.
    #[default]
    World,
    /// The frame of the chain's base, wherever what carries it is.
    Base,
    /// The tip of another chain. [`Robot::inverse_kinematics`] leaves that where it is; [`WholeBodyIk`](super::WholeBodyIk) moves both.
    Tip(Part),
}

/// When inverse kinematics is content, and how long it tries.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Effort {
    /// Greatest error of position, m, and of orientation, rad.
    pub tolerances: [f64; 2],
    /// Steps from one start.
    pub steps: usize,
    /// Starts elsewhere, the same ones each time; a quarter of them for the nearest to a position that is out of reach by the lengths of links.
    pub restarts: usize,
    /// Evaluations of the kinematics in one call, at most.
    pub kinematics: usize,
}

impl Default for Effort {
    /// 1e-9 m and rad, 100 steps from each of 65 starts, no other bound.
    fn default() -> Self {
        Self { tolerances: [1e-9; 2], steps: 100, restarts: 64, kinematics: usize::MAX }
    }
}

impl Effort {
    /// The default with a bound on evaluations of the kinematics.
    #[must_use]
    pub fn kinematics(kinematics: usize) -> Self {
        Self { kinematics, ..Self::default() }
    }

    /// The default from the given start alone.
    #[must_use]
    pub fn one_start() -> Self {
        Self { restarts: 0, ..Self::default() }
    }
}

impl Effort {
    /// What the floor below takes.
    pub(super) fn inner(&self) -> search::Effort {
        search::Effort {
            position_tolerance: self.tolerances[0],
            orientation_tolerance: self.tolerances[1],
            iterations: self.steps,
            restarts: self.restarts,
        }
    }

    /// Evaluations of the kinematics after which [`Robot::inverse_kinematics`] has ended at the latest, met or with the nearest, whatever the chain, the start and the goal's
    /// numbers; a call ends sooner where `kinematics` bounds it. Most searches take a hundredth of it.
    /// [`WholeBodyIk::worst_case_steps`](super::WholeBodyIk::worst_case_steps) is that of the whole.
    #[must_use]
    pub fn worst_case_steps(&self, goal: &Goal) -> usize {
        self.inner().worst_case_steps([goal], false)
    }
}

/// How a search ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Outcome {
    /// The goal is met within the tolerances.
    Met,
    /// No start led there: this is the nearest of all. A minimum of another basin may be nearer.
    Nearest,
    /// The effort was used up; [`Robot::resume_inverse_kinematics`] goes on.
    Unfinished,
}

/// What inverse kinematics answers beside q.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Answer {
    /// How it ended.
    pub outcome: Outcome,
    /// How far the tip is from the goal; not defined when unfinished.
    pub residual: Residual,
    /// Evaluations of the kinematics since the search began.
    pub kinematics: usize,
    /// Which start led there; 0 is the given one.
    pub restart: usize,
}

pub(super) fn memory(chain: &Chain) -> InverseKinematics {
    let mut ik = InverseKinematics::new(&chain.tree);
    ik.reserve(1);
    ik
}

impl Robot {
    /// Moves the chain's numbers in `q` (nq of the whole; in: where to start, out: the solution, or the nearest
    /// configuration) until its tip meets the goal (given in `frame`), within limits. The robot's own q does not change. Of an object in two
    /// hands it moves this one alone: [`WholeBodyIk`](crate::WholeBodyIk) moves both, and tells how far apart they are.
    ///
    /// # Errors
    /// [`RobotError::ForeignHandle`], [`RobotError::NotAChain`], [`RobotError::OpensClosure`], [`RobotError::Length`], [`RobotError::NotFinite`],
    /// [`RobotError::OutOfRange`] (weights, tolerances, a goal that asks for nothing), [`RobotError::OutsideLimits`]; then q is left alone. *Not reached* is an
    /// answer, not an error.
    pub fn inverse_kinematics(
        &mut self,
        part: Part,
        goal: &Goal,
        frame: Frame,
        effort: &Effort,
        q: &mut [f64],
    ) -> Result<Answer, RobotError> {
        self.begin_inverse_kinematics(part, goal, frame, effort, q)?;
        self.resume_inverse_kinematics(part, effort.kinematics, q)
    }

    /// Checks, and prepares the search.
    pub(super) fn begin_inverse_kinematics(
        &mut self,
        part: Part,
        goal: &Goal,
        frame: Frame,
        effort: &Effort,
        q: &[f64],
    ) -> Result<(), RobotError> {
        let model = &self.model;
        let chain = model.chain(part)?;
        model.opens(chain, "a search of one chain")?;
        model.configurations("q", q, 1)?;
        check(goal, effort)?;
        chain.within_limits(q)?;
        let other = match frame {
            Frame::Tip(other) => {
                let tip = model.chain(other)?.tip_body;
                let moving = &model.bodies(part)?[..1];
                if moving.iter().any(|b| model.multibody().on_path(*b, tip)) {
                    let (what, value) = ("tip that moves with the chain", other.index() as f64);
                    let help = "give a goal in the world or in the base, or use `WholeBodyIk`";
                    return Err(RobotError::OutOfRange { what, value, help });
                }
                self.fresh = false;
                poses(&self.tree, &mut self.ws, q);
                self.ws.node_pose(&self.tree, model.tip(other)?)
            }
            Frame::World | Frame::Base => Pose::identity(),
        };
        let Some(memory) = self.chains[part.index()].as_mut() else {
            return Err(RobotError::NotAChain { part: part.index() });
        };
        let goal = match frame {
            Frame::World => goal.moved(&base(chain, memory, q).inverse()),
            Frame::Base => *goal,
            Frame::Tip(_) => goal.moved(&(base(chain, memory, q).inverse() * other)),
        };
        let target = Target::new(chain.tip, goal);
        gather(&chain.q, q, &mut memory.q);
        memory.fresh = false;
        let ik = &mut memory.ik;
        ik.effort = effort.inner();
        let begun = ik.begin(&chain.tree, &[target], &memory.q);
        debug_assert!(begun.is_ok(), "everything was checked: {begun:?}");
        memory.searching = true;
        Ok(())
    }

    /// Rates of a chain at the robot's q, into its places of `v` (nv), for which its tip moves as nearly as asked as it can, seen from its
    /// base: `twist` is [ω; v] at the tip's origin, world axes. Of all such rates the least; within rate limits, and not outward at a
    /// limit. Returns what is missing, rad/s and m/s. A search that was begun may go on afterwards. Of an object in two hands it moves this one alone.
    ///
    /// # Errors
    /// [`RobotError::ForeignHandle`], [`RobotError::NotAChain`], [`RobotError::OpensClosure`], [`RobotError::Length`], [`RobotError::NotFinite`].
    pub fn rates(
        &mut self,
        part: Part,
        twist: &Motion,
        v: &mut [f64],
    ) -> Result<Residual, RobotError> {
        numbers("v", v, self.tree.nv())?;
        numbers("angular velocity", twist.angular.as_slice(), 3)?;
        numbers("velocity", twist.linear.as_slice(), 3)?;
        let (model, whole) = (&self.model, &self.q);
        let chain = model.chain(part)?;
        model.opens(chain, "a rate of one tip")?;
        let Some(memory) = self.chains[part.index()].as_mut() else {
            return Err(RobotError::NotAChain { part: part.index() });
        };
        let R = base(chain, memory, whole).rotation.inverse();
        let ChainMemory { ik, best, scale: rates, .. } = memory;
        gather(&chain.q, whole, best);
        gather(&chain.v, v, rates);
        let target = RateTarget::new(chain.tip, twist.rotate(&R));
        let done = ik.rates(&chain.tree, &[target], best, rates);
        debug_assert!(done.is_ok(), "everything was checked");
        let missing = done.ok().and_then(|r| r.first().copied()).unwrap_or_default();
        for (at, x) in chain.v.iter().zip(&*rates) {
            v[*at] = *x;
        }
        Ok(missing)
    }

    /// All configurations within limits that bring the tip of an arm with a [closed form](crate::RobotModel::closed_form) to a pose. `q` (nq of the
    /// whole) says where what carries the chain is, the value of the hinge that is held, and what is near: each angle is the copy, by
    /// whole turns, nearest to q's within its limits, and an angle of which nothing depends (in a singular pose) stays.
    /// `out` takes whole configurations one after the other, the nearest to q first (sum of squares of angles): room for
    /// [`ClosedForm::MOST`] is always enough. Returns how many there are; none is an answer, not an error. Each meets the pose within
    /// 1e-9 m and rad. No search, no restarts: the same work each time.
    ///
    /// # Errors
    /// [`RobotError::ForeignHandle`], [`RobotError::NotAChain`], [`RobotError::OpensClosure`], [`RobotError::Length`], [`RobotError::NotFinite`],
    /// [`RobotError::OutOfRange`] (a goal without a position or an orientation), [`RobotError::OutsideLimits`] (the hinge that is
    /// held), [`RobotError::NoRoom`].
    pub fn inverse_kinematics_all(
        &mut self,
        closed: &ClosedForm,
        goal: &Goal,
        frame: Frame,
        q: &[f64],
        out: &mut [f64],
    ) -> Result<usize, RobotError> {
        let model = &self.model;
        let chain = model.chain(closed.part())?;
        if !closed.is_of(chain) {
            return Err(RobotError::ForeignHandle);
        }
        model.opens(chain, "a closed form")?;
        let n = self.q.len();
        model.configurations("q", q, 1)?;
        check(goal, &Effort::default())?;
        closed.held_within(q)?;
        let whole = goal.place == Place::Point;
        let (Some(position), Some(orientation), true) = (goal.position, goal.orientation, whole)
        else {
            let help = "a closed form takes a position and an orientation; `reach` takes either, and parts of them";
            return Err(RobotError::OutOfRange { what: "parts of the goal", value: 1.0, help });
        };
        let Some(memory) = self.chains[closed.part().index()].as_mut() else {
            return Err(RobotError::NotAChain { part: closed.part().index() });
        };
        let mut X = Pose::new(orientation, position);
        match frame {
            Frame::World => X = base(chain, memory, q).inverse() * X,
            Frame::Base => {}
            Frame::Tip(other) => {
                let (what, value) = ("frame of a closed form", other.index() as f64);
                let help = "give the goal in the world or in the base";
                return Err(RobotError::OutOfRange { what, value, help });
            }
        }
        memory.fresh = false;
        let (mut count, room) = (0, out.len() / n.max(1));
        closed.solve(&X, q, |angles| {
            if let Some(row) = out.get_mut(count * n..(count + 1) * n) {
                row.copy_from_slice(q);
                for (at, x) in closed.places().zip(angles) {
                    row[at] = *x;
                }
            }
            count += 1;
        });
        match count > room {
            true => Err(RobotError::NoRoom { what: "solutions", wanted: count, room }),
            false => Ok(count),
        }
    }

    /// Goes on with the last search of a chain for so many evaluations of its kinematics. The same steps
    /// are taken in whatever portions.
    ///
    /// # Errors
    /// [`RobotError::ForeignHandle`], [`RobotError::NotAChain`], [`RobotError::Length`], [`RobotError::NoSearch`].
    pub fn resume_inverse_kinematics(
        &mut self,
        part: Part,
        kinematics: usize,
        q: &mut [f64],
    ) -> Result<Answer, RobotError> {
        let model = &self.model;
        let chain = model.chain(part)?;
        if q.len() != self.q.len() {
            let (got, wanted) = (q.len(), self.q.len());
            return Err(RobotError::Length { what: "q", got, wanted });
        }
        let Some(memory) = self.chains[part.index()].as_mut() else {
            return Err(RobotError::NotAChain { part: part.index() });
        };
        if !memory.searching {
            return Err(RobotError::NoSearch { part: part.index() });
        }
        memory.fresh = false;
        let progress = memory.ik.advance(&chain.tree, kinematics, &mut memory.q);
        for (at, x) in chain.q.iter().zip(&memory.q) {
            q[*at] = *x;
        }
        let (outcome, found) = match progress {
            Progress::Met(found) => (Outcome::Met, found),
            // Chains have no closures.
            Progress::Nearest(found) | Progress::Open(found) => (Outcome::Nearest, found),
            Progress::Unfinished(found) => (Outcome::Unfinished, found),
        };
        let residual = memory.ik.residuals().first().copied().unwrap_or_default();
        let (kinematics, restart) = (found.kinematics, found.restarts);
        Ok(Answer { outcome, residual, kinematics, restart })
    }
}

pub(super) fn check(goal: &Goal, effort: &Effort) -> Result<(), RobotError> {
    if let Some(p) = goal.position {
        numbers("position of the goal", p.as_slice(), 3)?;
    }
    if let Some(R) = goal.orientation {
        numbers("orientation of the goal", R.coords.as_slice(), 4)?;
        let value = R.coords.norm();
        if !((value - 1.0).abs() < 1e-6) {
            let help = "a rotation is a quaternion of length 1";
            return Err(RobotError::OutOfRange {
                what: "length of the goal's quaternion",
                value,
                help,
            });
        }
    }
    if goal.orientation.is_some() && goal.pointing.is_some() {
        let help = "an orientation says where every axis points: give one of them";
        let what = "an orientation beside a pointing axis";
        return Err(RobotError::OutOfRange { what, value: 1.0, help });
    }
    let mut directions = [None; 3];
    if let Place::Plane(n) | Place::Line(n) = goal.place {
        directions[0] = Some(n);
    }
    if let Some(p) = goal.pointing {
        directions[1] = Some(p.axis);
        match p.to {
            Towards::Direction(a) => directions[2] = Some(a),
            Towards::Point(x) => numbers("point that is looked at", x.as_slice(), 3)?,
        }
        let (what, value, help) = ("angle of a cone", p.within, "from 0 to π rad");
        if !(0.0..=std::f64::consts::PI).contains(&value) {
            return Err(RobotError::OutOfRange { what, value, help });
        }
    }
    for d in directions.into_iter().flatten() {
        let (what, value, help) = ("length of a direction of the goal", d.norm(), "give length 1");
        if !((value - 1.0).abs() < 1e-6) {
            return Err(RobotError::OutOfRange { what, value, help });
        }
    }
    if goal.position.is_none() && goal.orientation.is_none() && goal.pointing.is_none() {
        let help = "ask for a position, an orientation or both, or where an axis points";
        return Err(RobotError::OutOfRange { what: "parts of the goal", value: 0.0, help });
    }
    let bad = |x: &f64| !(*x > 0.0 && x.is_finite());
    let sets = [("weight of the goal", goal.weights), ("tolerance", effort.tolerances)];
    for (what, pair) in sets {
        if let Some(value) = pair.into_iter().find(bad) {
            return Err(RobotError::OutOfRange { what, value, help: "give a number above zero" });
        }
    }
    Ok(())
}
