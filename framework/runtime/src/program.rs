//! A program: phases, each with its own plan, and the conditions of transitions between them. All phases are compiled before the first step, so that
//! errors in later phases are found when the program is loaded.
use crate::catalogue::Catalogue;
use crate::compile::{
    WatchedSpec, WhenSpec, Within, common_tick, compile_phase, warn_without_effect,
};
use crate::condition::Condition;
use crate::files::Files;
use crate::noise;
use crate::plan::{Fires, Identity, Plan};
use crate::ports::PortKind;
use crate::route::Route;
use crate::services::ServiceKind;
use crate::spec::Spec;
use crate::time::Seconds;
use crate::value::{Fault, Faults, Origin, remedy};
use crate::variable::{Place, Role, Variable};
use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

/// One phase of a specification.
#[derive(Clone)]
pub struct PhaseSpec {
    /// Name.
    pub name: String,
    /// The whole simulation as it is in this phase.
    pub spec: Spec,
    /// Transitions from this phase. If the conditions of several become true at one instant, the first one is taken.
    pub transitions: Vec<TransitionSpec>,
    /// Conditions that the run monitors in every phase. All phases of a program have the same list.
    pub watches: Vec<WatchSpec>,
    /// Position in the source file.
    pub origin: Origin,
}

/// A watched condition: the instant at which it becomes true is located, and [`crate::Simulation::step_watched`] stops there. In a phase that lacks
/// some of its variables, tests of the absent variables are false.
#[derive(Clone, Debug)]
pub struct WatchSpec {
    /// Purpose of the condition, which prefixes its errors: `stop_when`.
    pub of: String,
    /// Condition over the variables of all phases.
    pub when: String,
    /// Position in the source file.
    pub origin: Origin,
}

/// A transition of a specification.
#[derive(Clone, Debug)]
pub struct TransitionSpec {
    /// Name of the phase.
    pub to: String,
    /// Condition over variables of the phase that is left.
    pub when: String,
    /// Position in the source file.
    pub origin: Origin,
}

/// A compiled program. A run begins in the first phase.
pub struct Program {
    /// Phases.
    pub phases: Vec<Phase>,
    /// For each phase, the place of each channel ([`Place::Channel`]).
    pub channels: Vec<Vec<Option<Place>>>,
    /// For each pair of phases of a transition: mapping of the state.
    pub(crate) routes: BTreeMap<(u32, u32), Route>,
}

/// One phase.
pub struct Phase {
    /// Name.
    pub name: String,
    /// Its plan.
    pub plan: Arc<Plan>,
}

/// Prefix of the start times of phases: `Phases.<phase>` is the latest start time of the phase (s).
const PHASES: &str = "Phases";

impl Program {
    /// Returns the hash of all plans.
    pub fn hash(&self) -> u64 {
        self.phases[0].plan.hash()
    }

    /// Creates a program with a single phase.
    pub fn single(plan: Arc<Plan>) -> Program {
        Program {
            phases: vec![Phase { name: String::new(), plan }],
            channels: vec![Vec::new()],
            routes: BTreeMap::new(),
        }
    }

    /// Creates a program of named phases. Their plans receive the variables of all phases and one common hash.
    pub fn new(mut phases: Vec<(String, Plan)>) -> Program {
        if phases.len() == 1
            && let Some((name, plan)) = phases.pop()
        {
            let mut program = Program::single(Arc::new(plan));
            program.phases[0].name = name;
            return program;
        }
        let text: Vec<String> =
            phases.iter().map(|(name, plan)| format!("{name} {}\n", plan.hash())).collect();
        let hash = noise::hash(text.concat().bytes());
        let (variables, channels) = channels(&phases);
        let variables = Arc::new(variables);
        let join = |(name, mut plan): (String, Plan)| {
            plan.variables = variables.clone();
            plan.identity = Identity::shared(hash);
            Phase { name, plan: Arc::new(plan) }
        };
        let phases: Vec<Phase> = phases.into_iter().map(join).collect();
        let mut routes = BTreeMap::new();
        for (k, phase) in phases.iter().enumerate() {
            for guard in &phase.plan.guards {
                if let Fires::Transition { to } = guard.fires {
                    let route = || Route::new(&phase.plan, &phases[to as usize].plan);
                    routes.entry((k as u32, to)).or_insert_with(route);
                }
            }
        }
        Program { phases, channels, routes }
    }
}

/// Returns the variables of all phases, and the place of each variable in each phase. Channels are numbered in the order of places of the first phase
/// that has them.
fn channels(phases: &[(String, Plan)]) -> (BTreeMap<String, Variable>, Vec<Vec<Option<Place>>>) {
    let mut variables: BTreeMap<String, Variable> = BTreeMap::new();
    for (_, plan) in phases {
        let mut lanes: Vec<(&String, &Variable)> = plan.lanes.iter().collect();
        lanes.sort_by_key(|(_, v)| match v.place {
            Place::Signal(k) => (0, k),
            Place::X(k) => (1, k),
            Place::D(k) => (2, k),
            Place::Channel(k) | Place::Phase(k) => (3, k),
        });
        for (path, v) in lanes {
            if !variables.contains_key(path) {
                let place = Place::Channel(variables.len() as u32);
                variables.insert(path.clone(), Variable { place, ..v.clone() });
            }
        }
    }
    let mut times = Vec::new();
    for (phase, (name, _)) in (0..).zip(phases) {
        let path = format!("{PHASES}.{name}");
        if variables.contains_key(&path) {
            continue;
        }
        times.push((variables.len(), phase));
        let place = Place::Channel(variables.len() as u32);
        let doc = "Latest start time of this phase; NaN before it has begun.";
        let began = Variable {
            place,
            role: Role::Output,
            unit: "s".into(),
            doc: doc.into(),
            kind: PortKind::Numbers,
            part: PHASES.into(),
        };
        variables.insert(path, began);
    }
    let mut table = vec![vec![None; variables.len()]; phases.len()];
    for row in &mut table {
        for &(channel, phase) in &times {
            row[channel] = Some(Place::Phase(phase));
        }
    }
    for (row, (_, plan)) in table.iter_mut().zip(phases) {
        for (path, v) in &*plan.lanes {
            if let Some(Place::Channel(k)) = variables.get(path).map(|v| v.place) {
                row[k as usize] = Some(v.place);
            }
        }
    }
    (variables, table)
}

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
    if let Some((_, first)) = compiled.first_mut() {
        warn_without_effect(&phases.iter().map(|p| &p.spec).collect::<Vec<_>>(), first);
    }
    Ok(Program::new(compiled))
}

/// Returns faults of phases whose world differs from the first phase, because time, positions and axes continue across phases.
fn another_world(phases: &[PhaseSpec], catalogue: &Catalogue) -> Vec<Fault> {
    let is_world = |model: &str| {
        let entry = catalogue.get(model);
        entry.is_some_and(|e| e.service_kind() == Some(ServiceKind::World))
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
            "phase `{}` has another `world` than phase `{}`, and a world cannot change during a run",
            phase.name, first.name
        );
        let origin = world(phase).map_or(phase.origin, |w| w.1);
        Fault::new(origin, fact).help("state `world` once, outside the phases")
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
                let fact =
                    format!("`{}` cannot go from phase `{other}` to `{phase}`: {why}", part.path);
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
                let fact =
                    format!("phase `{}`: a transition to itself changes nothing", phase.name);
                let help = "name another phase, or use a model with a guard for what happens there";
                faults.push(Fault::new(t.origin, fact).help(help));
            }
            if let Some(other) = seen.iter().find(|o| o.when == t.when && o.to != t.to) {
                let fact = format!(
                    "phase `{}`: `{}` leads to `{}` and to `{}`",
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
