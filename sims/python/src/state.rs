//! `State`: a mechanism at q and v with computed kinematics, from which poses, velocities, accelerations, momentum and energies are read.
use crate::array::vector;
use crate::array::{
    Array1, Array2, checked1, out_force, out_motion, out_number, out_pose, out_vec3, out2,
};
use crate::core::{Core, lock};
use crate::error::{refuse, refuse_with};
use linkwork_dynamics::{self as dynamics, Tree, Workspace};
use linkwork_spatial::{Pose, Vec3, skew};
use numpy::PyArray1;
use pyo3::prelude::*;
use std::sync::{Arc, Mutex};

/// A mechanism at one configuration and velocity, whose kinematics is computed once.
///
/// Create it with `Mechanism.state(q, v)`.
///
/// Notes
/// -----
/// A *frame* is the name of a node or of a body (its origin). All vectors are in world axes; spatial vectors have the angular part first.
///
/// Accelerations are available after a call of `forward_dynamics` or `inverse_dynamics` of this state.
///
/// Examples
/// --------
/// >>> import numpy as np, linkwork
/// >>> pin, parts = linkwork.Hinge.pin([0, 1, 0]), linkwork.Builder()
/// >>> parts = parts.body("upper", "world", pin.limits(-2, 2, rate=3, effort=40), mass=2, com=[0, 0, -0.5], inertia=np.diag([0.2, 0.2, 0.01]))
/// >>> parts = parts.body("lower", "upper", pin, mass=1, com=[0, 0, -0.4], inertia=np.diag([0.1, 0.1, 0.01]), hinge_in_parent=[0, 0, -1])
/// >>> arm = parts.node("tip", "lower", [0, 0, -0.8]).build()
/// >>> q, v = np.array([0.3, -0.7]), np.array([0.1, 0.4])
/// >>> state = arm.state(q, v)
#[pyclass(frozen, weakref, module = "linkwork")]
pub struct State {
    core: Arc<Core>,
    q: Vec<f64>,
    v: Vec<f64>,
    gravity: Vec3,
    inner: Mutex<Inner>,
}

struct Inner {
    /// Returned to the mechanism when the state is dropped.
    ws: Option<Box<Workspace>>,
    /// Whether the accelerations belong to this state.
    accelerations: bool,
}

impl Drop for State {
    fn drop(&mut self) {
        if let Some(ws) = lock(&self.inner).ws.take() {
            self.core.give_back(ws);
        }
    }
}

impl State {
    /// Computes the kinematics.
    pub fn new(core: Arc<Core>, q: Vec<f64>, v: Vec<f64>) -> Self {
        let (mut ws, gravity) = (core.workspace(), core.gravity());
        dynamics::kinematics(&core.tree, &mut ws, &q, &v);
        let inner = Mutex::new(Inner { ws: Some(ws), accelerations: false });
        Self { core, q, v, gravity, inner }
    }

    fn with<R>(&self, f: impl FnOnce(&Tree, &mut Workspace) -> R) -> R {
        let mut inner = lock(&self.inner);
        // The workspace exists until the state is dropped.
        let ws = inner.ws.get_or_insert_with(|| self.core.workspace());
        f(&self.core.tree, ws)
    }

    fn at<R>(
        &self,
        frame: &str,
        f: impl FnOnce(&Tree, &Workspace, linkwork_multibody::NodeId) -> R,
    ) -> PyResult<R> {
        let node = self.core.frame(frame)?;
        Ok(self.with(|tree, ws| f(tree, ws, node)))
    }

    fn node_pose(&self, frame: &str) -> PyResult<Pose> {
        self.at(frame, |tree, ws, n| ws.node_pose(tree, n))
    }

    fn known(&self) -> PyResult<()> {
        if lock(&self.inner).accelerations {
            return Ok(());
        }
        Err(refuse_with(
            "the accelerations of this state are not computed yet",
            "call forward_dynamics(tau) or inverse_dynamics(vdot) first",
        ))
    }
}

#[pymethods]
impl State {
    /// The configuration (nq,), rad and m; a copy.
    ///
    /// Examples
    /// --------
    /// >>> state.q.tolist()
    /// [0.3, -0.7]
    #[getter]
    fn q<'py>(&self, py: Python<'py>) -> Array1<'py> {
        PyArray1::from_slice(py, &self.q)
    }
    /// The rates (nv,), rad/s and m/s; a copy.
    ///
    /// Examples
    /// --------
    /// >>> state.v.tolist()
    /// [0.1, 0.4]
    #[getter]
    fn v<'py>(&self, py: Python<'py>) -> Array1<'py> {
        PyArray1::from_slice(py, &self.v)
    }

    /// Return the pose of a frame in the world.
    ///
    /// Parameters
    /// ----------
    /// frame : str
    ///     Name of a node or a body.
    ///
    /// Returns
    /// -------
    /// ndarray, shape (4, 4)
    ///     [[R, p], [0, 0, 0, 1]] with the rotation R from frame to world and the position p, m.
    ///
    /// Raises
    /// ------
    /// LinkworkError
    ///     If the name does not exist.
    ///
    /// Examples
    /// --------
    /// >>> state.pose("tip").round(6)[:3, 3].tolist()
    /// [0.016014, 0.0, -1.692185]
    fn pose<'py>(&self, py: Python<'py>, frame: &str) -> PyResult<Array2<'py>> {
        out_pose(py, &self.node_pose(frame)?)
    }
    /// Return the position of a frame's origin in the world.
    ///
    /// Parameters
    /// ----------
    /// frame : str
    ///     Name of a node or a body.
    ///
    /// Returns
    /// -------
    /// ndarray, shape (3,)
    ///     Position, m.
    ///
    /// Raises
    /// ------
    /// LinkworkError
    ///     If the name does not exist.
    ///
    /// Examples
    /// --------
    /// >>> state.position("tip").round(6).tolist()
    /// [0.016014, 0.0, -1.692185]
    fn position<'py>(&self, py: Python<'py>, frame: &str) -> PyResult<Array1<'py>> {
        out_vec3(py, &self.node_pose(frame)?.position)
    }
    /// Return the attitude of a frame.
    ///
    /// Parameters
    /// ----------
    /// frame : str
    ///     Name of a node or a body.
    ///
    /// Returns
    /// -------
    /// ndarray, shape (4,)
    ///     Unit quaternion [x y z w] of the rotation from frame to world.
    ///
    /// Raises
    /// ------
    /// LinkworkError
    ///     If the name does not exist.
    ///
    /// Examples
    /// --------
    /// >>> state.quaternion("upper").round(6).tolist()
    /// [0.0, 0.149438, 0.0, 0.988771]
    fn quaternion<'py>(&self, py: Python<'py>, frame: &str) -> PyResult<Array1<'py>> {
        let q = self.node_pose(frame)?.rotation;
        Ok(PyArray1::from_slice(py, &[q.i, q.j, q.k, q.w]))
    }
    /// Return the velocity of a frame.
    ///
    /// Parameters
    /// ----------
    /// frame : str
    ///     Name of a node or a body.
    ///
    /// Returns
    /// -------
    /// ndarray, shape (6,)
    ///     Angular velocity, rad/s, then velocity of the frame's origin, m/s.
    ///
    /// Raises
    /// ------
    /// LinkworkError
    ///     If the name does not exist.
    ///
    /// Examples
    /// --------
    /// >>> state.velocity("upper").round(6).tolist()
    /// [0.0, 0.1, 0.0, 0.0, 0.0, 0.0]
    fn velocity<'py>(&self, py: Python<'py>, frame: &str) -> PyResult<Array1<'py>> {
        let V = self.at(frame, |tree, ws, n| ws.node_velocity(tree, n))?;
        out_motion(py, &V)
    }
    /// Return the acceleration of a frame.
    ///
    /// The linear part is the second time derivative of the position, so a body at rest has zero. An accelerometer measures it minus gravity.
    ///
    /// Parameters
    /// ----------
    /// frame : str
    ///     Name of a node or a body.
    ///
    /// Returns
    /// -------
    /// ndarray, shape (6,)
    ///     Angular acceleration, rad/s², then acceleration of the frame's origin, m/s².
    ///
    /// Raises
    /// ------
    /// LinkworkError
    ///     If the name does not exist, or the accelerations are not computed yet.
    ///
    /// Examples
    /// --------
    /// >>> _ = state.forward_dynamics([0, 0])
    /// >>> state.acceleration("tip").shape
    /// (6,)
    fn acceleration<'py>(&self, py: Python<'py>, frame: &str) -> PyResult<Array1<'py>> {
        self.known()?;
        let a = self.at(frame, |tree, ws, n| ws.node_acceleration(tree, n))?;
        out_motion(py, &a)
    }
    /// Return the acceleration that a frame has for vdot = 0: dJ/dt v, with J the Jacobian of the frame.
    ///
    /// Parameters
    /// ----------
    /// frame : str
    ///     Name of a node or a body.
    ///
    /// Returns
    /// -------
    /// ndarray, shape (6,)
    ///     Angular part, rad/s², then linear part, m/s².
    ///
    /// Raises
    /// ------
    /// LinkworkError
    ///     If the name does not exist.
    ///
    /// Examples
    /// --------
    /// >>> state.bias_acceleration("upper").round(6).tolist()
    /// [0.0, 0.0, 0.0, 0.0, 0.0, 0.0]
    fn bias_acceleration<'py>(&self, py: Python<'py>, frame: &str) -> PyResult<Array1<'py>> {
        let a = self.at(frame, |tree, ws, n| ws.node_bias_acceleration(tree, n))?;
        out_motion(py, &a)
    }

    /// Return the centre of mass of one body in the world.
    ///
    /// Parameters
    /// ----------
    /// body : str
    ///     Name of a body.
    ///
    /// Returns
    /// -------
    /// ndarray, shape (3,)
    ///     Position, m. A body without mass returns its origin.
    ///
    /// Raises
    /// ------
    /// LinkworkError
    ///     If the name does not exist.
    ///
    /// Examples
    /// --------
    /// >>> state.body_com("upper").round(6).tolist()
    /// [-0.14776, -0.0, -0.477668]
    fn body_com<'py>(&self, py: Python<'py>, body: &str) -> PyResult<Array1<'py>> {
        let body = self.core.body(body)?;
        out_vec3(py, &self.with(|tree, ws| ws.body_com(tree, body)))
    }
    /// Return the spatial inertia of a body and all bodies outboard of it, with their hinges locked.
    ///
    /// Parameters
    /// ----------
    /// body : str
    ///     Name of a body.
    ///
    /// Returns
    /// -------
    /// ndarray, shape (6, 6)
    ///     [[J, m c~], [-m c~, m 1]] about the body's origin in world axes, kg m², kg m, kg.
    ///
    /// Raises
    /// ------
    /// LinkworkError
    ///     If the name does not exist.
    ///
    /// Examples
    /// --------
    /// >>> I = state.subtree_inertia("upper")
    /// >>> float(I[5, 5])
    /// 3.0
    fn subtree_inertia<'py>(&self, py: Python<'py>, body: &str) -> PyResult<Array2<'py>> {
        let body = self.core.body(body)?;
        let I = self.with(|tree, ws| dynamics::subtree_inertia(tree, ws, body));
        let (J, h, mut m) = (I.inertia(), skew(&I.h()), vec![0.0; 36]);
        for i in 0..3 {
            for j in 0..3 {
                m[6 * i + j] = J[(i, j)];
                m[6 * i + j + 3] = h[(i, j)];
                m[6 * (i + 3) + j] = -h[(i, j)];
            }
            m[6 * (i + 3) + i + 3] = I.mass();
        }
        out2(py, m, 6, 6)
    }
    /// Return the common centre of mass of all bodies that can move.
    ///
    /// Returns
    /// -------
    /// ndarray, shape (3,)
    ///     Position, m.
    ///
    /// Examples
    /// --------
    /// >>> state.center_of_mass().round(6).tolist()
    /// [-0.145091, -0.0, -0.759699]
    fn center_of_mass<'py>(&self, py: Python<'py>) -> PyResult<Array1<'py>> {
        out_vec3(py, &self.with(|tree, ws| dynamics::center_of_mass(tree, ws)))
    }
    /// Return the velocity of the centre of mass of all bodies that can move.
    ///
    /// Returns
    /// -------
    /// ndarray, shape (3,)
    ///     Velocity, m/s.
    ///
    /// Examples
    /// --------
    /// >>> state.com_velocity().round(6).tolist()
    /// [-0.125093, 0.0, -0.00626]
    fn com_velocity<'py>(&self, py: Python<'py>) -> PyResult<Array1<'py>> {
        out_vec3(py, &self.with(|tree, ws| dynamics::com_velocity(tree, ws)))
    }
    /// Return the acceleration of the centre of mass of all bodies that can move.
    ///
    /// Returns
    /// -------
    /// ndarray, shape (3,)
    ///     Acceleration, m/s².
    ///
    /// Raises
    /// ------
    /// LinkworkError
    ///     If the accelerations are not computed yet.
    ///
    /// Examples
    /// --------
    /// >>> _ = state.inverse_dynamics([0, 0])
    /// >>> state.com_acceleration().shape
    /// (3,)
    fn com_acceleration<'py>(&self, py: Python<'py>) -> PyResult<Array1<'py>> {
        self.known()?;
        out_vec3(py, &self.with(|tree, ws| dynamics::com_acceleration(tree, ws)))
    }
    /// Return the momentum of all bodies that can move, without the spin of rotors relative to their bodies.
    ///
    /// Returns
    /// -------
    /// ndarray, shape (6,)
    ///     Angular momentum about the centre of mass, kg m²/s, then linear momentum, kg m/s.
    ///
    /// Examples
    /// --------
    /// >>> bool(np.allclose(state.momentum()[3:], 3 * state.com_velocity()))
    /// True
    fn momentum<'py>(&self, py: Python<'py>) -> PyResult<Array1<'py>> {
        out_force(py, &self.with(|tree, ws| dynamics::momentum(tree, ws)))
    }
    /// Return the kinetic energy ½ vᵀ M v, including rotors.
    ///
    /// Returns
    /// -------
    /// float
    ///     Energy, J.
    ///
    /// Examples
    /// --------
    /// >>> round(state.kinetic_energy(), 6)
    /// 0.056297
    fn kinetic_energy(&self) -> PyResult<f64> {
        out_number(self.with(|tree, ws| dynamics::kinetic_energy(tree, ws, &self.v)))
    }
    /// Return the potential energy −Σ m g·c in uniform gravity. It is zero if all masses are at the world's origin.
    ///
    /// Returns
    /// -------
    /// float
    ///     Energy, J.
    ///
    /// Examples
    /// --------
    /// >>> round(state.potential_energy(), 6)
    /// -22.357945
    fn potential_energy(&self) -> PyResult<f64> {
        out_number(self.with(|tree, ws| dynamics::potential_energy(tree, ws)))
    }

    /// Add an external wrench on a frame. It acts until `clear_wrenches`.
    ///
    /// Parameters
    /// ----------
    /// frame : str
    ///     Name of a node or a body.
    /// wrench : array_like, shape (6,)
    ///     Moment about the frame's origin, N m, then force, N, in world axes.
    ///
    /// Raises
    /// ------
    /// LinkworkError
    ///     If a name does not exist, or an array has a wrong shape or contains NaN.
    ///
    /// Examples
    /// --------
    /// >>> state.add_wrench("tip", [0, 0, 0, 0, 0, -5])
    /// >>> state.inverse_dynamics([0, 0]).round(6).tolist()
    /// [4.251801, -3.088328]
    fn add_wrench(&self, frame: &str, wrench: &Bound<'_, PyAny>) -> PyResult<()> {
        let f = crate::array::wrench(wrench, "wrench")?;
        let node = self.core.frame(frame)?;
        self.with(|tree, ws| ws.add_wrench_at_node(tree, node, f));
        lock(&self.inner).accelerations = false;
        Ok(())
    }
    /// Remove all external wrenches. Gravity stays.
    ///
    /// Examples
    /// --------
    /// >>> state.add_wrench("tip", [0, 0, 0, 0, 0, -5])
    /// >>> state.clear_wrenches()
    /// >>> bool((state.inverse_dynamics([0, 0]) == arm.bias_forces(q, v)).all())
    /// True
    fn clear_wrenches(&self) {
        self.with(|_, ws| {
            ws.clear_forces();
            ws.apply_uniform_gravity(self.gravity);
        });
        lock(&self.inner).accelerations = false;
    }

    /// Compute the accelerations from generalized forces, gravity and the wrenches.
    ///
    /// Parameters
    /// ----------
    /// tau : array_like, shape (nv,)
    ///     Generalized forces, N m and N. Entries of prescribed coordinates are not read.
    /// vdot : array_like, shape (nv,), optional
    ///     Accelerations of the prescribed coordinates, rad/s² and m/s² (default: zeros).
    ///
    /// Returns
    /// -------
    /// ndarray, shape (nv,)
    ///     Accelerations, rad/s² and m/s².
    ///
    /// Raises
    /// ------
    /// LinkworkError
    ///     If a free coordinate moves no inertia, or an array has a wrong shape or contains NaN.
    ///
    /// Examples
    /// --------
    /// >>> bool(np.allclose(state.forward_dynamics([1, 2]), arm.forward_dynamics(q, v, [1, 2])))
    /// True
    #[pyo3(signature = (tau, vdot=None))]
    fn forward_dynamics<'py>(
        &self,
        tau: &Bound<'py, PyAny>,
        vdot: Option<&Bound<'py, PyAny>>,
    ) -> PyResult<Array1<'py>> {
        let (py, nv) = (tau.py(), self.core.nv());
        let mut tau = vector(tau, nv, "tau")?.slice().to_vec();
        let mut vdot = match vdot {
            Some(a) => vector(a, nv, "vdot")?.slice().to_vec(),
            None => vec![0.0; nv],
        };
        let solve = |tree: &Tree, ws: &mut Workspace| {
            dynamics::forward_dynamics_given_kinematics(tree, ws, &mut tau, &mut vdot)
        };
        self.with(solve).map_err(refuse)?;
        lock(&self.inner).accelerations = true;
        checked1(py, vdot)
    }
    /// Compute the generalized forces that produce given accelerations, with gravity and the wrenches.
    ///
    /// Parameters
    /// ----------
    /// vdot : array_like, shape (nv,)
    ///     Accelerations, rad/s² and m/s².
    ///
    /// Returns
    /// -------
    /// ndarray, shape (nv,)
    ///     Generalized forces, N m and N.
    ///
    /// Raises
    /// ------
    /// LinkworkError
    ///     If an array has a wrong shape or contains NaN.
    ///
    /// Examples
    /// --------
    /// >>> state.inverse_dynamics([0, 0]).round(6).tolist()
    /// [4.331874, -1.530654]
    fn inverse_dynamics<'py>(&self, vdot: &Bound<'py, PyAny>) -> PyResult<Array1<'py>> {
        let (py, nv) = (vdot.py(), self.core.nv());
        let vdot = vector(vdot, nv, "vdot")?;
        let mut tau = vec![0.0; nv];
        self.with(|tree, ws| {
            dynamics::inverse_dynamics_given_kinematics(tree, ws, vdot.slice(), &mut tau);
        });
        lock(&self.inner).accelerations = true;
        checked1(py, tau)
    }

    fn __repr__(&self) -> String {
        format!("State(nq={}, nv={})", self.q.len(), self.v.len())
    }
}
