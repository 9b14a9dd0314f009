//! Rate control for several tasks in order of priority, which keeps away from joint limits and singular configurations.
//!
//! ```text
//! level k      min |J_k v − ẋ_k|²          a level never degrades the levels before it
//! bounds       −rate ≤ v ≤ rate;           (lower − q)/T ≤ v ≤ (upper − q)/T        T: horizon, the time in which a limit may be reached
//!              ∇w v ≥ (w_least − w)/T      for each guarded chain
//! last         min |v|
//! ```
//! Because the rate of its manipulability w is bounded, a chain slows down towards a singular configuration and does not pass through it. A chain
//! below its smallest permitted w moves back up, with at most half of the speed that its limits allow.

use super::objective::{Objective, Terms};
use super::{Robot, numbers};
use crate::error::RobotError;
use crate::manipulability::Rows;
use crate::part::Part;
use crate::priorities::Priorities;
use linkwork_dynamics::kinematics;

/// Limits that the rates respect.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Guards<'a> {
    /// Time in which a limit of a coordinate or the smallest manipulability may be reached, s; use a few control periods.
    pub horizon: f64,
    /// Guarded chains, each with the smallest permitted manipulability (of `Rows::All` with length 1 m).
    pub manipulable: &'a [(Part, f64)],
}

/// Rate controller for one model, with its memory.
#[derive(Clone, Debug)]
pub struct RateControl {
    nv: usize,
    objectives: usize,
    chains: usize,
    problem: Priorities,
    A: Vec<f64>,
    b: Vec<f64>,
    row: Vec<f64>,
    gradient: Vec<f64>,
    /// Largest rates of each coordinate downwards and upwards.
    within: Vec<[f64; 2]>,
}

impl RateControl {
    /// Creates a controller for up to `objectives` tasks and `chains` guarded chains. Allocates memory; later calls do not.
    #[must_use]
    pub fn new(robot: &Robot, objectives: usize, chains: usize) -> Self {
        let nv = robot.tree.nv();
        let rows = objectives * nv.max(6);
        Self {
            nv,
            objectives,
            chains,
            problem: Priorities::new(nv, rows, 2 * nv + chains),
            A: vec![0.0; rows * nv],
            b: vec![0.0; rows],
            row: vec![0.0; nv],
            gradient: vec![0.0; nv],
            within: vec![[0.0; 2]; nv],
        }
    }

    /// Computes rates `v` (nv) at the robot's q, within the limits of the model and as near to each task as the tasks before it allow. `residuals`
    /// receives the weighted |J v − ẋ| of each level; its length must be the number of levels.
    ///
    /// # Errors
    /// [`RobotError::ForeignHandle`]; [`RobotError::NotAChain`]; [`RobotError::Length`]; [`RobotError::NotFinite`]; [`RobotError::NoRoom`];
    /// [`RobotError::OpensClosure`]; [`RobotError::OutOfRange`] for a horizon or weight that is not positive; [`RobotError::Singular`] when the
    /// guards of chains contradict each other, because a motion that raises the manipulability of one chain lowers that of another. Limits of
    /// coordinates never contradict each other: a coordinate outside its limits returns within the horizon, or at its full rate if that is too slow.
    pub fn solve(
        &mut self,
        robot: &mut Robot,
        objectives: &[Objective<'_>],
        guards: &Guards<'_>,
        v: &mut [f64],
        residuals: &mut [f64],
    ) -> Result<(), RobotError> {
        let nv = self.nv;
        if robot.tree.nv() != nv {
            return Err(RobotError::ForeignHandle);
        }
        robot.model.open_tree("rate control")?;
        robot.check_objectives(objectives, self.objectives)?;
        if v.len() != nv {
            return Err(RobotError::Length { what: "v", got: v.len(), wanted: nv });
        }
        numbers("horizon", &[guards.horizon], 1)?;
        if !(guards.horizon > 0.0) {
            let (what, value, help) = ("horizon", guards.horizon, "the horizon must be positive");
            return Err(RobotError::OutOfRange { what, value, help });
        }
        if guards.manipulable.len() > self.chains {
            let (wanted, room) = (guards.manipulable.len(), self.chains);
            return Err(RobotError::NoRoom { what: "guarded chains", wanted, room });
        }
        kinematics(&robot.tree, &mut robot.ws, &robot.q, &robot.rest);
        robot.fresh = true;
        self.problem.begin();
        self.guard(robot, guards)?;
        let (mut level, mut count) = (Robot::next_level(objectives, None), 0);
        let help = "guards of chains contradict each other: lower the required manipulability, or use a longer horizon";
        let failed = RobotError::Singular { what: "the problem of rates within all guards", help };
        if level.is_none() {
            self.problem.level(&[], &[]).map_err(|_| failed)?;
        }
        while let Some(at) = level {
            let room = (&mut self.A[..], &mut self.b[..]);
            let rows = robot.level_rows(objectives, at, Terms::Rates, nv, room)?;
            let met = self.problem.level(&self.A[..nv * rows], &self.b[..rows]);
            let residual = met.map_err(|_| failed)?.residual;
            let Some(to) = residuals.get_mut(count) else {
                let (got, wanted) = (residuals.len(), count + 1);
                return Err(RobotError::Length { what: "residuals", got, wanted });
            };
            *to = residual;
            count += 1;
            level = Robot::next_level(objectives, Some(at));
        }
        v.copy_from_slice(self.problem.x());
        Ok(())
    }

    fn guard(&mut self, robot: &mut Robot, guards: &Guards<'_>) -> Result<(), RobotError> {
        for (dof, limit) in robot.model.limits.iter().enumerate() {
            let Some((at, l)) = limit else { continue };
            let q = robot.q[*at];
            for (side, limit) in [(1.0, l.upper), (-1.0, l.lower)] {
                self.row.fill(0.0);
                self.row[dof] = side;
                // Outside its limits a coordinate returns as fast as its rate limit allows.
                let most = (side * (limit - q) / guards.horizon).clamp(-l.rate, l.rate);
                self.problem.bound(&self.row, most);
                self.within[dof][usize::from(side > 0.0)] = most;
            }
        }
        for (part, least) in guards.manipulable {
            numbers("least manipulability", &[*least], 1)?;
            let model = robot.model.clone();
            let dofs = model.dofs(*part)?;
            let gradient = &mut self.gradient[..dofs.len()];
            let rows = Rows::All { length: 1.0 };
            let w = robot.manipulability(*part, rows, Some(&mut *gradient))?.w;
            self.row.fill(0.0);
            for (dof, g) in dofs.iter().zip(&*gradient) {
                self.row[*dof] = -g;
            }
            if self.row.iter().any(|x| *x != 0.0) {
                // Below the smallest manipulability, require an increase of at most half of what the limits allow.
                let up = |(g, [down, up]): (&f64, &[f64; 2])| (-g * up).max(g * down).max(0.0);
                let possible: f64 = self.row.iter().zip(&self.within).map(up).sum();
                let share = 0.5 / guards.manipulable.len() as f64;
                let room = ((w - least) / guards.horizon).max(-share * possible);
                self.problem.bound(&self.row, room);
            }
        }
        Ok(())
    }
}
