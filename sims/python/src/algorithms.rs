//! More algorithms of `Mechanism`: inverse of the mass matrix, Jacobians, centroidal quantities,
//! compliance.
use crate::array::{Array, wrench};
use crate::batch::{Rows, ensemble, ensemble_into, states, states_into};
use crate::dynamics::only;
use crate::mechanism::Mechanism;
use linkwork_dynamics::{self as dynamics, Ensemble};
use pyo3::prelude::*;

type Given<'a, 'py> = &'a Bound<'py, PyAny>;

#[pymethods]
impl Mechanism {
    /// Inverse of the mass matrix (nv, nv) at q, or many. Rows and columns of prescribed
    /// coordinates are zero: it is that of the free ones. Entries in 1/(kg m²), 1/(kg m) and 1/kg, by the coordinates of row and column.
    /// Raises LinkworkError for another shape and for NaN.
    ///
    /// >>> (arm.inverse_mass_matrix(q) @ arm.mass_matrix(q)).round(9).tolist()
    /// [[1.0, 0.0], [-0.0, 1.0]]
    #[pyo3(signature = (q, *, threads=1))]
    fn inverse_mass_matrix<'py>(
        &self,
        py: Python<'py>,
        q: Given<'_, 'py>,
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

    /// The inverse of the mass matrix at q times x (nv,), in O(nv); or many. Forces in N m and N give accelerations in rad/s² and m/s².
    /// Raises LinkworkError for another shape and for NaN.
    ///
    /// >>> arm.apply_inverse_mass(q, arm.mass_matrix(q) @ v).round(9).tolist()
    /// [0.1, 0.4]
    #[pyo3(signature = (q, x, *, threads=1))]
    fn apply_inverse_mass<'py>(
        &self,
        py: Python<'py>,
        q: Given<'_, 'py>,
        x: Given<'_, 'py>,
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

    /// Jacobian (6, nv) of a frame at q, or many: v to the velocity [ω; v] of the frame's origin,
    /// world axes, rad/s and m/s. out: as in inverse_dynamics.
    /// Raises LinkworkError for a name that is not there, for another shape and for NaN.
    ///
    /// >>> J = arm.node_jacobian(q, "tip")
    /// >>> J.shape, bool(np.allclose(J @ v, arm.state(q, v).velocity("tip")))
    /// ((6, 2), True)
    #[pyo3(signature = (q, frame, *, out=None, threads=1))]
    fn node_jacobian<'py>(
        &self,
        py: Python<'py>,
        q: Given<'_, 'py>,
        frame: &str,
        out: Option<Given<'_, 'py>>,
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

    /// Rate (6, nv) of that Jacobian at q, v, or many: its derivative in time. Rows in rad and m, by s and the coordinate's unit.
    /// Raises LinkworkError for a name that is not there, for another shape and for NaN.
    ///
    /// >>> dJ = arm.node_jacobian_rate(q, v, "tip")
    /// >>> bool(np.allclose(dJ @ v, arm.state(q, v).bias_acceleration("tip")))
    /// True
    #[pyo3(signature = (q, v, frame, *, threads=1))]
    fn node_jacobian_rate<'py>(
        &self,
        py: Python<'py>,
        q: Given<'_, 'py>,
        v: Given<'_, 'py>,
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

    /// Forces (nv,) that equal a wrench (6,) [moment; force] on a frame, about its origin, world
    /// axes: Jᵀ f; or many. Wrench in N m and N; forces in N m and N, by coordinate.
    /// Raises LinkworkError for a name that is not there, for another shape and for NaN.
    ///
    /// >>> arm.node_jacobian_transpose_product(q, "tip", [0, 0, 0, 10, 0, 0]).round(6).tolist()
    /// [-16.921853, -7.368488]
    #[pyo3(signature = (q, frame, wrench, *, threads=1))]
    fn node_jacobian_transpose_product<'py>(
        &self,
        py: Python<'py>,
        q: Given<'_, 'py>,
        frame: &str,
        wrench: Given<'_, 'py>,
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

    /// Centroidal momentum matrix (6, nv) at q, or many: v to the momentum [angular about the
    /// centre of mass, kg m²/s; linear, kg m/s], world axes.
    /// Raises LinkworkError for another shape and for NaN.
    ///
    /// >>> A = arm.centroidal_matrix(q)
    /// >>> A.shape, bool(np.allclose(A @ v, arm.state(q, v).momentum()))
    /// ((6, 2), True)
    #[pyo3(signature = (q, *, threads=1))]
    fn centroidal_matrix<'py>(
        &self,
        py: Python<'py>,
        q: Given<'_, 'py>,
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

    /// Rate (6,) of that momentum with vdot = 0 at q, v, or many: [N m; N], world axes.
    /// Raises LinkworkError for another shape and for NaN.
    ///
    /// >>> arm.centroidal_bias(q, v).shape
    /// (6,)
    #[pyo3(signature = (q, v, *, threads=1))]
    fn centroidal_bias<'py>(
        &self,
        py: Python<'py>,
        q: Given<'_, 'py>,
        v: Given<'_, 'py>,
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

    /// Jacobian (3, nv) of the centre of mass at q, or many: v to its velocity, world axes. In m by the coordinate's unit.
    /// Raises LinkworkError for another shape and for NaN.
    ///
    /// >>> bool(np.allclose(arm.com_jacobian(q) @ v, arm.state(q, v).com_velocity()))
    /// True
    #[pyo3(signature = (q, *, threads=1))]
    fn com_jacobian<'py>(
        &self,
        py: Python<'py>,
        q: Given<'_, 'py>,
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

    /// Operational-space compliance (6m, 6m) of m frames at q, or many: accelerations [α; a] of
    /// the frames' origins for unit wrenches [moment; force] on them, world axes: J M⁻¹ Jᵀ, with
    /// cross terms. Prescribed coordinates stay as they are. In rad/s² and m/s² for N m and N.
    /// Raises LinkworkError for a name that is not there, for another shape and for NaN.
    ///
    /// >>> arm.compliance(q, ["tip"]).shape
    /// (6, 6)
    #[pyo3(signature = (q, frames, *, threads=1))]
    fn compliance<'py>(
        &self,
        py: Python<'py>,
        q: Given<'_, 'py>,
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

    /// Kinetic energy at q, v: J, rotors included; one number, or (n,) for many.
    /// Raises LinkworkError for another shape and for NaN.
    ///
    /// >>> round(float(arm.kinetic_energy(q, v)), 6)
    /// 0.056297
    /// >>> arm.kinetic_energy(np.zeros((3, 2)), v).shape
    /// (3,)
    #[pyo3(signature = (q, v, *, threads=1))]
    fn kinetic_energy<'py>(
        &self,
        py: Python<'py>,
        q: Given<'_, 'py>,
        v: Given<'_, 'py>,
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

    /// Potential energy in uniform gravity at q: J, zero with all masses at the world's origin;
    /// one number, or (n,) for many.
    /// Raises LinkworkError for another shape and for NaN.
    ///
    /// >>> round(float(arm.potential_energy(q)), 6)
    /// -22.357945
    #[pyo3(signature = (q, *, threads=1))]
    fn potential_energy<'py>(
        &self,
        py: Python<'py>,
        q: Given<'_, 'py>,
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
