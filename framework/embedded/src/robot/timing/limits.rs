//! Limits of a motion for each degree of freedom.

use crate::error::RobotError;
use crate::model::RobotModel;

/// Limits of a motion. Each vector has one number for each degree of freedom of the mechanism (nv), in the order of β. Infinity means no limit.
#[derive(Clone, Debug, PartialEq)]
pub struct MotionLimits {
    /// Largest rate, rad/s or m/s.
    pub rate: Vec<f64>,
    /// Largest acceleration, rad/s² or m/s².
    pub acceleration: Vec<f64>,
    /// Largest jerk, rad/s³ or m/s³.
    pub jerk: Vec<f64>,
    /// Largest force of the joint, N m or N.
    pub effort: Vec<f64>,
}

impl MotionLimits {
    /// Returns the rate and effort limits of the model (URDF: `velocity`, `effort`), without limits of acceleration and jerk, because robot files do
    /// not contain any.
    #[must_use]
    pub fn of(model: &RobotModel) -> Self {
        let none = vec![f64::INFINITY; model.nv()];
        let mut own = Self {
            rate: none.clone(),
            effort: none.clone(),
            acceleration: none.clone(),
            jerk: none,
        };
        for (v, limits) in model.limits.iter().enumerate() {
            if let Some((_, limits)) = limits {
                (own.rate[v], own.effort[v]) = (limits.rate, limits.effort);
            }
        }
        own
    }

    /// Sets the acceleration limit of every degree of freedom to `most`.
    #[must_use]
    pub fn acceleration(mut self, most: f64) -> Self {
        self.acceleration.fill(most);
        self
    }

    /// Sets the jerk limit of every degree of freedom to `most`.
    #[must_use]
    pub fn jerk(mut self, most: f64) -> Self {
        self.jerk.fill(most);
        self
    }

    /// Removes the effort limits. [`Timing`](super::Timing) then computes no dynamics.
    #[must_use]
    pub fn any_effort(mut self) -> Self {
        self.effort.fill(f64::INFINITY);
        self
    }

    /// Checks that each vector has nv numbers and that all numbers are positive.
    pub(in crate::robot) fn check(&self, nv: usize) -> Result<(), RobotError> {
        let all = [
            ("rate", &self.rate),
            ("acceleration", &self.acceleration),
            ("jerk", &self.jerk),
            ("effort", &self.effort),
        ];
        for (what, x) in all {
            if x.len() != nv {
                return Err(RobotError::Length { what, got: x.len(), wanted: nv });
            }
            // The negated comparison also rejects NaN.
            if let Some(value) = x.iter().copied().find(|x| !(*x > 0.0)) {
                let help = "limits must be positive; use infinity for no limit";
                return Err(RobotError::OutOfRange { what, value, help });
            }
        }
        Ok(())
    }
}
