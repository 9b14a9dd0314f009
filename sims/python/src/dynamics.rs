//! The algorithms of `Mechanism`: each under its own name, from q, v and what else it needs.
use crate::array::{Array, zeros};
use crate::batch::{Rows, ensemble_into, states, states_into};
use crate::mechanism::Mechanism;
use linkwork_dynamics::{self as dynamics, Ensemble};
use pyo3::prelude::*;
use pyo3::types::PyDict;

type Given<'a, 'py> = &'a Bound<'py, PyAny>;

#[pymethods]
impl Mechanism {
    /// Forces tau (nv,) that produce the accelerations vdot (nv,) at q, v; or many.
    ///
    /// wrenches: {frame: (6,)}, moment about the frame's origin (N m) and force (N), world axes,
    /// the same for all states. threads: for many states. out: an array of float64 for the result, of its shape, contiguous, of no memory
    /// that the arguments have; it is filled and returned. Where the call raises it stays as it is.
    /// Raises LinkworkError for another shape, for NaN, and for frames that are not there.
    ///
    /// >>> arm.inverse_dynamics(q, v, [0, 0]).round(6).tolist()
    /// [4.331874, -1.530654]
    /// >>> arm.inverse_dynamics(q, v, np.zeros((5, 2))).shape
    /// (5, 2)
    #[pyo3(signature = (q, v, vdot, *, wrenches=None, out=None, threads=1))]
    fn inverse_dynamics<'py>(
        &self,
        py: Python<'py>,
        q: Given<'_, 'py>,
        v: Given<'_, 'py>,
        vdot: Given<'_, 'py>,
        wrenches: Option<&Bound<'py, PyDict>>,
        out: Option<Given<'_, 'py>>,
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

    /// Accelerations vdot (nv,) from the forces tau (nv,) at q, v; or many. Accelerations in rad/s² and m/s². Forces in N m and N, by coordinate.
    ///
    /// prescribed (nv,): accelerations of the coordinates that are prescribed, zero when left out;
    /// their tau is not read (`mixed_dynamics` finds it). wrenches, threads, out: as in
    /// inverse_dynamics. Raises LinkworkError when a free coordinate moves nothing with inertia.
    ///
    /// >>> tau = arm.inverse_dynamics(q, v, [1, 2])
    /// >>> arm.forward_dynamics(q, v, tau).round(9).tolist()
    /// [1.0, 2.0]
    #[pyo3(signature = (q, v, tau, *, prescribed=None, wrenches=None, out=None, threads=1))]
    fn forward_dynamics<'py>(
        &self,
        py: Python<'py>,
        q: Given<'_, 'py>,
        v: Given<'_, 'py>,
        tau: Given<'_, 'py>,
        prescribed: Option<Given<'_, 'py>>,
        wrenches: Option<&Bound<'py, PyDict>>,
        out: Option<Given<'_, 'py>>,
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
        // Forces of prescribed coordinates are written to.
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

    /// Accelerations and forces, (vdot, tau), each (nv,) or many: at free coordinates tau is given
    /// and vdot found, at prescribed ones vdot is given and tau found. Accelerations in rad/s² and m/s². Forces in N m and N, by coordinate.
    /// Raises LinkworkError for another shape and for NaN.
    ///
    /// >>> vdot, tau = arm.with_prescribed(["upper"]).mixed_dynamics(q, v, [0, 0], [1, 0])
    /// >>> float(vdot[0])
    /// 1.0
    #[pyo3(signature = (q, v, tau, vdot, *, wrenches=None, threads=1))]
    fn mixed_dynamics<'py>(
        &self,
        py: Python<'py>,
        q: Given<'_, 'py>,
        v: Given<'_, 'py>,
        tau: Given<'_, 'py>,
        vdot: Given<'_, 'py>,
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

    /// Forces (nv,) that hold the motion with vdot = 0, or many: gravity, Coriolis, centrifugal. Forces in N m and N, by coordinate.
    /// Raises LinkworkError for another shape and for NaN.
    ///
    /// >>> arm.bias_forces(q, [0, 0]).round(6).tolist()
    /// [4.270029, -1.528078]
    #[pyo3(signature = (q, v, *, wrenches=None, threads=1))]
    fn bias_forces<'py>(
        &self,
        py: Python<'py>,
        q: Given<'_, 'py>,
        v: Given<'_, 'py>,
        wrenches: Option<&Bound<'py, PyDict>>,
        threads: usize,
    ) -> PyResult<Array<'py>> {
        let zero = crate::array::out1(py, vec![0.0; self.core.nv()]).into_any();
        self.inverse_dynamics(py, q, v, &zero, wrenches, None, threads)
    }

    /// Mass matrix (nv, nv) at q, or many: symmetric, armature included. out: as in inverse_dynamics. Entries in kg m², kg m and kg, by the coordinates of row and column.
    /// Raises LinkworkError for another shape and for NaN.
    ///
    /// >>> M = arm.mass_matrix(q)
    /// >>> M.shape, bool((M == M.T).all())
    /// ((2, 2), True)
    #[pyo3(signature = (q, *, out=None, threads=1))]
    fn mass_matrix<'py>(
        &self,
        py: Python<'py>,
        q: Given<'_, 'py>,
        out: Option<Given<'_, 'py>>,
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

/// The only result of an ensemble's call.
pub fn only(results: Vec<Array<'_>>) -> PyResult<Array<'_>> {
    results.into_iter().next().ok_or_else(|| crate::error::refuse("there is no result"))
}
