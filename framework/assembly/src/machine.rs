//! A description of a mechanism as an assembly: the same bodies in RON, to every digit.
use crate::builder::variant;
use crate::context::{map, set};
use crate::form::{Assembly, ItemForm};
use crate::modes;
use linkwork_formats::{BodyShape, Description, Geometry, ShapeRole, Term};
use linkwork_multibody::{
    BodySpec, Coordinate, Friction, Hinge, Limits, Stop, Subhinge, SubhingeKind,
};
use linkwork_runtime::{Located, Origin, Value};
use linkwork_spatial::{InertiaCheck, MassProperties, Pose, Vec3};
use std::collections::BTreeMap;

/// An assembly made from a description.
#[derive(Clone, Debug, PartialEq)]
pub struct Converted {
    /// The assembly: [`Assembly::to_ron`] is its text.
    pub assembly: Assembly,
    /// What a description may hold and an assembly may not, a line each.
    pub left_out: Vec<String>,
    /// Name in the description → name in the assembly. They differ where the first has characters that
    /// mean something in a reference, or is `NAME/..` already.
    pub bodies: BTreeMap<String, String>,
}

/// Whether collision shapes come along.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Collide {
    On,
    Off,
}

impl Assembly {
    /// The bodies, nodes, shapes, loops and couplings of a description as an assembly of this name. Loaded on its own, it
    /// gives the description's mechanism bit for bit, its bodies, loops and couplings named `NAME/..`.
    #[must_use]
    pub fn from_description(name: &str, d: &Description) -> Converted {
        convert(name, d, Collide::On)
    }
}

/// The same, with or without collision shapes.
pub(crate) fn convert(name: &str, d: &Description, collide: Collide) -> Converted {
    let mut left_out = Vec::new();
    let bodies = local_names(name, d);
    let mut assembly = Assembly::new(name);
    for spec in d.builder.bodies() {
        let local = bodies[&spec.name].clone();
        let mut out = body_fields(spec, &bodies);
        let nodes = nodes(spec, &local, name, d);
        push(&mut out, "nodes", nodes);
        let shapes: Vec<Located> = (d.shapes.iter())
            .filter(|s| s.body == spec.name)
            .filter(|s| s.role == ShapeRole::Visual || collide == Collide::On)
            .filter_map(|s| shape(s, &mut left_out))
            .map(Located::from)
            .collect();
        push(&mut out, "shapes", Value::List(shapes));
        if let Some(i) = d.initial.iter().find(|i| i.body == spec.name) {
            push(&mut out, "initial", initial(&spec.hinge, &i.q));
        }
        assembly.bodies.insert(local, item(out));
    }
    let mut taken = Vec::new();
    loops(name, d, &bodies, &mut assembly, &mut taken);
    couplings(name, d, &bodies, &mut assembly, &mut taken);
    if collide == Collide::On {
        on_world(d, &mut assembly, &mut left_out);
    }
    left_out.extend(d.wheels.iter().map(|w| format!("wheel `{}`", w.body)));
    let visual = |s: &BodyShape| s.role == ShapeRole::Visual;
    let hidden = |s: &&BodyShape| match visual(s) {
        true => s.body == "world",
        false => collide == Collide::Off,
    };
    let hidden = d.shapes.iter().filter(hidden);
    left_out.extend(hidden.map(|s| format!("{:?} shape of `{}`", s.role, s.body)));
    for j in &d.joints {
        let spec = d.builder.bodies().iter().find(|b| b.name == j.body);
        let own = spec.and_then(|b| b.hinge.subhinges.get(j.subhinge));
        for (what, said, acts) in [
            ("spring", j.stiffness, 0.0),
            ("damping", j.damping, own.map_or(0.0, |s| s.damping)),
            ("friction", j.friction, own.map_or(0.0, |s| s.friction.force)),
        ] {
            if said != 0.0 && acts == 0.0 {
                left_out.push(format!("{what} of `{}`", j.name));
            }
        }
    }
    Converted { assembly, left_out, bodies }
}

fn item(fields: Vec<(String, Located)>) -> ItemForm {
    ItemForm { fields: Value::Map(fields).into(), origin: Origin::NONE }
}

/// A name of its own among those of loops and couplings.
fn own_name(name: &str, written: &str, taken: &mut Vec<String>) -> String {
    let short = written.strip_prefix(&format!("{name}/")).unwrap_or(written);
    let out = plain(short, |n| taken.iter().any(|t| t == n));
    taken.push(out.clone());
    out
}

/// Loops of the builder, and those that stand beside it.
fn loops(
    name: &str,
    d: &Description,
    bodies: &BTreeMap<String, String>,
    assembly: &mut Assembly,
    taken: &mut Vec<String>,
) {
    for l in d.builder.loops().iter().chain(&d.loops) {
        let mut out = Vec::new();
        let end = |body: &String| {
            Value::Text(bodies.get(body).map_or("world", String::as_str).to_owned())
        };
        push(&mut out, "a", end(&l.body_a));
        push(&mut out, "at_a", pose(&l.frame_a));
        push(&mut out, "b", end(&l.body_b));
        push(&mut out, "at_b", pose(&l.frame_b));
        push(&mut out, "hinge", hinge(&l.hinge));
        assembly.loops.insert(own_name(name, &l.name, taken), item(out));
    }
}

/// Couplings of the builder, and those that stand beside it.
fn couplings(
    name: &str,
    d: &Description,
    bodies: &BTreeMap<String, String>,
    assembly: &mut Assembly,
    taken: &mut Vec<String>,
) {
    for c in d.builder.couplings().iter().chain(&d.couplings) {
        let term = |t: &Term| {
            let at = &t.coordinate;
            let spec = d.builder.bodies().iter().find(|b| b.name == at.body);
            let chain = spec.map_or(&[][..], |b| &b.hinge.subhinges);
            let before = chain.iter().take(at.subhinge).filter(|s| s.kind.nv() == 1).count();
            let local = bodies.get(&at.body).unwrap_or(&at.body);
            let one = chain.iter().filter(|s| s.kind.nv() == 1).count() < 2;
            (if one { local.clone() } else { format!("{local}[{before}]") }, t.factor)
        };
        let terms: Vec<(String, f64)> = c.terms.iter().map(term).collect();
        // A map is read in the order of bodies and subhinges; a list keeps its own.
        let place = |t: &Term| (bodies.get(&t.coordinate.body), t.coordinate.subhinge);
        let written = match c.terms.is_sorted_by(|a, b| place(a) < place(b)) {
            true => {
                Value::Map(terms.into_iter().map(|(k, x)| (k, Value::Number(x).into())).collect())
            }
            false => Value::List(
                (terms.into_iter())
                    .map(|(k, x)| {
                        map(vec![
                            ("of", Value::Text(k).into()),
                            ("factor", Value::Number(x).into()),
                        ])
                    })
                    .collect(),
            ),
        };
        let mut out = Vec::new();
        push(&mut out, "terms", written);
        push(&mut out, "constant", Value::Number(c.constant));
        assembly.couplings.insert(own_name(name, &c.name, taken), item(out));
    }
}

/// Collision shapes of the world as colliders.
fn on_world(d: &Description, assembly: &mut Assembly, left_out: &mut Vec<String>) {
    let world = d.shapes.iter().filter(|s| s.body == "world" && s.role != ShapeRole::Visual);
    for s in world {
        let Some(Value::Map(fields)) = shape(s, left_out) else { continue };
        let keep = |k: &str| ["shape", "at", "color"].contains(&k);
        let mut out = vec![("on".to_owned(), Value::Text("world".into()).into())];
        out.extend(fields.into_iter().filter(|(k, _)| keep(k)));
        let written = if s.name.is_empty() { "ground" } else { &s.name };
        let key = plain(written, |n| assembly.colliders.contains_key(n));
        assembly.colliders.insert(key, item(out));
    }
}

/// Adds a field that is not empty.
fn push(out: &mut Vec<(String, Located)>, key: &str, v: Value) {
    let empty = match &v {
        Value::Null => true,
        Value::List(l) => l.is_empty(),
        Value::Map(m) => m.is_empty(),
        _ => false,
    };
    if !empty {
        out.push((key.into(), v.into()));
    }
}

/// A name that a reference can carry and that nobody has yet.
fn plain(name: &str, taken: impl Fn(&str) -> bool) -> String {
    let bad = |c: char| c.is_whitespace() || c.is_control() || "./[]*$\"'->:".contains(c);
    let mut out: String = name.chars().map(|c| if bad(c) { '_' } else { c }).collect();
    if out.is_empty() || out == "world" {
        out.push('_');
    }
    while taken(&out) {
        out.push('_');
    }
    out
}

fn local_names(name: &str, d: &Description) -> BTreeMap<String, String> {
    let mut out: BTreeMap<String, String> = BTreeMap::new();
    let mut taken: Vec<String> = Vec::new();
    let prefix = format!("{name}/");
    let short = |n: &str| n.strip_prefix(&prefix).unwrap_or(n).to_owned();
    // Names that can stay come first, so that nothing takes them.
    let mut names: Vec<&str> = d.builder.bodies().iter().map(|b| b.name.as_str()).collect();
    names.sort_by_key(|n| (plain(&short(n), |_| false) != short(n), *n));
    for n in names {
        let local = plain(&short(n), |l| taken.iter().any(|t| t == l));
        taken.push(local.clone());
        out.insert(n.to_owned(), local);
    }
    out
}

pub(crate) fn list(x: impl IntoIterator<Item = f64>) -> Value {
    Value::List(x.into_iter().map(|x| Value::Number(x).into()).collect())
}

pub(crate) fn vector(v: &Vec3) -> Value {
    list(v.iter().copied())
}

/// `Null` for the identity.
pub(crate) fn pose(X: &Pose) -> Value {
    let mut out = Vec::new();
    if X.position != Vec3::zeros() {
        push(&mut out, "position", vector(&X.position));
    }
    if X.rotation != Pose::identity().rotation {
        let q = X.rotation.coords;
        let quat = vec![("quat".to_owned(), list([q.x, q.y, q.z, q.w]).into())];
        push(&mut out, "rotation", Value::Map(quat));
    }
    Value::Map(out)
}

fn body_fields(spec: &BodySpec, names: &BTreeMap<String, String>) -> Vec<(String, Located)> {
    let mut out = Vec::new();
    let parent = names.get(&spec.parent).map_or("world", String::as_str);
    push(&mut out, "parent", Value::Text(parent.into()));
    push(&mut out, "at", pose(&spec.hinge_in_parent));
    push(&mut out, "hinge_frame", pose(&spec.hinge_in_body));
    push(&mut out, "hinge", hinge(&spec.hinge));
    mass(&mut out, &spec.mass);
    if let Some(m) = &spec.modes {
        push(&mut out, "modes", modes::value(m));
    }
    out
}

fn hinge(h: &Hinge) -> Value {
    match &h.subhinges[..] {
        [] => Value::Null,
        [one] if one.kind != SubhingeKind::Locked => subhinge(one),
        many => {
            let links = many.iter().map(|s| subhinge(s).into()).collect();
            Value::Variant("Chain".into(), Box::new(Value::List(links).into()))
        }
    }
}

fn subhinge(s: &Subhinge) -> Value {
    let mut out = Vec::new();
    let name = match &s.kind {
        SubhingeKind::Pin { axis } => ("Pin", Some(axis)),
        SubhingeKind::Slider { axis } => ("Slider", Some(axis)),
        SubhingeKind::Screw { axis, .. } => ("Screw", Some(axis)),
        SubhingeKind::Ball => ("Ball", None),
        SubhingeKind::Free => ("Free", None),
        SubhingeKind::Locked => ("Locked", None),
    };
    if let Some(axis) = name.1 {
        push(&mut out, "axis", vector(axis));
    }
    if let SubhingeKind::Screw { pitch, .. } = s.kind {
        push(&mut out, "pitch", Value::Number(pitch));
    }
    if s.coordinate == Coordinate::Prescribed {
        push(&mut out, "prescribed", Value::Bool(true));
    }
    if s.armature != 0.0 {
        push(&mut out, "armature", Value::Number(s.armature));
    }
    if s.gear != 1.0 {
        push(&mut out, "gear", Value::Number(s.gear));
    }
    push(&mut out, "limits", limits(&s.limits));
    resistances(s, &mut out);
    if out.is_empty() { variant(name.0, Value::Null) } else { variant(name.0, Value::Map(out)) }
}

/// Stop, damping and friction.
fn resistances(s: &Subhinge, out: &mut Vec<(String, Located)>) {
    let pair = |a: &str, x: f64, b: &str, y: f64| {
        let number = |x| Located::from(Value::Number(x));
        Value::Map(vec![(a.to_owned(), number(x)), (b.to_owned(), number(y))])
    };
    match s.stop {
        Stop::Usual => {}
        Stop::Off => push(out, "stop", Value::Bool(false)),
        Stop::Soft { stiffness, damping } => {
            push(out, "stop", pair("stiffness", stiffness, "damping", damping));
        }
    }
    if s.damping != 0.0 {
        push(out, "damping", Value::Number(s.damping));
    }
    let Friction { force, rate } = s.friction;
    if s.friction != Friction::NONE {
        push(out, "friction", pair("force", force, "rate", rate));
    }
}

fn limits(l: &Limits) -> Value {
    let mut out = Vec::new();
    for (key, x) in [("lower", l.lower), ("upper", l.upper), ("rate", l.rate), ("effort", l.effort)]
    {
        if x.is_finite() {
            push(&mut out, key, Value::Number(x));
        }
    }
    Value::Map(out)
}

pub(crate) fn mass(out: &mut Vec<(String, Located)>, m: &MassProperties) {
    let J = &m.inertia_com;
    if m.mass != 0.0 {
        push(out, "mass", Value::Number(m.mass));
    }
    if m.com != Vec3::zeros() {
        push(out, "com", vector(&m.com));
    }
    if m.mass != 0.0 || J.amax() != 0.0 {
        let off = J[(0, 1)] != 0.0 || J[(0, 2)] != 0.0 || J[(1, 2)] != 0.0;
        let inertia = match (*J == J.transpose(), off) {
            (false, _) => list(J.transpose().iter().copied()),
            (true, false) => vector(&J.diagonal()),
            (true, true) => {
                list([J[(0, 0)], J[(1, 1)], J[(2, 2)], J[(0, 1)], J[(0, 2)], J[(1, 2)]])
            }
        };
        push(out, "inertia", inertia);
    }
    if m.check == InertiaCheck::PositiveMoments {
        push(out, "inertia_check", variant("PositiveMoments", Value::Null));
    }
}

fn nodes(spec: &BodySpec, local: &str, name: &str, d: &Description) -> Value {
    let mut out: Vec<(String, Located)> = Vec::new();
    let prefixes = [format!("{name}/{local}/"), format!("{}/", spec.name)];
    for n in d.builder.nodes().iter().filter(|n| n.body == spec.name) {
        let short = prefixes.iter().find_map(|p| n.name.strip_prefix(p.as_str()));
        let key = plain(short.unwrap_or(&n.name), |k| out.iter().any(|(o, _)| o == k));
        out.push((key, pose(&n.pose).into()));
    }
    Value::Map(out)
}

fn shape(s: &BodyShape, left_out: &mut Vec<String>) -> Option<Value> {
    let number = Value::Number;
    let collides = s.role != ShapeRole::Visual;
    let of = |name: &str, fields: Vec<(&str, Value)>| {
        let fields = fields.into_iter().map(|(k, v)| (k.to_owned(), v.into())).collect();
        variant(name, Value::Map(fields))
    };
    let positive = |sizes: &[f64]| sizes.iter().all(|x| *x > 0.0);
    let solid = match &s.geometry {
        Geometry::Box { size } if positive(size) => Some(variant("Box", list(*size))),
        Geometry::Sphere { radius } if positive(&[*radius]) => {
            Some(variant("Sphere", number(*radius)))
        }
        Geometry::Cylinder { radius, length } if positive(&[*radius, *length]) => {
            Some(of("Cylinder", vec![("radius", number(*radius)), ("length", number(*length))]))
        }
        Geometry::Capsule { radius, length } if positive(&[*radius, *length]) => {
            Some(of("Capsule", vec![("radius", number(*radius)), ("length", number(*length))]))
        }
        Geometry::Mesh { path: Some(path), scale: [x, y, z], .. }
            if (x == y && y == z) || (collides && *x * *y * *z > 0.0) =>
        {
            let stl = path.extension().is_some_and(|e| e.eq_ignore_ascii_case("stl"));
            let path = std::path::absolute(path).unwrap_or_else(|_| path.clone());
            let file = Value::Text(path.display().to_string());
            let scale = if x == y && y == z { number(*x) } else { list([*x, *y, *z]) };
            let readable = stl || !collides;
            readable.then(|| of("Mesh", vec![("file", file), ("scale", scale)]))
        }
        Geometry::Plane { .. } if collides => Some(variant("HalfSpace", Value::Null)),
        _ => None,
    };
    let Some(solid) = solid else {
        left_out.push(format!("shape of `{}`: {:?}", s.body, s.geometry));
        return None;
    };
    let mut out = Vec::new();
    push(&mut out, "shape", solid);
    push(&mut out, "at", pose(&s.pose));
    if let Some(c) = s.color {
        push(&mut out, "color", list(c.map(|x| x.clamp(0.0, 1.0))));
    }
    if !s.name.is_empty() {
        push(&mut out, "name", Value::Text(s.name.replace('$', "_")));
    }
    if collides {
        push(&mut out, "collide", Value::Bool(true));
        push(&mut out, "visible", Value::Bool(false));
    }
    Some(Value::Map(out))
}

/// A hinge's numbers of q in the words of its kind.
fn initial(h: &Hinge, q: &[f64]) -> Value {
    let quat = |q: &[f64]| Value::Map(vec![("quat".to_owned(), list(q.iter().copied()).into())]);
    let mut out: Located = Value::Map(Vec::new()).into();
    let mut put = |key: &str, v: Value| set(&mut out, &[key.to_owned()], &v.into());
    match &h.subhinges[..] {
        [] => {}
        [s] if s.kind == SubhingeKind::Free && q.len() == 7 => {
            put("position", list(q[..3].iter().copied()));
            put("rotation", quat(&q[3..]));
        }
        [s] if s.kind == SubhingeKind::Ball => put("rotation", quat(q)),
        [s] if matches!(s.kind, SubhingeKind::Slider { .. }) => put("position", list1(q)),
        [s] if s.kind.nv() == 1 => put("angle", list1(q)),
        _ => put("coordinates", list(q.iter().copied())),
    }
    out.value
}

fn list1(q: &[f64]) -> Value {
    Value::Number(q.first().copied().unwrap_or(0.0))
}
