//! The basic dynamics algorithms of `Mechanism`.
use crate::array::{Array, zeros};
use crate::batch::{Rows, ensemble_into, states, states_into};
use crate::mechanism::Mechanism;
use linkwork_dynamics::{self as dynamics, Ensemble};
use pyo3::prelude::*;
use pyo3::types::PyDict;

type ArrayLike<'a, 'py> = &'a Bound<'py, PyAny>;

#[pymethods]
impl Mechanism {
    /// Compute the generalized forces that produce given accelerations.
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
    ///     External wrenches [moment; force], N m and N, by node or body, about its origin, in world axes; the same for all rows.
    /// out : ndarray of float64, optional
    ///     Array that receives the result: of the result's shape, C-contiguous, and without memory in common with an argument. If the call
    ///     raises, it is not changed.
    /// threads : int
    ///     Number of threads that share the rows (default: 1).
    ///
    /// Returns
    /// -------
    /// ndarray, shape (nv,) or (n, nv)
    ///     Generalized forces, N m and N. The array is `out` if you passed one.
    ///
    /// Raises
    /// ------
    /// LinkworkError
    ///     If a frame does not exist, or an array has a wrong shape or contains NaN.
    ///
    /// Examples
    /// --------
    /// >>> arm.inverse_dynamics(q, v, [0, 0]).round(6).tolist()
    /// [4.331874, -1.530654]
    /// >>> arm.inverse_dynamics(q, v, np.zeros((5, 2))).shape
    /// (5, 2)
    #[pyo3(signature = (q, v, vdot, *, wrenches=None, out=None, threads=1))]
    fn inverse_dynamics<'py>(
        &self,
        py: Python<'py>,
        q: ArrayLike<'_, 'py>,
        v: ArrayLike<'_, 'py>,
        vdot: ArrayLike<'_, 'py>,
        wrenches: Option<&Bound<'py, PyDict>>,
        out: Option<ArrayLike<'_, 'py>>,
        threads: usize,
    ) -> PyResult<Array<'py>> {
        let (c, nv) = (&*self.core, self.core.nv());
        let rows = Rows::read(&[(q, c.nq(), "q"), (v, nv, "v"), (vdot, nv, "vdot")])?;
        let wrenches = c.wrenches(wrenches)?;
        let lanes = |e: &mut Ensemble, x: &[&[f64]], tau: &mut [Vec<f64>]| {
            e.inverse_dynamics(x[0], x[1], x[2], &mut tau[0]);
            Ok(())
        };
        if wrenches.is_empty()
            && let Some(many) = ensemble_into(py, c, &rows, threads, &[&[nv]], out, lanes)?
        {
            return only(many);
        }
        states_into(py, c, &rows, threads, &[nv], out, |tree, ws, x, tau| {
            c.load(ws, x[0], x[1], &wrenches);
            dynamics::inverse_dynamics_given_kinematics(tree, ws, x[2], tau);
            Ok(())
        })
    }

    /// Compute the accelerations that given generalized forces produce.
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
    ///     Accelerations of the prescribed coordinates, rad/s² and m/s² (default: zeros). The entries of tau for these coordinates are not read;
    ///     `mixed_dynamics` computes the forces there.
    /// wrenches : dict of str to array_like, shape (6,), optional
    ///     External wrenches [moment; force], N m and N, by node or body, about its origin, in world axes; the same for all rows.
    /// out : ndarray of float64, optional
    ///     Array for the result, as in `inverse_dynamics`.
    /// threads : int
    ///     Number of threads that share the rows (default: 1).
    ///
    /// Returns
    /// -------
    /// ndarray, shape (nv,) or (n, nv)
    ///     Accelerations, rad/s² and m/s².
    ///
    /// Raises
    /// ------
    /// LinkworkError
    ///     If a free coordinate moves no inertia, a frame does not exist, or an array has a wrong shape or contains NaN.
    ///
    /// Examples
    /// --------
    /// >>> tau = arm.inverse_dynamics(q, v, [1, 2])
    /// >>> arm.forward_dynamics(q, v, tau).round(9).tolist()
    /// [1.0, 2.0]
    #[pyo3(signature = (q, v, tau, *, prescribed=None, wrenches=None, out=None, threads=1))]
    fn forward_dynamics<'py>(
        &self,
        py: Python<'py>,
        q: ArrayLike<'_, 'py>,
        v: ArrayLike<'_, 'py>,
        tau: ArrayLike<'_, 'py>,
        prescribed: Option<ArrayLike<'_, 'py>>,
        wrenches: Option<&Bound<'py, PyDict>>,
        out: Option<ArrayLike<'_, 'py>>,
        threads: usize,
    ) -> PyResult<Array<'py>> {
        let (c, nv) = (&*self.core, self.core.nv());
        let zero;
        let vdot = match prescribed {
            Some(given) => given,
            None => {
                zero = crate::array::out1(py, vec![0.0; nv]).into_any();
                &zero
            }
        };
        let rows = [(q, c.nq(), "q"), (v, nv, "v"), (tau, nv, "tau"), (vdot, nv, "prescribed")];
        let rows = Rows::read(&rows)?;
        let wrenches = c.wrenches(wrenches)?;
        // The array is modified: the forces of prescribed coordinates are overwritten.
        let mut forces = zeros(rows.count(), nv)?;
        let lanes = |e: &mut Ensemble, x: &[&[f64]], vdot: &mut [Vec<f64>]| {
            vdot[0].copy_from_slice(x[3]);
            forces.copy_from_slice(x[2]);
            e.forward_dynamics(x[0], x[1], &mut forces, &mut vdot[0])
        };
        if wrenches.is_empty()
            && let Some(many) = ensemble_into(py, c, &rows, threads, &[&[nv]], out, lanes)?
        {
            return only(many);
        }
        states_into(py, c, &rows, threads, &[nv], out, |tree, ws, x, vdot| {
            c.load(ws, x[0], x[1], &wrenches);
            vdot.copy_from_slice(x[3]);
            dynamics::forward_dynamics_given_kinematics(tree, ws, &mut x[2].to_vec(), vdot)
        })
    }

    /// Compute accelerations of free coordinates and forces of prescribed coordinates in one solve.
    ///
    /// Parameters
    /// ----------
    /// q : array_like, shape (nq,) or (n, nq)
    ///     Configuration, or one per row. Angles in rad, displacements in m.
    /// v : array_like, shape (nv,) or (n, nv)
    ///     Rates, or one set per row, rad/s and m/s.
    /// tau : array_like, shape (nv,) or (n, nv)
    ///     Generalized forces, N m and N; read at free coordinates.
    /// vdot : array_like, shape (nv,) or (n, nv)
    ///     Accelerations, rad/s² and m/s²; read at prescribed coordinates.
    /// wrenches : dict of str to array_like, shape (6,), optional
    ///     External wrenches [moment; force], N m and N, by node or body, about its origin, in world axes; the same for all rows.
    /// threads : int
    ///     Number of threads that share the rows (default: 1).
    ///
    /// Returns
    /// -------
    /// vdot : ndarray, shape (nv,) or (n, nv)
    ///     Accelerations of all coordinates.
    /// tau : ndarray, shape (nv,) or (n, nv)
    ///     Generalized forces of all coordinates.
    ///
    /// Raises
    /// ------
    /// LinkworkError
    ///     If a free coordinate moves no inertia, a frame does not exist, or an array has a wrong shape or contains NaN.
    ///
    /// Examples
    /// --------
    /// >>> vdot, tau = arm.with_prescribed(["upper"]).mixed_dynamics(q, v, [0, 0], [1, 0])
    /// >>> float(vdot[0])
    /// 1.0
    #[pyo3(signature = (q, v, tau, vdot, *, wrenches=None, threads=1))]
    fn mixed_dynamics<'py>(
        &self,
        py: Python<'py>,
        q: ArrayLike<'_, 'py>,
        v: ArrayLike<'_, 'py>,
        tau: ArrayLike<'_, 'py>,
        vdot: ArrayLike<'_, 'py>,
        wrenches: Option<&Bound<'py, PyDict>>,
        threads: usize,
    ) -> PyResult<(Array<'py>, Array<'py>)> {
        let (c, nv) = (&*self.core, self.core.nv());
        let rows = [(q, c.nq(), "q"), (v, nv, "v"), (tau, nv, "tau"), (vdot, nv, "vdot")];
        let rows = Rows::read(&rows)?;
        let wrenches = c.wrenches(wrenches)?;
        let both = states(py, c, &rows, threads, &[2, nv], |tree, ws, x, out| {
            c.load(ws, x[0], x[1], &wrenches);
            let (vdot, tau) = out.split_at_mut(nv);
            tau.copy_from_slice(x[2]);
            vdot.copy_from_slice(x[3]);
            dynamics::forward_dynamics_given_kinematics(tree, ws, tau, vdot)
        })?;
        let half = |k: usize| -> PyResult<Array<'py>> {
            let at = (pyo3::types::PyEllipsis::get(py), k, pyo3::types::PySlice::full(py));
            Ok(both.get_item(at)?.cast_into()?)
        };
        Ok((half(0)?, half(1)?))
    }

    /// Compute the generalized forces for vdot = 0: gravity, Coriolis and centrifugal forces.
    ///
    /// Parameters
    /// ----------
    /// q : array_like, shape (nq,) or (n, nq)
    ///     Configuration, or one per row. Angles in rad, displacements in m.
    /// v : array_like, shape (nv,) or (n, nv)
    ///     Rates, or one set per row, rad/s and m/s.
    /// wrenches : dict of str to array_like, shape (6,), optional
    ///     External wrenches [moment; force], N m and N, by node or body, about its origin, in world axes; the same for all rows.
    /// threads : int
    ///     Number of threads that share the rows (default: 1).
    ///
    /// Returns
    /// -------
    /// ndarray, shape (nv,) or (n, nv)
    ///     Generalized forces, N m and N.
    ///
    /// Raises
    /// ------
    /// LinkworkError
    ///     If an array has a wrong shape or contains NaN.
    ///
    /// Examples
    /// --------
    /// >>> arm.bias_forces(q, [0, 0]).round(6).tolist()
    /// [4.270029, -1.528078]
    #[pyo3(signature = (q, v, *, wrenches=None, threads=1))]
    fn bias_forces<'py>(
        &self,
        py: Python<'py>,
        q: ArrayLike<'_, 'py>,
        v: ArrayLike<'_, 'py>,
        wrenches: Option<&Bound<'py, PyDict>>,
        threads: usize,
    ) -> PyResult<Array<'py>> {
        let zero = crate::array::out1(py, vec![0.0; self.core.nv()]).into_any();
        self.inverse_dynamics(py, q, v, &zero, wrenches, None, threads)
    }

    /// Compute the symmetric mass matrix, including the reflected inertia of rotors.
    ///
    /// Parameters
    /// ----------
    /// q : array_like, shape (nq,) or (n, nq)
    ///     Configuration, or one per row. Angles in rad, displacements in m.
    /// out : ndarray of float64, optional
    ///     Array for the result, as in `inverse_dynamics`.
    /// threads : int
    ///     Number of threads that share the rows (default: 1).
    ///
    /// Returns
    /// -------
    /// ndarray, shape (nv, nv) or (n, nv, nv)
    ///     The mass matrix, in kg m², kg m and kg, depending on the coordinates of row and column.
    ///
    /// Raises
    /// ------
    /// LinkworkError
    ///     If an array has a wrong shape or contains NaN.
    ///
    /// Examples
    /// --------
    /// >>> M = arm.mass_matrix(q)
    /// >>> M.shape, bool((M == M.T).all())
    /// ((2, 2), True)
    #[pyo3(signature = (q, *, out=None, threads=1))]
    fn mass_matrix<'py>(
        &self,
        py: Python<'py>,
        q: ArrayLike<'_, 'py>,
        out: Option<ArrayLike<'_, 'py>>,
        threads: usize,
    ) -> PyResult<Array<'py>> {
        let (c, nv) = (&*self.core, self.core.nv());
        let rows = Rows::read(&[(q, c.nq(), "q")])?;
        let lanes = |e: &mut Ensemble, x: &[&[f64]], to: &mut [Vec<f64>]| {
            e.mass_matrix(x[0], &mut to[0]);
            Ok(())
        };
        if let Some(many) = ensemble_into(py, c, &rows, threads, &[&[nv, nv]], out, lanes)? {
            return only(many);
        }
        states_into(py, c, &rows, threads, &[nv, nv], out, |tree, ws, x, to| {
            dynamics::poses(tree, ws, x[0]);
            dynamics::mass_matrix(tree, ws, to);
            Ok(())
        })
    }
}

/// Returns the only result of an ensemble's call.
pub fn only(results: Vec<Array<'_>>) -> PyResult<Array<'_>> {
    results.into_iter().next().ok_or_else(|| crate::error::refuse("there is no result"))
}
