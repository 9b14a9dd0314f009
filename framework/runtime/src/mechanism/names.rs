//! The variables of a mechanism, named by their body: `<body>.angle`, `<body>.rate`.
use super::plan::MechanismPlan;
use crate::block::{Named, Wiring};
use crate::plan::{Place, Role};
use linkwork_multibody::{Body, SubhingeKind};

pub(super) fn names(m: &MechanismPlan, w: &Wiring) -> Vec<Named> {
    let mut all = Vec::new();
    for body in m.multibody.bodies() {
        coordinates(&mut all, m, w, body);
        modes(&mut all, m, w, body);
    }
    let first = w.yd + m.multibody.nv() + m.bristles();
    for (lane, (name, unit, doc)) in (first..).zip(m.reports()) {
        all.push(Named {
            path: name,
            place: Place::Signal(lane as u32),
            role: Role::Output,
            unit: unit.to_string(),
            doc,
            part: m.path.clone(),
        });
    }
    loop_motions(&mut all, m, w);
    let state = |path: String, lane: usize, doc: &str| Named {
        path,
        place: Place::X(lane as u32),
        role: Role::State,
        unit: String::new(),
        doc: doc.to_string(),
        part: m.path.clone(),
    };
    let first = w.x + m.multibody.nq() + m.multibody.nv() + 2 * m.multibody.motions();
    for i in 0..m.bristles() {
        let doc = "Bristle of a pair of colliders: deflection (m, world), turn (rad).";
        all.push(state(format!("{}.contact.bristle[{i}]", m.path), first + i, doc));
    }
    all
}

type Lane = (String, &'static str);

fn xyz(stem: &str, unit: &'static str) -> Vec<Lane> {
    ["x", "y", "z"].map(|c| (format!("{stem}.{c}"), unit)).to_vec()
}

fn quaternion() -> Vec<Lane> {
    ["x", "y", "z", "w"].map(|c| (format!("rotation.{c}"), "")).to_vec()
}

/// Names of the coordinates, rates and accelerations of a subhinge.
fn lanes(kind: SubhingeKind) -> [Vec<Lane>; 3] {
    let one = |name: &str, unit| vec![(name.to_string(), unit)];
    match kind {
        SubhingeKind::Pin { .. } | SubhingeKind::Screw { .. } => {
            [one("angle", "rad"), one("rate", "rad/s"), one("acceleration", "rad/s^2")]
        }
        SubhingeKind::Slider { .. } => {
            [one("displacement", "m"), one("speed", "m/s"), one("acceleration", "m/s^2")]
        }
        SubhingeKind::Ball => {
            [quaternion(), xyz("angular", "rad/s"), xyz("angular_acceleration", "rad/s^2")]
        }
        SubhingeKind::Free => {
            let q = [xyz("position", "m"), quaternion()].concat();
            let v = [xyz("angular", "rad/s"), xyz("velocity", "m/s")].concat();
            let a = [xyz("angular_acceleration", "rad/s^2"), xyz("acceleration", "m/s^2")].concat();
            [q, v, a]
        }
        SubhingeKind::Locked => [vec![], vec![], vec![]],
    }
}

fn coordinates(all: &mut Vec<Named>, m: &MechanismPlan, w: &Wiring, body: &Body) {
    let (x, nq) = (w.x, m.multibody.nq());
    for (s, sub) in body.subhinges().iter().enumerate() {
        let tag = if body.subhinges().len() > 1 { format!("[{s}]") } else { String::new() };
        let [q, v, a] = lanes(sub.subhinge.kind);
        let q = q.into_iter().enumerate().map(|(i, n)| {
            (n, Place::X((x + sub.q.start + i) as u32), Role::State, "Coordinate of the hinge.")
        });
        let v = v.into_iter().enumerate().map(|(i, n)| {
            let place = Place::X((x + nq + sub.v.start + i) as u32);
            (n, place, Role::State, "Velocity of the hinge, child axes.")
        });
        let a = a.into_iter().enumerate().map(|(i, n)| {
            let place = Place::Signal((w.yd + sub.v.start + i) as u32);
            (n, place, Role::Output, "Rate of change of the hinge's velocity lanes.")
        });
        all.extend(q.chain(v).chain(a).map(|((name, unit), place, role, doc)| Named {
            path: format!("{}{tag}.{name}", body.name()),
            place,
            role,
            unit: unit.to_string(),
            doc: doc.to_string(),
            part: body.name().to_string(),
        }));
    }
}

fn modes(all: &mut Vec<Named>, m: &MechanismPlan, w: &Wiring, body: &Body) {
    let (x, nq) = (w.x, m.multibody.nq());
    let modes = body.modes_q().map(|q| (x + q, "mode", "Modal coordinate."));
    let rates = body.modes_v().map(|v| (x + nq + v, "mode_rate", "Rate of a modal coordinate."));
    let count = body.modes_q().len();
    for (i, (lane, name, doc)) in modes.chain(rates).enumerate() {
        all.push(Named {
            path: format!("{}.{name}[{}]", body.name(), i % count),
            place: Place::X(lane as u32),
            role: Role::State,
            unit: String::new(),
            doc: doc.to_string(),
            part: body.name().to_string(),
        });
    }
}

fn loop_motions(all: &mut Vec<Named>, m: &MechanismPlan, w: &Wiring) {
    let first = w.x + m.multibody.nq() + m.multibody.nv();
    let mut both = |i: usize, names: [String; 2], doc: &str| {
        for (j, name) in names.into_iter().enumerate() {
            all.push(Named {
                path: format!("{}.{name}", m.path),
                place: Place::X((first + 2 * i + j) as u32),
                role: Role::State,
                unit: String::new(),
                doc: doc.to_string(),
                part: m.path.clone(),
            });
        }
    };
    for l in m.multibody.loops() {
        let name = &l.closure.name;
        for (k, i) in l.motions.clone().enumerate() {
            let tag = if l.motions.len() > 1 { format!("[{k}]") } else { String::new() };
            let names = ["position", "rate"].map(|lane| format!("{name}{tag}.{lane}"));
            both(i, names, "Prescribed motion across the loop (rad or m).");
        }
        for (k, i) in l.gaps.clone().enumerate() {
            let names = [format!("{name}.gap[{k}]"), format!("{name}.gap_rate[{k}]")];
            both(
                i,
                names,
                "How far apart row k of the loop holds its ends (rad or m), and its rate.",
            );
        }
    }
}
