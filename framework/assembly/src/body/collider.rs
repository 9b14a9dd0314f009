//! Colliders as written, with their groups and surfaces.
use crate::body::geometry;
use crate::schema::read::{flag, list, number, text};
use crate::text::files::Near;
use crate::text::report::Cx;
use crate::text::value::Text;
use linkwork_collision::{ColliderSpec, Shape, Visibility};
use linkwork_runtime::{Located, Origin, Value};
use linkwork_spatial::Pose;

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
pub(crate) const COLLIDE: [&str; 8] =
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
    pub fn new(
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

pub(crate) struct Options {
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

pub(crate) fn options(cx: &mut Cx, v: &Located, what: &str, files: Near<'_>) -> Options {
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
        geometry::read(cx, c, &what, Some(files)).map(|c| c.0)
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
