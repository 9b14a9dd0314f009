//! `Frames`: the motion of any frame relative to any other, computed on demand and cached.
use crate::array::{Array1, Array2, fixed, out_motion, out_pose, out_vec3, pose, vector};
use crate::core::lock;
use crate::error::refuse;
use crate::mechanism::Mechanism;
use linkwork_dynamics::frames::{MechanismId, Pair};
use linkwork_dynamics::{self as dynamics, FrameId, FramesError};
use linkwork_spatial::{Motion, Vec3};
use pyo3::prelude::*;
use std::collections::BTreeMap;
use std::sync::Mutex;

/// All frames of a scene, with the pose, velocity and acceleration of any frame relative to any other.
///
/// A scene contains the bodies and nodes of mechanisms, frames that are fixed on them, frames that are moved from outside (planets, turntables),
/// and mechanisms on any of those.
///
/// Notes
/// -----
/// A frame is named "world", by its own name, or "mechanism/name" for a node or a body. "B seen from A" means: as measured by an observer fixed
/// in A, in the axes of A or of a third frame.
///
/// A query computes only terms that are out of date on the path between the two frames.
///
/// Examples
/// --------
/// >>> crane = linkwork.Builder().body("jib", "world", linkwork.Hinge.pin([0, 0, 1]), mass=2).node("tip", "jib", [1, 0, 0]).build()
/// >>> scene = linkwork.Frames()
/// >>> scene.add_mechanism("crane", crane)
/// >>> scene.set_state("crane", q=[0], v=[2])
/// >>> scene.velocity("crane/tip").tolist()
/// [0.0, 0.0, 2.0, 0.0, 2.0, 0.0]
#[pyclass(frozen, weakref, module = "linkwork")]
pub struct Frames {
    scene: Mutex<Scene>,
}

#[derive(Default)]
struct Scene {
    frames: dynamics::Frames,
    mechanisms: BTreeMap<String, (MechanismId, usize, usize)>,
}

impl Scene {
    fn find(&self, name: &str) -> Result<FrameId, FramesError> {
        if name == "world" {
            return Ok(self.frames.world());
        }
        let own = self.frames.named(name);
        let inside =
            name.split_once('/').and_then(|(m, rest)| Some((self.mechanisms.get(m)?, rest)));
        match (own, inside) {
            (Ok(frame), _) => Ok(frame),
            (Err(_), Some(((m, ..), rest))) => {
                let node = self.frames.node_named(*m, rest);
                node.or_else(|e| self.frames.body_named(*m, rest).map_err(|_| e))
            }
            (Err(e), None) => Err(e),
        }
    }

    fn pair(&mut self, b: &str, a: &str, axes: Option<&str>) -> Result<Pair, FramesError> {
        let (a, b) = (self.find(a)?, self.find(b)?);
        match axes {
            Some(axes) => {
                let axes = self.find(axes)?;
                self.frames.pair_in(a, b, axes)
            }
            None => self.frames.pair(a, b),
        }
    }

    fn mechanism(&self, name: &str) -> Result<(MechanismId, usize, usize), FramesError> {
        self.mechanisms.get(name).copied().ok_or_else(|| {
            let known: Vec<&str> = self.mechanisms.keys().map(String::as_str).collect();
            let help = linkwork_runtime::remedy(name, "mechanisms", &known);
            FramesError::Unknown { what: "mechanism", name: name.into(), help }
        })
    }
}

fn motion(given: Option<&Bound<'_, PyAny>>, what: &str) -> PyResult<Motion> {
    let Some(given) = given else { return Ok(Motion::zero()) };
    let [a, b, c, x, y, z] = fixed::<6>(given, what)?;
    Ok(Motion::new(Vec3::new(a, b, c), Vec3::new(x, y, z)))
}

#[pymethods]
impl Frames {
    #[new]
    fn new() -> Self {
        Self { scene: Mutex::default() }
    }

    /// Add all bodies and nodes of a mechanism. It is in its neutral configuration and at rest until `set_state`.
    ///
    /// Parameters
    /// ----------
    /// name : str
    ///     Name of the mechanism in the scene.
    /// mechanism : Mechanism
    ///     The mechanism.
    /// on : str
    ///     Frame that is the mechanism's world (default: "world").
    ///
    /// Raises
    /// ------
    /// LinkworkError
    ///     If the name is in use, or the frame does not exist.
    ///
    /// Examples
    /// --------
    /// >>> scene.add_mechanism("second", crane, on="crane/tip")
    /// >>> scene.position("second/tip").tolist()
    /// [2.0, 0.0, 0.0]
    #[pyo3(signature = (name, mechanism, on="world"))]
    fn add_mechanism(&self, name: String, mechanism: &Mechanism, on: &str) -> PyResult<()> {
        let mut scene = lock(&self.scene);
        let on = scene.find(on).map_err(refuse)?;
        let mbs = &mechanism.core.mbs;
        let id = scene.frames.add_mechanism(&name, mbs, on).map_err(refuse)?;
        scene.mechanisms.insert(name, (id, mbs.nq(), mbs.nv()));
        Ok(())
    }
    /// Add a frame that is fixed on another frame.
    ///
    /// Parameters
    /// ----------
    /// name : str
    ///     Name of the new frame.
    /// on : str
    ///     The frame on which it is fixed.
    /// pose : array_like, optional
    ///     Pose in that frame, m: (3,), (7,) or (4, 4) (default: the same pose).
    ///
    /// Raises
    /// ------
    /// LinkworkError
    ///     If the name is in use, the frame does not exist, or the pose is not valid.
    ///
    /// Examples
    /// --------
    /// >>> scene.add_fixed("camera", "crane/jib", [0, 0, 0.5])
    /// >>> scene.position("camera").tolist()
    /// [0.0, 0.0, 0.5]
    #[pyo3(signature = (name, on="world", pose=None))]
    fn add_fixed(&self, name: &str, on: &str, pose: Option<&Bound<'_, PyAny>>) -> PyResult<()> {
        let X = crate::array::pose(pose, "pose")?;
        let mut scene = lock(&self.scene);
        let on = scene.find(on).map_err(refuse)?;
        scene.frames.add_fixed(name, on, X).map(|_| ()).map_err(refuse)
    }
    /// Add a frame that `set_moving` moves relative to another frame. Initially it is at rest.
    ///
    /// Parameters
    /// ----------
    /// name : str
    ///     Name of the new frame.
    /// on : str
    ///     The frame relative to which it moves.
    /// pose : array_like, optional
    ///     Initial pose in that frame, m: (3,), (7,) or (4, 4).
    ///
    /// Raises
    /// ------
    /// LinkworkError
    ///     If the name is in use, the frame does not exist, or the pose is not valid.
    ///
    /// Examples
    /// --------
    /// >>> scene.add_moving("deck", pose=[0, 0, 3])
    /// >>> scene.position("crane/tip", "deck").tolist()
    /// [1.0, 0.0, -3.0]
    #[pyo3(signature = (name, on="world", pose=None))]
    fn add_moving(&self, name: &str, on: &str, pose: Option<&Bound<'_, PyAny>>) -> PyResult<()> {
        let X = crate::array::pose(pose, "pose")?;
        let mut scene = lock(&self.scene);
        let on = scene.find(on).map_err(refuse)?;
        scene.frames.add_moving(name, on, X).map(|_| ()).map_err(refuse)
    }
    /// Fix a frame, with all frames on it, on another frame.
    ///
    /// Parameters
    /// ----------
    /// name : str
    ///     A frame that was added by name.
    /// on : str
    ///     The frame on which it is fixed from now on.
    /// pose : array_like, optional
    ///     Pose in that frame, m: (3,), (7,) or (4, 4).
    ///
    /// Raises
    /// ------
    /// LinkworkError
    ///     If a frame does not exist, the frame would be fixed on itself, or the pose is not valid.
    ///
    /// Examples
    /// --------
    /// >>> scene.add_fixed("load", "world", [3, 0, 0])
    /// >>> scene.fix("load", "crane/tip", [0, 0, -0.5])
    /// >>> scene.position("load").tolist()
    /// [1.0, 0.0, -0.5]
    #[pyo3(signature = (name, on, pose=None))]
    fn fix(&self, name: &str, on: &str, pose: Option<&Bound<'_, PyAny>>) -> PyResult<()> {
        let X = crate::array::pose(pose, "pose")?;
        let mut scene = lock(&self.scene);
        let (frame, on) = (scene.find(name).map_err(refuse)?, scene.find(on).map_err(refuse)?);
        scene.frames.fix(frame, on, X).map_err(refuse)
    }

    /// Set the state of a mechanism. Omitted quantities do not change.
    ///
    /// Parameters
    /// ----------
    /// name : str
    ///     Name of the mechanism in the scene.
    /// q : array_like, shape (nq,), optional
    ///     Configuration, rad and m.
    /// v : array_like, shape (nv,), optional
    ///     Rates, rad/s and m/s.
    /// vdot : array_like, shape (nv,), optional
    ///     Accelerations, rad/s² and m/s².
    ///
    /// Raises
    /// ------
    /// LinkworkError
    ///     If the mechanism does not exist, or an array has a wrong shape or contains NaN.
    ///
    /// Examples
    /// --------
    /// >>> scene.set_state("crane", v=[3], vdot=[1])
    /// >>> scene.acceleration("crane/tip").tolist()
    /// [0.0, 0.0, 1.0, -9.0, 1.0, 0.0]
    #[pyo3(signature = (mechanism, q=None, v=None, vdot=None))]
    fn set_state(
        &self,
        mechanism: &str,
        q: Option<&Bound<'_, PyAny>>,
        v: Option<&Bound<'_, PyAny>>,
        vdot: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<()> {
        let (id, nq, nv) = lock(&self.scene).mechanism(mechanism).map_err(refuse)?;
        let q = q.map(|q| vector(q, nq, "q")).transpose()?;
        let v = v.map(|v| vector(v, nv, "v")).transpose()?;
        let vdot = vdot.map(|a| vector(a, nv, "vdot")).transpose()?;
        let frames = &mut lock(&self.scene).frames;
        let q = q.map_or(Ok(()), |q| frames.set_q(id, q.slice()));
        let v = v.map_or(Ok(()), |v| frames.set_v(id, v.slice()));
        let vdot = vdot.map_or(Ok(()), |a| frames.set_vdot(id, a.slice()));
        q.and(v).and(vdot).map_err(refuse)
    }
    /// Set the motion of a moving frame relative to the frame on which it is, in the axes of that frame.
    ///
    /// Parameters
    /// ----------
    /// name : str
    ///     A frame that was added by `add_moving`.
    /// pose : array_like
    ///     Pose, m: (3,), (7,) or (4, 4).
    /// velocity : array_like, shape (6,), optional
    ///     [ω; v], rad/s and m/s (default: zeros).
    /// acceleration : array_like, shape (6,), optional
    ///     [α; a], rad/s² and m/s² (default: zeros).
    ///
    /// Raises
    /// ------
    /// LinkworkError
    ///     If the frame is not a moving frame, or an array has a wrong shape or contains NaN.
    ///
    /// Examples
    /// --------
    /// >>> scene.add_moving("deck")
    /// >>> scene.set_moving("deck", [0, 0, 1], velocity=[0, 0, 0, 0.5, 0, 0])
    /// >>> scene.velocity("deck").tolist()
    /// [0.0, 0.0, 0.0, 0.5, 0.0, 0.0]
    #[pyo3(signature = (name, pose, velocity=None, acceleration=None))]
    fn set_moving(
        &self,
        name: &str,
        pose: &Bound<'_, PyAny>,
        velocity: Option<&Bound<'_, PyAny>>,
        acceleration: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<()> {
        let X = self::pose(Some(pose), "pose")?;
        let V = motion(velocity, "velocity")?;
        let A = motion(acceleration, "acceleration")?;
        let mut scene = lock(&self.scene);
        let frame = scene.find(name).map_err(refuse)?;
        scene.frames.set_moving(frame, X, V, A).map_err(refuse)
    }

    /// Return the pose of a frame in another frame.
    ///
    /// Parameters
    /// ----------
    /// frame : str
    ///     The frame.
    /// seen_from : str
    ///     The reference frame (default: "world").
    ///
    /// Returns
    /// -------
    /// ndarray, shape (4, 4)
    ///     Homogeneous matrix; positions in m.
    ///
    /// Raises
    /// ------
    /// LinkworkError
    ///     If the frame does not exist.
    ///
    /// Examples
    /// --------
    /// >>> scene.pose("crane/tip")[:3, 3].tolist()
    /// [1.0, 0.0, 0.0]
    #[pyo3(signature = (frame, seen_from="world"))]
    fn pose<'py>(&self, py: Python<'py>, frame: &str, seen_from: &str) -> PyResult<Array2<'py>> {
        let mut scene = lock(&self.scene);
        let pair = scene.pair(frame, seen_from, None).map_err(refuse)?;
        out_pose(py, &scene.frames.pose(pair))
    }
    /// Return the position of a frame's origin relative to the origin of another frame.
    ///
    /// Parameters
    /// ----------
    /// frame : str
    ///     The frame.
    /// seen_from : str
    ///     The reference frame (default: "world").
    /// axes : str, optional
    ///     Frame in whose axes the result is expressed (default: `seen_from`).
    ///
    /// Returns
    /// -------
    /// ndarray, shape (3,)
    ///     Position, m.
    ///
    /// Raises
    /// ------
    /// LinkworkError
    ///     If the frame does not exist.
    ///
    /// Examples
    /// --------
    /// >>> scene.set_state("crane", q=[np.pi / 2])
    /// >>> scene.position("crane/tip").round(9).tolist()
    /// [0.0, 1.0, 0.0]
    /// >>> scene.position("crane/tip", axes="crane/jib").round(9).tolist()
    /// [1.0, 0.0, 0.0]
    #[pyo3(signature = (frame, seen_from="world", axes=None))]
    fn position<'py>(
        &self,
        py: Python<'py>,
        frame: &str,
        seen_from: &str,
        axes: Option<&str>,
    ) -> PyResult<Array1<'py>> {
        let mut scene = lock(&self.scene);
        let pair = scene.pair(frame, seen_from, axes).map_err(refuse)?;
        out_vec3(py, &scene.frames.position(pair))
    }
    /// Return the velocity of a frame as measured by an observer fixed in another frame.
    ///
    /// Parameters
    /// ----------
    /// frame : str
    ///     The frame.
    /// seen_from : str
    ///     The frame of the observer (default: "world").
    /// axes : str, optional
    ///     Frame in whose axes the result is expressed (default: `seen_from`).
    ///
    /// Returns
    /// -------
    /// ndarray, shape (6,)
    ///     [ω; v], rad/s and m/s.
    ///
    /// Raises
    /// ------
    /// LinkworkError
    ///     If the frame does not exist.
    ///
    /// Examples
    /// --------
    /// >>> scene.velocity("crane/tip", "crane/jib").tolist()
    /// [0.0, 0.0, 0.0, 0.0, 0.0, 0.0]
    #[pyo3(signature = (frame, seen_from="world", axes=None))]
    fn velocity<'py>(
        &self,
        py: Python<'py>,
        frame: &str,
        seen_from: &str,
        axes: Option<&str>,
    ) -> PyResult<Array1<'py>> {
        let mut scene = lock(&self.scene);
        let pair = scene.pair(frame, seen_from, axes).map_err(refuse)?;
        out_motion(py, &scene.frames.velocity(pair))
    }
    /// Return the acceleration of a frame as measured by an observer fixed in another frame.
    ///
    /// Parameters
    /// ----------
    /// frame : str
    ///     The frame.
    /// seen_from : str
    ///     The frame of the observer (default: "world").
    /// axes : str, optional
    ///     Frame in whose axes the result is expressed (default: `seen_from`).
    ///
    /// Returns
    /// -------
    /// ndarray, shape (6,)
    ///     [α; a], rad/s² and m/s².
    ///
    /// Raises
    /// ------
    /// LinkworkError
    ///     If the frame does not exist.
    ///
    /// Examples
    /// --------
    /// >>> scene.acceleration("crane/tip").tolist()
    /// [0.0, 0.0, 0.0, -4.0, 0.0, 0.0]
    #[pyo3(signature = (frame, seen_from="world", axes=None))]
    fn acceleration<'py>(
        &self,
        py: Python<'py>,
        frame: &str,
        seen_from: &str,
        axes: Option<&str>,
    ) -> PyResult<Array1<'py>> {
        let mut scene = lock(&self.scene);
        let pair = scene.pair(frame, seen_from, axes).map_err(refuse)?;
        out_motion(py, &scene.frames.acceleration(pair))
    }
    /// Number of subhinge terms computed so far: (poses, velocities, accelerations).
    ///
    /// Examples
    /// --------
    /// >>> scene.counts
    /// (1, 1, 0)
    #[getter]
    fn counts(&self) -> (u64, u64, u64) {
        let [pose, velocity, acceleration] = lock(&self.scene).frames.counts().edges;
        (pose, velocity, acceleration)
    }
    fn __repr__(&self) -> String {
        let scene = lock(&self.scene);
        let names: Vec<&str> = scene.mechanisms.keys().map(String::as_str).collect();
        format!("Frames(mechanisms: {})", names.join(", "))
    }
}
