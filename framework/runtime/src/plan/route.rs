//! Mapping of the state of a run that moves from one plan to another.
use crate::author::variable::{Place, Role};
use crate::plan::compiled::{Fires, GuardPlan, Plan};
use std::collections::{BTreeMap, BTreeSet};

/// Mapping of a state from one plan to another, by path.
pub(crate) struct Route {
    /// For each part of the new plan: the part with the same path in the old plan.
    pub parts: Vec<Option<u32>>,
    /// Held outputs and inputs that were set: lane in the new plan, lane in the old.
    pub signals: Vec<(u32, u32)>,
    /// For each guard of the new plan: the guard with the same name in the old plan, if it is not a condition.
    pub guards: Vec<Option<u32>>,
    /// Parts of the old plan that the new one does not have.
    pub gone: Vec<u32>,
}

impl Route {
    pub fn new(from: &Plan, to: &Plan) -> Route {
        let paths: BTreeMap<&str, u32> =
            from.parts.iter().zip(0..).map(|(p, k)| (p.path.as_str(), k)).collect();
        let here: BTreeSet<&str> = to.parts.iter().map(|p| p.path.as_str()).collect();
        let kind = |g: &GuardPlan| matches!(g.fires, Fires::Watch { .. });
        let guards = from.guards.iter().zip(0..).filter(|(g, _)| !g.level());
        let guards: BTreeMap<(bool, &str), u32> =
            guards.map(|(g, k)| ((kind(g), g.name.as_str()), k)).collect();
        let same = |g: &GuardPlan| match g.level() {
            true => None,
            false => guards.get(&(kind(g), g.name.as_str())).copied(),
        };
        let mut signals = Vec::new();
        for (path, v) in &*to.lanes {
            let (Place::Signal(k), Role::Output | Role::Free) = (v.place, v.role) else { continue };
            if let Some(o) = from.lanes.get(path)
                && let (Place::Signal(j), true) = (o.place, o.role == v.role)
            {
                signals.push((k, j));
            }
        }
        Route {
            parts: to.parts.iter().map(|p| paths.get(p.path.as_str()).copied()).collect(),
            signals,
            guards: to.guards.iter().map(same).collect(),
            gone: paths.iter().filter(|(p, _)| !here.contains(*p)).map(|(_, k)| *k).collect(),
        }
    }
}
