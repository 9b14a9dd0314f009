//! `Operators` and `Operator`: the spatial operators φ ψ H M K D … of a mechanism at a configuration.
//!
//! All formulas and checks are in `linkwork_linkwork_operators::Operator`; this file adds Python's arithmetic operators. A vector is the right operand of `*`
//! or `@`; a matrix as right operand stands for its columns.
use crate::array::{Array, Array2, Input, out, out2};
use crate::core::Core;
use crate::error::{refuse, refuse_with};
use crate::mechanism::Mechanism;
use linkwork_dynamics::{self as dynamics};
use pyo3::exceptions::PyTypeError;
use pyo3::prelude::*;
use pyo3::types::PyTuple;
use std::sync::Arc;

/// Spatial operators of a mechanism at one configuration. Create them with `Mechanism.operators(q)`.
///
/// All operators of an expression must come from the same object.
///
/// Notes
/// -----
/// Operators act on two spaces: hinges (nv numbers) and links (six numbers per link, angular part or moment first, in world axes at the link's
/// own origin). A link is a subhinge that moves, with all bodies that are welded outboard of it.
///
/// At prescribed coordinates, the gain G and the rows of D are zero.
///
/// Examples
/// --------
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
    ops: linkwork_operators::Operators,
}

#[pymethods]
impl Mechanism {
    /// Compute the spatial operators at a configuration.
    ///
    /// Parameters
    /// ----------
    /// q : array_like, shape (nq,)
    ///     Configuration, rad and m.
    /// all_free : bool
    ///     Treat prescribed coordinates as free (default: False).
    ///
    /// Returns
    /// -------
    /// Operators
    ///     The operators.
    ///
    /// Raises
    /// ------
    /// LinkworkError
    ///     If a free coordinate moves no inertia.
    ///
    /// Examples
    /// --------
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
                true => linkwork_operators::Operators::all_free(tree, ws),
                false => linkwork_operators::Operators::new(tree, ws),
            }
        });
        Ok(Operators { core: self.core.clone(), ops: made.map_err(refuse)? })
    }
}

#[pymethods]
impl Operators {
    /// Number of degrees of freedom: the size of the hinge space.
    ///
    /// Examples
    /// --------
    /// >>> o.nv
    /// 2
    #[getter]
    fn nv(&self) -> usize {
        self.ops.nv()
    }
    /// Number of links. The link space has six times this size.
    ///
    /// Examples
    /// --------
    /// >>> o.links
    /// 2
    #[getter]
    fn links(&self) -> usize {
        self.ops.links()
    }
    /// For each link, the body whose hinge it belongs to.
    ///
    /// Examples
    /// --------
    /// >>> o.link_bodies
    /// ['arm', 'hand']
    #[getter]
    fn link_bodies(&self) -> Vec<&str> {
        (0..self.ops.links()).filter_map(|k| self.ops.link_body(k)).collect()
    }
    /// The identity; its size follows from the expression in which it is used.
    ///
    /// Examples
    /// --------
    /// >>> (I * udot).tolist()
    /// [1.5, -1.0]
    #[getter]
    fn I(&self) -> Operator {
        self.ops.identity().into()
    }
    /// H (nv × links): maps forces on links to hinge forces; H.T maps rates to relative velocities.
    ///
    /// Examples
    /// --------
    /// >>> H.shape, (H.T * udot)[[1, 7]].tolist()
    /// ((2, 12), [1.5, -1.0])
    #[getter]
    fn H(&self) -> Operator {
        self.ops.H().into()
    }
    /// φ (links × links): gathers forces from the tips to the base; Phi.T scatters motions from the base to the tips.
    ///
    /// Examples
    /// --------
    /// >>> bool(np.allclose((Phi * (I - o.EPhi)).dense(), np.eye(12)))
    /// True
    #[getter]
    fn Phi(&self) -> Operator {
        self.ops.phi().into()
    }
    /// ψ (links × links): φ of the articulated system.
    ///
    /// Examples
    /// --------
    /// >>> bool(np.allclose((Psi * (I - o.EPsi)).dense(), np.eye(12)))
    /// True
    #[getter]
    fn Psi(&self) -> Operator {
        self.ops.psi().into()
    }
    /// ℰφ (links × links): one step of φ, from each link to its parent.
    ///
    /// Examples
    /// --------
    /// >>> bool((o.EPhi * o.EPhi).dense().any())
    /// False
    #[getter]
    fn EPhi(&self) -> Operator {
        self.ops.e_phi().into()
    }
    /// ℰψ (links × links): one step of ψ.
    ///
    /// Examples
    /// --------
    /// >>> bool(np.allclose(o.EPsi.dense(), (o.EPhi - K * H).dense()))
    /// True
    #[getter]
    fn EPsi(&self) -> Operator {
        self.ops.e_psi().into()
    }
    /// M (links × links): rigid inertia of each link about its origin.
    ///
    /// Examples
    /// --------
    /// >>> M.dense().diagonal()[3:6].tolist()
    /// [2.0, 2.0, 2.0]
    #[getter]
    fn M(&self) -> Operator {
        self.ops.M().into()
    }
    /// Articulated-body inertia P (links × links) of each link with all links outboard of it.
    ///
    /// Examples
    /// --------
    /// >>> bool(np.allclose(o.P.dense(), (o.EPsi * o.P * o.EPhi.T + M).dense()))
    /// True
    #[getter]
    fn P(&self) -> Operator {
        self.ops.P().into()
    }
    /// D = H P H* + J (nv × nv): articulated-body inertia at each hinge.
    ///
    /// Examples
    /// --------
    /// >>> bool(np.allclose(D.dense(), (H * o.P * H.T + o.J).dense()))
    /// True
    #[getter]
    fn D(&self) -> Operator {
        self.ops.D().into()
    }
    /// G = P H* D⁻¹ (links × nv).
    ///
    /// Examples
    /// --------
    /// >>> bool(np.allclose(o.G.dense(), (o.P * H.T * D.inv()).dense()))
    /// True
    #[getter]
    fn G(&self) -> Operator {
        self.ops.G().into()
    }
    /// K = ℰφ G (links × nv).
    ///
    /// Examples
    /// --------
    /// >>> bool(np.allclose(K.dense(), (o.EPhi * o.G).dense()))
    /// True
    #[getter]
    fn K(&self) -> Operator {
        self.ops.K().into()
    }
    /// J (nv × nv): reflected inertia of the rotors, kg m² or kg.
    ///
    /// Examples
    /// --------
    /// >>> o.J.dense().tolist()
    /// [[0.0, 0.0], [0.0, 0.0]]
    #[getter]
    fn J(&self) -> Operator {
        self.ops.J().into()
    }
    /// Υ (links × links): the diagonal blocks of Ω.
    ///
    /// Examples
    /// --------
    /// >>> bool(np.allclose(o.Upsilon.dense()[6:, 6:], o.Omega.dense()[6:, 6:]))
    /// True
    #[getter]
    fn Upsilon(&self) -> Operator {
        self.ops.upsilon().into()
    }
    /// Ω = ψ* H* D⁻¹ H ψ (links × links).
    ///
    /// Examples
    /// --------
    /// >>> bool(np.allclose(o.Omega.dense(), (Psi.T * H.T * D.inv() * H * Psi).dense()))
    /// True
    #[getter]
    fn Omega(&self) -> Operator {
        self.ops.omega().into()
    }
    /// Mass matrix H φ M φ* H* + J (nv × nv).
    ///
    /// Examples
    /// --------
    /// >>> bool(np.allclose(o.mass.dense(), m.mass_matrix([0.2, 0.4])))
    /// True
    #[getter]
    fn mass(&self) -> Operator {
        self.ops.mass().into()
    }
    /// Inverse of the mass matrix, (I − H ψ K)* D⁻¹ (I − H ψ K) (nv × nv), on the free coordinates.
    ///
    /// Examples
    /// --------
    /// >>> (o.mass_inverse * (o.mass * udot)).round(9).tolist()
    /// [1.5, -1.0]
    #[getter]
    fn mass_inverse(&self) -> Operator {
        self.ops.mass_inverse().into()
    }
    /// Jacobian of all links, φ* H* (links × nv).
    ///
    /// Examples
    /// --------
    /// >>> o.jacobian.shape, bool(np.allclose(o.jacobian.dense(), (Phi.T * H.T).dense()))
    /// ((12, 2), True)
    #[getter]
    fn jacobian(&self) -> Operator {
        self.ops.jacobian().into()
    }
    /// Return B (links × 6·frames), which maps wrenches on frames to wrenches on their links.
    ///
    /// `B.T * jacobian` is the Jacobian of the frames. Wrenches are about each frame's origin, in world axes.
    ///
    /// Parameters
    /// ----------
    /// *frames : str
    ///     Names of nodes or bodies.
    ///
    /// Returns
    /// -------
    /// Operator
    ///     The operator.
    ///
    /// Raises
    /// ------
    /// LinkworkError
    ///     If the frame does not exist.
    ///
    /// Examples
    /// --------
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

/// A linear operator, as a symbolic expression.
///
/// Products and sums stay symbolic and cost nothing. A product with a vector runs as recursions, O(links) per symbol.
///
/// Supported: `A * B`, `A @ B`, `A + B`, `A - B`, `2.0 * A`, `A.T`. `A * x` with x of shape (columns,) returns (rows,); with x of shape (columns,
/// k) it returns (rows, k). Operands in the wrong order or of the wrong size raise LinkworkError, which shows both operands.
///
/// Examples
/// --------
/// >>> m = linkwork.Builder().body("arm", "world", linkwork.Hinge.pin([0, 1, 0]), mass=2, com=[0.3, 0, 0]).build()
/// >>> o = m.operators([0.2])
/// >>> A = o.H * o.Phi * o.M * o.Phi.T * o.H.T
/// >>> (A * [10.0]).round(9).tolist()
/// [1.8]
/// >>> ((2.0 * A + A - A / 2) @ [10.0]).round(9).tolist(), (-A * [10.0]).round(9).tolist()
/// ([4.5], [-1.8])
#[pyclass(frozen, weakref, module = "linkwork")]
pub struct Operator {
    op: linkwork_operators::Operator,
}

impl From<linkwork_operators::Operator> for Operator {
    fn from(op: linkwork_operators::Operator) -> Self {
        Self { op }
    }
}

impl Operator {
    /// Returns the product with an operator, a number, a vector or a matrix.
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
            "a vector must be the right operand: write A.T * x",
        ))
    }
}

fn is_number(x: &Bound<'_, PyAny>) -> bool {
    !x.hasattr("__len__").unwrap_or(true) && x.extract::<f64>().is_ok()
}

/// Describes an operand for messages, such as `an array of shape (7,)`.
fn described(x: &Bound<'_, PyAny>) -> PyResult<String> {
    match x.getattr("shape") {
        Ok(shape) => Ok(format!("an array of the shape {shape}")),
        Err(_) => Ok(format!("{}", x.repr()?)),
    }
}

#[pymethods]
impl Operator {
    /// Tells numpy to leave products with an operator to this class.
    #[classattr]
    #[allow(non_upper_case_globals)] // The name is that of numpy's protocol.
    const __array_ufunc__: Option<bool> = None;

    /// The transpose.
    ///
    /// Examples
    /// --------
    /// >>> (o.Phi * o.H.T).T.shape
    /// (1, 6)
    #[getter]
    fn T(&self) -> Self {
        self.op.t().into()
    }
    /// (rows, columns); None for an expression that contains only I.
    ///
    /// Examples
    /// --------
    /// >>> o.H.shape, o.I.shape
    /// ((1, 6), None)
    #[getter]
    fn shape(&self) -> PyResult<Option<(usize, usize)>> {
        let (rows, columns) = (self.op.rows(), self.op.columns());
        let (rows, columns) = (rows.map_err(refuse)?, columns.map_err(refuse)?);
        Ok(rows.zip(columns).map(|(r, c)| (r.size(), c.size())))
    }
    /// Return the inverse. It exists for expressions whose inverse is of low order: D, φ, ψ, the mass matrix and its factors.
    ///
    /// Returns
    /// -------
    /// Operator
    ///     The inverse.
    ///
    /// Raises
    /// ------
    /// LinkworkError
    ///     If there is no such rule for the expression.
    ///
    /// Examples
    /// --------
    /// >>> (o.mass.inv() * [1.8]).round(9).tolist()
    /// [10.0]
    fn inv(&self) -> PyResult<Self> {
        Ok(self.op.inverse().map_err(refuse)?.into())
    }
    /// Compute the matrix, in O(columns · links) per symbol.
    ///
    /// Returns
    /// -------
    /// ndarray, shape (rows, columns)
    ///     The matrix, in the SI units that follow from its symbols.
    ///
    /// Raises
    /// ------
    /// LinkworkError
    ///     If the size of the expression is not determined.
    ///
    /// Examples
    /// --------
    /// >>> A.dense().round(9).tolist()
    /// [[0.18]]
    fn dense<'py>(&self, py: Python<'py>) -> PyResult<Array2<'py>> {
        let (values, rows, columns) = py.detach(|| self.op.dense_rows()).map_err(refuse)?;
        out2(py, values, rows, columns)
    }
    /// Compute the product with a vector or with the columns of a matrix.
    ///
    /// Parameters
    /// ----------
    /// x : array_like, shape (columns,) or (columns, k)
    ///     Vector or matrix, in SI units.
    ///
    /// Returns
    /// -------
    /// ndarray, shape (rows,) or (rows, k)
    ///     The product.
    ///
    /// Raises
    /// ------
    /// LinkworkError
    ///     If x has a wrong shape.
    ///
    /// Examples
    /// --------
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
                let columns = || -> Result<Vec<Vec<f64>>, linkwork_operators::OperatorError> {
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
            return Err(PyTypeError::new_err("`@` does not support numbers: write A * 2.0"));
        }
        self.times(right)
    }
    fn __rmul__(&self, left: &Bound<'_, PyAny>) -> PyResult<Self> {
        self.scaled_from_the_left(left)
    }
    fn __rmatmul__(&self, left: &Bound<'_, PyAny>) -> PyResult<Self> {
        if is_number(left) {
            return Err(PyTypeError::new_err("`@` does not support numbers: write 2.0 * A"));
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
