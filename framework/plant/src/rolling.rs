//! A mechanism whose machines move by kinematics: they roll over the ground as their wheels turn, without inertia. If the wheel models supply
//! traction, the motion is quasi-static: all forces balance at each instant.
//!
//! Axles and steering are prescribed hinges; forces from wires on other hinges and nodes (springs, loads of an arm) affect the wheel loads but cause
//! no motion. Accelerations are means over the step.
use crate::block::{MechanismBlock, NEVER};
use crate::rolls::Rolls;
use crate::touch;
use linkwork_dynamics::{inverse_dynamics_given_kinematics, kinematics};
use linkwork_runtime::{EvalTime, Failure, Lane, Outcome, Traction};
use linkwork_solvers::{self as solvers, PairLoad};
use linkwork_spatial::Vec3;

impl MechanismBlock {
    /// A step of `h` s.
    pub(crate) fn roll(
        &mut self,
        now: &EvalTime,
        h: f64,
        x: &mut [f64],
        sig: &mut [f64],
    ) -> Outcome {
        let Some(mut rolls) = self.rolls.take() else { return Ok(()) };
        let done = self.roll_with(&mut rolls, now, h, x, sig);
        self.rolls = Some(rolls);
        done
    }

    fn roll_with(
        &mut self,
        rolls: &mut Rolls,
        now: &EvalTime,
        h: f64,
        x: &mut [f64],
        sig: &mut [f64],
    ) -> Outcome {
        let Rolls { rolling, terrain, still, hold, before, wheels, tractions } = rolls;
        // Compute the forces that hold the machine in equilibrium against gravity and the forces
        // from wires.
        self.at = NEVER;
        let q = &x[self.w.x..self.w.x + self.q.len()];
        kinematics(&self.tree, &mut self.ws, q, still);
        self.forces(now, x, sig)?;
        inverse_dynamics_given_kinematics(&self.tree, &mut self.ws, still, hold);
        hold.iter_mut().zip(&self.tau).for_each(|(hold, tau)| *hold -= tau);
        let plan = self.plan.clone();
        let lanes = &self.w.ud[self.w.ud.len() - Traction::N * plan.ports.tractions.len()..];
        for (traction, wheel) in tractions.iter_mut().zip(wheels) {
            let at = Traction::N * *wheel;
            let t = Traction::gather(sig, &lanes[at..]);
            let (force, moment, sinkage) = (t.force, t.moment, t.sinkage);
            let (resistance, limit) = (t.resistance, t.limit);
            *traction = solvers::Traction { force, moment, resistance, limit, sinkage };
        }
        let (nq, nv, at) = (plan.multibody.nq(), plan.multibody.nv(), self.w.x);
        let (q, v) = x[at..at + nq + nv].split_at_mut(nq);
        before.copy_from_slice(v);
        let down = match (&plan.uniform, &plan.gravity) {
            (Some(g), _) => *g,
            (None, Some(field)) => {
                let root = rolling.vehicles().next().map(|v| v.root);
                let place = root.map(|b| self.ws.body_pose(&self.tree, b).position);
                field.acceleration(now.t, place.unwrap_or_else(Vec3::zeros))
            }
            (None, None) => -Vec3::z(),
        };
        let up = (-down).try_normalize(0.0).unwrap_or_else(Vec3::z);
        let mut ground = |x: f64, y: f64| terrain.ground(x, y).map(|g| (g.height, g.normal));
        let report = rolling
            .step(
                &self.tree,
                &mut self.ws,
                &mut ground,
                h,
                (q, v, &self.vdot),
                (hold, &up),
                tractions,
            )
            .map_err(|e| Failure::of(&e))?;
        for (vdot, (after, before)) in self.vdot.iter_mut().zip(v.iter().zip(before.iter())) {
            *vdot = (after - before) / h;
        }
        sig[self.w.yd..self.w.yd + nv].copy_from_slice(&self.vdot);
        kinematics(&self.tree, &mut self.ws, q, v);
        if !plan.ports.accels.is_empty() {
            inverse_dynamics_given_kinematics(&self.tree, &mut self.ws, &self.vdot, hold);
            self.put_accelerations(sig);
        }
        self.put_vehicles(sig);
        let [_, constraints, first, end, _] = self.output_lanes();
        // Couplings are the only constraints here. They hold to the accuracy of the settling.
        for (lanes, force) in
            sig[constraints..first].chunks_exact_mut(2).zip(rolling.coupling_forces())
        {
            lanes.copy_from_slice(&[0.0, *force]);
        }
        sig[first..first + 2].copy_from_slice(&[report.gap, report.slide]);
        let loads = rolling.loads().iter().map(|l| PairLoad {
            body_a: None,
            body_b: Some(l.body),
            force: l.force,
            point: l.point,
            pressure: l.force.norm(),
            surface_power: 0.0,
        });
        let origin = |b| self.ws.body_pose(&self.tree, b).position;
        touch::put(&plan.touched, loads, origin, &mut self.weights, &mut sig[first + 2..end]);
        self.put_touches(sig);
        Ok(())
    }
}
