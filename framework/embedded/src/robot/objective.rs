//! Tasks of a robot in order of priority, and their equations.

use super::{Robot, numbers};
use crate::error::RobotError;
use crate::manipulability::Rows;
use crate::part::Part;
use linkwork_dynamics::{centroidal_bias, com_jacobian, node_jacobian};
use linkwork_spatial::{Motion, Vec3};

/// One task: desired rates ([`RateControl`](super::RateControl)) or desired accelerations ([`WholeBody`](super::WholeBody)).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Objective<'a> {
    /// Priority level. Lower levels come first; tasks of the same level are met together in the least-squares sense.
    pub level: usize,
    /// Weight within its level; above zero.
    pub weight: f64,
    /// The desired motion.
    pub aim: Aim<'a>,
}

impl<'a> Objective<'a> {
    /// Creates a task with weight 1.
    #[must_use]
    pub fn new(level: usize, aim: Aim<'a>) -> Self {
        Self { level, weight: 1.0, aim }
    }

    /// Sets the weight.
    #[must_use]
    pub fn weight(mut self, weight: f64) -> Self {
        self.weight = weight;
        self
    }
}

/// Desired motion of a task.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Aim<'a> {
    /// Motion of the tip of a chain in the world: its twist (rad/s, m/s) or its acceleration (rad/s², m/s²), at its origin, world axes.
    Tip {
        /// The chain.
        part: Part,
        /// Twist or acceleration.
        motion: Motion,
        /// The controlled rows, and the length that scales angular rows if both kinds are controlled.
        rows: Rows,
    },
    /// Motion of the centre of mass of all moving bodies, including held objects: velocity, m/s, or acceleration, m/s², world axes.
    Center(Vec3),
    /// Rates or accelerations of all degrees of freedom (nv).
    Posture(&'a [f64]),
}

impl Robot {
    /// Checks the tasks.
    pub(super) fn check_objectives(
        &self,
        objectives: &[Objective<'_>],
        room: usize,
    ) -> Result<(), RobotError> {
        if objectives.len() > room {
            return Err(RobotError::NoRoom { what: "objectives", wanted: objectives.len(), room });
        }
        for w in objectives {
            if !(w.weight > 0.0 && w.weight.is_finite()) {
                let (what, value, help) =
                    ("weight of a task", w.weight, "weights must be positive");
                return Err(RobotError::OutOfRange { what, value, help });
            }
            match w.aim {
                Aim::Tip { part, motion, rows } => {
                    self.model.tip(part)?;
                    numbers("angular motion of a tip", motion.angular.as_slice(), 3)?;
                    numbers("linear motion of a tip", motion.linear.as_slice(), 3)?;
                    if let Rows::All { length: value } = rows
                        && !(value > 0.0 && value.is_finite())
                    {
                        let (what, help) = ("length", "the length must be positive");
                        return Err(RobotError::OutOfRange { what, value, help });
                    }
                }
                Aim::Center(x) => numbers("motion of the centre of mass", x.as_slice(), 3)?,
                Aim::Posture(x) => numbers("posture", x, self.tree.nv())?,
            }
        }
        Ok(())
    }

    /// Returns the lowest level above `after`.
    pub(super) fn next_level(objectives: &[Objective<'_>], after: Option<usize>) -> Option<usize> {
        let above = objectives.iter().map(|w| w.level).filter(|l| after.is_none_or(|a| *l > a));
        above.min()
    }

    /// Writes the rows of all tasks of a level into A, and their right-hand sides into b. A row has `width` numbers, of which the first nv belong to
    /// the degrees of freedom. With `Terms::Accelerations` the workspace must contain velocities and the accelerations at v̇ = 0. Returns the number
    /// of rows.
    pub(super) fn level_rows(
        &mut self,
        objectives: &[Objective<'_>],
        level: usize,
        terms: Terms,
        width: usize,
        (A, b): (&mut [f64], &mut [f64]),
    ) -> Result<usize, RobotError> {
        let nv = self.tree.nv();
        let mut rows = 0;
        let mut jacobian = std::mem::take(&mut self.jacobian);
        for objective in objectives.iter().filter(|w| w.level == level) {
            let mut push = |row: &[f64], scale: f64, right: f64| {
                let to = &mut A[width * rows..width * (rows + 1)];
                to.fill(0.0);
                to.iter_mut().zip(row).for_each(|(t, x)| *t = objective.weight * scale * x);
                b[rows] = objective.weight * scale * right;
                rows += 1;
            };
            match objective.aim {
                Aim::Tip { part, motion, rows } => {
                    let tip = self.model.tip(part)?;
                    node_jacobian(&self.tree, &self.ws, tip, &mut jacobian);
                    let mut right = motion;
                    if terms == Terms::Accelerations {
                        right -= self.ws.node_acceleration(&self.tree, tip);
                    }
                    let (w, v) = (right.angular, right.linear);
                    let right = [w.x, w.y, w.z, v.x, v.y, v.z];
                    let (range, scale) = match rows {
                        Rows::All { length } => (0..6, length),
                        Rows::Angular => (0..3, 1.0),
                        Rows::Linear => (3..6, 1.0),
                    };
                    for i in range {
                        let scale = if i < 3 { scale } else { 1.0 };
                        push(&jacobian[nv * i..nv * (i + 1)], scale, right[i]);
                    }
                }
                Aim::Center(mut x) => {
                    com_jacobian(&self.tree, &mut self.ws, &mut jacobian[..3 * nv]);
                    let mass = self.tree.total_mass();
                    if terms == Terms::Accelerations && mass > 0.0 {
                        x -= centroidal_bias(&self.tree, &self.ws).force / mass;
                    }
                    for i in 0..3 {
                        push(&jacobian[nv * i..nv * (i + 1)], 1.0, x[i]);
                    }
                }
                Aim::Posture(x) => {
                    for (i, x) in x.iter().enumerate() {
                        jacobian[..nv].fill(0.0);
                        jacobian[i] = 1.0;
                        push(&jacobian[..nv], 1.0, *x);
                    }
                }
            }
        }
        self.jacobian = jacobian;
        Ok(rows)
    }
}

/// Kind of motion that the tasks describe.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Terms {
    Rates,
    Accelerations,
}
