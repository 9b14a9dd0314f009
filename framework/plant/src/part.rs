//! The mechanism as a part for the scheduler: ports, start, names, and the plan that its blocks share.
use crate::block::MechanismBlock;
use crate::gaps::Gaps;
use crate::joints::{self};
use crate::masses::Varying;
use crate::names;
use crate::plan::MechanismPlan;
use crate::ports::MechanismPorts;
use crate::spec::MechanismSpec;
use crate::spec::RollingOn;
use crate::touch;
use linkwork_collision::{Colliders, TERRAIN};
use linkwork_dynamics::{
    DynamicsError, Tree, Workspace, forward_dynamics_given_kinematics, kinematics,
};
use linkwork_multibody::{ConstraintId, Multibody};
use linkwork_runtime::balance::OwnAccounts;
use linkwork_runtime::host::{OldState, Turning};
use linkwork_runtime::{
    Block, Carried, Description, Failure, Fault, Functions, Named, Origin, PortKind, PortSpec,
    Prototype, Value, Wiring,
};
use linkwork_solvers::{
    CompliantContact, ConstrainedSolver, ConstraintMethod, ContactStepper, SolverError, close_start,
};
use linkwork_surroundings::Gravity;
use std::any::Any;
use std::borrow::Cow;
use std::sync::{Arc, OnceLock};

/// The mechanism as a part for the scheduler.
pub struct MechanismPart {
    /// The constant part.
    pub plan: Arc<MechanismPlan>,
    description: Description,
    params: Value,
}

impl MechanismPart {
    pub(crate) fn new(
        spec: &MechanismSpec,
        (gravity, rolling): (Option<Arc<dyn Gravity>>, Option<RollingOn>),
        ports: MechanismPorts,
        warnings: &mut Vec<Fault>,
    ) -> Self {
        let m = &spec.multibody;
        let tree = Arc::new(Tree::new(m));
        let constraint_methods: Vec<ConstraintMethod> = (m.constraints())
            .map(|c| spec.constraint_methods.get(m.constraint_name(c)))
            .map(|t| t.copied().unwrap_or(ConstraintMethod::Auto))
            .collect();
        let mut contact = spec.contact.clone();
        if let Some(contact) = &mut contact {
            joints::dry(m, &mut contact.settings.dry);
        }
        let plan = MechanismPlan {
            joints: joints::lower(spec, &tree, warnings),
            path: spec.path.clone(),
            multibody: m.clone(),
            uniform: gravity.as_ref().and_then(|g| g.uniform()),
            omega: gravity.as_ref().and_then(|g| g.site()).map(|s| s.omega()),
            gravity,
            q: spec.q.clone(),
            v: spec.v.clone(),
            kept: spec.kept.clone(),
            loop_motions: spec.motions.clone(),
            gaps: Gaps::all(m, &spec.closings),
            solver: MechanismPlan::solver(&tree, &constraint_methods),
            contact,
            compliant: spec.compliant.clone(),
            bristles: spec
                .compliant
                .as_ref()
                .map_or((0, 0), |(colliders, laws)| CompliantContact::states(colliders, laws)),
            touched: spec.touched(),
            belts: touch::belts(&ports.surfaces, spec.colliders()),
            pairs: spec.pairs(),
            loads: spec.loads(&ports),
            vehicles: crate::vehicles::members(&spec.multibody, &ports.vehicles),
            held: spec.held.clone(),
            rolling,
            constraint_methods,
            tree,
            varies: Varying::all(m, &ports),
            prescribed: m.prescribed(),
            ports,
            masses: Vec::new(),
            print: OnceLock::new(),
            x: 0,
            origin: spec.origin,
            origins: spec.origins.clone(),
            bodies: spec.bodies.clone(),
        };
        let description = plan.describe();
        MechanismPart { plan: Arc::new(plan), description, params: Value::Map(Vec::new()) }
    }
}

impl Prototype for MechanismPart {
    fn description(&self) -> &Description {
        &self.description
    }
    fn params(&self) -> &Value {
        &self.params
    }
    fn initial(&self, x: &mut [f64], _: &mut [f64]) {
        let m = &*self.plan;
        let (nq, nv) = (m.q.len(), m.v.len());
        x[..nq].copy_from_slice(&m.q);
        x[nq..nq + nv].copy_from_slice(&m.v);
        for (lanes, motion) in x[nq + nv..].chunks_exact_mut(2).zip(&m.loop_motions) {
            lanes.copy_from_slice(&[motion.position, motion.rate]);
        }
    }
    fn stored(&self) -> bool {
        self.plan.contact.is_some()
    }
    fn accounts(&self) -> OwnAccounts {
        crate::accounts::of(&self.plan)
    }
    fn block(&self, wiring: Wiring) -> Box<dyn Block> {
        Box::new(MechanismBlock::new(self.plan.clone(), wiring))
    }
    fn rearranges(&self) -> bool {
        self.plan.bristle_pairs() > 0
    }
    fn held_together(&self) -> Vec<bool> {
        let (q, v) = self.plan.multibody.held_together();
        [q, v].concat()
    }
    fn names(&self, wiring: &Wiring) -> Option<Vec<Named>> {
        Some(names::names(&self.plan, wiring))
    }
    fn driven_rates(&self) -> Vec<usize> {
        let first = self.plan.x + self.plan.multibody.nq();
        let ports = &self.plan.ports;
        let balls = ports.ball_torques.iter().flat_map(|v| *v..*v + 3);
        ports.torques.iter().copied().chain(balls).map(|v| first + v as usize).collect()
    }
    fn settle(&mut self, wiring: &Wiring) -> Result<(), Fault> {
        let Some(plan) = Arc::get_mut(&mut self.plan) else { return Ok(()) };
        plan.x = wiring.x;
        plan.masses.extend(&wiring.ud[..10 * plan.ports.masses.len()]);
        plan.start().map_err(|f| Fault {
            origin: if f.origin == Origin::NONE { plan.origin } else { f.origin },
            ..f
        })
    }
    fn fingerprint(&self) -> String {
        self.plan.fingerprint().to_owned()
    }
    fn carry(
        &self,
        old: &dyn Prototype,
        from: OldState<'_>,
        to: (&mut [f64], &mut [f64]),
    ) -> Result<Carried, Box<Failure>> {
        let any: &dyn Any = old;
        match any.downcast_ref::<MechanismPart>() {
            Some(old) => crate::carry::carry(&self.plan, &old.plan, from, to),
            None => Ok(Carried::New),
        }
    }
}

impl MechanismPlan {
    /// Returns the number of lanes of the bristles of compliant contact.
    pub(crate) fn bristles(&self) -> usize {
        self.bristles.0
    }

    /// Returns the number of discrete lanes: the pair of each bristle, if pairs share bristles.
    pub(crate) fn bristle_pairs(&self) -> usize {
        self.bristles.1
    }

    /// Returns the number of lanes of x: q, v, then u and u̇ of each loop motion, then bristles.
    fn lanes(&self) -> usize {
        let m = &self.multibody;
        m.nq() + m.nv() + 2 * m.motions() + self.bristles()
    }

    /// Returns the lanes of the bodies on free hinges.
    fn turning(&self) -> Vec<Turning> {
        let m = &self.multibody;
        let lanes = m.turning().map(|(body, v)| {
            let attitude = m.get(body).subhinges()[0].q.start + 3;
            Turning { attitude, velocity: m.nq() + v }
        });
        lanes.collect()
    }

    fn describe(&self) -> Description {
        let steps = self.contact.is_some() || self.rolling.is_some();
        let mut d = Description {
            name: "mechanism".into(),
            doc: "Bodies on hinges, with loops, couplings and contact.".into(),
            functions: Functions {
                feedthrough: !steps,
                derivatives: !steps,
                derivatives_read_outputs: !steps,
                feedthrough_after_outputs: !steps,
                steps,
                ..Functions::default()
            },
            positions: if steps { 0..0 } else { 0..self.multibody.nq() },
            turning: if steps { Vec::new() } else { self.turning() },
            ..Description::default()
        };
        let numbers = |name: &'static str, n| PortSpec::named(name, PortKind::Numbers, n);
        d.continuous.push(numbers("coordinates", self.lanes()));
        if self.bristle_pairs() > 0 {
            d.discrete.push(numbers("bristle_pair", self.bristle_pairs()));
        }
        d.feedthrough_outputs.push(numbers("acceleration", self.multibody.nv()));
        d.feedthrough_outputs.push(numbers("bristle_rate", self.bristles()));
        d.feedthrough_outputs.push(numbers("report", self.reports().len()));
        self.ports.describe(&mut d);
        d.functions.outputs = !d.outputs.is_empty();
        d
    }

    /// Reports of contact or rolling for the whole mechanism.
    pub(crate) fn contact_reports(&self) -> &'static [(&'static str, &'static str, &'static str)] {
        match (&self.contact, &self.compliant) {
            _ if self.rolling.is_some() => &ROLLING_REPORTS,
            (Some(_), _) => &CONTACT_REPORTS,
            (None, Some(_)) => &CONTACT_REPORTS[..COMPLIANT_REPORTS],
            (None, None) => &[],
        }
    }

    /// Path, unit and description of each report in the order of its signal lanes: for each constraint
    /// its error and the forces of its rows, then the reports of contact, and its loads on each body.
    pub fn reports(&self) -> Vec<(String, &'static str, String)> {
        let mut out = Vec::new();
        let (multibody, path) = (&self.multibody, &self.path);
        for c in multibody.constraints() {
            let name = multibody.constraint_name(c);
            let kind = if matches!(c, ConstraintId::Loop(_)) { "loop" } else { "coupling" };
            let doc = format!("Greatest error of {kind} `{name}` (rad or m).");
            out.push((format!("{path}.{name}.error"), "", doc));
            for i in 0..multibody.rows(c) {
                let doc = format!("Force of row {i} of {kind} `{name}` (N or N m).");
                out.push((format!("{path}.{name}.force[{i}]"), "", doc));
            }
        }
        let group = if self.rolling.is_some() { "rolling" } else { "contact" };
        for (name, unit, doc) in self.contact_reports() {
            out.push((format!("{path}.{group}.{name}"), unit, (*doc).to_owned()));
        }
        out.extend(names::touch_names(self));
        out.extend(names::pair_names(self));
        out.extend(names::load_names(self));
        out
    }

    /// Returns the bodies with their present inertias, if these change; `sig`: the signals of its plan.
    pub(crate) fn present(&self, sig: &[f64]) -> Result<Cow<'_, Multibody>, Box<Failure>> {
        let mut bodies = Cow::Borrowed(&*self.multibody);
        for varying in &self.varies {
            let inertia = varying
                .inertia(&self.multibody, |lane| sig[self.masses[lane] as usize])
                .map_err(|(fact, help)| Box::new(Failure { message: fact, help: Some(help) }))?;
            bodies.to_mut().set_inertia(varying.body, inertia);
        }
        Ok(bodies)
    }

    /// Returns the solver of a tree, if it has constraints.
    pub(crate) fn solver(
        tree: &Tree,
        constraint_methods: &[ConstraintMethod],
    ) -> Option<ConstrainedSolver> {
        let loops = tree.multibody().loops().len();
        let any = tree.multibody().constraints().next().is_some();
        any.then(|| ConstrainedSolver::new(tree, |c| constraint_methods[place(c, loops)]))
    }

    /// Position of a loop or coupling in the file.
    pub(crate) fn origin_of(&self, name: &str) -> Origin {
        self.origins.get(name).copied().unwrap_or(Origin::NONE)
    }

    pub(crate) fn stepper(&self) -> Option<ContactStepper> {
        let loops = self.multibody.loops().len();
        self.contact.as_ref().map(|c| {
            ContactStepper::new(&self.tree, c.colliders.clone(), c.settings.clone(), |id| {
                self.constraint_methods[place(id, loops)]
            })
        })
    }

    pub(crate) fn compliant_contact(&self) -> Option<CompliantContact> {
        let (colliders, laws) = self.compliant.as_ref()?;
        CompliantContact::new(colliders.clone(), laws.clone()).ok()
    }

    /// Fingerprint of everything that determines the motion: structure and masses to the last bit, constraint methods, contact.
    pub(crate) fn fingerprint(&self) -> &str {
        self.print.get_or_init(|| self.describe_all())
    }

    fn describe_all(&self) -> String {
        let m = &self.multibody;
        let mut text = String::new();
        for id in m.body_ids() {
            text += &format!("{:?}\n", m.spec(id));
        }
        for node in m.nodes() {
            text += &format!("{} {} {:?}\n", node.name(), m.get(node.body()).name(), node.pose());
        }
        text += &format!("{:?}\n{:?}\n{:?}\n", m.loops(), m.couplings(), self.constraint_methods);
        text +=
            &format!("gravity {} {:?} {:?}\n", self.gravity.is_some(), self.uniform, self.omega);
        text += &format!("{:?}\n{:?}\n", self.joints, self.gaps);
        if let Some(contact) = &self.contact {
            text += &format!("{:?} {}", contact.settings, shapes(&contact.colliders));
        }
        if let Some((colliders, laws)) = &self.compliant {
            text += &format!("{laws:?} {}", shapes(colliders));
        }
        if let Some((rolling, _)) = &self.rolling {
            text += &format!("rolling {:?}", rolling.vehicles().collect::<Vec<_>>());
        }
        text
    }

    /// Checks that every free hinge moves some mass and that every loop closes at the start, and moves the start onto the constraints.
    ///
    /// # Errors
    /// The start is invalid; the error has the place of the constraint with the greatest error, or of the body that causes it.
    fn start(&mut self) -> Result<(), Fault> {
        if let Some((_, laws)) = &self.compliant
            && let Err(e) = laws.check()
        {
            return Err(Fault::of(Origin::NONE, &e));
        }
        let mut ws = Workspace::new(&self.tree);
        if let Some(solver) = &mut self.solver {
            for gaps in &self.gaps {
                let state = (&self.q[..], &self.v[..]);
                gaps.find(&self.tree, &mut ws, solver, state, &mut self.loop_motions);
            }
            let (tree, motions) = (&self.tree, &self.loop_motions[..]);
            let done = close_start(tree, motions, &self.kept, &mut self.q, &mut self.v);
            if let Err(e) = done {
                let contradiction = self.contradiction().filter(|_| e.nearest.is_none());
                return Err(contradiction.unwrap_or_else(|| self.cannot_start(&e)));
            }
            if let Some(fault) = self.contradiction() {
                return Err(fault);
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
                    Err(e) => return Err(Fault::of(Origin::NONE, &e)),
                    Ok(_) => Ok(()),
                }
            }
        };
        match done {
            Ok(()) => Ok(()),
            Err(DynamicsError::Singular { body, .. }) => Err(Fault::new(
                self.bodies.get(&body).copied().unwrap_or(Origin::NONE),
                format!("body `{body}`: its hinge moves no mass, or no inertia about one of its axes"),
            )
            .help("add mass and inertia to it or to a body that it carries, add an armature to its hinge, or prescribe the hinge")),
            Err(e @ DynamicsError::Flexible { .. }) => Err(Fault::of(Origin::NONE, &e)),
        }
    }
}

/// Text of the colliders and of the pairs that may touch. A terrain contributes its name only, because its heights belong to the service.
fn shapes(colliders: &Colliders) -> String {
    let mut text = format!("{:?}\n", colliders.rules());
    for id in colliders.ids() {
        let spec = colliders.spec(id);
        match spec.name.as_str() {
            TERRAIN => text += "terrain\n",
            _ => text += &format!("{spec:?}\n"),
        }
    }
    text
}

/// Number of these reports that compliant contact has.
const COMPLIANT_REPORTS: usize = 2;

/// Reports of contact: name, unit, description.
const CONTACT_REPORTS: [(&str, &str, &str); 7] = [
    (
        "points",
        "",
        "Number of contact points: with impulses, the candidates of the last step; with compliant contact, those with a force.",
    ),
    ("penetration", "m", "Deepest penetration; with impulses, at the start of the last step."),
    (
        "impacts",
        "",
        "Number of impacts with restitution in the last step: instants at which contacts closed.",
    ),
    (
        "residual",
        "",
        "Residual of the impulses, relative to the greatest velocity of its island; above `tolerance`, the solution did not converge.",
    ),
    (
        "complementarity",
        "",
        "Relative complementarity error: product of normal force and normal velocity, which is zero in an exact solution.",
    ),
    (
        "iterations",
        "",
        "Number of sweeps, linear systems or pivots of the last step, for the island with most of them.",
    ),
    (
        "islands",
        "",
        "Number of constraint islands of the last step: groups of bodies that contacts, loops and couplings do not connect with each other.",
    ),
];

/// Reports of rolling: name, unit, description.
const ROLLING_REPORTS: [(&str, &str, &str); 2] = [
    (
        "gap",
        "m",
        "Greatest distance of a wheel from the ground after the last step; it is not zero if more than three wheels are on one rigid body.",
    ),
    (
        "slide",
        "m/s",
        "Root mean square of the sliding speeds of the rims; it is not zero if the wheels do not follow the same circle, or slip under their loads.",
    ),
];

/// Place among all constraints.
fn place(c: ConstraintId, loops: usize) -> usize {
    match c {
        ConstraintId::Loop(i) => i as usize,
        ConstraintId::Coupling(i) => loops + i as usize,
    }
}
