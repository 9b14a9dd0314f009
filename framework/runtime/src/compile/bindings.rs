//! Bindings: they are collected with the ports that they serve, and passed to the host.
use super::connections::Connections;
use super::part::Part;
use crate::author::binding::{BindSpec, BindTarget, TO_NODE};
use crate::author::block::{Prototype, Wiring};
use crate::author::host::{Bound, End, Lowering};
use crate::author::ports::{PortKind, PortSpec};
use crate::author::services::Services;
use crate::author::shown::BINDING;
use crate::author::value::{Fault, Value, remedy};
use crate::plan::spec::{PartSpec, Spec};
use std::collections::BTreeMap;

/// Specification of the host's part; `None` if there is no host and no part binds to one.
pub(super) fn host_spec(spec: &Spec) -> Option<PartSpec> {
    spec.host.as_ref().map(|h| {
        let mut part = PartSpec::new(h.path(), h.kind(), Value::Map(Vec::new()));
        part.origin = h.origin();
        part
    })
}

/// Bindings whose names contain their targets.
pub(super) fn own(parts: &[Part<'_>]) -> Vec<BindSpec> {
    let of = |part: &Part<'_>| {
        let own = |bind: &str| {
            Some(BindSpec {
                part: part.spec.path.clone(),
                target: BindTarget::Node(bind.strip_prefix(TO_NODE)?.into()),
                bind: bind.into(),
                origin: part.spec.origin,
            })
        };
        part.prototype.description().bindings().into_iter().filter_map(own).collect::<Vec<_>>()
    };
    parts.iter().flat_map(of).collect()
}

/// Returns the host's part and its wires. `absent`: parts that were not built (their faults are already reported), and services.
pub(super) fn bind(
    spec: &Spec,
    parts: &[Part<'_>],
    absent: &BTreeMap<&str, bool>,
    services: &Services,
    out: &mut Lowering<'_>,
) -> Option<Box<dyn Prototype>> {
    let index: BTreeMap<&str, usize> =
        parts.iter().enumerate().map(|(k, p)| (p.spec.path.as_str(), k)).collect();
    // Skip bindings of readers to fields: `fields::find` resolves them.
    let hosted = |b: &&BindSpec| !(b.bind == BINDING && known(b, parts, &index));
    let mut binds: Vec<&BindSpec> = spec.binds.iter().filter(hosted).collect();
    binds.sort_by(|a, b| (&a.part, &a.bind).cmp(&(&b.part, &b.bind)));
    let mut bound = Vec::new();
    for bind in binds {
        match find(bind, parts, &index, absent, spec.host.is_some()) {
            Ok(Some(b)) => bound.push(b),
            Ok(None) => {}
            Err(fault) => out.faults.push(fault),
        }
    }
    spec.host.as_ref().map(|h| h.lower(&bound, services, out))
}

/// Warns of a part that drives a hinge and whose own inputs are all unwired: it then runs with default commands, which is rarely intended.
pub(super) fn uncommanded(parts: &[Part<'_>], c: &Connections, warnings: &mut Vec<Fault>) {
    for (k, part) in parts.iter().enumerate() {
        let d = part.prototype.description();
        let drives = |p: &PortSpec| {
            matches!(p.kind, PortKind::HingeTorque | PortKind::BallTorque) && p.bind.is_some()
        };
        if !d.all_outputs().any(drives) {
            continue;
        }
        let own: Vec<(usize, &str)> = (d.all_inputs())
            .scan(0, |lane, p| {
                let first = *lane;
                *lane += p.lanes;
                Some((first, p))
            })
            .filter(|(_, p)| p.bind.is_none())
            .map(|(lane, p)| (lane, &*p.name))
            .collect();
        let free = own.iter().all(|(lane, _)| c.free.contains_key(&(k, *lane)));
        if free && !own.is_empty() {
            let names: Vec<&str> = own.iter().map(|(_, name)| *name).collect();
            let path = &part.spec.path;
            let fact = format!("`{path}` drives a hinge, but no wire commands it");
            let help = format!("wire {}", names.join(" or "));
            warnings.push(Fault::new(part.spec.origin, fact).help(help));
        }
    }
}

/// Warns of outputs that another part must read and that no part reads.
pub(super) fn untaken(parts: &[Part<'_>], c: &Connections, warnings: &mut Vec<Fault>) {
    for part in parts {
        for (name, lost) in part.prototype.must_be_read() {
            let mut lane = part.wiring.ym;
            for port in part.prototype.description().all_outputs() {
                let lanes = lane as u32..(lane + port.lanes) as u32;
                lane += port.lanes;
                let wired = c.inputs.iter().flat_map(|(u, ud)| u.iter().chain(ud));
                let mut read = wired.chain(c.sums.iter().flat_map(|sum| &sum.sources));
                if port.name == name && !read.any(|lane| lanes.contains(lane)) {
                    let fact = format!("`{}.{name}`: {}", part.spec.path, lost.message);
                    let fault = Fault::new(part.spec.origin, fact);
                    warnings.push(Fault { help: lost.help.clone(), ..fault });
                }
            }
        }
    }
}

/// Returns whether the part exists and has the binding.
fn known(bind: &BindSpec, parts: &[Part<'_>], index: &BTreeMap<&str, usize>) -> bool {
    let part = index.get(bind.part.as_str()).map(|&k| parts[k].prototype.description());
    part.is_some_and(|d| d.bindings().contains(&bind.bind.as_str()))
}

fn find<'a>(
    bind: &'a BindSpec,
    parts: &'a [Part<'_>],
    index: &BTreeMap<&str, usize>,
    absent: &BTreeMap<&str, bool>,
    host: bool,
) -> Result<Option<Bound<'a>>, Fault> {
    let (part, name, origin) = (&bind.part, &bind.bind, bind.origin);
    let Some(&k) = index.get(part.as_str()) else {
        return match absent.contains_key(part.as_str()) {
            true => Ok(None),
            false => Err(Fault::new(origin, format!("binding of `{part}`: no such part"))),
        };
    };
    let d = parts[k].prototype.description();
    if !d.bindings().contains(&name.as_str()) {
        return Err(Fault::new(origin, format!("`{part}` has no binding `{name}`")).help(remedy(
            name,
            "bindings",
            &d.bindings(),
        )));
    }
    if !host {
        let fact = format!("`{part}` binds `{name}`, but there are no bodies");
        return Err(Fault::new(origin, fact).help("add `bodies` to the assembly"));
    }
    let inputs = d.all_inputs().map(|p| (p, End::Input));
    let ports = inputs.chain(d.all_outputs().map(|p| (p, End::Output)));
    let ports = ports.filter(|(p, _)| p.bind.as_deref() == Some(name)).collect();
    Ok(Some(Bound { spec: bind, ports }))
}

/// Inserts a part for the host at its position among the others.
pub(super) fn add_host<'a>(
    parts: &mut Vec<Part<'a>>,
    spec: &'a PartSpec,
    prototype: Box<dyn Prototype>,
) {
    let at = parts.partition_point(|p| p.spec.path < spec.path);
    parts.insert(at, Part { spec, prototype, wiring: Wiring::default(), asks: Vec::new() });
}
