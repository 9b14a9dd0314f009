//! Every variable by path: `<part>.<port>`, `<part>.state.<name>`, `<body>.angle`.
use super::Part;
use super::connect::Connections;
use crate::Catalogue;
use crate::block::Named;
use crate::plan::{Loop, Place, Role, Variable};
use crate::ports::{PortKind, PortSpec};
use crate::services::Files;
use crate::spec::Spec;
use std::collections::BTreeMap;
use std::sync::Arc;

pub(crate) fn variables(
    parts: &[Part<'_>],
    c: &Connections,
    loops: &[Loop],
) -> BTreeMap<String, Variable> {
    let mut all = Vec::new();
    // Each wire that is solved for reports on its loop.
    for tear in &c.tears {
        let Some(l) = loops.iter().find(|l| l.wires.contains(&tear.text)) else { continue };
        let names = [
            ("iterations", "Newton steps of the last solution of this wire's loop."),
            ("residual", "Greatest difference that is left, as a part of its tolerance."),
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
        let mut input = 0;
        let (u, ud) = &c.inputs[k];
        let sources: Vec<u32> = u.iter().chain(ud).copied().collect();
        for port in d.all_inputs() {
            add(&mut all, path, "", port, |i| {
                let role =
                    if c.free.contains_key(&(k, input + i)) { Role::Free } else { Role::Input };
                (Place::Signal(sources[input + i]), role)
            });
            input += port.lanes;
        }
        let mut lane = w.ym;
        for port in d.all_outputs() {
            add(&mut all, path, "", port, |i| (Place::Signal((lane + i) as u32), Role::Output));
            lane += port.lanes;
        }
        let mut lane = w.x;
        for field in &d.continuous {
            add(&mut all, path, "state.", field, |i| (Place::X((lane + i) as u32), Role::State));
            lane += field.lanes;
        }
        let mut lane = w.d;
        for field in &d.discrete {
            add(&mut all, path, "state.", field, |i| (Place::D((lane + i) as u32), Role::State));
            lane += field.lanes;
        }
    }
    // All at once, which sorts them: of equal paths the last one stays.
    all.into_iter().collect()
}

/// Variables of the parts of a specification that cannot be compiled, as far as they follow from the
/// catalogue; and the paths of the parts of which nothing is known.
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
        let place = |_| (Place::Signal(0), Role::Output);
        d.all_inputs().chain(d.all_outputs()).for_each(|p| add(&mut all, path, "", p, place));
        let states = d.continuous.iter().chain(&d.discrete);
        states.for_each(|p| add(&mut all, path, "state.", p, place));
    }
    let all: BTreeMap<String, Variable> = all.into_iter().collect();
    (all.into_keys().collect(), dark)
}

fn add(
    all: &mut Vec<(String, Variable)>,
    path: &Arc<str>,
    prefix: &str,
    port: &PortSpec,
    mut place: impl FnMut(usize) -> (Place, Role),
) {
    for (i, (name, unit)) in port.lane_names().into_iter().enumerate() {
        let (at, role) = place(i);
        all.push((
            format!("{path}.{prefix}{}{name}", port.name),
            Variable {
                place: at,
                role,
                unit: unit.to_string().into(),
                doc: port.doc.clone(),
                kind: if port.kind == PortKind::Bool { port.kind } else { PortKind::Numbers },
                part: path.clone(),
            },
        ));
    }
}
