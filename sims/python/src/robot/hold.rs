//! Grasped objects, rigid or with joints.
use super::{ArrayLike, Robot, base};
use crate::array::{Array1, Array2, mat3, out_pose, out1, out2, pose, vec3, vector};
use crate::error::{refuse_with, unless_own};
use crate::mechanism::Mechanism;
use linkwork_embedded::{self as embedded, Closing, ModelSpec, ObjectSpec};
use linkwork_multibody::{BodyId, Multibody};
use linkwork_runtime::remedy;
use linkwork_spatial::MassProperties;
use pyo3::prelude::*;
use pyo3::types::PyDict;

/// Context manager of a grasp: at the end of the `with` block, the hand releases the object. Result of `Robot.grasp`.
///
/// Examples
/// --------
/// >>> lift = linkwork.Builder().body("hand", "world", linkwork.Hinge.slider([0, 0, 1]), mass=1, com=[0, 0, 0], inertia=np.eye(3) / 100).build()
/// >>> robot = linkwork.Robot(lift, chains={"arm": ("world", "hand")}, objects={"cup": (0.3, [0, 0, 0], np.eye(3) / 1000)}, colliders=[])
/// >>> with robot.grasp("arm", "cup", [0, 0, 0.1]) as grip:
/// ...     grip
/// Grip(arm holds cup)
/// >>> robot.hands("cup")
/// []
#[pyclass(frozen, weakref, module = "linkwork")]
pub struct Grip {
    robot: Py<Robot>,
    hand: String,
    object: String,
}

/// Adds an object to a model: mass properties, or a separate mechanism.
pub(super) fn object(name: String, given: ArrayLike<'_, '_>, spec: &mut ModelSpec) -> PyResult<()> {
    if let Ok(mechanism) = given.cast::<Mechanism>() {
        return jointed(name, &mechanism.get().core.mbs, spec);
    }
    let parts: (f64, Bound<'_, PyAny>, Bound<'_, PyAny>) = given.extract().map_err(|e| {
        let help = "give (mass, com (3,), inertia (3, 3)), or a Mechanism";
        let fact = format!("objects[\"{name}\"] is not a tuple of mass properties");
        unless_own(given.py(), e, |_| refuse_with(fact, help))
    })?;
    let of = |what: &str| format!("objects[\"{name}\"]: {what}");
    let com = vec3(&parts.1, &of("com"))?;
    let inertia = mat3(&parts.2, &of("inertia"))?;
    let mass = MassProperties::new(parts.0, com, inertia);
    spec.objects.push(ObjectSpec { name, mass });
    Ok(())
}

/// Adds an object with joints: the body on its world is the object, the other bodies are outboard of it.
fn jointed(name: String, mbs: &Multibody, spec: &mut ModelSpec) -> PyResult<()> {
    let wrong =
        |fact: String, help: String| refuse_with(format!("objects[\"{name}\"]: {fact}"), help);
    let roots: Vec<_> = mbs.body_ids().filter(|b| mbs.get(*b).parent().is_none()).collect();
    let [root] = roots[..] else {
        let fact = format!("{} of its bodies are on the world", roots.len());
        return Err(wrong(fact, "give a mechanism with one body on the world".into()));
    };
    let own = mbs.spec(root);
    if own.name != name {
        let fact = format!("its body on the world is `{}`", own.name);
        return Err(wrong(fact, format!("call the object `{}`, or the body `{name}`", own.name)));
    }
    if own.hinge.nv() != 6 {
        let fact = format!("its hinge on the world has {} degrees of freedom", own.hinge.nv());
        let help = "use Hinge.free(), because hands and `put` determine the pose of the object";
        return Err(wrong(fact, help.into()));
    }
    if own.modes.is_some() {
        return Err(wrong("it is flexible".into(), "make the body rigid".into()));
    }
    spec.objects.push(ObjectSpec { name, mass: own.mass });
    for b in mbs.body_ids().filter(|b| *b != root) {
        spec.linkages.body(mbs.spec(b));
    }
    // The model rejects loops of objects with its own message, so they are passed on.
    spec.linkages.loops_mut().extend(mbs.loops().iter().map(|l| l.closure.clone()));
    spec.linkages.couplings_mut().extend(mbs.couplings().iter().map(|c| c.coupling.clone()));
    Ok(())
}

/// Returns the body of an object with this name.
fn body_of(slf: &Bound<'_, Robot>, object: &str, body: &str) -> PyResult<BodyId> {
    let own = base(slf);
    own.model.object_body(own.object(object)?, body).map_or_else(
        || {
            let known = Robot::object_bodies(slf, object)?;
            let known: Vec<&str> = known.iter().map(String::as_str).collect();
            let help = remedy(body, "bodies", &known);
            Err(refuse_with(format!("`{object}` has no body `{body}`"), help))
        },
        Ok,
    )
}

#[pymethods]
impl Robot {
    /// Grasp an object with a hand (the tip of a chain).
    ///
    /// The object then loads the hand and is checked for collisions with everything except its hand. The first hand carries the object. A second hand
    /// closes a loop, so the object must be at the given pose within 1e-6 m and rad.
    ///
    /// Parameters
    /// ----------
    /// hand : str
    ///     Name of the chain.
    /// object : str
    ///     Name of the object.
    /// at : array_like, optional
    ///     Pose of the object in the tip's frame, m: (3,), (7,) or (4, 4) (default: the current pose).
    ///
    /// Returns
    /// -------
    /// Grip
    ///     With `with`, the hand releases the object at the end of the block.
    ///
    /// Raises
    /// ------
    /// LinkworkError
    ///     If this hand or two hands hold the object, the part is not a chain, or the loop does not close. The robot is then unchanged.
    ///
    /// Examples
    /// --------
    /// >>> with robot.grasp("arm", "cup", [0.1, 0, 0]) as grip:
    /// ...     robot.hands("cup")
    /// ['arm']
    /// >>> robot.hands("cup")
    /// []
    #[pyo3(signature = (hand, object, at=None))]
    fn grasp(
        slf: &Bound<'_, Self>,
        hand: String,
        object: String,
        at: Option<ArrayLike<'_, '_>>,
    ) -> PyResult<Grip> {
        let own = base(slf);
        let (part, what) = (own.part(&hand)?, own.object(&object)?);
        let grasp = match at {
            Some(X) => embedded::Grasp::At(pose(Some(X), "at")?),
            None => embedded::Grasp::Here,
        };
        own.ask(|r| r.grasp(part, what, grasp))?;
        Ok(Grip { robot: slf.clone().unbind(), hand, object })
    }

    /// Correct the pose of an object in a hand that holds it, for example with the result of an estimator.
    ///
    /// The load moves with the object. If two hands hold it, its pose in the other hand follows.
    ///
    /// Parameters
    /// ----------
    /// hand : str
    ///     Name of the chain.
    /// object : str
    ///     Name of the object.
    /// at : array_like
    ///     Pose of the object in the tip's frame, m: (3,), (7,) or (4, 4).
    ///
    /// Raises
    /// ------
    /// LinkworkError
    ///     If the hand does not hold the object.
    ///
    /// Examples
    /// --------
    /// >>> with robot.grasp("arm", "cup", [0.1, 0, 0]):
    /// ...     robot.update_grasp("arm", "cup", [0.11, 0, 0])
    fn update_grasp(
        slf: &Bound<'_, Self>,
        hand: &str,
        object: &str,
        at: ArrayLike<'_, '_>,
    ) -> PyResult<()> {
        let own = base(slf);
        let (part, what, X) = (own.part(hand)?, own.object(object)?, pose(Some(at), "at")?);
        own.ask(|r| r.update_grasp(part, what, X))
    }

    /// Release an object from a hand. It stays in the other hand, or at its place in the world.
    ///
    /// Parameters
    /// ----------
    /// hand : str
    ///     Name of the chain.
    /// object : str
    ///     Name of the object.
    ///
    /// Raises
    /// ------
    /// LinkworkError
    ///     If the hand does not hold the object.
    ///
    /// Examples
    /// --------
    /// >>> grip = robot.grasp("arm", "cup")
    /// >>> robot.release("arm", "cup")
    fn release(slf: &Bound<'_, Self>, hand: &str, object: &str) -> PyResult<()> {
        let own = base(slf);
        let (part, what) = (own.part(hand)?, own.object(object)?);
        own.ask(|r| r.release(part, what))
    }

    /// Release an object from all hands. It stays at its place in the world.
    ///
    /// Parameters
    /// ----------
    /// object : str
    ///     Name of the object.
    ///
    /// Raises
    /// ------
    /// LinkworkError
    ///     If no hand holds the object.
    ///
    /// Examples
    /// --------
    /// >>> grip = robot.grasp("arm", "cup")
    /// >>> robot.ungrasp("cup")
    fn ungrasp(slf: &Bound<'_, Self>, object: &str) -> PyResult<()> {
        let own = base(slf);
        let what = own.object(object)?;
        own.ask(|r| r.ungrasp(what))
    }

    /// Attach an object that no hand holds to another object, for example a battery to its driver.
    ///
    /// It then moves with the other object, and a hand that holds the other object carries both.
    ///
    /// Parameters
    /// ----------
    /// object : str
    ///     Name of the object.
    /// on : str
    ///     Name of the other object.
    /// body : str, optional
    ///     Body of the other object to which it is attached (default: its main body).
    /// at : array_like, optional
    ///     Pose in the frame of that body, m: (3,), (7,) or (4, 4) (default: the current pose).
    ///
    /// Raises
    /// ------
    /// LinkworkError
    ///     If the object is held or attached, or carries the other object. The robot is then unchanged.
    ///
    /// Examples
    /// --------
    /// >>> robot.put("cup", [0.5, 0, 0.2])
    /// >>> robot.attach("cup", "cup")
    /// Traceback (most recent call last):
    /// linkwork.LinkworkError: `on` is 0
    ///   help: attach it to an object that is not attached to it
    #[pyo3(signature = (object, on, body=None, at=None))]
    fn attach(
        slf: &Bound<'_, Self>,
        object: &str,
        on: &str,
        body: Option<&str>,
        at: Option<ArrayLike<'_, '_>>,
    ) -> PyResult<()> {
        let own = base(slf);
        let (what, carrier) = (own.object(object)?, own.object(on)?);
        let body = match body.filter(|b| *b != on) {
            Some(body) => Some(body_of(slf, on, body)?),
            None => None,
        };
        let place = match at {
            Some(X) => embedded::Grasp::At(pose(Some(X), "at")?),
            None => embedded::Grasp::Here,
        };
        own.ask(|r| r.attach(what, carrier, body, place))
    }

    /// Detach an object from the object to which it is attached. It stays at its place in the world.
    ///
    /// Parameters
    /// ----------
    /// object : str
    ///     Name of the object.
    ///
    /// Raises
    /// ------
    /// LinkworkError
    ///     If the object is not attached.
    ///
    /// Examples
    /// --------
    /// >>> robot.detach("cup")
    /// Traceback (most recent call last):
    /// linkwork.LinkworkError: object 0 is not attached to another object
    ///   help: attach it first
    fn detach(slf: &Bound<'_, Self>, object: &str) -> PyResult<()> {
        let own = base(slf);
        let what = own.object(object)?;
        own.ask(|r| r.detach(what))
    }

    /// Return the parts that hold an object: the hand that carries it, then the second hand.
    ///
    /// Parameters
    /// ----------
    /// object : str
    ///     Name of the object.
    ///
    /// Returns
    /// -------
    /// list of str
    ///     Names of the parts; empty if no hand holds it.
    ///
    /// Raises
    /// ------
    /// LinkworkError
    ///     If the object does not exist.
    ///
    /// Examples
    /// --------
    /// >>> robot.hands("cup")
    /// []
    fn hands(slf: &Bound<'_, Self>, object: &str) -> PyResult<Vec<String>> {
        let own = base(slf);
        let what = own.object(object)?;
        let hold = own.ask(|r| r.hold(what))?;
        let hands = hold.map(|h| [Some(h.hand.0), h.second.map(|s| s.0)]);
        Ok(hands.into_iter().flatten().flatten().map(|p| own.part_name(p)).collect())
    }

    /// Place an object that no hand holds in the world.
    ///
    /// Parameters
    /// ----------
    /// object : str
    ///     Name of the object.
    /// at : array_like
    ///     Pose in the world, m: (3,), (7,) or (4, 4).
    ///
    /// Raises
    /// ------
    /// LinkworkError
    ///     If a hand holds the object.
    ///
    /// Examples
    /// --------
    /// >>> robot.put("cup", [0.5, 0, 0.2])
    fn put(slf: &Bound<'_, Self>, object: &str, at: ArrayLike<'_, '_>) -> PyResult<()> {
        let own = base(slf);
        let (what, X) = (own.object(object)?, pose(Some(at), "at")?);
        own.ask(|r| r.put(what, X))
    }

    /// Return the pose of an object in the world at the robot's q.
    ///
    /// Parameters
    /// ----------
    /// object : str
    ///     Name of the object.
    ///
    /// Returns
    /// -------
    /// ndarray, shape (4, 4)
    ///     Homogeneous matrix, position in m.
    ///
    /// Raises
    /// ------
    /// LinkworkError
    ///     If the object does not exist.
    ///
    /// Examples
    /// --------
    /// >>> robot.put("cup", [0.5, 0, 0.2])
    /// >>> robot.object_pose("cup")[:3, 3].tolist()
    /// [0.5, 0.0, 0.2]
    fn object_pose<'py>(slf: &Bound<'py, Self>, object: &str) -> PyResult<Array2<'py>> {
        let own = base(slf);
        let what = own.object(object)?;
        out_pose(slf.py(), &own.ask(|r| r.object_pose(what))?)
    }

    /// Return the bodies of an object. The first is the object itself; a rigid object has no others.
    ///
    /// Parameters
    /// ----------
    /// object : str
    ///     Name of the object.
    ///
    /// Returns
    /// -------
    /// list of str
    ///     Names of the bodies.
    ///
    /// Raises
    /// ------
    /// LinkworkError
    ///     If the object does not exist.
    ///
    /// Examples
    /// --------
    /// >>> robot.object_bodies("cup")
    /// ['cup']
    fn object_bodies(slf: &Bound<'_, Self>, object: &str) -> PyResult<Vec<String>> {
        let own = base(slf);
        let mbs = own.model.object_multibody(own.object(object)?);
        let names = |m: &Multibody| m.bodies().iter().map(|b| b.name().to_owned()).collect();
        Ok(mbs.map_or_else(|| vec![object.to_owned()], names))
    }

    /// Return the joint coordinates of an object, in the order of its bodies.
    ///
    /// Parameters
    /// ----------
    /// object : str
    ///     Name of the object.
    ///
    /// Returns
    /// -------
    /// ndarray, shape (n,)
    ///     Coordinates, rad and m; initially neutral. Empty for a rigid object.
    ///
    /// Raises
    /// ------
    /// LinkworkError
    ///     If the object does not exist.
    ///
    /// Examples
    /// --------
    /// >>> block = dict(mass=0.1, com=[0, 0, 0], inertia=np.eye(3) / 1000)
    /// >>> pliers = linkwork.Builder().body("pliers", "world", linkwork.Hinge.free(), **block).body("jaw", "pliers", linkwork.Hinge.pin([0, 0, 1]), **block).build()
    /// >>> fitter = linkwork.Robot(parts.build(), chains={"arm": ("world", "hand")}, objects={"pliers": pliers}, colliders=[])
    /// >>> fitter.object_q("pliers").tolist()
    /// [0.0]
    fn object_q<'py>(slf: &Bound<'py, Self>, object: &str) -> PyResult<Array1<'py>> {
        let own = base(slf);
        let what = own.object(object)?;
        Ok(out1(slf.py(), own.ask(|r| r.object_q(what).map(<[f64]>::to_vec))?))
    }

    /// Set the joint coordinates of an object, whether it is held or not. They may be outside the limits.
    ///
    /// Parameters
    /// ----------
    /// object : str
    ///     Name of the object.
    /// q : array_like, shape (n,)
    ///     Coordinates, rad and m.
    ///
    /// Raises
    /// ------
    /// LinkworkError
    ///     If q has a wrong length or contains NaN, or the object is rigid. The robot is then unchanged.
    ///
    /// Examples
    /// --------
    /// >>> block = dict(mass=0.1, com=[0.05, 0, 0], inertia=np.eye(3) / 1000)
    /// >>> pliers = linkwork.Builder().body("pliers", "world", linkwork.Hinge.free(), **block).body("jaw", "pliers", linkwork.Hinge.pin([0, 0, 1]), **block).build()
    /// >>> fitter = linkwork.Robot(parts.build(), chains={"arm": ("world", "hand")}, objects={"pliers": pliers}, colliders=[])
    /// >>> with fitter.grasp("arm", "pliers", [0.1, 0, 0]):
    /// ...     fitter.set_object_q("pliers", [0.4])
    /// ...     fitter.object_body_pose("pliers", "jaw")[:2, 0].round(6).tolist()
    /// [0.921061, 0.389418]
    fn set_object_q(slf: &Bound<'_, Self>, object: &str, q: ArrayLike<'_, '_>) -> PyResult<()> {
        let own = base(slf);
        let what = own.object(object)?;
        let n = own.ask(|r| r.object_q(what).map(<[f64]>::len))?;
        // The model's message about a rigid object is more specific than a wrong length.
        let q = if n == 0 { Vec::new() } else { vector(q, n, "q")?.slice().to_vec() };
        own.ask(|r| r.set_object_q(what, &q))
    }

    /// Return the pose of a body of an object in the world at the robot's q.
    ///
    /// Parameters
    /// ----------
    /// object : str
    ///     Name of the object.
    /// body : str
    ///     Name of a body.
    ///
    /// Returns
    /// -------
    /// ndarray, shape (4, 4)
    ///     Homogeneous matrix, position in m.
    ///
    /// Raises
    /// ------
    /// LinkworkError
    ///     If the object or the body does not exist.
    ///
    /// Examples
    /// --------
    /// >>> robot.put("cup", [0.5, 0, 0.2])
    /// >>> robot.object_body_pose("cup", "cup")[:3, 3].tolist()
    /// [0.5, 0.0, 0.2]
    fn object_body_pose<'py>(
        slf: &Bound<'py, Self>,
        object: &str,
        body: &str,
    ) -> PyResult<Array2<'py>> {
        let own = base(slf);
        let what = own.object(object)?;
        if body == object {
            return out_pose(slf.py(), &own.ask(|r| r.object_pose(what))?);
        }
        let id = body_of(slf, object, body)?;
        out_pose(slf.py(), &own.ask(|r| r.object_body_pose(what, id))?)
    }

    /// Compute the Jacobian of a body of an object: rates of the object's n joints to the velocity of the body.
    ///
    /// Parameters
    /// ----------
    /// object : str
    ///     Name of the object.
    /// body : str
    ///     Name of a body.
    ///
    /// Returns
    /// -------
    /// ndarray, shape (6, n)
    ///     [ω; v] of the body's origin relative to the frame in which the object is held or placed, rad/s and m/s, world axes.
    ///
    /// Raises
    /// ------
    /// LinkworkError
    ///     If the object does not have joints, or the body does not exist.
    ///
    /// Examples
    /// --------
    /// >>> block = dict(mass=0.1, com=[0.05, 0, 0], inertia=np.eye(3) / 1000)
    /// >>> pliers = linkwork.Builder().body("pliers", "world", linkwork.Hinge.free(), **block).body("jaw", "pliers", linkwork.Hinge.pin([0, 0, 1]), **block).build()
    /// >>> fitter = linkwork.Robot(parts.build(), chains={"arm": ("world", "hand")}, objects={"pliers": pliers}, colliders=[])
    /// >>> fitter.put("pliers", [0, 0, 0])
    /// >>> fitter.object_jacobian("pliers", "jaw").shape
    /// (6, 1)
    fn object_jacobian<'py>(
        slf: &Bound<'py, Self>,
        object: &str,
        body: &str,
    ) -> PyResult<Array2<'py>> {
        let own = base(slf);
        let what = own.object(object)?;
        let id = body_of(slf, object, body)?;
        let n = own.ask(|r| r.object_q(what).map(<[f64]>::len))?;
        let mut J = vec![0.0; 6 * n];
        own.ask(|r| r.object_jacobian(what, id, &mut J))?;
        out2(slf.py(), J, 6, n)
    }

    /// Return rank and mobility of a closed loop.
    ///
    /// By default, it is the loop of the two hands that hold an object. With `hand` and `body`, it is the loop of a hand that is rigidly connected to
    /// a body of the object at their current poses, such as the key in a lock.
    ///
    /// Parameters
    /// ----------
    /// object : str
    ///     Name of the object.
    /// hand : str, optional
    ///     Name of the chain.
    /// body : str, optional
    ///     Body of the object.
    /// free : sequence of bool, optional
    ///     For each joint of the object, whether it may move (default: all may).
    ///
    /// Returns
    /// -------
    /// dict
    ///     `rows`, `rank` and `mobility` of the loop.
    ///
    /// Raises
    /// ------
    /// LinkworkError
    ///     If two hands do not hold the object, or a name does not exist.
    ///
    /// Examples
    /// --------
    /// >>> block = dict(mass=0.1, com=[0.05, 0, 0], inertia=np.eye(3) / 1000)
    /// >>> pliers = linkwork.Builder().body("pliers", "world", linkwork.Hinge.free(), **block).body("jaw", "pliers", linkwork.Hinge.pin([0, 0, 1]), **block).build()
    /// >>> fitter = linkwork.Robot(parts.build(), chains={"arm": ("world", "hand")}, objects={"pliers": pliers}, colliders=[])
    /// >>> fitter.put("pliers", [0, 0, 0])
    /// >>> fitter.closure("pliers", hand="arm", body="jaw")["rows"]
    /// 6
    #[pyo3(signature = (object, *, hand=None, body=None, free=None))]
    fn closure<'py>(
        slf: &Bound<'py, Self>,
        object: &str,
        hand: Option<&str>,
        body: Option<&str>,
        free: Option<Vec<bool>>,
    ) -> PyResult<Bound<'py, PyDict>> {
        let own = base(slf);
        let what = own.object(object)?;
        let found = match (hand, body) {
            (None, None) if free.is_none() => own.ask(|r| r.closure(Closing::Hands(what)))?,
            (Some(hand), Some(body)) => {
                let (hand, id) = (own.part(hand)?, body_of(slf, object, body)?);
                let n = own.ask(|r| r.object_q(what).map(<[f64]>::len))?;
                let free = free.unwrap_or_else(|| vec![true; n]);
                let onto = Closing::Onto { hand, object: what, body: id, free: &free };
                own.ask(|r| r.closure(onto))?
            }
            _ => {
                let help = "give both `hand` and `body`, optionally with `free`, or neither";
                return Err(refuse_with(
                    "a loop between a hand and a body needs `hand` and `body`",
                    help,
                ));
            }
        };
        let out = PyDict::new(slf.py());
        out.set_item("rows", found.rows)?;
        out.set_item("rank", found.rank)?;
        out.set_item("mobility", found.mobility)?;
        Ok(out)
    }
}

#[pymethods]
impl Grip {
    fn __enter__(slf: Bound<'_, Self>) -> Bound<'_, Self> {
        slf
    }

    /// The hand releases the object, unless it has already done so.
    #[pyo3(signature = (*_exception))]
    fn __exit__(
        &self,
        py: Python<'_>,
        _exception: &Bound<'_, pyo3::types::PyTuple>,
    ) -> PyResult<()> {
        let robot = self.robot.bind(py);
        if Robot::hands(robot, &self.object)?.contains(&self.hand) {
            Robot::release(robot, &self.hand, &self.object)?;
        }
        Ok(())
    }

    fn __repr__(&self) -> String {
        format!("Grip({} holds {})", self.hand, self.object)
    }
}
