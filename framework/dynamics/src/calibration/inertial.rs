//! Identification of inertial parameters from measured motion and forces.
//!
//! ```text
//! τ − armature β̈ = Y(q, β, β̇) π          π: ten numbers of each body
//! ```

use super::{CalibrationError, Fit, fit, length};
use crate::inverse::inverse_dynamics;
use crate::regressor::{PARAMETERS, inertial_parameters, regressor};
use crate::tree::Tree;
use crate::work::Workspace;
use linkwork_multibody::BodyId;
use linkwork_spatial::nalgebra::DMatrix;
use linkwork_spatial::{Mat3, RigidInertia, Vec3};

/// Measured motion and forces of one mechanism.
#[derive(Clone, Debug)]
pub struct InertialData<'a> {
    tree: &'a Tree,
    ws: Workspace,
    prior: Vec<f64>,
    /// Rows of Y, and their right-hand sides.
    rows: Vec<f64>,
    right: Vec<f64>,
    Y: Vec<f64>,
    tau: Vec<f64>,
}

/// Inertial parameters that explain the measurements.
#[derive(Clone, Debug)]
pub struct InertialFit {
    /// The fit; its `parameters` are ten numbers of each body in canonical order ([`inertial_parameters`]).
    pub fit: Fit,
    /// Inertias of the bodies; `None` if no rigid body can have the identified numbers, usually because the measurements do not determine all of
    /// them.
    pub inertias: Vec<Option<RigidInertia>>,
}

impl<'a> InertialData<'a> {
    /// Starts an empty data set for a mechanism in uniform gravity, m/s², world axes. The mechanism's own inertial parameters are the prior.
    ///
    /// # Errors
    /// [`CalibrationError::Mechanism`] for flexible bodies.
    pub fn new(tree: &'a Tree, gravity: Vec3) -> Result<Self, CalibrationError> {
        let rigid = tree.check_rigid("inertial calibration");
        rigid.map_err(|e| CalibrationError::Mechanism(e.to_string()))?;
        let mut ws = Workspace::new(tree);
        ws.apply_uniform_gravity(gravity);
        let bodies = tree.multibody().bodies();
        let prior = bodies.iter().flat_map(|b| inertial_parameters(b.inertia())).collect();
        let Y = vec![0.0; tree.nv() * PARAMETERS * bodies.len()];
        let (rows, right) = (Vec::new(), Vec::new());
        Ok(Self { tree, ws, prior, rows, right, Y, tau: vec![0.0; tree.nv()] })
    }

    /// Adds one state: q (nq), rates, accelerations and forces (nv).
    ///
    /// # Errors
    /// [`CalibrationError::Length`], [`CalibrationError::NotFinite`].
    pub fn add(
        &mut self,
        q: &[f64],
        v: &[f64],
        vdot: &[f64],
        tau: &[f64],
    ) -> Result<(), CalibrationError> {
        let nv = self.tree.nv();
        length("q", q, self.tree.nq())?;
        length("v", v, nv)?;
        length("vdot", vdot, nv)?;
        length("tau", tau, nv)?;
        inverse_dynamics(self.tree, &mut self.ws, q, v, vdot, &mut self.tau);
        regressor(self.tree, &self.ws, &mut self.Y);
        self.rows.extend_from_slice(&self.Y);
        let width = self.prior.len();
        for (i, row) in self.Y.chunks_exact(width.max(1)).enumerate() {
            // Subtract the part of inverse dynamics that is not in Y π: the armature.
            let known: f64 = row.iter().zip(&self.prior).map(|(y, p)| y * p).sum();
            self.right.push(tau[i] - (self.tau[i] - known));
        }
        Ok(())
    }

    /// Returns the rows of all data: (nv · states) × (10 · bodies).
    #[must_use]
    pub fn regressor(&self) -> DMatrix<f64> {
        DMatrix::from_row_slice(self.right.len(), self.prior.len(), &self.rows)
    }

    /// Returns the parameters that explain the data and are nearest to those of the mechanism. `tolerance` as in
    /// [`Identifiable::of`](super::Identifiable::of): 1e-8 for exact data, larger for noisy data.
    ///
    /// # Errors
    /// [`CalibrationError::TooFew`].
    pub fn fit(&self, tolerance: f64) -> Result<InertialFit, CalibrationError> {
        let fit = fit(&self.regressor(), &self.right, &self.prior, tolerance)?;
        let body = |p: &[f64]| {
            let inertia = Mat3::new(p[4], p[5], p[6], p[5], p[7], p[8], p[6], p[8], p[9]);
            RigidInertia::from_moments(p[0], Vec3::new(p[1], p[2], p[3]), inertia).ok()
        };
        let inertias = fit.parameters.chunks_exact(PARAMETERS).map(body).collect();
        Ok(InertialFit { fit, inertias })
    }
}

impl InertialFit {
    /// Returns the bodies whose identified numbers are not physical.
    #[must_use]
    pub fn unphysical(&self, tree: &Tree) -> Vec<BodyId> {
        let ids = tree.multibody().body_ids().zip(&self.inertias);
        ids.filter(|(_, i)| i.is_none()).map(|(b, _)| b).collect()
    }
}

/// Returns the regressor at many random states, which are the same for equal seeds. With [`Identifiable::of`](super::Identifiable::of) and a
/// tolerance of 1e-8 it shows which inertial parameters any motion can identify.
///
/// # Errors
/// [`CalibrationError::Mechanism`] for flexible bodies.
pub fn structural_regressor(
    tree: &Tree,
    gravity: Vec3,
    seed: u64,
) -> Result<DMatrix<f64>, CalibrationError> {
    let mut data = InertialData::new(tree, gravity)?;
    let mbs = tree.multibody();
    // Use three times as many rows as parameters.
    let states = 3 * data.prior.len() / tree.nv().max(1) + 3;
    let zero = vec![0.0; tree.nv()];
    for k in 0..states as u64 {
        let at = seed.wrapping_mul(0x9E37_79B9).wrapping_add(3 * k);
        let (q, v, a) = (mbs.random_q(at), mbs.random_v(at + 1), mbs.random_v(at + 2));
        data.add(&q, &v, &a, &zero)?;
    }
    Ok(data.regressor())
}
