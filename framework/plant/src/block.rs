//! The operations of the mechanism, with its work space.
use crate::forward_jacobian::ForwardJacobian;
use crate::frame::Frame;
use crate::plan::MechanismPlan;
use crate::rolls::Rolls;
use crate::touch;
use linkwork_dynamics::{
    HingeLoads, Tree, Workspace, forward_dynamics_given_kinematics, kinematics,
};
use linkwork_multibody::{BodyId, LoopMotion};
use linkwork_runtime::host::copy_store;
use linkwork_runtime::{
    Block, BuildError, EvalTime, Evaluation, Failure, Jacobian, Lane, NodeState, Operation,
    Outcome, Wiring,
};
use linkwork_solvers::{
    CompliantContact, ConstrainedSolver, ContactStepper, Impulse, Projector, StepReport,
};
use linkwork_spatial::{Force, Vec3};
use serde::{Deserialize, Serialize};
use std::any::Any;
use std::sync::Arc;

/// An impulse of the last contacts, which the mechanism keeps from step to step.
#[derive(Clone, Serialize, Deserialize)]
struct ContactMemory {
    pair: (u32, u32),
    feature: u64,
    impulse: [f64; 3],
}

pub(crate) struct MechanismBlock {
    pub(crate) plan: Arc<MechanismPlan>,
    pub(crate) w: Wiring,
    /// The tree of the plan, or a copy if masses change.
    pub(crate) tree: Arc<Tree>,
    /// The added masses that the inertias in `tree` include.
    added: Vec<f64>,
    pub(crate) ws: Workspace,
    /// Number of the evaluation that the kinematics in `ws` belong to.
    pub(crate) at: u64,
    pub(crate) solver: Option<ConstrainedSolver>,
    pub(crate) projector: Projector,
    pub(crate) stepper: Option<ContactStepper>,
    pub(crate) compliant: Option<CompliantContact>,
    /// Number of the evaluation that the contact points of `compliant` belong to.
    found: u64,
    pub(crate) rolls: Option<Rolls>,
    pub(crate) tau: Vec<f64>,
    pub(crate) vdot: Vec<f64>,
    pub(crate) motions: Vec<LoopMotion>,
    /// Created when a stiff method first asks for a Jacobian.
    pub(crate) slopes: Option<Box<ForwardJacobian>>,
    pub(crate) q: Vec<f64>,
    pub(crate) dv: Vec<f64>,
    /// Memory for the loads of hinges that report them.
    pub(crate) loads: Option<Box<HingeLoads>>,
    /// Sums of normal forces by body.
    pub(crate) weights: Vec<f64>,
    /// The store, which contains the impulses of the last contacts.
    kept: Vec<ContactMemory>,
    /// Report of a contact step that was not solved to its tolerance; the run receives it once.
    unsolved: Option<StepReport>,
    unsolved_told: bool,
}

#[inline(always)]
fn put3(sig: &mut [f64], at: usize, v: &Vec3) {
    sig[at..at + 3].copy_from_slice(&[v.x, v.y, v.z]);
}

/// Number of reports of contact by impulses.
const CONTACT_NUMBERS: usize = 7;

/// A number that no evaluation uses.
pub(crate) const NEVER: u64 = u64::MAX;

impl MechanismBlock {
    pub fn new(plan: Arc<MechanismPlan>, w: Wiring) -> Self {
        let (nq, nv) = (plan.multibody.nq(), plan.multibody.nv());
        MechanismBlock {
            w,
            tree: match plan.varies.is_empty() {
                true => plan.tree.clone(),
                false => {
                    let bodies: Vec<BodyId> = plan.varies.iter().map(|v| v.body).collect();
                    let mut tree = Tree::clone(&plan.tree);
                    tree.vary(&bodies);
                    Arc::new(tree)
                }
            },
            added: vec![f64::NAN; 10 * plan.ports.masses.len()],
            ws: Workspace::new(&plan.tree),
            at: NEVER,
            solver: plan.solver.clone(),
            projector: Projector::new(&plan.tree),
            stepper: plan.stepper(),
            compliant: plan.compliant_contact(),
            found: NEVER,
            rolls: Rolls::of(&plan),
            tau: vec![0.0; nv],
            vdot: vec![0.0; nv],
            motions: plan.loop_motions.clone(),
            slopes: None,
            q: vec![0.0; nq],
            dv: vec![0.0; nv],
            loads: (!plan.loads.is_empty()).then(|| Box::new(HingeLoads::new(&plan.tree))),
            weights: vec![0.0; plan.touched.len()],
            kept: Vec::new(),
            unsolved: None,
            unsolved_told: false,
            plan,
        }
    }

    pub(crate) fn split<'x>(&self, x: &'x [f64]) -> (&'x [f64], &'x [f64]) {
        let (nq, nv) = (self.plan.multibody.nq(), self.plan.multibody.nv());
        let at = self.w.x;
        (&x[at..at + nq], &x[at + nq..at + nq + nv])
    }

    /// First lane of u, u̇ of the loop motions.
    fn motion_lanes(&self) -> usize {
        self.w.x + self.plan.multibody.nq() + self.plan.multibody.nv()
    }

    /// First lane of the bristles.
    fn bristle_lanes(&self) -> usize {
        self.motion_lanes() + 2 * self.motions.len()
    }

    /// First signal lanes of the rates of bristles, of the reports of constraints, contact, pairs and hinges, and of the accelerations of frames.
    pub(crate) fn output_lanes(&self) -> [usize; 5] {
        let rates = self.w.yd + self.plan.multibody.nv();
        let reports = rates + self.plan.bristles();
        let constraints = self.plan.multibody.constraints();
        let rows: usize = constraints.map(|c| 1 + self.plan.multibody.rows(c)).sum();
        let contact = reports + rows;
        let bodies = touch::LANES * self.plan.touched.len();
        let pairs = contact + self.plan.contact_reports().len() + bodies;
        let hinges = pairs + touch::LANES * self.plan.pairs.len();
        [rates, reports, contact, pairs, hinges + self.plan.load_lanes()]
    }

    /// Computes the kinematics of this evaluation once.
    pub(crate) fn kinematics(&mut self, now: &EvalTime, x: &[f64]) {
        if self.at != now.number {
            let (q, v) = self.split(x);
            kinematics(&self.tree, &mut self.ws, q, v);
            self.at = now.number;
        }
    }

    /// Loop motions at a state.
    pub(crate) fn read_motions(&mut self, x: &[f64]) {
        let at = self.motion_lanes();
        for (i, m) in self.motions.iter_mut().enumerate() {
            (m.position, m.rate) = (x[at + 2 * i], x[at + 2 * i + 1]);
        }
    }

    /// Updates the inertias of bodies with added masses, if these masses have changed.
    fn masses(&mut self, sig: &[f64]) -> Outcome {
        let mut same = true;
        for (was, lane) in self.added.iter_mut().zip(&self.w.ud) {
            let now = sig[*lane as usize];
            same &= was.to_bits() == now.to_bits();
            *was = now;
        }
        let Some(tree) = Arc::get_mut(&mut self.tree).filter(|_| !same) else { return Ok(()) };
        for varying in &self.plan.varies {
            let put = varying
                .inertia(&self.plan.multibody, |lane| self.added[lane])
                .map_err(|(fact, help)| Box::new(Failure { message: fact, help: Some(help) }))
                .and_then(|i| tree.set_inertia(varying.body, i).map_err(|e| Failure::of(&e)));
            if put.is_err() {
                self.added.fill(f64::NAN);
                return put;
            }
        }
        Ok(())
    }

    /// Collects masses, gravity, internal forces of hinges and inputs from wires: forces in the work space, torques and prescribed accelerations in
    /// `tau` and `vdot`, loop motions, and rates of bristles in `rates`.
    pub(crate) fn forces(&mut self, now: &EvalTime, x: &[f64], sig: &[f64]) -> Outcome {
        if !self.plan.varies.is_empty() {
            self.masses(sig)?;
        }
        let plan = &*self.plan;
        let ws = &mut self.ws;
        ws.clear_forces();
        match (&plan.gravity, plan.uniform) {
            (_, Some(g)) => ws.apply_uniform_gravity(g),
            (Some(field), None) => {
                let scale = |p: &Vec3| field.scale(now.t, *p);
                let pull = &mut |p: &Vec3| field.acceleration(now.t, *p);
                ws.apply_smooth_gravity(&self.tree, &scale, pull);
                if let Some(omega) = plan.omega {
                    ws.apply_coriolis(&self.tree, &omega);
                }
            }
            (None, None) => {}
        }
        self.tau.fill(0.0);
        self.vdot.fill(0.0);
        let (nq, nv) = (plan.multibody.nq(), plan.multibody.nv());
        let (q, rest) = x[self.w.x..].split_at(nq);
        if self.w.ud.is_empty() && self.motions.is_empty() {
            plan.joints.add(q, &rest[..nv], &mut self.tau);
            return Ok(());
        }
        let ud = &self.w.ud[10 * plan.ports.masses.len()..];
        let (wrenches, others) = ud.split_at(6 * plan.ports.wrenches.len());
        for (frame, lanes) in plan.ports.wrenches.iter().zip(wrenches.as_chunks::<6>().0) {
            let f: [f64; 6] = std::array::from_fn(|k| sig[lanes[k] as usize]);
            let wrench = Force::new(Vec3::new(f[0], f[1], f[2]), Vec3::new(f[3], f[4], f[5]));
            match frame {
                Frame::Node(n) => ws.add_wrench_at_node(&self.tree, *n, wrench),
                Frame::Body(b) => ws.add_wrench_at_body(&self.tree, *b, wrench),
            }
        }
        let (torques, others) = others.split_at(plan.ports.torques.len());
        let (balls, others) = others.split_at(3 * plan.ports.ball_torques.len());
        let (surfaces, others) = others.split_at(3 * plan.ports.surfaces.len());
        let (motions, loops) = others.split_at(plan.ports.motions.len());
        for (v, lane) in plan.ports.torques.iter().zip(torques) {
            self.tau[*v as usize] = sig[*lane as usize];
        }
        for (v, lanes) in plan.ports.ball_torques.iter().zip(balls.as_chunks::<3>().0) {
            for (k, lane) in lanes.iter().enumerate() {
                self.tau[*v as usize + k] = sig[*lane as usize];
            }
        }
        if let Some(of) = touch::surfaces(&mut self.stepper, &mut self.compliant) {
            for (ids, lanes) in plan.belts.iter().zip(surfaces.as_chunks::<3>().0) {
                let velocity = Vec3::from_fn(|k, _| sig[lanes[k] as usize]);
                ids.iter().for_each(|id| of.set(*id, velocity));
            }
        }
        plan.joints.add(q, &rest[..nv], &mut self.tau);
        for (v, lane) in plan.ports.motions.iter().zip(motions) {
            self.vdot[*v as usize] = sig[*lane as usize];
        }
        let at = self.w.x + nq + nv;
        for (i, m) in self.motions.iter_mut().enumerate() {
            (m.position, m.rate) = (x[at + 2 * i], x[at + 2 * i + 1]);
        }
        for (i, lane) in plan.ports.loop_motions.iter().zip(loops) {
            self.motions[*i as usize].acceleration = sig[*lane as usize];
        }
        for gaps in &plan.gaps {
            for m in &mut self.motions[gaps.motions.clone()] {
                m.acceleration = gaps.acceleration(m.position, m.rate);
            }
        }
        Ok(())
    }

    #[inline]
    pub(crate) fn put_accelerations(&self, sig: &mut [f64]) {
        let plan = &*self.plan;
        if plan.ports.accels.is_empty() {
            return;
        }
        let [.., first] = self.output_lanes();
        for (i, frame) in plan.ports.accels.iter().enumerate() {
            let a = match frame {
                Frame::Node(n) => self.ws.node_acceleration(&self.tree, *n),
                Frame::Body(b) => self.ws.body_acceleration(&self.tree, *b),
            };
            put3(sig, first + 6 * i, &a.angular);
            put3(sig, first + 6 * i + 3, &a.linear);
        }
    }

    /// Writes the touch reports of bodies to the ports of parts that read them.
    pub(crate) fn put_touches(&self, sig: &mut [f64]) {
        let [_, _, _, pairs, accels] = self.output_lanes();
        let (ports, touched) = (&self.plan.ports, &self.plan.touched);
        let reports = pairs - touch::LANES * touched.len();
        let first = accels + 6 * ports.accels.len();
        for (i, body) in ports.contacts.iter().enumerate() {
            let Ok(k) = touched.binary_search(body) else { continue };
            let from = reports + touch::LANES * k;
            sig.copy_within(from..from + touch::LANES, first + touch::LANES * i);
        }
    }

    /// Writes the reports of compliant contact.
    fn put_contact(&mut self, sig: &mut [f64]) {
        if self.compliant.is_none() {
            return;
        }
        let [_, _, at, end, _] = self.output_lanes();
        let Some(contact) = &self.compliant else { return };
        let press = contact.points().iter().filter(|p| p.gap < 0.0);
        let (mut count, mut deepest) = (0.0, 0.0_f64);
        for p in press {
            (count, deepest) = (count + 1.0, deepest.max(-p.gap));
        }
        sig[at..at + 2].copy_from_slice(&[count, deepest]);
        let origin = |b| self.ws.body_pose(&self.tree, b).position;
        let loads = touch::of_forces(contact);
        let pairs = &mut sig[end..end + touch::LANES * self.plan.pairs.len()];
        touch::put_pairs(&self.plan.pairs, loads.clone(), origin, pairs);
        touch::put(&self.plan.touched, loads, origin, &mut self.weights, &mut sig[at + 2..end]);
        self.put_touches(sig);
        self.put_zones(None, sig);
    }

    /// Writes the errors and forces of constraints.
    fn put_constraints(&mut self, q: &[f64], sig: &mut [f64]) {
        if self.solver.is_none() {
            return;
        }
        let [_, mut lane, ..] = self.output_lanes();
        let Some(solver) = &mut self.solver else { return };
        let plan = &*self.plan;
        for c in plan.multibody.constraints() {
            sig[lane] = solver.error(&self.tree, &self.ws, c, &self.motions, q);
            let forces = match &self.stepper {
                None => solver.forces(&self.tree, c),
                Some(stepper) => stepper.forces(&self.tree, c),
            };
            sig[lane + 1..lane + 1 + forces.len()].copy_from_slice(forces);
            lane += 1 + forces.len();
        }
    }
}

impl Block for MechanismBlock {
    fn outputs(&mut self, now: &EvalTime, x: &[f64], _: &[f64], sig: &mut [f64]) -> Outcome {
        self.kinematics(now, x);
        let plan = &*self.plan;
        let mut lane = self.w.ym;
        for frame in &plan.ports.states {
            let (pose, velocity) = match frame {
                Frame::Node(n) => self.ws.node_state(&self.tree, *n),
                Frame::Body(b) => self.ws.body_state(&self.tree, *b),
            };
            NodeState {
                position: pose.position,
                rotation: pose.rotation,
                angular: velocity.angular,
                velocity: velocity.linear,
            }
            .put(&mut sig[lane..]);
            lane += 13;
        }
        let (q, v) = self.split(x);
        for &(iq, iv) in &plan.ports.hinges {
            (sig[lane], sig[lane + 1]) = (q[iq as usize], v[iv as usize]);
            lane += 2;
        }
        let motions = self.motion_lanes();
        for &i in &plan.ports.loop_states {
            let from = motions + 2 * i as usize;
            sig[lane..lane + 2].copy_from_slice(&x[from..from + 2]);
            lane += 2;
        }
        for &(iq, iv) in &plan.ports.balls {
            let (iq, iv) = (iq as usize, iv as usize);
            sig[lane..lane + 4].copy_from_slice(&q[iq..iq + 4]);
            sig[lane + 4..lane + 7].copy_from_slice(&v[iv..iv + 3]);
            lane += 7;
        }
        for frame in &plan.ports.bodies {
            frame.mass(&plan.multibody).put(&mut sig[lane..]);
            lane += 10;
        }
        Ok(())
    }

    fn feedthrough(&mut self, now: &EvalTime, x: &[f64], d: &[f64], sig: &mut [f64]) -> Outcome {
        self.kinematics(now, x);
        self.forces(now, x, sig)?;
        let (rates, nv) = (self.w.yd + self.vdot.len(), self.vdot.len());
        let (at, bristles) = (self.bristle_lanes(), self.plan.bristles());
        if let Some(compliant) = &mut self.compliant {
            let pairs = &d[self.w.d..self.w.d + self.plan.bristle_pairs()];
            let state = (&x[at..at + bristles], pairs);
            let out = &mut sig[rates..rates + bristles];
            compliant.apply(&self.tree, &mut self.ws, state, out);
            self.found = now.number;
        }
        let (q, v) = self.split(x);
        let tree = &self.tree;
        match &mut self.solver {
            None => {
                forward_dynamics_given_kinematics(
                    tree,
                    &mut self.ws,
                    &mut self.tau,
                    &mut self.vdot,
                )
                .map_err(|e| Failure::of(&e))?;
            }
            Some(solver) => {
                solver
                    .forward_given_kinematics(
                        tree,
                        &mut self.ws,
                        (q, v),
                        &self.motions,
                        &mut self.tau,
                        &mut self.vdot,
                    )
                    .map_err(|e| Failure::of(&e))?;
            }
        }
        sig[self.w.yd..self.w.yd + nv].copy_from_slice(&self.vdot);
        self.put_accelerations(sig);
        self.put_vehicles(sig);
        self.put_loads(None, sig);
        if now.evaluation == Evaluation::Tick {
            self.put_constraints(q, sig);
        }
        // Parts that read the contacts of a body read them at every stage.
        let ports = &self.plan.ports;
        if now.evaluation == Evaluation::Tick
            || !(ports.contacts.is_empty() && ports.zones.is_empty())
        {
            self.put_contact(sig);
        }
        Ok(())
    }

    fn derivatives(
        &mut self,
        _: &EvalTime,
        x: &[f64],
        _: &[f64],
        sig: &[f64],
        xdot: &mut [f64],
    ) -> Outcome {
        let (q, v) = self.split(x);
        let (at, nq, nv) = (self.w.x, q.len(), v.len());
        self.plan.multibody.qdot(q, v, &mut xdot[at..at + nq]);
        xdot[at + nq..at + nq + nv].copy_from_slice(&sig[self.w.yd..self.w.yd + nv]);
        let bristles = self.plan.bristles();
        if self.motions.is_empty() && bristles == 0 {
            return Ok(());
        }
        let motions = self.motion_lanes();
        let given = &self.plan.ports.loop_motions;
        let lanes = &self.w.ud[self.w.ud.len() - given.len()..];
        for i in 0..self.motions.len() {
            let lane = given.iter().position(|g| *g as usize == i).map(|k| lanes[k] as usize);
            let constant = self.plan.loop_motions[i].acceleration;
            xdot[motions + 2 * i] = x[motions + 2 * i + 1];
            xdot[motions + 2 * i + 1] = lane.map_or(constant, |l| sig[l]);
        }
        for gaps in &self.plan.gaps {
            for at in gaps.motions.clone().map(|i| motions + 2 * i) {
                xdot[at + 1] = gaps.acceleration(x[at], x[at + 1]);
            }
        }
        let (first, rates) = (self.bristle_lanes(), self.w.yd + nv);
        xdot[first..first + bristles].copy_from_slice(&sig[rates..rates + bristles]);
        Ok(())
    }

    fn jacobian(
        &mut self,
        operation: Operation,
        now: &EvalTime,
        (x, _, sig): (&[f64], &[f64], &[f64]),
        out: &mut Jacobian,
    ) -> Outcome {
        match operation {
            Operation::Outputs => {
                self.output_jacobian(now, x, out);
                Ok(())
            }
            Operation::Feedthrough => self.feedthrough_jacobian(now, x, sig, out),
            Operation::Derivatives => {
                self.deriv_slopes(x, out);
                Ok(())
            }
        }
    }

    fn update(&mut self, _: &EvalTime, _: &[f64], _: &mut [f64], _: &[f64]) -> Outcome {
        Ok(())
    }

    fn project(&mut self, x: &mut [f64]) -> Outcome {
        let at = self.w.x;
        self.at = NEVER;
        self.plan.multibody.normalize(&mut x[at..at + self.plan.multibody.nq()]);
        let steps = self.stepper.is_some() || self.rolls.is_some();
        if steps { Ok(()) } else { self.close(x) }
    }

    fn project_change(&mut self, x: &[f64], change: &mut [f64]) -> Outcome {
        self.close_change(x, change)
    }

    fn rearrange(
        &mut self,
        now: &EvalTime,
        x: &mut [f64],
        d: &mut [f64],
    ) -> Result<bool, Box<Failure>> {
        self.kinematics(now, x);
        let (at, bristles) = (self.bristle_lanes(), self.plan.bristles());
        let Some(compliant) = &mut self.compliant else { return Ok(false) };
        if self.found != now.number {
            compliant.find(&self.tree, &self.ws);
            self.found = now.number;
        }
        let pairs = &mut d[self.w.d..self.w.d + self.plan.bristle_pairs()];
        compliant.assign(&mut x[at..at + bristles], pairs).map_err(|e| Failure::of(&e))
    }

    fn retract(&mut self, x: &mut [f64], h: f64) -> Outcome {
        let (nq, nv) = (self.plan.multibody.nq(), self.plan.multibody.nv());
        let at = self.w.x;
        let (q, rest) = x[at..].split_at_mut(nq);
        self.plan.multibody.step_positions(q, &mut rest[..nv], h, &mut self.dv, &mut self.q);
        q.copy_from_slice(&self.q);
        Ok(())
    }

    fn advance(&mut self, now: &EvalTime, h: f64, x: &mut [f64], sig: &mut [f64]) -> Outcome {
        if self.rolls.is_some() {
            return self.roll(now, h, x, sig);
        }
        self.kinematics(now, x);
        self.forces(now, x, sig)?;
        let Some(stepper) = &mut self.stepper else { return Ok(()) };
        let plan = &*self.plan;
        let (nq, nv) = (plan.multibody.nq(), plan.multibody.nv());
        let at = self.w.x;
        let (q, v) = x[at..at + nq + nv].split_at_mut(nq);
        let motions = &self.motions;
        let (ws, tau, vdot) = (&mut self.ws, &mut self.tau, &mut self.vdot);
        let report = stepper
            .step(&self.tree, ws, h, (q, v), motions, None, tau, vdot)
            .map_err(|e| Failure::of(&e))?;
        self.kept.clear();
        self.kept.extend(stepper.warm().iter().map(|i| ContactMemory {
            pair: i.pair,
            feature: i.feature,
            impulse: i.impulse.into(),
        }));
        sig[self.w.yd..self.w.yd + nv].copy_from_slice(&self.vdot);
        let [_, _, at, end, _] = self.output_lanes();
        sig[at..at + CONTACT_NUMBERS].copy_from_slice(&[
            report.contacts as f64,
            report.penetration.max(0.0),
            report.impacts as f64,
            report.measure.residual,
            report.measure.complementarity,
            f64::from(report.iterations),
            report.islands as f64,
        ]);
        if !report.converged && !self.unsolved_told {
            self.unsolved = Some(report);
        }
        if let Some(stepper) = &self.stepper {
            let loads = touch::of_impulses(stepper, h);
            let origin = |b| self.ws.body_pose(&self.tree, b).position;
            let pairs = &mut sig[end..end + touch::LANES * self.plan.pairs.len()];
            touch::put_pairs(&self.plan.pairs, loads.clone(), origin, pairs);
            let lanes = &mut sig[at + CONTACT_NUMBERS..end];
            touch::put(&self.plan.touched, loads, origin, &mut self.weights, lanes);
        }
        self.put_touches(sig);
        self.put_zones(Some(h), sig);
        self.put_accelerations(sig);
        self.put_vehicles(sig);
        self.put_loads(Some(h), sig);
        let lanes = self.motion_lanes();
        for (i, m) in self.motions.iter().enumerate() {
            x[lanes + 2 * i + 1] += h * m.acceleration;
            x[lanes + 2 * i] += h * x[lanes + 2 * i + 1];
        }
        self.close(x)?;
        let (q, _) = self.split(x);
        self.put_constraints(q, sig);
        Ok(())
    }

    fn startup_warnings(
        &mut self,
        _: &EvalTime,
        _: &[f64],
        _: &[f64],
        _: &[f64],
    ) -> Vec<BuildError> {
        let over = self.plan.rank().map(|r| r.over_prescribed).unwrap_or_default();
        if over.is_empty() {
            return Vec::new();
        }
        let fact = format!(
            "{}: these constraints hold only as long as the prescribed motions are compatible with each other",
            over.join(", ")
        );
        let help = "prescribe at most as many hinges as the mechanism has degrees of freedom";
        vec![BuildError::new(fact).help(help)]
    }

    fn accounts(&mut self, now: &EvalTime, x: &[f64], sig: &[f64], out: &mut [f64]) {
        self.count(now, x, sig, out);
    }

    fn warns(&mut self) -> Option<BuildError> {
        let report = self.unsolved.take()?;
        self.unsolved_told = true;
        let tolerance = self.stepper.as_ref()?.settings.solver.tolerance;
        let fact = format!(
            "a contact step did not converge: its residual is {:.1e} of the greatest velocity, but `tolerance` is {tolerance:.1e} ({} contact points in {} islands); `contact.residual` shows the residual of every step",
            report.measure.residual, report.contacts, report.islands
        );
        let help = "increase `sweeps` and `steps` of `contact`, use `method: Auto`, use a shorter step, or increase `tolerance`";
        Some(BuildError::new(fact).help(help))
    }

    fn save_store(&self) -> Result<Vec<u8>, String> {
        match &self.stepper {
            None => Ok(Vec::new()),
            Some(_) => rmp_serde::to_vec_named(&self.kept).map_err(|e| e.to_string()),
        }
    }
    fn load_store(&mut self, bytes: &[u8]) -> Result<(), String> {
        if self.stepper.is_some() {
            let kept: Vec<ContactMemory> =
                rmp_serde::from_slice(bytes).map_err(|e| e.to_string())?;
            self.take_store(&kept);
        }
        Ok(())
    }
    fn copy_store(&self, into: &mut Option<Box<dyn Any + Send>>) {
        if self.stepper.is_some() {
            copy_store(&self.kept, into);
        }
    }
    fn take_store(&mut self, from: &dyn Any) {
        let (Some(stepper), Some(kept)) =
            (&mut self.stepper, from.downcast_ref::<Vec<ContactMemory>>())
        else {
            return;
        };
        self.kept.clone_from(kept);
        let back = |k: &ContactMemory| Impulse {
            pair: k.pair,
            feature: k.feature,
            impulse: k.impulse.into(),
        };
        stepper.set_warm(&kept.iter().map(back).collect::<Vec<_>>());
    }
    fn fork(&self) -> Box<dyn Block> {
        let mut copy = MechanismBlock::new(self.plan.clone(), self.w.clone());
        copy.take_store(&self.kept);
        Box::new(copy)
    }
}
