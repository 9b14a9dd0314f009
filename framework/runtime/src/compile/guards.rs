//! Guards of parts in path order, followed by the conditions of transitions.
use super::connections::Connections;
use super::order::Order;
use super::part::Part;
use crate::author::ports::Direction;
use crate::author::value::{Fault, Origin};
use crate::author::variable::{Place, Variable};
use crate::plan::compiled::{Fires, GuardPlan, Guarded, Watched};
use crate::plan::condition::Condition;
use std::collections::BTreeMap;

/// A condition at which a phase ends.
pub(crate) struct WhenSpec<'a> {
    /// Index of the next phase.
    pub to: u32,
    /// The condition.
    pub when: &'a str,
    /// Position in the file.
    pub origin: Origin,
}

/// A condition that the run monitors in every phase.
pub(crate) struct WatchedSpec<'a> {
    /// The condition.
    pub when: &'a str,
}

/// Guards of parts, and conditions.
#[derive(Default)]
pub(super) struct Watch {
    pub guards: Vec<GuardPlan>,
    pub guarded: Vec<Guarded>,
    pub conditions: Vec<Watched>,
    /// Operations on which they depend.
    pub ops: Vec<u32>,
    /// True if one of them may reach zero between rows.
    pub located: bool,
    /// Returns for each part whether it has modes.
    pub moded: Vec<bool>,
}

/// Parts with modes whose outputs change at rows and events only: they have no corner within a step, and their pieces follow from
/// the levels.
pub(super) fn hold(parts: &mut [Part<'_>], c: &Connections, order: &Order) {
    for (k, part) in parts.iter_mut().enumerate() {
        let f = part.prototype.description().functions;
        let moves = part.wiring.period == 0
            && (f.feedthrough_timed
                || c.inputs[k].0.iter().chain(&c.inputs[k].1).any(|l| order.continuous_lane(*l)));
        part.wiring.held = f.modes && !moves;
    }
}

pub(super) fn guards(
    (whens, watches): (&[WhenSpec<'_>], &[WatchedSpec<'_>]),
    parts: &[Part<'_>],
    c: &Connections,
    order: &Order,
    variables: &BTreeMap<String, Variable>,
) -> Result<Watch, Vec<Fault>> {
    let (mut watch, mut faults) = (Watch::default(), Vec::new());
    let mut lanes = Vec::new();
    for (k, part) in parts.iter().enumerate() {
        let d = part.prototype.description();
        if d.functions.modes {
            watch.moded.resize(parts.len(), false);
            watch.moded[k] = true;
        }
        if d.guards.is_empty() || part.wiring.held {
            continue;
        }
        watch.located = true;
        let first = watch.guards.len() as u32;
        for port in &d.guards {
            for (name, _) in port.lane_names() {
                let which = watch.guards.len() as u32 - first;
                watch.guards.push(GuardPlan {
                    name: format!("{}.{}{name}", part.spec.path, port.name),
                    direction: port.direction,
                    fires: Fires::Part { block: k as u32, which },
                });
            }
        }
        let count = watch.guards.len() as u32 - first;
        watch.guarded.push(Guarded { block: k as u32, first, count });
        lanes.extend(c.inputs[k].0.iter().chain(&c.inputs[k].1).copied());
    }
    for when in whens {
        match condition(when, c, order, variables) {
            Ok(condition) => {
                watch.add(condition, Fires::Transition { to: when.to }, order, &mut lanes)
            }
            Err(fault) => faults.push(fault),
        }
    }
    for (which, watched) in (0..).zip(watches) {
        // Skip faulty conditions here: they are reported where the variables of all phases are
        // known.
        if let Ok(condition) = Condition::parse_partly(watched.when, variables)
            && (condition.timed() || condition.places().any(|p| !matches!(p, Place::Channel(_))))
        {
            watch.add(condition, Fires::Watch { which }, order, &mut lanes);
        }
    }
    watch.ops = order.upstream(lanes.into_iter());
    if faults.is_empty() { Ok(watch) } else { Err(faults) }
}

impl Watch {
    fn add(&mut self, condition: Condition, fires: Fires, order: &Order, lanes: &mut Vec<u32>) {
        let signals = || {
            condition.places().filter_map(|p| match p {
                Place::Signal(lane) => Some(lane),
                _ => None,
            })
        };
        lanes.extend(signals());
        // Sampled outputs and discrete states change at rows and events only.
        self.located |= condition.timed()
            || condition.places().any(|p| matches!(p, Place::X(_)))
            || signals().any(|lane| order.continuous_lane(lane));
        let guard = self.guards.len() as u32;
        let name = condition.text.clone();
        self.guards.push(GuardPlan { name, direction: Direction::Rising, fires });
        self.conditions.push(Watched { guard, condition });
    }
}

fn condition(
    when: &WhenSpec<'_>,
    c: &Connections,
    order: &Order,
    variables: &BTreeMap<String, Variable>,
) -> Result<Condition, Fault> {
    let condition = Condition::parse(when.when, variables)
        .map_err(|e| Fault::new(when.origin, e.to_string()).help(e.help))?;
    // An input that can be set from outside can change, although no part drives it.
    let free = |lane: u32| c.free.values().any(|l| *l == lane);
    let moves = |p: Place| match p {
        Place::X(_) | Place::D(_) => true,
        Place::Signal(lane) => !order.constant_lane(lane) || free(lane),
        Place::Channel(_) | Place::Phase(_) => false,
    };
    if !condition.timed() && !condition.places().any(moves) {
        let fact = format!("condition `{}`: its value never changes", when.when);
        let help = "test a state, an output that varies, or `time`";
        return Err(Fault::new(when.origin, fact).help(help));
    }
    Ok(condition)
}
