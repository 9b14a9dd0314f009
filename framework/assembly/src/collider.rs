//! Colliders as written: of a body's `shapes`, and of `colliders`, with their groups and surfaces.
use crate::collision::{self, Place};
use crate::context::{Cx, Text};
use crate::expand::{Instance, ItemInst};
use crate::files::Files;
use crate::flatten::anchor;
use crate::pose::pose;
use crate::read::{fields, flag, list, number, text};
use crate::reference::full_name;
use crate::shape::{self, BodyShape};
use linkwork_collision::{ColliderSpec, Shape, Visibility};
use linkwork_runtime::{Located, Origin, Value};
use linkwork_spatial::{Pose, Quat};
use std::collections::BTreeMap;

/// The fields of a collider of its own.
pub(crate) const FIELDS: [&str; 13] = [
    "on",
    "shape",
    "at",
    "color",
    "visible",
    "padding",
    "group",
    "meets",
    "friction",
    "restitution",
    "hidden",
    "coarse",
    "doc",
];
/// The fields of `collide` of a body's shape.
const COLLIDE: [&str; 8] =
    ["shape", "padding", "group", "meets", "friction", "restitution", "hidden", "coarse"];

/// A collider, ready but for its groups and what it takes from `contact`.
#[derive(Clone, Debug)]
pub(crate) struct Collider {
    pub spec: ColliderSpec,
    /// Groups that it is in; none: `default`.
    pub groups: Vec<Text>,
    /// Groups that it meets; `None`: all.
    pub meets: Option<Vec<Text>>,
    pub friction: Option<f64>,
    pub restitution: Option<f64>,
    pub origin: Origin,
}

impl Collider {
    fn new(
        name: String,
        body: &str,
        X: Pose,
        geometry: Shape,
        options: Options,
        o: Origin,
    ) -> Self {
        let mut spec = ColliderSpec::new(name, body, geometry).at(X);
        spec.coarse = options.coarse;
        spec.padding = options.padding;
        spec.hidden = options.hidden;
        Collider {
            spec,
            groups: options.groups,
            meets: options.meets,
            friction: options.friction,
            restitution: options.restitution,
            origin: o,
        }
    }
}

struct Options {
    padding: f64,
    groups: Vec<Text>,
    meets: Option<Vec<Text>>,
    friction: Option<f64>,
    restitution: Option<f64>,
    hidden: Visibility,
    coarse: Option<Shape>,
}

/// A number in a range, or a fault.
pub(crate) fn within(
    cx: &mut Cx,
    v: &Located,
    what: &str,
    unit: &str,
    (low, high): (f64, f64),
) -> Option<f64> {
    let x = number(cx, v, what, unit)?;
    if x >= low && x <= high {
        return Some(x);
    }
    let help = match high.is_finite() {
        true => format!("write a number from {low} to {high}"),
        false => format!("write {low} or more"),
    };
    cx.fault(v.origin, format!("{what} is {x}"), help);
    None
}

/// One name or a list of names.
fn names(cx: &mut Cx, v: &Located, what: &str) -> Vec<Text> {
    if let Value::Text(t) = &v.value {
        return vec![Text { text: t.clone(), origin: v.origin }];
    }
    list(cx, v, what).to_vec().iter().filter_map(|item| text(cx, item, what)).collect()
}

fn options(cx: &mut Cx, v: &Located, what: &str, files: Place<'_>) -> Options {
    let positive = (0.0, f64::INFINITY);
    let mut of = |field: &str, unit: &str, range| {
        within(cx, v.get(field)?, &format!("{what}: `{field}`"), unit, range)
    };
    let padding = of("padding", "m", positive).unwrap_or(0.0);
    let (friction, restitution) = (of("friction", "", positive), of("restitution", "", (0.0, 1.0)));
    let groups = v.get("group").map(|g| names(cx, g, &format!("{what}: `group`")));
    let meets = v.get("meets").map(|g| names(cx, g, &format!("{what}: `meets`")));
    let hidden = v.get("hidden").and_then(|h| flag(cx, h, &format!("{what}: `hidden`")));
    let coarse = v.get("coarse").and_then(|c| {
        let what = format!("{what}: `coarse`");
        if let Value::Variant(_, inner) = &c.value
            && let Some(axis) = inner.get("axis")
        {
            cx.fault(
                axis.origin,
                format!("{what} stands in the frame of the fine shape, so it has no `axis`"),
                "leave the axis out",
            );
            return None;
        }
        collision::read(cx, c, &what, Some(files)).map(|c| c.0)
    });
    Options {
        padding,
        groups: groups.unwrap_or_default(),
        meets,
        friction,
        restitution,
        hidden: if hidden == Some(true) { Visibility::Hidden } else { Visibility::Shown },
        coarse,
    }
}

/// What one entry of `shapes` gives.
#[derive(Default)]
pub(crate) struct Entry {
    pub shown: Option<(shape::Shape, Quat)>,
    pub collider: Option<Collider>,
}

/// The collider of a shape with `collide`, and the shape if it is to be seen. `solid` is its geometry, `named` its name.
pub(crate) fn of_shape(
    cx: &mut Cx,
    (item, solid): (&Located, &Located),
    (body, named, what): (&str, &str, &str),
    at: Pose,
    files: Place<'_>,
) -> Entry {
    let collide = match item.get("collide") {
        Some(c) if c.value == Value::Bool(false) || c.value == Value::Null => None,
        other => other,
    };
    let flagged = item.get("visible").and_then(|v| flag(cx, v, &format!("{what}: `visible`")));
    let shown = match (flagged, collision::only_collides(solid), collide) {
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
        _ => match shape::shape(cx, solid, what, Some(files)) {
            Some(shown) => Some(shown),
            None => return Entry::default(),
        },
    };
    let Some(collide) = collide else { return Entry { shown, collider: None } };
    let what = format!("{what}: `collide`");
    let own = match &collide.value {
        Value::Bool(_) => None,
        Value::Map(_) => {
            fields(cx, collide, &what, &COLLIDE);
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
    let geometry = collision::read(cx, own.unwrap_or(solid), &what_shape, Some(files));
    let options = options(cx, collide, &what, files);
    let origin = if item.origin == Origin::NONE { solid.origin } else { item.origin };
    let collider = geometry.map(|(geometry, turn)| {
        let (name, X) = (format!("{body}/{named}"), at * Pose::rotation(turn));
        Collider::new(name, body, X, geometry, options, origin)
    });
    Entry { shown, collider }
}

/// What `colliders` give.
#[derive(Default)]
pub(crate) struct Standing {
    pub colliders: Vec<Collider>,
    pub shapes: Vec<BodyShape>,
    /// Full name → reference of its body from the top.
    pub references: BTreeMap<String, String>,
}

/// Every entry of every `colliders`.
pub(crate) fn standing(
    cx: &mut Cx,
    root: &Instance,
    instances: &[&Instance],
    files: &Files<'_>,
    bodies: &crate::constraints::Bodies,
) -> Standing {
    let mut out = Standing::default();
    for here in instances {
        for (name, item) in &here.colliders {
            let full = full_name(&here.path, name);
            one(cx, root, (here, &full, item), files, bodies, &mut out);
        }
    }
    out
}

fn one(
    cx: &mut Cx,
    root: &Instance,
    (here, full, item): (&Instance, &str, &ItemInst),
    files: &Files<'_>,
    bodies: &crate::constraints::Bodies,
    out: &mut Standing,
) {
    let (what, v) = (format!("collider `{full}`"), &item.fields);
    let place = (files, &item.home);
    fields(cx, v, &what, &FIELDS);
    let on = match v.get("on") {
        Some(t) => text(cx, t, &format!("{what}: `on`")),
        None => {
            cx.fault(
                item.origin,
                format!("{what} has no `on`"),
                "write `on: \"world\"`, or a body",
            );
            None
        }
    };
    let found =
        on.and_then(|t| anchor(cx, root, bodies, (&here.path, &t), &format!("{what}: `on`")));
    let X = pose(cx, v.get("at"), &format!("{what}: `at`"));
    let color = v.get("color").and_then(|c| shape::rgba(cx, c, &what));
    let visible = v.get("visible").and_then(|s| flag(cx, s, &format!("{what}: `visible`")));
    let Some(solid) = v.get("shape") else {
        cx.fault(item.origin, format!("{what} has no `shape`"), "write `shape: HalfSpace`");
        return;
    };
    // A mesh is seen on a body alone: the resolved text holds its triangles and no file.
    let mesh = matches!(&solid.value, Value::Variant(kind, _) if kind == "Mesh");
    let seen = visible != Some(false) && !mesh && !collision::only_collides(solid);
    let shown = if seen { shape::shape(cx, solid, &what, Some(place)) } else { None };
    let geometry = match (&shown, seen) {
        (None, true) => None,
        _ => collision::read(cx, solid, &what, Some(place)),
    };
    let options = options(cx, v, &what, place);
    let (Some(found), Some((geometry, turn))) = (found, geometry) else { return };
    let frame = found.node.map_or(X, |node| node * X);
    out.references.insert(full.into(), found.reference);
    if let Some((shape, turn)) = shown {
        let pose = frame * Pose::rotation(turn);
        // Names of shapes are unique on their body; those of colliders are everywhere.
        out.shapes.push(BodyShape {
            body: found.body.clone(),
            pose,
            shape,
            color,
            name: full.into(),
        });
    }
    let X = frame * Pose::rotation(turn);
    out.colliders.push(Collider::new(full.into(), &found.body, X, geometry, options, item.origin));
}
