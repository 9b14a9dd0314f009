//! Derivatives of inverse and forward dynamics, and the regressor of inertial parameters.
use crate::array::{Array, Array1, out1, zeros};
use crate::batch::{Rows, ensemble, states};
use crate::error::refuse;
use crate::mechanism::Mechanism;
use linkwork_dynamics::{self as dynamics, Ensemble, ForwardDerivatives, PARAMETERS};
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyEllipsis, PySlice};

type ArrayLike<'a, 'py> = &'a Bound<'py, PyAny>;

/// Splits an array of several matrices into the individual matrices.
fn parts<'py, const N: usize>(all: &Array<'py>) -> PyResult<[Array<'py>; N]> {
    let py = all.py();
    let part = |k: usize| {
        let at = (PyEllipsis::get(py), k, PySlice::full(py), PySlice::full(py));
        Ok(all.get_item(at)?.cast_into()?)
    };
    all_of((0..N).map(part).collect::<PyResult<_>>()?)
}

/// Converts the results to an array of `N` results.
fn all_of<const N: usize>(found: Vec<Array<'_>>) -> PyResult<[Array<'_>; N]> {
    found.try_into().map_err(|_| refuse("a result is missing"))
}

#[pymethods]
impl Mechanism {
    /// Compute the derivatives of `inverse_dynamics` with respect to q and v.
    ///
    /// The derivative with respect to vdot is the mass matrix.
    ///
    /// Parameters
    /// ----------
    /// q : array_like, shape (nq,) or (n, nq)
    ///     Configuration, or one per row. Angles in rad, displacements in m.
    /// v : array_like, shape (nv,) or (n, nv)
    ///     Rates, or one set per row, rad/s and m/s.
    /// vdot : array_like, shape (nv,) or (n, nv)
    ///     Accelerations, rad/s² and m/s².
    /// wrenches : dict of str to array_like, shape (6,), optional
    ///     As in `inverse_dynamics`. Each wrench is constant in the axes of its body.
    /// threads : int
    ///     Number of threads that share the rows (default: 1).
    ///
    /// Returns
    /// -------
    /// dtau_dq : ndarray, shape (nv, nv) or (n, nv, nv)
    ///     Derivatives of the forces (rows) along the directions in which `integrate` moves q (columns), N m and N per rad and m. The matrix is
    ///     square for ball and free hinges, too.
    /// dtau_dv : ndarray, shape (nv, nv) or (n, nv, nv)
    ///     Derivatives with respect to v.
    ///
    /// Raises
    /// ------
    /// LinkworkError
    ///     If the mechanism has flexible bodies, a name does not exist, or an array has a wrong shape or contains NaN.
    ///
    /// Examples
    /// --------
    /// >>> dq, dv = arm.inverse_dynamics_derivatives(q, v, [1, 2])
    /// >>> dq.shape, dv.shape
    /// ((2, 2), (2, 2))
    #[pyo3(signature = (q, v, vdot, *, wrenches=None, threads=1))]
    fn inverse_dynamics_derivatives<'py>(
        &self,
        py: Python<'py>,
        q: ArrayLike<'_, 'py>,
        v: ArrayLike<'_, 'py>,
        vdot: ArrayLike<'_, 'py>,
        wrenches: Option<&Bound<'py, PyDict>>,
        threads: usize,
    ) -> PyResult<(Array<'py>, Array<'py>)> {
        let (c, nv) = (&*self.core, self.core.nv());
        c.tree.check_rigid("derivatives").map_err(refuse)?;
        let rows = Rows::read(&[(q, c.nq(), "q"), (v, nv, "v"), (vdot, nv, "vdot")])?;
        let wrenches = c.wrenches(wrenches)?;
        let lanes = |e: &mut Ensemble, x: &[&[f64]], out: &mut [Vec<f64>]| {
            let [by_q, by_v] = out else { return Ok(()) };
            e.inverse_dynamics_derivatives(x[0], x[1], x[2], by_q, by_v);
            Ok(())
        };
        let each: &[usize] = &[nv, nv];
        if wrenches.is_empty()
            && let Some(many) = ensemble(py, c, &rows, threads, &[each, each], lanes)?
        {
            let [by_q, by_v] = all_of(many)?;
            return Ok((by_q, by_v));
        }
        let both = states(py, c, &rows, threads, &[2, nv, nv], |tree, ws, x, out| {
            c.load(ws, x[0], x[1], &wrenches);
            let (by_q, by_v) = out.split_at_mut(nv * nv);
            c.with_derivatives(|d| d.inverse_dynamics(tree, ws, x[1], x[2], by_q, by_v));
            Ok(())
        })?;
        parts(&both).map(|[by_q, by_v]| (by_q, by_v))
    }

    /// Compute the derivatives of `forward_dynamics` with respect to q, v and tau.
    ///
    /// Rows of prescribed coordinates are zero.
    ///
    /// Parameters
    /// ----------
    /// q : array_like, shape (nq,) or (n, nq)
    ///     Configuration, or one per row. Angles in rad, displacements in m.
    /// v : array_like, shape (nv,) or (n, nv)
    ///     Rates, or one set per row, rad/s and m/s.
    /// tau : array_like, shape (nv,) or (n, nv)
    ///     Generalized forces, N m and N.
    /// prescribed : array_like, shape (nv,), optional
    ///     As in `forward_dynamics`.
    /// wrenches : dict of str to array_like, shape (6,), optional
    ///     As in `inverse_dynamics_derivatives`.
    /// threads : int
    ///     Number of threads that share the rows (default: 1).
    ///
    /// Returns
    /// -------
    /// dvdot_dq : ndarray, shape (nv, nv) or (n, nv, nv)
    ///     Derivatives of the accelerations (rows) along the directions in which `integrate` moves q (columns), rad/s² and m/s² per rad and m.
    /// dvdot_dv : ndarray, shape (nv, nv) or (n, nv, nv)
    ///     Derivatives with respect to v.
    /// dvdot_dtau : ndarray, shape (nv, nv) or (n, nv, nv)
    ///     Derivatives with respect to tau.
    ///
    /// Raises
    /// ------
    /// LinkworkError
    ///     If the mechanism has flexible bodies, a name does not exist, or an array has a wrong shape or contains NaN.
    ///
    /// Examples
    /// --------
    /// >>> dq, dv, dtau = arm.forward_dynamics_derivatives(q, v, [1, 2])
    /// >>> bool(np.allclose(dtau, arm.inverse_mass_matrix(q)))
    /// True
    #[pyo3(signature = (q, v, tau, *, prescribed=None, wrenches=None, threads=1))]
    fn forward_dynamics_derivatives<'py>(
        &self,
        py: Python<'py>,
        q: ArrayLike<'_, 'py>,
        v: ArrayLike<'_, 'py>,
        tau: ArrayLike<'_, 'py>,
        prescribed: Option<ArrayLike<'_, 'py>>,
        wrenches: Option<&Bound<'py, PyDict>>,
        threads: usize,
    ) -> PyResult<(Array<'py>, Array<'py>, Array<'py>)> {
        let (c, nv) = (&*self.core, self.core.nv());
        let zero = out1(py, vec![0.0; nv]).into_any();
        let vdot = prescribed.unwrap_or(&zero);
        let rows = [(q, c.nq(), "q"), (v, nv, "v"), (tau, nv, "tau"), (vdot, nv, "prescribed")];
        let rows = Rows::read(&rows)?;
        let wrenches = c.wrenches(wrenches)?;
        // The arrays are modified: the entries of prescribed coordinates are overwritten.
        let (mut forces, mut rates) = (zeros(rows.count(), nv)?, zeros(rows.count(), nv)?);
        let lanes = |e: &mut Ensemble, x: &[&[f64]], out: &mut [Vec<f64>]| {
            let [dvdot_dq, dvdot_dv, dvdot_dtau] = out else { return Ok(()) };
            let out = ForwardDerivatives { dvdot_dq, dvdot_dv, dvdot_dtau };
            forces.copy_from_slice(x[2]);
            rates.copy_from_slice(x[3]);
            e.forward_dynamics_derivatives(x[0], x[1], &mut forces, &mut rates, out)
        };
        let each: &[usize] = &[nv, nv];
        if wrenches.is_empty()
            && let Some(many) = ensemble(py, c, &rows, threads, &[each, each, each], lanes)?
        {
            let [by_q, by_v, by_tau] = all_of(many)?;
            return Ok((by_q, by_v, by_tau));
        }
        let all = states(py, c, &rows, threads, &[3, nv, nv], |tree, ws, x, out| {
            c.load(ws, x[0], x[1], &wrenches);
            let (dvdot_dq, rest) = out.split_at_mut(nv * nv);
            let (dvdot_dv, dvdot_dtau) = rest.split_at_mut(nv * nv);
            let out = ForwardDerivatives { dvdot_dq, dvdot_dv, dvdot_dtau };
            let (mut tau, mut vdot) = (x[2].to_vec(), x[3].to_vec());
            c.with_derivatives(|d| d.forward_dynamics(tree, ws, x[1], &mut tau, &mut vdot, out))
        })?;
        parts(&all).map(|[by_q, by_v, by_tau]| (by_q, by_v, by_tau))
    }

    /// Compute the regressor of the inertial parameters.
    ///
    /// Its product with `inertial_parameters()` equals the forces of `inverse_dynamics` without external wrenches and without the inertia of rotors.
    ///
    /// Parameters
    /// ----------
    /// q : array_like, shape (nq,) or (n, nq)
    ///     Configuration, or one per row. Angles in rad, displacements in m.
    /// v : array_like, shape (nv,) or (n, nv)
    ///     Rates, or one set per row, rad/s and m/s.
    /// vdot : array_like, shape (nv,) or (n, nv)
    ///     Accelerations, rad/s² and m/s².
    /// threads : int
    ///     Number of threads that share the rows (default: 1).
    ///
    /// Returns
    /// -------
    /// ndarray, shape (nv, 10·bodies) or (n, nv, 10·bodies)
    ///     N m and N per unit of the parameters (kg, kg m, kg m²).
    ///
    /// Raises
    /// ------
    /// LinkworkError
    ///     If the mechanism has flexible bodies, or an array has a wrong shape or contains NaN.
    ///
    /// Examples
    /// --------
    /// >>> Y = arm.regressor(q, v, [1, 2])
    /// >>> bool(np.allclose(Y @ arm.inertial_parameters(), arm.inverse_dynamics(q, v, [1, 2])))
    /// True
    #[pyo3(signature = (q, v, vdot, *, threads=1))]
    fn regressor<'py>(
        &self,
        py: Python<'py>,
        q: ArrayLike<'_, 'py>,
        v: ArrayLike<'_, 'py>,
        vdot: ArrayLike<'_, 'py>,
        threads: usize,
    ) -> PyResult<Array<'py>> {
        let (c, nv) = (&*self.core, self.core.nv());
        c.tree.check_rigid("regressor").map_err(refuse)?;
        let rows = Rows::read(&[(q, c.nq(), "q"), (v, nv, "v"), (vdot, nv, "vdot")])?;
        let width = PARAMETERS * c.mbs.bodies().len();
        states(py, c, &rows, threads, &[nv, width], |tree, ws, x, out| {
            c.load(ws, x[0], x[1], &[]);
            dynamics::inverse_dynamics_given_kinematics(tree, ws, x[2], &mut vec![0.0; nv]);
            dynamics::regressor(tree, ws, out);
            Ok(())
        })
    }

    /// Return the inertial parameters of all bodies, in the order of `bodies`.
    ///
    /// Ten numbers per body, in body axes: mass (kg), first moment m c (three numbers, kg m), inertia about the body's origin (xx, xy, xz, yy, yz,
    /// zz; kg m²).
    ///
    /// Returns
    /// -------
    /// ndarray, shape (10·bodies,)
    ///     The parameters.
    ///
    /// Raises
    /// ------
    /// LinkworkError
    ///     If the mechanism has flexible bodies, which have further parameters.
    ///
    /// Examples
    /// --------
    /// >>> arm.inertial_parameters()[:4].tolist()
    /// [2.0, 0.0, 0.0, -1.0]
    fn inertial_parameters<'py>(&self, py: Python<'py>) -> PyResult<Array1<'py>> {
        self.core.tree.check_rigid("inertial parameters").map_err(refuse)?;
        let of = |b: &linkwork_multibody::Body| dynamics::inertial_parameters(b.inertia());
        Ok(out1(py, self.core.mbs.bodies().iter().flat_map(of).collect()))
    }
}
