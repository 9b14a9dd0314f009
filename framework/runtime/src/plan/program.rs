//! A program: phases, each with its own plan, and the conditions of transitions between them. All phases are compiled before the first step, so that
//! errors in later phases are found when the program is loaded.
use crate::author::noise;
use crate::author::ports::PortKind;
use crate::author::value::Origin;
use crate::author::variable::{Place, Role, Variable};
use crate::plan::compiled::{Fires, Identity, Plan};
use crate::plan::route::Route;
use crate::plan::spec::Spec;
use std::collections::BTreeMap;
use std::sync::Arc;

/// One phase of a specification.
#[derive(Clone)]
pub struct PhaseSpec {
    /// Name.
    pub name: String,
    /// Specification of the whole simulation in this phase.
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
    /// Condition over variables of the phase that ends.
    pub when: String,
    /// Position in the source file.
    pub origin: Origin,
}

/// A compiled program. A run begins in the first phase.
pub struct Program {
    /// Phases.
    pub phases: Vec<Phase>,
    /// Positions of the channels ([`Place::Channel`]), by phase.
    pub channels: Vec<Vec<Option<Place>>>,
    /// Mappings of the state, by the two phases of a transition.
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
