//! Where a motion goes from here, and how well that is known: the prediction of an estimator, with what is held.

use super::{Robot, numbers};
use crate::error::RobotError;
use linkwork_dynamics::{Drive, DynamicsError, Known, Prediction};

/// Memory for [`Robot::predict`].
#[derive(Clone, Debug)]
pub struct Predictor {
    inner: Prediction,
    rest: Vec<f64>,
}

impl Predictor {
    /// For a robot and its clones.
    #[must_use]
    pub fn new(robot: &Robot) -> Self {
        Self { inner: Prediction::new(&robot.tree), rest: vec![0.0; robot.tree.nv()] }
    }

    /// How errors before the last step became errors after it (2 nv × 2 nv, row after row): rows and columns [δq; δv], δq along v.
    #[must_use]
    pub fn transition(&self) -> &[f64] {
        self.inner.transition()
    }
}

impl Robot {
    /// A step of `step` seconds from a state of its own, which needs not be the robot's: q, rates and the covariance of their errors [δq; δv]
    /// (2 nv × 2 nv, row after row, δq along v) go on under the forces `tau` (nv) and white noise of these with the spectral densities `density`
    /// (nv; (N m)² s, N² s), with what is held and the robot's gravity. By the midpoint rule, of second order; the covariance is that of its
    /// exact derivative ([`Prediction`]). After an error nothing was changed.
    ///
    /// # Errors
    /// [`RobotError::Length`], [`RobotError::NotFinite`], [`RobotError::OutOfRange`] for a step or a density that is negative,
    /// [`RobotError::ForeignHandle`] for the memory of another model, [`RobotError::Singular`] where a joint has nothing to move, [`RobotError::OpensClosure`].
    pub fn predict(
        &mut self,
        memory: &mut Predictor,
        state: Known<'_>,
        tau: &[f64],
        density: &[f64],
        step: f64,
    ) -> Result<(), RobotError> {
        self.model.open_tree("a prediction")?;
        let nv = self.tree.nv();
        self.model.configurations("q", state.q, 1)?;
        numbers("v", state.v, nv)?;
        numbers("covariance", state.covariance, 4 * nv * nv)?;
        numbers("tau", tau, nv)?;
        numbers("density", density, nv)?;
        if memory.rest.len() != nv {
            return Err(RobotError::ForeignHandle);
        }
        if let Some(value) = density.iter().copied().find(|s| *s < 0.0) {
            let help = "give spectral densities, 0 or more";
            return Err(RobotError::OutOfRange { what: "density", value, help });
        }
        if !(step >= 0.0 && step.is_finite()) {
            let help = "give a time in seconds, 0 or more";
            return Err(RobotError::OutOfRange { what: "step", value: step, help });
        }
        self.fresh = false;
        let drive = Drive { tau, vdot: &memory.rest, density, gravity: self.gravity, step };
        memory.inner.step(&self.tree, &mut self.ws, state, drive).map_err(|e| match e {
            DynamicsError::Singular { .. } => RobotError::Singular {
                what: "the motion of a joint that carries nothing",
                help: "give it, or a body that it carries, a mass and an inertia, or an armature",
            },
            DynamicsError::Flexible { .. } => RobotError::Singular {
                what: "the motion of a flexible body",
                help: "take a rigid one",
            },
        })
    }
}
