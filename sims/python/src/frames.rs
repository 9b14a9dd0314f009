//! `Frames`: any frame seen from any other; computed when asked, and once.
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

/// All frames of a scene: bodies and nodes of mechanisms, frames fixed on them, frames that are moved
/// from outside (planets, turntables), and mechanisms on any of those.
///
/// A frame goes by name: "world", a name of its own, or "mechanism/name" for a node or body. For B
/// seen from A: what an observer fixed in A sees, in the axes of A or of a third frame. A question
/// computes what is out of date on the path between the two, and nothing else.
///
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

    /// Adds all bodies and nodes of a mechanism under a name; its world is the frame `on`. It is
    /// neutral and at rest until `set_state`.
    /// Raises LinkworkError for a name that is taken, and for a frame that is not there.
    ///
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
    /// Adds a frame that is fixed on another, at a pose (3,), (7,) or (4, 4) in it. Places in m.
    /// Raises LinkworkError for a name that is taken, a frame that is not there, and what is no pose.
    ///
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
    /// Adds a frame that `set_moving` moves in another; at first it is at rest at the pose.
    /// The pose is (3,), m, (7,) or (4, 4).
    /// Raises LinkworkError for a name that is taken, a frame that is not there, and what is no pose.
    ///
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
    /// Fixes a frame that was added by name on another frame, with all that hangs on it.
    /// The pose is (3,), m, (7,) or (4, 4).
    /// Raises LinkworkError for frames that are not there or would hang on themselves, and for what is no pose.
    ///
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

    /// Configuration (nq,), velocity and acceleration (nv,) of a mechanism; what is left out stays. q in rad and m, v in rad/s and m/s.
    /// Raises LinkworkError for a mechanism that is not there, other shapes, and NaN.
    ///
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
    /// Moves a moving frame: pose, velocity (6,), acceleration (6,) in the frame that it hangs on, as
    /// seen from there and in its axes.
    /// In rad/s, m/s, rad/s², m/s²; zero when left out.
    /// Raises LinkworkError for a frame that is no moving one, other shapes, and NaN.
    ///
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

    /// Pose (4, 4) of a frame in another. Places in m.
    /// Raises LinkworkError for a frame that is not there.
    ///
    /// >>> scene.pose("crane/tip")[:3, 3].tolist()
    /// [1.0, 0.0, 0.0]
    #[pyo3(signature = (frame, seen_from="world"))]
    fn pose<'py>(&self, py: Python<'py>, frame: &str, seen_from: &str) -> PyResult<Array2<'py>> {
        let mut scene = lock(&self.scene);
        let pair = scene.pair(frame, seen_from, None).map_err(refuse)?;
        out_pose(py, &scene.frames.pose(pair))
    }
    /// From the origin of `seen_from` to that of the frame (3,), m, in its axes or in those of `axes`.
    /// Raises LinkworkError for a frame that is not there.
    ///
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
    /// Velocity (6,) [ω; v] of a frame as an observer fixed in `seen_from` sees it: rad/s, m/s.
    /// Raises LinkworkError for a frame that is not there.
    ///
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
    /// Acceleration (6,) [α; a] of a frame as that observer sees it: rad/s², m/s².
    /// Raises LinkworkError for a frame that is not there.
    ///
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
    /// How often terms of subhinges were computed so far: (poses, velocities, accelerations).
    ///
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
