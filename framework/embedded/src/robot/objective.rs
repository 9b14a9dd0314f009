//! What a robot is asked to do, in order of priority; the rows of it.

use super::{Robot, numbers};
use crate::error::RobotError;
use crate::manipulability::Rows;
use crate::part::Part;
use linkwork_dynamics::{centroidal_bias, com_jacobian, node_jacobian};
use linkwork_spatial::{Motion, Vec3};

/// One thing that is asked, of rates ([`RateControl`](super::RateControl)) or of accelerations ([`WholeBody`](super::WholeBody)).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Objective<'a> {
    /// Lower ones come first; those of one level are met together, in the sense of least squares.
    pub level: usize,
    /// What it counts within its level; above zero.
    pub weight: f64,
    /// What is asked.
    pub aim: Aim<'a>,
}

impl<'a> Objective<'a> {
    /// With weight 1.
    #[must_use]
    pub fn new(level: usize, aim: Aim<'a>) -> Self {
        Self { level, weight: 1.0, aim }
    }

    /// With another weight.
    #[must_use]
    pub fn weight(mut self, weight: f64) -> Self {
        self.weight = weight;
        self
    }
}

/// What moves how.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Aim<'a> {
    /// The tip of a chain, in the world: its twist (rad/s, m/s), or its acceleration (rad/s², m/s²), at its origin, world axes.
    Tip {
        /// The chain.
        part: Part,
        /// Twist or acceleration.
        motion: Motion,
        /// Which rows of it; what 1 rad counts when both.
        rows: Rows,
    },
    /// The centre of mass of all that moves, with what is held: velocity, m/s, or acceleration, m/s², world axes.
    Center(Vec3),
    /// All degrees of freedom (nv): rates or accelerations.
    Posture(&'a [f64]),
}

impl Robot {
    /// Checks objectives.
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
                    ("weight of an objective", w.weight, "a weight is above zero");
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
                        let (what, help) = ("length", "a length is above zero");
                        return Err(RobotError::OutOfRange { what, value, help });
                    }
                }
                Aim::Center(x) => numbers("motion of the centre of mass", x.as_slice(), 3)?,
                Aim::Posture(x) => numbers("posture", x, self.tree.nv())?,
            }
        }
        Ok(())
    }

    /// The lowest level above `after`.
    pub(super) fn next_level(objectives: &[Objective<'_>], after: Option<usize>) -> Option<usize> {
        let above = objectives.iter().map(|w| w.level).filter(|l| after.is_none_or(|a| *l > a));
        above.min()
    }

    /// The rows of all objectives of a level, each `width` numbers of which the first nv are those of the degrees of freedom, into A; right sides into b. With
    /// `Terms::Accelerations` the workspace has velocities and what they make of accelerations. Returns how many rows there are.
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

/// What objectives ask.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Terms {
    Rates,
    Accelerations,
}
