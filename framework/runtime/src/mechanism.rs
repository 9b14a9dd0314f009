//! The mechanism as one model with two operations: kinematics (from state) and dynamics (from forces).
//!
//! ```text
//! moore:  q, v → poses and velocities of the bound nodes, hinge states
//! direct: Σ wrenches, Σ torques, gravity → accelerations, forces of constraints
//! deriv:  q̇ = N(q) v,  v̇ from direct
//! ```
//! After a step q and v are put back onto the constraints. With contact, `direct` only gathers the
//! forces and the block advances a step at a time (`advance`); nothing but the impulses of the last
//! contacts passes from step to step, and they are its store.
use crate::block::{Block, Evaluation, Now};
use crate::ports::{Lane, NodeState};
use crate::services::Gravity;
use crate::spec::{ContactSpec, MechanismSpec};
use crate::value::{Fault, Origin};
use linkwork_collision::Colliders;
use linkwork_dynamics::{
    DynamicsError, Tree, Workspace, forward_dynamics_given_kinematics, kinematics,
};
use linkwork_multibody::{BodyId, ConstraintId, LoopMotion, Multibody, NodeId};
use linkwork_solvers::{
    CompliantContact, CompliantSettings, ConstrainedSolver, ContactStepper, Impulse, Projector,
    SolverError, Treatment,
};
use linkwork_spatial::{Force, Vec3};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::sync::Arc;

/// A frame that carries ports: a node, or a body's own origin.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Frame {
    /// A named node.
    Node(NodeId),
    /// A body's origin.
    Body(BodyId),
}

/// Where the mechanism finds and puts its lanes.
#[derive(Clone, Default)]
pub struct MechanismWiring {
    /// First lane of q in x (v follows).
    pub x: usize,
    /// Frame, first signal lane of its NodeState.
    pub states: Vec<(Frame, u32)>,
    /// (q index, v index, first signal lane of the HingeState).
    pub hinges: Vec<(u32, u32, u32)>,
    /// Frame, first signal lane of its NodeAccel.
    pub accels: Vec<(Frame, u32)>,
    /// Frame, signal lanes of the wrench on it.
    pub wrenches: Vec<(Frame, [u32; 6])>,
    /// v index, signal lane of the torque on it.
    pub torques: Vec<(u32, u32)>,
    /// v index, signal lane of its prescribed acceleration.
    pub motions: Vec<(u32, u32)>,
    /// Loop motion, signal lane of its acceleration.
    pub loop_motions: Vec<(u32, u32)>,
    /// Loop motion, first signal lane of its HingeState.
    pub loop_states: Vec<(u32, u32)>,
    /// First signal lane of what constraints and contact report; see [`MechanismPlan::outputs`].
    pub reports: u32,
}

/// The constant part.
pub struct MechanismPlan {
    /// Path as a part.
    pub path: String,
    /// Structure.
    pub multibody: Arc<Multibody>,
    /// Kernels' constants.
    pub tree: Arc<Tree>,
    /// Gravity field.
    pub gravity: Option<Arc<dyn Gravity>>,
    /// The field, when it is the same everywhere.
    pub uniform: Option<Vec3>,
    /// Coordinates at the start.
    pub q: Vec<f64>,
    /// Velocities at the start.
    pub v: Vec<f64>,
    /// Prescribed subhinges of loops at the start.
    pub loop_motions: Vec<LoopMotion>,
    /// Solver of constrained motion, when there are constraints.
    pub solver: Option<ConstrainedSolver>,
    /// Contact, when the mechanism is stepped with it.
    pub contact: Option<ContactSpec>,
    /// Compliant contact.
    pub compliant: Option<(Arc<Colliders>, CompliantSettings)>,
    /// Treatment of each constraint.
    pub treatments: Vec<Treatment>,
    /// Lanes.
    pub wiring: MechanismWiring,
}

impl MechanismPlan {
    /// Lanes of x: q, v, then u and u̇ of each loop motion, then bristles.
    pub fn lanes(spec: &MechanismSpec) -> usize {
        let m = &spec.multibody;
        m.nq() + m.nv() + 2 * m.motions() + Self::bristles(spec.compliant.as_ref())
    }

    /// States of compliant contact.
    pub(crate) fn bristles(compliant: Option<&(Arc<Colliders>, CompliantSettings)>) -> usize {
        compliant.map_or(0, |c| CompliantContact::states(&c.0))
    }

    /// Name, unit and meaning of each report in the order of its signal lanes: for each constraint
    /// its error and the forces of its rows, then what contact says.
    pub fn outputs(multibody: &Multibody, contact: bool) -> Vec<(String, &'static str, String)> {
        let mut out = Vec::new();
        for c in multibody.constraints() {
            let name = multibody.constraint_name(c);
            let kind = if matches!(c, ConstraintId::Loop(_)) { "loop" } else { "coupling" };
            let doc = format!("Greatest error of {kind} `{name}` (rad or m).");
            out.push((format!("{name}.error"), "", doc));
            for i in 0..multibody.rows(c) {
                let doc = format!("Force of row {i} of {kind} `{name}` (N or N m).");
                out.push((format!("{name}.force[{i}]"), "", doc));
            }
        }
        if contact {
            for (name, unit, doc) in CONTACT_REPORTS {
                out.push((format!("contact.{name}"), unit, doc.to_owned()));
            }
        }
        out
    }

    /// The solver of a tree, when it has constraints.
    pub(crate) fn solver(tree: &Tree, treatments: &[Treatment]) -> Option<ConstrainedSolver> {
        let loops = tree.multibody().loops().len();
        let any = tree.multibody().constraints().next().is_some();
        any.then(|| ConstrainedSolver::new(tree, |c| treatments[place(c, loops)]))
    }

    fn stepper(&self) -> Option<ContactStepper> {
        let loops = self.multibody.loops().len();
        self.contact.as_ref().map(|c| {
            ContactStepper::new(&self.tree, c.colliders.clone(), c.settings.clone(), |id| {
                self.treatments[place(id, loops)]
            })
        })
    }

    fn compliant(&self) -> Option<CompliantContact> {
        let (colliders, settings) = self.compliant.as_ref()?;
        CompliantContact::new(colliders.clone(), *settings).ok()
    }

    /// Whether every free hinge has something to move, and every loop closes, at the start; puts
    /// the start onto the constraints. `origins` say where loops and couplings are written.
    ///
    /// # Errors
    /// What is wrong; its place is that of the constraint with the greatest error, where one is to blame.
    pub(crate) fn start(&mut self, origins: &BTreeMap<String, Origin>) -> Result<(), Fault> {
        if let Some((_, settings)) = &self.compliant
            && let Err(e) = settings.check()
        {
            return Err(fault(&e.to_string()));
        }
        let mut ws = Workspace::new(&self.tree);
        if let Some(solver) = &mut self.solver {
            let (tree, motions) = (&self.tree, &self.loop_motions[..]);
            let mut projector = Projector::new(tree);
            let done =
                projector.positions(tree, &mut ws, solver, motions, &mut self.q).and_then(|_| {
                    projector.rates(tree, &mut ws, solver, motions, &self.q, &mut self.v)
                });
            if let Err(e) = done {
                kinematics(tree, &mut ws, &self.q, &self.v);
                let error = |c| solver.error(tree, &ws, c, motions, &self.q);
                let worst = self.multibody.constraints().map(|c| (error(c), c));
                let worst = worst.max_by(|a, b| a.0.total_cmp(&b.0)).map(|w| w.1);
                let name = worst.map_or("", |c| self.multibody.constraint_name(c));
                let origin = origins.get(name).copied().unwrap_or(Origin::NONE);
                return Err(Fault { origin, ..fault(&e.to_string()) });
            }
        }
        kinematics(&self.tree, &mut ws, &self.q, &self.v);
        let (mut tau, mut vdot) = (vec![0.0; self.v.len()], vec![0.0; self.v.len()]);
        let done = match &mut self.solver {
            None => forward_dynamics_given_kinematics(&self.tree, &mut ws, &mut tau, &mut vdot),
            Some(solver) => {
                let state = (&self.q[..], &self.v[..]);
                let motions = &self.loop_motions;
                match solver.forward_given_kinematics(
                    &self.tree, &mut ws, state, motions, &mut tau, &mut vdot,
                ) {
                    Err(SolverError::Dynamics(e)) => Err(e),
                    Err(e) => return Err(fault(&e.to_string())),
                    Ok(_) => Ok(()),
                }
            }
        };
        match done {
            Ok(()) => Ok(()),
            Err(DynamicsError::Singular { body, .. }) => Err(Fault::new(
                Origin::NONE,
                format!("body `{body}`: its hinge has nothing to accelerate: no mass or inertia moves with it"),
            )
            .help("give it, or a body that it carries, a mass and an inertia, or its hinge an armature, or prescribe the hinge")),
            Err(e @ DynamicsError::Flexible { .. }) => {
                let text = e.to_string();
                let (fact, help) = text.split_once("\n  help: ").unwrap_or((&text, ""));
                Err(Fault::new(Origin::NONE, fact).help(help))
            }
        }
    }

    /// A block with its own workspace.
    pub fn block(self: &Arc<Self>) -> Box<dyn Block> {
        let (nq, nv) = (self.multibody.nq(), self.multibody.nv());
        Box::new(MechanismBlock {
            plan: self.clone(),
            ws: Workspace::new(&self.tree),
            solver: self.solver.clone(),
            projector: Projector::new(&self.tree),
            stepper: self.stepper(),
            compliant: self.compliant(),
            bristles: vec![0.0; Self::bristles(self.compliant.as_ref())],
            tau: vec![0.0; nv],
            vdot: vec![0.0; nv],
            given: vec![0.0; nv],
            motions: self.loop_motions.clone(),
            q: vec![0.0; nq],
            v: vec![0.0; nv],
            fault: None,
        })
    }
}

/// A message and its remedy.
fn fault(text: &str) -> Fault {
    let (fact, help) = text.split_once("\n  help: ").unwrap_or((text, ""));
    Fault::new(Origin::NONE, fact).help(help)
}

/// What contact reports: name, unit, meaning.
const CONTACT_REPORTS: [(&str, &str, &str); 6] = [
    ("points", "", "Contact points looked at in the last step."),
    ("impacts", "", "Impacts of the last step."),
    ("penetration", "m", "Deepest penetration at the start of the last step."),
    ("residual", "", "Residual of the impulses, relative to the greatest velocity."),
    ("complementarity", "", "Work that contact forces should not do, relative."),
    ("iterations", "", "Sweeps, linear systems or pivots of the last step."),
];

/// Place among all constraints.
fn place(c: ConstraintId, loops: usize) -> usize {
    match c {
        ConstraintId::Loop(i) => i as usize,
        ConstraintId::Coupling(i) => loops + i as usize,
    }
}

/// An impulse as bytes of a store.
#[derive(Serialize, Deserialize)]
struct Kept {
    pair: (u32, u32),
    feature: u64,
    impulse: [f64; 3],
}

struct MechanismBlock {
    plan: Arc<MechanismPlan>,
    ws: Workspace,
    solver: Option<ConstrainedSolver>,
    projector: Projector,
    stepper: Option<ContactStepper>,
    compliant: Option<CompliantContact>,
    /// Rates of the bristles at the last evaluation.
    bristles: Vec<f64>,
    tau: Vec<f64>,
    vdot: Vec<f64>,
    given: Vec<f64>,
    motions: Vec<LoopMotion>,
    q: Vec<f64>,
    v: Vec<f64>,
    fault: Option<String>,
}

#[inline(always)]
fn put3(sig: &mut [f64], at: usize, v: &Vec3) {
    sig[at..at + 3].copy_from_slice(&[v.x, v.y, v.z]);
}

impl MechanismBlock {
    fn split<'x>(&self, x: &'x [f64]) -> (&'x [f64], &'x [f64]) {
        let (nq, nv) = (self.plan.multibody.nq(), self.plan.multibody.nv());
        let at = self.plan.wiring.x;
        (&x[at..at + nq], &x[at + nq..at + nq + nv])
    }

    /// First lane of the bristles.
    fn bristle_lanes(&self) -> usize {
        self.motion_lanes() + 2 * self.motions.len()
    }

    /// First lane of u, u̇ of the loop motions.
    fn motion_lanes(&self) -> usize {
        self.plan.wiring.x + self.plan.multibody.nq() + self.plan.multibody.nv()
    }

    /// Loop motions at a state, with accelerations from the wires.
    fn read_motions(&mut self, x: &[f64], sig: Option<&[f64]>) {
        let at = self.motion_lanes();
        for (i, m) in self.motions.iter_mut().enumerate() {
            (m.position, m.rate) = (x[at + 2 * i], x[at + 2 * i + 1]);
        }
        if let Some(sig) = sig {
            for &(i, lane) in &self.plan.wiring.loop_motions {
                self.motions[i as usize].acceleration = sig[lane as usize];
            }
        }
    }

    fn forces(&mut self, t: f64, x: &[f64], sig: &[f64]) {
        let plan = self.plan.clone();
        let plan = &*plan;
        let ws = &mut self.ws;
        ws.clear_forces();
        match (&plan.gravity, plan.uniform) {
            (_, Some(g)) => ws.apply_uniform_gravity(g),
            (Some(field), None) => {
                ws.apply_gravity(&plan.tree, &mut |p| field.acceleration(t, *p));
            }
            (None, None) => {}
        }
        for (frame, lanes) in &plan.wiring.wrenches {
            let f: [f64; 6] = std::array::from_fn(|k| sig[lanes[k] as usize]);
            let wrench = Force::new(Vec3::new(f[0], f[1], f[2]), Vec3::new(f[3], f[4], f[5]));
            match frame {
                Frame::Node(n) => ws.add_wrench_at_node(&plan.tree, *n, wrench),
                Frame::Body(b) => ws.add_wrench_at_body(&plan.tree, *b, wrench),
            }
        }
        self.tau.fill(0.0);
        self.vdot.copy_from_slice(&self.given);
        for &(v, lane) in &plan.wiring.torques {
            self.tau[v as usize] = sig[lane as usize];
        }
        for &(v, lane) in &plan.wiring.motions {
            self.vdot[v as usize] = sig[lane as usize];
        }
        let at = self.bristle_lanes();
        if let Some(compliant) = &mut self.compliant {
            let state = &x[at..at + self.bristles.len()];
            compliant.apply(&plan.tree, &mut self.ws, state, &mut self.bristles);
        }
    }

    fn put_accelerations(&self, sig: &mut [f64]) {
        let plan = &*self.plan;
        for (frame, lane) in &plan.wiring.accels {
            let a = match frame {
                Frame::Node(n) => self.ws.node_acceleration(&plan.tree, *n),
                Frame::Body(b) => self.ws.body_acceleration(&plan.tree, *b),
            };
            put3(sig, *lane as usize, &a.angular);
            put3(sig, *lane as usize + 3, &a.linear);
        }
    }

    /// Positions and rates back onto the constraints.
    fn close(&mut self, x: &mut [f64]) {
        self.read_motions(x, None);
        let (plan, Some(solver)) = (self.plan.clone(), &mut self.solver) else { return };
        let (nq, nv) = (plan.multibody.nq(), plan.multibody.nv());
        let at = plan.wiring.x;
        let (q, rest) = x[at..].split_at_mut(nq);
        let (tree, motions) = (&plan.tree, &self.motions[..]);
        let done =
            self.projector.positions(tree, &mut self.ws, solver, motions, q).and_then(|_| {
                self.projector.rates(tree, &mut self.ws, solver, motions, q, &mut rest[..nv])
            });
        if let Err(e) = done {
            self.fault.get_or_insert_with(|| e.to_string());
            q.fill(f64::NAN);
        }
    }

    /// Errors and forces of the constraints.
    fn put_constraints(&mut self, q: &[f64], sig: &mut [f64]) {
        let (plan, Some(solver)) = (self.plan.clone(), &mut self.solver) else { return };
        let mut lane = plan.wiring.reports as usize;
        for c in plan.multibody.constraints() {
            sig[lane] = solver.error(&plan.tree, &self.ws, c, &self.motions, q);
            let forces = match &self.stepper {
                None => solver.forces(&plan.tree, c),
                Some(stepper) => stepper.forces(&plan.tree, c),
            };
            sig[lane + 1..lane + 1 + forces.len()].copy_from_slice(forces);
            lane += 1 + forces.len();
        }
    }
}

impl Block for MechanismBlock {
    fn moore(&mut self, _: &Now, x: &[f64], _: &[f64], sig: &mut [f64]) {
        let (q, v) = self.split(x);
        let plan = &*self.plan;
        kinematics(&plan.tree, &mut self.ws, q, v);
        for (frame, lane) in &plan.wiring.states {
            let (pose, velocity) = match frame {
                Frame::Node(n) => {
                    (self.ws.node_pose(&plan.tree, *n), self.ws.node_velocity(&plan.tree, *n))
                }
                Frame::Body(b) => {
                    (self.ws.body_pose(&plan.tree, *b), self.ws.body_velocity(&plan.tree, *b))
                }
            };
            NodeState {
                position: pose.position,
                rotation: pose.rotation,
                angular: velocity.angular,
                velocity: velocity.linear,
            }
            .put(&mut sig[*lane as usize..]);
        }
        for &(iq, iv, lane) in &plan.wiring.hinges {
            sig[lane as usize] = q[iq as usize];
            sig[lane as usize + 1] = v[iv as usize];
        }
        let at = self.motion_lanes();
        for &(i, lane) in &self.plan.wiring.loop_states {
            let (lane, from) = (lane as usize, at + 2 * i as usize);
            sig[lane..lane + 2].copy_from_slice(&x[from..from + 2]);
        }
    }

    fn direct(&mut self, now: &Now, x: &[f64], _: &[f64], sig: &mut [f64]) {
        self.forces(now.t, x, sig);
        self.read_motions(x, Some(sig));
        if self.stepper.is_some() {
            // Accelerations are those of the last step.
            return;
        }
        let plan = self.plan.clone();
        let (q, v) = self.split(x);
        let (tree, tau, vdot) = (&plan.tree, &mut self.tau, &mut self.vdot);
        let done = match &mut self.solver {
            None => forward_dynamics_given_kinematics(tree, &mut self.ws, tau, vdot)
                .map_err(|e| e.to_string()),
            Some(solver) => solver
                .forward_given_kinematics(tree, &mut self.ws, (q, v), &self.motions, tau, vdot)
                .map(|_| ())
                .map_err(|e| e.to_string()),
        };
        if let Err(why) = done {
            // Reported by the run with the first bad variable.
            self.fault.get_or_insert(why);
            self.vdot.fill(f64::NAN);
        }
        self.put_accelerations(sig);
        if now.evaluation == Evaluation::Tick {
            self.put_constraints(q, sig);
        }
    }

    fn deriv(&mut self, _: &Now, x: &[f64], _: &[f64], _: &[f64], xdot: &mut [f64]) {
        let (q, v) = self.split(x);
        let (at, nq) = (self.plan.wiring.x, q.len());
        let motions = self.motion_lanes();
        if self.stepper.is_some() {
            xdot[at..motions + 2 * self.motions.len()].fill(0.0);
            return;
        }
        self.plan.multibody.qdot(q, v, &mut xdot[at..at + nq]);
        xdot[at + nq..at + nq + v.len()].copy_from_slice(&self.vdot);
        for (i, m) in self.motions.iter().enumerate() {
            xdot[motions + 2 * i] = m.rate;
            xdot[motions + 2 * i + 1] = m.acceleration;
        }
        let bristles = self.bristle_lanes();
        xdot[bristles..bristles + self.bristles.len()].copy_from_slice(&self.bristles);
    }

    fn update(&mut self, _: &Now, _: &[f64], _: &mut [f64], _: &[f64]) {}

    fn normalize(&mut self, x: &mut [f64]) {
        let at = self.plan.wiring.x;
        self.plan.multibody.normalize(&mut x[at..at + self.plan.multibody.nq()]);
        if self.stepper.is_none() {
            self.close(x);
        }
    }

    fn advance_positions(&mut self, x: &mut [f64], h: f64) -> bool {
        if self.stepper.is_some() {
            return true;
        }
        let (q, v) = self.split(x);
        let plan = &*self.plan;
        self.v.iter_mut().zip(v).for_each(|(dv, v)| *dv = h * v);
        plan.multibody.integrate(q, &self.v, &mut self.q);
        let at = plan.wiring.x;
        x[at..at + self.q.len()].copy_from_slice(&self.q);
        self.close(x);
        true
    }

    fn advance(&mut self, x: &mut [f64], sig: &mut [f64], h: f64) {
        let plan = self.plan.clone();
        let Some(stepper) = &mut self.stepper else { return };
        let (nq, nv) = (plan.multibody.nq(), plan.multibody.nv());
        let at = plan.wiring.x;
        let (q, v) = x[at..at + nq + nv].split_at_mut(nq);
        let report = stepper.step(
            &plan.tree,
            &mut self.ws,
            h,
            (q, v),
            &self.motions,
            None,
            &mut self.tau,
            &mut self.vdot,
        );
        let report = match report {
            Ok(report) => report,
            Err(e) => {
                self.fault.get_or_insert_with(|| e.to_string());
                q.fill(f64::NAN);
                return;
            }
        };
        let reported = plan.multibody.constraints().map(|c| 1 + plan.multibody.rows(c));
        let lanes = plan.wiring.reports as usize + reported.sum::<usize>();
        sig[lanes..lanes + CONTACT_REPORTS.len()].copy_from_slice(&[
            report.contacts as f64,
            report.impacts as f64,
            report.penetration.max(0.0),
            report.measure.residual,
            report.measure.complementarity,
            f64::from(report.iterations),
        ]);
        self.put_accelerations(sig);
        let motions = self.motion_lanes();
        for (i, m) in self.motions.iter().enumerate() {
            x[motions + 2 * i + 1] += h * m.acceleration;
            x[motions + 2 * i] += h * x[motions + 2 * i + 1];
        }
        self.close(x);
        let (q, _) = self.split(x);
        self.put_constraints(q, sig);
    }

    fn fault(&self) -> Option<&str> {
        self.fault.as_deref()
    }

    fn position_lanes(&self) -> std::ops::Range<usize> {
        let at = self.plan.wiring.x;
        at..at + self.plan.multibody.nq()
    }

    fn save_store(&self) -> Result<Vec<u8>, String> {
        let Some(stepper) = &self.stepper else { return Ok(Vec::new()) };
        let keep =
            |i: &Impulse| Kept { pair: i.pair, feature: i.feature, impulse: i.impulse.into() };
        let kept: Vec<Kept> = stepper.warm().iter().map(keep).collect();
        rmp_serde::to_vec_named(&kept).map_err(|e| e.to_string())
    }
    fn load_store(&mut self, bytes: &[u8]) -> Result<(), String> {
        let Some(stepper) = &mut self.stepper else { return Ok(()) };
        let kept: Vec<Kept> = rmp_serde::from_slice(bytes).map_err(|e| e.to_string())?;
        let back =
            |k: &Kept| Impulse { pair: k.pair, feature: k.feature, impulse: k.impulse.into() };
        stepper.set_warm(&kept.iter().map(back).collect::<Vec<_>>());
        Ok(())
    }
    fn fork(&self) -> Box<dyn Block> {
        let mut copy = self.plan.block();
        if let Ok(bytes) = self.save_store()
            && self.stepper.is_some()
        {
            // The same plan takes its own store.
            let _ = copy.load_store(&bytes);
        }
        copy
    }
}
