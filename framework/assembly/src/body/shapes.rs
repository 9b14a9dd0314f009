//! The shapes of a body: visual shapes and collision shapes.
use crate::body::collider::{Collider, Surface};
use crate::body::solid::{colliding, only_collides, seen};
use crate::schema::describe::Schema;
use crate::schema::kind::{At, Kind, What, color, flag, number, raw, text, vector};
use crate::schema::read::{fields, list};
use crate::schema::record::{Presence, Record, argument, of, record, variant_of};
use crate::text::report::Cx;
use crate::text::value::{Text, list as list_value, variant};
use linkwork_collision::VisualShape;
use linkwork_runtime::{Located, Origin, Value};
use linkwork_spatial::{Pose, Quat, Vec3};

/// A visual shape of a body.
#[derive(Clone, Debug, PartialEq)]
pub struct BodyShape {
    /// Full name of the body.
    pub body: String,
    /// The shape's frame in the body.
    pub pose: Pose,
    /// The geometry.
    pub shape: VisualShape,
    /// Red, green, blue, opacity in 0 … 1.
    pub color: Option<[f64; 4]>,
    /// Name, unique on its body.
    pub name: String,
}

record! {
    /// A shape with its frame.
    struct Framed: "shape" {
        /// The shape.
        shape: Located = raw(any_shape).need("write `shape: Sphere(0.1)`"),
        /// Its frame in the body.
        at: Pose = of::<Pose>().or(Pose::identity()),
        /// Red, green, blue, opacity.
        color: Option<[f64; 4]> = color().maybe(),
        /// Its name, unique on its body.
        name: Option<Text> = text().maybe(),
    }
}
record! {
    /// A box from the origin of its frame to a point: its x axis is directed at the point, its y axis is horizontal.
    struct Bar: "bar" {
        /// The point.
        to: Vec3 = vector("m").need("write `Bar(to: [1, 0, 0], width: 0.1, height: 0.1)`"),
        /// Whole length along y.
        width: f64 = number("m").positive().need("write `width: ..` in m"),
        /// Whole length along z.
        height: f64 = number("m").positive().need("write `height: ..` in m"),
    }
}
record! {
    /// Fields of a shape that can collide.
    struct Touch: "touch" {
        /// `true`, or its collision properties.
        collide: Option<Located> = raw(|| Schema::Any(vec![Schema::Flag, Collide::describe()])).maybe(),
        /// Whether it is visible.
        visible: bool = flag().or(true),
    }
}
record! {
    struct OwnShape: "collide" {
        /// A separate collision shape.
        shape: Option<Located> = raw(|| seen().describe()).maybe(),
    }
}
type Collide = (OwnShape, Surface);

/// Returns the schema of `shape`: visual and collision shapes, and bars.
fn any_shape() -> Schema {
    Schema::Any(vec![seen().describe(), variant_of::<Bar>("Bar", "")])
}

/// Converts a bar to a box, with the box's frame in that of the shape; returns other shapes unchanged. `None`: a fault was added.
fn straight(cx: &mut Cx, shape: Located, at: &At<'_>) -> Option<(Located, Pose)> {
    let Value::Variant(kind, inner) = &shape.value else { return Some((shape, Pose::identity())) };
    if kind != "Bar" {
        return Some((shape, Pose::identity()));
    }
    let at = At { origin: Some(shape.origin), ..at.field("Bar") };
    let Bar { to, width, height } = argument(cx, inner, &at, "")?;
    if !(to.norm() > 0.0) {
        let message = format!("{} has the length zero", at.what);
        cx.fault(shape.origin, message, "write another point in `to`");
        return None;
    }
    let pitch = -to.z.atan2(to.x.hypot(to.y));
    let turn = Quat::from_euler_angles(0.0, pitch, to.y.atan2(to.x));
    let size = list_value([to.norm(), width, height]);
    let value = variant("Box", size);
    Some((Located { value, origin: shape.origin }, Pose::new(turn, 0.5 * to)))
}

/// Returns the schema of `shapes` of a body.
pub(crate) fn schema() -> Schema {
    let framed = <(Framed, Touch)>::describe();
    Schema::List(Box::new(Schema::Any(vec![framed, any_shape()])), None)
}

/// The shapes of a body: visual shapes, and collision shapes with their index in the list.
#[derive(Default)]
pub(crate) struct Shapes {
    pub shown: Vec<BodyShape>,
    pub colliders: Vec<(usize, Collider)>,
}

/// Reads the shapes of a body; only visual shapes if files cannot be used.
pub(crate) fn shapes(cx: &mut Cx, v: &Located, body: &str, at: &At<'_>) -> Shapes {
    let (mut out, mut taken) = (Shapes::default(), Vec::<String>::new());
    for (k, item) in list(cx, v, format!("`{body}`: `shapes`")).iter().enumerate() {
        let at =
            At { what: What::Named(format!("`{body}`: shape {}", k + 1).into()), ..at.clone() };
        let (mut framed, touch) = match (&item.value, at.near.is_some()) {
            (Value::Map(_), true) => match <(Framed, Touch)>::read(cx, item, &at) {
                Some(both) => both,
                None => continue,
            },
            (Value::Map(_), false) => match Framed::read(cx, item, &at) {
                Some(framed) => (framed, Touch { collide: None, visible: true }),
                None => continue,
            },
            _ => {
                let shape = item.clone();
                let framed = Framed { shape, at: Pose::identity(), color: None, name: None };
                (framed, Touch { collide: None, visible: true })
            }
        };
        let origin = if item.origin == Origin::NONE { framed.shape.origin } else { item.origin };
        let Some((shape, X)) = straight(cx, framed.shape, &at) else { continue };
        (framed.shape, framed.at) = (shape, framed.at * X);
        let mut name = framed.name.map_or_else(|| format!("shape{}", k + 1), |t| t.text);
        while taken.contains(&name) {
            name.push('_');
        }
        taken.push(name.clone());
        let full = format!("{body}/{name}");
        let entry = entry(cx, &framed.shape, &touch, &at);
        if let Some((shape, turn)) = entry.shown {
            let pose = framed.at * Pose::rotation(turn);
            out.shown.push(BodyShape { body: body.into(), pose, shape, color: framed.color, name });
        }
        if let Some(((shape, turn), surface)) = entry.collides {
            let X = framed.at * Pose::rotation(turn);
            out.colliders.push((k, Collider::new(&full, body, X, shape, surface, origin)));
        }
    }
    out
}

/// Result of one entry of `shapes`.
#[derive(Default)]
struct Entry {
    shown: Option<(VisualShape, Quat)>,
    collides: Option<((linkwork_collision::Shape, Quat), Surface)>,
}

fn entry(cx: &mut Cx, shape: &Located, touch: &Touch, at: &At<'_>) -> Entry {
    let collide = touch.collide.as_ref().filter(|c| c.value != Value::Bool(false));
    let only = only_collides(shape);
    if only && collide.is_none() {
        let message = format!("{}: this shape cannot be shown", at.what);
        cx.fault(shape.origin, message, "add `collide: true`, or use another solid");
        return Entry::default();
    }
    let mut out = Entry::default();
    if touch.visible && !only {
        out.shown = seen().read(cx, shape, at);
        if out.shown.is_none() {
            return out;
        }
    }
    let Some(collide) = collide else { return out };
    let at = at.field("collide");
    let (own, surface) = match &collide.value {
        Value::Bool(_) => (None, Surface::read_fields(cx, &Value::Null.into(), &at)),
        Value::Map(_) => {
            fields(cx, collide, &at.what, &Collide::names());
            (collide.get("shape"), Surface::read_fields(cx, collide, &at))
        }
        other => {
            let message = format!("{} cannot be {}", at.what, other.what());
            let help = "write `collide: true` or `collide: (friction: 0.6)`";
            cx.fault(collide.origin, message, help);
            return out;
        }
    };
    let geometry = match own {
        Some(own) => colliding().read(cx, own, &at.field("shape")),
        None => colliding().read(cx, shape, &at),
    };
    out.collides = geometry.zip(surface);
    out
}
