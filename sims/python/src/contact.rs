//! Contact of a `Mechanism`: shapes of its bodies, and a time stepper with velocities and impulses.
//!
//! The equations and the solver are `linkwork_solvers::ContactStepper`; a step is of first order in `dt`.
use crate::array::{Array1, Array2, out1, out2, room, vector};
use crate::constraints::may_begin;
use crate::core::{Core, lock};
use crate::error::{refuse, refuse_with};
use crate::mechanism::{Mechanism, choice};
use crate::simulate::{Forces, Torque};
use linkwork_collision::{ColliderSpec, Colliders, Hiding, Neighbours, PairLaw, Rules};
use linkwork_multibody::NodeId;
use linkwork_solvers::{
    ConstraintMethod, ContactSettings, ContactStepper, JointLimits, StepReport,
};
use linkwork_spatial::{Force, Vec3};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use std::collections::BTreeMap;
use std::sync::{Arc, Mutex};

mod collider;
mod step;
pub use collider::Collider;
pub use step::ContactStep;

type ArrayLike<'a, 'py> = &'a Bound<'py, PyAny>;

#[pymethods]
impl Mechanism {
    /// Return the collision shapes of the file from which the mechanism was loaded.
    ///
    /// A collider has the name of its shape in the file, or `body/number`. Shapes have the friction and the restitution of the file. Those of a URDF, MJCF or SDF file that
    /// does not specify them have a friction coefficient of 0.5 and a restitution of 0; `Collider.material` changes them.
    ///
    /// Returns
    /// -------
    /// list of Collider
    ///     The shapes.
    ///
    /// Raises
    /// ------
    /// LinkworkError
    ///     If a Collider does not support a shape (meshes that are neither STL nor OBJ), or the mechanism was not loaded from a file.
    ///
    /// Examples
    /// --------
    /// >>> import pathlib
    /// >>> _ = pathlib.Path("ball.urdf").write_text('<robot name="b"><link name="l"><inertial><mass value="1"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial>' '<collision><geometry><sphere radius="0.1"/></geometry></collision></link></robot>')
    /// >>> linkwork.load("ball.urdf", "free").file_colliders()
    /// [Collider(l/0 on l: Sphere { radius: 0.1 })]
    pub fn file_colliders(&self) -> PyResult<Vec<Collider>> {
        let specs = match (&self.core.contact, &self.core.description) {
            (Some(c), _) => c.colliders.ids().map(|id| c.colliders.spec(id).clone()).collect(),
            (None, Some(d)) => linkwork_embedded::colliders_of(d).map_err(refuse)?,
            (None, None) => {
                let fact = "this mechanism does not have collision shapes of a file (pickling removes them)";
                return Err(refuse_with(fact, "give Contact a list of linkwork.Collider"));
            }
        };
        Ok(specs.into_iter().map(|spec| Collider { spec }).collect())
    }
}

/// The stepper and its memory.
struct Memory {
    stepper: ContactStepper,
    /// Pairs that do not collide.
    hiding: Hiding,
    vdot: Vec<f64>,
}

/// Time stepper for a mechanism whose bodies touch each other and the ground, with contact by impulses.
///
/// Bodies that are connected by a loop or by a hinge of fewer than six degrees of freedom do not collide, unless `neighbours` is "collide"
/// instead of "pass".
///
/// Parameters
/// ----------
/// mechanism : Mechanism
///     The mechanism.
/// colliders : sequence of Collider, optional
///     The shapes. By default those of the file (`Mechanism.file_colliders`); for a RON file also its collision rules and settings, which the
///     arguments override.
/// ignore, collide : sequence of (str, str), optional
///     Pairs of colliders or bodies, by name, that do not collide, and that do.
/// neighbours : {"pass", "collide"}, optional
///     See above.
/// limits : {"stop", "ignore"}, optional
///     "stop" keeps hinges within their limits (default unless the file says otherwise).
/// pairs : dict, optional
///     Contact properties of pairs of materials (`Collider.material`): {(name, name): {"friction": .., "restitution": ..}}. They replace the
///     mean friction and the larger restitution of the two surfaces, and the pairs of the file.
/// margin : float, optional
///     Largest gap, m, that is included in the contact problem.
/// slop : float, optional
///     Penetration, m, that is not corrected.
/// correction : float, optional
///     Fraction of the remaining penetration that one step corrects, from 0 to 1.
/// push_max : float, optional
///     Largest velocity of that correction, m/s.
/// bounce_min : float, optional
///     Impact velocity, m/s, below which there is no restitution.
/// tolerance : float, optional
///     Tolerance of the solver, relative to the largest velocity.
///
/// Raises
/// ------
/// LinkworkError
///     If a shape, a name or a setting is not valid.
///
/// Notes
/// -----
/// A step is of first order in dt. The solver is warm-started with the impulses of the last step, so results depend on them within the tolerance;
/// `reset` discards them. Hinge damping is not included. Dry friction of hinges is included only if the `contact` of the file has it.
///
/// Examples
/// --------
/// >>> import numpy as np, linkwork
/// >>> ball = linkwork.Builder().body("ball", "world", linkwork.Hinge.free(), mass=2.0, com=[0, 0, 0], inertia=0.008 * np.eye(3)).build()
/// >>> contact = linkwork.Contact(ball, [linkwork.Collider.sphere("skin", "ball", 0.1), linkwork.Collider.half_space("ground")])
/// >>> step = contact.step([0, 0, 0.1, 0, 0, 0, 1], np.zeros(6), 1e-3)
/// >>> step.pairs
/// [('ground', 'skin')]
/// >>> print(np.round(step.forces[0], 6))
/// [ 0.    0.   19.62]
#[pyclass(frozen, weakref, module = "linkwork")]
pub struct Contact {
    core: Arc<Core>,
    memory: Mutex<Memory>,
}

/// Returns a setting, which must be positive (or not negative with `zero`), or its default.
fn setting(what: &str, given: Option<f64>, default: f64, zero: bool) -> PyResult<f64> {
    let x = given.unwrap_or(default);
    if x.is_finite() && (x > 0.0 || (zero && x == 0.0)) {
        return Ok(x);
    }
    let help = if zero { "give a number that is not negative" } else { "give a number above zero" };
    Err(refuse_with(format!("`{what}` is {x}"), help))
}

/// Friction, restitution, rolling and spinning friction by name, for pairs of materials.
type Laws = BTreeMap<(String, String), BTreeMap<String, f64>>;

fn laws(pairs: Laws) -> PyResult<Vec<PairLaw>> {
    let law = |((a, b), numbers): ((String, String), BTreeMap<String, f64>)| {
        let known = ["friction", "restitution", "rolling_friction", "spinning_friction"];
        if let Some(wrong) = numbers.keys().find(|k| !known.contains(&k.as_str())) {
            let fact = format!("`pairs`: ({a:?}, {b:?}) has an unknown property `{wrong}`");
            return Err(refuse_with(fact, format!("give some of {}", known.join(", "))));
        }
        let [friction, restitution, rolling, spinning] = known.map(|k| numbers.get(k).copied());
        Ok(PairLaw { materials: [a, b], friction, restitution, rolling, spinning })
    };
    pairs.into_iter().map(law).collect()
}

/// Returns the given colliders, or those of the mechanism's file with its collision rules, and adds the arguments to the rules.
pub(crate) fn chosen(
    mechanism: &Mechanism,
    colliders: Option<Vec<PyRef<'_, Collider>>>,
    ignore: Option<Vec<[String; 2]>>,
    collide: Option<Vec<[String; 2]>>,
    neighbours: Option<&str>,
) -> PyResult<(Vec<ColliderSpec>, Rules)> {
    let (specs, mut rules): (Vec<_>, _) = match colliders {
        Some(given) => (given.iter().map(|c| c.spec.clone()).collect(), Rules::default()),
        None => {
            let contact = &mechanism.core.contact;
            let rules = contact.as_ref().map(|c| c.colliders.rules().clone());
            let specs = mechanism.file_colliders()?.into_iter().map(|c| c.spec).collect();
            (specs, rules.unwrap_or_default())
        }
    };
    let known = [("pass", Neighbours::Pass), ("collide", Neighbours::Collide)];
    if let Some(given) = neighbours {
        rules.neighbours = choice("neighbours", given, &known)?;
    }
    rules.ignore.extend(ignore.unwrap_or_default());
    rules.collide.extend(collide.unwrap_or_default());
    // Bodies that a loop connects do not collide, like bodies that a hinge connects.
    for l in mechanism.core.mbs.loops().iter().filter(|l| !l.rows.is_empty()) {
        let pair = [l.closure.body_a.clone(), l.closure.body_b.clone()];
        if !rules.joined.contains(&pair) {
            rules.joined.push(pair);
        }
    }
    Ok((specs, rules))
}

#[pymethods]
impl Contact {
    #[new]
    #[pyo3(signature = (mechanism, colliders=None, *, ignore=None, collide=None, neighbours=None, pairs=None, limits=None,
        margin=None, slop=None, correction=None, push_max=None, bounce_min=None, tolerance=None))]
    fn new(
        mechanism: &Mechanism,
        colliders: Option<Vec<PyRef<'_, Collider>>>,
        ignore: Option<Vec<[String; 2]>>,
        collide: Option<Vec<[String; 2]>>,
        neighbours: Option<&str>,
        pairs: Option<Laws>,
        limits: Option<&str>,
        margin: Option<f64>,
        slop: Option<f64>,
        correction: Option<f64>,
        push_max: Option<f64>,
        bounce_min: Option<f64>,
        tolerance: Option<f64>,
    ) -> PyResult<Self> {
        let core = mechanism.core.clone();
        let mut own = ContactSettings::default();
        if let (None, Some(c)) = (&colliders, &core.contact) {
            let fact = "the contact of the file is compliant, but Contact uses impulses";
            let help = "give `mechanism.file_colliders()` as colliders, or use linkwork.Simulation";
            own = c.settings.clone().ok_or_else(|| refuse_with(fact, help))?;
        }
        let (specs, mut rules) = chosen(mechanism, colliders, ignore, collide, neighbours)?;
        rules.laws.splice(0..0, laws(pairs.unwrap_or_default())?);
        let known = [("stop", JointLimits::Stop), ("ignore", JointLimits::Ignore)];
        let limits = limits.map_or(Ok(own.limits), |given| choice("limits", given, &known))?;
        let mut settings = ContactSettings {
            margin: setting("margin", margin, own.margin, false)?,
            slop: setting("slop", slop, own.slop, true)?,
            correction: setting("correction", correction, own.correction, true)?,
            push_max: setting("push_max", push_max, own.push_max, true)?,
            bounce_min: setting("bounce_min", bounce_min, own.bounce_min, true)?,
            limits,
            ..own
        };
        if settings.correction > 1.0 {
            let fact = format!("`correction` is {}", settings.correction);
            return Err(refuse_with(fact, "give a fraction from 0 to 1"));
        }
        let solver = &mut settings.solver;
        solver.tolerance = setting("tolerance", tolerance, solver.tolerance, false)?;
        let all = Colliders::new(specs, rules, core.tree.multibody()).map_err(refuse)?;
        let auto = |_| ConstraintMethod::Auto;
        let stepper = ContactStepper::new(&core.tree, Arc::new(all), settings, auto);
        let hiding = stepper.colliders().hiding();
        let memory = Mutex::new(Memory { stepper, hiding, vdot: vec![0.0; core.nv()] });
        Ok(Self { core, memory })
    }

    /// Names of the colliders, sorted.
    ///
    /// Examples
    /// --------
    /// >>> contact.colliders
    /// ['ground', 'skin']
    #[getter]
    fn colliders(&self) -> Vec<String> {
        let memory = lock(&self.memory);
        let all = memory.stepper.colliders();
        all.ids().map(|id| all.spec(id).name.clone()).collect()
    }

    /// Discard the impulses of the last step, so that the next step starts without a warm start.
    ///
    /// Examples
    /// --------
    /// >>> contact.reset()
    /// >>> again = contact.step([0, 0, 0.1, 0, 0, 0, 1], np.zeros(6), 1e-3)
    /// >>> again.v.tolist() == step.v.tolist()
    /// True
    fn reset(&self) {
        lock(&self.memory).stepper.set_warm(&[]);
    }

    /// Advance the state by one step.
    ///
    /// Loops and couplings are kept closed; q and v must satisfy them at the start (see `Mechanism.close`). Prescribed coordinates keep their rates.
    ///
    /// Parameters
    /// ----------
    /// q : array_like, shape (nq,)
    ///     Configuration, rad and m.
    /// v : array_like, shape (nv,)
    ///     Rates, rad/s and m/s.
    /// dt : float
    ///     Step size, s.
    /// tau : array_like, shape (nv,), optional
    ///     Generalized forces, N m and N (default: zeros).
    /// wrenches : dict of str to array_like, shape (6,), optional
    ///     External wrenches as in `Mechanism.inverse_dynamics`.
    ///
    /// Returns
    /// -------
    /// ContactStep
    ///     State after the step, and contacts.
    ///
    /// Raises
    /// ------
    /// LinkworkError
    ///     If a free coordinate moves no inertia, or the state diverges.
    ///
    /// Examples
    /// --------
    /// >>> thrown = contact.step([0, 0, 1, 0, 0, 0, 1], [0, 0, 0, 2, 0, 0], 0.01, wrenches={"ball": [0, 0, 0, 0, 0, 2 * 9.81]})
    /// >>> np.round(thrown.q[:3], 6).tolist(), len(thrown.pairs)
    /// ([0.02, 0.0, 1.0], 0)
    #[pyo3(signature = (q, v, dt, tau=None, *, wrenches=None))]
    fn step(
        &self,
        q: ArrayLike<'_, '_>,
        v: ArrayLike<'_, '_>,
        dt: f64,
        tau: Option<ArrayLike<'_, '_>>,
        wrenches: Option<&Bound<'_, PyDict>>,
    ) -> PyResult<ContactStep> {
        let (py, core) = (q.py(), &*self.core);
        let dt = setting("dt", Some(dt), dt, false)?;
        let mut q = core.configuration(q, "q")?.slice().to_vec();
        let mut v = vector(v, core.nv(), "v")?.slice().to_vec();
        let mut tau = match tau {
            Some(tau) => vector(tau, core.nv(), "tau")?.slice().to_vec(),
            None => vec![0.0; core.nv()],
        };
        let wrenches = core.wrenches(wrenches)?;
        if core.is_constrained() {
            may_begin(core, &q, &v)?;
        }
        py.detach(|| {
            let mut memory = lock(&self.memory);
            let report = memory.step(core, &wrenches, dt, &mut q, &mut v, &mut tau)?;
            let Memory { stepper, vdot, .. } = &*memory;
            let points = stepper.points();
            let sum = stepper.warm().iter().zip(stepper.impacts()).map(|(w, i)| w.impulse + i);
            Ok(ContactStep {
                vdot: vdot.clone(),
                colliders: stepper.colliders().clone(),
                pairs: points.iter().map(|p| (p.a, p.b)).collect(),
                points: points.iter().flat_map(|p| p.point.data.0[0]).collect(),
                normals: points.iter().flat_map(|p| p.normal.data.0[0]).collect(),
                gaps: points.iter().map(|p| p.gap).collect(),
                impulses: sum.flat_map(|i: Vec3| i.data.0[0]).collect(),
                q,
                v,
                dt,
                report,
            })
        })
    }

    /// Advance the state by several steps, from t = 0.
    ///
    /// A UserWarning is emitted if the impulses of some steps did not converge within the tolerance.
    ///
    /// Parameters
    /// ----------
    /// q : array_like, shape (nq,)
    ///     Configuration, rad and m.
    /// v : array_like, shape (nv,)
    ///     Rates, rad/s and m/s.
    /// dt : float
    ///     Step size, s.
    /// steps : int
    ///     Number of steps.
    /// torque : array_like or callable, optional
    ///     Generalized forces, N m and N: constant (nv,), one row per step (steps, nv), or a function of (t, q, v) that returns (nv,) and is
    ///     called once per step.
    /// wrenches : dict of str to array_like, shape (6,), optional
    ///     As in `step`.
    ///
    /// Returns
    /// -------
    /// t : ndarray, shape (steps + 1,)
    ///     Times, s.
    /// q : ndarray, shape (steps + 1, nq)
    ///     Configurations.
    /// v : ndarray, shape (steps + 1, nv)
    ///     Rates.
    ///
    /// Raises
    /// ------
    /// LinkworkError
    ///     If an array has a wrong shape or contains NaN, dt is not positive, or `step` would raise.
    /// MemoryError
    ///     If the trajectories do not fit into memory.
    ///
    /// Examples
    /// --------
    /// >>> t, q, v = contact.simulate([0, 0, 0.5, 0, 0, 0, 1], np.zeros(6), 0.01, 100)
    /// >>> t.shape, q.shape, v.shape
    /// ((101,), (101, 7), (101, 6))
    /// >>> bool(abs(q[-1, 2] - 0.1) < 1e-3)
    /// True
    #[pyo3(signature = (q, v, dt, steps, *, torque=None, wrenches=None))]
    fn simulate<'py>(
        &self,
        py: Python<'py>,
        q: ArrayLike<'_, 'py>,
        v: ArrayLike<'_, 'py>,
        dt: f64,
        steps: usize,
        torque: Option<ArrayLike<'_, 'py>>,
        wrenches: Option<&Bound<'py, PyDict>>,
    ) -> PyResult<(Array1<'py>, Array2<'py>, Array2<'py>)> {
        let (core, nq, nv) = (&*self.core, self.core.nq(), self.core.nv());
        let dt = setting("dt", Some(dt), dt, false)?;
        let mut q = core.configuration(q, "q")?.slice().to_vec();
        let mut v = vector(v, nv, "v")?.slice().to_vec();
        let torque = Torque::read(torque, nv, steps)?;
        let wrenches = core.wrenches(wrenches)?;
        if core.is_constrained() {
            may_begin(core, &q, &v)?;
        }
        let rows = steps.saturating_add(1);
        let (mut qs, mut vs, mut t) = (room(rows, nq)?, room(rows, nv)?, room(rows, 1)?);
        qs.extend_from_slice(&q);
        vs.extend_from_slice(&v);
        let (mut open, mut worst, mut tau) = (0_usize, 0.0_f64, vec![0.0; nv]);
        torque.drive(py, nv, steps, |k, forces: &mut Forces<'_>| {
            let now = k as f64 * dt;
            tau.fill(0.0);
            forces(k, now, &q, &v, &mut tau)?;
            // The lock is not held while the forces are computed, because the function may use this Contact.
            let report = lock(&self.memory).step(core, &wrenches, dt, &mut q, &mut v, &mut tau);
            let report = report.map_err(|e| refuse(format!("t = {now} s: {e}")))?;
            if !report.converged {
                open += 1;
                worst = worst.max(report.measure.residual);
            }
            qs.extend_from_slice(&q);
            vs.extend_from_slice(&v);
            Ok(())
        })?;
        if open > 0 {
            let tolerance = lock(&self.memory).stepper.settings.solver.tolerance;
            let text = format!(
                "impulses of {open} of {steps} steps did not converge within the tolerance {tolerance}: largest residual {worst:.1e}\n  help: use a \
                 smaller dt, or a larger tolerance"
            );
            let text = std::ffi::CString::new(text).unwrap_or_default();
            PyErr::warn(py, &py.get_type::<pyo3::exceptions::PyUserWarning>(), &text, 1)?;
        }
        t.extend((0..=steps).map(|k| k as f64 * dt));
        Ok((out1(py, t), out2(py, qs, rows, nq)?, out2(py, vs, rows, nv)?))
    }

    fn __repr__(&self) -> String {
        let memory = lock(&self.memory);
        let (bodies, colliders) = (self.core.mbs.bodies().len(), memory.stepper.colliders().len());
        format!("Contact({bodies} bodies, {colliders} colliders)")
    }
}

impl Memory {
    /// Makes one step in place, then projects the state onto loops and couplings.
    fn step(
        &mut self,
        core: &Core,
        wrenches: &[(NodeId, Force)],
        dt: f64,
        q: &mut [f64],
        v: &mut [f64],
        tau: &mut [f64],
    ) -> PyResult<StepReport> {
        let mut ws = core.workspace();
        core.load(&mut ws, q, v, wrenches);
        self.vdot.fill(0.0);
        let state = (&mut *q, &mut *v);
        let Self { stepper, hiding, vdot } = self;
        let step = stepper.step(&core.tree, &mut ws, dt, state, &[], Some(hiding), tau, vdot);
        core.give_back(ws);
        let report = step.map_err(refuse)?;
        core.mbs.normalize(q);
        if core.is_constrained() {
            core.with_constrained(ConstraintMethod::Auto, |c| c.close(core, &[], q, Some(v)))
                .map_err(refuse)?;
        }
        if q.iter().chain(&*v).all(|x| x.is_finite()) {
            return Ok(report);
        }
        Err(refuse_with(
            "the state after the step is NaN or infinite",
            "use a smaller dt, and check the forces",
        ))
    }
}
