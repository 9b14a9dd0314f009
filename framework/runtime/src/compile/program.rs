//! Compiles all phases of a program, and checks what they share: the world, watched conditions, states that continue.
use super::guards::{WatchedSpec, WhenSpec};
use super::table::common_tick;
use super::{Within, compile_phase, settings_of, warn_without_effect};
use crate::author::catalogue::{Catalogue, Entry};
use crate::author::files::Files;
use crate::author::services::ServiceKind;
use crate::author::time::Seconds;
use crate::author::value::{Fault, Faults, Origin, remedy};
use crate::author::variable::Variable;
use crate::plan::compiled::Plan;
use crate::plan::condition::Condition;
use crate::plan::program::{PhaseSpec, Program, TransitionSpec};
use std::collections::{BTreeMap, BTreeSet};

/// Compiles all phases.
///
/// # Errors
/// Returns all faults of all phases, each once; also transitions to unknown phases, unreachable phases, and contradictory transitions.
pub fn compile_program(
    phases: &[PhaseSpec],
    catalogue: &Catalogue,
    files: &Files,
) -> Result<Program, Faults> {
    let names: Vec<&str> = phases.iter().map(|p| p.name.as_str()).collect();
    let mut faults = check(phases, &names);
    faults.extend(another_world(phases, catalogue));
    let ticks: Vec<Seconds> = phases.iter().filter_map(|p| common_tick(&p.spec)).collect();
    let tick = match &ticks[..] {
        [first, rest @ ..] if !rest.is_empty() => rest.iter().try_fold(*first, |a, b| a.common(*b)),
        _ => None,
    };
    let mut compiled = Vec::new();
    for phase in phases {
        let place = |to: &str| names.iter().position(|n| *n == to).map(|k| k as u32);
        let whens = (phase.transitions.iter())
            .filter_map(|t| Some(WhenSpec { to: place(&t.to)?, when: &t.when, origin: t.origin }))
            .collect();
        let watches = phase.watches.iter().map(|w| WatchedSpec { when: &w.when }).collect();
        let within = Within { whens, watches, tick };
        match compile_phase(&phase.spec, &within, catalogue, files) {
            Ok(plan) => compiled.push((phase.name.clone(), plan)),
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
    faults.extend(carried(&compiled));
    if faults.is_empty() && compiled.len() == phases.len() {
        faults.extend(unreadable(phases, &compiled));
    }
    if !faults.is_empty() {
        faults.sort_by_key(|f| f.origin);
        return Err(Faults(faults));
    }
    let settings: Vec<_> =
        phases.iter().zip(&compiled).map(|(p, (_, plan))| settings_of(&p.spec, plan)).collect();
    if let Some((_, first)) = compiled.first_mut() {
        warn_without_effect(&settings, first);
    }
    Ok(Program::new(compiled))
}

/// Returns faults of phases whose world differs from the first phase, because time, positions and axes continue across phases.
fn another_world(phases: &[PhaseSpec], catalogue: &Catalogue) -> Vec<Fault> {
    let is_world = |model: &str| {
        let entry = catalogue.get(model);
        entry.and_then(Entry::service_kind).is_some_and(ServiceKind::is_first)
    };
    let world = |phase: &PhaseSpec| {
        let part = phase.spec.parts.iter().find(|p| is_world(&p.model))?;
        Some((format!("{}", part.params.value), part.origin))
    };
    let Some(first) = phases.first() else { return Vec::new() };
    let stated = world(first);
    let of_first =
        |w: &Option<(String, Origin)>| w.as_ref().map(|w| &w.0) == stated.as_ref().map(|w| &w.0);
    let others = phases.iter().filter(|phase| !of_first(&world(phase)));
    let wrong = others.map(|phase| {
        let fact = format!(
            "phase `{}` has another `world` than phase `{}`, but a world cannot change during a run",
            phase.name, first.name
        );
        let origin = world(phase).map_or(phase.origin, |w| w.1);
        Fault::new(origin, fact).help("write `world` once, outside the phases")
    });
    wrong.collect()
}

/// Returns faults of watched conditions that cannot be parsed with the variables of all phases, or that are constant.
fn unreadable(phases: &[PhaseSpec], compiled: &[(String, Plan)]) -> Vec<Fault> {
    let mut variables: BTreeMap<String, Variable> = BTreeMap::new();
    for (path, v) in compiled.iter().flat_map(|(_, plan)| plan.lanes.iter()) {
        variables.entry(path.clone()).or_insert_with(|| v.clone());
    }
    let mut faults = Vec::new();
    for watch in phases.first().iter().flat_map(|p| &p.watches) {
        let read = Condition::parse(&watch.when, &variables);
        let said = match read {
            Err(e) => Some((e.message, e.help)),
            Ok(when) if !when.timed() && when.places().next().is_none() => Some((
                format!("condition `{}`: its value never changes", watch.when),
                "test a state, an output that varies, or `time`".to_string(),
            )),
            Ok(_) => None,
        };
        if let Some((fact, help)) = said {
            let fact = format!("{}: {fact}", watch.of);
            faults.push(Fault::new(watch.origin, fact).help(help));
        }
    }
    faults
}

/// Returns faults of parts that exist in several phases but whose store cannot be carried over.
fn carried(phases: &[(String, Plan)]) -> Vec<Fault> {
    let mut faults: BTreeMap<&str, Fault> = BTreeMap::new();
    let mut seen: BTreeMap<&str, &str> = BTreeMap::new();
    for (phase, plan) in phases {
        for part in &plan.parts {
            let Err(why) = part.prototype.can_save() else { continue };
            if let Some(other) = seen.insert(&part.path, phase) {
                let fact = format!(
                    "the state of `{}` cannot be transferred from phase `{other}` to `{phase}`: {why}",
                    part.path
                );
                let help = "keep it in one phase only, or use a unit that can save its state";
                faults.insert(&part.path, Fault::new(Origin::NONE, fact).help(help));
            }
        }
    }
    faults.into_values().collect()
}

/// Checks the graph of phases.
fn check(phases: &[PhaseSpec], names: &[&str]) -> Vec<Fault> {
    let mut faults = Vec::new();
    for phase in phases {
        let mut seen: Vec<&TransitionSpec> = Vec::new();
        for t in &phase.transitions {
            if !names.contains(&t.to.as_str()) {
                let fact = format!("phase `{}`: there is no phase `{}` to go to", phase.name, t.to);
                faults.push(Fault::new(t.origin, fact).help(remedy(&t.to, "phases", names)));
            } else if t.to == phase.name {
                let fact = format!("phase `{}`: a transition to itself has no effect", phase.name);
                let help = "name another phase, or use a model with a guard for this event";
                faults.push(Fault::new(t.origin, fact).help(help));
            }
            if let Some(other) = seen.iter().find(|o| o.when == t.when && o.to != t.to) {
                let fact = format!(
                    "phase `{}`: the condition `{}` leads to `{}` and to `{}`",
                    phase.name, t.when, other.to, t.to
                );
                faults.push(
                    Fault::new(t.origin, fact)
                        .help("remove one, or give them different conditions"),
                );
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
