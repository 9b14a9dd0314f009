//! Momentum, composite inertias, bias forces, state prediction for estimators.

use crate::call::calls;
use crate::edge::{self, Out, disjoint, numbers, numbers_mut};
use crate::robot::LwRobot;
use crate::tool::{Tool, lend};
use linkwork_embedded::spatial::Motion;
use linkwork_embedded::{Predictor, RobotError, StateEstimate};

/// The inertia of a rigid body.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LwInertia {
    /// Mass, kg.
    pub mass: f64,
    /// From the origin to the centre of mass, m.
    pub center: [f64; 3],
    /// Inertia about the origin (not about the centre of mass), row after row, kg m^2.
    pub inertia: [f64; 9],
}

/// Memory of state prediction. Use it for robots of one model, with one call at a time.
pub struct LwPredictor(Tool<Predictor>);

calls![
    /// Writes the composite inertia of a body at the robot's q to `out`: the inertia of the body, everything that it carries, and held objects, as one
    /// rigid body; about the body's origin, world axes.
    fn lw_robot_composite_inertia(r: &mut LwRobot, body: u32, out: Out<LwInertia>) {
        let id = r.model().multibody().body_ids().nth(body as usize);
        let told = r.robot.composite_inertia(id.ok_or(RobotError::ForeignHandle)?);
        let J = told.inertia();
        let mut inertia = [0.0; 9];
        for (k, x) in inertia.iter_mut().enumerate() {
            *x = J[(k / 3, k % 3)];
        }
        out.set(LwInertia { mass: told.mass(), center: told.com().into(), inertia });
    }

    /// Writes the momentum about the centre of mass at the robot's q and rates `v` (`n` = nv), including held objects, to `out` (6 numbers: angular, kg
    /// m^2/s, then linear, kg m/s; world axes).
    fn lw_robot_momentum(r: &mut LwRobot, v: *const f64, n: usize, out: *mut f64) {
        let out = Out::new("out", out.cast::<[f64; 6]>())?;
        let told = r.robot.momentum(numbers("v", v, n, r.model().nv())?)?;
        let (a, l) = (told.moment, told.force);
        out.set([a.x, a.y, a.z, l.x, l.y, l.z]);
    }

    /// Writes the centroidal momentum matrix at the robot's q, including held objects, to `A` (6 rows of nv, row after row; `n` = 6 nv). It maps rates to
    /// the result of `lw_robot_momentum`. Its last three rows, divided by the mass of `lw_robot_center_of_mass`, are the Jacobian of the centre of mass.
    fn lw_robot_centroidal_matrix(r: &mut LwRobot, A: *mut f64, n: usize) {
        let A = numbers_mut("A", A, n, 6 * r.model().nv())?;
        r.robot.centroidal_matrix(A)?;
    }

    /// Writes the bias forces (velocity terms and gravity, without accelerations) at the robot's q and rates `v` to `tau` (`n` = nv each), including held
    /// objects. Writes the tip accelerations of `count` chains (at most as many as the model has parts) at constant rates to `tips` (6 numbers each:
    /// angular, rad/s^2, then linear, m/s^2, of the tip's origin, world axes).
    fn lw_robot_bias(
        r: &mut LwRobot,
        v: *const f64,
        n: usize,
        parts: *const u32,
        count: usize,
        tau: *mut f64,
        tips: *mut f64,
    ) {
        let room = r.model().parts().len();
        if count > room {
            return Err(RobotError::NoRoom { what: "parts", wanted: count, room }.into());
        }
        disjoint(&[("v", v, n)], &[("tau", tau, n), ("tips", tips, 6 * count)])?;
        let nv = r.model().nv();
        let v = numbers("v", v, n, nv)?;
        r.asked.clear();
        for k in 0..count {
            let part = r.part(edge::value("parts", parts.wrapping_add(k))?)?;
            r.asked.push(part);
        }
        let tau = numbers_mut("tau", tau, n, nv)?;
        let tips = numbers_mut("tips", tips, 6 * count, 6 * count)?;
        let moved: &mut [Motion] = &mut r.moved[..count];
        r.robot.bias(v, &r.asked, tau, moved)?;
        for (to, a) in tips.chunks_exact_mut(6).zip(moved) {
            to[..3].copy_from_slice(a.angular.as_slice());
            to[3..].copy_from_slice(a.linear.as_slice());
        }
    }

    /// Creates the memory of `lw_predictor_step` and writes it to `out`; free it with `lw_predictor_free`. It works with every robot of the same model.
    fn lw_predictor_new(r: &mut LwRobot, out: Out<*mut LwPredictor>) {
        let tool = Tool::new(r, Predictor::new(&r.robot));
        out.set(Box::into_raw(Box::new(LwPredictor(tool))));
    }

    /// Frees the memory; NULL has no effect.
    fn lw_predictor_free(predictor: *mut LwPredictor);

    /// Predicts the state of an estimator over `step` seconds, in place: `q` (`nq`), rates `v` (`nv`) and the `covariance` of their errors (2 nv rows of
    /// 2 nv, row after row: errors of q along v, then errors of v). It moves under the forces `tau` (`nv`), white force noise with the spectral densities
    /// `density` (`nv`; (N m)^2 s and N^2 s; not negative), held objects and the robot's gravity. The midpoint rule of second order is used. The robot's
    /// own q has no effect. Returns `LW_STATUS_SINGULAR` where a joint moves no mass.
    fn lw_predictor_step(
        r: &mut LwRobot,
        predictor: *mut LwPredictor,
        q: *mut f64,
        nq: usize,
        v: *mut f64,
        nv: usize,
        covariance: *mut f64,
        tau: *const f64,
        density: *const f64,
        step: f64,
    ) {
        let mut memory = lend("predictor", predictor, |p| &p.0, r)?;
        let (own_q, own_v) = (r.model().nq(), r.model().nv());
        let size = nv.saturating_mul(nv).saturating_mul(4);
        let written = [("q", q, nq), ("v", v, nv), ("covariance", covariance, size)];
        disjoint(&[("tau", tau, nv), ("density", density, nv)], &written)?;
        let q = numbers_mut("q", q, nq, own_q)?;
        let v = numbers_mut("v", v, nv, own_v)?;
        let covariance = numbers_mut("covariance", covariance, size, 4 * own_v * own_v)?;
        let tau = numbers("tau", tau, nv, own_v)?;
        let density = numbers("density", density, nv, own_v)?;
        let state = StateEstimate { q, v, covariance };
        r.robot.predict(&mut memory, state, tau, density, step)?;
    }

    /// Writes the transition matrix of the last step to `F` (2 nv rows of 2 nv, row after row; `n` = 4 nv nv), which maps errors before the step to
    /// errors after it; zero before the first step.
    fn lw_predictor_transition(
        r: &mut LwRobot,
        predictor: *mut LwPredictor,
        F: *mut f64,
        n: usize,
    ) {
        let memory = lend("predictor", predictor, |p| &p.0, r)?;
        let from = memory.transition();
        numbers_mut("F", F, n, from.len())?.copy_from_slice(from);
    }
];
