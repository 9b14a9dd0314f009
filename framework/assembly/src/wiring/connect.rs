//! `connect`: connects connectors, which are groups of related inputs and outputs.
//!
//! ```text
//! connect: [("Motor.supply", "Battery.terminal"), ("Heater.supply", "Battery.terminal")]
//! ```
//! All connectors that are connected, directly or indirectly, form a node. One connector of a node is its source: it determines the voltage
//! (temperature, pressure), which all others read, and receives the sum of the currents (heat flows, mass flows) of all others, because its inputs
//! are sums. The flows at a node therefore add up to zero. The resulting wires are ordinary ones; the runtime checks that none is missing
//! (`framework/runtime/src/compile/connectors.rs`).
use super::wires::{Problem, Wiring};
use crate::expand::instance::Instance;
use crate::text::report::Cx;
use crate::text::value::Text;
use linkwork_runtime::{PortRef, WireSpec, WireTiming};
use std::collections::{BTreeMap, BTreeSet};

/// One connector of one part.
#[derive(Clone)]
struct Connector {
    /// `Part.supply`.
    path: String,
    /// Outputs and inputs by their names in the connector; for inputs, whether they are sums.
    outputs: BTreeMap<String, PortRef>,
    inputs: BTreeMap<String, (PortRef, bool)>,
}

impl Connector {
    fn quantities(&self) -> BTreeSet<&str> {
        self.outputs.keys().chain(self.inputs.keys()).map(String::as_str).collect()
    }

    fn list(&self) -> String {
        self.quantities().into_iter().collect::<Vec<_>>().join(", ")
    }
}

/// Connected connectors, and the first entry that connects them.
struct Node<'a> {
    members: Vec<Connector>,
    entry: &'a [Text],
}

impl<'a> Wiring<'a> {
    /// Returns the wires of all `connect` entries of these instances.
    pub(super) fn connections(&self, instances: &[&'a Instance], cx: &mut Cx) -> Vec<WireSpec> {
        let mut nodes: Vec<Node<'a>> = Vec::new();
        for instance in instances {
            for entry in &instance.connect {
                let mut members = Vec::new();
                let mut whole = true;
                for end in entry {
                    match self.connectors(instance, end) {
                        Ok(found) => members.extend(found),
                        Err((fact, help)) => {
                            whole = false;
                            if !fact.is_empty() {
                                cx.fault(
                                    end.origin,
                                    format!("connector `{}`: {fact}", end.text),
                                    help,
                                );
                            }
                        }
                    }
                }
                if whole {
                    join(&mut nodes, Node { members, entry });
                }
            }
        }
        let mut out = Vec::new();
        for node in &nodes {
            match wires(node) {
                Ok(found) => out.extend(found),
                Err((fact, help)) => {
                    let names: Vec<&str> = node.entry.iter().map(|t| t.text.as_str()).collect();
                    cx.fault(
                        node.entry[0].origin,
                        format!("connect `{}`: {fact}", names.join(" – ")),
                        help,
                    );
                }
            }
        }
        out
    }

    /// Returns the connectors of an end of an entry; several with `[*]`.
    fn connectors(&self, scope: &'a Instance, end: &Text) -> Result<Vec<Connector>, Problem> {
        let [outputs, inputs] = [true, false].map(|output| self.group(scope, &end.text, output));
        let (outputs, inputs) = match (outputs, inputs) {
            (Err(problem), Err(_)) => return Err(problem),
            (outputs, inputs) => (outputs.unwrap_or_default(), inputs.unwrap_or_default()),
        };
        let mut found: BTreeMap<String, Connector> = BTreeMap::new();
        for (is_output, port, name) in outputs
            .into_iter()
            .map(|(name, port)| (true, port, name))
            .chain(inputs.into_iter().map(|(name, port)| (false, port, name)))
        {
            let Some(group) = port.port.strip_suffix(&name).and_then(|g| g.strip_suffix('.'))
            else {
                continue;
            };
            let path = format!("{}.{group}", port.part);
            let connector = found.entry(path.clone()).or_insert_with(|| Connector {
                path,
                outputs: BTreeMap::new(),
                inputs: BTreeMap::new(),
            });
            if is_output {
                connector.outputs.insert(name, port);
            } else {
                let sum = self.takes_sum(&port);
                connector.inputs.insert(name, (port, sum));
            }
        }
        if found.is_empty() {
            let fact = "it is not a connector, which is a group of inputs and outputs of a part"
                .to_string();
            return Err((fact, self.connectors_beside(scope, &end.text)));
        }
        Ok(found.into_values().collect())
    }
}

/// Adds a node; nodes that share a connector are merged.
fn join<'a>(nodes: &mut Vec<Node<'a>>, mut new: Node<'a>) {
    let mut kept = Vec::new();
    for mut node in nodes.drain(..) {
        let shares = node.members.iter().any(|m| new.members.iter().any(|n| n.path == m.path));
        if shares {
            node.members.append(&mut new.members);
            new = node;
        } else {
            kept.push(node);
        }
    }
    new.members.sort_by(|a, b| a.path.cmp(&b.path));
    new.members.dedup_by(|a, b| a.path == b.path);
    kept.push(new);
    *nodes = kept;
}

fn wires(node: &Node<'_>) -> Result<Vec<WireSpec>, Problem> {
    let members = &node.members;
    let [first, others @ ..] = &members[..] else { return Ok(Vec::new()) };
    if others.is_empty() {
        let fact = format!("it lists only `{}`", first.path);
        return Err((fact, "connect two different connectors".into()));
    }
    // A connector that only supplies a flow, such as the heat of a motor, has only some of the quantities of its
    // counterpart.
    let kind = members.iter().map(Connector::quantities).max_by_key(BTreeSet::len);
    let kind = kind.unwrap_or_default();
    let differs = |m: &Connector| {
        let own = m.quantities();
        own != kind && !(m.inputs.is_empty() && own.is_subset(&kind))
    };
    if differs(first) || others.iter().any(differs) {
        let other = others.iter().find(|o| o.quantities() != first.quantities()).unwrap_or(first);
        let fact = format!(
            "`{}` is a connector of ({}), but `{}` of ({})",
            first.path,
            first.list(),
            other.path,
            other.list()
        );
        return Err((fact, "connect connectors of the same kind".into()));
    }
    let sources: Vec<&Connector> =
        members.iter().filter(|m| m.inputs.values().any(|(_, sum)| *sum)).collect();
    let source = match sources[..] {
        [source] => source,
        [] => {
            let fact = format!("there is no source among {}", paths(members));
            return Err((
                fact,
                "connect a source, such as a battery, a tank or an ideal source".into(),
            ));
        }
        [..] => {
            let fact = format!("{} sources: {}", sources.len(), paths(sources.iter().copied()));
            return Err((fact, "keep one source at a node, or insert a part between them".into()));
        }
    };
    let mut out = Vec::new();
    for load in members.iter().filter(|m| m.path != source.path) {
        let mut wire = |from: &PortRef, to: &PortRef| {
            let (from, to) = (from.clone(), to.clone());
            let text = format!("{from} -> {to}");
            out.push(WireSpec {
                from,
                to,
                timing: WireTiming::AtOnce,
                text,
                origin: node.entry[0].origin,
            });
        };
        for (quantity, (to, _)) in &load.inputs {
            if let Some(from) = source.outputs.get(quantity) {
                wire(from, to);
            }
        }
        for (quantity, from) in &load.outputs {
            if let Some((to, _)) = source.inputs.get(quantity) {
                wire(from, to);
            }
        }
    }
    Ok(out)
}

fn paths<'c>(connectors: impl IntoIterator<Item = &'c Connector>) -> String {
    connectors.into_iter().map(|c| format!("`{}`", c.path)).collect::<Vec<_>>().join(", ")
}
