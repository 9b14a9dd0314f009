//! What hands hold: objects, rigid or with joints, taken and let go.
use super::{Given, Robot, base};
use crate::array::{Array1, Array2, mat3, out_pose, out1, out2, pose, vec3, vector};
use crate::error::{refuse_with, unless_own};
use crate::mechanism::Mechanism;
use linkwork_embedded::{self as embedded, Closing, ModelSpec, ObjectSpec};
use linkwork_multibody::{BodyId, Multibody};
use linkwork_runtime::remedy;
use linkwork_spatial::MassProperties;
use pyo3::prelude::*;
use pyo3::types::PyDict;

/// What a hand holds, for `with`: at its end the hand lets go.
///
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

/// Adds an object to a model: mass properties, or a mechanism of its own.
pub(super) fn object(name: String, given: Given<'_, '_>, spec: &mut ModelSpec) -> PyResult<()> {
    if let Ok(mechanism) = given.cast::<Mechanism>() {
        return jointed(name, &mechanism.get().core.mbs, spec);
    }
    let parts: (f64, Bound<'_, PyAny>, Bound<'_, PyAny>) = given.extract().map_err(|e| {
        let help = "give (mass, com (3,), inertia (3, 3)), or a Mechanism";
        let fact = format!("objects[\"{name}\"] is no mass with its properties");
        unless_own(given.py(), e, |_| refuse_with(fact, help))
    })?;
    let of = |what: &str| format!("objects[\"{name}\"]: {what}");
    let com = vec3(&parts.1, &of("com"))?;
    let inertia = mat3(&parts.2, &of("inertia"))?;
    let mass = MassProperties::new(parts.0, com, inertia);
    spec.objects.push(ObjectSpec { name, mass });
    Ok(())
}

/// An object with joints: the body on the world is the object, the others hang on it.
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
        let help = "use Hinge.free(): hands, and `put`, say where the object is";
        return Err(wrong(fact, help.into()));
    }
    if own.modes.is_some() {
        return Err(wrong("it is flexible".into(), "make the body rigid".into()));
    }
    spec.objects.push(ObjectSpec { name, mass: own.mass });
    for b in mbs.body_ids().filter(|b| *b != root) {
        spec.linkages.body(mbs.spec(b));
    }
    // The model says that it takes none.
    spec.linkages.loops_mut().extend(mbs.loops().iter().map(|l| l.closure.clone()));
    spec.linkages.couplings_mut().extend(mbs.couplings().iter().map(|c| c.coupling.clone()));
    Ok(())
}

/// The body of an object that has this name.
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
    /// A hand (the tip of a chain) takes an object, which then weighs on it and meets what is not its hand. at: where the object is in the tip's frame, a
    /// pose (3,), (7,) or (4, 4), m; None: where it is now. The first hand carries it; a second one closes a loop and has to be where it says, within
    /// 1e-6 m and rad. Used with `with`, the hand lets go at the end. Raises LinkworkError for what is held by this hand or by two, for a part that is no
    /// chain, and for a loop that does not close; then nothing has changed.
    ///
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
        at: Option<Given<'_, '_>>,
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

    /// Another pose of an object in a hand that holds it, as an estimator found it: (3,), (7,) or (4, 4) in the tip's frame, m. Its weight moves with it; with
    /// two hands the other's follows. Raises LinkworkError when the hand does not hold it.
    ///
    /// >>> with robot.grasp("arm", "cup", [0.1, 0, 0]):
    /// ...     robot.update_grasp("arm", "cup", [0.11, 0, 0])
    fn update_grasp(
        slf: &Bound<'_, Self>,
        hand: &str,
        object: &str,
        at: Given<'_, '_>,
    ) -> PyResult<()> {
        let own = base(slf);
        let (part, what, X) = (own.part(hand)?, own.object(object)?, pose(Some(at), "at")?);
        own.ask(|r| r.update_grasp(part, what, X))
    }

    /// A hand lets go of an object: it stays in the other hand, or where it is in the world. Raises LinkworkError when the hand does not hold it.
    ///
    /// >>> grip = robot.grasp("arm", "cup")
    /// >>> robot.release("arm", "cup")
    fn release(slf: &Bound<'_, Self>, hand: &str, object: &str) -> PyResult<()> {
        let own = base(slf);
        let (part, what) = (own.part(hand)?, own.object(object)?);
        own.ask(|r| r.release(part, what))
    }

    /// All hands let go of an object: it stays where it is in the world. Raises LinkworkError when nobody holds it.
    ///
    /// >>> grip = robot.grasp("arm", "cup")
    /// >>> robot.ungrasp("cup")
    fn ungrasp(slf: &Bound<'_, Self>, object: &str) -> PyResult<()> {
        let own = base(slf);
        let what = own.object(object)?;
        own.ask(|r| r.ungrasp(what))
    }

    /// Attaches an object that no hand holds to another one: a battery to its driver, a wheel to its hub. body: the body of that one that carries it; None: itself. at: where it is in
    /// the frame of what carries it, a pose (3,), (7,) or (4, 4), m; None: where it is now. It then goes with that, and the hand that holds that carries both. Raises
    /// LinkworkError for what is held or attached, and for an object that it carries itself; then nothing has changed.
    ///
    /// >>> robot.put("cup", [0.5, 0, 0.2])
    /// >>> robot.attach("cup", "cup")
    /// Traceback (most recent call last):
    /// linkwork.LinkworkError: `on` is 0
    ///   help: attach it to an object that it does not carry
    #[pyo3(signature = (object, on, body=None, at=None))]
    fn attach(
        slf: &Bound<'_, Self>,
        object: &str,
        on: &str,
        body: Option<&str>,
        at: Option<Given<'_, '_>>,
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

    /// Takes an object off what it is attached to: it stays where it is in the world. Raises LinkworkError when that is nothing.
    ///
    /// >>> robot.detach("cup")
    /// Traceback (most recent call last):
    /// linkwork.LinkworkError: object 0 is attached to nothing
    ///   help: attach it first
    fn detach(slf: &Bound<'_, Self>, object: &str) -> PyResult<()> {
        let own = base(slf);
        let what = own.object(object)?;
        own.ask(|r| r.detach(what))
    }

    /// The parts that hold an object: the one that carries it, then the second; an empty list when nobody does. Raises LinkworkError for an object that is not there.
    ///
    /// >>> robot.hands("cup")
    /// []
    fn hands(slf: &Bound<'_, Self>, object: &str) -> PyResult<Vec<String>> {
        let own = base(slf);
        let what = own.object(object)?;
        let hold = own.ask(|r| r.hold(what))?;
        let hands = hold.map(|h| [Some(h.hand.0), h.second.map(|s| s.0)]);
        Ok(hands.into_iter().flatten().flatten().map(|p| own.part_name(p)).collect())
    }

    /// Puts an object that nobody holds somewhere in the world: a pose (3,), (7,) or (4, 4), m. Raises LinkworkError when it is held.
    ///
    /// >>> robot.put("cup", [0.5, 0, 0.2])
    fn put(slf: &Bound<'_, Self>, object: &str, at: Given<'_, '_>) -> PyResult<()> {
        let own = base(slf);
        let (what, X) = (own.object(object)?, pose(Some(at), "at")?);
        own.ask(|r| r.put(what, X))
    }

    /// Where an object is in the world at the robot's q: (4, 4), m. Raises LinkworkError for an object that is not there.
    ///
    /// >>> robot.put("cup", [0.5, 0, 0.2])
    /// >>> robot.object_pose("cup")[:3, 3].tolist()
    /// [0.5, 0.0, 0.2]
    fn object_pose<'py>(slf: &Bound<'py, Self>, object: &str) -> PyResult<Array2<'py>> {
        let own = base(slf);
        let what = own.object(object)?;
        out_pose(slf.py(), &own.ask(|r| r.object_pose(what))?)
    }

    /// Bodies of an object, itself first; of a rigid one its name alone. Raises LinkworkError for an object that is not there.
    ///
    /// >>> robot.object_bodies("cup")
    /// ['cup']
    fn object_bodies(slf: &Bound<'_, Self>, object: &str) -> PyResult<Vec<String>> {
        let own = base(slf);
        let mbs = own.model.object_multibody(own.object(object)?);
        let names = |m: &Multibody| m.bodies().iter().map(|b| b.name().to_owned()).collect();
        Ok(mbs.map_or_else(|| vec![object.to_owned()], names))
    }

    /// Coordinates (n,), rad and m, of an object's joints, neutral at first; none of a rigid one. They are in the order of its bodies. Raises LinkworkError for
    /// an object that is not there.
    ///
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

    /// Other coordinates (n,), rad and m, of an object's joints, held or not, within limits or not; what the hand carries follows. Raises LinkworkError for
    /// another length, NaN, and a rigid object; then nothing has changed.
    ///
    /// >>> block = dict(mass=0.1, com=[0.05, 0, 0], inertia=np.eye(3) / 1000)
    /// >>> pliers = linkwork.Builder().body("pliers", "world", linkwork.Hinge.free(), **block).body("jaw", "pliers", linkwork.Hinge.pin([0, 0, 1]), **block).build()
    /// >>> fitter = linkwork.Robot(parts.build(), chains={"arm": ("world", "hand")}, objects={"pliers": pliers}, colliders=[])
    /// >>> with fitter.grasp("arm", "pliers", [0.1, 0, 0]):
    /// ...     fitter.set_object_q("pliers", [0.4])
    /// ...     fitter.object_body_pose("pliers", "jaw")[:2, 0].round(6).tolist()
    /// [0.921061, 0.389418]
    fn set_object_q(slf: &Bound<'_, Self>, object: &str, q: Given<'_, '_>) -> PyResult<()> {
        let own = base(slf);
        let what = own.object(object)?;
        let n = own.ask(|r| r.object_q(what).map(<[f64]>::len))?;
        // Of a rigid object the model says more than a length.
        let q = if n == 0 { Vec::new() } else { vector(q, n, "q")?.slice().to_vec() };
        own.ask(|r| r.set_object_q(what, &q))
    }

    /// Where a body of an object is in the world at the robot's q: (4, 4), m. Raises LinkworkError for an object and a body that are not there.
    ///
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

    /// The Jacobian (6, n) of a body of an object: rates of the object's n joints to the velocity [w; v] of the body relative to where the object is held or stands, at
    /// its origin, world axes; in rad/s and m/s by the joints' rad/s and m/s. Raises LinkworkError for an object without joints, and a body that is not there.
    ///
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

    /// What a closed loop leaves, as a dict of `rows`, `rank` and `mobility`: of both hands of an object; with `hand` and `body` of a hand that is welded to a body of it as both stand, such as a key in a
    /// lock. `free`: for each joint of the object whether it may move; unwritten: all may. Raises LinkworkError for an object that is not held by two hands, and for names that are not there.
    ///
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
                let help = "give both, and `free` with them, or none of them";
                return Err(refuse_with("a loop onto a body has a hand and a body", help));
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

    /// The hand lets go, unless it has done so already.
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
