//! Inverse kinematics of a chain: joint coordinates for which the tip meets its goal.
//!
//! Only the chain moves; the coordinates of the bodies that carry it keep their given values. Work is counted in evaluations of the chain's
//! kinematics, so that a limit means the same on every machine. A search can be interrupted and continued at any point.

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

/// Frame in which a [`Goal`] is given.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Frame {
    /// The world.
    #[default]
    World,
    /// The frame of the chain's base, which may move with the body that carries the chain.
    Base,
    /// The tip of another chain. [`Robot::inverse_kinematics`] does not move that chain; [`WholeBodyIk`](super::WholeBodyIk) moves both.
    Tip(Part),
}

/// Tolerances and limits of the work of inverse kinematics.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Effort {
    /// Largest errors of position, m, and of orientation, rad.
    pub tolerances: [f64; 2],
    /// Maximum number of steps from one start.
    pub steps: usize,
    /// Number of additional starts, the same for each search. A quarter of them is used for a position that is out of reach because of the link
    /// lengths.
    pub restarts: usize,
    /// Maximum number of kinematics evaluations in one call.
    pub kinematics: usize,
}

impl Default for Effort {
    /// 1e-9 m and rad, 100 steps from each of 65 starts, no other limit.
    fn default() -> Self {
        Self { tolerances: [1e-9; 2], steps: 100, restarts: 64, kinematics: usize::MAX }
    }
}

impl Effort {
    /// Returns the default with a limit of kinematics evaluations.
    #[must_use]
    pub fn kinematics(kinematics: usize) -> Self {
        Self { kinematics, ..Self::default() }
    }

    /// Returns the default without additional starts.
    #[must_use]
    pub fn one_start() -> Self {
        Self { restarts: 0, ..Self::default() }
    }
}

impl Effort {
    /// Converts to the settings of the search in `linkwork_dynamics`.
    pub(super) fn inner(&self) -> search::Effort {
        search::Effort {
            position_tolerance: self.tolerances[0],
            orientation_tolerance: self.tolerances[1],
            iterations: self.steps,
            restarts: self.restarts,
        }
    }

    /// Returns an upper bound for the kinematics evaluations of [`Robot::inverse_kinematics`], whether the goal is met or not, for every chain, start and goal
    /// with the same kind of conditions. A call ends sooner when it reaches `kinematics`. Most searches take one hundredth of it.
    /// [`WholeBodyIk::worst_case_steps`](super::WholeBodyIk::worst_case_steps) returns the bound for the whole robot.
    #[must_use]
    pub fn worst_case_steps(&self, goal: &Goal) -> usize {
        self.inner().worst_case_steps([goal], false)
    }
}

/// Result of a search.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Outcome {
    /// The goal is met within the tolerances.
    Met,
    /// No start led to the goal. This is the nearest configuration of all starts. It is a local minimum, so a nearer configuration may exist.
    Nearest,
    /// The limit of evaluations was reached; [`Robot::resume_inverse_kinematics`] continues.
    Unfinished,
}

/// Result of inverse kinematics, in addition to q.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Answer {
    /// Result of the search.
    pub outcome: Outcome,
    /// Residual of the tip's goal; undefined when the search is unfinished.
    pub residual: Residual,
    /// Kinematics evaluations since the search began.
    pub kinematics: usize,
    /// Index of the start that led there; 0 is the given start.
    pub restart: usize,
}

pub(super) fn memory(chain: &Chain) -> InverseKinematics {
    let mut ik = InverseKinematics::new(&chain.tree);
    ik.reserve(1);
    ik
}

impl Robot {
    /// Searches for coordinates of a chain within limits for which its tip meets the goal, which is given in `frame`. `q` (nq of the whole robot) is
    /// the start on input and the solution, or the nearest configuration, on output; only the chain's coordinates change. The robot's own q does not
    /// change. If two hands hold an object, this function moves only one of them; [`WholeBodyIk`](crate::WholeBodyIk) moves both and returns their
    /// closure error.
    ///
    /// # Errors
    /// [`RobotError::ForeignHandle`], [`RobotError::NotAChain`], [`RobotError::OpensClosure`], [`RobotError::Length`], [`RobotError::NotFinite`],
    /// [`RobotError::OutOfRange`] (weights, tolerances, an empty goal), [`RobotError::OutsideLimits`]. After an error `q` is unchanged. A goal that
    /// cannot be met is a result ([`Outcome::Nearest`]), not an error.
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

    /// Checks the inputs and prepares the search.
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
        model.opens(chain, "inverse kinematics of one chain")?;
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

    /// Computes joint rates of a chain at the robot's q for which the tip moves with `twist` as closely as possible, and writes them to the chain's
    /// entries of `v` (nv). `twist` is [ω; v] of the tip's origin relative to the chain's base, in world axes. Among all such rates the smallest are
    /// chosen, within rate limits and not outward at a position limit. Returns the residual velocity, rad/s and m/s. A search in progress can be
    /// continued afterwards. If two hands hold an object, this function moves only one of them.
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
        model.opens(chain, "joint rates for one tip")?;
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

    /// Computes all configurations within limits that bring the tip of an arm with a [closed form](crate::RobotModel::closed_form) to a pose. `q` (nq
    /// of the whole robot) gives the configuration of the bodies that carry the chain, the value of the fixed hinge, and a reference: each angle is
    /// shifted by whole revolutions to the value within limits that is nearest to q's, and an angle that has no effect in a singular pose keeps its
    /// value. `out` receives whole configurations one after the other, sorted by distance from q (sum of squared angle differences). Room for
    /// [`ClosedForm::MOST`] configurations is always sufficient. Returns the number of configurations; zero is a result, not an error. Each solution
    /// meets the pose within 1e-9 m and 1e-9 rad. There is no search, so every call takes the same work.
    ///
    /// # Errors
    /// [`RobotError::ForeignHandle`], [`RobotError::NotAChain`], [`RobotError::OpensClosure`], [`RobotError::Length`], [`RobotError::NotFinite`],
    /// [`RobotError::OutOfRange`] (a goal without a position or an orientation), [`RobotError::OutsideLimits`] (the fixed hinge),
    /// [`RobotError::NoRoom`].
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
            let help = "a closed form needs a position and an orientation; `inverse_kinematics` also supports goals with only one of them";
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

    /// Continues the last search of a chain for up to `kinematics` evaluations of its kinematics. The result does not depend on how the evaluations
    /// are divided into calls.
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
            // A chain has no closures, so an open closure cannot occur.
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
            let help = "give a quaternion of length 1";
            return Err(RobotError::OutOfRange {
                what: "length of the goal's quaternion",
                value,
                help,
            });
        }
    }
    if goal.orientation.is_some() && goal.pointing.is_some() {
        let help =
            "an orientation already fixes the direction of every axis; give only one of the two";
        let what = "an orientation together with a pointing axis";
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
        let help = "give a position, an orientation or both, or the direction of an axis";
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
