//! Every variable by path: `<part>.<port>`, `<part>.state.<name>`, `<body>.angle`.
use super::connections::Connections;
use super::part::Part;
use crate::Catalogue;
use crate::author::block::Named;
use crate::author::files::Files;
use crate::author::model::Description;
use crate::author::ports::{PortKind, PortSpec, Text};
use crate::author::variable::{Place, Role, Variable};
use crate::plan::compiled::Loop;
use crate::plan::spec::Spec;
use std::collections::BTreeMap;
use std::sync::Arc;

pub(crate) fn variables(
    parts: &[Part<'_>],
    c: &Connections,
    loops: &[Loop],
) -> BTreeMap<String, Variable> {
    let mut all = Vec::new();
    // Parts of one model share its description.
    let mut known: BTreeMap<*const Description, Vec<Lane>> = BTreeMap::new();
    // Each wire that is solved for reports on its loop.
    for tear in &c.tears {
        let Some(l) = loops.iter().find(|l| l.wires.contains(&tear.text)) else { continue };
        let names = [
            ("iterations", "Newton steps of the last solution of this wire's loop."),
            ("residual", "Greatest remaining difference, relative to its tolerance."),
        ];
        for (k, (name, doc)) in names.into_iter().enumerate() {
            let variable = Variable {
                place: Place::Signal(l.work + k as u32),
                role: Role::Output,
                unit: "".into(),
                doc: doc.into(),
                kind: PortKind::Numbers,
                part: (*parts[tear.reader].spec.path).into(),
            };
            all.push((format!("{}.solve.{name}", tear.to), variable));
        }
    }
    for (k, part) in parts.iter().enumerate() {
        let (d, path, w) = (part.prototype.description(), &part.spec.path, &part.wiring);
        if let Some(names) = part.prototype.names(w) {
            all.extend(names.into_iter().map(|n| {
                let Named { path, place, role, unit, doc, part } = n;
                (path, Variable { place, role, unit, doc, kind: PortKind::Numbers, part })
            }));
            continue;
        }
        let path: &Arc<str> = &(**path).into();
        let (u, ud) = &c.inputs[k];
        let of_model = known.entry(std::ptr::from_ref(d)).or_insert_with(|| lanes(d));
        all.extend(of_model.iter().map(|lane| {
            let (place, role) = match lane.side {
                Side::Input => {
                    let source = match lane.at.checked_sub(u.len()) {
                        Some(direct) => ud[direct],
                        None => u[lane.at],
                    };
                    let free = c.free.contains_key(&(k, lane.at));
                    (Place::Signal(source), if free { Role::Free } else { Role::Input })
                }
                Side::Output => (Place::Signal((w.ym + lane.at) as u32), Role::Output),
                Side::Continuous => (Place::X((w.x + lane.at) as u32), Role::State),
                Side::Discrete => (Place::D((w.d + lane.at) as u32), Role::State),
            };
            lane.variable(path, place, role)
        }));
    }
    // Collecting sorts all variables at once; if paths are equal, the last one remains.
    all.into_iter().collect()
}

/// Returns the variables of the parts of a specification that cannot be compiled, as far as they follow from the catalogue, and the paths of parts
/// whose variables are unknown.
pub fn known_variables(
    spec: &Spec,
    catalogue: &Catalogue,
    files: &Files,
) -> (Vec<String>, Vec<String>) {
    let (mut all, mut dark) = (Vec::new(), Vec::new());
    for part in &spec.parts {
        let path: &Arc<str> = &(*part.path).into();
        let entry = catalogue.get(&part.model);
        let files = files.first(part.folder.as_deref());
        let Some(d) = entry.and_then(|e| e.describe(&part.params, &files)) else {
            dark.push(part.path.clone());
            continue;
        };
        let place = (Place::Signal(0), Role::Output);
        all.extend(lanes(&d).iter().map(|lane| lane.variable(path, place.0, place.1)));
    }
    let all: BTreeMap<String, Variable> = all.into_iter().collect();
    (all.into_keys().collect(), dark)
}

/// Set of lanes of a part.
#[derive(Clone, Copy)]
enum Side {
    Input,
    Output,
    Continuous,
    Discrete,
}

/// A lane that every part of a model has.
struct Lane {
    /// Suffix after the path of the part: `.rate.x`, `.state.angle`.
    name: String,
    side: Side,
    /// Index among the lanes of its side.
    at: usize,
    unit: Text,
    doc: Text,
    kind: PortKind,
}

impl Lane {
    fn variable(&self, path: &Arc<str>, place: Place, role: Role) -> (String, Variable) {
        let variable = Variable {
            place,
            role,
            unit: self.unit.clone(),
            doc: self.doc.clone(),
            kind: self.kind,
            part: path.clone(),
        };
        ([path, &*self.name].concat(), variable)
    }
}

/// Returns the lanes of a model by name. Parts are in the order of their paths, too, so sorting all variables costs little.
fn lanes(d: &Description) -> Vec<Lane> {
    fn add<'p>(
        all: &mut Vec<Lane>,
        (side, prefix): (Side, &str),
        ports: impl Iterator<Item = &'p PortSpec>,
    ) {
        let mut at = 0;
        for port in ports {
            let kind = if port.kind == PortKind::Bool { port.kind } else { PortKind::Numbers };
            for (name, unit) in port.lane_names() {
                let name = [".", prefix, &*port.name, &*name].concat();
                all.push(Lane { name, side, at, unit, doc: port.doc.clone(), kind });
                at += 1;
            }
        }
    }
    let mut all = Vec::new();
    add(&mut all, (Side::Input, ""), d.all_inputs());
    add(&mut all, (Side::Output, ""), d.all_outputs());
    add(&mut all, (Side::Continuous, "state."), d.continuous.iter());
    add(&mut all, (Side::Discrete, "state."), d.discrete.iter());
    all.sort_by(|a, b| a.name.cmp(&b.name));
    all
}
