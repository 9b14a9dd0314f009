//! Fields: each reader is assigned its field, and the imprints of writers become wires.
use super::part::Part;
use crate::author::binding::{BindSpec, BindTarget};
use crate::author::field::imprint_port;
use crate::author::host::{End, HostWire};
use crate::author::ports::PortSpec;
use crate::author::shown::BINDING;
use crate::author::value::{Fault, remedy};
use crate::plan::compiled::FieldPlan;
use crate::plan::spec::Spec;
use std::collections::BTreeMap;

/// Relation of a part to a field.
struct Use {
    part: usize,
    field: usize,
    reads: bool,
    writes: bool,
}

/// Fields with their readers, by path; their wires, by the path of the field.
pub(super) struct Fields {
    pub plans: Vec<(String, Vec<String>)>,
    pub wires: Vec<(String, HostWire)>,
}

impl Fields {
    /// Replaces the paths by indices of blocks.
    pub fn plans(&self, parts: &[Part<'_>]) -> Vec<FieldPlan> {
        let index: BTreeMap<&str, u32> =
            parts.iter().map(|p| p.spec.path.as_str()).zip(0..).collect();
        let of = |path: &String| index.get(path.as_str()).copied();
        let plan = |(field, readers): &(String, Vec<String>)| {
            let readers = readers.iter().filter_map(of).collect();
            of(field).map(|block| FieldPlan { block, readers })
        };
        self.plans.iter().filter_map(plan).collect()
    }
}

/// Connects parts to the fields that they bind, or else to the nearest field of the same kind.
/// `absent`: parts that were not built; their faults are already reported.
pub(super) fn join(
    spec: &Spec,
    parts: &mut [Part<'_>],
    absent: &BTreeMap<&str, bool>,
    faults: &mut Vec<Fault>,
) -> Fields {
    let fields: Vec<usize> = (0..parts.len()).filter(|&k| is_field(&parts[k])).collect();
    let binds: BTreeMap<&str, &BindSpec> =
        spec.binds.iter().rev().filter(|b| b.bind == BINDING).map(|b| (&*b.part, b)).collect();
    let uses: Vec<Use> = (0..parts.len())
        .filter_map(|k| match find(k, (&fields, &binds), parts, absent) {
            Ok(found) => found,
            Err(fault) => {
                faults.push(fault);
                None
            }
        })
        .collect();
    let mut out = Fields { plans: Vec::new(), wires: Vec::new() };
    for field in fields {
        let path = parts[field].spec.path.clone();
        let of = || uses.iter().filter(|u| u.field == field);
        let name = |u: &Use| parts[u.part].spec.path.clone();
        let writers: Vec<String> = of().filter(|u| u.writes).map(name).collect();
        out.plans.push((path.clone(), of().filter(|u| u.reads).map(name).collect()));
        let imprint = parts[field].prototype.description().imprint.clone();
        for (k, writer) in writers.iter().enumerate() {
            out.wires.extend(imprint.iter().map(|port| {
                let wire = HostWire {
                    host_port: imprint_port(k, &port.name),
                    end: End::Output,
                    part: writer.clone(),
                    port: port.name.to_string(),
                    label: format!("field {path}"),
                    origin: parts[field].spec.origin,
                };
                (path.clone(), wire)
            }));
        }
        let writers: Vec<&str> = writers.iter().map(String::as_str).collect();
        parts[field].prototype.written_by(&writers);
    }
    out
}

fn is_field(part: &Part<'_>) -> bool {
    part.prototype.description().shows.is_some()
}

/// Finds the field of one part.
fn find(
    k: usize,
    (fields, binds): (&[usize], &BTreeMap<&str, &BindSpec>),
    parts: &[Part<'_>],
    absent: &BTreeMap<&str, bool>,
) -> Result<Option<Use>, Fault> {
    let part = &parts[k];
    let (d, path) = (part.prototype.description(), part.spec.path.as_str());
    let writes: Vec<&PortSpec> =
        d.all_outputs().filter(|p| p.bind.as_deref() == Some(BINDING)).collect();
    if let Some(port) = d.all_inputs().find(|p| p.bind.as_deref() == Some(BINDING)) {
        let fact = format!("`{path}`: input `{}` is bound to a field", port.name);
        let help = "outputs write to a field; a model reads one through a `View` in its store";
        return Err(Fault::new(part.spec.origin, fact).help(help));
    }
    if d.reads.is_none() && writes.is_empty() {
        return Ok(None);
    }
    // A part that reads a field states the kind of the field. A part that only writes fits any field
    // that accepts one of its outputs.
    let fits = |f: &Part<'_>| {
        let field = f.prototype.description();
        let has = |port: &&PortSpec| field.imprint.iter().any(|i| i.name == port.name);
        match &d.reads {
            Some(kind) => field.shows.as_ref() == Some(kind),
            None => writes.iter().any(has),
        }
    };
    let known: Vec<usize> = fields.iter().copied().filter(|&f| fits(&parts[f])).collect();
    let paths: Vec<&str> = known.iter().map(|&f| parts[f].spec.path.as_str()).collect();
    let wanted = d.reads.as_deref().map_or("field".into(), |kind| format!("field of {kind}"));
    let field = match binds.get(path).map(|b| (*b, &b.target)) {
        Some((b, BindTarget::Field(text))) => {
            let found = scopes(path, text)
                .find_map(|full| known.iter().copied().find(|&f| parts[f].spec.path == full));
            match found {
                Some(f) => f,
                None if scopes(path, text)
                    .any(|full| absent.get(full.as_str()) == Some(&false)) =>
                {
                    return Ok(None);
                }
                None => {
                    let fact = format!("`{path}`: there is no {wanted} `{text}`");
                    return Err(Fault::new(b.origin, fact).help(remedy(text, "fields", &paths)));
                }
            }
        }
        Some((b, _)) => {
            let fact = format!("`{path}` binds `{BINDING}` to an item that is not a field");
            return Err(Fault::new(b.origin, fact).help(remedy("", "fields", &paths)));
        }
        None => {
            let shared = |f: usize| {
                let other = parts[f].spec.path.split('.');
                other.zip(path.split('.')).take_while(|(a, b)| a == b).count()
            };
            let best = known.iter().map(|&f| shared(f)).max();
            let nearest: Vec<usize> =
                known.iter().copied().filter(|&f| Some(shared(f)) == best).collect();
            match nearest.as_slice() {
                [] => return Ok(None),
                [f] => *f,
                several => {
                    let n = several.len();
                    let fact = format!("`{path}` binds to a {wanted}, but there are {n}");
                    let help = format!("bind `{BINDING}` to one of: {}", paths.join(", "));
                    return Err(Fault::new(part.spec.origin, fact).help(help));
                }
            }
        }
    };
    let imprint = &parts[field].prototype.description().imprint;
    let missing: Vec<&str> = imprint
        .iter()
        .filter(|i| !writes.iter().any(|w| w.name == i.name && w.kind == i.kind))
        .map(|i| &*i.name)
        .collect();
    let beyond = writes.iter().find(|w| !imprint.iter().any(|i| i.name == w.name));
    if let Some(port) = beyond {
        let known: Vec<&str> = imprint.iter().map(|i| &*i.name).collect();
        let field = &parts[field].spec.path;
        let fact = format!("`{path}` writes `{}`, which `{field}` does not accept", port.name);
        return Err(Fault::new(part.spec.origin, fact).help(remedy(&port.name, "ports", &known)));
    }
    if !writes.is_empty() && !missing.is_empty() {
        let field = &parts[field].spec.path;
        let fact = format!("`{path}` writes to `{field}`, but not {}", missing.join(", "));
        let help = "give the model an output for each port of the field's imprint";
        return Err(Fault::new(part.spec.origin, fact).help(help));
    }
    let (reads, writes) = (d.reads.is_some(), !writes.is_empty());
    Ok(Some(Use { part: k, field, reads, writes }))
}

/// Resolves a path relative to a part: first in its own assembly, then in the assemblies around it.
fn scopes<'a>(user: &'a str, text: &'a str) -> impl Iterator<Item = String> + 'a {
    let mut scope = Some(user);
    std::iter::from_fn(move || {
        let here = scope?;
        scope = match here.rsplit_once('.') {
            Some((outer, _)) => Some(outer),
            None if here.is_empty() => None,
            None => Some(""),
        };
        Some(if here.is_empty() { text.to_string() } else { format!("{here}.{text}") })
    })
}
