//! Forces of a robot: with grasped objects, of two hands, in operational space.
use super::{ArrayLike, Robot, base};
use crate::array::{Array1, Array2, Input, checked1, out_force, out_vec3, out2, vector, wrench};
use crate::collisions::Collisions;
use crate::core::lock;
use crate::error::{refuse, refuse_with};
use crate::mechanism::choice;
use crate::values::pairs;
use linkwork_embedded::{
    Balance, Friction, HandWeights, Object, Predictor, Push, StateEstimate, TaskSpace,
};
use linkwork_spatial::{Force, Motion};
use pyo3::prelude::*;
use pyo3::types::PyDict;

/// Converts two wrenches to an array (2, 6).
fn two<'py>(py: Python<'py>, f: &[Force; 2]) -> PyResult<Array2<'py>> {
    let rows = f.iter().flat_map(|f| [f.moment, f.force]).flat_map(|x| [x.x, x.y, x.z]).collect();
    out2(py, rows, 2, 6)
}

impl Collisions {
    /// Reads the wrenches that tips exert, by part.
    fn pushes(&self, given: Option<&Bound<'_, PyDict>>) -> PyResult<Vec<Push>> {
        let mut list = Vec::new();
        for (name, value) in given.into_iter().flat_map(pairs) {
            let name: String = name.extract()?;
            let f = wrench(&value, &format!("pushes[\"{name}\"]"))?;
            list.push(Push::new(self.part(&name)?, f.moment, f.force));
        }
        Ok(list)
    }

    /// Returns the number of degrees of freedom of an object's joints; an error for a rigid object.
    fn joints_of(&self, name: &str, object: Object) -> PyResult<usize> {
        let help = "give the object as a Mechanism";
        let none = || refuse_with(format!("`{name}` has no joints"), help);
        let mbs = self.model.object_multibody(object).ok_or_else(none)?;
        Ok(mbs.nv() - 6)
    }

    pub(super) fn task_space(&self, parts: &[String]) -> PyResult<TaskSpace> {
        let parts = parts.iter().map(|p| self.part(p)).collect::<PyResult<Vec<_>>>()?;
        TaskSpace::new(&lock(&self.robot), &parts).map_err(refuse)
    }
}

/// Reads the wrenches (2, 6) of two hands.
fn of_two_hands(wrenches: ArrayLike<'_, '_>) -> PyResult<[Force; 2]> {
    let input = Input::read(wrenches, "wrenches")?;
    let (&[2, 6], [a, b, c, x, y, z, d, e, f, u, v, w]) = (input.shape(), input.slice()) else {
        let fact = format!("`wrenches` has the shape {:?}", input.shape());
        return Err(refuse_with(fact, "give (2, 6): moment and force of each hand"));
    };
    let wrench =
        |m: [&f64; 3], f: [&f64; 3]| Force::new(m.map(|x| *x).into(), f.map(|x| *x).into());
    Ok([wrench([a, b, c], [x, y, z]), wrench([d, e, f], [u, v, w])])
}

#[pymethods]
impl Robot {
    /// Compute the generalized forces that hold the robot at rest at its q, including grasped objects.
    ///
    /// Returns
    /// -------
    /// ndarray, shape (nv,)
    ///     Generalized forces, N m and N.
    ///
    /// Examples
    /// --------
    /// >>> robot.gravity_forces().shape
    /// (3,)
    fn gravity_forces<'py>(slf: &Bound<'py, Self>) -> PyResult<Array1<'py>> {
        let own = base(slf);
        let mut tau = vec![0.0; own.model.nv()];
        own.ask(|r| r.gravity_forces(&mut tau))?;
        checked1(slf.py(), tau)
    }

    /// Compute the generalized forces for given rates and accelerations at the robot's q, including grasped objects (inverse dynamics).
    ///
    /// Parameters
    /// ----------
    /// v : array_like, shape (nv,)
    ///     Rates, rad/s and m/s.
    /// a : array_like, shape (nv,)
    ///     Accelerations, rad/s² and m/s².
    /// pushes : dict, optional
    ///     {part: (6,)}: wrenches [moment; force] that tips exert on their surroundings, N m and N, about their origins, world axes.
    ///
    /// Returns
    /// -------
    /// ndarray, shape (nv,)
    ///     Generalized forces, N m and N.
    ///
    /// Raises
    /// ------
    /// LinkworkError
    ///     If a name does not exist, or an array has a wrong length or contains NaN.
    ///
    /// Examples
    /// --------
    /// >>> robot.feed_forward([0.1, 0, 0], [0, 0, 0], pushes={"arm": [0, 0, 0, 0, 0, 5.0]}).shape
    /// (3,)
    #[pyo3(signature = (v, a, pushes=None))]
    fn feed_forward<'py>(
        slf: &Bound<'py, Self>,
        v: ArrayLike<'_, 'py>,
        a: ArrayLike<'_, 'py>,
        pushes: Option<&Bound<'py, PyDict>>,
    ) -> PyResult<Array1<'py>> {
        let own = base(slf);
        let nv = own.model.nv();
        let (v, a) = (vector(v, nv, "v")?, vector(a, nv, "a")?);
        let list = own.pushes(pushes)?;
        let mut tau = vec![0.0; nv];
        own.ask(|r| r.feed_forward(v.slice(), a.slice(), &list, &mut tau))?;
        checked1(slf.py(), tau)
    }

    /// Compute the bias terms of operational-space control at the robot's q, including grasped objects.
    ///
    /// Parameters
    /// ----------
    /// v : array_like, shape (nv,)
    ///     Rates, rad/s and m/s.
    /// parts : sequence of str
    ///     Names of n chains.
    ///
    /// Returns
    /// -------
    /// tau : ndarray, shape (nv,)
    ///     Generalized forces of the velocities and of gravity, N m and N.
    /// a : ndarray, shape (n, 6)
    ///     Accelerations [angular; linear] of the tips in the world for constant rates, rad/s² and m/s².
    ///
    /// Raises
    /// ------
    /// LinkworkError
    ///     If a name does not exist, a part is not a chain, or an array has a wrong length or contains NaN.
    ///
    /// Examples
    /// --------
    /// >>> tau, tips = robot.bias([0.1, 0, 0], ["arm"])
    /// >>> tau.shape, tips.shape
    /// ((3,), (1, 6))
    fn bias<'py>(
        slf: &Bound<'py, Self>,
        v: ArrayLike<'_, 'py>,
        parts: Vec<String>,
    ) -> PyResult<(Array1<'py>, Array2<'py>)> {
        let (py, own) = (slf.py(), base(slf));
        let v = vector(v, own.model.nv(), "v")?;
        let parts = parts.iter().map(|p| own.part(p)).collect::<PyResult<Vec<_>>>()?;
        let mut tau = vec![0.0; own.model.nv()];
        let mut tips = vec![Motion::zero(); parts.len()];
        own.ask(|r| r.bias(v.slice(), &parts, &mut tau, &mut tips))?;
        let rows = tips.iter().flat_map(|m| [m.angular, m.linear]).flat_map(|x| [x.x, x.y, x.z]);
        Ok((checked1(py, tau)?, out2(py, rows.collect(), parts.len(), 6)?))
    }

    /// Predict the state after a time dt and its covariance, including grasped objects.
    ///
    /// The midpoint rule, of second order in dt, and its exact derivative. The robot's own q is neither used nor changed.
    ///
    /// Parameters
    /// ----------
    /// q : array_like, shape (nq,)
    ///     Configuration, rad and m.
    /// v : array_like, shape (nv,)
    ///     Rates, rad/s and m/s.
    /// tau : array_like, shape (nv,)
    ///     Generalized forces, N m and N.
    /// dt : float
    ///     Time, s.
    /// covariance : array_like, shape (2 nv, 2 nv)
    ///     Covariance of the errors [δq; δv]; δq is along v, in rad, m and these per second.
    /// density : array_like, shape (nv,), optional
    ///     Spectral densities of white noise of the forces, (N m)² s and N² s (default: none).
    ///
    /// Returns
    /// -------
    /// q : ndarray, shape (nq,)
    ///     Predicted configuration.
    /// v : ndarray, shape (nv,)
    ///     Predicted rates.
    /// covariance : ndarray, shape (2 nv, 2 nv)
    ///     Predicted covariance.
    ///
    /// Raises
    /// ------
    /// LinkworkError
    ///     If an array has a wrong length or contains NaN, dt or a density is negative, or a joint moves no inertia.
    ///
    /// Examples
    /// --------
    /// >>> q, v, P = robot.predict([0.1, 0.2, 0.3], [0, 0, 0], robot.gravity_forces(), 0.01, 1e-6 * np.eye(6), density=[1e-3] * 3)
    /// >>> P.shape, bool(P[0, 0] > 1e-6)
    /// ((6, 6), True)
    #[pyo3(signature = (q, v, tau, dt, covariance, *, density=None))]
    fn predict<'py>(
        slf: &Bound<'py, Self>,
        q: ArrayLike<'_, 'py>,
        v: ArrayLike<'_, 'py>,
        tau: ArrayLike<'_, 'py>,
        dt: f64,
        covariance: ArrayLike<'_, 'py>,
        density: Option<ArrayLike<'_, 'py>>,
    ) -> PyResult<(Array1<'py>, Array1<'py>, Array2<'py>)> {
        let own = base(slf);
        let (nq, nv) = (own.model.nq(), own.model.nv());
        let (mut q, mut v) =
            (vector(q, nq, "q")?.slice().to_vec(), vector(v, nv, "v")?.slice().to_vec());
        let tau = vector(tau, nv, "tau")?;
        let given = Input::read(covariance, "covariance")?;
        if given.shape() != [2 * nv, 2 * nv] {
            let fact = format!("`covariance` has the shape {:?}", given.shape());
            return Err(refuse_with(fact, format!("give ({0}, {0})", 2 * nv)));
        }
        let mut P = given.slice().to_vec();
        let none = vec![0.0; nv];
        let density = density.map(|d| vector(d, nv, "density")).transpose()?;
        let density = density.as_ref().map_or(&none[..], |d| d.slice());
        own.ask(|r| {
            let state = StateEstimate { q: &mut q, v: &mut v, covariance: &mut P };
            r.predict(&mut Predictor::new(r), state, tau.slice(), density, dt)
        })?;
        let py = slf.py();
        Ok((checked1(py, q)?, checked1(py, v)?, out2(py, P, 2 * nv, 2 * nv)?))
    }

    /// Share the load of an object between its two hands.
    ///
    /// Parameters
    /// ----------
    /// object : str
    ///     Name of the object.
    /// tau : array_like, shape (nv,)
    ///     Generalized forces, N m and N.
    /// by : {"equal", "effort"}
    ///     Minimize Σ τ² ("equal") or Σ (τ/limit)² ("effort").
    ///
    /// Returns
    /// -------
    /// tau : ndarray, shape (nv,)
    ///     Generalized forces that cause the same motion, N m and N.
    /// load : float
    ///     Largest ratio |τ|/limit of a joint; above 1 if the joints are too weak.
    ///
    /// Raises
    /// ------
    /// LinkworkError
    ///     If two hands do not hold the object, or by "effort" if a joint has no effort limit.
    ///
    /// Examples
    /// --------
    /// >>> robot.balance("cup", robot.gravity_forces())
    /// Traceback (most recent call last):
    /// linkwork.LinkworkError: object 0 is not held
    ///   help: grasp it first
    #[pyo3(signature = (object, tau, *, by="effort"))]
    fn balance<'py>(
        slf: &Bound<'py, Self>,
        object: &str,
        tau: ArrayLike<'_, 'py>,
        by: &str,
    ) -> PyResult<(Array1<'py>, f64)> {
        let own = base(slf);
        let what = own.object(object)?;
        let by = choice("by", by, &[("effort", Balance::Effort), ("equal", Balance::Equal)])?;
        let mut tau = vector(tau, own.model.nv(), "tau")?.slice().to_vec();
        let found = own.ask(|r| r.balance(what, by, &mut tau))?;
        Ok((checked1(slf.py(), tau)?, found.largest_share))
    }

    /// Return the mass matrix at the robot's q, including grasped objects.
    ///
    /// Returns
    /// -------
    /// ndarray, shape (nv, nv)
    ///     kg m², kg m and kg.
    ///
    /// Examples
    /// --------
    /// >>> robot.mass_matrix().shape
    /// (3, 3)
    fn mass_matrix<'py>(slf: &Bound<'py, Self>) -> PyResult<Array2<'py>> {
        let own = base(slf);
        let nv = own.model.nv();
        let mut M = vec![0.0; nv * nv];
        own.ask(|r| r.mass_matrix(&mut M))?;
        out2(slf.py(), M, nv, nv)
    }

    /// Return mass and centre of mass at the robot's q, including grasped objects.
    ///
    /// Returns
    /// -------
    /// mass : float
    ///     Mass, kg.
    /// com : ndarray, shape (3,)
    ///     Position in the world, m.
    ///
    /// Examples
    /// --------
    /// >>> mass, com = robot.center_of_mass()
    /// >>> mass
    /// 3.0
    fn center_of_mass<'py>(slf: &Bound<'py, Self>) -> PyResult<(f64, Array1<'py>)> {
        let (mass, com) = lock(&base(slf).robot).center_of_mass();
        Ok((mass, out_vec3(slf.py(), &com)?))
    }

    /// Compute the generalized forces of the robot and of the joints of a held object, as `feed_forward` does for the robot alone.
    ///
    /// Parameters
    /// ----------
    /// object : str
    ///     Name of the object.
    /// v, a : array_like, shape (nv,)
    ///     Rates and accelerations of the robot, rad/s, m/s, rad/s², m/s².
    /// rates, accelerations : array_like, shape (n,)
    ///     Rates and accelerations of the object's joints.
    /// pushes : dict, optional
    ///     As in `feed_forward`.
    ///
    /// Returns
    /// -------
    /// tau : ndarray, shape (nv,)
    ///     Generalized forces of the robot, N m and N.
    /// tau_object : ndarray, shape (n,)
    ///     Generalized forces of the object's joints, N m and N.
    ///
    /// Raises
    /// ------
    /// LinkworkError
    ///     If the object is rigid or not held, a name does not exist, or an array has a wrong length or contains NaN.
    ///
    /// Examples
    /// --------
    /// >>> block = dict(mass=0.1, com=[0.05, 0, 0], inertia=np.eye(3) / 1000)
    /// >>> pliers = linkwork.Builder().body("pliers", "world", linkwork.Hinge.free(), **block).body("jaw", "pliers", linkwork.Hinge.pin([0, 1, 0]), **block).build()
    /// >>> fitter = linkwork.Robot(parts.build(), chains={"arm": ("world", "hand")}, objects={"pliers": pliers}, colliders=[])
    /// >>> with fitter.grasp("arm", "pliers", np.eye(4)):
    /// ...     tau, forces = fitter.feed_forward_with_object("pliers", [0, 0, 0], [0, 0, 0], [0.0], [0.0])
    /// >>> forces.round(6).tolist()
    /// [-0.04905]
    #[pyo3(signature = (object, v, a, rates, accelerations, pushes=None))]
    fn feed_forward_with_object<'py>(
        slf: &Bound<'py, Self>,
        object: &str,
        v: ArrayLike<'_, 'py>,
        a: ArrayLike<'_, 'py>,
        rates: ArrayLike<'_, 'py>,
        accelerations: ArrayLike<'_, 'py>,
        pushes: Option<&Bound<'py, PyDict>>,
    ) -> PyResult<(Array1<'py>, Array1<'py>)> {
        let (py, own) = (slf.py(), base(slf));
        let (what, nv) = (own.object(object)?, own.model.nv());
        let n = own.joints_of(object, what)?;
        let (v, a) = (vector(v, nv, "v")?, vector(a, nv, "a")?);
        let rates = vector(rates, n, "rates")?;
        let accelerations = vector(accelerations, n, "accelerations")?;
        let list = own.pushes(pushes)?;
        let (mut tau, mut forces) = (vec![0.0; nv], vec![0.0; n]);
        let robot = (v.slice(), a.slice());
        let joints = (rates.slice(), accelerations.slice());
        own.ask(|r| r.feed_forward_with_object(robot, what, joints, &list, &mut tau, &mut forces))?;
        Ok((checked1(py, tau)?, checked1(py, forces)?))
    }

    /// Return the mass matrix of the robot and, in the last rows and columns, of the n joints of an object that it holds.
    ///
    /// Parameters
    /// ----------
    /// object : str
    ///     Name of the object.
    ///
    /// Returns
    /// -------
    /// ndarray, shape (nv + n, nv + n)
    ///     kg m², kg m and kg.
    ///
    /// Raises
    /// ------
    /// LinkworkError
    ///     If the object is rigid or not held.
    ///
    /// Examples
    /// --------
    /// >>> block = dict(mass=0.1, com=[0.05, 0, 0], inertia=np.eye(3) / 1000)
    /// >>> pliers = linkwork.Builder().body("pliers", "world", linkwork.Hinge.free(), **block).body("jaw", "pliers", linkwork.Hinge.pin([0, 1, 0]), **block).build()
    /// >>> fitter = linkwork.Robot(parts.build(), chains={"arm": ("world", "hand")}, objects={"pliers": pliers}, colliders=[])
    /// >>> with fitter.grasp("arm", "pliers", np.eye(4)):
    /// ...     fitter.mass_matrix_with_object("pliers").shape
    /// (4, 4)
    fn mass_matrix_with_object<'py>(slf: &Bound<'py, Self>, object: &str) -> PyResult<Array2<'py>> {
        let own = base(slf);
        let what = own.object(object)?;
        let n = own.model.nv() + own.joints_of(object, what)?;
        let mut M = vec![0.0; n * n];
        own.ask(|r| r.mass_matrix_with_object(what, &mut M))?;
        out2(slf.py(), M, n, n)
    }

    /// Add forces with which two hands press an object between them.
    ///
    /// Parameters
    /// ----------
    /// object : str
    ///     Name of the object.
    /// tau : array_like, shape (nv,)
    ///     Generalized forces, N m and N.
    /// force : float
    ///     Internal force between the hands, N.
    ///
    /// Returns
    /// -------
    /// tau : ndarray, shape (nv,)
    ///     Generalized forces with the squeeze added, N m and N.
    /// wrenches : ndarray, shape (2, 6)
    ///     Wrenches [moment; force] of the first and the second hand on the object, about their tips, world axes. Their sum is zero.
    ///
    /// Raises
    /// ------
    /// LinkworkError
    ///     If two hands do not hold the object, or both tips are at the same position.
    ///
    /// Examples
    /// --------
    /// >>> rail = linkwork.Builder()
    /// >>> for name, x in (("left", -0.3), ("right", 0.3)):
    /// ...     rail = rail.body(name, "world", linkwork.Hinge.slider([1, 0, 0]), mass=1, com=[0, 0, 0], inertia=np.eye(3), hinge_in_parent=[x, 0, 0])
    /// >>> press = linkwork.Robot(rail.build(), chains={"l": ("world", "left"), "r": ("world", "right")}, objects={"bar": (1.0, [0, 0, 0], np.eye(3))}, colliders=[])
    /// >>> grips = press.grasp("l", "bar"), press.grasp("r", "bar")
    /// >>> tau, wrenches = press.squeeze("bar", press.gravity_forces(), 20.0)
    /// >>> tau.round(9).tolist(), float(wrenches[1, 3])
    /// ([20.0, -20.0], -20.0)
    fn squeeze<'py>(
        slf: &Bound<'py, Self>,
        object: &str,
        tau: ArrayLike<'_, 'py>,
        force: f64,
    ) -> PyResult<(Array1<'py>, Array2<'py>)> {
        let (py, own) = (slf.py(), base(slf));
        let what = own.object(object)?;
        let mut tau = vector(tau, own.model.nv(), "tau")?.slice().to_vec();
        let wrenches = own.ask(|r| r.squeeze(what, force, &mut tau))?;
        Ok((checked1(py, tau)?, two(py, &wrenches)?))
    }

    /// Add forces with which two hands exert given wrenches on an object.
    ///
    /// Parameters
    /// ----------
    /// object : str
    ///     Name of the object.
    /// tau : array_like, shape (nv,)
    ///     Generalized forces, N m and N.
    /// wrenches : array_like, shape (2, 6)
    ///     Additional wrenches [moment; force] of the first and the second hand, N m and N, about their tips, world axes.
    ///
    /// Returns
    /// -------
    /// ndarray, shape (nv,)
    ///     Generalized forces, N m and N.
    ///
    /// Raises
    /// ------
    /// LinkworkError
    ///     If two hands do not hold the object, or an array has a wrong shape or contains NaN.
    ///
    /// Examples
    /// --------
    /// >>> rail = linkwork.Builder()
    /// >>> for name, x in (("left", -0.3), ("right", 0.3)):
    /// ...     rail = rail.body(name, "world", linkwork.Hinge.slider([1, 0, 0]), mass=1, com=[0, 0, 0], inertia=np.eye(3), hinge_in_parent=[x, 0, 0])
    /// >>> press = linkwork.Robot(rail.build(), chains={"l": ("world", "left"), "r": ("world", "right")}, objects={"bar": (1.0, [0, 0, 0], np.eye(3))}, colliders=[])
    /// >>> grips = press.grasp("l", "bar"), press.grasp("r", "bar")
    /// >>> press.add_hand_wrenches("bar", press.gravity_forces(), [[0, 0, 0, 20.0, 0, 0], [0, 0, 0, -5.0, 0, 0]]).round(9).tolist()
    /// [20.0, -5.0]
    fn add_hand_wrenches<'py>(
        slf: &Bound<'py, Self>,
        object: &str,
        tau: ArrayLike<'_, 'py>,
        wrenches: ArrayLike<'_, 'py>,
    ) -> PyResult<Array1<'py>> {
        let (py, own) = (slf.py(), base(slf));
        let what = own.object(object)?;
        let mut tau = vector(tau, own.model.nv(), "tau")?.slice().to_vec();
        let wrenches = of_two_hands(wrenches)?;
        own.ask(|r| r.add_hand_wrenches(what, &wrenches, &mut tau))?;
        checked1(py, tau)
    }

    /// Decompose the wrenches of two hands on an object into motion-inducing wrenches and internal wrenches.
    ///
    /// The internal wrenches have a zero sum. The motion-inducing wrenches have the smallest weighted sum of squares.
    ///
    /// Parameters
    /// ----------
    /// object : str
    ///     Name of the object.
    /// wrenches : array_like, shape (2, 6)
    ///     Wrenches [moment; force] of the first and the second hand, N m and N, about their tips, world axes.
    /// hands : tuple of float
    ///     Weights of the two hands (default: (1, 1)).
    /// moment : float
    ///     Weight of 1 N m compared with 1 N, 1/m² (default: 1).
    ///
    /// Returns
    /// -------
    /// moving : ndarray, shape (2, 6)
    ///     Motion-inducing wrenches.
    /// squeezing : ndarray, shape (2, 6)
    ///     Internal wrenches.
    /// net : ndarray, shape (6,)
    ///     Sum of all wrenches about the object's origin.
    ///
    /// Raises
    /// ------
    /// LinkworkError
    ///     If two hands do not hold the object, an array has a wrong shape or contains NaN, or a weight is not positive.
    ///
    /// Examples
    /// --------
    /// >>> rail = linkwork.Builder()
    /// >>> for name, x in (("left", -0.3), ("right", 0.3)):
    /// ...     rail = rail.body(name, "world", linkwork.Hinge.slider([1, 0, 0]), mass=1, com=[0, 0, 0], inertia=np.eye(3), hinge_in_parent=[x, 0, 0])
    /// >>> press = linkwork.Robot(rail.build(), chains={"l": ("world", "left"), "r": ("world", "right")}, objects={"bar": (1.0, [0, 0, 0], np.eye(3))}, colliders=[])
    /// >>> grips = press.grasp("l", "bar"), press.grasp("r", "bar")
    /// >>> moving, squeezing, net = press.split_hand_wrenches("bar", [[0, 0, 0, 25, 0, 0], [0, 0, 0, -20, 0, 0]])
    /// >>> moving[:, 3].round(9).tolist(), squeezing[:, 3].round(9).tolist(), float(net[3])
    /// ([2.5, 2.5], [22.5, -22.5], 5.0)
    #[pyo3(signature = (object, wrenches, *, hands=(1.0, 1.0), moment=1.0))]
    fn split_hand_wrenches<'py>(
        slf: &Bound<'py, Self>,
        object: &str,
        wrenches: ArrayLike<'_, 'py>,
        hands: (f64, f64),
        moment: f64,
    ) -> PyResult<(Array2<'py>, Array2<'py>, Array1<'py>)> {
        let (py, own) = (slf.py(), base(slf));
        let what = own.object(object)?;
        let wrenches = of_two_hands(wrenches)?;
        let weights = HandWeights { hands: hands.into(), moment };
        let found = own.ask(|r| r.split_hand_wrenches(what, &wrenches, &weights))?;
        Ok((two(py, &found.moving)?, two(py, &found.squeezing)?, out_force(py, &found.net)?))
    }

    /// Compute the wrenches nearest to given ones with which neither of two hands slips on an object.
    ///
    /// The net wrench stays the same; the hands press as much as friction requires.
    ///
    /// Parameters
    /// ----------
    /// object : str
    ///     Name of the object.
    /// wrenches : array_like, shape (2, 6)
    ///     Wrenches [moment; force] of the first and the second hand on the object, N m and N, about their tips, world axes.
    /// friction : sequence of tuple
    ///     For each hand (normal, coefficient, radius, most): the direction (3,) in which it presses on the object, in the axes of its tip; the
    ///     friction coefficient; the radius of the contact patch, m; the largest normal force, N (`math.inf` for none).
    ///
    /// Returns
    /// -------
    /// wrenches : ndarray, shape (2, 6)
    ///     The wrenches.
    /// missing : float
    ///     0 if the grip holds. Otherwise, no wrenches hold the object, and all friction cones and limits would have to be wider by this amount,
    ///     N.
    ///
    /// Raises
    /// ------
    /// LinkworkError
    ///     If two hands do not hold the object, an array has a wrong shape or contains NaN, or `friction` is not valid.
    ///
    /// Examples
    /// --------
    /// >>> rail = linkwork.Builder()
    /// >>> for name, x in (("left", -0.3), ("right", 0.3)):
    /// ...     rail = rail.body(name, "world", linkwork.Hinge.slider([1, 0, 0]), mass=1, com=[0, 0, 0], inertia=np.eye(3), hinge_in_parent=[x, 0, 0])
    /// >>> press = linkwork.Robot(rail.build(), chains={"l": ("world", "left"), "r": ("world", "right")}, objects={"bar": (1.0, [0, 0, 0], np.eye(3))}, colliders=[])
    /// >>> grips = press.grasp("l", "bar"), press.grasp("r", "bar")
    /// >>> palm = (0.5, 0.02, float("inf"))
    /// >>> wrenches, missing = press.grip("bar", [[0, 0, 0, 0, 0, 5], [0, 0, 0, 0, 0, 5]], friction=[([1, 0, 0], *palm), ([-1, 0, 0], *palm)])
    /// >>> wrenches[:, 3].round(3).tolist(), missing
    /// ([10.0, -10.0], 0.0)
    #[pyo3(signature = (object, wrenches, *, friction))]
    fn grip<'py>(
        slf: &Bound<'py, Self>,
        object: &str,
        wrenches: ArrayLike<'_, 'py>,
        friction: [([f64; 3], f64, f64, f64); 2],
    ) -> PyResult<(Array2<'py>, f64)> {
        let (py, own) = (slf.py(), base(slf));
        let what = own.object(object)?;
        let wrenches = of_two_hands(wrenches)?;
        let friction = friction.map(|(normal, coefficient, radius, most)| Friction {
            normal: normal.into(),
            coefficient,
            radius,
            most,
        });
        let found = own.ask(|r| r.grip(what, &wrenches, &friction))?;
        Ok((two(py, &found.wrenches)?, found.shortfall))
    }

    /// Compute the operational-space inertia Λ = (J M⁻¹ Jᵀ)⁻¹ of the tips of chains at the robot's q, including grasped objects.
    ///
    /// Parameters
    /// ----------
    /// parts : sequence of str
    ///     Names of k chains.
    ///
    /// Returns
    /// -------
    /// ndarray, shape (6 k, 6 k)
    ///     kg m², kg m and kg, with rows [angular; linear] of each part, world axes.
    ///
    /// Raises
    /// ------
    /// LinkworkError
    ///     If a part is not a chain, or the tips cannot move independently.
    ///
    /// Examples
    /// --------
    /// >>> drone = linkwork.Builder().body("drone", "world", linkwork.Hinge.free(), mass=2, com=[0, 0, 0], inertia=np.eye(3) / 10).build()
    /// >>> flying = linkwork.Robot(drone, chains={"body": ("world", "drone")}, colliders=[])
    /// >>> flying.task_inertia(["body"]).diagonal().round(9).tolist()
    /// [0.1, 0.1, 0.1, 2.0, 2.0, 2.0]
    fn task_inertia<'py>(slf: &Bound<'py, Self>, parts: Vec<String>) -> PyResult<Array2<'py>> {
        let own = base(slf);
        let mut space = own.task_space(&parts)?;
        let n = space.rows();
        let mut out = vec![0.0; n * n];
        own.ask(|r| space.inertia(r, &mut out))?;
        out2(slf.py(), out, n, n)
    }

    /// Compute the generalized forces that give the tips of chains prescribed accelerations at the robot's q, including grasped objects.
    ///
    /// Parameters
    /// ----------
    /// parts : sequence of str
    ///     Names of k chains.
    /// v : array_like, shape (nv,)
    ///     Rates, rad/s and m/s.
    /// a : array_like, shape (6 k,)
    ///     Accelerations [angular; linear] of each tip, rad/s² and m/s², world axes.
    /// rest : array_like, shape (nv,), optional
    ///     Generalized forces that act in the null space of the tips, N m and N.
    ///
    /// Returns
    /// -------
    /// ndarray, shape (nv,)
    ///     Generalized forces, N m and N.
    ///
    /// Raises
    /// ------
    /// LinkworkError
    ///     If a part is not a chain, the tips cannot move independently, or an array has a wrong length or contains NaN.
    ///
    /// Examples
    /// --------
    /// >>> drone = linkwork.Builder().body("drone", "world", linkwork.Hinge.free(), mass=2, com=[0, 0, 0], inertia=np.eye(3) / 10).build()
    /// >>> flying = linkwork.Robot(drone, chains={"body": ("world", "drone")}, colliders=[])
    /// >>> flying.task_forces(["body"], np.zeros(6), [0, 0, 0, 0, 0, 1])[5].round(9).item()
    /// 21.62
    #[pyo3(signature = (parts, v, a, rest=None))]
    fn task_forces<'py>(
        slf: &Bound<'py, Self>,
        parts: Vec<String>,
        v: ArrayLike<'_, 'py>,
        a: ArrayLike<'_, 'py>,
        rest: Option<ArrayLike<'_, 'py>>,
    ) -> PyResult<Array1<'py>> {
        let (own, nv) = (base(slf), base(slf).model.nv());
        let mut space = own.task_space(&parts)?;
        let (v, a) = (vector(v, nv, "v")?, vector(a, space.rows(), "a")?);
        let rest = rest.map(|r| vector(r, nv, "rest")).transpose()?;
        let mut tau = vec![0.0; nv];
        let rest = rest.as_ref().map(Input::slice);
        own.ask(|r| space.forces(r, v.slice(), a.slice(), rest, &mut tau))?;
        checked1(slf.py(), tau)
    }
}
