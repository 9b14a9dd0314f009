//! A program: phases, each a plan of its own, and the conditions on which a run goes from one to another.
//! All are compiled before the first step, so that a mistake in the last is found at load.
use crate::catalogue::Catalogue;
use crate::compile::{WhenSpec, compile_phase};
use crate::noise;
use crate::plan::Plan;
use crate::services::Files;
use crate::spec::Spec;
use crate::value::{Fault, Faults, Origin, remedy};
use std::collections::BTreeSet;
use std::sync::Arc;

/// One phase of a specification.
#[derive(Clone)]
pub struct PhaseSpec {
    /// Name.
    pub name: String,
    /// The whole simulation as it is in this phase.
    pub spec: Spec,
    /// Where to go from here, and when; of several that hold at one instant the first is taken.
    pub transitions: Vec<TransitionSpec>,
    /// Where it is written.
    pub origin: Origin,
}

/// A transition of a specification.
#[derive(Clone, Debug)]
pub struct TransitionSpec {
    /// Name of the phase.
    pub to: String,
    /// Condition over variables of the phase that is left.
    pub when: String,
    /// Where it is written.
    pub origin: Origin,
}

/// A compiled program. The first phase is where a run begins.
pub struct Program {
    /// Phases.
    pub phases: Vec<Phase>,
    /// Hash over all plans.
    pub hash: u64,
}

/// One phase.
pub struct Phase {
    /// Name.
    pub name: String,
    /// Its plan.
    pub plan: Arc<Plan>,
}

impl Program {
    /// A program that never changes.
    pub fn single(plan: Arc<Plan>) -> Program {
        let hash = plan.hash;
        Program { phases: vec![Phase { name: String::new(), plan }], hash }
    }

    /// A program of these phases.
    pub fn new(phases: Vec<Phase>) -> Program {
        let text: Vec<String> =
            phases.iter().map(|p| format!("{} {}\n", p.name, p.plan.hash)).collect();
        Program { hash: noise::hash(text.concat().bytes()), phases }
    }
}

/// Compiles all phases.
///
/// # Errors
/// Every fault of every phase, each once; transitions to phases that do not exist, phases that no
/// transition reaches, transitions that contradict each other.
pub fn compile_program(
    phases: &[PhaseSpec],
    catalogue: &Catalogue,
    files: &Files,
) -> Result<Program, Faults> {
    let names: Vec<&str> = phases.iter().map(|p| p.name.as_str()).collect();
    let mut faults = check(phases, &names);
    let mut compiled = Vec::new();
    for phase in phases {
        let place = |to: &str| names.iter().position(|n| *n == to).map(|k| k as u32);
        let whens: Vec<WhenSpec<'_>> = (phase.transitions.iter())
            .filter_map(|t| Some(WhenSpec { to: place(&t.to)?, when: &t.when, origin: t.origin }))
            .collect();
        match compile_phase(&phase.spec, &whens, catalogue, files) {
            Ok(plan) => compiled.push(Phase { name: phase.name.clone(), plan: Arc::new(plan) }),
            Err(Faults(found)) => {
                for mut fault in found {
                    let known = |f: &Fault| f.origin == fault.origin && f.message == fault.message;
                    if !faults.iter().any(known) {
                        if phases.len() > 1 && fault.origin == Origin::NONE {
                            fault.message = format!("phase `{}`: {}", phase.name, fault.message);
                        }
                        faults.push(fault);
                    }
                }
            }
        }
    }
    if !faults.is_empty() {
        faults.sort_by_key(|f| f.origin);
        return Err(Faults(faults));
    }
    Ok(Program::new(compiled))
}

/// The graph of phases.
fn check(phases: &[PhaseSpec], names: &[&str]) -> Vec<Fault> {
    let mut faults = Vec::new();
    for phase in phases {
        let mut seen: Vec<&TransitionSpec> = Vec::new();
        for t in &phase.transitions {
            if !names.contains(&t.to.as_str()) {
                let fact = format!("phase `{}`: there is no phase `{}` to go to", phase.name, t.to);
                faults.push(Fault::new(t.origin, fact).help(remedy(&t.to, "phases", names)));
            } else if t.to == phase.name {
                let fact = format!("phase `{}`: a transition to itself changes nothing", phase.name);
                let help = "name another phase, or use a model with a guard for what happens there";
                faults.push(Fault::new(t.origin, fact).help(help));
            }
            if let Some(other) = seen.iter().find(|o| o.when == t.when && o.to != t.to) {
                let fact = format!(
                    "phase `{}`: `{}` leads to `{}` and to `{}`",
                    phase.name, t.when, other.to, t.to
                );
                faults.push(Fault::new(t.origin, fact).help("remove one, or tell them apart"));
            }
            seen.push(t);
        }
    }
    let mut reached: BTreeSet<&str> = names.iter().take(1).copied().collect();
    loop {
        let next = phases.iter().filter(|p| reached.contains(p.name.as_str()));
        let next: Vec<&str> =
            next.flat_map(|p| p.transitions.iter().map(|t| t.to.as_str())).collect();
        let before = reached.len();
        reached.extend(next);
        if reached.len() == before {
            break;
        }
    }
    for phase in phases.iter().filter(|p| !reached.contains(p.name.as_str())) {
        let fact = format!("phase `{}` is never reached from `{}`", phase.name, names[0]);
        let help = "add a transition to it, or remove it";
        faults.push(Fault::new(phase.origin, fact).help(help));
    }
    faults
}
