//! Connectors: the current that a part draws is passed to the source of its supply.
//!
//! A connector is a group of inputs and outputs of a part, such as the voltage that it reads and the current that it draws. Wires join the connectors
//! of two parts in both directions or not at all: an input of a connector that comes from another connector requires that the outputs of the same
//! quantities are wired back to it, unless the other connector has no inputs. Therefore no wire of a pair can be forgotten, and wiring neither loses
//! nor creates a conserved flow (current, mass, heat).
use super::connections::Link;
use super::part::Part;
use crate::author::ports::PortSpec;
use crate::author::value::Fault;
use crate::plan::compiled::Via;
use std::collections::{BTreeMap, BTreeSet};

/// Reports connectors that are not connected, and those that are connected in one direction only.
pub(super) fn check(parts: &[Part<'_>], links: &[Link], faults: &mut Vec<Fault>) {
    // The map gives the connector for the path of its port.
    let mut owner: BTreeMap<String, String> = BTreeMap::new();
    // Connectors that receive something. Other connectors only supply a flow, such as the heat of a motor, and do not
    // need a wire back.
    let mut takes: BTreeSet<String> = BTreeSet::new();
    for part in parts {
        let d = part.prototype.description();
        for port in d.all_inputs().chain(d.all_outputs()) {
            if let Some(connector) = port.connector.as_deref() {
                let path = &part.spec.path;
                owner.insert(format!("{path}.{}", port.name), format!("{path}.{connector}"));
            }
        }
        let inputs = d.all_inputs().filter_map(|port| port.connector.as_deref());
        takes.extend(inputs.map(|connector| format!("{}.{connector}", part.spec.path)));
    }
    if owner.is_empty() {
        return;
    }
    let mut sources: BTreeMap<&str, Vec<&Link>> = BTreeMap::new();
    let mut joined: BTreeSet<(&str, &str)> = BTreeSet::new();
    for link in links.iter().filter(|l| matches!(l.via, Via::Wire)) {
        sources.entry(&link.to).or_default().push(link);
        if let (Some(_), Some(to)) = (owner.get(&link.from), owner.get(&link.to)) {
            joined.insert((&link.from, to));
        }
    }
    for part in parts {
        let (d, path) = (part.prototype.description(), &part.spec.path);
        let mut reported: BTreeSet<&str> = BTreeSet::new();
        for port in d.all_inputs() {
            let Some(connector) = port.connector.as_deref() else { continue };
            for link in sources.get(format!("{path}.{}", port.name).as_str()).into_iter().flatten()
            {
                let own = format!("{path}.{connector}");
                let Some(other) = owner.get(&link.from) else {
                    if reported.insert(connector) {
                        let fact = format!(
                            "`{}` drives `{}`, an input of the connector `{own}`",
                            link.from, link.to
                        );
                        faults.push(Fault::new(link.origin, fact).help(join(&own)));
                    }
                    continue;
                };
                let back = |o: &&PortSpec| o.connector.as_deref() == Some(connector);
                let lost =
                    d.all_outputs().filter(back).filter(|_| takes.contains(other)).find(|o| {
                        !joined.contains(&(format!("{path}.{}", o.name).as_str(), other.as_str()))
                    });
                if let Some(lost) = lost
                    && reported.insert(connector)
                {
                    let fact = format!(
                        "`{own}` receives `{}` from `{other}`, but its `{}` is not connected back to it",
                        port.name, lost.name
                    );
                    faults.push(Fault::new(link.origin, fact).help(join(&own)));
                }
            }
        }
    }
}

fn join(connector: &str) -> String {
    format!("join the connectors instead of single ports: connect: [(\"{connector}\", \"…\")]")
}
