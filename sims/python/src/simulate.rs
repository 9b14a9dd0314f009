//! `Mechanism.simulate`: fixed-step integration of one mechanism, without parts and wires.
//!
//! ```text
//! rk4                   ẋ = [N(q) v; v̇(t, q, v)], four evaluations a step, quaternions brought to
//!                       length 1 after each step: order 4
//! semi_implicit_euler   v += h v̇(t, q, v), then q moved by h v on its manifold: order 1
//! ```
//! Loops and couplings are satisfied: small loops are embedded, the others have multipliers, and after each step q and v are projected onto all of
//! them.
use crate::array::{Array1, Array2, Input, out1, out2, room, vector};
use crate::constraints::may_begin;
use crate::core::Core;
use crate::error::{refuse, refuse_with};
use crate::mechanism::{Mechanism, choice};
use linkwork_dynamics::forward_dynamics_given_kinematics;
use linkwork_integrate::{Failure, Integrator, Method, System};
use linkwork_multibody::NodeId;
use linkwork_solvers::ConstraintMethod;
use linkwork_spatial::Force;
use numpy::PyArray1;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use std::ops::Range;

/// Number of steps between two checks for Ctrl-C.
const CHUNK: usize = 4096;

/// The source of the generalized forces.
pub enum Torque<'py> {
    /// No forces.
    None,
    /// Constant forces.
    Constant(Input<'py>),
    /// One row per step.
    Rows(Input<'py>),
    /// A function of t, q, v.
    Call(Bound<'py, PyAny>),
}

impl<'py> Torque<'py> {
    /// Reads nothing, an array of either shape, or a function.
    pub fn read(given: Option<&Bound<'py, PyAny>>, nv: usize, steps: usize) -> PyResult<Self> {
        let Some(given) = given else { return Ok(Torque::None) };
        if given.is_callable() {
            return Ok(Torque::Call(given.clone()));
        }
        let input = Input::read(given, "torque")?;
        match *input.shape() {
            [n] if n == nv => Ok(Torque::Constant(input)),
            [k, n] if k == steps && n == nv => Ok(Torque::Rows(input)),
            ref shape => Err(refuse_with(
                format!("`torque` has the shape {shape:?}"),
                format!("give ({nv},), or ({steps}, {nv}), or a function of t, q, v"),
            )),
        }
    }

    /// Calls `step` with the number of each step and its forces. The interpreter's lock is released if the forces do not need it, and Ctrl-C is
    /// checked regularly.
    pub fn drive(
        &self,
        py: Python<'py>,
        nv: usize,
        steps: usize,
        mut step: impl FnMut(usize, &mut Forces<'_>) -> PyResult<()> + Send,
    ) -> PyResult<()> {
        for begin in (0..steps).step_by(CHUNK) {
            py.check_signals()?;
            let chunk = begin..(begin + CHUNK).min(steps);
            let mut go = |forces: &mut Forces<'_>| -> PyResult<()> {
                chunk.clone().try_for_each(|k| step(k, forces))
            };
            match self {
                Torque::None => py.detach(|| go(&mut |_, _, _, _, _| Ok(()))),
                Torque::Constant(c) => {
                    let c = c.slice();
                    py.detach(|| go(&mut |_, _, _, _, tau| fill(tau, c)))
                }
                Torque::Rows(rows) => {
                    let rows = rows.slice();
                    py.detach(|| go(&mut |k, _, _, _, tau| fill(tau, &rows[k * nv..(k + 1) * nv])))
                }
                Torque::Call(f) => go(&mut |_, t, q, v, tau| {
                    let state = (t, PyArray1::from_slice(py, q), PyArray1::from_slice(py, v));
                    fill(tau, vector(&f.call1(state)?, nv, "torque(t, q, v)")?.slice())
                }),
            }?;
        }
        Ok(())
    }
}

/// Writes the forces at step, t, q, v; the number of the step selects a row of a table.
pub type Forces<'a> = dyn FnMut(usize, f64, &[f64], &[f64], &mut [f64]) -> PyResult<()> + 'a;

/// The equations of motion for the integrator.
struct Motion<'a> {
    core: &'a Core,
    /// Whether there are loops or couplings.
    constrained: bool,
    wrenches: &'a [(NodeId, Force)],
    /// Number of the step.
    k: usize,
    forces: &'a mut Forces<'a>,
    /// Range of q in the state.
    positions: [Range<usize>; 1],
}

impl System for Motion<'_> {
    type Error = PyErr;

    fn derivatives(&mut self, t: f64, x: &[f64], out: &mut [f64]) -> PyResult<()> {
        let (q, v) = x.split_at(self.core.nq());
        let mut tau = vec![0.0; v.len()];
        (self.forces)(self.k, t, q, v, &mut tau)?;
        let (qdot, vdot) = out.split_at_mut(q.len());
        self.core.mbs.qdot(q, v, qdot);
        vdot.fill(0.0);
        let mut ws = self.core.workspace();
        self.core.load(&mut ws, q, v, self.wrenches);
        let result = match self.constrained {
            false => forward_dynamics_given_kinematics(&self.core.tree, &mut ws, &mut tau, vdot)
                .map_err(|e| e.to_string()),
            true => self.core.with_constrained(ConstraintMethod::Auto, |c| {
                let solved = c.forward(self.core, &mut ws, (q, v), &mut tau, vdot);
                solved.map(|_| ()).map_err(|e| e.to_string())
            }),
        };
        self.core.give_back(ws);
        result.map_err(|e| refuse(format!("t = {t} s: {e}")))
    }

    fn project(&mut self, t: f64, x: &mut [f64]) -> PyResult<()> {
        let (q, v) = x.split_at_mut(self.core.nq());
        self.core.mbs.normalize(q);
        if !self.constrained {
            return Ok(());
        }
        let closed = self
            .core
            .with_constrained(ConstraintMethod::Auto, |c| c.close(self.core, &[], q, Some(v)));
        closed.map_err(|e| refuse(format!("t = {t} s: {e}")))
    }

    fn positions(&self) -> &[Range<usize>] {
        &self.positions
    }

    fn retract(&mut self, x: &mut [f64], _: &[f64], h: f64) -> PyResult<()> {
        let (q, v) = x.split_at_mut(self.core.nq());
        let dv: Vec<f64> = v.iter().map(|v| v * h).collect();
        let from = q.to_vec();
        self.core.mbs.integrate(&from, &dv, q);
        Ok(())
    }
}

/// An integration in progress.
struct Run<'a> {
    core: &'a Core,
    constrained: bool,
    wrenches: &'a [(NodeId, Force)],
    integrator: Integrator,
    dt: f64,
    /// The state: q, then v.
    x: Vec<f64>,
}

impl Run<'_> {
    fn step<'f>(&'f mut self, k: usize, forces: &'f mut Forces<'f>) -> PyResult<()> {
        let Run { core, constrained, wrenches, integrator, dt, x } = self;
        let constrained = *constrained;
        let positions = std::array::from_fn(|_| 0..core.nq());
        let mut motion = Motion { core, constrained, wrenches, k, forces, positions };
        let t = k as f64 * *dt;
        integrator.step_fixed(&mut motion, t, *dt, x, None).map_err(|failure| match failure {
            Failure::System(e) => e,
            _ => refuse_with(
                format!("t = {} s: the state is NaN or infinite", t + *dt),
                "use a smaller dt, and check the torques",
            ),
        })
    }
}

#[pymethods]
impl Mechanism {
    /// Integrate the motion of the mechanism from t = 0 with a fixed step.
    ///
    /// Loops and couplings are kept closed; q and v must satisfy them at the start (see `close`). Prescribed coordinates keep their rates.
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
    ///     called at every evaluation (four per step with "rk4").
    /// integrator : {"rk4", "semi_implicit_euler"}
    ///     The method; of order 4 and 1.
    /// wrenches : dict of str to array_like, shape (6,), optional
    ///     Constant external wrenches as in `inverse_dynamics`.
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
    ///     If a name does not exist, or an array has a wrong shape or contains NaN.
    ///
    /// Examples
    /// --------
    /// >>> t, qs, vs = arm.simulate(q, v, dt=0.01, steps=100)
    /// >>> t.shape, qs.shape, vs.shape
    /// ((101,), (101, 2), (101, 2))
    #[pyo3(signature = (q, v, dt, steps, *, torque=None, integrator="rk4", wrenches=None))]
    fn simulate<'py>(
        &self,
        py: Python<'py>,
        q: &Bound<'py, PyAny>,
        v: &Bound<'py, PyAny>,
        dt: f64,
        steps: usize,
        torque: Option<&Bound<'py, PyAny>>,
        integrator: &str,
        wrenches: Option<&Bound<'py, PyDict>>,
    ) -> PyResult<(Array1<'py>, Array2<'py>, Array2<'py>)> {
        let (core, nq, nv) = (&*self.core, self.core.nq(), self.core.nv());
        if !(dt.is_finite() && dt > 0.0) {
            return Err(refuse_with(format!("`dt` is {dt}"), "give a positive step, in s"));
        }
        let known = ["rk4", "semi_implicit_euler"].map(|name| (name, name.replace('_', "-")));
        let known: Vec<(&str, &str)> = known.iter().map(|(a, b)| (*a, b.as_str())).collect();
        let name = choice("integrator", integrator, &known)?;
        let method = Method::by_name(name)
            .ok_or_else(|| refuse(format!("there is no integrator `{integrator}`")))?;
        let (q, v) = (core.configuration(q, "q")?, vector(v, nv, "v")?);
        let torque = Torque::read(torque, nv, steps)?;
        let wrenches = core.wrenches(wrenches)?;
        let x = [q.slice(), v.slice()].concat();
        let integrator = Integrator::new(method, nq + nv);
        let constrained = core.is_constrained();
        if constrained {
            may_begin(core, q.slice(), v.slice())?;
        }
        let mut run = Run { core, constrained, wrenches: &wrenches, integrator, dt, x };
        let rows = steps.saturating_add(1);
        let (mut qs, mut vs, mut t) = (room(rows, nq)?, room(rows, nv)?, room(rows, 1)?);
        qs.extend_from_slice(q.slice());
        vs.extend_from_slice(v.slice());
        torque.drive(py, nv, steps, |k, forces| {
            run.step(k, forces)?;
            qs.extend_from_slice(&run.x[..nq]);
            vs.extend_from_slice(&run.x[nq..]);
            Ok(())
        })?;
        t.extend((0..=steps).map(|k| k as f64 * dt));
        Ok((out1(py, t), out2(py, qs, steps + 1, nq)?, out2(py, vs, steps + 1, nv)?))
    }
}

fn fill(tau: &mut [f64], from: &[f64]) -> PyResult<()> {
    tau.copy_from_slice(from);
    Ok(())
}
