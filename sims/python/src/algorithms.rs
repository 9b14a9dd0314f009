//! More algorithms of `Mechanism`: inverse of the mass matrix, Jacobians, centroidal quantities,
//! compliance.
use crate::array::{Array, wrench};
use crate::batch::{Rows, ensemble, ensemble_into, states, states_into};
use crate::dynamics::only;
use crate::mechanism::Mechanism;
use linkwork_dynamics::{self as dynamics, Ensemble};
use pyo3::prelude::*;

type ArrayLike<'a, 'py> = &'a Bound<'py, PyAny>;

#[pymethods]
impl Mechanism {
    /// Compute the inverse of the mass matrix.
    ///
    /// Only free coordinates are inverted: rows and columns of prescribed coordinates are zero.
    ///
    /// Parameters
    /// ----------
    /// q : array_like, shape (nq,) or (n, nq)
    ///     Configuration, or one per row. Angles in rad, displacements in m.
    /// threads : int
    ///     Number of threads that share the rows (default: 1).
    ///
    /// Returns
    /// -------
    /// ndarray, shape (nv, nv) or (n, nv, nv)
    ///     The inverse, in 1/(kg m²), 1/(kg m) and 1/kg, depending on the coordinates of row and column.
    ///
    /// Raises
    /// ------
    /// LinkworkError
    ///     If an array has a wrong shape or contains NaN.
    ///
    /// Examples
    /// --------
    /// >>> (arm.inverse_mass_matrix(q) @ arm.mass_matrix(q)).round(9).tolist()
    /// [[1.0, 0.0], [-0.0, 1.0]]
    #[pyo3(signature = (q, *, threads=1))]
    fn inverse_mass_matrix<'py>(
        &self,
        py: Python<'py>,
        q: ArrayLike<'_, 'py>,
        threads: usize,
    ) -> PyResult<Array<'py>> {
        let (c, nv) = (&*self.core, self.core.nv());
        let rows = Rows::read(&[(q, c.nq(), "q")])?;
        let lanes = |e: &mut Ensemble, x: &[&[f64]], out: &mut [Vec<f64>]| {
            e.inverse_mass_matrix(x[0], &mut out[0])
        };
        if let Some(many) = ensemble(py, c, &rows, threads, &[&[nv, nv]], lanes)? {
            return only(many);
        }
        states(py, c, &rows, threads, &[nv, nv], |tree, ws, x, out| {
            dynamics::poses(tree, ws, x[0]);
            dynamics::inverse_mass_matrix(tree, ws, out)
        })
    }

    /// Compute the product of the inverse mass matrix and a vector in O(nv), without forming the matrix.
    ///
    /// Parameters
    /// ----------
    /// q : array_like, shape (nq,) or (n, nq)
    ///     Configuration, rad and m, or one per row.
    /// x : array_like, shape (nv,) or (n, nv)
    ///     The vector, for example forces, N m and N.
    /// threads : int
    ///     Number of threads that share the rows (default: 1).
    ///
    /// Returns
    /// -------
    /// ndarray, shape (nv,) or (n, nv)
    ///     The product; accelerations, rad/s² and m/s², if x are forces.
    ///
    /// Raises
    /// ------
    /// LinkworkError
    ///     If an array has a wrong shape or contains NaN.
    ///
    /// Examples
    /// --------
    /// >>> arm.apply_inverse_mass(q, arm.mass_matrix(q) @ v).round(9).tolist()
    /// [0.1, 0.4]
    #[pyo3(signature = (q, x, *, threads=1))]
    fn apply_inverse_mass<'py>(
        &self,
        py: Python<'py>,
        q: ArrayLike<'_, 'py>,
        x: ArrayLike<'_, 'py>,
        threads: usize,
    ) -> PyResult<Array<'py>> {
        let (c, nv) = (&*self.core, self.core.nv());
        let rows = Rows::read(&[(q, c.nq(), "q"), (x, nv, "x")])?;
        states(py, c, &rows, threads, &[nv], |tree, ws, x, out| {
            dynamics::poses(tree, ws, x[0]);
            out.copy_from_slice(x[1]);
            dynamics::apply_inverse_mass(tree, ws, out)
        })
    }

    /// Compute the Jacobian of a frame: rates v to the velocity [ω; v] of the frame's origin, in world axes.
    ///
    /// Parameters
    /// ----------
    /// q : array_like, shape (nq,) or (n, nq)
    ///     Configuration, or one per row. Angles in rad, displacements in m.
    /// frame : str
    ///     Name of a node or a body.
    /// out : ndarray of float64, optional
    ///     Array for the result, as in `inverse_dynamics`.
    /// threads : int
    ///     Number of threads that share the rows (default: 1).
    ///
    /// Returns
    /// -------
    /// ndarray, shape (6, nv) or (n, 6, nv)
    ///     The Jacobian. Velocities are in rad/s and m/s.
    ///
    /// Raises
    /// ------
    /// LinkworkError
    ///     If a name does not exist, or an array has a wrong shape or contains NaN.
    ///
    /// Examples
    /// --------
    /// >>> J = arm.node_jacobian(q, "tip")
    /// >>> J.shape, bool(np.allclose(J @ v, arm.state(q, v).velocity("tip")))
    /// ((6, 2), True)
    #[pyo3(signature = (q, frame, *, out=None, threads=1))]
    fn node_jacobian<'py>(
        &self,
        py: Python<'py>,
        q: ArrayLike<'_, 'py>,
        frame: &str,
        out: Option<ArrayLike<'_, 'py>>,
        threads: usize,
    ) -> PyResult<Array<'py>> {
        let (c, node) = (&*self.core, self.core.frame(frame)?);
        let rows = Rows::read(&[(q, c.nq(), "q")])?;
        let lanes = |e: &mut Ensemble, x: &[&[f64]], to: &mut [Vec<f64>]| {
            e.node_jacobian(x[0], node, &mut to[0]);
            Ok(())
        };
        if let Some(many) = ensemble_into(py, c, &rows, threads, &[&[6, c.nv()]], out, lanes)? {
            return only(many);
        }
        states_into(py, c, &rows, threads, &[6, c.nv()], out, |tree, ws, x, to| {
            dynamics::poses(tree, ws, x[0]);
            dynamics::node_jacobian(tree, ws, node, to);
            Ok(())
        })
    }

    /// Compute the time derivative of the Jacobian of a frame.
    ///
    /// Parameters
    /// ----------
    /// q : array_like, shape (nq,) or (n, nq)
    ///     Configuration, or one per row. Angles in rad, displacements in m.
    /// v : array_like, shape (nv,) or (n, nv)
    ///     Rates, or one set per row, rad/s and m/s.
    /// frame : str
    ///     Name of a node or a body.
    /// threads : int
    ///     Number of threads that share the rows (default: 1).
    ///
    /// Returns
    /// -------
    /// ndarray, shape (6, nv) or (n, 6, nv)
    ///     Derivative of `node_jacobian`, in 1/s times its units (rad and m per unit of the coordinate).
    ///
    /// Raises
    /// ------
    /// LinkworkError
    ///     If a name does not exist, or an array has a wrong shape or contains NaN.
    ///
    /// Examples
    /// --------
    /// >>> dJ = arm.node_jacobian_rate(q, v, "tip")
    /// >>> bool(np.allclose(dJ @ v, arm.state(q, v).bias_acceleration("tip")))
    /// True
    #[pyo3(signature = (q, v, frame, *, threads=1))]
    fn node_jacobian_rate<'py>(
        &self,
        py: Python<'py>,
        q: ArrayLike<'_, 'py>,
        v: ArrayLike<'_, 'py>,
        frame: &str,
        threads: usize,
    ) -> PyResult<Array<'py>> {
        let (c, node) = (&*self.core, self.core.frame(frame)?);
        let rows = Rows::read(&[(q, c.nq(), "q"), (v, c.nv(), "v")])?;
        states(py, c, &rows, threads, &[6, c.nv()], |tree, ws, x, out| {
            dynamics::kinematics(tree, ws, x[0], x[1]);
            dynamics::node_jacobian_rate(tree, ws, node, out);
            Ok(())
        })
    }

    /// Compute the generalized forces Jᵀ f that are equivalent to a wrench f on a frame.
    ///
    /// Parameters
    /// ----------
    /// q : array_like, shape (nq,) or (n, nq)
    ///     Configuration, or one per row. Angles in rad, displacements in m.
    /// frame : str
    ///     Name of a node or a body.
    /// wrench : array_like, shape (6,)
    ///     [moment; force], N m and N, about the frame's origin, in world axes.
    /// threads : int
    ///     Number of threads that share the rows (default: 1).
    ///
    /// Returns
    /// -------
    /// ndarray, shape (nv,) or (n, nv)
    ///     Generalized forces, N m or N.
    ///
    /// Raises
    /// ------
    /// LinkworkError
    ///     If a name does not exist, or an array has a wrong shape or contains NaN.
    ///
    /// Examples
    /// --------
    /// >>> arm.node_jacobian_transpose_product(q, "tip", [0, 0, 0, 10, 0, 0]).round(6).tolist()
    /// [-16.921853, -7.368488]
    #[pyo3(signature = (q, frame, wrench, *, threads=1))]
    fn node_jacobian_transpose_product<'py>(
        &self,
        py: Python<'py>,
        q: ArrayLike<'_, 'py>,
        frame: &str,
        wrench: ArrayLike<'_, 'py>,
        threads: usize,
    ) -> PyResult<Array<'py>> {
        let (c, node) = (&*self.core, self.core.frame(frame)?);
        let f = self::wrench(wrench, "wrench")?;
        let rows = Rows::read(&[(q, c.nq(), "q")])?;
        states(py, c, &rows, threads, &[c.nv()], |tree, ws, x, out| {
            dynamics::poses(tree, ws, x[0]);
            dynamics::node_jacobian_transpose_product(tree, ws, node, &f, out);
            Ok(())
        })
    }

    /// Compute the centroidal momentum matrix: rates v to momentum.
    ///
    /// Parameters
    /// ----------
    /// q : array_like, shape (nq,) or (n, nq)
    ///     Configuration, or one per row. Angles in rad, displacements in m.
    /// threads : int
    ///     Number of threads that share the rows (default: 1).
    ///
    /// Returns
    /// -------
    /// ndarray, shape (6, nv) or (n, 6, nv)
    ///     The matrix. Its product with v is the momentum in world axes: angular about the centre of mass, kg m²/s, then linear, kg m/s.
    ///
    /// Raises
    /// ------
    /// LinkworkError
    ///     If an array has a wrong shape or contains NaN.
    ///
    /// Examples
    /// --------
    /// >>> A = arm.centroidal_matrix(q)
    /// >>> A.shape, bool(np.allclose(A @ v, arm.state(q, v).momentum()))
    /// ((6, 2), True)
    #[pyo3(signature = (q, *, threads=1))]
    fn centroidal_matrix<'py>(
        &self,
        py: Python<'py>,
        q: ArrayLike<'_, 'py>,
        threads: usize,
    ) -> PyResult<Array<'py>> {
        let c = &*self.core;
        let rows = Rows::read(&[(q, c.nq(), "q")])?;
        let lanes = |e: &mut Ensemble, x: &[&[f64]], out: &mut [Vec<f64>]| {
            e.centroidal_matrix(x[0], &mut out[0]);
            Ok(())
        };
        if let Some(many) = ensemble(py, c, &rows, threads, &[&[6, c.nv()]], lanes)? {
            return only(many);
        }
        states(py, c, &rows, threads, &[6, c.nv()], |tree, ws, x, out| {
            dynamics::poses(tree, ws, x[0]);
            dynamics::centroidal_matrix(tree, ws, out);
            Ok(())
        })
    }

    /// Compute the rate of change of the centroidal momentum for vdot = 0.
    ///
    /// Parameters
    /// ----------
    /// q : array_like, shape (nq,) or (n, nq)
    ///     Configuration, or one per row. Angles in rad, displacements in m.
    /// v : array_like, shape (nv,) or (n, nv)
    ///     Rates, or one set per row, rad/s and m/s.
    /// threads : int
    ///     Number of threads that share the rows (default: 1).
    ///
    /// Returns
    /// -------
    /// ndarray, shape (6,) or (n, 6)
    ///     Rate of the angular momentum about the centre of mass, N m, then of the linear momentum, N, in world axes.
    ///
    /// Raises
    /// ------
    /// LinkworkError
    ///     If an array has a wrong shape or contains NaN.
    ///
    /// Examples
    /// --------
    /// >>> arm.centroidal_bias(q, v).shape
    /// (6,)
    #[pyo3(signature = (q, v, *, threads=1))]
    fn centroidal_bias<'py>(
        &self,
        py: Python<'py>,
        q: ArrayLike<'_, 'py>,
        v: ArrayLike<'_, 'py>,
        threads: usize,
    ) -> PyResult<Array<'py>> {
        let c = &*self.core;
        let rows = Rows::read(&[(q, c.nq(), "q"), (v, c.nv(), "v")])?;
        states(py, c, &rows, threads, &[6], |tree, ws, x, out| {
            dynamics::kinematics(tree, ws, x[0], x[1]);
            let f = dynamics::centroidal_bias(tree, ws);
            out[..3].copy_from_slice(f.moment.as_slice());
            out[3..].copy_from_slice(f.force.as_slice());
            Ok(())
        })
    }

    /// Compute the Jacobian of the centre of mass: rates v to its velocity.
    ///
    /// Parameters
    /// ----------
    /// q : array_like, shape (nq,) or (n, nq)
    ///     Configuration, or one per row. Angles in rad, displacements in m.
    /// threads : int
    ///     Number of threads that share the rows (default: 1).
    ///
    /// Returns
    /// -------
    /// ndarray, shape (3, nv) or (n, 3, nv)
    ///     The Jacobian in world axes, m per unit of the coordinate.
    ///
    /// Raises
    /// ------
    /// LinkworkError
    ///     If an array has a wrong shape or contains NaN.
    ///
    /// Examples
    /// --------
    /// >>> bool(np.allclose(arm.com_jacobian(q) @ v, arm.state(q, v).com_velocity()))
    /// True
    #[pyo3(signature = (q, *, threads=1))]
    fn com_jacobian<'py>(
        &self,
        py: Python<'py>,
        q: ArrayLike<'_, 'py>,
        threads: usize,
    ) -> PyResult<Array<'py>> {
        let c = &*self.core;
        let rows = Rows::read(&[(q, c.nq(), "q")])?;
        states(py, c, &rows, threads, &[3, c.nv()], |tree, ws, x, out| {
            dynamics::poses(tree, ws, x[0]);
            dynamics::com_jacobian(tree, ws, out);
            Ok(())
        })
    }

    /// Compute the operational-space compliance J M⁻¹ Jᵀ of several frames, including the coupling between them.
    ///
    /// Each column contains the accelerations [α; a] of all frames for a unit wrench [moment; force] on one of them, in world axes. Prescribed
    /// coordinates do not accelerate.
    ///
    /// Parameters
    /// ----------
    /// q : array_like, shape (nq,) or (n, nq)
    ///     Configuration, or one per row. Angles in rad, displacements in m.
    /// frames : sequence of str
    ///     Names of m nodes or bodies.
    /// threads : int
    ///     Number of threads that share the rows (default: 1).
    ///
    /// Returns
    /// -------
    /// ndarray, shape (6m, 6m) or (n, 6m, 6m)
    ///     rad/s² and m/s² per N m and N.
    ///
    /// Raises
    /// ------
    /// LinkworkError
    ///     If a name does not exist, or an array has a wrong shape or contains NaN.
    ///
    /// Examples
    /// --------
    /// >>> arm.compliance(q, ["tip"]).shape
    /// (6, 6)
    #[pyo3(signature = (q, frames, *, threads=1))]
    fn compliance<'py>(
        &self,
        py: Python<'py>,
        q: ArrayLike<'_, 'py>,
        frames: Vec<String>,
        threads: usize,
    ) -> PyResult<Array<'py>> {
        let c = &*self.core;
        let nodes: Vec<_> = frames.iter().map(|f| c.frame(f)).collect::<PyResult<_>>()?;
        let rows = Rows::read(&[(q, c.nq(), "q")])?;
        let made = dynamics::Compliance::new(&c.tree, &nodes);
        let n = made.size();
        let lanes = |e: &mut Ensemble, x: &[&[f64]], out: &mut [Vec<f64>]| {
            e.compliance(x[0], &nodes, &mut out[0])
        };
        if let Some(many) = ensemble(py, c, &rows, threads, &[&[n, n]], lanes)? {
            return only(many);
        }
        states(py, c, &rows, threads, &[n, n], |tree, ws, x, out| {
            dynamics::poses(tree, ws, x[0]);
            made.clone().compute(tree, ws, out)
        })
    }

    /// Compute the kinetic energy, including rotors.
    ///
    /// Parameters
    /// ----------
    /// q : array_like, shape (nq,) or (n, nq)
    ///     Configuration, or one per row. Angles in rad, displacements in m.
    /// v : array_like, shape (nv,) or (n, nv)
    ///     Rates, or one set per row, rad/s and m/s.
    /// threads : int
    ///     Number of threads that share the rows (default: 1).
    ///
    /// Returns
    /// -------
    /// float or ndarray, shape (n,)
    ///     Kinetic energy, J.
    ///
    /// Raises
    /// ------
    /// LinkworkError
    ///     If an array has a wrong shape or contains NaN.
    ///
    /// Examples
    /// --------
    /// >>> round(float(arm.kinetic_energy(q, v)), 6)
    /// 0.056297
    /// >>> arm.kinetic_energy(np.zeros((3, 2)), v).shape
    /// (3,)
    #[pyo3(signature = (q, v, *, threads=1))]
    fn kinetic_energy<'py>(
        &self,
        py: Python<'py>,
        q: ArrayLike<'_, 'py>,
        v: ArrayLike<'_, 'py>,
        threads: usize,
    ) -> PyResult<Bound<'py, PyAny>> {
        let c = &*self.core;
        let rows = Rows::read(&[(q, c.nq(), "q"), (v, c.nv(), "v")])?;
        scalar(states(py, c, &rows, threads, &[1], |tree, ws, x, out| {
            dynamics::kinematics(tree, ws, x[0], x[1]);
            out[0] = dynamics::kinetic_energy(tree, ws, x[1]);
            Ok(())
        })?)
    }

    /// Compute the potential energy in uniform gravity. It is zero if all masses are at the world's origin.
    ///
    /// Parameters
    /// ----------
    /// q : array_like, shape (nq,) or (n, nq)
    ///     Configuration, or one per row. Angles in rad, displacements in m.
    /// threads : int
    ///     Number of threads that share the rows (default: 1).
    ///
    /// Returns
    /// -------
    /// float or ndarray, shape (n,)
    ///     Potential energy, J.
    ///
    /// Raises
    /// ------
    /// LinkworkError
    ///     If an array has a wrong shape or contains NaN.
    ///
    /// Examples
    /// --------
    /// >>> round(float(arm.potential_energy(q)), 6)
    /// -22.357945
    #[pyo3(signature = (q, *, threads=1))]
    fn potential_energy<'py>(
        &self,
        py: Python<'py>,
        q: ArrayLike<'_, 'py>,
        threads: usize,
    ) -> PyResult<Bound<'py, PyAny>> {
        let c = &*self.core;
        let rows = Rows::read(&[(q, c.nq(), "q")])?;
        scalar(states(py, c, &rows, threads, &[1], |tree, ws, x, out| {
            dynamics::poses(tree, ws, x[0]);
            out[0] = dynamics::potential_energy(tree, ws);
            Ok(())
        })?)
    }
}

/// The last axis, of length 1, taken away: a float64 number, or (n,).
fn scalar(array: Array<'_>) -> PyResult<Bound<'_, PyAny>> {
    array.get_item((pyo3::types::PyEllipsis::get(array.py()), 0))
}
