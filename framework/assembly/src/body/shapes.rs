//! The shapes of a body: what is seen, and what collides.
use crate::body::collider::{self, Collider};
use crate::body::geometry;
use crate::body::solid::{self, Shape, rgba};
use crate::schema::pose::pose;
use crate::schema::read::{fields, flag, list, text_field};
use crate::text::files::Near;
use crate::text::report::Cx;
use linkwork_runtime::{Located, Origin, Value};
use linkwork_spatial::{Pose, Quat};

/// A shape on a body, for display.
#[derive(Clone, Debug, PartialEq)]
pub struct BodyShape {
    /// Full name of the body.
    pub body: String,
    /// The shape's frame in the body.
    pub pose: Pose,
    /// What it is.
    pub shape: Shape,
    /// Red, green, blue, opacity in 0 … 1.
    pub color: Option<[f64; 4]>,
    /// Name, unique on its body.
    pub name: String,
}

/// The shapes of a body: what is seen, and what collides with the place in the list of each.
#[derive(Default)]
pub(crate) struct Shapes {
    pub shown: Vec<BodyShape>,
    pub colliders: Vec<(usize, Collider)>,
}

/// The shapes of a body.
pub(crate) fn shapes(cx: &mut Cx, v: &Located, body: &str, files: Near<'_>) -> Shapes {
    read_shapes(cx, v, body, Some(files))
}

/// Shapes without mesh files, and only to be seen.
pub(crate) fn solids(cx: &mut Cx, v: &Located, body: &str) -> Vec<BodyShape> {
    read_shapes(cx, v, body, None).shown
}

fn read_shapes(cx: &mut Cx, v: &Located, body: &str, files: Option<Near<'_>>) -> Shapes {
    let (mut out, mut taken) = (Shapes::default(), Vec::<String>::new());
    for (k, item) in list(cx, v, &format!("`{body}`: `shapes`")).iter().enumerate() {
        let what = format!("`{body}`: shape {}", k + 1);
        let framed = matches!(item.value, Value::Map(_));
        let mut at = Pose::identity();
        let (mut color, mut name, mut solid) = (None, None, Some(item));
        if framed {
            let known = ["shape", "at", "color", "name", "collide", "visible"];
            fields(cx, item, &what, if files.is_some() { &known } else { &known[..4] });
            at = pose(cx, item.get("at"), &format!("{what}: `at`"));
            color = item.get("color").and_then(|c| rgba(cx, c, &what));
            name = text_field(cx, item, "name", &what).map(|t| t.text);
            solid = item.get("shape");
            if solid.is_none() {
                cx.fault(
                    item.origin,
                    format!("{what} has no `shape`"),
                    "write `shape: Sphere(0.1)`",
                );
            }
        }
        let Some(solid) = solid else { continue };
        let mut name = name.unwrap_or_else(|| format!("shape{}", k + 1));
        while taken.contains(&name) {
            name.push('_');
        }
        let entry = match files {
            Some(files) => of_shape(cx, (item, solid), (body, &name, &what), at, files),
            None => Entry { shown: solid::shape(cx, solid, &what, None), collider: None },
        };
        out.colliders.extend(entry.collider.map(|c| (k, c)));
        if let Some((shape, turn)) = entry.shown {
            let pose = at * Pose::rotation(turn);
            out.shown.push(BodyShape { body: body.into(), pose, shape, color, name: name.clone() });
        }
        taken.push(name);
    }
    out
}

/// What one entry of `shapes` gives.
#[derive(Default)]
pub(crate) struct Entry {
    pub shown: Option<(Shape, Quat)>,
    pub collider: Option<Collider>,
}

/// The collider of a shape with `collide`, and the shape if it is to be seen. `solid` is its geometry, `named` its name.
pub(crate) fn of_shape(
    cx: &mut Cx,
    (item, solid): (&Located, &Located),
    (body, named, what): (&str, &str, &str),
    at: Pose,
    files: Near<'_>,
) -> Entry {
    let collide = match item.get("collide") {
        Some(c) if c.value == Value::Bool(false) || c.value == Value::Null => None,
        other => other,
    };
    let flagged = item.get("visible").and_then(|v| flag(cx, v, &format!("{what}: `visible`")));
    let shown = match (flagged, geometry::only_collides(solid), collide) {
        (_, true, None) => {
            let message = format!("{what}: this shape only collides");
            cx.fault(
                solid.origin,
                message,
                "add `collide: true`, or use a solid that can be shown",
            );
            return Entry::default();
        }
        (Some(false), ..) | (_, true, _) => None,
        _ => match solid::shape(cx, solid, what, Some(files)) {
            Some(shown) => Some(shown),
            None => return Entry::default(),
        },
    };
    let Some(collide) = collide else { return Entry { shown, collider: None } };
    let what = format!("{what}: `collide`");
    let own = match &collide.value {
        Value::Bool(_) => None,
        Value::Map(_) => {
            fields(cx, collide, &what, &collider::COLLIDE);
            collide.get("shape")
        }
        other => {
            let message = format!("{what} cannot be {}", other.what());
            cx.fault(
                collide.origin,
                message,
                "write `collide: true` or `collide: (friction: 0.6)`",
            );
            return Entry { shown, collider: None };
        }
    };
    let what_shape = if own.is_some() { format!("{what}: `shape`") } else { what.clone() };
    let geometry = geometry::read(cx, own.unwrap_or(solid), &what_shape, Some(files));
    let options = collider::options(cx, collide, &what, files);
    let origin = if item.origin == Origin::NONE { solid.origin } else { item.origin };
    let collider = geometry.map(|(geometry, turn)| {
        let (name, X) = (format!("{body}/{named}"), at * Pose::rotation(turn));
        Collider::new(name, body, X, geometry, options, origin)
    });
    Entry { shown, collider }
}
