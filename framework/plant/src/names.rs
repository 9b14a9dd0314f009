//! The variables of a mechanism, named after their body: `<body>.angle`, `<body>.rate`.
use crate::plan::MechanismPlan;
use linkwork_multibody::BodyId;
use linkwork_multibody::{Body, SubhingeKind};
use linkwork_runtime::{Named, Place, Role, Wiring};
use std::collections::BTreeSet;
use std::sync::Arc;

pub(crate) fn names(m: &MechanismPlan, w: &Wiring) -> Vec<Named> {
    let mut all = Vec::new();
    let part: Arc<str> = (*m.path).into();
    for body in m.multibody.bodies() {
        coordinates(&mut all, m, w, body);
        modes(&mut all, m, w, body);
    }
    let bodies: BTreeSet<&str> = m.multibody.bodies().iter().map(Body::name).collect();
    let first = w.yd + m.multibody.nv() + m.bristles();
    for (lane, (name, unit, doc)) in (first..).zip(m.reports()) {
        all.push(Named {
            part: owner(&bodies, &name).unwrap_or(&m.path).into(),
            path: name,
            place: Place::Signal(lane as u32),
            role: Role::Output,
            unit: unit.into(),
            doc: doc.into(),
        });
    }
    loop_motions(&mut all, m, w);
    let state = |path: String, lane: usize, doc: &'static str| Named {
        path,
        place: Place::X(lane as u32),
        role: Role::State,
        unit: "".into(),
        doc: doc.into(),
        part: part.clone(),
    };
    let first = w.x + m.multibody.nq() + m.multibody.nv() + 2 * m.multibody.motions();
    for i in 0..m.bristles() {
        let doc = "Bristle of a pair of colliders: deflection (m, world), rotation (rad).";
        all.push(state(format!("{}.contact.bristle[{i}]", m.path), first + i, doc));
    }
    for i in 0..m.bristle_pairs() {
        let doc = "Pair of colliders of bristles 4 i to 4 i + 3: 1 + a n + b for colliders a < b of n, in the order of their names; 0: none.";
        let path = format!("{}.contact.bristle_pair[{i}]", m.path);
        all.push(Named { place: Place::D((w.d + i) as u32), ..state(path, 0, doc) });
    }
    all
}

/// Returns the body with whose name the path of a report begins; of several the longest name.
fn owner<'a>(bodies: &BTreeSet<&'a str>, path: &str) -> Option<&'a str> {
    path.rmatch_indices('.').find_map(|(at, _)| bodies.get(&path[..at]).copied())
}

/// Name and unit.
type Lane = (&'static str, &'static str);

const FREE: [&[Lane]; 3] = [
    &[
        ("position.x", "m"),
        ("position.y", "m"),
        ("position.z", "m"),
        ("rotation.x", ""),
        ("rotation.y", ""),
        ("rotation.z", ""),
        ("rotation.w", ""),
    ],
    &[
        ("angular.x", "rad/s"),
        ("angular.y", "rad/s"),
        ("angular.z", "rad/s"),
        ("velocity.x", "m/s"),
        ("velocity.y", "m/s"),
        ("velocity.z", "m/s"),
    ],
    &[
        ("angular_acceleration.x", "rad/s^2"),
        ("angular_acceleration.y", "rad/s^2"),
        ("angular_acceleration.z", "rad/s^2"),
        ("acceleration.x", "m/s^2"),
        ("acceleration.y", "m/s^2"),
        ("acceleration.z", "m/s^2"),
    ],
];

/// Returns the names of the coordinates, rates and accelerations of a subhinge.
fn lanes(kind: SubhingeKind) -> [&'static [Lane]; 3] {
    match kind {
        SubhingeKind::Pin { .. } | SubhingeKind::Screw { .. } => {
            [&[("angle", "rad")], &[("rate", "rad/s")], &[("acceleration", "rad/s^2")]]
        }
        SubhingeKind::Slider { .. } => {
            [&[("displacement", "m")], &[("speed", "m/s")], &[("acceleration", "m/s^2")]]
        }
        // A ball hinge has the rotation of a free hinge: the second part of its coordinates, and
        // the first part of its rates and accelerations.
        SubhingeKind::Ball => [&FREE[0][3..], &FREE[1][..3], &FREE[2][..3]],
        SubhingeKind::Free => FREE,
        SubhingeKind::Locked => [&[], &[], &[]],
    }
}

fn coordinates(all: &mut Vec<Named>, m: &MechanismPlan, w: &Wiring, body: &Body) {
    let (x, nq) = (w.x, m.multibody.nq());
    let part: Arc<str> = body.name().into();
    if m.held.iter().any(|name| name == body.name()) {
        return;
    }
    for (s, sub) in body.subhinges().iter().enumerate() {
        let tag = if body.subhinges().len() > 1 { format!("[{s}]") } else { String::new() };
        let [q, v, a] = lanes(sub.subhinge.kind);
        let state = |lane: usize| (Place::X(lane as u32), Role::State);
        let output = |lane: usize| (Place::Signal(lane as u32), Role::Output);
        let q = q
            .iter()
            .enumerate()
            .map(|(i, n)| (n, state(x + sub.q.start + i), "Coordinate of the hinge."));
        let v = v.iter().enumerate().map(|(i, n)| {
            (n, state(x + nq + sub.v.start + i), "Velocity of the hinge, child axes.")
        });
        let a = a.iter().enumerate().map(|(i, n)| {
            let doc = "Acceleration of the hinge: rate of change of its velocity.";
            (n, output(w.yd + sub.v.start + i), doc)
        });
        let mut lanes: Vec<_> = q.chain(v).chain(a).collect();
        // Bodies are sorted by name. Sort their variables in the same way, so that sorting all paths
        // again costs nothing.
        lanes.sort_unstable_by_key(|lane| lane.0.0);
        all.extend(lanes.into_iter().map(|(&(name, unit), (place, role), doc)| Named {
            path: [&part, &*tag, ".", name].concat(),
            place,
            role,
            unit: unit.into(),
            doc: doc.into(),
            part: part.clone(),
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
            unit: "".into(),
            doc: doc.into(),
            part: body.name().into(),
        });
    }
}

fn loop_motions(all: &mut Vec<Named>, m: &MechanismPlan, w: &Wiring) {
    let first = w.x + m.multibody.nq() + m.multibody.nv();
    let part: Arc<str> = (*m.path).into();
    let mut both = |i: usize, names: [String; 2], doc: &'static str| {
        for (j, name) in names.into_iter().enumerate() {
            all.push(Named {
                path: format!("{}.{name}", m.path),
                place: Place::X((first + 2 * i + j) as u32),
                role: Role::State,
                unit: "".into(),
                doc: doc.into(),
                part: part.clone(),
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
                "Offset of the two ends of the loop that is kept in row k (rad or m), and its rate.",
            );
        }
    }
}

/// Returns names, units and descriptions of the lanes of all bodies.
pub(crate) fn touch_names(
    plan: &MechanismPlan,
) -> impl Iterator<Item = (String, &'static str, String)> {
    let lane = |body: &str, stem: &str, unit, doc: &str| {
        ["x", "y", "z"].map(|c| (format!("{body}.{stem}.{c}"), unit, doc.to_owned()))
    };
    plan.touched.iter().flat_map(move |id| {
        let body = plan.multibody.get(*id).name();
        let force = "Sum of the contact forces on the colliders of the body, W.";
        let point = "Position at which that force acts: mean of the contact points, weighted by normal forces, W; the body's origin without contact.";
        let force = lane(body, "contact_force", "N", force);
        force.into_iter().chain(lane(body, "contact_point", "m", point))
    })
}

/// Returns names, units and descriptions of the lanes of all pairs.
pub(crate) fn pair_names(
    plan: &MechanismPlan,
) -> impl Iterator<Item = (String, &'static str, String)> {
    plan.pairs.iter().flat_map(|pair| {
        let name = |b: BodyId| plan.multibody.get(b).name();
        let (of, from) = (name(pair.of), pair.from.map_or("world", name));
        let lanes = [
            ("force", "N", "Contact force on the first body from the second, W."),
            ("point", "m", "Position at which that force acts: mean of the contact points, weighted by normal forces, W; the first body's origin without contact."),
        ];
        lanes.into_iter().flat_map(move |(stem, unit, doc)| {
            ["x", "y", "z"].map(|c| {
                (format!("{of}.contact_with.{from}.{stem}.{c}"), unit, doc.to_owned())
            })
        })
    })
}

/// Returns names, units and descriptions of the lanes of all hinges.
pub(crate) fn load_names(plan: &MechanismPlan) -> Vec<(String, &'static str, String)> {
    let mut out = Vec::new();
    for r in &plan.loads {
        let body = plan.multibody.get(r.body);
        let name = body.name();
        let force =
            "Force that the hinge exerts on the body, axes of the hinge's frame on the body.";
        let moment = "Moment that the hinge exerts on the body about the origin of the hinge's frame on the body, in the axes of that frame.";
        for (stem, unit, doc) in [("force", "N", force), ("moment", "N m", moment)] {
            let axes = ["x", "y", "z"];
            out.extend(axes.map(|c| (format!("{name}.reaction_{stem}.{c}"), unit, doc.to_owned())));
        }
        for (i, v) in r.effort.clone().enumerate() {
            let tag = if r.effort.len() > 1 { format!("[{i}]") } else { String::new() };
            let doc = "Force or torque at the coordinate: the sum of all that act on it, or the one that its prescribed motion requires.";
            out.push((format!("{name}.effort{tag}"), effort_unit(plan, v), doc.to_owned()));
        }
    }
    out
}

fn effort_unit(plan: &MechanismPlan, v: usize) -> &'static str {
    let sub = plan.multibody.subhinges().find(|(_, s)| s.v.contains(&v));
    let Some((_, s)) = sub else { return "" };
    use linkwork_multibody::SubhingeKind::{Free, Slider};
    match s.subhinge.kind {
        Slider { .. } => "N",
        Free if v >= s.v.start + 3 => "N",
        _ => "N m",
    }
}
