//! The algorithms with their inputs checked first: for numbers that come from outside.
//!
//! The kernels themselves assert lengths and let NaN through, since in a loop both are settled once.
//! These refuse wrong lengths, NaN, infinities and quaternions without a direction with an
//! [`InputError`], which the Python package shows with the same words.

use crate::error::{DynamicsError, InputError};
use crate::tree::Tree;
use crate::work::Workspace;
use linkwork_multibody::SubhingeKind;

/// Refuses a slice of another length than `want`, and numbers that are not finite.
///
/// # Errors
/// [`InputError::Length`], [`InputError::NotFinite`].
pub fn numbers(what: &str, values: &[f64], want: usize) -> Result<(), InputError> {
    length(what, values.len(), want)?;
    finite(what, values)
}

/// Refuses another length than `want`.
///
/// # Errors
/// [`InputError::Length`].
pub fn length(what: &str, got: usize, want: usize) -> Result<(), InputError> {
    if got == want { Ok(()) } else { Err(InputError::Length { what: what.into(), got, want }) }
}

/// Refuses numbers that are not finite.
///
/// # Errors
/// [`InputError::NotFinite`].
pub fn finite(what: &str, values: &[f64]) -> Result<(), InputError> {
    match values.iter().enumerate().find(|(_, x)| !x.is_finite()) {
        Some((place, value)) => {
            Err(InputError::NotFinite { what: what.into(), place, value: *value })
        }
        None => Ok(()),
    }
}

/// Refuses a configuration of the wrong length, with numbers that are not finite, or with a
/// quaternion of length zero.
///
/// # Errors
/// Every variant of [`InputError`] but [`InputError::Dynamics`].
pub fn configuration(tree: &Tree, q: &[f64]) -> Result<(), InputError> {
    numbers("q", q, tree.nq())?;
    for (_, s) in tree.multibody().subhinges() {
        if matches!(s.subhinge.kind, SubhingeKind::Ball | SubhingeKind::Free) {
            let place = s.q.end - 4;
            let norm = q[place..s.q.end].iter().map(|x| x * x).sum::<f64>().sqrt();
            if !(norm > 1e-100 && norm.is_finite()) {
                return Err(InputError::ZeroQuaternion { place });
            }
        }
    }
    Ok(())
}

/// [`kinematics`](crate::kinematics()) of checked numbers.
///
/// # Errors
/// [`InputError`] for what is wrong with `q` or `v`.
pub fn kinematics(tree: &Tree, ws: &mut Workspace, q: &[f64], v: &[f64]) -> Result<(), InputError> {
    configuration(tree, q)?;
    numbers("v", v, tree.nv())?;
    crate::kinematics(tree, ws, q, v);
    Ok(())
}

/// [`forward_dynamics`](crate::forward_dynamics) of checked numbers. At prescribed coordinates
/// `vdot` is read, at free ones `tau`: both must be finite everywhere.
///
/// # Errors
/// [`InputError`] for what is wrong with an input, or for a free subhinge with nothing to move.
pub fn forward_dynamics(
    tree: &Tree,
    ws: &mut Workspace,
    q: &[f64],
    v: &[f64],
    tau: &mut [f64],
    vdot: &mut [f64],
) -> Result<(), InputError> {
    numbers("tau", tau, tree.nv())?;
    numbers("vdot", vdot, tree.nv())?;
    kinematics(tree, ws, q, v)?;
    Ok(crate::forward_dynamics_given_kinematics(tree, ws, tau, vdot)?)
}

/// [`inverse_dynamics`](crate::inverse_dynamics) of checked numbers.
///
/// # Errors
/// [`InputError`] for what is wrong with an input.
pub fn inverse_dynamics(
    tree: &Tree,
    ws: &mut Workspace,
    q: &[f64],
    v: &[f64],
    vdot: &[f64],
    tau: &mut [f64],
) -> Result<(), InputError> {
    numbers("vdot", vdot, tree.nv())?;
    length("tau", tau.len(), tree.nv())?;
    kinematics(tree, ws, q, v)?;
    crate::inverse_dynamics_given_kinematics(tree, ws, vdot, tau);
    Ok(())
}

/// [`mass_matrix`](crate::mass_matrix) at a checked configuration.
///
/// # Errors
/// [`InputError`] for what is wrong with an input.
pub fn mass_matrix(
    tree: &Tree,
    ws: &mut Workspace,
    q: &[f64],
    out: &mut [f64],
) -> Result<(), InputError> {
    configuration(tree, q)?;
    length("mass matrix", out.len(), tree.nv() * tree.nv())?;
    crate::poses(tree, ws, q);
    crate::mass_matrix(tree, ws, out);
    Ok(())
}

/// [`inverse_mass_matrix`](crate::inverse_mass_matrix) at a checked configuration.
///
/// # Errors
/// [`InputError`] for what is wrong with an input, or for a free subhinge with nothing to move.
pub fn inverse_mass_matrix(
    tree: &Tree,
    ws: &mut Workspace,
    q: &[f64],
    out: &mut [f64],
) -> Result<(), InputError> {
    configuration(tree, q)?;
    length("inverse mass matrix", out.len(), tree.nv() * tree.nv())?;
    crate::poses(tree, ws, q);
    Ok(crate::inverse_mass_matrix(tree, ws, out)?)
}

impl From<DynamicsError> for InputError {
    fn from(e: DynamicsError) -> Self {
        Self::Dynamics(e)
    }
}
