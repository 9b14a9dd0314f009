//! Companion files in RON with data that URDF does not support: `robot.linkwork.ron`.
//!
//! Joints and links have the names of the URDF file. Unknown names are errors.
use crate::body::hinge::{self, Drive, hinge, slides};
use crate::body::shapes::{self, shapes};
use crate::schema::describe::Schema;
use crate::schema::kind::{At, Kind, direction, drive_number, number, raw, table_of, text, word};
use crate::schema::read::{fields, name, table};
use crate::schema::record::{Presence, Record, of, record};
use crate::text::parse::parse;
use crate::text::report::{Cx, tidy};
use crate::text::show::Failure;
use crate::text::value::Text;
use linkwork_collision::{Shape, VisualShape};
use linkwork_formats::{
    BodyShape, Coupling, Description, Geometry, HingeCoordinate, LoopClosure, ShapeRole, Term,
    Wheel, WheelRole,
};
use linkwork_multibody::{Hinge, Limits, SubhingeKind};
use linkwork_runtime::{Located, Origin, Value, remedy};
use linkwork_spatial::{Pose, Vec3};
use std::fmt::Display;

record! {
    struct Companion: "companion file" {
        /// Documentation.
        doc: Option<Text> = text().maybe(),
        /// Joint → additional properties of its coordinate.
        joints: Option<Located> = raw(|| table_of(of::<Drive>()).describe()).maybe(),
        /// Couplings by name.
        couplings: Option<Located> = raw(|| table_of(of::<CouplingForm>()).describe()).maybe(),
        /// Loops by name.
        loops: Option<Located> = raw(|| table_of(of::<LoopForm>()).describe()).maybe(),
        /// Link → its wheel.
        wheels: Option<Located> = raw(|| table_of(of::<WheelForm>()).describe()).maybe(),
        /// Link → collision shapes.
        contacts: Option<Located> = raw(|| Schema::Table(Box::new(shapes::schema()))).maybe(),
        /// Nodes by name.
        nodes: Option<Located> = raw(|| table_of(of::<(OnLink, Pose)>()).describe()).maybe(),
    }
}
record! {
    struct CouplingForm: "coupling of a companion file" {
        /// Documentation.
        doc: Option<Text> = text().maybe(),
        /// Joint → factor.
        terms: Vec<(Text, f64)> = table_of(number("")).or(Vec::new()),
        /// Value of the sum of factor · coordinate.
        constant: Option<Located> = raw(|| drive_number("rad", "m").describe()).maybe(),
    }
}
record! {
    struct LoopForm: "loop of a companion file" {
        /// Documentation.
        doc: Option<Text> = text().maybe(),
        /// One end.
        a: Option<(OnLink, Pose)> = of::<(OnLink, Pose)>().wanted("write `a: (body: \"link\", position: [0, 0, 0])`"),
        /// The other end.
        b: Option<(OnLink, Pose)> = of::<(OnLink, Pose)>().wanted("write `b: (body: \"link\", position: [0, 0, 0])`"),
        /// The permitted motion.
        hinge: Hinge = hinge().or(Hinge::locked()),
    }
}
record! {
    struct OnLink: "pose on a link" {
        /// Documentation.
        doc: Option<Text> = text().maybe(),
        /// Link, or `world`.
        body: Text = text().need("name a link"),
    }
}
record! {
    struct WheelForm: "wheel" {
        /// Documentation.
        doc: Option<Text> = text().maybe(),
        /// Radius.
        radius: f64 = number("m").positive().need("write `radius: ..` in m"),
        /// Width.
        width: f64 = number("m").positive().need("write `width: ..` in m"),
        /// Axle, in the link's frame.
        axis: Vec3 = direction().or(Vec3::y()),
        /// Whether it is driven.
        role: WheelRole = word(&[("Driven", WheelRole::Driven), ("Idle", WheelRole::Idle)]).or(WheelRole::Driven),
        /// Steering joint.
        steering: Option<Text> = text().maybe(),
    }
}

/// Returns the schema of companion files.
pub(crate) fn schema() -> Schema {
    Schema::Variant("Companion", Box::new(Companion::describe()))
}

/// Reads a `Companion(..)` text and adds its data to a description.
///
/// # Errors
/// All mistakes; the description must not be used after an error.
pub fn apply_companion(name: &str, text: &str, d: &mut Description) -> Result<(), Failure> {
    let mut cx = Cx::default();
    read(&mut cx, name, text, d);
    if cx.faults.is_empty() {
        return Ok(());
    }
    Err(Failure { faults: tidy(cx.faults), sources: cx.sources })
}

/// Like [`apply_companion`], with faults added to those of a load.
pub(crate) fn read(cx: &mut Cx, name: &str, text: &str, d: &mut Description) {
    let file = cx.sources.add(name, text);
    let Some(v) = parse(cx, file) else { return };
    let inner = match &v.value {
        Value::Variant(kind, inner) if kind == "Companion" => &**inner,
        Value::Variant(kind, _) if kind == "SideCar" => {
            let help = "begin the file with `Companion(`";
            cx.fault(v.origin, format!("`{name}`: `SideCar` was renamed"), help);
            return;
        }
        _ => {
            let help = "begin the file with `Companion(`";
            cx.fault(v.origin, format!("`{name}` is not a companion file"), help);
            return;
        }
    };
    fields(cx, inner, "the companion file", &Companion::names());
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

/// Returns the name if a body has it.
fn body(
    cx: &mut Cx,
    at: Origin,
    what: impl Display,
    name: &str,
    d: &Description,
) -> Option<String> {
    let known: Vec<&str> = d.builder.bodies().iter().map(|b| b.name.as_str()).collect();
    if known.contains(&name) {
        return Some(name.to_owned());
    }
    cx.fault(at, format!("{what}: there is no link `{name}`"), remedy(name, "links", &known));
    None
}

/// Returns the coordinate of a joint with one degree of freedom.
fn coordinate(
    cx: &mut Cx,
    at: Origin,
    what: impl Display,
    name: &str,
    d: &Description,
) -> Option<HingeCoordinate> {
    let found = d.coordinate(name);
    if found.is_none() {
        let movable = d.joints.iter().filter(|j| j.count == 1);
        let known: Vec<&str> = movable.map(|j| j.name.as_str()).collect();
        let fact = match d.joint(name) {
            Some(_) => format!("{what}: joint `{name}` does not have exactly one coordinate"),
            None => format!("{what}: there is no joint `{name}`"),
        };
        cx.fault(at, fact, remedy(name, "joints", &known));
    }
    found
}

/// Applies `(armature: .., gear: .., limits: (..), stop: (..), damping: .., friction: ..)`.
fn joint(cx: &mut Cx, key: &str, v: &Located, d: &mut Description) {
    let (what, origin) = (format!("joint `{key}`"), cx.key(v));
    fields(cx, v, &what, &Drive::names());
    let Some(at) = coordinate(cx, origin, "`joints`", key, d) else { return };
    let spec = d.builder.bodies_mut().iter_mut().find(|b| b.name == at.body);
    let Some(s) = spec.and_then(|b| b.hinge.subhinges.get_mut(at.subhinge)) else { return };
    hinge::options(cx, v, &At::new(&*what), std::slice::from_mut(s));
    let multiple = s.kind.nv() != 1;
    if (s.limits != Limits::NONE && multiple) || !s.limits.is_valid() {
        let place = v.get("limits").map_or(origin, |l| l.origin);
        let help = "lower must be below upper, rate and effort not negative, and the joint must have one coordinate";
        cx.fault(place, format!("{what}: the limits are not valid"), help);
    }
    if !(s.armature >= 0.0) || (s.armature != 0.0 && s.kind == SubhingeKind::Free) {
        let place = v.get("armature").map_or(origin, |l| l.origin);
        cx.fault(
            place,
            format!("{what}: the armature is negative or not finite"),
            "write 0 or more",
        );
    }
    if s.gear == 0.0 {
        let place = v.get("gear").map_or(origin, |l| l.origin);
        cx.fault(
            place,
            format!("{what}: the gear ratio is 0"),
            "write revolutions of the rotor per revolution of the joint",
        );
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

/// Adds `(terms: { "left": 1, "right": 1 }, constant: 0)`: the sum of factor times coordinate equals the constant.
fn coupling(cx: &mut Cx, key: &str, v: &Located, d: &Description) -> Option<Coupling> {
    let at = At::new(format!("coupling `{key}`")).origin(cx.key(v));
    let form = CouplingForm::read(cx, v, &at)?;
    let mut terms = Vec::new();
    for (joint, factor) in form.terms {
        let found = coordinate(cx, joint.origin, &at.what, &joint.text, d);
        terms.extend(found.map(|coordinate| Term { coordinate, factor }));
    }
    if terms.is_empty() && v.get("terms").is_none_or(|t| crate::text::value::entries(t).is_empty())
    {
        let help = "write `terms: { \"left\": 1, \"right\": 1 }`: Σ factor · coordinate = constant";
        cx.fault(cx.key(v), format!("{} has no `terms`", at.what), help);
        return None;
    }
    // Use the unit of the sum if all terms have the same unit.
    let lengths = terms.iter().filter(|t| is_slider(d, &t.coordinate)).count();
    let unit = match lengths {
        0 => number("rad"),
        n if n == terms.len() => number("m"),
        _ => number(""),
    };
    let constant = form.constant.and_then(|c| unit.read(cx, &c, &at.field("constant")));
    Some(Coupling::linear(key, terms, constant.unwrap_or(0.0)))
}

fn is_slider(d: &Description, at: &HingeCoordinate) -> bool {
    let body = d.builder.bodies().iter().find(|b| b.name == at.body);
    let s = body.and_then(|b| b.hinge.subhinges.get(at.subhinge));
    s.is_some_and(|s| slides(&s.kind))
}

/// Adds `(a: (body: .., position: .., rotation: ..), b: (..), hinge: Ball)`.
fn closure(cx: &mut Cx, key: &str, v: &Located, d: &Description) -> Option<LoopClosure> {
    let at = At::new(format!("loop `{key}`")).origin(cx.key(v));
    let form = LoopForm::read(cx, v, &at)?;
    let mut end = |end: Option<(OnLink, Pose)>, field: &str| {
        let (on, frame) = end?;
        Some((on_link(cx, &on, &at.field(field).what, d)?, frame))
    };
    let (a, b) = (end(form.a, "a"), end(form.b, "b"));
    let ((body_a, frame_a), (body_b, frame_b)) = (a?, b?);
    Some(LoopClosure { name: key.into(), body_a, frame_a, body_b, frame_b, hinge: form.hinge })
}

/// Returns the named link; `world` is also allowed.
fn on_link(cx: &mut Cx, on: &OnLink, what: impl Display, d: &Description) -> Option<String> {
    let Text { text, origin } = &on.body;
    if text == "world" { Some(text.clone()) } else { body(cx, *origin, what, text, d) }
}

/// Adds `(radius: .., width: .., axis: [0, 1, 0], role: Driven, steering: "joint")`.
fn wheel(cx: &mut Cx, key: &str, v: &Located, d: &Description) -> Option<Wheel> {
    let at = At::new(format!("wheel `{key}`")).origin(cx.key(v));
    let link = body(cx, cx.key(v), "`wheels`", key, d);
    let form = WheelForm::read(cx, v, &at)?;
    if let Some(s) = &form.steering {
        coordinate(cx, s.origin, &at.field("steering").what, &s.text, d);
    }
    let WheelForm { radius, width, axis, role, steering, .. } = form;
    let (axis, steering) = (axis.normalize(), steering.map(|s| s.text));
    Some(Wheel { body: link?, axis, radius, width, role, steering })
}

/// Adds shapes by link, in the form of the shapes of a body in an assembly.
fn contacts(cx: &mut Cx, key: &str, v: &Located, d: &mut Description) {
    let Some(link) = body(cx, cx.key(v), "`contacts`", key, d) else { return };
    for s in shapes(cx, v, key, &At::new(key)).shown {
        let geometry = match s.shape {
            VisualShape::Shape(Shape::Cylinder { radius, half_length }) => {
                Geometry::Cylinder { radius, length: 2.0 * half_length }
            }
            VisualShape::Shape(Shape::Capsule { radius, half_length }) => {
                Geometry::Capsule { radius, length: 2.0 * half_length }
            }
            VisualShape::Shape(Shape::Box { half }) => Geometry::Box { size: (2.0 * half).into() },
            VisualShape::Shape(Shape::Sphere { radius }) => Geometry::Sphere { radius },
            VisualShape::Shape(Shape::Ellipsoid { half }) => {
                Geometry::Ellipsoid { radii: half.into() }
            }
            // Other shapes have already been rejected with an error.
            _ => continue,
        };
        let shape = BodyShape::new(&link, ShapeRole::Contact, s.pose, geometry);
        d.shapes.push(BodyShape { name: s.name, color: s.color, ..shape });
    }
}

fn node(cx: &mut Cx, key: &str, v: &Located, d: &mut Description) {
    let (what, origin) = (format!("node `{key}`"), cx.key(v));
    name(cx, key, origin, "node");
    let form = <(OnLink, Pose)>::read(cx, v, &At::new(&*what).origin(origin));
    let Some((on, pose)) = form else { return };
    if let Some(body) = on_link(cx, &on, &what, d) {
        let taken = d.builder.nodes().iter().any(|n| n.name == key);
        if body == "world" || taken {
            let (fact, help) = match taken {
                true => ("already exists", "choose another name"),
                false => ("is attached to the world", "attach it to a link"),
            };
            cx.fault(origin, format!("{what} {fact}"), help);
        } else {
            d.builder.node(key, body, pose);
        }
    }
}
