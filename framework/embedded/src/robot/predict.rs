//! State prediction for estimators: state and covariance after a time step, including held objects.

use super::{Robot, numbers};
use crate::error::RobotError;
use linkwork_dynamics::{Drive, DynamicsError, Prediction, StateEstimate};

/// Memory for [`Robot::predict`].
#[derive(Clone, Debug)]
pub struct Predictor {
    inner: Prediction,
    rest: Vec<f64>,
}

impl Predictor {
    /// Creates the memory for a robot and its clones.
    #[must_use]
    pub fn new(robot: &Robot) -> Self {
        Self { inner: Prediction::new(&robot.tree), rest: vec![0.0; robot.tree.nv()] }
    }

    /// Returns the transition matrix of the last step (2 nv × 2 nv, row after row), which maps errors before the step to errors after it. Rows and
    /// columns are [δq; δv], δq along v.
    #[must_use]
    pub fn transition(&self) -> &[f64] {
        self.inner.transition()
    }
}

impl Robot {
    /// Predicts a given state, which may differ from the robot's, over `step` seconds. The state consists of q, rates and the covariance of their
    /// errors [δq; δv] (2 nv × 2 nv, row after row, δq along v). It moves under the forces `tau` (nv), white force noise with the spectral densities
    /// `density` (nv; (N m)² s, N² s), held objects and the robot's gravity. The midpoint rule of second order is used; the covariance is propagated
    /// with its exact derivative ([`Prediction`]). After an error nothing has changed.
    ///
    /// # Errors
    /// [`RobotError::Length`]; [`RobotError::NotFinite`]; [`RobotError::OutOfRange`] for a negative step or density; [`RobotError::ForeignHandle`]
    /// for memory of another model; [`RobotError::Singular`] where a joint moves no mass; [`RobotError::OpensClosure`].
    pub fn predict(
        &mut self,
        memory: &mut Predictor,
        state: StateEstimate<'_>,
        tau: &[f64],
        density: &[f64],
        step: f64,
    ) -> Result<(), RobotError> {
        self.model.open_tree("prediction")?;
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
                what: "forward dynamics of a joint that moves no mass",
                help: "give a body that it carries mass and inertia, or give the joint an armature",
            },
            DynamicsError::Flexible { .. } => RobotError::Singular {
                what: "forward dynamics of a flexible body",
                help: "use a rigid body",
            },
        })
    }
}
