//! Work space of derivatives of accelerations.
#![allow(non_snake_case)]

use linkwork_dynamics::{Derivatives, Tree};
use linkwork_spatial::nalgebra::DMatrix;

/// Work space.
pub(crate) struct ForwardJacobian {
    /// `None` for flexible bodies, for which the kernels have no derivatives.
    pub(crate) derivatives: Option<Derivatives>,
    /// ∂v̇/∂q along v, ∂v̇/∂v, ∂v̇/∂τ: nv × nv, row by row.
    pub(crate) by_q: Vec<f64>,
    pub(crate) by_v: Vec<f64>,
    pub(crate) by_tau: Vec<f64>,
    /// Jacobian of a frame, 6 × nv, by rows.
    pub(crate) J: Vec<f64>,
    /// M⁻¹ Jᵀ, nv × 6.
    pub(crate) response: DMatrix<f64>,
    pub(crate) unit: Vec<f64>,
    pub(crate) rate: Vec<f64>,
}

impl ForwardJacobian {
    pub fn new(tree: &Tree, nq: usize) -> Self {
        let nv = tree.nv();
        let rigid = !tree.is_flexible();
        let square = vec![0.0; if rigid { nv * nv } else { 0 }];
        ForwardJacobian {
            derivatives: rigid.then(|| Derivatives::new(tree)),
            by_q: square.clone(),
            by_v: square.clone(),
            by_tau: square,
            J: vec![0.0; 6 * nv],
            response: DMatrix::zeros(nv, 6),
            unit: vec![0.0; nv],
            rate: vec![0.0; nq],
        }
    }
}
