//! `Operators` and `Operator`: φ ψ H M K D … of a mechanism at a configuration, as values.
//!
//! Every formula and every refusal is that of `linkwork_dynamics::Operator`; this file gives them
//! Python's signs. A vector stands on the right of `*` or `@`; a matrix there is many columns.
use crate::array::{Array, Array2, Input, out, out2};
use crate::core::Core;
use crate::error::{refuse, refuse_with};
use crate::mechanism::Mechanism;
use linkwork_dynamics::{self as dynamics};
use pyo3::exceptions::PyTypeError;
use pyo3::prelude::*;
use pyo3::types::PyTuple;
use std::sync::Arc;

/// Spatial operators of a mechanism at one configuration. Make them with
/// `Mechanism.operators(q)`; all operators of one expression come from one of these.
///
/// Two spaces: hinges (nv numbers) and links (six numbers each, angular part or moment first,
/// world axes at the link's own origin). A link is one subhinge that moves, with what is welded
/// to it. At prescribed coordinates the gain G is zero, and so are the rows of D.
///
/// >>> pin = linkwork.Hinge.pin([0, 1, 0])
/// >>> m = linkwork.Builder().body("arm", "world", pin, mass=2, com=[0.3, 0, 0]).body("hand", "arm", pin, mass=1, com=[0.1, 0, 0], hinge_in_parent=[0.5, 0, 0]).build()
/// >>> o, udot = m.operators([0.2, 0.4]), np.array([1.5, -1.0])
/// >>> H, Phi, Psi, M, K, D, I = o.H, o.Phi, o.Psi, o.M, o.K, o.D, o.I
/// >>> T = H * Phi * M * Phi.T * H.T * udot
/// >>> ((I - H*Psi*K).T * D.inv() * (I - H*Psi*K) * T).round(9).tolist()
/// [1.5, -1.0]
#[pyclass(frozen, weakref, module = "linkwork")]
pub struct Operators {
    core: Arc<Core>,
    ops: dynamics::Operators,
}

#[pymethods]
impl Mechanism {
    /// The spatial operators at q (nq,). all_free: take prescribed coordinates for free. Angles in rad, lengths in m.
    /// Raises LinkworkError when a free coordinate moves nothing with inertia.
    ///
    /// >>> o = arm.operators(q)
    /// >>> bool(np.allclose(o.mass.dense(), arm.mass_matrix(q)))
    /// True
    #[pyo3(signature = (q, *, all_free=false))]
    fn operators(
        &self,
        py: Python<'_>,
        q: &Bound<'_, PyAny>,
        all_free: bool,
    ) -> PyResult<Operators> {
        let q = self.core.configuration(q, "q")?;
        let q = q.slice();
        let made = self.core.run(py, |tree, ws| {
            dynamics::poses(tree, ws, q);
            match all_free {
                true => dynamics::Operators::all_free(tree, ws),
                false => dynamics::Operators::new(tree, ws),
            }
        });
        Ok(Operators { core: self.core.clone(), ops: made.map_err(refuse)? })
    }
}

#[pymethods]
impl Operators {
    /// Degrees of freedom: the size of the hinge space.
    ///
    /// >>> o.nv
    /// 2
    #[getter]
    fn nv(&self) -> usize {
        self.ops.nv()
    }
    /// The number of links: their space has six times as many numbers.
    ///
    /// >>> o.links
    /// 2
    #[getter]
    fn links(&self) -> usize {
        self.ops.links()
    }
    /// The body whose hinge each link belongs to, in order.
    ///
    /// >>> o.link_bodies
    /// ['arm', 'hand']
    #[getter]
    fn link_bodies(&self) -> Vec<&str> {
        (0..self.ops.links()).filter_map(|k| self.ops.link_body(k)).collect()
    }
    /// 1, of the size that its place asks for.
    ///
    /// >>> (I * udot).tolist()
    /// [1.5, -1.0]
    #[getter]
    fn I(&self) -> Operator {
        self.ops.identity().into()
    }
    /// H (nv × links): forces to hinges; H.T takes rates to relative velocities.
    ///
    /// >>> H.shape, (H.T * udot)[[1, 7]].tolist()
    /// ((2, 12), [1.5, -1.0])
    #[getter]
    fn H(&self) -> Operator {
        self.ops.H().into()
    }
    /// φ (links × links): gathers forces from the tips; Phi.T scatters motions from the base.
    ///
    /// >>> bool(np.allclose((Phi * (I - o.EPhi)).dense(), np.eye(12)))
    /// True
    #[getter]
    fn Phi(&self) -> Operator {
        self.ops.phi().into()
    }
    /// ψ (links × links): φ of the articulated system.
    ///
    /// >>> bool(np.allclose((Psi * (I - o.EPsi)).dense(), np.eye(12)))
    /// True
    #[getter]
    fn Psi(&self) -> Operator {
        self.ops.psi().into()
    }
    /// ℰφ (links × links): one step of φ, from each link to its parent.
    ///
    /// >>> bool((o.EPhi * o.EPhi).dense().any())
    /// False
    #[getter]
    fn EPhi(&self) -> Operator {
        self.ops.e_phi().into()
    }
    /// ℰψ (links × links): one step of ψ.
    ///
    /// >>> bool(np.allclose(o.EPsi.dense(), (o.EPhi - K * H).dense()))
    /// True
    #[getter]
    fn EPsi(&self) -> Operator {
        self.ops.e_psi().into()
    }
    /// M (links × links): rigid inertia of each link about its origin.
    ///
    /// >>> M.dense().diagonal()[3:6].tolist()
    /// [2.0, 2.0, 2.0]
    #[getter]
    fn M(&self) -> Operator {
        self.ops.M().into()
    }
    /// P (links × links): articulated inertia of each link and all outboard.
    ///
    /// >>> bool(np.allclose(o.P.dense(), (o.EPsi * o.P * o.EPhi.T + M).dense()))
    /// True
    #[getter]
    fn P(&self) -> Operator {
        self.ops.P().into()
    }
    /// D (nv × nv): articulated inertia that each hinge feels, H P H* + J.
    ///
    /// >>> bool(np.allclose(D.dense(), (H * o.P * H.T + o.J).dense()))
    /// True
    #[getter]
    fn D(&self) -> Operator {
        self.ops.D().into()
    }
    /// G (links × nv): P H* D⁻¹.
    ///
    /// >>> bool(np.allclose(o.G.dense(), (o.P * H.T * D.inv()).dense()))
    /// True
    #[getter]
    fn G(&self) -> Operator {
        self.ops.G().into()
    }
    /// K (links × nv): ℰφ G.
    ///
    /// >>> bool(np.allclose(K.dense(), (o.EPhi * o.G).dense()))
    /// True
    #[getter]
    fn K(&self) -> Operator {
        self.ops.K().into()
    }
    /// J (nv × nv): reflected inertia of the rotors, kg m² or kg.
    ///
    /// >>> o.J.dense().tolist()
    /// [[0.0, 0.0], [0.0, 0.0]]
    #[getter]
    fn J(&self) -> Operator {
        self.ops.J().into()
    }
    /// Υ (links × links): diagonal blocks of Ω.
    ///
    /// >>> bool(np.allclose(o.Upsilon.dense()[6:, 6:], o.Omega.dense()[6:, 6:]))
    /// True
    #[getter]
    fn Upsilon(&self) -> Operator {
        self.ops.upsilon().into()
    }
    /// Ω (links × links): ψ* H* D⁻¹ H ψ.
    ///
    /// >>> bool(np.allclose(o.Omega.dense(), (Psi.T * H.T * D.inv() * H * Psi).dense()))
    /// True
    #[getter]
    fn Omega(&self) -> Operator {
        self.ops.omega().into()
    }
    /// H φ M φ* H* + J: the mass matrix (nv × nv).
    ///
    /// >>> bool(np.allclose(o.mass.dense(), m.mass_matrix([0.2, 0.4])))
    /// True
    #[getter]
    fn mass(&self) -> Operator {
        self.ops.mass().into()
    }
    /// (I − H ψ K)* D⁻¹ (I − H ψ K): the inverse of the mass matrix (nv × nv), on the free coordinates.
    ///
    /// >>> (o.mass_inverse * (o.mass * udot)).round(9).tolist()
    /// [1.5, -1.0]
    #[getter]
    fn mass_inverse(&self) -> Operator {
        self.ops.mass_inverse().into()
    }
    /// φ* H* (links × nv): the Jacobian of all links.
    ///
    /// >>> o.jacobian.shape, bool(np.allclose(o.jacobian.dense(), (Phi.T * H.T).dense()))
    /// ((12, 2), True)
    #[getter]
    fn jacobian(&self) -> Operator {
        self.ops.jacobian().into()
    }
    /// B (links × 6·frames): wrenches on frames (nodes or bodies; about each origin, world axes)
    /// to their links. B.T * jacobian is the Jacobian of the frames.
    /// Raises LinkworkError for a frame that is not there.
    ///
    /// >>> (o.B("hand").T * o.jacobian).shape
    /// (6, 2)
    #[pyo3(signature = (*frames))]
    fn B(&self, frames: &Bound<'_, PyTuple>) -> PyResult<Operator> {
        let node = |f: Bound<'_, PyAny>| self.core.frame(&f.extract::<String>()?);
        let nodes: Vec<_> = frames.iter().map(node).collect::<PyResult<_>>()?;
        Ok(self.ops.B(&nodes).into())
    }
    fn __repr__(&self) -> String {
        format!("Operators({} links, nv={})", self.ops.links(), self.ops.nv())
    }
}

/// A linear operator, as an expression: products and sums stay symbolic and cost nothing; a
/// product with a vector runs as sweeps, O(links) for each symbol.
///
/// `A * B`, `A @ B`, `A + B`, `A - B`, `2.0 * A`, `A.T`; `A * x` with x (columns,) gives (rows,),
/// with x (columns, k) gives (rows, k). A mistake of order or size raises LinkworkError with both
/// operands.
///
/// >>> m = linkwork.Builder().body("arm", "world", linkwork.Hinge.pin([0, 1, 0]), mass=2, com=[0.3, 0, 0]).build()
/// >>> o = m.operators([0.2])
/// >>> A = o.H * o.Phi * o.M * o.Phi.T * o.H.T
/// >>> (A * [10.0]).round(9).tolist()
/// [1.8]
/// >>> ((2.0 * A + A - A / 2) @ [10.0]).round(9).tolist(), (-A * [10.0]).round(9).tolist()
/// ([4.5], [-1.8])
#[pyclass(frozen, weakref, module = "linkwork")]
pub struct Operator {
    op: dynamics::Operator,
}

impl From<dynamics::Operator> for Operator {
    fn from(op: dynamics::Operator) -> Self {
        Self { op }
    }
}

impl Operator {
    /// This times an operator, a number, a vector or a matrix.
    fn times<'py>(&self, right: &Bound<'py, PyAny>) -> PyResult<Bound<'py, PyAny>> {
        let py = right.py();
        if let Ok(right) = right.cast::<Operator>() {
            let product = self.op.try_mul(&right.get().op).map_err(refuse)?;
            return Ok(Bound::new(py, Operator::from(product))?.into_any());
        }
        if is_number(right) {
            let scaled = Operator::from(&self.op * right.extract::<f64>()?).sound()?;
            return Ok(Bound::new(py, scaled)?.into_any());
        }
        Ok(self.apply(py, right)?.into_any())
    }

    fn sound(self) -> PyResult<Self> {
        self.op.check().map_err(refuse)?;
        Ok(self)
    }

    fn sum(&self, other: &Bound<'_, PyAny>, sign: f64) -> PyResult<Self> {
        let Ok(other) = other.cast::<Operator>() else {
            return Err(refuse_with(
                format!("cannot add `{}` and {}", self.op, described(other)?),
                "add operators; apply them to vectors first",
            ));
        };
        let other = &other.get().op * sign;
        Ok(self.op.try_add(&other).map_err(refuse)?.into())
    }

    fn scaled_from_the_left<'py>(&self, left: &Bound<'py, PyAny>) -> PyResult<Self> {
        if is_number(left) {
            return Operator::from(&self.op * left.extract::<f64>()?).sound();
        }
        Err(refuse_with(
            format!("cannot multiply {} by `{}`", described(left)?, self.op),
            "a vector stands on the right of an operator: write A.T * x",
        ))
    }
}

fn is_number(x: &Bound<'_, PyAny>) -> bool {
    !x.hasattr("__len__").unwrap_or(true) && x.extract::<f64>().is_ok()
}

/// `an array of shape (7,)`.
fn described(x: &Bound<'_, PyAny>) -> PyResult<String> {
    match x.getattr("shape") {
        Ok(shape) => Ok(format!("an array of the shape {shape}")),
        Err(_) => Ok(format!("{}", x.repr()?)),
    }
}

#[pymethods]
impl Operator {
    /// numpy leaves products with an operator to the operator.
    #[classattr]
    #[allow(non_upper_case_globals)] // The name is numpy's.
    const __array_ufunc__: Option<bool> = None;

    /// The transposed.
    ///
    /// >>> (o.Phi * o.H.T).T.shape
    /// (1, 6)
    #[getter]
    fn T(&self) -> Self {
        self.op.t().into()
    }
    /// (rows, columns); None for an expression of nothing but I.
    ///
    /// >>> o.H.shape, o.I.shape
    /// ((1, 6), None)
    #[getter]
    fn shape(&self) -> PyResult<Option<(usize, usize)>> {
        let (rows, columns) = (self.op.rows(), self.op.columns());
        let (rows, columns) = (rows.map_err(refuse)?, columns.map_err(refuse)?);
        Ok(rows.zip(columns).map(|(r, c)| (r.size(), c.size())))
    }
    /// The inverse, for the expressions that have one of low order: D, φ, ψ, the mass matrix and
    /// its factors; LinkworkError for the others.
    ///
    /// >>> (o.mass.inv() * [1.8]).round(9).tolist()
    /// [10.0]
    fn inv(&self) -> PyResult<Self> {
        Ok(self.op.inverse().map_err(refuse)?.into())
    }
    /// The matrix (rows, columns): O(columns · links) for each symbol. In SI units of its symbols.
    /// Raises LinkworkError for an expression of no size.
    ///
    /// >>> A.dense().round(9).tolist()
    /// [[0.18]]
    fn dense<'py>(&self, py: Python<'py>) -> PyResult<Array2<'py>> {
        let (values, rows, columns) = py.detach(|| self.op.dense_rows()).map_err(refuse)?;
        out2(py, values, rows, columns)
    }
    /// The product with x (columns,) or, column by column, with x (columns, k). In SI units of its symbols.
    /// Raises LinkworkError for an array of another shape.
    ///
    /// >>> A.apply([[10.0, 20.0]]).round(9).tolist()
    /// [[1.8, 3.6]]
    fn apply<'py>(&self, py: Python<'py>, x: &Bound<'py, PyAny>) -> PyResult<Array<'py>> {
        let x = Input::read(x, "the right operand")?;
        let values = x.slice();
        match *x.shape() {
            [_] => {
                let y = self.op.apply(values).map_err(refuse)?;
                let n = y.len();
                out(py, y, &[n])
            }
            [rows, k] => {
                let columns = || -> Result<Vec<Vec<f64>>, dynamics::OperatorError> {
                    let column = |j| (0..rows).map(|i| values[i * k + j]).collect::<Vec<f64>>();
                    (0..k).map(|j| self.op.apply(&column(j))).collect()
                };
                let columns = py.detach(columns).map_err(refuse)?;
                let n = columns.first().map_or(rows, Vec::len);
                let y = (0..n).flat_map(|i| columns.iter().map(move |c| c[i])).collect();
                out(py, y, &[n, k])
            }
            ref shape => Err(refuse_with(
                format!("cannot multiply `{}` by an array of the shape {shape:?}", self.op),
                "give a vector, or a matrix of columns",
            )),
        }
    }

    fn __mul__<'py>(&self, right: &Bound<'py, PyAny>) -> PyResult<Bound<'py, PyAny>> {
        self.times(right)
    }
    fn __matmul__<'py>(&self, right: &Bound<'py, PyAny>) -> PyResult<Bound<'py, PyAny>> {
        if is_number(right) {
            return Err(PyTypeError::new_err("`@` takes no number: write A * 2.0"));
        }
        self.times(right)
    }
    fn __rmul__(&self, left: &Bound<'_, PyAny>) -> PyResult<Self> {
        self.scaled_from_the_left(left)
    }
    fn __rmatmul__(&self, left: &Bound<'_, PyAny>) -> PyResult<Self> {
        if is_number(left) {
            return Err(PyTypeError::new_err("`@` takes no number: write 2.0 * A"));
        }
        self.scaled_from_the_left(left)
    }
    fn __truediv__(&self, number: f64) -> PyResult<Self> {
        Operator::from(&self.op * (1.0 / number)).sound()
    }
    fn __add__(&self, other: &Bound<'_, PyAny>) -> PyResult<Self> {
        self.sum(other, 1.0)
    }
    fn __sub__(&self, other: &Bound<'_, PyAny>) -> PyResult<Self> {
        self.sum(other, -1.0)
    }
    fn __radd__(&self, other: &Bound<'_, PyAny>) -> PyResult<Self> {
        self.sum(other, 1.0)
    }
    fn __rsub__(&self, other: &Bound<'_, PyAny>) -> PyResult<Self> {
        Operator::from(-&self.op).sum(other, 1.0)
    }
    fn __neg__(&self) -> Self {
        (-&self.op).into()
    }
    fn __repr__(&self) -> String {
        self.op.to_string()
    }
}
