//! Loads of hinges that the file or a part requests, and their names.
//!
//! ```text
//! reaction_force, reaction_moment   on the body through its hinge, about the origin and in the axes of the hinge's frame on the body
//! effort                            generalised force at each coordinate: what drives it, or what a prescribed motion takes
//! ```
//! They follow from the accelerations at the same instant and all forces on the bodies outboard of the hinge, including forces of loops and contacts.
//! In a simulation with contact they are means over the last step, and zero before the first step.
use crate::block::MechanismBlock;
use crate::ports::MechanismPorts;
use crate::reaction::{LANES, Reaction};
use crate::spec::MechanismSpec;
use linkwork_multibody::BodyId;
use linkwork_runtime::{BindTarget, Bound, Fault, Lowering, PortKind};

impl MechanismSpec {
    /// Hinges whose load the file or a part requests, in the order of their bodies.
    pub(crate) fn loads(&self, ports: &MechanismPorts) -> Vec<Reaction> {
        let written = self.reactions.iter().filter_map(|name| self.multibody.body(name));
        let mut all: Vec<BodyId> = written.chain(ports.loads.iter().copied()).collect();
        all.sort_unstable();
        all.dedup();
        let of = |body: BodyId| {
            let b = self.multibody.get(body);
            let held = self.held.iter().any(|name| name == b.name());
            let effort = if held { b.v().start..b.v().start } else { b.v() };
            Reaction { body, effort }
        };
        all.into_iter().map(of).collect()
    }

    /// Reports loads that cannot be computed, and bindings to coordinates of locked hinges.
    pub(crate) fn check_loads(&self, bound: &[Bound<'_>], out: &mut Lowering<'_>) {
        if self.kinematic.is_some() && !self.reactions.is_empty() {
            let fact = format!(
                "`reaction` of {}: hinges have no loads, because the machine has `motion: \"kinematics\"`",
                self.reactions.join(", ")
            );
            let help = "remove `reaction`, or use a `motion` with forces in `place`";
            out.faults.push(Fault::new(self.origin, fact).help(help));
        }
        for b in bound {
            let (part, bind) = (&b.spec.part, &b.spec.bind);
            if let BindTarget::Hinge { body, .. } = &b.spec.target
                && self.held.contains(body)
            {
                let fact = format!(
                    "`{part}`: binding `{bind}`: the hinge of `{body}` is locked and has no coordinates"
                );
                out.faults
                    .push(Fault::new(b.spec.origin, fact).help("bind to a pin, slider or screw"));
            }
            if !b.ports.iter().any(|(p, _)| p.kind == PortKind::HingeLoad) {
                continue;
            }
            let body = crate::ports::body_of(&self.multibody, &b.spec.target);
            let Some(body) = body.map(|b| self.multibody.get(b)) else { continue };
            if body.v().is_empty() {
                let name = body.name();
                let fact = format!("`{part}`: binding `{bind}`: the hinge of `{name}` is locked");
                let help = format!("write `reaction: true` in the body `{name}`");
                out.faults.push(Fault::new(b.spec.origin, fact).help(help));
            }
            if self.kinematic.is_some() {
                let fact = format!(
                    "`{part}`: binding `{bind}`: hinges have no loads, because the machine has `motion: \"kinematics\"`"
                );
                let help = "use a `motion` with forces in `place`";
                out.faults.push(Fault::new(b.spec.origin, fact).help(help));
            }
        }
    }
}

impl MechanismBlock {
    /// Writes the loads of hinges, after a solution whose accelerations are in `vdot`; `step`: of a step with contact its length.
    pub(crate) fn put_loads(&mut self, step: Option<f64>, sig: &mut [f64]) {
        let [.., first, accels] = self.output_lanes();
        let Some(loads) = &mut self.loads else { return };
        let plan = &*self.plan;
        loads.begin(&self.ws);
        match (&self.stepper, &mut self.solver, step) {
            (Some(stepper), _, Some(h)) => {
                stepper.add_forces(&self.tree, &mut self.ws, h, &self.motions);
            }
            (_, Some(solver), _) => {
                solver.add_loop_forces(&self.tree, &mut self.ws, &self.motions);
            }
            _ => {}
        }
        loads.find(&self.tree, &mut self.ws, &self.vdot);
        let mut lane = first + crate::touch::LANES * plan.pairs.len();
        let to = accels + 6 * plan.ports.accels.len() + LANES * plan.ports.contacts.len();
        for r in &plan.loads {
            let load = loads.load(&self.tree, &self.ws, r.body);
            for k in 0..3 {
                (sig[lane + k], sig[lane + 3 + k]) = (load.force[k], load.moment[k]);
            }
            if let Some(i) = plan.ports.loads.iter().position(|b| *b == r.body) {
                sig.copy_within(lane..lane + LANES, to + LANES * i);
            }
            let efforts = &loads.efforts()[r.effort.clone()];
            sig[lane + LANES..lane + LANES + efforts.len()].copy_from_slice(efforts);
            lane += LANES + efforts.len();
        }
    }
}
