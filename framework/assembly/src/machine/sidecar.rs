//! What URDF cannot say, in a RON file beside it: `robot.linkwork.ron`.
//!
//! Joints and links are named as in the file that it stands beside; a name that is not there is an error.
use crate::body::{hinge, shapes, solid};
use crate::schema::pose::{direction, pose_of};
use crate::schema::read::{fields, name, number, table, text_field};
use crate::text::parse::parse;
use crate::text::report::{Cx, tidy};
use crate::text::show::Failure;
use crate::text::value::Text;
use linkwork_formats::{
    BodyShape, Coupling, Description, Geometry, HingeCoordinate, LoopClosure, ShapeRole, Term,
    Wheel, WheelRole,
};
use linkwork_multibody::{Hinge, Limits, SubhingeKind};
use linkwork_runtime::{Located, Origin, Value, remedy};
use linkwork_spatial::{Pose, Vec3};

const FIELDS: [&str; 7] = ["doc", "joints", "couplings", "loops", "wheels", "contacts", "nodes"];

/// Reads a `SideCar(..)` text and adds what it says to a description.
///
/// # Errors
/// Everything that is wrong with it, at once; the description is then only good to be dropped.
pub fn apply_side_car(name: &str, text: &str, d: &mut Description) -> Result<(), Failure> {
    let mut cx = Cx::default();
    read(&mut cx, name, text, d);
    if cx.faults.is_empty() {
        return Ok(());
    }
    Err(Failure { faults: tidy(cx.faults), sources: cx.sources })
}

/// The same, into the faults of a load that goes on.
pub(crate) fn read(cx: &mut Cx, name: &str, text: &str, d: &mut Description) {
    let file = cx.sources.add(name, text);
    let Some(v) = parse(cx, file) else { return };
    let inner = match &v.value {
        Value::Variant(kind, inner) if kind == "SideCar" => &**inner,
        _ => {
            let help = "begin the file with `SideCar(`";
            cx.fault(v.origin, format!("`{name}` is no side-car"), help);
            return;
        }
    };
    fields(cx, inner, "the side-car", &FIELDS);
    let empty: Located = Value::Null.into();
    let of = |field: &str| inner.get(field).unwrap_or(&empty);
    for (key, v) in table(cx, of("joints"), "`joints`") {
        joint(cx, key, v, d);
    }
    for (key, v) in table(cx, of("couplings"), "`couplings`") {
        let found = coupling(cx, key, v, d);
        d.couplings.extend(found);
    }
    for (key, v) in table(cx, of("loops"), "`loops`") {
        let found = closure(cx, key, v, d);
        d.loops.extend(found);
    }
    for (key, v) in table(cx, of("wheels"), "`wheels`") {
        let found = wheel(cx, key, v, d);
        d.wheels.extend(found);
    }
    for (key, v) in table(cx, of("contacts"), "`contacts`") {
        contacts(cx, key, v, d);
    }
    for (key, v) in table(cx, of("nodes"), "`nodes`") {
        node(cx, key, v, d);
    }
}

/// The name, if a body has it.
fn body(cx: &mut Cx, at: Origin, what: &str, name: &str, d: &Description) -> Option<String> {
    let known: Vec<&str> = d.builder.bodies().iter().map(|b| b.name.as_str()).collect();
    if known.contains(&name) {
        return Some(name.to_owned());
    }
    cx.fault(at, format!("{what}: there is no link `{name}`"), remedy(name, "links", &known));
    None
}

/// The coordinate of a joint that has one.
fn coordinate(
    cx: &mut Cx,
    at: Origin,
    what: &str,
    name: &str,
    d: &Description,
) -> Option<HingeCoordinate> {
    let found = d.coordinate(name);
    if found.is_none() {
        let movable = d.joints.iter().filter(|j| j.count == 1);
        let known: Vec<&str> = movable.map(|j| j.name.as_str()).collect();
        let fact = match d.joint(name) {
            Some(_) => format!("{what}: joint `{name}` has no single coordinate"),
            None => format!("{what}: there is no joint `{name}`"),
        };
        cx.fault(at, fact, remedy(name, "joints", &known));
    }
    found
}

/// `(armature: .., gear: .., limits: (..), stop: (..), damping: .., friction: ..)`.
fn joint(cx: &mut Cx, key: &str, v: &Located, d: &mut Description) {
    let what = format!("joint `{key}`");
    fields(cx, v, &what, &hinge::OPTIONS);
    let origin = cx.key(v);
    let Some(at) = coordinate(cx, origin, "`joints`", key, d) else { return };
    let spec = d.builder.bodies_mut().iter_mut().find(|b| b.name == at.body);
    let Some(s) = spec.and_then(|b| b.hinge.subhinges.get_mut(at.subhinge)) else { return };
    hinge::options(cx, v, &what, std::slice::from_mut(s));
    let multiple = s.kind.nv() != 1;
    if (s.limits != Limits::NONE && multiple) || !s.limits.is_valid() {
        let place = v.get("limits").map_or(origin, |l| l.origin);
        let help = "lower below upper, rate and effort not negative, on a joint of one coordinate";
        cx.fault(place, format!("{what}: the limits cannot be kept"), help);
    }
    if !(s.armature >= 0.0) || (s.armature != 0.0 && s.kind == SubhingeKind::Free) {
        let place = v.get("armature").map_or(origin, |l| l.origin);
        cx.fault(place, format!("{what}: the armature is not usable"), "write 0 or more");
    }
    if s.gear == 0.0 {
        let place = v.get("gear").map_or(origin, |l| l.origin);
        cx.fault(place, format!("{what}: the gear ratio is 0"), "write turns of the rotor a turn");
    }
    for (field, x) in [("damping", s.damping), ("friction", s.friction.force)] {
        if !(x >= 0.0) {
            let place = v.get(field).map_or(origin, |l| l.origin);
            cx.fault(place, format!("{what}: `{field}` is negative"), "write 0 or more");
        }
    }
    let (damping, friction) = (s.damping, s.friction.force);
    if let Some(j) = d.joints.iter_mut().find(|j| j.name == key) {
        j.damping = if v.get("damping").is_some() { damping } else { j.damping };
        j.friction = if v.get("friction").is_some() { friction } else { j.friction };
    }
}

/// `(terms: { "left": 1, "right": 1 }, constant: 0)`: the sum of factor times coordinate is the constant.
fn coupling(cx: &mut Cx, key: &str, v: &Located, d: &Description) -> Option<Coupling> {
    let what = format!("coupling `{key}`");
    fields(cx, v, &what, &["doc", "terms", "constant"]);
    let origin = cx.key(v);
    let mut terms = Vec::new();
    let mut slides = Vec::new();
    let written = v.get("terms").map(|t| table(cx, t, &format!("{what}: `terms`")).to_vec());
    for (joint, factor) in written.iter().flatten() {
        let at = cx.key(factor);
        let found = coordinate(cx, at, &what, joint, d);
        let factor = number(cx, factor, &format!("{what}: `{joint}`"), "");
        let (Some(coordinate), Some(factor)) = (found, factor) else { continue };
        slides.push(is_slider(d, &coordinate));
        terms.push(Term { coordinate, factor });
    }
    if written.is_none_or(|w| w.is_empty()) {
        let help = "write `terms: { \"left\": 1, \"right\": 1 }`: Σ factor · coordinate = constant";
        cx.fault(origin, format!("{what} has no `terms`"), help);
        return None;
    }
    // The unit of the sum, when all terms have one.
    let unit = match (slides.iter().all(|s| *s), slides.iter().any(|s| *s)) {
        (true, true) => "m",
        (false, false) => "rad",
        _ => "",
    };
    let constant =
        v.get("constant").and_then(|c| number(cx, c, &format!("{what}: `constant`"), unit));
    Some(Coupling { name: key.into(), terms, constant: constant.unwrap_or(0.0) })
}

fn is_slider(d: &Description, at: &HingeCoordinate) -> bool {
    let body = d.builder.bodies().iter().find(|b| b.name == at.body);
    let s = body.and_then(|b| b.hinge.subhinges.get(at.subhinge));
    s.is_some_and(|s| matches!(s.kind, SubhingeKind::Slider { .. }))
}

/// `(a: (body: .., position: .., rotation: ..), b: (..), hinge: Ball)`.
fn closure(cx: &mut Cx, key: &str, v: &Located, d: &Description) -> Option<LoopClosure> {
    let what = format!("loop `{key}`");
    fields(cx, v, &what, &["doc", "a", "b", "hinge"]);
    let origin = cx.key(v);
    let mut end = |field: &str| {
        let Some(e) = v.get(field) else {
            let help = format!("write `{field}: (body: \"link\", position: [0, 0, 0])`");
            cx.fault(origin, format!("{what} has no `{field}`"), help);
            return None;
        };
        framed(cx, e, &format!("{what}: `{field}`"), d)
    };
    let (a, b) = (end("a"), end("b"));
    let hinge = match v.get("hinge") {
        Some(h) => hinge::read(cx, h, &what),
        None => Some(Hinge::locked()),
    };
    let ((body_a, frame_a), (body_b, frame_b)) = (a?, b?);
    Some(LoopClosure { name: key.into(), body_a, frame_a, body_b, frame_b, hinge: hinge? })
}

/// `(body: "link", position: .., rotation: ..)`; `world` is a body too.
fn framed(cx: &mut Cx, v: &Located, what: &str, d: &Description) -> Option<(String, Pose)> {
    fields(cx, v, what, &["doc", "body", "position", "rotation"]);
    let pose = pose_of(cx, v, what);
    let Some(Text { text, origin }) = text_field(cx, v, "body", what) else {
        cx.fault(v.origin, format!("{what} has no `body`"), "name a link");
        return None;
    };
    if text == "world" {
        return Some((text, pose));
    }
    Some((body(cx, origin, what, &text, d)?, pose))
}

/// `(radius: .., width: .., axis: [0, 1, 0], role: Driven, steering: "joint")`.
fn wheel(cx: &mut Cx, key: &str, v: &Located, d: &Description) -> Option<Wheel> {
    let what = format!("wheel `{key}`");
    fields(cx, v, &what, &["doc", "radius", "width", "axis", "role", "steering"]);
    let origin = cx.key(v);
    let link = body(cx, origin, "`wheels`", key, d);
    let mut length = |field: &str| {
        let x = v.get(field).and_then(|x| number(cx, x, &format!("{what}: `{field}`"), "m"));
        if v.get(field).is_none() || x.is_some_and(|x| x <= 0.0) {
            cx.fault(origin, format!("{what} has no `{field}` above zero"), "write it in m");
        }
        x
    };
    let (radius, width) = (length("radius"), length("width"));
    let axis = match v.get("axis") {
        Some(a) => direction(cx, a, &format!("{what}: `axis`"))?.normalize(),
        None => Vec3::y(),
    };
    let role = match v.get("role").map(|r| (&r.value, r.origin)) {
        None => WheelRole::Driven,
        Some((Value::Variant(w, _) | Value::Text(w), _)) if w == "Driven" => WheelRole::Driven,
        Some((Value::Variant(w, _) | Value::Text(w), _)) if w == "Idle" => WheelRole::Idle,
        Some((_, at)) => {
            cx.fault(at, format!("{what}: `role` is one of two words"), "one of: Driven, Idle");
            WheelRole::Driven
        }
    };
    let steering = text_field(cx, v, "steering", &what);
    if let Some(s) = &steering {
        coordinate(cx, s.origin, &format!("{what}: `steering`"), &s.text, d);
    }
    let steering = steering.map(|s| s.text);
    Some(Wheel { body: link?, axis, radius: radius?, width: width?, role, steering })
}

/// Shapes as those of a body in an assembly, by link.
fn contacts(cx: &mut Cx, key: &str, v: &Located, d: &mut Description) {
    let origin = cx.key(v);
    let Some(link) = body(cx, origin, "`contacts`", key, d) else { return };
    for s in shapes::solids(cx, v, key) {
        let geometry = match s.shape {
            solid::Shape::Cylinder { radius, length } => Geometry::Cylinder { radius, length },
            solid::Shape::Box { size } => Geometry::Box { size },
            solid::Shape::Sphere { radius } => Geometry::Sphere { radius },
            solid::Shape::Capsule { radius, length } => Geometry::Capsule { radius, length },
            solid::Shape::Mesh { file, scale } => {
                Geometry::Mesh { file, path: None, scale: [scale; 3] }
            }
        };
        let (body, name, pose, color) = (link.clone(), s.name, s.pose, s.color);
        let role = ShapeRole::Contact;
        d.shapes.push(BodyShape { body, name, role, pose, geometry, color });
    }
}

fn node(cx: &mut Cx, key: &str, v: &Located, d: &mut Description) {
    let what = format!("node `{key}`");
    name(cx, key, v, "node");
    if let Some((body, pose)) = framed(cx, v, &what, d) {
        let taken = d.builder.nodes().iter().any(|n| n.name == key);
        if body == "world" || taken {
            let fact = if taken { "is there already" } else { "is on the world" };
            cx.fault(cx.key(v), format!("{what} {fact}"), "give it another name, or a link");
        } else {
            d.builder.node(key, body, pose);
        }
    }
}
