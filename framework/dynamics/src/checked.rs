//! The algorithms with checks of their inputs, for numbers from outside of the program.
//!
//! The kernels only assert lengths and do not check for NaN, because in a simulation loop both need to be checked only once. The functions here
//! reject wrong lengths, NaN, infinities and quaternions of length zero with an [`InputError`]. The Python package shows the same message.

use crate::error::{DynamicsError, InputError};
use crate::tree::Tree;
use crate::work::Workspace;
use linkwork_multibody::SubhingeKind;

/// Checks that a slice has `want` numbers and that all are finite.
///
/// # Errors
/// [`InputError::Length`], [`InputError::NotFinite`].
pub fn numbers(what: &str, values: &[f64], want: usize) -> Result<(), InputError> {
    length(what, values.len(), want)?;
    finite(what, values)
}

/// Checks that a length is `want`.
///
/// # Errors
/// [`InputError::Length`].
pub fn length(what: &str, got: usize, want: usize) -> Result<(), InputError> {
    if got == want { Ok(()) } else { Err(InputError::Length { what: what.into(), got, want }) }
}

/// Checks that all numbers are finite.
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

/// Checks that a configuration has the right length, finite numbers, and no quaternion of length zero.
///
/// # Errors
/// All variants of [`InputError`] except [`InputError::Dynamics`].
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

/// [`kinematics`](crate::kinematics()) with checked inputs.
///
/// # Errors
/// [`InputError`] for invalid `q` or `v`.
pub fn kinematics(tree: &Tree, ws: &mut Workspace, q: &[f64], v: &[f64]) -> Result<(), InputError> {
    configuration(tree, q)?;
    numbers("v", v, tree.nv())?;
    crate::kinematics(tree, ws, q, v);
    Ok(())
}

/// [`forward_dynamics`](crate::forward_dynamics) with checked inputs. `vdot` is read at prescribed coordinates and `tau` at free ones, but both must
/// be finite everywhere.
///
/// # Errors
/// [`InputError`] for an invalid input, or for a free subhinge that moves no inertia.
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

/// [`inverse_dynamics`](crate::inverse_dynamics) with checked inputs.
///
/// # Errors
/// [`InputError`] for an invalid input.
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
/// [`InputError`] for an invalid input.
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
/// [`InputError`] for an invalid input, or for a free subhinge that moves no inertia.
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
