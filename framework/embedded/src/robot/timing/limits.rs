//! Limits of a motion, for each degree of freedom.

use crate::error::RobotError;
use crate::model::RobotModel;

/// Limits of a motion: one number for each degree of freedom of the mechanism (nv), in the order of β. Infinite: there is none.
#[derive(Clone, Debug, PartialEq)]
pub struct MotionLimits {
    /// Greatest rate, rad/s or m/s.
    pub rate: Vec<f64>,
    /// Greatest acceleration, rad/s² or m/s².
    pub acceleration: Vec<f64>,
    /// Greatest jerk, rad/s³ or m/s³.
    pub jerk: Vec<f64>,
    /// Greatest force at the joint, N m or N.
    pub effort: Vec<f64>,
}

impl MotionLimits {
    /// Rates and efforts of the model (URDF: `velocity`, `effort`); no limits of acceleration and jerk, which files do not have.
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

    /// The same acceleration for every degree of freedom.
    #[must_use]
    pub fn acceleration(mut self, most: f64) -> Self {
        self.acceleration.fill(most);
        self
    }

    /// The same jerk for every degree of freedom.
    #[must_use]
    pub fn jerk(mut self, most: f64) -> Self {
        self.jerk.fill(most);
        self
    }

    /// No limits of effort: then no dynamics is computed.
    #[must_use]
    pub fn any_effort(mut self) -> Self {
        self.effort.fill(f64::INFINITY);
        self
    }

    /// Lengths, and numbers above zero.
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
            // NaN is not above zero.
            if let Some(value) = x.iter().copied().find(|x| !(*x > 0.0)) {
                let help = "a limit is above zero; infinite where there is none";
                return Err(RobotError::OutOfRange { what, value, help });
            }
        }
        Ok(())
    }
}
