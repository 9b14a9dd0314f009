//! Calibration of a `Mechanism`: identifiable parameters, inertial parameters, hinge frames.
use crate::array::{Array1, Array2, Input, checked1, out2};
use crate::core::Core;
use crate::error::{refuse, refuse_with};
use crate::mechanism::Mechanism;
use linkwork_dynamics::calibration::{
    self, InertialData, Placed, calibrate_kinematics, structural_regressor,
};
use linkwork_multibody::Builder;
use linkwork_spatial::nalgebra::Quaternion;
use linkwork_spatial::{MassProperties, Quat, Vec3};
use pyo3::prelude::*;
use std::sync::Arc;

type ArrayLike<'a, 'py> = &'a Bound<'py, PyAny>;

/// Which combinations of parameters measurements can determine.
///
/// Result of `Mechanism.identifiable_inertia`, and part of a `Calibration`.
///
/// Examples
/// --------
/// >>> bob = linkwork.Builder().body("bob", "world", linkwork.Hinge.pin([0, 1, 0]), mass=1, com=[0, 0, -0.5], inertia=np.eye(3) / 50).build()
/// >>> told = bob.identifiable_inertia()
/// >>> told
/// Identifiable(3 of 10)
#[pyclass(frozen, weakref, module = "linkwork")]
pub struct Identifiable {
    own: calibration::Identifiable,
    names: Vec<String>,
}

impl Identifiable {
    fn of(&self, places: &[usize]) -> Vec<String> {
        places.iter().map(|k| self.names[*k].clone()).collect()
    }
}

#[pymethods]
impl Identifiable {
    /// Names of all parameters, in the order of the columns.
    ///
    /// Inertial parameters are `body.m` (kg), `.hx`, `.hy`, `.hz` (kg m), `.Ixx`, `.Ixy`, .. (kg m²); frame parameters are `body.rx`, .. (rad) and
    /// `.px`, .. (m).
    ///
    /// Examples
    /// --------
    /// >>> told.names[:4]
    /// ['bob.m', 'bob.hx', 'bob.hy', 'bob.hz']
    #[getter]
    fn names(&self) -> Vec<String> {
        self.names.clone()
    }
    /// Names of the base parameters, as many as the rank. Each stands for a combination of parameters.
    ///
    /// Examples
    /// --------
    /// >>> told.base
    /// ['bob.hx', 'bob.hz', 'bob.Iyy']
    #[getter]
    fn base(&self) -> Vec<String> {
        self.of(&self.own.base)
    }
    /// Matrix (rank, n) whose product with the parameters (n,) gives the base parameters. Parameters are in kg, kg m, kg m²; rad, m.
    ///
    /// Examples
    /// --------
    /// >>> told.combinations.shape
    /// (3, 10)
    #[getter]
    fn combinations<'py>(&self, py: Python<'py>) -> PyResult<Array2<'py>> {
        let (rows, columns) = self.own.combinations.shape();
        let all = self.own.combinations.transpose().as_slice().to_vec();
        out2(py, all, rows, columns)
    }
    /// Condition number of the base columns, each scaled to length 1. Above 1e3, the result is sensitive to noise.
    ///
    /// Examples
    /// --------
    /// >>> told.condition < 10
    /// True
    #[getter]
    fn condition(&self) -> f64 {
        self.own.condition
    }
    /// Names of the parameters that are identifiable individually.
    ///
    /// Examples
    /// --------
    /// >>> told.alone
    /// ['bob.hx', 'bob.hz', 'bob.Iyy']
    #[getter]
    fn alone(&self) -> Vec<String> {
        self.of(&self.own.alone())
    }
    /// Names of the parameters that do not influence the measurements.
    ///
    /// Examples
    /// --------
    /// >>> told.without_influence[:2]
    /// ['bob.m', 'bob.hy']
    #[getter]
    fn without_influence(&self) -> Vec<String> {
        self.of(&self.own.without_influence())
    }
    fn __repr__(&self) -> String {
        format!("Identifiable({} of {})", self.own.rank(), self.names.len())
    }
}

/// Parameters fitted to measurements: result of `Mechanism.fit_inertia` and `Mechanism.calibrate_frames`.
///
/// Examples
/// --------
/// >>> bob = linkwork.Builder().body("bob", "world", linkwork.Hinge.pin([0, 1, 0]), mass=1, com=[0, 0, -0.5], inertia=np.eye(3) / 50).build()
/// >>> real = linkwork.Builder().body("bob", "world", linkwork.Hinge.pin([0, 1, 0]), mass=1, com=[0.01, 0, -0.5], inertia=np.eye(3) / 50).build()
/// >>> q, v, a = np.random.default_rng(1).normal(size=(3, 20, 1))
/// >>> found = bob.fit_inertia(q, v, a, real.inverse_dynamics(q, v, a))
/// >>> found
/// Calibration(3 of 10 identifiable, residual 0)
#[pyclass(frozen, weakref, module = "linkwork")]
pub struct Calibration {
    identifiable: Py<Identifiable>,
    base: Vec<f64>,
    deviations: Vec<f64>,
    parameters: Vec<f64>,
    residual: f64,
    unphysical: Vec<String>,
    mechanism: Option<Py<Mechanism>>,
}

#[pymethods]
impl Calibration {
    /// Which parameters these measurements determine.
    ///
    /// Examples
    /// --------
    /// >>> found.identifiable.base
    /// ['bob.hx', 'bob.hz', 'bob.Iyy']
    #[getter]
    fn identifiable(&self, py: Python<'_>) -> Py<Identifiable> {
        self.identifiable.clone_ref(py)
    }
    /// Base parameters (rank,), in the units of their names: kg, kg m, kg m²; rad, m.
    ///
    /// Examples
    /// --------
    /// >>> found.base.round(6).tolist()
    /// [0.01, -0.5, 0.2701]
    #[getter]
    fn base<'py>(&self, py: Python<'py>) -> PyResult<Array1<'py>> {
        checked1(py, self.base.clone())
    }
    /// Standard deviations (rank,) of the base parameters, estimated from the residuals, in the units of the parameters: kg, kg m, kg m²; rad, m.
    ///
    /// Examples
    /// --------
    /// >>> bool(found.deviations.max() < 1e-9)
    /// True
    #[getter]
    fn deviations<'py>(&self, py: Python<'py>) -> PyResult<Array1<'py>> {
        checked1(py, self.deviations.clone())
    }
    /// All parameters (n,), in the units of their names: kg, kg m, kg m²; for frames, corrections in rad and m.
    ///
    /// Of all parameters that explain the measurements equally well, these are the nearest to the mechanism's own.
    ///
    /// Examples
    /// --------
    /// >>> found.parameters[:4].round(6).tolist()
    /// [1.0, 0.01, 0.0, -0.5]
    #[getter]
    fn parameters<'py>(&self, py: Python<'py>) -> PyResult<Array1<'py>> {
        checked1(py, self.parameters.clone())
    }
    /// RMS of the residuals: N m and N for inertias, m for frames.
    ///
    /// Examples
    /// --------
    /// >>> found.residual < 1e-9
    /// True
    #[getter]
    fn residual(&self) -> f64 {
        self.residual
    }
    /// Names of bodies whose fitted inertia no rigid body can have. If there are any, `mechanism` is None.
    ///
    /// Examples
    /// --------
    /// >>> found.unphysical
    /// []
    #[getter]
    fn unphysical(&self) -> Vec<String> {
        self.unphysical.clone()
    }
    /// The mechanism with the fitted parameters; None if a body is not physical.
    ///
    /// Examples
    /// --------
    /// >>> bool(np.allclose(found.mechanism.inverse_dynamics(q, v, a), real.inverse_dynamics(q, v, a)))
    /// True
    #[getter]
    fn mechanism(&self, py: Python<'_>) -> Option<Py<Mechanism>> {
        self.mechanism.as_ref().map(|m| m.clone_ref(py))
    }
    fn __repr__(&self, py: Python<'_>) -> String {
        let told = self.identifiable.bind(py).get();
        let small = self.residual < 1e-9;
        let residual = if small { "0".to_owned() } else { format!("{:.3e}", self.residual) };
        let (rank, all) = (told.own.rank(), told.names.len());
        format!("Calibration({rank} of {all} identifiable, residual {residual})")
    }
}

fn names_of_inertia(core: &Core) -> Vec<String> {
    let each = ["m", "hx", "hy", "hz", "Ixx", "Ixy", "Ixz", "Iyy", "Iyz", "Izz"];
    let of = |b: &linkwork_multibody::Body| each.map(|p| format!("{}.{p}", b.name()));
    core.mbs.bodies().iter().flat_map(of).collect()
}

/// Reads rows (n, width), or one row (width,).
fn rows<'py>(given: ArrayLike<'_, 'py>, width: usize, what: &str) -> PyResult<(Input<'py>, usize)> {
    let input = Input::read(given, what)?;
    let n = match input.shape() {
        [w] if *w == width => 1,
        [n, w] if *w == width => *n,
        shape => {
            let fact = format!("`{what}` has the shape {shape:?}");
            return Err(refuse_with(fact, format!("give it the shape (n, {width})")));
        }
    };
    Ok((input, n))
}

fn tolerance(x: f64) -> PyResult<f64> {
    if x > 0.0 && x < 1.0 {
        return Ok(x);
    }
    Err(refuse_with(format!("`tolerance` is {x}"), "give a number between 0 and 1"))
}

impl Mechanism {
    /// Builds a mechanism with the same gravity.
    fn with(&self, builder: &Builder) -> PyResult<Self> {
        let mbs = builder.build().map_err(refuse)?;
        Ok(Self { core: Arc::new(Core::new(mbs, self.core.gravity())?) })
    }
}

#[pymethods]
impl Mechanism {
    /// Determine which inertial parameters can be identified from motion and forces.
    ///
    /// The regressor is evaluated at random states. A column is dependent if less than the fraction `tolerance` of it remains after projection onto
    /// the columns before it.
    ///
    /// Parameters
    /// ----------
    /// seed : int
    ///     Seed of the random states (default: 0).
    /// tolerance : float
    ///     Threshold for dependent columns, between 0 and 1.
    ///
    /// Returns
    /// -------
    /// Identifiable
    ///     Identifiable combinations of the 10·bodies parameters of `inertial_parameters` (kg, kg m, kg m²).
    ///
    /// Raises
    /// ------
    /// LinkworkError
    ///     If the mechanism has flexible bodies, or `tolerance` is out of range.
    ///
    /// Examples
    /// --------
    /// >>> arm.identifiable_inertia()
    /// Identifiable(6 of 20)
    #[pyo3(signature = (*, seed=0, tolerance=1e-8))]
    fn identifiable_inertia(
        &self,
        py: Python<'_>,
        #[pyo3(from_py_with = crate::values::seed)] seed: u64,
        tolerance: f64,
    ) -> PyResult<Identifiable> {
        let least = self::tolerance(tolerance)?;
        let (core, gravity) = (&self.core, self.core.gravity());
        let own = py.detach(|| {
            let W = structural_regressor(&core.tree, gravity, seed)?;
            Ok(calibration::Identifiable::of(&W, least))
        });
        let own = own.map_err(|e: calibration::CalibrationError| refuse(e))?;
        Ok(Identifiable { own, names: names_of_inertia(core) })
    }

    /// Fit the inertial parameters to measured motion and forces.
    ///
    /// Parameters
    /// ----------
    /// q : array_like, shape (n, nq)
    ///     Measured configurations, rad and m.
    /// v : array_like, shape (n, nv)
    ///     Measured rates, rad/s and m/s.
    /// vdot : array_like, shape (n, nv)
    ///     Measured accelerations, rad/s² and m/s².
    /// tau : array_like, shape (n, nv)
    ///     Measured forces, N m and N. Subtract friction first, because it is not part of the model.
    /// tolerance : float
    ///     Threshold as in `identifiable_inertia`. Use a larger one for noisy data.
    ///
    /// Returns
    /// -------
    /// Calibration
    ///     Fitted parameters, kg, kg m, kg m². Rotor inertias (armatures) are not fitted.
    ///
    /// Raises
    /// ------
    /// LinkworkError
    ///     If the mechanism has flexible bodies, there are too few states, or an array has a wrong shape or contains NaN.
    ///
    /// Examples
    /// --------
    /// >>> q, v, a = np.random.default_rng(2).normal(size=(3, 30, 2))
    /// >>> found = arm.fit_inertia(q, v, a, arm.inverse_dynamics(q, v, a))
    /// >>> bool(np.allclose(found.parameters, arm.inertial_parameters()))
    /// True
    #[pyo3(signature = (q, v, vdot, tau, *, tolerance=1e-6))]
    fn fit_inertia(
        &self,
        py: Python<'_>,
        q: ArrayLike<'_, '_>,
        v: ArrayLike<'_, '_>,
        vdot: ArrayLike<'_, '_>,
        tau: ArrayLike<'_, '_>,
        tolerance: f64,
    ) -> PyResult<Calibration> {
        let least = self::tolerance(tolerance)?;
        let core = &self.core;
        let (nq, nv) = (core.nq(), core.nv());
        let (q, n) = rows(q, nq, "q")?;
        let mut others = Vec::new();
        for (given, what) in [(v, "v"), (vdot, "vdot"), (tau, "tau")] {
            let (x, count) = rows(given, nv, what)?;
            if count != n {
                let fact = format!("`{what}` has {count} rows, `q` has {n}");
                return Err(refuse_with(fact, "give the same number of rows"));
            }
            others.push(x.slice().to_vec());
        }
        let (q, gravity) = (q.slice().to_vec(), core.gravity());
        let found = py.detach(|| {
            let mut data = InertialData::new(&core.tree, gravity)?;
            for k in 0..n {
                let [v, a, tau] = [0, 1, 2].map(|i: usize| &others[i][nv * k..nv * (k + 1)]);
                data.add(&q[nq * k..nq * (k + 1)], v, a, tau)?;
            }
            data.fit(least)
        });
        let found = found.map_err(|e: calibration::CalibrationError| refuse(e))?;
        let unphysical: Vec<String> = (core.mbs.bodies().iter().zip(&found.inertias))
            .filter(|(_, i)| i.is_none())
            .map(|(b, _)| b.name().to_owned())
            .collect();
        let mut mechanism = None;
        if unphysical.is_empty() {
            let mut builder = Builder::from(&core.mbs);
            for (body, inertia) in core.mbs.bodies().iter().zip(&found.inertias) {
                let own = builder.bodies_mut().iter_mut().find(|b| b.name == body.name());
                if let (Some(own), Some(i)) = (own, inertia) {
                    own.mass = MassProperties::new(i.mass(), i.com(), i.inertia_com());
                }
            }
            mechanism = Some(Py::new(py, self.with(&builder)?)?);
        }
        let fit = found.fit;
        let told = Identifiable { own: fit.identifiable, names: names_of_inertia(core) };
        Ok(Calibration {
            identifiable: Py::new(py, told)?,
            base: fit.base,
            deviations: fit.deviations,
            parameters: fit.parameters,
            residual: fit.residual,
            unphysical,
            mechanism,
        })
    }

    /// Fit the hinge frames between the world and a node, and the node's frame, to measured positions of the node.
    ///
    /// Parameters
    /// ----------
    /// node : str
    ///     Name of the node.
    /// q : array_like, shape (n, nq)
    ///     Configurations, rad and m.
    /// places : array_like, shape (n, 3) or (n, 7)
    ///     Measured positions, m, or positions and attitudes [x y z qx qy qz qw], in the world.
    /// length : float
    ///     Length, m, that weights 1 rad of attitude error (default: 1).
    /// tolerance : float
    ///     Threshold as in `identifiable_inertia`.
    ///
    /// Returns
    /// -------
    /// Calibration
    ///     Corrections of each frame: rotations about its own axes, rad, and translations along them, m. Corrections that are not identifiable
    ///     are zero. `mechanism` has the corrected frames.
    ///
    /// Raises
    /// ------
    /// LinkworkError
    ///     If the node does not exist, there are too few measurements, the iteration does not converge, or an array has a wrong shape or contains
    ///     NaN.
    ///
    /// Examples
    /// --------
    /// >>> q = np.random.default_rng(3).uniform(-3, 3, size=(20, 2))
    /// >>> seen = [arm.state(x).position("tip") + [0, 0.002, 0] for x in q]
    /// >>> found = arm.calibrate_frames("tip", q, seen)
    /// >>> found.residual < 1e-9, found.mechanism.state(q[0]).position("tip")[1].round(6).item()
    /// (True, 0.002)
    #[pyo3(signature = (node, q, places, *, length=1.0, tolerance=1e-6))]
    fn calibrate_frames(
        &self,
        py: Python<'_>,
        node: &str,
        q: ArrayLike<'_, '_>,
        places: ArrayLike<'_, '_>,
        length: f64,
        tolerance: f64,
    ) -> PyResult<Calibration> {
        let least = self::tolerance(tolerance)?;
        if !(length > 0.0 && length.is_finite()) {
            return Err(refuse_with(
                format!("`length` is {length}"),
                "give a length above zero, m",
            ));
        }
        let core = &self.core;
        let id = core.mbs.node(node).ok_or_else(|| {
            let known: Vec<&str> = core.mbs.nodes().iter().map(|n| n.name()).collect();
            let help = linkwork_runtime::remedy(node, "nodes", &known);
            refuse_with(format!("there is no node `{node}`"), help)
        })?;
        let nq = core.nq();
        let (q, n) = rows(q, nq, "q")?;
        let seen = Input::read(places, "places")?;
        let width = match seen.shape() {
            [rows, width @ (3 | 7)] if *rows == n => *width,
            shape => {
                let fact = format!("`places` has the shape {shape:?}");
                return Err(refuse_with(fact, format!("give it the shape ({n}, 3) or ({n}, 7)")));
            }
        };
        let mut all = Vec::with_capacity(n);
        for (q, x) in q.slice().chunks_exact(nq.max(1)).zip(seen.slice().chunks_exact(width)) {
            let attitude = match x {
                [_, _, _, a, b, c, w] => {
                    let raw = Quaternion::new(*w, *a, *b, *c);
                    if !((raw.norm() - 1.0).abs() < 1e-6) {
                        let fact =
                            format!("a quaternion of `places` has the length {}", raw.norm());
                        return Err(refuse_with(fact, "give [x y z qx qy qz qw] of length 1"));
                    }
                    Some(Quat::from_quaternion(raw))
                }
                _ => None,
            };
            all.push(Placed { q: q.to_vec(), position: Vec3::new(x[0], x[1], x[2]), attitude });
        }
        let found = py
            .detach(|| calibrate_kinematics(&core.mbs, id, &all, length, least))
            .map_err(refuse)?;
        let each = ["rx", "ry", "rz", "px", "py", "pz"];
        let names = found.corrections.iter().flat_map(|(body, _)| {
            let of = body.as_deref().unwrap_or(node);
            each.map(|p| format!("{of}.{p}"))
        });
        let told = Identifiable { names: names.collect(), own: found.identifiable };
        let parameters: Vec<f64> = found.corrections.iter().flat_map(|(_, d)| *d).collect();
        let base = (told.own.combinations.row_iter())
            .map(|row| row.iter().zip(&parameters).map(|(c, p)| c * p).sum())
            .collect();
        Ok(Calibration {
            identifiable: Py::new(py, told)?,
            base,
            deviations: found.deviations,
            parameters,
            residual: found.residuals[1],
            unphysical: Vec::new(),
            mechanism: Some(Py::new(py, self.with(&found.mechanism)?)?),
        })
    }
}
