//! Guards: those of parts in path order, then the conditions of transitions.
use super::Part;
use super::connect::Connections;
use super::order::Order;
use crate::condition::Condition;
use crate::plan::{Fires, GuardPlan, Guarded, Place, Variable, Watched};
use crate::ports::Direction;
use crate::value::{Fault, Origin};
use std::collections::BTreeMap;

/// A condition on which a phase is left.
pub(crate) struct WhenSpec<'a> {
    /// Place of the phase to go to.
    pub to: u32,
    /// The condition.
    pub when: &'a str,
    /// Where it is written.
    pub origin: Origin,
}

/// What is watched.
#[derive(Default)]
pub(super) struct Watch {
    pub guards: Vec<GuardPlan>,
    pub guarded: Vec<Guarded>,
    pub conditions: Vec<Watched>,
    /// Operations that they follow from.
    pub ops: Vec<u32>,
}

pub(super) fn guards(
    whens: &[WhenSpec<'_>],
    parts: &[Part<'_>],
    c: &Connections,
    order: &Order,
    variables: &BTreeMap<String, Variable>,
) -> Result<Watch, Vec<Fault>> {
    let (mut watch, mut faults) = (Watch::default(), Vec::new());
    let mut lanes = Vec::new();
    for (k, part) in parts.iter().enumerate() {
        let d = part.prototype.description();
        if d.guards.is_empty() {
            continue;
        }
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
                lanes.extend(condition.places().filter_map(|p| match p {
                    Place::Signal(lane) => Some(lane),
                    _ => None,
                }));
                let guard = watch.guards.len() as u32;
                watch.guards.push(GuardPlan {
                    name: condition.text.clone(),
                    direction: Direction::Rising,
                    fires: Fires::Transition { to: when.to },
                });
                watch.conditions.push(Watched { guard, condition });
            }
            Err(fault) => faults.push(fault),
        }
    }
    watch.ops = order.upstream(lanes.into_iter());
    if faults.is_empty() { Ok(watch) } else { Err(faults) }
}

fn condition(
    when: &WhenSpec<'_>,
    c: &Connections,
    order: &Order,
    variables: &BTreeMap<String, Variable>,
) -> Result<Condition, Fault> {
    let condition = Condition::parse(when.when, variables)
        .map_err(|e| Fault::new(when.origin, e.to_string()).help(e.help))?;
    // Inputs that may be set from outside do move.
    let free = |lane: u32| c.free.values().any(|l| *l == lane);
    let moves = |p: Place| match p {
        Place::X(_) | Place::D(_) => true,
        Place::Signal(lane) => !order.constant_lane(lane) || free(lane),
        Place::Channel(_) => false,
    };
    if !condition.timed() && !condition.places().any(moves) {
        let fact = format!("condition `{}`: nothing in it ever changes", when.when);
        let help = "test a state, an output that varies, or `time`";
        return Err(Fault::new(when.origin, fact).help(help));
    }
    Ok(condition)
}
