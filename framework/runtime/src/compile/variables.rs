//! Every variable by path: `<part>.<port>`, `<part>.state.<name>`, `<body>.angle`.
use super::Part;
use super::connect::Connections;
use crate::mechanism::MechanismPlan;
use crate::plan::{Place, Role, Variable};
use crate::ports::{PortKind, PortSpec};
use linkwork_multibody::SubhingeKind;
use std::collections::BTreeMap;

pub(crate) fn variables(
    parts: &[Part<'_>],
    mechanism: Option<&MechanismPlan>,
    c: &Connections,
) -> BTreeMap<String, Variable> {
    let mut all = BTreeMap::new();
    for (k, part) in parts.iter().enumerate() {
        let (d, path, w) = (part.prototype.description(), &part.spec.path, &part.wiring);
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
    if let Some(m) = mechanism {
        mechanism_variables(&mut all, m);
    }
    all
}

fn add(
    all: &mut BTreeMap<String, Variable>,
    path: &str,
    prefix: &str,
    port: &PortSpec,
    mut place: impl FnMut(usize) -> (Place, Role),
) {
    for (i, (name, unit)) in port.lane_names().into_iter().enumerate() {
        let (at, role) = place(i);
        all.insert(
            format!("{path}.{prefix}{}{name}", port.name),
            Variable {
                place: at,
                role,
                unit: unit.to_string(),
                doc: port.doc.to_string(),
                kind: if port.kind == PortKind::Bool { port.kind } else { PortKind::Numbers },
                part: path.to_string(),
            },
        );
    }
}

/// Coordinates and velocities, named by their body.
fn mechanism_variables(all: &mut BTreeMap<String, Variable>, m: &MechanismPlan) {
    let (x, nq) = (m.wiring.x, m.multibody.nq());
    let xyz = |stem: &str| ["x", "y", "z"].map(|c| format!("{stem}.{c}"));
    for body in m.multibody.bodies() {
        for (s, sub) in body.subhinges().iter().enumerate() {
            let tag = if body.subhinges().len() > 1 { format!("[{s}]") } else { String::new() };
            let (q, v): (Vec<(String, &str)>, Vec<(String, &str)>) = match sub.subhinge.kind {
                SubhingeKind::Pin { .. } | SubhingeKind::Screw { .. } => {
                    (vec![("angle".into(), "rad")], vec![("rate".into(), "rad/s")])
                }
                SubhingeKind::Slider { .. } => {
                    (vec![("displacement".into(), "m")], vec![("speed".into(), "m/s")])
                }
                SubhingeKind::Ball => (
                    ["x", "y", "z", "w"].map(|c| (format!("rotation.{c}"), "")).to_vec(),
                    xyz("angular").map(|n| (n, "rad/s")).to_vec(),
                ),
                SubhingeKind::Free => {
                    let mut q = xyz("position").map(|n| (n, "m")).to_vec();
                    q.extend(["x", "y", "z", "w"].map(|c| (format!("rotation.{c}"), "")));
                    let mut v = xyz("angular").map(|n| (n, "rad/s")).to_vec();
                    v.extend(xyz("velocity").map(|n| (n, "m/s")));
                    (q, v)
                }
                SubhingeKind::Locked => (vec![], vec![]),
            };
            let lanes = q
                .into_iter()
                .enumerate()
                .map(|(i, n)| (n, x + sub.q.start + i, "Coordinate of the hinge."))
                .chain(v.into_iter().enumerate().map(|(i, n)| {
                    (n, x + nq + sub.v.start + i, "Velocity of the hinge, child axes.")
                }));
            for ((name, unit), lane, doc) in lanes {
                all.insert(
                    format!("{}{tag}.{name}", body.name()),
                    Variable {
                        place: Place::X(lane as u32),
                        role: Role::State,
                        unit: unit.to_string(),
                        doc: doc.to_string(),
                        kind: PortKind::Numbers,
                        part: body.name().to_string(),
                    },
                );
            }
        }
        let modes = body.modes_q().map(|q| (x + q, "mode", "Modal coordinate."));
        let rates =
            body.modes_v().map(|v| (x + nq + v, "mode_rate", "Rate of a modal coordinate."));
        let count = body.modes_q().len();
        for (i, (lane, name, doc)) in modes.chain(rates).enumerate() {
            all.insert(
                format!("{}.{name}[{}]", body.name(), i % count),
                Variable {
                    place: Place::X(lane as u32),
                    role: Role::State,
                    unit: String::new(),
                    doc: doc.to_string(),
                    kind: PortKind::Numbers,
                    part: body.name().to_string(),
                },
            );
        }
    }
    let reports = MechanismPlan::outputs(&m.multibody, m.contact.is_some());
    for (i, (name, unit, doc)) in reports.into_iter().enumerate() {
        let lane = m.wiring.reports + i as u32;
        all.insert(
            format!("{}.{name}", m.path),
            Variable {
                place: Place::Signal(lane),
                role: Role::Output,
                unit: unit.to_string(),
                doc,
                kind: PortKind::Numbers,
                part: m.path.clone(),
            },
        );
    }
    for (l, i) in m.multibody.loops().iter().flat_map(|l| l.motions.clone().map(move |i| (l, i))) {
        let k = i - l.motions.start;
        let tag = if l.motions.len() > 1 { format!("[{k}]") } else { String::new() };
        let lane = x + nq + m.multibody.nv() + 2 * i;
        for (j, name) in ["position", "rate"].into_iter().enumerate() {
            all.insert(
                format!("{}.{}{tag}.{name}", m.path, l.closure.name),
                Variable {
                    place: Place::X((lane + j) as u32),
                    role: Role::State,
                    unit: String::new(),
                    doc: "Prescribed motion across the loop (rad or m).".to_string(),
                    kind: PortKind::Numbers,
                    part: m.path.clone(),
                },
            );
        }
    }
    let bristles = MechanismPlan::bristles(m.compliant.as_ref());
    for i in 0..bristles {
        let lane = x + nq + m.multibody.nv() + 2 * m.multibody.motions() + i;
        all.insert(
            format!("{}.contact.bristle[{i}]", m.path),
            Variable {
                place: Place::X(lane as u32),
                role: Role::State,
                unit: String::new(),
                doc: "Bristle of a pair of colliders: deflection (m, world), turn (rad).".into(),
                kind: PortKind::Numbers,
                part: m.path.clone(),
            },
        );
    }
}
