//! `State`: a mechanism at q and v, whose kinematics was done once; poses, velocities,
//! accelerations, momentum and energies are read from it.
use crate::array::vector;
use crate::array::{Array1, Array2, checked1, out_force, out_motion, out_pose, out_vec3, out2};
use crate::core::{Core, lock};
use crate::error::{refuse, refuse_with};
use linkwork_dynamics::{self as dynamics, Tree, Workspace};
use linkwork_spatial::{Pose, Vec3, skew};
use numpy::PyArray1;
use pyo3::prelude::*;
use std::sync::{Arc, Mutex};

/// A mechanism at a configuration and velocity. Make it with `Mechanism.state(q, v)`.
///
/// A *frame* is the name of a node, or of a body (its origin). All vectors are in world axes;
/// spatial ones have the angular part first. Accelerations are known after `forward_dynamics` or
/// `inverse_dynamics` of this state.
#[pyclass(frozen, weakref, module = "linkwork")]
pub struct State {
    core: Arc<Core>,
    q: Vec<f64>,
    v: Vec<f64>,
    gravity: Vec3,
    inner: Mutex<Inner>,
}

struct Inner {
    /// Given back to the mechanism at the end.
    ws: Option<Workspace>,
    /// Whether accelerations are those of this state.
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
    /// Does the kinematics.
    pub fn new(core: Arc<Core>, q: Vec<f64>, v: Vec<f64>) -> Self {
        let (mut ws, gravity) = (core.workspace(), core.gravity());
        dynamics::kinematics(&core.tree, &mut ws, &q, &v);
        let inner = Mutex::new(Inner { ws: Some(ws), accelerations: false });
        Self { core, q, v, gravity, inner }
    }

    fn with<R>(&self, f: impl FnOnce(&Tree, &mut Workspace) -> R) -> R {
        let mut inner = lock(&self.inner);
        // There from the beginning to the end.
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
            "the accelerations of this state are not known",
            "call forward_dynamics(tau) or inverse_dynamics(vdot) first",
        ))
    }
}

#[pymethods]
impl State {
    /// The configuration (nq,), a copy.
    #[getter]
    fn q<'py>(&self, py: Python<'py>) -> Array1<'py> {
        PyArray1::from_slice(py, &self.q)
    }
    /// The velocity (nv,), a copy.
    #[getter]
    fn v<'py>(&self, py: Python<'py>) -> Array1<'py> {
        PyArray1::from_slice(py, &self.v)
    }

    /// Pose (4, 4) of a frame in the world: [[R, p], [0, 0, 0, 1]], m.
    fn pose<'py>(&self, py: Python<'py>, frame: &str) -> PyResult<Array2<'py>> {
        out_pose(py, &self.node_pose(frame)?)
    }
    /// Position (3,) of a frame's origin in the world, m.
    fn position<'py>(&self, py: Python<'py>, frame: &str) -> PyResult<Array1<'py>> {
        Ok(out_vec3(py, &self.node_pose(frame)?.position))
    }
    /// Attitude of a frame: quaternion (4,) [x y z w], frame to world.
    fn quaternion<'py>(&self, py: Python<'py>, frame: &str) -> PyResult<Array1<'py>> {
        let q = self.node_pose(frame)?.rotation;
        Ok(PyArray1::from_slice(py, &[q.i, q.j, q.k, q.w]))
    }
    /// Velocity (6,) of a frame: angular (rad/s), that of its origin (m/s).
    fn velocity<'py>(&self, py: Python<'py>, frame: &str) -> PyResult<Array1<'py>> {
        let V = self.at(frame, |tree, ws, n| ws.node_velocity(tree, n))?;
        Ok(out_motion(py, &V))
    }
    /// Acceleration (6,) of a frame: angular (rad/s²), second derivative of its origin's position
    /// (m/s²). A body at rest reads zero; an accelerometer takes gravity off.
    fn acceleration<'py>(&self, py: Python<'py>, frame: &str) -> PyResult<Array1<'py>> {
        self.known()?;
        let a = self.at(frame, |tree, ws, n| ws.node_acceleration(tree, n))?;
        Ok(out_motion(py, &a))
    }
    /// Acceleration (6,) that a frame would have with vdot = 0: dJ/dt v of its Jacobian J.
    fn bias_acceleration<'py>(&self, py: Python<'py>, frame: &str) -> PyResult<Array1<'py>> {
        let a = self.at(frame, |tree, ws, n| ws.node_bias_acceleration(tree, n))?;
        Ok(out_motion(py, &a))
    }

    /// Centre of mass (3,) of one body in the world, m; its origin when it has no mass.
    fn body_com<'py>(&self, py: Python<'py>, body: &str) -> PyResult<Array1<'py>> {
        let body = self.core.body(body)?;
        Ok(out_vec3(py, &self.with(|tree, ws| ws.body_com(tree, body))))
    }
    /// Inertia (6, 6) of a body and all that hangs on it, as if frozen: about the body's origin,
    /// world axes: [[J, m c~], [-m c~, m 1]], kg m², kg m, kg.
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
    /// Centre of mass (3,) of all bodies that can move, m.
    fn center_of_mass<'py>(&self, py: Python<'py>) -> Array1<'py> {
        out_vec3(py, &self.with(|tree, ws| dynamics::center_of_mass(tree, ws)))
    }
    /// Velocity (3,) of that centre of mass, m/s.
    fn com_velocity<'py>(&self, py: Python<'py>) -> Array1<'py> {
        out_vec3(py, &self.with(|tree, ws| dynamics::com_velocity(tree, ws)))
    }
    /// Acceleration (3,) of that centre of mass, m/s².
    fn com_acceleration<'py>(&self, py: Python<'py>) -> PyResult<Array1<'py>> {
        self.known()?;
        Ok(out_vec3(py, &self.with(|tree, ws| dynamics::com_acceleration(tree, ws))))
    }
    /// Momentum (6,) of all bodies that can move: angular about their centre of mass (kg m²/s),
    /// linear (kg m/s). Spin of rotors against their bodies is not part of it.
    fn momentum<'py>(&self, py: Python<'py>) -> Array1<'py> {
        out_force(py, &self.with(|tree, ws| dynamics::momentum(tree, ws)))
    }
    /// Kinetic energy, J, rotors included: ½ vᵀ M v.
    fn kinetic_energy(&self) -> f64 {
        self.with(|tree, ws| dynamics::kinetic_energy(tree, ws, &self.v))
    }
    /// Potential energy in uniform gravity, J: −Σ m g·c, zero with all masses at the world's
    /// origin.
    fn potential_energy(&self) -> f64 {
        self.with(|tree, ws| dynamics::potential_energy(tree, ws))
    }

    /// Adds a wrench (6,) on a frame until `clear_wrenches`: moment about its origin (N m), force
    /// (N), world axes.
    fn add_wrench(&self, frame: &str, wrench: &Bound<'_, PyAny>) -> PyResult<()> {
        let f = crate::array::wrench(wrench, "wrench")?;
        let node = self.core.frame(frame)?;
        self.with(|tree, ws| ws.add_wrench_at_node(tree, node, f));
        lock(&self.inner).accelerations = false;
        Ok(())
    }
    /// Forgets all wrenches; gravity stays.
    fn clear_wrenches(&self) {
        self.with(|_, ws| {
            ws.clear_forces();
            ws.apply_uniform_gravity(self.gravity);
        });
        lock(&self.inner).accelerations = false;
    }

    /// Accelerations (nv,) from forces tau (nv,), with gravity and the wrenches. At prescribed
    /// coordinates the acceleration is that of `vdot` (nv,), zero when left out, and `tau` is not
    /// read.
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
    /// Forces (nv,) that produce the accelerations vdot (nv,), with gravity and the wrenches.
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
